#pragma once

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/basic_stream_socket.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/intrusive/list.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/transport/transport.hpp>

#include "src/transport/asio/deadlines.hpp"
#include "src/transport/asio/readiness.hpp"
#include "src/transport/asio/session.hpp"

namespace lrt::transport {

class Connection;

/// A socket whose executor is known at compile time: any_io_executor costs virtual calls per wait.
using Socket = boost::asio::basic_stream_socket<boost::asio::ip::tcp, boost::asio::io_context::executor_type>;

/// Base of what has a place in an IdleOrder; leaves it with the last breath.
using IdleEntry = boost::intrusive::list_base_hook<boost::intrusive::link_mode<boost::intrusive::auto_unlink>>;
/// Connections whose session is in Phase::idle, the one that has been there longest first.
using IdleOrder = boost::intrusive::list<IdleEntry, boost::intrusive::constant_time_size<false>>;

/// What the connections of one transport share. One thread.
struct Loop {
  explicit Loop(Options given)
      : options(std::move(given)),
        clock(options.clock ? *options.clock : system_clock()),
        io(BOOST_ASIO_CONCURRENCY_HINT_UNSAFE),
        readiness(io),
        context(options.limits) {}

  void log(LogLevel level, std::string_view text) const {
    if (options.log) options.log(level, text);
  }

  const Options options;
  const Clock& clock;
  boost::asio::io_context io;  ///< run inside poll() and stop() only, hence without locks
  Readiness readiness;
  SessionContext context;
  Deadlines deadlines;
  IdleOrder idle;
  std::vector<std::shared_ptr<Connection>> connections;
  std::unordered_map<std::uint64_t, Connection*> tickets;    ///< whose deferred answers are open
  std::size_t refused = 0;                                   ///< connections over the limit, while they get their 503
  std::vector<char> scratch = std::vector<char>(64 * 1024);  ///< what is being received, by whichever connection is at work
};

}  // namespace lrt::transport
