// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/tls.hpp"

#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <arpa/inet.h>

#include <array>
#include <stdexcept>

#include "src/base/third_party_call.hpp"

namespace lrt::exchange {
namespace {

std::string last_error(const std::string& fallback) {
  const unsigned long code = ERR_peek_last_error();
  const char* const reason = code != 0 ? ERR_reason_error_string(code) : nullptr;
  ERR_clear_error();
  return reason != nullptr ? reason : fallback;
}

std::string hex(const unsigned char* bytes, unsigned size) {
  static constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (unsigned i = 0; i < size; ++i) text += {digits[bytes[i] >> 4], digits[bytes[i] & 0x0FU]};
  return text;
}

void close_at_exit() noexcept { [[maybe_unused]] static const bool closes = ThirdPartyCall::close_at_exit(); }

}  // namespace

void TlsSessionEnd::operator()(ssl_st* session) const noexcept {
  if (const ThirdPartyCall call; call) SSL_free(session);
}
void ClientTls::ContextEnd::operator()(ssl_ctx_st* context) const noexcept {
  if (const ThirdPartyCall call; call) SSL_CTX_free(context);
}

Result<std::shared_ptr<const ClientTls>> ClientTls::make(const std::string& ca_file, const std::string& certificate_file,
                                                         const std::string& key_file) {
  const ThirdPartyCall call;
  if (!call) return unexpected(Errc::cancelled, "the process is exiting");
  auto result = std::make_shared<ClientTls>();
  ERR_clear_error();
  result->context_.reset(SSL_CTX_new(TLS_client_method()));
  SSL_CTX* const context = result->context_.get();
  if (context == nullptr) return unexpected(Errc::io_error, "TLS: " + last_error("no context"));
  close_at_exit();
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
  SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER | SSL_MODE_RELEASE_BUFFERS);
  const bool loaded =
      ca_file.empty() ? SSL_CTX_set_default_verify_paths(context) == 1 : SSL_CTX_load_verify_locations(context, ca_file.c_str(), nullptr) == 1;
  if (!loaded) {
    return unexpected(Errc::invalid_option,
                      "certificate authorities" + (ca_file.empty() ? "" : ", \"" + ca_file + "\"") + ": " + last_error("not readable"));
  }
  if (!certificate_file.empty() && SSL_CTX_use_certificate_chain_file(context, certificate_file.c_str()) != 1)
    return unexpected(Errc::invalid_option, "certificate \"" + certificate_file + "\": " + last_error("not readable"));
  if (!key_file.empty() &&
      (SSL_CTX_use_PrivateKey_file(context, key_file.c_str(), SSL_FILETYPE_PEM) != 1 || SSL_CTX_check_private_key(context) != 1)) {
    return unexpected(Errc::invalid_option, "private key \"" + key_file + "\": " + last_error("not readable"));
  }
  return std::shared_ptr<const ClientTls>(std::move(result));
}

TlsSession ClientTls::session(int descriptor, const std::string& host) const {
  const ThirdPartyCall call;
  if (!call) return nullptr;
  TlsSession result(SSL_new(context_.get()));
  SSL* const ssl = result.get();
  if (ssl == nullptr || SSL_set_fd(ssl, descriptor) != 1) return nullptr;
  std::string name = host;
  if (!name.empty() && name.front() == '[') name = name.substr(1, name.size() - 2);
  if (!name.empty() && name.back() == '.') name.pop_back();
  SSL_set_hostflags(ssl, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
  std::array<unsigned char, 16> ignored{};
  const bool is_address = ::inet_pton(AF_INET, name.c_str(), ignored.data()) == 1 || ::inet_pton(AF_INET6, name.c_str(), ignored.data()) == 1;
  const bool set = is_address ? X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), name.c_str()) == 1
                              : SSL_set1_host(ssl, name.c_str()) == 1 && SSL_set_tlsext_host_name(ssl, name.c_str()) == 1;
  if (!set) return nullptr;                                                                  // otherwise a certificate of any host would be accepted
  static constexpr unsigned char protocols[] = {8, 'h', 't', 't', 'p', '/', '1', '.', '1'};  // RFC 7301: no HTTP/2 here
  if (SSL_set_alpn_protos(ssl, protocols, sizeof protocols) != 0) return nullptr;
  SSL_set_connect_state(ssl);
  return result;
}

std::string tls_reason(const ssl_st* session, const std::string& fallback) {
  if (const long verdict = SSL_get_verify_result(session); verdict != X509_V_OK) {
    ERR_clear_error();
    return std::string("its certificate is not accepted: ") + X509_verify_cert_error_string(verdict);
  }
  return last_error(fallback);
}

std::string sign(std::string_view secret, std::string_view body) {
  const ThirdPartyCall call;
  if (!call) throw std::runtime_error("the process is exiting");
  std::array<unsigned char, EVP_MAX_MD_SIZE> mac{};
  unsigned size = 0;
  if (HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()), reinterpret_cast<const unsigned char*>(body.data()), body.size(), mac.data(),
           &size) == nullptr) {
    throw std::runtime_error("HMAC-SHA256 failed");
  }
  close_at_exit();
  return "sha256=" + hex(mac.data(), size);
}

std::string sha256(std::string_view text) {
  const ThirdPartyCall call;
  if (!call) throw std::runtime_error("the process is exiting");
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (EVP_Digest(text.data(), text.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1) throw std::runtime_error("SHA-256 failed");
  close_at_exit();
  return hex(digest.data(), size);
}

}  // namespace lrt::exchange
