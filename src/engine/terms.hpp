// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace lrt::engine {

/// The term list of lrt and of the part of hybrit that it uses, as Turtle: src/engine/terms.ttl, put into the library by CMake.
std::string_view term_list() noexcept;

}  // namespace lrt::engine
