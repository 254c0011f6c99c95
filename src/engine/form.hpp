#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/model/detail/spec.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/plain.hpp>

namespace lrt::engine {

struct Resource;

/// What a representation is written in.
class Form {
 public:
  enum class Kind : std::uint8_t { rdf, inlined_json_ld, plain, own };

  Form() = default;  ///< Turtle
  explicit Form(rdf::Syntax syntax) : Form(Kind::rdf, static_cast<std::uint8_t>(syntax)) {}
  explicit Form(rdf::Plain format) : Form(Kind::plain, static_cast<std::uint8_t>(format)) {}
  static Form inlined_json_ld() { return {Kind::inlined_json_ld, static_cast<std::uint8_t>(rdf::Syntax::json_ld)}; }
  /// By the property's encoder of that index.
  static Form own(std::size_t index) { return {Kind::own, static_cast<std::uint8_t>(index)}; }

  Kind kind() const noexcept { return kind_; }
  bool is_rdf() const noexcept { return kind_ == Kind::rdf || kind_ == Kind::inlined_json_ld; }
  rdf::Syntax syntax() const noexcept { return static_cast<rdf::Syntax>(number_); }
  rdf::Plain plain() const noexcept { return static_cast<rdf::Plain>(number_); }
  std::size_t index() const noexcept { return number_; }
  /// Whether only a profile tells it from another one.
  bool is_variant() const noexcept { return kind_ == Kind::inlined_json_ld || *this == Form(rdf::Plain::json_with_units); }
  /// Whether some values have none, though others of the property do.
  bool may_be_missing() const noexcept { return kind_ == Kind::own || *this == Form(rdf::Plain::octets); }
  /// Whether it is UTF-8 for certain, so that a WebSocket carries it in text messages.
  bool is_text() const noexcept { return is_rdf() || (kind_ == Kind::plain && plain() != rdf::Plain::cbor && plain() != rdf::Plain::octets); }

  friend bool operator==(Form a, Form b) noexcept { return a.kind_ == b.kind_ && a.number_ == b.number_; }
  friend bool operator!=(Form a, Form b) noexcept { return !(a == b); }

 private:
  Form(Kind kind, std::uint8_t number) : kind_(kind), number_(number) {}
  Kind kind_ = Kind::rdf;
  std::uint8_t number_ = 0;
};

/// The representations of a resource, in the order in which an indifferent client gets them (R1.2: Turtle first).
struct Offers {
  std::vector<std::string_view> types;  ///< media types, as http::negotiate() takes them
  std::vector<Form> forms;              ///< of the same index
  /// The types, and among them that of the page for people: after what lrt writes itself (R1.2), before the user's own, for a browser
  /// that opens a camera says that it takes pictures as gladly as pages.
  std::vector<std::string_view> with_page;

  std::optional<Form> form_of(std::string_view media_type) const noexcept;
  std::string_view type_of(Form form) const noexcept;
};

/// Of the page for people.
inline constexpr std::string_view page_type = "text/html";

/// A property with formats of its own. Its views live as long as the spec.
Offers offers_of(const model::PropertySpec& spec);
const Offers& offers_of(const Resource& resource);
const Offers& offers_of_graphs();
const Offers& offers_of_values();
/// Whether a resource has a value that can be written without RDF.
bool has_value(const Resource& resource) noexcept;

/// "text/turtle, application/n-triples, ...": what a body may be written in, with or without a value in it.
std::string readable_types(bool plain);
/// For people; what only profiles tell apart is said once.
std::string list_of(const Offers& offers);
/// The Content-Type of a media type.
std::string content_type(Form form, std::string_view media_type);

}  // namespace lrt::engine
