#pragma once

#include <memory>
#include <utility>

#include <lrt/transport/transport.hpp>

#if __has_include(<boost/version.hpp>)
#include <boost/version.hpp>  // macros: which Boost the host is compiled with
#endif

namespace boost::asio {
class io_context;
}

namespace lrt::transport {

/// HTTP/1.1 and WebSocket on one port by Boost.Beast. One event loop, no threads of its own.
std::unique_ptr<Transport> make_asio(Options options);

#ifdef BOOST_VERSION
namespace detail {
/// Defined for one version: that which lrt was compiled with. A host with another does not link.
template <int boost_version>
std::unique_ptr<Transport> make_asio_with(Options options, boost::asio::io_context& io);
}  // namespace detail

/// The same on the host's io_context: whoever runs that serves, and calls the lambdas of things; there is nothing to poll. Needs Io::in_poll.
///
/// @param io  must outlive the transport. Host and lrt must be compiled with the same version of Boost: else it does not link.
/// @par Threads  Of those that run `io`, one at a time.
inline std::unique_ptr<Transport> make_asio(Options options, boost::asio::io_context& io) {
  return detail::make_asio_with<BOOST_VERSION>(std::move(options), io);
}
#endif

}  // namespace lrt::transport
