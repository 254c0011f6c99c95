#include "src/engine/form.hpp"

#include <algorithm>

#include "src/engine/resource.hpp"

namespace lrt::engine {

namespace {

/// JSON-LD with its context, for who cannot fetch the robot's.
constexpr std::string_view inlined_json_ld = "application/ld+json;profile=\"https://w3id.org/lrt/ns#inlineContext\"";

void add(Offers& offers, std::string_view type, Form form) {
  offers.types.push_back(type);
  offers.forms.push_back(form);
  offers.with_page.push_back(type);
}

Offers of_rdf() {
  Offers offers;
  for (const rdf::Syntax s : rdf::available_syntaxes()) add(offers, rdf::media_type(s), Form(s));
  add(offers, inlined_json_ld, Form::inlined_json_ld());
  return offers;
}

Offers of_rdf_and_plain() {
  Offers offers = of_rdf();
  for (const rdf::Plain p : rdf::all_plain) add(offers, rdf::media_type(p), Form(p));
  return offers;
}

Offers with_page(Offers offers) {
  offers.with_page.push_back(page_type);
  return offers;
}

}  // namespace

std::optional<Form> Offers::form_of(std::string_view media_type) const noexcept {
  const auto found = std::find(types.begin(), types.end(), media_type);
  return found == types.end() ? std::nullopt : std::optional(forms[static_cast<std::size_t>(found - types.begin())]);
}

std::string_view Offers::type_of(Form form) const noexcept {
  const auto found = std::find(forms.begin(), forms.end(), form);
  return found == forms.end() ? std::string_view() : types[static_cast<std::size_t>(found - forms.begin())];
}

Offers offers_of(const model::PropertySpec& spec) {
  Offers offers = offers_of_values();
  if (spec.octets) add(offers, rdf::media_type(rdf::Plain::octets), Form(rdf::Plain::octets));
  for (std::size_t i = 0; i < spec.representations.size(); ++i) add(offers, spec.representations[i].media_type, Form::own(i));
  return offers;
}

const Offers& offers_of_graphs() {
  static const Offers offers = with_page(of_rdf());
  return offers;
}

const Offers& offers_of_values() {
  static const Offers offers = with_page(of_rdf_and_plain());
  return offers;
}

const Offers& offers_of(const Resource& resource) {
  static const Offers context = [] {
    Offers only;
    add(only, rdf::media_type(rdf::Syntax::json_ld), Form(rdf::Syntax::json_ld));
    return with_page(std::move(only));
  }();
  if (resource.kind == Kind::context) return context;
  if (!has_value(resource)) return offers_of_graphs();
  if (resource.kind != Kind::property) return offers_of_values();
  const auto& property = static_cast<const PropertyResource&>(resource);
  return property.offers ? *property.offers : offers_of_values();
}

bool has_value(const Resource& resource) noexcept {
  return resource.kind == Kind::property || resource.kind == Kind::state || resource.kind == Kind::member ||
         resource.kind == Kind::invocation;
}

std::string readable_types(bool plain) {
  std::string list;
  const auto more = [&](std::string_view type) { list += (list.empty() ? "" : ", ") + std::string(type); };
  for (const rdf::Syntax s : rdf::available_syntaxes()) more(rdf::media_type(s));
  if (plain)
    for (const rdf::Plain p : {rdf::Plain::json, rdf::Plain::text, rdf::Plain::cbor}) more(rdf::media_type(p));
  return list;
}

std::string list_of(const Offers& offers) {
  std::string list;
  for (std::size_t i = 0; i < offers.types.size(); ++i)
    if (!offers.forms[i].is_variant()) list += (list.empty() ? "" : ", ") + std::string(offers.types[i]);
  return list;
}

std::string content_type(Form form, std::string_view media_type) {
  return form == Form(rdf::Plain::text) ? std::string(media_type) + "; charset=utf-8" : std::string(media_type);  // of the others it is fixed
}

}  // namespace lrt::engine
