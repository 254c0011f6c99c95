// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include <lrt/rdf/graph.hpp>

namespace lrt::shacl {
inline namespace v0 {

class Run;
struct Scene;

/// A term of the shapes graph. Run finds its number in the data graph, at most once.
using Constant = rdf::TermId;
using ShapeIndex = std::uint32_t;
using PathIndex = std::uint32_t;
inline constexpr std::uint32_t nothing = 0xFFFFFFFF;

/// SHACL 2.3.1, as a tree in Plan::paths.
struct Path {
  enum class Kind : std::uint8_t { predicate, inverse, sequence, alternative, zero_or_more, one_or_more, zero_or_one };
  Kind kind = Kind::predicate;
  Constant predicate{};
  std::vector<PathIndex> parts;  ///< one part; sequence, alternative: two or more
};

/// One constraint of one shape (SHACL 4): a component with its parameters.
class Constraint {
 public:
  explicit Constraint(Iri component_iri) noexcept : component(component_iri) {}
  virtual ~Constraint() = default;
  Constraint(const Constraint&) = delete;
  Constraint& operator=(const Constraint&) = delete;

  /// Validates the value nodes of a focus node and reports each violation to `run`.
  virtual void check(Run& run, const Scene& scene) const = 0;
  /// The shapes it refers to.
  virtual void references(std::vector<ShapeIndex>&) const {}

  const Iri component;
};

struct Shape {
  rdf::TermId id{};
  PathIndex path = nothing;  ///< nothing: a node shape
  bool deactivated = false;
  bool recursive = false;  ///< refers to itself or to a recursive shape
  rdf::TermId severity{};
  std::vector<rdf::TermId> messages;
  std::vector<std::unique_ptr<Constraint>> constraints;

  // SHACL 2.1.3
  std::vector<Constant> target_nodes, target_classes, target_subjects_of, target_objects_of;
  bool has_target() const noexcept {
    return !target_nodes.empty() || !target_classes.empty() || !target_subjects_of.empty() || !target_objects_of.empty();
  }
};

/// Compiled shapes. Immutable.
struct Plan {
  rdf::Graph graph;
  std::vector<Shape> shapes;
  std::vector<Path> paths;
  std::unordered_map<std::uint32_t, ShapeIndex> index;  ///< from TermId of `graph`
  Constant type{}, sub_class_of{};                      ///< rdf:type, rdfs:subClassOf

  ShapeIndex find(rdf::TermId id) const noexcept {
    const auto at = index.find(static_cast<std::uint32_t>(id));
    return at == index.end() ? nothing : at->second;
  }
};

}  // namespace v0
}  // namespace lrt::shacl
