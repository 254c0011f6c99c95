// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/subscription.hpp"

#include <utility>

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/receivers/protocols.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::engine {
inline namespace v0 {

// ---------------------------------------------------------------------------------------------------------- subscription

SubscriptionResource::SubscriptionResource(std::string its_path, std::string its_id, Channel its_channel, SubscriptionRequest request,
                                           std::size_t its_base, Utc at, Subscriptions& owner, const ReceiverParts& parts)
    : Resource(std::move(its_path), request.observed->thing),
      subscription_id(std::move(its_id)),
      channel(its_channel),
      observed(*request.observed),
      protocol(request.protocol),
      base(its_base),
      base_hold(parts.bases.hold(its_base)),
      its_variant(request.variant),
      created(at),
      audience(std::move(request.audience)),
      backlog(request.policy, parts.options.subscriptions.max_queue_bytes, parts.options.subscriptions.max_total_queue_bytes,
              parts.subscribers.queued_bytes),
      held(request.provisional),
      receiver(entry_of(request.protocol).make_receiver(*this, request, parts)),
      owner_(owner),
      schedule_(parts.schedule) {}

SubscriptionResource::~SubscriptionResource() = default;

bool SubscriptionResource::is_shown_to(const Audience& asking) const {
  if (receiver->feed()) return true;  // whose messages go to many
  if (!asking.view || asking.view->at(path).has(security::Right::manage)) return true;
  if (!audience.principal || !asking.principal) return audience.principal == asking.principal;
  return audience.principal->name == asking.principal->name;
}

Methods SubscriptionResource::methods() const noexcept {
  Methods methods;
  methods.remove = !receiver->feed();  // one client could end it for all receivers of its messages
  return methods;
}

Outcome SubscriptionResource::remove(Context& context, Parts& parts) {
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  return receiver->cancel(context, parts.responses.no_content(context), owner_);  // this object may be destroyed now
}

void SubscriptionResource::resource_changed(SeenBy seen) {
  if (seen(audience)) schedule_.changed(*this);
}
void SubscriptionResource::resource_changes(SeenBy seen) {
  if (seen(audience)) schedule_.fill(*this);
}
void SubscriptionResource::values_missed(std::uint64_t count, SeenBy seen) {
  if (queues() && seen(audience)) backlog.count_dropped(count);
}
void SubscriptionResource::resource_removed() { owner_.resource_removed(*this); }

void SubscriptionResource::describe_controls(About& about, const Description& d) const { receiver->describe_controls(about, d.base); }

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
  receiver->describe_delivery(about);
}

void SubscriptionResource::describe_types(About& about, const Description&) const { about.a(vocab::hybrit::Subscription).a(entry_of(protocol).type); }

void SubscriptionResource::describe_constants(About& about, const Description& d) const {
  describe_types(about, d);
  about.link(vocab::hybrit::onResource, d.engine.bases[base] + observed.path);
  receiver->describe(about, d.base);
  about.add(vocab::hybrit::mediaType, rdf::literal(observed.variants().type_of(its_variant)));
  about.add(vocab::dcterms::identifier, rdf::literal(subscription_id));
}

void SubscriptionResource::summarize(Overview& o) const {
  o.text("protocol", receiver->name());
  o.link("observes", o.iri(observed), observed.kind().name);
}

void SubscriptionResource::overview(Overview& o) const {
  const subscription::Policy& policy = backlog.policy();
  o.text("callback", receiver->url());
  o.text("mediaType", observed.variants().type_of(its_variant));
  o.text("created", to_xsd_date_time(created));
  if (audience.principal) o.text("owner", audience.principal->name);
  if (policy.queues()) o.number("queueLength", policy.queue_length);
  if (policy.minimum_interval.count() > 0)
    o.json("minimumInterval", rdf::lexical::format(std::chrono::duration<double>(policy.minimum_interval).count()));
  o.number("delivered", delivered);
  o.number("dropped", backlog.dropped());
  receiver->overview_delivery(o);
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
    describe_binding(about, d, *this, vocab::http_methods::POST,
                     {std::string(vocab::hybrit::Subscription.text), std::string(vocab::hybrit::WebCallback.text)});
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
  About(graph, shape).a(vocab::sh::NodeShape).add(vocab::rdfs::label, rdf::literal("subscriptions"));
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
