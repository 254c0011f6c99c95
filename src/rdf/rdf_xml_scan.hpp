#pragma once

#include <string_view>

#include <lrt/base/result.hpp>

namespace lrt::rdf {

/// Judges an RDF/XML document before libxml2 and Raptor see it: UTF-8 only, no document type declaration (so no entities, of
/// its own or from elsewhere), and no language tag that Raptor reads beyond its end.
/// @par Errors  expected_rdf with offset, line and column.
Result<void> scan_rdf_xml(std::string_view text);

}  // namespace lrt::rdf
