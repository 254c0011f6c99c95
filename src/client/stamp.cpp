// SPDX-License-Identifier: Apache-2.0
#include "src/client/stamp.hpp"

#include <lrt/base/result.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/http/stamp.hpp"
#include "src/rdf/json_parse.hpp"

namespace lrt::client {
namespace {

constexpr std::size_t max_series_bytes = 200, max_stamp_bytes = 4'096;

/// Another number is a fault of the server: sums of counts must not overflow.
std::optional<std::uint64_t> count_of(std::string_view text) noexcept {
  const auto count = rdf::lexical::parse_uint64(text);
  return count && *count <= INT64_MAX ? count : std::nullopt;
}

}  // namespace

void Stamp::set_at(std::string_view text) {
  using Utc = std::chrono::system_clock::time_point;
  const auto since = rdf::lexical::parse_instant(text);
  at = since ? std::optional(Utc(std::chrono::floor<Utc::duration>(*since))) : std::nullopt;
}
void Stamp::set_sequence(std::string_view text) noexcept { sequence = count_of(text); }
void Stamp::set_left_out(std::string_view text) noexcept { left_out = count_of(text); }
void Stamp::set_series(std::string_view text) { series = text.size() <= max_series_bytes ? text : std::string_view(); }

std::optional<Stamp> read_stamp(std::string_view json) {
  using rdf::json::Document;
  if (json.size() > max_stamp_bytes) return std::nullopt;
  rdf::json::Limits limits;
  limits.values = 100;
  limits.depth = 8;
  const Result<Document> document = Document::parse(json, limits);
  if (!document || document->kind(document->root()) != Document::Kind::object) return std::nullopt;
  const auto text = [&](std::string_view name, Document::Kind kind) -> std::optional<std::string_view> {
    const Document::Id id = document->member(document->root(), name);
    if (id == Document::none || document->kind(id) != kind) return std::nullopt;
    return document->text(id);
  };
  Stamp stamp;
  const auto sequence = text(http::sequence_member, Document::Kind::number);
  if (!sequence) return std::nullopt;
  stamp.set_sequence(*sequence);
  if (const auto left_out = text(http::left_out_member, Document::Kind::number)) stamp.set_left_out(*left_out);
  if (const auto at = text(http::time_member, Document::Kind::string)) stamp.set_at(*at);
  if (const auto series = text(http::series_member, Document::Kind::string)) stamp.set_series(*series);
  return stamp;
}

std::string read_heartbeat(std::string_view json) {
  std::string expected("{\"");
  expected.append(http::heartbeat_name).append("\":\"");
  if (json.size() > max_series_bytes || json.substr(0, expected.size()) != expected) return {};
  json.remove_prefix(expected.size());
  return std::string(json.substr(0, json.find('"')));
}

std::optional<std::uint64_t> between(const Stamp& last, const Stamp& next) noexcept {
  if (!last.sequence || !next.sequence || last.series.empty() || last.series != next.series || *next.sequence < *last.sequence) return std::nullopt;
  return *next.sequence == *last.sequence ? 0 : *next.sequence - *last.sequence - 1;
}

}  // namespace lrt::client
