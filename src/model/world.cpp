// SPDX-License-Identifier: Apache-2.0
#include <lrt/world.hpp>

#include <algorithm>
#include <utility>

#include <lrt/base/iri.hpp>

#include "src/model/graph_state.hpp"
#include "src/model/spec.hpp"
#include "src/rdf/words.hpp"

namespace lrt {
inline namespace v0 {

// ---------------------------------------------------------------------------------------------------------------- update

GraphUpdate& GraphUpdate::add(std::string_view subject, Iri predicate, const Object& object) {
  const rdf::Term term = edit_.term_of(object);
  return add(rdf::iri(subject), predicate, term.view());
}

GraphUpdate& GraphUpdate::add(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object) {
  edit_.add(subject, predicate, object);
  return *this;
}

GraphUpdate& GraphUpdate::add_turtle(std::string_view text) {
  edit_.add_turtle(text);
  return *this;
}

GraphUpdate& GraphUpdate::add(const rdf::Graph& graph) {
  edit_.merge(graph);
  return *this;
}

GraphUpdate& GraphUpdate::remove(std::string_view subject, Iri predicate, const Object& object) {
  const rdf::Term term = edit_.term_of(object);
  return remove(rdf::iri(subject), predicate, term.view());
}

GraphUpdate& GraphUpdate::remove(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object) {
  return remove_matching(&subject, &predicate, &object);
}

GraphUpdate& GraphUpdate::remove_matching(const rdf::TermView* subject, const rdf::TermView* predicate, const rdf::TermView* object) {
  edit_.remove(subject, predicate, object);
  return *this;
}

GraphUpdate& GraphUpdate::remove_node(std::string_view subject) {
  const std::string whole = edit_.resolved(subject);
  edit_.remove_node(rdf::iri(whole));
  return *this;
}

GraphUpdate& GraphUpdate::set(std::string_view subject, Iri predicate, const Object& object) {
  const rdf::TermView s = rdf::iri(subject), p = predicate;
  edit_.remove(&s, &p, nullptr);
  return add(subject, predicate, object);
}

GraphUpdate& GraphUpdate::clear() {
  edit_.clear();
  return *this;
}

const rdf::Graph& GraphUpdate::graph() { return edit_.graph(); }
std::size_t GraphUpdate::size() const noexcept { return edit_.size(); }

// ----------------------------------------------------------------------------------------------------------------- graph

Result<void> WorldGraph::apply(const std::function<void(GraphUpdate&)>& change) {
  if (!state_) return unexpected(Errc::closed, "the handle of the graph is empty: assign what World::graph returns");
  return state_->update([&change](model::GraphEdit& edit) {
    GraphUpdate update(edit);
    change(update);
  });
}

std::shared_ptr<const rdf::Graph> WorldGraph::snapshot() const { return state_ ? state_->version().graph : std::make_shared<const rdf::Graph>(); }

std::uint64_t WorldGraph::revision() const { return state_ ? state_->version().revision : 0; }

std::size_t WorldGraph::unsaved_changes() const { return state_ ? state_->unsaved() : 0; }

std::pair<std::shared_ptr<model::SlotBase>, std::function<void()>> WorldGraph::add_published(std::unique_ptr<model::SlotBase> slot,
                                                                                             const rdf::Type& type, std::string_view path,
                                                                                             Iri predicate, const PublishedOptions& options) {
  if (!state_) return {};
  const auto fails = [&](const std::string& why) {
    state_->report("the value \"" + std::string(path) + "\" is not published in the graph \"" + state_->path().substr(1) + "\": " + why);
    return std::pair<std::shared_ptr<model::SlotBase>, std::function<void()>>();
  };
  if (!iri::is_absolute(predicate.text)) return fails("expected an absolute IRI as predicate, found \"" + std::string(predicate.text) + "\"");
  const Result<std::string> below = model::encode_path(path);
  if (!below) return fails(below.error().message);
  const auto spec = std::make_shared<model::PropertySpec>();
  spec->type = &type;
  spec->facets.unit(options.unit);
  if (options.frame) spec->frame = std::make_unique<const Object>(*options.frame);
  if (options.expires_after.count() > 0) slot->set_every_sample();
  spec->slot = std::move(slot);
  spec->thing = state_->thing();
  const std::string& root = spec->thing->path;  // "world", of a graph at "/world/map"
  spec->path = state_->path().substr(root.size() + 2) + "/" + *below;
  std::string object = "#" + below->substr(0, below->find('/'));
  if (!state_->add_published({spec, std::string(predicate.text), std::move(object), options.expires_after}))
    return fails("the path \"" + spec->location().substr(1) + "\" is used by another value");
  return {{spec, spec->slot.get()}, [state = state_, spec] { state->remove_published(*spec); }};
}

// ----------------------------------------------------------------------------------------------------------------- world

WorldGraph World::graph(std::string_view path, GraphOptions options) {
  const auto fails = [this](Error error) {
    remember(std::move(error));
    return WorldGraph();
  };
  if (!spec_ || !spec_->world) return fails(model::moved_from());
  Result<std::string> encoded = model::encode_path(path);
  if (!encoded) return fails({encoded.error().code, "graph of world \"" + spec_->path + "\": " + encoded.error().message});
  const std::string whole = "/" + spec_->path + "/" + *encoded;
  for (const auto& other : spec_->world->graphs)
    if (other->path() == whole)
      return fails({Errc::duplicate_path, "path \"" + whole.substr(1) + "\" is taken by another graph: choose another name"});
  for (const auto& other : spec_->world->graphs)
    if (!options.file.empty() && other->options().file == options.file)
      return fails({Errc::invalid_option, "graph \"" + whole.substr(1) + "\": the file \"" + options.file + "\" is that of another graph"});
  if (Result<void> r = rdf::check_words({options.title, options.description}, "graph \"" + whole.substr(1) + "\""); !r)
    return fails(std::move(r).error());
  if (options.title.empty()) options.title = std::string(path.substr(path.rfind('/') + 1));
  if (!options.shapes.empty()) shapes(options.shapes);
  auto state = model::GraphState::create(whole, std::move(options), std::string(base) + "/" + spec_->path + "/blueprint", spec_->context());
  if (!state) return fails(std::move(state).error());
  spec_->world->graphs.push_back(*state);
  return WorldGraph(*std::move(state));
}

}  // namespace v0
}  // namespace lrt

namespace lrt::model {
inline namespace v0 {

Result<void> set_up_world(ThingSpec& thing, WorldOptions options, const WorldExtension& extension) {
  thing.world = std::make_shared<WorldSpec>(WorldSpec{extension, {}, {}, {}});
  WorldSpec& world = *thing.world;
  world.options = std::move(options);
  if (!world.options.clients_may_create) return {};
  GraphOptions& created = world.options.created;
  created.clients_may_write = true;
  created.file.clear();
  created.turtle.clear();
  auto rules = GraphState::create("/" + thing.path, created, std::string(World::base) + "/" + thing.path + "/blueprint", thing.context());
  if (!rules) return Unexpected{rules.error()};
  world.created = *std::move(rules);
  world.created->set_budget(std::make_shared<GraphBudget>(world.options.max_created_bytes));
  return {};
}

}  // namespace v0
}  // namespace lrt::model
