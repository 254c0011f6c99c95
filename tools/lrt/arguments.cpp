// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/arguments.hpp"

#include <algorithm>
#include <cctype>
#include <limits>
#include <string_view>

#include "tools/lrt/suggest.hpp"
#include "tools/lrt/terminal.hpp"

namespace lrt::tool {
namespace {

constexpr char mark = '\x01';
using Values = std::vector<std::string>;

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// A negative number or duration, which is a value and no option.
bool is_negative_value(std::string_view text) noexcept {
  if (text.size() < 2 || text.front() != '-') return false;
  const std::string_view rest = text.substr(1);
  if (is_digit(rest[0]) || (rest[0] == '.' && rest.size() > 1 && is_digit(rest[1]))) return true;
  if (rest[0] == 'P' && rest.size() > 1 && (is_digit(rest[1]) || rest[1] == 'T')) return true;
  for (const std::string_view infinite : {"inf", "INF", "Infinity", "infinity"})
    if (rest == infinite) return true;
  return false;
}

std::vector<CLI::App*> subcommands(CLI::App& app) {
  return app.get_subcommands([](CLI::App*) { return true; });
}

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* const option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

bool is_flag(const CLI::Option& option) { return option.get_items_expected_max() == 0; }

/// As the help shows it: "[ROBOT] NAME VALUE".
std::string usage_of(const CLI::App& command) {
  std::string usage;
  for (const CLI::Option* const option : command.get_options())
    if (option->get_positional()) usage += (usage.empty() ? "" : " ") + option->get_type_name();
  return usage;
}

class Separator {
 public:
  Separator(CLI::App& app, const std::vector<std::string>& given) : app_(app), given_(given), values_(std::make_shared<Values>()) {}

  Result<std::vector<std::string>> run() {
    bool only_words = false;
    for (; at_ < given_.size(); ++at_) {
      const std::string& one = given_[at_];
      Result<void> taken;
      if (!only_words && one == "--") only_words = true;
      else if (only_words || one == "-" || one.empty() || one.front() != '-' || is_negative_value(one)) taken = word(one);
      else taken = one[1] == '-' ? long_option(one) : short_options(one);
      if (!taken) return unexpected(std::move(taken).error());
    }
    if (command_ && !asks_for_help_)
      if (Result<void> enough = count_words(); !enough) return unexpected(std::move(enough).error());
    translate(app_);
    for (CLI::App* const command : subcommands(app_)) translate(*command);
    std::vector<std::string> parts = std::move(global_);
    if (command_) parts.push_back(command_->get_name());
    parts.insert(parts.end(), words_.begin(), words_.end());
    parts.insert(parts.end(), own_.begin(), own_.end());
    return parts;
  }
  const CLI::App* command() const noexcept { return command_; }

 private:
  static Unexpected wrong(const std::string& sentence) { return unexpected(Errc::invalid_option, sentence); }
  std::string help() const { return "; see lrt " + (command_ ? command_->get_name() + " " : std::string()) + "--help"; }

  std::string or_help(const std::string& hint) const { return hint.empty() ? help() : hint; }

  std::string placeholder(const std::string& value) {
    values_->push_back(value);
    return mark + std::to_string(values_->size() - 1);
  }

  /// Each option translates placeholders before it checks the value.
  void translate(CLI::App& app) {
    for (CLI::Option* const option : app.get_options()) {
      if (!option->get_positional()) option->allow_extra_args(false);  // it has as many values as it needs
      option->transform([values = values_](std::string value) {
        if (value.size() < 2 || value.front() != mark || value.find_first_not_of("0123456789", 1) != std::string::npos || value.size() > 9)
          return value;
        const std::size_t index = std::stoul(value.substr(1));
        return index < values->size() ? (*values)[index] : value;
      });
    }
  }

  Result<void> word(const std::string& text) {
    if (!command_) {
      const std::vector<CLI::App*> all = subcommands(app_);
      const auto named = std::find_if(all.begin(), all.end(), [&](const CLI::App* command) { return command->get_name() == text; });
      if (named == all.end()) return wrong("there is no command \"" + printable(text) + "\"" + or_help(did_you_mean(text, commands_of(app_))));
      command_ = *named;
      return {};
    }
    words_.push_back(placeholder(text));
    return {};
  }

  CLI::Option* find(const std::string& name) {
    if (command_)
      if (CLI::Option* const option = command_->get_option_no_throw(name)) return option;
    return app_.get_option_no_throw(name);
  }
  /// Where CLI11 looks for it.
  std::vector<std::string>& place_of(const std::string& name) { return command_ && command_->get_option_no_throw(name) ? own_ : global_; }

  Unexpected unknown(const std::string& name) {
    for (CLI::App* const command : subcommands(app_))
      if (!command_ && command->get_option_no_throw(name))
        return wrong("write \"" + name + "\" after the command, as in: lrt " + command->get_name() + " " + name);
    std::vector<std::string> names = options_of(app_);
    if (command_)
      for (std::string& own : options_of(*command_)) names.push_back(std::move(own));
    const std::string where = command_ ? command_->get_name() + " has no option \"" : "there is no option \"";
    std::string meant = did_you_mean(name, names);
    if (meant.empty() && command_ && usage_of(*command_).find("VALUE") != std::string::npos) meant = "; before a value that begins with -, write --";
    return wrong(where + printable(name) + "\"" + or_help(meant));
  }

  Result<void> long_option(const std::string& given) {
    const std::size_t equals = given.find('=');
    const std::string name = given.substr(0, equals);
    CLI::Option* const option = find(name);
    if (!option) return unknown(name);
    std::vector<std::string>& place = place_of(name);
    if (is_flag(*option)) {
      if (equals != std::string::npos) return wrong(name + " takes no value" + help());
      asks_for_help_ = asks_for_help_ || name == "--help" || name == "--version";
      place.push_back(name);
      return {};
    }
    return values(*option, name, place, equals == std::string::npos ? nullptr : &given, equals + 1);
  }

  Result<void> short_options(const std::string& given) {
    for (std::size_t i = 1; i < given.size(); ++i) {
      const std::string name{'-', given[i]};
      CLI::Option* const option = find(name);
      if (!option) return unknown(i == 1 ? given : name);
      std::vector<std::string>& place = place_of(name);
      if (!is_flag(*option)) return values(*option, name, place, i + 1 < given.size() ? &given : nullptr, i + 1);
      asks_for_help_ = asks_for_help_ || name == "-h";
      place.push_back(name);
    }
    return {};
  }

  /// @param attached  its first value is a part of this argument, from `begin`
  Result<void> values(CLI::Option& option, const std::string& name, std::vector<std::string>& place, const std::string* attached, std::size_t begin) {
    std::vector<std::string> found;
    if (attached) found.push_back(placeholder(attached->substr(begin)));
    const auto wanted = static_cast<std::size_t>(std::max(option.get_type_size(), 1));
    while (found.size() < wanted) {
      const bool is_option =
          at_ + 1 < given_.size() && given_[at_ + 1].size() > 2 && given_[at_ + 1].compare(0, 2, "--") == 0 && find(given_[at_ + 1]);
      if (at_ + 1 >= given_.size() || is_option) {
        std::string type = option.get_type_name();
        if (type.find(':') != std::string::npos && type.compare(0, 5, "NAME:") != 0 && type.compare(0, 8, "ADDRESS:") != 0)
          type.resize(type.find(':'));
        return wrong(name + " needs a value: " + type + help());
      }
      found.push_back(placeholder(given_[++at_]));
    }
    if (found.size() == 1 && name[1] == '-') {
      place.push_back(name + "=" + found.front());
      return {};
    }
    place.push_back(name);
    place.insert(place.end(), found.begin(), found.end());
    return {};
  }

  Result<void> count_words() const {
    std::size_t least = 0, most = 0;
    for (const CLI::Option* const option : command_->get_options()) {
      if (!option->get_positional()) continue;
      const auto max = static_cast<std::size_t>(option->get_items_expected_max());
      if (option->get_required()) least += static_cast<std::size_t>(std::max(option->get_items_expected_min(), 1));
      most = max > std::numeric_limits<int>::max() - most ? std::numeric_limits<int>::max() : most + max;
    }
    const std::string usage = usage_of(*command_), &name = command_->get_name();
    if (words_.size() < least) return wrong(name + " needs " + usage + help());
    if (words_.size() > most)
      return wrong(name + " takes " + (usage.empty() ? "no name" : usage) + ", found \"" +
                   printable(values_->at(std::stoul(words_[most].substr(1)))) + "\" as well" + help());
    return {};
  }

  CLI::App& app_;
  const std::vector<std::string>& given_;
  std::size_t at_ = 0;
  const std::shared_ptr<Values> values_;
  CLI::App* command_ = nullptr;
  std::vector<std::string> global_, own_, words_;
  bool asks_for_help_ = false;
};

}  // namespace

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names{"help"};
  for (const CLI::App* const command : app.get_subcommands([](const CLI::App*) { return true; })) names.push_back(command->get_name());
  return names;
}

Result<Arguments> Arguments::separate(CLI::App& app, const std::vector<std::string>& given) {
  // "lrt help get" is "lrt get --help".
  std::vector<std::string> asked;
  if (!given.empty() && given.front() == "help") {
    asked.assign(given.begin() + 1, given.end());
    asked.resize(std::min<std::size_t>(asked.size(), 1));
    asked.emplace_back("--help");
  }
  const std::vector<std::string>& words = asked.empty() ? given : asked;
  Separator separator(app, words);
  Result<std::vector<std::string>> parts = separator.run();
  if (!parts) return unexpected(std::move(parts).error());
  Arguments result;
  result.parts_ = *std::move(parts);
  result.command_ = separator.command();
  return result;
}

}  // namespace lrt::tool
