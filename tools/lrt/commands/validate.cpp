// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>
#include <lrt/shacl/validator.hpp>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {
namespace {

struct ValidateOptions {
  std::vector<std::string> words;
  std::string type;
};

/// The shape that the server uses to validate a body for this property or action.
struct Judge {
  std::string url;
  std::optional<client::Shape> shape;
};
Result<Judge> judge_of(Session& session, const std::string& name) {
  const Result<client::Property> property = session.property(name);
  if (property) {
    const Result<std::optional<client::Shape>> shape = property->shape();
    if (!shape) return unexpected(shape.error());
    if (*shape || !is_url(name)) return Judge{property->url(), *shape};
  } else if (property.error().code != Errc::unknown_path) {
    return unexpected(property.error());
  }
  const Result<client::Action> action = session.action(name);
  if (!action) return unexpected(is_url(name) || property ? action.error() : property.error());
  const Result<std::optional<client::Shape>> shape = action->input_shape();
  if (!shape) return unexpected(shape.error());
  return Judge{action->url(), *shape};
}

Result<int> validate(Session& session, ValidateOptions& options) {
  session.take_robot(options.words, 2);
  if (options.words.size() != 2) return unexpected(Errc::invalid_option, "validate takes a name and a value or a file");
  const std::string& what = options.words[1];
  Result<Body> body = body_of(what, options.type);
  if (!body) return unexpected(body.error());
  const Result<Judge> judge = judge_of(session, options.words[0]);
  if (!judge) return unexpected(judge.error());
  if (!judge->shape) return unexpected(Errc::expected_value, "\"" + options.words[0] + "\" publishes no shape of what it takes");
  const Result<Input> input = input_of(*body, judge->url, schema_of(judge->shape));
  if (!input) return unexpected(input.error());
  shacl::CompileOptions compile;
  compile.ignore_unsupported = true;
  const Result<shacl::Shapes> shapes = shacl::Shapes::compile(judge->shape->graph, compile);
  if (!shapes) return unexpected(shapes.error());
  const Result<shacl::Report> report = shacl::validate(*shapes, input->graph, input->graph.term(input->focus), judge->shape->node);
  if (!report) return unexpected(report.error());
  Terminal& terminal = session.terminal();
  if (report->conforms()) {
    if (terminal.is_for_people()) terminal.print_line(terminal.styled("conforms", Style::good));
    return Exit::success;
  }
  terminal.print(printable_lines(report->to_text()));
  return Exit::failure;
}

}  // namespace

void add_validate(CommandLine& line) {
  auto options = std::make_shared<ValidateOptions>();
  CLI::App* const command = line.add("validate", "Validate a value or an input against the published shape; nothing is sent",
                                     "Exit status 1 and the report on standard output if it does not conform. Examples:\n"
                                     "  lrt validate right_s1/friction 70\n"
                                     "  lrt validate right_s1/rotate @input.ttl\n"
                                     "  lrt validate arm/pose - --type application/json < pose.json",
                                     options, validate);
  command->add_option("VALUE", options->words, "The name of a property or an action, and a value, @FILE or -")
      ->required()
      ->type_name("[ROBOT] NAME VALUE")
      ->expected(2, 3);
  command->add_option("--type", options->type, "The media type of the value, such as text/turtle")->type_name("TYPE");
}

}  // namespace lrt::tool
