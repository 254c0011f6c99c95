// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/client/recording.hpp>

#include "src/recording/bag.hpp"
#include "tools/lrt/command_line.hpp"

namespace lrt::tool {

/// What is recorded, and for how long.
struct RecordOptions {
  std::vector<std::string> words;
  std::string file, format;
  bool force = false, no_compression = false, json = false;
  client::Via via = client::Via::any;
  std::size_t queue = 1'000;  ///< the longest that a robot has by default
  std::optional<double> seconds;
  std::optional<std::size_t> count;
};

/// Properties of one or more robots, each of which is watched with a queue at the robot, so that each value counts: it is in the recording, or in a gap.
class Recorder {
 public:
  Recorder(Session& session, RecordOptions& options) : session_(session), options_(options) {}
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Finds the properties.
  Result<void> find();
  const std::vector<std::string>& robots() const noexcept { return robots_; }
  /// Whether the properties are of several origins.
  bool has_several_origins() const;

  /// Records until a signal, the end of the time or of the count, or the end of all watches. Does not end the file.
  /// @param start  when the recording began
  /// @return       the exit status
  Result<int> run(recording::BagWriter& file, std::chrono::steady_clock::time_point start);
  std::uint64_t values() const noexcept { return values_; }
  std::uint64_t gaps() const noexcept { return gaps_; }
  std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  struct Channel {
    client::Property property;
    std::string name, robot;
    std::optional<client::Schema> schema;
    client::Watch watch{};
    bool was_connected = false, has_ended = false, is_polled = false;
    bool is_refused = false;  ///< with this queue, before the first value
    std::size_t queue = 0;
    // The last value.
    bool has_value = false;
    client::GapBound last{};
    std::string series{};
    std::optional<client::Change> gap{};  ///< reported, and not written yet: its end is not known
  };
  Result<Client*> client();
  Result<void> add(const client::Property& property, const std::string& name, const std::string& robot);
  Result<void> add_thing(const client::Robot& robot, const std::string& url);
  Result<void> add_name(const client::Robot& robot, const std::string& name);
  Result<void> watch(std::size_t index);
  void take(std::size_t index, const client::Change& change);
  void write_gap(Channel& channel, client::RecordedChange gap);
  void write(const client::RecordedChange& change);
  /// Whether a robot may yet refuse the channel's queue: nothing was recorded, and each robot takes a shorter one.
  static bool may_refuse_queue(const Channel& channel);
  /// Whether the robot has: it is polled in the end.
  bool has_refused_queue(const Channel& channel) const;
  void check_protocols();
  void end_gaps();
  std::chrono::microseconds since_start(std::chrono::steady_clock::time_point time) const;

  Session& session_;
  RecordOptions& options_;
  std::optional<Client> client_;
  std::vector<std::string> robots_;
  std::deque<Channel> channels_;
  recording::BagWriter* file_ = nullptr;
  std::chrono::steady_clock::time_point start_{};
  std::uint64_t values_ = 0, gaps_ = 0, left_out_ = 0;
  std::optional<Error> error_;    ///< of the file
  std::optional<Error> refusal_;  ///< of a robot
};

}  // namespace lrt::tool
