// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/codecs.hpp"

// Builds without Redland (LRT_REDLAND=OFF) have no RDF/XML.

namespace lrt::rdf {
inline namespace v0 {
namespace {

Unexpected absent() { return unexpected(Errc::unsupported_syntax, "this build of lrt has no RDF/XML (LRT_REDLAND is OFF)"); }

}  // namespace

bool has_rdf_xml() noexcept { return false; }
void prepare_rdf_xml() noexcept {}
Result<Graph> read_rdf_xml(std::string_view, const ReadOptions&) { return absent(); }
Result<std::string> write_rdf_xml(const Graph&, const Prefixes&) { return absent(); }

}  // namespace v0
}  // namespace lrt::rdf
