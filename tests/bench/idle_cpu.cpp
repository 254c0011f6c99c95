// SPDX-License-Identifier: Apache-2.0
// What lrt costs a host at 1 kHz that nobody talks to: in each step the loop publishes and polls, and sleeps until the next.
//
//   idle_cpu [--properties 1] [--in-poll] [--seconds 5] [--json]
//
// Printed: CPU of publish() and poll() for a step, median and mean, without that of the measurement itself; CPU of lrt's own threads; and both
// as a share of a core.

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/lrt.hpp>

namespace {

double cpu_microseconds(clockid_t clock) {
  timespec now{};
  ::clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) / 1e3;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t count = 1;
  double seconds = 5;
  bool json = false;
  lrt::Options options;
  options.listen.port = 0;
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--in-poll") options.threads.io = lrt::Io::in_poll;
    else if (name == "--json") json = true;
    else if (name == "--properties" && i + 1 < argc) count = static_cast<std::size_t>(std::atol(argv[++i]));
    else if (name == "--seconds" && i + 1 < argc) seconds = std::atof(argv[++i]);
    else return std::fprintf(stderr, "usage: idle_cpu [--properties N] [--in-poll] [--seconds N] [--json]\n"), 2;
  }
  const bool in_poll = options.threads.io == lrt::Io::in_poll;
  lrt::Server server = lrt::Server::create(std::move(options)).value();
  lrt::Thing arm{"arm"};
  std::vector<lrt::PushedProperty<double>> properties;
  for (std::size_t i = 0; i < count; ++i) properties.push_back(arm.property<double>("p" + std::to_string(i), lrt::unit::radian));
  server.add(std::move(arm)).value();

  const auto steps = static_cast<std::size_t>(seconds * 1e3);
  std::vector<double> used;
  used.reserve(steps);
  double measuring = 0, angle = 0, before = 0, before_thread = 0;
  timespec next{};
  ::clock_gettime(CLOCK_MONOTONIC, &next);
  for (std::size_t step = 0; step < steps + 500; ++step) {
    if (step == 500) {  // the first half second warms up
      used.clear();
      measuring = 0;
      before = cpu_microseconds(CLOCK_PROCESS_CPUTIME_ID);
      before_thread = cpu_microseconds(CLOCK_THREAD_CPUTIME_ID);
    }
    next.tv_nsec += 1'000'000;
    if (next.tv_nsec >= 1'000'000'000) next.tv_nsec -= 1'000'000'000, ++next.tv_sec;
    ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr);
    (void)cpu_microseconds(CLOCK_THREAD_CPUTIME_ID);
    const double empty = cpu_microseconds(CLOCK_THREAD_CPUTIME_ID);
    const double begin = cpu_microseconds(CLOCK_THREAD_CPUTIME_ID);
    angle += 0.001;
    for (auto& property : properties) property.publish(angle);
    server.poll(std::chrono::microseconds(200));
    used.push_back(cpu_microseconds(CLOCK_THREAD_CPUTIME_ID) - begin);
    measuring += begin - empty;
  }
  const double thread = cpu_microseconds(CLOCK_THREAD_CPUTIME_ID) - before_thread;
  const double others = cpu_microseconds(CLOCK_PROCESS_CPUTIME_ID) - before - thread;
  const double n = static_cast<double>(steps), measured = measuring / n;
  double sum = 0;
  for (const double us : used) sum += us;
  std::sort(used.begin(), used.end());
  const double median = used[used.size() / 2] - measured, mean = sum / n - measured, other = others / n;
  const double percent = (mean + other) / 1000 * 100;
  if (json)
    std::printf(
        "{\"bench\": \"idle_cpu\", \"properties\": %zu, \"io\": \"%s\", \"step_cpu_us_median\": %.3f, \"step_cpu_us\": %.3f, "
        "\"other_threads_cpu_us_per_step\": %.3f, \"percent_of_core\": %.4f}\n",
        count, in_poll ? "in_poll" : "own_thread", median, mean, other, percent);
  else
    std::printf("%zu properties, %s: publish() and poll() %.3f us a step (median %.3f), other threads %.3f us: %.3f %% of a core\n", count,
                in_poll ? "Io::in_poll" : "a thread of lrt's", mean, median, other, percent);
}
