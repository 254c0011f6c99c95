// SPDX-License-Identifier: Apache-2.0
#include <lrt/thing.hpp>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <vector>

#include <lrt/base/immortal.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/base/misuse.hpp>
#include <lrt/rdf/dynamic_type.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/base/read_file.hpp"
#include "src/base/utf8.hpp"
#include "src/model/spec.hpp"
#include "src/rdf/words.hpp"

namespace lrt {
inline namespace v0 {

Object::Object(double number) : Object(rdf::lexical::format(number), std::string(vocab::xsd::double_.text), std::string()) {}
Object Object::truth(bool value) { return typed(value ? "true" : "false", vocab::xsd::boolean); }
Object Object::whole(std::int64_t value) { return typed(std::to_string(value), vocab::xsd::integer); }

}  // namespace v0
}  // namespace lrt

namespace lrt::model {
inline namespace v0 {

namespace {

/// The path that was probably meant: without empty names and dot segments.
std::string without_empty_names(std::string_view path) {
  std::vector<std::string_view> names;
  for (std::size_t start = 0; start <= path.size();) {
    const std::size_t end = std::min(path.find('/', start), path.size());
    const std::string_view name = path.substr(start, end - start);
    if (name == ".." && !names.empty()) names.pop_back();
    if (!name.empty() && name != "." && name != "..") names.push_back(name);
    start = end + 1;
  }
  std::string joined;
  for (const std::string_view name : names) joined.append(joined.empty() ? "" : "/").append(name);
  return joined;
}

/// @param start  where the name begins that no path may have
Error invalid_path(std::string_view path, std::size_t start, std::string_view name) {
  std::string message = "path \"" + std::string(path) + "\": ";
  if (path.empty()) message += "it is empty";
  else if (!name.empty()) message += "\"" + std::string(name) + "\" is not a name";
  else if (start == 0) message += "it begins with '/'";
  else if (start == path.size()) message += "it ends with '/'";
  else message += "a name between two '/' is empty";
  const std::string meant = without_empty_names(path);
  message += meant.empty() ? ": write a name, for example \"arm\"" : ": write \"" + meant + "\"";
  return {Errc::expected_iri, std::move(message), start};
}

}  // namespace

std::unique_ptr<const std::string> cache_control_of(std::chrono::milliseconds age, std::chrono::milliseconds while_revalidating) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(age).count(),
             more = std::chrono::duration_cast<std::chrono::seconds>(while_revalidating).count();
  if (seconds < 1) return nullptr;
  std::string value = "max-age=" + std::to_string(seconds);
  if (more > 0) value += ", stale-while-revalidate=" + std::to_string(more);
  return std::make_unique<const std::string>(std::move(value));
}

Result<std::string> encode_path(std::string_view path) {
  std::string out;
  std::size_t start = 0;
  while (true) {
    const std::size_t end = std::min(path.find('/', start), path.size());
    const std::string_view name = path.substr(start, end - start);
    if (const auto bad = utf8::find_invalid(name); bad || name.find('\0') != std::string_view::npos)
      return unexpected(Error{Errc::expected_iri, "path: expected UTF-8 without U+0000", start + bad.value_or(0)});
    if (name.empty() || name == "." || name == "..") return Unexpected{invalid_path(path, start, name)};
    if (!out.empty()) out += '/';
    out += iri::encode_segment(name);
    if (end == path.size()) return out;
    start = end + 1;
  }
}

Result<std::string> encode_path_from_root(std::string_view path) {
  return encode_path(path.size() > 1 && path.front() == '/' ? path.substr(1) : path);
}

void HandleLog::write(std::string_view message) noexcept {
  const std::lock_guard lock(mutex_);
  try {
    if (log_) log_(LogLevel::error, message);
  } catch (...) {  // thrown by the log callback: the message is lost
  }
}

void HandleLog::close() noexcept {
  const std::lock_guard lock(mutex_);
  log_ = nullptr;
}

Reading reading_of(Result<rdf::Value> value, bool whole) {
  Reading reading{std::move(value).value(), nullptr};
  if (whole) reading.whole = shared_value(rdf::Value(reading.value));
  return reading;
}

rdf::Texts titles_of(const ThingSpec& thing) {
  rdf::Texts titles;
  const bool has_more = thing.words && !thing.words->titles.empty();
  if (thing.has_plain_title || !has_more) titles.add(thing.title);
  if (has_more)
    for (const rdf::Text& t : thing.words->titles) titles.add(t.text, t.language);
  return titles;
}

rdf::Texts texts_of(const std::vector<Statement>& statements, Iri predicate) {
  rdf::Texts texts;
  for (const Statement& s : statements)
    if (s.predicate == predicate.text && s.object.kind() == Object::Kind::literal) texts.add(s.object.text(), s.object.language());
  return texts;
}

Error moved_from() {
  return {Errc::closed, "expected a Thing, found one that was moved from, as by Server::add(std::move(thing)); make a new Thing"};
}

namespace {

Error null_function(const ResourceSpec& spec) { return {Errc::invalid_option, spec.description() + ": expected a function, found a null one"}; }

rdf::Words& words_of(ThingSpec& thing) {
  if (!thing.words) thing.words = std::make_unique<rdf::Words>();
  return *thing.words;
}

}  // namespace

std::string ResourceSpec::location() const { return "/" + thing->path + (kind == Kind::action ? "/actions/" : "/") + path; }

void HandleContext::remember(Error error) {
  if (!first_error) first_error = std::make_unique<const Error>(std::move(error));
}

std::shared_ptr<HandleContext>& ThingSpec::context() {
  if (!handles) handles = std::make_shared<HandleContext>(HandleContext{path});
  return handles;
}

std::string ResourceSpec::description() const {
  constexpr const char* kinds[] = {"property", "action", "collection"};
  return std::string(kinds[static_cast<std::size_t>(kind)]) + " \"" + location().substr(1) + '"';
}

void ResourceSpec::report(const char* call, const char* what) const noexcept {
  try {
    if (!thing || !thing->log) return;
    thing->log->write(description() + ": " + call + "() " + what);
  } catch (...) {  // out of memory: the message is lost
  }
}

}  // namespace v0
}  // namespace lrt::model

namespace lrt {
inline namespace v0 {

Thing::Thing(std::string_view path) : spec_(std::make_unique<model::ThingSpec>()) {
  if (Result<std::string> encoded = model::encode_path_from_root(path)) {
    spec_->path = *std::move(encoded);
    spec_->title = std::string(path.substr(path.rfind('/') + 1));
  } else {
    spec_->path = std::string(path);
    remember(std::move(encoded).error());
  }
}

Thing::Thing(Thing&&) noexcept = default;
Thing& Thing::operator=(Thing&&) noexcept = default;
Thing::~Thing() = default;

const std::string& Thing::path() const noexcept {
  static const Immortal<std::string> none;
  return spec_ ? spec_->path : *none;
}

Thing& Thing::type(Iri type) { return described().classes.push_back(std::string(type.text)), *this; }
Thing& Thing::title(std::string text, std::string language) {
  if (!language.empty()) return model::words_of(described()).titles.add(std::move(text), std::move(language)), *this;
  if (described().has_plain_title) remember(rdf::twice("thing \"" + described().path + "\"", "title", {}));
  described().has_plain_title = true;
  return described().title = std::move(text), *this;
}
Thing& Thing::default_title(std::string text) {
  if (!described().has_plain_title) described().title = std::move(text);
  return *this;
}
Thing& Thing::description(std::string text, std::string language) {
  return model::words_of(described()).descriptions.add(std::move(text), std::move(language)), *this;
}
Thing& Thing::add(Iri predicate, Object object) {
  described().statements.push_back({std::string(predicate.text), std::move(object)});
  return *this;
}
Thing& Thing::add_turtle(std::string text) { return described().turtle.push_back(std::move(text)), *this; }
Thing& Thing::blueprint(Iri external) {
  described().blueprint = std::make_unique<const std::string>(external.text);
  return *this;
}
Thing& Thing::shapes(std::string turtle) { return described().shapes.push_back(std::move(turtle)), *this; }
Thing& Thing::shapes_from_file(const std::string& path) {
  Result<std::string> text = read_file(path, std::numeric_limits<std::size_t>::max());
  if (!text) remember({Errc::io_error, "thing \"" + described().path + "\": the shapes file \"" + path + "\" cannot be read"});
  return shapes(text ? *std::move(text) : std::string());
}
Thing& Thing::max_age(std::chrono::milliseconds age, std::chrono::milliseconds while_revalidating) {
  if (age.count() < 0 || while_revalidating.count() < 0)
    remember({Errc::invalid_option, "thing \"" + described().path + "\": max_age() expected times of at least 0"});
  return described().cache_control = model::cache_control_of(age, while_revalidating), *this;
}
Thing& Thing::dispatch(Dispatch where) { return described().dispatch = where, *this; }
Thing& Thing::requires_expiry() { return described().requires_expiry = true, *this; }

model::ThingSpec& Thing::described() {
  if (!spec_) {  // its calls have no effect but this error
    spec_ = std::make_unique<model::ThingSpec>();
    remember(model::moved_from());
  }
  return *spec_;
}

void Thing::report_moved(const char* call) const noexcept {
  if (spec_) return;
  char text[256];
  std::snprintf(text, sizeof text, "%s() of a Thing that was moved from: describe a Thing before Server::add(std::move(thing))", call);
  ::lrt::detail::misuse(text);
}

void Thing::remember(Error error) { described().context()->remember(std::move(error)); }

void Thing::set_path(model::ResourceSpec& spec, std::string_view path, const char* what) {
  spec.thing = described().context();
  Result<std::string> encoded = model::encode_path(path);
  if (encoded) {
    spec.path = *std::move(encoded);
    return;
  }
  remember({encoded.error().code, std::string(what) + " of thing \"" + described().path + "\": " + encoded.error().message, encoded.error().offset});
}

const rdf::Type& Thing::kept_type(std::string_view its_path, const rdf::DynamicType& type) {
  if (type) return *type;
  remember({Errc::invalid_option, "\"" + path() + "/" + std::string(its_path) + "\": there is no type; an empty rdf::DynamicType is none"});
  return *rdf::DynamicType::of<bool>();
}

std::shared_ptr<model::ResourceSpec> Thing::new_action(std::string_view its_path, const rdf::DynamicType& input, const rdf::DynamicType& output,
                                                       bool takes, bool gives, bool asynchronous, model::StartFunction start) {
  const auto wrong = [&](const char* what) {
    remember({Errc::invalid_option, "action \"" + path() + "/actions/" + std::string(its_path) + "\": " + what});
  };
  if (takes && !input) wrong("the callable takes an input, and no type of it is given");
  if (!takes && input) wrong("the callable does not take the input; write [](lrt::rdf::Value input) { ... }");
  if (gives && !output) wrong("the callable gives an output, and no type of it is given");
  if (!gives && output) wrong("the callable gives no output; return an lrt::rdf::Value, or take an lrt::ResponderOf<lrt::rdf::Value>");
  return new_action(its_path, input ? &*input : nullptr, output ? &*output : nullptr, asynchronous, std::move(start));
}

PushedProperty<rdf::Value> Thing::property(std::string_view path, const rdf::DynamicType& type, const Unit& unit) {
  return PushedProperty<rdf::Value>(new_pushed(path, kept_type(path, type), unit, model::new_slot<rdf::Value>()));
}
Collection<rdf::Value> Thing::collection(std::string_view path, const rdf::DynamicType& type) {
  return Collection<rdf::Value>(new_collection(path, kept_type(path, type)));
}

std::shared_ptr<model::PropertySpec> Thing::new_property(std::string_view path, const rdf::Type& type, const Unit& unit) {
  auto spec = std::make_shared<model::PropertySpec>();
  set_path(*spec, path, "property");
  spec->type = &type;
  spec->facets.unit(unit);
  described().properties.push_back(spec);
  return spec;
}

model::PulledSetup Thing::new_pulled(std::string_view path, const rdf::Type& type, const Unit& unit, model::ReadFunction read) {
  auto spec = new_property(path, type, unit);
  spec->changes = std::make_shared<model::ChangeSignal>();
  spec->read = std::move(read);
  if (!spec->read) spec->remember(model::null_function(*spec));
  return model::PulledSetup(spec, spec->changes);
}

model::PushedSetup Thing::new_pushed(std::string_view path, const rdf::Type& type, const Unit& unit, std::unique_ptr<model::SlotBase> slot) {
  auto spec = new_property(path, type, unit);
  spec->slot = std::move(slot);
  return model::PushedSetup(spec, {spec, spec->slot.get()});
}

std::shared_ptr<model::ResourceSpec> Thing::new_action(std::string_view path, const rdf::Type* input, const rdf::Type* output, bool asynchronous,
                                                       model::StartFunction start) {
  auto spec = std::make_shared<model::ActionSpec>();
  set_path(*spec, path, "action");
  spec->input = input;
  spec->output = output;
  spec->asynchronous = asynchronous;
  spec->start = std::move(start);
  if (!spec->start) spec->remember(model::null_function(*spec));
  described().actions.push_back(spec);
  return spec;
}

std::shared_ptr<model::ResourceSpec> Thing::new_collection(std::string_view path, const rdf::Type& type) {
  auto spec = std::make_shared<model::CollectionSpec>();
  set_path(*spec, path, "collection");
  spec->type = &type;
  described().collections.push_back(spec);
  return spec;
}

const model::WorldSpec* Thing::world() const noexcept { return spec_ ? spec_->world.get() : nullptr; }
std::unique_ptr<model::ThingSpec> Thing::release() && noexcept { return std::move(spec_); }

}  // namespace v0
}  // namespace lrt
