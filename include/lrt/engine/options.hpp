// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/ids.hpp>
#include <lrt/base/log.hpp>
#include <lrt/http/message.hpp>
#include <lrt/identity.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/words.hpp>
#include <lrt/security.hpp>
#include <lrt/subscription/options.hpp>

namespace lrt::engine {
inline namespace v0 {

class PageSource;
class QueryService;

/// Limits of time and memory that clients can use in the engine.
struct Limits {
  std::chrono::milliseconds host_timeout{2'000};   ///< how long a request waits for the host to run a lambda; then 503, or 202 if it runs
  std::chrono::seconds retry_after{1};             ///< Retry-After of a 503
  std::chrono::seconds max_wait{60};               ///< of `Prefer: wait`; a longer time is reduced to this
  std::size_t max_waiting_requests = 1'000;        ///< more at once, or twice as many calls that the host has not run yet: 503. Those for
                                                   ///< lambdas on the I/O thread are counted separately
  std::size_t max_finished_invocations = 32;       ///< kept per action, the newest
  std::size_t max_page_members = 500;              ///< members of a container in one page
  std::size_t max_cache_bytes = 32 * 1024 * 1024;  ///< of cached representations; the least recently used ones are removed first
  std::size_t max_link_bytes = 8 * 1024;           ///< of Link fields in one response (R0.9)
  /// Number of scalars (numbers, texts and so on) of a resource in RDF. A value with more is available in JSON or CBOR;
  /// its RDF is 406. If it has octets (octets() of a property), the RDF describes those instead of each number.
  std::size_t max_value_members = 100'000;
  std::size_t max_rdf_xml_triples = 5'000;                ///< of a representation in RDF/XML, 20 us each; more: 406
  std::size_t max_body_triples = 10'000;                  ///< of a request body; more: 413
  std::size_t max_body_text_bytes = 16 * 1024 * 1024;     ///< of a request body's IRIs and literals, written in full; more: 413
  std::size_t max_list_members = 10'000;                  ///< of one list in a request body; more: 413
  std::size_t small_body_bytes = 2 * 1024;                ///< a request body up to this is judged by the I/O thread, a larger one by
                                                          ///< Threads::body_threads
  std::size_t max_waiting_body_bytes = 64 * 1024 * 1024;  ///< of larger bodies that wait to be judged, a quarter of it from one address; more: 503
  std::size_t max_all_bytes = 16 * 1024 * 1024;           ///< of a document of a Thing and all Things below it; more: 406. Also of all graphs
                                                          ///< of a World in one: their IRIs and literals, written in full
  /// Size of a request body for one number, or where no value is expected; more: 413. A resource whose type has a fixed
  /// size takes 1 KiB more for each number, text and field, and for a text with length() also its bytes. All others,
  /// such as a list without a maximum, take transport::Limits::max_body_bytes. max_body_bytes() of a property, action
  /// or collection overrides this.
  std::size_t max_scalar_body_bytes = 16 * 1024;
};

/// Hosts, origins and senders that requests may name, and limits of one client.
struct RequestRules {
  std::string challenge = "Bearer";  ///< WWW-Authenticate of a 401
  /// Further hosts that a request may name in Host, besides the listening address, the names of this machine's loopback
  /// addresses with any port (somebody may forward one, as `ssh -L` does), and the host of the public base:
  /// "robot.local" (with the listening port, or that of the public base) or "name:port". Others get 421. This prevents a
  /// web page whose own host name resolves to this machine from reading or commanding the robot (DNS rebinding).
  std::vector<std::string> allowed_hosts;
  /// Pages of other origins ("https://dashboard.example") that may send commands and open WebSockets and event streams
  /// from a browser, besides those of this server; "*": any. Others get 403. A client that sends no Origin is not a
  /// page in a browser, and is not concerned.
  std::vector<std::string> allowed_origins;
  /// Pages of other origins ("https://dashboard.example") that may read responses in a browser (GET, HEAD, OPTIONS,
  /// queries by POST; CORS), besides those of this server and of allowed_origins; "*": any. Default: none; browsers hide the responses
  /// from all other pages. Other clients than browsers are not concerned. With "*", each page that somebody visits can
  /// read the robot if the visitor's browser can connect to it, also where the robot itself cannot be reached from the
  /// Internet. Commands, WebSockets and event streams depend on allowed_origins.
  std::vector<std::string> read_origins;
  /// Servers whose notifications this server carries out as commands, by their base IRI ("http://arm.example:8080");
  /// "*": all but its own. Default: none; a PUT, POST or DELETE with the field Lrt-Notification-Of gets 403. Otherwise
  /// a client of another robot that may call this one could subscribe an action or a writable Property of this robot to
  /// that robot's resource, and so move this robot.
  std::vector<std::string> notification_senders;
  /// Limits of one principal or one address: requests, bytes, invocations, subscriptions.
  security::ClientLimits clients;
  /// Base IRIs with a loopback name and a port that is not the server's, for which representations and subscriptions
  /// are kept at a time. Another one replaces the one that was used least recently. If subscriptions hold all of them,
  /// its representations have the listening address as their base.
  std::size_t max_forwarded_bases = 8;
};

/// What lrt::Options and EngineOptions have in common.
struct CommonOptions {
  subscription::SubscriptionOptions subscriptions;   ///< queues, rates and numbers of subscriptions
  const Clock* clock = nullptr;                      ///< nullptr: system_clock()
  LogCallback log;                                   ///< empty: messages are dropped
  std::shared_ptr<IdSource> ids;                     ///< of invocations, members and subscriptions; nullptr: RandomIds
  rdf::Prefixes prefixes = rdf::default_prefixes();  ///< for Turtle and other syntaxes
  /// The namespace of the terms that lrt makes of C++ types: `<vocabulary>Type/field`. An absolute IRI that ends with
  /// '#' or '/'. Empty: "<base>/ns/vocabulary#", a document of this server. If the robots of a fleet have the same
  /// namespace, they have the same terms, so that one query finds the values of all. Each robot still serves its terms
  /// at /ns/vocabulary; the integrator serves the namespace itself.
  std::string vocabulary;
  /// Answers queries: lrt::query::endpoint() of query.hpp. nullptr: there is no endpoint.
  std::shared_ptr<const QueryService> query;
  std::shared_ptr<const PageSource> page;  ///< the console page; nullptr: that of lrt
  /// What people call the robot: dcterms:title of the root, in one language or several. Empty: "Robotic Things".
  rdf::Texts title;
  rdf::Texts description;  ///< a sentence or more about the robot: dcterms:description of the root
  /// JSON-LD contexts of others that bodies of requests may refer to by IRI, besides the server's own. None is fetched: a
  /// body that refers to another one is refused (422).
  rdf::Contexts contexts;
  /// Which robot this is; with an empty `iri`: the server has no identity. A bridge to an MQTT broker needs one, or a public base.
  Identity identity;
};

/// The verdict of an authorizer.
enum class Access : std::uint8_t {
  granted,            ///< the request is served
  unauthenticated,    ///< 401, with Security::challenge
  forbidden,          ///< 403
  too_many_requests,  ///< 429, with Retry-After
};
/// Authorizes a request by its header section: the body has not been received, and `body` is empty. A GET with
/// `Upgrade: callback` makes the robot post to a URL, so do not grant it to clients that may only read.
///
/// @par Errors   An exception is answered with 500.
/// @par Threads  Called without a lock of lrt: on the I/O thread (Io::own_thread), in poll() (Io::in_poll), or on the
///               thread that calls Server::serve().
using Authorizer = std::function<Access(const http::Request&)>;

}  // namespace v0
}  // namespace lrt::engine
