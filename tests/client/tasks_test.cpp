// SPDX-License-Identifier: Apache-2.0
#include "src/client/tasks.hpp"

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/watchdog.hpp"

namespace lrt {
namespace {

using client::Tasks;

/// Something that threads wait for.
class Gate {
 public:
  void open() {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }
  void wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_open_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = false;
};

TEST_CASE("tasks run at the same time, up to the limit of threads", "[client]") {
  const test::Watchdog watchdog("tasks");
  Tasks tasks({}, 3, system_clock());
  Gate first, second, all;
  std::atomic<int> begun{0}, done{0};
  for (int i = 0; i < 5; ++i) {
    REQUIRE(tasks.run([&] {
      if (++begun == 3) first.open();
      second.wait();
      if (++done == 5) all.open();
    }));
  }
  first.wait();  // three of them have begun, though none has ended
  CHECK(begun == 3);
  second.open();
  all.wait();
}

TEST_CASE("a task that is due later waits for its clock", "[client]") {
  const test::Watchdog watchdog("tasks");
  test::FakeClock clock;
  Tasks tasks({}, 2, clock);
  Gate ran;
  std::atomic<bool> is_early{true};
  REQUIRE(tasks.run_at(clock.now().steady + std::chrono::hours(1), [&] {
    CHECK_FALSE(is_early);
    ran.open();
  }));
  Gate other;
  REQUIRE(tasks.run([&] { other.open(); }));
  other.wait();
  is_early = false;
  clock.advance(std::chrono::hours(1));
  tasks.check();
  ran.wait();
}

TEST_CASE("an exception of a task is dropped", "[client]") {
  const test::Watchdog watchdog("tasks");
  Tasks tasks({}, 1, system_clock());
  Gate ran;
  tasks.run([] { throw std::runtime_error("x"); });
  tasks.run([&] { ran.open(); });
  ran.wait();
}

TEST_CASE("after stop() no task begins, and those that have begun have ended", "[client]") {
  const test::Watchdog watchdog("tasks");
  Tasks tasks({}, 1, system_clock());
  Gate begun, go;
  std::atomic<bool> ended{false}, other{false};
  tasks.run([&] {
    begun.open();
    go.wait();
    ended = true;
  });
  begun.wait();
  tasks.run([&] { other = true; });
  std::thread opener([&] {
    while (tasks.run([] {})) std::this_thread::yield();  // until stop() has begun
    go.open();
  });
  tasks.stop();
  opener.join();
  CHECK(ended);
  CHECK_FALSE(other);
  CHECK_FALSE(tasks.run([] {}));
}

TEST_CASE("a task can stop the tasks", "[client]") {
  const test::Watchdog watchdog("tasks");
  auto tasks = std::make_unique<Tasks>(ThreadOptions(), 2, system_clock());
  Gate destroyed;
  tasks->run([&] {
    tasks.reset();
    destroyed.open();
  });
  destroyed.wait();
}

}  // namespace
}  // namespace lrt
