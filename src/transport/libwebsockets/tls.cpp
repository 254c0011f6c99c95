// SPDX-License-Identifier: Apache-2.0
#include "src/transport/libwebsockets/tls.hpp"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>

#include <memory>

#include "src/base/third_party_call.hpp"

namespace lrt::libwebsockets {
namespace {

Unexpected file_error(const std::string& path) {
  char text[256] = "it cannot be read";
  if (const auto code = ERR_get_error(); code != 0) ERR_error_string_n(code, text, sizeof text);
  ERR_clear_error();
  return unexpected(Errc::io_error, "TLS: " + path + ": " + text);
}

/// Replaces the password callback of OpenSSL, which prompts on the terminal.
int no_passphrase(char*, int, int, void*) { return 0; }

}  // namespace

Result<void> load_tls(SSL_CTX* context, const transport::TlsOptions& options) {
  SSL_CTX_set_default_passwd_cb(context, &no_passphrase);
  ERR_clear_error();
  if (SSL_CTX_use_certificate_chain_file(context, options.certificate_file.c_str()) != 1) return file_error(options.certificate_file);
  if (SSL_CTX_use_PrivateKey_file(context, options.key_file.c_str(), SSL_FILETYPE_PEM) != 1) return file_error(options.key_file);
  if (SSL_CTX_check_private_key(context) != 1) return file_error(options.key_file);
  if (!set_up_tls(context, options)) return file_error(options.client_ca_file);
  return {};
}

Result<void> check_tls_files(const transport::TlsOptions& options) {
  const std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
  if (!context) return unexpected(Errc::io_error, "TLS: no context");
  [[maybe_unused]] static const bool closes = ThirdPartyCall::close_at_exit();
  return load_tls(context.get(), options);
}

bool set_up_tls(SSL_CTX* context, const transport::TlsOptions& options) {
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  if (SSL_CTX_set_cipher_list(context, "ECDHE+AESGCM:ECDHE+CHACHA20") != 1) return false;  // RFC 9325 4.2
  SSL_CTX_set_options(context, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);  // tickets need no memory here
  static constexpr unsigned char name[] = "lrt";
  SSL_CTX_set_session_id_context(context, name, sizeof name - 1);
  if (options.client_ca_file.empty()) return true;
  std::unique_ptr<X509_STORE, void (*)(X509_STORE*)> store(X509_STORE_new(), X509_STORE_free);
  if (!store || X509_STORE_load_locations(store.get(), options.client_ca_file.c_str(), nullptr) != 1) return false;
  SSL_CTX_set_cert_store(context, store.release());  // instead of all that the system trusts
  SSL_CTX_set_client_CA_list(context, SSL_load_client_CA_file(options.client_ca_file.c_str()));
  return true;
}

std::string client_subject(SSL* ssl) {
  if (ssl == nullptr) return {};
  const std::unique_ptr<X509, void (*)(X509*)> certificate(SSL_get_peer_certificate(ssl), X509_free);
  if (!certificate || SSL_get_verify_result(ssl) != X509_V_OK) return {};
  const std::unique_ptr<BIO, int (*)(BIO*)> text(BIO_new(BIO_s_mem()), BIO_free);
  if (!text || X509_NAME_print_ex(text.get(), X509_get_subject_name(certificate.get()), 0, XN_FLAG_RFC2253) < 0) return {};
  char* data = nullptr;
  const long size = BIO_get_mem_data(text.get(), &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}

}  // namespace lrt::libwebsockets
