// SPDX-License-Identifier: Apache-2.0
#include <lrt/action.hpp>

namespace lrt {
inline namespace v0 {
namespace {

/// The location of what a path names; empty after an error, which the action keeps.
std::string location_at(model::ActionSpec& action, std::string_view path) {
  Result<std::string> encoded = model::encode_path_from_root(path);
  if (encoded) return "/" + *std::move(encoded);
  if (!action.first_error) action.first_error = std::move(encoded).error();
  return {};
}

}  // namespace

Action& Action::composed_of(const Action& part) {
  return edit("composed_of", [&](auto& s) { s.parts.push_back(location_of(part)); });
}
Action& Action::composed_of(std::string_view part) {
  return edit("composed_of", [&](auto& s) { s.parts.push_back(location_at(s, part)); });
}

Action& Action::add_effect(model::EffectSpec effect) {
  return edit("effect", [&](auto& s) { s.effects.push_back(std::move(effect)); });
}
Action& Action::add_effect(std::string_view property, bool input) {
  return edit("effect", [&](auto& s) { s.effects.push_back({location_at(s, property), input}); });
}

}  // namespace v0
}  // namespace lrt
