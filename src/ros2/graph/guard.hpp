// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/ros2/graph.hpp>

namespace lrt::ros2 {

using Prefix = std::array<std::uint8_t, 12>;  ///< the identity of a participant: the first bytes of all its gids
inline Prefix prefix_of(const Gid& gid) noexcept {
  Prefix prefix{};
  for (std::size_t i = 0; i < prefix.size(); ++i) prefix[i] = gid.bytes[i];
  return prefix;
}

/// Hashes of gids and prefixes. Strangers choose the bytes, so each process has its own seed.
struct GidHash {
  std::size_t operator()(const Gid& gid) const noexcept;
  std::size_t operator()(const Prefix& prefix) const noexcept;
};

/// A set of IPv4 addresses: "10.0.0.7", "10.0.0.0/24". Empty: all.
class AddressList {
 public:
  /// @par Errors  invalid_option: the entry
  static Result<AddressList> of(const std::vector<std::string>& entries);
  bool empty() const noexcept { return networks_.empty(); }
  bool contains(std::uint32_t address) const noexcept;  ///< @param address  of the host's byte order

 private:
  struct Network {
    std::uint32_t address, mask;
  };
  std::vector<Network> networks_;
};

/// Judges each packet of RTPS before Fast DDS parses it. A domain of DDS has no walls: whoever can send a packet to a port takes
/// part. What the guard does:
/// - A packet that breaks the form of RTPS 2.x, or in which a participant speaks for another one, is dropped.
/// - Packets of addresses that are not allowed, and of participants beyond the limit, are dropped.
/// - Announcements of endpoints beyond the limits, and samples that are too large, become gaps (RTPS 8.3.7.4): their reliable
///   writers do not repeat them, and what comes after them is delivered.
/// - Of announcements only what ROS 2 needs passes: type objects, properties, data sharing and long user data become padding.
/// - What a reader would keep because a number before it is missing is limited: Fast DDS keeps each number of a gap and each announcement, without end.
///   The readers' own acknowledgements say what is missing. What is left out is requested again when it is not.
///
/// @par Threads  Any.
/// @par Time     Samples: one pass over the headers, one look-up. Does not allocate for them.
class Guard {
 public:
  /// Numbers since it was made.
  struct Counters {
    std::atomic<std::uint64_t> malformed{0};             ///< packets
    std::atomic<std::uint64_t> large_samples{0};         ///< each once
    std::atomic<std::uint64_t> refused_participants{0};  ///< each once, as far as the guard remembers them
    std::atomic<std::uint64_t> refused_endpoints{0};     ///< announcements of them
  };
  enum class Verdict : std::uint8_t {
    pass,
    changed,
    drop,
    rekeyed,  ///< changed; not of packets
  };

  Guard(const GraphLimits& limits, AddressList allowed);
  void own(const Prefix& prefix);  ///< Sets the prefix of the own participant; before the first packet from others

  /// Entity of an endpoint of this participant (0: all), and who speaks to it.
  using Heard = std::vector<std::pair<std::uint32_t, Gid>>;
  /// @param from     IPv4 address of the sender, of the host's byte order; 0: this machine, by shared memory
  /// @param changed  Verdict::changed: what takes the packet's place
  /// @param heard    is appended to
  Verdict judge(std::string_view packet, std::uint32_t from, std::string& changed, Heard& heard);
  /// @{
  /// What Fast DDS made of the announcements.
  void participant_known(const Prefix& prefix);
  void participant_gone(const Prefix& prefix);
  void endpoint_gone(const Gid& gid);
  /// @}
  /// @{
  /// That this side is matched with an endpoint does not say that the endpoint is matched with this side: a sample that is written before is not for it. A
  /// writer that is matched sends heartbeats to a reader, a reader that is matched acknowledges to a writer.
  /// @param endpoint  of this participant
  /// @param told      called with a lock: must not call the guard
  void watch(const Gid& endpoint, UniqueFunction<void()> told);
  void unwatch(const Gid& endpoint);
  bool has_heard(const Gid& endpoint, const Gid& from);
  /// A heartbeat as Fast DDS has sent it, once, to a reader that is matched on this side.
  struct Heartbeat {
    std::string packet{};
    std::vector<std::pair<std::uint32_t, std::uint16_t>> to{};  ///< address and port, of the host's byte order
  };
  /// A packet that Fast DDS sends. Heartbeats of watched writers are kept.
  void sent(std::string_view packet, const std::vector<std::pair<std::uint32_t, std::uint16_t>>& to);
  bool is_watching() const noexcept { return watched_.load(std::memory_order_relaxed) != 0; }
  /// Heartbeats that readers ask for in a way that Fast DDS does not respond to (Cyclone: from 1 on, nothing missing).
  std::vector<Heartbeat> wanted_heartbeats(std::string_view packet);
  /// A packet that Fast DDS sends. Acknowledgements of its readers say up to which number all is there.
  void acknowledged(std::string_view packet);
  /// What judge() has heard counts from now on: Fast DDS has processed it and, for example, sent the heartbeat that was requested.
  void count(const Heard& heard);
  /// @}
  const AddressList& allowed() const noexcept { return allowed_; }
  const Counters& counters() const noexcept { return counters_; }
  Counters& counters() noexcept { return counters_; }

 private:
  using TimePoint = std::chrono::steady_clock::time_point;
  struct Participant {
    bool known = false;  ///< Fast DDS has found it
    TimePoint since{};   ///< of its first announcement
    std::size_t endpoints = 0;
  };
  struct Submessage;

  bool is_admitted(const Prefix& prefix);
  bool admit(const Prefix& prefix);
  void refuse(const Prefix& prefix);
  bool admit_endpoint(const Gid& gid);
  Verdict judge_announcement(const Submessage& submessage, bool of_participant, const Prefix& from, std::string& body);
  bool may_skip(std::uint64_t numbers);
  /// The first number that a reader of a writer is missing; reader 0: any of them. 0: none of them has acknowledged anything.
  std::uint64_t missing(const Gid& writer, std::uint32_t reader);
  bool may_keep(const Gid& writer, std::uint32_t reader, std::uint64_t begin, std::uint64_t end, std::uint64_t most);
  bool is_large(const Gid& writer, std::uint64_t sequence);

  const GraphLimits limits_;
  const AddressList allowed_;
  Counters counters_;
  std::mutex mutex_;  ///< protects what follows
  Prefix own_{};
  std::unordered_map<Prefix, Participant, GidHash> participants_;
  std::unordered_set<Gid, GidHash> endpoints_;
  std::uint64_t skips_ = 1U << 20;  ///< numbers of samples that gaps may skip now
  TimePoint skips_at_{};
  std::deque<Prefix> refused_;  ///< the last ones, so that each is counted once
  std::deque<std::pair<Gid, std::uint64_t>> large_;
  /// How far a reader of this participant is with a writer.
  struct Progress {
    std::uint32_t reader = 0;
    std::uint64_t missing = 1;  ///< it has all numbers before
    std::uint64_t kept = 0;     ///< numbers behind that may have been kept, at most
  };
  Progress* progress_of(const Gid& writer, std::uint32_t reader);
  std::unordered_map<Gid, std::vector<Progress>, GidHash> progress_;  ///< by writer; of writers that a reader has acknowledged
  struct Watch {
    UniqueFunction<void()> told;
    std::unordered_set<Gid, GidHash> heard;
    std::unordered_map<Gid, Heartbeat, GidHash> heartbeats;
  };
  std::unordered_map<std::uint32_t, Watch> watches_;  ///< by the entity of the endpoint
  std::atomic<std::size_t> watched_{0};
};

}  // namespace lrt::ros2
