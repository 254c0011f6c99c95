// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/topics.hpp"

#include <array>
#include <cstdint>
#include <utility>

#include "src/base/utf8.hpp"

namespace lrt::mqtt {
inline namespace v0 {

namespace {

constexpr std::size_t max_bytes = 65'535;                                     // MQTT 5 1.5.4
constexpr std::array<std::string_view, 3> words = {"put", "post", "delete"};  // by Topics::Command

/// Each occurrence of one text becomes another one.
std::string replaced(std::string_view text, std::string_view from, std::string_view to) {
  std::string out;
  for (std::size_t at; (at = text.find(from)) != std::string_view::npos; text.remove_prefix(at + from.size())) (out += text.substr(0, at)) += to;
  return out += text;
}

}  // namespace

bool fits(std::string_view pattern, std::string_view path) noexcept {
  // The last `**` and the last `*` behind it, and where the path goes on if they take one character more.
  constexpr std::size_t none = std::string_view::npos;
  std::size_t p = 0, at = 0, deep = none, deep_at = 0, flat = none, flat_at = 0;
  while (true) {
    if (p < pattern.size() && pattern[p] == '*') {
      if (p + 1 < pattern.size() && pattern[p + 1] == '*') {
        p += 2;
        deep = p;
        deep_at = at;
        flat = none;
      } else {
        flat = ++p;
        flat_at = at;
      }
      continue;
    }
    if (at == path.size() && p == pattern.size()) return true;
    if (p < pattern.size() && at < path.size() && pattern[p] == path[at]) {
      ++p;
      ++at;
      continue;
    }
    if (flat != none && flat_at < path.size() && path[flat_at] != '/') {
      at = ++flat_at;
      p = flat;
    } else if (deep != none && deep_at < path.size()) {
      at = ++deep_at;
      p = deep;
      flat = none;
    } else {
      return false;
    }
  }
}

bool is_text(std::string_view text) noexcept {
  if (text.size() > max_bytes) return false;
  for (const char c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) return false;
  return !utf8::find_invalid(text);
}

bool is_topic(std::string_view topic) noexcept { return !topic.empty() && topic.find_first_of("+#") == std::string_view::npos && is_text(topic); }

std::string id_of(std::string_view text, std::size_t max_readable) {
  constexpr char digits[] = "0123456789abcdef";
  std::string id;
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
    if (id.size() < max_readable) id += (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ? c : '-';
  }
  id += '-';
  for (int shift = 60; shift >= 0; shift -= 4) id += digits[(hash >> shift) & 15];
  return id;
}

Result<Topics> Topics::create(std::string prefix) {
  if (!is_topic(prefix) || prefix.size() > 1'000 || prefix.front() == '$' || prefix.front() == '/' || prefix.back() == '/' ||
      prefix.find("//") != std::string::npos)
    return unexpected(Errc::invalid_option, "prefix: expected levels of a topic such as \"robots/r7\", without '+' and '#', found \"" + prefix + '"');
  return Topics(std::move(prefix));
}

std::string Topics::of(std::string_view path) const { return prefix_ + replaced(path, "+", "%2B"); }

std::string Topics::of(Command command, std::string_view path) const {
  return own(words[static_cast<std::size_t>(command)]) + of(path).substr(prefix_.size());
}

std::string Topics::filter(Command command) const { return own(words[static_cast<std::size_t>(command)]) + "/#"; }

std::optional<Topics::Demand> Topics::demand(std::string_view topic) const {
  const std::string start = own("");
  if (topic.substr(0, start.size()) != start) return std::nullopt;
  topic.remove_prefix(start.size());
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (topic.substr(0, words[i].size()) != words[i]) continue;
    const std::string_view path = topic.substr(words[i].size());
    if (path.size() < 2 || path.front() != '/') return std::nullopt;
    return Demand{static_cast<Command>(i), std::string(path)};
  }
  return std::nullopt;
}

bool Topics::may_respond_to(std::string_view topic) const {
  if (!is_topic(topic) || topic.front() == '$') return false;
  if (topic == prefix_ || (topic.substr(0, prefix_.size()) == prefix_ && topic.substr(prefix_.size(), 1) == "/")) return false;
  for (const std::string_view word : words) {
    const std::string level = "/ns/" + std::string(word);
    for (std::size_t at = topic.find(level); at != std::string_view::npos; at = topic.find(level, at + 1))
      if (at + level.size() == topic.size() || topic[at + level.size()] == '/') return false;
  }
  return true;
}

}  // namespace v0
}  // namespace lrt::mqtt
