// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace lrt::rdf {

/// "expected exactly one of moveJ, moveL; found moveJ and moveL". Many names are cut.
/// @param found  those that are present, not exactly one
std::string exactly_one_of(const std::vector<std::string>& names, const std::vector<std::string>& found);

}  // namespace lrt::rdf
