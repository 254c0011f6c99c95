#include "src/engine/bodies.hpp"

#include <algorithm>
#include <vector>

#include <lrt/base/media_type.hpp>
#include <lrt/http/message.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/base/charset.hpp"
#include "src/engine/resources/blueprint.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/rdf/plain_schema.hpp"

namespace lrt::engine {

namespace {

bool is_text(std::optional<rdf::Plain> format) noexcept { return format != rdf::Plain::cbor && format != rdf::Plain::octets; }

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

}  // namespace

std::variant<Bodies::Format, http::Response> Bodies::format_of(const Context& context, const rdf::Type* value, bool is_empty) const {
  const http::Request& request = context.request();
  if (const auto coding = request.find("Content-Encoding"); coding && !http::iequals(*coding, "identity")) {
    http::Response response = responses_.problem(context, 415, "Content-Encoding: expected identity, found \"" + std::string(*coding) + "\"");
    response.fields.set("Accept-Encoding", "identity");
    return response;
  }
  if (request.find("Content-Range")) return responses_.problem(context, 400, "Content-Range has no meaning here (RFC 9110 14.5)");

  const auto content_type = request.find("Content-Type");
  if (!content_type && is_empty) return Format{};
  const auto unsupported = [&](const std::string& found) {
    return not_accepted(context, value, "expected one of " + accepted_types(context, value) + ", found " + found);
  };
  if (!content_type) return unsupported("none");
  const Result<MediaType> type = MediaType::parse(*content_type);
  if (!type || request.count("Content-Type") > 1) return unsupported("\"" + request.joined("Content-Type") + "\"");
  Format format{rdf::syntax_of(type->essence()), std::nullopt, std::string(type->parameter("charset"))};
  if (value && !format.syntax) format.plain = rdf::plain_of(*type);
  if (!format.syntax && (!format.plain || (*format.plain == rdf::Plain::octets && !takes_octets(context, value)))) {
    const bool is_form = value && type->essence() == "application/x-www-form-urlencoded";
    return unsupported(type->essence() + (is_form ? ", which curl -d sends; add -H 'Content-Type: application/json'" : ""));
  }
  if (is_text(format.plain) && !format.charset.empty()) {
    std::string nothing;
    if (const auto known = charset::to_utf8({}, format.charset, nothing); !known) return not_accepted(context, value, known.error().message);
  }
  return format;
}

bool Bodies::takes_octets(const Context& context, const rdf::Type* value) const {
  return value && context.resource->variants().type_of(Variant(rdf::Plain::octets)) != std::string_view() && rdf::reads_octets(*value);
}

std::string Bodies::accepted_types(const Context& context, const rdf::Type* value) const {
  return readable_types(value != nullptr) + (takes_octets(context, value) ? ", " + std::string(rdf::media_type(rdf::Plain::octets)) : "");
}

/// 415
http::Response Bodies::not_accepted(const Context& context, const rdf::Type* value, const std::string& detail) const {
  const std::string types = accepted_types(context, value);
  http::Response response = responses_.problem(context, 415, "Content-Type: " + detail);
  response.fields.set("Accept", types);  // RFC 9110 15.5.16
  if (context.request().method == "POST") response.fields.set("Accept-Post", types);
  return response;
}

std::variant<Bodies::Body, http::Response> Bodies::read(const Context& context, const rdf::Type* value, const rdf::Facets& facets) const {
  const http::Request& request = context.request();
  auto found = format_of(context, value, request.body.empty());
  if (auto* response = std::get_if<http::Response>(&found)) return std::move(*response);
  const auto& [syntax, format, charset] = std::get<Format>(found);
  if (!syntax && !format) return Body{};

  std::string_view text = request.body;
  std::string transcoded;
  if (!charset.empty() && is_text(format)) {
    const Result<std::string_view> utf8 = charset::to_utf8(request.body, charset, transcoded);
    if (!utf8) return responses_.problem(context, 400, "body: " + utf8.error().message);
    text = *utf8;
    if (syntax == rdf::Syntax::rdf_xml) {
      if (transcoded.empty()) transcoded = text;
      blank_declared_encoding(transcoded);
      text = transcoded;
    }
  }

  const std::string base = responses_.iri(context, context.resource->path);
  if (format) {
    Body body;
    body.empty = request.body.empty();
    if (text.empty() && format == rdf::Plain::json)
      return responses_.problem(context, 400, "body: expected JSON of the schema " + rdf::write_schema(*value, facets) + ", found an empty body");
    rdf::Mismatch mismatch;
    const Result<void> read =
        rdf::read_plain(text, *format, *value, facets, view_.vocabulary(view_.bases[context.base]),
                        options_.max_body_triples, body.graph, body.graph.intern(rdf::iri(base)), &mismatch);
    if (read) return body;
    const Errc code = read.error().code;
    if (code == Errc::expected_value)
      return responses_.problem(context, 422, "body: " + read.error().message, json_of({{mismatch.path, mismatch.message}}));
    return responses_.problem(context, code == Errc::limit_exceeded ? 413 : code == Errc::expected_rdf ? 400 : 422, "body: " + read.error().message);
  }
  rdf::ReadOptions read_options;
  read_options.base = base;
  read_options.max_triples = options_.max_body_triples;
  read_options.max_bytes = options_.max_body_text_bytes;
  const std::string own_context = responses_.iri(context, context_document_);
  read_options.context = own_context;
  read_options.context_prefixes = &options_.prefixes;
  Result<rdf::Graph> graph = rdf::read(text, *syntax, read_options);
  if (!graph) {
    const Error& e = graph.error();
    return responses_.problem(context, e.code == Errc::limit_exceeded ? 413 : 400, "body: " + e.message);
  }
  accept_former_unit(*graph);
  return Body{*std::move(graph), request.body.empty()};
}

std::variant<rdf::Value, http::Response> Bodies::read_value(const Context& context, const rdf::Type& type, const rdf::Facets& facets) const {
  // An empty body is no value, whatever its header fields say of it.
  if (type.kind == rdf::Type::Kind::optional && context.request().body.empty()) return rdf::Value();
  auto body = read(context, &type, facets);
  if (auto* response = std::get_if<http::Response>(&body)) return std::move(*response);
  rdf::Graph& graph = std::get<Body>(body).graph;

  const std::string here = responses_.iri(context, context.resource->path);
  const std::string vocabulary = view_.vocabulary(view_.bases[context.base]), wanted = rdf::target_class(type, vocabulary);
  const std::vector<rdf::TermId> nodes = focus_nodes(graph, here, wanted);
  if (nodes.size() > 1) {
    return responses_.problem(context, 422, "body: expected triples about <> or one subject " +
                                     (wanted.empty() ? std::string("without a type") : "of type " + rdf::abbreviate(wanted)) +
                                     ", found several");
  }
  if (nodes.empty() && type.kind == rdf::Type::Kind::optional && graph.empty()) return rdf::Value();

  ThingNode& thing = *context.resource->thing;
  auto node = nodes.empty() ? std::nullopt : std::optional(nodes.front());
  // A shape of the user is taken literally.
  if (!has_user_shape(thing, context.resource->input_shape())) {
    const rdf::TermId focus = node ? *node : graph.intern(rdf::iri(here));
    if (std::optional<rdf::Graph> completed = rdf::completed(graph, focus, type, facets, vocabulary)) {
      const rdf::Term same(graph.term(focus));
      graph = *std::move(completed);
      if (node) node = graph.find(same.view());
    }
  }
  if (auto response = nonconforming(context, graph, node, &type)) return *std::move(response);
  if (nodes.empty()) return responses_.problem(context, 422, "body: expected triples about <> or one node that carries the value, found none");

  std::vector<rdf::Mismatch> mismatches;
  Result<rdf::Value> value = rdf::read_value(graph, *node, type, facets, vocabulary, mismatches);
  if (value && longest_list_in(*value) > options_.max_list_members)
    return responses_.problem(context, 413, "body: expected lists of at most " + std::to_string(options_.max_list_members) + " members");
  if (value) return *std::move(value);
  const std::vector<BodyError> errors = body_errors(mismatches, type, vocabulary);
  return responses_.problem(context, 422, sentence_of(errors), json_of(errors));
}

std::optional<http::Response> Bodies::nonconforming(const Context& context, const rdf::Graph& graph,
                                                    std::optional<rdf::TermId> node, const rdf::Type* type) const {
  ThingNode& thing = *context.resource->thing;
  const Result<const shacl::Shapes*> shapes = compiled_shapes(thing, context.base, view_);
  if (!shapes) return responses_.problem(context, 500, "the blueprint: " + shapes.error().message);
  shacl::ValidateOptions limits;
  limits.max_results = 64;
  limits.max_steps = 1'000'000;
  // So that the report of an empty body says what is missing.
  const std::string here = responses_.iri(context, context.resource->path);
  const std::string shape = thing.shape_iri(view_.bases[context.base], context.resource->input_shape());
  const Result<shacl::Report> report = shacl::validate(**shapes, graph, node ? graph.term(*node) : rdf::iri(here), rdf::iri(shape), limits);
  if (!report) return responses_.problem(context, 422, "body: it could not be judged: " + report.error().message);
  if (!report->conforms()) return responses_.violation(context, *report, body_errors(*report, graph, node, type, view_.vocabulary(view_.bases[context.base])));
  return std::nullopt;
}

/// Finds a link of relation type to an LDP model other than ldp:Resource and ldp:RDFSource.
bool requests_other_model(std::string_view field) {
  constexpr std::string_view ldp = "http://www.w3.org/ns/ldp#";
  while (true) {
    const std::size_t open = field.find('<');
    const std::size_t close = field.find('>', open);
    if (open == std::string_view::npos || close == std::string_view::npos) return false;
    const std::string_view target = field.substr(open + 1, close - open - 1);
    field.remove_prefix(close + 1);
    // Parameters up to the comma that ends this link; quoted strings may hold anything.
    bool is_type = false, quoted = false;
    std::string name, value;
    std::string* part = nullptr;
    const auto end_parameter = [&] {
      if (http::iequals(name, "rel")) {
        std::size_t start = 0;
        while (start < value.size()) {  // a list of relation types
          const std::size_t end = std::min(value.find(' ', start), value.size());
          is_type |= http::iequals(std::string_view(value).substr(start, end - start), "type");
          start = end + 1;
        }
      }
      name.clear();
      value.clear();
    };
    std::size_t at = 0;
    for (; at < field.size() && (quoted || field[at] != ','); ++at) {
      const char c = field[at];
      if (c == '"') quoted = !quoted;
      else if (quoted && part) *part += c;
      else if (c == ';') end_parameter(), part = &name;
      else if (c == '=' && part == &name) part = &value;
      else if (c != ' ' && c != '\t' && part) *part += c;
    }
    end_parameter();
    field.remove_prefix(at);
    if (!is_type || target.substr(0, ldp.size()) != ldp) continue;
    if (target != vocab::ldp::Resource.text && target != vocab::ldp::RDFSource.text) return true;
  }
}

}  // namespace lrt::engine
