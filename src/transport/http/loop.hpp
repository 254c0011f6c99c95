// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/transport/session.hpp>
#include <lrt/transport/transport.hpp>

#include "src/transport/http/addresses.hpp"
#include "src/transport/http/deadlines.hpp"
#include "src/transport/http/list.hpp"
#include "src/transport/http/readiness.hpp"
#include "src/transport/http/tls.hpp"

namespace lrt::transport {

class Client;
class Connection;

/// Connections whose session is in Phase::idle, the one that has been idle for longest first.
struct IdleTag;
using IdleOrder = List<Connection, IdleTag>;
/// Connections beyond the limit whose request is not complete, the one that has waited for longest first.
struct ReservedTag;
using ReservedOrder = List<Connection, ReservedTag>;
/// Clients whose channel may have more messages, after the others have had their turn.
struct TurnTag;
using TurnOrder = List<Client, TurnTag>;

/// The messages for some clients. Kept, so that a round does not allocate.
struct PushRound {
  /// @pre Client::max_messages() is more than 0
  void add(Client& client);
  void clear() noexcept {
    requests.clear();
    clients.clear();
    pushes.clear();
  }
  std::vector<engine::PushRequest> requests;
  std::vector<Client*> clients;  ///< of the same index
  std::vector<engine::Push> pushes;
};

/// Clients over the limit that get a full 503 and linger, at one time; those beyond are closed at once.
constexpr std::size_t max_refused = 64;

/// The shared state of the connections of one transport. One thread.
struct Loop {
  explicit Loop(TransportOptions given)
      : options(std::move(given)),
        clock(options.clock ? *options.clock : system_clock()),
        context(options.limits),
        addresses(options.limits.max_connections_per_address) {
    context.websockets = context.streams = true;
  }

  void log(LogLevel level, std::string_view text) const {
    if (options.log) options.log(level, text);
  }

  const TransportOptions options;
  const Clock& clock;
  Readiness readiness;
  SessionContext context;
  TlsContext tls;  ///< used when options.tls is set
  Addresses addresses;
  Deadlines deadlines;
  IdleOrder idle;
  std::vector<std::shared_ptr<Client>> clients;
  std::unordered_map<std::uint64_t, Connection*> tickets;  ///< that wait for a deferred response
  std::unordered_map<std::uint64_t, Client*> channels;
  TurnOrder turns;
  PushRound pushes;
  std::uint64_t turn = 0;  ///< turns taken so far
  std::vector<engine::ReadyChannel> ready;
  std::vector<Client*> candidates;  ///< for the next turns, while they are put in order
  ReservedOrder reserved;
  std::size_t reserved_count = 0;                            ///< connections that serve only stops, in `reserved` or not
  std::size_t refused = 0;                                   ///< connections over the limit that are being sent a 503
  std::vector<char> scratch = std::vector<char>(64 * 1024);  ///< for received bytes during a read
};

}  // namespace lrt::transport
