// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>

namespace lrt::http {

/// What a `+` in a query means. In the parameters that lrt defines (`?accept=image/svg+xml`) it is itself, as in any URI (RFC 3986 2.2); in those
/// that a standard encodes as a form (SPARQL 1.1 Protocol 2.1) it is a space.
enum class Plus : bool { itself, space };

/// The first value of a parameter in the query of a target or URL that can be decoded; nullopt: there is none.
LRT_INTERNAL_API std::optional<std::string> query_parameter(std::string_view target, std::string_view name, Plus plus = Plus::itself);

/// Names and values of application/x-www-form-urlencoded (WHATWG URL 5.1), in order. nullopt: an incomplete percent-encoding, or octets that are not
/// UTF-8.
std::optional<std::vector<std::pair<std::string, std::string>>> parse_form(std::string_view text);

}  // namespace lrt::http
