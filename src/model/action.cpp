// SPDX-License-Identifier: Apache-2.0
#include <lrt/action.hpp>

#include "src/model/spec.hpp"

namespace lrt {
inline namespace v0 {
namespace {

model::ActionSpec& action_of(const std::shared_ptr<model::ResourceSpec>& spec) { return static_cast<model::ActionSpec&>(*spec); }

/// The location of what a path names; empty after an error, which the action keeps.
std::string location_at(model::ActionSpec& action, std::string_view path) {
  Result<std::string> encoded = model::encode_path_from_root(path);
  if (encoded) return "/" + *std::move(encoded);
  if (!action.first_error) action.first_error = std::move(encoded).error();
  return {};
}

}  // namespace

Action& Action::consumes(const rdf::Facets& f) {
  if (is_editable("consumes")) action_of(spec_).facets.merge(f);
  return *this;
}
Action& Action::produces(const rdf::Facets& f) {
  if (is_editable("produces")) action_of(spec_).output_facets.merge(f);
  return *this;
}
Action& Action::policy(ActionPolicy p) {
  if (is_editable("policy")) action_of(spec_).policy = p;
  return *this;
}
Action& Action::stop() {
  if (!is_editable("stop")) return *this;
  model::ActionSpec& action = action_of(spec_);
  action.stop = true;
  action.dispatch = Dispatch::io_thread;
  action.policy = ActionPolicy::parallel(16);
  return *this;
}

Action& Action::composed_of(const Action& part) {
  if (is_editable("composed_of")) action_of(spec_).parts.push_back(not_empty(part).location());
  return *this;
}
Action& Action::composed_of(std::string_view part) {
  if (is_editable("composed_of")) action_of(spec_).parts.push_back(location_at(action_of(spec_), part));
  return *this;
}

Action& Action::effect_turtle(std::string text) {
  if (is_editable("effect_turtle")) action_of(spec_).effect_turtle.push_back(std::move(text));
  return *this;
}
Action& Action::header(std::string name, std::string value) {
  if (is_editable("header")) action_of(spec_).headers.emplace_back(std::move(name), std::move(value));
  return *this;
}

Action& Action::add_effect(const model::ResourceSetup& property, bool input) {
  if (is_editable("effect")) action_of(spec_).effects.push_back({property.location(), input});
  return *this;
}
Action& Action::add_effect(const model::ResourceSetup& property, rdf::Value value) {
  if (is_editable("effect")) {
    action_of(spec_).effects.push_back(
        {property.location(), false, std::static_pointer_cast<const model::PropertySpec>(property.spec_), std::move(value)});
  }
  return *this;
}
Action& Action::add_effect(std::string_view property, bool input) {
  if (is_editable("effect")) action_of(spec_).effects.push_back({location_at(action_of(spec_), property), input});
  return *this;
}

void Action::set_unavailable(const char* reason) noexcept { action_of(spec_).availability.set(reason); }

}  // namespace v0
}  // namespace lrt
