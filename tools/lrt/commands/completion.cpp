// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {
namespace {

struct CompletionOptions {
  std::string shell;
};

// Both pass the words up to the cursor, and get one candidate a line. Where there is none, the shell offers files.
constexpr std::string_view bash_script = R"script(# bash completion of lrt. In ~/.bashrc: eval "$(lrt completion bash)"
_lrt() {
  local words=() word line i before=""
  for ((i = 1; i <= COMP_CWORD; i++)); do # readline splits at : and =
    word=${COMP_WORDS[i]}
    if ((${#words[@]} > 0)) && { [[ $word == [:=]* ]] || [[ ${words[-1]} == *[:=] ]]; }; then
      before=${words[-1]}
      [[ $word == [:=]* ]] && before+=$word
      words[-1]+=$word
    else
      before=""
      words+=("$word")
    fi
  done
  COMPREPLY=()
  while IFS= read -r line; do
    COMPREPLY+=("${line#"$before"}")
  done < <(lrt __complete "${words[@]}" 2>/dev/null)
  [[ ${COMPREPLY[0]} == *= ]] && compopt -o nospace # a value follows
}
complete -o default -F _lrt lrt
)script";

constexpr std::string_view zsh_script = R"script(#compdef lrt
# zsh completion of lrt. In ~/.zshrc, after compinit: eval "$(lrt completion zsh)"
_lrt() {
  local -a found
  found=("${(@f)$(lrt __complete "${(@Q)words[2,CURRENT]}" 2>/dev/null)}")
  if [[ ${found[1]} == *= ]]; then # a value follows
    compadd -S '' -- "${found[@]}"
  elif [[ -n ${found[1]} ]]; then
    compadd -- "${found[@]}"
  else
    _files
  fi
}
compdef _lrt lrt
)script";

Result<int> completion(Session& session, CompletionOptions& options) {
  return session.terminal().print(options.shell == "zsh" ? zsh_script : bash_script) ? Exit::success : Exit::failure;
}

/// Names come from the robot, and the shell inserts them into a command line: names with special characters of a shell are left out.
bool is_harmless(std::string_view name) {
  constexpr std::string_view allowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_./:@%+,-";
  if (!name.empty() && name.back() == '=') name.remove_suffix(1);  // a value follows
  return !name.empty() && name.front() != '-' && name.front() != '.' && name.size() < 200 &&
         name.find_first_not_of(allowed) == std::string_view::npos;
}

/// The words before the one to be completed, as far as they matter.
struct Typed {
  CLI::App* command = nullptr;
  std::vector<std::string> names;
  CLI::Option* waiting = nullptr;  ///< an option whose value comes next
};

CLI::Option* option_of(CLI::App& app, CLI::App* command, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  if (command)
    if (CLI::Option* const found = command->get_option_no_throw(name)) return found;
  return app.get_option_no_throw(name);
}

Typed read(CommandLine& line, const std::vector<std::string>& words) {
  GlobalOptions& options = line.options;
  Typed typed;
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    if (typed.waiting) {
      if (typed.waiting->get_single_name() == "robot") options.robot = word;
      else if (typed.waiting->get_single_name() == "token-file") options.token_file = word;
      else if (typed.waiting->get_single_name() == "ca") options.ca = word;
      typed.waiting = nullptr;
    } else if (word.size() > 1 && word.front() == '-') {
      CLI::Option* const option = option_of(line.app, typed.command, word);
      const std::size_t equals = word.find('=');
      if (option && option->get_type_size() != 0 && equals == std::string::npos) typed.waiting = option;
      if (option && equals != std::string::npos && option->get_single_name() == "robot") options.robot = word.substr(equals + 1);
    } else if (!typed.command) {
      const std::vector<CLI::App*> same = line.app.get_subcommands([&](const CLI::App* one) { return one->get_name() == word; });
      if (same.empty()) break;
      typed.command = same.front();
    } else if (typed.names.empty() && is_url(word)) {
      options.robot = word;
    } else {
      typed.names.push_back(word);
    }
  }
  return typed;
}

std::vector<std::string> names_of(const client::Robot& robot, const std::string& command) {
  std::vector<std::string> result;
  const bool things = command == "ls" || command == "subs" || command == "blueprint";
  const bool properties =
      command == "get" || command == "set" || command == "watch" || command == "record" || command == "blueprint" || command == "validate";
  const bool actions = command == "invoke" || command == "blueprint" || command == "validate";
  for (const client::Thing& thing : robot.things()) {
    if (things) result.push_back(thing.name());
    if (properties)
      for (const client::Property& property : thing.properties()) result.push_back(thing.name() + "/" + property.name());
    if (actions)
      for (const client::Action& action : thing.actions()) result.push_back(thing.name() + "/" + action.name());
  }
  return result;
}

std::vector<std::string> with_equals(std::vector<std::string> tags) {
  for (std::string& tag : tags) tag += '=';
  return tags;
}

/// Names of an enumeration, true and false, or the tags of a variant as "tag=".
std::vector<std::string> values_of(const client::Robot& robot, const std::string& command, const std::string& name) {
  std::optional<client::Schema> schema;
  const auto known = [&](const auto& found) { return found && (command == "set" || command == "invoke") ? found->declared() : nullptr; };
  if (const client::Declared* const declared = command == "set" ? known(robot.property(name)) : known(robot.action(name)))
    return declared->is_variant ? with_equals(declared->choices) : declared->choices;  // no request
  if (command == "set") {
    if (const auto property = robot.property(name)) schema = schema_of(property->shape());
  } else if (command == "invoke") {
    if (const auto action = robot.action(name)) schema = schema_of(action->input_shape());
  }
  if (!schema) return {};
  const rdf::Type& type = schema->type();
  if (type.kind == rdf::Type::Kind::boolean) return {"true", "false"};
  if (type.kind != rdf::Type::Kind::variant) return type.kind == rdf::Type::Kind::enumeration ? type.names : std::vector<std::string>();
  std::vector<std::string> tags;
  for (const rdf::FieldType& field : type.fields) tags.push_back(field.name);
  return with_equals(std::move(tags));
}

std::vector<std::string> values_of(const CLI::Option& option) {
  const std::string& name = option.get_single_name();
  if (name == "color") return {"auto", "always", "never"};
  if (name == "via") return {"websocket", "event-stream", "polling"};
  if (name == "format") return {"text", "json", "earl"};
  if (name == "unit")
    return {"rad",   "deg",   "turn", "m", "mm",  "cm", "s",   "ms", "min", "h", "m/s", "km/h",
            "rad/s", "deg/s", "rpm",  "N", "N.m", "kg", "Cel", "K",  "V",   "A", "%"};
  if (name == "accept" || name == "type")
    return {"text/turtle", "application/n-triples", "application/ld+json", "application/rdf+xml", "application/json",
            "text/plain",  "application/cbor"};
  return {};
}

}  // namespace

int complete(CommandLine& line, Session& session, const std::vector<std::string>& words) {
  GlobalOptions& options = line.options;
  if (const char* const robot = std::getenv("LRT_ROBOT")) options.robot = robot;
  if (const char* const file = std::getenv("LRT_TOKEN_FILE")) options.token_file = file;
  options.timeout = 2;
  session.accept_age(std::chrono::minutes(1));  // keys are pressed one after the other
  const std::string current = words.empty() ? std::string() : words.back();
  const Typed typed = read(line, words);
  static_cast<void>(session.choose_profile());
  std::vector<std::string> found;
  std::string prefix;  // of the current word, before what is completed
  if (typed.waiting) {
    found = values_of(*typed.waiting);
  } else if (current.size() > 0 && current.front() == '-') {
    const std::size_t equals = current.find('=');
    if (equals != std::string::npos) {
      if (const CLI::Option* const option = option_of(line.app, typed.command, current)) found = values_of(*option);
      prefix = current.substr(0, equals + 1);
    } else {
      for (CLI::App* const app : {typed.command, &line.app}) {
        if (!app) continue;
        for (const CLI::Option* const option : app->get_options())
          for (const std::string& name : option->get_lnames()) found.push_back("--" + name);
      }
    }
  } else if (!typed.command) {
    for (const CLI::App* const command : line.app.get_subcommands([](CLI::App*) { return true; })) found.push_back(command->get_name());
  } else if (typed.command->get_name() == "completion") {
    found = {"bash", "zsh"};
  } else if (const Result<const client::Robot*> robot = options.robot.empty() ? unexpected(Errc::closed, "") : session.robot()) {
    const std::string& command = typed.command->get_name();
    const bool takes_many = command == "watch" || command == "record";
    if (typed.names.empty() || takes_many) found = names_of(**robot, command);
    else if (typed.names.size() == 1) found = values_of(**robot, command, typed.names.front());
    found.erase(std::remove_if(found.begin(), found.end(), [](const std::string& name) { return !is_harmless(name); }), found.end());
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::string text;
  for (const std::string& one : found)
    if ((prefix + one).substr(0, current.size()) == current) text += prefix + one + "\n";
  session.terminal().print(text);
  return Exit::success;
}

void add_completion(CommandLine& line) {
  auto options = std::make_shared<CompletionOptions>();
  CLI::App* const command = line.add("completion", "Print a script that completes commands, options and the names of the robot",
                                     "Examples:\n"
                                     "  eval \"$(lrt completion bash)\"         # in ~/.bashrc\n"
                                     "  eval \"$(lrt completion zsh)\"          # in ~/.zshrc, after compinit",
                                     options, completion);
  command->add_option("SHELL", options->shell, "bash or zsh")->required()->type_name("bash|zsh")->check(CLI::IsMember({"bash", "zsh"}));
}

}  // namespace lrt::tool
