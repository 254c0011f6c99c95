// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/command_line.hpp"

#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/base/utf8.hpp"
#include "tools/lrt/cache.hpp"
#include "tools/lrt/naming.hpp"
#include "tools/lrt/suggest.hpp"

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

CLI::Validator one_of(std::vector<std::string> words) {
  return CLI::Validator(
      [words = std::move(words)](std::string& given) {
        if (std::find(words.begin(), words.end(), given) != words.end()) return std::string();
        std::string text = "expected ";
        for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
        return text + ", found \"" + printable(given) + "\"";
      },
      "");
}

CLI::Validator number_from(double low, double high) {
  return CLI::Validator(
      [low, high](std::string& given) {
        const std::optional<double> number = rdf::lexical::parse_double(given);
        if (number && *number >= low && *number <= high) return std::string();
        char text[100];
        std::snprintf(text, sizeof text, "expected a number from %.15g to %.15g", low, high);
        return text + (", found \"" + printable(given) + "\"");
      },
      "");
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

bool has_same_origin(std::string_view a, std::string_view b) noexcept {
  const auto origin = [](std::string_view url) {
    const std::size_t host = url.find("://");
    return url.substr(0, host == std::string_view::npos ? host : url.find_first_of("/?#", host + 3));
  };
  return is_url(a) && origin(a) == origin(b);
}

Result<void> Session::choose_profile() {
  if (is_url(options_.robot)) return {};
  const Result<Profiles> profiles = Profiles::read();
  if (!profiles) return unexpected(profiles.error());
  const bool is_default = options_.robot.empty();
  if (is_default) options_.robot = profiles->default_robot();
  if (options_.robot.empty() || is_url(options_.robot)) return {};
  const Profile* const found = profiles->find(options_.robot);
  if (!found) {
    const std::string& name = options_.robot;
    const std::vector<std::string> names = profiles->names();
    std::string known = did_you_mean(name, names);
    if (known.empty() && (names.empty() || name.find_first_of(".:/") != std::string::npos)) known = "; a URL begins with http:// or https://";
    if (known.empty())
      for (const std::string& one : names) known += (known.empty() ? "; profiles are " : ", ") + one;
    return unexpected(Errc::invalid_option, "\"" + name + "\" is neither a URL nor a profile" +
                                                (profiles->file().empty() ? std::string() : " of " + profiles->file()) + known);
  }
  if (Result<void> judged = judge_secrets(*found); !judged) return judged;
  profile_ = *found;
  options_.robot = found->robot;
  return {};
}

void Session::use_robot(const std::string& url) {
  if (options_.robot != url) robot_.reset();
  if (profile_ && !has_same_origin(url, profile_->robot)) {
    profile_.reset();
    client_.reset();
  }
  options_.robot = url;
}

void Session::take_robot(std::vector<std::string>& words, std::size_t needed) {
  if (words.size() <= needed || !is_url(words.front())) return;
  use_robot(words.front());
  words.erase(words.begin());
}

Result<client::Options> Session::client_options() const {
  client::Options options;
  client::Identity& identity = options.identity;
  const Profile none, &profile = profile_ ? *profile_ : none;
  const auto chosen = [](const std::string& option, const std::string& of_profile) { return option.empty() ? of_profile : option; };
  const bool names_user = !options_.user.empty() || !options_.token_file.empty();  // not one of the command line with a secret of the profile
  identity.token_file = names_user ? options_.token_file : profile.token_file;
  identity.certificate_file = chosen(options_.certificate, profile.certificate);
  const std::string key = options_.certificate.empty() ? chosen(options_.key, profile.key) : options_.key;
  identity.key_file = key.empty() ? identity.certificate_file : key;
  options.ca_file = chosen(options_.ca, profile.ca);
  const std::string user = names_user ? options_.user : profile.user;
  const std::string password_file = chosen(options_.password_file, names_user ? std::string() : profile.password_file);
  if (!user.empty()) {
    identity.user = user;
    std::optional<std::string> password;
    if (const char* const given = std::getenv("LRT_PASSWORD")) {
      password = given;
    } else if (!password_file.empty()) {
      Result<std::string> line = first_line(password_file);
      if (!line) return unexpected(std::move(line).error());
      password = *std::move(line);
    } else {
      password = ask_password(user);
    }
    if (!password) return unexpected(Errc::invalid_option, "no password for \"" + user + "\"; set LRT_PASSWORD or give --password-file");
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
  if (options_.robot.empty())
    return unexpected(Errc::invalid_option, "no robot is given: use --robot URL, set LRT_ROBOT, or name one in a file of profiles");
  const Result<Client*> client = this->client();
  if (!client) return unexpected(client.error());
  Result<client::Robot> found = (*client)->open(options_.robot);
  if (!found) {
    Error error = std::move(found).error();
    if (exit_of(error.code) == Exit::unreachable && error.message.find(options_.robot) == std::string::npos)
      error.message = "no response from " + options_.robot + ": " + error.message;
    return unexpected(std::move(error));
  }
  if (std::optional<Error> other = elsewhere(**client, *found)) return unexpected(*std::move(other));
  if (found->things().empty()) return unexpected(Errc::unknown_path, no_things(**client, *found));
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
  Result<client::Property> found = (*robot)->property(name);
  if (!found) return unexpected(explained(**robot, name, Named::property, found.error()));
  return found;
}

Result<client::Action> Session::action(const std::string& name) {
  if (is_url(name)) {
    const Result<Client*> client = this->client();
    if (!client) return unexpected(client.error());
    return (*client)->action(name);
  }
  const Result<const client::Robot*> robot = this->robot();
  if (!robot) return unexpected(robot.error());
  Result<client::Action> found = (*robot)->action(name);
  if (!found) return unexpected(explained(**robot, name, Named::action, found.error()));
  return found;
}

Result<client::Thing> Session::thing(const std::string& name) {
  if (is_url(name)) {
    if (has_same_origin(name, options_.robot))
      if (const Result<const client::Robot*> robot = this->robot())
        if (Result<client::Thing> found = (*robot)->thing(name)) return found;
    use_robot(name);
  }
  const Result<const client::Robot*> robot = this->robot();
  if (!robot) return unexpected(robot.error());
  Result<client::Thing> found = (*robot)->thing(is_url(name) ? (*robot)->url() : name);  // after redirects
  if (!found) return unexpected(explained(**robot, name, Named::thing, found.error()));
  return found;
}

Result<std::optional<client::Thing>> Session::take_thing(std::vector<std::string>& words) {
  if (words.size() > 1) {
    if (!is_url(words.front()))
      return unexpected(Errc::invalid_option, "expected one name, found \"" + words[0] + "\" and \"" + words[1] + "\"; a robot is given by its URL");
    use_robot(words.front());
    words.erase(words.begin());
  }
  if (words.empty()) return std::optional<client::Thing>();
  if (is_url(words.front())) {
    const std::string& url = words.front();
    const std::size_t path = url.find('/', url.find("://") + 3);
    if (path == std::string::npos || path + 1 == url.size()) {  // the list of Things
      use_robot(url);
      return std::optional<client::Thing>();
    }
  }
  Result<client::Thing> found = thing(words.front());
  if (found) return std::optional<client::Thing>(*std::move(found));
  // A list of Things that is not at the root of its server.
  if (is_url(words.front()) && found.error().code == Errc::unknown_path && robot_) return std::optional<client::Thing>();
  return unexpected(std::move(found).error());
}

Result<std::vector<NamedProperty>> Session::properties(const std::string& word, bool observes) {
  if (is_url(word)) {
    const auto of = [this](const client::Thing& thing) { return properties_of(thing); };
    if (robot_ || has_same_origin(word, options_.robot))
      if (const Result<const client::Robot*> robot = this->robot())
        if (const Result<client::Thing> found = (*robot)->thing(word)) return of(*found);
    const Result<Client*> client = this->client();
    if (!client) return unexpected(client.error());
    Result<client::Property> property = (*client)->property(word);
    if (!property) return unexpected(std::move(property).error());
    const Result<client::RepresentationPtr> read = property->get();
    // One value is read where it is. What else is done with the resource needs its own name.
    if (read && (observes || mentions_thing((*read)->graph)))
      if (std::optional<Error> other = elsewhere((*read)->url, (*read)->graph)) return unexpected(*std::move(other));
    if (read && is_thing(**read)) {
      const Result<client::Thing> found = thing(word);
      if (!found) return unexpected(found.error());
      return of(*found);
    }
    std::string name = label(property->url());
    return std::vector<NamedProperty>{{std::move(name), *std::move(property)}};
  }
  const Result<const client::Robot*> robot = this->robot();
  if (!robot) return unexpected(robot.error());
  Result<client::Property> property = (*robot)->property(word);
  if (property) {
    const std::string name = name_of((*robot)->things(), property->url());
    return std::vector<NamedProperty>{{name.empty() ? word : name, *std::move(property)}};
  }
  if (const Result<client::Thing> found = (*robot)->thing(word)) {
    std::vector<NamedProperty> all = properties_of(*found);
    if (all.empty()) return unexpected(Errc::unknown_path, "the Thing \"" + word + "\" has no property");
    return all;
  }
  if (is_pattern(word)) {
    std::vector<NamedProperty> all = fitting(**robot, word);
    if (all.empty()) return unexpected(Errc::unknown_path, "no property of \"" + (*robot)->url() + "\" fits the pattern \"" + word + "\"");
    return all;
  }
  return unexpected(explained(**robot, word, Named::property, property.error()));
}

std::string Session::label(const std::string& url) const {
  if (robot_) {
    if (const std::string name = name_of(robot_->things(), url); !name.empty()) return printable(name);
  }
  const std::size_t host = url.find("://");
  const std::size_t path = host == std::string::npos ? host : url.find('/', host + 3);
  const std::string rest = path == std::string::npos || path + 1 >= url.size() ? url : url.substr(path + 1);
  const Result<std::string> decoded = iri::decode(rest);
  return printable(decoded ? *decoded : rest);
}

void Session::warn(const std::string& sentence) const { terminal_.print_error("lrt: " + printable(sentence) + "\n"); }

}  // namespace lrt::tool
