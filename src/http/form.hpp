// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lrt::http {
inline namespace v0 {

/// Names and values of application/x-www-form-urlencoded (WHATWG URL 5.1), in order: `+` is a space, the rest percent-encoded. nullopt: an incomplete
/// percent-encoding, or octets that are not UTF-8.
std::optional<std::vector<std::pair<std::string, std::string>>> parse_form(std::string_view text);

}  // namespace v0
}  // namespace lrt::http
