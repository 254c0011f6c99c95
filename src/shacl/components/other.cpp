// SPDX-License-Identifier: Apache-2.0
// SHACL 4.8 Other Constraint Components

#include <algorithm>

#include <lrt/rdf/vocab.hpp>

#include "src/shacl/components/all.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// SHACL 4.8.1 sh:closed, sh:ignoredProperties: value nodes have only predicates that are paths of the shape's sh:property or members of the
/// list. One result for each other triple, with its predicate as path.
class Closed final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    std::vector<Constant> allowed;
    if (const auto head = compiler.value(shape, sh::ignoredProperties)) {
      const auto members = compiler.list(shape, sh::ignoredProperties, *head);
      if (!members) return;
      for (const rdf::TermId m : *members) {
        if (!compiler.term(m).is_iri()) return compiler.fail(shape.id, sh::ignoredProperties, m, "a list of IRIs");
        allowed.push_back(m);
      }
    }
    if (!compiler.flag(shape, sh::closed)) return;
    for (const rdf::TermId p : compiler.values(shape.id, sh::property))
      if (const auto predicate = compiler.path_predicate(p)) allowed.push_back(*predicate);
    compiler.add<Closed>(shape, std::move(allowed));
  }
  explicit Closed(std::vector<Constant> allowed) : Constraint(sh::ClosedConstraintComponent), allowed_(std::move(allowed)) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      if (!run.in_data(node)) continue;
      for (const rdf::Triple& t : run.data().match(rdf::TermId{node}, std::nullopt, std::nullopt)) {
        const auto predicate = static_cast<Node>(t.predicate);
        if (!run.step() || run.done()) return;
        if (std::any_of(allowed_.begin(), allowed_.end(), [&](Constant c) { return run.node_of(c) == predicate; })) continue;
        const auto object = static_cast<Node>(t.object);
        run.violation_at(scene, *this, predicate, object,
                         [&] { return "expected no " + shown(run.term(predicate)) + ", found " + shown(run.term(object)); });
      }
    }
  }

 private:
  std::vector<Constant> allowed_;
};

/// SHACL 4.8.2 sh:hasValue: the term is one of the value nodes. Values: terms; each is a constraint.
class HasValue final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    for (const Constant v : compiler.values(shape.id, sh::hasValue)) compiler.add<HasValue>(shape, v);
  }
  explicit HasValue(Constant wanted) noexcept : Constraint(sh::HasValueConstraintComponent), wanted_(wanted) {}

  void check(Run& run, const Scene& scene) const override {
    const Node wanted = run.node_of(wanted_);
    for (std::size_t i = scene.begin; i < scene.end; ++i)
      if (run.node(i) == wanted) return;
    run.violation(scene, *this, std::nullopt, [&] {
      std::string text = list_violation(run, scene);
      if (const std::string words = expectation(run.plan(), scene.shape.id); text.empty() && words.rfind("the unit ", 0) == 0)
        text = "expected " + words + ", found " + (scene.size() == 0 ? "none" : shown(run.term(run.node(scene.begin))));
      return text.empty() ? "expected the value " + shown(run.plan().graph.term(wanted_)) + ", found no such value" : text;
    });
  }

 private:
  Constant wanted_;
};

/// SHACL 4.8.3 sh:in: every value node is a member of the list.
class In final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    const auto members = compiler.list(shape, sh::in_, *compiler.value(shape, sh::in_));
    if (members) compiler.add<In>(shape, *members);
  }
  explicit In(std::vector<Constant> members) : Constraint(sh::InConstraintComponent), members_(std::move(members)) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      run.step(members_.size() / 8);
      if (std::any_of(members_.begin(), members_.end(), [&](Constant c) { return run.node_of(c) == node; })) continue;
      run.violation(scene, *this, node, [&] { return "expected " + one_of(run.plan(), members_) + ", found " + shown(run.term(node)); });
    }
  }

 private:
  std::vector<Constant> members_;
};

}  // namespace

const Component components::closed{{{sh::closed, true}, {sh::ignoredProperties, true}}, false, &Closed::build};
const Component components::has_value{{{sh::hasValue, false}}, false, &HasValue::build};
const Component components::in{{{sh::in_, true}}, false, &In::build};

}  // namespace lrt::shacl
