// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/hash.hpp"

#include <array>
#include <chrono>
#include <random>

#if defined(__linux__)
#include <sys/random.h>
#endif

namespace lrt::rdf {
namespace {

/// Does not block: early in the boot of a machine there may be too little entropy.
HashSeeds random_seeds() noexcept {
  HashSeeds seeds{};
#if defined(__linux__)
  if (::getrandom(&seeds, sizeof seeds, GRND_NONBLOCK) == static_cast<ssize_t>(sizeof seeds)) return seeds;
#else
  try {
    std::random_device device;
    for (std::uint64_t* seed : {&seeds.bytes, &seeds.first, &seeds.second}) *seed = (static_cast<std::uint64_t>(device()) << 32) ^ device();
    return seeds;
  } catch (...) {}
#endif
  // Values that a client cannot know exactly: the time and the address of the stack.
  const auto time = static_cast<std::uint64_t>(std::chrono::high_resolution_clock::now().time_since_epoch().count());
  std::uint64_t mixed = fold_multiply(time ^ 0x9E3779B97F4A7C15u, reinterpret_cast<std::uintptr_t>(&seeds) ^ 0xE7037ED1A0B428DBu);
  for (std::uint64_t* seed : {&seeds.bytes, &seeds.first, &seeds.second})
    *seed = mixed = fold_multiply(mixed ^ 0xA0761D6478BD642Fu, time ^ 0x8EBC6AF09C88C6E3u);
  return seeds;
}

}  // namespace

const HashSeeds& hash_seeds() noexcept {
  static const HashSeeds seeds = random_seeds();
  return seeds;
}

}  // namespace lrt::rdf
