// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <map>

#include <lrt/base/iri.hpp>
#include <lrt/client/description.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "tools/lrt/command_line.hpp"
#include "tools/lrt/suggest.hpp"

namespace lrt::tool {
namespace {

struct LsOptions {
  std::vector<std::string> words;
  std::string type, language;
  bool details = false, json = false, full = false;
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
/// Rows with their words. On a terminal a column that is empty is left out, and so are words for which the window is too narrow.
class Rows {
 public:
  void add(std::vector<Table::Cell> row, Said said) {
    has_title_ = has_title_ || !said.title.empty();
    has_description_ = has_description_ || !said.description.empty();
    rows_.emplace_back(std::move(row), std::move(said));
  }
  bool has_words() const noexcept { return has_title_ || has_description_; }
  bool empty() const noexcept { return rows_.empty(); }
  /// For programs: both columns, if `with_words`.
  void add_to(Table& table, bool with_words) {
    for (auto& [row, said] : rows_) {
      if (with_words) row.insert(row.end(), {{printable(said.title)}, {printable(said.description), Style::faint}});
      table.add(std::move(row));
    }
  }
  bool print(Terminal& terminal, std::vector<std::string> heading) {
    constexpr std::size_t for_title = 100, for_description = 120;
    const bool titles = has_title_ && terminal.width() >= for_title, descriptions = has_description_ && terminal.width() >= for_description;
    Table table;
    for (auto& [row, said] : rows_) {
      if (titles) row.push_back({printable(said.title)});
      if (descriptions) row.push_back({printable(said.description), Style::faint});
      table.add(std::move(row));
    }
    if (titles) heading.emplace_back("title");
    if (descriptions) heading.emplace_back("description");
    return table.print(terminal, heading);
  }

 private:
  std::vector<std::pair<std::vector<Table::Cell>, Said>> rows_;
  bool has_title_ = false, has_description_ = false;
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

/// "available", "available, a stop", "not available: the brake is on"
struct Availability {
  bool is_available = false, is_stop = false;
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
  const std::vector<std::string> types = (*found)->types();
  const bool is_stop = std::find(types.begin(), types.end(), vocab::lrt_::StopAction.text) != types.end();
  if (!reason) return {true, is_stop, is_stop ? "available, a stop" : "available", words};
  return {false, is_stop, std::string(is_stop ? "a stop, " : "") + "not available: " + printable(graph.term(*reason).text), words};
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
  Terminal& terminal = session.terminal();
  const bool for_people = terminal.is_for_people();
  Rows properties, actions;
  std::string json =
      "{\"name\":" + json_string(thing.name()) + ",\"url\":" + json_string(thing.url()) + json_of(said(thing.words(), options)) + ",\"types\":[";
  for (const std::string& type : thing.types()) json += (json.back() == '[' ? "" : ",") + json_string(type);
  json += "],\"properties\":[";
  const client::RepresentationPtr state = state_of(session, thing);
  for (const client::Property& property : thing.properties()) {
    const Shown found = shown(property, state, options);
    const std::string access = !found.problem.empty() ? "unreadable" : found.writable ? "read, write" : "read";
    std::vector<Table::Cell> row{{printable(property.name()), Style::strong}};
    if (!for_people) row.push_back({found.value.is_null() ? "" : found.value.line()});
    else if (!found.problem.empty()) row.push_back({found.problem, Style::bad});
    else row.push_back({found.value.is_null() ? "-" : options.full ? found.value.line() : found.value.for_people()});
    row.push_back({found.value.unit});
    row.push_back({access, Style::faint});
    if (options.details) row.push_back({printable(property.url()), Style::faint});
    properties.add(std::move(row), found.said);
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
    if (!for_people) row.push_back({});
    row.push_back({available.text, available.is_available ? Style::faint : Style::warning});
    if (options.details) row.push_back({printable(action.url()), Style::faint});
    actions.add(std::move(row), available.said);
    json += (json.back() == '[' ? "" : ",") + std::string("{\"name\":") + json_string(action.name()) + ",\"url\":" + json_string(action.url());
    if (!input.empty()) json += ",\"input\":" + json_string(input);
    if (available.is_stop) json += ",\"stop\":true";
    json += std::string(",\"available\":") + (available.is_available ? "true" : "false") + json_of(available.said) + "}";
  }
  json += "]}";
  if (options.json) return terminal.print_line(json) ? Exit::success : Exit::failure;
  if (properties.empty() && actions.empty())
    session.warn("\"" + thing.name() + "\" has no properties and no actions; lrt get " + thing.name() + " reads it");
  if (!for_people) {
    const bool with_words = properties.has_words() || actions.has_words();
    Table table;
    properties.add_to(table, with_words);
    actions.add_to(table, with_words);
    return table.print(terminal) ? Exit::success : Exit::failure;
  }
  std::vector<std::string> of_property{"property", "value", "unit", "access"}, of_action{"action", "input", "state"};
  if (options.details) of_property.emplace_back("URL"), of_action.emplace_back("URL");
  if (!properties.empty() && !properties.print(terminal, of_property)) return Exit::failure;
  if (!properties.empty() && !actions.empty() && !terminal.print("\n")) return Exit::failure;
  return actions.empty() || actions.print(terminal, of_action) ? Exit::success : Exit::failure;
}

/// A Thing in the list of a robot.
struct Listed {
  const client::Thing* thing;
  Said said;
  std::vector<std::string> kinds;  ///< printable
  std::size_t depth = 0;           ///< below how many listed Things its URL is
  std::string own_name{};          ///< the end of its URL, below the Thing above it; printable
};

/// Things in the order of a tree: those whose URLs are below that of a Thing follow it.
std::vector<Listed> as_tree(std::vector<Listed> all) {
  std::map<std::string_view, std::size_t> known;
  for (std::size_t i = 0; i < all.size(); ++i) known.emplace(all[i].thing->url(), i);
  std::vector<std::vector<std::size_t>> children(all.size());
  std::vector<std::size_t> roots;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string_view url = all[i].thing->url();
    std::size_t slash = url.rfind('/');
    auto above = known.end();
    for (std::string_view rest = url; above == known.end() && slash != std::string_view::npos && slash > 8;) {
      rest = rest.substr(0, slash);
      above = known.find(rest);
      slash = rest.rfind('/');
    }
    const std::size_t own = above == known.end() ? url.rfind('/') + 1 : above->first.size() + 1;
    const Result<std::string> name = iri::decode(url.substr(own));
    all[i].own_name = printable(name ? *name : std::string(url.substr(own)));
    if (above == known.end() || above->second == i) roots.push_back(i);
    else children[above->second].push_back(i);
  }
  std::vector<Listed> tree;
  std::vector<std::pair<std::size_t, std::size_t>> open;
  for (auto i = roots.rbegin(); i != roots.rend(); ++i) open.emplace_back(*i, 0);
  while (!open.empty()) {
    const auto [i, depth] = open.back();
    open.pop_back();
    all[i].depth = depth;
    for (auto child = children[i].rbegin(); child != children[i].rend(); ++child) open.emplace_back(*child, depth + 1);
    tree.push_back(std::move(all[i]));
  }
  return tree;
}

/// For people: the Things as a tree, with what they have.
bool print_tree(Terminal& terminal, std::vector<Listed> all, bool with_urls) {
  Rows rows;
  for (Listed& one : as_tree(std::move(all))) {
    std::vector<Table::Cell> row{{std::string(2 * one.depth, ' ') + one.own_name, Style::strong},
                                 {joined(one.kinds, " ")},
                                 {std::to_string(one.thing->properties().size())},
                                 {std::to_string(one.thing->actions().size())}};
    if (with_urls) row.push_back({printable(one.thing->url()), Style::faint});
    if (one.said.title == one.thing->name() && printable(one.said.title) == one.own_name) one.said.title.clear();
    rows.add(std::move(row), std::move(one.said));
  }
  std::vector<std::string> heading{"Thing", "types", "properties", "actions"};
  if (with_urls) heading.emplace_back("URL");
  return rows.print(terminal, std::move(heading));
}

Result<int> list_robot(Session& session, const client::Robot& robot, const LsOptions& options) {
  std::vector<Listed> all;
  std::vector<std::string> known;
  for (const client::Thing& thing : robot.things()) {
    const std::vector<std::string> types = thing.types();
    if (!options.type.empty() && std::none_of(types.begin(), types.end(), [&](const std::string& type) { return is_meant(type, options.type); })) {
      for (const std::string& kind : kinds_of(thing)) known.emplace_back(rdf::abbreviate(kind)), known.emplace_back(local_name(kind));
      continue;
    }
    Listed listed{&thing, said(thing.words(), options), {}};
    for (const std::string& kind : kinds_of(thing)) listed.kinds.push_back(printable(rdf::abbreviate(kind)));
    all.push_back(std::move(listed));
  }
  if (all.empty()) {
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    return unexpected(Errc::unknown_path,
                      "\"" + robot.url() + "\" has no Thing of type \"" + options.type + "\"" + did_you_mean(options.type, known));
  }
  if (session.terminal().is_for_people() && !options.json)
    return print_tree(session.terminal(), std::move(all), options.details) ? Exit::success : Exit::failure;
  Table table;
  std::string json = "[", names;
  for (const Listed& one : all) {
    const client::Thing& thing = *one.thing;
    const std::string name = printable(one.said.title.empty() ? thing.name() : one.said.title);
    names += name + "\n";
    table.add({{name, Style::strong},
               {std::to_string(thing.properties().size())},
               {std::to_string(thing.actions().size())},
               {joined(one.kinds, " ")},
               {printable(thing.url()), Style::faint}});
    json += (json.size() > 1 ? "," : "") + std::string("{\"name\":") + json_string(thing.name()) + ",\"url\":" + json_string(thing.url()) +
            json_of(one.said) + ",\"types\":[";
    for (const std::string& type : thing.types()) json += (json.back() == '[' ? "" : ",") + json_string(type);
    json += "],\"properties\":" + std::to_string(thing.properties().size()) + ",\"actions\":" + std::to_string(thing.actions().size()) + "}";
  }
  const bool printed = options.json      ? session.terminal().print_line(json + "]")
                       : options.details ? table.print(session.terminal())
                                         : session.terminal().print(names);
  return printed ? Exit::success : Exit::failure;
}

Result<int> ls(Session& session, LsOptions& options) {
  const Result<std::optional<client::Thing>> thing = session.take_thing(options.words);
  if (!thing) return unexpected(thing.error());
  if (*thing && !options.type.empty()) return unexpected(Errc::invalid_option, "--type is for the list of Things, not for one Thing");
  if (*thing) return list_thing(session, **thing, options);
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
  command->add_flag("--full", options->full, "All digits of values, also on a terminal");
  command->add_option("--language", options->language, "Titles and descriptions in this language; else that of LC_ALL, LC_MESSAGES or LANG")
      ->type_name("TAG");
}

}  // namespace lrt::tool
