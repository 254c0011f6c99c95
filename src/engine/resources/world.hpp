// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/engine/audience_numbers.hpp"
#include "src/engine/graph_task.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/model/graph_state.hpp"

namespace lrt::engine {

class WorldResource;

/// A named graph of a World. Its representations are its triples and those of the values that are published in it. Its World describes
/// the graph itself.
class WorldGraphResource final : public ValueResource, public OwnRepresentation, private HostContent {
 public:
  /// @param is_created  a client has made it, and may remove it
  WorldGraphResource(WorldResource& world, std::shared_ptr<model::GraphState> state, bool is_created);
  ~WorldGraphResource() override;

  Methods methods() const noexcept override;
  Outcome put(Context& context, Parts& parts) override;
  /// Adds the triples of the body (SPARQL 1.1 Graph Store Protocol 5.5).
  Outcome post(Context& context, Parts& parts) override;
  Outcome patch(Context& context, Parts& parts) override;
  /// A graph of the integrator is emptied, a graph of a client is removed.
  Outcome remove(Context& context, Parts& parts) override;
  Input input(const EngineOptions& options) const override;
  bool is_up_to_date() const noexcept override { return true; }

  void describe(const Description& d) const override;
  void describe_controls(About&, const Description&) const override {}
  void describe_types(About& about, const Description& d) const override;
  /// Its triples in the document of its World.
  void describe_as_member(About& about, const Description& d) const;
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{vocab::lrt_::WorldGraph};
    static constexpr ResourceKind kind{"graph", Trait::fixed_links, &observable};
    return kind;
  }
  const OwnRepresentation* own_representation() const noexcept override { return this; }
  void summarize(Overview& o) const override;
  std::uint64_t state(std::uint64_t) const noexcept override { return revision; }
  std::string entity_tag(std::string_view media_type, const std::string& base, const Audience& audience, bool for_write) const override;
  std::string for_write(std::string field) const override;

  Reads reads() const noexcept override { return Reads::values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;
  void for_each_host_content(FunctionRef<void(HostContent&)> visit) const override;
  void refresh() override;
  void set_observed(bool observed, ChangeScanner& scanner) override;

  /// Its triples, with those of published values; IRIs of this server stand below placeholder_base. It never changes. Costs a copy only if values are
  /// published and one has changed since the last call.
  std::shared_ptr<const rdf::Graph> graph(const EngineView& view) const;
  std::shared_ptr<const rdf::Graph> kept_graph(const EngineView& engine) const override { return graph(engine); }
  bool is_of_users() const noexcept override { return published_.empty(); }
  Result<void> check() const override;
  bool is_change_for(const QueryDependencies& query, const std::string& base) const override;
  /// The same without published values.
  const std::shared_ptr<const rdf::Graph>& stored() const noexcept { return version_.graph; }
  /// The bytes of the IRIs and literals of stored(), written in full at each occurrence.
  std::size_t stored_bytes() const noexcept { return version_.bytes; }

  using ValueResource::change_number;
  std::uint64_t change_number(const Audience& audience) const override {
    return audience.hides_something() ? numbers_.of(audience) : change_number();
  }
  /// Applies the changes of other threads.
  void take_changes(Parts& parts);
  /// The body of a request that wanted to create this graph, which another request has created meanwhile.
  /// @pre Context::judged
  Outcome take_new(Context& context, Parts& parts);
  /// Called after its registration: changes by code arrive from now on.
  void attach(Parts& parts);
  /// Called before its removal.
  void removed(Parts& parts);

  WorldResource& world;
  const std::shared_ptr<model::GraphState> graph_state;
  const bool is_created;

 private:
  struct Published {
    std::unique_ptr<PropertyResource> resource;
    std::string predicate, object;
  };
  // HostContent, if its content is in a store of the host.
  const Resource& resource() const noexcept override { return *this; }
  bool is_read_each_time() const noexcept override;
  bool has_fault() const override;
  void read(UniqueFunction<void(const Result<void>&, TimePoint)> done) override;

  Outcome write(Context& context, Parts& parts, model::GraphWrite::Kind kind);
  Outcome execute(Context& context, Parts& parts, GraphTask task);
  Outcome changed(const Context& context, Parts& parts, Body& accepted) const;
  void count_change(SeenBy seen) override { numbers_.count(seen); }
  /// For the entity tag of its JSON, which says what its reader may do with it and with its World: four digits.
  std::string rights_digits(const Audience& audience) const;
  /// For the entity tag: a digest of the published values that the audience sees. Empty if there are none.
  std::string published_digits(const Audience& audience) const;
  bool take_published(Parts& parts, std::vector<std::string>& gone);
  void add_published(const model::PublishedSpec& spec, Parts& parts);
  void remove_published(Published& published, Parts& parts);
  void describe_published(const Description& d) const;

  model::GraphState::Version version_;
  /// The graph before the change that is being reported, if nothing else has changed.
  std::shared_ptr<const rdf::Graph> before_;
  std::string epoch_;  ///< of entity tags: another one after a restart
  std::vector<Published> published_;
  const Clock* clock_ = nullptr;                                                                  ///< set by attach()
  const EngineView* view_ = nullptr;                                                              ///< set by attach()
  Parts* parts_ = nullptr;                                                                        ///< set by attach()
  std::shared_ptr<std::atomic<bool>> changes_wait_ = std::make_shared<std::atomic<bool>>(false);  ///< a message for take_changes() is queued
  mutable std::shared_ptr<const rdf::Graph> whole_;                                               ///< graph(), with the revision that it had
  mutable std::uint64_t whole_revision_ = 0;
  AudienceNumbers numbers_;
};

/// All graphs of a World that the reader sees, as one graph (`?default`).
class AllGraphsResource final : public ValueResource {
 public:
  AllGraphsResource(WorldResource& its_world, std::string its_path);
  void describe(const Description& d) const override;
  void describe_controls(About&, const Description&) const override {}
  void describe_types(About& about, const Description& d) const override;
  std::vector<const Resource*> described_resources(const Audience& audience) const override;
  const Variants& variants() const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"graphs"};
    return kind;
  }
  std::uint64_t state(std::uint64_t structure) const noexcept override;
  std::size_t max_bytes(const EngineOptions& options) const noexcept override;
  bool exceeds(std::size_t max_bytes, const Audience& audience) const override;
  Reads reads() const noexcept override { return Reads::values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;
  void for_each_host_content(FunctionRef<void(HostContent&)> visit) const override;
  void refresh() override;

 private:
  WorldResource& world_;
};

/// A placeholder for graphs that do not exist yet: a PUT or POST creates one.
class NewGraphResource final : public Resource {
 public:
  NewGraphResource(WorldResource& its_world, std::string its_path);
  Methods methods() const noexcept override;
  Outcome put(Context& context, Parts& parts) override;
  Outcome post(Context& context, Parts& parts) override { return put(context, parts); }
  Input input(const EngineOptions& options) const override;
  void describe(const Description&) const override {}
  void describe_types(About&, const Description&) const override {}
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"graph", Trait::placeholder};
    return kind;
  }

 private:
  WorldResource& world_;
};

/// A World: a Thing that is the container of its graphs, and a graph store.
class WorldResource final : public ThingResource, public Container, public GraphStore {
 public:
  WorldResource(const std::string& its_path, ThingNode* its_thing, const model::WorldSpec& its_spec);
  ~WorldResource() override;

  Methods methods() const noexcept override;
  /// A new graph, whose name the server chooses (SPARQL 1.1 Graph Store Protocol 5.5). The named graphs of a document are added to the graphs with
  /// these names.
  Outcome post(Context& context, Parts& parts) override;
  /// Replaces or creates the named graphs of a document. Others stay.
  Outcome put(Context& context, Parts& parts) override;
  Input input(const EngineOptions& options) const override;
  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{vocab::hybrit::RoboticThing};
    static constexpr ResourceKind kind{"world", Trait::none, &observable};
    return kind;
  }
  void overview(Overview& o) const override;
  void link_related(http::LinkWriter& links, const std::string& base) const override;
  std::uint64_t state(std::uint64_t structure) const noexcept override;
  const Container* container() const noexcept override { return this; }
  using Container::members;
  std::vector<Resource*> members() const override;
  void describe_member(const Resource& member, About& about, const Description& d) const override;
  std::vector<Resource*> more_resources() override;
  /// Without the shapes of hidden graphs.
  std::optional<std::vector<std::string>> shapes_seen_by(const Audience& audience) const override;
  using Resource::graph_store;
  GraphStore* graph_store() noexcept override { return this; }
  Result<Resource*> find_graph(std::string_view target, const Context& context, const Parts& parts) override;
  Resource* new_graph(std::string_view at, const Audience& audience, const Parts& parts) override;
  std::optional<std::size_t> max_put_bytes(const Audience& audience) const override;

  const std::vector<std::unique_ptr<WorldGraphResource>>& graphs() const noexcept { return graphs_; }
  void attach(Parts& parts) override;
  void removed(Parts& parts) override;
  /// Makes a graph at a path, with the body of a request: 201.
  /// @param graph  that was read from the body before
  Outcome make_graph(Context& context, Parts& parts, const std::string& at, std::optional<rdf::Graph> graph = std::nullopt);
  /// @pre WorldGraphResource::is_created
  void remove_graph(WorldGraphResource& graph, Parts& parts);
  /// The path that a request names for a new graph; empty: none that a graph of this World could have.
  std::string named_path(std::string_view target, const Parts& parts) const;
  bool takes_graphs() const noexcept { return spec.created != nullptr; }

  const model::WorldSpec& spec;

  using Resource::change_number;
  std::uint64_t change_number(const Audience& audience) const override { return numbers_.of(audience); }

 private:
  void count_change(SeenBy seen) override { numbers_.count(seen); }
  bool is_free(std::string_view at, const Parts& parts) const;
  WorldGraphResource* graph_at(std::string_view at) const noexcept;
  /// The canonical path of a graph that this World could have; empty: it could not.
  std::string path_below(const std::string& named) const;
  /// The limits of a document of several graphs: the largest of those of the graphs that clients may write, as far as the audience sees them.
  GraphOptions dataset_limits(const Audience& audience) const;
  Outcome take_dataset(Context& context, Parts& parts, const std::string& one_path);
  /// Finds the graphs of a document. Each is judged as a request that only changes it.
  std::optional<http::Response> plan(const Context& context, const Parts& parts, DatasetChange& change) const;
  void remove_last(std::size_t count, Parts& parts);
  Outcome commit(Context& context, Parts& parts, const std::shared_ptr<DatasetChange>& change);
  /// @return  nullopt: the graphs are not what they were when the change was planned
  std::optional<std::vector<WorldGraphResource*>> graphs_of(const DatasetChange& change, Parts& parts);

  std::vector<std::unique_ptr<WorldGraphResource>> graphs_;
  AllGraphsResource all_;
  NewGraphResource new_;
  std::size_t created_ = 0;
  AudienceNumbers numbers_;
};

}  // namespace lrt::engine
