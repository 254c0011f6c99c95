// SPDX-License-Identifier: Apache-2.0
#include "src/server/body_pool.hpp"

#include <condition_variable>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

engine::BodyJob job(std::string client, std::size_t bytes) {
  return {std::move(client), bytes, [] {}};
}

std::string order(BodyQueue& queue, std::size_t count = 1000) {
  std::string all;
  for (; count > 0; --count) {
    const auto next = queue.take();
    if (!next) break;
    all += next->client + std::to_string(next->bytes) + " ";
  }
  return all;
}

}  // namespace

TEST_CASE("of one client the smallest body comes first", "[server][body]") {
  BodyQueue queue;
  for (const std::size_t bytes : {30, 10, 20}) queue.put(job("a", bytes));
  CHECK_FALSE(queue.empty());
  CHECK(order(queue) == "a10 a20 a30 ");
  CHECK(queue.empty());
}

TEST_CASE("clients get the same share by bytes, not by bodies", "[server][body]") {
  BodyQueue queue;
  for (int i = 0; i < 3; ++i) queue.put(job("a", 100));
  for (int i = 0; i < 9; ++i) queue.put(job("b", 33));
  // After each body of a, about as many bytes of b.
  CHECK(order(queue) == "b33 b33 b33 a100 b33 b33 b33 a100 b33 b33 b33 a100 ");
}

TEST_CASE("a client that comes later begins with what the others have now", "[server][body]") {
  BodyQueue queue;
  for (int i = 0; i < 10; ++i) queue.put(job("a", 100));
  CHECK(order(queue, 5) == "a100 a100 a100 a100 a100 ");
  queue.put(job("b", 90));  // has no credit for the time before the last body of a
  queue.put(job("b", 90));
  queue.put(job("b", 90));
  CHECK(order(queue, 5) == "b90 b90 a100 b90 a100 ");
}

TEST_CASE("a client with one small body after the other does not keep a large one waiting", "[server][body]") {
  BodyQueue queue;
  queue.put(job("a", 1000));
  queue.put(job("c", 5000));
  std::string taken;
  int rounds = 0;
  for (; taken.find('a') == std::string::npos && rounds < 1000; ++rounds) {
    queue.put(job("b", 100));
    taken += order(queue, 1);
  }
  CHECK(rounds <= 11);
}

TEST_CASE("a pool runs all jobs, and drops what has not begun when it stops", "[server][body][threads]") {
  std::mutex mutex;
  std::condition_variable changed;
  int ran = 0;
  bool open = false, begun = false;
  BodyPool pool("test-body", 1, {});
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    ++ran;
    changed.notify_all();
  };
  std::vector<engine::BodyJob> jobs;
  for (int i = 0; i < 3; ++i) jobs.push_back({"a", 1, count});
  pool.put(std::move(jobs));
  {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return ran == 3; });
  }
  std::vector<engine::BodyJob> more;
  more.push_back({"a", 1, [&] {
                    std::unique_lock lock(mutex);
                    begun = true;
                    changed.notify_all();
                    changed.wait(lock, [&] { return open; });
                  }});
  more.push_back({"a", 2, count});
  pool.put(std::move(more));
  std::unique_lock lock(mutex);
  changed.wait(lock, [&] { return begun; });
  open = true;
  changed.notify_all();
  lock.unlock();
  pool.stop();
  const int before = ran;  // 3, or 4 if the worker was quicker than the stop
  std::vector<engine::BodyJob> late;
  late.push_back({"a", 1, count});
  pool.put(std::move(late));
  CHECK(ran == before);
}
