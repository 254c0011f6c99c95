// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/whole_number.hpp"

#include <string>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;
using lexical::Datatype;

TEST_CASE("a number without a fraction is an integer, however it is written", "[rdf]") {
  const auto digits = [](const std::string& text) { return whole_number(text).value_or("none"); };
  for (const char* five : {"5", "+5", "5.", "5.0", "005.000", "5e0", "5E+0", "50e-1", "0.5e1", "0.0005e4", ".5e1", "500.00e-2", "5e-0"}) {
    CAPTURE(five);
    CHECK(digits(five) == "5");
  }
  CHECK(digits("-5.0") == "-5");
  CHECK(digits("120.50e2") == "12050");
  CHECK(digits("1.2e3") == "1200");
  for (const char* zero : {"0", "-0", "-0.0", "0e999999999999999999999", "0.000e-5", "+.0"}) CHECK(digits(zero) == "0");
  CHECK(digits("18446744073709551615.0") == "18446744073709551615");
  CHECK(digits("1.8446744073709551615e19") == "18446744073709551615");
  CHECK(digits("9007199254740993.0") == "9007199254740993");  // 2^53 + 1 is no double
  for (const char* other : {"5.5",
                            "5e-1",
                            "0.1",
                            "49e-1",
                            "1e-400",
                            "5.0000000000000000000000000001",
                            "NaN",
                            "INF",
                            "-INF",
                            "",
                            ".",
                            "e5",
                            "five",
                            "5.0.0",
                            "1e20",
                            "1e400",
                            "1e999999999",
                            "1e99999999999999999999999",
                            "5e-99999999999999999999999",
                            "0x5",
                            " 5"}) {
    CAPTURE(other);
    CHECK(digits(other) == "none");
  }
  const std::string zeros(100'000, '0');
  CHECK(digits("0." + zeros + "5e100001") == "5");
  CHECK(digits("5" + zeros + "e-100000") == "5");
  CHECK(digits("5" + zeros) == "none");
}

TEST_CASE("xsd:double and xsd:float have the value of their datatype", "[rdf]") {
  CHECK(whole_number("9007199254740993", Datatype::double_) == "9007199254740992");
  CHECK(whole_number("9.223372036854776e18", Datatype::double_) == "9223372036854775808");  // 2^63
  CHECK(whole_number("16777217", Datatype::float_) == "16777216");
  CHECK(whole_number("-0.0", Datatype::double_) == "0");
  CHECK(whole_number("-5e0", Datatype::float_) == "-5");
  for (const char* other : {"0.5", "NaN", "INF", "-INF", "1e999", "1e20", "-1e20", "1e-400", "4.9999999999999999999999999"}) {
    CHECK_FALSE(whole_number(other, Datatype::double_));
    CHECK_FALSE(whole_number(other, Datatype::float_));
  }
}
