// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt-ros2/settings.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

#include <lrt/transport/named.hpp>
#include <lrt/version.hpp>

#include "tools/lrt-ros2/configuration.hpp"
#include "tools/lrt-ros2/setting.hpp"
#include "tools/lrt/suggest.hpp"
#include "tools/lrt/terminal.hpp"

namespace lrt::ros2_tool {
namespace {

using Set = Result<void>;

Unexpected wrong(std::string sentence) { return unexpected(Errc::invalid_option, std::move(sentence)); }
std::string quoted(std::string_view text) { return '"' + tool::printable(text) + '"'; }

template <class Number>
Set set_number(Number& number, const std::string& text, Number low, Number high) {
  Number read = 0;
  const char* const end = text.data() + text.size();
  const auto [read_to, error] = std::from_chars(text.data(), end, read);
  if (error != std::errc() || read_to != end || read < low || read > high)
    return wrong("expected a number from " + std::to_string(low) + " to " + std::to_string(high) + ", found " + quoted(text));
  number = read;
  return {};
}

Set set_flag(bool& flag, const std::string& text) { return flag = text == "true", Set(); }

transport::TlsOptions& tls(Settings& s) { return s.server.security.tls ? *s.server.security.tls : s.server.security.tls.emplace(); }

Set set_level(Settings& s, const std::string& text) {
  constexpr std::array<std::string_view, 4> names = {"debug", "info", "warning", "error"};
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) return wrong("expected debug, info, warning or error, found " + quoted(text));
  s.log_level = static_cast<LogLevel>(found - names.begin());
  return {};
}

Set set_transport(Settings& s, const std::string& text) {
  const std::vector<std::string_view> names = transport::names();
  if (std::find(names.begin(), names.end(), text) == names.end()) {
    std::string all;
    for (const std::string_view name : names) all += (all.empty() ? "" : ", ") + std::string(name);
    return wrong("this build has the transports " + all + ", found " + quoted(text));
  }
  s.server.listen.transport = [text](transport::TransportOptions options) { return transport::make_named(text, std::move(options)); };
  return {};
}

Set add_anyone(Settings& s, const std::string& text) {
  using security::Right;
  constexpr std::pair<std::string_view, Right> rights[] = {{"read", Right::read},           {"write", Right::write},   {"invoke", Right::invoke},
                                                           {"subscribe", Right::subscribe}, {"manage", Right::manage}, {"release", Right::release},
                                                           {"control", Right::control}};
  for (const auto& [name, right] : rights)
    if (name == text) return s.server.security.anyone = s.server.security.anyone | right, Set();
  return wrong("expected read, write, invoke, subscribe, manage, release or control, found " + quoted(text));
}

Set set_domain(Settings& s, const std::string& text) { return set_number(s.bridge.graph.domain, text, 0u, 232u); }

Set add_namespace(Settings& s, const std::string& text) {
  if (text.empty() || text.front() != '/') return wrong("a namespace begins with '/', found " + quoted(text));
  s.bridge.namespaces.push_back(text);
  return {};
}

Set set_identity(Settings& s, const std::string& text) {
  Result<Identity> identity = Identity::from_file(text);
  if (!identity) return unexpected(std::move(identity).error());
  s.server.identity = *std::move(identity);
  return {};
}

Set add_definitions(Settings& s, const std::string& text) {
  ros2::Definitions known;  // so that a wrong folder is an error of the command line
  if (auto added = known.add_folder(text); !added) return unexpected(std::move(added).error());
  s.bridge.definitions.push_back(text);
  return {};
}

Set add_pattern(std::vector<std::string>& patterns, const std::string& text) {
  if (text.empty() || (text.front() != '/' && text.front() != '*'))
    return wrong("a pattern is of full names, such as '/cmd_vel' or '/arm/*', found " + quoted(text));
  patterns.push_back(text);
  return {};
}

// The order is that of --help. Those with a table are keys of the configuration file, too; the tables of lrt::ros2 are read by it.
constexpr Setting settings[] = {
    {"", "config", "config", "FILE", Kind::text, "Options in a file (TOML); docs/ros2.md has the tables",
     [](Settings&, const std::string&) { return Set(); }},
    {"", "", "list", "", Kind::flag, "Print what is in the graph and what is made of it, and end",
     [](Settings& s, const std::string& text) { return set_flag(s.list, text); }},

    {"", "", "domain", "N", Kind::text, "The domain, 0 to 232; default: ROS_DOMAIN_ID, or 0", set_domain},
    {"", "", "namespace", "/NAME", Kind::list, "Only what is below this name of ROS", add_namespace},
    {"", "", "definitions", "DIR", Kind::list,
     "Types: the folder share of an installation of ROS 2, or a workspace. Needed for types that neither lrt nor a node knows, as with Humble",
     add_definitions},
    {"", "", "mapping", "FILE", Kind::list, "Units, frames, names and titles (.toml or .ttl)",
     [](Settings& s, const std::string& text) { return s.bridge.mapping.add_file(text); }},
    {"", "", "robot-description", "FILE", Kind::text, "A URDF, instead of the topic robot_description",
     [](Settings& s, const std::string& text) { return s.bridge.robot_description_file = text, Set(); }},
    {"", "", "path", "PATH", Kind::text, "Of the Things on the server: robots/r7; default: below the root",
     [](Settings& s, const std::string& text) { return s.bridge.path = text, Set(); }},
    {"", "", "localhost", "", Kind::flag, "Only nodes on this machine that have ROS_LOCALHOST_ONLY=1",
     [](Settings& s, const std::string& text) { return text == "true" ? (s.bridge.graph.interfaces = {"127.0.0.1"}, Set()) : Set(); }},
    {"", "", "interface", "NAME|ADDRESS", Kind::list, "A network interface that is used; default: all",
     [](Settings& s, const std::string& text) { return s.bridge.graph.interfaces.push_back(text), Set(); }},
    {"", "", "peer", "ADDRESS", Kind::list, "A machine that multicast does not reach",
     [](Settings& s, const std::string& text) { return s.bridge.graph.peers.push_back(text), Set(); }},
    {"", "", "allow-address", "ADDRESS[/BITS]", Kind::list, "Only participants of these addresses; default: all",
     [](Settings& s, const std::string& text) { return s.bridge.graph.allowed_addresses.push_back(text), Set(); }},

    {"", "", "allow-topics", "PATTERN", Kind::list, "Topics that clients may write: '/cmd_vel', '/arm/*', '/**'",
     [](Settings& s, const std::string& text) { return add_pattern(s.bridge.allowed.topics, text); }},
    {"", "", "allow-services", "PATTERN", Kind::list, "Services that clients may call",
     [](Settings& s, const std::string& text) { return add_pattern(s.bridge.allowed.services, text); }},
    {"", "", "allow-actions", "PATTERN", Kind::list, "Actions that clients may send goals to",
     [](Settings& s, const std::string& text) { return add_pattern(s.bridge.allowed.actions, text); }},
    {"", "", "allow-parameters", "PATTERN", Kind::list, "Parameters that clients may set: '/base:max_*', '/arm/**:*'",
     [](Settings& s, const std::string& text) { return add_pattern(s.bridge.allowed.parameters, text); }},
    {"", "", "allow-lifecycle", "PATTERN", Kind::list, "Nodes whose state clients may change",
     [](Settings& s, const std::string& text) { return add_pattern(s.bridge.allowed.lifecycle, text); }},

    {"server", "address", "bind", "ADDRESS", Kind::text, "An address or host name to listen on; default: 127.0.0.1",
     [](Settings& s, const std::string& text) { return s.server.listen.address = text, Set(); }},
    {"server", "port", "port", "N", Kind::number, "The port; default: 8080; 0: any free one",
     [](Settings& s, const std::string& text) { return set_number<std::uint16_t>(s.server.listen.port, text, 0, 65535); }},
    {"server", "public_base", "public-base", "URL", Kind::text, "By which clients know the server behind a reverse proxy",
     [](Settings& s, const std::string& text) { return s.server.listen.public_base = text, Set(); }},
    {"server", "identity", "identity", "FILE", Kind::text,
     "Which robot this is: {\"iri\": \"https://robots.example/r7\", \"serialNumber\": ...}; needed with --mqtt, unless there is a public base",
     set_identity},
    {"server", "transport", "transport", "NAME", Kind::text, "http or libwebsockets", set_transport},
    {"server", "title", "title", "TEXT", Kind::text, "What people call the robot",
     [](Settings& s, const std::string& text) {
       return s.server.title = {text, "en"}, Set();
     }},
    {"server", "vocabulary", "vocabulary", "IRI", Kind::text, "The namespace of the terms of types; default: of this server",
     [](Settings& s, const std::string& text) { return s.server.vocabulary = text, Set(); }},
    {"server", "callbacks", "allow-callback", "HOST", Kind::list, "A receiver of web callbacks: a name, an address or a network",
     [](Settings& s, const std::string& text) { return s.server.callbacks.allow.push_back(text), Set(); }},
    {"server", "subscriptions", "subscriptions", "FILE", Kind::text, "Stores web callbacks across restarts",
     [](Settings& s, const std::string& text) { return s.server.callbacks.file = text, Set(); }},
    {"server", "metrics", "metrics", "", Kind::flag, "Add the Thing /server with counters; /server/metrics is for Prometheus",
     [](Settings& s, const std::string& text) { return set_flag(s.metrics, text); }},
    {"server", "sparql", "", "", Kind::flag, "", [](Settings& s, const std::string& text) { return set_flag(s.sparql, text); }},

    {"security", "", "tls", "DIR", Kind::text, "HTTPS with DIR/server.pem and DIR/server-key.pem; SIGHUP reads them again",
     [](Settings& s, const std::string& text) {
       tls(s).certificate_file = text + "/server.pem";
       tls(s).key_file = text + "/server-key.pem";
       return Set();
     }},
    {"security", "certificate", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return tls(s).certificate_file = text, Set(); }},
    {"security", "key", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return tls(s).key_file = text, Set(); }},
    {"security", "client_ca", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return tls(s).client_ca_file = text, Set(); }},
    {"security", "require_client_certificate", "", "", Kind::flag, "",
     [](Settings& s, const std::string& text) { return set_flag(tls(s).require_client_certificate, text); }},
    {"security", "tokens", "tokens", "FILE", Kind::text, "Lets in only those who send a token of the file, a line \"NAME ROLE TOKEN\" each",
     [](Settings& s, const std::string& text) { return s.server.security.token_file = text, Set(); }},
    {"security", "policy", "policy", "FILE", Kind::text, "Access rights: rules of Web Access Control in Turtle",
     [](Settings& s, const std::string& text) { return s.server.security.policy_file = text, Set(); }},
    {"security", "anyone", "", "", Kind::list, "", add_anyone},
    {"security", "audit", "audit", "FILE", Kind::text, "Appends a line of JSON for each command, before its response",
     [](Settings& s, const std::string& text) { return s.audit_file = text, Set(); }},
    {"security", "allowed_hosts", "allowed-host", "HOST", Kind::list, "A further name of the server that requests may have",
     [](Settings& s, const std::string& text) { return s.server.security.allowed_hosts.push_back(text), Set(); }},
    {"security", "read_origins", "cors", "ORIGIN", Kind::list, "Pages of this origin may read the robot in a browser; '*': all pages",
     [](Settings& s, const std::string& text) { return s.server.security.read_origins.push_back(text), Set(); }},
    {"security", "allowed_origins", "allowed-origin", "ORIGIN", Kind::list, "Pages of this origin may send commands and watch",
     [](Settings& s, const std::string& text) { return s.server.security.allowed_origins.push_back(text), Set(); }},
    {"security", "notification_senders", "", "", Kind::list, "",
     [](Settings& s, const std::string& text) { return s.server.security.notification_senders.push_back(text), Set(); }},
    {"security", "allow_unprotected_network", "", "", Kind::flag, "",
     [](Settings& s, const std::string& text) { return set_flag(s.server.security.allow_unprotected_network, text); }},

    {"mqtt", "broker", "mqtt", "HOST[:PORT]", Kind::text, "Publishes the values to the MQTT broker there",
     [](Settings& s, const std::string& text) { return s.broker.address = text, Set(); }},
    {"mqtt", "prefix", "mqtt-prefix", "LEVELS", Kind::text,
     "The first levels of the topics there; default: robots/ and the last part of the identity",
     [](Settings& s, const std::string& text) { return s.broker.prefix = text, Set(); }},
    {"mqtt", "user", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return s.broker.user = text, Set(); }},
    {"mqtt", "password_file", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return s.broker.password_file = text, Set(); }},
    {"mqtt", "client_id", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return s.broker.client_id = text, Set(); }},
    {"mqtt", "public_url", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return s.broker.public_url = text, Set(); }},
    {"mqtt", "tls", "", "", Kind::flag, "", [](Settings& s, const std::string& text) { return set_flag(s.broker.tls, text); }},
    {"mqtt", "ca", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return s.broker.ca = text, Set(); }},
    {"mqtt", "certificate", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return s.broker.certificate = text, Set(); }},
    {"mqtt", "key", "", "", Kind::text, "", [](Settings& s, const std::string& text) { return s.broker.key = text, Set(); }},
    {"mqtt", "commands", "", "", Kind::flag, "", [](Settings& s, const std::string& text) { return set_flag(s.broker.commands, text); }},
    {"mqtt", "command_token_file", "", "", Kind::text, "",
     [](Settings& s, const std::string& text) { return s.broker.command_token_file = text, Set(); }},

    {"log", "level", "log", "LEVEL", Kind::text, "What is said on standard error: debug, info, warning (default) or error", set_level},
    {"", "", "completion", "SHELL", Kind::text, "Print the completion for bash or zsh, and end",
     [](Settings& s, const std::string& text) { return s.completion = text, Set(); }},
    {"", "", "help", "", Kind::flag, "Print this text, and end", [](Settings& s, const std::string& text) { return set_flag(s.help, text); }},
    {"", "", "version", "", Kind::flag, "Print the version, and end", [](Settings& s, const std::string& text) { return set_flag(s.version, text); }},
};

const Setting* find_option(std::string_view name) noexcept {
  for (const Setting& setting : settings)
    if (!setting.option.empty() && setting.option == name) return &setting;
  return nullptr;
}

struct Given {
  const Setting* setting;
  std::string value;
};

Result<std::vector<Given>> read_arguments(const std::vector<std::string>& arguments) {
  std::vector<Given> given;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "-h") {
      given.push_back({find_option("help"), "true"});
      continue;
    }
    const std::size_t equals = argument.find('=');
    const std::string name = argument.substr(0, equals);
    const Setting* const setting = name.size() > 2 && name.compare(0, 2, "--") == 0 ? find_option(std::string_view(name).substr(2)) : nullptr;
    if (!setting) {
      if (argument.empty() || argument.front() != '-') return wrong("expected an option, found " + quoted(argument) + "; see lrt-ros2 --help");
      const std::string meant = tool::did_you_mean(name, option_names());
      return wrong("there is no option " + quoted(name) + (meant.empty() ? "; see lrt-ros2 --help" : meant));
    }
    if (setting->kind == Kind::flag) {
      if (equals != std::string::npos) return wrong(name + " takes no value");
      given.push_back({setting, "true"});
    } else if (equals != std::string::npos) {
      given.push_back({setting, argument.substr(equals + 1)});
    } else if (i + 1 < arguments.size()) {
      given.push_back({setting, arguments[++i]});
    } else {
      return wrong(name + " needs a value: " + std::string(setting->argument));
    }
  }
  return given;
}

std::vector<std::string> parts_of(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// What ROS 2 reads in the environment, unless the file or the command line says it.
Result<void> read_environment(Settings& s, Environment environment, const std::vector<Given>& given, const Configuration& file) {
  const auto is_given = [&](std::string_view option) {
    return std::any_of(given.begin(), given.end(), [&](const Given& one) { return one.setting->option == option; });
  };
  if (const auto domain = environment("ROS_DOMAIN_ID"); domain && !is_given("domain") && !file.has("graph", "domain"))
    if (Set set = set_domain(s, *domain); !set) return wrong("ROS_DOMAIN_ID: " + set.error().message);
  const bool is_local = environment("ROS_LOCALHOST_ONLY") == "1" || environment("ROS_AUTOMATIC_DISCOVERY_RANGE") == "LOCALHOST";
  if (is_local && !is_given("interface") && !file.has("graph", "interfaces")) s.bridge.graph.interfaces = {"127.0.0.1"};
  if (const auto peers = environment("ROS_STATIC_PEERS"); peers && !is_given("peer") && !file.has("graph", "peers"))
    s.bridge.graph.peers = parts_of(*peers, ';');
  if (const auto prefixes = environment("AMENT_PREFIX_PATH"); prefixes && !is_given("definitions") && s.bridge.definitions.empty())
    for (std::string& prefix : parts_of(*prefixes, ':'))  // a workspace has prefixes without types
      if (ros2::Definitions known; known.add_folder(prefix)) s.bridge.definitions.push_back(std::move(prefix));
  return {};
}

std::string wrapped(std::string_view text, std::size_t indent, std::size_t width) {
  std::string result;
  std::size_t column = indent;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    if (column > indent && column + 1 + word.size() > width) {
      result += '\n' + std::string(indent, ' ');
      column = indent;
    } else if (column > indent) {
      result += ' ';
      ++column;
    }
    result += word;
    column += word.size();
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return result;
}

}  // namespace

std::vector<std::string> option_names() {
  std::vector<std::string> names;
  for (const Setting& setting : settings)
    if (!setting.option.empty()) names.push_back("--" + std::string(setting.option));
  return names;
}

Result<Settings> read_settings(const std::vector<std::string>& arguments, Environment environment) {
  Result<std::vector<Given>> given = read_arguments(arguments);
  if (!given) return unexpected(std::move(given).error());
  Settings s;
  Configuration file;
  for (const Given& one : *given) {
    if (one.setting->option == "help" || one.setting->option == "version" || one.setting->option == "completion") {
      if (Set set = one.setting->set(s, one.value); !set) return unexpected(std::move(set).error());
      return s;
    }
    if (one.setting->option != "config") continue;
    if (!file.name.empty()) return wrong("--config is given twice");
    Result<Configuration> read = read_configuration(one.value, s, std::begin(settings), std::end(settings));
    if (!read) return unexpected(std::move(read).error());
    file = *std::move(read);
  }
  if (Result<void> read = read_environment(s, environment, *given, file); !read) return unexpected(std::move(read).error());
  for (const Given& one : *given)
    if (Set set = one.setting->set(s, one.value); !set)
      return unexpected(set.error().code, "--" + std::string(one.setting->option) + ": " + set.error().message);
  if (s.server.security.tls && (s.server.security.tls->certificate_file.empty() || s.server.security.tls->key_file.empty()))
    return wrong("[security]: TLS needs both certificate and key");
  return s;
}

std::string help_text() {
  constexpr std::size_t indent = 32, width = 118;
  std::string text =
      "usage: lrt-ros2 [options]\n\n"
      "Joins a graph of ROS 2 and serves it as Linked Robotic Things: topics are Properties, services and actions are Actions. No ROS is\n"
      "needed. Clients may only read, unless options allow more.\n\n";
  for (const Setting& setting : settings) {
    if (setting.option.empty()) continue;
    if (setting.option == "domain") text += "\nThe graph:\n";
    if (setting.option == "allow-topics") text += "\nWhat clients may do; each may be given several times:\n";
    if (setting.option == "bind") text += "\nThe server:\n";
    if (setting.option == "tls") text += "\nSecurity:\n";
    if (setting.option == "mqtt") text += "\nMQTT:\n";
    if (setting.option == "log") text += "\nOther:\n";
    std::string line = "  --" + std::string(setting.option);
    if (!setting.argument.empty()) line += ' ' + std::string(setting.argument);
    line += line.size() + 1 > indent ? '\n' + std::string(indent, ' ') : std::string(indent - line.size(), ' ');
    text += line + wrapped(setting.help, indent, width) + '\n';
  }
  return text +
         "\nExamples:\n"
         "  lrt-ros2                                   # the robot at http://127.0.0.1:8080/\n"
         "  lrt-ros2 --list                            # what is there\n"
         "  lrt-ros2 --allow-topics /cmd_vel --allow-actions '/arm/**'\n"
         "  lrt-ros2 --bind 0.0.0.0 --tls keys --tokens tokens.txt\n"
         "  lrt-ros2 --definitions ~/ws/install        # types of your own, with Humble\n\n"
         "Exit status: 0 success; 1 the system or the network refuses, or --list finds nobody; 2 usage, or a file that cannot be used.\n";
}

Result<std::string> completion_script(std::string_view shell) {
  std::string options, flags;
  for (const Setting& setting : settings) {
    if (setting.option.empty()) continue;
    options += (options.empty() ? "--" : " --") + std::string(setting.option);
    if (setting.kind == Kind::flag) flags += (flags.empty() ? "--" : "|--") + std::string(setting.option);
  }
  if (shell == "bash")
    return "# bash completion of lrt-ros2. In ~/.bashrc: eval \"$(lrt-ros2 --completion bash)\"\n"
           "_lrt_ros2() {\n"
           "  COMPREPLY=()\n"
           "  if [[ ${COMP_WORDS[COMP_CWORD]} == -* ]]; then\n"
           "    mapfile -t COMPREPLY < <(compgen -W '" +
           options +
           "' -- \"${COMP_WORDS[COMP_CWORD]}\")\n"
           "  fi # else a file\n"
           "}\n"
           "complete -o default -F _lrt_ros2 lrt-ros2\n";
  if (shell == "zsh")
    return "#compdef lrt-ros2\n"
           "# zsh completion of lrt-ros2. In ~/.zshrc, after compinit: eval \"$(lrt-ros2 --completion zsh)\"\n"
           "_lrt_ros2() {\n"
           "  if [[ ${words[CURRENT]} == -* ]]; then\n"
           "    compadd -- " +
           options +
           "\n"
           "  else\n"
           "    _files\n"
           "  fi\n"
           "}\n"
           "compdef _lrt_ros2 lrt-ros2\n";
  return wrong("--completion: expected bash or zsh, found " + quoted(shell));
}

Result<std::string> first_line(const std::string& file) {
  std::ifstream stream(file);
  std::string line;
  if (!std::getline(stream, line)) return wrong("cannot read " + quoted(file));
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
  return line;
}

}  // namespace lrt::ros2_tool
