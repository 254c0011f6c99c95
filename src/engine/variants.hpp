// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/codec.hpp>

#include "src/model/spec.hpp"
#include "src/rdf/plain.hpp"

namespace lrt::engine {

/// The media type of a PATCH.
inline constexpr std::string_view update_type = "application/sparql-update";
/// That of a PATCH of a value in JSON (RFC 7396).
inline constexpr std::string_view merge_patch_type = "application/merge-patch+json";
/// Both, as a value of Accept-Patch.
inline constexpr std::string_view value_patch_types = "application/merge-patch+json, application/sparql-update";

/// One of the media types in which a resource has a representation.
class Variant {
 public:
  enum class Kind : std::uint8_t { rdf, inlined_json_ld, plain, overview, encoded, answer, term_page };

  Variant() = default;  ///< Turtle
  explicit Variant(rdf::Syntax syntax) : Variant(Kind::rdf, static_cast<std::uint8_t>(syntax)) {}
  explicit Variant(rdf::Plain format) : Variant(Kind::plain, static_cast<std::uint8_t>(format)) {}
  /// JSON-LD with its context inside.
  static Variant inlined_json_ld() { return {Kind::inlined_json_ld, static_cast<std::uint8_t>(rdf::Syntax::json_ld)}; }
  /// JSON of a resource that has no plain value: Overview.
  static Variant overview() { return {Kind::overview, 0}; }
  /// The variant that the encoder of the property with that index makes.
  static Variant encoded(std::size_t encoder) { return {Kind::encoded, static_cast<std::uint8_t>(encoder)}; }

  /// The variant of a query result, in the media type with that index (PreparedQuery::types).
  static Variant answer(std::size_t type) { return {Kind::answer, static_cast<std::uint8_t>(type)}; }

  /// HTML of a list of terms: PageSource::terms(). It is no variant of a resource, but its page.
  static Variant term_page() { return {Kind::term_page, 0}; }

  Kind kind() const noexcept { return kind_; }
  bool is_rdf() const noexcept { return kind_ == Kind::rdf || kind_ == Kind::inlined_json_ld; }
  rdf::Syntax syntax() const noexcept { return static_cast<rdf::Syntax>(number_); }
  rdf::Plain plain() const noexcept { return static_cast<rdf::Plain>(number_); }
  std::size_t encoder() const noexcept { return number_; }
  std::size_t type() const noexcept { return number_; }
  /// Only a profile parameter distinguishes its media type from that of another variant.
  bool is_profile() const noexcept { return kind_ == Kind::inlined_json_ld || *this == Variant(rdf::Plain::json_with_units); }
  /// Some values have no representation in it, although other values of the property do.
  bool may_be_missing() const noexcept { return kind_ == Kind::encoded || *this == Variant(rdf::Plain::octets); }
  /// Always UTF-8, so WebSockets carry it in text messages and event streams carry it.
  bool is_text() const noexcept {
    return is_rdf() || kind_ == Kind::overview || kind_ == Kind::answer ||
           (kind_ == Kind::plain && plain() != rdf::Plain::cbor && plain() != rdf::Plain::octets);
  }

  friend bool operator==(Variant a, Variant b) noexcept { return a.kind_ == b.kind_ && a.number_ == b.number_; }
  friend bool operator!=(Variant a, Variant b) noexcept { return !(a == b); }

 private:
  Variant(Kind kind, std::uint8_t number) : kind_(kind), number_(number) {}
  Kind kind_ = Kind::rdf;
  std::uint8_t number_ = 0;
};

/// The variants of a resource. A client that accepts several gets the first (R1.2: Turtle).
struct Variants {
  std::vector<std::string_view> types;  ///< media types, as http::negotiate() takes them
  std::vector<Variant> variants;        ///< of the same index
  /// The media types and, among them, that of the HTML page: behind those that lrt writes, before those of the user's encoders. Browsers
  /// accept pictures and pages with the same weight, and a camera opened in a browser should show its page.
  std::vector<std::string_view> with_page;

  std::optional<Variant> find(std::string_view media_type) const noexcept;
  std::string_view type_of(Variant variant) const noexcept;
  /// The media types for people. Those that only a profile distinguishes are named once.
  std::string list() const;
};

/// The media type of the HTML page.
inline constexpr std::string_view page_type = "text/html";
/// The media type of an event stream (WHATWG HTML 9.2).
inline constexpr std::string_view event_stream_type = "text/event-stream";

/// The variants of resources that only RDF describes.
const Variants& graph_variants();
/// The variants of resources that RDF and an overview in JSON describe.
const Variants& overview_variants();
/// The variants of resources whose value can be written without RDF.
const Variants& value_variants();
/// The variants of the JSON-LD context.
const Variants& context_variants();
/// The variants of a property with octets or with user-defined encoders. The views are valid as long as the spec.
Variants variants_of(const model::PropertySpec& spec);

/// "text/turtle, application/n-triples, ...": the media types of request bodies, with or without those of plain values.
std::string readable_types(bool plain);
/// Of these, those whose documents may have named graphs.
bool may_have_graphs(rdf::Syntax syntax) noexcept;
/// The Content-Type of a body in a media type.
std::string content_type(Variant variant, std::string_view media_type, std::string_view body);
/// The target of a resource, or of a page of a container, in one media type.
std::string variant_iri(const std::string& resource, std::string_view media_type, std::size_t page = 1);
/// A media type as part of an IRI: characters with a meaning in a query are percent-encoded.
std::string escaped(std::string_view text);

}  // namespace lrt::engine
