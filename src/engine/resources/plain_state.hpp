// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>
#include <string>
#include <vector>

#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

#include "src/engine/audience.hpp"

namespace lrt::engine {
inline namespace v0 {

struct ThingNode;

/// The values of a Thing's properties as members of a record, for JSON and CBOR. A property that has no present value is missing, and the member
/// "@errors" has the reason by the name of the property: {"angle": 0.5, "@errors": {"current": "it could not be read: ..."}}.
struct PlainState {
  /// Adds the members of a Thing, as far as the audience sees them.
  void add(const ThingNode& thing, const Audience& audience);
  /// Adds "@errors" after the other members, if a property has failed. If a member of the user has that name, "-lrt" is appended.
  /// @param types  keeps its type
  void add_failures(std::list<rdf::Type>& types);

  std::vector<rdf::FieldType> fields;
  rdf::Value::Sequence values;

 private:
  struct Failed {
    std::string name, predicate, why;
  };
  std::vector<Failed> failed_;
};

}  // namespace v0
}  // namespace lrt::engine
