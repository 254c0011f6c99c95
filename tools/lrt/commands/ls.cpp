// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>

#include <lrt/client/description.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {
namespace {

struct LsOptions {
  std::vector<std::string> words;
  std::string type, language;
  bool details = false, json = false;
};

/// The reader's languages, the best first: --language, else LC_ALL, LC_MESSAGES or LANG ("de_CH.UTF-8").
std::vector<std::string> languages_of(const LsOptions& options) {
  std::string language = options.language;
  for (const char* const name : {"LC_ALL", "LC_MESSAGES", "LANG"}) {
    const char* const value = std::getenv(name);
    if (!language.empty() || !value || !*value) continue;
    language = value;
    language.resize(std::min(language.find_first_of(".@"), language.size()));
    std::replace(language.begin(), language.end(), '_', '-');
    if (language == "C" || language == "POSIX") return {};
  }
  if (language.empty()) return {};
  return {std::move(language)};
}

/// Title and description in the reader's language.
struct Said {
  std::string title, description;
};
Said said(const rdf::Words& words, const LsOptions& options) {
  Said found;
  const std::vector<std::string> languages = languages_of(options);
  if (const rdf::Text* text = words.titles.choose(languages)) found.title = text->text;
  if (const rdf::Text* text = words.descriptions.choose(languages)) found.description = text->text;
  return found;
}
Said said(const client::RepresentationPtr& representation, const LsOptions& options) {
  if (!representation || !representation->focus) return {};
  return said(client::words_of(representation->graph, *representation->focus), options);
}
std::string json_of(const Said& said) {
  return (said.title.empty() ? "" : ",\"title\":" + json_string(said.title)) +
         (said.description.empty() ? "" : ",\"description\":" + json_string(said.description));
}
/// The rows of a Thing. If one of its members has words, each row has two more cells for them.
class Rows {
 public:
  void add(std::vector<Table::Cell> row, Said said) {
    has_words_ = has_words_ || !said.title.empty() || !said.description.empty();
    rows_.emplace_back(std::move(row), std::move(said));
  }
  Table table() {
    Table made;
    for (auto& [row, said] : rows_) {
      if (has_words_) row.insert(row.end(), {{printable(said.title), Style::plain}, {printable(said.description), Style::faint}});
      made.add(std::move(row));
    }
    return made;
  }

 private:
  std::vector<std::pair<std::vector<Table::Cell>, Said>> rows_;
  bool has_words_ = false;
};

std::string_view local_name(std::string_view iri) noexcept {
  const std::size_t at = iri.find_last_of("#/");
  return at == std::string_view::npos ? iri : iri.substr(at + 1);
}

/// Whether a class matches the name on the command line: by its IRI, with a prefix, or by its local name.
bool is_meant(std::string_view iri, const std::string& name) { return iri == name || rdf::abbreviate(iri) == name || local_name(iri) == name; }

/// The types of a Thing without hybrit:RoboticThing, which all have, and without its Blueprints, which may be classes, too.
std::vector<std::string> kinds_of(const client::Thing& thing) {
  const std::string origin = thing.url().substr(0, thing.url().find('/', thing.url().find("://") + 3) + 1);
  std::optional<std::vector<std::string>> blueprints;  // asked for only if one can be among the types
  const auto is_blueprint = [&](std::string_view type) {
    if (type.substr(0, origin.size()) != origin) return false;
    if (!blueprints) blueprints = thing.blueprints();
    return std::any_of(blueprints->begin(), blueprints->end(),
                       [&](const std::string& b) { return type == b || type.substr(0, type.find('#')) == b; });
  };
  std::vector<std::string> kinds;
  for (const std::string& type : thing.types())
    if (type != vocab::hybrit::RoboticThing.text && !is_blueprint(type)) kinds.push_back(type);
  return kinds;
}

std::string joined(const std::vector<std::string>& texts, const char* between) {
  std::string result;
  for (const std::string& text : texts) result += (result.empty() ? "" : between) + text;
  return result;
}

/// A property with its text in ls.
struct Shown {
  PlainValue value;
  bool writable = false;
  std::string problem;
  Said said{};
};
/// @param state  the values of all properties of the Thing; nullptr: the property is read by itself
Shown shown(const client::Property& property, const client::RepresentationPtr& state, const LsOptions& options) {
  Shown result;
  const std::optional<rdf::TermId> there = state ? state->graph.find(rdf::iri(property.url())) : std::nullopt;
  const bool is_there = there && property.declared();
  const Result<client::RepresentationPtr> found = is_there ? Result<client::RepresentationPtr>(state) : property.get();
  if (is_there) result.said = said(client::words_of(state->graph, *there), options);
  else if (found) result.said = said(*found, options);
  const Result<rdf::TermId> node = is_there ? Result<rdf::TermId>(*there)
                                   : found  ? property.value_node((*found)->graph, (*found)->focus)
                                            : Result<rdf::TermId>(unexpected(found.error()));
  if (!node) {
    result.problem = printable(node.error().message);
    return result;
  }
  const std::optional<client::Schema> schema = schema_for_reading(property);
  result.value = value_at((*found)->graph, *node, schema ? &*schema : nullptr);
  const Result<bool> writable = property.is_writable();
  result.writable = writable && *writable;
  return result;
}

/// "available", "not available: the brake is on"
struct Availability {
  bool is_available = false;
  std::string text = "unreadable";
  Said said{};
};
Availability availability_of(const client::Action& action, const LsOptions& options) {
  const Result<client::RepresentationPtr> found = action.get();
  if (!found) return {};
  const Said words = said(*found, options);
  const rdf::Graph& graph = (*found)->graph;
  const auto predicate = graph.find(vocab::lrt_::unavailable);
  const auto reason = predicate && (*found)->focus ? graph.object(*(*found)->focus, *predicate) : std::nullopt;
  if (!reason) return {true, "available", words};
  return {false, "not available: " + printable(graph.term(*reason).text), words};
}

std::string input_of(const client::Action& action) {
  const Result<std::optional<client::Shape>> shape = action.input_shape();
  if (!shape || !*shape) return {};
  const std::optional<client::Schema> schema = schema_of(shape);
  return schema ? description_of(*schema) : "an input";
}

/// The values of all properties of a Thing in one document. nullptr: there is none, or it is not worth a request.
client::RepresentationPtr state_of(Session& session, const client::Thing& thing) {
  const auto is_declared = [](const client::Property& property) { return property.declared() != nullptr; };
  if (thing.state().empty() || thing.properties().size() < 2 || !std::all_of(thing.properties().begin(), thing.properties().end(), is_declared))
    return nullptr;
  const Result<Client*> client = session.client();
  if (!client) return nullptr;
  const Result<client::RepresentationPtr> found = (*client)->get(thing.state());
  return found ? *found : nullptr;  // one that cannot be read is a reason to read the others by themselves
}

Result<int> list_thing(Session& session, const client::Thing& thing, const LsOptions& options) {
  Rows rows;
  std::string json =
      "{\"name\":" + json_string(thing.name()) + ",\"url\":" + json_string(thing.url()) + json_of(said(thing.words(), options)) + ",\"types\":[";
  for (const std::string& type : thing.types()) json += (json.back() == '[' ? "" : ",") + json_string(type);
  json += "],\"properties\":[";
  const client::RepresentationPtr state = state_of(session, thing);
  for (const client::Property& property : thing.properties()) {
    const Shown found = shown(property, state, options);
    const std::string access = !found.problem.empty() ? "unreadable" : found.writable ? "read, write" : "read";
    const bool shows_unit = session.terminal().is_for_people();
    std::vector<Table::Cell> row{{printable(property.name()), Style::strong}};
    if (shows_unit)
      row.push_back({!found.problem.empty()     ? found.problem
                     : found.value.text.empty() ? "-"
                                                : found.value.text + (found.value.unit.empty() ? "" : " " + found.value.unit),
                     found.problem.empty() ? Style::plain : Style::bad});
    else row.insert(row.end(), {{found.value.text}, {found.value.unit}});
    row.push_back({access, Style::faint});
    if (options.details) row.push_back({printable(property.url()), Style::faint});
    rows.add(std::move(row), found.said);
    json += (json.back() == '[' ? "" : ",") + std::string("{\"name\":") + json_string(property.name()) + ",\"url\":" + json_string(property.url());
    if (found.problem.empty()) json += ",\"value\":" + found.value.json;
    else json += ",\"problem\":" + json_string(found.problem);
    if (!found.value.unit.empty()) json += ",\"unit\":" + json_string(found.value.unit);
    json += std::string(",\"writable\":") + (found.writable ? "true" : "false") + json_of(found.said) + "}";
  }
  json += "],\"actions\":[";
  for (const client::Action& action : thing.actions()) {
    const Availability available = availability_of(action, options);
    const std::string input = input_of(action);
    std::vector<Table::Cell> row{{printable(action.name()) + "()", Style::strong}, {input.empty() ? "" : "takes " + input}};
    if (!session.terminal().is_for_people()) row.push_back({});
    row.push_back({available.text, available.is_available ? Style::faint : Style::warning});
    if (options.details) row.push_back({printable(action.url()), Style::faint});
    rows.add(std::move(row), available.said);
    json += (json.back() == '[' ? "" : ",") + std::string("{\"name\":") + json_string(action.name()) + ",\"url\":" + json_string(action.url());
    if (!input.empty()) json += ",\"input\":" + json_string(input);
    json += std::string(",\"available\":") + (available.is_available ? "true" : "false") + json_of(available.said) + "}";
  }
  json += "]}";
  const bool printed = options.json ? session.terminal().print_line(json) : rows.table().print(session.terminal());
  return printed ? Exit::success : Exit::failure;
}

Result<int> list_robot(Session& session, const client::Robot& robot, const LsOptions& options) {
  Table table;
  std::string json = "[", names;
  bool found_any = false;
  for (const client::Thing& thing : robot.things()) {
    const std::vector<std::string> types = thing.types();
    if (!options.type.empty() && std::none_of(types.begin(), types.end(), [&](const std::string& type) { return is_meant(type, options.type); }))
      continue;
    found_any = true;
    const Said words = said(thing.words(), options);
    const std::string name = printable(words.title.empty() ? thing.name() : words.title);
    names += name + "\n";
    std::vector<std::string> kinds;
    for (const std::string& kind : kinds_of(thing)) kinds.push_back(printable(rdf::abbreviate(kind)));
    table.add({{name, Style::strong},
               {std::to_string(thing.properties().size())},
               {std::to_string(thing.actions().size())},
               {joined(kinds, " ")},
               {printable(thing.url()), Style::faint}});
    json += (json.size() > 1 ? "," : "") + std::string("{\"name\":") + json_string(thing.name()) + ",\"url\":" + json_string(thing.url()) +
            json_of(words) + ",\"types\":[";
    for (const std::string& type : types) json += (json.back() == '[' ? "" : ",") + json_string(type);
    json += "],\"properties\":" + std::to_string(thing.properties().size()) + ",\"actions\":" + std::to_string(thing.actions().size()) + "}";
  }
  if (!found_any && !options.type.empty())
    return unexpected(Errc::unknown_path, "\"" + robot.url() + "\" has no Thing of type \"" + options.type + "\"");
  if (!found_any) return unexpected(Errc::unknown_path, "\"" + robot.url() + "\" has no Thing");
  const bool printed = options.json      ? session.terminal().print_line(json + "]")
                       : options.details ? table.print(session.terminal(), {"name", "properties", "actions", "types", "URL"})
                                         : session.terminal().print(names);
  return printed ? Exit::success : Exit::failure;
}

Result<int> ls(Session& session, LsOptions& options) {
  session.take_robot(options.words, session.options().robot.empty() ? 0 : 1);
  if (options.words.size() > 1) return unexpected(Errc::invalid_option, "ls takes one name");
  if (!options.words.empty()) {
    const Result<client::Thing> thing = session.thing(options.words.front());
    if (!thing) return unexpected(thing.error());
    return list_thing(session, *thing, options);
  }
  const Result<const client::Robot*> robot = session.robot();
  if (!robot) return unexpected(robot.error());
  for (const std::string& problem : (*robot)->problems()) session.warn(problem);
  return list_robot(session, **robot, options);
}

}  // namespace

void add_ls(CommandLine& line) {
  auto options = std::make_shared<LsOptions>();
  CLI::App* const command = line.add("ls", "List the Things of a robot, or what a Thing has",
                                     "Examples:\n"
                                     "  lrt ls                                 # the names of all Things\n"
                                     "  lrt ls -l --type ros:RevoluteJoint     # also by IRI, or as RevoluteJoint\n"
                                     "  lrt ls right_s1                        # its properties with their values, and its actions",
                                     options, ls);
  command->add_option("NAME", options->words, "The name of a Thing, or its URL")->type_name("[ROBOT] [NAME]")->expected(0, 2);
  command->add_flag("-l,--long", options->details, "With types and URLs");
  command->add_option("--type", options->type, "Only Things of this type")->type_name("TYPE");
  command->add_flag("--json", options->json, "Print JSON");
  command->add_option("--language", options->language, "Titles and descriptions in this language; else that of LC_ALL, LC_MESSAGES or LANG")
      ->type_name("TAG");
}

}  // namespace lrt::tool
