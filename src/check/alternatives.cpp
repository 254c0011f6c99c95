// SPDX-License-Identifier: Apache-2.0
#include "src/check/alternatives.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/rdf/json_parse.hpp"

namespace lrt::check {

using rdf::Facets;
using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Type;
using rdf::Value;
using rdf::json::Document;
using Kind = Type::Kind;

namespace {

constexpr std::size_t max_shapes = 100;

/// A number within the bounds.
double number_within(const Facets& f, double lowest, double highest, bool is_integer) {
  double low = std::max(f.min().value_or(lowest), lowest), high = std::min(f.max().value_or(highest), highest);
  if (low > high) return low;
  const double zero = std::min(std::max(0.0, low), high);
  const bool is_open = (f.min_exclusive() && zero == low) || (f.max_exclusive() && zero == high);
  if (!is_open) return is_integer ? std::round(zero) : zero;
  const double inside = std::isfinite(low) && std::isfinite(high) ? low + (high - low) / 2 : std::isfinite(low) ? low + 1 : high - 1;
  return is_integer ? std::round(inside) : inside;
}

/// A value of a type, as small as possible. Fields of a record that may be absent are, unless `all_fields`.
std::optional<Value> sample_of(const Type& type, const Facets& facets, bool all_fields = false, unsigned depth = 0) {
  constexpr unsigned max_depth = 16;
  constexpr std::size_t longest = 1'000;
  constexpr double exact = 9007199254740992;  // 2^53
  if (depth > max_depth) return std::nullopt;
  switch (type.kind) {
    case Kind::boolean: return Value(false);
    case Kind::integer: {
      const double lowest = static_cast<double>(type.lowest), highest = static_cast<double>(type.highest);
      return Value(static_cast<std::int64_t>(number_within(facets, std::max(lowest, -exact), std::min(highest, exact), true)));
    }
    case Kind::real: {
      constexpr double infinite = std::numeric_limits<double>::infinity();
      return Value(number_within(facets, -infinite, infinite, false));
    }
    case Kind::text:
      if (facets.min_length() > longest) return std::nullopt;
      return Value(std::string(facets.min_length(), 'a'));
    case Kind::enumeration: return type.names.empty() ? std::nullopt : std::optional(Value(type.names.front()));
    case Kind::duration:
    case Kind::instant: return Value(std::int64_t{0});
    case Kind::optional: return all_fields ? sample_of(*type.element, facets, false, depth + 1) : Value();
    case Kind::map: return Value(Value::Sequence());
    case Kind::list: {
      if (type.shortest > longest) return std::nullopt;
      Value::Sequence members;
      if (type.shortest > 0) {
        const std::optional<Value> member = sample_of(*type.element, facets, false, depth + 1);
        if (!member) return std::nullopt;
        members.assign(type.shortest, *member);
      }
      return Value(std::move(members));
    }
    case Kind::record:
    case Kind::variant: {
      Value::Sequence fields(type.fields.size());
      for (std::size_t i = 0; i < fields.size() && (i == 0 || type.kind == Kind::record); ++i) {
        const rdf::FieldType& field = type.fields[i];
        std::optional<Value> value = sample_of(*field.type, rdf::field_facets(field, facets), all_fields, depth + 1);
        if (!value) return std::nullopt;
        fields[i] = *std::move(value);
      }
      return Value(std::move(fields));
    }
  }
  return std::nullopt;
}

const Type& without_optional(const Type& type) noexcept { return type.kind == Kind::optional ? *type.element : type; }

std::string names_of(const Type& type) {
  std::string text;
  for (const rdf::FieldType& f : type.fields) text += (text.empty() ? "" : ", ") + excerpt(f.name, 60);
  return text;
}

/// The nodes of shapes that describe a record or a variant.
std::vector<client::Schema> schemas_of(const Graph& shapes) {
  std::vector<client::Schema> found;
  std::set<TermId> seen;
  for (const Iri predicate : {vocab::sh::xone, vocab::sh::property}) {
    const std::optional<TermId> id = shapes.find(predicate);
    if (!id) continue;
    for (const rdf::Triple& t : shapes.match(std::nullopt, *id, std::nullopt)) {
      if (found.size() >= max_shapes) return found;
      if (!seen.insert(t.subject).second) continue;
      Result<client::Schema> schema = client::Schema::read(shapes, shapes.term(t.subject));
      if (schema && schema->usable() && without_optional(schema->type()).has_fields()) found.push_back(*std::move(schema));
    }
  }
  return found;
}

class Judge {
 public:
  explicit Judge(const Graph& shapes) : graph_(shapes), shapes_(shacl::Shapes::compile(shapes, lenient())) {}
  /// Whether a node is a value of a shape. A property shape is one of the nodes at its path. nullopt: it cannot be judged
  std::optional<bool> conforms(Graph graph, TermId node, const TermView& shape) const {
    if (!shapes_ || !shapes_->contains(shape)) return std::nullopt;
    TermId focus = node;
    if (const std::optional<TermView> path = graph_.object(shape, vocab::sh::path)) {
      focus = graph.fresh_blank();
      // A predicate, or the members of an RDF list.
      graph.add(focus, path->is_iri() ? graph.intern(*path) : graph.intern(vocab::rdf_::first), node);
    }
    shacl::ValidateOptions options;
    options.max_steps = 100'000;
    const Result<shacl::Report> report = shacl::validate(*shapes_, graph, graph.term(focus), shape, options);
    if (!report) return std::nullopt;
    return report->conforms();
  }

 private:
  static shacl::CompileOptions lenient() {
    shacl::CompileOptions options;
    options.ignore_unsupported = true;
    return options;
  }
  const Graph& graph_;
  Result<shacl::Shapes> shapes_;
};

const std::string sample_node = "urn:lrt:check:sample";

/// What a client could send with two alternatives. Empty: it is refused. nullopt: it cannot be judged.
std::optional<std::string> accepted_pair(const Judge& judge, const Variant& variant) {
  bool any = false;
  for (std::size_t i = 0; i < variant.size(); ++i) {
    for (std::size_t j = 0; j < variant.size() && j < 20; ++j) {
      if (i == j) continue;
      Graph graph;
      const TermId node = graph.intern(rdf::iri(sample_node));
      if (!variant.add_sample(graph, node, i) || judge.conforms(graph, node, variant.shape()) != true) break;
      Graph junk(graph);
      junk.add(node, junk.intern(rdf::iri(variant.predicate(j))), junk.intern(rdf::literal("lrt check")));
      const std::string both = variant.name(i) + " and " + variant.name(j);
      if (judge.conforms(junk, node, variant.shape()) == true) return both;
      if (variant.add_sample(graph, node, j) && judge.conforms(graph, node, variant.shape()) == true) return both;
      any = true;
    }
    if (i >= 20) break;
  }
  if (!any) return std::nullopt;
  return std::string();
}

}  // namespace

std::vector<Variant> Variant::all_of(const Graph& shapes) {
  std::vector<Variant> found;
  if (!shapes.find(vocab::sh::xone)) return found;
  for (client::Schema& schema : schemas_of(shapes))
    if (without_optional(schema.type()).kind == Kind::variant) found.push_back(Variant(std::move(schema)));
  return found;
}

std::string Variant::names() const { return names_of(type()); }

std::optional<std::size_t> Variant::active(const Graph& graph, TermId node) const {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < size(); ++i) {
    const std::optional<TermId> predicate = graph.find(rdf::iri(type().fields[i].predicate));
    if (!predicate || !graph.object(node, *predicate)) continue;
    if (found) return std::nullopt;
    found = i;
  }
  return found;
}

bool Variant::add_sample(Graph& graph, TermId node, std::size_t alternative) const {
  const rdf::FieldType& field = type().fields[alternative];
  std::optional<Value> content = sample_of(*field.type, rdf::field_facets(field, schema_.facets()));
  if (!content) return false;
  Value::Sequence fields(size());
  fields[alternative] = *std::move(content);
  schema_.write_value(graph, node, Value(std::move(fields)));
  return true;
}

Graph Variant::without_alternatives(const Graph& graph, TermId node) const {
  Graph rest;
  for (const rdf::Triple& t : graph.triples()) {
    const std::string_view predicate = graph.term(t.predicate).text;
    const auto is = [&](const rdf::FieldType& f) { return f.predicate == predicate; };
    if (t.subject == node && std::any_of(type().fields.begin(), type().fields.end(), is)) continue;
    rest.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
  }
  return rest;
}

namespace {

/// The names of the alternatives of a schema; empty: it is that of something else.
std::set<std::string> tags_of(const Document& json, Document::Id schema) {
  std::set<std::string> tags;
  const Document::Id all = json.member(schema, "oneOf");
  if (all == Document::none || json.kind(all) != Document::Kind::array) return {};
  for (const Document::Id one : rdf::json::Children(json, all)) {
    if (json.kind(one) != Document::Kind::object) return {};
    const Document::Id required = json.member(one, "required"), type = json.member(one, "type");
    if (type != Document::none && json.text(type) == "null") continue;
    if (required == Document::none || json.kind(required) != Document::Kind::array) return {};
    const Document::Id tag = json.first(required);
    if (tag == Document::none || json.next(tag) != Document::none || json.kind(tag) != Document::Kind::string) return {};
    if (!tags.emplace(json.text(tag)).second) return {};
  }
  return tags;
}

void collect(const Document& json, Document::Id id, Announced& announced, unsigned depth) {
  constexpr unsigned max_depth = 40;
  if (depth > max_depth) return;
  if (json.kind(id) == Document::Kind::object) {
    std::set<std::string> tags = tags_of(json, id);
    if (tags.size() > 1) announced.insert(std::move(tags));
  } else if (json.kind(id) != Document::Kind::array) {
    return;
  }
  for (const Document::Id member : rdf::json::Children(json, id)) collect(json, member, announced, depth + 1);
}

}  // namespace

void add_announced(std::string_view json, Announced& announced) {
  rdf::json::Limits limits;
  limits.values = 1'000'000;
  limits.depth = 64;
  if (const Result<Document> document = Document::parse(json, limits)) collect(*document, document->root(), announced, 0);
}

std::vector<std::string> shapes_that_accept_several(const Graph& shapes, const Announced& announced, std::size_t& judged) {
  std::vector<std::string> faults;
  if (announced.empty() && !shapes.find(vocab::sh::xone)) return faults;
  const Judge judge(shapes);
  for (const Variant& variant : Variant::all_of(shapes)) {
    const std::optional<std::string> both = accepted_pair(judge, variant);
    if (!both) continue;
    ++judged;
    if (!both->empty())
      faults.push_back("a value with " + *both + " conforms to the shape " + rdf::to_string(variant.shape()) + ", which is one of " +
                       variant.names());
  }
  if (announced.empty()) return faults;
  for (const client::Schema& schema : schemas_of(shapes)) {
    const Type& type = without_optional(schema.type());
    std::set<std::string> names;
    for (const rdf::FieldType& f : type.fields) names.insert(f.name);
    if (type.kind != Kind::record || announced.count(names) == 0) continue;
    ++judged;
    const std::optional<Value> all = sample_of(type, schema.facets(), true);
    Graph graph;
    const TermId node = graph.intern(rdf::iri(sample_node));
    if (!all) continue;
    schema.write_value(graph, node, *all);
    if (judge.conforms(graph, node, schema.shape()) == true)
      faults.push_back("the JSON says that a value is one of " + names_of(type) + ", and one with all of them conforms to the shape " +
                       rdf::to_string(schema.shape()));
  }
  return faults;
}

std::vector<WrongBody> with_wrong_alternatives(const Context& context, const Graph& body, const std::string& url) {
  std::vector<WrongBody> bodies;
  const std::optional<TermId> node = body.find(rdf::iri(url));
  if (!node) return bodies;
  const auto add = [&](const Graph& graph, std::string what) {
    if (const Result<std::string> text = rdf::write(graph, rdf::Syntax::turtle)) bodies.push_back({*text, std::move(what)});
  };
  for (const Resource& r : context.resources) {
    if (!r.blueprint || !r.graph) continue;
    for (const Variant& variant : Variant::all_of(*r.graph)) {
      const std::optional<std::size_t> active = variant.active(body, *node);
      if (!active) continue;
      for (std::size_t other = 0; other < variant.size(); ++other) {
        Graph both(body);
        if (other == *active || !variant.add_sample(both, *node, other)) continue;
        add(both, "a value that is " + variant.name(*active) + " and " + variant.name(other) + ", of which it has one,");
        break;
      }
      if (!variant.is_optional()) add(variant.without_alternatives(body, *node), "a value that is none of " + variant.names());
      return bodies;
    }
  }
  return bodies;
}

}  // namespace lrt::check
