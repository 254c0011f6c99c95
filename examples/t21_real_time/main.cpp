// SPDX-License-Identifier: Apache-2.0
// A control loop with SCHED_FIFO, as on PREEMPT_RT. lrt's threads inherit neither its policy nor its CPU, so nothing that clients do delays the loop.
#include <sched.h>
#include <sys/mman.h>
#include <ctime>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

/// Prints the policy of each thread of lrt, as the kernel has it.
void print_threads() {
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::getline(std::ifstream(task.path() / "comm"), name);
    const bool normal = ::sched_getscheduler(std::stoi(task.path().filename())) == SCHED_OTHER;
    if (name.rfind("lrt-", 0) == 0) std::printf("%s: %s\n\n", name.c_str(), normal ? "normal policy" : "real-time policy");
  }
}

int main() {
  // Both need a permission (limits rtprio and memlock); without it the lesson runs all the same.
  ::mlockall(MCL_CURRENT | MCL_FUTURE);
  const sched_param priority{80};
  ::sched_setscheduler(0, SCHED_FIFO, &priority);

  lrt::Thing joint{"arm/joint"};
  auto angle = joint.property<double>("angle", lrt::unit::radian);
  angle.publish(0);
  std::atomic<double> target{0};
  joint.dispatch(lrt::Dispatch::io_thread);  // on lrt's thread: the loop calls nothing that waits
  joint.action("turn", [&](double to) { target = to; });

  lrt::Options options = lesson::options();
  options.threads.own.stack_bytes = 1024 * 1024;  // mlockall() keeps stacks in memory: the system's default is 8 MiB for each
  // options.threads.own.cpus = {0};              // if the loop has a CPU of its own that the kernel does not isolate (isolcpus)
  lrt::Server server = lrt::Server::create(options).value();
  server.add(std::move(joint)).value();
  if (!lesson::serves()) print_threads();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.only({"numericalValue"});
    client.post("/arm/joint/actions/turn", "<> vom:numericalValue 0.5 .");
    client.get_until("/arm/joint/angle", "\"0.5\"");
  });
  timespec next{};
  ::clock_gettime(CLOCK_MONOTONIC, &next);
  while (visitor.is_here()) {  // 1 kHz
    if ((next.tv_nsec += 1'000'000) >= 1'000'000'000) next.tv_nsec -= 1'000'000'000, ++next.tv_sec;
    ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr);
    angle.publish(target);  // neither locks nor allocates, nor makes a system call while nobody observes the angle
  }
}

// Output:
// lrt-io: normal policy
//
// POST /arm/joint/actions/turn
//   <> vom:numericalValue 0.5 .
// 204 No Content
// Location: http://127.0.0.1:8080/arm/joint/actions/turn/id-1
//
// GET /arm/joint/angle
// 200 OK
// Content-Type: text/turtle
//     vom:numericalValue "0.5"^^xsd:double ;
