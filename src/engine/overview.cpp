// SPDX-License-Identifier: Apache-2.0
#include "src/engine/overview.hpp"

#include <algorithm>

#include <lrt/engine/engine.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/context.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/rdf/plain.hpp"
#include "src/rdf/plain_schema.hpp"

namespace lrt::engine {

Overview::Overview(const EngineView& engine, std::size_t base, const Audience& audience, std::size_t page, ChosenTexts& texts)
    : engine_(engine), base_(engine.bases[base]), audience_(audience), page_(page), texts_(texts) {}

std::string Overview::of(const Resource& resource) {
  begin_object({});
  summary(resource);
  if (const std::string up = resource.up(audience_); !up.empty()) {
    if (const Resource* parent = engine_.registry.find(up)) link("parent", *parent);
  }
  resource.overview(*this);
  end_object();
  return std::move(out_);
}

void Overview::summary(const Resource& resource) {
  text("href", iri(resource));
  text("kind", resource.kind().name);
  begin_array("methods");
  const Methods methods = audience_.methods(resource);
  for (const char* method : {"GET", "HEAD", "OPTIONS"}) text({}, method);
  if (methods.put) text({}, "PUT");
  if (methods.post) text({}, "POST");
  if (methods.remove) text({}, "DELETE");
  if (methods.patch) text({}, "PATCH");
  end_array();
  resource.summarize(*this);
}

void Overview::link(std::string_view key, const Resource& to) {
  if (!audience_.sees(to)) return;
  begin_object(key);
  summary(to);
  end_object();
}

void Overview::link(std::string_view key, const std::string& href, std::string_view kind) {
  begin_object(key);
  text("href", href);
  text("kind", kind);
  end_object();
}

void Overview::members(std::string_view key, const Resource& container) {
  const std::vector<Resource*> all = container.container()->members(audience_);
  number("count", all.size());
  if (page_ == minimal_page) return;
  const std::size_t size = engine_.options.max_page_members;
  const std::size_t first = std::min(all.size(), (page_ - 1) * size), last = std::min(all.size(), first + size);
  begin_array(key);
  for (std::size_t i = first; i < last; ++i) link({}, *all[i]);
  end_array();
  pages_around(container, page_, page_count(all.size(), size));
}

void Overview::pages_around(const Resource& resource, std::size_t page, std::size_t pages) {
  const auto add = [&](std::string_view name, std::size_t n) {
    begin_object(name);
    text("href", variant_iri(iri(resource), rdf::media_type(rdf::Plain::json), n));
    end_object();
  };
  if (page > 1) add("previous", page - 1);
  if (page < pages) add("next", page + 1);
}

void Overview::text(std::string_view key, std::string_view value) {
  if (value.empty()) return;
  separate(key);
  out_ += http::json_string(value);
}

void Overview::texts(std::string_view key, const std::vector<std::string>& values) {
  if (values.empty()) return;
  begin_array(key);
  for (const std::string& v : values) text({}, v);
  end_array();
}

void Overview::words(const rdf::Words& words) {
  if (const rdf::Text* title = texts_.choose(words.titles)) text("title", title->text);
  if (const rdf::Text* description = texts_.choose(words.descriptions)) text("description", description->text);
}

void Overview::all_words(const rdf::Words& words) {
  all_texts("title", "titles", words.titles);
  all_texts("description", "descriptions", words.descriptions);
}

void Overview::all_texts(std::string_view one, std::string_view several, const rdf::Texts& texts) {
  const rdf::Text* const chosen = texts_.choose(texts);
  if (!chosen) return;
  text(one, chosen->text);
  if (texts.size() == 1) return;
  begin_object(several);
  for (auto t = texts.begin(); t != texts.end(); ++t) {
    const auto is_same = [&](const rdf::Text& other) { return other.language == t->language; };
    if (std::none_of(texts.begin(), t, is_same)) text(t->language.empty() ? "@none" : std::string_view(t->language), t->text);
  }
  end_object();
}

void Overview::types(const std::vector<std::string>& classes, const rdf::Type* type) {
  std::vector<std::string> all = classes;
  if (type)
    for (const std::string& c : type->classes) {
      std::string iri = rdf::term_iri(c, vocabulary());
      if (std::find(all.begin(), all.end(), iri) == all.end()) all.push_back(std::move(iri));
    }
  texts("types", all);
}

void Overview::json(std::string_view key, std::string_view written) {
  separate(key);
  out_ += written;
}

void Overview::schema(std::string_view key, const rdf::Type* type, const rdf::Facets& facets) {
  if (!type) return;
  const auto choose = [this](const rdf::Texts& texts) { return texts_.choose(texts); };
  const rdf::ChooseText chosen = choose;  // refers to it
  json(key, rdf::write_schema(*type, facets, &chosen));
}

void Overview::described(const std::vector<Statement>& statements, const std::vector<std::string>& classes, const rdf::Type* type) {
  words({model::texts_of(statements, vocab::dcterms::title), model::texts_of(statements, vocab::dcterms::description)});
  types(classes, type);
}

std::string Overview::iri(const Object& object) const {
  rdf::Graph graph;
  return std::string(graph.term(object_term(graph, object, base_)).text);
}

void Overview::separate(std::string_view key) {
  if (!out_.empty() && out_.back() != '{' && out_.back() != '[') out_ += ',';
  if (key.empty()) return;
  out_ += http::json_string(key);
  out_ += ':';
}

void Overview::begin(std::string_view key, char bracket) {
  separate(key);
  out_ += bracket;
}

}  // namespace lrt::engine
