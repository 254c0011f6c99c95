// SPDX-License-Identifier: Apache-2.0
#include "src/security/digest.hpp"

#include <openssl/crypto.h>
#include <openssl/evp.h>

#include <stdexcept>

#include "src/base/third_party_call.hpp"

namespace lrt::security {

namespace {

/// OpenSSL 3 searches an algorithm for each use of EVP_sha256(), which takes longer than the digest of a token.
const EVP_MD* sha256() {
#if OPENSSL_VERSION_NUMBER >= 0x30000000L
  static const EVP_MD* const found = EVP_MD_fetch(nullptr, "SHA2-256", nullptr);  // freed by OpenSSL at the end of the process
  return found;
#else
  return EVP_sha256();
#endif
}

}  // namespace

Digest digest_of(std::string_view bytes) {
  const ThirdPartyCall call;
  if (!call) throw std::runtime_error("the process is exiting");
  Digest digest;
  unsigned size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, sha256(), nullptr) != 1 || size != digest.size())
    throw std::runtime_error("SHA-256 failed");
  [[maybe_unused]] static const bool closed = ThirdPartyCall::close_at_exit();
  return digest;
}

bool are_equal(const Digest& a, const Digest& b) noexcept { return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0; }  // keeps no state

}  // namespace lrt::security
