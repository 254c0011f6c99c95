// SPDX-License-Identifier: Apache-2.0
#include <poll.h>

#include <algorithm>

#include <lrt/client/recording.hpp>
#include <lrt/client/units.hpp>

#include "src/recording/bag.hpp"
#include "tools/lrt/bag_file.hpp"
#include "tools/lrt/command_line.hpp"

namespace lrt::tool {

using recording::ReplayPlan;
using std::chrono::microseconds;
using std::chrono::steady_clock;

namespace {

/// Of the values of a recording that are replayed.
constexpr std::size_t max_bytes = std::size_t{1024} * 1024 * 1024;

struct ReplayOptions {
  std::string file, to, from, until;
  std::vector<std::string> select, rename;
  double speed = 1;
  bool keep_going = false, by_arrival = false, dry_run = false;
};

/// A property that is driven.
struct Driven {
  client::Property property;
  std::optional<client::Schema> schema;
};

/// "baxter/right_s1/position" of "http://robot/baxter/right_s1/position".
std::string path_of(const std::string& url) {
  const std::size_t host = url.find("://");
  const std::size_t path = host == std::string::npos ? host : url.find('/', host + 3);
  return path == std::string::npos ? std::string() : url.substr(path + 1);
}

/// The properties of a plan that can be written, by the number of their name.
Result<std::vector<std::optional<Driven>>> find(Session& session, const ReplayPlan& plan) {
  std::vector<std::optional<Driven>> result;
  for (const ReplayPlan::Target& target : plan.targets()) {
    result.emplace_back();
    Result<client::Property> property = session.property(target.name);
    // A name may be ambiguous, or another one in the language of this robot; a path is neither.
    if (const std::string path = target.is_renamed ? std::string() : path_of(target.url);
        !property && !path.empty() && (property.error().code == Errc::unknown_path || property.error().code == Errc::expected_value)) {
      Result<client::Property> by_path = session.property(path);
      if (by_path) property = std::move(by_path);
    }
    if (!property && property.error().code == Errc::unknown_path) {
      session.warn("\"" + target.name + "\" is left out: " + property.error().message);
      continue;
    }
    if (!property) return unexpected(property.error());
    const Result<bool> writable = property->is_writable();
    if (!writable) return unexpected(writable.error());
    if (!*writable) {
      session.warn("\"" + target.name + "\" is left out: it cannot be written");
      continue;
    }
    const Result<std::optional<client::Shape>> shape = property->shape();
    if (!shape) return unexpected(shape.error());
    result.back() = Driven{*property, schema_of(shape)};
  }
  if (std::none_of(result.begin(), result.end(), [](const auto& driven) { return driven.has_value(); }))
    return unexpected(Errc::refused, "the robot has none of the properties of the recording, or none can be written");
  return result;
}

Result<void> write(const Driven& driven, const ReplayPlan::Step& step) {
  const std::vector<std::string_view>& units = client::known_units();
  const bool has_unit = std::find(units.begin(), units.end(), step.unit) != units.end();
  const Body body = has_unit ? Body{step.value + " " + step.unit, {}} : Body{step.value, "application/json"};
  const Result<Input> input = input_of(body, driven.property.url(), driven.schema);
  if (!input) return unexpected(input.error());
  return driven.property.write(input->graph, input->focus);
}

Result<recording::Selection> selection_of(const ReplayOptions& options) {
  recording::Selection selection;
  selection.patterns = options.select;
  for (const std::string& text : options.rename) {
    const std::size_t equals = text.rfind('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
      return unexpected(Errc::invalid_option, "--rename \"" + text + "\": expected OLD=NEW");
    selection.renames.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return selection;
}

std::string seconds_text(microseconds time) { return std::to_string(static_cast<double>(time.count()) / 1e6); }

Result<int> replay(Session& session, ReplayOptions& options) {
  Result<recording::Selection> selection = selection_of(options);
  if (!selection) return unexpected(std::move(selection).error());
  InputFile file;
  if (Result<void> opened = file.open(options.file); !opened) return unexpected(std::move(opened).error());
  ReplayPlan plan(*std::move(selection), max_bytes);
  const Result<recording::BagReport> read = recording::read_bag(
      file.source(),
      [&](const client::RecordingHeader& header) -> Result<recording::BagRange> {
        recording::BagRange range;
        for (const auto& [text, bound] : {std::pair{&options.from, &range.from}, std::pair{&options.until, &range.until}}) {
          if (text->empty()) continue;
          const Result<microseconds> time = recording::parse_bound(*text, header);
          if (!time) return unexpected(Errc::invalid_option, time.error().message);
          *bound = *time;
        }
        return range;
      },
      [&](client::RecordedChange&& change) { return plan.add(change); });
  if (!read) return unexpected(read.error().code, "\"" + options.file + "\": " + read.error().message);
  plan.finish(options.by_arrival);
  if (!options.to.empty()) session.use_robot(options.to);
  if (session.options().robot.empty() && !options.dry_run)
    return unexpected(Errc::invalid_option, "no robot is given: use --to URL; the recording is of " + read->header.robot);
  if (read->damaged > 0)
    session.warn("\"" + options.file + "\": " + std::to_string(read->damaged) +
                 (read->format == recording::Format::mcap ? " damaged part" : " damaged line") +
                 (read->damaged == 1 ? " is left out" : "s are left out"));
  if (!read->is_complete && read->format == recording::Format::mcap)
    session.warn("\"" + options.file + "\": " + read->problem + "; what is before it is replayed");
  if (plan.steps().empty()) return unexpected(Errc::refused, "\"" + options.file + "\" has no such values");
  if (options.dry_run) {
    Terminal& terminal = session.terminal();
    for (const ReplayPlan::Step& step : plan.steps())
      if (!terminal.print_line(seconds_text(step.due) + "\t" + printable(plan.targets()[step.target].name) + "\t" + printable_json(step.value) +
                               "\t" + printable(step.unit)))
        break;
    return Exit::success;
  }
  const Result<std::vector<std::optional<Driven>>> driven = find(session, plan);
  if (!driven) return unexpected(driven.error());

  Signals signals;
  const auto start = steady_clock::now();
  const auto due_of = [&](const ReplayPlan::Step& step) {
    constexpr double longest = 9e15;  // microseconds
    return microseconds(static_cast<std::int64_t>(std::min(static_cast<double>(step.due.count()) / options.speed, longest)));
  };
  const std::vector<ReplayPlan::Step>& steps = plan.steps();
  std::size_t next = 0, written = 0, skipped = 0, refused = 0;
  while (next < steps.size()) {
    const auto elapsed = std::chrono::duration_cast<microseconds>(steady_clock::now() - start);
    // If several values of one property are due, only the last one is sent, so that a slow robot does not get outdated values.
    std::vector<const ReplayPlan::Step*> due;
    for (; next < steps.size() && due_of(steps[next]) <= elapsed; ++next) {
      const ReplayPlan::Step& step = steps[next];
      if (!(*driven)[step.target]) continue;
      const auto older = std::find_if(due.begin(), due.end(), [&](const ReplayPlan::Step* other) { return other->target == step.target; });
      if (older != due.end()) {
        due.erase(older);
        ++skipped;
      }
      due.push_back(&step);
    }
    for (const ReplayPlan::Step* const step : due) {
      const Result<void> done = write(*(*driven)[step->target], *step);
      if (done) {
        ++written;
        continue;
      }
      const std::string sentence = "\"" + plan.targets()[step->target].name + "\" at " + seconds_text(step->at) + " s: " + done.error().message;
      if (!options.keep_going || exit_of(done.error().code) == Exit::unreachable) return unexpected(done.error().code, sentence);
      session.warn(sentence);
      ++refused;
    }
    const auto now = std::chrono::duration_cast<microseconds>(steady_clock::now() - start);
    const microseconds rest = next < steps.size() ? std::max(due_of(steps[next]) - now, microseconds(0)) : microseconds(0);
    const auto pause = std::chrono::ceil<std::chrono::milliseconds>(rest);
    constexpr std::chrono::milliseconds longest{60'000};
    pollfd event{signals.descriptor(), POLLIN, 0};
    ::poll(&event, 1, static_cast<int>(std::min(pause, longest).count()));
    while (const int signal = signals.take())
      if (ends_command(signal)) return 128 + signal;
  }
  if (session.terminal().shows_progress())
    session.warn(std::to_string(written) + " values written" + (skipped > 0 ? ", " + std::to_string(skipped) + " were late and skipped" : "") +
                 (plan.gaps() > 0 ? "; the recording has " + std::to_string(plan.gaps()) + (plan.gaps() == 1 ? " gap" : " gaps") : ""));
  return refused > 0 ? Exit::failure : Exit::success;
}

}  // namespace

void add_replay(CommandLine& line) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* const command =
      line.add("replay", "Write the values of a recording to a robot, in the order and at the pace of their times",
               "The times are those of the robot, if all values have one, otherwise those of arrival. Properties that cannot be written are left\n"
               "out, and named on standard error. Examples:\n"
               "  lrt replay wave.mcap --to http://127.0.0.1:8080/ --speed 0.5\n"
               "  lrt replay both.jsonl --select 'http://left/*' --rename arm=left_arm --from 2 --until 5",
               options, replay);
  command->add_option("FILE", options->file, "A file of lrt record; - is standard input")->required()->type_name("FILE");
  command->add_option("--to", options->to, "A URL of the robot that is driven")->type_name("URL");
  command->add_option("--speed", options->speed, "2: twice as fast")->type_name("X")->check(CLI::Range(1e-6, 1e6));
  command->add_option("--from", options->from, "Begin there: seconds since the beginning, or a time such as 2026-11-23T15:31:19Z")->type_name("TIME");
  command->add_option("--until", options->until, "End there")->type_name("TIME");
  command->add_option("--select", options->select, "Only these: a name or an IRI of a property or a Thing, with * for any characters")
      ->type_name("NAME")
      ->take_all()
      ->type_size(1)
      ->expected(1);
  command->add_option("--rename", options->rename, "Another name at this robot, of a property or of a Thing: OLD=NEW")
      ->type_name("OLD=NEW")
      ->take_all()
      ->type_size(1)
      ->expected(1);
  command->add_flag("--by-arrival", options->by_arrival, "Use the times of arrival, also if there are those of the robot");
  command->add_flag("-n,--dry-run", options->dry_run, "Print what would be written and when, in seconds, and write nothing");
  command->add_flag("-k,--keep-going", options->keep_going, "Go on after a value that the robot refuses");
}

}  // namespace lrt::tool
