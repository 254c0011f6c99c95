// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/representation.hpp>

#include <algorithm>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/client/representation.hpp"
#include "src/http/url.hpp"
#include "src/rdf/json_parse.hpp"

namespace lrt::client {
inline namespace v0 {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;

std::string_view document_of(std::string_view iri) noexcept { return iri.substr(0, iri.find('#')); }

std::string_view local_name(std::string_view iri) noexcept {
  while (!iri.empty() && (iri.back() == '/' || iri.back() == '#')) iri.remove_suffix(1);
  const std::size_t at = iri.find_last_of("/#");
  return at == std::string_view::npos ? iri : iri.substr(at + 1);
}

bool same_origin(std::string_view a, std::string_view b) {
  const auto origin = [](std::string_view url) -> std::optional<std::string> {
    const Result<http::Url> parsed = http::parse_url(document_of(url));
    if (!parsed) return std::nullopt;
    return parsed->origin();
  };
  const std::optional<std::string> of_a = origin(a);
  return of_a && of_a == origin(b);
}

void add_apart(Graph& graph, const Graph& other, const std::function<bool(const TermView& subject)>& skip) {
  std::vector<bool> skipped(other.term_count());
  for (const Triple& t : other.triples()) skipped[static_cast<std::size_t>(t.subject)] = skip(other.term(t.subject));
  std::vector<std::optional<TermId>> ids(other.term_count());
  const auto translated = [&](TermId id) {
    std::optional<TermId>& known = ids[static_cast<std::size_t>(id)];
    if (!known) known = other.term(id).is_blank() ? graph.fresh_blank() : graph.intern(other.term(id));
    return *known;
  };
  for (const Triple& t : other.triples())
    if (!skipped[static_cast<std::size_t>(t.subject)]) graph.add(translated(t.subject), translated(t.predicate), translated(t.object));
}

std::optional<TermId> find_focus(const Graph& graph, std::string_view url) {
  const auto is_subject = [&](TermId id) { return !graph.match(id, std::nullopt, std::nullopt).empty(); };
  if (const std::optional<TermId> id = graph.find(rdf::iri(url)); id && is_subject(*id)) return id;
  // Nodes inside a value may be named by fragments of the document, too: they are objects of others.
  std::optional<TermId> with_fragment, fragment_root, root;
  std::size_t with_fragments = 0, fragment_roots = 0, roots = 0;
  std::vector<bool> seen(graph.term_count());
  for (const Triple& t : graph.triples()) {
    if (seen[static_cast<std::size_t>(t.subject)]) continue;
    seen[static_cast<std::size_t>(t.subject)] = true;
    const TermView term = graph.term(t.subject);
    const bool is_fragment = term.is_iri() && document_of(term.text) == document_of(url);
    if (is_fragment) with_fragment = t.subject, ++with_fragments;
    if (!graph.match(std::nullopt, std::nullopt, t.subject).empty()) continue;
    root = t.subject, ++roots;
    if (is_fragment) fragment_root = t.subject, ++fragment_roots;
  }
  if (with_fragments == 1) return with_fragment;
  if (fragment_roots == 1) return fragment_root;
  if (roots == 1) return root;
  return std::nullopt;
}

bool Representation::allows(std::string_view method) const noexcept { return std::find(methods.begin(), methods.end(), method) != methods.end(); }

std::vector<std::string> Representation::targets(std::string_view relation) const {
  std::vector<std::string> result;
  for (const Link& link : links)
    if (link.relation == relation) result.push_back(link.target);
  return result;
}

std::vector<std::string> Representation::objects(Iri predicate) const {
  std::vector<std::string> result;
  const std::optional<TermId> id = graph.find(predicate);
  if (!focus || !id) return result;
  for (const Triple& t : graph.match(focus, id, std::nullopt))
    if (const TermView object = graph.term(t.object); object.is_iri()) result.emplace_back(object.text);
  return result;
}

std::vector<std::string> Representation::types() const { return objects(vocab::rdf_::type); }

namespace {

/// All but the graph.
std::shared_ptr<Representation> with_fields_of(const Response& response) {
  auto result = std::make_shared<Representation>();
  result->url = document_of(response.url);
  result->media_type = response.media_type();
  result->entity_tag = response.fields.find("ETag").value_or(std::string_view());
  const std::string allow = response.fields.joined("Allow");
  for (std::string_view rest = allow; !rest.empty();) {
    const std::size_t end = std::min(rest.find(','), rest.size());
    if (const std::string_view method = lrt::detail::trim(rest.substr(0, end)); !method.empty()) result->methods.emplace_back(method);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  result->links = links(response.fields, result->url);
  return result;
}

/// A value without RDF as a literal. nullopt: it is an object, a list, or nothing.
std::optional<rdf::Term> plain_literal(std::string_view body, std::string_view type) {
  constexpr std::size_t longest = 64 * 1024;
  if (body.size() > longest) return std::nullopt;
  const auto number = [](std::string_view text) -> std::optional<rdf::Term> {
    if (rdf::lexical::parse_int64(text)) return rdf::Term(rdf::literal(text, vocab::xsd::integer));
    if (rdf::lexical::parse_double(text)) return rdf::Term(rdf::literal(text, vocab::xsd::double_));
    return std::nullopt;
  };
  if (type == "text/plain") {
    const std::string_view text = lrt::detail::trim(body.substr(0, body.find_last_not_of("\r\n") + 1));
    if (auto found = number(text)) return found;
    if (text == "true" || text == "false") return rdf::Term(rdf::literal(text, vocab::xsd::boolean));
    return rdf::Term(rdf::literal(text, vocab::xsd::string));
  }
  if (type != "application/json") return std::nullopt;
  const Result<rdf::json::Document> document = rdf::json::Document::parse(body, {100, 2, false});
  if (!document) return std::nullopt;
  using Kind = rdf::json::Document::Kind;
  const std::string_view text = document->text(document->root());
  switch (document->kind(document->root())) {
    case Kind::number: return number(text);
    case Kind::string: return rdf::Term(rdf::literal(text, vocab::xsd::string));
    case Kind::true_: return rdf::Term(rdf::literal("true", vocab::xsd::boolean));
    case Kind::false_: return rdf::Term(rdf::literal("false", vocab::xsd::boolean));
    default: return std::nullopt;
  }
}

}  // namespace

RepresentationPtr outline_of(const Response& response) {
  auto result = with_fields_of(response);
  result->focus = result->graph.intern(rdf::iri(result->url));
  return result;
}

Result<RepresentationPtr> read_representation(const Response& response, const Options& options) {
  const std::string type = response.media_type();
  const std::optional<rdf::Syntax> syntax = rdf::syntax_of(type);
  if (!syntax) {
    if (const std::optional<rdf::Term> literal = plain_literal(response.body, type)) {
      auto result = with_fields_of(response);
      rdf::Graph& graph = result->graph;
      result->focus = graph.intern(rdf::iri(result->url));
      graph.add(*result->focus, graph.intern(vocab::rdf_::value), graph.intern(literal->view()));
      return RepresentationPtr(std::move(result));
    }
    return unexpected(Errc::unsupported_syntax,
                      "\"" + response.url + "\": expected RDF, found " + (type.empty() ? "no Content-Type" : "\"" + type.substr(0, 100) + "\""));
  }
  rdf::ReadOptions read;
  const std::string base(document_of(response.url));
  read.base = base;
  read.max_triples = options.limits.max_triples;
  read.contexts = &options.contexts;
  Result<Graph> graph = rdf::read(response.body, *syntax, read);
  if (!graph) {
    Error error = std::move(graph).error();
    error.message = "\"" + response.url + "\": " + error.message;
    return unexpected(std::move(error));
  }
  auto result = with_fields_of(response);
  result->graph = *std::move(graph);
  result->focus = find_focus(result->graph, base);
  return RepresentationPtr(std::move(result));
}

std::optional<std::string> plain_text_of(const Graph& graph, TermId focus, std::string_view media_type) {
  std::optional<TermView> literal;
  for (const Triple& t : graph.match(focus, std::nullopt, std::nullopt)) {
    if (!graph.term(t.object).is_literal()) continue;
    if (literal) return std::nullopt;
    literal = graph.term(t.object);
  }
  if (!literal) return std::nullopt;
  if (media_type == "text/plain") return std::string(literal->text);
  if (media_type != "application/json") return std::nullopt;
  const bool is_number = rdf::lexical::parse_double(literal->text) && literal->datatype != vocab::xsd::string.text;
  const bool is_json = is_number && rdf::json::Document::parse(literal->text, {2, 1, false});
  if (is_json || (literal->datatype == vocab::xsd::boolean.text && (literal->text == "true" || literal->text == "false")))
    return std::string(literal->text);
  return json_string(literal->text);
}

}  // namespace v0
}  // namespace lrt::client
