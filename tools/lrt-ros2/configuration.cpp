// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt-ros2/configuration.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

#include "src/ros2/bridge/mapping_file.hpp"
#include "src/ros2/bridge/toml.hpp"
#include "tools/lrt-ros2/settings.hpp"
#include "tools/lrt/suggest.hpp"
#include "tools/lrt/terminal.hpp"

namespace lrt::ros2_tool {
namespace {

constexpr std::size_t max_file_bytes = 4 * 1024 * 1024;
/// Read by lrt::ros2, which says what is wrong in them.
constexpr std::string_view tables_of_library[] = {"graph", "definitions", "allowed", "limits", "topic", "type", "service", "action", "parameter"};

std::string quoted(std::string_view text) { return '"' + tool::printable(text) + '"'; }

/// An error at a place of the file.
struct Place {
  std::string_view file;
  Unexpected wrong(const toml::source_region& at, const std::string& sentence) const {
    return unexpected(Errc::expected_value,
                      tool::printable(file) + ':' + std::to_string(at.begin.line) + ':' + std::to_string(at.begin.column) + ": " + sentence);
  }
};

std::string_view name_of(Kind kind) noexcept {
  switch (kind) {
    case Kind::number: return "a number";
    case Kind::flag: return "true or false";
    case Kind::list: return "a list of texts";
    case Kind::text: break;
  }
  return "a text";
}

/// The texts of a value of the right kind; nullopt: it is of another kind.
std::optional<std::vector<std::string>> texts_of(const toml::node& node, Kind kind) {
  std::vector<std::string> texts;
  const toml::array* const list = node.as_array();
  if (kind == Kind::list && list) {
    for (const toml::node& member : *list) {
      const auto* const text = member.as_string();
      if (!text) return std::nullopt;
      texts.push_back(text->get());
    }
  } else if (const auto* const text = node.as_string(); text && kind == Kind::text) {
    texts.push_back(text->get());
  } else if (const auto* const number = node.as_integer(); number && kind == Kind::number) {
    texts.push_back(std::to_string(number->get()));
  } else if (const auto* const flag = node.as_boolean(); flag && kind == Kind::flag) {
    texts.emplace_back(flag->get() ? "true" : "false");
  } else {
    return std::nullopt;
  }
  return texts;
}

Result<void> read_table(const Place& place, std::string_view name, const toml::table& table, Settings& s, const Setting* begin, const Setting* end) {
  std::vector<std::string> known;
  for (const Setting* setting = begin; setting != end; ++setting)
    if (setting->table == name && !setting->key.empty()) known.emplace_back(setting->key);
  for (const auto& [key, node] : table) {
    const Setting* const setting =
        std::find_if(begin, end, [&, wanted = key.str()](const Setting& one) { return one.table == name && one.key == wanted; });
    if (setting == end || key.str().empty())
      return place.wrong(key.source(), "[" + std::string(name) + "] has no key " + quoted(key.str()) + tool::did_you_mean(key.str(), known));
    const std::optional<std::vector<std::string>> texts = texts_of(node, setting->kind);
    if (!texts) return place.wrong(node.source(), std::string(key.str()) + ": expected " + std::string(name_of(setting->kind)));
    for (const std::string& text : *texts)
      if (Result<void> set = setting->set(s, text); !set) return place.wrong(node.source(), std::string(key.str()) + ": " + set.error().message);
  }
  return {};
}

}  // namespace

Result<Configuration> read_configuration(const std::string& file, Settings& s, const Setting* begin, const Setting* end) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return unexpected(Errc::io_error, "--config: cannot read " + quoted(file));
  std::string text;
  std::vector<char> buffer(64 * 1024);
  while (stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size())), stream.gcount() > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(stream.gcount()));
    if (text.size() > max_file_bytes) return unexpected(Errc::limit_exceeded, "--config: " + quoted(file) + " is larger than 4 MiB");
  }
  if (stream.bad()) return unexpected(Errc::io_error, "--config: cannot read " + quoted(file));

  Configuration result;
  result.name = file;
  const Place place{file};
  const toml::parse_result parsed = ros2::parse_toml(text);
  if (!parsed) return place.wrong(parsed.error().source(), tool::printable(parsed.error().description()));
  const toml::table& root = parsed.table();

  std::vector<std::string> known(std::begin(tables_of_library), std::end(tables_of_library));
  for (const Setting* setting = begin; setting != end; ++setting)
    if (!setting->table.empty() && std::find(known.begin(), known.end(), setting->table) == known.end()) known.emplace_back(setting->table);
  for (const auto& [key, node] : root) {
    const bool is_of_library = std::find(std::begin(tables_of_library), std::end(tables_of_library), key.str()) != std::end(tables_of_library);
    if (std::find(known.begin(), known.end(), key.str()) == known.end())
      return place.wrong(key.source(), "there is no table " + quoted(key.str()) + tool::did_you_mean(key.str(), known));
    const toml::table* const table = node.as_table();
    if (table)
      for (const auto& [inner, value] : *table) result.keys.emplace(key.str(), inner.str());
    if (is_of_library) continue;
    if (!table) return place.wrong(node.source(), "[" + std::string(key.str()) + "]: expected a table");
    if (Result<void> read = read_table(place, key.str(), *table, s, begin, end); !read) return unexpected(std::move(read).error());
  }
  Result<ros2::Options> bridge = ros2::options_from_toml(text, file);
  if (!bridge) return unexpected(std::move(bridge).error());
  s.bridge = *std::move(bridge);
  return result;
}

}  // namespace lrt::ros2_tool
