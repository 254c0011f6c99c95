// SPDX-License-Identifier: Apache-2.0
#include "src/shacl/messages.hpp"

#include <algorithm>
#include <vector>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/utf8.hpp"
#include "src/rdf/integer_range.hpp"
#include "src/rdf/shown.hpp"
#include "src/shacl/plan.hpp"
#include "src/shacl/run.hpp"

namespace lrt::shacl {
inline namespace v0 {
namespace {

namespace sh = vocab::sh;
namespace xsd = vocab::xsd;

/// The only object of a predicate of a shape.
std::optional<rdf::TermId> object(const rdf::Graph& graph, rdf::TermId subject, Iri predicate) {
  const auto p = graph.find(predicate);
  if (!p) return std::nullopt;
  for (const rdf::Triple& t : graph.match(subject, *p, std::nullopt)) return t.object;
  return std::nullopt;
}

/// Its sh:name: the one without a language, which is the name in JSON, else the first.
std::optional<rdf::TermId> name_of(const rdf::Graph& graph, rdf::TermId shape) {
  const auto p = graph.find(sh::name);
  std::optional<rdf::TermId> name;
  if (!p) return name;
  for (const rdf::Triple& t : graph.match(shape, *p, std::nullopt)) {
    const bool is_plain = graph.term(t.object).language.empty();
    if (!name || is_plain) name = t.object;
    if (is_plain) break;
  }
  return name;
}

std::vector<rdf::TermId> objects(const rdf::Graph& graph, rdf::TermId subject, Iri predicate) {
  std::vector<rdf::TermId> all;
  if (const auto p = graph.find(predicate))
    for (const rdf::Triple& t : graph.match(subject, *p, std::nullopt)) all.push_back(t.object);
  return all;
}

bool is(const rdf::Graph& graph, std::optional<rdf::TermId> id, Iri iri) { return id && graph.term(*id) == rdf::TermView(iri); }

/// An integer type of C++ in words; empty: another datatype.
std::string words_for_integer(rdf::lexical::Datatype datatype) {
  using rdf::lexical::Datatype;
  if (datatype < Datatype::long_ || datatype > Datatype::unsigned_byte) return {};
  if (datatype == Datatype::long_) return "an integer of at most 64 bits";
  const rdf::lexical::IntegerRange range = rdf::lexical::range_of(datatype);
  return "an integer from " + std::string(range.lowest) + " to " + std::string(range.highest);
}

std::string words_for(std::string_view datatype) {
  if (datatype == xsd::boolean.text) return "true or false";
  if (datatype == xsd::string.text) return "a text";
  if (datatype == xsd::double_.text || datatype == xsd::float_.text) return "a number";
  if (std::string integer = words_for_integer(rdf::lexical::datatype_of(datatype)); !integer.empty()) return integer;
  if (datatype == xsd::dateTime.text) return "a date and time with its zone like \"2026-11-21T10:38:39Z\"";
  if (datatype == xsd::dayTimeDuration.text || datatype == xsd::duration.text) return "a duration like \"PT1.5S\"";
  return {};
}

/// The words for alternatives of datatypes, if the datatypes are all those that lrt accepts for a kind of value.
std::string words_for(const rdf::Graph& graph, rdf::TermId list) {
  const auto members = graph.list(list);
  if (!members) return {};
  const auto accepts = [&](Iri datatype) {
    return std::any_of(members->begin(), members->end(), [&](rdf::TermId m) { return is(graph, object(graph, m, sh::datatype), datatype); });
  };
  return accepts(xsd::dayTimeDuration) && accepts(xsd::duration) ? words_for(xsd::duration.text) : std::string();
}

std::optional<std::uint64_t> count_of(const rdf::Graph& graph, rdf::TermId shape, Iri parameter) {
  const auto id = object(graph, shape, parameter);
  return id ? rdf::lexical::parse_uint64(graph.term(*id).text) : std::nullopt;
}

/// The cells are one more than the members: rdf:nil is one of the nodes that rdf:rest* reaches.
std::string words_for_list(const rdf::Graph& graph, rdf::TermId cells) {
  const std::uint64_t min = count_of(graph, cells, sh::minCount).value_or(1), max = count_of(graph, cells, sh::maxCount).value_or(0);
  if (max == 0) return min > 1 ? "a list of at least " + counted(min - 1, "value", "values") : "a list";
  if (min == max) return "a list of " + counted(max - 1, "value", "values");
  return "a list of " + (min > 1 ? std::to_string(min - 1) + " to " : std::string("at most ")) + counted(max - 1, "value", "values");
}

bool has_cells_as_path(const rdf::Graph& graph, rdf::TermId shape) {
  const auto path = object(graph, shape, sh::path);
  return path && is(graph, object(graph, *path, sh::zeroOrMorePath), vocab::rdf_::rest);
}

}  // namespace

bool is_number(const rdf::TermView& term) noexcept {
  using rdf::lexical::Datatype;
  if (!term.is_literal() || !rdf::lexical::is_double(term.text)) return false;
  const Datatype datatype = rdf::lexical::datatype_of(term.datatype);
  return datatype == Datatype::decimal || datatype == Datatype::double_ || datatype == Datatype::float_ || rdf::lexical::is_integer_type(datatype);
}

std::string shown_value(const rdf::TermView& term) {
  if (term.text.size() > 80 || !term.is_literal() || !term.language.empty()) return shown(term);
  if (is_number(term)) return std::string(term.text);
  constexpr std::string_view xsd_namespace = "http://www.w3.org/2001/XMLSchema#";
  return term.datatype.substr(0, xsd_namespace.size()) == xsd_namespace && !is_bare(term) ? shown(rdf::literal(term.text)) : shown(term);
}

std::string one_of(const Plan& plan, const std::vector<rdf::TermId>& members) {
  constexpr std::size_t max_shown = 20;
  if (members.empty()) return "one of none";
  std::string text = members.size() == 1 ? "" : "one of ";
  for (std::size_t m = 0; m < members.size() && m < max_shown; ++m) text += (m == 0 ? "" : ", ") + shown(plan.graph.term(members[m]));
  return text + (members.size() > max_shown ? ", ..." : "");
}

std::string expectation(const Plan& plan, rdf::TermId shape) {
  const rdf::Graph& graph = plan.graph;
  if (const auto list = object(graph, shape, sh::in_))
    if (const auto members = graph.list(*list)) return one_of(plan, *members);
  for (const rdf::TermId list : objects(graph, shape, sh::or_)) {
    std::string words = words_for(graph, list);
    if (!words.empty()) return words;
  }
  if (const auto path = object(graph, shape, sh::path); is(graph, path, vocab::vom::unit) || is(graph, path, vocab::qudt::hasUnit))
    if (const auto unit = object(graph, shape, sh::hasValue)) return "the unit " + shown(graph.term(*unit));
  if (const auto datatype = object(graph, shape, sh::datatype)) return words_for(graph.term(*datatype).text);
  if (has_cells_as_path(graph, shape)) return words_for_list(graph, shape);
  std::string names;
  for (const rdf::TermId part : objects(graph, shape, sh::property)) {
    if (has_cells_as_path(graph, part)) return words_for_list(graph, part);
    if (is(graph, object(graph, part, sh::path), vocab::vom::numericalValue)) return expectation(plan, part);
    if (const auto name = name_of(graph, part)) names += (names.empty() ? " with " : ", ") + shown(graph.term(*name));
  }
  if (names.empty()) return names;
  return (object(graph, shape, sh::xone) ? "an object with exactly one member," : "an object") + names;
}

std::string for_name(const Plan& plan, rdf::TermId shape) {
  const auto name = name_of(plan.graph, shape);
  return name && plan.graph.term(*name).is_literal() ? " for " + shown(rdf::literal(plan.graph.term(*name).text)) : std::string();
}

std::string list_violation(const Run& run, const Scene& scene) {
  const rdf::Graph& graph = run.plan().graph;
  if (!has_cells_as_path(graph, scene.shape.id)) return {};
  std::size_t cells = scene.size();
  bool ends = false;
  for (std::size_t i = scene.begin; i < scene.end; ++i) ends |= run.term(run.node(i)) == rdf::TermView(vocab::rdf_::nil);
  const std::string found = ends         ? counted(cells - 1, "value", "values")
                            : cells == 1 ? shown_value(run.term(run.node(scene.begin)))
                                         : "a list that does not end";
  return "expected " + words_for_list(graph, scene.shape.id) + ", found " + found;
}

std::optional<std::string> required_predicate(const Plan& plan, rdf::TermId owner, rdf::TermId shape) {
  const rdf::Graph& graph = plan.graph;
  const std::vector<rdf::TermId> parts = objects(graph, shape, sh::property);
  if (parts.empty()) return std::nullopt;
  const auto are_absent = [&](rdf::TermId part) { return count_of(graph, part, sh::maxCount) == 0U; };
  if (std::all_of(parts.begin(), parts.end(), are_absent)) return std::string();
  const auto path = object(graph, parts.front(), sh::path);
  if (parts.size() != 1 || !path || !graph.term(*path).is_iri() || count_of(graph, parts.front(), sh::minCount).value_or(0) == 0) return std::nullopt;
  for (const rdf::TermId part : objects(graph, owner, sh::property))
    if (object(graph, part, sh::path) == path)
      if (const auto name = name_of(graph, part)) return std::string(graph.term(*name).text);
  const std::string_view iri = graph.term(*path).text;
  return std::string(iri.substr(iri.find_last_of("#/") + 1));
}

std::string shown_shape(const Plan& plan, std::uint32_t shape) {
  const rdf::TermView id = plan.graph.term(plan.shapes[shape].id);
  if (!id.is_blank()) return shown(id);
  for (const Iri name : {vocab::sh::name, vocab::rdfs::label})
    if (const auto text = plan.graph.object(id, name); text && text->is_literal()) return "the shape " + shown(rdf::literal(text->text));
  return "the shape given there";
}

std::string counted(std::uint64_t n, const char* one, const char* many) { return std::to_string(n) + " " + (n == 1 ? one : many); }

}  // namespace v0
}  // namespace lrt::shacl
