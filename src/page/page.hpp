// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/engine/page_source.hpp>

namespace lrt::page {

/// The console for people: HTML, style and script of this folder, which CMake puts into the library. The page is a client of the robot that serves it.
std::shared_ptr<const engine::PageSource> console();

}  // namespace lrt::page
