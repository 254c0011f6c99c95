// SPDX-License-Identifier: Apache-2.0
#include "src/query/reading.hpp"

#include <lrt/rdf/lexical.hpp>

namespace lrt::query {

Reading read_value(const rdf::TermView& term) noexcept {
  using rdf::lexical::Datatype;
  Reading reading;
  if (!term.is_literal()) {
    reading.type = term.is_iri() ? Type::iri : Type::blank;
    return reading;
  }
  if (!term.language.empty()) {
    reading.type = Type::tagged;
    return reading;
  }
  const Datatype datatype = rdf::lexical::datatype_of(term.datatype);
  switch (datatype) {
    case Datatype::string: reading.type = Type::string; break;
    case Datatype::boolean:
      if (const auto truth = rdf::lexical::parse_boolean(term.text)) reading.type = Type::boolean, reading.truth = *truth;
      break;
    case Datatype::decimal:
      if (!rdf::lexical::is_decimal(term.text)) break;
      reading.type = Type::decimal;
      reading.real = rdf::lexical::parse_double(term.text).value_or(0);
      break;
    case Datatype::float_:
      if (const auto value = rdf::lexical::parse_float(term.text)) reading.type = Type::float_, reading.real = static_cast<double>(*value);
      break;
    case Datatype::double_:
      if (const auto value = rdf::lexical::parse_double(term.text)) reading.type = Type::double_, reading.real = *value;
      break;
    case Datatype::date_time:
    case Datatype::date_time_stamp:
      if (rdf::lexical::is_well_formed(term.text, datatype)) reading.type = Type::date_time;
      break;
    default:
      if (!rdf::lexical::is_integer_type(datatype) || !rdf::lexical::is_well_formed(term.text, datatype)) break;
      reading.type = Type::integer;
      if (const auto value = rdf::lexical::parse_int64(term.text)) {
        reading.integer = *value;
        reading.fits = true;
      } else {
        reading.real = rdf::lexical::parse_double(term.text).value_or(0);
      }
  }
  return reading;
}

}  // namespace lrt::query
