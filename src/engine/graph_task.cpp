// SPDX-License-Identifier: Apache-2.0
#include "src/engine/graph_task.hpp"

#include <utility>

#include <lrt/rdf/value_codec.hpp>

#include "src/base/charset.hpp"
#include "src/engine/resource.hpp"

namespace lrt::engine {

static_assert(World::base == placeholder_base, "graphs of code and of the engine have the same base");

namespace {

std::string with_base(std::string text, const std::string& base) {
  for (std::size_t at = text.find(placeholder_base); at != std::string::npos; at = text.find(placeholder_base, at + base.size()))
    text.replace(at, placeholder_base.size(), base);
  return text;
}

/// @param name   of the graph in a sentence
/// @param shows  the client may know how large the graph is
BodyFault fault_of(model::GraphRefusal refusal, const std::string& name, const std::string& base, bool shows) {
  using Why = model::GraphRefusal::Kind;
  switch (refusal.kind) {
    case Why::changed: return {412, "If-Match: the graph has changed meanwhile; GET it again"};
    case Why::stopped: return {503, name + " is being changed, and its server stops or its World was removed"};
    case Why::unsaved: return {503, name + ": " + refusal.message};
    case Why::too_large: return {413, name + ": " + (shows || refusal.limit.empty() ? refusal.message : refusal.limit)};
    case Why::unsupported: return {501, name + ": " + refusal.message};
    case Why::late: return {503, name + ": " + refusal.message};
    case Why::store_failed: return {500, name + ": " + refusal.message};
    case Why::store_full: return {507, name + ": " + refusal.message};
    case Why::violation: break;
    default: return {422, name + ": " + refusal.message};
  }
  BodyFault fault{422};
  for (const shacl::ValidationResult& result : refusal.report->results()) {
    std::string detail = rdf::to_string(result.focus.view());
    if (!result.path.empty()) detail += " " + result.path.to_string();
    for (const rdf::Term& message : result.messages) detail.append(": ").append(message.view().text);
    fault.errors.push_back({{}, with_base(std::move(detail), base), {}, rdf::abbreviate(result.component.text)});
  }
  fault.report = std::move(refusal.report);
  return fault;
}

}  // namespace

std::optional<JudgedBody> GraphTask::carry_out(bool waits) {
  if (auto fault = parse()) return JudgedBody(*std::move(fault));
  if (!passes(check)) return JudgedBody(CommandRules::fault(check->refusal()));
  Body accepted;
  std::optional<model::GraphRefusal> refused = state->write(write, waits, &accepted.saving);
  if (refused && refused->kind == model::GraphRefusal::Kind::busy) return std::nullopt;
  if (refused) return JudgedBody(fault_of(*std::move(refused)));
  if (creates) accepted.made_graph = state;
  return JudgedBody(std::move(accepted));
}

std::optional<BodyFault> GraphTask::parse() {
  if (std::exchange(is_parsed_, true)) return std::nullopt;
  if (!is_update) {
    body.is_verbatim = true;
    JudgedBody read = body.judge();
    if (auto* fault = std::get_if<BodyFault>(&read)) return std::move(*fault);
    write.graph = unplaced(std::get<Body>(read).graph, base);
    return std::nullopt;
  }
  std::string transcoded;
  std::string_view text = body.text;
  if (!body.charset.empty()) {
    const Result<std::string_view> utf8 = charset::to_utf8(text, body.charset, transcoded);
    if (!utf8) return BodyFault{400, "body: " + utf8.error().message};
    text = *utf8;
  }
  rdf::ReadOptions options;
  options.base = body.here;
  options.max_triples = body.limits->max_triples;
  options.max_bytes = body.limits->max_text_bytes;
  Result<std::vector<rdf::DataUpdate>> updates = rdf::read_data_updates(text, options);
  if (!updates) {
    const Errc code = updates.error().code;
    return BodyFault{code == Errc::limit_exceeded ? 413 : code == Errc::unsupported_syntax ? 422 : 400, "body: " + updates.error().message};
  }
  for (rdf::DataUpdate& update : *updates) update.graph = unplaced(update.graph, base);
  write.updates = *std::move(updates);
  return std::nullopt;
}

BodyFault GraphTask::fault_of(model::GraphRefusal refusal) const { return engine::fault_of(std::move(refusal), "the graph", base, shows); }

std::optional<BodyFault> DatasetChange::prepare(bool waits) {
  ++times_prepared;
  for (Part& part : parts) {
    if (waits) part.state->wait_for_writes();
    auto made = part.state->prepare(part.write);
    if (auto* refused = std::get_if<model::GraphRefusal>(&made)) return fault_of(part, std::move(*refused));
    part.prepared = std::move(std::get<model::PreparedWrite>(made));
  }
  return std::nullopt;
}

BodyFault DatasetChange::fault_of(const Part& part, model::GraphRefusal refusal) const {
  const std::string name = "the graph <" + base + part.state->path() + ">";
  if (refusal.report && !part.shows) return {422, name + " would not conform to its shapes; the report is for clients that may read the graph"};
  return engine::fault_of(std::move(refusal), name, base, part.shows);
}

}  // namespace lrt::engine
