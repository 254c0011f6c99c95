// SPDX-License-Identifier: Apache-2.0
#include "src/codegen/kinds.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "src/codegen/value_lines.hpp"

namespace lrt::codegen {
namespace {

std::string form_of(const std::optional<client::Schema>& schema, const std::string& origin, bool bounds) {
  return schema ? ValueLines(origin, bounds).text(schema->type(), schema->facets()) : std::string("?");
}
std::string form_of(const client::PropertyDescription& p, const std::string& origin, bool bounds) {
  return (p.writable ? "w " : "r ") + form_of(p.schema, origin, bounds);
}
std::string form_of(const client::ActionDescription& a, const std::string& origin, bool bounds) {
  return std::string(a.asynchronous ? "async " : "") + (a.has_input ? form_of(a.input, origin, bounds) : std::string()) + "->" +
         form_of(a.output, origin, bounds);
}

class Kinds {
 public:
  explicit Kinds(const client::Description& robot) {
    for (const client::ThingDescription& thing : robot.things) add(thing);
    name_all();
  }
  std::vector<ThingKind> take() { return std::move(kinds_); }

 private:
  void add(const client::ThingDescription& thing) {
    std::string key = thing.kind;
    if (key.empty())
      for (const std::string& c : thing.classes) key += " " + c;
    for (const std::size_t i : by_key_[key])
      if (fits(kinds_[i], thing)) return join(kinds_[i], thing);
    by_key_[key].push_back(kinds_.size());
    join(kinds_.emplace_back(), thing);
  }
  /// Kinds whose differences C++ cannot express, such as links between Things, are merged.
  void unite() {
    std::vector<ThingKind> united;
    for (ThingKind& kind : kinds_) {
      const auto same = std::find_if(united.begin(), united.end(), [&](const ThingKind& other) { return is_same(kind, other); });
      if (same == united.end()) {
        united.push_back(std::move(kind));
        continue;
      }
      const std::string name = std::min(std::pair(same->name.size(), same->name), std::pair(kind.name.size(), kind.name)).second;
      for (const client::ThingDescription* thing : kind.things) join(*same, *thing);
      same->name = name;
    }
    kinds_ = std::move(united);
    for (ThingKind& kind : kinds_) std::sort(kind.things.begin(), kind.things.end(), [](const auto* a, const auto* b) { return a->iri < b->iri; });
  }
  static bool is_same(const ThingKind& a, const ThingKind& b) {
    const auto same = [](const auto& x, const auto& y) {
      return x.size() == y.size() && std::equal(x.begin(), x.end(), y.begin(),
                                                [](const auto& p, const auto& q) { return p.first == q.first && p.second.form == q.second.form; });
    };
    return a.classes == b.classes && same(a.properties, b.properties) && same(a.actions, b.actions);
  }
  template <class Members, class Descriptions>
  static bool agree(const Members& members, const Descriptions& descriptions, const std::string& origin) {
    return std::all_of(descriptions.begin(), descriptions.end(), [&](const auto& d) {
      const auto known = members.find(d.name);
      return known == members.end() || known->second.form == form_of(d, origin, false);
    });
  }
  static bool fits(const ThingKind& kind, const client::ThingDescription& thing) {
    const std::string origin = origin_of(thing.iri);
    return agree(kind.properties, thing.properties, origin) && agree(kind.actions, thing.actions, origin);
  }
  template <class Members, class Descriptions>
  static void join(Members& members, const Descriptions& descriptions, const std::string& origin) {
    std::set<std::string> seen;
    for (const auto& d : descriptions) {
      if (!seen.insert(d.name).second) continue;
      auto& member = members[d.name];
      const std::string bounded = form_of(d, origin, true);
      if (!member.first) member.first = &d, member.form = form_of(d, origin, false), member.bounded_form = bounded;
      else if (member.bounded_form != bounded) member.equal_bounds = false;
      ++member.count;
    }
  }
  static void join(ThingKind& kind, const client::ThingDescription& thing) {
    if (kind.things.empty()) {
      kind.classes = thing.classes;
    } else {
      std::vector<std::string> common;
      std::set_intersection(kind.classes.begin(), kind.classes.end(), thing.classes.begin(), thing.classes.end(), std::back_inserter(common));
      kind.classes = std::move(common);
    }
    kind.things.push_back(&thing);
    const std::string origin = origin_of(thing.iri);
    join(kind.properties, thing.properties, origin);
    join(kind.actions, thing.actions, origin);
  }
  static std::string wanted_name(const ThingKind& kind) {
    const client::ThingDescription& first = *kind.things.front();
    if (!first.kind_name.empty()) return first.kind_name;
    std::string own = decoded_last_part(first.kind);
    if (!own.empty() && own != "blueprint" && own != "Blueprint") return own;
    if (!first.classes.empty()) return decoded_last_part(first.classes.front());
    return first.title.empty() ? decoded_last_part(first.iri) : first.title;
  }
  /// Orders by name, so that the numbers of equal names do not depend on addresses.
  void name_all() {
    for (ThingKind& kind : kinds_) kind.name = wanted_name(kind);
    unite();
    std::stable_sort(kinds_.begin(), kinds_.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  }

  std::vector<ThingKind> kinds_;
  std::map<std::string, std::vector<std::size_t>> by_key_;
};

}  // namespace

std::vector<ThingKind> kinds_of(const client::Description& robot) { return Kinds(robot).take(); }

}  // namespace lrt::codegen
