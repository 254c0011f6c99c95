// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/command_line.hpp"

namespace lrt::tool {
namespace {

struct SetOptions {
  std::vector<std::string> words;
  std::string if_match, type;
};

Result<int> set(Session& session, SetOptions& options) {
  session.take_robot(options.words, 2);
  if (options.words.size() != 2) return unexpected(Errc::invalid_option, "set takes a name and a value");
  const Result<Body> body = body_of(options.words[1], options.type);
  if (!body) return unexpected(body.error());
  const Result<client::Property> property = session.property(options.words[0]);
  if (!property) return unexpected(property.error());
  const Result<bool> is_writable = property->is_writable();
  if (!is_writable) return unexpected(is_writable.error());
  if (!*is_writable) return unexpected(Errc::refused, "\"" + options.words[0] + "\" cannot be written");
  const Result<std::optional<client::Shape>> shape = property->shape();
  if (!shape) return unexpected(shape.error());
  std::optional<client::Schema> schema = schema_of(shape);
  if (!schema && !*shape) schema = schema_of(property->present_shape());
  const Result<Input> input = input_of(*body, property->url(), schema);
  if (!input) return unexpected(input.error());
  client::WriteOptions write;
  write.if_match = options.if_match;
  if (!write.if_match.empty() && write.if_match != "*" && write.if_match.find('"') == std::string::npos) write.if_match = '"' + write.if_match + '"';
  const Result<void> written = property->write(input->graph, input->focus, write);
  if (!written) return unexpected(written.error());
  return Exit::success;
}

}  // namespace

void add_set(CommandLine& line) {
  auto options = std::make_shared<SetOptions>();
  CLI::App* const command = line.add("set", "Write a property",
                                     "The value is validated against the published shape before it is sent. Examples:\n"
                                     "  lrt set right_s1/friction 1.5\n"
                                     "  lrt set right_s1/position 30deg        # converted to rad, which is the declared unit\n"
                                     "  lrt set arm/pose '{\"x\": 1, \"y\": 2}'    # a record, as JSON\n"
                                     "  lrt set arm/pose @pose.ttl             # a file: .ttl, .nt, .rdf, .jsonld, .json, .cbor; - is standard input",
                                     options, set);
  command->add_option("VALUE", options->words, "The name of a property, and its new value")
      ->required()
      ->type_name("[ROBOT] NAME VALUE")
      ->expected(2, 3);
  command->add_option("--if-match", options->if_match, "Write only if the value still has this entity tag")->type_name("TAG");
  command->add_option("--type", options->type, "The media type of the value, such as text/turtle")->type_name("TYPE");
}

}  // namespace lrt::tool
