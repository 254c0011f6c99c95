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
  in_poll,     ///< Server::poll does everything, but judge large bodies (Threads::body_threads)
};

/// Where the server listens, and by which name clients know it.
struct Listen {
  /// An address, or a host name ("localhost", "robot.local"), which is resolved when the server is created. Its IPv4 addresses precede the others,
  /// and the first that this machine has is taken. Requests may name that host, and Server::url() does.
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  ///< 0: any free one, see Server::port
  /// Absolute IRI that representations use as base, "https://robot.example/cell7". Empty: from each request's Host (SPEC 3.7). A reverse proxy
  /// may keep its path in the target of a request or remove it. It must remove it if a Thing's path begins with it ("cell7/arm").
  std::string public_base;
  /// Makes the transport. Empty: the first of transport::names() is used.
  std::function<std::unique_ptr<transport::Transport>(transport::TransportOptions)> transport;
};

/// Who may do what (R0.2). The defaults let programs on this machine do everything.
struct Security {
  /// Certificate and key. If set, the port accepts HTTPS only.
  std::optional<transport::TlsOptions> tls;
  /// A file with the tokens of principals and their roles, as security::Tokens reads them. Looked at once a second: a token that is no longer in it
  /// is refused from then on, and if the file cannot be read, the tokens of before stay and the log says so. Change it by renaming another file to it: of one
  /// that is written in place, the half that is there may be read. A client sends its token as
  /// `Authorization: Bearer TOKEN`, or as the password of HTTP Basic, which is accepted over TLS only. The user of a browser logs in with it.
  std::string token_file;
  /// Principals by the subject of their client certificate (RFC 2253), as http::Request::client_certificate has it. Needs `tls` with a
  /// client_ca_file.
  std::map<std::string, security::Principal> certificates;
  /// Finds the principal of a request that has neither a known token nor a known certificate: for JWT, cookies and so on.
  security::Authenticate authenticate;
  /// What each role may do, in the whole server.
  security::Roles roles = security::default_roles();
  /// What principals and others may do to single resources and parts of the tree. With rules, these alone decide, and `roles` and `anyone` do not
  /// count: what no rule gives is forbidden. What a client may not see does not exist for it, in any response.
  std::vector<security::Rule> rules;
  /// A file with further rules, Web Access Control in Turtle as security::parse_rules() reads it. Looked at once a second as `token_file` is: if it
  /// cannot be read, the rules of before stay and the log says so. Subscriptions whose right is gone end.
  std::string policy_file;
  /// What clients may do without credentials if `token_file`, `certificates` or `authenticate` is set. By default nothing: they get 401.
  security::Rights anyone{};
  /// Sessions and tickets of clients that have a bearer token of `token_file` or `authenticate`. A browser that opens a page without credentials gets a
  /// form for the token. POST /ns/session with `Authorization: Bearer TOKEN`, of a page of this server, sets a cookie that stands for the token until
  /// DELETE /ns/session; only requests of this server's own pages may have it. POST /ns/ticket gives a ticket, with which a script elsewhere opens one
  /// WebSocket or event stream (`?ticket=`).
  security::SessionOptions sessions;
  /// Judges each request, after the above. Empty: all clients that are let in by it may do what their roles say, and everything if none of it is
  /// set. Called once for each request, when its header section is complete and before
  /// its body is received (`body` is empty), on the thread that serves it, without a lock of lrt. The verdict holds until the response.
  engine::Authorizer authorize;
  std::string challenge = "Bearer";  ///< WWW-Authenticate of a 401
  /// Further hosts that a request may name in Host, besides the listening address, the names of this machine's loopback addresses, and the host
  /// of the public base: "robot.local" (with the listening port, or that of the public base) or "name:port". Others: 421. So a page whose own
  /// name resolves to this machine cannot read or command the robot.
  std::vector<std::string> allowed_hosts;
  /// Pages of other origins ("https://dashboard.example") that may send commands and open WebSockets and event streams from a browser, besides
  /// those of this server; "*": any. Others: 403. A client that sends no Origin is no browser's page.
  std::vector<std::string> allowed_origins;
  /// Allows listening on an address that is not a loopback address without TLS and without an authorizer. Then every client that can connect
  /// to the port can move the robot.
  bool allow_unprotected_network = false;
  /// Pages of other origins ("https://dashboard.example") that may read responses in a browser (GET, HEAD, OPTIONS; CORS), besides those of
  /// this server and of allowed_origins; "*": any. By default there are none: browsers keep the responses from all other pages. Other clients
  /// than browsers are not concerned. "*" makes the robot readable by each page that somebody visits whose browser can connect to the robot,
  /// also where the robot itself cannot be reached from the Internet. Commands, WebSockets and event streams depend on allowed_origins.
  std::vector<std::string> read_origins;
  /// Servers whose notifications this server carries out as commands, by their base IRI ("http://arm.example:8080"); "*": all but its own.
  /// By default none: a PUT, POST or DELETE with the field Lrt-Notification-Of is refused with 403. Otherwise a client of a robot that may
  /// call this one could subscribe an action or a writable Property of this robot to it, and so move this robot.
  std::vector<std::string> notification_senders;
  /// What one principal, or one address, may use: requests, bytes, invocations, subscriptions.
  security::ClientLimits clients;
  /// Who did what, as lines of JSON.
  security::Audit audit;
};

/// Bounds of what clients can use: memory, connections and time.
struct Limits : transport::Limits, engine::Limits {};

/// Web callbacks: receivers, retries, and how they are posted and kept.
struct Callbacks : subscription::CallbackOptions {
  /// The file that stores web callbacks across restarts. Empty: they are not stored. It is replaced atomically after each change, by a thread
  /// of its own (also with Io::in_poll). It has the callbacks' secrets and mode 0600. Directories that are missing are made with mode 0700.
  /// Something else than a file of lrt at that path (or at `file` + ".new") is an error of Server::create() and stays as it is; so is a file
  /// that another process uses (a lock on `file` + ".lock"). If the file is damaged, what can be read is restored, the file is kept as
  /// `file` + ".damaged-1", and the log says so. Two servers of one process need different files.
  std::string file;
  /// Makes the deliverer. Empty: delivery::make_deliverer. Not called if `allow` is empty.
  std::function<Result<std::unique_ptr<delivery::Deliverer>>(delivery::Source&, const subscription::CallbackOptions&, LogCallback)> deliverer;
  /// The response to a request that makes a web callback (201) or cancels one (204) waits until `file` is on the disk; requests that come
  /// together are written together. If the file cannot be written, the response is 503 and nothing has changed: the new callback does not exist,
  /// the cancelled one continues. false: responses do not wait, and a crash loses what was not written yet.
  bool respond_when_saved = true;
  std::chrono::milliseconds save_timeout{10'000};  ///< a request waits so long for the file; then 503 as above
};

/// Which threads run what.
struct Threads {
  Io io = Io::own_thread;
  Dispatch dispatch = Dispatch::in_poll;  ///< of things that do not have their own
  /// Runs the lambdas of things with Dispatch::executor. It must run each exactly once, at any time.
  std::function<void(std::function<void()>)> executor;
  /// Threads of lrt that parse and judge request bodies above Limits::small_body_bytes, so that neither the control loop nor other clients wait
  /// for them. They start with the first such body, and run no lambda. 0: the thread that serves judges every body, 1 MiB in up to 0.2 s.
  unsigned body_threads = 1;
  /// Policy, CPUs and stack of all threads that the server starts: lrt-io (Io::own_thread), lrt-run (Server::start), lrt-callback, lrt-resolve, lrt-save,
  /// lrt-body, lrt-audit. They do not inherit those of the thread that creates the server, and block all signals; a process that a lambda starts there
  /// inherits the mask.
  ThreadOptions own;
};

/// Options of a Server. The defaults suit a robot on a developer's desk.
struct Options {
  Listen listen;
  Security security;
  Limits limits;
  subscription::SubscriptionOptions subscriptions;
  Callbacks callbacks;
  Threads threads;
  const Clock* clock = nullptr;                      ///< nullptr: system_clock()
  LogCallback log;                                   ///< empty: messages are dropped
  std::shared_ptr<IdSource> ids;                     ///< of invocations, members and subscriptions; nullptr: RandomIds
  rdf::Prefixes prefixes = rdf::default_prefixes();  ///< of Turtle and other syntaxes
  /// The namespace of the terms that lrt makes of C++ types: `<vocabulary>Type/field`. An absolute IRI that ends with '#' or '/'. Empty:
  /// "<base>/ns/vocabulary#", a document of this server. The robots of a fleet that give the same namespace have the same terms, so that
  /// one query finds the values of all. Each then still serves its terms at /ns/vocabulary; at the namespace itself the integrator does.
  std::string vocabulary;
  /// Answers queries: lrt::query::endpoint() of query.hpp. nullptr: there is no endpoint.
  std::shared_ptr<const engine::QueryService> query;
  std::shared_ptr<const engine::PageSource> page;  ///< HTML for people; nullptr: the page of lrt
};

}  // namespace v0
}  // namespace lrt
