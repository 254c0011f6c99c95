// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// Options of Thing::control().
/// @par Threads  Distinct objects: any thread.
struct ControlOptions {
  /// Whether a command needs a lease. False: while no client has control, every client may command, within its rights.
  /// True: a command of a client without control gets 428, so that nobody moves the robot by accident.
  bool required = false;
};

}  // namespace v0
}  // namespace lrt
