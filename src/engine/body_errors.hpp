// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lrt/shacl/report.hpp>

#include "src/rdf/value_places.hpp"

namespace lrt::engine {

/// One thing that is wrong with a body, for clients without RDF.
struct BodyError {
  std::string pointer;       ///< JSON Pointer (RFC 6901) of the value in its plain form, "/speed"; empty: the whole body
  std::string detail;        ///< what was expected, what was found
  std::string value{};       ///< what was found, as JSON; empty: nothing, or no literal
  std::string constraint{};  ///< "sh:MinCountConstraintComponent"; empty: it was not the shape that refused
};

/// The results of a report, without those that repeat another of the same place.
/// @param places  nullopt: the body has no plain form, and all errors are about the whole body
std::vector<BodyError> body_errors(const shacl::Report& report, const std::optional<rdf::ValuePlaces>& places);

/// One sentence for all, with the places.
std::string sentence_of(const std::vector<BodyError>& errors);
/// The member `errors` of problem details, in the style of the example in RFC 9457 3: [{"detail": ..., "pointer": "#/speed", ...}].
std::string json_of(const std::vector<BodyError>& errors);

}  // namespace lrt::engine
