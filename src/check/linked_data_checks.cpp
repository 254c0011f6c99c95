// SPDX-License-Identifier: Apache-2.0
// R1.2 to R1.12: representations in RDF.

#include <algorithm>

#include <lrt/base/media_type.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/base/ascii.hpp"
#include "src/check/alternatives.hpp"
#include "src/check/survey.hpp"

namespace lrt::check {
namespace {

constexpr std::string_view turtle = "text/turtle";

/// Vocabularies that others have defined and maintain.
constexpr std::string_view standard[] = {"http://www.w3.org/",      "https://www.w3.org/", "http://purl.org/dc/",  "http://xmlns.com/foaf/",
                                         "http://schema.org/",      "https://schema.org/", "http://qudt.org/",     "http://purl.org/",
                                         "https://saref.etsi.org/", "https://purl.org/",   "http://purl.oclc.org/"};

bool is_standard(std::string_view iri) {
  return std::any_of(std::begin(standard), std::end(standard), [iri](std::string_view s) { return iri.substr(0, s.size()) == s; });
}

std::string media_type_of(const std::string& text) {
  const Result<MediaType> type = MediaType::parse(text);
  return type ? type->essence() : text;
}

void check_turtle(Context& context) {
  Verdicts& v = context.verdicts;
  for (Resource* r : context.linked_data()) {
    if (context.probe.exhausted()) return;
    const std::string type = r->get.reply.media_type();
    if (type == turtle) v.pass("rdf.turtle", &r->get);
    else v.fail("rdf.turtle", r->url + ": the representation without Accept is " + (type.empty() ? "without Content-Type" : type), &r->get);
    Exchange asked = context.probe.ask("GET", r->url, {{"Accept", std::string(turtle)}});
    if (asked.reply.ok() && asked.reply.media_type() == turtle) v.pass("rdf.accept-turtle", &asked);
    else if (asked.reply.status == 429 || asked.reply.status == 503 || asked.reply.error)
      v.not_testable("rdf.accept-turtle", "there was no response", &asked);
    else
      v.fail("rdf.accept-turtle",
             r->url + ": " +
                 (asked.reply.ok() ? "the representation is " + asked.reply.media_type() : "the response is " + std::to_string(asked.reply.status)),
             &asked);
    std::string fault = r->rdf_fault;
    if (!fault.empty()) v.fail("rdf.valid", r->url + ": " + fault, &r->get);
    else if (graph_of(context, asked, &fault)) v.pass("rdf.valid", &asked);
    else if (!fault.empty()) v.fail("rdf.valid", r->url + ": " + fault, &asked);
    else if (r->graph) v.pass("rdf.valid", &r->get);
  }
  v.otherwise("rdf.valid", Outcome::not_testable, "there is no representation in a syntax of RDF that this check reads");
}

/// The media types that a text names, as a 406 does.
std::vector<std::string> named_types(const std::string& text) {
  constexpr std::size_t max = 12;
  std::vector<std::string> types;
  const auto is_part = [](char c) { return lrt::detail::is_alpha(c) || (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.'; };
  for (std::size_t at = text.find('/'); at != std::string::npos && types.size() < max; at = text.find('/', at + 1)) {
    std::size_t from = at, to = at + 1;
    while (from > 0 && is_part(text[from - 1])) --from;
    while (to < text.size() && is_part(text[to])) ++to;
    while (to > at + 1 && text[to - 1] == '.') --to;
    const std::string type = lrt::detail::lower(text.substr(from, to - from)), top = type.substr(0, type.find('/'));
    const bool known = top == "text" || top == "application" || top == "image" || top == "audio" || top == "video" || top == "multipart";
    const bool is_other = type.find("problem+") != std::string::npos || type.find("x-lrt-check") != std::string::npos;
    if (known && type.size() > top.size() + 1 && !is_other && std::find(types.begin(), types.end(), type) == types.end()) types.push_back(type);
  }
  return types;
}

/// What a 406 lists as available is sent.
void check_listed(Context& context, const Resource& r, const Exchange& none) {
  Verdicts& v = context.verdicts;
  std::vector<std::string> types = named_types(none.reply.body);
  for (const client::Link& link : client::links(none.reply.fields, r.url))
    if (link.relation == "alternate" && !link.type.empty()) types.push_back(media_type_of(link.type));
  for (const std::string& type : types) {
    if (context.probe.exhausted()) return;
    if (type == turtle && v.failed("rdf.accept-turtle")) continue;
    const Exchange exchange = context.probe.ask("GET", r.url, {{"Accept", type}});
    if (exchange.reply.ok() && exchange.reply.media_type() == type) v.pass("negotiate.listed", &exchange);
    else if (exchange.reply.ok() || exchange.reply.status == 406)
      v.fail("negotiate.listed",
             "the 406 of GET " + r.url + " lists " + type + ", and `Accept: " + type + "` gets " +
                 (exchange.reply.ok() ? exchange.reply.media_type() : std::to_string(exchange.reply.status)),
             &exchange, Certainty::likely);
    else v.not_testable("negotiate.listed", outcome_of(exchange), &exchange);
  }
  v.otherwise("negotiate.listed", Outcome::not_applicable, "the 406 lists no media types");
}

void check_negotiation(Context& context) {
  Verdicts& v = context.verdicts;
  const Resource& r = *context.things().front();
  if (context.probe.exhausted()) return;
  std::vector<std::string> types;
  const std::string usual = r.get.reply.media_type();
  const std::vector<std::string> offered = r.offered_types();
  for (const std::string& type : offered)
    if (media_type_of(type) != usual && types.size() < 4) types.push_back(type);
  const bool announced = !types.empty();
  if (!announced) types = {"application/n-triples", "application/ld+json", "application/rdf+xml", "text/turtle"};
  types.erase(std::remove(types.begin(), types.end(), usual), types.end());
  std::vector<Exchange> others;  // in another type than usual
  for (const std::string& type : types) {
    Exchange exchange = context.probe.ask("GET", r.url, {{"Accept", type}});
    if (exchange.reply.ok() && exchange.reply.media_type() == media_type_of(type)) {
      v.pass("negotiate.accept", &exchange);
      others.push_back(std::move(exchange));
    } else if (announced && (exchange.reply.ok() || exchange.reply.status == 406)) {
      v.fail("negotiate.accept",
             r.url + " links to an alternate of type " + type + ", and `Accept: " + type + "` gets " +
                 (exchange.reply.ok() ? exchange.reply.media_type() : std::to_string(exchange.reply.status)),
             &exchange);
    }
  }
  if (others.empty()) {
    for (const char* id : {"negotiate.accept", "negotiate.quality", "negotiate.vary"})
      v.not_applicable(id, "one media type is offered, as R1.2 permits");
    v.not_applicable("etag.media-types", "one media type is offered");
  } else {
    const Exchange& other = others.front();
    const std::string type = other.reply.media_type();
    const Exchange preferred = context.probe.ask("GET", r.url, {{"Accept", usual + ";q=0.2, " + type + ";q=0.9"}});
    if (preferred.reply.ok() && preferred.reply.media_type() == type) v.pass("negotiate.quality", &preferred);
    else if (preferred.reply.ok())
      v.fail("negotiate.quality", type + " has the greater weight, and the response is " + preferred.reply.media_type(), &preferred);
    for (const Exchange* exchange : {&r.get, &other}) {
      const std::string vary = lrt::detail::lower(exchange->reply.fields.joined("Vary"));
      if (vary.find("accept") != std::string::npos || vary == "*") v.pass("negotiate.vary", exchange);
      else v.fail("negotiate.vary", "the media type depends on Accept, and Vary does not name it", exchange);
    }
    std::vector<const Exchange*> all{&r.get};
    for (const Exchange& exchange : others) all.push_back(&exchange);
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (std::size_t j = i + 1; j < all.size(); ++j) {
        const std::string tag = all[i]->reply.field("ETag");
        if (tag.empty() || tag.compare(0, 2, "W/") == 0) continue;
        if (tag == all[j]->reply.field("ETag") && all[i]->reply.body != all[j]->reply.body)
          v.fail("etag.media-types", all[i]->reply.media_type() + " and " + all[j]->reply.media_type() + " of " + r.url + " have the tag " + tag,
                 all[j]);
        else v.pass("etag.media-types", all[j]);
      }
    }
  }
  if (v.failed("negotiate.accept")) return v.not_applicable("negotiate.not-acceptable", "Accept is ignored");
  const Exchange none = context.probe.ask("GET", r.url, {{"Accept", "application/x-lrt-check"}});
  context.bad_requests.push_back(none);
  if (none.reply.status == 406) v.pass("negotiate.not-acceptable", &none), check_listed(context, r, none);
  else if (none.reply.ok())
    v.fail("negotiate.not-acceptable", "the response is " + std::to_string(none.reply.status) + " with " + none.reply.media_type(), &none);
  else v.not_testable("negotiate.not-acceptable", "the response is " + std::to_string(none.reply.status), &none);
}

/// A Thing's sub-resources of a kind that links lead to, and whether a triple names them.
void check_triples(Context& context, std::string_view id, Iri predicate, Iri type, bool Resource::*is) {
  Verdicts& v = context.verdicts;
  std::set<std::string> named;
  for (const Resource* r : context.things()) {
    if (!r->graph) continue;
    const rdf::TermView p = predicate;
    for (const rdf::Triple& t : r->graph->match(nullptr, &p, nullptr)) named.insert(without_fragment(std::string(r->graph->term(t.object).text)));
  }
  for (const Resource* thing : context.things()) {
    if (!thing->graph) continue;
    const bool has = thing->graph->object(rdf::iri(thing->url), predicate).has_value();
    if (has) v.pass(id, &thing->get);
    // The targets of Link fields or triples of the Thing whose type is that kind, as they or the Thing state.
    std::set<std::string> reached = thing->related;
    const rdf::TermView subject = rdf::iri(thing->url);
    for (const rdf::Triple& t : thing->graph->match(&subject, nullptr, nullptr))
      if (const rdf::TermView object = thing->graph->term(t.object); object.is_iri()) reached.insert(without_fragment(std::string(object.text)));
    for (const std::string& url : reached) {
      if (named.count(url) != 0 || url == thing->url) continue;
      const auto resource = std::find_if(context.resources.begin(), context.resources.end(), [&url](const Resource& r) { return r.url == url; });
      const bool of_kind = (resource != context.resources.end() && (*resource).*is) || thing->graph->contains(rdf::iri(url), vocab::rdf_::type, type);
      if (of_kind)
        v.fail(id, "<" + thing->url + "> leads to <" + url + ">, which is one, and no triple <" + std::string(predicate.text) + "> names it",
               &thing->get, Certainty::likely);
    }
  }
  v.otherwise(id, Outcome::not_applicable, "there is none");
}

void check_subscriptions_container(Context& context) {
  Verdicts& v = context.verdicts;
  bool container = false;
  for (const Resource* r : context.things()) {
    if (!r->graph) continue;
    if (r->graph->object(rdf::iri(r->url), vocab::hybrit::subscriptions)) v.pass("subscriptions.triple", &r->get);
    else
      v.fail("subscriptions.triple", "<" + r->url + "> has no triple hybrit:subscriptions", &r->get,
             r->thing ? Certainty::certain : Certainty::likely);
  }
  v.otherwise("subscriptions.triple", Outcome::not_testable, "there is no RDF of a Thing");
  for (const Resource& r : context.resources) {
    if (!r.subscriptions || !r.exists()) continue;
    container = true;
    bool is = std::any_of(r.links.begin(), r.links.end(), [](const client::Link& link) {
      return link.relation == "type" && link.target.compare(0, 24, "http://www.w3.org/ns/ldp") == 0 &&
             link.target.find("Container") != std::string::npos;
    });
    if (r.graph)
      for (const Iri type : {vocab::ldp::Container, vocab::ldp::BasicContainer, Iri("http://www.w3.org/ns/ldp#DirectContainer"),
                             Iri("http://www.w3.org/ns/ldp#IndirectContainer")})
        is = is || r.graph->contains(rdf::iri(r.url), vocab::rdf_::type, type);
    if (is) v.pass("subscriptions.container", &r.get);
    else v.fail("subscriptions.container", "<" + r.url + "> is no ldp:Container, by rdf:type or by Link rel=type", &r.get);
  }
  if (!container) v.not_applicable("subscriptions.container", "no Subscriptions resource was found");
}

/// Validates a Thing by its Blueprints. Results about other Things are ignored, because the graph may describe those incompletely.
void check_conformance(Context& context, const Resource& thing) {
  Verdicts& v = context.verdicts;
  rdf::Graph shapes;
  for (const rdf::TermView& blueprint : thing.graph->objects(rdf::iri(thing.url), vocab::hybrit::blueprint)) {
    const std::string url = without_fragment(std::string(blueprint.text));
    for (const Resource& r : context.resources)
      if (r.url == url && r.graph) client::add_apart(shapes, *r.graph, [](const rdf::TermView&) { return false; });
  }
  if (shapes.empty() || context.probe.exhausted()) return;
  shacl::CompileOptions lenient;
  lenient.ignore_unsupported = true;
  const Result<shacl::Shapes> compiled = shacl::Shapes::compile(std::move(shapes), lenient);
  if (!compiled) return v.not_testable("blueprint.conforms", "the Blueprint has no valid shapes");
  // The state of the Thing if the server has one; otherwise the graph of the Thing itself.
  const Exchange* source = &thing.get;
  Exchange state;
  std::optional<rdf::Graph> graph;
  if (const auto iri = thing.graph->object(rdf::iri(thing.url), vocab::lrt_::state);
      iri && iri->is_iri() && client::same_origin(std::string(iri->text), thing.url)) {
    state = get(context, std::string(iri->text));
    graph = graph_of(context, state);
    if (!graph) return;  // a value cannot be read now
    source = &state;
  }
  const rdf::Graph& data = graph ? *graph : *thing.graph;
  shacl::ValidateOptions options;
  options.max_steps = 5'000'000;
  const Result<shacl::Report> report = shacl::validate(*compiled, data, options);
  if (!report) return v.not_testable("blueprint.conforms", report.error().message);
  for (const shacl::ValidationResult& result : report->results()) {
    const rdf::TermView focus = result.focus;
    if (focus != rdf::TermView(rdf::iri(thing.url)) && !data.contains(rdf::iri(thing.url), vocab::hybrit::property, focus)) continue;
    const std::string message = result.messages.empty() ? std::string(result.component.text) : std::string(result.messages.front().view().text);
    return v.fail("blueprint.conforms", rdf::to_string(focus) + (result.path.empty() ? "" : " " + result.path.to_string()) + ": " + message, source,
                  graph ? Certainty::certain : Certainty::likely);
  }
  v.pass("blueprint.conforms", source);
}

/// Shapes of values that are one of several alternatives.
void check_alternatives(Context& context) {
  Verdicts& v = context.verdicts;
  Announced announced;
  for (const Resource* thing : context.things()) {
    const std::vector<std::string> types = thing->offered_types();
    if (context.probe.exhausted() || std::find(types.begin(), types.end(), "application/json") == types.end()) continue;
    const Exchange json = context.probe.ask("GET", thing->url, {{"Accept", "application/json"}});
    if (json.reply.ok() && json.reply.media_type() == "application/json") add_announced(json.reply.body, announced);
  }
  for (const Resource& r : context.resources) {
    if (!r.blueprint || !r.graph) continue;
    std::size_t judged = 0;
    const std::vector<std::string> faults = shapes_that_accept_several(*r.graph, announced, judged);
    for (const std::string& fault : faults) v.fail("blueprint.alternatives", "<" + r.url + ">: " + fault, &r.get);
    if (judged > faults.size()) v.pass("blueprint.alternatives", &r.get);
  }
  v.otherwise("blueprint.alternatives", Outcome::not_applicable, "no Blueprint has a value that is one of several alternatives");
}

void check_blueprints(Context& context) {
  Verdicts& v = context.verdicts;
  check_triples(context, "blueprint.triple", vocab::hybrit::blueprint, vocab::sh::NodeShape, &Resource::blueprint);
  for (const Resource& r : context.resources) {
    if (!r.blueprint || !r.exists()) continue;
    shacl::CompileOptions lenient;
    lenient.ignore_unsupported = true;
    const Result<shacl::Shapes> compiled =
        r.graph ? shacl::Shapes::compile(*r.graph, lenient) : unexpected(Errc::expected_rdf, "it is no RDF, but " + r.get.reply.media_type());
    if (!compiled) v.fail("blueprint.shapes", "<" + r.url + ">: " + compiled.error().message, &r.get);
    else if (compiled->size() == 0) v.fail("blueprint.shapes", "<" + r.url + "> has no shape", &r.get);
    else v.pass("blueprint.shapes", &r.get);
  }
  v.otherwise("blueprint.shapes", Outcome::not_applicable, "no Blueprint of this server was found");
  for (const Resource* thing : context.things())
    if (thing->graph) check_conformance(context, *thing);
  v.otherwise("blueprint.conforms", Outcome::not_applicable, "no Blueprint of this server was found");
}

/// Terms of RDFS, Dublin Core, LDP and QUDT that servers are tempted to define again.
constexpr std::string_view often_repeated[] = {"label",       "comment",    "seeAlso",  "isDefinedBy", "title",
                                               "description", "created",    "modified", "creator",     "hasPart",
                                               "isPartOf",    "conformsTo", "contains", "hasUnit",     "numericalValue"};

std::string vocabulary_of(std::string_view term) { return std::string(term.substr(0, term.find_last_of("#/") + 1)); }

/// What is possible cannot be seen from outside. Seen are vocabularies that are used, and own terms for what they have.
void check_vocabularies(Context& context) {
  Verdicts& v = context.verdicts;
  constexpr std::size_t fewest_terms = 3, fewest_vocabularies = 2;
  bool any = false, described = false;
  std::set<std::string> terms, own, vocabularies, repeated;
  for (const Resource* r : context.linked_data()) {
    if (!r->graph) continue;
    bool reused = false;
    for (const rdf::Triple& t : r->graph->triples()) {
      const rdf::TermView predicate = r->graph->term(t.predicate), object = r->graph->term(t.object);
      const bool type = predicate == vocab::rdf_::type;
      const std::string term(type ? object.text : predicate.text);
      described = described || (r->thing && !type && object.is_literal() && is_standard(predicate.text));
      if (type && !object.is_iri()) continue;
      if (is_standard(term)) {
        reused = true;
        terms.insert(term);
        if (vocabulary_of(term) != "http://www.w3.org/1999/02/22-rdf-syntax-ns#") vocabularies.insert(vocabulary_of(term));
      } else if (client::same_origin(term, context.url)) {
        own.insert(term);
        const std::string_view name = std::string_view(term).substr(vocabulary_of(term).size());
        if (std::find(std::begin(often_repeated), std::end(often_repeated), name) != std::end(often_repeated)) repeated.insert(term);
      }
    }
    if (!r->thing || r->graph->empty()) continue;
    any = true;
    if (reused) v.pass("rdf.vocabularies", &r->get);
    else v.fail("rdf.vocabularies", "<" + r->url + "> uses no term of a standard vocabulary besides rdf:type", &r->get, Certainty::likely);
  }
  const Exchange* example = &context.things().front()->get;
  std::string names;
  for (const std::string& one : vocabularies) names += (names.empty() ? "" : ", ") + ("<" + one + ">");
  const std::string found = std::to_string(terms.size()) + " terms of standard vocabularies" + (names.empty() ? "" : " (" + names + ")") + ", " +
                            std::to_string(own.size()) + " own ones";
  if (!any) v.not_testable("rdf.vocabularies", "there is no RDF of a Thing");
  else if (!repeated.empty())
    v.fail("rdf.vocabularies", "<" + *repeated.begin() + "> is an own term with the name of one of a standard vocabulary; " + found, example,
           Certainty::likely);
  else if (terms.size() < fewest_terms || vocabularies.size() < fewest_vocabularies)
    v.fail("rdf.vocabularies", "one or two terms do not show that existing vocabularies are used where possible: " + found, example,
           Certainty::likely);
  if (described) v.pass("metadata", example);
  else v.not_applicable("metadata", "no label, description or other literal of a standard vocabulary was found; R1.12 permits that");
}

}  // namespace

void check_linked_data(Context& context) {
  check_turtle(context);
  check_negotiation(context);
  context.verdicts.otherwise("negotiate.listed", Outcome::not_applicable, "there was no 406");
  for (const Resource* r : context.things()) {
    if (!r->graph) continue;
    if (r->graph->object(rdf::iri(r->url), vocab::rdf_::type)) context.verdicts.pass("rdf.type", &r->get);
    else context.verdicts.fail("rdf.type", "<" + r->url + "> has no rdf:type in its representation", &r->get);
  }
  context.verdicts.otherwise("rdf.type", Outcome::not_testable, "there is no RDF of a Thing");
  check_vocabularies(context);
  check_subscriptions_container(context);
  check_triples(context, "property.triples", vocab::hybrit::property, vocab::hybrit::Property, &Resource::property);
  check_triples(context, "action.triples", vocab::hybrit::action, vocab::hybrit::Action, &Resource::action);
  check_blueprints(context);
  check_alternatives(context);
}

}  // namespace lrt::check
