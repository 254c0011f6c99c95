// SPDX-License-Identifier: Apache-2.0
#include <zstd.h>

#include <memory>

#include "src/recording/mcap.hpp"

namespace lrt::recording::mcap {

bool has_zstd() noexcept { return true; }

std::optional<std::string> zstd_compressed(std::string_view bytes) {
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  constexpr int level = 3;  // about 300 MB/s: the recorder's time is for values
  const std::size_t size = ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size) != 0) return std::nullopt;
  result.resize(size);
  return result;
}

std::optional<std::string> zstd_decompressed(std::string_view bytes, std::size_t size) {
  // The size is of the file, too: memory is taken for what is really there, as far as a frame says it.
  const unsigned long long said = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (said == ZSTD_CONTENTSIZE_ERROR || (said != ZSTD_CONTENTSIZE_UNKNOWN && said > size)) return std::nullopt;
  std::string result(size, '\0');
  const std::size_t found = ZSTD_decompress(result.data(), result.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(found) != 0 || found != size) return std::nullopt;
  return result;
}

}  // namespace lrt::recording::mcap
