// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

/// What CMake makes of the files beside this one.
namespace lrt::page::parts {

extern const std::string_view page, error, login;  ///< HTML with style and script in it; `error` and `login` with {{title}} and the like
extern const std::string_view style_hash, script_hash, login_hash;  ///< SHA-256 of each in base64, as a Content-Security-Policy names them

}  // namespace lrt::page::parts
