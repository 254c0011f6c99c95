// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/command_line.hpp"

#include <algorithm>

namespace lrt::tool {
namespace {

struct SetOptions {
  std::vector<std::string> words;
  std::string if_match, type;
};

/// How many of the last words are changes of parts, "position=0.1".
std::size_t changes_in(const SetOptions& options) {
  if (!options.type.empty()) return 0;
  const auto first = std::find_if_not(options.words.rbegin(), options.words.rend(), [](const std::string& word) { return is_change(word); });
  return static_cast<std::size_t>(first - options.words.rbegin());
}

bool has_parts(const rdf::Type& type) {
  if (type.kind == rdf::Type::Kind::variant) return false;  // "moveTo=1" is its whole value
  return type.kind == rdf::Type::Kind::optional ? has_parts(*type.element) : type.kind == rdf::Type::Kind::map || !type.fields.empty();
}

Result<int> set(Session& session, SetOptions& options) {
  const std::size_t changes = changes_in(options);
  session.take_robot(options.words, changes > 0 ? changes + 1 : 2);
  if (options.words.size() != (changes > 0 ? changes + 1 : 2))
    return unexpected(Errc::invalid_option, "set takes a name and a value, or a name and changes such as position=0.1");
  std::optional<Body> body;  // a file that cannot be read is no reason to ask the robot
  if (changes == 0) {
    Result<Body> given = body_of(options.words[1], options.type);
    if (!given) return unexpected(std::move(given).error());
    body = *std::move(given);
  }
  const Result<client::Property> property = session.property(options.words[0]);
  if (!property) return unexpected(property.error());
  const Result<bool> is_writable = property->is_writable();
  if (!is_writable) return unexpected(is_writable.error());
  if (!*is_writable) return unexpected(Errc::refused, "\"" + options.words[0] + "\" cannot be written");
  const Result<std::optional<client::Shape>> shape = property->shape();
  if (!shape) return unexpected(shape.error());
  std::optional<client::Schema> schema = schema_of(shape);
  if (!schema && !*shape) schema = schema_of(property->present_shape());
  client::WriteOptions write;
  write.if_match = options.if_match;
  if (!write.if_match.empty() && write.if_match != "*" && write.if_match.find('"') == std::string::npos) write.if_match = '"' + write.if_match + '"';
  // Of a text or a variant, "a=b" is a value.
  if (changes > 0 && !(changes == 1 && schema && !has_parts(schema->type()))) {
    const Result<client::Patch> patch = patch_of({options.words.begin() + 1, options.words.end()}, schema);
    if (!patch) return unexpected(patch.error());
    const Result<void> patched = property->patch(*patch, write);
    if (!patched) return unexpected(patched.error());
    return Exit::success;
  }
  if (!body) body = Body{options.words[1], {}};
  if (const std::string lacks = schema ? lacks_members(*body, *schema, options.words[0]) : std::string(); !lacks.empty())
    return unexpected(Errc::expected_value, lacks);
  const Result<Input> input = input_of(*body, property->url(), schema);
  if (!input) return unexpected(input.error());
  const Result<void> written = property->write(input->graph, input->focus, write);
  if (!written) return unexpected(written.error());
  return Exit::success;
}

}  // namespace

void add_set(CommandLine& line) {
  auto options = std::make_shared<SetOptions>();
  CLI::App* const command =
      line.add("set", "Write a property",
               "The value is validated against the published shape before it is sent. Examples:\n"
               "  lrt set right_s1/friction 1.5\n"
               "  lrt set right_s1/position 30deg        # converted to rad, which is the declared unit\n"
               "  lrt set arm/pose '{\"x\": 1, \"y\": 2}'    # a record, as JSON\n"
               "  lrt set arm/pose x=1 limits.upper=30deg   # some of its fields; the robot keeps the others\n"
               "  lrt set arm/target moveTo='{\"x\": 1}'   # one of several alternatives; or arm/target stop, if it has no content\n"
               "  lrt set arm/pose @pose.ttl             # a file: .ttl, .nt, .rdf, .jsonld, .json, .cbor; - is standard input",
               options, set);
  command->add_option("VALUE", options->words, "The name of a property, and its new value, or new values of some of its fields")
      ->required()
      ->type_name("[ROBOT] NAME VALUE | FIELD=VALUE...")
      ->expected(2, -1);
  command->add_option("--if-match", options->if_match, "Write only if the value still has this entity tag")->type_name("TAG");
  command->add_option("--type", options->type, "The media type of the value, such as text/turtle")->type_name("TYPE");
}

}  // namespace lrt::tool
