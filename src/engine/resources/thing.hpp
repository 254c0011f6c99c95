// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>

#include "src/base/thin_vector.hpp"
#include "src/engine/control.hpp"
#include "src/engine/resource.hpp"
#include "src/engine/resources/blueprint.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/engine/resources/tree.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

class ActionResource;
class BoundsResource;
class CollectionResource;
class KindResource;
class PropertyResource;
struct StopState;

/// A Thing: links, the types of what it links to, and static triples, without values (SPEC 2).
class ThingResource : public Resource {
 public:
  using Resource::Resource;
  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{vocab::hybrit::RoboticThing};
    static constexpr ResourceKind kind{"thing", Trait::none, &observable};
    return kind;
  }
  void summarize(Overview& o) const override;
  void overview(Overview& o) const override;
  void link_related(http::LinkWriter& links, const std::string& base) const override;
  std::string up() const override;
  std::string_view cache_control() const noexcept override;
  void set_observed(bool observed, ChangeScanner& scanner) override;
  /// Of the texts of the user's shapes those that are not about something hidden; nullopt: all.
  virtual std::optional<std::vector<std::string>> shapes_seen_by(const Audience&) const { return std::nullopt; }
  /// Further resources that only this kind of Thing has.
  virtual std::vector<Resource*> more_resources() { return {}; }
  /// Called after its registration.
  virtual void attach(Parts&) {}
  /// Called before its removal.
  virtual void removed(Parts&) {}
};

/// A Thing with the values of all its Properties (lrt:state).
class StateResource final : public ValueResource {
 public:
  using ValueResource::ValueResource;
  void describe(const Description& d) const override;
  void describe_types(About&, const Description&) const override {}
  std::vector<const Resource*> described_resources(const Audience& audience) const override;
  const Variants& variants() const override { return value_variants(); }
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{vocab::lrt_::state};
    static constexpr ResourceKind kind{"state", Trait::none, &observable};
    return kind;
  }
  std::optional<PlainValue> plain_value(const Audience& audience) const override;
  void describe_part(const Resource& part, const Description& d, std::size_t& left) const override { describe_in_whole(part, d, left); }
  std::uint64_t state(std::uint64_t structure) const noexcept override;
  std::string_view cache_control() const noexcept override;
  void link_related(http::LinkWriter& links, const std::string& base) const override;
  Reads reads() const noexcept override { return Reads::readable_values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;
  void set_observed(bool observed, ChangeScanner& scanner) override;
  std::uint64_t change_number() const noexcept override { return number; }
  /// The time of the newest value.
  std::optional<Utc> value_time() const noexcept override;

  std::uint64_t number = 0;  ///< the changes of all its properties, which count them
};

/// The properties of a Thing that its state contains: all but files.
class StateProperties {
 public:
  using All = std::vector<std::unique_ptr<PropertyResource>>;
  class iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = PropertyResource*;
    using difference_type = std::ptrdiff_t;
    using pointer = PropertyResource* const*;
    using reference = PropertyResource*;

    iterator(All::const_iterator at, All::const_iterator end) : at_(at), end_(end) { skip_files(); }
    PropertyResource* operator*() const { return at_->get(); }
    iterator& operator++() {
      ++at_;
      skip_files();
      return *this;
    }
    friend bool operator==(const iterator& a, const iterator& b) { return a.at_ == b.at_; }
    friend bool operator!=(const iterator& a, const iterator& b) { return a.at_ != b.at_; }

   private:
    void skip_files();
    All::const_iterator at_, end_;
  };

  explicit StateProperties(const All& all) noexcept : all_(all) {}
  iterator begin() const { return {all_.begin(), all_.end()}; }
  iterator end() const { return {all_.end(), all_.end()}; }

 private:
  const All& all_;
};

/// The Turtle texts that the user gave for a Thing, parsed, with IRIs below placeholder_base.
struct ThingTexts {
  rdf::Graph statements, shapes;
};

/// A registered Thing: the resources that each Thing has, those it was given, and its place in the tree.
struct ThingNode {
  explicit ThingNode(std::unique_ptr<model::ThingSpec> s);
  ~ThingNode();

  /// Its own Blueprint: the shapes that the user gave.
  std::string names_base(const std::string& base) const { return base + blueprint.path; }
  /// Its own Blueprint is not empty.
  bool adds_shapes() const;
  bool adds_shapes(const Audience& audience) const;
  /// The Blueprints that it refers to: that of its kind or the external one, that of its bounds, and its own.
  std::vector<std::string> blueprint_iris(const std::string& base, const Audience& audience) const;
  /// The nearest Thing above that an audience sees; nullptr: there is none.
  const ThingNode* parent_seen_by(const Audience& audience) const;
  /// The Blueprint that has the shape of values under a name: its own, that of its bounds, or that of its kind.
  std::string shapes_of(const std::string& base, const std::string& name) const;
  std::string shape_iri(const std::string& base, const std::string& name) const { return shapes_of(base, name) + "#" + name; }
  /// The path of a Blueprint has changed.
  void shapes_moved();
  const rdf::Graph& statements() const noexcept;
  /// The shapes that the user gave.
  const rdf::Graph& user_shapes() const noexcept;
  /// The Dispatch of the lambdas of one of its resources.
  Dispatch where(const model::ResourceSpec& resource) const noexcept { return resource.dispatch.value_or(spec->dispatch); }
  /// The name of a shape that is not that of a property or collection of the user: "actions" + "/turn/input", "actions-lrt" + "/turn/input".
  std::string shape_name(std::string name, std::string_view rest = {}) const;
  /// The actions that are available now.
  std::vector<ActionResource*> available_actions() const;
  /// Its properties that its state contains.
  StateProperties in_state() const noexcept { return StateProperties(properties); }
  /// All its resources that have been there since its registration.
  std::vector<Resource*> resources();

  const std::unique_ptr<model::ThingSpec> spec;
  std::unique_ptr<ThingTexts> texts;           ///< null: there are none
  ThinVector<CompiledShapes> compiled_shapes;  ///< of a Thing with a Blueprint of its own, from the first body on
  const std::unique_ptr<ThingResource> own_self;
  ThingResource& self;
  StateResource state;
  BlueprintResource blueprint;
  SubscriptionsResource subscriptions;
  TreeResource tree;  ///< linked if there are Things below
  std::vector<std::unique_ptr<PropertyResource>> properties;
  ThinVector<std::unique_ptr<ActionResource>> actions;
  ThinVector<std::unique_ptr<CollectionResource>> collections;
  const std::unique_ptr<ControlBase> control;  ///< null: clients do not take control of it
  KindResource* kind = nullptr;                ///< set while it is registered
  const StopState* stop_state = nullptr;       ///< StopStates'; nullptr: none is declared
  BoundsResource* bounds = nullptr;            ///< set with the kind; null: no number has bounds
  ThingNode* parent = nullptr;                 ///< nullptr: below the root
  ThinVector<ThingNode*> children;             ///< in the order of registration
};

/// Of some Things those that an audience sees. The Things below take the place of one that it does not see, as if that one was not registered.
std::vector<ThingNode*> seen_things(const ThinVector<ThingNode*>& things, const Audience& audience);

}  // namespace v0
}  // namespace lrt::engine
