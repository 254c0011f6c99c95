// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/error.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thin_vector.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/detail/availability.hpp>
#include <lrt/model/detail/slot.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/responder.hpp>

namespace lrt {
inline namespace v0 {

/// The place where user lambdas run. No lambda runs under a lock of lrt.
enum class Dispatch : std::uint8_t {
  as_server,  ///< as Threads::dispatch says (the default of a Thing). For a property, action or collection: as its thing
  in_poll,    ///< inside Server::poll, on the host's thread (the default of a server): robot code needs no locks
  io_thread,  ///< on the I/O thread: shortest response time; for fast, thread-safe code
  executor,   ///< passed to Threads::executor: several lambdas may run at the same time
};

/// The rule for an invocation while another one of the same action is pending or running.
struct ActionPolicy {
  /// The rules, see the functions of these names.
  enum class Kind : std::uint8_t { preempt, queue, reject, parallel };
  Kind kind = Kind::queue;  ///< which rule
  std::size_t limit = 16;   ///< queue: number of waiting invocations; parallel: of running invocations; beyond it the client gets 429

  static constexpr ActionPolicy preempt() noexcept { return {Kind::preempt, 1}; }                 ///< the older invocation is cancelled
  static constexpr ActionPolicy queue(std::size_t n) noexcept { return {Kind::queue, n}; }        ///< one runs, at most `n` wait for it
  static constexpr ActionPolicy reject() noexcept { return {Kind::reject, 1}; }                   ///< the newer invocation is refused: 409
  static constexpr ActionPolicy parallel(std::size_t n) noexcept { return {Kind::parallel, n}; }  ///< at most `n` run at the same time
};

}  // namespace v0
}  // namespace lrt

/// @cond internal
namespace lrt::model {
inline namespace v0 {

/// Passes messages about the use of handles to the server's log callback, as long as the server exists.
/// @par Threads  Any.
class LRT_API HandleLog {
 public:
  explicit HandleLog(LogCallback log) : log_(std::move(log)) {}
  void write(std::string_view message) noexcept;
  /// Afterwards write() has no effect.
  void close() noexcept;

 private:
  std::mutex mutex_;  // guards log_
  LogCallback log_;
};

/// What the handles of a Thing's resources know about it. It outlives the Thing.
struct HandleContext {
  std::string path;                  ///< ThingSpec::path
  std::shared_ptr<HandleLog> log{};  ///< of the server, set before the resources are sealed
};

/// The common part of all registered resources.
struct LRT_API ResourceSpec {
  enum class Kind : std::uint8_t { property, action, collection };

  explicit ResourceSpec(Kind its_kind) noexcept : kind(its_kind) {}

  std::string path;  ///< percent-encoded, relative to its thing
  std::shared_ptr<HandleContext> thing;
  ThinVector<std::string> classes;     ///< further rdf:types
  ThinVector<std::string> predicates;  ///< domain predicates from the thing to it
  ThinVector<Statement> statements;
  std::optional<std::size_t> max_body_bytes;  ///< nullopt: what the type needs
  const Kind kind;
  std::optional<Dispatch> dispatch;  ///< nullopt: as the thing
  std::atomic<bool> sealed{false};   ///< registered: set-up calls of the handle have no effect

  /// Its usual path below the root: "/arm/angle", "/arm/actions/turn".
  std::string location() const;
  void seal() noexcept { sealed.store(true, std::memory_order_release); }
  /// Logs an error: the resource, "call()" and what is wrong with the call. Any thread.
  void report(const char* call, const char* what) const noexcept;
};

/// The result of reading a property.
struct Reading {
  rdf::Value value;
  std::shared_ptr<const void> whole;  ///< the T itself, for the user's encoders; null: there are no encoders
};

struct PropertySpec : ResourceSpec {
  PropertySpec() noexcept : ResourceSpec(Kind::property) {}
  const rdf::Type* type = nullptr;
  rdf::Facets facets;
  std::shared_ptr<SlotBase> slot;                          ///< of a pushed property; null: the property is pulled
  UniqueFunction<Reading()> read;                          ///< of a pulled property
  std::shared_ptr<ChangeSignal> changes;                   ///< of a pulled property
  std::optional<std::chrono::milliseconds> sample_period;  ///< of a pulled property; nullopt: SubscriptionOptions::sample_period
  UniqueFunction<Result<void>(const rdf::Value&)> write;   ///< empty: read-only
  ThinVector<RepresentationSpec> representations;
  UniqueFunction<std::shared_ptr<const void>(const rdf::Value&)> whole;  ///< makes the T of a written value; returns null if it cannot
  bool octets = false;                                                   ///< rdf::Plain::octets is offered
  bool file = false;                                                     ///< not in the state; the first representation is the default
  std::unique_ptr<const Object> frame;                                   ///< null: none
  std::unique_ptr<const std::string> cache_control;                      ///< null: "no-cache"
};

/// What a successful invocation of an action stores in a property: any value, the input, or `value`.
struct EffectSpec {
  std::string property;  ///< its location
  bool from_input = false;
  std::shared_ptr<const PropertySpec> spec{};  ///< of the property, if there is a value
  std::optional<rdf::Value> value{};
};

struct ActionSpec : ResourceSpec {
  ActionSpec() noexcept : ResourceSpec(Kind::action) {}
  const rdf::Type* input = nullptr;   ///< nullptr: no input
  const rdf::Type* output = nullptr;  ///< nullptr: no output
  rdf::Facets facets, output_facets;  ///< of the input and of the output
  ActionPolicy policy;
  bool asynchronous = false;
  bool stop = false;  ///< Action::stop()
  Availability availability;
  std::vector<EffectSpec> effects;
  std::vector<std::string> effect_turtle;                    ///< documents; their base is the action
  std::vector<std::pair<std::string, std::string>> headers;  ///< names and values of header fields of its binding
  std::vector<std::string> parts;                            ///< locations of the actions that it is composed of
  std::optional<Error> first_error;
  /// Starts an invocation. It or a responder finishes the link. Exceptions of user code pass through.
  UniqueFunction<void(const rdf::Value&, const std::shared_ptr<InvocationLink>&)> start;
};

struct CollectionSpec : ResourceSpec {
  CollectionSpec() noexcept : ResourceSpec(Kind::collection) {}
  const rdf::Type* type = nullptr;
  rdf::Facets facets;
  std::size_t max_members = 1000;                                                 ///< beyond: 409
  UniqueFunction<Result<void>(const std::string& id, const rdf::Value&)> create;  ///< empty: no POST
  UniqueFunction<Result<void>(const std::string& id)> remove;                     ///< empty: no DELETE
};

struct WorldSpec;

struct ThingSpec {
  std::string path;                        ///< percent-encoded, without leading or trailing '/'
  std::shared_ptr<HandleContext> handles;  ///< null: it has no resources
  ThinVector<std::string> classes;
  std::string title;
  ThinVector<Statement> statements;
  ThinVector<std::string> turtle;  ///< documents; their base is the thing
  std::string blueprint;           ///< IRI of an external one; empty: generated
  ThinVector<std::string> shapes;  ///< Turtle documents; their base is the blueprint
  Dispatch dispatch = Dispatch::as_server;
  std::vector<std::shared_ptr<PropertySpec>> properties;
  ThinVector<std::shared_ptr<ActionSpec>> actions;
  ThinVector<std::shared_ptr<CollectionSpec>> collections;
  std::unique_ptr<const Error> first_error;          ///< null: none
  std::shared_ptr<WorldSpec> world;                  ///< of a World; null: it is no World
  std::unique_ptr<const std::string> cache_control;  ///< of the Thing and its state; null: "no-cache"
};

/// The value of Cache-Control (RFC 9111 5.2.2, RFC 5861 3), in whole seconds; null for less than one second.
LRT_API std::unique_ptr<const std::string> cache_control_of(std::chrono::milliseconds age, std::chrono::milliseconds while_revalidating);

/// Percent-encodes each segment of a path.
/// @par Errors  expected_iri: empty, an empty segment, "." or ".."; the message says what to write
LRT_API Result<std::string> encode_path(std::string_view path);
/// The same of a path below the server's root, which may begin with a '/'.
LRT_API Result<std::string> encode_path_from_root(std::string_view path);

}  // namespace v0
}  // namespace lrt::model
/// @endcond
