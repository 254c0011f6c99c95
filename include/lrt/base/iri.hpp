// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt {
inline namespace v0 {

/// A view of a text that is an IRI, for constants and arguments: `Iri{"http://example.org/ns#colour"}`. Vocabulary
/// terms have this type. The constructors do not validate the text. The text must outlive the view.
/// @par Threads  Any, as long as nobody changes the text.
struct Iri {
  std::string_view text;  ///< the IRI

  constexpr Iri() noexcept = default;
  /// @{
  /// A view of an IRI.
  constexpr explicit Iri(std::string_view iri) noexcept : text(iri) {}
  constexpr explicit Iri(const char* iri) noexcept : text(iri) {}
  /// @}
  /// Whether there is no text.
  constexpr bool empty() const noexcept { return text.empty(); }
  friend constexpr bool operator==(Iri a, Iri b) noexcept { return a.text == b.text; }
  friend constexpr bool operator!=(Iri a, Iri b) noexcept { return !(a == b); }
};

}  // namespace v0
}  // namespace lrt

namespace lrt::iri {
inline namespace v0 {

/// The five parts of an IRI reference (RFC 3986 3, RFC 3987), as views of the text given to split(). A part that is
/// absent is empty; the flags tell an absent part from an empty one.
struct Parts {
  /// @{
  /// A part, without its delimiters.
  std::string_view scheme, authority, path, query, fragment;
  /// @}
  /// @{
  /// Whether the reference has this part.
  bool has_scheme = false, has_authority = false, has_query = false, has_fragment = false;
  /// @}
};

/// Splits a reference into its parts (RFC 3986 appendix B). Does not validate its characters.
/// @par Threads  Any.
/// @par Time     Linear in the text. Does not allocate.
LRT_API Parts split(std::string_view reference) noexcept;

/// Whether `text` is an absolute IRI: it has a scheme and only characters that RFC 3987 2.2 allows (UTF-8, no controls,
/// no space, none of `<>"{}|^` or backquote or backslash, well-formed percent escapes).
/// @par Threads  Any.
/// @par Time     Linear in the text. Does not allocate.
LRT_API bool is_absolute(std::string_view text) noexcept;

/// Whether `text` is an IRI reference, absolute or relative, with allowed characters only.
/// @par Threads  Any.
/// @par Time     Linear in the text. Does not allocate.
LRT_API bool is_reference(std::string_view text) noexcept;

/// Resolves a reference against an absolute base (RFC 3986 5.2, strict).
/// @par Errors   expected_iri: one of the two is not valid
/// @par Threads  Any.
/// @par Time     Allocates.
LRT_API Result<std::string> resolve(std::string_view base, std::string_view reference);

/// Percent-encodes a name for use as one path segment. The unreserved characters of RFC 3986 and "!$&'()*+,;=:@" stay;
/// each other byte of the UTF-8 text is encoded.
/// @par Threads  Any.
/// @par Time     Linear in the text. Allocates.
LRT_API std::string encode_segment(std::string_view name);

/// Decodes percent escapes.
/// @par Errors   expected_iri: an incomplete or non-hex escape, with its offset
/// @par Threads  Any.
/// @par Time     Linear in the text. Allocates.
LRT_API Result<std::string> decode(std::string_view text);

}  // namespace v0
}  // namespace lrt::iri
