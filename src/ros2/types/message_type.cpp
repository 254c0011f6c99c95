// SPDX-License-Identifier: Apache-2.0
#include <lrt/ros2/message_type.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include <lrt/rdf/value_codec.hpp>

#include "src/base/ascii.hpp"
#include "src/base/base64.hpp"
#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/ros2/types/cdr.hpp"
#include "src/ros2/types/names.hpp"
#include "src/ros2/types/parser.hpp"

namespace lrt::ros2 {
inline namespace v0 {

namespace {

using rdf::DynamicType;
using rdf::Value;

/// How a field is read and written.
struct Node {
  enum class As : std::uint8_t { number, boolean, text, wide_text, record, instant, duration };

  std::string name;              // in the value
  const Field* field = nullptr;  // kept by the plan; null: the root
  As as = As::number;
  Kind kind = Kind::message;
  Arity arity = Arity::single;
  std::uint8_t width = 0;  // of a primitive
  bool left_out = false;
  bool is_base64 = false;
  std::uint32_t size = 0;
  std::uint32_t text_bound = 0;
  std::size_t least_bytes = 1;          // of one value, without padding
  std::vector<Node> fields;             // record
  std::size_t in_value = 0;             // record: fields that are not left out
  std::vector<Enumerator> enumerators;  // in the order of their numbers
  std::string other;                    // what a number without a name reads as
  DynamicType type;                     // of the whole field, if it is not left out
};

constexpr std::size_t anything = std::numeric_limits<std::size_t>::max();

std::uint8_t width_of(Kind kind) noexcept {
  switch (kind) {
    case Kind::int16:
    case Kind::uint16: return 2;
    case Kind::int32:
    case Kind::uint32:
    case Kind::float32: return 4;
    case Kind::int64:
    case Kind::uint64:
    case Kind::float64: return 8;
    default: return 1;
  }
}
bool is_byte(Kind kind) noexcept { return kind == Kind::octet || kind == Kind::character || kind == Kind::uint8; }

/// Whether it has the structure of builtin_interfaces/Time, or of Duration, which is the same.
bool is_time(const Message& message, std::string_view name) noexcept {
  if (message.name != name || message.fields.size() != 2) return false;
  const FieldType &a = message.fields[0].type, &b = message.fields[1].type;
  return a.kind == Kind::int32 && a.arity == Arity::single && b.kind == Kind::uint32 && b.arity == Arity::single;
}

constexpr std::int64_t second = 1'000'000'000;

Value integer_value(Kind kind, std::uint64_t bits) noexcept {
  switch (kind) {
    case Kind::int8: return Value(std::int64_t{static_cast<std::int8_t>(bits)});
    case Kind::int16: return Value(std::int64_t{static_cast<std::int16_t>(bits)});
    case Kind::int32: return Value(std::int64_t{static_cast<std::int32_t>(bits)});
    case Kind::int64: return Value(static_cast<std::int64_t>(bits));
    default:
      if (bits > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return Value(bits);
      return Value(static_cast<std::int64_t>(bits));
  }
}
std::uint64_t load_bits(const char* at, std::size_t width, bool little) noexcept {
  switch (width) {
    case 1: return load<std::uint8_t>(at, little);
    case 2: return load<std::uint16_t>(at, little);
    case 4: return load<std::uint32_t>(at, little);
    default: return load<std::uint64_t>(at, little);
  }
}
double real_value(Kind kind, std::uint64_t bits) noexcept {
  if (kind == Kind::float32) return widened(static_cast<std::uint32_t>(bits));
  double d = 0;
  std::memcpy(&d, &bits, sizeof d);
  return d;
}

/// U+FFFD for what is not UTF-8, and for U+0000, which no text of RDF has.
std::string repaired(std::string_view text) {
  constexpr char32_t replacement = 0xFFFD;
  std::string out;
  while (!text.empty()) {
    const std::size_t good = std::min(utf8::find_invalid(text).value_or(text.size()), text.find('\0'));
    out.append(text.substr(0, good));
    if (good >= text.size()) break;
    utf8::append(out, replacement);
    text.remove_prefix(good + 1);
  }
  return out;
}

/// UTF-16 code units, 4 bytes each, as UTF-8. Surrogates without their pair, U+0000 and what is no code point become U+FFFD.
/// @return  whether there were none of these
bool append_wide(std::string& out, std::string_view bytes, bool little) {
  constexpr char32_t replacement = 0xFFFD;
  bool good = true;
  for (std::size_t at = 0; at < bytes.size(); at += 4) {
    char32_t c = load<std::uint32_t>(bytes.data() + at, little);
    if (c >= 0xD800 && c <= 0xDBFF && at + 8 <= bytes.size()) {
      const std::uint32_t low = load<std::uint32_t>(bytes.data() + at + 4, little);
      if (low >= 0xDC00 && low <= 0xDFFF) c = 0x10000 + ((c - 0xD800) << 10U) + (low - 0xDC00), at += 4;
    }
    if (c == 0 || c > 0x10FFFF || (c >= 0xD800 && c <= 0xDFFF)) c = replacement, good = false;
    utf8::append(out, c);
  }
  return good;
}

std::optional<std::string> bytes_of_base64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  std::string out;
  out.reserve(text.size() / 4 * 3);
  for (std::size_t at = 0; at < text.size(); at += 4) {
    const bool last = at + 4 == text.size();
    const std::size_t padding = last && text[at + 3] == '=' ? text[at + 2] == '=' ? 2 : 1 : 0;
    unsigned group = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const int digit = i >= 4 - padding ? 0 : detail::base64_digit(text[at + i]);
      if (digit < 0) return std::nullopt;
      group = group << 6U | static_cast<unsigned>(digit);
    }
    for (std::size_t i = 0; i < 3 - padding; ++i) out += static_cast<char>(static_cast<unsigned char>(group >> (16 - 8 * i)));
  }
  return out;
}

/// What is wrong, with its place. The place is written from the inside outwards.
struct Fault {
  Errc code = Errc::expected_value;
  std::string place, what;

  bool set(std::string sentence, Errc c = Errc::expected_value) {
    what = std::move(sentence), code = c;
    return false;
  }
  bool within(std::string_view name) {
    if (!name.empty()) place = place.empty() ? std::string(name) : std::string(name) + (place[0] == '[' ? "" : ".") + place;
    return false;
  }
  bool within(std::size_t index) {
    place = "[" + std::to_string(index) + "]" + (place.empty() || place[0] == '[' ? "" : ".") + place;
    return false;
  }
  Unexpected error(const Message& message) const {
    return unexpected(code, message.name + (place.empty() ? "" : ", \"" + place + '"') + ": " + what);
  }
};

bool read_length(const Node& node, Cursor& in, std::uint32_t& length) noexcept {
  if (node.arity == Arity::array) return length = node.size, true;
  return in.read(length);
}

/// Skips a text.
bool skip_text(const Node& node, Cursor& in) noexcept {
  std::uint32_t length = 0;
  return in.read(length) && in.skip(node.as == Node::As::text ? std::size_t{length} : std::size_t{length} * 4);
}

bool skip(const Node& node, Cursor& in) noexcept;
bool skip_one(const Node& node, Cursor& in) noexcept {
  switch (node.as) {
    case Node::As::number:
    case Node::As::boolean: return in.align(node.width) && in.skip(node.width);
    case Node::As::instant:
    case Node::As::duration: return in.align(4) && in.skip(8);
    case Node::As::text:
    case Node::As::wide_text: return skip_text(node, in);
    case Node::As::record: break;
  }
  if (node.fields.empty()) return in.skip(1);
  for (const Node& field : node.fields)
    if (!skip(field, in)) return false;
  return true;
}
bool skip(const Node& node, Cursor& in) noexcept {
  if (node.arity == Arity::single) return skip_one(node, in);
  std::uint32_t length = 0;
  if (!read_length(node, in, length)) return false;
  if (length == 0) return true;
  if (in.left() / node.least_bytes < length) return false;
  switch (node.as) {
    case Node::As::number:
    case Node::As::boolean: return in.align(node.width) && in.skip(std::size_t{length} * node.width);
    case Node::As::instant:
    case Node::As::duration: return in.align(4) && in.skip(std::size_t{length} * 8);
    default: break;
  }
  for (std::uint32_t i = 0; i < length; ++i)
    if (!skip_one(node, in)) return false;
  return true;
}

/// Payload to value.
class Decoder {
 public:
  Decoder(std::string_view payload, bool little, std::size_t values, bool repair) noexcept : in_(payload, little), left_(values), repair_(repair) {}

  bool record(const Node& node, Value& to) {
    Value::Sequence members;
    if (node.fields.empty()) {
      if (!in_.skip(1)) return ended();
    } else {
      members.reserve(node.in_value);
      for (const Node& field : node.fields) {
        if (field.left_out) {
          if (!skip(field, in_)) return ended(), fault.within(field.name);
        } else if (!member(field, members.emplace_back())) {
          return fault.within(field.name);
        }
      }
    }
    to = Value(std::move(members));
    return true;
  }

  /// @pre all is decoded
  bool ends() {
    return in_.left() < 4 || fault.set(std::to_string(in_.left()) + " bytes are left behind the last field: it is another version of the type");
  }

  Fault fault;

 private:
  bool ended() { return fault.set("the payload ends before the value"); }
  bool take(std::size_t values) {
    if (values > left_) return fault.set("the payload has more values than the limit", Errc::limit_exceeded);
    left_ -= values;
    return true;
  }

  bool member(const Node& node, Value& to) {
    if (node.arity == Arity::single) return take(1) && one(node, to);
    std::uint32_t length = 0;
    if (!read_length(node, in_, length)) return ended();
    if (node.arity == Arity::bounded_sequence && length > node.size)
      return fault.set("expected at most " + std::to_string(node.size) + " members, found " + std::to_string(length));
    if (in_.left() / node.least_bytes < length) return fault.set("the payload ends before the " + std::to_string(length) + " members that it states");
    if (node.is_base64) {
      std::string_view bytes;
      if (!in_.take(length, bytes)) return ended();
      to = Value(detail::base64(bytes));
      return take(1);
    }
    if (!take(length)) return false;
    Value::Sequence members;
    members.reserve(length);
    if (node.as == Node::As::number && node.enumerators.empty()) {
      if (length != 0 && !in_.align(node.width)) return ended();
      std::string_view bytes;
      if (!in_.take(std::size_t{length} * node.width, bytes)) return ended();
      const bool is_real = node.kind == Kind::float32 || node.kind == Kind::float64, little = in_.is_little();
      for (std::size_t at = 0; at < bytes.size(); at += node.width) {
        const std::uint64_t bits = load_bits(bytes.data() + at, node.width, little);
        members.push_back(is_real ? Value(real_value(node.kind, bits)) : integer_value(node.kind, bits));
      }
    } else {
      for (std::uint32_t i = 0; i < length; ++i)
        if (!one(node, members.emplace_back())) return fault.within(std::size_t{i});
    }
    to = Value(std::move(members));
    return true;
  }

  bool one(const Node& node, Value& to) {
    switch (node.as) {
      case Node::As::record: return record(node, to);
      case Node::As::number: return number(node, to);
      case Node::As::text: return text(node, to);
      case Node::As::wide_text: return wide_text(node, to);
      case Node::As::boolean: {
        std::uint8_t byte = 0;
        if (!in_.read(byte)) return ended();
        if (byte > 1) return fault.set("expected 0 or 1 for a bool, found " + std::to_string(byte));
        to = Value(byte == 1);
        return true;
      }
      case Node::As::instant:
      case Node::As::duration: {
        std::uint32_t seconds = 0, nanoseconds = 0;
        if (!in_.read(seconds) || !in_.read(nanoseconds)) return ended();
        to = Value(std::int64_t{static_cast<std::int32_t>(seconds)} * second + std::int64_t{nanoseconds});
        return true;
      }
    }
    return false;
  }

  bool number(const Node& node, Value& to) {
    if (!in_.align(node.width) || in_.left() < node.width) return ended();
    const std::uint64_t bits = load_bits(in_.at(), node.width, in_.is_little());
    (void)in_.skip(node.width);
    if (node.kind == Kind::float32 || node.kind == Kind::float64) {
      to = Value(real_value(node.kind, bits));
      return true;
    }
    Value value = integer_value(node.kind, bits);
    if (node.enumerators.empty()) return to = std::move(value), true;
    const std::string* name = &node.other;
    if (value.integer()) {
      const auto known = std::lower_bound(node.enumerators.begin(), node.enumerators.end(), *value.integer(),
                                          [](const Enumerator& e, std::int64_t n) { return e.number < n; });
      if (known != node.enumerators.end() && known->number == *value.integer()) name = &known->name;
    }
    to = Value(*name);
    return true;
  }

  bool text(const Node& node, Value& to) {
    std::uint32_t length = 0;
    std::string_view bytes;
    if (!in_.read(length)) return ended();
    if (!in_.take(length, bytes)) return fault.set("the payload ends before the " + std::to_string(length) + " bytes of a text that it states");
    if (length != 0) {
      if (bytes.back() != '\0') return fault.set("a text does not end with 0");
      bytes.remove_suffix(1);
    }
    if (node.text_bound != 0 && bytes.size() > node.text_bound)
      return fault.set("expected a text of at most " + std::to_string(node.text_bound) + " bytes, found " + std::to_string(bytes.size()));
    if (!utf8::find_invalid(bytes) && bytes.find('\0') == std::string_view::npos) to = Value(std::string(bytes));
    else if (repair_) to = Value(repaired(bytes));
    else return fault.set("expected a text in UTF-8 without U+0000");
    return true;
  }

  bool wide_text(const Node& node, Value& to) {
    std::uint32_t length = 0;
    std::string_view bytes;
    if (!in_.read(length)) return ended();
    if (!in_.take(std::size_t{length} * 4, bytes))
      return fault.set("the payload ends before the " + std::to_string(length) + " characters of a text that it states");
    if (node.text_bound != 0 && length > node.text_bound)
      return fault.set("expected a text of at most " + std::to_string(node.text_bound) + " characters, found " + std::to_string(length));
    std::string out;
    if (!append_wide(out, bytes, in_.is_little()) && !repair_) return fault.set("expected a text in UTF-16 without U+0000");
    to = Value(std::move(out));
    return true;
  }

  Cursor in_;
  std::size_t left_;
  bool repair_;
};

/// Value to payload.
class Encoder {
 public:
  Encoder(bool little, std::size_t max_bytes) : out_(little), max_bytes_(max_bytes) {}

  bool record(const Node& node, const Value& value) {
    const Value::Sequence* const members = value.sequence();
    if (!members || members->size() != node.in_value) return fault.set("expected a record of " + std::to_string(node.in_value) + " fields");
    if (node.fields.empty()) out_.write(std::uint8_t{0});
    std::size_t next = 0;
    for (const Node& field : node.fields)
      if (!(field.left_out ? initial(field) : member(field, (*members)[next++]))) return fault.within(field.name);
    return out_.size() <= max_bytes_ || fault.set("the payload has more bytes than the limit", Errc::limit_exceeded);
  }

  /// The default of a field.
  bool initial(const Node& node) {
    if (node.field && node.field->initial) return plain(node, *node.field->initial);
    std::uint32_t length = 1;
    if (node.arity == Arity::array) length = node.size;
    else if (node.arity != Arity::single) return out_.write(std::uint32_t{0}), true;
    if (node.as == Node::As::number || node.as == Node::As::boolean) {
      out_.align(node.width);
      const std::size_t bytes = std::size_t{length} * node.width;
      if (bytes > max_bytes_ - std::min(out_.size(), max_bytes_)) return fault.set("the payload has more bytes than the limit", Errc::limit_exceeded);
      out_.zeros(bytes);
      return true;
    }
    for (std::uint32_t i = 0; i < length; ++i) {
      switch (node.as) {
        case Node::As::record:
          if (!initial_record(node)) return false;
          break;
        case Node::As::text:
          out_.write(std::uint32_t{1});
          out_.write(std::uint8_t{0});
          break;
        case Node::As::wide_text: out_.write(std::uint32_t{0}); break;
        case Node::As::instant:
        case Node::As::duration:
          out_.write(std::uint32_t{0});
          out_.write(std::uint32_t{0});
          break;
        case Node::As::number:
        case Node::As::boolean: break;
      }
      if (out_.size() > max_bytes_) return fault.set("the payload has more bytes than the limit", Errc::limit_exceeded);
    }
    return true;
  }
  bool initial_record(const Node& node) {
    if (node.fields.empty()) out_.write(std::uint8_t{0});
    for (const Node& field : node.fields)
      if (!initial(field)) return false;
    return true;
  }

  std::string take() { return out_.take(); }

  Fault fault;

 private:
  void write_bits(std::size_t width, std::uint64_t bits) {
    switch (width) {
      case 1: return out_.write(static_cast<std::uint8_t>(bits));
      case 2: return out_.write(static_cast<std::uint16_t>(bits));
      case 4: return out_.write(static_cast<std::uint32_t>(bits));
      default: return out_.write(bits);
    }
  }

  /// A default as the definition states it: numbers, not names or base64.
  bool plain(const Node& node, const Value& value) {
    if (node.arity == Arity::single) return plain_one(node, value);
    const Value::Sequence& members = *value.sequence();
    if (node.arity != Arity::array) out_.write(static_cast<std::uint32_t>(members.size()));
    return std::all_of(members.begin(), members.end(), [&](const Value& m) { return plain_one(node, m); });
  }
  bool plain_one(const Node& node, const Value& value) {
    if (node.as == Node::As::number && (value.integer() || value.large_integer())) return integer(node, value);
    return one(node, value);
  }

  bool member(const Node& node, const Value& value) {
    if (node.arity == Arity::single) return one(node, value);
    if (node.is_base64) {
      if (!value.text()) return fault.set("expected bytes in base64");
      const std::optional<std::string> bytes = bytes_of_base64(*value.text());
      if (!bytes) return fault.set("expected bytes in base64");
      if (!length(node, bytes->size())) return false;
      out_.bytes(*bytes);
      return true;
    }
    const Value::Sequence* const members = value.sequence();
    if (!members) return fault.set("expected a list");
    if (!length(node, members->size())) return false;
    for (std::size_t i = 0; i < members->size(); ++i)
      if (!one(node, (*members)[i])) return fault.within(i);
    return true;
  }
  bool length(const Node& node, std::size_t members) {
    const bool fits = node.arity == Arity::array              ? members == node.size
                      : node.arity == Arity::bounded_sequence ? members <= node.size
                                                              : members <= std::numeric_limits<std::uint32_t>::max();
    if (!fits)
      return fault.set("expected " + std::string(node.arity == Arity::array ? "" : "at most ") + std::to_string(node.size) + " members, found " +
                       std::to_string(members));
    if (node.arity != Arity::array) out_.write(static_cast<std::uint32_t>(members));
    return true;
  }

  bool one(const Node& node, const Value& value) {
    switch (node.as) {
      case Node::As::record: return record(node, value);
      case Node::As::boolean:
        if (!value.boolean()) return fault.set("expected a boolean");
        out_.write(static_cast<std::uint8_t>(*value.boolean() ? 1 : 0));
        return true;
      case Node::As::text: return text(node, value);
      case Node::As::wide_text: return wide_text(node, value);
      case Node::As::instant:
      case Node::As::duration: return time(value);
      case Node::As::number: break;
    }
    if (node.kind == Kind::float32 || node.kind == Kind::float64) return real(node, value);
    if (node.enumerators.empty()) return integer(node, value);
    if (!value.text()) return fault.set("expected one of the names");
    const auto known = std::find_if(node.enumerators.begin(), node.enumerators.end(), [&](const Enumerator& e) { return e.name == *value.text(); });
    if (known == node.enumerators.end()) return fault.set("expected one of the names, found " + lrt::quoted(*value.text()));
    write_bits(node.width, static_cast<std::uint64_t>(known->number));
    return true;
  }

  bool integer(const Node& node, const Value& value) {
    const IntegerRange range = *range_of(node.kind);
    if (const std::int64_t* const n = value.integer()) {
      if (*n < 0 ? *n < range.lowest : static_cast<std::uint64_t>(*n) > range.highest)
        return fault.set(
            "expected an integer from " + std::to_string(range.lowest) + " to " + std::to_string(range.highest) + ", found " + std::to_string(*n),
            Errc::out_of_range);
      write_bits(node.width, static_cast<std::uint64_t>(*n));
      return true;
    }
    const std::uint64_t* const n = value.large_integer();
    if (!n) return fault.set("expected an integer");
    if (*n > range.highest) return fault.set("expected an integer of at most " + std::to_string(range.highest), Errc::out_of_range);
    write_bits(node.width, *n);
    return true;
  }

  bool real(const Node& node, const Value& value) {
    if (!value.real()) return fault.set("expected a floating-point number");
    const double d = *value.real();
    if (node.kind == Kind::float32) {
      if (std::isfinite(d) && std::abs(d) > static_cast<double>(std::numeric_limits<float>::max()))
        return fault.set("expected a number that 32 bits can hold", Errc::out_of_range);
      out_.write(narrowed(d));
      return true;
    }
    std::uint64_t bits = 0;
    std::memcpy(&bits, &d, sizeof bits);
    out_.write(bits);
    return true;
  }

  bool text(const Node& node, const Value& value) {
    if (!value.text()) return fault.set("expected a text");
    const std::string& s = *value.text();
    if (node.text_bound != 0 && s.size() > node.text_bound)
      return fault.set("expected a text of at most " + std::to_string(node.text_bound) + " bytes, found " + std::to_string(s.size()),
                       Errc::out_of_range);
    if (s.find('\0') != std::string::npos) return fault.set("expected a text without U+0000");
    if (s.size() >= max_bytes_) return fault.set("the payload has more bytes than the limit", Errc::limit_exceeded);
    out_.write(static_cast<std::uint32_t>(s.size() + 1));
    out_.bytes(s);
    out_.write(std::uint8_t{0});
    return true;
  }

  bool wide_text(const Node& node, const Value& value) {
    if (!value.text()) return fault.set("expected a text");
    const std::string& s = *value.text();
    if (utf8::find_invalid(s) || s.find('\0') != std::string::npos) return fault.set("expected a text in UTF-8 without U+0000");
    if (s.size() >= max_bytes_) return fault.set("the payload has more bytes than the limit", Errc::limit_exceeded);
    std::uint32_t units = 0;
    for (std::size_t at = 0; at < s.size();) units += utf8::decode(s, at) > 0xFFFF ? 2 : 1;
    if (node.text_bound != 0 && units > node.text_bound)
      return fault.set("expected a text of at most " + std::to_string(node.text_bound) + " UTF-16 code units, found " + std::to_string(units),
                       Errc::out_of_range);
    out_.write(units);
    for (std::size_t at = 0; at < s.size();) {
      const char32_t c = utf8::decode(s, at);
      if (c > 0xFFFF) {
        out_.write(static_cast<std::uint32_t>(0xD800 + ((c - 0x10000) >> 10U)));
        out_.write(static_cast<std::uint32_t>(0xDC00 + ((c - 0x10000) & 0x3FFU)));
      } else {
        out_.write(static_cast<std::uint32_t>(c));
      }
    }
    return true;
  }

  bool time(const Value& value) {
    if (!value.integer()) return fault.set("expected a time in nanoseconds");
    const std::int64_t t = *value.integer();
    const std::int64_t rest = t % second, nanoseconds = rest < 0 ? rest + second : rest, seconds = t / second - (rest < 0 ? 1 : 0);
    if (seconds < std::numeric_limits<std::int32_t>::min() || seconds > std::numeric_limits<std::int32_t>::max())
      return fault.set("expected a time that 32 bits of seconds can hold", Errc::out_of_range);
    out_.write(static_cast<std::uint32_t>(seconds));
    out_.write(static_cast<std::uint32_t>(nanoseconds));
    return true;
  }

  Writer out_;
  std::size_t max_bytes_;
};

}  // namespace

struct LRT_LOCAL MessageType::Plan {
  MessagePtr message;
  Node root;
  CodecLimits limits;
  bool repair = true;
};

namespace {

/// Makes a plan.
class Planner {
 public:
  Planner(const MessageOptions& options, const CodecLimits& limits) : options_(options), limits_(limits) {}

  /// @param path  of the field with the message; empty: the root
  Result<void> record(const Message& message, std::string_view path, std::size_t depth, Node& node) {
    if (depth > 64) return unexpected(Errc::limit_exceeded, message.name + ": messages are nested too deep");
    node.as = Node::As::record;
    node.least_bytes = 0;
    std::vector<rdf::DynamicField> fields;
    node.fields.reserve(message.fields.size());
    for (const Field& field : message.fields) {
      const std::string place = path.empty() ? field.name : std::string(path) + "." + field.name;
      FieldOptions says;
      if (options_.field) options_.field(message, field, place, says);
      Node& child = node.fields.emplace_back();
      child.field = &field;
      child.name = says.name.empty() ? field.name : says.name;
      child.left_out = says.left_out;
      Result<void> r = member(message, field, place, depth, std::move(says.enumerators), child);
      if (!r) return r;
      add(node.least_bytes, child.arity == Arity::single  ? child.least_bytes
                            : child.arity == Arity::array ? product(child.least_bytes, child.size)
                                                          : 4);
      if (child.left_out) continue;
      ++node.in_value;
      bound(says.facets, child);
      rdf::DynamicField& made = fields.emplace_back(rdf::DynamicField{rdf::FieldName{child.name}, child.type, says.facets, says.read_only});
      if (!says.term.empty()) made.name.predicate = says.term;
      if (!field.initial || says.read_only) continue;
      Value absent = absent_value(child, *field.initial);
      if (rdf::within(*child.type, says.facets, absent)) made.absent = std::make_shared<const Value>(std::move(absent));
    }
    if (message.fields.empty()) node.least_bytes = 1;
    if (node.least_bytes > limits_.max_bytes) return unexpected(Errc::limit_exceeded, message.name + ": each payload has more bytes than the limit");
    std::string name = options_.name ? options_.name(message, path) : std::string();
    if (name.empty()) name = record_name_of(message.name);
    Result<DynamicType> type = DynamicType::record(name, std::move(fields), options_.classes ? options_.classes(message, path) : std::vector<Iri>());
    if (!type)
      return unexpected(type.error().code, message.name + (path.empty() ? "" : ", \"" + std::string(path) + '"') + ": " + type.error().message);
    node.type = *type;
    return {};
  }

 private:
  static void add(std::size_t& to, std::size_t n) noexcept { to = n > anything - to ? anything : to + n; }
  static std::size_t product(std::size_t a, std::size_t b) noexcept { return b != 0 && a > anything / b ? anything : a * b; }

  Result<void> member(const Message& in, const Field& field, const std::string& place, std::size_t depth, std::vector<Enumerator> enumerators,
                      Node& node) {
    const FieldType& type = field.type;
    node.kind = type.kind;
    node.arity = type.arity;
    node.size = type.size;
    node.text_bound = type.text_bound;
    Result<DynamicType> made = one(in, field, place, depth, std::move(enumerators), node);
    if (!made) return Unexpected{std::move(made).error()};
    if (node.left_out) return {};
    if (node.arity != Arity::single) {
      node.is_base64 = node.as == Node::As::number && is_byte(node.kind) && node.enumerators.empty();
      if (node.is_base64) made = DynamicType::base64();
      else made = DynamicType::list(*made, node.arity == Arity::array ? node.size : 0, node.arity == Arity::sequence ? anything : node.size);
      if (!made) return unexpected(made.error().code, in.name + ", \"" + place + "\": " + made.error().message);
    }
    node.type = *made;
    return {};
  }

  Result<DynamicType> one(const Message& in, const Field& field, const std::string& place, std::size_t depth, std::vector<Enumerator> enumerators,
                          Node& node) {
    const Kind kind = field.type.kind;
    node.width = width_of(kind);
    node.least_bytes = node.width;
    if (!enumerators.empty() && (!range_of(kind) || node.left_out)) {
      if (!node.left_out) return unexpected(Errc::invalid_option, in.name + ", \"" + place + "\": only integers have enumerators");
      enumerators.clear();
    }
    switch (kind) {
      case Kind::boolean: node.as = Node::As::boolean; return DynamicType::of<bool>();
      case Kind::float32: return DynamicType::of<float>();
      case Kind::float64: return DynamicType::of<double>();
      case Kind::string: node.as = Node::As::text, node.least_bytes = 4; return DynamicType::of<std::string>();
      case Kind::wstring: node.as = Node::As::wide_text, node.least_bytes = 4; return DynamicType::of<std::string>();
      case Kind::message: return message(in, *field.type.message, place, depth, node);
      default: break;
    }
    if (!enumerators.empty()) return enumeration(in, place, std::move(enumerators), node);
    switch (kind) {
      case Kind::int8: return DynamicType::of<std::int8_t>();
      case Kind::int16: return DynamicType::of<std::int16_t>();
      case Kind::uint16: return DynamicType::of<std::uint16_t>();
      case Kind::int32: return DynamicType::of<std::int32_t>();
      case Kind::uint32: return DynamicType::of<std::uint32_t>();
      case Kind::int64: return DynamicType::of<std::int64_t>();
      case Kind::uint64: return DynamicType::of<std::uint64_t>();
      default: return DynamicType::of<std::uint8_t>();
    }
  }

  Result<DynamicType> message(const Message&, const Message& message, const std::string& place, std::size_t depth, Node& node) {
    if (options_.times && is_time(message, "builtin_interfaces/msg/Time")) {
      node.as = Node::As::instant, node.least_bytes = 8;
      return DynamicType::of<std::chrono::system_clock::time_point>();
    }
    if (options_.times && is_time(message, "builtin_interfaces/msg/Duration")) {
      node.as = Node::As::duration, node.least_bytes = 8;
      return DynamicType::of<std::chrono::nanoseconds>();
    }
    if (Result<void> r = record(message, place, depth + 1, node); !r) return Unexpected{std::move(r).error()};
    return node.type;
  }

  Result<DynamicType> enumeration(const Message& in, const std::string& place, std::vector<Enumerator> enumerators, Node& node) {
    const IntegerRange range = *range_of(node.kind);
    std::vector<std::string> names;
    node.other = "other";
    for (const Enumerator& e : enumerators) {
      if (e.number < 0 ? e.number < range.lowest : static_cast<std::uint64_t>(e.number) > range.highest)
        return unexpected(Errc::invalid_option, in.name + ", \"" + place + "\": the field cannot have the number of " + lrt::quoted(e.name));
      if (e.name == node.other) node.other = "other_number";
      names.push_back(e.name);
    }
    names.push_back(node.other);
    std::stable_sort(enumerators.begin(), enumerators.end(), [](const Enumerator& a, const Enumerator& b) { return a.number < b.number; });
    const auto twice =
        std::adjacent_find(enumerators.begin(), enumerators.end(), [](const Enumerator& a, const Enumerator& b) { return a.number == b.number; });
    if (twice != enumerators.end())
      return unexpected(Errc::invalid_option, in.name + ", \"" + place + "\": two enumerators have the number " + std::to_string(twice->number));
    Result<DynamicType> type = DynamicType::enumeration(std::move(names));
    if (!type) return unexpected(type.error().code, in.name + ", \"" + place + "\": " + type.error().message);
    node.enumerators = std::move(enumerators);
    return type;
  }

  /// States the bounds of bytes and texts, which the definition has. A text of so many bytes has no more code points.
  static void bound(rdf::Facets& facets, const Node& node) {
    if (node.is_base64 && node.arity != Arity::sequence) facets.length(node.arity == Arity::array ? node.size : 0, node.size);
    if (node.text_bound != 0) facets.length(facets.min_length(), std::min<std::size_t>(facets.max_length(), node.text_bound));
  }

  /// A default of a definition as the value has it.
  static Value absent_value(const Node& node, const Value& initial) {
    if (node.is_base64) {
      std::string bytes;
      for (const Value& member : *initial.sequence()) bytes += static_cast<char>(static_cast<unsigned char>(*member.integer()));
      return Value(detail::base64(bytes));
    }
    if (node.enumerators.empty()) return initial;
    const auto name = [&](const Value& number) {
      for (const Enumerator& e : node.enumerators)
        if (number.integer() && e.number == *number.integer()) return Value(e.name);
      return Value(node.other);
    };
    if (!initial.sequence()) return name(initial);
    Value::Sequence names;
    for (const Value& member : *initial.sequence()) names.push_back(name(member));
    return Value(std::move(names));
  }

  const MessageOptions& options_;
  const CodecLimits& limits_;
};

/// A kind of integer, without regard to how it is spelled.
Kind plain_kind(Kind kind) noexcept { return is_byte(kind) ? Kind::uint8 : kind; }

std::string upper(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}
bool begins_with(std::string_view s, std::string_view beginning) noexcept { return s.substr(0, beginning.size()) == beginning; }

/// The longest name of a field that a constant's name begins with.
const Field* field_of(const Message& in, const Constant& constant) {
  const Field* found = nullptr;
  for (const Field& field : in.fields)
    if (plain_kind(field.type.kind) == plain_kind(constant.kind) && begins_with(constant.name, upper(field.name) + "_") &&
        (!found || field.name.size() > found->name.size()))
      found = &field;
  return found;
}

/// Whether numbers may be meant to be combined: each is one bit, and more than a choice of two.
bool may_be_bits(const std::vector<Enumerator>& enumerators) noexcept {
  std::size_t bits = 0;
  bool has_zero = false;
  for (const Enumerator& e : enumerators) {
    if (e.number == 0) has_zero = true;
    else if (e.number > 0 && (e.number & (e.number - 1)) == 0) ++bits;
    else return false;
  }
  return has_zero ? bits > 2 : bits > 1;
}

}  // namespace

std::vector<Enumerator> MessageOptions::of_constants(const Message& in, const Field& field) {
  if (!range_of(field.type.kind)) return {};
  std::vector<Enumerator> made;
  const std::string prefix = upper(field.name) + "_";
  bool any_prefix = false;
  for (const Constant& constant : in.constants) {
    const Field* const its = field_of(in, constant);
    any_prefix = any_prefix || its;
    if (its != &field || !constant.value.integer()) continue;
    std::string name = constant.name.substr(prefix.size());
    if (name.empty() || detail::is_digit(name[0])) name = constant.name;
    made.push_back({std::move(name), *constant.value.integer()});
  }
  if (!any_prefix) {
    const auto alike = [&](const Field& f) { return plain_kind(f.type.kind) == plain_kind(field.type.kind); };
    if (std::count_if(in.fields.begin(), in.fields.end(), alike) != 1) return {};
    for (const Constant& constant : in.constants) {
      if (!range_of(constant.kind)) continue;
      if (plain_kind(constant.kind) != plain_kind(field.type.kind) || !constant.value.integer()) return {};
      made.push_back({constant.name, *constant.value.integer()});
    }
  }
  std::set<std::int64_t> numbers;
  std::set<std::string_view> names;
  for (const Enumerator& e : made)
    if (!numbers.insert(e.number).second || !names.insert(e.name).second) return {};
  if (made.size() < 2 || may_be_bits(made)) return {};
  return made;
}

MessageType::MessageType(std::shared_ptr<const Plan> plan) noexcept : plan_(std::move(plan)) {}

Result<MessageType> MessageType::of(MessagePtr message, const MessageOptions& options, const CodecLimits& limits) {
  if (!message) return unexpected(Errc::invalid_option, "a MessageType needs a message");
  auto plan = std::make_shared<Plan>();
  plan->limits = limits;
  plan->repair = options.replace_invalid_text;
  plan->message = std::move(message);
  if (Result<void> r = Planner(options, plan->limits).record(*plan->message, {}, 0, plan->root); !r) return Unexpected{std::move(r).error()};
  Encoder initial(true, limits.max_bytes);
  if (!initial.initial_record(plan->root)) return initial.fault.error(*plan->message);
  return MessageType(std::move(plan));
}

const Message& MessageType::message() const noexcept { return *plan_->message; }
DynamicType MessageType::type() const noexcept { return plan_->root.type; }

Result<Value> MessageType::decode(std::string_view payload) const {
  const Encapsulation encapsulation = encapsulation_of(payload);
  if (encapsulation == Encapsulation::other)
    return unexpected(Errc::expected_value,
                      plan_->message->name + ": expected the encapsulation of CDR, 0 0 or 0 1, at the beginning of the payload");
  if (payload.size() > plan_->limits.max_bytes)
    return unexpected(Errc::limit_exceeded,
                      plan_->message->name + ": the payload has " + std::to_string(payload.size()) + " bytes, more than the limit");
  Decoder decoder(payload, encapsulation == Encapsulation::little_endian, plan_->limits.max_values, plan_->repair);
  Value value;
  if (!decoder.record(plan_->root, value) || !decoder.ends()) return decoder.fault.error(*plan_->message);
  return value;
}

Result<std::string> MessageType::encode(const Value& value) const { return encode(value, true); }

Result<std::string> MessageType::encode(const Value& value, bool little) const {
  Encoder encoder(little, plan_->limits.max_bytes);
  if (!encoder.record(plan_->root, value)) return encoder.fault.error(*plan_->message);
  return encoder.take();
}

std::string MessageType::initial() const {
  Encoder encoder(true, plan_->limits.max_bytes);
  (void)encoder.initial_record(plan_->root);  // of() has checked it
  return encoder.take();
}

Result<MessageType::Place> MessageType::place(std::string_view path) const {
  Place made;
  const Message* message = plan_->message.get();
  for (std::size_t at = 0;;) {
    const std::size_t end = std::min(path.find('.', at), path.size());
    const std::string_view name = path.substr(at, end - at);
    const auto field = std::find_if(message->fields.begin(), message->fields.end(), [&](const Field& f) { return f.name == name; });
    if (field == message->fields.end()) return unexpected(Errc::unknown_path, message->name + " has no field " + lrt::quoted(name));
    made.steps.push_back(static_cast<std::uint32_t>(field - message->fields.begin()));
    if (end == path.size()) return made;
    if (field->type.kind != Kind::message || field->type.arity != Arity::single)
      return unexpected(Errc::unknown_path, message->name + ": " + lrt::quoted(name) + " is not one message");
    message = field->type.message.get();
    at = end + 1;
  }
}

namespace {

/// Moves to the field at a place.
/// @return  nullptr: the payload is malformed before, or there is no such place
const Node* go_to(const Node& root, const MessageType::Place& place, Cursor& in) noexcept {
  const Node* node = &root;
  for (const std::uint32_t step : place.steps) {
    if (node->as != Node::As::record || node->arity != Arity::single || step >= node->fields.size()) return nullptr;
    for (std::uint32_t i = 0; i < step; ++i)
      if (!skip(node->fields[i], in)) return nullptr;
    node = &node->fields[step];
  }
  return node;
}

}  // namespace

std::optional<Found> MessageType::find(std::string_view payload, const Place& place) const noexcept {
  const Encapsulation encapsulation = encapsulation_of(payload);
  if (encapsulation == Encapsulation::other || payload.size() > plan_->limits.max_bytes) return std::nullopt;
  Cursor in(payload, encapsulation == Encapsulation::little_endian);
  const Node* const node = go_to(plan_->root, place, in);
  if (!node) return std::nullopt;
  Found found;
  found.little_endian = in.is_little();
  std::uint32_t length = 1;
  switch (node->as) {
    case Node::As::number:
    case Node::As::boolean:
      if (node->arity != Arity::single && !read_length(*node, in, length)) return std::nullopt;
      if (length > in.left() / node->width || (length != 0 && !in.align(node->width))) return std::nullopt;
      if (node->arity == Arity::bounded_sequence && length > node->size) return std::nullopt;
      found.count = length;
      return in.take(std::size_t{length} * node->width, found.bytes) ? std::optional(found) : std::nullopt;
    case Node::As::text:
    case Node::As::wide_text: {
      const bool wide = node->as == Node::As::wide_text;
      if (node->arity != Arity::single || !in.read(length) || !in.take(std::size_t{length} * (wide ? 4 : 1), found.bytes)) return std::nullopt;
      if (!wide && length != 0) {
        if (found.bytes.back() != '\0') return std::nullopt;
        found.bytes.remove_suffix(1);
      }
      found.count = 1;
      return found;
    }
    case Node::As::instant:
    case Node::As::duration:
      if (node->arity != Arity::single || !in.align(4) || !in.take(8, found.bytes)) return std::nullopt;
      found.count = 1;
      return found;
    case Node::As::record: break;
  }
  return std::nullopt;
}

namespace {

/// The field at a place; nullptr: there is none.
const Field* field_at(const Message& message, const MessageType::Place& place) noexcept {
  const Message* in = &message;
  const Field* field = nullptr;
  for (const std::uint32_t step : place.steps) {
    if (!in || step >= in->fields.size()) return nullptr;
    field = &in->fields[step];
    in = field->type.message.get();
  }
  return field;
}

}  // namespace

std::optional<double> MessageType::number(std::string_view payload, const Place& place) const noexcept {
  const Field* const field = field_at(*plan_->message, place);
  if (!field || field->type.arity != Arity::single) return std::nullopt;
  if (field->type.kind != Kind::float32 && field->type.kind != Kind::float64) {
    const std::optional<std::int64_t> n = integer(payload, place);
    return n ? std::optional(static_cast<double>(*n)) : std::nullopt;
  }
  const std::optional<Found> found = find(payload, place);
  if (!found) return std::nullopt;
  return real_value(field->type.kind, load_bits(found->bytes.data(), found->bytes.size(), found->little_endian));
}

std::optional<std::int64_t> MessageType::integer(std::string_view payload, const Place& place) const noexcept {
  const Field* const field = field_at(*plan_->message, place);
  if (!field || field->type.arity != Arity::single || (field->type.kind != Kind::boolean && !range_of(field->type.kind))) return std::nullopt;
  const std::optional<Found> found = find(payload, place);
  if (!found) return std::nullopt;
  const Value value = integer_value(field->type.kind, load_bits(found->bytes.data(), found->bytes.size(), found->little_endian));
  return value.integer() ? std::optional(*value.integer()) : std::nullopt;
}

std::optional<std::string_view> MessageType::text(std::string_view payload, const Place& place) const noexcept {
  const Field* const field = field_at(*plan_->message, place);
  if (!field || field->type.kind != Kind::string) return std::nullopt;
  const std::optional<Found> found = find(payload, place);
  return found ? std::optional(found->bytes) : std::nullopt;
}

std::optional<std::chrono::system_clock::time_point> MessageType::time(std::string_view payload, const Place& place) const noexcept {
  const Field* const field = field_at(*plan_->message, place);
  if (!field || field->type.arity != Arity::single || !field->type.message || !is_time(*field->type.message, "builtin_interfaces/msg/Time"))
    return std::nullopt;
  const Encapsulation encapsulation = encapsulation_of(payload);
  if (encapsulation == Encapsulation::other || payload.size() > plan_->limits.max_bytes) return std::nullopt;
  Cursor in(payload, encapsulation == Encapsulation::little_endian);
  std::uint32_t seconds = 0, nanoseconds = 0;
  if (!go_to(plan_->root, place, in) || !in.read(seconds) || !in.read(nanoseconds)) return std::nullopt;
  const std::chrono::nanoseconds since(std::int64_t{static_cast<std::int32_t>(seconds)} * second + std::int64_t{nanoseconds});
  return std::chrono::system_clock::time_point(std::chrono::duration_cast<std::chrono::system_clock::duration>(since));
}

}  // namespace v0
}  // namespace lrt::ros2
