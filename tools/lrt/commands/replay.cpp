// SPDX-License-Identifier: Apache-2.0
#include <poll.h>

#include <algorithm>
#include <map>

#include <lrt/client/recording.hpp>
#include <lrt/client/units.hpp>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {

using std::chrono::microseconds;
using std::chrono::steady_clock;

namespace {

struct ReplayOptions {
  std::string file, to;
  double speed = 1;
  bool keep_going = false;
};

/// A property that is driven.
struct Driven {
  client::Property property;
  std::optional<client::Schema> schema;
};

/// The properties of a recording that can be written.
Result<std::map<std::string, Driven>> find(Session& session, const client::Recording& recording) {
  std::map<std::string, Driven> result;
  std::map<std::string, bool> seen;
  for (const client::RecordedChange& change : recording.changes()) {
    if (!seen.emplace(change.name, true).second) continue;
    const Result<client::Property> property = session.property(change.name);
    if (!property && property.error().code == Errc::unknown_path) {
      session.warn("\"" + change.name + "\" is left out: " + property.error().message);
      continue;
    }
    if (!property) return unexpected(property.error());
    const Result<bool> writable = property->is_writable();
    if (!writable) return unexpected(writable.error());
    if (!*writable) {
      session.warn("\"" + change.name + "\" is left out: it cannot be written");
      continue;
    }
    const Result<std::optional<client::Shape>> shape = property->shape();
    if (!shape) return unexpected(shape.error());
    result.emplace(change.name, Driven{*property, schema_of(shape)});
  }
  if (result.empty()) return unexpected(Errc::refused, "the robot has none of the properties of the recording, or none can be written");
  return result;
}

Result<void> write(const Driven& driven, const client::RecordedChange& change) {
  const std::vector<std::string_view>& units = client::known_units();
  const bool has_unit = std::find(units.begin(), units.end(), change.unit) != units.end();
  const Body body = has_unit ? Body{change.value + " " + change.unit, {}} : Body{change.value, "application/json"};
  const Result<Input> input = input_of(body, driven.property.url(), driven.schema);
  if (!input) return unexpected(input.error());
  return driven.property.write(input->graph, input->focus);
}

Result<int> replay(Session& session, ReplayOptions& options) {
  const Result<Body> file = body_of(options.file == "-" ? options.file : "@" + options.file, "text/plain");
  if (!file) return unexpected(file.error());
  const Result<client::Recording> recording = client::Recording::parse(file->bytes);
  if (!recording) return unexpected(recording.error().code, "\"" + options.file + "\": " + recording.error().message);
  if (!options.to.empty()) session.use_robot(options.to);
  if (session.options().robot.empty())
    return unexpected(Errc::invalid_option, "no robot is given: use --to URL; the recording is of " + recording->header().robot);
  if (const std::size_t damaged = recording->damaged_lines(); damaged > 0)
    session.warn("\"" + options.file + "\": " + std::to_string(damaged) +
                 (damaged == 1 ? " damaged line is left out" : " damaged lines are left out"));
  const Result<std::map<std::string, Driven>> driven = find(session, *recording);
  if (!driven) return unexpected(driven.error());

  Signals signals;
  client::Playback playback(*recording, options.speed);
  const auto start = steady_clock::now();
  std::size_t written = 0, skipped = 0, refused = 0;
  while (!playback.has_ended()) {
    const auto elapsed = std::chrono::duration_cast<microseconds>(steady_clock::now() - start);
    // If several values of one property are due, only the last one is sent, so that a slow robot does not get outdated values.
    std::vector<const client::RecordedChange*> due;
    while (const client::RecordedChange* const change = playback.next(elapsed)) {
      if (change->is_gap() || driven->count(change->name) == 0) continue;
      const auto older = std::find_if(due.begin(), due.end(), [&](const client::RecordedChange* other) { return other->name == change->name; });
      if (older != due.end()) {
        due.erase(older);
        ++skipped;
      }
      due.push_back(change);
    }
    for (const client::RecordedChange* const change : due) {
      const Result<void> done = write(driven->at(change->name), *change);
      if (done) {
        ++written;
        continue;
      }
      const std::string sentence =
          "\"" + change->name + "\" at " + std::to_string(static_cast<double>(change->at.count()) / 1e6) + " s: " + done.error().message;
      if (!options.keep_going || exit_of(done.error().code) == Exit::unreachable) return unexpected(done.error().code, sentence);
      session.warn(sentence);
      ++refused;
    }
    const auto now = std::chrono::duration_cast<microseconds>(steady_clock::now() - start);
    const auto pause = std::chrono::ceil<std::chrono::milliseconds>(playback.until_next(now));
    constexpr std::chrono::milliseconds longest{60'000};
    pollfd event{signals.descriptor(), POLLIN, 0};
    ::poll(&event, 1, static_cast<int>(std::min(pause, longest).count()));
    while (const int signal = signals.take())
      if (ends_command(signal)) return 128 + signal;
  }
  if (session.terminal().shows_progress())
    session.warn(std::to_string(written) + " values written" + (skipped > 0 ? ", " + std::to_string(skipped) + " were late and skipped" : ""));
  return refused > 0 ? Exit::failure : Exit::success;
}

}  // namespace

void add_replay(CommandLine& line) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* const command = line.add("replay", "Write the values of a recording to a robot, in the order and at the pace in which they came",
                                     "Properties that cannot be written are left out, and named on standard error. Examples:\n"
                                     "  lrt replay wave.jsonl --to http://127.0.0.1:8080/ --speed 0.5",
                                     options, replay);
  command->add_option("FILE", options->file, "A file of lrt record; - is standard input")->required()->type_name("FILE");
  command->add_option("--to", options->to, "A URL of the robot that is driven")->type_name("URL");
  command->add_option("--speed", options->speed, "2: twice as fast")->type_name("X")->check(CLI::Range(1e-6, 1e6));
  command->add_flag("-k,--keep-going", options->keep_going, "Go on after a value that the robot refuses");
}

}  // namespace lrt::tool
