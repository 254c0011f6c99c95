// SPDX-License-Identifier: Apache-2.0
#include "src/subscription/retry_policy.hpp"

#include <chrono>
#include <optional>
#include <vector>

#include "tests/support/catch.hpp"

using namespace std::chrono_literals;
using lrt::subscription::CallbackOptions;
using lrt::subscription::RetryPolicy;

namespace {
constexpr double middle = 0.5;  // the pause times 1

CallbackOptions short_options() {
  CallbackOptions options;
  options.attempts = 5;
  options.first_pause = 100ms;
  options.max_pause = 300ms;
  options.suspended_pause = 1000ms;
  options.suspended_attempts = 2;
  return options;
}
}  // namespace

TEST_CASE("pauses double up to max_pause, then the subscription is suspended, then it ends", "[subscription][R0.13]") {
  const CallbackOptions options = short_options();
  RetryPolicy policy(options);
  CHECK_FALSE(policy.tried());
  for (const auto pause : {100ms, 200ms, 300ms, 300ms}) {
    CHECK(policy.failed(middle) == pause);
    CHECK(policy.tried());
    CHECK_FALSE(policy.suspended());
  }
  for (int i = 0; i < 2; ++i) {
    CHECK(policy.failed(middle) == 1000ms);
    CHECK(policy.suspended());
  }
  CHECK(policy.failed(middle) == std::nullopt);
}

TEST_CASE("a success starts the pauses again and ends a suspension", "[subscription][R0.13]") {
  const CallbackOptions options = short_options();
  RetryPolicy policy(options);
  for (int i = 0; i < 5; ++i) (void)policy.failed(middle);
  CHECK(policy.suspended());
  policy.succeeded();
  CHECK_FALSE(policy.suspended());
  CHECK_FALSE(policy.tried());
  CHECK(policy.failed(middle) == 100ms);
}

TEST_CASE("chance spreads a pause from half to one and a half", "[subscription][R0.13]") {
  const CallbackOptions options = short_options();
  CHECK(RetryPolicy(options).failed(0.0) == 50ms);
  CHECK(RetryPolicy(options).failed(0.99) == 149ms);
}
