// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {
namespace {

struct GetOptions {
  std::vector<std::string> words;
  std::string accept, unit;
  bool json = false;
};

/// The server's bytes, in a format that the server has.
Result<int> get_bytes(Session& session, const client::Property& property, const std::string& accept) {
  const Result<Client*> client = session.client();
  if (!client) return unexpected(client.error());
  const Result<client::Response> response = (*client)->send({"GET", property.url(), {{"Accept", accept}}, {}});
  if (!response) return unexpected(response.error());
  if (!response->ok())
    return unexpected(Errc::refused, "GET " + property.url() + ": " + std::to_string(response->status) + ": " + response->reason());
  Terminal& terminal = session.terminal();
  if (!terminal.is_for_people()) return terminal.print(response->body) ? Exit::success : Exit::failure;
  const std::string type = response->media_type();
  const bool is_text = type.substr(0, 5) == "text/" || type.find("json") != std::string::npos || type.find("xml") != std::string::npos ||
                       rdf::syntax_of(type).has_value();
  if (!is_text)
    return unexpected(Errc::invalid_option,
                      "the response is " + std::to_string(response->body.size()) + " bytes of " + type + ", not shown on a terminal; add > FILE");
  std::string text = printable_lines(response->body);
  if (text.empty() || text.back() != '\n') text += '\n';
  return terminal.print(text) ? Exit::success : Exit::failure;
}

Result<int> get(Session& session, GetOptions& options) {
  session.take_robot(options.words, 1);
  if (options.words.size() != 1) return unexpected(Errc::invalid_option, "get takes one name");
  const Result<client::Property> property = session.property(options.words.front());
  if (!property) return unexpected(property.error());
  if (!options.accept.empty()) return get_bytes(session, *property, options.accept);
  const Result<client::RepresentationPtr> found = property->get();
  if (!found) return unexpected(found.error());
  const Result<rdf::TermId> node = property->value_node((*found)->graph, (*found)->focus);
  if (!node) return unexpected(node.error());
  const std::optional<client::Schema> schema = schema_for_reading(*property);
  PlainValue value = value_at((*found)->graph, *node, schema ? &*schema : nullptr);
  if (!options.unit.empty()) {
    Result<PlainValue> in_unit = converted(value, options.unit);
    if (!in_unit) return unexpected(in_unit.error());
    value = *std::move(in_unit);
  }
  Terminal& terminal = session.terminal();
  if (options.json) {
    std::string text =
        "{\"name\":" + json_string(session.label(property->url())) + ",\"url\":" + json_string(property->url()) + ",\"value\":" + value.json;
    if (!value.unit.empty()) text += ",\"unit\":" + json_string(value.unit);
    return terminal.print_line(text + "}") ? Exit::success : Exit::failure;
  }
  std::string text = value.text;
  if (terminal.is_for_people() && !value.unit.empty()) text += " " + terminal.styled(value.unit, Style::faint);
  return terminal.print_line(text) ? Exit::success : Exit::failure;
}

}  // namespace

void add_get(CommandLine& line) {
  auto options = std::make_shared<GetOptions>();
  CLI::App* const command = line.add("get", "Print the value of a property",
                                     "Examples:\n"
                                     "  lrt get right_s1/position              # 0.27; on a terminal 0.27 rad\n"
                                     "  lrt get right_s1/position --unit deg\n"
                                     "  lrt get right_s1/limits                # a record, as JSON\n"
                                     "  lrt get right_s1/position --accept text/turtle",
                                     options, get);
  command->add_option("NAME", options->words, "The name of a property, or its URL")->required()->type_name("[ROBOT] NAME")->expected(1, 2);
  command->add_option("--accept", options->accept, "Print the server's bytes in this media type")->type_name("TYPE");
  command->add_flag("--json", options->json, "Print an object with name, url, value and unit")->excludes("--accept");
  command->add_option("--unit", options->unit, "Convert the number to this unit, such as deg")->type_name("UNIT")->excludes("--accept");
}

}  // namespace lrt::tool
