// SPDX-License-Identifier: Apache-2.0
#include "src/transport/http/readiness.hpp"

#include <sys/eventfd.h>

#include <string>

#include "src/transport/http/alarm.hpp"
#include "src/transport/http/client.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::transport;
using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {

/// Writes its name when it is served. It is always ready, and goes on later `more` times.
class Ready final : public Watched {
 public:
  Ready(Readiness& readiness, std::string& log, char name, int more = 0)
      : readiness_(readiness), log_(log), name_(name), more_(more), socket_(::eventfd(1, EFD_CLOEXEC)) {
    REQUIRE(readiness.watch(socket_, *this, EPOLLIN));
  }
  void on_ready(std::uint32_t) override {
    log_ += name_;
    if (more_ > 0) readiness_.later(*this);
  }
  void go_on() override {
    log_ += static_cast<char>(name_ - 'A' + 'a');
    if (--more_ > 0) readiness_.later(*this);
  }
  Socket& socket() { return socket_; }

 private:
  Readiness& readiness_;
  std::string& log_;
  char name_;
  int more_;
  Socket socket_;
};

}  // namespace

TEST_CASE("a descriptor that is always ready does not delay the others, however small the budget", "[transport]") {
  Readiness readiness;
  REQUIRE(readiness.open());
  std::string log;
  Ready a(readiness, log, 'A', 100), b(readiness, log, 'B'), c(readiness, log, 'C');
  const auto steps = [&](int count) {
    for (int i = 0; i < count; ++i) {
      readiness.set_budget(microseconds(0));
      CHECK_FALSE(readiness.serve(0));
    }
    return std::exchange(log, {});
  };
  CHECK(steps(11) == "ABCaABCaABC");
  CHECK(readiness.has_left());
  readiness.close(b.socket());
  CHECK(steps(6) == "aACaAC");
}

TEST_CASE("what is new is served before the rest of what takes many steps", "[transport]") {
  Readiness readiness;
  REQUIRE(readiness.open());
  std::string log;
  Ready a(readiness, log, 'A', 100), b(readiness, log, 'B', 100), c(readiness, log, 'C', 100);
  for (int i = 0; i < 12; ++i) {
    readiness.set_budget(microseconds(0));
    CHECK_FALSE(readiness.serve(0));
  }
  CHECK(log == "ABCaABCbABCc");
}

TEST_CASE("events that are left over do not outlive those they are for", "[transport]") {
  Readiness readiness;
  REQUIRE(readiness.open());
  std::string log;
  Ready a(readiness, log, 'A');
  {
    Ready b(readiness, log, 'B', 1);
    readiness.set_budget(microseconds(0));
    CHECK_FALSE(readiness.serve(0));
    CHECK(readiness.has_left());
    readiness.later(b);
    readiness.drop();
    readiness.close(b.socket());
  }
  CHECK_FALSE(readiness.has_left());
  readiness.set_budget(microseconds(0));
  CHECK_FALSE(readiness.serve(0));
  CHECK(log == "AA");
}

TEST_CASE("a socket may be handed over to another Watched", "[transport]") {
  Readiness readiness;
  REQUIRE(readiness.open());
  std::string log;
  Ready a(readiness, log, 'A'), b(readiness, log, 'B');
  Socket moved = std::move(a.socket());
  CHECK_FALSE(a.socket().is_open());
  REQUIRE(readiness.watch(moved, b, EPOLLIN));
  REQUIRE(readiness.watch(b.socket(), b, 0));
  readiness.set_budget(microseconds(0));
  CHECK_FALSE(readiness.serve(0));
  CHECK(log == "B");
}

TEST_CASE("an alarm rings until it is silenced or set anew, and is not set for what comes later than it rings", "[transport]") {
  Readiness readiness;
  Alarm alarm;
  REQUIRE(readiness.open());
  REQUIRE(alarm.open(readiness));
  const auto begin = std::chrono::steady_clock::now();
  const auto rings = [&](int wait) {
    epoll_event event{};
    const bool ready = ::epoll_wait(readiness.descriptor(), &event, 1, wait) == 1;
    readiness.set_budget(milliseconds(1));
    if (ready) static_cast<Watched*>(event.data.ptr)->on_ready(event.events);
    return ready;
  };
  alarm.set(begin + std::chrono::hours(1), begin);
  CHECK_FALSE(rings(0));
  alarm.set(begin + microseconds(100), begin);
  alarm.set(begin + std::chrono::hours(2), begin);
  CHECK(rings(20'000));
  CHECK(rings(0));
  alarm.clear();
  CHECK_FALSE(rings(0));
  alarm.set(begin, begin);
  CHECK(rings(20'000));
  alarm.set(begin + std::chrono::hours(1), begin);
  CHECK_FALSE(rings(0));
}
