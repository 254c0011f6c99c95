// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/error.hpp>
#include <lrt/client/schema.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/quote.hpp"
#include "src/rdf/shown.hpp"

namespace lrt::client {

/// Ends the reading of a shape. Thrown and caught within Schema::read().
struct RefusedShape {
  Error error;
};
[[noreturn]] void refuse_shape(Errc code, std::string message);

using rdf::shown;

/// The property shapes with one predicate as their path.
struct Field {
  std::string predicate;
  std::vector<rdf::TermId> shapes;
};

/// The combined constraints of all shapes for the same nodes.
struct Constraints {
  std::vector<rdf::TermId> shapes;
  std::vector<Field> fields;
  std::vector<rdf::TermId> members, cells;  ///< property shapes of the members and of the cells of a list
  std::vector<std::string> classes, target_classes;
  std::vector<std::string> datatypes;
  std::vector<std::vector<rdf::TermId>> alternatives;  ///< sh:or
  std::vector<std::vector<rdf::TermId>> exclusive;     ///< sh:xone
  std::vector<rdf::TermId> one_of;                     ///< heads of sh:in
  std::vector<rdf::TermId> exactly;                    ///< sh:hasValue
  std::vector<rdf::TermId> with_default;               ///< the shapes that have sh:defaultValue
  std::string node_kind;
  std::vector<std::string> patterns;
  std::vector<std::string> others;  ///< constraints that types cannot express, "sh:lessThan"
  std::size_t min_count = 0, max_count = std::numeric_limits<std::size_t>::max();
  std::size_t min_length = 0, max_length = std::numeric_limits<std::size_t>::max();
  std::vector<std::pair<bool, rdf::TermId>> lower, upper;  ///< exclusive, bound
  std::vector<std::string> names;                          ///< sh:name without a language
  double order = 0;
  bool non_finite = false;  ///< NaN and infinities are allowed beside the bounds

  const Field* field(Iri predicate) const noexcept {
    for (const Field& f : fields)
      if (f.predicate == predicate.text) return &f;
    return nullptr;
  }
  bool has_bounds() const noexcept { return !lower.empty() || !upper.empty(); }
  bool has_lengths() const noexcept { return min_length > 0 || max_length != std::numeric_limits<std::size_t>::max(); }
};

/// Reads the constraints of shapes, within the limits of SchemaOptions. Functions throw RefusedShape: an ill-formed shape, a limit.
class ShapeReader {
 public:
  using Warn = std::function<void(const std::string& sentence)>;

  ShapeReader(const rdf::Graph& graph, const SchemaOptions& options, Warn warn) : graph_(graph), options_(options), warn_(std::move(warn)) {}

  /// Adds the constraints of a shape, and of its shapes by sh:node and sh:and.
  void gather(rdf::TermId shape, Constraints& c) { gather(shape, c, 0); }
  /// The same for a member of sh:and, sh:or or sh:xone, which may be a property shape: a constraint on one field.
  void gather_part(rdf::TermId shape, Constraints& c) { gather_part(shape, c, 0); }
  /// The combined constraints of these shapes.
  Constraints constraints_of(const std::vector<rdf::TermId>& shapes);

 private:
  void gather(rdf::TermId shape, Constraints& c, std::size_t depth);
  void gather_part(rdf::TermId shape, Constraints& c, std::size_t depth);
  void property(rdf::TermId p, Constraints& c);
  void add_class(std::vector<std::string>& classes, rdf::TermId shape, const rdf::Triple& t) const;
  void add_name(Constraints& c, rdf::TermId shape, const rdf::Triple& t) const;
  void count_shape();
  std::size_t count(rdf::TermId shape, const rdf::Triple& t) const;
  std::vector<rdf::TermId> list(rdf::TermId shape, const rdf::Triple& t) const;
  std::string text_of(rdf::TermId shape, const rdf::Triple& t, const char* expected, bool is_iri) const;
  rdf::TermId node_of(rdf::TermId shape, const rdf::Triple& t) const;
  rdf::TermId bound(rdf::TermId shape, const rdf::Triple& t) const;
  bool is_rests(rdf::TermId path) const;
  bool is_members(rdf::TermId path) const;
  [[noreturn]] void ill_formed(rdf::TermId shape, std::string_view predicate, rdf::TermId object, const std::string& expected) const;

  const rdf::Graph& graph_;
  const SchemaOptions& options_;
  Warn warn_;
  std::size_t visited_ = 0;
};

}  // namespace lrt::client
