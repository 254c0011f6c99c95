// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/engine/handler.hpp>
#include <lrt/http/message.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

#include "src/base/function_ref.hpp"
#include "src/base/thin_vector.hpp"
#include "src/engine/audience.hpp"
#include "src/engine/facets.hpp"
#include "src/engine/resource_kind.hpp"
#include "src/engine/variants.hpp"
#include "src/http/link.hpp"
#include "src/subscription/backlog.hpp"

namespace lrt::model {
inline namespace v0 {
struct ResourceSpec;
}  // namespace v0
}  // namespace lrt::model

namespace lrt::engine {
inline namespace v0 {

struct Description;
struct ThingNode;
class About;
class ChangeLog;
class ChangeScanner;
struct EngineOptions;
class Overview;
class PropertyResource;
class Registry;
class Resource;
class SubscriptionsResource;
class ValueResource;

using Utc = std::chrono::system_clock::time_point;

/// Identifies a resource during the engine's lifetime, also after its removal. Never 0, never reused.
enum class ResourceId : std::uint64_t {};

/// Header fields that equal requests share. Their responses use the same bytes.
struct PreparedFields {
  http::Fields ok, not_modified;  ///< of a 200 and of a 304; empty: not made yet
  std::string_view upgrade{};     ///< value of Upgrade in them; empty: none

  std::size_t bytes() const noexcept { return ok.block().size() + not_modified.block().size(); }
};

/// The languages of the texts in a representation.
struct InLanguages {
  std::vector<std::string> offered;  ///< ChosenTexts::offered()
  std::string wanted;                ///< Languages::wanted_of() these, for the client that it was made for
  std::string language;              ///< value of Content-Language; empty: none
};

/// A representation as bytes with its header fields, kept while the resource's state and the cache's budget allow.
struct Representation {
  Resource* resource;
  std::size_t base;  ///< index of the base IRI it was made for
  Variant variant;
  std::size_t page;
  std::shared_ptr<const security::View> view;  ///< the rights that it was made for; nullptr: all rights
  std::string name;                            ///< the principal that it was made for, if it depends on the principal
  std::uint64_t state;                         ///< Resource::state() when it was made
  std::uint64_t structure;                     ///< Registry::structure() when it was made
  std::string tag;
  std::shared_ptr<const std::string> body;
  bool is_page = false;  ///< HTML
  http::Fields links{};  ///< those of the fields that only the structure changes, made for the first response
  PreparedFields prepared{};
  subscription::Item message{}, event{};           ///< for a WebSocket or callback, for an event stream; made for the first subscriber
  std::unique_ptr<const InLanguages> languages{};  ///< nullptr: none of its texts has one

  bool has_languages() const noexcept { return languages && !languages->offered.empty(); }

  std::size_t bytes() const noexcept {
    return sizeof *this + links.block().size() + prepared.bytes() + tag.size() + body->size() + (event ? event->body->size() : 0);
  }
};

/// Whether an audience sees what has changed of a resource that others see more of. It is called before the resource changes again.
using SeenBy = FunctionRef<bool(const Audience&)>;
inline constexpr auto seen_by_all = [](const Audience&) noexcept { return true; };

/// The interface by which a resource notifies its subscriptions. An observer for an audience ignores what that audience does not see.
class Observer {
 public:
  /// The variant of its notifications.
  virtual Variant variant() const noexcept = 0;
  /// The representations of the resource have changed.
  virtual void resource_changed(SeenBy seen) = 0;
  /// The representations are about to change: the last chance to encode the current ones.
  virtual void resource_changes(SeenBy seen) = 0;
  /// The robot published values that were overwritten before the engine saw them.
  virtual void values_missed(std::uint64_t count, SeenBy seen) = 0;
  /// The resource is about to be removed. The observer leaves the list of observers.
  virtual void resource_removed() = 0;
  /// It gets each change, not only the current state.
  virtual bool queues() const noexcept = 0;
  /// A read of a pulled property has failed after one that succeeded, or the opposite. Its representations are the same.
  virtual void readability_changed() {}
  /// Its triples in the resource's own document, as Resource::describe_controls().
  virtual void describe_controls(About& about, const Description& d) const { (void)about, (void)d; }

 protected:
  ~Observer() = default;
};

/// The methods that a resource allows besides GET, HEAD and OPTIONS (R0.5, R0.10).
struct Methods {
  bool put = false, post = false, remove = false, patch = false;

  /// The value of Allow.
  std::string text() const;
};

/// The bodies that a resource accepts for PUT, POST or PATCH.
struct Input {
  const rdf::Type* type = nullptr;  ///< of the value; nullptr: a body is RDF
  bool may_be_empty = false;        ///< an empty body is accepted, whatever its header fields are
  std::size_t max_bytes = std::numeric_limits<std::size_t>::max();
};

/// A value of a resource with its type, for representations without RDF. Valid until the resource changes.
struct PlainValue {
  const rdf::Type* type;
  const rdf::Facets* facets;
  const rdf::Value* kept;  ///< by the resource; nullptr: `made`
  rdf::Value made{};
  std::shared_ptr<const rdf::Type> made_type{};  ///< where `type` is not the resource's

  const rdf::Value& value() const noexcept { return kept ? *kept : made; }
};

/// Where the triples of one representation go, and what they depend on besides the resource.
struct Description {
  rdf::Graph& graph;
  const std::string& base;  ///< of all IRIs of this server
  std::size_t page;         ///< of a container
  const EngineView& engine;
  const Audience& audience;    ///< the triples that it may not see are removed later; values derived from hidden ones are the resource's task
  UserWords* words = nullptr;  ///< gets the triples that are not removed; nullptr: none is

  /// Calls a function that adds the words of a user to the graph: the content or the value of a resource.
  template <class F>
  void quote(const Resource& resource, F add) const {
    const std::size_t first = graph.size();
    add();
    if (words && audience.sees(resource)) words->emplace_back(first, graph.size());
  }
};

/// The suffix for a name of lrt that the user has given to another resource.
inline constexpr std::string_view name_aside = "-lrt";

/// A resource with a URI: its methods, description, links and bodies. A new kind of resource is one class derived from this, or from ValueResource.
/// What only some kinds have is a facet: a base class of those, or a constant of their kind. A function here returns a pointer to it, nullptr if
/// the resource has none.
///
/// Functions that act get the parts of the engine; functions that describe read only.
class Resource {
 public:
  /// @param named_by_lrt  Resource::lrt_name_end
  Resource(std::string resource_path, ThingNode* its_thing, std::size_t named_by_lrt = 0)
      : path(std::move(resource_path)), thing(its_thing), lrt_name_end(static_cast<std::uint32_t>(named_by_lrt)) {}
  virtual ~Resource() = default;
  Resource(const Resource&) = delete;
  Resource& operator=(const Resource&) = delete;

  /// What it has in common with the others of its kind.
  virtual const ResourceKind& kind() const noexcept = 0;

  // Facets.
  /// How clients observe it; nullptr: they cannot.
  const Observable* observable() const noexcept { return kind().observable; }
  /// The values in its representations.
  virtual ValueResource* values() noexcept { return nullptr; }
  const ValueResource* values() const noexcept { return const_cast<Resource*>(this)->values(); }
  virtual const Container* container() const noexcept { return nullptr; }
  virtual Paged* paged() noexcept { return nullptr; }
  const Paged* paged() const noexcept { return const_cast<Resource*>(this)->paged(); }
  virtual GraphStore* graph_store() noexcept { return nullptr; }
  const GraphStore* graph_store() const noexcept { return const_cast<Resource*>(this)->graph_store(); }
  virtual OwnProtocol* own_protocol() noexcept { return nullptr; }
  const OwnProtocol* own_protocol() const noexcept { return const_cast<Resource*>(this)->own_protocol(); }
  virtual const OwnRepresentation* own_representation() const noexcept { return nullptr; }

  // Its methods (R0.5).
  virtual Methods methods() const noexcept { return {}; }
  virtual Outcome put(Context& context, Parts& parts);
  virtual Outcome post(Context& context, Parts& parts);
  virtual Outcome remove(Context& context, Parts& parts);
  /// The body is in one of the patch_types() (RFC 5789).
  virtual Outcome patch(Context& context, Parts& parts);
  /// The media types of a PATCH, as a value of Accept-Patch.
  virtual std::string_view patch_types() const noexcept { return update_type; }
  virtual Input input(const EngineOptions& options) const;
  /// The fragment of the shape for its bodies, "rotation" or "actions/rotate/input".
  virtual std::string input_shape() const { return {}; }

  /// What the user has registered, if commands to this resource may move the robot; nullptr: they do not.
  virtual const model::ResourceSpec* command() const noexcept { return nullptr; }

  /// Whether an audience with rights at its path may know of it.
  virtual bool is_shown_to(const Audience& audience) const {
    (void)audience;
    return true;
  }
  /// Whether an audience that may read it may know what a fragment of its IRI stands for.
  virtual bool shows_fragment(std::string_view fragment, const Audience& audience) const {
    (void)fragment, (void)audience;
    return true;
  }
  /// The path at which its rights are looked up: without a query.
  std::string_view path_of_rights() const noexcept { return std::string_view(path).substr(0, path.find('?')); }

  // The description of the resource.
  virtual void describe(const Description& d) const = 0;
  /// Its controls, in its own representation only: how to observe it and how to write it.
  virtual void describe_controls(About& about, const Description& d) const;
  /// Where hosts send its messages (FeedSubscription::statements), for documents of several resources.
  void describe_topics(const Description& d) const;
  /// Its types, stated wherever it is linked to (SPEC 2).
  virtual void describe_types(About& about, const Description& d) const = 0;
  virtual const Variants& variants() const { return overview_variants(); }
  /// Its members in overviews that link to it, besides href, kind and methods.
  virtual void summarize(Overview& o) const { (void)o; }
  /// The further members of its own overview.
  virtual void overview(Overview& o) const { (void)o; }
  /// Changes whenever a representation might have changed.
  /// @param structure  Registry::structure()
  virtual std::uint64_t state(std::uint64_t structure) const noexcept { return structure; }
  // What subscribers get with its representation (SPEC 3.6).
  /// Its changes so far: a larger difference than 1 between two messages means that changes between them were not sent.
  virtual std::uint64_t change_number() const noexcept { return revision; }
  /// The same for an audience from whom something is hidden (View::reads_everything): only of what it sees.
  virtual std::uint64_t change_number(const Audience& audience) const {
    (void)audience;
    return change_number();
  }
  /// When its value became what it is; nullopt: it has no such time.
  virtual std::optional<Utc> value_time() const noexcept { return std::nullopt; }
  subscription::Stamp stamp() const noexcept { return {value_time(), change_number()}; }
  virtual std::string_view cache_control() const noexcept { return "no-cache"; }

  // The links of the resource (R0.9).
  /// rel="related": its direct sub-resources, unless they are members.
  virtual void link_related(http::LinkWriter& links, const std::string& base) const;
  /// Path for rel="up"; empty: none.
  virtual std::string up() const;
  /// The same for an audience: above a Thing is the nearest one that it sees.
  std::string up(const Audience& audience) const;
  /// IRI for rel="describedby"; empty: none.
  virtual std::string described_by(const std::string& base) const;

  // Observers (R0.12, R0.14): subscriptions if it is observable(), and standing queries.
  /// The container of its subscriptions, which its Thing has; nullptr: there is none.
  virtual SubscriptionsResource* subscriptions() const noexcept;
  /// Called with the first observer, and when the last one has left.
  virtual void set_observed(bool observed, ChangeScanner& scanner) { (void)observed, (void)scanner; }
  /// Its kind in the file of saved subscriptions; empty: it cannot be observed or does not exist after a restart.
  Iri saved_type() const noexcept { return observable() ? observable()->saved_type : Iri(); }
  /// Its representations have changed: notifies the observers.
  void mark_changed();
  void notify_observers();
  /// The same of something that not everybody sees who sees the resource: its other observers, and the numbers of its changes for them, do not notice.
  void mark_changed(SeenBy seen);
  void notify_observers(SeenBy seen);
  /// Its graph may have changed: records it for queries.
  void record_change() noexcept;
  void add_observer(Observer& observer, ChangeScanner& scanner);
  void remove_observer(Observer& observer, ChangeScanner& scanner);

  // Its path. The names of the user have precedence over those of lrt.
  enum class Naming : std::uint8_t { user, action, lrt };
  /// Who named it. Of two resources with the same path, the one with the lower value keeps it, and the other one moves aside.
  Naming naming() const noexcept { return lrt_name_end == 0 ? Naming::user : lrt_name_end < usual_size() ? Naming::action : Naming::lrt; }
  /// Its path if the first `n` were taken: "/arm/state", "/arm/state-lrt", "/arm/state-lrt-lrt". The path of 0 is its usual path.
  std::string path_aside(std::size_t n) const;
  /// Registry has moved it to another path.
  virtual void path_changed() {}

  ResourceId id{};         ///< given by Registry
  std::string path;        ///< absolute and percent-encoded: "/baxter/right_s1"; changed by Registry only
  ThingNode* const thing;  ///< that it belongs to; nullptr for the resources of the server itself
  /// Where the segment ends that lrt named in its usual path: after "state" in "/arm/state", after "actions" in "/arm/actions/turn". 0: none.
  const std::uint32_t lrt_name_end;
  std::uint32_t times_aside = 0;  ///< `path` is path_aside(times_aside)
  std::uint64_t revision = 1;
  ThinVector<Observer*> observers;
  ThinVector<std::list<Representation>::iterator> representations;  ///< RepresentationCache's

 private:
  /// mark_changed() was called.
  virtual void count_change(SeenBy seen) { (void)seen; }
  std::size_t usual_size() const noexcept;
};

/// Content in a store of the host, which a representation may have to wait for.
class HostContent {
 public:
  virtual const Resource& resource() const noexcept = 0;
  /// It is read for each reader.
  virtual bool is_read_each_time() const noexcept = 0;
  /// The store could not be read.
  virtual bool has_fault() const = 0;
  /// Reads it.
  /// @param done  called once, on the engine's thread. unavailable: why it cannot be read
  virtual void read(UniqueFunction<void(const Result<void>&, TimePoint)> done) = 0;

 protected:
  ~HostContent() = default;
};

/// A resource whose representations have values: those of properties, or one of its own.
class ValueResource : public Resource {
 public:
  using Resource::Resource;
  using Resource::values;
  ValueResource* values() noexcept final { return this; }

  /// The properties whose values are in its representations.
  enum class Reads : std::uint8_t {
    nothing,
    known_values,     ///< whether a property has a value; pulled properties are not read for that
    values,           ///< the present values
    readable_values,  ///< the present values; a property that cannot be read now says why
  };
  virtual Reads reads() const noexcept { return Reads::nothing; }
  virtual void for_each_property(FunctionRef<void(PropertyResource&)> visit) const { (void)visit; }
  /// What stores of the host have in its representations. Of several, those that cannot be read are left out.
  virtual void for_each_host_content(FunctionRef<void(HostContent&)> visit) const { (void)visit; }
  /// Collects the messages of other threads that need no user code.
  virtual void refresh() {}
  /// Its representations can be made without user code, and no running call would change them.
  virtual bool is_up_to_date() const noexcept { return reads() == Reads::nothing; }

  /// The value behind variants without RDF; nullopt: there is none.
  virtual std::optional<PlainValue> plain_value(const Audience& audience) const {
    (void)audience;
    return std::nullopt;
  }
  /// Its RDF states at most that many values.
  virtual bool fits_rdf(std::size_t max_values) const {
    (void)max_values;
    return true;
  }
  /// Resources whose triples it has in one document. TriG and N-Quads also have a graph for each.
  /// @param audience  they are in the order that it would find without what it does not see
  virtual std::vector<const Resource*> described_resources(const Audience& audience) const {
    (void)audience;
    return {};
  }
  /// Describes one of them as it is in this document.
  /// @param left  how many values the RDF of the document may still have; counted down
  virtual void describe_part(const Resource& part, const Description& d, std::size_t& left) const {
    (void)left;
    part.describe(d);
  }
  /// The largest size of a representation; a larger one is answered with 406.
  virtual std::size_t max_bytes(const EngineOptions& options) const noexcept {
    (void)options;
    return static_cast<std::size_t>(-1);
  }
  /// It is known to be larger without being described: no representation in RDF or JSON is made.
  virtual bool exceeds(std::size_t max_bytes, const Audience& audience) const {
    (void)max_bytes, (void)audience;
    return false;
  }
};

/// The accepted bodies of a resource that takes a value.
Input input_of(const model::ResourceSpec& spec, const rdf::Type& type, const rdf::Facets& facets, const EngineOptions& options);

/// Stands for the base in graphs that are kept.
inline constexpr std::string_view placeholder_base = "http://lrt.invalid";
/// Adds a graph that was kept with the placeholder as base. Its blank nodes become fresh ones.
void add_placed(rdf::Graph& graph, const rdf::Graph& kept, const std::string& base);
/// The opposite: a graph of a client, with the placeholder in place of the base that its request has. Blank nodes keep their labels.
rdf::Graph unplaced(const rdf::Graph& graph, const std::string& base);

/// Whether a value has more numbers, texts and so on than `left`, which is counted down. An empty list is one.
bool fits(const rdf::Value& value, std::size_t& left);

}  // namespace v0
}  // namespace lrt::engine
