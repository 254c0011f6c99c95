// SPDX-License-Identifier: Apache-2.0
// The program lrt-ros2: a graph of ROS 2 as Linked Robotic Things. docs/ros2.md is the guide, lrt-ros2.1 has all options.

#include <csignal>
#include <ctime>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#ifdef LRT_ROS2_HAS_QUERY
#include <lrt/query.hpp>
#endif
#include <lrt/server.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/version.hpp>

#include "tools/lrt-ros2/broker.hpp"
#include "tools/lrt-ros2/settings.hpp"
#include "tools/lrt-ros2/workers.hpp"
#include "tools/lrt/terminal.hpp"

namespace {

using namespace lrt::ros2_tool;
using lrt::tool::printable;
using namespace std::chrono_literals;

/// SIGINT, SIGTERM and SIGHUP, which all threads block: they are taken, not handled.
class Signals {
 public:
  Signals() {
    std::signal(SIGPIPE, SIG_IGN);
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      struct sigaction now {};
      ::sigaction(signal, nullptr, &now);
      if (now.sa_handler != SIG_IGN) sigaddset(&signals_, signal);  // nohup
    }
    ::pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }
  /// The next signal; 0: none within this time.
  int wait(std::chrono::milliseconds time) const noexcept {
    const timespec limit{static_cast<std::time_t>(time.count() / 1000), static_cast<long>(time.count() % 1000 * 1'000'000)};
    const int signal = ::sigtimedwait(&signals_, nullptr, &limit);
    return signal > 0 ? signal : 0;
  }
  /// A further one ends the program at once.
  void let_go() const noexcept { ::pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr); }

 private:
  sigset_t signals_{};
};

int report(const std::string& sentence, int status) {
  lrt::tool::Terminal().print_error("lrt-ros2: " + printable(sentence) + '\n');
  return status;
}
int report(const lrt::Error& error) {
  const bool is_usage = error.code == lrt::Errc::invalid_option || error.code == lrt::Errc::insecure_address;
  return report(error.message, is_usage ? Exit::usage : Exit::failure);
}

lrt::LogCallback log_from(lrt::LogLevel least) {
  return [least](lrt::LogLevel level, std::string_view text) {
    if (level >= least) lrt::tool::Terminal().print_error("lrt-ros2: " + printable(text) + '\n');
  };
}

std::string nobody(const lrt::ros2::GraphOptions& graph) {
  return "nobody is in domain " + std::to_string(graph.domain) +
         (graph.interfaces == std::vector<std::string>{"127.0.0.1"} ? " on this machine: only nodes with ROS_LOCALHOST_ONLY=1 are found there"
                                                                    : ", or they are not reached") +
         ". The domain is that of ROS_DOMAIN_ID or --domain; --peer ADDRESS finds machines that multicast does not reach";
}

std::string_view name_of(lrt::ros2::Listed::What what) noexcept {
  using What = lrt::ros2::Listed::What;
  switch (what) {
    case What::node: return "node";
    case What::topic: return "topic";
    case What::service: return "service";
    case What::action: return "action";
    case What::parameter: return "parameter";
  }
  return "";
}

/// Services that each node has, of which lrt-ros2 makes parameters, states and types. They are no news unless an option allows them.
bool is_of_each_node(const lrt::ros2::Listed& one) {
  const auto begins = [&](std::string_view package) { return one.type.compare(0, package.size(), package) == 0; };
  return one.what == lrt::ros2::Listed::What::service && one.path.empty() &&
         (begins("rcl_interfaces/srv/") || begins("lifecycle_msgs/srv/") || begins("type_description_interfaces/srv/"));
}

/// The reason, and the option that would change it.
std::string reason_of(const lrt::ros2::Listed& one) {
  using What = lrt::ros2::Listed::What;
  const auto with = [&](std::string_view option) { return one.reason + ": --allow-" + std::string(option) + ' ' + one.name + " allows it"; };
  if (one.reason == "not allowed" && one.what == What::service) return with("services");
  if (one.reason == "not allowed" && one.what == What::action) return with("actions");
  if (one.reason == "no node writes it" && one.as == "Property") return one.reason + "; --allow-topics " + one.name + " lets clients write it";
  return one.reason;
}

/// The server for `--list`: nothing listens.
int list(Settings& s) {
  s.server.listen.transport = [](lrt::transport::TransportOptions options) { return std::make_unique<lrt::transport::Loopback>(std::move(options)); };
  s.server.listen.address = "127.0.0.1";
  s.server.security.tls.reset();
  s.server.callbacks.file.clear();
  auto server = lrt::Server::create(s.server);
  if (!server) return report(server.error());
  server->start();
  const lrt::ros2::GraphOptions graph = s.bridge.graph;
  auto bridge = lrt::ros2::Bridge::create(*server, std::move(s.bridge));
  if (!bridge) return report(bridge.error());
  const bool has_settled = bridge->wait_until_settled(10s);
  lrt::tool::Table table;
  for (const lrt::ros2::Listed& one : bridge->list()) {
    using Style = lrt::tool::Style;
    if (is_of_each_node(one)) continue;
    table.add({{std::string(name_of(one.what)), Style::faint},
               {printable(one.name), Style::strong},
               {printable(one.type)},
               {printable(one.as)},
               {printable(one.path)},
               {printable(reason_of(one)), Style::faint}});
  }
  if (table.empty()) return report(nobody(graph), Exit::failure);
  lrt::tool::Terminal terminal;
  if (!table.print(terminal, {"", "name", "type", "is", "at", "because"})) return Exit::failure;
  if (!has_settled) report("the graph still changes, or nodes have not responded: the list may not be complete", Exit::success);
  return Exit::success;
}

std::string counted(std::size_t number, std::string_view one, std::string_view many) {
  return std::to_string(number) + ' ' + std::string(number == 1 ? one : many);
}

/// What was found, once it is quiet.
void say_what_is_there(const lrt::ros2::Bridge& bridge, const lrt::ros2::GraphOptions& graph, bool is_read_only) {
  const lrt::ros2::Counters counters = bridge.counters();
  const std::vector<lrt::ros2::Listed> listed = bridge.list();
  if (listed.empty()) {
    report(nobody(graph), Exit::success);
    return;
  }
  const auto nodes = static_cast<std::size_t>(
      std::count_if(listed.begin(), listed.end(), [](const lrt::ros2::Listed& one) { return one.what == lrt::ros2::Listed::What::node; }));
  std::string text = counted(nodes, "node: ", "nodes: ") + counted(counters.things, "Thing, ", "Things, ") +
                     counted(counters.properties, "Property, ", "Properties, ") + counted(counters.actions, "Action", "Actions");
  if (counters.unavailable > 0) text += "; " + std::to_string(counters.unavailable) + " unavailable now";
  const auto left_out = std::count_if(listed.begin(), listed.end(),
                                      [](const lrt::ros2::Listed& one) { return one.path.empty() && !one.reason.empty() && !is_of_each_node(one); });
  if (left_out > 0) text += "; " + std::to_string(left_out) + " left out, lrt-ros2 --list says why";
  if (is_read_only) text += ". Read-only: lrt-ros2 --help has the options that allow more";
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

lrt::Result<void> reload(lrt::Server& server, const Settings& s) {
  if (s.server.security.audit.file) s.server.security.audit.file->reopen();
  return s.server.security.tls ? server.reload_tls() : lrt::Result<void>();
}

int serve(Settings& s, const Signals& signals) {
  Workers workers(4);  // they outlive the server
  s.server.threads.executor = [&workers](std::function<void()> job) { workers.post(std::move(job)); };
  if (!s.broker.address.empty() && s.server.identity.iri.empty() && s.server.listen.public_base.empty())
    return report(
        "--mqtt: a robot at a broker needs a name that stays when its address changes: give --public-base, or --identity with a file that has "
        "{\"iri\": \"https://robots.example/r7\"}",
        Exit::usage);
  auto server = lrt::Server::create(s.server);
  if (!server) return report(server.error());
  if (s.metrics)
    if (auto added = server->add(lrt::server_thing(*server)); !added) return report(added.error());
  server->start();
  const lrt::ros2::GraphOptions graph = s.bridge.graph;
  const lrt::ros2::Allowed& allowed = s.bridge.allowed;
  const bool is_read_only =
      allowed.topics.empty() && allowed.services.empty() && allowed.actions.empty() && allowed.parameters.empty() && allowed.lifecycle.empty();
  auto bridge = lrt::ros2::Bridge::create(*server, std::move(s.bridge));
  if (!bridge) return report(bridge.error());
  auto broker = BrokerLink::create(*server, s.broker, s.server.log);
  if (!broker) return report(broker.error());
  std::printf("domain %u of ROS 2 is at %s (Ctrl-C ends)\n", graph.domain, server->url().c_str());
  std::fflush(stdout);

  const bool reloads = s.server.security.tls || s.server.security.audit.file;
  int quiet_rounds = 25;  // of 200 ms
  for (;;) {
    if (const int signal = signals.wait(quiet_rounds > 0 ? 0ms : 1h)) {
      if (signal != SIGHUP || !reloads) break;
      if (auto read = reload(*server, s); !read) report("the old certificate stays: " + read.error().message, Exit::success);
    }
    if (quiet_rounds > 0 && (bridge->wait_until_settled(200ms) || --quiet_rounds == 0)) {
      quiet_rounds = 0;
      say_what_is_there(*bridge, graph, is_read_only);
    }
  }
  signals.let_go();
  broker->reset();
  { const lrt::ros2::Bridge leaving = *std::move(bridge); }
  server->stop();
  return Exit::success;
}

std::optional<std::string> variable(const char* name) {
  const char* const value = std::getenv(name);  // before there are threads
  return value && *value ? std::optional<std::string>(value) : std::nullopt;
}

int run(int argc, char** argv) {
  lrt::Result<Settings> settings = read_settings({argv + std::min(argc, 1), argv + argc}, variable);
  if (!settings) return report(settings.error().message, Exit::usage);
  Settings& s = *settings;
  lrt::tool::Terminal terminal;
  if (s.help) return terminal.print(help_text()) ? Exit::success : Exit::failure;
  if (s.version) return terminal.print_line("lrt-ros2 " LRT_VERSION) ? Exit::success : Exit::failure;
  if (!s.completion.empty()) {
    const lrt::Result<std::string> script = completion_script(s.completion);
    if (!script) return report(script.error().message, Exit::usage);
    return terminal.print(*script) ? Exit::success : Exit::failure;
  }
  if (s.server.title.empty()) s.server.title = {"ROS 2, domain " + std::to_string(s.bridge.graph.domain), "en"};
  s.server.log = s.bridge.log = s.bridge.graph.log = log_from(s.log_level);
  if (s.list) return list(s);
#ifdef LRT_ROS2_HAS_QUERY
  if (s.sparql) s.server.query = lrt::query::endpoint();
#endif
  const Signals signals;  // before the first thread
  if (!s.audit_file.empty()) {
    lrt::security::AuditFileOptions waits;
    waits.respond_when_saved = true;
    auto file = lrt::security::audit_file(s.audit_file, waits);
    if (!file) return report(file.error());
    s.server.security.audit.file = *std::move(file);
  }
  return serve(s, signals);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) { return report(error.what(), Exit::failure); }
}
