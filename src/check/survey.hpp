// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <lrt/client/http.hpp>
#include <lrt/rdf/graph.hpp>

#include "src/check/catalogue.hpp"
#include "src/check/probe.hpp"
#include "src/check/receiver.hpp"
#include "src/client/representation.hpp"

namespace lrt::check {

/// An entity tag that no response has.
inline constexpr const char* never_a_tag = "\"lrt-check\"";

/// A resource that was visited.
struct Resource {
  std::string url;
  Exchange get;                     ///< without Accept
  std::optional<rdf::Graph> graph;  ///< of `get`, or if that is no RDF, of a GET that accepts Turtle and N-Triples
  std::string rdf_fault;            ///< why a body that claims to be RDF cannot be read
  std::vector<client::Link> links;  ///< of `get`
  std::set<std::string> related;    ///< targets of rel=related, of further pages too
  std::string advertised_by;        ///< what leads here as a sub-resource: "Link rel=related of <...>"; empty: only another triple does
  bool thing = false, property = false, action = false, subscriptions = false, subscription = false, blueprint = false;
  std::set<std::string> allow;  ///< of OPTIONS
  std::string etag;             ///< present one
  bool changes = false;         ///< two GETs have had different representations

  bool exists() const noexcept { return get.reply.ok(); }
  /// The media type of a link of this resource to its own representations is offered.
  std::vector<std::string> offered_types() const;
};

/// The shared state of the groups of checks.
struct Context {
  const CheckOptions& options;
  Probe& probe;
  Verdicts& verdicts;
  std::string url;                    ///< the checked one, after redirects
  std::vector<Resource> resources{};  ///< the first is that of `url`
  std::vector<std::string> notes{};
  std::optional<Exchange> root{};  ///< GET of the root, if it is not among the resources
  /// Of a callback that was cancelled.
  struct {
    std::unique_ptr<Receiver> receiver;
    std::string url;
  } ended{};
  std::vector<Exchange> bad_requests{};  ///< responses to requests that are the client's fault

  /// Things; if none was found, the checked resource, which is to be one.
  std::vector<Resource*> things();
  /// The resources of which RDF is expected: Things and their sub-resources.
  std::vector<Resource*> linked_data();
  /// The resources that exist; of a slow server two of each kind.
  std::vector<Resource*> sample();
  /// Whether the user permits to write that resource.
  bool may_write(const std::string& of) const;
};

/// GET that follows redirects within the limits of the client. The URL of the result is that of the last one.
Exchange get(Context& context, const std::string& url, const FieldList& fields = {});
/// "the response is 404", or why there is none.
std::string outcome_of(const Exchange& exchange);
/// The graph of a response, if its media type is RDF. `fault`: why it cannot be read.
std::optional<rdf::Graph> graph_of(const Context& context, const Exchange& exchange, std::string* fault = nullptr);

/// Visits the checked URL and linked resources: links rel=related, triples hybrit: and ldp:, other objects of the same origin.
/// @par Errors  as run()
Result<void> survey(Context& context);

// The groups of checks, in the order in which they are called.
void check_resources(Context& context);      ///< R0.3 to R0.10
void check_caching(Context& context);        ///< R0.11
void check_linked_data(Context& context);    ///< R1
void check_http(Context& context);           ///< R0.1, R0.2
void check_subscriptions(Context& context);  ///< R0.12 to R0.17
void check_writes(Context& context);         ///< R0.5 to R0.8, for resources that the user named
void check_merging(Context& context);        ///< R1.7 to R1.11, of all documents together
void check_extensions(Context& context);     ///< what lrt adds, where a server announces it
void check_ended_subscriptions(Context& context);
void check_moments(Context& context);  ///< of all responses together: tags and dates

/// If-None-Match with a tag that is not the present one must not get 304.
/// @param former  the tag of `then`, which was another representation; empty: a tag that no response had
void check_former_tag(Context& context, const std::string& url, const std::string& former, const Exchange& then);

}  // namespace lrt::check
