// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/json_ld/context.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/quote.hpp"
#include "src/rdf/n_triples.hpp"

namespace lrt::rdf::json_ld {
namespace {

namespace v = vocab;

constexpr Term plain(std::string_view name, Iri iri) { return {name, iri}; }
constexpr Term link(std::string_view name, Iri iri) { return {name, iri, Coercion::id}; }
constexpr Term one_of(std::string_view name, Iri iri) { return {name, iri, Coercion::vocab}; }
constexpr Term typed(std::string_view name, Iri iri, Iri datatype) { return {name, iri, Coercion::datatype, datatype}; }

// Terms of hybrit, lrt and vom, and terms of general vocabularies that robots use, have their local names. If two vocabularies have the same
// local name, the robot's term gets it (hybrit:property, vom:unit, rdf:value), and the other term keeps its prefix. The prefix `unit` is
// left out, so QUDT's units are whole IRIs. Links and times are strings, because their terms are typed. vom:numericalValue is not typed: its
// datatype depends on the C++ type and is written with the value where necessary.
constexpr Term terms[] = {
    plain("RoboticThing", v::hybrit::RoboticThing),
    plain("Property", v::hybrit::Property),
    plain("Action", v::hybrit::Action),
    plain("AsynchronousAction", v::hybrit::AsynchronousAction),
    plain("Subscription", v::hybrit::Subscription),
    plain("WebCallback", v::hybrit::WebCallback),
    plain("WebSocket", v::hybrit::WebSocket),
    link("property", v::hybrit::property),
    link("action", v::hybrit::action),
    link("blueprint", v::hybrit::blueprint),
    link("subscriptions", v::hybrit::subscriptions),
    link("binding", v::hybrit::binding),
    link("consumes", v::hybrit::consumes),
    link("produces", v::hybrit::produces),
    link("onResource", v::hybrit::onResource),
    typed("callbackURL", v::hybrit::callbackURL, v::xsd::anyURI),
    typed("websocketUrl", v::hybrit::websocketUrl, v::xsd::anyURI),
    link("all", v::lrt_::all),
    link("invocationOf", v::lrt_::invocationOf),
    plain("mediaType", v::hybrit::mediaType),

    plain("Invocation", v::lrt_::Invocation),
    link("state", v::lrt_::state),
    link("invocation", v::lrt_::invocation),
    one_of("status", v::lrt_::status),
    plain("pending", v::lrt_::pending),
    plain("running", v::lrt_::running),
    plain("succeeded", v::lrt_::succeeded),
    plain("failed", v::lrt_::failed),
    plain("cancelled", v::lrt_::cancelled),
    typed("progress", v::lrt_::progress, v::xsd::double_),
    plain("error", v::lrt_::error),
    link("input", v::lrt_::input),
    link("result", v::lrt_::result),
    plain("policy", v::lrt_::policy),
    link("collection", v::lrt_::collection),
    one_of("delivery", v::lrt_::delivery),
    plain("latest", v::lrt_::latest),
    plain("queue", v::lrt_::queue),
    plain("queueLength", v::lrt_::queueLength),
    typed("minimumInterval", v::lrt_::minimumInterval, v::xsd::double_),
    plain("secret", v::lrt_::secret),
    plain("delivered", v::lrt_::delivered),
    plain("dropped", v::lrt_::dropped),
    plain("lastError", v::lrt_::lastError),
    plain("suspended", v::lrt_::suspended),
    plain("confirmed", v::lrt_::confirmed),
    plain("Feed", v::lrt_::Feed),
    typed("mqttBroker", v::lrt_::mqttBroker, v::xsd::anyURI),
    plain("mqttTopic", v::lrt_::mqttTopic),
    plain("mqttCommandTopic", v::lrt_::mqttCommandTopic),
    link("frame", v::lrt_::frame),
    link("datatype", v::lrt_::datatype),
    link("elementType", v::lrt_::elementType),
    link("shape", v::lrt_::shape),
    one_of("byteOrder", v::lrt_::byteOrder),
    plain("littleEndian", v::lrt_::littleEndian),
    plain("bigEndian", v::lrt_::bigEndian),
    link("stop", v::lrt_::stop),
    plain("StopAction", v::lrt_::StopAction),
    link("stopState", v::lrt_::stopState),
    plain("StopState", v::lrt_::StopState),
    plain("ReleaseAction", v::lrt_::ReleaseAction),
    plain("unavailable", v::lrt_::unavailable),
    link("valueFrom", v::lrt_::valueFrom),
    link("inputField", v::lrt_::inputField),
    link("tolerance", v::lrt_::tolerance),
    link("period", v::lrt_::period),
    link("control", v::lrt_::control),
    plain("Control", v::lrt_::Control),
    typed("held", v::lrt_::held, v::xsd::boolean),
    plain("heldBy", v::lrt_::heldBy),
    typed("until", v::lrt_::until, v::xsd::dateTime),
    typed("controlRequired", v::lrt_::controlRequired, v::xsd::boolean),
    typed("expiresAfter", v::lrt_::expiresAfter, v::xsd::double_),
    link("forProperty", v::sosa::forProperty),

    plain("numericalValue", v::vom::numericalValue),
    link("unit", v::vom::unit),
    link("hasUnit", v::qudt::hasUnit),
    link("qudt:unit", v::qudt::unit),
    link("hasQuantityKind", v::qudt::hasQuantityKind),
    plain("Scalar", v::maths::Scalar),
    plain("Vector2D", v::maths::Vector2D),
    plain("Vector3D", v::maths::Vector3D),
    plain("Vector4D", v::maths::Vector4D),
    plain("Quaternion", v::maths::Quaternion),
    plain("CoordinateSystem", v::maths::CoordinateSystem),
    plain("x", v::maths::x),
    plain("y", v::maths::y),
    plain("z", v::maths::z),
    plain("w", v::maths::w),
    plain("AxisAngle", v::spatial::AxisAngle),
    plain("Rotation3D", v::spatial::Rotation3D),
    plain("Translation3D", v::spatial::Translation3D),
    plain("rotationAngle", v::spatial::rotationAngle),
    plain("rotationAxis", v::spatial::rotationAxis),
    plain("SpatialRelationship", v::spatial::SpatialRelationship),
    plain("translation", v::spatial::translation),
    plain("rotation", v::spatial::rotation),
    plain("matrix", v::lrt_::matrix),
    link("quantityValue", v::vom::quantityValue),
    link("quantityKind", v::vom::quantityKind),
    link("sourceCoordinateSystem", v::spatial::sourceCoordinateSystem),
    link("targetCoordinateSystem", v::spatial::targetCoordinateSystem),
    link("spatialRelationship", v::spatial::spatialRelationship),
    link("scaling", v::spatial::scaling),
    link("pose", v::lrt_::pose),
    link("rootLink", v::lrt_::rootLink),
    link("mimics", v::lrt_::mimics),
    link("positions", v::lrt_::positions),
    link("limits", v::lrt_::limits),
    link("dynamics", v::lrt_::dynamics),
    link("axis", v::lrt_::axis),
    link("safety", v::lrt_::safety),
    link("mimic", v::lrt_::mimic),
    link("inertial", v::lrt_::inertial),
    link("visual", v::lrt_::visual),
    link("collision", v::lrt_::collision),
    link("lrt:file", v::lrt_::file),
    plain("JointLimits", v::lrt_::JointLimits),
    plain("JointDynamics", v::lrt_::JointDynamics),
    plain("SafetyLimits", v::lrt_::SafetyLimits),
    plain("MimicRule", v::lrt_::MimicRule),
    plain("Inertia", v::lrt_::Inertia),
    plain("Geometry", v::lrt_::Geometry),
    plain("lowerLimit", v::lrt_::lowerLimit),
    plain("upperLimit", v::lrt_::upperLimit),
    plain("velocityLimit", v::lrt_::velocityLimit),
    plain("effortLimit", v::lrt_::effortLimit),
    plain("damping", v::lrt_::damping),
    plain("staticFriction", v::lrt_::staticFriction),
    plain("softLowerLimit", v::lrt_::softLowerLimit),
    plain("softUpperLimit", v::lrt_::softUpperLimit),
    plain("positionGain", v::lrt_::positionGain),
    plain("velocityGain", v::lrt_::velocityGain),
    plain("multiplier", v::lrt_::multiplier),
    plain("offset", v::lrt_::offset),
    plain("mass", v::lrt_::mass),
    plain("ixx", v::lrt_::ixx),
    plain("ixy", v::lrt_::ixy),
    plain("ixz", v::lrt_::ixz),
    plain("iyy", v::lrt_::iyy),
    plain("iyz", v::lrt_::iyz),
    plain("izz", v::lrt_::izz),
    plain("geometryType", v::lrt_::geometryType),
    plain("size", v::lrt_::size),
    plain("radius", v::lrt_::radius),
    plain("length", v::lrt_::length),
    plain("materialName", v::lrt_::materialName),
    plain("colour", v::lrt_::colour),
    link("ros:position", v::ros::position),
    link("ros:velocity", v::ros::velocity),
    link("ros:effort", v::ros::effort),
    link("ros:rotation", v::ros::rotation),
    link("ros:friction", v::ros::friction),
    link("ros:jointReferenceFrame", v::ros::jointReferenceFrame),
    link("ros:preceedingLink", v::ros::preceedingLink),
    link("ros:succeedingLink", v::ros::succeedingLink),
    link("xhv:prev", v::xhv::prev),
    link("xhv:next", v::xhv::next),

    plain("Container", v::ldp::Container),
    plain("BasicContainer", v::ldp::BasicContainer),
    plain("RDFSource", v::ldp::RDFSource),
    link("contains", v::ldp::contains),
    plain("Activity", v::prov::Activity),
    typed("startedAtTime", v::prov::startedAtTime, v::xsd::dateTime),
    typed("endedAtTime", v::prov::endedAtTime, v::xsd::dateTime),
    plain("title", v::dcterms::title),
    plain("description", v::dcterms::description),
    plain("identifier", v::dcterms::identifier),
    typed("modified", v::dcterms::modified, v::xsd::dateTime),
    typed("created", v::dcterms::created, v::xsd::dateTime),
    link("conformsTo", v::dcterms::conformsTo),
    link("hasPart", v::dcterms::hasPart),
    link("isPartOf", v::dcterms::isPartOf),
    link("hasFormat", v::dcterms::hasFormat),
    plain("format", v::dcterms::format),
    plain("byteSize", v::dcat::byteSize),
    link("dcat:mediaType", v::dcat::mediaType),
    plain("label", v::rdfs::label),
    plain("comment", v::rdfs::comment),
    link("seeAlso", v::rdfs::seeAlso),
    link("isDefinedBy", v::rdfs::isDefinedBy),
    link("subClassOf", v::rdfs::subClassOf),
    plain("value", v::rdf_::value),
    link("http-core:mthd", v::http_core::mthd),
    link("http-core:requestURI", v::http_core::requestURI),

    link("sh:property", v::sh::property),
    link("sh:path", v::sh::path),
    link("sh:node", v::sh::node),
    link("sh:datatype", v::sh::datatype),
    link("sh:class", v::sh::class_),
    link("sh:nodeKind", v::sh::nodeKind),
    link("sh:targetNode", v::sh::targetNode),
    link("sh:targetClass", v::sh::targetClass),
    link("sh:targetSubjectsOf", v::sh::targetSubjectsOf),
    link("sh:targetObjectsOf", v::sh::targetObjectsOf),
    link("sh:severity", v::sh::severity),
    link("sh:result", v::sh::result),
    link("sh:detail", v::sh::detail),
    link("sh:focusNode", v::sh::focusNode),
    link("sh:resultPath", v::sh::resultPath),
    link("sh:sourceShape", v::sh::sourceShape),
    link("sh:sourceConstraintComponent", v::sh::sourceConstraintComponent),
    link("sh:resultSeverity", v::sh::resultSeverity),
    link("sh:equals", v::sh::equals),
    link("sh:disjoint", v::sh::disjoint),
    link("sh:lessThan", v::sh::lessThan),
    link("sh:lessThanOrEquals", v::sh::lessThanOrEquals),
    link("sh:not", v::sh::not_),
    link("sh:hasValue", v::sh::hasValue),
    link("sh:alternativePath", v::sh::alternativePath),
    link("sh:inversePath", v::sh::inversePath),
    link("sh:zeroOrMorePath", v::sh::zeroOrMorePath),
    link("sh:oneOrMorePath", v::sh::oneOrMorePath),
    link("sh:zeroOrOnePath", v::sh::zeroOrOnePath),
};

bool has_prefix(const Term& term) noexcept { return term.name.find(':') != std::string_view::npos; }

}  // namespace

const Term* term_of(std::string_view iri) noexcept {
  static const Immortal<std::unordered_map<std::string_view, const Term*>> by_iri([] {
    std::unordered_map<std::string_view, const Term*> map;
    for (const Term& t : terms) map.emplace(t.iri.text, &t);
    return map;
  }());
  const auto found = by_iri->find(iri);
  return found == by_iri->end() ? nullptr : found->second;
}

std::size_t index_of(const Term& term) noexcept { return static_cast<std::size_t>(&term - terms); }
std::size_t term_count() noexcept { return std::size(terms); }
const Term& term_at(std::size_t index) noexcept { return terms[index]; }

bool is_term_name(std::string_view name) noexcept {
  static const Immortal<std::unordered_set<std::string_view>> names([] {
    std::unordered_set<std::string_view> all = {"id", "type"};
    for (const Term& t : terms) all.insert(t.name);
    return all;
  }());
  return names->count(name) != 0;
}

PrefixTable usable_prefixes(const Prefixes& prefixes) {
  PrefixTable table(prefixes);
  table.remove_if([](std::string_view name) { return name.empty() || is_term_name(name); });
  return table;
}

bool is_usable(const Term& term, PrefixTable& prefixes) noexcept {
  const std::size_t colon = term.name.find(':');
  if (colon == std::string_view::npos) return true;
  PrefixTable::Prefix* prefix = prefixes.find(term.name.substr(0, colon));
  const std::string_view local = term.name.substr(colon + 1);
  if (prefix == nullptr || prefix->iri.size() + local.size() != term.iri.text.size() || term.iri.text.substr(0, prefix->iri.size()) != prefix->iri)
    return false;
  return true;
}

std::string members(PrefixTable& prefixes, const std::vector<bool>* used, int indent) {
  const std::string line = ",\n" + std::string(static_cast<std::size_t>(indent), ' ');
  const auto compact = [&](std::string& out, std::string_view iri) {
    PrefixTable::Prefix* prefix = prefixes.best_for(iri);
    if (prefix == nullptr) return append_quoted(out, iri);
    prefix->used = true;
    append_quoted(out, std::string(prefix->name) + ":" + std::string(iri.substr(prefix->iri.size())));
  };
  std::string defined;
  for (std::size_t i = 0; i < std::size(terms); ++i) {
    const Term& t = terms[i];
    if ((used != nullptr && !(*used)[i]) || !is_usable(t, prefixes)) continue;
    defined += line;
    append_quoted(defined, t.name);
    defined += ": ";
    if (t.coercion == Coercion::none) {
      compact(defined, t.iri.text);
      continue;
    }
    defined += '{';
    if (has_prefix(t)) {
      prefixes.find(t.name.substr(0, t.name.find(':')))->used = true;
    } else {
      defined += "\"@id\": ";
      compact(defined, t.iri.text);
      defined += ", ";
    }
    defined += "\"@type\": ";
    if (t.coercion == Coercion::datatype) compact(defined, t.datatype.text);
    else defined += t.coercion == Coercion::id ? "\"@id\"" : "\"@vocab\"";
    defined += '}';
  }
  std::string out = line.substr(1) + "\"id\": \"@id\"" + line + "\"type\": \"@type\"";
  for (const PrefixTable::Prefix& prefix : prefixes.all()) {
    if (used != nullptr ? !prefix.used : prefixes.find(prefix.name) != &prefix) continue;
    out += line;
    append_quoted(out, prefix.name);
    out += ": ";
    // A simple definition is a prefix if its IRI ends in a gen-delim (JSON-LD-API 1.1, 4.2.2).
    const bool simple = std::string_view(":/?#[]@").find(prefix.iri.back()) != std::string_view::npos;
    if (!simple) out += "{\"@id\": ";
    append_quoted(out, prefix.iri);
    if (!simple) out += ", \"@prefix\": true}";
  }
  return out + defined;
}

std::string canonical_double(double value) {
  char buffer[48];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific, 15).ptr;
  const std::string_view text(buffer, static_cast<std::size_t>(end - buffer));
  const std::size_t e = text.find('e');
  std::string_view mantissa = text.substr(0, e), exponent = text.substr(e + 1);
  while (mantissa.back() == '0' && mantissa[mantissa.size() - 2] != '.') mantissa.remove_suffix(1);
  std::string out(mantissa);
  out += 'E';
  if (exponent.front() == '-') out += '-';
  exponent.remove_prefix(1);
  while (exponent.size() > 1 && exponent.front() == '0') exponent.remove_prefix(1);
  return out.append(exponent);
}

}  // namespace lrt::rdf::json_ld
