// SPDX-License-Identifier: Apache-2.0
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <csignal>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {

using client::Invocation;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

namespace {

struct InvokeOptions {
  std::vector<std::string> words;
  std::string type, cancel;
  bool async = false, json = false;
  std::optional<double> wait;
};

/// A progress bar on standard error that is redrawn in place; nothing if that is not a terminal.
class ProgressBar {
 public:
  ProgressBar(const Terminal& terminal, std::string name) : terminal_(terminal), name_(std::move(name)), is_shown_(terminal.shows_progress()) {}
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void draw(const Invocation::State& state) {
    if (!is_shown_) return;
    std::string line = name_ + " " + std::string(to_string(state.status));
    if (state.progress) {
      const std::size_t width = std::min<std::size_t>(terminal_.width(), 100), taken = columns_of(line) + 8;
      if (width > taken + 8) {
        // A bar of eighths of a column.
        static constexpr const char* eighths[] = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
        const std::size_t columns = width - taken;
        const auto filled = static_cast<std::size_t>(*state.progress * static_cast<double>(columns * 8));
        std::string bar;
        if (terminal_.has_unicode()) {
          for (std::size_t i = 0; i < filled / 8; ++i) bar += "█";
          if (filled % 8 != 0) bar += eighths[filled % 8];
          bar.append(columns - (filled + 7) / 8, ' ');
        } else {
          bar.append(filled / 8, '#').append(columns - filled / 8, '.');
        }
        line += " " + bar;
      }
      line += " " + std::to_string(static_cast<int>(std::floor(*state.progress * 100))) + " %";
    }
    terminal_.print_error("\r\033[K" + cut(line, terminal_.width() > 1 ? terminal_.width() - 1 : 1));
    is_drawn_ = true;
  }
  void clear() {
    if (is_drawn_) terminal_.print_error("\r\033[K");
    is_drawn_ = false;
  }

 private:
  const Terminal& terminal_;
  const std::string name_;
  const bool is_shown_;
  bool is_drawn_ = false;
};

/// Waits for a signal. @return  the signal; 0: the time has passed
int wait_for_signal(Signals& signals, milliseconds at_most) {
  const auto until = steady_clock::now() + at_most;
  while (true) {
    if (const int signal = signals.take(); ends_command(signal)) return signal;
    const auto rest = std::chrono::ceil<milliseconds>(until - steady_clock::now());
    if (rest.count() <= 0) return 0;
    pollfd event{signals.descriptor(), POLLIN, 0};
    ::poll(&event, 1, static_cast<int>(rest.count()));
  }
}

Result<int> print_result(Session& session, const client::Action& action, const Invocation& invocation, bool json) {
  const Result<Invocation::ResultNode> node = invocation.result_node();
  if (!node) return Exit::success;  // it has none
  const rdf::Graph& graph = node->representation->graph;
  const bool has_result = graph.find(vocab::lrt_::result).has_value() || invocation.url().empty();
  if (!has_result) return Exit::success;
  const std::optional<client::Schema> schema = schema_of(action.output_shape());
  const PlainValue value = value_at(graph, node->node, schema ? &*schema : nullptr);
  Terminal& terminal = session.terminal();
  if (json) {
    return terminal.print_line("{\"value\":" + value.json + (value.unit.empty() ? "" : ",\"unit\":" + json_string(value.unit)) + "}") ? Exit::success
                                                                                                                                      : Exit::failure;
  }
  std::string text = terminal.is_for_people() && value.number ? value.for_people() : value.text;
  if (terminal.is_for_people() && !value.unit.empty()) text += " " + terminal.styled(value.unit, Style::faint);
  return terminal.print_line(text) ? Exit::success : Exit::failure;
}

/// Waits for the end. Ctrl-C cancels, and so do SIGTERM and the loss of the terminal (SIGHUP, except under nohup): nobody would see what the robot does.
Result<int> finish(Session& session, const client::Action& action, const Invocation& invocation, Signals& signals, const InvokeOptions& options) {
  ProgressBar bar(session.terminal(), printable(action.name()));
  std::optional<steady_clock::time_point> end;
  if (options.wait) end = steady_clock::now() + milliseconds(static_cast<std::int64_t>(*options.wait * 1000));
  milliseconds pause{20};
  while (true) {
    const Result<Invocation::State> state = invocation.state();
    if (!state) return unexpected(state.error());
    if (has_ended(state->status) || invocation.url().empty()) {
      bar.clear();
      if (state->status == Invocation::Status::failed)
        return unexpected(Errc::failed, "\"" + action.name() + "\" failed" + (state->error.empty() ? "" : ": " + state->error));
      if (state->status == Invocation::Status::cancelled) {
        session.warn("\"" + action.name() + "\" was cancelled" + (state->error.empty() ? "" : ": " + state->error));
        return Exit::cancelled;
      }
      return print_result(session, action, invocation, options.json);
    }
    if (state->status == Invocation::Status::unknown) {
      bar.clear();
      session.warn("the server does not say whether \"" + action.name() + "\" has ended");
      return print_result(session, action, invocation, options.json);
    }
    bar.draw(*state);
    if (end && steady_clock::now() >= *end) {
      bar.clear();
      session.terminal().print_line(printable(invocation.url()));
      return unexpected(Errc::failed, "\"" + action.name() + "\" has not ended within " + std::to_string(static_cast<std::int64_t>(*options.wait)) +
                                          " s and goes on; cancel it with: lrt invoke --cancel URL");
    }
    if (const int signal = wait_for_signal(signals, pause); signal != 0) {
      bar.clear();
      if (const Result<void> stopped = invocation.cancel(); !stopped) {
        session.warn("\"" + action.name() + "\" could not be cancelled: " + stopped.error().message);
        return 128 + signal;
      }
      session.warn("\"" + action.name() + "\" is cancelled");
      return 128 + signal;
    }
    pause = std::min(pause + pause / 2, milliseconds(session.terminal().shows_progress() ? 100 : 250));
  }
}

Result<int> invoke(Session& session, InvokeOptions& options) {
  if (!options.cancel.empty()) {
    if (!options.words.empty()) return unexpected(Errc::invalid_option, "--cancel takes the URL of an invocation, and no name");
    const Result<Client*> client = session.client();
    const Result<Invocation> running = client ? (*client)->invocation(options.cancel) : Result<Invocation>(unexpected(client.error()));
    if (!running) return unexpected(running.error());
    if (const Result<void> stopped = running->cancel(); !stopped) return unexpected(stopped.error());
    return Exit::success;
  }
  if (options.words.size() > 2) session.take_robot(options.words, 2);
  else if (options.words.size() == 2 && is_url(options.words[0])) {
    // URL NAME, or URL INPUT: the kind of the resource decides.
    Result<client::Action> action = session.action(options.words[0]);
    const Result<client::RepresentationPtr> found = action ? action->get() : Result<client::RepresentationPtr>(unexpected(action.error()));
    if (!found) return unexpected(found.error());
    const std::vector<std::string> types = (*found)->types();
    const bool is_action =
        std::find(types.begin(), types.end(), vocab::hybrit::Action.text) != types.end() || !(*found)->objects(vocab::hybrit::consumes).empty();
    if (!is_action) session.take_robot(options.words, 1);
  }
  if (options.words.empty() || options.words.size() > 2)
    return unexpected(Errc::invalid_option, "invoke takes a name, and an input if the action has one");
  const std::string& name = options.words[0];
  std::optional<Body> body;
  if (options.words.size() == 2) {
    Result<Body> read = body_of(options.words[1], options.type);
    if (!read) return unexpected(read.error());
    body = *std::move(read);
  }
  const Result<client::Action> action = session.action(name);
  if (!action) return unexpected(action.error());
  const Result<std::optional<client::Shape>> shape = action->input_shape();
  if (!shape) return unexpected(shape.error());
  const std::optional<client::Schema> schema = schema_of(shape);
  // The handle comes at once, so that Ctrl-C can cancel.
  client::InvokeOptions how;
  how.async = true;
  Signals signals;
  Result<Invocation> invocation = unexpected(Errc::failed, "");
  if (body) {
    const Result<Input> input = input_of(*body, action->url(), schema);
    if (!input) return unexpected(input.error());
    invocation = action->invoke(input->graph, input->focus, how);
  } else {
    invocation = action->invoke(how);
    if (!invocation && schema && invocation.error().code == Errc::expected_value)
      return unexpected(Errc::expected_value, "\"" + name + "\" takes " + description_of(*schema) + ": " + invocation.error().message);
  }
  if (!invocation) return unexpected(invocation.error());
  if (options.async) {
    if (invocation->url().empty()) return Exit::success;  // it has ended
    return session.terminal().print_line(printable(invocation->url())) ? Exit::success : Exit::failure;
  }
  return finish(session, *action, *invocation, signals, options);
}

}  // namespace

void add_invoke(CommandLine& line) {
  auto options = std::make_shared<InvokeOptions>();
  CLI::App* const command =
      line.add("invoke", "Invoke an action, wait for its end, and print its result",
               "Ctrl-C, SIGTERM and the loss of the terminal cancel the invocation. Exit status: 0 succeeded; 1 refused or failed;\n"
               "4 cancelled by the robot or somebody else; 130 cancelled by Ctrl-C, 129 by the loss of the terminal, 143 by SIGTERM.\n"
               "Examples:\n"
               "  lrt invoke right_s1/rotate 43.6\n"
               "  lrt invoke right_s1/rotate 0.5rad      # converted to deg, which the action takes\n"
               "  lrt invoke right_s1/rotate 90 --async  # print the URL of the invocation, and do not wait",
               options, invoke);
  command->add_option("INPUT", options->words, "The name of an action, and its input: a value, @FILE, or -")
      ->type_name("[ROBOT] NAME [INPUT]")
      ->expected(0, 3);
  auto* const async = command->add_flag("--async", options->async, "Print the URL of the invocation, and do not wait");
  command->add_option("--wait", options->wait, "Wait at most this long; the invocation then goes on")
      ->type_name("SECONDS")
      ->check(number_from(0, 1e6))
      ->excludes(async);
  command->add_option("--type", options->type, "The media type of the input, such as text/turtle")->type_name("TYPE");
  command->add_option("--cancel", options->cancel, "Cancel the invocation with this URL")->type_name("URL");
  command->add_flag("--json", options->json, "Print the result as an object with value and unit");
}

}  // namespace lrt::tool
