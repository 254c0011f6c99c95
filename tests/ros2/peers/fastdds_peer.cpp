// SPDX-License-Identifier: Apache-2.0
// A stranger for the tests of the graph: Fast DDS by its layer of DDS, and the identity form of services, as RMW's Fast DDS has it.
//   fastdds_peer DOMAIN LEASE_MS [USER_DATA]
// Commands and responses are those of cyclone_peer, as far as they are here; node24 /NAME is as Humble announces it.
#if __has_include(<fastdds/dds/core/ReturnCode.hpp>)
#define FASTDDS_3 1
#else
#define FASTDDS_3 0
#endif
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>
#if FASTDDS_3
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
namespace rtps = eprosima::fastdds::rtps;
using Lease = eprosima::fastdds::dds::Duration_t;
#else
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
namespace rtps = eprosima::fastrtps::rtps;
using Lease = eprosima::fastrtps::Duration_t;
#endif

using namespace eprosima::fastdds::dds;

namespace {

/// Any type: a sample is its payload, with the encapsulation.
class RawType final : public TopicDataType {
 public:
#if FASTDDS_3
  explicit RawType(const std::string& name) {
    set_name(name);
    max_serialized_type_size = 64 * 1024;
    is_compute_key_provided = false;
  }
  bool serialize(const void* const data, rtps::SerializedPayload_t& payload, DataRepresentationId_t) override { return put(data, payload); }
  bool deserialize(rtps::SerializedPayload_t& payload, void* data) override { return get(payload, data); }
  uint32_t calculate_serialized_size(const void* const data, DataRepresentationId_t) override {
    return static_cast<uint32_t>(static_cast<const std::string*>(data)->size());
  }
  void* create_data() override { return new std::string; }
  void delete_data(void* data) override { delete static_cast<std::string*>(data); }
  bool compute_key(rtps::SerializedPayload_t&, rtps::InstanceHandle_t&, bool) override { return false; }
  bool compute_key(const void* const, rtps::InstanceHandle_t&, bool) override { return false; }
#else
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 64 * 1024;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override { return put(data, *payload); }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override { return get(*payload, data); }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<uint32_t>(static_cast<const std::string*>(data)->size()); };
  }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
#endif

 private:
  static bool put(const void* data, rtps::SerializedPayload_t& payload) {
    const auto& bytes = *static_cast<const std::string*>(data);
    std::memcpy(payload.data, bytes.data(), bytes.size());
    payload.length = static_cast<uint32_t>(bytes.size());
    payload.encapsulation = CDR_LE;
    return true;
  }
  static bool get(const rtps::SerializedPayload_t& payload, void* data) {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload.data), payload.length);
    return true;
  }
};

DomainParticipant* participant = nullptr;
Publisher* publisher = nullptr;
Subscriber* subscriber = nullptr;
std::map<std::string, Topic*> topics;
std::map<std::string, DataWriter*> writers;
std::vector<rtps::GUID_t> reader_ids, writer_ids;
std::vector<std::function<void()>> work;

void say(const std::string& line) { std::cout << line << std::endl; }
[[noreturn]] void fail(const std::string& why) {
  say("failed " + why);
  std::exit(1);
}

Topic* topic(const std::string& name, const std::string& type) {
  Topic*& found = topics[name];
  if (found != nullptr) return found;
  TypeSupport support(new RawType(type));
  support.register_type(participant);
  found = participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
  if (found == nullptr) fail("topic " + name);
  return found;
}
DataWriter* make_writer(const std::string& name, const std::string& type, bool reliable = true, bool transient_local = false,
                        const std::string& user_data = {}) {
  DataWriterQos qos;
  qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = transient_local ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  qos.user_data().data_vec(std::vector<rtps::octet>(user_data.begin(), user_data.end()));
  qos.data_sharing().off();
  DataWriter* const writer = publisher->create_datawriter(topic(name, type), qos);
  if (writer == nullptr) fail("writer " + name);
  writer_ids.push_back(writer->guid());
  return writer;
}
DataReader* make_reader(const std::string& name, const std::string& type, bool reliable = true, bool transient_local = false,
                        const std::string& user_data = {}) {
  DataReaderQos qos;
  qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = transient_local ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  qos.history().depth = 64;
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  qos.user_data().data_vec(std::vector<rtps::octet>(user_data.begin(), user_data.end()));
  qos.data_sharing().off();
  DataReader* const reader = subscriber->create_datareader(topic(name, type), qos);
  if (reader == nullptr) fail("reader " + name);
  reader_ids.push_back(reader->guid());
  return reader;
}
template <class F>
void take(DataReader* reader, F&& f) {
  std::string payload;
  SampleInfo info;
  while (reader->take_next_sample(&payload, &info) ==
#if FASTDDS_3
         RETCODE_OK
#else
         ReturnCode_t::RETCODE_OK
#endif
  )
    if (info.valid_data) f(payload, info);
}

template <class T>
T number_at(const std::string& payload, std::size_t at) {
  T value{};
  std::memcpy(&value, payload.data() + at, sizeof value);
  return value;
}
void put(std::string& payload, const void* bytes, std::size_t count) { payload.append(static_cast<const char*>(bytes), count); }
void put_text(std::string& payload, const std::string& text) {
  while (payload.size() % 4 != 0) payload += '\0';
  const auto length = static_cast<uint32_t>(text.size() + 1);
  put(payload, &length, 4);
  payload += text;
  payload += '\0';
}
std::string begin_payload() { return std::string("\0\1\0\0", 4); }

/// ros_discovery_info with Gids of 16 or 24 bytes.
void announce(const std::string& node, std::size_t gid_bytes) {
  static DataWriter* const writer = make_writer("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", true, true);
  const auto put_gid = [gid_bytes](std::string& payload, const rtps::GUID_t& guid) {
    put(payload, guid.guidPrefix.value, 12);
    put(payload, guid.entityId.value, 4);
    payload.append(gid_bytes - 16, '\0');
  };
  std::string payload = begin_payload();
  put_gid(payload, participant->guid());
  const uint32_t one = 1;
  put(payload, &one, 4);
  const auto slash = node.rfind('/');
  put_text(payload, slash == 0 ? "/" : node.substr(0, slash));
  put_text(payload, node.substr(slash + 1));
  for (const auto* list : {&reader_ids, &writer_ids}) {
    while (payload.size() % 4 != 0) payload += '\0';
    const auto count = static_cast<uint32_t>(list->size());
    put(payload, &count, 4);
    for (const auto& guid : *list) put_gid(payload, guid);
  }
  writer->write(&payload);
}

/// As rmw_fastrtps: the response goes to the reader that the request names, when that is matched.
void serve_add(const std::string& service, bool silent, const std::string& user_data) {
  DataReader* const reader = make_reader("rq" + service + "Request", "example_interfaces::srv::dds_::AddTwoInts_Request_", true, false, user_data);
  DataWriter* const writer = make_writer("rr" + service + "Reply", "example_interfaces::srv::dds_::AddTwoInts_Response_", true, false, user_data);
  work.push_back([=] {
    take(reader, [&](const std::string& request, const SampleInfo& info) {
      if (request.size() < 20 || request.size() > 23) fail("a request of " + std::to_string(request.size()) + " bytes");  // another form
      auto identity = info.sample_identity;
      if (info.related_sample_identity.writer_guid() != rtps::GUID_t::unknown()) identity.writer_guid() = info.related_sample_identity.writer_guid();
      else say("no identity");
      const auto a = number_at<int64_t>(request, 4), b = number_at<int64_t>(request, 12);
      say("asked " + std::to_string(a) + " " + std::to_string(b));
      if (silent) return;
      std::string response = begin_payload();
      const int64_t sum = a + b;
      put(response, &sum, 8);
      rtps::WriteParams params;
      params.related_sample_identity() = identity;
      writer->write(&response, params);
    });
  });
}

bool obey(const std::string& line) {
  std::istringstream words(line);
  std::string command, name;
  words >> command >> name;
  if (command == "quit") return false;
  if (command == "writer" || command == "reader") {
    std::string of, reliability, durability, user_data;
    words >> of >> reliability >> durability >> user_data;
    if (command == "writer") {
      writers[name] = make_writer("rt" + of, "std_msgs::msg::dds_::String_", reliability == "reliable", durability == "transient_local", user_data);
    } else {
      DataReader* const reader =
          make_reader("rt" + of, "std_msgs::msg::dds_::String_", reliability == "reliable", durability == "transient_local", user_data);
      work.push_back([reader, name] {
        take(reader, [&](const std::string& payload, const SampleInfo&) {
          if (payload.size() < 8) return;
          say("got " + name + " " + payload.substr(8, number_at<uint32_t>(payload, 4) - 1));
        });
      });
    }
  } else if (command == "write") {
    std::string text;
    words >> text;
    std::string payload = begin_payload();
    put_text(payload, text);
    writers[name]->write(&payload);
  } else if (command == "write_bytes") {
    std::size_t count = 0;
    words >> count;
    std::string payload = begin_payload();
    put_text(payload, std::string(count, 'x'));
    writers[name]->write(&payload);
  } else if (command == "serve_add") {
    std::string mode, user_data;
    words >> mode >> user_data;
    serve_add(name, mode == "silent", user_data);
  } else if (command == "node") {
    announce(name, 16);
  } else if (command == "node24") {
    announce(name, 24);
  } else if (command == "endpoints") {
    std::string prefix;
    words >> prefix;
    for (int i = 0; i < std::atoi(name.c_str()); ++i) make_writer("rt/" + prefix + std::to_string(i), "std_msgs::msg::dds_::String_");
  } else {
    say("unknown " + command);
    return true;
  }
  say("done " + command);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  DomainParticipantQos qos;
  const std::string user_data = argc > 3 ? argv[3] : "enclave=/;";
  qos.user_data().data_vec(std::vector<rtps::octet>(user_data.begin(), user_data.end()));
  qos.transport().use_builtin_transports = false;
  const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  qos.transport().user_transports.push_back(udp);
  const int lease = std::atoi(argv[2]);
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = Lease(lease / 1000, static_cast<uint32_t>(lease % 1000) * 1'000'000U);
  discovery.leaseDuration_announcementperiod = Lease(0, 300'000'000U);
  participant = DomainParticipantFactory::get_instance()->create_participant(static_cast<uint32_t>(std::atoi(argv[1])), qos);
  if (participant == nullptr) fail("participant");
  publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  say("ready");
  std::string input;
  for (;;) {
    for (std::size_t i = 0; i < work.size(); ++i) work[i]();
    pollfd waiting{STDIN_FILENO, POLLIN, 0};
    if (::poll(&waiting, 1, 2) <= 0) continue;
    char bytes[4096];
    const auto count = ::read(STDIN_FILENO, bytes, sizeof bytes);
    if (count <= 0) break;
    input.append(bytes, static_cast<std::size_t>(count));
    for (auto end = input.find('\n'); end != std::string::npos; end = input.find('\n')) {
      const std::string line = input.substr(0, end);
      input.erase(0, end + 1);
      if (!obey(line)) {
        participant->delete_contained_entities();
        DomainParticipantFactory::get_instance()->delete_participant(participant);
        return 0;
      }
    }
  }
  return 0;
}
