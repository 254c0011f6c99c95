// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/iri.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The kind of an RDF term (RDF 1.1 Concepts 3.1).
enum class TermKind : std::uint8_t { iri, blank, literal };

/// A view of an RDF term (RDF 1.1 Concepts 3). Two terms are equal if all four members are equal. A literal always has
/// a datatype IRI: xsd:string by default, rdf:langString if it has a language. The texts must outlive the view.
/// @par Threads  Any, as long as nobody changes the texts.
struct TermView {
  TermKind kind = TermKind::iri;  ///< kind of the term
  std::string_view text;          ///< the IRI, the blank node's label without "_:", or the lexical form
  std::string_view datatype;      ///< literals only: the datatype IRI
  std::string_view language;      ///< literals only: the language tag, in lower case

  constexpr TermView() noexcept = default;
  /// An IRI.
  constexpr TermView(Iri iri) noexcept : kind(TermKind::iri), text(iri.text) {}  // NOLINT: an Iri is a term
  /// A term from its members.
  constexpr TermView(TermKind k, std::string_view t, std::string_view d = {}, std::string_view l = {}) noexcept
      : kind(k), text(t), datatype(d), language(l) {}

  constexpr bool is_iri() const noexcept { return kind == TermKind::iri; }          ///< whether it is an IRI
  constexpr bool is_blank() const noexcept { return kind == TermKind::blank; }      ///< whether it is a blank node
  constexpr bool is_literal() const noexcept { return kind == TermKind::literal; }  ///< whether it is a literal

  friend constexpr bool operator==(const TermView& a, const TermView& b) noexcept {
    return a.kind == b.kind && a.text == b.text && a.datatype == b.datatype && a.language == b.language;
  }
  friend constexpr bool operator!=(const TermView& a, const TermView& b) noexcept { return !(a == b); }
};

/// A view of an IRI.
constexpr TermView iri(std::string_view text) noexcept { return {TermKind::iri, text}; }
/// A view of a blank node. @param label  without "_:"
constexpr TermView blank(std::string_view label) noexcept { return {TermKind::blank, label}; }
/// A plain literal: datatype xsd:string.
/// @par Threads  Any.
/// @par Time     Constant. Does not allocate.
LRT_API TermView literal(std::string_view lexical) noexcept;
/// A typed literal. @pre the datatype is not rdf:langString
constexpr TermView literal(std::string_view lexical, Iri datatype) noexcept { return {TermKind::literal, lexical, datatype.text}; }
/// A language-tagged literal. @pre `language` is in lower case
/// @par Threads  Any.
/// @par Time     Constant. Does not allocate.
LRT_API TermView tagged_literal(std::string_view lexical, std::string_view language) noexcept;

/// A term that owns its text.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class Term {
 public:
  Term() = default;
  /// @{
  /// Copies the text of a term.
  Term(const TermView& view)  // NOLINT: a view converts to its owner
      : kind_(view.kind), text_(view.text), datatype_(view.datatype), language_(view.language) {}
  Term(Iri iri) : Term(TermView(iri)) {}  // NOLINT
  /// @}

  /// @{
  /// A view of the term. Valid until the object is changed.
  TermView view() const noexcept { return {kind_, text_, datatype_, language_}; }
  // An owner converts to a view. NOLINTNEXTLINE(google-explicit-constructor)
  operator TermView() const noexcept { return view(); }
  /// @}

 private:
  TermKind kind_ = TermKind::iri;
  std::string text_, datatype_, language_;
};

/// The term in the syntax of N-Triples, for messages: `<iri>`, `_:label`, `"lexical"^^<datatype>`. Long texts are not
/// shortened.
/// @par Threads  Any.
LRT_API std::string to_string(const TermView& term);

}  // namespace v0
}  // namespace lrt::rdf
