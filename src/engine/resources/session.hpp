// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "src/engine/resource.hpp"
#include "src/security/sessions.hpp"

namespace lrt::engine {

/// A resource about the caller instead of the robot. It needs a principal and no right, accepts no body, and must not be cached.
class CallerResource : public Resource, public OwnProtocol {
 public:
  CallerResource(const char* location, security::Sessions& sessions) : Resource(location, nullptr), sessions_(sessions) {}
  void describe(const Description&) const override {}
  void describe_types(About&, const Description&) const override {}
  const Variants& variants() const override;
  Input input(const EngineOptions&) const override { return {nullptr, true, 0}; }
  OwnProtocol* own_protocol() noexcept override { return this; }
  Outcome subscribe(Context& context, Parts& parts, Protocol) override { return *get(context, parts); }
  std::string_view posted_types() const noexcept override { return {}; }

 protected:
  security::Sessions& sessions_;
};

/// "/ns/session": GET describes the caller, POST starts a session (a login), DELETE ends it.
class SessionResource final : public CallerResource {
 public:
  static constexpr const char* location = "/ns/session";
  explicit SessionResource(security::Sessions& sessions) : CallerResource(location, sessions) {}
  Methods methods() const noexcept override { return {false, true, true}; }
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"session", Trait::about_caller | Trait::no_rdf_source};
    return kind;
  }
  std::optional<Outcome> get(Context& context, Parts& parts) override;
  Outcome post(Context& context, Parts& parts) override;
  Outcome remove(Context& context, Parts& parts) override;
};

/// "/ns/ticket": POST makes a ticket for one WebSocket or event stream.
class TicketResource final : public CallerResource {
 public:
  static constexpr const char* location = "/ns/ticket";
  explicit TicketResource(security::Sessions& sessions) : CallerResource(location, sessions) {}
  Methods methods() const noexcept override { return {false, true, false}; }
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"ticket", Trait::about_caller | Trait::no_rdf_source};
    return kind;
  }
  std::optional<Outcome> get(Context& context, Parts& parts) override;
  Outcome post(Context& context, Parts& parts) override;

 private:
  std::string lifetime() const;
};

}  // namespace lrt::engine
