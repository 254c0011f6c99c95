// SPDX-License-Identifier: Apache-2.0
#include "src/server/journal.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <list>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include <lrt/rdf/codec.hpp>

#include "src/model/graph_changes.hpp"
#include "src/server/journal_format.hpp"
#include "src/server/saved_file.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

using namespace lrt;
using namespace lrt::test;
using model::GraphEdit;
using model::GraphState;
using model::GraphWrite;
using model::SaveOutcome;
namespace fs = std::filesystem;

namespace {

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
void put(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

/// The triples as text, with their labels of blank nodes.
using Triples = std::set<std::string>;
Triples triples_of(const rdf::Graph& graph) {
  Triples all;
  for (const rdf::Triple& t : graph.triples()) {
    model::GraphChanges line;
    line.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
    all.insert(line.text());
  }
  return all;
}

/// Also on threads that must not use Catch.
template <class F>
void until(F condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) throw std::runtime_error("not within 30 s");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// A graph with a journal, as a server has it.
struct Kept {
  explicit Kept(const std::string& file, GraphOptions options = {}, std::uint64_t compact_beyond = 1U << 30U) {
    options.file = file;
    state = GraphState::create("/world/map", std::move(options), "http://lrt.invalid/", nullptr).value();
    (void)state->restore([&](GraphEdit& edit) {
      found = open_journal(file, [&](std::string_view text) { return model::replay_changes(text, edit); });
      if (!found || found->kind != FoundJournal::Kind::journal) edit.fail({Errc::closed, ""});
    });
    if (!found) return;
    kind = found->kind;
    changes = found->changes;
    journal.emplace(state, *std::move(found),
                    Journal::Options{[this](LogLevel, std::string_view line) {
                                       const std::lock_guard lock(mutex);
                                       lines.emplace_back(line);
                                     },
                                     {},
                                     compact_beyond});
    state->open();
  }
  void update(FunctionRef<void(GraphEdit&)> change) { state->update(change).value(); }
  void add(const std::string& name, int value) {
    update([&](GraphEdit& edit) { edit.add(rdf::iri("#" + name), rdf::iri("http://e.org/p"), rdf::literal(std::to_string(value))); });
  }
  void save() {
    until([&] { return state->unsaved() == 0; });
  }
  Triples triples() const { return triples_of(*state->version().graph); }
  std::vector<std::string> log() {
    const std::lock_guard lock(mutex);
    return lines;
  }

  std::mutex mutex;
  std::vector<std::string> lines;
  std::shared_ptr<GraphState> state;
  Result<FoundJournal> found = FoundJournal();
  FoundJournal::Kind kind{};
  std::uint64_t changes = 0;
  std::optional<Journal> journal;
};

/// What a client adds.
struct Client {
  explicit Client(GraphState& state, const std::string& triple) {
    GraphWrite write;
    write.kind = GraphWrite::Kind::merge;
    write.graph = rdf::read(triple, rdf::Syntax::turtle, {}).value();
    refused = state.write(write, true, &saving);
    if (saving)
      saving->then([this](SaveOutcome o) {
        const std::lock_guard lock(mutex);
        outcome = o;
      });
  }
  std::optional<SaveOutcome> now() {
    const std::lock_guard lock(mutex);
    return outcome;
  }
  SaveOutcome wait() {
    until([&] { return now().has_value(); });
    return *now();
  }
  std::mutex mutex;
  std::shared_ptr<model::Saving> saving;
  std::optional<SaveOutcome> outcome;
  std::optional<model::GraphRefusal> refused;
};

/// The files of this process may have no more bytes: as a full disk, with another error.
class FullDisk {
 public:
  explicit FullDisk(std::size_t bytes) : before_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &limit_);
    struct rlimit small = limit_;
    small.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &limit_);
    std::signal(SIGXFSZ, before_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  void (*before_)(int);
  struct rlimit limit_ {};
};

/// Changes of all kinds, each saved by itself: the bytes of the file while it is open and after, and the graph after each record.
struct Sample {
  Sample() {
    GraphOptions options;
    options.turtle = "<#first> <http://e.org/p> 1, [ <http://e.org/q> \"a\\\"b\\\\c\\nd\\u0001\"@en ] .";
    {
      Kept kept(folder / "sample", options);
      const auto step = [&](FunctionRef<void(GraphEdit&)> change) {
        kept.update(change);
        kept.save();
        const std::string bytes = bytes_of(folder / "sample");
        if (ends.empty()) {  // with the first change the file begins
          const std::size_t begin = bytes.rfind("= c");
          states.push_back(kept.triples());  // which is in the first content too
          ends.push_back(begin);
        }
        states.push_back(kept.triples());
        ends.push_back(bytes.size());
      };
      step([](GraphEdit& e) { e.add(rdf::iri("#x"), rdf::iri("http://e.org/p"), rdf::literal("2")); });
      step([](GraphEdit& e) {
        const rdf::Graph& graph = e.graph();
        const rdf::Triple& about = *graph.match(std::nullopt, graph.find(rdf::iri("http://e.org/q")), std::nullopt).begin();
        const rdf::Term blank(graph.term(about.subject));  // of an earlier record
        e.add(blank.view(), rdf::iri("http://e.org/r"), rdf::iri("#x"));
      });
      step([](GraphEdit& e) { e.remove_node(rdf::iri("http://lrt.invalid/world/map#first")); });
      step([](GraphEdit& e) {
        e.clear();
        e.add(rdf::blank("odd label \n\xC3\xA9"), rdf::iri("http://e.org/p"), rdf::literal("3", Iri("http://e.org/type")));
      });
      step([](GraphEdit& e) { e.merge(rdf::read("[] <http://e.org/p> [] .", rdf::Syntax::turtle, {}).value()); });
      open = bytes_of(folder / "sample");
    }
    closed = bytes_of(folder / "sample");
  }
  const Folder folder;
  std::vector<Triples> states;    ///< after the first content, and after each change
  std::vector<std::size_t> ends;  ///< of their records
  std::string open, closed;
};

}  // namespace

TEST_CASE("a journal restores each change, with its blank nodes", "[server][world][saves]") {
  const Sample sample;
  REQUIRE(sample.states.size() == 6);
  CHECK(sample.states[1] != sample.states[2]);
  for (const std::string& bytes : {sample.open, sample.closed}) {
    put(sample.folder / "again", bytes);
    const Kept again(sample.folder / "again");
    REQUIRE(again.found);
    CHECK(again.changes == 5);
    CHECK(again.triples() == sample.states.back());
  }
  CHECK(sample.closed.compare(0, sample.open.size(), sample.open) == 0);  // only appended
}

TEST_CASE("a journal that is cut at any byte is opened up to the last whole record, or refused with its place", "[server][world][saves]") {
  const Sample sample;
  const std::string file = sample.folder / "cut";
  for (std::size_t size = 0; size < sample.closed.size(); ++size) {
    CAPTURE(size);
    put(file, sample.closed.substr(0, size));
    {
      const Kept kept(file);
      if (size < journal::first_line.size()) {
        REQUIRE(kept.found);
        CHECK(kept.kind == FoundJournal::Kind::earlier);  // kept aside, see world_test.cpp
        continue;
      }
      if (size < sample.ends[0]) {  // it never was so short
        REQUIRE(!kept.found);
        CHECK(kept.found.error().code == Errc::io_error);
        CHECK(kept.found.error().message.find(", byte ") != std::string::npos);
        CHECK(bytes_of(file) == sample.closed.substr(0, size));
        continue;
      }
      REQUIRE(kept.found);
      const auto last = std::upper_bound(sample.ends.begin(), sample.ends.end(), size) - sample.ends.begin() - 1;
      CHECK(kept.triples() == sample.states[static_cast<std::size_t>(last)]);
      if (size % 7 != 0) continue;
    }
    Kept kept(file);  // what comes next follows the last whole record
    kept.add("next", 1);
    kept.save();
    const Triples wanted = kept.triples();
    kept.journal.reset();
    CHECK(Kept(file).triples() == wanted);
  }
}

TEST_CASE("of a journal with a flipped bit nothing is missing before its end", "[server][world][saves]") {
  const Sample sample;
  const std::string file = sample.folder / "flipped";
  const auto flip = [&](std::string bytes, std::size_t at, unsigned bit) {
    bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << bit));
    put(file, bytes);
  };
  for (std::size_t at = 0; at < sample.closed.size(); ++at) {
    CAPTURE(at);
    flip(sample.closed, at, at % 8);
    const Kept kept(file);
    if (at < journal::first_line.size()) {
      if (kept.found) CHECK(kept.kind == FoundJournal::Kind::earlier);  // not lrt's: refused by its reader
      continue;
    }
    if (at < sample.ends.back()) {
      REQUIRE(!kept.found);  // the record of the end says that all were on the disk
      CHECK(kept.found.error().message.find(", byte ") != std::string::npos);
    } else {
      REQUIRE(kept.found);
      CHECK(kept.triples() == sample.states.back());
    }
  }
  for (std::size_t at = journal::first_line.size(); at < sample.open.size(); ++at) {
    CAPTURE(at);
    flip(sample.open, at, (at + 3) % 8);
    const Kept kept(file);
    const std::size_t last = sample.states.size() - 2;
    // A damaged last record is as one that was never whole.
    if (at < sample.ends[last]) CHECK(!kept.found);
    else CHECK(kept.triples() == sample.states[last]);
  }
}

TEST_CASE("records that are missing, repeated or moved are found", "[server][world][saves]") {
  const Sample sample;
  const std::string file = sample.folder / "moved";
  const auto record = [&](std::size_t n) { return sample.closed.substr(sample.ends[n - 1], sample.ends[n] - sample.ends[n - 1]); };
  const std::string begin = sample.closed.substr(0, sample.ends[0]);
  std::string rest;
  for (std::size_t n = 3; n < sample.ends.size(); ++n) rest += record(n);
  for (const std::string& bytes : {begin + record(1) + rest, begin + record(2) + record(1) + rest, begin + record(1) + record(1) + record(2) + rest,
                                   begin + record(1) + "# a remark\n" + record(2) + rest}) {
    put(file, bytes);
    const Kept kept(file);
    REQUIRE(!kept.found);
    CHECK(kept.found.error().code == Errc::io_error);
    CHECK(bytes_of(file) == bytes);
  }
}

TEST_CASE("a journal of another version is refused with its place and stays", "[server][world][saves]") {
  const Sample sample;
  std::string bytes = sample.closed;
  bytes[journal::mark.size()] = '2';
  const std::string file = sample.folder / "newer";
  put(file, bytes);
  {
    const Kept kept(file);
    REQUIRE(!kept.found);
    CHECK(kept.found.error().code == Errc::invalid_option);
    CHECK(kept.found.error().message.find("byte 20: ") != std::string::npos);
  }
  CHECK(bytes_of(file) == bytes);
}

TEST_CASE("changes that the disk refuses are taken back if a client waits, and come later if they are of code", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map";
  Kept kept(file);
  kept.add("first", 1);
  kept.save();
  const Triples first = kept.triples();
  {
    const FullDisk full(fs::file_size(file) + 10);
    Client client(*kept.state, "<http://e.org/s> <http://e.org/p> 1 .");
    REQUIRE(!client.refused);
    CHECK(client.wait() == SaveOutcome::refused);
    CHECK(kept.triples() == first);
    CHECK(triples_of(*kept.state->newest().graph) == first);
    kept.add("code", 2);
    CHECK(kept.triples().size() == 2);  // at once
    Client second(*kept.state, "<http://e.org/s> <http://e.org/p> 2 .");
    CHECK(second.wait() == SaveOutcome::refused);
    CHECK(kept.triples().size() == 2);
    CHECK(kept.state->unsaved() == 1);
    // What is there but not on the disk is not acknowledged either.
    Client same(*kept.state, "<http://lrt.invalid/world/map#code> <http://e.org/p> \"2\" .");
    CHECK(same.wait() == SaveOutcome::refused);
    CHECK(kept.log().size() == 1);  // one line, however often it is tried
    CHECK(kept.log()[0].find(" not saved: ") != std::string::npos);
  }
  Client third(*kept.state, "<http://e.org/s> <http://e.org/p> 3 .");
  CHECK(third.wait() == SaveOutcome::saved);
  CHECK(kept.triples().size() == 3);
  CHECK(kept.state->unsaved() == 0);
  const Triples all = kept.triples();
  kept.journal.reset();
  CHECK(Kept(file).triples() == all);
}

TEST_CASE("a change of code is tried again without another change", "[server][world][saves]") {
  const Folder folder;
  Kept kept(folder / "map");
  {
    const FullDisk full(0);
    kept.add("a", 1);
    until([&] { return !kept.log().empty(); });
    kept.add("b", 2);
    CHECK(kept.state->unsaved() == 2);
  }
  kept.save();
  CHECK(bytes_of(folder / "map").find("#b>") != std::string::npos);
}

TEST_CASE("if more bytes wait than are allowed, clients are refused, and what code changes is written as the whole graph", "[server][world][saves]") {
  const Folder folder;
  GraphOptions options;
  options.max_unsaved_bytes = 200;
  Kept kept(folder / "map", options);
  {
    const FullDisk full(0);
    for (int i = 0; i < 20; ++i) kept.add("a", i);
    CHECK(kept.state->unsaved() == 20);
    Client large(*kept.state, "<http://e.org/s> <http://e.org/p> \"" + std::string(300, 'x') + "\" .");
    REQUIRE(large.refused);
    CHECK(large.refused->kind == model::GraphRefusal::Kind::unsaved);
    CHECK(kept.triples().size() == 20);
  }
  kept.save();
  const Triples all = kept.triples();
  kept.journal.reset();
  const Kept again(folder / "map");
  CHECK(again.triples() == all);
  CHECK(again.triples().size() == 20);
}

TEST_CASE("writes without changes, too, count among what waits for a disk that hangs", "[server][world][saves]") {
  const Folder folder;
  GraphOptions options;
  options.max_unsaved_bytes = 4000;
  std::list<Client> clients;
  Kept kept(folder / "map", options);
  {
    const FullDisk full(0);
    const std::lock_guard hangs(kept.mutex);  // the thread of the journal waits for its log
    kept.add("a", 1);
    const auto is_refused = [&] { return !clients.empty() && clients.back().refused; };
    for (int i = 0; i < 100 && !is_refused(); ++i) clients.emplace_back(*kept.state, "<http://lrt.invalid/world/map#a> <http://e.org/p> \"1\" .");
    REQUIRE(is_refused());
    CHECK(clients.back().refused->kind == model::GraphRefusal::Kind::unsaved);
    clients.pop_back();
    CHECK(clients.size() > 1);
    // Of what code changes there is the graph, and no list.
    for (int i = 0; i < 100; ++i) kept.add("b", i);
    CHECK(kept.triples().size() == 101);
  }
  for (Client& client : clients) (void)client.wait();
  kept.save();
  const Triples all = kept.triples();
  kept.journal.reset();
  CHECK(Kept(folder / "map").triples() == all);
  CHECK(all.size() == 101);
}

TEST_CASE("clients and code write a graph whose disk refuses now and then: what is acknowledged is there", "[server][world][saves][threads]") {
  const Folder folder;
  const std::string file = folder / "map";
  GraphOptions options;
  options.turtle = "<#start> <http://e.org/p> 0 .";
  std::set<std::string> acknowledged;
  Triples shown;
  {
    Kept kept(file, options, 4000);
    std::mutex mutex;
    std::vector<std::thread> writers;
    for (int w = 0; w < 3; ++w)
      writers.emplace_back([&, w] {
        for (int i = 0; i < 60; ++i) {
          const std::string name = "http://e.org/client" + std::to_string(w) + "." + std::to_string(i);
          Client client(*kept.state, "<" + name + "> <http://e.org/p> [] .");
          if (client.refused || client.wait() != SaveOutcome::saved) continue;
          const std::lock_guard lock(mutex);
          acknowledged.insert(name);
        }
      });
    std::thread code([&] {
      for (int i = 0; i < 100; ++i) kept.add("code", i);
    });
    for (int i = 0; i < 5; ++i) {
      const FullDisk full(fs::exists(file) ? fs::file_size(file) + 500 : 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    for (std::thread& writer : writers) writer.join();
    code.join();
    kept.save();
    shown = kept.triples();
    CHECK(triples_of(*kept.state->newest().graph) == shown);
  }
  const Kept again(file);
  REQUIRE(again.found);
  CHECK(again.triples() == shown);
  const auto graph = again.state->version().graph;
  for (const std::string& name : acknowledged) CHECK(graph->find(rdf::iri(name)));
  for (int i = 0; i < 100; ++i) CHECK(graph->find(rdf::literal(std::to_string(i))));
}

TEST_CASE("a journal is compacted while it is written", "[server][world][saves][threads]") {
  const Folder folder;
  const std::string file = folder / "map";
  Triples all;
  {
    Kept kept(file, {}, 10'000);
    std::set<ino_t> files;
    for (int i = 0; i < 3000; ++i) {
      kept.update([&](GraphEdit& edit) {
        const rdf::TermView s = rdf::iri("#n"), p = rdf::iri("http://e.org/p");
        edit.remove(&s, &p, nullptr);
        edit.add(s, p, rdf::literal(std::to_string(i)));
      });
      if (i % 50 != 49) continue;
      kept.save();
      struct stat about {};
      if (::stat(file.c_str(), &about) == 0) files.insert(about.st_ino);
    }
    kept.save();
    until([&] { return fs::file_size(file) < 400'000; });
    CHECK(kept.log().empty());
    all = kept.triples();
    CHECK(all.size() == 1);
  }
  CHECK(Kept(file).triples() == all);
  CHECK(!fs::exists(file + ".new"));
}

TEST_CASE("a journal that is removed is begun anew, and another file in its place stays", "[server][world][saves]") {
  const Folder folder;
  const std::string file = folder / "map";
  Kept kept(file);
  kept.add("a", 1);
  kept.save();
  fs::remove(file);
  Client client(*kept.state, "<http://e.org/s> <http://e.org/p> 1 .");
  CHECK(client.wait() == SaveOutcome::saved);
  {
    fs::copy_file(file, folder / "copy");
    CHECK(Kept(folder / "copy").triples() == kept.triples());
  }
  fs::remove(file);
  put(file, "somebody's");
  Client second(*kept.state, "<http://e.org/s> <http://e.org/p> 2 .");
  CHECK(second.wait() == SaveOutcome::refused);
  CHECK(bytes_of(file) == "somebody's");
}
