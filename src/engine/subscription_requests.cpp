// SPDX-License-Identifier: Apache-2.0
#include "src/engine/subscription_requests.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/quote.hpp"
#include "src/engine/heartbeats.hpp"
#include "src/engine/receivers/event_stream.hpp"
#include "src/engine/receivers/protocols.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/http/form.hpp"
#include "src/http/negotiate.hpp"
#include "src/http/websocket.hpp"
#include "src/rdf/whole_number.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::engine {

namespace {

/// The node of a body that describes the subscription: `<>`, or the only subject that says what it observes or is a subscription.
std::vector<rdf::TermId> focus_nodes(const rdf::Graph& graph, const std::string& here) {
  const auto self = graph.find(rdf::iri(here));
  if (self && !graph.match(*self, std::nullopt, std::nullopt).empty()) return {*self};
  std::vector<rdf::TermId> found;
  const auto collect = [&](Iri predicate, std::optional<Iri> object) {
    const auto p = graph.find(predicate);
    const auto o = object ? graph.find(*object) : std::nullopt;
    if (!p || (object && !o)) return;
    for (const rdf::Triple& t : graph.match(std::nullopt, *p, o))
      if (std::find(found.begin(), found.end(), t.subject) == found.end()) found.push_back(t.subject);
  };
  collect(vocab::hybrit::onResource, std::nullopt);
  for (const Iri type : {vocab::hybrit::Subscription, vocab::hybrit::WebCallback, vocab::hybrit::WebSocket}) collect(vocab::rdf_::type, type);
  return found;
}

std::string_view refused_node(const rdf::Graph& graph, rdf::TermId node) {
  const auto type = graph.find(vocab::rdf_::type), websocket = graph.find(vocab::hybrit::WebSocket);
  if (!type || !websocket || graph.match(node, *type, *websocket).empty()) return {};
  return "this resource creates web callbacks only. To open a WebSocket, send GET with Upgrade: websocket to the observed resource";
}

std::string interval_range() { return "seconds from 0 to " + std::to_string(max_interval.count()); }

/// Removes the media types that are not text.
void keep_text(Variants& offers) {
  for (std::size_t i = offers.types.size(); i-- > 0;) {
    if (offers.variants[i].is_text()) continue;
    offers.types.erase(offers.types.begin() + static_cast<std::ptrdiff_t>(i));
    offers.variants.erase(offers.variants.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

/// What a description says of its subject; nullopt: nothing, or a blank node. The shape may be the user's own and require less than the code here
/// needs.
std::optional<std::string> object_of(const rdf::Graph& graph, rdf::TermId node, Iri predicate) {
  const auto p = graph.find(predicate);
  const auto found = p ? graph.object(node, *p) : std::nullopt;
  if (!found || graph.term(*found).is_blank()) return std::nullopt;
  return std::string(graph.term(*found).text);
}

/// The length of a queue, also as "5.0".
std::optional<std::uint64_t> length_of(std::string_view text) {
  const std::optional<std::string> whole = rdf::whole_number(text);
  return whole ? rdf::lexical::parse_uint64(*whole) : std::nullopt;
}

}  // namespace

std::optional<std::chrono::milliseconds> interval_of(std::string_view seconds) {
  const std::optional<double> value = rdf::lexical::parse_double(seconds);
  if (!value || !(*value >= 0) || *value > static_cast<double>(max_interval.count())) return std::nullopt;
  return std::chrono::milliseconds(std::llround(*value * 1000));
}

std::optional<Audience> renewed(const EngineOptions& options, const Audience& owner, const Resource& observed) {
  if (!options.renew) return owner;
  const std::optional<Caller> caller = options.renew(owner.principal.get());
  if (!caller) return std::nullopt;
  Audience audience{caller->view, caller->principal};
  return audience.may(security::Right::subscribe, observed) ? std::optional(std::move(audience)) : std::nullopt;
}

/// The rights of a request may have changed while it waited. The response: it may not subscribe to its resource now.
std::optional<http::Response> SubscriptionRequests::renew(Context& context) const {
  const std::uint64_t number = parts_.rights.number();
  if (context.rights_revision == number) return std::nullopt;
  const auto& principal = context.audience.principal;
  if (principal && parts_.rights.was_signed_out(principal->name, context.rights_revision)) {
    http::Response response = parts_.responses.denied(context, http::Denial::credentials, 401, "the principal was signed out");
    response.fields.set("WWW-Authenticate", parts_.options.challenge);
    return response;
  }
  std::optional<Audience> audience = renewed(parts_.options, context.audience, *context.resource);
  if (!audience) return parts_.responses.denied(context, http::Denial::right, 403, "the right to observe this resource was withdrawn");
  context.audience = *std::move(audience);
  context.rights_revision = number;
  return std::nullopt;
}

// ------------------------------------------------------------------------------------------------------------------- GET

std::optional<Protocol> SubscriptionRequests::requested_protocol(const Context& context) const {
  const http::Request& request = context.request();
  if (!context.resource->observable()) return std::nullopt;
  if (request.method == "GET" && request.find("Upgrade")) {
    if (request.can_upgrade && http::requests_upgrade(request, "websocket")) return Protocol::websocket;
    // RFC 9110 7.8: Upgrade has no meaning in HTTP/1.0.
    if (request.version >= 11 && (http::requests_upgrade(request, "callback") || http::requests_upgrade(request, "webhook")))
      return Protocol::callback;
  }
  if (!names_event_stream(request)) return std::nullopt;
  std::vector<std::string_view> offers = context.resource->variants().with_page;
  offers.push_back(event_stream_type);
  const auto choice = http::negotiate(std::string_view(request.joined("Accept")), offers);
  return choice && offers[*choice] == event_stream_type ? std::optional(Protocol::event_stream) : std::nullopt;
}

SubscriptionRequests::Read SubscriptionRequests::read(const Context& context, Protocol protocol) const {
  SubscriptionRequest wanted;
  wanted.observed = context.resource;
  wanted.protocol = protocol;
  wanted.client = context.client;
  wanted.policy = default_policy(*wanted.observed);
  wanted.audience = context.audience;
  if (auto response = opening_of(protocol).check(context, wanted, parts_)) return *std::move(response);
  if (auto response = read_query(context, wanted)) return *std::move(response);
  if (auto response = too_many(context, protocol)) return *std::move(response);
  return wanted;
}

/// The policy in the query of a GET.
std::optional<http::Response> SubscriptionRequests::read_query(const Context& context, SubscriptionRequest& wanted) const {
  const std::string_view target = context.request().target;
  if (const auto interval = http::query_parameter(target, "minimumInterval")) {
    const auto parsed = interval_of(*interval);
    if (!parsed) return parts_.responses.problem(context, 400, "minimumInterval: expected " + interval_range());
    wanted.policy.minimum_interval = *parsed;
  }
  if (const auto length = http::query_parameter(target, "queueLength")) {
    const auto parsed = length_of(*length);
    if (!parsed || *parsed > parts_.options.subscriptions.max_queue_length)
      return parts_.responses.problem(context, 400,
                                      "queueLength: expected a number from 0 to " + std::to_string(parts_.options.subscriptions.max_queue_length));
    wanted.policy.queue_length = static_cast<std::size_t>(*parsed);
  }
  if (const auto seconds = http::query_parameter(target, "heartbeat")) {
    const auto parsed = rdf::lexical::parse_double(*seconds);
    if (!parsed || !(*parsed > 0))
      return parts_.responses.problem(context, 400, "heartbeat: expected a number of seconds above 0, found " + quoted(*seconds));
    if (const std::string_view lacks = opening_of(wanted.protocol).lacks_heartbeat(wanted); !lacks.empty())
      return parts_.responses.problem(context, 400, "heartbeat: " + std::string(lacks));
    wanted.heartbeat = std::clamp(interval_of(*seconds).value_or(Heartbeats::longest), Heartbeats::shortest, Heartbeats::longest);
  }
  return std::nullopt;
}

std::optional<http::Response> SubscriptionRequests::too_many(const Context& context, Protocol protocol) const {
  const std::size_t max = parts_.options.clients.max_subscriptions;
  const bool of_client = !context.client.empty() && max != 0 && parts_.subscribers.clients.of(context.client) >= max;
  const std::string_view reached = opening_of(protocol).reached_maximum(parts_.subscribers, parts_.options);
  if (!of_client && reached.empty()) return std::nullopt;
  http::Response response =
      of_client ? parts_.responses.denied(context, http::Denial::subscriptions, 429,
                                          "this client has " + std::to_string(max) + " subscriptions, which is the maximum per client")
                : parts_.responses.problem(context, 503, std::string(reached));
  parts_.responses.add_retry_after(response);
  return response;
}

subscription::Policy SubscriptionRequests::default_policy(const Resource& observed) const {
  subscription::Policy policy;
  if (observed.observable()->wants_queues()) policy.queue_length = parts_.options.subscriptions.default_queue_length;
  return policy;
}

SubscriptionRequests::Selected SubscriptionRequests::select(Context& context, SubscriptionRequest wanted, bool current) const {
  if (auto response = renew(context)) return *std::move(response);
  wanted.observed = context.resource;
  wanted.audience = context.audience;
  const Opening& opening = opening_of(wanted.protocol);
  Variants offers = context.resource->variants();
  if (opening.needs_text()) keep_text(offers);
  const std::optional<std::string> accept = opening.accept(context);
  const auto choice = http::negotiate(accept ? std::optional<std::string_view>(*accept) : std::nullopt, offers.types);
  if (opening.needs_text() && !choice)
    return parts_.responses.problem(context, 406,
                                    "none of the media types in Accept is available in an event stream; available are " + offers.list());
  const bool now = opening.must_open_now(context);
  if (choice && (opening.needs_text() || now || offers.variants[*choice].may_be_missing())) {
    wanted.variant = offers.variants[*choice];
    const bool ready = representations_.ready(*context.resource, wanted.variant, current, context.audience);
    if (!ready && !now) return Representations::Missing{Encodings::of(wanted.variant)};
    wanted.begins_with_refresh = !ready;
  } else {
    Representations::Selected selected = representations_.select(context, nullptr, current);
    if (auto* missing = std::get_if<Representations::Missing>(&selected)) return *missing;
    if (auto* response = std::get_if<http::Response>(&selected)) return std::move(*response);
    wanted.variant = std::get<Representation*>(selected)->variant;
  }
  if (auto response = too_many(context, wanted.protocol)) return *std::move(response);  // while this one waited
  return wanted;
}

// ------------------------------------------------------------------------------------------------------------------ POST

SubscriptionRequests::Described SubscriptionRequests::read_description(Context& context) const {
  const auto problem = [&](int status, std::string detail) { return Outcome(parts_.responses.problem(context, status, std::move(detail))); };
  if (auto response = renew(context)) return Outcome(*std::move(response));
  if (requests_other_model(context.request().joined("Link"))) return problem(409, "members of this container are ldp:RDFSource");
  if (!parts_.rules.allow_some())
    return Outcome(parts_.responses.denied(context, http::Denial::receiver, 403,
                                           "this server does not support web callbacks: its list of allowed receivers is empty"));
  static constexpr FocusRule rule{focus_nodes, "subscription", refused_node};
  auto read = bodies_.read_graph(context, rule);
  if (auto outcome = outcome_of(read)) return *std::move(outcome);
  const rdf::Graph& graph = std::get<Body>(read).graph;
  const rdf::TermId node = *std::get<Body>(read).node;
  ThingNode& thing = *context.resource->thing;

  const auto object = [&](Iri predicate) { return object_of(graph, node, predicate); };
  SubscriptionRequest wanted;
  wanted.protocol = Protocol::callback;
  wanted.client = context.client;
  const std::string observed = object(vocab::hybrit::onResource).value_or("");
  if (const auto path = parts_.bases.path_of(observed)) {
    const Result<std::string> canonical = canonical_path(*path);
    if (canonical) wanted.observed = registry_.find(*canonical);
  }
  if (!wanted.observed || wanted.observed->thing != &thing || !wanted.observed->observable() ||
      !context.audience.may(security::Right::subscribe, *wanted.observed))
    return problem(422,
                   "hybrit:onResource: expected a resource of the thing \"" + thing.spec->path + "\" that can be observed, found <" + observed + ">");
  wanted.policy = default_policy(*wanted.observed);
  wanted.audience = context.audience;
  wanted.url = object(vocab::hybrit::callbackURL).value_or("");
  wanted.secret = object(vocab::lrt_::secret).value_or("");
  if (const Result<subscription::CallbackUrl> url = subscription::parse_callback_url(wanted.url); !url)
    return problem(422, "hybrit:callbackURL: " + url.error().message);
  if (auto response = parts_.rules.refused_receiver(context, wanted.url)) return Outcome(*std::move(response));
  const std::string type = object(vocab::hybrit::mediaType).value_or("");
  const Variants& variants = wanted.observed->variants();
  const auto choice = http::negotiate(type.empty() ? std::nullopt : std::optional<std::string_view>(type), variants.types);
  if (!choice) return problem(422, "hybrit:mediaType: expected one of " + variants.list() + ", found \"" + type + "\"");
  wanted.variant = variants.variants[*choice];
  if (auto response = read_policy(context, graph, node, wanted.policy)) return Outcome(*std::move(response));
  if (auto response = representations_.failed_precondition(context)) return Outcome(*std::move(response));
  if (auto response = too_many(context, wanted.protocol)) return Outcome(*std::move(response));
  return wanted;
}

/// The policy in a description.
std::optional<http::Response> SubscriptionRequests::read_policy(const Context& context, const rdf::Graph& graph, rdf::TermId node,
                                                                subscription::Policy& policy) const {
  const auto problem = [&](std::string detail) { return parts_.responses.problem(context, 422, std::move(detail)); };
  if (const auto seconds = object_of(graph, node, vocab::lrt_::minimumInterval)) {
    const auto interval = interval_of(*seconds);
    if (!interval) return problem("lrt:minimumInterval: expected " + interval_range());
    policy.minimum_interval = *interval;
  }
  if (const auto length = object_of(graph, node, vocab::lrt_::queueLength)) {
    const auto parsed = length_of(*length);
    if (!parsed || *parsed > parts_.options.subscriptions.max_queue_length)
      return problem("lrt:queueLength: expected a number from 0 to " + std::to_string(parts_.options.subscriptions.max_queue_length));
    policy.queue_length = static_cast<std::size_t>(*parsed);
  } else if (const auto delivery = object_of(graph, node, vocab::lrt_::delivery)) {
    if (*delivery == vocab::lrt_::latest.text) policy.queue_length = 0;
    else if (*delivery == vocab::lrt_::queue.text) policy.queue_length = parts_.options.subscriptions.default_queue_length;
    else return problem("lrt:delivery: expected lrt:latest or lrt:queue, found " + *delivery);
  }
  return std::nullopt;
}

// ----------------------------------------------------------------------------------------------------------------- feeds

Result<SubscriptionRequest> SubscriptionRequests::read_feed(FeedSubscription wanted) const {
  Resource* const observed = registry_.find(wanted.path);
  if (!observed) return unexpected(Errc::unknown_path, "there is no resource at \"" + wanted.path + '"');
  if (!observed->observable()) return unexpected(Errc::refused, wanted.path + ": expected a resource that can be observed");
  if (parts_.subscribers.count(Protocol::feed) >= parts_.options.subscriptions.max_feed_subscriptions)
    return unexpected(Errc::limit_exceeded, wanted.path + ": the maximum number of subscriptions of feeds (max_feed_subscriptions) is reached");
  SubscriptionRequest request;
  request.observed = observed;
  request.protocol = Protocol::feed;
  if (wanted.owner) {
    request.audience.principal = std::move(wanted.owner);
    std::optional<Audience> audience = renewed(parts_.options, request.audience, *observed);
    if (!audience) return unexpected(Errc::refused, wanted.path + ": the principal of the feed may not subscribe to it");
    request.audience = *std::move(audience);
  }
  const Variants& variants = observed->variants();
  const auto choice = http::negotiate(wanted.media_type.empty() ? std::nullopt : std::optional<std::string_view>(wanted.media_type), variants.types);
  if (!choice)
    return unexpected(Errc::unsupported_syntax, wanted.path + ": expected one of " + variants.list() + ", found \"" + wanted.media_type + '"');
  request.variant = variants.variants[*choice];
  request.policy = default_policy(*observed);
  if (wanted.queue_length) request.policy.queue_length = std::min(*wanted.queue_length, parts_.options.subscriptions.max_queue_length);
  request.policy.minimum_interval = std::clamp<std::chrono::milliseconds>(wanted.minimum_interval, std::chrono::milliseconds(0), max_interval);
  request.begins_with_refresh = !representations_.ready(*observed, request.variant, false, request.audience);
  request.feed = std::make_shared<const FeedProtocol>(FeedProtocol{std::move(wanted.protocol), std::move(wanted.statements), wanted.repeats});
  return request;
}

}  // namespace lrt::engine
