// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <type_traits>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::client {
inline namespace v0 {

/// Changes of parts of a value, for Property::patch(): `Patch().set("position", 0.1).clear("limit")`. Names are those of the
/// value's JSON. What is not named stays as it is on the robot when the robot's program carries the patch out.
///
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API Patch {
 public:
  /// Changes nothing yet.
  Patch() = default;
  /// A document in JSON (RFC 7396). It is sent as it is.
  static Patch from_json(std::string document);

  /// Gives a field, or a member of a map, a new value. A list is replaced as a whole. Numbers have the declared unit.
  template <class T>
  Patch& set(std::string_view name, const T& value) {
    return set(name, rdf::traits<std::decay_t<T>>::type(), rdf::traits<std::decay_t<T>>::encode(value));
  }
  /// Gives a field a new text.
  Patch& set(std::string_view name, const char* text) { return set(name, std::string(text)); }
  /// A value of a type that is known at run time.
  Patch& set(std::string_view name, const rdf::Type& type, const rdf::Value& value);
  /// Changes parts of a field that is a record or a map.
  Patch& set(std::string_view name, const Patch& parts);
  /// Removes a field that may be absent or a member of a map, and gives a field with a default that default.
  Patch& clear(std::string_view name);

  /// The document in JSON. A name must be given once: a server refuses a document with one twice.
  const std::string& json() const noexcept { return json_; }

 private:
  Patch& add(std::string_view name, std::string_view json);

  std::string json_ = "{}";
};

}  // namespace v0
}  // namespace lrt::client
