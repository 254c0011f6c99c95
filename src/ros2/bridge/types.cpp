// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/bridge/types.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <utility>

#include "src/base/utf8.hpp"
#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {
namespace {

/// Longer comments are cut: they come from strangers, and lrt keeps words as long as the process.
constexpr std::size_t max_comment_bytes = 300;

/// The messages on the way to a field, and what is left of the path from each. The first is the root.
struct Way {
  std::vector<std::pair<const Message*, std::string_view>> steps;
  const Field* field = nullptr;  ///< nullptr: there is no such field

  Way(const Message& root, std::string_view path) {
    const Message* message = &root;
    while (message) {
      steps.emplace_back(message, path);
      const std::size_t end = path.find('.');
      const std::string_view name = path.substr(0, end);
      const auto found = std::find_if(message->fields.begin(), message->fields.end(), [name](const Field& f) { return f.name == name; });
      if (found == message->fields.end()) return;
      if (end == std::string_view::npos) field = &*found;
      if (end == std::string_view::npos) return;
      path.remove_prefix(end + 1);
      message = found->type.message.get();
    }
  }
};

void add_number(std::string& to, double number) {
  char text[32];
  (void)std::snprintf(text, sizeof text, "%.17g,", number);
  to += text;
}

std::uint64_t hash_of(std::string_view text) noexcept {
  std::uint64_t h = 0xcbf29ce484222325U;  // FNV-1a
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return h;
}
std::string short_hash(std::uint64_t h) {
  char hex[9];
  (void)std::snprintf(hex, sizeof hex, "%08x", static_cast<unsigned>(h ^ h >> 32U));
  return hex;
}

/// Of larger messages no place is compared with others: that takes the square of their size, and they come from strangers.
constexpr std::size_t max_compared = 400;

/// Counts fields, each time that they occur, until there are more than `most`.
std::size_t members_of(const Message& message, std::size_t most, std::size_t depth = 0) noexcept {
  std::size_t count = 0;
  for (const Field& field : message.fields) {
    count += 1 + (field.type.message && depth < 64 ? members_of(*field.type.message, most, depth + 1) : 0);
    if (count > most) break;
  }
  return count;
}

}  // namespace

std::string words_for_people(std::string_view given) {
  std::string text;
  bool has_letter = false;
  for (const char c : given.substr(0, max_comment_bytes)) {
    const bool is_space = static_cast<unsigned char>(c) <= 0x20 || c == 0x7F;
    if (is_space && (text.empty() || text.back() == ' ')) continue;
    has_letter = has_letter || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || static_cast<unsigned char>(c) >= 0x80;
    text += is_space ? ' ' : c;
  }
  if (const std::optional<std::size_t> bad = utf8::find_invalid(text)) text.resize(*bad);
  while (!text.empty() && text.back() == ' ') text.pop_back();
  if (!has_letter) return {};
  if (given.size() > max_comment_bytes) text += "...";
  return text;
}

bool is_clean_name(std::string_view name) noexcept {
  return !name.empty() && name.size() <= 255 && !utf8::find_invalid(name) &&
         std::none_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
}

struct TypeMaker::Scope {
  std::vector<const Rule*> own;       ///< of the topic, service, action
  std::vector<std::string> left_out;  ///< paths
  std::string name;                   ///< in ROS
  bool is_large = false;              ///< more than max_compared
  std::string inside{};               ///< TypeUse::inside
  bool has_own_fields() const noexcept {
    return std::any_of(own.begin(), own.end(), [](const Rule* r) { return !r->fields.empty() || r->value.unit || r->value.min || r->value.max; });
  }
};

FieldOptions TypeMaker::options_of(const Message& root, const TypeUse& use, std::string_view path) const {
  const Scope scope{matching(rules_, use.of, use.name), use.left_out, std::string(use.name), false, std::string(use.inside)};
  return says(root, scope, path);
}

FieldOptions TypeMaker::says(const Message& root, const Scope& scope, std::string_view path) const {
  FieldRule rule;
  const Way way(root, path);
  FieldOptions options;
  if (!way.field) return options;
  const Field& field = *way.field;
  const auto add = [&](const Rule& from, std::string_view rest) {
    if (const auto exact = from.fields.find(rest); exact != from.fields.end()) complete(rule, exact->second);
    for (const auto& [pattern, one] : from.fields)
      if (pattern.find('*') != std::string::npos && fits_path(pattern, rest)) complete(rule, one);
  };
  std::string_view inner = path;
  const std::size_t inside = scope.inside.size();
  if (inside > 0 && path.size() > inside && path.compare(0, inside, scope.inside) == 0 && path[inside] == '.') inner.remove_prefix(inside + 1);
  for (const Rule* own : scope.own) add(*own, inner);
  // A rule may speak of the only value of the message.
  const std::size_t values = static_cast<std::size_t>(
      std::count_if(root.fields.begin(), root.fields.end(), [](const Field& f) { return f.name != "header" && f.type.kind != Kind::message; }));
  if (values == 1 && path.find('.') == std::string_view::npos && field.type.kind != Kind::message && field.name != "header")
    for (const Rule* own : scope.own) complete(rule, own->value);
  for (const auto& [message, rest] : way.steps)  // the outermost message knows best
    for (const Rule* of_type : matching(rules_, Rule::Of::type, message->name)) add(*of_type, rest);
  apply(rule, options);
  const Message& in = *way.steps.back().first;
  const bool is_integer = field.type.kind >= Kind::octet && field.type.kind <= Kind::uint64;
  const bool is_number = is_integer || field.type.kind == Kind::float32 || field.type.kind == Kind::float64;
  if (!is_integer) options.enumerators.clear();
  else if (options.enumerators.empty()) options.enumerators = MessageOptions::of_constants(in, field);
  if (!is_number || !options.enumerators.empty()) {  // a rule by pattern may fit a field of another kind
    rdf::Facets words;
    for (const rdf::Text& t : rule.titles) words.title(t.text, t.language);
    for (const rdf::Text& t : rule.descriptions) words.description(t.text, t.language);
    options.facets = words;
  }
  if (rule.descriptions.empty())
    if (std::string comment = words_for_people(field.comment); !comment.empty()) options.facets.description(std::move(comment));
  if (std::find(scope.left_out.begin(), scope.left_out.end(), path) != scope.left_out.end()) options.left_out = true;
  return options;
}

/// All that makes a record what it is.
void TypeMaker::describe(const Message& root, const Scope& scope, const Message& at, const std::string& path, std::size_t depth,
                         std::string& out) const {
  out += at.name + '{';
  for (const Field& field : at.fields) {
    const std::string place = path.empty() ? field.name : path + '.' + field.name;
    const FieldOptions o = says(root, scope, place);
    const FieldType& type = field.type;
    out += field.name + ':' + std::to_string(static_cast<int>(type.kind)) + ',' + std::to_string(static_cast<int>(type.arity)) + ',' +
           std::to_string(type.size) + ',' + std::to_string(type.text_bound) + ',';
    if (o.left_out) {
      out += "-;";
      continue;
    }
    out += std::string(o.facets.unit().qudt.text) + ',' + o.name + ',' + o.term + (o.read_only ? ",r," : ",,");
    if (o.facets.min()) add_number(out, *o.facets.min());
    out += '|';
    if (o.facets.max()) add_number(out, *o.facets.max());
    for (const Enumerator& e : o.enumerators) out += e.name + '=' + std::to_string(e.number) + ',';
    const rdf::Words words = o.facets.words();
    for (const Texts* texts : {&words.titles, &words.descriptions})
      for (const rdf::Text& t : *texts) out += t.text + '@' + t.language + ',';
    if (field.initial) out += '=';
    if (type.message && depth < 64) describe(root, scope, *type.message, place, depth + 1, out);
    out += ';';
  }
  out += '}';
}

std::string TypeMaker::signature(const Message& root, const Scope& scope, const Message& at, const std::string& path) const {
  std::string text;
  describe(root, scope, at, path, 0, text);
  return text;
}

std::string TypeMaker::name_of(const Message& root, const Scope& scope, const Message& at, std::string_view path) {
  std::string name;
  std::uint64_t here = 0;
  if (scope.is_large) {
    here = hash_of(root.hash + (scope.has_own_fields() ? scope.name : std::string()) + '/' + std::string(path));
  } else {
    const std::string meaning = signature(root, scope, at, std::string(path));
    here = hash_of(meaning);
    // The innermost message in which the record means this: alone, in the message around it, ...
    std::vector<std::pair<const Message*, std::string_view>> around;
    if (!path.empty()) around = Way(root, path).steps;
    around.emplace_back(&at, std::string_view());
    const Scope none{};
    for (auto step = around.rbegin(); step != around.rend() && name.empty(); ++step)
      if (signature(*step->first, none, at, std::string(step->second)) == meaning)
        name = record_name_of(step->first->name) + (step->second.empty() ? "" : "." + std::string(step->second));
    if (name.empty() && at.name == "std_msgs/msg/Header" && !scope.has_own_fields()) name = "std_msgs.Header.of_value";
  }
  if (name.empty()) {
    name = record_name_of(root.name) + (path.empty() ? "" : "." + std::string(path));
    if (scope.has_own_fields()) name += '-' + short_hash(here);
  }
  const auto [known, is_new] = names_.emplace(name, here);
  if (is_new || known->second == here) return name;
  name += '-' + short_hash(here);  // another version of the type
  names_.emplace(name, here);
  return name;
}

Result<MessageType> TypeMaker::make(const MessagePtr& message, const TypeUse& use) {
  const Scope scope{matching(rules_, use.of, use.name), use.left_out, std::string(use.name), members_of(*message, max_compared) > max_compared,
                    std::string(use.inside)};
  std::string key = std::to_string(reinterpret_cast<std::uintptr_t>(message.get())) + '|' + std::string(use.inside);
  for (const std::string& path : use.left_out) key += '|' + path;
  for (const Rule* rule : scope.own) key += '|' + std::to_string(rule - rules_.rules.data());
  if (scope.has_own_fields()) key += '|' + scope.name;
  if (const auto known = made_.find(key); known != made_.end()) return known->second.second;
  // An rdf type is kept for the life of the process, and strangers can announce types without end. One that is refused counts, too.
  const std::size_t members = 1 + members_of(*message, max_members_);
  if (made_.size() >= max_types_ || members > max_members_ - members_)
    return unexpected(Errc::limit_exceeded, "too many types have been made: the limits are max_types and max_type_members");
  members_ += members;
  MessageOptions options;
  options.field = [&](const Message&, const Field&, std::string_view path, FieldOptions& to) { to = says(*message, scope, path); };
  options.name = [&](const Message& at, std::string_view path) { return name_of(*message, scope, at, path); };
  Result<MessageType> type = MessageType::of(message, options);
  made_.emplace(std::move(key), std::make_pair(message, type));
  return type;
}

}  // namespace lrt::ros2
