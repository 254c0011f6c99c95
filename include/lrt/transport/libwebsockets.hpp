// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/base/abi.hpp>
#include <lrt/transport/transport.hpp>

struct lws_context;

namespace lrt::transport {
inline namespace v0 {

/// The HTTP server of lrt (make_http()) on the event loop of a host's lws_context, of libwebsockets 4.1 or later. The
/// thread that runs lws_service() serves clients and calls the lambdas of Things; the host does not poll. Requires
/// Io::in_poll.
///
/// libwebsockets waits for one descriptor of lrt, beside all that the context does otherwise. It accepts no client of
/// lrt and reads no byte of one. Requests, WebSockets, TLS, limits, times and stop() are those of make_http(): a request
/// has the same response on both. lrt has a port of its own: it cannot share one with a vhost of the host.
///
/// The event library of the context does not matter (poll, libuv, libev, glib). In a round of the loop lrt works for about
/// 0.2 ms; what is left continues in the next round, after the host's own descriptors.
///
/// @param context  must outlive the transport. It needs no option: lrt loads the files of TransportOptions::tls itself.
///                 It gets a vhost "lrt" that does not listen, and uses one descriptor for each start() until stop()
///                 and the next round of the loop
/// @par Errors   of start(): invalid_option without a context or TransportOptions::turn; as make_http(); io_error if
///               libwebsockets does not accept the descriptor
/// @par Threads  The one thread that runs lws_service(): start(), stop() and destruction on it, outside of callbacks of
///               libwebsockets, or while no thread is in lws_service(). waker() and reload_tls(): any.
LRT_API std::unique_ptr<Transport> make_libwebsockets(TransportOptions options, lws_context* context);

/// As above, with an lws_context of its own from start() to stop(), whose loop poll() runs: for tests of a program that
/// will have a context later. A program without one uses make_http(): it is the same server without a second library.
///
/// The log of libwebsockets is that of the whole process: while such a transport is started, warnings and errors go to
/// TransportOptions::log of the transport that was started last.
/// @par Threads  Any: it only makes the object, which is used as Transport says.
LRT_API std::unique_ptr<Transport> make_libwebsockets(TransportOptions options);

}  // namespace v0
}  // namespace lrt::transport
