// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/model/statement.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

#include "src/engine/description.hpp"
#include "src/engine/languages.hpp"
#include "src/engine/resource.hpp"
#include "src/model/plain_name.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Writes the JSON of a resource that has no plain value: what it is, and what it links to (README, "Values without RDF").
///
/// A resource is an object with `href`, `kind`, `methods` and what its kind has; a link to it is the same object with fewer members. The types of
/// values are JSON Schemas.
class Overview {
 public:
  /// @param texts  chooses of texts in several languages
  Overview(const EngineView& engine, std::size_t base, const Audience& audience, std::size_t page, ChosenTexts& texts);

  /// The complete overview of the resource.
  std::string of(const Resource& resource);

  /// A link, if the audience may see its target. An empty key: within an array.
  void link(std::string_view key, const Resource& to);
  void link(std::string_view key, const std::string& href, std::string_view kind);
  /// Links by the paths that resources have below their thing.
  template <class Resources>
  void links(std::string_view key, const Resources& resources) {
    begin_object(key);
    for (const auto& r : resources) link(model::plain_name(r->spec->path), *r);
    end_object();
  }
  /// The members of a container on this page, how many there are, and the pages before and after.
  void members(std::string_view key, const Resource& container);

  /// Nothing for an empty text.
  void text(std::string_view key, std::string_view value);
  void texts(std::string_view key, const std::vector<std::string>& values);
  /// `title` and `description`.
  void words(const rdf::Words& words);
  /// The same, and if a text is in several languages also `titles` and `descriptions`, which have it by language.
  void all_words(const rdf::Words& words);
  /// `types`: the given classes, and those of a record.
  void types(const std::vector<std::string>& classes, const rdf::Type* type);
  void number(std::string_view key, std::uint64_t value) { json(key, std::to_string(value)); }
  void json(std::string_view key, std::string_view written);
  /// Nothing if there is no type.
  void schema(std::string_view key, const rdf::Type* type, const rdf::Facets& facets);
  /// Title and description among the user's triples, and the domain types: the user's and those of a record.
  void described(const std::vector<Statement>& statements, const std::vector<std::string>& classes, const rdf::Type* type);
  /// Where the pages before and after this one are.
  void pages_around(const Resource& resource, std::size_t page, std::size_t pages);
  const EngineOptions& options() const noexcept { return engine_.options; }
  const Registry& registry() const noexcept { return engine_.registry; }
  const std::string& base() const noexcept { return base_; }
  const Audience& audience() const noexcept { return audience_; }
  std::size_t page() const noexcept { return page_; }
  ChosenTexts& texts() noexcept { return texts_; }
  std::string vocabulary() const { return engine_.vocabulary(base_); }
  bool sees(const Resource& resource) const { return audience_.sees(resource); }
  bool sees_iri(const std::string& iri) const { return audience_.sees_iri(iri, base_, engine_.registry); }
  Methods methods(const Resource& resource) const { return audience_.methods(resource); }
  std::string iri(const Resource& resource) const { return base_ + resource.path; }
  std::string iri(const Object& object) const;

  /// An object that is not a part of what was written so far.
  template <class Members>
  std::string apart(Members write_members) {
    std::string before = std::exchange(out_, {});
    begin_object({});
    write_members();
    end_object();
    return std::exchange(out_, std::move(before));
  }
  void begin_object(std::string_view key) { begin(key, '{'); }
  void end_object() { end('}'); }
  void begin_array(std::string_view key) { begin(key, '['); }
  void end_array() { end(']'); }

 private:
  void summary(const Resource& resource);
  void all_texts(std::string_view one, std::string_view several, const rdf::Texts& texts);
  void separate(std::string_view key);
  void begin(std::string_view key, char bracket);
  void end(char bracket) { out_ += bracket; }

  const EngineView& engine_;
  const std::string& base_;
  const Audience& audience_;
  std::size_t page_;
  ChosenTexts& texts_;
  std::string out_;
};

}  // namespace v0
}  // namespace lrt::engine
