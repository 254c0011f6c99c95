// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include <lrt/codegen.hpp>
#include <lrt/rdf/codec.hpp>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {
namespace {

struct GenerateOptions {
  std::vector<std::string> words;
  std::string output, check, name_space = "robot";
};

/// The documents of a robot: of one that responds, or in a file.
Result<rdf::Graph> documents(Session& session, GenerateOptions& options) {
  if (!options.words.empty() && !is_url(options.words.front())) {
    const Result<Body> file = body_of("@" + options.words.front(), {});
    if (!file) return unexpected(file.error());
    rdf::ReadOptions read;
    read.base = "http://robot.example/";
    read.max_triples = 2'000'000;
    Result<rdf::Graph> graph = rdf::read(file->bytes, rdf::syntax_of(file->media_type).value_or(rdf::Syntax::turtle), read);
    if (graph) return graph;
    return unexpected(Errc::invalid_option,
                      "\"" + options.words.front() + "\", line " + std::to_string(graph.error().line) + ": " + graph.error().message);
  }
  if (!options.words.empty()) session.use_robot(options.words.front());
  const Result<const client::Robot*> robot = session.robot();
  if (!robot) return unexpected(robot.error());
  const Result<Client*> client = session.client();
  if (!client) return unexpected(client.error());
  std::vector<std::string> problems;
  Result<rdf::Graph> graph = client::read_documents(**client, **robot, problems);
  for (const std::string& problem : problems) session.warn(problem);
  return graph;
}

/// Written to a temporary file first, so that a build never reads an incomplete header.
Result<void> replace_file(const std::string& name, std::string_view text) {
  const std::string beside = name + ".new";
  const auto failed = [&](const std::string& what) {
    const int error = errno;
    ::unlink(beside.c_str());
    return unexpected(Errc::invalid_option, "cannot write \"" + what + "\": " + std::strerror(error));
  };
  const int descriptor = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) return failed(beside);
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const Unexpected error = failed(beside);
      ::close(descriptor);
      return error;
    }
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  if (::close(descriptor) != 0) return failed(beside);
  if (::rename(beside.c_str(), name.c_str()) != 0) return failed(name);
  return {};
}

Result<int> generate(Session& session, GenerateOptions& options) {
  if (options.words.size() > 1) return unexpected(Errc::invalid_option, "generate takes one URL or file");
  const Result<rdf::Graph> graph = documents(session, options);
  if (!graph) return unexpected(graph.error());
  const Result<client::Description> robot = client::describe(*graph);
  if (!robot) return unexpected(robot.error());
  if (!options.check.empty()) {
    const Result<Body> header = body_of("@" + options.check, "text/plain");
    if (!header) return unexpected(header.error());
    const Result<std::vector<std::string>> differences = codegen::check(header->bytes, *robot);
    if (!differences) return unexpected(differences.error().code, "\"" + options.check + "\": " + differences.error().message);
    std::string text;
    for (const std::string& difference : *differences) text += printable(difference) + "\n";
    session.terminal().print(text);
    return differences->empty() ? Exit::success : Exit::failure;
  }
  codegen::GenerateOptions how;
  how.name_space = options.name_space;
  const Result<codegen::Generated> made = codegen::generate(*robot, how);
  if (!made) return unexpected(made.error());
  for (const std::string& warning : made->warnings) session.warn(warning);
  if (options.output.empty() || options.output == "-") return session.terminal().print(printable_lines(made->header)) ? Exit::success : Exit::failure;
  if (Result<void> written = replace_file(options.output, made->header); !written) return unexpected(std::move(written).error());
  return Exit::success;
}

}  // namespace

void add_generate(CommandLine& line) {
  auto options = std::make_shared<GenerateOptions>();
  CLI::App* const command = line.add("generate", "Write a C++ header with the types, properties and actions of a robot",
                                     "What C++ cannot express is a warning on standard error, and a comment. Examples:\n"
                                     "  lrt generate -o robot.hpp --namespace acme::arm\n"
                                     "  lrt generate blueprints.ttl -o robot.hpp\n"
                                     "  lrt generate --check robot.hpp         # exit status 1 and the differences if the robot has changed",
                                     options, generate);
  command->add_option("FROM", options->words, "A URL of the robot, or a file with its documents; default: --robot")
      ->type_name("[URL|FILE]")
      ->expected(0, 1);
  auto* const output = command->add_option("-o,--output", options->output, "The header; default: standard output")->type_name("FILE");
  auto* const name_space = command->add_option("--namespace", options->name_space, "The C++ namespace; default: robot")->type_name("NAME");
  command->add_option("--check", options->check, "Write nothing, and compare this header with the robot")
      ->type_name("HEADER")
      ->excludes(output)
      ->excludes(name_space);
}

}  // namespace lrt::tool
