// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/base/abi.hpp>
#include <lrt/transport/transport.hpp>

struct lws_context;

namespace lrt::transport {
inline namespace v0 {

/// HTTP/1.1 and WebSocket on one port by libwebsockets 4.1 or later, which owns the sockets, parses the requests,
/// frames the messages, does TLS and runs the loop. For hosts that use libwebsockets already: the built-in transport is
/// stricter and faster, and enforces all limits.
///
/// Differences to the built-in transport:
/// - libwebsockets responds 403 without a problem document to a method that it does not know, to a target in
///   absolute-form, to `OPTIONS *`, to an invalid percent-escape, and to `Upgrade` with another value than "websocket":
///   a web callback is made by POST. `Upgrade: h2c` gets 400.
/// - A request with Transfer-Encoding gets 411. A request with POST, PUT or PATCH and without Content-Length has no
///   body and is the last of its connection. A request with a body and a WebSocket handshake that are pipelined get 503
///   (libwebsockets 4.1 would read the header section again, as the beginning of the body). Each of these responses and
///   of those above closes the connection.
/// - The target is the one that libwebsockets has decoded, encoded anew: "//", "/./" and "/../" are resolved, `%2F` is
///   a slash, '+' in a path is a space, ';' in a query is '&'. A target with `%00` closes the connection without a
///   response.
/// - A WebSocket handshake with Sec-WebSocket-Protocol gets 400, unless it offers `lrt.stamped`. A handshake is never deferred
///   (Request::must_upgrade_now): the WebSocket opens before a pulled property has been read, and closes with 1011 if
///   that fails. If a handler defers the response anyway, the WebSocket opens without the fields of the response, and a
///   later refusal closes it: 1013 for 503, 1011 for another 5xx, else 1008.
/// - While a response is deferred or an event stream is silent, the transport does not notice a half-closed connection,
///   but does notice a reset.
///
/// Requests that libwebsockets accepts although two parsers could read them differently: a LF alone as the end of a
/// line; a CR within a line (the rest of the line is skipped); obs-fold and a line without a colon (they hide the field
/// that follows). If an unknown field is repeated, only the first is visible. Before 4.3 unknown fields cannot be
/// listed: lrt queries those that it reads and those of proxies by name, and an authorizer sees no others. In
/// WebSockets it accepts frames without a mask, ends the connection without a close frame after a control frame that is
/// too long or a close of one byte, and does not send pending messages before it responds to a close. What
/// http::check_request() refuses is refused here, too. A strict proxy in front of the server removes these differences.
///
/// Limits that apply: max_body_bytes; max_connections (an idle connection is closed for the new one; a request that
/// arrives on it meanwhile gets 503, a stop is served); max_connections_per_address (the new connection is closed);
/// max_requests_per_connection; body_timeout; max_websocket_message_bytes; max_websocket_messages without pings.
/// max_header_bytes up to 65535, for the values and the unknown fields; beyond it, and after header_timeout, the
/// connection is closed without a response. In whole seconds, rounded up: header_timeout, idle_timeout, write_timeout,
/// ping_interval, pong_timeout. Limits that do not apply: max_line_bytes, linger_timeout, max_linger_bytes,
/// close_timeout. If a client does not take part in closing its connection, the connection stays for twice
/// header_timeout, unless another one needs its place. All times are those of the machine's clock, not of
/// TransportOptions::clock.
///
/// libwebsockets ignores SIGPIPE in the whole process. Its log is that of the whole process, too: while a transport has
/// an lws_context of its own, warnings and errors go to TransportOptions::log of the transport that was started last.
/// @par Threads  Any: it only makes the object, which is used as Transport says.
LRT_API std::unique_ptr<Transport> make_libwebsockets(TransportOptions options);

/// As above, as a vhost of the host's lws_context. The thread that runs lws_service() serves requests and calls the
/// lambdas of Things; the host does not poll. Requires Io::in_poll. The host's context determines header_timeout,
/// max_header_bytes, and where libwebsockets' log goes. stop() ends all connections at once, without 1001; with 4.1 a
/// port to which no client has connected stays bound until the first one does, or until the context is destroyed.
///
/// @param context  must outlive the transport; made with LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT if options.security.tls
///                 is set
/// @par Threads  The one thread that runs lws_service(): start(), stop() and destruction on it, outside of callbacks of
///               libwebsockets, or while no thread is in lws_service(). waker() and reload_tls(): any.
LRT_API std::unique_ptr<Transport> make_libwebsockets(TransportOptions options, lws_context* context);

}  // namespace v0
}  // namespace lrt::transport
