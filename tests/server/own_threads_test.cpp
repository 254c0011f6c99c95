// SPDX-License-Identifier: Apache-2.0
#include <lrt/options.hpp>

#include <sched.h>
#include <signal.h>

#include <chrono>
#include <algorithm>
#include <set>
#include <string>
#include <thread>

#include <lrt/server.hpp>

#include "tests/support/callback.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/skip.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/tasks.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// Makes the calling thread a control loop: one CPU and, where the machine allows it, SCHED_FIFO.
void be_a_control_loop() {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(::sched_getcpu(), &one);
  ::sched_setaffinity(0, sizeof one, &one);
  sched_param parameter{};
  parameter.sched_priority = 10;
  if (::sched_setscheduler(0, SCHED_FIFO, &parameter) != 0) print_skip("not shown with SCHED_FIFO: this process may not use it");
}

/// The threads of lrt, once all of these names are among them, or after twenty seconds.
std::vector<Task> own_threads(const std::set<std::string>& names) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (true) {
    std::vector<Task> found;
    std::set<std::string> seen;
    for (Task& task : tasks()) {
      if (task.name.rfind("lrt-", 0) != 0) continue;
      seen.insert(task.name);
      found.push_back(std::move(task));
    }
    const bool all = std::includes(seen.begin(), seen.end(), names.begin(), names.end());
    if (all || std::chrono::steady_clock::now() > until) {
      CHECK(all);
      return found;
    }
    std::this_thread::yield();
  }
}

}  // namespace

TEST_CASE("all threads of a server that a control loop creates are normal threads with names, and the loop stays as it is", "[server][threads]") {
  const std::string all = this_task().cpus;
  const Folder folder;
  std::thread([&] {  // the host's
    be_a_control_loop();
    const Task before = this_task();
    const SilentReceiver receiver;  // keeps a thread at work
    SampleRobot robot;
    Options options;
    options.listen.port = 0;
    options.security.allowed_hosts = {"localhost:80"};  // the client's
    options.callbacks.allow = {"127.0.0.1"};
    options.callbacks.file = folder / "subscriptions";
    Server server = Server::create(std::move(options)).value();
    server.add(robot.arm()).value();
    server.start();
    Socket client(server.port());
    const Answer made = client.ask(receiver.subscription("angle"));
    INFO(made.body);
    CHECK(made.status == 201);
    for (const Task& task : own_threads({"lrt-callback", "lrt-io", "lrt-run", "lrt-save"})) {
      CAPTURE(task.name);
      CHECK(task.policy == SCHED_OTHER);
      CHECK(task.cpus == all);
      for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGALRM, SIGPIPE, SIGRTMAX}) CHECK(task.blocks(signal));
    }
    const Task after = this_task();
    CHECK(after.policy == before.policy);
    CHECK(after.priority == before.priority);
    CHECK(after.cpus == before.cpus);
    CHECK(after.blocked == before.blocked);
  })
      .join();
}

TEST_CASE("Threads::own is of all threads of a server, and what the system refuses is an error of create()", "[server][threads]") {
  Options options;
  options.listen.port = 0;
  options.threads.own.cpus = {static_cast<unsigned>(::sched_getcpu())};
  {
    Server server = Server::create(options).value();
    server.start();
    for (const Task& task : own_threads({"lrt-io", "lrt-run"})) CHECK(task.cpus == std::to_string(options.threads.own.cpus.front()));
  }
  options.threads.own.cpus = {CPU_SETSIZE};
  const auto refused = Server::create(options);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_option);
}
