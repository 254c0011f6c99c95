// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <lrt/rdf/term.hpp>

namespace lrt::query {

/// The kind of a term for the operators of SPARQL 17.3.
enum class Type : std::uint8_t {
  iri,
  blank,
  string,  ///< xsd:string
  tagged,  ///< with a language
  boolean,
  integer,  ///< and the types derived from it
  decimal,
  float_,
  double_,
  date_time,
  other,  ///< another datatype, or ill-typed
};
constexpr bool is_number(Type type) noexcept { return type >= Type::integer && type <= Type::double_; }

/// The value of a term, read once from its lexical form.
struct Reading {
  Type type = Type::other;
  bool fits = false;  ///< of an integer: within int64
  union {
    std::int64_t integer;
    double real;  ///< of the other numbers and of integers that do not fit: the nearest double. Of a float: that float
    bool truth;
  };
  Reading() noexcept : integer(0) {}
};
Reading read_value(const rdf::TermView& term) noexcept;

}  // namespace lrt::query
