// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/client/schema.hpp>
#include <lrt/rdf/graph.hpp>

#include "src/check/survey.hpp"

namespace lrt::check {

/// Values that are one of several alternatives, each with its predicate: sh:xone of shapes that require one predicate each.
class Variant {
 public:
  /// The variants that shapes describe, at most 100.
  static std::vector<Variant> all_of(const rdf::Graph& shapes);

  rdf::TermView shape() const noexcept { return schema_.shape(); }
  /// The names of the alternatives, "moveJ, stop".
  std::string names() const;
  /// Whether there may be no alternative.
  bool is_optional() const noexcept { return schema_.type().kind == rdf::Type::Kind::optional; }
  /// The index of the one alternative that a node has; nullopt: it has none, or several.
  std::optional<std::size_t> active(const rdf::Graph& graph, rdf::TermId node) const;
  const std::string& predicate(std::size_t alternative) const noexcept { return type().fields[alternative].predicate; }
  const std::string& name(std::size_t alternative) const noexcept { return type().fields[alternative].name; }
  std::size_t size() const noexcept { return type().fields.size(); }
  /// Adds the triples of a value that is that alternative. False: no value is known that has this type.
  bool add_sample(rdf::Graph& graph, rdf::TermId node, std::size_t alternative) const;
  /// The graph without what a node says by the predicates of the alternatives.
  rdf::Graph without_alternatives(const rdf::Graph& graph, rdf::TermId node) const;

 private:
  explicit Variant(client::Schema schema) : schema_(std::move(schema)) {}
  const rdf::Type& type() const noexcept { return is_optional() ? *schema_.type().element : schema_.type(); }
  client::Schema schema_;
};

/// Sets of names of alternatives of which a value has exactly one, as the JSON of Things announces them: `oneOf` of objects with one required member.
using Announced = std::set<std::set<std::string>>;
void add_announced(std::string_view json, Announced& announced);

/// Values that have several alternatives and conform: a sentence for each shape of that kind.
/// @param announced  alternatives of which a value has one, whatever the shapes say
/// @param judged     how many shapes were judged
std::vector<std::string> shapes_that_accept_several(const rdf::Graph& shapes, const Announced& announced, std::size_t& judged);

/// A body that must be refused, and what it is.
struct WrongBody {
  std::string turtle, what;
};
/// Bodies with two alternatives, and with none, made of one that has one. Empty: no Blueprint says that its value is a variant.
std::vector<WrongBody> with_wrong_alternatives(const Context& context, const rdf::Graph& body, const std::string& url);

}  // namespace lrt::check
