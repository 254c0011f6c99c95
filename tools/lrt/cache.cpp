// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/cache.hpp"

#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace lrt::tool {

std::string cache_folder() {
  // The specification says that a relative path is to be ignored.
  if (const char* const own = std::getenv("XDG_CACHE_HOME"); own && *own == '/') return std::string(own) + "/lrt";
  const char* const home = std::getenv("HOME");
  std::error_code none;  // a user without a home, as those of services: nothing is kept
  return home && *home == '/' && std::filesystem::is_directory(home, none) ? std::string(home) + "/.cache/lrt" : std::string();
}

}  // namespace lrt::tool
