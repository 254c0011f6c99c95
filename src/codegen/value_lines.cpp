// SPDX-License-Identifier: Apache-2.0
#include "src/codegen/value_lines.hpp"

#include <algorithm>
#include <limits>

#include <lrt/base/iri.hpp>
#include <lrt/client/units.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>

namespace lrt::codegen {

using rdf::Facets;
using rdf::FieldType;
using rdf::Type;
using Kind = Type::Kind;

std::string decoded_last_part(std::string_view iri) {
  while (iri.size() > 1 && (iri.back() == '/' || iri.back() == '#')) iri.remove_suffix(1);
  const std::string part(iri.substr(iri.find_last_of("#/:") + 1));
  Result<std::string> decoded = iri::decode(part);
  return decoded ? *std::move(decoded) : part;
}

std::string origin_of(std::string_view iri) {
  const iri::Parts parts = iri::split(iri);
  return std::string(parts.scheme) + "://" + std::string(parts.authority);
}

namespace {

/// "[3]", "[2..5]", "[2..]"
std::string length_of(const Type& list) {
  if (list.shortest == list.longest) return "[" + std::to_string(list.shortest) + "]";
  if (list.longest == std::numeric_limits<std::size_t>::max()) return list.shortest == 0 ? "" : "[" + std::to_string(list.shortest) + "..]";
  return "[" + std::to_string(list.shortest) + ".." + std::to_string(list.longest) + "]";
}

}  // namespace

void ValueLines::add(const std::string& path, const Type& type, const Facets& facets, Lines& lines) const {
  std::string text;
  const Type* t = &type;
  for (; t->kind == Kind::optional || t->kind == Kind::list || t->kind == Kind::map; t = t->element) {
    if (t->kind == Kind::optional) text += "optional ";
    else if (t->kind == Kind::map) text += "map of ";
    else text += "list" + length_of(*t) + " of ";
  }
  lines.emplace_back(path, text + one(*t, facets));
  if (t->kind != Kind::record && t->kind != Kind::variant) return;
  std::vector<const FieldType*> fields;
  for (const FieldType& f : t->fields) fields.push_back(&f);
  // Alternatives have an index in C++.
  if (t->kind == Kind::record) std::sort(fields.begin(), fields.end(), [](const auto* a, const auto* b) { return a->predicate < b->predicate; });
  for (const FieldType* f : fields) add(path + (path.empty() ? "" : " ") + short_iri(f->predicate), *f->type, rdf::field_facets(*f, facets), lines);
}

std::string ValueLines::text(const Type& type, const Facets& facets) const {
  Lines lines;
  add({}, type, facets, lines);
  std::string all;
  for (const auto& [path, line] : lines) all += std::to_string(path.size()) + ":" + path + "=" + line + "\n";
  return all;
}

std::string ValueLines::short_iri(std::string_view iri) const {
  if (!origin_.empty() && iri.size() > origin_.size() && iri.substr(0, origin_.size()) == origin_ && iri[origin_.size()] == '/')
    return "~" + std::string(iri.substr(origin_.size()));
  const std::string prefixed = rdf::abbreviate(iri);
  return prefixed.front() == '<' ? std::string(iri) : prefixed;
}

std::string ValueLines::one(const Type& t, const Facets& f) const {
  std::string text;
  switch (t.kind) {
    case Kind::record:
    case Kind::variant: {
      text = t.kind == Kind::record ? "record" : "one of";
      std::vector<std::string> classes;
      for (const std::string& c : t.classes) classes.push_back(short_iri(c));
      std::sort(classes.begin(), classes.end());
      for (const std::string& c : classes) text += " " + c;
      if (!t.value_predicate.empty()) text += " by " + short_iri(t.value_predicate);
      for (const std::string& c : t.value_classes) text += " " + short_iri(c);
      break;
    }
    case Kind::enumeration:
      text = "one of";
      for (const std::string& name : t.names) text += " \"" + name + "\"";
      return text;
    default: text = short_iri(t.datatype.text);
  }
  if (!f.unit().empty())
    text += " [" + client::unit_label(f.unit()) + " " + short_iri((f.unit().qudt.empty() ? f.unit().vom : f.unit().qudt).text) + "]";
  return text + range_of(t, f);
}

std::string ValueLines::range_of(const Type& t, const Facets& f) const {
  std::string text;
  if (t.kind == Kind::text && f.min_length() > 0) text += ", at least " + std::to_string(f.min_length()) + " characters";
  if (t.kind == Kind::text && f.max_length() != std::numeric_limits<std::size_t>::max())
    text += ", at most " + std::to_string(f.max_length()) + " characters";
  if (!bounds_ || !t.is_number()) return text;
  if (f.min()) text += (f.min_exclusive() ? ", above " : ", at least ") + rdf::lexical::format(*f.min());
  if (f.max()) text += (f.max_exclusive() ? ", below " : ", at most ") + rdf::lexical::format(*f.max());
  return text;
}

}  // namespace lrt::codegen
