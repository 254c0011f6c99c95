// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

#include "tests/support/folder.hpp"

namespace lrt::test {

/// A key and a certificate, made when the test runs.
struct Certificate {
  std::shared_ptr<EVP_PKEY> key;
  std::shared_ptr<X509> certificate;
};

struct CertificateText {
  std::string name;            ///< CN
  std::string alternatives{};  ///< "DNS:localhost,IP:127.0.0.1"
  long from_seconds = -3600, to_seconds = 3600;
  bool authority = false;
};

inline Certificate make_certificate(const CertificateText& text, const Certificate* issuer = nullptr) {
  static long serial = 1;
  const auto check = [](bool good) {
    if (!good) throw std::runtime_error("cannot make a certificate");
  };
  Certificate result;
  const std::unique_ptr<EVP_PKEY_CTX, void (*)(EVP_PKEY_CTX*)> maker(EVP_PKEY_CTX_new_id(EVP_PKEY_EC, nullptr), EVP_PKEY_CTX_free);
  EVP_PKEY* key = nullptr;
  check(maker && EVP_PKEY_keygen_init(maker.get()) == 1 && EVP_PKEY_CTX_set_ec_paramgen_curve_nid(maker.get(), NID_X9_62_prime256v1) == 1 &&
        EVP_PKEY_keygen(maker.get(), &key) == 1);
  result.key.reset(key, EVP_PKEY_free);
  result.certificate.reset(X509_new(), X509_free);
  X509* const x = result.certificate.get();
  X509_set_version(x, 2);
  ASN1_INTEGER_set(X509_get_serialNumber(x), serial++);
  X509_gmtime_adj(X509_getm_notBefore(x), text.from_seconds);
  X509_gmtime_adj(X509_getm_notAfter(x), text.to_seconds);
  X509_set_pubkey(x, key);
  X509_NAME_add_entry_by_txt(X509_get_subject_name(x), "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>(text.name.c_str()), -1, -1, 0);
  X509* const by = issuer != nullptr ? issuer->certificate.get() : x;
  X509_set_issuer_name(x, X509_get_subject_name(by));
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, by, x, nullptr, nullptr, 0);
  const auto extend = [&](int id, const std::string& value) {
    X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, id, value.c_str());
    check(extension != nullptr);
    X509_add_ext(x, extension, -1);
    X509_EXTENSION_free(extension);
  };
  extend(NID_basic_constraints, text.authority ? "critical,CA:TRUE" : "critical,CA:FALSE");
  if (!text.alternatives.empty()) extend(NID_subject_alt_name, text.alternatives);
  check(X509_sign(x, issuer != nullptr ? issuer->key.get() : key, EVP_sha256()) > 0);
  return result;
}

using TlsContext = std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)>;

inline TlsContext tls_server(const Certificate& own, int max_version = 0) {
  TlsContext context(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
  SSL_CTX_use_certificate(context.get(), own.certificate.get());
  SSL_CTX_use_PrivateKey(context.get(), own.key.get());
  if (max_version != 0) {
    SSL_CTX_set_security_level(context.get(), 0);
    SSL_CTX_set_min_proto_version(context.get(), TLS1_VERSION);
    SSL_CTX_set_max_proto_version(context.get(), max_version);
  }
  return context;
}

/// A file with certificates in PEM. The destructor removes it.
class PemFile {
 public:
  explicit PemFile(const Certificate& certificate) {
    FILE* const file = std::fopen(path_.c_str(), "w");
    PEM_write_X509(file, certificate.certificate.get());
    std::fclose(file);
  }
  const std::string& path() const noexcept { return path_; }

 private:
  const Folder folder_;
  const std::string path_ = folder_ / "certificate.pem";
};

}  // namespace lrt::test
