// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/naming.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <set>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/vocab.hpp>

#include "tools/lrt/suggest.hpp"

namespace lrt::tool {
namespace {

/// Scheme, host and port, as it is compared.
std::string canonical_origin(std::string_view url) {
  const std::size_t host = url.find("://");
  std::string origin(url.substr(0, host == std::string_view::npos ? host : url.find_first_of("/?#", host + 3)));
  for (char& c : origin) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  for (const auto& [scheme, port] : {std::pair<std::string_view, std::string_view>("http://", ":80"), {"https://", ":443"}})
    if (origin.substr(0, scheme.size()) == scheme && origin.size() > port.size() &&
        origin.compare(origin.size() - port.size(), port.size(), port) == 0)
      origin.resize(origin.size() - port.size());
  return origin;
}

const char* noun(Named kind) {
  switch (kind) {
    case Named::thing: return "Thing";
    case Named::property: return "property";
    case Named::action: break;
  }
  return "action";
}

std::string quoted(const std::string& text) { return "\"" + text + "\""; }

/// "a, b, c and 7 more", each once.
std::string listed(const std::vector<std::string>& names, std::size_t most) {
  std::set<std::string> seen;
  std::string text;
  std::size_t left_out = 0;
  for (const std::string& name : names) {
    if (!seen.insert(name).second) continue;
    if (seen.size() > most) ++left_out;
    else text += (text.empty() ? "" : ", ") + name;
  }
  return left_out == 0 ? text : text + " and " + std::to_string(left_out) + " more";
}

template <class Parts>
std::vector<std::string> names_of(const Parts& parts) {
  std::vector<std::string> names;
  for (const auto& part : parts) names.push_back(part.name());
  return names;
}

/// "right_s1/position" of each part of that name.
template <class Parts>
std::vector<std::string> namesakes(const client::Robot& robot, const Parts& (client::Thing::*parts)() const, const std::string& name) {
  std::vector<std::string> all;
  for (const client::Thing& thing : robot.things())
    for (const auto& part : (thing.*parts)()) {
      const std::vector<std::string>& titles = part.names().titles;
      if (part.name() == name || std::find(titles.begin(), titles.end(), name) != titles.end()) all.push_back(thing.name() + "/" + part.name());
    }
  return all;
}

/// The end of the path of a URL, as people write it: "baxter/right_s1".
std::string path_of(const std::string& url) {
  const std::size_t host = url.find("://");
  const std::size_t path = host == std::string::npos ? host : url.find('/', host + 3);
  const std::string rest = path == std::string::npos ? std::string() : url.substr(path + 1);
  const Result<std::string> decoded = iri::decode(rest);
  return decoded ? *decoded : rest;
}

bool fits(const std::string& pattern, const std::string& name) { return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0; }

bool has_type(const client::Representation& representation, std::initializer_list<Iri> wanted) {
  const std::vector<std::string> types = representation.types();
  return std::any_of(wanted.begin(), wanted.end(), [&](Iri one) { return std::find(types.begin(), types.end(), one.text) != types.end(); });
}

}  // namespace

std::string name_of(const std::vector<client::Thing>& things, const std::string& url) {
  for (const client::Thing& thing : things) {
    if (thing.url() == url) return thing.name();
    for (const client::Property& property : thing.properties())
      if (property.url() == url) return thing.name() + "/" + property.name();
    for (const client::Action& action : thing.actions())
      if (action.url() == url) return thing.name() + "/" + action.name();
  }
  return {};
}

std::vector<NamedProperty> properties_of(const client::Thing& thing) {
  std::vector<NamedProperty> all;
  const std::string name = thing.name();
  for (const client::Property& property : thing.properties()) all.push_back({name + "/" + property.name(), property});
  return all;
}

bool is_pattern(const std::string& word) noexcept { return word.find_first_of("*?") != std::string::npos; }

std::vector<NamedProperty> fitting(const client::Robot& robot, const std::string& pattern) {
  const std::size_t slash = pattern.rfind('/');
  const std::string of_thing = pattern.substr(0, slash), of_part = slash == std::string::npos ? "*" : pattern.substr(slash + 1);
  std::vector<NamedProperty> all;
  for (const client::Thing& thing : robot.things()) {
    const std::vector<std::string>& titles = thing.names().titles;
    const std::string path = path_of(thing.url());
    const bool is_meant = fits(of_thing, thing.name()) || fits(of_thing, path) || fits("*/" + of_thing, path) ||
                          std::any_of(titles.begin(), titles.end(), [&](const std::string& title) { return fits(of_thing, title); });
    if (!is_meant) continue;
    for (const client::Property& property : thing.properties())
      if (fits(of_part, property.name())) all.push_back({thing.name() + "/" + property.name(), property});
  }
  return all;
}

bool is_thing(const client::Representation& representation) { return has_type(representation, {vocab::hybrit::RoboticThing}); }
bool is_action(const client::Representation& representation) {
  return has_type(representation, {vocab::hybrit::Action, vocab::hybrit::AsynchronousAction}) ||
         !representation.objects(vocab::hybrit::consumes).empty();
}

bool mentions_thing(const rdf::Graph& graph) {
  const auto type = graph.find(vocab::rdf_::type), thing = graph.find(vocab::hybrit::RoboticThing);
  return type && thing && !graph.match(std::nullopt, *type, *thing).empty();
}

Error explained(const client::Robot& robot, const std::string& name, Named wanted, const Error& error) {
  constexpr std::size_t few = 4, several = 12;
  const auto say = [&](std::string sentence) { return Error{error.code, std::move(sentence)}; };
  if (error.code == Errc::expected_value) {  // ambiguous: the names that are not
    const std::vector<std::string> all = wanted == Named::property ? namesakes(robot, &client::Thing::properties, name)
                                         : wanted == Named::action ? namesakes(robot, &client::Thing::actions, name)
                                                                   : std::vector<std::string>();
    if (all.size() < 2) return error;
    return say(std::string(noun(wanted)) + " " + quoted(name) + " is ambiguous: " + listed(all, few));
  }
  if (error.code != Errc::unknown_path) return error;
  // It names something of another kind.
  if (wanted != Named::thing) {
    if (const Result<client::Thing> thing = robot.thing(name)) {
      const std::vector<std::string> parts = wanted == Named::property ? names_of(thing->properties()) : names_of(thing->actions());
      std::string sentence = quoted(name) + " is a Thing, and no " + noun(wanted) + "; ";
      if (parts.empty()) return say(sentence + "it has none");
      return say(sentence + "it has " + listed(parts, several) + ": write " + name + "/" + parts.front());
    }
  }
  if (wanted != Named::action && robot.action(name)) return say(quoted(name) + " is an action, and no " + noun(wanted) + "; lrt invoke takes it");
  if (wanted != Named::property && robot.property(name)) return say(quoted(name) + " is a property, and no " + noun(wanted) + "; lrt get takes it");
  const std::vector<std::string> things = names_of(robot.things());
  const std::size_t slash = name.rfind('/');
  if (wanted == Named::thing || slash == std::string::npos) {
    std::vector<std::string> known = things;
    if (wanted == Named::property)
      for (const client::Thing& thing : robot.things())
        for (std::string& one : names_of(thing.properties())) known.push_back(thing.name() + "/" + std::move(one));
    const std::string meant = did_you_mean(name, known);
    const std::string hint = !meant.empty()           ? meant
                             : wanted == Named::thing ? "; it has " + listed(things, several)
                                                      : "; a name is THING/" + std::string(wanted == Named::property ? "PROPERTY" : "ACTION") +
                                                            ", and lrt ls lists the Things";
    return say(quoted(robot.url()) + " has no " + noun(wanted) + " " + quoted(name) + hint);
  }
  const std::string of_thing = name.substr(0, slash), of_part = name.substr(slash + 1);
  const Result<client::Thing> thing = robot.thing(of_thing);
  if (!thing) {
    if (thing.error().code != Errc::unknown_path) return say(thing.error().message);
    const std::string meant = did_you_mean(of_thing, things);
    return say(quoted(robot.url()) + " has no Thing " + quoted(of_thing) + (meant.empty() ? "; it has " + listed(things, several) : meant));
  }
  const std::vector<std::string> parts = wanted == Named::property ? names_of(thing->properties()) : names_of(thing->actions());
  const std::string meant = did_you_mean(of_part, parts);
  return say(quoted(of_thing) + " has no " + noun(wanted) + " " + quoted(of_part) +
             (!meant.empty()  ? meant
              : parts.empty() ? "; it has none"
                              : "; it has " + listed(parts, several)));
}

std::optional<Error> elsewhere(const std::string& url, const rdf::Graph& graph) {
  const std::string origin = canonical_origin(url);
  const std::size_t host = url.find("://");
  if (host == std::string::npos) return std::nullopt;
  const std::string rest = url.substr(0, url.find_first_of("?#"));
  const std::size_t slash = rest.find('/', host + 3);
  const std::string path = slash == std::string::npos ? "/" : rest.substr(slash);
  std::string other;
  for (const rdf::Triple& t : graph.triples()) {
    const rdf::TermView subject = graph.term(t.subject);
    if (!subject.is_iri() || !is_url(subject.text)) continue;
    if (canonical_origin(subject.text) == origin) return std::nullopt;
    const std::string_view iri = subject.text;
    const bool fits =
        iri.size() > path.size() && iri.substr(iri.size() - path.size()) == path && iri.find('/', iri.find("://") + 3) <= iri.size() - path.size();
    if (fits && other.empty()) other = iri;
  }
  if (other.empty()) return std::nullopt;
  return Error{Errc::failed, "\"" + url + "\" is a robot whose public base is another one: use \"" + other + "\""};
}

std::optional<Error> elsewhere(Client& client, const client::Robot& robot) {
  // Of a robot with another public base no Thing is found, or its own document looks like one.
  const std::vector<client::Thing>& things = robot.things();
  if (things.size() > 1 || (things.size() == 1 && things.front().url() != robot.url())) return std::nullopt;
  const Result<client::RepresentationPtr> document = client.get(robot.url());
  return document ? elsewhere((*document)->url, (*document)->graph) : std::nullopt;
}

std::string no_things(Client& client, const client::Robot& robot) {
  std::string sentence = "\"" + robot.url() + "\" has no Thing";
  const Result<client::RepresentationPtr> document = client.get(robot.url());
  if (!document) return sentence;
  const rdf::Graph& graph = (*document)->graph;
  for (const rdf::Triple& t : graph.triples()) {
    const std::string_view predicate = graph.term(t.predicate).text;
    const bool is_typed = predicate == vocab::rdf_::type.text && graph.term(t.object).text == vocab::hybrit::RoboticThing.text;
    const bool is_listed = predicate == vocab::ldp::contains.text;
    if (!is_typed && !is_listed) continue;
    const rdf::TermView thing = graph.term(is_typed ? t.subject : t.object);
    if (!thing.is_iri() || !is_url(thing.text) || has_same_origin(thing.text, robot.url())) continue;
    const std::size_t host = thing.text.find("://") + 3;
    return sentence + "; its document speaks of " + std::string(thing.text.substr(0, thing.text.find('/', host))) +
           "/, which is another origin: use that URL, or tell the server its public one";
  }
  return sentence;
}

}  // namespace lrt::tool
