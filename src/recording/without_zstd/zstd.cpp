// SPDX-License-Identifier: Apache-2.0
#include "src/recording/mcap.hpp"

namespace lrt::recording::mcap {

bool has_zstd() noexcept { return false; }
std::optional<std::string> zstd_compressed(std::string_view) { return std::nullopt; }
std::optional<std::string> zstd_decompressed(std::string_view, std::size_t) { return std::nullopt; }

}  // namespace lrt::recording::mcap
