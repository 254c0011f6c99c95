#pragma once

#include <cstdint>

namespace lrt::subscription {

/// Names a way by which messages go to one subscriber. Never 0, never used twice by one server.
enum class Channel : std::uint64_t {};

}  // namespace lrt::subscription
