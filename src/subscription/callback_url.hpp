// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <lrt/base/result.hpp>

#include "src/http/url.hpp"

namespace lrt::subscription {

/// The URL of a web callback.
using CallbackUrl = http::Url;

/// Parses a callback URL of at most 2,048 bytes.
/// @par Errors   expected_iri, as http::parse_url()
Result<CallbackUrl> parse_callback_url(std::string_view url);

}  // namespace lrt::subscription
