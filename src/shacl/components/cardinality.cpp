// SPDX-License-Identifier: Apache-2.0
// SHACL 4.2 Cardinality Constraint Components

#include <lrt/rdf/vocab.hpp>

#include "src/shacl/components/all.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// SHACL 4.2.1 sh:minCount: the minimum number of value nodes. One xsd:integer, in property shapes.
class MinCount final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    if (const auto n = compiler.integer(shape, sh::minCount); n && *n > 0) compiler.add<MinCount>(shape, static_cast<std::uint64_t>(*n));
  }
  explicit MinCount(std::uint64_t min) noexcept : Constraint(sh::MinCountConstraintComponent), min_(min) {}

  void check(Run& run, const Scene& scene) const override {
    if (scene.size() >= min_) return;
    run.violation(scene, *this, std::nullopt, [&] {
      if (std::string text = list_violation(run, scene); !text.empty()) return text;
      const std::string words = expectation(run.plan(), scene.shape.id), name = for_name(run.plan(), scene.shape.id);
      const bool one = min_ == 1 && !(words.empty() && name.empty());
      return "expected " + (one ? (words.empty() ? "a value" : words) : "at least " + counted(min_, "value", "values")) + name + ", found " +
             (scene.size() == 0 ? "none" : std::to_string(scene.size()));
    });
  }

 private:
  std::uint64_t min_;
};

/// SHACL 4.2.2 sh:maxCount: the maximum number of value nodes. One xsd:integer, in property shapes.
class MaxCount final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    if (const auto n = compiler.integer(shape, sh::maxCount)) compiler.add<MaxCount>(shape, *n);
  }
  explicit MaxCount(std::int64_t max) noexcept : Constraint(sh::MaxCountConstraintComponent), max_(max) {}

  void check(Run& run, const Scene& scene) const override {
    if (static_cast<std::int64_t>(scene.size()) <= max_) return;
    run.violation(scene, *this, std::nullopt, [&] {
      if (std::string text = list_violation(run, scene); !text.empty()) return text;
      return (max_ <= 0 ? "expected no value" : "expected at most " + counted(static_cast<std::uint64_t>(max_), "value", "values")) +
             for_name(run.plan(), scene.shape.id) + ", found " + std::to_string(scene.size());
    });
  }

 private:
  std::int64_t max_;
};

}  // namespace

const Component components::min_count{{{sh::minCount, true}}, true, &MinCount::build};
const Component components::max_count{{{sh::maxCount, true}}, true, &MaxCount::build};

}  // namespace lrt::shacl
