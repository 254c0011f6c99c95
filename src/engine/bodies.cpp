// SPDX-License-Identifier: Apache-2.0
#include "src/engine/bodies.hpp"

#include <algorithm>
#include <utility>

#include <lrt/base/media_type.hpp>
#include <lrt/http/message.hpp>

#include "src/base/charset.hpp"
#include "src/engine/command_rules.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/blueprint.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/value_patch.hpp"
#include "src/http/link.hpp"

namespace lrt::engine {

namespace {

/// Bodies of the requested resource may be the octets of a matrix.
bool takes_octets(const Context& context, const rdf::Type* value) {
  return value && context.resource->variants().type_of(Variant(rdf::Plain::octets)) != std::string_view() && rdf::reads_octets(*value);
}

std::string accepted_types(const Context& context, const rdf::Type* value) {
  if (context.request().method == "PATCH") return std::string(context.resource->patch_types());
  return readable_types(value != nullptr) + (takes_octets(context, value) ? ", " + std::string(rdf::media_type(rdf::Plain::octets)) : "");
}

/// A graph of more triples is changed by a BodyJob, whatever the size of the body.
constexpr std::size_t small_graph = 500;
/// A change copies the whole graph. A triple of it takes about as long as that many bytes of a body.
constexpr std::size_t work_of_triple = 8;

bool is_text(std::optional<rdf::Plain> format) noexcept { return format != rdf::Plain::cbor && format != rdf::Plain::octets; }

}  // namespace

std::optional<Outcome> outcome_of(Bodies::Read& read) {
  if (auto* response = std::get_if<http::Response>(&read)) return std::move(*response);
  if (const auto* deferred = std::get_if<Deferred>(&read)) return *deferred;
  return std::nullopt;
}

Bodies::Bodies(const EngineOptions& options, const EngineView& view, const Responses& responses, HostCalls& calls, PendingRequests& pending,
               std::string context_document)
    : options_(options),
      view_(view),
      responses_(responses),
      calls_(calls),
      pending_(pending),
      context_document_(std::move(context_document)),
      limits_(std::make_shared<const BodyLimits>(
          BodyLimits{options.max_body_triples, options.max_body_text_bytes, options.max_list_members, options.prefixes, options.contexts})) {}

Bodies::Read Bodies::read_value(Context& context, const rdf::Type& type, const rdf::Facets& facets, std::shared_ptr<const void> owner) {
  if (context.judged) return verdict(context);
  // An empty body is no value, whatever its header fields say of it.
  if (type.kind == rdf::Type::Kind::optional && context.request().body.empty()) return Body{};
  auto made = task_for(context, &type, facets);
  if (auto* response = std::get_if<http::Response>(&made)) return std::move(*response);
  BodyTask& task = std::get<BodyTask>(made);
  task.owner = std::move(owner);
  if (auto response = set_shapes(context, task)) return *std::move(response);
  task.completes = !has_user_shape(*context.resource->thing, context.resource->input_shape());
  return judge(context, std::move(task));
}

Bodies::Read Bodies::read_patch(Context& context, const model::PropertySpec& property, std::shared_ptr<const void> owner) {
  if (context.judged) return verdict(context);
  auto made = task_for(context, property.type, property.facets);
  if (auto* response = std::get_if<http::Response>(&made)) return std::move(*response);
  BodyTask& task = std::get<BodyTask>(made);
  task.owner = std::move(owner);
  if (auto response = set_shapes(context, task)) return *std::move(response);
  task.completes = !has_user_shape(*context.resource->thing, context.resource->input_shape());
  const std::size_t bytes = task.text.size();
  const auto read = [&extension = PatchExtension::of(property)](BodyTask read_task) -> JudgedBody {
    auto patch = extension.read(std::move(read_task));
    if (auto* fault = std::get_if<BodyFault>(&patch)) return std::move(*fault);
    Body body;
    body.patch = std::get<0>(std::move(patch));
    return body;
  };
  if (!options_.body_jobs || bytes <= options_.small_body_bytes) return as_read(context, read(std::move(task)));
  auto text = own_text(context, task.text);
  return defer(
      context, bytes, bytes, [task = std::move(task), text = std::move(text), read] { return read(task); }, false);
}

http::Response Bodies::refused(const Context& context, BodyFault fault) const {
  auto read = as_read(context, JudgedBody(std::move(fault)));
  return std::move(std::get<http::Response>(read));
}

Bodies::Read Bodies::read_graph(Context& context, const FocusRule& focus) {
  if (context.judged) return verdict(context);
  auto made = task_for(context, nullptr, {});
  if (auto* response = std::get_if<http::Response>(&made)) return std::move(*response);
  BodyTask& task = std::get<BodyTask>(made);
  task.focus = &focus;
  if (auto response = set_shapes(context, task)) return *std::move(response);
  return judge(context, std::move(task));
}

Bodies::Read Bodies::read_nothing(Context& context) {
  if (context.judged) return verdict(context);
  if (context.request().body.empty()) return Body{};
  auto made = task_for(context, &no_input(), {});
  if (auto* response = std::get_if<http::Response>(&made)) return std::move(*response);
  return judge(context, std::move(std::get<BodyTask>(made)));
}

std::optional<http::Response> Bodies::set_shapes(const Context& context, BodyTask& task) const {
  ThingNode& thing = *context.resource->thing;
  const Result<shacl::Shapes> shapes = compiled_shapes(thing, context.base, view_);
  if (!shapes) return responses_.problem(context, 500, "the blueprint: " + shapes.error().message);
  task.shapes = *shapes;
  task.shape = thing.shape_iri(view_.bases[context.base], context.resource->input_shape());
  return std::nullopt;
}

http::Response Bodies::not_accepted(const Context& context, const rdf::Type* value, const std::string& detail) const {
  const std::string types = accepted_types(context, value);
  http::Response response = responses_.problem(context, 415, "Content-Type: " + detail);
  if (context.request().method == "PATCH") {
    response.fields.set("Accept-Patch", types);  // RFC 5789 2.2
    return response;
  }
  response.fields.set("Accept", types);  // RFC 9110 15.5.16
  if (context.request().method == "POST") response.fields.set("Accept-Post", types);
  return response;
}

std::variant<Bodies::Format, http::Response> Bodies::format_of(const Context& context, const rdf::Type* value, bool is_empty) const {
  const http::Request& request = context.request();
  if (const auto coding = request.find("Content-Encoding"); coding && !http::iequals(*coding, "identity")) {
    http::Response response = responses_.problem(context, 415, "Content-Encoding: expected identity, found \"" + std::string(*coding) + "\"");
    response.fields.set("Accept-Encoding", "identity");
    return response;
  }
  if (request.find("Content-Range")) return responses_.problem(context, 400, "Content-Range: partial updates are not supported (RFC 9110 14.5)");

  const auto content_type = request.find("Content-Type");
  if (!content_type && is_empty) return Format{};
  const auto unsupported = [&](const std::string& found) {
    return not_accepted(context, value, "expected one of " + accepted_types(context, value) + ", found " + found);
  };
  if (!content_type) return unsupported("none");
  const Result<MediaType> type = MediaType::parse(*content_type);
  if (!type || request.count("Content-Type") > 1) return unsupported("\"" + request.joined("Content-Type") + "\"");
  const bool is_patch = request.method == "PATCH";
  const bool merges = is_patch && value && type->essence() == merge_patch_type && context.resource->patch_types() != update_type;
  if (is_patch && !merges && type->essence() != update_type) {
    const bool is_json = value && type->essence() == rdf::media_type(rdf::Plain::json);
    return unsupported(type->essence() + (is_json ? "; the members to change are application/merge-patch+json" : ""));
  }
  Format format{is_patch ? std::nullopt : rdf::syntax_of(type->essence()), std::nullopt, {}};
  if (merges) format.plain = rdf::Plain::json;
  else if (value && !is_patch && !format.syntax) format.plain = rdf::plain_of(*type);
  if (!is_patch && !format.syntax && (!format.plain || (*format.plain == rdf::Plain::octets && !takes_octets(context, value)))) {
    const bool is_form = value && type->essence() == "application/x-www-form-urlencoded";
    return unsupported(type->essence() + (is_form ? ", which curl -d sends; add -H 'Content-Type: application/json'" : ""));
  }
  if (!is_text(format.plain)) return format;
  format.charset = type->parameter("charset");
  std::string nothing;
  if (!format.charset.empty())
    if (const auto known = charset::to_utf8({}, format.charset, nothing); !known) return not_accepted(context, value, known.error().message);
  return format;
}

std::variant<BodyTask, http::Response> Bodies::task_for(const Context& context, const rdf::Type* value, const rdf::Facets& facets) const {
  const http::Request& request = context.request();
  auto format = format_of(context, value, request.body.empty());
  if (auto* response = std::get_if<http::Response>(&format)) return std::move(*response);
  auto& [syntax, plain, charset] = std::get<Format>(format);
  BodyTask task{request.body};
  task.syntax = syntax;
  task.format = plain;
  task.charset = std::move(charset);
  task.here = responses_.iri(context, context.resource->path);
  task.vocabulary = view_.vocabulary(view_.bases[context.base]);
  task.context = responses_.iri(context, context_document_);
  task.limits = limits_;
  task.type = value;
  task.facets = facets;
  return task;
}

Bodies::Read Bodies::judge(Context& context, BodyTask task) {
  const std::size_t bytes = task.text.size();
  if (!options_.body_jobs || bytes <= options_.small_body_bytes) return as_read(context, task.judge());
  auto owner = own_text(context, task.text);
  return defer(
      context, bytes, bytes, [task = std::move(task), owner = std::move(owner)] { return task.judge(); }, false);
}

/// Keeps the text of a body beyond the call that it came with.
std::shared_ptr<const void> Bodies::own_text(const Context& context, std::string_view& text) const {
  if (context.request().body_owner) return context.request().body_owner;
  const auto copy = std::make_shared<const std::string>(text);
  text = *copy;
  return copy;
}

/// Validates a body in a BodyJob.
/// @param effort  BodyJob::bytes
/// @param writes  the work changes something: once it has begun, the request is carried out
Bodies::Read Bodies::defer(Context& context, std::size_t bytes, std::size_t effort, Work work, bool writes) {
  const std::string client = context.share_key();
  const auto known = waiting_by_client_.find(client);
  const std::size_t of_client = known == waiting_by_client_.end() ? 0 : known->second.bytes;
  if (waiting_bytes_ + bytes > options_.max_waiting_body_bytes || of_client + bytes > options_.max_waiting_body_bytes / 4) return too_many(context);
  const auto late = [this, writes](Ticket ticket, Context& c, bool runs) {
    if (runs && writes) return pending_.respond(ticket, responses_.no_content(c, 202));
    if (!c.expiry.is_late(c.now.steady)) return pending_.respond(ticket, too_many(c));
    auto read = as_read(c, JudgedBody(CommandRules::fault(Refusal::late)));
    pending_.respond(ticket, std::move(std::get<http::Response>(read)));
  };
  const auto ticket = pending_.defer(context, options_.host_timeout, late, Dispatch::io_thread);
  if (!ticket) return too_many(context);
  if (context.expiry.valid_until) pending_.answer_by(*ticket, *context.expiry.valid_until);
  // The memory for the result is allocated before the job starts.
  struct Judging {
    CancelToken token;
    Work work;
    JudgedBody judged = BodyFault{500, "internal server error"};
    bool ran = false, is_counted = false;
  };
  auto judging = std::make_shared<Judging>();
  judging->work = std::move(work);
  Inbox::Reserved reply = Inbox::reserve([this, ticket = *ticket, client, bytes, judging](TimePoint now) {
    if (!judging->is_counted) return;  // defer() has thrown
    ended(client, bytes);
    Context* const kept = judging->ran ? pending_.resume(ticket, now) : nullptr;
    if (!kept) return;
    kept->judged = std::shared_ptr<JudgedBody>(judging, &judging->judged);
    continue_(ticket, *kept);
  });
  Waiting& waiting = waiting_by_client_[client];
  jobs_.push_back({client, effort, [judging, reply = Owed(calls_.inbox(), std::move(reply))]() mutable {
                     if (judging->token.take()) {
                       judging->ran = true;
                       Result<JudgedBody> result = guarded<JudgedBody>([&]() -> Result<JudgedBody> { return judging->work(); });
                       if (result) judging->judged = *std::move(result);
                     }
                     judging->work = {};
                     reply.leave();
                   }});
  judging->is_counted = true;
  ++waiting.jobs;
  waiting.bytes += bytes;
  waiting_bytes_ += bytes;
  pending_.waits_for(*ticket, {judging, &judging->token});
  return Deferred{*ticket};
}

std::variant<GraphTask, http::Response> Bodies::graph_task(const Context& context, std::shared_ptr<model::GraphState> state) const {
  GraphTask task;
  task.is_update = context.request().method == "PATCH";
  if (context.request().method != "DELETE") {
    auto made = task_for(context, nullptr, {});
    if (auto* response = std::get_if<http::Response>(&made)) return std::move(*response);
    task.body = std::move(std::get<BodyTask>(made));
  }
  const GraphOptions& options = state->options();
  task.body.limits = std::make_shared<const BodyLimits>(
      BodyLimits{options.max_triples, options.max_bytes, options_.max_list_members, options_.prefixes, options_.contexts});
  task.body.here = view_.bases[context.base] + state->path();
  task.base = view_.bases[context.base];
  task.shows = context.audience.sees(*context.resource);
  task.state = std::move(state);
  return task;
}

std::variant<bool, http::Response> Bodies::has_graphs(const Context& context) const {
  auto format = format_of(context, nullptr, context.request().body.empty());
  if (auto* response = std::get_if<http::Response>(&format)) return std::move(*response);
  const auto& syntax = std::get<Format>(format).syntax;
  const bool has = syntax && may_have_graphs(*syntax);
  if (has || context.request().method != "PUT") return has;
  const std::string types = GraphStore::dataset_types();
  http::Response response = responses_.problem(
      context, 415, "Content-Type: expected one of " + types + ", whose documents name their graphs; PUT a single graph at its own URI");
  response.fields.set("Accept", types);
  return response;
}

Bodies::Read Bodies::read_graphs(Context& context, const GraphOptions& limits, std::string one_path) {
  auto made = task_for(context, nullptr, {});
  if (auto* response = std::get_if<http::Response>(&made)) return std::move(*response);
  BodyTask task = std::move(std::get<BodyTask>(made));
  task.limits = std::make_shared<const BodyLimits>(
      BodyLimits{limits.max_triples, limits.max_bytes, options_.max_list_members, options_.prefixes, options_.contexts});
  task.is_verbatim = true;
  task.here = view_.bases[context.base] + context.resource->path;
  const std::size_t bytes = task.text.size();
  std::shared_ptr<const void> owner;
  const bool is_small = !options_.body_jobs || bytes <= options_.small_body_bytes;
  if (!is_small) owner = own_text(context, task.text);
  Work work = [task = std::move(task), owner = std::move(owner), base = view_.bases[context.base], one_path = std::move(one_path)]() -> JudgedBody {
    JudgedBody read = task.read_dataset();
    Body* const body = std::get_if<Body>(&read);
    if (!body) return read;
    DatasetChange& change = *body->dataset;
    change.base = base;
    change.one_path = one_path;
    if (!change.graphs.named.empty()) return read;
    if (one_path.empty()) return BodyFault{422, "body: expected named graphs, found none: the document has a default graph only"};
    BodyTask again = task;
    again.here = base + one_path;  // its relative IRIs are those of the new graph
    JudgedBody one = again.judge();
    if (auto* graph = std::get_if<Body>(&one)) graph->dataset = std::move(body->dataset);
    return one;
  };
  if (is_small) return as_read(context, work());
  return defer(context, bytes, bytes, std::move(work), false);
}

Bodies::Read Bodies::prepare_graphs(Context& context, const std::shared_ptr<DatasetChange>& change) {
  std::size_t triples = 0;
  for (const DatasetChange::Part& part : change->parts) triples += part.write.graph.size() + part.state->version().graph->size();
  const bool is_small = triples <= small_graph && change->times_prepared == 0;
  const auto work = [change](bool waits) -> JudgedBody {
    if (auto fault = change->prepare(waits)) return *std::move(fault);
    Body body;
    body.dataset = change;
    return body;
  };
  if (!options_.body_jobs || is_small) return as_read(context, work(false));
  return defer(
      context, 0, triples * work_of_triple, [work] { return work(true); }, false);
}

http::Response Bodies::graphs_are_busy(const Context& context) const {
  http::Response response = responses_.problem(context, 503, "a graph of the document is being changed by others; none was changed, try again later");
  responses_.add_retry_after(response);
  return response;
}

Bodies::Read Bodies::change_graph(Context& context, GraphTask task) {
  const std::size_t bytes = task.body.text.size();
  const std::size_t triples = task.state->version().graph->size() + task.write.graph.size();
  const bool is_small = bytes <= options_.small_body_bytes && triples <= small_graph;
  // Never waits for a running write, because that may run user code.
  if (!options_.body_jobs || is_small)
    if (auto judged = task.carry_out(false)) return as_change(context, *std::move(judged));
  if (!options_.body_jobs) return too_many(context);
  auto owner = own_text(context, task.body.text);
  const bool writes = !task.creates;
  return defer(
      context, bytes, bytes + triples * work_of_triple,
      [task = std::move(task), owner = std::move(owner)]() mutable { return *task.carry_out(true); }, writes);
}

void Bodies::ended(const std::string& client, std::size_t bytes) noexcept {
  waiting_bytes_ -= bytes;
  const auto found = waiting_by_client_.find(client);
  found->second.bytes -= bytes;
  if (--found->second.jobs == 0) waiting_by_client_.erase(found);
}

/// The result of a validation on another thread.
Bodies::Read Bodies::verdict(Context& context) {
  const std::shared_ptr<JudgedBody> judged = std::exchange(context.judged, nullptr);
  return as_read(context, std::move(*judged));
}

Bodies::Read Bodies::changed_graph(Context& context) {
  const std::shared_ptr<JudgedBody> judged = std::exchange(context.judged, nullptr);
  return as_change(context, std::move(*judged));
}

/// The shapes judge the whole graph, so a report may name what was in it before.
Bodies::Read Bodies::as_change(const Context& context, JudgedBody judged) const {
  const auto* fault = std::get_if<BodyFault>(&judged);
  if (fault && fault->status == 503) {
    http::Response response = refused(context, *fault);
    responses_.add_retry_after(response);
    return response;
  }
  if (!fault || !fault->report || context.audience.sees(*context.resource)) return as_read(context, std::move(judged));
  return responses_.problem(context, fault->status, "the graph would not conform to its shapes; the report is for clients that may read the graph");
}

Bodies::Read Bodies::as_read(const Context& context, JudgedBody judged) const {
  if (auto* body = std::get_if<Body>(&judged)) return std::move(*body);
  const BodyFault& fault = std::get<BodyFault>(judged);
  if (fault.report) return responses_.violation(context, *fault.report, fault.errors);
  http::Problem problem{fault.status, fault.detail, fault.errors.empty() ? std::string() : json_of(fault.errors), std::string(fault.type)};
  http::Response response = responses_.problem(context, std::move(problem));
  response.denial = fault.denial;
  return response;
}

http::Response Bodies::too_many(const Context& context) const {
  http::Response response = responses_.problem(context, 503, "too many large request bodies are waiting for validation; try again later");
  responses_.add_retry_after(response);
  return response;
}

/// Finds a link of relation type to an LDP model other than ldp:Resource and ldp:RDFSource.
bool requests_other_model(std::string_view field) {
  constexpr std::string_view ldp = "http://www.w3.org/ns/ldp#";
  while (!field.empty()) {
    const std::optional<http::WrittenLink> link = http::take_link(field);
    if (!link || link->has_anchor || link->target.substr(0, ldp.size()) != ldp) continue;
    if (link->target == vocab::ldp::Resource.text || link->target == vocab::ldp::RDFSource.text) continue;
    std::string_view relations = link->relations;
    for (std::string_view name = http::take_relation(relations); !name.empty(); name = http::take_relation(relations))
      if (http::iequals(name, "type")) return true;
  }
  return false;
}

}  // namespace lrt::engine
