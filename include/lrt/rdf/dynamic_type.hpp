// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {
inline namespace v0 {

struct DynamicField;

/// A type that is made at run time, for hosts that describe their data themselves: a table of parameters, messages with
/// descriptors, components with reflection. Thing::property(), action() and collection() take it instead of a C++ type;
/// the host's lambdas then return and get an rdf::Value.
///
///     using lrt::rdf::DynamicType;
///     auto gains = DynamicType::record("Gains", {{"p", DynamicType::of<double>(), lrt::Facets().between(0, 10)},
///                                                {"mode", DynamicType::enumeration({"slow", "fast"}).value()}}).value();
///     thing.property("gains", gains, [&] { return table.read("gains"); })          // an rdf::Value, or a Result of one
///         .on_write([&](const lrt::rdf::Value& v) -> lrt::Result<void> { return table.write("gains", v); });
///
/// A type is made of complete types, so no type contains itself. Equal types are one object, which is kept for the life
/// of the process, as units are: making the same types again needs no further memory, and nothing that uses a type can
/// outlive it. A host that makes endless different types needs endless memory.
///
/// What the host's lambdas return and publish is checked against the type. A value that is not of it is no value: a read
/// is answered with 500, an action fails, and a published one is logged, with the place: `field "mode": expected one of the names, found
/// "off"`. What clients send is checked as for C++ types.
///
/// @par Threads  Any.
/// @par Time     Making a type locks and allocates. Values allocate: see PushedProperty<rdf::Value>::publish().
class LRT_API DynamicType {
 public:
  /// No type: an action without input or output.
  DynamicType() noexcept = default;
  /// The same as `type`, which exists as long as the process, such as that of rdf::traits.
  explicit DynamicType(const Type& type);

  /// The type of a C++ type with rdf::traits: `of<double>()`, `of<std::string>()`, `of<PidGains>()`.
  template <class T>
  static DynamicType of() {
    return DynamicType(traits<T>::type());
  }
  /// Bytes, as xsd:base64Binary: the content of a value is a text in base64 (RFC 4648 4).
  static DynamicType base64();
  /// One of these names, which are not empty and differ.
  /// @par Errors  invalid_option: what is wrong with the names
  static Result<DynamicType> enumeration(std::vector<std::string> names);
  /// A list in order. Its members are not optional.
  /// @par Errors  invalid_option
  static Result<DynamicType> list(DynamicType element, std::size_t shortest = 0, std::size_t longest = std::numeric_limits<std::size_t>::max());
  /// Values by names, see rdf::traits of std::map. The values are not optional.
  /// @par Errors  invalid_option
  static Result<DynamicType> map(DynamicType element);
  /// A value that may be absent: null. An optional of an optional is refused.
  /// @par Errors  invalid_option
  static Result<DynamicType> optional(DynamicType element);
  /// A record. A value of it is a sequence with a member for each field.
  /// @param name     names its terms in the server's vocabulary: letters, digits, '-', '_' and '.'. May be empty if each
  ///                 field has a predicate of its own and there is a class.
  /// @param fields   may be none
  /// @param classes  its rdf:types; none: the class `<vocabulary>name`
  /// @par Errors  expected_iri (a name, a predicate, a class), invalid_option (two fields with one name or predicate, a
  ///              field without a type, bounds that no value is in), limit_exceeded (nested more than 32 deep, or more than 20,000
  ///              fields and members in all)
  static Result<DynamicType> record(std::string_view name, std::vector<DynamicField> fields, const std::vector<Iri>& classes = {});

  /// Exactly one of several alternatives, see rdf::Variant. A value of it is a sequence with a member for each
  /// alternative, null but for the one that it has.
  /// @param alternatives  at least one; their types are not optional
  /// @par Errors  as record()
  static Result<DynamicType> variant(std::string_view name, std::vector<DynamicField> alternatives, const std::vector<Iri>& classes = {});

  /// @cond internal
  /// For libraries that find out in rdf::traits that there is no type: one that Server::add() refuses with this sentence.
  static DynamicType refused(std::string fault);
  /// @endcond

  /// False: no type.
  explicit operator bool() const noexcept { return type_ != nullptr; }
  /// What it describes. It exists as long as the process.
  /// @pre bool(*this)
  const Type& operator*() const noexcept { return *type_; }
  /// @pre bool(*this)
  const Type* operator->() const noexcept { return type_; }
  /// Whether both are one type.
  friend bool operator==(const DynamicType& a, const DynamicType& b) noexcept { return a.type_ == b.type_; }
  friend bool operator!=(const DynamicType& a, const DynamicType& b) noexcept { return a.type_ != b.type_; }

  /// Whether a value is of the type. Bounds are not part of that: they are for what clients send.
  /// @par Errors  expected_value: the place and what was expected
  /// @par Time    Linear in the value.
  Result<void> check(const Value& value) const;

 private:
  const Type* type_ = nullptr;
};

/// A field of a record that is made at run time.
struct DynamicField {
  FieldName name;          ///< a name of its own, or a vocabulary term
  DynamicType type;        ///< of its values
  Facets facets{};         ///< unit, bounds and words
  bool read_only = false;  ///< clients cannot send a record with it
  /// What it is if a client leaves it out, see Record::value_if_absent(); null: clients must state it. Not of an optional
  /// or a read-only field, and not of an alternative.
  std::shared_ptr<const Value> absent{};
};

/// A value that describes itself, in handles of Properties, Actions and Collections of a DynamicType.
template <>
struct traits<Value> {
  static Value encode(const Value& v) { return v; }
  static Result<Value> decode(const Value& v) { return v; }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const Value& a, const Value& b) noexcept { return rdf::same(a, b); }
  template <class T = Value>
  static const Type& type() {
    static_assert(detail::always_false<T>,
                  "lrt: an rdf::Value does not say its type; name it: property(path, type, [] { return value; }), with an lrt::rdf::DynamicType");
    return detail::text_type();
  }
};

/// @cond internal
namespace detail {
/// What is wrong with a value of the type, with its place; empty: nothing.
LRT_API std::string fault_of(const Type& type, const Value& value);
}  // namespace detail
/// @endcond

}  // namespace v0
}  // namespace lrt::rdf
