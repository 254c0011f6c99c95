// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/redirect.hpp"

#include <algorithm>
#include <utility>

#include <lrt/base/iri.hpp>

namespace lrt::exchange {
namespace {

/// Empty: the redirect is not followed.
std::string_view next_method(int status, std::string_view method) {
  const bool reads = method == "GET" || method == "HEAD";
  switch (status) {
    case 301:
    case 302: return reads ? method : std::string_view();
    case 303: return reads ? method : "GET";
    case 307:
    case 308: return method;
    default: return {};
  }
}

}  // namespace

Result<std::optional<Redirect>> redirect_of(int status, const http::Fields& fields, std::string_view method, const std::string& url) {
  const std::string_view next = next_method(status, method);
  const std::optional<std::string_view> location = next.empty() ? std::nullopt : fields.find("Location");
  if (!location) return std::optional<Redirect>();
  Result<std::string> target = iri::resolve(url, *location);
  if (!target) return unexpected(Errc::expected_iri, "\"" + url + "\": it redirects to an invalid URL");
  target->resize(std::min(target->find('#'), target->size()));
  Result<http::Url> parts = http::parse_url(*target);
  if (!parts) return unexpected(Errc::expected_iri, "\"" + url + "\": it redirects to \"" + *target + "\": " + parts.error().message);
  const Result<http::Url> from = http::parse_url(url.substr(0, url.find('#')));
  const bool leaves = !from || from->origin() != parts->origin();
  const bool reads = next == "GET" || next == "HEAD" || next == "OPTIONS";
  if (leaves && !reads) {
    return unexpected(Errc::refused, "\"" + url + "\": it redirects the " + std::string(method) + " to \"" + *target +
                                         "\", which is of another origin: a command is not sent there");
  }
  return std::optional<Redirect>({std::string(next), *std::move(target), *std::move(parts), leaves});
}

}  // namespace lrt::exchange
