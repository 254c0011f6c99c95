// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/transport/transport.hpp>

#if __has_include(<boost/version.hpp>)
#include <boost/version.hpp>  // macros: the version of Boost that the host is compiled with
#endif

namespace boost::asio {
class io_context;
}

namespace lrt::transport {
inline namespace v0 {

#ifdef BOOST_VERSION
namespace detail {
/// Defined for the version of Boost with which lrt was compiled. A host with another version does not link.
template <int boost_version>
LRT_API std::unique_ptr<Transport> make_http_on_loop(TransportOptions options, boost::asio::io_context& io);
}  // namespace detail

/// make_http() on the host's io_context. The threads that run it serve requests and call the lambdas of Things; the
/// host does not poll. Requires Io::in_poll.
///
/// @param options  options of the transport
/// @param io       must outlive the transport. Host and lrt must be compiled with the same version of Boost: otherwise
///                 the host does not link.
/// @par Threads  Those that run `io`, one at a time.
inline std::unique_ptr<Transport> make_http(TransportOptions options, boost::asio::io_context& io) {
  return detail::make_http_on_loop<BOOST_VERSION>(std::move(options), io);
}
#endif

}  // namespace v0
}  // namespace lrt::transport
