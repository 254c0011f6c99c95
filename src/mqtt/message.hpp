// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/engine/feed.hpp>
#include <lrt/mqtt.hpp>

#include "src/mqtt/link.hpp"

namespace lrt::mqtt {
inline namespace v0 {

/// What is said of one value beside its representation.
struct Said {
  std::uint64_t sequence = 0;
  std::optional<std::chrono::system_clock::time_point> at{};  ///< when the value became what it is
  const engine::Meaning& meaning;
};

/// Sets payload, content type, payload format indicator and user properties of a message.
/// @param body  the representation; nullptr: empty
/// @pre with Form::with_meaning the media type is_json()
void say(OutMessage& message, std::shared_ptr<const std::string> body, const Publication& how, const Said& said);

/// Whether contents of a media type are texts in UTF-8, so that the payload format indicator may say so.
bool is_utf8(std::string_view media_type) noexcept;
/// application/json, or another type whose contents are JSON.
bool is_json(std::string_view media_type) noexcept;

/// About how many bytes a message takes on the wire.
std::size_t wire_bytes(const OutMessage& message) noexcept;

}  // namespace v0
}  // namespace lrt::mqtt
