// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <lrt/ros2/graph.hpp>

#include "tests/ros2/graph_support.hpp"
#include "tests/ros2/packets.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;
using namespace lrt::test;

namespace {

constexpr const char* string_type = "std_msgs/msg/String";

/// The ports of UDP that this process has bound.
std::vector<unsigned> own_ports() {
  std::set<std::string> sockets;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    const std::string target = std::filesystem::read_symlink(entry.path(), gone).string();
    if (target.compare(0, 8, "socket:[") == 0) sockets.insert(target.substr(8, target.size() - 9));
  }
  std::vector<unsigned> ports;
  std::ifstream table("/proc/self/net/udp");
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream columns(line);
    std::vector<std::string> words(10);
    for (std::string& word : words) columns >> word;
    if (sockets.count(words[9]) != 0) ports.push_back(static_cast<unsigned>(std::stoul(words[1].substr(words[1].find(':') + 1), nullptr, 16)));
  }
  return ports;
}

/// Sends packets to the ports of the only graph of this process.
class Attacker {
 public:
  explicit Attacker(const Domain& domain) {
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    // Of a domain the ports of a participant are 10 + 2 N and 11 + 2 N; Fast DDS counts N for each participant of the process.
    const unsigned first = 7400 + 250 * domain.number();
    for (const unsigned port : own_ports())
      if (port >= first + 10 && port < first + 250) ports_[port % 2] = static_cast<std::uint16_t>(port);
    if (ports_[0] == 0 || ports_[1] == 0) throw std::runtime_error("the graph has no ports");
  }
  ~Attacker() { ::close(socket_); }
  Attacker(const Attacker&) = delete;
  Attacker& operator=(const Attacker&) = delete;
  /// @param data  to the port for samples, else to that for announcements
  void send(const std::string& packet, bool data = false) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(ports_[data ? 1 : 0]);
    static_cast<void>(::sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to));
  }

 private:
  int socket_;
  std::uint16_t ports_[2]{};
};

std::string locator(std::uint32_t port) { return le32(1) + le32(port) + std::string(12, '\0') + be32(INADDR_LOOPBACK); }
/// An announcement that Fast DDS accepts, with a lease of so many seconds.
std::string announcement(const Prefix& from, std::uint32_t lease, std::uint32_t sequence = 1) {
  return head(from) + data(0x000100c2, sequence,
                           std::string("\0\3\0\0", 4) + parameter(0x15, "\2\1") + parameter(0x16, "\1\20") +
                               parameter(0x50, text(from) + be32(0x1c1)) + parameter(0x32, locator(9)) + parameter(0x31, locator(9)) +
                               parameter(0x02, le32(lease) + le32(0)) + parameter(0x58, le32(0x3f)) + end());
}
std::string writer(const Prefix& from, std::uint32_t number, const std::string& topic) {
  return head(from) + data(0x000003c2, number,
                           std::string("\0\3\0\0", 4) + parameter(0x5a, text(from) + be32(number << 8 | 3U)) + parameter(0x05, name(topic)) +
                               parameter(0x07, name("std_msgs::msg::dds_::String_")) + parameter(0x1a, le32(2) + le32(0) + le32(0)) + end());
}

/// What the writer of announcements of writers has sent so far.
std::string heartbeat(const Prefix& from, std::uint32_t last, std::uint32_t count) {
  return head(from) + submessage(0x07, 1, be32(0) + be32(0x3c2) + le32(0) + le32(1) + le32(0) + le32(last) + le32(count));
}
/// A participant says that it is gone.
std::string farewell(const Prefix& from) {
  const std::string key = std::string("\0\3\0\0", 4) + parameter(0x50, text(from) + be32(0x1c1)) + end();
  return head(from) +
         submessage(0x15, 0x0b, le16(0) + le16(16) + be32(0) + be32(0x100c2) + le32(0) + le32(2) + parameter(0x71, be32(3)) + end() + key);
}

/// Memory of this process.
std::size_t resident_kib() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmRSS:") return status >> word, std::stoul(word);
  return 0;
}

/// Whether a peer that comes now is found, and read.
bool goes_on(const Domain& domain, Graph& graph) {
  Peer peer = cyclone(domain);
  peer.tell("writer w /robot reliable volatile");
  ReceivedTexts texts;
  const auto subscription = graph.subscribe("/robot", string_type, texts.sink()).value();
  return eventually([&] {
    peer.tell("write w hello");
    return texts.has("hello") && graph.snapshot()->topic("/robot") != nullptr;
  });
}

}  // namespace

TEST_CASE("malformed packets are dropped and counted, and the robot goes on", "[ros2][hostile]") {
  const Domain domain;
  Graph graph = join(domain);
  Attacker attacker(domain);
  ReceivedTexts texts;
  const auto subscription = graph.subscribe("/a", string_type, texts.sink()).value();
  std::mt19937 random(11);
  const Prefix from = prefix(1);
  const std::vector<std::string> seeds = {
      announcement(from, 20),
      writer(from, 1, "rt/a"),
      head(from) + data(0x103, 1, text_payload("hello")),
      head(from) + submessage(0x16, 1,
                              le16(0) + le16(28) + be32(0) + be32(0x103) + le32(0) + le32(7) + le32(1) + le16(1) + le16(1000) + le32(9'000) +
                                  std::string(1000, 'x')),
      head(from) + submessage(0x06, 1, be32(0x104) + be32(0x103) + le32(0) + le32(1) + le32(32) + le32(~0U) + le32(1)),
      head(from) + submessage(0x07, 1, be32(0) + be32(0x3c2) + le32(0) + le32(1) + le32(0) + le32(0x7fffffff) + le32(1)),
      head(from) + submessage(0x08, 1, be32(0) + be32(0x103) + le32(0) + le32(1) + le32(0) + le32(9) + le32(256) + std::string(32, '\xff'))};
  attacker.send(announcement(from, 20));
  attacker.send(writer(from, 1, "rt/a"));
  for (int round = 0; round < 12'000; ++round) {
    std::string packet = seeds[random() % seeds.size()];
    const std::size_t intact = random() % 12 == 0 ? 8 : 20;  // who has another name takes a place until its lease ends: not all of them
    for (std::size_t i = random() % 5; i != 0; --i) packet[intact + random() % (packet.size() - intact)] = static_cast<char>(random());
    if (random() % 4 == 0) packet.resize(random() % (packet.size() + 1));
    attacker.send(packet, random() % 2 == 0);
    if (round % 64 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(eventually([&] { return graph.counters().malformed_packets > 500; }));
  CHECK(goes_on(domain, graph));
}

TEST_CASE("participants beyond the limit find no room until others are gone", "[ros2][hostile]") {
  const Domain domain;
  ros2::GraphOptions options;
  options.limits.max_participants = 8;
  Graph graph = join(domain, std::move(options));
  Attacker attacker(domain);
  std::size_t most = 0;
  CHECK(eventually([&] {
    for (int id = 1; id <= 200; ++id) attacker.send(announcement(prefix(static_cast<std::uint8_t>(id)), 2));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    most = std::max(most, graph.counters().participants);
    return most >= 1 && graph.counters().refused_participants >= 20;
  }));
  CHECK(most <= 8);
  CHECK(goes_on(domain, graph));  // their leases end
}

TEST_CASE("a stranger with 10,000 endpoints and long names takes no more than its share, and the robot goes on", "[ros2][hostile]") {
  const Domain domain;
  ros2::GraphOptions options;
  options.limits.max_endpoints_of_participant = 1'000;
  options.limits.max_endpoints = 3'000;
  Graph graph = join(domain, std::move(options));
  Attacker attacker(domain);
  const std::size_t before = resident_kib();
  // Four participants with 2,500 writers each. Fast DDS itself does not take names of more than 252 characters.
  REQUIRE(eventually([&] {
    for (std::uint8_t id = 1; id <= 4; ++id) attacker.send(announcement(prefix(id), 300));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return graph.counters().participants == 4;
  }));
  // Fast DDS processes them in their order: what the system dropped is sent again in the next round. Heartbeats make the reader acknowledge.
  std::uint32_t heartbeats = 0;
  const auto judged = [&] { return graph.counters().refused_endpoints + graph.counters().endpoints; };
  const auto announce = [&] {
    std::uint32_t sent = 0;
    for (std::uint32_t number = 1; number <= 2'500; ++number) {
      std::string topic = "rt/a" + std::to_string(number) + "_";
      topic.resize(250, 'x');
      for (std::uint8_t id = 1; id <= 4; ++id) {
        attacker.send(writer(prefix(id), number, topic));
        if (number % 64 == 0) attacker.send(heartbeat(prefix(id), number, ++heartbeats));
        if (++sent % 16 != 0) continue;
        const auto now = judged();  // not much faster than they are processed
        for (int i = 0; i < 200 && judged() == now; ++i) std::this_thread::yield();
      }
    }
  };
  CHECK(eventually(
      [&] {
        announce();
        return graph.counters().refused_endpoints >= 7'000 && graph.counters().endpoints == 3'000;
      },
      std::chrono::seconds(120)));
  CHECK(graph.counters().endpoints == 3'000);
  // The four have the same names, of which each has at most 1,000.
  CHECK(eventually([&] { return graph.snapshot()->topics.size() >= 750; }));
  CHECK(graph.snapshot()->topics.size() <= 1'000);
  const std::size_t under = resident_kib();
  CHECK(eventually([&] {  // they say goodbye
    for (std::uint8_t id = 1; id <= 4; ++id) attacker.send(farewell(prefix(id)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return graph.counters().endpoints == 0 && graph.counters().participants == 0;
  }));
  CHECK(goes_on(domain, graph));
  std::cout << "10,000 announcements of writers with names of 250 characters: " << before << " KiB before, " << under << " KiB with 3,000 of them, "
            << resident_kib() << " KiB afterwards\n";
}

TEST_CASE("long gaps of a stranger take little memory", "[ros2][hostile]") {
  const Domain domain;
  Graph graph = join(domain);
  Attacker attacker(domain);
  ReceivedTexts texts;
  const auto subscription = graph.subscribe("/a", string_type, texts.sink()).value();
  REQUIRE(eventually([&] {
    attacker.send(announcement(prefix(1), 300));
    attacker.send(writer(prefix(1), 1, "rt/a"));
    attacker.send(head(prefix(1)) + data(0x103, 1, text_payload("hello")), true);
    return texts.has("hello");
  }));
  const std::size_t before = resident_kib();
  // Number 2 is missing, so that each number behind it is kept.
  for (std::uint32_t begin = 3; begin < 60'000'000; begin += 10'000'000)
    attacker.send(head(prefix(1)) + submessage(0x08, 1, be32(0) + be32(0x103) + le32(0) + le32(begin) + le32(0) + le32(begin + 10'000'000) + le32(0)),
                  true);
  CHECK(goes_on(domain, graph));
  std::cout << "gaps of 60,000,000 numbers: " << before << " KiB before, " << resident_kib() << " KiB afterwards\n";
  CHECK(resident_kib() < before + 200'000);
}

TEST_CASE("samples that are too large are dropped and counted, and what comes after them is read", "[ros2][hostile]") {
  const Domain domain;
  ros2::GraphOptions options;
  options.limits.max_sample_bytes = 50'000;
  Graph graph = join(domain, std::move(options));
  Peer peer({LRT_FASTDDS_PEER, std::to_string(domain.number()), std::to_string(long_lease)});
  peer.tell("writer w /large reliable volatile");
  std::atomic<std::size_t> largest{0};
  ReceivedTexts texts;
  const auto subscription =
      graph.subscribe("/large", string_type, [&](Sample&& sample) { largest = std::max(largest.load(), sample.payload->size()); }).value();
  const auto same = graph.subscribe("/large", string_type, texts.sink()).value();
  REQUIRE(eventually([&] {
    peer.tell("write w before");
    return texts.has("before");
  }));
  peer.tell("write_bytes w 60000");  // one packet
  peer.tell("write_bytes w 3000000");
  peer.tell("write_bytes w 40000");
  peer.tell("write w after");
  CHECK(eventually([&] { return texts.has("after"); }));
  CHECK(eventually([&] { return graph.counters().large_samples >= 2; }));
  CHECK(largest < 50'000);
  CHECK(largest > 40'000);
}
