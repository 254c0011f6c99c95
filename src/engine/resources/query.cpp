// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/query.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/engine/description.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/dataset.hpp"
#include "src/engine/resources/documents.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/vocabulary.hpp"
#include "src/http/etag.hpp"

namespace lrt::engine {

namespace {

/// The IRIs by which service descriptions name the formats of answers (https://www.w3.org/ns/formats/).
constexpr std::string_view formats_of_results[] = {
    "http://www.w3.org/ns/formats/SPARQL_Results_JSON",
    "http://www.w3.org/ns/formats/SPARQL_Results_XML",
    "http://www.w3.org/ns/formats/SPARQL_Results_CSV",
    "http://www.w3.org/ns/formats/SPARQL_Results_TSV",
};

/// Further terms of service descriptions.
namespace of_sd {
constexpr Iri namedGraph("http://www.w3.org/ns/sparql-service-description#namedGraph"), name("http://www.w3.org/ns/sparql-service-description#name"),
    NamedGraph("http://www.w3.org/ns/sparql-service-description#NamedGraph"),
    GraphCollection("http://www.w3.org/ns/sparql-service-description#GraphCollection");
}  // namespace of_sd

/// The media types that the answers to a query can have.
Variants variants_of(const PreparedQuery& query) {
  Variants all;
  for (std::size_t i = 0; i < query.types().size(); ++i) {
    all.types.push_back(query.types()[i]);
    all.variants.push_back(Variant::answer(i));
  }
  all.with_page = all.types;
  return all;
}

}  // namespace

// ------------------------------------------------------------------------------------------------------------- endpoint

QueryResource::QueryResource(const QueryService& service)
    : Resource(service.limits().path, nullptr), service_(service), subscriptions_(path + "/subscriptions", nullptr) {}

Methods QueryResource::methods() const noexcept {
  Methods methods;
  methods.post = true;
  return methods;
}

/// Form encoding makes a query up to three times as long.
Input QueryResource::input(const EngineOptions&) const { return {nullptr, false, 4 * service_.limits().max_text_bytes}; }

std::string_view QueryResource::posted_types() const noexcept {
  static const Immortal<std::string> both(std::string(query_type) + ", " + std::string(query_form_type));
  return *both;
}

std::optional<Outcome> QueryResource::get(Context& context, Parts& parts) { return parts.queries->get(context); }
Outcome QueryResource::post(Context& context, Parts& parts) { return parts.queries->post(context); }
Outcome QueryResource::subscribe(Context& context, Parts& parts, Protocol protocol) { return parts.queries->subscribe(context, protocol); }

void QueryResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.add(vocab::dcterms::title, rdf::literal("SPARQL endpoint"));
  about.link(vocab::sd::endpoint, d.base + path).link(vocab::sd::supportedLanguage, std::string(vocab::sd::SPARQL11Query.text));
  about.link(vocab::sd::feature, std::string(vocab::sd::UnionDefaultGraph.text));
  for (const std::string_view format : formats_of_results) about.link(vocab::sd::resultFormat, std::string(format));
  for (const auto& [syntax, format] : formats_of_graphs)  // a build may be without some syntaxes
    if (rdf::syntax_of(rdf::media_type(syntax))) about.link(vocab::sd::resultFormat, std::string(format));
  const rdf::TermId graph = d.graph.fresh_blank();
  const std::string dataset = d.base + DatasetResource::location + std::string(DatasetResource::fragment);
  about.link(vocab::sd::defaultDataset, dataset);
  About(d.graph, dataset).a(vocab::sd::Dataset).a(of_sd::GraphCollection).add(vocab::sd::defaultGraph, graph);
  About(d.graph, graph).a(vocab::sd::Graph);
  describe_named_graphs(dataset, d);
}

/// Those that stay as long as the structure does. What comes and goes, and what is beyond the limit, is found by a query.
void QueryResource::describe_named_graphs(const std::string& dataset, const Description& d) const {
  std::size_t left = max_named_graphs;
  const auto add = [&](const Resource& resource) {
    if (left == 0 || !d.audience.sees(resource)) return;
    --left;
    const rdf::TermId named = d.graph.fresh_blank();
    About(d.graph, dataset).add(of_sd::namedGraph, named);
    About(d.graph, named).a(of_sd::NamedGraph).link(of_sd::name, d.base + resource.path);
  };
  for (const char* own : {"/", TermsResource::location, VocabularyResource::location, DatasetResource::location})
    if (const Resource* resource = d.engine.registry.find(own)) add(*resource);
  add(*this);
  add(subscriptions_);
  for (const auto& [at, node] : d.engine.registry.things()) {
    if (left == 0) break;
    Snapshots::for_each_lasting(*node, add);
    add(node->subscriptions);
  }
}

void QueryResource::describe_types(About& about, const Description&) const { about.a(vocab::sd::Service); }

// ------------------------------------------------------------------------------------------------------------- standing

StandingQuery::StandingQuery(std::string its_path, const QueryResource& endpoint, Queries& owner, std::shared_ptr<const PreparedQuery> its_query,
                             std::shared_ptr<Snapshot> of, Snapshots::Needs its_needs)
    : Resource(std::move(its_path), nullptr),
      query(std::move(its_query)),
      snapshot(std::move(of)),
      needs(its_needs),
      endpoint_(endpoint),
      owner_(owner),
      variants_(variants_of(*query)) {
  predicates = Snapshots::hashes_of(query->dependencies().predicates);
}

StandingQuery::~StandingQuery() = default;

bool StandingQuery::is_shown_to(const Audience& audience) const { return Snapshots::suits(*snapshot, snapshot->base, audience, needs); }

Result<Bytes> StandingQuery::answer(std::size_t type) const {
  if (!latest.answer) return unexpected(Errc::failed, "the query has no result yet");
  if (const auto found = latest.documents.find(type); found != latest.documents.end()) return found->second.text;
  return write(*query, *latest.answer, tells_changes ? previous.get() : nullptr, sequence, type).text;  // a type that no observer has
}

std::string StandingQuery::entity_tag(std::string_view media_type, const std::string&, const Audience&, bool) const {
  const auto found = std::find_if(latest.documents.begin(), latest.documents.end(),
                                  [&](const auto& document) { return query->types()[document.first] == media_type; });
  return found == latest.documents.end() ? std::string() : found->second.tag;
}

StandingQuery::Document StandingQuery::write(const PreparedQuery& query, const QueryAnswer& answer, const QueryAnswer* before, std::uint64_t sequence,
                                             std::size_t type) {
  Document document;
  document.text = guarded<Bytes>([&]() -> Result<Bytes> {
    Result<std::string> text = before ? answer.changes_since(*before, sequence) : answer.write(type);
    if (!text) return Unexpected{std::move(text).error()};
    document.tag = http::entity_tag(query.types()[type], *text);
    return std::make_shared<const std::string>(*std::move(text));
  });
  return document;
}

std::vector<std::size_t> StandingQuery::wanted_types() const {
  std::vector<std::size_t> types;
  const auto add = [&](std::size_t type) {
    if (std::find(types.begin(), types.end(), type) == types.end()) types.push_back(type);
  };
  for (const Observer* observer : observers)
    if (const Variant variant = observer->variant(); variant.kind() == Variant::Kind::answer) add(variant.type());
  for (const Waiter& waiter : waiters) add(waiter.type);
  return types;
}

void StandingQuery::set_observed(bool observed, ChangeScanner&) {
  if (!observed) owner_.unobserved(*this);
}

void StandingQuery::Watch::resource_changed(SeenBy seen) {
  if (seen(owner_.snapshot->audience)) owner_.changed(*this);
}
void StandingQuery::Watch::resource_removed() { owner_.unwatch(*this); }
void StandingQuery::changed(const Watch& watch) {
  if (owner_.is_change_for(*this, watch.resource)) mark_dirty();
}
void StandingQuery::unwatch(Watch& watch) { owner_.unwatch(*this, watch); }

}  // namespace lrt::engine
