// SPDX-License-Identifier: Apache-2.0
// SHACL 4.3 Value Range Constraint Components

#include <string>
#include <string_view>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/shacl/components/all.hpp"
#include "src/shacl/order.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// The common part of the four. One literal. A value node is a violation if SPARQL's comparison with the literal is false or impossible.
class Range : public Constraint {
 public:
  void check(Run& run, const Scene& scene) const final {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      const rdf::TermView term = run.term(node);
      const Order order = compare(Comparable(term), bound_.comparable);
      if (order == strict_ || (inclusive_ && order == Order::equal)) continue;
      run.violation(scene, *this, node, [&] {
        const std::string words =
            order == Order::unordered ? unordered(run.plan(), scene, term) : std::string(expected_) + " " + shown_value(bound_.term);
        return "expected " + words + ", found " + shown_value(term);
      });
    }
  }

 protected:
  Range(Iri component_iri, const rdf::TermView& bound, Order strict, bool inclusive, std::string_view expected)
      : Constraint(component_iri), bound_(bound), strict_(strict), inclusive_(inclusive), expected_(expected) {}

  template <class C>
  static void build_as(Compiler& compiler, const Draft& shape, Iri parameter) {
    const auto bound = compiler.value(shape, parameter);
    if (!compiler.term(*bound).is_literal()) return compiler.fail(shape.id, parameter, *bound, "a literal");
    compiler.add<C>(shape, compiler.term(*bound));
  }

 private:
  /// The expectation for a value that cannot be compared with the bound.
  std::string unordered(const Plan& plan, const Scene& scene, const rdf::TermView& found) const {
    if (is_number(found)) return "a finite number";  // NaN
    const std::string words = expectation(plan, scene.shape.id);
    if (is_number(bound_.term.view())) return words == "an integer" ? words : "a number";
    return words.rfind("a date", 0) == 0 ? words : "a value that can be compared with " + shown(bound_.term);
  }
  struct Bound {  // owns the text that the comparable refers to
    explicit Bound(const rdf::TermView& view) : term(view), comparable(term.view()) {}
    rdf::Term term;
    Comparable comparable;
  };
  Bound bound_;
  Order strict_;
  bool inclusive_;
  std::string_view expected_;
};

/// SHACL 4.3.1 sh:minExclusive: every value node is greater.
class MinExclusive final : public Range {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<MinExclusive>(c, shape, sh::minExclusive); }
  explicit MinExclusive(const rdf::TermView& bound) : Range(sh::MinExclusiveConstraintComponent, bound, Order::greater, false, "more than") {}
};

/// SHACL 4.3.2 sh:minInclusive: every value node is greater or equal.
class MinInclusive final : public Range {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<MinInclusive>(c, shape, sh::minInclusive); }
  explicit MinInclusive(const rdf::TermView& bound) : Range(sh::MinInclusiveConstraintComponent, bound, Order::greater, true, "at least") {}
};

/// SHACL 4.3.3 sh:maxExclusive: every value node is less.
class MaxExclusive final : public Range {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<MaxExclusive>(c, shape, sh::maxExclusive); }
  explicit MaxExclusive(const rdf::TermView& bound) : Range(sh::MaxExclusiveConstraintComponent, bound, Order::less, false, "less than") {}
};

/// SHACL 4.3.4 sh:maxInclusive: every value node is less or equal.
class MaxInclusive final : public Range {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<MaxInclusive>(c, shape, sh::maxInclusive); }
  explicit MaxInclusive(const rdf::TermView& bound) : Range(sh::MaxInclusiveConstraintComponent, bound, Order::less, true, "at most") {}
};

}  // namespace

const Component components::min_exclusive{{{sh::minExclusive, true}}, false, &MinExclusive::build};
const Component components::min_inclusive{{{sh::minInclusive, true}}, false, &MinInclusive::build};
const Component components::max_exclusive{{{sh::maxExclusive, true}}, false, &MaxExclusive::build};
const Component components::max_inclusive{{{sh::maxInclusive, true}}, false, &MaxInclusive::build};

}  // namespace lrt::shacl
