// SPDX-License-Identifier: Apache-2.0
#include "src/http/form.hpp"

#include <algorithm>

#include <lrt/base/iri.hpp>

#include "src/base/utf8.hpp"

namespace lrt::http {

namespace {

std::optional<std::string> decoded(std::string_view text, Plus plus) {
  std::string spaced(text);
  if (plus == Plus::space) std::replace(spaced.begin(), spaced.end(), '+', ' ');
  Result<std::string> plain = iri::decode(spaced);
  if (!plain || utf8::find_invalid(*plain)) return std::nullopt;
  return *std::move(plain);
}

/// Takes the text before the next '&'.
std::string_view take_pair(std::string_view& query) {
  const std::string_view one = query.substr(0, query.find('&'));
  query.remove_prefix(std::min(query.size(), one.size() + 1));
  return one;
}

}  // namespace

std::optional<std::string> query_parameter(std::string_view target, std::string_view name, Plus plus) {
  const std::size_t mark = std::min(target.find('?'), target.size());
  for (std::string_view query = target.substr(std::min(mark + 1, target.size())); !query.empty();) {
    const std::string_view one = take_pair(query);
    if (one.size() <= name.size() || one[name.size()] != '=' || one.substr(0, name.size()) != name) continue;
    if (std::optional<std::string> value = decoded(one.substr(name.size() + 1), plus)) return value;
  }
  return std::nullopt;
}

std::optional<std::vector<std::pair<std::string, std::string>>> parse_form(std::string_view text) {
  std::vector<std::pair<std::string, std::string>> all;
  while (!text.empty()) {
    const std::string_view one = take_pair(text);
    if (one.empty()) continue;
    const std::size_t equals = std::min(one.find('='), one.size());
    std::optional<std::string> name = decoded(one.substr(0, equals), Plus::space);
    std::optional<std::string> value = decoded(one.substr(std::min(equals + 1, one.size())), Plus::space);
    if (!name || !value) return std::nullopt;
    all.emplace_back(*std::move(name), *std::move(value));
  }
  return all;
}

}  // namespace lrt::http
