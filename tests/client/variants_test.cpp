// SPDX-License-Identifier: Apache-2.0
// Values that are one of several alternatives, as a client sees them.
#include <lrt/client/schema.hpp>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/shacl/derive.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/rdf/plain.hpp"
#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mover.hpp"

using namespace lrt;
using client::Schema;
using test::Answer;
using test::Grip;
using test::Limit;
using test::MoveTo;
using test::Target;
using Kind = rdf::Type::Kind;

namespace {

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
std::string all(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& l : lines) text += l + "\n";
  return text;
}
std::string names(const rdf::Type& type) {
  std::string text;
  for (const rdf::FieldType& f : type.fields) text += (text.empty() ? "" : " ") + f.name;
  return text;
}

Result<Schema> read(const std::string& turtle) {
  static const std::string prefixes =
      "@prefix ex: <http://example.org/ns#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . "
      "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n";
  const Result<rdf::Graph> graph = rdf::read(prefixes + turtle, rdf::Syntax::turtle, {});
  if (!graph) FAIL(graph.error().message);
  return Schema::read(*graph, rdf::iri("http://example.org/ns#S"));
}

const std::string focus_iri = "http://example.org/focus";

/// The shape of a C++ type, read as a schema, writes and reads the same values, in RDF and in JSON.
template <class T>
void check_round_trip(const std::vector<T>& values, bool required = true) {
  const rdf::Type& type = rdf::traits<T>::type();
  for (const bool input : {false, true}) {
    CAPTURE(input);
    rdf::Graph shapes;
    shacl::DeriveOptions options;
    options.input = input;
    options.required = required;
    shacl::derive(shapes, shapes.intern(rdf::iri("http://example.org/ns#S")), type, {}, "http://example.org/v", options);
    client::SchemaOptions stated;
    stated.stated_names = true;
    const Result<Schema> schema = Schema::read(shapes, rdf::iri("http://example.org/ns#S"), stated);
    REQUIRE(schema);
    INFO(all(schema->warnings()));
    REQUIRE(schema->usable());
    CHECK(schema->warnings().empty());
    for (const T& value : values) {
      rdf::Graph written, rewritten, plain;
      const rdf::TermId node = written.intern(rdf::iri(focus_iri));
      rdf::write_value(written, node, type, {}, rdf::traits<T>::encode(value), "http://example.org/v");
      INFO(rdf::write(written, rdf::Syntax::turtle).value());
      const Result<rdf::Value> found = schema->read_value(written, node);
      if (!found) FAIL(found.error().message);
      CHECK(rdf::traits<T>::same(rdf::traits<T>::decode(*found).value(), value));
      schema->write_value(rewritten, rewritten.intern(rdf::iri(focus_iri)), *found);
      // The shape of one that may be absent does not state its class.
      const bool has_class = schema->type().kind != Kind::optional;
      if (has_class) CHECK(rdf::isomorphic(rewritten, written));
      const Result<std::string> json = rdf::write_plain(schema->type(), schema->facets(), *found, rdf::Plain::json);
      REQUIRE(json);
      CHECK(*json == rdf::write_plain(type, {}, rdf::traits<T>::encode(value), rdf::Plain::json).value());
      const Result<void> from_json = schema->write_plain_value(plain, plain.intern(rdf::iri(focus_iri)), *json, {"application", "json", {}});
      if (!from_json) FAIL(from_json.error().message);
      CHECK(rdf::isomorphic(plain, has_class ? written : rewritten));
    }
  }
}

const std::vector<Target> targets = {MoveTo{1, -2, {}}, MoveTo{0, 0, 0.5}, Grip::closed, 1.5, std::monostate()};

}  // namespace

TEST_CASE("the shape of a variant gives a schema that reads and writes the same values", "[client][R1.6]") {
  check_round_trip<Target>(targets);
  check_round_trip<Answer>({2.5, std::string("two")});
  check_round_trip<Limit>({Limit(2.5), Limit(std::string())});
  std::vector<std::optional<Target>> optional(targets.begin(), targets.end());
  optional.push_back(std::nullopt);
  check_round_trip<std::optional<Target>>(optional);
  check_round_trip<std::vector<Target>>({{}, targets});
  check_round_trip<test::Job>({{"a", Grip::open}, {"b", std::monostate()}, {"c", MoveTo{}}});
}

TEST_CASE("a variant of another author is read, however sh:xone is written", "[client][R1.6]") {
  const std::string moved = "sh:path ex:move ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double ; sh:minInclusive 0",
                    named = "sh:path ex:place ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:string";
  for (const std::string& shape : std::vector<std::string>{
           "sh:xone ( [ " + moved + " ] [ " + named + " ] )", "sh:xone ( [ sh:property [ " + moved + " ] ] [ sh:property [ " + named + " ] ] )",
           "sh:xone ( [ sh:property [ " + moved + " ] , [ sh:path ex:place ; sh:maxCount 0 ] ] [ sh:property [ " + named +
               " ] , [ sh:path ex:move ; sh:maxCount 0 ] ] )",
           "sh:property [ sh:path ex:move ; sh:maxCount 1 ; sh:datatype xsd:double ; sh:minInclusive 0 ] , [ sh:path ex:place ; sh:maxCount 1 ; "
           "sh:datatype "
           "xsd:string ] ; sh:xone ( [ sh:path ex:move ; sh:minCount 1 ] [ sh:path ex:place ; sh:minCount 1 ] )",
           "sh:node [ sh:xone ( [ " + moved + " ] [ " + named + " ] ) ]",
           // Two documents that repeat the shape.
           "sh:xone ( [ " + moved + " ] [ " + named + " ] ) , ( [ " + moved + " ] [ " + named + " ] )"}) {
    CAPTURE(shape);
    const Result<Schema> schema = read("ex:S a sh:NodeShape ; sh:class ex:Target ; " + shape + " .");
    REQUIRE(schema);
    REQUIRE(schema->usable());
    INFO(all(schema->warnings()));
    CHECK(schema->warnings().empty());
    const rdf::Type& type = schema->type();
    REQUIRE(type.kind == Kind::variant);
    CHECK(type.classes == std::vector<std::string>{"http://example.org/ns#Target"});
    REQUIRE(names(type) == "move place");
    CHECK(type.fields[0].type->kind == Kind::real);
    CHECK(type.fields[0].facets.min() == 0.0);
    CHECK(type.fields[1].type->kind == Kind::text);
    rdf::Graph graph;
    const rdf::TermId node = graph.intern(rdf::iri(focus_iri));
    REQUIRE(schema->write_plain_value(graph, node, R"({"move":1,"place":"x"})", {"application", "json", {}}));
    const Result<rdf::Value> both = schema->read_value(graph, node);
    REQUIRE(!both);
    CHECK(both.error().code == Errc::expected_value);
    INFO(both.error().message);
    CHECK(contains(both.error().message, "move"));
    CHECK(contains(both.error().message, "place"));
  }
}

TEST_CASE("an alternative without content is a record without fields, and absence is no alternative", "[client][R1.6]") {
  const Result<Schema> schema = read(R"(ex:S sh:property [ sh:path ex:stop ; sh:maxCount 1 ; sh:nodeKind sh:BlankNodeOrIRI ] ,
      [ sh:path ex:angle ; sh:maxCount 1 ; sh:datatype xsd:float ] ;
    sh:xone ( [ sh:property [ sh:path ex:stop ; sh:minCount 1 ] ] [ sh:property [ sh:path ex:angle ; sh:minCount 1 ] ]
              [ sh:property [ sh:path ex:stop ; sh:maxCount 0 ] , [ sh:path ex:angle ; sh:maxCount 0 ] ] ) .)");
  REQUIRE(schema);
  REQUIRE(schema->usable());
  INFO(all(schema->warnings()));
  CHECK(schema->warnings().empty());
  REQUIRE(schema->type().kind == Kind::optional);
  const rdf::Type& type = *schema->type().element;
  REQUIRE(type.kind == Kind::variant);
  REQUIRE(names(type) == "stop angle");
  CHECK(type.fields[0].type->kind == Kind::record);
  CHECK(type.fields[0].type->fields.empty());
}

TEST_CASE("an alternative of which only its node is known is part of the variant", "[client][R1.6]") {
  const Result<Schema> schema = read(
      "ex:S sh:xone ( [ sh:path ex:a ; sh:minCount 1 ; sh:nodeKind sh:BlankNodeOrIRI ] [ sh:path ex:b ; sh:minCount 1 ; "
      "sh:maxCount 1 ; sh:datatype xsd:int ] ) .");
  REQUIRE(schema);
  REQUIRE(schema->usable());
  REQUIRE(schema->type().kind == Kind::variant);
  CHECK(names(schema->type()) == "a b");
}

TEST_CASE("sh:xone of anything else is no variant", "[client][R1.6]") {
  const std::string name = "[ sh:path ex:name ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:string ]";
  const char* warned = "only the first of 2 alternatives of sh:xone";
  for (const auto& [shape, warning] : std::vector<std::pair<std::string, const char*>>{
           {"sh:xone ( [ sh:property " + name + " ] [ sh:property [ sh:path ex:first ; sh:minCount 1 ] , [ sh:path ex:last ; sh:minCount 1 ] ] )",
            warned},
           {"sh:xone ( " + name + " [ sh:path ex:nick ; sh:maxCount 1 ; sh:datatype xsd:string ] )", warned},  // the second may be absent
           {"sh:xone ( " + name + " " + name + " )", warned},                                                  // one predicate
           {"sh:property [ sh:path ex:age ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:int ] ; sh:xone ( " + name +
                " [ sh:path ex:nick ; sh:minCount 1 ] )",
            warned},  // a record with a choice
           {"sh:or ( " + name + " [ sh:path ex:nick ; sh:minCount 1 ] )", "only the first of 2 alternatives of sh:or"}}) {
    CAPTURE(shape);
    const Result<Schema> schema = read("ex:S " + shape + " .");
    REQUIRE(schema);
    REQUIRE(schema->usable());
    CHECK(schema->type().kind == Kind::record);
    CHECK(contains(all(schema->warnings()), warning));
  }
  CHECK(
      read("ex:S sh:property [ sh:path ex:p ; sh:minCount 1 ; sh:maxCount 1 ; sh:xone ( [ sh:datatype xsd:string ] [ sh:datatype xsd:double ] ) ] .")
          ->type()
          .fields[0]
          .type->kind == Kind::real);
  for (const char* ill : {"ex:S sh:xone ( \"a\" ) .", "ex:S sh:xone 5 .", "ex:S sh:xone ( [ sh:path ex:p ; sh:minCount \"x\" ] ) ."}) {
    CAPTURE(ill);
    const Result<Schema> schema = read(ill);
    REQUIRE(!schema);
    CHECK(schema.error().code == Errc::expected_value);
  }
  std::string many = "ex:S sh:xone ( ";
  for (int i = 0; i < 1'001; ++i) many += "[ sh:path ex:p" + std::to_string(i) + " ; sh:minCount 1 ] ";
  CHECK(read(many + ") .").error().code == Errc::limit_exceeded);
  // A variant whose alternative is that variant has no finite type.
  const Result<Schema> endless = read(
      "ex:S sh:xone ( [ sh:path ex:next ; sh:minCount 1 ; sh:maxCount 1 ; sh:node ex:S ] [ sh:path ex:end ; sh:minCount 1 ; "
      "sh:maxCount 1 ; sh:datatype xsd:int ] ) .");
  REQUIRE(endless);
}

TEST_CASE("a client reads, writes, watches and invokes values that are one of several alternatives", "[client][R0.5][R1.6]") {
  test::Mover mover;
  test::RobotHost host(test::one_thing(mover.thing()));
  Client client = Client::create().value();
  const client::Robot robot = client.open(host.url()).value();
  const client::Property target = robot.property("target").value();
  REQUIRE(target.declared());
  CHECK(target.declared()->is_variant);
  CHECK(target.declared()->choices == std::vector<std::string>{"moveTo", "grip", "height", "hold"});
  CHECK(robot.property("next").value().declared()->choices.size() == 4);
  CHECK(!robot.property("job").value().declared()->is_variant);

  CHECK(std::get<MoveTo>(target.read<Target>().value()).y == 2);
  for (const Target& written : targets) {
    const Result<void> done = target.write(written);
    if (!done) FAIL(done.error().message);
    CHECK(target.read<Target>().value().index() == written.index());
  }
  client::Property next = robot.property("next").value();
  CHECK(!next.read<std::optional<Target>>().value());
  REQUIRE(next.write(std::optional<Target>(1.25)));
  CHECK(std::get<double>(*next.read<std::optional<Target>>().value()) == 1.25);
  REQUIRE(next.write(std::optional<Target>()));
  CHECK(!next.read<std::optional<Target>>().value());
  const client::Property job = robot.property("job").value(), plan = robot.property("plan").value(), limit = robot.property("limit").value();
  REQUIRE(job.write(test::Job{"second", Grip::open}));
  CHECK(std::get<Grip>(job.read<test::Job>().value().target) == Grip::open);
  REQUIRE(plan.write(targets));
  CHECK(plan.read<std::vector<Target>>().value().size() == targets.size());
  REQUIRE(limit.write(Limit(0.5)));
  CHECK(std::get<double>(limit.read<Limit>().value()) == 0.5);

  const client::Action go = robot.action("go").value();
  const Result<client::Invocation> went = go.invoke(Target(MoveTo{3, 0, {}}));
  if (!went) FAIL(went.error().message);
  CHECK(std::get<double>(went->result<Answer>().value()) == 3);
  const Result<client::Invocation> held = go.invoke(Target(std::monostate()));
  REQUIRE(held);
  CHECK(std::get<std::string>(held->result<Answer>().value()) == "done");

  std::vector<std::size_t> seen;
  const client::Watch watch = target
                                  .watch({},
                                         [&](const client::Change& change) {
                                           if (change.kind == client::Change::Kind::value)
                                             seen.push_back(target.value_of<Target>(change).value().index());
                                         })
                                  .value();
  const auto wait_for = [&](std::size_t index) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while ((seen.empty() || seen.back() != index) && std::chrono::steady_clock::now() < end) client.poll(std::chrono::milliseconds(20));
    CHECK(!seen.empty());
    if (!seen.empty()) CHECK(seen.back() == index);
  };
  for (const std::size_t index : {std::size_t{0}, std::size_t{3}, std::size_t{1}, std::size_t{2}}) {
    REQUIRE(target.write(index == 0 ? Target(MoveTo{}) : index == 1 ? Target(Grip::open) : index == 2 ? Target(0.25) : Target(std::monostate())));
    wait_for(index);
  }
}

TEST_CASE("what is not exactly one alternative is refused by the client and by the robot, with the names of the alternatives", "[client][R0.6]") {
  test::Mover mover;
  test::RobotHost host(test::one_thing(mover.thing()));
  for (const bool validates : {true, false}) {
    CAPTURE(validates);
    client::Options options;
    options.validate = validates;
    Client client = Client::create(options).value();
    const client::Property target = client.open(host.url()).value().property("target").value();
    const Schema schema = [&] {
      const client::Shape shape = *target.shape().value();
      client::SchemaOptions stated;
      stated.stated_names = true;
      return Schema::read(shape.graph, shape.node.view(), stated).value();
    }();
    REQUIRE(schema.type().kind == Kind::variant);
    // Two alternatives, and none.
    for (const bool both : {true, false}) {
      rdf::Graph graph;
      const rdf::TermId node = graph.intern(rdf::iri(target.url()));
      rdf::Value::Sequence one(4), other(4);
      one[1] = rdf::Value(std::string("open"));
      other[3] = rdf::Value(rdf::Value::Sequence());
      schema.write_value(graph, node, rdf::Value(one));
      if (both) schema.write_value(graph, node, rdf::Value(other));
      rdf::Graph sent;
      const std::string grip = schema.type().fields[1].predicate;
      for (const rdf::Triple& t : graph.triples())
        if (both || graph.term(t.predicate).text != grip) sent.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
      const Result<void> refused = target.write(sent, sent.intern(rdf::iri(target.url())));
      REQUIRE(!refused);
      CHECK(refused.error().code == Errc::expected_value);
      INFO(refused.error().message);
      CHECK(contains(refused.error().message, "grip"));
      CHECK(contains(refused.error().message, "hold"));
      CHECK(contains(refused.error().message, "not sent") == validates);
    }
    CHECK(std::holds_alternative<MoveTo>(target.read<Target>().value()));
  }
}

TEST_CASE("a value of another variant is refused, with what was found", "[client][R1.6]") {
  test::Mover mover;
  test::RobotHost host(test::one_thing(mover.thing()));
  Client client = Client::create().value();
  const client::Robot robot = client.open(host.url()).value();
  const Result<Answer> other = robot.property("target").value().read<Answer>();
  REQUIRE(!other);
  CHECK(other.error().code == Errc::expected_value);
  CHECK(contains(other.error().message, "number"));
  const Result<void> written = robot.property("target").value().write(Answer(2.0));
  REQUIRE(!written);
  CHECK(written.error().code == Errc::expected_value);
}
