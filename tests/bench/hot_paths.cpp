// SPDX-License-Identifier: Apache-2.0
// One hot path of lrt at a time, as often as asked, for counting its instructions (instructions.py).
//
//   hot_paths [PATH COUNT]     without arguments: what built it, and the paths, each with a fitting count
//
// The clock is set by hand, nothing waits, and what should be random is not, so that the same build executes the same instructions in each run.

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <sys/random.h>

#include <lrt/engine/engine.hpp>
#include <lrt/options.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/shacl/validator.hpp>
#include <lrt/thing.hpp>

#include "src/server/callers.hpp"
#include "tests/support/fakes.hpp"

/// In place of libc's: the seeds of the hash tables are the same in each run.
extern "C" ssize_t getrandom(void* buffer, std::size_t count, unsigned /*flags*/) {
  std::memset(buffer, 0x5A, count);
  return static_cast<ssize_t>(count);
}

namespace {

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "hot_paths: %s\n", what.c_str());
  std::exit(1);
}

/// A joint in an engine, and requests to it.
struct Robot {
  lrt::test::FakeClock clock;
  lrt::PushedProperty<double> angle;
  lrt::engine::Engine engine;
  double value = 0.5;

  static lrt::engine::EngineOptions options(const lrt::Clock& clock, lrt::engine::Authentication authorize) {
    lrt::engine::EngineOptions options;
    options.clock = &clock;
    options.ids = std::make_shared<lrt::test::FixedIds>();
    options.subscriptions.max_subscriptions = 1000;
    options.authorize = std::move(authorize);
    return options;
  }
  explicit Robot(lrt::engine::Authentication authorize = {}) : engine(options(clock, std::move(authorize))) {
    lrt::Thing joint{"arm/joint"};
    angle = joint.property<double>("angle", lrt::unit::radian);
    angle.publish(value);
    joint
        .property(
            "target", [this] { return value; }, lrt::unit::radian)
        .on_write([this](double given) { value = given; })
        .dispatch(lrt::Dispatch::io_thread);
    joint.action("rotate", [](double) {}).dispatch(lrt::Dispatch::io_thread);
    engine.add(std::move(joint)).value();
    engine.listens_on("127.0.0.1", 8080, false, {}, {true, true});
  }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  void publish() { angle.publish(value += 0.001); }

  lrt::http::Response respond(const lrt::http::Request& request) {
    lrt::engine::Outcome outcome = engine.handle(request, clock.now());
    if (auto* response = std::get_if<lrt::http::Response>(&outcome)) return std::move(*response);
    while (true) {
      lrt::engine::Outputs outputs;
      engine.take_outputs(outputs);
      for (lrt::engine::Job& job : outputs.jobs) job.run();
      if (auto reply = engine.next_reply(clock.now())) return std::move(reply->response);
    }
  }
  void expect(const lrt::http::Request& request, int status) {
    const lrt::http::Response response = respond(request);
    if (response.status != status) fail(std::string(request.method) + ": " + std::to_string(response.status) + " " + std::string(response.content()));
  }
  void subscribe(lrt::http::Request request) {
    for (const auto& [name, text] : {std::pair{"Upgrade", "websocket"}, {"Connection", "Upgrade"}, {"Sec-WebSocket-Version", "13"}})
      request.fields.push_back({name, text});
    request.fields.push_back({"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="});
    request.can_upgrade = true;
    if (!std::holds_alternative<lrt::engine::Upgraded>(engine.handle(request, clock.now()))) fail("no WebSocket");
  }
  /// Sends what is ready as a transport does, and counts it.
  std::size_t push() {
    ready.clear();
    requests.clear();
    pushes.clear();
    engine.take_ready(ready, clock.now());
    for (const lrt::engine::ReadyChannel& channel : ready) requests.push_back({channel.channel, 64, 64 * 1024});
    engine.take_pushes(requests, pushes, clock.now());
    return pushes.size();
  }

 private:
  std::vector<lrt::engine::ReadyChannel> ready;
  std::vector<lrt::engine::PushRequest> requests;
  std::vector<lrt::engine::Push> pushes;
};

lrt::http::Request request(std::string_view method, std::string_view target, std::string_view body = {}, std::string_view type = {}) {
  lrt::http::Request request;
  request.method = method;
  request.target = target;
  request.body = body;
  request.peer = "127.0.0.1";
  request.fields = {{"Host", "127.0.0.1:8080"}, {"User-Agent", "hot_paths"}, {"Accept", "*/*"}};
  if (!type.empty()) request.fields.push_back({"Content-Type", type});
  return request;
}

constexpr std::string_view path = "/arm/joint/angle";

/// The callers of a robot with a hundred rules, one of which lets anna read the joint.
std::shared_ptr<lrt::Callers> callers(const lrt::Clock& clock) {
  using namespace lrt::security;
  lrt::Security security;
  security.tls.emplace().client_ca_file = "unused";
  security.certificates["CN=anna"] = {"anna", {"reader", "operator"}};
  security.rules = {{"/arm/joint", Scope::tree, {Who::Kind::role, "reader"}, Right::read}};
  for (int i = 1; i < 100; ++i)
    security.rules.push_back({"/robot" + std::to_string(i) + "/arm/joint", Scope::tree, {Who::Kind::role, "operator"}, Right::write});
  return lrt::Callers::create(security, nullptr, nullptr, clock).value();
}
constexpr std::string_view prefixes =
    "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n"
    "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .\n@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> "
    ".\n";
/// Figure 5b of the paper.
const std::string rotate_body =
    std::string(prefixes) + "<>\n  rdf:type maths:Scalar ;\n  vom:numericalValue \"43.6\"^^xsd:float ;\n  vom:unit maths:Degree .\n";
/// Figure 5a of the paper, what the body must be.
const std::string rotate_shape = std::string(prefixes) +
                                 "@prefix sh: <http://www.w3.org/ns/shacl#> .\n<#input> a sh:NodeShape ;\n"
                                 "  sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:float ; "
                                 "sh:minInclusive 0 ; sh:maxExclusive 360 ] ;\n"
                                 "  sh:property [ sh:path vom:unit ; sh:minCount 1 ; sh:maxCount 1 ; sh:hasValue maths:Degree ] .\n";

lrt::rdf::Graph read(const std::string& text, lrt::rdf::Syntax syntax = lrt::rdf::Syntax::turtle) {
  lrt::rdf::ReadOptions options;
  options.base = "http://example.org/baxter/right_s1/actions/rotate";
  options.max_triples = 1'000'000;
  auto graph = lrt::rdf::read(text, syntax, options);
  if (!graph) fail(graph.error().message);
  return *std::move(graph);
}

void with_subscribers(std::size_t subscribers, std::size_t count, std::string_view target) {
  Robot robot;
  for (std::size_t i = 0; i < subscribers; ++i) robot.subscribe(request("GET", target));
  std::size_t pushed = robot.push();
  for (std::size_t i = 0; i < count; ++i) {
    robot.publish();
    robot.clock.advance(std::chrono::milliseconds(1));
    pushed += robot.push();
  }
  if (pushed != subscribers * (count + 1)) fail(std::to_string(pushed) + " messages");
}

struct Path {
  const char* name;
  std::size_t count;  ///< what instructions.py begins with; it counts the difference to three times as many
  std::function<void(std::size_t count)> run;
};

const std::vector<Path>& paths() {
  static const std::vector<Path> all{
      {"publish", 200,
       [](std::size_t count) {
         Robot robot;
         for (std::size_t i = 0; i < count; ++i) robot.publish();
       }},
      {"get", 200,
       [](std::size_t count) {
         Robot robot;
         for (std::size_t i = 0; i < count; ++i) robot.expect(request("GET", path), 200);
       }},
      {"get_published", 200,
       [](std::size_t count) {
         Robot robot;
         for (std::size_t i = 0; i < count; ++i) robot.publish(), robot.expect(request("GET", path), 200);
       }},
      {"get_not_modified", 200,
       [](std::size_t count) {
         Robot robot;
         const lrt::http::Response first = robot.respond(request("GET", path));
         lrt::http::Request again = request("GET", path);
         again.fields.push_back({"If-None-Match", first.fields.find("ETag").value()});
         for (std::size_t i = 0; i < count; ++i) robot.expect(again, 304);
       }},
      {"get_with_rules", 200,
       [](std::size_t count) {
         const lrt::test::FakeClock clock;
         const std::shared_ptr<lrt::Callers> known = callers(clock);
         Robot robot([&](const lrt::http::Request& request) { return known->of(request); });
         lrt::http::Request of_anna = request("GET", path);
         of_anna.client_certificate = "CN=anna";
         for (std::size_t i = 0; i < count; ++i) robot.expect(of_anna, 200);
         robot.expect(request("GET", path), 401);
       }},
      {"decision_with_rules", 200,
       [](std::size_t count) {
         const lrt::test::FakeClock clock;
         const std::shared_ptr<lrt::Callers> known = callers(clock);
         lrt::http::Request of_anna = request("GET", path);
         of_anna.client_certificate = "CN=anna";
         for (std::size_t i = 0; i < count; ++i) {
           const auto view = known->of(of_anna).view;
           if (!view->at(path).has(lrt::security::Right::read) || !view->at("/robot7/arm/joint/x").has(lrt::security::Right::write)) fail("no right");
         }
       }},
      {"put_json", 200,
       [](std::size_t count) {
         Robot robot;
         for (std::size_t i = 0; i < count; ++i) robot.expect(request("PUT", "/arm/joint/target", "0.25", "application/json"), 204);
       }},
      {"put_turtle", 200,
       [](std::size_t count) {
         Robot robot;
         const std::string body = std::string(prefixes) + "<> vom:numericalValue 0.25 ; vom:unit maths:Radian .";
         for (std::size_t i = 0; i < count; ++i) robot.expect(request("PUT", "/arm/joint/target", body, "text/turtle"), 204);
       }},
      {"put_figure_5b", 200,
       [](std::size_t count) {
         Robot robot;
         lrt::Thing wrist{"wrist"};
         float angle = 0;
         wrist
             .property(
                 "angle", [&] { return angle; }, lrt::unit::degree)
             .on_write([&](float given) { angle = given; })
             .dispatch(lrt::Dispatch::io_thread);
         robot.engine.add(std::move(wrist)).value();
         for (std::size_t i = 0; i < count; ++i) robot.expect(request("PUT", "/wrist/angle", rotate_body, "text/turtle"), 204);
       }},
      {"post_action", 200,
       [](std::size_t count) {
         Robot robot;
         for (std::size_t i = 0; i < count; ++i) robot.expect(request("POST", "/arm/joint/actions/rotate", "0.25", "application/json"), 204);
       }},
      {"push_to_1", 200, [](std::size_t count) { with_subscribers(1, count, path); }},
      {"push_to_50", 200, [](std::size_t count) { with_subscribers(50, count, path); }},
      {"read_figure_5b", 200,
       [](std::size_t count) {
         for (std::size_t i = 0; i < count; ++i) (void)read(rotate_body);
       }},
      {"judge_figure_5b", 200,
       [](std::size_t count) {
         const lrt::shacl::Shapes shapes = lrt::shacl::Shapes::compile(read(rotate_shape)).value();
         const std::string target = "http://example.org/baxter/right_s1/actions/rotate", shape = target + "#input";
         for (std::size_t i = 0; i < count; ++i)
           if (!lrt::shacl::validate(shapes, read(rotate_body), lrt::rdf::iri(target), lrt::rdf::iri(shape))->conforms())
             fail("Figure 5b does not conform");
       }},
      {"read_turtle_1000_triples", 2,
       [](std::size_t count) {
         std::string text(prefixes);
         for (std::size_t i = 0; i < 1000; ++i)
           text += "<joint/" + std::to_string(i) + "> vom:numericalValue \"" + std::to_string(i) + ".5\"^^xsd:float .\n";
         for (std::size_t i = 0; i < count; ++i) (void)read(text);
       }},
      {"read_n_triples_1000_triples", 2,
       [](std::size_t count) {
         std::string text;
         for (std::size_t i = 0; i < 1000; ++i)
           text += "<http://example.org/joint/" + std::to_string(i) + "> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> \"" +
                   std::to_string(i) + ".5\"^^<http://www.w3.org/2001/XMLSchema#float> .\n";
         for (std::size_t i = 0; i < count; ++i) (void)read(text, lrt::rdf::Syntax::n_triples);
       }},
      {"add_thing", 200,
       [](std::size_t count) {
         const lrt::test::FakeClock clock;
         lrt::engine::Engine engine(Robot::options(clock, {}));
         for (std::size_t i = 0; i < count; ++i) {
           lrt::Thing thing{"thing" + std::to_string(i)};
           for (const char* name : {"a", "b", "c"}) thing.property<double>(name).publish(0.5);
           engine.add(std::move(thing)).value();
         }
       }},
  };
  return all;
}

/// On what a count depends besides the source.
std::string build() {
#if defined(__clang__)
  std::string text = "clang++ " + std::to_string(__clang_major__);
#elif defined(__GNUC__)
  std::string text = "g++ " + std::to_string(__GNUC__);
#else
  std::string text = "another compiler";
#endif
#if defined(__GLIBC__)
  text += ", glibc " + std::to_string(__GLIBC__) + "." + std::to_string(__GLIBC_MINOR__);
#endif
#if defined(__x86_64__)
  text += ", x86-64";
#else
  text += ", not x86-64";
#endif
#if !defined(__OPTIMIZE__)
  text += ", not optimised";
#endif
#if !defined(NDEBUG)
  text += ", with assertions";
#endif
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 1) std::printf("# %s\n", build().c_str());
  for (const Path& p : paths()) {
    if (argc == 1) std::printf("%s %zu\n", p.name, p.count);
    else if (argc == 3 && std::string_view(argv[1]) == p.name) return p.run(std::strtoull(argv[2], nullptr, 10)), 0;
  }
  if (argc != 1) return std::fprintf(stderr, "usage: hot_paths [PATH COUNT]\n"), 2;
}
