// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>

#include "src/engine/context.hpp"
#include "src/engine/cors.hpp"
#include "src/engine/description.hpp"
#include "src/engine/languages.hpp"
#include "src/engine/pending_requests.hpp"
#include "src/engine/property_values.hpp"
#include "src/engine/representation_cache.hpp"
#include "src/engine/responses.hpp"

namespace lrt::engine {

/// Makes representations and responds with them: negotiation, conditions, ranges (R0.9-R0.11, R1.2).
class Representations {
 public:
  /// A representation needs values or encodings that are not available yet.
  struct Missing {
    Encodings encodings;
  };
  /// The outcome of a request, or the refresh that it needs first.
  using Attempt = std::variant<Outcome, Missing>;
  /// @param current  the request was deferred for a refresh, which has just ended: its values are new enough. The step may defer it
  ///                 further, by returning Deferred.
  using Step = std::function<Attempt(Context&, bool current)>;
  using Selected = std::variant<Representation*, http::Response, Missing>;

  Representations(const EngineOptions& options, const EngineView& view, const Cors& cors, const Responses& responses, RepresentationCache& cache,
                  PropertyValues& values, PendingRequests& pending)
      : options_(options), view_(view), cors_(cors), responses_(responses), cache_(cache), values_(values), pending_(pending) {}

  /// GET and HEAD.
  Outcome get(Context& context);
  /// OPTIONS.
  http::Response options(const Context& context) const;
  /// The present representation as a response: 200, 206, 304, 406, 412, 416. The values are not refreshed.
  http::Response respond(Context& context);
  /// Runs a step. While values are missing, defers the request, refreshes the properties of its resource, and runs the step again.
  Outcome attempt(Context& context, Step step);
  /// The same for a request that is deferred already.
  void respond_when_read(Ticket ticket, Resource& resource, std::function<http::Response(Context&)> respond);

  /// The representation that suits the request best; the response if there is none.
  /// @param page  receives the HTML page if that suits best; nullptr: HTML is not offered
  Selected select(Context& context, std::optional<Representation>* page, bool current);
  /// The present representation in one variant.
  /// @par Errors  unsupported_syntax, limit_exceeded: the variant cannot represent the value; others: encoding failed
  /// @param languages  that the client wants; nullptr: none
  Result<Representation*> make(Resource& resource, std::size_t base, Variant variant, const Audience& audience, std::size_t page = 1,
                               const Languages* languages = nullptr);
  /// make() would return a representation that was made before.
  bool is_made(Resource& resource, std::size_t base, Variant variant, const Audience& audience) const;
  /// The representation as a message to subscribers.
  /// @param audience  for which it was made
  const subscription::Item& message_of(Representation& representation, const Audience& audience);
  /// The same as one event of an event stream.
  const subscription::Item& event_of(Representation& representation, const Audience& audience);
  /// 406 of a GET or HEAD if none of the media types is accepted, whatever the values are.
  std::optional<http::Response> unacceptable(const Context& context) const;
  /// If-Match and If-None-Match of a PUT, POST or DELETE: the response if they exclude it.
  /// @param lacks_encodings  set if a variant could not be compared because an encoder has to run first
  std::optional<http::Response> failed_precondition(const Context& context, bool* lacks_encodings = nullptr);
  bool ready(Resource& resource, Variant variant, bool current, const Audience& audience) {
    return values_.ready(resource, variant, current, audience);
  }

  /// The namespace of the server's own terms, for a base.
  std::string vocabulary(std::size_t base) const { return view_.vocabulary(view_.bases[base]); }
  const EngineView& view() const noexcept { return view_; }
  const std::string& base(std::size_t number) const { return view_.bases[number]; }
  std::shared_ptr<const void> hold_base(std::size_t number) const { return view_.bases.hold(number); }
  /// The graph of a resource, as far as the audience may see it.
  rdf::Graph describe(const Resource& resource, std::size_t base, const Audience& audience, std::size_t page = 1) const;

 private:
  http::Response respond_with(Representation& representation, const Context& context);
  http::Fields fields_of(Representation& representation, const Context& context);
  http::Fields not_modified_fields(const Representation& representation, const Context& context) const;
  const PreparedFields* prepared_fields(Representation& representation, const Context& context);
  void prepare(http::Fields& fields, int status, const Context& context) const;
  void go_on(Ticket ticket, Resource& resource, Encodings encodings, Step step, const Audience& audience);
  Result<Bytes> body_of(Resource& resource, std::size_t base, Variant variant, const Audience& audience, std::size_t page, ChosenTexts& texts) const;
  Representation html_page(Resource& resource, std::size_t base, const Audience& audience, std::size_t page) const;
  http::Fields structure_fields(const Resource& resource, std::size_t base, const Audience& audience, std::size_t page,
                                std::string_view cache_control, bool has_languages = false) const;
  rdf::Dataset dataset_of(const ValueResource& resource, std::size_t base, const Audience& audience, rdf::Graph all) const;
  rdf::Graph shown(rdf::Graph graph, std::size_t base, const Audience& audience, const UserWords& words) const;
  /// @param first  of its links after those that each response has
  void add_links(http::Fields& fields, const Resource& resource, std::size_t base, const Audience& audience, std::size_t page, std::size_t first = 0,
                 std::string_view its_class = {}) const;
  std::string limited(const Audience& audience, std::string_view cache_control) const;
  std::string cache_control_of(const Context& context) const;
  void add_upgrade(http::Fields& fields, const Context& context) const;
  std::string_view upgrade_of(const Context& context) const;

  const EngineOptions& options_;
  const EngineView& view_;
  const Cors& cors_;
  const Responses& responses_;
  RepresentationCache& cache_;
  PropertyValues& values_;
  PendingRequests& pending_;
};

/// How many pages a container has.
std::size_t page_count(std::size_t members, std::size_t max_page_members) noexcept;

}  // namespace lrt::engine
