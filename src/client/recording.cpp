// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/recording.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>

#include <lrt/base/clock.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/base/quote.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/rdf/plain.hpp"

namespace lrt::client {
inline namespace v0 {

using rdf::json::Document;

namespace {

constexpr std::string_view line_feed = "\n";

std::string json_of(const Document& document, Document::Id id) {
  switch (document.kind(id)) {
    case Document::Kind::null: return "null";
    case Document::Kind::true_: return "true";
    case Document::Kind::false_: return "false";
    case Document::Kind::number: return std::string(document.text(id));
    case Document::Kind::string: return json_string(document.text(id));
    case Document::Kind::array: {
      std::string text = "[";
      for (const Document::Id item : rdf::json::Children(document, id)) text += (text.size() > 1 ? "," : "") + json_of(document, item);
      return text + "]";
    }
    case Document::Kind::object: {
      std::string text = "{";
      for (const Document::Id item : rdf::json::Children(document, id))
        text += (text.size() > 1 ? "," : "") + json_string(document.key(item)) + ":" + json_of(document, item);
      return text + "}";
    }
  }
  return "null";
}

/// The text of a member; nullopt: there is none, or it is no text.
std::optional<std::string> text_of(const Document& document, std::string_view name) {
  const Document::Id id = document.member(document.root(), name);
  if (id == Document::none || document.kind(id) != Document::Kind::string) return std::nullopt;
  return std::string(document.text(id));
}

std::optional<double> number_of(const Document& document, std::string_view name) {
  const Document::Id id = document.member(document.root(), name);
  if (id == Document::none || document.kind(id) != Document::Kind::number) return std::nullopt;
  return rdf::lexical::parse_double(document.text(id));
}

std::optional<Document> object_of(std::string_view line) {
  rdf::json::Limits limits;
  limits.values = 1'000'000;
  limits.depth = 64;
  Result<Document> document = Document::parse(line, limits);
  if (!document || document->kind(document->root()) != Document::Kind::object) return std::nullopt;
  return *std::move(document);
}

std::optional<RecordedChange> change_of(std::string_view line) {
  const std::optional<Document> document = object_of(line);
  if (!document) return std::nullopt;
  const std::optional<double> at = number_of(*document, "at");
  const std::optional<std::string> name = text_of(*document, "name");
  constexpr double longest = 1e12;  // seconds; a fraction of what microseconds can say
  if (!at || !name || name->empty() || !(*at >= 0 && *at <= longest)) return std::nullopt;
  RecordedChange change;
  change.at = std::chrono::microseconds(std::llround(*at * 1e6));
  change.name = *name;
  if (const std::optional<std::string> gap = text_of(*document, "gap")) {
    change.gap = *gap;
    return change;
  }
  const Document::Id value = document->member(document->root(), "value");
  if (value == Document::none) return std::nullopt;
  change.value = json_of(*document, value);
  change.unit = text_of(*document, "unit").value_or(std::string());
  if (const std::optional<std::string> time = text_of(*document, "sourceTime")) {
    using Utc = std::chrono::system_clock::time_point;
    if (const auto since = rdf::lexical::parse_instant(*time)) change.source_time = Utc(std::chrono::floor<Utc::duration>(*since));
  }
  return change;
}

}  // namespace

std::string to_line(const RecordingHeader& header) {
  return R"({"lrt":"recording","version":1,"robot":)" + json_string(header.robot) + ",\"started\":" + json_string(header.started) + "}" +
         std::string(line_feed);
}

std::string to_line(const RecordedChange& change) {
  char at[40];
  std::snprintf(at, sizeof at, "%lld.%06lld", static_cast<long long>(change.at.count() / 1'000'000),
                static_cast<long long>(change.at.count() % 1'000'000));
  std::string line = "{\"at\":" + std::string(at) + ",\"name\":" + json_string(change.name);
  if (change.is_gap()) {
    line += ",\"gap\":" + json_string(change.gap);
  } else {
    line += ",\"value\":" + change.value;
    if (!change.unit.empty()) line += ",\"unit\":" + json_string(change.unit);
    if (change.source_time) line += ",\"sourceTime\":\"" + to_xsd_date_time(*change.source_time) + "\"";
  }
  return line + "}" + std::string(line_feed);
}

Result<Recording> Recording::parse(std::string_view text, const RecordingLimits& limits) {
  if (text.size() > limits.max_bytes)
    return unexpected(Errc::limit_exceeded, "a recording of more than " + std::to_string(limits.max_bytes) + " bytes");
  const auto next_line = [&text] {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  };
  const std::string_view first = next_line();
  const std::optional<Document> header = first.size() <= limits.max_line_bytes ? object_of(first) : std::nullopt;
  if (!header || text_of(*header, "lrt") != "recording")
    return unexpected(Errc::expected_value, "not a recording: the first line is not a recording header");
  if (number_of(*header, "version") != 1.0) return unexpected(Errc::expected_value, "a recording of another version: expected 1");
  Recording recording;
  recording.header_.robot = text_of(*header, "robot").value_or(std::string());
  recording.header_.started = text_of(*header, "started").value_or(std::string());
  while (!text.empty()) {
    const std::string_view line = next_line();
    if (line.empty()) continue;
    std::optional<RecordedChange> change = line.size() <= limits.max_line_bytes ? change_of(line) : std::nullopt;
    if (!change) {
      ++recording.damaged_lines_;
      continue;
    }
    if (recording.changes_.size() >= limits.max_changes)
      return unexpected(Errc::limit_exceeded, "a recording of more than " + std::to_string(limits.max_changes) + " changes");
    recording.changes_.push_back(*std::move(change));
  }
  std::stable_sort(recording.changes_.begin(), recording.changes_.end(),
                   [](const RecordedChange& a, const RecordedChange& b) { return a.at < b.at; });
  return recording;
}

Result<rdf::Value> detail::read_json(std::string_view json, const rdf::Type& type, const rdf::Facets& facets) {
  rdf::Graph graph;
  const rdf::TermId focus = graph.intern(rdf::iri("urn:value"));
  constexpr std::size_t max_values = 1'000'000;
  constexpr std::string_view vocabulary = "urn:vocabulary";
  if (Result<void> read = rdf::read_plain(json, rdf::Plain::json, type, facets, vocabulary, max_values, graph, focus); !read)
    return unexpected(std::move(read).error());
  std::vector<rdf::Mismatch> mismatches;
  return rdf::read_value(graph, focus, type, facets, vocabulary, mismatches);
}

}  // namespace v0
}  // namespace lrt::client
