// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/plain.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/bytes.hpp"
#include "src/rdf/exactly_one.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/limits.hpp"
#include "src/rdf/plain_names.hpp"
#include "src/rdf/representable.hpp"
#include "src/rdf/value_writer.hpp"
#include "src/rdf/whole_number.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace {

using Kind = Type::Kind;

constexpr std::size_t max_depth = 64;  // as in read_value()

const Type& without_optional(const Type& type) noexcept { return type.kind == Kind::optional ? without_optional(*type.element) : type; }

/// Whether {"value": ..., "unit": ...} would be read as the record itself.
bool has_value_member(const Type& type) {
  if (type.kind == Kind::map) return true;  // its names are free
  if (!type.has_fields()) return false;
  const std::vector<std::string> names = member_names(type);
  return std::find(names.begin(), names.end(), "value") != names.end();
}

class JsonWriter {
 public:
  explicit JsonWriter(bool with_units) : with_units_(with_units) {}

  /// @param unit_said  the unit is written once for all members of a list
  void write(const Type& type, const Facets& facets, const Value& value, bool unit_said = false) {
    if (value.is_null()) {
      out_ += "null";
    } else if (type.kind == Kind::optional) {
      write(*type.element, facets, value, unit_said);
    } else if (with_units_ && !unit_said && carries_unit(type, facets) && !has_value_member(type)) {
      out_ += "{\"value\":";
      bare(type, facets, value);
      out_ += ",\"unit\":";
      append_quoted(out_, unit_code(facets.unit()));
      out_ += '}';
    } else {
      bare(type, facets, value);
    }
  }
  std::string take() { return std::move(out_); }

 private:
  void bare(const Type& type, const Facets& facets, const Value& value) {
    switch (type.kind) {
      case Kind::list: return list(type, facets, value);
      case Kind::record:
      case Kind::variant: return record(type, facets, value);
      case Kind::map: return map(type, facets, value);
      case Kind::boolean:
      case Kind::integer: out_ += lexical_form(type, value); return;
      case Kind::real: {
        const std::string text = lexical_form(type, value);
        if (text.find_first_of("NI") == std::string::npos) out_ += text;
        else append_quoted(out_, text);
        return;
      }
      default: append_quoted(out_, lexical_form(type, value));
    }
  }

  void list(const Type& type, const Facets& facets, const Value& value) {
    char before = '[';
    for (const Value& member : members_of(value)) {
      if (member.is_null()) continue;
      out_ += before;
      before = ',';
      write(*type.element, facets, member, carries_unit(type, facets));
    }
    out_ += before == '[' ? "[]" : "]";
  }

  void map(const Type& type, const Facets& facets, const Value& value) {
    char before = '{';
    for (const Value& member : members_of(value)) {
      out_ += before;
      before = ',';
      append_quoted(out_, lexical_form(detail::text_type(), members_of(member)[0]));
      out_ += ':';
      write(*type.element, facets, members_of(member)[1]);
    }
    out_ += before == '{' ? "{}" : "}";
  }

  void record(const Type& type, const Facets& facets, const Value& value) {
    const std::vector<std::string> names = member_names(type);
    const Value::Sequence& members = members_of(value);
    char before = '{';
    for (std::size_t i = 0; i < names.size() && i < members.size(); ++i) {
      if (members[i].is_null()) continue;
      out_ += before;
      before = ',';
      append_quoted(out_, names[i]);
      out_ += ':';
      write(*type.fields[i].type, field_facets(type.fields[i], facets), members[i]);
    }
    out_ += before == '{' ? "{}" : "}";
  }

  static const Value::Sequence& members_of(const Value& value) {
    static const Immortal<Value::Sequence> none;
    return value.sequence() ? *value.sequence() : *none;
  }

  bool with_units_;
  std::string out_;
};

std::string json_of(const Type& type, const Facets& facets, const Value& value, bool with_units) {
  JsonWriter writer(with_units);
  writer.write(type, facets, value);
  return writer.take();
}

template <class To, class From>
To same_bits(From from) noexcept {
  To to;
  static_assert(sizeof to == sizeof from);
  std::memcpy(&to, &from, sizeof to);
  return to;
}

/// The bits of a number in its datatype, in the lowest `bytes`.
std::uint64_t bits_of(const Type& type, const Value& value) noexcept {
  if (type.kind == Kind::real) {
    const double number = value.real() ? *value.real() : 0;
    return type.single ? same_bits<std::uint32_t>(static_cast<float>(number)) : same_bits<std::uint64_t>(number);
  }
  if (value.large_integer()) return *value.large_integer();
  return value.integer() ? static_cast<std::uint64_t>(*value.integer()) : 0;
}

/// Writes RFC 8949 with definite lengths, the shortest integers, and floats of their own size.
class CborWriter {
 public:
  void write(const Type& type, const Value& value) {
    if (value.is_null()) return byte(0xF6);
    switch (type.kind) {
      case Kind::optional: return write(*type.element, value);
      case Kind::boolean: return byte(value.boolean() && *value.boolean() ? 0xF5 : 0xF4);
      case Kind::integer: {
        const std::uint64_t bits = bits_of(type, value);
        const bool is_negative = value.integer() && *value.integer() < 0;
        return head(is_negative ? 1 : 0, is_negative ? ~bits : bits);
      }
      case Kind::real: byte(type.single ? 0xFA : 0xFB); return big_endian(bits_of(type, value), type.single ? 4 : 8);
      case Kind::list:
        head(4, count_of(value));
        if (value.sequence())
          for (const Value& member : *value.sequence())
            if (!member.is_null()) write(*type.element, member);
        return;
      case Kind::record:
      case Kind::variant: {
        const std::vector<std::string> names = member_names(type);
        head(5, count_of(value));
        for (std::size_t i = 0; value.sequence() && i < value.sequence()->size() && i < names.size(); ++i) {
          const Value& member = (*value.sequence())[i];
          if (member.is_null()) continue;
          text(names[i]);
          write(*type.fields[i].type, member);
        }
        return;
      }
      case Kind::map:
        head(5, count_of(value));
        if (value.sequence())
          for (const Value& member : *value.sequence()) {
            text(lexical_form(detail::text_type(), (*member.sequence())[0]));
            write(*type.element, (*member.sequence())[1]);
          }
        return;
      case Kind::text:
        if (const auto bytes = type.is_bytes() && value.text() ? bytes_of(*value.text()) : std::nullopt) {
          head(2, bytes->size());
          out_ += *bytes;
          return;
        }
        [[fallthrough]];
      default: text(lexical_form(type, value));
    }
  }
  std::string take() { return std::move(out_); }

 private:
  static std::uint64_t count_of(const Value& value) {
    std::uint64_t count = 0;
    if (value.sequence())
      for (const Value& member : *value.sequence()) count += member.is_null() ? 0 : 1;
    return count;
  }

  void byte(unsigned b) { out_.push_back(static_cast<char>(b)); }
  void big_endian(std::uint64_t bits, unsigned bytes) {
    for (unsigned i = bytes; i-- > 0;) byte(static_cast<unsigned>(bits >> (8 * i) & 0xFF));
  }
  void head(unsigned major, std::uint64_t argument) {
    const unsigned top = major << 5;
    if (argument < 24) return byte(top | static_cast<unsigned>(argument));
    const unsigned power = argument <= 0xFF ? 0 : argument <= 0xFFFF ? 1 : argument <= 0xFFFFFFFF ? 2 : 3;
    byte(top | (24 + power));
    big_endian(argument, 1U << power);
  }
  void text(std::string_view text) {
    head(3, text.size());
    out_ += text;
  }

  std::string out_;
};

/// The type of the numbers in a list of lists.
const Type& innermost(const Type& type) noexcept { return type.kind == Kind::list || type.kind == Kind::optional ? innermost(*type.element) : type; }

/// @tparam Bits  unsigned, of the size of one number
template <class Bits>
void append_octets(const Type& number, const Value* values, std::size_t count, std::string& out) {
  const std::size_t from = out.size();
  out.resize(from + count * sizeof(Bits));
  char* to = &out[from];
  for (std::size_t i = 0; i < count; ++i) {
    const auto bits = static_cast<Bits>(bits_of(number, values[i]));
    for (std::size_t b = 0; b < sizeof bits; ++b) *to++ = static_cast<char>(bits >> (8 * b) & 0xFF);
  }
}

void write_octets(const Type& number, std::size_t bytes, const Value& value, std::string& out) {
  const Value::Sequence* members = value.sequence();
  if (members && !members->empty() && members->front().sequence()) {
    for (const Value& m : *members) write_octets(number, bytes, m, out);
    return;
  }
  const Value* first = members ? members->data() : &value;
  const std::size_t count = members ? members->size() : 1;
  switch (bytes) {
    case 1: return append_octets<std::uint8_t>(number, first, count, out);
    case 2: return append_octets<std::uint16_t>(number, first, count, out);
    case 4: return append_octets<std::uint32_t>(number, first, count, out);
    default: append_octets<std::uint64_t>(number, first, count, out);
  }
}

class OctetsReader {
 public:
  OctetsReader(std::string_view body, std::size_t bytes) : body_(body), bytes_(bytes) {}

  /// @param length  of this list, if it is a list; followed by the lengths of nested lists
  Value read(const Type& type, const std::size_t* length) {
    if (type.kind != Kind::list) return number(type);
    Value::Sequence members;
    members.reserve(*length);
    for (std::size_t i = 0; i < *length; ++i) members.push_back(read(*type.element, length + 1));
    return Value(std::move(members));
  }

 private:
  Value number(const Type& type) {
    std::uint64_t bits = 0;
    for (std::size_t i = bytes_; i-- > 0;) bits = bits << 8 | static_cast<unsigned char>(body_[at_ + i]);
    at_ += bytes_;
    if (type.kind == Kind::real && type.single) return Value(static_cast<double>(same_bits<float>(static_cast<std::uint32_t>(bits))));
    if (type.kind == Kind::real) return Value(same_bits<double>(bits));
    if (type.lowest >= 0) return Value(bits);
    const std::uint64_t sign = std::uint64_t{1} << (8 * bytes_ - 1);
    return Value(static_cast<std::int64_t>((bits ^ sign) - sign));
  }

  std::string_view body_;
  std::size_t bytes_, at_ = 0;
};

Unexpected without_octets(const std::string& expected) { return unexpected(Errc::unsupported_syntax, "expected " + expected + " for octets"); }

/// Whether all lists of a level have the same length.
Result<void> check_lengths(const Value& value, const std::size_t* length, const std::size_t* end) {
  if (length == end) return {};
  const Value::Sequence* members = value.sequence();
  const std::size_t found = members ? members->size() : 0;
  if (!members || found != *length)
    return without_octets("lists of one length, found members " + std::to_string(*length) + " and " + std::to_string(found));
  if (length + 1 == end) return {};
  for (const Value& m : *members)
    if (Result<void> r = check_lengths(m, length + 1, end); !r) return r;
  return {};
}

Result<Value> read_octets(std::string_view body, const Type& type, std::size_t max_values) {
  if (!reads_octets(type))
    return unexpected(Errc::unsupported_syntax, "expected a type of numbers with one free length at most: octets do not contain more lengths");
  std::optional<Octets> layout = octets_of(type);
  const auto open = std::find(layout->shape.begin(), layout->shape.end(), 0U);
  const bool is_open = open != layout->shape.end();
  if (is_open) *open = 1;
  const std::size_t part = layout->size();
  if (is_open ? body.size() % part != 0 : body.size() != part) {
    const std::string numbers = std::to_string(part / layout->bytes) + " of " + abbreviate(layout->datatype.text);
    return unexpected(Error{Errc::expected_rdf,
                            "expected " + std::string(is_open ? "a multiple of " : "") + std::to_string(part) + " octets (" + numbers + "), found " +
                                std::to_string(body.size()),
                            is_open ? body.size() - body.size() % part : std::min(body.size(), part)});
  }
  if (body.size() / layout->bytes > max_values) return unexpected(Errc::limit_exceeded, "more than " + std::to_string(max_values) + " numbers");
  if (is_open) *open = body.size() / part;
  return OctetsReader(body, layout->bytes).read(without_optional(type), layout->shape.data());
}

/// Whether an integer type can hold the number. If not, it becomes an xsd:integer, and the report says what was expected.
bool fits(const Type& type, std::string_view digits) noexcept {
  if (const auto number = lexical::parse_int64(digits))
    return *number >= type.lowest && (*number < 0 || static_cast<std::uint64_t>(*number) <= type.highest);
  const auto number = lexical::parse_uint64(digits);
  return number && *number <= type.highest;
}

/// Thrown to end the reading early, inside this file only.
struct Refused {
  Mismatch mismatch;
};

/// Reads JSON or CBOR into triples. A value of a wrong type is added as it is, so that the shape finds it.
class DocumentReader {
 public:
  using Document = json::Document;
  using Id = Document::Id;

  DocumentReader(const Document& document, bool is_binary, Graph& graph, std::string_view vocabulary, TermId focus)
      : document_(document), is_binary_(is_binary), graph_(graph), triples_(graph, vocabulary, focus) {}

  void at(TermId focus, const Type& outer, const Facets& facets) {
    const Type& type = without_optional(outer);
    const Id id = unwrapped(document_.root(), type, facets, true);
    if (kind(id) == Json::null) return;
    switch (type.kind) {
      case Kind::record:
      case Kind::variant:
        if (kind(id) != Json::object) refuse(id, "expected an object");
        if (record(focus, type, facets, id) || outer.kind != Kind::optional) return;
        if (type.kind == Kind::variant) {
          ExactlyOne none;
          for (const FieldType& field : type.fields) none.add(field.name, false);
          throw Refused{{document_.pointer(id), none.message()}};
        }
        return triples_.present(focus);
      case Kind::integer:
      case Kind::real: return triples_.number(focus, scalar(type, id), facets.unit());
      default: {
        const ValueWriter::Step step(triples_, value_step);
        triples_.value(focus, bare(type, facets, id));
      }
    }
  }

 private:
  using Json = Document::Kind;

  Json kind(Id id) const noexcept { return document_.kind(id); }

  std::string shown(Id id) const {
    switch (kind(id)) {
      case Json::null: return "null";
      case Json::false_: return "false";
      case Json::true_: return "true";
      case Json::number: return shortened(document_.text(id));
      case Json::string: return quoted(document_.text(id));
      case Json::array: return "an array";
      case Json::object: return "an object";
    }
    return {};
  }

  [[noreturn]] void refuse(Id at, const std::string& expected) const { throw Refused{{document_.pointer(at), expected + ", found " + shown(at)}}; }

  static std::string expected(const Type& type) {
    switch (type.kind) {
      case Kind::optional: return expected(*type.element);
      case Kind::boolean: return "expected true or false";
      case Kind::integer:
      case Kind::real: return "expected a number, or {\"value\": ..., \"unit\": ...}";
      case Kind::list: return "expected an array";
      case Kind::record:
      case Kind::variant:
      case Kind::map: return "expected an object";
      default: return "expected a text";
    }
  }

  /// The content of {"value": ..., "unit": ...}, after a check of the unit; for other values the value itself.
  Id unwrapped(Id id, const Type& type, const Facets& facets, bool is_whole) const {
    if (kind(id) != Json::object) return id;
    const Id value = document_.member(id, "value");
    const bool may_be = is_whole || type.is_number() || carries_unit(type, facets);
    if (value == Document::none || !may_be || has_value_member(type)) return id;
    Id unit = Document::none;
    for (const Id member : json::Children(document_, id)) {
      if (document_.key(member) == "unit") unit = member;
      else if (member != value && type.has_fields()) return id;
      else if (member != value) refuse(member, "expected nothing beside \"value\" and \"unit\"");
    }
    if (unit == Document::none) return value;
    if (!carries_unit(type, facets)) refuse(unit, "expected no unit, because none is declared");
    const std::string_view code = unit_code(facets.unit());
    if (kind(unit) != Json::string || document_.text(unit) != code) refuse(unit, "expected \"" + std::string(code) + "\"");
    return value;
  }

  /// @return  whether a field is present
  bool record(TermId node, const Type& type, const Facets& facets, Id id) {
    bool has_field = false;
    triples_.classes(node, type);
    std::optional<ValueWriter::Step> inside;
    if (!type.value_predicate.empty()) inside.emplace(triples_, value_step);
    const TermId fields = triples_.value_node(node, type);
    const std::vector<std::string> names = member_names(type);
    for (const Id member : json::Children(document_, id))
      if (std::find(names.begin(), names.end(), document_.key(member)) == names.end()) refuse_member(member, names);
    for (std::size_t i = 0; i < names.size(); ++i) {
      const FieldType& field = type.fields[i];
      const Id member = document_.member(id, names[i]);
      if (member == Document::none) continue;
      const ValueWriter::Step step(triples_, field.name);
      if (const std::optional<TermId> o = object(*field.type, field_facets(field, facets), member)) {
        triples_.field(fields, field, *o);
        has_field = true;
      }
    }
    triples_.unit(node, node_unit(type, facets));
    return has_field;
  }

  [[noreturn]] void refuse_member(Id member, const std::vector<std::string>& names) const {
    constexpr std::size_t max_shown = 10;
    std::string text = names.empty() ? "no member" : "one of";
    for (std::size_t i = 0; i < names.size() && i < max_shown; ++i) text += (i == 0 ? " \"" : ", \"") + names[i] + "\"";
    if (names.size() > max_shown) text += ", ... (cut)";
    throw Refused{{document_.pointer(member), "expected " + text + ", found \"" + shortened(document_.key(member)) + "\""}};
  }

  /// The object of a field or a list; nullopt: absent.
  std::optional<TermId> object(const Type& outer, const Facets& facets, Id id) {
    const Type& type = without_optional(outer);
    id = unwrapped(id, type, facets, false);
    if (kind(id) == Json::null) return std::nullopt;
    return bare(type, facets, id);
  }

  TermId bare(const Type& type, const Facets& facets, Id id) {
    if (type.has_fields() && kind(id) == Json::object) {
      const TermId node = triples_.node();
      record(node, type, facets, id);
      return node;
    }
    if (type.kind == Kind::list && kind(id) == Json::array) {
      std::vector<TermId> members;
      for (const Id member : json::Children(document_, id)) {
        const ValueWriter::Step step(triples_, members.size());
        const std::optional<TermId> o = object(*type.element, facets, member);
        if (!o) refuse(member, expected(*type.element));
        members.push_back(*o);
      }
      return triples_.list(members);
    }
    if (type.kind == Kind::map && kind(id) == Json::object) {
      std::vector<TermId> members;
      for (const Id member : json::Children(document_, id)) {
        const ValueWriter::Step step(triples_, members.size());
        const std::optional<TermId> o = [&] {
          const ValueWriter::Step inside(triples_, value_step);
          return object(*type.element, facets, member);
        }();
        if (!o) refuse(member, expected(*type.element));
        members.push_back(triples_.map_member(document_.key(member), *o));
      }
      return triples_.list(members);
    }
    const TermId term = scalar(type, id);
    return type.is_number() ? triples_.number(term, facets.unit()) : term;
  }

  /// A literal, with the type's datatype if it fits. An array becomes a list.
  TermId scalar(const Type& type, Id id) {
    const std::string_view text = document_.text(id);
    const auto typed = [&](Iri datatype) { return graph_.intern(literal(text, datatype)); };
    switch (kind(id)) {
      case Json::true_:
      case Json::false_: return graph_.intern(literal(kind(id) == Json::true_ ? "true" : "false", vocab::xsd::boolean));
      case Json::number: {
        if (type.kind == Kind::real) return real(type, text);
        if (text.find_first_not_of("-0123456789") != std::string_view::npos) {
          // JSON has one kind of number: 5.0 and 5e0 are integers.
          const auto whole = whole_number(text, is_binary_ ? lexical::Datatype::double_ : lexical::Datatype::decimal);
          if (type.kind == Kind::integer && whole) return graph_.intern(literal(*whole, fits(type, *whole) ? type.datatype : vocab::xsd::integer));
          return typed(vocab::xsd::double_);
        }
        return typed(type.kind == Kind::integer && fits(type, text) ? type.datatype : vocab::xsd::integer);
      }
      case Json::string: {
        if (document_.is_octets(id)) return typed(vocab::xsd::base64Binary);  // the shape refuses it for a text
        const bool fits = type.kind == Kind::real ? text == "NaN" || text == "INF" || text == "-INF"
                                                  : type.kind == Kind::text || type.kind == Kind::enumeration || type.kind == Kind::duration ||
                                                        type.kind == Kind::instant;
        return typed(fits ? type.datatype : vocab::xsd::string);
      }
      case Json::array: {
        if (type.has_fields() || type.kind == Kind::map) refuse(id, expected(type));
        std::vector<TermId> members;
        for (const Id member : json::Children(document_, id)) members.push_back(scalar(type, member));
        return graph_.add_list(members);
      }
      default: refuse(id, expected(type));
    }
  }

  /// A number of CBOR has no digits: it is formatted as in write_value().
  TermId real(const Type& type, std::string_view digits) {
    const bool has_exponent = type.datatype == vocab::xsd::decimal && (is_binary_ || !lexical::is_decimal(digits));  // a decimal has none
    if (!is_binary_ && !has_exponent) return graph_.intern(literal(digits, type.datatype));
    const double number = lexical::parse_double(digits).value_or(0);
    if (has_exponent) {  // a number that is rounded away keeps its digits, so that the report shows them
      const bool has_form = std::isfinite(number) && !lexical::is_rounded_away(digits, number);
      return graph_.intern(literal(has_form ? lexical_form(type, Value(number)) : std::string(digits), type.datatype));
    }
    if (!type.single || !std::isfinite(number)) return graph_.intern(literal(lexical::format(number), type.datatype));
    // Rounded once: an integer from its digits, a double from its value. A number beyond the range of float is written exactly, so that its digits
    // are beyond it, too.
    const bool is_whole = lexical::is_integer(digits);
    const float narrow = is_whole ? lexical::parse_float(digits).value_or(0) : static_cast<float>(number);
    if (std::isfinite(narrow) && (narrow != 0 || number == 0)) return graph_.intern(literal(lexical::format(narrow), type.datatype));
    return graph_.intern(literal(std::isfinite(narrow) ? lexical::format(number) : fixed(number), type.datatype));
  }

  static std::string fixed(double number) {
    char text[400];
    return std::string(text, std::to_chars(text, text + sizeof text, number, std::chars_format::fixed, 0).ptr);
  }

  const Document& document_;
  bool is_binary_;
  Graph& graph_;
  ValueWriter triples_;
};

/// Reads a scalar from text/plain.
TermId text_literal(std::string_view text, const Type& type, Graph& graph) {
  const auto typed = [&](bool fits) { return graph.intern(literal(text, fits ? type.datatype : vocab::xsd::string)); };
  switch (type.kind) {
    case Kind::boolean: return typed(lexical::parse_boolean(text).has_value());
    case Kind::real: return typed(lexical::is_double(text));
    case Kind::integer:
      if (!lexical::is_integer(text) && lexical::is_double(text)) {
        if (const auto whole = whole_number(text)) return graph.intern(literal(*whole, fits(type, *whole) ? type.datatype : vocab::xsd::integer));
        return graph.intern(literal(text, vocab::xsd::double_));
      }
      if (lexical::is_integer(text) && !fits(type, text)) return graph.intern(literal(text, vocab::xsd::integer));
      return typed(lexical::is_integer(text));
    default: return typed(true);
  }
}

Result<void> read_text(std::string_view body, const Type& outer, const Facets& facets, std::string_view vocabulary, Graph& graph, TermId focus) {
  if (const auto at = utf8::find_invalid(body)) return misread(body, *at, utf8::fault_of(body));
  if (const std::size_t at = body.find('\0'); at != std::string_view::npos) return misread(body, at, "U+0000 is not accepted");
  body = utf8::without_mark(body);
  const Type& type = without_optional(outer);
  if (type.kind != Kind::text) {
    constexpr std::string_view blanks = " \t\r\n";
    body.remove_prefix(std::min(body.find_first_not_of(blanks), body.size()));
    body = body.substr(0, body.find_last_not_of(blanks) + 1);
  }
  if (outer.kind == Kind::optional && body.empty()) return {};  // only white space
  const TermId term = text_literal(body, type, graph);
  ValueWriter triples(graph, vocabulary);
  if (type.is_number()) triples.number(focus, term, facets.unit());
  else triples.value(focus, term);
  return {};
}

}  // namespace

std::vector<std::string> member_names(const Type& record) {
  std::vector<std::string> names;
  names.reserve(record.fields.size());
  for (const FieldType& f : record.fields) names.push_back(f.name);
  const auto tell_apart = [&](auto name_of) {
    std::vector<std::size_t> order(names.size());  // sorted by name, because a robot's state may have a thousand members
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return names[a] < names[b]; });
    std::vector<std::size_t> repeated;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const bool as_before = i > 0 && names[order[i]] == names[order[i - 1]];
      const bool as_next = i + 1 < order.size() && names[order[i]] == names[order[i + 1]];
      if (as_before || as_next) repeated.push_back(order[i]);
    }
    for (const std::size_t i : repeated) names[i] = name_of(record.fields[i].predicate);
  };
  tell_apart([](const std::string& predicate) {
    std::string name = abbreviate(predicate);
    return name.front() == '<' ? predicate : name;
  });
  tell_apart([](const std::string& predicate) { return predicate; });
  return names;
}

bool carries_unit(const Type& type, const Facets& facets) noexcept {
  if (facets.unit().empty()) return false;
  if (type.kind == Kind::list || type.kind == Kind::optional) return carries_unit(*type.element, facets);
  return type.is_number() || (type.has_fields() && !node_unit(type, facets).empty());
}

std::string_view unit_code(const Unit& unit) noexcept {
  if (!unit.ucum.empty()) return unit.ucum;
  return unit.qudt.empty() ? unit.vom.text : unit.qudt.text;
}

std::string_view media_type(Plain format) noexcept {
  switch (format) {
    case Plain::json: return "application/json";
    case Plain::json_with_units: return "application/json;profile=\"https://w3id.org/lrt/ns#withUnits\"";
    case Plain::text: return "text/plain";
    case Plain::cbor: return "application/cbor";
    case Plain::octets: return "application/octet-stream";
  }
  return {};
}

std::optional<Plain> plain_of(const MediaType& type) noexcept {
  if (type.type == "text" && type.subtype == "plain") return Plain::text;
  if (type.type != "application") return std::nullopt;
  if (type.subtype == "json") return Plain::json;
  if (type.subtype == "cbor") return Plain::cbor;
  if (type.subtype == "octet-stream") return Plain::octets;
  return std::nullopt;
}

std::size_t Octets::size() const noexcept {
  std::size_t size = bytes;
  for (const std::size_t length : shape) size *= length;
  return size;
}

std::optional<Octets> octets_of(const Type& type) {
  const Type* t = &without_optional(type);
  Octets octets;
  for (; t->kind == Kind::list; t = t->element) octets.shape.push_back(t->shortest == t->longest ? t->shortest : 0);
  if (!t->is_number()) return std::nullopt;
  octets.datatype = t->datatype;
  if (t->kind == Kind::real) {
    octets.datatype = t->single ? vocab::xsd::float_ : vocab::xsd::double_;
    octets.bytes = t->single ? 4 : 8;
    return octets;
  }
  switch (lexical::datatype_of(t->datatype.text)) {
    case lexical::Datatype::byte_:
    case lexical::Datatype::unsigned_byte: octets.bytes = 1; break;
    case lexical::Datatype::short_:
    case lexical::Datatype::unsigned_short: octets.bytes = 2; break;
    case lexical::Datatype::int_:
    case lexical::Datatype::unsigned_int: octets.bytes = 4; break;
    case lexical::Datatype::long_:
    case lexical::Datatype::unsigned_long: octets.bytes = 8; break;
    default: return std::nullopt;
  }
  return octets;
}

Result<Octets> octets_of(const Type& type, const Value& value) {
  std::optional<Octets> layout = octets_of(type);
  if (!layout) return without_octets("a number or lists of numbers");
  if (value.is_null()) return without_octets("a value, found none");
  const Value* first = &value;
  for (std::size_t& length : layout->shape) {
    const Value::Sequence* members = first->sequence();
    length = members ? members->size() : 0;
    if (length == 0) break;
    first = &members->front();
  }
  const std::size_t* const lengths = layout->shape.data();
  if (Result<void> r = check_lengths(value, lengths, lengths + layout->shape.size()); !r) return Unexpected{std::move(r).error()};
  return *std::move(layout);
}

bool reads_octets(const Type& type) {
  const std::optional<Octets> layout = octets_of(type);
  return layout && std::count(layout->shape.begin(), layout->shape.end(), 0U) <= 1;
}

Result<std::string> write_plain(const Type& type, const Facets& facets, const Value& value, Plain format) {
  switch (format) {
    case Plain::json:
    case Plain::json_with_units: return json_of(type, facets, value, format == Plain::json_with_units);
    case Plain::text: {
      if (value.is_null()) return std::string();
      const Type& inner = without_optional(type);
      if (inner.kind == Kind::list || inner.has_fields() || inner.kind == Kind::map) return json_of(inner, facets, value, false);
      std::string text = lexical_form(inner, value);
      // A reader takes U+FEFF at the beginning for a byte order mark.
      if (utf8::without_mark(text).size() != text.size()) text.insert(0, utf8::byte_order_mark);
      return text;
    }
    case Plain::cbor: {
      CborWriter writer;
      writer.write(type, value);
      return writer.take();
    }
    case Plain::octets: break;
  }
  const Result<Octets> layout = octets_of(type, value);
  if (!layout) return Unexpected{layout.error()};
  std::string out;
  out.reserve(layout->size());
  write_octets(innermost(type), layout->bytes, value, out);
  return out;
}

Result<void> read_plain(std::string_view body, Plain format, const Type& type, const Facets& facets, std::string_view vocabulary,
                        std::size_t max_values, Graph& graph, TermId focus, Mismatch* mismatch) {
  const Type& inner = without_optional(type);
  if (format == Plain::text && type.kind == Kind::optional && body.empty()) return {};
  if (format == Plain::text && inner.kind != Kind::list && !inner.has_fields() && inner.kind != Kind::map)
    return read_text(body, type, facets, vocabulary, graph, focus);
  if (format == Plain::octets) {
    const Result<Value> value = read_octets(body, type, max_values);
    if (!value) return unexpected(value.error());
    write_value(graph, focus, type, facets, *value, vocabulary);
    return {};
  }
  const json::Limits limits{max_values, max_depth};
  const bool is_binary = format == Plain::cbor;
  const Result<json::Document> document = is_binary ? json::Document::parse_cbor(body, limits) : json::Document::parse(body, limits);
  if (!document) return unexpected(document.error());
  try {
    DocumentReader(*document, is_binary, graph, vocabulary, focus).at(focus, type, facets);
    return {};
  } catch (const Refused& refused) {
    const auto& [pointer, message] = refused.mismatch;
    if (mismatch) *mismatch = refused.mismatch;
    return unexpected(Errc::expected_value, pointer.empty() ? message : "at \"" + pointer + "\": " + message);
  }
}

}  // namespace v0
}  // namespace lrt::rdf
