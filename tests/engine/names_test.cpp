// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/engine/parts.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/model/spec.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

const std::string host = "http://localhost";

/// Where a resource's description links to, below the server.
std::string linked(Bench& bench, const std::string& path, Iri predicate) {
  const Answer answer = bench.get(path);
  if (answer.status != 200) return "no " + path;
  const rdf::Graph graph = answer.graph();
  const auto objects = graph.objects(rdf::iri(host + path), rdf::TermView(predicate));
  return objects.empty() ? std::string() : std::string(objects.front().text.substr(host.size()));
}

/// The Blueprint of the thing `arm` itself: the last one that it refers to, after those of its kind and its bounds.
std::string own_blueprint(Bench& bench) {
  const rdf::Graph graph = bench.get("/arm").graph();
  const auto objects = graph.objects(rdf::iri(host + "/arm"), rdf::TermView(vocab::hybrit::blueprint));
  return objects.size() == 3 ? std::string(objects.back().text.substr(host.size())) : std::string();
}

/// The resources of lrt that the thing `arm` links to.
std::map<std::string, std::string> own_paths(Bench& bench) {
  return {{"state", linked(bench, "/arm", vocab::lrt_::state)},
          {"blueprint", own_blueprint(bench)},
          {"subscriptions", linked(bench, "/arm", vocab::hybrit::subscriptions)},
          {"action", linked(bench, "/arm", vocab::hybrit::action)}};
}

const std::map<std::string, std::string> usual = {
    {"state", "/arm/state"}, {"blueprint", "/arm/blueprint"}, {"subscriptions", "/arm/subscriptions"}, {"action", "/arm/actions/turn"}};
const std::map<std::string, std::string> aside = {{"state", "/arm/state-lrt"},
                                                  {"blueprint", "/arm/blueprint-lrt"},
                                                  {"subscriptions", "/arm/subscriptions-lrt"},
                                                  {"action", "/arm/actions-lrt/turn"}};

Thing arm() {
  Thing thing{"arm"};
  thing.property<double>("angle", unit::degree).publish(1);
  thing.action("turn", [](double) {}).consumes(rdf::Facets().between(0, 10));
  thing.shapes("<#own> a <http://www.w3.org/ns/shacl#NodeShape> .");  // so that it has a Blueprint of its own
  return thing;
}

}  // namespace

TEST_CASE("a robot's own state, blueprint, subscriptions and actions have these names, and lrt's move aside", "[engine][R0.3][R1.8]") {
  Bench bench;
  Thing thing = arm();
  thing.property<std::string>("state").publish("welding");
  thing.property<int>("blueprint").publish(7);
  thing.collection<double>("subscriptions").on_create([](const std::string&, double) {}).facets(rdf::Facets().at_most(5));
  thing.property<bool>("actions/turn").publish(true);
  bench.add(std::move(thing));
  CHECK(own_paths(bench) == aside);
  CHECK(bench.get("/arm/state?accept=text/plain").body == "welding");
  CHECK(bench.get("/arm/blueprint?accept=text/plain").body == "7");
  CHECK(bench.get("/arm/actions/turn?accept=text/plain").body == "true");
  const auto post = [&](const std::string& path, const std::string& number) {
    return bench.ask("POST " + path + "\nContent-Type: text/plain\n\n" + number).status;
  };
  CHECK(post("/arm/subscriptions", "4") == 201);
  CHECK(post("/arm/subscriptions", "6") == 422);  // the shape of the robot's collection
  CHECK(post("/arm/actions-lrt/turn", "9") == 204);
  CHECK(post("/arm/actions-lrt/turn", "11") == 422);
  for (const auto& [name, path] : own_paths(bench)) {
    CAPTURE(path);
    const std::vector<std::string> related = bench.get("/arm").linked("related");
    CHECK(std::count(related.begin(), related.end(), host + path) == 1);
    CHECK(bench.get(path).status == 200);
  }
  CHECK(bench.get("/arm/angle").linked("describedby") == std::vector<std::string>{host + kind_of(bench, "/arm")});
  CHECK(violations([&](const std::string& path) { return bench.get(path); }, "/arm", host, "/state-lrt") == "");
}

TEST_CASE("a Thing at the name of a sub-resource moves it aside, in either order, and back when it goes", "[engine][R0.3]") {
  const std::vector<std::string> names = {"state", "blueprint", "subscriptions", "actions/turn"};
  for (const bool first : {false, true}) {
    CAPTURE(first);
    Bench bench;
    if (!first) bench.add(arm());
    for (const std::string& name : names) bench.add(Thing{"arm/" + name});
    if (first) bench.add(arm());
    CHECK(own_paths(bench) == aside);
    for (const std::string& name : names) {
      CHECK(bench.get("/arm/" + name).graph().objects(rdf::iri(host + "/arm/" + name), rdf::TermView(vocab::dcterms::isPartOf)).size() == 1);
      CHECK(bench.get("/arm/" + name + "/state").status == 200);
      REQUIRE(bench.engine.remove("arm/" + name));
    }
    CHECK(own_paths(bench) == usual);
    CHECK(bench.get("/arm/state-lrt").status == 404);
  }
}

TEST_CASE("every order of registration gives the same paths", "[engine][R0.3]") {
  using Make = std::function<Thing()>;
  const std::vector<Make> makes = {arm, [] { return Thing{"arm/state"}; }, [] { return Thing{"arm/state-lrt"}; },
                                   [] {
                                     Thing thing{"arm/actions"};  // its state and arm's action "state" have one name
                                     thing.property<int>("turn");
                                     return thing;
                                   }};
  std::vector<std::size_t> order = {0, 1, 2, 3};
  do {
    Bench bench;
    for (const std::size_t i : order) bench.add(makes[i]());
    CAPTURE(order);
    CHECK(own_paths(bench)["state"] == "/arm/state-lrt-lrt");
    CHECK(own_paths(bench)["action"] == "/arm/actions-lrt/turn");
    CHECK(linked(bench, "/arm/state-lrt", vocab::lrt_::state) == "/arm/state-lrt/state");
    REQUIRE(bench.engine.remove("arm/state"));
    CHECK(own_paths(bench)["state"] == "/arm/state");
    REQUIRE(bench.engine.remove("arm"));
    CHECK(bench.get("/").linked("related") == std::vector<std::string>{"http://localhost/all"});
    for (const char* path : {"/arm/state", "/arm/state-lrt", "/arm/actions/turn"}) CHECK(bench.get(path).status == 404);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST_CASE("the name of an action precedes the names of lrt", "[engine][R0.3]") {
  for (const bool first : {false, true}) {
    Bench bench;
    const auto make = [] {
      Thing thing{"arm"};
      thing.action("state", [] {});
      return thing;
    };
    if (first) bench.add(make());
    bench.add(Thing{"arm/actions"});
    if (!first) bench.add(make());
    CHECK(linked(bench, "/arm", vocab::hybrit::action) == "/arm/actions/state");
    CHECK(linked(bench, "/arm/actions", vocab::lrt_::state) == "/arm/actions/state-lrt");
    CHECK(bench.ask("POST /arm/actions/state").status == 204);
  }
}

TEST_CASE("a thing that is refused moves nothing", "[engine][R0.3]") {
  Bench bench;
  bench.add(arm());
  Thing refused{"arm/state"};
  refused.shapes("<#x> a <http://www.w3.org/ns/shacl#NodeShape> ; <http://www.w3.org/ns/shacl#minLength> true .");
  CHECK_FALSE(bench.engine.add(std::move(refused)));
  std::vector<Thing> batch;
  batch.emplace_back("arm/blueprint");
  batch.emplace_back("arm");
  CHECK_FALSE(bench.engine.add(std::move(batch)));
  CHECK(own_paths(bench) == usual);
}

TEST_CASE("the user's shapes judge as before when their blueprint moves", "[engine][R1.11]") {
  Bench bench;
  Thing thing = arm();
  thing.property("speed", [] { return 1.0; }).on_write([](double) {});
  thing.shapes(
      "@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> ."
      "<#speed> a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:maxInclusive 3.0 ] .");
  bench.add(std::move(thing));
  const auto put = [&](const std::string& number) { return bench.turtle("PUT", "/arm/speed", number_body(number)).status; };
  CHECK(put("2.0e0") == 204);
  CHECK(put("4.0e0") == 422);
  const std::string tag = bench.get("/arm/blueprint").field("ETag");
  bench.add(Thing{"arm/blueprint"});
  CHECK(put("2.0e0") == 204);
  CHECK(put("4.0e0") == 422);
  const rdf::Graph moved = bench.get("/arm/blueprint-lrt").graph();
  CHECK(moved.find(rdf::iri(host + "/arm/blueprint-lrt#speed")));
  CHECK_FALSE(moved.find(rdf::iri(host + "/arm/blueprint#speed")));
  REQUIRE(bench.engine.remove("arm/blueprint"));
  CHECK(bench.get("/arm/blueprint").field("ETag") == tag);
}

TEST_CASE("a subscriber of a resource that moves stays subscribed", "[engine][R0.12]") {
  Bench bench;
  Thing thing{"arm"};
  auto angle = thing.property<double>("angle");
  angle.publish(1);
  bench.add(std::move(thing));
  const engine::Channel channel = bench.open("/arm/state", "Accept: application/json\n");
  CHECK(bench.messages(channel).size() == 1);
  Thing state{"arm/state"};
  state.property<int>("x").publish(5);
  bench.add(std::move(state));
  angle.publish(2);
  bench.look();
  CHECK(bench.messages(channel) == std::vector<std::string>{"{\"angle\":2}"});
  const std::string subscription = linked(bench, "/arm/subscriptions", vocab::ldp::contains);
  CHECK(linked(bench, subscription, vocab::hybrit::onResource) == "/arm/state-lrt");
  CHECK(bench.ask("DELETE " + subscription).status == 204);
}

TEST_CASE("a saved callback goes on with the resource it was made for, whatever its path is after the restart", "[engine][R0.13]") {
  struct Server {
    Server() {
      engine::EngineOptions options;
      options.clock = &clock;
      options.ids = std::make_shared<FixedIds>();
      options.callbacks.allow = {"receiver.example"};
      parts = std::make_unique<engine::Parts>(std::move(options));
    }
    void add(Thing thing) {
      parts->add(std::move(thing)).value();
      parts->saved.resume();
    }
    /// What the callbacks of "arm" observe.
    std::vector<std::string> observed() const {
      std::vector<std::string> paths;
      for (const auto& s : parts->registry.find_thing("/arm")->subscriptions.subscriptions) paths.push_back(s->observed.path);
      return paths;
    }
    FakeClock clock;
    std::unique_ptr<engine::Parts> parts;
  };
  const auto own_state = [] {
    Thing thing = arm();
    thing.property<int>("state");
    thing.property<int>("actions/turn");
    return thing;
  };
  const auto saved_from = [](Server& s, const std::vector<std::string>& paths) {
    int count = 0;
    for (const std::string& path : paths) {
      engine::SubscriptionRequest request;
      request.observed = s.parts->registry.find(path);
      request.protocol = engine::Protocol::callback;
      request.url = "http://receiver.example/";
      s.parts->subscriptions.make(std::move(request), 0, "c" + std::to_string(++count), s.clock.now().utc);
    }
    return s.parts->saved.take().value().text;
  };
  Server plain, moved;
  plain.add(arm());
  moved.add(own_state());
  const std::string of_plain = saved_from(plain, {"/arm/state", "/arm/actions/turn", "/arm/angle", "/arm"});
  const std::string of_moved = saved_from(moved, {"/arm/state-lrt", "/arm/actions-lrt/turn", "/arm/angle", "/arm"});
  CHECK(of_plain == of_moved);
  {
    Server after;
    after.parts->saved.restore(of_plain).value();
    after.add(own_state());
    CHECK(after.observed() == std::vector<std::string>{"/arm/state-lrt", "/arm/actions-lrt/turn", "/arm/angle", "/arm"});
  }
  {
    Server after;
    after.parts->saved.restore(of_moved).value();
    after.add(Thing{"arm/state"});
    after.add(arm());
    CHECK(after.observed() == std::vector<std::string>{"/arm/state-lrt", "/arm/actions/turn", "/arm/angle", "/arm"});
  }
  {
    Server before, after;
    before.add(own_state());
    after.parts->saved.restore(saved_from(before, {"/arm/state", "/arm/actions/turn"})).value();
    after.add(arm());  // the robot's own are gone: the callbacks wait, and do not get what lrt has there
    CHECK(after.observed().empty());
  }
}

TEST_CASE("the paths that remain reserved are named in the error", "[engine][json_ld][R0.3]") {
  Bench bench;
  for (const char* path : {"ns/lrt", "ns/vocabulary", "ns/context.jsonld"}) {
    const Result<void> added = bench.engine.add(Thing{path});
    REQUIRE_FALSE(added);
    CHECK(added.error().code == Errc::duplicate_path);
    CHECK(added.error().message ==
          "path \"" + std::string(path) +
              "\" is reserved, as are \"ns/lrt\", \"ns/vocabulary\", \"ns/context.jsonld\", \"ns/structure\", \".well-known/void\" and, with tokens, "
              "\"ns/session\" and \"ns/ticket\", and the path of the SPARQL endpoint: choose another name");
  }
  bench.add(arm());
  CHECK(bench.engine.add(Thing{"arm/angle"}).error().message == "path \"arm/angle\" is already in use, in the thing \"arm\": choose another name");
  bench.add(Thing{"ns"});
}

TEST_CASE("a path may begin with the server's root, and an error says what to write", "[engine][model][R0.3]") {
  Bench bench;
  Thing thing{"/arm/left"};
  CHECK(thing.path() == "arm/left");
  thing.add(vocab::dcterms::hasPart, Object::resource("/arm/left/angle"));
  thing.property("angle", [] { return 1; });
  bench.add(std::move(thing));
  CHECK(bench.get("/arm/left").graph().objects(rdf::iri(host + "/arm/left"), rdf::TermView(vocab::dcterms::hasPart)).front().text ==
        host + "/arm/left/angle");
  REQUIRE(bench.engine.remove("/arm/left"));
  const auto error_of = [](const char* path) { return std::move(Thing{path}).release()->handles->first_error->message; };
  CHECK(error_of("") == "path \"\": it is empty: write a name, for example \"arm\"");
  CHECK(error_of("/") == "path \"/\": it begins with '/': write a name, for example \"arm\"");
  CHECK(error_of("arm/") == "path \"arm/\": it ends with '/': write \"arm\"");
  CHECK(error_of("a//b") == "path \"a//b\": a name between two '/' is empty: write \"a/b\"");
  CHECK(error_of("//a/b") == "path \"/a/b\": it begins with '/': write \"a/b\"");
  CHECK(error_of("a/../b") == "path \"a/../b\": \"..\" is not a name: write \"b\"");
  CHECK(error_of("./a") == "path \"./a\": \".\" is not a name: write \"a\"");
  CHECK(error_of("..") == "path \"..\": \"..\" is not a name: write a name, for example \"arm\"");
  const auto property_error = [](const char* path) {
    Thing other{"arm"};
    other.property<int>(path);
    return std::move(other).release()->handles->first_error->message;
  };
  CHECK(property_error("/angle") == "property of thing \"arm\": path \"/angle\": it begins with '/': write \"angle\"");
}
