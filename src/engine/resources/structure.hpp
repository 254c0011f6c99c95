// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "src/engine/languages.hpp"
#include "src/engine/resource.hpp"

namespace lrt::engine {

class RepresentationCache;

inline namespace v0 {

struct EngineOptions;

/// "/ns/structure": what the robot is, without its values (SPEC 3.24). One document instead of one for each Thing, so that a client knows all names,
/// types and units after one request and need not ask again until something is added or removed: its entity tag depends on nothing else.
///
/// Things that look the same share the description of their resources. "Look the same" is judged by what the audience sees, so that no name, number
/// or hash depends on what is hidden from it.
///
/// It is cut into pages of whole Things. With a text it has only what the text finds: "/ns/structure?q=elbow".
class StructureResource final : public Resource, public Paged {
 public:
  static constexpr const char* location = "/ns/structure";
  /// Resources on a page: so many times Limits::max_page_members. An entry is short, and all Things of a large robot should fit into the first page.
  static constexpr std::size_t page_factor = 40;
  /// The longest text that can be searched.
  static constexpr std::size_t max_text_bytes = 256;

  /// @param text  that is searched; empty: everything
  StructureResource(const Registry& registry, RepresentationCache& cache, const EngineOptions& options, const std::string& text = {});
  ~StructureResource() override;

  /// The Things of a page as their own documents describe them.
  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"structure"};
    return kind;
  }
  void overview(Overview& o) const override;
  std::string up() const override { return "/"; }
  Paged* paged() noexcept override { return this; }

  std::size_t pages(const Audience& audience) const override;
  Result<Resource*> search(const std::string& text) override;

 private:
  struct Entry;
  struct Made;
  void for_each(const Audience& audience, FunctionRef<void(const Entry&, std::size_t page)> visit) const;
  bool select(const ThingNode& one, const Audience& audience, Entry& entry) const;
  Made make(Overview& o) const;
  const Made& made_for(Overview& o) const;

  const Registry& registry_;
  RepresentationCache& cache_;
  const EngineOptions& options_;
  const std::string text_;                                  ///< in lower case
  mutable std::unique_ptr<const Made> made_;                ///< the last one, if it has several pages
  std::list<std::unique_ptr<StructureResource>> searches_;  ///< with the texts searched last, the newest first
};

}  // namespace v0
}  // namespace lrt::engine
