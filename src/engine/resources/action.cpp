// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/action.hpp"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include <lrt/base/immortal.hpp>
#include <lrt/http/message.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/base/utf8.hpp"
#include "src/engine/change_scanner.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/registration.hpp"
#include "src/engine/resources/blueprint.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/stop_state.hpp"
#include "src/rdf/plain.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

Iri status_iri(Status status) {
  switch (status) {
    case Status::pending: return vocab::lrt_::pending;
    case Status::running: return vocab::lrt_::running;
    case Status::succeeded: return vocab::lrt_::succeeded;
    case Status::failed: return vocab::lrt_::failed;
    case Status::cancelled: return vocab::lrt_::cancelled;
  }
  return {};
}

std::string status_name(Status status) {
  const std::string_view iri = status_iri(status).text;
  return std::string(iri.substr(iri.find('#') + 1));
}

/// The record type of an invocation, for representations without RDF.
rdf::Type invocation_record(const model::ActionSpec& action) {
  rdf::Type record;
  record.kind = rdf::Type::Kind::record;
  const auto field = [&](std::string_view name, const rdf::Type& type, const rdf::Facets& facets = {}) {
    record.fields.push_back({std::string(name), "#" + std::string(name), &type, facets});
  };
  field("status", rdf::traits<std::string>::type());
  field("progress", rdf::traits<double>::type());
  for (const char* time : {"created", "startedAtTime", "endedAtTime"}) field(time, rdf::traits<Utc>::type());
  field("error", rdf::traits<std::string>::type());
  if (action.input) field("input", *action.input, action.facets);
  if (action.output) field("result", *action.output, action.output_facets);
  return record;
}

const rdf::FieldType* field_of(const rdf::Type& record, std::string_view name) noexcept {
  for (const rdf::FieldType& field : record.fields)
    if (field.name == name) return &field;
  return nullptr;
}

std::string_view policy_name(const model::ActionSpec& action) noexcept {
  constexpr std::string_view names[] = {"preempt", "queue", "reject", "parallel"};
  return names[static_cast<std::size_t>(action.policy.kind)];
}

rdf::Value instant(Utc time) { return time == Utc{} ? rdf::Value() : rdf::traits<Utc>::encode(time); }

}  // namespace

// ------------------------------------------------------------------------------------------------------------ invocation

InvocationResource::InvocationResource(std::string its_path, ActionResource& its_action)
    : ValueResource(std::move(its_path), its_action.thing), action(its_action) {}

Methods InvocationResource::methods() const noexcept {
  Methods methods;
  methods.remove = true;
  return methods;
}

Outcome InvocationResource::remove(Context& context, Parts& parts) { return parts.invocations.remove(*this, context); }

void InvocationResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  const std::string names = d.engine.vocabulary(d.base);
  describe_types(about, d);
  about.link(vocab::rdfs::seeAlso, d.base + action.path);
  about.link(vocab::lrt_::invocationOf, d.base + action.path);
  about.add(vocab::lrt_::status, rdf::TermView(status_iri(status)));
  about.add(vocab::lrt_::progress, rdf::literal(rdf::lexical::format(progress), vocab::xsd::double_));
  about.when(vocab::dcterms::created, created);
  about.when(vocab::prov::startedAtTime, started);
  about.when(vocab::prov::endedAtTime, ended);
  const auto part = [&](Iri predicate, const char* fragment, const rdf::Type& type, const rdf::Facets& facets, const rdf::Value& value) {
    const rdf::TermId node = d.graph.intern(rdf::iri(d.base + path + fragment));
    about.add(predicate, node);
    d.quote(*this, [&] { rdf::write_value(d.graph, node, type, facets, value, names); });
  };
  const model::ActionSpec& spec = *action.spec;
  if (spec.input && !input.is_null()) part(vocab::lrt_::input, "#input", *spec.input, spec.facets, input);
  if (status == Status::failed) about.add(vocab::lrt_::error, rdf::literal(result.error().message));
  if (status == Status::succeeded && spec.output && !result->is_null())
    part(vocab::lrt_::result, "#result", *spec.output, spec.output_facets, *result);
}

void InvocationResource::describe_types(About& about, const Description&) const { about.a(vocab::lrt_::Invocation).a(vocab::prov::Activity); }

std::optional<PlainValue> InvocationResource::plain_value(const Audience&) const {
  static const rdf::Facets no_facets;
  rdf::Value::Sequence values = {rdf::Value(status_name(status)),
                                 rdf::Value(progress),
                                 instant(created),
                                 instant(started),
                                 instant(ended),
                                 status == Status::failed ? rdf::Value(result.error().message) : rdf::Value()};
  if (action.spec->input) values.push_back(input);
  if (action.spec->output) values.push_back(status == Status::succeeded ? *result : rdf::Value());
  return PlainValue{&action.invocation_type, &no_facets, nullptr, rdf::Value(std::move(values))};
}

bool InvocationResource::fits_rdf(std::size_t max_values) const { return fits(input, max_values) && (!result || fits(*result, max_values)); }

std::string InvocationResource::up() const { return action.path; }

void InvocationResource::refresh() {
  const double now = control->fraction();
  if (finished() || now == progress) return;
  progress = now;
  mark_changed();
}

void InvocationResource::set_observed(bool observed, ChangeScanner& scanner) {
  if (observed) scanner.watch(*this);
  else scanner.unwatch(*this);
}

// ---------------------------------------------------------------------------------------------------------------- Action

const rdf::Type& no_input() noexcept {
  static const Immortal<rdf::Type> nothing([] {
    rdf::Type type;
    type.kind = rdf::Type::Kind::record;
    return type;
  }());
  return *nothing;
}

ActionResource::ActionResource(std::string its_path, ThingNode* its_thing, std::shared_ptr<model::ActionSpec> s)
    : Resource(std::move(its_path), its_thing, (its_thing->self.path + "/actions").size()),
      spec(std::move(s)),
      invocation_type(invocation_record(*spec)) {}
ActionResource::~ActionResource() = default;

Methods ActionResource::methods() const noexcept {
  Methods methods;
  methods.post = true;
  return methods;
}

Input ActionResource::input(const EngineOptions& options) const {
  Input input = input_of(*spec, spec->input ? *spec->input : no_input(), spec->facets, options);
  if (!spec->input) input.may_be_empty = true;
  return input;
}

Outcome ActionResource::post(Context& context, Parts& parts) { return parts.invocations.invoke(*this, context); }

void ActionResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.link(vocab::rdfs::seeAlso, d.base + thing->self.path);
  if (spec->input) about.link(vocab::hybrit::consumes, thing->shape_iri(d.base, input_shape()));
  if (spec->output) about.link(vocab::hybrit::produces, thing->shape_iri(d.base, output_shape()));
  describe_parts(about, d);
  if (d.audience.methods(*this).post) {
    const rdf::TermId binding = d.graph.fresh_blank();
    about.add(vocab::hybrit::binding, binding);
    describe_binding(d, binding);
  }
  about.add(vocab::lrt_::policy, rdf::literal(policy_name(*spec)));
  if (!unavailable.empty()) about.add(vocab::lrt_::unavailable, rdf::literal(unavailable));
  if (requires_expiry(*this)) about.add(Iri("https://w3id.org/lrt/ns#requiresExpiry"), rdf::literal("true", vocab::xsd::boolean));
  about.statements(spec->statements, d.base);
  for (const auto& i : invocations) about.link(vocab::lrt_::invocation, d.base + i->path);
  if (spec->input) describe_value_shape(d, *thing, input_shape());
  if (spec->output) describe_value_shape(d, *thing, output_shape());
  describe_effects(about, d);
}

namespace {

/// The class of a header field of a request (HTTP Vocabulary in RDF 1.0, which divides them as RFC 2616 4.5 and 7.1).
Iri header_class(std::string_view name) {
  const auto is_in = [&](std::initializer_list<std::string_view> names) {
    return std::any_of(names.begin(), names.end(), [&](std::string_view one) { return http::iequals(one, name); });
  };
  if (is_in({"Allow", "Content-Encoding", "Content-Language", "Content-Length", "Content-Location", "Content-MD5", "Content-Range", "Content-Type",
             "Expires", "Last-Modified"}))
    return vocab::http_core::EntityHeader;
  if (is_in({"Cache-Control", "Connection", "Date", "Pragma", "Trailer", "Transfer-Encoding", "Upgrade", "Via", "Warning"}))
    return vocab::http_core::GeneralHeader;
  return vocab::http_core::RequestHeader;
}

}  // namespace

/// The request that invokes it (HTTP Vocabulary in RDF 1.0).
void ActionResource::describe_binding(const Description& d, rdf::TermId node) const {
  About request(d.graph, node);
  request.a(vocab::http_core::Request)
      .add(vocab::http_core::mthd, rdf::TermView(vocab::http_methods::POST))
      .link(vocab::http_core::requestURI, d.base + path);
  std::vector<rdf::TermId> headers;
  const auto add = [&](std::string_view name, std::string_view value) {
    About header(d.graph, d.graph.fresh_blank());
    header.a(header_class(name)).add(vocab::http_core::fieldName, rdf::literal(name)).add(vocab::http_core::fieldValue, rdf::literal(value));
    headers.push_back(header.subject());
  };
  const auto add_own = [&](std::string_view name) {
    const auto is_it = [&](const auto& header) { return http::iequals(header.first, name); };
    if (std::none_of(spec->headers.begin(), spec->headers.end(), is_it)) add(name, rdf::media_type(rdf::Syntax::turtle));
  };
  if (spec->input) add_own("Content-Type");
  add_own("Accept");
  for (const auto& [name, value] : spec->headers) add(name, value);
  request.add(vocab::http_core::headers, d.graph.add_list(headers));
  if (!spec->input) return;
  const rdf::TermId body = d.graph.fresh_blank();
  request.add(vocab::http_core::body, body);
  About about(d.graph, body);
  if (const std::string of = rdf::target_class(*spec->input, d.engine.vocabulary(d.base)); !of.empty()) about.a(Iri(std::string_view(of)));
  about.link(vocab::dcterms::conformsTo, thing->shape_iri(d.base, input_shape()));
}

/// The actions that it is composed of.
void ActionResource::describe_parts(About& about, const Description& d) const {
  for (const std::string& location : spec->parts) {
    const Resource* part = d.engine.registry.find_usual(location, vocab::hybrit::Action.text);
    about.link(vocab::dcterms::hasPart, d.base + (part ? part->path : location));
    if (part) describe_types_of(*part, d);
  }
}

namespace {

/// Adds constraints to the shape: a focus node must have the triples that `node` has in `from`.
void must_have(rdf::Graph& graph, rdf::TermId shape, const rdf::Graph& from, rdf::TermId node) {
  for (const rdf::Triple& t : from.match(node, std::nullopt, std::nullopt)) {
    About constraint(graph, graph.fresh_blank());
    About(graph, shape).add(vocab::sh::property, constraint.subject());
    constraint.add(vocab::sh::path, from.term(t.predicate));
    if (!from.term(t.object).is_blank()) {
      constraint.add(vocab::sh::hasValue, from.term(t.object));
      continue;
    }
    const rdf::TermId inner = graph.fresh_blank();
    constraint.add(vocab::sh::qualifiedValueShape, inner).add(vocab::sh::qualifiedMinCount, rdf::literal("1", vocab::xsd::integer));
    must_have(graph, inner, from, t.object);
  }
}

}  // namespace

/// The shape of a property or, if the effect names a field of it, a shape within that one: it has the value of the input.
void ActionResource::describe_input_value(const Description& d, rdf::TermId effect_shape, std::size_t& parts, const model::EffectSpec& effect) const {
  const model::InputValue& from = *effect.from_input;
  std::string name(d.graph.term(effect_shape).text);
  rdf::TermId shape = effect_shape;
  const auto descend = [&](std::string_view predicate) {
    name += "." + std::to_string(shape == effect_shape ? ++parts : 1);
    const rdf::TermId inner = d.graph.intern(rdf::iri(name));
    About(d.graph, shape).add(vocab::sh::property, inner);
    About(d.graph, inner).add(vocab::sh::path, rdf::iri(predicate));
    shape = inner;
  };
  const std::string names = d.engine.vocabulary(d.base);
  const model::PropertySpec* property = effect.spec.get();
  if (const Resource* r = d.engine.registry.find_usual(effect.property, vocab::hybrit::Property.text))
    property = static_cast<const PropertyResource*>(r)->spec.get();
  rdf::Facets facets;
  if (property) facets = property->facets;
  if (!from.property_field.empty() && property) {
    const rdf::Type& record = *property->type;
    const rdf::FieldType* const field = field_of(record, from.property_field);
    if (!field) return;  // the other Thing has another property now
    facets = rdf::field_facets(*field, facets);
    if (!record.value_predicate.empty()) descend(record.value_predicate);
    descend(rdf::term_iri(field->predicate, names));
  }
  About about(d.graph, shape);
  about.link(vocab::lrt_::valueFrom, thing->shape_iri(d.base, input_shape()));
  if (const rdf::FieldType* const field = field_of(*spec->input, from.input_field))
    about.link(vocab::lrt_::inputField, rdf::term_iri(field->predicate, names));
  const auto number = [&](Iri predicate, const char* suffix, double value) {
    if (value == 0) return;
    const rdf::TermId node = d.graph.intern(rdf::iri(name + suffix));
    about.add(predicate, node);
    rdf::write_value(d.graph, node, rdf::traits<double>::type(), rdf::Facets().unit_of(facets), rdf::Value(value), names);
  };
  number(vocab::lrt_::tolerance, ".tolerance", from.tolerance);
  number(vocab::lrt_::period, ".period", from.period);
}

namespace {

/// Whether an audience may know that an action has an effect on a property: it may read it, or what may have its path.
bool shows_effect(const model::EffectSpec& effect, const Audience& audience, const Registry& registry) {
  if (!audience.is_restricted()) return true;
  const Resource* const property = registry.find_usual(effect.property, vocab::hybrit::Property.text);
  return property ? audience.sees(*property) : audience.sees_iri(effect.property, {}, registry);
}

}  // namespace

/// Its effects: shapes that properties conform to afterwards. They have no target, because they hold only after the action.
void ActionResource::describe_effects(About& about, const Description& d) const {
  if (!effects.empty()) {
    about.link(vocab::hybrit::produces, d.base + path + "#effect");
    add_placed(d.graph, effects, d.base);
  }
  struct Shape {
    rdf::TermId node{};
    std::size_t parts = 0;  ///< shapes of fields within it
  };
  std::map<std::string_view, Shape> shapes;  // one for each property, so that a query for what changes it finds the action once
  for (const model::EffectSpec& effect : spec->effects) {
    if (!shows_effect(effect, d.audience, d.engine.registry)) continue;
    const auto [at, is_new] = shapes.try_emplace(effect.property);
    Shape& of_property = at->second;
    if (is_new) {
      About shape(d.graph, d.base + path + "#effect-" + std::to_string(shapes.size()));
      of_property.node = shape.subject();
      d.graph.add(about.subject(), d.graph.intern(vocab::hybrit::produces), shape.subject());
      shape.a(vocab::sh::NodeShape).link(vocab::sosa::forProperty, d.base + effect.property);
      if (const Resource* r = d.engine.registry.find_usual(effect.property, vocab::hybrit::Property.text)) {
        const auto& property = static_cast<const PropertyResource&>(*r);
        shape.link(vocab::sh::node, property.thing->shape_iri(d.base, property.spec->path));
      }
    }
    if (effect.from_input) describe_input_value(d, of_property.node, of_property.parts, effect);
    if (!effect.value) continue;
    rdf::Graph value;
    const rdf::TermId node = value.fresh_blank();
    rdf::write_value(value, node, *effect.spec->type, effect.spec->facets, *effect.value, d.engine.vocabulary(d.base));
    must_have(d.graph, of_property.node, value, node);
  }
}

void ActionResource::describe_types(About& about, const Description&) const {
  about.a(vocab::hybrit::Action);
  if (spec->asynchronous) about.a(vocab::hybrit::AsynchronousAction);
  if (spec->stop) about.a(vocab::lrt_::StopAction);
  if (spec->releases) about.a(vocab::lrt_::ReleaseAction);
  about.a(spec->classes);
}

void ActionResource::summarize(Overview& o) const {
  o.described(spec->statements, spec->classes, nullptr);
  o.schema("input", spec->input, spec->facets);
  o.schema("output", spec->output, spec->output_facets);
  o.json("asynchronous", spec->asynchronous ? "true" : "false");
  if (spec->stop) o.json("stop", "true");
  if (requires_expiry(*this)) o.json("requiresExpiry", "true");
  if (spec->releases) o.json("release", "true");
  o.text("unavailable", unavailable);
}

void ActionResource::overview(Overview& o) const {
  o.text("policy", policy_name(*spec));
  o.begin_array("invocations");
  for (const auto& i : invocations) o.link({}, *i);
  o.end_array();
  if (!spec->headers.empty()) {
    o.begin_object("headers");
    for (const auto& [name, value] : spec->headers) o.text(name, value);
    o.end_object();
  }
  summarize_effects(o);
  std::vector<const Resource*> parts;
  for (const std::string& location : spec->parts)
    if (const Resource* part = o.registry().find_usual(location, vocab::hybrit::Action.text); part && o.sees(*part)) parts.push_back(part);
  if (parts.empty()) return;
  o.begin_array("parts");
  for (const Resource* part : parts) o.link({}, *part);
  o.end_array();
}

/// The effects that describe_effects() describes, on properties that the audience may see.
void ActionResource::summarize_effects(Overview& o) const {
  bool has_begun = false;
  for (const model::EffectSpec& effect : spec->effects) {
    const Resource* const property = o.registry().find_usual(effect.property, vocab::hybrit::Property.text);
    if (!property || !o.sees(*property)) continue;
    if (!std::exchange(has_begun, true)) o.begin_array("effects");
    o.begin_object({});
    o.text("property", o.iri(*property));
    if (effect.value)
      if (const auto value = rdf::write_plain(*effect.spec->type, effect.spec->facets, *effect.value, rdf::Plain::json)) o.json("value", *value);
    if (effect.from_input) {
      o.text("field", effect.from_input->property_field);
      o.text("valueFrom", "input");
      o.text("inputField", effect.from_input->input_field);
      if (effect.from_input->tolerance > 0) o.json("tolerance", rdf::lexical::format(effect.from_input->tolerance));
      if (effect.from_input->period > 0) o.json("period", rdf::lexical::format(effect.from_input->period));
    }
    o.end_object();
  }
  if (has_begun) o.end_array();
}

std::string ActionResource::shape_name(std::string_view what) const {
  return thing->shape_name("actions", "/" + spec->path + "/" + std::string(what));
}

bool ActionResource::take_availability() {
  const char* const reason = spec->availability.reason();
  std::string_view now = reason ? reason : "";
  now = now.substr(0, utf8::find_invalid(now).value_or(now.size()));
  if (reason && now.empty()) now = "not available";
  const std::string of_stop = reason_of_stop(*thing, *spec);
  if (!of_stop.empty()) now = of_stop;
  if (now == unavailable) return false;
  unavailable = now;
  return true;
}

void ActionResource::set_observed(bool observed, ChangeScanner& scanner) {
  if (observed) scanner.watch_availability();
  else scanner.unwatch_availability();
}

void ActionResource::mark_invocation_changed(const std::string& at) {
  mark_changed([&](const Audience& audience) { return !audience.view || audience.view->at(at).has(security::Right::read); });
}

void ActionResource::path_changed() {
  if (Result<rdf::Graph> read = read_effects(*spec, path)) effects = *std::move(read);  // the texts were validated before
  mark_changed();
  for (const auto& i : invocations) i->mark_changed();
}

void ActionResource::link_related(http::LinkWriter& links, const std::string& base) const {
  for (const auto& i : invocations) links.add(base + i->path, "related");
}

}  // namespace v0
}  // namespace lrt::engine
