// SPDX-License-Identifier: Apache-2.0
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

/// A shape during compilation.
struct Draft {
  ShapeIndex index;
  rdf::TermId id;
  bool is_property_shape;
};

/// A constraint component (SHACL 4): its parameters, the shapes that may have it, and the function that makes its constraints.
struct Component {
  struct Parameter {
    Iri predicate{};
    bool single = false;  ///< at most one value in a shape
  };
  Parameter parameters[4];            ///< up to the first empty one
  bool property_shapes_only = false;  ///< the first parameter makes a node shape ill-formed
  /// Adds the constraints that the parameters of the shape declare.
  void (*build)(Compiler&, const Draft&) = nullptr;
};

/// All components of SHACL Core, in order of section 4.
const std::vector<const Component*>& all_components();

/// Compiles a shapes graph into a Plan. Keeps the first error; after it all functions return empty results.
class Compiler {
 public:
  Compiler(Plan& plan, const CompileOptions& options) : plan_(plan), graph_(plan.graph), options_(options) {}

  Result<void> run();

  // For components. `predicate` is the parameter; every error names the triple.
  const rdf::Graph& graph() const noexcept { return graph_; }
  const CompileOptions& options() const noexcept { return options_; }
  rdf::TermView term(rdf::TermId id) const noexcept { return graph_.term(id); }
  std::vector<rdf::TermId> values(rdf::TermId subject, Iri predicate) const;
  std::optional<rdf::TermId> value(const Draft& shape, Iri predicate) const;
  std::vector<Constant> iris(const Draft& shape, Iri predicate);
  std::optional<std::int64_t> integer(const Draft& shape, Iri predicate);   ///< xsd:integer; out of the range of int64: the nearest
  bool flag(const Draft& shape, Iri predicate);                             ///< xsd:boolean; true only if it is written "true"
  std::optional<std::string_view> text(const Draft& shape, Iri predicate);  ///< xsd:string
  std::optional<std::vector<rdf::TermId>> list(const Draft& shape, Iri predicate, rdf::TermId head);
  /// The index of a shape, optionally of the given kind.
  ShapeIndex shape(rdf::TermId id) const noexcept { return plan_.find(id); }
  bool is_property_shape(rdf::TermId id) const noexcept;
  /// The predicate of a property shape whose path is one predicate.
  std::optional<Constant> path_predicate(rdf::TermId shape) const;

  void fail(rdf::TermId subject, Iri predicate, rdf::TermId object, std::string_view expected, Errc code = Errc::expected_value);
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
