// SPDX-License-Identifier: Apache-2.0
#include "src/engine/body_task.hpp"

#include <algorithm>
#include <utility>

#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/base/charset.hpp"
#include "src/engine/graph_task.hpp"
#include "src/rdf/plain_schema.hpp"

namespace lrt::engine {

namespace {

/// Blanks what an XML declaration says of the encoding: the field Content-Type precedes it (RFC 7303 3).
void blank_declared_encoding(std::string& document) {
  if (document.compare(0, 5, "<?xml") != 0) return;
  const std::size_t end = document.find("?>");
  const std::size_t name = document.find("encoding");
  const std::size_t open = document.find_first_of("\"'", name);
  if (end == std::string::npos || open == std::string::npos || open > end) return;
  const std::size_t close = document.find(document[open], open + 1);
  if (close < end) document.replace(name, close + 1 - name, close + 1 - name, ' ');
}

std::size_t longest_list_in(const rdf::Value& value) {
  const rdf::Value::Sequence* members = value.sequence();
  if (!members) return 0;
  std::size_t longest = members->size();
  for (const rdf::Value& m : *members) longest = std::max(longest, longest_list_in(m));
  return longest;
}

/// SPEC 3.3: the focus node is <> if that is a subject, else the only subject of the target class, else the only blank node that has no
/// type and is no object. Of several, two are given.
std::vector<rdf::TermId> focus_nodes(const rdf::Graph& graph, const std::string& here, const std::string& wanted) {
  const auto self = graph.find(rdf::iri(here));
  if (self && !graph.match(*self, std::nullopt, std::nullopt).empty()) return {*self};
  std::vector<rdf::TermId> found;
  const auto take = [&](rdf::TermId node) {
    if (found.size() < 2 && std::find(found.begin(), found.end(), node) == found.end()) found.push_back(node);
  };
  const auto type = graph.find(vocab::rdf_::type);
  if (const auto of = graph.find(rdf::iri(wanted)); !wanted.empty() && type && of)
    for (const rdf::Triple& t : graph.match(std::nullopt, *type, *of)) take(t.subject);
  if (!found.empty()) return found;
  for (const rdf::Triple& t : graph.triples()) {
    const bool typed = type && !graph.match(t.subject, *type, std::nullopt).empty();
    if (graph.term(t.subject).is_blank() && !typed && graph.match(std::nullopt, std::nullopt, t.subject).empty()) take(t.subject);
  }
  return found;
}

/// Until 2023 QUDT had qudt:unit in place of qudt:hasUnit. Bodies with the former name are judged as if they had the present one too.
void accept_former_unit(rdf::Graph& graph) {
  const auto former = graph.find(rdf::TermView(vocab::qudt::unit));
  if (!former) return;
  std::vector<rdf::Triple> found;
  for (const rdf::Triple& t : graph.match(std::nullopt, *former, std::nullopt)) found.push_back(t);
  const rdf::TermId present = graph.intern(vocab::qudt::hasUnit);
  for (const rdf::Triple& t : found) graph.add(t.subject, present, t.object);
}

/// Executes one task and holds its result.
class Judge {
 public:
  explicit Judge(const BodyTask& task) : task_(task), text_(task.text) {}

  JudgedBody run() {
    if (auto fault = decode()) return *std::move(fault);
    if (auto fault = parse()) return *std::move(fault);
    return judge_graph();
  }

  JudgedBody run(rdf::Graph graph) {
    body_.graph = std::move(graph);
    accept_former_unit(body_.graph);
    return judge_graph();
  }

  JudgedBody run_dataset() {
    if (auto fault = decode()) return *std::move(fault);
    Result<rdf::Dataset> dataset = rdf::read_dataset(text_, *task_.syntax, read_options());
    if (!dataset) return unreadable(dataset.error());
    body_.dataset = std::make_shared<DatasetChange>();
    body_.dataset->graphs = *std::move(dataset);
    return std::move(body_);
  }

 private:
  using Fault = std::optional<BodyFault>;

  JudgedBody judge_graph() {
    if (!task_.shapes) return std::move(body_);
    if (auto fault = find_node()) return *std::move(fault);
    const bool found = body_.node.has_value();
    if (!found && is_optional() && body_.graph.empty()) return std::move(body_);
    if (found && task_.completes && task_.format) return judge_plain();
    if (task_.completes) complete();
    if (auto fault = validate()) return *std::move(fault);
    if (!found) return BodyFault{422, "body: expected triples about <> or one " + what() + ", found none"};
    if (task_.type)
      if (auto fault = read_value()) return *std::move(fault);
    return std::move(body_);
  }

  /// A value without RDF that no shape of the user judges: the derived shape accepts what read_value() accepts, and has the words for the rest.
  JudgedBody judge_plain() {
    const Fault unreadable = read_value();
    if (!unreadable) return std::move(body_);
    if (auto fault = validate()) return *std::move(fault);
    return *unreadable;
  }

  bool is_optional() const { return task_.type && task_.type->kind == rdf::Type::Kind::optional; }
  std::string what() const { return task_.focus ? std::string(task_.focus->what) : "node that carries the value"; }

  /// Converts the body to UTF-8.
  Fault decode() {
    if (task_.charset.empty()) return std::nullopt;
    const Result<std::string_view> utf8 = charset::to_utf8(task_.text, task_.charset, transcoded_);
    if (!utf8) return BodyFault{400, "body: " + utf8.error().message};
    text_ = *utf8;
    if (task_.syntax == rdf::Syntax::rdf_xml) {
      if (transcoded_.empty()) transcoded_ = text_;
      blank_declared_encoding(transcoded_);
      text_ = transcoded_;
    }
    return std::nullopt;
  }

  Fault parse() {
    if (task_.format) return parse_plain(*task_.format);
    if (!task_.syntax) return std::nullopt;
    Result<rdf::Graph> graph = rdf::read(text_, *task_.syntax, read_options());
    if (!graph) return unreadable(graph.error());
    body_.graph = *std::move(graph);
    if (!task_.is_verbatim) accept_former_unit(body_.graph);
    return std::nullopt;
  }

  rdf::ReadOptions read_options() const {
    rdf::ReadOptions options;
    options.base = task_.here;
    options.max_triples = task_.limits->max_triples;
    options.max_bytes = task_.limits->max_text_bytes;
    options.context = task_.context;
    options.context_prefixes = &task_.limits->prefixes;
    options.contexts = &task_.limits->contexts;
    return options;
  }

  static BodyFault unreadable(const Error& error) {
    const int status = error.code == Errc::limit_exceeded ? 413 : error.code == Errc::unsupported_syntax ? 422 : 400;
    return BodyFault{status, "body: " + error.message};
  }

  Fault parse_plain(rdf::Plain format) {
    if (text_.empty() && format == rdf::Plain::json)
      return BodyFault{400, "body: expected JSON of the schema " + rdf::write_schema(*task_.type, task_.facets) + ", found an empty body"};
    rdf::Mismatch mismatch;
    const Result<void> read = rdf::read_plain(text_, format, *task_.type, task_.facets, task_.vocabulary, task_.limits->max_triples, body_.graph,
                                              body_.graph.intern(rdf::iri(task_.here)), &mismatch);
    if (read) return std::nullopt;
    const Errc code = read.error().code;
    BodyFault fault{code == Errc::limit_exceeded ? 413 : code == Errc::expected_rdf ? 400 : 422, "body: " + read.error().message};
    if (code == Errc::expected_value) fault.errors = {{mismatch.path, mismatch.message}};
    return fault;
  }

  Fault find_node() {
    std::vector<rdf::TermId> nodes;
    if (task_.focus) {
      nodes = task_.focus->find(body_.graph, task_.here);
      if (nodes.size() > 1) return BodyFault{422, "body: expected one " + what() + ", found several"};
    } else {
      const std::string wanted = rdf::target_class(*task_.type, task_.vocabulary);
      nodes = focus_nodes(body_.graph, task_.here, wanted);
      if (nodes.size() > 1) {
        return BodyFault{422, "body: expected triples about <> or one subject " +
                                  (wanted.empty() ? std::string("without a type") : "of type " + rdf::abbreviate(wanted)) + ", found several"};
      }
    }
    if (nodes.empty()) return std::nullopt;
    body_.node = nodes.front();
    const std::string_view refused = task_.focus && task_.focus->refuse ? task_.focus->refuse(body_.graph, *body_.node) : std::string_view();
    if (!refused.empty()) return BodyFault{422, std::string(refused)};
    return std::nullopt;
  }

  void complete() {
    const rdf::TermId focus = body_.node ? *body_.node : body_.graph.intern(rdf::iri(task_.here));
    std::optional<rdf::Graph> completed = rdf::completed(body_.graph, focus, *task_.type, task_.facets, task_.vocabulary);
    if (!completed) return;
    const rdf::Term same(body_.graph.term(focus));
    body_.graph = *std::move(completed);
    if (body_.node) body_.node = body_.graph.find(same.view());
  }

  Fault validate() {
    shacl::ValidateOptions limits;
    limits.max_results = 64;
    limits.max_steps = 1'000'000;
    // <> if there is no node, so that the report says what is missing.
    const rdf::TermId node = body_.node ? *body_.node : body_.graph.intern(rdf::iri(task_.here));
    Result<shacl::Report> report = shacl::validate(*task_.shapes, body_.graph, body_.graph.term(node), rdf::iri(task_.shape), limits);
    if (!report) return BodyFault{422, "body: validation did not complete: " + report.error().message};
    if (report->conforms()) return std::nullopt;
    BodyFault fault{422};
    std::optional<rdf::ValuePlaces> places;
    if (task_.type) places.emplace(body_.graph, node, *task_.type, task_.facets, task_.vocabulary);
    fault.errors = body_errors(*report, places);
    fault.report = *std::move(report);
    return fault;
  }

  Fault read_value() {
    std::vector<rdf::PlacedMismatch> mismatches;
    Result<rdf::Value> value = rdf::read_value(body_.graph, *body_.node, *task_.type, task_.facets, task_.vocabulary, mismatches);
    if (!value) {
      BodyFault fault{422};
      for (rdf::PlacedMismatch& m : mismatches) fault.errors.push_back({std::move(m.pointer), std::move(m.mismatch.message)});
      fault.detail = sentence_of(fault.errors);
      return fault;
    }
    if (longest_list_in(*value) > task_.limits->max_list_members)
      return BodyFault{413, "body: expected lists of at most " + std::to_string(task_.limits->max_list_members) + " members"};
    body_.value = *std::move(value);
    return std::nullopt;
  }

  const BodyTask& task_;
  std::string_view text_;
  std::string transcoded_;
  Body body_;
};

}  // namespace

JudgedBody BodyTask::judge() const { return Judge(*this).run(); }
JudgedBody BodyTask::judge(rdf::Graph graph) const { return Judge(*this).run(std::move(graph)); }
JudgedBody BodyTask::read_dataset() const { return Judge(*this).run_dataset(); }

}  // namespace lrt::engine
