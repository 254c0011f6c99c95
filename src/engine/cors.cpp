// SPDX-License-Identifier: Apache-2.0
#include "src/engine/cors.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace lrt::engine {

namespace {

constexpr std::string_view exposed =
    "Accept-Patch, Accept-Post, Accept-Put, Allow, Content-Location, Content-Range, Control-Id, ETag, Link, Location, Preference-Applied, "
    "Retry-After, "
    "Robot-Time, "
    "Upgrade, Value-Series, Vary, WWW-Authenticate";
constexpr std::string_view request_fields =
    "Accept, Authorization, Content-Type, Control-Id, If-Match, If-None-Match, Last-Event-ID, Link, Prefer, Range, "
    "Start-Before, Take-Over, Valid-Until";
constexpr std::string_view preflight_seconds = "600";
/// The Content-Security-Policy of other documents than lrt's page: an opaque origin, no scripts, no loading. An SVG image keeps its styles.
constexpr std::string_view document_policy = "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:";

bool has_any(const std::vector<std::string>& origins) { return std::find(origins.begin(), origins.end(), "*") != origins.end(); }

bool names(const std::vector<std::string>& origins, std::string_view origin) {
  return std::any_of(origins.begin(), origins.end(), [&](const std::string& allowed) { return allowed == "*" || http::iequals(origin, allowed); });
}

/// The only field Origin of a request.
std::optional<std::string_view> origin_of(const http::Request& request) {
  return request.count("Origin") == 1 ? request.find("Origin") : std::nullopt;
}

/// RFC 6454 6.2: scheme, host and perhaps port, without a slash at the end.
bool is_origin(std::string_view text) {
  if (text == "*" || text == "null") return true;
  const std::size_t colon = text.find("://");
  return colon != std::string_view::npos && colon > 0 && colon + 3 < text.size() && text.find_first_of("/?#@ ,", colon + 3) == std::string_view::npos;
}

/// True if browsers run scripts in documents of this media type: HTML, XML (SVG among others), and what may contain such.
bool is_executable(std::string_view content_type) {
  content_type = content_type.substr(0, content_type.find_first_of("; \t"));
  const std::size_t slash = content_type.find('/');
  if (slash == std::string_view::npos) return true;
  const std::string_view type = content_type.substr(0, slash), subtype = content_type.substr(slash + 1);
  return http::iequals(type, "multipart") || http::iequals(subtype, "html") || http::iequals(subtype, "xml") || http::iequals(subtype, "xsl") ||
         (subtype.size() > 4 && http::iequals(subtype.substr(subtype.size() - 4), "+xml"));
}

}  // namespace

Result<void> Cors::check() const {
  for (const auto& [name, origins] : {std::pair("read_origins", &options_.read_origins), std::pair("allowed_origins", &options_.allowed_origins)})
    for (const std::string& origin : *origins)
      if (!is_origin(origin))
        return unexpected(Errc::invalid_option,
                          std::string(name) + ": expected \"https://host\", \"https://host:port\", \"null\" or \"*\", found \"" + origin + "\"");
  return {};
}

bool Cors::may_command(std::string_view origin) const { return names(options_.allowed_origins, origin); }
bool Cors::may_read(std::string_view origin) const { return names(options_.read_origins, origin) || may_command(origin); }

bool Cors::depends_on_origin() const {
  return !has_any(options_.read_origins) && !(options_.read_origins.empty() && options_.allowed_origins.empty());
}

std::optional<http::Response> Cors::preflight(const http::Request& request, bool posts_query) const {
  if (request.method != "OPTIONS") return std::nullopt;
  const auto origin = origin_of(request);
  if (!origin || !request.find("Access-Control-Request-Method") || !may_read(*origin)) return std::nullopt;
  http::Response response;
  response.status = 204;
  response.fields.add("Access-Control-Allow-Methods", may_command(*origin) ? "GET, HEAD, OPTIONS, PUT, POST, DELETE, PATCH"
                                                      : posts_query        ? "GET, HEAD, OPTIONS, POST"
                                                                           : "GET, HEAD, OPTIONS");
  response.fields.add("Access-Control-Allow-Headers", request_fields);
  response.fields.add("Access-Control-Max-Age", preflight_seconds);
  return response;
}

void Cors::add_fields(const http::Request& request, http::Response& response) const {
  if (response.fields.has(http::Fields::Known::content_type_options)) return;
  if (response.status != 101) protect(request, response);
  if (depends_on_origin()) {
    const auto vary = response.fields.find("Vary");
    response.fields.set("Vary", vary ? std::string(*vary) + ", Origin" : "Origin");
  }
  const auto origin = origin_of(request);
  if (has_any(options_.read_origins)) response.fields.add("Access-Control-Allow-Origin", "*");
  else if (origin && may_read(*origin)) response.fields.add("Access-Control-Allow-Origin", *origin);
  else return;
  response.fields.add("Access-Control-Expose-Headers", exposed);
}

void Cors::protect(const http::Request& request, http::Response& response) const {
  const auto origin = origin_of(request);
  const bool is_shared = has_any(options_.read_origins) || (origin && may_read(*origin));
  response.fields.add("X-Content-Type-Options", "nosniff");
  response.fields.add("Cross-Origin-Resource-Policy", is_shared ? "cross-origin" : "same-origin");
  const auto type = response.fields.find("Content-Type");
  if (type && is_executable(*type) && !response.fields.find("Content-Security-Policy"))
    response.fields.add("Content-Security-Policy", document_policy);
}

}  // namespace lrt::engine
