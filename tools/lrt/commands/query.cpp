// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>

#include <lrt/rdf/codec.hpp>

#include "src/http/url.hpp"
#include "tools/lrt/command_line.hpp"

namespace lrt::tool {
namespace {

struct QueryOptions {
  std::vector<std::string> words;
  std::string accept, endpoint;
};

/// The relation from the list of Things to the endpoint.
constexpr std::string_view endpoint_relation = "https://w3id.org/lrt/ns#query";
/// SELECT as CSV, CONSTRUCT and DESCRIBE as Turtle; ASK has neither.
constexpr const char* preferred = "text/csv, text/turtle;q=0.9, application/sparql-results+json;q=0.5";

/// The endpoint that a document links to, or the list of Things of its server.
Result<std::string> find_endpoint(Client& client, const std::string& robot) {
  const Result<http::Url> url = http::parse_url(robot);
  if (!url) return unexpected(url.error());
  for (const std::string& document : {robot, url->origin() + "/"}) {
    const Result<client::Response> response = client.send({"GET", document, {{"Accept", "text/turtle"}}, {}});
    if (!response) return unexpected(response.error());
    for (const client::Link& link : client::links(response->fields, response->url)) {
      if (link.relation != endpoint_relation) continue;
      if (has_same_origin(link.target, response->url)) return link.target;
      return unexpected(Errc::unknown_path, "\"" + response->url + "\" has its endpoint of queries at another address: use --endpoint \"" +
                                                link.target + "\", or the robot's own URL there");
    }
  }
  return unexpected(Errc::unknown_path, "the robot links to no SPARQL endpoint; --endpoint URL names one");
}

/// Rows of CSV (RFC 4180).
std::vector<std::vector<std::string>> rows_of(std::string_view csv) {
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> row(1);
  bool quoted = false;
  for (std::size_t i = 0; i < csv.size(); ++i) {
    const char c = csv[i];
    if (quoted) {
      if (c != '"') row.back() += c;
      else if (i + 1 < csv.size() && csv[i + 1] == '"') row.back() += csv[++i];
      else quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if (c == ',') {
      row.emplace_back();
    } else if (c == '\n') {
      rows.push_back(std::move(row));
      row.assign(1, {});
    } else if (c != '\r') {
      row.back() += c;
    }
  }
  if (row.size() > 1 || !row[0].empty()) rows.push_back(std::move(row));
  return rows;
}

bool is_name_character(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
}

/// PREFIX declarations of the known prefixes that a query uses and does not declare, in the first line: the numbers of its lines stay.
std::string prologue_for(const std::string& query) {
  std::string prologue;
  for (const auto& [prefix, space] : rdf::default_prefixes()) {
    const std::string name = prefix + ":";
    bool is_used = false, is_declared = false;
    for (std::size_t at = query.find(name); at != std::string::npos; at = query.find(name, at + 1)) {
      if (at > 0 && is_name_character(query[at - 1])) continue;
      std::size_t end = at;
      while (end > 0 && std::string_view(" \t\r\n").find(query[end - 1]) != std::string_view::npos) --end;
      std::string before = query.substr(end < 6 ? 0 : end - 6, std::min<std::size_t>(end, 6));
      std::transform(before.begin(), before.end(), before.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
      is_declared = is_declared || before == "PREFIX";
      is_used = true;
    }
    if (is_used && !is_declared) prologue += "PREFIX " + name + " <" + space + "> ";
  }
  return prologue;
}

bool print_rows(Session& session, std::string_view csv) {
  Terminal& terminal = session.terminal();
  const auto rows = rows_of(csv);
  if (rows.size() < 2) session.warn("no rows");
  Table table;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    std::vector<Table::Cell> cells;
    for (const std::string& value : rows[i]) cells.push_back({printable(value)});
    table.add(std::move(cells));
  }
  std::vector<std::string> heading;
  if (!rows.empty())
    for (const std::string& name : rows[0]) heading.push_back(printable(name));
  return table.empty() || table.print(terminal, heading);
}

Result<int> query(Session& session, QueryOptions& options) {
  session.take_robot(options.words, 1);
  if (options.words.size() != 1) return unexpected(Errc::invalid_option, "query takes one query, @FILE or -");
  const Result<Body> text = body_of(options.words.front(), {});
  if (!text) return unexpected(text.error());
  const Result<Client*> client = session.client();
  if (!client) return unexpected(client.error());
  if (options.endpoint.empty()) {
    if (session.options().robot.empty())
      return unexpected(Errc::invalid_option, "no robot is given: set LRT_ROBOT, or use --robot URL or --endpoint URL");
    Result<std::string> found = find_endpoint(**client, session.options().robot);
    if (!found) return unexpected(std::move(found).error());
    options.endpoint = *std::move(found);
  }
  const std::string accept = options.accept.empty() ? preferred : options.accept;
  const Result<client::Response> response = (*client)->send(
      {"POST", options.endpoint, {{"Accept", accept}, {"Content-Type", "application/sparql-query"}}, prologue_for(text->bytes) + text->bytes});
  if (!response) return unexpected(response.error());
  if (!response->ok()) return unexpected(Errc::refused, std::to_string(response->status) + ": " + response->reason());
  Terminal& terminal = session.terminal();
  const std::string type = response->media_type();
  bool printed;
  if (!options.accept.empty()) printed = terminal.print(terminal.is_for_people() ? printable_lines(response->body) : response->body);
  else if (type == "text/csv") printed = print_rows(session, response->body);
  else if (type == "application/sparql-results+json")
    printed = terminal.print_line(response->body.find("true") != std::string::npos ? "true" : "false");
  else printed = terminal.print(terminal.is_for_people() ? printable_lines(response->body) : response->body);
  return printed ? Exit::success : Exit::failure;
}

}  // namespace

void add_query(CommandLine& line) {
  auto options = std::make_shared<QueryOptions>();
  CLI::App* const command = line.add("query", "Run a SPARQL query on the robot",
                                     "Rows are printed in columns; in a pipe a tab separates them. Examples:\n"
                                     "  lrt query 'SELECT ?g { GRAPH ?g {} }'\n"
                                     "  lrt query @question.rq\n"
                                     "  lrt query 'ASK { ?joint a ros:RevoluteJoint }'      # known prefixes need no declaration\n"
                                     "  lrt query @question.rq --accept application/sparql-results+json",
                                     options, query);
  command->add_option("QUERY", options->words, "A SPARQL query, @FILE or -")->required()->type_name("[ROBOT] QUERY")->expected(1, 2);
  command->add_option("--accept", options->accept, "Print the server's bytes in this media type")->type_name("TYPE");
  command->add_option("--endpoint", options->endpoint, "The SPARQL endpoint; default: the one that the robot links to")->type_name("URL");
}

}  // namespace lrt::tool
