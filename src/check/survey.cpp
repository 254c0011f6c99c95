// SPDX-License-Identifier: Apache-2.0
#include "src/check/survey.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/exchange/redirect.hpp"

namespace lrt::check {
namespace {

constexpr int max_link_pages = 10;            // rel=next of one resource
constexpr std::size_t max_steps = 1'000;      // from one resource
constexpr std::size_t max_triples = 100'000;  // of one representation

bool begins_with(std::string_view text, std::string_view beginning) { return text.substr(0, beginning.size()) == beginning; }

/// A step of the visit: where to, and as what.
struct Step {
  std::string url;
  std::string advertised_by;
  bool property = false, action = false, subscriptions = false, blueprint = false;
};

bool is_one_of(const rdf::Graph& graph, const std::string& url, std::initializer_list<Iri> types) {
  return std::any_of(types.begin(), types.end(), [&](Iri type) { return graph.contains(rdf::iri(url), vocab::rdf_::type, type); });
}

void classify(Resource& resource) {
  if (!resource.graph) return;
  const rdf::Graph& graph = *resource.graph;
  resource.property = resource.property || graph.contains(rdf::iri(resource.url), vocab::rdf_::type, vocab::hybrit::Property);
  resource.action = resource.action || graph.contains(rdf::iri(resource.url), vocab::rdf_::type, vocab::hybrit::Action);
  resource.subscription = is_one_of(graph, resource.url, {vocab::hybrit::Subscription});
  const rdf::TermView shape = vocab::sh::NodeShape, type = vocab::rdf_::type;
  // An Action may describe its input with shapes. It is not a Blueprint then.
  if (!resource.property && !resource.action) resource.blueprint = resource.blueprint || !graph.match(nullptr, &type, &shape).empty();
  if (resource.property || resource.action || resource.subscriptions || resource.subscription || resource.blueprint) return;
  resource.thing = is_one_of(graph, resource.url, {vocab::hybrit::RoboticThing, Iri("https://hybr-it-projekt.de/ns/hybr-it#LinkedRoboticThing")});
  for (const Iri predicate : {vocab::hybrit::property, vocab::hybrit::action, vocab::hybrit::blueprint}) {
    if (resource.thing) break;
    resource.thing = graph.object(rdf::iri(resource.url), predicate).has_value();
  }
}

/// Reads the targets of rel=related, and of rel=next the same.
void read_links(Context& context, Resource& resource) {
  resource.links = client::links(resource.get.reply.fields, resource.url);
  std::vector<client::Link> found = resource.links;
  std::set<std::string> pages;
  for (int page = 0; page < max_link_pages; ++page) {
    std::string next;
    for (const client::Link& link : found) {
      if (link.relation == "related") resource.related.insert(without_fragment(link.target));
      if (link.relation == "next" && client::same_origin(link.target, resource.url)) next = link.target;
    }
    if (next.empty() || !pages.insert(next).second || context.probe.exhausted()) return;
    const Exchange exchange = context.probe.ask("GET", next);
    if (!exchange.reply.ok()) return;
    found = client::links(exchange.reply.fields, next);
  }
}

std::vector<Step> steps_of(const Context& context, const Resource& resource) {
  std::vector<Step> steps;
  std::map<std::string, std::size_t> counts;
  const std::size_t max = context.options.max_objects;
  if (resource.graph) {
    const rdf::Graph& graph = *resource.graph;
    // Stated sub-resources first, so that each kind is visited within the limit.
    for (const int round : {0, 1}) {
      for (const rdf::Triple& triple : graph.triples()) {
        const rdf::TermView subject = graph.term(triple.subject), predicate = graph.term(triple.predicate), object = graph.term(triple.object);
        if (!object.is_iri()) continue;
        const bool stated = begins_with(predicate.text, "https://hybr-it-projekt.de/ns/hybr-it#") || predicate == vocab::ldp::contains;
        if (stated != (round == 0) || (round == 1 && !(subject.is_iri() && subject.text == resource.url))) continue;
        Step step;
        step.url = without_fragment(std::string(object.text));
        if (!client::same_origin(step.url, context.url) || step.url == resource.url || ++counts[std::string(predicate.text)] > max) continue;
        if (steps.size() >= max_steps) return steps;
        step.property = predicate == vocab::hybrit::property;
        step.action = predicate == vocab::hybrit::action;
        step.subscriptions = predicate == vocab::hybrit::subscriptions;
        step.blueprint = predicate == vocab::hybrit::blueprint;
        if (step.property || step.action || step.subscriptions || step.blueprint || predicate == vocab::ldp::contains)
          step.advertised_by = "<" + std::string(predicate.text) + "> of <" + resource.url + ">";
        steps.push_back(std::move(step));
      }
    }
  }
  std::size_t count = 0;
  for (const std::string& target : resource.related) {
    if (!client::same_origin(target, context.url) || target == resource.url || ++count > max * 2) continue;
    Step step;
    step.url = target;
    step.advertised_by = "Link rel=related of <" + resource.url + ">";
    steps.push_back(std::move(step));
  }
  return steps;
}

}  // namespace

std::vector<std::string> Resource::offered_types() const {
  std::vector<std::string> types;
  for (const client::Link& link : links)
    if (link.relation == "alternate" && !link.type.empty() && std::find(types.begin(), types.end(), link.type) == types.end())
      types.push_back(link.type);
  return types;
}

std::vector<Resource*> Context::things() {
  std::vector<Resource*> found;
  for (Resource& r : resources)
    if (r.thing && r.exists()) found.push_back(&r);
  if (found.empty() && !resources.empty()) found.push_back(&resources.front());
  return found;
}

std::vector<Resource*> Context::linked_data() {
  std::vector<Resource*> found = things();
  for (Resource& r : resources)
    if (!r.thing && r.exists() && (r.property || r.action || r.subscriptions || r.subscription || r.blueprint)) found.push_back(&r);
  return found;
}

std::vector<Resource*> Context::sample() {
  constexpr std::size_t max_of_kind = 2;
  const bool all = 4 * probe.usual_time() <= options.slow_time;
  std::map<std::string, std::size_t> kinds;
  std::vector<Resource*> found;
  for (Resource& r : resources) {
    if (!r.exists()) continue;
    const char* const kind = r.property        ? "property"
                             : r.action        ? "action"
                             : r.subscriptions ? "subscriptions"
                             : r.blueprint     ? "blueprint"
                             : r.thing         ? "thing"
                                               : "";
    if (all || ++kinds[kind] <= max_of_kind || may_write(r.url)) found.push_back(&r);
  }
  return found;
}

bool Context::may_write(const std::string& of) const { return std::find(options.write.begin(), options.write.end(), of) != options.write.end(); }

Exchange get(Context& context, const std::string& url, const FieldList& fields) {
  std::string at = without_fragment(url);
  for (unsigned redirects = 0;; ++redirects) {
    Exchange exchange = context.probe.ask("GET", at, fields);
    if (exchange.reply.error || redirects >= context.options.client.limits.max_redirects) return exchange;
    Result<std::optional<exchange::Redirect>> next = exchange::redirect_of(exchange.reply.status, exchange.reply.fields, "GET", at);
    if (!next || !*next) return exchange;
    at = std::move((*next)->url);
  }
}

std::string outcome_of(const Exchange& exchange) {
  return exchange.reply.error ? "there is no response: " + exchange.reply.error->message : "the response is " + std::to_string(exchange.reply.status);
}

std::optional<rdf::Graph> graph_of(const Context& context, const Exchange& exchange, std::string* fault) {
  const auto syntax = rdf::syntax_of(exchange.reply.media_type());
  if (!exchange.reply.ok() || !syntax || exchange.reply.truncated) return std::nullopt;
  rdf::ReadOptions options;
  options.base = exchange.url;
  options.max_triples = std::min(context.options.client.limits.max_triples, max_triples);
  options.contexts = &context.options.client.contexts;
  Result<rdf::Graph> graph = rdf::read(exchange.reply.body, *syntax, options);
  if (graph) return *std::move(graph);
  // JSON-LD with a context elsewhere, named graphs: right, but not for this reader.
  if (fault != nullptr && graph.error().code == Errc::expected_rdf)
    *fault = graph.error().message + (graph.error().line > 0 ? " (line " + std::to_string(graph.error().line) + ")" : "");
  return std::nullopt;
}

Result<void> survey(Context& context) {
  std::deque<Step> steps;
  std::set<std::string> known;
  const std::string start = without_fragment(context.url);
  steps.push_back({start, {}});
  known.insert(start);
  std::map<std::string, std::size_t> at;  // of the resources
  while (!steps.empty() && !context.probe.exhausted()) {
    const Step step = steps.front();
    steps.pop_front();
    constexpr std::size_t max_if_slow = 8;
    if (context.resources.size() >= max_if_slow && context.resources.size() < context.options.max_resources &&
        context.probe.usual_time() > context.options.slow_time) {
      context.notes.push_back("the server is slow, and " + std::to_string(context.resources.size()) + " resources were visited");
      break;
    }
    if (context.resources.size() >= context.options.max_resources) {
      context.notes.push_back("max_resources (" + std::to_string(context.options.max_resources) +
                              ") was reached, and further resources were not visited");
      break;
    }
    Resource resource;
    resource.advertised_by = step.advertised_by;
    resource.property = step.property, resource.action = step.action, resource.subscriptions = step.subscriptions,
    resource.blueprint = step.blueprint;
    resource.get = get(context, step.url);
    resource.url = resource.get.url;
    if (context.resources.empty()) {
      if (resource.get.reply.error) return unexpected(*resource.get.reply.error);
      context.url = resource.url;
      known.insert(resource.url);
      if (!resource.exists()) {
        const int status = resource.get.reply.status;
        return unexpected(Errc::failed, resource.url + " responds " + std::to_string(status) + " " + std::string(http::reason_phrase(status)) +
                                            (status == 401 ? "; give a token" : "; give a URL that answers GET"));
      }
    }
    resource.etag = resource.get.reply.field("ETag");
    resource.graph = graph_of(context, resource.get, &resource.rdf_fault);
    if (!resource.graph && resource.rdf_fault.empty() && resource.exists() && !rdf::syntax_of(resource.get.reply.media_type())) {
      const Exchange again =
          context.probe.ask("GET", resource.url, {{"Accept", "text/turtle, application/n-triples;q=0.9, application/ld+json;q=0.5"}});
      resource.graph = graph_of(context, again);
    }
    read_links(context, resource);
    classify(resource);
    at.emplace(resource.url, context.resources.size());
    const std::vector<Step> next = resource.exists() ? steps_of(context, resource) : std::vector<Step>();
    context.resources.push_back(std::move(resource));
    for (const Step& s : next) {
      if (const auto before = at.find(s.url); before != at.end()) {  // named again, perhaps as something
        Resource& r = context.resources[before->second];
        r.property = r.property || s.property, r.action = r.action || s.action;
        r.subscriptions = r.subscriptions || s.subscriptions, r.blueprint = r.blueprint || s.blueprint;
        if (r.property || r.action || r.subscriptions || r.blueprint) r.thing = false;
        if (r.advertised_by.empty()) r.advertised_by = s.advertised_by;
      } else if (known.count(s.url) == 0) {
        if (steps.size() >= 20 * context.options.max_resources) continue;
        known.insert(s.url);
        steps.push_back(s);
      } else {
        for (Step& waiting : steps) {
          if (waiting.url != s.url) continue;
          waiting.property = waiting.property || s.property, waiting.action = waiting.action || s.action;
          waiting.subscriptions = waiting.subscriptions || s.subscriptions, waiting.blueprint = waiting.blueprint || s.blueprint;
          if (waiting.advertised_by.empty()) waiting.advertised_by = s.advertised_by;
        }
      }
    }
  }
  return {};
}

}  // namespace lrt::check
