// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/dynamic_type.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>
#include <lrt/ros2/definitions.hpp>

namespace lrt::ros2 {
inline namespace v0 {

/// How the constants of a message name the values of one of its fields.
struct Enumerator {
  std::string name;         ///< what clients read and send
  std::int64_t number = 0;  ///< on the wire
};

/// What is said of one field of a message.
struct FieldOptions {
  rdf::Facets facets{};    ///< unit, bounds and words
  std::string name{};      ///< in JSON and RDF; empty: as in the definition
  std::string term{};      ///< IRI of its predicate; empty: one of the server's vocabulary, by the names of record and field
  bool left_out = false;   ///< it is no part of the value; a message that is encoded has its default
  bool read_only = false;  ///< clients cannot send it
  /// Names of the numbers of an integer field, or of the members of one that is a list. A number without a name reads as
  /// "other", which clients cannot send. MessageOptions::of_constants() fills it. Empty: numbers.
  std::vector<Enumerator> enumerators{};
};

/// How a message becomes a type.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time. Its functions are called where MessageType::of() is.
struct LRT_API MessageOptions {
  /// Called for each field of each message in the type. `path` is "header.stamp.sec"; members of lists have the path of the
  /// list. Empty: each field is as MessageType says.
  std::function<void(const Message& in, const Field& field, std::string_view path, FieldOptions& says)> field{};
  /// The name of the record for a message, which names its terms in the vocabulary: letters, digits, '-', '_', '.'. Two records of one server
  /// with one name are equal in all that `field` says. Empty: "sensor_msgs.Imu" of "sensor_msgs/msg/Imu".
  std::function<std::string(const Message& message, std::string_view path)> name{};
  /// The rdf:types of the record for a message, absolute IRIs which exist as long as the process. Empty, or none: one of the
  /// server's vocabulary, by the name of the record.
  std::function<std::vector<Iri>(const Message& message, std::string_view path)> classes{};
  /// builtin_interfaces/Time and Duration are instants and durations. false: records, bit by bit as on the wire.
  bool times = true;
  /// Texts that are not UTF-8 have U+FFFD where they are not. false: they are no value.
  bool replace_invalid_text = true;

  /// Names the values of a field by the constants of its message, where that is beyond doubt: the constants are of its type
  /// and differ, and begin with its name ("status" and STATUS_FIX), or it is the only integer field and they name nothing else.
  /// Bits that are to be combined are not named. Empty: none.
  static std::vector<Enumerator> of_constants(const Message& in, const Field& field);
};

/// Limits of decoding and encoding one message.
struct CodecLimits {
  std::size_t max_bytes = 64 * 1024 * 1024;  ///< of a payload; more: limit_exceeded
  std::size_t max_values = 1'000'000;        ///< members of all sequences of a value, and its fields; bytes of byte sequences do not count
};

/// A value inside a payload, that is found without decoding the rest. See MessageType::find().
struct Found {
  std::string_view bytes{};   ///< of a primitive, string, or sequence or array of primitives: its bytes in the payload, without length and padding.
                              ///< A wstring: 4 bytes for each code unit
  std::size_t count = 0;      ///< values in it; of a string: 1
  bool little_endian = true;  ///< order of the bytes in each number
};

/// A message as a type, made of its definition: decodes payloads of CDR (XCDR1, with the 4 bytes of encapsulation, both byte
/// orders) and encodes them (little endian). Copies are cheap and refer to one plan.
///
/// | .msg | value |
/// |---|---|
/// | message | record with a member for each field, see MessageOptions::name; without fields: a record without fields |
/// | bool; byte, char, int8 ... uint64; float32, float64 | boolean; integer with its range; real |
/// | uint8[], byte[], char[], also bounded and arrays | xsd:base64Binary, a text in base64 |
/// | string, wstring | text; its bound counts bytes or UTF-16 code units when it is encoded |
/// | T[N], T[<=N], T[] | list, with these lengths |
/// | builtin_interfaces/Time, Duration | instant, duration (MessageOptions::times) |
/// | an integer with FieldOptions::enumerators | enumeration |
///
/// A record that a client sends has all fields; one with a default in the definition may be left out, and has its default then.
///
/// Payloads are of strangers: each length is checked before it is used, and memory stays in proportion to the payload. What is left
/// behind the last field is ignored up to 3 bytes and refused beyond: it is another version of the type.
///
/// The rdf type is kept for the life of the process, see rdf::DynamicType.
///
/// @par Threads  Any.
/// @par Time     decode() and encode() allocate. find() does not.
class LRT_API MessageType {
 public:
  /// @param options  its functions are called here and not kept
  /// @par Errors  invalid_option: the place and why it is no type; limit_exceeded
  static Result<MessageType> of(MessagePtr message, const MessageOptions& options = {}, const CodecLimits& limits = {});

  const Message& message() const noexcept;  ///< its definition
  rdf::DynamicType type() const noexcept;   ///< for Thing::property(), action() and collection()
  /// Decodes a payload.
  /// @par Errors  expected_value: the place and what was found; limit_exceeded
  Result<rdf::Value> decode(std::string_view payload) const;
  /// Encodes a value of type(). Fields that are left out have their defaults.
  /// @par Errors  expected_value, out_of_range: the place and why it does not fit: a text that is longer than its bound, "other"
  Result<std::string> encode(const rdf::Value& value) const;
  /// The payload with the defaults of the definition in all fields.
  std::string initial() const;

  /// A place for find(), prepared: "header.stamp", "data", "pose.position.x". Members of lists have no place.
  struct Place {
    std::vector<std::uint32_t> steps{};  ///< index of the field at each depth
  };
  /// @par Errors  unknown_path: no such field, or it is in a list
  Result<Place> place(std::string_view path) const;
  /// Finds a primitive, a string, or a sequence or array of primitives in a payload, and checks what lies before it. Only lengths
  /// before the place are read: "header.stamp" costs nothing.
  /// @return      nullopt: the payload is malformed up to there, or the place is a message or a list of messages or strings
  std::optional<Found> find(std::string_view payload, const Place& place) const noexcept;
  /// @{
  /// As find(), converted; nullopt also if it is of another kind. time() is for builtin_interfaces/Time.
  std::optional<double> number(std::string_view payload, const Place& place) const noexcept;
  std::optional<std::int64_t> integer(std::string_view payload, const Place& place) const noexcept;
  std::optional<std::string_view> text(std::string_view payload, const Place& place) const noexcept;
  std::optional<std::chrono::system_clock::time_point> time(std::string_view payload, const Place& place) const noexcept;
  /// @}

  /// @cond internal
  struct Plan;
  /// For tests: in either byte order.
  Result<std::string> encode(const rdf::Value& value, bool little) const;
  /// @endcond

 private:
  explicit MessageType(std::shared_ptr<const Plan> plan) noexcept;
  std::shared_ptr<const Plan> plan_;
};

}  // namespace v0
}  // namespace lrt::ros2
