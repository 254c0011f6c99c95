// SPDX-License-Identifier: Apache-2.0
#include "src/client/binding.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <mutex>
#include <set>
#include <string_view>

#include <lrt/base/immortal.hpp>
#include <lrt/client/units.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/base/ascii.hpp"
#include "src/client/session.hpp"
#include "src/rdf/representable.hpp"

namespace lrt::client {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;

namespace {

/// The HTTP vocabularies of the authors' older clients and of current ones (SPEC 4).
constexpr Iri http_namespaces[] = {Iri{"http://www.w3.org/2011/http#"}, Iri{"http://www.w3.org/2008/http#"}, Iri{"http://www.w3.org/2006/http#"}};

constexpr std::string_view content_namespace = "http://www.w3.org/2011/content#";

std::optional<TermId> http_object(const Graph& graph, TermId subject, std::string_view name) {
  for (const Iri space : http_namespaces) {
    const std::string term = std::string(space.text) + std::string(name);
    const std::optional<TermId> predicate = graph.find(rdf::iri(term));
    if (!predicate) continue;
    if (const std::optional<TermId> object = graph.object(subject, *predicate)) return object;
  }
  return std::nullopt;
}

bool is_set_by_connection(std::string_view name) {
  for (const std::string_view own :
       {"Host", "Connection", "Content-Length", "Transfer-Encoding", "Expect", "Upgrade", "Authorization", "Cookie", "TE", "Trailer"})
    if (lrt::detail::iequals_ascii(name, own)) return true;
  return false;
}

std::optional<TermId> object_of(const Graph& graph, TermId subject, Iri predicate) {
  const std::optional<TermId> id = graph.find(predicate);
  if (!id) return std::nullopt;
  return graph.object(subject, *id);
}

std::vector<TermId> objects_of(const Graph& graph, TermId subject, Iri predicate) {
  std::vector<TermId> result;
  if (const std::optional<TermId> id = graph.find(predicate))
    for (const Triple& t : graph.match(subject, id, std::nullopt)) result.push_back(t.object);
  return result;
}

std::optional<Binding> binding_at(const Graph& graph, TermId node) {
  Binding binding;
  const std::optional<TermId> method = http_object(graph, node, "mthd"), name = http_object(graph, node, "methodName");
  if (method) binding.method = local_name(graph.term(*method).text);
  else if (name) binding.method = graph.term(*name).text;
  const bool is_token = !binding.method.empty() && binding.method.size() <= 20 &&
                        std::all_of(binding.method.begin(), binding.method.end(), [](char c) { return c >= 'A' && c <= 'Z'; });
  if (!is_token) return std::nullopt;
  for (const char* place : {"requestURI", "absoluteURI"}) {
    if (const std::optional<TermId> url = http_object(graph, node, place); url && binding.url.empty()) binding.url = graph.term(*url).text;
  }
  if (const std::optional<TermId> headers = http_object(graph, node, "headers")) {
    for (const TermId field : graph.list(*headers).value_or(std::vector<TermId>{})) {
      const std::optional<TermId> field_name = http_object(graph, field, "fieldName"), value = http_object(graph, field, "fieldValue");
      if (!field_name || !value || binding.fields.size() >= 100) continue;
      const std::string_view text = graph.term(*field_name).text;
      const bool is_name = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return lrt::detail::is(c, lrt::detail::tchar); });
      if (is_name && !is_set_by_connection(text)) binding.fields.emplace_back(text, graph.term(*value).text);
    }
  }
  if (const std::optional<TermId> body = http_object(graph, node, "body")) {
    if (const std::optional<TermId> shape = object_of(graph, *body, vocab::dcterms::conformsTo)) binding.shape = rdf::Term(graph.term(*shape));
    for (const TermId of : objects_of(graph, *body, vocab::rdf_::type)) {
      const TermView term = graph.term(of);
      // Classes of HTTP say how the body is written, not what it is.
      bool is_of_http = term.text.substr(0, content_namespace.size()) == content_namespace;
      for (const Iri space : http_namespaces) is_of_http = is_of_http || term.text.substr(0, space.text.size()) == space.text;
      if (term.is_iri() && !is_of_http && binding.classes.size() < 100) binding.classes.emplace_back(term.text);
    }
  }
  return binding;
}

/// Collects the property shapes of a shape, of the shapes in its sh:node and of its parts and alternatives; with `nested` also those for the values
/// of its properties.
void collect_property_shapes(const Graph& graph, TermId shape, bool nested, std::vector<TermId>& found, std::vector<TermId>& seen,
                             bool alternatives = true) {
  constexpr std::size_t max_shapes = 1'000;
  if (seen.size() >= max_shapes || std::find(seen.begin(), seen.end(), shape) != seen.end()) return;
  seen.push_back(shape);
  const auto collect = [&](TermId other) { collect_property_shapes(graph, other, nested, found, seen, alternatives); };
  for (const TermId property : objects_of(graph, shape, vocab::sh::property)) {
    if (found.size() < max_shapes) found.push_back(property);
    if (nested) collect(property);
  }
  for (const TermId other : objects_of(graph, shape, vocab::sh::node)) collect(other);
  for (const Iri parts : {vocab::sh::and_, vocab::sh::or_, vocab::sh::xone}) {  // sh:or: a value may be absent; sh:xone: it is one of several
    if (!alternatives && parts != vocab::sh::and_) continue;
    for (const TermId list : objects_of(graph, shape, parts)) {
      for (const TermId part : graph.list(list).value_or(std::vector<TermId>{})) {
        if (!object_of(graph, part, vocab::sh::path)) {
          collect(part);
        } else {  // a property shape: its constraints are those of the values
          if (found.size() < max_shapes) found.push_back(part);
          if (nested) collect(part);
        }
      }
    }
  }
}

void collect_terms(const rdf::Type& type, std::vector<std::string_view>& terms, unsigned depth = 0) {
  if (depth > 16) return;
  const auto add = [&](const std::string& term) {
    if (!term.empty() && term.front() == '#') terms.push_back(term);
  };
  for (const std::string& name : type.classes) add(name);
  for (const rdf::FieldType& field : type.fields) {
    add(field.predicate);
    if (field.type) collect_terms(*field.type, terms, depth + 1);
  }
  if (type.element) collect_terms(*type.element, terms, depth + 1);
}

}  // namespace

std::string number_as(const TermView& literal, std::string_view datatype) {
  const auto is_one_of = [](std::string_view iri, std::initializer_list<Iri> all) {
    return std::any_of(all.begin(), all.end(), [&](Iri one) { return one.text == iri; });
  };
  namespace xsd = vocab::xsd;
  const auto is_real = [&](std::string_view iri) { return is_one_of(iri, {xsd::double_, xsd::float_, xsd::decimal}); };
  const auto is_integer = [](std::string_view iri) { return rdf::lexical::is_integer_type(rdf::lexical::datatype_of(iri)); };
  if (!is_real(literal.datatype) && !is_integer(literal.datatype)) return {};
  const std::optional<double> number = rdf::lexical::parse_double(literal.text);
  if (!number || (is_integer(datatype) && rdf::lexical::is_rounded_away(literal.text, *number))) return {};
  if (is_real(datatype)) {
    if (datatype == xsd::decimal.text && literal.text.find_first_of("eENI") != std::string_view::npos) return {};
    return std::string(literal.text);
  }
  constexpr double exact = 9007199254740992;  // 2^53
  if (!is_integer(datatype)) return {};
  if (is_integer(literal.datatype)) return std::string(literal.text);
  if (std::floor(*number) != *number || std::abs(*number) > exact) return {};
  return std::to_string(static_cast<long long>(*number));
}

std::vector<Binding> bindings_of(const Representation& representation) {
  std::vector<Binding> result;
  if (!representation.focus) return result;
  for (const TermId node : objects_of(representation.graph, *representation.focus, vocab::hybrit::binding)) {
    if (result.size() >= 100) break;
    if (std::optional<Binding> binding = binding_at(representation.graph, node)) result.push_back(*std::move(binding));
  }
  return result;
}

std::vector<rdf::Term> shapes_of(const Representation& representation, Iri predicate) {
  std::vector<rdf::Term> result;
  if (!representation.focus) return result;
  const Graph& graph = representation.graph;
  for (const TermId node : objects_of(graph, *representation.focus, predicate)) {
    const TermView term = graph.term(node);
    if (term.is_iri() || (term.is_blank() && !graph.match(node, std::nullopt, std::nullopt).empty())) result.emplace_back(term);
  }
  return result;
}

namespace {
std::vector<std::string> classes_by(const Shape& shape, std::initializer_list<Iri> predicates, bool alternatives) {
  std::vector<std::string> result;
  const std::optional<TermId> id = shape.graph.find(shape.node);
  if (!id) return result;
  std::vector<TermId> ignored, shapes;
  collect_property_shapes(shape.graph, *id, false, ignored, shapes, alternatives);
  for (const TermId one : shapes) {
    for (const Iri predicate : predicates) {
      for (const TermId found : objects_of(shape.graph, one, predicate)) {
        std::string text(shape.graph.term(found).text);
        if (std::find(result.begin(), result.end(), text) == result.end()) result.push_back(std::move(text));
      }
    }
  }
  return result;
}
}  // namespace

std::vector<std::string> classes_of(const Shape& shape) { return classes_by(shape, {vocab::sh::class_, vocab::sh::targetClass}, true); }

std::vector<std::string> required_classes(const Shape& shape) { return classes_by(shape, {vocab::sh::class_}, false); }

bool is_about_resources(const Graph& graph, TermId shape) {
  const std::vector<TermId> properties = objects_of(graph, shape, vocab::sh::property);
  // A named shape may be described elsewhere, or by sh:or.
  if (properties.empty()) return graph.term(shape).is_blank() && objects_of(graph, shape, vocab::sh::xone).empty();
  return std::all_of(properties.begin(), properties.end(), [&](TermId p) {
    const std::optional<TermId> path = object_of(graph, p, vocab::sh::path);
    const std::string_view iri = path ? graph.term(*path).text : std::string_view();
    return iri == vocab::rdfs::seeAlso.text || iri == vocab::dcterms::modified.text || iri == vocab::lrt_::error.text;
  });
}

bool is_absence(const Graph& graph, TermId shape) {
  const std::vector<TermId> properties = objects_of(graph, shape, vocab::sh::property);
  return !properties.empty() && std::all_of(properties.begin(), properties.end(), [&](TermId p) {
    const std::optional<TermId> count = object_of(graph, p, vocab::sh::maxCount);
    return count && rdf::lexical::parse_uint64(graph.term(*count).text) == 0U;
  });
}

std::optional<lrt::Unit> unit_of(std::string_view qudt, std::string_view vom) {
  if (qudt.empty() && vom.empty()) return std::nullopt;
  // Not one whose IRI is a view of the argument: it is kept, as others are.
  if (const lrt::Unit known = find_unit(vom, qudt); !known.ucum.empty() && known.qudt.text.data() != qudt.data()) return known;
  struct Kept {
    std::mutex mutex;
    std::set<std::pair<std::string, std::string>> names;
  };
  constexpr std::size_t max_kept = 1'000, longest = 500;
  if (qudt.size() > longest || vom.size() > longest) return std::nullopt;
  static Immortal<Kept> kept;
  const std::lock_guard lock(kept->mutex);
  std::pair<std::string, std::string> name(qudt, vom);
  if (kept->names.count(name) == 0 && kept->names.size() >= max_kept) return std::nullopt;
  const auto& [qudt_iri, vom_iri] = *kept->names.insert(std::move(name)).first;
  return find_unit(vom_iri, qudt_iri);
}

std::optional<lrt::Unit> required_unit(const Shape& shape) {
  const Graph& graph = shape.graph;
  const std::optional<TermId> id = graph.find(shape.node);
  if (!id) return std::nullopt;
  std::vector<TermId> properties, seen;
  collect_property_shapes(graph, *id, false, properties, seen);
  std::string qudt, vom;
  for (const TermId property : properties) {
    const std::optional<TermId> path = object_of(graph, property, vocab::sh::path);
    if (!path) continue;
    std::string_view value;
    if (const std::optional<TermId> one = object_of(graph, property, vocab::sh::hasValue)) {
      value = graph.term(*one).text;
    } else if (const std::optional<TermId> list = object_of(graph, property, vocab::sh::in_)) {
      const std::vector<TermId> members = graph.list(*list).value_or(std::vector<TermId>{});
      if (members.size() == 1) value = graph.term(members.front()).text;
    }
    const std::string_view predicate = graph.term(*path).text;
    if (predicate == vocab::qudt::hasUnit.text || predicate == vocab::qudt::unit.text) qudt = value;
    else if (predicate == vocab::vom::unit.text) vom = value;
  }
  return unit_of(qudt, vom);
}

std::optional<lrt::Unit> stated_unit(const Graph& graph, TermId node) {
  const auto text = [&](Iri predicate) -> std::string_view {
    const std::optional<TermId> object = object_of(graph, node, predicate);
    return object ? graph.term(*object).text : std::string_view();
  };
  std::string_view qudt = text(vocab::qudt::hasUnit);
  if (qudt.empty()) qudt = text(vocab::qudt::unit);
  return unit_of(qudt, text(vocab::vom::unit));
}

std::string vocabulary_of(const rdf::Type& type, const Graph& graph) {
  std::vector<std::string_view> terms;
  collect_terms(type, terms);
  if (terms.empty()) return {};
  for (std::size_t i = 0; i < graph.term_count(); ++i) {
    const TermView term = graph.term(static_cast<TermId>(i));
    if (!term.is_iri()) continue;
    for (const std::string_view own : terms) {
      const std::string_view name = own.substr(1);
      if (term.text.size() <= name.size() || term.text.substr(term.text.size() - name.size()) != name) continue;
      const std::string_view space = term.text.substr(0, term.text.size() - name.size());
      if (space.back() == '#' || space.back() == '/') return std::string(space);
    }
  }
  return {};
}

Result<rdf::Value> value_at(const Graph& given, TermId node, const rdf::Type& type, const lrt::Unit& unit) {
  static constexpr Iri simple_results[] = {vocab::rdf_::value, Iri{"http://qudt.org/schema/qudt/numericValue"}, vocab::schema::value,
                                           Iri{"http://www.w3.org/ns/sosa/hasSimpleResult"}};
  const Graph* graph = &given;
  Graph changed;
  const rdf::Type* value = &type;
  while (value->kind == rdf::Type::Kind::optional && value->element) value = value->element;
  const bool is_literal = given.term(node).is_literal();
  if (is_literal || (value->is_number() && !object_of(given, node, vocab::vom::numericalValue))) {
    const Iri predicate = value->is_number() ? vocab::vom::numericalValue : vocab::rdf_::value;
    std::optional<TermId> found;
    if (is_literal) found = node;
    for (const Iri other : simple_results)
      if (!found) found = object_of(given, node, other);
    if (found) {
      changed = given;
      const TermId holder = is_literal ? changed.fresh_blank() : node;
      changed.add(holder, changed.intern(predicate), *found);
      node = holder;
      graph = &changed;
    }
  }
  std::vector<rdf::Mismatch> mismatches;
  // A caller may name the unit by one of its IRIs only. What a robot says may be NaN or infinite.
  const lrt::Unit whole = unit_of(unit.qudt.text, unit.vom.text).value_or(unit);
  return rdf::read_value(*graph, node, type, rdf::Facets(whole).allow_non_finite(), vocabulary_of(type, *graph), mismatches);
}

Graph with_datatypes_of(const Shape& shape, const Graph& graph) {
  // By predicate: one that has several datatypes in the shape is left alone.
  std::map<std::string_view, std::string_view> wanted;
  const std::optional<TermId> node = shape.graph.find(shape.node);
  if (!node) return graph;
  std::vector<TermId> properties, seen;
  collect_property_shapes(shape.graph, *node, true, properties, seen);
  for (const TermId property : properties) {
    const std::optional<TermId> predicate = object_of(shape.graph, property, vocab::sh::path);
    const std::optional<TermId> datatype = object_of(shape.graph, property, vocab::sh::datatype);
    if (!predicate || !datatype || !shape.graph.term(*predicate).is_iri()) continue;
    const std::string_view name = shape.graph.term(*datatype).text;
    const auto [known, is_new] = wanted.emplace(shape.graph.term(*predicate).text, name);
    if (!is_new && known->second != name) known->second = {};
  }
  Graph result;
  for (const Triple& t : graph.triples()) {
    const TermView object = graph.term(t.object), predicate = graph.term(t.predicate);
    const auto found = object.is_literal() ? wanted.find(predicate.text) : wanted.end();
    std::string text;
    if (found != wanted.end() && found->second != object.datatype) text = number_as(object, found->second);
    result.add(graph.term(t.subject), predicate, text.empty() ? object : rdf::literal(text, Iri(found->second)));
  }
  return result;
}

Result<void> conforms(const Graph& graph, TermId focus, const Shape& shape) {
  shacl::CompileOptions compile;
  compile.ignore_unsupported = true;  // the server validates with them
  const Result<shacl::Shapes> shapes = shacl::Shapes::compile(shape.graph, compile);
  if (!shapes || !shapes->contains(shape.node)) return {};  // what cannot be validated here is left to the server
  const Result<shacl::Report> report = shacl::validate(*shapes, graph, graph.term(focus), shape.node);
  if (!report) return unexpected(report.error());
  if (report->conforms()) return {};
  const shacl::ValidationResult& first = report->results().front();
  const std::string message =
      first.messages.empty() ? std::string(local_name(first.component.text)) : std::string(first.messages.front().view().text);
  const std::size_t more = report->results().size() - 1;
  return unexpected(Errc::expected_value, "not sent: the input does not conform to the published shape" +
                                              (first.path.empty() ? std::string() : ": " + first.path.to_string()) + ": " + message +
                                              (more > 0 ? " (and " + std::to_string(more) + " more)" : ""));
}

}  // namespace lrt::client
