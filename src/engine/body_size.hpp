// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include <lrt/rdf/type.hpp>

namespace lrt::engine {

/// How many bytes a body with a value of this type can need, in any syntax; nullopt: its size is not bounded.
/// @param base  for what is in a body besides the values: prefixes, a context, comments
std::optional<std::size_t> body_size(const rdf::Type& type, const rdf::Facets& facets, std::size_t base);

}  // namespace lrt::engine
