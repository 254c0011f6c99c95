// SPDX-License-Identifier: Apache-2.0
#include "src/security/certificate.hpp"

#include <openssl/asn1.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <ctime>
#include <memory>

#include "src/base/read_file.hpp"
#include "src/base/third_party_call.hpp"

namespace lrt::security {

namespace {

constexpr std::size_t max_certificate_bytes = 1024 * 1024;

std::chrono::system_clock::time_point point_of(const ASN1_TIME* time) {
  std::tm parts{};
  if (!time || ASN1_TIME_to_tm(time, &parts) != 1) return {};
  return std::chrono::system_clock::from_time_t(::timegm(&parts));
}

std::string text_of(const ASN1_STRING* text) {
  unsigned char* bytes = nullptr;
  const int size = text ? ASN1_STRING_to_UTF8(&bytes, text) : -1;
  if (size < 0) return {};
  std::string result(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size));
  OPENSSL_free(bytes);
  return result;
}

using Certificate = std::unique_ptr<X509, void (*)(X509*)>;
using Bytes = std::unique_ptr<BIO, int (*)(BIO*)>;

/// Without a function for the passphrase OpenSSL would ask for it on the terminal.
int no_passphrase(char*, int, int, void*) { return 0; }

Result<Certificate> certificate_in(const std::string& file) {
  const Result<std::string> text = read_file(file, max_certificate_bytes);
  if (!text) return unexpected(text.error().code, text.error().message);
  const Bytes bytes(BIO_new_mem_buf(text->data(), static_cast<int>(text->size())), BIO_free);
  Certificate certificate(bytes ? PEM_read_bio_X509(bytes.get(), nullptr, no_passphrase, nullptr) : nullptr, X509_free);
  [[maybe_unused]] static const bool closed = ThirdPartyCall::close_at_exit();
  ERR_clear_error();
  if (!certificate) return unexpected(Errc::invalid_option, file + ": expected a certificate in PEM");
  return certificate;
}

Unexpected exiting() { return unexpected(Errc::io_error, "the process is exiting"); }

}  // namespace

Result<void> check_key(const std::string& certificate_file, const std::string& key_file) {
  const ThirdPartyCall call;
  if (!call) return exiting();
  const Result<Certificate> certificate = certificate_in(certificate_file);
  if (!certificate) return Unexpected{certificate.error()};
  const Result<std::string> text = read_file(key_file, max_certificate_bytes);
  if (!text) return unexpected(text.error().code, text.error().message);
  const Bytes bytes(BIO_new_mem_buf(text->data(), static_cast<int>(text->size())), BIO_free);
  const std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)> key(bytes ? PEM_read_bio_PrivateKey(bytes.get(), nullptr, no_passphrase, nullptr) : nullptr,
                                                           EVP_PKEY_free);
  const bool fits = key && X509_check_private_key(certificate->get(), key.get()) == 1;
  ERR_clear_error();
  if (!key) return unexpected(Errc::invalid_option, key_file + ": expected a private key in PEM, without a passphrase");
  if (!fits) return unexpected(Errc::invalid_option, key_file + " is not the key of the certificate in " + certificate_file);
  return {};
}

Result<CertificateText> read_certificate(const std::string& file) {
  const ThirdPartyCall call;
  if (!call) return exiting();
  const Result<Certificate> found = certificate_in(file);
  if (!found) return Unexpected{found.error()};
  const Certificate& certificate = *found;
  CertificateText result;
  const X509_NAME* const subject = X509_get_subject_name(certificate.get());
  for (int at = -1; (at = X509_NAME_get_index_by_NID(const_cast<X509_NAME*>(subject), NID_commonName, at)) >= 0;)
    result.common_name = text_of(X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at)));
  const std::unique_ptr<GENERAL_NAMES, void (*)(GENERAL_NAMES*)> others(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate.get(), NID_subject_alt_name, nullptr, nullptr)), GENERAL_NAMES_free);
  for (int i = 0; others && i < sk_GENERAL_NAME_num(others.get()); ++i) {
    const GENERAL_NAME* const name = sk_GENERAL_NAME_value(others.get(), i);
    if (name->type == GEN_URI) result.uris.push_back(text_of(name->d.uniformResourceIdentifier));
    else if (name->type == GEN_DNS) result.names.push_back(text_of(name->d.dNSName));
  }
  result.from = point_of(X509_get0_notBefore(certificate.get()));
  result.to = point_of(X509_get0_notAfter(certificate.get()));
  ERR_clear_error();
  return result;
}

}  // namespace lrt::security
