// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/security.hpp>

namespace lrt::security {
inline namespace v0 {

/// The rights of one caller at each resource. Callers with equal rights share one object.
///
/// @par Threads  any, concurrently
class View {
 public:
  /// The paths of the rules; shared by the views of one policy.
  struct Targets {
    struct Target {
      std::string path;
      bool here = false, below = false;  ///< there are rules of that scope
    };
    std::vector<Target> all;
    std::unordered_map<std::string_view, std::size_t> by_path;  ///< index into `all`

    /// The path of the rules that count at a path and everywhere below it; empty: there are none. nullopt: rules name the path, or one below.
    std::optional<std::string> around(std::string_view path) const;
  };
  struct Granted {
    Rights here, below;
    friend bool operator==(const Granted& a, const Granted& b) noexcept { return a.here == b.here && a.below == b.below; }
  };

  /// A view with the same rights for each target.
  explicit View(Rights everywhere) noexcept : everywhere_(everywhere), anywhere_(everywhere), reads_everything_(everywhere.has(Right::read)) {}
  /// @param granted  for each target
  View(std::shared_ptr<const Targets> targets, std::vector<Granted> granted);

  /// @param path  percent-encoded, as resources have it. The resource need not exist
  Rights at(std::string_view path) const noexcept;
  /// Whether both grant the same rights at each path, though by other rules.
  bool grants_the_same_as(const View& other) const noexcept;
  /// The rights that it grants for at least one path.
  Rights anywhere() const noexcept { return anywhere_; }
  /// It grants reading at each path: nothing is hidden from its callers.
  bool reads_everything() const noexcept { return reads_everything_; }

 private:
  /// The rights at paths directly below that have no rules of their own.
  Rights below(std::string_view path) const noexcept;
  std::size_t target_of(std::string_view path) const noexcept;

  Rights everywhere_, anywhere_;
  bool reads_everything_ = false;
  std::shared_ptr<const Targets> targets_;  ///< nullptr: `everywhere_` counts
  std::vector<Granted> granted_;
};

/// Rules, and the views that callers have of them.
///
/// @par Threads  any, concurrently
class Policy {
 public:
  /// @par Errors  invalid_option: a path that no resource can have; a rule without a name or right
  static Result<std::shared_ptr<Policy>> create(const std::vector<Rule>& rules);
  /// @param principal  nullptr: a caller without credentials
  std::shared_ptr<const View> view(const Principal* principal);
  /// View::Targets::around(). What has the same rules around it has the same rights for every caller.
  std::optional<std::string> around(std::string_view path) const { return targets_->around(path); }

 private:
  struct Grant {
    std::size_t target;
    Scope scope;
    Who who;
    Rights rights;
  };
  Policy() = default;

  std::shared_ptr<const View::Targets> targets_;
  std::vector<Grant> grants_;
  std::mutex mutex_;                                                                     ///< guards the rest
  std::vector<std::pair<std::vector<View::Granted>, std::weak_ptr<const View>>> views_;  ///< those in use
};

}  // namespace v0
}  // namespace lrt::security
