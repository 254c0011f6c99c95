// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/graph/guard.hpp"

#include <cstring>
#include <random>

#include "src/ros2/graph/known.hpp"
#include "tests/ros2/packets.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;
using namespace lrt::test;

namespace {

constexpr std::uint32_t loopback = 0x7f000001;

std::string participant(const Prefix& from) {
  return head(from) + data(0x000100c2, 1,
                           std::string("\0\3\0\0", 4) + parameter(0x50, text(from) + be32(0x1c1)) + parameter(0x2c, le32(4) + "abcd") +
                               parameter(0x59, "properties") + end());
}
std::string endpoint(const Prefix& from, std::uint32_t entity, const std::string& topic = "rt/a", const Prefix* of = nullptr) {
  return head(from) + data(0x000003c2, entity,
                           std::string("\0\3\0\0", 4) + parameter(0x5a, text(of == nullptr ? from : *of) + be32(entity << 8 | 3U)) +
                               parameter(0x05, name(topic)) + parameter(0x07, name("t")) + parameter(0x75, "type object") + end());
}
std::string fragment(const Prefix& from, std::uint32_t total, unsigned size, std::uint32_t first = 1) {
  return head(from) + submessage(0x16, 1,
                                 le16(0) + le16(28) + be32(0) + be32(0x103) + le32(0) + le32(7) + le32(first) + le16(1) + le16(size) + le32(total) +
                                     std::string(size, 'x'));
}

/// What a reader of this participant sends.
std::string acknowledgement(std::uint32_t reader, const Prefix& to, std::uint32_t writer, std::uint32_t missing) {
  return head(prefix(0xff)) + submessage(0x0e, 1, text(to)) +
         submessage(0x06, 1, be32(reader) + be32(writer) + le32(0) + le32(missing) + le32(0) + le32(1));
}

struct Judge {
  Guard guard;
  std::string changed{};
  Guard::Heard heard{};
  explicit Judge(const GraphLimits& limits = {}, const std::vector<std::string>& allowed = {}) : guard(limits, AddressList::of(allowed).value()) {
    guard.own(prefix(0xff));
  }
  Guard::Verdict operator()(const std::string& packet, std::uint32_t from = loopback) { return guard.judge(packet, from, changed, heard); }
};
using V = Guard::Verdict;

}  // namespace

TEST_CASE("who has not announced itself is not heard", "[ros2][guard]") {
  Judge judge;
  CHECK(judge(endpoint(prefix(1), 1)) == V::drop);
  CHECK(judge(head(prefix(1)) + data(0x103, 1, std::string(8, '\0'))) == V::drop);
  CHECK(judge(participant(prefix(1))) == V::changed);
  CHECK(judge(head(prefix(1)) + data(0x103, 1, std::string(8, '\0'))) == V::pass);
}

TEST_CASE("of an announcement only what ROS 2 needs passes", "[ros2][guard]") {
  Judge judge;
  REQUIRE(judge(participant(prefix(1))) == V::changed);
  CHECK(judge.changed.find(parameter(0x59, "properties")) == std::string::npos);
  CHECK(judge.changed.find(parameter(0, "properties")) != std::string::npos);  // padding
  CHECK(judge.changed.find(parameter(0x2c, le32(4) + "abcd")) != std::string::npos);
  REQUIRE(judge(endpoint(prefix(1), 1)) == V::changed);
  CHECK(judge.changed.find(parameter(0x75, "type object")) == std::string::npos);
  CHECK(judge.changed.size() == endpoint(prefix(1), 1).size());
}

TEST_CASE("participants are limited, and make room when they go", "[ros2][guard]") {
  GraphLimits limits;
  limits.max_participants = 2;
  Judge judge(limits);
  for (std::uint8_t i = 1; i <= 2; ++i) CHECK(judge(participant(prefix(i))) == V::changed);
  for (int again = 0; again < 3; ++again) CHECK(judge(participant(prefix(3))) == V::drop);
  CHECK(judge.guard.counters().refused_participants == 1);  // each once
  CHECK(judge(participant(prefix(1))) == V::changed);
  judge.guard.participant_known(prefix(1));
  judge.guard.participant_gone(prefix(1));
  CHECK(judge(participant(prefix(3))) == V::changed);
}

TEST_CASE("endpoints are limited for each participant and in all, and the ones beyond become gaps", "[ros2][guard]") {
  GraphLimits limits;
  limits.max_endpoints = 5;
  limits.max_endpoints_of_participant = 3;
  Judge judge(limits);
  judge(participant(prefix(1)));
  judge(participant(prefix(2)));
  const auto is_gap = [&](const std::string& packet) {
    return judge(packet) == V::changed && judge.changed.size() == packet.size() && judge.changed[20] == 0x08;
  };
  for (std::uint32_t i = 1; i <= 3; ++i) CHECK_FALSE(is_gap(endpoint(prefix(1), i)));
  const std::string beyond = endpoint(prefix(1), 4);
  CHECK(is_gap(beyond));
  // reader, writer, the number of the sample, the next one, no further ones
  CHECK(judge.changed.substr(24, 28) == be32(0) + be32(0x3c2) + le32(0) + le32(4) + le32(0) + le32(5) + le32(0));
  CHECK_FALSE(is_gap(endpoint(prefix(1), 2)));  // a change of a known one
  for (std::uint32_t i = 1; i <= 2; ++i) CHECK_FALSE(is_gap(endpoint(prefix(2), i)));
  CHECK(is_gap(endpoint(prefix(2), 3)));
  CHECK(judge.guard.counters().refused_endpoints == 2);
  Gid gone{};
  std::memcpy(gone.bytes.data(), prefix(1).data(), 12);
  gone.bytes[14] = 1;
  gone.bytes[15] = 3;
  judge.guard.endpoint_gone(gone);
  CHECK_FALSE(is_gap(endpoint(prefix(2), 3)));
  CHECK(is_gap(endpoint(prefix(1), 9, std::string(300, 'a'))));  // a name that is too long
}

TEST_CASE("nobody speaks for another participant", "[ros2][guard]") {
  Judge judge;
  judge(participant(prefix(1)));
  judge(participant(prefix(2)));
  const Prefix other = prefix(2);
  CHECK(judge(endpoint(prefix(1), 1, "rt/a", &other)) == V::changed);
  CHECK(judge.changed[20] == 0x08);
  const std::string relayed = submessage(0x0c, 1, std::string(8, '\0') + text(prefix(2)));
  CHECK(judge(head(prefix(1)) + relayed) == V::drop);
  // The end of an endpoint of another participant.
  const std::string ended = submessage(0x15, 3,
                                       le16(0) + le16(16) + be32(0) + be32(0x3c2) + le32(0) + le32(9) +
                                           parameter(0x70, text(prefix(2)) + be32(0x103)) + parameter(0x71, be32(3)) + end());
  CHECK(judge(head(prefix(1)) + ended) == V::drop);
  CHECK(judge(head(prefix(2)) + ended) == V::pass);
  // Announcements in the name of this participant.
  CHECK(judge(participant(prefix(0xff))) != V::pass);
}

TEST_CASE("the key of an endpoint of Cyclone that ends moves to where Fast DDS reads it", "[ros2][guard]") {
  Judge judge;
  judge(participant(prefix(1)));
  const std::string key = std::string("\0\3\0\0", 4) + parameter(0x5a, text(prefix(1)) + be32(0x103)) + end();
  const std::string packet =
      head(prefix(1)) +
      submessage(0x15, 0x0b, le16(0) + le16(16) + be32(0) + be32(0x3c2) + le32(0) + le32(9) + parameter(0x71, be32(3)) + end() + key);
  REQUIRE(judge(packet) == V::changed);
  CHECK(judge.changed.size() == packet.size());
  CHECK(judge.changed[21] == 0x03);  // inline QoS, no key
  CHECK(judge.changed.substr(44, 32) == parameter(0x71, be32(3)) + parameter(0x70, text(prefix(1)) + be32(0x103)) + end());
}

TEST_CASE("a sample that is too large becomes a gap and is counted once", "[ros2][guard]") {
  GraphLimits limits;
  limits.max_sample_bytes = 100'000;
  Judge judge(limits);
  judge(participant(prefix(1)));
  CHECK(judge(fragment(prefix(1), 100'000, 1000)) == V::pass);
  CHECK(judge(fragment(prefix(1), 100'001, 1000)) == V::changed);
  CHECK(judge.changed[20] == 0x08);
  CHECK(judge(fragment(prefix(1), 100'001, 1000, 2)) == V::changed);
  CHECK(judge.guard.counters().large_samples == 1);
  CHECK(judge(fragment(prefix(1), 1000, 4)) == V::drop);  // Fast DDS keeps numbers in the place of missing fragments
  CHECK(judge(fragment(prefix(1), 1000, 1000, 2)) == V::drop);
  CHECK(judge(fragment(prefix(1), 1000, 1000, 0)) == V::drop);
}

TEST_CASE("one packet cannot make Fast DDS count for hours", "[ros2][guard]") {
  Judge judge;
  judge(participant(prefix(1)));
  const auto gap = [](std::uint32_t high, std::uint32_t low) {
    return head(prefix(1)) + submessage(0x08, 1, be32(0) + be32(0x103) + le32(0) + le32(1) + le32(high) + le32(low) + le32(0));
  };
  const auto end_of_gap = [&] { return judge.changed.substr(40, 8); };
  CHECK(judge(gap(0, 5)) == V::pass);
  // A reader that comes late to a fast topic: a part passes, the rest is requested again.
  CHECK(judge(gap(0, 50'000'000)) == V::changed);
  CHECK(end_of_gap() == le32(0) + le32(1 + (1U << 16)));
  judge.guard.acknowledged(acknowledgement(0x107, prefix(1), 0x103, 1 + (1U << 16)));
  CHECK(judge(gap(0, 50'000'000)) == V::changed);
  CHECK(end_of_gap() == le32(0) + le32(1 + (2U << 16)));
  bool is_refused = false;  // each number is a step: not without end
  for (int i = 0; i < 20 && !is_refused; ++i) is_refused = judge(gap(1, 0)) == V::drop;
  CHECK(is_refused);
  CHECK(judge(gap(0, 0)) == V::drop);
  CHECK(judge(gap(0, 6)) != V::drop);
}

TEST_CASE("numbers behind a missing one are limited, and pass again when it has come", "[ros2][guard]") {
  Judge judge;
  judge(participant(prefix(1)));
  const auto gap = [](std::uint32_t first, std::uint32_t end) {
    return head(prefix(1)) + submessage(0x08, 1, be32(0) + be32(0x103) + le32(0) + le32(first) + le32(0) + le32(end) + le32(0));
  };
  const auto passes = [&](const std::string& packet) {
    const V verdict = judge(packet);
    return verdict == V::pass || (verdict == V::changed && judge.changed[20] == packet[20]);
  };
  judge.guard.acknowledged(acknowledgement(0x107, prefix(1), 0x103, 2));
  CHECK(passes(gap(3, 200)));  // as many as are requested at a time
  CHECK_FALSE(passes(gap(3, 60'000'000)));
  CHECK(passes(gap(1'000, 1'900)));
  CHECK_FALSE(passes(gap(5'000, 5'900)));  // together more than 1,024
  judge.guard.acknowledged(acknowledgement(0x107, prefix(1), 0x103, 1'900));
  CHECK(passes(gap(5'000, 5'900)));
  CHECK(passes(gap(1'900, 60'000'000)));  // in a row
  // What is there is not counted again, whatever a heartbeat has made of it.
  judge.guard.acknowledged(acknowledgement(0x107, prefix(1), 0x103, 4'000'000'000));
  CHECK_FALSE(passes(gap(1, 4'000'000'000)));
  CHECK(judge(gap(1, 4'000'000'005)) == V::changed);
  CHECK(judge.changed.substr(32, 8) == le32(0) + le32(4'000'000'000));
  // An announcement waits for the one before, also if it is of a known endpoint.
  const auto announcement = [](std::uint32_t number) {
    return head(prefix(1)) + data(0x000003c2, number,
                                  std::string("\0\3\0\0", 4) + parameter(0x5a, text(prefix(1)) + be32(0x703)) + parameter(0x05, name("rt/a")) +
                                      parameter(0x07, name("t")) + end());
  };
  judge.guard.acknowledged(acknowledgement(0x3c7, prefix(1), 0x3c2, 1));
  std::size_t passed = 0;
  for (std::uint32_t number = 2; number < 6'000; ++number) passed += passes(announcement(number)) ? 1 : 0;
  CHECK(passed >= 2'048);
  CHECK(passed < 2'500);
  CHECK(passes(announcement(1)));
  judge.guard.acknowledged(acknowledgement(0x3c7, prefix(1), 0x3c2, 2'400));
  CHECK(passes(announcement(2'400)));
  CHECK(passes(announcement(4'000)));
  judge.guard.participant_gone(prefix(1));
  judge.guard.acknowledged(std::string(60, '\xff'));
}

TEST_CASE("addresses that are not allowed are not heard", "[ros2][guard]") {
  Judge judge({}, {"10.0.0.0/24", "192.168.1.7"});
  CHECK(judge(participant(prefix(1)), 0x0a000007) == V::changed);
  CHECK(judge(participant(prefix(2)), 0x0a000107) == V::drop);
  CHECK(judge(participant(prefix(3)), 0xc0a80107) == V::changed);
  CHECK(judge(participant(prefix(4)), loopback) == V::drop);
  CHECK(judge(participant(prefix(5)), 0) == V::drop);  // shared memory is this machine
  CHECK(judge.guard.counters().refused_participants == 3);
  for (const char* entry : {"", "10.0.0", "10.0.0.0/", "10.0.0.0/33", "10.0.0.0/-1", "::1", "a"}) {
    CAPTURE(entry);
    CHECK(AddressList::of({entry}).error().code == Errc::invalid_option);
  }
}

TEST_CASE("no packet makes the guard read or write beyond it", "[ros2][guard]") {
  Judge judge;
  std::mt19937 random(7);
  const std::vector<std::string> seeds = {participant(prefix(1)),
                                          endpoint(prefix(1), 1),
                                          fragment(prefix(1), 5000, 1000),
                                          head(prefix(1)) + submessage(0x06, 1, std::string(28, '\1')),
                                          head(prefix(1)) + submessage(0x07, 1, std::string(28, '\1')),
                                          head(prefix(1)) + submessage(0x08, 1, std::string(32, '\1')),
                                          head(prefix(1)) + submessage(0x12, 1, std::string(32, '\1'))};
  for (int round = 0; round < 40'000; ++round) {
    std::string packet = seeds[random() % seeds.size()];
    for (std::size_t i = random() % 6; i != 0; --i) packet[random() % packet.size()] = static_cast<char>(random());
    if (random() % 3 == 0) packet.resize(random() % (packet.size() + 1));
    if (random() % 8 == 0) packet += seeds[random() % seeds.size()].substr(20);
    // A copy of its own size, so that sanitizers see what lies beyond.
    const std::vector<char> exact(packet.begin(), packet.end());
    const std::string_view view(exact.data(), exact.size());
    judge.heard.clear();
    const V verdict = judge.guard.judge(view, loopback, judge.changed, judge.heard);
    if (verdict == V::changed && judge.changed.size() != packet.size()) FAIL("a packet has changed its size");
    if (verdict == V::pass || verdict == V::changed) static_cast<void>(judge.guard.wanted_heartbeats(view));
    judge.guard.sent(view, {});
  }
  CHECK(judge.guard.counters().malformed > 1'000);
}

TEST_CASE("nodes are read with Gids of 16 and of 24 bytes", "[ros2][guard]") {
  Gid own{}, reader{}, writer{};
  own.bytes[0] = reader.bytes[0] = writer.bytes[0] = 1;
  reader.bytes[15] = 4;
  writer.bytes[15] = 3;
  const std::vector<NodeEntities> nodes = {{"/a", {reader}, {writer, writer}}, {"/arm/driver", {}, {}}, {"/b", {reader, reader, reader}, {}}};
  for (const std::size_t gid_bytes : {std::size_t{16}, std::size_t{24}}) {
    for (std::size_t count = 0; count <= nodes.size(); ++count) {
      CAPTURE(gid_bytes, count);
      const std::vector<NodeEntities> some(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(count));
      const std::string payload = write_entities(own, some, gid_bytes);
      const auto read = read_entities(payload, GraphLimits{});
      REQUIRE(read);
      CHECK(read->gid_bytes == gid_bytes);
      REQUIRE(read->nodes.size() == count);
      for (std::size_t i = 0; i < count; ++i) {
        CHECK(read->nodes[i].name == nodes[i].name);
        CHECK(read->nodes[i].readers == nodes[i].readers);
        CHECK(read->nodes[i].writers == nodes[i].writers);
      }
      for (std::size_t cut = 1; cut < payload.size(); ++cut) {
        const auto less = read_entities(std::string_view(payload).substr(0, payload.size() - cut), GraphLimits{});
        if (less && less->gid_bytes == gid_bytes && !less->nodes.empty()) FAIL("a cut payload was read");
      }
    }
  }
}
