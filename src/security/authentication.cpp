// SPDX-License-Identifier: Apache-2.0
#include "src/security/authentication.hpp"

#include <sys/stat.h>

#include <cstddef>
#include <optional>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/base/base64.hpp"

namespace lrt::security {
namespace {

/// RFC 4648 4, with padding; nullopt: it is not.
std::optional<std::string> decode_base64(std::string_view text) {
  if (text.empty() || text.size() % 4 != 0) return std::nullopt;
  const std::size_t padding = text.back() != '=' ? 0 : text[text.size() - 2] != '=' ? 1 : 2;
  std::string out;
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < text.size() - padding; ++i) {
    const char c = text[i];
    const int digit = lrt::detail::base64_digit(c);
    if (digit < 0) return std::nullopt;
    word = word << 6 | static_cast<std::uint32_t>(digit);
    if (i % 4 == 0) continue;
    const unsigned shift = 2 * (3 - static_cast<unsigned>(i % 4));
    out += static_cast<char>(word >> shift & 0xFF);
  }
  return out;
}

}  // namespace

Credentials credentials_of(const http::Request& request) {
  Credentials credentials;
  const std::string_view* field = nullptr;
  for (const http::Field& one : request.fields) {
    if (!http::iequals(one.name, "Authorization")) continue;
    credentials.scheme = Credentials::Scheme::other;
    if (field) return credentials;  // two of them are ambiguous
    field = &one.value;
  }
  if (!field) return credentials;
  const std::size_t space = field->find(' ');
  const std::string_view scheme = field->substr(0, space);
  std::string_view rest = space == std::string_view::npos ? std::string_view() : field->substr(space);
  while (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
  if (http::iequals(scheme, "Bearer")) {
    credentials.scheme = Credentials::Scheme::bearer;
    credentials.secret = rest;
  } else if (http::iequals(scheme, "Basic")) {
    credentials.scheme = Credentials::Scheme::basic;
    const auto text = decode_base64(rest);  // RFC 7617 2
    const std::size_t colon = text ? text->find(':') : std::string::npos;
    if (colon == std::string::npos) return credentials;
    credentials.user = text->substr(0, colon);
    credentials.secret = text->substr(colon + 1);
  }
  return credentials;
}

FileStamp FileStamp::of(const std::string& path) noexcept {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) return {};
  return {static_cast<std::uint64_t>(about.st_ino), static_cast<std::uint64_t>(about.st_size),
          std::int64_t{about.st_mtim.tv_sec} * 1'000'000'000 + about.st_mtim.tv_nsec};
}

Result<std::unique_ptr<TokenFile>> open_tokens(std::string path, LogCallback log) {
  const auto load = [](const std::string& file) -> Result<std::shared_ptr<const Tokens>> {
    Result<Tokens> tokens = Tokens::load(file);
    if (!tokens) return Unexpected{std::move(tokens).error()};
    return std::make_shared<const Tokens>(*std::move(tokens));
  };
  return TokenFile::open(std::move(path), "the tokens", load, std::move(log));
}

Result<std::unique_ptr<PolicyFile>> open_policy(std::string path, std::vector<Rule> more, LogCallback log) {
  const auto load = [more = std::move(more)](const std::string& file) -> Result<std::shared_ptr<Policy>> {
    Result<std::vector<Rule>> rules = load_rules(file);
    if (!rules) return Unexpected{std::move(rules).error()};
    rules->insert(rules->end(), more.begin(), more.end());
    return Policy::create(*rules);
  };
  return PolicyFile::open(std::move(path), "the rules", load, std::move(log));
}

}  // namespace lrt::security
