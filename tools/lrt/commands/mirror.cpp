// SPDX-License-Identifier: Apache-2.0
#include <poll.h>

#include <cstdlib>
#include <mutex>
#include <optional>

#include <lrt/mirror.hpp>

#include "tools/lrt/command_line.hpp"
#include "tools/lrt/metrics_server.hpp"

namespace lrt::tool {
namespace {

using mirror::MirrorEvent;

struct MirrorCommandOptions {
  std::vector<std::string> robots;
  std::string endpoint, user, password_file, token_file, state, metrics;
  bool once = false, verify = false, force = false;
  std::size_t requests = 4;
  double rate = 100, interval = 1, refresh = 60, patience = 30;
};

std::chrono::milliseconds milliseconds_of(double seconds) { return std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1000)); }

std::string count_of(std::uint64_t number, const char* noun) { return std::to_string(number) + " " + noun + (number == 1 ? "" : "s"); }

/// Prints important events; single graphs only with --verbose.
class Reporter {
 public:
  explicit Reporter(Session& session) : session_(session) {}

  void operator()(const MirrorEvent& event) {
    const std::lock_guard lock(mutex_);
    switch (event.kind) {
      case MirrorEvent::Kind::robot_found: return print(event.url + ": mirrored, " + event.reason);
      case MirrorEvent::Kind::robot_left: return session_.warn(event.url + " is not reachable and is marked: " + event.reason);
      case MirrorEvent::Kind::robot_returned: return print(event.url + ": returned");
      case MirrorEvent::Kind::graph_sent: return verbose("sent " + event.url);
      case MirrorEvent::Kind::graph_deleted: return verbose("deleted " + event.url);
      case MirrorEvent::Kind::graph_refused: return session_.warn("the store refuses <" + event.url + ">: " + event.reason);
      case MirrorEvent::Kind::graph_overwritten: return session_.warn("<" + event.url + ">: " + event.reason);
      case MirrorEvent::Kind::store_lost: return session_.warn("the store failed and is tried again: " + event.reason);
      case MirrorEvent::Kind::store_returned: return session_.warn("the store accepts graphs again");
      case MirrorEvent::Kind::graph_lost: return verbose("<" + event.url + ">: " + event.reason);
      case MirrorEvent::Kind::store_repaired: return session_.warn(event.reason);
      case MirrorEvent::Kind::problem: return session_.warn(event.reason);
    }
  }

 private:
  void print(const std::string& line) { session_.terminal().print_line(printable(line)); }
  void verbose(const std::string& line) {
    if (session_.options().verbose) session_.warn(line);
  }
  Session& session_;
  std::mutex mutex_;
};

Result<mirror::MirrorOptions> options_of(Session& session, const MirrorCommandOptions& given) {
  mirror::MirrorOptions options;
  Result<client::Options> client = session.client_options();
  if (!client) return unexpected(std::move(client).error());
  options.client = *std::move(client);
  options.robots = given.robots;
  if (options.robots.empty() && !session.options().robot.empty()) options.robots.push_back(session.options().robot);
  if (options.robots.empty()) return unexpected(Errc::invalid_option, "no robots are given: use their URLs, --robot URL, or set LRT_ROBOT");
  options.store.endpoint = given.endpoint;
  options.store.user = given.user;
  if (!given.user.empty()) {
    if (const char* const password = std::getenv("LRT_STORE_PASSWORD")) {
      options.store.password = password;
    } else if (!given.password_file.empty()) {
      Result<std::string> line = first_line(given.password_file);
      if (!line) return unexpected(std::move(line).error());
      options.store.password = *std::move(line);
    } else {
      return unexpected(Errc::invalid_option, "no password for \"" + given.user + "\"; set LRT_STORE_PASSWORD or give --to-password-file");
    }
  }
  if (!given.token_file.empty()) {
    Result<std::string> line = first_line(given.token_file);
    if (!line) return unexpected(std::move(line).error());
    options.store.token = *std::move(line);
  }
  options.store.response_time = std::max(options.store.response_time, milliseconds_of(session.options().timeout));
  options.state_file = given.state;
  if (given.verify) options.start = mirror::MirrorStart::verify;
  if (given.force) options.start = mirror::MirrorStart::force;
  options.max_requests = given.requests;
  options.max_rate = given.rate;
  options.minimum_interval = milliseconds_of(given.interval);
  options.refresh_interval = milliseconds_of(given.refresh);
  options.patience = milliseconds_of(given.patience);
  return options;
}

/// Prints the result of --once.
Result<int> copy(Session& session, mirror::Mirror& mirror) {
  Signals signals;
  int ended_by = 0;
  const Result<mirror::MirrorCounts> result = mirror.copy([&] {
    for (int signal = signals.take(); signal != 0; signal = signals.take())
      if (ends_command(signal)) ended_by = signal;
    return ended_by == 0;
  });
  if (ended_by != 0) return 128 + ended_by;
  if (!result) return unexpected(result.error());
  const mirror::MirrorCounts& counts = *result;
  std::string line =
      count_of(counts.sent, "graph") + " sent, " + std::to_string(counts.deleted) + " deleted, " + std::to_string(counts.unchanged) + " unchanged";
  if (counts.lost + counts.overwritten > 0)
    line += "; put right: " + std::to_string(counts.lost) + " lost, " + std::to_string(counts.overwritten) + " changed by others";
  session.terminal().print_line(line);
  if (counts.refused + counts.unread + counts.robots_elsewhere > 0) return Exit::failure;
  return counts.robots_away > 0 ? Exit::unreachable : Exit::success;
}

Result<int> mirror(Session& session, MirrorCommandOptions& given) {
  Result<mirror::MirrorOptions> options = options_of(session, given);
  if (!options) return unexpected(std::move(options).error());
  Reporter reporter(session);
  options->on_event = [&reporter](const MirrorEvent& event) { reporter(event); };
  Result<mirror::Mirror> made = mirror::Mirror::create(*std::move(options));
  if (!made) return unexpected(std::move(made).error());
  if (given.once) return copy(session, *made);
  std::optional<MetricsServer> metrics;
  if (!given.metrics.empty()) {
    Result<MetricsServer> served = MetricsServer::create(given.metrics, [&mirror = *made] { return mirror.metrics(); });
    if (!served) return unexpected(std::move(served).error());
    metrics.emplace(*std::move(served));
    session.terminal().print_line("metrics: " + metrics->url());
  }
  Signals signals;
  if (Result<void> started = made->start(); !started) return unexpected(std::move(started).error());
  while (true) {
    pollfd event{signals.descriptor(), POLLIN, 0};
    constexpr int pause_ms = 250;
    ::poll(&event, 1, pause_ms);
    for (int signal = signals.take(); signal != 0; signal = signals.take())
      if (ends_command(signal)) return 128 + signal;
    if (std::optional<Error> failure = made->failure()) return unexpected(*std::move(failure));
    if (session.terminal().failed() != 0) return Exit::failure;  // reported by main()
  }
}

}  // namespace

void add_mirror(CommandLine& line) {
  auto options = std::make_shared<MirrorCommandOptions>();
  CLI::App* const command =
      line.add("mirror", "Keep the graphs of robots in an RDF store",
               "Ctrl-C ends it. The store has the SPARQL 1.1 Graph Store HTTP Protocol. Examples:\n"
               "  lrt mirror http://cell7:8080/ http://cell8:8080/ --to http://127.0.0.1:3030/robots/data --state robots.state\n"
               "  lrt mirror http://cell7:8080/ --to http://127.0.0.1:8890/sparql-graph-crud-auth --to-user dba --once\n"
               "  lrt mirror http://cell7:8080/ --to 'https://store.example/graphs/{graph}' --to-token-file token",
               options, mirror);
  command->add_option("ROBOT", options->robots, "URLs of robots; default: that of --robot")->type_name("ROBOT...")->expected(0, 10'000);
  command->add_option("--to", options->endpoint, "The store: a URL that gets ?graph=, or one with {graph} in it")->required()->type_name("URL");
  command
      ->add_option("--to-user", options->user,
                   "A user of the store, by HTTP Digest or Basic; the password is that of LRT_STORE_PASSWORD or --to-password-file")
      ->type_name("NAME");
  command->add_option("--to-password-file", options->password_file, "A file whose first line is the password")->type_name("FILE");
  command->add_option("--to-token-file", options->token_file, "A file whose first line is a bearer token for the store")->type_name("FILE");
  command->add_option("--state", options->state, "A file that keeps what the store has: the next run sends only what has changed")->type_name("FILE");
  command->add_flag("--once", options->once, "Copy what is there now, and end");
  auto* const verify = command->add_flag("--verify", options->verify, "Compare all contents in the store, also where entity tags are the known ones");
  command->add_flag("--force", options->force, "Send all graphs, whatever the store has")->excludes(verify);
  command->add_option("--requests", options->requests, "Requests to the store at a time, 4 by default")->type_name("N")->check(number_from(1, 256));
  command->add_option("--rate", options->rate, "Requests to the store in one second, 100 by default; 0: any number")
      ->type_name("N")
      ->check(number_from(0, 1e6));
  command->add_option("--interval", options->interval, "The time between two changes of a resource, 1 s by default")
      ->type_name("SECONDS")
      ->check(number_from(0, 86400));
  command->add_option("--refresh", options->refresh, "The time between two readings of all resources and graphs, 60 s by default")
      ->type_name("SECONDS")
      ->check(number_from(0.1, 86400));
  command
      ->add_option("--metrics", options->metrics,
                   "Serve the numbers of the mirror for Prometheus at /server/metrics of this port; without an address for this machine only")
      ->type_name("[ADDRESS:]PORT")
      ->excludes("--once");
  command->add_option("--patience", options->patience, "With --once: how long the store may fail, 30 s by default")
      ->type_name("SECONDS")
      ->check(number_from(0, 86400));
}

}  // namespace lrt::tool
