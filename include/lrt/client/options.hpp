// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/log.hpp>
#include <lrt/base/thread_options.hpp>
#include <lrt/rdf/codec.hpp>

namespace lrt::client {
inline namespace v0 {

/// The identity with which a client sends requests. It is sent only to origins that the program itself names: those of
/// Client::open(), property(), action(), invocation() and watch(), and trusted_origins. A link or a redirect to another
/// origin is followed without it.
struct Identity {
  std::string token;       ///< bearer token (RFC 6750)
  std::string token_file;  ///< a file whose first line is the token; read again when a server responds 401
  /// @{
  /// HTTP Basic (RFC 7617), only over TLS or to this machine.
  std::string user, password;
  /// @}
  std::string certificate_file;                             ///< certificate of the client with its chain, PEM; sent to these origins only
  std::string key_file;                                     ///< its private key, PEM
  std::vector<std::string> trusted_origins;                 ///< "https://robot.example:8443"
  std::vector<std::pair<std::string, std::string>> fields;  ///< further header fields of each request to these origins
};

/// Limits of what a server can make a client do. Beyond a limit: Errc::limit_exceeded or timed_out.
struct Limits {
  std::chrono::milliseconds resolve_time{2'000};    ///< for the address of a name
  std::chrono::milliseconds connect_time{2'000};    ///< for connecting, including the TLS handshake
  std::chrono::milliseconds response_time{10'000};  ///< for a whole exchange with its redirects; of a stream: until its header section is complete
  unsigned max_redirects = 5;                       ///< of one request
  std::size_t max_header_bytes = 64 * 1024;         ///< of a response
  std::size_t max_body_bytes = 16 * 1024 * 1024;    ///< of a response, also of its decoded form
  std::size_t max_triples = 500'000;                ///< of a representation
  std::size_t max_resources = 20'000;               ///< read by one Client::open()
  unsigned max_depth = 32;                          ///< links between the URL of Client::open() and a resource
  std::size_t max_cached_bytes = 64 * 1024 * 1024;  ///< of representations that are cached for conditional requests
  std::size_t max_idle_connections = 32;            ///< open connections without an exchange
  std::size_t max_streams = 64;                     ///< event streams at a time; each has a thread
  std::size_t max_message_bytes = 4 * 1024 * 1024;  ///< of one message of a subscription
  std::size_t max_waiting_changes = 1'000;          ///< of one watch, until poll() delivers them; beyond it the oldest are dropped and counted
};

/// The thread on which the callbacks of a client run.
enum class Callbacks : unsigned char {
  in_poll,        ///< in Client::poll(): for a program with its own loop
  in_background,  ///< on a thread of lrt
};

/// Options of a Client. Set-up only.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
///               Client::create() takes a copy. For `log` see LogCallback.
struct Options {
  Identity identity;    ///< credentials
  Limits limits;        ///< memory and time
  std::string ca_file;  ///< certificate authorities, PEM; empty: those of the system
  /// Value of Accept for representations. If a server has none of these types and responds with another one, it is read
  /// if it is RDF.
  std::string accept = "text/turtle, application/n-triples;q=0.9, application/ld+json;q=0.8, application/rdf+xml;q=0.5";
  /// How long a command is worth carrying out, but for a stop and the cancelling of an invocation. It is sent with the
  /// time by the clock of its server (Valid-Until), so that it is not carried out later than that, and its sender is told
  /// within that time that it is not confirmed (Errc::unconfirmed). For that the client needs a response or a heartbeat of
  /// that server; if it has none, or none of the last hundred lives, it sends one request more (OPTIONS). A server without
  /// the field Robot-Time gets neither, and the limit for its response is Limits::response_time. 0: commands do not expire.
  /// A command with a large body needs a longer life: Request::life.
  std::chrono::milliseconds command_life{2'000};
  bool validate = true;                      ///< an input that violates the published shape is not sent
  Callbacks callbacks = Callbacks::in_poll;  ///< where callbacks run
  ThreadOptions threads;                     ///< of the threads of the client
  LogCallback log;                           ///< debug: each request with its status, "GET http://robot/arm: 200"
  rdf::Contexts contexts;                    ///< JSON-LD contexts of others, to which representations may refer; none is fetched
  /// Where what robots are (their structure documents, SPEC 3.24) is kept for the next program: a folder of its own, for which this client makes files
  /// that only its owner can read. It is made if necessary; 64 documents and 64 MiB at most. Each is asked for again by one conditional request, and is
  /// used for the same robot and the same identity only. Empty: they are kept in memory.
  std::string cache_folder;
  std::chrono::seconds cache_age{0};  ///< a kept document that the server confirmed so recently is used without a request
};

}  // namespace v0
}  // namespace lrt::client
