// SPDX-License-Identifier: Apache-2.0
// Jobs take turns, by a clock that they move themselves: a unit of work is a millisecond.
#include "src/server/work_pool.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/shacl/shapes.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/base/turns.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

std::atomic<std::int64_t> milliseconds_passed{0};
WorkPool::Instant own_clock() noexcept { return WorkPool::Instant(std::chrono::milliseconds(milliseconds_passed.load())); }

void work_for(int milliseconds) {
  for (; milliseconds > 0; --milliseconds) {
    ++milliseconds_passed;
    Turns::rest_now();
  }
}

template <class Condition>
bool becomes_true(Condition holds) {
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30); std::chrono::steady_clock::now() < end;) {
    if (holds()) return true;
    std::this_thread::yield();
  }
  return false;
}

template <class Work>
engine::BodyJob job(std::string client, std::size_t bytes, Work work) {
  return {std::move(client), bytes, std::move(work)};
}

template <class... Jobs>
void put(WorkPool& pool, Jobs... jobs) {
  std::vector<engine::BodyJob> all;
  (all.push_back(std::move(jobs)), ...);
  pool.put(std::move(all));
}

/// Work until it is over, which counts its milliseconds.
class Endless {
 public:
  engine::BodyJob of(std::string client, std::atomic<std::int64_t>& time) {
    return job(std::move(client), 1, [this, &time] {
      ++begun;
      while (!over) {
        while (stands && !over) std::this_thread::yield();
        work_for(1);
        ++time;
      }
      ++ended;
    });
  }
  std::atomic<bool> over{false};
  std::atomic<bool> stands{false};  ///< meanwhile no time passes
  std::atomic<int> begun{0}, ended{0};
};

}  // namespace

TEST_CASE("a short job of one client ends while 16 endless ones of another take turns", "[server][threads][fair]") {
  Endless endless;
  std::atomic<std::int64_t> of_a{0};
  std::atomic<int> done{0};
  WorkPool pool("test-work", 1, {}, &own_clock);
  for (int i = 0; i < 16; ++i) put(pool, endless.of("a", of_a));
  REQUIRE(becomes_true([&] { return of_a > 50; }));
  for (int i = 1; i <= 3; ++i) {
    put(pool, job("b", 1, [&] {
          work_for(20);  // more than a slice
          ++done;
        }));
    REQUIRE(becomes_true([&] { return done == i; }));
  }
  CHECK(endless.begun == 1);  // those of one client do not take turns
  CHECK(endless.ended == 0);
  endless.over = true;
  CHECK(becomes_true([&] { return endless.ended == 16; }));
}

TEST_CASE("clients get the same time, however many jobs they have, and one runs at a time", "[server][threads][fair]") {
  Endless endless;
  std::atomic<std::int64_t> of_a{0}, of_b{0}, of_c{0};
  WorkPool pool("test-work", 1, {}, &own_clock);
  std::vector<engine::BodyJob> jobs;
  for (int i = 0; i < 8; ++i) jobs.push_back(endless.of("a", of_a));
  jobs.push_back(endless.of("b", of_b));
  pool.put(std::move(jobs));
  REQUIRE(becomes_true([&] { return of_a + of_b > 400; }));
  put(pool, endless.of("c", of_c));
  REQUIRE(becomes_true([&] { return of_c > 200; }));
  endless.over = true;
  REQUIRE(becomes_true([&] { return endless.ended == 10; }));
  const std::int64_t a = of_a, b = of_b, c = of_c, all = milliseconds_passed;
  CAPTURE(a, b, c, all);
  CHECK(std::abs(a - b) < 40);
  CHECK(c < a);  // it has no credit for the time before it came, ...
  CHECK(a - c > 100);
}

TEST_CASE("who has used the threads alone does not wait longer for that", "[server][threads][fair]") {
  Endless endless;
  std::atomic<std::int64_t> before{0}, of_b{0};
  WorkPool pool("test-work", 1, {}, &own_clock);
  put(pool, endless.of("a", before));
  REQUIRE(becomes_true([&] { return before > 2'000; }));
  std::atomic<std::int64_t> at_begin{0};
  endless.stands = true;                                      // or a would work on while b comes, and b has that much to catch up
  put(pool, job("b", 0, [&] { at_begin = before.load(); }));  // a is paused
  for (int i = 0; i < 4; ++i) put(pool, endless.of("b", of_b));
  endless.stands = false;
  REQUIRE(becomes_true([&] { return of_b > 200; }));
  endless.over = true;
  REQUIRE(becomes_true([&] { return endless.ended == 5; }));
  const std::int64_t a = before - at_begin, b = of_b;
  CAPTURE(a, b);
  CHECK(std::abs(a - b) < 40);
}

TEST_CASE("of one client the smallest job comes first", "[server][threads]") {
  std::mutex mutex;
  std::condition_variable changed;
  bool open = false;
  std::string order;
  WorkPool pool("test-work", 1, {});
  put(pool, job("a", 1, [&] {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return open; });
      }));
  std::vector<engine::BodyJob> jobs;
  for (const std::size_t bytes : {30, 10, 20})
    jobs.push_back(job("a", bytes, [&, bytes] {
      const std::lock_guard lock(mutex);
      order += std::to_string(bytes) + " ";
      changed.notify_all();
    }));
  pool.put(std::move(jobs));
  std::unique_lock lock(mutex);
  open = true;
  changed.notify_all();
  REQUIRE(changed.wait_for(lock, std::chrono::seconds(30), [&] { return order.size() == 9; }));
  CHECK(order == "10 20 30 ");
}

TEST_CASE("a job that waits for other work leaves its place, and no further job of its client begins", "[server][threads][fair]") {
  std::mutex mutex;
  std::condition_variable changed;
  bool open = false, waits = false, second = false;
  int others = 0;
  WorkPool pool("test-work", 1, {});
  put(pool,
      job("a", 1,
          [&] {
            std::unique_lock lock(mutex);
            const Turns::Waiting outside;
            waits = true;
            changed.notify_all();
            changed.wait(lock, [&] { return open; });
          }),
      job("a", 2, [&] {
        const std::lock_guard lock(mutex);
        second = true;
        changed.notify_all();
      }));
  std::unique_lock lock(mutex);
  REQUIRE(changed.wait_for(lock, std::chrono::seconds(30), [&] { return waits; }));
  lock.unlock();
  for (int i = 0; i < 3; ++i)
    put(pool, job("b", 1, [&] {
          const std::lock_guard guard(mutex);
          ++others;
          changed.notify_all();
        }));
  lock.lock();
  REQUIRE(changed.wait_for(lock, std::chrono::seconds(30), [&] { return others == 3; }));
  CHECK_FALSE(second);
  open = true;
  changed.notify_all();
  REQUIRE(changed.wait_for(lock, std::chrono::seconds(30), [&] { return second; }));
}

TEST_CASE("a pool stops while jobs run, are paused, wait outside and have not begun", "[server][threads][fair]") {
  for (const std::size_t running : {1U, 2U, 3U}) {
    Endless endless;
    std::atomic<std::int64_t> time{0};
    std::atomic<bool> waits{false};
    {
      WorkPool pool("test-work", running, {}, &own_clock);
      std::vector<engine::BodyJob> jobs;
      for (int i = 0; i < 6; ++i)
        for (const char* client : {"a", "b", "c", "d"}) jobs.push_back(endless.of(client, time));
      jobs.push_back(job("e", 1, [&] {
        const Turns::Waiting outside;
        waits = true;
        while (!endless.over) std::this_thread::yield();
      }));
      pool.put(std::move(jobs));
      REQUIRE(becomes_true([&] { return waits && endless.begun >= 4; }));  // so that some are paused
      std::thread ending([&] {
        while (endless.begun < 4) std::this_thread::yield();
        endless.over = true;  // as the owner of queries does before stop()
      });
      pool.stop();
      ending.join();
      put(pool, endless.of("a", time));  // is destroyed
    }
    CHECK(endless.ended == endless.begun);
    CHECK(endless.begun <= 24);
  }
}

namespace {

class Counted final : public Turns {
 public:
  Counted() { set_current(this); }
  ~Counted() override { set_current(nullptr); }
  Duration rest() noexcept override { return ++rests, Duration(0); }
  void leave() noexcept override {}
  void come_back() noexcept override {}
  std::size_t rests = 0;
};

}  // namespace

TEST_CASE("large documents are read, and large graphs judged, in turns", "[server][fair]") {
  std::string n_triples, json = "{\"@graph\":[", xml = "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns:u=\"http://u/\">";
  for (int i = 0; i < 2'000; ++i) {
    const std::string at = std::to_string(i);
    n_triples += "<u:n" + at + "> <u:value> \"" + at + "\" .\n";
    json.append(i == 0 ? "" : ",").append("{\"@id\":\"u:n" + at + "\",\"u:value\":\"" + at + "\"}");
    xml += "<rdf:Description rdf:about=\"http://u/n" + at + "\"><u:value>" + at + "</u:value></rdf:Description>";
  }
  json += "]}";
  xml += "</rdf:RDF>";
  const auto shapes = rdf::read(
      "@prefix sh: <http://www.w3.org/ns/shacl#> . <u:s> a sh:NodeShape ; sh:targetSubjectsOf <u:value> ; sh:property [ sh:path "
      "<u:value> ; sh:maxCount 1 ; sh:minLength 1 ] .",
      rdf::Syntax::turtle, {});
  REQUIRE(shapes);
  const auto compiled = shacl::Shapes::compile(*shapes);
  REQUIRE(compiled);
  Counted turns;
  const auto graph = rdf::read(n_triples, rdf::Syntax::n_triples, {});
  REQUIRE(graph);
  CHECK(turns.rests > 20);
  turns.rests = 0;
  CHECK(rdf::read(n_triples, rdf::Syntax::turtle, {}));
  CHECK(turns.rests > 20);
  turns.rests = 0;
  CHECK(rdf::read(json, rdf::Syntax::json_ld, {}));
  CHECK(turns.rests > 20);
  turns.rests = 0;
  const auto of_xml = rdf::read(xml, rdf::Syntax::rdf_xml, {});
  CHECK((of_xml ? of_xml->size() == 2'000 : of_xml.error().code == Errc::unsupported_syntax));
  CHECK(turns.rests == 0);  // it is a call of a third party, which exit() waits for
  CHECK(Turns::current() == &turns);
  const auto report = shacl::validate(*compiled, *graph);
  REQUIRE(report);
  CHECK(report->conforms());
  CHECK(turns.rests > 20);
  turns.rests = 0;
  {
    const Turns::Held held;
    CHECK(shacl::validate(*compiled, *graph));
    CHECK(rdf::read(n_triples, rdf::Syntax::turtle, {}));
  }
  CHECK(turns.rests == 0);
  CHECK(Turns::current() == &turns);
}
