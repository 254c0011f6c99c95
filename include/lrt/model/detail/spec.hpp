#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/error.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/detail/slot.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/responder.hpp>

namespace lrt {

/// Where user lambdas run.
enum class Dispatch : std::uint8_t {
  as_server,   ///< as the server's options say (the default of a Thing)
  in_poll,     ///< inside Server::poll, on the host's thread (the default of a server): no locks in robot code
  io_thread,   ///< on the thread that does I/O: shortest answers, for code that is safe there and quick
  executor,    ///< handed to Options::executor
};

/// What a second invocation of an action meets while one is pending or running.
struct ActionPolicy {
  enum class Kind : std::uint8_t { preempt, queue, reject, parallel };
  Kind kind = Kind::queue;
  std::size_t limit = 16;  ///< queue: waiting invocations; parallel: running invocations; beyond: 429

  static constexpr ActionPolicy preempt() noexcept { return {Kind::preempt, 1}; }              ///< the older one ends cancelled
  static constexpr ActionPolicy queue(std::size_t n) noexcept { return {Kind::queue, n}; }     ///< one after the other
  static constexpr ActionPolicy reject() noexcept { return {Kind::reject, 1}; }                ///< 409
  static constexpr ActionPolicy parallel(std::size_t n) noexcept { return {Kind::parallel, n}; }
};

namespace model {

/// What every registered resource has: where it is and what is said of it.
struct ResourceSpec {
  std::string path;                      ///< percent-encoded, relative to its thing
  std::vector<std::string> classes;      ///< further rdf:types
  std::vector<std::string> predicates;   ///< domain predicates from the thing to it
  std::vector<Statement> statements;
  bool sealed = false;                   ///< registered: the handle changes nothing any more
};

/// What reading a property gives.
struct Reading {
  rdf::Value value;
  std::shared_ptr<const void> whole;     ///< the T itself, for the user's encoders; null where there are none
};

struct PropertySpec : ResourceSpec {
  const rdf::Type* type = nullptr;
  rdf::Facets facets;
  std::shared_ptr<SlotBase> slot;                              ///< pushed, else
  UniqueFunction<Reading()> read;                              ///< pulled
  std::shared_ptr<ChangeSignal> changes;                       ///< of a pulled one
  std::optional<std::chrono::milliseconds> sample_period;      ///< of a pulled one; nullopt: the server's
  UniqueFunction<Result<void>(const rdf::Value&)> write;       ///< empty: read-only
  std::vector<RepresentationSpec> representations;
  UniqueFunction<std::shared_ptr<const void>(const rdf::Value&)> whole;  ///< the T of a value that was written; null: none can be made
  bool octets = false;                                         ///< rdf::Plain::octets is offered
  std::optional<Object> frame;
};

struct ActionSpec : ResourceSpec {
  const rdf::Type* input = nullptr;      ///< nullptr: takes none
  const rdf::Type* output = nullptr;     ///< nullptr: gives none
  rdf::Facets input_facets, output_facets;
  ActionPolicy policy;
  bool asynchronous = false;
  /// Begins an invocation; throws what user code throws. The link is finished by it or by a responder it made.
  UniqueFunction<void(const rdf::Value&, const std::shared_ptr<InvocationLink>&)> start;
};

struct CollectionSpec : ResourceSpec {
  const rdf::Type* type = nullptr;
  rdf::Facets facets;
  std::size_t max_members = 1000;        ///< beyond: 409
  UniqueFunction<Result<void>(const std::string& id, const rdf::Value&)> create;  ///< empty: POST is not allowed
  UniqueFunction<Result<void>(const std::string& id)> remove;                     ///< empty: DELETE is not allowed
};

struct ThingSpec {
  std::string path;                      ///< percent-encoded, without leading or trailing '/'
  std::vector<std::string> classes;
  std::string title;
  std::vector<Statement> statements;
  std::vector<std::string> turtle;       ///< documents whose base is the thing
  std::string blueprint;                 ///< IRI of an external one; empty: generated
  std::vector<std::string> shapes;       ///< Turtle documents whose base is the blueprint
  Dispatch dispatch = Dispatch::as_server;
  std::vector<std::shared_ptr<PropertySpec>> properties;
  std::vector<std::shared_ptr<ActionSpec>> actions;
  std::vector<std::shared_ptr<CollectionSpec>> collections;
  std::optional<Error> first_error;
};

/// Percent-encodes each segment of a path.
/// @par Errors  expected_iri: empty, an empty segment, "." or ".."
Result<std::string> encode_path(std::string_view path);

}  // namespace model
}  // namespace lrt
