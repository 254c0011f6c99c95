// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/engine/page_source.hpp>

namespace lrt::page {

/// The HTML page for browsers: markup, style and script from this folder, embedded by CMake. The page is a client of the robot that serves it.
/// nullptr: the library was built without it.
std::shared_ptr<const engine::PageSource> console();

}  // namespace lrt::page
