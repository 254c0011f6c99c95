// SPDX-License-Identifier: Apache-2.0
#include "src/base/thread.hpp"

#include <dlfcn.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>

#include <atomic>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "tests/support/catch.hpp"
#include "tests/support/skip.hpp"
#include "tests/support/tasks.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// What a thread of these options finds itself to be.
Task seen_by(const ThreadOptions& options, const char* name = "lrt-test") {
  Task seen;
  start_thread(name, options, [&] { seen = this_task(); }).value().join();
  return seen;
}

/// Calls `f` on a thread of the host's with one CPU and, where the machine allows it, SCHED_FIFO.
template <class F>
bool on_a_control_loop(F f) {
  struct Given {
    F* f;
    bool real_time = false;
  } given{&f};
  pthread_t thread;
  const auto run = [](void* argument) -> void* {
    auto& mine = *static_cast<Given*>(argument);
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(::sched_getcpu(), &one);
    ::sched_setaffinity(0, sizeof one, &one);
    ::setpriority(PRIO_PROCESS, 0, -5);
    sched_param parameter{};
    parameter.sched_priority = 10;
    mine.real_time = ::sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
    (*mine.f)();
    return nullptr;
  };
  // No assertion until it has ended: Catch counts them on one thread at a time.
  const int created = ::pthread_create(&thread, nullptr, run, &given);
  if (created == 0) ::pthread_join(thread, nullptr);
  REQUIRE(created == 0);
  if (!given.real_time) print_skip("not shown with SCHED_FIFO: this process may not use it");
  return given.real_time;
}

bool may_be_real_time() {
  sched_param parameter{};
  parameter.sched_priority = 1;
  const bool may = ::sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
  parameter.sched_priority = 0;
  ::sched_setscheduler(0, SCHED_OTHER, &parameter);
  if (!may) print_skip("this process may not use SCHED_FIFO");
  return may;
}

}  // namespace

TEST_CASE("a thread has its name and blocks all signals but faults", "[base][not_emulated]") {
  const Task seen = seen_by({}, "lrt-test");
  CHECK(seen.name == "lrt-test");
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ, SIGALRM, SIGUSR1, SIGCHLD, SIGRTMIN, SIGRTMAX}) CHECK(seen.blocks(signal));
  for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) CHECK_FALSE(seen.blocks(fault));
  CHECK(seen_by({}, "a name of more than fifteen bytes").name == "a name of more ");
}

TEST_CASE("starting a thread leaves the calling thread as it was", "[base]") {
  on_a_control_loop([] {
    const Task before = this_task();
    seen_by({});
    const Task after = this_task();
    CHECK(after.blocked == before.blocked);
    CHECK(after.cpus == before.cpus);
    CHECK(after.policy == before.policy);
    CHECK(after.priority == before.priority);
    CHECK(after.name == before.name);
  });
}

TEST_CASE("a thread inherits neither the policy nor the CPUs nor the nice value of a control loop", "[base]") {
  const std::string all = this_task().cpus;
  const int given = ::getpriority(PRIO_PROCESS, 0);
  on_a_control_loop([&] {
    Task seen;
    int nice = 99;
    start_thread("lrt-test", {},
                 [&] {
                   seen = this_task();
                   nice = ::getpriority(PRIO_PROCESS, 0);
                 })
        .value()
        .join();
    CHECK(seen.policy == SCHED_OTHER);
    CHECK(seen.priority == 0);
    CHECK(seen.cpus == all);
    CHECK(nice == given);
  });
}

TEST_CASE("a thread has the CPUs and the stack of its options", "[base]") {
  ThreadOptions options;
  cpu_set_t mine;
  REQUIRE(::sched_getaffinity(0, sizeof mine, &mine) == 0);
  for (unsigned cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(cpu, &mine)) options.cpus = {cpu};  // the last one
  options.stack_bytes = 512 * 1024;
  std::size_t stack = 0;
  Task seen;
  start_thread("lrt-test", options,
               [&] {
                 seen = this_task();
                 pthread_attr_t attributes;
                 ::pthread_getattr_np(::pthread_self(), &attributes);
                 ::pthread_attr_getstacksize(&attributes, &stack);
                 ::pthread_attr_destroy(&attributes);
               })
      .value()
      .join();
  CHECK(seen.cpus == std::to_string(options.cpus.front()));
  CHECK(stack >= options.stack_bytes);
  CHECK(stack < 4 * options.stack_bytes);  // a sanitizer needs some of its own; the default is 16 times as much
}

TEST_CASE("a thread has the policy and the priority of its options", "[base]") {
  if (!may_be_real_time()) return;
  for (const auto& [policy, number] : {std::pair(Scheduling::fifo, SCHED_FIFO), std::pair(Scheduling::round_robin, SCHED_RR)}) {
    ThreadOptions options;
    options.policy = policy;
    options.priority = 7;
    const Task seen = seen_by(options);
    CHECK(seen.policy == number);
    CHECK(seen.priority == 7);
  }
}

TEST_CASE("options that the system refuses are errors, and no thread is started", "[base]") {
  const auto refused = [](const ThreadOptions& options) {
    bool ran = false;
    const auto thread = start_thread("lrt-test", options, [&] { ran = true; });
    REQUIRE_FALSE(thread);
    CHECK_FALSE(ran);
    CHECK(thread.error().code == Errc::invalid_option);
    return thread.error().message;
  };
  ThreadOptions options;
  options.priority = 1;
  CHECK(refused(options) == "thread options: priority 1 of this policy: Invalid argument");
  options.policy = Scheduling::fifo;
  options.priority = 100;
  CHECK(refused(options) == "thread options: priority 100 of this policy: Invalid argument");
  options = {};
  options.stack_bytes = 1;
  CHECK(refused(options) == "thread options: a stack of 1 bytes: Invalid argument");
  options = {};
  options.cpus = {CPU_SETSIZE - 1};
  CHECK(refused(options) == "thread options: the process may not run on these CPUs: Invalid argument");
  options.cpus = {CPU_SETSIZE};
  CHECK(refused(options) == "thread options: CPU 1024: Invalid argument");
}

TEST_CASE("a handle of a thread joins when it is destroyed and when it is assigned", "[base]") {
  std::atomic<int> ended{0};
  {
    Thread thread = start_thread("lrt-test", {}, [&] { ++ended; }).value();
    CHECK(thread.joinable());
    CHECK_FALSE(thread.is_current());
    thread = start_thread("lrt-test", {}, [&] { ++ended; }).value();
    CHECK(ended >= 1);
    Thread moved = std::move(thread);
    CHECK_FALSE(thread.joinable());
  }
  CHECK(ended == 2);
}

TEST_CASE("dlclose() does not unload the shared object whose thread still runs", "[base]") {
  void* const object = ::dlopen(LRT_CLOSED_OBJECT, RTLD_NOW | RTLD_LOCAL);
  REQUIRE(object != nullptr);
  const auto start = reinterpret_cast<bool (*)(std::atomic<int>*)>(::dlsym(object, "start"));
  REQUIRE(start != nullptr);
  static std::atomic<int> state{0};
  REQUIRE(start(&state));
  while (state != 1) std::this_thread::yield();
  REQUIRE(::dlclose(object) == 0);
  CHECK(::dlopen(LRT_CLOSED_OBJECT, RTLD_NOW | RTLD_NOLOAD) != nullptr);
  state = 2;  // the thread continues in the object's code
  while (state != 3) std::this_thread::yield();
}
