// SPDX-License-Identifier: Apache-2.0
#include <lrt/model/resource_handle.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <list>
#include <mutex>

#include <lrt/action.hpp>
#include <lrt/base/immortal.hpp>
#include <lrt/base/misuse.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/model/spec.hpp"

namespace lrt::model {
inline namespace v0 {
namespace {

PropertySpec& property_of(const std::shared_ptr<ResourceSpec>& spec) { return static_cast<PropertySpec&>(*spec); }
ActionSpec& action_of(const std::shared_ptr<ResourceSpec>& spec) { return static_cast<ActionSpec&>(*spec); }
CollectionSpec& collection_of(const std::shared_ptr<ResourceSpec>& spec) { return static_cast<CollectionSpec&>(*spec); }

/// The location of what a path names; empty after an error, which the action keeps.
std::string location_at(ActionSpec& action, std::string_view path) {
  Result<std::string> encoded = encode_path_from_root(path);
  if (encoded) return "/" + *std::move(encoded);
  if (!action.first_error) action.first_error = std::move(encoded).error();
  return {};
}

std::optional<InputValue> input_value(const FromInput* from) {
  if (!from) return std::nullopt;
  return InputValue{std::string(from->input_field), std::string(from->property_field), from->tolerance, from->period};
}

/// A record type whose field has further facets. Types are kept for the life of the process, because vocabularies and kinds refer to them. Equal
/// facets give the same type: Things with it are of one kind.
const rdf::Type& with_field_facets(const rdf::Type& record, std::size_t field, const rdf::Facets& facets) {
  struct Kept {
    const rdf::Type* of;
    std::string what;
    rdf::Type type;
  };
  static Immortal<std::mutex> mutex;
  static Immortal<std::list<Kept>> kept;
  rdf::Facets all = record.fields[field].facets;
  all.merge(facets);
  const auto bound = [](std::optional<double> value, bool exclusive) { return value ? rdf::lexical::format(*value) + (exclusive ? "!" : "") : "-"; };
  std::string what = std::to_string(field);
  for (const std::string& part : {std::string(all.unit().qudt.text), std::string(all.unit().vom.text), bound(all.min(), all.min_exclusive()),
                                  bound(all.max(), all.max_exclusive()), std::to_string(all.min_length()), std::to_string(all.max_length()),
                                  std::string(all.allows_non_finite() ? "any" : "finite")})
    what += ' ' + part;
  const std::lock_guard<std::mutex> lock(*mutex);
  for (const Kept& k : *kept)
    if (k.of == &record && k.what == what) return k.type;
  kept->push_back({&record, std::move(what), record});
  rdf::Type& type = kept->back().type;
  type.fields[field].facets = all;
  return type;
}

}  // namespace

std::shared_ptr<const void> shared_value(const void* value, void (*destroy)(const void*) noexcept) { return {value, destroy}; }
void keep_whole(Reading& reading, const void* value, void (*destroy)(const void*) noexcept) { reading.whole = shared_value(value, destroy); }

ResourceSetup::ResourceSetup(const ResourceSetup& other) noexcept = default;
ResourceSetup::ResourceSetup(ResourceSetup&& other) noexcept = default;
ResourceSetup& ResourceSetup::operator=(const ResourceSetup& other) noexcept = default;
ResourceSetup& ResourceSetup::operator=(ResourceSetup&& other) noexcept = default;
ResourceSetup::~ResourceSetup() = default;

PulledSetup::PulledSetup() noexcept = default;
PulledSetup::PulledSetup(std::shared_ptr<ResourceSpec> spec, std::shared_ptr<ChangeSignal> changes) noexcept
    : PropertySetup(std::move(spec)), changes_(std::move(changes)) {}
PulledSetup::PulledSetup(const PulledSetup& other) noexcept = default;
PulledSetup::PulledSetup(PulledSetup&& other) noexcept = default;
PulledSetup& PulledSetup::operator=(const PulledSetup& other) noexcept = default;
PulledSetup& PulledSetup::operator=(PulledSetup&& other) noexcept = default;
PulledSetup::~PulledSetup() = default;

PushedSetup::PushedSetup() noexcept = default;
PushedSetup::PushedSetup(std::shared_ptr<ResourceSpec> spec, std::shared_ptr<SlotBase> slot) noexcept
    : PropertySetup(std::move(spec)), slot_(std::move(slot)) {}
PushedSetup::PushedSetup(const PushedSetup& other) noexcept = default;
PushedSetup::PushedSetup(PushedSetup&& other) noexcept = default;
PushedSetup& PushedSetup::operator=(const PushedSetup& other) noexcept = default;
PushedSetup& PushedSetup::operator=(PushedSetup&& other) noexcept = default;
PushedSetup::~PushedSetup() = default;

bool ResourceSetup::is_open() const noexcept { return spec_ && !spec_->sealed.load(std::memory_order_acquire); }

namespace {
/// Reports a mistake to the handler of the program. The text is short enough for the stack: a control loop may be calling.
/// @param resource  nullptr: the handle is empty
void misuse(const ResourceSpec* resource, const char* call, const char* what) noexcept {
  char text[512];
  std::string name;
  try {
    if (resource) name = resource->description() + ": ";
  } catch (...) {}  // out of memory: without its name
  std::snprintf(text, sizeof text, "%s%s() %s", name.c_str(), call, what);
  ::lrt::detail::misuse(text);
}
}  // namespace

void ResourceSetup::report_late(const char* call, bool checks) const noexcept {
  if (!spec_) {
    if (checks) report_empty(call);
    return;
  }
  constexpr const char* what = "was called after the thing was added to a server; it has no effect";
  spec_->report(call, what);
  if (checks) misuse(spec_.get(), call, "was called after the thing was added to a server: call it before Server::add()");
}
void ResourceSetup::report_empty(const char* call) const noexcept {
  misuse(nullptr, call, "was called on an empty handle: assign what Thing::property(), Thing::action() or Thing::collection() returns");
}
void ResourceSetup::refuse_null(const char* call) {
  if (!is_editable(call)) return;
  spec_->remember({Errc::invalid_option, spec_->description() + ": " + call + "() expected a function, found a null one"});
}
void PushedSetup::report_second_writer(const char* call) const noexcept {
  constexpr const char* what = "was called while another thread publishes: one thread at a time publishes a property";
  spec_->report(call, what);
  misuse(spec_.get(), call, what);
}

rdf::Facets& ResourceSetup::facets_of() noexcept {
  switch (spec_->kind) {
    case ResourceSpec::Kind::property: return static_cast<PropertySpec&>(*spec_).facets;
    case ResourceSpec::Kind::action: return static_cast<ActionSpec&>(*spec_).facets;
    default: return static_cast<CollectionSpec&>(*spec_).facets;
  }
}
void ResourceSetup::set_dispatch(Dispatch where) noexcept { spec_->dispatch = where; }
void ResourceSetup::set_max_body_bytes(std::size_t n) noexcept { spec_->max_body_bytes = n; }
void ResourceSetup::set_harmless() noexcept { spec_->harmless = true; }
void ResourceSetup::add_predicate(std::string iri) { spec_->predicates.push_back(std::move(iri)); }
void ResourceSetup::add_class(std::string iri) { spec_->classes.push_back(std::move(iri)); }
void ResourceSetup::add_text(Iri predicate, std::string text, std::string language) {
  add_statement(std::string(predicate.text), language.empty() ? Object(std::move(text)) : Object::tagged(std::move(text), std::move(language)));
}
void ResourceSetup::add_statement(std::string predicate, Object object) { spec_->statements.push_back({std::move(predicate), std::move(object)}); }
std::string ResourceSetup::location() const { return spec_ ? spec_->location() : std::string(); }

void PushedSetup::set_keep(std::size_t samples) {
  constexpr std::size_t most = 1'000'000;
  if (samples > most)
    return spec_->remember(
        {Errc::invalid_option, spec_->description() + ": keep() expected at most 1000000 values, found " + std::to_string(samples)});
  slot_->keep(samples);
}
void PropertySetup::set_write(WriteFunction write) { property_of(spec_).write = std::move(write); }
void PropertySetup::set_life(std::chrono::milliseconds life, LapseFunction lapse) {
  property_of(spec_).life = std::make_unique<ValueLife>(life, std::move(lapse));
}
void PropertySetup::set_frame(Object system) { property_of(spec_).frame = std::make_unique<const Object>(std::move(system)); }
void PropertySetup::set_max_age(std::chrono::milliseconds age, std::chrono::milliseconds while_revalidating) {
  if (age.count() < 0 || while_revalidating.count() < 0)
    spec_->remember({Errc::invalid_option, spec_->description() + ": max_age() expected times of at least 0"});
  property_of(spec_).cache_control = cache_control_of(age, while_revalidating);
}
void PropertySetup::add_representation(std::string_view media_type, EncodeFunction encode, Layout layout, WholeFunction whole) {
  PropertySpec& property = property_of(spec_);
  RepresentationSpec made{std::string(media_type), std::move(encode), std::move(layout), {}};
  made.element_type = std::string(made.layout.element_type.text);
  property.representations.push_back(std::move(made));
  if (property.slot) property.slot->hold();
  property.whole = std::move(whole);
}
void PropertySetup::set_octets() noexcept { property_of(spec_).octets = true; }
void PropertySetup::set_file() noexcept { property_of(spec_).file = true; }
void PropertySetup::set_counter() noexcept { property_of(spec_).counter = true; }
void PropertySetup::set_sample_period(std::chrono::milliseconds period) noexcept {
  using Short = std::numeric_limits<std::int32_t>;
  property_of(spec_).sample_period = std::chrono::duration<std::int32_t, std::milli>(
      static_cast<std::int32_t>(std::clamp<std::int64_t>(period.count(), Short::min(), Short::max())));
}

rdf::Facets& ActionSetup::output_facets_of() noexcept { return action_of(spec_).output_facets; }
void ActionSetup::set_policy(ActionPolicy policy) noexcept { action_of(spec_).policy = policy; }
void ActionSetup::set_stop() noexcept {
  ActionSpec& action = action_of(spec_);
  action.stop = true;
  action.dispatch = Dispatch::io_thread;
  action.policy = ActionPolicy::parallel(16);
}
void ActionSetup::set_requires_expiry() noexcept { action_of(spec_).requires_expiry = true; }
void ActionSetup::set_ends_soon() noexcept { action_of(spec_).asynchronous = false; }
void ActionSetup::merge_field_facets(std::string_view field, const rdf::Facets& facets) {
  ActionSpec& action = action_of(spec_);
  const std::vector<rdf::FieldType> none;
  const std::vector<rdf::FieldType>& fields = action.input ? action.input->fields : none;
  const auto found = std::find_if(fields.begin(), fields.end(), [&](const rdf::FieldType& f) { return f.name == field; });
  if (found != fields.end()) {
    action.input = &with_field_facets(*action.input, static_cast<std::size_t>(found - fields.begin()), facets);
  } else if (!action.first_error) {
    action.first_error = Error{Errc::invalid_option, "consumes(\"" + std::string(field) + "\"): expected an input that is a record with this field"};
  }
}
namespace {
/// An effect or a part that refers to an empty handle is an error.
bool is_of(ActionSpec& action, const ResourceSetup& resource, const char* call) {
  if (resource) return true;
  if (!action.first_error)
    action.first_error = Error{Errc::invalid_option, std::string(call) +
                                                         "(): expected a handle that Thing::property() or Thing::action() "
                                                         "returned, found an empty one"};
  return false;
}
}  // namespace

void ActionSetup::add_effect(const ResourceSetup& property, const FromInput* from_input) {
  if (!is_of(action_of(spec_), property, "effect")) return;
  auto spec = std::static_pointer_cast<const PropertySpec>(property.spec_);
  action_of(spec_).effects.push_back({property.location(), std::move(spec), input_value(from_input), {}});
}
void ActionSetup::add_effect(const ResourceSetup& property, rdf::Value value) {
  if (!is_of(action_of(spec_), property, "effect")) return;
  auto spec = std::static_pointer_cast<const PropertySpec>(property.spec_);
  action_of(spec_).effects.push_back({property.location(), std::move(spec), {}, std::move(value)});
}
void ActionSetup::add_effect(std::string_view property, const FromInput* from_input) {
  action_of(spec_).effects.push_back({location_at(action_of(spec_), property), {}, input_value(from_input), {}});
}
void ActionSetup::add_effect_turtle(std::string text) { action_of(spec_).effect_turtle.push_back(std::move(text)); }
void ActionSetup::add_header(std::string name, std::string value) { action_of(spec_).headers.emplace_back(std::move(name), std::move(value)); }
void ActionSetup::add_part(const ResourceSetup& part) {
  if (is_of(action_of(spec_), part, "part")) action_of(spec_).parts.push_back(part.location());
}
void ActionSetup::add_part(std::string_view part) { action_of(spec_).parts.push_back(location_at(action_of(spec_), part)); }
void ActionSetup::set_unavailable(const char* reason) noexcept { action_of(spec_).availability.set(reason); }

void CollectionSetup::set_create(CreateFunction create) { collection_of(spec_).create = std::move(create); }
void CollectionSetup::set_remove(RemoveFunction remove) { collection_of(spec_).remove = std::move(remove); }
void CollectionSetup::set_max_members(std::size_t n) noexcept { collection_of(spec_).max_members = n; }

}  // namespace v0
}  // namespace lrt::model
