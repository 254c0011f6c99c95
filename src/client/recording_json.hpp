// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/client/recording.hpp>

#include "src/rdf/json_parse.hpp"

/// What a recorded change says besides its place and time, as members of a JSON object: the same in lines of JSON and in MCAP.
namespace lrt::client {
inline namespace v0 {
namespace detail {

/// Without the braces: `"value":0.27,"unit":"rad"`. The IRI and the robot are not among them.
LRT_INTERNAL_API std::string members_of(const RecordedChange& change);
/// Reads them, and the IRI and the robot.
/// @return  false: there is neither a value nor a gap
LRT_INTERNAL_API bool read_members(const rdf::json::Document& document, RecordedChange& change);
/// An object within limits; nullopt: it is damaged.
LRT_INTERNAL_API std::optional<rdf::json::Document> recorded_object(std::string_view json);

}  // namespace detail
}  // namespace v0
}  // namespace lrt::client
