#include <algorithm>
#include <cmath>

#include <lrt/base/iri.hpp>
#include <lrt/http/negotiate.hpp>
#include <lrt/http/websocket.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/engine/impl.hpp"

namespace lrt::engine {

namespace {

/// R0.12: Property, Thing, its state, Action, invocation.
bool observable(const Resource& resource) noexcept {
  switch (resource.kind) {
    case Kind::thing:
    case Kind::state:
    case Kind::property:
    case Kind::action:
    case Kind::invocation: return true;
    default: return false;
  }
}

/// SPEC 3.5 as of SHACL: the node that describes the subscription. `<>`, or the only subject that says what it observes.
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
  for (const Iri type : {vocab::hybrit::Subscription, vocab::hybrit::WebCallback, vocab::hybrit::WebSocket}) collect(vocab::rdf::type, type);
  return found;
}

}  // namespace

std::optional<std::chrono::milliseconds> interval_of(std::string_view seconds) {
  const std::optional<double> value = rdf::lexical::parse_double(seconds);
  if (!value || !(*value >= 0) || *value > static_cast<double>(longest_interval.count())) return std::nullopt;
  return std::chrono::milliseconds(std::llround(*value * 1000));
}

Result<void> Engine::Impl::check() const {
  if (!allowed_) return Unexpected{allowed_.error()};
  const subscription::SubscriptionOptions& s = options_.subscriptions;
  if (s.scan_period.count() <= 0) return unexpected(Errc::invalid_option, "subscriptions.scan_period: expected more than 0");
  if (s.callbacks.attempts == 0) return unexpected(Errc::invalid_option, "subscriptions.callbacks.attempts: expected at least 1");
  if (s.callbacks.secret.size() > longest_secret)
    return unexpected(Errc::invalid_option, "subscriptions.callbacks.secret: expected at most " + std::to_string(longest_secret) + " bytes");
  return {};
}

std::optional<Protocol> Engine::Impl::asked_protocol(const Context& context) const {
  if (context.request.method != "GET" || !context.request.find("Upgrade") || !observable(*context.resource)) return std::nullopt;
  if (context.request.can_upgrade && http::asks_for_upgrade(context.request, "websocket")) return Protocol::websocket;
  if (context.request.version < 11) return std::nullopt;  // RFC 9110 7.8
  if (http::asks_for_upgrade(context.request, "callback") || http::asks_for_upgrade(context.request, "webhook")) return Protocol::callback;
  return std::nullopt;
}

subscription::Policy Engine::Impl::default_policy(const Resource& observed) const {
  subscription::Policy policy;
  if (observed.kind == Kind::action || observed.kind == Kind::invocation) policy.queue_length = options_.subscriptions.default_queue_length;
  return policy;
}

std::optional<http::Response> Engine::Impl::refused_subscription(const Context& context, Protocol protocol) {
  const bool callback = protocol == Protocol::callback;
  if (by_channel_.size() < options_.subscriptions.max_subscriptions && (!callback || callbacks_ < options_.subscriptions.callbacks.max_callbacks)) return std::nullopt;
  http::Response response = problem(context, 503, callback ? "there are as many web callbacks as this server keeps"
                                                           : "there are as many subscriptions as this server keeps");
  response.fields.set("Retry-After", std::to_string(options_.retry_after.count()));
  return response;
}

/// A robot that notifies itself would carry out as a command what it says of itself, for whoever asks.
bool Engine::Impl::is_this_server(const subscription::CallbackUrl& url) const {
  const bool here = url.host == "localhost" || url.host == "[::1]" || url.host.compare(0, 4, "127.") == 0;
  const auto answers_for = [this](const std::string& host) { return std::find(hosts_.begin(), hosts_.end(), host) != hosts_.end(); };
  return (here && url.port == port_) || answers_for(url.authority) || answers_for(url.host + ":" + std::to_string(url.port));
}

std::optional<http::Response> Engine::Impl::refused_receiver(const Context& context, const std::string& url) {
  const Result<subscription::CallbackUrl> parsed = subscription::parse_callback_url(url);
  if (!parsed) return problem(context, 400, parsed.error().message);
  if (is_this_server(*parsed)) return problem(context, 403, "callback URL: " + parsed->authority + " is this server itself");
  if (allowed_ && allowed_->names(parsed->host, parsed->port)) return std::nullopt;
  return problem(context, 403, "callback URL: this server may not call " + parsed->authority);
}

/// GET with Upgrade: websocket or callback (R0.12-R0.17).
Outcome Engine::Impl::subscribe(Context& context, Protocol protocol, bool fresh) {
  const http::Request& request = context.request;
  Wish wish;
  wish.observed = context.resource;
  wish.policy = default_policy(*wish.observed);
  if (protocol == Protocol::websocket) {
    if (const auto refusal = http::check_websocket(request)) {
      http::Response response = problem(context, refusal->status, refusal->reason);
      if (refusal->status == 426) {
        response.fields.set("Sec-WebSocket-Version", "13");
        response.fields.set("Upgrade", "websocket");
      }
      return response;
    }
  } else {
    if (request.count("Callback") != 1)
      return problem(context, 400, request.find("Callback") ? "Callback: expected one field" : "a Callback field with the receiver's URL is missing");
    wish.url = std::string(*request.find("Callback"));
    if (auto answer = refused_receiver(context, wish.url)) return *std::move(answer);
  }
  if (const auto interval = query_parameter(request.target, "minimumInterval")) {
    const auto parsed = interval_of(*interval);
    if (!parsed) return problem(context, 400, "minimumInterval: expected seconds from 0 to " + std::to_string(longest_interval.count()));
    wish.policy.minimum_interval = *parsed;
  }
  if (const auto length = query_parameter(request.target, "queueLength")) {
    const auto parsed = rdf::lexical::parse_uint64(*length);
    if (!parsed || *parsed > options_.subscriptions.max_queue_length)
      return problem(context, 400, "queueLength: expected a number from 0 to " + std::to_string(options_.subscriptions.max_queue_length));
    wish.policy.queue_length = static_cast<std::size_t>(*parsed);
  }
  if (auto answer = refused_subscription(context, protocol)) return *std::move(answer);
  if (sync(*context.resource) && !fresh) return read_first(context, pulled_of(*context.resource));

  const Offers& offers = offers_of(*context.resource);
  const auto choice = http::negotiate(accept_of(context), offers.types);
  if (choice && offers.forms[*choice].may_be_missing()) {
    wish.form = offers.forms[*choice];
  } else {
    auto chosen = negotiated(context, false);
    if (auto* answer = std::get_if<http::Response>(&chosen)) return std::move(*answer);
    wish.form = std::get<const Rendering*>(chosen)->form;
  }

  SubscriptionResource& made = make_subscription(std::move(wish), protocol, context.base, options_.ids->next(), context.now.utc);
  if (protocol == Protocol::callback) return created(context, made);
  http::Response response;
  response.status = 101;
  add_types(response.fields, *context.resource);
  response.fields.add("Location", iri_of(context, made.path));
  return Upgraded{made.channel, std::move(response)};
}

/// 201 with the description of what was made; R0.13.
http::Response Engine::Impl::created(const Context& context, SubscriptionResource& made) {
  const std::string location = iri_of(context, made.path);
  http::Response response;
  if (context.preferences.return_ == http::Preferences::Return::minimal) {
    response = no_content(context, 201);
    response.fields.add("Preference-Applied", "return=minimal");
  } else {
    rdf::Graph graph;
    describe_subscription(graph, made, bases_[context.base]);
    response = with_graph(context, 201, graph);
    response.fields.add("Content-Location", location);
  }
  response.fields.add("Location", location);
  return response;
}

/// POST of a description to the container: the same as the Upgrade form (SPEC 3.5).
Outcome Engine::Impl::post_subscription(Context& context) {
  if (asks_for_other_model(context.request.joined("Link"))) return problem(context, 409, "members of this container are ldp:RDFSource");
  if (!allowed_ || allowed_->empty()) return problem(context, 403, "this server may call no receiver: it makes no web callbacks");
  auto read = read_body(context);
  if (auto* answer = std::get_if<http::Response>(&read)) return std::move(*answer);
  const rdf::Graph& graph = std::get<Body>(read).graph;
  ThingNode& thing = *context.resource->thing;
  const std::string here = iri_of(context, context.resource->path);
  const std::vector<rdf::TermId> nodes = focus_nodes(graph, here);
  if (nodes.size() > 1) return problem(context, 422, "body: expected one subscription, found several");
  const auto is_a = [&](Iri type) {
    const auto p = graph.find(vocab::rdf::type), o = graph.find(type);
    return !nodes.empty() && p && o && !graph.match(nodes.front(), *p, *o).empty();
  };
  if (is_a(vocab::hybrit::WebSocket))
    return problem(context, 422, "a WebSocket is opened by GET of the observed resource with Upgrade: websocket, here only web callbacks are made");

  const auto node = nodes.empty() ? std::nullopt : std::optional(nodes.front());
  if (auto answer = refused_by_shape(context, graph, node, subscriptions_shape)) return *std::move(answer);
  if (nodes.empty()) return problem(context, 422, "body: expected triples about <> or one subscription, found none");

  // The shape, which may be the user's own, has been asked; what is needed here is asked for again.
  const auto object = [&](Iri predicate) -> std::optional<std::string> {
    const auto p = graph.find(predicate);
    const auto found = p ? graph.object(nodes.front(), *p) : std::nullopt;
    if (!found || graph.term(*found).is_blank()) return std::nullopt;
    return std::string(graph.term(*found).text);
  };
  Wish wish;
  const std::string observed = object(vocab::hybrit::onResource).value_or("");
  wish.observed = find_iri(observed);
  if (!wish.observed || wish.observed->thing != &thing || !observable(*wish.observed))
    return problem(context, 422, "hybrit:onResource: expected a resource of the thing \"" + thing.spec->path + "\" that can be observed, found <" + observed + ">");
  wish.policy = default_policy(*wish.observed);
  wish.url = object(vocab::hybrit::callbackURL).value_or("");
  wish.secret = object(vocab::lrt::secret).value_or("");
  if (const Result<subscription::CallbackUrl> url = subscription::parse_callback_url(wish.url); !url)
    return problem(context, 422, "hybrit:callbackURL: " + url.error().message);
  if (auto answer = refused_receiver(context, wish.url)) return *std::move(answer);
  const std::string type = object(vocab::hybrit::mediaType).value_or("");
  const Offers& offers = offers_of(*wish.observed);
  const auto choice = http::negotiate(type.empty() ? std::nullopt : std::optional<std::string_view>(type), offers.types);
  if (!choice) return problem(context, 422, "hybrit:mediaType: expected one of " + list_of(offers) + ", found \"" + type + "\"");
  wish.form = offers.forms[*choice];
  if (const auto seconds = object(vocab::lrt::minimumInterval)) {
    const auto interval = interval_of(*seconds);
    if (!interval) return problem(context, 422, "lrt:minimumInterval: expected seconds from 0 to " + std::to_string(longest_interval.count()));
    wish.policy.minimum_interval = *interval;
  }
  if (const auto length = object(vocab::lrt::queueLength)) {
    const auto parsed = rdf::lexical::parse_uint64(*length);
    if (!parsed || *parsed > options_.subscriptions.max_queue_length)
      return problem(context, 422, "lrt:queueLength: expected a number from 0 to " + std::to_string(options_.subscriptions.max_queue_length));
    wish.policy.queue_length = static_cast<std::size_t>(*parsed);
  } else if (const auto delivery = object(vocab::lrt::delivery)) {
    if (*delivery == vocab::lrt::latest.text) wish.policy.queue_length = 0;
    else if (*delivery == vocab::lrt::queue.text) wish.policy.queue_length = options_.subscriptions.default_queue_length;
    else return problem(context, 422, "lrt:delivery: expected lrt:latest or lrt:queue, found " + *delivery);
  }
  if (auto answer = precondition(context)) return *std::move(answer);
  if (auto answer = refused_subscription(context, Protocol::callback)) return *std::move(answer);
  return created(context, make_subscription(std::move(wish), Protocol::callback, context.base, options_.ids->next(), context.now.utc));
}

Resource* Engine::Impl::find_iri(std::string_view iri) const {
  std::string_view path;
  for (const std::string& base : bases_)
    if (iri.size() > base.size() && iri.compare(0, base.size(), base) == 0 && iri[base.size()] == '/') path = iri.substr(base.size());
  if (path.empty()) {
    const auto target = http::split_target(iri);
    if (!target || !target->absolute || !target->query.empty()) return nullptr;
    if (std::find(hosts_.begin(), hosts_.end(), target->authority) == hosts_.end()) return nullptr;
    path = target->path;
  }
  if (path.find_first_of("?#") != std::string_view::npos) return nullptr;
  const Result<std::string> canonical = canonical_path(path);
  return canonical ? find(*canonical) : nullptr;
}

SubscriptionResource& Engine::Impl::make_subscription(Wish wish, Protocol protocol, std::size_t base, std::string id, Utc created) {
  ThingNode& thing = *wish.observed->thing;
  auto made = std::make_unique<SubscriptionResource>(thing.subscriptions.path + "/" + id, &thing, std::move(id), Channel{next_channel_++},
                                                     *wish.observed, wish.policy, options_.subscriptions, queued_bytes_);
  SubscriptionResource& s = *made;
  s.protocol = protocol;
  s.base = base;
  s.form = wish.form;
  if (const auto url = subscription::parse_callback_url(wish.url)) s.receiver = (url->secure ? "https://" : "http://") + url->authority;
  s.url = std::move(wish.url);
  s.secret = std::move(wish.secret);
  s.created = created;
  by_channel_.emplace(static_cast<std::uint64_t>(s.channel), &s);
  thing.members.push_back(std::move(made));
  take_path(s);
  ++thing.subscriptions.revision;
  s.observed.observers.push_back(&s);
  watch(s.observed);
  if (protocol == Protocol::callback) {
    ++callbacks_;
    callbacks_changed_ = true;
  }
  if (wish.policy.queues()) queue(s);  // SPEC 3.6: the first one at once
  else note(s);
  return s;
}

/// With If-Match it is cancelled only if its counters have not moved (R0.11).
Outcome Engine::Impl::delete_subscription(Context& context) {
  if (auto answer = precondition(context)) return *std::move(answer);
  http::Response response = no_content(context);
  unsubscribe(static_cast<SubscriptionResource&>(*context.resource), 1000, "the subscription was cancelled");
  return response;
}

SubscriptionResource* Engine::Impl::find_channel(Channel channel) const {
  const auto found = by_channel_.find(static_cast<std::uint64_t>(channel));
  return found == by_channel_.end() ? nullptr : found->second;
}

/// Ends a subscription. A WebSocket that is still open is told so; a code of 0: it is not.
void Engine::Impl::unsubscribe(SubscriptionResource& s, std::uint16_t code, std::string reason) {
  if (s.protocol == Protocol::websocket && code != 0) {
    Leaving& leaving = leaving_[static_cast<std::uint64_t>(s.channel)];
    leaving.text = s.form.is_text();
    leaving.code = code;
    leaving.reason = std::move(reason);
    if (code != 1000)  // who cancels wants no more
      while (auto item = s.backlog.take_item()) leaving.items.push_back(*std::move(item));
    urgent_.push_back(s.channel);
  }
  if (s.protocol == Protocol::callback) {
    --callbacks_;
    callbacks_changed_ = true;
  }
  clear_timer(s);
  by_channel_.erase(static_cast<std::uint64_t>(s.channel));
  auto& observers = s.observed.observers;
  observers.erase(std::find(observers.begin(), observers.end(), &s));
  unwatch(s.observed);
  ThingNode& thing = *s.thing;
  ++thing.subscriptions.revision;
  drop_path(s);
  thing.members.erase(std::find_if(thing.members.begin(), thing.members.end(), [&](const auto& m) { return m.get() == &s; }));
}

/// The resource goes. Who has not seen its last representation still gets it.
void Engine::Impl::end_observers(Resource& resource) {
  while (!resource.observers.empty()) {
    SubscriptionResource& s = *resource.observers.back();
    if (resource.kind == Kind::invocation && s.protocol == Protocol::websocket && s.backlog.take_pending())
      if (const Result<const Rendering*> last = render(resource, s.base, s.form, 1); last && (*last)->tag != s.last_tag)
        s.backlog.push_last({(*last)->body, (*last)->tag});
    unsubscribe(s, 1001, "the resource is gone");
  }
}

}  // namespace lrt::engine
