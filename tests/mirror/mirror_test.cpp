// SPDX-License-Identifier: Apache-2.0
#include <lrt/mirror.hpp>

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/mirror/comparison.hpp"
#include "src/mirror/state.hpp"
#include "src/exchange/http_authentication.hpp"
#include "tests/client/robot_host.hpp"
#include "tests/delivery/compress.hpp"
#include "tests/delivery/receiver.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fields.hpp"

using namespace lrt;
using namespace lrt::test;
using mirror::Mirror;
using mirror::MirrorCounts;
using mirror::MirrorEvent;
using mirror::MirrorOptions;
using mirror::MirrorStart;
using mirror::MirrorState;
using mirror::StoredGraph;
using std::chrono::milliseconds;

namespace {

std::string decoded(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size()) result += static_cast<char>(std::stoi(text.substr(i + 1, 2), nullptr, 16)), i += 2;
    else result += text[i];
  }
  return result;
}

/// A graph store that does what a test says.
class Store {
 public:
  struct Asked {
    std::string method, graph, body, authorization, if_match, if_none_match, target;
  };
  /// The response to a request; empty: the store takes it.
  using Script = std::function<std::string(const Asked&)>;

  explicit Store(Script script = {}) : script_(std::move(script)), receiver_([this](Peer& peer) { serve(peer); }) {}

  std::string url(const std::string& target = "/store") const { return receiver_.url("127.0.0.1", target); }
  void give_tags() { gives_tags_ = true; }
  /// A GET has entity tags of its own, as of another media type.
  void give_other_tags_to_reads() { gives_tags_ = has_read_tags_ = true; }
  /// What the store gives back of a graph; empty: as it got it.
  void give_back(std::function<std::string(const std::string&)> form) { form_ = std::move(form); }
  std::map<std::string, std::string> graphs() const {
    const std::lock_guard lock(mutex_);
    return graphs_;
  }
  std::vector<Asked> asked() const {
    const std::lock_guard lock(mutex_);
    return asked_;
  }
  void forget_requests() {
    const std::lock_guard lock(mutex_);
    asked_.clear();
  }
  void set(const std::string& graph, const std::string& body) {
    const std::lock_guard lock(mutex_);
    graphs_[graph] = body;
    ++versions_[graph];
  }
  /// As set(), but the entity tag stays.
  void set_secretly(const std::string& graph, const std::string& body) {
    const std::lock_guard lock(mutex_);
    graphs_[graph] = body;
  }
  void remove(const std::string& graph) {
    const std::lock_guard lock(mutex_);
    graphs_.erase(graph);
  }
  /// Everything, with its entity tags: for a copy that is restored later. Tags that were given meanwhile are not given again.
  void restore(const std::map<std::string, std::string>& graphs) {
    const std::lock_guard lock(mutex_);
    for (auto& [name, version] : versions_) version += 1;
    graphs_ = graphs;
  }
  std::size_t count(const std::string& method) const {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(std::count_if(asked_.begin(), asked_.end(), [&](const Asked& asked) { return asked.method == method; }));
  }
  std::size_t max_at_once() const { return max_at_once_; }
  /// Waits until a graph has a text, or does not exist (empty).
  void wait(const std::string& graph, const std::string& text) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] {
      const auto found = graphs_.find(graph);
      return text.empty() ? found == graphs_.end() : found != graphs_.end() && found->second.find(text) != std::string::npos;
    });
  }
  void wait_until(const std::function<bool(const std::map<std::string, std::string>&)>& condition) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return condition(graphs_); });
  }

 private:
  void serve(Peer& peer) {
    while (true) {
      const std::string request = peer.read_request();
      if (request.empty()) return;
      const std::size_t now = ++at_once_;
      for (std::size_t most = max_at_once_; most < now && !max_at_once_.compare_exchange_weak(most, now);) {}
      Asked asked;
      asked.method = request.substr(0, request.find(' '));
      const std::size_t begin = request.find(' ') + 1;
      asked.target = request.substr(begin, request.find(' ', begin) - begin);
      if (const std::size_t at = asked.target.find("graph="); at != std::string::npos) asked.graph = decoded(asked.target.substr(at + 6));
      else asked.graph = decoded(asked.target.substr(asked.target.rfind('/') + 1));
      asked.body = request.substr(request.find("\r\n\r\n") + 4);
      asked.authorization = field_of(request, "Authorization");
      asked.if_match = field_of(request, "If-Match");
      asked.if_none_match = field_of(request, "If-None-Match");
      std::string response = script_ ? script_(asked) : std::string();
      if (response.empty()) response = take(asked);
      {
        const std::lock_guard lock(mutex_);
        asked_.push_back(asked);
        changed_.notify_all();
      }
      --at_once_;
      if (!peer.send(response)) return;
    }
  }
  std::string take(const Asked& asked) {
    const std::lock_guard lock(mutex_);
    const auto tag = [&] { return "\"" + std::to_string(versions_[asked.graph]) + "\""; };
    if (asked.method == "GET") {
      const auto found = graphs_.find(asked.graph);
      if (found == graphs_.end()) return answer(404);
      const std::string read_tag = has_read_tags_ ? "\"read-" + tag().substr(1) : tag();
      if (gives_tags_ && asked.if_none_match == read_tag) return answer(304);
      return answer(200, form_ ? form_(found->second) : found->second,
                    "Content-Type: text/turtle\r\n" + (gives_tags_ ? "ETag: " + read_tag + "\r\n" : std::string()));
    }
    if (!asked.if_match.empty() && asked.if_match != tag()) return answer(412);
    if (asked.method == "DELETE") return answer(graphs_.erase(asked.graph) > 0 ? 204 : 404);
    const bool is_new = graphs_.count(asked.graph) == 0;
    graphs_[asked.graph] = asked.body;
    ++versions_[asked.graph];
    return answer(is_new ? 201 : 204, {}, gives_tags_ ? "ETag: " + tag() + "\r\n" : std::string());
  }

  Script script_;
  std::function<std::string(const std::string&)> form_;
  std::atomic<bool> gives_tags_{false}, has_read_tags_{false};
  std::atomic<std::size_t> at_once_{0}, max_at_once_{0};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::string> graphs_;
  std::map<std::string, int> versions_;
  std::vector<Asked> asked_;
  Receiver receiver_;
};

/// A resource with the text, of a robot that a test scripts.
std::vector<Thing> arm(std::atomic<double>& angle, const std::string& path = "arm") {
  Thing thing{path};
  thing.property("angle", [&angle] { return angle.load(); }).on_write([&angle](double value) { angle = value; });
  thing.property("speed", [] { return 0.5; });
  thing.action("stop", [](Responder done) { std::move(done).succeed(); });
  return one_thing(std::move(thing));
}

void write(const std::string& url, const std::string& number) {
  Client client = Client::create().value();
  REQUIRE(client.send({"PUT", url, {{"Content-Type", "application/json"}}, number}).value().ok());
}

MirrorOptions options_for(std::vector<std::string> robots, const std::string& store) {
  MirrorOptions options;
  options.robots = std::move(robots);
  options.store.endpoint = store;
  options.store.response_time = milliseconds(5'000);
  options.minimum_interval = milliseconds(1);
  options.first_pause = milliseconds(1);
  options.max_pause = milliseconds(20);
  options.refresh_interval = milliseconds(100);
  options.max_rate = 0;
  return options;
}

Result<MirrorCounts> copy(const MirrorOptions& options) { return Mirror::create(options).value().copy(); }

/// A file that is removed at the end.
class StateFile {
 public:
  StateFile() {
    char name[] = "/tmp/lrt-mirror-XXXXXX";
    const int descriptor = ::mkstemp(name);
    REQUIRE(descriptor >= 0);
    ::close(descriptor);
    path_ = name;
    ::unlink(name);
  }
  ~StateFile() { ::unlink(path_.c_str()); }
  StateFile(const StateFile&) = delete;
  StateFile& operator=(const StateFile&) = delete;
  const std::string& path() const { return path_; }
  std::string text() const {
    std::stringstream all;
    all << std::ifstream(path_).rdbuf();
    return all.str();
  }

 private:
  std::string path_;
};

/// Events of a mirror, for a test that waits for them.
class Events {
 public:
  std::function<void(const MirrorEvent&)> callback() {
    return [this](const MirrorEvent& event) {
      const std::lock_guard lock(mutex_);
      all_.push_back(event);
      changed_.notify_all();
    };
  }
  void wait(MirrorEvent::Kind kind, std::size_t number = 1) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return count_of(kind) >= number; });
  }
  std::size_t count(MirrorEvent::Kind kind) {
    const std::lock_guard lock(mutex_);
    return count_of(kind);
  }

 private:
  std::size_t count_of(MirrorEvent::Kind kind) const {
    std::size_t number = 0;
    for (const MirrorEvent& event : all_) number += event.kind == kind ? 1 : 0;
    return number;
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<MirrorEvent> all_;
};

}  // namespace

TEST_CASE("a copy puts the representation of each resource of two robots into a graph by its URL", "[mirror]") {
  std::atomic<double> first{1}, second{2};
  RobotHost one(arm(first)), two(arm(second));
  Store store;
  const MirrorCounts counts = copy(options_for({one.url(), two.url()}, store.url())).value();
  const auto graphs = store.graphs();
  CHECK(counts.sent == graphs.size());
  CHECK(counts.graphs == graphs.size());
  for (const std::string& robot : {one.url(), two.url()}) {
    for (const std::string path : {"", "arm", "arm/angle", "arm/speed", "arm/stop"}) {
      INFO(robot + path);
      const bool is_there = graphs.count(robot + path) == 1 || (path == "arm/stop" && graphs.count(robot + "arm/actions/stop") == 1);
      CHECK(is_there);
    }
    for (const std::string path : {"all", "arm/state", "arm/subscriptions", "ns/lrt"}) CHECK(graphs.count(robot + path) == 0);
    std::size_t blueprints = 0;
    for (const auto& [name, body] : graphs)
      if (name.find(robot) == 0 &&
          body.find("<http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://www.w3.org/ns/shacl#NodeShape>") != std::string::npos)
        ++blueprints;
    CHECK(blueprints > 0);
    // It is what the robot says.
    Client client = Client::create().value();
    rdf::ReadOptions read;
    const rdf::Graph stored = rdf::read(graphs.at(robot + "arm/angle"), rdf::Syntax::turtle, read).value();
    CHECK(stored.triples().size() == client.get(robot + "arm/angle").value()->graph.triples().size());
  }
  CHECK(graphs.at(one.url() + "arm/angle").find("\"1\"") != std::string::npos);
  CHECK(graphs.at(two.url() + "arm/angle").find("\"2\"") != std::string::npos);
}

TEST_CASE("a copy with a state sends only what has changed and deletes what is gone", "[mirror]") {
  std::atomic<double> angle{1};
  StateFile state;
  Store store;
  const bool gives_tags = GENERATE(false, true);
  if (gives_tags) store.give_tags();
  auto robot = std::make_unique<RobotHost>(arm(angle));
  MirrorOptions options = options_for({robot->url()}, store.url());
  options.state_file = state.path();
  const std::size_t all = copy(options).value().sent;
  CHECK(all > 5);
  store.forget_requests();
  CHECK(copy(options).value().sent == 0);
  CHECK(store.count("GET") == all);  // each graph is looked at once
  CHECK(store.asked().size() == all);
  store.forget_requests();
  angle = 4;
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.sent == 1);
  CHECK(counts.unchanged >= all - 1);
  std::vector<Store::Asked> puts;
  for (const Store::Asked& asked : store.asked())
    if (asked.method != "GET") puts.push_back(asked);
  REQUIRE(puts.size() == 1);
  CHECK(puts[0].method == "PUT");
  CHECK(puts[0].graph == robot->url() + "arm/angle");
  CHECK(puts[0].if_match.empty() == !gives_tags);
  // The state is of this store.
  options.store.endpoint = store.url("/other");
  const Result<Mirror> other = Mirror::create(options);
  REQUIRE_FALSE(other.has_value());
  CHECK(other.error().code == Errc::invalid_option);
}

TEST_CASE("what is gone is deleted and what changes is sent while a mirror runs", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  Store store;
  MirrorOptions options = options_for({robot.url()}, store.url());
  Mirror mirror = Mirror::create(options).value();
  mirror.start().value();
  store.wait(robot.url() + "arm/angle", "\"1\"");
  write(robot.url() + "arm/angle", "7");
  store.wait(robot.url() + "arm/angle", "\"7\"");
  write(robot.url() + "arm/angle", "8.5");
  store.wait(robot.url() + "arm/angle", "8.5");
}

TEST_CASE("a robot that leaves is marked, keeps its graphs, and is unmarked when it returns", "[mirror]") {
  std::atomic<double> angle{1}, other{3};
  RobotHost stays(arm(other));
  auto robot = std::make_unique<RobotHost>(arm(angle));
  const std::string url = robot->url();
  const int port = std::stoi(url.substr(url.rfind(':') + 1));
  Store store;
  Events events;
  MirrorOptions options = options_for({url, stays.url()}, store.url());
  options.on_event = events.callback();
  Mirror mirror = Mirror::create(options).value();
  mirror.start().value();
  store.wait(url + "arm/angle", "\"1\"");
  const std::string mark = mirror::mirror_mark_of(url);
  CHECK(mark == url + "#mirror");
  robot.reset();
  store.wait(mark, "<" + url + "> <https://w3id.org/lrt/ns#unreachableSince> \"");
  CHECK(store.graphs().count(url + "arm/angle") == 1);
  const auto is_marked = [](const std::string& text) { return text.find("unreachableSince") != std::string::npos; };
  CHECK(is_marked(store.graphs()[mark]));
  CHECK(store.graphs()[mark].find("hasPart> <" + url + "arm/angle>") != std::string::npos);  // it lists the graphs all the time
  CHECK_FALSE(is_marked(store.graphs()[mirror::mirror_mark_of(stays.url())]));
  angle = 9;
  Options same;
  same.listen.port = static_cast<std::uint16_t>(port);
  same.listen.transport = [](transport::TransportOptions o) { return transport::make_named({}, std::move(o)); };
  Server again = Server::create(std::move(same)).value();
  again.add(arm(angle)).value();
  std::atomic<bool> ended{false};
  std::thread thread([&] {
    while (!ended) again.poll(), std::this_thread::yield();
  });
  store.wait_until([&](const auto& graphs) { return !is_marked(graphs.at(mark)); });
  store.wait(url + "arm/angle", "\"9\"");
  events.wait(MirrorEvent::Kind::robot_returned);
  CHECK(events.count(MirrorEvent::Kind::robot_left) == 1);
  mirror.stop();
  ended = true;
  again.wake();
  thread.join();
}

TEST_CASE("a copy marks a robot that does not respond, and the mark keeps its time", "[mirror]") {
  StateFile state;
  Store store;
  std::string url;
  {
    const Receiver gone([](Peer&) {});
    url = gone.url("127.0.0.1", "/");
  }
  MirrorOptions options = options_for({url}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).value().robots_away == 1);
  const auto first = store.graphs();
  REQUIRE(first.count(url + "#mirror") == 1);
  CHECK(copy(options).value().sent == 0);
  CHECK(store.graphs() == first);
}

TEST_CASE("a store that fails for a while gets each graph in the end, the newest", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  // After five times 500 for the same graph the mirror gives the graph up, and only one may be known yet.
  constexpr int failures = 4;
  std::atomic<int> left{failures};
  const std::string response = GENERATE(answer(503, "later", "Retry-After: 0\r\n"), answer(500), answer(507, "full"), answer(429));
  Store store([&](const Store::Asked&) { return left-- > 0 ? response : std::string(); });
  Events events;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.on_event = events.callback();
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.sent == store.graphs().size());
  CHECK(counts.failures == failures);
  CHECK(counts.refused == 0);
  CHECK(events.count(MirrorEvent::Kind::store_lost) >= 1);
  CHECK(events.count(MirrorEvent::Kind::store_returned) >= 1);
}

TEST_CASE("a mirror says how long its store lacks what it knows", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  std::atomic<bool> fails{false};
  Store store([&](const Store::Asked&) { return fails ? answer(503, "later") : std::string(); });
  Mirror mirror = Mirror::create(options_for({robot.url()}, store.url())).value();
  const auto until = [&](const char* what, const std::function<bool(const MirrorCounts&)>& condition) {
    for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30); !condition(mirror.counts()); std::this_thread::yield())
      if (std::chrono::steady_clock::now() > end) FAIL("not within 30 s: " << what);
  };
  const auto metric = [&](const std::string& name) {
    const std::vector<Metric> all = mirror.metrics();
    const auto found = std::find_if(all.begin(), all.end(), [&](const Metric& m) { return m.name == name; });
    REQUIRE(found != all.end());
    CHECK(found->labels == std::vector<std::pair<std::string, std::string>>{{"store", store.url()}});
    return found->value;
  };
  mirror.start().value();
  store.wait(robot.url() + "arm/angle", "\"1\"");
  until("the store has all", [](const MirrorCounts& c) { return c.lag.count() == 0 && c.waiting == 0; });
  CHECK(metric("lrt_mirror_robots") == 1);
  const MirrorCounts before = mirror.counts();
  CHECK(before.sent_bytes > before.sent);
  fails = true;
  write(robot.url() + "arm/angle", "7");
  until("a lag", [](const MirrorCounts& c) { return c.lag.count() > 0; });
  const MirrorCounts late = mirror.counts();
  write(robot.url() + "arm/angle", "8");  // a newer change makes the store no less late
  until("a longer lag", [&](const MirrorCounts& c) { return c.lag > late.lag + milliseconds(50); });
  CHECK(metric("lrt_mirror_lag_seconds") > 0.05);
  CHECK(metric("lrt_mirror_failures_total") > 0);
  fails = false;
  store.wait(robot.url() + "arm/angle", "\"8\"");
  until("no lag", [](const MirrorCounts& c) { return c.lag.count() == 0; });
  CHECK(mirror.counts().sent_bytes > before.sent_bytes);
}

TEST_CASE("a store that closes connections in the middle is asked again", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  std::atomic<int> left{4};
  Store store([&](const Store::Asked&) { return left-- > 0 ? std::string("HTTP/1.1 204 Wor") : std::string(); });
  // The receiver closes nothing by itself, so the half response ends by the time limit.
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.store.response_time = milliseconds(500);
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.sent == store.graphs().size());
  CHECK(counts.failures >= 1);
}

TEST_CASE("a store that does not return ends a copy with its reason", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  Store full([](const Store::Asked&) { return answer(507, "no room on the disk", "Content-Type: text/plain\r\n"); });
  MirrorOptions options = options_for({robot.url()}, full.url());
  options.patience = milliseconds(30);
  const Result<MirrorCounts> result = copy(options);
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().message.find("507: no room on the disk") != std::string::npos);

  std::string gone;
  {
    const Receiver receiver([](Peer&) {});
    gone = receiver.url();
  }
  options.store.endpoint = gone;
  const Result<MirrorCounts> nobody = copy(options);
  REQUIRE_FALSE(nobody.has_value());
  CHECK(nobody.error().code == Errc::io_error);
}

TEST_CASE("a graph that the store refuses is reported and does not stop the others", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  const int status = GENERATE(413, 400, 500);
  Store store([&](const Store::Asked& asked) { return asked.graph == robot.url() + "arm/angle" ? answer(status, "too big") : std::string(); });
  Events events;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.on_event = events.callback();
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.refused == 1);
  CHECK(counts.sent == store.graphs().size());
  CHECK(store.graphs().count(robot.url() + "arm/angle") == 0);
  CHECK(events.count(MirrorEvent::Kind::graph_refused) == 1);
}

TEST_CASE("a mirror logs in by Digest, Basic or a token, and says when the store refuses it", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  std::atomic<int> nonces{0}, challenges{0};
  const auto digest_store = [&](const Store::Asked& asked) -> std::string {
    const std::string nonce = "n" + std::to_string(nonces / 4);  // each is good for a few requests
    http::Fields fields;
    if (asked.authorization.find("nonce=\"" + nonce + "\"") != std::string::npos) {
      exchange::DigestChallenge challenge;
      challenge.realm = "SPARQL";
      challenge.nonce = nonce;
      challenge.has_qop = challenge.states_algorithm = true;
      const std::size_t at = asked.authorization.find("nc=") + 3, cnonce = asked.authorization.find("cnonce=\"") + 8;
      const auto count = static_cast<std::uint32_t>(std::stoul(asked.authorization.substr(at, 8), nullptr, 16));
      const std::string text = asked.authorization.substr(cnonce, asked.authorization.find('"', cnonce) - cnonce);
      if (asked.authorization == exchange::digest_authorization(challenge, "dba", "secret", asked.method, asked.target, count, text).value()) {
        ++nonces;
        return {};
      }
    }
    ++challenges;
    return answer(401, "who are you?",
                  "Content-Type: text/plain\r\nWWW-Authenticate: Digest realm=\"SPARQL\", nonce=\"" + nonce +
                      "\", algorithm=MD5, qop=\"auth\", stale=\"" + (asked.authorization.empty() ? "false" : "true") + "\"\r\n");
  };
  Store digest(digest_store);
  MirrorOptions options = options_for({robot.url()}, digest.url());
  options.max_requests = 1;
  options.store.user = "dba";
  options.store.password = "secret";
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.sent == digest.graphs().size());
  CHECK(counts.failures == 0);
  CHECK(challenges > 1);
  options.store.password = "wrong";
  Result<MirrorCounts> refused = copy(options);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == Errc::refused);
  CHECK(refused.error().message.find("401: who are you?") != std::string::npos);

  Store basic([](const Store::Asked& asked) {
    return asked.authorization == "Basic ZGJhOnNlY3JldA==" ? std::string() : answer(401, {}, "WWW-Authenticate: Basic realm=\"x\"\r\n");
  });
  options.store.endpoint = basic.url();
  CHECK_FALSE(copy(options).has_value());
  options.store.password = "secret";
  CHECK(copy(options).value().sent == counts.sent);

  Store bearer([](const Store::Asked& asked) { return asked.authorization == "Bearer abc" ? std::string() : answer(403, "no"); });
  options.store.endpoint = bearer.url();
  CHECK_FALSE(copy(options).has_value());
  options.store.user.clear();
  options.store.token = "abc";
  CHECK(copy(options).value().sent == counts.sent);
  options.store.endpoint = "http://store.example/store";
  CHECK_FALSE(Mirror::create(options).has_value());  // the token could be read on the way
}

TEST_CASE("robots are asked for gzip, and what they send in it is read", "[mirror]") {
  std::atomic<bool> is_always_asked{true};
  const std::string coded = compress("<> a <https://hybr-it-projekt.de/ns/hybr-it#RoboticThing> .");
  Receiver robot([&](Peer& peer) {
    for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
      if (request.find("\r\nAccept-Encoding: gzip\r\n") == std::string::npos) is_always_asked = false;
      if (!peer.send(answer(200, coded, "Content-Type: text/turtle\r\nContent-Encoding: gzip\r\n"))) return;
    }
  });
  Store store;
  CHECK(copy(options_for({robot.url()}, store.url())).has_value());
  CHECK(is_always_asked);
  CHECK(store.graphs()[robot.url()].find("RoboticThing") != std::string::npos);
}

TEST_CASE("a redirect of the store is followed within its origin only", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  Store other;
  const std::string target = GENERATE(std::string("same"), std::string("other"));
  Store store([&](const Store::Asked& asked) -> std::string {
    if (asked.target.find("/moved") == 0) return asked.authorization == "Bearer abc" ? std::string() : answer(401);
    return answer(307, {},
                  "Location: " + (target == "same" ? "/moved?" : other.url("/moved?")) + asked.target.substr(asked.target.find('?') + 1) + "\r\n");
  });
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.store.token = "abc";
  const Result<MirrorCounts> counts = copy(options);
  CHECK(other.asked().empty());
  REQUIRE(counts.has_value() == (target == "same"));
  if (counts) {
    CHECK(counts->sent > 5);
    CHECK(counts->sent == store.graphs().size());
  } else {
    CHECK(counts.error().message.find(other.url("/moved?")) != std::string::npos);
  }
}

TEST_CASE("a graph is named directly by its URL where the endpoint says so", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  Store store;
  MirrorOptions options = options_for({robot.url()}, store.url("/graphs/{graph}"));
  CHECK(copy(options).has_value());
  CHECK(store.graphs().count(robot.url() + "arm/angle") == 1);
  for (const Store::Asked& asked : store.asked()) CHECK(asked.target.find("/graphs/http%3A%2F%2F127.0.0.1%3A") == 0);
  options.store.endpoint = store.url("/data?key=1");
  CHECK(copy(options).has_value());
  CHECK(store.asked().back().target.find("/data?key=1&graph=http%3A") == 0);
}

TEST_CASE("somebody else's change of a graph is overwritten and reported where the store gives tags", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  Store store;
  store.give_tags();
  StateFile state;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).has_value());
  const std::string graph = robot.url() + "arm/angle";
  store.set(graph, "<urn:a> <urn:b> <urn:c> .\n");
  angle = 2;
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.overwritten == 1);
  CHECK(store.graphs().at(graph).find("urn:a") == std::string::npos);
}

TEST_CASE("a mirror that was killed before it wrote its state does not believe an older one", "[mirror]") {
  // The value goes back to what the state said before: the store has the value between.
  std::atomic<int> value{1};
  Receiver robot([&](Peer& peer) {
    while (!peer.read_request().empty())
      if (!peer.send(answer(200, "<> <urn:value> " + std::to_string(value) + " .", "Content-Type: text/turtle\r\n"))) return;
  });
  const std::string url = robot.url("127.0.0.1", "/");
  Store store;
  StateFile state;
  MirrorOptions options = options_for({url}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).value().sent == 2);  // and the list of the robot's graphs
  CHECK(copy(options).value().sent == 0);
  std::string before_end;
  options.on_event = [&](const MirrorEvent& event) {
    if (event.kind == MirrorEvent::Kind::graph_sent) before_end = state.text();  // as a killed mirror leaves it
  };
  value = 2;
  CHECK(copy(options).value().sent == 1);
  CHECK(store.graphs().at(url).find("\"2\"") != std::string::npos);
  value = 1;
  options.on_event = {};
  std::ofstream(state.path(), std::ios::trunc) << before_end << "known\ttorn";
  CHECK(copy(options).value().sent == 1);
  CHECK(store.graphs().at(url).find("\"1\"") != std::string::npos);
}

TEST_CASE("a state file belongs to one mirror, and another file is refused", "[mirror]") {
  StateFile state;
  Store store;
  MirrorOptions options = options_for({"http://127.0.0.1:1/"}, store.url());
  options.state_file = state.path();
  {
    const Mirror first = Mirror::create(options).value();
    const Result<Mirror> second = Mirror::create(options);
    REQUIRE_FALSE(second.has_value());
    CHECK(second.error().message.find("is used by another mirror") != std::string::npos);
  }
  for (const std::string text :
       {"something else\n", "no line", "lrt mirror 3\t%\n", "lrt mirror 1\t\n", "lrt mirror 2\t\n", "lrt mirror 1\t%\nknown\ta\n",
        "lrt mirror 2\t%\nknown\ta\tb\tc\td\n", "lrt mirror 1\t%\nknown\ta\tb\tc\td\te\tf\tg\n"}) {
    std::string content = text;
    if (const std::size_t at = content.find('%'); at != std::string::npos) content.replace(at, 1, store.url());
    std::ofstream(state.path(), std::ios::trunc) << content;
    CHECK_FALSE(Mirror::create(options).has_value());
    CHECK(state.text() == content);
  }
  options.state_file = "/nonexistent/state";
  CHECK_FALSE(Mirror::create(options).has_value());
}

TEST_CASE("a state file is shortened while it is written, and stays complete", "[mirror]") {
  StateFile file;
  const std::string tag = '"' + std::string(8'000, 't') + '"';
  {
    const std::unique_ptr<MirrorState> state = MirrorState::open(file.path(), "http://store.example/", 10).value();
    std::size_t longest = 0;
    for (int i = 0; i < 1'000; ++i) {  // 8 MB of records
      REQUIRE(state->write_unknown({"http://robot.example/gone", "http://robot.example/", {}, {}}, false).has_value());
      REQUIRE(
          state->write_known({{"http://robot.example/arm", "http://robot.example/", std::to_string(i), tag, "echo", "\"robot\"", true}}).has_value());
      longest = std::max(longest, file.text().size());
    }
    REQUIRE(state->write_forgotten("http://robot.example/gone").has_value());
    CHECK(longest > MirrorState::min_excess);  // it is not replaced at each record
    CHECK(longest < MirrorState::min_excess + 4 * tag.size());
    CHECK(MirrorState::open(file.path(), "http://store.example/", 10).error().message.find("is used by another mirror") != std::string::npos);
  }
  const std::vector<StoredGraph> graphs = MirrorState::open(file.path(), "http://store.example/", 10).value()->take();
  REQUIRE(graphs.size() == 1);
  CHECK(graphs[0].digest == "999");
  CHECK(graphs[0].entity_tag == tag);
  CHECK(graphs[0].echo == "echo");
  CHECK(graphs[0].robot_tag == "\"robot\"");
  CHECK(graphs[0].is_watchable);
}

TEST_CASE("a state file that was removed while it is used is written no more, and may be another mirror's", "[mirror]") {
  StateFile file;
  const std::unique_ptr<MirrorState> first = MirrorState::open(file.path(), "http://store.example/", 10).value();
  REQUIRE(first->write_unknown({"http://robot.example/arm", "http://robot.example/", {}, {}}, false).has_value());
  ::unlink(file.path().c_str());
  const std::unique_ptr<MirrorState> second = MirrorState::open(file.path(), "http://store.example/", 10).value();
  const std::string before = file.text();
  for (int i = 0; i < 2; ++i) {
    const Result<void> written = first->write_forgotten("http://robot.example/arm");
    REQUIRE_FALSE(written.has_value());
    CHECK(written.error().message.find("was removed or replaced") != std::string::npos);
  }
  CHECK(file.text() == before);
  CHECK(second->write_unknown({"http://robot.example/base", "http://robot.example/", {}, {}}, true).has_value());
}

TEST_CASE("a message about a store has no password", "[mirror]") {
  MirrorOptions options = options_for({"http://127.0.0.1:1/"}, "http://anna:s3cret@127.0.0.1:1/graphs");
  const Result<Mirror> mirror = Mirror::create(options);
  REQUIRE_FALSE(mirror.has_value());
  CHECK(mirror.error().message.find("s3cret") == std::string::npos);
  CHECK(mirror.error().message.find("http://127.0.0.1:1/graphs") != std::string::npos);
}

TEST_CASE("requests at a time, waiting bytes and graphs are bounded", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  Store store;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.max_requests = 2;
  options.max_waiting_bytes = 100;  // resources are read again when their turn comes
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.sent == store.graphs().size());
  CHECK(store.graphs().count(robot.url() + "arm/angle") == 1);
  CHECK(store.max_at_once() <= 2);

  Store small;
  Events events;
  options.store.endpoint = small.url();
  options.max_graphs = 3;
  options.on_event = events.callback();
  CHECK(copy(options).value().sent == 3);
  CHECK(small.graphs().size() == 3);
  CHECK(events.count(MirrorEvent::Kind::graph_refused) > 0);
}

TEST_CASE("a store without the protocol ends a mirror at once", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  Store store([](const Store::Asked&) { return answer(405, "no PUT here"); });
  const Result<MirrorCounts> result = copy(options_for({robot.url()}, store.url()));
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().message.find("no Graph Store Protocol") != std::string::npos);
  CHECK_FALSE(Mirror::create(options_for({robot.url()}, "no URL")).has_value());
  CHECK_FALSE(Mirror::create(options_for({}, store.url())).has_value());
  CHECK_FALSE(Mirror::create(options_for({"no URL"}, store.url())).has_value());
}

// --- What a store has is not believed ---

namespace {

/// A robot of pages in Turtle, with entity tags that depend on the text only. "" leads to all others.
class Pages {
 public:
  Pages() : receiver_([this](Peer& peer) { serve(peer); }) {}

  std::string url(const std::string& path = {}) const { return receiver_.url("127.0.0.1", "/" + path); }
  void set(const std::string& path, const std::string& turtle) {
    const std::lock_guard lock(mutex_);
    pages_[path] = turtle;
  }
  void remove(const std::string& path) {
    const std::lock_guard lock(mutex_);
    pages_.erase(path);
  }
  /// The fingerprints of all pages, by their URLs.
  std::map<std::string, std::string> prints() const {
    const std::lock_guard lock(mutex_);
    std::map<std::string, std::string> result;
    for (const auto& [path, text] : pages_) result[url(path)] = print_of(text_of(path), url(path));
    return result;
  }
  static std::string print_of(const std::string& turtle, const std::string& base) {
    rdf::ReadOptions options;
    options.base = base;
    return mirror::fingerprint(rdf::read(turtle, rdf::Syntax::turtle, options).value()).value();
  }
  std::size_t bodies() const { return bodies_; }

 private:
  /// Under the lock.
  std::string text_of(const std::string& path) const {
    std::string text = pages_.at(path);
    if (path.empty())
      for (const auto& page : pages_)
        if (!page.first.empty()) text += "<> <urn:leads> <" + page.first + "> .\n";
    return text;
  }
  void serve(Peer& peer) {
    for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
      const std::size_t begin = request.find(' ') + 2;
      const std::string path = request.substr(begin, request.find(' ', begin) - begin);
      std::string response = answer(404);
      {
        const std::lock_guard lock(mutex_);
        if (pages_.count(path) != 0) {
          const std::string text = text_of(path), tag = "\"" + print_of(text, url(path)) + "\"";
          if (field_of(request, "If-None-Match") == tag) response = answer(304, {}, "ETag: " + tag + "\r\n");
          else ++bodies_, response = answer(200, text, "Content-Type: text/turtle\r\nETag: " + tag + "\r\n");
        }
      }
      if (!peer.send(response)) return;
    }
  }

  mutable std::mutex mutex_;
  std::map<std::string, std::string> pages_{{"", ""}};
  std::atomic<std::size_t> bodies_{0};
  Receiver receiver_;
};

/// The fingerprints of all graphs of a store but the list that the mirror makes.
std::map<std::string, std::string> prints_of(const Store& store) {
  std::map<std::string, std::string> result;
  for (const auto& [name, body] : store.graphs())
    if (name.find("#mirror") == std::string::npos) result[name] = Pages::print_of(body, name);
  return result;
}

/// As Virtuoso does.
std::string doubles_with_a_point(std::string text) {
  const std::string whole = "\"0\"^^<http://www.w3.org/2001/XMLSchema#double>";
  for (std::size_t at = text.find(whole); at != std::string::npos; at = text.find(whole, at)) text.replace(at, 3, "\"0.0\"");
  return text;
}

const std::string zero = "'0'^^<http://www.w3.org/2001/XMLSchema#double>";

}  // namespace

TEST_CASE("whatever happens to a store, to a state or to both, a copy makes the store equal to the robot", "[mirror]") {
  Pages robot;
  for (int i = 0; i < 5; ++i)
    robot.set("page" + std::to_string(i), "<> <urn:value> " + zero + ", " + std::to_string(i) + " ; <urn:has> [ <urn:is> <x> ] .");
  Store store;
  const std::string kind = GENERATE(as<std::string>(), "tags", "no tags", "own form");
  if (kind == "tags") store.give_tags();
  if (kind == "own form") store.give_back(doubles_with_a_point);
  StateFile state;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).value().sent == 7);  // five pages, the first one, the list
  const auto older = store.graphs();
  const std::string older_state = state.text();
  robot.set("page1", "<> <urn:value> 100 .");
  robot.remove("page4");
  robot.set("page5", "<> <urn:value> 5 .");
  CHECK(copy(options).value().lost == 0);
  REQUIRE(prints_of(store) == robot.prints());

  const bool has_state = GENERATE(true, false);
  const auto [what, lost, overwritten] = GENERATE(table<std::string, std::uint64_t, std::uint64_t>({
      {"nothing", 0, 0},
      {"emptied", 7, 0},
      {"one deleted", 1, 0},
      {"one changed", 0, 1},
      {"one replaced by a page", 0, 1},
      {"the list deleted", 1, 0},
      {"restored from an older copy", 1, 3},  // page5; page1, the first page and the list
      {"an older state", 0, 0},
      {"a state of another robot", 0, 0},
      {"restored, and an older state", 0, 0},
  }));
  INFO(kind << ", " << (has_state ? "with" : "without") << " its state: " << what);
  const std::string page = robot.url("page2");
  if (what == "emptied") store.restore({});
  if (what == "one deleted") store.remove(page);
  if (what == "one changed") store.set(page, "<urn:a> <urn:b> <urn:c> .");
  if (what == "one replaced by a page") store.set(page, "<html>it works</html>");
  if (what == "the list deleted") store.remove(mirror::mirror_mark_of(robot.url()));
  if (what.find("restored") == 0) store.restore(older);
  if (what.find("an older state") != std::string::npos) std::ofstream(state.path(), std::ios::trunc) << older_state;
  if (what == "a state of another robot") {
    std::string other = state.text();
    for (std::size_t at = other.find("\t" + robot.url() + "\t"); at != std::string::npos; at = other.find("\t" + robot.url() + "\t"))
      other.replace(at, robot.url().size() + 2, "\thttp://other.example/\t");
    std::ofstream(state.path(), std::ios::trunc) << other;
  }
  if (!has_state) ::unlink(state.path().c_str());
  const MirrorCounts counts = copy(options).value();
  CHECK(prints_of(store) == robot.prints());
  CHECK(counts.refused == 0);
  const bool is_counted = has_state && what.find("older state") == std::string::npos;
  if (is_counted) {
    CHECK(counts.lost == lost);
    CHECK(counts.overwritten == overwritten);
    if (what == "nothing") CHECK(counts.sent == 0);
  }
  // What is equal stays so, and that costs one request for each graph.
  store.forget_requests();
  const MirrorCounts again = copy(options).value();
  CHECK(again.sent == 0);
  CHECK(again.deleted == 0);
  CHECK(again.lost + again.overwritten == 0);
  CHECK(store.asked().size() == store.graphs().size());
  CHECK(store.count("GET") == store.graphs().size());
  CHECK(prints_of(store) == robot.prints());
}

TEST_CASE("a store that loses its content while a mirror runs is filled again, and that is reported", "[mirror]") {
  Pages robot;
  robot.set("page", "<> <urn:value> 1 .");
  Store store;
  if (GENERATE(true, false)) store.give_tags();
  Events events;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.on_event = events.callback();
  Mirror mirror = Mirror::create(options).value();
  mirror.start().value();
  const auto is_full = [](const auto& graphs) { return graphs.size() == 3; };
  store.wait_until(is_full);
  store.restore({});
  store.wait_until(is_full);
  store.set(robot.url("page"), "<urn:a> <urn:b> <urn:c> .");
  store.wait(robot.url("page"), "urn:value");
  events.wait(MirrorEvent::Kind::graph_overwritten);
  events.wait(MirrorEvent::Kind::store_repaired);
  mirror.stop();
  CHECK(prints_of(store) == robot.prints());
  CHECK(events.count(MirrorEvent::Kind::graph_lost) == mirror.counts().lost);
  CHECK(mirror.counts().lost >= 1);  // what was lost while it was being sent does not count
  CHECK(mirror.counts().overwritten >= 1);
}

TEST_CASE("entity tags are believed unless the contents are to be verified, and nothing is if all is to be sent", "[mirror]") {
  Pages robot;
  robot.set("page", "<> <urn:value> 1 .");
  Store store;
  store.give_tags();
  StateFile state;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).value().sent == 3);
  store.set_secretly(robot.url("page"), "<urn:a> <urn:b> <urn:c> .");
  CHECK(copy(options).value().overwritten == 0);
  options.start = MirrorStart::verify;
  const MirrorCounts verified = copy(options).value();
  CHECK(verified.overwritten == 1);
  CHECK(verified.sent == 1);
  CHECK(prints_of(store) == robot.prints());
  store.set_secretly(robot.url("page"), "<urn:a> <urn:b> <urn:c> .");
  options.start = MirrorStart::force;
  store.forget_requests();
  const MirrorCounts forced = copy(options).value();
  CHECK(forced.sent == 3);
  CHECK(store.count("PUT") == 3);
  CHECK(prints_of(store) == robot.prints());
}

TEST_CASE("a store whose reads have other entity tags than its writes is not taken for one that others change", "[mirror]") {
  Pages robot;
  robot.set("page", "<> <urn:value> 1 .");
  Store store;
  store.give_other_tags_to_reads();
  StateFile state;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).value().sent == 3);
  CHECK(copy(options).value().unchanged == 3);
  robot.set("page", "<> <urn:value> 2 .");
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.sent == 1);
  CHECK(counts.overwritten == 0);
  store.set(robot.url("page"), "<urn:a> <urn:b> <urn:c> .");
  CHECK(copy(options).value().overwritten == 1);
  CHECK(prints_of(store) == robot.prints());
}

TEST_CASE("a store that cannot be read is believed, and that is reported once", "[mirror]") {
  const int status = GENERATE(403, 405, 501);
  Pages robot;
  robot.set("page", "<> <urn:value> 1 .");
  Store store([&](const Store::Asked& asked) { return asked.method == "GET" ? answer(status, "write only") : std::string(); });
  StateFile state;
  Events events;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  options.on_event = events.callback();
  CHECK(copy(options).value().sent == 3);
  CHECK(events.count(MirrorEvent::Kind::problem) == 1);
  CHECK(prints_of(store) == robot.prints());
  CHECK(copy(options).value().unchanged == 3);
  CHECK(events.count(MirrorEvent::Kind::problem) == 2);
}

TEST_CASE("a store that does not give one graph is compared in all others, and it is read again when it can be", "[mirror]") {
  const int status = GENERATE(400, 403, 405, 406, 414);
  Pages robot;
  robot.set("page", "<> <urn:value> 1 .");
  robot.set("other", "<> <urn:value> 2 .");
  const std::string page = robot.url("page"), list = mirror::mirror_mark_of(robot.url());
  std::atomic<const std::string*> not_given{&page};
  Store store([&](const Store::Asked& asked) {
    const std::string* const graph = not_given;
    return asked.method == "GET" && graph != nullptr && asked.graph == *graph ? answer(status, "not this one") : std::string();
  });
  StateFile state;
  Events events;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  options.on_event = events.callback();
  CHECK(copy(options).value().sent == 4);
  store.remove(robot.url("other"));
  store.set(page, "<urn:a> <urn:b> <urn:c> .");
  MirrorCounts counts = copy(options).value();
  CHECK(counts.lost == 1);
  CHECK(counts.overwritten == 0);  // that cannot be known
  CHECK(events.count(MirrorEvent::Kind::problem) == 1);
  not_given = nullptr;
  counts = copy(options).value();
  CHECK(counts.overwritten == 1);
  CHECK(prints_of(store) == robot.prints());

  // The same of the list of the robot, while a mirror runs: it finds out that the store can be read again.
  not_given = &list;
  Mirror mirror = Mirror::create(options).value();
  mirror.start().value();
  events.wait(MirrorEvent::Kind::robot_found, 4);
  CHECK(events.count(MirrorEvent::Kind::problem) == 2);
  not_given = nullptr;
  store.restore({});
  store.wait_until([](const auto& graphs) { return graphs.size() == 4; });
  mirror.stop();
  CHECK(prints_of(store) == robot.prints());
}

TEST_CASE("a graph that the store cannot give back is not waited for", "[mirror]") {
  Pages robot;
  robot.set("page", "<> <urn:value> 1 .");
  Store store;
  StateFile state;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).value().sent == 3);
  const std::string graph = GENERATE(as<std::string>(), "page", "#mirror");
  Store broken(
      [&](const Store::Asked& asked) { return asked.method == "GET" && asked.graph == robot.url(graph) ? answer(500, "oh") : std::string(); });
  for (const auto& [name, body] : store.graphs()) broken.set(name, body);
  options.store.endpoint = broken.url();
  std::string text = state.text();
  text.replace(text.find(store.url()), store.url().size(), broken.url());
  std::ofstream(state.path(), std::ios::trunc) << text;
  CHECK(copy(options).has_value());
  CHECK(prints_of(broken) == robot.prints());
}

TEST_CASE("a mirror that starts again reads of the robot only what has changed, and watches the rest", "[mirror]") {
  Pages robot;
  for (int i = 0; i < 20; ++i) robot.set("page" + std::to_string(i), "<> <urn:value> " + std::to_string(i) + " .");
  Store store;
  StateFile state;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).value().sent == 22);
  CHECK(robot.bodies() == 21);
  CHECK(copy(options).value().unchanged == 22);
  CHECK(robot.bodies() == 22);  // the first page, which says who the robot is
  robot.set("page7", "<> <urn:value> 70 ; <urn:leads> <page7/part> .");
  robot.set("page7/part", "<> <urn:value> 71 .");
  robot.remove("page8");
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.deleted == 1);
  CHECK(robot.bodies() == 25);  // both pages, and the first one, which leads to them
  CHECK(prints_of(store) == robot.prints());
  // What the store lost is read again, of the robot too.
  store.remove(robot.url("page3"));
  CHECK(copy(options).value().lost == 1);
  CHECK(robot.bodies() == 27);
  CHECK(prints_of(store) == robot.prints());
}

TEST_CASE("changes of what an earlier mirror has read are watched", "[mirror]") {
  std::atomic<double> angle{1};
  RobotHost robot(arm(angle));
  Store store;
  StateFile state;
  MirrorOptions options = options_for({robot.url()}, store.url());
  options.state_file = state.path();
  CHECK(copy(options).has_value());
  options.refresh_interval = std::chrono::hours(1);
  Mirror mirror = Mirror::create(options).value();
  mirror.start().value();
  write(robot.url() + "arm/angle", "7");
  store.wait(robot.url() + "arm/angle", "\"7\"");
  mirror.stop();
}

TEST_CASE("a graph of a robot that another mirror sent and lost track of is deleted with its resource", "[mirror]") {
  Pages robot;
  robot.set("page", "<> <urn:value> 1 .");
  robot.set("old", "<> <urn:value> 2 .");
  Store store;
  store.set("http://elsewhere.example/", "<urn:a> <urn:b> <urn:c> .");
  MirrorOptions options = options_for({robot.url()}, store.url());
  CHECK(copy(options).value().sent == 4);
  robot.remove("old");
  // Whoever can write to the store cannot have the mirror delete what is of others.
  const std::string list = mirror::mirror_mark_of(robot.url());
  store.set(list, store.graphs()[list] + "<" + list + "> <http://purl.org/dc/terms/hasPart> <http://elsewhere.example/> .\n");
  CHECK(copy(options).value().deleted == 1);
  CHECK(store.graphs().count(robot.url("old")) == 0);
  CHECK(store.graphs().count("http://elsewhere.example/") == 1);
}

TEST_CASE("a robot with another public base is not mirrored as one resource: the mirror says which URL to use", "[mirror]") {
  Options public_base;
  public_base.listen.public_base = "https://robots.example/cell7";
  public_base.security.allowed_hosts = {"127.0.0.1"};
  std::atomic<double> angle{1};
  RobotHost behind_proxy(arm(angle), {}, std::move(public_base)), other(arm(angle));
  Store store;
  MirrorOptions options = options_for({behind_proxy.server().url()}, store.url());
  const std::uint16_t port = behind_proxy.server().port();
  options.robots = {"http://127.0.0.1:" + std::to_string(port) + "/"};
  const Result<MirrorCounts> result = copy(options);
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::failed);
  CHECK(result.error().message.find("use \"https://robots.example/cell7") != std::string::npos);
  CHECK(store.count("PUT") == 0);
  // The others are mirrored.
  Events events;
  options.on_event = events.callback();
  options.robots.push_back(other.url());
  const MirrorCounts counts = copy(options).value();
  CHECK(counts.robots_elsewhere == 1);
  CHECK(counts.robots_away == 0);
  CHECK(events.count(MirrorEvent::Kind::problem) == 1);
  CHECK(events.count(MirrorEvent::Kind::robot_found) == 1);
  CHECK(store.graphs().count(other.url() + "arm/angle") == 1);
  // A mirror that runs ends as a copy does, if there is no other.
  options.robots.pop_back();
  Mirror mirror = Mirror::create(options).value();
  mirror.start().value();
  while (!mirror.failure()) std::this_thread::yield();
  CHECK(mirror.failure()->code == Errc::failed);
}

TEST_CASE("two robots with one identity are noticed and mirrored by their URLs, and so is a robot without one", "[mirror]") {
  Pages one, two, stranger;
  const std::string identity = "<> <https://w3id.org/lrt/ns#identity> <https://robots.example/cell7> .";
  one.set("", identity);
  two.set("", identity);
  stranger.set("", "<> <urn:value> 1 .");
  Store store;
  std::mutex mutex;
  std::string reason;
  MirrorOptions options = options_for({one.url(), stranger.url()}, store.url());
  options.on_event = [&](const MirrorEvent& event) {
    const std::lock_guard lock(mutex);
    if (event.kind == MirrorEvent::Kind::problem) reason = event.reason;
  };
  CHECK(copy(options).has_value());
  CHECK(reason.empty());
  options.robots.push_back(two.url());
  CHECK(copy(options).has_value());
  CHECK(reason.find("have one identity, <https://robots.example/cell7>") != std::string::npos);
  for (const Pages* robot : {&one, &two, &stranger}) CHECK(store.graphs().count(robot->url()) == 1);
}

TEST_CASE("what is no robot is said to be none", "[mirror]") {
  Pages nothing;
  Store store;
  const Result<MirrorCounts> result = copy(options_for({nothing.url()}, store.url()));
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().message.find("describes nothing in RDF") != std::string::npos);
  nothing.set("", "<http://xmlns.com/foaf/0.1/Person> <urn:is> <urn:a> .");
  const Result<MirrorCounts> other = copy(options_for({nothing.url()}, store.url()));
  REQUIRE_FALSE(other.has_value());
  CHECK(other.error().message.find("describes something else, \"http://xmlns.com/foaf/0.1/Person\"") != std::string::npos);
  CHECK(store.count("PUT") == 0);
}

TEST_CASE("a resource that cannot be read is counted, and so is a graph beyond the limit", "[mirror]") {
  Receiver robot([](Peer& peer) {
    for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
      const bool is_first = request.find("GET / ") == 0;
      if (!peer.send(is_first ? answer(200, "<> <urn:leads> <broken>, <page> .", "Content-Type: text/turtle\r\n")
                              : answer(request.find("GET /broken ") == 0 ? 500 : 403)))
        return;
    }
  });
  Store store;
  MirrorOptions options = options_for({robot.url("127.0.0.1", "/")}, store.url());
  MirrorCounts counts = copy(options).value();
  CHECK(counts.unread == 1);  // what is refused to this client is none of its business
  options.max_graphs = 1;
  counts = copy(options).value();
  CHECK(counts.refused >= 1);
}

TEST_CASE("a robot is the same with and without the slash behind its host", "[mirror]") {
  CHECK(mirror::mirror_mark_of("http://robot.example") == "http://robot.example/#mirror");
  CHECK(mirror::mirror_mark_of("http://robot.example/") == "http://robot.example/#mirror");
  CHECK(mirror::mirror_mark_of("http://robot.example/cell7#x") == "http://robot.example/cell7#mirror");
}
