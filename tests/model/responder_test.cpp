// SPDX-License-Identifier: Apache-2.0
#include <lrt/responder.hpp>

#include <atomic>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

/// An invocation whose engine is the test.
struct FakeInvocation final : model::InvocationLink {
  void finish(Result<rdf::Value> r) noexcept override {
    ++finished;
    if (!result) result = std::move(r);
  }
  void progress(double f) noexcept override { fraction = f; }
  bool cancelled() const noexcept override { return was_cancelled; }
  void on_cancel(UniqueFunction<void()> h) override { hook = std::move(h); }
  void cancel() {
    was_cancelled = true;
    if (hook) hook();
  }

  std::optional<Result<rdf::Value>> result;
  std::atomic<int> finished{0};
  std::atomic<double> fraction{0};
  bool was_cancelled = false;
  UniqueFunction<void()> hook;
};

struct Split {
  explicit Split(std::size_t n) : parts(Responder(whole).split(n)) {}
  std::string error() const { return whole->result && !*whole->result ? whole->result->error().message : ""; }
  std::shared_ptr<FakeInvocation> whole = std::make_shared<FakeInvocation>();
  std::vector<Responder> parts;
};

}  // namespace

TEST_CASE("an invocation in parts succeeds with its last part, and its progress is their mean", "[model][R0.8]") {
  Split split(4);
  REQUIRE(split.parts.size() == 4);
  split.parts[0].progress(0.5);
  CHECK(split.whole->fraction == 0.125);
  split.parts[1].succeed();
  split.parts[1].succeed();
  CHECK(split.whole->fraction == 0.375);
  split.parts[2].progress(7);
  CHECK(split.whole->fraction == 0.625);
  split.parts[2].succeed();
  split.parts[3].succeed();
  CHECK_FALSE(split.whole->result);
  CHECK_FALSE(split.parts[0].cancelled());
  split.parts[0].succeed();
  REQUIRE(split.whole->result);
  CHECK(*split.whole->result);
  split.parts.clear();
  CHECK(split.whole->finished == 1);
}

TEST_CASE("an invocation in parts fails with the first part that fails, and the others are cancelled", "[model][R0.6]") {
  Split split(3);
  std::string stopped;
  for (std::size_t i = 0; i < 3; ++i) split.parts[i].on_cancel([&stopped, i] { stopped += std::to_string(i); });
  split.parts[0].succeed();
  split.parts[1].fail({Errc::refused, "too far"});
  CHECK(split.error() == "too far");
  CHECK(split.whole->result->error().code == Errc::refused);
  CHECK(stopped == "2");
  CHECK(split.parts[2].cancelled());
  split.parts[2].on_cancel([&] { stopped += "late"; });
  CHECK(stopped == "2late");
  split.parts[2].fail("later");
  CHECK(split.error() == "too far");
}

TEST_CASE("a part that is destroyed fails the invocation, and leaves nothing behind", "[model][R0.6]") {
  Split split(2);
  bool stopped = false;
  split.parts[0].on_cancel([&] { stopped = true; });
  split.parts.pop_back();
  CHECK(split.whole->result->error().code == Errc::dropped);
  CHECK(stopped);
  split.parts.clear();
  std::weak_ptr<FakeInvocation> whole = split.whole;
  split.whole.reset();
  CHECK(whole.expired());
}

TEST_CASE("cancelling an invocation cancels its parts, and one that throws does not keep the others from it", "[model][R0.5]") {
  Split split(3);
  int stopped = 0;
  split.parts[0].on_cancel([&] { ++stopped; });
  split.parts[1].on_cancel([] { throw std::runtime_error("jammed"); });
  split.parts[2].on_cancel([&] { ++stopped; });
  split.whole->cancel();
  CHECK(stopped == 2);
  for (const Responder& part : split.parts) CHECK(part.cancelled());
  split.parts.clear();
  split.whole->cancel();
  CHECK(stopped == 2);
}

TEST_CASE("an invocation in no parts succeeds, an empty responder has parts without effect", "[model]") {
  Split split(0);
  CHECK(split.parts.empty());
  CHECK(*split.whole->result);
  for (const Responder& part : Responder().split(2)) part.succeed();
}

TEST_CASE("the parts of an invocation may end on threads of their own, while it is cancelled", "[model]") {
  for (int round = 0; round < 200; ++round) {
    Split split(4);
    std::atomic<int> stopped{0};
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < 4; ++i)
      threads.emplace_back([&stopped, i, part = std::move(split.parts[i])] {
        part.on_cancel([&stopped] { ++stopped; });
        part.progress(0.5);
        if (i == 3) part.fail("jammed");
        else part.succeed();
      });
    split.whole->cancel();
    for (std::thread& t : threads) t.join();
    CHECK(split.whole->finished == 1);
    CHECK(stopped <= 4);
  }
}
