// SPDX-License-Identifier: Apache-2.0
#include "src/client/constraints.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/base/quote.hpp"

namespace lrt::client {

namespace sh = vocab::sh;
using rdf::TermId;
using rdf::TermView;

static constexpr std::string_view sh_namespace = "http://www.w3.org/ns/shacl#";

void refuse_shape(Errc code, std::string message) { throw RefusedShape{{code, std::move(message)}}; }

void ShapeReader::ill_formed(TermId shape, std::string_view predicate, TermId object, const std::string& expected) const {
  refuse_shape(Errc::expected_value, "expected " + expected + " as " + shortened(rdf::abbreviate(predicate)) + " of the shape " +
                                         shown(graph_.term(shape)) + ", found " + shown(graph_.term(object)));
}

std::size_t ShapeReader::count(TermId shape, const rdf::Triple& t) const {
  const TermView term = graph_.term(t.object);
  const auto n = term.is_literal() ? rdf::lexical::parse_uint64(term.text) : std::nullopt;
  // A count beyond 64 bits is treated as unlimited.
  if (!n && term.is_literal() && rdf::lexical::is_integer(term.text) && term.text.front() != '-') return std::numeric_limits<std::size_t>::max();
  if (!n) ill_formed(shape, graph_.term(t.predicate).text, t.object, "a count");
  return static_cast<std::size_t>(std::min<std::uint64_t>(*n, std::numeric_limits<std::size_t>::max()));
}

std::vector<TermId> ShapeReader::list(TermId shape, const rdf::Triple& t) const {
  auto members = graph_.list(t.object);
  if (!members) ill_formed(shape, graph_.term(t.predicate).text, t.object, "an RDF list");
  return *std::move(members);
}

std::string ShapeReader::text_of(TermId shape, const rdf::Triple& t, const char* expected, bool is_iri) const {
  const TermView term = graph_.term(t.object);
  if (is_iri ? !term.is_iri() : !term.is_literal()) ill_formed(shape, graph_.term(t.predicate).text, t.object, expected);
  if (term.text.size() > options_.max_text)
    refuse_shape(Errc::limit_exceeded,
                 "a text of more than " + std::to_string(options_.max_text) + " bytes at the shape " + shown(graph_.term(shape)));
  return std::string(term.text);
}

TermId ShapeReader::node_of(TermId shape, const rdf::Triple& t) const {
  if (graph_.term(t.object).is_literal()) ill_formed(shape, graph_.term(t.predicate).text, t.object, "a shape");
  return t.object;
}

TermId ShapeReader::bound(TermId shape, const rdf::Triple& t) const {
  if (!graph_.term(t.object).is_literal()) ill_formed(shape, graph_.term(t.predicate).text, t.object, "a literal");
  return t.object;
}

bool ShapeReader::is_rests(TermId path) const {
  const auto p = graph_.find(sh::zeroOrMorePath);
  const auto inner = p ? graph_.object(path, *p) : std::nullopt;
  return inner && graph_.term(*inner) == TermView(vocab::rdf_::rest);
}

bool ShapeReader::is_members(TermId path) const {
  const auto parts = graph_.list(path);
  return parts && parts->size() == 2 && is_rests((*parts)[0]) && graph_.term((*parts)[1]) == TermView(vocab::rdf_::first);
}

void ShapeReader::count_shape() {
  if (++visited_ > options_.max_shapes) refuse_shape(Errc::limit_exceeded, "more than " + std::to_string(options_.max_shapes) + " shapes");
}

void ShapeReader::gather(TermId shape, Constraints& c, std::size_t depth) {
  if (std::find(c.shapes.begin(), c.shapes.end(), shape) != c.shapes.end()) return;
  count_shape();
  if (depth > options_.max_depth)
    refuse_shape(Errc::limit_exceeded, "sh:node and sh:and nested more than " + std::to_string(options_.max_depth) + " deep");
  if (const auto off = graph_.object(graph_.term(shape), TermView(sh::deactivated)); off && off->text == "true") return;
  c.shapes.push_back(shape);
  for (const rdf::Triple& t : graph_.match(shape, std::nullopt, std::nullopt)) {
    const std::string_view predicate = graph_.term(t.predicate).text;
    if (predicate.substr(0, sh_namespace.size()) != sh_namespace) continue;
    const auto is = [&](Iri term) { return predicate == term.text; };
    if (is(sh::property)) property(node_of(shape, t), c);
    else if (is(sh::node)) gather(node_of(shape, t), c, depth + 1);
    else if (is(sh::and_)) {
      for (const TermId part : list(shape, t)) gather_part(part, c, depth + 1);
    } else if (is(sh::or_)) c.alternatives.push_back(list(shape, t));
    else if (is(sh::xone)) c.exclusive.push_back(list(shape, t));
    else if (is(sh::class_)) add_class(c.classes, shape, t);
    else if (is(sh::targetClass)) add_class(c.target_classes, shape, t);
    else if (is(sh::datatype)) c.datatypes.push_back(text_of(shape, t, "an IRI", true));
    else if (is(sh::nodeKind)) c.node_kind = text_of(shape, t, "an IRI", true);
    else if (is(sh::in_)) c.one_of.push_back(t.object);
    else if (is(sh::hasValue)) {
      if (std::find(c.exactly.begin(), c.exactly.end(), t.object) == c.exactly.end()) c.exactly.push_back(t.object);
    } else if (is(sh::defaultValue)) c.with_default.push_back(shape);
    else if (is(sh::minCount)) c.min_count = std::max(c.min_count, count(shape, t));
    else if (is(sh::maxCount)) c.max_count = std::min(c.max_count, count(shape, t));
    else if (is(sh::minLength)) c.min_length = std::max(c.min_length, count(shape, t));
    else if (is(sh::maxLength)) c.max_length = std::min(c.max_length, count(shape, t));
    else if (is(sh::minInclusive) || is(sh::minExclusive)) c.lower.push_back({is(sh::minExclusive), bound(shape, t)});
    else if (is(sh::maxInclusive) || is(sh::maxExclusive)) c.upper.push_back({is(sh::maxExclusive), bound(shape, t)});
    else if (is(sh::pattern)) c.patterns.push_back(text_of(shape, t, "a text", false));
    else if (is(sh::name)) add_name(c, shape, t);
    else if (predicate == "http://www.w3.org/ns/shacl#order") c.order = rdf::lexical::parse_double(graph_.term(t.object).text).value_or(0);
    else if (is(sh::not_) || is(sh::equals) || is(sh::disjoint) || is(sh::lessThan) || is(sh::lessThanOrEquals) || is(sh::qualifiedValueShape) ||
             is(sh::languageIn) || is(sh::sparql) || is(sh::js) || is(sh::expression))
      c.others.push_back(rdf::abbreviate(predicate));
    else if ((is(sh::closed) || is(sh::uniqueLang)) && graph_.term(t.object).text == "true") c.others.push_back(rdf::abbreviate(predicate));
  }
}

void ShapeReader::gather_part(TermId shape, Constraints& c, std::size_t depth) {
  if (const auto path = graph_.find(sh::path); path && graph_.object(shape, *path)) property(shape, c);
  else gather(shape, c, depth);
}

void ShapeReader::add_class(std::vector<std::string>& classes, TermId shape, const rdf::Triple& t) const {
  std::string iri = text_of(shape, t, "an IRI", true);
  if (std::find(classes.begin(), classes.end(), iri) != classes.end()) return;
  if (classes.size() >= options_.max_names) refuse_shape(Errc::limit_exceeded, "more than " + std::to_string(options_.max_names) + " classes");
  if (iri::is_absolute(iri)) classes.push_back(std::move(iri));
}

void ShapeReader::add_name(Constraints& c, TermId shape, const rdf::Triple& t) const {
  if (graph_.term(t.object).is_literal() && graph_.term(t.object).language.empty()) c.names.push_back(text_of(shape, t, "a text", false));
}

void ShapeReader::property(TermId p, Constraints& c) {
  count_shape();
  const auto path_term = graph_.find(sh::path);
  const auto path = path_term ? graph_.object(p, *path_term) : std::nullopt;
  if (!path) refuse_shape(Errc::expected_value, "expected sh:path at the property shape " + shown(graph_.term(p)));
  if (graph_.term(*path).is_literal()) ill_formed(p, sh::path.text, *path, "a path");
  if (is_members(*path)) return c.members.push_back(p);
  if (is_rests(*path)) return c.cells.push_back(p);
  const TermView term = graph_.term(*path);
  if (!term.is_iri()) {
    warn_("a path of more than one predicate is not part of the type");
    return;
  }
  if (term.text.size() > options_.max_text)
    refuse_shape(Errc::limit_exceeded, "a predicate of more than " + std::to_string(options_.max_text) + " bytes");
  if (!iri::is_absolute(term.text)) refuse_shape(Errc::expected_value, "expected an absolute IRI as sh:path, found " + shown(term));
  for (Field& f : c.fields) {
    if (f.predicate != term.text) continue;
    if (std::find(f.shapes.begin(), f.shapes.end(), p) == f.shapes.end()) f.shapes.push_back(p);
    return;
  }
  if (c.fields.size() >= options_.max_fields)
    refuse_shape(Errc::limit_exceeded, "more than " + std::to_string(options_.max_fields) + " properties of one shape");
  c.fields.push_back({std::string(term.text), {p}});
}

Constraints ShapeReader::constraints_of(const std::vector<TermId>& shapes) {
  Constraints c;
  for (const TermId s : shapes) gather(s, c, 0);
  return c;
}

}  // namespace lrt::client
