// SPDX-License-Identifier: Apache-2.0
// A robot to be attacked: its control loop runs at 1 kHz and measures how late each step begins.
//
//   attacked_robot [--in-poll] [--transport NAME] [--body-threads N] [--callbacks] [--fifo PRIORITY --cpu N [--inherit]]
//
// Prints its URL. For each line on its standard input it prints one line of JSON: what was measured since the line before.
// --fifo: the thread that creates the server has SCHED_FIFO and is bound to one CPU, and so is the control loop. --inherit: lrt's threads get the
// same policy, priority and CPU, as if they inherited them. Names of receivers below ".hanging" are resolved by a name server that never responds.

#include <dlfcn.h>
#include <netdb.h>
#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <iostream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/transport/named.hpp>

#include "tests/attack/sample.hpp"

namespace {

using Time = std::chrono::steady_clock::time_point;
using lrt::attack::Measured;
using lrt::attack::thread_time;
constexpr std::chrono::microseconds step{1000}, budget{200};

/// The calling thread, and those that it starts.
bool become_real_time(int priority, unsigned cpu) {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  CPU_SET(cpu, &cpus);
  sched_param parameter{};
  parameter.sched_priority = priority;
  return ::pthread_setaffinity_np(::pthread_self(), sizeof cpus, &cpus) == 0 &&
         ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameter) == 0;
}

}  // namespace

/// Stands before that of the C library.
extern "C" int getaddrinfo(const char* name, const char* service, const addrinfo* hints, addrinfo** found) {
  constexpr std::string_view hanging = ".hanging";
  const std::string_view text = name ? name : "";
  if (text.size() > hanging.size() && text.substr(text.size() - hanging.size()) == hanging) {
    std::this_thread::sleep_for(std::chrono::seconds(30));  // as long as resolv.conf(5) may take
    return EAI_AGAIN;
  }
  static const auto real = reinterpret_cast<int (*)(const char*, const char*, const addrinfo*, addrinfo**)>(::dlsym(RTLD_NEXT, "getaddrinfo"));
  return real(name, service, hints, found);
}

int main(int count, char** arguments) {
  lrt::Options options;
  options.listen.port = 0;
  std::string transport;
  int priority = 0;
  unsigned cpu = 0;
  bool inherit = false;
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i];
    if (argument == "--in-poll") options.threads.io = lrt::Io::in_poll;
    else if (argument == "--transport" && i + 1 < count) transport = arguments[++i];
    else if (argument == "--body-threads" && i + 1 < count) options.threads.body_threads = static_cast<unsigned>(std::atoi(arguments[++i]));
    else if (argument == "--callbacks") options.callbacks.allow = {"127.0.0.1", ".hanging"};
    else if (argument == "--fifo" && i + 1 < count) priority = std::atoi(arguments[++i]);
    else if (argument == "--cpu" && i + 1 < count) cpu = static_cast<unsigned>(std::atoi(arguments[++i]));
    else if (argument == "--inherit") inherit = true;
    else return std::fprintf(stderr, "unknown argument %s\n", argument.c_str()), 2;
  }
  if (!transport.empty())
    options.listen.transport = [transport](lrt::transport::TransportOptions t) { return lrt::transport::make_named(transport, std::move(t)); };
  if (inherit) options.threads.own = {lrt::Scheduling::fifo, priority, {cpu}};
  if (priority > 0 && !become_real_time(priority, cpu)) return std::perror("SCHED_FIFO"), 77;
  lrt::Server server = lrt::Server::create(std::move(options)).value();

  double angle = 0;
  std::string note;
  std::vector<double> path;
  lrt::Thing arm{"arm"};
  auto position = arm.property<double>("position", lrt::unit::radian);
  arm.property("angle", [&] { return angle; }).on_write([&](double v) { angle = v; });
  arm.property("note", [&] { return note; }).on_write([&](std::string v) { note = std::move(v); });
  arm.property("path", [&] { return path; }).on_write([&](std::vector<double> v) { path = std::move(v); });
  std::string label;
  arm.property("label", [&] { return label; }).on_write([&](std::string v) { label = std::move(v); });
  arm.shapes(
      "@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . "
      "<#label> a sh:NodeShape ; sh:property [ sh:path rdf:value ; sh:pattern \"[0-9]+ kg\" ] .");
  arm.action("stop", [] {}).stop();
  server.add(std::move(arm)).value();

  std::atomic<std::promise<Measured>*> wanted{nullptr};
  std::atomic<bool> ended{false};
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);
  std::thread control([&] {
    Time next = std::chrono::steady_clock::now();
    Measured own;
    for (std::size_t steps = 0; !ended; ++steps) {
      std::this_thread::sleep_until(next += step);
      const Time begun = std::chrono::steady_clock::now();
      own.late.add(begun - next);
      position.publish(static_cast<double>(steps % 1000));
      const std::chrono::nanoseconds used = thread_time();
      const Time before = std::chrono::steady_clock::now();
      (void)server.poll(budget);
      own.poll.add(std::chrono::steady_clock::now() - before);
      own.cpu.add(thread_time() - used);
      if (std::chrono::steady_clock::now() - next > step) next = std::chrono::steady_clock::now();
      if (auto* promise = wanted.exchange(nullptr)) promise->set_value(std::exchange(own, {}));
    }
  });
  for (std::string line; std::getline(std::cin, line);) {
    std::promise<Measured> promise;
    wanted = &promise;
    std::printf("%s\n", promise.get_future().get().json().c_str());
    std::fflush(stdout);
  }
  ended = true;
  control.join();
  server.stop();
  return 0;
}
