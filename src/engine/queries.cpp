// SPDX-License-Identifier: Apache-2.0
#include "src/engine/queries.hpp"

#include <algorithm>
#include <iterator>

#include <lrt/base/ids.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/rdf/type.hpp>

#include "src/base/ascii.hpp"
#include "src/base/charset.hpp"
#include "src/base/utf8.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/receivers/protocols.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/resources/world.hpp"
#include "src/http/etag.hpp"
#include "src/http/form.hpp"
#include "src/http/negotiate.hpp"
#include "src/http/target.hpp"

namespace lrt::engine {

namespace {

constexpr const char* update_refused = "expected a query, found an update; send INSERT DATA or DELETE DATA by PATCH to the URI of a graph of a World";
/// The interval at which a standing query with NOW() or RAND() is evaluated without changes.
constexpr std::chrono::seconds clock_interval{1};
/// RFC 6455 5.5.1
constexpr std::size_t max_close_reason = 123;
/// Share of one query in the order of jobs: all count the same.
constexpr std::size_t job_size = 1;

bool is_path(std::string_view path) {
  if (path.size() < 2 || path.front() != '/' || path.back() == '/' || path.find("//") != std::string_view::npos) return false;
  return std::all_of(path.begin(), path.end(), [](char c) { return c == '/' || detail::is(c, detail::unreserved); });
}

/// When a standing query is to be evaluated next; nullopt: not before something changes, or its evaluation is under way.
std::optional<Queries::Instant> due_of(const StandingQuery& query) {
  if (query.is_running) return std::nullopt;
  if (!query.waiters.empty()) return query.last_start;
  if (query.is_dirty) return query.last_start + query.interval;
  if (!query.query->dependencies().time) return std::nullopt;
  return query.last_start + std::max<std::chrono::milliseconds>(query.interval, clock_interval);
}

/// Two values of the type may have different predicates.
bool has_varying_predicates(const rdf::Type& type) {
  switch (type.kind) {
    case rdf::Type::Kind::optional:
    case rdf::Type::Kind::map:
    case rdf::Type::Kind::variant: return true;
    case rdf::Type::Kind::list: return type.shortest != type.longest || has_varying_predicates(*type.element);
    case rdf::Type::Kind::record:
      return std::any_of(type.fields.begin(), type.fields.end(), [](const rdf::FieldType& field) { return has_varying_predicates(*field.type); });
    default: return false;
  }
}

/// The graph of the resource may get predicates that it does not have, without a change of the structure.
bool has_varying_predicates(const Resource& resource) {
  const std::string_view kind = resource.kind().name;
  if (kind != "property") return kind == "action" || kind == "invocation" || kind == "member" || kind == "graph" || resource.container();
  const auto& property = static_cast<const PropertyResource&>(resource);
  const model::PropertySpec& spec = *property.spec;
  return property.value.is_null() || spec.octets || !spec.representations.empty() || has_varying_predicates(*spec.type);
}

/// No standing query is evaluated for it.
bool is_counter(const Resource& resource) {
  return resource.kind().name == "property" && static_cast<const PropertyResource&>(resource).spec->counter;
}

/// Only QueryService's constructor names this.
class Extension final : public QueryExtension {
 public:
  std::unique_ptr<Queries> make_queries(const QueryService& service, Parts& parts) const override {
    return std::make_unique<Queries>(parts.options, service, parts.clock, parts.registry, parts.calls, parts.pending, parts.responses,
                                     parts.representations, parts.values, parts.scanner, parts.subscribers, parts.subscriptions, [&parts] {
                                       return std::vector<Resource*>{&parts.root, &parts.terms, &parts.own_terms, &parts.dataset};
                                     });
  }
};
constexpr Extension for_queries;

}  // namespace

QueryService::QueryService() noexcept : extension_(for_queries) {}

/// The properties that a query needs and whose value may have to be read or taken over first, and what stores of the host have.
class ReadSet final : public ValueResource {
 public:
  explicit ReadSet(std::vector<PropertyResource*> properties, std::vector<HostContent*> contents = {})
      : ValueResource({}, nullptr), properties_(std::move(properties)), contents_(std::move(contents)) {}
  void describe(const Description&) const override {}
  void describe_types(About&, const Description&) const override {}
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"query"};
    return kind;
  }
  Reads reads() const noexcept override { return Reads::readable_values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override {
    for (PropertyResource* p : properties_) visit(*p);
  }
  void for_each_host_content(FunctionRef<void(HostContent&)> visit) const override {
    for (HostContent* content : contents_) visit(*content);
  }

 private:
  const std::vector<PropertyResource*> properties_;
  const std::vector<HostContent*> contents_;
};

/// Values of lambdas are read again above an age. Files are described without being read.
ReadSet Queries::read_set(const QueryDependencies& needs, const std::vector<std::uint32_t>& predicates, const Snapshot& snapshot) const {
  std::vector<PropertyResource*> properties;
  const Utc oldest = clock_.now().utc - service_.limits().max_age;
  if (!needs.everything && needs.predicates.empty()) return ReadSet(std::move(properties));
  const auto take = [&](PropertyResource& p) {
    const bool is_new = p.spec->slot ? !p.spec->slot->has_change() && !p.is_refreshing() : p.modified >= oldest;
    if (is_new) return;
    const Resource& graph = p.in_graph ? p.in_graph->graph : static_cast<const Resource&>(p);
    const auto known = snapshot.entries.find(static_cast<std::uint64_t>(graph.id));
    if (known == snapshot.entries.end() || may_count(needs, predicates, snapshot, known->second, graph)) properties.push_back(&p);
  };
  std::vector<HostContent*> contents;
  const auto take_content = [&](HostContent& content) {
    if (content.is_read_each_time()) contents.push_back(&content);
  };
  snapshots_.for_each_read(snapshot, take, take_content);
  return ReadSet(std::move(properties), std::move(contents));
}

Queries::Queries(const EngineOptions& options, const QueryService& service, const Clock& clock, Registry& registry, HostCalls& calls,
                 PendingRequests& pending, const Responses& responses, Representations& representations, PropertyValues& values,
                 ChangeScanner& scanner, const Subscribers& subscribers, Subscriptions& subscriptions, std::function<std::vector<Resource*>()> shared)
    : options_(options),
      clock_(clock),
      service_(service),
      registry_(registry),
      calls_(calls),
      pending_(pending),
      responses_(responses),
      representations_(representations),
      values_(values),
      scanner_(scanner),
      subscriptions_(subscriptions),
      snapshots_(service_, clock, registry, representations, subscribers, [this, shared = std::move(shared)] {
        std::vector<Resource*> all = shared();
        if (endpoint_) all.push_back(endpoint_.get());
        return all;
      }) {
  if (!is_path(service_.limits().path)) return;
  endpoint_ = std::make_unique<QueryResource>(service_);
  registry_.add(*endpoint_);
  registry_.add(*endpoint_->subscriptions());
}

Queries::~Queries() = default;

Result<void> Queries::check_options() const {
  const QueryService::Limits& limits = service_.limits();
  if (!is_path(limits.path)) return unexpected(Errc::invalid_option, "query: expected a path such as \"/sparql\", found \"" + limits.path + "\"");
  if (limits.threads == 0) return unexpected(Errc::invalid_option, "query.threads: expected at least 1");
  if (limits.time.count() <= 0)
    return unexpected(Errc::invalid_option, "query.time: expected more than 0 ms, found " + std::to_string(limits.time.count()));
  return {};
}

// ------------------------------------------------------------------------------------------------------------- requests

/// The query in the parameters of a form (SPARQL 1.1 Protocol 2.1).
std::variant<Queries::Asked, http::Response> Queries::asked_in(const Context& context, std::string_view form, bool is_body) const {
  const auto parameters = http::parse_form(form);
  if (!parameters)
    return responses_.problem(context, 400,
                              std::string(is_body ? "the body" : "the query of the target") + ": expected name=value pairs in percent-encoded UTF-8");
  Asked asked;
  for (const auto& [name, value] : *parameters) {
    if (name == "update") return responses_.problem(context, 403, update_refused);
    if (name == "query") {
      if (asked.text) return responses_.problem(context, 400, "query: expected one, found several");
      asked.text = value;
    } else if (name == "default-graph-uri" || name == "named-graph-uri") {
      if (!iri::is_absolute(value)) return responses_.problem(context, 400, name + ": expected an absolute IRI, found \"" + value + "\"");
      (name == "default-graph-uri" ? asked.default_graphs : asked.named_graphs).push_back(value);
    } else if (name == "changes") {
      if (value != "true" && value != "false") return responses_.problem(context, 400, "changes: expected true or false, found \"" + value + "\"");
      asked.changes = value == "true";
    }
  }
  return asked;
}

std::variant<std::shared_ptr<const PreparedQuery>, http::Response> Queries::parse(const Context& context, const Asked& asked) const {
  if (asked.text->size() > service_.limits().max_text_bytes)
    return responses_.problem(
        context, 413,
        "the query has " + std::to_string(asked.text->size()) + " bytes; " + std::to_string(service_.limits().max_text_bytes) + " are allowed");
  auto parsed = service_.parse(*asked.text, responses_.iri(context, endpoint_->path), asked.default_graphs, asked.named_graphs);
  if (parsed) return *std::move(parsed);
  const Error& error = parsed.error();
  const int status = error.code == Errc::limit_exceeded ? 413 : error.code == Errc::unsupported_syntax ? 403 : 400;
  return responses_.problem(context, status, "the query: " + error.message);
}

std::optional<Outcome> Queries::get(Context& context) {
  const auto target = http::split_target(context.request().target);
  auto asked = asked_in(context, target ? target->query : std::string_view(), false);
  if (auto* response = std::get_if<http::Response>(&asked)) return Outcome(std::move(*response));
  const Asked& query = std::get<Asked>(asked);
  return query.text ? std::optional(ask(context, query)) : std::nullopt;
}

Outcome Queries::post(Context& context) {
  const http::Request& request = context.request();
  const auto problem = [&](int status, std::string detail) { return Outcome(responses_.problem(context, status, std::move(detail))); };
  if (request.find("Content-Encoding").value_or("identity") != "identity") return problem(415, "Content-Encoding: expected identity");
  const Result<MediaType> type = MediaType::parse(request.find("Content-Type").value_or(std::string_view()));
  const std::string expected = std::string(query_form_type) + " or " + std::string(query_type);
  if (!type || request.count("Content-Type") > 1)
    return problem(415, "Content-Type: expected " + expected + ", found \"" + request.joined("Content-Type") + "\"");
  if (type->essence() == update_type) return problem(403, update_refused);
  const bool is_form = type->essence() == query_form_type;
  if (!is_form && type->essence() != query_type) return problem(415, "Content-Type: expected " + expected + ", found " + type->essence());
  if (const std::string_view charset = type->parameter("charset"); !charset.empty() && !http::iequals(charset, "utf-8"))
    return problem(415, "charset: expected utf-8, found " + std::string(charset));
  if (const auto at = utf8::find_invalid(request.body)) return problem(400, "the body: byte " + std::to_string(*at) + " is not UTF-8");
  const auto target = http::split_target(request.target);
  const std::string_view in_target = target ? target->query : std::string_view();
  auto read = asked_in(context, is_form ? utf8::without_mark(request.body) : in_target, is_form);
  if (auto* response = std::get_if<http::Response>(&read)) return std::move(*response);
  Asked& asked = std::get<Asked>(read);
  if (!is_form) {  // the parameters of the target have the dataset, the body has the query
    if (asked.text) return problem(400, "query: expected it in the body only, found it in the target, too");
    asked.text = std::string(request.body);
  }
  return asked.text ? ask(context, asked) : problem(400, "the parameter query is missing");
}

http::Response Queries::too_many(const Context& context, const char* what) const {
  http::Response response = responses_.problem(context, 503, what);
  responses_.add_retry_after(response);
  return response;
}

http::Response Queries::too_many_of_client(const Context& context, http::Denial denial, const std::string& what) const {
  http::Response response = responses_.denied(context, denial, 429, "this client has " + what + ", which is the maximum per client");
  responses_.add_retry_after(response);
  return response;
}

std::size_t Queries::running_of(const std::string& client) const {
  const auto found = running_of_.find(client);
  return found == running_of_.end() ? 0 : found->second;
}

/// A client without a query gets a place as long as fewer clients than max_queries have one, however many those have.
bool Queries::is_full_for(const std::string& client) const {
  const std::size_t max = service_.limits().max_queries;
  return running_ >= max && (running_of(client) > 0 || running_of_.size() >= max);
}

http::Response Queries::refused(http::Response response) {
  ++refused_;
  return response;
}

void Queries::count(EngineCounts& all) const {
  all.queries = begun_;
  all.failed_queries = failed_;
  all.refused_queries = refused_;
  all.running_queries = running_;
  all.standing_queries = standing_.size();
  all.query_seconds = std::chrono::duration<double>(time_used_).count();
}

void Queries::count_up(Evaluation& evaluation) {
  ++begun_;
  ++running_of_[evaluation.client];
  ++running_;
  evaluation.is_counted = true;
}

void Queries::count_down(Evaluation& evaluation) noexcept {
  if (!std::exchange(evaluation.is_counted, false)) return;
  --running_;
  const auto found = running_of_.find(evaluation.client);
  if (--found->second == 0) running_of_.erase(found);
}

/// Until the result is complete: the properties are read, the query waits in the queue, and it is evaluated.
std::optional<Ticket> Queries::defer(const Context& context) {
  return pending_.defer(context, options_.host_timeout + 2 * service_.limits().time, [this](Ticket late, Context& c, bool) {
    pending_.respond(late, too_many(c, "the query could not be evaluated in time, because other queries are running; try again later"));
  });
}

http::Response Queries::failed(const Context& context, const Error& error) const {
  if (error.code == Errc::cancelled) return responses_.problem(context, 503, "the query was cancelled, because its client closed the connection");
  if (error.code == Errc::timed_out || error.code == Errc::limit_exceeded) return responses_.problem(context, 503, error.message);
  responses_.log(LogLevel::error, "internal error in a query: " + error.message);
  return responses_.problem(context, 500, "internal error while evaluating the query");
}

Outcome Queries::ask(Context& context, const Asked& asked) {
  auto parsed = parse(context, asked);
  if (auto* response = std::get_if<http::Response>(&parsed)) return std::move(*response);
  const auto query = std::get<std::shared_ptr<const PreparedQuery>>(std::move(parsed));
  const auto type = http::negotiate(context.accept(), query->types());
  if (!type) {
    std::string list;
    for (const std::string_view offer : query->types()) list += (list.empty() ? "" : ", ") + std::string(offer);
    return responses_.problem(context, 406, "none of the media types in Accept is available for this result; available are " + list);
  }
  const QueryService::Limits& limits = service_.limits();
  const std::string client = context.share_key();
  if (is_full_for(client)) return refused(too_many(context, "the maximum number of queries is running; try again later"));
  if (const std::size_t max = limits.max_queries_per_client; max != 0 && !context.client.empty() && running_of(client) >= max)
    return refused(too_many_of_client(context, http::Denial::rate, std::to_string(max) + " queries under way"));
  const auto ticket = defer(context);
  if (!ticket) return refused(responses_.overloaded(context));
  auto evaluation = std::make_shared<Evaluation>();
  evaluation->query = query;
  evaluation->needs = snapshots_.needs_of(query->dependencies(), context.base, false);
  evaluation->snapshot = snapshots_.of(context.base, context.audience, evaluation->needs);
  evaluation->client = client;
  const auto text = std::make_shared<Result<std::string>>(std::string());
  evaluation->write = [text, type = *type](const std::shared_ptr<const QueryAnswer>& answer) {
    *text = guarded<std::string>([&] { return answer->write(type); });
  };
  evaluation->done = [this, ticket = *ticket, query, type = *type, text, &self = *evaluation, begun = context.now.steady](
                         const Result<std::shared_ptr<const QueryAnswer>>& answer, TimePoint now) {
    count_down(self);
    time_used_ += now.steady - begun;
    Context* waiting = pending_.resume(ticket, now);
    if (!waiting || !answer) ++failed_;
    if (!waiting) return;
    pending_.respond(ticket, answer ? response_to(*waiting, *query, type, std::move(*text)) : failed(*waiting, answer.error()));
  };
  pending_.tell_end(*ticket, evaluation->cancelled);
  count_up(*evaluation);
  try {
    ReadSet read_first = read_set(query->dependencies(), Snapshots::hashes_of(query->dependencies().predicates), *evaluation->snapshot);
    if (values_.ready(read_first, Variant(rdf::Plain::json), false)) {
      start(evaluation);
    } else {
      values_.refresh(read_first, {}, [this, evaluation](const Result<void>& read, TimePoint now) {
        if (read) return start(evaluation);
        evaluation->done(Unexpected{read.error()}, now);
      });
    }
  } catch (...) {
    count_down(*evaluation);
    ++failed_;
    throw;
  }
  return Deferred{*ticket};
}

http::Response Queries::response_to(Context& context, const PreparedQuery& query, std::size_t type, Result<std::string> text) const {
  if (!text) return responses_.problem(context, 406, text.error().message);
  http::Response response;
  const std::string tag = http::entity_tag(query.types()[type], *text);
  response.fields.add("ETag", tag);
  response.fields.add("Vary", context.resource ? vary_of(*context.resource, context.audience) : std::string_view("Accept"));
  response.fields.add("Cache-Control", context.audience.is_restricted() ? "private, no-cache" : "no-cache");
  responses_.add_types(response.fields, context.resource);
  const auto known = context.request().method == "POST" ? std::nullopt : context.request().find("If-None-Match");
  if (known && http::matches(context.request().joined("If-None-Match"), tag, true) == http::Match::yes) {
    response.status = 304;
    return response;
  }
  response.fields.add("Content-Type",
                      query.types()[type] == "text/csv" ? "text/csv; charset=utf-8" : charset::content_type(query.types()[type], *text));
  response.set_body(*std::move(text));
  return response;
}

// ----------------------------------------------------------------------------------------------------------- evaluation

/// Whatever happens, done() is called once.
void Queries::start(const std::shared_ptr<Evaluation>& evaluation) noexcept {
  try {
    return snapshot_for(evaluation);
  } catch (...) {}
  try {
    evaluation->done(unexpected(Errc::failed, "out of memory"), clock_.now());
  } catch (...) {}  // its request gets 503 at its time limit
}

/// Updates the graphs, in several turns of the engine if there are many, and then queues the job.
void Queries::snapshot_for(std::shared_ptr<Evaluation> evaluation) {
  if (*evaluation->cancelled || snapshots_.update(*evaluation->snapshot, evaluation->needs)) return begin(std::move(evaluation));
  calls_.inbox()->put([this, evaluation = std::move(evaluation)](TimePoint) { start(evaluation); });
}

void Queries::begin(std::shared_ptr<Evaluation> evaluation) {
  if (evaluation->graphs_are_current) evaluation->graphs_are_current();
  // The memory for the result is allocated before the job starts.
  struct Running {
    std::shared_ptr<Evaluation> evaluation;
    Result<std::shared_ptr<const QueryAnswer>> answer = unexpected(Errc::cancelled, "the query was cancelled");
    bool is_handed_out = false;
  };
  auto running = std::make_shared<Running>();
  running->evaluation = std::move(evaluation);
  cancels_.erase(std::remove_if(cancels_.begin(), cancels_.end(), [](const auto& one) { return one.expired(); }), cancels_.end());
  cancels_.push_back(running->evaluation->cancelled);
  Inbox::Reserved reply = Inbox::reserve([running](TimePoint now) {
    if (running->is_handed_out) running->evaluation->done(std::move(running->answer), now);
  });
  jobs_.push_back({running->evaluation->client, job_size,
                   [service = &service_, now = clock_.now(), running, reply = Owed(calls_.inbox(), std::move(reply))]() mutable {
                     Evaluation& e = *running->evaluation;
                     if (!*e.cancelled)
                       running->answer = guarded<std::shared_ptr<const QueryAnswer>>([&] {
                         Result<std::shared_ptr<const QueryAnswer>> answer =
                             service->evaluate(*e.query, *e.snapshot->data, *e.cancelled, now, e.max_rows);
                         if (answer) e.write(*answer);
                         return answer;
                       });
                     reply.leave();
                   }});
  running->is_handed_out = true;
}

void Queries::stop() {
  for (const auto& one : cancels_)
    if (const auto cancelled = one.lock()) *cancelled = true;
}

// ----------------------------------------------------------------------------------------------------- standing queries

StandingQuery* Queries::find(ResourceId id) const {
  const auto found = std::find_if(standing_.begin(), standing_.end(), [id](const auto& one) { return one->id == id; });
  return found == standing_.end() ? nullptr : found->get();
}

Outcome Queries::subscribe(Context& context, Protocol protocol) {
  const auto target = http::split_target(context.request().target);
  auto read = asked_in(context, target ? target->query : std::string_view(), false);
  if (auto* response = std::get_if<http::Response>(&read)) return std::move(*response);
  const Asked& asked = std::get<Asked>(read);
  if (!asked.text)
    return responses_.problem(context, 400, "the parameter query is missing: a subscription to this resource observes the result of a query");
  auto found = standing_for(context, asked);
  if (auto* response = std::get_if<http::Response>(&found)) return std::move(*response);
  StandingQuery& query = *std::get<StandingQuery*>(found);
  // As Subscriptions selects it. If there is none, it responds.
  const Opening& opening = opening_of(protocol);
  const std::optional<std::string> accept = opening.accept(context);
  const auto type = http::negotiate(accept ? std::optional<std::string_view>(*accept) : std::nullopt, query.query->types());
  const bool is_written = query.latest.answer && (!type || query.latest.documents.count(*type) != 0);
  if (is_written || !type || opening.must_open_now(context)) {
    context.resource = &query;
    context.resource_id = query.id;
    Outcome outcome = subscriptions_.subscribe(context, protocol);
    unobserved(query);  // if no subscription was created
    return outcome;
  }
  const auto ticket = defer(context);
  if (!ticket) {
    unobserved(query);
    return responses_.overloaded(context);
  }
  query.waiters.push_back({*ticket, protocol, *type, std::make_shared<std::atomic<bool>>(false), context.share_key()});
  pending_.tell_end(*ticket, query.waiters.back().ended);
  query.is_dirty = true;  // a result in this media type is needed
  advance(context.now);
  return Deferred{*ticket};
}

/// The standing query that a request is for. Equal requests of clients with the same rights share one.
std::variant<StandingQuery*, http::Response> Queries::standing_for(Context& context, const Asked& asked) {
  auto parsed = parse(context, asked);
  if (auto* response = std::get_if<http::Response>(&parsed)) return std::move(*response);
  const auto prepared = std::get<std::shared_ptr<const PreparedQuery>>(std::move(parsed));
  if (asked.changes && !prepared->has_rows())
    return responses_.problem(context, 400, "changes: expected a SELECT query, whose added and removed rows are sent");
  const auto wished = http::query_parameter(context.request().target, "minimumInterval");
  const auto interval =
      std::max(service_.limits().min_interval, wished ? interval_of(*wished).value_or(std::chrono::milliseconds(0)) : std::chrono::milliseconds(0));
  const Snapshots::Needs needs = snapshots_.needs_of(prepared->dependencies(), context.base, true);
  std::shared_ptr<Snapshot> snapshot = snapshots_.of(context.base, context.audience, needs);
  std::string key;
  if (!asked.changes) {
    key = *asked.text;
    for (const auto& graph : asked.default_graphs) key += "\n<" + graph;
    for (const auto& graph : asked.named_graphs) key += "\n>" + graph;
    key += '\n' + std::to_string(interval.count());
    for (const auto& one : standing_)
      if (one->key == key && Snapshots::suits(*one->snapshot, context.base, context.audience, needs)) return one.get();
  }
  if (standing_.size() >= service_.limits().max_standing) return refused(too_many(context, "the maximum number of standing queries is reached"));
  if (const std::size_t max = service_.limits().max_standing_per_client; max != 0 && !context.client.empty()) {
    const auto is_of_client = [&](const auto& one) { return one->client == context.client; };
    if (static_cast<std::size_t>(std::count_if(standing_.begin(), standing_.end(), is_of_client)) >= max)
      return refused(too_many_of_client(context, http::Denial::subscriptions, std::to_string(max) + " standing queries"));
  }
  // A number would count those that the client may not see.
  const std::string name = context.audience.is_restricted() ? options_.ids->next() : std::to_string(next_standing_++);
  auto made = std::make_unique<StandingQuery>(endpoint_->path + "/standing-" + name, *endpoint_, *this, prepared, std::move(snapshot), needs);
  StandingQuery& query = *made;
  if (standing_.empty()) seen_structure_ = registry_.structure();
  query.key = std::move(key);
  query.tells_changes = asked.changes;
  query.interval = interval;
  query.client = context.client;
  query.last_start = context.now.steady - interval;  // it is due now, after those that are due already
  registry_.add(query);
  standing_.push_back(std::move(made));
  return &query;
}

/// Of the clients that share a standing query the one with the fewest evaluations under way: one that keeps the threads busy does not delay the others.
std::string_view Queries::payer_of(const StandingQuery& query) const {
  std::optional<std::string_view> payer;
  std::ptrdiff_t fewest = 0;
  const auto consider = [&](std::string_view client) {
    if (payer && (fewest == 0 || *payer == client)) return;
    const auto count = std::count_if(standing_.begin(), standing_.end(), [&](const auto& one) { return one->cancelled && one->payer == client; });
    if (!payer || count < fewest) payer = client, fewest = count;
  };
  for (const StandingQuery::Waiter& waiter : query.waiters) consider(waiter.client);
  for (std::size_t i = 0; i < query.observers.size(); ++i) consider(static_cast<const SubscriptionResource&>(*query.observers[i]).share.client());
  return payer.value_or(query.client);
}

/// One for each thread and client: those that are due wait here, and not before the queries of clients.
bool Queries::may_start(const StandingQuery& query) const {
  const std::string_view payer = payer_of(query);
  const auto count = std::count_if(standing_.begin(), standing_.end(), [&](const auto& one) { return one->cancelled && one->payer == payer; });
  return static_cast<std::size_t>(count) < service_.limits().threads;
}

void Queries::evaluate(StandingQuery& query, TimePoint now) {
  ReadSet read_first = read_set(query.query->dependencies(), query.predicates, *query.snapshot);
  // Later, pulled properties are read by their sample period.
  if (!values_.ready(read_first, Variant(rdf::Plain::json), false) && !query.latest.answer && !query.has_read) {
    query.is_running = true;
    try {
      return values_.refresh(read_first, {}, [this, id = query.id](const Result<void>&, TimePoint) {
        if (StandingQuery* const waiting = find(id)) waiting->is_running = false, waiting->has_read = true;
      });
    } catch (...) {
      query.is_running = false;
      throw;
    }
  }
  auto evaluation = std::make_shared<Evaluation>();
  evaluation->client = payer_of(query);
  evaluation->query = query.query;
  evaluation->needs = query.needs;
  evaluation->snapshot = query.snapshot;
  evaluation->max_rows = service_.limits().max_standing_rows;
  // The documents of its subscribers are written by the job: a result may be large.
  struct Written {
    std::shared_ptr<const QueryAnswer> before;
    bool tells_changes;
    std::uint64_t sequence;
    std::vector<std::size_t> types, new_types;  ///< if the result has changed; if it has not
    StandingQuery::Answer answer{};
  };
  const auto written = std::make_shared<Written>();
  evaluation->graphs_are_current = [this, id = query.id, written] {
    StandingQuery* const standing = find(id);
    if (!standing) return;
    watch(*standing);
    written->before = standing->latest.answer;
    written->tells_changes = standing->tells_changes;
    written->sequence = standing->sequence + 1;
    written->types = standing->wanted_types();
    for (const std::size_t type : written->types)
      if (standing->latest.documents.count(type) == 0) written->new_types.push_back(type);
  };
  evaluation->write = [written, prepared = query.query](const std::shared_ptr<const QueryAnswer>& answer) {
    const bool has_changed = !written->before || answer->digest() != written->before->digest();
    written->answer.answer = has_changed ? answer : written->before;
    if (!has_changed && written->tells_changes) return;
    const QueryAnswer* const before = written->tells_changes ? written->before.get() : nullptr;
    for (const std::size_t type : has_changed ? written->types : written->new_types)
      written->answer.documents.emplace(type, StandingQuery::write(*prepared, *written->answer.answer, before, written->sequence, type));
  };
  evaluation->done = [this, id = query.id, written](const Result<std::shared_ptr<const QueryAnswer>>& answer, TimePoint at) {
    if (answer) evaluated(id, std::move(written->answer), at);
    else evaluated(id, Unexpected{answer.error()}, at);
  };
  query.payer = evaluation->client;
  query.cancelled = evaluation->cancelled;
  query.is_running = true;
  query.is_dirty = false;
  query.last_start = now.steady;
  start(evaluation);
}

void Queries::evaluated(ResourceId id, Result<StandingQuery::Answer> answer, TimePoint now) {
  StandingQuery* const query = find(id);
  if (!query) return;
  query->is_running = false;
  query->cancelled.reset();
  if (!answer) {
    if (answer.error().code == Errc::cancelled) {
      query->is_dirty = true;
      return;
    }
    responses_.log(LogLevel::warning, query->path + " ends: " + answer.error().message);
    for (const StandingQuery::Waiter& waiter : std::exchange(query->waiters, {}))
      if (Context* waiting = pending_.resume(waiter.ticket, now)) pending_.respond(waiter.ticket, failed(*waiting, answer.error()));
    subscriptions_.end_all_of(*query, 1011, answer.error().message.substr(0, max_close_reason));
    return unobserved(*query);
  }
  if (answer->answer != query->latest.answer) {
    for (std::size_t i = 0; i < query->observers.size(); ++i) query->observers[i]->resource_changes(seen_by_all);
    query->previous = std::exchange(query->latest, *std::move(answer)).answer;
    ++query->sequence;
    query->mark_changed();
  } else {
    query->latest.documents.merge(answer->documents);
  }
  serve_waiters(*query, now);
}

/// Creates the subscriptions of requests that waited for a result. Those that arrived during its evaluation may need another media type.
void Queries::serve_waiters(StandingQuery& query, TimePoint now) {
  for (StandingQuery::Waiter& waiter : std::exchange(query.waiters, {})) {
    if (query.latest.documents.count(waiter.type) == 0 && !(query.tells_changes && query.previous)) {
      query.waiters.push_back(std::move(waiter));
      continue;
    }
    Context* const waiting = pending_.resume(waiter.ticket, now);
    if (!waiting) continue;
    Context context = *waiting;
    context.resource = &query;
    context.resource_id = query.id;
    pending_.respond(waiter.ticket, subscriptions_.subscribe(context, waiter.protocol));
  }
  unobserved(query);
}

/// Requests whose client has gone wait no longer. A query that only they needed ends.
void Queries::drop_ended_waiters(TimePoint now) {
  const auto has_ended = [](const StandingQuery::Waiter& waiter) { return waiter.ended->load(); };
  std::vector<StandingQuery*> unused;
  for (const auto& query : standing_) {
    auto& waiters = query->waiters;
    const auto ended = std::stable_partition(waiters.begin(), waiters.end(), [&](const auto& waiter) { return !has_ended(waiter); });
    if (ended == waiters.end()) continue;
    const std::vector<StandingQuery::Waiter> left(std::make_move_iterator(ended), std::make_move_iterator(waiters.end()));
    waiters.erase(ended, waiters.end());
    for (const StandingQuery::Waiter& waiter : left)
      if (const Context* waiting = pending_.resume(waiter.ticket, now))
        pending_.respond(waiter.ticket, failed(*waiting, {Errc::cancelled, "the client has closed the connection"}));
    if (waiters.empty() && query->observers.empty()) unused.push_back(query.get());
  }
  for (StandingQuery* query : unused) remove(*query);
}

/// Observes the resources that have become relevant since the last call.
void Queries::watch(StandingQuery& query) {
  const Snapshot& snapshot = *query.snapshot;
  if (query.seen_version == snapshot.version) return;
  for (const auto& [id, entry] : snapshot.entries) {
    if (entry.described <= query.seen_version || query.watches.count(id) != 0) continue;
    Resource* const resource = registry_.find(ResourceId{id});
    if (!resource || is_counter(*resource)) continue;
    if (const std::string_view kind = resource->kind().name; kind == "subscription" || kind == "subscriptions") {
      if (kind == "subscription" || !query.needs.subscriptions) continue;  // a container changes when a subscription begins or ends
    } else if (!may_count(query.query->dependencies(), query.predicates, snapshot, entry, *resource)) {
      continue;
    }
    auto made = std::make_unique<StandingQuery::Watch>(query, *resource);
    resource->add_observer(*made, scanner_);
    query.watches.emplace(id, std::move(made));
  }
  query.seen_version = snapshot.version;
}

/// Whether a resource may have triples with the predicates of a query, now or later.
bool Queries::may_count(const QueryDependencies& needs, const std::vector<std::uint32_t>& predicates, const Snapshot& snapshot,
                        const Snapshot::Entry& entry, const Resource& resource) const {
  if (!needs.graphs.empty() && !resource.container() && resource.kind().name != "action") {
    const std::string name = representations_.base(snapshot.base) + resource.path;
    if (std::find(needs.graphs.begin(), needs.graphs.end(), name) == needs.graphs.end()) return false;
  }
  if (needs.everything) return true;
  if (needs.predicates.empty()) return false;
  if (entry.is_empty || has_varying_predicates(resource)) return true;
  return std::any_of(entry.predicates.begin(), entry.predicates.end(),
                     [&](std::uint32_t predicate) { return std::find(predicates.begin(), predicates.end(), predicate) != predicates.end(); });
}

/// What a reader with limited rights sees of a graph may depend on any of its triples.
bool Queries::is_change_for(const StandingQuery& query, const Resource& resource) const {
  if (const GraphStore* const store = resource.graph_store(); store && store->only_sizes_change) return false;
  const OwnRepresentation* const own = resource.own_representation();
  return !own || query.snapshot->audience.is_restricted() ||
         own->is_change_for(query.query->dependencies(), representations_.base(query.snapshot->base));
}

void Queries::unwatch(StandingQuery& query, StandingQuery::Watch& watch) {
  const std::uint64_t id = static_cast<std::uint64_t>(watch.resource.id);
  watch.resource.remove_observer(watch, scanner_);
  query.is_dirty = true;
  query.watches.erase(id);  // the watch was removed
}

/// It is removed in the next step, which next_deadline() requests. Needs no memory: a client that leaves must not fail.
void Queries::unobserved(StandingQuery& query) noexcept { query.may_be_unused = true; }

void Queries::remove_unused() {
  for (auto at = standing_.begin(); at != standing_.end();) {
    StandingQuery& query = **at++;
    if (std::exchange(query.may_be_unused, false) && query.observers.empty() && query.waiters.empty()) remove(query);
  }
}

void Queries::remove(StandingQuery& query) {
  if (query.cancelled) *query.cancelled = true;
  for (const auto& [id, watch] : query.watches) watch->resource.remove_observer(*watch, scanner_);
  query.watches.clear();
  registry_.remove(query);
  standing_.remove_if([&](const auto& one) { return one.get() == &query; });
}

void Queries::advance(TimePoint now) {
  for (auto& unused : snapshots_.take_unused(now)) jobs_.push_back({{}, job_size, [snapshot = std::move(unused)] {}});  // is destroyed there
  remove_unused();
  if (standing_.empty()) return;
  drop_ended_waiters(now);
  const bool has_new_structure = std::exchange(seen_structure_, registry_.structure()) != registry_.structure();
  if (has_new_structure)
    for (const auto& query : standing_) query->is_dirty = true;
  while (true) {
    StandingQuery* first = nullptr;
    std::optional<Instant> first_due;
    for (const auto& query : standing_)
      if (const auto due = due_of(*query); due && now.steady >= *due && (!first_due || *due < *first_due) && may_start(*query))
        first = query.get(), first_due = due;
    if (!first) return;
    evaluate(*first, now);
  }
}

std::optional<Queries::Instant> Queries::next_deadline() const {
  std::optional<Instant> first = snapshots_.next_deadline();
  for (const auto& query : standing_) {
    if (query->may_be_unused) return Instant{};
    if (std::any_of(query->waiters.begin(), query->waiters.end(), [](const auto& waiter) { return waiter.ended->load(); })) return Instant{};
    if (const auto due = due_of(*query); due && (!first || *due < *first) && may_start(*query)) first = due;
  }
  return first;
}

}  // namespace lrt::engine
