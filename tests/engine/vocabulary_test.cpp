// SPDX-License-Identifier: Apache-2.0
// The server's own terms: of C++ types and properties without predicates (SPEC 3.12, R1.5, R1.6).
#include "src/engine/vocabulary.hpp"

#include <optional>
#include <string>
#include <vector>

#include <lrt/thing.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"

using namespace lrt;
using namespace lrt::test;

namespace robot {
struct Gains {
  double p = 1;
  std::optional<double> limit;
  std::vector<double> filter;
};
struct Reach {
  Gains gains;
  double length = 2;
};
template <int joints>
struct Arm {
  double position = 0;
};
}  // namespace robot
namespace other {
struct Gains {
  double p = 1;
};
struct Rest {
  double seconds = 0;
};
struct Spot {
  double x = 0;
};
struct Area {
  Spot spot;
};
}  // namespace other

template <>
struct lrt::rdf::traits<robot::Gains> : lrt::rdf::Record<robot::Gains> {
  static void describe(Record& r) {
    r.field("p", &robot::Gains::p);
    r.field("limit", &robot::Gains::limit).unit(unit::newton);
    r.field("filter", &robot::Gains::filter);
  }
};
template <>
struct lrt::rdf::traits<robot::Reach> : lrt::rdf::Record<robot::Reach> {
  static void describe(Record& r) {
    r.is(vocab::ros::Link);
    r.field("gains", &robot::Reach::gains);
    r.field(vocab::schema::value, &robot::Reach::length);
  }
};
template <int joints>
struct lrt::rdf::traits<robot::Arm<joints>> : lrt::rdf::Record<robot::Arm<joints>> {
  static void describe(lrt::rdf::Record<robot::Arm<joints>>& r) { r.field("position", &robot::Arm<joints>::position); }
};
template <>
struct lrt::rdf::traits<other::Gains> : lrt::rdf::Record<other::Gains> {
  static void describe(Record& r) { r.field("p", &other::Gains::p).unit(unit::one); }
};
template <>
struct lrt::rdf::traits<other::Rest> : lrt::rdf::Record<other::Rest> {
  static void describe(Record& r) {
    r.named("Break, long");
    r.field("idle time", &other::Rest::seconds);
  }
};
/// Its fields are at a node of another class, and take the unit of the record.
template <>
struct lrt::rdf::traits<other::Spot> : lrt::rdf::Record<other::Spot> {
  static void describe(Record& r) { r.field("x", &other::Spot::x); }
  static const Type& type() {
    static const Immortal<Type> changed([] {
      Type t = Record::type();
      t.value_predicate = vocab::vom::quantityValue.text;
      t.value_classes = {std::string(vocab::maths::Vector2D.text)};
      t.fields[0].takes_unit = true;
      return t;
    }());
    return *changed;
  }
};
/// Without a class.
template <>
struct lrt::rdf::traits<other::Area> : lrt::rdf::Record<other::Area> {
  static void describe(Record& r) { r.field("spot", &other::Area::spot); }
  static const Type& type() {
    static const Immortal<Type> changed([] {
      Type t = Record::type();
      t.classes.clear();
      return t;
    }());
    return *changed;
  }
};

namespace {

template <class T>
Thing thing_with(const char* path) {
  Thing thing{path};
  thing.property("value", [] { return T(); });
  return thing;
}

}  // namespace

TEST_CASE("values of a C++ type have the same terms in all Things", "[engine][vocabulary]") {
  Bench bench;
  bench.add(thing_with<robot::Gains>("left"));
  bench.add(thing_with<robot::Gains>("right"));
  for (const std::string side : {"left", "right"}) {
    const Answer a = bench.get("/" + side + "/value");
    CHECK(missing(a, "<" + side + "/value> a <ns/vocabulary#Gains> ; <ns/vocabulary#Gains/p> \"1\"^^xsd:double .") == "");
    CHECK(missing(bench.get("/" + side), "<" + side + "> <ns/vocabulary#Thing/value> <" + side + "/value> .") == "");
  }
}

TEST_CASE("/ns/vocabulary defines each term with label, domain, range and unit", "[engine][vocabulary]") {
  Bench bench;
  bench.add(thing_with<robot::Reach>("left"));
  const Answer a = bench.get("/ns/vocabulary");
  CHECK(missing(a,
                "<ns/vocabulary> a <http://www.w3.org/2002/07/owl#Ontology> . <ns/vocabulary#Gains> a rdfs:Class ; rdfs:label \"Gains\" ; "
                "rdfs:isDefinedBy <ns/vocabulary> ."
                "<ns/vocabulary#Gains/p> a rdf:Property ; rdfs:label \"p\" ; rdfs:domain <ns/vocabulary#Gains> ; rdfs:range xsd:double ."
                "<ns/vocabulary#Gains/limit> rdfs:range maths:Scalar ."
                "<ns/vocabulary#Gains/filter> rdfs:range rdf:List ."
                "<ns/vocabulary#Reach/gains> rdfs:domain ros:Link ; rdfs:range <ns/vocabulary#Gains> ."
                "<ns/vocabulary#Thing/value> a rdf:Property ; rdfs:domain hybrit:RoboticThing ; rdfs:range hybrit:Property .") == "");
  CHECK_FALSE(a.graph().find(rdf::iri("http://localhost/ns/vocabulary#Reach")));  // it has a class of its own
  CHECK(missing(bench.get("/"), "<> rdfs:seeAlso <ns/vocabulary> .") == "");
}

TEST_CASE("a term has no domain and no range that some of its triples do not have", "[engine][vocabulary]") {
  Bench bench;
  bench.add(thing_with<other::Area>("garden"));
  const rdf::Graph terms = bench.get("/ns/vocabulary").graph();
  const auto objects = [&](const char* term, Iri predicate) {
    std::vector<std::string> found;
    for (const rdf::TermView& o : terms.objects(rdf::iri(std::string("http://localhost/ns/vocabulary#") + term), rdf::TermView(predicate)))
      found.emplace_back(o.text);
    return found;
  };
  const std::vector<std::string> none;
  CHECK(objects("Spot/x", vocab::rdfs::domain) == std::vector<std::string>{std::string(vocab::maths::Vector2D.text)});
  CHECK(objects("Spot/x", vocab::rdfs::range) == none);  // a literal, or a node with the unit of the record
  CHECK(objects("Area/spot", vocab::rdfs::domain) == none);
  CHECK(objects("Area/spot", vocab::rdfs::range) == std::vector<std::string>{"http://localhost/ns/vocabulary#Spot"});
}

TEST_CASE("a term is defined while a Thing uses it, and the entity tag says so", "[engine][vocabulary]") {
  Bench bench;
  const auto defines = [&](const char* term) {
    return bench.get("/ns/vocabulary").graph().find(rdf::iri(std::string("http://localhost/ns/vocabulary#") + term)).has_value();
  };
  bench.add(thing_with<robot::Gains>("left"));
  const std::string tag = bench.get("/ns/vocabulary").field("ETag");
  bench.add(thing_with<robot::Reach>("right"));
  CHECK(defines("Reach/gains"));
  CHECK(bench.get("/ns/vocabulary").field("ETag") != tag);
  REQUIRE(bench.engine.remove("left"));
  CHECK(defines("Gains/p"));
  REQUIRE(bench.engine.remove("right"));
  CHECK_FALSE(defines("Gains/p"));
  CHECK_FALSE(defines("Thing/value"));
}

TEST_CASE("two C++ types of one name are an error, unless their fields mean the same", "[engine][vocabulary]") {
  Bench bench;
  bench.add(thing_with<robot::Gains>("left"));
  const Result<void> added = bench.engine.add(thing_with<other::Gains>("right"));
  REQUIRE_FALSE(added);
  CHECK(added.error().message ==
        "thing \"right\": another C++ type is named \"Gains\" in the server's vocabulary, too; give this one a name with r.named(\"...\") in "
        "its describe()");
  CHECK(bench.get("/right").status == 404);
  REQUIRE(bench.engine.remove("left"));
  CHECK(bench.engine.add(thing_with<other::Gains>("right")));
}

TEST_CASE("names of types and fields are made terms", "[engine][vocabulary]") {
  Bench bench;
  bench.add(thing_with<robot::Arm<7>>("arm"));
  bench.add(thing_with<other::Rest>("rest"));
  CHECK(missing(bench.get("/arm/value"), "<arm/value> a <ns/vocabulary#Arm-7> ; <ns/vocabulary#Arm-7/position> \"0\"^^xsd:double .") == "");
  CHECK(missing(bench.get("/rest/value"), "<rest/value> <ns/vocabulary#Break-long/idle%20time> \"0\"^^xsd:double .") == "");
}

TEST_CASE("the robots of a fleet have the vocabulary that the integrator names", "[engine][vocabulary]") {
  engine::EngineOptions options;
  options.vocabulary = "https://acme.example/terms/";
  Bench bench(std::move(options));
  bench.add(thing_with<robot::Gains>("left"));
  CHECK(missing(bench.get("/left/value"), "<left/value> <https://acme.example/terms/Gains/p> \"1\"^^xsd:double .") == "");
  CHECK(missing(bench.get("/ns/vocabulary"), "<https://acme.example/terms/Gains/p> rdfs:isDefinedBy <https://acme.example/terms/> .") == "");
  for (const char* wrong : {"https://acme.example/terms", "terms#", "https://acme.example/ terms#"}) {
    engine::EngineOptions bad;
    bad.vocabulary = wrong;
    engine::Engine engine(std::move(bad));
    const Result<void> checked = engine.check();
    CAPTURE(wrong);
    REQUIRE_FALSE(checked);
    CHECK(checked.error().code == Errc::invalid_option);
  }
}
