// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/base/result.hpp>
#include <lrt/model/detail/spec.hpp>

#include "src/engine/resources/thing.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Judges what a user says of a Thing, and builds its resources. What could turn out to be invalid when it is written is refused here, once.
/// @param spec  is taken over, unless there is an error; nullptr: the Thing was given away already
/// @par Errors  the thing's first error; closed, expected_iri, expected_rdf, expected_media_type, invalid_option, duplicate_path, limit_exceeded
Result<std::unique_ptr<ThingNode>> build_thing(std::unique_ptr<model::ThingSpec>& spec);

/// The shapes that the user gave, with IRIs below placeholder_base.
/// @param blueprint_path  their base
/// @par Errors  expected_rdf
Result<rdf::Graph> read_shapes(const model::ThingSpec& spec, const std::string& blueprint_path);
/// What the user says in Turtle of an action's effect, with IRIs below placeholder_base.
/// @param path  of the action: their base
/// @par Errors  expected_rdf, also if `<#effect>` is not described
Result<rdf::Graph> read_effects(const model::ActionSpec& action, const std::string& path);

}  // namespace v0
}  // namespace lrt::engine
