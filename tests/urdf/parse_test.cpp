// SPDX-License-Identifier: Apache-2.0
#include <lrt/urdf.hpp>

#include <clocale>
#include <cmath>
#include <fstream>
#include <iterator>
#include <locale>
#include <thread>

#include "tests/support/catch.hpp"
#include "tests/urdf/documents.hpp"

using namespace lrt;
using namespace lrt::test;
using urdf::JointType;

namespace {

std::string text_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The error's sentence; empty if there is none.
std::string refusal(const std::string& text, const urdf::ParseOptions& options = {}) {
  const auto model = urdf::parse(text, options);
  return model ? std::string() : model.error().message;
}
/// The warnings, one a line.
std::string warnings(const std::string& text) {
  const urdf::Model model = urdf::parse(text).value();
  std::string all;
  for (const std::string& warning : model.warnings) all += (all.empty() ? "" : "\n") + warning;
  return all;
}
std::string of_link(const std::string& content, const std::string& version = "1.0") {
  return "<robot name='r' version='" + version + "'>\n<link name='a'>\n" + content + "</link></robot>";
}
std::string warnings_of_link(const std::string& content) { return warnings(of_link(content)); }

const std::string limit = "<limit lower='-1' upper='2' velocity='3' effort='4'/>";

}  // namespace

TEST_CASE("of a repeated element the first one is used, with a warning", "[urdf]") {
  const auto model = urdf::parse(two_links("revolute", limit + "\n<origin xyz='1 0 0'/><origin xyz='2 0 0'/><parent link='b'/>" + limit)).value();
  CHECK(model.joints[0].origin.position[0] == 1);
  CHECK(model.warnings == std::vector<std::string>{"origin of joint \"j\" (line 6): is repeated; the first one is used",
                                                   "parent of joint \"j\" (line 6): is repeated; the first one is used",
                                                   "limit of joint \"j\" (line 6): is repeated; the first one is used"});
}

TEST_CASE("a limit below 0 is ignored with a warning", "[urdf]") {
  const auto model = urdf::parse(two_links("revolute", "<limit lower='-1' upper='1' velocity='-3' effort='-1'/>")).value();
  CHECK_FALSE(model.joints[0].limits->velocity);
  CHECK_FALSE(model.joints[0].limits->effort);
  CHECK(model.warnings.size() == 2);
  CHECK(model.warnings[1] == "limit of joint \"j\" (line 5): expected velocity of at least 0, found -3; taken as unlimited");
}

TEST_CASE("arguments of xacro are replaced if the options give values", "[urdf]") {
  const std::string text = "<robot name='r' xmlns:xacro='x'><xacro:arg name='p' default=''/><link name='$(arg p)base_${p}'/></robot>";
  urdf::ParseOptions options;
  options.arguments["p"] = "left_";
  CHECK(urdf::parse(text, options).value().links[0].name == "left_base_left_");
  CHECK(refusal("<robot name='r'>\n<link name='$(arg p)base'/></robot>") ==
        "link \"$(arg p)base\" (line 2): expected a document that xacro has expanded, found \"$(arg p)\": run xacro first, or give "
        "ParseOptions::arguments "
        "a value for \"p\"");
  CHECK(refusal("<robot name='r'><link name='$(find x)'/></robot>") == "");
}

TEST_CASE("all elements and attributes of joints are read", "[urdf]") {
  const urdf::Model m = urdf::parse(text_of(picker_file)).value();
  CHECK(m.name == "picker");
  CHECK(m.warnings.empty());
  REQUIRE(m.joints.size() == 7);
  REQUIRE(m.links.size() == 8);
  CHECK(m.links[m.root].name == "rail");
  CHECK(m.variables == std::vector<std::size_t>{0, 1, 2, 3, 5});
  const urdf::Joint& slide = m.joints[0];
  CHECK(slide.name == "slide");
  CHECK(slide.type == JointType::prismatic);
  CHECK(slide.line == 28);
  CHECK(m.links[slide.parent].name == "rail");
  CHECK(m.links[slide.child].name == "carriage");
  CHECK(m.links[slide.child].joint == 0U);
  CHECK(slide.origin.position == std::array<double, 3>{0, 0, 0.1});
  CHECK(slide.axis == std::array<double, 3>{1, 0, 0});
  CHECK(slide.limits->lower == -0.5);
  CHECK(slide.limits->upper == 0.5);
  CHECK(slide.limits->velocity == 0.4);
  CHECK(slide.limits->effort == 200);
  CHECK(slide.dynamics->damping == 30);
  CHECK(slide.dynamics->friction == 4);
  CHECK_FALSE(slide.safety);
  const urdf::Joint& turret = m.joints[1];
  CHECK(turret.type == JointType::continuous);
  CHECK_FALSE(turret.limits->lower);
  CHECK(turret.limits->velocity == 2);
  const urdf::Joint& shoulder = m.joints[2];
  CHECK(shoulder.dynamics->friction == 0);
  CHECK(shoulder.safety->soft_lower_limit == -1.1);
  CHECK(shoulder.safety->soft_upper_limit == 1.9);
  CHECK(shoulder.safety->k_position == 50);
  CHECK(shoulder.safety->k_velocity == 20);
  CHECK(m.joints[4].type == JointType::fixed);
  CHECK(m.joints[4].origin.orientation[1] == Approx(std::sqrt(0.5)));
  CHECK(m.joints[6].mimic->joint == 5);
  CHECK(m.joints[6].mimic->multiplier == 1);
  CHECK(m.joints[6].mimic->offset == 0);
}

TEST_CASE("all elements and attributes of links are read", "[urdf]") {
  const urdf::Model m = urdf::parse(R"(<robot name="r">
    <material name="red"><color rgba="1 0 0 0.5"/></material>
    <link name="a">
      <inertial><origin xyz="1 2 3" rpy="0 0 3.141592653589793"/><mass value="2"/>
        <inertia ixx="1" ixy="0.1" ixz="0.2" iyy="1.1" iyz="0.3" izz="1.2"/></inertial>
      <visual name="v"><origin xyz="0 0 1"/><geometry><box size="1 2 3"/></geometry><material name="red"/></visual>
      <visual><geometry><mesh filename="package://p/m.stl" scale="1 -1 1"/></geometry><material name="later"/></visual>
      <visual><geometry><sphere radius="0.5"/></geometry><material name=""><color rgba="0 1 0 1"/></material></visual>
      <visual><geometry><sphere radius="0.5"/></geometry><material name="wood"><texture filename="wood.png"/></material></visual>
      <collision><geometry><cylinder radius="1" length="2"/></geometry></collision>
      <collision><geometry><sphere radius="3"/></geometry></collision>
    </link>
    <link name="b"><visual><geometry><sphere radius="1"/></geometry>
      <material name="later"><color rgba="0.1 0.2 0.3 1"/></material></visual></link>
    <joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
    <gazebo><whatever xmlns:x="urn:x"><x:y/></whatever></gazebo></robot>)")
                            .value();
  const urdf::Link& a = m.links[0];
  REQUIRE(a.inertial);
  CHECK(a.inertial->mass == 2);
  CHECK(a.inertial->origin.position == std::array<double, 3>{1, 2, 3});
  CHECK(a.inertial->origin.orientation[2] == Approx(1));
  CHECK(a.inertial->inertia == std::array<double, 6>{1, 0.1, 0.2, 1.1, 0.3, 1.2});
  REQUIRE(a.visuals.size() == 4);
  CHECK(a.visuals[0].name == "v");
  CHECK(a.visuals[0].size == std::array<double, 3>{1, 2, 3});
  CHECK(a.visuals[0].origin.position == std::array<double, 3>{0, 0, 1});
  CHECK(a.visuals[0].material->name == "red");
  CHECK(a.visuals[0].material->colour == std::array<double, 4>{1, 0, 0, 0.5});
  CHECK(a.visuals[1].kind == urdf::Shape::Kind::mesh);
  CHECK(a.visuals[1].mesh == "package://p/m.stl");
  CHECK(a.visuals[1].scale == std::array<double, 3>{1, -1, 1});
  CHECK(a.visuals[1].material->colour == std::array<double, 4>{0.1, 0.2, 0.3, 1});
  CHECK(a.visuals[2].material->name.empty());
  CHECK(a.visuals[2].material->colour == std::array<double, 4>{0, 1, 0, 1});
  CHECK(a.visuals[3].material->texture == "wood.png");
  CHECK_FALSE(a.visuals[3].material->colour);
  REQUIRE(a.collisions.size() == 2);
  CHECK(a.collisions[0].radius == 1);
  CHECK(a.collisions[0].length == 2);
  CHECK(a.collisions[1].kind == urdf::Shape::Kind::sphere);
  CHECK_FALSE(a.collisions[0].material);
}

TEST_CASE("every joint type is read, and an axis becomes a unit vector", "[urdf]") {
  const auto joint = [](const std::string& type, const std::string& more) { return urdf::parse(two_links(type, more)).value().joints.at(0); };
  CHECK(joint("revolute", limit + "<axis xyz='0 3 4'/>").axis == std::array<double, 3>{0, 0.6, 0.8});
  CHECK(joint("continuous", "").axis == std::array<double, 3>{1, 0, 0});
  CHECK(joint("prismatic", limit + "<axis xyz=' 0\t0\n-2 '/>").axis == std::array<double, 3>{0, 0, -1});
  CHECK(joint("fixed", "<axis xyz='0 0 0'/>").type == JointType::fixed);
  CHECK(joint("floating", "").type == JointType::floating);
  CHECK(joint("planar", "<axis xyz='0 0 1'/>").type == JointType::planar);
  for (const JointType type :
       {JointType::revolute, JointType::continuous, JointType::prismatic, JointType::fixed, JointType::floating, JointType::planar}) {
    const std::string name(urdf::to_string(type));
    CHECK(joint(name, type == JointType::revolute || type == JointType::prismatic ? limit : "").type == type);
  }
}

TEST_CASE("an invalid description gives one error with the element and its line", "[urdf]") {
  CHECK(refusal(two_links("spin")) ==
        "joint \"j\" (line 4): expected one of the types revolute, continuous, prismatic, fixed, floating, planar; found \"spin\"");
  const auto error = urdf::parse(two_links("spin")).error();
  CHECK(error.code == Errc::expected_value);
  CHECK(error.line == 4);

  CHECK(refusal("") == "expected XML, found nothing");
  CHECK(refusal("<robot name='r'>\n<link name='a'>\n</robot>") == "line 2: expected XML, found <link> and a wrong end tag or none");
  CHECK(refusal("<robot name='r'>\n<link name=a/></robot>") ==
        "line 2: expected XML, found <link> with an attribute that is not quoted, not terminated or repeated");
  CHECK(refusal("<robot name='r'>\n<!-- </robot>") == "line 2: expected XML, found an unterminated comment");
  CHECK(refusal("robot") == "line 1: expected XML, found text outside an element, or unterminated text");
  CHECK(refusal("<robot name='r'><link name='a'></link></robot>\n</robot><more/>") ==
        "line 2: expected no end tag without an element, found \"</robot>\"");
  CHECK(refusal("<robot name='r'>\n<link name='&foo;'/></robot>") ==
        "line 2: expected an entity of XML (lt, gt, amp, apos, quot) or a character by number, found \"&foo\"");
  CHECK(refusal("<robot name='r'>\n<link name='a & b'/></robot>").find("line 2: expected an entity") == 0);
  CHECK(refusal("<robot name='r'><link name='a&#0;b'/></robot>").find("line 1: expected an entity") == 0);
  CHECK(refusal("<robot name='r'><link name='a'/>&#x110000;</robot>").find("line 1: expected an entity") == 0);
  CHECK(refusal("<!DOCTYPE robot [<!ENTITY foo 'a&b;'>]><robot name='r'><!-- & --><link name='a'/><x><![CDATA[a && b]]></x></robot>") == "");
  CHECK(refusal("<!DOCTYPE robot [<!ENTITY foo 'a'>]><robot name='r'><link name='&foo;'/></robot>").find("line 1: expected an entity") == 0);
  CHECK(refusal("<robot name='r'>\n<link name='" + std::string(1001, 'a') + "'/></robot>").find("(line 2): expected a name of at most 1000 bytes") !=
        std::string::npos);
  CHECK(refusal("<!-- </a> --><robot name='r'><!-- </a> --><link name='a'><![CDATA[</a>]]></link></robot>") == "");
  CHECK(refusal("<!-- nothing -->") == "expected <robot>, found no element");
  CHECK(refusal("<robot name='r'><link name='a' name='b'/></robot>").find("line 1: expected XML") == 0);
  CHECK(refusal("<robot name='r'><link name='a'/></robot><robot/>") == "line 1: expected one outermost element, found <robot> after it");
  CHECK(refusal("<sdf/>") == "sdf (line 1): expected <robot> as the outermost element");
  CHECK(refusal("<robot/>") == "robot (line 1): expected an attribute name");
  CHECK(refusal("<robot name='r'/>") == "robot \"r\" (line 1): expected at least one link");
  CHECK(refusal("<robot name='r' version='2.0'><link name='a'/></robot>") == "robot \"r\" (line 1): expected version 1.0, 1.1 or 1.2, found \"2.0\"");
  CHECK(refusal("<robot name='r'>\n<link/></robot>") == "link (line 2): expected an attribute name");
  CHECK(refusal("<robot name='r'>\n<link name=''/></robot>") == "link \"\" (line 2): expected a name, found an empty one");
  CHECK(refusal("<robot name='r'>\n<link name='a'/>\n<link name='a'/></robot>") ==
        "link \"a\" (line 3): expected a unique name: it is the name of another link in line 2");
  CHECK(refusal(std::string("<robot name='r\0'/>", 18)) == "line 1: expected XML, found U+0000");
  CHECK(refusal("\xFF\xFE<") == "expected UTF-8, found UTF-16");
  CHECK(refusal("<robot name='r'><link name='a&#1;'/></robot>").find("without control characters") != std::string::npos);
  CHECK(refusal("<robot name='r'><link name='&#xD800;'/></robot>") != "");
}

TEST_CASE("noise of rounding is corrected with a warning, a wrong number is refused", "[urdf]") {
  const auto inertial = [](const std::string& mass, const std::string& ixx, const std::string& others) {
    return of_link("<inertial><mass value='" + mass + "'/><inertia ixx='" + ixx + "' ixy='0' ixz='0' iyy='" + others + "' iyz='0' izz='" + others +
                   "'/></inertial>");
  };
  const auto moment = [&](const std::string& mass, const std::string& ixx, const std::string& others) {
    const Result<urdf::Model> model = urdf::parse(inertial(mass, ixx, others));
    if (!model) return model.error().message;
    CHECK(model->links[0].inertial->inertia[0] == 0);
    return model->warnings.empty() ? std::string() : model->warnings.at(0);
  };
  const std::string where = "inertia of link \"a\" (line 3): ", noise = ", which is noise of rounding; taken as 0";
  CHECK(moment("0.5", "-5e-20", "3e-4") == where + "ixx is -5e-20" + noise);  // iCub
  CHECK(moment("0", "-5e-20", "3e-4") == where + "ixx is -5e-20" + noise);
  CHECK(moment("0.5", "-5e-20", "0") == where + "ixx is -5e-20" + noise);  // by the mass
  CHECK(moment("0.5", "-3e-13", "3e-4") == where + "ixx is -3e-13" + noise);
  CHECK(moment("0.5", "-3e-12", "3e-4") == where + "expected ixx of at least 0, found -3e-12");
  CHECK(moment("0", "-5e-20", "0") == where + "expected ixx of at least 0, found -5e-20");
  CHECK(moment("-1e-12", "0", "1") == "mass of link \"a\" (line 3): value is -1e-12" + noise);
  CHECK(moment("-1e-3", "0", "1") == "mass of link \"a\" (line 3): expected value of at least 0, found -0.001");

  const auto limits = [](const std::string& attributes) {
    const urdf::Model model = urdf::parse(two_links("revolute", "<limit " + attributes + "/>")).value();
    return std::pair(*model.joints[0].limits, model.warnings);
  };
  CHECK(limits("lower='1e-17' upper='0' velocity='1' effort='1'").first.lower == 0);
  CHECK(limits("lower='1e-17' upper='0' velocity='1' effort='1'").second.at(0).find("cannot move") != std::string::npos);
  CHECK_FALSE(limits("lower='1e-3' upper='0' velocity='1' effort='1'").first.lower);
  CHECK(limits("lower='0' upper='1' velocity='-1e-15' effort='1'").first.velocity == 0);
  CHECK_FALSE(limits("lower='0' upper='1' velocity='-1' effort='1'").first.velocity);
  CHECK(urdf::parse(two_links("continuous", "<axis xyz='6e-17 0 2'/>"))->joints[0].axis[2] == 1);
  for (const char* axis : {"0 0 0", "1e-20 0 0"}) CHECK_FALSE(urdf::parse(two_links("continuous", std::string("<axis xyz='") + axis + "'/>")));
}

TEST_CASE("an invalid visual, collision or inertial is left out with a warning", "[urdf]") {
  const std::string inertia = "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>";
  CHECK(warnings_of_link("<inertial>" + inertia + "</inertial>") == "inertial of link \"a\" (line 3): has no element <mass> and is left out");
  CHECK(warnings_of_link("<inertial><mass value='1'/></inertial>") == "inertial of link \"a\" (line 3): has no element <inertia> and is left out");
  CHECK(refusal(of_link("<inertial><mass value='nan'/>" + inertia + "</inertial>")) ==
        "mass of link \"a\" (line 3): expected a number as value, found \"nan\"");
  CHECK(refusal(of_link("<inertial><mass value='-1'/>" + inertia + "</inertial>")) ==
        "mass of link \"a\" (line 3): expected value of at least 0, found -1");
  CHECK(refusal(of_link("<inertial><mass value='1'/>\n<inertia ixx='1' ixy='0' ixz='0' iyy='-1e-3' iyz='0' izz='1'/></inertial>")) ==
        "inertia of link \"a\" (line 4): expected iyy of at least 0, found -0.001");
  CHECK(refusal(of_link("<inertial><mass value='1'/>\n<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0'/></inertial>")) ==
        "inertia of link \"a\" (line 4): expected an attribute izz");
  CHECK(warnings_of_link("<visual/>") == "visual of link \"a\" (line 3): expected an element <geometry>; the visual is left out");
  CHECK(warnings_of_link("<visual><geometry/></visual>") ==
        "geometry of link \"a\" (line 3): expected one of the elements box, cylinder, sphere, capsule, mesh; the visual is left out");
  CHECK(warnings_of_link("<collision><geometry><plane normal='0 0 1'/></geometry></collision>") ==
        "geometry of link \"a\" (line 3): expected one of the elements box, cylinder, sphere, capsule, mesh; found \"plane\"; the collision is "
        "left out");
  CHECK(warnings_of_link("<visual><geometry><box size='1 2'/></geometry></visual>") ==
        "box of link \"a\" (line 3): expected 3 numbers as size, found \"1 2\"; the visual is left out");
  CHECK(warnings_of_link("<visual><geometry><mesh filename=''/></geometry></visual>") ==
        "mesh of link \"a\" (line 3): expected a filename, found an empty one; the visual is left out");
  CHECK(warnings_of_link("<visual><origin rpy='0 x 0'/><geometry><sphere radius='1'/></geometry></visual>") ==
        "origin of link \"a\" (line 3): expected a number as rpy, found \"x\"; the visual is left out");
  for (const std::string number : {"nan", "inf", "0x10", "1,5", "", "1e999", "1e-400", "1 2", "--1", "1d3", "1.0f"})
    CHECK(warnings_of_link("<visual><geometry><sphere radius='" + number + "'/></geometry></visual>") ==
          "sphere of link \"a\" (line 3): expected a number as radius, found \"" + number + "\"; the visual is left out");
  for (const std::string number : {"1.", ".5", "+1", " 1 ", "1E-3", "5e-324"})
    CHECK(warnings_of_link("<visual><geometry><sphere radius='" + number + "'/></geometry></visual>") == "");

  // Valid parts are kept.
  const urdf::Model m =
      urdf::parse(of_link("<inertial/><visual name='1'/><visual name='2'><geometry><capsule radius='0.1' length='2'/></geometry></visual>"
                          "<collision><geometry><capsule/></geometry></collision>"
                          "<collision name='4'><geometry><cylinder radius='1' length='3'/></geometry></collision>"
                          "<collision name='5'><geometry><capsule radius='1' length='0'/></geometry></collision>"))
          .value();
  CHECK(m.warnings.size() == 3);
  const urdf::Link& link = m.links[0];
  CHECK_FALSE(link.inertial);
  REQUIRE(link.visuals.size() == 1);
  CHECK(link.visuals[0].name == "2");
  CHECK(link.visuals[0].kind == urdf::Shape::Kind::capsule);
  CHECK(link.visuals[0].radius == 0.1);
  CHECK(link.visuals[0].length == 2);
  REQUIRE(link.collisions.size() == 2);
  CHECK(link.collisions[0].kind == urdf::Shape::Kind::cylinder);
  CHECK(link.collisions[1].kind == urdf::Shape::Kind::capsule);
}

TEST_CASE("an incomplete material is accepted", "[urdf]") {
  const std::string sphere = "<visual><geometry><sphere radius='1'/></geometry>";
  const auto material = [&](const std::string& text) {
    return *urdf::parse(of_link(sphere + text + "</visual>")).value().links[0].visuals[0].material;
  };
  const auto warned = [&](const std::string& text) { return warnings_of_link(sphere + text + "</visual>"); };
  // Never defined: one warning for each name.
  const std::string grey = sphere + "<material name='grey'/></visual>";
  CHECK(warnings_of_link(grey + grey) == "material of link \"a\" (line 3): \"grey\" has neither <color> nor <texture> anywhere in the document");
  const urdf::Link link =
      urdf::parse(of_link(grey + sphere + "<material name='red'><color rgba='1 0 0 1'/></material></visual>" + grey)).value().links[0];
  CHECK(link.visuals[0].material->name == "grey");
  CHECK_FALSE(link.visuals[0].material->colour);
  CHECK(link.visuals[1].material->colour == std::array<double, 4>{1, 0, 0, 1});
  CHECK_FALSE(link.visuals[2].material->colour);

  CHECK(warned("<material name='x'><color rgba='255 108 10 255'/></material>") ==
        "color of link \"a\" (line 3): expected an rgba of numbers from 0 to 1, found 255; the color is left out");
  CHECK(warned("<material name='x'><color/></material>") == "color of link \"a\" (line 3): expected an attribute rgba; the color is left out");
  CHECK_FALSE(material("<material name='x'><color rgba='0 0 2 1'/></material>").colour);
  CHECK(material("<material name='x'><color rgba='1 0.5 0'/></material>").colour == std::array<double, 4>{1, 0.5, 0, 1});
  CHECK(material("<material><color rgba='0 0 1 1'/></material>").colour == std::array<double, 4>{0, 0, 1, 1});
  CHECK(material("<material name=''><color rgba='0 0 0 1'/><texture filename='t.png'/></material>").colour == std::array<double, 4>{0, 0, 0, 1});
  CHECK_FALSE(material("<material name=''><texture filename='t.png'/></material>").colour);
  CHECK(material("<material name='x'><color rgba='0 0 0 1'/><texture filename=''/></material>").texture.empty());
  const std::string twice =
      "<robot name='r'><material name='m'><color rgba='1 0 0 1'/></material>\n<material name='m'><color rgba='0 1 0 1'/></material>"
      "<material/><link name='a'><visual><geometry><sphere radius='1'/></geometry><material name='m'/></visual></link></robot>";
  CHECK(warnings(twice) ==
        "material \"m\" (line 2): expected a unique name: it is the name of another material in line 1; the material is left out\n"
        "material (line 2): expected an attribute name; the material is left out");
  CHECK(urdf::parse(twice)->links[0].visuals[0].material->colour == std::array<double, 4>{1, 0, 0, 1});
}

TEST_CASE("missing limits have no value", "[urdf]") {
  const auto limits = [](const std::string& type, const std::string& attributes) {
    return urdf::parse(two_links(type, "<limit " + attributes + "/>")).value().joints[0].limits;
  };
  const auto warned = [](const std::string& type, const std::string& attributes) { return warnings(two_links(type, "<limit " + attributes + "/>")); };
  const std::string at = "limit of joint \"j\" (line 5): ";
  CHECK(warnings(two_links("revolute")) == "joint \"j\" (line 4): expected an element <limit>, which revolute joints need; taken as unlimited");
  CHECK_FALSE(urdf::parse(two_links("prismatic")).value().joints[0].limits);
  CHECK(warned("revolute", "lower='-1' upper='1'") == at + "has no effort; taken as unlimited\n" + at + "has no velocity; taken as unlimited");
  CHECK_FALSE(limits("revolute", "lower='-1' upper='1'")->velocity);
  CHECK_FALSE(limits("revolute", "lower='-1' upper='1'")->effort);
  CHECK(limits("revolute", "lower='-1' upper='1'")->lower == -1.0);
  CHECK(limits("revolute", "lower='-1' upper='1' effort='0' velocity='0'")->velocity == 0.0);
  CHECK(warned("revolute", "effort='9' velocity='8'") == at + "has neither lower nor upper; the position is taken as unlimited");
  CHECK_FALSE(limits("revolute", "effort='9' velocity='8'")->upper);
  CHECK(limits("revolute", "effort='9' velocity='8'")->effort == 9.0);
  CHECK(limits("prismatic", "upper='2' effort='9' velocity='8'")->lower == 0.0);  // the default of URDF
  CHECK(warned("revolute", "lower='0' upper='0' effort='0' velocity='0'") == at + "lower and upper are both 0: the joint cannot move");
  CHECK(warned("revolute", "lower='-inf' upper='+INF' effort='Infinity' velocity='1'") == "");
  CHECK_FALSE(limits("revolute", "lower='-inf' upper='+INF' effort='Infinity' velocity='1'")->lower);
  CHECK_FALSE(limits("revolute", "lower='-inf' upper='inf' effort='Infinity' velocity='1'")->effort);
  CHECK_FALSE(limits("continuous", "lower='-1' upper='1' effort='9' velocity='8'")->lower);
  CHECK(warned("fixed", "") == "");
  CHECK_FALSE(limits("fixed", ""));
}

TEST_CASE("a joint whose lower or upper limit is not a number, or whose lower is above the upper, takes no commands", "[urdf]") {
  const auto joint = [](const std::string& type, const std::string& attributes) {
    return urdf::parse(two_links(type, "<limit " + attributes + "/>")).value().joints[0];
  };
  const auto warned = [](const std::string& type, const std::string& attributes) { return warnings(two_links(type, "<limit " + attributes + "/>")); };
  const std::string at = "limit of joint \"j\" (line 5): ";
  CHECK(warned("revolute", "lower='nan' upper='1' effort='1' velocity='1'") ==
        at + "expected a number as lower, found \"nan\"; the joint takes no commands");
  CHECK_FALSE(joint("revolute", "lower='nan' upper='1' effort='1' velocity='1'").takes_commands);
  CHECK(joint("revolute", "lower='nan' upper='1' effort='1' velocity='1'").limits->upper == 1.0);
  CHECK_FALSE(joint("prismatic", "lower='-1' upper='1,5' effort='1' velocity='1'").takes_commands);
  CHECK(joint("continuous", "lower='x' effort='1' velocity='1'").takes_commands);  // it has none
  CHECK(warned("revolute", "lower='1' upper='-1' effort='1' velocity='1'") ==
        at + "the lower limit 1 is above the upper one -1; the joint takes no commands");
  CHECK_FALSE(joint("revolute", "lower='1' upper='-1' effort='1' velocity='1'").takes_commands);
  CHECK_FALSE(joint("revolute", "lower='1' upper='-1' effort='1' velocity='1'").limits->upper);
  CHECK_FALSE(joint("prismatic", "lower='1' effort='1' velocity='1'").takes_commands);                // the upper limit is 0 by default
  CHECK(joint("revolute", "lower='1.0000000001' upper='1' effort='1' velocity='1'").takes_commands);  // by rounding
  CHECK(joint("continuous", "lower='1' upper='-1' effort='1' velocity='1'").takes_commands);
  CHECK(joint("revolute", "lower='-1' upper='1' effort='1' velocity='1'").takes_commands);
  CHECK(warned("revolute", "lower='-1' upper='1' effort='many' velocity='1 m'") ==
        at + "expected a number as effort, found \"many\"; taken as unlimited\n" + at +
            "expected a number as velocity, found \"1 m\"; taken as unlimited");
  CHECK(joint("revolute", "lower='-1' upper='1' effort='many' velocity='1'").takes_commands);
  CHECK_FALSE(joint("revolute", "lower='-1' upper='1' effort='many' velocity='1'").limits->effort);
}

TEST_CASE("a quaternion turns as roll, pitch and yaw do, from version 1.1 on", "[urdf]") {
  const auto with = [](const std::string& origin, const std::string& version) {
    std::string text = two_links("fixed", "<origin xyz='1 2 3' " + origin + "/>");
    return text.replace(text.find(" name"), 0, " version='" + version + "'");
  };
  for (const std::array<double, 4> q : {std::array<double, 4>{0, 0, 0, 1},
                                        {0.5, -0.5, 0.5, 0.5},
                                        {0, std::sqrt(0.5), 0, std::sqrt(0.5)},
                                        {0.1, 0.7, -0.1, 0.7},
                                        {1, 0, 0, 0},
                                        {0.18257418583505536, 0.3651483716701107, 0.5477225575051661, 0.7302967433402214}}) {
    CAPTURE(q);
    std::string text;
    for (const double part : q) text += std::to_string(part * 2) + ' ';  // of any length
    const urdf::Pose pose = urdf::parse(with("quat_xyzw='" + text + "'", "1.1")).value().joints[0].origin;
    double cosine = 0;
    for (std::size_t i = 0; i < 4; ++i) cosine += q[i] * pose.orientation[i];
    CHECK(std::abs(cosine) == Approx(1).margin(1e-11));
    CHECK(pose.position == std::array<double, 3>{1, 2, 3});
  }
  CHECK(warnings(with("quat_xyzw='1 0 0 0'", "1.0")) == "origin of joint \"j\" (line 5): quat_xyzw needs version 1.1 of <robot>; left out");
  const std::string at = "origin of joint \"j\" (line 5): ";
  CHECK(refusal(with("quat_xyzw='0 0 0 0'", "1.2")) == at + "expected either rpy or quat_xyzw with a length above 0, found \"0 0 0 0\"");
  CHECK(refusal(with("quat_xyzw='0 0 0 1' rpy='0 0 0'", "1.1")).find(at + "expected either rpy or quat_xyzw") == 0);
  CHECK(refusal(with("quat_xyzw='0 0 1'", "1.1")) == at + "expected 4 numbers as quat_xyzw, found \"0 0 1\"");
}

TEST_CASE("common variants of XML are read", "[urdf]") {
  const std::string robot = "<robot name='r'><link name='a'/></robot>";
  for (const std::string& text :
       {"<?xml version='0.0' ?>" + robot, "\n<?xml version='1.0'?>\n" + robot, "<!-- licence -->\n<?xml version='1.0'?>" + robot,
        "<?xml version='1.1' encoding='utf-8' standalone='no'?><?model x?>" + robot + "\n<!-- end -->\n",
        "\xEF\xBB\xBF<?xml version=\"1.0\"?>\r\n" + robot + "\r\n", "<!DOCTYPE robot>" + robot,
        std::string("<robot name='r'><?editor a='>' ?><link name='a'><!-- a -- b ---></link></robot>")}) {
    CAPTURE(text);
    CHECK(refusal(text) == "");
    CHECK(warnings(text) == "");
  }
  CHECK(refusal("<?xml version='1.0'?>\n<robot name='r'>\n<?a\n?>\n<link/></robot>") == "link (line 5): expected an attribute name");
  // Bytes that are not UTF-8: by the document's encoding, or with a warning.
  CHECK(warnings("<robot name='r'>\n<!-- pi\xE8"
                 "ce --><link name='\xC3\xA9'/></robot>") == "line 2: expected UTF-8; read as ISO-8859-1");
  CHECK(urdf::parse("<robot name='r'><!-- \xE8 --><link name='\xC3\xA9'/></robot>").value().links[0].name == "\xC3\xA9");
  CHECK(warnings("<?xml version='1.0' encoding=\"iso-8859-1\"?><robot name='r'><link name='\xE8'/></robot>") == "");
  CHECK(urdf::parse("<?xml version='1.0' encoding=\"ISO-8859-1\"?><robot name='r'><link name='\xC3\xA9'/></robot>").value().links[0].name ==
        "\xC3\x83\xC2\xA9");
}

TEST_CASE("foreign elements are ignored", "[urdf]") {
  const std::string text =
      "<robot name='r' version='1.2' xmlns='http://drake.mit.edu' xmlns:xacro='http://ros.org/wiki/xacro' xmlns:drake='d'>"
      "<link name='a' concave='yes'><contact><lateral_friction value='1'/></contact><sensor name='s'/>words"
      "<self_collision_checking><origin/><geometry><capsule radius='x'/></geometry></self_collision_checking></link><link name='b'/>"
      "<joint name='j' type='continuous'><parent link='a'/><child link='b'/><axis rpy='0 0 0' xyz='0 1 0'/><calibration rising='x'/>"
      "<joint_properties damping='0'/><limit effort='1' velocity='1' acceleration='2' jerk='x'/></joint>"
      "<transmission name='t'><joint name='j'><hardwareInterface/></joint><joint name='none'/></transmission>"
      "<ros2_control name='c' type='system'><joint name='j'/></ros2_control><loop_joint name='l' type='x'><link1 link='none'/></loop_joint>"
      "<drake:collision_filter_group name='g'><drake:member link='none'/></drake:collision_filter_group>"
      "<frame name='f' link='a'/><gazebo reference='a'><link name='b'/><joint name='j'/></gazebo></robot>";
  const urdf::Model m = urdf::parse(text).value();
  CHECK(m.warnings.empty());
  CHECK(m.links.size() == 2);
  REQUIRE(m.joints.size() == 1);
  CHECK(m.joints[0].axis == std::array<double, 3>{0, 1, 0});
}

TEST_CASE("errors of joints are reported", "[urdf]") {
  CHECK(refusal(two_links("continuous", "<axis xyz='0 0 0'/>")) ==
        "axis of joint \"j\" (line 5): expected an axis with a direction, found \"0 0 0\"");
  CHECK(refusal(two_links("fixed", "<origin xyz='0 0 x'/>")) == "origin of joint \"j\" (line 5): expected a number as xyz, found \"x\"");
  CHECK(refusal(two_links("continuous", "<mimic/>")) == "mimic of joint \"j\" (line 5): expected an attribute joint");
  CHECK(refusal(two_links("continuous", "<mimic joint='j'/>")).find("mimic of joint \"j\" (line 5): expected a chain of mimic joints that ends") ==
        0);
  CHECK(refusal(two_links("continuous", "<mimic joint='k'/>",
                          "<link name='c'/><joint name='k' type='continuous'><parent link='a'/><child link='c'/><mimic joint='j'/></joint>"))
            .find("expected a chain of mimic joints that ends") != std::string::npos);
  CHECK(warnings(two_links("continuous", "<safety_controller/>")) ==
        "safety_controller of joint \"j\" (line 5): expected an attribute k_velocity; the safety_controller is left out");
  CHECK(warnings(two_links("continuous", "<dynamics damping='x'/>")) ==
        "dynamics of joint \"j\" (line 5): expected a number as damping, found \"x\"; the dynamics is left out");
  CHECK(refusal("<robot name='r'><link name='a'/><joint name='j' type='fixed'><child link='a'/></joint></robot>") ==
        "joint \"j\" (line 1): expected an element <parent>");
  CHECK(refusal("<robot name='r'><link name='a'/><joint name='j' type='fixed'><parent link='x'/><child link='a'/></joint></robot>") ==
        "parent of joint \"j\" (line 1): expected a link of the document, found \"x\"");
  CHECK(refusal(two_links("fixed", "", "<link name='c'/><joint name='j' type='fixed'><parent link='a'/><child link='c'/></joint>")) ==
        "joint \"j\" (line 6): expected a unique name: it is the name of another joint in line 4");
}

TEST_CASE("a description that is not a tree is refused", "[urdf]") {
  CHECK(refusal(two_links("fixed", "", "<link name='c'/>")) ==
        "link \"c\" (line 6): expected to be the child of a joint: only the root link is not one, and the root link is link \"a\" (line 2)");
  CHECK(refusal(two_links("fixed", "", "<joint name='k' type='fixed'><parent link='a'/><child link='b'/></joint>")) ==
        "joint \"k\" (line 6): expected a link that is the child of one joint; \"b\" is also the child of joint \"j\" (line 4)");
  CHECK(refusal(two_links("fixed", "", "<joint name='k' type='fixed'><parent link='b'/><child link='a'/></joint>")).find("expected a tree") !=
        std::string::npos);
  CHECK(refusal("<robot name='r'><link name='a'/><joint name='j' type='fixed'><parent link='a'/><child link='a'/></joint></robot>") ==
        "joint \"j\" (line 1): expected a tree; the joints form a cycle through its child \"a\"");
  // A cycle beside a tree.
  CHECK(refusal(two_links("fixed", "",
                          "<link name='c'/><link name='d'/><joint name='k' type='fixed'><parent link='c'/><child link='d'/></joint>"
                          "<joint name='l' type='fixed'><parent link='d'/><child link='c'/></joint>"))
            .find("the joints form a cycle") != std::string::npos);
}

TEST_CASE("xacro that was not expanded is refused with a hint, unless values are given", "[urdf]") {
  CHECK(refusal("<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro'><!-- ${x} <xacro:y/> --><link name='a'/></robot>") == "");
  CHECK(refusal("<robot name='r'>\n<xacro:include filename='x'/></robot>") ==
        "xacro:include (line 2): expected a document that xacro has expanded, found <xacro:include>: run xacro first");
  CHECK(refusal("<robot name='r'>\n<xacro:arg name='p' default=''/></robot>") ==
        "xacro:arg \"p\" (line 2): expected a document that xacro has expanded, found <xacro:arg>: run xacro first, or give "
        "ParseOptions::arguments a value for the name");
  CHECK(refusal("<robot name='r'>\n<link name='${p}a'/></robot>") ==
        "link \"${p}a\" (line 2): expected a document that xacro has expanded, found \"${p}\": run xacro first, or give ParseOptions::arguments "
        "a value for \"p\"");
  CHECK(refusal("<robot name='r'>\n<link name='${2*p}a'/></robot>") ==
        "link \"${2*p}a\" (line 2): expected a document that xacro has expanded, found \"${2*p}\": run xacro first");
  CHECK(refusal("<robot name='r'><link name='${p'/></robot>") != "");
  CHECK(refusal("<robot name='r'><link name='a'/><gazebo>\n<t>${p}</t></gazebo></robot>") != "");
  urdf::ParseOptions options;
  options.arguments["p"] = "left_";
  const auto model = urdf::parse(
      "<robot name='r'><xacro:arg name='p' default=''/><xacro:property name='p' value='$(arg p)'/><link name='${p}a_${p}'/></robot>", options);
  CHECK(model.value().links[0].name == "left_a_left_");
  CHECK(refusal("<robot name='r'><xacro:if value='${p}'/><link name='a'/></robot>", options) != "");
}

TEST_CASE("limits are kept", "[urdf]") {
  urdf::ParseOptions options;
  options.max_bytes = 100;
  options.max_elements = 3;
  CHECK(refusal(std::string(101, ' '), options) == "expected at most 100 bytes, found 101");
  CHECK(refusal("<r><a/>\n<b/><c/></r>", options) == "line 2: expected at most 3 elements");
  CHECK(urdf::parse("<r><a/><b/><c/></r>", options).error().code == Errc::limit_exceeded);
  CHECK(refusal("<r><!-- <a/><b/><c/> --><![CDATA[<a/><b/>]]></r>", options) == "r (line 1): expected <robot> as the outermost element");
  std::string attributes = "<robot name='r=>'";
  for (int i = 0; i < 100'000; ++i) attributes += " a" + std::to_string(i) + "=''";
  CHECK(refusal(attributes + "/>") == "line 1: expected at most 256 attributes of one element");
  std::string deep;
  for (int i = 0; i < 50'000; ++i) deep += "<a>";
  CHECK(urdf::parse(deep).error().code == Errc::limit_exceeded);
  // A long chain uses no stack.
  std::string chain = "<robot name='r'><link name='l0'/>";
  for (int i = 1; i < 20'000; ++i) {
    const std::string n = std::to_string(i);
    chain += "<link name='l" + n + "'/><joint name='j" + n + "' type='fixed'><parent link='l" + std::to_string(i - 1) + "'/><child link='l" + n +
             "'/></joint>";
  }
  CHECK(urdf::parse(chain + "</robot>").value().joints.size() == 19'999);
}

TEST_CASE("entities of the document's own are not expanded but refused", "[urdf]") {
  CHECK(refusal("<!DOCTYPE robot>\n<robot name='r'><link name='&lol;'/></robot>").find("line 2: expected an entity of XML") == 0);
  CHECK(urdf::parse("<robot name='r'><link name='&lt;&amp;&#228;&quot;'/></robot>").value().links[0].name == "<&\xC3\xA4\"");
}

TEST_CASE("irregular elements are accepted with a warning", "[urdf]") {
  const auto model = urdf::parse(two_links("revolute", "<limit lower='1' upper='-1' velocity='1' effort='1'/>\n<dynamics/>"));
  REQUIRE(model);
  CHECK(model->warnings ==
        std::vector<std::string>{"limit of joint \"j\" (line 5): the lower limit 1 is above the upper one -1; the joint takes no commands",
                                 "dynamics of joint \"j\" (line 6): has neither damping nor friction and is left out"});
  CHECK_FALSE(model->joints[0].limits->lower);
  CHECK_FALSE(model->joints[0].dynamics);
  const auto inertial = [](const std::string& mass, const std::string& moments) {
    return warnings_of_link("<inertial><mass value='" + mass + "'/><inertia " + moments + "/></inertial>");
  };
  const std::string products = "ixy='0' ixz='0' iyz='0' ";
  CHECK(inertial("1", products + "ixx='1' iyy='1' izz='5'") == "link \"a\" (line 2): the inertia is physically impossible");
  CHECK(inertial("0", products + "ixx='0' iyy='0' izz='0'") == "");
  CHECK(inertial("1", "ixx='1' ixy='0' ixz='0' iyy='1' izz='1'") == "inertia of link \"a\" (line 3): has no iyz; taken as 0");
  const std::string fixed = "<link name='c'/><joint name='k' type='fixed'><parent link='a'/><child link='c'/></joint>";
  CHECK(warnings(two_links("continuous", "<mimic joint='x'/>")) ==
        "mimic of joint \"j\" (line 5): there is no joint \"x\" in the document; left out");
  CHECK(warnings(two_links("continuous", "<mimic joint='k'/>", fixed)) ==
        "mimic of joint \"j\" (line 5): joint \"k\" is fixed and has no position; left out");
  CHECK(urdf::parse(two_links("continuous", "<mimic joint='k'/>", fixed)).value().variables == std::vector<std::size_t>{0});
}

TEST_CASE("numbers do not depend on the locale", "[urdf]") {
  const std::locale before;
  const char* const old = std::setlocale(LC_ALL, nullptr);
  const std::string old_name = old ? old : "C";
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
  };
  std::locale::global(std::locale(std::locale::classic(), new Comma));
  const auto model = urdf::parse(two_links("fixed", "<origin xyz='0.5 1e-3 1234.5'/>"));
  std::locale::global(before);
  std::setlocale(LC_ALL, old_name.c_str());
  REQUIRE(model);
  CHECK(model->joints[0].origin.position == std::array<double, 3>{0.5, 1e-3, 1234.5});
}

TEST_CASE("several threads may parse at the same time", "[urdf]") {
  const std::string text = text_of(picker_file);
  std::vector<std::thread> threads;
  std::array<std::size_t, 4> joints{};
  for (std::size_t& count : joints)
    threads.emplace_back([&text, &count] {
      for (int i = 0; i < 20; ++i) count += urdf::parse(text).value().joints.size();
    });
  for (std::thread& t : threads) t.join();
  for (const std::size_t count : joints) CHECK(count == 140);
}

TEST_CASE("a missing or endless file is an error", "[urdf]") {
  CHECK(urdf::load("/nowhere/robot.urdf").error().code == Errc::io_error);
  CHECK(urdf::load("/nowhere/robot.urdf").error().message == "/nowhere/robot.urdf: No such file or directory");
  CHECK(urdf::load("/").error().code == Errc::io_error);
  urdf::ParseOptions options;
  options.max_bytes = 1000;
  CHECK(urdf::load("/dev/zero", options).error().code == Errc::limit_exceeded);
  CHECK(urdf::load("/dev/null").error().message == "/dev/null: expected XML, found nothing");
}

TEST_CASE("revolute, continuous and prismatic joints have a position, others have not", "[urdf]") {
  const auto has_position = [](JointType type) {
    urdf::Joint joint;
    joint.type = type;
    return joint.has_position();
  };
  for (const JointType type : {JointType::revolute, JointType::continuous, JointType::prismatic}) CHECK(has_position(type));
  for (const JointType type : {JointType::fixed, JointType::floating, JointType::planar}) CHECK_FALSE(has_position(type));
  CHECK_FALSE(urdf::Joint().has_position());
  // Exactly those that are not mimics are variables of a model.
  for (const char* const type : {"revolute", "continuous", "prismatic", "fixed", "floating", "planar"}) {
    CAPTURE(type);
    const urdf::Model model = urdf::parse(two_links(type, limit)).value();
    CHECK(model.joints.at(0).has_position() == (model.variables == std::vector<std::size_t>{0}));
  }
}
