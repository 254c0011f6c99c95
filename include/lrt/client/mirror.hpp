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
#include <lrt/base/result.hpp>
#include <lrt/client/options.hpp>

/// Copies of the graphs of robots in an RDF store.
namespace lrt::client {
inline namespace v0 {

/// A store that has the SPARQL 1.1 Graph Store HTTP Protocol.
struct StoreOptions {
  /// URL of the protocol: "http://127.0.0.1:8890/sparql-graph-crud-auth". The IRI of a graph is appended as the parameter `graph` (indirect
  /// identification, 4.2), or takes the place of "{graph}" where the URL has it: "https://store.example/graphs/{graph}" (direct identification, 4.1).
  std::string endpoint;
  /// For what the store asks for: HTTP Digest (MD5 or SHA-256), or Basic over TLS or to this machine.
  std::string user, password;
  std::string token;                                ///< bearer token (RFC 6750), over TLS or to this machine
  std::string ca_file;                              ///< certificate authorities, PEM; empty: those of the system
  std::chrono::milliseconds response_time{30'000};  ///< for a whole exchange
};

/// What a mirror reports.
struct MirrorEvent {
  enum class Kind : unsigned char {
    robot_found,     ///< it was read for the first time by this mirror
    robot_left,      ///< it cannot be read; its graphs stay, and it is marked
    robot_returned,  ///< it is no longer marked
    graph_sent,
    graph_deleted,      ///< the robot does not have the resource any more
    graph_refused,      ///< by the store, for a reason of this graph. It is sent again when it has changed; after 500, also with the next reading
    graph_overwritten,  ///< somebody else had changed it in the store: its entity tag was another one
    store_lost,         ///< it does not respond or has no room; what is to be sent waits
    store_returned,
    problem,  ///< anything else: a resource cannot be read, the state cannot be written
  };
  Kind kind = Kind::problem;
  std::string url{};     ///< of the robot, the graph or the store
  std::string reason{};  ///< a sentence; empty where the kind says all
};

struct MirrorOptions {
  std::vector<std::string> robots;  ///< a URL of each
  StoreOptions store;
  Options client;  ///< identity and limits for the robots; `callbacks` has no effect
  /// A file with what the store has, so that a mirror that starts again sends only what has changed. It belongs to one mirror at a time and one
  /// store. Empty: it is kept in memory only.
  std::string state_file;

  std::size_t max_requests = 4;                        ///< to the store at a time
  double max_rate = 100;                               ///< requests to the store in one second; 0: any number
  std::size_t max_readers = 8;                         ///< robots that are read at a time
  std::size_t max_graphs = 1'000'000;                  ///< of all robots
  std::size_t max_waiting_bytes = 64 * 1024 * 1024;    ///< of graphs that wait; what is beyond is read again when its turn comes
  std::size_t max_watches_per_robot = 200;             ///< each is a connection; further resources are read every refresh_interval
  std::chrono::milliseconds minimum_interval{1'000};   ///< between two changes of a resource that a robot sends; the newest counts
  std::chrono::milliseconds refresh_interval{60'000};  ///< between two readings of all resources of a robot, most of which respond 304
  std::chrono::milliseconds first_pause{500};          ///< after a failure of a store or a robot; then twice that, and so on, times 0.5 to 1.5
  std::chrono::milliseconds max_pause{30'000};
  std::chrono::milliseconds patience{30'000};  ///< of copy(): how long the store may fail

  /// Called by threads of the mirror, several at a time. It must not block for long or call stop().
  std::function<void(const MirrorEvent&)> on_event;
};

struct MirrorCounts {
  std::uint64_t sent = 0, deleted = 0, refused = 0, overwritten = 0;  ///< graphs, each time
  std::uint64_t unchanged = 0;                                        ///< not sent, because the store has them already
  std::uint64_t failures = 0;                                         ///< requests to the store that are tried again
  std::size_t graphs = 0;                                             ///< in the store, as far as is known
  std::size_t waiting = 0;                                            ///< graphs to be sent or deleted
  std::size_t robots_away = 0;
};

/// Keeps the graphs of robots in a store: the representation of each resource as a named graph with the URL of the resource as its name. Resources
/// are what links lead to from the robot's URL on its origin: Things, properties, actions, collections and their members, Blueprints. Aggregates of
/// other resources (lrt:state, lrt:all), invocations and subscriptions are left out.
///
/// First all are read and sent, then what changes. A graph is replaced by PUT, so sending it twice does no harm; of several changes that wait, only the
/// newest is sent. Where the store gives entity tags, If-Match tells whether somebody else has changed the graph; the robot's version wins.
///
/// A robot that cannot be read keeps its graphs, and the graph <ROBOT#mirror> says since when: `<ROBOT> lrt:unreachableSince TIME`. The graph is
/// deleted when the robot returns. A resource to which the robot responds 404 or 410 is deleted.
///
///     lrt::client::MirrorOptions options;
///     options.robots = {"http://cell7.example:8080/", "http://cell8.example:8080/"};
///     options.store.endpoint = "http://127.0.0.1:8890/sparql-graph-crud-auth";
///     options.store.user = "dba", options.store.password = "dba";
///     lrt::client::Mirror mirror = lrt::client::Mirror::create(options).value();
///     mirror.start().value();
///
/// @par Threads  Any; stop() and the destructor: not in a callback.
class LRT_API Mirror {
 public:
  /// @par Errors  invalid_option: also a state file of another store, or one that another mirror uses; expected_iri: of a robot; io_error
  static Result<Mirror> create(MirrorOptions options);
  Mirror(Mirror&&) noexcept;
  Mirror& operator=(Mirror&&) noexcept;
  /// Calls stop().
  ~Mirror();

  /// Reads each robot once, sends what differs, and waits until that is done. A robot that does not respond is marked.
  /// @param goes_on  asked several times a second; false ends the copy with `cancelled`. May be empty
  /// @par Errors  refused: the store refuses the user; io_error, timed_out, failed, ...: the store has failed for longer than `patience`;
  ///              cancelled: also after stop()
  Result<MirrorCounts> copy(const std::function<bool()>& goes_on = {});
  /// Begins to mirror; goes on until stop().
  /// @par Errors  io_error: there is no thread
  Result<void> start();
  MirrorCounts counts() const;
  /// Why the mirror has ended by itself: the store refuses the user. nullopt: it has not.
  std::optional<Error> failure() const;
  /// Ends all requests and writes the state. What waits is not sent; it is found to differ by the next mirror.
  void stop() noexcept;

  class Impl;

 private:
  explicit Mirror(std::shared_ptr<Impl> impl) noexcept;
  std::shared_ptr<Impl> impl_;
};

/// The name of the graph that marks a robot: its URL with the fragment "mirror".
LRT_API std::string mirror_mark_of(const std::string& robot);

}  // namespace v0
}  // namespace lrt::client
