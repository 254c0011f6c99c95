// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/client/recording.hpp>

/// Recordings of robots as files: lines of JSON (lrt/client/recording.hpp) or MCAP, with the same content.
///
/// In MCAP each property of each robot is a channel. Its messages are JSON objects: `value` and the other members of a line. log_time is when the value
/// arrived, publish_time when it became what it is, by the clock of the robot if it says it. Gaps are messages of a channel of their own. Metadata
/// records have the robots, and at the end what was counted for each property.
namespace lrt::recording {

enum class Format : unsigned char { json_lines, mcap };
std::string_view to_string(Format format) noexcept;  ///< "lines of JSON", "MCAP"

/// Writes a recording. A file that was not ended is readable up to the last line, or the last chunk of at most 1 MiB and one second.
/// @par Errors   those of the sink
/// @par Threads  One thread at a time.
class BagWriter {
 public:
  using Sink = std::function<Result<void>(std::string_view)>;
  BagWriter() = default;
  virtual ~BagWriter() = default;
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  /// States the JSON Schema of the values of a property, by its IRI, before its first value. Otherwise a file of MCAP has what that value shows.
  virtual void describe(const std::string& url, std::string value_schema) = 0;
  virtual Result<void> add(const client::RecordedChange& change) = 0;
  /// Writes what is older than a second, if it is not written yet.
  /// @param at  since the beginning
  virtual Result<void> flush_older(std::chrono::microseconds at) = 0;
  virtual Result<void> end() = 0;
};

struct BagWriterOptions {
  Format format = Format::json_lines;
  bool compress = true;  ///< of MCAP
  /// Of MCAP: whether topics are IRIs, because the properties are of several origins. Otherwise they are the paths of the IRIs.
  bool topics_are_iris = true;
  std::chrono::system_clock::time_point started{};  ///< of the header, exactly
};
/// Writes the header, too.
Result<std::unique_ptr<BagWriter>> begin_bag(const client::RecordingHeader& header, const BagWriterOptions& options, BagWriter::Sink sink);

/// Which changes are wanted, in microseconds since the beginning, by their arrival. Inclusive.
struct BagRange {
  std::chrono::microseconds from{0};
  std::chrono::microseconds until = std::chrono::microseconds::max();
};
/// A bound of a range as people write it: seconds since the beginning, or a time as xsd:dateTime.
/// @par Errors  expected_value
Result<std::chrono::microseconds> parse_bound(std::string_view text, const client::RecordingHeader& header);

struct BagLimits {
  std::size_t max_line_bytes = 4 * 1024 * 1024;  ///< a longer line counts as damaged
};

struct BagReport {
  Format format = Format::json_lines;
  client::RecordingHeader header{};
  unsigned version = 0;     ///< of lines of JSON
  bool is_complete = true;  ///< its last line or part is there
  std::uint64_t bytes = 0;
  std::uint64_t damaged = 0;  ///< lines, records, chunks and messages that were left out
  std::string compression{};  ///< of MCAP; empty: none
  std::string problem{};      ///< of the first damaged one, or why the file is not complete
};

/// Reads a recording of either format, which its first bytes tell, from the beginning to the end. Hostile input: memory is within limits that are less
/// than 300 MiB.
/// @param read   fills a buffer, at least with one byte; 0: the end
/// @param range  called once with the header, for bounds that are times
/// @param on_change  an error ends the reading and is returned
/// @par Errors  expected_value: it is no recording, or one of a later version; those of the three functions
Result<BagReport> read_bag(const std::function<Result<std::size_t>(char*, std::size_t)>& read,
                           const std::function<Result<BagRange>(const client::RecordingHeader&)>& range,
                           const std::function<Result<void>(client::RecordedChange&&)>& on_change, const BagLimits& limits = {});

/// What a recording has of one property.
struct PropertySummary {
  std::string name, url, robot, unit;
  std::uint64_t values = 0, gaps = 0;
  std::uint64_t left_out = 0;      ///< sum of the gaps whose number is known
  std::uint64_t gaps_unknown = 0;  ///< gaps whose number is not known
  std::uint64_t series = 0;        ///< how often the robot began to number
  std::string last_series{};
  std::optional<std::chrono::microseconds> first{}, last{};                            ///< arrival of values
  std::optional<std::chrono::system_clock::time_point> first_source{}, last_source{};  ///< by the clock of the robot
};
/// Counts what a recording has. Memory grows with the properties, of which there can be 100,000.
class Summary {
 public:
  void add(const client::RecordedChange& change);
  const std::vector<PropertySummary>& properties() const noexcept { return properties_; }
  bool is_full() const noexcept { return is_full_; }  ///< there were more properties, which were not counted

 private:
  std::vector<PropertySummary> properties_;
  std::map<std::string, std::size_t> index_;
  bool is_full_ = false;
};

/// Whether a name fits a pattern, in which * stands for any characters.
bool fits(std::string_view name, std::string_view pattern) noexcept;

/// Which properties of a recording are wanted, and as what.
struct Selection {
  std::vector<std::string> patterns;                         ///< names or IRIs, with *; empty: all
  std::vector<std::pair<std::string, std::string>> renames;  ///< a name or an IRI, or the beginning of one up to a '/', and what replaces it
  bool selects(const client::RecordedChange& change) const noexcept;
  /// The name with which a change is looked for.
  std::string name_of(const client::RecordedChange& change) const;
};

/// The values of a recording in the order in which they are published again.
///
/// They are ordered by the times of their robots where all have one, so that what the network or the recording program has delayed or mixed up is put
/// right. Clocks of several robots may differ: the value of each robot that took the shortest time to arrive is taken to have arrived at once. Without
/// times of the robots, or if it is wanted, the values are ordered by arrival.
class ReplayPlan {
 public:
  struct Step {
    std::chrono::microseconds due{0};  ///< since the first one
    std::size_t target = 0;            ///< number of the name
    std::string value, unit;
    std::chrono::microseconds at{0};  ///< in the recording
  };
  struct Target {
    std::string name;  ///< after renaming
    bool is_renamed = false;
    std::string url;    ///< in the recording
    std::string robot;  ///< in the recording
  };

  ReplayPlan(Selection selection, std::size_t max_bytes) : selection_(std::move(selection)), max_bytes_(max_bytes) {}
  /// @par Errors  limit_exceeded; expected_value: properties of two robots have the same name
  Result<void> add(const client::RecordedChange& change);
  /// Orders the steps. Call it once, after the last add().
  void finish(bool by_arrival);

  const std::vector<Target>& targets() const noexcept { return targets_; }
  const std::vector<Step>& steps() const noexcept { return steps_; }
  bool by_source_time() const noexcept { return by_source_time_; }
  std::uint64_t gaps() const noexcept { return gaps_; }  ///< gaps among the selected changes

 private:
  struct Time {
    std::optional<std::chrono::microseconds> source;
  };
  Selection selection_;
  std::size_t max_bytes_, bytes_ = 0;
  std::vector<Target> targets_;
  std::map<std::string, std::size_t> by_name_;
  std::vector<Step> steps_;
  std::vector<Time> times_;
  std::map<std::string, std::chrono::microseconds> shortest_;  // by robot: between the time of a value and its arrival
  bool by_source_time_ = true;
  std::uint64_t gaps_ = 0;
};

}  // namespace lrt::recording
