// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <csignal>

#include <lrt/base/clock.hpp>

#include "tools/lrt/observing.hpp"
#include "tools/lrt/plot.hpp"

namespace lrt::tool {

using std::chrono::steady_clock;

namespace {

struct WatchOptions {
  ObserveOptions observe;
  bool json = false, csv = false, plot = false;
  double window = 30;
};

/// RFC 4180.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result += '"';
}

std::string json_line(const std::string& name, const std::string& url, const Observed& seen) {
  std::string line = "{\"time\":\"" + utc(seen.time) + "\",\"name\":" + json_string(name) + ",\"url\":" + json_string(url);
  if (seen.kind == Observed::Kind::value) {
    line += ",\"value\":" + seen.value.json;
    if (!seen.value.unit.empty()) line += ",\"unit\":" + json_string(seen.value.unit);
    if (seen.source_time) line += ",\"sourceTime\":\"" + to_xsd_date_time(*seen.source_time) + "\"";
  } else {
    line += std::string(",\"") + name_of(seen.kind) + "\":" + json_string(seen.reason);
  }
  return line + "}";
}

std::string csv_line(const std::string& name, const Observed& seen) {
  const bool is_value = seen.kind == Observed::Kind::value;
  return utc(seen.time) + "," + csv_field(name) + "," + (is_value ? csv_field(seen.value.text) : "") + "," +
         (is_value ? csv_field(seen.value.unit) : "") + "," + (is_value ? "" : csv_field(std::string(name_of(seen.kind)) + ": " + seen.reason));
}

/// @param names  columns of the longest name
std::string text_line(const Terminal& terminal, const std::string& name, const Observed& seen, std::size_t names) {
  const char* const kind = name_of(seen.kind);
  if (!terminal.is_for_people()) {
    if (seen.kind != Observed::Kind::value) return utc(seen.time) + "\t" + name + "\t" + kind + ": " + seen.reason + "\t";
    return utc(seen.time) + "\t" + name + "\t" + seen.value.line() + "\t" + seen.value.unit;
  }
  // One line for each change: what is too long for the window is cut.
  constexpr std::size_t time = 12, gap = 2;
  const std::size_t rest = std::max<std::size_t>(terminal.width(), time + names + 2 * gap + 10) - time - names - 2 * gap;
  const std::string begin = terminal.styled(time_of_day(seen.time), Style::faint) + "  " + name + std::string(names - columns_of(name) + gap, ' ');
  if (seen.kind != Observed::Kind::value) return begin + terminal.styled(cut(std::string(kind) + ": " + seen.reason, rest), Style::warning);
  const std::string value = cut(seen.value.for_people(), rest);
  return begin + value + (seen.value.unit.empty() ? "" : " " + terminal.styled(seen.value.unit, Style::faint));
}

Result<int> watch_plot(Session& session, Observer& observer, const WatchOptions& options) {
  Terminal& terminal = session.terminal();
  if (!terminal.is_for_people()) return unexpected(Errc::invalid_option, "--plot needs a terminal as standard output");
  Plot plot(std::chrono::duration<double>(options.window), terminal.has_unicode(), terminal.has_colours());
  for (std::size_t i = 0; i < observer.size(); ++i) plot.add(observer.name(i), {});
  std::string message;
  auto next_frame = steady_clock::now();
  ObserveHooks hooks;
  std::optional<Screen> screen;
  screen.emplace();
  hooks.pause = std::chrono::milliseconds(100);
  hooks.on_change = [&](const Observed& seen) {
    if (seen.kind != Observed::Kind::value) {
      plot.gap(seen.property, seen.received);
      message = seen.kind == Observed::Kind::heard ? "" : observer.name(seen.property) + ": " + name_of(seen.kind) + ": " + seen.reason;
      return true;
    }
    message.clear();
    plot.set_unit(seen.property, seen.value.unit);
    if (seen.value.number) plot.point(seen.property, seen.received, *seen.value.number);
    else plot.text(seen.property, seen.value.text);
    return true;
  };
  hooks.on_lost = [&](std::size_t property) {
    plot.gap(property, steady_clock::now());
    message = observer.name(property) + ": the connection is lost; connecting again";
  };
  hooks.on_pause = [&] {
    const auto now = steady_clock::now();
    if (now < next_frame) return;
    constexpr std::chrono::milliseconds frame{50};
    next_frame = now + frame;
    const std::size_t width = terminal.width(), height = terminal.height();
    const auto age = observer.age();
    const std::string word =
        age ? "; the newest word is " + std::to_string(age->count() / 1000) + "." + std::to_string(age->count() / 100 % 10) + " s old" : "";
    const std::string last = cut(message.empty() ? "q or Ctrl-C ends" + word : message, width > 1 ? width - 1 : 0);
    std::string text = "\033[?2026h\033[H";  // as one update, if the terminal supports it
    for (const char c : plot.draw(width, height > 1 ? height - 1 : 1, now)) {
      if (c == '\n') text += "\033[K\r\n";
      else text += c;
    }
    text += "\033[K\033[J";
    if (height > 1)
      text += "\033[" + std::to_string(height) + ";1H" + terminal.styled(last, message.empty() ? Style::faint : Style::warning) + "\033[K";
    terminal.print(text + "\033[?2026l");
  };
  hooks.on_signal = [&](int signal) {
    if (signal == SIGCONT) screen->enter();
    terminal.print("\033[2J");
    next_frame = steady_clock::now();
  };
  hooks.on_key = [](char key) { return key != 'q' && key != 'Q' && key != '\033'; };
  Result<int> result = observer.run(hooks);
  screen.reset();
  return result;
}

Result<int> watch(Session& session, WatchOptions& options) {
  Observer observer(session, options.observe);
  if (Result<void> found = observer.find(); !found) return unexpected(std::move(found).error());
  if (options.plot) return watch_plot(session, observer, options);
  Terminal& terminal = session.terminal();
  if (options.csv) terminal.print_line("time,name,value,unit,event");
  std::size_t names = 0;
  for (std::size_t i = 0; i < observer.size(); ++i) names = std::max(names, columns_of(observer.name(i)));
  ObserveHooks hooks;
  bool has_value = false;
  hooks.on_change = [&](const Observed& seen) {
    const std::string& name = observer.name(seen.property);
    has_value = has_value || seen.kind == Observed::Kind::value;
    return terminal.print_line(options.json  ? json_line(name, observer.url(seen.property), seen)
                               : options.csv ? csv_line(name, seen)
                                             : text_line(terminal, name, seen, names));
  };
  Result<int> ended = observer.run(hooks);
  if (ended && *ended == Exit::success && !has_value)
    return unexpected(Errc::failed,
                      observer.size() == 1 ? "\"" + observer.name(0) + "\" has sent no value" : "none of the properties has sent a value");
  return ended;
}

}  // namespace

void add_watch(CommandLine& line) {
  auto options = std::make_shared<WatchOptions>();
  CLI::App* const command = line.add("watch", "Print a line for each change of properties or Things",
                                     "Ctrl-C ends it. A gap is a line: after it, changes may be missing. Examples:\n"
                                     "  lrt watch right_s1/position right_s1/velocity\n"
                                     "  lrt watch right_s1                     # all its properties\n"
                                     "  lrt watch 'right_*/position'\n"
                                     "  lrt watch right_s1/position --json --count 10\n"
                                     "  lrt watch right_s1/position --csv --for 60 > position.csv\n"
                                     "  lrt watch right_s0/position right_s1/position --plot",
                                     options, watch);
  add_observe_options(*command, options->observe);
  auto* const json = command->add_flag("--json", options->json, "A JSON object for each change");
  auto* const csv = command->add_flag("--csv", options->csv, "Comma-separated values")->excludes(json);
  auto* const plot = command->add_flag("--plot", options->plot, "Draw the values as curves")->excludes(json)->excludes(csv);
  command->add_option("--window", options->window, "The time that --plot shows, 30 s by default")
      ->type_name("SECONDS")
      ->check(number_from(0.1, 1e6))
      ->needs(plot);
}

}  // namespace lrt::tool
