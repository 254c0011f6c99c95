// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <string_view>

#include <lrt/base/abi.hpp>

namespace lrt::rdf {

/// Multiplies to 128 bits and folds: every bit of the result depends on every bit of both factors.
inline std::uint64_t fold_multiply(std::uint64_t a, std::uint64_t b) noexcept {
#ifdef __SIZEOF_INT128__
  __extension__ using Wide = unsigned __int128;
  const Wide product = static_cast<Wide>(a) * b;
  return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
#else
  const std::uint64_t al = a & 0xFFFFFFFF, ah = a >> 32, bl = b & 0xFFFFFFFF, bh = b >> 32;
  const std::uint64_t ll = al * bl, lh = al * bh, hl = ah * bl, hh = ah * bh;
  const std::uint64_t middle = (ll >> 32) + (lh & 0xFFFFFFFF) + (hl & 0xFFFFFFFF);
  return (ll & 0xFFFFFFFF) ^ (middle << 32) ^ (hh + (lh >> 32) + (hl >> 32) + (middle >> 32));
#endif
}

/// Random numbers for each process, so that a client cannot choose terms or triples that collide. No order of output depends on them.
struct HashSeeds {
  std::uint64_t bytes, first, second;
};
LRT_INTERNAL_API const HashSeeds& hash_seeds() noexcept;

/// Hashes a triple by the numbers of its terms, which a client can choose by the order of a document.
inline std::uint64_t hash_triple(std::uint32_t subject, std::uint32_t predicate, std::uint32_t object) noexcept {
  const HashSeeds& seeds = hash_seeds();
  return fold_multiply((static_cast<std::uint64_t>(subject) << 32 | predicate) ^ seeds.first, object ^ seeds.second);
}

/// Hashes bytes, sixteen at a time (the scheme of wyhash).
inline std::uint64_t hash_bytes(std::string_view text, std::uint64_t seed) noexcept {
  constexpr std::uint64_t k0 = 0xA0761D6478BD642Fu, k1 = 0xE7037ED1A0B428DBu;
  const char* p = text.data();
  std::size_t left = text.size();
  std::uint64_t h = seed ^ k0, a = 0, b = 0;
  while (left > 16) {
    std::memcpy(&a, p, 8);
    std::memcpy(&b, p + 8, 8);
    h = fold_multiply(a ^ k1, b ^ h);
    p += 16;
    left -= 16;
  }
  a = b = 0;
  if (left > 8) {
    std::memcpy(&a, p, 8);
    std::memcpy(&b, p + 8, left - 8);
  } else if (left != 0) {
    std::memcpy(&a, p, left);
  }
  return fold_multiply(a ^ k1 ^ text.size(), b ^ h);
}

/// Reduces a hash to the 32 bits that HashIndex uses.
constexpr std::uint32_t to_32_bits(std::uint64_t hash) noexcept { return static_cast<std::uint32_t>(hash ^ (hash >> 32)); }

}  // namespace lrt::rdf
