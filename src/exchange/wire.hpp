// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

#include "src/base/resolve.hpp"
#include "src/exchange/tls.hpp"

namespace lrt::exchange {

using Instant = std::chrono::steady_clock::time_point;

/// Bounds a wait for the peer.
struct WaitLimit {
  Instant until;
  int stop_descriptor;                ///< readable once the waits are to end
  std::chrono::milliseconds idle{0};  ///< of the body of a stream, see exchange(); 0: the body is bounded by `until`, too
};

/// What a call that does not wait needs before it can go on.
enum class Needs : unsigned char { nothing, readable, writable };

/// What a call that does not wait has read or written.
struct Moved {
  std::size_t bytes = 0;
  Needs needs = Needs::nothing;  ///< if `bytes` is 0. Nothing is needed: the peer has closed its side
};

/// A connection to another host, plain or with TLS. Its functions wait within a WaitLimit, but for those that begin with begin_ or try_.
///
/// It is bytes only, so that HTTP and WebSockets can share it. A time limit is not renewed by a byte that arrives.
/// @par Threads  distinct objects: any; one object: one at a time, with SIGPIPE blocked (OpenSSL writes without MSG_NOSIGNAL)
class LRT_INTERNAL_API Wire {
 public:
  static Result<std::unique_ptr<Wire>> open(const Address& address, std::uint16_t port, WaitLimit limit);
  ~Wire();
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  /// Begins to connect. try_connect() goes on when the descriptor is writable.
  static Result<std::unique_ptr<Wire>> begin(const Address& address, std::uint16_t port);
  /// @return  writable: it is not connected yet
  Result<Needs> try_connect();
  /// @pre it is connected. try_secure() follows.
  Result<void> begin_secure(const ClientTls& tls, const std::string& host);
  Result<Needs> try_secure();
  Result<Moved> try_read(char* to, std::size_t size);
  Result<Moved> try_write(std::string_view bytes);
  int descriptor() const noexcept { return descriptor_; }

  /// Performs the TLS handshake. The certificate must be valid for `host`.
  Result<void> secure(const ClientTls& tls, const std::string& host, WaitLimit limit);

  /// Reads up to `size` bytes, at least one. 0: the peer has closed its side.
  /// @par Errors  closed, timed_out, cancelled (the stop descriptor is readable), io_error
  Result<std::size_t> read(char* to, std::size_t size, WaitLimit limit);
  /// @par Errors  as read()
  Result<void> write(std::string_view bytes, WaitLimit limit);
  /// Whether it can be used for another exchange: it is open, and no unexpected bytes were received.
  bool is_idle();
  /// Sends the TLS close alert, if TLS is used. Does not wait.
  void end() noexcept;

 private:
  explicit Wire(int descriptor) noexcept : descriptor_(descriptor) {}
  Result<void> wait(Needs needs, WaitLimit limit) const;

  int descriptor_;
  TlsSession tls_;
};

}  // namespace lrt::exchange
