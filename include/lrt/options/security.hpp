// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lrt/engine/options.hpp>
#include <lrt/security.hpp>
#include <lrt/transport/options.hpp>

namespace lrt {
inline namespace v0 {

/// Who may do what (R0.2). By default programs on this machine may do everything, and the server listens on no other
/// address. Hosts, origins and limits of one client are in the base class.
/// @par Threads  Set-up only, as Options.
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

}  // namespace v0
}  // namespace lrt
