#include <algorithm>

#include <lrt/rdf/traits.hpp>

#include "src/engine/impl.hpp"

namespace lrt::engine {

// What a resource says without RDF around it (SPEC 3.9): the values of states and invocations are records that are made up here.

namespace {

void field(rdf::Type& record, std::string_view name, const rdf::Type& type, const rdf::Facets& facets = {}) {
  record.fields.push_back({std::string(name), "#" + std::string(name), &type, facets});
}

/// Takes what has no members, an empty list too, off `left`. False when that is not enough.
bool counted(const rdf::Value& value, std::size_t& left) {
  if (const rdf::Value::Sequence* members = value.sequence(); members && !members->empty())
    return std::all_of(members->begin(), members->end(), [&](const rdf::Value& member) { return counted(member, left); });
  if (left == 0) return false;
  --left;
  return true;
}

rdf::Value instant(Utc time) { return time == Utc{} ? rdf::Value() : rdf::traits<Utc>::encode(time); }

}  // namespace

rdf::Type state_type(const model::ThingSpec& thing) {
  rdf::Type record;
  record.kind = rdf::Type::Kind::record;
  for (const auto& p : thing.properties) field(record, p->path, *p->type, p->facets);
  return record;
}

rdf::Type invocation_type(const model::ActionSpec& action) {
  rdf::Type record;
  record.kind = rdf::Type::Kind::record;
  field(record, "status", rdf::traits<std::string>::type());
  field(record, "progress", rdf::traits<double>::type());
  for (const char* time : {"created", "startedAtTime", "endedAtTime"}) field(record, time, rdf::traits<Utc>::type());
  field(record, "error", rdf::traits<std::string>::type());
  if (action.input) field(record, "input", *action.input, action.input_facets);
  if (action.output) field(record, "result", *action.output, action.output_facets);
  return record;
}

Said said_by(const Resource& resource) {
  static const rdf::Facets none;
  switch (resource.kind) {
    case Kind::property: {
      const auto& p = static_cast<const PropertyResource&>(resource);
      return {p.spec->type, &p.spec->facets, &p.value};
    }
    case Kind::member: {
      const auto& m = static_cast<const MemberResource&>(resource);
      return {m.collection->spec->type, &m.collection->spec->facets, &m.value};
    }
    case Kind::state: {
      rdf::Value::Sequence values;
      for (const auto& p : resource.thing->properties) values.push_back(p->value);
      return {&resource.thing->state_type, &none, nullptr, rdf::Value(std::move(values))};
    }
    case Kind::invocation: {
      const auto& i = static_cast<const InvocationResource&>(resource);
      const bool failed = i.status == Status::failed;
      const std::string_view status = status_iri(i.status).text;
      rdf::Value::Sequence values = {rdf::Value(std::string(status.substr(status.find('#') + 1))), rdf::Value(i.progress),
                                     instant(i.created), instant(i.started), instant(i.ended),
                                     failed ? rdf::Value(i.result.error().message) : rdf::Value()};
      if (i.action->spec->input) values.push_back(i.input);
      if (i.action->spec->output) values.push_back(i.status == Status::succeeded ? *i.result : rdf::Value());
      return {&i.action->invocation_type, &none, nullptr, rdf::Value(std::move(values))};
    }
    default: return {nullptr, &none, nullptr};
  }
}

bool has_more_than(std::size_t most, const rdf::Value& value) { return !counted(value, most); }

bool says_more_than(std::size_t most, const Resource& resource) {
  const auto fits = [&](const PropertyResource& p) { return p.only_octets || counted(p.value, most); };
  switch (resource.kind) {
    case Kind::property: return !fits(static_cast<const PropertyResource&>(resource));
    case Kind::member: return !counted(static_cast<const MemberResource&>(resource).value, most);
    case Kind::state: {
      const auto& properties = resource.thing->properties;
      return !std::all_of(properties.begin(), properties.end(), [&](const auto& p) { return fits(*p); });
    }
    case Kind::invocation: {
      const auto& i = static_cast<const InvocationResource&>(resource);
      return !counted(i.input, most) || (i.result && !counted(*i.result, most));
    }
    default: return false;
  }
}

const Result<Bytes>& encoded(PropertyResource& property, std::size_t index) {
  if (property.encoded.empty()) property.encoded.resize(property.spec->representations.size());
  PropertyResource::Encoded& kept = property.encoded.at(index);
  if (kept.revision == property.revision) return kept.bytes;
  model::RepresentationSpec& spec = property.spec->representations[index];
  kept.revision = property.revision;
  kept.bytes = guarded<Bytes>([&]() -> Result<Bytes> {
    if (!property.whole) return unexpected(Errc::unsupported_syntax, "there is no " + spec.media_type + " of it now");
    Result<Bytes> bytes = spec.encode(property.whole.get());
    if (bytes && !*bytes) return unexpected(Errc::unsupported_syntax, "there is no " + spec.media_type + " of this value");
    return bytes;
  });
  if (!kept.bytes && kept.bytes.error().code != Errc::unsupported_syntax)
    kept.bytes = unexpected(kept.bytes.error().code, "its " + spec.media_type + " could not be made: " + kept.bytes.error().message);
  return kept.bytes;
}

}  // namespace lrt::engine
