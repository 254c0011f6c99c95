// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/abi.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/term.hpp>

namespace lrt::shacl {

enum class Order : unsigned char { less, equal, greater, unordered };

/// A literal prepared for comparison. It has views into its term.
class LRT_INTERNAL_API Comparable {
 public:
  explicit Comparable(const rdf::TermView& term) noexcept;
  /// False: it cannot be compared (an IRI, an ill-typed literal, a datatype without order).
  bool ordered() const noexcept { return kind_ != Kind::none; }
  /// SPARQL 1.1 17.3 operator `<`: numbers, xsd:string, booleans, dateTimes; also dates, times and durations with values of the same kind.
  friend Order compare(const Comparable& a, const Comparable& b) noexcept;

 private:
  enum class Kind : unsigned char { none, decimal, single, real, text, boolean, date_time, date, time, year, year_month, duration };
  static Order numbers(const Comparable& a, const Comparable& b) noexcept;

  Kind kind_ = Kind::none;
  std::string_view text_;
  double number_ = 0;
  rdf::lexical::Moment moment_;
  rdf::lexical::Duration duration_;
};

LRT_INTERNAL_API Order compare(const Comparable& a, const Comparable& b) noexcept;

}  // namespace lrt::shacl
