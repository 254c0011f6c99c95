// SPDX-License-Identifier: Apache-2.0
// SHACL 4.5 Property Pair Constraint Components

#include <lrt/rdf/vocab.hpp>

#include "src/shacl/components/all.hpp"
#include "src/shacl/order.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// The common part of the four. Values: IRIs; each is a constraint on the value nodes and the objects of that predicate at the focus node.
class Pair : public Constraint {
 protected:
  Pair(Iri component_iri, Constant predicate) noexcept : Constraint(component_iri), predicate_(predicate) {}
  template <class C>
  static void build_as(Compiler& compiler, const Draft& shape, Iri parameter) {
    for (const Constant c : compiler.iris(shape, parameter)) compiler.add<C>(shape, c);
  }
  std::string name(const Run& run) const { return shown(run.plan().graph.term(predicate_)); }
  Constant predicate_;
};

/// SHACL 4.5.1 sh:equals: the two sets are equal. One result for each term that only one set has.
class Equals final : public Pair {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<Equals>(c, shape, sh::equals); }
  explicit Equals(Constant predicate) noexcept : Pair(sh::EqualsConstraintComponent, predicate) {}

  void check(Run& run, const Scene& scene) const override {
    const Node predicate = run.node_of(predicate_);
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      if (run.has(scene.focus, predicate, node)) continue;
      run.violation(scene, *this, node, [&] { return "expected a value of " + name(run) + " as well, found " + shown(run.term(node)); });
    }
    Run::Set values(run);
    for (std::size_t i = scene.begin; i < scene.end; ++i) values.insert(run.node(i));
    run.each_object(scene.focus, predicate, [&](Node object) {
      if (!values.contains(object))
        run.violation(scene, *this, object, [&] { return "expected the values of " + name(run) + ", found no " + shown(run.term(object)); });
      return run.step() && !run.done();
    });
  }
};

/// SHACL 4.5.2 sh:disjoint: the two sets have no term in common.
class Disjoint final : public Pair {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<Disjoint>(c, shape, sh::disjoint); }
  explicit Disjoint(Constant predicate) noexcept : Pair(sh::DisjointConstraintComponent, predicate) {}

  void check(Run& run, const Scene& scene) const override {
    const Node predicate = run.node_of(predicate_);
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      if (!run.has(scene.focus, predicate, node)) continue;
      run.violation(scene, *this, node, [&] { return "expected no value of " + name(run) + ", found " + shown(run.term(node)); });
    }
  }
};

/// The common part of sh:lessThan and sh:lessThanOrEquals: the order must hold for every pair. One result for each pair for which it does
/// not, or which cannot be compared.
class Less : public Pair {
 public:
  void check(Run& run, const Scene& scene) const final {
    const Node predicate = run.node_of(predicate_);
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      const rdf::TermView term = run.term(node);
      const Comparable value(term);
      run.each_object(scene.focus, predicate, [&](Node object) {
        const rdf::TermView other = run.term(object);
        const Order order = compare(value, Comparable(other));
        if (order != Order::less && !(or_equal_ && order == Order::equal)) {
          run.violation(scene, *this, node, [&] {
            return "expected a value " + std::string(or_equal_ ? "of at most " : "below ") + shown(other) + " (" + name(run) + "), found " +
                   shown(term) + (order == Order::unordered ? ", which cannot be compared with it" : "");
          });
        }
        return run.step() && !run.done();
      });
    }
  }

 protected:
  Less(Iri component_iri, Constant predicate, bool or_equal) noexcept : Pair(component_iri, predicate), or_equal_(or_equal) {}

 private:
  bool or_equal_;
};

/// SHACL 4.5.3 sh:lessThan: every value node is less than every object of the predicate. In property shapes.
class LessThan final : public Less {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<LessThan>(c, shape, sh::lessThan); }
  explicit LessThan(Constant predicate) noexcept : Less(sh::LessThanConstraintComponent, predicate, false) {}
};

/// SHACL 4.5.4 sh:lessThanOrEquals: every value node is less than or equal to every object of the predicate. In property
/// shapes.
class LessThanOrEquals final : public Less {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<LessThanOrEquals>(c, shape, sh::lessThanOrEquals); }
  explicit LessThanOrEquals(Constant predicate) noexcept : Less(sh::LessThanOrEqualsConstraintComponent, predicate, true) {}
};

}  // namespace

const Component components::equals{{{sh::equals, false}}, false, &Equals::build};
const Component components::disjoint{{{sh::disjoint, false}}, false, &Disjoint::build};
const Component components::less_than{{{sh::lessThan, false}}, true, &LessThan::build};
const Component components::less_than_or_equals{{{sh::lessThanOrEquals, false}}, true, &LessThanOrEquals::build};

}  // namespace lrt::shacl
