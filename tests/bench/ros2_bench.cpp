// SPDX-License-Identifier: Apache-2.0
// What a graph of ROS 2 costs: 60 topics of sensor_msgs/JointState at 100 Hz and one at 1 kHz, on loopback, 7,000 samples a second.
//
//   ros2_bench [SECONDS]      writes a table: CPU time of each reader below, in its own process, while another process writes
//   ros2_bench READER DOMAIN SECONDS
//
//   bare      Fast DDS alone: 61 readers, each sample decoded by Fast CDR into a struct
//   graph     lrt::ros2::Graph: each sample is passed to a sink, which drops it
//   decode    the same, and each sample is decoded by MessageType
//   bridge    lrt::ros2::Bridge with a server, and nobody reads
//   watched   the same, and each joint's state and each topic is subscribed to in JSON, each change but at most 10 a second for one resource
#if __has_include(<fastdds/dds/core/ReturnCode.hpp>)
#error "ros2_bench is written for Fast DDS 2"
#endif
#include <sys/resource.h>
#include <csignal>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <lrt/feed.hpp>
#include <lrt/ros2.hpp>
#include <lrt/ros2/message_type.hpp>
#include <lrt/server.hpp>

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

constexpr int topics = 61;  // the last one is the fast one
constexpr const char* type_name = "sensor_msgs/msg/JointState";
std::string topic_name(int i) { return i + 1 == topics ? "/fast" : "/arm" + std::to_string(i) + "/joint_states"; }

double cpu_seconds() {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

std::atomic<std::uint64_t> samples{0};

/// Waits until samples come, and measures.
void measure(int seconds) {
  for (int i = 0; i < 200 && samples < 2'000; ++i) std::this_thread::sleep_for(50ms);
  std::this_thread::sleep_for(1s);
  const std::uint64_t first = samples;
  const double cpu = cpu_seconds();
  const Clock::time_point begin = Clock::now();
  std::this_thread::sleep_for(std::chrono::seconds(seconds));
  const double wall = std::chrono::duration<double>(Clock::now() - begin).count();
  std::printf("%6.1f %% of a CPU, %6.0f samples/s", 100 * (cpu_seconds() - cpu) / wall, static_cast<double>(samples - first) / wall);
  std::fflush(stdout);
}

struct JointState {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  std::string frame_id;
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;
};

class JointStateType final : public dds::TopicDataType {
 public:
  JointStateType() {
    setName("sensor_msgs::msg::dds_::JointState_");
    m_typeSize = 4'096;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void*, rtps::SerializedPayload_t*) override { return false; }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    auto& to = *static_cast<JointState*>(data);
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    eprosima::fastcdr::Cdr in(buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR);
    in.read_encapsulation();
    in >> to.sec >> to.nanosec >> to.frame_id >> to.name >> to.position >> to.velocity >> to.effort;
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 4'096U; };
  }
  void* createData() override { return new JointState; }
  void deleteData(void* data) override { delete static_cast<JointState*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

struct Listener final : dds::DataReaderListener {
  JointState state;
  void on_data_available(dds::DataReader* reader) override {
    dds::SampleInfo info;
    while (reader->take_next_sample(&state, &info) == ReturnCode_t::RETCODE_OK) ++samples;
  }
};

int bare(unsigned domain, int seconds) {
  dds::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().user_transports.push_back(udp);
  dds::DomainParticipant* const participant = dds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
  dds::TypeSupport type(new JointStateType);
  type.register_type(participant);
  dds::Subscriber* const subscriber = participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  std::array<Listener, topics> listeners;
  for (int i = 0; i < topics; ++i) {
    dds::Topic* const topic = participant->create_topic("rt" + topic_name(i), type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
    dds::DataReaderQos reader;
    reader.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    reader.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    reader.data_sharing().off();
    if (!subscriber->create_datareader(topic, reader, &listeners[static_cast<std::size_t>(i)])) return 1;
  }
  measure(seconds);
  std::fflush(stdout);
  std::_Exit(0);
}

lrt::ros2::GraphOptions graph_options(unsigned domain) {
  lrt::ros2::GraphOptions options;
  options.domain = domain;
  options.interfaces = {"127.0.0.1"};
  return options;
}

int graph(unsigned domain, int seconds, bool decode) {
  lrt::ros2::Graph joined = lrt::ros2::Graph::join(graph_options(domain)).value();
  const auto type = lrt::ros2::MessageType::of(lrt::ros2::Definitions().message(type_name).value()).value();
  std::vector<lrt::ros2::Subscription> subscriptions;
  for (int i = 0; i < topics; ++i)
    subscriptions.push_back(joined
                                .subscribe(topic_name(i), type_name,
                                           [&type, decode](lrt::ros2::Sample&& sample) {
                                             if (decode && !type.decode(*sample.payload)) std::abort();
                                             ++samples;
                                           })
                                .value());
  measure(seconds);
  return 0;
}

int bridge(unsigned domain, int seconds, bool watched) {
  lrt::Options options;
  options.listen.port = 0;
  lrt::Server server = lrt::Server::create(options).value();
  lrt::ros2::Options bridged;
  bridged.graph = graph_options(domain);
  lrt::ros2::Bridge robot = lrt::ros2::Bridge::create(server, bridged).value();
  server.start();
  robot.wait_until_settled(10s);
  std::atomic<bool> ends{false};
  std::atomic<std::uint64_t> messages{0};
  std::thread counter([&] {
    while (!ends) {
      samples = robot.counters().graph.samples;
      std::this_thread::sleep_for(50ms);
    }
  });
  std::thread watcher;
  if (watched)
    watcher = std::thread([&] {
      lrt::Feed feed = lrt::Feed::create(server).value();
      while (!ends) {
        const lrt::Feed::Batch batch = feed.take({});
        for (const auto& resource : batch.resources) {
          if (resource.kind != "property") continue;
          lrt::engine::FeedSubscription wanted;
          wanted.path = resource.path;
          wanted.media_type = "application/json";
          wanted.minimum_interval = 100ms;
          (void)feed.add(wanted);
        }
        messages += batch.messages.size();
        if (!batch.more) std::this_thread::sleep_for(10ms);
      }
    });
  measure(seconds);
  const auto counters = robot.counters();
  std::printf(", %zu properties, %llu decoded in all, %llu messages", counters.properties, static_cast<unsigned long long>(counters.decoded),
              static_cast<unsigned long long>(messages.load()));
  ends = true;
  counter.join();
  if (watcher.joinable()) watcher.join();
  return 0;
}

int write(unsigned domain, int seconds) {
  lrt::ros2::Graph joined = lrt::ros2::Graph::join(graph_options(domain)).value();
  std::vector<lrt::ros2::Publisher> publishers;
  for (int i = 0; i < topics; ++i) publishers.push_back(joined.advertise(topic_name(i), type_name).value());
  const auto type = lrt::ros2::MessageType::of(lrt::ros2::Definitions().message(type_name).value()).value();
  using Value = lrt::rdf::Value;
  Value::Sequence names, numbers;
  for (int i = 0; i < 7; ++i) {
    names.emplace_back("joint_" + std::to_string(i));
    numbers.emplace_back(0.125 * i);
  }
  double position = 0;
  Clock::time_point next = Clock::now();
  const Clock::time_point end = next + std::chrono::seconds(seconds);
  for (std::uint64_t step = 0; next < end; ++step, next += 1ms) {
    std::this_thread::sleep_until(next);
    numbers[0] = Value(position += 0.001);
    const auto now = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
    const Value header(Value::Sequence{Value(std::int64_t{now}), Value(std::string("base"))});
    const std::string payload = type.encode(Value(Value::Sequence{header, Value(names), Value(numbers), Value(numbers), Value(numbers)})).value();
    (void)publishers.back().publish(payload);
    for (int i = 0; i + 1 < topics; ++i)
      if ((step + static_cast<std::uint64_t>(i)) % 10 == 0) (void)publishers[static_cast<std::size_t>(i)].publish(payload);
  }
  return 0;
}

pid_t begin(const char* program, const char* what, unsigned domain, int seconds) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::execl(program, program, what, std::to_string(domain).c_str(), std::to_string(seconds).c_str(), static_cast<char*>(nullptr));
  std::_Exit(127);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    const int seconds = argc > 1 ? std::atoi(argv[1]) : 10;
    unsigned domain = 60 + static_cast<unsigned>(::getpid()) % 100;
    for (const char* reader : {"bare", "graph", "decode", "bridge", "watched"}) {
      std::printf("%-8s ", reader);
      std::fflush(stdout);
      const pid_t writer = begin("/proc/self/exe", "write", domain, seconds + 20), other = begin("/proc/self/exe", reader, domain, seconds);
      int status = 0;
      ::waitpid(other, &status, 0);
      ::kill(writer, SIGKILL);
      ::waitpid(writer, nullptr, 0);
      std::printf("%s\n", status == 0 ? "" : " failed");
      ++domain;
    }
    return 0;
  }
  const std::string what = argv[1];
  const auto domain = static_cast<unsigned>(std::atoi(argv[2]));
  const int seconds = std::atoi(argv[3]);
  if (what == "bare") return bare(domain, seconds);
  if (what == "write") return write(domain, seconds);
  if (what == "bridge" || what == "watched") return bridge(domain, seconds, what == "watched");
  return graph(domain, seconds, what == "decode");
}
