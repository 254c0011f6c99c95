// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <string>
#include <vector>

#include <lrt/rdf/type.hpp>

#include "src/engine/resource.hpp"
#include "src/engine/resources/plain_state.hpp"

namespace lrt::engine {

/// Describes a part of a document with values of several properties: a property that has no present value says why.
/// @param left  how many members the RDF of the document may still have; counted down
void describe_in_whole(const Resource& part, const Description& d, std::size_t& left);

/// The states of a Thing and of all Things below it as one document, or of all Things of the server (lrt:all): one request instead of
/// hundreds. A property that cannot be read now says why in it.
class TreeResource final : public ValueResource {
 public:
  /// @param its_thing  nullptr: all Things of `registry`
  TreeResource(const std::string& its_path, ThingNode* its_thing, const Registry* registry = nullptr)
      : ValueResource(its_path, its_thing, its_path.size()), registry_(registry) {}

  void describe(const Description& d) const override;
  void describe_types(About&, const Description&) const override {}
  std::vector<const Resource*> described_resources(const Audience& audience) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"all"};
    return kind;
  }
  const Variants& variants() const override { return value_variants(); }
  /// The state of a Thing with a member for each Thing below it, by its relative path.
  std::optional<PlainValue> plain_value(const Audience& audience) const override;
  void describe_part(const Resource& part, const Description& d, std::size_t& left) const override { describe_in_whole(part, d, left); }
  std::size_t max_bytes(const EngineOptions& options) const noexcept override;
  std::uint64_t state(std::uint64_t structure) const noexcept override;
  std::string up() const override;
  Reads reads() const noexcept override { return Reads::readable_values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;
  /// The tree of a Thing is shown if the audience sees a Thing below.
  bool is_shown_to(const Audience& audience) const override;

 private:
  void for_each_thing(FunctionRef<void(const ThingNode&)> visit) const;
  void add_children(PlainState& state, const ThingNode& one, std::size_t prefix, const Audience& audience) const;
  void add_member(PlainState& state, const ThingNode& member, std::size_t prefix, const Audience& audience) const;

  const Registry* const registry_;
  mutable std::list<rdf::Type> types_;  ///< of the last plain_value()
};

}  // namespace lrt::engine
