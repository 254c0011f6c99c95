// SPDX-License-Identifier: Apache-2.0
#include "src/redland/terms.hpp"

#include <utility>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/redland.hpp>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/limits.hpp"
#include "src/rdf/n_triples.hpp"

namespace lrt::redland {

namespace {

/// librdf 1.0.17 makes an empty literal of one that begins with a NUL.
bool becomes_another(const rdf::TermView& term) noexcept { return term.is_literal() && !term.text.empty() && term.text.front() == 0; }

const unsigned char* bytes_of(const std::string& text) noexcept { return reinterpret_cast<const unsigned char*>(text.c_str()); }
std::string_view text_of(const unsigned char* bytes, std::size_t size) noexcept { return {reinterpret_cast<const char*>(bytes), bytes ? size : 0}; }

/// Of at most 200 bytes, for a sentence.
std::string shown(std::string_view text) {
  constexpr std::size_t most = 200;
  if (utf8::find_invalid(text)) return "bytes that are not UTF-8";
  if (text.size() <= most) return "\"" + std::string(text) + "\"";
  return "\"" + std::string(utf8::prefix(text, most)) + "...\"";
}

std::string_view uri_text(librdf_uri* uri) {
  std::size_t size = 0;
  const unsigned char* const text = librdf_uri_as_counted_string(uri, &size);
  return text_of(text, size);
}

/// Why it is no IRI of RDF 1.1; empty: it is one.
std::string iri_fault(std::string_view iri) {
  if (iri.size() > rdf::max_iri) return "an IRI of more than " + std::to_string(rdf::max_iri) + " bytes";
  if (utf8::find_invalid(iri)) return "an IRI of ill-formed UTF-8";
  if (!iri::is_absolute(iri)) return "a URI that is no absolute IRI, " + shown(iri);
  return {};
}

}  // namespace

std::optional<rdf::TermView> view_of(librdf_node* node, std::string& text, std::string& fault) {
  const auto fails = [&](std::string why) {
    fault = std::move(why);
    return std::nullopt;
  };
  if (!node) return fails("a statement without one of its nodes");
  std::size_t size = 0;
  switch (librdf_node_get_type(node)) {
    case LIBRDF_NODE_TYPE_RESOURCE: {
      const std::string_view iri = uri_text(librdf_node_get_uri(node));
      if (std::string why = iri_fault(iri); !why.empty()) return fails(std::move(why));
      return rdf::iri(iri);
    }
    case LIBRDF_NODE_TYPE_BLANK: {
      const unsigned char* const id = librdf_node_get_counted_blank_identifier(node, &size);
      return rdf::blank(text_of(id, size));
    }
    case LIBRDF_NODE_TYPE_LITERAL: {
      const unsigned char* const value = librdf_node_get_literal_value_as_counted_string(node, &size);
      const std::string_view lexical = text_of(value, size);
      if (utf8::find_invalid(lexical)) return fails("a literal of ill-formed UTF-8");
      librdf_uri* const datatype = librdf_node_get_literal_value_datatype_uri(node);
      const char* const language = librdf_node_get_literal_value_language(node);
      if (language && *language != 0) {
        const std::string_view tag = language;
        if (datatype && uri_text(datatype) != vocab::rdf_::langString.text) return fails("a literal with a language and a datatype");
        if (!rdf::is_language_tag(tag)) return fails("a literal whose language is no tag, " + shown(tag));
        text.assign(tag);
        for (char& c : text) c = lrt::detail::lower(c);
        return rdf::tagged_literal(lexical, text);
      }
      if (!datatype) return rdf::literal(lexical);
      const std::string_view iri = uri_text(datatype);
      if (iri == vocab::rdf_::langString.text) return fails("a literal of rdf:langString without a language");
      if (std::string why = iri_fault(iri); !why.empty()) return fails("a literal whose datatype is " + why);
      return rdf::literal(lexical, Iri(iri));
    }
    default: return fails("a node that is no resource, literal or blank node");
  }
}

std::string_view Labels::label_of(std::string_view id) {
  constexpr std::string_view made = "n-";  // librdf and lrt::rdf begin none like this
  if (const auto known = by_id_.find(std::string(id)); known != by_id_.end()) return known->second;
  const bool stays = rdf::is_plain_label(id) && id.substr(0, made.size()) != made;
  if (stays && by_label_.count(std::string(id)) == 0) return id;
  std::string label;
  do label = std::string(made) + std::to_string(next_++);
  while (by_label_.count(label) != 0);
  return bind(std::string(id), std::move(label));
}

std::string_view Labels::bind(std::string id, std::string label) {
  if (const auto before = by_label_.find(label); before != by_label_.end()) {
    by_id_.erase(before->second);
    by_label_.erase(before);
  }
  by_label_[label] = id;
  return by_id_[std::move(id)] = std::move(label);
}

std::string new_identifier(librdf_world* world) {
  const NodePointer node(librdf_new_node_from_blank_identifier(world, nullptr));
  if (!node) return {};
  std::size_t size = 0;
  const unsigned char* const id = librdf_node_get_counted_blank_identifier(node.get(), &size);
  return std::string(text_of(id, size));
}

inline namespace v0 {

Result<rdf::Term> to_term(librdf_node* node) {
  std::string text, fault;
  const std::optional<rdf::TermView> view = view_of(node, text, fault);
  if (!view) return unexpected(Errc::expected_rdf, "expected a term of RDF 1.1, found " + fault);
  return rdf::Term(*view);
}

librdf_node* to_node(librdf_world* world, const rdf::TermView& term) {
  const std::string text(term.text);  // librdf wants a 0 behind it
  switch (term.kind) {
    case rdf::TermKind::iri: return librdf_new_node_from_counted_uri_string(world, bytes_of(text), text.size());
    case rdf::TermKind::blank: return librdf_new_node_from_counted_blank_identifier(world, bytes_of(text), text.size());
    case rdf::TermKind::literal: break;
  }
  if (becomes_another(term)) return nullptr;
  if (!term.language.empty()) {
    const std::string tag(term.language);
    return librdf_new_node_from_typed_counted_literal(world, bytes_of(text), text.size(), tag.c_str(), tag.size(), nullptr);
  }
  UriPointer datatype;
  if (term.datatype != rdf::literal({}).datatype) {
    const std::string iri(term.datatype);
    datatype.reset(librdf_new_uri2(world, bytes_of(iri), iri.size()));
    if (!datatype) return nullptr;
  }
  return librdf_new_node_from_typed_counted_literal(world, bytes_of(text), text.size(), nullptr, 0, datatype.get());
}

librdf_statement* to_statement(librdf_world* world, const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object) {
  NodePointer s(to_node(world, subject)), p(to_node(world, predicate)), o(to_node(world, object));
  if (!s || !p || !o) return nullptr;
  return librdf_new_statement_from_nodes(world, s.release(), p.release(), o.release());  // which frees them also if it fails
}

}  // namespace v0

namespace {

/// @param rows  gets the number of statements
Result<Converted> read_stream(librdf_stream* stream, const GraphLimits& limits, std::size_t& rows) {
  Converted made;
  if (!stream) return unexpected(Errc::failed, "the storage returns no stream of its statements");
  Labels labels;
  std::string texts[3], fault;
  for (; librdf_stream_end(stream) == 0; librdf_stream_next(stream), ++rows) {
    librdf_statement* const statement = librdf_stream_get_object(stream);
    if (!statement) return unexpected(Errc::failed, "the storage returns a stream that breaks off");
    librdf_node* const nodes[3] = {librdf_statement_get_subject(statement), librdf_statement_get_predicate(statement),
                                   librdf_statement_get_object(statement)};
    std::optional<rdf::TermView> views[3];
    fault.clear();
    for (int i = 0; i < 3 && fault.empty(); ++i) views[i] = view_of(nodes[i], texts[i], fault);
    if (fault.empty() && views[0]->is_literal()) fault = "a literal as subject";
    if (fault.empty() && !views[1]->is_iri()) fault = "a predicate that is no IRI";
    if (!fault.empty()) {
      if (limits.refuses_foreign_terms) return unexpected(Errc::expected_rdf, "expected statements of RDF 1.1, found " + fault);
      ++made.left_out;
      continue;
    }
    rdf::TermId ids[3];
    for (int i = 0; i < 3; ++i) {
      if (views[i]->is_blank()) ids[i] = made.graph.intern(rdf::blank(labels.label_of(views[i]->text)));
      else ids[i] = made.graph.intern(*views[i]);
    }
    made.graph.add(ids[0], ids[1], ids[2]);
    if (made.graph.size() > limits.max_triples)
      return unexpected(Errc::limit_exceeded, "the model has more than " + std::to_string(limits.max_triples) + " statements");
  }
  return made;
}

}  // namespace

inline namespace v0 {

Result<Converted> to_graph(librdf_stream* stream, const GraphLimits& limits) {
  std::size_t rows = 0;
  return read_stream(stream, limits, rows);
}

Result<Converted> to_graph(librdf_model* model, const GraphLimits& limits) {
  const StreamPointer stream(librdf_model_as_stream(model));
  std::size_t rows = 0;
  Result<Converted> made = read_stream(stream.get(), limits, rows);
  const int size = librdf_model_size(model);
  if (made && size > 0 && rows < static_cast<std::size_t>(size))
    return unexpected(Errc::failed, "the storage has " + std::to_string(size) + " statements and returns " + std::to_string(rows));
  return made;
}

namespace {

/// The state of a stream over a graph.
struct Walk {
  librdf_world* world;
  std::shared_ptr<const rdf::Graph> graph;
  rdf::Graph::Matches all;
  rdf::Graph::Matches::iterator at;
  std::unordered_map<std::uint32_t, std::string> ids;  ///< of blank nodes
  StatementPointer statement{};

  Walk(librdf_world* w, std::shared_ptr<const rdf::Graph> g)
      : world(w), graph(std::move(g)), all(graph->match(std::nullopt, std::nullopt, std::nullopt)), at(all.begin()) {}
  Walk(const Walk&) = delete;
  Walk& operator=(const Walk&) = delete;
};

NodePointer node_in(Walk& walk, rdf::TermId id) {
  const rdf::TermView term = walk.graph->term(id);
  if (!term.is_blank()) return NodePointer(to_node(walk.world, term));
  std::string& own = walk.ids[static_cast<std::uint32_t>(id)];
  if (own.empty()) own = new_identifier(walk.world);
  return NodePointer(to_node(walk.world, rdf::blank(own)));
}

// Exceptions do not pass librdf, which is C.
int walk_is_over(void* context) {
  auto& walk = *static_cast<Walk*>(context);
  return walk.at == walk.all.end() ? 1 : 0;
}
int walk_on(void* context) {
  auto& walk = *static_cast<Walk*>(context);
  walk.statement.reset();
  if (walk.at != walk.all.end()) ++walk.at;
  return walk_is_over(context);
}
void* walk_here(void* context, int what) {
  auto& walk = *static_cast<Walk*>(context);
  if (what != LIBRDF_STREAM_GET_METHOD_GET_OBJECT || walk.at == walk.all.end()) return nullptr;
  if (!walk.statement) try {
      NodePointer s = node_in(walk, walk.at->subject), p = node_in(walk, walk.at->predicate), o = node_in(walk, walk.at->object);
      if (!s || !p || !o) return nullptr;
      walk.statement.reset(librdf_new_statement_from_nodes(walk.world, s.release(), p.release(), o.release()));
    } catch (...) { return nullptr; }
  return walk.statement.get();
}
void walk_ends(void* context) { delete static_cast<Walk*>(context); }

}  // namespace

librdf_stream* to_stream(librdf_world* world, std::shared_ptr<const rdf::Graph> graph) {
  // For librdf a stream without an object is at its end.
  for (std::size_t id = 0; id < graph->term_count(); ++id)
    if (becomes_another(graph->term(static_cast<rdf::TermId>(id)))) return nullptr;
  auto walk = std::make_unique<Walk>(world, std::move(graph));
  librdf_stream* const stream = librdf_new_stream(world, walk.get(), walk_is_over, walk_on, walk_here, walk_ends);
  if (stream) (void)walk.release();  // NOLINT(bugprone-unused-return-value): walk_ends() frees it
  return stream;
}

Result<std::size_t> add(librdf_model* model, const rdf::Graph& graph) {
  librdf_world* const world = librdf_storage_get_world(librdf_model_get_storage(model));
  const std::shared_ptr<const rdf::Graph> borrowed(&graph, [](const rdf::Graph*) {});
  const StreamPointer stream(to_stream(world, borrowed));
  if (!stream) return unexpected(Errc::failed, "librdf takes no literal that begins with a NUL, or has no memory; nothing was added");
  const bool is_transaction = librdf_model_transaction_start(model) == 0;
  std::size_t count = 0;
  const auto fails = [&](const std::string& why) {
    if (is_transaction) librdf_model_transaction_rollback(model);
    return unexpected(Errc::failed, why + (is_transaction ? "; nothing was added" : "; " + std::to_string(count) + " statements before it were"));
  };
  for (; librdf_stream_end(stream.get()) == 0; librdf_stream_next(stream.get()), ++count) {
    librdf_statement* const statement = librdf_stream_get_object(stream.get());
    if (!statement) break;
    if (librdf_model_add_statement(model, statement) != 0) return fails("the storage refuses a statement");
  }
  if (count != graph.size()) return fails("librdf makes no statement of a triple");
  if (is_transaction && librdf_model_transaction_commit(model) != 0) return fails("the storage does not commit");
  return count;
}

}  // namespace v0
}  // namespace lrt::redland
