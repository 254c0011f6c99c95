// SPDX-License-Identifier: Apache-2.0
#include "src/http/prefer.hpp"

#include <cstdint>

#include <lrt/base/iri.hpp>
#include <lrt/http/message.hpp>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

using namespace detail;

void skip_ows(std::string_view text, std::size_t& at) noexcept {
  while (at < text.size() && is_ows(text[at])) ++at;
}

struct Word {
  std::string_view name;
  std::string value;
};

/// Reads `token [ BWS "=" BWS ( token / quoted-string ) ]`.
bool read_word(std::string_view text, std::size_t& at, Word& out) {
  const std::size_t end = token_end(text, at);
  if (end == at) return false;
  out.name = text.substr(at, end - at);
  out.value.clear();
  std::size_t next = end;
  skip_ows(text, next);
  if (next == text.size() || text[next] != '=') {
    at = end;
    return true;
  }
  ++next;
  skip_ows(text, next);
  const bool is_quoted = next < text.size() && text[next] == '"';
  const std::size_t stop = is_quoted ? quoted_end(text, next) : token_end(text, next);
  if (stop == std::string_view::npos || stop == next) return false;
  out.value = is_quoted ? unquote(text.substr(next, stop - next)) : std::string(text.substr(next, stop - next));
  at = stop;
  return true;
}

/// Skips to the comma that ends a malformed preference, or to the end.
void skip_preference(std::string_view text, std::size_t& at) noexcept {
  while (at < text.size() && text[at] != ',') {
    if (text[at] == '"') {
      at = quoted_end(text, at);
      if (at == std::string_view::npos) at = text.size();
    } else {
      ++at;
    }
  }
}

std::vector<std::string> split_iris(std::string_view list) {
  std::vector<std::string> result;
  while (!list.empty()) {
    const std::size_t end = list.find_first_of(" \t");
    const std::string_view iri = list.substr(0, end);
    list.remove_prefix(end == std::string_view::npos ? list.size() : end + 1);
    if (iri::is_absolute(iri)) result.emplace_back(iri);
  }
  return result;
}

std::optional<std::chrono::seconds> parse_wait(std::string_view value) noexcept {
  constexpr std::int64_t day = 24 * 60 * 60;
  if (value.empty()) return std::nullopt;
  std::int64_t seconds = 0;
  for (const char c : value) {
    if (!is_digit(c)) return std::nullopt;
    if (seconds <= day) seconds = seconds * 10 + (c - '0');
  }
  return std::chrono::seconds(seconds < day ? seconds : day);
}

}  // namespace

Preferences parse_prefer(std::string_view prefer) {
  Preferences result;
  std::size_t at = 0;
  while (at < prefer.size()) {
    skip_ows(prefer, at);
    if (at < prefer.size() && prefer[at] == ',') {
      ++at;
      continue;
    }
    if (at == prefer.size()) break;
    Word preference;
    std::vector<std::string> include, omit;
    bool good = read_word(prefer, at, preference);
    while (good) {
      skip_ows(prefer, at);
      if (at == prefer.size() || prefer[at] == ',') break;
      good = prefer[at] == ';';
      if (!good) break;
      ++at;
      skip_ows(prefer, at);
      if (at == prefer.size() || prefer[at] == ';' || prefer[at] == ',') continue;
      Word parameter;
      good = read_word(prefer, at, parameter);
      if (good && include.empty() && iequals(parameter.name, "include")) include = split_iris(parameter.value);
      if (good && omit.empty() && iequals(parameter.name, "omit")) omit = split_iris(parameter.value);
    }
    if (!good) {
      skip_preference(prefer, at);
      continue;
    }
    if (iequals(preference.name, "respond-async") && preference.value.empty()) {
      result.respond_async = true;
    } else if (iequals(preference.name, "wait") && !result.wait) {
      result.wait = parse_wait(preference.value);
    } else if (iequals(preference.name, "return") && result.return_ == Preferences::Return::unsaid) {
      if (iequals(preference.value, "minimal")) {
        result.return_ = Preferences::Return::minimal;
      } else if (iequals(preference.value, "representation")) {
        result.return_ = Preferences::Return::representation;
        result.include = std::move(include);
        result.omit = std::move(omit);
      }
    }
  }
  return result;
}

}  // namespace lrt::http
