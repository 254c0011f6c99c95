// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/type.hpp>

#include "src/base/thin_vector.hpp"
#include "src/engine/description.hpp"
#include "src/engine/resource.hpp"
#include "src/engine/resources/blueprint.hpp"

namespace lrt::engine {
inline namespace v0 {

struct ThingNode;

class BoundsResource;

/// A Blueprint that Things share. It is the class of these Things. Its IRI has a hash of what it says, so that it never judges what was registered
/// in another way (SPEC 3.12).
class SharedBlueprint : public ValueResource {
 public:
  static constexpr std::string_view folder = "/blueprints";
  explicit SharedBlueprint(std::string its_path) : ValueResource(std::move(its_path), nullptr, folder.size()) {}

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
  bool shows_fragment(std::string_view fragment, const Audience& audience) const override;
  Reads reads() const noexcept override { return Reads::known_values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;
  void path_changed() override;

  std::vector<ThingNode*> things;
  ThinVector<CompiledShapes> compiled_shapes;  ///< for its Things without a Blueprint of their own, from the first body on

 protected:
  /// Things that differ in what the audience sees.
  std::vector<const ThingNode*> members_seen_by(const Audience& audience) const;
};

/// The Blueprint of Things that were registered in the same way (R1.11, SPEC 3.12), "/blueprints/RevoluteJoint-1a2b3c4d": which types, links,
/// properties and actions they have, and the shapes of their values without bounds of numbers.
class KindResource final : public SharedBlueprint {
 public:
  /// @param its_changes  of the resources of its Things
  KindResource(std::string its_path, std::string its_name, std::string its_signature, std::optional<std::string> its_rules, ChangeLog& its_changes);
  ~KindResource() override;

  void describe(const Description& d) const override;
  void join(ThingNode& thing, Registry& registry);
  void leave(ThingNode& thing, Registry& registry);
  /// The state of its Things as a record. Bounds are those of the first Thing.
  const rdf::Type& state_type() const;
  /// Its fields that an audience sees at one of the Things or more.
  std::vector<rdf::FieldType> state_fields(const ThingNode& member, const Audience& audience) const;

  const std::string name;  ///< for people: "RevoluteJoint"
  const std::string signature;
  /// EngineOptions::rules_around() its Things. nullopt: it is the Blueprint of one Thing, of which callers may see more or less, with the bounds of its
  /// numbers; its IRI says nothing but the path of the Thing (0077).
  const std::optional<std::string> rules;
  ChangeLog& changes;

 private:
  mutable std::unique_ptr<const rdf::Type> state_type_;
  std::map<std::string_view, std::unique_ptr<BoundsResource>> bounds_;  ///< by bounds_of()
};

/// The shapes of values with the bounds that some Things of a kind have, "/blueprints/RevoluteJoint-1a2b3c4d-5e6f7a8b".
class BoundsResource final : public SharedBlueprint {
 public:
  BoundsResource(std::string its_path, std::string its_bounds, KindResource& its_kind)
      : SharedBlueprint(std::move(its_path)), bounds(std::move(its_bounds)), of(its_kind) {}
  void describe(const Description& d) const override;

  const std::string bounds;  ///< bounds_of() its Things
  KindResource& of;
};

/// The Blueprint of a kind.
/// @param self     its IRI
/// @param members  Things of the kind; those that differ in what the audience sees
void describe_kind(const Description& d, const std::string& self, const std::string& name, const std::vector<const ThingNode*>& members);

/// Constraints of properties that have either a value or an error (0068). What does not depend on the type is in a document once.
class ValueOrError {
 public:
  ValueOrError(rdf::Graph& graph, std::string vocabulary) : graph_(graph), vocabulary_(std::move(vocabulary)) {}
  /// Adds to a shape of the property: it has a value that conforms to a shape, or an error and no value. One that promises no value may have neither.
  void conforms(const About& constraint, const PropertyResource& property, const std::string& shape);
  /// Adds to a shape of the property: it has no error, or no value.
  /// @param is_timed  a value has a time
  void has_no_error(const About& constraint, const PropertyResource& property, bool is_timed);

 private:
  /// A shape of its own for each use: not each SHACL engine judges a node by one shape twice.
  rdf::TermId absence(const PropertyResource& property);

  rdf::Graph& graph_;
  const std::string vocabulary_;
  std::optional<rdf::TermId> with_error_, without_error_, timed_without_error_;
};

/// The kinds of the registered Things.
class Kinds {
 public:
  explicit Kinds(Registry& registry) : registry_(registry) {}
  /// Finds or makes the kind of the Thing.
  void join(ThingNode& thing, const EngineView& engine);
  /// Removes the kind with its last Thing.
  void leave(ThingNode& thing);
  /// The rules may have changed: Things that they tell apart now get other Blueprints.
  void renew(const EngineView& engine);
  /// Removes all kinds, after their Things.
  void clear() noexcept { kinds_.clear(); }

 private:
  Registry& registry_;
  std::map<std::string, std::unique_ptr<KindResource>> kinds_;  ///< by signature_of()
};

}  // namespace v0
}  // namespace lrt::engine
