#include "src/transport/classic/classic_protocols.hpp"

#include "src/transport/classic/lws_frames.hpp"

namespace lrt::transport {

ClassicProtocols::ClassicProtocols() = default;
ClassicProtocols::~ClassicProtocols() = default;

std::optional<http::Refusal> ClassicProtocols::read_head(std::string_view head, std::string& kept, http::Request& request) {
  return heads_.read(head, kept, request);
}

void ClassicProtocols::write_head(std::string& out, const http::Response& response, std::string_view date, bool keep_alive, int version) {
  heads_.write(out, response, date, keep_alive, version);
}

Protocols::Handshake ClassicProtocols::accept(std::string_view key, std::size_t message_bytes) {
  if (!context_) context_ = make_lws_context();
  if (!context_) return {};
  return make_lws_frames(context_, key, message_bytes);
}

}  // namespace lrt::transport
