// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/action.hpp>
#include <lrt/thing.hpp>
#include <lrt/world.hpp>

#include "src/model/plain_name.hpp"
#include "src/security/policy.hpp"
#include "tests/support/bench.hpp"

namespace lrt::test::twins {

using security::Right;

inline constexpr int graphs = 10;
inline constexpr Iri near{"https://example.org/near"}, label = vocab::rdfs::label;

/// Ids of what the twin has too are the same in both robots.
class TwinIds final : public IdSource {
 public:
  std::string next() override { return (hidden ? "x" : "i") + std::to_string(++(hidden ? last_hidden_ : last_)); }
  void begin() { last_ = 1000; }
  bool hidden = false;

 private:
  int last_ = 0, last_hidden_ = 0;
};

inline std::string by(const std::string& who) { return "Authorization: " + who + "\n"; }

/// anna reads what is not hidden, bert too, carl everything.
inline engine::EngineOptions options_with(const std::shared_ptr<TwinIds>& ids, engine::EngineOptions options = {}) {
  options.ids = ids;
  options.max_page_members = 4;
  options.max_finished_invocations = 3;
  const auto role = [](const char* name) { return security::Who{security::Who::Kind::role, name}; };
  const security::Rights reads = Right::read | Right::subscribe, changes = reads | Right::write | Right::invoke;
  std::vector<security::Rule> rules = {{"/", security::Scope::tree, role("reader"), changes},
                                       {"/", security::Scope::tree, role("chief"), changes | Right::manage}};
  const auto hide = [&](const std::string& path) { rules.push_back({path, security::Scope::tree, role("chief"), changes | Right::manage}); };
  for (int i = 0; i < graphs; ++i) {
    hide("/world/h" + std::to_string(i));
    hide("/world/g" + std::to_string(i) + "/veiled");
    hide("/world/made_h" + std::to_string(i));
  }
  for (const char* path : {"/arm/veiled", "/arm/broken", "/arm/tool", "/veiled_arm", "/arm/veiled_list", "/arm/actions/veiled_turn"}) hide(path);
  for (const char* path : {"/arm/actions/turn", "/arm/kept"}) rules.push_back({path, security::Scope::below, role("chief"), changes | Right::manage});
  const auto policy = security::Policy::create(rules).value();
  std::map<std::string, std::shared_ptr<const security::Principal>> people;
  for (const char* name : {"anna", "bert"}) people[name] = std::make_shared<const security::Principal>(security::Principal{name, {"reader"}});
  people["carl"] = std::make_shared<const security::Principal>(security::Principal{"carl", {"chief"}});
  options.authorize = [policy, people](const http::Request& request) {
    engine::Caller caller;
    caller.principal = people.at(std::string(request.find("Authorization").value_or("anna")));
    caller.view = policy->view(caller.principal.get());
    return caller;
  };
  return options;
}

/// A robot with hidden things, or its twin.
struct Robot {
  explicit Robot(bool has_hidden, engine::EngineOptions options = {}) : hides(has_hidden), bench(options_with(ids, std::move(options))) {
    WorldOptions creation;
    creation.clients_may_create = true;
    creation.max_created = 100;
    World world("world", creation);
    GraphOptions writable;
    writable.clients_may_write = true;
    for (std::size_t i = 0; i < graphs; ++i) {
      shown[i] = world.graph("g" + std::to_string(i), writable);
      if (hides) hidden[i] = world.graph("h" + std::to_string(i), writable);
    }
    bench.add(std::move(world));
    Thing arm{"arm"};
    angle = arm.property<double>("angle");
    pose = arm.property<double>("pose");
    arm.property("pulled", [this] { return pulled; });
    turn = arm.action("turn", [](double) {});
    arm.collection<int>("list").on_create([](int) {});
    arm.collection<int>("kept").on_create([](int) {}).on_remove([](const std::string&) { return Result<void>(); });
    if (hides) {
      veiled = arm.property<double>("veiled");
      arm.property("broken", []() -> double { throw std::runtime_error("no sensor"); });
      arm.action("veiled_turn", [](double) {});
      arm.collection<int>("veiled_list").on_create([](int) {});
    }
    bench.add(std::move(arm));
    angle->publish(0);
    pose->publish(0);
    if (hides) veiled->publish(0);
    for (std::size_t i = 0; i < graphs; ++i) values[i].emplace(shown[i].published<double>("value", near));
    if (hides)
      for (std::size_t i = 0; i < graphs; ++i) veils[i].emplace(shown[i].published<double>("veiled", near));
    ids->begin();
  }

  /// Removes a Thing below, or adds it.
  void toggle(const std::string& path) {
    if (const auto found = things.find(path); found != things.end()) {
      bench.engine.remove(found->first).value();
      things.erase(found);
      return;
    }
    Thing thing{path};  // none is like one of the others: Things with equal parts share a Blueprint, which has the name of the first
    auto value = thing.property<double>(model::plain_name(path));
    bench.add(std::move(thing));
    value.publish(7);
    things.emplace(path, std::move(value));
  }

  /// A change that anna sees.
  void change(unsigned kind, unsigned n) {
    const std::size_t i = n % graphs;
    switch (kind) {
      case 0: shown[i].update([&](GraphUpdate& u) { u.add("#x", label, std::to_string(n)); }).value(); break;
      case 1: shown[i].update([&](GraphUpdate& u) { u.remove_node("#x").add("#y", label, "one"); }).value(); break;
      case 2:
        if (values[i]) values[i]->publish(n);
        break;
      case 3: angle->publish(n), pose->publish(n); break;
      case 4: pulled = n; break;
      case 5: bench.ask("POST /arm/actions/turn\n" + by("anna") + "Content-Type: application/json\n\n1"); break;
      case 6: bench.ask("POST /arm/list\n" + by("anna") + "Content-Type: application/json\n\n" + std::to_string(n)); break;
      case 7:
        bench.ask("PATCH /world/g" + std::to_string(i) + "\n" + by("anna") +
                  "Content-Type: application/sparql-update\n\nINSERT DATA { <#z> <p:q> [ <p:r> " + std::to_string(n) + " ] }");
        break;
      case 8: toggle("arm/hand"); break;
      case 9: toggle("other" + std::to_string(n % 3)); break;
      case 10: turn->available(n % 2 == 0, "it is busy"); break;
      case 11: pulled = n, bench.ask("GET /arm/pulled\n" + by("anna")); break;
      case 12: make_or_remove("/world/made_g" + std::to_string(i), "anna"); break;
      case 13:
        bench.ask("POST /world\n" + by("anna") + "Content-Type: application/trig\n\n<http://localhost/world/both_g" + std::to_string(i) +
                  "> { <p:s> <p:p> 1 } <http://localhost/world/g" + std::to_string(i) + "> { <p:s> <p:p> " + std::to_string(n) + " }");
        break;
      case 14:
        if (values[i]) values[i]->remove(), values[i].reset();
        else values[i].emplace(shown[i].published<double>("value", near)), values[i]->publish(n, bench.clock.now().utc);
        break;
      default: angle->publish(n), angle->publish(n + 1); break;
    }
  }
  static constexpr unsigned changes = 16;
  void make_or_remove(const std::string& path, const std::string& who) {
    if (made[path] = !made[path]; made[path]) bench.ask("PUT " + path + "\n" + by(who) + "Content-Type: text/turtle\n\n<p:s> <p:p> 1 .");
    else bench.ask("DELETE " + path + "\n" + by(who));
  }

  /// A change that only carl sees.
  void change_hidden(unsigned kind, unsigned n) {
    bench.ask("OPTIONS /\n" + by("anna"));  // so that both do what waits
    if (!hides) return;
    ids->hidden = true;
    const std::size_t i = n % graphs;
    const std::string of_hidden = std::string(World::base) + "/world/h" + std::to_string(n % graphs);
    switch (kind) {
      case 0: hidden[i].update([&](GraphUpdate& u) { u.add("#x", label, std::to_string(n)); }).value(); break;
      case 1: hidden[i].update([&](GraphUpdate& u) { u.remove_node("#x"); }).value(); break;
      case 2:
        if (veils[i]) veils[i]->publish(n);
        break;
      case 3: veiled->publish(n), veiled->publish(n + 1); break;
      case 4: hidden[i].update([&](GraphUpdate& u) { u.add(of_hidden, label, std::to_string(n)); }).value(); break;
      case 5: hidden[i].update([&](GraphUpdate& u) { u.remove_node(of_hidden); }).value(); break;
      case 6: bench.ask("POST /arm/actions/turn\n" + by("carl") + "Content-Type: application/json\n\n1"); break;
      case 7: bench.ask("POST /arm/veiled_list\n" + by("carl") + "Content-Type: application/json\n\n1"); break;
      case 8: toggle("arm/tool"); break;
      case 9: toggle("veiled_arm"); break;
      case 10: bench.open_stream("/arm/veiled", by("carl")); break;
      case 11:
        bench.ask("PATCH /world/h" + std::to_string(i) + "\n" + by("carl") +
                  "Content-Type: application/sparql-update\n\nINSERT DATA { <http://localhost/world/h" + std::to_string(i) +
                  "> <p:q> [ <p:r> [ <p:s> " + std::to_string(n) + " ] ] }");
        break;
      case 12: make_or_remove("/world/made_h" + std::to_string(i), "carl"); break;
      case 13:
        bench.ask("POST /world\n" + by("carl") + "Content-Type: application/trig\n\n<http://localhost/world/made_h" + std::to_string(i) +
                  "> { <p:s> <p:p> 1 } <http://localhost/world/h" + std::to_string(i) + "> { <p:s> <p:p> " + std::to_string(n) + " }");
        made["/world/made_h" + std::to_string(i)] = true;
        break;
      case 14:
        if (veils[i]) veils[i]->remove(), veils[i].reset();
        else veils[i].emplace(shown[i].published<double>("veiled", near)), veils[i]->publish(n, bench.clock.now().utc);
        break;
      case 15: bench.ask("POST /arm/kept\n" + by("carl") + "Content-Type: application/json\n\n1"); break;
      case 16:
        for (const std::string& member : bench.ask("GET /arm/kept\n" + by("carl") + "Accept: application/json\n").linked("related"))
          bench.ask("DELETE " + member.substr(member.find("/arm")) + "\n" + by("carl"));
        break;
      default: bench.ask("POST /arm/actions/veiled_turn\n" + by("carl") + "Content-Type: application/json\n\n1"); break;
    }
    ids->hidden = false;
  }
  static constexpr unsigned hidden_changes = 18;

  void subscribe() {
    for (const std::string& path : observed)
      for (const std::string policy : {"", "&queueLength=3", "&minimumInterval=0.01"})
        for (const char* type : {"application/json", "text/turtle"})
          channels.emplace_back(path + " " + type + policy, bench.open_stream(path + "?accept=" + type + policy, by("anna")));
    for (int i = 0; i < graphs; ++i)
      channels.emplace_back("g" + std::to_string(i), bench.open_stream("/world/g" + std::to_string(i) + "?accept=application/n-triples", by("anna")));
    ids->hidden = true;
    of_carl = hides ? std::optional(bench.open_stream("/world/g0?accept=text/turtle", by("carl"))) : std::nullopt;
    ids->hidden = false;
  }
  /// What anna's channels have to say, by their names.
  std::map<std::string, std::vector<std::string>> messages() {
    std::map<std::string, std::vector<std::string>> all;
    for (auto& [channel, push] : bench.pushes()) {
      if (of_carl && channel == *of_carl) ++for_carl;
      for (const auto& [name, mine] : channels)
        if (mine == channel && push.message) all[name].push_back(*push.message);
    }
    return all;
  }

  /// Paths of anna's subscriptions to the arm, which say what was sent and dropped.
  std::vector<std::string> subscriptions() {
    std::vector<std::string> paths;
    for (int page = 1; page < 20; ++page)
      for (const std::string& target : bench.ask("GET /arm/subscriptions?page=" + std::to_string(page) + "\n" + by("anna")).linked("related"))
        paths.push_back(target.substr(target.find("/arm/")));
    return paths;
  }

  const std::vector<std::string> observed = {"/world", "/arm", "/arm/state", "/arm/angle", "/arm/actions/turn", "/arm/pulled"};
  const std::shared_ptr<TwinIds> ids = std::make_shared<TwinIds>();
  const bool hides;
  Bench bench;
  std::array<WorldGraph, graphs> shown, hidden;
  std::array<std::optional<PublishedObject<double>>, graphs> values, veils;
  std::map<std::string, bool> made;
  std::optional<PushedProperty<double>> angle, pose, veiled;
  double pulled = 0;
  std::optional<Action> turn;
  std::map<std::string, PushedProperty<double>> things;
  std::vector<std::pair<std::string, engine::Channel>> channels;
  std::optional<engine::Channel> of_carl;
  int for_carl = 0;
};

/// Texts of one robot for a comparison with its twin. Entity tags become numbers in the order in which they first come. The hashes in names of Blueprints, which have hidden Properties too, are left out.
class Plain {
 public:
  std::string operator()(const std::string& text) {
    std::string plain;
    for (std::size_t at = 0; at < text.size();) {
      if (const std::size_t end = end_of_tag(text, at)) {
        plain += "tag " + std::to_string(tags_.emplace(text.substr(at, end - at), tags_.size()).first->second);
        at = end;
      } else if (text.compare(at, before_hash.size(), before_hash) == 0) {
        plain += before_hash;
        at = text.find_first_not_of("0123456789abcdef", at + before_hash.size());
      } else {
        plain += text[at++];
      }
    }
    return plain;
  }
  std::string operator()(const Answer& answer) {
    return (*this)(std::to_string(answer.status) + "\n" + std::string(answer.fields.block()) + "\n" + answer.body);
  }

 private:
  static constexpr std::string_view before_hash = "/blueprints/arm-";
  /// 22 characters in quotation marks, before the second one a point and digits: 0 if there is none.
  static std::size_t end_of_tag(const std::string& text, std::size_t at) {
    static constexpr std::string_view chars = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    if (text[at] != '"') return 0;
    std::size_t end = text.find_first_not_of(chars, at + 1);
    if (end == std::string::npos || end - at != 23) return 0;
    if (text[end] == '.') end = text.find_first_not_of("0123456789", end + 1);
    return end != std::string::npos && text[end] == '"' ? end + 1 : 0;
  }
  std::map<std::string, std::size_t> tags_;
};

/// Where two texts begin to differ; empty: they are equal.
inline std::string difference(const std::string& one, const std::string& other) {
  if (one == other) return {};
  std::size_t at = 0;
  while (at < one.size() && at < other.size() && one[at] == other[at]) ++at;
  const std::size_t begin = at < 150 ? 0 : at - 150;
  return one.substr(begin, 300) + "\n---- and its twin:\n" + other.substr(begin, 300);
}

}  // namespace lrt::test::twins
