// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/description.hpp"

#include <array>
#include <utility>

#include <lrt/http/problem.hpp>
#include <lrt/version.hpp>

#include "src/engine/identity.hpp"
#include "src/mqtt/message.hpp"
#include "src/rdf/json_canonical.hpp"
#include "src/rdf/json_parse.hpp"

namespace lrt::mqtt {
inline namespace v0 {

namespace {

namespace json = rdf::json;
using json::Document;
using Id = Document::Id;

constexpr std::size_t max_values = 4'000'000, max_depth = 100;

/// A JSON object that is written member by member.
class Writer {
 public:
  Writer& raw(std::string_view key, std::string_view value) {
    if (text_.size() > 1) text_ += ',';
    ((text_ += http::json_string(key)) += ':') += value;
    return *this;
  }
  Writer& text(std::string_view key, std::string_view value) { return raw(key, http::json_string(value)); }
  Writer& truth(std::string_view key, bool value) { return raw(key, value ? "true" : "false"); }
  bool empty() const noexcept { return text_.size() == 1; }
  std::string take() { return std::move(text_) + '}'; }

 private:
  std::string text_ = "{";
};

std::string_view text_of(const Document& d, Id object, std::string_view member) {
  const Id found = d.member(object, member);
  return found != Document::none && d.kind(found) == Document::Kind::string ? d.text(found) : std::string_view();
}
bool is_true(const Document& d, Id object, std::string_view member) {
  const Id found = d.member(object, member);
  return found != Document::none && d.kind(found) == Document::Kind::true_;
}
/// The first string of an array, or a string.
std::string_view first_text(const Document& d, Id object, std::string_view member) {
  const Id found = d.member(object, member);
  if (found == Document::none || d.kind(found) != Document::Kind::array) return text_of(d, object, member);
  const Id first = d.first(found);
  return first != Document::none && d.kind(first) == Document::Kind::string ? d.text(first) : std::string_view();
}
Id object_of(const Document& d, Id object, std::string_view member) {
  const Id found = d.member(object, member);
  return found != Document::none && d.kind(found) == Document::Kind::object ? found : Document::none;
}
/// Copies members as they are.
template <class Members>
void copy(Writer& to, const Document& d, Id object, const Members& members) {
  for (const std::string_view name : members)
    if (const Id found = d.member(object, name); found != Document::none) to.raw(name, json::canonical(d, found));
}

/// The type of the plain values of a schema, without null: "number".
std::string_view type_of(const Document& d, Id schema) {
  const Id type = d.member(schema, "type");
  if (type == Document::none || d.kind(type) != Document::Kind::array) return text_of(d, schema, "type");
  for (const Id one : json::Children(d, type))
    if (d.kind(one) == Document::Kind::string && d.text(one) != "null") return d.text(one);
  return {};
}

/// A unit of UCUM as people read it in Home Assistant.
std::string readable_unit(std::string_view ucum) {
  if (ucum == "1") return {};
  if (ucum == "Cel") return "°C";
  if (ucum == "N.m") return "Nm";
  if (ucum.substr(0, 3) == "deg") return "°" + std::string(ucum.substr(3));
  return std::string(ucum);
}

class PageDescriber {
 public:
  PageDescriber(const Document& document, const RobotFacts& robot) : d_(document), robot_(robot) {}

  DescribedThing describe(Id thing, Id kind) {
    const std::string path(text_of(d_, thing, "path"));
    Writer out;
    out.text("thing", robot_.base + path).text("path", path);
    constexpr std::array<std::string_view, 5> words = {"title", "titles", "description", "descriptions", "names"};
    copy(out, d_, thing, words);
    copy(out, d_, kind, std::array<std::string_view, 1>{"types"});
    out.raw("availability", Writer().text("topic", robot_.topics.status()).text("member", "online").take());
    if (!robot_.identity.iri.empty()) out.raw("robot", engine::json_of(robot_.identity));
    if (robot_.describes) out.text("document", robot_.topics.description());
    Writer properties, actions, components;
    if (const Id all = object_of(d_, kind, "properties"); all != Document::none)
      for (const Id property : json::Children(d_, all)) add_property(path, property, properties, components);
    if (const Id all = object_of(d_, kind, "actions"); all != Document::none)
      for (const Id action : json::Children(d_, all)) add_action(path, action, actions);
    if (!properties.empty()) out.raw("properties", properties.take());
    if (!actions.empty()) out.raw("actions", actions.take());
    DescribedThing described{path, out.take(), {}};
    if (robot_.discovers && !components.empty()) described.discovery = discovery(path, thing, components.take());
    return described;
  }

 private:
  void add_property(const std::string& thing, Id property, Writer& properties, Writer& components) {
    const std::string name(d_.key(property)), path = thing + "/" + name, topic = robot_.topics.of(path);
    const std::optional<PublishedAs> as = robot_.published(topic);
    Writer out;
    out.text("resource", robot_.base + path);
    if (as) {
      out.text("topic", topic).text("mediaType", as->how->media_type).text("form", as->how->form == Form::value ? "value" : "withMeaning");
      out.raw("qos", std::to_string(as->how->qos)).truth("retain", as->how->retain);
      out.raw("minimumInterval", json::canonical_number(std::chrono::duration<double>(as->minimum_interval).count()));
      if (as->how->expiry.count() > 0) out.raw("expiry", std::to_string(as->how->expiry.count()));
    }
    if (robot_.takes_commands && is_true(d_, property, "writable")) out.text("commandTopic", robot_.topics.of(Topics::Command::put, path));
    if (const std::string_view unit = first_text(d_, property, "units"); !unit.empty()) out.text("unit", unit);
    if (as && !as->frame.empty()) out.text("frame", as->frame);
    constexpr std::array<std::string_view, 8> copied = {"datatype", "title", "titles", "description", "descriptions", "names", "types", "schema"};
    copy(out, d_, property, copied);
    properties.raw(name, out.take());
    if (as && robot_.discovers && is_json(as->how->media_type)) add_component(topic, *as, property, components);
  }

  void add_action(const std::string& thing, Id action, Writer& actions) {
    const std::string path = thing + "/" + std::string(text_of(d_, action, "path"));
    Writer out;
    out.text("resource", robot_.base + path);
    out.text("invocations", robot_.topics.of(path) + "/+");
    if (robot_.takes_commands && is_true(d_, action, "invocable")) out.text("commandTopic", robot_.topics.of(Topics::Command::post, path));
    constexpr std::array<std::string_view, 9> copied = {"title", "titles", "description", "descriptions", "names",
                                                        "types", "input",  "output",      "stop"};
    copy(out, d_, action, copied);
    actions.raw(d_.key(action), out.take());
  }

  /// An entity of Home Assistant, if it has one for such values.
  void add_component(const std::string& topic, const PublishedAs& as, Id property, Writer& components) {
    const Id schema = object_of(d_, property, "schema");
    if (schema == Document::none) return;
    const std::string_view type = type_of(d_, schema);
    const bool is_number = type == "number" || type == "integer", is_truth = type == "boolean";
    if (!is_number && !is_truth && type != "string") return;
    const std::string id = id_of(topic);
    const std::string_view title = text_of(d_, property, "title");
    Writer out;
    out.text("platform", is_truth ? "binary_sensor" : "sensor").text("unique_id", id);
    out.text("name", title.empty() ? d_.key(property) : title);
    out.text("state_topic", topic);
    out.text("value_template", as.how->form == Form::value ? "{{ value_json }}" : "{{ value_json.value }}");
    if (is_truth) out.text("payload_on", "True").text("payload_off", "False");
    if (is_number) {
      out.text("state_class", "measurement");
      if (const std::string unit = readable_unit(text_of(d_, schema, "unit")); !unit.empty()) out.text("unit_of_measurement", unit);
    }
    if (as.how->expiry.count() > 0) out.raw("expire_after", std::to_string(as.how->expiry.count()));
    components.raw(id, out.take());
  }

  std::string discovery(const std::string& path, Id thing, const std::string& components) const {
    const std::string topic = robot_.topics.of(path);
    const std::string_view title = text_of(d_, thing, "title");
    Writer device, availability, out;
    device.raw("identifiers", "[" + http::json_string(id_of(topic)) + "]").text("name", title.empty() ? std::string_view(topic) : title);
    const Identity& robot = robot_.identity;
    for (const auto& [key, text] : {std::pair("serial_number", &robot.serial_number), std::pair("model", &robot.model),
                                    std::pair("manufacturer", &robot.manufacturer), std::pair("sw_version", &robot.software_version)})
      if (!text->empty()) device.text(key, *text);
    availability.text("topic", robot_.topics.status()).text("value_template", "{{ 'online' if value_json.online else 'offline' }}");
    out.raw("device", device.take());
    out.raw("origin", Writer().text("name", "lrt").text("sw_version", LRT_VERSION).take());
    out.raw("availability", "[" + availability.take() + "]").raw("components", components);
    return out.take();
  }

  const Document& d_;
  const RobotFacts& robot_;
};

}  // namespace

Result<DescribedPage> describe_things(std::string_view structure, const RobotFacts& robot) {
  json::Limits limits;
  limits.values = max_values;
  limits.depth = max_depth;
  const Result<Document> document = Document::parse(structure, limits);
  if (!document) return Unexpected{document.error()};
  const Document& d = *document;
  const auto wrong = [](const char* what) { return unexpected(Errc::expected_value, std::string("the structure document has no ") + what); };
  if (d.kind(d.root()) != Document::Kind::object) return wrong("object");
  const Id kinds = object_of(d, d.root(), "kinds"), things = d.member(d.root(), "things");
  if (kinds == Document::none || things == Document::none || d.kind(things) != Document::Kind::array) return wrong("Things");
  DescribedPage page;
  PageDescriber describer(d, robot);
  for (const Id thing : json::Children(d, things)) {
    const Id kind = d.kind(thing) == Document::Kind::object ? object_of(d, kinds, text_of(d, thing, "kind")) : Document::none;
    if (kind == Document::none || text_of(d, thing, "path").empty()) return wrong("kind or path of a Thing");
    page.things.push_back(describer.describe(thing, kind));
  }
  if (const Id next = object_of(d, d.root(), "next"); next != Document::none) {
    const std::string_view href = text_of(d, next, "href");
    if (href.substr(0, robot.base.size()) == robot.base) page.next = href.substr(robot.base.size());
  }
  return page;
}

}  // namespace v0
}  // namespace lrt::mqtt
