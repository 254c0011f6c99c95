// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/client/description.hpp>
#include <lrt/codegen.hpp>

#include "src/codegen/cpp_text.hpp"
#include "src/codegen/kinds.hpp"

namespace lrt::codegen {

/// The sources of a header: kind of Thing, part, path of a field -> description.
using Parts = std::map<std::vector<std::string>, std::string>;

/// The names of the classes of kinds, in a scope from which types then take other ones.
std::vector<std::string> kind_names(const std::vector<ThingKind>& kinds, cpp::Scope& scope, const GenerateOptions& options);
Parts parts_of(const std::vector<ThingKind>& kinds, const std::vector<std::string>& names, const std::vector<client::ShapeDescription>& shapes);
/// The last lines of a header: comments with the parts, and a digest of them.
std::string list_of(const Parts& parts);
/// The parts of a header.
/// @par Errors  expected_value: there are none, or they have been changed
Result<Parts> read_list(std::string_view header);

}  // namespace lrt::codegen
