// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/metric.hpp>
#include <lrt/base/result.hpp>
#include <lrt/client/options.hpp>

/// Copies of the graphs of robots in an RDF store.
namespace lrt::mirror {
inline namespace v0 {

/// A store that supports the SPARQL 1.1 Graph Store HTTP Protocol.
struct StoreOptions {
  /// URL of the protocol: "http://127.0.0.1:8890/sparql-graph-crud-auth". The IRI of a graph is appended as the
  /// parameter `graph` (indirect identification, 4.2), or replaces "{graph}" in the URL:
  /// "https://store.example/graphs/{graph}" (direct identification, 4.1). It must not contain secrets: messages and the
  /// state file show it.
  std::string endpoint;
  /// @{
  /// Credentials for HTTP Digest (MD5 or SHA-256), or Basic over TLS or to this machine.
  std::string user, password;
  /// @}
  std::string token;                                ///< bearer token (RFC 6750), over TLS or to this machine
  std::string ca_file;                              ///< certificate authorities, PEM; empty: those of the system
  std::chrono::milliseconds response_time{30'000};  ///< for a whole exchange
};

/// An event that a mirror reports.
struct MirrorEvent {
  /// What happened.
  enum class Kind : unsigned char {
    robot_found,        ///< this mirror has read the robot for the first time
    robot_left,         ///< the robot cannot be read; its graphs stay, and it is marked
    robot_returned,     ///< the robot can be read again; the mark is removed
    graph_sent,         ///< a graph was written to the store
    graph_deleted,      ///< the robot no longer has the resource
    graph_refused,      ///< the store refused this graph. It is sent again when it has changed; after 500, also with the next reading
    graph_overwritten,  ///< another client had changed it in the store; the robot's version was sent again
    store_lost,         ///< the store does not respond or is full; graphs wait
    store_returned,     ///< the store responds again
    problem,            ///< anything else: a resource cannot be read, the state cannot be written
    graph_lost,         ///< the store no longer had it; it was sent again
    store_repaired,     ///< after graph_lost and graph_overwritten, when nothing waits any more: how many there were
  };
  Kind kind = Kind::problem;  ///< what happened
  std::string url{};          ///< of the robot, the graph or the store
  std::string reason{};       ///< a sentence; empty if the kind is sufficient
};

/// What a mirror believes of its store when it begins.
enum class MirrorStart : unsigned char {
  /// It looks at each graph: by one request with the entity tag that the store gave, or, of a store that gives none, by
  /// reading the graph.
  check,
  verify,  ///< it reads each graph, also where the entity tag is the one that the store gave
  force,   ///< nothing: it sends all graphs
};

/// Options of a Mirror.
struct MirrorOptions {
  std::vector<std::string> robots;  ///< a URL of each
  StoreOptions store;               ///< where the graphs are written
  client::Options client;           ///< identity and limits for the robots; `callbacks` has no effect
  /// A file that lists what the store has, so that a mirror that starts again sends only what has changed. Only one
  /// mirror may use it, for one store. It is not believed, see MirrorStart. Empty: the list is kept in memory only.
  std::string state_file;
  MirrorStart start = MirrorStart::check;  ///< what is believed of the store

  std::size_t max_requests = 4;                       ///< to the store at a time
  double max_rate = 100;                              ///< requests to the store per second; 0: not limited
  std::size_t max_readers = 8;                        ///< robots that are read at a time
  std::size_t max_graphs = 1'000'000;                 ///< of all robots
  std::size_t max_waiting_bytes = 64 * 1024 * 1024;   ///< of waiting graphs; those beyond are read again when they can be sent
  std::size_t max_watches_per_robot = 200;            ///< each is a connection; further resources are read every refresh_interval
  std::chrono::milliseconds minimum_interval{1'000};  ///< between two changes of a resource that a robot sends; the newest is used
  /// Between two readings of all resources of a robot, of which unchanged ones respond 304; and of the store's graphs.
  std::chrono::milliseconds refresh_interval{60'000};
  std::chrono::milliseconds first_pause{500};   ///< after a failure of a store or a robot; then doubled, times a random 0.5 to 1.5
  std::chrono::milliseconds max_pause{30'000};  ///< longest pause
  std::chrono::milliseconds patience{30'000};   ///< of copy(): how long the store may fail

  /// Called on threads of the mirror, several at a time. It must not block for long, and must not call stop().
  std::function<void(const MirrorEvent&)> on_event;
};

/// Numbers of a Mirror since its creation.
struct MirrorCounts {
  /// @{
  /// Operations on graphs.
  std::uint64_t sent = 0, deleted = 0, refused = 0, overwritten = 0;
  /// @}
  std::uint64_t unchanged = 0;   ///< graphs that were not sent, because the store has them already
  std::uint64_t failures = 0;    ///< requests to the store that are repeated
  std::size_t graphs = 0;        ///< in the store, as far as is known
  std::size_t waiting = 0;       ///< graphs to be sent or deleted
  std::size_t robots_away = 0;   ///< robots that cannot be read
  std::uint64_t sent_bytes = 0;  ///< of the graphs that were sent, as Turtle
  /// How long the store lacks what this mirror knows: the age of the oldest change that the store has not accepted. 0: it
  /// has all. A graph that it refuses does not count, nor one that it lost until that has been found.
  std::chrono::milliseconds lag{0};
  std::uint64_t lost = 0;    ///< graphs that the store no longer had; they were sent again, and count in `sent`, too
  std::uint64_t unread = 0;  ///< readings of single resources that failed, but for those that the robot refuses to this client
  /// Robots whose URL describes something elsewhere, as one with another public base: nothing of them is mirrored.
  std::size_t robots_elsewhere = 0;
};

/// Copies the graphs of robots to a store and keeps them up to date: each resource is a named graph with the URL of the
/// resource as its name. The resources are those to which links lead from the robot's URL on its origin: Things,
/// properties, actions, collections and their members, Blueprints. Aggregates of other resources (lrt:state, lrt:all),
/// invocations and subscriptions are left out.
///
/// First all resources are read and sent, then those that change. A graph is replaced by PUT, so sending it twice has
/// no further effect; of several waiting changes only the newest is sent. If the store has entity tags, If-Match
/// detects that another client has changed the graph; the robot's version then replaces it.
///
/// Each reading of a robot compares what the store has: at the start, each refresh_interval, and when the robot or the
/// store has returned. That is one request for each graph. A graph that the store has lost or that another client has
/// changed is sent again, and counted. A store that gives no entity tags is read once more behind each graph that such a
/// reading sends, so that its own form of it is known ("0.0" for "0"). A store that cannot be read (405) is believed, and
/// so is one graph that it does not give (403); that is reported, and tried again with each reading.
///
/// The graph `<ROBOT#mirror>` lists the graphs of the robot: `<ROBOT#mirror> dcterms:hasPart GRAPH`. By it a mirror
/// without a state, or to a store that was restored from an older copy, finds graphs whose resources the robot no longer
/// has. If a robot cannot be read, its graphs stay, and this graph states since when: `<ROBOT> lrt:unreachableSince TIME`.
/// The graph of a resource for which the robot responds 404 or 410 is deleted.
///
///     lrt::mirror::MirrorOptions options;
///     options.robots = {"http://cell7.example:8080/", "http://cell8.example:8080/"};
///     options.store.endpoint = "http://127.0.0.1:8890/sparql-graph-crud-auth";
///     options.store.user = "dba", options.store.password = "dba";
///     lrt::mirror::Mirror mirror = lrt::mirror::Mirror::create(options).value();
///     mirror.start().value();
///
/// @par Threads  Any; stop() and the destructor: not from a callback.
class LRT_API Mirror {
 public:
  /// Makes a mirror. It connects to nothing yet.
  /// @par Errors  invalid_option: also a state file of another store, or one that another mirror uses; expected_iri: of
  ///              a robot; io_error
  static Result<Mirror> create(MirrorOptions options);
  Mirror(Mirror&&) noexcept;
  Mirror& operator=(Mirror&&) noexcept;
  /// Calls stop().
  ~Mirror();

  /// Reads each robot once, sends the differences, and waits until that is done. A robot that does not respond is
  /// marked.
  /// @param goes_on  called several times a second; false ends the copy with Errc::cancelled. May be empty
  /// @par Errors  refused: the store refuses the user; failed: each robot is one of robots_elsewhere; io_error, timed_out,
  ///              failed, ...: the store has failed for longer than `patience`; cancelled: also after stop()
  /// @par Time    Blocks until the copy is done.
  Result<MirrorCounts> copy(const std::function<bool()>& goes_on = {});
  /// Begins to mirror, until stop().
  /// @par Errors  io_error: the system has no further thread
  Result<void> start();
  MirrorCounts counts() const;  ///< numbers since its creation
  /// The same as metrics, `lrt_mirror_...` with the URL of the store as a label, for Server::add_metrics().
  std::vector<Metric> metrics() const;
  /// The reason why the mirror ended without stop(): the store refuses the user, or no URL is that of a robot (see
  /// MirrorCounts::robots_elsewhere). nullopt: it has not ended.
  std::optional<Error> failure() const;
  /// Ends all requests and writes the state. Waiting graphs are not sent; the next mirror sends them.
  /// @par Time  Waits for running callbacks, and writes the file of the state.
  void stop() noexcept;

  class Impl;

 private:
  explicit Mirror(std::shared_ptr<Impl> impl) noexcept;
  std::shared_ptr<Impl> impl_;
};

/// The name of the graph that lists the graphs of a robot: its URL with the fragment "mirror".
/// @par Threads  Any.
LRT_API std::string mirror_mark_of(const std::string& robot);

}  // namespace v0
}  // namespace lrt::mirror
