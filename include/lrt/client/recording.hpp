// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/plain.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>

/// Files of changes: what was observed of a robot, to be looked at or to drive the properties of a robot again.
///
/// A recording is lines of JSON (UTF-8, each ends with a line feed). The first is its header, each further one is a change:
///
///     {"lrt":"recording","version":1,"robot":"http://127.0.0.1:8080/","started":"2026-11-23T15:31:19Z"}
///     {"at":0.0123,"name":"right_s1/position","value":0.27,"unit":"rad"}
///     {"at":1.5,"name":"right_s1/position","gap":"the connection was lost"}
///
/// `at` is in seconds since the beginning. `value` is the value as Plain::json_with_units, `unit` the UCUM code of a number. `gap`: changes before this line may
/// be missing. Unknown members are ignored.
namespace lrt::client {
inline namespace v0 {

struct RecordedChange {
  std::chrono::microseconds at{0};
  std::string name{};   ///< by which Robot::property() finds it
  std::string value{};  ///< JSON; empty: a gap
  std::string unit{};   ///< UCUM code; empty: none
  std::string gap{};    ///< why changes may be missing

  bool is_gap() const noexcept { return value.empty(); }
};

struct RecordingHeader {
  std::string robot{};    ///< its URL
  std::string started{};  ///< xsd:dateTime
};

/// The lines of a recording, each with its line feed.
LRT_API std::string to_line(const RecordingHeader& header);
LRT_API std::string to_line(const RecordedChange& change);

struct RecordingLimits {
  std::size_t max_line_bytes = 1024 * 1024;  ///< a longer line counts as damaged
  std::size_t max_changes = 10'000'000;
  std::size_t max_bytes = 1024 * 1024 * 1024;
};

/// A recording that was read. A program that stops while it writes, or a disk that is full, leaves an incomplete line: damaged lines are left out and
/// counted, all others are read.
class LRT_API Recording {
 public:
  /// @par Errors  expected_value: the first line is no header, or one of a later version; limit_exceeded
  static Result<Recording> parse(std::string_view text, const RecordingLimits& limits = {});

  const RecordingHeader& header() const noexcept { return header_; }
  /// In the order of their times.
  const std::vector<RecordedChange>& changes() const noexcept { return changes_; }
  std::size_t damaged_lines() const noexcept { return damaged_lines_; }

 private:
  RecordingHeader header_;
  std::vector<RecordedChange> changes_;
  std::size_t damaged_lines_ = 0;
};

/// The value of a recorded change as a C++ value, for a robot that publishes it again:
///
///     while (const RecordedChange* change = playback.next(now - start))
///       if (change->name == "right_s1/position") position.publish(value_of<double>(*change).value());
///
/// @par Errors  expected_value: it is a gap, or no T; another unit is not converted, and an error
template <class T>
Result<T> value_of(const RecordedChange& change, const lrt::Unit& unit = lrt::unit::none) {
  if (change.is_gap()) return unexpected(Errc::expected_value, "the change is a gap and has no value");
  if (!unit.empty() && !change.unit.empty() && unit.ucum != change.unit)
    return unexpected(Errc::expected_value, "expected the unit " + std::string(unit.ucum) + ", found " + change.unit);
  rdf::Graph graph;
  const rdf::TermId focus = graph.intern(rdf::iri("urn:value"));
  const rdf::Facets facets = rdf::Facets(unit).allow_non_finite();
  constexpr std::size_t max_values = 1'000'000;
  constexpr std::string_view vocabulary = "urn:vocabulary";
  if (Result<void> read = rdf::read_plain(change.value, rdf::Plain::json, rdf::traits<T>::type(), facets, vocabulary, max_values, graph, focus);
      !read)
    return unexpected(std::move(read).error());
  std::vector<rdf::Mismatch> mismatches;
  Result<rdf::Value> value = rdf::read_value(graph, focus, rdf::traits<T>::type(), facets, vocabulary, mismatches);
  if (!value) return unexpected(std::move(value).error());
  return rdf::traits<T>::decode(*value);
}

/// Gives the changes of a recording when they are due. It has no clock: the caller says how much time has passed.
/// @par Time  next(), until_next(): constant.
class Playback {
 public:
  /// @param recording  must outlive this
  /// @param speed      2: twice as fast. @pre more than 0
  explicit Playback(const Recording& recording, double speed = 1) noexcept : changes_(recording.changes()), speed_(speed) {}

  /// The next change that is due after `elapsed`; nullptr: none is.
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
  bool has_ended() const noexcept { return at_ >= changes_.size(); }

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
