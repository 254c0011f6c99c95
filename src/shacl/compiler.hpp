#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/shacl/shapes.hpp>

#include "src/shacl/plan.hpp"

namespace lrt::shacl {

class Compiler;

/// A shape while its constraints are made.
struct Draft {
  ShapeIndex index;
  rdf::TermId id;
  bool is_property_shape;
};

/// What a constraint component says about itself (SHACL 4): its parameters, where it may stand, and how its constraints are
/// made.
struct Component {
  struct Parameter {
    Iri predicate;
    bool single;  ///< at most one value in a shape
  };
  std::vector<Parameter> parameters;
  bool property_shapes_only = false;  ///< the first parameter makes a node shape ill-formed
  /// Adds the constraints that the shape's values of the parameters declare.
  void (*build)(Compiler&, const Draft&) = nullptr;
};

/// All components of SHACL Core, in order of section 4.
const std::vector<const Component*>& all_components();

/// Makes a Plan of a shapes graph. The first fault stays; what is asked after it answers with nothing.
class Compiler {
 public:
  Compiler(Plan& plan, const CompileOptions& options) : plan_(plan), graph_(plan.graph), options_(options) {}

  Result<void> run();

  // What components ask. `predicate` is the parameter; every fault names the triple.
  const rdf::Graph& graph() const noexcept { return graph_; }
  const CompileOptions& options() const noexcept { return options_; }
  rdf::TermView term(rdf::TermId id) const noexcept { return graph_.term(id); }
  std::vector<rdf::TermId> values(rdf::TermId subject, Iri predicate) const;
  std::optional<rdf::TermId> value(const Draft& shape, Iri predicate) const;
  std::vector<Constant> iris(const Draft& shape, Iri predicate);
  std::optional<std::int64_t> integer(const Draft& shape, Iri predicate);   ///< xsd:integer; beyond int64 the nearest
  bool flag(const Draft& shape, Iri predicate);                             ///< xsd:boolean; true only if it is written "true"
  std::optional<std::string_view> text(const Draft& shape, Iri predicate);  ///< xsd:string
  std::optional<std::vector<rdf::TermId>> list(const Draft& shape, Iri predicate, rdf::TermId head);
  /// The index of a shape that the compiler has found, of any kind or of the kind asked for.
  ShapeIndex shape(rdf::TermId id) const noexcept { return plan_.find(id); }
  bool is_property_shape(rdf::TermId id) const noexcept;
  /// The predicate that the path of a property shape consists of, if it does.
  std::optional<Constant> path_predicate(rdf::TermId shape) const;

  void fail(rdf::TermId subject, Iri predicate, rdf::TermId object, std::string_view expected,
            Errc code = Errc::expected_value);
  void fail(std::string message, Errc code = Errc::expected_value);

  template <class C, class... Arguments>
  void add(const Draft& shape, Arguments&&... arguments) {
    plan_.shapes[shape.index].constraints.push_back(std::make_unique<C>(std::forward<Arguments>(arguments)...));
  }

 private:
  std::optional<rdf::TermId> find(Iri iri) const noexcept { return graph_.find(iri); }
  bool is_instance(rdf::TermId node, Iri class_iri) const;
  void refuse_unsupported();
  void find_shapes();
  void add_shape(rdf::TermId id);
  void add_shape_value(const rdf::Triple& triple);
  void compile_shape(ShapeIndex index);
  void compile_targets(ShapeIndex index);
  PathIndex compile_path(rdf::TermId owner, rdf::TermId node, std::size_t depth);
  PathIndex add_path(Path path);
  void mark_recursive();

  Plan& plan_;
  const rdf::Graph& graph_;
  const CompileOptions& options_;
  std::unordered_map<std::uint32_t, PathIndex> predicate_paths_;
  std::size_t path_size_ = 0;
  std::optional<Error> fault_;
};

}  // namespace lrt::shacl
