// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>

#include "src/engine/audience.hpp"

namespace lrt::engine {
inline namespace v0 {

class PropertyResource;
class Registry;
class Resource;
struct ThingNode;

// What was registered with a Thing, as far as Blueprints promise it (SPEC 3.12). Nothing here depends on the moment: not on values, not on what is
// available, not on other Things. So what a Blueprint says stays true.

/// A named shape of values: of a property, of the input or result of an action, or of the members of a collection.
struct ValueShape {
  std::string name;  ///< "rotation", "actions/rotate/input"
  const rdf::Type* type;
  const rdf::Facets* facets;
  bool input;                ///< clients send such values
  bool repeated;             ///< it is described in the document of its action too. Not one with lists: their property paths cannot have names
  const Resource* resource;  ///< takes or has such values
  const PropertyResource* property;  ///< whose values these are; null: those of an action or collection

  /// It is one of numbers with bounds, which the shape of the kind does not have.
  bool has_bounds() const noexcept;
};

/// The value shapes of a Thing, in the order of registration. Equal Things have as many.
std::vector<ValueShape> value_shapes(const ThingNode& thing);

/// The value shapes of a Thing that have bounds, as a text; empty: there are none.
std::string bounds_of(const ThingNode& thing);

/// The objects of the user's triples about a Thing, for one predicate.
struct Links {
  std::size_t count = 0;
  bool iris = true, literals = true;  ///< all are
};
/// @param audience  links to where it may not read are left out, whether something is there or not
std::map<std::string, Links> links_of(const ThingNode& thing, const Registry& registry, const Audience& audience = {});

/// Equal texts: the Things were registered in the same way, but for bounds of numbers. Different in each process.
std::string signature_of(const ThingNode& thing, const Registry& registry);

/// A hash of a text in eight hexadecimal digits, the same in each process.
std::string short_hash(std::string_view text);

}  // namespace v0
}  // namespace lrt::engine
