#pragma once

#include <string>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/shacl/shapes.hpp>

#include "src/engine/resource.hpp"

namespace lrt::engine {

/// What a Thing promises and requires, as SHACL shapes (R1.11): its structure, the values of its Properties and members, what its
/// Actions consume and produce. The state of the Thing conforms (SPEC 2).
class BlueprintResource final : public Resource {
 public:
  using Resource::Resource;
  void describe(const Description& d) const override;
  void describe_types(About&) const override {}
  std::string_view kind() const noexcept override { return "blueprint"; }
  void overview(Overview& o) const override;
  std::string described_by(const std::string&) const override { return {}; }
  Reads reads() const noexcept override { return Reads::known_values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;
  void path_changed() override;
};

/// The shape of values under a name: the user's, taken literally, or the one that the type implies.
void describe_shape(rdf::Graph& graph, const ThingNode& thing, const std::string& base, const std::string& name, const rdf::Type& type,
                    const rdf::Facets& facets);

/// The Blueprint of a Thing, compiled for one base. It is compiled once, for the first body, or at registration when the user gave
/// shapes, which may be ill-formed.
/// @par Errors  expected_value, unsupported_syntax, limit_exceeded: of shacl::Shapes::compile
Result<const shacl::Shapes*> compiled_shapes(ThingNode& thing, std::size_t base, const EngineView& engine);

}  // namespace lrt::engine
