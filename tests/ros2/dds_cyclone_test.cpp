// SPDX-License-Identifier: Apache-2.0
#include <lrt/ros2/graph.hpp>

#include <algorithm>

#include "tests/ros2/graph_support.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;
using namespace lrt::test;

namespace {
constexpr const char* string_type = "std_msgs/msg/String";
const std::string hash_a = "RIHS01_" + std::string(64, 'a'), hash_b = "RIHS01_" + std::string(64, 'b');
}  // namespace

TEST_CASE("topics of Cyclone DDS are read and written", "[ros2][dds]") {
  const Domain domain;
  Peer peer = cyclone(domain);
  peer.tell("writer w /chatter reliable volatile");
  peer.tell("reader r /orders reliable volatile");
  peer.tell("node /arm/talker");
  Graph graph = join(domain);
  REQUIRE(eventually([&] { return graph.snapshot()->topic("/chatter") != nullptr && graph.snapshot()->node("/arm/talker") != nullptr; }));
  const auto seen = graph.snapshot();
  const Topic& chatter = *seen->topic("/chatter");
  REQUIRE(chatter.writers.size() == 1);
  CHECK(chatter.writers[0].type == string_type);
  CHECK(chatter.writers[0].node == "/arm/talker");
  CHECK(chatter.writers[0].qos.reliable);
  CHECK_FALSE(chatter.writers[0].qos.transient_local);
  CHECK(chatter.writers[0].hash.empty());
  CHECK(seen->topic("/orders")->readers.size() == 1);
  CHECK(seen->topics.size() == 2);

  ReceivedTexts texts;
  const auto subscription = graph.subscribe("/chatter", string_type, texts.sink()).value();
  REQUIRE(eventually([&] {
    peer.tell("write w hello");
    return texts.has("hello");
  }));
  CHECK(texts.last().writer == chatter.writers[0].gid);
  CHECK(texts.last().source.time_since_epoch().count() > 0);
  const auto publisher = graph.advertise("/orders", string_type).value();
  REQUIRE(eventually([&] { return publisher.readers() == 1; }));
  // The reader may match a moment later than this writer: volatile samples before are not for it.
  CHECK(eventually([&] {
    REQUIRE(publisher.publish(text_payload("go")));
    return peer.count("got r go") > 0;
  }));
  CHECK(publisher.publish("x").error().code == Errc::expected_value);
  CHECK(graph.counters().samples >= 1);
  CHECK(graph.counters().participants == 1);
  CHECK(graph.counters().malformed_packets == 0);
}

TEST_CASE("a reader takes the QoS that the writers offer", "[ros2][dds]") {
  const Domain domain;
  Graph graph = join(domain);
  ReceivedTexts map;
  const auto subscription = graph.subscribe("/map", string_type, map.sink()).value();  // nobody writes it yet
  Peer peer = cyclone(domain);
  peer.tell("writer w /map reliable transient_local");
  peer.tell("write w first");
  CHECK(eventually([&] { return map.has("first"); }));  // written before this reader could be found: it is transient local
  // A writer that is best effort and volatile comes: a reader that wanted more would not be matched with it.
  peer.tell("writer w2 /map best_effort volatile");
  CHECK(eventually([&] {
    peer.tell("write w2 second");
    return map.has("second");
  }));
  CHECK(eventually([&] {
    peer.tell("write w third");
    return map.has("third");
  }));
  peer.tell("remove w2");
  peer.tell("write w fourth");
  peer.tell("write w fifth");
  CHECK(eventually([&] { return map.has("fifth"); }));
}

TEST_CASE("a writer that was killed is gone after its lease, and read again when it returns", "[ros2][dds]") {
  const Domain domain;
  Graph graph = join(domain);
  ReceivedTexts texts;
  const auto subscription = graph.subscribe("/chatter", string_type, texts.sink()).value();
  std::atomic<int> changes{0};
  graph.on_change([&] { ++changes; });
  CHECK(eventually([&] { return changes >= 1; }));
  for (const char* word : {"one", "two"}) {
    Peer peer = cyclone(domain, short_lease);
    peer.tell("writer w /chatter reliable volatile");
    peer.tell("node /talker");
    CHECK(eventually([&] {
      peer.tell("write w " + std::string(word));
      return texts.has(word);
    }));
    CHECK(eventually([&] { return graph.snapshot()->node("/talker") != nullptr && graph.snapshot()->topic("/chatter") != nullptr; }));
    const int before = changes;
    peer.kill();
    CHECK(eventually([&] { return graph.snapshot()->topic("/chatter") == nullptr && graph.snapshot()->node("/talker") == nullptr; }));
    CHECK(changes > before);
  }
  CHECK(graph.counters().participants == 0);
  CHECK(graph.counters().endpoints == 0);
}

TEST_CASE("a topic goes with its last writer and reader", "[ros2][dds]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = cyclone(domain);
  peer.tell("writer a /chatter reliable volatile");
  peer.tell("writer b /chatter reliable volatile");
  REQUIRE(eventually([&] { return graph.snapshot()->topic("/chatter") != nullptr && graph.snapshot()->topic("/chatter")->writers.size() == 2; }));
  peer.tell("remove a");
  CHECK(eventually([&] { return graph.snapshot()->topic("/chatter")->writers.size() == 1; }));
  peer.tell("remove b");
  CHECK(eventually([&] { return graph.snapshot()->topic("/chatter") == nullptr; }));
  Peer other = cyclone(domain);
  other.tell("writer a /chatter reliable volatile");
  CHECK(eventually([&] { return graph.snapshot()->topic("/chatter") != nullptr; }));
  other.quit();
  CHECK(eventually([&] { return graph.snapshot()->topic("/chatter") == nullptr; }));
}

TEST_CASE("of two versions of a type one is read, and samples of the other one are counted", "[ros2][dds]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = cyclone(domain);
  peer.tell("writer a /chatter reliable volatile typehash=" + hash_a + ";");
  peer.tell("writer b /chatter reliable volatile typehash=" + hash_b + ";");
  peer.tell("writer c /chatter reliable volatile typehash=nonsense;");
  REQUIRE(eventually([&] { return graph.snapshot()->topic("/chatter") != nullptr && graph.snapshot()->topic("/chatter")->writers.size() == 3; }));
  std::vector<std::string> hashes;
  for (const Endpoint& writer : graph.snapshot()->topic("/chatter")->writers) hashes.push_back(writer.hash);
  std::sort(hashes.begin(), hashes.end());
  CHECK(hashes == std::vector<std::string>{"", hash_a, hash_b});
  ReceivedTexts texts;
  SubscribeOptions options;
  options.hash = hash_a;
  const auto subscription = graph.subscribe("/chatter", string_type, texts.sink(), options).value();
  CHECK(eventually([&] {
    peer.tell("write a from_a");
    peer.tell("write b from_b");
    peer.tell("write c from_c");
    return texts.has("from_a") && texts.has("from_c") && graph.counters().other_version > 0;
  }));
  CHECK_FALSE(texts.has("from_b"));
}

TEST_CASE("a writer of another type of the same topic is not read", "[ros2][dds]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = cyclone(domain);
  peer.tell("writer w /chatter reliable volatile");
  ReceivedTexts texts, others;
  const auto subscription = graph.subscribe("/chatter", string_type, texts.sink()).value();
  const auto other = graph.subscribe("/chatter", "std_msgs/msg/Header", others.sink()).value();
  CHECK(eventually([&] {
    peer.tell("write w hello");
    return texts.all().size() >= 5;
  }));
  CHECK(others.all().empty());
}

TEST_CASE("domains do not see each other", "[ros2][dds]") {
  const Domain here, there;
  Graph graph = join(here), other = join(there);
  Peer peer = cyclone(there), same = cyclone(here);
  peer.tell("writer w /there reliable volatile");
  same.tell("writer w /here reliable volatile");
  CHECK(eventually([&] { return graph.snapshot()->topic("/here") != nullptr && other.snapshot()->topic("/there") != nullptr; }));
  CHECK(graph.snapshot()->topics.size() == 1);
  CHECK(other.snapshot()->topics.size() == 1);
}

TEST_CASE("two graphs of one process see each other", "[ros2][dds]") {
  const Domain domain;
  Graph a = join(domain);
  ros2::GraphOptions options;
  options.node = "/second";
  Graph b = join(domain, std::move(options));
  ReceivedTexts texts;
  const auto subscription = b.subscribe("/chatter", string_type, texts.sink()).value();
  const auto publisher = a.advertise("/chatter", string_type).value();
  CHECK(eventually([&] {
    REQUIRE(publisher.publish(text_payload("hello")));
    return texts.has("hello");
  }));
  CHECK(eventually([&] { return b.snapshot()->topic("/chatter") != nullptr; }));
  CHECK(b.snapshot()->topic("/chatter")->readers.empty());  // its own reader is not in it
}

TEST_CASE("a sink may end its own subscription, and handles may outlive their graph", "[ros2][dds]") {
  const Domain domain;
  Peer peer = cyclone(domain);
  peer.tell("writer w /chatter reliable volatile");
  Subscription subscription, second;
  Publisher publisher;
  std::atomic<int> calls{0}, seconds{0};
  {
    Graph graph = join(domain);
    subscription = graph
                       .subscribe("/chatter", string_type,
                                  [&](Sample&&) {
                                    ++calls;
                                    subscription = Subscription();
                                  })
                       .value();
    second = graph.subscribe("/chatter", string_type, [&](Sample&&) { ++seconds; }).value();
    publisher = graph.advertise("/chatter", string_type).value();
    REQUIRE(eventually([&] {
      peer.tell("write w hello");
      return calls > 0 && seconds > 3;
    }));
    CHECK(calls == 1);
    CHECK(eventually([&] { return graph.counters().subscriptions == 1; }));
  }
  CHECK(publisher.publish(text_payload("late")).error().code == Errc::closed);
  CHECK(publisher.readers() == 0);
}

TEST_CASE("subscriptions are limited, and names are judged", "[ros2][dds]") {
  const Domain domain;
  ros2::GraphOptions options;
  options.limits.max_subscriptions = 2;
  Graph graph = join(domain, std::move(options));
  auto a = graph.subscribe("/a", string_type, [](Sample&&) {}).value();
  auto b = graph.subscribe("/b", string_type, [](Sample&&) {}).value();
  CHECK(graph.subscribe("/c", string_type, [](Sample&&) {}).error().code == Errc::limit_exceeded);
  b = Subscription();
  CHECK(eventually([&] { return graph.subscribe("/c", string_type, [](Sample&&) {}).has_value(); }));
  CHECK(graph.subscribe("c", string_type, [](Sample&&) {}).error().code == Errc::invalid_option);
  CHECK(graph.advertise("/c", "String").error().code == Errc::invalid_option);
  const auto refused = [&](auto change) {
    ros2::GraphOptions wrong;
    wrong.domain = domain.number();
    wrong.interfaces = {"127.0.0.1"};
    change(wrong);
    auto joined = Graph::join(std::move(wrong));
    return !joined && joined.error().code == Errc::invalid_option;
  };
  CHECK(refused([](ros2::GraphOptions& o) { o.domain = 233; }));
  CHECK(refused([](ros2::GraphOptions& o) { o.node = "node"; }));
  CHECK(refused([](ros2::GraphOptions& o) { o.interfaces = {"no_such_interface"}; }));
  CHECK(refused([](ros2::GraphOptions& o) { o.allowed_addresses = {"10.0.0.0/33"}; }));
  CHECK(refused([](ros2::GraphOptions& o) { o.peers = {"robot.example"}; }));
}

TEST_CASE("a topic can be read at a lower rate", "[ros2][dds]") {
  const Domain domain;
  Graph graph = join(domain);
  Peer peer = cyclone(domain);
  peer.tell("writer w /chatter reliable volatile");
  ReceivedTexts all, some;
  const auto every = graph.subscribe("/chatter", string_type, all.sink()).value();
  SubscribeOptions options;
  options.minimum_interval = std::chrono::hours(1);
  const auto slow = graph.subscribe("/chatter", string_type, some.sink(), options).value();
  CHECK(eventually([&] {
    peer.tell("write w hello");
    return all.all().size() >= 10 && !some.all().empty();
  }));
  CHECK(some.all().size() == 1);
}

TEST_CASE("participants are found without multicast, by their addresses, and left out by an allow-list", "[ros2][dds]") {
  const Domain domain;
  ros2::GraphOptions first;
  first.multicast = false;
  first.node = "/first";
  Graph a = join(domain, std::move(first));
  const auto publisher = a.advertise("/chatter", string_type).value();
  ros2::GraphOptions second;
  second.multicast = false;
  second.peers = {"127.0.0.1"};
  Graph b = join(domain, std::move(second));
  CHECK(eventually([&] { return b.snapshot()->topic("/chatter") != nullptr; }));
  ros2::GraphOptions third;
  third.allowed_addresses = {"10.1.2.0/24"};
  third.peers = {"127.0.0.1"};
  Graph c = join(domain, std::move(third));
  CHECK(eventually([&] { return c.counters().refused_participants >= 1; }));
  CHECK(c.counters().participants == 0);
  CHECK(c.snapshot()->topics.empty());
}
