// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "tools/lrt/command_line.hpp"
#include "tools/lrt/naming.hpp"

namespace lrt::tool {
namespace {

struct GetOptions {
  std::vector<std::string> words;
  std::string accept, unit, output;
  bool json = false, full = false, unit_iri = false;
};

/// A value with the name of its property.
struct Row {
  std::string name, url, problem;
  PlainValue value;
};

bool is_text(const std::string& media_type) {
  return media_type.empty() || media_type.substr(0, 5) == "text/" || media_type.find("json") != std::string::npos ||
         media_type.find("xml") != std::string::npos || rdf::syntax_of(media_type).has_value();
}

/// Bytes for a program, or in the file of --output. People get texts; of an image they get its type and size.
Result<int> print_bytes(Session& session, const client::Response& response, const std::string& name, const GetOptions& options) {
  Terminal& terminal = session.terminal();
  const std::string type = response.media_type(),
                    about = printable(name) + ": " + std::to_string(response.body.size()) + " bytes of " + printable(type);
  if (!options.output.empty() && options.output != "-") {
    constexpr mode_t mode = 0666;
    const int file = ::open(options.output.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode);
    std::string_view rest = response.body;
    bool written = file >= 0;
    while (written && !rest.empty()) {
      const ssize_t done = ::write(file, rest.data(), rest.size());
      if (done < 0 && errno == EINTR) continue;
      written = done > 0;
      if (written) rest.remove_prefix(static_cast<std::size_t>(done));
    }
    const int error = errno;
    if (file >= 0) ::close(file);
    if (!written) return unexpected(Errc::invalid_option, "cannot write \"" + options.output + "\": " + std::strerror(error));
    if (terminal.shows_progress())
      session.warn(name + ": " + std::to_string(response.body.size()) + " bytes of " + type + " in \"" + options.output + "\"");
    return Exit::success;
  }
  if (!terminal.is_for_people() || options.output == "-") return terminal.print(response.body) ? Exit::success : Exit::failure;
  if (!is_text(type)) {
    const std::string sentence = about + "; to keep them, add -o FILE";
    if (!options.accept.empty()) return unexpected(Errc::invalid_option, sentence);
    return terminal.print_line(sentence) ? Exit::success : Exit::failure;
  }
  const bool is_json = type.find("json") != std::string::npos && !options.full && options.accept.empty();
  std::string text = printable_lines(is_json ? readable_lines(response.body) : response.body);
  if (text.empty() || text.back() != '\n') text += '\n';
  return terminal.print(text) ? Exit::success : Exit::failure;
}

Result<client::Response> request(Session& session, const std::string& url, const std::string& accept) {
  const Result<Client*> client = session.client();
  if (!client) return unexpected(client.error());
  Result<client::Response> response = (*client)->send({"GET", url, {{"Accept", accept}}, {}});
  if (!response || response->ok()) return response;
  const bool is_missing = response->status == 404 || response->status == 410;
  return unexpected(is_missing ? Errc::unknown_path : Errc::refused,
                    "GET " + url + ": " + std::to_string(response->status) + ": " + response->reason());
}

/// What is neither a property nor a Thing: the members of a container, a state as JSON with units, an image, or what the server has.
Result<int> print_resource(Session& session, const std::string& url, const std::string& name, const GetOptions& options) {
  if (!options.accept.empty()) {
    const Result<client::Response> response = request(session, url, options.accept);
    return response ? print_bytes(session, *response, name, options) : Result<int>(unexpected(response.error()));
  }
  const Result<Client*> client = session.client();
  if (!client) return unexpected(client.error());
  const Result<client::RepresentationPtr> read = (*client)->get(url);
  if (read && is_action(**read))
    return unexpected(Errc::expected_value,
                      "\"" + name + "\" is an action, and has no value; lrt invoke takes it, and lrt blueprint shows its input");
  const std::vector<std::string> types = read ? (*read)->types() : std::vector<std::string>();
  const bool is_list = std::find(types.begin(), types.end(), vocab::ldp::BasicContainer.text) != types.end();
  if (is_list && options.output.empty() && !options.json) {
    const std::vector<std::string> members = (*read)->objects(vocab::ldp::contains);
    if (members.empty()) session.warn("\"" + name + "\" is a list without members");
    std::string text;
    for (const std::string& member : members) text += printable(member) + "\n";
    return session.terminal().print(text) ? Exit::success : Exit::failure;
  }
  const Result<client::Response> response =
      request(session, url,
              "application/json;profile=\"https://w3id.org/lrt/ns#withUnits\", application/json;q=0.9, text/turtle;q=0.8, text/*;q=0.5, */*;q=0.1");
  if (!response) return unexpected(response.error());
  Result<int> printed = print_bytes(session, *response, name, options);
  if (printed && response->media_type() == "application/json" && options.output.empty() && !session.terminal().is_for_people())
    session.terminal().print("\n");
  return printed;
}

Result<Row> row_of(const NamedProperty& named, const GetOptions& options) {
  Row row{named.name, named.property.url(), {}, {}};
  const Result<client::RepresentationPtr> found = named.property.get();
  if (!found) return unexpected(found.error());
  const Result<rdf::TermId> node = named.property.value_node((*found)->graph, (*found)->focus);
  if (!node) return unexpected(node.error());
  const std::optional<client::Schema> schema = schema_for_reading(named.property);
  row.value = value_at((*found)->graph, *node, schema ? &*schema : nullptr);
  if (!options.unit.empty() && !row.value.is_null()) {
    const std::string iri = row.value.unit_iri;
    Result<PlainValue> in_unit = converted(row.value, options.unit);
    if (!in_unit) return unexpected(in_unit.error().code, "\"" + named.name + "\": " + in_unit.error().message);
    if (in_unit->unit == row.value.unit) in_unit->unit_iri = iri;
    row.value = *std::move(in_unit);
  }
  if (options.unit_iri && !row.value.unit_iri.empty()) row.value.unit = row.value.unit_iri;
  return row;
}

std::string json_of(const Row& row) {
  std::string text = "{\"name\":" + json_string(row.name) + ",\"url\":" + json_string(row.url);
  if (!row.problem.empty()) return text + ",\"problem\":" + json_string(row.problem) + "}";
  text += ",\"value\":" + row.value.json;
  if (!row.value.unit.empty()) text += ",\"unit\":" + json_string(row.value.unit);
  return text + "}";
}

std::string shown(const Row& row, const Terminal& terminal, bool full) {
  return terminal.is_for_people() && !full ? row.value.for_people() : row.value.line();
}

/// One value alone: all of it, and nothing else in a pipe.
Result<int> print_value(Session& session, const Row& row, const GetOptions& options) {
  Terminal& terminal = session.terminal();
  if (options.json) return terminal.print_line(json_of(row)) ? Exit::success : Exit::failure;
  if (row.value.is_null()) return unexpected(Errc::expected_value, "\"" + row.name + "\" has no value now");
  const bool is_text = row.value.json.front() == '"';
  std::string text = terminal.is_for_people() && !options.full && !is_text ? printable_lines(readable_lines(row.value.json)) : row.value.text;
  if (terminal.is_for_people() && !row.value.unit.empty()) text += " " + terminal.styled(row.value.unit, Style::faint);
  return terminal.print_line(text) ? Exit::success : Exit::failure;
}

Result<int> print_values(Session& session, const std::vector<Row>& rows, const GetOptions& options) {
  Terminal& terminal = session.terminal();
  bool all_read = true;
  std::string json = "[";
  Table table;
  for (const Row& row : rows) {
    json += (json.size() > 1 ? "," : "") + json_of(row);
    all_read = all_read && row.problem.empty();
    if (row.problem.empty() || !terminal.is_for_people()) {
      const std::string none = terminal.is_for_people() ? "-" : "";
      if (!row.problem.empty()) session.warn("\"" + row.name + "\": " + row.problem);
      table.add({{printable(row.name), Style::strong},
                 {row.problem.empty() && !row.value.is_null() ? shown(row, terminal, options.full) : none},
                 {row.value.unit, Style::faint}});
    } else {
      table.add({{printable(row.name), Style::strong}, {printable(row.problem), Style::bad}, {}});
    }
  }
  const bool printed = options.json ? terminal.print_line(json + "]") : table.print(terminal, {"property", "value", "unit"});
  return printed && all_read ? Exit::success : Exit::failure;
}

/// The URL of "right_s1/state": of what is below a Thing, or below the root of the server.
std::string url_below(const client::Robot& robot, const std::string& name) {
  std::string path;
  const auto encoded = [](std::string_view rest) {
    std::string result;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find('/'), rest.size());
      result += "/" + iri::encode_segment(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return result;
  };
  for (std::size_t slash = name.rfind('/'); slash != std::string::npos && slash > 0; slash = name.rfind('/', slash - 1))
    if (const Result<client::Thing> thing = robot.thing(name.substr(0, slash)))
      return thing->url() + encoded(std::string_view(name).substr(slash + 1));
  const std::string& url = robot.url();
  return url.substr(0, url.find('/', url.find("://") + 3)) + encoded(name);
}

/// A word that is no property and no Thing: a state, a container, an image by its URL or its path.
Result<int> get_resource(Session& session, const std::string& word, const Error& unknown, const GetOptions& options) {
  if (is_url(word)) return print_resource(session, word, word, options);
  const Result<const client::Robot*> robot = session.robot();
  if (!robot) return unexpected(robot.error());
  if ((*robot)->action(word)) return unexpected(unknown);
  Result<int> printed = print_resource(session, url_below(**robot, word), word, options);
  if (!printed && printed.error().code == Errc::unknown_path) return unexpected(unknown);
  return printed;
}

/// Whether the representation of a URL is that of a value.
bool is_value(const client::Property& property, const Result<client::RepresentationPtr>& found) {
  if (!found || is_action(**found)) return false;
  const Result<rdf::TermId> node = property.value_node((*found)->graph, (*found)->focus);
  if (!node) return false;
  const std::vector<std::string> types = (*found)->types();
  const auto is = [&](Iri type) { return std::find(types.begin(), types.end(), type.text) != types.end(); };
  if (is(vocab::hybrit::Property)) return true;
  return !is(vocab::ldp::BasicContainer) && !is(vocab::ldp::RDFSource) && !value_at((*found)->graph, *node, nullptr).is_null();
}

Result<int> get(Session& session, GetOptions& options) {
  if (options.words.size() > 1 && is_url(options.words[0]) && !is_url(options.words[1])) session.take_robot(options.words, 1);
  const bool is_one = options.words.size() == 1;
  std::vector<Row> rows;
  bool is_list = !is_one;
  for (const std::string& word : options.words) {
    const Result<std::vector<NamedProperty>> named = session.properties(word);
    if (!named && (named.error().code != Errc::unknown_path || !is_one || is_pattern(word))) return unexpected(named.error());
    if (!named) return get_resource(session, word, named.error(), options);
    // A Thing and a pattern are a list, also if they stand for one property.
    const Result<const client::Robot*> robot = is_url(word) ? Result<const client::Robot*>(unexpected(Errc::unknown_path, "")) : session.robot();
    is_list = is_list || named->size() != 1 || (robot && !(*robot)->property(word));
    if (!is_list && !options.accept.empty()) {
      const Result<client::Response> response = request(session, named->front().property.url(), options.accept);
      return response ? print_bytes(session, *response, named->front().name, options) : Result<int>(unexpected(response.error()));
    }
    if (!options.accept.empty() || !options.output.empty()) {
      if (is_list) return unexpected(Errc::invalid_option, "--accept and -o take one property, and \"" + word + "\" is more");
    }
    for (const NamedProperty& one : *named) {
      Result<Row> row = row_of(one, options);
      if (is_one && !is_list) {
        const bool is_other = is_url(word) ? !is_value(one.property, one.property.get()) : !row && row.error().code == Errc::unsupported_syntax;
        if (is_other || !options.output.empty()) return print_resource(session, one.property.url(), one.name, options);
        return row ? print_value(session, *row, options) : Result<int>(unexpected(row.error()));
      }
      if (row) rows.push_back(*std::move(row));
      else if (exit_of(row.error().code) == Exit::unreachable) return unexpected(row.error());
      else if (!options.unit.empty() && row.error().code == Errc::expected_value) return unexpected(row.error());
      else rows.push_back({one.name, one.property.url(), printable(row.error().message), {}});
    }
  }
  return print_values(session, rows, options);
}

}  // namespace

void add_get(CommandLine& line) {
  auto options = std::make_shared<GetOptions>();
  CLI::App* const command =
      line.add("get", "Print values: of properties, of a Thing, of a list or a file",
               "One value is printed alone; several are lines of name, value and unit. A Thing stands for its properties, and * and ? for any\n"
               "letters. Examples:\n"
               "  lrt get right_s1/position              # 0.27; on a terminal 0.27 rad\n"
               "  lrt get right_s1/position --unit deg\n"
               "  lrt get right_s1 'right_*/position'    # several\n"
               "  lrt get right_s1/limits                # a record, as JSON\n"
               "  lrt get head/image -o image.png        # a file\n"
               "  lrt get right_s1/position --accept text/turtle",
               options, get);
  command->add_option("NAME", options->words, "Names of properties or Things, patterns with * and ?, or URLs")
      ->required()
      ->type_name("[ROBOT] NAME...")
      ->expected(1, 1000);
  command->add_option("--accept", options->accept, "Print the server's bytes in this media type")->type_name("TYPE");
  command->add_option("-o,--output", options->output, "Write the server's bytes to this file")->type_name("FILE");
  command->add_flag("--json", options->json, "Print an object with name, url, value and unit; a list of them for several names")
      ->excludes("--accept");
  command->add_option("--unit", options->unit, "Convert the numbers to this unit, such as deg")->type_name("UNIT")->excludes("--accept");
  command->add_flag("--unit-iri", options->unit_iri, "Print the IRIs of units instead of their symbols")->excludes("--accept");
  command->add_flag("--full", options->full, "All digits, also on a terminal");
}

}  // namespace lrt::tool
