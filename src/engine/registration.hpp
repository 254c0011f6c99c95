// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lrt/base/result.hpp>

#include "src/engine/resources/thing.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {

/// Validates the registration of a Thing and builds its resources. Errors that would otherwise appear when a document is written are found here.
/// @param spec  is moved from, unless there is an error; nullptr: the Thing was already moved
/// @par Errors  the thing's first error; closed, expected_iri, expected_rdf, expected_media_type, invalid_option, duplicate_path, limit_exceeded
Result<std::unique_ptr<ThingNode>> build_thing(std::unique_ptr<model::ThingSpec>& spec);
/// @par Errors  invalid_option: a lambda needs Threads::executor
Result<void> check_without_executor(const model::ThingSpec& spec);

/// The shapes that the user gave, with IRIs below placeholder_base.
/// @param blueprint_path  their base
/// @par Errors  expected_rdf
Result<rdf::Graph> read_shapes(const model::ThingSpec& spec, const std::string& blueprint_path);
/// The same of some of them.
Result<rdf::Graph> read_shapes(const model::ThingSpec& spec, const std::vector<std::string>& texts, const std::string& blueprint_path);
/// The user's Turtle about the effect of an action, with IRIs below placeholder_base.
/// @param path  of the action: their base
/// @par Errors  expected_rdf, also if `<#effect>` is not described
Result<rdf::Graph> read_effects(const model::ActionSpec& action, const std::string& path);

}  // namespace lrt::engine
