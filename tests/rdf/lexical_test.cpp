// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/lexical.hpp>

#include <cmath>
#include <limits>
#include <string>

#include "tests/support/catch.hpp"

using namespace lrt::rdf::lexical;
using std::chrono::nanoseconds;

TEST_CASE("a lexical form of a number is recognised without surrounding white space", "[rdf]") {
  for (const char* text : {"0", "-0", "+17", "000123", "123456789012345678901234567890"}) {
    CHECK(is_integer(text));
    CHECK(is_decimal(text));
    CHECK(is_double(text));
  }
  for (const char* text : {"1.", ".5", "-0.50"}) {
    CHECK_FALSE(is_integer(text));
    CHECK(is_decimal(text));
    CHECK(is_double(text));
  }
  for (const char* text : {"1e6", "-1.5E-3", "INF", "-INF", "NaN"}) {
    CHECK_FALSE(is_decimal(text));
    CHECK(is_double(text));
  }
  for (const char* text : {"", "+", ".", " 1", "1 ", "1,5", "0x10", "1e", "inf", "nan", "--1"}) {
    CAPTURE(text);
    CHECK_FALSE(is_integer(text));
    CHECK_FALSE(is_decimal(text));
    CHECK_FALSE(is_double(text));
  }
}

TEST_CASE("integers are parsed within 64 bits only", "[rdf]") {
  CHECK(parse_int64("-9223372036854775808") == std::numeric_limits<std::int64_t>::min());
  CHECK(parse_int64("+9223372036854775807") == std::numeric_limits<std::int64_t>::max());
  CHECK(parse_int64("-0") == 0);
  CHECK(parse_uint64("18446744073709551615") == std::numeric_limits<std::uint64_t>::max());
  for (const char* text : {"", "+", "1.0", " 1", "9223372036854775808", "-9223372036854775809"}) CHECK_FALSE(parse_int64(text));
  for (const char* text : {"", "-1", "1e3", "18446744073709551616"}) CHECK_FALSE(parse_uint64(text));
}

TEST_CASE("floating-point numbers are parsed as XSD says, and formatted so that they read back", "[rdf]") {
  CHECK(parse_double("43.6") == 43.6);
  CHECK(parse_double("1e999") == std::numeric_limits<double>::infinity());
  CHECK(parse_double("-INF") == -std::numeric_limits<double>::infinity());
  CHECK(std::isnan(parse_double("NaN").value()));
  CHECK_FALSE(parse_double("infinity"));
  CHECK(parse_float("16777217") == 16777216.0F);
  CHECK(format(43.6) == "43.6");
  CHECK(format(0.1F) == "0.1");
  CHECK(format(-std::numeric_limits<double>::infinity()) == "-INF");
  for (const double value : {1e6, 0.1, -1.0 / 3, 5e-324}) CHECK(parse_double(format(value)) == value);
}

TEST_CASE("a boolean has four lexical forms", "[rdf]") {
  CHECK(parse_boolean("true") == true);
  CHECK(parse_boolean("1") == true);
  CHECK(parse_boolean("false") == false);
  CHECK(parse_boolean("0") == false);
  for (const char* text : {"", "TRUE", "yes", "01"}) CHECK_FALSE(parse_boolean(text));
}

TEST_CASE("durations without years and months are nanoseconds", "[rdf]") {
  CHECK(parse_duration("PT1.5S") == nanoseconds(1'500'000'000));
  CHECK(parse_duration("-P1DT2H3M4S") == -nanoseconds(93'784'000'000'000));
  CHECK(parse_duration("PT0.1234567899S") == nanoseconds(123'456'789));
  for (const char* text : {"", "P", "PT", "P1Y", "P1M", "1S", "PT1S1M", "PT1", "PT1.S", "P300000Y", "P106752D"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_duration(text));
  }
  for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{93'784'000'000'001}, std::numeric_limits<std::int64_t>::min()})
    CHECK(parse_duration(format(nanoseconds(ns))) == nanoseconds(ns));
}

TEST_CASE("an instant has a time zone and is within 64 bits of nanoseconds", "[rdf]") {
  CHECK(parse_instant("1970-01-01T00:00:01.5Z") == nanoseconds(1'500'000'000));
  CHECK(parse_instant("1970-01-01T01:00:00+01:00") == nanoseconds(0));
  CHECK(parse_instant("2024-02-29T24:00:00Z") == parse_instant("2024-03-01T00:00:00Z"));
  for (const char* text : {"", "1970-01-01T00:00:00", "2023-02-29T00:00:00Z", "1970-13-01T00:00:00Z", "1970-01-01T24:00:01Z", "3000-01-01T00:00:00Z",
                           "1970-01-01T00:00:00+15:00", "70-01-01T00:00:00Z"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_instant(text));
  }
  CHECK(format_instant(nanoseconds(1'500'000'000)) == "1970-01-01T00:00:01.5Z");
  CHECK(format_instant(nanoseconds(-1)) == "1969-12-31T23:59:59.999999999Z");
  CHECK(parse_instant(format_instant(nanoseconds(-1))) == nanoseconds(-1));
}

TEST_CASE("the datatypes of integers are told from others", "[rdf]") {
  CHECK(is_integer_type(datatype_of("http://www.w3.org/2001/XMLSchema#integer")));
  CHECK(is_integer_type(datatype_of("http://www.w3.org/2001/XMLSchema#unsignedByte")));
  CHECK(is_integer_type(datatype_of("http://www.w3.org/2001/XMLSchema#negativeInteger")));
  CHECK_FALSE(is_integer_type(datatype_of("http://www.w3.org/2001/XMLSchema#decimal")));
  CHECK_FALSE(is_integer_type(datatype_of("http://www.w3.org/2001/XMLSchema#dateTime")));
  CHECK(datatype_of("http://example.org/integer") == Datatype::unknown);
  CHECK_FALSE(is_well_formed("256", Datatype::unsigned_byte));
  CHECK(is_well_formed("256", Datatype::unknown));
}

TEST_CASE("decimals of any length are compared exactly", "[rdf]") {
  CHECK(compare_decimal("0.1", "0.10") == 0);
  CHECK(compare_decimal("-0", "+0.0") == 0);
  CHECK(compare_decimal("123456789012345678901234567890.1", "123456789012345678901234567890.2") < 0);
  CHECK(compare_decimal("-2", "-10") > 0);
}

TEST_CASE("moments of the calendar are seconds and a fraction, with or without a zone", "[rdf]") {
  const auto noon = parse_moment("1970-01-02T12:00:00.250-01:00", Datatype::date_time);
  REQUIRE(noon);
  CHECK(noon->seconds == 86'400 + 13 * 3600);
  CHECK(noon->fraction == "25");
  CHECK(noon->zoned);
  const auto day = parse_moment("1970-01-02", Datatype::date);
  REQUIRE(day);
  CHECK(day->seconds == 86'400);
  CHECK_FALSE(day->zoned);
  CHECK_FALSE(parse_moment("1970-01-02", Datatype::date_time));
  CHECK_FALSE(parse_moment("--02", Datatype::g_month));
  CHECK_FALSE(parse_moment("1234567890-01-01", Datatype::date));
}

TEST_CASE("24:00:00 is the beginning of the next day, and of any day for a time", "[rdf]") {
  const auto same = [](const char* a, const char* b, Datatype datatype) {
    const auto x = parse_moment(a, datatype), y = parse_moment(b, datatype);
    INFO(a << " " << b);
    return x && y && x->seconds == y->seconds && x->fraction == y->fraction && x->zoned == y->zoned;
  };
  CHECK(same("1999-12-31T24:00:00", "2000-01-01T00:00:00", Datatype::date_time));
  CHECK(same("2024-02-28T24:00:00Z", "2024-02-29T00:00:00Z", Datatype::date_time));
  CHECK(same("2023-02-28T24:00:00.000Z", "2023-03-01T00:00:00Z", Datatype::date_time));
  CHECK(same("-0001-12-31T24:00:00+14:00", "0000-01-01T00:00:00+14:00", Datatype::date_time_stamp));
  CHECK(same("0000-02-29T24:00:00", "0000-03-01T00:00:00", Datatype::date_time));
  CHECK(same("24:00:00", "00:00:00", Datatype::time));
  CHECK(same("24:00:00.0-14:00", "00:00:00-14:00", Datatype::time));
  CHECK(parse_instant("1999-12-31T24:00:00Z") == parse_instant("2000-01-01T00:00:00Z"));
  CHECK(parse_instant("2000-02-28T24:00:00+14:00") == parse_instant("2000-02-28T10:00:00Z"));
  for (const char* text : {"24:00:01", "24:01:00", "24:00:00.1", "25:00:00"}) CHECK_FALSE(parse_moment(text, Datatype::time));
}

TEST_CASE("a full duration has months and seconds of the same sign", "[rdf]") {
  const auto d = parse_full_duration("-P1Y2M3DT4.50S", Datatype::duration);
  REQUIRE(d);
  CHECK(d->months == -14);
  CHECK(d->seconds == -(3 * 86'400 + 4));
  CHECK(d->fraction == "5");
  CHECK(d->negative);
  CHECK_FALSE(parse_full_duration("P1Y", Datatype::day_time_duration));
  CHECK_FALSE(parse_full_duration("P1D", Datatype::year_month_duration));
  CHECK_FALSE(parse_full_duration("P9223372036854775807Y", Datatype::duration));
}
