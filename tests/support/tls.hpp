// SPDX-License-Identifier: Apache-2.0
#pragma once

// The client's side of TLS for tests, on memory: what it has to say is taken from it and what comes is given to it, by whoever drives it.

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>

#include "tests/delivery/certificates.hpp"
#include "tests/support/folder.hpp"

namespace lrt::test {

using SslContext = std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)>;

/// Trusts `authority`; changed further by the test.
inline SslContext tls_client(const Certificate& authority) {
  SslContext context(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
  X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), authority.certificate.get());
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  return context;
}

/// Certificates and keys as files in a folder of their own, for as long as it lives.
class TlsFolder {
 public:
  std::string path(const std::string& name) const { return folder_ / name; }
  std::string put(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }
  std::string put(const std::string& name, std::initializer_list<const Certificate*> chain) const {
    FILE* const file = std::fopen(path(name).c_str(), "w");
    for (const auto* const one : chain) PEM_write_X509(file, one->certificate.get());
    std::fclose(file);
    return path(name);
  }
  std::string put_key(const std::string& name, const Certificate& of, const char* passphrase = nullptr) const {
    FILE* const file = std::fopen(path(name).c_str(), "w");
    PEM_write_PrivateKey(file, of.key.get(), passphrase != nullptr ? EVP_aes_128_cbc() : nullptr, reinterpret_cast<const unsigned char*>(passphrase),
                         passphrase != nullptr ? 4 : 0, nullptr, nullptr);
    std::fclose(file);
    return path(name);
  }

 private:
  Folder folder_;
};

class TlsClientSide {
 public:
  explicit TlsClientSide(SSL_CTX* context) : ssl_(SSL_new(context), SSL_free), in_(BIO_new(BIO_s_mem())), out_(BIO_new(BIO_s_mem())) {
    SSL_set_bio(ssl_.get(), in_, out_);
    SSL_set_connect_state(ssl_.get());
    SSL_set1_host(ssl_.get(), "localhost");
    handshake();
  }

  /// Bytes of the server in, text out.
  std::string take(std::string_view bytes) {
    if (!bytes.empty()) BIO_write(in_, bytes.data(), static_cast<int>(bytes.size()));
    handshake();
    std::string text;
    if (!done()) return text;
    while (!waiting_.empty() && failure.empty()) {
      const int put = SSL_write(ssl_.get(), waiting_.data(), static_cast<int>(std::min<std::size_t>(waiting_.size(), 1U << 20)));
      if (put <= 0) note(put);
      if (put <= 0) break;
      waiting_.erase(0, static_cast<std::size_t>(put));
    }
    char buffer[16 * 1024];
    for (;;) {
      const int got = SSL_read(ssl_.get(), buffer, sizeof buffer);
      if (got <= 0) {
        note(got);
        break;
      }
      text.append(buffer, static_cast<std::size_t>(got));
    }
    return text;
  }
  void write(std::string_view text) { waiting_ += text; }
  /// What the client has to say now.
  std::string give() {
    std::string bytes;
    char buffer[16 * 1024];
    for (int got = 0; (got = BIO_read(out_, buffer, sizeof buffer)) > 0;) bytes.append(buffer, static_cast<std::size_t>(got));
    return bytes;
  }
  bool done() const { return SSL_is_init_finished(ssl_.get()) != 0; }
  SSL* get() const { return ssl_.get(); }

  bool closed = false;  ///< close_notify came
  std::string failure;  ///< what OpenSSL says

 private:
  void handshake() {
    if (done() || !failure.empty()) return;
    const int result = SSL_do_handshake(ssl_.get());
    if (result != 1) note(result);
  }
  void note(int result) {
    const int why = SSL_get_error(ssl_.get(), result);
    if (why == SSL_ERROR_ZERO_RETURN) closed = true;
    else if (why != SSL_ERROR_WANT_READ && why != SSL_ERROR_WANT_WRITE && failure.empty()) {
      const char* const words = ERR_reason_error_string(ERR_peek_error());
      failure = words != nullptr ? words : "?";
    }
    ERR_clear_error();
  }

  std::unique_ptr<SSL, void (*)(SSL*)> ssl_;
  BIO* in_;
  BIO* out_;
  std::string waiting_;
};

}  // namespace lrt::test
