// SPDX-License-Identifier: Apache-2.0
// Which robot this is: read from a file, judged at set-up, and stated where a stranger looks.
#include "src/engine/identity.hpp"

#include <lrt/engine/engine.hpp>

#include <fstream>
#include <string>
#include <vector>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

using namespace lrt;
using namespace lrt::test;
using Catch::Matchers::ContainsSubstring;

namespace {

Identity example() {
  Identity identity;
  identity.iri = "https://robots.example/r7";
  identity.serial_number = "A-1047";
  identity.model = "Baxter";
  identity.manufacturer = "Rethink \"Robotics\"";
  identity.software_version = "2.4.1";
  identity.build = "66dc05c1";
  return identity;
}

/// The message of a file with this text; empty: it is accepted.
std::string refusal_of(const std::string& text) {
  const Folder folder;
  const std::string file = folder / "identity.json";
  std::ofstream(file) << text;
  const Result<Identity> read = Identity::from_file(file);
  if (read) return {};
  CHECK(read.error().code == Errc::invalid_option);
  CHECK_THAT(read.error().message, ContainsSubstring(file));
  return read.error().message;
}

}  // namespace

TEST_CASE("an identity is read from a file that provisioning has written", "[engine][identity]") {
  const Folder folder;
  const std::string file = folder / "identity.json";
  std::ofstream(file) << "\xEF\xBB\xBF" << engine::json_of(example()) << "\n";
  const Identity read = Identity::from_file(file).value();
  CHECK(engine::json_of(read) == engine::json_of(example()));
  CHECK(read.manufacturer == "Rethink \"Robotics\"");
  CHECK(engine::json_of(Identity()) == "{}");
  CHECK(refusal_of(R"({"iri": "urn:uuid:6e8bc430-9c3a-11d9-9669-0800200c9a66"})").empty());
}

TEST_CASE("a file that is no identity is refused, with the member and what was found", "[engine][identity]") {
  CHECK_THAT(refusal_of(""), ContainsSubstring("expected a JSON object"));
  CHECK_THAT(refusal_of("[]"), ContainsSubstring("expected a JSON object"));
  CHECK_THAT(refusal_of("{}"), ContainsSubstring(R"({"iri": "https://robots.example/r7"})"));
  CHECK_THAT(refusal_of(R"({"iri": ""})"), ContainsSubstring("\"iri\""));
  CHECK_THAT(refusal_of(R"({"iri": "r7"})"), ContainsSubstring("absolute IRI") && ContainsSubstring("\"r7\""));
  CHECK_THAT(refusal_of(R"({"iri": "https://robots.example/r 7"})"), ContainsSubstring("absolute IRI"));
  CHECK_THAT(refusal_of(R"({"iri": "urn:a", "serial": "1"})"), ContainsSubstring("serialNumber") && ContainsSubstring("\"serial\""));
  CHECK_THAT(refusal_of(R"({"iri": "urn:a", "serialNumber": 1047})"), ContainsSubstring("expected a text") && ContainsSubstring("serialNumber"));
  CHECK_THAT(refusal_of(R"({"iri": "urn:a", "iri": "urn:b"})"), ContainsSubstring("expected a JSON object"));
  CHECK_THAT(refusal_of(R"({"iri": "urn:a", "model": "a\u0007b"})"), ContainsSubstring("model") && ContainsSubstring("control"));
  CHECK_THAT(refusal_of(R"({"iri": "urn:a", "model": ")" + std::string(1'001, 'x') + "\"}"), ContainsSubstring("1000 bytes"));
  CHECK_THAT(refusal_of(R"({"iri": "urn:a", "model": ")" + std::string(100'000, 'x') + "\"}"), ContainsSubstring("65536 bytes"));
  CHECK(Identity::from_file("/nonexistent/identity.json").error().code == Errc::io_error);
}

TEST_CASE("a name is the last part of the IRI", "[engine][identity]") {
  const auto name_of = [](const std::string& iri) {
    Identity identity;
    identity.iri = iri;
    return identity.name();
  };
  CHECK(name_of("https://robots.example/cell/r7") == "r7");
  CHECK(name_of("https://robots.example/r7#it") == "it");
  CHECK(name_of("https://r7.example/") == "r7.example");
  CHECK(name_of("urn:uuid:6e8bc430") == "6e8bc430");
  CHECK(name_of("https://me@r7.example:8443") == "r7.example");
  CHECK(name_of("http://[::1]:8443/") == "[::1]:8443");
  CHECK(name_of("https://robots.example/cell:7/") == "cell:7");
  CHECK(name_of("urn:robots:") == "robots");
  CHECK(name_of("").empty());
  CHECK(name_of("/").empty());
}

TEST_CASE("the identity is at the root and in the document of all Things, in RDF and JSON", "[engine][identity]") {
  engine::EngineOptions options;
  options.identity = example();
  Bench bench(std::move(options));
  bench.add(Thing{"arm"});
  for (const std::string path : {"/", "/all"}) {
    CAPTURE(path);
    const rdf::Graph graph = bench.get(path).graph();
    const rdf::TermView robot = rdf::iri("https://robots.example/r7");
    CHECK(graph.contains(rdf::iri("http://localhost" + path), rdf::TermView(vocab::lrt_::identity), robot));
    CHECK(graph.contains(robot, rdf::TermView(vocab::rdf_::type), rdf::TermView(vocab::schema::IndividualProduct)));
    CHECK(graph.contains(robot, rdf::TermView(vocab::schema::serialNumber), rdf::literal("A-1047")));
    CHECK(graph.contains(robot, rdf::TermView(vocab::schema::softwareVersion), rdf::literal("2.4.1")));
    CHECK(graph.contains(robot, rdf::TermView(vocab::lrt_::build), rdf::literal("66dc05c1")));
  }
  CHECK_THAT(bench.ask("GET /\nAccept: application/json").body, ContainsSubstring("\"identity\":" + engine::json_of(example())));
  CHECK_THAT(bench.ask("GET /arm/all\nAccept: text/turtle").body, !ContainsSubstring("A-1047"));
}

TEST_CASE("a robot without an identity states none, and one that is not well-formed is refused", "[engine][identity]") {
  Bench bench;
  bench.add(Thing{"arm"});
  CHECK_THAT(bench.ask("GET /\nAccept: application/json").body, !ContainsSubstring("identity"));
  CHECK_THAT(bench.ask("GET /\nAccept: application/n-triples").body, !ContainsSubstring("ns#identity"));
  engine::EngineOptions options;
  options.identity.serial_number = "A-1047";
  const Result<void> refused = engine::Engine(options).check();
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_option);
  CHECK_THAT(refused.error().message, ContainsSubstring("identity: iri"));
}
