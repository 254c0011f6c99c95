#pragma once

#include <cstddef>
#include <memory>
#include <string_view>

#include "src/transport/port/protocols.hpp"

namespace lrt::transport {

/// What the frames of one BeastProtocols have in common: where Beast's stream posts what it does not do at once.
class BeastWork;
std::shared_ptr<BeastWork> make_beast_work();

/// Frames by Beast's WebSocket stream, which stands on memory instead of a socket.
/// @param work  outlives them
Protocols::Handshake make_beast_frames(BeastWork& work, std::string_view key, std::size_t message_bytes);

}  // namespace lrt::transport
