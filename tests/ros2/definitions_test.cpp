// SPDX-License-Identifier: Apache-2.0
#include <lrt/ros2/definitions.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <lrt/ros2/message_type.hpp>

#include "src/ros2/types/parser.hpp"
#include "src/ros2/types/type_hash.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;
using Value = rdf::Value;

namespace {

std::vector<ParsedMessage> parsed(std::string_view type, std::string_view text) { return parse_definition(type, text, {}).value(); }
ParsedMessage parsed(std::string_view text) { return parsed("demo/msg/Thing", text).at(0); }
std::string fault(std::string_view text, std::string_view type = "demo/msg/Thing", const DefinitionLimits& limits = {}) {
  const auto made = parse_definition(type, text, limits);
  return made ? "parsed" : made.error().message;
}
bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

struct Folder {
  std::filesystem::path path;
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "lrt-definitions-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  ~Folder() {
    std::error_code error;
    std::filesystem::remove_all(path, error);
  }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path / name).parent_path());
    std::ofstream(path / name) << text;
  }
};

}  // namespace

TEST_CASE("fields have kinds, arities and bounds", "[ros2]") {
  const ParsedMessage m = parsed(
      "bool a\nbyte b\nchar c\nint8 d\nuint64\te \nfloat32[3] f\nfloat64[] g\nstring[<=4] h\nstring<=10 i\nwstring<=7[<=2] j\n"
      "Other k\nother_msgs/Other[2] l\nother_msgs/msg/Other[] m\n");
  REQUIRE(m.fields.size() == 13);
  CHECK(m.fields[1].field.type.kind == Kind::octet);
  CHECK(m.fields[2].field.type.kind == Kind::character);
  CHECK(m.fields[4].field.type.kind == Kind::uint64);
  CHECK(m.fields[5].field.type.arity == Arity::array);
  CHECK(m.fields[5].field.type.size == 3);
  CHECK(m.fields[6].field.type.arity == Arity::sequence);
  CHECK(m.fields[7].field.type.arity == Arity::bounded_sequence);
  CHECK(m.fields[7].field.type.size == 4);
  CHECK(m.fields[8].field.type.text_bound == 10);
  CHECK(m.fields[9].field.type.text_bound == 7);
  CHECK(m.fields[9].field.type.size == 2);
  CHECK(m.fields[9].field.type.kind == Kind::wstring);
  CHECK(m.fields[10].message == "demo/msg/Other");
  CHECK(m.fields[11].message == "other_msgs/msg/Other");
  CHECK(m.fields[12].message == "other_msgs/msg/Other");
}

TEST_CASE("constants and defaults have values of their type", "[ros2]") {
  const ParsedMessage m = parsed(
      "int8 LOW=-128\nuint8 HIGH = 0xff # all bits\nuint64 LARGE=18446744073709551615\nint32 BITS=0b101\nint32 OCTAL=0o17\nbool YES=True\n"
      "float32 THIRD=0.1\nfloat64 INF=-inf\nstring HASH=\"a # b\" # no text\nstring BARE=a b  c\nstring EMPTY=\"\"\nstring EQUALS='x=y'\n"
      "string s \"it's \\\"so\\\"\"\nint32[] list [1, -2,3]\nstring[3] words [\"a,b\", 'c', d]\nbool[2] flags [true, 0]\nwstring w \"\xc3\xa4\"\n");
  REQUIRE(m.constants.size() == 12);
  CHECK(*m.constants[0].value.integer() == -128);
  CHECK(*m.constants[1].value.integer() == 255);
  CHECK(m.constants[1].comment == "all bits");
  CHECK(*m.constants[2].value.large_integer() == 18446744073709551615U);
  CHECK(*m.constants[3].value.integer() == 5);
  CHECK(*m.constants[4].value.integer() == 15);
  CHECK(*m.constants[5].value.boolean());
  CHECK(*m.constants[6].value.real() == static_cast<double>(0.1F));
  CHECK(*m.constants[7].value.real() < 0);
  CHECK(*m.constants[8].value.text() == "a # b");
  CHECK(m.constants[8].comment == "no text");
  CHECK(*m.constants[9].value.text() == "a b  c");
  CHECK(m.constants[10].value.text()->empty());
  CHECK(*m.constants[11].value.text() == "x=y");
  REQUIRE(m.fields.size() == 5);
  CHECK(*m.fields[0].field.initial->text() == "it's \"so\"");
  CHECK(m.fields[1].field.initial->sequence()->size() == 3);
  CHECK(*m.fields[2].field.initial->sequence()->at(0).text() == "a,b");
  CHECK(*m.fields[2].field.initial->sequence()->at(2).text() == "d");
  CHECK_FALSE(*m.fields[3].field.initial->sequence()->at(1).boolean());
  CHECK(*m.fields[4].field.initial->text() == "\xc3\xa4");
}

TEST_CASE("comments belong to what they stand at", "[ros2]") {
  const ParsedMessage m =
      parsed("# A thing.\n#\n# Of two lines.\n\n# lost\n\n# of a\nint32 a # [m]\n           # goes on\nint32 b\n#int32 c\n\n# of d\nint32 d\n");
  CHECK(m.comment == "A thing.\nOf two lines.");
  REQUIRE(m.fields.size() == 3);
  CHECK(m.fields[0].field.comment == "of a\n[m]\ngoes on");
  CHECK(m.fields[1].field.comment.empty());
  CHECK(m.fields[2].field.comment == "of d");
  CHECK(parsed("# Only words\n").comment == "Only words");
  CHECK(parsed("# of a\r\nint32 a\r\n").fields[0].field.comment == "of a");
}

TEST_CASE("services and actions have parts", "[ros2]") {
  const auto srv = parsed("demo/srv/Grasp", "int32 A=1\nfloat64 force\n---\nbool done\n");
  REQUIRE(srv.size() == 2);
  CHECK(srv[0].name == "demo/srv/Grasp_Request");
  CHECK(srv[0].constants.size() == 1);
  CHECK(srv[1].name == "demo/srv/Grasp_Response");
  CHECK(srv[1].fields[0].field.name == "done");
  const auto action = parsed("demo/action/Wave", "---\n---  \n");
  REQUIRE(action.size() == 3);
  CHECK(action[2].name == "demo/action/Wave_Feedback");
  CHECK(action[2].fields.empty());
  CHECK(contains(fault("int32 a\n", "demo/srv/Grasp"), "expected 1 lines \"---\""));
  CHECK(contains(fault("---\n---\n", "demo/srv/Grasp"), "one more"));
  CHECK(contains(fault("---\n", "demo/action/Wave"), "expected 2 lines"));
  CHECK(contains(fault("---\n"), "expected a type and a name"));
}

TEST_CASE("definitions in a row are those of bags", "[ros2]") {
  const std::string row(80, '=');
  const auto all = parsed("demo/msg/Thing", "demo/Part part\n" + row + "\nMSG: demo/Part\nstd_msgs/Header header\n" + row +
                                                "\nMSG: std_msgs/msg/Header\n" + "string frame_id\n");
  REQUIRE(all.size() == 3);
  CHECK(all[1].name == "demo/msg/Part");
  CHECK(all[2].name == "std_msgs/msg/Header");
  CHECK(contains(fault("int8 a\n" + row + "\n"), "MSG: PACKAGE/NAME"));
  CHECK(contains(fault("int8 a\n" + row + "\nint8 b\n"), "MSG: PACKAGE/NAME"));
  CHECK(contains(fault("int8 a\n" + row + "\nMSG: demo/Thing\nint8 b\n"), "occurs twice"));
}

TEST_CASE("a malformed definition is refused with its line", "[ros2]") {
  CHECK(contains(fault("int32 a\nint32\n"), "line 2"));
  for (const char* text : {"int32",
                           "int32 1a",
                           "int32 a b",
                           "int32 a 1.5",
                           "int8 a 128",
                           "uint8 A=-1",
                           "int32 a\nfloat64 a",
                           "int32[0] a",
                           "int32[-1] a",
                           "int32[4294967296] a",
                           "int32[ a",
                           "int32] a",
                           "int32<=3 a",
                           "string<=0 s",
                           "string<= s",
                           "bool b maybe",
                           "Other o 1",
                           "Other O=1",
                           "int32[] A=1",
                           "int32[2] a [1]",
                           "int32[<=1] a [1,2]",
                           "int32[] a 1",
                           "int32[] a [1,,2]",
                           "int32[] a [1",
                           "string s \"a\"b\"",
                           "string<=2 s \"abc\"",
                           "float32 f 1e39",
                           "float64 f 1e999",
                           "float64 f one",
                           "int32 a 99999999999999999999",
                           "int32 a -",
                           "a/b/c/D d",
                           "/D d",
                           "D- d",
                           "int32 a.b",
                           "string[2] s [\"a, b]",
                           "\xff",
                           "int32 A="}) {
    CAPTURE(text);
    CHECK(fault(text) != "parsed");
  }
  CHECK(contains(fault(std::string("int32 a\0\n", 9)), "byte of 0"));
  CHECK(contains(fault("int32 a", "demo/Thing"), "PACKAGE/msg/NAME"));
  DefinitionLimits limits;
  limits.max_fields = 2;
  CHECK(contains(fault("int8 a\nint8 B=1\n", "demo/msg/Thing", limits), "parsed"));
  CHECK(contains(fault("int8 a\nint8 B=1\nint8 c\n", "demo/msg/Thing", limits), "more than 2"));
  limits.max_text_bytes = 7;
  CHECK(contains(fault("int8 aaa", "demo/msg/Thing", limits), "more than 7 bytes"));
}

TEST_CASE("hashes are those that nodes announce", "[ros2]") {
  // As the nodes of Jazzy announce them.
  Definitions known;
  CHECK(known.message("std_msgs/msg/String").value()->hash == "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
  CHECK(known.message("geometry_msgs/msg/Twist").value()->hash == "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a");
  CHECK(known.service("example_interfaces/srv/AddTwoInts").value()->hash ==
        "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a");
}
