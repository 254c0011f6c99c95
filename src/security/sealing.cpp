// SPDX-License-Identifier: Apache-2.0
#include "src/security/sealing.hpp"

#include <openssl/evp.h>

#include <array>
#include <memory>
#include <stdexcept>

#include "src/base/random.hpp"
#include "src/base/third_party_call.hpp"
#include "src/security/digest.hpp"

namespace lrt::security {
namespace {

constexpr std::size_t tag_bytes = 16;
/// A key encrypts one text, so that its nonce need not change (NIST SP 800-38D 8).
constexpr std::array<unsigned char, 12> nonce{};

using Cipher = std::unique_ptr<EVP_CIPHER_CTX, void (*)(EVP_CIPHER_CTX*)>;

/// The digests under which secrets are stored are of other texts.
Digest key_of(std::string_view secret) { return digest_of(std::string("seal ").append(secret)); }

Cipher begin(std::string_view secret, bool encrypts) {
  Cipher cipher(EVP_CIPHER_CTX_new(), EVP_CIPHER_CTX_free);
  if (!cipher || EVP_CipherInit_ex(cipher.get(), EVP_aes_256_gcm(), nullptr, key_of(secret).data(), nonce.data(), encrypts ? 1 : 0) != 1)
    throw std::runtime_error("AES failed");
  return cipher;
}

std::string updated(EVP_CIPHER_CTX* cipher, std::string_view text) {
  std::string out(text.size(), '\0');
  int size = 0;
  if (!text.empty() && EVP_CipherUpdate(cipher, reinterpret_cast<unsigned char*>(out.data()), &size,
                                        reinterpret_cast<const unsigned char*>(text.data()), static_cast<int>(text.size())) != 1)
    throw std::runtime_error("AES failed");
  return out;
}

}  // namespace

std::string random_secret() {
  static constexpr char digits[] = "0123456789abcdef";
  std::array<unsigned char, 32> bytes;
  fill_random(bytes.data(), bytes.size());
  std::string text;
  text.reserve(2 * bytes.size());
  for (const unsigned char byte : bytes) {
    text += digits[byte >> 4];
    text += digits[byte & 0x0FU];
  }
  return text;
}

std::string seal(std::string_view secret, std::string_view text) {
  const ThirdPartyCall call;
  if (!call) throw std::runtime_error("the process is exiting");
  const Cipher cipher = begin(secret, true);
  std::string sealed = updated(cipher.get(), text);
  std::array<unsigned char, tag_bytes> tag;
  int none = 0;
  if (EVP_CipherFinal_ex(cipher.get(), tag.data(), &none) != 1 || EVP_CIPHER_CTX_ctrl(cipher.get(), EVP_CTRL_GCM_GET_TAG, tag_bytes, tag.data()) != 1)
    throw std::runtime_error("AES failed");
  return sealed.append(reinterpret_cast<const char*>(tag.data()), tag.size());
}

std::optional<std::string> unseal(std::string_view secret, std::string_view sealed) {
  const ThirdPartyCall call;
  if (!call) throw std::runtime_error("the process is exiting");
  if (sealed.size() < tag_bytes) return std::nullopt;
  const Cipher cipher = begin(secret, false);
  std::string text = updated(cipher.get(), sealed.substr(0, sealed.size() - tag_bytes));
  std::string tag(sealed.substr(sealed.size() - tag_bytes));
  std::array<unsigned char, tag_bytes> none;
  int size = 0;
  if (EVP_CIPHER_CTX_ctrl(cipher.get(), EVP_CTRL_GCM_SET_TAG, tag_bytes, tag.data()) != 1 ||
      EVP_CipherFinal_ex(cipher.get(), none.data(), &size) != 1)
    return std::nullopt;
  return text;
}

}  // namespace lrt::security
