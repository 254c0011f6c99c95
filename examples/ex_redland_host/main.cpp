// SPDX-License-Identifier: Apache-2.0
// A robot that keeps its tasks in Redland, in an SQLite file (task_list.hpp), and does one after another. That was the whole program. The lines
// between the dashes put the list on the web, where clients read it, watch it and add tasks.
//
//   ex_redland_host tasks.db --port 8080 &
//   curl http://127.0.0.1:8080/world/tasks
//   curl -X PATCH -H 'Content-Type: application/sparql-update' http://127.0.0.1:8080/world/tasks -d '
//     PREFIX schema: <http://schema.org/>
//     INSERT DATA { <urn:task:3> a schema:Action ; schema:name "water the plants" ; schema:actionStatus schema:PotentialActionStatus }'

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <string_view>
#include <thread>

#include <lrt/lrt.hpp>
#include <lrt/redland.hpp>

#include "task_list.hpp"

namespace {

using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t ended = 0;
void on_signal(int) { ended = 1; }

/// The robot's work: a task takes a second. True: the list has changed.
bool work(TaskList& tasks, Clock::time_point& busy_until) {
  if (Clock::now() < busy_until) return false;
  if (const auto task = tasks.find(TaskList::active)) return tasks.move(*task, TaskList::active, TaskList::done), true;
  const auto task = tasks.find(TaskList::open);
  if (!task) return false;
  tasks.move(*task, TaskList::open, TaskList::active);
  busy_until = Clock::now() + std::chrono::seconds(1);
  return true;
}

int run(const std::string& file, int port) {
  TaskList tasks(file);
  if (tasks.empty()) {
    tasks.add("urn:task:1", "fetch the red cup");
    tasks.add("urn:task:2", "wipe the table");
  }
  Clock::time_point busy_until{};

  // ----------------------------------------------------------------------------------------------------------------------
  lrt::Options options;
  options.listen.port = static_cast<std::uint16_t>(port);
  lrt::GraphOptions graph;
  graph.clients_may_write = true;
  lrt::World world("world");
  lrt::Server server = lrt::Server::create(options).value();
  lrt::redland::Model shown = lrt::redland::Model::attach(world, "tasks", tasks.model(), {}, graph).value();
  server.add(std::move(world)).value();
  std::printf("listening on http://127.0.0.1:%d/\n", static_cast<int>(server.port()));
  // ----------------------------------------------------------------------------------------------------------------------

  std::fflush(stdout);
  while (ended == 0) {
    if (work(tasks, busy_until)) shown.changed();  // ---
    server.poll();                                 // ---
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string file = argc > 1 ? argv[1] : "tasks.db";
  const int port = argc > 3 && std::string_view(argv[2]) == "--port" ? std::atoi(argv[3]) : 8080;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  try {
    return run(file, port);
  } catch (const std::exception& e) { return std::fprintf(stderr, "%s\n", e.what()), 1; }
}
