// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/detail/record_fields.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {
inline namespace v0 {
namespace detail {

/// One alternative of a variant, by addresses.
struct AlternativeOperations {
  const MemberOperations* value;                           // of its type
  std::string_view (*type_name)() noexcept;                // as type_name() returns it
  const void* (*find)(const void* variant) noexcept;       // null: another alternative is active
  Result<void> (*decode)(const Value& value, void* made);  // `made` is a std::optional of the variant
};

/// The alternatives of a variant, without the variant: all of Variant<V> that does not need V.
/// @par Threads  One thread until finish(), then any.
class LRT_API Alternatives {
 public:
  /// @param operations  of each alternative, in order; static
  /// @param type_name   of the C++ type; empty: it is a std::variant, and its alternatives name it
  Alternatives(const AlternativeOperations* operations, std::size_t count, std::string_view type_name);
  Alternatives(const Alternatives&) = delete;
  Alternatives& operator=(const Alternatives&) = delete;
  ~Alternatives();

  void add_class(std::string_view iri);
  void set_name(std::string_view name);
  /// @return  the facets of the alternative; they stay where they are
  Facets& name(std::size_t index, FieldName&& name);
  /// To be called when all names are given. Names the rest.
  void finish();

  const Type& type() const noexcept { return type_; }
  bool runs_user_code() const noexcept { return runs_user_code_; }
  /// @return  no alternative is present if the variant is valueless by an exception
  Value encode(const void* variant) const;
  /// @param made  a std::optional of the variant
  Result<void> decode(const Value& value, void* made) const;
  bool same(const void* a, const void* b) const noexcept;

 private:
  const AlternativeOperations* operations_;
  Type type_;
  bool runs_user_code_ = false;  // the traits of an alternative do
};

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf
