// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>

#include "src/base/thin_vector.hpp"
#include "src/engine/resource.hpp"
#include "src/engine/resources/blueprint.hpp"

namespace lrt::engine {
inline namespace v0 {

struct ThingNode;

/// A named shape of values: of a property, of the input or result of an action, or of the members of a collection.
struct ValueShape {
  std::string name;  ///< "rotation", "actions/rotate/input"
  const rdf::Type* type;
  const rdf::Facets* facets;
  bool input;  ///< clients send such values
};

/// The value shapes of a Thing, in the order of registration. Equal Things have as many.
std::vector<ValueShape> value_shapes(const ThingNode& thing);
/// The resource that takes or has the values of a value shape.
const Resource* shaped_resource(const ThingNode& thing, std::size_t value_shape);

/// The Blueprint of Things that were registered in the same way (R1.11, SPEC 3.12), "/blueprints/RevoluteJoint": which types, links, properties
/// and actions they have, and the shapes of their values. Bounds that differ between the Things are in their own Blueprints.
class KindResource final : public ValueResource {
 public:
  static constexpr std::string_view folder = "/blueprints";
  /// @param its_number   of the kinds with that name, from 1
  /// @param its_changes  of the resources of its Things
  KindResource(std::string its_name, unsigned its_number, std::string its_signature, ChangeLog& its_changes)
      : ValueResource(usual_path(its_name, its_number), nullptr, folder.size()),
        name(std::move(its_name)),
        number(its_number),
        signature(std::move(its_signature)),
        changes(its_changes) {}
  static std::string usual_path(const std::string& name, unsigned number);

  void describe(const Description& d) const override;
  /// The same without targets: bodies are validated by the shape of a given name.
  void describe_shapes(const Description& d) const { describe(d, false); }
  void describe_types(About&, const Description&) const override {}
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"blueprint"};
    return kind;
  }
  void overview(Overview& o) const override;
  std::string described_by(const std::string&) const override { return {}; }
  std::string up() const override { return "/"; }
  /// It is shown if the audience sees one of its Things.
  bool is_shown_to(const Audience& audience) const override;
  Reads reads() const noexcept override { return Reads::known_values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;
  void path_changed() override;

  void join(ThingNode& thing);
  void leave(ThingNode& thing);
  /// The bounds of a value shape are the same for all Things.
  bool shares_bounds(std::size_t value_shape) const { return shared_[value_shape]; }
  bool shares_all_bounds() const { return std::find(shared_.begin(), shared_.end(), false) == shared_.end(); }
  /// The state of its Things as a record. Bounds are those of the first Thing.
  const rdf::Type& state_type() const;
  /// Its fields that an audience sees at one of the Things or more.
  std::vector<rdf::FieldType> state_fields(const ThingNode& member, const Audience& audience) const;

  const std::string name;
  const unsigned number;
  const std::string signature;
  ChangeLog& changes;
  std::vector<ThingNode*> things;
  ThinVector<CompiledShapes> compiled_shapes;  ///< for its Things without a Blueprint of their own, from the first body on

 private:
  void describe(const Description& d, bool with_targets) const;
  std::vector<ThingNode*> members_seen_by(const Audience& audience) const;
  void set_shared(std::vector<bool> shared);
  std::vector<bool> shared_;  ///< by value shape
  mutable std::unique_ptr<const rdf::Type> state_type_;
};

/// The kinds of the registered Things.
class Kinds {
 public:
  explicit Kinds(Registry& registry) : registry_(registry) {}
  /// Finds or makes the kind of the Thing.
  void join(ThingNode& thing);
  /// Removes the kind with its last Thing.
  void leave(ThingNode& thing);
  /// Removes all kinds, after their Things.
  void clear() noexcept {
    kinds_.clear();
    first_free_.clear();
  }

 private:
  Registry& registry_;
  std::map<std::string, std::unique_ptr<KindResource>> kinds_;  ///< by signature
  std::map<std::string, unsigned> first_free_;                  ///< by name: no lower number is free; absent: 1 may be
};

}  // namespace v0
}  // namespace lrt::engine
