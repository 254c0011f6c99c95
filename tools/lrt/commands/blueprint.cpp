// SPDX-License-Identifier: Apache-2.0
#include <set>

#include <lrt/client/units.hpp>
#include <lrt/rdf/codec.hpp>

#include "tools/lrt/command_line.hpp"
#include "tools/lrt/naming.hpp"

namespace lrt::tool {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;

namespace {

struct BlueprintOptions {
  std::vector<std::string> words;
  bool for_people = false;
};

/// The triples of a shape, with the shapes that it refers to.
Graph reachable(const client::Shape& shape) {
  Graph result;
  const Graph& graph = shape.graph;
  std::vector<TermId> open;
  std::set<TermId> seen;
  if (const auto node = graph.find(shape.node.view())) open.push_back(*node);
  while (!open.empty()) {
    const TermId node = open.back();
    open.pop_back();
    if (!seen.insert(node).second) continue;
    for (const Triple& t : graph.match(node, std::nullopt, std::nullopt)) {
      result.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
      if (!graph.term(t.object).is_literal()) open.push_back(t.object);
    }
  }
  return result;
}

/// @param required  "required", or "one of these" for an alternative; a type that is optional says so
/// @param as_tree   fields have their own names, below that of the record; else paths, "limits.lower"
void add_rows(Table& table, const std::string& name, const rdf::Type& given, const rdf::Facets& facets, const char* required, unsigned depth,
              bool as_tree) {
  const rdf::Type* type = &given;
  while (type->kind == rdf::Type::Kind::optional && type->element) {
    type = type->element;
    required = "optional";
  }
  const bool is_variant = type->kind == rdf::Type::Kind::variant, is_record = type->kind == rdf::Type::Kind::record || is_variant;
  const char* const kind = is_variant ? "variant" : has_content(*type) ? "record" : "no content";
  table.add({{name, Style::strong},
             {is_record ? kind : name_of(*type)},
             {printable(client::unit_label(is_record ? rdf::node_unit(*type, facets) : facets.unit()))},
             {bounds_of(*type, facets)},
             {required}});
  constexpr unsigned max_depth = 12;
  if (!is_record || depth > max_depth) return;
  for (const rdf::FieldType& field : type->fields)
    add_rows(table, (as_tree ? std::string(2 * (depth + 1), ' ') : name + ".") + printable(field.name), *field.type, rdf::field_facets(field, facets),
             is_variant ? "one of these" : "required", depth + 1, as_tree);
}

Result<int> print_shapes(Session& session, const std::vector<std::pair<std::string, client::Shape>>& shapes, bool for_people) {
  Terminal& terminal = session.terminal();
  if (for_people) {
    Table table;
    for (const auto& [name, shape] : shapes) {
      const std::optional<client::Schema> schema = schema_of(std::optional<client::Shape>(shape));
      if (schema) add_rows(table, name, schema->type(), schema->facets(), "required", 0, terminal.is_for_people());
      else table.add({{name, Style::strong}, {"see the shape"}, {}, {}, {}});
    }
    return table.print(terminal, {"field", "type", "unit", "bounds", "required"}) ? Exit::success : Exit::failure;
  }
  Graph all;
  for (const auto& [name, shape] : shapes) {
    static_cast<void>(name);
    all.merge(reachable(shape));
  }
  const Result<std::string> text = rdf::write(all, rdf::Syntax::turtle);
  if (!text) return unexpected(text.error());
  return terminal.print(printable_lines(*text)) ? Exit::success : Exit::failure;
}

Result<int> blueprint_of_thing(Session& session, const client::Thing& thing, bool for_people) {
  if (for_people) {
    std::vector<std::pair<std::string, client::Shape>> shapes;
    for (const client::Property& property : thing.properties())
      if (const auto shape = property.value_shape(); shape && *shape) shapes.emplace_back(printable(property.name()), **shape);
    for (const client::Action& action : thing.actions()) {
      if (const auto shape = action.input_shape(); shape && *shape) shapes.emplace_back(printable(action.name()) + " input", **shape);
      if (const auto shape = action.output_shape(); shape && *shape) shapes.emplace_back(printable(action.name()) + " output", **shape);
    }
    if (!shapes.empty()) return print_shapes(session, shapes, true);
  }
  const std::vector<std::string> urls = thing.blueprints();
  if (urls.empty()) return unexpected(Errc::unknown_path, "\"" + thing.name() + "\" has no Blueprint");
  const Result<Client*> client = session.client();
  if (!client) return unexpected(client.error());
  std::string text;
  for (const std::string& url : urls) {
    const Result<client::RepresentationPtr> document = (*client)->get(url);
    if (!document) return unexpected(document.error());
    const Result<std::string> turtle = rdf::write((*document)->graph, rdf::Syntax::turtle);
    if (!turtle) return unexpected(turtle.error());
    text += (text.empty() ? "" : "\n") + ("# " + printable(url) + "\n") + printable_lines(*turtle);
  }
  return session.terminal().print(text) ? Exit::success : Exit::failure;
}

Result<std::vector<std::pair<std::string, client::Shape>>> shapes_of(const client::Property& property) {
  const Result<std::optional<client::Shape>> shape = property.value_shape();
  if (!shape) return unexpected(shape.error());
  std::vector<std::pair<std::string, client::Shape>> shapes;
  if (*shape) shapes.emplace_back(printable(property.name()), **shape);
  return shapes;
}

Result<std::vector<std::pair<std::string, client::Shape>>> shapes_of(const client::Action& action) {
  const Result<std::optional<client::Shape>> input = action.input_shape(), output = action.output_shape();
  if (!input) return unexpected(input.error());
  std::vector<std::pair<std::string, client::Shape>> shapes;
  if (*input) shapes.emplace_back("input", **input);
  if (output && *output) shapes.emplace_back("output", **output);
  return shapes;
}

Result<int> blueprint(Session& session, BlueprintOptions& options) {
  session.take_robot(options.words, 1);
  if (options.words.size() != 1) return unexpected(Errc::invalid_option, "blueprint takes one name");
  const std::string& name = options.words.front();
  Result<std::vector<std::pair<std::string, client::Shape>>> shapes = unexpected(Errc::unknown_path, "");
  if (is_url(name)) {
    const Result<client::Property> property = session.property(name);
    const Result<client::RepresentationPtr> found = property ? property->get() : Result<client::RepresentationPtr>(unexpected(property.error()));
    if (!found) return unexpected(found.error());
    if (is_thing(**found)) {
      const Result<client::Thing> thing = session.thing(name);
      return thing ? blueprint_of_thing(session, *thing, options.for_people) : Result<int>(unexpected(thing.error()));
    }
    const Result<client::Action> action = session.action(name);
    shapes = action && is_action(**found) ? shapes_of(*action) : shapes_of(*property);
  } else {
    const Result<const client::Robot*> robot = session.robot();
    if (!robot) return unexpected(robot.error());
    if (const Result<client::Thing> thing = (*robot)->thing(name)) return blueprint_of_thing(session, *thing, options.for_people);
    if (const Result<client::Property> property = (*robot)->property(name)) {
      shapes = shapes_of(*property);
    } else if (const Result<client::Action> action = (*robot)->action(name)) {
      shapes = shapes_of(*action);
    } else {
      const Error error = explained(**robot, name, Named::property, property.error());
      if (error.code == Errc::unknown_path && name.find('/') == std::string::npos)
        return unexpected(Errc::unknown_path, "\"" + (*robot)->url() + "\" has no Thing, property or action \"" + name + "\"");
      return unexpected(error);
    }
  }
  if (!shapes) return unexpected(shapes.error());
  if (shapes->empty()) return unexpected(Errc::unknown_path, "\"" + name + "\" has no Blueprint");
  return print_shapes(session, *shapes, options.for_people);
}

}  // namespace

void add_blueprint(CommandLine& line) {
  auto options = std::make_shared<BlueprintOptions>();
  CLI::App* const command = line.add("blueprint", "Print the shape of a Thing, a property or an action",
                                     "Examples:\n"
                                     "  lrt blueprint right_s1/friction              # SHACL, in Turtle\n"
                                     "  lrt blueprint right_s1 --for-people          # a table: field, type, unit, bounds, required",
                                     options, blueprint);
  command->add_option("NAME", options->words, "The name of a Thing, a property or an action, or its URL")
      ->required()
      ->type_name("[ROBOT] NAME")
      ->expected(1, 2);
  command->add_flag("-p,--for-people", options->for_people, "A table of the fields");
}

}  // namespace lrt::tool
