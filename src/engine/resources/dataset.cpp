// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/dataset.hpp"

#include "src/engine/description.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {

namespace {

/// Terms of VoID (https://www.w3.org/TR/void/).
namespace of_void {
constexpr Iri Dataset("http://rdfs.org/ns/void#Dataset"), DatasetDescription("http://rdfs.org/ns/void#DatasetDescription"),
    sparqlEndpoint("http://rdfs.org/ns/void#sparqlEndpoint"), rootResource("http://rdfs.org/ns/void#rootResource"),
    exampleResource("http://rdfs.org/ns/void#exampleResource"), vocabulary("http://rdfs.org/ns/void#vocabulary"),
    uriSpace("http://rdfs.org/ns/void#uriSpace"), feature("http://rdfs.org/ns/void#feature");
}  // namespace of_void

/// As VoID 6.1 leads from a description to its dataset.
constexpr Iri primary_topic("http://xmlns.com/foaf/0.1/primaryTopic");

/// The vocabularies of which all robots use terms.
constexpr std::string_view vocabularies[] = {
    "https://hybr-it-projekt.de/ns/hybr-it#",
    "https://w3id.org/lrt/ns#",
    "http://vocab.arvida.de/2015/06/vom/vocab#",
    "http://www.w3.org/ns/ldp#",
    "http://www.w3.org/ns/shacl#",
    "http://purl.org/dc/terms/",
};

/// A Thing that the audience sees, and one of its properties.
struct Example {
  const Resource* thing = nullptr;
  const Resource* property = nullptr;
};

Example example_for(const Audience& audience, const Registry& registry) {
  Example example;
  for (const auto& [path, thing] : registry.things()) {
    if (!audience.sees(thing->self)) continue;
    if (!example.thing) example.thing = &thing->self;
    for (const PropertyResource* p : thing->in_state())
      if (audience.sees(*p)) return {&thing->self, p};
  }
  return example;
}

}  // namespace

void DatasetResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.add(vocab::dcterms::title, rdf::tagged_literal("What the data of this server are", "en"));
  const std::string iri = d.base + path + std::string(fragment);
  about.link(primary_topic, iri);
  About dataset(d.graph, iri);
  dataset.a(of_void::Dataset).add(vocab::dcterms::title, rdf::tagged_literal("Robotic Things", "en"));
  dataset.add(of_void::uriSpace, rdf::literal(d.base + "/"));
  dataset.link(of_void::rootResource, d.base + "/");
  if (!query_.empty()) dataset.link(of_void::sparqlEndpoint, d.base + query_);
  const Example example = example_for(d.audience, d.engine.registry);
  for (const Resource* one : {example.thing, example.property})
    if (one) dataset.link(of_void::exampleResource, d.base + one->path);
  for (const std::string_view vocabulary : vocabularies) dataset.link(of_void::vocabulary, std::string(vocabulary));
  dataset.link(of_void::vocabulary, d.engine.vocabulary(d.base));
  for (const auto& [syntax, format] : formats_of_graphs)  // a build may be without some syntaxes
    if (rdf::syntax_of(rdf::media_type(syntax))) dataset.link(of_void::feature, std::string(format));
}

void DatasetResource::describe_types(About& about, const Description&) const { about.a(of_void::DatasetDescription); }

}  // namespace lrt::engine
