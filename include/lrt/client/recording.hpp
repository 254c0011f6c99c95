// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/unit.hpp>
#include <lrt/rdf/value.hpp>

/// Files of changes: recorded values of robots, for inspection or to publish them again.
///
/// A recording is lines of JSON (UTF-8, each ends with a line feed). The first is its header, each further one is a
/// change (wrapped here):
///
///     {"lrt":"recording","version":2,"robot":"http://127.0.0.1:8080/","started":"2026-11-23T15:31:19Z"}
///     {"at":0.0123,"name":"right_s1/position","url":"http://127.0.0.1:8080/baxter/right_s1/position","value":0.27,
///      "unit":"rad","sourceTime":"2026-11-23T15:31:19.010250Z","sequence":17,"series":"1795881552.3"}
///     {"at":1.5,"name":"right_s1/position","url":"http://127.0.0.1:8080/baxter/right_s1/position",
///      "gap":"the connection was lost; 12 values are missing","cause":"connection","leftOut":12,
///      "from":{"sequence":17,"time":"2026-11-23T15:31:19.010250Z"},"to":{"sequence":30,"time":"2026-11-23T15:31:20.1Z"}}
///
/// `at` is in seconds since the beginning, by the clock of the recording program. `url` is the IRI of the property. If there are several robots, the
/// header names them all in `robots`, and a change of another one than `robot` names its own. `value` is JSON; within it a number has its unit,
/// {"value": 43.6, "unit": "deg"}; `unit` is the UCUM code of a number. `sourceTime` is the time of the value by the clock of the robot, `sequence` its
/// number among the changes of its property, and `series` tells the numbers of one run of the robot from those of the next; each only if the robot says
/// it. `series` is that of the value of this property before, if it is missing.
///
/// `gap`: changes between two values are missing, or may be. `cause` is one of those of GapCause. `leftOut` is their number, if it is known. `from` is
/// the last value before the gap and `to` the first one after it. Unknown members are ignored. Version 1 has no `url`, `robots`, `sequence`, `series`,
/// `cause`, `leftOut`, `from` and `to`; it is read as well.
namespace lrt::client {
inline namespace v0 {

/// Why changes are missing.
enum class GapCause : unsigned char {
  unknown,     ///< not said
  connection,  ///< "connection": it was lost
  restart,     ///< "restart": the robot was started again, and numbers anew
  left_out,    ///< "left out": the robot did not send all, because its queue for this receiver was too short
  not_taken,   ///< "not taken": the recording program was too slow
  polled,      ///< "polled": the robot offers no subscription, and was asked at intervals
  ended,       ///< "ended": the robot has ended the subscription
};

/// A value at one end of a gap; what is not known is nullopt.
struct GapBound {
  std::optional<std::uint64_t> sequence{};                             ///< its number
  std::optional<std::chrono::system_clock::time_point> source_time{};  ///< by the clock of the robot
};

/// One change of a recording.
struct RecordedChange {
  std::chrono::microseconds at{0};  ///< since the beginning of the recording
  std::string name{};               ///< name for Robot::property()
  std::string value{};              ///< JSON; empty: a gap
  std::string unit{};               ///< UCUM code; empty: none
  std::string gap{};                ///< the reason why changes may be missing
  /// When the value became what it is, by the clock of the robot; nullopt: it did not say it. Pass it to
  /// PushedProperty::publish() to keep the time.
  std::optional<std::chrono::system_clock::time_point> source_time{};
  std::string url{};                        ///< IRI of the property; empty: not known
  std::string robot{};                      ///< URL of its robot; empty: that of the header
  std::optional<std::uint64_t> sequence{};  ///< of a value: its number among the changes of its property; nullopt: not known
  std::string series{};                     ///< of the sequence; numbers of different series cannot be compared
  GapCause cause = GapCause::unknown;       ///< of a gap
  std::optional<std::uint64_t> left_out{};  ///< of a gap: the number of missing values; nullopt: not known
  GapBound from{};                          ///< of a gap: the last value before it
  GapBound to{};                            ///< of a gap: the first value after it

  bool is_gap() const noexcept { return value.empty(); }  ///< whether it has no value
};

/// The first line of a recording.
struct RecordingHeader {
  std::string robot{};                ///< its URL
  std::string started{};              ///< xsd:dateTime
  std::vector<std::string> robots{};  ///< URLs of all robots, if there are several
};

/// @{
/// A line of a recording, with its line feed.
/// @par Threads  Any.
LRT_API std::string to_line(const RecordingHeader& header);
LRT_API std::string to_line(const RecordedChange& change);
/// @}

/// @{
/// "left out"
/// @par Threads  Any.
LRT_API std::string_view to_string(GapCause cause) noexcept;
LRT_API GapCause gap_cause_of(std::string_view text) noexcept;  ///< unknown: another text
/// @}

/// Reads a recording line by line, for files that do not fit into memory.
/// @par Threads  One thread at a time.
class LRT_API RecordingLines {
 public:
  /// Reads the first line.
  /// @par Errors  expected_value: it is not a header, or is one of a later version
  static Result<RecordingLines> begin(std::string_view line);

  const RecordingHeader& header() const noexcept { return header_; }  ///< the first line
  unsigned version() const noexcept { return version_; }              ///< 1 or 2
  /// Reads a further line, with or without its line feed. nullopt: it is damaged.
  std::optional<RecordedChange> read(std::string_view line);

 private:
  RecordingHeader header_;
  unsigned version_ = 0;
  std::map<std::string, std::string> series_;  // by the IRI or name of the property
};

/// Limits of Recording::parse().
struct RecordingLimits {
  std::size_t max_line_bytes = 1024 * 1024;    ///< a longer line counts as damaged
  std::size_t max_changes = 10'000'000;        ///< more: limit_exceeded
  std::size_t max_bytes = 1024 * 1024 * 1024;  ///< of the text; more: limit_exceeded
};

/// A recording that was read. If the recording program stops while it writes, or the disk is full, a line is
/// incomplete. Damaged lines are left out and counted; all others are read.
/// @par Threads  Distinct objects: any thread. One object: any number of reading threads.
class LRT_API Recording {
 public:
  /// Reads a recording.
  /// @par Errors  expected_value: the first line is not a header, or is one of a later version; limit_exceeded
  static Result<Recording> parse(std::string_view text, const RecordingLimits& limits = {});

  const RecordingHeader& header() const noexcept { return header_; }  ///< the first line
  /// The changes in the order of their times.
  const std::vector<RecordedChange>& changes() const noexcept { return changes_; }
  std::size_t damaged_lines() const noexcept { return damaged_lines_; }  ///< number of lines that were left out

 private:
  RecordingHeader header_;
  std::vector<RecordedChange> changes_;
  std::size_t damaged_lines_ = 0;
};

/// @cond internal
namespace detail {
LRT_API Result<rdf::Value> read_json(std::string_view json, const rdf::Type& type, const rdf::Facets& facets);
}
/// @endcond

/// Decodes the value of a recorded change, for a robot that publishes it again:
///
///     while (const RecordedChange* change = playback.next(now - start))
///       if (change->name == "right_s1/position") position.publish(value_of<double>(*change).value());
///
/// @tparam T      type of the value, with rdf::traits<T>
/// @param change  the change
/// @param unit    unit of the numbers; unit::none: any
/// @par Errors  expected_value: the change is a gap, its value is not a T, or it has another unit, which is not
///              converted
template <class T>
Result<T> value_of(const RecordedChange& change, const lrt::Unit& unit = lrt::unit::none) {
  if (change.is_gap()) return unexpected(Errc::expected_value, "the change is a gap and has no value");
  if (!unit.empty() && !change.unit.empty() && unit.ucum != change.unit)
    return unexpected(Errc::expected_value, "expected the unit " + std::string(unit.ucum) + ", found " + change.unit);
  Result<rdf::Value> value = detail::read_json(change.value, rdf::traits<T>::type(), rdf::Facets(unit).allow_non_finite());
  if (!value) return unexpected(std::move(value).error());
  return rdf::traits<T>::decode(*value);
}

/// Returns the changes of a recording when they are due. It has no clock: the caller passes the elapsed time.
/// @par Threads  One thread at a time.
/// @par Time     next(), until_next(): constant.
class Playback {
 public:
  /// @param recording  must outlive this
  /// @param speed      2: twice as fast. @pre more than 0
  explicit Playback(const Recording& recording, double speed = 1) noexcept : changes_(recording.changes()), speed_(speed) {}

  /// The next change that is due at `elapsed`; nullptr: none is due.
  const RecordedChange* next(std::chrono::microseconds elapsed) noexcept {
    if (has_ended() || due(changes_[at_]) > elapsed) return nullptr;
    return &changes_[at_++];
  }
  /// The time until the next change; zero if one is due or none is left.
  std::chrono::microseconds until_next(std::chrono::microseconds elapsed) const noexcept {
    if (has_ended()) return {};
    const std::chrono::microseconds when = due(changes_[at_]);
    return when > elapsed ? when - elapsed : std::chrono::microseconds(0);
  }
  bool has_ended() const noexcept { return at_ >= changes_.size(); }  ///< whether all changes were returned

 private:
  std::chrono::microseconds due(const RecordedChange& change) const noexcept {
    constexpr double longest = 9e18;
    const double when = static_cast<double>(change.at.count()) / speed_;
    return std::chrono::microseconds(when < longest ? static_cast<std::chrono::microseconds::rep>(when) : std::chrono::microseconds::max().count());
  }

  const std::vector<RecordedChange>& changes_;
  const double speed_;
  std::size_t at_ = 0;
};

}  // namespace v0
}  // namespace lrt::client
