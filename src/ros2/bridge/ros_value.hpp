// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <utility>

#include <lrt/base/error.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value.hpp>
#include <lrt/ros2/graph.hpp>

namespace lrt::ros2 {

/// Makes a value of a payload, when somebody wants it.
/// @par Threads  Any.
class PayloadReader {
 public:
  virtual ~PayloadReader() = default;
  /// @par Errors  expected_value, limit_exceeded: it is none
  virtual Result<rdf::Value> read(const std::string& payload) const = 0;
};

/// The value of a property of the bridge: what passes from DDS to the engine. It is decoded where the engine takes it, and the engine
/// takes what somebody reads or observes.
struct RosValue {
  Bytes payload{};                                ///< null: there is another member
  std::shared_ptr<const PayloadReader> reader{};  ///< of the payload
  std::shared_ptr<const rdf::Value> value{};      ///< that is known already
  std::shared_ptr<const Error> missing{};         ///< why there is none

  static RosValue of(rdf::Value v) {
    RosValue made;
    made.value = std::make_shared<const rdf::Value>(std::move(v));
    return made;
  }
  static RosValue none(std::string why) {
    RosValue made;
    made.missing = std::make_shared<const Error>(Error{Errc::unavailable, std::move(why)});
    return made;
  }
};

}  // namespace lrt::ros2

/// Its Type is made at run time, see Thing::pushed().
template <>
struct lrt::rdf::traits<lrt::ros2::RosValue> {
  using T = lrt::ros2::RosValue;
  /// @throws BadResult  it is missing, or the payload is no value: the property says why
  static Value encode(const T& v) {
    if (v.missing) throw BadResult(*v.missing);
    if (v.value) return *v.value;
    if (!v.payload || !v.reader) return {};
    Result<Value> read = v.reader->read(*v.payload);
    if (!read) throw BadResult(std::move(read).error());
    return *std::move(read);
  }
  static Result<T> decode(const Value& v) { return T::of(v); }
  static bool runs_user_code() noexcept { return true; }  // encode() throws
  static bool same(const T& a, const T& b) noexcept {
    if (a.payload || b.payload) return a.payload && b.payload && a.reader == b.reader && (a.payload == b.payload || *a.payload == *b.payload);
    if (a.missing || b.missing) return a.missing && b.missing && a.missing->message == b.missing->message;
    return a.value == b.value || (a.value && b.value && rdf::same(*a.value, *b.value));
  }
};
