// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/types/parser.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {

namespace {

struct KindName {
  std::string_view name;
  Kind kind;
};
constexpr std::array<KindName, 15> kind_names{{{"bool", Kind::boolean},
                                               {"byte", Kind::octet},
                                               {"char", Kind::character},
                                               {"int8", Kind::int8},
                                               {"uint8", Kind::uint8},
                                               {"int16", Kind::int16},
                                               {"uint16", Kind::uint16},
                                               {"int32", Kind::int32},
                                               {"uint32", Kind::uint32},
                                               {"int64", Kind::int64},
                                               {"uint64", Kind::uint64},
                                               {"float32", Kind::float32},
                                               {"float64", Kind::float64},
                                               {"string", Kind::string},
                                               {"wstring", Kind::wstring}}};

bool is_blank(char c) noexcept { return c == ' ' || c == '\t'; }
bool is_name(std::string_view s) noexcept {
  if (s.empty() || s.size() > 255) return false;
  for (char c : s)
    if (!detail::is_digit(c) && !detail::is_alpha(c) && c != '_') return false;
  return !detail::is_digit(s[0]);
}
std::string_view trimmed_left(std::string_view s) noexcept {
  while (!s.empty() && is_blank(s.front())) s.remove_prefix(1);
  return s;
}
std::string_view trimmed_right(std::string_view s) noexcept {
  while (!s.empty() && is_blank(s.back())) s.remove_suffix(1);
  return s;
}
std::string_view trimmed(std::string_view s) noexcept { return trimmed_left(trimmed_right(s)); }
std::string lower(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

Unexpected wrong(std::string message) { return unexpected(Errc::expected_value, std::move(message)); }

/// A decimal number without sign and blanks, at most 2^32 - 1.
std::optional<std::uint32_t> count_of(std::string_view s) noexcept {
  std::uint32_t n = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), n);
  if (s.empty() || error != std::errc() || end != s.data() + s.size()) return std::nullopt;
  return n;
}

Result<rdf::Value> integer_of(IntegerRange range, std::string_view text) {
  std::string_view digits = text;
  const bool negative = !digits.empty() && digits[0] == '-';
  if (!digits.empty() && (digits[0] == '-' || digits[0] == '+')) digits.remove_prefix(1);
  int base = 10;
  if (digits.size() > 2 && digits[0] == '0') {
    const char c = digits[1];
    base = c == 'x' || c == 'X' ? 16 : c == 'o' || c == 'O' ? 8 : c == 'b' || c == 'B' ? 2 : 10;
    if (base != 10) digits.remove_prefix(2);
  }
  std::uint64_t n = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), n, base);
  if (digits.empty() || error == std::errc::invalid_argument || end != digits.data() + digits.size())
    return wrong("expected an integer, found " + lrt::quoted(text));
  const std::uint64_t lowest = range.lowest < 0 ? std::uint64_t{0} - static_cast<std::uint64_t>(range.lowest) : 0;
  if (error != std::errc() || (negative ? n > lowest : n > range.highest))
    return wrong("expected an integer from " + std::to_string(range.lowest) + " to " + std::to_string(range.highest) + ", found " +
                 lrt::quoted(text));
  if (negative) return rdf::Value(static_cast<std::int64_t>(std::uint64_t{0} - n));
  if (n > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return rdf::Value(n);
  return rdf::Value(static_cast<std::int64_t>(n));
}

Result<rdf::Value> real_of(bool single, std::string_view text) {
  std::string_view digits = text;
  if (!digits.empty() && digits[0] == '+') digits.remove_prefix(1);
  double x = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
  if (digits.empty() || error == std::errc::invalid_argument || end != digits.data() + digits.size())
    return wrong("expected a number, found " + lrt::quoted(text));
  if (error != std::errc()) {  // from_chars leaves the number as it was
    const bool tiny = digits.find("e-") != std::string_view::npos || digits.find("E-") != std::string_view::npos;
    if (!tiny) return wrong("expected a number of 64 bits, found " + lrt::quoted(text));
    x = digits[0] == '-' ? -0.0 : 0.0;
  }
  if (single && std::isfinite(x)) {
    if (std::abs(x) > static_cast<double>(std::numeric_limits<float>::max()))
      return wrong("expected a number of 32 bits, found " + lrt::quoted(text));
    x = static_cast<double>(static_cast<float>(x));
  }
  return rdf::Value(x);
}

/// Takes one text from the front: in quotation marks, in which \" and \' are these, or, of a whole value, as it is.
Result<std::string> text_of(std::string_view text) {
  for (const char quote : {'"', '\''}) {
    if (text.size() < 2 || text.front() != quote || text.back() != quote) continue;
    std::string out;
    const std::string_view inner = text.substr(1, text.size() - 2);
    for (std::size_t i = 0; i < inner.size(); ++i) {
      if (inner[i] == '\\' && i + 1 < inner.size() && inner[i + 1] == quote) out += inner[++i];
      else if (inner[i] == quote) return wrong("expected \\" + std::string(1, quote) + " for a quotation mark in a text");
      else out += inner[i];
    }
    return out;
  }
  return std::string(text);
}

std::uint64_t utf16_units(std::string_view text) noexcept {
  std::uint64_t n = 0;
  for (std::size_t at = 0; at < text.size();) n += utf8::decode(text, at) > 0xFFFF ? 2 : 1;
  return n;
}

Result<rdf::Value> single_of(const FieldType& type, std::string_view text) {
  if (const auto range = range_of(type.kind)) return integer_of(*range, text);
  switch (type.kind) {
    case Kind::boolean: {
      const std::string word = lower(text);
      if (word == "true" || word == "1") return rdf::Value(true);
      if (word == "false" || word == "0") return rdf::Value(false);
      return wrong("expected true or false, found " + lrt::quoted(text));
    }
    case Kind::float32:
    case Kind::float64: return real_of(type.kind == Kind::float32, text);
    case Kind::string:
    case Kind::wstring: {
      Result<std::string> made = text_of(text);
      if (!made) return Unexpected{std::move(made).error()};
      const std::uint64_t length = type.kind == Kind::string ? made->size() : utf16_units(*made);
      if (type.text_bound != 0 && length > type.text_bound)
        return wrong("expected a text of at most " + std::to_string(type.text_bound) + ", found " + std::to_string(length));
      return rdf::Value(std::move(*made));
    }
    default: return wrong("a message has no value in a definition");
  }
}

/// Splits what is between '[' and ']' at commas that are in no quotation marks.
Result<std::vector<std::string_view>> members_of(std::string_view text, std::size_t most) {
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return wrong("expected a list in [ and ], found " + lrt::quoted(text));
  text = text.substr(1, text.size() - 2);
  std::vector<std::string_view> members;
  if (trimmed(text).empty()) return members;
  std::size_t begin = 0;
  char quote = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    const char c = i < text.size() ? text[i] : ',';
    if (quote != 0 && i < text.size()) {
      if (c == '\\') ++i;
      else if (c == quote) quote = 0;
    } else if ((c == '"' || c == '\'') && trimmed(text.substr(begin, i - begin)).empty()) {
      quote = c;
    } else if (c == ',') {
      if (quote != 0) return wrong("expected a quotation mark at the end of a text in a list");
      const std::string_view member = trimmed(text.substr(begin, i - begin));
      if (member.empty() && i == text.size()) break;  // a comma at the end
      if (member.empty()) return wrong("expected a value between two commas");
      if (members.size() == most) return unexpected(Errc::limit_exceeded, "a list has more than " + std::to_string(most) + " members");
      members.push_back(member);
      begin = i + 1;
    }
  }
  return members;
}

/// Lines of one section: a message.
class Section {
 public:
  Section(std::string_view package, std::string name, const DefinitionLimits& limits) : package_(package), limits_(limits) {
    message_.name = std::move(name);
  }

  Result<void> add(std::string_view line) {
    const std::string_view right = trimmed_right(line);
    if (right.empty()) {
      if (is_first_) message_.comment = std::exchange(pending_, {}), is_first_ = false;
      pending_.clear();
      last_ = nullptr;
      return {};
    }
    const std::size_t hash = comment_begin(right);
    const std::string_view code = trimmed(right.substr(0, hash));
    std::string comment;
    if (hash < right.size()) {
      std::string_view words = right.substr(hash);
      while (!words.empty() && words.front() == '#') words.remove_prefix(1);
      comment = std::string(trimmed(words));
    }
    if (code.empty()) {
      if (hash > 0 && last_) append(*last_, comment);  // an indented comment goes on with what stands above
      else append(pending_, comment);
      return {};
    }
    is_first_ = false;
    if (message_.fields.size() + message_.constants.size() >= limits_.max_fields)
      return unexpected(Errc::limit_exceeded, "a message has more than " + std::to_string(limits_.max_fields) + " fields and constants");
    std::string words = std::exchange(pending_, {});
    append(words, comment);
    return element(code, std::move(words));
  }

  ParsedMessage take() {
    if (is_first_) message_.comment = std::move(pending_);
    return std::move(message_);
  }

 private:
  static void append(std::string& to, const std::string& line) {
    if (line.empty()) return;
    if (!to.empty()) to += '\n';
    to += line;
  }

  /// The place of the '#' of a comment; the size of the line if there is none. In a value that begins with a quotation mark, it is behind
  /// the end of that.
  static std::size_t comment_begin(std::string_view line) noexcept {
    const std::size_t hash = std::min(line.find('#'), line.size());
    for (std::size_t at = 0; at < hash; ++at) {
      const char quote = line[at];
      if ((quote != '"' && quote != '\'') || !begins_value(line.substr(0, at))) continue;
      std::size_t end = at + 1;
      while (end < line.size() && line[end] != quote) end += line[end] == '\\' ? 2 : 1;
      if (end >= line.size()) return hash;  // no text at all, or one without an end
      const std::size_t behind = comment_begin(line.substr(end + 1));
      return end + 1 + behind;
    }
    return hash;
  }
  /// Whether a value may begin behind this: after "TYPE NAME " or "TYPE NAME = ", or in a list.
  static bool begins_value(std::string_view before) noexcept {
    const std::string_view s = trimmed_right(before);
    return s.empty() || s.back() == '=' || s.back() == '[' || s.back() == ',' || s.size() < before.size();
  }

  Result<void> element(std::string_view code, std::string comment) {
    const std::size_t blank = std::min(code.find_first_of(" \t"), code.size());
    const std::string_view type_text = code.substr(0, blank), rest = trimmed_left(code.substr(blank));
    if (rest.empty()) return wrong("expected a type and a name, found " + lrt::quoted(code));
    ParsedField parsed;
    if (Result<void> r = read_type(type_text, parsed); !r) return r;
    std::size_t end = 0;
    while (end < rest.size() && !is_blank(rest[end]) && rest[end] != '=') ++end;
    const std::string_view name = rest.substr(0, end), behind = trimmed_left(rest.substr(end));
    if (!is_name(name)) return wrong("expected a name of letters, digits and '_', found " + lrt::quoted(name));
    if (!names_.insert(std::string(name)).second) return wrong("the name " + lrt::quoted(name) + " occurs twice");
    if (!behind.empty() && behind.front() == '=') {
      if (!parsed.message.empty() || parsed.field.type.arity != Arity::single) return wrong("expected a primitive type of a constant");
      Result<rdf::Value> value = parse_value(parsed.field.type, trimmed(behind.substr(1)), limits_);
      if (!value) return Unexpected{std::move(value).error()};
      message_.constants.push_back({std::string(name), parsed.field.type.kind, std::move(*value), std::move(comment)});
      last_ = &message_.constants.back().comment;
      return {};
    }
    parsed.field.name = name;
    if (!behind.empty()) {
      if (!parsed.message.empty()) return wrong("a field with a message has no default, found " + lrt::quoted(behind));
      Result<rdf::Value> value = parse_value(parsed.field.type, behind, limits_);
      if (!value) return Unexpected{std::move(value).error()};
      parsed.field.initial = std::move(*value);
    }
    parsed.field.comment = std::move(comment);
    message_.fields.push_back(std::move(parsed));
    last_ = &message_.fields.back().field.comment;
    return {};
  }

  Result<void> read_type(std::string_view text, ParsedField& to) const {
    FieldType& type = to.field.type;
    std::string_view base = text;
    if (base.back() == ']') {
      const std::size_t open = base.rfind('[');
      if (open == std::string_view::npos) return wrong("expected [ before ] in the type " + lrt::quoted(text));
      std::string_view size = base.substr(open + 1, base.size() - open - 2);
      base = base.substr(0, open);
      if (size.empty()) {
        type.arity = Arity::sequence;
      } else {
        type.arity = Arity::array;
        if (size.substr(0, 2) == "<=") type.arity = Arity::bounded_sequence, size.remove_prefix(2);
        const auto n = count_of(size);
        if (!n || *n == 0) return wrong("expected a length of at least 1 in the type " + lrt::quoted(text));
        type.size = *n;
      }
    }
    const std::size_t bound = base.find("<=");
    const std::string_view word = base.substr(0, bound);
    const auto known = std::find_if(kind_names.begin(), kind_names.end(), [&](const KindName& k) { return k.name == word; });
    if (known != kind_names.end()) {
      type.kind = known->kind;
      if (bound == std::string_view::npos) return {};
      const auto n = count_of(base.substr(bound + 2));
      if ((type.kind != Kind::string && type.kind != Kind::wstring) || !n || *n == 0)
        return wrong("expected a bound of at least 1 of a string, found the type " + lrt::quoted(text));
      type.text_bound = *n;
      return {};
    }
    type.kind = Kind::message;
    const std::size_t slashes = static_cast<std::size_t>(std::count(base.begin(), base.end(), '/'));
    const std::size_t slash = base.find('/');
    to.message = slashes == 0   ? package_ + "/msg/" + std::string(base)
                 : slashes == 1 ? std::string(base.substr(0, slash)) + "/msg/" + std::string(base.substr(slash + 1))
                                : std::string(base);
    if (!is_type_name(to.message)) return wrong("expected a type, found " + lrt::quoted(text));
    return {};
  }

  std::string package_;
  const DefinitionLimits& limits_;
  ParsedMessage message_;
  std::set<std::string> names_;
  std::string pending_;          // comments of what follows
  std::string* last_ = nullptr;  // comment of the last element
  bool is_first_ = true;         // nothing but comments so far
};

/// "demo/msg/Thing" of "demo/Thing" or "demo/msg/Thing"; empty: it is none.
std::string full_type(std::string_view name) {
  std::string made(name);
  if (std::count(name.begin(), name.end(), '/') == 1) made.insert(name.find('/'), "/msg");
  return is_type_name(made) ? made : std::string();
}

bool is_separator(std::string_view line) noexcept { return line.size() >= 80 && line.find_first_not_of('=') == std::string_view::npos; }

}  // namespace

std::string_view to_string(Kind kind) noexcept {
  for (const KindName& k : kind_names)
    if (k.kind == kind) return k.name;
  return "message";
}

bool same_structure(const ParsedMessage& a, const ParsedMessage& b) noexcept {
  return std::equal(a.fields.begin(), a.fields.end(), b.fields.begin(), b.fields.end(), [](const ParsedField& x, const ParsedField& y) {
    const FieldType &t = x.field.type, &u = y.field.type;
    return x.field.name == y.field.name && x.message == y.message && t.kind == u.kind && t.arity == u.arity && t.size == u.size &&
           t.text_bound == u.text_bound;
  });
}

std::optional<IntegerRange> range_of(Kind kind) noexcept {
  const auto of = [](auto type) {
    using Limits = std::numeric_limits<decltype(type)>;
    return IntegerRange{static_cast<std::int64_t>(Limits::min()), static_cast<std::uint64_t>(Limits::max())};
  };
  switch (kind) {
    case Kind::octet:
    case Kind::character:
    case Kind::uint8: return of(std::uint8_t{});
    case Kind::int8: return of(std::int8_t{});
    case Kind::int16: return of(std::int16_t{});
    case Kind::uint16: return of(std::uint16_t{});
    case Kind::int32: return of(std::int32_t{});
    case Kind::uint32: return of(std::uint32_t{});
    case Kind::int64: return of(std::int64_t{});
    case Kind::uint64: return of(std::uint64_t{});
    default: return std::nullopt;
  }
}

Result<rdf::Value> parse_value(const FieldType& type, std::string_view text, const DefinitionLimits& limits) {
  if (type.kind == Kind::message) return wrong("a message has no value in a definition");
  if (text.empty() && type.kind != Kind::string && type.kind != Kind::wstring) return wrong("expected a value");
  if (type.arity == Arity::single) return single_of(type, text);
  Result<std::vector<std::string_view>> members = members_of(text, limits.max_members);
  if (!members) return Unexpected{std::move(members).error()};
  if (type.arity == Arity::array ? members->size() != type.size : type.arity == Arity::bounded_sequence && members->size() > type.size)
    return wrong("expected " + std::string(type.arity == Arity::array ? "" : "at most ") + std::to_string(type.size) + " members, found " +
                 std::to_string(members->size()));
  rdf::Value::Sequence values;
  values.reserve(members->size());
  for (const std::string_view member : *members) {
    Result<rdf::Value> value = single_of(type, member);
    if (!value) return value;
    values.push_back(std::move(*value));
  }
  return rdf::Value(std::move(values));
}

Result<std::vector<ParsedMessage>> parse_definition(std::string_view type, std::string_view text, const DefinitionLimits& limits) {
  if (!is_type_name(type)) return wrong("expected the name of a type, PACKAGE/msg/NAME, found " + lrt::quoted(type));
  if (text.size() > limits.max_text_bytes)
    return unexpected(Errc::limit_exceeded, "a definition has more than " + std::to_string(limits.max_text_bytes) + " bytes");
  text = utf8::without_mark(text);
  if (const auto at = utf8::find_invalid(text)) {
    Error error{Errc::expected_value, utf8::fault_of(text), *at};
    return Unexpected{std::move(error)};
  }
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos)
    return Unexpected{Error{Errc::expected_value, std::string(type) + ": a definition has a byte of 0", nul}};
  std::vector<ParsedMessage> made;
  std::string name(type);
  std::optional<Section> section;
  std::size_t part = 0;  // of a .srv or .action
  const auto folder = [&] { return std::string_view(name).substr(name.find('/') + 1, name.rfind('/') - name.find('/') - 1); };
  const auto parts = [&]() -> std::vector<std::string> {
    // "Wave_Goal" of action/Wave_Goal is a message by itself
    if (folder() == "srv" && name.find('_', name.rfind('/')) == std::string::npos) return {"_Request", "_Response"};
    if (folder() == "action" && name.find('_', name.rfind('/')) == std::string::npos) return {"_Goal", "_Result", "_Feedback"};
    return {""};
  };
  const auto begin = [&] { section.emplace(std::string_view(name).substr(0, name.find('/')), name + parts()[part], limits); };
  const auto keep = [&]() -> Result<void> {
    ParsedMessage message = section->take();
    const auto first = std::find_if(made.begin(), made.end(), [&](const ParsedMessage& m) { return m.name == message.name; });
    if (first == made.end()) made.push_back(std::move(message));
    else if (!same_structure(*first, message)) return wrong("there are two different definitions of " + lrt::quoted(message.name));
    return {};
  };
  const auto end = [&]() -> Result<void> {
    if (Result<void> r = keep(); !r) return r;
    if (++part == parts().size()) return {};
    return wrong("expected " + std::to_string(parts().size() - 1) + " lines \"---\" in a definition of " + lrt::quoted(name) + ", found " +
                 std::to_string(part - 1));
  };
  begin();
  std::uint32_t number = 0;
  bool at_name = false;  // the line behind a row of '='
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t line_end = std::min(text.find_first_of("\n\r", at), text.size());
    const std::string_view line = text.substr(at, line_end - at);
    at = line_end + (text.substr(line_end, 2) == "\r\n" ? 2 : 1);
    ++number;
    const Result<void> read = [&]() -> Result<void> {
      if (at_name) {
        at_name = false;
        constexpr std::string_view mark = "MSG:";
        if (line.substr(0, mark.size()) != mark) return wrong("expected \"MSG: PACKAGE/NAME\", found " + lrt::quoted(line));
        name = full_type(trimmed(line.substr(mark.size())));
        if (name.empty()) return wrong("expected \"MSG: PACKAGE/NAME\", found " + lrt::quoted(line));
        part = 0;
        begin();
        return {};
      }
      if (is_separator(trimmed_right(line))) {
        at_name = true;
        return end();
      }
      if (trimmed_right(line) == "---" && parts().size() > 1) {
        if (part + 1 == parts().size()) return wrong("expected " + std::to_string(parts().size() - 1) + " lines \"---\", found one more");
        if (Result<void> r = keep(); !r) return r;
        ++part;
        begin();
        return {};
      }
      return section->add(line);
    }();
    if (!read) {
      Error error = read.error();
      error.line = number;
      error.column = 1;
      error.message.insert(0, std::string(type) + ", line " + std::to_string(number) + ": ");
      return Unexpected{std::move(error)};
    }
  }
  if (at_name) return wrong(std::string(type) + ": expected \"MSG: PACKAGE/NAME\" at the end");
  if (Result<void> r = end(); !r) return Unexpected{std::move(r).error()};
  return made;
}

}  // namespace lrt::ros2
