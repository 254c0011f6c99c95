#pragma once

#include <optional>
#include <string_view>

#include <lrt/http/head.hpp>
#include <lrt/http/message.hpp>

namespace lrt::transport {

/// Fills method, target, version and fields of `request` with views into `head`, a whole head that http::check_raw_head() passed.
/// Boost.Beast's parser; no allocation but the growth of `request.fields`.
/// @return why the head is refused: what http::check_head() says of it, or Beast's words where that has nothing against it
std::optional<http::Refusal> parse_head(std::string_view head, http::Request& request);

}  // namespace lrt::transport
