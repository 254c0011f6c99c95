// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include <lrt/client.hpp>

#include "tools/lrt/profiles.hpp"
#include "tools/lrt/terminal.hpp"
#include "tools/lrt/values.hpp"

namespace lrt::tool {

/// The exit status of the command.
enum Exit : int {
  success = 0,
  failure = 1,        ///< the robot refused or failed, or there is no such name
  usage = 2,          ///< the command line is wrong, or a file of it cannot be used
  unreachable = 3,    ///< no response, or a response that is not HTTP
  cancelled = 4,      ///< the invocation was cancelled, by the robot or by another client
  hung_up = 129,      ///< the terminal was closed (SIGHUP)
  interrupted = 130,  ///< Ctrl-C
  pipe_closed = 141,  ///< the reader of standard output has closed it
  terminated = 143,   ///< SIGTERM
};
int exit_of(Errc code) noexcept;

/// The options that all commands have.
struct GlobalOptions {
  std::string robot, token_file, user, password_file, ca, certificate, key;
  std::vector<std::string> fields;
  double timeout = 10, valid_for = 2;  ///< [s]
  Terminal::Colour colour = Terminal::Colour::automatic;
  bool verbose = false;
};

/// A property with the name that a person writes: "right_s1/friction". It is not yet printable.
struct NamedProperty {
  std::string name;
  client::Property property;
};

/// The context of a command: the terminal, a client, and the robot, which is found on first use.
class Session {
 public:
  explicit Session(GlobalOptions& options) : options_(options) {}

  Terminal& terminal() noexcept { return terminal_; }
  const GlobalOptions& options() const noexcept { return options_; }

  /// Uses the profile that --robot or LRT_ROBOT names, or the default one if there is neither. To be called before the robot is used.
  /// @par Errors  invalid_option: no such profile, or a file that others can change or read
  Result<void> choose_profile();

  /// A first word that is a URL is that of the robot, if more words follow than are needed.
  void take_robot(std::vector<std::string>& words, std::size_t needed);
  /// "[ROBOT] [NAME]": the Thing with that name, or whose URL it is. A URL is always the robot's, whatever --robot says. nullopt: no Thing is named.
  /// @par Errors  as thing()
  Result<std::optional<client::Thing>> take_thing(std::vector<std::string>& words);

  /// What a robot is may be as old as this: it is used without a request.
  void accept_age(std::chrono::seconds age) noexcept { cache_age_ = age; }

  /// Uses another robot than that of --robot. The credentials of a profile are not sent to it, if it has another origin.
  void use_robot(const std::string& url);

  /// The options of each client of this command: made here only.
  /// @par Errors  invalid_option
  Result<client::Options> client_options() const;
  /// @par Errors  invalid_option
  Result<Client*> client();
  /// @par Errors  invalid_option: no URL is given; unknown_path: it has no Thing; those of Client::open()
  Result<const client::Robot*> robot();
  /// By a name, or by a URL: then nothing else of the robot is read. An error says which part of the name is unknown, or what it is instead.
  Result<client::Property> property(const std::string& name);
  /// The properties that a word stands for: one, those of a Thing, or those that a pattern with * and ? fits ("right_*/position", "*/effort", "left_*").
  /// @par Errors  as property()
  /// @param observes  their changes are wanted, which name their resource
  Result<std::vector<NamedProperty>> properties(const std::string& word, bool observes = false);
  Result<client::Action> action(const std::string& name);
  Result<client::Thing> thing(const std::string& name);
  /// "right_s1/friction"; of what is known by its URL alone, the path of that.
  std::string label(const std::string& url) const;

  /// A sentence on standard error.
  void warn(const std::string& sentence) const;

 private:
  GlobalOptions& options_;
  Terminal terminal_;
  std::optional<Client> client_;
  std::optional<client::Robot> robot_;
  std::chrono::seconds cache_age_{0};
  std::optional<Profile> profile_;
};

/// The first line of a file.
/// @par Errors  invalid_option: it cannot be read
Result<std::string> first_line(const std::string& name);

bool is_url(std::string_view text) noexcept;
/// Whether two URLs begin with the same scheme, host and port.
bool has_same_origin(std::string_view a, std::string_view b) noexcept;

/// A value out of a few words: "expected auto, always or never, found \"purple\"".
CLI::Validator one_of(std::vector<std::string> words);
/// The same for an option that is an enumeration.
template <class Enum>
CLI::Validator one_of(const std::vector<std::pair<std::string, Enum>>& words) {
  std::vector<std::string> names;
  for (const auto& [name, value] : words) names.push_back(name);
  return CLI::Validator(
      [words, check = one_of(names)](std::string& given) {
        std::string fault = check(given);
        for (const auto& [name, value] : words)
          if (name == given) return given = std::to_string(static_cast<int>(value)), std::string();
        return fault;
      },
      "");
}
/// A number from `low` to `high`: "expected a number from 0 to 10, found \"many\"".
CLI::Validator number_from(double low, double high);

/// The text of --help: what follows a command is said by the type of its positional option, "[ROBOT] NAME VALUE".
class Help : public CLI::Formatter {
 public:
  std::string make_usage(const CLI::App* app, std::string name) const override;
  std::string make_positionals(const CLI::App* app) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
};

/// The options, the commands, and which one was given.
struct CommandLine {
  CLI::App app{"Uses robots that are Linked Robotic Things.", "lrt"};
  GlobalOptions options;
  std::function<Result<int>(Session&)> run;

  /// Adds a command. `Options` is made once and lives as long as the command line.
  template <class Options>
  CLI::App* add(const std::string& name, const std::string& summary, const std::string& examples, std::shared_ptr<Options> given,
                Result<int> (*command)(Session&, Options&)) {
    CLI::App* const added = app.add_subcommand(name, summary);
    added->fallthrough();
    added->footer(examples + "\n\nOptions of all commands: lrt --help");
    added->callback([this, given, command] { run = [given, command](Session& session) { return command(session, *given); }; });
    return added;
  }
};

// One file each in commands/.
void add_ls(CommandLine& line);
void add_get(CommandLine& line);
void add_set(CommandLine& line);
void add_invoke(CommandLine& line);
void add_watch(CommandLine& line);
void add_record(CommandLine& line);
void add_replay(CommandLine& line);
void add_subs(CommandLine& line);
void add_mirror(CommandLine& line);
void add_blueprint(CommandLine& line);
void add_validate(CommandLine& line);
void add_generate(CommandLine& line);
void add_query(CommandLine& line);
void add_check(CommandLine& line);
void add_completion(CommandLine& line);

/// What the scripts of `lrt completion` call: prints the words that the last one can become, one a line.
int complete(CommandLine& line, Session& session, const std::vector<std::string>& words);

}  // namespace lrt::tool
