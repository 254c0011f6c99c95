// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace lrt::tool {

/// The folder where the command keeps what robots are: `lrt` in XDG_CACHE_HOME, else in ~/.cache (XDG Base Directory Specification 0.8). Empty: the
/// environment names no absolute path, or a home that does not exist.
std::string cache_folder();

}  // namespace lrt::tool
