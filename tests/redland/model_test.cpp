// SPDX-License-Identifier: Apache-2.0
#include <lrt/redland.hpp>

#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "src/model/host_store.hpp"
#include "tests/redland/host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"

using namespace lrt;
using namespace lrt::test;
using redland::Model;
using redland::Owner;
using redland::Reading;

namespace {

const std::string p = "urn:p";

int log_nothing(void*, librdf_log_message*) { return 1; }

}  // namespace

TEST_CASE("a model of each storage is read, queried and written", "[redland]") {
  for (const StorageKind& kind : all_storages) {
    INFO(kind.name);
    Stranger stranger(kind);
    stranger.add("urn:a", p, "one");
    stranger.add(stranger.uri("urn:a"), stranger.uri(p), stranger.blank("b1"));
    stranger.add(stranger.blank("b1"), stranger.uri(p), stranger.text("zwei", "de"));
    Host host(stranger);

    const Answer first = host.get();
    CHECK(first.status == 200);
    CHECK(missing(first, "<urn:a> <urn:p> \"one\", [ <urn:p> \"zwei\"@de ] .").empty());
    CHECK(first.graph().size() == 3);
    CHECK(host.ask("GET /world/tasks\nAccept: application/ld+json").status == 200);
    CHECK(host.query("SELECT ?o { GRAPH ?g { <urn:a> <urn:p> ?b . ?b <urn:p> ?o } }") == "o\r\nzwei\r\n");

    // The host goes on with librdf.
    stranger.remove("urn:a", p, "one");
    stranger.add("urn:a", p, "two");
    host.changed();
    const Answer second = host.get();
    CHECK(second.tag() != first.tag());
    CHECK(missing(second, "<urn:a> <urn:p> \"two\" .").empty());
    CHECK(second.graph().size() == 3);
    CHECK(host.query("SELECT ?s { GRAPH ?g { ?s <urn:p> \"two\" } }") == "s\r\nurn:a\r\n");

    // A client writes one statement, in each storage.
    CHECK(host.patch("INSERT DATA { <urn:c> <urn:p> \"it's a \\\"quote\\\"; -- \\\\\" }").status == 204);
    CHECK(stranger.has("urn:c", p, "it's a \"quote\"; -- \\"));
    CHECK(host.patch("DELETE DATA { <urn:a> <urn:p> \"two\" }").status == 204);
    CHECK_FALSE(stranger.has("urn:a", p, "two"));
    CHECK(stranger.size() == 3);

    // Several need a transaction.
    const Answer several = host.patch("INSERT DATA { <urn:d> <urn:p> 1, 2 }");
    CHECK(several.status == (kind.has_transactions ? 204 : 501));
    CHECK(stranger.size() == (kind.has_transactions ? 5 : 3));
    if (!kind.has_transactions) CHECK(several.says("no transaction"));
    CHECK(host.model->counters().writes == (kind.has_transactions ? 3 : 2));
    // What a client has written is what the model says.
    const std::string before = host.get().tag();
    host.changed();
    CHECK(host.get().tag() == before);
  }
}

TEST_CASE("several statements without a transaction are allowed by an option", "[redland]") {
  for (const StorageKind& kind : {memory, hashes, trees}) {
    INFO(kind.name);
    Stranger stranger(kind);
    stranger.add("urn:a", p, "one");
    Host host(stranger, [](Options&, GraphOptions&, redland::Options& how) { how.allows_partial_writes = true; });
    CHECK(host.put("<urn:a> <urn:p> 'two', 'three' ; <urn:q> [ <urn:p> 4 ] .").status == 204);
    CHECK(stranger.size() == 4);
    CHECK_FALSE(stranger.has("urn:a", p, "one"));
    CHECK(host.ask("DELETE /world/tasks").status == 204);
    CHECK(stranger.size() == 0);
  }
}

TEST_CASE("If-Match protects a read, a change of the host and a write", "[redland]") {
  Stranger stranger(sqlite);
  stranger.add("urn:a", p, "one");
  Host host(stranger);
  const std::string tag = host.get().tag();
  stranger.add("urn:a", p, "two");
  host.model->changed();  // it is not read yet
  CHECK(host.put("<urn:b> <urn:p> 1 .", "If-Match: " + tag + "\n").status == 412);
  CHECK(stranger.size() == 2);
  const std::string next = host.get().tag();
  CHECK(next != tag);
  CHECK(host.put("<urn:b> <urn:p> 1 .", "If-Match: " + next + "\n").status == 204);
  CHECK(stranger.size() == 1);
  // Without it the change is made on what the host has now.
  stranger.add("urn:b", p, "late");
  host.model->changed();
  CHECK(host.put("<urn:b> <urn:p> 2 .").status == 204);
  CHECK(stranger.size() == 1);
}

TEST_CASE("a host that changes the model in each turn does not starve readers or writers", "[redland]") {
  for (const Owner owner : {Owner::host, Owner::thread}) {
    Stranger stranger(sqlite);
    for (int i = 0; i < 500; ++i) stranger.add("urn:s" + std::to_string(i % 50), p, std::to_string(i));
    stranger.add("urn:turn", p, "0");
    Host host(stranger, [&](Options&, GraphOptions&, redland::Options& how) {
      how.owner = owner;
      how.max_write = 1000;
      how.max_step = std::chrono::microseconds(100);
    });
    int turn = 0;
    host.in_turn = [&] {
      host.model
          ->call([&](librdf_model*) {
            stranger.remove("urn:turn", p, std::to_string(turn));
            stranger.add("urn:turn", p, std::to_string(++turn));
            host.model->changed();
          })
          .value();
    };
    CHECK(host.put("<urn:x> <urn:p> 'mine' .").status == 204);
    host.in_turn = nullptr;
    host.model->detach();
    CHECK(stranger.has("urn:x", p, "mine"));
    CHECK(stranger.size() <= 2);
  }
}

TEST_CASE("shapes judge a client's write before the model has it, and not the host", "[redland]") {
  Stranger stranger(sqlite);
  Host host(stranger, [](Options&, GraphOptions& graph, redland::Options&) {
    graph.shapes =
        "@prefix sh: <http://www.w3.org/ns/shacl#> . <#s> a sh:NodeShape ; sh:targetSubjectsOf <urn:p> ; "
        "sh:property [ sh:path <urn:p> ; sh:maxCount 1 ] .";
  });
  CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> 1, 2 }").status == 422);
  CHECK(stranger.size() == 0);
  CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> 1 }").status == 204);
  stranger.add("urn:b", p, "1");
  stranger.add("urn:b", p, "2");
  host.changed();
  CHECK(host.get().graph().size() == 3);
}

TEST_CASE("an error of the storage reaches the client with Redland's message, and nothing has changed", "[redland]") {
  Stranger stranger(sqlite, {}, log_nothing);
  stranger.add("urn:a", p, "one");
  Host host(stranger, [](Options&, GraphOptions&, redland::Options& how) { how.logger = log_nothing; });
  const Answer nul = host.patch("INSERT DATA { <urn:b> <urn:p> 'before', 'a\\u0000b' }");
  CHECK(nul.status == 500);
  CHECK(nul.says("unrecognized token"));
  CHECK(host.patch("INSERT DATA { <urn:b> <urn:p> '\\u0000b' }").status == 422);
  CHECK(stranger.size() == 1);
  CHECK(host.get().graph().size() == 1);
  CHECK(host.model->counters().failed_writes == 2);
  CHECK(host.patch("INSERT DATA { <urn:b> <urn:p> 'after' }").status == 204);
}

TEST_CASE("a storage that cannot write is 500, and the graph is as it was", "[redland][not_emulated]") {
  Stranger stranger(sqlite_file, {}, log_nothing);
  for (int i = 0; i < 20; ++i) stranger.add("urn:a", p, std::to_string(i));
  Host host(stranger, [](Options&, GraphOptions&, redland::Options& how) { how.logger = log_nothing; });
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto old = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit little{4096, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &little);
  const Answer refused = host.patch("INSERT DATA { <urn:b> <urn:p> '" + std::string(200'000, 'x') + "' }");
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old);
  INFO(refused.body.substr(0, 500));
  CHECK(refused.status == 500);
  CHECK(refused.says("disk I/O error"));
  CHECK(host.get().graph().size() == 20);
  // librdf 1.0.17 takes the transaction for open that SQLite has ended.
  CHECK(host.patch("INSERT DATA { <urn:b> <urn:p> 1 }").status == 204);
  CHECK(stranger.size() == 21);
  const Answer several = host.patch("INSERT DATA { <urn:b> <urn:p> 2, 3 }");
  CHECK(several.status == 501);
  CHECK(several.says("has to open the storage again"));
  CHECK(stranger.size() == 21);
}

TEST_CASE("subscribers get each change once, of the host and of clients", "[redland]") {
  Stranger stranger(sqlite);
  stranger.add("urn:a", p, "0");
  Host host(stranger);
  StreamClient stream(host.server->port(), "/world/tasks?accept=application/n-triples");
  std::vector<std::string> got;
  const auto step = [&] {
    stream.step();
    for (const Event& event : stream.take()) got.push_back(event.data);
  };
  const auto until_says = [&](const std::string& value) {
    host.until([&] { return step(), !got.empty() && got.back().find("\"" + value + "\"") != std::string::npos; });
  };
  until_says("0");
  const std::size_t first = got.size();
  stranger.add("urn:a", p, "1");
  stranger.add("urn:a", p, "1b");
  host.changed();
  until_says("1b");
  CHECK(got.size() == first + 1);
  CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> '2', '2b' }").status == 204);
  until_says("2b");
  CHECK(got.size() == first + 2);
  const std::uint64_t revision = host.model->graph().revision();
  host.changed();  // nothing is new
  CHECK(host.model->graph().revision() == revision);
  for (int i = 0; i < 20; ++i) host.turn(), step();
  CHECK(got.size() == first + 2);
}

TEST_CASE("what RDF 1.1 does not have is left out and counted, or the model is not shown", "[redland]") {
  const auto fill = [](Stranger& s) {
    s.add("urn:a", p, "good");
    s.add("relative", p, "a relative subject");
    s.add(s.uri("urn:a"), s.uri("not absolute"), s.text("x"));
    s.add(s.uri("urn:a"), s.uri(p), s.text("x", "no tag!"));
    s.add(s.uri("urn:a"), s.uri(p), s.text("a\xff"));
    s.add(s.uri("urn:a"), s.uri(p), s.text("same", "en-US"));
    s.add(s.uri("urn:a"), s.uri(p), s.text("same", "EN-us"));
    s.add(s.blank("a b<c>"), s.uri(p), s.blank("n0"));
  };
  Stranger stranger(memory);
  fill(stranger);
  Host host(stranger);
  CHECK(host.model->counters().left_out == 4);
  CHECK(host.model->counters().statements == 8);
  const Answer shown = host.get();
  CHECK(missing(shown, "<urn:a> <urn:p> 'good', 'same'@en-us . [] <urn:p> [] .").empty());
  CHECK(shown.graph().size() == 3);
  // A replacement by what a client was shown leaves the rest where it is, and removes both spellings.
  CHECK(host.patch("DELETE DATA { <urn:a> <urn:p> 'same'@en-us }").status == 204);
  CHECK(stranger.size() == 6);

  Stranger strict(memory);
  fill(strict);
  World world("world");
  redland::Options how;
  how.refuses_foreign_terms = true;
  const auto refused = Model::attach(world, "tasks", strict.model(), how);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.find("RDF 1.1 does not have") != std::string::npos);
}

TEST_CASE("blank nodes keep their labels, and those of clients are new in the model", "[redland]") {
  Stranger stranger(sqlite);
  stranger.add(stranger.blank("b0"), stranger.uri(p), stranger.text("the host's"));
  Host host(stranger);
  CHECK(host.patch("INSERT DATA { _:b0 <urn:p> \"a client's\" }").status == 204);
  CHECK(host.patch("INSERT DATA { _:b0 <urn:p> \"another\" }").status == 204);
  CHECK(stranger.size() == 3);
  const std::string tag = host.get().tag();
  host.changed();  // the same labels
  CHECK(host.get().tag() == tag);
  CHECK(missing(host.get(), "[] <urn:p> \"the host's\" . [] <urn:p> \"a client's\" . [] <urn:p> \"another\" .").empty());
  std::set<std::string> subjects;
  const rdf::Graph graph = redland::to_graph(stranger.model()).value().graph;
  for (const rdf::Triple& t : graph.triples()) subjects.insert(std::string(graph.term(t.subject).text));
  CHECK(subjects.size() == 3);
}

TEST_CASE("each identifier of a model is a blank node of its own, also where it is no label", "[redland]") {
  Stranger stranger(memory);
  // As labels that are made, and before those that need one.
  const std::vector<std::string> ids = {"n0", "n-0", "n-1", "n1", "a b", "<c>", "b0", "n-2"};
  for (const std::string& id : ids) stranger.add(stranger.blank(id), stranger.uri(p), stranger.text("of " + id));
  const std::size_t count = ids.size();
  const auto subjects = [](const rdf::Graph& graph) {
    std::set<std::string> found;
    for (const rdf::Triple& t : graph.triples()) found.insert(std::string(graph.term(t.subject).text));
    return found;
  };
  CHECK(subjects(redland::to_graph(stranger.model()).value().graph).size() == count);
  Host host(stranger);
  const rdf::Graph first = *host.model->graph().snapshot();
  CHECK(first.size() == count);
  CHECK(subjects(first).size() == count);
  stranger.add(stranger.blank("n-7 "), stranger.uri(p), stranger.text("late"));
  host.changed();
  std::set<std::string> now = subjects(*host.model->graph().snapshot());
  CHECK(now.size() == count + 1);
  for (const std::string& label : subjects(first)) CHECK(now.count(label) == 1);
  CHECK(host.patch("INSERT DATA { _:x <urn:p> \"a client's\" }").status == 204);
  CHECK(subjects(*host.model->graph().snapshot()).size() == count + 2);
  CHECK(stranger.has(stranger.blank("a b"), stranger.uri(p), stranger.text("of a b")));
}

TEST_CASE("IRIs of the server have a base in the model", "[redland]") {
  Stranger stranger(sqlite);
  stranger.add("https://robot.example/world/tasks#a", p, "1");
  stranger.add("https://robot.example.org/other", p, "2");
  {
    Host host(stranger, [](Options&, GraphOptions&, redland::Options& how) { how.base = "https://robot.example/"; });
    const std::string own = "http://127.0.0.1:" + std::to_string(host.server->port());
    const Answer shown = host.ask("GET /world/tasks\nAccept: application/n-triples\nHost: 127.0.0.1:" + std::to_string(host.server->port()));
    CHECK(shown.says("<" + own + "/world/tasks#a>"));
    CHECK(shown.says("<https://robot.example.org/other>"));
    CHECK(host.patch("INSERT DATA { <#b> <urn:p> <#a> }").status == 204);
    CHECK(stranger.has(stranger.uri("https://robot.example/world/tasks#b"), stranger.uri(p), stranger.uri("https://robot.example/world/tasks#a")));
  }
  Host host(stranger);
  const Answer refused = host.patch("INSERT DATA { <#b> <urn:p> <#a> }");
  CHECK(refused.status == 422);
  CHECK(refused.says("IRIs of this server"));
}

TEST_CASE("one context of a model, and the union of all", "[redland]") {
  for (const StorageKind& kind : {memory, hashes, sqlite}) {
    INFO(kind.name);
    Stranger stranger(kind, "contexts='yes'");
    const auto put_in = [&](const std::string& context, const std::string& o) {
      librdf_node* const node = stranger.uri(context);
      librdf_statement* const s = librdf_new_statement_from_nodes(stranger.world(), stranger.uri("urn:a"), stranger.uri(p), stranger.text(o));
      librdf_model_context_add_statement(stranger.model(), node, s);
      librdf_free_statement(s);
      librdf_free_node(node);
    };
    put_in("urn:c1", "one");
    put_in("urn:c2", "two");
    put_in("urn:c2", "one");
    {
      Host host(stranger, [](Options&, GraphOptions&, redland::Options& how) { how.context = "urn:c1"; });
      CHECK(host.get().graph().size() == 1);
      CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> 'three' }").status == 204);
      CHECK(host.get().graph().size() == 2);
      host.changed();
      CHECK(host.get().graph().size() == 2);
      CHECK(host.patch("DELETE DATA { <urn:a> <urn:p> 'three' }").status == 204);
      host.changed();
      CHECK(host.get().graph().size() == 1);
    }
    Host host(stranger);
    CHECK(host.get().graph().size() == 2);
  }
  Stranger stranger(trees);
  World world("world");
  redland::Options how;
  how.context = "urn:c1";
  CHECK(Model::attach(world, "tasks", stranger.model(), how).error().code == Errc::invalid_option);
}

TEST_CASE("the limits of the graph hold for the model", "[redland]") {
  Stranger stranger(trees);
  for (int i = 0; i < 10; ++i) stranger.add("urn:a", p, std::to_string(i));
  {
    World world("world");
    GraphOptions graph;
    graph.max_triples = 9;
    const auto refused = Model::attach(world, "tasks", stranger.model(), {}, graph);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message.find("more than 9 statements") != std::string::npos);
  }
  Host host(stranger, [](Options&, GraphOptions& graph, redland::Options& how) {
    graph.max_triples = 12;
    how.max_write = 2;
    how.allows_partial_writes = true;
  });
  CHECK(host.ask("DELETE /world/tasks").status == 413);
  CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> 'x', 'y', 'z' }").status == 413);
  for (int i = 10; i < 20; ++i) stranger.add("urn:a", p, std::to_string(i));
  host.changed();
  const Answer gone = host.get();
  CHECK(gone.status == 503);
  CHECK(gone.says("more than 12 statements"));
  CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> 'x' }").status == 503);
  CHECK(host.query("SELECT (COUNT(*) AS ?n) { GRAPH ?g { <urn:a> <urn:p> ?o } }") == "n\r\n0\r\n");
  CHECK_FALSE(host.model->state());
  for (int i = 10; i < 20; ++i) stranger.remove("urn:a", p, std::to_string(i));
  host.changed();
  CHECK(host.get().graph().size() == 10);
  CHECK(host.model->state());
}

TEST_CASE("subscribers get no message while the model cannot be shown, and the next one when it can", "[redland]") {
  Stranger stranger(trees);
  stranger.add("urn:a", p, "0");
  Host host(stranger, [](Options&, GraphOptions& graph, redland::Options&) { graph.max_triples = 5; });
  StreamClient stream(host.server->port(), "/world/tasks?accept=application/n-triples");
  std::vector<std::string> got;
  const auto step = [&] {
    stream.step();
    for (const Event& event : stream.take()) got.push_back(event.data);
  };
  host.until([&] { return step(), !got.empty(); });
  for (int i = 1; i < 10; ++i) stranger.add("urn:a", p, std::to_string(i));
  host.changed();
  CHECK(host.get().status == 503);
  StreamClient late(host.server->port(), "/world/tasks?accept=application/n-triples");
  for (int i = 0; i < 100; ++i) host.turn(), step(), late.step();
  CHECK(got.size() == 1);
  for (int i = 1; i < 9; ++i) stranger.remove("urn:a", p, std::to_string(i));
  host.changed();
  host.until([&] { return step(), got.size() > 1; });
  CHECK(got.back().find("\"9\"") != std::string::npos);
  CHECK_FALSE(stream.ended);
}

TEST_CASE("each use of a model has a defined result: twice, of one world, closed, detached", "[redland]") {
  Stranger stranger(sqlite), other(memory);
  stranger.add("urn:a", p, "1");
  other.add("urn:a", p, "2");
  librdf_storage* const second_storage = librdf_new_storage(stranger.world(), "memory", nullptr, nullptr);
  librdf_model* const second = librdf_new_model(stranger.world(), second_storage, nullptr);
  {
    Host host(stranger);
    World world("more");
    CHECK(Model::attach(world, "again", stranger.model()).error().code == Errc::duplicate_path);
    CHECK(Model::attach(world, "nothing", nullptr).error().code == Errc::invalid_option);
    redland::Options threaded;
    threaded.owner = Owner::thread;
    CHECK(Model::attach(world, "second", second, threaded).error().code == Errc::invalid_option);
    auto beside = Model::attach(world, "beside", second).value();
    auto of_other = Model::attach(world, "other", other.model(), threaded).value();
    host.server->add(std::move(world)).value();
    CHECK(host.get("/more/beside").graph().empty());
    CHECK(missing(host.get("/more/other"), "<urn:a> <urn:p> '2' .").empty());
    CHECK(host.ask("PATCH /more/other\nContent-Type: application/sparql-update\n\nINSERT DATA { <urn:x> <urn:p> 1 }").status == 405);

    // The host frees what is attached.
    stranger.free_model();
    CHECK(host.get().graph().size() == 1);
    CHECK(host.patch("INSERT DATA { <urn:b> <urn:p> 1 }").status == 204);
    host.changed();
    CHECK(host.get().graph().size() == 2);
    host.model->detach();
    const Answer closed = host.get();
    CHECK(closed.status == 503);
    CHECK(closed.says("closed this model"));
    CHECK(host.patch("INSERT DATA { <urn:b> <urn:p> 2 }").status == 503);
    CHECK(host.query("SELECT (COUNT(*) AS ?n) { GRAPH ?g { <urn:a> <urn:p> ?o } }") == "n\r\n1\r\n");  // of the other model
    host.model->changed();
    host.model->detach();
    CHECK_FALSE(host.model->call([](librdf_model*) {}));
  }
  librdf_free_model(second);
  librdf_free_storage(second_storage);
}

TEST_CASE("a thread of lrt owns the model, and the host calls it there", "[redland]") {
  Stranger stranger(sqlite);
  stranger.add("urn:a", p, "0");
  {
    Host host(stranger, [](Options&, GraphOptions&, redland::Options& how) { how.owner = Owner::thread; });
    const auto here = std::this_thread::get_id();
    host.model
        ->call([&](librdf_model*) {
          CHECK(std::this_thread::get_id() != here);
          stranger.add("urn:a", p, "1");
          host.model->changed();
        })
        .value();
    host.until([&] { return host.get().graph().size() == 2; });
    CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> '2', '3' }").status == 204);
    std::atomic<bool> ends{false};
    std::thread other([&] {
      while (!ends) host.model->changed(), (void)host.model->state(), (void)host.model->counters();
    });
    const auto thrown = host.model->call([](librdf_model*) { throw std::runtime_error("no"); });
    host.model->detach();
    ends = true;
    other.join();
    REQUIRE_FALSE(thrown);
    CHECK(thrown.error().code == Errc::failed);
    CHECK(host.model->state().error().message.find("closed") != std::string::npos);
  }
  CHECK(stranger.size() == 4);
}

TEST_CASE("a host that says nothing is read for each reader and each write", "[redland]") {
  for (const Owner owner : {Owner::host, Owner::thread}) {
    Stranger stranger(sqlite);
    stranger.add("urn:a", p, "0");
    Host host(stranger, [&](Options&, GraphOptions&, redland::Options& how) {
      how.reading = Reading::each_time;
      how.owner = owner;
    });
    const auto add = [&](const std::string& value) { host.model->call([&](librdf_model*) { stranger.add("urn:a", p, value); }).value(); };
    const Answer first = host.get();
    CHECK(first.graph().size() == 1);
    add("1");
    CHECK(host.get("/world/tasks", "If-None-Match: " + first.tag() + "\n").graph().size() == 2);
    add("2");
    CHECK(host.query("SELECT (COUNT(*) AS ?n) { GRAPH ?g { <urn:a> <urn:p> ?o } }") == "n\r\n3\r\n");
    add("3");
    CHECK(host.get("/world?default").graph().size() == 4);
    const std::string tag = host.get().tag();
    add("4");
    CHECK(host.put("<urn:b> <urn:p> 1 .", "If-Match: " + tag + "\n").status == 412);
    CHECK(host.put("<urn:b> <urn:p> 1 .").status == 204);
    host.model->detach();
    CHECK(stranger.size() == 1);
  }
}

TEST_CASE("a write reads the model of a host that says nothing, also after a read that has failed", "[redland]") {
  Stranger stranger(trees);
  for (int i = 0; i < 5; ++i) stranger.add("urn:a", p, std::to_string(i));
  Host host(stranger, [](Options&, GraphOptions& graph, redland::Options& how) {
    how.reading = Reading::each_time;
    graph.max_triples = 6;
  });
  for (int i = 5; i < 9; ++i) stranger.add("urn:a", p, std::to_string(i));
  CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> 'x' }").status == 503);
  CHECK(host.get().status == 503);
  for (int i = 5; i < 9; ++i) stranger.remove("urn:a", p, std::to_string(i));
  CHECK(host.patch("INSERT DATA { <urn:a> <urn:p> 'x' }").status == 204);
  CHECK(stranger.size() == 6);
}

TEST_CASE("readers that wait for a host which does not poll are bounded", "[redland]") {
  Stranger stranger(memory);
  stranger.add("urn:a", p, "0");
  Host host(stranger, [](Options&, GraphOptions&, redland::Options& how) { how.reading = Reading::each_time; });
  model::HostStore& store = *model::GraphAccess::state_of(host.model->graph())->store();
  std::size_t told = 0, read = 0;
  for (int i = 0; i < 10'000; ++i) store.read([&](const Result<void>& result) { ++(result ? read : told); });
  CHECK(told == 2 * 4096);
  host.until([&] { return read + told == 10'000; });
  CHECK(read == 10'000 - 2 * 4096);
}

TEST_CASE("POST adds to a model", "[redland]") {
  Stranger stranger(sqlite);
  stranger.add("urn:a", p, "1");
  Host host(stranger);
  CHECK(host.ask("POST /world/tasks\nContent-Type: text/turtle\n\n<urn:b> <urn:p> 2, [] .").status == 204);
  CHECK(stranger.size() == 3);
  CHECK(missing(host.get(), "<urn:a> <urn:p> '1' . <urn:b> <urn:p> 2, [] .").empty());
}

TEST_CASE("a hidden model is not counted, not queried, not named", "[redland]") {
  const auto rules = [](Options& options, GraphOptions&, redland::Options&) {
    options.security.authenticate = [](const http::Request& request) -> std::optional<security::Principal> {
      const auto who = request.find("Authorization");
      return who ? std::optional(security::Principal{std::string(who->substr(7)), {}}) : std::nullopt;
    };
    const auto may = [&](const std::string& path, const char* who, security::Rights rights) {
      options.security.rules.push_back({path, security::Scope::tree, {security::Who::Kind::principal, who}, rights});
    };
    may("/", "anna", security::Rights::all());
    may("/", "bert", security::Right::read | security::Right::write);
    may("/world/tasks", "anna", security::Rights::all());
  };
  Stranger full(trees), empty(trees);
  for (int i = 0; i < 10; ++i) full.add("urn:secret" + std::to_string(i), p, "secret");
  Host with(full, rules), without(empty, rules);
  const std::string bert = "Authorization: Bearer bert\n";
  CHECK(with.get("/world/tasks", "Authorization: Bearer anna\n").status == 200);
  for (const char* path : {"/world/tasks", "/world", "/world?default", "/", "/all", "/ns/structure", "/.well-known/void"}) {
    INFO(path);
    const Answer a = with.get(path, bert), b = without.get(path, bert);
    CHECK(a.status == b.status);
    CHECK_FALSE(a.says("secret"));
    CHECK((!a.says("tasks") || std::string(path) == "/world/tasks"));  // whose 404 repeats it
  }
  const auto count = [&](Host& host) {
    return host.ask("POST /sparql\nContent-Type: application/sparql-query\nAccept: text/csv\n" + bert + "\nSELECT ?s { GRAPH ?g { ?s <urn:p> ?o } }")
        .body;
  };
  CHECK(count(with) == count(without));
  CHECK(with.ask("PATCH /world/tasks\nContent-Type: application/sparql-update\n" + bert + "\nINSERT DATA { <urn:x> <urn:p> 1 }").status == 404);
}

TEST_CASE("the server stops while a client waits for the host", "[redland]") {
  Stranger stranger(sqlite);
  Host host(stranger);
  Socket socket(host.server->port());
  socket.send("PATCH /world/tasks\nContent-Type: application/sparql-update\n\nINSERT DATA { <urn:a> <urn:p> 1 }");
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  host.server->stop();
  host.server.reset();
  host.model.reset();
  CHECK(stranger.size() <= 1);
}

TEST_CASE("a write is withdrawn if the host does not poll", "[redland]") {
  Stranger stranger(sqlite);
  Host host(stranger, [](Options&, GraphOptions&, redland::Options& how) { how.write_timeout = std::chrono::milliseconds(50); });
  Socket socket(host.server->port());
  socket.send("PATCH /world/tasks\nContent-Type: application/sparql-update\n\nINSERT DATA { <urn:a> <urn:p> 1 }");
  std::optional<Answer> answer;
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!answer && std::chrono::steady_clock::now() < end) answer = socket.receive(std::chrono::milliseconds(10));
  REQUIRE(answer);
  CHECK(answer->status == 503);
  for (int i = 0; i < 20; ++i) host.turn();
  CHECK(stranger.size() == 0);
}
