// SPDX-License-Identifier: Apache-2.0
#include "src/client/discovery.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <set>
#include <type_traits>
#include <utility>

#include <lrt/rdf/vocab.hpp>

#include <lrt/client/description.hpp>

#include "src/client/session.hpp"
#include "src/client/things.hpp"

namespace lrt::client {
inline namespace v0 {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;

namespace {

/// Predicates to what is neither a Thing nor a part of one: it is read when it is used.
const std::set<std::string_view>& predicates_to_skip() {
  static const Immortal<std::set<std::string_view>> all(std::set<std::string_view>{vocab::rdf_::type.text,
                                                                                   vocab::rdfs::seeAlso.text,
                                                                                   vocab::rdfs::isDefinedBy.text,
                                                                                   vocab::hybrit::blueprint.text,
                                                                                   vocab::hybrit::subscriptions.text,
                                                                                   vocab::hybrit::binding.text,
                                                                                   vocab::hybrit::consumes.text,
                                                                                   vocab::hybrit::produces.text,
                                                                                   vocab::hybrit::onResource.text,
                                                                                   vocab::lrt_::state.text,
                                                                                   vocab::lrt_::all.text,
                                                                                   vocab::lrt_::invocation.text,
                                                                                   vocab::lrt_::invocationOf.text,
                                                                                   vocab::dcterms::conformsTo.text,
                                                                                   vocab::http_core::requestURI.text,
                                                                                   vocab::vom::unit.text,
                                                                                   vocab::qudt::hasUnit.text,
                                                                                   vocab::lrt_::session.text,
                                                                                   vocab::lrt_::query.text,
                                                                                   vocab::lrt_::structure.text,
                                                                                   vocab::lrt_::identity.text});
  return *all;
}

enum class ResourceKind : unsigned char { unknown, thing, property, action, other };

ResourceKind kind_of(const Graph& graph, TermId node) {
  const auto type = graph.find(vocab::rdf_::type);
  const auto has_type = [&](Iri name) {
    const auto id = graph.find(name);
    return type && id && graph.contains(node, *type, *id);
  };
  const auto has = [&](Iri predicate) {
    const auto id = graph.find(predicate);
    return id && graph.object(node, *id);
  };
  // A Thing that is used as a Property by another one is still a Thing: its own statements count.
  if (has_type(vocab::hybrit::RoboticThing) || has(vocab::hybrit::property) || has(vocab::hybrit::action)) return ResourceKind::thing;
  if (has_type(vocab::hybrit::Action) || has_type(vocab::hybrit::AsynchronousAction) || has(vocab::hybrit::consumes)) return ResourceKind::action;
  if (has_type(vocab::hybrit::Property) || has(vocab::vom::numericalValue) || has(vocab::rdf_::value)) return ResourceKind::property;
  if (has_type(vocab::sh::NodeShape) || has_type(vocab::hybrit::Subscription) || has_type(vocab::lrt_::Invocation)) return ResourceKind::other;
  if (has(vocab::hybrit::subscriptions)) return ResourceKind::thing;  // R1.8
  return ResourceKind::unknown;
}

void add_title(Names& names, const TermView& title) {
  constexpr std::size_t max_titles = 16;
  if (!title.is_literal() || names.titles.size() >= max_titles) return;
  if (std::find(names.titles.begin(), names.titles.end(), title.text) == names.titles.end()) names.titles.emplace_back(title.text);
}

Names names_of(const Graph& graph, TermId node) {
  Names names;
  for (const Iri predicate : {vocab::dcterms::title, vocab::rdfs::label, vocab::schema::name}) {
    const auto id = graph.find(predicate);
    if (!id) continue;
    for (const Triple& t : graph.match(node, id, std::nullopt)) add_title(names, graph.term(t.object));
  }
  return names;
}

}  // namespace

struct Discovery::Found {
  RepresentationPtr representation;
  ResourceKind kind = ResourceKind::unknown;
  std::vector<std::string> related;  ///< targets of Link fields
};

Discovery::Discovery(std::shared_ptr<Session> session, std::string url) : session_(std::move(session)), given_(url), start_(std::move(url)) {}

void Discovery::report(std::string problem) {
  constexpr std::size_t max_problems = 100;
  if (problems_.size() < max_problems) problems_.push_back(std::move(problem));
}

/// Linked resources that have to be read to determine their kind.
std::vector<std::string> Discovery::candidates(const Found& found) const {
  std::vector<std::string> result;
  const Graph& graph = found.representation->graph;
  std::set<std::string_view> known;  // to be something else, or to be read later
  for (const Triple& t : graph.triples()) {
    const TermView object = graph.term(t.object);
    if (!object.is_iri()) continue;
    const std::string_view predicate = graph.term(t.predicate).text;
    const bool is_part = predicate == vocab::hybrit::property.text || predicate == vocab::hybrit::action.text;
    if (is_part || predicates_to_skip().count(predicate) != 0) known.insert(document_of(object.text));
  }
  const auto add = [&](std::string_view iri) {
    const std::string_view url = document_of(iri);
    if (url.empty() || known.count(url) != 0 || !same_origin(url, start_)) return;
    if (const auto node = graph.find(rdf::iri(iri))) {
      const ResourceKind kind = kind_of(graph, *node);
      if (kind == ResourceKind::property || kind == ResourceKind::action || kind == ResourceKind::other) return;
    }
    result.emplace_back(url);
  };
  for (const Triple& t : graph.triples()) {
    const TermView object = graph.term(t.object), predicate = graph.term(t.predicate);
    constexpr std::string_view shacl = "http://www.w3.org/ns/shacl#";
    if (object.is_iri() && predicates_to_skip().count(predicate.text) == 0 && predicate.text.substr(0, shacl.size()) != shacl) add(object.text);
  }
  for (const std::string& target : found.related) add(target);
  return result;
}

Result<Robot> Discovery::run() {
  const Limits& limits = session_->options().limits;
  std::deque<std::pair<std::string, unsigned>> wanted{{std::string(document_of(start_)), 0}};
  std::set<std::string> seen{wanted.front().first};
  while (!wanted.empty()) {
    const auto [url, depth] = std::move(wanted.front());
    wanted.pop_front();
    ++requests_;
    Result<RepresentationPtr> read = session_->get(url);
    if (!read && read.error().code == Errc::unsupported_syntax) {  // R0.9: its links are in its header fields
      ++requests_;
      Result<RepresentationPtr> outline = session_->outline(url);
      if (outline && (!(*outline)->links.empty() || !(*outline)->methods.empty())) read = std::move(outline);
    }
    if (!read) {
      if (found_.empty() || read.error().code == Errc::cancelled) return unexpected(std::move(read).error());
      report(read.error().message);
      continue;
    }
    Found found;
    found.representation = *std::move(read);
    for (const char* relation : {"related", "item", "next"})
      for (std::string& target : found.representation->targets(relation)) found.related.push_back(std::move(target));
    const Representation& representation = *found.representation;
    if (representation.focus && document_of(representation.graph.term(*representation.focus).text) == representation.url)
      found.kind = kind_of(representation.graph, *representation.focus);
    if (found_.empty()) {
      start_ = representation.url;  // after redirects
      std::vector<std::string> documents = representation.objects(vocab::lrt_::structure);
      if (documents.empty()) documents = representation.targets(vocab::lrt_::structure.text);
      if (!documents.empty() && same_origin(documents.front(), start_)) {
        Result<std::optional<Robot>> robot = session_->structures().follow(given_, start_, documents.front(), requests_);
        if (!robot) return unexpected(std::move(robot).error());
        if (*robot) return **std::move(robot);
      }
    }
    const bool leads_on = found.kind == ResourceKind::thing || found.kind == ResourceKind::unknown;
    std::vector<std::string> next = leads_on ? candidates(found) : std::vector<std::string>();
    seen.insert(representation.url);
    const std::string key = representation.url;
    if (found_.emplace(key, std::move(found)).second) order_.push_back(key);
    for (std::string& candidate : next) {
      if (!seen.insert(candidate).second) continue;
      if (depth + 1 > limits.max_depth) {
        report("\"" + candidate + "\" is not read: it is more than " + std::to_string(limits.max_depth) + " links away");
      } else if (seen.size() > limits.max_resources) {
        return unexpected(Errc::limit_exceeded, "\"" + start_ + "\" leads to more than " + std::to_string(limits.max_resources) + " resources");
      } else {
        wanted.emplace_back(std::move(candidate), depth + 1);
      }
    }
  }
  return assemble();
}

Thing Discovery::thing_of(const Found& found) const {
  Thing thing;
  thing.session_ = session_;
  thing.url_ = found.representation->url;
  thing.types_ = found.representation->types();
  thing.document_ = std::make_shared<Thing::LateDocument>();
  thing.document_->read = found.representation;
  if (const auto containers = found.representation->objects(vocab::hybrit::subscriptions); !containers.empty())
    thing.subscriptions_ = containers.front();
  if (const auto states = found.representation->objects(vocab::lrt_::state); !states.empty()) thing.state_ = states.front();
  const Graph& graph = found.representation->graph;
  const TermId self = *found.representation->focus;
  thing.names_ = names_of(graph, self);
  thing.words_ = words_of(graph, self);

  const auto kind_at = [&](TermId node) {
    const ResourceKind here = kind_of(graph, node);
    if (here != ResourceKind::unknown) return here;
    const auto read = found_.find(std::string(document_of(graph.term(node).text)));
    return read == found_.end() ? ResourceKind::unknown : read->second.kind;
  };
  std::map<std::pair<std::string, std::string>, std::size_t> places[2];  // of properties and of actions, by URL and inline predicate
  const auto part = [&](auto& parts, const std::string& url, const std::string& predicate) -> auto& {
    constexpr bool is_action = std::is_same_v<typename std::decay_t<decltype(parts)>::value_type, Action>;
    const auto [known, is_new] = places[is_action ? 1 : 0].try_emplace({url, predicate}, parts.size());
    if (!is_new) return parts[known->second];
    typename std::decay_t<decltype(parts)>::value_type made = make(parts);
    made.session_ = session_;
    made.url_ = url;
    set_inline(made, predicate);
    parts.push_back(std::move(made));
    return parts.back();
  };
  std::set<std::string_view> seen, several;  // a predicate to several parts is the name of none
  for (const Triple& t : graph.match(self, std::nullopt, std::nullopt))
    if (const std::string_view predicate = graph.term(t.predicate).text; graph.term(t.object).is_iri() && !seen.insert(predicate).second)
      several.insert(predicate);
  const auto name = [&several](Names& names, const Graph& from, TermId node, std::string_view predicate) {
    for (std::string& title : names_of(from, node).titles)
      if (std::find(names.titles.begin(), names.titles.end(), title) == names.titles.end()) names.titles.push_back(std::move(title));
    // By its local name: the paper names hybrit:property without the IRI of its vocabulary.
    const std::string_view local = local_name(predicate);
    const bool is_general = local.empty() || local == "property" || local == "action" || several.count(predicate) != 0;
    if (!is_general && std::find(names.predicates.begin(), names.predicates.end(), predicate) == names.predicates.end())
      names.predicates.emplace_back(predicate);
  };

  for (const Triple& t : graph.match(self, std::nullopt, std::nullopt)) {
    const TermView object = graph.term(t.object);
    const std::string_view predicate = graph.term(t.predicate).text;
    if (predicate != vocab::hybrit::property.text && predicate != vocab::hybrit::action.text && predicates_to_skip().count(predicate) != 0) continue;
    if (object.is_iri()) {
      std::string url(document_of(object.text));
      if (!same_origin(url, start_) || object.text == found.representation->url) continue;
      if (url == found.representation->url) url = object.text;  // a node in this document
      ResourceKind kind = kind_at(t.object);
      if (predicate == vocab::hybrit::property.text && kind != ResourceKind::thing) kind = ResourceKind::property;
      if (predicate == vocab::hybrit::action.text) kind = ResourceKind::action;
      if (kind == ResourceKind::property) name(part(thing.properties_, url, {}).names_, graph, t.object, predicate);
      else if (kind == ResourceKind::action) name(part(thing.actions_, url, {}).names_, graph, t.object, predicate);
    } else if (object.is_blank() && (predicate == vocab::hybrit::property.text || kind_of(graph, t.object) == ResourceKind::property)) {
      // A value in the graph of the Thing itself: it is found again by its predicate.
      if (graph.match(self, t.predicate, std::nullopt).begin()->object == t.object)
        name(part(thing.properties_, thing.url(), std::string(predicate)).names_, graph, t.object, predicate);
    }
  }
  if (const auto stop = graph.find(vocab::lrt_::stop))
    for (const Triple& t : graph.match(self, *stop, std::nullopt))
      for (Action& action : thing.actions_) action.is_stop_ = action.is_stop_ || action.url_ == document_of(graph.term(t.object).text);
  // Resources that are linked by a Link field only.
  for (const std::string& target : found.related) {
    const auto read = found_.find(std::string(document_of(target)));
    if (read == found_.end() || !read->second.representation->focus) continue;
    const RepresentationPtr& other = read->second.representation;
    if (read->second.kind == ResourceKind::property) name(part(thing.properties_, read->first, {}).names_, other->graph, *other->focus, {});
    else if (read->second.kind == ResourceKind::action) name(part(thing.actions_, read->first, {}).names_, other->graph, *other->focus, {});
  }
  return thing;
}

/// For servers whose documents have no terms that are known. What can be posted to, and neither written nor listed, is an action. What leads nowhere
/// is a property. What has a part is a Thing. Where nothing has one, the first document is about a Thing.
void Discovery::assume_kinds() {
  const auto is_thing = [](const auto& entry) { return entry.second.kind == ResourceKind::thing; };
  if (std::any_of(found_.begin(), found_.end(), is_thing)) return;
  std::map<std::string, std::size_t> place;
  for (std::size_t i = 0; i < order_.size(); ++i) place.emplace(order_[i], i);
  const auto is_leaf = [&](const Found& found) {  // it may link to what was found before it: its Thing, its list
    const std::vector<std::string> linked = candidates(found);
    const std::size_t own = place.at(found.representation->url);
    return std::all_of(linked.begin(), linked.end(), [&](const std::string& url) { return place.count(url) == 0 || place.at(url) <= own; });
  };
  for (auto& [url, found] : found_) {
    if (found.kind != ResourceKind::unknown || url == start_) continue;
    const Representation& r = *found.representation;
    const bool is_list = r.graph.find(vocab::ldp::contains).has_value();
    if (r.allows("POST") && !r.allows("PUT") && !is_list) found.kind = ResourceKind::action;
    else if (is_leaf(found)) found.kind = ResourceKind::property;
  }
  const auto is_part = [&](const std::string& url) {
    const auto other = found_.find(url);
    return other != found_.end() && (other->second.kind == ResourceKind::property || other->second.kind == ResourceKind::action);
  };
  bool found_any = false;
  for (auto& [url, found] : found_) {
    if (found.kind != ResourceKind::unknown || !found.representation->focus) continue;
    std::vector<std::string> linked = found.related;
    for (const Triple& t : found.representation->graph.triples())
      if (const TermView object = found.representation->graph.term(t.object); object.is_iri()) linked.emplace_back(document_of(object.text));
    if (!std::any_of(linked.begin(), linked.end(), is_part)) continue;
    found.kind = ResourceKind::thing;
    found_any = true;
  }
  const auto first = found_.find(start_);
  if (!found_any && first != found_.end() && first->second.kind == ResourceKind::unknown && first->second.representation->focus)
    first->second.kind = ResourceKind::thing;
}

Result<Robot> Discovery::assemble() {
  assume_kinds();
  auto things = std::make_shared<std::vector<Thing>>();
  for (const std::string& url : order_) {
    const Found& found = found_.at(url);
    if (found.kind == ResourceKind::thing) things->push_back(thing_of(found));
  }
  Robot robot;
  robot.session_ = session_;
  robot.url_ = start_;
  robot.things_ = std::move(things);
  robot.problems_ = std::make_shared<const std::vector<std::string>>(std::move(problems_));
  robot.requests_ = requests_;
  return robot;
}

Discovery::~Discovery() = default;

}  // namespace v0
}  // namespace lrt::client
