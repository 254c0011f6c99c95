// SPDX-License-Identifier: Apache-2.0
#include "src/http/form.hpp"

#include <algorithm>

#include <lrt/base/iri.hpp>

#include "src/base/utf8.hpp"

namespace lrt::http {
inline namespace v0 {

namespace {

std::optional<std::string> decoded(std::string_view text) {
  std::string spaced(text);
  std::replace(spaced.begin(), spaced.end(), '+', ' ');
  Result<std::string> plain = iri::decode(spaced);
  if (!plain || utf8::find_invalid(*plain)) return std::nullopt;
  return *std::move(plain);
}

}  // namespace

std::optional<std::vector<std::pair<std::string, std::string>>> parse_form(std::string_view text) {
  std::vector<std::pair<std::string, std::string>> all;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find('&'));
    text.remove_prefix(std::min(text.size(), one.size() + 1));
    if (one.empty()) continue;
    const std::size_t equals = std::min(one.find('='), one.size());
    std::optional<std::string> name = decoded(one.substr(0, equals)), value = decoded(one.substr(std::min(equals + 1, one.size())));
    if (!name || !value) return std::nullopt;
    all.emplace_back(*std::move(name), *std::move(value));
  }
  return all;
}

}  // namespace v0
}  // namespace lrt::http
