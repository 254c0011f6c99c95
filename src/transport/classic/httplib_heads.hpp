#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/http/head.hpp>
#include <lrt/http/message.hpp>

namespace lrt::transport {

/// Heads taken apart and written by cpp-httplib's server, which stands on memory and serves nothing. One of them reads and writes all heads
/// of a port.
class HttplibHeads {
 public:
  HttplibHeads();
  ~HttplibHeads();

  /// As Protocols::read_head().
  std::optional<http::Refusal> read(std::string_view head, std::string& kept, http::Request& request);
  /// As Protocols::write_head(). Fields are in the order of their names.
  void write(std::string& out, const http::Response& response, std::string_view date, bool keep_alive, int version);

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace lrt::transport
