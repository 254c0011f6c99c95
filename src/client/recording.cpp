// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/recording.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <utility>

#include <lrt/base/clock.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/base/quote.hpp"
#include "src/client/recording_json.hpp"
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

std::optional<std::uint64_t> count_of(const Document& document, Document::Id id) {
  if (id == Document::none || document.kind(id) != Document::Kind::number) return std::nullopt;
  const auto count = rdf::lexical::parse_uint64(document.text(id));
  return count && *count <= INT64_MAX ? count : std::nullopt;
}

using Utc = std::chrono::system_clock::time_point;

std::optional<Utc> time_of(std::string_view text) {
  const auto since = rdf::lexical::parse_instant(text);
  return since ? std::optional(Utc(std::chrono::floor<Utc::duration>(*since))) : std::nullopt;
}

GapBound bound_of(const Document& document, std::string_view name) {
  GapBound bound;
  const Document::Id id = document.member(document.root(), name);
  if (id == Document::none || document.kind(id) != Document::Kind::object) return bound;
  bound.sequence = count_of(document, document.member(id, "sequence"));
  const Document::Id time = document.member(id, "time");
  if (time != Document::none && document.kind(time) == Document::Kind::string) bound.source_time = time_of(document.text(time));
  return bound;
}

std::string json_of(const GapBound& bound) {
  std::string text = "{";
  if (bound.sequence) text += "\"sequence\":" + std::to_string(*bound.sequence);
  if (bound.source_time) text += (text.size() > 1 ? ",\"time\":\"" : "\"time\":\"") + to_xsd_date_time(*bound.source_time) + "\"";
  return text + "}";
}

constexpr std::pair<GapCause, std::string_view> cause_names[] = {{GapCause::connection, "connection"}, {GapCause::restart, "restart"},
                                                                 {GapCause::left_out, "left out"},     {GapCause::not_taken, "not taken"},
                                                                 {GapCause::polled, "polled"},         {GapCause::ended, "ended"}};

}  // namespace

std::string_view to_string(GapCause cause) noexcept {
  for (const auto& [value, name] : cause_names)
    if (value == cause) return name;
  return "unknown";
}

GapCause gap_cause_of(std::string_view text) noexcept {
  for (const auto& [value, name] : cause_names)
    if (name == text) return value;
  return GapCause::unknown;
}

std::string detail::members_of(const RecordedChange& change) {
  std::string text;
  if (change.is_gap()) {
    text += "\"gap\":" + json_string(change.gap);
    if (change.cause != GapCause::unknown) text += ",\"cause\":\"" + std::string(to_string(change.cause)) + "\"";
    if (change.left_out) text += ",\"leftOut\":" + std::to_string(*change.left_out);
    if (change.from.sequence || change.from.source_time) text += ",\"from\":" + json_of(change.from);
    if (change.to.sequence || change.to.source_time) text += ",\"to\":" + json_of(change.to);
    return text;
  }
  text += "\"value\":" + change.value;
  if (!change.unit.empty()) text += ",\"unit\":" + json_string(change.unit);
  if (change.source_time) text += ",\"sourceTime\":\"" + to_xsd_date_time(*change.source_time) + "\"";
  if (change.sequence) text += ",\"sequence\":" + std::to_string(*change.sequence);
  if (!change.series.empty()) text += ",\"series\":" + json_string(change.series);
  return text;
}

bool detail::read_members(const rdf::json::Document& document, RecordedChange& change) {
  change.url = text_of(document, "url").value_or(std::string());
  change.robot = text_of(document, "robot").value_or(std::string());
  if (std::optional<std::string> gap = text_of(document, "gap")) {
    change.gap = *std::move(gap);
    change.cause = gap_cause_of(text_of(document, "cause").value_or(std::string()));
    change.left_out = count_of(document, document.member(document.root(), "leftOut"));
    change.from = bound_of(document, "from");
    change.to = bound_of(document, "to");
    return true;
  }
  const Document::Id value = document.member(document.root(), "value");
  if (value == Document::none) return false;
  change.value = json_of(document, value);
  change.unit = text_of(document, "unit").value_or(std::string());
  if (const std::optional<std::string> time = text_of(document, "sourceTime")) change.source_time = time_of(*time);
  change.sequence = count_of(document, document.member(document.root(), "sequence"));
  change.series = text_of(document, "series").value_or(std::string());
  return true;
}

std::optional<rdf::json::Document> detail::recorded_object(std::string_view json) { return object_of(json); }

std::string to_line(const RecordingHeader& header) {
  std::string line = R"({"lrt":"recording","version":2,"robot":)" + json_string(header.robot);
  if (header.robots.size() > 1) {
    line += ",\"robots\":[";
    for (std::size_t i = 0; i < header.robots.size(); ++i) line += (i == 0 ? "" : ",") + json_string(header.robots[i]);
    line += "]";
  }
  return line + ",\"started\":" + json_string(header.started) + "}" + std::string(line_feed);
}

std::string to_line(const RecordedChange& change) {
  char at[40];
  std::snprintf(at, sizeof at, "%lld.%06lld", static_cast<long long>(change.at.count() / 1'000'000),
                static_cast<long long>(change.at.count() % 1'000'000));
  std::string line = "{\"at\":" + std::string(at) + ",\"name\":" + json_string(change.name);
  if (!change.url.empty()) line += ",\"url\":" + json_string(change.url);
  if (!change.robot.empty()) line += ",\"robot\":" + json_string(change.robot);
  return line + "," + detail::members_of(change) + "}" + std::string(line_feed);
}

Result<RecordingLines> RecordingLines::begin(std::string_view line) {
  const std::optional<Document> header = object_of(line);
  if (!header || text_of(*header, "lrt") != "recording")
    return unexpected(Errc::expected_value, "not a recording: the first line is not a recording header");
  const std::optional<double> version = number_of(*header, "version");
  if (version != 1.0 && version != 2.0) return unexpected(Errc::expected_value, "a recording of another version: expected 1 or 2");
  RecordingLines made;
  made.version_ = version == 1.0 ? 1 : 2;
  made.header_.robot = text_of(*header, "robot").value_or(std::string());
  made.header_.started = text_of(*header, "started").value_or(std::string());
  constexpr std::size_t max_robots = 10'000;
  const Document::Id robots = header->member(header->root(), "robots");
  if (robots != Document::none && header->kind(robots) == Document::Kind::array)
    for (const Document::Id robot : rdf::json::Children(*header, robots))
      if (header->kind(robot) == Document::Kind::string && made.header_.robots.size() < max_robots)
        made.header_.robots.emplace_back(header->text(robot));
  return made;
}

std::optional<RecordedChange> RecordingLines::read(std::string_view line) {
  const std::optional<Document> document = object_of(line);
  if (!document) return std::nullopt;
  const std::optional<double> at = number_of(*document, "at");
  std::optional<std::string> name = text_of(*document, "name");
  constexpr double longest = 1e12;  // seconds; a fraction of what microseconds can say
  if (!at || !name || name->empty() || !(*at >= 0 && *at <= longest)) return std::nullopt;
  RecordedChange change;
  change.at = std::chrono::microseconds(std::llround(*at * 1e6));
  change.name = *std::move(name);
  if (!detail::read_members(*document, change)) return std::nullopt;
  if (change.is_gap() || !change.sequence) return change;
  constexpr std::size_t max_properties = 100'000;
  const std::string& key = change.url.empty() ? change.name : change.url;
  const auto known = series_.find(key);
  if (change.series.empty()) {
    if (known != series_.end()) change.series = known->second;
  } else if (known != series_.end()) {
    known->second = change.series;
  } else if (series_.size() < max_properties) {
    series_.emplace(key, change.series);
  }
  return change;
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
  Result<RecordingLines> lines = RecordingLines::begin(first.size() <= limits.max_line_bytes ? first : std::string_view());
  if (!lines) return unexpected(std::move(lines).error());
  Recording recording;
  recording.header_ = lines->header();
  while (!text.empty()) {
    const std::string_view line = next_line();
    if (line.empty()) continue;
    std::optional<RecordedChange> change = line.size() <= limits.max_line_bytes ? lines->read(line) : std::nullopt;
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
