// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/http/message.hpp>

#include "src/engine/audience.hpp"
#include "src/engine/body_task.hpp"
#include "src/engine/expiry.hpp"
#include "src/engine/resource.hpp"
#include "src/http/prefer.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Page number of a container without its members (LDP 7.2.2, PreferMinimalContainer).
inline constexpr std::size_t minimal_page = 0;

/// A copy of a request that owns its bytes. The body is not copied: a request is deferred after its body was read.
class OwnedRequest {
 public:
  explicit OwnedRequest(const http::Request& request);
  const http::Request& view() const noexcept { return view_; }

 private:
  std::string bytes_;   ///< all texts of the request, one after the other
  http::Request view_;  ///< points into bytes_
};

/// A request in progress, with the facts derived from it. Each fact is derived once. A deferred request keeps its context.
class Context {
 public:
  Context(const http::Request& request, TimePoint at) : now(at), request_(&request) {}

  const http::Request& request() const noexcept { return *request_; }
  /// RFC 9110 9.2.1
  bool is_safe() const noexcept { return request_->method == "GET" || request_->method == "HEAD" || request_->method == "OPTIONS"; }
  /// Whether a request with this method has a body that the resource reads.
  bool has_input() const noexcept { return request_->method == "PUT" || request_->method == "POST" || request_->method == "PATCH"; }
  /// A context that owns its request and so outlives the call that the request came with.
  Context kept() const;

  /// The header field Accept, or the query parameter `accept` of a GET or HEAD instead of it (R0.17).
  std::optional<std::string_view> accept() const;
  const http::Preferences& preferences() const;
  bool wants_representation() const { return preferences().return_ == http::Preferences::Return::representation; }
  bool wants_minimal() const { return preferences().return_ == http::Preferences::Return::minimal; }

  /// Value of Vary: the fields by which the response to such a request differs (RFC 9110 12.5.5, RFC 7240 2). Prefer decides on the body of a
  /// PUT, on body and status of a POST, and on the members in a container's representation. Upgrade is not among them: it belongs to one
  /// connection (RFC 9110 7.6.1), and no cache keeps 101 or 201.
  std::string_view vary() const noexcept;

  /// Who has its share of the time of threads used for this request: the client; one that is not counted by its address.
  std::string share_key() const;

  TimePoint now;                                      ///< of the present step
  std::size_t base = 0;                               ///< index into Bases
  std::shared_ptr<const void> base_hold{};            ///< of `base`: Bases::hold()
  Resource* resource = nullptr;                       ///< nullptr: there is none, or it was removed
  ResourceId resource_id{};                           ///< of `resource`, for the time in between
  std::size_t page = 1;                               ///< of a container
  std::size_t first_link = 0;                         ///< the first link that did not fit into the previous response
  Audience audience{};                                ///< the sender
  std::uint64_t rights_revision = 0;                  ///< RightsChanges::number() as of that
  security::Rights rights = security::Rights::all();  ///< of these at `resource`
  std::optional<Ticket> ticket{};                     ///< of a request that is deferred
  std::shared_ptr<JudgedBody> judged{};               ///< its body, from a BodyJob; nullptr: not validated, or consumed
  Expiry expiry{};                                    ///< of a command, once CommandRules has judged it
  std::string client{};                               ///< Caller::client; share_key() is for all
  bool by_cookie = false;                             ///< Caller::by_cookie
  bool ignores_conditions = false;                    ///< If-Match and If-None-Match were already evaluated
  bool posts_query = false;                           ///< POST to its resource is a query: it changes nothing

 private:
  const http::Request* request_;
  std::shared_ptr<const OwnedRequest> owned_;
  mutable std::optional<std::optional<std::string_view>> accept_;
  mutable std::shared_ptr<const std::string> accept_text_;  ///< of accept_, unless that is a view of the request
  mutable std::optional<http::Preferences> preferences_;
};

/// Value of Vary for a GET of a resource. If rights depend on the caller, also the fields that identify the caller.
std::string_view vary_of(const Resource& resource, const Audience& audience) noexcept;

}  // namespace v0
}  // namespace lrt::engine
