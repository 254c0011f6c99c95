// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <lrt/base/result.hpp>

#include "src/engine/command_rules.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/resource.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

class CollectionResource;

/// A member of a collection: the value that a client created it with.
class MemberResource final : public ValueResource {
 public:
  MemberResource(std::string its_path, CollectionResource& its_collection, std::string its_id, rdf::Value its_value);

  Methods methods() const noexcept override;
  Outcome remove(Context& context, Parts& parts) override;
  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"member", Trait::commands};
    return kind;
  }
  const model::ResourceSpec* command() const noexcept override;
  void summarize(Overview& o) const override;
  const Variants& variants() const override { return value_variants(); }
  std::optional<PlainValue> plain_value(const Audience& audience) const override;
  bool fits_rdf(std::size_t max_values) const override { return fits(value, max_values); }
  std::uint64_t state(std::uint64_t) const noexcept override { return revision; }
  std::string up() const override;

  CollectionResource& collection;
  const std::string member_id;  ///< its name for the user's lambdas
  const rdf::Value value;

 private:
  void removed(const Result<void>& result, Refusal refusal, Ticket ticket, Parts& parts, TimePoint now);
  bool removing_ = false;
};

/// A container whose members clients create and remove (SPEC 2, LDP 5).
class CollectionResource final : public Resource, public Container {
 public:
  CollectionResource(std::string its_path, ThingNode* its_thing, std::shared_ptr<model::CollectionSpec> s);
  ~CollectionResource() override;

  Methods methods() const noexcept override;
  Outcome post(Context& context, Parts& parts) override;
  Input input(const EngineOptions& options) const override { return input_of(*spec, *spec->type, spec->facets, options); }
  std::string input_shape() const override { return spec->path; }
  void describe(const Description& d) const override;
  void describe_controls(About& about, const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"collection", Trait::plain_bodies | Trait::commands};
    return kind;
  }
  const model::ResourceSpec* command() const noexcept override { return spec.get(); }
  void summarize(Overview& o) const override;
  void overview(Overview& o) const override;
  std::uint64_t state(std::uint64_t) const noexcept override { return revision; }
  const Container* container() const noexcept override { return this; }
  using Container::members;
  std::vector<Resource*> members() const override;

  /// The collection is removed. Requests that wait for its lambdas get 404.
  void removed(Parts& parts);

  const std::shared_ptr<model::CollectionSpec> spec;

 private:
  friend class MemberResource;
  void created(const std::string& new_id, rdf::Value value, const Result<void>& result, Refusal refusal, Ticket ticket, Parts& parts, TimePoint now);

  std::vector<std::unique_ptr<MemberResource>> members_;
  std::size_t creating_ = 0;                              ///< in the create lambda
  std::map<Ticket, std::shared_ptr<CancelToken>> calls_;  ///< running create and remove lambdas
};

/// Describes a container: its types, and its members page by page (LDP 5.2, 7.2).
void describe_container(About& about, const Container& container, const Description& d);
void describe_container_types(About& about);

}  // namespace v0
}  // namespace lrt::engine
