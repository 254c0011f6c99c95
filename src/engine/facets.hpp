// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::engine {
inline namespace v0 {
class About;
class Context;
class Resource;
enum class Protocol : std::uint8_t;
struct Audience;
struct Description;
struct EngineView;
struct Parts;
struct QueryDependencies;
}  // namespace v0

// Facets of resources: what only some kinds have. A resource that has one derives from it, and a function of Resource returns a pointer to it.

/// A container (LDP 5): a resource with members.
class Container {
 public:
  virtual std::vector<Resource*> members() const = 0;
  /// The members that an audience may see.
  virtual std::vector<Resource*> members(const Audience& audience) const;
  /// The triples of a member in the document of the container.
  virtual void describe_member(const Resource& member, About& about, const Description& d) const;

 protected:
  ~Container() = default;
};

/// A resource that is cut into pages and is no container, and that can be searched.
class Paged {
 public:
  /// How many pages it has, 1 or more.
  virtual std::size_t pages(const Audience& audience) const = 0;
  /// The resource with what a text finds in it. It exists until other texts are searched.
  /// @par Errors  for a 400
  virtual Result<Resource*> search(const std::string& text) = 0;

 protected:
  ~Paged() = default;
};

/// A resource that holds graphs.
class GraphStore {
 public:
  /// The resource that a request of the Graph Store Protocol names; nullptr: there is none.
  /// @param target  with parameters: ?graph=IRI, ?default
  /// @par Errors    for a 400: the parameters name no graph
  virtual Result<Resource*> find_graph(std::string_view target, const Context& context, const Parts& parts) = 0;
  /// The value of Accept-Put: media types of documents with named graphs.
  static std::string dataset_types();
  /// The resource that creates a graph at an unused path below; nullptr: none can be created, or not by this audience.
  virtual Resource* new_graph(std::string_view at, const Audience& audience, const Parts& parts) = 0;
  /// The bytes of the largest document that PUT takes from an audience; nullopt: it sees no graph that PUT changes.
  virtual std::optional<std::size_t> max_put_bytes(const Audience& audience) const = 0;

  /// While a change is reported: only the sizes of graphs have changed, which are in JSON and no triple.
  bool only_sizes_change = false;

 protected:
  ~GraphStore() = default;
};

/// A resource that responds to GET itself, and whose bodies are neither RDF nor values.
class OwnProtocol {
 public:
  /// The response to GET and HEAD. It judges Accept. nullopt: a representation is selected.
  virtual std::optional<Outcome> get(Context& context, Parts& parts) = 0;
  /// A GET that asks for a subscription.
  virtual Outcome subscribe(Context& context, Parts& parts, Protocol protocol) = 0;
  /// The value of Accept-Post; empty: it has none.
  virtual std::string_view posted_types() const noexcept = 0;

 protected:
  ~OwnProtocol() = default;
};

/// A resource with representations or entity tags that are not made from its description.
class OwnRepresentation {
 public:
  /// The bytes of a fixed document instead of a graph.
  virtual std::optional<std::string_view> document() const { return std::nullopt; }
  /// Its whole description, if it keeps that: with IRIs of this server below placeholder_base; otherwise nullptr.
  virtual std::shared_ptr<const rdf::Graph> kept_graph(const EngineView& engine) const {
    (void)engine;
    return nullptr;
  }
  /// kept_graph() has nothing but words of users: all who may read the resource are shown the same.
  virtual bool is_of_users() const noexcept { return false; }
  /// While a change is reported: whether it may have a triple that a query depends on.
  /// @param base  of the IRIs of this server in the query
  virtual bool is_change_for(const QueryDependencies& query, const std::string& base) const {
    (void)query, (void)base;
    return true;
  }
  /// The text of Variant::answer().
  virtual Result<Bytes> answer(std::size_t type) const {
    (void)type;
    throw std::logic_error("a resource has variants that are answers, and makes none");
  }
  /// unavailable: why there is no representation now.
  virtual Result<void> check() const { return {}; }
  /// False: its first representation is not available yet, and its observers wait for it.
  virtual bool has_representation() const noexcept { return true; }
  /// The entity tag of a resource that is too large to be encoded for a comparison; empty: the tag is computed from the bytes.
  /// @param for_write  only of the part that writes change: for If-Match of a write, tags that differ only in the rest are equal
  virtual std::string entity_tag(std::string_view media_type, const std::string& base, const Audience& audience, bool for_write) const {
    (void)media_type, (void)base, (void)audience, (void)for_write;
    return {};
  }
  /// The value of If-Match as entity_tag() for a write makes tags.
  virtual std::string for_write(std::string field) const { return field; }

 protected:
  ~OwnRepresentation() = default;
};

}  // namespace lrt::engine
