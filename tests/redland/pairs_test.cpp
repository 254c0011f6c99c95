// SPDX-License-Identifier: Apache-2.0
// The host writes by librdf while clients read, query, PATCH and watch. Two counters in the data are changed together by the host, and a client's
// two together by each PATCH: every snapshot has equal ones. Where a storage sorts, there are many statements between the two.
#include <lrt/redland.hpp>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/redland/host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

const std::string p = "urn:p";

/// The value of a subject in N-Triples or CSV; empty: it has none, or several.
std::string value_of(const std::string& text, const std::string& subject) {
  const std::string before = "<urn:" + subject + "> <urn:p> \"";
  const std::size_t at = text.find(before);
  if (at == std::string::npos || text.find(before, at + 1) != std::string::npos) return {};
  const std::size_t begin = at + before.size();
  return text.substr(begin, text.find('"', begin) - begin);
}

/// What is wrong with a snapshot; empty: nothing.
std::string fault_of(const std::string& text) {
  for (const auto& [one, other] : {std::pair("a-host", "z-host"), std::pair("a-client", "z-client")})
    if (value_of(text, one).empty() || value_of(text, one) != value_of(text, other)) return text;
  return {};
}

int seconds() {
  const char* const wanted = std::getenv("LRT_SECONDS");
  return wanted ? std::atoi(wanted) : 2;
}

struct Found {
  void note(std::string fault) {
    if (fault.empty()) return;
    const std::lock_guard lock(mutex);
    if (faults.size() < 3) faults.push_back(std::move(fault));
  }
  std::mutex mutex;
  std::vector<std::string> faults;
  std::atomic<int> reads{0}, queries{0}, writes{0}, refused{0};
};

void run(const StorageKind& kind, redland::Owner owner, int count) {
  Stranger stranger(kind);
  for (int i = 0; i < count; ++i) stranger.add("urn:s" + std::to_string(i % 20), "urn:filler", std::to_string(i));
  for (const char* name : {"urn:a-host", "urn:z-host", "urn:a-client", "urn:z-client"}) stranger.add(name, p, "0");
  Host host(stranger, [&](Options&, GraphOptions&, redland::Options& how) {
    how.owner = owner;
    how.allows_partial_writes = !kind.has_transactions;
    how.max_step = std::chrono::microseconds(200);
  });
  const std::uint16_t port = host.server->port();
  Found found;
  std::atomic<bool> ends{false}, writers_have_ended{false};
  std::vector<std::thread> clients;
  const auto loop = [&](auto one) {
    return std::thread([&, one] {
      Socket socket(port);
      try {
        while (!ends) one(socket);
      } catch (const std::exception& e) { found.note(e.what()); }
    });
  };
  clients.push_back(loop([&](Socket& socket) {
    found.note(fault_of(socket.ask("GET /world/tasks\nAccept: application/n-triples").body));
    ++found.reads;
  }));
  clients.push_back(loop([&](Socket& socket) {
    const Answer answer = socket.ask(
        "POST /sparql\nContent-Type: application/sparql-query\nAccept: text/csv\n\n"
        "SELECT ?a ?b { GRAPH ?g { <urn:a-host> <urn:p> ?a . <urn:z-host> <urn:p> ?b } }");
    const std::size_t line = answer.body.find("\r\n") + 2, comma = answer.body.find(',', line);
    const std::string a = answer.body.substr(line, comma - line), b = answer.body.substr(comma + 1, a.size());
    if (answer.status == 200 && (a.empty() || a != b || answer.body.size() != line + 2 * a.size() + 3)) found.note(answer.body);
    ++found.queries;
  }));
  int sent = 0;  // of the client that writes
  clients.push_back(loop([&](Socket& socket) {
    const std::string old = std::to_string(sent), now = std::to_string(sent + 1);
    const Answer answer = socket.ask("PATCH /world/tasks\nContent-Type: application/sparql-update\n\nDELETE DATA { <urn:a-client> <urn:p> '" + old +
                                     "' . <urn:z-client> <urn:p> '" + old + "' } ; INSERT DATA { <urn:a-client> <urn:p> '" + now +
                                     "' . <urn:z-client> <urn:p> '" + now + "' }");
    if (answer.status == 204) ++sent, ++found.writes;
    else if (answer.status == 503) ++found.refused;
    else found.note(answer.body);
    // 503 after Limits::host_timeout does not say whether it was done: ask.
    if (answer.status != 204) {
      const std::string there = value_of(socket.ask("GET /world/tasks\nAccept: application/n-triples").body, "a-client");
      if (!there.empty()) sent = std::atoi(there.c_str());
    }
  }));
  std::string last_seen;
  clients.emplace_back([&] {
    StreamClient stream(port, "/world/tasks?accept=application/n-triples");
    const auto take = [&] {
      stream.step();
      for (const Event& event : stream.take()) found.note(fault_of(event.data)), last_seen = event.data;
    };
    while (!writers_have_ended) take();
    const auto limit = std::chrono::steady_clock::now() + patience;
    const auto is_last = [&] { return value_of(last_seen, "a-host") == "last" && value_of(last_seen, "a-client") == std::to_string(sent); };
    while (!is_last() && !stream.ended && std::chrono::steady_clock::now() < limit) take();
  });

  int turn = 0;
  std::string shown = "0";
  const auto change = [&](const std::string& now) {
    host.model
        ->call([&](librdf_model*) {
          for (const char* name : {"urn:a-host", "urn:z-host"}) {
            stranger.remove(name, p, shown);
            stranger.add(name, p, now);
          }
          shown = now;
          host.model->changed();
        })
        .value();
  };
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds());
  while (std::chrono::steady_clock::now() < end) {
    if (turn++ % 10 == 0) change(std::to_string(turn));
    host.turn();
  }
  std::atomic<bool> are_over{false};
  change("last");
  ends = true;
  std::thread waiter([&] {
    for (std::size_t i = 0; i + 1 < clients.size(); ++i) clients[i].join();
    writers_have_ended = true;
    clients.back().join();  // which watches
    are_over = true;
  });
  while (!are_over) host.turn();
  waiter.join();
  for (const std::string& fault : found.faults) UNSCOPED_INFO(fault);
  CHECK(found.faults.empty());
  CHECK(found.reads > 0);
  CHECK(found.queries > 0);
  CHECK(found.writes > 0);
  CHECK(value_of(last_seen, "a-host") == "last");
  CHECK(value_of(last_seen, "a-client") == std::to_string(sent));
  const redland::Counters counters = host.model->counters();
  WARN(kind.name << (owner == redland::Owner::host ? ", host" : ", thread") << ": " << turn / 10 << " changes of the host, " << found.reads
                 << " GETs, " << found.queries << " queries, " << found.writes << " PATCHes (" << found.refused << " late), " << counters.reads
                 << " reads, " << counters.interrupted_reads << " interrupted, " << counters.whole_reads << " whole, longest step "
                 << counters.longest_step.count() << " us");
  host.model->detach();
  CHECK(stranger.has("urn:a-client", p, std::to_string(sent)));
}

}  // namespace

TEST_CASE("every snapshot is a state that the host had, and the last change is told", "[redland][threads]") {
  run(sqlite, redland::Owner::host, 200);
  run(sqlite, redland::Owner::thread, 200);
  run(trees, redland::Owner::host, 5'000);
}
