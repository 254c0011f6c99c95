// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/ros2/definitions.hpp>
#include <lrt/ros2/graph.hpp>

namespace lrt {
inline namespace v0 {
class Server;
}  // namespace v0
}  // namespace lrt

/// A ROS 2 graph as Linked Robotic Things, by DDS: no ROS is installed, and no node is changed. It is a library of its own,
/// lrt::ros2. The guide is docs/ros2.md.
namespace lrt::ros2 {
inline namespace v0 {

/// What clients may do. All is read-only by default. Patterns are of names in ROS: "/cmd_vel", "/arm/*" (`*` matches any
/// characters but '/', `**` any characters).
struct Allowed {
  std::vector<std::string> topics{};      ///< that are written
  std::vector<std::string> services{};    ///< that are called
  std::vector<std::string> actions{};     ///< that get goals
  std::vector<std::string> parameters{};  ///< that are set: "/arm/driver:max_speed", "/arm/**:*"
  std::vector<std::string> lifecycle{};   ///< nodes whose transitions are requested
};

/// What is said of a topic, a type, a service or a parameter beyond the shipped table: units, frames, titles, names. Made of a file, see
/// docs/ros2.md.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API Mapping {
 public:
  Mapping();  ///< the shipped table alone
  Mapping(const Mapping&);
  Mapping(Mapping&&) noexcept;
  Mapping& operator=(const Mapping&);
  Mapping& operator=(Mapping&&) noexcept;
  ~Mapping();
  /// Reads a text in TOML or Turtle; what it says comes before the shipped table. A second call adds.
  /// @param format  "text/turtle" or "application/toml"
  /// @par Errors  expected_rdf, expected_value: with line; limit_exceeded
  Result<void> add(std::string_view text, std::string_view format);
  /// Reads a file: .toml or .ttl.
  /// @par Errors  io_error, unsupported_syntax, and those of add() with the file's name before the message
  Result<void> add_file(const std::string& file);

  /// @cond internal
  struct Rules;
  const Rules& rules() const noexcept;
  static Mapping of(Rules rules);
  /// @endcond

 private:
  std::shared_ptr<Rules> rules_;
};

/// Limits of what is published, beside GraphLimits and DefinitionLimits.
struct BridgeLimits {
  std::size_t max_things = 4'096;             ///< Things of the bridge; what is beyond is left out, and counted
  std::size_t max_value_bytes = 1024 * 1024;  ///< payload of a topic that is a value in RDF and JSON; larger ones have only representations of bytes
  std::size_t max_representation_bytes = 32 * 1024 * 1024;  ///< of an image or a cloud
  std::chrono::milliseconds minimum_interval{0};            ///< between two samples of one topic that are taken; 0: each
  std::chrono::milliseconds large_interval{100};            ///< the same for topics with representations of bytes
  std::chrono::milliseconds command_life{500};              ///< a written Twist lives so long; then zero is written
  std::size_t max_parameters = 1'000;                       ///< of one node
  std::size_t max_kept_bytes = 512 * 1024 * 1024;  ///< newest samples of all topics together, and robot descriptions; what is beyond it is dropped
  /// Types of topics, services and actions that are made while the bridge exists; what needs a further one has no resource. They are kept for the life of
  /// the process, because what is gone may return.
  std::size_t max_types = 4'096;
  std::size_t max_type_members = 100'000;  ///< fields of all those types, counted each time that they occur: about 550 bytes each
};

/// Options of a bridge.
struct Options {
  GraphOptions graph{};                    ///< where the graph is
  std::vector<std::string> definitions{};  ///< folders, see Definitions::add_folder()
  DefinitionLimits definition_limits{};    ///< of what nodes send
  std::vector<std::string> namespaces{};   ///< only what is below these names: "/arm"; empty: all
  /// Where the Things are: below "robots/r7"; empty: below the root. A topic, a service or an action of ROS has the Thing of its
  /// name ("/arm/scan": "arm/scan"), a node that of "nodes" and its name, a robot description "robot", a frame of tf "frames" and its name.
  std::string path{};
  Allowed allowed{};                     ///< what clients may do
  Mapping mapping{};                     ///< of the user
  std::string robot_description{};       ///< a URDF that is used instead of the topic /robot_description; empty: that of the topic
  std::string robot_description_file{};  ///< the same, as a file; empty: none
  BridgeLimits limits{};                 ///< memory and rates
  LogCallback log{};                     ///< empty: messages are dropped
};

/// What a bridge has made of one thing in the graph, for `lrt-ros2 --list`.
struct Listed {
  /// What it is.
  enum class What : std::uint8_t { node, topic, service, action, parameter };
  What what = What::topic;           ///< kind
  std::string name{};                ///< in ROS
  std::string type{};                ///< "sensor_msgs/msg/Imu"; of a parameter "double"
  std::vector<std::string> nodes{};  ///< that have it
  std::string path{};                ///< of its resource on the server, "/arm/joint_states"; empty: none
  std::string as{};                  ///< what it is there: "Property", "writable Property", "Action", "Thing of each joint"
  std::string reason{};              ///< why it has no resource, or is read-only, or is unavailable; may be empty
};

/// Numbers of a bridge since its creation.
struct Counters {
  GraphCounters graph{};        ///< of its graph
  std::size_t things = 0;       ///< now
  std::size_t properties = 0;   ///< now
  std::size_t actions = 0;      ///< now
  std::size_t unavailable = 0;  ///< resources whose source is gone now
  std::size_t left_out = 0;     ///< what is there and has no resource now
  std::uint64_t decoded = 0;    ///< samples that were decoded, because somebody read or observed
  std::uint64_t malformed = 0;  ///< samples that are no value
  std::uint64_t commands = 0;   ///< samples written, services called, goals sent, parameters set
};

/// Joins a graph and keeps its Things on a server: as nodes and topics come and go, Things are added, and what is gone is
/// unavailable until it returns, with the same URIs.
///
///     auto server = lrt::Server::create().value();
///     lrt::ros2::Options options;
///     options.allowed.topics = {"/cmd_vel"};
///     auto bridge = lrt::ros2::Bridge::create(server, options).value();
///     server.run();
///
/// The host adds Things of its own as usual, with paths that the bridge does not use.
///
/// A topic is a Thing with the Property `value`, whose time is header.stamp or the time of its writer. Types with many bytes have further ones:
/// `image` (PNG, JPEG, bytes), `points` and `data` (bytes), `ranges` (octets). A service is a Thing with the Action `call`, an action one with
/// the Action `send_goal` and the Property `feedback`. A node is a Thing with its parameters (`parameters/NAME`) and the state and transitions of
/// a lifecycle node. A robot description is a Thing for each joint and link (lrt/urdf.hpp), which JointState moves; a frame of tf one with its `pose`.
///
/// A command for a parameter waits for the node: with Threads::executor there, at most 5 s, else where Threads::dispatch says, at most 0.5 s.
///
/// A bridge must not outlive its server.
///
/// @par Threads  Any. It has one thread of its own, besides those of its graph. Not from a lambda of the server.
class LRT_API Bridge {
 public:
  /// Joins the graph.
  /// @par Errors  invalid_option, io_error (the file of the robot description), those of Graph::join() and Definitions::add_folder()
  static Result<Bridge> create(Server& server, Options options = {});
  Bridge(Bridge&&) noexcept;
  Bridge& operator=(Bridge&&) noexcept;
  /// Removes its Things and leaves the graph.
  ~Bridge();

  /// What is in the graph, and what the bridge has made of it, in order of the names.
  std::vector<Listed> list() const;
  /// Waits until the graph has been quiet for a moment and all types that can be known are, or for `limit`.
  /// @return  false: the time is over
  bool wait_until_settled(std::chrono::milliseconds limit) const;
  Graph& graph() noexcept;              ///< its graph, for what the host itself reads and writes
  Definitions& definitions() noexcept;  ///< its definitions
  Counters counters() const;            ///< since its creation

 private:
  class Impl;
  explicit Bridge(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::ros2
