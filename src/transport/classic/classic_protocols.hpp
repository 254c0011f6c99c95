#pragma once

#include <memory>

#include "src/transport/classic/httplib_heads.hpp"
#include "src/transport/port/protocols.hpp"

namespace lrt::transport {

class LwsContext;

/// Heads by cpp-httplib, frames by libwebsockets. Neither gets a client's socket, a thread or a wait.
class ClassicProtocols final : public Protocols {
 public:
  ClassicProtocols();
  /// All its Frames are gone before it.
  ~ClassicProtocols() override;

  std::optional<http::Refusal> read_head(std::string_view head, std::string& kept, http::Request& request) override;
  void write_head(std::string& out, const http::Response& response, std::string_view date, bool keep_alive, int version) override;
  Handshake accept(std::string_view key, std::size_t message_bytes) override;

 private:
  HttplibHeads heads_;
  std::shared_ptr<LwsContext> context_;  ///< made by the first accept(): few robots have a WebSocket at once
};

}  // namespace lrt::transport
