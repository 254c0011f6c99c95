#pragma once

#include <cstddef>
#include <memory>
#include <string_view>

#include "src/transport/port/protocols.hpp"

namespace lrt::transport {

/// What the frames of one ClassicProtocols have in common: libwebsockets' context, without a listening socket or a loop of its own. Takes 16
/// bytes for each descriptor that the process may have when it is made (RLIMIT_NOFILE), and serves none above.
class LwsContext;
/// nullptr when libwebsockets makes none.
std::shared_ptr<LwsContext> make_lws_context();

/// Frames by libwebsockets, at one end of a pair of sockets whose other end is ours.
Protocols::Handshake make_lws_frames(std::shared_ptr<LwsContext> context, std::string_view key, std::size_t message_bytes);

}  // namespace lrt::transport
