// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <lrt/rdf/unit.hpp>

namespace lrt::ros2 {

/// The unit with a code of UCUM ("m/s", "Cel"), or with an IRI of QUDT. An IRI that is not known here is a unit without a code.
/// The texts exist as long as the process.
/// @return  nullopt: no such unit
std::optional<Unit> find_unit(std::string_view name);

}  // namespace lrt::ros2
