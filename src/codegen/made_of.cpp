// SPDX-License-Identifier: Apache-2.0
#include "src/codegen/made_of.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
#include <utility>

#include <lrt/base/iri.hpp>

#include "src/codegen/value_lines.hpp"

namespace lrt::codegen {
namespace {

constexpr std::string_view list_begin = "// Made of:\n", list_line = "//   ", digest_line = "// Digest: ";

/// Text of a line of the list: printable ASCII.
std::string cell_of(std::string_view text) {
  constexpr char digits[] = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7F && c != '%' && c != '\\' && c != '|' && c != '?') out += c;
    else out += '%', out += digits[byte >> 4], out += digits[byte & 15];
  }
  return out;
}
std::string text_of_cell(std::string_view text) { return iri::decode(text).value_or(std::string(text)); }

/// FNV-1a of 64 bits: it finds what was edited by mistake.
std::string digest_of(std::string_view text) {
  std::uint64_t hash = 14695981039346656037U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  constexpr char digits[] = "0123456789abcdef";
  std::string out;
  for (int shift = 60; shift >= 0; shift -= 4) out += digits[hash >> shift & 15];
  return out;
}

void add_value(Parts& parts, const std::string& kind, const std::string& part, const std::optional<client::Schema>& schema, const std::string& origin,
               bool bounds) {
  if (!schema) {
    parts[{kind, part, ""}] = "a value that no shape describes";
    return;
  }
  ValueLines::Lines lines;
  ValueLines(origin, bounds).add({}, schema->type(), schema->facets(), lines);
  for (auto& [path, text] : lines) parts[{kind, part, path}] = std::move(text);
}

/// A readable place: "RevoluteJoint, property rotation, field rotationAxis/x".
std::string where_of(const std::vector<std::string>& key) {
  std::string text = key[0] + (key[1].empty() ? "" : ", " + key[1]);
  if (key[2].empty() || key[2] == "by") return text;
  std::string fields;
  for (std::size_t at = 0; at <= key[2].size();) {
    const std::size_t space = std::min(key[2].find(' ', at), key[2].size());
    fields += (fields.empty() ? "" : "/") + decoded_last_part(key[2].substr(at, space - at));
    at = space + 1;
  }
  return text + ", field " + fields;
}

std::string message_text(const std::string& text) { return cpp::comment_text(text, 400); }

}  // namespace

std::vector<std::string> kind_names(const std::vector<ThingKind>& kinds, cpp::Scope& scope, const GenerateOptions& options) {
  std::vector<std::string> names;
  for (const ThingKind& kind : kinds) names.push_back(scope.add(cpp::type_name(kind.name, options.max_name)));
  return names;
}

Parts parts_of(const std::vector<ThingKind>& kinds, const std::vector<std::string>& names, const std::vector<client::ShapeDescription>& shapes) {
  Parts parts;
  for (const client::ShapeDescription& s : shapes) {
    const std::string origin = origin_of(s.iri);
    add_value(parts, ValueLines(origin, true).short_iri(s.iri), "shape", s.schema, origin, true);
  }
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const ThingKind& kind = kinds[i];
    const std::string origin = origin_of(kind.things.front()->iri);
    const ValueLines flat(origin, true);
    std::string classes;
    for (const std::string& c : kind.classes) classes += (classes.empty() ? "" : " ") + flat.short_iri(c);
    parts[{names[i], "", ""}] = classes.empty() ? "no class" : classes;
    const auto predicates = [&](const std::vector<std::string>& all) {
      std::string text;
      for (const std::string& p : all) text += " " + flat.short_iri(p);
      return text;
    };
    for (const auto& [name, member] : kind.properties) {
      const client::PropertyDescription& p = *member.first;
      parts[{names[i], "property " + name, "by"}] = (p.writable ? "writable" : "read-only") + predicates(p.predicates);
      add_value(parts, names[i], "property " + name, p.schema, origin, member.equal_bounds);
    }
    for (const auto& [name, member] : kind.actions) {
      const client::ActionDescription& a = *member.first;
      parts[{names[i], "action " + name, "by"}] = (a.asynchronous ? "asynchronous" : "synchronous") + predicates(a.predicates);
      if (a.has_input) add_value(parts, names[i], "input of action " + name, a.input, origin, member.equal_bounds);
      if (a.output) add_value(parts, names[i], "output of action " + name, a.output, origin, member.equal_bounds);
    }
  }
  return parts;
}

std::string list_of(const Parts& parts) {
  std::string list;
  for (const auto& [key, what] : parts)
    list.append(list_line) += cell_of(key[0]) + " | " + cell_of(key[1]) + " | " + cell_of(key[2]) + " | " + cell_of(what) + "\n";
  return std::string(list_begin) + list + std::string(digest_line) + digest_of(list) + "\n";
}

Result<Parts> read_list(std::string_view header) {
  const auto unreadable = [](const char* why) {
    return unexpected(Errc::expected_value, std::string("expected a header that was made by lrt generate: ") + why);
  };
  const std::size_t begin = header.rfind(list_begin);
  if (begin == std::string_view::npos || (begin > 0 && header[begin - 1] != '\n')) return unreadable("it has no list of what it was made of");
  std::string_view rest = header.substr(begin + list_begin.size());
  const std::size_t end = rest.rfind(digest_line);
  if (end == std::string_view::npos || (end > 0 && rest[end - 1] != '\n')) return unreadable("it has no digest");
  const std::string_view list = rest.substr(0, end);
  if (rest.substr(end + digest_line.size(), 16) != digest_of(list)) return unreadable("the list at its end has been changed");
  Parts parts;
  for (std::string_view lines = list; !lines.empty();) {
    const std::size_t line_end = std::min(lines.find('\n'), lines.size());
    std::string_view line = lines.substr(0, line_end);
    lines.remove_prefix(std::min(line_end + 1, lines.size()));
    if (line.substr(0, list_line.size()) != list_line) return unreadable("the list at its end is damaged");
    line.remove_prefix(list_line.size());
    std::vector<std::string> cells;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t bar = line.find(" | ");
      if (bar == std::string_view::npos) return unreadable("the list at its end is damaged");
      cells.push_back(text_of_cell(line.substr(0, bar)));
      line.remove_prefix(bar + 3);
    }
    parts[std::move(cells)] = text_of_cell(line);
  }
  return parts;
}

inline namespace v0 {

Result<std::vector<std::string>> check(std::string_view header, const client::Description& robot, const GenerateOptions& options) {
  const Result<Parts> made_of = read_list(header);
  if (!made_of) return Unexpected{made_of.error()};
  cpp::Scope scope;
  const std::vector<ThingKind> kinds = kinds_of(robot);
  const Parts now = parts_of(kinds, kind_names(kinds, scope, options), robot.shapes);
  std::vector<std::string> differences;
  std::set<std::pair<std::string, std::string>> reported;  // kinds and parts that are missing or new as a whole
  const auto missing = [&](const Parts& from, const Parts& in, const char* who, const char* verb) {
    for (const auto& entry : from) {
      const std::vector<std::string>& key = entry.first;
      if (in.count(key) > 0) continue;
      const auto of_kind = in.lower_bound({key[0]}), of_part = in.lower_bound({key[0], key[1]});
      const bool has_kind = of_kind != in.end() && of_kind->first[0] == key[0];
      const bool has_part = of_part != in.end() && of_part->first[0] == key[0] && of_part->first[1] == key[1];
      const std::string part = has_kind ? key[1] : std::string();
      if ((!has_kind || !has_part) && !reported.insert({key[0], part + verb}).second) continue;
      const std::vector<std::string> place = !has_kind   ? std::vector<std::string>{key[0], "", ""}
                                             : !has_part ? std::vector<std::string>{key[0], key[1], ""}
                                                         : key;
      differences.push_back(message_text(where_of(place)) + ": " + who + (has_part ? ": " + message_text(entry.second) : std::string()));
    }
  };
  for (const auto& [key, what] : *made_of)
    if (const auto other = now.find(key); other != now.end() && other->second != what)
      differences.push_back(message_text(where_of(key)) + ": the header has " + message_text(what) + ", the robot has " +
                            message_text(other->second));
  missing(*made_of, now, "the robot does not have it any more", "-");
  missing(now, *made_of, "the header does not have it yet", "+");
  std::sort(differences.begin(), differences.end());
  return differences;
}

}  // namespace v0
}  // namespace lrt::codegen
