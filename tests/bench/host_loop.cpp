// SPDX-License-Identifier: Apache-2.0
// What lrt does to a control loop that has it in its own thread (Io::in_poll): a 1 kHz loop that works 50 us, publishes 40 properties and
// polls. Printed: how late it wakes up, how long poll() takes, and how much of that it was on a CPU: the rest is the system's doing,
// unless poll() slept.
//
//   host_loop [--without] [--transport http|libwebsockets] [--tls DIR] [--seconds 20] [--warm-up 3] [--budget 200] [--work 50] [--fifo PRIORITY]
//
// --without: the same loop without lrt. Says where it listens, measures for so many seconds after the warm-up, prints one line, and goes
// on until SIGINT or SIGTERM, so that clients see no end. Things to ask for: /arm/p1 to /arm/p40; PUT /arm/target, POST /arm/actions/move.
// Lateness is against the schedule, which does not wait for a loop that is behind. Exits with 1 if the process had a second thread.

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/lrt.hpp>

#include "tests/bench/transport_option.hpp"

namespace {

volatile std::sig_atomic_t ended = 0;

double microseconds(clockid_t clock = CLOCK_MONOTONIC) {
  timespec now{};
  ::clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) / 1e3;
}

/// How often this thread has given up its CPU by itself.
long sleeps() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nvcsw;
}

std::string spread(std::vector<double>& us) {
  if (us.empty()) return "-";
  std::sort(us.begin(), us.end());
  const auto at = [&](double part) { return us[static_cast<std::size_t>(part * static_cast<double>(us.size() - 1))]; };
  char text[80];
  std::snprintf(text, sizeof text, "%.1f %.1f %.1f %.1f", at(0.5), at(0.99), at(0.999), at(1));
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  bool without = false;
  double seconds = 20, warm_up = 3, work_us = 50;
  std::chrono::microseconds budget(200);
  lrt::Options options;
  options.listen.port = 0;
  options.threads.io = lrt::Io::in_poll;
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--without") without = true;
    else if (i + 1 == argc) return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
    else if (name == "--transport") bench::use_transport(argv[++i], options);
    else if (name == "--tls") bench::use_tls(argv[++i], options);
    else if (name == "--seconds") seconds = std::atof(argv[++i]);
    else if (name == "--warm-up") warm_up = std::atof(argv[++i]);
    else if (name == "--budget") budget = std::chrono::microseconds(std::atol(argv[++i]));
    else if (name == "--work") work_us = std::atof(argv[++i]);
    else if (name == "--fifo") {
      sched_param priority{};
      priority.sched_priority = std::atoi(argv[++i]);
      if (::sched_setscheduler(0, SCHED_FIFO, &priority) != 0) return std::perror("SCHED_FIFO"), 1;
    } else return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  std::signal(SIGINT, [](int) { ended = 1; });
  std::signal(SIGTERM, [](int) { ended = 1; });

  std::optional<lrt::Server> server;
  std::vector<lrt::PushedProperty<double>> properties;
  double target = 0;
  if (!without) {
    server = lrt::Server::create(std::move(options)).value();
    lrt::Thing arm{"arm"};
    for (int i = 1; i <= 40; ++i) properties.push_back(arm.property<double>("p" + std::to_string(i), lrt::unit::radian));
    arm.property(
           "target", [&] { return target; }, lrt::unit::radian)
        .between(-3, 3)
        .on_write([&](double wanted) { target = wanted; });
    arm.action("move", [&](double wanted) { target = wanted; });
    server->add(std::move(arm)).value();
    std::printf("listening on %s\n", server->url().c_str());
    std::fflush(stdout);
  }

  const auto warm_steps = static_cast<std::size_t>(warm_up * 1e3);
  const std::size_t steps = warm_steps + static_cast<std::size_t>(seconds * 1e3);
  std::vector<double> late, polls, cpu;
  for (auto* column : {&late, &polls, &cpu}) column->reserve(steps);
  std::ptrdiff_t threads = 0;
  long slept = 0;  // in poll(), which must not
  double angle = 0;
  timespec next{};
  ::clock_gettime(CLOCK_MONOTONIC, &next);
  for (std::size_t step = 0; !ended; ++step) {
    next.tv_nsec += 1'000'000;
    if (next.tv_nsec >= 1'000'000'000) next.tv_nsec -= 1'000'000'000, ++next.tv_sec;
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr) != 0 && !ended) continue;
    const double woken = microseconds();
    const double planned = static_cast<double>(next.tv_sec) * 1e6 + static_cast<double>(next.tv_nsec) / 1e3;
    while (microseconds() < woken + work_us) continue;  // the control law
    double polled = 0, used = 0;
    if (server) {
      angle += 0.001;
      for (auto& property : properties) property.publish(angle);
      const long sleeps_before = sleeps();
      const double start = microseconds(), cpu_start = microseconds(CLOCK_THREAD_CPUTIME_ID);
      server->poll(budget);
      used = microseconds(CLOCK_THREAD_CPUTIME_ID) - cpu_start;
      polled = microseconds() - start;
      slept += sleeps() - sleeps_before;
    }
    if (step >= warm_steps && step < steps) {
      late.push_back(woken - planned);
      if (!server) continue;
      polls.push_back(polled);
      cpu.push_back(used);
    } else if (step == steps) {
      namespace fs = std::filesystem;
      threads = std::distance(fs::directory_iterator("/proc/self/task"), fs::directory_iterator());
      std::printf("late %s poll %s cpu %s us, 50 99 99.9 100 %%, %zu steps, %td threads, poll() slept %ld times\n", spread(late).c_str(),
                  spread(polls).c_str(), spread(cpu).c_str(), late.size(), threads, slept);
      std::fflush(stdout);
      if (without) break;
    }
  }
  if (server) server->stop();
  return threads > 1 ? 1 : 0;
}
