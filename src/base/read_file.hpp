// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdio>
#include <memory>
#include <string>
#include <system_error>

#include <lrt/base/result.hpp>

namespace lrt {

/// Reads a file. If it has more than `max_bytes`, the result is longer than `max_bytes` and may be incomplete. Child processes do not inherit
/// the descriptor (O_CLOEXEC), unlike that of a std::ifstream.
/// @par Errors  io_error
inline Result<std::string> read_file(const std::string& path, std::size_t max_bytes) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rbe"), &std::fclose);
  if (!file) return unexpected(Errc::io_error, path + ": " + std::generic_category().message(errno));
  std::string bytes;
  char block[16 * 1024];
  while (bytes.size() <= max_bytes) {
    const std::size_t got = std::fread(block, 1, sizeof block, file.get());
    if (got == 0) break;
    bytes.append(block, got);
  }
  if (std::ferror(file.get()) != 0) return unexpected(Errc::io_error, path + ": " + std::generic_category().message(errno));
  return bytes;
}

}  // namespace lrt
