// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/iri.hpp>

namespace lrt {
inline namespace v0 {

/// The object of a statement: an IRI, a literal, or another resource of the same server. The constructors are implicit,
/// so that statements read like Turtle: `thing.add(vocab::rdfs::label, "left arm")`.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API Object {
 public:
  /// What the object is.
  enum class Kind : std::uint8_t { iri, literal, resource };

  /// An IRI.
  Object(Iri iri) : kind_(Kind::iri), text_(iri.text) {}  // NOLINT: reads like Turtle
  /// @{
  /// A literal without a language: xsd:string; of a number or truth value: xsd:double, xsd:integer, xsd:boolean.
  Object(std::string text) : Object(std::move(text), std::string(), std::string()) {}  // NOLINT
  Object(std::string_view text) : Object(std::string(text)) {}                         // NOLINT
  Object(const char* text) : Object(std::string(text)) {}                              // NOLINT
  Object(double number);                                                               // NOLINT: xsd:double
  template <class T, class = std::enable_if_t<std::is_integral_v<T>>>
  Object(T number) : Object(std::is_same_v<T, bool> ? truth(number) : whole(static_cast<std::int64_t>(number))) {}  // NOLINT
  /// @}

  /// A resource of this server by its path, "baxter/right_upper_shoulder". Its IRI has the base of the representation
  /// in which it appears.
  static Object resource(std::string path) { return Object(Kind::resource, std::move(path)); }
  /// A literal with a datatype: typed("2026-11-21", vocab::xsd::date).
  static Object typed(std::string lexical, Iri datatype) { return Object(std::move(lexical), std::string(datatype.text), std::string()); }
  /// A literal with a language: tagged("arm", "en"). The tag is stored in lower case.
  static Object tagged(std::string text, std::string language) {
    for (char& c : language)  // tags are case-insensitive (RDF 1.1 Concepts 3.3)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return Object(std::move(text), std::string(), std::move(language));
  }

  Kind kind() const noexcept { return kind_; }                        ///< what the object is
  const std::string& text() const noexcept { return text_; }          ///< the IRI, lexical form or path
  const std::string& datatype() const noexcept { return datatype_; }  ///< IRI of the datatype; empty: xsd:string or language-tagged
  const std::string& language() const noexcept { return language_; }  ///< language tag in lower case; empty: none

 private:
  Object(Kind kind, std::string text) : kind_(kind), text_(std::move(text)) {}
  Object(std::string text, std::string datatype, std::string language)
      : kind_(Kind::literal), text_(std::move(text)), datatype_(std::move(datatype)), language_(std::move(language)) {}
  static Object truth(bool value);
  static Object whole(std::int64_t value);

  Kind kind_;
  std::string text_, datatype_, language_;
};

/// A triple about a resource, without its subject (R1.12).
struct Statement {
  std::string predicate;  ///< IRI of the predicate
  Object object;          ///< the object
};

}  // namespace v0
}  // namespace lrt
