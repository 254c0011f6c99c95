// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::ros2 {
inline namespace v0 {

/// The types of fields of .msg, .srv and .action.
enum class Kind : std::uint8_t {
  boolean,    ///< bool
  octet,      ///< byte: a number of 0 to 255
  character,  ///< char: a number of 0 to 255
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string,   ///< UTF-8 by agreement, bytes in fact
  wstring,  ///< UTF-16
  message,  ///< another message
};

/// How many values a field has.
enum class Arity : std::uint8_t {
  single,            ///< one
  array,             ///< exactly `size`
  bounded_sequence,  ///< 0 to `size`
  sequence,          ///< any number
};

struct Message;

/// The type of a field.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct FieldType {
  Kind kind = Kind::boolean;                 ///< of one value
  Arity arity = Arity::single;               ///< how many values
  std::uint32_t size = 0;                    ///< of an array: length; of a bounded sequence: longest; else 0
  std::uint32_t text_bound = 0;              ///< string: bytes; wstring: UTF-16 code units; 0: no bound
  std::shared_ptr<const Message> message{};  ///< Kind::message: its definition; else null
};

/// A field of a message.
struct Field {
  std::string name;                     ///< lower case, "frame_id"
  FieldType type{};                     ///< of its values
  std::optional<rdf::Value> initial{};  ///< its default; nullopt: none is stated, so it is 0, false, "" or empty
  std::string comment{};                ///< of the lines before it and behind it, without '#'; may be empty
};

/// A constant of a message.
struct Constant {
  std::string name;         ///< upper case, "STATUS_FIX"
  Kind kind = Kind::int32;  ///< never Kind::message
  rdf::Value value{};       ///< boolean, integer, real or text
  std::string comment{};    ///< as Field::comment
};

/// The definition of a message, with those of its fields. Immutable once Definitions has made it. Messages form no cycle.
struct Message {
  std::string name;                   ///< "sensor_msgs/msg/JointState", "example_interfaces/srv/AddTwoInts_Request"
  std::vector<Field> fields{};        ///< in order. None: on the wire there is one byte instead
  std::vector<Constant> constants{};  ///< in order
  std::string comment{};              ///< the first lines, without '#'; may be empty
  /// Hash of its structure by REP 2011, "RIHS01_" and 64 hexadecimal digits: what nodes of Iron and later announce.
  std::string hash{};
  std::string origin{};  ///< where it is from, for people: a file, "shipped with lrt", "the node /camera"
};
using MessagePtr = std::shared_ptr<const Message>;  ///< shared, immutable

/// The definition of a service.
struct Service {
  std::string name;     ///< "example_interfaces/srv/AddTwoInts"
  MessagePtr request;   ///< `..._Request`
  MessagePtr response;  ///< `..._Response`
  std::string hash{};   ///< see Message::hash
};

/// The definition of an action, and the messages that it has on the wire.
struct ActionDefinition {
  std::string name;  ///< "control_msgs/action/FollowJointTrajectory"
  /// @{
  /// What the author of the .action wrote: `..._Goal`, `..._Result`, `..._Feedback`.
  MessagePtr goal, result, feedback;
  /// @}
  /// @{
  /// On the wire: {uint8[16] goal_id in a unique_identifier_msgs/UUID, goal}; {bool accepted, Time stamp}.
  MessagePtr send_goal_request, send_goal_response;
  /// @}
  /// @{
  /// On the wire: {goal_id}; {int8 status, result}.
  MessagePtr get_result_request, get_result_response;
  /// @}
  MessagePtr feedback_message;  ///< on the wire: {goal_id, feedback}
  std::string hash{};           ///< see Message::hash
};

/// Limits of what definitions may contain: texts come from strangers.
struct DefinitionLimits {
  std::size_t max_text_bytes = 256 * 1024;        ///< of one text
  std::size_t max_fields = 1'000;                 ///< fields and constants of one message
  std::size_t max_depth = 24;                     ///< messages in messages
  std::size_t max_members = 4'000;                ///< fields of a message and of all messages in it, counted each time that they occur
  std::size_t max_definitions = 1'024;            ///< kept definitions that nodes have sent
  std::size_t max_kept_bytes = 32 * 1024 * 1024;  ///< of the texts of those
  std::size_t max_files = 20'000;                 ///< files of folders
};

/// What types are: from folders of a ROS installation, from texts, from nodes, and those that lrt ships.
///
/// A type is named "PACKAGE/msg/NAME", "PACKAGE/srv/NAME" or "PACKAGE/action/NAME". Several definitions may have one name:
/// robots and installations are of different years. Who knows the hash that a node announces names it, and gets the definition
/// that has it, or an error. Without a hash the order is: folders and texts in the order of adding, nodes, shipped ones as Humble
/// has them, because its nodes announce none.
///
/// Shipped are the messages of ROS 2's common packages as Jazzy has them, and as Humble has them where they differ.
///
/// Nothing is parsed before it is asked for. A definition that was returned stays as it is.
///
/// @par Threads  Any.
/// @par Time     Reads files and allocates. Not for the control loop.
class LRT_API Definitions {
 public:
  /// Knows the shipped definitions.
  explicit Definitions(DefinitionLimits limits = {});
  Definitions(Definitions&&) noexcept;
  Definitions& operator=(Definitions&&) noexcept;
  ~Definitions();

  /// Adds the packages below a folder: the folder `share` of an installation, its prefix, one package (with `msg`, `srv` or
  /// `action` in it), or a workspace whose packages are at most 4 folders deeper. Hidden folders and links to folders above are left out. Only the names are read now.
  /// @return      how many types were found; 0 is an error
  /// @par Errors  io_error: no folder, or unknown_path: no type is there; limit_exceeded
  Result<std::size_t> add_folder(const std::string& path);
  /// Adds a text: of a .msg, .srv or .action. The text may have further definitions as ros2 bags and MCAP have them: a line of
  /// 80 '=', a line "MSG: PACKAGE/NAME", the definition. It is parsed now; messages that it refers to may come later.
  /// @param type  "sensor_msgs/msg/Imu", "demo/srv/Grasp", "demo/action/Wave"
  /// @par Errors  expected_value: with line and column; limit_exceeded; nothing is added then
  Result<void> add_text(std::string_view type, std::string_view text, std::string origin = {});
  /// Adds what a node responded to get_type_description: a type_description_interfaces/srv/GetTypeDescription_Response in CDR,
  /// with its encapsulation. The structure in it counts; constants and comments are of its sources, if these fit the structure.
  /// @param from  the node, for Message::origin
  /// @return      the name of its type
  /// @par Errors  expected_value: malformed, or its own words contradict each other: the hash is not that of `type` and `hash`; limit_exceeded; refused: the node
  ///              says it did not succeed, with its reason
  Result<std::string> add_type_description(std::string_view payload, std::string_view type, std::string_view hash, std::string_view from);

  /// The definition of a message.
  /// @param type  "sensor_msgs/msg/JointState"; also "demo/srv/Grasp_Request" and the like
  /// @param hash  that the definition must have; empty: any
  /// @par Errors  unknown_path: no definition; the message says which type is missing, and in which; expected_value: its text is malformed;
  ///              limit_exceeded
  Result<MessagePtr> message(std::string_view type, std::string_view hash = {}) const;
  /// @{
  /// The definition of a service or an action. See message().
  Result<std::shared_ptr<const Service>> service(std::string_view type, std::string_view hash = {}) const;
  Result<std::shared_ptr<const ActionDefinition>> action(std::string_view type, std::string_view hash = {}) const;
  /// @}
  /// Changes with each definition that is added. A type that was not known is worth another attempt then.
  std::uint64_t version() const noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::ros2
