// SPDX-License-Identifier: Apache-2.0
// What publish() costs the control loop while 0, 10 and 1,000 WebSockets observe the property: each call timed, allocations and system
// calls of the publishing thread counted.
//
//   publish_bench [--tick]
//
// Two rhythms: as fast as it goes, and 40 properties at 1 kHz, of which each is observed. The subscribers are a process of their own.
// The time of reading the clock is measured and taken off.

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <new>
#include <thread>
#include <vector>

#include <lrt/lrt.hpp>

#include "tests/bench/ws_client.hpp"

namespace {
thread_local std::size_t allocations = 0, system_calls = 0;
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

/// The system call by which a sleeping server is woken.
extern "C" ssize_t write(int fd, const void* data, size_t size) {
  ++system_calls;
  return ::syscall(SYS_write, fd, data, size);
}

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t property_count = 40;

/// Opens sockets when told a number and a port, reads and forgets what comes, until the pipe closes.
[[noreturn]] void subscribe(int orders, int done) {
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = orders;
  ::epoll_ctl(epoll, EPOLL_CTL_ADD, orders, &event);
  std::string buffer(256 * 1024, '\0');
  std::vector<int> open;
  while (true) {
    epoll_event events[256];
    const int ready = ::epoll_wait(epoll, events, 256, -1);
    for (int i = 0; i < ready; ++i) {
      const int fd = events[i].data.fd;
      if (fd != orders) {
        if (::recv(fd, buffer.data(), buffer.size(), 0) <= 0) ::epoll_ctl(epoll, EPOLL_CTL_DEL, fd, nullptr);
        continue;
      }
      int order[2];  // port, clients
      if (::read(orders, order, sizeof order) != sizeof order) ::_exit(0);
      for (const int old : open) ::close(old);
      open.clear();
      for (int n = 0; n < order[1]; ++n) {
        std::string ignored;
        open.push_back(bench::open_websocket(order[0], "/arm/p" + std::to_string(static_cast<std::size_t>(n) % property_count), ignored));
        event.data.fd = open.back();
        ::epoll_ctl(epoll, EPOLL_CTL_ADD, open.back(), &event);
      }
      const char ok = 1;
      if (::syscall(SYS_write, done, &ok, 1) != 1) ::_exit(1);
    }
  }
}

struct Row {
  std::vector<double> ns;
  std::size_t allocations = 0, system_calls = 0;
};

void print(const char* what, int clients, Row row, double clock_ns) {
  std::sort(row.ns.begin(), row.ns.end());
  const auto at = [&](double part) { return row.ns[static_cast<std::size_t>(part * static_cast<double>(row.ns.size() - 1))] - clock_ns; };
  std::printf("%5d subscribers, %-22s median %6.0f ns   99.9 %% %7.0f ns   max %9.0f ns   %zu allocations   %zu system calls in %zu\n", clients, what,
              at(0.5), at(0.999), at(1), row.allocations, row.system_calls, row.ns.size());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  int orders[2], done[2];
  if (::pipe2(orders, O_CLOEXEC) != 0 || ::pipe2(done, O_CLOEXEC) != 0) return 1;
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(orders[1]);
    ::close(done[0]);
    subscribe(orders[0], done[1]);
  }
  ::close(orders[0]);
  ::close(done[1]);

  lrt::Options options;
  options.listen.port = 0;
  options.subscriptions.always_scan = argc > 1 && std::string(argv[1]) == "--tick";
  lrt::Server server = lrt::Server::create(options).value();
  lrt::Thing arm{"arm"};
  std::vector<lrt::PushedProperty<double>> properties;
  for (std::size_t i = 0; i < property_count; ++i) properties.push_back(arm.property<double>("p" + std::to_string(i)));
  for (auto& p : properties) p.publish(0);
  server.add(std::move(arm)).value();

  std::vector<double> empty;
  for (int i = 0; i < 100'000; ++i) {
    const auto start = Clock::now();
    empty.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count());
  }
  std::nth_element(empty.begin(), empty.begin() + 50'000, empty.end());
  const double clock_ns = empty[50'000];
  std::printf("%s; reading the clock takes %.0f ns and is taken off\n", options.subscriptions.always_scan ? "tick" : "woken when it sleeps",
              clock_ns);

  double t = 0;
  for (const int clients : {0, 10, 1000}) {
    const int order[2] = {server.port(), clients};
    char ok = 0;
    if (::syscall(SYS_write, orders[1], order, sizeof order) != sizeof order || ::read(done[0], &ok, 1) != 1) return 1;
    const auto run = [&](std::size_t steps, std::chrono::microseconds period) {
      Row row;
      row.ns.reserve(steps * property_count);
      auto next = Clock::now();
      const std::size_t a = allocations, s = system_calls;
      for (std::size_t step = 0; step < steps; ++step) {
        t += 0.001;
        for (auto& p : properties) {
          const auto start = Clock::now();
          p.publish(t);
          row.ns.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count());
        }
        if (period.count() > 0) std::this_thread::sleep_until(next += period);
      }
      row.allocations = allocations - a;
      row.system_calls = system_calls - s;
      return row;
    };
    print("as fast as it goes", clients, run(25'000, {}), clock_ns);
    print("40 at 1 kHz", clients, run(3'000, std::chrono::milliseconds(1)), clock_ns);
    print("40 at 10 Hz", clients, run(30, std::chrono::milliseconds(100)), clock_ns);
  }
  ::close(orders[1]);
  int status = 0;
  ::waitpid(child, &status, 0);
  server.stop();
}
