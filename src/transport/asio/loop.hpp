#pragma once

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/basic_stream_socket.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/intrusive/list.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/transport/transport.hpp>

#include "src/transport/asio/addresses.hpp"
#include "src/transport/asio/deadlines.hpp"
#include "src/transport/asio/readiness.hpp"
#include "src/transport/asio/session.hpp"
#include "src/transport/asio/tls.hpp"

namespace lrt::transport {

class Client;
class Connection;
class WebSocket;

/// A socket whose executor is known at compile time: any_io_executor costs virtual calls per wait.
using Socket = boost::asio::basic_stream_socket<boost::asio::ip::tcp, boost::asio::io_context::executor_type>;

/// Base of what has a place in an IdleOrder; leaves it with the last breath.
using IdleEntry = boost::intrusive::list_base_hook<boost::intrusive::link_mode<boost::intrusive::auto_unlink>>;
/// Connections whose session is in Phase::idle, the one that has been there longest first.
using IdleOrder = boost::intrusive::list<IdleEntry, boost::intrusive::constant_time_size<false>>;

/// Base of what has a place in a TurnOrder.
struct TurnTag;
using TurnEntry =
    boost::intrusive::list_base_hook<boost::intrusive::tag<TurnTag>, boost::intrusive::link_mode<boost::intrusive::auto_unlink>>;
/// WebSockets that may have more to send, and let the others go first.
using TurnOrder =
    boost::intrusive::list<TurnEntry, boost::intrusive::base_hook<TurnEntry>, boost::intrusive::constant_time_size<false>>;

/// What the clients of one transport share. One thread.
struct Loop {
  explicit Loop(Options given)
      : options(std::move(given)),
        clock(options.clock ? *options.clock : system_clock()),
        io(BOOST_ASIO_CONCURRENCY_HINT_UNSAFE),
        readiness(io),
        context(options.limits),
        addresses(options.limits.connections_per_address) {}

  void log(LogLevel level, std::string_view text) const {
    if (options.log) options.log(level, text);
  }

  /// Runs `step` after what is ready now. The poll() under way, or the next one, which then does not wait.
  template <class Step>
  void later(Step step) {
    has_later = true;
    boost::asio::post(io, std::move(step));
  }

  const Options options;
  const Clock& clock;
  boost::asio::io_context io;  ///< run inside poll() and stop() only, hence without locks
  Readiness readiness;
  SessionContext context;
  TlsPort tls;  ///< used when options.tls is set
  Addresses addresses;
  Deadlines deadlines;
  IdleOrder idle;
  std::vector<std::shared_ptr<Client>> clients;
  std::unordered_map<std::uint64_t, Connection*> tickets;    ///< whose deferred answers are open
  std::unordered_map<std::uint64_t, WebSocket*> channels;
  TurnOrder turns;
  bool has_later = false;  ///< later() was called since the last poll() that ran everything
  std::size_t refused = 0;                                   ///< connections over the limit, while they get their 503
  std::vector<char> scratch = std::vector<char>(64 * 1024);  ///< what is being received, by whichever connection is at work
};

}  // namespace lrt::transport
