// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/subscription.hpp"

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

std::string receiver_of(const std::string& url) {
  const Result<subscription::CallbackUrl> parsed = subscription::parse_callback_url(url);
  return parsed ? (parsed->secure ? "https://" : "http://") + parsed->authority : std::string();
}

}  // namespace

// ---------------------------------------------------------------------------------------------------------- subscription

SubscriptionResource::SubscriptionResource(std::string its_path, std::string its_id, Channel its_channel, SubscriptionRequest request,
                                           std::size_t its_base, Utc at, Subscriptions& owner, const EngineOptions& options,
                                           std::size_t& queued_bytes)
    : Resource(std::move(its_path), request.observed->thing),
      subscription_id(std::move(its_id)),
      channel(its_channel),
      observed(*request.observed),
      protocol(request.protocol),
      base(its_base),
      its_variant(request.variant),
      url(request.url),
      receiver(receiver_of(request.url)),
      secret(std::move(request.secret)),
      created(at),
      audience(std::move(request.audience)),
      backlog(request.policy, options.subscriptions.max_queue_bytes, options.subscriptions.max_total_queue_bytes, queued_bytes),
      retry(options.callbacks),
      has_confirmed(request.has_confirmed),
      provisional(request.provisional),
      feed(std::move(request.feed)),
      owner_(owner) {}

bool SubscriptionResource::is_shown_to(const Audience& asking) const {
  if (feed) return true;  // whose messages go to many
  if (!asking.view || asking.view->at(path).has(security::Right::manage)) return true;
  if (!audience.principal || !asking.principal) return audience.principal == asking.principal;
  return audience.principal->name == asking.principal->name;
}

Methods SubscriptionResource::methods() const noexcept {
  Methods methods;
  methods.remove = !feed;  // one client could end it for all receivers of its messages
  return methods;
}

Outcome SubscriptionResource::remove(Context& context, Parts& parts) {
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  return owner_.cancel(context, *this, parts.responses.no_content(context));  // this object may be destroyed now
}

void SubscriptionResource::resource_changed() { owner_.changed(*this); }
void SubscriptionResource::resource_changes() { owner_.fill(*this); }
void SubscriptionResource::values_missed(std::uint64_t count) {
  if (queues()) backlog.count_dropped(count);
}
void SubscriptionResource::resource_removed() { owner_.resource_removed(*this); }

void SubscriptionResource::describe_controls(About& about, const Description& d) const {
  if (feed) about.statements(feed->statements, d.base);
}

std::string_view SubscriptionResource::protocol_name() const noexcept {
  constexpr std::string_view names[] = {"websocket", "callback", "event_stream"};
  return feed ? std::string_view(feed->name) : names[static_cast<std::size_t>(protocol)];
}

void SubscriptionResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  const subscription::Policy& policy = backlog.policy();
  describe_constants(about, d);
  about.when(vocab::dcterms::created, created);
  if (audience.principal) about.add(vocab::lrt_::owner, rdf::literal(audience.principal->name));
  about.add(vocab::lrt_::delivery, rdf::TermView(policy.queues() ? vocab::lrt_::queue : vocab::lrt_::latest));
  const auto count = [&](Iri predicate, std::uint64_t n) { about.add(predicate, rdf::literal(std::to_string(n), vocab::xsd::integer)); };
  if (policy.queues()) count(vocab::lrt_::queueLength, policy.queue_length);
  if (policy.minimum_interval.count() > 0) {
    const double seconds = std::chrono::duration<double>(policy.minimum_interval).count();
    about.add(vocab::lrt_::minimumInterval, rdf::literal(rdf::lexical::format(seconds), vocab::xsd::double_));
  }
  count(vocab::lrt_::delivered, delivered);
  count(vocab::lrt_::dropped, backlog.dropped());
  if (!last_error.empty()) about.add(vocab::lrt_::lastError, rdf::literal(last_error));
  if (retry.suspended()) about.add(vocab::lrt_::suspended, rdf::literal("true", vocab::xsd::boolean));
  if (must_confirm) about.add(vocab::lrt_::confirmed, rdf::literal(has_confirmed ? "true" : "false", vocab::xsd::boolean));
}

void SubscriptionResource::describe_types(About& about, const Description&) const {
  about.a(vocab::hybrit::Subscription);
  switch (protocol) {
    case Protocol::websocket: about.a(vocab::hybrit::WebSocket); break;
    case Protocol::callback: about.a(vocab::hybrit::WebCallback); break;
    case Protocol::event_stream: about.a(vocab::lrt_::EventStream); break;
    case Protocol::feed: about.a(vocab::lrt_::Feed); break;
  }
}

void SubscriptionResource::describe_constants(About& about, const Description& d) const {
  describe_types(about, d);
  about.link(vocab::hybrit::onResource, d.engine.bases[base] + observed.path);
  if (protocol == Protocol::callback) about.add(vocab::hybrit::callbackURL, rdf::literal(url, vocab::xsd::anyURI));
  if (feed) about.statements(feed->statements, d.base);
  about.add(vocab::hybrit::mediaType, rdf::literal(observed.variants().type_of(its_variant)));
  about.add(vocab::dcterms::identifier, rdf::literal(subscription_id));
}

void SubscriptionResource::summarize(Overview& o) const {
  o.text("protocol", protocol_name());
  o.link("observes", o.iri(observed), observed.kind().name);
}

void SubscriptionResource::overview(Overview& o) const {
  const subscription::Policy& policy = backlog.policy();
  o.text("callback", url);
  o.text("mediaType", observed.variants().type_of(its_variant));
  o.text("created", to_xsd_date_time(created));
  if (audience.principal) o.text("owner", audience.principal->name);
  if (policy.queues()) o.number("queueLength", policy.queue_length);
  if (policy.minimum_interval.count() > 0)
    o.json("minimumInterval", rdf::lexical::format(std::chrono::duration<double>(policy.minimum_interval).count()));
  o.number("delivered", delivered);
  o.number("dropped", backlog.dropped());
  o.text("lastError", last_error);
  o.json("suspended", retry.suspended() ? "true" : "false");
  if (must_confirm) o.json("confirmed", has_confirmed ? "true" : "false");
}

std::string SubscriptionResource::up() const { return observed.subscriptions()->path; }

// ------------------------------------------------------------------------------------------------------------- container

Methods SubscriptionsResource::methods() const noexcept {
  Methods methods;
  methods.post = thing != nullptr;
  return methods;
}

Outcome SubscriptionsResource::post(Context& context, Parts& parts) { return parts.subscriptions.create(context); }

std::string SubscriptionsResource::input_shape() const { return thing ? thing->shape_name("subscriptions") : std::string(); }

std::string SubscriptionsResource::up() const { return thing ? Resource::up() : path.substr(0, path.rfind('/')); }

void SubscriptionsResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.link(vocab::rdfs::seeAlso, d.base + up());
  describe_container(about, *this, d);
}

void SubscriptionsResource::describe_controls(About& about, const Description& d) const {
  Resource::describe_controls(about, d);
  if (d.engine.makes_callbacks && d.audience.methods(*this).post)
    describe_binding(about, d, *this, vocab::http_methods::POST, std::string(vocab::hybrit::WebCallback.text));
}

void SubscriptionsResource::describe_types(About& about, const Description&) const { describe_container_types(about); }

void SubscriptionsResource::overview(Overview& o) const { o.members("members", *this); }

std::vector<Resource*> SubscriptionsResource::members() const {
  std::vector<Resource*> all;
  for (const auto& s : subscriptions) all.push_back(s.get());
  return all;
}

void SubscriptionsResource::describe_member(const Resource& member, About& about, const Description& d) const {
  static_cast<const SubscriptionResource&>(member).describe_constants(about, d);
}

void describe_subscription_shape(rdf::Graph& graph, const std::string& iri, const subscription::SubscriptionOptions& options) {
  const rdf::TermId shape = graph.intern(rdf::iri(iri));
  About(graph, shape).a(vocab::sh::NodeShape).add(vocab::sh::name, rdf::literal("subscriptions"));
  const auto integer = [](std::uint64_t n) { return std::to_string(n); };
  const auto property = [&](Iri path, bool required) {
    const rdf::TermId p = graph.fresh_blank();
    About(graph, shape).add(vocab::sh::property, p);
    About about(graph, p);
    about.add(vocab::sh::path, rdf::TermView(path));
    if (required) about.add(vocab::sh::minCount, rdf::literal("1", vocab::xsd::integer));
    about.add(vocab::sh::maxCount, rdf::literal("1", vocab::xsd::integer));
    return about;
  };
  property(vocab::hybrit::onResource, true).add(vocab::sh::nodeKind, rdf::TermView(vocab::sh::IRI));
  property(vocab::hybrit::callbackURL, true);
  property(vocab::hybrit::mediaType, false).add(vocab::sh::datatype, rdf::TermView(vocab::xsd::string));
  property(vocab::lrt_::minimumInterval, false)
      .add(vocab::sh::minInclusive, rdf::literal("0", vocab::xsd::integer))
      .add(vocab::sh::maxInclusive, rdf::literal(integer(max_interval.count()), vocab::xsd::integer));
  property(vocab::lrt_::queueLength, false)
      .add(vocab::sh::datatype, rdf::TermView(vocab::xsd::integer))
      .add(vocab::sh::minInclusive, rdf::literal("0", vocab::xsd::integer))
      .add(vocab::sh::maxInclusive, rdf::literal(integer(options.max_queue_length), vocab::xsd::integer));
  property(vocab::lrt_::secret, false)
      .add(vocab::sh::datatype, rdf::TermView(vocab::xsd::string))
      .add(vocab::sh::maxLength, rdf::literal(integer(max_secret), vocab::xsd::integer));
}

}  // namespace v0
}  // namespace lrt::engine
