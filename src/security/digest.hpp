// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace lrt::security {

using Digest = std::array<unsigned char, 32>;

/// SHA-256 (FIPS 180-4).
Digest digest_of(std::string_view bytes);

/// Compares in constant time.
bool are_equal(const Digest& a, const Digest& b) noexcept;

}  // namespace lrt::security
