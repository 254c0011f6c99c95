// SPDX-License-Identifier: Apache-2.0
#include "src/engine/variants.hpp"

#include <algorithm>

#include <lrt/base/immortal.hpp>

#include "src/base/ascii.hpp"
#include "src/base/charset.hpp"
#include "src/engine/facets.hpp"
#include "src/base/quote.hpp"

namespace lrt::engine {

namespace {

/// JSON-LD with its context, for clients that cannot fetch the robot's.
constexpr std::string_view inlined_json_ld = "application/ld+json;profile=\"https://w3id.org/lrt/ns#inlineContext\"";

void add(Variants& all, std::string_view type, Variant variant) {
  all.types.push_back(type);
  all.variants.push_back(variant);
  all.with_page.push_back(type);
}

Variants of_graphs() {
  Variants all;
  for (const rdf::Syntax s : rdf::available_syntaxes()) add(all, rdf::media_type(s), Variant(s));
  if (rdf::syntax_of(rdf::media_type(rdf::Syntax::json_ld))) add(all, inlined_json_ld, Variant::inlined_json_ld());
  return all;
}

Variants with_page(Variants all) {
  all.with_page.push_back(page_type);
  return all;
}

}  // namespace

std::optional<Variant> Variants::find(std::string_view media_type) const noexcept {
  const auto found = std::find(types.begin(), types.end(), media_type);
  return found == types.end() ? std::nullopt : std::optional(variants[static_cast<std::size_t>(found - types.begin())]);
}

std::string_view Variants::type_of(Variant variant) const noexcept {
  const auto found = std::find(variants.begin(), variants.end(), variant);
  return found == variants.end() ? std::string_view() : types[static_cast<std::size_t>(found - variants.begin())];
}

std::string Variants::list() const {
  std::string text;
  for (std::size_t i = 0; i < types.size(); ++i)
    if (!variants[i].is_profile()) text += (text.empty() ? "" : ", ") + std::string(types[i]);
  return text;
}

const Variants& graph_variants() {
  static const Immortal<Variants> all(with_page(of_graphs()));
  return *all;
}

const Variants& overview_variants() {
  static const Immortal<Variants> all([] {
    Variants both = of_graphs();
    add(both, rdf::media_type(rdf::Plain::json), Variant::overview());
    return with_page(std::move(both));
  }());
  return *all;
}

const Variants& value_variants() {
  static const Immortal<Variants> all([] {
    Variants both = of_graphs();
    for (const rdf::Plain p : rdf::all_plain) add(both, rdf::media_type(p), Variant(p));
    return with_page(std::move(both));
  }());
  return *all;
}

const Variants& context_variants() {
  static const Immortal<Variants> all([] {
    Variants only;
    add(only, rdf::media_type(rdf::Syntax::json_ld), Variant(rdf::Syntax::json_ld));
    return with_page(std::move(only));
  }());
  return *all;
}

Variants variants_of(const model::PropertySpec& spec) {
  Variants all;
  if (spec.file)
    for (std::size_t i = 0; i < spec.representations.size(); ++i) add(all, spec.representations[i].media_type, Variant::encoded(i));
  const Variants& values = value_variants();
  all.types.insert(all.types.end(), values.types.begin(), values.types.end());
  all.variants.insert(all.variants.end(), values.variants.begin(), values.variants.end());
  all.with_page.insert(all.with_page.end(), values.with_page.begin(), values.with_page.end());
  if (spec.octets) add(all, rdf::media_type(rdf::Plain::octets), Variant(rdf::Plain::octets));
  if (!spec.file)
    for (std::size_t i = 0; i < spec.representations.size(); ++i) add(all, spec.representations[i].media_type, Variant::encoded(i));
  return all;
}

std::string readable_types(bool plain) {
  std::string list;
  const auto more = [&](std::string_view type) { list += (list.empty() ? "" : ", ") + std::string(type); };
  for (const rdf::Syntax s : rdf::available_syntaxes()) more(rdf::media_type(s));
  if (plain)
    for (const rdf::Plain p : {rdf::Plain::json, rdf::Plain::text, rdf::Plain::cbor}) more(rdf::media_type(p));
  return list;
}

bool may_have_graphs(rdf::Syntax syntax) noexcept { return rdf::has_named_graphs(syntax) || syntax == rdf::Syntax::json_ld; }

std::string GraphStore::dataset_types() {
  std::string list;
  for (const rdf::Syntax s : rdf::available_syntaxes())
    if (may_have_graphs(s)) list += (list.empty() ? "" : ", ") + std::string(rdf::media_type(s));
  return list;
}

std::string content_type(Variant variant, std::string_view media_type, std::string_view body) {
  return variant == Variant(rdf::Plain::text) ? std::string(media_type) + "; charset=utf-8" : charset::content_type(media_type, body);
}

std::string escaped(std::string_view text) { return percent_encoded(text, "/+"); }

std::string variant_iri(const std::string& resource, std::string_view media_type, std::size_t page) {
  const char* const first = resource.find('?') == std::string::npos ? "?" : "&";
  return resource + first + (page > 1 ? "page=" + std::to_string(page) + "&" : "") + "accept=" + escaped(media_type);
}

}  // namespace lrt::engine
