// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/words.hpp>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/world.hpp>

#include "src/http/negotiate.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

enum class Gait : std::uint8_t { walk, run };
struct Size {
  double width = 1;
  Gait gait = Gait::walk;
};

/// Whether a document has a part, whatever white space is between its words.
bool contains(const std::string& text, const std::string& part) {
  std::string line;
  for (const char c : text) {
    const bool is_space = c == ' ' || c == '\n';
    if (!is_space) line += c;
    else if (!line.empty() && line.back() != ' ') line += ' ';
  }
  return line.find(part) != std::string::npos;
}

}  // namespace

template <>
struct lrt::rdf::traits<Gait> : lrt::rdf::Enumeration<Gait> {
  static void describe(Enumeration<Gait>& e) {
    e.name(Gait::walk, "walk").title("Walk", "en").title("Schritt", "de").description("One foot stays on the ground.", "en");
    e.name(Gait::run, "run");
  }
};

template <>
struct lrt::rdf::traits<Size> : lrt::rdf::Record<Size> {
  static void describe(Record<Size>& r) {
    r.field("width", &Size::width).title("Width", "en").title("Breite", "de").unit(unit::metre).description("Over all.", "en");
    r.field("gait", &Size::gait);
  }
};

namespace {

/// A door with words in two languages, and a lamp without.
struct Robot {
  Robot() {
    Thing door("door");
    door.title("Door", "en").title("T\u00FCr", "de").description("The way into the cell.", "en");
    door.property(
            "angle", [] { return 1.5; }, unit::radian)
        .title("Angle", "en")
        .title("Winkel", "de")
        .description("Zero is shut.", "en");
    door.property("size", [] { return Size(); });
    door.action("open", [](double) {}).title("Open", "en").title("\u00D6ffnen", "de");
    bench.add(std::move(door));
    Thing lamp("lamp");
    lamp.property("power", [] { return true; });
    bench.add(std::move(lamp));
  }
  Answer json(const std::string& path, const std::string& languages = {}, const std::string& fields = {}) {
    return bench.ask("GET " + path + "\nAccept: application/json\n" + (languages.empty() ? "" : "Accept-Language: " + languages + "\n") + fields);
  }
  Bench bench;
};

std::string refusal(const std::function<void(Thing&)>& describe) {
  Bench bench;
  Thing thing("arm");
  describe(thing);
  const Result<void> added = bench.engine.add(std::move(thing));
  return added ? "not refused" : added.error().message;
}

}  // namespace

TEST_CASE("RDF has titles and descriptions in all languages", "[engine][R1.12]") {
  Robot r;
  const std::string door = r.bench.get("/door").body;
  CHECK(contains(door, "dcterms:title \"Door\"@en, \"T\u00FCr\"@de"));
  CHECK(contains(door, "dcterms:description \"The way into the cell.\"@en"));
  const std::string angle = r.bench.get("/door/angle").body;
  CHECK(contains(angle, "dcterms:title \"Angle\"@en, \"Winkel\"@de"));
  CHECK(contains(angle, "dcterms:description \"Zero is shut.\"@en"));
  CHECK(contains(r.bench.get("/door/actions/open").body, "\"Open\"@en, \"\u00D6ffnen\"@de"));
  CHECK(r.bench.ask("GET /door\nAccept-Language: de\n").body == door);
  CHECK(r.bench.get("/door").field("Vary") == "Accept");
  CHECK(contains(r.bench.get("/").body, "dcterms:title \"Robotic Things\"@en"));
}

TEST_CASE("property shapes have the words of properties and of fields", "[engine][R1.11]") {
  Robot r;
  const std::string blueprint = r.bench.get(kind_of(r.bench, "/door")).body;
  CHECK(contains(blueprint, "sh:name \"Angle\"@en, \"Winkel\"@de"));
  CHECK(contains(blueprint, "sh:description \"Zero is shut.\"@en"));
  CHECK(contains(blueprint, "sh:name \"Width\"@en, \"Breite\"@de"));
  CHECK(contains(blueprint, "sh:description \"Over all.\"@en"));
  CHECK(contains(blueprint, "rdfs:seeAlso [ rdf:value \"walk\" ; dcterms:title \"Walk\"@en, \"Schritt\"@de ;"));
  CHECK_FALSE(contains(blueprint, "rdf:value \"run\""));
}

TEST_CASE("terms of the server's vocabulary have the words of fields", "[engine][R1.12]") {
  Robot r;
  const std::string terms = r.bench.get("/ns/vocabulary").body;
  CHECK(contains(terms, "dcterms:title \"Width\"@en, \"Breite\"@de ; dcterms:description \"Over all.\"@en"));
}

TEST_CASE("Things with different words are of different kinds, those with equal words of one", "[engine][R1.11]") {
  Bench bench;
  const auto add = [&](const std::string& path, const std::string& title, const std::string& language) {
    Thing thing(path);
    thing.property("x", [] { return 1.0; }).title(title, language);
    bench.add(std::move(thing));
  };
  add("a", "Reach", "en");
  add("b", "Reach", "en");
  add("c", "Span", "en");
  add("d", "Reach", "fr");
  CHECK(kind_of(bench, "/a") == kind_of(bench, "/b"));
  CHECK(kind_of(bench, "/a") != kind_of(bench, "/c"));
  CHECK(kind_of(bench, "/a") != kind_of(bench, "/d"));
  CHECK(contains(bench.get(kind_of(bench, "/d")).body, "sh:name \"Reach\"@fr"));
}

TEST_CASE("JSON has the texts in the languages that Accept-Language prefers", "[engine][R0.11]") {
  Robot r;
  const Answer plain = r.json("/door"), german = r.json("/door", "de"), english = r.json("/door", "en");
  CHECK(contains(german.body, "\"title\":\"T\u00FCr\",\"description\":\"The way into the cell.\""));
  CHECK(contains(german.body, "\"title\":\"Winkel\",\"description\":\"Zero is shut.\""));
  CHECK(contains(german.body, "\"title\":\"\u00D6ffnen\""));
  CHECK(contains(german.body, R"("width":{"type":"number","unit":"m","title":"Breite","description":"Over all."})"));
  CHECK(contains(german.body, R"("gait":{"type":"string","enum":["walk","run"],"oneOf":[{"const":"walk","title":"Schritt",)"
                              R"("description":"One foot stays on the ground."},{"const":"run"}]})"));
  CHECK(contains(english.body, "\"title\":\"Door\""));
  CHECK(plain.body == english.body);
  for (const auto& [field, expected] : std::vector<std::pair<std::string, const Answer*>>{{"DE-ch, en;q=0.9", &german},
                                                                                          {"de-Latn-x-a, en", &german},
                                                                                          {"en;q=0.1, de;q=0.2", &german},
                                                                                          {"fr, *;q=0.5", &english},
                                                                                          {"de;q=0, en", &english},
                                                                                          {"de;q=x, ;;, en;q=0.5", &english},
                                                                                          {"fr", &english}})
    CHECK(r.json("/door", field).body == expected->body);
}

TEST_CASE("representations that differ by language have tags of their own and say so", "[engine][R0.11]") {
  Robot r;
  const Answer german = r.json("/door", "de"), english = r.json("/door", "en");
  for (const Answer& a : {german, english}) CHECK(a.field("Vary") == "Accept, Accept-Language");
  CHECK(german.field("ETag") != english.field("ETag"));
  CHECK(english.field("Content-Language") == "en");
  CHECK(german.field("Content-Language").empty());                              // the descriptions are in English
  CHECK(r.json("/door/actions/open", "de").field("Content-Language").empty());  // as that of its Thing, to which it links
  const Answer same = r.json("/door", "de", "If-None-Match: " + german.field("ETag") + "\n");
  CHECK(same.status == 304);
  CHECK(same.field("Vary") == "Accept, Accept-Language");
  CHECK(r.json("/door", "en", "If-None-Match: " + german.field("ETag") + "\n").status == 200);
  CHECK(r.json("/door", "de").body == german.body);
  CHECK(r.bench.ask("HEAD /door\nAccept: application/json\nAccept-Language: de\n").field("ETag") == german.field("ETag"));
  CHECK(r.bench.get("/door?accept=text/html").field("Vary") == "Accept");
}

TEST_CASE("a representation without a choice of languages does not vary", "[engine][R0.11]") {
  Robot r;
  const Answer lamp = r.json("/lamp", "de");
  CHECK(lamp.field("Vary") == "Accept");
  CHECK(lamp.field("Content-Language").empty());
  CHECK(lamp.body == r.json("/lamp").body);
  CHECK(lamp.field("ETag") == r.json("/lamp", "fr").field("ETag"));
  const Answer value = r.json("/door/angle", "de");
  CHECK(value.body == "1.5");
  CHECK(value.field("Vary") == "Accept");
}

TEST_CASE("a message is what a GET without Accept-Language responds with", "[engine][R0.17]") {
  Robot r;
  const engine::Channel channel = r.bench.open("/door?accept=application/json", "Accept-Language: de\n");
  const std::vector<std::string> messages = r.bench.messages(channel);
  REQUIRE(messages.size() == 1);
  CHECK(messages.front() == r.json("/door").body);
}

TEST_CASE("the server and the graphs of a World have words", "[engine][R1.12]") {
  engine::EngineOptions options;
  options.title = {{"Kitchen robot", "en"}, {"K\u00FCchenroboter", "de"}};
  options.description = {"It cooks.", "en"};
  Bench bench(std::move(options));
  REQUIRE(bench.engine.check());
  World world("world");
  GraphOptions map;
  map.title = {{"Map", "en"}, {"Karte", "de"}};
  map.description = {"What stands where.", "en"};
  map.clients_may_write = true;
  world.graph("map", std::move(map));
  bench.add(std::move(world));
  const std::string root = bench.get("/").body;
  CHECK(contains(root, "dcterms:title \"Kitchen robot\"@en, \"K\u00FCchenroboter\"@de"));
  CHECK(contains(root, "dcterms:description \"It cooks.\"@en"));
  CHECK(contains(bench.ask("GET /\nAccept: application/json\nAccept-Language: de\n").body,
                 "\"title\":\"K\u00FCchenroboter\",\"description\":\"It cooks.\""));
  CHECK(contains(bench.get("/world").body, "\"Map\"@en, \"Karte\"@de"));
  const auto graph = [&](const std::string& language) {
    return bench.ask("GET /world/map\nAccept: application/json\nAccept-Language: " + language + "\n");
  };
  CHECK(contains(graph("de").body, "\"title\":\"Karte\",\"description\":\"What stands where.\""));
  CHECK(graph("de").field("ETag") != graph("en").field("ETag"));
  for (const char* language : {"de", "en", "fr"})  // what depends on the language is no state that a write could meet
    CHECK(bench.turtle("PUT", "/world/map", "<#a> a <#b> .", "If-Match: " + graph(language).field("ETag") + "\n").status == 204);
  bench.engine.stop();
}

TEST_CASE("a language given twice and an ill-formed tag are refused with the name of what has them", "[engine]") {
  const auto read = [] { return 1.0; };
  CHECK(refusal([&](Thing& t) { t.property("x", read).title("a", "de").title("b", "DE"); }) ==
        "arm/x: it has two texts as title in the language \"de\"; give one for each language");
  CHECK(refusal([&](Thing& t) { t.property("x", read).title("a").title("b"); }) ==
        "arm/x: it has two texts as title without a language; give one for each language");
  CHECK(contains(refusal([&](Thing& t) { t.action("go", [] {}).description("a", "en").description("b", "en"); }),
                 "arm/actions/go: it has two texts as description"));
  CHECK(contains(refusal([&](Thing& t) { t.title("a", "en").title("b", "en"); }), "thing \"arm\": it has two texts as title in the language \"en\""));
  CHECK(contains(refusal([&](Thing& t) { t.title("a").title("b"); }), "thing \"arm\": it has two texts as title without a language"));
  CHECK(contains(refusal([&](Thing& t) { t.description("a", "not a tag"); }),
                 "expected a language tag of its description, for example \"en\", found \"not a tag\""));
  CHECK(contains(refusal([&](Thing& t) { t.property("x", read).title("a", "e_n"); }), "expected a language tag, found \"e_n\""));
  CHECK(refusal([&](Thing& t) { t.property("x", read).title("a").title("b", "en").description("c"); }) == "not refused");
  World world("world");
  GraphOptions twice;
  twice.title = {{"a", "en"}, {"b", "EN"}};
  world.graph("map", std::move(twice));
  Bench bench;
  const Result<void> added = bench.engine.add(std::move(world));
  REQUIRE_FALSE(added);
  CHECK(contains(added.error().message, "graph \"world/map\": it has two texts as title"));
  engine::EngineOptions options;
  options.description = {"a", "?"};
  CHECK_FALSE(engine::Engine(std::move(options)).check());
}

TEST_CASE("language ranges come in the order of their weights", "[http]") {
  using Ranges = std::vector<std::string>;
  CHECK(http::accepted_languages("de-CH, en;q=0.5, fr;q=0.8, *;q=0.1") == Ranges{"de-ch", "fr", "en"});
  CHECK(http::accepted_languages(" , en;q=0,\tde ; q=1.0 ,a b, x;y, \"q\"") == Ranges{"de"});
  CHECK(http::accepted_languages("").empty());
  std::string many;
  for (int i = 0; i < 1000; ++i) many += "en-a" + std::to_string(i) + ",";
  CHECK(http::accepted_languages(many).size() == 32);
}

TEST_CASE("a text is chosen by the languages of the reader, the shorter forms of each before the next", "[rdf]") {
  const std::vector<std::string_view> offered = {"fr", "de", "en-gb", ""};
  const auto chosen = [&](const std::vector<std::string>& wanted) { return offered[rdf::choose_language(offered, wanted)]; };
  CHECK(chosen({"de-Latn-CH-x-mine", "fr"}) == "de");
  CHECK(chosen({"it", "fr"}) == "fr");
  CHECK(chosen({"EN-GB"}) == "en-gb");
  CHECK(chosen({"en"}).empty());  // "en-gb" is no answer to "en"; the text without a language precedes it
  CHECK(chosen({"*", ""}).empty());
  CHECK(rdf::choose_language({"fr", "en-gb"}, {}) == 1);
  CHECK(rdf::choose_language({"fr", "de"}, {"en"}) == 0);
  CHECK_FALSE(rdf::Facets().has_words());
  CHECK(rdf::Facets().title("Width", "en").has_words());
  CHECK(rdf::Facets().merge(rdf::Facets().description("Over all.")).words().descriptions.size() == 1);
  CHECK(rdf::Facets().title("Width", "en").empty());  // words are no restriction
}
