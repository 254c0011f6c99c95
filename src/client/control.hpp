// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <lrt/base/result.hpp>
#include <lrt/client/control.hpp>

#include "src/client/session.hpp"

namespace lrt::client {
inline namespace v0 {

/// Takes control of a Thing with this URL.
Result<Control> take_control(const std::shared_ptr<Session>& session, const std::string& thing, const ControlOptions& options, OnControlLost on_lost);

}  // namespace v0
}  // namespace lrt::client
