// SPDX-License-Identifier: Apache-2.0
#include "src/engine/parts.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <string>
#include <utility>

#include <lrt/base/ids.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/engine/registration.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/http/etag.hpp"

namespace lrt::engine {

namespace {

EngineOptions completed(EngineOptions options) {
  if (!options.ids) options.ids = std::make_shared<RandomIds>();
  if (!options.everybody_reads) options.everybody_reads = !options.authorize;
  while (!options.public_base.empty() && options.public_base.back() == '/') options.public_base.pop_back();
  return options;
}

/// A path segment that changes with the text of a query.
std::string version_of(const std::string& text) {
  std::string version = http::entity_tag({}, text);
  version.erase(std::remove(version.begin(), version.end(), '"'), version.end());
  return iri::encode_segment(version);
}

Error path_taken(const std::string& path, const Resource& holder) {
  std::string message = "path \"" + path.substr(1) + "\" ";
  if (holder.thing) message += "is already in use, in the thing \"" + holder.thing->spec->path + "\": choose another name";
  else
    message +=
        "is reserved, as are \"ns/lrt\", \"ns/vocabulary\", \"ns/context.jsonld\", \"ns/structure\", \".well-known/void\" and, with tokens, "
        "\"ns/session\" and "
        "\"ns/ticket\", and the path of the SPARQL endpoint: choose another name";
  return {Errc::duplicate_path, std::move(message)};
}

const model::StopStateSpec* stop_state_of(const model::ThingSpec& thing) noexcept {
  for (const auto& a : thing.actions)
    if (a->stop_state) return a->stop_state.get();
  return nullptr;
}

ObservableResource observable(const Resource& resource) {
  ObservableResource made{static_cast<std::uint64_t>(resource.id), resource.path, resource.kind().name, resource.observable()->wants_queues()};
  if (made.kind == "property") {
    const model::PropertySpec& spec = *static_cast<const PropertyResource&>(resource).spec;
    made.document = spec.file;
    made.counter = spec.counter;
  }
  return made;
}

/// Allocates only if both lists have elements.
template <class T>
bool move_all(std::vector<T>&& from, std::vector<T>& to) {
  if (from.empty()) return false;
  if (to.empty()) to.swap(from);
  else to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  return true;
}

/// Tells the change numbers of one engine from those of the next: a server that starts again counts from the beginning.
std::string series_of(std::chrono::system_clock::time_point start) {
  return std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(start.time_since_epoch()).count());
}

}  // namespace

Parts::Parts(EngineOptions given)
    : options(completed(std::move(given))),
      clock(options.clock ? *options.clock : system_clock()),
      run_time(clock),
      stamped_fields(run_time),
      bases(options.public_base, options.allowed_hosts, options.max_forwarded_bases),
      cors(options),
      cache(options.max_cache_bytes),
      registry(cache),
      kinds(registry),
      calls(options.dispatch, 2 * options.max_waiting_requests),
      pending(registry, calls, cors, options.max_waiting_requests),
      context_text(rdf::json_ld_context(options.prefixes)),
      responses(options, bases, TermsResource::location, std::string(ContextResource::location) + "?v=" + version_of(context_text)),
      rules(responses, run_time),
      saves(options.save_timeout, options.max_waiting_requests, pending, responses),
      values(calls, registry, options, clock),
      view{options, registry, bases, !options.callbacks.allow.empty()},
      representations(options, view, cors, responses, cache, values, pending),
      bodies(options, view, responses, calls, pending, ContextResource::location),
      scanner(values, registry, calls, options.subscriptions, clock),
      callback_rules(options, bases, responses),
      schedule(registry, responses, representations, values, scanner, subscribers, clock),
      receiver_parts{options,     bases,    responses, representations, callback_rules,        saves,
                     subscribers, schedule, run_time,  rights,          series_of(clock.utc())},
      subscription_requests(receiver_parts, registry, bodies, representations),
      subscriptions(receiver_parts, subscription_requests, registry, representations, values, scanner),
      access(options, bases, cors, responses, callback_rules, subscription_requests),
      saved(options, registry, bases, responses, callback_rules, subscriptions, saves, clock),
      invocations(options, registry, calls, pending, responses, rules, representations, bodies, scanner, stops),
      tree("/all", nullptr, &registry),
      structure(registry, cache, options),
      root(registry, TermsResource::location, tree, options.sessions ? SessionResource::location : "",
           options.query ? options.query->limits().path : ""),
      context(context_text),
      own_terms(vocabulary),
      dataset(options.query ? options.query->limits().path : ""),
      queries(options.query ? QueryExtension::of(*options.query).make_queries(*options.query, *this) : nullptr),
      handle_log(std::make_shared<model::HandleLog>(options.log)) {
  registry.add(tree);
  registry.add(structure);
  registry.add(root);
  registry.add(terms);
  if (!context_text.empty()) registry.add(context);
  registry.add(own_terms);
  registry.add(dataset);
  if (!options.sessions) return;
  registry.add(session.emplace(*options.sessions));
  registry.add(tickets.emplace(*options.sessions));
}

Parts::~Parts() {
  handle_log->close();
  registry.clear();
  kinds.clear();
}

Result<void> Parts::add(Thing thing) {
  std::unique_ptr<model::ThingSpec> wanted = std::move(thing).release();
  Result<std::unique_ptr<ThingNode>> built = build_thing(wanted);
  if (!built) {
    discard(std::move(wanted));
    return Unexpected{std::move(built).error()};
  }
  ThingNode& node = **built;
  Result<void> checked = vocabulary.check(*node.spec);
  if (checked && !options.has_executor) checked = check_without_executor(*node.spec);
  if (!checked) {
    discard(*std::move(built));
    return checked;
  }
  const std::vector<Resource*> all = node.resources();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (registry.add(*all[i])) continue;
    Unexpected taken{path_taken(all[i]->path, *registry.find(all[i]->path))};
    for (std::size_t j = 0; j < i; ++j) registry.remove(*all[j]);
    discard(*std::move(built));
    return taken;
  }
  kinds.join(node, view);
  if (!node.user_shapes().empty()) {
    if (const Result<shacl::Shapes> compiled = compiled_shapes(node, 0, view); !compiled) {
      kinds.leave(node);
      for (Resource* r : all) registry.remove(*r);
      Error error = compiled.error();
      error.message = "thing \"" + node.spec->path + "\", its shapes: " + error.message;
      discard(*std::move(built));
      return Unexpected{std::move(error)};
    }
  }
  if (node.spec->handles) node.spec->handles->log = handle_log;
  for (const auto& p : node.spec->properties) {
    p->seal();
    if (p->slot) p->slot->set_clock(clock);
    if (p->slot) p->slot->attach(scanner.wake_signal());
    if (p->changes) p->changes->attach(scanner.wake_signal());
  }
  for (const auto& a : node.spec->actions) {
    a->seal();
    a->availability.attach(scanner.availability_signal());
  }
  for (const auto& c : node.spec->collections) c->seal();
  vocabulary.add(*node.spec);
  registry.add_thing(*std::move(built));
  for (const auto& a : node.actions) a->take_availability();        // now that it has its place in the tree
  for (const auto& p : node.properties) values.take_published(*p);  // what was published before
  node.self.attach(*this);
  if (const model::StopStateSpec* const declared = stop_state_of(*node.spec)) {
    if (!stops) stops = StopExtension::of(*declared).make(*this);
    stops->add(node);
  }
  return {};
}

void Parts::remove(ThingNode& thing) {
  if (thing.stop_state) stops->remove(thing);
  for (const auto& p : thing.properties) p->removed(*this);
  for (const auto& a : thing.actions) invocations.removed(*a, clock.now());
  for (const auto& c : thing.collections) c->removed(*this);
  if (thing.control) leases.clear(thing.control->lease_end);
  thing.self.removed(*this);
  kinds.leave(thing);
  for (Resource* r : thing.resources()) registry.remove(*r);
  vocabulary.remove(*thing.spec);
  discard(registry.remove_thing(thing));
}

bool Parts::take(Outputs& outputs) {
  bool any = move_all(std::exchange(discarded, {}), outputs.discarded);
  any |= move_all(calls.take_jobs(), outputs.jobs);
  any |= move_all(bodies.take_jobs(), outputs.body_jobs);
  if (queries) any |= move_all(queries->take_jobs(), outputs.query_jobs);
  any |= move_all(subscriptions.take_callbacks(), outputs.callbacks);
  if (options.reports_subscriptions) any |= move_all(subscriptions.take_events(), outputs.subscription_events);
  for (const ResourceId id : registry.take_new())
    if (const Resource* r = registry.find(id); r && r->observable()) any = true, outputs.new_resources.push_back(observable(*r));
  if (std::exchange(taken_structure, registry.structure()) != registry.structure()) any = true, outputs.structure = taken_structure;
  if (options.saves_callbacks)
    if (std::optional<SavedText> text = saved.take()) any = true, outputs.saved = std::move(text);
  return any;
}

std::vector<ObservableResource> Parts::observable_resources() const {
  std::vector<ObservableResource> all;
  registry.for_each([&](const Resource& r) {
    if (r.observable()) all.push_back(observable(r));
  });
  return all;
}

void Parts::respond_gone(Ticket ticket) {
  const Context* waiting = pending.resume(ticket, clock.now());
  if (!waiting) return;
  Context without = *waiting;
  without.resource = nullptr;
  pending.respond(ticket, responses.gone(without));
}

PendingRequests::Timeout Parts::timed_out() {
  return [this](Ticket ticket, Context& late, bool runs) {
    if (runs) return pending.respond(ticket, responses.no_content(late, 202));
    const bool is_late = late.expiry.is_late(late.now.steady);
    pending.respond(ticket, is_late ? rules.refused(late, Refusal::late) : responses.timed_out(late));
  };
}

std::optional<Ticket> Parts::defer_command(const Context& command, Dispatch where) {
  const auto ticket = pending.defer(command, options.host_timeout, timed_out(), where);
  if (ticket && command.expiry.valid_until) pending.answer_by(*ticket, *command.expiry.valid_until);
  return ticket;
}

}  // namespace lrt::engine
