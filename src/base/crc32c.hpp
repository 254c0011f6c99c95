// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include <lrt/base/abi.hpp>

namespace lrt {

/// CRC-32C: finds damage. It does not protect against deliberate changes.
/// @param before  of the bytes before these; 0: there are none
/// @par Implements  RFC 3720 B.4
LRT_INTERNAL_API std::uint32_t crc32c(std::string_view bytes, std::uint32_t before = 0) noexcept;

}  // namespace lrt
