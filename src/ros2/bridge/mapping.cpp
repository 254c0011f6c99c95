// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/bridge/mapping.hpp"

#include <charconv>
#include <cstdlib>
#include <unordered_map>
#include <utility>

#include <lrt/base/immortal.hpp>

#include "src/base/read_file.hpp"
#include "src/ros2/bridge/mapping_file.hpp"
#include "src/ros2/bridge/shipped.hpp"
#include "src/ros2/bridge/units.hpp"
#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {
namespace {

/// The part before a separator, without spaces around it. `rest` is what follows.
std::string_view take_part(std::string_view& rest, char separator) noexcept {
  const std::size_t end = rest.find(separator);
  std::string_view part = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  while (!part.empty() && part.front() == ' ') part.remove_prefix(1);
  while (!part.empty() && part.back() == ' ') part.remove_suffix(1);
  return part;
}

struct Shipped {
  std::unordered_map<std::string, Rule> types;
  std::unordered_map<std::string, bool> commands;

  Shipped() {
    std::string_view text = shipped_table;
    Rule* type = nullptr;
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      std::string_view line = text.substr(0, end);
      text.remove_prefix(end + 1);
      if (line.empty()) continue;
      if (line.front() != ' ') {
        const std::string name(take_part(line, ';'));
        type = &types[name];
        type->of = Rule::Of::type;
        type->matches = name;
        type->titles.add(std::string(take_part(line, ';')), "en");
        if (take_part(line, ';') == "command") commands[name] = true;
        continue;
      }
      FieldRule& field = type->fields[std::string(take_part(line, ';'))];
      std::string_view unit = take_part(line, ';');
      if (!unit.empty() && unit.front() == '=') {
        unit.remove_prefix(1);
        while (!unit.empty()) {
          std::string_view one = take_part(unit, ',');
          const std::string_view name = take_part(one, ':');
          std::int64_t number = 0;
          std::from_chars(one.data(), one.data() + one.size(), number);
          field.enumerators.push_back({std::string(name), number});
        }
        continue;
      }
      field.unit = find_unit(unit);
      if (const std::string_view low = take_part(line, ';'); !low.empty()) field.min = std::strtod(std::string(low).c_str(), nullptr);
      if (const std::string_view high = take_part(line, ';'); !high.empty()) field.max = std::strtod(std::string(high).c_str(), nullptr);
    }
  }
};

const Shipped& shipped() {
  static const Immortal<Shipped> all{Shipped()};
  return *all;
}

void complete(Texts& to, const Texts& from) {
  if (to.empty()) to = from;
}
void complete(std::string& to, const std::string& from) {
  if (to.empty()) to = from;
}
template <class T>
void complete(std::optional<T>& to, const std::optional<T>& from) {
  if (!to) to = from;
}

}  // namespace

bool fits_path(std::string_view pattern, std::string_view path) noexcept {
  while (true) {
    const std::size_t a = pattern.find('.'), b = path.find('.');
    const std::string_view name = pattern.substr(0, a);
    if (name != "*" && name != path.substr(0, b)) return false;
    if ((a == std::string_view::npos) != (b == std::string_view::npos)) return false;
    if (a == std::string_view::npos) return true;
    pattern.remove_prefix(a + 1);
    path.remove_prefix(b + 1);
  }
}

std::vector<const Rule*> matching(const Mapping::Rules& rules, Rule::Of of, std::string_view name) {
  std::vector<const Rule*> found;
  for (const Rule& rule : rules.rules)
    if (rule.of == of && fits(rule.matches, name)) found.push_back(&rule);
  if (of == Rule::Of::type)
    if (const auto known = shipped().types.find(std::string(name)); known != shipped().types.end()) found.push_back(&known->second);
  return found;
}

void complete(FieldRule& to, const FieldRule& from) {
  complete(to.unit, from.unit);
  complete(to.min, from.min);
  complete(to.max, from.max);
  complete(to.quantity_kind, from.quantity_kind);
  complete(to.name, from.name);
  complete(to.term, from.term);
  complete(to.titles, from.titles);
  complete(to.descriptions, from.descriptions);
  complete(to.left_out, from.left_out);
  complete(to.read_only, from.read_only);
  if (to.enumerators.empty()) to.enumerators = from.enumerators;
}

void apply(const FieldRule& rule, FieldOptions& to) {
  if (rule.unit) {
    Unit unit = *rule.unit;
    if (!rule.quantity_kind.empty()) unit.quantity_kind = Iri(rule.quantity_kind);
    to.facets.unit(unit);
  }
  if (rule.min) to.facets.at_least(*rule.min);
  if (rule.max) to.facets.at_most(*rule.max);
  for (const rdf::Text& t : rule.titles) to.facets.title(t.text, t.language);
  for (const rdf::Text& t : rule.descriptions) to.facets.description(t.text, t.language);
  if (!rule.name.empty()) to.name = rule.name;
  if (!rule.term.empty()) to.term = rule.term;
  if (rule.left_out) to.left_out = *rule.left_out;
  if (rule.read_only) to.read_only = *rule.read_only;
  if (!rule.enumerators.empty()) to.enumerators = rule.enumerators;
}

Said said_of(const Mapping::Rules& rules, Rule::Of of, std::string_view name, std::string_view type) {
  Said said;
  std::optional<bool> hidden, requires_expiry;
  const auto add = [&](const std::vector<const Rule*>& found) {
    for (const Rule* rule : found) {
      complete(said.titles, rule->titles);
      complete(said.descriptions, rule->descriptions);
      complete(said.frame, rule->frame);
      complete(said.success, rule->success);
      complete(said.progress, rule->progress);
      complete(hidden, rule->hidden);
      complete(requires_expiry, rule->requires_expiry);
      complete(said.life, rule->life);
      complete(said.interval, rule->interval);
      complete(said.value, rule->value);
    }
  };
  add(matching(rules, of, name));
  if (!type.empty()) {
    add(matching(rules, Rule::Of::type, type));
    said.is_command = shipped().commands.count(std::string(type)) != 0;
  }
  said.hidden = hidden.value_or(false);
  said.requires_expiry = requires_expiry.value_or(false);
  return said;
}

std::size_t shipped_types() noexcept { return shipped().types.size(); }

inline namespace v0 {

Mapping::Mapping() : rules_(std::make_shared<Rules>()) {}
Mapping::Mapping(const Mapping& other) : rules_(std::make_shared<Rules>(other.rules())) {}
Mapping::Mapping(Mapping&&) noexcept = default;
Mapping& Mapping::operator=(const Mapping& other) { return *this = Mapping(other); }
Mapping& Mapping::operator=(Mapping&&) noexcept = default;
Mapping::~Mapping() = default;

const Mapping::Rules& Mapping::rules() const noexcept {
  static const Immortal<Rules> none{Rules()};
  return rules_ ? *rules_ : *none;  // none: it was moved from
}

Mapping Mapping::of(Rules rules) {
  Mapping made;
  *made.rules_ = std::move(rules);
  return made;
}

Result<void> Mapping::add(std::string_view text, std::string_view format) {
  Result<std::vector<Rule>> read =
      format == "application/toml" ? rules_from_toml(text)
      : format == "text/turtle"    ? rules_from_turtle(text)
                                   : unexpected(Errc::unsupported_syntax, "a mapping is text/turtle or application/toml, not " + std::string(format));
  if (!read) return Unexpected{std::move(read).error()};
  if (!rules_) rules_ = std::make_shared<Rules>();
  if (rules_->rules.size() + read->size() > max_rules)
    return unexpected(Errc::limit_exceeded, "a mapping has at most " + std::to_string(max_rules) + " rules");
  for (Rule& rule : *read) rules_->rules.push_back(std::move(rule));
  return {};
}

Result<void> Mapping::add_file(const std::string& file) {
  const auto ends = [&](std::string_view end) { return file.size() >= end.size() && file.compare(file.size() - end.size(), end.size(), end) == 0; };
  const bool is_toml = ends(".toml");
  if (!is_toml && !ends(".ttl")) return unexpected(Errc::unsupported_syntax, file + ": the name of a mapping ends with .toml or .ttl");
  const Result<std::string> text = read_file(file, max_mapping_bytes);
  if (!text) return Unexpected{text.error()};
  Result<void> added = add(*text, is_toml ? "application/toml" : "text/turtle");
  if (added) return added;
  Error error = std::move(added).error();
  error.message = file + ": " + error.message;
  return Unexpected{std::move(error)};
}

}  // namespace v0
}  // namespace lrt::ros2
