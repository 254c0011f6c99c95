// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/documents.hpp"

#include <algorithm>

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/engine/description.hpp"
#include "src/engine/identity.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/dataset.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/structure.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/stop_state.hpp"
#include "src/engine/terms.hpp"
#include "src/engine/vocabulary.hpp"

namespace lrt::engine {

namespace {
constexpr std::string_view title = "Robotic Things";
}

void RootResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  const EngineOptions& options = d.engine.options;
  about.texts(vocab::dcterms::title, options.title.empty() ? rdf::Texts(std::string(title), "en") : options.title);
  about.texts(vocab::dcterms::description, options.description);
  about.link(vocab::rdfs::seeAlso, d.base + terms_).link(vocab::rdfs::seeAlso, d.base + VocabularyResource::location);
  about.link(vocab::rdfs::seeAlso, d.base + DatasetResource::location);
  about.link(vocab::lrt_::structure, d.base + StructureResource::location);
  about.link(vocab::lrt_::all, d.base + all_.path);  // also if there are no Things: a client may see none of those that there are
  if (!query_.empty()) about.link(vocab::lrt_::query, d.base + query_);
  for (const ActionResource* stop : stops()) {
    about.link(vocab::lrt_::stop, d.base + stop->path);
    describe_types_of(*stop, d);
  }
  for (const StopState* state : stop_states()) {
    about.link(vocab::lrt_::stopState, d.base + state->shown.path);
    state->shown.describe(d);
  }
  describe_container(about, *this, d);
  describe_identity(d.base + path, d);
}

std::vector<const StopState*> RootResource::stop_states() const {
  std::vector<const StopState*> all;
  for (const auto& entry : registry_.things())
    if (entry.second->stop_state) all.push_back(entry.second->stop_state);
  return all;
}

std::vector<const ActionResource*> RootResource::stops() const {
  std::vector<const ActionResource*> all;
  for (const auto& entry : registry_.things())
    for (const auto& action : entry.second->actions)
      if (action->spec->stop) all.push_back(action.get());
  return all;
}

void RootResource::describe_types(About& about, const Description&) const { describe_container_types(about); }

void RootResource::overview(Overview& o) const {
  const EngineOptions& options = o.options();
  if (options.title.empty()) o.text("title", title);
  o.words({options.title, options.description});
  if (!options.identity.iri.empty()) o.json("identity", json_of(options.identity));
  if (const Resource* const structure = registry_.find(StructureResource::location)) o.link("structure", *structure);
  o.link("all", all_);
  auto all = stops();
  all.erase(std::remove_if(all.begin(), all.end(), [&](const ActionResource* stop) { return !o.sees(*stop); }), all.end());
  if (!all.empty()) {
    o.begin_array("stops");
    for (const ActionResource* stop : all) o.link({}, *stop);
    o.end_array();
  }
  write_stop_states(o, stop_states());
  o.members("things", *this);
}

void RootResource::link_related(http::LinkWriter& links, const std::string& base) const {
  if (!session_.empty()) links.add(base + session_, vocab::lrt_::session.text);
  if (!query_.empty()) links.add(base + query_, vocab::lrt_::query.text);
  links.add(base + StructureResource::location, vocab::lrt_::structure.text);
  links.add(base + all_.path, "related");
  links.add(base + all_.path, vocab::lrt_::all.text);
}

std::vector<Resource*> RootResource::members() const {
  std::vector<Resource*> all;
  for (ThingNode* root : registry_.roots()) all.push_back(&root->self);
  return all;
}

std::vector<Resource*> RootResource::members(const Audience& audience) const {
  std::vector<Resource*> all;
  for (ThingNode* root : seen_things(registry_.roots(), audience)) all.push_back(&root->self);
  return all;
}

void TermsResource::describe(const Description& d) const {
  rdf::ReadOptions options;
  options.base = vocab::lrt_::state.text.substr(0, vocab::lrt_::state.text.find('#'));
  if (const Result<rdf::Graph> terms = rdf::read(term_list(), rdf::Syntax::turtle, options)) d.graph.merge(*terms);
}

}  // namespace lrt::engine
