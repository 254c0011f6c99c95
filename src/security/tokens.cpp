// SPDX-License-Identifier: Apache-2.0
#include <lrt/security.hpp>

#include <algorithm>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/base/ascii.hpp"
#include "src/base/read_file.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/hash.hpp"
#include "src/security/digest.hpp"

namespace lrt::security {
inline namespace v0 {
namespace {

constexpr std::size_t max_token_file_bytes = 1024 * 1024;
constexpr std::size_t min_token_characters = 16, max_token_characters = 512;
constexpr std::string_view digest_prefix = "sha256:";

/// Takes the next word off the front of a line; empty: there is none.
std::string_view next_word(std::string_view& line) noexcept {
  line.remove_prefix(std::min(line.size(), line.find_first_not_of(" \t\r")));
  const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
  line.remove_prefix(word.size());
  return word;
}

/// b64token of RFC 6750 2.1
bool is_token(std::string_view text) noexcept {
  const std::string_view body = text.substr(0, text.find_last_not_of('=') + 1);
  return !body.empty() &&
         std::all_of(body.begin(), body.end(), [](char c) { return detail::is_alpha(c) || detail::is_digit(c) || detail::contains("-._~+/", c); });
}

std::optional<Digest> digest_in(std::string_view hexadecimal) noexcept {
  Digest digest;
  if (hexadecimal.size() != 2 * digest.size()) return std::nullopt;
  for (std::size_t i = 0; i < digest.size(); ++i) {
    const char high = hexadecimal[2 * i], low = hexadecimal[2 * i + 1];
    if (!detail::is(high, detail::hex) || !detail::is(low, detail::hex)) return std::nullopt;
    digest[i] = static_cast<unsigned char>(detail::hex_value(high) * 16 + detail::hex_value(low));
  }
  return digest;
}

Result<Digest> digest_of_word(std::string_view word) {
  if (word.substr(0, digest_prefix.size()) == digest_prefix) {
    if (const auto digest = digest_in(word.substr(digest_prefix.size()))) return *digest;
    return unexpected(Errc::invalid_option, "expected 64 hexadecimal digits after sha256:");
  }
  if (word.size() < min_token_characters || word.size() > max_token_characters)
    return unexpected(Errc::invalid_option, "expected a token of 16 to 512 characters, found " + std::to_string(word.size()));
  if (!is_token(word)) return unexpected(Errc::invalid_option, "a token has letters, digits, -._~+/ and = at the end; found another character");
  return digest_of(word);
}

/// The end of the clock's range if it cannot hold the time: a token that expires in 2300 does not expire, one of the year 1500 has expired.
std::chrono::system_clock::time_point time_of(std::int64_t seconds) noexcept {
  using Clock = std::chrono::system_clock;
  constexpr auto longest = std::chrono::duration_cast<std::chrono::seconds>(Clock::duration::max());
  if (seconds > longest.count()) return Clock::time_point::max();
  if (seconds < -longest.count()) return Clock::time_point::min();
  return Clock::time_point(std::chrono::seconds(seconds));
}

Result<std::vector<std::string>> roles_in(std::string_view word) {
  std::vector<std::string> roles;
  while (true) {
    const std::string_view role = word.substr(0, word.find(','));
    if (role.empty()) return unexpected(Errc::invalid_option, "expected the name of a role");
    roles.emplace_back(role);
    if (role.size() == word.size()) return roles;
    word.remove_prefix(role.size() + 1);
  }
}

}  // namespace

Roles default_roles() {
  return {{"reader", Right::read | Right::subscribe},
          {"operator", Right::read | Right::write | Right::invoke | Right::subscribe | Right::release},
          {"administrator", Rights::all()}};
}

Result<Tokens> Tokens::parse(std::string_view text) {
  Tokens tokens;
  text = utf8::without_mark(text);
  for (std::size_t number = 1; !text.empty(); ++number) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    line = line.substr(0, line.find('#'));
    const auto wrong = [&](const std::string& what) { return unexpected(Errc::invalid_option, "line " + std::to_string(number) + ": " + what); };
    const std::string_view name = next_word(line), role_word = next_word(line), token = next_word(line), expires = next_word(line);
    if (name.empty()) continue;
    if (token.empty() || !next_word(line).empty()) return wrong("expected NAME ROLE TOKEN [EXPIRES]");
    Result<std::vector<std::string>> roles = roles_in(role_word);
    if (!roles) return wrong(roles.error().message);
    Result<Digest> digest = digest_of_word(token);
    if (!digest) return wrong(digest.error().message);
    Entry entry{*digest, std::make_shared<const Principal>(Principal{std::string(name), *std::move(roles), {}, KnownBy::token}), std::nullopt};
    if (!expires.empty()) {
      const auto moment = rdf::lexical::parse_moment(expires, rdf::lexical::Datatype::date_time);
      if (!moment || !moment->zoned) return wrong("expected a time such as 2027-01-01T00:00:00Z, found \"" + std::string(expires) + "\"");
      entry.expires = time_of(moment->seconds);
    }
    if (tokens.find_entry(entry.digest)) return wrong("the token is that of a line before");
    tokens.entries_.push_back(std::move(entry));
    tokens.enter(tokens.entries_.size() - 1);
  }
  return tokens;
}

Result<Tokens> Tokens::load(const std::string& file) {
  Result<std::string> text = read_file(file, max_token_file_bytes);
  if (!text) return Unexpected{std::move(text).error()};
  if (text->size() > max_token_file_bytes) return unexpected(Errc::invalid_option, file + ": expected at most 1 MiB");
  Result<Tokens> tokens = parse(*text);
  if (!tokens) return unexpected(tokens.error().code, file + ": " + tokens.error().message);
  return tokens;
}

std::size_t Tokens::place_of(const Digest& digest) const noexcept {
  const std::string_view bytes(reinterpret_cast<const char*>(digest.data()), digest.size());
  return static_cast<std::size_t>(rdf::hash_bytes(bytes, rdf::hash_seeds().first)) & (places_.size() - 1);
}

const Tokens::Entry* Tokens::find_entry(const Digest& digest) const noexcept {
  if (places_.empty()) return nullptr;
  for (std::size_t place = place_of(digest); places_[place] != 0; place = (place + 1) & (places_.size() - 1))
    if (const Entry& entry = entries_[places_[place] - 1]; are_equal(entry.digest, digest)) return &entry;
  return nullptr;
}

void Tokens::enter(std::size_t index) {
  if (places_.size() < 2 * entries_.size()) {
    std::size_t size = 16;
    while (size < 2 * entries_.size()) size *= 2;
    places_.assign(2 * size, 0);
    for (std::size_t i = 0; i < index; ++i) enter(i);
  }
  std::size_t place = place_of(entries_[index].digest);
  while (places_[place] != 0) place = (place + 1) & (places_.size() - 1);
  places_[place] = static_cast<std::uint32_t>(index + 1);
}

std::shared_ptr<const Principal> Tokens::find(std::string_view token, std::chrono::system_clock::time_point now) const {
  const Entry* const found = find_entry(digest_of(token));
  if (found == nullptr || (found->expires && *found->expires <= now)) return nullptr;
  return found->principal;
}

std::shared_ptr<const Principal> Tokens::find_name(std::string_view name, std::chrono::system_clock::time_point now) const {
  for (const Entry& entry : entries_)
    if (entry.principal->name == name && !(entry.expires && *entry.expires <= now)) return entry.principal;
  return nullptr;
}

std::optional<std::chrono::system_clock::time_point> Tokens::next_expiry(std::chrono::system_clock::time_point now) const {
  std::optional<std::chrono::system_clock::time_point> next;
  for (const Entry& entry : entries_)
    if (entry.expires && *entry.expires > now && (!next || *entry.expires < *next)) next = entry.expires;
  return next;
}

}  // namespace v0
}  // namespace lrt::security
