#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/transport/session.hpp>
#include <lrt/transport/transport.hpp>

#include "src/transport/port/addresses.hpp"
#include "src/transport/port/deadlines.hpp"
#include "src/transport/port/list.hpp"
#include "src/transport/port/protocols.hpp"
#include "src/transport/port/readiness.hpp"
#include "src/transport/port/tls.hpp"

namespace lrt::transport {

class Client;
class Connection;
class WebSocket;

/// Connections whose session is in Phase::idle, the one that has been there longest first.
struct IdleTag;
using IdleOrder = List<Connection, IdleTag>;
/// WebSockets that may have more to send, and let the others go first.
struct TurnTag;
using TurnOrder = List<WebSocket, TurnTag>;

/// What the clients of one transport share. One thread.
struct Loop {
  Loop(Options given, std::unique_ptr<Protocols> given_protocols)
      : options(std::move(given)),
        clock(options.clock ? *options.clock : system_clock()),
        protocols(std::move(given_protocols)),
        context(options.limits, *protocols),
        addresses(options.limits.connections_per_address) {
    context.websockets = true;
  }

  void log(LogLevel level, std::string_view text) const {
    if (options.log) options.log(level, text);
  }

  const Options options;
  const Clock& clock;
  const std::unique_ptr<Protocols> protocols;
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
  std::size_t refused = 0;                                   ///< connections over the limit, while they get their 503
  std::vector<char> scratch = std::vector<char>(64 * 1024);  ///< what is being received, by whichever connection is at work
};

}  // namespace lrt::transport
