// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/recording.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;
using client::Playback;
using client::RecordedChange;
using client::Recording;
using std::chrono::microseconds;

namespace {

const std::string header = "{\"lrt\":\"recording\",\"version\":2,\"robot\":\"http://robot/\",\"started\":\"2026-11-23T15:31:19Z\"}\n";

std::vector<std::string> names(const Recording& recording) {
  std::vector<std::string> result;
  for (const RecordedChange& change : recording.changes()) result.push_back(change.name);
  return result;
}

}  // namespace

TEST_CASE("a recording reads back what was written", "[client]") {
  const std::vector<RecordedChange> changes = {
      {microseconds(12'300), "arm/angle", "0.27", "rad", {}, std::chrono::system_clock::time_point(microseconds(1'795'881'552'418'635))},
      {microseconds(2'000'001), "arm/\"pose\"\n", R"({"x":{"value":1.5,"unit":"m"},"name":"a\"b","on":[true,null]})", {}, {}},
      {microseconds(3'000'000), "arm/angle", {}, {}, "the connection was lost"}};
  std::string text = to_line(client::RecordingHeader{"http://robot/", "2026-11-23T15:31:19Z"});
  CHECK(text == header);
  for (const RecordedChange& change : changes) text += to_line(change);
  const Recording read = Recording::parse(text).value();
  CHECK(read.header().robot == "http://robot/");
  CHECK(read.damaged_lines() == 0);
  CHECK(text.find("\"unit\":\"rad\",\"sourceTime\":\"2026-11-28T15:59:12.418635Z\"}\n") != std::string::npos);
  REQUIRE(read.changes().size() == changes.size());
  for (std::size_t i = 0; i < changes.size(); ++i) {
    CHECK(read.changes()[i].at == changes[i].at);
    CHECK(read.changes()[i].name == changes[i].name);
    CHECK(read.changes()[i].value == changes[i].value);
    CHECK(read.changes()[i].unit == changes[i].unit);
    CHECK(read.changes()[i].gap == changes[i].gap);
    CHECK(read.changes()[i].source_time == changes[i].source_time);
  }
}

TEST_CASE("damaged lines of a recording are left out and counted", "[client]") {
  const std::string good = "{\"at\":1,\"name\":\"a\",\"value\":1}\n";
  for (const char* const bad :
       {"{\"at\":1,\"na", "null", "{\"at\":-1,\"name\":\"b\",\"value\":1}", "{\"at\":1e300,\"name\":\"b\",\"value\":1}",
        "{\"at\":\"1\",\"name\":\"b\",\"value\":1}", "{\"at\":1,\"name\":\"b\"}", "{\"at\":1,\"value\":1}", "\xff\xfe", "[[[["}) {
    const Recording read = Recording::parse(header + good + bad + "\n" + good + bad).value();
    CAPTURE(bad);
    CHECK(names(read) == std::vector<std::string>{"a", "a"});
    CHECK(read.damaged_lines() == 2);
  }
  client::RecordingLimits limits;
  limits.max_line_bytes = 120;
  CHECK(Recording::parse(header + "{\"at\":1,\"name\":\"" + std::string(200, 'n') + "\",\"value\":1}\n" + good, limits).value().damaged_lines() == 1);
}

TEST_CASE("what is no recording is an error", "[client]") {
  CHECK(Recording::parse("").error().code == Errc::expected_value);
  CHECK(Recording::parse("{\"at\":1,\"name\":\"a\",\"value\":1}\n").error().code == Errc::expected_value);
  CHECK(Recording::parse("{\"lrt\":\"recording\",\"version\":3}\n").error().message == "a recording of another version: expected 1 or 2");
  client::RecordingLimits limits;
  limits.max_changes = 1;
  CHECK(Recording::parse(header + "{\"at\":1,\"name\":\"a\",\"value\":1}\n{\"at\":1,\"name\":\"a\",\"value\":1}\n", limits).error().code ==
        Errc::limit_exceeded);
  limits.max_bytes = 10;
  CHECK(Recording::parse(header, limits).error().code == Errc::limit_exceeded);
}

TEST_CASE("a playback gives changes in the order of their times when they are due", "[client]") {
  const Recording recording =
      Recording::parse(
          header + "{\"at\":2,\"name\":\"late\",\"value\":1}\n{\"at\":1,\"name\":\"early\",\"value\":1}\n{\"at\":2,\"name\":\"later\",\"value\":1}\n")
          .value();
  Playback playback(recording, 2);
  CHECK(playback.next(microseconds(499'999)) == nullptr);
  CHECK(playback.until_next(microseconds(0)) == microseconds(500'000));
  CHECK(playback.next(microseconds(500'000))->name == "early");
  CHECK(playback.next(microseconds(500'000)) == nullptr);
  CHECK(playback.until_next(microseconds(600'000)) == microseconds(400'000));
  CHECK(playback.next(microseconds(5'000'000))->name == "late");
  CHECK(playback.until_next(microseconds(5'000'000)) == microseconds(0));
  CHECK(playback.next(microseconds(5'000'000))->name == "later");
  CHECK(playback.has_ended());
  CHECK(playback.next(microseconds::max()) == nullptr);
}

TEST_CASE("a recorded value is read as a C++ value", "[client]") {
  RecordedChange change{microseconds(0), "arm/angle", "0.27", "rad", {}};
  CHECK(client::value_of<double>(change).value() == 0.27);
  CHECK(client::value_of<double>(change, unit::radian).value() == 0.27);
  CHECK(client::value_of<double>(change, unit::degree).error().message == "expected the unit deg, found rad");
  CHECK_FALSE(client::value_of<bool>(change));
  change.value = "[1,2.5]";
  CHECK(client::value_of<std::vector<double>>(change).value() == std::vector<double>{1, 2.5});
  change.value = "\"fast\"";
  CHECK(client::value_of<std::string>(change).value() == "fast");
  change.value.clear();
  CHECK(client::value_of<double>(change).error().code == Errc::expected_value);
}

TEST_CASE("a change without a value is a gap, whether its reason is known or not", "[client]") {
  RecordedChange change{microseconds(1), "arm/angle", {}, {}, {}};
  CHECK(change.is_gap());
  change.gap = "the connection was lost";
  CHECK(change.is_gap());
  change.value = "null";  // also "nothing" is a value
  CHECK_FALSE(change.is_gap());
  const Recording read = Recording::parse(header +
                                          "{\"at\":1,\"name\":\"a\",\"value\":\"\"}\n{\"at\":2,\"name\":\"a\",\"gap\":\"\"}\n"
                                          "{\"at\":3,\"name\":\"a\",\"gap\":\"late\"}\n")
                             .value();
  std::vector<bool> gaps;
  for (const RecordedChange& c : read.changes()) gaps.push_back(c.is_gap());
  CHECK(gaps == std::vector<bool>{false, true, true});
}

TEST_CASE("a line has the IRI, the robot, the number and the series of a value, and the bounds of a gap", "[client]") {
  const client::RecordingHeader two{"http://left/", "2026-11-23T15:31:19Z", {"http://left/", "http://right/"}};
  RecordedChange value{microseconds(0), "arm/angle", "0.27", "rad", {}};
  value.url = "http://right/arm/angle";
  value.robot = "http://right/";
  value.sequence = 9'007'199'254'740'993;  // more than a double holds
  value.series = "1.5";
  RecordedChange gap{microseconds(1), "arm/angle", {}, {}, "it was lost"};
  gap.url = value.url;
  gap.cause = client::GapCause::left_out;
  gap.left_out = 12;
  gap.from = {value.sequence, std::chrono::system_clock::time_point(std::chrono::seconds(1'800'000'000))};
  const std::string text = to_line(two) + to_line(value) + to_line(gap);
  CHECK(text ==
        "{\"lrt\":\"recording\",\"version\":2,\"robot\":\"http://left/\",\"robots\":[\"http://left/\",\"http://right/"
        "\"],\"started\":\"2026-11-23T15:31:19Z\"}\n"
        "{\"at\":0.000000,\"name\":\"arm/angle\",\"url\":\"http://right/arm/angle\",\"robot\":\"http://right/\",\"value\":0.27,\"unit\":\"rad\","
        "\"sequence\":9007199254740993,\"series\":\"1.5\"}\n"
        "{\"at\":0.000001,\"name\":\"arm/angle\",\"url\":\"http://right/arm/angle\",\"gap\":\"it was lost\",\"cause\":\"left out\",\"leftOut\":12,"
        "\"from\":{\"sequence\":9007199254740993,\"time\":\"2027-01-15T08:00:00.000000Z\"}}\n");
  const Recording read =
      Recording::parse(text + "{\"at\":2,\"name\":\"arm/angle\",\"url\":\"http://right/arm/angle\",\"value\":1,\"sequence\":8}\n").value();
  CHECK(read.header().robots == two.robots);
  REQUIRE(read.changes().size() == 3);
  CHECK(read.changes()[0].robot == value.robot);
  CHECK(read.changes()[0].sequence == value.sequence);
  CHECK(read.changes()[1].cause == gap.cause);
  CHECK(read.changes()[1].left_out == 12);
  CHECK(read.changes()[1].from.sequence == gap.from.sequence);
  CHECK(read.changes()[1].from.source_time == gap.from.source_time);
  CHECK_FALSE(read.changes()[1].to.sequence);
  CHECK(read.changes()[2].series == "1.5");  // that of the value before
}

TEST_CASE("causes of gaps have names, and others are unknown", "[client]") {
  using client::GapCause;
  for (const GapCause cause : {GapCause::connection, GapCause::restart, GapCause::left_out, GapCause::not_taken, GapCause::polled, GapCause::ended})
    CHECK(client::gap_cause_of(to_string(cause)) == cause);
  CHECK(client::gap_cause_of("") == GapCause::unknown);
  CHECK(client::gap_cause_of("a comet") == GapCause::unknown);
  CHECK(to_string(GapCause::unknown) == "unknown");
}
