// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/graph/guard.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cstring>

#include "src/base/random.hpp"

namespace lrt::ros2 {

namespace {

constexpr std::size_t remembered = 256;       ///< refused participants and large samples
constexpr std::chrono::seconds patience{10};  ///< for an announced participant that Fast DDS does not find
/// Numbers behind a missing one that pass anyway (a request has 256), and what a reader may keep of a writer beyond that.
constexpr std::uint64_t near = 256, most_of_gaps = 1'024, most_of_announcements = 2'048;
constexpr std::uint64_t longest_gap = 1U << 16;             ///< numbers; the rest is requested again
constexpr std::size_t most_readers = 64;                    ///< of one writer, whose progress is known
constexpr std::uint32_t smallest_fragment = 32;             ///< bytes; known middlewares send more than 1,000
constexpr std::uint32_t participants_writer = 0x000100c2U;  ///< entity of SPDP
constexpr std::uint32_t publications_writer = 0x000003c2U;  ///< entities of SEDP
constexpr std::uint32_t subscriptions_writer = 0x000004c2U;

enum : std::uint8_t {
  id_pad = 0x01,
  id_acknack = 0x06,
  id_heartbeat = 0x07,
  id_gap = 0x08,
  id_info_ts = 0x09,
  id_info_src = 0x0c,
  id_info_reply_ip4 = 0x0d,
  id_info_dst = 0x0e,
  id_info_reply = 0x0f,
  id_nack_frag = 0x12,
  id_heartbeat_frag = 0x13,
  id_data = 0x15,
  id_data_frag = 0x16,
};

/// Parameters of announcements that pass: without the bits "must understand" and, but for one, those of vendors.
bool is_needed(std::uint16_t pid, bool of_participant) noexcept {
  if ((pid & 0x8000U) != 0) return false;
  switch (pid & 0x3fffU) {
    case 0x0001:  // end
    case 0x0015:  // version of the protocol
    case 0x0016:  // vendor
    case 0x002c:  // user data
    case 0x0050:  // participant
    case 0x0070:  // hash of the key
    case 0x0071:  // status
    case 0x0043:  // expects inline QoS
      return true;
    case 0x0002:  // lease
    case 0x0031:  // locators: default, of announcements, multicast ones
    case 0x0032:
    case 0x0033:
    case 0x0048:
    case 0x0044:  // built-in endpoints
    case 0x0058:
    case 0x0062:  // name
    case 0x0034:  // count of assertions of liveliness
      return of_participant;
    case 0x0004:  // time-based filter
    case 0x0005:  // name of the topic
    case 0x0006:  // strength of ownership
    case 0x0007:  // name of the type
    case 0x001a:  // reliability
    case 0x001b:  // liveliness
    case 0x001d:  // durability
    case 0x001e:  // its service
    case 0x001f:  // ownership
    case 0x0021:  // presentation
    case 0x0023:  // deadline
    case 0x0025:  // order of destination
    case 0x0027:  // latency
    case 0x0029:  // partition
    case 0x002b:  // lifespan
    case 0x002f:  // locators
    case 0x0030:
    case 0x0040:  // history
    case 0x0041:  // limits of resources
    case 0x0052:  // group
    case 0x005a:  // endpoint
    case 0x0060:  // largest size of the type
    case 0x0073:  // representation of data
    case 0x0074:  // consistency of types
      return !of_participant;
    default: return false;
  }
}

std::uint16_t u16(const unsigned char* at, bool little) noexcept {
  return little ? static_cast<std::uint16_t>(at[0] | at[1] << 8) : static_cast<std::uint16_t>(at[0] << 8 | at[1]);
}
std::uint32_t u32(const unsigned char* at, bool little) noexcept {
  return little ? std::uint32_t{u16(at, true)} | std::uint32_t{u16(at + 2, true)} << 16
                : std::uint32_t{u16(at, false)} << 16 | std::uint32_t{u16(at + 2, false)};
}
/// A sequence number: the high half comes first in both byte orders.
std::uint64_t u64(const unsigned char* at, bool little) noexcept { return std::uint64_t{u32(at, little)} << 32 | u32(at + 4, little); }
/// An entity: always of the order of the network.
std::uint32_t entity(const unsigned char* at) noexcept { return u32(at, false); }
void put32(unsigned char* at, std::uint32_t value, bool little) noexcept {
  for (unsigned i = 0; i < 4; ++i) at[i] = static_cast<unsigned char>(value >> (little ? 8 * i : 8 * (3 - i)));
}
unsigned char* writable(std::string& bytes, std::size_t at) noexcept { return reinterpret_cast<unsigned char*>(bytes.data()) + at; }

/// Where a list of parameters ends; nullopt: it does not, or is malformed.
template <class F>
std::optional<std::size_t> each_parameter(const unsigned char* bytes, std::size_t begin, std::size_t end, bool little, F&& f) {
  while (begin + 4 <= end) {
    const std::uint16_t pid = u16(bytes + begin, little), length = u16(bytes + begin + 2, little);
    if ((pid & 0x3fffU) == 1 && (pid & 0x8000U) == 0) return begin + 4;
    if (length % 4 != 0 || begin + 4 + length > end) return std::nullopt;
    f(pid, begin, length);
    begin += 4U + length;
  }
  return std::nullopt;
}

/// Whether a set of numbers is well formed: base, count of bits, bits.
bool is_set(const unsigned char* bytes, std::size_t length, std::size_t base, bool little) noexcept {
  if (length < base + 4) return false;
  const std::uint32_t bits = u32(bytes + base, little);
  return bits <= 256 && length >= base + 4 + (bits + 31) / 32 * 4;
}

}  // namespace

std::size_t GidHash::operator()(const Gid& gid) const noexcept {
  static const std::uint64_t seed = [] {
    unsigned char bytes[8];
    fill_random(bytes, sizeof bytes);
    std::uint64_t number = 0;
    std::memcpy(&number, bytes, sizeof number);
    return number | 1U;
  }();
  std::uint64_t hash = seed;
  for (std::size_t i = 0; i < gid.bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, gid.bytes.data() + i, sizeof word);
    hash = (hash ^ word) * 0x9e3779b97f4a7c15ULL;
    hash ^= hash >> 29 ^ seed;
  }
  return static_cast<std::size_t>(hash ^ hash >> 32);
}
std::size_t GidHash::operator()(const Prefix& prefix) const noexcept {
  Gid gid{};
  std::memcpy(gid.bytes.data(), prefix.data(), prefix.size());
  return (*this)(gid);
}

Result<AddressList> AddressList::of(const std::vector<std::string>& entries) {
  AddressList list;
  for (const std::string& entry : entries) {
    const auto slash = entry.find('/');
    in_addr address{};
    unsigned bits = 32;
    bool valid = ::inet_pton(AF_INET, entry.substr(0, slash).c_str(), &address) == 1;
    if (slash != std::string::npos) {
      const std::string count = entry.substr(slash + 1);
      valid = valid && !count.empty() && count.size() <= 2 && count.find_first_not_of("0123456789") == std::string::npos;
      if (valid) bits = static_cast<unsigned>(std::stoul(count));
    }
    if (!valid || bits > 32)
      return unexpected(Errc::invalid_option, "\"" + entry + "\" is no IPv4 address or network: expected \"10.0.0.7\" or \"10.0.0.0/24\"");
    const std::uint32_t mask = bits == 0 ? 0 : ~std::uint32_t{0} << (32 - bits);
    list.networks_.push_back({ntohl(address.s_addr) & mask, mask});
  }
  return list;
}

bool AddressList::contains(std::uint32_t address) const noexcept {
  return networks_.empty() || std::any_of(networks_.begin(), networks_.end(), [&](const Network& n) { return (address & n.mask) == n.address; });
}

Guard::Guard(const GraphLimits& limits, AddressList allowed) : limits_(limits), allowed_(std::move(allowed)) {}

void Guard::own(const Prefix& prefix) {
  const std::lock_guard<std::mutex> lock(mutex_);
  own_ = prefix;
}

bool Guard::is_admitted(const Prefix& prefix) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return prefix == own_ || participants_.count(prefix) != 0;
}

bool Guard::admit(const Prefix& prefix) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (prefix == own_) return false;
  if (participants_.count(prefix) != 0) return true;
  const TimePoint now = std::chrono::steady_clock::now();
  if (participants_.size() >= limits_.max_participants) {
    for (auto it = participants_.begin(); it != participants_.end();) {
      if (!it->second.known && now - it->second.since > patience) it = participants_.erase(it);
      else ++it;
    }
    if (participants_.size() >= limits_.max_participants) {
      refuse(prefix);
      return false;
    }
  }
  participants_.emplace(prefix, Participant{false, now, 0});
  return true;
}

/// @pre  locked
void Guard::refuse(const Prefix& prefix) {
  if (std::find(refused_.begin(), refused_.end(), prefix) != refused_.end()) return;
  ++counters_.refused_participants;
  refused_.push_back(prefix);
  if (refused_.size() > remembered) refused_.pop_front();
}

bool Guard::admit_endpoint(const Gid& gid) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (endpoints_.count(gid) != 0) return true;
  const auto participant = participants_.find(prefix_of(gid));
  if (participant == participants_.end() || participant->second.endpoints >= limits_.max_endpoints_of_participant ||
      endpoints_.size() >= limits_.max_endpoints) {
    ++counters_.refused_endpoints;
    return false;
  }
  endpoints_.insert(gid);
  ++participant->second.endpoints;
  return true;
}

void Guard::participant_known(const Prefix& prefix) {
  const std::lock_guard<std::mutex> lock(mutex_);
  participants_[prefix].known = true;
}

void Guard::participant_gone(const Prefix& prefix) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto participant = participants_.find(prefix);
  if (participant == participants_.end()) return;
  if (participant->second.endpoints != 0) {
    for (auto it = endpoints_.begin(); it != endpoints_.end();) {
      if (prefix_of(*it) == prefix) it = endpoints_.erase(it);
      else ++it;
    }
  }
  for (auto it = progress_.begin(); it != progress_.end();) {
    if (prefix_of(it->first) == prefix) it = progress_.erase(it);
    else ++it;
  }
  participants_.erase(participant);
}

void Guard::endpoint_gone(const Gid& gid) {
  const std::lock_guard<std::mutex> lock(mutex_);
  progress_.erase(gid);
  if (endpoints_.erase(gid) == 0) return;
  const auto participant = participants_.find(prefix_of(gid));
  if (participant != participants_.end() && participant->second.endpoints != 0) --participant->second.endpoints;
}

namespace {
std::uint32_t entity_of(const Gid& gid) noexcept { return entity(gid.bytes.data() + 12); }
}  // namespace

void Guard::watch(const Gid& endpoint, UniqueFunction<void()> told) {
  const std::lock_guard<std::mutex> lock(mutex_);
  watches_[entity_of(endpoint)].told = std::move(told);
  watched_ = watches_.size();
}

void Guard::unwatch(const Gid& endpoint) {
  const std::lock_guard<std::mutex> lock(mutex_);
  watches_.erase(entity_of(endpoint));
  watched_ = watches_.size();
}

bool Guard::has_heard(const Gid& endpoint, const Gid& from) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto watch = watches_.find(entity_of(endpoint));
  return watch != watches_.end() && watch->second.heard.count(from) != 0;
}

void Guard::sent(std::string_view packet, const std::vector<std::pair<std::uint32_t, std::uint16_t>>& to) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(packet.data());
  Gid reader{};
  for (std::size_t at = 20; at + 4 <= packet.size();) {
    const bool little = (bytes[at + 1] & 1U) != 0;
    std::size_t length = u16(bytes + at + 2, little);
    if (length == 0) length = packet.size() - at - 4;
    if (at + 4 + length > packet.size()) return;
    if (bytes[at] == id_info_dst && length >= 12) std::memcpy(reader.bytes.data(), bytes + at + 4, 12);
    if (bytes[at] == id_data || bytes[at] == id_data_frag) return;  // it is never sent twice
    if (bytes[at] == id_heartbeat && length >= 28 && (bytes[at + 11] & 0xc0U) == 0) {
      std::memcpy(reader.bytes.data() + 12, bytes + at + 4, 4);
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto watch = watches_.find(entity(bytes + at + 8));
      if (watch == watches_.end()) return;
      if (watch->second.heartbeats.size() >= remembered) watch->second.heartbeats.clear();
      watch->second.heartbeats[reader] = Heartbeat{std::string(packet), to};
      return;
    }
    at += 4 + length;
  }
}

std::vector<Guard::Heartbeat> Guard::wanted_heartbeats(std::string_view packet) {
  std::vector<Heartbeat> wanted;
  const auto* const bytes = reinterpret_cast<const unsigned char*>(packet.data());
  for (std::size_t at = 20; at + 4 <= packet.size();) {  // judge() has seen it: it is well formed
    const bool little = (bytes[at + 1] & 1U) != 0;
    std::size_t length = u16(bytes + at + 2, little);
    if (length == 0 && bytes[at] != id_pad && bytes[at] != id_info_ts) length = packet.size() - at - 4;
    if (at + 4 + length > packet.size()) break;
    if (bytes[at] == id_acknack && (bytes[at + 1] & 2U) == 0 && length >= 24 && u32(bytes + at + 20, little) == 0) {
      Gid reader{};
      std::memcpy(reader.bytes.data(), bytes + 8, 12);
      std::memcpy(reader.bytes.data() + 12, bytes + at + 4, 4);
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto watch = watches_.find(entity(bytes + at + 8));
      if (watch != watches_.end() && watch->second.heard.count(reader) == 0) {
        const auto heartbeat = watch->second.heartbeats.find(reader);
        if (heartbeat != watch->second.heartbeats.end()) wanted.push_back(heartbeat->second);
      }
    }
    at += 4 + length;
  }
  return wanted;
}

void Guard::count(const Heard& heard) {
  if (heard.empty()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [to, from] : heard) {
    for (auto& [watched, watch] : watches_) {
      if (to != 0 && watched != to) continue;
      if (watch.heard.size() >= limits_.max_endpoints_of_participant) watch.heard.clear();
      if (watch.heard.insert(from).second) watch.told();
    }
  }
}

/// Fast DDS takes a step for each number in a gap, with a lock of the reader: one packet could stop it for hours. A reader that comes late to a fast
/// topic needs a long gap once.
bool Guard::may_skip(std::uint64_t numbers) {
  constexpr std::uint64_t most = 1U << 20, each_second = 1U << 18;
  const std::lock_guard<std::mutex> lock(mutex_);
  const TimePoint now = std::chrono::steady_clock::now();
  if (skips_at_ != TimePoint{}) {
    const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(now - skips_at_).count();
    skips_ = std::min(most, skips_ + static_cast<std::uint64_t>(std::min<std::int64_t>(passed, 20'000)) * each_second / 1000);
  }
  skips_at_ = now;
  if (numbers > skips_) return false;
  skips_ -= numbers;
  return true;
}

/// @pre  locked
Guard::Progress* Guard::progress_of(const Gid& writer, std::uint32_t reader) {
  const auto known = progress_.find(writer);
  if (known == progress_.end()) return nullptr;
  Progress* found = nullptr;
  for (Progress& one : known->second)
    if ((reader == 0 || one.reader == reader) && (found == nullptr || one.missing < found->missing)) found = &one;
  return found;
}

void Guard::acknowledged(std::string_view packet) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(packet.data());
  Gid writer{};
  for (std::size_t at = 20; at + 4 <= packet.size();) {
    const bool little = (bytes[at + 1] & 1U) != 0;
    std::size_t length = u16(bytes + at + 2, little);
    if (length == 0 && bytes[at] != id_pad && bytes[at] != id_info_ts) length = packet.size() - at - 4;
    if (at + 4 + length > packet.size()) return;
    if (bytes[at] == id_info_dst && length >= 12) std::memcpy(writer.bytes.data(), bytes + at + 4, 12);
    if (bytes[at] == id_acknack && length >= 24) {
      std::memcpy(writer.bytes.data() + 12, bytes + at + 8, 4);
      const std::uint32_t reader = entity(bytes + at + 4);
      const std::uint64_t missing = std::max<std::uint64_t>(u64(bytes + at + 12, little), 1);
      const std::lock_guard<std::mutex> lock(mutex_);
      if (participants_.count(prefix_of(writer)) != 0) {
        Progress* progress = progress_of(writer, reader);
        if (progress == nullptr) {
          std::vector<Progress>& all = progress_[writer];
          if (all.size() >= most_readers) all.erase(all.begin());
          all.push_back(Progress{reader, 1, 0});
          progress = &all.back();
        }
        if (missing > progress->missing) {
          progress->kept -= std::min(progress->kept, missing - progress->missing);
          progress->missing = missing;
        }
      }
    }
    at += 4 + length;
  }
}

std::uint64_t Guard::missing(const Gid& writer, std::uint32_t reader) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Progress* const progress = progress_of(writer, reader);
  return progress == nullptr ? 0 : progress->missing;
}

/// Whether a reader may be given the numbers from `begin` to before `end`. Without a reader that acknowledges, nobody keeps them.
bool Guard::may_keep(const Gid& writer, std::uint32_t reader, std::uint64_t begin, std::uint64_t end, std::uint64_t most) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Progress* const progress = progress_of(writer, reader);
  if (progress == nullptr) return end - begin <= near;
  if (end <= progress->missing + near) return true;
  const std::uint64_t numbers = end - std::max(begin, progress->missing);
  if (numbers > most || progress->kept + numbers > most) return false;
  progress->kept += numbers;
  return true;
}

bool Guard::is_large(const Gid& writer, std::uint64_t sequence) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::pair<Gid, std::uint64_t> sample{writer, sequence};
  if (std::find(large_.begin(), large_.end(), sample) == large_.end()) {
    ++counters_.large_samples;
    large_.push_back(sample);
    if (large_.size() > remembered) large_.pop_front();
  }
  return true;
}

/// One DATA of discovery.
struct Guard::Submessage {
  const unsigned char* body;
  std::size_t length;
  std::size_t payload;  ///< where it begins in `body`
  bool has_data;        ///< and not only a key
  bool little;
  bool has_key_hash;         ///< in its inline QoS
  std::uint32_t status = 0;  ///< there: 1 disposed, 2 unregistered
};

/// @param body  changed: what takes the place of the submessage's body
Guard::Verdict Guard::judge_announcement(const Submessage& submessage, bool of_participant, const Prefix& from, std::string& body) {
  const unsigned char* const bytes = submessage.body;
  if (submessage.payload + 4 > submessage.length) return submessage.has_data ? Verdict::drop : Verdict::pass;  // the key is in the inline QoS
  if (bytes[submessage.payload] != 0 || (bytes[submessage.payload + 1] != 2 && bytes[submessage.payload + 1] != 3)) return Verdict::drop;
  const bool little = bytes[submessage.payload + 1] == 3;
  body.assign(reinterpret_cast<const char*>(bytes), submessage.length);
  Gid gid{};
  bool has_gid = false, is_own = true, is_changed = false, is_long = false;
  const auto pad = [&](std::size_t at) {
    body[at] = body[at + 1] = 0;
    is_changed = true;
  };
  const auto end =
      each_parameter(bytes, submessage.payload + 4, submessage.length, little, [&](std::uint16_t pid, std::size_t at, std::uint16_t length) {
        const std::uint16_t name = pid & 0xbfffU;  // without "must understand"
        if (!is_needed(pid, of_participant) || (name == 0x002c && length > limits_.max_user_data_bytes + 8)) return pad(at);
        if (name == (of_participant ? 0x0050U : 0x005aU) && length >= 16) {
          std::memcpy(gid.bytes.data(), bytes + at + 4, 16);
          has_gid = true;
        }
        if ((name == 0x0050 || name == 0x005a || name == 0x0070) && length >= 12)
          is_own = is_own && std::memcmp(bytes + at + 4, from.data(), from.size()) == 0;
        if (name == 0x0005 || name == 0x0007)
          is_long = is_long || length < 4 || u32(bytes + at + 4, little) > limits_.max_name_bytes + 1 || u32(bytes + at + 4, little) + 4U > length;
        if (name == 0x0062 && (length < 4 || u32(bytes + at + 4, little) > 256 || u32(bytes + at + 4, little) + 4U > length)) pad(at);
      });
  if (!end || !is_own) return Verdict::drop;
  if (!submessage.has_data && has_gid && !submessage.has_key_hash && submessage.length >= 52) {
    // Fast DDS ignores a key in the payload, so it would not see that an endpoint of Cyclone is gone. The key moves into the inline QoS.
    const bool order = submessage.little;
    const auto put16 = [&](std::size_t at, std::uint16_t value) {
      body[at] = static_cast<char>(order ? value & 0xff : value >> 8);
      body[at + 1] = static_cast<char>(order ? value >> 8 : value & 0xff);
    };
    body.replace(20, submessage.length - 20, submessage.length - 20, '\0');
    body[2] = body[3] = 0;
    put16(2, 16);  // where the inline QoS begins
    put16(20, 0x0071);
    put16(22, 4);
    put32(writable(body, 24), submessage.status, false);
    put16(28, 0x0070);
    put16(30, 16);
    std::memcpy(body.data() + 32, gid.bytes.data(), 16);
    put16(48, 1);
    return Verdict::rekeyed;
  }
  if (of_participant) {
    if (submessage.has_data && !has_gid) return Verdict::drop;
    if (submessage.has_data ? !admit(from) : !is_admitted(from)) return Verdict::drop;
  } else if (submessage.has_data) {
    if (!has_gid) return Verdict::drop;
    if (is_long) {
      ++counters_.refused_endpoints;
      return Verdict::drop;
    }
    if (!admit_endpoint(gid)) return Verdict::drop;
  }
  return is_changed ? Verdict::changed : Verdict::pass;
}

Guard::Verdict Guard::judge(std::string_view packet, std::uint32_t from, std::string& changed, Heard& heard) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(packet.data());
  const auto malformed = [&] {
    ++counters_.malformed;
    return Verdict::drop;
  };
  if (packet.size() < 20 || packet.substr(0, 4) != "RTPS" || bytes[4] != 2) return malformed();
  Prefix prefix{};
  std::memcpy(prefix.data(), bytes + 8, prefix.size());
  if (!allowed_.contains(from == 0 ? INADDR_LOOPBACK : from)) {
    const std::lock_guard<std::mutex> lock(mutex_);
    refuse(prefix);
    return Verdict::drop;
  }
  Prefix own{};
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    own = own_;
  }
  const bool is_own = prefix == own;
  bool for_this = true;  // INFO_DST names this participant, or is missing
  bool admitted = is_admitted(prefix), is_changed = false;
  const auto copy = [&] {
    if (!is_changed) changed.assign(packet);
    is_changed = true;
  };
  const auto hear = [&](const unsigned char* to, const unsigned char* speaker) {
    if (!for_this || (speaker[3] & 0xc0U) == 0xc0U || watched_.load(std::memory_order_relaxed) == 0) return;
    Gid gid{};
    std::memcpy(gid.bytes.data(), prefix.data(), prefix.size());
    std::memcpy(gid.bytes.data() + 12, speaker, 4);
    heard.emplace_back(entity(to), gid);
  };
  bool something_passes = false;
  for (std::size_t at = 20; at < packet.size();) {
    if (at + 4 > packet.size()) return malformed();
    const std::uint8_t id = bytes[at], flags = bytes[at + 1];
    const bool little = (flags & 1U) != 0;
    std::size_t length = u16(bytes + at + 2, little);
    const std::size_t begin = at + 4;
    if (length == 0 && id != id_pad && id != id_info_ts) length = packet.size() - begin;  // the last one may be longer than 64 KiB
    if (begin + length > packet.size() || (length % 4 != 0 && begin + length != packet.size())) return malformed();
    const unsigned char* const body = bytes + begin;
    const auto gid_of = [&](const unsigned char* its_entity) {
      Gid gid{};
      std::memcpy(gid.bytes.data(), prefix.data(), prefix.size());
      std::memcpy(gid.bytes.data() + 12, its_entity, 4);
      return gid;
    };
    // Left out: a gap where a reliable reader waits for the sample, else padding.
    const auto leave_out = [&](bool reliable) {
      copy();
      unsigned char* const to = writable(changed, begin);
      if (reliable && length >= 28 &&
          may_keep(gid_of(body + 8), entity(body + 4), u64(body + 12, little), u64(body + 12, little) + 1, most_of_gaps)) {
        writable(changed, at)[0] = id_gap;
        writable(changed, at)[1] = little ? 1 : 0;
        const std::uint64_t sequence = u64(body + 12, little);
        std::memmove(to, body + 4, 8);  // reader and writer
        put32(to + 8, static_cast<std::uint32_t>(sequence >> 32), little);
        put32(to + 12, static_cast<std::uint32_t>(sequence), little);
        put32(to + 16, static_cast<std::uint32_t>((sequence + 1) >> 32), little);
        put32(to + 20, static_cast<std::uint32_t>(sequence + 1), little);
        put32(to + 24, 0, little);
      } else {
        writable(changed, at)[0] = 0x80;  // of a vendor: ignored
      }
    };
    switch (id) {
      case id_acknack:
        if (!is_set(body, length, 16, little) || length < 24) return malformed();
        if ((flags & 2U) != 0) hear(body + 4, body);  // final: the response to a heartbeat; without, it asks for one
        break;
      case id_heartbeat:
        if (length < 28) return malformed();
        hear(body, body + 4);
        break;
      case id_gap:
        if (!admitted) return Verdict::drop;  // and has no part of what may be skipped
        if (length < 28 || !is_set(body, length, 24, little)) return malformed();
        {
          const std::uint64_t first = u64(body + 8, little), last = u64(body + 16, little);  // the last one and the bits behind it
          if (first == 0 || last < first || last >> 62 != 0) return malformed();
          const Gid writer = gid_of(body + 4);
          const std::uint64_t next = std::max<std::uint64_t>(missing(writer, entity(body)), 1);
          const auto put = [&](std::size_t place, std::uint64_t number) {
            copy();
            put32(writable(changed, begin + place), static_cast<std::uint32_t>(number >> 32), little);
            put32(writable(changed, begin + place + 4), static_cast<std::uint32_t>(number), little);
          };
          if (last + u32(body + 24, little) <= next) {  // nothing new, and Fast DDS would take a step for each number
            copy();
            writable(changed, at)[0] = 0x80;  // of a vendor: ignored
          } else if (first <= next) {         // nothing is kept
            const std::uint64_t end = std::min(last, next + longest_gap);
            if (!may_skip(end - std::min(next, end))) return malformed();
            if (first != std::min(next, end)) put(8, std::min(next, end));
            if (end != last) {
              put(16, end);
              put32(writable(changed, begin + 24), 0, little);
            }
          } else if (!may_keep(writer, entity(body), first, last + u32(body + 24, little), most_of_gaps)) {
            copy();
            writable(changed, at)[0] = 0x80;
          }
        }
        break;
      case id_nack_frag:
        if (!is_set(body, length, 20, little) || length < 28) return malformed();
        break;
      case id_heartbeat_frag:
        if (length < 24) return malformed();
        break;
      case id_info_ts:
        if ((flags & 2U) == 0 && length < 8) return malformed();
        break;
      case id_info_dst:
        if (length < 12) return malformed();
        for_this = std::memcmp(body, own.data(), own.size()) == 0;
        break;
      case id_info_src:  // relays; a participant would speak for another one
        if (length < 20 || std::memcmp(body + 8, prefix.data(), prefix.size()) != 0) return malformed();
        break;
      case id_info_reply:
      case id_info_reply_ip4:  // only redirects responses to others
        leave_out(false);
        break;
      case id_data:
      case id_data_frag: {
        const bool in_parts = id == id_data_frag;
        const std::size_t fixed = in_parts ? 32 : 20;
        if (length < fixed) return malformed();
        const std::uint32_t writer = entity(body + 8);
        const std::uint64_t sequence = u64(body + 12, little);
        if (sequence == 0 || sequence >> 63 != 0) return malformed();
        const bool has_qos = (flags & 2U) != 0;
        const bool has_data = (flags & 4U) != 0, has_key = (flags & (in_parts ? 4U : 8U)) != 0;
        std::size_t payload = 4U + u16(body + 2, little);
        if (payload < fixed || payload > length) return malformed();
        const bool of_participants = writer == participants_writer;
        const bool of_endpoints = writer == publications_writer || writer == subscriptions_writer;
        bool has_key_hash = false;
        std::uint32_t status = 0;
        if (has_qos) {
          bool for_another = false;
          const auto end = each_parameter(body, payload, length, little, [&](std::uint16_t pid, std::size_t place, std::uint16_t size) {
            if ((pid & 0xbfffU) == 0x0071 && size == 4) status = u32(body + place + 4, false);
            if ((pid & 0xbfffU) != 0x0070) return;
            has_key_hash = true;
            if (of_participants || of_endpoints)
              for_another = for_another || size < 16 || std::memcmp(body + place + 4, prefix.data(), prefix.size()) != 0;
          });
          if (!end || for_another) return malformed();
          payload = *end;
        }
        Gid gid{};
        std::memcpy(gid.bytes.data(), prefix.data(), prefix.size());
        std::memcpy(gid.bytes.data() + 12, body + 8, 4);
        if (in_parts) {
          const std::uint32_t first = u32(body + 20, little), count = u16(body + 24, little), size = u16(body + 26, little),
                              total = u32(body + 28, little);
          if (first == 0 || count == 0 || size < smallest_fragment || total == 0) return malformed();
          const std::uint64_t fragments = (std::uint64_t{total} + size - 1) / size;
          if (std::uint64_t{first} + count - 1 > fragments) return malformed();
          const std::uint64_t offset = std::uint64_t{first - 1} * size;
          if (length - payload < std::min(std::uint64_t{count} * size, total - offset)) return malformed();
          if ((writer & 0xc0U) == 0xc0U) {  // discovery: no announcement is that large
            if (of_endpoints) ++counters_.refused_endpoints;
            leave_out(!of_participants);
          } else if (total > limits_.max_sample_bytes && is_large(gid, sequence)) {
            leave_out(true);
          }
          break;
        }
        if (of_participants || of_endpoints) {
          if (is_own) {  // comes back by multicast, or is forged
            leave_out(false);
            break;
          }
          if (!has_data && !has_key) break;
          if (of_endpoints && !admitted) return Verdict::drop;
          std::string rewritten;
          const Verdict verdict =
              judge_announcement({body, length, payload, has_data, little, has_key_hash, status}, of_participants, prefix, rewritten);
          if (verdict == Verdict::drop) {
            if (of_participants) return Verdict::drop;
            leave_out(true);
          } else if (of_endpoints && !may_keep(gid, entity(body + 4), sequence, sequence + 1, most_of_announcements)) {
            leave_out(false);
          } else if (verdict != Verdict::pass) {
            copy();
            if (verdict == Verdict::rekeyed) changed[at + 1] = static_cast<char>((flags & ~0x0cU) | 2U);  // inline QoS only
            std::memcpy(changed.data() + begin, rewritten.data(), rewritten.size());
          }
          if (of_participants) admitted = true;
          break;
        }
        if ((has_data || has_key) && length - payload < 4 && length != payload) return malformed();
        if (length - payload > limits_.max_sample_bytes && is_large(gid, sequence)) leave_out(true);
        break;
      }
      default: break;  // unknown ones are ignored, as RTPS says
    }
    something_passes = true;
    at = begin + length;
  }
  if (!admitted || !something_passes) return Verdict::drop;
  return is_changed ? Verdict::changed : Verdict::pass;
}

}  // namespace lrt::ros2
