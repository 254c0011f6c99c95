// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/http_authentication.hpp"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/base/third_party_call.hpp"

namespace lrt::exchange {

using namespace lrt::detail;

Result<std::string> hex_digest(HashAlgorithm algorithm, std::string_view bytes) {
  const ThirdPartyCall call;
  if (!call) return unexpected(Errc::failed, "the process is exiting");
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  const bool is_md5 = algorithm == HashAlgorithm::md5;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, is_md5 ? EVP_md5() : EVP_sha256(), nullptr) != 1)
    return unexpected(Errc::failed, std::string("OpenSSL has no ") + (is_md5 ? "MD5" : "SHA-256"));
  [[maybe_unused]] static const bool closed = ThirdPartyCall::close_at_exit();
  static constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (unsigned i = 0; i < size; ++i) text += {digits[digest[i] >> 4], digits[digest[i] & 0x0FU]};
  return text;
}

std::string_view Challenge::parameter(std::string_view name) const noexcept {
  const auto found = std::find_if(parameters.begin(), parameters.end(), [&](const auto& p) { return p.first == name; });
  return found == parameters.end() ? std::string_view() : std::string_view(found->second);
}

namespace {

std::size_t after_ows(std::string_view text, std::size_t at) noexcept {
  while (at < text.size() && is_ows(text[at])) ++at;
  return at;
}

/// The end of a token68 that is followed by a comma or the end; npos: there is no such token68.
std::size_t token68_end(std::string_view text, std::size_t at) noexcept {
  const std::size_t begin = at;
  while (at < text.size() && (is(text[at], unreserved) || text[at] == '+' || text[at] == '/')) ++at;
  if (at == begin) return std::string_view::npos;
  while (at < text.size() && text[at] == '=') ++at;
  const std::size_t end = after_ows(text, at);
  return end == text.size() || text[end] == ',' ? end : std::string_view::npos;
}

/// A field may have several challenges, whose parameters are also separated by commas (RFC 9110 11.6.1): a name with '=' belongs to the challenge
/// before it.
void read_field(std::string_view text, std::vector<Challenge>& result, std::size_t max) {
  constexpr std::size_t max_parameters = 64;
  const std::size_t first = result.size();
  for (std::size_t at = 0;;) {
    while (at < text.size() && (is_ows(text[at]) || text[at] == ',')) ++at;
    const std::size_t end = token_end(text, at);
    if (end == at) return;
    std::string name = lower(text.substr(at, end - at));
    at = after_ows(text, end);
    if (at < text.size() && text[at] == '=') {
      if (result.size() == first) return;
      at = after_ows(text, at + 1);
      std::string value;
      if (at < text.size() && text[at] == '"') {
        const std::size_t close = quoted_end(text, at);
        if (close == std::string_view::npos) return;
        value = unquote(text.substr(at, close - at));
        at = close;
      } else {
        const std::size_t close = token_end(text, at);
        if (close == at) return;
        value = text.substr(at, close - at);
        at = close;
      }
      if (result.back().parameters.size() >= max_parameters) return;
      result.back().parameters.emplace_back(std::move(name), std::move(value));
    } else {
      if (result.size() >= max) return;
      result.push_back({std::move(name), {}});
      if (const std::size_t close = at > end ? token68_end(text, at) : std::string_view::npos; close != std::string_view::npos) at = close;
    }
  }
}

bool has_member(std::string_view list, std::string_view wanted) noexcept {
  while (!list.empty()) {
    const std::string_view member = list.substr(0, list.find(','));
    if (iequals_ascii(trim(member), wanted)) return true;
    list.remove_prefix(std::min(member.size() + 1, list.size()));
  }
  return false;
}

}  // namespace

std::vector<Challenge> challenges_of(const http::Fields& fields, std::size_t max) {
  std::vector<Challenge> result;
  for (const http::Field& field : fields.list())
    if (http::iequals(field.name, "WWW-Authenticate")) read_field(field.value, result, max);
  return result;
}

std::optional<DigestChallenge> digest_challenge(const std::vector<Challenge>& challenges) {
  for (const Challenge& challenge : challenges) {
    if (challenge.scheme != "digest") continue;
    DigestChallenge found;
    const std::string_view algorithm = challenge.parameter("algorithm");
    found.states_algorithm = !algorithm.empty();
    if (iequals_ascii(algorithm, "SHA-256")) found.algorithm = HashAlgorithm::sha256;
    else if (!algorithm.empty() && !iequals_ascii(algorithm, "MD5")) continue;
    const std::string_view qop = challenge.parameter("qop");
    found.has_qop = has_member(qop, "auth");
    if (!qop.empty() && !found.has_qop) continue;
    found.realm = challenge.parameter("realm");
    found.nonce = challenge.parameter("nonce");
    found.opaque = challenge.parameter("opaque");
    found.is_stale = iequals_ascii(challenge.parameter("stale"), "true");
    if (!found.nonce.empty()) return found;
  }
  return std::nullopt;
}

Result<std::string> digest_authorization(const DigestChallenge& challenge, std::string_view user, std::string_view password, std::string_view method,
                                         std::string_view target, std::uint32_t count, std::string_view cnonce) {
  for (const char c : user)
    if (c == ':' || static_cast<unsigned char>(c) < 0x20 || c == 0x7F)
      return unexpected(Errc::expected_value, "a user of HTTP Digest has a colon or a control character");
  const auto hash = [&](const std::string& text) { return hex_digest(challenge.algorithm, text); };
  Result<std::string> secret = hash(std::string(user) + ":" + challenge.realm + ":" + std::string(password));
  if (!secret) return secret;
  Result<std::string> request = hash(std::string(method) + ":" + std::string(target));
  if (!request) return request;
  std::array<char, 9> nc{};
  std::snprintf(nc.data(), nc.size(), "%08x", count);
  const std::string middle = challenge.has_qop ? ":" + std::string(nc.data()) + ":" + std::string(cnonce) + ":auth:" : ":";
  Result<std::string> response = hash(*secret + ":" + challenge.nonce + middle + *request);
  if (!response) return response;
  std::string value = "Digest username=" + quoted_string(user) + ", realm=" + quoted_string(challenge.realm) +
                      ", nonce=" + quoted_string(challenge.nonce) + ", uri=" + quoted_string(target) + ", response=\"" + *response + "\"";
  if (challenge.states_algorithm) value += std::string(", algorithm=") + (challenge.algorithm == HashAlgorithm::md5 ? "MD5" : "SHA-256");
  if (!challenge.opaque.empty()) value += ", opaque=" + quoted_string(challenge.opaque);
  if (challenge.has_qop) value += ", qop=auth, nc=" + std::string(nc.data()) + ", cnonce=" + quoted_string(cnonce);
  return value;
}

}  // namespace lrt::exchange
