// SPDX-License-Identifier: Apache-2.0
#include "src/subscription/callback_url.hpp"

#include <utility>

namespace lrt::subscription {

Result<CallbackUrl> parse_callback_url(std::string_view url) {
  Result<CallbackUrl> parsed = http::parse_url(url, 2'048);
  if (parsed) return parsed;
  Error error = std::move(parsed).error();
  error.message = "callback URL: " + error.message;
  return unexpected(std::move(error));
}

}  // namespace lrt::subscription
