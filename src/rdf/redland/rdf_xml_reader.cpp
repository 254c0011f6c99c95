// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/iri.hpp>

#include "src/rdf/codecs.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/redland/rdf_xml_scan.hpp"
#include "src/rdf/redland/rdf_xml_text.hpp"
#include "src/rdf/redland/redland.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace {

/// Refuses terms that Raptor accepts but no writer could write: relative or invalid IRIs, invalid language tags.
Result<Graph> checked(Result<Graph> graph) {
  if (!graph) return graph;
  for (std::uint32_t i = 0; i < graph->term_count(); ++i) {
    const TermView term = graph->term(TermId{i});
    const bool good = term.is_iri()       ? iri::is_absolute(term.text)
                      : term.is_literal() ? term.language.empty() || is_language_tag(term.language)
                                          : true;
    if (!good && term.is_literal()) {  // without its text, which may be long
      return unexpected(Errc::expected_rdf, "not a language tag: @" + std::string(term.language));
    }
    if (!good) return unexpected(Errc::expected_rdf, std::string(fault_of(term)) + ", found " + to_string(term));
  }
  return graph;
}

}  // namespace

bool has_rdf_xml() noexcept { return true; }

void prepare_rdf_xml() noexcept { redland::prepare(); }

Result<Graph> read_rdf_xml(std::string_view text, const ReadOptions& options) {
  std::string storage;
  const Result<std::string_view> plain = plain_rdf_xml(text, options, storage);
  if (!plain) return unexpected(plain.error());
  if (Result<void> scanned = scan_rdf_xml(*plain, options); !scanned) return unexpected(scanned.error());
  return checked(redland::parse_rdf_xml(*plain, options));
}

}  // namespace v0
}  // namespace lrt::rdf
