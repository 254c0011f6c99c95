// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/rdf/hash.hpp"

// How a graph finds terms and triples.

namespace lrt::rdf {

inline bool equals_lower(std::string_view lowered, std::string_view text) noexcept {
  if (lowered.size() != text.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (lowered[i] != lrt::detail::lower(text[i])) return false;
  }
  return true;
}

/// The datatype of a literal, also if the caller left it empty.
inline std::string_view datatype_of(const TermView& term) noexcept {
  if (!term.language.empty()) return vocab::rdf_::langString.text;
  return term.datatype.empty() ? vocab::xsd::string.text : term.datatype;
}

inline std::uint32_t hash_of(const TermView& term) noexcept {
  std::uint64_t h = hash_bytes(term.text, hash_seeds().bytes + static_cast<std::uint64_t>(term.kind));
  if (term.is_literal()) {
    h = hash_bytes(datatype_of(term), h);
    for (const char c : term.language) h = fold_multiply(h ^ static_cast<unsigned char>(lrt::detail::lower(c)), 0xE7037ED1A0B428DBu);
  }
  return to_32_bits(h);
}

inline std::uint32_t hash_of(const Triple& t) noexcept {
  return to_32_bits(
      hash_triple(static_cast<std::uint32_t>(t.subject), static_cast<std::uint32_t>(t.predicate), static_cast<std::uint32_t>(t.object)));
}

}  // namespace lrt::rdf
