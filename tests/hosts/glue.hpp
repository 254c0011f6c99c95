// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/server.hpp>
#include <lrt/thing.hpp>

namespace flight {
class Parameters;
}
namespace motors {
class Motor;
}
namespace cell {
struct Program;
struct Status;
}  // namespace cell

// Each function is all that a host needs on the web. What it gets must live as long as the server.

lrt::Thing parameters_thing(flight::Parameters& values);
/// Adds the motor, and begins to run it.
void serve_motor(lrt::Server& server, const std::shared_ptr<motors::Motor>& motor);
lrt::Thing cell_thing(cell::Program& program, const cell::Status& status);
