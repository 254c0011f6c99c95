// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/rdf/graph_writer.hpp"

/// The list of terms of lrt's JSON-LD context. The writer, the served document and the reader, for references to that document, use it.
namespace lrt::rdf::json_ld {

/// How a string value of a term is read.
enum class Coercion : std::uint8_t {
  none,     ///< a string
  id,       ///< an IRI, absolute or with a prefix
  vocab,    ///< as id, or a term: "running"
  datatype  ///< a literal of Term::datatype
};

struct Term {
  std::string_view name;  ///< "state"; with a prefix, "sh:path", if the local name is not unique
  Iri iri;
  Coercion coercion = Coercion::none;
  Iri datatype{};
};

/// The term of an IRI, or nullptr.
const Term* term_of(std::string_view iri) noexcept;
/// The index of a term in the list.
std::size_t index_of(const Term& term) noexcept;
std::size_t term_count() noexcept;
const Term& term_at(std::size_t index) noexcept;

/// True if the context has a term with this name, so that no prefix can have it.
bool is_term_name(std::string_view name) noexcept;

/// The caller's prefixes without those with the name of a term.
PrefixTable usable_prefixes(const Prefixes& prefixes);

/// True if a prefixed name of the list, "sh:path", has the same meaning with these prefixes.
bool is_usable(const Term& term, PrefixTable& prefixes) noexcept;

/// The members of a context object, without braces, one on each line: keywords, prefixes, terms.
/// @param used  terms to write, by index_of(); nullptr: all. Prefixes as marked, or all.
std::string members(PrefixTable& prefixes, const std::vector<bool>* used, int indent);

/// The canonical xsd:double of a JSON number: "%1.15E" without trailing zeros (JSON-LD-API 1.1, 8.6).
std::string canonical_double(double value);

}  // namespace lrt::rdf::json_ld
