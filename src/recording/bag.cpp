// SPDX-License-Identifier: Apache-2.0
#include "src/recording/bag.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

#include <lrt/rdf/lexical.hpp>
#include <lrt/version.hpp>

#include "src/base/quote.hpp"
#include "src/client/recording_json.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/recording/mcap.hpp"

namespace lrt::recording {

using client::GapCause;
using client::RecordedChange;
using client::RecordingHeader;
using rdf::json::Document;
using std::chrono::microseconds;
using Utc = std::chrono::system_clock::time_point;

namespace {

constexpr std::string_view recording_metadata = "lrt:recording", robot_metadata = "lrt:robot", property_metadata = "lrt:property";
constexpr std::string_view gap_topic = "lrt/gaps";
constexpr std::string_view json_encoding = "json", json_schema = "jsonschema";

mcap::Nanoseconds nanoseconds(Utc time) {
  const auto count = std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
  return count > 0 ? static_cast<mcap::Nanoseconds>(count) : 0;
}

std::optional<Utc> utc_of(std::string_view text) {
  const auto since = rdf::lexical::parse_instant(text);
  return since ? std::optional(Utc(std::chrono::floor<Utc::duration>(*since))) : std::nullopt;
}

/// The JSON Schema that a value obviously has, so that a viewer knows what can be drawn. It demands nothing that later values may lack.
std::string schema_of(const Document& document, Document::Id id, unsigned depth) {
  constexpr unsigned max_depth = 8;
  switch (document.kind(id)) {
    case Document::Kind::null: return "{}";
    case Document::Kind::true_:
    case Document::Kind::false_: return R"({"type":"boolean"})";
    case Document::Kind::number: return R"({"type":"number"})";
    case Document::Kind::string: return R"({"type":"string"})";
    case Document::Kind::array: {
      std::string items;
      for (const Document::Id item : rdf::json::Children(document, id)) {
        std::string next = depth < max_depth ? schema_of(document, item, depth + 1) : "{}";
        if (!items.empty() && items != next) {
          items = "{}";
          break;
        }
        items = std::move(next);
      }
      return R"({"type":"array","items":)" + (items.empty() ? "{}" : items) + "}";
    }
    case Document::Kind::object: {
      std::string members;
      for (const Document::Id member : rdf::json::Children(document, id))
        members += (members.empty() ? "" : ",") + json_string(document.key(member)) + ":" +
                   (depth < max_depth ? schema_of(document, member, depth + 1) : "{}");
      return R"({"type":"object","properties":{)" + members + "}}";
    }
  }
  return "{}";
}

std::string_view kind_of(const Document& document, Document::Id id) {
  switch (document.kind(id)) {
    case Document::Kind::null: return "nothing";
    case Document::Kind::true_:
    case Document::Kind::false_: return "boolean";
    case Document::Kind::number: return "number";
    case Document::Kind::string: return "text";
    case Document::Kind::array: return "list";
    case Document::Kind::object: return "record";
  }
  return "value";
}

constexpr std::string_view gap_schema =
    R"({"type":"object","title":"Values that are missing","properties":{"iri":{"type":"string"},"name":{"type":"string"},"robot":{"type":"string"},)"
    R"("gap":{"type":"string"},"cause":{"type":"string"},"leftOut":{"type":"integer"},)"
    R"("from":{"type":"object","properties":{"sequence":{"type":"integer"},"time":{"type":"string","format":"date-time"}}},)"
    R"("to":{"type":"object","properties":{"sequence":{"type":"integer"},"time":{"type":"string","format":"date-time"}}}}})";

/// The path of an IRI, "/baxter/right_s1/position".
std::string path_of(const std::string& url) {
  const std::size_t host = url.find("://");
  const std::size_t path = host == std::string::npos ? host : url.find('/', host + 3);
  return path == std::string::npos ? url : url.substr(path);
}

class JsonLinesWriter final : public BagWriter {
 public:
  explicit JsonLinesWriter(std::string robot, Sink sink) : robot_(std::move(robot)), sink_(std::move(sink)) {}
  Result<void> begin(const RecordingHeader& header) { return sink_(client::to_line(header)); }
  void describe(const std::string&, std::string) override {}
  Result<void> add(const RecordedChange& change) override {
    RecordedChange written = change;
    if (written.robot == robot_) written.robot.clear();
    if (!written.is_gap()) {
      std::string& last = series_[written.url.empty() ? written.name : written.url];
      if (written.series == last) written.series.clear();
      else last = written.series;
    }
    return sink_(client::to_line(written));
  }
  Result<void> flush_older(microseconds) override { return {}; }
  Result<void> end() override { return {}; }

 private:
  const std::string robot_;
  const Sink sink_;
  std::map<std::string, std::string> series_;
};

class McapWriter final : public BagWriter {
 public:
  McapWriter(const BagWriterOptions& options, std::string robot, Sink sink)
      : options_(options), robot_(std::move(robot)), writer_(of(options), std::move(sink)) {}

  Result<void> begin(const RecordingHeader& header) {
    if (Result<void> done = writer_.begin(); !done) return done;
    mcap::Metadata about{{"version", "2"}, {"robot", header.robot}, {"started", header.started}};
    about.emplace("startedNanoseconds", std::to_string(nanoseconds(options_.started)));
    if (Result<void> done = writer_.add_metadata(std::string(recording_metadata), about); !done) return done;
    const std::vector<std::string> robots = header.robots.empty() ? std::vector<std::string>{header.robot} : header.robots;
    for (const std::string& robot : robots)
      if (Result<void> done = writer_.add_metadata(std::string(robot_metadata), {{"iri", robot}}); !done) return done;
    return {};
  }

  void describe(const std::string& url, std::string value_schema) override { value_schemas_[url] = std::move(value_schema); }
  Result<void> add(const RecordedChange& change) override {
    summary_.add(change);
    mcap::Message message;
    message.log_time = log_time(change.at);
    message.publish_time = change.source_time ? nanoseconds(*change.source_time) : message.log_time;
    std::string json;
    std::optional<std::uint16_t> channel;
    if (change.is_gap()) {
      if (!gap_channel_)
        gap_channel_ = writer_.add_channel(schema("lrt.gap", std::string(gap_schema)), std::string(gap_topic), std::string(json_encoding), {});
      channel = gap_channel_;
      json = "{\"iri\":" + json_string(change.url) + ",\"name\":" + json_string(change.name) + ",\"robot\":" + json_string(robot_of(change)) + "," +
             client::detail::members_of(change) + "}";
    } else {
      if (change.sequence) message.sequence = static_cast<std::uint32_t>(*change.sequence);  // the low 32 bits; the message has all
      json = "{" + client::detail::members_of(change) + "}";
      channel = channel_of(change, json);
    }
    if (!channel) return unexpected(Errc::limit_exceeded, "more properties than a file can have");
    message.channel_id = *channel;
    message.data = json;
    return writer_.add(message);
  }
  Result<void> flush_older(microseconds at) override { return writer_.flush_older(log_time(at)); }
  Result<void> end() override {
    if (Result<void> done = writer_.flush_older(UINT64_MAX); !done) return done;
    for (const PropertySummary& property : summary_.properties()) {
      mcap::Metadata counts{{"iri", property.url}, {"name", property.name}, {"robot", property.robot}, {"values", std::to_string(property.values)}};
      counts.emplace("gaps", std::to_string(property.gaps));
      counts.emplace("leftOut", std::to_string(property.left_out));
      counts.emplace("gapsOfUnknownLength", std::to_string(property.gaps_unknown));
      if (Result<void> done = writer_.add_metadata(std::string(property_metadata), counts); !done) return done;
    }
    return writer_.end();
  }

 private:
  static mcap::WriterOptions of(const BagWriterOptions& options) {
    mcap::WriterOptions made;
    made.library_version = LRT_VERSION;
    made.compress = options.compress;
    return made;
  }
  mcap::Nanoseconds log_time(microseconds at) const {
    constexpr std::uint64_t longest = UINT64_MAX / 2000;  // 292 years
    return nanoseconds(options_.started) + std::min(static_cast<std::uint64_t>(std::max(at, microseconds(0)).count()), longest) * 1000;
  }
  const std::string& robot_of(const RecordedChange& change) const { return change.robot.empty() ? robot_ : change.robot; }

  std::uint16_t schema(const std::string& name, std::string text) {
    const auto [known, is_new] = schemas_.try_emplace(text, std::uint16_t{0});
    if (!is_new) return known->second;
    const unsigned number = ++names_[name];
    known->second = writer_.add_schema(number == 1 ? name : name + "." + std::to_string(number), std::string(json_schema), std::move(text));
    return known->second;
  }

  std::optional<std::uint16_t> channel_of(const RecordedChange& change, const std::string& json) {
    const std::string& key = change.url.empty() ? change.name : change.url;
    const auto known = channels_.find(key);
    if (known != channels_.end()) return known->second;
    std::string value_schema = "{}", kind = "value";
    if (const std::optional<Document> document = client::detail::recorded_object(json)) {
      const Document::Id value = document->member(document->root(), "value");
      if (value != Document::none) {
        value_schema = schema_of(*document, value, 0);
        kind = kind_of(*document, value);
      }
    }
    if (const auto described = value_schemas_.find(key); described != value_schemas_.end()) value_schema = described->second;
    std::string text =
        R"({"type":"object","properties":{"value":)" + value_schema +
        R"(,"unit":{"type":"string"},"sourceTime":{"type":"string","format":"date-time"},"sequence":{"type":"integer"},"series":{"type":"string"}},)"
        R"("required":["value"]})";
    mcap::Metadata metadata{{"iri", change.url}, {"name", change.name}, {"robot", robot_of(change)}};
    if (!change.unit.empty()) metadata.emplace("unit", change.unit);
    std::string topic = options_.topics_are_iris || change.url.empty() ? key : path_of(change.url);
    const std::optional<std::uint16_t> id =
        writer_.add_channel(schema("lrt." + kind, std::move(text)), std::move(topic), std::string(json_encoding), std::move(metadata));
    if (id) channels_.emplace(key, *id);
    return id;
  }

  const BagWriterOptions options_;
  const std::string robot_;
  mcap::Writer writer_;
  Summary summary_;
  std::map<std::string, std::uint16_t> schemas_;  // by their text
  std::map<std::string, unsigned> names_;
  std::map<std::string, std::uint16_t> channels_;     // by IRI
  std::map<std::string, std::string> value_schemas_;  // by IRI
  std::optional<std::uint16_t> gap_channel_;
};

/// JSON of lrt has no U+0000 in strings, so what has it is no name.
std::string without_nul(const std::string& text) { return text.find('\0') == std::string::npos ? text : std::string(); }

/// Hands out the messages of lrt's own channels, and those of others whose objects have a `value`.
class McapEvents final : public mcap::Events {
 public:
  McapEvents(BagReport& report, const std::function<Result<BagRange>(const RecordingHeader&)>& range,
             const std::function<Result<void>(RecordedChange&&)>& on_change)
      : report_(report), range_of_(range), on_change_(on_change) {}

  bool metadata(const std::string& name, const mcap::Metadata& metadata) override {
    const auto text = [&](const char* key) {
      const auto found = metadata.find(key);
      return found == metadata.end() ? std::string() : without_nul(found->second);
    };
    if (name == recording_metadata && !has_begun_) {
      report_.header.robot = text("robot");
      report_.header.started = text("started");
      start_ = rdf::lexical::parse_uint64(text("startedNanoseconds"));
    }
    constexpr std::size_t max_robots = 10'000;
    if (name == robot_metadata && report_.header.robots.size() < max_robots) report_.header.robots.push_back(text("iri"));
    return true;
  }

  bool wants(mcap::Nanoseconds first, mcap::Nanoseconds last) override {
    if (error || !begin(first)) return true;  // message() then ends the reading
    return since_start(last) >= range_.from && since_start(first) <= range_.until;
  }

  bool message(const mcap::Channel& channel, const mcap::Message& message) override {
    if (error || !begin(message.log_time)) return false;
    RecordedChange change;
    const std::optional<Document> document = channel.message_encoding == json_encoding ? client::detail::recorded_object(message.data) : std::nullopt;
    if (!document || !client::detail::read_members(*document, change)) return damaged("a message that is no JSON object with a value");
    const auto text = [&](const char* key) {
      const auto found = channel.metadata.find(key);
      return found == channel.metadata.end() ? std::string() : without_nul(found->second);
    };
    if (change.is_gap()) {
      const auto member = [&](const char* name) {
        const Document::Id id = document->member(document->root(), name);
        return id == Document::none || document->kind(id) != Document::Kind::string ? std::string() : std::string(document->text(id));
      };
      change.url = member("iri");
      change.name = member("name");
    } else {
      change.url = text("iri");
      change.name = text("name");
      change.robot = text("robot");
    }
    if (change.name.empty()) change.name = without_nul(channel.topic);
    if (change.name.empty()) return damaged("a channel without a name");
    change.at = since_start(message.log_time);
    if (change.at < range_.from || change.at > range_.until) return true;
    if (Result<void> taken = on_change_(std::move(change)); !taken) {
      error = taken.error();
      return false;
    }
    return true;
  }

  /// The header is complete: before the first message, or at the end of a file without one.
  bool begin(mcap::Nanoseconds first) {
    if (std::exchange(has_begun_, true)) return true;
    if (!start_) start_ = first;
    if (report_.header.robots.size() == 1) report_.header.robots.clear();
    Result<BagRange> range = range_of_(report_.header);
    if (!range) {
      error = range.error();
      return false;
    }
    range_ = *range;
    return true;
  }

  std::optional<Error> error;

 private:
  microseconds since_start(mcap::Nanoseconds time) const noexcept {
    return microseconds(time > *start_ ? static_cast<std::int64_t>((time - *start_) / 1000) : 0);
  }
  bool damaged(const char* problem) {
    ++report_.damaged;
    if (report_.problem.empty()) report_.problem = problem;
    return true;
  }
  BagReport& report_;
  const std::function<Result<BagRange>(const RecordingHeader&)>& range_of_;
  const std::function<Result<void>(RecordedChange&&)>& on_change_;
  BagRange range_;
  std::optional<mcap::Nanoseconds> start_;
  bool has_begun_ = false;
};

}  // namespace

std::string_view to_string(Format format) noexcept { return format == Format::mcap ? "MCAP" : "lines of JSON"; }

Result<std::unique_ptr<BagWriter>> begin_bag(const RecordingHeader& header, const BagWriterOptions& options, BagWriter::Sink sink) {
  if (options.format == Format::mcap) {
    auto writer = std::make_unique<McapWriter>(options, header.robot, std::move(sink));
    if (Result<void> begun = writer->begin(header); !begun) return unexpected(std::move(begun).error());
    return std::unique_ptr<BagWriter>(std::move(writer));
  }
  auto writer = std::make_unique<JsonLinesWriter>(header.robot, std::move(sink));
  if (Result<void> begun = writer->begin(header); !begun) return unexpected(std::move(begun).error());
  return std::unique_ptr<BagWriter>(std::move(writer));
}

Result<microseconds> parse_bound(std::string_view text, const RecordingHeader& header) {
  constexpr double longest = 1e12;
  const std::optional<double> seconds = rdf::lexical::parse_double(text);
  if (seconds && *seconds >= 0 && *seconds <= longest) return microseconds(std::llround(*seconds * 1e6));
  const std::optional<Utc> time = utc_of(text);
  if (!time)
    return unexpected(Errc::expected_value, "expected seconds since the beginning, or a time such as 2026-11-23T15:31:19Z, found " + quoted(text));
  const std::optional<Utc> started = utc_of(header.started);
  if (!started) return unexpected(Errc::expected_value, "the recording does not say when it began; expected seconds since the beginning");
  return std::max(std::chrono::duration_cast<microseconds>(*time - *started), microseconds(0));
}

Result<BagReport> read_bag(const std::function<Result<std::size_t>(char*, std::size_t)>& read,
                           const std::function<Result<BagRange>(const RecordingHeader&)>& range,
                           const std::function<Result<void>(RecordedChange&&)>& on_change, const BagLimits& limits) {
  BagReport report;
  // The first bytes tell the format; a reader gets them again.
  std::string first(mcap::magic.size(), '\0');
  std::size_t had = 0;
  while (had < first.size()) {
    const Result<std::size_t> count = read(first.data() + had, first.size() - had);
    if (!count) return unexpected(count.error());
    if (*count == 0) break;
    had += *count;
  }
  first.resize(had);
  std::size_t taken = 0;
  const auto from_beginning = [&](char* buffer, std::size_t size) -> Result<std::size_t> {
    if (taken == first.size()) return read(buffer, size);
    const std::size_t count = std::min(size, first.size() - taken);
    std::memcpy(buffer, first.data() + taken, count);
    taken += count;
    return count;
  };

  if (first == mcap::magic) {
    report.format = Format::mcap;
    McapEvents events(report, range, on_change);
    const std::function<Result<std::size_t>(char*, std::size_t)> source = from_beginning;
    Result<mcap::ReadReport> done = mcap::read_file(source, events);
    if (!done) return unexpected(std::move(done).error());
    if (!events.error) events.begin(0);
    if (events.error) return unexpected(*events.error);
    report.is_complete = done->is_complete;
    report.bytes = done->bytes;
    report.damaged += done->damaged;
    report.compression = done->compression;
    if (report.problem.empty()) report.problem = done->problem;
    return report;
  }

  std::optional<client::RecordingLines> lines;
  BagRange wanted;
  std::string buffer, piece(64 * 1024, '\0');
  bool is_too_long = false, is_first = true, has_end = false;
  const auto take_line = [&](std::string_view line) -> Result<void> {
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    constexpr std::string_view mark = "\xEF\xBB\xBF";
    if (std::exchange(is_first, false)) {
      if (line.substr(0, mark.size()) == mark) line.remove_prefix(mark.size());
      Result<client::RecordingLines> begun = client::RecordingLines::begin(line);
      if (!begun) return unexpected(std::move(begun).error());
      lines.emplace(*std::move(begun));
      report.header = lines->header();
      report.version = lines->version();
      Result<BagRange> of_header = range(report.header);
      if (!of_header) return unexpected(std::move(of_header).error());
      wanted = *of_header;
      return {};
    }
    if (line.empty()) return {};
    std::optional<RecordedChange> change = lines->read(line);
    if (!change) {
      ++report.damaged;
      if (report.problem.empty()) report.problem = has_end ? "the file ends within a line" : "a line that is no change";
      return {};
    }
    if (change->at < wanted.from || change->at > wanted.until) return {};
    return on_change(*std::move(change));
  };
  while (!has_end) {
    const Result<std::size_t> count = from_beginning(piece.data(), piece.size());
    if (!count) return unexpected(count.error());
    has_end = *count == 0;
    report.bytes += *count;
    std::string_view rest(piece.data(), *count);
    while (!rest.empty() || (has_end && (!buffer.empty() || is_too_long || is_first))) {
      const std::size_t end = rest.find('\n');
      const std::string_view part = rest.substr(0, end);
      if (!is_too_long && buffer.size() + part.size() > limits.max_line_bytes) {
        is_too_long = true;
        buffer.clear();
        if (is_first) return unexpected(Errc::expected_value, "not a recording: the first line is not a recording header");
      }
      if (!is_too_long) buffer += part;
      rest.remove_prefix(std::min(part.size() + 1, rest.size()));
      if (end == std::string_view::npos && !has_end) break;
      if (is_too_long) {
        ++report.damaged;
        if (report.problem.empty()) report.problem = "a line of more than " + std::to_string(limits.max_line_bytes) + " bytes";
      } else {
        const std::uint64_t damaged = report.damaged;
        if (Result<void> done = take_line(buffer); !done) return unexpected(std::move(done).error());
        if (has_end && report.damaged > damaged) report.is_complete = false;
      }
      buffer.clear();
      is_too_long = false;
    }
  }
  return report;
}

void Summary::add(const RecordedChange& change) {
  constexpr std::size_t max_properties = 100'000;
  const std::string& key = change.url.empty() ? change.name : change.url;
  auto known = index_.find(key);
  if (known == index_.end()) {
    if (properties_.size() >= max_properties) {
      is_full_ = true;
      return;
    }
    known = index_.emplace(key, properties_.size()).first;
    PropertySummary made;
    made.name = change.name;
    made.url = change.url;
    properties_.push_back(std::move(made));
  }
  PropertySummary& property = properties_[known->second];
  if (property.robot.empty()) property.robot = change.robot;
  if (change.is_gap()) {
    ++property.gaps;
    if (change.left_out) property.left_out += std::min<std::uint64_t>(*change.left_out, UINT64_MAX - property.left_out);
    else ++property.gaps_unknown;
    return;
  }
  ++property.values;
  if (!change.unit.empty()) property.unit = change.unit;
  if (!property.first || change.at < *property.first) property.first = change.at;
  if (!property.last || change.at > *property.last) property.last = change.at;
  if (!change.series.empty() && change.series != property.last_series) {
    ++property.series;
    property.last_series = change.series;
  }
  if (change.source_time) {
    if (!property.first_source || *change.source_time < *property.first_source) property.first_source = change.source_time;
    if (!property.last_source || *change.source_time > *property.last_source) property.last_source = change.source_time;
  }
}

bool fits(std::string_view name, std::string_view pattern) noexcept {
  // After a mismatch the last * takes one character more: linear for one *, the product of the lengths at worst.
  std::size_t n = 0, p = 0, star = std::string_view::npos, mark = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      mark = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++n, ++p;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++mark;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

bool Selection::selects(const RecordedChange& change) const noexcept {
  if (patterns.empty()) return true;
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    const auto is_part = [&](std::string_view name) {  // a Thing selects its properties
      return fits(name, pattern) ||
             (name.size() > pattern.size() && name.substr(0, pattern.size()) == pattern && (pattern.back() == '/' || name[pattern.size()] == '/'));
    };
    return !pattern.empty() && (is_part(change.name) || is_part(change.url));
  });
}

std::string Selection::name_of(const RecordedChange& change) const {
  for (const auto& [old_name, new_name] : renames) {
    for (const std::string* const name : {&change.name, &change.url}) {
      if (*name == old_name) return new_name;
      const bool is_below = name->size() > old_name.size() && name->compare(0, old_name.size(), old_name) == 0 &&
                            (old_name.empty() || old_name.back() == '/' || (*name)[old_name.size()] == '/');
      if (is_below && !old_name.empty()) return new_name + name->substr(old_name.size());
    }
  }
  return change.name;
}

Result<void> ReplayPlan::add(const RecordedChange& change) {
  if (!selection_.selects(change)) return {};
  if (change.is_gap()) {
    ++gaps_;
    return {};
  }
  std::string name = selection_.name_of(change);
  const auto [known, is_new] = by_name_.try_emplace(std::move(name), targets_.size());
  if (is_new) targets_.push_back({known->first, known->first != change.name, change.url, change.robot});
  const Target& target = targets_[known->second];
  if (target.url != change.url)
    return unexpected(Errc::expected_value, "\"" + target.url + "\" and \"" + change.url + "\" have the same name \"" + known->first +
                                                "\"; select one of them, or rename one");
  bytes_ += sizeof(Step) + sizeof(Time) + change.value.size() + change.unit.size();
  if (bytes_ > max_bytes_)
    return unexpected(Errc::limit_exceeded,
                      "the values take more than " + std::to_string(max_bytes_ / (1024 * 1024)) + " MiB; select fewer, or a shorter time");
  Time time;
  if (change.source_time) {
    time.source = std::chrono::duration_cast<microseconds>(change.source_time->time_since_epoch());
    const microseconds delay = change.at - *time.source;  // both are within 300,000 years
    const auto [shortest, is_first] = shortest_.try_emplace(change.robot, delay);
    if (!is_first) shortest->second = std::min(shortest->second, delay);
  } else {
    by_source_time_ = false;
  }
  times_.push_back(time);
  steps_.push_back({change.at, known->second, change.value, change.unit, change.at});
  return {};
}

void ReplayPlan::finish(bool by_arrival) {
  by_source_time_ = by_source_time_ && !by_arrival;
  if (by_source_time_)
    for (std::size_t i = 0; i < steps_.size(); ++i) steps_[i].due = *times_[i].source + shortest_[targets_[steps_[i].target].robot];
  times_ = {};
  std::stable_sort(steps_.begin(), steps_.end(), [](const Step& a, const Step& b) { return a.due < b.due; });
  if (steps_.empty()) return;
  const microseconds first = steps_.front().due;
  for (Step& step : steps_) step.due -= first;
}

}  // namespace lrt::recording
