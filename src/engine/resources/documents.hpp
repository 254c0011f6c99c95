// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "src/engine/resource.hpp"

namespace lrt::engine {
inline namespace v0 {

class ActionResource;
struct StopState;

/// "/": the list of Things (R0.4).
class RootResource final : public Resource, public Container {
 public:
  /// @param session  path of the session; empty: nobody can log in
  /// @param query    path of the endpoint of queries; empty: there is none
  RootResource(const Registry& registry, std::string terms, const Resource& all, std::string session, std::string query)
      : Resource("/", nullptr), registry_(registry), terms_(std::move(terms)), all_(all), session_(std::move(session)), query_(std::move(query)) {}
  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"root"};
    return kind;
  }
  void overview(Overview& o) const override;
  const Container* container() const noexcept override { return this; }
  std::vector<Resource*> members() const override;
  /// Things below a hidden one are members in its place.
  std::vector<Resource*> members(const Audience& audience) const override;
  void link_related(http::LinkWriter& links, const std::string& base) const override;
  std::string described_by(const std::string& base) const override { return base + terms_; }

 private:
  std::vector<const ActionResource*> stops() const;
  std::vector<const StopState*> stop_states() const;

  const Registry& registry_;
  const std::string terms_;
  const Resource& all_;  ///< all Things as one document
  const std::string session_, query_;
};

/// "/ns/lrt": the terms of lrt, and those of other vocabularies that it uses and that no server documents.
class TermsResource final : public Resource {
 public:
  static constexpr const char* location = "/ns/lrt";
  TermsResource() : Resource(location, nullptr) {}
  void describe(const Description& d) const override;
  void describe_types(About&, const Description&) const override {}
  const Variants& variants() const override { return graph_variants(); }
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"terms", Trait::no_rdf_source | Trait::term_list};
    return kind;
  }
  std::uint64_t state(std::uint64_t) const noexcept override { return 1; }
};

/// "/ns/context.jsonld": the JSON-LD context. Representations refer to it with a version of its text in the query, so that it may be kept
/// for a day.
class ContextResource final : public Resource, public OwnRepresentation {
 public:
  static constexpr const char* location = "/ns/context.jsonld";
  explicit ContextResource(std::string text) : Resource(location, nullptr), text_(std::move(text)) {}
  void describe(const Description&) const override {}
  void describe_types(About&, const Description&) const override {}
  const Variants& variants() const override { return context_variants(); }
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"context", Trait::no_rdf_source};
    return kind;
  }
  const OwnRepresentation* own_representation() const noexcept override { return this; }
  std::optional<std::string_view> document() const override { return text_; }
  std::uint64_t state(std::uint64_t) const noexcept override { return 1; }
  std::string_view cache_control() const noexcept override { return "max-age=86400"; }

 private:
  const std::string text_;
};

}  // namespace v0
}  // namespace lrt::engine
