// SPDX-License-Identifier: Apache-2.0
// SHACL 4.7 Shape-based Constraint Components

#include <algorithm>

#include <lrt/rdf/vocab.hpp>

#include "src/shacl/components/all.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// SHACL 4.7.1 sh:node: every value node conforms to the node shape. Values: node shapes; each is a constraint.
class NodeConstraint final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    for (const rdf::TermId v : compiler.values(shape.id, sh::node)) {
      if (compiler.is_property_shape(v)) return compiler.fail(shape.id, sh::node, v, "a node shape, without sh:path");
      compiler.add<NodeConstraint>(shape, compiler.shape(v));
    }
  }
  explicit NodeConstraint(ShapeIndex shape) noexcept : Constraint(sh::NodeConstraintComponent), shape_(shape) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      if (run.conforms(node, shape_)) continue;
      run.violation_within(scene, *this, node, shape_, [&] {
        return "expected a value that conforms to " + shown_shape(run.plan(), shape_) + ", found " + shown(run.term(node));
      });
    }
  }
  void references(std::vector<ShapeIndex>& out) const override { out.push_back(shape_); }

 private:
  ShapeIndex shape_;
};

/// SHACL 4.7.2 sh:property: every value node is validated against the property shape, and its results are added. Values: property shapes;
/// each is a constraint.
class Property final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    for (const rdf::TermId v : compiler.values(shape.id, sh::property)) {
      if (!compiler.is_property_shape(v)) return compiler.fail(shape.id, sh::property, v, "a property shape, with sh:path");
      compiler.add<Property>(shape, compiler.shape(v));
    }
  }
  explicit Property(ShapeIndex shape) noexcept : Constraint(sh::PropertyConstraintComponent), shape_(shape) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) run.descend(run.node(i), shape_);
  }
  void references(std::vector<ShapeIndex>& out) const override { out.push_back(shape_); }

 private:
  ShapeIndex shape_;
};

/// SHACL 4.7.3 sh:qualifiedValueShape: counts the value nodes that conform to the shape and, with sh:qualifiedValueShapesDisjoint, to none of
/// its siblings. The count is at least sh:qualifiedMinCount (one constraint) and at most sh:qualifiedMaxCount (another one). One value of
/// each, in property shapes.
class Qualified final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    const auto min = compiler.integer(shape, sh::qualifiedMinCount), max = compiler.integer(shape, sh::qualifiedMaxCount);
    const bool disjoint = compiler.flag(shape, sh::qualifiedValueShapesDisjoint);
    const auto value = compiler.value(shape, sh::qualifiedValueShape);
    if (!value) return;  // the counts alone declare no constraint
    std::vector<ShapeIndex> siblings;
    if (disjoint) siblings = siblings_of(compiler, shape, *value);
    if (min) compiler.add<Qualified>(shape, sh::QualifiedMinCountConstraintComponent, compiler.shape(*value), siblings, *min, true);
    if (max) compiler.add<Qualified>(shape, sh::QualifiedMaxCountConstraintComponent, compiler.shape(*value), siblings, *max, false);
  }
  Qualified(Iri component_iri, ShapeIndex shape, std::vector<ShapeIndex> siblings, std::int64_t count, bool is_minimum)
      : Constraint(component_iri), shape_(shape), siblings_(std::move(siblings)), count_(count), is_minimum_(is_minimum) {}

  void check(Run& run, const Scene& scene) const override {
    std::int64_t found = 0;
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      if (!run.conforms(node, shape_)) continue;
      found += std::none_of(siblings_.begin(), siblings_.end(), [&](ShapeIndex s) { return run.conforms(node, s); });
      if (is_minimum_ && found >= count_) return;
    }
    if (run.done() || (is_minimum_ ? found >= count_ : found <= count_)) return;
    run.violation(scene, *this, std::nullopt, [&] {
      return "expected at " + std::string(is_minimum_ ? "least " : "most ") + std::to_string(count_) +
             (count_ == 1 ? " value that conforms to " : " values that conform to ") + shown_shape(run.plan(), shape_) + ", found " +
             (found == 0 ? "none" : std::to_string(found));
    });
  }
  void references(std::vector<ShapeIndex>& out) const override {
    out.push_back(shape_);
    out.insert(out.end(), siblings_.begin(), siblings_.end());
  }

 private:
  /// The other qualified value shapes of all shapes that have this one as sh:property.
  static std::vector<ShapeIndex> siblings_of(const Compiler& compiler, const Draft& shape, rdf::TermId own) {
    std::vector<ShapeIndex> out;
    const auto property = compiler.graph().find(sh::property);
    if (!property) return out;
    for (const rdf::Triple& parent : compiler.graph().match(std::nullopt, *property, shape.id)) {
      for (const rdf::TermId p : compiler.values(parent.subject, sh::property)) {
        for (const rdf::TermId sibling : compiler.values(p, sh::qualifiedValueShape)) {
          const ShapeIndex index = compiler.shape(sibling);
          if (sibling != own && std::find(out.begin(), out.end(), index) == out.end()) out.push_back(index);
        }
      }
    }
    return out;
  }

  ShapeIndex shape_;
  std::vector<ShapeIndex> siblings_;
  std::int64_t count_;
  bool is_minimum_;
};

}  // namespace

const Component components::node{{{sh::node, false}}, false, &NodeConstraint::build};
const Component components::property{{{sh::property, false}}, false, &Property::build};
const Component components::qualified_value_shape{
    {{sh::qualifiedValueShape, true}, {sh::qualifiedValueShapesDisjoint, true}, {sh::qualifiedMinCount, true}, {sh::qualifiedMaxCount, true}},
    true,
    &Qualified::build};

}  // namespace lrt::shacl
