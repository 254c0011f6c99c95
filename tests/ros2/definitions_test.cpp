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
      "string s \"it's \\\"so\\\"\"\nint32[] list [1, -2,3]\nstring[3] words [\"a\\\",b\", 'c', d]\nbool[2] flags [true, 0]\nwstring w "
      "\"\xc3\xa4\"\n");
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
  CHECK(*m.fields[2].field.initial->sequence()->at(0).text() == "a\",b");
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
  CHECK(contains(fault("int8 a\n" + row + "\nMSG: demo/Thing\nint8 b\n"), "two different definitions"));
  CHECK(parsed("demo/msg/Thing", "int8 a\n" + row + "\nMSG: demo/Thing\n# the same\nint8 a\n").size() == 1);
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
  // As nodes of Jazzy announce them.
  Definitions known;
  for (const auto& [type, hash] : std::vector<std::pair<const char*, const char*>>{
           {"sensor_msgs/msg/JointState", "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
           {"sensor_msgs/msg/Image", "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
           {"sensor_msgs/msg/LaserScan", "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"},
           {"sensor_msgs/msg/CameraInfo", "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
           {"sensor_msgs/msg/PointCloud2", "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
           {"nav_msgs/msg/Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
           {"rcl_interfaces/msg/ParameterEvent", "043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204"},
           {"rcl_interfaces/msg/Log", "e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac"},
           {"std_msgs/msg/Empty", "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312"},
           {"std_msgs/msg/Int32", "b6578ded3c58c626cfe8d1a6fb6e04f706f97e9f03d2727c9ff4e74b1cef0deb"},
           {"std_msgs/msg/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
           {"geometry_msgs/msg/Twist", "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"},
           {"builtin_interfaces/msg/Time", "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"}}) {
    CAPTURE(type);
    CHECK(known.message(type).value()->hash == "RIHS01_" + std::string(hash));
    CHECK(known.message(type, "RIHS01_" + std::string(hash)));
  }
  CHECK(known.service("example_interfaces/srv/AddTwoInts").value()->hash ==
        "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a");
  CHECK(known.service("rcl_interfaces/srv/GetParameters").value()->hash == "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc");
  // The shipped messages in it are Jazzy's if the hash is.
  const std::string participant = "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e";
  CHECK(known.message("rmw_dds_common/msg/ParticipantEntitiesInfo", participant).value()->fields[0].type.message->fields[0].type.size == 16);
}

TEST_CASE("all shipped definitions are types", "[ros2]") {
  Definitions known;
  std::size_t messages = 0;
  for (const char* type : {"std_msgs/msg/Header", "sensor_msgs/msg/JointState", "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2",
                           "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/BatteryState", "nav_msgs/msg/OccupancyGrid", "nav_msgs/msg/Odometry",
                           "tf2_msgs/msg/TFMessage", "diagnostic_msgs/msg/DiagnosticArray", "rmw_dds_common/msg/ParticipantEntitiesInfo",
                           "rcl_interfaces/msg/ParameterEvent", "visualization_msgs/msg/MarkerArray", "trajectory_msgs/msg/JointTrajectory",
                           "lifecycle_msgs/msg/TransitionEvent", "control_msgs/msg/JointJog", "rosgraph_msgs/msg/Clock"}) {
    CAPTURE(type);
    const Result<MessagePtr> message = known.message(type);
    REQUIRE(message);
    CHECK((*message)->origin == "shipped with lrt");
    CHECK(MessageType::of(*message));
    ++messages;
  }
  CHECK(messages == 17);
  for (const char* type : {"rcl_interfaces/srv/DescribeParameters", "rcl_interfaces/srv/GetParameters", "rcl_interfaces/srv/ListParameters",
                           "rcl_interfaces/srv/SetParameters", "lifecycle_msgs/srv/ChangeState", "lifecycle_msgs/srv/GetState",
                           "action_msgs/srv/CancelGoal", "type_description_interfaces/srv/GetTypeDescription", "std_srvs/srv/Trigger"}) {
    CAPTURE(type);
    const auto service = known.service(type);
    REQUIRE(service);
    CHECK(MessageType::of((*service)->request));
    CHECK(MessageType::of((*service)->response));
  }
  for (const char* type : {"control_msgs/action/FollowJointTrajectory", "control_msgs/action/GripperCommand", "example_interfaces/action/Fibonacci",
                           "tf2_msgs/action/LookupTransform"}) {
    CAPTURE(type);
    const auto action = known.action(type);
    REQUIRE(action);
    for (const MessagePtr& part :
         {(*action)->goal, (*action)->result, (*action)->feedback, (*action)->send_goal_request, (*action)->send_goal_response,
          (*action)->get_result_request, (*action)->get_result_response, (*action)->feedback_message})
      CHECK(MessageType::of(part));
  }
}

TEST_CASE("messages of an action on the wire have the id of the goal first", "[ros2]") {
  const auto action = Definitions().action("example_interfaces/action/Fibonacci").value();
  const MessageType request = MessageType::of(action->send_goal_request).value();
  CHECK(action->send_goal_request->name == "example_interfaces/action/Fibonacci_SendGoal_Request");
  const std::string payload = request.initial();
  CHECK(payload.size() == 4 + 16 + 4);
  CHECK(MessageType::of(action->get_result_response).value().initial() == std::string("\0\1\0\0\0\0\0\0\0\0\0\0", 12));
}

TEST_CASE("folders of an installation, of a package and of a workspace have definitions", "[ros2]") {
  const Folder folder;
  folder.write("share/demo_msgs/msg/Thing.msg", "Part part\n");
  folder.write("share/demo_msgs/msg/Part.msg", "int32 a\n");
  folder.write("share/demo_msgs/msg/Part.idl", "module");
  folder.write("share/demo_msgs/msg/not-a-name.msg", "int32 a\n");
  folder.write("share/demo_msgs/srv/Grasp.srv", "Part part\n---\n");
  folder.write("share/demo_msgs/action/Wave.action", "Part part\n---\n---\n");
  folder.write("src/group/checkout/package.xml", "<package>\n <name> named_msgs </name></package>");
  folder.write("src/group/checkout/msg/Thing.msg", "int32 a\n");
  folder.write(".hidden/hidden_msgs/msg/Thing.msg", "int32 a\n");
  for (int i = 0; i < 40; ++i)  // ways round
    std::filesystem::create_directory_symlink(folder.path, folder.path / "share" / ("again" + std::to_string(i)));
  for (const char* below : {"", "share", "share/demo_msgs"}) {
    CAPTURE(below);
    Definitions known;
    CHECK(known.add_folder((folder.path / below).string()).value() == (*below == '\0' ? 5U : std::string(below) == "share" ? 5U : 4U));
    CHECK(known.message("demo_msgs/msg/Thing").value()->fields[0].type.message->name == "demo_msgs/msg/Part");
    CHECK(known.service("demo_msgs/srv/Grasp").value()->response->fields.empty());
    CHECK(known.message("demo_msgs/srv/Grasp_Request").value()->fields.size() == 1);
    CHECK(known.action("demo_msgs/action/Wave").value()->goal->fields.size() == 1);
    CHECK(contains(known.message("demo_msgs/msg/Thing").value()->origin, folder.path.string()));
    CHECK(known.message("hidden_msgs/msg/Thing").error().code == Errc::unknown_path);
  }
  Definitions known;
  known.add_folder((folder.path / "src").string()).value();
  CHECK(known.message("named_msgs/msg/Thing"));
  CHECK(known.add_folder((folder.path / "nothing").string()).error().code == Errc::io_error);
  CHECK(known.add_folder((folder.path / "share/demo_msgs/msg").string()).error().code == Errc::unknown_path);
  DefinitionLimits few;
  few.max_files = 3;
  CHECK(Definitions(few).add_folder(folder.path.string()).error().code == Errc::limit_exceeded);
}

TEST_CASE("a malformed file is told, and does no harm to others", "[ros2]") {
  const Folder folder;
  folder.write("demo/msg/Bad.msg", "int32\n");
  folder.write("demo/msg/Good.msg", "int32 a\n");
  folder.write("demo/msg/Uses.msg", "Bad b\n");
  folder.write("demo/msg/Lacks.msg", "Gone g\n");
  folder.write("demo/msg/Itself.msg", "Two t\n");
  folder.write("demo/msg/Two.msg", "Itself[] t\n");
  Definitions known;
  known.add_folder(folder.path.string()).value();
  CHECK(known.message("demo/msg/Good"));
  CHECK(known.message("demo/msg/Bad").error().code == Errc::expected_value);
  CHECK(contains(known.message("demo/msg/Bad").error().message, "line 1"));
  CHECK(known.message("demo/msg/Uses").error().code == Errc::expected_value);
  CHECK(contains(known.message("demo/msg/Lacks").error().message, "demo/msg/Gone, which demo/msg/Lacks refers to"));
  CHECK(contains(known.message("demo/msg/Itself").error().message, "contains itself"));
  CHECK(known.message("demo/Good").error().code == Errc::unknown_path);
  const std::uint64_t version = known.version();
  known.add_text("demo/msg/Gone", "int8 x\n").value();
  CHECK(known.version() != version);
  CHECK(known.message("demo/msg/Lacks"));
  CHECK_FALSE(known.add_text("demo/msg/Other", "int8\n"));
}

TEST_CASE("of two versions that is taken which has the hash, or else the first", "[ros2]") {
  Definitions known;
  known.add_text("demo/msg/Thing", "int32 a\n", "first").value();
  const std::string first = known.message("demo/msg/Thing").value()->hash;
  known.add_text("demo/msg/Thing", "int32 a\nint32 b\n", "second").value();
  CHECK(known.message("demo/msg/Thing").value()->origin == "first");
  Definitions other;
  other.add_text("demo/msg/Thing", "int32 a\nint32 b\n").value();
  const std::string second = other.message("demo/msg/Thing").value()->hash;
  CHECK(first != second);
  CHECK(known.message("demo/msg/Thing", second).value()->origin == "second");
  CHECK(known.message("demo/msg/Thing", first).value()->origin == "first");
  const Error error = known.message("demo/msg/Thing", "RIHS01_00").error();
  CHECK(error.code == Errc::unknown_path);
  CHECK(contains(error.message, "first, second"));
  // Humble announces no hash, and has no variance of a range.
  CHECK(known.message("sensor_msgs/msg/Range").value()->fields.size() == 6);
  CHECK(known.message("rmw_dds_common/msg/ParticipantEntitiesInfo").value()->fields[0].type.message->fields[0].type.size == 24);
  Definitions jazzy;
  jazzy
      .add_text("sensor_msgs/msg/Range",
                "std_msgs/Header header\nuint8 radiation_type\nfloat32 field_of_view\nfloat32 min_range\nfloat32 max_range\nfloat32 range\nfloat32 "
                "variance\n")
      .value();
  CHECK(known.message("sensor_msgs/msg/Range", jazzy.message("sensor_msgs/msg/Range").value()->hash).value()->fields.size() == 7);
  // What a definition refers to differs, and not its own text.
  Definitions gid;
  gid.add_text("rmw_dds_common/msg/Gid", "uint8[16] data\n").value();
  const std::string hash = gid.message("rmw_dds_common/msg/ParticipantEntitiesInfo").value()->hash;
  CHECK(known.message("rmw_dds_common/msg/ParticipantEntitiesInfo", hash).value()->fields[0].type.message->fields[0].type.size == 16);
}

TEST_CASE("definitions have limits", "[ros2]") {
  DefinitionLimits limits;
  limits.max_depth = 4;
  limits.max_members = 20;
  Definitions known(limits);
  known.add_text("demo/msg/M0", "int8 a\n").value();
  for (int i = 1; i <= 4; ++i) known.add_text("demo/msg/M" + std::to_string(i), "M" + std::to_string(i - 1) + " a\n").value();
  CHECK(known.message("demo/msg/M3"));
  CHECK(known.message("demo/msg/M4").error().code == Errc::limit_exceeded);
  // Each doubles the members.
  known.add_text("demo/msg/D0", "int8 a\nint8 b\n").value();
  for (int i = 1; i <= 3; ++i)
    known.add_text("demo/msg/D" + std::to_string(i), "D" + std::to_string(i - 1) + " a\nD" + std::to_string(i - 1) + " b\n").value();
  CHECK(known.message("demo/msg/D2"));
  CHECK(known.message("demo/msg/D3").error().code == Errc::limit_exceeded);
}

namespace {

Value text(std::string s) { return Value(std::move(s)); }
Value integer(std::uint64_t n) { return Value(static_cast<std::int64_t>(n)); }
template <class... Members>
Value list(Members... members) {
  Value::Sequence sequence;
  (sequence.push_back(std::move(members)), ...);
  return Value(std::move(sequence));
}
Value described(std::string name, unsigned id, std::uint64_t capacity = 0, std::uint64_t text_capacity = 0, std::string nested = {}) {
  return list(text(std::move(name)), list(integer(id), integer(capacity), integer(text_capacity), text(std::move(nested))), text(""));
}
std::string response(Value type, Value others, Value sources, bool successful = true) {
  Definitions known;
  const MessageType codec = MessageType::of(known.service("type_description_interfaces/srv/GetTypeDescription").value()->response).value();
  return codec
      .encode(list(Value(successful), text(successful ? "" : "no such type"), list(std::move(type), std::move(others)), std::move(sources), list()))
      .value();
}
Value thing() {
  return list(text("demo/msg/Thing"), list(described("level", 3), described("parts", 97, 2, 0, "demo/msg/Part"), described("name", 21, 0, 5)));
}
Value part() { return list(text("demo/msg/Part"), list(described("structure_needs_at_least_one_member", 3))); }

}  // namespace

TEST_CASE("what a node describes is a definition, if it has the hash that was announced", "[ros2]") {
  Definitions written;
  written.add_text("demo/msg/Part", "").value();
  written.add_text("demo/msg/Thing", "uint8 level\nPart[<=2] parts\nstring<=5 name\n").value();
  const std::string hash = written.message("demo/msg/Thing").value()->hash;
  const std::string source = "# A thing.\n\nuint8 OK=0\nuint8 level 3 # how much\nPart[<=2] parts\nstring<=5 name\n";
  const Value sources = list(list(text("demo/msg/Thing"), text("msg"), text(source)), list(text("demo/msg/Part"), text("msg"), text("int32 other\n")),
                             list(text("demo/msg/Part"), text("idl"), text("module x {};")));
  Definitions known;
  CHECK(known.add_type_description(response(thing(), list(part()), sources), "demo/msg/Thing", hash, "/camera").value() == "demo/msg/Thing");
  const MessagePtr message = known.message("demo/msg/Thing", hash).value();
  CHECK(message->origin == "the node /camera");
  CHECK(message->comment == "A thing.");
  CHECK(message->constants.size() == 1);
  CHECK(*message->fields[0].initial->integer() == 3);
  CHECK(message->fields[1].type.arity == Arity::bounded_sequence);
  CHECK(message->fields[1].type.message->fields.empty());  // the text of a part that does not fit is ignored
  CHECK(message->fields[2].type.text_bound == 5);
  const std::uint64_t version = known.version();
  known.add_type_description(response(thing(), list(part()), sources), "demo/msg/Thing", hash, "/other").value();  // the same again
  CHECK(known.version() == version);

  const auto fault = [&](const std::string& payload, std::string_view type = "demo/msg/Thing") {
    const auto made = Definitions().add_type_description(payload, type, hash, "/camera");
    return made ? "added" : made.error().message;
  };
  CHECK(contains(fault(response(thing(), list(), list())), "does not have the hash"));
  CHECK(contains(fault(response(thing(), list(part()), list()), "demo/msg/Other"), "describes \"demo/msg/Thing\""));
  CHECK(contains(fault(response(thing(), list(part()), list(), false)), "no such type"));
  CHECK(contains(fault("\0\1\0\0"), "GetTypeDescription_Response"));
  CHECK(contains(fault(response(list(text("demo/msg/Thing"), list(described("a", 12))), list(), list())), "no type 12"));  // long double
  CHECK(contains(fault(response(list(text("demo/msg/Thing"), list(described("a", 255))), list(), list())), "no type 255"));
  CHECK(contains(fault(response(list(text("demo/msg/Thing"), list(described("a", 1, 0, 0, "x"))), list(), list())), "expected a type"));
  CHECK(contains(fault(response(list(text("demo"), list()), list(), list())), "has the name"));
  CHECK(contains(fault(response(list(text("demo/msg/Thing"), list(described("a", 3), described("a", 3))), list(), list())), "two fields"));
  DefinitionLimits limits;
  limits.max_definitions = 0;
  CHECK(Definitions(limits).add_type_description(response(thing(), list(part()), sources), "demo/msg/Thing", hash, "/c").error().code ==
        Errc::limit_exceeded);
  limits.max_definitions = 1;
  limits.max_kept_bytes = 10;
  CHECK(Definitions(limits).add_type_description(response(thing(), list(part()), sources), "demo/msg/Thing", hash, "/c").error().code ==
        Errc::limit_exceeded);
  // A description that contains itself is never resolved.
  Definitions loop;
  const Value itself = list(text("demo/msg/Thing"), list(described("a", 1, 0, 0, "demo/msg/Thing")));
  loop.add_type_description(response(itself, list(), list()), "demo/msg/Thing", "", "/c").value();
  CHECK(contains(loop.message("demo/msg/Thing").error().message, "contains itself"));
}

TEST_CASE("what a node describes of a service or an action are its messages", "[ros2]") {
  const auto action = Definitions().action("example_interfaces/action/Fibonacci").value();
  const std::string name = action->name, send = name + "_SendGoal";
  const Value uuid = list(text("unique_identifier_msgs/msg/UUID"), list(described("uuid", 51, 16)));
  const Value request = list(text(send + "_Request"),
                             list(described("goal_id", 1, 0, 0, "unique_identifier_msgs/msg/UUID"), described("goal", 1, 0, 0, name + "_Goal")));
  const Value goal = list(text(name + "_Goal"), list(described("order", 6)));
  const Value result = list(text(name + "_Result"), list(described("sequence", 150)));
  const Value feedback = list(text(name + "_Feedback"), list(described("sequence", 150)));
  const Value whole =
      list(text(send), list(described("request_message", 1, 0, 0, send + "_Request"), described("response_message", 1, 0, 0, send + "_Response"),
                            described("event_message", 1, 0, 0, send + "_Event")));
  Definitions known;
  const std::string source = "# How many.\nint32 order\n---\nint32[] sequence\n---\nint32[] sequence\n";
  known
      .add_type_description(response(whole, list(uuid, request, goal, result, feedback), list(list(text(name), text("action"), text(source)))), send,
                            "", "/n")
      .value();
  const auto made = known.action(name).value();
  CHECK(made->goal->origin == "the node /n");
  CHECK(made->goal->fields[0].comment == "How many.");
  CHECK(made->hash == action->hash);
  CHECK(known.message(send + "_Request").value()->hash == action->send_goal_request->hash);
}
