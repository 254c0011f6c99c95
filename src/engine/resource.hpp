#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/http/message.hpp>
#include <lrt/model/detail/spec.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/value.hpp>
#include <lrt/shacl/shapes.hpp>
#include <lrt/subscription/channel.hpp>

#include "src/engine/form.hpp"
#include "src/subscription/backlog.hpp"
#include "src/subscription/retry_policy.hpp"

namespace lrt::engine {

enum class Kind : std::uint8_t {
  root, terms, context, thing, state, blueprint, subscriptions, subscription, property, action, invocation, collection, member
};

using Utc = std::chrono::system_clock::time_point;

struct ThingNode;
struct Resource;
struct SubscriptionResource;

/// A representation as bytes with its fields, kept while the resource's revision and the cache's budget allow.
struct Rendering {
  Resource* resource;
  std::size_t base;       // index of the base it was made for
  Form form;
  std::size_t page;
  std::uint64_t revision;
  std::uint64_t structure; // of the server when `links` were made
  http::Fields links;     // those of the fields that only the structure changes
  http::Fields fields;    // all of a 200's
  std::string tag;
  std::shared_ptr<const std::string> body;

  std::size_t bytes() const noexcept { return sizeof *this + links.block().size() + fields.block().size() + tag.size() + body->size(); }
};

/// Anything that has a URI.
struct Resource {
  Resource(Kind k, std::string p, ThingNode* t) : kind(k), path(std::move(p)), thing(t) {}
  virtual ~Resource() = default;
  Resource(const Resource&) = delete;
  Resource& operator=(const Resource&) = delete;

  Kind kind;
  std::string path;              ///< absolute and percent-encoded: "/baxter/right_s1"
  ThingNode* thing;              ///< the thing it belongs to; nullptr for root, terms and context
  std::uint64_t revision = 1;    ///< another one whenever a representation might have changed
  std::vector<std::list<Rendering>::iterator> renderings;
  std::vector<SubscriptionResource*> observers;
};

/// Paths by a time: of invocations that must have begun by then, of properties that are to be read.
using Timers = std::multimap<std::chrono::steady_clock::time_point, std::string>;

using Continuation = UniqueFunction<void(const Result<void>&)>;

/// A claim on a job, so that either it runs or it is called off, never both.
class Claim {
 public:
  bool take() noexcept { return state_.exchange(taken, std::memory_order_acq_rel) == open; }
  bool call_off() noexcept {
    std::uint8_t expected = open;
    return state_.compare_exchange_strong(expected, off, std::memory_order_acq_rel);
  }

 private:
  static constexpr std::uint8_t open = 0, taken = 1, off = 2;
  std::atomic<std::uint8_t> state_{open};
};

struct PropertyResource final : Resource {
  PropertyResource(std::string p, ThingNode* t, std::shared_ptr<model::PropertySpec> s)
      : Resource(Kind::property, std::move(p), t), spec(std::move(s)) {}

  std::shared_ptr<model::PropertySpec> spec;
  rdf::Value value;                          ///< null: none yet
  std::shared_ptr<const void> whole;         ///< the T that it is of, for the user's encoders
  Utc modified{};
  bool only_octets = false;                  ///< the value has too many members for RDF, which describes its octets instead

  /// A pushed property has no value, and promises none, until the first publish.
  bool promises_triples() const noexcept { return (spec->read || !value.is_null()) && !only_octets; }

  std::unique_ptr<const Offers> offers;      ///< null: those of any property
  struct Encoded {
    std::uint64_t revision = 0;              ///< of the resource when they were made
    Result<Bytes> bytes{Bytes()};
  };
  std::vector<Encoded> encoded;              ///< by the user's encoders, of the same index

  // While somebody observes it, or the state of its thing:
  std::size_t watchers = 0;
  std::uint64_t lost = 0;                    ///< of the slot's, those that have been counted as dropped
  std::optional<Timers::iterator> sampling;  ///< of a pulled one: when it is read next
  bool failing = false;                      ///< its last read failed

  // Pulled properties: one read at a time; who comes while it runs waits for the next one, for the value must not be older than
  // the request.
  std::shared_ptr<Claim> reading;
  std::vector<Continuation> readers, next_readers;

  struct Write {
    Ticket ticket;
    rdf::Value value;
  };
  std::deque<Write> writes;                  ///< one at a time, in order, each with its own look at the preconditions
  bool writing = false;
  std::shared_ptr<Claim> write_claim;
};

enum class Status : std::uint8_t { pending, running, succeeded, failed, cancelled };

struct ActionResource;

/// The part of an invocation that user threads touch.
class InvocationCore;

struct InvocationResource final : Resource {
  InvocationResource(std::string p, ThingNode* t, ActionResource* a) : Resource(Kind::invocation, std::move(p), t), action(a) {}

  bool finished() const noexcept { return status >= Status::succeeded; }

  ActionResource* action;
  std::shared_ptr<InvocationCore> core;
  rdf::Value input;
  Status status = Status::pending;
  double progress = 0;
  Result<rdf::Value> result{rdf::Value()};
  Utc created{}, started{}, ended{};
  std::shared_ptr<Claim> claim;              ///< of the job that starts it, once there is one
  std::optional<Timers::iterator> start_timer;
  std::vector<Ticket> waiting;               ///< requests to be answered when it ends
};

struct ActionResource final : Resource {
  ActionResource(std::string p, ThingNode* t, std::shared_ptr<model::ActionSpec> s)
      : Resource(Kind::action, std::move(p), t), spec(std::move(s)) {}

  std::shared_ptr<model::ActionSpec> spec;
  rdf::Type invocation_type;                                   ///< of invocations as records
  std::list<std::unique_ptr<InvocationResource>> invocations;  ///< oldest first
  std::deque<InvocationResource*> queue;                       ///< pending ones that wait for their turn
  std::size_t active = 0;                                      ///< handed to the host and not ended
};

struct MemberResource final : Resource {
  MemberResource(std::string p, ThingNode* t, struct CollectionResource* c, std::string i, rdf::Value v)
      : Resource(Kind::member, std::move(p), t), collection(c), id(std::move(i)), value(std::move(v)) {}
  struct CollectionResource* collection;
  std::string id;
  rdf::Value value;
  bool removing = false;
};

struct CollectionResource final : Resource {
  CollectionResource(std::string p, ThingNode* t, std::shared_ptr<model::CollectionSpec> s)
      : Resource(Kind::collection, std::move(p), t), spec(std::move(s)) {}
  std::shared_ptr<model::CollectionSpec> spec;
  std::vector<std::unique_ptr<MemberResource>> members;
  std::size_t creating = 0;                  ///< on their way through the create lambda
  std::map<Ticket, std::shared_ptr<Claim>> under_way;  ///< requests whose create or remove lambda has not been heard of yet
};

enum class Protocol : std::uint8_t { websocket, callback };

/// Somebody who is told when a resource changes (paper 5.3).
struct SubscriptionResource final : Resource {
  SubscriptionResource(std::string p, ThingNode* t, std::string i, Channel c, Resource& r, subscription::Policy policy,
                       const subscription::SubscriptionOptions& options, std::size_t& queued_bytes)
      : Resource(Kind::subscription, std::move(p), t),
        id(std::move(i)),
        channel(c),
        observed(r),
        backlog(policy, options.max_queue_bytes, options.max_total_queue_bytes, queued_bytes),
        retry_policy(options.callbacks) {}

  std::string id;
  Channel channel;
  Resource& observed;
  Protocol protocol = Protocol::websocket;
  std::size_t base = 0;
  Form form;
  std::string url, receiver, secret;         ///< of a callback; receiver: as in subscription::ReadyCallback
  Utc created{};

  subscription::Backlog backlog;
  std::string last_tag;                      ///< of what was given last
  bool marked = false;                       ///< among those for whose queue there is something new
  bool failing = false;                      ///< its representation could not be made the last time
  bool named = false;                        ///< to who delivers, and not answered with nothing since
  std::optional<std::multimap<std::chrono::steady_clock::time_point, Channel>::iterator> timer;

  subscription::RetryPolicy retry_policy;           ///< of a callback, as what follows
  std::optional<subscription::Item> under_way;
  std::string last_error;
  std::uint64_t delivered = 0;
};

/// A thing with the resources it always has and those it was given.
struct ThingNode {
  explicit ThingNode(std::unique_ptr<model::ThingSpec> s)
      : spec(std::move(s)),
        self(Kind::thing, "/" + spec->path, this),
        state(Kind::state, self.path + "/state", this),
        blueprint(Kind::blueprint, self.path + "/blueprint", this),
        subscriptions(Kind::subscriptions, self.path + "/subscriptions", this) {}

  std::unique_ptr<model::ThingSpec> spec;
  rdf::Type state_type;                      ///< of its state as a record
  rdf::Graph statements;                     ///< of its Turtle, with IRIs below placeholder_base
  rdf::Graph user_shapes;                    ///< the same of the shapes that the user gave
  std::map<std::size_t, shacl::Shapes> door; ///< its blueprint compiled, by base, from the first body on
  Resource self, state, blueprint, subscriptions;
  std::vector<std::unique_ptr<PropertyResource>> properties;
  std::vector<std::unique_ptr<ActionResource>> actions;
  std::vector<std::unique_ptr<CollectionResource>> collections;
  std::vector<std::unique_ptr<SubscriptionResource>> members;  ///< of the container of subscriptions, oldest first
  ThingNode* parent = nullptr;               ///< nullptr: below the root
  std::vector<ThingNode*> children;          ///< in order of registration
};

/// Stands for the base of a representation in graphs that are kept.
inline constexpr std::string_view placeholder_base = "http://lrt.invalid";

}  // namespace lrt::engine
