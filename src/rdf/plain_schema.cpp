// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/plain_schema.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <lrt/rdf/lexical.hpp>

#include "src/base/quote.hpp"
#include "src/rdf/bytes.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/plain.hpp"
#include "src/rdf/plain_names.hpp"

namespace lrt::rdf {
namespace {

using Kind = Type::Kind;

class SchemaWriter {
 public:
  explicit SchemaWriter(const ChooseText* choose) : choose_(choose) {}

  /// @param words  of a field
  void write(const Type& outer, const Facets& facets, bool says_unit, const Facets* words = nullptr) {
    const Type* inner = &outer;
    while (inner->kind == Kind::optional) inner = inner->element;
    const Type& type = *inner;
    nullable_ = inner != &outer;
    out_ += '{';
    switch (type.kind) {
      case Kind::boolean: name("boolean"); break;
      case Kind::integer: name("integer"), integer_bounds(type, facets); break;
      case Kind::real: name("number"), bounds(facets); break;
      case Kind::text:
        name("string");
        if (type.is_bytes()) bytes(type, facets);
        else lengths(facets);
        break;
      case Kind::enumeration: name("string"), names(type); break;
      case Kind::duration: name("string"), member("format", "\"duration\""); break;
      case Kind::instant: name("string"), member("format", "\"date-time\""); break;
      case Kind::list: name("array"), items(type, facets); break;
      case Kind::record: name("object"), fields(type, facets); break;
      case Kind::map: name("object"), values(type, facets); break;
      case Kind::variant: name("object"), alternatives(type, facets); break;
      case Kind::optional: break;
    }
    if (says_unit && type.kind != Kind::map && carries_unit(type, facets)) {
      key("unit");
      append_quoted(out_, unit_code(facets.unit()));
    }
    if (words && choose_ && words->has_words()) texts(words->words());
    out_ += '}';
  }
  std::string take() { return std::move(out_); }

 private:
  void name(const char* type) {
    out_ += "\"type\":";
    out_ += nullable_ ? "[\"" + std::string(type) + "\",\"null\"]" : "\"" + std::string(type) + "\"";
  }
  void texts(const Words& words) {
    text("title", (*choose_)(words.titles));
    text("description", (*choose_)(words.descriptions));
  }
  void text(const char* k, const Text* text) {
    if (!text) return;
    key(k);
    append_quoted(out_, text->text);
  }
  void key(const char* k) { out_.append(",\"").append(k).append("\":"); }
  void member(const char* k, const std::string& json) {
    key(k);
    out_ += json;
  }

  void lower(const Facets& f) {
    if (f.min() && std::isfinite(*f.min())) member(f.min_exclusive() ? "exclusiveMinimum" : "minimum", lexical::format(*f.min()));
  }
  void upper(const Facets& f) {
    if (f.max() && std::isfinite(*f.max())) member(f.max_exclusive() ? "exclusiveMaximum" : "maximum", lexical::format(*f.max()));
  }
  void bounds(const Facets& f) { lower(f), upper(f); }
  /// On each side the narrower of two bounds applies.
  void integer_bounds(const Type& type, const Facets& f) {
    if (f.min() && *f.min() >= static_cast<double>(type.lowest)) lower(f);
    else if (type.lowest != std::numeric_limits<std::int64_t>::min()) member("minimum", std::to_string(type.lowest));
    if (f.max() && *f.max() <= static_cast<double>(type.highest)) upper(f);
    else if (type.highest < static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) member("maximum", std::to_string(type.highest));
  }
  void lengths(const Facets& f) {
    if (f.min_length() > 0) member("minLength", std::to_string(f.min_length()));
    if (f.max_length() != std::numeric_limits<std::size_t>::max()) member("maxLength", std::to_string(f.max_length()));
  }

  void bytes(const Type& type, const Facets& f) {
    const std::size_t shortest = std::max(type.shortest, f.min_length()), longest = std::min(type.longest, f.max_length());
    member("contentEncoding", "\"base64\"");
    if (shortest > 0) member("minLength", std::to_string(base64_length(shortest)));
    if (longest != std::numeric_limits<std::size_t>::max()) member("maxLength", std::to_string(base64_length(longest)));
  }

  void names(const Type& type) {
    key("enum");
    out_ += '[';
    for (const std::string& n : type.names) {
      append_quoted(out_, n);
      out_ += ',';
    }
    if (nullable_) out_ += "null";
    else if (out_.back() == ',') out_.pop_back();
    out_ += ']';
    if (!choose_ || type.name_words.empty()) return;
    key("oneOf");
    out_ += '[';
    for (std::size_t i = 0; i < type.names.size(); ++i) {
      out_ += i > 0 ? ",{\"const\":" : "{\"const\":";
      append_quoted(out_, type.names[i]);
      if (i < type.name_words.size()) texts(type.name_words[i]);
      out_ += '}';
    }
    out_ += nullable_ ? ",{\"const\":null}]" : "]";
  }

  void items(const Type& type, const Facets& facets) {
    key("items");
    write(*type.element, facets, false);
    if (type.shortest > 0) member("minItems", std::to_string(type.shortest));
    if (type.longest != std::numeric_limits<std::size_t>::max()) member("maxItems", std::to_string(type.longest));
    if (type.each_once) member("uniqueItems", "true");
  }

  void values(const Type& type, const Facets& facets) {
    if (type.key && type.key->kind == Kind::integer) {
      member("propertyNames", type.key->lowest < 0 ? R"({"pattern":"^(0|-?[1-9][0-9]*)$"})" : R"({"pattern":"^(0|[1-9][0-9]*)$"})");
    } else if (type.key) {
      key("propertyNames");
      out_ += "{\"enum\":[";
      for (std::size_t i = 0; i < type.key->names.size(); ++i) {
        if (i > 0) out_ += ',';
        append_quoted(out_, type.key->names[i]);
      }
      out_ += "]}";
    }
    key("additionalProperties");
    write(*type.element, facets, true);
  }

  /// An object with one member, for each alternative.
  void alternatives(const Type& type, const Facets& facets) {
    const bool nullable = nullable_;
    const std::vector<std::string> all = member_names(type);
    key("oneOf");
    char before = '[';
    for (std::size_t i = 0; i < all.size(); ++i) {
      const FieldType& field = type.fields[i];
      std::string name;
      append_quoted(name, all[i]);
      out_ += before;
      before = ',';
      out_ += "{\"type\":\"object\",\"properties\":{" + name + ':';
      write(*field.type, field_facets(field, facets), true, &field.facets);
      out_ += "},\"required\":[" + name + "],\"additionalProperties\":false}";
    }
    out_ += nullable ? ",{\"type\":\"null\"}]" : "]";
  }

  void fields(const Type& type, const Facets& facets) {
    const std::vector<std::string> all = member_names(type);
    std::string required;
    key("properties");
    out_ += '{';
    for (std::size_t i = 0; i < all.size(); ++i) {
      const FieldType& field = type.fields[i];
      if (i > 0) out_ += ',';
      append_quoted(out_, all[i]);
      out_ += ':';
      write(*field.type, field_facets(field, facets), true, &field.facets);
      if (field.absent) default_value(field, field_facets(field, facets));
      if (field.type->kind == Kind::optional || field.absent) continue;
      required += required.empty() ? "" : ",";
      append_quoted(required, all[i]);
    }
    out_ += '}';
    if (!required.empty()) member("required", "[" + required + "]");
    member("additionalProperties", "false");
  }

  /// Adds to the schema of a field, which was written last.
  void default_value(const FieldType& field, const Facets& facets) {
    const Result<std::string> json = write_plain(*field.type, facets, *field.absent, Plain::json);
    if (!json) return;
    out_.pop_back();
    member("default", *json);
    out_ += '}';
  }

  std::string out_;
  bool nullable_ = false;
  const ChooseText* choose_;
};

}  // namespace

std::string write_schema(const Type& type, const Facets& facets, const ChooseText* choose) {
  SchemaWriter writer(choose);
  writer.write(type, facets, true);
  return writer.take();
}

}  // namespace lrt::rdf
