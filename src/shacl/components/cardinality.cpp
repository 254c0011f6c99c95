// SHACL 4.2 Cardinality Constraint Components

#include <lrt/rdf/vocab.hpp>

#include "src/shacl/components/all.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/words.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// SHACL 4.2.1 sh:minCount: there are at least so many value nodes. One xsd:integer, in property shapes.
class MinCount final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    if (const auto n = compiler.integer(shape, sh::minCount); n && *n > 0)
      compiler.add<MinCount>(shape, static_cast<std::uint64_t>(*n));
  }
  explicit MinCount(std::uint64_t least) noexcept : Constraint(sh::MinCountConstraintComponent), least_(least) {}

  void check(Run& run, const Scene& scene) const override {
    if (scene.size() >= least_) return;
    run.violation(scene, *this, std::nullopt, [&] {
      return "expected at least " + counted(least_, "value", "values") + ", found " +
             (scene.size() == 0 ? "none" : std::to_string(scene.size()));
    });
  }

 private:
  std::uint64_t least_;
};

/// SHACL 4.2.2 sh:maxCount: there are at most so many value nodes. One xsd:integer, in property shapes.
class MaxCount final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    if (const auto n = compiler.integer(shape, sh::maxCount)) compiler.add<MaxCount>(shape, *n);
  }
  explicit MaxCount(std::int64_t most) noexcept : Constraint(sh::MaxCountConstraintComponent), most_(most) {}

  void check(Run& run, const Scene& scene) const override {
    if (static_cast<std::int64_t>(scene.size()) <= most_) return;
    run.violation(scene, *this, std::nullopt, [&] {
      return (most_ <= 0 ? "expected no value"
                         : "expected at most " + counted(static_cast<std::size_t>(most_), "value", "values")) +
             ", found " + std::to_string(scene.size());
    });
  }

 private:
  std::int64_t most_;
};

}  // namespace

const Component components::min_count{{{sh::minCount, true}}, true, &MinCount::build};
const Component components::max_count{{{sh::maxCount, true}}, true, &MaxCount::build};

}  // namespace lrt::shacl
