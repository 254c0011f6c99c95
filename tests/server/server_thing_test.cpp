// SPDX-License-Identifier: Apache-2.0
#include <lrt/server_thing.hpp>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/base/metric.hpp>
#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>
#include <lrt/version.hpp>

#include "src/server/counters.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace std::chrono_literals;

namespace {

/// A robot whose server is one of its Things.
struct Counted {
  explicit Counted(const std::string& transport = "") {
    Options options;
    options.listen.port = 0;
    options.listen.transport = transport::no_network;
    if (!transport.empty())
      options.listen.transport = [transport](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
    options.threads.dispatch = Dispatch::io_thread;
    options.clock = &clock;
    options.callbacks.allow = {"127.0.0.1"};
    server.emplace(Server::create(std::move(options)).value());
    server->add(robot.arm()).value();
    server->add(server_thing(*server)).value();
  }
  http::Response ask(const std::string& text, const std::string& fields = "") {
    const std::size_t body = text.find("\n\n");
    RequestText request(text.substr(0, body) + "\nHost: localhost:4711\n" + fields + (body == std::string::npos ? "" : text.substr(body)));
    request.get().local_port = 4711;
    return server->serve(request.get()).response;
  }
  std::string value(const std::string& path) { return std::string(ask("GET /server/" + path, "Accept: application/json").content()); }

  FakeClock clock;
  SampleRobot robot;
  std::optional<Server> server;
};

/// A strict reader of the text format 0.0.4: each family has one HELP and one TYPE before its samples, which stand together; names, labels and
/// numbers follow the grammar; histograms are cumulative, and their last bucket is their count.
std::map<std::string, double> read_exposition(const std::string& text) {
  const auto fail = [](const std::string& what) { throw std::runtime_error(what); };
  const auto is_name = [](const std::string& name) {
    const auto good = [](char c, bool first) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == ':' || (!first && c >= '0' && c <= '9');
    };
    for (std::size_t i = 0; i < name.size(); ++i)
      if (!good(name[i], i == 0)) return false;
    return !name.empty();
  };
  if (text.empty() || text.back() != '\n') fail("the last line does not end");
  std::map<std::string, double> samples;
  std::set<std::string> families;
  std::string family, type, help;
  double last_bucket = 0;
  bool has_infinity = false;
  for (std::size_t at = 0; at < text.size();) {
    const std::string line = text.substr(at, text.find('\n', at) - at);
    at += line.size() + 1;
    if (line.empty()) fail("an empty line");
    if (line.compare(0, 7, "# HELP ") == 0) {
      help = line.substr(7, line.find(' ', 7) - 7);
      if (!is_name(help) || !families.insert(help).second) fail("HELP: " + line);
      if (line.size() <= 8 + help.size()) fail("no help: " + line);
      continue;
    }
    if (line.compare(0, 7, "# TYPE ") == 0) {
      const std::size_t space = line.find(' ', 7);
      family = line.substr(7, space - 7);
      type = line.substr(space + 1);
      if (family != help) fail("TYPE does not follow its HELP: " + line);
      if (type != "counter" && type != "gauge" && type != "histogram") fail("TYPE: " + line);
      if (type == "counter" && (family.size() < 6 || family.substr(family.size() - 6) != "_total")) fail("a counter without _total: " + line);
      last_bucket = 0;
      has_infinity = false;
      continue;
    }
    const std::size_t space = line.rfind(' ');
    const std::string series = line.substr(0, space), number = line.substr(space + 1);
    const std::string name = series.substr(0, series.find('{'));
    const std::string rest = name.substr(std::min(family.size(), name.size()));
    if (name.compare(0, family.size(), family) != 0) fail("outside of its family: " + line);
    if (type == "histogram" ? rest != "_bucket" && rest != "_sum" && rest != "_count" : !rest.empty()) fail("suffix: " + line);
    std::string label_value;  // of the last label
    for (std::size_t i = name.size(); i < series.size();) {
      const std::size_t equals = series.find("=\"", i);
      if (series[i] != (i == name.size() ? '{' : ',') || equals == std::string::npos || !is_name(series.substr(i + 1, equals - i - 1)))
        fail("label: " + line);
      label_value.clear();
      for (i = equals + 2; i < series.size() && series[i] != '"'; ++i) {
        if (series[i] == '\\' && ++i < series.size() && series[i] != '"' && series[i] != '\\' && series[i] != 'n') fail("escape: " + line);
        if (i < series.size()) label_value += series[i];
      }
      if (++i >= series.size()) fail("label: " + line);
      if (i + 1 == series.size()) {
        if (series[i] != '}') fail("label: " + line);
        break;
      }
    }
    double value = 0;
    if (number == "+Inf") {
      if (!samples.emplace(series, std::numeric_limits<double>::infinity()).second) fail("twice: " + line);
      continue;
    }
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error != std::errc() || end != number.data() + number.size()) fail("number: " + line);
    if (rest == "_bucket") {
      if (value < last_bucket) fail("not cumulative: " + line);
      last_bucket = value;
      has_infinity = label_value == "+Inf";
    }
    if (rest == "_count" && (!has_infinity || value != last_bucket)) fail("count: " + line);
    if (!samples.emplace(series, value).second) fail("twice: " + line);
  }
  return samples;
}

}  // namespace

TEST_CASE("a server is a Thing that says what it has done", "[server][security]") {
  Counted g;
  CHECK(g.ask("GET /arm").status == 200);
  CHECK(g.ask("GET /nothing").status == 404);
  CHECK(g.ask("PUT /arm/angle\nContent-Type: application/json\n\n5").status == 204);
  CHECK(g.ask("GET http://evil.example/arm").status == 421);
  CHECK(g.ask("GET /arm/angle", "Upgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/").status == 201);
  CHECK(g.ask("GET /arm/angle", "Upgrade: callback\nConnection: Upgrade\nCallback: http://other.example/").status == 403);
  CHECK(g.value("requests") == "7");  // with this one
  CHECK(g.value("responses/4xx") == "3");
  CHECK(g.value("refusals/receiver") == "1");
  CHECK(g.value("refusals/host") == "1");
  CHECK(g.value("subscribers/callback") == "1");
  CHECK(g.value("subscribers/websocket") == "0");
  const Answer thing(g.ask("GET /server", "Accept: text/turtle"));
  CHECK(thing.status == 200);
  const Answer property(g.ask("GET /server/poll/maximum", "Accept: text/turtle"));
  CHECK(property.says("unit:SEC"));
  CHECK(property.says("How long the longest call of poll took."));
  CHECK(Answer(g.ask("GET /server/state", "Accept: text/turtle")).status == 200);
}

TEST_CASE("the counters are text for Prometheus", "[server][security]") {
  Counted g;
  CHECK(g.ask("GET /nothing").status == 404);
  for (const char* accept : {"", "Accept: */*", "Accept: text/plain", "Accept: text/plain;version=0.0.4;q=0.5,*/*;q=0.1",
                             "Accept: application/openmetrics-text;version=1.0.0;q=0.5,text/plain;version=0.0.4;q=0.3,*/*;q=0.2"}) {
    CAPTURE(accept);
    const Answer answer(g.ask("GET /server/metrics", accept));
    CHECK(answer.status == 200);
    const bool is_bare = accept == std::string_view("Accept: text/plain");
    CHECK(answer.field("Content-Type") == (is_bare ? "text/plain; charset=utf-8" : "text/plain;version=0.0.4;charset=utf-8"));
    const auto samples = read_exposition(answer.body);
    CHECK(samples.at("lrt_responses_total{class=\"4xx\"}") == 1);
    CHECK(samples.at("lrt_requests_total") >= 2);
    CHECK(samples.count("lrt_poll_seconds_bucket{le=\"+Inf\"}") == 1);
    CHECK(samples.at("lrt_refusals_total{reason=\"rate\"}") == 0);
  }
  CHECK(read_exposition(prometheus_text(g.server->counters())).at("lrt_requests_total") == 6);
  CHECK_THROWS(read_exposition("lrt_x 1\n"));
  CHECK_THROWS(read_exposition("# HELP lrt_x x\n# TYPE lrt_x counter\nlrt_x 1\n"));
}

TEST_CASE("the text says when the server began and what it was built of", "[server]") {
  Counted g;
  const auto samples = read_exposition(prometheus_text(g.server->counters()));
  const double begun = std::chrono::duration<double>(g.clock.utc().time_since_epoch()).count();
  CHECK(samples.at("lrt_start_time_seconds") == Approx(begun));
  g.clock.advance(5s);
  CHECK(read_exposition(prometheus_text(g.server->counters())).at("lrt_start_time_seconds") == samples.at("lrt_start_time_seconds"));
  const auto build = std::find_if(samples.begin(), samples.end(), [](const auto& s) { return s.first.compare(0, 14, "lrt_build_info") == 0; });
  REQUIRE(build != samples.end());
  CHECK(build->first.find("{version=\"" LRT_VERSION "\",compiler=\"") == 14);
  CHECK(build->second == 1);
}

TEST_CASE("other parts of a program show their metrics as long as they exist", "[server]") {
  Counted g;
  const auto text = [&] { return Answer(g.ask("GET /server/metrics")).body; };
  double sent = 3;
  const auto source = [&sent](const char* robot) {
    return [&sent, robot]() -> std::vector<Metric> {
      return {{"arm_sent_total", "Messages.", Metric::Kind::counter, sent, {{"robot", robot}}},
              {"arm_heat_celsius", "Heat.", Metric::Kind::gauge, 21.5, {{"robot", robot}}}};
    };
  };
  auto one = g.server->add_metrics(source("one"));
  {
    const auto two = g.server->add_metrics(source("two"));
    const auto samples = read_exposition(text());
    CHECK(samples.at("arm_sent_total{robot=\"one\"}") == 3);
    CHECK(samples.at("arm_sent_total{robot=\"two\"}") == 3);
    CHECK(samples.at("arm_heat_celsius{robot=\"two\"}") == 21.5);
    CHECK(samples.at("lrt_metrics_left_out") == 0);
  }
  sent = 4;
  const auto samples = read_exposition(text());
  CHECK(samples.at("arm_sent_total{robot=\"one\"}") == 4);
  CHECK(samples.count("arm_sent_total{robot=\"two\"}") == 0);
  g.server.reset();
  one.reset();  // it may outlive the server
}

TEST_CASE("what is not a metric is left out and counted, and the text stays well-formed", "[server][security]") {
  Counted g;
  using K = Metric::Kind;
  const std::vector<Metric> good = {
      {"a_total", "A\\b\nc.", K::counter, 1, {{"text", "\"\\\n{},="}, {"b", "\xC3\xA4"}}},
      {"a_total", "Another help.", K::counter, 2, {}},
      {"infinite", "No limit.", K::gauge, std::numeric_limits<double>::infinity(), {}},
  };
  const std::vector<Metric> bad = {
      {"", "No name.", K::gauge, 1, {}},
      {"1a", "A digit.", K::gauge, 1, {}},
      {"a b", "A space.", K::gauge, 1, {}},
      {"a\nlrt_requests_total 7", "A line.", K::gauge, 1, {}},
      {"lrt_requests_total", "The server's.", K::counter, 1, {{"robot", "one"}}},
      {"lrt_metrics_left_out", "The server's.", K::gauge, 1, {}},
      {"lrt_poll_seconds_count", "A part of a histogram.", K::gauge, 1, {}},
      {"b", "A gauge by its name.", K::counter, 1, {}},
      {"b_total", "A counter by its name.", K::gauge, 1, {}},
      {"c", "", K::gauge, 1, {}},
      {"c", "Not UTF-8: \xFF", K::gauge, 1, {}},
      {"c", "A label.", K::gauge, 1, {{"a-b", ""}}},
      {"c", "A label.", K::gauge, 1, {{"__name__", "x"}}},
      {"c", "Twice.", K::gauge, 1, {{"a", "1"}, {"a", "2"}}},
      {"c", "Not UTF-8.", K::gauge, 1, {{"a", "\xC3"}}},
      {"a_total", "There already, in another order.", K::counter, 1, {{"b", "\xC3\xA4"}, {"text", "\"\\\n{},="}}},
  };
  std::vector<Metric> all = good;
  all.insert(all.end(), bad.begin(), bad.end());
  const auto samples = read_exposition(prometheus_text(g.server->counters(), all));
  CHECK(samples.at("lrt_metrics_left_out") == static_cast<double>(bad.size()));
  CHECK(samples.at("a_total") == 2);
  CHECK(samples.at("a_total{b=\"\xC3\xA4\",text=\"\\\"\\\\\\n{},=\"}") == 1);
  CHECK(samples.at("infinite") == std::numeric_limits<double>::infinity());
  CHECK(samples.count("c") == 0);

  const auto throws = g.server->add_metrics([]() -> std::vector<Metric> { throw std::runtime_error("gone"); });
  CHECK(read_exposition(Answer(g.ask("GET /server/metrics")).body).at("lrt_metrics_left_out") == 1);
}

TEST_CASE("the end of a source waits for its call", "[server]") {
  Counted g;
  std::atomic<bool> is_called{false}, may_end{false}, has_ended{false};
  auto shown = g.server->add_metrics([&]() -> std::vector<Metric> {
    is_called = true;
    while (!may_end) std::this_thread::yield();
    has_ended = true;
    return {};
  });
  std::thread asks([&] { (void)g.ask("GET /server/metrics"); });
  while (!is_called) std::this_thread::yield();
  std::thread releases([&] { may_end = true; });
  shown.reset();
  CHECK(has_ended);
  asks.join();
  releases.join();
}

TEST_CASE("each request has one response in the counters, over each transport", "[server][security]") {
  for (const std::string_view transport : transport::names()) {
    CAPTURE(transport);
    Counted g{std::string(transport)};
    const std::string host = "\nHost: 127.0.0.1:" + std::to_string(g.server->port());
    Socket socket(g.server->port());
    CHECK(socket.ask("GET /arm" + host).status == 200);
    CHECK(socket.ask("GET /arm/speed" + host).status == 200);  // deferred
    CHECK(socket.ask("PUT /arm/angle" + host + "\nContent-Type: application/json\n\n5").status == 204);
    socket.send_header("PUT /arm/angle" + host + "\nContent-Type: application/json", 1, true);
    CHECK(socket.await().status == 100);
    socket.write("5");
    CHECK(socket.await().status == 204);
    Socket refused(g.server->port());
    refused.send_header("PUT /nothing" + host + "\nContent-Type: application/json", 1, true);
    CHECK(refused.await().status == 404);
    Socket watcher(g.server->port());
    const std::string handshake = "\nConnection: Upgrade\nUpgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    CHECK(watcher.ask("GET /arm/angle" + host + handshake).status == 101);
    const ServerCounters counters = g.server->counters();
    CHECK(counters.requests == 6);
    CHECK(counters.responses == std::array<std::uint64_t, 5>{1, 4, 0, 1, 0});
    CHECK(counters.websockets == 1);
    REQUIRE(counters.connections);
    CHECK(*counters.connections >= 1);
    CHECK(*counters.connections <= 3);
  }
}

TEST_CASE("calls of poll are counted by how long they took", "[server]") {
  Counted g;
  CHECK(g.server->counters().poll.sum == 0);
  for (int i = 0; i < 5; ++i) g.server->poll();
  const ServerCounters counters = g.server->counters();
  const auto sum = [](const TimeCounts& times) {
    std::uint64_t all = 0;
    for (const std::uint64_t count : times.counts) all += count;
    return all;
  };
  CHECK(sum(counters.poll) == 5);
  CHECK(sum(counters.poll_interval) == 4);
  CHECK(counters.poll.maximum >= counters.poll.newest);
  AtomicTimeCounts times;
  times.add(10us);  // a bound belongs to its own count
  times.add(3ms);
  times.add(1h);
  const TimeCounts read = times.read();
  CHECK(read.counts[0] == 1);
  CHECK(read.counts[7] == 1);
  CHECK(read.counts.back() == 1);
  CHECK(read.maximum == 3600);
  CHECK(read.sum == Approx(3600.00301));
}
