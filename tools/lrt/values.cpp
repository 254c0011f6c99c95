// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/values.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <set>
#include <utility>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/client/units.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/utf8.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/rdf/plain.hpp"
#include "tools/lrt/suggest.hpp"
#include "tools/lrt/terminal.hpp"

namespace lrt::tool {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;
using rdf::Type;

namespace {

constexpr unsigned max_depth = 16;
constexpr std::size_t max_members = 10'000;

std::string json_of(double number) {
  const Result<std::string> text = rdf::write_plain(rdf::traits<double>::type(), {}, rdf::Value(number), rdf::Plain::json);
  return text ? *text : "null";
}

std::string unquoted(const std::string& json) {
  return json.size() >= 2 && json.front() == '"' && json.find('\\') == std::string::npos ? json.substr(1, json.size() - 2) : json;
}

std::string_view local_name(std::string_view iri) noexcept {
  const std::size_t at = iri.find_last_of("#/");
  return at == std::string_view::npos || at + 1 == iri.size() ? iri : iri.substr(at + 1);
}

/// Predicates that describe the resource and are no part of its value.
bool describes_resource(std::string_view predicate) {
  static constexpr std::string_view own[] = {"https://hybr-it-projekt.de/ns/hybr-it#", "http://purl.org/dc/terms/",
                                             "http://www.w3.org/1999/xhtml/vocab#", "http://www.w3.org/ns/ldp#"};
  for (const std::string_view space : own)
    if (predicate.substr(0, space.size()) == space) return true;
  for (const Iri one :
       {vocab::rdf_::type, vocab::rdfs::seeAlso, vocab::vom::unit, vocab::qudt::hasUnit, vocab::lrt_::frame, vocab::vom::quantityKind})
    if (predicate == one.text) return true;
  return predicate == "http://qudt.org/schema/qudt/dataType" || predicate == "http://qudt.org/schema/qudt/hasQuantityKind" ||
         predicate == "http://qudt.org/schema/qudt/unit" || predicate == "https://w3id.org/lrt/ns#elementType" ||
         predicate == "https://w3id.org/lrt/ns#datatype";
}

/// Reads a value from the triples of its node.
class Reader {
 public:
  explicit Reader(const Graph& graph) : graph_(graph) {}

  std::string node(TermId id, unsigned depth) {
    const TermView term = graph_.term(id);
    if (term.is_literal()) return literal(term);
    if (depth == 0) document_ = term.text.substr(0, term.text.find('#'));
    if (++members_ > max_members || depth > max_depth || !open_.insert(id).second) return "\"...\"";
    std::string result = resource(id, depth);
    open_.erase(id);
    return result;
  }

  std::string unit(TermId id) const {
    const auto [vom, qudt] = unit_iris(id);
    if (vom.empty() && qudt.empty()) return {};
    return printable(client::unit_label(client::find_unit(vom, qudt)));
  }
  std::string unit_iri(TermId id) const {
    const auto [vom, qudt] = unit_iris(id);
    return printable(qudt.empty() ? vom : qudt);
  }

  std::optional<TermId> number(TermId id) const {
    for (const Iri predicate : {vocab::vom::numericalValue, Iri{"http://qudt.org/schema/qudt/numericValue"}, vocab::rdf_::value,
                                Iri{"http://www.w3.org/ns/sosa/hasSimpleResult"}, vocab::schema::value})
      if (const auto found = object(id, predicate)) return found;
    return std::nullopt;
  }

 private:
  /// By vom:unit and by QUDT.
  std::pair<std::string_view, std::string_view> unit_iris(TermId id) const {
    std::string_view vom, qudt;
    if (const auto found = object(id, vocab::vom::unit)) vom = graph_.term(*found).text;
    for (const Iri predicate : {vocab::qudt::hasUnit, Iri{"http://qudt.org/schema/qudt/unit"}})
      if (const auto found = object(id, predicate)) qudt = graph_.term(*found).text;
    return {vom, qudt};
  }

  std::optional<TermId> object(TermId subject, Iri predicate) const {
    const auto id = graph_.find(predicate);
    return id ? graph_.object(subject, *id) : std::nullopt;
  }

  /// A node of a value, not a link: a blank node, or a fragment of the value's document that the graph describes.
  bool is_inside(TermId id) const {
    const TermView term = graph_.term(id);
    const std::size_t hash = term.text.find('#');
    return term.is_blank() ||
           (hash != std::string_view::npos && term.text.substr(0, hash) == document_ && !graph_.match(id, std::nullopt, std::nullopt).empty());
  }

  std::string resource(TermId id, unsigned depth) {
    if (const auto list = graph_.list(id)) {
      std::string text = "[";
      for (const TermId member : *list) text += (text.size() > 1 ? "," : "") + node(member, depth + 1);
      return text + "]";
    }
    if (const auto value = number(id)) {
      const std::string label = depth == 0 ? std::string() : unit(id);
      const std::string text = node(*value, depth + 1);
      return label.empty() ? text : "{\"value\":" + text + ",\"unit\":" + json_string(label) + "}";
    }
    if (const auto value = object(id, vocab::vom::quantityValue)) return node(*value, depth + 1);
    std::vector<std::pair<std::string, std::vector<TermId>>> members;
    for (const Triple& t : graph_.match(id, std::nullopt, std::nullopt)) {
      const std::string_view predicate = graph_.term(t.predicate).text;
      if (describes_resource(predicate)) continue;
      const auto known = std::find_if(members.begin(), members.end(), [&](const auto& m) { return m.first == predicate; });
      if (known != members.end()) known->second.push_back(t.object);
      else members.emplace_back(predicate, std::vector{t.object});
    }
    if (members.empty() && depth == 0) return "null";  // it has no value at present
    if (members.empty() && !is_inside(id)) return json_string(graph_.term(id).text);
    std::string text = "{";
    for (const auto& [predicate, objects] : members) {
      const std::string_view name = local_name(predicate);
      const auto same = [&](const auto& m) { return local_name(m.first) == name; };
      const bool is_unique = std::count_if(members.begin(), members.end(), same) == 1;
      const Result<std::string> decoded = iri::decode(name);
      text += (text.size() > 1 ? "," : "") + json_string(!is_unique ? std::string(predicate) : decoded ? *decoded : std::string(name)) + ":";
      if (objects.size() == 1) {
        text += node(objects.front(), depth + 1);
        continue;
      }
      text += '[';
      for (std::size_t i = 0; i < objects.size(); ++i) text += (i == 0 ? "" : ",") + node(objects[i], depth + 1);
      text += ']';
    }
    return text + "}";
  }

  std::string literal(const TermView& term) const {
    const auto is_one_of = [&](std::initializer_list<Iri> all) {
      return std::any_of(all.begin(), all.end(), [&](Iri one) { return one.text == term.datatype; });
    };
    namespace xsd = vocab::xsd;
    if (is_one_of({xsd::double_, xsd::decimal}))
      if (const auto number = rdf::lexical::parse_double(term.text)) return json_of(*number);
    if (is_one_of({xsd::float_}))
      if (const auto number = rdf::lexical::parse_double(term.text)) {
        const Result<std::string> text =
            rdf::write_plain(rdf::traits<float>::type(), {}, rdf::Value(static_cast<double>(static_cast<float>(*number))), rdf::Plain::json);
        if (text) return *text;
      }
    if (rdf::lexical::is_integer_type(rdf::lexical::datatype_of(term.datatype))) {
      std::string_view digits = term.text;
      const bool negative = !digits.empty() && digits.front() == '-';
      if (!digits.empty() && (digits.front() == '-' || digits.front() == '+')) digits.remove_prefix(1);
      while (digits.size() > 1 && digits.front() == '0') digits.remove_prefix(1);
      if (!digits.empty() && digits.find_first_not_of("0123456789") == std::string_view::npos) return (negative ? "-" : "") + std::string(digits);
    }
    if (is_one_of({xsd::boolean})) return term.text == "true" || term.text == "1" ? "true" : "false";
    return json_string(term.text);
  }

  const Graph& graph_;
  std::string_view document_;  // of the value
  std::size_t members_ = 0;
  std::set<TermId> open_;  // nodes that are being read: a graph may have cycles
};

/// Up to six digits after the point, or six in all of a number below one; no zeros at the end.
std::string few_digits(double number) {
  char text[400];
  if (number == 0) return "0";
  const double size = std::abs(number);
  constexpr double largest = 1e15, smallest = 1e-4;
  if (size >= largest || size < smallest) {
    std::snprintf(text, sizeof text, "%.6g", number);
    return text;
  }
  const int digits = size >= 1 ? 6 : 5 - static_cast<int>(std::floor(std::log10(size)));
  std::snprintf(text, sizeof text, "%.*f", digits, number);
  std::string result = text;
  result.erase(result.find_last_not_of('0') + 1);
  if (result.back() == '.') result.pop_back();
  return result == "-0" ? "0" : result;
}

std::string number_text(double number) {
  std::string text = json_of(number);
  return unquoted(text);
}

std::string media_type_of_name(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  const std::string_view suffix = dot == std::string_view::npos ? std::string_view() : name.substr(dot + 1);
  constexpr std::pair<std::string_view, std::string_view> known[] = {
      {"ttl", "text/turtle"},       {"nt", "application/n-triples"}, {"rdf", "application/rdf+xml"},     {"jsonld", "application/ld+json"},
      {"json", "application/json"}, {"cbor", "application/cbor"},    {"bin", "application/octet-stream"}};
  for (const auto& [end, type] : known)
    if (suffix == end) return std::string(type);
  return {};
}

/// Whether the bytes of a file of that media type are a text, which an editor may have begun with a byte order mark.
bool is_text(std::string_view media_type) {
  if (media_type.empty() || media_type.substr(0, 5) == "text/") return true;
  const std::string_view type = media_type.substr(0, media_type.find(';'));
  return type.find("json") != std::string_view::npos || rdf::syntax_of(type).has_value();
}

std::string trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1));
}

}  // namespace

std::string PlainValue::line() const { return printable(text); }

std::string PlainValue::for_people() const {
  const bool is_text = !json.empty() && json.front() == '"' && text != json;
  return is_text ? line() : printable(readable(json));
}

namespace {

/// A value of JSON. Numbers, texts and the other names are kept as they are written.
struct JsonNode {
  char kind = 0;  ///< '{', '[', or 0: neither
  std::string text{};
  std::vector<std::pair<std::string, JsonNode>> members{};
};

class JsonReader {
 public:
  explicit JsonReader(std::string_view text) : text_(text) {}
  std::optional<JsonNode> read() {
    std::optional<JsonNode> node = value(0);
    skip();
    return at_ == text_.size() ? std::move(node) : std::nullopt;
  }

 private:
  void skip() { at_ = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size()); }
  bool take(char c) {
    skip();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  std::optional<std::string> string() {
    skip();
    const std::size_t begin = at_;
    if (!take('"')) return std::nullopt;
    while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    if (at_ >= text_.size()) return std::nullopt;
    ++at_;
    return std::string(text_.substr(begin, at_ - begin));
  }
  std::optional<JsonNode> value(unsigned depth) {
    constexpr unsigned deepest = 64;
    skip();
    if (at_ >= text_.size() || depth > deepest) return std::nullopt;
    JsonNode node;
    const char first = text_[at_];
    if (first == '"') {
      std::optional<std::string> text = string();
      if (!text) return std::nullopt;
      node.text = *std::move(text);
      return node;
    }
    if (first != '{' && first != '[') {
      const std::size_t end = std::min(text_.find_first_of(",]} \t\r\n", at_), text_.size());
      node.text = text_.substr(at_, end - at_);
      if (node.text.empty()) return std::nullopt;
      at_ = end;
      return node;
    }
    node.kind = first;
    const char last = first == '{' ? '}' : ']';
    ++at_;
    if (take(last)) return node;
    do {
      std::string name;
      if (first == '{') {
        const std::optional<std::string> key = string();
        if (!key || !take(':')) return std::nullopt;
        name = unquoted(*key);
      }
      std::optional<JsonNode> member = value(depth + 1);
      if (!member) return std::nullopt;
      node.members.emplace_back(std::move(name), *std::move(member));
    } while (take(','));
    return take(last) ? std::optional<JsonNode>(std::move(node)) : std::nullopt;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

/// {"value": ..., "unit": ...}
bool has_unit(const JsonNode& node) {
  return node.kind == '{' && node.members.size() == 2 && node.members[0].first == "value" && node.members[1].first == "unit" &&
         node.members[1].second.kind == 0;
}

std::string scalar(const std::string& text) {
  const bool is_real = !text.empty() && text.front() != '"' && text.find_first_of(".eE") != std::string::npos;
  const std::optional<double> number = is_real ? rdf::lexical::parse_double(text) : std::nullopt;
  if (number && std::isfinite(*number)) return few_digits(*number);
  return text == "-0" ? "0" : text;
}

/// {"stop": {}}, an alternative without content
bool is_only_a_name(const JsonNode& node) {
  return node.kind == '{' && node.members.size() == 1 && node.members[0].second.kind == '{' && node.members[0].second.members.empty();
}

std::string in_line(const JsonNode& node, bool is_inside) {
  if (node.kind == 0) return scalar(node.text);
  if (has_unit(node)) return in_line(node.members[0].second, true) + " " + unquoted(node.members[1].second.text);
  std::string text;
  for (const auto& [name, member] : node.members)
    text += (text.empty() ? "" : ", ") + (node.kind == '{' ? name + ": " : std::string()) + in_line(member, true);
  if (node.kind == '[') return "[" + text + "]";
  if (is_only_a_name(node)) text = node.members.front().first;
  return is_inside || text.empty() ? "{" + text + "}" : text;
}

void add_lines(const JsonNode& node, std::size_t indent, std::string& text) {
  constexpr std::size_t longest = 60;
  std::size_t width = 0;
  for (const auto& [name, member] : node.members) width = std::max(width, columns_of(name));
  for (const auto& [name, member] : node.members) {
    text += std::string(indent, ' ') + name;
    const std::string line = in_line(member, false);
    const bool is_short = member.kind == 0 || member.members.empty() || has_unit(member) || columns_of(line) <= longest || member.kind == '[';
    if (is_short) {
      text += std::string(width - columns_of(name) + 2, ' ') + line + "\n";
    } else {
      text += "\n";
      add_lines(member, indent + 2, text);
    }
  }
}

}  // namespace

std::string readable(std::string_view json) {
  const std::optional<JsonNode> node = JsonReader(json).read();
  return node ? in_line(*node, false) : std::string(json);
}

std::string readable_lines(std::string_view json) {
  const std::optional<JsonNode> node = JsonReader(json).read();
  if (!node) return std::string(json);
  if (node->kind != '{' || node->members.empty() || has_unit(*node) || is_only_a_name(*node)) return in_line(*node, false);
  std::string text;
  add_lines(*node, 0, text);
  text.pop_back();
  return text;
}

PlainValue value_at(const Graph& graph, TermId node, const client::Schema* schema) {
  PlainValue result;
  Reader reader(graph);
  if (schema) {
    if (const Result<rdf::Value> value = schema->read_value(graph, node)) {
      const Type& type = schema->type();
      const bool nested = type.kind == Type::Kind::record || type.kind == Type::Kind::map || type.kind == Type::Kind::variant;
      const Result<std::string> json =
          rdf::write_plain(type, nested ? schema->facets() : rdf::Facets(), *value, nested ? rdf::Plain::json_with_units : rdf::Plain::json);
      if (json) {
        result.json = printable_json(*json);
        if (const double* real = value->real()) result.number = *real;
        if (const std::int64_t* integer = value->integer(); integer && type.kind == Type::Kind::integer)
          result.number = static_cast<double>(*integer);
        if (const std::string* text = value->text()) result.text = printable_lines(*text);
        if (!nested) {
          const lrt::Unit& unit = schema->facets().unit();
          result.unit = printable(client::unit_label(unit));
          result.unit_iri = printable((unit.qudt.empty() ? unit.vom : unit.qudt).text);
        }
      }
    }
  }
  if (result.json.empty()) {
    result.json = printable_json(reader.node(node, 0));
    if (const auto number = graph.term(node).is_literal() ? std::optional(node) : reader.number(node)) {
      const TermView term = graph.term(*number);
      if (term.is_literal() && result.json.front() != '"') result.number = rdf::lexical::parse_double(term.text);
      else if (term.is_literal()) result.text = printable_lines(term.text);
    }
  }
  if (result.unit.empty() && !graph.term(node).is_literal() && result.json.front() != '{') {
    result.unit = reader.unit(node);
    result.unit_iri = reader.unit_iri(node);
  }
  if (result.text.empty() && result.json != "null") result.text = unquoted(result.json);
  return result;
}

Result<PlainValue> converted(const PlainValue& value, const std::string& unit) {
  if (!value.number) {
    const char first = value.json.empty() ? 'n' : value.json.front();
    return unexpected(Errc::expected_value, "only numbers have units; found " + (first == '{'   ? std::string("a record")
                                                                                 : first == '[' ? std::string("a list")
                                                                                                : "\"" + value.text.substr(0, 100) + "\""));
  }
  const Result<double> number = client::convert(*value.number, value.unit, unit);
  if (!number) return unexpected(number.error());
  // Conversion by pi is exact to about 15 digits: 30 deg, not 30.000000000000004.
  char digits[40];
  std::snprintf(digits, sizeof digits, "%.15g", *number);
  const double shown = unit == value.unit ? *number : rdf::lexical::parse_double(digits).value_or(*number);
  // As it is written everywhere: "rad", also for "RAD".
  const Result<client::Quantity> named = client::parse_quantity("1 " + unit);
  return PlainValue{json_of(shown), number_text(shown), printable(named && !named->unit.empty() ? named->unit : unit), shown};
}

std::optional<client::Schema> schema_of(const Result<std::optional<client::Shape>>& shape) {
  if (!shape || !*shape) return std::nullopt;
  client::SchemaOptions options;
  options.stated_names = true;  // as in the server's JSON
  Result<client::Schema> schema = client::Schema::read((*shape)->graph, (*shape)->node, options);
  if (!schema || !schema->usable()) return std::nullopt;
  return *std::move(schema);
}

std::optional<client::Schema> schema_for_reading(const client::Property& property) {
  if (const client::Declared* const declared = property.declared(); declared && declared->is_simple) return std::nullopt;
  return schema_of(property.value_shape());
}

std::string bounds_of(const Type& type, const rdf::Facets& facets) {
  std::string text;
  if (const auto min = facets.min()) text += std::string(facets.min_exclusive() ? "above " : "from ") + number_text(*min);
  if (const auto max = facets.max()) text += (text.empty() ? "" : " ") + std::string(facets.max_exclusive() ? "below " : "to ") + number_text(*max);
  if (facets.min() && facets.max() && facets.max_exclusive()) text.insert(text.rfind("below"), "to ");
  if (facets.max_length() != std::numeric_limits<std::size_t>::max())
    text += (text.empty() ? "" : ", ") + std::string("at most ") + std::to_string(facets.max_length()) + " characters";
  if (type.kind == Type::Kind::list && (type.shortest > 0 || type.longest != std::numeric_limits<std::size_t>::max())) {
    text += text.empty() ? "" : ", ";
    if (type.shortest == type.longest) text += std::to_string(type.shortest) + " members";
    else if (type.longest == std::numeric_limits<std::size_t>::max()) text += "at least " + std::to_string(type.shortest) + " members";
    else text += std::to_string(type.shortest) + " to " + std::to_string(type.longest) + " members";
  }
  return text;
}

bool has_content(const Type& type) { return type.kind != Type::Kind::record || !type.fields.empty(); }

std::string name_of(const Type& type) {
  switch (type.kind) {
    case Type::Kind::boolean: return "true | false";
    case Type::Kind::integer: return "integer";
    case Type::Kind::real: return "number";
    case Type::Kind::text: return "text";
    case Type::Kind::duration: return "duration";
    case Type::Kind::instant: return "time";
    case Type::Kind::list: {
      const std::string element = type.element ? name_of(*type.element) : std::string("value");
      for (const char* const word : {"number", "integer", "text", "duration", "time", "value"})
        if (element == word) return "list of " + element + "s";
      return "list of " + (element.compare(0, 8, "list of ") == 0 ? "lists of " + element.substr(8) : element);
    }
    case Type::Kind::optional: return type.element ? name_of(*type.element) : "value";
    case Type::Kind::map: return "map to " + (type.element ? name_of(*type.element) : std::string("values"));
    case Type::Kind::enumeration: {
      std::string text;
      for (const std::string& name : type.names) {
        if (text.size() > 200) return text + " | ...";
        text += (text.empty() ? "" : " | ") + printable(name);
      }
      return text;
    }
    case Type::Kind::record: {
      std::string text = "{";
      for (const rdf::FieldType& field : type.fields) {
        if (text.size() > 200) return text + ", ...}";
        text += (text.size() > 1 ? ", " : "") + printable(field.name);
      }
      return text + "}";
    }
    case Type::Kind::variant: {
      std::string text;
      for (const rdf::FieldType& field : type.fields) {
        if (text.size() > 200) return text + " | ...";
        text += (text.empty() ? "" : " | ") + printable(field.name);
        if (!has_content(*field.type)) continue;
        const std::string content = name_of(*field.type);
        text += content.front() != '{' && content.find(" | ") != std::string::npos ? " (" + content + ")" : " " + content;
      }
      return text;
    }
  }
  return "value";
}

std::string description_of(const client::Schema& schema) {
  const Type* type = &schema.type();
  while (type->kind == Type::Kind::optional && type->element) type = type->element;
  const std::string unit = printable(client::unit_label(schema.facets().unit())), bounds = bounds_of(*type, schema.facets());
  const bool is_choice = type->kind == Type::Kind::enumeration || type->kind == Type::Kind::boolean || type->kind == Type::Kind::variant;
  std::string text = type->kind == Type::Kind::record    ? "a record " + name_of(*type)
                     : is_choice                         ? "one of " + name_of(*type)
                     : type->kind == Type::Kind::integer ? "an integer"
                                                         : "a " + name_of(*type);
  if (!unit.empty()) text += " in " + unit;
  if (!bounds.empty()) text += ", " + bounds;
  return text;
}

Result<Body> body_of(const std::string& argument, const std::string& media_type) {
  if (argument.substr(0, 2) == "@@") return Body{argument.substr(1), media_type};
  if (argument != "-" && (argument.empty() || argument.front() != '@')) return Body{argument, media_type};
  constexpr std::size_t max_bytes = 64 * 1024 * 1024;
  const std::string name = argument == "-" ? "standard input" : argument.substr(1);
  std::ifstream file;
  if (argument != "-") {
    file.open(name, std::ios::binary);
    if (!file) return unexpected(Errc::invalid_option, "cannot read \"" + name + "\": " + std::strerror(errno));
  }
  std::istream& in = argument == "-" ? std::cin : file;
  Body body{{}, media_type.empty() && argument != "-" ? media_type_of_name(name) : media_type};
  char buffer[65536];
  while (in.read(buffer, sizeof buffer), in.gcount() > 0) {
    body.bytes.append(buffer, static_cast<std::size_t>(in.gcount()));
    if (body.bytes.size() > max_bytes) return unexpected(Errc::invalid_option, "\"" + name + "\" has more than 64 MiB");
  }
  if (in.bad()) return unexpected(Errc::invalid_option, "cannot read \"" + name + "\"");
  if (is_text(body.media_type)) body.bytes.erase(0, body.bytes.size() - utf8::without_mark(body.bytes).size());
  if (body.media_type.empty() && !body.bytes.empty() && body.bytes.back() == '\n') body.bytes.pop_back();  // of echo
  return body;
}

namespace {

const Type& without_optional(const Type& outer) {
  const Type* type = &outer;
  while (type->kind == Type::Kind::optional && type->element) type = type->element;
  return *type;
}

bool looks_like_json(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  return begin != std::string::npos && (text[begin] == '{' || text[begin] == '[');
}

/// "30deg" in the unit of the facets. A text that is no number stays as it is.
Result<std::string> number_of(const std::string& text, const Type& type, const rdf::Facets& facets) {
  const Result<client::Quantity> quantity = client::parse_quantity(text);
  const bool is_number = text.find_first_of("0123456789") != std::string::npos && text.find_first_of("0123456789.+-") == 0;
  // Also with a unit that is not known: it is named, with those that would fit.
  if (!(quantity ? !quantity->unit.empty() : is_number)) return text;
  const Result<double> number = client::number_in(text, facets.unit());
  if (!number) return unexpected(number.error());
  const bool is_integer = type.kind == Type::Kind::integer && std::abs(*number) < 9e15 && *number == std::floor(*number);
  return is_integer ? std::to_string(static_cast<std::int64_t>(*number)) : number_text(*number);
}

Error no_such_alternative(const Type& variant, const std::string& tag) {
  std::vector<std::string> tags;
  std::string all;
  for (const rdf::FieldType& field : variant.fields) {
    tags.push_back(field.name);
    all += (all.empty() ? "" : ", ") + printable(field.name);
  }
  const std::string meant = did_you_mean(tag, tags);
  return {Errc::expected_value, "there is no alternative \"" + printable(tag) + "\"" + (meant.empty() ? "; expected one of " + all : meant)};
}

const rdf::FieldType* alternative_of(const Type& variant, std::string_view tag) {
  for (const rdf::FieldType& field : variant.fields)
    if (field.name == tag) return &field;
  return nullptr;
}

/// The JSON of a variant that is written as "TAG=VALUE", or as "TAG" if the alternative has no content.
Result<std::string> json_of_alternative(const Type& variant, const rdf::Facets& facets, const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string tag = trimmed(text.substr(0, equals)), content = equals == std::string::npos ? std::string() : trimmed(text.substr(equals + 1));
  const rdf::FieldType* const field = alternative_of(variant, tag);
  if (!field) return unexpected(no_such_alternative(variant, tag));
  const Type& type = without_optional(*field->type);
  std::string json = content;
  if (!has_content(type)) {
    if (!content.empty() && content != "{}")
      return unexpected(Errc::expected_value, "\"" + printable(tag) + "\" has no content, found \"" + printable(content) + "\"");
    json = "{}";
  } else if (content.empty() && type.kind != Type::Kind::text) {
    return unexpected(Errc::expected_value, "\"" + printable(tag) + "\" needs a value: " + printable(tag) + "=VALUE, " + name_of(type));
  } else if (type.kind == Type::Kind::text || type.kind == Type::Kind::enumeration || type.kind == Type::Kind::duration ||
             type.kind == Type::Kind::instant) {
    json = json_string(content);
  } else if (type.is_number()) {
    const Result<std::string> number = number_of(content, type, rdf::field_facets(*field, facets));
    if (!number) return unexpected(number.error());
    json = JsonReader(*number).read() ? *number : json_string(*number);
  }
  return "{" + json_string(tag) + ":" + json + "}";
}

/// The first alternative that a variant within the type does not have.
std::optional<Error> unknown_alternative(const Type& outer, const JsonNode& node) {
  const Type& type = without_optional(outer);
  if (type.kind == Type::Kind::variant && node.kind == '{')
    for (const auto& [name, member] : node.members)
      if (!alternative_of(type, name)) return no_such_alternative(type, name);
  const bool has_fields = type.kind == Type::Kind::variant || type.kind == Type::Kind::record;
  const bool has_members = (type.kind == Type::Kind::list && node.kind == '[') || (type.kind == Type::Kind::map && node.kind == '{');
  for (const auto& [name, member] : node.members) {
    const rdf::FieldType* const field = has_fields && node.kind == '{' ? alternative_of(type, name) : nullptr;
    const Type* const inner = field ? field->type : has_members ? type.element : nullptr;
    if (!inner) continue;
    if (std::optional<Error> found = unknown_alternative(*inner, member)) return found;
  }
  return std::nullopt;
}

std::string names_of(const Type& record) {
  std::string names;
  for (const rdf::FieldType& field : record.fields) names += (names.empty() ? "\"" : ", \"") + field.name + '"';
  return names;
}

/// Whether a text is one value in JSON.
bool is_json(const std::string& text) { return rdf::json::Document::parse(text, {max_members, max_depth, true}).has_value(); }

/// The JSON of a part of a value.
Result<std::string> json_of_part(const std::string& name, const std::string& text, const Type& outer, const rdf::Facets& facets) {
  const Type& type = without_optional(outer);
  if (text == "null" && type.kind != Type::Kind::text) return text;
  if (type.is_number()) {
    const Result<double> number = client::number_in(trimmed(text), facets.unit());
    if (!number) return unexpected(Errc::expected_value, name + ": " + number.error().message);
    // All digits of a large integer.
    const bool has_unit = trimmed(text).find_first_not_of("-0123456789") != std::string::npos;
    return !has_unit && is_json(trimmed(text)) ? trimmed(text) : json_of(*number);
  }
  if (type.kind == Type::Kind::variant && !looks_like_json(text)) {
    Result<std::string> json = json_of_alternative(type, facets, text);
    if (!json) return unexpected(json.error().code, name + ": " + json.error().message);
    // The alternative that is active now is left: a patch keeps what it does not name.
    const std::string tag = trimmed(text.substr(0, text.find('=')));
    for (const rdf::FieldType& other : type.fields)
      if (other.name != tag) json->insert(json->size() - 1, "," + json_string(other.name) + ":null");
    return json;
  }
  const bool may_be_json = type.kind == Type::Kind::boolean || type.kind == Type::Kind::list || type.kind == Type::Kind::map || !type.fields.empty();
  return may_be_json && is_json(text) ? text : json_string(text);
}

/// Changes of parts, and of their parts.
struct PartTree {
  std::vector<std::pair<std::string, PartTree>> members;
  std::string json;  ///< of a leaf

  std::string text() const {
    if (members.empty()) return json;
    std::string out;
    for (const auto& [name, part] : members) out += (out.empty() ? "{" : ",") + json_string(name) + ":" + part.text();
    return out + "}";
  }
};

}  // namespace

bool is_change(std::string_view word) noexcept {
  const std::size_t equals = word.find('=');
  return equals != std::string_view::npos && equals > 0 && word.substr(0, equals).find_first_of("{}[]\"'<>@:/ \t\n") == std::string_view::npos;
}

Result<client::Patch> patch_of(const std::vector<std::string>& changes, const std::optional<client::Schema>& schema) {
  PartTree whole;
  for (const std::string& change : changes) {
    const std::size_t equals = change.find('=');
    if (!is_change(change)) return unexpected(Errc::invalid_option, "expected FIELD=VALUE, such as position=0.1, found \"" + change + "\"");
    const std::string way = change.substr(0, equals), text = change.substr(equals + 1);
    if (!schema) return unexpected(Errc::expected_value, "the property publishes no shape that says which fields it has; set its whole value");
    const Type* type = &without_optional(schema->type());
    rdf::Facets facets = schema->facets();
    PartTree* part = &whole;
    for (std::size_t at = 0; at <= way.size();) {
      const std::size_t end = std::min(way.find('.', at), way.size());
      const std::string name = way.substr(at, end - at);
      at = end + 1;
      if (type->kind == Type::Kind::map) {
        type = &without_optional(*type->element);
      } else {
        const auto field = std::find_if(type->fields.begin(), type->fields.end(), [&](const rdf::FieldType& f) { return f.name == name; });
        if (type->fields.empty())
          return unexpected(Errc::expected_value, "\"" + way + "\": the value has no fields; it is a " + lrt::tool::name_of(*type));
        if (field == type->fields.end())
          return unexpected(Errc::expected_value, "\"" + way + "\": there is no field \"" + name + "\", only " + names_of(*type));
        facets = rdf::field_facets(*field, facets);
        type = &without_optional(*field->type);
      }
      const auto known = std::find_if(part->members.begin(), part->members.end(), [&](const auto& m) { return m.first == name; });
      if (known != part->members.end() && (end == way.size() || known->second.members.empty()))
        return unexpected(Errc::invalid_option, "\"" + way + "\" is given twice");
      part = known != part->members.end() ? &known->second : &part->members.emplace_back(name, PartTree()).second;
    }
    Result<std::string> json = json_of_part(way, text, *type, facets);
    if (!json) return unexpected(std::move(json).error());
    part->json = *std::move(json);
  }
  return client::Patch::from_json(whole.text());
}

std::string lacks_members(const Body& body, const client::Schema& schema, const std::string& name) {
  if (!body.media_type.empty() && body.media_type.find("application/json") != 0) return {};
  const Type& type = without_optional(schema.type());
  if (type.kind != Type::Kind::record) return {};
  constexpr std::size_t max_values = 100'000;
  const auto document = rdf::json::Document::parse(body.bytes, {max_values, max_depth, true});
  if (!document || document->kind(document->root()) != rdf::json::Document::Kind::object) return {};
  const auto is_field = [&](std::string_view key) {
    return std::any_of(type.fields.begin(), type.fields.end(), [&](const rdf::FieldType& field) { return field.name == key; });
  };
  for (const auto member : rdf::json::Children(*document, document->root()))
    if (!is_field(document->key(member))) return {};  // which is said of it
  constexpr std::size_t max_shown = 10;
  std::size_t missing = 0, present = 0;
  std::string names, example;
  for (const rdf::FieldType& field : type.fields) {
    const bool is_there = document->member(document->root(), field.name) != rdf::json::Document::none;
    if (is_there && present++ == 0) example = field.name;
    if (is_there || field.absent || field.type->kind == Type::Kind::optional) continue;
    if (++missing <= max_shown) names += (names.empty() ? "\"" : ", \"") + field.name + '"';
  }
  if (missing == 0 || present == 0) return {};
  if (missing > max_shown) names += " and " + std::to_string(missing - max_shown) + " more";
  return "the value lacks " + names + "; to change a part of it and keep the rest: lrt set " + name + " " + example + "=...";
}

Result<Input> input_of(const Body& body, const std::string& url, const std::optional<client::Schema>& schema) {
  MediaType media_type{"text", "plain", {}};
  if (!body.media_type.empty()) {
    const std::string type = body.media_type.substr(0, body.media_type.find(';'));
    if (const std::optional<rdf::Syntax> syntax = rdf::syntax_of(type)) {
      rdf::ReadOptions options;
      options.base = url;
      Result<Graph> graph = rdf::read(body.bytes, *syntax, options);
      if (!graph) {
        const Error& error = graph.error();
        const bool says_where = error.line == 0 || error.message.compare(0, 5, "line ") == 0;
        return unexpected(Errc::expected_value, (says_where ? std::string() : "line " + std::to_string(error.line) + ": ") + error.message);
      }
      const std::optional<TermId> focus = client::find_focus(*graph, url);
      if (!focus) return unexpected(Errc::expected_value, "it is not clear which node of the body is the value; write it as <>");
      return Input{*std::move(graph), *focus};
    }
    const Result<MediaType> parsed = MediaType::parse(type);
    if (!parsed || !rdf::plain_of(*parsed))
      return unexpected(Errc::invalid_option,
                        "\"" + type + "\" is neither RDF nor a plain value; expected text/turtle, application/json, text/plain ...");
    media_type = *parsed;
  }
  if (!schema) {
    return unexpected(
        Errc::expected_value,
        "\"" + url + "\" publishes no shape, and has no value at present, that would say what a plain value means; give RDF, such as @value.ttl");
  }
  std::string bytes = body.bytes;
  const Type* const type = &without_optional(schema->type());
  const rdf::Facets& facets = schema->facets();
  if (body.media_type.empty() && looks_like_json(bytes) && type->kind != Type::Kind::text) media_type = {"application", "json", {}};
  if (media_type.type == "text" && (type->is_number() || type->kind == Type::Kind::variant)) {
    const bool is_number = type->is_number();
    Result<std::string> text = is_number ? number_of(trimmed(bytes), *type, facets) : json_of_alternative(*type, facets, trimmed(bytes));
    if (!text) return unexpected(std::move(text).error());
    bytes = *std::move(text);
    if (!is_number) media_type = {"application", "json", {}};
  }
  if (media_type.subtype == "json")
    if (const std::optional<JsonNode> node = JsonReader(bytes).read())
      if (const std::optional<Error> unknown = unknown_alternative(*type, *node)) return unexpected(*unknown);
  Input input;
  input.focus = input.graph.intern(rdf::iri(url));
  if (Result<void> written = schema->write_plain_value(input.graph, input.focus, bytes, media_type); !written) {
    Error error = std::move(written).error();
    if (error.message.find("expected") == std::string::npos) error.message = "expected " + description_of(*schema) + ": " + error.message;
    return unexpected(Errc::expected_value, std::move(error.message));
  }
  return input;
}

}  // namespace lrt::tool
