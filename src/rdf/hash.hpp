#pragma once

#include <cstdint>
#include <cstring>
#include <random>
#include <string_view>

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

/// Random for each process, so that a client cannot choose IRIs that collide.
inline std::uint64_t hash_seed() noexcept {
  static const std::uint64_t seed = []() noexcept -> std::uint64_t {
    try {
      std::random_device device;
      return (static_cast<std::uint64_t>(device()) << 32) ^ device();
    } catch (...) { return 0x9E3779B97F4A7C15u; }
  }();
  return seed;
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

}  // namespace lrt::rdf
