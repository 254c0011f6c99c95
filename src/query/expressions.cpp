// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <optional>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/random.hpp"
#include "src/base/utf8.hpp"
#include "src/query/digest.hpp"
#include "src/query/letter_case.hpp"
#include "src/query/run.hpp"
#include "src/rdf/n_triples.hpp"

namespace lrt::query {
namespace {

namespace lexical = rdf::lexical;

constexpr std::size_t max_pattern_bytes = 4'096;

std::size_t characters(std::string_view text) noexcept {
  std::size_t count = 0;
  for (const char c : text) count += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1 : 0;
  return count;
}

/// Whether two strings are compatible arguments (17.4.3.1.2).
bool compatible(const Value& a, const Value& b) noexcept {
  return a.is_text() && b.is_text() && (b.type == Type::string || (a.type == Type::tagged && a.language == b.language));
}

/// A text of the kind that the argument has.
Value like(const Value& argument, std::string_view text) { return Value(std::string(text), argument.language); }

/// The canonical form of XPath and XQuery Functions 3.1, 19.1.2: "1.5", "1.0E7", "-INF".
std::string canonical(double value, bool single) {
  const double magnitude = std::fabs(value);
  std::string text = single ? lexical::format(static_cast<float>(value)) : lexical::format(value);
  if (!std::isfinite(value)) return text;
  if (value == 0) return std::signbit(value) ? "-0" : "0";
  if (magnitude >= 1e-6 && magnitude < 1e6) return without_exponent(text);
  // One digit before the point.
  const bool negative = text[0] == '-';
  const std::size_t e = text.find('e');
  int exponent = e == std::string::npos ? 0 : std::stoi(text.substr(e + 1));
  std::string digits = text.substr(negative ? 1 : 0, (e == std::string::npos ? text.size() : e) - (negative ? 1 : 0));
  const std::size_t point = std::min(digits.find('.'), digits.size());
  exponent += static_cast<int>(point) - 1;
  if (point < digits.size()) digits.erase(point, 1);
  const std::size_t first = digits.find_first_not_of('0');
  exponent -= static_cast<int>(first);
  digits.erase(0, first);
  while (digits.size() > 1 && digits.back() == '0') digits.pop_back();
  return (negative ? "-" : "") + digits.substr(0, 1) + "." + (digits.size() > 1 ? digits.substr(1) : "0") + "E" + std::to_string(exponent);
}

double round_half_up(double value) noexcept {
  const double floor = std::floor(value);
  if (value - floor < 0.5) return std::copysign(floor, value);
  return std::copysign(floor + 1, value);
}

unsigned two_digits(std::string_view text, std::size_t at) noexcept {
  return static_cast<unsigned>(text[at] - '0') * 10 + static_cast<unsigned>(text[at + 1] - '0');
}

/// The parts of an xsd:dateTime. Views are of its text.
struct Moment {
  std::string year;  ///< "-0044", "12026"
  unsigned month, day, hours, minutes;
  std::string_view seconds;  ///< "05", "05.250"
  std::string_view zone;     ///< "Z", "+05:30"; empty: none
};

bool is_utc(std::string_view zone) noexcept { return zone == "Z" || (!zone.empty() && zone.substr(1) == "00:00"); }

unsigned days_in(unsigned month, std::string_view year) noexcept {
  constexpr unsigned lengths[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  unsigned rest = 0;  // of the division by 400; for February the sign does not matter
  for (const char c : year)
    if (c != '-') rest = (rest * 10 + static_cast<unsigned>(c - '0')) % 400;
  return month == 2 && rest % 4 == 0 && (rest == 0 || rest % 100 != 0) ? 29 : lengths[month - 1];
}

/// A year as xsd:dateTime writes it: at least four digits.
std::string padded(std::string year) {
  const std::size_t sign = !year.empty() && year[0] == '-' ? 1 : 0;
  if (year.size() - sign < 4) year.insert(sign, 4 - (year.size() - sign), '0');
  return year;
}

/// The parts of a well-formed xsd:dateTime, -?Y+-MM-DDThh:mm:ss(.s+)?(zone)?. 24:00:00 is 00:00:00 of the next day (XSD 1.1 part 2, 3.3.7.2).
/// nullopt: the next year has too many digits.
std::optional<Moment> moment_of(std::string_view text) {
  const std::size_t month = text.find('-', 1) + 1, zone = std::min(text.find_first_of("Z+-", month + 14), text.size());
  Moment m{std::string(text.substr(0, month - 1)),
           two_digits(text, month),
           two_digits(text, month + 3),
           two_digits(text, month + 6),
           two_digits(text, month + 9),
           text.substr(month + 12, zone - month - 12),
           text.substr(zone)};
  if (m.hours != 24) return m;
  m.hours = 0;
  if (++m.day <= days_in(m.month, m.year)) return m;
  m.day = 1;
  if (++m.month <= 12) return m;
  m.month = 1;
  const auto year = Decimal::parse(m.year), one = Decimal::parse("1");
  const auto next = year && one ? add(*year, *one) : std::nullopt;
  if (!next) return std::nullopt;
  m.year = padded(next->text());
  return m;
}

/// The canonical form of XPath and XQuery Functions 3.1, 19.1.2: no 24:00:00, no zeros at the end of a fraction, Z for +00:00.
std::optional<std::string> canonical_moment(std::string_view text) {
  const std::optional<Moment> m = moment_of(text);
  if (!m) return std::nullopt;
  std::string out = m->year.find_first_not_of("-0") == std::string::npos ? "0000" : m->year;
  const auto put = [&out](char before, unsigned n) {
    out += before;
    out += static_cast<char>('0' + n / 10);
    out += static_cast<char>('0' + n % 10);
  };
  put('-', m->month);
  put('-', m->day);
  put('T', m->hours);
  put(':', m->minutes);
  std::string_view seconds = m->seconds;
  if (seconds.size() > 2) seconds = seconds.substr(0, seconds.find_last_not_of('0') + 1);
  if (seconds.back() == '.') seconds.remove_suffix(1);
  out.append(":").append(seconds);
  return out.append(is_utc(m->zone) ? "Z" : m->zone);
}

/// UUIDs of version 4 (RFC 9562).
std::string uuid() {
  std::string hex = random_hex(16);
  hex[12] = '4';
  hex[16] = "89ab"[lrt::detail::hex_value(hex[16]) & 3U];
  for (const std::size_t at : {std::size_t{20}, std::size_t{16}, std::size_t{12}, std::size_t{8}}) hex.insert(at, 1, '-');
  return hex;
}

}  // namespace

Run::Run(const Query& q, const Dataset& d, const View& v, Budget& b, std::chrono::system_clock::time_point now)
    : query(q), data(d), view(v), budget(b), terms(d, b), operators(terms, b), now_(now) {
  constants.reserve(query.constants.size());
  for (const rdf::Term& constant : query.constants) constants.push_back(terms.intern(constant.view()));
}

Value Run::evaluate(const Expr& e, const Frame& frame) {
  budget.step();
  switch (e.op) {
    case Operator::variable: return operators.of(frame[e.slot]);
    case Operator::constant: return e.constant;
    case Operator::or_:
    case Operator::and_: {  // an error is unknown
      const bool decides = e.op == Operator::or_;
      bool error = false;
      for (const Expr& argument : e.arguments) {
        const auto truth = operators.truth(evaluate(argument, frame));
        if (!truth) error = true;
        else if (*truth == decides) return Value(decides);
      }
      return error ? Value() : Value(!decides);
    }
    case Operator::not_: {
      const auto truth = operators.truth(evaluate(e.arguments[0], frame));
      return truth ? Value(!*truth) : Value();
    }
    case Operator::equal:
    case Operator::not_equal: {
      const auto equal = operators.equal(evaluate(e.arguments[0], frame), evaluate(e.arguments[1], frame));
      return equal ? Value(*equal == (e.op == Operator::equal)) : Value();
    }
    case Operator::less:
    case Operator::greater:
    case Operator::less_equal:
    case Operator::greater_equal: {
      const Value a = evaluate(e.arguments[0], frame), b = evaluate(e.arguments[1], frame);
      const bool swapped = e.op == Operator::greater || e.op == Operator::greater_equal;
      const auto less = swapped ? operators.less(b, a) : operators.less(a, b);
      if (!less) return {};
      if (*less || e.op == Operator::less || e.op == Operator::greater) return Value(*less);
      const auto equal = operators.equal(a, b);
      return equal ? Value(*equal) : Value();
    }
    case Operator::in:
    case Operator::not_in: {
      const Value wanted = evaluate(e.arguments[0], frame);
      bool error = wanted.failed, found = false;
      for (std::size_t i = 1; i < e.arguments.size() && !found; ++i) {
        const auto equal = operators.equal(wanted, evaluate(e.arguments[i], frame));
        if (!equal) error = true;
        else found = *equal;
      }
      if (!found && error && e.arguments.size() > 1) return {};
      return Value(found == (e.op == Operator::in));
    }
    case Operator::add:
    case Operator::subtract:
    case Operator::multiply:
    case Operator::divide: {
      const auto operation = e.op == Operator::add        ? Operators::Arithmetic::add
                             : e.op == Operator::subtract ? Operators::Arithmetic::subtract
                             : e.op == Operator::multiply ? Operators::Arithmetic::multiply
                                                          : Operators::Arithmetic::divide;
      Value value = evaluate(e.arguments[0], frame);
      for (std::size_t i = 1; i < e.arguments.size() && !value.failed; ++i)
        value = operators.compute(operation, value, evaluate(e.arguments[i], frame));
      return value;
    }
    case Operator::negate: {
      const Value value = evaluate(e.arguments[0], frame);
      if (value.is_number() && value.is_floating()) return Value(-value.real, value.type);  // also of zero, which 0 - x is not
      return operators.compute(Operators::Arithmetic::subtract, Value(std::int64_t{0}), value);
    }
    case Operator::plus: {
      Value value = evaluate(e.arguments[0], frame);
      return value.is_number() ? value : Value();
    }
    case Operator::exists:
    case Operator::not_exists: {
      e.pattern->open();
      const bool found = e.pattern->next();
      e.pattern->close();
      return Value(found == (e.op == Operator::exists));
    }
    case Operator::bound: return Value(frame[e.arguments[0].slot] != nothing);
    case Operator::if_: {
      const auto truth = operators.truth(evaluate(e.arguments[0], frame));
      return truth ? evaluate(e.arguments[*truth ? 1 : 2], frame) : Value();
    }
    case Operator::coalesce:
      for (const Expr& argument : e.arguments) {
        if (Value value = evaluate(argument, frame); !value.failed) return value;
      }
      return {};
    default: return function(e, frame);
  }
}

Value Run::function(const Expr& e, const Frame& frame) {
  switch (e.op) {
    case Operator::same_term: {
      const Value a = evaluate(e.arguments[0], frame), b = evaluate(e.arguments[1], frame);
      if (a.failed || b.failed) return {};
      return Value(operators.number_of(a) == operators.number_of(b));
    }
    case Operator::rand: {
      if (!seeded_) {
        unsigned char bytes[8];
        fill_random(bytes, sizeof bytes);
        std::uint64_t seed = 0;
        for (const unsigned char byte : bytes) seed = seed << 8U | byte;
        random_.seed(seed);
        seeded_ = true;
      }
      return Value(static_cast<double>(random_() >> 11U) * 0x1p-53, Type::double_);
    }
    case Operator::now: {
      const auto since = std::chrono::duration_cast<std::chrono::nanoseconds>(now_.time_since_epoch());
      return made(rdf::literal(lexical::format_instant(since), vocab::xsd::dateTime));
    }
    case Operator::uuid: return made(rdf::iri("urn:uuid:" + uuid()));
    case Operator::struuid: return Value(uuid());
    case Operator::bnode: {
      if (e.arguments.empty()) return operators.of(terms.fresh_blank());
      const Value label = evaluate(e.arguments[0], frame);
      if (label.failed || label.type != Type::string) return {};
      const auto [at, is_new] = labels_.try_emplace(std::string(label.text()), nothing);
      if (is_new) {
        budget.take(label.text().size() + 64);
        at->second = terms.fresh_blank();
      }
      return operators.of(at->second);
    }
    case Operator::concat: {
      std::string text;
      std::string_view language;
      bool first = true, same = true;
      for (const Expr& argument : e.arguments) {
        const Value part = evaluate(argument, frame);
        if (!part.is_text()) return {};
        budget.work(part.text().size());
        budget.expect(text.size() + part.text().size());
        text += part.text();
        if (first) language = part.language;
        else if (part.language != language) same = false;
        first = false;
      }
      return Value(std::move(text), same ? language : std::string_view());
    }
    case Operator::strstarts:
    case Operator::strends:
    case Operator::contains:
    case Operator::strbefore:
    case Operator::strafter:
    case Operator::substr:
    case Operator::strdt:
    case Operator::strlang:
    case Operator::langmatches: return text_function(e, frame);
    case Operator::regex:
    case Operator::replace: return search(e, frame);
    default: break;
  }

  // Functions of one argument.
  if (e.arguments.size() != 1) return {};
  Value a = evaluate(e.arguments[0], frame);
  if (a.failed) return {};
  switch (e.op) {
    case Operator::is_iri: return Value(a.type == Type::iri);
    case Operator::is_blank: return Value(a.type == Type::blank);
    case Operator::is_literal: return Value(a.is_literal());
    case Operator::is_numeric: return Value(a.is_number());
    case Operator::str: {
      if (a.type == Type::string) return a;
      auto text = operators.text_of(a);
      if (!text) return {};
      budget.work(text->size());
      return Value(*std::move(text));
    }
    case Operator::lang: return a.is_literal() ? Value(std::string(a.language)) : Value();
    case Operator::datatype: {
      if (!a.is_literal()) return {};
      std::string memory;
      return made(rdf::iri(operators.view_of(a, memory).datatype));
    }
    case Operator::iri: {
      if (a.type == Type::iri) return a;
      if (a.type != Type::string) return {};
      budget.work(a.text().size());
      if (iri::is_absolute(a.text())) return made(rdf::iri(a.text()));
      if (query.base.empty()) return {};
      const Result<std::string> resolved = iri::resolve(query.base, a.text());
      return resolved ? made(rdf::iri(*resolved)) : Value();
    }
    case Operator::strlen: return a.is_text() ? (budget.work(a.text().size()), Value(static_cast<std::int64_t>(characters(a.text())))) : Value();
    case Operator::ucase:
    case Operator::lcase:
      if (!a.is_text()) return {};
      budget.work(4 * a.text().size());
      budget.expect(max_case_growth * a.text().size());
      return like(a, to_case(a.text(), e.op == Operator::ucase));
    case Operator::encode_for_uri: {
      if (!a.is_text()) return {};
      budget.work(4 * a.text().size());
      budget.expect(3 * a.text().size());
      std::string text;
      for (const char c : a.text()) {
        if (lrt::detail::is(c, lrt::detail::unreserved)) text += c;
        else lrt::detail::append_percent(text, c);
      }
      return Value(std::move(text));
    }
    case Operator::abs:
    case Operator::round:
    case Operator::ceil:
    case Operator::floor: return number_function(e, a);
    case Operator::year:
    case Operator::month:
    case Operator::day:
    case Operator::hours:
    case Operator::minutes:
    case Operator::seconds:
    case Operator::timezone:
    case Operator::tz: return time_function(e.op, a);
    case Operator::md5:
    case Operator::sha1:
    case Operator::sha256:
    case Operator::sha384:
    case Operator::sha512: {
      if (a.type != Type::string) return {};
      budget.work(8 * a.text().size());
      const Hash hash = e.op == Operator::md5      ? Hash::md5
                        : e.op == Operator::sha1   ? Hash::sha1
                        : e.op == Operator::sha256 ? Hash::sha256
                        : e.op == Operator::sha384 ? Hash::sha384
                                                   : Hash::sha512;
      std::string digest = digest_of(a.text(), hash);
      return digest.empty() ? Value() : Value(std::move(digest));
    }
    case Operator::call: return cast(e.function.view().text, a);
    default: return {};
  }
}

Value Run::text_function(const Expr& e, const Frame& frame) {
  const Value a = evaluate(e.arguments[0], frame), b = evaluate(e.arguments[1], frame);
  if (a.failed || b.failed) return {};
  budget.work(a.text().size());
  switch (e.op) {
    case Operator::strdt:
      if (a.type != Type::string || b.type != Type::iri || b.text() == vocab::rdf_::langString.text) return {};
      return made(rdf::literal(a.text(), Iri(b.text())));
    case Operator::strlang: {
      if (a.type != Type::string || b.type != Type::string || !rdf::is_language_tag(b.text())) return {};
      const std::string language = lrt::detail::lower(b.text());
      return made(rdf::tagged_literal(a.text(), language));
    }
    case Operator::langmatches: {  // RFC 4647, basic filtering
      if (a.type != Type::string || b.type != Type::string) return {};
      const std::string_view tag = a.text(), range = b.text();
      if (range == "*") return Value(!tag.empty());
      return Value(tag.size() >= range.size() && !range.empty() && lrt::detail::iequals_ascii(tag.substr(0, range.size()), range) &&
                   (tag.size() == range.size() || tag[range.size()] == '-'));
    }
    case Operator::substr: {
      if (!a.is_text() || !b.is_number()) return {};
      const double begin = round_half_up(b.as_double());
      double end = std::numeric_limits<double>::infinity();
      if (e.arguments.size() > 2) {
        const Value length = evaluate(e.arguments[2], frame);
        if (!length.is_number()) return {};
        end = begin + round_half_up(length.as_double());
      }
      const std::string_view text = a.text();
      std::size_t from = text.size(), to = text.size();
      double place = 0;
      for (std::size_t at = 0; at < text.size(); ++at) {
        if ((static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U) continue;
        ++place;
        if (from == text.size() && place >= begin && place < end) from = at;
        if (place >= end) {
          to = at;
          break;
        }
      }
      return like(a, from < to ? text.substr(from, to - from) : std::string_view());
    }
    default: break;
  }
  if (!compatible(a, b)) return {};
  const std::string_view text = a.text(), part = b.text();
  switch (e.op) {
    case Operator::strstarts: return Value(text.substr(0, part.size()) == part);
    case Operator::strends: return Value(text.size() >= part.size() && text.substr(text.size() - part.size()) == part);
    default: break;
  }
  // A search takes as long as both together at worst, in steps of 64 bytes.
  std::size_t at = std::string_view::npos;
  if (part.empty()) {
    at = 0;
  } else {
    constexpr std::size_t slice = 4'096;
    for (std::size_t from = 0; from + part.size() <= text.size() && at == std::string_view::npos; from += slice) {
      budget.step(1 + part.size());
      at = text.substr(from, slice + part.size() - 1).find(part);
      if (at != std::string_view::npos) at += from;
    }
  }
  if (e.op == Operator::contains) return Value(at != std::string_view::npos);
  if (at == std::string_view::npos) return Value(std::string());
  return like(a, e.op == Operator::strbefore ? text.substr(0, at) : text.substr(at + part.size()));
}

Value Run::number_function(const Expr& e, const Value& a) {
  if (!a.is_number()) return {};
  if (a.is_floating()) {
    double value = a.real;
    switch (e.op) {
      case Operator::abs: value = std::fabs(value); break;
      case Operator::round: value = std::isfinite(value) ? round_half_up(value) : value; break;
      case Operator::ceil: value = std::ceil(value); break;
      default: value = std::floor(value);
    }
    return Value(value, a.type);
  }
  if (a.type == Type::integer && (a.fits ? e.op != Operator::abs : true)) {
    if (a.fits) return Value(a.integer);
    if (e.op != Operator::abs) return a;
  }
  if (a.type == Type::integer && a.fits && a.integer != std::numeric_limits<std::int64_t>::min())
    return Value(a.integer < 0 ? -a.integer : a.integer);
  const auto number = Decimal::parse(operators.text_of(a).value_or(""));
  if (!number) return {};
  if (e.op == Operator::abs) return operators.of(number->absolute(), a.type);
  const auto whole = number->rounded(e.op == Operator::round  ? Decimal::Rounding::half_up
                                     : e.op == Operator::ceil ? Decimal::Rounding::ceiling
                                                              : Decimal::Rounding::floor);
  return whole ? operators.of(*whole, a.type) : Value();
}

Value Run::time_function(Operator op, const Value& a) {
  if (a.type != Type::date_time) return {};
  const std::optional<Moment> moment = moment_of(a.text());
  if (!moment) return {};
  const auto number = [](unsigned n) { return Value(std::int64_t{n}); };
  const auto exact = [&](std::string_view digits, Type type) {
    const auto value = Decimal::parse(digits);
    return value ? operators.of(*value, type) : Value();
  };
  const std::string_view zone = moment->zone;
  switch (op) {
    case Operator::year: return exact(moment->year, Type::integer);
    case Operator::month: return number(moment->month);
    case Operator::day: return number(moment->day);
    case Operator::hours: return number(moment->hours);
    case Operator::minutes: return number(moment->minutes);
    case Operator::seconds: return exact(moment->seconds, Type::decimal);
    case Operator::tz: return Value(std::string(zone));
    default: break;
  }
  if (zone.empty()) return {};
  std::string duration = "PT0S";
  if (!is_utc(zone)) {
    const unsigned hours = two_digits(zone, 1), minutes = two_digits(zone, 4);
    duration = zone[0] == '-' ? "-PT" : "PT";
    if (hours != 0) duration += std::to_string(hours) + "H";
    if (minutes != 0) duration += std::to_string(minutes) + "M";
  }
  return made(rdf::literal(duration, vocab::xsd::dayTimeDuration));
}

/// SPARQL 17.5. Other functions are not known.
Value Run::cast(std::string_view type, const Value& a) {
  using lexical::Datatype;
  const Datatype target = lexical::datatype_of(type);
  if (target == Datatype::unknown) return {};
  if (target == Datatype::string) {
    if (a.failed || a.type == Type::blank) return {};
    if (a.type == Type::boolean) return Value(std::string(a.truth ? "true" : "false"));
    if (a.is_floating()) return Value(canonical(a.real, a.type == Type::float_));
    std::string text = operators.text_of(a).value_or("");
    if (a.type == Type::date_time) {
      std::optional<std::string> canonical_text = canonical_moment(text);
      return canonical_text ? Value(*std::move(canonical_text)) : Value();
    }
    if (a.is_number()) {
      if (const auto number = Decimal::parse(text)) text = number->text();
    }
    return Value(std::move(text));
  }
  if (!a.is_literal() || a.type == Type::tagged) return {};
  const bool is_string = a.type == Type::string;
  const std::string_view text = is_string ? lrt::detail::trim_space(a.text()) : std::string_view();
  budget.work(text.size());
  switch (target) {
    case Datatype::boolean: {
      if (a.type == Type::boolean) return Value(a.truth);
      if (a.is_number()) return Value(operators.truth(a).value_or(false));
      const auto truth = lexical::parse_boolean(text);
      return is_string && truth ? Value(*truth) : Value();
    }
    case Datatype::integer:
    case Datatype::decimal: {
      const Type kind = target == Datatype::integer ? Type::integer : Type::decimal;
      std::string digits;
      if (a.type == Type::boolean) digits = a.truth ? "1" : "0";
      else if (a.is_floating()) digits = std::isfinite(a.real) ? without_exponent(lexical::format(a.real)) : std::string();
      else if (a.is_number()) digits = operators.text_of(a).value_or("");
      else if (is_string && (kind == Type::integer ? lexical::is_integer(text) : lexical::is_decimal(text))) digits = text;
      if (kind == Type::integer && !digits.empty()) {
        digits.erase(std::min(digits.find('.'), digits.size()));
        if (digits.empty() || digits == "-" || digits == "+") digits = "0";
      }
      const auto number = Decimal::parse(digits);
      return number ? operators.of(*number, kind) : Value();
    }
    case Datatype::float_:
    case Datatype::double_: {
      const Type kind = target == Datatype::float_ ? Type::float_ : Type::double_;
      const bool is_single = kind == Type::float_;
      if (a.type == Type::boolean) return Value(a.truth ? 1.0 : 0.0, kind);
      if (a.is_number()) return Value(is_single ? static_cast<double>(a.as_float()) : a.as_double(), kind);
      const auto wide = lexical::parse_double(text);
      if (!is_string || !wide) return {};
      return Value(is_single ? static_cast<double>(lexical::parse_float(text).value_or(0)) : *wide, kind);
    }
    case Datatype::date_time:
      if (a.type == Type::date_time) return a;
      [[fallthrough]];
    case Datatype::date:
    case Datatype::time:
    case Datatype::duration:
    case Datatype::day_time_duration:
    case Datatype::year_month_duration:
      if (!is_string || !lexical::is_well_formed(text, target)) return {};
      return made(rdf::literal(text, Iri(type)));
    default: return {};
  }
}

Value Run::search(const Expr& e, const Frame& frame) {
  const bool replaces = e.op == Operator::replace;
  const Value text = evaluate(e.arguments[0], frame), pattern = evaluate(e.arguments[1], frame);
  Value replacement, flags;
  if (replaces) replacement = evaluate(e.arguments[2], frame);
  const std::size_t flags_at = replaces ? 3 : 2;
  if (e.arguments.size() > flags_at) flags = evaluate(e.arguments[flags_at], frame);
  else flags = Value(std::string());
  if (!text.is_text() || pattern.failed || pattern.type != Type::string || flags.failed || flags.type != Type::string) return {};
  if (replaces && (replacement.failed || replacement.type != Type::string)) return {};
  if (!e.regex || e.regex->pattern != pattern.text() || e.regex->flags != flags.text()) {
    budget.step(100 + pattern.text().size());
    e.regex = std::make_shared<Expr::Compiled>(Expr::Compiled{std::string(pattern.text()), std::string(flags.text()),
                                                              shacl::Regex::compile(pattern.text(), flags.text(), max_pattern_bytes)});
  }
  const Result<shacl::Regex>& regex = e.regex->regex;
  if (!regex) return {};
  std::size_t steps = 0;
  if (!replaces) {
    const auto outcome = regex->search(text.text(), scratch_, steps);
    budget.step(steps);
    if (outcome == shacl::Regex::Outcome::undecided) budget.out_of_search();
    return Value(outcome == shacl::Regex::Outcome::match);
  }
  std::string result;
  constexpr std::size_t max_bytes = 16 * 1024 * 1024;
  const auto replaced = regex->replace(text.text(), replacement.text(), max_bytes, scratch_, steps, result);
  budget.step(steps);
  budget.work(result.size());
  budget.expect(replaced == shacl::Regex::Replaced::too_long ? std::numeric_limits<std::size_t>::max() : result.size());
  if (replaced == shacl::Regex::Replaced::undecided) budget.out_of_search();
  return replaced == shacl::Regex::Replaced::done ? like(text, result) : Value();
}

}  // namespace lrt::query
