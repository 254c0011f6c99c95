#include "src/rdf/json_ld_parse.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include <nlohmann/json.hpp>

#include <lrt/base/utf8.hpp>

#include "src/rdf/turtle_scan.hpp"

// JSON is read by nlohmann-json as events: its tree would lose the digits of numbers and the second of two members of one name.

namespace lrt::rdf::json_ld {

class Builder {
 public:
  using json = nlohmann::json;
  using Id = Document::Id;
  using Kind = Document::Kind;

  Builder(Document& document, std::string_view text, std::size_t max_values) : document_(document), text_(text), max_values_(max_values) {}

  bool null() { return add(Kind::null) != Document::none; }
  bool boolean(bool value) { return add(value ? Kind::true_ : Kind::false_) != Document::none; }
  bool number_integer(json::number_integer_t value) { return with_text(Kind::number, std::to_string(value)); }
  bool number_unsigned(json::number_unsigned_t value) { return with_text(Kind::number, std::to_string(value)); }
  bool number_float(json::number_float_t, const std::string& digits) {
    std::string text = digits;  // with the decimal point of the C locale, whatever the host has set
    for (char& c : text)
      if (std::string_view("0123456789+-eE").find(c) == std::string_view::npos) c = '.';
    return with_text(Kind::number, text);
  }
  bool string(std::string& value) { return plain(value) && with_text(Kind::string, value); }
  bool binary(json::binary_t&) { return false; }

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
    error_ = misread(text_, offset, "no JSON: " + std::string(sentence)).error;
    return false;
  }

  /// Why parsing ended, if it did not succeed.
  Error error() const { return error_ ? *error_ : Error{Errc::expected_rdf, "no JSON"}; }

 private:
  bool fail(Errc code, std::string sentence) {
    error_ = Error{code, std::move(sentence)};
    return false;
  }

  bool plain(const std::string& text) {
    if (text.find('\0') == std::string::npos) return true;
    return fail(Errc::expected_rdf, "at \"" + document_.pointer(at_ == Document::none ? 0 : at_) + "\": U+0000 is not accepted");
  }

  Id add(Kind kind) {
    std::vector<Document::Value>& values = document_.values_;
    if (values.size() >= max_values_) {
      fail(Errc::limit_exceeded, "more than " + std::to_string(max_values_) + " JSON values");
      return Document::none;
    }
    const auto id = static_cast<Id>(values.size());
    values.push_back({kind});
    Document::Value& value = values.back();
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
    if (++depth_ > max_depth)
      return fail(Errc::limit_exceeded, "objects and arrays nested more than " + std::to_string(max_depth) + " deep");
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
  std::size_t max_values_;
  std::optional<Error> error_;
  Id at_ = Document::none;
  std::size_t depth_ = 0;
  std::uint32_t key_ = 0, key_length_ = 0;
  std::vector<Id> members_;
};

Result<Document> Document::parse(std::string_view text, std::size_t max_values) {
  if (const auto at = utf8::find_invalid(text)) return misread(text, *at, "invalid UTF-8");
  if (text.size() > std::numeric_limits<std::uint32_t>::max() / 2) return unexpected(Errc::limit_exceeded, "more than 2 GiB of JSON");
  Document document;
  Builder builder(document, text, max_values);
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &builder)) return unexpected(builder.error());
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
    out += '/';
    const Id container = parent(*at);
    if (kind(container) == Kind::array) {
      std::size_t index = 0;
      for (Id other = first(container); other != *at; other = next(other)) ++index;
      out += std::to_string(index);
      continue;
    }
    std::string_view name = key(*at);
    if (name.size() > 100) {
      std::size_t end = 100;
      while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0) == 0x80) --end;
      name = name.substr(0, end);
    }
    for (const char c : name) {
      if (c == '~') out += "~0";
      else if (c == '/') out += "~1";
      else out += c;
    }
  }
  return out;
}

}  // namespace lrt::rdf::json_ld
