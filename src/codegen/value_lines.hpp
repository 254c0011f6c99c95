// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/rdf/type.hpp>

namespace lrt::codegen {

/// The last part of an IRI, decoded: "rotation".
std::string decoded_last_part(std::string_view iri);
/// Scheme and authority, "http://robot:8080".
std::string origin_of(std::string_view iri);

/// Describes a type and its facets, in one line of text for the value and one for each field. Equal lines: equal C++ types. The order of fields
/// and the origin of the robot are ignored.
class ValueLines {
 public:
  using Lines = std::vector<std::pair<std::string, std::string>>;  ///< path of the field, what it is

  /// @param origin  of the robot: IRIs below it are written without it, "~/ns/vocabulary#Grip"
  /// @param bounds  whether bounds of numbers count
  ValueLines(std::string_view origin, bool bounds) : origin_(origin), bounds_(bounds) {}

  void add(const std::string& path, const rdf::Type& type, const rdf::Facets& facets, Lines& lines) const;
  /// All lines as one text.
  std::string text(const rdf::Type& type, const rdf::Facets& facets) const;
  /// "~/ns/vocabulary#Grip", "maths:x", or the IRI.
  std::string short_iri(std::string_view iri) const;

 private:
  std::string one(const rdf::Type& type, const rdf::Facets& facets) const;
  std::string range_of(const rdf::Type& type, const rdf::Facets& facets) const;

  std::string origin_;
  bool bounds_;
};

}  // namespace lrt::codegen
