#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/rdf/graph_writer.hpp"

/// The one list of names by which lrt speaks JSON-LD: what the writer shortens with, what the served document says, and what the
/// reader takes a reference to it for.
namespace lrt::rdf::json_ld {

/// What a string means as a value of a term.
enum class Coercion : std::uint8_t {
  none,     ///< a string
  id,       ///< an IRI, absolute or with a prefix
  vocab,    ///< the same or a term: "running"
  datatype  ///< a literal of Term::datatype
};

struct Term {
  std::string_view name;  ///< "state", or with the prefix "sh:path" where the local name would not be unique
  Iri iri;
  Coercion coercion = Coercion::none;
  Iri datatype{};
};

/// The term of an IRI, or nullptr.
const Term* term_of(std::string_view iri) noexcept;
/// Its place in the list, from 0.
std::size_t index_of(const Term& term) noexcept;
std::size_t term_count() noexcept;
const Term& term_at(std::size_t index) noexcept;

/// True for what a prefix cannot be called, because the context has it as a term.
bool is_term_name(std::string_view name) noexcept;

/// A table of the caller's prefixes without those that have the name of a term.
PrefixTable usable_prefixes(const Prefixes& prefixes);

/// True if a name of the list with a prefix, "sh:path", is one under these prefixes too.
bool is_usable(const Term& term, PrefixTable& prefixes) noexcept;

/// The members of a context object, without braces, one a line: the keywords, then prefixes, then terms.
/// @param used  by index_of(); nullptr: all terms. Prefixes as marked, or all.
std::string members(PrefixTable& prefixes, const std::vector<bool>* used, int indent);

/// The canonical form of xsd:double that JSON-LD makes of a number: "%1.15E" without trailing zeros (JSON-LD-API 1.1, 8.6).
std::string canonical_double(double value);

}  // namespace lrt::rdf::json_ld
