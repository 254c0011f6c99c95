// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::ros2 {
inline namespace v0 {

class Definitions;
class GraphCore;

/// Limits of what the network can use. Whatever is beyond a limit is left out and counted (GraphCounters); what was there
/// before stays.
struct GraphLimits {
  std::size_t max_participants = 256;                 ///< of others
  std::size_t max_endpoints = 16'384;                 ///< readers and writers of others
  std::size_t max_endpoints_of_participant = 4'096;   ///< of one participant, so that a stranger leaves room for the robot
  std::size_t max_name_bytes = 256;                   ///< of the name of a topic, type or node
  std::size_t max_user_data_bytes = 1'024;            ///< of a participant or an endpoint
  std::size_t max_subscriptions = 1'024;              ///< readers of this graph
  std::size_t max_sample_bytes = 64 * 1024 * 1024;    ///< a larger sample is dropped
  std::size_t max_waiting_bytes = 256 * 1024 * 1024;  ///< of samples that DDS has received in part or that wait for a sink
  std::size_t max_calls = 256;                        ///< calls of services without a response, goals included; more: limit_exceeded
  std::size_t max_goals = 64;                         ///< goals that have not ended
};

/// Where a graph is, and who is let in.
struct GraphOptions {
  unsigned domain = 0;             ///< 0 to 232: ROS_DOMAIN_ID
  std::string node = "/lrt_ros2";  ///< the full name of the node that others see
  /// Network interfaces by address or name ("127.0.0.1", "eth0"). Empty: all. Only loopback: {"127.0.0.1"}, as
  /// ROS_LOCALHOST_ONLY=1.
  std::vector<std::string> interfaces{};
  /// Addresses of participants that multicast does not reach, "10.0.0.7". Empty: multicast only.
  std::vector<std::string> peers{};
  bool multicast = true;       ///< false: only `peers` are looked for
  bool shared_memory = false;  ///< samples from this machine by shared memory. Whoever may write there can then write into this process's memory pool
  /// Participants of these addresses only: "10.0.0.7", "10.0.0.0/24". Empty: all that the interfaces reach.
  std::vector<std::string> allowed_addresses{};
  GraphLimits limits{};                   ///< memory
  std::chrono::milliseconds settle{300};  ///< changes within this time are announced together
  ThreadOptions thread{};                 ///< of the graph's own thread; DDS starts threads of its own
  LogCallback log{};                      ///< empty: messages are dropped
};

/// The identity of a reader, a writer or a participant. Unique in a domain.
struct Gid {
  std::array<std::uint8_t, 16> bytes{};  ///< prefix of 12, entity of 4
  friend bool operator==(const Gid& a, const Gid& b) noexcept { return a.bytes == b.bytes; }
  friend bool operator!=(const Gid& a, const Gid& b) noexcept { return a.bytes != b.bytes; }
  friend bool operator<(const Gid& a, const Gid& b) noexcept { return a.bytes < b.bytes; }
};

/// Quality of service as an endpoint announces it.
struct Qos {
  bool reliable = false;         ///< false: best effort
  bool transient_local = false;  ///< late readers get what was written before (map, robot_description, tf_static); false: volatile
  std::optional<std::chrono::nanoseconds> deadline{};    ///< a sample comes at least this often; nullopt: not stated
  std::optional<std::chrono::nanoseconds> lifespan{};    ///< how long a sample is valid; nullopt: for ever
  std::optional<std::chrono::nanoseconds> liveliness{};  ///< lease; nullopt: not stated
  bool manual_liveliness = false;                        ///< by topic; false: automatic
};

/// A reader or writer of others.
struct Endpoint {
  Gid gid{};           ///< its identity
  std::string node{};  ///< "/arm/driver"; empty: not known (yet)
  std::string type{};  ///< "sensor_msgs/msg/Imu"; a type that is not of ROS 2 as DDS names it
  std::string hash{};  ///< see Message::hash; empty: not announced (Humble, Cyclone's own programs)
  Qos qos{};           ///< that it offers, or asks for
};

/// A topic, by its name in ROS: "/joint_states".
struct Topic {
  std::string name{};               ///< in ROS
  std::vector<Endpoint> writers{};  ///< in order of their gids, so of no time
  std::vector<Endpoint> readers{};  ///< the same
};

/// How a service carries the identity of a request.
enum class IdentityForm : std::uint8_t {
  unknown,     ///< in doubt: nothing is sent to it
  header,      ///< 16 bytes before the request in the payload: RMW of Cyclone
  inline_qos,  ///< related_sample_identity: RMW of Fast DDS
};

/// A service, by its name in ROS: "/gripper/open". Services of actions are not among them.
struct ServiceInfo {
  std::string name{};                         ///< in ROS
  std::string type{};                         ///< "std_srvs/srv/Trigger"
  std::string hash{};                         ///< of the service's type; empty: not announced
  std::vector<std::string> nodes{};           ///< that serve it
  IdentityForm form = IdentityForm::unknown;  ///< of its servers; unknown also if they differ
  bool is_ready = false;                      ///< a server is there with both of its endpoints, and its form is known
};

/// An action, by its name in ROS: "/arm/follow_joint_trajectory".
struct ActionInfo {
  std::string name{};                ///< in ROS
  std::string type{};                ///< "control_msgs/action/FollowJointTrajectory"
  std::vector<std::string> nodes{};  ///< that serve it
  bool is_ready = false;             ///< its three services are ready
};

/// A node.
struct NodeInfo {
  std::string name{};            ///< "/arm/driver"
  Gid participant{};             ///< that it belongs to
  bool has_parameters = false;   ///< it serves list_, describe_, get_ and set_parameters
  bool has_lifecycle = false;    ///< it serves get_state, change_state, get_available_transitions
  bool describes_types = false;  ///< it serves get_type_description
};

/// Who is there at one time. Each list is in order of the names. This graph's own node and endpoints are not in it.
/// @par Threads  Distinct objects: any thread. One that does not change: several threads.
struct LRT_API GraphSnapshot {
  std::uint64_t version = 0;            ///< grows with each change
  std::vector<NodeInfo> nodes{};        ///< that ros_discovery_info names
  std::vector<Topic> topics{};          ///< without those of services and actions, and without ros_discovery_info
  std::vector<ServiceInfo> services{};  ///< without those of actions
  std::vector<ActionInfo> actions{};    ///< that have a server

  /// @{
  /// By name; nullptr: it is not there. Valid as long as the snapshot.
  const Topic* topic(std::string_view name) const noexcept;
  const ServiceInfo* service(std::string_view name) const noexcept;
  const ActionInfo* action(std::string_view name) const noexcept;
  const NodeInfo* node(std::string_view name) const noexcept;
  /// @}
};

/// Numbers of a graph since it joined.
struct GraphCounters {
  std::uint64_t samples = 0;               ///< passed to sinks
  std::uint64_t sample_bytes = 0;          ///< of their payloads
  std::uint64_t lost_samples = 0;          ///< that DDS reports as lost
  std::uint64_t large_samples = 0;         ///< dropped: GraphLimits::max_sample_bytes
  std::uint64_t other_version = 0;         ///< dropped: their writer announces another hash (SubscribeOptions::hash)
  std::uint64_t refused_participants = 0;  ///< beyond limits or not of an allowed address
  std::uint64_t refused_endpoints = 0;     ///< beyond limits, or with names that are none
  std::size_t participants = 0;            ///< now
  std::size_t endpoints = 0;               ///< now
  std::size_t subscriptions = 0;           ///< now
  std::size_t calls = 0;                   ///< now
  std::uint64_t malformed_packets = 0;     ///< dropped before Fast DDS: they break the form of RTPS, or speak for another participant
};

/// One sample of a topic.
struct Sample {
  Bytes payload{};                                   ///< CDR with its encapsulation, never null
  std::chrono::system_clock::time_point source{};    ///< when its writer wrote it, by the writer's clock; epoch: not stated
  std::chrono::system_clock::time_point received{};  ///< by this machine's clock
  Gid writer{};                                      ///< who wrote it
};
/// Takes samples. Must not throw, wait or lock for long: it runs on a thread of DDS, never concurrently with itself.
using Sink = UniqueFunction<void(Sample&& sample)>;

/// How a topic is read.
struct SubscribeOptions {
  std::string hash{};     ///< samples of writers that announce another one are dropped and counted; empty: all are taken
  std::size_t depth = 1;  ///< samples that DDS keeps until the sink has taken them
  /// At least this long between two samples of one writer, the ones between are dropped before they are copied; 0: all
  std::chrono::nanoseconds minimum_interval{0};
};
/// How a topic is written.
struct AdvertiseOptions {
  std::string hash{};            ///< announced to others; empty: none
  bool reliable = true;          ///< fits readers of both kinds
  bool transient_local = false;  ///< late readers get the last `depth` samples
  std::size_t depth = 1;         ///< samples that are kept for readers that are slow; older ones are dropped
};

/// Ends reading when it goes out of scope: the sink is not called afterwards, and a call of it has returned, unless the sink
/// itself destroys it. May outlive its graph.
/// @par Threads  Distinct objects: any. One object: one at a time.
class LRT_API Subscription {
 public:
  Subscription() noexcept;
  Subscription(Subscription&&) noexcept;
  Subscription& operator=(Subscription&&) noexcept;
  ~Subscription();
  explicit operator bool() const noexcept { return state_ != nullptr; }  ///< false: empty

  /// @cond internal
  struct State;
  /// @endcond

 private:
  friend class GraphCore;
  explicit Subscription(std::shared_ptr<State> state) noexcept;
  std::shared_ptr<State> state_;
};

/// Writes a topic until it goes out of scope. May outlive its graph.
/// @par Threads  Any.
class LRT_API Publisher {
 public:
  Publisher() noexcept;
  Publisher(Publisher&&) noexcept;
  Publisher& operator=(Publisher&&) noexcept;
  ~Publisher();
  explicit operator bool() const noexcept { return state_ != nullptr; }  ///< false: empty

  /// Writes a sample: CDR with its encapsulation.
  /// @par Errors  limit_exceeded, closed, io_error; expected_value: no encapsulation. No reader is no error, see readers().
  /// @par Time    Copies the payload, allocates, and may send on this thread. Never waits for a reader.
  Result<void> publish(std::string_view payload) const;
  /// How many readers of others it is matched with.
  std::size_t readers() const noexcept;

  /// @cond internal
  struct State;
  /// @endcond

 private:
  friend class GraphCore;
  explicit Publisher(std::shared_ptr<State> state) noexcept;
  std::shared_ptr<State> state_;
};

/// A call of a service that waits for its response. Destroying it gives the call up: its callback is not called
/// afterwards. The request has been sent all the same.
/// @par Threads  Distinct objects: any. One object: one at a time.
class LRT_API Call {
 public:
  Call() noexcept;
  Call(Call&&) noexcept;
  Call& operator=(Call&&) noexcept;
  ~Call();
  explicit operator bool() const noexcept { return state_ != nullptr; }  ///< false: empty

  /// @cond internal
  struct State;
  /// @endcond

 private:
  friend class GraphCore;
  explicit Call(std::shared_ptr<State> state) noexcept;
  std::shared_ptr<State> state_;
};

/// The states of a goal: action_msgs/msg/GoalStatus.
enum class GoalStatus : std::int8_t { unknown = 0, accepted = 1, executing = 2, canceling = 3, succeeded = 4, canceled = 5, aborted = 6 };

/// What a goal tells its sender. All are called on the graph's thread, in the order of what happens, and none after
/// `ended`. Each may be empty.
struct GoalEvents {
  UniqueFunction<void()> accepted{};                       ///< the server takes the goal
  UniqueFunction<void(const Bytes& feedback)> feedback{};  ///< payload of ActionDefinition::feedback_message
  UniqueFunction<void(GoalStatus status)> status{};        ///< it has changed
  /// The end: the payload of ActionDefinition::get_result_response, whose status is `status`; or an error. refused: the server rejects the goal; unavailable: no
  /// server, or it is gone; timed_out: no response to the goal in time; unconfirmed: sent, and the server is gone before its response: it may run.
  UniqueFunction<void(Result<Bytes> response, GoalStatus status)> ended{};
};

/// A goal of an action. Destroying it lets the goal run; its events are not called afterwards.
/// @par Threads  Distinct objects: any. One object: one at a time, except cancel().
class LRT_API Goal {
 public:
  Goal() noexcept;
  Goal(Goal&&) noexcept;
  Goal& operator=(Goal&&) noexcept;
  ~Goal();
  explicit operator bool() const noexcept { return state_ != nullptr; }  ///< false: empty
  /// Requests that the server cancels it. `ended` comes as the server decides. Before the goal is accepted, it is cancelled when it is.
  /// @par Threads  Any.
  void cancel() const;

  /// @cond internal
  struct State;
  /// @endcond

 private:
  friend class GraphCore;
  explicit Goal(std::shared_ptr<State> state) noexcept;
  std::shared_ptr<State> state_;
};

/// The types of parameters: rcl_interfaces/msg/ParameterType.
enum class ParameterType : std::uint8_t {
  not_set = 0,
  boolean = 1,
  integer = 2,
  real = 3,
  text = 4,
  bytes = 5,
  booleans = 6,
  integers = 7,
  reals = 8,
  texts = 9,
};
/// A parameter of a node, with its descriptor.
struct Parameter {
  std::string name{};                           ///< "max_speed", "arm.gains"
  ParameterType type = ParameterType::not_set;  ///< of its value
  /// boolean, integer, real, text; bytes: a text in base64; lists: a sequence; null: not set
  rdf::Value value{};
  std::string description{};  ///< of the descriptor
  std::string constraints{};  ///< `additional_constraints` of the descriptor, a sentence
  bool read_only = false;     ///< it cannot be set while the node runs
  bool dynamic_type = false;  ///< it may be set to a value of another type
  /// The range of an integer or a real.
  struct Range {
    double from = 0;  ///< least value
    double to = 0;    ///< greatest value
    double step = 0;  ///< between two values, from `from` on; 0: any value
  };
  std::optional<Range> range{};  ///< of the descriptor; nullopt: none
};

/// A graph of ROS 2: one participant of DDS in one domain.
///
/// Payloads are passed as bytes; MessageType reads and makes them. The graph itself needs definitions only for parameters
/// and descriptions of types, which are shipped.
///
/// @par Threads  Any, except that destroying it is not for its own callbacks. Sinks run on threads of DDS; all other callbacks on one thread of the
///               graph, one at a time. They may call functions of the graph. They must not throw.
class LRT_API Graph {
 public:
  /// Joins the domain. Others are found afterwards, usually within a second.
  /// @par Errors  invalid_option: domain, names, interfaces; io_error: DDS refuses, with the reason
  static Result<Graph> join(GraphOptions options = {});
  Graph(Graph&&) noexcept;
  Graph& operator=(Graph&&) noexcept;
  /// Leaves the domain. Calls and goals end with `closed`.
  ~Graph();

  /// Who is there. Never null, never changed.
  std::shared_ptr<const GraphSnapshot> snapshot() const;
  /// Calls `f` soon after each change, and once when it is set; changes within GraphOptions::settle together. One function; empty: none.
  void on_change(UniqueFunction<void()> f);

  /// Reads a topic. It need not be there yet. The reader takes the QoS that the present writers offer, and is made again when
  /// writers come that it does not fit: reliable if all are, transient local if all are.
  /// @param type  "sensor_msgs/msg/Imu": writers of another type name are not read
  /// @par Errors  invalid_option (names), limit_exceeded, closed. The reader is made on the graph's thread; if DDS refuses that, the log says so
  Result<Subscription> subscribe(std::string_view topic, std::string_view type, Sink sink, const SubscribeOptions& options = {});
  /// Writes a topic.
  /// @par Errors  as subscribe(); io_error
  Result<Publisher> advertise(std::string_view topic, std::string_view type, const AdvertiseOptions& options = {});

  /// Calls a service in the form of its server.
  /// @param request   payload of Service::request, with its encapsulation
  /// @param response  called exactly once, unless the Call is destroyed first: the payload of Service::response; or unavailable: no server that is
  ///                  ready, or whose form is in doubt; unconfirmed: it is gone since the request was sent; timed_out; closed
  /// @par Errors  limit_exceeded, closed; expected_value: `request` is no payload. `response` is not called then
  Result<Call> call(std::string_view service, std::string_view type, std::string_view request, UniqueFunction<void(Result<Bytes> response)> response,
                    std::chrono::milliseconds timeout = std::chrono::seconds(10));
  /// Sends a goal.
  /// @param request  payload of ActionDefinition::send_goal_request. Its goal_id is replaced by a new random one
  /// @par Errors  as call()
  Result<Goal> send_goal(std::string_view action, std::string_view type, std::string_view request, GoalEvents events,
                         std::chrono::milliseconds timeout = std::chrono::seconds(10));

  /// Reads all parameters of a node, with descriptors.
  /// @param max  more are left out
  Result<Call> parameters(std::string_view node, UniqueFunction<void(Result<std::vector<Parameter>>)> done, std::size_t max = 1'000,
                          std::chrono::milliseconds timeout = std::chrono::seconds(10));
  /// Sets one parameter. `done` gets refused with the node's reason if it does not take the value.
  Result<Call> set_parameter(std::string_view node, const Parameter& parameter, UniqueFunction<void(Result<void>)> done,
                             std::chrono::milliseconds timeout = std::chrono::seconds(10));
  /// Parameters that nodes have changed, added (`parameters` with values) or deleted (`deleted`): the topic /parameter_events. Values only, no descriptors.
  Result<Subscription> parameter_events(
      UniqueFunction<void(std::string_view node, std::vector<Parameter> parameters, std::vector<std::string> deleted)> changed);

  /// Asks nodes that use a type for its definition, one after the other until one responds, and adds it to `definitions`.
  /// @param type         "demo/msg/Thing", "demo/srv/Grasp", "demo/action/Wave"
  ///                     A node describes the parts of an action: "demo/action/Wave_SendGoal", `_GetResult` and `_FeedbackMessage`
  /// @param hash         as announced; empty: the one that all nodes with the type announce. Nodes that announce none do not respond
  /// @param definitions  must live until `done` was called or the Call is destroyed
  /// @par Errors  `done` gets unavailable: no node of this type describes types; else as call() and Definitions::add_type_description()
  Result<Call> request_definition(std::string_view type, std::string_view hash, Definitions& definitions, UniqueFunction<void(Result<void>)> done,
                                  std::chrono::milliseconds timeout = std::chrono::seconds(5));

  GraphCounters counters() const noexcept;       ///< since it joined
  const GraphOptions& options() const noexcept;  ///< as given

 private:
  class Impl;
  explicit Graph(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::ros2
