// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/type.hpp>

#include "src/engine/resource.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

struct ThingNode;

/// The term that links a Thing to a resource that the user has given no predicate: "#Thing/battery".
std::string link_term(std::string_view name);

/// The server's own terms (SPEC 3.12): of C++ types without predicates or classes, and of properties without predicates. A term exists while
/// a Thing uses it.
class Vocabulary {
 public:
  /// Whether the Thing's terms mean what those of other Things mean.
  /// @par Errors  duplicate_path: another C++ type has the same name
  Result<void> check(const model::ThingSpec& thing) const;
  void add(const model::ThingSpec& thing);
  void remove(const model::ThingSpec& thing);
  /// Each term with its label, domain, range and unit.
  void describe(const Description& d) const;

 private:
  struct Use {
    const rdf::Type* type = nullptr;
    std::size_t count = 0;
  };
  std::map<std::string, Use> types_;           ///< by name
  std::map<std::string, std::size_t> linked_;  ///< names of properties, with the number of their uses
};

/// "/ns/vocabulary": the server's own terms.
class VocabularyResource final : public Resource {
 public:
  static constexpr const char* location = "/ns/vocabulary";
  explicit VocabularyResource(const Vocabulary& vocabulary) : Resource(location, nullptr), vocabulary_(vocabulary) {}
  void describe(const Description& d) const override { vocabulary_.describe(d); }
  void describe_types(About&, const Description&) const override {}
  const Variants& variants() const override { return graph_variants(); }
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"vocabulary", Trait::term_list};
    return kind;
  }

 private:
  const Vocabulary& vocabulary_;
};

}  // namespace v0
}  // namespace lrt::engine
