// SPDX-License-Identifier: Apache-2.0
#include <lrt/codegen.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/base/replace_file.hpp"
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

Result<int> generate(Session& session, GenerateOptions& options) {
  if (options.words.size() > 1) return unexpected(Errc::invalid_option, "generate takes one URL or file");
  const Result<rdf::Graph> graph = documents(session, options);
  if (!graph) return unexpected(graph.error());
  const Result<client::Description> robot = client::describe(*graph);
  if (!robot) return unexpected(robot.error());
  if (robot->things.empty() && robot->shapes.empty())
    return unexpected(Errc::expected_value, "there is nothing to generate: the documents describe no Thing and no shape that a type can express");
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
  // A build that reads the header meanwhile finds the old one or the new one.
  constexpr std::string_view mark = "// Made by `lrt generate`";
  constexpr mode_t mode = 0666;
  if (const auto failure = replace_file(options.output, {made->header}, {mark, mode}).failure)
    return unexpected(Errc::invalid_option, file_error(*failure, options.output).error.message);
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
