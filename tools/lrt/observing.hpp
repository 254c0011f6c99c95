// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <lrt/client/watch.hpp>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {

/// Which properties are observed, how, and for how long: the common part of watch and record.
struct ObserveOptions {
  std::vector<std::string> words;
  client::Via via = client::Via::any;
  std::optional<double> seconds;
  std::optional<std::size_t> count;
};
/// The options of it.
void add_observe_options(CLI::App& command, ObserveOptions& options);

/// A change of a property, a gap, a silence of the server and its end, or an end.
struct Observed {
  enum class Kind : unsigned char { value, gap, silent, heard, ended };
  Kind kind = Kind::value;
  std::size_t property = 0;                                            ///< number of the name
  std::chrono::system_clock::time_point time{};                        ///< when it was received
  std::optional<std::chrono::system_clock::time_point> source_time{};  ///< by the clock of the robot, if it says it
  std::chrono::steady_clock::time_point received{};
  PlainValue value{};
  std::string reason{};  ///< of another kind than a value; printable
};
/// "gap", "silent", "heard" or "ended".
const char* name_of(Observed::Kind kind) noexcept;

/// The function that a command calls between changes.
struct ObserveHooks {
  std::function<bool(const Observed&)> on_change;  ///< false: enough
  std::function<void()> on_pause{};                ///< at least every `pause`, and after changes
  std::chrono::milliseconds pause{500};
  std::function<void(std::size_t property)> on_lost{};  ///< the connection; without it a message is printed on standard error
  std::function<void(int signal)> on_signal{};          ///< SIGWINCH, SIGCONT
  std::function<bool(char key)> on_key{};               ///< of standard input, if it is set; false: enough
};

/// Observes properties until a signal, the end of the time or of the count, or the end of all watches.
class Observer {
 public:
  Observer(Session& session, ObserveOptions& options) : session_(session), options_(options) {}

  /// Finds the properties.
  Result<void> find();
  std::size_t size() const noexcept { return properties_.size(); }
  /// As a person writes it: "right_s1/position".
  const std::string& name(std::size_t property) const { return names_[property]; }
  const std::string& url(std::size_t property) const { return properties_[property].url(); }
  /// The time since the last word of the robot, of the property for which it is longest; nullopt: there was none.
  std::optional<std::chrono::milliseconds> age() const;
  /// @return  the exit status
  Result<int> run(const ObserveHooks& hooks);

 private:
  void take(std::size_t property, const client::Change& change);
  void report_connections(const ObserveHooks& hooks);

  Session& session_;
  ObserveOptions& options_;
  std::vector<client::Property> properties_;
  std::vector<std::string> names_;
  std::vector<std::optional<client::Schema>> schemas_;
  std::vector<client::Watch> watches_;
  std::vector<bool> was_connected_, has_ended_;
  std::deque<Observed> changes_;
  std::optional<Error> refusal_;
};

/// "2026-11-23T15:31:19.123456Z"
std::string utc(std::chrono::system_clock::time_point time);
/// "15:31:19.123" of this place.
std::string time_of_day(std::chrono::system_clock::time_point time);

}  // namespace lrt::tool
