// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <type_traits>

#include <lrt/base/abi.hpp>
#include <lrt/base/immortal.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/dynamic_type.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace google::protobuf {
class Descriptor;
class FieldDescriptor;
class Message;
class OneofDescriptor;
}  // namespace google::protobuf

/// Messages of Protocol Buffers as values of Properties, Actions and Collections. In the library lrt::protobuf.
///
/// A message that protoc has made is a C++ type with rdf::traits, without further code:
///
///     #include <lrt/protobuf.hpp>
///     thing.property("pose", [&] { return arm.pose(); });                       // robot::Pose
///     thing.action("move", [&](const robot::Move& move, lrt::Responder done) { arm.move(move, done); });
///
/// A message that is known at run time only has a MessageType, made of its descriptor, for the functions of Thing with an
/// rdf::DynamicType:
///
///     auto type = lrt::protobuf::MessageType::of(*message.GetDescriptor()).value();
///     thing.property("pose", type.type(), [&, type] { return type.encode(message); })
///         .on_write([&, type](const lrt::rdf::Value& v) { return type.decode(v, message); });
///
/// | protobuf | value |
/// |---|---|
/// | message | record, named by its full name: the class `<vocabulary>robot.Pose`, terms `<vocabulary>robot.Pose/json_name` |
/// | bool, int32, sint64, fixed32, ..., float, double, string | the same; 64 bits exactly |
/// | bytes | xsd:base64Binary, a text in JSON |
/// | enum | its names. A number without a name is no value: a read that meets it is answered with 500 |
/// | repeated | list |
/// | map | map; keys that are integers or bool are names as protobuf's JSON writes them |
/// | oneof | a field with the name of the oneof, with exactly one of its fields in it, or absent |
/// | optional, a message in a message | may be absent |
/// | a field of proto3 without `optional`, `required` of proto2 | always there; clients send it, too |
/// | Timestamp, Duration | xsd:dateTime, xsd:dayTimeDuration; one beyond 292 years is no value |
/// | DoubleValue, StringValue, ... | their value; may be absent |
/// | Struct, Value, ListValue, Any | a text: their JSON by protobuf |
/// | extensions, unknown fields | left out |
///
/// Field names are those of protobuf's JSON (`json_name`).
namespace lrt::protobuf {
inline namespace v0 {

/// What the host says of one field.
struct Field {
  rdf::Facets facets{};   ///< unit, bounds and words
  bool left_out = false;  ///< it is no part of the value; a message that is decoded has its default
  bool as_json = false;   ///< of messages: a text with their JSON by protobuf. A message that contains itself needs it
};

/// How a message becomes a type.
struct Options {
  /// Called for each field of each message in the type, `field.full_name()` "robot.Pose.x". Empty: nothing is said.
  std::function<void(const google::protobuf::FieldDescriptor& field, Field& says)> field{};
  /// Whether one field of the oneof must be set. A message without it is no value: clients get 422, a read 500. Empty: no
  /// oneof.
  std::function<bool(const google::protobuf::OneofDescriptor& oneof)> oneof_is_required{};
};

/// Options of a message that protoc has made, in rdf::traits. Specialise it to state units, before the first use of the
/// message:
///
///     template <>
///     struct lrt::protobuf::OptionsOf<robot::Pose> {
///       static lrt::protobuf::Options options();
///     };
///
/// Messages in the message are described by these options, not by their own, and each message has one description in a
/// server: if two differ in units, Server::add() returns duplicate_path.
template <class M>
struct OptionsOf {
  /// The options.
  static Options options() { return {}; }
};

/// A message as a type, made of its descriptor. Copies are cheap and refer to one description.
///
/// The descriptor, with its pool, outlives the MessageType and each value that is encoded or decoded by it. The rdf type
/// is kept for the life of the process, see rdf::DynamicType.
///
/// @par Threads  Any.
/// @par Time     encode() and decode() allocate.
class LRT_API MessageType {
 public:
  /// @param options  its functions are called here and not kept
  /// @par Errors  invalid_option: the place and why it is no type. A message contains itself, two fields have one name,
  ///              bounds that no value is in. limit_exceeded: as rdf::DynamicType::record()
  static Result<MessageType> of(const google::protobuf::Descriptor& message, const Options& options = {});

  /// The type for Thing::property(), action() and collection().
  rdf::DynamicType type() const noexcept { return type_; }
  /// @pre `message` has the descriptor
  /// @par Errors  failed, which clients get as 500: the place and what is no value: text that is not UTF-8, an enumerator without a name, a
  ///              required field that is not set
  Result<rdf::Value> encode(const google::protobuf::Message& message) const;
  /// Replaces what is in `message`. After an error it has been cleared.
  /// @param value  of type()
  /// @par Errors  expected_value: the place, for example a key of a map that is no integer
  Result<void> decode(const rdf::Value& value, google::protobuf::Message& message) const;

  /// @cond internal
  /// For traits: a type with the error, which Server::add() returns.
  static MessageType of_generated(const google::protobuf::Descriptor& message, const Options& options);
  struct Plan;
  /// @endcond

 private:
  MessageType(rdf::DynamicType type, std::shared_ptr<const Plan> plan);
  rdf::DynamicType type_;
  std::shared_ptr<const Plan> plan_;  // null: the type has an error
};

/// @cond internal
namespace detail {
template <class T, class = void>
inline constexpr bool is_generated = false;
template <class T>
inline constexpr bool is_generated<T, std::enable_if_t<std::is_convertible_v<T*, google::protobuf::Message*> &&
                                                       std::is_convertible_v<decltype(T::descriptor()), const google::protobuf::Descriptor*>>> = true;
/// Whether both have the same bytes. Allocates.
LRT_API bool same(const google::protobuf::Message& a, const google::protobuf::Message& b) noexcept;
template <class M>
[[gnu::noinline]] const MessageType& type_of() {
  static const Immortal<MessageType> type(MessageType::of_generated(*M::descriptor(), OptionsOf<M>::options()));
  return *type;
}
}  // namespace detail
/// @endcond

}  // namespace v0
}  // namespace lrt::protobuf

namespace lrt::rdf {
inline namespace v0 {

/// A message that protoc has made, see lrt/protobuf.hpp. encode() throws BadResult for a message that is no value.
template <class M>
struct traits<M, std::enable_if_t<protobuf::detail::is_generated<M>>> {
  static const Type& type() { return *protobuf::detail::type_of<M>().type(); }
  static Value encode(const M& message) { return protobuf::detail::type_of<M>().encode(message).value(); }
  static Result<M> decode(const Value& value) {
    M message;
    if (Result<void> r = protobuf::detail::type_of<M>().decode(value, message); !r) return Unexpected{std::move(r).error()};
    return message;
  }
  static bool runs_user_code() noexcept { return true; }  // it may throw
  static bool same(const M& a, const M& b) noexcept { return protobuf::detail::same(a, b); }
};

}  // namespace v0
}  // namespace lrt::rdf
