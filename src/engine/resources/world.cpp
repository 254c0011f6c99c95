// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/world.hpp"

#include <algorithm>
#include <chrono>
#include <set>
#include <unordered_set>
#include <utility>

#include <lrt/base/ids.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/engine/query_service.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/base/canonical_path.hpp"
#include "src/base/quote.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/http/etag.hpp"
#include "src/http/form.hpp"
#include "src/http/target.hpp"
#include "src/model/host_store.hpp"
#include "src/rdf/difference.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::engine {

namespace {

using model::GraphState;
using model::GraphWrite;

/// Names below a World that a client may choose.
constexpr std::size_t max_name_bytes = 1000, max_names = 16;

/// The request is for the present state only. `If-Match: *` is for any; what If-None-Match excludes is a past state.
bool requires_state(const http::Request& request) { return request.find("If-Match") && request.joined("If-Match") != "*"; }

/// How many parameters of a target have that name, with or without a value.
std::size_t count_parameters(std::string_view target, std::string_view name) {
  std::size_t count = 0;
  for (std::size_t at = target.find('?'); at != std::string_view::npos; at = target.find('&', at + 1)) {
    const std::string_view one = target.substr(at + 1, target.find('&', at + 1) - at - 1);
    if (one.substr(0, one.find('=')) == name) ++count;
  }
  return count;
}

/// A change of several graphs begins again if one of them was changed meanwhile.
constexpr int max_attempts = 4;
/// A change of more triples concerns every query.
constexpr std::size_t max_compared = 1'000;
/// Of a graph in a sentence.
constexpr std::size_t max_shown_name = 300;

/// A triple of the default graph that is in none of the named graphs, whatever the names of its blank nodes are; empty: there is none. A representation of
/// all graphs of a World has each triple in both.
std::string unrepeated(const rdf::Dataset& dataset) {
  const auto text_of = [](const rdf::Graph& graph, const rdf::Triple& t) {
    std::string text;
    for (const rdf::TermId id : {t.subject, t.predicate, t.object}) {
      const rdf::TermView term = graph.term(id);
      text += (term.is_blank() ? "_:" : rdf::to_string(term)) + " ";
    }
    return text;
  };
  if (dataset.default_graph.empty()) return {};
  std::unordered_set<std::string> named;
  for (const auto& [name, graph] : dataset.named)
    for (const rdf::Triple& t : graph.triples()) named.insert(text_of(graph, t));
  for (const rdf::Triple& t : dataset.default_graph.triples())
    if (std::string text = text_of(dataset.default_graph, t); named.count(text) == 0) return text;
  return {};
}

/// Responds when the disk has a change.
/// @param time    how long the request waits
/// @param graphs  whose files get a part of the change
Outcome respond_when_saved(const Context& context, Parts& parts, const std::shared_ptr<model::Saving>& saving, std::chrono::milliseconds time,
                           std::size_t graphs, http::Response response) {
  if (!saving) return response;
  const auto unavailable = [&parts](const Context& c, const std::string& why) {
    http::Response problem = parts.responses.problem(c, 503, why);
    parts.responses.add_retry_after(problem);
    return problem;
  };
  const char* const unknown = "the disk has not said yet that it has this change, which may still come; GET the graph to see";
  const auto ticket = parts.pending.defer_for_disk(
      context, time, [&parts, unavailable, unknown](Ticket late, Context& c, bool) { parts.pending.respond(late, unavailable(c, unknown)); });
  if (!ticket) return unavailable(context, unknown);
  struct Wait {
    http::Response response;
    model::SaveOutcome outcome{};
  };
  auto wait = std::make_shared<Wait>(Wait{std::move(response)});
  const char* const rest = graphs == 1 ? ": nothing has changed" : ": what it has not taken is as it was; GET the graphs to see";
  Inbox::Reserved reply = Inbox::reserve([&parts, ticket = *ticket, wait, unavailable, rest](TimePoint now) {
    const Context* const c = parts.pending.resume(ticket, now);
    if (!c) return;
    switch (wait->outcome) {
      case model::SaveOutcome::saved: return parts.pending.respond(ticket, std::move(wait->response));
      case model::SaveOutcome::refused:
        return parts.pending.respond(ticket, unavailable(*c, std::string("the disk does not take this change") + rest));
      case model::SaveOutcome::full: break;
    }
    http::Response full = parts.responses.problem(*c, 507, std::string("the disk has no room for this change") + rest);
    parts.responses.add_retry_after(full);
    parts.pending.respond(ticket, std::move(full));
  });
  saving->then([wait, inbox = parts.calls.inbox(), reply = std::move(reply)](model::SaveOutcome outcome) mutable {
    wait->outcome = outcome;
    inbox->put(std::move(reply));
  });
  return Deferred{*ticket};
}

Input input_of(const GraphOptions& options) {
  Input input;
  input.may_be_empty = true;
  input.max_bytes = options.max_bytes;
  return input;
}

}  // namespace

// ----------------------------------------------------------------------------------------------------------------- graph

WorldGraphResource::WorldGraphResource(WorldResource& its_world, std::shared_ptr<GraphState> state, bool created)
    : ValueResource(state->path(), its_world.thing),
      world(its_world),
      graph_state(std::move(state)),
      is_created(created),
      version_(graph_state->version()) {}

WorldGraphResource::~WorldGraphResource() {
  graph_state->set_listener(nullptr);
  if (model::HostStore* const store = graph_state->store()) store->set_poll(nullptr);
}

Methods WorldGraphResource::methods() const noexcept {
  Methods methods;
  methods.put = methods.post = methods.remove = methods.patch = is_created || graph_state->options().clients_may_write;
  return methods;
}

Input WorldGraphResource::input(const EngineOptions&) const { return input_of(graph_state->options()); }

Outcome WorldGraphResource::put(Context& context, Parts& parts) { return write(context, parts, GraphWrite::Kind::replace); }
Outcome WorldGraphResource::post(Context& context, Parts& parts) { return write(context, parts, GraphWrite::Kind::merge); }
Outcome WorldGraphResource::patch(Context& context, Parts& parts) { return write(context, parts, GraphWrite::Kind::edit); }

Outcome WorldGraphResource::remove(Context& context, Parts& parts) {
  if (!is_created) return write(context, parts, GraphWrite::Kind::replace);
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  http::Response response = parts.responses.no_content(context);
  world.remove_graph(*this, parts);  // this object was destroyed
  return response;
}

Outcome WorldGraphResource::write(Context& context, Parts& parts, GraphWrite::Kind kind) {
  if (context.judged) {
    auto judged = parts.bodies.changed_graph(context);
    take_changes(parts);
    if (auto outcome = outcome_of(judged)) return *std::move(outcome);
    return changed(context, parts, std::get<Body>(judged));
  }
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  auto made = parts.bodies.graph_task(context, graph_state);
  if (auto* response = std::get_if<http::Response>(&made)) return std::move(*response);
  GraphTask& task = std::get<GraphTask>(made);
  task.write.kind = kind;
  task.check = parts.rules.judge_before_call(context);
  if (requires_state(context.request())) task.write.expected = version_.revision;
  return execute(context, parts, std::move(task));
}

Outcome WorldGraphResource::execute(Context& context, Parts& parts, GraphTask task) {
  auto done = parts.bodies.change_graph(context, std::move(task));
  take_changes(parts);
  if (auto outcome = outcome_of(done)) return *std::move(outcome);
  return changed(context, parts, std::get<Body>(done));
}

Outcome WorldGraphResource::changed(const Context& context, Parts& parts, Body& accepted) const {
  return respond_when_saved(context, parts, accepted.saving, graph_state->options().save_timeout, 1, parts.responses.no_content(context));
}

Outcome WorldGraphResource::take_new(Context& context, Parts& parts) {
  auto judged = parts.bodies.changed_graph(context);
  if (auto outcome = outcome_of(judged)) return *std::move(outcome);
  context.resource = this;
  context.resource_id = id;
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  GraphTask task;
  task.base = parts.bases[context.base];
  task.shows = context.audience.sees(*this);
  task.state = graph_state;
  task.write.kind = context.request().method == "PUT" ? GraphWrite::Kind::replace : GraphWrite::Kind::merge;
  task.check = parts.rules.judge_before_call(context);
  task.set_graph(*std::get<Body>(judged).made_graph->version().graph);
  return execute(context, parts, std::move(task));
}

void WorldGraphResource::attach(Parts& parts) {
  epoch_ = parts.options.ids->next();
  clock_ = &parts.clock;
  view_ = &parts.representations.view();
  graph_state->set_listener([inbox = parts.calls.inbox(), &parts, ref = Ref(*this), waits = changes_wait_] {
    if (waits->exchange(true)) return;
    try {
      inbox->put([&parts, ref](TimePoint) {
        if (WorldGraphResource* graph = parts.registry.find(ref)) graph->take_changes(parts);
      });
    } catch (...) {
      waits->store(false);
      throw;
    }
  });
  parts_ = &parts;
  if (model::HostStore* const store = graph_state->store())
    store->set_poll([inbox = parts.calls.inbox(), &parts](UniqueFunction<void()> job) {
      inbox->put([&parts, job = std::move(job)](TimePoint) mutable { parts.calls.run(Dispatch::in_poll, std::move(job)); });
    });
  take_changes(parts);
}

void WorldGraphResource::take_changes(Parts& parts) {
  changes_wait_->store(false);
  std::vector<std::string> gone;
  const bool has_lost = take_published(parts, gone);
  GraphState::Version version = graph_state->version();
  const bool changed = version.revision != version_.revision;
  struct Reported {  // also if memory is exhausted
    ~Reported() {
      graph.world.only_sizes_change = false;
      graph.before_.reset();
    }
    WorldGraphResource& graph;
  } const reported{*this};
  if (changed) {
    std::swap(version_, version);
    if (!has_lost) before_ = version.graph;
    if (version_.graph->size() != version.graph->size()) {  // the JSON of the World has the number
      world.only_sizes_change = true;
      world.mark_changed([&](const Audience& audience) { return audience.sees(*this); });
      world.only_sizes_change = false;
    }
  }
  if (changed || has_lost)
    mark_changed([&](const Audience& audience) {
      if (!audience.hides_something()) return true;
      const auto saw = [&](const std::string& at) { return audience.view->at(at).has(security::Right::read); };
      return audience.sees(*this) && (changed || std::any_of(gone.begin(), gone.end(), saw));
    });
}

bool WorldGraphResource::is_change_for(const QueryDependencies& query, const std::string& base) const {
  if (!before_ || query.everything) return true;
  const auto difference = rdf::shared_difference(*before_, *version_.graph);
  if (!difference || difference->removed.size() + difference->added.size() > max_compared) return true;
  const auto is = [&](const rdf::TermView& term, const std::vector<std::string>& wanted) {
    std::string placed;
    std::string_view text = term.text;
    if (text.substr(0, placeholder_base.size()) == placeholder_base) text = placed = base + std::string(text.substr(placeholder_base.size()));
    return std::find(wanted.begin(), wanted.end(), text) != wanted.end();
  };
  const auto has_one = [&](const rdf::Graph& graph, const std::vector<rdf::Triple>& triples) {
    return std::any_of(triples.begin(), triples.end(), [&](const rdf::Triple& t) {
      const rdf::TermView predicate = graph.term(t.predicate);
      if (!is(predicate, query.predicates)) return false;
      return predicate.text != vocab::rdf_::type.text || query.types.empty() || is(graph.term(t.object), query.types);
    });
  };
  return has_one(*before_, difference->removed) || has_one(*version_.graph, difference->added);
}

/// @param gone  paths of what is not published any more
/// @return      something is not
bool WorldGraphResource::take_published(Parts& parts, std::vector<std::string>& gone) {
  for (const std::string& fault : graph_state->take_reports()) parts.responses.log(LogLevel::error, fault);
  const std::vector<model::PublishedSpec> present = graph_state->published();
  for (std::size_t i = published_.size(); i-- > 0;) {
    const auto is_it = [&](const model::PublishedSpec& spec) { return spec.property == published_[i].resource->spec; };
    if (std::any_of(present.begin(), present.end(), is_it)) continue;
    Published removed = std::move(published_[i]);
    published_.erase(published_.begin() + static_cast<std::ptrdiff_t>(i));
    gone.push_back(removed.resource->path);
    remove_published(removed, parts);
  }
  for (const model::PublishedSpec& spec : present) {
    const auto is_it = [&](const Published& known) { return known.resource->spec == spec.property; };
    if (std::none_of(published_.begin(), published_.end(), is_it)) add_published(spec, parts);
  }
  return !gone.empty();
}

void WorldGraphResource::add_published(const model::PublishedSpec& spec, Parts& parts) {
  auto made = std::make_unique<PropertyResource>(spec.property->location(), thing, spec.property);
  made->in_graph = std::make_unique<const PropertyResource::InGraph>(PropertyResource::InGraph{*this, spec.expires_after});
  published_.reserve(published_.size() + 1);
  if (!parts.registry.add(*made)) {
    parts.responses.log(LogLevel::error,
                        "path \"" + spec.property->location().substr(1) + "\" is used by another resource: the value published there is not served");
    graph_state->remove_published(*spec.property);
    return;
  }
  spec.property->seal();
  spec.property->slot->set_clock(parts.clock);
  spec.property->slot->attach(parts.scanner.wake_signal());
  PropertyResource& resource = *made;
  published_.push_back({std::move(made), spec.predicate, spec.object});
  for (const Observer* observer : observers)
    if (observer->queues()) parts.values.keep(resource, true);
  if (!observers.empty()) resource.set_watched(true, parts.scanner);
  parts.values.take_published(resource);
}

void WorldGraphResource::remove_published(Published& published, Parts& parts) {
  PropertyResource& resource = *published.resource;
  if (!observers.empty()) resource.set_watched(false, parts.scanner);
  resource.removed(parts);
  parts.registry.remove(resource);
  parts.discard(std::move(published.resource));
}

void WorldGraphResource::removed(Parts& parts) {
  graph_state->set_listener(nullptr);
  if (model::HostStore* const store = graph_state->store()) store->set_poll(nullptr);
  while (!observers.empty()) observers.back()->resource_removed();
  for (Published& published : std::exchange(published_, {})) remove_published(published, parts);
}

// Its triples.

void WorldGraphResource::describe(const Description& d) const {
  d.quote(*this, [&] { add_placed(d.graph, *version_.graph, d.base); });
  describe_published(d);
}

void WorldGraphResource::describe_published(const Description& d) const {
  for (const Published& published : published_) {
    const PropertyResource& resource = *published.resource;
    if (resource.value.is_null()) continue;
    About(d.graph, d.base + path + published.object).link(Iri(std::string_view(published.predicate)), d.base + resource.path);
    resource.describe(d);
  }
}

void WorldGraphResource::describe_types(About& about, const Description&) const { about.a(vocab::lrt_::WorldGraph).a(vocab::ldp::RDFSource); }

void WorldGraphResource::describe_as_member(About& about, const Description& d) const {
  describe_types(about, d);
  about.texts(vocab::dcterms::title, graph_state->options().title).texts(vocab::dcterms::description, graph_state->options().description);
  Resource::describe_controls(about, d);
}

void WorldGraphResource::summarize(Overview& o) const {
  o.words({graph_state->options().title, graph_state->options().description});
  o.number("triples", version_.graph->size());
}

/// The tag is a number of the state, so that no representation is encoded to compare tags. Published values have a second number after a point.
std::string WorldGraphResource::entity_tag(std::string_view media_type, const std::string& base, const Audience& audience, bool for_write) const {
  std::string tag = http::entity_tag(media_type, base + " " + path + " " + epoch_ + " " + std::to_string(version_.revision));
  if (for_write) return tag;
  std::string digits;
  if (audience.is_restricted() && media_type == rdf::media_type(rdf::Plain::json)) digits = rights_digits(audience);
  // The revision counts published values that it may not see.
  if (!published_.empty()) digits += audience.hides_something() ? published_digits(audience) : std::to_string(revision);
  return digits.empty() ? tag : tag.insert(tag.size() - 1, "." + digits);
}

std::string WorldGraphResource::rights_digits(const Audience& audience) const {
  const auto bits = [&](const Resource& resource) {
    const Methods m = audience.methods(resource);
    return (m.put ? 1 : 0) + (m.post ? 2 : 0) + (m.remove ? 4 : 0) + (m.patch ? 8 : 0);
  };
  return std::to_string(1000 + bits(*this) + (audience.sees(world) ? 16 + 32 * bits(world) : 0));
}

std::string WorldGraphResource::published_digits(const Audience& audience) const {
  rdf::Graph all;
  const std::string base(placeholder_base);
  UserWords words;
  describe_published({all, base, 1, *view_, audience, &words});
  const rdf::Graph part = visible_part(
      all, [&](std::string_view iri) { return audience.sees_iri(iri, base, view_->registry); }, words);
  if (part.empty()) return {};
  const Result<std::string> text = rdf::write(part, rdf::Syntax::n_triples, {});
  return std::to_string(rdf::hash_bytes(text ? std::string_view(*text) : std::string_view(), 1));
}

std::string WorldGraphResource::for_write(std::string field) const {
  for (std::size_t dot = field.find('.'); dot != std::string::npos; dot = field.find('.', dot)) {
    std::size_t end = dot + 1;
    while (end < field.size() && field[end] >= '0' && field[end] <= '9') ++end;
    if (end == dot + 1 || end == field.size() || field[end] != '"') ++dot;
    else field.erase(dot, end - dot);
  }
  return field;
}

std::shared_ptr<const rdf::Graph> WorldGraphResource::graph(const EngineView& view) const {
  if (published_.empty()) return version_.graph;
  if (whole_ && whole_revision_ == revision) return whole_;
  auto whole = std::make_shared<rdf::Graph>(*version_.graph);
  const std::string base(placeholder_base);
  const Audience everything;
  describe_published({*whole, base, 1, view, everything});
  whole_ = std::move(whole);
  whole_revision_ = revision;
  return whole_;
}

void WorldGraphResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const {
  for (const Published& published : published_) visit(*published.resource);
}

void WorldGraphResource::for_each_host_content(FunctionRef<void(HostContent&)> visit) const {
  if (graph_state->store()) visit(const_cast<WorldGraphResource&>(*this));
}

bool WorldGraphResource::is_read_each_time() const noexcept { return graph_state->store()->is_read_each_time(); }
bool WorldGraphResource::has_fault() const { return !graph_state->fault().empty(); }

Result<void> WorldGraphResource::check() const {
  if (!graph_state->store()) return {};
  std::string fault = graph_state->fault();
  if (fault.empty()) return {};
  return unexpected(Errc::unavailable, std::move(fault));
}

void WorldGraphResource::read(UniqueFunction<void(const Result<void>&, TimePoint)> done) {
  struct Reading {
    Result<void> result;
    UniqueFunction<void(const Result<void>&, TimePoint)> done;
  };
  auto reading = std::make_shared<Reading>(Reading{unexpected(Errc::unavailable, "it was not read"), std::move(done)});
  Inbox::Reserved reply = Inbox::reserve([reading, ref = Ref(*this), &parts = *parts_](TimePoint now) {
    if (WorldGraphResource* const graph = parts.registry.find(ref)) graph->take_changes(parts);
    reading->done(reading->result, now);
  });
  graph_state->store()->read([reading, reply = Owed(parts_->calls.inbox(), std::move(reply))](const Result<void>& result) mutable {
    reading->result = result;
    reply.leave();
  });
}

void WorldGraphResource::refresh() {
  if (published_.empty()) return;
  const Utc now = clock_->utc();
  for (const Published& published : published_) published.resource->expire(now);
}

void WorldGraphResource::set_observed(bool observed, ChangeScanner& scanner) {
  for (const Published& published : published_) published.resource->set_watched(observed, scanner);
}

// ------------------------------------------------------------------------------------------------------------ all graphs

AllGraphsResource::AllGraphsResource(WorldResource& its_world, std::string its_path)
    : ValueResource(std::move(its_path), its_world.thing), world_(its_world) {}

void AllGraphsResource::describe(const Description& d) const {
  for (const auto& graph : world_.graphs())
    if (d.audience.sees(*graph)) graph->describe(d);
}

std::vector<const Resource*> AllGraphsResource::described_resources(const Audience&) const {
  std::vector<const Resource*> parts;
  for (const auto& graph : world_.graphs()) parts.push_back(graph.get());
  return parts;
}

void AllGraphsResource::describe_types(About& about, const Description&) const { about.a(vocab::ldp::RDFSource); }
const Variants& AllGraphsResource::variants() const { return graph_variants(); }
std::size_t AllGraphsResource::max_bytes(const EngineOptions& options) const noexcept { return options.max_all_bytes; }

bool AllGraphsResource::exceeds(std::size_t max_bytes, const Audience& audience) const {
  std::size_t bytes = 0;
  for (const auto& graph : world_.graphs())
    if (audience.sees(*graph)) bytes += graph->stored_bytes();
  return bytes > max_bytes;
}

std::uint64_t AllGraphsResource::state(std::uint64_t structure) const noexcept {
  std::uint64_t mixed = structure * 1099511628211U;  // or one step of both would cancel out
  for (const auto& graph : world_.graphs()) mixed = (mixed ^ graph->revision) * 1099511628211U;
  return mixed;
}

void AllGraphsResource::refresh() {
  for (const auto& graph : world_.graphs()) graph->refresh();
}

void AllGraphsResource::for_each_host_content(FunctionRef<void(HostContent&)> visit) const {
  for (const auto& graph : world_.graphs()) graph->for_each_host_content(visit);
}

void AllGraphsResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const {
  for (const auto& graph : world_.graphs()) graph->for_each_property(visit);
}

// ------------------------------------------------------------------------------------------------------------- new graph

NewGraphResource::NewGraphResource(WorldResource& its_world, std::string its_path)
    : Resource(std::move(its_path), its_world.thing), world_(its_world) {}

Methods NewGraphResource::methods() const noexcept {
  Methods methods;
  methods.put = methods.post = world_.takes_graphs();
  return methods;
}

Input NewGraphResource::input(const EngineOptions& options) const { return world_.input(options); }

Outcome NewGraphResource::put(Context& context, Parts& parts) {
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  return world_.make_graph(context, parts, world_.named_path(context.request().target, parts));
}

// ----------------------------------------------------------------------------------------------------------------- world

WorldResource::WorldResource(const std::string& its_path, ThingNode* its_thing, const model::WorldSpec& its_spec)
    : ThingResource(its_path, its_thing), spec(its_spec), all_(*this, its_path + "?default"), new_(*this, its_path + "?graph") {
  for (const auto& state : spec.graphs) graphs_.push_back(std::make_unique<WorldGraphResource>(*this, state, false));
}
WorldResource::~WorldResource() = default;

Methods WorldResource::methods() const noexcept {
  Methods methods;
  methods.post = takes_graphs();
  methods.put = methods.post || std::any_of(graphs_.begin(), graphs_.end(), [](const auto& graph) { return graph->methods().put; });
  return methods;
}

Input WorldResource::input(const EngineOptions& options) const { return methods().put ? input_of(dataset_limits({})) : Resource::input(options); }

std::optional<std::size_t> WorldResource::max_put_bytes(const Audience& audience) const {
  const auto takes = [&](const auto& graph) { return graph->methods().put && audience.sees(*graph); };
  if (!takes_graphs() && std::none_of(graphs_.begin(), graphs_.end(), takes)) return std::nullopt;
  return dataset_limits(audience).max_bytes;
}

GraphOptions WorldResource::dataset_limits(const Audience& audience) const {
  GraphOptions largest = takes_graphs() ? spec.options.created : GraphOptions();
  if (!takes_graphs()) largest.max_triples = largest.max_bytes = 0;
  for (const auto& graph : graphs_) {
    if (!graph->methods().put || !audience.sees(*graph)) continue;
    const GraphOptions& options = graph->graph_state->options();
    largest.max_triples = std::max(largest.max_triples, options.max_triples);
    largest.max_bytes = std::max(largest.max_bytes, options.max_bytes);
  }
  return largest;
}

Outcome WorldResource::post(Context& context, Parts& parts) {
  if (requests_other_model(context.request().joined("Link")))
    return parts.responses.problem(context, 409, "members of this container are ldp:RDFSource");
  const std::string at = path + "/" + parts.options.ids->next();
  if (context.judged) {
    const Body* const body = std::get_if<Body>(context.judged.get());
    return body && body->dataset ? take_dataset(context, parts, at) : make_graph(context, parts, at);
  }
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  auto has_graphs = parts.bodies.has_graphs(context);
  if (auto* response = std::get_if<http::Response>(&has_graphs)) return std::move(*response);
  return std::get<bool>(has_graphs) ? take_dataset(context, parts, at) : make_graph(context, parts, at);
}

Outcome WorldResource::put(Context& context, Parts& parts) {
  if (!context.judged) {
    if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
    auto has_graphs = parts.bodies.has_graphs(context);
    if (auto* response = std::get_if<http::Response>(&has_graphs)) return std::move(*response);
  }
  return take_dataset(context, parts, {});
}

// Several graphs at once.

Outcome WorldResource::take_dataset(Context& context, Parts& parts, const std::string& one_path) {
  auto read = context.judged ? parts.bodies.changed_graph(context) : parts.bodies.read_graphs(context, dataset_limits(context.audience), one_path);
  if (auto outcome = outcome_of(read)) return *std::move(outcome);
  Body& body = std::get<Body>(read);
  const std::shared_ptr<DatasetChange> change = std::move(body.dataset);
  if (change->graphs.named.empty() && change->parts.empty()) return make_graph(context, parts, change->one_path, std::move(body.graph));
  if (change->times_prepared > 0) return commit(context, parts, change);
  if (auto response = plan(context, parts, *change)) return *std::move(response);
  auto prepared = parts.bodies.prepare_graphs(context, change);
  if (auto outcome = outcome_of(prepared)) return *std::move(outcome);
  return commit(context, parts, change);
}

std::optional<http::Response> WorldResource::plan(const Context& context, const Parts& parts, DatasetChange& change) const {
  const Audience& audience = context.audience;
  const std::string& base = parts.bases[context.base];
  if (const std::string lost = unrepeated(change.graphs); !lost.empty())
    return parts.responses.problem(
        context, 422, "the default graph: expected only triples that a named graph has too, because a World has no other; found " + shortened(lost));
  const bool replaces = context.request().method == "PUT";
  std::set<std::string> paths;
  std::size_t created = 0;
  for (auto& named : change.graphs.named) {
    const auto& name = named.first;
    auto& graph = named.second;
    const auto refuse = [&](int status, const std::string& sentence) {
      return parts.responses.problem(context, status, "the graph <" + shortened(name, max_shown_name) + ">: " + sentence);
    };
    const std::optional<std::string> of_server = parts.bases.path_of(name);
    const std::string at = of_server ? path_below(*of_server) : std::string();
    if (at.empty()) return refuse(422, "expected an IRI below <" + base + path + "/>");
    if (!paths.insert(at).second) return refuse(422, "the document has it twice");
    const WorldGraphResource* const known = graph_at(at);
    const bool may_write = known ? audience.may(known->kind().right_to_change, *known) : audience.may_choose_name(at, path);
    if (!may_write)
      return parts.responses.denied(context, http::Denial::right, 403,
                                    "the graph <" + shortened(name, max_shown_name) + ">: these credentials do not allow changing it");
    DatasetChange::Part part;
    if (known) {
      if (!known->methods().put) return refuse(409, "clients may not change it");
      if (known->graph_state->store()) return refuse(501, "its content is in a store of the host, which is not written together with other graphs");
      part.state = known->graph_state;
      part.shows = audience.sees(*known);
    } else {
      if (!takes_graphs()) return refuse(409, "it does not exist, and clients may not create graphs in this World");
      if (parts.registry.find(at) || !is_free(at, parts)) return refuse(409, "its path, or one above it, belongs to another resource");
      if (created_ + ++created > spec.options.max_created)
        return refuse(409, "the World has reached its maximum of " + std::to_string(spec.options.max_created) + " graphs of clients");
      part.state = GraphState::like(*spec.created, at);
      part.creates = part.shows = true;
    }
    part.write.kind = replaces ? GraphWrite::Kind::replace : GraphWrite::Kind::merge;
    part.write.graph = unplaced(graph, base);
    change.parts.push_back(std::move(part));
  }
  change.graphs = {};
  return std::nullopt;
}

std::optional<std::vector<WorldGraphResource*>> WorldResource::graphs_of(const DatasetChange& change, Parts& parts) {
  std::vector<WorldGraphResource*> all;
  const std::size_t before = graphs_.size();
  for (const DatasetChange::Part& part : change.parts) {
    WorldGraphResource* graph = graph_at(part.state->path());
    if (part.creates && !graph && created_ < spec.options.max_created && is_free(part.state->path(), parts)) {
      auto made = std::make_unique<WorldGraphResource>(*this, part.state, true);
      if (parts.registry.add(*made)) {
        graph = made.get();
        graphs_.push_back(std::move(made));
        ++created_;
      }
    }
    if (!graph || graph->graph_state != part.state) {
      remove_last(graphs_.size() - before, parts);
      return std::nullopt;
    }
    all.push_back(graph);
  }
  return all;
}

/// Graphs that nobody has seen.
void WorldResource::remove_last(std::size_t count, Parts& parts) {
  for (; count > 0; --count, --created_) {
    parts.registry.remove(*graphs_.back());
    graphs_.pop_back();
  }
}

Outcome WorldResource::commit(Context& context, Parts& parts, const std::shared_ptr<DatasetChange>& change) {
  if (const SharedCheck check = parts.rules.judge_before_call(context); !passes(check)) return parts.rules.refused(context, check->refusal());
  std::vector<GraphState::Prepared> all;
  for (const DatasetChange::Part& part : change->parts) all.push_back({part.state.get(), &part.prepared});
  const std::size_t before = graphs_.size();
  std::optional<std::vector<WorldGraphResource*>> graphs = graphs_of(*change, parts);
  if (!graphs) return parts.bodies.graphs_are_busy(context);
  std::shared_ptr<model::Saving> saving;
  if (std::optional<model::GraphRefusal> refused = GraphState::commit_all(std::move(all), &saving)) {
    remove_last(graphs_.size() - before, parts);
    if (refused->kind == model::GraphRefusal::Kind::unsaved) {
      http::Response response = parts.bodies.refused(context, {503, refused->message});
      parts.responses.add_retry_after(response);
      return response;
    }
    if (refused->kind == model::GraphRefusal::Kind::too_large) return parts.bodies.refused(context, {413, refused->message});
    if (change->times_prepared >= max_attempts) return parts.bodies.graphs_are_busy(context);
    auto prepared = parts.bodies.prepare_graphs(context, change);
    if (auto outcome = outcome_of(prepared)) return *std::move(outcome);
    return commit(context, parts, change);
  }
  for (std::size_t i = 0; i < graphs->size(); ++i) {
    if (change->parts[i].creates) (*graphs)[i]->attach(parts);
    else (*graphs)[i]->take_changes(parts);
  }
  if (graphs_.size() != before) {
    parts.registry.structure_changed();
    mark_changed([&](const Audience& audience) {
      return std::any_of(graphs_.begin() + static_cast<std::ptrdiff_t>(before), graphs_.end(),
                         [&](const auto& made) { return audience.sees(*made); });
    });
  }
  std::chrono::milliseconds time{0};
  for (const DatasetChange::Part& part : change->parts) time = std::max(time, part.state->options().save_timeout);
  return respond_when_saved(context, parts, saving, time, change->parts.size(), parts.responses.no_content(context));
}

Outcome WorldResource::make_graph(Context& context, Parts& parts, const std::string& at, std::optional<rdf::Graph> graph_of_body) {
  if (at.empty()) return parts.responses.problem(context, 409, "a graph of this World needs a name below \"" + path + "\"");
  if (const auto& view = context.audience.view; view && !view->at(at).has(security::Right::write))
    return parts.responses.denied(context, http::Denial::right, 403, "these credentials do not allow creating a graph at this path");
  if (context.judged)
    for (const auto& graph : graphs_)
      if (graph->path == at) return graph->take_new(context, parts);
  if (created_ >= spec.options.max_created)
    return parts.responses.problem(context, 409,
                                   "the World has reached its maximum of " + std::to_string(spec.options.max_created) + " graphs of clients");
  if (!context.judged) {
    auto made = parts.bodies.graph_task(context, GraphState::like(*spec.created, at));
    if (auto* response = std::get_if<http::Response>(&made)) return std::move(*response);
    std::get<GraphTask>(made).creates = true;
    if (graph_of_body) std::get<GraphTask>(made).set_graph(unplaced(*graph_of_body, parts.bases[context.base]));
    auto changed = parts.bodies.change_graph(context, std::move(std::get<GraphTask>(made)));
    if (auto outcome = outcome_of(changed)) return *std::move(outcome);
    context.judged = std::make_shared<JudgedBody>(std::move(std::get<Body>(changed)));
  }
  auto judged = parts.bodies.changed_graph(context);
  if (auto outcome = outcome_of(judged)) return *std::move(outcome);
  if (const SharedCheck check = parts.rules.judge_before_call(context); !passes(check)) return parts.rules.refused(context, check->refusal());
  auto graph = std::make_unique<WorldGraphResource>(*this, std::get<Body>(judged).made_graph, true);
  WorldGraphResource& added = *graph;
  graphs_.reserve(graphs_.size() + 1);
  if (!parts.registry.add(added))
    return parts.responses.problem(context, 409, "the path \"" + added.path + "\" was taken by another resource in the meantime");
  graphs_.push_back(std::move(graph));
  ++created_;
  added.attach(parts);
  parts.registry.structure_changed();
  mark_changed([&](const Audience& audience) { return audience.sees(added); });
  http::Response response = parts.responses.no_content(context, 201);
  response.fields.add("Location", parts.responses.iri(context, added.path));
  return response;
}

void WorldResource::remove_graph(WorldGraphResource& graph, Parts& parts) {
  const std::string at = graph.path;
  graph.removed(parts);
  parts.registry.remove(graph);
  const auto found = std::find_if(graphs_.begin(), graphs_.end(), [&](const auto& g) { return g.get() == &graph; });
  parts.discard(std::move(*found));
  graphs_.erase(found);
  --created_;
  parts.registry.structure_changed();
  mark_changed([&](const Audience& audience) { return !audience.view || audience.view->at(at).has(security::Right::read); });
}

void WorldResource::attach(Parts& parts) {
  for (const auto& graph : graphs_) graph->attach(parts);
}

void WorldResource::removed(Parts& parts) {
  for (const auto& graph : graphs_) graph->removed(parts);
}

std::vector<Resource*> WorldResource::more_resources() {
  std::vector<Resource*> all = members();
  all.push_back(&all_);
  if (takes_graphs()) all.push_back(&new_);
  return all;
}

std::optional<std::vector<std::string>> WorldResource::shapes_seen_by(const Audience& audience) const {
  std::vector<std::string> left = thing->spec->shapes;
  for (const auto& state : spec.graphs) {
    const Resource* const graph = graph_at(state->path());
    if (state->options().shapes.empty() || !graph || audience.sees(*graph)) continue;
    if (const auto of_it = std::find(left.begin(), left.end(), state->options().shapes); of_it != left.end()) left.erase(of_it);
  }
  if (left.size() == thing->spec->shapes.size()) return std::nullopt;
  return left;
}

std::vector<Resource*> WorldResource::members() const {
  std::vector<Resource*> all;
  for (const auto& graph : graphs_) all.push_back(graph.get());
  return all;
}

void WorldResource::describe_member(const Resource& member, About& about, const Description& d) const {
  static_cast<const WorldGraphResource&>(member).describe_as_member(about, d);
}

std::string WorldResource::named_path(std::string_view target, const Parts& parts) const {
  std::optional<std::string> named;
  if (const auto iri = http::query_parameter(target, "graph")) {
    named = parts.bases.path_of(*iri);
  } else if (const auto split = http::split_target(target)) {
    named = std::string(split->path);
    const std::string_view prefix = parts.bases.public_path();
    if (named->compare(0, path.size(), path) != 0 && named->compare(0, prefix.size(), prefix) == 0) named->erase(0, prefix.size());
  }
  return named ? path_below(*named) : std::string();
}

std::string WorldResource::path_below(const std::string& named) const {
  const Result<std::string> canonical = canonical_path(named);
  if (!canonical || canonical->compare(0, path.size(), path) != 0 || canonical->size() <= path.size() + 1 || (*canonical)[path.size()] != '/')
    return {};
  const std::string_view below = std::string_view(*canonical).substr(path.size() + 1);
  const auto names = static_cast<std::size_t>(std::count(below.begin(), below.end(), '/')) + 1;
  if (below.size() > max_name_bytes || names > max_names || below.back() == '/' || below.find("//") != std::string_view::npos) return {};
  return *canonical;
}

/// SPARQL 1.1 Graph Store HTTP Protocol 4.1, 4.2
Result<Resource*> WorldResource::find_graph(std::string_view target, const Context& context, const Parts& parts) {
  const std::size_t defaults = count_parameters(target, "default"), graphs = count_parameters(target, "graph");
  if (defaults + graphs == 0) return this;
  if (defaults + graphs > 1) return unexpected(Errc::expected_iri, "the query of the target: expected one graph=IRI or default, found several");
  if (defaults == 1) return &all_;
  const auto iri = http::query_parameter(target, "graph");
  if (!iri || !iri::is_absolute(*iri))
    return unexpected(Errc::expected_iri, "graph: expected an absolute IRI, percent-encoded, found \"" + iri.value_or(std::string()) + "\"");
  const std::string named = named_path(target, parts);
  Resource* const found = named.empty() ? nullptr : parts.registry.find(named);
  if (found && graph_at(named) == found) return found;
  const std::string_view method = context.request().method;
  const bool creates = takes_graphs() && (method == "PUT" || method == "POST");
  if (creates && named.empty())
    return unexpected(Errc::expected_iri, "graph: expected an IRI below <" + parts.bases[context.base] + path + "/>, found <" + *iri + ">");
  return creates && !found ? new_graph(named, context.audience, parts) : nullptr;
}

WorldGraphResource* WorldResource::graph_at(std::string_view at) const noexcept {
  const auto found = std::find_if(graphs_.begin(), graphs_.end(), [&](const auto& graph) { return graph->path == at; });
  return found == graphs_.end() ? nullptr : found->get();
}

/// A path below another resource than the World may be needed for what that has later, such as a value published in a graph.
bool WorldResource::is_free(std::string_view at, const Parts& parts) const {
  if (at.empty()) return false;
  for (std::size_t slash = at.rfind('/'); slash > path.size(); slash = at.rfind('/', slash - 1))
    if (parts.registry.find(at.substr(0, slash))) return false;
  return true;
}

Resource* WorldResource::new_graph(std::string_view at, const Audience& audience, const Parts& parts) {
  if (!takes_graphs() || !audience.may(security::Right::write, *this) || !audience.may_choose_name(at, path)) return nullptr;
  return is_free(at, parts) ? &new_ : nullptr;
}

void WorldResource::describe(const Description& d) const {
  ThingResource::describe(d);
  About about(d.graph, d.base + path);
  about.link(vocab::lrt_::allGraphs, d.base + all_.path);
  describe_container(about, *this, d);
}

/// Its JSON has the number of triples of each graph.
std::uint64_t WorldResource::state(std::uint64_t structure) const noexcept {
  std::uint64_t mixed = structure * 1099511628211U;  // or one step of both would cancel out
  for (const auto& graph : graphs_) mixed = (mixed ^ graph->stored()->size()) * 1099511628211U;
  return mixed;
}

void WorldResource::describe_types(About& about, const Description& d) const {
  ThingResource::describe_types(about, d);
  about.a(vocab::lrt_::World);
  describe_container_types(about);
}

void WorldResource::overview(Overview& o) const {
  ThingResource::overview(o);
  o.members("graphs", *this);
}

void WorldResource::link_related(http::LinkWriter& links, const std::string& base) const {
  ThingResource::link_related(links, base);
  links.add(base + all_.path, "related");
}

}  // namespace lrt::engine
