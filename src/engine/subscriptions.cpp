// SPDX-License-Identifier: Apache-2.0
#include "src/engine/subscriptions.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>
#include <utility>

#include <lrt/base/ids.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/http/form.hpp"
#include "src/http/negotiate.hpp"
#include "src/http/websocket.hpp"

namespace lrt::engine {
inline namespace v0 {

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

/// The text for a subscriber about a failed delivery: the status of its receiver. All other failures have the same text, whether a port is closed,
/// filtered, open, or not HTTP. Otherwise a subscriber could scan the robot's network.
std::string public_reason(const subscription::DeliveryResult& result) {
  return result.error.empty() ? "the receiver responded with " + std::to_string(result.status) : "no valid response was received";
}

/// It is a property that was never read: its representation would be null.
bool lacks_value(const Resource& resource) {
  bool lacks = false;
  if (resource.reads() == Resource::Reads::values) resource.for_each_property([&](const PropertyResource& p) { lacks = lacks || p.value.is_null(); });
  return lacks;
}

/// Resources whose representations take longer get at most a fifth of the time together.
constexpr std::chrono::milliseconds short_work{2};
constexpr int rest_per_work = 4;

std::string interval_range() { return "seconds from 0 to " + std::to_string(max_interval.count()); }

}  // namespace

std::optional<std::chrono::milliseconds> interval_of(std::string_view seconds) {
  const std::optional<double> value = rdf::lexical::parse_double(seconds);
  if (!value || !(*value >= 0) || *value > static_cast<double>(max_interval.count())) return std::nullopt;
  return std::chrono::milliseconds(std::llround(*value * 1000));
}

Subscriptions::Subscriptions(const EngineOptions& options, Registry& registry, Bases& bases, const Responses& responses, Bodies& bodies,
                             Representations& representations, PropertyValues& values, ChangeScanner& scanner, PendingSaves& saves,
                             const Clock& clock)
    : options_(options),
      registry_(registry),
      bases_(bases),
      responses_(responses),
      bodies_(bodies),
      representations_(representations),
      values_(values),
      scanner_(scanner),
      saves_(saves),
      clock_(clock),
      allowed_(subscription::AllowedHosts::parse(options.callbacks.allow)),
      instance_(RandomIds().next()) {}

Result<void> Subscriptions::check_options() const {
  if (!allowed_) return Unexpected{allowed_.error()};
  const subscription::SubscriptionOptions& s = options_.subscriptions;
  if (s.scan_period.count() <= 0)
    return unexpected(Errc::invalid_option, "subscriptions.scan_period: expected more than 0 us, found " + std::to_string(s.scan_period.count()));
  if (options_.callbacks.attempts == 0) return unexpected(Errc::invalid_option, "callbacks.attempts: expected at least 1");
  if (options_.callbacks.secret.size() > max_secret)
    return unexpected(Errc::invalid_option, "callbacks.secret: expected at most " + std::to_string(max_secret) + " bytes");
  return {};
}

bool Subscriptions::may_call(const subscription::CallbackUrl& url) const {
  return allowed_ && allowed_->names(url.host, url.port) && !bases_.is_this_server(url);
}

bool Subscriptions::is_refused_notification(const http::Request& request) const {
  const auto field = request.find(notification_field);
  if (!field) return false;
  constexpr std::string_view parameter = "; base=\"";
  const std::size_t at = field->find(parameter);
  if (request.count(notification_field) != 1 || at == std::string_view::npos || field->back() != '"' || field->substr(0, at) == instance_)
    return true;
  std::string_view sender = field->substr(at + parameter.size());
  sender.remove_suffix(1);
  const auto& senders = options_.notification_senders;
  return std::none_of(senders.begin(), senders.end(), [&](const std::string& allowed) { return allowed == "*" || allowed == sender; });
}

SubscriptionResource* Subscriptions::find(Channel channel) const {
  const auto found = by_channel_.find(static_cast<std::uint64_t>(channel));
  return found == by_channel_.end() ? nullptr : found->second;
}

// -------------------------------------------------------------------------------------------------------------- requests

bool names_event_stream(const http::Request& request) {
  if (!request.can_stream) return false;
  const auto names_it = [](std::string_view accept) {
    const auto same = [](char a, char b) { return detail::lower(a) == b; };
    return std::search(accept.begin(), accept.end(), event_stream_type.begin(), event_stream_type.end(), same) != accept.end();
  };
  return std::any_of(request.fields.begin(), request.fields.end(), [&](const http::Field& field) {
    return field.value.size() >= event_stream_type.size() && http::iequals(field.name, "Accept") && names_it(field.value);
  });
}

std::optional<Protocol> Subscriptions::requested_protocol(const Context& context) const {
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

subscription::Policy Subscriptions::default_policy(const Resource& observed) const {
  subscription::Policy policy;
  if (observed.wants_queues()) policy.queue_length = options_.subscriptions.default_queue_length;
  return policy;
}

std::optional<http::Response> Subscriptions::too_many(const Context& context, Protocol protocol) const {
  const bool callback = protocol == Protocol::callback;
  const std::size_t max = options_.clients.max_subscriptions;
  const bool too_many_of_client = !context.client.empty() && max != 0 && clients_.of(context.client) >= max;
  if (!too_many_of_client && by_channel_.size() - feeds_ < options_.subscriptions.max_subscriptions &&
      (!callback || callbacks_ < options_.callbacks.max_callbacks))
    return std::nullopt;
  http::Response response =
      too_many_of_client
          ? responses_.denied(context, http::Denial::subscriptions, 429,
                              "this client has " + std::to_string(max) + " subscriptions, which is the maximum per client")
          : responses_.problem(context, 503,
                               callback ? "the maximum number of web callbacks is reached" : "the maximum number of subscriptions is reached");
  responses_.add_retry_after(response);
  return response;
}

std::optional<http::Response> Subscriptions::refused_receiver(const Context& context, const std::string& url) const {
  const Result<subscription::CallbackUrl> parsed = subscription::parse_callback_url(url);
  if (!parsed) return responses_.problem(context, 400, parsed.error().message);
  if (bases_.is_this_server(*parsed))
    return responses_.denied(context, http::Denial::receiver, 403, "callback URL: " + parsed->authority + " is this server itself");
  if (may_call(*parsed)) return std::nullopt;
  return responses_.denied(context, http::Denial::receiver, 403, "callback URL: this server may not call " + parsed->authority);
}

/// The policy in the query of a GET.
std::optional<http::Response> Subscriptions::read_query(const Context& context, SubscriptionRequest& wanted) const {
  const std::string_view target = context.request().target;
  if (const auto interval = http::query_parameter(target, "minimumInterval")) {
    const auto parsed = interval_of(*interval);
    if (!parsed) return responses_.problem(context, 400, "minimumInterval: expected " + interval_range());
    wanted.policy.minimum_interval = *parsed;
  }
  if (const auto length = http::query_parameter(target, "queueLength")) {
    const auto parsed = rdf::lexical::parse_uint64(*length);
    if (!parsed || *parsed > options_.subscriptions.max_queue_length)
      return responses_.problem(context, 400, "queueLength: expected a number from 0 to " + std::to_string(options_.subscriptions.max_queue_length));
    wanted.policy.queue_length = static_cast<std::size_t>(*parsed);
  }
  return std::nullopt;
}

Outcome Subscriptions::subscribe(Context& context, Protocol protocol) {
  const http::Request& request = context.request();
  SubscriptionRequest wanted;
  wanted.observed = context.resource;
  wanted.protocol = protocol;
  wanted.client = context.client;
  wanted.policy = default_policy(*wanted.observed);
  wanted.audience = context.audience;
  if (protocol == Protocol::websocket) {
    if (const auto refusal = http::check_websocket(request)) {
      http::Response response = responses_.problem(context, refusal->status, refusal->reason);
      if (refusal->status == 426) {
        response.fields.set("Sec-WebSocket-Version", "13");
        response.fields.set("Upgrade", "websocket");
      }
      return response;
    }
  } else if (protocol == Protocol::callback) {
    if (request.count("Callback") != 1)
      return responses_.problem(context, 400,
                                request.find("Callback") ? "Callback: expected one field" : "a Callback field with the receiver's URL is missing");
    wanted.url = std::string(*request.find("Callback"));
    if (auto response = refused_receiver(context, wanted.url)) return *std::move(response);
  }
  if (auto response = read_query(context, wanted)) return *std::move(response);
  if (auto response = too_many(context, protocol)) return *std::move(response);
  return representations_.attempt(context, [this, wanted = std::move(wanted)](Context& c, bool current) { return open(c, wanted, current); });
}

/// Chooses the media type of the notifications (R0.17) and creates the subscription when the first value is available.
Representations::Attempt Subscriptions::open(Context& context, SubscriptionRequest wanted, bool current) {
  wanted.observed = context.resource;
  const bool streams = wanted.protocol == Protocol::event_stream;
  Variants offers = context.resource->variants();
  std::optional<std::string_view> accept = context.accept();
  std::optional<std::string> parameter;
  if (streams) {
    // Accept selects the stream itself. The query selects the media type in its events, among those that are text.
    parameter = http::query_parameter(context.request().target, "accept");
    accept = parameter ? std::optional<std::string_view>(*parameter) : std::nullopt;
    for (std::size_t i = offers.types.size(); i-- > 0;) {
      if (offers.variants[i].is_text()) continue;
      offers.types.erase(offers.types.begin() + static_cast<std::ptrdiff_t>(i));
      offers.variants.erase(offers.variants.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  const auto choice = http::negotiate(accept, offers.types);
  if (streams && !choice)
    return Outcome(
        responses_.problem(context, 406, "none of the media types in Accept is available in an event stream; available are " + offers.list()));
  const bool at_once = wanted.protocol == Protocol::websocket && context.request().must_upgrade_now;
  if (choice && (streams || at_once || offers.variants[*choice].may_be_missing())) {
    wanted.variant = offers.variants[*choice];
    const bool ready = representations_.ready(*context.resource, wanted.variant, current);
    if (!ready && !at_once) return Representations::Missing{Encodings::of(wanted.variant)};
    wanted.begins_with_refresh = !ready;
  } else {
    Representations::Selected selected = representations_.select(context, nullptr, current);
    if (auto* missing = std::get_if<Representations::Missing>(&selected)) return *missing;
    if (auto* response = std::get_if<http::Response>(&selected)) return Outcome(std::move(*response));
    wanted.variant = std::get<Representation*>(selected)->variant;
  }
  if (auto response = too_many(context, wanted.protocol)) return Outcome(*std::move(response));  // while this one waited

  const Protocol protocol = wanted.protocol;
  if (context.request().method == "HEAD") return Outcome(Streamed{Channel{next_channel_++}, stream_response(context)});  // no subscription
  // WHATWG HTML 9.2.3: the client has this representation already.
  const auto known = context.request().find("Last-Event-ID");
  if (streams && known) wanted.known_tag = std::string(*known);
  if (protocol == Protocol::callback) return make_callback(context, std::move(wanted));
  SubscriptionResource& made = make(std::move(wanted), context.base, options_.ids->next(), context.now.utc);
  const std::string location = responses_.iri(context, made.path);
  if (streams) {
    http::Response response = stream_response(context);
    response.fields.add("Location", location);
    return Outcome(Streamed{made.channel, std::move(response)});
  }
  http::Response response;
  response.status = 101;
  responses_.add_types(response.fields, context.resource);
  response.fields.add("Location", location);
  return Outcome(Upgraded{made.channel, std::move(response)});
}

/// The header section of an event stream.
http::Response Subscriptions::stream_response(const Context& context) const {
  http::Response response;
  responses_.add_types(response.fields, context.resource);
  response.fields.add("Content-Type", event_stream_type);
  response.fields.add("Cache-Control", "no-store");
  response.fields.add("Vary", context.vary());
  response.fields.add("X-Accel-Buffering", "no");  // nginx would buffer events
  return response;
}

/// 201 with the description of the new subscription (R0.13).
http::Response Subscriptions::description_response(const Context& context, SubscriptionResource& made) const {
  const std::string location = responses_.iri(context, made.path);
  http::Response response;
  if (context.wants_minimal()) {
    response = responses_.no_content(context, 201);
    response.fields.add("Preference-Applied", "return=minimal");
  } else {
    response = responses_.graph(context, 201, representations_.describe(made, context.base, context.audience));
    response.fields.add("Content-Location", location);
  }
  response.fields.set("Vary", "Accept, Prefer");  // also of a GET
  response.fields.add("Location", location);
  return response;
}

Outcome Subscriptions::create(Context& context) {
  const auto problem = [&](int status, std::string detail) { return responses_.problem(context, status, std::move(detail)); };
  if (requests_other_model(context.request().joined("Link"))) return problem(409, "members of this container are ldp:RDFSource");
  if (!makes_callbacks())
    return responses_.denied(context, http::Denial::receiver, 403,
                             "this server does not support web callbacks: its list of allowed receivers is empty");
  static constexpr FocusRule rule{focus_nodes, "subscription", refused_node};
  auto read = bodies_.read_graph(context, rule);
  if (auto outcome = outcome_of(read)) return *std::move(outcome);
  const rdf::Graph& graph = std::get<Body>(read).graph;
  const rdf::TermId node = *std::get<Body>(read).node;
  ThingNode& thing = *context.resource->thing;

  // The shape may be the user's own and require less than this code needs.
  const auto object = [&](Iri predicate) -> std::optional<std::string> {
    const auto p = graph.find(predicate);
    const auto found = p ? graph.object(node, *p) : std::nullopt;
    if (!found || graph.term(*found).is_blank()) return std::nullopt;
    return std::string(graph.term(*found).text);
  };
  SubscriptionRequest wanted;
  wanted.protocol = Protocol::callback;
  wanted.client = context.client;
  const std::string observed = object(vocab::hybrit::onResource).value_or("");
  if (const auto path = bases_.path_of(observed)) {
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
  if (auto response = refused_receiver(context, wanted.url)) return *std::move(response);
  const std::string type = object(vocab::hybrit::mediaType).value_or("");
  const Variants& variants = wanted.observed->variants();
  const auto choice = http::negotiate(type.empty() ? std::nullopt : std::optional<std::string_view>(type), variants.types);
  if (!choice) return problem(422, "hybrit:mediaType: expected one of " + variants.list() + ", found \"" + type + "\"");
  wanted.variant = variants.variants[*choice];
  if (const auto seconds = object(vocab::lrt_::minimumInterval)) {
    const auto interval = interval_of(*seconds);
    if (!interval) return problem(422, "lrt:minimumInterval: expected " + interval_range());
    wanted.policy.minimum_interval = *interval;
  }
  if (const auto length = object(vocab::lrt_::queueLength)) {
    const auto parsed = rdf::lexical::parse_uint64(*length);
    if (!parsed || *parsed > options_.subscriptions.max_queue_length)
      return problem(422, "lrt:queueLength: expected a number from 0 to " + std::to_string(options_.subscriptions.max_queue_length));
    wanted.policy.queue_length = static_cast<std::size_t>(*parsed);
  } else if (const auto delivery = object(vocab::lrt_::delivery)) {
    if (*delivery == vocab::lrt_::latest.text) wanted.policy.queue_length = 0;
    else if (*delivery == vocab::lrt_::queue.text) wanted.policy.queue_length = options_.subscriptions.default_queue_length;
    else return problem(422, "lrt:delivery: expected lrt:latest or lrt:queue, found " + *delivery);
  }
  if (auto response = representations_.failed_precondition(context)) return *std::move(response);
  if (auto response = too_many(context, Protocol::callback)) return *std::move(response);
  return make_callback(context, std::move(wanted));
}

/// 201 when the subscription is saved. Its notifications begin then, too.
Outcome Subscriptions::make_callback(Context& context, SubscriptionRequest wanted) {
  return saves_.respond_when_saved(context, [&]() -> PendingSaves::Change {
    wanted.provisional = true;
    SubscriptionResource& made = make(std::move(wanted), context.base, options_.ids->next(), context.now.utc);
    return {description_response(context, made), [this, channel = made.channel](bool saved) {
              SubscriptionResource* s = find(channel);
              if (!s) return;  // its resource was removed
              if (!saved) return end(*s, 0, {});
              s->provisional = false;
              announce(*s);
            }};
  });
}

// ------------------------------------------------------------------------------------------------------- coming and going

SubscriptionResource& Subscriptions::make(SubscriptionRequest request, std::size_t base, std::string id, Utc created) {
  SubscriptionsResource& container = *request.observed->subscriptions();
  std::string path = container.path + "/" + id;
  std::string known_tag = std::move(request.known_tag);
  const std::string client = std::move(request.client);
  const bool begins_with_refresh = request.begins_with_refresh, requested = !request.restored;
  auto made = std::make_unique<SubscriptionResource>(std::move(path), std::move(id), Channel{next_channel_++}, std::move(request), base, created,
                                                     *this, options_, queued_bytes_);
  SubscriptionResource& s = *made;
  s.last_tag = std::move(known_tag);
  s.share = clients_.take(client);
  report(SubscriptionEvent::Kind::made, s, requested);
  by_channel_.emplace(static_cast<std::uint64_t>(s.channel), &s);
  container.subscriptions.push_back(std::move(made));
  registry_.add(s);
  container.mark_changed();
  if (s.queues()) s.observed.for_each_property([this](PropertyResource& p) { values_.keep(p, true); });
  if (s.feed && !s.feed->statements.empty()) s.observed.Resource::mark_changed();  // it shows the receiver, to which this is no change
  s.observed.add_observer(s, scanner_);
  if (s.protocol == Protocol::callback) {
    s.must_confirm = must_confirm(s.url);
    ++callbacks_;
    saves_.changed();
  }
  if (s.feed) ++feeds_;
  // SPEC 3.6: the first notification at once.
  if (begins_with_refresh) {
    s.awaits_value = true;
    values_.refresh(s.observed, Encodings::of(s.its_variant), [this, channel = s.channel](const Result<void>& result, TimePoint) {
      SubscriptionResource* begun = find(channel);
      if (!begun) return;
      begun->awaits_value = false;
      if (result) first_notification(*begun);
      else if (!begun->feed) return end(*begun, 1011, "the value could not be read");  // a feed waits for the first that can
      if (begun->queues()) announce(*begun);                                           // what came into the queue meanwhile
    });
  } else {
    first_notification(s);
  }
  return s;
}

void Subscriptions::first_notification(SubscriptionResource& s) {
  if (!s.observed.has_representation()) return;
  if (s.queues()) enqueue(s, false);
  else changed(s);
}

/// A callback continues until it is removed from the file. If that fails, nothing has changed.
Outcome Subscriptions::cancel(Context& context, SubscriptionResource& s, http::Response response) {
  static constexpr std::uint16_t code = 1000;
  static constexpr const char* reason = "the subscription was cancelled";
  if (s.protocol != Protocol::callback) {
    end(s, code, reason);
    return response;
  }
  return saves_.respond_when_saved(context, [&]() -> PendingSaves::Change {
    ++s.cancellations;
    saves_.changed();
    return {std::move(response), [this, channel = s.channel](bool saved) {
              SubscriptionResource* cancelled = find(channel);
              if (!cancelled) return;
              if (saved) return end(*cancelled, code, reason);
              --cancelled->cancellations;
              saves_.changed();
            }};
  });
}

void Subscriptions::end(SubscriptionResource& s, std::uint16_t code, std::string reason) {
  if (s.protocol != Protocol::callback && code != 0) {
    ClosingChannel& closing = closing_[static_cast<std::uint64_t>(s.channel)];
    closing.text = s.its_variant.is_text();
    closing.code = code;
    closing.reason = std::move(reason);
    if (code != 1000)  // a cancelled subscription gets no more
      while (auto item = s.backlog.take_item()) closing.items.push_back(std::move(item));
    urgent_.push_back(s.channel);
    if (s.feed && !closing.items.empty()) {
      for (const subscription::Item& item : closing.items) closing.bytes += item->body->size();
      closing_feed_bytes_ += closing.bytes;
      closing_feeds_.insert(static_cast<std::uint64_t>(s.channel));
      limit_closing_feeds();
    }
  }
  if (s.protocol == Protocol::callback) {
    --callbacks_;
    if (!s.is_cancelling()) saves_.changed();
  }
  if (s.feed) --feeds_;
  report(SubscriptionEvent::Kind::ended, s, true);
  dropped_ += s.backlog.dropped();
  next_notifications_.clear(s.next_notification);
  by_channel_.erase(static_cast<std::uint64_t>(s.channel));
  if (s.queues()) s.observed.for_each_property([this](PropertyResource& p) { values_.keep(p, false); });
  s.observed.remove_observer(s, scanner_);
  if (s.feed && !s.feed->statements.empty()) s.observed.Resource::mark_changed();
  SubscriptionsResource& container = *s.observed.subscriptions();
  container.mark_changed();
  registry_.remove(s);
  auto& members = container.subscriptions;
  members.erase(std::find_if(members.begin(), members.end(), [&](const auto& m) { return m.get() == &s; }));
}

/// Drops the items of the feeds that have ended first. Their channels are named again, because their end is due now.
void Subscriptions::limit_closing_feeds() {
  while (closing_feeds_.size() > max_closing_feeds || closing_feed_bytes_ > max_closing_feed_bytes) {
    const std::uint64_t oldest = *closing_feeds_.begin();
    ClosingChannel& closing = closing_.at(oldest);
    dropped_ += closing.items.size();
    closing.items.clear();
    closing_feed_bytes_ -= std::exchange(closing.bytes, 0);
    closing_feeds_.erase(closing_feeds_.begin());
    urgent_.push_back(Channel{oldest});
  }
}

void Subscriptions::forget_closing(Channel channel) {
  const auto found = closing_.find(static_cast<std::uint64_t>(channel));
  if (found == closing_.end()) return;
  closing_feed_bytes_ -= found->second.bytes;
  closing_feeds_.erase(found->first);
  closing_.erase(found);
}

EngineCounts Subscriptions::counts() const {
  EngineCounts counts;
  counts.messages_sent = sent_;
  counts.messages_dropped = dropped_;
  counts.queued_bytes = queued_bytes_;
  for (const auto& [channel, s] : by_channel_) {
    counts.messages_dropped += s->backlog.dropped();
    if (s->protocol == Protocol::websocket) ++counts.websockets;
    else if (s->protocol == Protocol::event_stream) ++counts.event_streams;
  }
  counts.callbacks = callbacks_;
  counts.feeds = feeds_;
  return counts;
}

void Subscriptions::report(SubscriptionEvent::Kind kind, const SubscriptionResource& s, bool requested) {
  static constexpr std::string_view protocols[] = {"websocket", "callback", "event_stream", "feed"};  // by Protocol
  if (options_.reports_subscriptions) events_.push_back({kind, s.path, s.observed.path, protocols[static_cast<std::size_t>(s.protocol)], requested});
}

std::optional<Audience> Subscriptions::renewed(const Audience& owner, const Resource& observed) const {
  if (!options_.renew) return owner;
  const std::optional<Caller> caller = options_.renew(owner.principal.get());
  if (!caller) return std::nullopt;
  Audience audience{caller->view, caller->principal};
  return audience.may(security::Right::subscribe, observed) ? std::optional(std::move(audience)) : std::nullopt;
}

void Subscriptions::renew_rights() {
  std::vector<Channel> all;
  all.reserve(by_channel_.size());
  for (const auto& [number, s] : by_channel_) all.push_back(s->channel);
  for (const Channel channel : all) {
    SubscriptionResource* s = find(channel);
    if (!s || (s->feed && !s->audience.principal)) continue;  // of the host itself
    std::optional<Audience> audience = renewed(s->audience, s->observed);
    if (!audience) {
      end(*s, 1008, "the right to observe this resource was withdrawn");
    } else if (audience->view != s->audience.view) {
      s->audience = *std::move(audience);
      s->observed.subscriptions()->mark_changed();
      changed(*s);
    }
  }
}

void Subscriptions::end_all_of(const Resource& observed, std::uint16_t code, const std::string& reason) {
  std::vector<Channel> all;
  for (const auto& [number, s] : by_channel_)
    if (&s->observed == &observed) all.push_back(s->channel);
  for (const Channel channel : all) end(*find(channel), code, reason);
}

void Subscriptions::resource_removed(SubscriptionResource& s) {
  if (s.observed.has_final_state() && s.protocol != Protocol::callback && s.backlog.take_pending()) {
    if (Representation* last = represent(s); last && last->tag != s.last_tag) s.backlog.push_last(item_of(s, *last));
  }
  end(s, 1001, "the resource was removed");
}

// --------------------------------------------------------------------------------------------------------------- changes

/// Queues are filled in scans, whose share of time is bounded: a request that causes a change must not wait until all queues
/// have it in four syntaxes. They are filled at once for commands, and before a new value replaces one that is not queued yet.
void Subscriptions::changed(SubscriptionResource& s) {
  if (!s.queues() || s.retry.suspended()) {
    s.backlog.mark_changed();
    return announce(s);
  }
  if (fills_queues_ || s.observed.is_urgent()) return enqueue(s);
  if (std::exchange(s.marked, true)) s.backlog.count_dropped(1);
  else marked_.push_back(s.channel);
  if (!scanner_.is_scanning()) scanner_.start();
}

void Subscriptions::fill(SubscriptionResource& s) {
  if (std::exchange(s.marked, false)) enqueue(s);
}

/// @param is_change  counted as dropped if it has no representation
void Subscriptions::enqueue(SubscriptionResource& s, bool is_change) {
  if (s.awaits_value && lacks_value(s.observed)) return;  // the change is in its description only
  if (!representations_.ready(s.observed, s.its_variant, true)) {
    values_.refresh(s.observed, Encodings::of(s.its_variant), [this, channel = s.channel, is_change](const Result<void>& result, TimePoint) {
      SubscriptionResource* waiting = find(channel);
      if (waiting && result) enqueue(*waiting, is_change);
      else if (waiting && is_change) waiting->backlog.count_dropped(1);
    });
    return;
  }
  Representation* representation = represent(s);
  if (!representation) {
    if (is_change) s.backlog.count_dropped(1);
    return;
  }
  const std::string& last = s.backlog.newest() ? s.backlog.newest()->tag : s.last_tag;
  if (representation->tag == last) return;
  s.backlog.push(item_of(s, *representation));
  announce(s);
}

/// nullptr: it cannot be encoded now.
Representation* Subscriptions::represent(SubscriptionResource& s) {
  Result<Representation*> made = representations_.make(s.observed, s.base, s.its_variant, s.audience);
  const bool is_expected = !made && s.feed && made.error().code == Errc::unsupported_syntax;  // no client has chosen the media type for this value
  if (!made && !s.failing && !is_expected) responses_.log(LogLevel::error, s.observed.path + ": " + made.error().message);
  s.failing = !made;
  return made ? *made : nullptr;
}

/// A representation was made for a subscriber without a queue. Those for queues are made in scans, which rest as well.
void Subscriptions::took(const Resource& observed, Instant before) {
  const Instant after = clock_.now().steady;
  const auto number = static_cast<std::uint64_t>(observed.id);
  if (after - before <= short_work) {
    slow_.erase(number);
    return;
  }
  rest_end_ = after + rest_per_work * (after - before);
  if (!slow_.insert(number).second) return;
  for (auto at = slow_.begin(); at != slow_.end();) at = registry_.find(ResourceId{*at}) ? std::next(at) : slow_.erase(at);
}

/// Until when no representation is made for a subscriber; nullopt: it may be made, or there is one already.
std::optional<Subscriptions::Instant> Subscriptions::rest_of(const SubscriptionResource& s, TimePoint now) const {
  if (rest_end_ <= now.steady || slow_.count(static_cast<std::uint64_t>(s.observed.id)) == 0 || s.observed.is_urgent()) return std::nullopt;
  return representations_.is_made(s.observed, s.base, s.its_variant, s.audience) ? std::nullopt : std::optional(rest_end_);
}

subscription::Item Subscriptions::item_of(const SubscriptionResource& s, Representation& representation) {
  return s.protocol == Protocol::event_stream ? representations_.event_of(representation) : representations_.message_of(representation);
}

/// Names the channel to the transport or the deliverer, unless it was named already.
void Subscriptions::announce(SubscriptionResource& s) {
  if (s.provisional || s.ready_announced || s.next_notification || s.under_way || s.backlog.empty()) return;
  s.ready_announced = true;
  if (s.protocol == Protocol::callback) return callbacks_ready_.push_back({s.channel, s.receiver});
  (s.observed.is_urgent() ? urgent_ : ready_).push_back(s.channel);
}

/// @return  nullptr: none may be sent now
subscription::Item Subscriptions::next_item(SubscriptionResource& s, TimePoint now) {
  s.ready_announced = false;
  if (s.awaits_value) return nullptr;
  if (!s.backlog.empty() && now.steady < s.backlog.due()) {
    next_notifications_.set(s.next_notification, s.backlog.due(), s.channel);
    return nullptr;
  }
  subscription::Item item = s.backlog.take_item();
  if (!item && s.backlog.take_pending()) {
    if (!representations_.ready(s.observed, s.its_variant, true)) {
      // The user's encoders have to run first.
      s.backlog.mark_pending();
      s.ready_announced = true;
      values_.refresh(s.observed, Encodings::of(s.its_variant), [this, channel = s.channel](const Result<void>&, TimePoint) {
        SubscriptionResource* waiting = find(channel);
        if (!waiting) return;
        waiting->ready_announced = false;
        announce(*waiting);
      });
      return nullptr;
    }
    if (const auto rest = rest_of(s, now)) {
      s.backlog.mark_pending();
      next_notifications_.set(s.next_notification, *rest, s.channel);
      return nullptr;
    }
    const bool was_made = representations_.is_made(s.observed, s.base, s.its_variant, s.audience);
    const Instant before = clock_.now().steady;
    Representation* representation = represent(s);
    if (!was_made) took(s.observed, before);
    if (representation && representation->tag != s.last_tag) item = item_of(s, *representation);
  }
  if (!item) return nullptr;
  s.ready_announced = true;
  s.last_tag = item->tag;
  s.backlog.sent(now.steady);
  return item;
}

void Subscriptions::notify_of_structure() {
  if (notified_structure_ == registry_.structure()) return;
  notified_structure_ = registry_.structure();
  fills_queues_ = true;
  for (const auto& [number, s] : by_channel_) {
    if (s->observed.state(notified_structure_) == s->observed.state(0)) continue;  // it does not depend on the structure
    if (s->queues()) {
      changed(*s);
    } else {
      s->backlog.mark_pending();  // no change is known to be lost
      announce(*s);
    }
  }
  fills_queues_ = false;
}

// ----------------------------------------------------------------------------------------------------------------- feeds

Result<Subscribed> Subscriptions::make_feed(FeedSubscription wanted, TimePoint now) {
  Resource* const observed = registry_.find(wanted.path);
  if (!observed) return unexpected(Errc::unknown_path, "there is no resource at \"" + wanted.path + '"');
  if (!observed->observable()) return unexpected(Errc::refused, wanted.path + ": expected a resource that can be observed");
  if (feeds_ >= options_.subscriptions.max_feed_subscriptions)
    return unexpected(Errc::limit_exceeded, wanted.path + ": the maximum number of subscriptions of feeds (max_feed_subscriptions) is reached");
  SubscriptionRequest request;
  request.observed = observed;
  request.protocol = Protocol::feed;
  if (wanted.owner) {
    request.audience.principal = std::move(wanted.owner);
    std::optional<Audience> audience = renewed(request.audience, *observed);
    if (!audience) return unexpected(Errc::refused, wanted.path + ": the principal of the feed may not subscribe to it");
    request.audience = *std::move(audience);
  }
  const Variants& variants = observed->variants();
  const auto choice = http::negotiate(wanted.media_type.empty() ? std::nullopt : std::optional<std::string_view>(wanted.media_type), variants.types);
  if (!choice)
    return unexpected(Errc::unsupported_syntax, wanted.path + ": expected one of " + variants.list() + ", found \"" + wanted.media_type + '"');
  request.variant = variants.variants[*choice];
  request.policy = default_policy(*observed);
  if (wanted.queue_length) request.policy.queue_length = std::min(*wanted.queue_length, options_.subscriptions.max_queue_length);
  request.policy.minimum_interval = std::clamp<std::chrono::milliseconds>(wanted.minimum_interval, std::chrono::milliseconds(0), max_interval);
  request.begins_with_refresh = !representations_.ready(*observed, request.variant, false);
  request.feed = std::make_shared<const FeedProtocol>(FeedProtocol{std::move(wanted.protocol), std::move(wanted.statements), wanted.repeats});
  const SubscriptionResource& made = make(std::move(request), 0, options_.ids->next(), now.utc);
  return Subscribed{made.channel, made.queues()};
}

std::optional<FeedMessage> Subscriptions::next_feed_message(Channel channel, TimePoint now) {
  try {
    FeedMessage message;
    message.channel = channel;
    SubscriptionResource* const s = find(channel);
    if (!s) {
      const std::optional<Push> last = next_push(channel, now);
      if (!last) return std::nullopt;
      message.body = last->message;
      message.end = last->close != 0;
      message.queued = !message.end;
      return message;
    }
    const subscription::Item item = next_item(*s, now);
    if (!item) return std::nullopt;
    ++s->delivered;
    ++sent_;
    message.body = item->body;
    message.queued = s->queues();
    message.missed = s->backlog.dropped() - std::exchange(s->told_dropped, s->backlog.dropped());
    return message;
  } catch (const std::exception& e) {
    responses_.log(LogLevel::error, std::string("a message could not be encoded: ") + e.what());
    return std::nullopt;
  }
}

bool Subscriptions::has_ended(Channel channel) const {
  if (find(channel)) return false;
  const auto closing = closing_.find(static_cast<std::uint64_t>(channel));
  return closing == closing_.end() || closing->second.items.empty();
}

bool Subscriptions::repeat(Channel channel) {
  SubscriptionResource* const s = find(channel);
  if (!s || s->awaits_value || !s->observed.has_representation()) return false;
  if (s->queues()) {
    if (!s->feed || !s->feed->repeats || !s->backlog.empty()) return false;  // what is in the queue follows
    s->last_tag.clear();
    enqueue(*s, false);
    return false;  // it was announced
  }
  s->last_tag.clear();
  s->backlog.mark_pending();
  return !s->next_notification && !std::exchange(s->ready_announced, true);
}

// ------------------------------------------------------------------------------------- WebSockets and event streams

/// Finds what has changed.
void Subscriptions::scan(TimePoint now) {
  try {
    while (const auto channel = next_notifications_.take_due(now.steady)) {
      SubscriptionResource& s = *find(*channel);
      s.next_notification.reset();
      s.ready_announced = false;
      announce(s);
    }
    scanner_.read_samples(now);
    if (scanner_.is_due(now)) {
      fills_queues_ = true;
      const std::vector<Channel> marked = std::exchange(marked_, {});
      for (const Channel channel : marked) {
        SubscriptionResource* s = find(channel);
        if (s) fill(*s);
      }
      scanner_.scan(now, !marked.empty());
      fills_queues_ = false;
      if (!marked_.empty() && !scanner_.is_scanning()) scanner_.start();
    }
    notify_of_structure();
  } catch (const std::exception& e) {
    fills_queues_ = false;
    responses_.log(LogLevel::error, std::string("observers could not be notified of a change: ") + e.what());
  }
}

std::optional<Channel> Subscriptions::next_ready(TimePoint now) {
  scan(now);
  for (std::deque<Channel>* list : {&urgent_, &ready_}) {  // commands and closes first
    while (!list->empty()) {
      const Channel first = list->front();
      list->pop_front();
      if (find(first) || closing_.count(static_cast<std::uint64_t>(first)) != 0) return first;
    }
  }
  return std::nullopt;
}

void Subscriptions::take_ready(std::vector<ReadyChannel>& channels, TimePoint now) {
  scan(now);
  for (const Channel channel : std::exchange(urgent_, {})) channels.push_back({channel, true});
  for (const Channel channel : std::exchange(ready_, {})) channels.push_back({channel, false});
}

std::optional<Push> Subscriptions::next_push(Channel channel, TimePoint now) {
  try {
    Push push;
    if (SubscriptionResource* s = find(channel)) {
      auto item = next_item(*s, now);
      if (!item) return std::nullopt;
      ++s->delivered;
      ++sent_;
      push.message = item->body;
      push.text = s->its_variant.is_text();
      return push;
    }
    const auto closing = closing_.find(static_cast<std::uint64_t>(channel));
    if (closing == closing_.end()) {
      push.close = 1001;
      return push;
    }
    if (!closing->second.items.empty()) {
      push.message = closing->second.items.front()->body;
      push.text = closing->second.text;
      closing->second.items.pop_front();
      if (closing_feeds_.count(closing->first) != 0) {
        closing_feed_bytes_ -= push.message->size();
        closing->second.bytes -= push.message->size();
        if (closing->second.items.empty()) closing_feeds_.erase(closing->first);
      }
      return push;
    }
    push.close = closing->second.code;
    push.reason = std::move(closing->second.reason);
    forget_closing(channel);
    return push;
  } catch (const std::exception& e) {
    responses_.log(LogLevel::error, std::string("a notification could not be encoded: ") + e.what());
    return std::nullopt;
  }
}

void Subscriptions::closed(Channel channel) {
  forget_closing(channel);
  SubscriptionResource* s = find(channel);
  if (s && s->protocol != Protocol::callback) end(*s, 0, {});
}

std::optional<Subscriptions::Instant> Subscriptions::next_deadline() const {
  if (!urgent_.empty() || !ready_.empty()) return Instant{};
  return next_notifications_.next();
}

// --------------------------------------------------------------------------------------------------------- web callbacks

std::optional<subscription::Notification> Subscriptions::next_notification(Channel channel, TimePoint now) {
  SubscriptionResource* s = find(channel);
  if (!s || s->protocol != Protocol::callback || s->under_way || s->confirming) return std::nullopt;
  try {
    if (s->awaits_confirmation()) return confirmation_of(*s);
    auto item = next_item(*s, now);
    if (!item) return std::nullopt;
    subscription::Notification notification;
    notification.url = s->url;
    notification.body = item->body;
    notification.secret = s->secret.empty() ? options_.callbacks.secret : s->secret;
    notification.failed_before = s->retry.tried();
    notification.fields.add("Content-Type", content_type(s->its_variant, s->observed.variants().type_of(s->its_variant)));
    notification.fields.add(notification_field, instance_ + "; base=\"" + bases_[s->base] + '"');
    notification.fields.add("ETag", item->tag);
    http::LinkWriter links;
    links.add(bases_[s->base] + s->observed.path, "about");
    links.add(bases_[s->base] + s->path, "via");
    links.finish(notification.fields, {});
    s->under_way = std::move(item);
    return notification;
  } catch (const std::exception& e) {
    responses_.log(LogLevel::error, std::string("a notification could not be encoded: ") + e.what());
    return std::nullopt;
  }
}

bool Subscriptions::must_confirm(const std::string& url) const {
  using subscription::Confirmation;
  const Confirmation which = options_.callbacks.confirmation;
  if (which != Confirmation::not_loopback) return which == Confirmation::all;
  const Result<subscription::CallbackUrl> parsed = subscription::parse_callback_url(url);
  return !parsed || !loopback_->names(parsed->host, parsed->port);
}

/// Asks the receiver to confirm the subscription (WebSub 5.3).
subscription::Notification Subscriptions::confirmation_of(SubscriptionResource& s) const {
  constexpr char digits[] = "0123456789ABCDEF";
  subscription::Notification question;
  question.url = s.url;
  question.failed_before = s.retry.tried();
  question.challenge = RandomIds().next();
  question.query = "hub.mode=subscribe&hub.challenge=" + question.challenge + "&hub.topic=";
  for (const char c : bases_[s.base] + s.observed.path) {
    if (lrt::detail::is(c, lrt::detail::unreserved)) {
      question.query += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      ((question.query += '%') += digits[byte >> 4]) += digits[byte & 15];
    }
  }
  s.confirming = true;
  return question;
}

void Subscriptions::delivered(Channel channel, const subscription::DeliveryResult& result, TimePoint now) {
  SubscriptionResource* s = find(channel);
  if (!s || !(s->under_way || s->confirming)) return;  // cancelled meanwhile
  const bool confirming = std::exchange(s->confirming, false);
  subscription::Item item = std::exchange(s->under_way, nullptr);
  s->ready_announced = false;
  if (confirming && result.confirmed) {
    s->has_confirmed = true;
    ++s->revision;
    s->saved_text.clear();
    saves_.changed();
    s->retry.succeeded();
    s->last_error.clear();
    s->logged_error.clear();
    return announce(*s);
  }
  const bool may_confirm_later = result.status == 0 || result.status == 408 || result.status == 429 || result.status >= 500;
  if (!confirming && result.status >= 200 && result.status < 300) {
    ++s->delivered;
    ++sent_;
    s->retry.succeeded();
    s->last_error.clear();
    s->logged_error.clear();
    return announce(*s);
  }
  s->last_error = public_reason(result);
  const std::string& detail = result.error.empty() ? s->last_error : result.error;
  if (std::exchange(s->logged_error, detail) != detail) responses_.log(LogLevel::warning, s->path + ": " + detail);
  ++s->revision;
  if (result.status == 410 || result.refused || (confirming && !may_confirm_later)) {
    responses_.log(LogLevel::info, s->path + " ends: " + (confirming ? "the receiver did not confirm it: " : "") + detail);
    return end(*s, 0, {});
  }
  // Jitter from the data of the subscription: the engine has no random source.
  const std::uint64_t spread = std::hash<std::string>()(s->subscription_id) ^ (s->backlog.dropped() * 7919 + s->revision * 104729);
  const auto pause = s->retry.failed(static_cast<double>(spread % 1024) / 1024);
  if (!pause) {
    responses_.log(LogLevel::warning, s->path + " ends after too many failures: " + detail);
    return end(*s, 0, {});
  }
  if (s->queues() && !s->retry.suspended()) {
    if (item) s->backlog.put_back(std::move(item));
  } else {
    s->backlog.drop_items();
    s->backlog.mark_pending();
  }
  s->last_tag.clear();
  s->backlog.set_due(now.steady + *pause);
  if (!s->backlog.empty()) next_notifications_.set(s->next_notification, s->backlog.due(), s->channel);
}

}  // namespace v0
}  // namespace lrt::engine
