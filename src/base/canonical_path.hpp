// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/result.hpp>

namespace lrt {

/// A path from the root with its segments percent-encoded in the one way that paths of resources are.
/// @par Errors  expected_iri: no resource can have such a path
Result<std::string> canonical_path(std::string_view path);

}  // namespace lrt
