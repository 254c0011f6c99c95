// SPDX-License-Identifier: Apache-2.0
#include <lrt/check.hpp>

#include <algorithm>
#include <chrono>

#include "tools/lrt/command_line.hpp"
#include "tools/lrt/naming.hpp"

namespace lrt::tool {
namespace {

struct CheckOptions {
  std::vector<std::string> words, write;
  std::vector<std::pair<std::string, std::string>> invoke;  // URL and file
  std::string format = "text", root, callback_address;
  bool strict = false, all = false, no_subscriptions = false;
  double seconds = 120, merge_seconds = 60;
  std::size_t resources = lrt::check::CheckOptions{}.max_resources, documents = lrt::check::CheckOptions{}.max_merged_documents,
              triples = lrt::check::CheckOptions{}.max_merged_triples;
};

/// A line on a terminal that says what the check does, from its first request on.
class ProgressLine {
 public:
  explicit ProgressLine(const Terminal& terminal) : terminal_(terminal), shows_(terminal.shows_progress()) {}
  ~ProgressLine() {
    if (shown_) terminal_.print_error("\r\033[K");
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const lrt::check::Progress& now) {
    constexpr std::chrono::milliseconds interval{100};
    const auto time = std::chrono::steady_clock::now();
    if (!shows_ || (shown_ && time < next_)) return;
    shown_ = true;
    next_ = time + interval;
    std::string line = std::to_string(now.elapsed.count() / 1000) + " s, " + std::to_string(now.requests) +
                       (now.requests == 1 ? " request: " : " requests: ") + printable(now.url);
    constexpr std::chrono::milliseconds slow{1'000};
    if (now.usual >= slow) line += " (a response takes " + std::to_string(now.usual.count() / 1000) + " s)";
    terminal_.print_error("\r\033[K" + cut(line, std::max<std::size_t>(terminal_.width(), 20) - 1));
  }

 private:
  const Terminal& terminal_;
  const bool shows_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point next_{};
};

Result<int> check(Session& session, CheckOptions& options) {
  if (!options.words.empty()) session.use_robot(options.words.front());
  const std::string url = session.options().robot;
  if (url.empty()) return unexpected(Errc::invalid_option, "no server is given: use its URL, --robot URL, or set LRT_ROBOT");
  const Result<Client*> reader = session.client();
  if (!reader) return unexpected(reader.error());
  if (const Result<client::RepresentationPtr> document = (*reader)->get(url))  // what does not respond is judged below
    if (std::optional<Error> other = elsewhere((*document)->url, (*document)->graph)) return unexpected(*std::move(other));
  lrt::check::CheckOptions how;
  Result<client::Options> client = session.client_options();
  if (!client) return unexpected(std::move(client).error());
  how.client = *std::move(client);
  how.root = options.root;
  how.callback_address = options.callback_address;
  how.subscribe = !options.no_subscriptions;
  how.write = options.write;
  how.max_resources = options.resources;
  how.max_merged_documents = options.documents;
  how.max_merged_triples = options.triples;
  how.merge_time = std::chrono::milliseconds(static_cast<std::int64_t>(options.merge_seconds * 1000));
  how.total_time = std::chrono::milliseconds(static_cast<std::int64_t>(options.seconds * 1000));
  for (const auto& [action, file] : options.invoke) {
    lrt::check::Invocation invocation;
    invocation.url = action;
    invocation.send_empty = file.empty();
    if (!file.empty()) {
      const Result<Body> body = body_of(file == "-" ? file : "@" + file, {});
      if (!body) return unexpected(body.error());
      invocation.body = body->bytes;
      if (!body->media_type.empty()) invocation.media_type = body->media_type;
      invocation.send_empty = invocation.body.empty();
    }
    how.invoke.push_back(std::move(invocation));
  }
  Terminal& terminal = session.terminal();
  const Result<lrt::check::Report> report = [&] {
    ProgressLine line(terminal);
    how.progress = [&line](const lrt::check::Progress& now) { line.show(now); };
    return lrt::check::run(url, how);
  }();
  if (!report) return unexpected(report.error());
  lrt::check::TextOptions text;
  text.colour = terminal.has_colours();
  text.all = options.all;
  std::string shown;
  if (options.format == "json") shown = printable_json(lrt::check::to_json(*report));
  else if (options.format == "earl") shown = printable_lines(lrt::check::to_earl(*report));
  else shown = printable_styled(lrt::check::to_text(*report, text));
  if (!shown.empty() && shown.back() != '\n') shown += '\n';
  if (!terminal.print(shown)) return Exit::failure;
  return lrt::check::exit_status(report, options.strict);
}

}  // namespace

void add_check(CommandLine& line) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* const command =
      line.add("check", "Check whether a server is a Linked Robotic Thing, requirement by requirement",
               "Only the named resources are written or invoked. Exit status: 0 fulfilled; 1 not fulfilled; 2 usage; 3 no response. Examples:\n"
               "  lrt check http://127.0.0.1:8080/baxter/right_s1\n"
               "  lrt check URL --write URL/friction --invoke URL/actions/rotate input.ttl\n"
               "  lrt check URL --format earl > report.ttl",
               options, check);
  command->add_option("FROM", options->words, "A URL of the server, or better of one of its Things; default: --robot")
      ->type_name("[URL]")
      ->expected(0, 1);
  command->add_option("--format", options->format, "text, json or earl (EARL in Turtle)")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"text", "json", "earl"}));
  command->add_flag("--all", options->all, "Also print the fulfilled requirements, with their evidence");
  command->add_flag("--strict", options->strict, "Exit status 1 also if a SHOULD is not fulfilled");
  command->add_option("--write", options->write, "A resource that may be written: its value is changed a little and put back")
      ->type_name("URL")
      ->take_all()
      ->type_size(1)
      ->expected(1);
  command->add_option("--invoke", options->invoke, "An action that may be invoked, and a file with a valid input; \"\": it has none")
      ->type_name("URL FILE");
  command->add_option("--root", options->root, "The URL of the root resource, where it is not found by itself")->type_name("URL");
  command->add_option("--callback-address", options->callback_address, "Where this machine receives callbacks of the server")
      ->type_name("ADDRESS:PORT");
  command->add_flag("--no-subscriptions", options->no_subscriptions, "Open no subscriptions");
  command->add_option("--resources", options->resources, "The maximum number of resources to visit, 40 by default")
      ->type_name("N")
      ->check(CLI::Range(1, 100'000));
  command->add_option("--documents", options->documents, "The maximum number of documents to merge, 1000 by default")
      ->type_name("N")
      ->check(CLI::Range(1, 100'000));
  command->add_option("--triples", options->triples, "The maximum number of triples to merge, 200000 by default")
      ->type_name("N")
      ->check(CLI::Range(1, 10'000'000));
  command->add_option("--merge-for", options->merge_seconds, "The time to read and judge the merged documents, 60 s by default")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 86400.0));
  command->add_option("--for", options->seconds, "The time of the whole check, 120 s by default")
      ->type_name("SECONDS")
      ->check(CLI::Range(1.0, 86400.0));
}

}  // namespace lrt::tool
