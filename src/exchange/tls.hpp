// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

struct ssl_st;
struct ssl_ctx_st;

namespace lrt::exchange {

struct TlsSessionEnd {
  void operator()(ssl_st* session) const noexcept;
};
using TlsSession = std::unique_ptr<ssl_st, TlsSessionEnd>;

/// A TLS context for connections to other hosts. It defines how certificates are checked. OpenSSL's process-wide settings stay unchanged.
/// @par Threads  const: any
class LRT_INTERNAL_API ClientTls {
 public:
  /// @param ca_file  PEM of certificate authorities; empty: the system's
  /// @param certificate_file, key_file  PEM of what the client shows, with its chain; empty: nothing
  /// @par Errors  invalid_option, with OpenSSL's reason
  static Result<std::shared_ptr<const ClientTls>> make(const std::string& ca_file, const std::string& certificate_file = {},
                                                       const std::string& key_file = {});

  /// A session on a connected socket, TLS 1.2 or later, for HTTP/1.1 (ALPN). Only a certificate for this host is accepted.
  /// @param host  as in a URL: a name (sent as SNI) or an address (not sent, RFC 6066 3)
  /// @return      nullptr: out of memory
  TlsSession session(int descriptor, const std::string& host) const;

 private:
  struct ContextEnd {
    void operator()(ssl_ctx_st* context) const noexcept;
  };
  std::unique_ptr<ssl_ctx_st, ContextEnd> context_;
};

/// Describes why the calling thread's last operation on a session failed. Clears OpenSSL's error queue of this thread.
std::string tls_reason(const ssl_st* session, const std::string& fallback);

/// The value of X-Hub-Signature (WebSub 7.1): "sha256=" and the lower-case hex of HMAC-SHA256.
LRT_INTERNAL_API std::string sign(std::string_view secret, std::string_view body);

/// The digest of a text in lower-case hex (FIPS 180-4).
LRT_INTERNAL_API std::string sha256(std::string_view text);

}  // namespace lrt::exchange
