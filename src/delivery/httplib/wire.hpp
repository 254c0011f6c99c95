#pragma once

#include <sys/socket.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>

#include "src/delivery/httplib/tls.hpp"

namespace lrt::delivery {

using Instant = std::chrono::steady_clock::time_point;

/// When a wait is over although nothing came.
struct Patience {
  Instant until;
  int ended;  ///< a descriptor that is readable once the deliverer stops
};

struct Address {
  sockaddr_storage socket{};
  socklen_t size = 0;
  std::string text;  ///< numeric
};

/// A connection to a receiver, plain or with TLS.
///
/// Every wait is ours: cpp-httplib's own sockets count their time anew with each byte, hold a mutex while they connect so that nobody
/// can end them, and look up names that were not checked.
/// @par Threads  distinct objects: any; one object: one at a time, with SIGPIPE blocked (OpenSSL writes without MSG_NOSIGNAL)
class Wire {
 public:
  static Result<std::unique_ptr<Wire>> open(const Address& address, Patience patience);
  ~Wire();
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  /// TLS with a receiver of that host, whose certificate must say so.
  Result<void> secure(const Tls& tls, const std::string& host, Patience patience);

  /// At least one byte; 0: the receiver has ended its side. closed when it hung up, timed_out, cancelled.
  Result<std::size_t> read(char* to, std::size_t most, Patience patience);
  /// Errors as read().
  Result<void> write(std::string_view bytes, Patience patience);
  /// Whether it can be used for another exchange: it is open, and nothing came that nobody asked for.
  bool is_idle();
  /// Says good-bye where the protocol has a word for it. Does not wait.
  void end() noexcept;

 private:
  explicit Wire(int descriptor) noexcept : descriptor_(descriptor) {}
  Result<void> wait(short events, Patience patience) const;

  int descriptor_;
  TlsSession tls_;
};

}  // namespace lrt::delivery
