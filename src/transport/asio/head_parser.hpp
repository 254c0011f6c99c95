#pragma once

#include <string_view>

#include <lrt/http/message.hpp>

namespace lrt::transport {

/// Fills method, target, version and fields of `request` with views into `head`, a whole head that http::check_raw_head() passed.
/// Boost.Beast's parser; no allocation but the growth of `request.fields`.
/// @return false when Beast refuses the head
bool parse_head(std::string_view head, http::Request& request);

}  // namespace lrt::transport
