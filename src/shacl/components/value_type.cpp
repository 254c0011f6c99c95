// SPDX-License-Identifier: Apache-2.0
// SHACL 4.1 Value Type Constraint Components

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/shacl/components/all.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// Describes the expected node, for a message about a literal in its place. Empty if the shape does not describe it.
std::string words_for_node(const Plan& plan, rdf::TermId shape) {
  std::string words = expectation(plan, shape);
  const bool number = words == "a number" || words.rfind("an integer", 0) == 0;
  return number ? words + " with its unit, as a node with vom:numericalValue" : words;
}

/// SHACL 4.1.1 sh:class: every value node is an instance of the class or of one of its subclasses in the data. Values: IRIs; each is a
/// constraint.
class Class final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    for (const Constant c : compiler.iris(shape, sh::class_)) compiler.add<Class>(shape, c);
  }
  explicit Class(Constant wanted) noexcept : Constraint(sh::ClassConstraintComponent), wanted_(wanted) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      if (run.is_instance(node, wanted_)) continue;
      run.violation(scene, *this, node, [&] {
        const rdf::TermView term = run.term(node);
        const std::string words = term.is_literal() ? words_for_node(run.plan(), scene.shape.id) : std::string();
        if (!words.empty()) return "expected " + words + ", found " + shown_value(term);
        return "expected an instance of " + shown(run.plan().graph.term(wanted_)) + ", found " + shown(term);
      });
    }
  }

 private:
  Constant wanted_;
};

/// SHACL 4.1.2 sh:datatype: every value node is a literal of the datatype; it must be well-formed if RDF 1.1 lists the datatype.
class Datatype final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    for (const Constant c : compiler.iris(shape, sh::datatype)) compiler.add<Datatype>(shape, std::string(compiler.term(c).text));
  }
  explicit Datatype(std::string iri) : Constraint(sh::DatatypeConstraintComponent), iri_(std::move(iri)), known_(rdf::lexical::datatype_of(iri_)) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      const rdf::TermView term = run.term(node);
      const bool typed = term.is_literal() && term.datatype == iri_;
      if (typed && rdf::lexical::is_well_formed(term.text, known_)) continue;
      run.violation(scene, *this, node, [&] {
        const std::string words = expectation(run.plan(), scene.shape.id);
        // A number that rdf::completed() could not give the datatype.
        if (is_number(term) && iri_ == vocab::xsd::float_.text)
          return "expected a number that a float of 32 bits can hold, found " + shown_value(term);
        if (is_number(term) && iri_ == vocab::xsd::double_.text) return "expected a finite number, found " + shown_value(term);
        if (!words.empty()) return "expected " + words + ", found " + (typed || is_number(term) ? shown_value(term) : shown(term));
        return "expected a " + std::string(typed ? "well-formed " : "") + shown(Iri(std::string_view(iri_))) + ", found " + shown(term);
      });
    }
  }

 private:
  std::string iri_;
  rdf::lexical::Datatype known_;
};

/// SHACL 4.1.3 sh:nodeKind: every value node has one of the given kinds.
class NodeKind final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    const auto value = compiler.value(shape, sh::nodeKind);
    constexpr struct {
      Iri kind;
      unsigned allowed;
      std::string_view expected;
    } kinds[] = {{sh::IRI, iri, "an IRI"},
                 {sh::BlankNode, blank, "a blank node"},
                 {sh::Literal, literal, "a literal"},
                 {sh::BlankNodeOrIRI, blank | iri, "a blank node or an IRI"},
                 {sh::BlankNodeOrLiteral, blank | literal, "a blank node or a literal"},
                 {sh::IRIOrLiteral, iri | literal, "an IRI or a literal"}};
    for (const auto& k : kinds)
      if (compiler.term(*value) == rdf::TermView(k.kind)) return compiler.add<NodeKind>(shape, k.allowed, k.expected);
    compiler.fail(shape.id, sh::nodeKind, *value, "one of the six node kinds (sh:IRI, ...)");
  }
  NodeKind(unsigned allowed, std::string_view expected) noexcept
      : Constraint(sh::NodeKindConstraintComponent), allowed_(allowed), expected_(expected) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      const rdf::TermView term = run.term(node);
      const unsigned kind = term.is_iri() ? iri : term.is_blank() ? blank : literal;
      if ((allowed_ & kind) != 0) continue;
      run.violation(scene, *this, node, [&] {
        const std::string words = allowed_ == (blank | iri) ? words_for_node(run.plan(), scene.shape.id) : std::string();
        return "expected " + (words.empty() ? std::string(expected_) : words) + ", found " + (words.empty() ? shown(term) : shown_value(term));
      });
    }
  }

 private:
  static constexpr unsigned iri = 1, blank = 2, literal = 4;
  unsigned allowed_;
  std::string_view expected_;
};

}  // namespace

const Component components::class_{{{sh::class_, false}}, false, &Class::build};
const Component components::datatype{{{sh::datatype, true}}, false, &Datatype::build};
const Component components::node_kind{{{sh::nodeKind, true}}, false, &NodeKind::build};

}  // namespace lrt::shacl
