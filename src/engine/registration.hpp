#pragma once

#include <memory>

#include <lrt/base/result.hpp>
#include <lrt/thing.hpp>

#include "src/engine/resources/thing.hpp"

namespace lrt::engine {

/// Judges what a user says of a Thing, and builds its resources. What could turn out to be invalid when it is written is refused here, once.
/// @par Errors  the thing's first error; closed, expected_iri, expected_rdf, expected_media_type, invalid_option, duplicate_path, limit_exceeded
Result<std::unique_ptr<ThingNode>> build_thing(Thing thing);

}  // namespace lrt::engine
