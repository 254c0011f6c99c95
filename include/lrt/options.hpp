// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/ids.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>
#include <lrt/delivery/deliverer.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/security.hpp>
#include <lrt/subscription/options.hpp>
#include <lrt/transport/transport.hpp>

namespace lrt {
inline namespace v0 {

/// Which thread does the I/O (SPEC 3.10).
enum class Io : std::uint8_t {
  own_thread,  ///< a thread of lrt: requests for pushed and static resources do not need the host
  in_poll,     ///< Server::poll does everything except parsing large bodies (Threads::body_threads)
};

/// Where the server listens, and the name by which clients know it.
struct Listen {
  /// An address, or a host name ("localhost", "robot.local"), which is resolved when the server is created. Its IPv4
  /// addresses come first, and the first address that this machine has is used. Requests may name that host, and
  /// Server::url() contains it.
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  ///< 0: any free one, see Server::port()
  /// Absolute IRI that representations use as base, "https://robot.example/cell7". Empty: the base is from each
  /// request's Host (SPEC 3.7). A reverse proxy may keep its path in the target of a request or remove it. It must
  /// remove it if a Thing's path begins with it ("cell7/arm").
  std::string public_base;
  /// Makes the transport. Empty: the first of transport::names() is used.
  std::function<std::unique_ptr<transport::Transport>(transport::TransportOptions)> transport;
};

/// Who may do what (R0.2). By default programs on this machine may do everything, and the server listens on no other
/// address. Hosts, origins and limits of one client are in the base class.
struct Security : engine::RequestRules {
  /// Certificate and key. If set, the port accepts HTTPS only.
  std::optional<transport::TlsOptions> tls;
  /// A file with the tokens of principals and their roles, in the format of security::Tokens. The server checks it once
  /// a second. A token that was removed from it is refused from then on. If the file cannot be read, the previous
  /// tokens stay valid and the log says so. To change it, rename another file to it: a file that is written in place
  /// may be read half-written. A client sends its token as `Authorization: Bearer TOKEN`, or as the password of HTTP
  /// Basic, which is accepted over TLS only. The user of a browser logs in with it.
  std::string token_file;
  /// Principals by the subject of their client certificate (RFC 2253), see http::Request::client_certificate. Requires
  /// `tls` with a client_ca_file.
  std::map<std::string, security::Principal> certificates;
  /// Finds the principal of a request that has neither a known token nor a known certificate: for JWT, cookies and so
  /// on.
  security::Authenticate authenticate;
  /// What each role may do in the whole server.
  security::Roles roles = security::default_roles();
  /// What principals and other clients may do to single resources and parts of the tree. With rules, only they decide,
  /// and `roles` and `anyone` are ignored: a right that no rule gives is refused. No response reveals a resource that
  /// the client may not read.
  std::vector<security::Rule> rules;
  /// A file with further rules: Web Access Control in Turtle, see security::parse_rules(). It is checked once a second
  /// as `token_file` is: if it cannot be read, the previous rules stay valid and the log says so. A subscription ends
  /// when its right is removed.
  std::string policy_file;
  /// What clients without credentials may do if `token_file`, `certificates` or `authenticate` is set. Default:
  /// nothing; they get 401.
  security::Rights anyone{};
  /// Sessions and tickets for clients that have a bearer token of `token_file` or `authenticate`. A browser that opens
  /// a page without credentials gets a form for the token. POST /ns/session with `Authorization: Bearer TOKEN`, from a
  /// page of this server, sets a cookie that replaces the token until DELETE /ns/session; only requests of this
  /// server's own pages may use it. POST /ns/ticket returns a ticket, with which a script on another site opens one
  /// WebSocket or event stream (`?ticket=`).
  security::SessionOptions sessions;
  /// Authorizes each request, after the options above. Empty: clients may do what their roles allow, and everything if
  /// none of the options is set. It is called once for each request, when its header section is complete and before its
  /// body is received (`body` is empty), on the thread that serves the request, without a lock of lrt. The verdict is
  /// valid until the response.
  engine::Authorizer authorize;
  /// Allows listening on an address other than loopback without TLS, tokens, certificates, rules, `authenticate` and
  /// `authorize`. Then every client that can connect to the port can move the robot.
  bool allow_unprotected_network = false;
  /// The log of who did what, as lines of JSON.
  security::Audit audit;
};

/// Limits of what clients can use: memory, connections and time. The members are those of both base classes.
struct Limits : transport::Limits, engine::Limits {};

/// Web callbacks: receivers, retries, and how they are posted and kept.
struct Callbacks : subscription::CallbackOptions {
  /// The file that stores web callbacks across restarts. Empty: they are not stored. A thread of lrt replaces it
  /// atomically after each change (also with Io::in_poll). It contains the callbacks' secrets and has mode 0600.
  /// Missing directories are created with mode 0700. Server::create() returns an error and changes nothing if that path
  /// (or `file` + ".new") has something other than a file of lrt, or if another process uses the file (a lock on `file`
  /// + ".lock"). If the file is damaged, what can be read is restored, the file is kept as `file` + ".damaged-1", and
  /// the log says so. Two servers of one process need different files.
  std::string file;
  /// Makes the deliverer. Empty: delivery::make_deliverer. Not called if `allow` is empty.
  std::function<Result<std::unique_ptr<delivery::Deliverer>>(delivery::Source&, const subscription::CallbackOptions&, LogCallback)> deliverer;
  /// The response to a request that creates a web callback (201) or cancels one (204) waits until `file` is on the
  /// disk; requests that arrive together are written together. If the file cannot be written, the response is 503 and
  /// nothing has changed: the new callback does not exist, the cancelled one continues. false: responses do not wait,
  /// and a crash loses what was not written yet.
  bool respond_when_saved = true;
  std::chrono::milliseconds save_timeout{10'000};  ///< how long a request waits for the file; then 503 as above
};

/// Which threads run what.
struct Threads {
  Io io = Io::own_thread;                 ///< which thread does the I/O
  Dispatch dispatch = Dispatch::in_poll;  ///< of things that do not set their own
  /// Runs the lambdas of things with Dispatch::executor. It must run each function exactly once, at any time, on any
  /// thread.
  std::function<void(std::function<void()>)> executor;
  /// Number of lrt's threads that parse and validate request bodies above Limits::small_body_bytes, so that neither the
  /// control loop nor other clients wait for them. They start with the first such body and run no lambda. 0: the I/O
  /// thread parses every body; 1 MiB takes up to 0.2 s.
  unsigned body_threads = 1;
  /// Policy, CPUs and stack of all threads that the server starts: lrt-io (Io::own_thread), lrt-run (Server::start),
  /// lrt-callback, lrt-resolve, lrt-save, lrt-body, lrt-query, lrt-audit. They do not inherit those of the thread that
  /// creates the server. They block all signals; a process that a lambda starts on such a thread inherits the mask.
  ThreadOptions own;
};

/// Options of a Server. The defaults suit development on one machine. Queues of subscriptions, clock, log, ids, prefixes,
/// vocabulary, queries and page are in the base class.
///
///     lrt::Options options;
///     options.listen.address = "robot.local";
///     options.security.tls.emplace();
///     options.security.tls->certificate_file = "robot.pem";
///     options.security.tls->key_file = "robot.key";
///     options.security.token_file = "tokens.txt";
///     options.limits.max_connections = 100;
///     auto server = lrt::Server::create(std::move(options));
///
/// @par Threads  Set-up only: Server::create() takes them. Where the server calls the functions in them, each of these
///               says.
struct Options : engine::CommonOptions {
  Listen listen;        ///< address, port and public base
  Security security;    ///< TLS, authentication and authorization
  Limits limits;        ///< memory, connections and time
  Callbacks callbacks;  ///< web callbacks
  Threads threads;      ///< which threads run what
};

}  // namespace v0
}  // namespace lrt
