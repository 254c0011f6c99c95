// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/bridge/mapping_file.hpp"

#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <utility>

#include "src/base/quote.hpp"
#include "src/ros2/bridge/toml.hpp"
#include "src/ros2/bridge/units.hpp"

namespace lrt::ros2 {

std::string fault_of_rule(const Rule& rule) {
  if (rule.matches.empty()) return "a rule says what it is for";
  const auto fault = [](const FieldRule& field) -> std::string {
    if (field.min && field.max && *field.min > *field.max) return "the lowest value is above the greatest";
    if ((field.min && !std::isfinite(*field.min)) || (field.max && !std::isfinite(*field.max))) return "a bound is a finite number";
    return {};
  };
  if (std::string what = fault(rule.value); !what.empty()) return what;
  for (const auto& [path, field] : rule.fields)
    if (std::string what = fault(field); !what.empty()) return "field " + lrt::quoted(path) + ": " + what;
  return {};
}

namespace {

using std::chrono::milliseconds;

/// Reads tables and keeps the first error.
class Reader {
 public:
  explicit Reader(std::string_view name) : name_(name) {}

  const std::optional<Error>& error() const noexcept { return error_; }
  Unexpected failed() { return Unexpected{std::move(*error_)}; }

  void fail(const toml::source_region& at, std::string what, Errc code = Errc::expected_value) {
    if (error_) return;
    Error e{code, {}};
    e.line = static_cast<std::uint32_t>(at.begin.line);
    e.column = static_cast<std::uint32_t>(at.begin.column);
    e.message = (name_.empty() ? std::string() : std::string(name_) + ", ") + "line " + std::to_string(e.line) + ", column " +
                std::to_string(e.column) + ": " + std::move(what);
    error_ = std::move(e);
  }
  void fail(const toml::node& node, std::string what, Errc code = Errc::expected_value) { fail(node.source(), std::move(what), code); }

  std::optional<toml::table> parse(std::string_view text) {
    if (text.size() > max_mapping_bytes) {
      error_ = Error{Errc::limit_exceeded,
                     std::string(name_) + (name_.empty() ? "" : ": ") + "the file has more than " + std::to_string(max_mapping_bytes) + " bytes"};
      return std::nullopt;
    }
    toml::parse_result parsed = parse_toml(text);
    if (parsed) return std::move(parsed).table();
    fail(parsed.error().source(), std::string(parsed.error().description()));
    return std::nullopt;
  }

  /// Refuses keys that are not in the list.
  void only(const toml::table& table, std::string_view of, std::initializer_list<std::string_view> known) {
    for (const auto& [key, node] : table) {
      bool found = false;
      for (const std::string_view k : known) found = found || k == key.str();
      if (found) continue;
      std::string list;
      for (const std::string_view k : known) list += (list.empty() ? "" : ", ") + std::string(k);
      return fail(key.source(), "unknown key " + lrt::quoted(key.str()) + " in " + std::string(of) + "; expected one of " + list);
    }
  }

  // Each leaves `to` as it is if there is no such key.
  void read(const toml::table& table, std::string_view key, std::string& to) {
    if (const toml::node* node = table.get(key)) {
      if (const auto* text = node->as_string()) to = text->get();
      else fail(*node, wrong(key, "a text"));
    }
  }
  void read(const toml::table& table, std::string_view key, bool& to) {
    if (const toml::node* node = table.get(key)) {
      if (const auto* truth = node->as_boolean()) to = truth->get();
      else fail(*node, wrong(key, "true or false"));
    }
  }
  void read(const toml::table& table, std::string_view key, std::optional<bool>& to) {
    if (bool truth = false; table.contains(key)) read(table, key, truth), to = truth;
  }
  void read(const toml::table& table, std::string_view key, std::optional<double>& to) {
    if (const toml::node* node = table.get(key)) {
      if (const std::optional<double> number = node->is_number() ? node->value<double>() : std::nullopt) to = number;
      else fail(*node, wrong(key, "a number"));
    }
  }
  template <class Integer>
  void integer(const toml::table& table, std::string_view key, Integer& to, std::int64_t low, std::int64_t high) {
    if (const toml::node* node = table.get(key)) {
      const auto* number = node->as_integer();
      if (!number) return fail(*node, wrong(key, "an integer"));
      if (number->get() < low || number->get() > high)
        return fail(
            *node,
            lrt::quoted(key) + ": expected " + std::to_string(low) + " to " + std::to_string(high) + ", found " + std::to_string(number->get()),
            Errc::out_of_range);
      to = static_cast<Integer>(number->get());
    }
  }
  void count(const toml::table& table, std::string_view key, std::size_t& to) {
    integer(table, key, to, 0, std::numeric_limits<std::int32_t>::max() * std::int64_t{64});
  }
  /// Milliseconds, at most a day.
  template <class Duration>
  void time(const toml::table& table, std::string_view key, Duration& to) {
    std::int64_t ms = -1;
    integer(table, key, ms, 0, 86'400'000);
    if (ms >= 0) to = milliseconds(ms);
  }
  void read(const toml::table& table, std::string_view key, std::vector<std::string>& to) {
    const toml::node* node = table.get(key);
    if (!node) return;
    const toml::array* list = node->as_array();
    if (!list) return fail(*node, wrong(key, "a list of texts"));
    for (const toml::node& member : *list) {
      if (const auto* text = member.as_string()) to.push_back(text->get());
      else return fail(member, wrong(key, "a list of texts"));
    }
  }
  /// A text, or a table with one for each language.
  void read(const toml::table& table, std::string_view key, Texts& to) {
    const toml::node* node = table.get(key);
    if (!node) return;
    if (const auto* text = node->as_string()) {
      to.add(text->get());
    } else if (const toml::table* languages = node->as_table()) {
      for (const auto& [language, words] : *languages) {
        if (const auto* in_language = words.as_string()) to.add(in_language->get(), std::string(language.str()));
        else return fail(words, wrong(language.str(), "a text"));
      }
    } else {
      fail(*node, wrong(key, "a text, or a table of texts by language: { en = \"...\", de = \"...\" }"));
    }
  }
  const toml::table* table(const toml::table& in, std::string_view key) {
    const toml::node* node = in.get(key);
    if (!node) return nullptr;
    if (!node->is_table()) fail(*node, wrong(key, "a table"));
    return node->as_table();
  }

  // --- rules

  void read(const toml::table& table, FieldRule& to) {
    if (const toml::node* node = table.get("unit")) {
      const auto* text = node->as_string();
      if (!text) return fail(*node, wrong("unit", "a text"));
      to.unit = find_unit(text->get());
      if (!to.unit)
        return fail(*node, "unknown unit " + lrt::quoted(text->get()) + "; expected a code of UCUM that lrt knows (\"m/s\"), or an IRI of QUDT");
    }
    read(table, "min", to.min);
    read(table, "max", to.max);
    read_iri(table, "quantity_kind", to.quantity_kind);
    read(table, "name", to.name);
    read_iri(table, "term", to.term);
    read(table, "left_out", to.left_out);
    read(table, "read_only", to.read_only);
    if (const toml::table* values = this->table(table, "values"))
      for (const auto& [name, number] : *values) {
        if (const auto* n = number.as_integer()) to.enumerators.push_back({std::string(name.str()), n->get()});
        else return fail(number, wrong(name.str(), "an integer"));
      }
  }
  void read_iri(const toml::table& table, std::string_view key, std::string& to) {
    read(table, key, to);
    if (!to.empty() && !iri::is_absolute(to))
      fail(*table.get(key), lrt::quoted(key) + ": expected an absolute IRI, found " + lrt::quoted(to), Errc::expected_iri);
  }

  void rule(const toml::table& table, Rule::Of of, std::string_view kind, std::vector<Rule>& to) {
    Rule rule;
    rule.of = of;
    const std::string_view what = of == Rule::Of::type ? "type" : "name";
    if (of == Rule::Of::type)
      only(table, kind,
           {"type", "title", "description", "frame", "hidden", "life_ms", "interval_ms", "requires_expiry", "success", "progress", "fields", "unit",
            "min", "max", "quantity_kind"});
    else if (of == Rule::Of::parameter) only(table, kind, {"name", "title", "description", "hidden", "unit", "min", "max", "quantity_kind", "term"});
    else if (of == Rule::Of::service) only(table, kind, {"name", "title", "description", "hidden", "requires_expiry", "success", "fields"});
    else if (of == Rule::Of::action) only(table, kind, {"name", "title", "description", "hidden", "requires_expiry", "progress", "fields"});
    else
      only(table, kind,
           {"name", "title", "description", "frame", "hidden", "life_ms", "interval_ms", "requires_expiry", "fields", "unit", "min", "max",
            "quantity_kind"});
    read(table, what, rule.matches);
    read(table, "title", rule.titles);
    read(table, "description", rule.descriptions);
    read(table, "frame", rule.frame);
    read(table, "hidden", rule.hidden);
    read(table, "requires_expiry", rule.requires_expiry);
    time(table, "life_ms", rule.life);
    time(table, "interval_ms", rule.interval);
    read(table, "success", rule.success);
    read(table, "progress", rule.progress);
    read(table, rule.value);  // titles are those of the whole
    if (const toml::table* fields = this->table(table, "fields"))
      for (const auto& [path, node] : *fields) {
        const toml::table* field = node.as_table();
        if (!field) return fail(node, wrong(path.str(), "a table"));
        only(*field, "a field", {"unit", "min", "max", "quantity_kind", "name", "term", "title", "description", "left_out", "read_only", "values"});
        read(*field, rule.fields[std::string(path.str())]);
        FieldRule& made = rule.fields[std::string(path.str())];
        read(*field, "title", made.titles);
        read(*field, "description", made.descriptions);
      }
    if (std::string fault = fault_of_rule(rule); !fault.empty()) return fail(table, std::move(fault));
    to.push_back(std::move(rule));
  }

  void rules(const toml::table& root, std::vector<Rule>& to) {
    static constexpr std::pair<std::string_view, Rule::Of> kinds[] = {{"topic", Rule::Of::topic},
                                                                      {"type", Rule::Of::type},
                                                                      {"service", Rule::Of::service},
                                                                      {"action", Rule::Of::action},
                                                                      {"parameter", Rule::Of::parameter}};
    for (const auto& [key, of] : kinds) {
      const toml::node* node = root.get(key);
      if (!node) continue;
      const toml::array* list = node->as_array();
      if (!list) return fail(*node, "expected [[" + std::string(key) + "]]");
      for (const toml::node& member : *list) {
        const toml::table* one = member.as_table();
        if (!one) return fail(member, "expected [[" + std::string(key) + "]]");
        if (to.size() == max_rules) return fail(member, "a mapping has at most " + std::to_string(max_rules) + " rules", Errc::limit_exceeded);
        rule(*one, of, key, to);
        if (error_) return;
      }
    }
  }

 private:
  static std::string wrong(std::string_view key, std::string_view expected) { return lrt::quoted(key) + ": expected " + std::string(expected); }

  std::string_view name_;
  std::optional<Error> error_;
};

void read_graph(Reader& in, const toml::table& table, Options& to) {
  in.only(table, "[graph]",
          {"domain",
           "node",
           "interfaces",
           "peers",
           "multicast",
           "shared_memory",
           "allowed_addresses",
           "settle_ms",
           "namespaces",
           "path",
           "robot_description",
           "max_participants",
           "max_endpoints",
           "max_endpoints_of_participant",
           "max_name_bytes",
           "max_user_data_bytes",
           "max_subscriptions",
           "max_sample_bytes",
           "max_waiting_bytes",
           "max_calls",
           "max_goals"});
  GraphOptions& graph = to.graph;
  in.integer(table, "domain", graph.domain, 0, 232);
  in.read(table, "node", graph.node);
  in.read(table, "interfaces", graph.interfaces);
  in.read(table, "peers", graph.peers);
  in.read(table, "multicast", graph.multicast);
  in.read(table, "shared_memory", graph.shared_memory);
  in.read(table, "allowed_addresses", graph.allowed_addresses);
  in.time(table, "settle_ms", graph.settle);
  in.read(table, "namespaces", to.namespaces);
  in.read(table, "path", to.path);
  in.read(table, "robot_description", to.robot_description_file);
  in.count(table, "max_participants", graph.limits.max_participants);
  in.count(table, "max_endpoints", graph.limits.max_endpoints);
  in.count(table, "max_endpoints_of_participant", graph.limits.max_endpoints_of_participant);
  in.count(table, "max_name_bytes", graph.limits.max_name_bytes);
  in.count(table, "max_user_data_bytes", graph.limits.max_user_data_bytes);
  in.count(table, "max_subscriptions", graph.limits.max_subscriptions);
  in.count(table, "max_sample_bytes", graph.limits.max_sample_bytes);
  in.count(table, "max_waiting_bytes", graph.limits.max_waiting_bytes);
  in.count(table, "max_calls", graph.limits.max_calls);
  in.count(table, "max_goals", graph.limits.max_goals);
}

void read_definitions(Reader& in, const toml::table& table, Options& to) {
  in.only(table, "[definitions]",
          {"folders", "max_text_bytes", "max_fields", "max_depth", "max_members", "max_definitions", "max_kept_bytes", "max_files"});
  in.read(table, "folders", to.definitions);
  DefinitionLimits& limits = to.definition_limits;
  in.count(table, "max_text_bytes", limits.max_text_bytes);
  in.count(table, "max_fields", limits.max_fields);
  in.count(table, "max_depth", limits.max_depth);
  in.count(table, "max_members", limits.max_members);
  in.count(table, "max_definitions", limits.max_definitions);
  in.count(table, "max_kept_bytes", limits.max_kept_bytes);
  in.count(table, "max_files", limits.max_files);
}

void read_allowed(Reader& in, const toml::table& table, Allowed& to) {
  in.only(table, "[allowed]", {"topics", "services", "actions", "parameters", "lifecycle"});
  in.read(table, "topics", to.topics);
  in.read(table, "services", to.services);
  in.read(table, "actions", to.actions);
  in.read(table, "parameters", to.parameters);
  in.read(table, "lifecycle", to.lifecycle);
}

void read_limits(Reader& in, const toml::table& table, BridgeLimits& to) {
  in.only(table, "[limits]",
          {"max_things", "max_value_bytes", "max_representation_bytes", "minimum_interval_ms", "large_interval_ms", "command_life_ms",
           "max_parameters", "max_kept_bytes", "max_types", "max_type_members"});
  in.count(table, "max_things", to.max_things);
  in.count(table, "max_value_bytes", to.max_value_bytes);
  in.count(table, "max_representation_bytes", to.max_representation_bytes);
  in.time(table, "minimum_interval_ms", to.minimum_interval);
  in.time(table, "large_interval_ms", to.large_interval);
  in.time(table, "command_life_ms", to.command_life);
  in.count(table, "max_parameters", to.max_parameters);
  in.count(table, "max_kept_bytes", to.max_kept_bytes);
  in.count(table, "max_types", to.max_types);
  in.count(table, "max_type_members", to.max_type_members);
}

}  // namespace

Result<Options> options_from_toml(std::string_view text, std::string_view name) {
  Reader in(name);
  const std::optional<toml::table> root = in.parse(text);
  if (!root) return in.failed();
  Options options;
  if (const toml::table* t = in.table(*root, "graph")) read_graph(in, *t, options);
  if (const toml::table* t = in.table(*root, "definitions")) read_definitions(in, *t, options);
  if (const toml::table* t = in.table(*root, "allowed")) read_allowed(in, *t, options.allowed);
  if (const toml::table* t = in.table(*root, "limits")) read_limits(in, *t, options.limits);
  Mapping::Rules rules;
  in.rules(*root, rules.rules);
  if (in.error()) return in.failed();
  options.mapping = Mapping::of(std::move(rules));
  return options;
}

Result<std::vector<Rule>> rules_from_toml(std::string_view text) {
  Reader in({});
  const std::optional<toml::table> root = in.parse(text);
  if (!root) return in.failed();
  std::vector<Rule> rules;
  for (const auto& [key, node] : *root)
    if (key != "topic" && key != "type" && key != "service" && key != "action" && key != "parameter")
      in.fail(key.source(),
              "unknown table " + lrt::quoted(key.str()) + "; a mapping has [[topic]], [[type]], [[service]], [[action]] and [[parameter]]");
  in.rules(*root, rules);
  if (in.error()) return in.failed();
  return rules;
}

}  // namespace lrt::ros2
