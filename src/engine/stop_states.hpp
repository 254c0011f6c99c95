// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/engine/handler.hpp>

#include "src/engine/context.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

class ActionResource;
class InvocationResource;
struct Parts;
struct ThingNode;

/// Finds out which Things are stopped, shows it, and ends what moves when they are. There is one once a Thing with a stop state has been added. What
/// is refused meanwhile is in stop_state.hpp.
class StopStates {
 public:
  virtual ~StopStates() = default;

  /// A Thing with a stop state was registered.
  virtual void add(ThingNode& thing) = 0;
  /// Before its removal.
  virtual void remove(ThingNode& thing) = 0;
  /// Logs what would be unavailable at Things that were added.
  virtual void report(const std::vector<std::string>& added) = 0;

  /// A stop was sent: it holds from now on, before its lambda runs.
  virtual void sent(ActionResource& stop, const Context& context) = 0;
  /// An invocation of a stop has ended.
  virtual void ended(ActionResource& stop, TimePoint now) = 0;
  /// The lambda of a release has succeeded: the invocation ends once the host has said whether the robot is still stopped.
  virtual void released(InvocationResource& release, TimePoint now) = 0;

  /// Reads the states that are due.
  virtual void advance(TimePoint now) = 0;
  virtual std::optional<std::chrono::steady_clock::time_point> next_deadline() const = 0;
};

/// What the engine has of the extension of a stop state.
class StopExtension : public model::StopExtension {
 public:
  /// @pre  it is an object of this class, as all are that ActionSetup::set_stop_state() names
  static const StopExtension& of(const model::StopStateSpec& spec) { return static_cast<const StopExtension&>(spec.extension); }

  virtual std::unique_ptr<StopStates> make(Parts& parts) const = 0;
  /// Checks the stop state of a Thing, and adds the Property "stopped" to it.
  virtual Result<void> complete(model::ThingSpec& thing) const = 0;

 protected:
  ~StopExtension() = default;
};

}  // namespace v0
}  // namespace lrt::engine
