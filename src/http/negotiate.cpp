// SPDX-License-Identifier: Apache-2.0
#include "src/http/negotiate.hpp"

#include <algorithm>
#include <utility>

#include <lrt/http/message.hpp>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

using namespace detail;

/// Takes the next list element off `list`; a comma within a quoted string does not end it.
std::string_view take_member(std::string_view& list) noexcept {
  std::size_t at = 0;
  while (at < list.size() && list[at] != ',') {
    if (list[at] == '"') {
      at = quoted_end(list, at);
      if (at == std::string_view::npos) at = list.size();
    } else {
      ++at;
    }
  }
  const std::string_view member = trim(list.substr(0, at));
  list.remove_prefix(at == list.size() ? at : at + 1);
  return member;
}

struct Parameter {
  std::string_view name, value;  ///< value with its quotes, if any
};

/// Takes `OWS ";" OWS [ name "=" value ]` off `text`. False at its end and when it is malformed, which leaves `text` not empty.
bool take_parameter(std::string_view& text, Parameter& out) noexcept {
  for (;;) {
    const std::string_view trimmed = trim(text);
    if (trimmed.empty()) {
      text = {};
      return false;
    }
    if (trimmed.front() != ';') return false;
    text = trim(trimmed.substr(1));
    if (!text.empty() && text.front() != ';') break;
  }
  const std::size_t equals = token_end(text, 0);
  if (equals == 0 || equals == text.size() || text[equals] != '=') return false;
  const std::size_t from = equals + 1;
  const std::size_t end = from < text.size() && text[from] == '"' ? quoted_end(text, from) : token_end(text, from);
  if (end == std::string_view::npos || end == from) return false;
  out = {text.substr(0, equals), text.substr(from, end - from)};
  text.remove_prefix(end);
  return true;
}

/// A parameter value without its quotes and escapes, byte by byte: comparing needs no copy.
bool same_value(std::string_view a, std::string_view b) noexcept {
  const auto strip = [](std::string_view& text) {
    const bool is_quoted = text.size() >= 2 && text.front() == '"';
    if (is_quoted) text = text.substr(1, text.size() - 2);
    return is_quoted;
  };
  const auto take = [](std::string_view& text, bool is_quoted) {
    if (is_quoted && text.front() == '\\' && text.size() > 1) text.remove_prefix(1);
    const char c = text.front();
    text.remove_prefix(1);
    return c;
  };
  const bool a_quoted = strip(a);
  const bool b_quoted = strip(b);
  while (!a.empty() && !b.empty()) {
    if (lower(take(a, a_quoted)) != lower(take(b, b_quoted))) return false;
  }
  return a.empty() && b.empty();
}

/// weight = "0" [ "." 0*3DIGIT ] / "1" [ "." 0*3("0") ], in thousandths; -1 if it is malformed. ".2", which Java's URLConnection
/// sends, is read as 0.2.
int parse_weight(std::string_view text) noexcept {
  if (text.empty()) return -1;
  int result = 0;
  if (text.front() == '0' || text.front() == '1') {
    result = (text.front() - '0') * 1000;
    text.remove_prefix(1);
  } else if (text.front() != '.' || text.size() == 1) {
    return -1;
  }
  if (text.empty()) return result;
  if (text.front() != '.' || text.size() > 4) return -1;
  int unit = 100;
  for (const char c : text.substr(1)) {
    if (!is_digit(c)) return -1;
    result += (c - '0') * unit;
    unit /= 10;
  }
  return result <= 1000 ? result : -1;
}

/// A parsed offer or media range.
struct Type {
  std::string_view type, subtype, parameters;
};

/// Splits "type/subtype;..."; false if the text does not have this form. A lone "*" is read as "*/*" (Java's URLConnection again).
bool split_type(std::string_view text, Type& out) noexcept {
  const std::size_t slash = token_end(text, 0);
  if (slash == 0) return false;
  if (slash < text.size() && text[slash] == '/') {
    const std::size_t end = token_end(text, slash + 1);
    if (end == slash + 1) return false;
    out = {text.substr(0, slash), text.substr(slash + 1, end - slash - 1), text.substr(end)};
  } else if (text.substr(0, slash) == "*") {
    out = {"*", "*", text.substr(slash)};
  } else {
    return false;
  }
  return out.type != "*" || out.subtype == "*";
}

/// Whether an offer has a parameter that a range requires. charset=utf-8 holds for all offers of lrt; JSON-LD's own profiles are
/// preferences that need not be met (JSON-LD 1.1, appendix C).
bool offers_parameter(const Type& offer, const Parameter& wanted) noexcept {
  std::string_view rest = offer.parameters;
  Parameter own;
  while (take_parameter(rest, own)) {
    if (iequals(own.name, wanted.name)) return same_value(own.value, wanted.value);
  }
  if (iequals(wanted.name, "profile") && iequals(offer.subtype, "ld+json"))
    return wanted.value.find("http://www.w3.org/ns/json-ld#") != std::string_view::npos;
  return iequals(wanted.name, "charset") && (same_value(wanted.value, "utf-8") || same_value(wanted.value, "utf8"));
}

struct Verdict {
  bool any_range = false;  ///< the field has at least one well-formed range
  int weight = 0;          ///< of the most specific range that matches, in thousandths
  int precision = 0;       ///< of that range: 2 for a type, 1 for "type/*", 0 for "*/*"
};

Verdict judge(std::string_view accept, const Type& offer) noexcept {
  Verdict verdict;
  int best = -1;
  while (!accept.empty()) {
    Type range;
    if (!split_type(take_member(accept), range)) continue;
    int weight = 1000;
    const int precision = range.type == "*" ? 0 : range.subtype == "*" ? 1 : 2;
    int specificity = precision;
    bool matching = (precision == 0 || iequals(range.type, offer.type)) && (precision <= 1 || iequals(range.subtype, offer.subtype));
    Parameter parameter;
    while (weight >= 0 && take_parameter(range.parameters, parameter)) {
      if (iequals(parameter.name, "q")) {  // RFC 9110 12.5.1: the weight wherever it stands
        weight = parse_weight(parameter.value);
      } else {
        matching = matching && offers_parameter(offer, parameter);
        ++specificity;
      }
    }
    if (weight < 0 || !range.parameters.empty()) continue;  // malformed
    verdict.any_range = true;
    if (!matching || specificity < best) continue;
    verdict.weight = specificity > best ? weight : (weight > verdict.weight ? weight : verdict.weight);
    verdict.precision = precision;
    best = specificity;
  }
  return verdict;
}

}  // namespace

std::optional<std::size_t> negotiate(std::optional<std::string_view> accept, const std::vector<std::string_view>& offers) {
  if (offers.empty()) return std::nullopt;
  const std::string_view field = accept ? trim(*accept) : std::string_view();
  if (field.empty() || field == "*/*") return 0;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    if (field == offers[i]) return i;
  }
  std::optional<std::size_t> winner;
  int highest = 0, most_precise = 0;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    Type offer;
    if (!split_type(offers[i], offer)) continue;
    const Verdict verdict = judge(field, offer);
    if (!verdict.any_range) return 0;  // no well-formed element
    // At equal weight a type that the client names precedes those that only a range includes.
    if (verdict.weight > highest || (verdict.weight == highest && winner && verdict.precision > most_precise)) {
      highest = verdict.weight;
      most_precise = verdict.precision;
      winner = i;
    }
  }
  return winner;
}

std::vector<std::string> accepted_languages(std::string_view field) {
  constexpr std::size_t max_ranges = 32, max_bytes = 100;
  std::vector<std::pair<int, std::string>> weighted;
  while (!field.empty() && weighted.size() < max_ranges) {
    std::string_view member = take_member(field);
    const std::string_view range = member.substr(0, std::min(member.find_first_of("; \t"), member.size()));
    member.remove_prefix(range.size());
    int weight = 1000;
    Parameter parameter;
    while (weight > 0 && take_parameter(member, parameter))
      if (iequals(parameter.name, "q")) weight = parse_weight(parameter.value);
    const auto is_tag = [](char c) { return is_digit(c) || c == '-' || (lower(c) >= 'a' && lower(c) <= 'z'); };
    const bool is_range = !range.empty() && range.size() <= max_bytes && std::all_of(range.begin(), range.end(), is_tag);
    if (!is_range || weight <= 0 || !member.empty()) continue;
    std::string text(range);
    std::transform(text.begin(), text.end(), text.begin(), [](char c) { return lower(c); });
    weighted.emplace_back(weight, std::move(text));
  }
  std::stable_sort(weighted.begin(), weighted.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> ranges;
  for (auto& [weight, range] : weighted) ranges.push_back(std::move(range));
  return ranges;
}

}  // namespace lrt::http
