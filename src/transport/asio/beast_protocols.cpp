#include "src/transport/asio/beast_protocols.hpp"

#include "src/transport/asio/beast_frames.hpp"
#include "src/transport/asio/beast_heads.hpp"

namespace lrt::transport {

BeastProtocols::BeastProtocols() : work_(make_beast_work()) {}
BeastProtocols::~BeastProtocols() = default;

std::optional<http::Refusal> BeastProtocols::read_head(std::string_view head, std::string&, http::Request& request) {
  return parse_head(head, request);
}

void BeastProtocols::write_head(std::string& out, const http::Response& response, std::string_view date, bool keep_alive, int version) {
  http::write_head(out, response, date, keep_alive, version);
}

Protocols::Handshake BeastProtocols::accept(std::string_view key, std::size_t message_bytes) {
  return make_beast_frames(*work_, key, message_bytes);
}

}  // namespace lrt::transport
