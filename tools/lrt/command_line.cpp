// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/command_line.hpp"

#include <termios.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "src/base/utf8.hpp"
#include "tools/lrt/cache.hpp"

namespace lrt::tool {
namespace {

/// Asks on the terminal, without echo. nullopt: there is none.
std::optional<std::string> ask_password(const std::string& user) {
  std::FILE* const terminal = std::fopen("/dev/tty", "r+");
  if (!terminal) return std::nullopt;
  termios before{};
  const bool has_mode = ::tcgetattr(::fileno(terminal), &before) == 0;
  if (has_mode) {
    termios quiet = before;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    ::tcsetattr(::fileno(terminal), TCSAFLUSH, &quiet);
  }
  std::fprintf(terminal, "Password of %s: ", printable(user).c_str());
  std::fflush(terminal);
  std::string password;
  for (int c = std::fgetc(terminal); c != EOF && c != '\n'; c = std::fgetc(terminal)) password += static_cast<char>(c);
  if (has_mode) ::tcsetattr(::fileno(terminal), TCSAFLUSH, &before);
  std::fputc('\n', terminal);
  std::fclose(terminal);
  return password;
}

}  // namespace

Result<std::string> first_line(const std::string& name) {
  std::ifstream file(name);
  std::string line;
  if (!file || (!std::getline(file, line) && !file.eof())) return unexpected(Errc::invalid_option, "cannot read \"" + name + "\"");
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return std::string(utf8::without_mark(line));
}

std::string Help::make_usage(const CLI::App* app, std::string name) const {
  std::string usage = "Usage: lrt" + (app->get_parent() ? " " + app->get_name() : std::string()) + " [OPTIONS]";
  static_cast<void>(name);
  for (const CLI::Option* const option : app->get_options())
    if (option->get_positional()) usage += " " + option->get_type_name();
  if (!app->get_parent()) usage += " COMMAND ...";
  return usage + "\n";
}

std::string Help::make_positionals(const CLI::App* app) const {
  std::string text;
  for (const CLI::Option* const option : app->get_options())
    if (option->get_positional()) text += "\n" + option->get_type_name() + "\n  " + option->get_description() + "\n";
  return text;
}

std::string Help::make_option_opts(const CLI::Option* option) const {
  if (option->get_type_size() == 0) return {};
  // The type of a checked option is "SECONDS:FLOAT in [0 - 1]". The range is left out: an error message states it.
  const std::string type = option->get_type_name();
  for (const std::string_view own : {"NAME:VALUE", "ADDRESS:PORT"})
    if (std::string_view(type).substr(0, own.size()) == own) return " " + std::string(own);
  return " " + type.substr(0, type.find(':'));
}

int exit_of(Errc code) noexcept {
  switch (code) {
    case Errc::invalid_option: return Exit::usage;
    case Errc::io_error:
    case Errc::timed_out:
    case Errc::closed:
    case Errc::unconfirmed:
    case Errc::expected_http: return Exit::unreachable;
    default: return Exit::failure;
  }
}

bool is_url(std::string_view text) noexcept { return text.substr(0, 7) == "http://" || text.substr(0, 8) == "https://"; }

void Session::take_robot(std::vector<std::string>& words, std::size_t needed) {
  if (words.size() <= needed || !is_url(words.front())) return;
  options_.robot = words.front();
  words.erase(words.begin());
}

Result<client::Options> Session::client_options() const {
  client::Options options;
  client::Identity& identity = options.identity;
  identity.token_file = options_.token_file;
  identity.certificate_file = options_.certificate;
  identity.key_file = options_.key.empty() ? options_.certificate : options_.key;
  options.ca_file = options_.ca;
  if (!options_.user.empty()) {
    identity.user = options_.user;
    std::optional<std::string> password;
    if (const char* const given = std::getenv("LRT_PASSWORD")) {
      password = given;
    } else if (!options_.password_file.empty()) {
      Result<std::string> line = first_line(options_.password_file);
      if (!line) return unexpected(std::move(line).error());
      password = *std::move(line);
    } else {
      password = ask_password(options_.user);
    }
    if (!password) return unexpected(Errc::invalid_option, "no password for \"" + options_.user + "\"; set LRT_PASSWORD or give --password-file");
    identity.password = *std::move(password);
  }
  for (const std::string& field : options_.fields) {
    const std::size_t colon = field.find(':');
    const std::size_t value = colon == std::string::npos ? colon : field.find_first_not_of(" \t", colon + 1);
    if (colon == 0 || colon == std::string::npos) return unexpected(Errc::invalid_option, "--header \"" + field + "\": expected NAME:VALUE");
    identity.fields.emplace_back(field.substr(0, colon), value == std::string::npos ? std::string() : field.substr(value));
  }
  const auto time = std::chrono::milliseconds(static_cast<std::int64_t>(options_.timeout * 1000));
  options.limits.response_time = time;
  options.command_life = std::chrono::milliseconds(static_cast<std::int64_t>(options_.valid_for * 1000));
  options.limits.connect_time = std::min(time, options.limits.connect_time);
  options.limits.resolve_time = std::min(time, options.limits.resolve_time);
  options.cache_folder = cache_folder();
  options.cache_age = cache_age_;
  if (options_.verbose) options.log = [this](LogLevel, std::string_view text) { terminal_.print_error(printable(text) + "\n"); };
  return options;
}

Result<Client*> Session::client() {
  if (client_) return &*client_;
  Result<client::Options> options = client_options();
  if (!options) return unexpected(std::move(options).error());
  Result<Client> made = Client::create(*std::move(options));
  if (!made) return unexpected(std::move(made).error());
  client_.emplace(*std::move(made));
  return &*client_;
}

Result<const client::Robot*> Session::robot() {
  if (robot_) return &*robot_;
  if (options_.robot.empty()) return unexpected(Errc::invalid_option, "no robot is given: use --robot URL, or set LRT_ROBOT");
  const Result<Client*> client = this->client();
  if (!client) return unexpected(client.error());
  Result<client::Robot> found = (*client)->open(options_.robot);
  if (!found) {
    Error error = std::move(found).error();
    if (exit_of(error.code) == Exit::unreachable && error.message.find(options_.robot) == std::string::npos)
      error.message = "no response from " + options_.robot + ": " + error.message;
    return unexpected(std::move(error));
  }
  robot_.emplace(*std::move(found));
  if (options_.verbose)
    for (const std::string& problem : robot_->problems()) warn(problem);
  return &*robot_;
}

Result<client::Property> Session::property(const std::string& name) {
  if (is_url(name)) {
    const Result<Client*> client = this->client();
    if (!client) return unexpected(client.error());
    return (*client)->property(name);
  }
  const Result<const client::Robot*> robot = this->robot();
  if (!robot) return unexpected(robot.error());
  return (*robot)->property(name);
}

Result<client::Action> Session::action(const std::string& name) {
  if (is_url(name)) {
    const Result<Client*> client = this->client();
    if (!client) return unexpected(client.error());
    return (*client)->action(name);
  }
  const Result<const client::Robot*> robot = this->robot();
  if (!robot) return unexpected(robot.error());
  return (*robot)->action(name);
}

Result<client::Thing> Session::thing(const std::string& name) {
  if (is_url(name) && options_.robot.empty()) options_.robot = name;
  const Result<const client::Robot*> robot = this->robot();
  if (!robot) return unexpected(robot.error());
  return (*robot)->thing(name);
}

std::string Session::label(const std::string& url) const {
  if (robot_) {
    for (const client::Thing& thing : robot_->things()) {
      if (thing.url() == url) return printable(thing.name());
      for (const client::Property& property : thing.properties())
        if (property.url() == url) return printable(thing.name() + "/" + property.name());
      for (const client::Action& action : thing.actions())
        if (action.url() == url) return printable(thing.name() + "/" + action.name());
    }
  }
  const std::size_t host = url.find("://");
  const std::size_t path = host == std::string::npos ? host : url.find('/', host + 3);
  return printable(path == std::string::npos || path + 1 >= url.size() ? url : url.substr(path + 1));
}

void Session::warn(const std::string& sentence) const { terminal_.print_error("lrt: " + printable(sentence) + "\n"); }

}  // namespace lrt::tool
