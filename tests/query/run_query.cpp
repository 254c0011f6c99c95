// SPDX-License-Identifier: Apache-2.0
// Runs queries for w3c_test.py. Each line of the input is a query: tab-separated, its file, the base of its IRIs, and then `default=FILE` and
// `named=FILE=IRI` for its graphs. The graphs of FROM and FROM NAMED are files, too. Each answer is a line with its kind and size, and then
// that many bytes: `json`, `nt`, or `error` with a message.

#include <cstdio>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>

#include "src/base/read_file.hpp"
#include "src/query/evaluate.hpp"
#include "src/query/parser.hpp"

namespace {

using lrt::Result;

void print(const char* kind, const std::string& bytes) {
  std::printf("%s %zu\n%s\n", kind, bytes.size(), bytes.c_str());
  std::fflush(stdout);
}

Result<lrt::rdf::Graph> load(const std::string& file, const std::string& iri) {
  auto text = lrt::read_file(file, 64 << 20);
  if (!text) return lrt::unexpected(text.error());
  const auto ends = [&](const std::string& end) { return file.size() > end.size() && file.compare(file.size() - end.size(), end.size(), end) == 0; };
  lrt::rdf::ReadOptions options;
  options.base = iri;
  return lrt::rdf::read(*text, ends(".rdf") ? lrt::rdf::Syntax::rdf_xml : lrt::rdf::Syntax::turtle, options);
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator) parts.emplace_back();
    else parts.back() += c;
  }
  return parts;
}

Result<lrt::query::Answer> run(const std::string& line) {
  const auto fields = split(line, '\t');
  if (fields.size() < 2) return lrt::unexpected(lrt::Errc::expected_value, "expected a file and a base");
  lrt::query::Dataset data;
  lrt::query::Selection selection;
  for (std::size_t i = 2; i < fields.size(); ++i) {
    const auto parts = split(fields[i], '=');
    const bool named = parts[0] == "named";
    const std::string name = named ? parts[2] : "file://" + parts[1];
    const std::string graph = named ? name : "urn:default:" + std::to_string(i);
    auto read = load(parts[1], name);
    if (!read) return lrt::unexpected(read.error().code, parts[1] + ": " + read.error().message);
    data.put(graph, *read);
    (named ? selection.named_graphs : selection.default_graphs).push_back(graph);
  }
  if (selection.default_graphs.empty()) selection.default_graphs.emplace_back("urn:default:none");
  auto text = lrt::read_file(fields[0], 1 << 20);
  if (!text) return lrt::unexpected(text.error());
  lrt::query::ParseOptions options;
  options.base = fields[1];
  auto query = lrt::query::parse(*text, options);
  if (!query) return lrt::unexpected(query.error());
  const bool own = !(*query)->from.empty() || !(*query)->from_named.empty();
  for (const auto* list : {&(*query)->from, &(*query)->from_named}) {
    for (const std::string& iri : *list) {
      if (iri.compare(0, 7, "file://") != 0) continue;
      auto read = load(iri.substr(7), iri);
      if (!read) return lrt::unexpected(read.error());
      data.put(iri, *read);
    }
  }
  const std::atomic<bool> cancelled{false};
  return lrt::query::evaluate(**query, data, {}, cancelled, std::chrono::system_clock::now(), own ? nullptr : &selection);
}

}  // namespace

int main() {
  std::string line;
  while (std::getline(std::cin, line)) {
    auto answer = run(line);
    if (!answer) {
      print("error", answer.error().message);
    } else if (const auto* graph = std::get_if<lrt::rdf::Graph>(&*answer)) {
      print("nt", lrt::rdf::write(*graph, lrt::rdf::Syntax::n_triples).value());
    } else {
      auto json = std::holds_alternative<bool>(*answer) ? lrt::query::write(std::get<bool>(*answer), lrt::query::ResultFormat::json)
                                                        : lrt::query::write(std::get<lrt::query::Table>(*answer), lrt::query::ResultFormat::json);
      print("json", json.value());
    }
  }
}
