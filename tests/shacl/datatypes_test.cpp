// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/lexical.hpp>

#include <limits>
#include <string>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"

using lrt::rdf::lexical::Datatype;
using lrt::rdf::lexical::datatype_of;
using lrt::rdf::lexical::is_well_formed;

namespace {

struct Case {
  const char* name;
  std::vector<const char*> good, bad;
};

const std::vector<Case> cases = {
    {"string", {"", " a\n", "ü"}, {}},
    {"boolean", {"true", "false", "1", "0"}, {"", "TRUE", " true", "2", "yes"}},
    {"decimal", {"0", "+1.5", "-.5", "5.", "007"}, {"", ".", "1e3", "1,5", "INF", " 1", "+-1"}},
    {"integer", {"0", "-0", "+12345678901234567890123"}, {"", "1.0", "0x1", "- 1", "1 "}},
    {"double", {"1", "1.5E-3", "INF", "-INF", "+INF", "NaN", "1e400"}, {"", "inf", "nan", "1e", "1e1.5", "fast", "0x1p3", "Infinity"}},
    {"float", {"1", "-1.5e3", "NaN"}, {"", "1f", "--1"}},
    {"long", {"9223372036854775807", "-9223372036854775808", "+5"}, {"9223372036854775808", "-9223372036854775809", "1.0"}},
    {"int", {"2147483647", "-2147483648", "0000000000000001"}, {"2147483648", "-2147483649"}},
    {"short", {"32767", "-32768"}, {"32768", "-32769"}},
    {"byte", {"127", "-128", "+0"}, {"128", "-129", "c"}},
    {"unsignedLong", {"18446744073709551615", "-0", "0"}, {"18446744073709551616", "-1"}},
    {"unsignedInt", {"4294967295"}, {"4294967296", "-1"}},
    {"unsignedShort", {"65535"}, {"65536"}},
    {"unsignedByte", {"255"}, {"256", "-1"}},
    {"nonNegativeInteger", {"0", "-0", "99999999999999999999999"}, {"-1"}},
    {"positiveInteger", {"1", "+1"}, {"0", "-1"}},
    {"nonPositiveInteger", {"0", "-1"}, {"1"}},
    {"negativeInteger", {"-1", "-99999999999999999999999"}, {"0", "-0", "1"}},
    {"dateTime",
     {"2024-02-29T00:00:00", "2000-02-29T23:59:59.999999999999Z", "-0001-01-01T00:00:00+14:00", "0000-02-29T00:00:00", "12024-01-01T24:00:00.0",
      "2024-01-01T00:00:00-13:59"},
     {"2023-02-29T00:00:00", "1900-02-29T00:00:00", "2024-13-01T00:00:00", "2024-04-31T00:00:00", "2024-01-01T24:00:01", "2024-01-01T00:60:00",
      "2024-01-01T00:00:60", "2024-01-01T00:00:00.", "2024-01-01T00:00:00+14:01", "2024-01-01T00:00:00z", "2024-01-01 00:00:00", "24-01-01T00:00:00",
      "02024-01-01T00:00:00", "2024-1-1T00:00:00", "2024-01-01", "+2024-01-01T00:00:00", ""}},
    {"dateTimeStamp", {"2024-01-01T00:00:00Z"}, {"2024-01-01T00:00:00"}},
    {"date", {"2024-02-29", "2024-01-01Z", "2024-01-01-05:00"}, {"2023-02-29", "2024-00-01", "2024-01-00", "2024-01-01T00:00:00", "2024-01-01+"}},
    {"time", {"00:00:00", "24:00:00", "13:20:30.5555Z"}, {"24:00:00.1", "25:00:00", "1:00:00", "00:00"}},
    {"gYear", {"2024", "-0044", "12024Z"}, {"24", "2024-", "02024"}},
    {"gYearMonth", {"2024-12", "2024-01+01:00"}, {"2024-13", "2024"}},
    {"gMonth", {"--12", "--01Z"}, {"--13", "--00", "12", "--1"}},
    {"gMonthDay", {"--02-29", "--12-31Z"}, {"--02-30", "--04-31", "-12-31"}},
    {"gDay", {"---31", "---01Z"}, {"---32", "---00", "--31"}},
    {"duration",
     {"P1Y2M3DT4H5M6.7S", "-P1M", "PT0S", "P0D"},
     {"", "P", "PT", "P1S", "P1D1Y", "PT1M1H", "P-1D", "P1.5D", "PT1.S", "1D", "P1DT", "P1H", "P1Y1Y"}},
    {"dayTimeDuration", {"P1DT1H", "-PT1.5S"}, {"P1Y", "P1M", "P"}},
    {"yearMonthDuration", {"P1Y2M", "-P3M"}, {"P1D", "PT1S", "P1Y1D"}},
    {"hexBinary", {"", "0aFF"}, {"0", "0g", "0a F"}},
    {"base64Binary", {"", "TWFu", "TWE=", "TQ==", "TW Fu TQ = ="}, {"T", "TW=", "TR==", "TWF=", "TWFu=", " TWFu", "TW  Fu", "T===", "TWE=TWFu"}},
    {"anyURI", {"http://example.org/a b", ""}, {}},
    {"language", {"en", "de-CH-1996"}, {"", "e1", "abcdefghi", "en-", "en_GB"}},
    {"normalizedString", {"a  b"}, {"a\tb", "a\n"}},
    {"token", {"a b", ""}, {" a", "a ", "a  b", "a\tb"}},
    {"NMTOKEN", {"1a-b:c"}, {"", "a b", "a/b"}},
    {"Name", {"_a1", "a:b", "ä"}, {"1a", "-a", ""}},
    {"NCName", {"a.b-c"}, {"a:b", "1", "a b"}},
};

}  // namespace

TEST_CASE("literals are well-formed exactly within the lexical space of their datatype", "[rdf][shacl]") {
  for (const Case& test : cases) {
    INFO(test.name);
    const std::string iri = std::string("http://www.w3.org/2001/XMLSchema#") + test.name;
    const Datatype datatype = datatype_of(iri);
    REQUIRE(datatype != Datatype::unknown);
    for (const char* text : test.good) {
      INFO(text);
      CHECK(is_well_formed(text, datatype));
    }
    for (const char* text : test.bad) {
      INFO(text);
      CHECK_FALSE(is_well_formed(text, datatype));
    }
  }
  CHECK(cases.size() == 39);
  CHECK(datatype_of("http://example.org/x") == Datatype::unknown);
  CHECK(datatype_of("http://www.w3.org/2001/XMLSchema#unknown") == Datatype::unknown);
  CHECK(is_well_formed("anything", Datatype::unknown));
  const std::string nul("a\0b", 3);
  for (const char* name : {"string", "normalizedString", "token"}) {
    CHECK_FALSE(is_well_formed(nul, datatype_of(std::string("http://www.w3.org/2001/XMLSchema#") + name)));
  }
  CHECK(is_well_formed(nul, Datatype::unknown));
  CHECK(datatype_of(lrt::vocab::rdf_::langString.text) == Datatype::lang_string);
}

TEST_CASE("decimals of any length compare exactly", "[rdf][shacl]") {
  using lrt::rdf::lexical::compare_decimal;
  const std::vector<const char*> ascending = {"-100000000000000000000",
                                              "-99999999999999999999.5",
                                              "-1.5",
                                              "-1.25",
                                              "-0.1",
                                              "0",
                                              "0.0000000000000000000000001",
                                              "0.1",
                                              "0.12",
                                              "0.2",
                                              "1",
                                              "9",
                                              "10",
                                              "9007199254740992",
                                              "9007199254740993"};
  for (std::size_t i = 0; i < ascending.size(); ++i)
    for (std::size_t k = 0; k < ascending.size(); ++k) {
      INFO(ascending[i] << " " << ascending[k]);
      const int order = compare_decimal(ascending[i], ascending[k]);
      CHECK((order < 0) == (i < k));
      CHECK((order > 0) == (i > k));
    }
  CHECK(compare_decimal("-0.0", "+0") == 0);
  CHECK(compare_decimal("007.500", "7.5") == 0);
  CHECK(compare_decimal(".5", "0.5") == 0);
  CHECK(compare_decimal("5.", "5") == 0);
}

TEST_CASE("a float is rounded once", "[rdf][shacl]") {
  using lrt::rdf::lexical::parse_float;
  CHECK(parse_float("43.6") == 43.6f);
  CHECK(parse_float("+1.00000017881393432617187499") == 1.00000011920928955078125f);  // rounded through double it would be the next float
  CHECK(parse_float("1e39") == std::numeric_limits<float>::infinity());
  CHECK(parse_float("-1e-60") == 0.0f);
  CHECK_FALSE(parse_float("fast"));
}
