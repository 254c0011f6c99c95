#pragma once

#include <memory>

#include "src/transport/port/protocols.hpp"

namespace lrt::transport {

class BeastWork;

/// Heads by Boost.Beast's parser, frames by its WebSocket stream.
class BeastProtocols final : public Protocols {
 public:
  BeastProtocols();
  ~BeastProtocols() override;

  std::optional<http::Refusal> read_head(std::string_view head, std::string& kept, http::Request& request) override;
  void write_head(std::string& out, const http::Response& response, std::string_view date, bool keep_alive, int version) override;
  Handshake accept(std::string_view key, std::size_t message_bytes) override;

 private:
  std::shared_ptr<BeastWork> work_;
};

}  // namespace lrt::transport
