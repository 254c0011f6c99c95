// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

/// The names of what subscribers get beside a representation (SPEC 3.6): the time of the value, its number, how many values were left out
/// before it, and the series of the numbers. Contents stay those of GET.
namespace lrt::http {

/// @{
/// Fields of an event, which WHATWG HTML 9.2.6 makes other clients ignore.
inline constexpr std::string_view event_time = "time", event_sequence = "sequence", event_left_out = "left-out";
/// @}
/// @{
/// Header fields of a web callback; the series also of the response that opens an event stream.
inline constexpr std::string_view time_field = "Value-Time", sequence_field = "Value-Sequence", left_out_field = "Values-Left-Out",
                                  series_field = "Value-Series";
/// @}
/// @{
/// Members of the JSON object that precedes each representation on a WebSocket with http::stamped_protocol.
inline constexpr std::string_view time_member = "time", sequence_member = "sequence", left_out_member = "leftOut", series_member = "series";
/// @}
/// Name of the event of a heartbeat, and of the only member of the JSON object that is one on a WebSocket with http::stamped_protocol: its value is the
/// time of the server (SPEC 3.20).
inline constexpr std::string_view heartbeat_name = "heartbeat";

}  // namespace lrt::http
