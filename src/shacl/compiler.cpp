// SPDX-License-Identifier: Apache-2.0
#include "src/shacl/compiler.hpp"

#include <algorithm>
#include <limits>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/shacl/messages.hpp"

namespace lrt::shacl {

namespace sh = vocab::sh;

// ---- for components

std::vector<rdf::TermId> Compiler::values(rdf::TermId subject, Iri predicate) const {
  std::vector<rdf::TermId> out;
  if (const auto p = find(predicate))
    for (const rdf::Triple& t : graph_.match(subject, *p, std::nullopt)) out.push_back(t.object);
  return out;
}

std::optional<rdf::TermId> Compiler::value(const Draft& shape, Iri predicate) const {
  const auto p = find(predicate);
  return p ? graph_.object(shape.id, *p) : std::nullopt;
}

std::vector<Constant> Compiler::iris(const Draft& shape, Iri predicate) {
  std::vector<Constant> out = values(shape.id, predicate);
  for (const Constant c : out)
    if (!term(c).is_iri()) fail(shape.id, predicate, c, "an IRI");
  return out;
}

std::optional<std::int64_t> Compiler::integer(const Draft& shape, Iri predicate) {
  const auto v = value(shape, predicate);
  if (!v) return std::nullopt;
  const rdf::TermView literal = term(*v);
  if (!literal.is_literal() || literal.datatype != vocab::xsd::integer.text || !rdf::lexical::is_integer(literal.text)) {
    fail(shape.id, predicate, *v, "an xsd:integer");
    return std::nullopt;
  }
  if (const auto n = rdf::lexical::parse_int64(literal.text)) return n;
  return literal.text.front() == '-' ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max();
}

bool Compiler::flag(const Draft& shape, Iri predicate) {
  const auto v = value(shape, predicate);
  if (!v) return false;
  const rdf::TermView literal = term(*v);
  if (!literal.is_literal() || literal.datatype != vocab::xsd::boolean.text || !rdf::lexical::parse_boolean(literal.text)) {
    fail(shape.id, predicate, *v, "an xsd:boolean");
    return false;
  }
  return literal.text == "true";
}

std::optional<std::string_view> Compiler::text(const Draft& shape, Iri predicate) {
  const auto v = value(shape, predicate);
  if (!v) return std::nullopt;
  const rdf::TermView literal = term(*v);
  if (!literal.is_literal() || literal.datatype != vocab::xsd::string.text) {
    fail(shape.id, predicate, *v, "an xsd:string");
    return std::nullopt;
  }
  return literal.text;
}

std::optional<std::vector<rdf::TermId>> Compiler::list(const Draft& shape, Iri predicate, rdf::TermId head) {
  auto members = term(head).is_literal() ? std::nullopt : graph_.list(head);
  if (!members) fail(shape.id, predicate, head, "a well-formed RDF list");
  return members;
}

bool Compiler::is_property_shape(rdf::TermId id) const noexcept {
  const auto path = graph_.find(sh::path);
  return path && !graph_.match(id, *path, std::nullopt).empty();
}

std::optional<Constant> Compiler::path_predicate(rdf::TermId shape) const {
  const auto path = find(sh::path);
  const auto value = path ? graph_.object(shape, *path) : std::nullopt;
  return value && term(*value).is_iri() ? value : std::nullopt;
}

void Compiler::fail(rdf::TermId subject, Iri predicate, rdf::TermId object, std::string_view expected, Errc code) {
  fail("ill-formed shape: " + shown(term(subject)) + " " + shown(predicate) + " " + shown(term(object)) + ": expected " + std::string(expected),
       code);
}

void Compiler::fail(std::string message, Errc code) {
  if (!fault_) fault_ = Error{code, std::move(message)};
}

// ---- shapes

/// SHACL 1.1: rdf:type/rdfs:subClassOf*, here in the shapes graph.
bool Compiler::is_instance(rdf::TermId node, Iri class_iri) const {
  const auto wanted = find(class_iri), type = find(vocab::rdf_::type), sub_class_of = find(vocab::rdfs::subClassOf);
  if (!wanted || !type) return false;
  if (graph_.contains(node, *type, *wanted)) return true;
  if (!sub_class_of) return false;
  std::vector<rdf::TermId> classes;
  for (const rdf::Triple& t : graph_.match(node, *type, std::nullopt)) classes.push_back(t.object);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    if (classes[i] == *wanted) return true;
    for (const rdf::Triple& t : graph_.match(classes[i], *sub_class_of, std::nullopt))
      if (std::find(classes.begin(), classes.end(), t.object) == classes.end()) classes.push_back(t.object);
  }
  return false;
}

void Compiler::refuse_unsupported() {
  if (options_.ignore_unsupported) return;
  for (const Iri predicate : {sh::sparql, sh::js, sh::target, sh::expression, sh::entailment}) {
    const auto p = find(predicate);
    if (!p) continue;
    const auto found = graph_.match(std::nullopt, *p, std::nullopt);
    if (found.empty()) continue;
    const rdf::Triple& t = *found.begin();
    return fail(shown(term(t.subject)) + " " + shown(predicate) + " " + shown(term(t.object)) + ": not part of SHACL Core", Errc::unsupported_syntax);
  }
  // Custom constraint components (SHACL 6) are refused if a shape uses one.
  const auto type = find(vocab::rdf_::type), component = find(sh::ConstraintComponent), parameter = find(sh::parameter), path = find(sh::path);
  if (!type || !component || !parameter || !path) return;
  for (const rdf::Triple& declared : graph_.match(std::nullopt, *type, *component)) {
    for (const rdf::Triple& p : graph_.match(declared.subject, *parameter, std::nullopt)) {
      const auto predicate = graph_.object(p.object, *path);
      if (!predicate || !term(*predicate).is_iri()) continue;
      if (std::string_view(term(*predicate).text).substr(0, 27) == "http://www.w3.org/ns/shacl#") continue;
      const auto uses = graph_.match(std::nullopt, *predicate, std::nullopt);
      if (!uses.empty())
        return fail(shown(term(uses.begin()->subject)) + " " + shown(term(*predicate)) + " " + shown(term(uses.begin()->object)) +
                        ": the constraint component " + shown(term(declared.subject)) + " is not part of SHACL Core",
                    Errc::unsupported_syntax);
    }
  }
}

void Compiler::add_shape(rdf::TermId id) {
  const auto [at, is_new] = plan_.index.try_emplace(static_cast<std::uint32_t>(id), static_cast<ShapeIndex>(plan_.shapes.size()));
  (void)at;
  if (!is_new) return;
  Shape shape;
  shape.id = id;
  plan_.shapes.push_back(std::move(shape));
}

void Compiler::add_shape_value(const rdf::Triple& t) {
  if (term(t.object).is_literal()) return fail(t.subject, Iri(term(t.predicate).text), t.object, "a shape");
  add_shape(t.object);
}

/// SHACL 2.1: finds the shapes.
void Compiler::find_shapes() {
  const auto type = find(vocab::rdf_::type), sub_class_of = find(vocab::rdfs::subClassOf);
  std::vector<rdf::TermId> shape_classes;
  for (const Iri c : {sh::NodeShape, sh::PropertyShape})
    if (const auto id = find(c)) shape_classes.push_back(*id);
  for (std::size_t i = 0; sub_class_of && i < shape_classes.size(); ++i)
    for (const rdf::Triple& t : graph_.match(std::nullopt, *sub_class_of, shape_classes[i]))
      if (std::find(shape_classes.begin(), shape_classes.end(), t.subject) == shape_classes.end()) shape_classes.push_back(t.subject);

  enum class Role : std::uint8_t { none, subject, subject_and_object, subject_and_members };
  std::unordered_map<std::uint32_t, Role> roles;
  const auto give = [&](Iri predicate, Role role) {
    if (const auto id = find(predicate)) roles[static_cast<std::uint32_t>(*id)] = role;
  };
  for (const Iri target : {sh::targetNode, sh::targetClass, sh::targetSubjectsOf, sh::targetObjectsOf}) give(target, Role::subject);
  for (const Component* c : all_components())
    for (const Component::Parameter& p : c->parameters)
      if (!p.predicate.empty()) give(p.predicate, Role::subject);
  for (const Iri p : {sh::node, sh::property, sh::not_, sh::qualifiedValueShape}) give(p, Role::subject_and_object);
  for (const Iri p : {sh::and_, sh::or_, sh::xone}) give(p, Role::subject_and_members);

  for (const rdf::Triple& t : graph_.triples()) {
    if (type && t.predicate == *type) {
      if (std::find(shape_classes.begin(), shape_classes.end(), t.object) != shape_classes.end()) add_shape(t.subject);
      continue;
    }
    const auto role = roles.find(static_cast<std::uint32_t>(t.predicate));
    if (role == roles.end()) continue;
    add_shape(t.subject);
    if (role->second == Role::subject_and_object) add_shape_value(t);
    if (role->second == Role::subject_and_members) {
      const auto members = term(t.object).is_literal() ? std::nullopt : graph_.list(t.object);
      if (!members) {
        fail(t.subject, Iri(term(t.predicate).text), t.object, "a well-formed RDF list of shapes");
        continue;
      }
      for (const rdf::TermId m : *members) {
        if (term(m).is_literal()) fail(t.subject, Iri(term(t.predicate).text), m, "a list of shapes");
        else add_shape(m);
      }
    }
  }
}

void Compiler::compile_targets(ShapeIndex index) {
  Shape& shape = plan_.shapes[index];
  const Draft draft{index, shape.id, false};
  for (const rdf::TermId node : values(shape.id, sh::targetNode)) {
    if (term(node).is_blank()) fail(shape.id, sh::targetNode, node, "an IRI or a literal");
    shape.target_nodes.push_back(node);
  }
  shape.target_classes = iris(draft, sh::targetClass);
  shape.target_subjects_of = iris(draft, sh::targetSubjectsOf);
  shape.target_objects_of = iris(draft, sh::targetObjectsOf);
  // SHACL 2.1.3.3: a shape that is a class is its own target class.
  const bool declared = is_instance(shape.id, sh::NodeShape) || is_instance(shape.id, sh::PropertyShape);
  if (declared && is_instance(shape.id, vocab::rdfs::Class)) {
    if (!term(shape.id).is_iri()) fail("ill-formed shape: " + shown(term(shape.id)) + " is a class and a shape: expected an IRI");
    shape.target_classes.push_back(shape.id);
  }
}

void Compiler::compile_shape(ShapeIndex index) {
  const rdf::TermId id = plan_.shapes[index].id;
  const Draft draft{index, id, is_property_shape(id)};

  // SHACL 2.2, 2.3: syntax of node shapes and property shapes.
  const std::vector<rdf::TermId> paths = values(id, sh::path);
  if (paths.size() > 1) fail(id, sh::path, paths[1], "one path only");
  if (!paths.empty() && is_instance(id, sh::NodeShape)) fail(id, sh::path, paths.front(), "no path in a sh:NodeShape");
  if (paths.empty() && is_instance(id, sh::PropertyShape)) fail("ill-formed shape: " + shown(term(id)) + " a sh:PropertyShape: expected a sh:path");
  path_size_ = 0;
  if (!paths.empty()) plan_.shapes[index].path = compile_path(id, paths.front(), 0);

  compile_targets(index);

  // SHACL 2.1.4 to 2.1.6
  for (const Iri single : {sh::severity, sh::deactivated}) {
    const auto all = values(id, single);
    if (all.size() > 1) fail(id, single, all[1], "one value only");
  }
  const auto severity = value(draft, sh::severity);
  if (severity && !term(*severity).is_iri()) fail(id, sh::severity, *severity, "an IRI");
  plan_.shapes[index].severity = severity ? *severity : *find(sh::Violation);
  for (const rdf::TermId m : values(id, sh::message)) {
    const rdf::TermView message = term(m);
    const bool good = message.is_literal() && (!message.language.empty() || message.datatype == vocab::xsd::string.text);
    if (!good) fail(id, sh::message, m, "an xsd:string or a text with language");
    plan_.shapes[index].messages.push_back(m);
  }
  if (const auto deactivated = value(draft, sh::deactivated)) {
    if (term(*deactivated).text != "true" && term(*deactivated).text != "false") fail(id, sh::deactivated, *deactivated, "true or false");
    plan_.shapes[index].deactivated = flag(draft, sh::deactivated);
  }

  for (const Component* component : all_components()) {
    bool used = false;
    for (const Component::Parameter& p : component->parameters) {
      if (p.predicate.empty()) break;
      const auto all = values(id, p.predicate);
      if (all.empty()) continue;
      used = true;
      if (p.single && all.size() > 1) fail(id, p.predicate, all[1], "one value only");
      const bool first = &p == component->parameters;
      if (first && component->property_shapes_only && !draft.is_property_shape) fail(id, p.predicate, all.front(), "this in property shapes only");
    }
    if (used && !fault_) component->build(*this, draft);
  }
}

// ---- paths

PathIndex Compiler::add_path(Path path) {
  plan_.paths.push_back(std::move(path));
  return static_cast<PathIndex>(plan_.paths.size() - 1);
}

/// SHACL 2.3.1.1 to 2.3.1.7
PathIndex Compiler::compile_path(rdf::TermId owner, rdf::TermId node, std::size_t depth) {
  const auto refuse = [&](std::string_view expected, Errc code = Errc::expected_value) {
    fail(owner, sh::path, node, expected, code);
    return nothing;
  };
  if (fault_) return nothing;
  if (depth > options_.max_path_depth)
    return refuse("a path that does not contain itself, nested at most " + std::to_string(options_.max_path_depth) + " deep", Errc::limit_exceeded);
  if (++path_size_ > options_.max_path_size)
    return refuse("a path of at most " + std::to_string(options_.max_path_size) + " parts", Errc::limit_exceeded);
  const rdf::TermView view = term(node);
  if (view.is_literal() || view == rdf::TermView(vocab::rdf_::nil)) return refuse("a property path");
  if (view.is_iri()) {
    const auto [at, is_new] = predicate_paths_.try_emplace(static_cast<std::uint32_t>(node), nothing);
    if (is_new) {
      Path path;
      path.predicate = node;
      at->second = add_path(std::move(path));
    }
    return at->second;
  }
  Path path;
  const auto take_list = [&](rdf::TermId head) {
    const auto members = term(head).is_literal() ? std::nullopt : graph_.list(head);
    if (!members || members->size() < 2) return false;
    for (const rdf::TermId m : *members) path.parts.push_back(compile_path(owner, m, depth + 1));
    return true;
  };
  if (!values(node, vocab::rdf_::first).empty()) {
    path.kind = Path::Kind::sequence;
    if (!take_list(node)) return refuse("a list of at least two paths");
    return add_path(std::move(path));
  }
  constexpr struct {
    Iri predicate;
    Path::Kind kind;
  } forms[] = {{sh::alternativePath, Path::Kind::alternative},
               {sh::inversePath, Path::Kind::inverse},
               {sh::zeroOrMorePath, Path::Kind::zero_or_more},
               {sh::oneOrMorePath, Path::Kind::one_or_more},
               {sh::zeroOrOnePath, Path::Kind::zero_or_one}};
  const auto triples = graph_.match(node, std::nullopt, std::nullopt);
  if (triples.empty() || ++triples.begin() != triples.end()) return refuse("an IRI, a list, or a blank node with exactly one triple, a path's");
  const rdf::Triple& only = *triples.begin();
  for (const auto& form : forms) {
    if (term(only.predicate) != rdf::TermView(form.predicate)) continue;
    path.kind = form.kind;
    if (form.kind == Path::Kind::alternative) {
      if (!take_list(only.object)) return refuse("sh:alternativePath with a list of at least two paths");
    } else {
      path.parts.push_back(compile_path(owner, only.object, depth + 1));
    }
    return add_path(std::move(path));
  }
  return refuse("a property path");
}

// ---- the whole graph

/// Removes repeatedly the shapes that refer to no remaining shape. The remaining shapes are recursive.
void Compiler::mark_recursive() {
  const std::size_t n = plan_.shapes.size();
  std::vector<std::vector<ShapeIndex>> referred_by(n);
  std::vector<std::size_t> open(n, 0);
  std::vector<ShapeIndex> references, done;
  for (ShapeIndex i = 0; i < n; ++i) {
    references.clear();
    for (const auto& c : plan_.shapes[i].constraints) c->references(references);
    open[i] = references.size();
    for (const ShapeIndex r : references) referred_by[r].push_back(i);
    if (references.empty()) done.push_back(i);
  }
  for (std::size_t at = 0; at < done.size(); ++at)
    for (const ShapeIndex user : referred_by[done[at]])
      if (--open[user] == 0) done.push_back(user);
  for (ShapeIndex i = 0; i < n; ++i) plan_.shapes[i].recursive = open[i] != 0;
}

Result<void> Compiler::run() {
  plan_.type = plan_.graph.intern(vocab::rdf_::type);
  plan_.sub_class_of = plan_.graph.intern(vocab::rdfs::subClassOf);
  plan_.graph.intern(sh::Violation);
  refuse_unsupported();
  find_shapes();
  for (ShapeIndex i = 0; i < plan_.shapes.size() && !fault_; ++i) compile_shape(i);
  if (fault_) return unexpected(*std::move(fault_));
  mark_recursive();
  return {};
}

// ---- the public class

Result<Shapes> Shapes::compile(rdf::Graph&& shapes, const CompileOptions& options) {
  const auto plan = std::make_shared<Plan>();
  plan->graph = std::move(shapes);
  if (Result<void> made = Compiler(*plan, options).run(); !made) return unexpected(std::move(made).error());
  return Shapes(plan);
}

Result<Shapes> Shapes::compile(const rdf::Graph& shapes, const CompileOptions& options) { return compile(rdf::Graph(shapes), options); }

bool Shapes::contains(const rdf::TermView& shape) const noexcept {
  const auto id = plan_->graph.find(shape);
  return id && plan_->find(*id) != nothing;
}
std::size_t Shapes::size() const noexcept { return plan_->shapes.size(); }
const rdf::Graph& Shapes::graph() const noexcept { return plan_->graph; }

}  // namespace lrt::shacl
