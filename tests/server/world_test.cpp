// SPDX-License-Identifier: Apache-2.0
#include <lrt/world.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <lrt/server.hpp>
#include <lrt/server_thing.hpp>

#include "src/server/saved_file.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/skip.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/watchdog.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

constexpr Iri label = vocab::rdfs::label;

struct Log {
  LogCallback callback() {
    return [this](LogLevel, std::string_view text) {
      const std::lock_guard lock(mutex);
      all.append(text).append("\n");
    };
  }
  bool has(const std::string& text) {
    const std::lock_guard lock(mutex);
    return all.find(text) != std::string::npos;
  }
  std::mutex mutex;
  std::string all;
};

Options options_of(Log* log = nullptr) {
  Options options;
  options.listen.port = 0;
  if (log) options.log = log->callback();
  return options;
}

/// A server whose World has a graph in a file.
struct Robot {
  explicit Robot(const std::string& file, GraphOptions options = {}, Log* log = nullptr) : server(Server::create(options_of(log)).value()) {
    World world("world");
    options.file = file;
    options.clients_may_write = true;
    map = world.graph("map", std::move(options));
    added = server.add(std::move(world));
  }
  Server server;
  WorldGraph map;
  Result<void> added;
};

void say(WorldGraph& map, const std::string& text) {
  map.update([&](GraphUpdate& u) { u.set("#cup", label, text); }).value();
}
bool says(const WorldGraph& map, const std::string& text) {
  return map.snapshot()->contains(rdf::iri("http://lrt.invalid/world/map#cup"), label, rdf::literal(text));
}
std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The field X-Who names the client.
Options options_of_named_clients() {
  Options options = options_of();
  options.security.authenticate = [](const http::Request& request) -> std::optional<security::Principal> {
    const auto who = request.find("X-Who");
    return who ? std::optional(security::Principal{std::string(*who), {}}) : std::nullopt;
  };
  return options;
}
security::Who is(const char* name) { return {security::Who::Kind::principal, name}; }

}  // namespace

TEST_CASE("a graph with a file is there again after a restart, whoever wrote it", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "worlds/map.nt";
  {
    GraphOptions options;
    options.turtle = "<#table> <http://www.w3.org/2000/01/rdf-schema#label> \"a table\" .";
    Robot robot(file, options);
    robot.added.value();
    CHECK(robot.map.snapshot()->size() == 1);
    say(robot.map, "a cup");
    Socket client(robot.server.port());
    const Answer a = client.ask("PATCH /world/map\nHost: localhost:" + std::to_string(robot.server.port()) +
                                "\nContent-Type: application/sparql-update\n\nINSERT DATA { <#plate> <p:in> _:x . _:x <p:of> <#cup> }");
    CHECK(a.status == 204);
  }
  GraphOptions options;
  options.turtle = "<#other> <p:q> 1 .";
  Robot robot(file, options);
  robot.added.value();
  CHECK(says(robot.map, "a cup"));
  CHECK(robot.map.snapshot()->size() == 4);
  Socket client(robot.server.port());
  const Answer a = client.ask("GET /world/map\nHost: localhost:" + std::to_string(robot.server.port()));
  CHECK(missing(a, "<world/map#cup> rdfs:label \"a cup\" .", "http://localhost:" + std::to_string(robot.server.port()) + "/") == "");
  World world("other");
  options.file = file;
  world.graph("a", options);
  world.graph("b", options);
  CHECK(robot.server.add(std::move(world)).error().code == Errc::invalid_option);  // two graphs, one file
}

TEST_CASE("a World that is removed leaves its files to the next", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  Robot robot(file);
  robot.added.value();
  say(robot.map, "a cup");
  robot.server.remove("world").value();
  say(robot.map, "unseen");
  World world("world");
  GraphOptions options;
  options.file = file;
  WorldGraph map = world.graph("map", options);
  robot.server.add(std::move(world)).value();
  CHECK(says(map, "a cup"));
}

TEST_CASE("a file of a graph that is cut is restored up to its last whole change, and one that is damaged before stays", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  {
    Robot robot(file);
    robot.added.value();
    say(robot.map, "a cup");
    while (robot.map.unsaved_changes() != 0) std::this_thread::yield();  // or both are one record
    say(robot.map, "a second cup");
  }
  const std::string whole = bytes_of(file);
  std::filesystem::resize_file(file, whole.find("a second cup") + 3);
  Log log;
  {
    Robot robot(file, {}, &log);
    robot.added.value();
    CHECK(says(robot.map, "a cup"));
    CHECK(log.has("a change that was not saved whole, "));
    say(robot.map, "a third cup");
  }
  CHECK(says(Robot(file).map, "a third cup"));
  std::string damaged = whole;
  damaged[damaged.find("a cup")] = 'A';
  std::ofstream(file, std::ios::binary) << damaged;
  const Error error = Robot(file).added.error();
  CHECK(error.code == Errc::io_error);
  CHECK(error.message.find("graph \"world/map\", its file: ") != std::string::npos);
  CHECK(error.message.find(", byte ") != std::string::npos);
  CHECK(bytes_of(file) == damaged);
}

TEST_CASE("a file of an earlier release is read, and replaced when the new one is on the disk", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  {
    SavedFile earlier(file, nullptr, nullptr);
    earlier.save("<http://lrt.invalid/world/map#cup> <http://www.w3.org/2000/01/rdf-schema#label> \"a cup\" .\n_:b0 <http://e.org/p> _:b1 .\n", 1);
  }
  const std::string before = bytes_of(file);
  REQUIRE(before.compare(0, 9, "# lrt 1: ") == 0);
  {
    std::filesystem::create_directory(folder / "other");
    std::filesystem::copy_file(file, folder / "other/map.nt");
    Robot robot(folder / "other/map.nt");
    robot.added.value();
    CHECK(says(robot.map, "a cup"));
    CHECK(robot.map.snapshot()->size() == 2);
  }
  CHECK(bytes_of(folder / "other/map.nt").compare(0, 22, "# lrt graph journal 1\n") == 0);  // without a change
  for (int i = 0; i < 2; ++i) {
    Robot robot(file);
    robot.added.value();
    CHECK(robot.map.snapshot()->size() == 2);
    say(robot.map, "a cup");
  }
  std::string damaged = before;
  damaged.back() = '!';
  std::filesystem::remove(file);
  std::ofstream(file, std::ios::binary) << damaged;
  Log log;
  GraphOptions options;
  options.turtle = "<#cup> <http://www.w3.org/2000/01/rdf-schema#label> \"a first cup\" .";
  {
    Robot robot(file, options, &log);
    robot.added.value();
    CHECK(says(robot.map, "a first cup"));
    CHECK(log.has("was changed or truncated"));
    CHECK(log.has("map.nt.damaged-1"));
  }
  CHECK(bytes_of(file + ".damaged-1") == damaged);
  CHECK(says(Robot(file).map, "a first cup"));
}

TEST_CASE("a client's write that the disk refuses is 503, and has no effect; the counter says what of the host waits", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  Log log;
  Robot robot(file, {}, &log);
  robot.added.value();
  const std::string host = "\nHost: localhost:" + std::to_string(robot.server.port());
  Socket client(robot.server.port());
  const auto insert = [&](const std::string& triple) {
    return client.ask("PATCH /world/map" + host + "\nContent-Type: application/sparql-update\n\nINSERT DATA { " + triple + " }");
  };
  CHECK(insert("<#a> <p:b> 1").status == 204);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  {
    // Another file in its place is as bad as a disk that refuses.
    std::filesystem::rename(file, file + ".away");
    std::ofstream(file) << "somebody's";
    const Answer refused = insert("<#a> <p:b> 2");
    CHECK(refused.status == 503);
    CHECK(refused.has("Retry-After"));
    CHECK(insert("<#a> <p:b> 3").status == 503);
    CHECK(robot.map.snapshot()->size() == 1);
    const Answer shown = client.ask("GET /world/map" + host + "\nAccept: application/n-triples");
    CHECK(shown.body.find("\"1\"^^") != std::string::npos);
    CHECK(shown.body.find("\"2\"^^") == std::string::npos);
    say(robot.map, "a cup");
    CHECK(robot.map.unsaved_changes() == 1);
    CHECK(robot.server.counters().unsaved_graph_changes == 1);
    CHECK(client.ask("GET /world/map" + host).body.find("a cup") != std::string::npos);
    CHECK(log.has(" not saved: "));
    CHECK(bytes_of(file) == "somebody's");
    std::filesystem::remove(file);
    std::filesystem::rename(file + ".away", file);
  }
  CHECK(insert("<#a> <p:b> 4").status == 204);
  while (robot.map.unsaved_changes() > 0 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  CHECK(robot.map.unsaved_changes() == 0);
  robot.server.remove("world").value();
  Robot again(file);
  again.added.value();
  CHECK(again.map.snapshot()->size() == 3);
  CHECK(says(again.map, "a cup"));
}

TEST_CASE("what is no file of a graph stops adding the World and stays", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  std::ofstream(file) << "<http://example.org/> <http://example.org/> 1 .";
  CHECK(Robot(file).added.error().code == Errc::invalid_option);
  CHECK(bytes_of(file) == "<http://example.org/> <http://example.org/> 1 .");
  std::filesystem::remove(file);
  {
    Robot robot(file);
    robot.added.value();
    say(robot.map, "a cup");
  }
  GraphOptions strict;
  strict.shapes =
      "@prefix sh: <http://www.w3.org/ns/shacl#> . <#s> a sh:NodeShape ; sh:targetSubjectsOf <http://www.w3.org/2000/01/rdf-schema#label> ;"
      " sh:property [ sh:path <p:q> ; sh:minCount 1 ] .";
  CHECK(Robot(file, strict).added.error().code == Errc::expected_value);
  GraphOptions small;
  small.max_triples = 0;
  CHECK(Robot(file, small).added.error().code == Errc::limit_exceeded);
  CHECK(says(Robot(file).map, "a cup"));
}

TEST_CASE("a graph at its limits is restored, whatever its file escapes", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  GraphOptions options;
  options.max_triples = 1;
  options.max_bytes = 10'000;
  const std::string controls(9'500, '\x01');  // each is six bytes in N-Triples
  {
    Robot robot(file, options);
    robot.added.value();
    say(robot.map, controls);
  }
  Robot robot(file, options);
  robot.added.value();
  CHECK(says(robot.map, controls));
  GraphOptions unlimited;
  unlimited.max_triples = unlimited.max_bytes = static_cast<std::size_t>(-1);
  robot.server.remove("world").value();
  CHECK(says(Robot(file, unlimited).map, controls));
}

TEST_CASE("a kept graph of more triples than documents have by default is restored", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  GraphOptions options;
  options.max_triples = 120'000;
  for (int start = 0; start < 3; ++start) {
    Robot robot(file, options);
    robot.added.value();
    CHECK(robot.map.snapshot()->size() == (start == 0 ? 0U : 110'000U));
    const rdf::Graph all = [] {
      rdf::Graph graph;
      const auto s = graph.intern(rdf::iri("p:s")), p = graph.intern(rdf::iri("p:q"));
      for (int i = 0; i < 110'000; ++i) graph.add(s, p, graph.intern(rdf::literal(std::to_string(i))));
      return graph;
    }();
    robot.map.update([&](GraphUpdate& u) { u.add(all); }).value();
    CHECK(robot.map.snapshot()->size() == 110'000);
  }
}

TEST_CASE("a process that is killed while it writes leaves one whole state of the graph", "[server][world][saves]") {
  if (is_sanitized) return print_skip("sanitizers do not support fork() with threads");
  const Folder folder;
  const std::string file = folder / "map.nt";
  int last = 0;
  for (int round = 0; round < 3; ++round) {
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      Robot robot(file);
      for (int i = last + 1;; ++i)
        (void)robot.map.update([&](GraphUpdate& u) {
          for (int n = 0; n < 50; ++n) u.set("#n" + std::to_string(n), label, i);
        });
    }
    const std::string before = bytes_of(file);
    while (bytes_of(file) == before) std::this_thread::yield();  // it has written
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    Robot robot(file);
    robot.added.value();
    const auto graph = robot.map.snapshot();
    REQUIRE(graph->size() == 50);
    std::string value;
    for (const rdf::Triple& t : graph->triples()) {
      if (value.empty()) value = std::string(graph->term(t.object).text);
      CHECK(graph->term(t.object).text == value);
    }
    CHECK(std::stoi(value) > last);
    last = std::stoi(value);
  }
}

TEST_CASE("threads, clients and a control loop change a World at once", "[server][world][threads]") {
  const Folder folder;
  Robot robot(folder / "map.nt");
  robot.added.value();
  auto pose = robot.map.published<double>("cup", Iri("https://example.org/pose"));
  const std::string host = "\nHost: localhost:" + std::to_string(robot.server.port());
  std::atomic<bool> done{false};
  std::thread loop([&] {
    for (double x = 0; !done; x += 0.25) pose.publish(x);
  });
  std::vector<std::thread> writers;
  for (int n = 0; n < 2; ++n)
    writers.emplace_back([&, n] {
      for (int i = 0; i < 50; ++i) {
        say(robot.map, std::to_string(n) + "/" + std::to_string(i));
        auto other = robot.map.published<double>("plate" + std::to_string(n), Iri("https://example.org/pose"));
        other.publish(i);
        other.remove();
      }
    });
  Socket client(robot.server.port());
  for (int i = 0; i < 50; ++i) {
    CHECK(client.ask("GET /world/map" + host).status == 200);
    CHECK(client.ask("PATCH /world/map" + host + "\nContent-Type: application/sparql-update\n\nINSERT DATA { <#a> <p:b> " + std::to_string(i) + " }")
              .status == 204);
  }
  for (std::thread& w : writers) w.join();
  done = true;
  loop.join();
  CHECK(robot.map.snapshot()->size() == 51);
}

TEST_CASE("code updates a graph from its lambda that calls the server, while clients write it", "[server][world][threads]") {
  const Folder folder;
  Robot robot(folder / "map.nt");
  const std::string host = "\nHost: localhost:" + std::to_string(robot.server.port());
  std::atomic<bool> done{false};
  std::thread code([&] {
    for (int i = 0; i < 20; ++i)
      robot.map
          .update([&](GraphUpdate& u) {
            u.set("#i", label, i);
            Thing thing("thing" + std::to_string(i));
            robot.server.add(std::move(thing)).value();  // takes the engine's lock
          })
          .value();
    done = true;
  });
  Socket client(robot.server.port());
  const std::string patch = "PATCH /world/map" + host + "\nContent-Type: application/sparql-update\n\nINSERT DATA { <#a> <p:b> 1 }";
  while (!done) {
    const int status = client.ask(patch).status;
    CHECK((status == 204 || status == 202));
  }
  code.join();
  CHECK(client.ask(patch).status == 204);
  CHECK(robot.map.snapshot()->size() == 2);
}

TEST_CASE("the server stops within an update that a client's write waits for", "[server][world][threads]") {
  const Watchdog watchdog("stop() within update()");
  const Folder folder;
  Robot robot(folder / "map.nt");
  robot.added.value();
  Socket client(robot.server.port());
  robot.map
      .update([&](GraphUpdate& u) {
        u.set("#cup", label, "a cup");
        client.send("PATCH /world/map\nHost: localhost:" + std::to_string(robot.server.port()) +
                    "\nContent-Type: application/sparql-update\n\nINSERT DATA { <#a> <p:b> 1 }");
        while (robot.server.counters().waiting_requests == 0) std::this_thread::yield();
        robot.server.stop();
      })
      .value();
  CHECK(says(robot.map, "a cup"));
  CHECK(robot.map.snapshot()->size() == 1);  // the client got 503, or no response
}

TEST_CASE("a World is added within an update of another graph", "[server][world][threads]") {
  const Folder folder;
  Robot robot(folder / "map.nt");
  robot.added.value();
  GraphOptions options;
  options.file = folder / "other.nt";
  options.turtle = "<#a> <p:b> 1 .";
  WorldGraph other;
  robot.map
      .update([&](GraphUpdate& u) {
        u.set("#cup", label, "a cup");
        World world("other");
        other = world.graph("map", options);
        robot.server.add(std::move(world)).value();
      })
      .value();
  CHECK(says(robot.map, "a cup"));
  CHECK(other.snapshot()->size() == 1);
  CHECK(other.update([](GraphUpdate& u) { u.add("#a", label, "x"); }));
}

TEST_CASE("of two graphs with one file the second is refused, and of a graph and web callbacks", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  Robot robot(file);
  robot.added.value();
  const auto code_of = [&](const std::string& path) {
    World world("other");
    GraphOptions options;
    options.file = path;
    world.graph("map", options);
    const Result<void> added = robot.server.add(std::move(world));
    return added ? std::string("added") : std::string(to_string(added.error().code));
  };
  std::filesystem::create_directory_symlink(folder.path(), folder / "link");
  CHECK(code_of(file) == to_string(Errc::invalid_option));
  CHECK(code_of(folder / "./map.nt") == to_string(Errc::invalid_option));
  CHECK(code_of(folder / "link/map.nt") == to_string(Errc::invalid_option));
  Robot second(file);  // of another server
  CHECK(second.added.error().code == Errc::invalid_option);
  Options callbacks = options_of();
  callbacks.callbacks.file = file;
  CHECK(Server::create(callbacks).error().code == Errc::invalid_option);
  say(robot.map, "a cup");
  robot.server.remove("world").value();
  CHECK(code_of(file) == "added");
}

TEST_CASE("a graph whose folder was deleted and made again is saved there, and keeps others out", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "worlds/map.nt";
  Robot robot(file);
  robot.added.value();
  Socket client(robot.server.port());
  const auto add = [&](const std::string& triple) {
    return client
        .ask("PATCH /world/map\nHost: localhost:" + std::to_string(robot.server.port()) +
             "\nContent-Type: application/sparql-update\n\nINSERT DATA { " + triple + " }")
        .status;
  };
  CHECK(add("<#cup> <p:in> <#table>") == 204);  // it is saved, and nothing is being written
  std::filesystem::remove_all(folder / "worlds");
  CHECK(add("<#plate> <p:in> <#cup>") == 204);
  CHECK(std::filesystem::exists(file));
  Robot second(file);
  CHECK(second.added.error().code == Errc::invalid_option);
  robot.server.remove("world").value();
  Robot third(file);
  third.added.value();
  CHECK(third.map.snapshot()->size() == 2);
}

TEST_CASE("a graph with a file is not updated before its file was read", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map.nt";
  {
    Robot robot(file);
    robot.added.value();
    say(robot.map, "a cup");
  }
  Server server = Server::create(options_of()).value();
  World world("world");
  GraphOptions options;
  options.file = file;
  WorldGraph map = world.graph("map", options), other = world.graph("other");
  const auto adds = [](GraphUpdate& u) { u.add("#plate", label, "a plate"); };
  CHECK(map.update(adds).error().code == Errc::refused);
  CHECK(other.update(adds));
  CHECK(map.snapshot()->empty());
  server.add(std::move(world)).value();
  CHECK(says(map, "a cup"));
  CHECK(map.update(adds));
  server.remove("world").value();
  CHECK(map.update([](GraphUpdate& u) { u.clear(); }));  // nobody sees that
  CHECK(Robot(file).map.snapshot()->size() == 2);
}

TEST_CASE("a file of a graph that is cut to nothing, or within its first word, does not stop the start", "[server][world][saves]") {
  for (const std::uintmax_t size : {0, 1, 5, 8, 9, 20}) {
    CAPTURE(size);
    const Folder folder;
    const std::string file = folder / "map.nt";
    {
      Robot robot(file);
      robot.added.value();
      say(robot.map, "a cup");
    }
    std::filesystem::resize_file(file, size);
    Log log;
    Robot robot(file, {}, &log);
    REQUIRE(robot.added);
    CHECK(robot.map.snapshot()->empty());
    CHECK(log.has("was changed or truncated"));
    CHECK(std::filesystem::file_size(file + ".damaged-1") == size);
  }
}

TEST_CASE("who may read a graph reads all of it and may write it back, whatever it names", "[server][world][rights]") {
  Options options = options_of_named_clients();
  using security::Right;
  options.security.rules = {
      {"/world", security::Scope::tree, is("anna"), security::Rights::all()},
      {"/world", security::Scope::tree, is("bert"), Right::read | Right::write},
      {"/world", security::Scope::tree, is("carl"), Right::write},
      {"/world/secret", security::Scope::tree, is("anna"), security::Rights::all()},
  };
  Server server = Server::create(std::move(options)).value();
  World world("world");
  GraphOptions graph_options;
  graph_options.clients_may_write = true;
  WorldGraph map = world.graph("map", graph_options), secret = world.graph("secret");
  server.add(std::move(world)).value();
  say(map, "a cup");
  map.update([](GraphUpdate& u) { u.add("#cup", Iri("p:in"), Object::resource("world/secret")).add_turtle("_:a <p:next> _:b . _:b <p:next> _:a ."); })
      .value();
  Socket client(server.port());
  const auto ask = [&](const std::string& who, const std::string& line, const std::string& rest = {}) {
    return client.ask(line + "\nHost: localhost:" + std::to_string(server.port()) + "\nX-Who: " + who + rest);
  };
  const auto put = [&](const std::string& who, const Answer& seen) {
    return ask(who, "PUT /world/map", "\nContent-Type: application/n-triples\nIf-Match: " + seen.tag() + "\n\n" + seen.body);
  };
  const std::string triples = "\nAccept: application/n-triples";
  const Answer seen = ask("bert", "GET /world/map", triples);
  CHECK(seen.body.find("/world/secret>") != std::string::npos);
  CHECK(seen.body.find("p:next") != std::string::npos);
  CHECK(put("bert", seen).status == 204);
  CHECK(map.snapshot()->size() == 4);
  CHECK(put("anna", ask("anna", "GET /world/map", triples)).status == 204);
  CHECK(map.snapshot()->size() == 4);
  const std::string patch = "\nContent-Type: application/sparql-update\n\nINSERT DATA { <#x> <p:q> 2 }";
  CHECK(ask("bert", "PATCH /world/map", patch).status == 204);
  CHECK(map.snapshot()->size() == 5);
  map.update([](GraphUpdate& u) { u.remove("#cup", Iri("p:in"), Object::resource("world/secret")); }).value();
  CHECK(put("bert", ask("bert", "GET /world/map", triples)).status == 204);
  CHECK(map.snapshot()->size() == 4);
  CHECK(ask("bert", "DELETE /world/map").status == 204);
  map.update([](GraphUpdate& u) { u.add("#cup", Iri("p:in"), Object::resource("world/secret")); }).value();
  CHECK(ask("carl", "GET /world/map").status != 200);
  CHECK(ask("carl", "PUT /world/map", "\nContent-Type: text/turtle\n\n<#x> <p:q> 2 .").status == 204);  // it cannot read, and replaces
}

TEST_CASE("rights of a graph are those at its path, in whatever way a request names it", "[server][world][rights]") {
  Options options = options_of_named_clients();
  using security::Right;
  options.security.rules = {
      {"/world", security::Scope::tree, is("anna"), security::Rights::all()},
      {"/world", security::Scope::tree, is("bert"), Right::read | Right::write},
      {"/world/secret", security::Scope::tree, is("anna"), security::Rights::all()},
      {"/world/map", security::Scope::tree, is("anna"), security::Rights::all()},
      {"/world/map", security::Scope::tree, is("bert"), Right::read},
  };
  Server server = Server::create(std::move(options)).value();
  WorldOptions world_options;
  world_options.clients_may_create = true;
  World world("world", world_options);
  GraphOptions graph_options;
  graph_options.clients_may_write = true;
  WorldGraph map = world.graph("map", graph_options), secret = world.graph("secret/plan", graph_options);
  server.add(std::move(world)).value();
  say(map, "a cup");
  secret.update([](GraphUpdate& u) { u.add("#plan", label, "hidden words").add("#plan", Iri("p:of"), Object::resource("world/map")); }).value();
  Socket client(server.port());
  const std::string host = "localhost:" + std::to_string(server.port()), base = "http://" + host;
  const auto ask = [&](const std::string& who, const std::string& line, const std::string& rest = {}) {
    return client.ask(line + "\nHost: " + host + "\nX-Who: " + who + rest);
  };
  const std::string body = "\nContent-Type: text/turtle\n\n<#x> <p:q> 1 .",
                    patch = "\nContent-Type: application/sparql-update\n\nINSERT DATA { <#x> <p:q> 2 }";
  CHECK(ask("anna", "GET /world?default").body.find("hidden words") != std::string::npos);
  CHECK(ask("anna", "GET /world/secret/plan").status == 200);
  for (const char* path : {"/world", "/world?default", "/world/map", "/world/map?accept=application/n-quads",
                           "/world?default&accept=application/trig", "/world?accept=application/json"}) {
    CAPTURE(path);
    const Answer a = ask("bert", "GET " + std::string(path));
    CHECK(a.status == 200);
    CHECK(a.body.find("hidden words") == std::string::npos);
    CHECK(a.body.find("secret") == std::string::npos);
    CHECK(std::string(a.fields.block()).find("secret") == std::string::npos);
  }
  CHECK(ask("bert", "GET /world/map").body.find("a cup") != std::string::npos);
  CHECK(ask("bert", "GET /world/map").field("Allow") == "GET, HEAD, OPTIONS");
  for (const std::string& hidden : {std::string("/world/secret/plan"), "/world?graph=" + base + "/world/secret/plan"}) {
    CAPTURE(hidden);
    CHECK(ask("bert", "GET " + hidden).status == 404);
    CHECK(ask("bert", "PUT " + hidden, body).status == 404);
    CHECK(ask("bert", "PATCH " + hidden, patch).status == 404);
    CHECK(ask("bert", "DELETE " + hidden).status == 404);
  }
  for (const std::string& read : {std::string("/world/map"), "/world?graph=" + base + "/world/map"}) {
    CHECK(ask("bert", "PUT " + read, body).status == 403);
    CHECK(ask("bert", "POST " + read, body).status == 403);
    CHECK(ask("bert", "PATCH " + read, patch).status == 403);
    CHECK(ask("bert", "DELETE " + read).status == 403);
  }
  CHECK(ask("bert", "PUT /world/new", body).status == 201);
  CHECK(ask("bert", "PUT /world/secret/new", body).status == 404);
  CHECK(ask("bert", "PUT /world?graph=" + base + "/world/secret/new", body).status == 404);
  CHECK(ask("anna", "PATCH /world/map", patch).status == 204);
  CHECK(client.ask("GET /world/map\nHost: " + host).status == 401);
}

TEST_CASE("a client that may write a graph, but not read it, does not learn from a report what is in it", "[server][world][rights]") {
  Options options = options_of_named_clients();
  using security::Right;
  options.security.rules = {
      {"/world", security::Scope::tree, is("anna"), security::Rights::all()},
      {"/world/map", security::Scope::tree, is("anna"), security::Rights::all()},
      {"/world/map", security::Scope::tree, is("dora"), Right::write},
  };
  Server server = Server::create(std::move(options)).value();
  World world("world");
  GraphOptions graph_options;
  graph_options.clients_may_write = true;
  graph_options.shapes =
      "@prefix sh: <http://www.w3.org/ns/shacl#> . <#all> a sh:NodeShape ; sh:targetSubjectsOf <p:at> ; sh:property [ sh:path <p:bad> ; sh:maxCount "
      "0 ] .";
  WorldGraph map = world.graph("map", graph_options);
  server.add(std::move(world)).value();
  map.update([](GraphUpdate& u) { u.add("#secret", Iri("p:at"), 1); }).value();
  Socket client(server.port());
  const std::string host = "localhost:" + std::to_string(server.port());
  const auto patch = [&](const std::string& who, const std::string& change, const std::string& fields) {
    return client.ask("PATCH /world/map\nHost: " + host + "\nX-Who: " + who + fields + "\nContent-Type: application/sparql-update\n\nINSERT DATA { " +
                      change + " }");
  };
  for (const char* accept : {"", "\nAccept: application/problem+json", "\nAccept: text/turtle"}) {
    CAPTURE(accept);
    const Answer shown = patch("anna", "<#secret> <p:bad> 1", accept), hidden = patch("dora", "<#secret> <p:bad> 1", accept);
    CHECK(shown.status == 422);
    CHECK(shown.body.find("#secret") != std::string::npos);
    CHECK(hidden.status == 422);
    CHECK(hidden.body.find("#secret") == std::string::npos);
    CHECK(hidden.body.find("conform") != std::string::npos);
  }
  CHECK(patch("dora", "<#new> <p:at> 1", "").status == 204);
}
