// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/error.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/control.hpp>
#include <lrt/model/detail/callables.hpp>
#include <lrt/model/detail/slot.hpp>
#include <lrt/model/dispatch.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>

#include "src/base/thin_vector.hpp"
#include "src/model/availability.hpp"
#include "src/model/value_life.hpp"

namespace lrt::model {
inline namespace v0 {

/// Passes messages about the use of handles to the server's log callback, as long as the server exists.
/// @par Threads  Any.
class HandleLog {
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
  std::string path;                            ///< ThingSpec::path
  std::shared_ptr<HandleLog> log{};            ///< of the server, set before the resources are sealed
  std::unique_ptr<const Error> first_error{};  ///< of the calls that describe the Thing; null: none

  /// Keeps the first error: Server::add() returns it.
  void remember(Error error);
};

/// A representation that a user's encoder makes of a property's values.
struct RepresentationSpec {
  std::string media_type;
  EncodeFunction encode;
  Layout layout;             ///< is described in RDF if it has an element_type
  std::string element_type;  ///< owns the text of layout.element_type
};

/// The common part of all registered resources.
struct ResourceSpec {
  enum class Kind : std::uint8_t { property, action, collection };

  explicit ResourceSpec(Kind its_kind) noexcept : kind(its_kind), harmless(false), is_generated(false) {}

  std::string path;  ///< percent-encoded, relative to its thing
  std::shared_ptr<HandleContext> thing;
  ThinVector<std::string> classes;     ///< further rdf:types
  ThinVector<std::string> predicates;  ///< domain predicates from the thing to it
  ThinVector<Statement> statements;
  std::optional<std::size_t> max_body_bytes;  ///< nullopt: what the type needs
  const Kind kind;
  std::optional<Dispatch> dispatch;  ///< nullopt: as the thing
  bool harmless : 1;                 ///< stays available while the thing is stopped
  bool is_generated : 1;             ///< lrt made it: the user's names have precedence
  std::atomic<bool> sealed{false};   ///< registered: set-up calls of the handle have no effect

  /// Its usual path below the root: "/arm/angle", "/arm/actions/turn".
  std::string location() const;
  void seal() noexcept { sealed.store(true, std::memory_order_release); }
  /// See HandleContext::remember().
  void remember(Error error) const { thing->remember(std::move(error)); }
  /// "property \"arm/angle\"".
  std::string description() const;
  /// Logs an error: the resource, "call()" and what is wrong with the call. Any thread.
  void report(const char* call, const char* what) const noexcept;
};

/// What modules above this one do for a Property that clients patch, as ControlExtension for a Thing with control.
class PatchExtension {
 protected:
  ~PatchExtension() = default;
};

struct PropertySpec : ResourceSpec {
  PropertySpec() noexcept : ResourceSpec(Kind::property) {}
  bool octets = false;   ///< rdf::Plain::octets is offered
  bool counter = false;  ///< its changes are no reason to evaluate a standing query
  bool file = false;     ///< not in the state; the first representation is the default
  const rdf::Type* type = nullptr;
  rdf::Facets facets;
  std::unique_ptr<SlotBase> slot;         ///< of a pushed property; null: the property is pulled
  ReadFunction read;                      ///< of a pulled property
  std::shared_ptr<ChangeSignal> changes;  ///< of a pulled property
  /// Of a pulled property, at most 24 days; nullopt: SubscriptionOptions::sample_period. Short, because a property has it and its Thing many.
  std::optional<std::chrono::duration<std::int32_t, std::milli>> sample_period;
  WriteFunction write;                      ///< empty: read-only
  const PatchExtension* patches = nullptr;  ///< nullptr: its values have no parts
  std::unique_ptr<ValueLife> life;          ///< of a written value; null: it has no end
  ThinVector<RepresentationSpec> representations;
  WholeFunction whole;                               ///< makes the T of a written value; returns null if it cannot
  std::unique_ptr<const Object> frame;               ///< null: none
  std::unique_ptr<const std::string> cache_control;  ///< null: "no-cache"
};

/// lrt::FromInput, with texts of its own.
struct InputValue {
  std::string input_field, property_field;  ///< empty: the whole
  double tolerance = 0, period = 0;         ///< 0: none
};

/// What a successful invocation of an action stores in a property: any value, the input, or `value`.
struct EffectSpec {
  std::string property;                        ///< its location
  std::shared_ptr<const PropertySpec> spec{};  ///< of the property; null: only its location is known
  std::optional<InputValue> from_input{};
  std::optional<rdf::Value> value{};
};

/// What the engine has for stop states. It derives its own from this, and only the functions that declare a stop state name that: a linker leaves out
/// of a program without one what only these need.
class StopExtension {
 protected:
  ~StopExtension() = default;
};

/// A stop state that the user has declared.
struct StopStateSpec {
  const StopExtension& extension;
  UniqueFunction<bool()> read;             ///< empty: `property`
  std::shared_ptr<ResourceSpec> property;  ///< of bool; null: `read`
  std::shared_ptr<ResourceSpec> release;   ///< null: none
};

struct ActionSpec : ResourceSpec {
  ActionSpec() noexcept : ResourceSpec(Kind::action) {}
  const rdf::Type* input = nullptr;   ///< nullptr: no input
  const rdf::Type* output = nullptr;  ///< nullptr: no output
  rdf::Facets facets, output_facets;  ///< of the input and of the output
  ActionPolicy policy;
  bool asynchronous = false;
  bool stop = false;                          ///< Action::stop()
  bool releases = false;                      ///< it ends a stop
  bool requires_expiry = false;               ///< Action::requires_expiry()
  std::shared_ptr<StopStateSpec> stop_state;  ///< of a stop; null: none is declared
  Availability availability;
  std::vector<EffectSpec> effects;
  std::vector<std::string> effect_turtle;                    ///< documents; their base is the action
  std::vector<std::pair<std::string, std::string>> headers;  ///< names and values of header fields of its binding
  std::vector<std::string> parts;                            ///< locations of the actions that it is composed of
  std::optional<Error> first_error;
  /// Starts an invocation. It or a responder finishes the link. Exceptions of user code pass through.
  StartFunction start;
};

struct CollectionSpec : ResourceSpec {
  CollectionSpec() noexcept : ResourceSpec(Kind::collection) {}
  const rdf::Type* type = nullptr;
  rdf::Facets facets;
  std::size_t max_members = 1000;  ///< beyond: 409
  CreateFunction create;           ///< empty: no POST
  RemoveFunction remove;           ///< empty: no DELETE
};

struct WorldSpec;

/// What modules above this one do for a Thing with control, as WorldExtension does for a World.
class ControlExtension {
 protected:
  ~ControlExtension() = default;
};

/// Thing::control()
struct ControlSpec {
  const ControlExtension& extension;
  ControlOptions options;
};

struct ThingSpec;

/// Thing::guard(): the lambdas are called only while these objects exist.
struct Guards {
  std::vector<std::weak_ptr<void>> objects{};
  void (*apply)(ThingSpec& thing);  ///< lets the lambdas of the Thing look first. A pointer: only programs with guards link it
};

struct ThingSpec {
  std::string path;                        ///< percent-encoded, without leading or trailing '/'
  std::shared_ptr<HandleContext> handles;  ///< see context(); null: nothing needs it
  ThinVector<std::string> classes;
  std::string title;                  ///< the last segment of its path, or the title without a language
  std::unique_ptr<rdf::Words> words;  ///< the other words of the user; null: none
  ThinVector<Statement> statements;
  ThinVector<std::string> turtle;                ///< documents; their base is the thing
  std::unique_ptr<const std::string> blueprint;  ///< IRI of an external one; null: generated
  ThinVector<std::string> shapes;                ///< Turtle documents; their base is the blueprint
  Dispatch dispatch = Dispatch::as_server;
  bool has_plain_title = false;  ///< the user gave `title`
  bool requires_expiry = false;  ///< Thing::requires_expiry()
  std::vector<std::shared_ptr<PropertySpec>> properties;
  ThinVector<std::shared_ptr<ActionSpec>> actions;
  ThinVector<std::shared_ptr<CollectionSpec>> collections;
  std::unique_ptr<Guards> guards;                    ///< of Thing::guard(); null: none
  std::shared_ptr<WorldSpec> world;                  ///< of a World; null: it is no World
  std::unique_ptr<const ControlSpec> control;        ///< null: clients do not take control of it
  std::unique_ptr<const std::string> cache_control;  ///< of the Thing and its state; null: "no-cache"

  /// Makes `handles` if there are none. @pre `path` is set
  std::shared_ptr<HandleContext>& context();
};

/// The error of a Thing without its description.
Error moved_from();
/// All titles of a Thing.
rdf::Texts titles_of(const ThingSpec& thing);
/// The titles or descriptions among statements.
rdf::Texts texts_of(const std::vector<Statement>& statements, Iri predicate);

/// The value of Cache-Control (RFC 9111 5.2.2, RFC 5861 3), in whole seconds; null for less than one second.
std::unique_ptr<const std::string> cache_control_of(std::chrono::milliseconds age, std::chrono::milliseconds while_revalidating);

/// Percent-encodes each segment of a path.
/// @par Errors  expected_iri: empty, an empty segment, "." or ".."; the message says what to write
Result<std::string> encode_path(std::string_view path);
/// The same of a path below the server's root, which may begin with a '/'.
Result<std::string> encode_path_from_root(std::string_view path);

}  // namespace v0
}  // namespace lrt::model
