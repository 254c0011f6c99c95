// SPDX-License-Identifier: Apache-2.0
#include "src/recording/bag.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/recording/mcap.hpp"
#include "src/recording/value_schema.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mover.hpp"

namespace lrt {
namespace {

using client::GapCause;
using client::RecordedChange;
using recording::BagRange;
using recording::BagReport;
using recording::BagWriterOptions;
using recording::Format;
using std::chrono::microseconds;
using Utc = std::chrono::system_clock::time_point;

const Utc started = Utc(std::chrono::seconds(1'800'000'000)) + microseconds(250);
const std::string left = "http://left:8080/", right = "http://right:8080/";

RecordedChange value(microseconds at, const std::string& robot, std::string json, std::uint64_t sequence, std::string series = "1.1") {
  RecordedChange change;
  change.at = at;
  change.name = "arm/angle";
  change.url = robot + "arm/angle";
  change.robot = robot;
  change.value = std::move(json);
  change.unit = "rad";
  change.sequence = sequence;
  change.series = std::move(series);
  change.source_time = started + at - microseconds(700);
  return change;
}

RecordedChange gap(microseconds at, const std::string& robot, GapCause cause, std::optional<std::uint64_t> left_out) {
  RecordedChange change;
  change.at = at;
  change.name = "arm/angle";
  change.url = robot + "arm/angle";
  change.robot = robot;
  change.gap = "a reason with \"quotes\"";
  change.cause = cause;
  change.left_out = left_out;
  change.from = {std::uint64_t{7}, started};
  change.to.sequence = 9'007'199'254'740'993;
  return change;
}

/// Two robots with a property of the same name each, a gap, and a robot that was started again.
std::vector<RecordedChange> sample() {
  return {value(microseconds(0), left, "0.25", 5),
          value(microseconds(10), right, "{\"x\":{\"value\":1,\"unit\":\"m\"},\"on\":[true,null]}", 1),
          value(microseconds(1'500'000), left, "0.5", 6),
          gap(microseconds(2'000'000), left, GapCause::left_out, 12),
          value(microseconds(2'000'000), left, "0.75", 19),
          gap(microseconds(3'000'000), left, GapCause::restart, std::nullopt),
          value(microseconds(3'000'000), left, "-1e-9", 1, "2.1")};
}

client::RecordingHeader header() { return {left, "2027-01-15T08:00:00.000250Z", {left, right}}; }

std::string written(const std::vector<RecordedChange>& changes, BagWriterOptions options, bool ends = true) {
  std::string bytes;
  options.started = started;
  auto writer = recording::begin_bag(header(), options, [&](std::string_view more) -> Result<void> {
                  bytes += more;
                  return {};
                }).value();
  for (const RecordedChange& change : changes) {
    REQUIRE(writer->add(change));
    REQUIRE(writer->flush_older(change.at));
  }
  if (ends) REQUIRE(writer->end());
  return bytes;
}

struct Read {
  std::optional<Error> error;
  BagReport report;
  std::vector<RecordedChange> changes;
};

/// In pieces of at most `piece` bytes.
Read read(std::string_view bytes, BagRange range = {}, std::size_t piece = 1000) {
  Read result;
  Result<BagReport> report = recording::read_bag(
      [&](char* buffer, std::size_t size) -> Result<std::size_t> {
        const std::size_t count = std::min({size, piece, bytes.size()});
        std::copy_n(bytes.data(), count, buffer);
        bytes.remove_prefix(count);
        return count;
      },
      [&](const client::RecordingHeader&) -> Result<BagRange> { return range; },
      [&](RecordedChange&& change) -> Result<void> {
        result.changes.push_back(std::move(change));
        return {};
      });
  if (report) result.report = *std::move(report);
  else result.error = std::move(report).error();
  return result;
}

void check_same(const RecordedChange& a, const RecordedChange& b, bool is_first_robot) {
  CHECK(a.at == b.at);
  CHECK(a.name == b.name);
  CHECK(a.url == b.url);
  CHECK((a.robot == b.robot || (is_first_robot && a.robot.empty())));
  CHECK(a.value == b.value);
  CHECK(a.unit == b.unit);
  CHECK(a.gap == b.gap);
  CHECK(a.cause == b.cause);
  CHECK(a.left_out == b.left_out);
  CHECK(a.sequence == b.sequence);
  CHECK(a.series == b.series);
  CHECK(a.source_time == b.source_time);
  CHECK(a.from.sequence == b.from.sequence);
  CHECK(a.from.source_time == b.from.source_time);
  CHECK(a.to.sequence == b.to.sequence);
}

std::vector<BagWriterOptions> all_options() {
  std::vector<BagWriterOptions> all(3);
  all[1].format = Format::mcap;
  all[2].format = Format::mcap;
  all[2].compress = false;
  return all;
}

}  // namespace

TEST_CASE("the schema of a value with alternatives has the members of all, whichever came first", "[recording]") {
  const std::string schema = recording::schema_of_alternatives(rdf::traits<test::Target>::type(), {});
  CHECK(schema == R"({"type":"object","description":"one of these members","properties":{"moveTo":{"type":"object","properties":{)"
                  R"("x":{"type":"object","properties":{"value":{"type":"number"},"unit":{"type":"string"}}},)"
                  R"("y":{"type":"object","properties":{"value":{"type":"number"},"unit":{"type":"string"}}},"speed":{"type":"number"}}},)"
                  R"("grip":{"type":"string"},"height":{"type":"object","properties":{"value":{"type":"number"},"unit":{"type":"string"}}},)"
                  R"("hold":{"type":"object","properties":{}}}})");
  CHECK(recording::schema_of_alternatives(rdf::traits<test::Job>::type(), {}).find("\"hold\"") != std::string::npos);
  CHECK(recording::schema_of_alternatives(rdf::traits<std::vector<test::Target>>::type(), {}).find("\"hold\"") != std::string::npos);
  CHECK(recording::schema_of_alternatives(rdf::traits<test::MoveTo>::type(), {}).empty());
  CHECK(recording::schema_of_alternatives(rdf::traits<double>::type(), {}).empty());

  for (const BagWriterOptions& options : all_options()) {
    std::string bytes;
    auto writer = recording::begin_bag(header(), options, [&](std::string_view more) -> Result<void> {
                    bytes += more;
                    return {};
                  }).value();
    writer->describe(left + "arm/angle", schema);
    REQUIRE(writer->add(value(microseconds(0), left, R"({"grip":"open"})", 1)));
    REQUIRE(writer->add(value(microseconds(1), left, R"({"hold":{}})", 2)));
    REQUIRE(writer->add(value(microseconds(2), right, R"({"grip":"open"})", 1)));
    REQUIRE(writer->end());
    CHECK(read(bytes).changes.size() == 3);
    if (options.format == Format::mcap && !options.compress) {
      CHECK(bytes.find("\"value\":" + schema) != std::string::npos);
      CHECK(bytes.find(R"("value":{"type":"object","properties":{"grip":{"type":"string"}}})") != std::string::npos);  // of the other one
    }
  }
}

TEST_CASE("a recording in each format reads back what was written: two robots, gaps, a robot that was started again", "[recording]") {
  for (const BagWriterOptions& options : all_options()) {
    CAPTURE(to_string(options.format), options.compress);
    const std::string bytes = written(sample(), options);
    for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{100'000}}) {
      const Read found = read(bytes, {}, piece);
      REQUIRE_FALSE(found.error);
      CHECK(found.report.format == options.format);
      CHECK(found.report.is_complete);
      CHECK(found.report.damaged == 0);
      CHECK(found.report.bytes == bytes.size());
      CHECK(found.report.header.robot == left);
      CHECK(found.report.header.robots == std::vector<std::string>{left, right});
      CHECK(found.report.header.started == header().started);
      const std::vector<RecordedChange> expected = sample();
      REQUIRE(found.changes.size() == expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i) check_same(found.changes[i], expected[i], expected[i].robot == left);
    }
  }
}

TEST_CASE("a range of time has the changes that arrived in it", "[recording]") {
  for (const BagWriterOptions& options : all_options()) {
    const std::string bytes = written(sample(), options);
    const auto count = [&](double from, double until) {
      return read(bytes, {microseconds(static_cast<std::int64_t>(from * 1e6)), microseconds(static_cast<std::int64_t>(until * 1e6))}).changes.size();
    };
    CHECK(count(0, 0) == 1);
    CHECK(count(1.5, 2) == 3);
    CHECK(count(2.5, 9) == 2);
    CHECK(count(4, 9) == 0);
  }
  CHECK(recording::parse_bound("1.5", header()).value() == microseconds(1'500'000));
  CHECK(recording::parse_bound("2027-01-15T08:00:02Z", header()).value() == microseconds(1'999'750));
  CHECK(recording::parse_bound("2026-01-15T08:00:02Z", header()).value() == microseconds(0));
  CHECK(recording::parse_bound("soon", header()).error().message.find("found \"soon\"") != std::string::npos);
  CHECK_FALSE(recording::parse_bound("-1", header()));
  CHECK_FALSE(recording::parse_bound("nan", header()));
}

TEST_CASE("chunks outside of a range are not decompressed", "[recording]") {
  BagWriterOptions options;
  options.format = Format::mcap;
  options.compress = false;
  std::string bytes = written(sample(), options);
  // Damage in the first chunk is seen only if it is read.
  const std::size_t at = bytes.find("\"value\":0.25");
  REQUIRE(at != std::string::npos);
  bytes[at + 9] = '7';
  CHECK(read(bytes).report.damaged == 1);
  const Read later = read(bytes, {microseconds(3'000'000), microseconds::max()});
  CHECK(later.report.damaged == 0);
  CHECK(later.changes.size() == 2);
}

TEST_CASE("a file that was cut anywhere is read up to its last line or chunk, and says so", "[recording]") {
  for (const BagWriterOptions& options : all_options()) {
    CAPTURE(to_string(options.format), options.compress);
    const std::string bytes = written(sample(), options, false);  // killed
    std::size_t before = 0;
    for (std::size_t size = 0; size <= bytes.size(); ++size) {
      const Read found = read(std::string_view(bytes).substr(0, size));
      if (found.error) continue;  // within the header
      CHECK(found.changes.size() >= before);
      before = found.changes.size();
      if (options.format == Format::mcap) CHECK_FALSE(found.report.is_complete);
    }
    // The last chunk was open for less than a second.
    CHECK(before == (options.format == Format::mcap ? 5U : 7U));
  }
}

TEST_CASE("damage leaves out a chunk or a line and is counted", "[recording]") {
  BagWriterOptions options;
  options.format = Format::mcap;
  options.compress = false;
  std::string bytes = written(sample(), options);
  const std::size_t at = bytes.find("0.5");
  bytes[at] = '7';
  const Read found = read(bytes);
  CHECK(found.report.damaged == 1);
  CHECK(found.report.problem == "a chunk with a wrong size or checksum");
  CHECK(found.report.is_complete);
  CHECK(found.changes.size() < sample().size());
  CHECK(found.changes.size() > 1);
  // A length that is a lie ends the reading, without memory for it.
  std::string lie(recording::mcap::magic);
  lie += "\x06" + std::string(7, '\xff') + '\x7f' + "x";
  CHECK(read(lie).report.problem.find("expected at most") != std::string::npos);
}

TEST_CASE("what is no recording is an error", "[recording]") {
  for (const std::string& bytes : {std::string(), std::string("{\"at\":1}\n"), std::string("\x89MCAP1\r\n"), std::string("\x89PNG"),
                                   std::string(5'000'000, 'x'), std::string("{\"lrt\":\"recording\",\"version\":3}\n")})
    CHECK(read(bytes).error);
  CHECK(read("{\"lrt\":\"recording\",\"version\":3}\n").error->message == "a recording of another version: expected 1 or 2");
}

TEST_CASE("a file of the former version is read", "[recording]") {
  const std::string text =
      "{\"lrt\":\"recording\",\"version\":1,\"robot\":\"http://robot/\",\"started\":\"2026-11-23T15:31:19Z\"}\n"
      "{\"at\":0.5,\"name\":\"arm/angle\",\"value\":0.27,\"unit\":\"rad\",\"sourceTime\":\"2026-11-23T15:31:19.010250Z\"}\r\n"
      "{\"at\":1.5,\"name\":\"arm/angle\",\"gap\":\"the connection was lost\"}\n";
  const Read found = read("\xEF\xBB\xBF" + text);
  REQUIRE(found.changes.size() == 2);
  CHECK(found.report.version == 1);
  CHECK(found.changes[0].source_time);
  CHECK(found.changes[1].is_gap());
  CHECK(found.changes[1].cause == GapCause::unknown);
  CHECK_FALSE(found.changes[1].left_out);
}

TEST_CASE("a sink that fails ends the writing with its error", "[recording]") {
  for (const BagWriterOptions& options : all_options()) {
    std::size_t room = 1'000;
    auto writer = recording::begin_bag(header(), options, [&](std::string_view more) -> Result<void> {
                    if (more.size() > room) return unexpected(Errc::failed, "no space");
                    room -= more.size();
                    return {};
                  }).value();
    std::optional<Error> error;
    for (int i = 0; i < 20 && !error; ++i) {
      Result<void> added = writer->add(value(std::chrono::seconds(2 * i), left, std::to_string(i), static_cast<std::uint64_t>(i)));
      if (!added) error = added.error();
    }
    REQUIRE(error);
    CHECK(error->message == "no space");
    if (options.format == Format::mcap) CHECK(writer->end().error().message == "no space");
  }
}

TEST_CASE("the index of a long recording is bounded", "[recording]") {
  recording::mcap::WriterOptions options;
  options.max_index_bytes = 2'000;
  options.max_chunk_time = 1;
  std::string bytes;
  recording::mcap::Writer writer(options, [&](std::string_view more) -> Result<void> {
    bytes += more;
    return {};
  });
  REQUIRE(writer.begin());
  const std::uint16_t channel = writer.add_channel(0, "a", "json", {}).value();
  for (std::uint64_t i = 0; i < 200; ++i) REQUIRE(writer.add({channel, 0, 2 * i, 2 * i, "{\"value\":1}"}));
  REQUIRE(writer.end());
  const Read found = read(bytes);
  CHECK(found.report.is_complete);
  CHECK(found.changes.size() == 200);  // by the name of its topic, as channels of others
  CHECK(found.changes.front().name == "a");
}

TEST_CASE("a summary counts values, gaps, what they miss, and how often a robot began", "[recording]") {
  recording::Summary summary;
  for (const RecordedChange& change : sample()) summary.add(change);
  REQUIRE(summary.properties().size() == 2);
  const recording::PropertySummary& one = summary.properties().front();
  CHECK(one.url == left + "arm/angle");
  CHECK(one.values == 4);
  CHECK(one.gaps == 2);
  CHECK(one.left_out == 12);
  CHECK(one.gaps_unknown == 1);
  CHECK(one.series == 2);
  CHECK(one.first == microseconds(0));
  CHECK(one.last == microseconds(3'000'000));
  CHECK(summary.properties().back().values == 1);
}

TEST_CASE("a plan has the order and the intervals of the robots' clocks", "[recording]") {
  // The network delayed the first value, and mixed up the others.
  std::vector<RecordedChange> changes;
  for (const auto& [at, source, json] : {std::tuple{900, 0, "0"}, std::tuple{901, 200, "2"}, std::tuple{902, 100, "1"}, std::tuple{903, 300, "3"}}) {
    RecordedChange change = value(microseconds(at * 1000), left, json, 1);
    change.source_time = started + microseconds(source * 1000);
    changes.push_back(change);
  }
  const auto plan_of = [&](bool by_arrival) {
    recording::ReplayPlan plan({}, 1'000'000);
    for (const RecordedChange& change : changes) REQUIRE(plan.add(change));
    plan.finish(by_arrival);
    std::string text;
    for (const auto& step : plan.steps()) text += step.value + "@" + std::to_string(step.due.count() / 1000) + " ";
    return text;
  };
  CHECK(plan_of(false) == "0@0 1@100 2@200 3@300 ");
  CHECK(plan_of(true) == "0@0 2@1 1@2 3@3 ");
  changes.back().source_time.reset();  // not all have one
  CHECK(plan_of(false) == "0@0 2@1 1@2 3@3 ");
}

TEST_CASE("a plan selects by name, IRI and Thing, and renames properties and Things", "[recording]") {
  recording::Selection selection;
  const RecordedChange one = value(microseconds(0), left, "1", 1), other = value(microseconds(0), right, "2", 1);
  CHECK(selection.selects(one));
  selection.patterns = {"http://right*"};
  CHECK_FALSE(selection.selects(one));
  CHECK(selection.selects(other));
  for (const char* const pattern : {"arm", "arm/angle", "*/angle", "arm/*", "http://left:8080/arm", "*"}) {
    selection.patterns = {pattern};
    CHECK(selection.selects(one));
  }
  for (const char* const pattern : {"ar", "angle", "arm/angle/x", ""}) {
    selection.patterns = {pattern};
    CHECK_FALSE(selection.selects(one));
  }
  CHECK(selection.name_of(one) == "arm/angle");
  selection.renames = {{"http://right:8080/arm", "right_arm"}, {"arm/angle", "left_arm/angle"}};
  CHECK(selection.name_of(one) == "left_arm/angle");
  CHECK(selection.name_of(other) == "right_arm/angle");
  selection.patterns.clear();
  recording::ReplayPlan renamed(selection, 1'000'000);
  CHECK(renamed.add(one));
  CHECK(renamed.add(other));
  CHECK(renamed.targets().size() == 2);
  recording::ReplayPlan mixed({}, 1'000'000);
  CHECK(mixed.add(one));
  CHECK(mixed.add(other).error().message.find("have the same name \"arm/angle\"") != std::string::npos);
  recording::ReplayPlan large({}, 150);
  CHECK(large.add(one));
  CHECK(large.add(one).error().code == Errc::limit_exceeded);
}

TEST_CASE("a pattern may have several stars", "[recording]") {
  CHECK(recording::fits("", ""));
  CHECK(recording::fits("", "*"));
  CHECK(recording::fits("abcabc", "a*c"));
  CHECK(recording::fits("abcabd", "*b*d"));
  CHECK_FALSE(recording::fits("abc", "*b"));
  CHECK_FALSE(recording::fits(std::string(2'000, 'a'), "*a*a*a*a*b"));
}

TEST_CASE("a checksum is that of zlib", "[recording]") {
  CHECK(recording::mcap::crc32(0, "") == 0);
  CHECK(recording::mcap::crc32(0, "123456789") == 0xCBF43926U);
  CHECK(recording::mcap::crc32(recording::mcap::crc32(0, "12345"), "6789") == 0xCBF43926U);
}

}  // namespace lrt
