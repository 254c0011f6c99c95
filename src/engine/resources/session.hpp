// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>

#include "src/engine/resource.hpp"
#include "src/security/sessions.hpp"

namespace lrt::engine {
inline namespace v0 {

/// A resource about the caller instead of the robot. It needs a principal and no right, accepts no body, and must not be cached.
class CallerResource : public Resource {
 public:
  CallerResource(const char* location, security::Sessions& sessions) : Resource(location, nullptr), sessions_(sessions) {}
  void describe(const Description&) const override {}
  void describe_types(About&, const Description&) const override {}
  const Variants& variants() const override;
  Input input(const EngineOptions&) const override { return {nullptr, true, 0}; }
  bool is_about_caller() const noexcept override { return true; }
  bool is_rdf_source() const noexcept override { return false; }

 protected:
  security::Sessions& sessions_;
};

/// "/ns/session": GET describes the caller, POST starts a session (a login), DELETE ends it.
class SessionResource final : public CallerResource {
 public:
  static constexpr const char* location = "/ns/session";
  explicit SessionResource(security::Sessions& sessions) : CallerResource(location, sessions) {}
  Methods methods() const noexcept override { return {false, true, true}; }
  std::string_view kind() const noexcept override { return "session"; }
  http::Response respond(const Context& context, const Caller& caller, const Responses& responses) override;

 private:
  http::Response begin(const Context& context, const Caller& caller, const Responses& responses);
};

/// "/ns/ticket": POST makes a ticket for one WebSocket or event stream.
class TicketResource final : public CallerResource {
 public:
  static constexpr const char* location = "/ns/ticket";
  explicit TicketResource(security::Sessions& sessions) : CallerResource(location, sessions) {}
  Methods methods() const noexcept override { return {false, true, false}; }
  std::string_view kind() const noexcept override { return "ticket"; }
  http::Response respond(const Context& context, const Caller& caller, const Responses& responses) override;
};

}  // namespace v0
}  // namespace lrt::engine
