// SPDX-License-Identifier: Apache-2.0
#include "src/engine/callback_rules.hpp"

#include <string>

#include "tests/support/arm_parts.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;

namespace {

bool may_call(const ArmParts& arm, const std::string& url) {
  return arm.parts->callback_rules.may_call(subscription::parse_callback_url(url).value());
}

bool is_refused(const ArmParts& arm, const std::string& fields) {
  RequestText request("POST /arm/actions/home" + fields);
  return arm.parts->callback_rules.is_refused_notification(request.get());
}

}  // namespace

TEST_CASE("a server without allowed receivers calls none", "[engine][R0.13][security]") {
  const ArmParts arm;
  CHECK_FALSE(arm.parts->callback_rules.allow_some());
  CHECK_FALSE(may_call(arm, "http://receiver.example/"));
}

TEST_CASE("receivers in the list may be called, but this server itself may not", "[engine][R0.13][security]") {
  ArmParts arm(ArmParts::allowing());
  arm.parts->bases.listens_on("127.0.0.1", 9000, false);
  CHECK(arm.parts->callback_rules.allow_some());
  CHECK(may_call(arm, "http://receiver.example/"));
  CHECK(may_call(arm, "http://127.0.0.1:9001/"));
  CHECK_FALSE(may_call(arm, "http://127.0.0.1:9000/"));
  CHECK_FALSE(may_call(arm, "http://other.example/"));

  ArmRequest get(arm, "GET /arm/angle");
  const auto status = [&](const std::string& url) {
    const auto refused = arm.parts->callback_rules.refused_receiver(get.context, url);
    return refused ? refused->status : 0;
  };
  CHECK(status("http://receiver.example/") == 0);
  CHECK(status("http://127.0.0.1:9000/") == 403);
  CHECK(status("http://other.example/") == 403);
  CHECK(status("/receiver") == 400);
}

TEST_CASE("receivers confirm as the options say", "[engine][R0.13][security]") {
  const auto confirm = [](subscription::Confirmation which, const std::string& url) {
    EngineOptions options = ArmParts::allowing();
    options.callbacks.confirmation = which;
    const ArmParts arm(std::move(options));
    return arm.parts->callback_rules.must_confirm(url);
  };
  CHECK_FALSE(confirm(subscription::Confirmation::none, "http://receiver.example/"));
  CHECK(confirm(subscription::Confirmation::not_loopback, "http://receiver.example/"));
  CHECK_FALSE(confirm(subscription::Confirmation::not_loopback, "http://127.0.0.2:9/"));
  CHECK_FALSE(confirm(subscription::Confirmation::not_loopback, "http://localhost/"));
  CHECK(confirm(subscription::Confirmation::all, "http://127.0.0.1/"));
}

TEST_CASE("the notifications of strangers and its own are no commands", "[engine][R0.16][security]") {
  EngineOptions options;
  options.notification_senders = {"http://arm.example"};
  const ArmParts arm(std::move(options));
  const std::string field = "\n" + std::string(notification_field) + ": ";
  CHECK_FALSE(is_refused(arm, ""));
  CHECK_FALSE(is_refused(arm, field + "1; base=\"http://arm.example\""));
  CHECK(is_refused(arm, field + "1; base=\"http://arm.example:80\""));
  CHECK(is_refused(arm, field + "1; base=\"http://arm.example\"" + field + "1; base=\"http://arm.example\""));
  CHECK(is_refused(arm, field + "1"));

  EngineOptions any;
  any.notification_senders = {"*"};
  const ArmParts trusting(std::move(any));
  CHECK_FALSE(is_refused(trusting, field + "1; base=\"http://arm.example\""));
  CHECK(is_refused(trusting, field + trusting.parts->callback_rules.sender(0)));
}

TEST_CASE("options of callbacks without a meaning are refused", "[engine][R0.13]") {
  const auto error = [](auto set) {
    EngineOptions options;
    set(options.callbacks);
    const ArmParts arm(std::move(options));
    const Result<void> checked = arm.parts->callback_rules.check_options();
    return checked ? std::string() : checked.error().message;
  };
  CHECK(error([](auto&) {}).empty());
  CHECK(error([](auto& c) { c.allow = {"not a host"}; }).find("not a host") != std::string::npos);
  CHECK(error([](auto& c) { c.attempts = 0; }).find("callbacks.attempts") != std::string::npos);
  CHECK(error([](auto& c) { c.secret.assign(201, 's'); }).find("callbacks.secret") != std::string::npos);
}
