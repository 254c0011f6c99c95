// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/shacl/shapes.hpp>

#include "src/engine/contract.hpp"
#include "src/engine/resource.hpp"

namespace lrt::engine {

/// A compiled Blueprint, with the index of the base IRI for which it was compiled.
struct CompiledShapes {
  std::size_t base;
  shacl::Shapes shapes;
};

/// The shapes that the user gave for a Thing, in addition to the Blueprint of its kind (R1.11). The state of the Thing conforms to both (SPEC 2).
class BlueprintResource final : public ValueResource {
 public:
  using ValueResource::ValueResource;
  void describe(const Description& d) const override;
  void describe_types(About&, const Description&) const override {}
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"blueprint"};
    return kind;
  }
  void overview(Overview& o) const override;
  bool shows_fragment(std::string_view fragment, const Audience& audience) const override;
  std::string described_by(const std::string&) const override { return {}; }
  Reads reads() const noexcept override { return Reads::known_values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;
  void path_changed() override;
};

/// A generated shape of values.
/// @param iri     its name
/// @param facets  those of the values, perhaps without bounds
void describe_generated(const Description& d, const std::string& iri, const ValueShape& values, const rdf::Facets& facets);

/// Repeats the generated shape of values under a name, with the bounds of the Thing, if it can stand in two documents: that of the user, and one of
/// lists, have blank nodes, and stand in the Blueprint only.
void describe_value_shape(const Description& d, const ThingNode& thing, const std::string& name);

/// Whether the generated shape of that name has bounds of numbers.
bool has_bounds(const ThingNode& thing, const std::string& name);

/// Whether the fragment of a Blueprint stands for something that an audience may know of: no shape of values, or one of values that it sees.
bool shows_shape(const ThingNode& thing, std::string_view fragment, const Audience& audience);

/// The shapes that the user gave, without those of values and of graphs that the audience does not see.
rdf::Graph seen_shapes(const ThingNode& thing, const Audience& audience);

/// Whether the user has given the shape of that name.
bool has_user_shape(const ThingNode& thing, const std::string& name);

/// The Blueprints of a Thing and its kind, compiled for one base. They are compiled once, for the first body, or at registration when the user gave
/// shapes, which may be ill-formed. Things without a Blueprint of their own share those of their kind and bounds.
/// @par Errors  expected_value, unsupported_syntax, limit_exceeded: of shacl::Shapes::compile
Result<shacl::Shapes> compiled_shapes(ThingNode& thing, std::size_t base, const EngineView& engine);

}  // namespace lrt::engine
