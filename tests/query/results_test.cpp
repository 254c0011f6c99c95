// SPDX-License-Identifier: Apache-2.0
#include <lrt/query/answer.hpp>

#include <string>

#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"

namespace {

using lrt::Errc;
using lrt::query::ResultFormat;
using lrt::query::Table;
using lrt::query::write;
using lrt::rdf::blank;
using lrt::rdf::iri;
using lrt::rdf::literal;
using lrt::rdf::tagged_literal;
namespace xsd = lrt::vocab::xsd;

Table table() {
  Table t({"x", "y"});
  t.add_row();
  t.set(0, iri("http://e/a?b&c"));
  t.set(1, literal("say \"a, b\"\\\n\t<&>"));
  t.add_row();
  t.set(1, tagged_literal("gr\xC3\xBC\xC3\x9F", "de"));
  t.add_row();
  t.set(0, blank("b0"));
  t.set(1, literal("1.50", xsd::decimal));
  t.add_row();
  return t;
}
std::string in_one_cell(const lrt::rdf::TermView& term, ResultFormat format) {
  Table t({"x"});
  t.add_row();
  t.set(0, term);
  const auto text = write(t, format);
  REQUIRE(text);
  return *text;
}

}  // namespace

TEST_CASE("solutions are written in JSON", "[query]") {
  CHECK(*write(table(), ResultFormat::json) ==
        R"({"head":{"vars":["x","y"]},"results":{"bindings":[
{"x":{"type":"uri","value":"http://e/a?b&c"},"y":{"type":"literal","value":"say \"a, b\"\\\n\t<&>"}},
{"y":{"type":"literal","value":"grüß","xml:lang":"de"}},
{"x":{"type":"bnode","value":"b0"},"y":{"type":"literal","value":"1.50","datatype":"http://www.w3.org/2001/XMLSchema#decimal"}},
{}]}}
)");
  CHECK(*write(Table(), ResultFormat::json) == "{\"head\":{\"vars\":[]},\"results\":{\"bindings\":[]}}\n");
  CHECK(in_one_cell(literal(std::string_view("\0\x1F", 2)), ResultFormat::json).find(R"("value":"\u0000\u001F")") != std::string::npos);
}

TEST_CASE("solutions are written in XML", "[query]") {
  CHECK(*write(table(), ResultFormat::xml) ==
        R"(<?xml version="1.0"?>
<sparql xmlns="http://www.w3.org/2005/sparql-results#">
<head><variable name="x"/><variable name="y"/></head>
<results>
<result><binding name="x"><uri>http://e/a?b&amp;c</uri></binding>)"
        R"(<binding name="y"><literal>say &quot;a, b&quot;\&#10;&#9;&lt;&amp;&gt;</literal></binding></result>
<result><binding name="y"><literal xml:lang="de">grüß</literal></binding></result>
<result><binding name="x"><bnode>b0</bnode></binding>)"
        R"(<binding name="y"><literal datatype="http://www.w3.org/2001/XMLSchema#decimal">1.50</literal></binding></result>
<result></result>
</results>
</sparql>
)");
}

TEST_CASE("a character that XML does not have is an error that names the cell", "[query]") {
  for (const char* text : {"\x01", "\x1F", "a\xEF\xBF\xBE", "\xEF\xBF\xBF"}) {
    Table t({"x", "name"});
    t.add_row();
    t.add_row();
    t.set(1, literal(text));
    const auto written = write(t, ResultFormat::xml);
    REQUIRE_FALSE(written);
    CHECK(written.error().code == Errc::unsupported_syntax);
    CHECK(written.error().message == "row 2, ?name: found a character that XML 1.0 does not allow; use another format");
    CHECK(write(t, ResultFormat::json));
    CHECK(write(t, ResultFormat::tsv));
  }
  CHECK(in_one_cell(literal("\r\x7F\xF0\x9F\x91\xAA"), ResultFormat::xml).find("<literal>&#13;\x7F\xF0\x9F\x91\xAA</literal>") != std::string::npos);
}

TEST_CASE("solutions are written in CSV", "[query]") {
  CHECK(*write(table(), ResultFormat::csv) == "x,y\r\nhttp://e/a?b&c,\"say \"\"a, b\"\"\\\n\t<&>\"\r\n,gr\xC3\xBC\xC3\x9F\r\n_:b0,1.50\r\n,\r\n");
  CHECK(in_one_cell(literal("a\rb"), ResultFormat::csv) == "x\r\n\"a\rb\"\r\n");
  CHECK(in_one_cell(literal(" a"), ResultFormat::csv) == "x\r\n\" a\"\r\n");
  CHECK(in_one_cell(literal(""), ResultFormat::csv) == "x\r\n\"\"\r\n");
  CHECK(*write(Table({"x"}), ResultFormat::csv) == "x\r\n");
}

TEST_CASE("solutions are written in TSV, with numbers as SPARQL has them", "[query]") {
  CHECK(*write(table(), ResultFormat::tsv) ==
        "?x\t?y\n<http://e/a?b&c>\t\"say \\\"a, b\\\"\\\\\\n\\t<&>\"\n\t\"gr\xC3\xBC\xC3\x9F\"@de\n_:b0\t1.50\n\t\n");
  const auto cell = [](std::string_view text, lrt::Iri datatype) {
    const std::string written = in_one_cell(literal(text, datatype), ResultFormat::tsv);
    return written.substr(3, written.size() - 4);
  };
  for (const char* text : {"0", "-12", "+007"}) CHECK(cell(text, xsd::integer) == text);
  for (const char* text : {"1.5", "-.5", "+0.0"}) CHECK(cell(text, xsd::decimal) == text);
  for (const char* text : {"1e3", "1.5E-3", ".5e+1", "1.e1"}) CHECK(cell(text, xsd::double_) == text);
  for (const char* text : {"", "-", "1.5", "1e3", " 1", "x"})
    CHECK(cell(text, xsd::integer) == '"' + std::string(text) + "\"^^<" + std::string(xsd::integer.text) + ">");
  for (const char* text : {"1", "1.", ".", "1e3"}) CHECK(cell(text, xsd::decimal).front() == '"');
  for (const char* text : {"1", "1.5", "e1", ".e1", "1e", "1e+", "INF", "NaN"}) CHECK(cell(text, xsd::double_).front() == '"');
  CHECK(cell("1", xsd::int_) == "\"1\"^^<http://www.w3.org/2001/XMLSchema#int>");
  CHECK(cell("a\r", xsd::string) == "\"a\\r\"");
}

TEST_CASE("the answer to ASK is written in JSON and XML only", "[query]") {
  CHECK(*write(true, ResultFormat::json) == "{\"head\":{},\"boolean\":true}\n");
  CHECK(*write(false, ResultFormat::xml) ==
        "<?xml version=\"1.0\"?>\n<sparql xmlns=\"http://www.w3.org/2005/sparql-results#\">\n<head/>\n<boolean>false</boolean>\n</sparql>\n");
  for (const ResultFormat format : {ResultFormat::csv, ResultFormat::tsv}) {
    const auto written = write(true, format);
    REQUIRE_FALSE(written);
    CHECK(written.error().code == Errc::unsupported_syntax);
  }
}
