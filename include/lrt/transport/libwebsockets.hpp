#pragma once

#include <memory>

#include <lrt/transport/transport.hpp>

struct lws_context;

namespace lrt::transport {

/// HTTP/1.1 and WebSocket on one port by libwebsockets 4.1 or later, which owns the sockets, parses the requests, frames the messages, speaks
/// TLS and runs the loop. For hosts that use libwebsockets anyway; make_named("http") is stricter, faster and has more limits.
///
/// What differs from the built-in transport:
/// - A method that libwebsockets does not know, a target in absolute-form and `OPTIONS *` get 403 without a body. A request with
///   Transfer-Encoding gets 411. After each of them the connection is closed.
/// - A request with POST, PUT or PATCH and without Content-Length has no body and is the last of its connection.
/// - `Upgrade` with another value than "websocket" gets 403 or 400: a web callback is made by POST. A WebSocket handshake with
///   Sec-WebSocket-Protocol gets 400. After the response to a refused handshake the connection is closed.
/// - If the response to a handshake is deferred, the WebSocket opens at once, without the fields of the response; a refusal that comes later
///   closes it: 1013 for 503, 1011 for another 5xx, else 1008, with the status in the reason.
/// - The target is the one that libwebsockets has decoded, encoded anew: "//", "/./" and "/../" are resolved, `%2F` is a slash, '+' in a path
///   is a space, ';' in a query is '&'.
/// - Of a header section libwebsockets accepts without a trace: LF alone as the end of a line, a CR within a line (the rest of the line is
///   skipped), obs-fold and lines without a colon (they hide the field that follows). Of an unknown field that is repeated, the first is
///   seen. Before 4.3 there is no list of unknown fields: those that lrt reads are asked for by name, and some of proxies; an authorizer sees no others.
///   Everything else that http::check_head() refuses is refused here, too. A proxy in front that is stricter closes these gaps.
///
/// Of Limits: max_header_bytes (16-bit; more: closed without a response; request line and fields together, without their names),
/// max_body_bytes, max_connections (an idle connection makes room, else the new one is closed without a response), connections_per_address
/// (the same), requests_per_connection, body_time, write_time, websocket_message_bytes, websocket_messages (pings are not counted). In whole
/// seconds, rounded up: header_time (more: closed without a response), idle_time, ping_time, pong_time. Not: max_line_bytes, linger_time,
/// linger_bytes, close_time, for which libwebsockets has its own.
///
/// libwebsockets ignores SIGPIPE in the whole process. Its log is the whole process's, too: while a transport lives on an lws_context of its
/// own, warnings and errors go to TransportOptions::log of the last that was started.
std::unique_ptr<Transport> make_libwebsockets(Options options);

/// The same as a vhost of the host's lws_context: whoever runs lws_service() serves, and calls the lambdas of things; there is nothing to poll.
/// Needs Io::in_poll. The host's context decides header_time, header_bytes, and what becomes of libwebsockets' log. stop() closes connections at
/// once.
///
/// @param context  must outlive the transport; made with LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT if options.tls is set
/// @par Threads  The one that runs lws_service(), which is one; start() and stop() on it, or while nobody is in lws_service(). waker() and
///               reload_tls(): any.
std::unique_ptr<Transport> make_libwebsockets(Options options, lws_context* context);

}  // namespace lrt::transport
