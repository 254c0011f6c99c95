// SPDX-License-Identifier: Apache-2.0
#include "src/engine/host_calls.hpp"

#include <atomic>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::engine;

namespace {

class CountingWaker final : public Waker {
 public:
  void wake() noexcept override { ++count; }
  std::atomic<int> count{0};
};

struct Calls {
  std::shared_ptr<CancelToken> call(Result<int> (*work)(), Dispatch where = Dispatch::as_server) {
    return calls.call<int>(where, work, [this](Result<int> result, TimePoint) { results.push_back(std::move(result)); });
  }
  HostCalls calls{Dispatch::executor, 2};
  std::vector<Result<int>> results;
};

}  // namespace

TEST_CASE("a call runs where its Dispatch says, and its result comes back through the inbox", "[engine][R0.5]") {
  Calls c;
  c.call([]() -> Result<int> { return 7; });
  c.call([]() -> Result<int> { return 8; }, Dispatch::io_thread);
  auto jobs = c.calls.take_jobs();
  REQUIRE(jobs.size() == 2);
  CHECK(jobs[0].where == Dispatch::executor);
  CHECK(jobs[1].where == Dispatch::io_thread);
  CHECK(c.calls.take_jobs().empty());
  std::thread([&] { jobs[0].run(); }).join();
  CHECK(c.results.empty());
  CHECK_FALSE(c.calls.inbox()->empty());
  c.calls.inbox()->run_all({});
  REQUIRE(c.results.size() == 1);
  CHECK(*c.results[0] == 7);
}

TEST_CASE("what user code throws becomes an error", "[engine][R0.6]") {
  Calls c;
  c.call([]() -> Result<int> { throw std::runtime_error("no voltage"); });
  c.call([]() -> Result<int> { throw 5; });
  for (auto& job : c.calls.take_jobs()) job.run();
  c.calls.inbox()->run_all({});
  REQUIRE(c.results.size() == 2);
  CHECK(c.results[0].error().message.find("no voltage") != std::string::npos);
  CHECK(c.results[1].error().code == Errc::failed);
}

TEST_CASE("a call that is cancelled before it begins does not run, and says so", "[engine][R0.6]") {
  static int ran = 0;
  ran = 0;
  Calls c;
  const auto token = c.call([]() -> Result<int> { return ++ran; });
  CHECK(token->cancel());
  CHECK_FALSE(token->cancel());
  for (auto& job : c.calls.take_jobs()) job.run();
  c.calls.inbox()->run_all({});
  CHECK(ran == 0);
  REQUIRE(c.results.size() == 1);
  CHECK(c.results[0].error().code == Errc::cancelled);
}

TEST_CASE("a call that runs cannot be cancelled, and runs once", "[engine][R0.6]") {
  CancelToken token;
  CHECK(token.take());
  CHECK_FALSE(token.cancel());
  CHECK_FALSE(token.take());
  CancelToken cancelled;
  CHECK(cancelled.cancel());
  CHECK_FALSE(cancelled.take());
}

TEST_CASE("calls that have not run make an overload, until they run or are dropped", "[engine][limits]") {
  Calls c;
  c.call([]() -> Result<int> { return 1; });
  CHECK_FALSE(c.calls.overloaded());
  c.call([]() -> Result<int> { return 2; });
  CHECK(c.calls.overloaded());
  auto jobs = c.calls.take_jobs();
  CHECK(c.calls.overloaded());
  jobs[0].run();
  jobs.erase(jobs.begin());
  CHECK_FALSE(c.calls.overloaded());
  jobs.clear();
  c.calls.inbox()->run_all({});
  REQUIRE(c.results.size() == 2);
  CHECK(c.results[0].value() == 1);
  CHECK(c.results[1].error().code == Errc::unavailable);  // so that nobody waits for it
}

TEST_CASE("calls for the I/O thread are no part of an overload, because a busy host does not delay them", "[engine][limits]") {
  HostCalls calls(Dispatch::in_poll, 2);
  for (int i = 0; i < 5; ++i) calls.run(Dispatch::io_thread, [] {});
  CHECK_FALSE(calls.overloaded());
  for (int i = 0; i < 2; ++i) calls.run(Dispatch::as_server, [] {});
  CHECK(calls.overloaded());
  CHECK(calls.overloaded(Dispatch::as_server));
  CHECK_FALSE(calls.overloaded(Dispatch::io_thread));
  CHECK_FALSE(HostCalls(Dispatch::io_thread, 0).overloaded(Dispatch::as_server));
}

TEST_CASE("the inbox keeps the order, wakes, and outlives the engine", "[engine]") {
  const auto inbox = std::make_shared<Inbox>();
  const auto waker = std::make_shared<CountingWaker>();
  std::vector<int> order;
  inbox->put([&](TimePoint) { order.push_back(1); });  // nobody to wake yet
  inbox->set_waker(waker);
  inbox->put([&](TimePoint) {
    order.push_back(2);
    inbox->put([&](TimePoint) { order.push_back(3); });
  });
  CHECK(waker->count == 1);
  inbox->run_all({});
  CHECK(order == std::vector<int>{1, 2});
  CHECK_FALSE(inbox->empty());
  inbox->run_all({});
  CHECK(order == std::vector<int>{1, 2, 3});
  std::shared_ptr<Inbox> left;
  {
    HostCalls calls{Dispatch::in_poll, 1};
    left = calls.inbox();
  }
  left->put([](TimePoint) {});
}
