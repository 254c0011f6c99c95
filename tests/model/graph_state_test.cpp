// SPDX-License-Identifier: Apache-2.0
#include "src/model/graph_state.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/turns.hpp"
#include "src/model/graph_changes.hpp"
#include "src/rdf/difference.hpp"
#include "src/rdf/shared_graph.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using model::GraphState;

namespace {

/// Keeps changes in memory.
struct MemoryJournal final : model::ChangeJournal {
  struct Record {
    std::string changes;
    bool is_waited;
  };
  bool has_room(std::size_t) noexcept override { return true; }
  bool append(const std::string& changes, std::uint64_t number, bool is_waited) override {
    if (!has_memory) throw std::bad_alloc();
    const bool joins = is_waited && std::any_of(queue.begin(), queue.end(), [](const Record& r) { return r.is_waited; });
    numbers.push_back(number);
    queue.push_back({changes, is_waited});
    return joins;
  }
  void drop_waited() noexcept override { drop(queue); }
  static void drop(std::vector<Record>& records) {
    records.erase(std::remove_if(records.begin(), records.end(), [](const Record& r) { return r.is_waited; }), records.end());
  }
  /// The disk begins to write what is queued.
  void begin_to_write() {
    in_flight = std::exchange(queue, {});
    last = numbers.empty() ? 0 : numbers.back();
  }
  void write(GraphState& state) {
    disk.insert(disk.end(), in_flight.begin(), in_flight.end());
    in_flight.clear();
    state.saved(last);
  }
  void refuse(GraphState& state) {
    drop(in_flight);
    in_flight.insert(in_flight.end(), queue.begin(), queue.end());
    queue = std::exchange(in_flight, {});
    state.take_back(*this, model::SaveOutcome::refused);
  }
  bool has_memory = true;
  std::vector<std::uint64_t> numbers;
  std::vector<Record> queue, in_flight, disk;
  std::uint64_t last = 0;
};

}  // namespace

TEST_CASE("each change by code is given to the journal, and one that it cannot take is not made", "[model][world]") {
  const auto state = GraphState::create("/world/map", {}, "http://lrt.invalid/shapes", nullptr).value();
  MemoryJournal journal;
  int listened = 0;
  state->set_listener([&] { ++listened; });
  state->set_journal(&journal);
  const auto adds = [&](int n) {
    return state->update([n](model::GraphEdit& edit) { edit.add(rdf::iri("#x"), vocab::rdfs::label, edit.term_of(n)); });
  };
  CHECK(adds(1));
  journal.has_memory = false;
  CHECK(adds(2).error().code == Errc::failed);
  CHECK(state->version().graph->size() == 1);
  journal.has_memory = true;
  CHECK(adds(3));
  CHECK(state->version().graph->size() == 2);
  CHECK(journal.numbers == std::vector<std::uint64_t>{1, 2});
  CHECK(listened == 2);
  state->set_journal(nullptr);
}

namespace {

std::multiset<std::string> lines_of(const rdf::Graph& graph) {
  std::multiset<std::string> lines;
  for (const rdf::Triple& t : graph.triples())
    lines.insert(rdf::to_string(graph.term(t.subject)) + " " + rdf::to_string(graph.term(t.predicate)) + " " + rdf::to_string(graph.term(t.object)));
  return lines;
}

std::size_t bytes_of(const rdf::Graph& graph) {
  std::size_t bytes = 0;
  for (const rdf::Triple& t : graph.triples())
    for (const rdf::TermId id : {t.subject, t.predicate, t.object}) {
      const rdf::TermView term = graph.term(id);
      bytes += term.text.size() + term.datatype.size() + term.language.size();
    }
  return bytes;
}

void add_objects(model::GraphEdit& edit, int from, int to) {
  for (int i = from; i < to; ++i) edit.add(rdf::iri("#o" + std::to_string(i)), vocab::rdfs::label, edit.term_of(i));
}

}  // namespace

TEST_CASE("a graph of a World grows large and small again under random updates, and is what a set would be", "[model][world][shared]") {
  GraphOptions options;
  options.max_triples = 1'000'000;
  const auto state = GraphState::create("/world/map", options, "http://lrt.invalid/shapes", nullptr).value();
  std::mt19937 random(11);
  std::multiset<std::string> model;
  bool was_large = false, was_small_again = false;
  std::vector<std::pair<std::shared_ptr<const rdf::Graph>, std::multiset<std::string>>> past;
  const auto line = [](int s, int o) {
    return "<http://lrt.invalid/world/map#s" + std::to_string(s) + "> <http://www.w3.org/2000/01/rdf-schema#label> \"" + std::to_string(o) + "\"";
  };
  for (int step = 0; step < 60; ++step) {
    const bool fails = random() % 5 == 0;
    std::multiset<std::string> next = model;
    const auto before = state->version();
    const Result<void> result = state->update([&](model::GraphEdit& edit) {
      const int kind = static_cast<int>(random() % 12);
      if (kind == 0) edit.clear(), next.clear();
      for (int i = kind == 1 ? 6'000 : 20; i > 0; --i) {
        const int s = static_cast<int>(random() % 300), o = static_cast<int>(random() % 100);
        edit.add(rdf::iri("#s" + std::to_string(s)), vocab::rdfs::label, rdf::literal(std::to_string(o)));
        if (next.count(line(s, o)) == 0) next.insert(line(s, o));
      }
      for (int i = 0; i < 10; ++i) {
        const int s = static_cast<int>(random() % 300), o = static_cast<int>(random() % 100);
        const std::string subject = "#s" + std::to_string(s), label = std::to_string(o);
        const rdf::TermView sv = rdf::iri(subject), pv = vocab::rdfs::label, ov = rdf::literal(label);
        edit.remove(&sv, &pv, &ov);
        next.erase(line(s, o));
      }
      if (random() % 8 == 0) REQUIRE(lines_of(edit.graph()) == next);
      if (fails) throw std::runtime_error("given up");
    });
    REQUIRE(bool(result) == !fails);
    const auto version = state->version();
    if (fails) {
      REQUIRE(version.graph == before.graph);
    } else {
      REQUIRE((version.revision != before.revision || next == model));
      model = std::move(next);
    }
    const bool is_large = rdf::SharedGraph::in(*version.graph) != nullptr;
    if (was_large && !is_large) was_small_again = true;
    was_large = is_large || was_large;
    if (step % 2 == 0) continue;
    REQUIRE(lines_of(*version.graph) == model);
    REQUIRE(version.bytes == bytes_of(*version.graph));
    if (step % 10 == 1) past.emplace_back(version.graph, model);
  }
  CHECK(was_large);
  CHECK(was_small_again);
  for (const auto& [graph, had] : past) REQUIRE(lines_of(*graph) == had);
}

TEST_CASE("a large document for an empty graph of a World is what its triples one by one are", "[model][world][shared]") {
  GraphOptions options;
  options.max_triples = 100'000;
  rdf::Graph document;
  for (int i = 0; i < 6'000; ++i) {
    const auto cell = document.fresh_blank();
    document.add(cell, document.intern(vocab::rdfs::label), document.intern(rdf::tagged_literal(std::to_string(i), "en")));
    document.add(rdf::iri("http://e/o" + std::to_string(i % 700)), rdf::iri("http://e/p"), document.term(cell));
  }
  const auto made_of = [&](FunctionRef<void(model::GraphEdit&)> change, std::string& changes) {
    const rdf::Graph empty;
    model::GraphEdit edit(empty, 0, "http://lrt.invalid/world/map", options);
    edit.keep_changes();
    change(edit);
    REQUIRE_FALSE(edit.error());
    CHECK(edit.has_changed());
    changes = edit.take_changes();
    rdf::Graph made = edit.take();
    CHECK(edit.bytes() == bytes_of(made));
    CHECK(rdf::SharedGraph::in(made));
    return made;
  };
  std::string changes, changes_one_by_one, others;
  const rdf::Graph made = made_of([&](model::GraphEdit& edit) { edit.merge(document); }, changes);
  const rdf::Graph one_by_one = made_of(
      [&](model::GraphEdit& edit) {
        for (const rdf::Triple& t : document.triples()) edit.add(document.term(t.subject), document.term(t.predicate), document.term(t.object));
      },
      changes_one_by_one);
  CHECK(made.size() == 12'000);
  CHECK(rdf::write(made, rdf::Syntax::turtle).value() == rdf::write(one_by_one, rdf::Syntax::turtle).value());
  CHECK(lines_of(made_of([&](model::GraphEdit& edit) { model::replay_changes(changes, edit).value(); }, others)) == lines_of(made));
  // Before and after other changes of the same update.
  const rdf::TermView p = rdf::iri("http://e/p");
  const rdf::Graph mixed = made_of(
      [&](model::GraphEdit& edit) {
        add_objects(edit, 0, 10);
        edit.clear();
        (void)edit.graph();
        edit.merge(document);
        edit.remove(nullptr, &p, nullptr);
        edit.add(rdf::iri("http://e/o1"), p, rdf::literal("x"));
        edit.merge(document);  // new blank nodes again
      },
      others);
  CHECK(mixed.size() == 6'001 + 12'000);

  // In the place of another large one, with which it has some triples in common.
  rdf::Graph before = one_by_one;
  for (int i = 0; i < 5'000; ++i) before.add(rdf::iri("http://e/other" + std::to_string(i)), p, rdf::literal("x"));
  for (const bool is_changed_more : {false, true}) {
    CAPTURE(is_changed_more);
    model::GraphEdit edit(before, bytes_of(before), "http://lrt.invalid/world/map", options);
    edit.keep_changes();
    edit.clear();
    edit.merge(document);
    if (is_changed_more) {
      const rdf::TermView gone = rdf::literal("17", vocab::rdf_::langString), s1 = rdf::iri("http://e/o1");
      edit.remove(nullptr, nullptr, &gone);
      edit.remove(&s1, &p, nullptr);
      edit.add(rdf::iri("http://e/other1"), p, rdf::literal("x"));
    }
    CHECK(edit.has_changed());
    const std::string kept = edit.take_changes();
    const rdf::Graph after = edit.take();
    CHECK(edit.bytes() == bytes_of(after));
    CHECK(after.size() == (is_changed_more ? 12'000 - 9 + 1 : 12'000));
    model::GraphEdit again(before, bytes_of(before), "http://lrt.invalid/world/map", options);
    model::replay_changes(kept, again).value();
    CHECK(lines_of(again.take()) == lines_of(after));
  }

  const auto refuses = [&](const rdf::TermView& object, Errc code) {
    rdf::Graph bad = document;
    bad.add(rdf::iri("http://e/x"), p, object);
    const auto state = GraphState::create("/world/map", options, "http://lrt.invalid/shapes", nullptr).value();
    const auto result = state->update([&](model::GraphEdit& edit) { edit.merge(bad); });
    REQUIRE_FALSE(result);
    CHECK(result.error().code == code);
    CHECK(state->version().graph->empty());
  };
  refuses(rdf::iri("relative"), Errc::expected_rdf);
  refuses(rdf::literal("\xff"), Errc::expected_rdf);
  refuses(rdf::tagged_literal("x", "no language"), Errc::expected_rdf);
  refuses(rdf::iri("http://e/" + std::string(10'000, 'x')), Errc::limit_exceeded);
}

TEST_CASE("a large graph that is replaced by nearly the same one shares its structure with it", "[model][world][shared]") {
  GraphOptions options;
  options.max_triples = 100'000;
  const auto state = GraphState::create("/world/map", options, "http://lrt.invalid/shapes", nullptr).value();
  state->update([](model::GraphEdit& edit) { add_objects(edit, 0, 9'000); }).value();
  const auto before = state->version();
  model::GraphWrite same;
  same.graph.merge(*before.graph);
  CHECK_FALSE(state->write(same, true));
  CHECK(state->version().revision == before.revision);
  model::GraphWrite other;
  other.graph.merge(*before.graph);
  other.graph.add(rdf::iri("http://e/new"), vocab::rdfs::label, rdf::literal("new"));
  CHECK_FALSE(state->write(other, true));
  const auto after = state->version();
  const auto difference = rdf::shared_difference(*before.graph, *after.graph);
  REQUIRE(difference);
  CHECK(difference->removed.empty());
  CHECK(difference->added.size() == 1);
  CHECK(state
            ->update([](model::GraphEdit& edit) {
              add_objects(edit, 9'000, 9'010);
              throw std::bad_alloc();
            })
            .error()
            .code == Errc::failed);
  CHECK(state->version().graph == after.graph);
}

TEST_CASE("the limits of a graph reach what reads documents for it", "[model][world]") {
  GraphOptions options;
  options.max_triples = 120'000;
  options.turtle = "<#x> <#p> 1";
  for (int i = 2; i <= 110'000; ++i) options.turtle += "," + std::to_string(i);  // more than ReadOptions allow by themselves
  options.turtle += ".";
  const auto state = GraphState::create("/world/map", options, "http://lrt.invalid/shapes", nullptr).value();
  CHECK(state->version().graph->size() == 110'000);
  options.max_triples = 100;
  const auto refused = GraphState::create("/world/map", options, "http://lrt.invalid/shapes", nullptr);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::limit_exceeded);
  CHECK(refused.error().message.find("more than 100 triples") != std::string::npos);  // it is not read to its end
}

TEST_CASE("readers of a large graph of a World keep their version while it is written", "[model][world][shared][threads]") {
  GraphOptions options;
  options.max_triples = 100'000;
  const auto state = GraphState::create("/world/map", options, "http://lrt.invalid/shapes", nullptr).value();
  state->update([](model::GraphEdit& edit) { add_objects(edit, 0, 5'000); }).value();
  std::atomic<bool> done{false};
  std::atomic<int> faults{0};
  std::vector<std::thread> readers;
  for (int r = 0; r < 2; ++r)
    readers.emplace_back([&] {
      for (bool last = false; !last;) {
        last = done;
        const auto version = state->version();
        std::size_t pairs = 0;
        for (const rdf::Triple& t : version.graph->match(nullptr, nullptr, nullptr))
          pairs += version.graph->term(t.predicate).text == "http://e/pair";
        if (pairs % 2 != 0 || version.graph->size() != 5'000 + pairs) ++faults;
      }
    });
  for (int i = 0; i < 60; ++i)
    state
        ->update([i](model::GraphEdit& edit) {  // two triples come, and at times four go
          const std::string s = "#pair" + std::to_string(i);
          edit.add(rdf::iri(s), rdf::iri("http://e/pair"), edit.term_of(1));
          edit.add(rdf::iri(s), rdf::iri("http://e/pair"), edit.term_of(2));
          if (i % 5 != 4) return;
          for (int k : {i, i - 1}) {
            const std::string gone = "#pair" + std::to_string(k);
            const rdf::TermView sv = rdf::iri(gone);
            edit.remove(&sv, nullptr, nullptr);
          }
        })
        .value();
  done = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(faults == 0);
}

namespace {

/// A graph with a file, whose disk is a MemoryJournal.
struct OnDisk {
  explicit OnDisk(GraphOptions options = {}) {
    options.file = "not opened";
    state = GraphState::create("/world/map", std::move(options), "http://lrt.invalid/shapes", nullptr).value();
    first = state->version().graph;
    state->open();
    state->set_journal(&journal);
  }
  ~OnDisk() { state->set_journal(nullptr); }
  OnDisk(const OnDisk&) = delete;
  OnDisk& operator=(const OnDisk&) = delete;
  /// What a restart would restore.
  rdf::Graph restored() const {
    model::GraphEdit edit(*first, 0, state->iri(), state->options());
    for (const auto& record : journal.disk) model::replay_changes(record.changes, edit).value();
    return edit.take();
  }
  void write_all() {
    journal.begin_to_write();
    journal.write(*state);
  }
  void refuse_all() {
    journal.begin_to_write();
    journal.refuse(*state);
  }
  std::multiset<std::string> shown() const { return lines_of(*state->version().graph); }
  MemoryJournal journal;
  std::shared_ptr<GraphState> state;
  std::shared_ptr<const rdf::Graph> first;
};

rdf::Graph turtle(const std::string& text) {
  rdf::ReadOptions options;
  options.base = "http://lrt.invalid/world/map";
  return rdf::read(text, rdf::Syntax::turtle, options).value();
}

model::GraphWrite write_of(model::GraphWrite::Kind kind, const std::string& text) {
  model::GraphWrite write;
  write.kind = kind;
  write.graph = turtle(text);
  return write;
}

model::GraphWrite deletion_of(const std::string& text) {
  model::GraphWrite write;
  write.kind = model::GraphWrite::Kind::edit;
  write.updates.emplace_back();
  write.updates.back().kind = rdf::DataUpdate::Kind::remove;
  write.updates.back().graph = turtle(text);
  return write;
}

/// A client's write, and what it was told.
struct Client {
  Client(GraphState& state, const model::GraphWrite& write) {
    refused = state.write(write, true, &saving);
    if (saving) saving->then([this](model::SaveOutcome o) { outcome = o; });
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  std::shared_ptr<model::Saving> saving;
  std::optional<model::GraphRefusal> refused;
  std::optional<model::SaveOutcome> outcome;
};

constexpr auto merges = model::GraphWrite::Kind::merge, replaces = model::GraphWrite::Kind::replace;

void set(model::GraphEdit& edit, const char* value) {
  const rdf::TermView s = rdf::iri("#cup"), p = rdf::iri("http://e/p");
  edit.remove(&s, &p, nullptr);
  edit.add(s, p, rdf::literal(value));
}

}  // namespace

TEST_CASE("a client that asks for what another one waits for waits, too, and is refused with it", "[model][world]") {
  OnDisk map, other;
  const auto write = write_of(merges, "<#cup> <http://e/p> 1 .");
  Client first(*map.state, write);
  map.state->set_unsaved(0);  // as a journal does before it takes back what the disk has refused
  Client second(*map.state, write);
  const auto prepared = std::get<model::PreparedWrite>(map.state->prepare(write));
  const auto elsewhere = std::get<model::PreparedWrite>(other.state->prepare(write));
  CHECK(!prepared.graph);
  std::shared_ptr<model::Saving> both;
  std::optional<model::SaveOutcome> outcome;
  CHECK_FALSE(GraphState::commit_all({{map.state.get(), &prepared}, {other.state.get(), &elsewhere}}, &both));
  REQUIRE(both);
  both->then([&](model::SaveOutcome o) { outcome = o; });
  REQUIRE(second.saving);
  map.refuse_all();
  other.write_all();
  CHECK(first.outcome == model::SaveOutcome::refused);
  CHECK(second.outcome == model::SaveOutcome::refused);
  CHECK(outcome == model::SaveOutcome::refused);
  CHECK(map.shown().empty());
  Client third(*map.state, write);
  map.write_all();
  CHECK(third.outcome == model::SaveOutcome::saved);
  Client fourth(*map.state, write);
  CHECK(!fourth.refused);
  CHECK(!fourth.saving);  // it is on the disk
}

TEST_CASE("what code asks for while clients wait holds also if the disk refuses them", "[model][world]") {
  GraphOptions options;
  options.turtle = "<#cup> <http://e/p> \"open\" ; <http://e/at> [ <http://e/x> 1 ] .";
  struct Case {
    model::GraphWrite write;
    std::function<void(model::GraphEdit&)> update;
    std::string refused, saved;  // of them
  };
  const std::string at = "<#cup> <http://e/at> [ <http://e/x> 1 ] .";
  const std::vector<Case> cases = {
      {write_of(replaces, "<#cup> <http://e/p> \"closed\" ."), [](model::GraphEdit& e) { set(e, "ajar"); }, "<#cup> <http://e/p> \"ajar\" . " + at,
       "<#cup> <http://e/p> \"ajar\" ."},
      {write_of(merges, "<#cup> <http://e/p> \"mine\" ."), [](model::GraphEdit& e) { e.add_turtle("<#cup> <http://e/p> \"mine\" ."); },
       "<#cup> <http://e/p> \"open\", \"mine\" . " + at, "<#cup> <http://e/p> \"open\", \"mine\" . " + at},
      {deletion_of("<#cup> <http://e/p> \"open\" ."),
       [](model::GraphEdit& e) {
         const rdf::TermView o = rdf::literal("open");
         e.remove(nullptr, nullptr, &o);
       },
       at, at},
      {write_of(replaces, ""), [](model::GraphEdit& e) { e.clear(); }, "", ""},
      {write_of(replaces, "<#cup> <http://e/at> [ <http://e/x> 2 ] ."),
       [](model::GraphEdit& e) { e.remove_node(rdf::iri("http://lrt.invalid/world/map#cup")); }, "", ""},
      {write_of(replaces, "<#box> <http://e/p> 1 ."), [](model::GraphEdit& e) { e.add_turtle("[] <http://e/new> 1 ."); },
       "<#cup> <http://e/p> \"open\" . " + at + " [] <http://e/new> 1 .", "<#box> <http://e/p> 1 . [] <http://e/new> 1 ."},
  };
  for (std::size_t i = 0; i < cases.size(); ++i)
    for (const bool is_saved : {false, true}) {
      CAPTURE(i, is_saved);
      OnDisk map(options);
      Client client(*map.state, cases[i].write);
      REQUIRE(client.saving);
      const std::uint64_t before = map.state->version().revision;
      map.state->update([&](model::GraphEdit& edit) { cases[i].update(edit); }).value();
      CHECK(rdf::isomorphic(*map.state->version().graph, turtle(cases[i].refused)));  // at once
      CHECK(map.state->version().bytes == bytes_of(*map.state->version().graph));
      CHECK(map.state->version().revision > before);
      if (!is_saved) map.refuse_all();
      map.write_all();
      CHECK(client.outcome == (is_saved ? model::SaveOutcome::saved : model::SaveOutcome::refused));
      CHECK(rdf::isomorphic(*map.state->version().graph, turtle(is_saved ? cases[i].saved : cases[i].refused)));
      CHECK(map.state->newest().graph == map.state->version().graph);
      CHECK(map.state->newest().revision == map.state->version().revision);
      CHECK(lines_of(map.restored()) == map.shown());
    }
}

TEST_CASE("clients, code and the disk in any order: what is shown is what is acknowledged and what code asked for", "[model][world]") {
  std::mt19937 random(7);
  const auto some = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  using Set = std::set<std::string>;
  for (int round = 0; round < 200; ++round) {
    CAPTURE(round);
    OnDisk map;
    struct Change {
      std::function<void(Set&)> made;
      std::unique_ptr<Client> client;  // nullptr: by code
    };
    std::vector<Change> changes;
    bool is_writing = false;
    const auto settle = [&] {
      if (some(3) == 0) map.journal.refuse(*map.state);
      else map.journal.write(*map.state);
      is_writing = false;
    };
    const auto name = [](int s, int o) {
      return "<http://lrt.invalid/world/map#s" + std::to_string(s) + "> <http://e/p> \"" + std::to_string(o) + "\"";
    };
    for (int step = 0; step < 30; ++step) {
      const int s = some(3), o = some(3);
      const std::string subject = "#s" + std::to_string(s), value = std::to_string(o), triple = name(s, o),
                        prefix = triple.substr(0, triple.find('"'));
      const rdf::TermView sv = rdf::iri(subject), pv = rdf::iri("http://e/p"), ov = rdf::literal(value);
      const auto forget = [prefix](Set& set) {
        for (auto at = set.begin(); at != set.end();) at = at->compare(0, prefix.size(), prefix) == 0 ? set.erase(at) : std::next(at);
      };
      const auto by_client = [&](const model::GraphWrite& write, std::function<void(Set&)> made) {
        auto client = std::make_unique<Client>(*map.state, write);
        REQUIRE(!client->refused);
        if (client->saving) changes.push_back({std::move(made), std::move(client)});
      };
      const auto by_code = [&](FunctionRef<void(model::GraphEdit&)> change, std::function<void(Set&)> made) {
        map.state->update(change).value();
        changes.push_back({std::move(made), nullptr});
      };
      switch (some(10)) {
        case 0: by_client(write_of(merges, triple + " ."), [triple](Set& set) { set.insert(triple); }); break;
        case 1: by_client(deletion_of(triple + " ."), [triple](Set& set) { set.erase(triple); }); break;
        case 2: by_client(write_of(replaces, triple + " ."), [triple](Set& set) { set = {triple}; }); break;
        case 3: by_code([&](model::GraphEdit& e) { e.add(sv, pv, ov); }, [triple](Set& set) { set.insert(triple); }); break;
        case 4:
          by_code(
              [&](model::GraphEdit& e) {
                e.remove(&sv, &pv, nullptr);
                if (o == 0) (void)e.graph();
                e.add(sv, pv, ov);
              },
              [triple, forget](Set& set) {
                forget(set);
                set.insert(triple);
              });
          break;
        case 5: by_code([&](model::GraphEdit& e) { e.remove(&sv, nullptr, nullptr); }, forget); break;
        case 6:
          if (o == 0) by_code([&](model::GraphEdit& e) { e.clear(); }, [](Set& set) { set.clear(); });
          break;
        default:
          if (is_writing) {
            settle();
          } else {
            map.journal.begin_to_write();
            is_writing = true;
          }
      }
      Set wanted;
      for (const Change& c : changes)
        if (!c.client || c.client->outcome == model::SaveOutcome::saved) c.made(wanted);
      const auto shown = map.shown();
      REQUIRE(Set(shown.begin(), shown.end()) == wanted);
    }
    if (is_writing) settle();
    map.write_all();
    REQUIRE(map.state->newest().graph == map.state->version().graph);
    REQUIRE(lines_of(map.restored()) == map.shown());
    for (const Change& c : changes) REQUIRE((!c.client || c.client->outcome));
  }
}

TEST_CASE("an update that would be too much if clients are taken back is refused", "[model][world]") {
  GraphOptions options;
  options.max_triples = 10;
  options.turtle = "<#cup> <http://e/p> 1, 2, 3, 4, 5, 6, 7, 8, 9, 10 .";
  OnDisk map(options);
  const auto adds = [&](int from, int to) { return map.state->update([&](model::GraphEdit& edit) { add_objects(edit, from, to); }); };
  {
    Client client(*map.state, write_of(replaces, ""));
    CHECK(adds(0, 5).error().code == Errc::limit_exceeded);
    CHECK(map.state->newest().graph->empty());
    map.refuse_all();
    CHECK(map.shown().size() == 10);
  }
  map.state->update([](model::GraphEdit& edit) { edit.clear(); }).value();
  map.write_all();
  // One is on its way to the disk, and only the next one makes room.
  Client first(*map.state, write_of(merges, options.turtle));
  map.journal.begin_to_write();
  Client second(*map.state, write_of(replaces, ""));
  CHECK(adds(0, 5).error().code == Errc::limit_exceeded);
  map.journal.write(*map.state);
  CHECK(map.shown().size() == 10);
  map.write_all();
  CHECK(second.outcome == model::SaveOutcome::saved);
  CHECK(adds(0, 5));
  map.write_all();
  CHECK(lines_of(map.restored()) == map.shown());
}

TEST_CASE("a write of several graphs gives work its turns back", "[model][world]") {
  struct Work final : Turns {
    Duration rest() noexcept override { return {}; }
    void leave() noexcept override {}
    void come_back() noexcept override {}
  } work;
  OnDisk map, other, third;
  const auto write = write_of(merges, "<#cup> <http://e/p> 1 .");
  std::vector<model::PreparedWrite> made;
  for (OnDisk* one : {&map, &other, &third}) made.push_back(std::get<model::PreparedWrite>(one->state->prepare(write)));
  Turns* const before = Turns::set_current(&work);
  std::shared_ptr<model::Saving> saving;
  const auto refused = GraphState::commit_all({{map.state.get(), &made[0]}, {other.state.get(), &made[1]}, {third.state.get(), &made[2]}}, &saving);
  Turns* const after = Turns::set_current(before);
  CHECK(!refused);
  CHECK(after == &work);
}
