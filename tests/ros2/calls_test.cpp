// SPDX-License-Identifier: Apache-2.0
#include <lrt/ros2/graph.hpp>

#include <algorithm>

#include "tests/ros2/graph_support.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;
using namespace lrt::test;
using namespace std::chrono_literals;

namespace {

constexpr const char* add_type = "example_interfaces/srv/AddTwoInts";
constexpr const char* fibonacci_type = "example_interfaces/action/Fibonacci";

std::string add(std::int64_t a, std::int64_t b) { return CdrWriter().i64(a).i64(b).payload(); }
std::int64_t sum(const Bytes& payload) { return CdrReader(*payload).i64(); }

bool is_ready(const Graph& graph, const std::string& service) {
  return eventually([&] {
    const auto seen = graph.snapshot();
    return seen->service(service) != nullptr && seen->service(service)->is_ready;
  });
}

Peer fastdds(const Domain& domain, const std::string& user_data = "enclave=/;") {
  return Peer({LRT_FASTDDS_PEER, std::to_string(domain.number()), std::to_string(long_lease), user_data});
}

Errc error_of(Graph& graph, const char* service, std::chrono::milliseconds timeout = 10s) {
  Answer<Bytes> answer;
  const auto call = graph.call(service, add_type, add(1, 2), answer.take(), timeout).value();
  return answer.get() ? Errc::expected_iri : answer.get().error().code;
}

/// The events of a goal, as words.
struct Events {
  std::mutex mutex{};
  std::vector<std::string> words{};
  std::vector<std::int32_t> result{};
  std::optional<Errc> error{};
  GoalStatus status = GoalStatus::unknown;
  std::atomic<bool> has_ended{false};

  GoalEvents take() {
    const auto note = [this](std::string word) {
      const std::lock_guard<std::mutex> lock(mutex);
      words.push_back(std::move(word));
    };
    GoalEvents events;
    events.accepted = [=] { note("accepted"); };
    events.feedback = [=](const Bytes& payload) {
      CdrReader reader(*payload);
      reader.bytes(16);
      note("feedback " + std::to_string(reader.u32()));
    };
    events.status = [=](GoalStatus now) { note("status " + std::to_string(static_cast<int>(now))); };
    events.ended = [=](Result<Bytes> response, GoalStatus now) {
      note("ended");
      status = now;
      if (!response) {
        error = response.error().code;
      } else {
        CdrReader reader(**response);
        reader.u8();
        for (std::size_t left = reader.count(4); left != 0; --left) result.push_back(reader.i32());
      }
      has_ended = true;
    };
    return events;
  }
  std::size_t count(const std::string& word) {
    const std::lock_guard<std::mutex> lock(mutex);
    return static_cast<std::size_t>(std::count(words.begin(), words.end(), word));
  }
};

std::string goal(std::int32_t order) { return CdrWriter().bytes(std::string(16, '\0')).u32(static_cast<std::uint32_t>(order)).payload(); }

bool has_action(const Graph& graph, const std::string& action, const std::string& node = {}) {
  return eventually([&] {
    const auto seen = graph.snapshot();
    return seen->action(action) != nullptr && seen->action(action)->is_ready && (node.empty() || seen->node(node) != nullptr);
  });
}

}  // namespace

TEST_CASE("services of Cyclone are called with a header, in both byte orders", "[ros2][calls]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = cyclone(domain);
  peer.tell("node /calculator");
  peer.tell("serve_add /add");
  peer.tell("serve_add /plain plain");  // without user data of RMW
  REQUIRE(is_ready(graph, "/add"));
  REQUIRE(is_ready(graph, "/plain"));
  REQUIRE(eventually([&] { return graph.snapshot()->service("/add")->nodes.size() == 1; }));
  const auto seen = graph.snapshot();
  CHECK(seen->service("/add")->type == add_type);
  CHECK(seen->service("/add")->form == IdentityForm::header);
  CHECK(seen->service("/add")->nodes == std::vector<std::string>{"/calculator"});
  CHECK(seen->topics.empty());
  for (const char* service : {"/add", "/plain"}) {
    for (std::int64_t i = 0; i < 3; ++i) {
      Answer<Bytes> answer;
      const auto call = graph.call(service, add_type, add(40, i), answer.take()).value();
      REQUIRE(answer.get());
      CHECK(sum(*answer.get()) == 40 + i);
      CHECK(answer.times() == 1);
    }
  }
  Answer<Bytes> answer;
  const std::string big_endian("\0\0\0\0\0\0\0\0\0\0\0\5\0\0\0\0\0\0\0\6", 20);
  const auto call = graph.call("/add", add_type, big_endian, answer.take()).value();
  REQUIRE(answer.get());
  CHECK(sum(*answer.get()) == 11);
  CHECK(graph.counters().calls == 0);
}

TEST_CASE("services of Fast DDS are called with an identity", "[ros2][calls]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = fastdds(domain);
  peer.tell("serve_add /add loud");
  REQUIRE(is_ready(graph, "/add"));
  CHECK(graph.snapshot()->service("/add")->form == IdentityForm::inline_qos);
  for (std::int64_t i = 0; i < 3; ++i) {
    Answer<Bytes> answer;
    const auto call = graph.call("/add", add_type, add(40, i), answer.take()).value();
    REQUIRE(answer.get());
    CHECK(sum(*answer.get()) == 40 + i);
  }
  CHECK(peer.count("no identity") == 0);
  CHECK(peer.is_running());
}

TEST_CASE("in doubt about the form of a service nothing is sent", "[ros2][calls]") {
  const Domain domain;
  Graph graph = join(domain);
  // Fast DDS can do both forms: without a word of ROS nobody knows which.
  Peer peer = fastdds(domain, "something");
  peer.tell("serve_add /add loud");
  REQUIRE(eventually([&] { return graph.snapshot()->service("/add") != nullptr; }));
  CHECK(graph.snapshot()->service("/add")->form == IdentityForm::unknown);
  CHECK_FALSE(graph.snapshot()->service("/add")->is_ready);
  CHECK(error_of(graph, "/add") == Errc::unavailable);
  // The nodes of ROS say it.
  peer.tell("node /calculator");
  REQUIRE(is_ready(graph, "/add"));
  CHECK(graph.snapshot()->service("/add")->form == IdentityForm::inline_qos);
  // A server of the other form with the same name: to whom would a request go?
  Peer other = cyclone(domain);
  other.tell("serve_add /add");
  REQUIRE(eventually([&] { return graph.snapshot()->service("/add")->form == IdentityForm::unknown; }));
  CHECK(error_of(graph, "/add") == Errc::unavailable);
  other.quit();
  REQUIRE(is_ready(graph, "/add"));
  Answer<Bytes> answer;
  const auto call = graph.call("/add", add_type, add(1, 2), answer.take()).value();
  REQUIRE(answer.get());
  CHECK(peer.count("asked 1 2") == 1);
  CHECK(peer.is_running());
}

TEST_CASE("a call ends when its server does not respond, or is gone", "[ros2][calls]") {
  const Domain domain;
  Graph graph = join(domain);
  CHECK(error_of(graph, "/add") == Errc::unavailable);
  Peer peer = cyclone(domain, short_lease);
  peer.tell("serve_add /add silent");
  REQUIRE(is_ready(graph, "/add"));
  CHECK(error_of(graph, "/add", 50ms) != Errc::unconfirmed);
  Answer<Bytes> answer;
  const auto call = graph.call("/add", add_type, add(3, 4), answer.take(), 1h).value();
  REQUIRE(peer.has("asked 3 4"));
  CHECK(graph.counters().calls == 1);
  peer.kill();
  REQUIRE_FALSE(answer.get());
  CHECK(answer.get().error().code == Errc::unconfirmed);
  CHECK(graph.counters().calls == 0);
  CHECK(eventually([&] { return graph.snapshot()->service("/add") == nullptr; }));
  // It returns, and is called again.
  Peer again = cyclone(domain);
  again.tell("serve_add /add");
  REQUIRE(is_ready(graph, "/add"));
  Answer<Bytes> second;
  const auto later = graph.call("/add", add_type, add(3, 5), second.take()).value();
  CHECK(again.has("asked 3 5"));
  REQUIRE(second.get());
  CHECK(sum(*second.get()) == 8);
}

TEST_CASE("calls are limited, and one that is given up does not respond", "[ros2][calls]") {
  const Domain domain;
  std::atomic<int> called{0};
  Answer<Bytes> last;
  Call outlives;
  {
    ros2::GraphOptions options;
    options.limits.max_calls = 3;
    Graph graph = join(domain, std::move(options));
    Peer peer = cyclone(domain);
    peer.tell("serve_add /add silent");
    REQUIRE(is_ready(graph, "/add"));
    std::vector<Call> calls;
    for (int i = 0; i < 3; ++i)
      calls.push_back(graph
                          .call(
                              "/add", add_type, add(i, 0), [&](Result<Bytes>) { ++called; }, 1h)
                          .value());
    CHECK(graph.call("/add", add_type, add(9, 9), [&](Result<Bytes>) { ++called; }).error().code == Errc::limit_exceeded);
    CHECK(graph.call("/add", add_type, "", [](Result<Bytes>) {}).error().code == Errc::expected_value);
    calls.clear();
    CHECK(graph.counters().calls == 0);
    outlives = graph.call("/add", add_type, add(5, 5), last.take(), 1h).value();
    REQUIRE(peer.has("asked 5 5"));
  }
  CHECK(called == 0);
  REQUIRE_FALSE(last.get());
  CHECK(last.get().error().code == Errc::closed);
}

TEST_CASE("a goal tells what happens to it until its end", "[ros2][calls]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = cyclone(domain);
  peer.tell("node /arm");
  peer.tell("serve_fibonacci /fibonacci");
  REQUIRE(has_action(graph, "/fibonacci", "/arm"));
  const auto seen = graph.snapshot();
  CHECK(seen->action("/fibonacci")->type == fibonacci_type);
  CHECK(seen->action("/fibonacci")->nodes == std::vector<std::string>{"/arm"});
  CHECK(seen->services.empty());
  CHECK(seen->topics.empty());
  for (const int order : {5, 2}) {
    Events events;
    const auto sent = graph.send_goal("/fibonacci", fibonacci_type, goal(order), events.take()).value();
    REQUIRE(eventually([&] { return events.has_ended.load(); }));
    CHECK_FALSE(events.error);
    CHECK(events.status == GoalStatus::succeeded);
    CHECK(events.result.size() == static_cast<std::size_t>(order));
    CHECK(events.words.front() == "accepted");
    CHECK(events.words.back() == "ended");
    CHECK(events.count("feedback 1") == 1);
    CHECK(events.count("feedback " + std::to_string(order)) == 1);
  }
  Events rejected;
  const auto refused = graph.send_goal("/fibonacci", fibonacci_type, goal(-1), rejected.take()).value();
  REQUIRE(eventually([&] { return rejected.has_ended.load(); }));
  CHECK(rejected.error == Errc::refused);
  CHECK(rejected.words == std::vector<std::string>{"ended"});
  Events nobody;
  const auto unknown = graph.send_goal("/nobody", fibonacci_type, goal(1), nobody.take()).value();
  REQUIRE(eventually([&] { return nobody.has_ended.load(); }));
  CHECK(nobody.error == Errc::unavailable);
  CHECK(graph.counters().calls == 0);
}

TEST_CASE("a goal is cancelled, also before it is accepted", "[ros2][calls]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = cyclone(domain);
  peer.tell("serve_fibonacci /fibonacci");
  REQUIRE(has_action(graph, "/fibonacci"));
  for (const bool at_once : {true, false}) {
    Events events;
    const auto sent = graph.send_goal("/fibonacci", fibonacci_type, goal(100'000), events.take()).value();
    if (!at_once) REQUIRE(eventually([&] { return events.count("feedback 2") == 1; }));
    sent.cancel();
    REQUIRE(eventually([&] { return events.has_ended.load(); }));
    CHECK(events.status == GoalStatus::canceled);
    CHECK_FALSE(events.error);
    CHECK(events.words.back() == "ended");
  }
}

TEST_CASE("a goal ends with its server, and its handle lets it run", "[ros2][calls]") {
  const Domain domain;
  ros2::GraphOptions options;
  options.limits.max_goals = 2;
  Graph graph = join(domain, std::move(options));
  Peer peer = cyclone(domain, short_lease);
  peer.tell("serve_fibonacci /fibonacci");
  REQUIRE(has_action(graph, "/fibonacci"));
  Events events, silent;
  const auto sent = graph.send_goal("/fibonacci", fibonacci_type, goal(100'000), events.take()).value();
  {
    const auto dropped = graph.send_goal("/fibonacci", fibonacci_type, goal(100'001), silent.take()).value();
    REQUIRE(peer.has("goal 100001"));
  }
  CHECK(graph.send_goal("/fibonacci", fibonacci_type, goal(1), GoalEvents{}).error().code == Errc::limit_exceeded);
  REQUIRE(eventually([&] { return events.count("feedback 2") == 1; }));
  peer.kill();
  REQUIRE(eventually([&] { return events.has_ended.load(); }));
  CHECK(events.error == Errc::unavailable);
  CHECK(silent.count("ended") == 0);
  CHECK(eventually([&] { return graph.counters().calls == 0; }));
}

TEST_CASE("parameters are read with their descriptors, set, and told of", "[ros2][calls]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = cyclone(domain);
  peer.tell("node /drive");
  peer.tell("serve_parameters /drive");
  REQUIRE(eventually([&] {
    const auto seen = graph.snapshot();
    return seen->node("/drive") != nullptr && seen->node("/drive")->has_parameters && seen->service("/drive/list_parameters")->is_ready;
  }));
  Answer<std::vector<Parameter>> answer;
  const auto reading = graph.parameters("/drive", answer.take()).value();
  REQUIRE(answer.get());
  const std::vector<Parameter>& all = *answer.get();
  REQUIRE(all.size() == 2);
  CHECK(all[0].name == "speed");
  CHECK(all[0].type == ParameterType::real);
  CHECK(*all[0].value.real() == 1);
  CHECK(all[0].description == "how fast it drives");
  REQUIRE(all[0].range);
  CHECK(all[0].range->from == 0);
  CHECK(all[0].range->to == 2);
  CHECK(all[0].range->step == 0.5);
  CHECK_FALSE(all[0].read_only);
  CHECK(all[1].name == "name");
  CHECK(*all[1].value.text() == "r7");
  CHECK(all[1].read_only);
  CHECK_FALSE(all[1].range);

  std::atomic<bool> told{false};
  std::atomic<double> value{0};
  const auto events = graph
                          .parameter_events([&](std::string_view node, std::vector<Parameter> parameters, std::vector<std::string>) {
                            if (node != "/drive" || parameters.size() != 1 || parameters[0].name != "speed") return;
                            value = *parameters[0].value.real();
                            told = true;
                          })
                          .value();
  Parameter speed = all[0];
  double next = 1;
  CHECK(eventually([&] {  // the event may come before the reader of events is matched
    Answer<void> set;
    next = next == 1.5 ? 2 : 1.5;
    speed.value = rdf::Value(next);
    const auto setting = graph.set_parameter("/drive", speed, set.take()).value();
    REQUIRE(set.get());
    return told.load();
  }));
  CHECK(eventually([&] { return value == next; }));
  Answer<void> set;
  speed.value = rdf::Value(3.0);
  const auto setting = graph.set_parameter("/drive", speed, set.take()).value();
  REQUIRE_FALSE(set.get());
  CHECK(set.get().error().code == Errc::refused);
  CHECK(set.get().error().message == "too fast");
  speed.value = rdf::Value(std::string("fast"));
  CHECK(graph.set_parameter("/drive", speed, [](Result<void>) {}).error().code == Errc::expected_value);
  Answer<std::vector<Parameter>> nobody;
  const auto asking = graph.parameters("/nobody", nobody.take()).value();
  REQUIRE_FALSE(nobody.get());
  CHECK(nobody.get().error().code == Errc::unavailable);
  CHECK(graph.counters().calls == 0);
}

TEST_CASE("nodes of Humble and of later releases are known, and nothing is announced if both are there", "[ros2][calls]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer humble = fastdds(domain);
  humble.tell("writer w /chatter reliable volatile");
  humble.tell("node24 /arm/humble");
  REQUIRE(eventually([&] { return graph.snapshot()->node("/arm/humble") != nullptr && graph.snapshot()->topic("/chatter") != nullptr; }));
  CHECK(graph.snapshot()->topic("/chatter")->writers[0].node == "/arm/humble");
  ros2::GraphOptions second;
  second.node = "/second";
  Graph other = join(domain, std::move(second));
  CHECK(eventually([&] { return other.snapshot()->node("/lrt_ros2") != nullptr; }));  // announced with Gids of 24 bytes
  Peer newer = cyclone(domain);
  newer.tell("node /newer");
  CHECK(eventually([&] { return graph.snapshot()->node("/newer") != nullptr; }));
  CHECK(graph.snapshot()->node("/arm/humble") != nullptr);
}
