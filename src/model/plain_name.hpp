// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace lrt::model {
inline namespace v0 {

/// An encoded path as people write it, for names in JSON: the inverse of encode_path(). A path whose escapes are no UTF-8 stays encoded.
std::string plain_name(std::string_view path);

}  // namespace v0
}  // namespace lrt::model
