// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/rdf/plain.hpp"
#include "src/shacl/order.hpp"
#include "tests/support/big_numbers.hpp"

/// What lrt makes of a lexical form, compared with the reader of big numbers.
namespace lrt::test::forms {

using rdf::lexical::Datatype;

struct Named {
  Datatype type;
  const char* name;
};
inline constexpr Named types[] = {
    {Datatype::double_, "double"},
    {Datatype::float_, "float"},
    {Datatype::decimal, "decimal"},
    {Datatype::integer, "integer"},
    {Datatype::long_, "long"},
    {Datatype::int_, "int"},
    {Datatype::short_, "short"},
    {Datatype::byte_, "byte"},
    {Datatype::unsigned_long, "unsignedLong"},
    {Datatype::unsigned_int, "unsignedInt"},
    {Datatype::unsigned_short, "unsignedShort"},
    {Datatype::unsigned_byte, "unsignedByte"},
    {Datatype::non_negative_integer, "nonNegativeInteger"},
    {Datatype::positive_integer, "positiveInteger"},
    {Datatype::non_positive_integer, "nonPositiveInteger"},
    {Datatype::negative_integer, "negativeInteger"},
    {Datatype::date_time, "dateTime"},
    {Datatype::date_time_stamp, "dateTimeStamp"},
    {Datatype::date, "date"},
    {Datatype::time, "time"},
    {Datatype::g_year, "gYear"},
    {Datatype::g_year_month, "gYearMonth"},
    {Datatype::duration, "duration"},
    {Datatype::day_time_duration, "dayTimeDuration"},
    {Datatype::year_month_duration, "yearMonthDuration"},
};
inline std::string iri_of(const Named& type) { return std::string("http://www.w3.org/2001/XMLSchema#") + type.name; }

template <class T>
bool same(T a, T b) {
  return std::isnan(a) ? std::isnan(b) : a == b && std::signbit(a) == std::signbit(b);
}
inline std::string shown(std::string_view text) { return '"' + std::string(text.substr(0, 300)) + '"'; }

/// The value that a C++ number is to have; nullopt: it is refused. @tparam T  an arithmetic type
template <class T>
std::optional<T> expected(const big::Number& n, Datatype type) {
  if constexpr (std::is_floating_point_v<T>) {
    const T value = big::nearest<T>(n);
    if (n.kind == big::Number::Kind::finite && (std::isinf(value) || (value == 0 && !n.is_zero()))) return std::nullopt;
    return value;
  } else {
    std::optional<big::Integer> whole = big::whole(n);
    if (!whole) return std::nullopt;
    if (type == Datatype::double_ || type == Datatype::float_) {  // the value of that datatype
      const double rounded = type == Datatype::double_ ? big::nearest<double>(n) : static_cast<double>(big::nearest<float>(n));
      if (!std::isfinite(rounded)) return std::nullopt;
      whole = big::Integer(rounded);
    }
    if (*whole < std::numeric_limits<T>::min() || *whole > std::numeric_limits<T>::max()) return std::nullopt;
    return static_cast<T>(*whole);
  }
}

/// What was read, as the C++ type.
template <class T>
std::optional<T> decoded(const Result<rdf::Value>& value) {
  if (!value) return std::nullopt;
  const Result<T> result = rdf::traits<T>::decode(*value);
  return result ? std::optional<T>(*result) : std::nullopt;
}

template <class T>
Result<rdf::Value> read(const rdf::Graph& graph, rdf::TermId focus, bool is_special_allowed) {
  std::vector<rdf::Mismatch> mismatches;
  rdf::Facets facets;
  if (is_special_allowed) facets.allow_non_finite();
  return rdf::read_value(graph, focus, rdf::traits<T>::type(), facets, "http://robot/ns/vocabulary#", mismatches);
}

/// A scalar in RDF, as a client writes it, read as T.
template <class T>
std::optional<T> of_rdf(std::string_view text, const std::string& datatype, bool is_number) {
  rdf::Graph graph;
  const rdf::TermId focus = graph.intern(rdf::iri("http://robot/x"));
  if (is_number) graph.add(rdf::iri("http://robot/x"), vocab::rdf_::type, rdf::TermView(rdf::iri(vocab::maths::Scalar.text)));
  graph.add(rdf::iri("http://robot/x"), is_number ? vocab::vom::numericalValue : vocab::rdf_::value, rdf::literal(text, Iri(datatype)));
  if (const auto whole = rdf::completed(graph, focus, rdf::traits<T>::type(), rdf::Facets().allow_non_finite(), "http://robot/ns/vocabulary#"))
    return decoded<T>(read<T>(*whole, *whole->find(rdf::iri("http://robot/x")), true));
  return decoded<T>(read<T>(graph, focus, true));
}

/// A scalar in a plain format, read as T.
template <class T>
std::optional<T> of_plain(const std::string& body, rdf::Plain format) {
  rdf::Graph graph;
  const rdf::TermId focus = graph.intern(rdf::iri("http://robot/x"));
  const rdf::Facets facets = rdf::Facets().allow_non_finite();
  if (!rdf::read_plain(body, format, rdf::traits<T>::type(), facets, "http://robot/ns/vocabulary#", 1'000, graph, focus)) return std::nullopt;
  return decoded<T>(read<T>(graph, focus, true));
}

inline bool is_json_number(std::string_view text) {
  big::Cursor at{text};
  at.take('-');
  const std::string whole = at.digits();
  if (whole.empty() || (whole.size() > 1 && whole[0] == '0')) return false;
  if (at.take('.') && at.digits().empty()) return false;
  if (at.take('e') || at.take('E')) {
    if (!at.take('-')) at.take('+');
    if (at.digits().empty()) return false;
  }
  return at.rest.empty();
}

inline std::string cbor_of(double number) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &number, sizeof bits);
  std::string bytes(1, '\xfb');
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(bits >> shift & 0xFF);
  return bytes;
}
inline std::string cbor_of(std::uint64_t argument, bool negative) {
  std::string bytes(1, negative ? '\x3b' : '\x1b');
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(argument >> shift & 0xFF);
  return bytes;
}
inline std::string cbor_of(std::string_view text) {
  std::string bytes(1, '\x7a');
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(text.size() >> shift & 0xFF);
  return bytes.append(text);
}

/// A fault of one C++ type; empty: none.
template <class T>
std::string fault_of_number(std::string_view text, const Named& type, const char* name) {
  const bool is_well_formed = big::is_well_formed(text, type.type);
  const auto n = big::number_of(text);
  const auto differs = [&](const std::optional<T>& found, const std::optional<T>& wanted) {
    if (found.has_value() != wanted.has_value()) return true;
    if (!found) return false;
    if constexpr (std::is_floating_point_v<T>) return !same(*found, *wanted);
    else return *found != *wanted;
  };
  const auto report = [&](const char* where, const std::optional<T>& found, const std::optional<T>& wanted) {
    return std::string(where) + " of " + shown(text) + "^^xsd:" + type.name + " as " + name + ": found " +
           (found ? std::to_string(*found) : "a refusal") + ", expected " + (wanted ? std::to_string(*wanted) : "a refusal");
  };
  const auto wanted = is_well_formed ? expected<T>(*n, type.type) : std::nullopt;
  if (const auto found = of_rdf<T>(text, iri_of(type), true); differs(found, wanted)) return report("RDF", found, wanted);
  if (n && n->kind == big::Number::Kind::finite) {
    const auto exact = expected<T>(*n, Datatype::decimal);
    if (is_json_number(text))
      if (const auto found = of_plain<T>(std::string(text), rdf::Plain::json); differs(found, exact)) return report("JSON", found, exact);
    if (const auto found = of_plain<T>(std::string(text), rdf::Plain::text); differs(found, exact)) return report("text/plain", found, exact);
    if (const double real = big::nearest<double>(*n); std::isfinite(real)) {  // CBOR has the double, and integers
      big::Number rounded;
      rounded.negative = std::signbit(real);
      int exponent = 0;
      rounded.digits = big::Integer(std::ldexp(std::fabs(std::frexp(real, &exponent)), 53));
      exponent -= 53;
      if (exponent >= 0) {
        rounded.digits <<= static_cast<unsigned>(exponent);
      } else {  // d * 2^-n is d * 5^n * 10^-n
        rounded.digits *= boost::multiprecision::pow(big::Integer(5), static_cast<unsigned>(-exponent));
        rounded.exponent = exponent;
      }
      const auto of_double = expected<T>(rounded, Datatype::decimal);
      if (const auto found = of_plain<T>(cbor_of(real), rdf::Plain::cbor); differs(found, of_double)) return report("CBOR", found, of_double);
    }
    if (const auto whole = big::whole(*n); whole && *whole < (big::Integer(1) << 64) && *whole >= -(big::Integer(1) << 64)) {
      const bool negative = *whole < 0;
      const std::string body = cbor_of(static_cast<std::uint64_t>(negative ? big::Integer(-*whole - 1) : *whole), negative);
      big::Number plain = *n;
      if (plain.digits == 0) plain.negative = false;  // CBOR has no integer -0
      const auto of_integer = expected<T>(plain, Datatype::decimal);
      if (const auto found = of_plain<T>(body, rdf::Plain::cbor); differs(found, of_integer)) return report("CBOR integer", found, of_integer);
    }
  }
  return {};
}

/// A duration or an instant as T.
template <class T>
std::string fault_of_time(std::string_view text, const Named& type, const char* name, std::optional<std::int64_t> ns, bool is_of_datatype) {
  std::optional<T> wanted;
  using Unit = typename T::period;
  if (ns) {
    const std::int64_t step = std::nano::den / Unit::den;
    if (*ns % step == 0) {
      if constexpr (std::is_same_v<T, std::chrono::duration<typename T::rep, Unit>>) wanted = T(*ns / step);
      else wanted = T(typename T::duration(*ns / step));
    }
  }
  const auto report = [&](const char* where, bool found) {
    return std::string(where) + " of " + shown(text) + "^^xsd:" + type.name + " as " + name + ": found " + (found ? "a value" : "a refusal") +
           ", expected " + (wanted ? std::to_string(*ns) + " ns" : "a refusal");
  };
  if (is_of_datatype)
    if (const auto found = of_rdf<T>(text, iri_of(type), false); found != wanted) return report("RDF", found.has_value());
  const bool needs_no_escape =
      text.find_first_of("\"\\") == std::string_view::npos && std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c < 0x7F; });
  if (!needs_no_escape) return {};
  if (const auto found = of_plain<T>('"' + std::string(text) + '"', rdf::Plain::json); found != wanted) return report("JSON", found.has_value());
  if (const auto found = of_plain<T>(cbor_of(text), rdf::Plain::cbor); found != wanted) return report("CBOR", found.has_value());
  return {};
}

/// What differs; empty: nothing does.
inline std::string fault_of(std::string_view text, const Named& type) {
  using namespace rdf::lexical;
  const bool wanted = big::is_well_formed(text, type.type);
  const auto report = [&](const char* what) { return std::string(what) + " of " + shown(text) + "^^xsd:" + type.name; };
  if (is_well_formed(text, type.type) != wanted) return report(wanted ? "is_well_formed() is false" : "is_well_formed() is true");
  if (big::is_number_type(type.type)) {
    const auto n = big::number_of(text);
    const auto d = parse_double(text);
    const auto f = parse_float(text);
    if (d.has_value() != n.has_value() || f.has_value() != n.has_value()) return report("parse_double() or parse_float()");
    if (n && !same(*d, big::nearest<double>(*n))) return report("parse_double()");
    if (n && !same(*f, big::nearest<float>(*n))) return report("parse_float()");
    for (std::string fault : {fault_of_number<double>(text, type, "double"), fault_of_number<float>(text, type, "float"),
                              fault_of_number<std::int64_t>(text, type, "int64"), fault_of_number<std::uint64_t>(text, type, "uint64"),
                              fault_of_number<std::int8_t>(text, type, "int8"), fault_of_number<std::uint16_t>(text, type, "uint16")})
      if (!fault.empty()) return fault;
    return {};
  }
  if (big::is_duration_type(type.type)) {
    const auto d = big::duration_of(text, Datatype::duration);
    std::optional<std::int64_t> ns;
    // A duration of C++ has days and less; a form with years or months is refused, even if there are none.
    if (d && big::duration_of(text, Datatype::day_time_duration))
      ns = big::nanoseconds(d->negative ? big::Integer(-d->seconds) : d->seconds, d->decimals, d->negative);
    const bool is_of_datatype = type.type != Datatype::year_month_duration;
    std::string fault = fault_of_time<std::chrono::nanoseconds>(text, type, "nanoseconds", ns, is_of_datatype);
    return fault.empty() ? fault_of_time<std::chrono::milliseconds>(text, type, "milliseconds", ns, is_of_datatype) : fault;
  }
  if (type.type == Datatype::date_time) {
    const auto m = big::moment_of(text, type.type);
    const auto ns = m && m->zoned ? big::nanoseconds(m->since.whole, m->since.decimals) : std::nullopt;
    using Clock = std::chrono::system_clock;
    std::string fault = fault_of_time<std::chrono::time_point<Clock, std::chrono::nanoseconds>>(text, type, "an instant", ns, true);
    if (fault.empty()) fault = fault_of_time<std::chrono::time_point<Clock, std::chrono::seconds>>(text, type, "an instant in seconds", ns, true);
    return fault;
  }
  return {};
}

/// The order of two forms of a type; nullopt: none.
inline std::optional<int> order_of(std::string_view a, std::string_view b, Datatype type) {
  if (!big::is_well_formed(a, type) || !big::is_well_formed(b, type)) return std::nullopt;
  if (big::is_number_type(type)) {
    const auto x = *big::number_of(a), y = *big::number_of(b);
    if (type != Datatype::double_ && type != Datatype::float_) return big::compare_exactly(x, y);
    const double p = type == Datatype::double_ ? big::nearest<double>(x) : static_cast<double>(big::nearest<float>(x));
    const double q = type == Datatype::double_ ? big::nearest<double>(y) : static_cast<double>(big::nearest<float>(y));
    if (std::isnan(p) || std::isnan(q)) return std::nullopt;
    return p < q ? -1 : p > q ? 1 : 0;
  }
  if (big::is_duration_type(type)) {
    const auto x = *big::duration_of(a, type), y = *big::duration_of(b, type);
    const big::Integer most = std::numeric_limits<std::int64_t>::max();
    const big::Integer p = x.negative ? big::Integer(-x.months) : x.months, q = y.negative ? big::Integer(-y.months) : y.months;
    for (const auto* d : {&x, &y}) {  // the range of lrt: int64, of which the lowest is negative
      const big::Integer more = d->negative ? 1 : 0;
      if (d->months > most + more || d->seconds > most + more) return std::nullopt;
    }
    if (p != q) return 2;  // not compared here
    const auto seconds = [](const big::Duration& d) {
      big::Seconds s{d.negative ? big::Integer(-d.seconds) : d.seconds, d.decimals};
      const auto scaled = big::integer_of(d.decimals + std::string(400 - std::min<std::size_t>(400, d.decimals.size()), '0'));
      return big::Integer(s.whole * big::power_of_ten(400) + (d.negative ? big::Integer(-scaled) : scaled));
    };
    const big::Integer v = seconds(x), w = seconds(y);
    return v < w ? -1 : v > w ? 1 : 0;
  }
  const auto x = *big::moment_of(a, type), y = *big::moment_of(b, type);
  const big::Integer most = 999'999'999;  // a year has at most nine digits where moments are compared
  if (boost::multiprecision::abs(x.year) > most || boost::multiprecision::abs(y.year) > most) return std::nullopt;
  if (x.zoned == y.zoned) return x.since < y.since ? -1 : y.since < x.since ? 1 : 0;
  const auto later = [](const big::Moment& m) { return big::Seconds{m.since.whole + 14 * 3600, m.since.decimals}; };
  if (later(x) < y.since) return -1;
  if (later(y) < x.since) return 1;
  return std::nullopt;
}

/// What differs in the order of two forms; empty: nothing does.
inline std::string fault_of(std::string_view a, std::string_view b, const Named& type) {
  const auto wanted = order_of(a, b, type.type);
  if (wanted == 2) return {};
  const std::string datatype = iri_of(type);
  const rdf::Term x = rdf::literal(a, Iri(datatype)), y = rdf::literal(b, Iri(datatype));
  const auto order = shacl::compare(shacl::Comparable(x.view()), shacl::Comparable(y.view()));
  const std::optional<int> found = order == shacl::Order::less      ? std::optional(-1)
                                   : order == shacl::Order::equal   ? std::optional(0)
                                   : order == shacl::Order::greater ? std::optional(1)
                                                                    : std::nullopt;
  if (found == wanted) return {};
  const auto text = [](std::optional<int> n) { return n ? std::to_string(*n) : std::string("none"); };
  return "order of " + shown(a) + " and " + shown(b) + " of xsd:" + type.name + ": found " + text(found) + ", expected " + text(wanted);
}

/// Random forms, among them extreme ones and some that are not well-formed.
class Generator {
 public:
  explicit Generator(std::uint64_t seed) : state_(seed * 2 + 1) {}

  const Named& type() { return types[below(std::size(types))]; }
  std::string form(Datatype type) {
    std::string text = big::is_number_type(type) ? number(type) : big::is_duration_type(type) ? duration(type) : moment(type);
    if (below(20) == 0) damage(text);
    return text;
  }
  std::size_t below(std::size_t n) {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 7;
    state_ ^= state_ << 17;
    return static_cast<std::size_t>(state_ % n);
  }

 private:
  template <std::size_t N>
  std::string one_of(const char* const (&all)[N]) {
    return all[below(N)];
  }
  std::string digits(std::size_t count) {
    std::string text;
    while (count-- > 0) text += static_cast<char>('0' + below(10));
    return text;
  }
  std::string count() {
    static const char* const extremes[] = {"0",
                                           "1",
                                           "9",
                                           "10",
                                           "127",
                                           "128",
                                           "129",
                                           "255",
                                           "256",
                                           "32767",
                                           "32768",
                                           "65535",
                                           "65536",
                                           "2147483647",
                                           "2147483648",
                                           "4294967295",
                                           "4294967296",
                                           "16777217",
                                           "9007199254740991",
                                           "9007199254740993",
                                           "9007199791611905",
                                           "9223372036854775807",
                                           "9223372036854775808",
                                           "9223372036854775809",
                                           "18446744073709551615",
                                           "18446744073709551616",
                                           "18446744073709551614",
                                           "99999999999999999999",
                                           "100000000000000000000",
                                           "340282346638528859811704183484516925440",
                                           "9223372036",
                                           "9223372037",
                                           "9223372036854",
                                           "153722867280912",
                                           "2562047788015",
                                           "106751991167",
                                           "768614336404564650"};
    switch (below(8)) {
      case 0: return digits(1 + below(400));
      case 1: return std::string(below(60), '0') + one_of(extremes);
      case 2: return one_of(extremes) + std::string(below(320), '0');
      case 3: return std::to_string(below(100));
      case 4: return digits(1 + below(30));
      default: return one_of(extremes);
    }
  }
  std::string exponent() {
    static const char* const extremes[] = {"0",
                                           "1",
                                           "307",
                                           "308",
                                           "309",
                                           "322",
                                           "323",
                                           "324",
                                           "325",
                                           "37",
                                           "38",
                                           "39",
                                           "44",
                                           "45",
                                           "46",
                                           "400",
                                           "2147483647",
                                           "2147483648",
                                           "4294967296",
                                           "9223372036854775806",
                                           "9223372036854775807",
                                           "9223372036854775808",
                                           "18446744073709551615",
                                           "18446744073709551616",
                                           "99999999999999999999999"};
    std::string text = below(2) ? "e" : "E";
    text += below(3) == 0 ? "-" : below(3) == 0 ? "+" : below(2) ? "-" : "";
    return text + std::string(below(10) == 0 ? below(40) : 0, '0') + (below(3) == 0 ? std::to_string(below(350)) : one_of(extremes));
  }
  std::string number(Datatype type) {
    const bool is_binary = type == Datatype::double_ || type == Datatype::float_;
    static const char* const specials[] = {"NaN",
                                           "INF",
                                           "-INF",
                                           "+INF",
                                           "inf",
                                           "-0",
                                           "-0.0",
                                           "0e99999999999999999999",
                                           "-0e-9223372036854775808",
                                           "1e9223372036854775807",
                                           "1e-9223372036854775808",
                                           "4.9406564584124654e-324",
                                           "2.4703282292062327e-324",
                                           "2.4703282292062328e-324",
                                           "1.7976931348623157e308",
                                           "1.7976931348623158e308",
                                           "1.7976931348623159e308",
                                           "3.4028235677973366e38",
                                           "3.4028235677973365e38",
                                           "7.0064923216240853e-46",
                                           "7.0064923216240854e-46",
                                           "2.2250738585072011e-308",
                                           "1.1754943508222875e-38"};
    if (below(is_binary ? 8 : 40) == 0) return one_of(specials);
    std::string text = below(3) == 0 ? "-" : below(6) == 0 ? "+" : "";
    const bool may_have_point = is_binary || type == Datatype::decimal || below(20) == 0;
    if (!may_have_point || below(2)) {
      text += count();
      if (may_have_point && below(6) == 0) text += "." + std::string(below(40), '0');
    } else {
      text += below(3) == 0 ? std::string() : count();
      text += "." + std::string(below(3) == 0 ? below(400) : 0, '0') + count();
    }
    if ((is_binary && below(2)) || below(60) == 0) text += exponent();
    return text;
  }
  std::string two(unsigned highest) {
    const std::string text = std::to_string(below(30) == 0 ? below(100) : below(highest + 1));
    return text.size() < 2 ? "0" + text : text;
  }
  std::string fraction() { return below(3) != 0 ? std::string() : "." + (below(2) ? digits(1 + below(9)) : digits(below(30)) + "0"); }
  std::string duration(Datatype type) {
    std::string text = below(3) == 0 ? "-P" : "P";
    const bool months = type != Datatype::day_time_duration || below(20) == 0, clock = type != Datatype::year_month_duration || below(20) == 0;
    if (months && below(2)) text += count() + "Y";
    if (months && below(2)) text += count() + "M";
    if (clock && below(2)) text += count() + "D";
    if (clock && below(3) != 0) {
      text += "T";
      if (below(2)) text += count() + "H";
      if (below(2)) text += count() + "M";
      if (below(2)) text += count() + fraction() + "S";
    }
    static const char* const extremes[] = {"PT9223372036.854775807S",  "PT9223372036.854775808S",      "-PT9223372036.854775808S",
                                           "-PT9223372036.854775809S", "P106751DT23H47M16.854775807S", "-P106751DT23H47M16.854775808S"};
    return below(20) == 0 ? one_of(extremes) : text;
  }
  std::string moment(Datatype type) {
    static const char* const years[] = {"0000",
                                        "0001",
                                        "0004",
                                        "1500",
                                        "1582",
                                        "1600",
                                        "1677",
                                        "1678",
                                        "1900",
                                        "1969",
                                        "1970",
                                        "1972",
                                        "2000",
                                        "2023",
                                        "2024",
                                        "2100",
                                        "2261",
                                        "2262",
                                        "2263",
                                        "9999",
                                        "10000",
                                        "12024",
                                        "999999999",
                                        "1000000000",
                                        "2147483648",
                                        "9223372036854775807",
                                        "99999999999999999999999"};
    static const char* const extremes[] = {"1677-09-21T00:12:43.145224192Z",      "1677-09-21T00:12:43.145224191Z",
                                           "2262-04-11T23:47:16.854775807Z",      "2262-04-11T23:47:16.854775808Z",
                                           "1677-09-21T14:12:43.145224192+14:00", "2262-04-11T24:00:00Z",
                                           "2262-04-11T09:47:16.854775807-14:00", "1969-12-31T23:59:59.999999999Z"};
    const bool has_clock = type == Datatype::date_time || type == Datatype::date_time_stamp || type == Datatype::time;
    if (has_clock && type != Datatype::time && below(12) == 0) return one_of(extremes);
    std::string text;
    if (type != Datatype::time) {
      text += below(6) == 0 ? "-" : "";
      text += below(3) == 0 ? digits(4) : one_of(years);
      if (type != Datatype::g_year) text += "-" + two(12);
      if (type != Datatype::g_year && type != Datatype::g_year_month) text += below(8) == 0 ? "-29" : "-" + two(31);
    }
    if (has_clock) {
      if (type != Datatype::time) text += "T";
      text += below(12) == 0 ? std::string("24:00:00") : two(23) + ":" + two(59) + ":" + two(59) + fraction();
    }
    static const char* const zones[] = {"", "Z", "+00:00", "-00:00", "+14:00", "-14:00", "+13:59", "-13:59", "+14:01", "+05:30", "-09:30"};
    return text + (below(3) == 0 ? "" : below(2) ? "Z" : one_of(zones));
  }
  void damage(std::string& text) {
    static constexpr char letters[] = "0123456789+-.eETZPYMDHS: INFa,";
    const std::size_t at = below(text.size() + 1);
    switch (below(3)) {
      case 0: text.insert(at, 1, letters[below(sizeof letters - 1)]); break;
      case 1:
        if (at < text.size()) text.erase(at, 1);
        break;
      default:
        if (at < text.size()) text[at] = letters[below(sizeof letters - 1)];
    }
  }

  std::uint64_t state_;
};

}  // namespace lrt::test::forms
