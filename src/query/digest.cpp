// SPDX-License-Identifier: Apache-2.0
#include "src/query/digest.hpp"

#include <openssl/evp.h>

#include "src/base/third_party_call.hpp"

namespace lrt::query {
namespace {

const EVP_MD* function_of(Hash hash) noexcept {
  switch (hash) {
    case Hash::md5: return EVP_md5();
    case Hash::sha1: return EVP_sha1();
    case Hash::sha256: return EVP_sha256();
    case Hash::sha384: return EVP_sha384();
    case Hash::sha512: return EVP_sha512();
  }
  return nullptr;
}

}  // namespace

std::string digest_of(std::string_view bytes, Hash hash) {
  const ThirdPartyCall call;
  if (!call) return {};
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned size = 0;
  const bool good = EVP_Digest(bytes.data(), bytes.size(), digest, &size, function_of(hash), nullptr) == 1;
  [[maybe_unused]] static const bool closed = ThirdPartyCall::close_at_exit();
  if (!good) return {};
  std::string text;
  text.reserve(2 * std::size_t{size});
  constexpr char digits[] = "0123456789abcdef";
  for (unsigned i = 0; i < size; ++i) {
    text += digits[digest[i] >> 4U];
    text += digits[digest[i] & 0x0FU];
  }
  return text;
}

}  // namespace lrt::query
