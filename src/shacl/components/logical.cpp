// SPDX-License-Identifier: Apache-2.0
// SHACL 4.6 Logical Constraint Components

#include <lrt/rdf/vocab.hpp>

#include "src/rdf/exactly_one.hpp"
#include "src/shacl/components/all.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// SHACL 4.6.1 sh:not: no value node conforms to the shape. Values: shapes; each is a constraint.
class Not final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    for (const rdf::TermId v : compiler.values(shape.id, sh::not_)) compiler.add<Not>(shape, compiler.shape(v));
  }
  explicit Not(ShapeIndex shape) noexcept : Constraint(sh::NotConstraintComponent), shape_(shape) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      if (!run.conforms(node, shape_)) continue;
      run.violation(scene, *this, node, [&] {
        return "expected a value that does not conform to " + shown_shape(run.plan(), shape_) + ", found " + shown(run.term(node));
      });
    }
  }
  void references(std::vector<ShapeIndex>& out) const override { out.push_back(shape_); }

 private:
  ShapeIndex shape_;
};

/// The common part of the other three. Values: lists of shapes; each list is a constraint.
class Several : public Constraint {
 public:
  void references(std::vector<ShapeIndex>& out) const final { out.insert(out.end(), shapes_.begin(), shapes_.end()); }

 protected:
  Several(Iri component_iri, std::vector<ShapeIndex> shapes) : Constraint(component_iri), shapes_(std::move(shapes)) {}
  template <class C>
  static void build_as(Compiler& compiler, const Draft& shape, Iri parameter) {
    for (const rdf::TermId head : compiler.values(shape.id, parameter)) {
      const auto members = compiler.list(shape, parameter, head);
      if (!members) return;
      std::vector<ShapeIndex> shapes;
      for (const rdf::TermId m : *members) shapes.push_back(compiler.shape(m));
      compiler.add<C>(shape, std::move(shapes));
    }
  }
  std::vector<ShapeIndex> shapes_;
};

/// SHACL 4.6.2 sh:and: every value node conforms to every shape of the list.
class And final : public Several {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<And>(c, shape, sh::and_); }
  explicit And(std::vector<ShapeIndex> shapes) : Several(sh::AndConstraintComponent, std::move(shapes)) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      for (const ShapeIndex shape : shapes_) {
        if (run.conforms(node, shape)) continue;
        run.violation_within(scene, *this, node, shape, [&] {
          return "expected a value that conforms to all of " + std::to_string(shapes_.size()) + " shapes, found " + shown(run.term(node));
        });
        break;
      }
    }
  }
};

/// SHACL 4.6.3 sh:or: every value node conforms to some shape of the list.
class Or final : public Several {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<Or>(c, shape, sh::or_); }
  explicit Or(std::vector<ShapeIndex> shapes) : Several(sh::OrConstraintComponent, std::move(shapes)) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      bool some = false;
      for (const ShapeIndex shape : shapes_) {
        some = run.conforms(node, shape);
        if (some || run.done()) break;
      }
      if (some) continue;
      run.violation(scene, *this, node, [&] { return message(run, scene, node); });
    }
  }

 private:
  static constexpr std::size_t max_shown = 4;

  std::string message(Run& run, const Scene& scene, Node node) const {
    if (std::string text = list_violation(run, scene); !text.empty()) return text;
    const std::string datatypes = alternative_datatypes(run.plan());
    if (datatypes.empty()) return reasons(run, node);
    const std::string words = expectation(run.plan(), scene.shape.id);
    return words.empty() ? "expected " + datatypes + ", found " + shown(run.term(node))
                         : "expected " + words + ", found " + shown_value(run.term(node));
  }
  /// Empty: some shape has no datatype.
  std::string alternative_datatypes(const Plan& plan) const {
    std::string text = "one of";
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      const auto datatype = plan.graph.object(plan.graph.term(plan.shapes[shapes_[i]].id), sh::datatype);
      if (!datatype) return {};
      if (i < max_shown) text += (i == 0 ? " " : ", ") + shown(*datatype);
    }
    return text + (shapes_.size() > max_shown ? ", ..." : "");
  }
  /// The violations of each alternative.
  std::string reasons(Run& run, Node node) const {
    std::string text;
    for (std::size_t i = 0; i < shapes_.size() && i < max_shown; ++i) {
      const std::string reason = run.reason(node, shapes_[i]);
      const bool excludes_value = reason.rfind("expected no value", 0) == 0;  // not useful for a client that sent a value
      if (!reason.empty() && !excludes_value) text += (text.empty() ? "" : "; or ") + reason;
    }
    if (text.empty()) text = "expected what conforms to one of " + std::to_string(shapes_.size()) + " shapes, found " + shown(run.term(node));
    return text + (shapes_.size() > max_shown ? "; or ..." : "");
  }
};

/// SHACL 4.6.4 sh:xone: every value node conforms to exactly one shape of the list.
class Xone final : public Several {
 public:
  static void build(Compiler& c, const Draft& shape) { build_as<Xone>(c, shape, sh::xone); }
  explicit Xone(std::vector<ShapeIndex> shapes) : Several(sh::XoneConstraintComponent, std::move(shapes)) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      std::size_t count = 0;
      for (const ShapeIndex shape : shapes_) {
        count += run.conforms(node, shape);
        if (count > 1 || run.done()) break;
      }
      if (count == 1) continue;
      run.violation(scene, *this, node, [&] {
        if (std::string text = alternatives_violation(run, scene, node); !text.empty()) return text;
        return "expected a value that conforms to exactly one of " + std::to_string(shapes_.size()) + " shapes, " + shown(run.term(node)) +
               (count == 0 ? " conforms to none" : " conforms to several");
      });
    }
  }

 private:
  /// The predicates of which the node should have exactly one, if the shapes are about the presence of a predicate each. One may be about that of none.
  std::string alternatives_violation(Run& run, const Scene& scene, Node node) const {
    rdf::ExactlyOne one;
    for (const ShapeIndex shape : shapes_) {
      const std::optional<std::string> name = required_predicate(run.plan(), scene.shape.id, run.plan().shapes[shape].id);
      if (!name) return {};
      if (!name->empty()) one.add(*name, run.conforms(node, shape));
    }
    return one.is_empty() ? std::string() : one.message();
  }
};

}  // namespace

const Component components::not_{{{sh::not_, false}}, false, &Not::build};
const Component components::and_{{{sh::and_, false}}, false, &And::build};
const Component components::or_{{{sh::or_, false}}, false, &Or::build};
const Component components::xone{{{sh::xone, false}}, false, &Xone::build};

}  // namespace lrt::shacl
