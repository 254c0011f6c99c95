// SPDX-License-Identifier: Apache-2.0
// The only file that knows Fast DDS: release 2 (Debian 12) and release 3 (Debian 13). It uses the layer of RTPS: payloads are bytes, a topic may have
// several types, and lrt decides what memory a stranger can use.
#if __has_include(<fastdds/rtps/RTPSDomain.hpp>)
#define LRT_FASTDDS_3 1
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/qos/WriterQos.hpp>
#include <fastdds/dds/subscriber/qos/ReaderQos.hpp>
#include <fastdds/rtps/RTPSDomain.hpp>
#include <fastdds/rtps/attributes/HistoryAttributes.hpp>
#include <fastdds/rtps/attributes/RTPSParticipantAttributes.hpp>
#include <fastdds/rtps/attributes/ReaderAttributes.hpp>
#include <fastdds/rtps/attributes/WriterAttributes.hpp>
#include <fastdds/rtps/builtin/data/ParticipantBuiltinTopicData.hpp>
#include <fastdds/rtps/builtin/data/PublicationBuiltinTopicData.hpp>
#include <fastdds/rtps/builtin/data/SubscriptionBuiltinTopicData.hpp>
#include <fastdds/rtps/builtin/data/TopicDescription.hpp>
#include <fastdds/rtps/common/CacheChange.hpp>
#include <fastdds/rtps/history/IPayloadPool.hpp>
#include <fastdds/rtps/history/ReaderHistory.hpp>
#include <fastdds/rtps/history/WriterHistory.hpp>
#include <fastdds/rtps/participant/RTPSParticipant.hpp>
#include <fastdds/rtps/participant/RTPSParticipantListener.hpp>
#include <fastdds/rtps/reader/RTPSReader.hpp>
#include <fastdds/rtps/reader/ReaderListener.hpp>
#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/rtps/transport/NetworkBuffer.hpp>
#include <fastdds/rtps/transport/SenderResource.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.hpp>
#include <fastdds/rtps/writer/RTPSWriter.hpp>
#include <fastdds/rtps/writer/WriterListener.hpp>
#else
#define LRT_FASTDDS_3 0
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/rtps/RTPSDomain.h>
#include <fastdds/rtps/attributes/HistoryAttributes.h>
#include <fastdds/rtps/attributes/RTPSParticipantAttributes.h>
#include <fastdds/rtps/attributes/ReaderAttributes.h>
#include <fastdds/rtps/attributes/WriterAttributes.h>
#include <fastdds/rtps/builtin/data/ParticipantProxyData.h>
#include <fastdds/rtps/builtin/data/ReaderProxyData.h>
#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastdds/rtps/common/CacheChange.h>
#include <fastdds/rtps/history/IPayloadPool.h>
#include <fastdds/rtps/history/ReaderHistory.h>
#include <fastdds/rtps/history/WriterHistory.h>
#include <fastdds/rtps/participant/RTPSParticipant.h>
#include <fastdds/rtps/participant/RTPSParticipantListener.h>
#include <fastdds/rtps/reader/RTPSReader.h>
#include <fastdds/rtps/reader/ReaderListener.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastdds/rtps/writer/RTPSWriter.h>
#include <fastdds/rtps/writer/WriterListener.h>
#endif

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "src/base/third_party_call.hpp"
#include "src/ros2/graph/dds.hpp"

namespace lrt::ros2::dds {

namespace {

namespace fast = eprosima::fastdds::dds;
namespace transport = eprosima::fastdds::rtps;
#if LRT_FASTDDS_3
namespace rtps = eprosima::fastdds::rtps;
using Seconds = eprosima::fastdds::dds::Duration_t;
#else
namespace rtps = eprosima::fastrtps::rtps;
using Seconds = eprosima::fastrtps::Duration_t;
#endif

constexpr std::chrono::seconds lease{10};

Prefix to_prefix(const rtps::GuidPrefix_t& prefix) noexcept {
  Prefix bytes{};
  std::memcpy(bytes.data(), prefix.value, bytes.size());
  return bytes;
}
Gid to_gid(const rtps::GUID_t& guid) noexcept {
  Gid gid{};
  std::memcpy(gid.bytes.data(), guid.guidPrefix.value, 12);
  std::memcpy(gid.bytes.data() + 12, guid.entityId.value, 4);
  return gid;
}
rtps::GUID_t to_guid(const Gid& gid) noexcept {
  rtps::GUID_t guid;
  std::memcpy(guid.guidPrefix.value, gid.bytes.data(), 12);
  std::memcpy(guid.entityId.value, gid.bytes.data() + 12, 4);
  return guid;
}
std::int64_t to_number(const rtps::SequenceNumber_t& sequence) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(static_cast<std::uint32_t>(sequence.high)) << 32 | sequence.low);
}
rtps::SequenceNumber_t to_sequence(std::int64_t number) noexcept {
  return rtps::SequenceNumber_t(static_cast<std::int32_t>(number >> 32), static_cast<std::uint32_t>(number & 0xffffffff));
}
std::optional<std::chrono::nanoseconds> to_duration(const Seconds& duration) noexcept {
  if (duration.seconds == 0x7fffffff || duration.nanosec == 0xffffffffU || duration.seconds < 0) return std::nullopt;
  return std::chrono::seconds(duration.seconds) + std::chrono::nanoseconds(duration.nanosec);
}
template <class Octets>
std::string to_text(const Octets& octets) {
  return std::string(octets.begin(), octets.end());
}
std::uint32_t address_of(const rtps::Locator_t& locator) noexcept {
  if (locator.kind != LOCATOR_KIND_UDPv4) return 0;
  return std::uint32_t{locator.address[12]} << 24 | std::uint32_t{locator.address[13]} << 16 | std::uint32_t{locator.address[14]} << 8 |
         locator.address[15];
}

/// A transport that asks the guard about each packet.
class GuardedTransport final : public transport::ChainingTransport {
 public:
  GuardedTransport(const transport::ChainingTransportDescriptor& descriptor, std::shared_ptr<Guard> guard)
      : ChainingTransport(descriptor), guard_(std::move(guard)) {}

#if LRT_FASTDDS_3
  using Buffers = const std::vector<transport::NetworkBuffer>&;
#else
  using Buffers = const rtps::octet*;
#endif
  transport::TransportDescriptorInterface* get_configuration() override { return low_level_transport_->get_configuration(); }
  ~GuardedTransport() override {
    if (socket_ >= 0) ::close(socket_);
  }
  bool send(rtps::SenderResource* resource, Buffers buffers, std::uint32_t size, rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    if (size <= 512) acknowledge(buffers, size);
    if (guard_->is_watching()) keep(buffers, size, *begin, *end);
    if (guard_->allowed().empty()) return resource->send(buffers, size, begin, end, timeout);
    // Announcements of strangers name addresses: nothing is sent to those that are not allowed.
    rtps::LocatorList_t list;
    for (; *begin != *end; ++*begin) {
      const rtps::Locator_t& to = **begin;
      const std::uint32_t address = address_of(to);
      if (address == 0 || address >> 28 == 14 || guard_->allowed().contains(address)) list.push_back(to);
    }
    if (list.empty()) return true;
    rtps::Locators first(list.begin()), last(list.end());
    return resource->send(buffers, size, &first, &last, timeout);
  }

  void receive(transport::TransportReceiverInterface* next, const rtps::octet* bytes, std::uint32_t size, const rtps::Locator_t& local,
               const rtps::Locator_t& remote) override {
    std::string changed;
    Guard::Heard heard;
    const std::string_view packet(reinterpret_cast<const char*>(bytes), size);
    switch (guard_->judge(packet, address_of(remote), changed, heard)) {
      case Guard::Verdict::pass: next->OnDataReceived(bytes, size, local, remote); break;
      case Guard::Verdict::changed:
        next->OnDataReceived(reinterpret_cast<const rtps::octet*>(changed.data()), static_cast<std::uint32_t>(changed.size()), local, remote);
        break;
      case Guard::Verdict::drop:
      case Guard::Verdict::rekeyed: return;
    }
    if (guard_->is_watching())
      for (const Guard::Heartbeat& heartbeat : guard_->wanted_heartbeats(packet)) repeat(heartbeat);
    guard_->count(heard);
  }

 private:
  static std::string whole(Buffers buffers, [[maybe_unused]] std::uint32_t size) {
    std::string packet;
#if LRT_FASTDDS_3
    for (const transport::NetworkBuffer& buffer : buffers) packet.append(static_cast<const char*>(buffer.buffer), buffer.size);
#else
    packet.assign(reinterpret_cast<const char*>(buffers), size);
#endif
    return packet;
  }
  /// Acknowledgements travel alone, or a few together.
  void acknowledge(Buffers buffers, std::uint32_t size) {
#if LRT_FASTDDS_3
    guard_->acknowledged(whole(buffers, size));
#else
    guard_->acknowledged(std::string_view(reinterpret_cast<const char*>(buffers), size));
#endif
  }
  /// Keeps a packet with a heartbeat: it may have to be sent again.
  void keep(Buffers buffers, std::uint32_t size, const rtps::LocatorsIterator& begin, const rtps::LocatorsIterator& end) {
    if (size < 52 || size > 200) return;  // heartbeats travel alone
    const std::string packet = whole(buffers, size);
    // The iterators are of one pass: one locator suffices for what is sent to one reader.
    if (!(begin != end)) return;
    const rtps::Locator_t& to = *begin;
    const std::uint32_t address = address_of(to);
    if (address != 0 && address >> 28 != 14) guard_->sent(packet, {{address, static_cast<std::uint16_t>(to.port)}});
  }
  void repeat(const Guard::Heartbeat& heartbeat) {
    const std::lock_guard<std::mutex> lock(socket_mutex_);
    if (socket_ < 0) socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (socket_ < 0) return;
    for (const auto& [address, port] : heartbeat.to) {
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_addr.s_addr = htonl(address);
      to.sin_port = htons(port);
      // Lost: the reader asks again.
      static_cast<void>(::sendto(socket_, heartbeat.packet.data(), heartbeat.packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to));
    }
  }

  const std::shared_ptr<Guard> guard_;
  std::mutex socket_mutex_;
  int socket_ = -1;
};

struct GuardedDescriptor final : transport::ChainingTransportDescriptor {
  GuardedDescriptor(std::shared_ptr<transport::TransportDescriptorInterface> low, std::shared_ptr<Guard> guard_of_it)
      : ChainingTransportDescriptor(std::move(low)), guard(std::move(guard_of_it)) {}
  transport::TransportInterface* create_transport() const override { return new GuardedTransport(*this, guard); }  // Fast DDS owns it
  std::shared_ptr<Guard> guard;
};

/// Memory of samples that have come in part, or wait to be taken.
class Pool final : public rtps::IPayloadPool {
 public:
  explicit Pool(std::size_t limit) : limit_(limit) {}

#if LRT_FASTDDS_3
  bool get_payload(std::uint32_t size, rtps::SerializedPayload_t& payload) override {
    if (!allocate(size, payload)) return false;
    payload.payload_owner = this;
    return true;
  }
  bool get_payload(const rtps::SerializedPayload_t& data, rtps::SerializedPayload_t& payload) override {
    if (!get_payload(data.length, payload)) return false;
    fill(data, payload);
    return true;
  }
  bool release_payload(rtps::SerializedPayload_t& payload) override {
    release(payload);
    payload.payload_owner = nullptr;
    return true;
  }
#else
  bool get_payload(std::uint32_t size, rtps::CacheChange_t& change) override {
    if (!allocate(size, change.serializedPayload)) return false;
    change.payload_owner(this);
    return true;
  }
  bool get_payload(rtps::SerializedPayload_t& data, rtps::IPayloadPool*&, rtps::CacheChange_t& change) override {
    if (!get_payload(data.length, change)) return false;
    fill(data, change.serializedPayload);
    return true;
  }
  bool release_payload(rtps::CacheChange_t& change) override {
    release(change.serializedPayload);
    change.payload_owner(nullptr);
    return true;
  }
#endif

 private:
  static constexpr std::size_t margin = 8;  ///< Fast DDS writes numbers of fragments behind a last fragment that is short

  bool allocate(std::uint32_t size, rtps::SerializedPayload_t& payload) {
    const std::size_t now = used_.fetch_add(size, std::memory_order_relaxed) + size;
    auto* const memory = now <= limit_ ? static_cast<rtps::octet*>(std::malloc(size + margin)) : nullptr;
    if (memory == nullptr) {
      used_.fetch_sub(size, std::memory_order_relaxed);
      return false;
    }
    payload.data = memory;
    payload.max_size = size;
    payload.length = 0;
    payload.pos = 0;
    return true;
  }
  static void fill(const rtps::SerializedPayload_t& data, rtps::SerializedPayload_t& payload) {
    payload.length = data.length;
    payload.encapsulation = data.encapsulation;
    if (data.length != 0) std::memcpy(payload.data, data.data, data.length);
  }
  void release(rtps::SerializedPayload_t& payload) {
    used_.fetch_sub(payload.max_size, std::memory_order_relaxed);
    std::free(payload.data);
    payload.data = nullptr;
    payload.length = payload.max_size = payload.pos = 0;
  }

  const std::size_t limit_;
  std::atomic<std::size_t> used_{0};
};

rtps::HistoryAttributes history_of(std::size_t depth) {
  return rtps::HistoryAttributes(rtps::DYNAMIC_RESERVE_MEMORY_MODE, 64, 0, static_cast<std::int32_t>(std::min<std::size_t>(depth, 100'000)), 1);
}

#if LRT_FASTDDS_3
bool announce(rtps::RTPSParticipant& participant, rtps::RTPSReader* reader, const EndpointOptions& options, const fast::ReaderQos& qos) {
  rtps::TopicDescription topic;
  topic.topic_name = options.topic;
  topic.type_name = options.type;
  return participant.register_reader(reader, topic, qos);
}
bool announce(rtps::RTPSParticipant& participant, rtps::RTPSWriter* writer, const EndpointOptions& options, const fast::WriterQos& qos) {
  rtps::TopicDescription topic;
  topic.topic_name = options.topic;
  topic.type_name = options.type;
  return participant.register_writer(writer, topic, qos);
}
#else
eprosima::fastrtps::TopicAttributes topic_of(const EndpointOptions& options) {
  eprosima::fastrtps::TopicAttributes topic(options.topic.c_str(), options.type.c_str(), options.keyed ? rtps::WITH_KEY : rtps::NO_KEY);
  topic.auto_fill_type_object = false;
  topic.auto_fill_type_information = false;
  return topic;
}
bool announce(rtps::RTPSParticipant& participant, rtps::RTPSReader* reader, const EndpointOptions& options, const fast::ReaderQos& qos) {
  return participant.registerReader(reader, topic_of(options), qos);
}
bool announce(rtps::RTPSParticipant& participant, rtps::RTPSWriter* writer, const EndpointOptions& options, const fast::WriterQos& qos) {
  return participant.registerWriter(writer, topic_of(options), qos);
}
#endif

template <class EndpointQos>
void fill_qos(EndpointQos& qos, const EndpointOptions& options) {
  qos.m_reliability.kind = options.reliable ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
  qos.m_durability.kind = options.transient_local ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  qos.m_userData.assign(options.user_data.begin(), options.user_data.end());
  qos.data_sharing.off();
}
template <class Attributes>
void fill_attributes(Attributes& attributes, const EndpointOptions& options) {
  attributes.endpoint.topicKind = options.keyed ? rtps::WITH_KEY : rtps::NO_KEY;
  attributes.endpoint.reliabilityKind = options.reliable ? rtps::RELIABLE : rtps::BEST_EFFORT;
  attributes.endpoint.durabilityKind = options.transient_local ? rtps::TRANSIENT_LOCAL : rtps::VOLATILE;
}

class FastReader final : public Reader, private rtps::ReaderListener {
 public:
  FastReader(EndpointEvents& events, const EndpointOptions& options, std::shared_ptr<Guard> guard)
      : events_(events), guard_(std::move(guard)), history_(history_of(options.depth + 512)) {}
  ~FastReader() override {
    if (reader_ == nullptr) return;
    guard_->unwatch(gid_);
    if (const ThirdPartyCall call; call) rtps::RTPSDomain::removeRTPSReader(reader_);
  }
  bool create(rtps::RTPSParticipant& participant, const EndpointOptions& options, const std::shared_ptr<Pool>& pool) {
    rtps::ReaderAttributes attributes;
    fill_attributes(attributes, options);
    reader_ = rtps::RTPSDomain::createRTPSReader(&participant, attributes, pool, &history_, this);
    if (reader_ == nullptr) return false;
    gid_ = to_gid(reader_->getGuid());
    if (options.is_watched) guard_->watch(gid_, [this] { events_.matched(); });
    fast::ReaderQos qos;
    fill_qos(qos, options);
    return announce(participant, reader_, options, qos);
  }
  const Gid& gid() const noexcept override { return gid_; }
  bool is_matched(const Gid& writer) const override {
    const ThirdPartyCall call;
    return call && reader_->matched_writer_is_matched(to_guid(writer));
  }
  bool is_heard(const Gid& writer) const override { return guard_->has_heard(gid_, writer); }

 private:
#if LRT_FASTDDS_3
  void on_reader_matched(rtps::RTPSReader*, const rtps::MatchingInfo&) override { events_.matched(); }
  void on_new_cache_change_added(rtps::RTPSReader*, const rtps::CacheChange_t* change) override { take(*change); }
#else
  void onReaderMatched(rtps::RTPSReader*, rtps::MatchingInfo&) override { events_.matched(); }
  void onReaderMatched(rtps::RTPSReader*, const fast::SubscriptionMatchedStatus&) override { events_.matched(); }
  void onNewCacheChangeAdded(rtps::RTPSReader*, const rtps::CacheChange_t* const change) override { take(*change); }
#endif
  void on_sample_lost(rtps::RTPSReader*, std::int32_t count) override {
    if (count > 0) events_.lost(static_cast<std::uint64_t>(count));
  }

  void take(const rtps::CacheChange_t& change) {
    if (change.kind == rtps::ALIVE && change.serializedPayload.length >= 4) {
      Received sample;
      sample.payload = std::string_view(reinterpret_cast<const char*>(change.serializedPayload.data), change.serializedPayload.length);
      const auto& at = change.sourceTimestamp;
      if (at.seconds() > 0 && at.seconds() != 0x7fffffff && at.nanosec() < 1'000'000'000U)
        sample.source = std::chrono::system_clock::time_point(std::chrono::seconds(at.seconds()) + std::chrono::nanoseconds(at.nanosec()));
      sample.writer = to_gid(change.writerGUID);
      // From the network Fast DDS stores the related identity as the identity of the sample; inside a process both are there.
      const auto& related = change.write_params.related_sample_identity();
      const auto& identity = related != rtps::SampleIdentity::unknown() ? related : change.write_params.sample_identity();
      if (identity != rtps::SampleIdentity::unknown()) {
        sample.related.gid = to_gid(identity.writer_guid());
        sample.related.sequence = to_number(identity.sequence_number());
      }
      events_.received(sample);
    }
    history_.remove_change(const_cast<rtps::CacheChange_t*>(&change));  // as ReaderListener says
  }

  EndpointEvents& events_;
  const std::shared_ptr<Guard> guard_;
  rtps::ReaderHistory history_;
  rtps::RTPSReader* reader_ = nullptr;
  Gid gid_{};
};

class FastWriter final : public Writer, private rtps::WriterListener {
 public:
  FastWriter(EndpointEvents* events, const EndpointOptions& options, [[maybe_unused]] const std::shared_ptr<Pool>& pool, std::shared_ptr<Guard> guard)
      : events_(events),
        guard_(std::move(guard)),
        depth_(std::max<std::size_t>(options.depth, 1)),
#if LRT_FASTDDS_3
        history_(history_of(depth_ + 1), pool)
#else
        history_(history_of(depth_ + 1))
#endif
  {
  }
  ~FastWriter() override {
    if (writer_ == nullptr) return;
    guard_->unwatch(gid_);
    if (const ThirdPartyCall call; call) rtps::RTPSDomain::removeRTPSWriter(writer_);
  }
  bool create(rtps::RTPSParticipant& participant, const EndpointOptions& options, [[maybe_unused]] const std::shared_ptr<Pool>& pool) {
    rtps::WriterAttributes attributes;
    fill_attributes(attributes, options);
    attributes.mode = rtps::SYNCHRONOUS_WRITER;  // what was published is sent, also if the writer is destroyed next
#if LRT_FASTDDS_3
    attributes.times.heartbeat_period = Seconds(1, 0);
    writer_ = rtps::RTPSDomain::createRTPSWriter(&participant, attributes, &history_, this);
#else
    attributes.times.heartbeatPeriod = Seconds(1, 0);
    writer_ = rtps::RTPSDomain::createRTPSWriter(&participant, attributes, pool, &history_, this);
#endif
    if (writer_ == nullptr) return false;
    gid_ = to_gid(writer_->getGuid());
    if (options.is_watched && events_ != nullptr) guard_->watch(gid_, [this] { events_->matched(); });
    fast::WriterQos qos;
    fill_qos(qos, options);
    qos.m_publishMode.kind = fast::SYNCHRONOUS_PUBLISH_MODE;
    return announce(participant, writer_, options, qos);
  }
  const Gid& gid() const noexcept override { return gid_; }
  bool is_matched(const Gid& reader) const override {
    const ThirdPartyCall call;
    return call && writer_->matched_reader_is_matched(to_guid(reader));
  }
  bool is_heard(const Gid& reader) const override { return guard_->has_heard(gid_, reader); }
  std::size_t readers() const noexcept override { return static_cast<std::size_t>(std::max(readers_.load(std::memory_order_relaxed), 0)); }

  Result<std::int64_t> write(std::string_view head, std::string_view body, const Identity* related) override {
    const ThirdPartyCall call;
    if (!call) return unexpected(Errc::closed, "the process ends");
    const auto size = static_cast<std::uint32_t>(head.size() + body.size());
    const std::lock_guard<std::mutex> lock(mutex_);
    while (history_.getHistorySize() >= depth_ && history_.remove_min_change()) {}
#if LRT_FASTDDS_3
    rtps::CacheChange_t* const change = history_.create_change(size, rtps::ALIVE);
#else
    rtps::CacheChange_t* const change = writer_->new_change([size]() -> std::uint32_t { return size; }, rtps::ALIVE);
#endif
    if (change == nullptr) return unexpected(Errc::limit_exceeded, "Fast DDS has no memory for a sample of " + std::to_string(size) + " bytes");
    auto& payload = change->serializedPayload;
    std::copy(head.begin(), head.end(), payload.data);
    std::copy(body.begin(), body.end(), payload.data + head.size());
    payload.length = size;
    payload.encapsulation = payload.data[1] == 0 ? CDR_BE : CDR_LE;
    rtps::WriteParams params;
    if (related != nullptr) params.related_sample_identity().writer_guid(to_guid(related->gid)).sequence_number(to_sequence(related->sequence));
    if (!history_.add_change(change, params)) {
#if LRT_FASTDDS_3
      history_.release_change(change);
#else
      writer_->release_change(change);
#endif
      return unexpected(Errc::io_error, "Fast DDS does not take the sample");
    }
    return to_number(params.sample_identity().sequence_number());
  }

 private:
  void count(const rtps::MatchingInfo& info) {
    const bool is_own = std::memcmp(info.remoteEndpointGuid.guidPrefix.value, gid_.bytes.data(), 12) == 0;
    if (!is_own) readers_ += info.status == rtps::MATCHED_MATCHING ? 1 : -1;
    if (events_ != nullptr) events_->matched();
  }
#if LRT_FASTDDS_3
  void on_writer_matched(rtps::RTPSWriter*, const rtps::MatchingInfo& info) override { count(info); }
#else
  void onWriterMatched(rtps::RTPSWriter*, rtps::MatchingInfo& info) override { count(info); }
  void onWriterMatched(rtps::RTPSWriter*, const fast::PublicationMatchedStatus&) override {}
#endif

  EndpointEvents* const events_;
  const std::shared_ptr<Guard> guard_;
  const std::size_t depth_;
  std::mutex mutex_;
  rtps::WriterHistory history_;
  rtps::RTPSWriter* writer_ = nullptr;
  std::atomic<int> readers_{0};
  Gid gid_{};
};

class FastParticipant final : public Participant, private rtps::RTPSParticipantListener {
 public:
  FastParticipant(const GraphLimits& limits, Discovery& discovery, AddressList allowed)
      : discovery_(discovery),
        guard_(std::make_shared<Guard>(limits, std::move(allowed))),
        pool_(std::make_shared<Pool>(limits.max_waiting_bytes)),
        written_(std::make_shared<Pool>(SIZE_MAX / 2)) {}
  ~FastParticipant() override {
    if (participant_ == nullptr) return;
    if (const ThirdPartyCall call; call) {
      participant_->set_listener(nullptr);
      rtps::RTPSDomain::removeRTPSParticipant(participant_);
    }
  }

  Result<void> create(const GraphOptions& options, std::string_view user_data) {
    rtps::RTPSParticipantAttributes attributes;
    attributes.setName(options.node.c_str());
    attributes.userData.assign(user_data.begin(), user_data.end());
    attributes.useBuiltinTransports = false;
    auto& discovery = attributes.builtin.discovery_config;
    discovery.leaseDuration = Seconds(lease.count(), 0);
    discovery.leaseDuration_announcementperiod = Seconds(3, 0);
    attributes.builtin.avoid_builtin_multicast = false;  // others may hear announcements of endpoints by multicast only
    const auto udp = std::make_shared<transport::UDPv4TransportDescriptor>();
    udp->maxInitialPeersRange = 32;
    auto addresses = addresses_of(options.interfaces);
    if (!addresses) return unexpected(addresses.error());
    udp->interfaceWhiteList = std::move(*addresses);
    attributes.userTransports.push_back(std::make_shared<GuardedDescriptor>(udp, guard_));
    if (options.shared_memory)
      attributes.userTransports.push_back(std::make_shared<GuardedDescriptor>(std::make_shared<transport::SharedMemTransportDescriptor>(), guard_));
    if (!options.multicast || !options.peers.empty()) {
      rtps::Locator_t any;
      any.kind = LOCATOR_KIND_UDPv4;
      any.port = 0;
      attributes.builtin.metatrafficUnicastLocatorList.push_back(any);
      if (options.multicast) attributes.builtin.initialPeersList.push_back(multicast_locator(options.domain));
      if (options.multicast) attributes.builtin.metatrafficMulticastLocatorList.push_back(multicast_locator(options.domain));
      for (const std::string& peer : options.peers) {
        in_addr address{};
        if (::inet_pton(AF_INET, peer.c_str(), &address) != 1)
          return unexpected(Errc::invalid_option, "the peer \"" + peer + "\" is no IPv4 address");
        rtps::Locator_t locator;
        locator.kind = LOCATOR_KIND_UDPv4;
        locator.port = 0;
        std::memcpy(locator.address + 12, &address, 4);
        attributes.builtin.initialPeersList.push_back(locator);
      }
    }
    // The listener may be called before createParticipant() returns.
    participant_ = rtps::RTPSDomain::createParticipant(options.domain, false, attributes, this);
    if (participant_ == nullptr)
      return unexpected(Errc::io_error, "Fast DDS cannot join domain " + std::to_string(options.domain) +
                                            ": its ports are in use, or no interface fits GraphOptions::interfaces");
    prefix_ = to_prefix(participant_->getGuid().guidPrefix);
    guard_->own(prefix_);
    participant_->enable();
    return {};
  }

  const Prefix& prefix() const noexcept override { return prefix_; }
  const Guard& guard() const noexcept override { return *guard_; }
  Result<std::unique_ptr<Reader>> reader(const EndpointOptions& options, EndpointEvents& events) override {
    const ThirdPartyCall call;
    if (!call) return unexpected(Errc::closed, "the process ends");
    auto reader = std::make_unique<FastReader>(events, options, guard_);
    if (!reader->create(*participant_, options, pool_)) return unexpected(Errc::io_error, "Fast DDS makes no reader of " + options.topic);
    return Result<std::unique_ptr<Reader>>(std::move(reader));
  }
  Result<std::unique_ptr<Writer>> writer(const EndpointOptions& options, EndpointEvents* events) override {
    const ThirdPartyCall call;
    if (!call) return unexpected(Errc::closed, "the process ends");
    auto writer = std::make_unique<FastWriter>(events, options, written_, guard_);
    if (!writer->create(*participant_, options, written_)) return unexpected(Errc::io_error, "Fast DDS makes no writer of " + options.topic);
    return Result<std::unique_ptr<Writer>>(std::move(writer));
  }

 private:
  static rtps::Locator_t multicast_locator(unsigned domain) {
    rtps::Locator_t locator;
    locator.kind = LOCATOR_KIND_UDPv4;
    locator.port = 7400 + 250 * domain;
    locator.address[12] = 239;
    locator.address[13] = 255;
    locator.address[14] = 0;
    locator.address[15] = 1;
    return locator;
  }

  /// The IPv4 addresses of interfaces that are named by address or name.
  static Result<std::vector<std::string>> addresses_of(const std::vector<std::string>& interfaces) {
    std::vector<std::string> addresses;
    if (interfaces.empty()) return addresses;
    ifaddrs* list = nullptr;
    if (::getifaddrs(&list) != 0) return unexpected(Errc::io_error, "the system does not list its network interfaces");
    const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owner(list, ::freeifaddrs);
    for (const std::string& interface : interfaces) {
      bool found = false;
      for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
        if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
        char text[INET_ADDRSTRLEN]{};
        ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text, sizeof text);
        if (interface != text && interface != one->ifa_name) continue;
        found = true;
        if (std::find(addresses.begin(), addresses.end(), text) == addresses.end()) addresses.emplace_back(text);
      }
      if (!found) return unexpected(Errc::invalid_option, "no network interface has the name or IPv4 address \"" + interface + "\"");
    }
    return addresses;
  }

  template <class Reliability, class Durability, class Deadline, class Liveliness>
  static Qos qos_of(const Reliability& reliability, const Durability& durability, const Deadline& deadline, const Liveliness& liveliness) {
    Qos qos;
    qos.reliable = reliability.kind == fast::RELIABLE_RELIABILITY_QOS;
    qos.transient_local = durability.kind != fast::VOLATILE_DURABILITY_QOS;
    qos.deadline = to_duration(deadline.period);
    qos.liveliness = to_duration(liveliness.lease_duration);
    qos.manual_liveliness = liveliness.kind != fast::AUTOMATIC_LIVELINESS_QOS;
    return qos;
  }

  void participant(bool gone, const rtps::GUID_t& guid, const std::array<std::uint8_t, 2>& vendor, std::string user_data) {
    const Prefix prefix = to_prefix(guid.guidPrefix);
    if (gone) {
      guard_->participant_gone(prefix);
      discovery_.gone(prefix);
    } else {
      guard_->participant_known(prefix);
      discovery_.found(ParticipantData{prefix, vendor, std::move(user_data)});
    }
  }
  /// Fast DDS also reports the endpoints of this participant.
  bool is_own(const rtps::GUID_t& guid) const noexcept { return to_prefix(guid.guidPrefix) == prefix_; }
  void endpoint_gone(const rtps::GUID_t& guid) {
    const Gid gid = to_gid(guid);
    guard_->endpoint_gone(gid);
    discovery_.gone(gid);
  }

#if LRT_FASTDDS_3
  void on_participant_discovery(rtps::RTPSParticipant*, rtps::ParticipantDiscoveryStatus status, const rtps::ParticipantBuiltinTopicData& data,
                                bool&) override {
    const bool gone =
        status == rtps::ParticipantDiscoveryStatus::REMOVED_PARTICIPANT || status == rtps::ParticipantDiscoveryStatus::DROPPED_PARTICIPANT;
    participant(gone, data.guid, {data.vendor_id[0], data.vendor_id[1]}, to_text(data.user_data));
  }
  void on_reader_discovery(rtps::RTPSParticipant*, rtps::ReaderDiscoveryStatus status, const rtps::SubscriptionBuiltinTopicData& data,
                           bool&) override {
    if (is_own(data.guid)) return;
    if (status == rtps::ReaderDiscoveryStatus::REMOVED_READER) return endpoint_gone(data.guid);
    discovery_.found(EndpointData{to_gid(data.guid), false, data.topic_name.c_str(), data.type_name.c_str(), to_text(data.user_data),
                                  qos_of(data.reliability, data.durability, data.deadline, data.liveliness)});
  }
  void on_writer_discovery(rtps::RTPSParticipant*, rtps::WriterDiscoveryStatus status, const rtps::PublicationBuiltinTopicData& data,
                           bool&) override {
    if (is_own(data.guid)) return;
    if (status == rtps::WriterDiscoveryStatus::REMOVED_WRITER) return endpoint_gone(data.guid);
    EndpointData endpoint{to_gid(data.guid),       true,
                          data.topic_name.c_str(), data.type_name.c_str(),
                          to_text(data.user_data), qos_of(data.reliability, data.durability, data.deadline, data.liveliness)};
    endpoint.qos.lifespan = to_duration(data.lifespan.duration);
    discovery_.found(std::move(endpoint));
  }
#else
  void onParticipantDiscovery(rtps::RTPSParticipant*, rtps::ParticipantDiscoveryInfo&& found) override {
    const bool gone =
        found.status == rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT || found.status == rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT;
    participant(gone, found.info.m_guid, {found.info.m_VendorId[0], found.info.m_VendorId[1]}, to_text(found.info.m_userData));
  }
  void onReaderDiscovery(rtps::RTPSParticipant*, rtps::ReaderDiscoveryInfo&& found) override {
    const auto& data = found.info;
    if (is_own(data.guid())) return;
    if (found.status == rtps::ReaderDiscoveryInfo::REMOVED_READER) return endpoint_gone(data.guid());
    discovery_.found(EndpointData{to_gid(data.guid()), false, data.topicName().c_str(), data.typeName().c_str(), to_text(data.m_qos.m_userData),
                                  qos_of(data.m_qos.m_reliability, data.m_qos.m_durability, data.m_qos.m_deadline, data.m_qos.m_liveliness)});
  }
  void onWriterDiscovery(rtps::RTPSParticipant*, rtps::WriterDiscoveryInfo&& found) override {
    const auto& data = found.info;
    if (is_own(data.guid())) return;
    if (found.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER) return endpoint_gone(data.guid());
    EndpointData endpoint{to_gid(data.guid()),
                          true,
                          data.topicName().c_str(),
                          data.typeName().c_str(),
                          to_text(data.m_qos.m_userData),
                          qos_of(data.m_qos.m_reliability, data.m_qos.m_durability, data.m_qos.m_deadline, data.m_qos.m_liveliness)};
    endpoint.qos.lifespan = to_duration(data.m_qos.m_lifespan.duration);
    discovery_.found(std::move(endpoint));
  }
#endif

  Discovery& discovery_;
  const std::shared_ptr<Guard> guard_;
  const std::shared_ptr<Pool> pool_;     ///< of readers
  const std::shared_ptr<Pool> written_;  ///< of writers: their depth is their limit
  rtps::RTPSParticipant* participant_ = nullptr;
  Prefix prefix_{};
};

/// Fast DDS prints what it finds in the packets of strangers; lrt prints nothing.
void silence() {
  static const bool silent = [] {
    fast::Log::ClearConsumers();
    return ThirdPartyCall::close_at_exit();
  }();
  static_cast<void>(silent);
}

}  // namespace

Result<std::unique_ptr<Participant>> Participant::join(const GraphOptions& options, std::string_view user_data, Discovery& discovery) {
  silence();
  auto allowed = AddressList::of(options.allowed_addresses);
  if (!allowed) return unexpected(allowed.error());
  const ThirdPartyCall call;
  if (!call) return unexpected(Errc::closed, "the process ends");
  auto participant = std::make_unique<FastParticipant>(options.limits, discovery, std::move(*allowed));
  if (const auto created = participant->create(options, user_data); !created) return unexpected(created.error());
  return Result<std::unique_ptr<Participant>>(std::move(participant));
}

}  // namespace lrt::ros2::dds
