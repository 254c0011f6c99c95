// SPDX-License-Identifier: Apache-2.0
#include <lrt/client.hpp>

#include <cmath>
#include <map>
#include <mutex>

#include "src/client/http_client.hpp"
#include "tests/client/robot_host.hpp"
#include "tests/delivery/compress.hpp"
#include "tests/delivery/receiver.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/odd_responses.hpp"

// Servers that are not lrt's: incomplete, unusual or hostile.

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

/// Responds with texts by target.
class Site {
 public:
  /// @param pages  whole responses by target, or by method and target
  explicit Site(std::map<std::string, std::string> pages) : pages_(std::move(pages)), receiver_([this](Peer& peer) { serve(peer); }) {}

  std::string url(const std::string& target = "/") const { return receiver_.url("127.0.0.1", target); }
  std::vector<std::string> requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
  }
  /// The requests for a target.
  std::vector<std::string> requests(const std::string& target) const {
    std::vector<std::string> result;
    for (const std::string& request : requests())
      if (request.find(" " + target + " ") != std::string::npos) result.push_back(request);
    return result;
  }
  void set(const std::string& target, std::string response) {
    const std::lock_guard lock(mutex_);
    pages_[target] = std::move(response);
  }

 private:
  void serve(Peer& peer) {
    while (true) {
      const std::string request = peer.read_request();
      if (request.empty()) return;
      const std::size_t begin = request.find(' ') + 1;
      const std::string target = request.substr(begin, request.find(' ', begin) - begin);
      std::string response;
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
        const auto found = pages_.find(request.substr(0, begin) + target);
        const auto other = pages_.find(target);
        response = found != pages_.end() ? found->second : other != pages_.end() ? other->second : answer(404);
      }
      if (!peer.send(response)) return;
    }
  }

  mutable std::mutex mutex_;
  std::map<std::string, std::string> pages_;
  std::vector<std::string> requests_;
  Receiver receiver_;
};

std::string turtle(std::string_view body, std::string fields = {}) {
  static constexpr std::string_view prefixes =
      "@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> .\n@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .\n"
      "@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> .\n@prefix ros: <http://ros.org/#> .\n"
      "@prefix ldp: <http://www.w3.org/ns/ldp#> .\n@prefix sh: <http://www.w3.org/ns/shacl#> .\n"
      "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n@prefix dcterms: <http://purl.org/dc/terms/> .\n"
      "@prefix http: <http://www.w3.org/2011/http#> .\n@prefix m: <http://www.w3.org/2011/http-methods#> .\n"
      "@prefix ex: <http://example.org/#> .\n";
  return answer(200, std::string(prefixes) + std::string(body), "Content-Type: text/turtle\r\n" + fields);
}

client::Options quick() {
  client::Options options;
  options.limits.response_time = milliseconds(5'000);
  return options;
}

template <class T>
std::string message_of(const Result<T>& result) {
  return result ? "a value" : result.error().message;
}

}  // namespace

TEST_CASE("a Thing of unknown predicates is found by its types and values", "[client][R1.4][R1.6]") {
  // No hybrit:property, no ETag, relative IRIs, several types, a value with terms of others, a value without a URL.
  Site site({{"/", turtle("<> a ldp:Container ; ex:holds <cell/arm> .")},
             {"/cell/arm",
              turtle("<> a ex:Machine, hybrit:RoboticThing, ros:Robot ; ex:angle <arm/angle> ; ex:tool <tool#it> ; hybrit:property ex:speed ; "
                     "ex:speed [ a hybrit:Property ; vom:numericalValue 1.5 ] ; hybrit:property <#mass> ; ex:maker <http://elsewhere.example/> . "
                     "<#mass> vom:numericalValue 7 ; vom:unit maths:Degree .")},
             {"/cell/arm/angle", turtle("<> ex:unknown true ; rdf:value 12 .")},
             {"/cell/tool", turtle("<tool#it> a hybrit:RoboticThing ; dcterms:title \"Tool\" ; hybrit:action <tool/open> .")}});
  Client client = Client::create(quick()).value();
  const client::Robot robot = client.open(site.url()).value();
  INFO((robot.problems().empty() ? std::string() : robot.problems().front()));
  CHECK(robot.problems().empty());
  REQUIRE(robot.things().size() == 2);
  const client::Thing arm = robot.thing("cell/arm").value();
  CHECK(arm.types().size() == 3);
  CHECK(arm.property("angle").value().read<double>().value() == 12);
  CHECK(arm.property("angle").value().read<int>().value() == 12);
  CHECK(arm.property("speed").value().read<double>().value() == 1.5);
  CHECK(message_of(arm.property("speed").value().write(2.0)).find("cannot be written") != std::string::npos);
  CHECK(arm.property("mass").value().read<double>(unit::degree).value() == 7);
  CHECK(arm.property("mass").value().unit().value() == unit::degree);
  CHECK_FALSE(arm.property("mass").value().is_writable().value());
  CHECK(robot.thing("Tool").value().actions().size() == 1);
  for (const std::string& request : site.requests()) CHECK(request.find("elsewhere") == std::string::npos);
}

TEST_CASE("what a robot says may be NaN, and its unit may be named by one IRI", "[client]") {
  Site site(
      {{"/", turtle("<> a hybrit:RoboticThing ; hybrit:property <v>, <w> .")},
       {"/v", turtle("<> vom:numericalValue \"NaN\"^^<http://www.w3.org/2001/XMLSchema#double> .")},
       {"/w", turtle("<> vom:numericalValue 2 ; vom:unit maths:Degree ; <http://qudt.org/schema/qudt/hasUnit> <http://qudt.org/vocab/unit/DEG> .")}});
  Client client = Client::create(quick()).value();
  const client::Robot robot = client.open(site.url()).value();
  CHECK(std::isnan(robot.property("v").value().read<double>().value()));
  CHECK(robot.property("w").value().read<double>({unit::degree.qudt, {}, {}}).value() == 2);
  CHECK(robot.property("w").value().read<double>({{}, unit::degree.vom, {}}).value() == 2);
  CHECK_FALSE(robot.property("w").value().read<double>({unit::radian.qudt, {}, {}}).has_value());
}

TEST_CASE("the fields of a response keep their percent escapes", "[client]") {
  Site site({{"/", "HTTP/1.1 100 Continue\r\n\r\n" +
                       answer(200, "x", "Content-Type: text/plain\r\nLink: </a%2Fb%20c%23d>; rel=\"item\"\r\nETag: \"50%25\"\r\nX-Empty:\r\n")},
             {"/from", answer(307, {}, "Location: /to?graph=http%3A%2F%2Fa%2F%23b\r\n")},
             {"/to?graph=http%3A%2F%2Fa%2F%23b", answer(200, "there")}});
  Client client = Client::create(quick()).value();
  const client::Response response = client.send({"GET", site.url(), {}, {}}).value();
  CHECK(response.fields.find("Link") == "</a%2Fb%20c%23d>; rel=\"item\"");
  CHECK(response.fields.find("ETag") == "\"50%25\"");
  CHECK_FALSE(response.fields.find("X-Empty").has_value());
  CHECK(client.send({"GET", site.url("/from"), {}, {}}).value().body == "there");
}

TEST_CASE("a server with N-Triples only and without ETags is read and written", "[client][R1.6]") {
  Site site({});
  const std::string base = site.url("");
  const auto n_triples = [&](const std::string& body) { return answer(200, body, "Content-Type: application/n-triples\r\n"); };
  const std::string type = "<http://www.w3.org/1999/02/22-rdf-syntax-ns#type>", hybrit = "https://hybr-it-projekt.de/ns/hybr-it#";
  site.set("/", n_triples("<" + base + "/> <http://example.org/has> <" + base + "/x> .\n"));
  site.set("/x", n_triples("<" + base + "/x> " + type + " <" + hybrit + "RoboticThing> .\n<" + base + "/x> <" + hybrit + "property> <" + base +
                           "/x/v> .\n"));
  site.set("/x/v", n_triples("<" + base +
                             "/x/v> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> "
                             "\"4\"^^<http://www.w3.org/2001/XMLSchema#integer> .\n"));
  site.set("PUT /x/v", answer(415, {}, "Accept: application/n-triples\r\n"));
  Client client = Client::create(quick()).value();
  const client::Property value = client.open(site.url()).value().property("x/v").value();
  CHECK(value.read<int>().value() == 4);
  CHECK(message_of(value.write(5.0)).find("415") != std::string::npos);
  const std::vector<std::string> sent = site.requests("/x/v");
  REQUIRE(sent.size() >= 2);
  CHECK(sent.back().find("application/n-triples") != std::string::npos);  // tried once more in what the server accepts
}

TEST_CASE("a root that is a Thing, a list without types, and links alone are discovered", "[client][R0.9][R1.6]") {
  Client client = Client::create(quick()).value();
  SECTION("the root itself, without a known term") {
    Site site({{"/", turtle("<> a ex:Robot ; ex:angle <angle> ; ex:home </> .")}, {"/angle", turtle("<> ex:degrees 12 .")}});
    const client::Robot robot = client.open(site.url()).value();
    REQUIRE(robot.things().size() == 1);
    CHECK(robot.things()[0].url() == site.url());
    REQUIRE(robot.things()[0].properties().size() == 1);
    CHECK(robot.property("angle").value().url() == site.url("/angle"));
  }
  SECTION("a document about nothing but itself") {
    Site site({{"/", turtle("<> a ex:Lamp .")}});
    CHECK(client.open(site.url()).value().things().size() == 1);
  }
  SECTION("a list without types") {
    Site site({{"/", turtle("<> ldp:contains <arm>, <leg> .")},
               {"/arm", turtle("<> ex:angle <arm/angle> ; ex:turn <arm/turn> ; ex:up <./> .")},
               {"/leg", turtle("<> ex:angle <leg/angle> .")},
               {"/arm/angle", turtle("<> rdf:value 1 ; ex:of <../arm> .", "Allow: GET, PUT\r\n")},
               {"/arm/turn", turtle("<> ex:of <../arm> .", "Allow: GET, POST\r\n")},
               {"/leg/angle", turtle("<> ex:degrees 2 .")}});
    const client::Robot robot = client.open(site.url()).value();
    REQUIRE(robot.things().size() == 2);
    CHECK(robot.thing("arm").value().property("angle").value().read<double>().value() == 1);
    CHECK(robot.thing("arm").value().action("turn").has_value());
    CHECK(robot.thing("leg").value().properties().size() == 1);
  }
  SECTION("links alone, values in JSON and text") {
    const auto json = [](const std::string& body, const std::string& fields) {
      return answer(200, body, "Content-Type: application/json\r\n" + fields);
    };
    Site site({{"/", json("[\"arm\"]", "Link: </arm>; rel=\"related\"\r\n")},
               {"HEAD /", answer(200, "", "Link: </arm>; rel=\"related\"\r\n")},
               {"/arm", json("{\"name\": \"arm\"}", "")},
               {"HEAD /arm", answer(200, "", "Link: </arm/angle>; rel=\"related\", </arm/mode>; rel=related, </arm/stop>; rel=related\r\n")},
               {"/arm/angle", json("1.5", "ETag: \"1\"\r\nAllow: GET, PUT\r\n")},
               {"PUT /arm/angle", answer(204)},
               {"/arm/mode", answer(200, "idle\n", "Content-Type: text/plain\r\nAllow: GET, PUT\r\n")},
               {"/arm/stop", json("{}", "")},
               {"HEAD /arm/stop", answer(200, "", "Allow: GET, HEAD, POST\r\n")}});
    const client::Robot robot = client.open(site.url()).value();
    REQUIRE(robot.things().size() == 1);
    CHECK(robot.things()[0].url() == site.url("/arm"));
    const client::Property angle = robot.property("angle").value();
    CHECK(angle.read<double>().value() == 1.5);
    CHECK(robot.property("mode").value().read<std::string>().value() == "idle");
    CHECK(robot.action("stop").has_value());
    CHECK(angle.write(2.5).has_value());
    const std::string put = site.requests("/arm/angle").back();
    CHECK(field_of(put, "Content-Type") == "application/json");
    CHECK(field_of(put, "If-Match") == "\"1\"");
    CHECK(put.substr(put.size() - 3) == "2.5");
  }
}

TEST_CASE("a command ends with what is known if the server states no status", "[client][R0.7][R0.8]") {
  Site site({{"/", turtle("<> a hybrit:RoboticThing ; hybrit:action <open>, <close>, <turn>, <spin> .")},
             {"/open", turtle("<> a hybrit:Action .")},
             {"/close", turtle("<> a hybrit:Action .")},
             {"/turn", turtle("<> a hybrit:Action .")},
             {"/spin", turtle("<> a hybrit:Action .")},
             {"POST /open", answer(204, {}, "Location: /open/1\r\n")},
             {"/open/1", turtle("<> ex:made true .")},
             {"POST /close", answer(204, {}, "Location: /close/1\r\n")},
             {"POST /turn", answer(202, {}, "Location: /turn/1\r\n")},
             {"/turn/1", turtle("<> ex:made true .")},
             {"POST /spin", answer(201, {}, "Location: /spin/1\r\n")},
             {"/spin/1", answer(200, "spinning", "Content-Type: text/html\r\n")}});
  Client client = Client::create(quick()).value();
  const client::Robot robot = client.open(site.url()).value();
  using Status = client::Invocation::Status;
  for (const auto& [name, status] :
       {std::make_pair("open", Status::succeeded), {"close", Status::succeeded}, {"turn", Status::unknown}, {"spin", Status::succeeded}}) {
    INFO(name);
    const client::Invocation invocation = robot.action(name).value().invoke().value();
    CHECK_FALSE(invocation.url().empty());
    CHECK(invocation.wait(milliseconds(60'000)).value().status == status);
    CHECK(invocation.state().value().status == status);
  }
}

TEST_CASE("a value in a stored document is changed, and the rest of it stays", "[client][R0.5]") {
  Client client = Client::create(quick()).value();
  const std::string allow = "Allow: GET, PUT, PATCH\r\n", tag = allow + "ETag: \"7\"\r\n";
  const std::string document = "<> ex:maker \"Ada\" ; ex:limits [ ex:low 1 ; ex:high 9 ] ; <http://qudt.org/schema/qudt/numericValue> 5 .";
  const auto graph_in = [](const std::string& request, const std::string& url) {
    rdf::ReadOptions options;
    options.base = url;
    return rdf::read(request.substr(request.find("\r\n\r\n") + 4), rdf::Syntax::turtle, options).value();
  };
  SECTION("by its own predicate and datatype, with If-Match, and again if somebody else was faster") {
    Site site({{"/", turtle("<> a hybrit:RoboticThing ; hybrit:property <v> .")}, {"/v", turtle(document, tag)}, {"PUT /v", answer(412)}});
    const client::Property v = client.open(site.url()).value().property("v").value();
    CHECK(message_of(v.write(6.0)).find("412") != std::string::npos);
    std::vector<std::string> puts;
    for (const std::string& request : site.requests("/v"))
      if (request.compare(0, 4, "PUT ") == 0) puts.push_back(request);
    CHECK(puts.size() == 3);
    CHECK(field_of(puts.back(), "If-Match") == "\"7\"");
    site.set("PUT /v", answer(204));
    REQUIRE(v.write(6.0).has_value());
    const std::string put = site.requests("/v").back();
    rdf::ReadOptions options;
    const std::string url = site.url("/v");
    options.base = url;
    const std::string wanted =
        "@prefix ex: <http://example.org/#> . <> ex:maker \"Ada\" ; ex:limits [ ex:low 1 ; ex:high 9 ] ; "
        "<http://qudt.org/schema/qudt/numericValue> 6 .";
    CHECK(rdf::isomorphic(graph_in(put, url), rdf::read(wanted, rdf::Syntax::turtle, options).value()));
    CHECK(v.write(6.0, {{}, "\"8\""}).has_value());
    CHECK(field_of(site.requests("/v").back(), "If-Match") == "\"8\"");
  }
  SECTION("without a strong entity tag nothing is sent") {
    for (const std::string& fields : {allow, allow + "ETag: W/\"7\"\r\n"}) {
      Site site({{"/", turtle("<> a hybrit:RoboticThing ; hybrit:property <v> .")}, {"/v", turtle(document, fields)}, {"PUT /v", answer(204)}});
      const client::Property v = client.open(site.url()).value().property("v").value();
      CHECK(message_of(v.write(6.0)).find("no strong entity tag") != std::string::npos);
      for (const std::string& request : site.requests()) CHECK(request.compare(0, 4, "PUT ") != 0);
      CHECK(v.write(6.0, {{}, "*"}).has_value());
    }
  }
  SECTION("the present value says what a number is") {
    Site site({{"/", turtle("<> a hybrit:RoboticThing ; hybrit:property <v>, <w> .")},
               {"/v", turtle("<> vom:numericalValue 5 ; vom:unit maths:Degree ; ex:maker \"Ada\" .", tag)},
               {"/w", turtle("<> ex:maker \"Ada\" .", tag)}});
    const client::Robot robot = client.open(site.url()).value();
    CHECK(robot.property("v").value().present_shape().value().has_value());
    CHECK_FALSE(robot.property("w").value().present_shape().value().has_value());
  }
}

TEST_CASE("what cannot be read is reported, and the rest is used", "[client][R1.6]") {
  Site site({{"/", turtle("<> ldp:contains <a>, <b>, <c>, <d>, <e> .")},
             {"/a", turtle("<> a hybrit:RoboticThing .")},
             {"/b", turtle("<> a hybrit:RoboticThing")},  // no full stop
             {"/c", answer(200, "<html></html>", "Content-Type: text/html\r\n")},
             {"/d", answer(500, "the motor is hot", "Content-Type: text/plain\r\n")}});
  Client client = Client::create(quick()).value();
  const client::Robot robot = client.open(site.url()).value();
  CHECK(robot.things().size() == 1);
  REQUIRE(robot.problems().size() == 4);
  CHECK(robot.problems()[0].find("/b") != std::string::npos);
  CHECK(robot.problems()[1].find("expected RDF, found \"text/html\"") != std::string::npos);
  CHECK(robot.problems()[2].find("500: the motor is hot") != std::string::npos);
  CHECK(robot.problems()[3].find("404") != std::string::npos);
}

TEST_CASE("the links of a server end at the limits", "[client]") {
  SECTION("a chain that goes on") {
    Site site({});
    for (int i = 0; i < 40; ++i) site.set("/" + std::to_string(i), turtle("<> a hybrit:RoboticThing ; ex:next <" + std::to_string(i + 1) + "> ."));
    client::Options options = quick();
    options.limits.max_depth = 10;
    Client client = Client::create(options).value();
    const client::Robot robot = client.open(site.url("/0")).value();
    CHECK(robot.things().size() == 11);
    CHECK(robot.problems().size() == 1);
    CHECK(site.requests().size() == 11);
  }
  SECTION("a page of a thousand links") {
    std::string body = "<> ldp:contains <x0>";
    for (int i = 1; i < 1'000; ++i) body += ", <x" + std::to_string(i) + ">";
    Site site({{"/", turtle(body + " .")}});
    client::Options options = quick();
    options.limits.max_resources = 100;
    Client client = Client::create(options).value();
    CHECK(client.open(site.url()).error().code == Errc::limit_exceeded);
    CHECK(site.requests().size() == 1);
  }
  SECTION("a circle") {
    Site site({{"/a", turtle("<> a hybrit:RoboticThing ; ex:next <b> .")}, {"/b", turtle("<> a hybrit:RoboticThing ; ex:next <a> .")}});
    Client client = Client::create(quick()).value();
    CHECK(client.open(site.url("/a")).value().things().size() == 2);
    CHECK(site.requests().size() == 2);
  }
}

TEST_CASE("redirects are followed within limits, and the identity stays at its origin", "[client]") {
  Site other({{"/", turtle("<> a hybrit:RoboticThing .")}});
  Site site({{"/", answer(307, {}, "Location: /robot\r\n")},
             {"/robot", turtle("<> a hybrit:RoboticThing .")},
             {"/loop", answer(302, {}, "Location: /loop\r\n")}});
  site.set("/away", answer(307, {}, "Location: " + other.url() + "\r\n"));
  client::Options options = quick();
  options.identity.token = "secret-token";
  options.identity.trusted_origins = {other.url()};
  Client client = Client::create(options).value();
  const client::Robot robot = client.open(site.url()).value();
  CHECK(robot.url() == site.url("/robot"));
  CHECK(site.requests().back().find("Authorization: Bearer secret-token") != std::string::npos);
  CHECK(client.open(site.url("/loop")).error().code == Errc::limit_exceeded);
  // Also where the other origin is trusted itself: one server cannot use the identity at another one.
  CHECK(client.get(site.url("/away")).has_value());
  REQUIRE(other.requests().size() == 1);
  CHECK(other.requests().front().find("secret-token") == std::string::npos);
}

TEST_CASE("redirects have the time of one exchange together", "[client]") {
  Site site({{"/loop", answer(302, {}, "Location: /loop\r\n")}});
  client::Options options = quick();
  options.limits.response_time = milliseconds(200);
  options.limits.max_redirects = 100'000;  // more than are possible in that time
  Client client = Client::create(options).value();
  CHECK(client.send({"GET", site.url("/loop"), {}, {}}).error().code == Errc::timed_out);
}

TEST_CASE("a binding to another server is not followed", "[client]") {
  Site victim({{"/", turtle("<> a hybrit:RoboticThing .")}});
  Site site({});
  site.set("/", turtle("<> a hybrit:RoboticThing ; hybrit:action <go> ; hybrit:property <v> ."));
  site.set("/go", turtle("<> a hybrit:Action ; hybrit:binding [ http:mthd m:DELETE ; http:requestURI <" + victim.url() + "> ] ."));
  site.set("/v",
           turtle("<> a hybrit:Property ; vom:numericalValue 1 ; hybrit:binding [ http:mthd m:PUT ; http:requestURI <" + victim.url() + "> ] ."));
  client::Options options = quick();
  options.identity.trusted_origins = {victim.url()};
  Client client = Client::create(options).value();
  const client::Robot robot = client.open(site.url()).value();
  CHECK(robot.action("go").value().invoke().error().code == Errc::refused);
  CHECK(robot.property("v").value().write(1.0).error().code == Errc::refused);
  CHECK(victim.requests().empty());
}

TEST_CASE("a binding says the method, the URL and the header fields of a command", "[client][R1.10]") {
  Site site({{"/", turtle("<> a hybrit:RoboticThing ; hybrit:action <go> .")},
             {"/go", turtle("<> a hybrit:Action ; hybrit:binding [ http:mthd m:PUT ; http:requestURI <run> ; http:headers ( "
                            "[ http:fieldName \"X-Mode\" ; http:fieldValue \"fast\" ] [ http:fieldName \"Host\" ; http:fieldValue \"evil\" ] "
                            "[ http:fieldName \"Content-Type\" ; http:fieldValue \"application/n-triples\" ] ) ] .")},
             {"PUT /run", answer(200, {})}});
  Client client = Client::create(quick()).value();
  CHECK(client.open(site.url()).value().action("go").value().invoke(1.5).has_value());
  const std::string sent = site.requests("/run").front();
  CHECK(sent.find("PUT /run ") == 0);
  CHECK(sent.find("X-Mode: fast\r\n") != std::string::npos);
  CHECK(sent.find("Content-Type: application/n-triples\r\n") != std::string::npos);
  CHECK(sent.find("evil") == std::string::npos);
}

TEST_CASE("the effect of an action is found by the present and by the former name of its predicate", "[client][R1.10]") {
  const std::string shape = "<go#out> a sh:NodeShape ; sh:property [ sh:path rdf:value ; sh:minCount 1 ] .";
  for (const std::string name : {"http://www.w3.org/ns/sosa/forProperty", "http://www.w3.org/ns/ssn/forProperty"}) {
    CAPTURE(name);
    Site site({{"/", turtle("<> a hybrit:RoboticThing ; hybrit:action <go> .")},
               {"/go", turtle("<> a hybrit:Action ; hybrit:produces <go#effect> , <go#out> . <go#effect> a sh:NodeShape ; <" + name + "> <speed> . " +
                              shape)}});
    Client client = Client::create(quick()).value();
    const client::Action go = client.open(site.url()).value().action("go").value();
    CHECK(go.effects().value() == std::vector<std::string>{site.url("/speed")});
    const std::optional<client::Shape> output = go.output_shape().value();
    REQUIRE(output);
    CHECK(output->node.view() == rdf::iri(site.url("/go#out")));
  }
}

TEST_CASE("responses that are too long, too slow or no HTTP are errors", "[client]") {
  struct Odd {
    const char* name;
    std::string response;
    Errc expected;
  };
  const Odd odd[] = {
      {"a body beyond the limit", answer(200, std::string(20'000, ' '), "Content-Type: text/turtle\r\n"), Errc::limit_exceeded},
      {"a header section beyond the limit", "HTTP/1.1 200 OK\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n", Errc::limit_exceeded},
      {"a status line without an end", "HTTP/1.1 200 " + std::string(200'000, 'x'), Errc::limit_exceeded},
      {"not HTTP", "SSH-2.0-OpenSSH\r\n\r\n", Errc::expected_http},
      {"two lengths", "HTTP/1.1 200 OK\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nxx", Errc::expected_http},
      {"more triples than the limit", turtle("ex:a ex:b 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 ."), Errc::limit_exceeded},
  };
  for (const Odd& one : odd) {
    INFO(one.name);
    Site site({{"/", one.response}});
    client::Options options = quick();
    options.limits.max_body_bytes = 10'000;
    options.limits.max_header_bytes = 10'000;
    options.limits.max_triples = 10;
    Client client = Client::create(options).value();
    const auto found = client.open(site.url());
    REQUIRE_FALSE(found);
    INFO(found.error().message);
    CHECK(found.error().code == one.expected);
  }
}

TEST_CASE("responses that are valid in an odd way are read", "[client]") {
  for (const OddResponse& odd : odd_responses()) {
    INFO(odd.name);
    Receiver server([&](Peer& peer) {
      while (!peer.read_request().empty()) {
        const std::size_t piece = odd.is_byte_by_byte ? 1 : odd.bytes.size();
        for (std::size_t at = 0; at < odd.bytes.size(); at += piece) peer.send(std::string_view(odd.bytes).substr(at, piece));
        if (odd.closes) return;
      }
    });
    Client client = Client::create(quick()).value();
    for (int i = 0; i < 2; ++i) {
      const Result<client::Response> response = client.send({"GET", server.url(), {}, {}});
      INFO(message_of(response));
      REQUIRE(response.has_value());
      CHECK(response->status == odd.status);
      CHECK(response->body == odd.body);
      CHECK(response->fields.find("Content-Encoding").value_or("identity") == "identity");
      CHECK_FALSE(response->fields.find("X-Sum").has_value());  // a trailer
    }
  }
}

TEST_CASE("responses that are wrong, or beyond a limit, have a message of their own", "[client][security]") {
  for (const BadResponse& bad : bad_responses()) {
    INFO(bad.name);
    Receiver server([&](Peer& peer) {
      if (!peer.read_request().empty()) peer.send(bad.bytes);
    });
    client::Options options = quick();
    options.limits.max_body_bytes = 64 * 1024;
    options.limits.max_header_bytes = 16 * 1024;
    Client client = Client::create(options).value();
    const Result<client::Response> response = client.send({"GET", server.url(), {}, {}});
    REQUIRE_FALSE(response.has_value());
    CAPTURE(response.error().message);
    CHECK(response.error().message.find(bad.says) != std::string::npos);
    CHECK(response.error().message.find(server.url()) != std::string::npos);
  }
}

TEST_CASE("a body in a coding counts as long as it is decoded", "[client][security]") {
  const auto coded = [](const std::string& text) {
    const std::string bytes = compress(text);
    return "HTTP/1.1 200 OK\r\nContent-Type: text/turtle\r\nContent-Encoding: gzip\r\nContent-Length: " + std::to_string(bytes.size()) + "\r\n\r\n" +
           bytes;
  };
  std::string numbers;
  for (int i = 0; i < 20'000; ++i) numbers += std::to_string(i) + '\n';
  Site site({{"/", coded("<> a <https://hybr-it-projekt.de/ns/hybr-it#RoboticThing> .")},
             {"/long", coded(numbers)},
             {"/bomb", coded(std::string(40'000'000, ' '))}});
  client::Options options = quick();
  options.limits.max_body_bytes = 100'000;
  Client client = Client::create(options).value();
  CHECK(client.open(site.url()).value().things().size() == 1);
  CHECK(site.requests().front().find("Accept-Encoding") == std::string::npos);  // a proxy would weaken the entity tags of what it codes
  CHECK(message_of(client.get(site.url("/long"))).find("decoded, is longer than 100000 bytes") != std::string::npos);
  options.limits.max_body_bytes = 100'000'000;
  Client patient = Client::create(options).value();
  CHECK(message_of(patient.get(site.url("/bomb"))).find("decoded, is more than 200 times as long") != std::string::npos);
}

TEST_CASE("a command is redirected within its origin only", "[client][security]") {
  Site other({{"/go", answer(204)}});
  Site site({{"/away", answer(307, {}, "Location: " + other.url("/go") + "\r\n")},
             {"/here", answer(308, {}, "Location: /go\r\n")},
             {"/see", answer(303, {}, "Location: " + other.url("/go") + "\r\n")},
             {"/go", answer(204)}});
  Client client = Client::create(quick()).value();
  for (const char* const method : {"POST", "PUT", "PATCH", "DELETE"}) {
    const Result<client::Response> away = client.send({method, site.url("/away"), {{"Content-Type", "text/plain"}}, "1"});
    REQUIRE_FALSE(away.has_value());
    CHECK(away.error().code == Errc::refused);
    CHECK(away.error().message.find(std::string("redirects the ") + method + " to \"" + other.url("/go")) != std::string::npos);
    CHECK(client.send({method, site.url("/here"), {{"Content-Type", "text/plain"}}, "1"}).value().status == 204);
    CHECK(site.requests("/go").back().find(std::string(method) + " /go ") == 0);
    CHECK(other.requests().empty());
  }
  CHECK(client.send({"GET", site.url("/away"), {{"Authorization", "Bearer x"}}, {}}).value().status == 204);
  CHECK(client.send({"POST", site.url("/see"), {{"Authorization", "Bearer x"}, {"Content-Type", "text/plain"}}, "1"}).value().status == 204);
  for (const std::string& request : other.requests()) {
    CHECK(request.find("GET /go ") == 0);
    CHECK(request.find("Bearer") == std::string::npos);
  }
}

TEST_CASE("fields without a valid name are left out", "[client]") {
  Site site({{"/", turtle("<> a hybrit:RoboticThing .", "Bad Name: x\r\n: y\r\nGood: z\r\n")}});
  Client client = Client::create(quick()).value();
  const client::Response response = client.send({"GET", site.url(), {}, {}}).value();
  CHECK(response.status == 200);
  CHECK(response.fields.find("Good") == "z");
  CHECK(client.open(site.url()).has_value());
}

TEST_CASE("a server that sends byte by byte gets no more time than one exchange has", "[client]") {
  Receiver slow([](Peer& peer) {
    peer.read_request();
    peer.drip("HTTP/1.1 200 OK\r\nX: ");
  });
  client::Options options;
  options.limits.response_time = milliseconds(200);
  Client client = Client::create(options).value();
  CHECK(client.open(slow.url("127.0.0.1", "/")).error().code == Errc::timed_out);
}

TEST_CASE("a 304 with the length of what it leaves out ends with its header section", "[client][R0.11]") {
  Site site({{"/", turtle("<> a hybrit:RoboticThing .", "ETag: \"1\"\r\n")}});
  Client client = Client::create(quick()).value();
  const client::RepresentationPtr first = client.get(site.url()).value();
  site.set("/", "HTTP/1.1 304 Not Modified\r\nETag: \"1\"\r\nContent-Length: 500\r\n\r\n");
  CHECK(client.get(site.url()).value() == first);
  site.set("/", "HTTP/1.1 304 Not Modified\r\nETag: \"1\"\r\n\r\n");
  CHECK(client.get(site.url()).value() == first);
}

TEST_CASE("a name that does not resolve, and a resolver that hangs, are errors", "[client]") {
  client::Options options = quick();
  options.limits.resolve_time = milliseconds(2'000);
  Client client = Client::create(options).value();
  const auto found = client.open("http://no-such-robot.invalid/");
  REQUIRE_FALSE(found);
  CHECK((found.error().code == Errc::io_error || found.error().code == Errc::timed_out));
}

TEST_CASE("nodes inside a value may have IRIs, and a Blueprint of the Thing alone comes first", "[client][R1.6][R1.11]") {
  const auto number = [](const std::string& shape, const std::string& more) {
    return shape + " a sh:NodeShape ; sh:class maths:Scalar ; sh:property " + shape.substr(0, shape.size() - 1) + ".1> . " +
           shape.substr(0, shape.size() - 1) + ".1> sh:path vom:numericalValue ; sh:datatype <http://www.w3.org/2001/XMLSchema#double> " + more +
           " .\n";
  };
  const std::string links = "Link: </kinds/Joint-1a2b3c4d>; rel=\"describedby\"\r\nLink: </arm/blueprint>; rel=\"describedby\"\r\n";
  Site site(
      {{"/arm",
        turtle("<> a hybrit:RoboticThing, ros:Joint, </kinds/Joint-1a2b3c4d>, <arm/blueprint#3f2a9c1e> ; hybrit:blueprint </kinds/Joint-1a2b3c4d>, "
               "<arm/blueprint> ; hybrit:property <arm/angle>, <arm/path>, <#mass> ; ros:angle <arm/angle> ; hybrit:action <arm/turn> . "
               "<arm/angle> a hybrit:Property . <#mass> vom:numericalValue 7 .")},
       {"/arm/angle", turtle("<> a hybrit:Property ; vom:numericalValue 1 .", links)},
       // The document has no triple of its own; the value is the only node that is no object of another one.
       {"/arm/path", turtle("<#it> a hybrit:Property ; ros:points <#it.0> . <#it.0> rdf:first <#it.0.x> ; rdf:rest <#it.1> . <#it.1> rdf:first 2 ; "
                            "rdf:rest rdf:nil . <#it.0.x> vom:numericalValue 1 .")},
       {"/arm/turn", turtle("<> a hybrit:Action ; hybrit:consumes <#in> ; hybrit:binding <#post> . <#post> http:mthd m:POST ; http:body <#body> . "
                            "<#body> a ros:Command ; dcterms:conformsTo <#in> . " +
                            number("<#in>", "; sh:maxInclusive 5e0"))},
       {"POST /arm/turn", answer(204)},
       {"/kinds/Joint-1a2b3c4d", turtle("<> a sh:NodeShape ; sh:property <#_1> . <#_1> sh:path ros:angle ; sh:node <#about>, <#angle> . <#about> "
                                        "sh:property <#about.1> . <#about.1> sh:path dcterms:modified . " +
                                        number("<#angle>", ""))},
       {"/arm/blueprint", turtle("<#3f2a9c1e> a sh:NodeShape ; sh:property <#_1> . <#_1> sh:path ros:angle ; sh:node <#3f2a9c1e/angle> . " +
                                 number("<#3f2a9c1e/angle>", "; sh:maxInclusive 90e0"))}});
  Client client = Client::create(quick()).value();
  const client::Robot robot = client.open(site.url("/arm")).value();
  const client::Thing arm = robot.thing("arm").value();
  CHECK(arm.properties().size() == 3);
  CHECK(arm.property("mass").value().read<double>().value() == 7);
  const client::RepresentationPtr path = arm.property("path").value().get().value();
  REQUIRE(path->focus);
  CHECK(path->graph.term(*path->focus).text == site.url("/arm/path#it"));
  const std::optional<client::Shape> shape = arm.property("angle").value().value_shape().value();
  REQUIRE(shape);
  CHECK(shape->node.view().text == site.url("/arm/blueprint#3f2a9c1e/angle"));
  // Things with equal bounds may share a Blueprint, which refers to that of the kind. A value may be absent.
  const std::string bounds = "Link: </kinds/Joint-1a2b3c4d>; rel=\"describedby\"\r\nLink: </kinds/Joint-1a2b3c4d-5e6f7a8b>; rel=\"describedby\"\r\n";
  site.set("/arm/angle", turtle("<> a hybrit:Property ; vom:numericalValue 2 .", bounds));
  site.set("/kinds/Joint-1a2b3c4d-5e6f7a8b",
           turtle("<> a sh:NodeShape ; sh:node </kinds/Joint-1a2b3c4d> ; sh:property <#_1> . <#_1> sh:path ros:angle ; sh:or ( <#_2> <#angle> ) . "
                  "<#_2> sh:property [ sh:path vom:numericalValue ; sh:maxCount 0 ] . " +
                  number("<#angle>", "; sh:maxInclusive 80e0")));
  REQUIRE(arm.property("angle").value().get());  // reads the new links
  const std::optional<client::Shape> shared = arm.property("angle").value().value_shape().value();
  REQUIRE(shared);
  CHECK(shared->node.view().text == site.url("/kinds/Joint-1a2b3c4d-5e6f7a8b#angle"));
  // The class of a body is that of its shape, and that of the binding's body. A body has the classes that the shape requires.
  const client::Action turn = arm.action("turn").value();
  CHECK(turn.consumed_classes().value() == std::vector<std::string>{std::string(vocab::maths::Scalar.text), "http://ros.org/#Command"});
  CHECK(robot.actions({vocab::maths::Scalar, {}, {}, {}}).value().size() == 1);
  CHECK(turn.invoke(2.5).has_value());
  CHECK(site.requests("/arm/turn").back().find("Scalar") != std::string::npos);
}
