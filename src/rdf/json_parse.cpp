// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/json_parse.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <nlohmann/json.hpp>

#include <lrt/rdf/lexical.hpp>

#include "src/base/base64.hpp"
#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/limits.hpp"

// JSON is read by nlohmann-json as events, because its tree loses the digits of numbers and repeated members. CBOR is read by our own code:
// the reader of nlohmann-json recurses for each chunk of a text without an event, and 1 MiB of 0x7F overflows the stack.

namespace lrt::rdf::json {

class Builder {
 public:
  using json = nlohmann::json;
  using Id = Document::Id;
  using Kind = Document::Kind;

  Builder(Document& document, std::string_view text, const Limits& limits) : document_(document), text_(text), limits_(limits) {}

  bool null() { return add(Kind::null) != Document::none; }
  bool boolean(bool value) { return add(value ? Kind::true_ : Kind::false_) != Document::none; }
  bool number(std::string_view digits) { return with_text(Kind::number, digits); }
  bool number_integer(json::number_integer_t value) { return number(value == 0 ? "-0" : std::to_string(value)); }  // negative numbers
  bool number_unsigned(json::number_unsigned_t value) { return number(std::to_string(value)); }
  bool number_float(json::number_float_t, const std::string& digits) {
    std::string text = digits;  // with a decimal point in every locale
    for (char& c : text)
      if (std::string_view("0123456789+-eE").find(c) == std::string_view::npos) c = '.';
    return number(text);
  }
  bool string(std::string& value) { return (limits_.nul || plain(value)) && with_text(Kind::string, value); }
  bool binary(json::binary_t&) { return false; }
  bool octets(std::string_view bytes) {
    if (!with_text(Kind::string, lrt::detail::base64(bytes))) return false;
    document_.values_.back().octets = true;
    return true;
  }

  bool start_object(std::size_t) { return open(Kind::object); }
  bool start_array(std::size_t) { return open(Kind::array); }
  bool key(std::string& name) {
    if (!plain(name)) return false;
    key_ = static_cast<std::uint32_t>(document_.text_.size());
    key_length_ = static_cast<std::uint32_t>(name.size());
    document_.text_ += name;
    return true;
  }
  bool end_object() { return all_different(at_) && close(); }
  bool end_array() { return close(); }

  bool parse_error(std::size_t position, const std::string&, const json::exception& e) {
    if (error_) return false;
    // "[json.exception....] parse error at line 1, column 2: syntax error while parsing value - unexpected ']'; last read: '...'"
    std::string_view sentence = e.what();
    if (const std::size_t dash = sentence.find(" - "); dash != std::string_view::npos) sentence.remove_prefix(dash + 3);
    else if (const std::size_t bracket = sentence.find("] "); bracket != std::string_view::npos) sentence.remove_prefix(bracket + 2);
    sentence = sentence.substr(0, std::min<std::size_t>(sentence.find("; last read"), 120));
    if (e.id == 406) sentence = "a number beyond xsd:double";
    const std::size_t offset = std::min(position > 0 ? position - 1 : 0, text_.size());
    error_ = misread(text_, offset, "invalid JSON: " + std::string(sentence)).error;
    return false;
  }

  /// The error, if parsing failed.
  Error error() const { return error_ ? *error_ : Error{Errc::expected_rdf, "invalid JSON"}; }

 private:
  bool fail(Errc code, std::string sentence) {
    error_ = Error{code, std::move(sentence)};
    return false;
  }

  bool plain(const std::string& text) {
    if (text.find('\0') == std::string::npos) return true;
    return fail(Errc::expected_rdf, "at \"" + document_.pointer(at_) + "\": U+0000 is not accepted");
  }

  Id add(Kind kind) {
    std::vector<Document::Value>& values = document_.values_;
    if (values.size() >= limits_.values) {
      fail(Errc::limit_exceeded, "more than " + std::to_string(limits_.values) + " JSON values");
      return Document::none;
    }
    const auto id = static_cast<Id>(values.size());
    Document::Value& value = values.emplace_back();
    value.kind = kind;
    value.parent = at_;
    if (at_ == Document::none) return id;
    Document::Value& parent = values[at_];
    if (parent.kind == Kind::object) {
      value.key = key_;
      value.key_length = key_length_;
    }
    (parent.first == Document::none ? parent.first : values[parent.last].next) = id;
    parent.last = id;
    return id;
  }

  bool with_text(Kind kind, std::string_view text) {
    const Id id = add(kind);
    if (id == Document::none) return false;
    document_.values_[id].text = static_cast<std::uint32_t>(document_.text_.size());
    document_.values_[id].length = static_cast<std::uint32_t>(text.size());
    document_.text_ += text;
    return true;
  }

  bool open(Kind kind) {
    if (++depth_ > limits_.depth) return fail(Errc::limit_exceeded, "objects and arrays nested more than " + std::to_string(limits_.depth) + " deep");
    at_ = add(kind);
    return at_ != Document::none;
  }

  bool close() {
    --depth_;
    at_ = document_.parent(at_);
    return true;
  }

  bool all_different(Id object) {
    members_.clear();
    for (const Id member : Children(document_, object)) members_.push_back(member);
    const auto before = [this](Id a, Id b) {
      const int order = document_.key(a).compare(document_.key(b));
      return order < 0 || (order == 0 && a < b);
    };
    std::sort(members_.begin(), members_.end(), before);
    const auto same = [this](Id a, Id b) { return document_.key(a) == document_.key(b); };
    const auto found = std::adjacent_find(members_.begin(), members_.end(), same);
    if (found == members_.end()) return true;
    return fail(Errc::expected_rdf, "at \"" + document_.pointer(found[1]) + "\": a second member of this name");
  }

  Document& document_;
  std::string_view text_;
  Limits limits_;
  std::optional<Error> error_;
  Id at_ = Document::none;
  std::size_t depth_ = 0;
  std::uint32_t key_ = 0, key_length_ = 0;
  std::vector<Id> members_;
};

namespace {

/// Reads CBOR (RFC 8949) as the same events. The builder limits the depth. A declared length does not allocate memory.
class CborReader {
 public:
  CborReader(std::string_view bytes, Builder& builder) : bytes_(bytes), builder_(builder) {}

  /// The error of this reader. The builder has its own.
  const std::optional<Error>& error() const noexcept { return error_; }

  bool read() { return item() && (at_ == bytes_.size() || fail(at_, "more after the value")); }

 private:
  struct Head {
    unsigned major = 0, info = 0;
    std::uint64_t argument = 0;
    bool open = false;  // an indefinite length, or the break that ends it
  };

  bool fail(std::size_t offset, const std::string& sentence) {
    error_ = Error{Errc::expected_rdf, "byte " + std::to_string(offset) + ": expected CBOR, found " + sentence, offset};
    return false;
  }

  bool head(Head& out) {
    begin_ = at_;
    if (at_ == bytes_.size()) return fail(at_, "the end of the body");
    const unsigned byte = static_cast<unsigned char>(bytes_[at_++]);
    out = {byte >> 5, byte & 31, byte & 31, false};
    if (out.info < 24) return true;
    out.open = out.info == 31 && (out.major == 7 || (out.major >= 2 && out.major <= 5));
    if (out.open) return true;
    if (out.info > 27) return fail(begin_, "an initial byte that has no meaning");
    const std::size_t length = std::size_t{1} << (out.info - 24);
    if (bytes_.size() - at_ < length) return fail(bytes_.size(), "the end of the body");
    for (out.argument = 0; at_ <= begin_ + length; ++at_) out.argument = out.argument << 8 | static_cast<unsigned char>(bytes_[at_]);
    return true;
  }

  bool item() {
    Head h;
    return head(h) && item(h);
  }

  bool item(const Head& h) {
    switch (h.major) {
      case 0: return builder_.number_unsigned(h.argument);
      case 1: return builder_.number(h.argument == UINT64_MAX ? "-18446744073709551616" : "-" + std::to_string(h.argument + 1));
      case 2: {
        std::string bytes;
        return string(h, bytes) && builder_.octets(bytes);
      }
      case 3: {
        std::string text;
        return string(h, text) && builder_.string(text);
      }
      case 4: return builder_.start_array(0) && each(h, [this](const Head& member) { return item(member); }) && builder_.end_array();
      case 5: {
        const auto member = [this](const Head& name) {
          std::string text;
          if (name.major != 3) return fail(begin_, "a member name that is not a text");
          return string(name, text) && builder_.key(text) && item();
        };
        return builder_.start_object(0) && each(h, member) && builder_.end_object();
      }
      case 6: return fail(begin_, "a tag, which JSON does not have");
      default: return simple(h);
    }
  }

  template <class F>
  bool each(const Head& h, F one) {
    Head member;
    for (std::uint64_t i = 0; h.open || i < h.argument; ++i) {
      if (!head(member)) return false;
      if (h.open && member.major == 7 && member.open) return true;
      if (!one(member)) return false;
    }
    return true;
  }

  bool string(const Head& h, std::string& out) {
    if (!h.open) return chunk(h, out);
    return each(h, [&](const Head& part) {
      if (part.major != h.major || part.open) {
        const std::string what = h.major == 2 ? "byte string" : "text";
        return fail(begin_, "a chunk of a " + what + " that is not a " + what + " of definite length");
      }
      return chunk(part, out);
    });
  }
  bool chunk(const Head& h, std::string& out) {
    if (bytes_.size() - at_ < h.argument) return fail(bytes_.size(), "the end of the body");
    const std::string_view text = bytes_.substr(at_, static_cast<std::size_t>(h.argument));
    if (h.major == 3)
      if (const auto bad = utf8::find_invalid(text)) return fail(at_ + *bad, "invalid UTF-8");
    at_ += text.size();
    out += text;
    return true;
  }

  bool simple(const Head& h) {
    if (h.open) return fail(begin_, "a break outside an item of indefinite length");
    switch (h.info) {
      case 20:
      case 21: return builder_.boolean(h.info == 21);
      case 22: return builder_.null();
      case 25: return real(half(static_cast<unsigned>(h.argument)));
      case 26: return real(static_cast<double>(bits<float>(static_cast<std::uint32_t>(h.argument))));
      case 27: return real(bits<double>(h.argument));
      default: return fail(begin_, "simple value " + std::to_string(h.argument) + ", which JSON does not have");
    }
  }

  bool real(double value) {
    std::string text = lexical::format(value);
    if (text.find_first_not_of("-0123456789") == std::string::npos) text += ".0";
    return builder_.number(text);
  }
  template <class T, class U>
  static T bits(U from) noexcept {
    T value;
    static_assert(sizeof value == sizeof from);
    std::memcpy(&value, &from, sizeof value);
    return value;
  }
  static double half(unsigned h) noexcept {  // IEEE 754 binary16
    const int exponent = static_cast<int>(h >> 10 & 31U), fraction = static_cast<int>(h & 1023U);
    double value = 0;
    if (exponent == 31) value = fraction == 0 ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
    else if (exponent == 0) value = std::ldexp(fraction, -24);
    else value = std::ldexp(fraction + 1024, exponent - 25);
    return (h & 0x8000U) != 0 ? -value : value;
  }

  std::string_view bytes_;
  Builder& builder_;
  std::optional<Error> error_;
  std::size_t at_ = 0, begin_ = 0;  // offsets of the next byte and of the last item
};

/// Bytes of a text in a message.
constexpr std::size_t longest_key = 100;

}  // namespace

Result<Document> Document::parse(std::string_view text, const Limits& limits) {
  if (const auto at = utf8::find_invalid(text)) return misread(text, *at, utf8::fault_of(text));
  // nlohmann-json reads U+0000 as the end.
  if (const auto at = text.find('\0'); at != std::string_view::npos) return misread(text, at, "invalid JSON: U+0000");
  if (text.size() > std::numeric_limits<std::uint32_t>::max() / 2) return unexpected(Errc::limit_exceeded, "more than 2 GiB of JSON");
  Document document;
  Builder builder(document, text, limits);
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &builder)) return unexpected(builder.error());
  return document;
}

Result<Document> Document::parse_cbor(std::string_view bytes, const Limits& limits) {
  if (bytes.size() > std::numeric_limits<std::uint32_t>::max() / 16)  // a number is at most 16 times as long in digits
    return unexpected(Errc::limit_exceeded, "more than 256 MiB of CBOR");
  Document document;
  Builder builder(document, bytes, limits);
  CborReader reader(bytes, builder);
  if (!reader.read()) return unexpected(reader.error() ? *reader.error() : builder.error());
  return document;
}

Document::Id Document::member(Id object, std::string_view name) const noexcept {
  for (Id id = first(object); id != none; id = next(id))
    if (key(id) == name) return id;
  return none;
}

std::string Document::pointer(Id id) const {
  std::vector<Id> way;
  for (; id != none && parent(id) != none; id = parent(id)) way.push_back(id);
  std::string out;
  for (auto at = way.rbegin(); at != way.rend(); ++at) {
    if (out.size() > 200) return out + "/... (cut)";
    const Id container = parent(*at);
    if (kind(container) == Kind::array) {
      std::size_t index = 0;
      for (Id other = first(container); other != *at; other = next(other)) ++index;
      append_step(out, std::to_string(index));
    } else {
      append_step(out, utf8::prefix(key(*at), longest_key));
    }
  }
  return out;
}

void append_step(std::string& pointer, std::string_view name) {
  pointer += '/';
  for (const char c : name) {
    if (c == '~') pointer += "~0";
    else if (c == '/') pointer += "~1";
    else pointer += c;
  }
}

}  // namespace lrt::rdf::json
