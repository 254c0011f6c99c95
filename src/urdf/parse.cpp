// SPDX-License-Identifier: Apache-2.0
#include <lrt/urdf.hpp>

#include <tinyxml2.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include <lrt/rdf/lexical.hpp>

#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/representable.hpp"

namespace lrt::urdf {
inline namespace v0 {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t max_attributes = 256;  // of one element; XML readers compare each pair
constexpr std::size_t max_mimics = 100;      // length of a chain of mimic joints
constexpr JointType all_types[] = {JointType::revolute, JointType::continuous, JointType::prismatic,
                                   JointType::fixed,    JointType::floating,   JointType::planar};
constexpr std::size_t max_name = 1000;  // bytes; an IRI contains two encoded names

// A number that is wrong by at most this is noise of rounding (lrt::urdf::parse).
constexpr double relative_noise = 1e-9;        // of the numbers that it belongs to
constexpr double noise_of_moments_m2 = 1e-12;  // of the mass: a radius of gyration of 1 um

/// Thrown to end the reading of a document or of a part of it; parse() converts it into a Result.
struct Refusal {
  Error error;
};

std::uint32_t line_of(std::string_view text, std::size_t offset) {
  return 1 + static_cast<std::uint32_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(offset), '\n'));
}

/// The text in UTF-8. A document that declares ISO-8859-1 is converted. In other documents a byte that is not UTF-8 is read as ISO-8859-1:
/// comments of real files contain such bytes.
std::string as_utf8(std::string_view text, const ParseOptions& options, std::vector<std::string>& warnings) {
  if (text.size() > options.max_bytes)
    throw Refusal{{Errc::limit_exceeded, "expected at most " + std::to_string(options.max_bytes) + " bytes, found " + std::to_string(text.size())}};
  if (text.substr(0, 2) == "\xFF\xFE" || text.substr(0, 2) == "\xFE\xFF") throw Refusal{{Errc::expected_value, "expected UTF-8, found UTF-16"}};
  const std::size_t end = text.find("?>");
  const std::string_view prolog = text.substr(0, end == std::string_view::npos ? 0 : end);
  const bool is_latin1 = prolog.find("8859-1\"") != std::string_view::npos || prolog.find("8859-1'") != std::string_view::npos;
  const auto is_other = [](char c) { return static_cast<unsigned char>(c) >= 0x80; };
  std::string out;
  for (bool warned = is_latin1;; warned = true) {
    const auto other = is_latin1 ? static_cast<std::size_t>(std::find_if(text.begin(), text.end(), is_other) - text.begin())
                                 : utf8::find_invalid(text).value_or(text.size());
    out += text.substr(0, other);
    if (other == text.size()) return out;
    if (!warned) warnings.push_back("line " + std::to_string(line_of(out, out.size())) + ": expected UTF-8; read as ISO-8859-1");
    const auto byte = static_cast<unsigned char>(text[other]);
    out += {static_cast<char>(0xC0U | (byte >> 6U)), static_cast<char>(0x80U | (byte & 0x3FU))};
    text.remove_prefix(other + 1);
  }
}

/// XML 1.0 4.1: whether a reference is a predefined entity or a numeric character reference.
bool is_reference(std::string_view name) {
  for (const std::string_view known : {"lt", "gt", "amp", "apos", "quot"})
    if (name == known) return true;
  if (name.substr(0, 1) != "#") return false;
  const bool hex = name.substr(1, 1) == "x";
  name.remove_prefix(hex ? 2 : 1);
  std::uint32_t code = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), code, hex ? 16 : 10);
  return error == std::errc() && end == name.data() + name.size() && code != 0 && code <= 0x10FFFF && (code < 0xD800 || code > 0xDFFF);
}

/// Checks what tinyxml2 does not: the number of elements and attributes, end tags after the document, references to unknown entities.
/// Replaces processing instructions by spaces: XML allows them everywhere, tinyxml2 only at the beginning.
void check_text(std::string& text, const ParseOptions& options) {
  const auto refuse = [&](Errc code, std::size_t at, std::string message) {
    const std::uint32_t line = line_of(text, at);
    throw Refusal{{code, "line " + std::to_string(line) + ": " + std::move(message), at, line}};
  };
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) refuse(Errc::expected_value, nul, "expected XML, found U+0000");

  const auto check_references = [&](std::size_t begin, std::size_t end) {
    const std::string_view part = std::string_view(text).substr(begin, end - begin);
    for (std::size_t at = 0; (at = part.find('&', at)) != std::string_view::npos;) {
      const std::size_t close = std::min(part.find_first_of(";&\"' ", at + 1), part.size());
      const std::string_view name = part.substr(at + 1, close - at - 1);
      if (close == part.size() || part[close] != ';' || !is_reference(name))
        refuse(Errc::expected_value, begin + at,
               "expected an entity of XML (lt, gt, amp, apos, quot) or a character by number, found " + lrt::quoted('&' + std::string(name)));
      at = close;
    }
  };
  std::size_t elements = 0, depth = 0, last = 0;
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string_view::npos;) {
    check_references(last, at);
    bool skipped = false;
    for (const auto& [begin, end] : {std::pair<std::string_view, std::string_view>{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}}) {
      if (text.compare(at, begin.size(), begin) != 0) continue;
      const std::size_t close = text.find(end, at + begin.size());
      if (close == std::string_view::npos) return;  // tinyxml2 reports this error
      if (begin == "<?")
        std::replace_if(
            text.begin() + static_cast<std::ptrdiff_t>(at), text.begin() + static_cast<std::ptrdiff_t>(close + end.size()),
            [](char c) { return c != '\n'; }, ' ');
      at = last = close + end.size();
      skipped = true;
      break;
    }
    if (skipped) continue;
    const std::size_t tag = at;
    const bool is_element = text.compare(at, 2, "<!") != 0;  // quotes have no meaning in other markup
    std::size_t attributes = 0;
    for (++at; at < text.size() && text[at] != '<' && text[at] != '>'; ++at) {
      if (text[at] == '=') ++attributes;
      if (is_element && (text[at] == '"' || text[at] == '\'')) at = std::min(text.find(text[at], at + 1), text.size() - 1);
    }
    last = at;
    if (is_element) check_references(tag, at);
    if (text.compare(tag, 2, "</") == 0) {
      if (depth == 0)
        refuse(Errc::expected_value, tag, "expected no end tag without an element, found " + lrt::quoted(text.substr(tag, at + 1 - tag)));
      --depth;
    } else if (++elements > options.max_elements) {
      refuse(Errc::limit_exceeded, tag, "expected at most " + std::to_string(options.max_elements) + " elements");
    } else if (is_element && !(at < text.size() && text[at] == '>' && text[at - 1] == '/')) {
      ++depth;
    }
    if (attributes > max_attributes)
      refuse(Errc::limit_exceeded, tag, "expected at most " + std::to_string(max_attributes) + " attributes of one element");
  }
  check_references(last, text.size());
}

/// Whether an inertia is physically possible: no principal moment is negative, and none exceeds the sum of the other two.
bool is_of_a_body(const Inertial& inertial) {
  const auto& [xx, xy, xz, yy, yz, zz] = inertial.inertia;
  Eigen::Matrix3d tensor;
  tensor << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  const double scale = tensor.cwiseAbs().maxCoeff();
  if (!(scale > 0)) return true;
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor / scale, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double rounded = 1e-3;  // documents contain few digits
  return moments[0] >= -rounded && moments[2] <= moments[0] + moments[1] + rounded;
}

class Reader {
 public:
  Reader(const ParseOptions& options, Model& model) : options_(options), model_(model) {}

  void read(const XMLElement& robot) {
    check_xacro(robot);
    if (std::string_view(robot.Name()) != "robot") refuse(robot, "expected <robot> as the outermost element");
    model_.name = name_of(robot, true);
    if (const auto version = attribute(robot, "version"); version && *version != "1.0" && *version != "1") {
      if (*version != "1.1" && *version != "1.2") refuse(robot, "expected version 1.0, 1.1 or 1.2, found " + lrt::quoted(*version));
      has_quaternions_ = true;
    }
    collect_materials(robot);
    for (const XMLElement* e = robot.FirstChildElement("link"); e; e = e->NextSiblingElement("link")) link(*e);
    for (const XMLElement* e = robot.FirstChildElement("joint"); e; e = e->NextSiblingElement("joint"))
      types_.emplace(attribute(*e, "name").value_or(""), attribute(*e, "type").value_or(""));
    for (const XMLElement* e = robot.FirstChildElement("joint"); e; e = e->NextSiblingElement("joint")) joint(*e);
    if (links_.empty()) refuse(robot, "expected at least one link");
    connect();
    follow_mimics();
    for (std::size_t j = 0; j < model_.joints.size(); ++j)
      if (model_.joints[j].has_position() && !model_.joints[j].mimic) model_.variables.push_back(j);
    for (const Link& link : model_.links)
      if (link.inertial && !is_of_a_body(*link.inertial))
        model_.warnings.push_back("link \"" + link.name + "\" (line " + std::to_string(link.line) + "): the inertia is physically impossible");
  }

 private:
  struct Defined {
    int line;
    Material material;
  };

  // --- messages

  /// `joint "a"`, `limit of joint "a"`
  std::string described(const XMLElement& e) const {
    const XMLElement* whole = &e;  // the link, joint or material that contains it
    while (whole->Parent() && whole->Parent()->ToElement() && whole->Parent()->Parent() && whole->Parent()->Parent()->ToElement())
      whole = whole->Parent()->ToElement();
    std::string text = shortened(whole->Name());
    if (const char* name = whole->Attribute("name")) text += ' ' + lrt::quoted(name);
    return whole == &e ? text : shortened(e.Name()) + " of " + text;
  }
  std::string with_line(const XMLElement& e) const { return described(e) + " (line " + std::to_string(e.GetLineNum()) + ')'; }
  [[noreturn]] void refuse(const XMLElement& e, const std::string& sentence, Errc code = Errc::expected_value) const {
    throw Refusal{{code, with_line(e) + ": " + sentence, std::nullopt, static_cast<std::uint32_t>(e.GetLineNum())}};
  }
  void warn(const XMLElement& e, const std::string& sentence) { model_.warnings.push_back(with_line(e) + ": " + sentence); }

  /// Reads a part that the robot can do without. If it is irregular, it is left out with a warning.
  template <class Read>
  void if_right(const XMLElement& part, Read read) {
    try {
      read(part);
    } catch (const Refusal& refusal) { model_.warnings.push_back(refusal.error.message + "; the " + part.Name() + " is left out"); }
  }

  // --- xacro

  /// Replaces each `${name}` and `$(arg name)` by its value from the options.
  std::string expanded(const XMLElement& e, std::string_view text) const {
    std::string out;
    while (true) {
      const std::size_t open = text.find('$');
      out += text.substr(0, open);
      if (open == std::string_view::npos) return out;
      const bool is_arg = text.substr(open, 6) == "$(arg ";
      if (!is_arg && text.substr(open, 2) != "${") {
        out += '$';
        text.remove_prefix(open + 1);
        continue;
      }
      const std::size_t begin = open + (is_arg ? 6 : 2), close = std::min(text.find(is_arg ? ')' : '}', open), text.size());
      const std::string name(text.substr(begin, close - begin));
      const auto value = options_.arguments.find(name);
      if (value == options_.arguments.end() || close == text.size()) {
        const bool plain =
            !name.empty() && name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") == std::string::npos;
        refuse(e, "expected a document that xacro has expanded, found " + lrt::quoted(text.substr(open, close - open + 1)) + ": run xacro first" +
                      (plain ? ", or give ParseOptions::arguments a value for " + lrt::quoted(name) : std::string()));
      }
      out += value->second;
      text.remove_prefix(close + 1);
    }
  }
  bool is_given(const XMLElement& e) const {
    const std::string_view kind = e.Name();
    const char* name = e.Attribute("name");
    return (kind == "xacro:arg" || kind == "xacro:property") && name && options_.arguments.count(name) != 0;
  }
  void check_xacro(const XMLElement& e) const {
    const std::string_view name = e.Name();
    if (name.substr(0, 6) == "xacro:") {
      if (is_given(e)) return;
      refuse(e, "expected a document that xacro has expanded, found <" + shortened(name) + ">: run xacro first" +
                    (name == "xacro:arg" || name == "xacro:property" ? ", or give ParseOptions::arguments a value for the name" : ""));
    }
    for (const auto* a = e.FirstAttribute(); a; a = a->Next()) expanded(e, a->Value());
    for (const auto* n = e.FirstChild(); n; n = n->NextSibling()) {
      if (const auto* text = n->ToText()) expanded(e, text->Value());
      if (const auto* child = n->ToElement()) check_xacro(*child);
    }
  }

  // --- attributes

  std::optional<std::string> attribute(const XMLElement& e, const char* name) const {
    const char* text = e.Attribute(name);
    if (!text) return std::nullopt;
    std::string value = expanded(e, text);
    for (char& c : value)  // XML 1.0 3.3.3
      if (c == '\t' || c == '\n' || c == '\r') c = ' ';
    if (utf8::find_invalid(value) || std::any_of(value.begin(), value.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }))
      refuse(e, "expected an attribute " + std::string(name) + " without control characters");
    return value;
  }
  std::string required(const XMLElement& e, const char* name) const {
    auto value = attribute(e, name);
    if (!value) refuse(e, "expected an attribute " + std::string(name));
    return *std::move(value);
  }
  std::string name_of(const XMLElement& e, bool may_be_empty = false) const {
    std::string name = required(e, "name");
    if (name.empty() && !may_be_empty) refuse(e, "expected a name, found an empty one");
    if (name.size() > max_name) refuse(e, "expected a name of at most " + std::to_string(max_name) + " bytes, found " + std::to_string(name.size()));
    return name;
  }
  double parsed(const XMLElement& e, const char* name, std::string_view text) const {
    const auto value = rdf::lexical::representable_double(text);
    if (!value || !std::isfinite(*value)) refuse(e, "expected a number as " + std::string(name) + ", found " + lrt::quoted(text));
    return *value;
  }
  template <std::size_t min, std::size_t max>
  void vector(const XMLElement& e, const char* name, std::string_view text, std::array<double, max>& values) const {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find_first_not_of(' ', at)) != std::string_view::npos;) {
      const std::size_t end = std::min(text.find(' ', at), text.size());
      const double value = parsed(e, name, text.substr(at, end - at));
      if (count < max) values[count] = value;
      ++count;
      at = end;
    }
    if (count < min || count > max) refuse(e, "expected " + std::to_string(max) + " numbers as " + name + ", found " + lrt::quoted(text));
  }
  static std::string trimmed(const std::string& text) {
    const std::size_t first = text.find_first_not_of(' ');
    return first == std::string::npos ? std::string() : text.substr(first, text.find_last_not_of(' ') - first + 1);
  }
  /// A number of an attribute. Without the attribute: nullopt.
  std::optional<double> number(const XMLElement& e, const char* name) const {
    const auto text = attribute(e, name);
    return text ? std::optional(parsed(e, name, trimmed(*text))) : std::nullopt;
  }
  double required_number(const XMLElement& e, const char* name) const { return parsed(e, name, trimmed(required(e, name))); }
  std::optional<std::array<double, 3>> vector3(const XMLElement& e, const char* name, bool needed = false) const {
    const auto text = needed ? required(e, name) : attribute(e, name);
    if (!text) return std::nullopt;
    std::array<double, 3> values{};
    vector<3>(e, name, *text, values);
    return values;
  }
  /// @param noise  a negative number above -noise is 0, with a warning
  double not_negative(const XMLElement& e, const char* name, double noise = 0) {
    const double value = required_number(e, name);
    if (value < 0 && value >= -noise) {
      warn(e, std::string(name) + " is " + rdf::lexical::format(value) + ", which is noise of rounding; taken as 0");
      return 0;
    }
    if (value < 0) refuse(e, "expected " + std::string(name) + " of at least 0, found " + rdf::lexical::format(value));
    return value;
  }

  // --- elements

  /// The quaternion of three turns about fixed axes: first x, then y, then z.
  static std::array<double, 4> quaternion(const std::array<double, 3>& rpy) {
    const auto& [roll, pitch, yaw] = rpy;
    const double sr = std::sin(roll / 2), cr = std::cos(roll / 2), sp = std::sin(pitch / 2), cp = std::cos(pitch / 2), sy = std::sin(yaw / 2),
                 cy = std::cos(yaw / 2);
    return {sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy};
  }
  static double length(const std::array<double, 4>& q) { return std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])); }
  Pose origin(const XMLElement& of) {
    Pose pose;
    const XMLElement* e = of.FirstChildElement("origin");
    if (!e) return pose;
    pose.position = vector3(*e, "xyz").value_or(pose.position);
    const auto rpy = vector3(*e, "rpy");
    if (rpy) pose.orientation = quaternion(*rpy);
    if (const auto text = attribute(*e, "quat_xyzw"); text && !has_quaternions_) {
      warn(*e, "quat_xyzw needs version 1.1 of <robot>; left out");
    } else if (text) {
      vector<4>(*e, "quat_xyzw", *text, pose.orientation);
      if (rpy || !(length(pose.orientation) > relative_noise) || !std::isfinite(length(pose.orientation)))
        refuse(*e, "expected either rpy or quat_xyzw with a length above 0, found " + lrt::quoted(*text));
    }
    const double norm = length(pose.orientation);
    for (double& q : pose.orientation) q /= norm;
    return pose;
  }
  void expect_once(const XMLElement& of, std::initializer_list<const char*> names) {
    for (const char* name : names)
      if (const XMLElement* first = of.FirstChildElement(name))
        if (const XMLElement* second = first->NextSiblingElement(name)) warn(*second, "is repeated; the first one is used");
  }
  const XMLElement& child(const XMLElement& of, const char* name) const {
    const XMLElement* e = of.FirstChildElement(name);
    if (!e) refuse(of, "expected an element <" + std::string(name) + '>');
    return *e;
  }

  static const XMLElement* texture(const XMLElement& material) {
    const XMLElement* e = material.FirstChildElement("texture");
    return e && e->Attribute("filename") && *e->Attribute("filename") ? e : nullptr;
  }
  static bool has_look(const XMLElement& material) { return material.FirstChildElement("color") || texture(material); }
  /// Red, green, blue and alpha; nullopt: there is no valid colour.
  std::optional<std::array<double, 4>> colour(const XMLElement& material) {
    const XMLElement* e = material.FirstChildElement("color");
    try {
      if (e) {
        std::array<double, 4> values{0, 0, 0, 1};
        vector<3>(*e, "rgba", required(*e, "rgba"), values);
        for (const double v : values)
          if (v < 0 || v > 1) refuse(*e, "expected an rgba of numbers from 0 to 1, found " + rdf::lexical::format(v));
        return values;
      }
    } catch (const Refusal& refusal) { model_.warnings.push_back(refusal.error.message + "; the color is left out"); }
    return std::nullopt;
  }
  Material define(const XMLElement& material, const std::string& name) {
    const XMLElement* const image = texture(material);
    return {name, colour(material), image ? required(*image, "filename") : std::string()};
  }
  /// Reads all materials before the links, so that a link may refer to a material that is defined later.
  void collect_materials(const XMLElement& robot) {
    for (const XMLElement* e = robot.FirstChildElement("material"); e; e = e->NextSiblingElement("material"))
      if_right(*e, [this](const XMLElement& material) {
        const std::string name = name_of(material);
        if (!has_look(material)) return;  // a reference to it causes a warning
        if (const auto first = materials_.find(name); first != materials_.end())
          refuse(material, "expected a unique name: it is the name of another material in line " + std::to_string(first->second.line));
        materials_.emplace(name, Defined{material.GetLineNum(), define(material, name)});
      });
    for (const XMLElement* l = robot.FirstChildElement("link"); l; l = l->NextSiblingElement("link"))
      for (const XMLElement* v = l->FirstChildElement("visual"); v; v = v->NextSiblingElement("visual"))
        if (const XMLElement* e = v->FirstChildElement("material"))
          if_right(*e, [this](const XMLElement& material) {
            const std::string name = attribute(material, "name").value_or("");
            if (!name.empty() && has_look(material) && materials_.count(name) == 0)
              materials_.emplace(name, Defined{material.GetLineNum(), define(material, name)});
          });
  }
  std::optional<Material> material(const XMLElement& e) {
    const std::string name = attribute(e, "name").value_or("");
    if (const auto known = materials_.find(name); known != materials_.end()) return known->second.material;
    if (name.empty()) return has_look(e) ? std::optional(define(e, name)) : std::nullopt;
    warn(e, lrt::quoted(name) + " has neither <color> nor <texture> anywhere in the document");
    return materials_.emplace(name, Defined{e.GetLineNum(), define(e, name)}).first->second.material;
  }

  void geometry(const XMLElement& of, Shape& to) {
    const XMLElement& e = child(of, "geometry");
    const XMLElement* shape = e.FirstChildElement();
    if (!shape) refuse(e, "expected one of the elements box, cylinder, sphere, capsule, mesh");
    const std::string_view kind = shape->Name();
    if (kind == "box") {
      to.kind = Shape::Kind::box;
      to.size = *vector3(*shape, "size", true);
      for (const double side : to.size)
        if (side < 0) refuse(*shape, "expected a size of at least 0, found " + rdf::lexical::format(side));
    } else if (kind == "cylinder" || kind == "capsule") {
      to.kind = kind == "capsule" ? Shape::Kind::capsule : Shape::Kind::cylinder;
      to.radius = not_negative(*shape, "radius");
      to.length = not_negative(*shape, "length");
    } else if (kind == "sphere") {
      to.kind = Shape::Kind::sphere;
      to.radius = not_negative(*shape, "radius");
    } else if (kind == "mesh") {
      to.kind = Shape::Kind::mesh;
      to.mesh = required(*shape, "filename");
      if (to.mesh.empty()) refuse(*shape, "expected a filename, found an empty one");
      to.scale = vector3(*shape, "scale").value_or(to.scale);
    } else {
      refuse(e, "expected one of the elements box, cylinder, sphere, capsule, mesh; found " + lrt::quoted(kind));
    }
  }
  Shape shape(const XMLElement& e) {
    Shape to;
    to.name = attribute(e, "name").value_or("");
    to.origin = origin(e);
    geometry(e, to);
    if (std::string_view(e.Name()) == "visual")
      if (const XMLElement* m = e.FirstChildElement("material")) if_right(*m, [&](const XMLElement& part) { to.material = material(part); });
    return to;
  }

  std::optional<Inertial> inertial(const XMLElement& e) {
    const XMLElement *mass = e.FirstChildElement("mass"), *inertia = e.FirstChildElement("inertia");
    if (!mass || !inertia) {
      warn(e, std::string("has no element <") + (mass ? "inertia" : "mass") + "> and is left out");
      return std::nullopt;
    }
    Inertial to;
    to.origin = origin(e);
    to.mass = not_negative(*mass, "value", relative_noise);
    double noise = noise_of_moments_m2 * to.mass;
    auto& [xx, xy, xz, yy, yz, zz] = to.inertia;
    const std::array<std::pair<const char*, double*>, 3> moments = {{{"ixx", &xx}, {"iyy", &yy}, {"izz", &zz}}};
    for (const auto& [name, value] : moments) noise = std::max(noise, relative_noise * required_number(*inertia, name));
    for (const auto& [name, value] : moments) *value = not_negative(*inertia, name, noise);
    for (const auto& [name, value] : {std::pair<const char*, double*>{"ixy", &xy}, {"ixz", &xz}, {"iyz", &yz}}) {
      const auto product = number(*inertia, name);
      if (!product) warn(*inertia, "has no " + std::string(name) + "; taken as 0");
      *value = product.value_or(0);
    }
    return to;
  }

  void link(const XMLElement& e) {
    Link to;
    to.name = name_of(e);
    to.line = static_cast<std::uint32_t>(e.GetLineNum());
    const auto [first, added] = links_.emplace(to.name, model_.links.size());
    if (!added) refuse(e, "expected a unique name: it is the name of another link in line " + std::to_string(model_.links[first->second].line));
    link_elements_.push_back(&e);
    expect_once(e, {"inertial"});
    if (const XMLElement* i = e.FirstChildElement("inertial")) to.inertial = inertial(*i);
    for (const auto& [kind, shapes] : {std::pair<const char*, std::vector<Shape>*>{"visual", &to.visuals}, {"collision", &to.collisions}})
      for (const XMLElement* s = e.FirstChildElement(kind); s; s = s->NextSiblingElement(kind))
        if_right(*s, [this, into = shapes](const XMLElement& part) { into->push_back(shape(part)); });
    model_.links.push_back(std::move(to));
  }

  void joint(const XMLElement& e) {
    Joint to;
    to.name = name_of(e);
    to.line = static_cast<std::uint32_t>(e.GetLineNum());
    const auto [first, added] = joints_.emplace(to.name, model_.joints.size());
    if (!added) refuse(e, "expected a unique name: it is the name of another joint in line " + std::to_string(model_.joints[first->second].line));
    to.type = type_of(e);
    expect_once(e, {"origin", "parent", "child", "axis", "limit", "dynamics", "safety_controller", "mimic"});
    to.origin = origin(e);
    for (const auto& [end, link] : {std::pair<const char*, std::size_t*>{"parent", &to.parent}, {"child", &to.child}}) {
      const XMLElement& at = child(e, end);
      const std::string name = required(at, "link");
      const auto found = links_.find(name);
      if (found == links_.end()) refuse(at, "expected a link of the document, found " + lrt::quoted(name));
      *link = found->second;
    }
    axis(e, to);
    limits(e, to);
    if (const XMLElement* d = e.FirstChildElement("dynamics")) if_right(*d, [&](const XMLElement& part) { to.dynamics = dynamics(part); });
    if (const XMLElement* s = e.FirstChildElement("safety_controller"))
      if_right(*s, [&](const XMLElement& part) {
        Safety safety;
        safety.soft_lower_limit = number(part, "soft_lower_limit").value_or(0);
        safety.soft_upper_limit = number(part, "soft_upper_limit").value_or(0);
        safety.k_position = number(part, "k_position").value_or(0);
        safety.k_velocity = required_number(part, "k_velocity");
        to.safety = safety;
      });
    if (const XMLElement* m = e.FirstChildElement("mimic")) to.mimic = mimic(*m, to);
    model_.joints.push_back(std::move(to));
    joint_elements_.push_back(&e);
  }
  JointType type_of(const XMLElement& joint) const {
    const std::string name = required(joint, "type");
    for (const JointType type : all_types)
      if (to_string(type) == name) return type;
    refuse(joint, "expected one of the types revolute, continuous, prismatic, fixed, floating, planar; found " + lrt::quoted(name));
  }
  void axis(const XMLElement& joint, Joint& to) const {
    const XMLElement* e = joint.FirstChildElement("axis");
    if (!e || to.type == JointType::fixed || to.type == JointType::floating || !e->Attribute("xyz")) return;
    to.axis = *vector3(*e, "xyz");
    const double length = std::hypot(to.axis[0], to.axis[1], to.axis[2]);
    if (!(length > relative_noise) || !std::isfinite(length))
      refuse(*e, "expected an axis with a direction, found " + lrt::quoted(e->Attribute("xyz")));
    for (double& part : to.axis) part /= length;
  }
  /// A limit; nullopt: the attribute is missing or infinite.
  std::optional<double> limit(const XMLElement& e, const char* name) const {
    const auto text = attribute(e, name);
    if (!text) return std::nullopt;
    std::string word = trimmed(*text);
    if (!word.empty() && (word[0] == '-' || word[0] == '+')) word.erase(0, 1);
    for (const char* endless : {"inf", "Inf", "INF", "infinity", "Infinity"})
      if (word == endless) return std::nullopt;
    return parsed(e, name, trimmed(*text));
  }
  /// As limit(). A limit that is not a number has no value either, with a warning.
  /// @param else_  what follows from that
  /// @return  whether it could be read
  bool limit_if_right(const XMLElement& e, const char* name, std::optional<double>& value, const char* else_) {
    try {
      value = limit(e, name);
      return true;
    } catch (const Refusal& refusal) { model_.warnings.push_back(refusal.error.message + "; " + else_); }
    return false;
  }
  void limits(const XMLElement& joint, Joint& to) {
    const bool bounded = to.type == JointType::revolute || to.type == JointType::prismatic;
    const XMLElement* e = joint.FirstChildElement("limit");
    if (!e) {
      if (bounded) warn(joint, "expected an element <limit>, which " + std::string(to_string(to.type)) + " joints need; taken as unlimited");
      return;
    }
    Limits limits;
    for (const auto& [name, value] : {std::pair<const char*, std::optional<double>*>{"lower", &limits.lower}, {"upper", &limits.upper}})
      if (bounded && !limit_if_right(*e, name, *value, "the joint takes no commands")) to.takes_commands = false;
    for (const auto& [name, value] : {std::pair<const char*, std::optional<double>*>{"effort", &limits.effort}, {"velocity", &limits.velocity}})
      (void)limit_if_right(*e, name, *value, "taken as unlimited");
    const bool has_lower = e->Attribute("lower"), has_upper = e->Attribute("upper");
    if (bounded && !has_lower && !has_upper) {
      warn(*e, "has neither lower nor upper; the position is taken as unlimited");
    } else if (bounded) {
      if (!has_lower) limits.lower = 0;  // the default of URDF
      if (!has_upper) limits.upper = 0;
      if (limits.lower && limits.upper && *limits.lower > *limits.upper &&
          *limits.lower - *limits.upper <= relative_noise * std::max(1.0, std::abs(*limits.lower)))
        limits.lower = limits.upper;  // by rounding
      if (limits.lower && limits.lower == limits.upper)
        warn(*e, "lower and upper are both " + rdf::lexical::format(*limits.lower) + ": the joint cannot move");
      if (limits.lower && limits.upper && *limits.lower > *limits.upper) {
        warn(*e, "the lower limit " + rdf::lexical::format(*limits.lower) + " is above the upper one " + rdf::lexical::format(*limits.upper) +
                     "; the joint takes no commands");
        limits.lower = limits.upper = std::nullopt;
        to.takes_commands = false;
      }
    }
    for (const auto& [name, value] : {std::pair<const char*, std::optional<double>*>{"effort", &limits.effort}, {"velocity", &limits.velocity}}) {
      if (to.type != JointType::fixed && !e->Attribute(name)) warn(*e, "has no " + std::string(name) + "; taken as unlimited");
      if (value->value_or(0) >= 0) continue;
      if (**value >= -relative_noise) {
        warn(*e, std::string(name) + " is " + rdf::lexical::format(**value) + ", which is noise of rounding; taken as 0");
        *value = 0;
        continue;
      }
      warn(*e, "expected " + std::string(name) + " of at least 0, found " + rdf::lexical::format(**value) + "; taken as unlimited");
      value->reset();
    }
    if (limits.lower || limits.upper || limits.velocity || limits.effort) to.limits = limits;
  }
  std::optional<Dynamics> dynamics(const XMLElement& e) {
    if (!e.Attribute("damping") && !e.Attribute("friction")) {
      warn(e, "has neither damping nor friction and is left out");
      return std::nullopt;
    }
    return Dynamics{number(e, "damping").value_or(0), number(e, "friction").value_or(0)};
  }
  static bool has_position(std::string_view type) { return type == "revolute" || type == "continuous" || type == "prismatic"; }
  /// Without the joint that it follows, which may come later in the document.
  std::optional<Mimic> mimic(const XMLElement& e, const Joint& of) {
    const auto left_out = [&](const std::string& why) {
      warn(e, why + "; left out");
      return std::nullopt;
    };
    if (!of.has_position()) return left_out("a " + std::string(to_string(of.type)) + " joint cannot mimic another joint");
    const std::string name = required(e, "joint");
    const auto found = types_.find(name);
    if (found == types_.end()) return left_out("there is no joint " + lrt::quoted(name) + " in the document");
    if (!has_position(found->second)) return left_out("joint " + lrt::quoted(name) + " is " + found->second + " and has no position");
    mimics_.emplace_back(&e, model_.joints.size());
    return Mimic{0, number(e, "multiplier").value_or(1), number(e, "offset").value_or(0)};
  }

  // --- the whole document

  /// Checks that the joints make a tree, and tells the links their joints.
  void connect() {
    constexpr std::size_t none = static_cast<std::size_t>(-1);
    std::vector<std::size_t> before(links_.size(), none);  // the joint whose child it is
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      std::size_t& joint = before[model_.joints[j].child];
      if (joint != none)
        refuse(*joint_elements_[j], "expected a link that is the child of one joint; " + lrt::quoted(model_.links[model_.joints[j].child].name) +
                                        " is also the child of " + with_line(*joint_elements_[joint]));
      joint = j;
      model_.links[model_.joints[j].child].joint = j;
    }
    // Each link is the child of at most one joint. Following the parents ends at a root or in a cycle.
    enum : char { unknown, on_the_way, good };
    std::vector<char> seen(links_.size(), unknown);
    std::vector<std::size_t> way;
    for (std::size_t start = 0; start < seen.size(); ++start) {
      std::size_t at = start;
      way.clear();
      while (seen[at] == unknown) {
        seen[at] = on_the_way;
        way.push_back(at);
        if (before[at] == none) break;
        at = model_.joints[before[at]].parent;
        if (seen[at] == on_the_way)
          refuse(*joint_elements_[before[at]], "expected a tree; the joints form a cycle through its child " + lrt::quoted(model_.links[at].name));
      }
      for (const std::size_t l : way) seen[l] = good;
    }
    std::size_t root = none;
    for (std::size_t l = 0; l < before.size(); ++l) {
      if (before[l] != none) continue;
      if (root != none)
        refuse(*link_elements_[l],
               "expected to be the child of a joint: only the root link is not one, and the root link is " + with_line(*link_elements_[root]));
      root = l;
    }
    model_.root = root;
  }
  void follow_mimics() {
    std::unordered_map<std::size_t, std::size_t> of;
    for (const auto& [e, joint] : mimics_) of.emplace(joint, model_.joints[joint].mimic->joint = joints_.at(required(*e, "joint")));
    for (const auto& [e, joint] : mimics_) {
      std::size_t steps = 0;
      for (auto at = of.find(joint); at != of.end(); at = of.find(at->second))
        if (++steps > max_mimics)
          refuse(*e, "expected a chain of mimic joints that ends at a joint without <mimic>; it does not end within " + std::to_string(max_mimics) +
                         " steps");
    }
  }

  const ParseOptions& options_;
  Model& model_;
  bool has_quaternions_ = false;
  std::unordered_map<std::string, std::string> types_;           // of joints, by name
  std::unordered_map<std::string, Defined> materials_;           // by name
  std::unordered_map<std::string, std::size_t> links_, joints_;  // name, index
  std::vector<const XMLElement*> link_elements_, joint_elements_;
  std::vector<std::pair<const XMLElement*, std::size_t>> mimics_;  // element, index of its joint
};

/// Describes an error of tinyxml2.
Error no_xml(const tinyxml2::XMLDocument& xml) {
  const auto line = static_cast<std::uint32_t>(std::max(0, xml.ErrorLineNum()));
  const std::string_view message = xml.ErrorStr() ? xml.ErrorStr() : "";
  constexpr std::string_view before_name = "XMLElement name=";
  const std::size_t at = message.find(before_name);
  const std::string element = at == std::string_view::npos ? "an element" : '<' + shortened(message.substr(at + before_name.size())) + '>';
  std::string found;
  switch (xml.ErrorID()) {
    case tinyxml2::XML_ERROR_EMPTY_DOCUMENT: return {Errc::expected_value, "expected XML, found nothing"};
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT: found = element + " and a wrong end tag or none"; break;
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE: found = element + " with an attribute that is not quoted, not terminated or repeated"; break;
    case tinyxml2::XML_ERROR_PARSING_ELEMENT: found = "an unterminated tag"; break;
    case tinyxml2::XML_ERROR_PARSING_TEXT: found = "text outside an element, or unterminated text"; break;
    case tinyxml2::XML_ERROR_PARSING_COMMENT: found = "an unterminated comment"; break;
    case tinyxml2::XML_ERROR_PARSING_CDATA: found = "an unterminated CDATA section"; break;
    case tinyxml2::XML_ERROR_PARSING_DECLARATION: found = "a declaration that is unterminated or not at the beginning"; break;
    case tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED:
      return {Errc::limit_exceeded, "line " + std::to_string(line) + ": expected elements nested less deeply", std::nullopt, line};
    default: found = "text that is not XML"; break;
  }
  return {Errc::expected_value, "line " + std::to_string(line) + ": expected XML, found " + found, std::nullopt, line};
}

}  // namespace

std::string_view to_string(JointType type) noexcept {
  constexpr std::string_view names[] = {"revolute", "continuous", "prismatic", "fixed", "floating", "planar"};
  return names[static_cast<std::size_t>(type)];
}

Result<Model> parse(std::string_view text, const ParseOptions& options) {
  try {
    Model model;
    std::string utf8 = as_utf8(text, options, model.warnings);
    check_text(utf8, options);
    tinyxml2::XMLDocument xml;
    if (xml.Parse(utf8.data(), utf8.size()) != tinyxml2::XML_SUCCESS) return unexpected(no_xml(xml));
    const XMLElement* robot = xml.RootElement();
    if (!robot) return unexpected(Errc::expected_value, "expected <robot>, found no element");
    if (const XMLElement* second = robot->NextSiblingElement()) {
      const auto line = static_cast<std::uint32_t>(second->GetLineNum());
      return unexpected(Error{Errc::expected_value,
                              "line " + std::to_string(line) + ": expected one outermost element, found <" + shortened(second->Name()) + "> after it",
                              std::nullopt, line});
    }
    Reader(options, model).read(*robot);
    return model;
  } catch (Refusal& refusal) { return unexpected(std::move(refusal.error)); }
}

}  // namespace v0
}  // namespace lrt::urdf
