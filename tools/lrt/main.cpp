// SPDX-License-Identifier: Apache-2.0
// The command lrt: robots that are Linked Robotic Things, from a shell. docs/command.md has a tour, lrt.1 all options.

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <string>
#include <string_view>

#include <lrt/version.hpp>

#include "tools/lrt/arguments.hpp"
#include "tools/lrt/command_line.hpp"

namespace {

using namespace lrt::tool;

void add_global_options(CommandLine& line) {
  CLI::App& app = line.app;
  GlobalOptions& options = line.options;
  app.set_version_flag("--version", "lrt " LRT_VERSION);
  app.formatter(std::make_shared<Help>());
  app.require_subcommand(1);
  app.option_defaults()->group("Options");
  app.add_option("-r,--robot", options.robot, "A URL of the robot, or of one of its Things, or the name of a profile")
      ->envname("LRT_ROBOT")
      ->type_name("URL|PROFILE");
  app.add_option("--token-file", options.token_file, "A file whose first line is a bearer token")->envname("LRT_TOKEN_FILE")->type_name("FILE");
  app.add_option("--user", options.user, "A user of HTTP Basic; the password is that of LRT_PASSWORD, --password-file, or asked for")
      ->type_name("NAME");
  app.add_option("--password-file", options.password_file, "A file whose first line is the password")->type_name("FILE");
  app.add_option("--ca", options.ca, "Certificate authorities, PEM, instead of the system's")->type_name("FILE");
  app.add_option("--cert", options.certificate, "A certificate of the client, PEM")->type_name("FILE");
  app.add_option("--key", options.key, "Its private key, PEM; default: in the file of --cert")->type_name("FILE");
  app.add_option("--header", options.fields, "A further header field of each request")
      ->type_name("NAME:VALUE")
      ->take_all()
      ->type_size(1)
      ->expected(1);
  app.add_option("--timeout", options.timeout, "The time for one response, 10 s by default")->type_name("SECONDS")->check(number_from(0.001, 86400));
  app.add_option(
         "--valid-for", options.valid_for,
         "How long a command is worth carrying out, 2s by default: the robot does not carry it out later, and within that time it is said whether "
         "it is confirmed; 0: without a limit")
      ->type_name("DURATION")
      ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"ms", 0.001}, {"s", 1}, {"min", 60}}).description(""))
      ->check(CLI::Range(0.0, 86400.0).description(""));
  app.add_option("--color", options.colour, "Colours: auto, always or never")
      ->type_name("WHEN")
      ->transform(one_of<Terminal::Colour>(
          {{"auto", Terminal::Colour::automatic}, {"always", Terminal::Colour::always}, {"never", Terminal::Colour::never}}));
  app.add_flag("-v,--verbose", options.verbose, "Requests and statuses on standard error");
  app.footer(
      "Examples:\n"
      "  export LRT_ROBOT=http://127.0.0.1:8080/\n"
      "  lrt ls                                  # the Things of the robot\n"
      "  lrt ls right_s1                         # its properties and actions\n"
      "  lrt get right_s1/position --unit deg\n"
      "  lrt set right_s1/friction 1.5\n"
      "  lrt invoke right_s1/rotate 0.5rad       # Ctrl-C cancels\n"
      "  lrt watch right_s1/position --plot\n\n"
      "Exit status: 0 success; 1 refused or failed; 2 usage; 3 the robot does not respond; 4 the invocation was cancelled;\n"
      "129 the terminal was closed; 130 Ctrl-C; 141 the reader of the output has ended; 143 SIGTERM.");
  add_ls(line);
  add_get(line);
  add_set(line);
  add_invoke(line);
  add_watch(line);
  add_record(line);
  add_replay(line);
  add_subs(line);
  add_mirror(line);
  add_blueprint(line);
  add_validate(line);
  add_generate(line);
  add_query(line);
  add_check(line);
  add_completion(line);
}

int report(const Terminal& terminal, const std::string& sentence, int status) {
  terminal.print_error("lrt: " + printable(sentence) + "\n");
  return status;
}

int run(int argc, char** argv) {
  CommandLine line;
  add_global_options(line);
  Session session(line.options);
  Terminal& terminal = session.terminal();
  if (argc > 1 && std::string_view(argv[1]) == "__complete") return complete(line, session, {argv + 2, argv + argc});
  lrt::Result<Arguments> arguments = Arguments::separate(line.app, {argv + std::min(argc, 1), argv + argc});
  if (!arguments) return report(terminal, arguments.error().message, Exit::usage);
  try {
    line.app.parse(arguments->reversed());
  } catch (const CLI::CallForHelp&) {
    return terminal.print(line.app.help()) ? Exit::success : Exit::failure;
  } catch (const CLI::CallForVersion& version) {
    return terminal.print_line(version.what()) ? Exit::success : Exit::failure;
  } catch (const CLI::ParseError& error) {
    if (!arguments->command()) return report(terminal, "a command is missing; see lrt --help", Exit::usage);
    std::string sentence = error.what();
    if (const std::size_t end = sentence.find_last_not_of(" \n."); end != std::string::npos) sentence.resize(end + 1);
    return report(terminal, sentence + "; see lrt " + arguments->command()->get_name() + " --help", Exit::usage);
  }
  terminal.set_colour(line.options.colour);
  if (const lrt::Result<void> chosen = session.choose_profile(); !chosen) return report(terminal, chosen.error().message, Exit::usage);
  const lrt::Result<int> result = line.run(session);
  if (terminal.failed() == EPIPE) return Exit::pipe_closed;
  if (!result) return report(terminal, result.error().message, exit_of(result.error().code));
  if (terminal.failed() != 0)
    return report(terminal, std::string("cannot write to standard output: ") + std::strerror(terminal.failed()), Exit::failure);
  return *result;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // write() reports the error
  try {
    return run(argc, argv);
  } catch (const std::exception& error) { return report(Terminal(), error.what(), Exit::failure); }
}
