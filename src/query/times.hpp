// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/term.hpp>

#include "src/query/decimal.hpp"

namespace lrt::query {

/// A number, or a literal with its datatype.
struct TimeResult {
  std::string text;
  Iri datatype;  ///< xsd:decimal: a number
};

/// @{
/// Times and durations as XPath and XQuery Functions 3.1, 8.4 and 9.7, have them: xsd:dateTime, date and time, of which the difference is an
/// xsd:dayTimeDuration, with xsd:dayTimeDuration and xsd:yearMonthDuration. There is no implicit time zone: a time with a zone and one without have
/// no difference. Exact; nullopt: the operator is not defined for these, or the result is out of range (years of more than nine digits, numbers
/// of more than 100).
std::optional<TimeResult> add_times(const rdf::TermView& a, const rdf::TermView& b);
std::optional<TimeResult> subtract_times(const rdf::TermView& a, const rdf::TermView& b);
std::optional<TimeResult> multiply_duration(const rdf::TermView& a, const Decimal& by);
std::optional<TimeResult> divide_duration(const rdf::TermView& a, const Decimal& by);
std::optional<TimeResult> divide_durations(const rdf::TermView& a, const rdf::TermView& b);
/// @}

/// The length of a duration in seconds, with months of the average length. For a total order of durations.
std::optional<Decimal> length_of(const rdf::TermView& duration);

}  // namespace lrt::query
