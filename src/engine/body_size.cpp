// SPDX-License-Identifier: Apache-2.0
#include "src/engine/body_size.hpp"

#include <algorithm>
#include <limits>

namespace lrt::engine {
namespace {

constexpr std::size_t unbounded = std::numeric_limits<std::size_t>::max();
/// An estimate for one value with its predicate: full IRIs, its node, white space. A list member in RDF/XML takes about 300.
constexpr std::size_t value_bytes = 1024;
/// The longest form of a code point: a surrogate pair of escapes in JSON.
constexpr std::size_t code_point_bytes = 12;

std::size_t plus(std::size_t a, std::size_t b) noexcept { return a > unbounded - b ? unbounded : a + b; }
std::size_t times(std::size_t a, std::size_t b) noexcept { return b != 0 && a > unbounded / b ? unbounded : a * b; }

std::size_t size_of(const rdf::Type& type, const rdf::Facets& facets) {
  switch (type.kind) {
    case rdf::Type::Kind::boolean:
    case rdf::Type::Kind::integer:
    case rdf::Type::Kind::real:
    case rdf::Type::Kind::duration:
    case rdf::Type::Kind::instant: return value_bytes;
    case rdf::Type::Kind::enumeration: {
      std::size_t longest = 0;
      for (const std::string& name : type.names) longest = std::max(longest, name.size());
      return plus(value_bytes, times(longest, code_point_bytes));
    }
    case rdf::Type::Kind::text: return plus(value_bytes, times(facets.max_length(), code_point_bytes));
    case rdf::Type::Kind::list: return type.longest == unbounded ? unbounded : plus(value_bytes, times(type.longest, size_of(*type.element, facets)));
    case rdf::Type::Kind::optional: return size_of(*type.element, facets);
    case rdf::Type::Kind::record:
    case rdf::Type::Kind::variant: {  // the names of all alternatives are short beside the largest: the sum is an upper bound
      std::size_t all = value_bytes;
      for (const rdf::FieldType& field : type.fields)
        all = plus(all, plus(field.predicate.size(), size_of(*field.type, rdf::field_facets(field, facets))));
      return all;
    }
    case rdf::Type::Kind::map: break;
  }
  return unbounded;
}

}  // namespace

std::optional<std::size_t> body_size(const rdf::Type& type, const rdf::Facets& facets, std::size_t base) {
  const std::size_t size = plus(base, size_of(type, facets));
  return size == unbounded ? std::nullopt : std::optional(size);
}

}  // namespace lrt::engine
