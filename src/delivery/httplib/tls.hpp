#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>

struct ssl_st;
struct ssl_ctx_st;

namespace lrt::delivery {

struct TlsSessionEnd {
  void operator()(ssl_st* session) const noexcept;
};
using TlsSession = std::unique_ptr<ssl_st, TlsSessionEnd>;

/// Whom to trust; the one place that knows how certificates are checked. Nothing of OpenSSL's own settings for the process is changed.
/// @par Threads  const: any
class Tls {
 public:
  /// @param ca_file  PEM of certificate authorities; empty: the system's
  /// @par Errors  invalid_option, with OpenSSL's reason
  static Result<std::shared_ptr<const Tls>> make(const std::string& ca_file);

  /// A session on a connected socket, TLS 1.2 or later, that accepts only a certificate for this host; nullptr: no memory.
  /// @param host  as in a URL: a name (sent as SNI), or an address (RFC 6066 3: not sent)
  TlsSession session(int descriptor, const std::string& host) const;

 private:
  struct ContextEnd {
    void operator()(ssl_ctx_st* context) const noexcept;
  };
  std::unique_ptr<ssl_ctx_st, ContextEnd> context_;
};

/// Why the calling thread's last operation on a session failed, in words; ends OpenSSL's list of this thread's errors.
std::string tls_reason(const ssl_st* session, const std::string& fallback);

/// The value of X-Hub-Signature (WebSub 7.1): "sha256=" and the lower-case hex of HMAC-SHA256.
std::string sign(std::string_view secret, std::string_view body);

}  // namespace lrt::delivery
