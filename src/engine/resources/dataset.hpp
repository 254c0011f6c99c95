// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <lrt/rdf/codec.hpp>

#include "src/engine/resource.hpp"

namespace lrt::engine {

/// The IRIs of formats of graphs (https://www.w3.org/ns/formats/).
inline constexpr std::pair<rdf::Syntax, std::string_view> formats_of_graphs[] = {
    {rdf::Syntax::turtle, "http://www.w3.org/ns/formats/Turtle"},
    {rdf::Syntax::n_triples, "http://www.w3.org/ns/formats/N-Triples"},
    {rdf::Syntax::rdf_xml, "http://www.w3.org/ns/formats/RDF_XML"},
    {rdf::Syntax::json_ld, "http://www.w3.org/ns/formats/JSON-LD"},
};

/// "/.well-known/void": what the data of this server are (VoID; RFC 8615).
class DatasetResource final : public Resource {
 public:
  static constexpr const char* location = "/.well-known/void";
  /// With the location: the IRI of all data of the server.
  static constexpr std::string_view fragment = "#dataset";
  /// @param query  path of the endpoint of queries; empty: there is none
  explicit DatasetResource(std::string query) : Resource(location, nullptr), query_(std::move(query)) {}
  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const Variants& variants() const override { return graph_variants(); }
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"dataset"};
    return kind;
  }
  std::string up() const override { return "/"; }

 private:
  const std::string query_;
};

}  // namespace lrt::engine
