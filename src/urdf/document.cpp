// SPDX-License-Identifier: Apache-2.0
#include "src/urdf/document.hpp"

#include <tinyxml2.h>

#include <Eigen/Geometry>

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

#include "src/base/utf8.hpp"

namespace lrt::urdf {
inline namespace v0 {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t max_attributes = 256;  // of one element; XML readers compare each pair
constexpr std::size_t max_mimics = 100;      // length of a chain of mimic joints
constexpr std::size_t max_name = 1000;       // bytes; an IRI contains two encoded names

// A number that is wrong by at most this is noise of rounding (lrt::urdf::parse).
constexpr double relative_noise = 1e-9;        // of the numbers that it belongs to
constexpr double noise_of_moments_m2 = 1e-12;  // of the mass: a radius of gyration of 1 um

/// Thrown to end the reading of a document; check() converts it into a Result.
struct Refusal {
  Error error;
};

/// A text of the document, quoted for a message.
std::string shortened(std::string_view text) {
  constexpr std::size_t max_bytes = 80;
  const std::string_view begin = utf8::prefix(text, max_bytes);
  return std::string(begin) + (begin.size() < text.size() ? "..." : "");
}
std::string quoted(std::string_view text) { return '"' + shortened(text) + '"'; }

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
               "expected an entity of XML (lt, gt, amp, apos, quot) or a character by number, found " + quoted('&' + std::string(name)));
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
      if (depth == 0) refuse(Errc::expected_value, tag, "expected no end tag without an element, found " + quoted(text.substr(tag, at + 1 - tag)));
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

class Checker {
 public:
  Checker(const ParseOptions& options, Document& document) : options_(options), document_(document) {}

  void check(const XMLElement& robot) {
    check_xacro(robot);
    if (std::string_view(robot.Name()) != "robot") refuse(robot, "expected <robot> as the outermost element");
    const std::string name = name_of(robot, true);
    if (const auto version = attribute(robot, "version"); version && *version != "1.0" && *version != "1") {
      if (*version != "1.1" && *version != "1.2") refuse(robot, "expected version 1.0, 1.1 or 1.2, found " + quoted(*version));
      has_quaternions_ = true;
    }
    open("robot");
    put("name", name.c_str());
    collect_materials(robot);
    for (const XMLElement* e = robot.FirstChildElement("link"); e; e = e->NextSiblingElement("link")) link(*e);
    for (const XMLElement* e = robot.FirstChildElement("joint"); e; e = e->NextSiblingElement("joint"))
      types_.emplace(attribute(*e, "name").value_or(""), attribute(*e, "type").value_or(""));
    for (const XMLElement* e = robot.FirstChildElement("joint"); e; e = e->NextSiblingElement("joint")) joint(*e);
    if (links_.empty()) refuse(robot, "expected at least one link");
    check_tree();
    check_mimics();
    tinyxml2::XMLPrinter printer(nullptr, true);
    out_.Print(&printer);
    document_.text.assign(printer.CStr(), static_cast<std::size_t>(printer.CStrSize()) - 1);
  }

 private:
  struct Ends {
    const XMLElement* element;
    std::string parent, child;
  };
  using Colour = std::array<double, 4>;
  struct Defined {
    int line;
    std::optional<Colour> colour;
  };

  // --- messages

  /// `joint "a"`, `limit of joint "a"`
  std::string described(const XMLElement& e) const {
    const XMLElement* whole = &e;  // the link, joint or material that contains it
    while (whole->Parent() && whole->Parent()->ToElement() && whole->Parent()->Parent() && whole->Parent()->Parent()->ToElement())
      whole = whole->Parent()->ToElement();
    std::string text = shortened(whole->Name());
    if (const char* name = whole->Attribute("name")) text += ' ' + quoted(name);
    return whole == &e ? text : shortened(e.Name()) + " of " + text;
  }
  std::string with_line(const XMLElement& e) const { return described(e) + " (line " + std::to_string(e.GetLineNum()) + ')'; }
  [[noreturn]] void refuse(const XMLElement& e, const std::string& sentence, Errc code = Errc::expected_value) const {
    throw Refusal{{code, with_line(e) + ": " + sentence, std::nullopt, static_cast<std::uint32_t>(e.GetLineNum())}};
  }
  void warn(const XMLElement& e, const std::string& sentence) { document_.warnings.push_back(with_line(e) + ": " + sentence); }

  // --- output

  void open(const char* name) {
    XMLElement* const e = out_.NewElement(name);
    at_->InsertEndChild(e);
    at_ = e;
  }
  void put(const char* name, const char* value) { at_->ToElement()->SetAttribute(name, value); }
  void close() { at_ = at_->Parent(); }
  /// Writes a part of a link that is not needed for its pose. If it is not valid, it is left out with a warning.
  void shape_if_right(const XMLElement& part) {
    tinyxml2::XMLNode* const whole = at_;
    tinyxml2::XMLNode* const last = whole->LastChild();
    const std::size_t shapes = document_.shapes.size();
    try {
      shape(part);
    } catch (const Refusal& refusal) {
      at_ = whole;
      if (whole->LastChild() != last) whole->DeleteChild(whole->LastChild());
      document_.shapes.resize(shapes);
      document_.warnings.push_back(refusal.error.message + "; the " + part.Name() + " is left out");
    }
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
        refuse(e, "expected a document that xacro has expanded, found " + quoted(text.substr(open, close - open + 1)) + ": run xacro first" +
                      (plain ? ", or give ParseOptions::arguments a value for " + quoted(name) : std::string()));
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
    const auto value = rdf::lexical::is_double(text) ? rdf::lexical::parse_double(text) : std::nullopt;
    if (!value || !std::isfinite(*value)) refuse(e, "expected a number as " + std::string(name) + ", found " + quoted(text));
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
    if (count < min || count > max) refuse(e, "expected " + std::to_string(max) + " numbers as " + name + ", found " + quoted(text));
  }
  template <std::size_t count>
  static std::string joined(const std::array<double, count>& numbers) {
    std::string out;
    for (const double n : numbers) out += (out.empty() ? "" : " ") + rdf::lexical::format(n);
    return out;
  }
  static std::string trimmed(const std::string& text) {
    const std::size_t first = text.find_first_not_of(' ');
    return first == std::string::npos ? std::string() : text.substr(first, text.find_last_not_of(' ') - first + 1);
  }
  /// Reads a number from an attribute and writes it to the output. Without the attribute: nullopt or an error.
  std::optional<double> number(const XMLElement& e, const char* name, bool needed) {
    const auto text = needed ? required(e, name) : attribute(e, name);
    if (!text) return std::nullopt;
    const double value = parsed(e, name, trimmed(*text));
    put(name, rdf::lexical::format(value).c_str());
    return value;
  }
  std::optional<std::array<double, 3>> vector3(const XMLElement& e, const char* name, bool needed = false) {
    const auto text = needed ? required(e, name) : attribute(e, name);
    if (!text) return std::nullopt;
    std::array<double, 3> values{};
    vector<3>(e, name, *text, values);
    put(name, joined(values).c_str());
    return values;
  }
  /// @param noise  a negative number above -noise is 0, with a warning
  double not_negative(const XMLElement& e, const char* name, double noise = 0) {
    const double value = *number(e, name, true);
    if (value < 0 && value >= -noise) {
      warn(e, std::string(name) + " is " + rdf::lexical::format(value) + ", which is noise of rounding; taken as 0");
      put(name, "0");
      return 0;
    }
    if (value < 0) refuse(e, "expected " + std::string(name) + " of at least 0, found " + rdf::lexical::format(value));
    return value;
  }

  // --- elements

  void origin(const XMLElement& of) {
    const XMLElement* e = of.FirstChildElement("origin");
    if (!e) return;
    open("origin");
    vector3(*e, "xyz");
    const bool turned = vector3(*e, "rpy").has_value();
    if (const auto text = attribute(*e, "quat_xyzw"); text && !has_quaternions_) {
      warn(*e, "quat_xyzw needs version 1.1 of <robot>; left out");
    } else if (text) {
      Eigen::Quaternion<double, Eigen::DontAlign> q;
      std::array<double, 4> values{};
      vector<4>(*e, "quat_xyzw", *text, values);
      q.coeffs() << values[0], values[1], values[2], values[3];
      if (turned || !(q.norm() > relative_noise) || !std::isfinite(q.norm()))
        refuse(*e, "expected either rpy or quat_xyzw with a length above 0, found " + quoted(*text));
      const Eigen::Vector3d ypr = q.normalized().toRotationMatrix().eulerAngles(2, 1, 0);
      put("rpy", joined(std::array<double, 3>{ypr[2], ypr[1], ypr[0]}).c_str());
    }
    close();
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
  std::optional<Colour> colour(const XMLElement& material) {
    const XMLElement* e = material.FirstChildElement("color");
    try {
      if (e) {
        Colour values{0, 0, 0, 1};
        vector<3>(*e, "rgba", required(*e, "rgba"), values);
        for (const double v : values)
          if (v < 0 || v > 1) refuse(*e, "expected an rgba of numbers from 0 to 1, found " + rdf::lexical::format(v));
        return values;
      }
    } catch (const Refusal& refusal) { document_.warnings.push_back(refusal.error.message + "; the color is left out"); }
    return std::nullopt;
  }
  /// Writes the document's colour. liburdfdom requires one.
  std::optional<Colour> define(const XMLElement& material, const std::string& name) {
    open("material");
    put("name", name.c_str());
    const auto rgba = colour(material);
    open("color");
    put("rgba", joined(rgba.value_or(Colour{0, 0, 0, 1})).c_str());
    close();
    if (const XMLElement* e = texture(material)) {
      open("texture");
      put("filename", required(*e, "filename").c_str());
      close();
    }
    close();
    return rgba;
  }
  /// Writes all materials before the links, so that a link may refer to a material that is defined later.
  void collect_materials(const XMLElement& robot) {
    for (const XMLElement* e = robot.FirstChildElement("material"); e; e = e->NextSiblingElement("material")) {
      const std::string name = name_of(*e);
      if (!has_look(*e)) continue;  // a reference to it causes a warning
      if (const auto first = materials_.find(name); first != materials_.end())
        refuse(*e, "expected a unique name: it is the name of another material in line " + std::to_string(first->second.line));
      materials_.emplace(name, Defined{e->GetLineNum(), define(*e, name)});
    }
    for (const XMLElement* l = robot.FirstChildElement("link"); l; l = l->NextSiblingElement("link"))
      for (const XMLElement* v = l->FirstChildElement("visual"); v; v = v->NextSiblingElement("visual"))
        if (const XMLElement* e = v->FirstChildElement("material")) {
          const std::string name = attribute(*e, "name").value_or("");
          if (!name.empty() && has_look(*e) && materials_.count(name) == 0) materials_.emplace(name, Defined{e->GetLineNum(), define(*e, name)});
        }
  }

  void geometry(const XMLElement& of) {
    const XMLElement& e = child(of, "geometry");
    const XMLElement* shape = e.FirstChildElement();
    if (!shape) refuse(e, "expected one of the elements box, cylinder, sphere, capsule, mesh");
    const std::string_view kind = shape->Name();
    const bool is_capsule = kind == "capsule";
    open("geometry");
    open(is_capsule ? "cylinder" : shape->Name());
    if (kind == "box") {
      const auto size = *vector3(*shape, "size", true);
      for (const double side : size)
        if (side < 0) refuse(*shape, "expected a size of at least 0, found " + rdf::lexical::format(side));
    } else if (kind == "cylinder" || is_capsule) {
      not_negative(*shape, "radius");
      not_negative(*shape, "length");
    } else if (kind == "sphere") {
      not_negative(*shape, "radius");
    } else if (kind == "mesh") {
      const std::string file = required(*shape, "filename");
      if (file.empty()) refuse(*shape, "expected a filename, found an empty one");
      put("filename", file.c_str());
      vector3(*shape, "scale");
    } else {
      refuse(e, "expected one of the elements box, cylinder, sphere, capsule, mesh; found " + quoted(kind));
    }
    close();
    close();
    document_.shapes.back().is_capsule = is_capsule;
  }
  void shape(const XMLElement& e) {
    document_.shapes.emplace_back();
    open(e.Name());
    if (const auto name = attribute(e, "name")) put("name", name->c_str());
    origin(e);
    geometry(e);
    if (const XMLElement* material = std::string_view(e.Name()) == "visual" ? e.FirstChildElement("material") : nullptr) {
      const std::string name = attribute(*material, "name").value_or("");
      const auto known = materials_.find(name);
      if (known != materials_.end()) {
        open("material");
        put("name", name.c_str());
        close();
        document_.shapes.back().colour = known->second.colour;
      } else if (!name.empty()) {
        warn(*material, quoted(name) + " has neither <color> nor <texture> anywhere in the document");
        materials_.emplace(name, Defined{material->GetLineNum(), document_.shapes.back().colour = define(*material, name)});
      } else if (has_look(*material)) {
        document_.shapes.back().colour = define(*material, name);
      }
    }
    close();
  }

  void inertial(const XMLElement& e) {
    const XMLElement *mass = e.FirstChildElement("mass"), *inertia = e.FirstChildElement("inertia");
    if (!mass || !inertia) return warn(e, std::string("has no element <") + (mass ? "inertia" : "mass") + "> and is left out");
    open("inertial");
    origin(e);
    open("mass");
    double noise = noise_of_moments_m2 * not_negative(*mass, "value", relative_noise);
    close();
    open("inertia");
    constexpr std::array<const char*, 3> moments = {"ixx", "iyy", "izz"};
    for (const char* moment : moments) noise = std::max(noise, relative_noise * parsed(*inertia, moment, trimmed(required(*inertia, moment))));
    for (const char* moment : moments) not_negative(*inertia, moment, noise);
    for (const char* product : {"ixy", "ixz", "iyz"}) {
      if (number(*inertia, product, false)) continue;
      put(product, "0");
      warn(*inertia, "has no " + std::string(product) + "; taken as 0");
    }
    close();
    close();
  }

  void link(const XMLElement& e) {
    const std::string name = name_of(e);
    const auto [first, added] = links_.emplace(name, document_.links.size());
    if (!added) refuse(e, "expected a unique name: it is the name of another link in line " + std::to_string(document_.links[first->second].line));
    document_.links.push_back({name, static_cast<std::uint32_t>(e.GetLineNum())});
    link_elements_.push_back(&e);
    expect_once(e, {"inertial"});
    open("link");
    put("name", name.c_str());
    if (const XMLElement* i = e.FirstChildElement("inertial")) inertial(*i);
    for (const char* kind : {"visual", "collision"})
      for (const XMLElement* s = e.FirstChildElement(kind); s; s = s->NextSiblingElement(kind)) shape_if_right(*s);
    close();
  }

  void joint(const XMLElement& e) {
    const std::string name = name_of(e);
    const auto [first, added] = joints_.emplace(name, document_.joints.size());
    if (!added) refuse(e, "expected a unique name: it is the name of another joint in line " + std::to_string(document_.joints[first->second].line));
    const std::string type = required(e, "type");
    const auto types = {"revolute", "continuous", "prismatic", "fixed", "floating", "planar"};
    if (std::find(types.begin(), types.end(), type) == types.end())
      refuse(e, "expected one of the types revolute, continuous, prismatic, fixed, floating, planar; found " + quoted(type));
    expect_once(e, {"origin", "parent", "child", "axis", "limit", "dynamics", "safety_controller", "mimic"});
    open("joint");
    put("name", name.c_str());
    put("type", type.c_str());
    origin(e);
    Ends ends{&e, {}, {}};
    for (const auto& [end, link] : {std::pair<const char*, std::string*>{"parent", &ends.parent}, {"child", &ends.child}}) {
      const XMLElement& at = child(e, end);
      *link = required(at, "link");
      if (links_.count(*link) == 0) refuse(at, "expected a link of the document, found " + quoted(*link));
      open(end);
      put("link", link->c_str());
      close();
    }
    axis(e, type);
    const std::optional<Limits> limits = this->limits(e, type);
    if (const XMLElement* d = e.FirstChildElement("dynamics")) dynamics(*d);
    if (const XMLElement* s = e.FirstChildElement("safety_controller")) {
      open("safety_controller");
      for (const char* part : {"soft_lower_limit", "soft_upper_limit", "k_position"}) number(*s, part, false);
      number(*s, "k_velocity", true);
      close();
    }
    if (const XMLElement* m = e.FirstChildElement("mimic")) mimic(*m, type);
    close();
    document_.joints.push_back({name, static_cast<std::uint32_t>(e.GetLineNum()), limits});
    ends_.push_back(std::move(ends));
  }
  void axis(const XMLElement& joint, const std::string& type) {
    const XMLElement* e = joint.FirstChildElement("axis");
    if (!e || type == "fixed" || type == "floating") return;
    if (!e->Attribute("xyz")) return;
    open("axis");
    const auto xyz = *vector3(*e, "xyz");
    const double length = std::hypot(xyz[0], xyz[1], xyz[2]);
    if (!(length > relative_noise) || !std::isfinite(length)) refuse(*e, "expected an axis with a direction, found " + quoted(e->Attribute("xyz")));
    close();
  }
  /// Reads a limit; nullopt: the attribute is missing or infinite.
  std::optional<double> limit(const XMLElement& e, const char* name) const {
    const auto text = attribute(e, name);
    if (!text) return std::nullopt;
    std::string word = trimmed(*text);
    if (!word.empty() && (word[0] == '-' || word[0] == '+')) word.erase(0, 1);
    for (const char* endless : {"inf", "Inf", "INF", "infinity", "Infinity"})
      if (word == endless) return std::nullopt;
    return parsed(e, name, trimmed(*text));
  }
  /// liburdfdom requires numbers that many descriptions lack. It gets default values; the document's own values are kept in Document.
  std::optional<Limits> limits(const XMLElement& joint, const std::string& type) {
    const bool bounded = type == "revolute" || type == "prismatic";
    if (bounded) {
      open("limit");
      put("effort", "0");
      put("velocity", "0");
      close();
    }
    const XMLElement* e = joint.FirstChildElement("limit");
    if (!e) {
      if (bounded) warn(joint, "expected an element <limit>, which " + type + " joints need; taken as unlimited");
      return std::nullopt;
    }
    Limits limits{limit(*e, "lower"), limit(*e, "upper"), limit(*e, "velocity"), limit(*e, "effort")};
    const bool has_lower = e->Attribute("lower"), has_upper = e->Attribute("upper");
    if (!bounded) {
      limits.lower = limits.upper = std::nullopt;
    } else if (!has_lower && !has_upper) {
      warn(*e, "has neither lower nor upper; the position is taken as unlimited");
    } else {
      if (!has_lower) limits.lower = 0;  // the default of URDF
      if (!has_upper) limits.upper = 0;
      if (limits.lower && limits.upper && *limits.lower > *limits.upper &&
          *limits.lower - *limits.upper <= relative_noise * std::max(1.0, std::abs(*limits.lower)))
        limits.lower = limits.upper;  // by rounding
      if (limits.lower && limits.lower == limits.upper)
        warn(*e, "lower and upper are both " + rdf::lexical::format(*limits.lower) + ": the joint cannot move");
      if (limits.lower && limits.upper && *limits.lower > *limits.upper) {
        warn(*e, "the lower limit " + rdf::lexical::format(*limits.lower) + " is above the upper one " + rdf::lexical::format(*limits.upper) +
                     "; both are left out");
        limits.lower = limits.upper = std::nullopt;
      }
    }
    for (const auto& [name, value] : {std::pair<const char*, std::optional<double>*>{"effort", &limits.effort}, {"velocity", &limits.velocity}}) {
      if (type != "fixed" && !e->Attribute(name)) warn(*e, "has no " + std::string(name) + "; taken as unlimited");
      if (value->value_or(0) >= 0) continue;
      if (**value >= -relative_noise) {
        warn(*e, std::string(name) + " is " + rdf::lexical::format(**value) + ", which is noise of rounding; taken as 0");
        *value = 0;
        continue;
      }
      warn(*e, "expected " + std::string(name) + " of at least 0, found " + rdf::lexical::format(**value) + "; taken as unlimited");
      value->reset();
    }
    if (!limits.lower && !limits.upper && !limits.velocity && !limits.effort) return std::nullopt;
    return limits;
  }
  void dynamics(const XMLElement& e) {
    if (!e.Attribute("damping") && !e.Attribute("friction")) return warn(e, "has neither damping nor friction and is left out");
    open("dynamics");
    number(e, "damping", false);
    number(e, "friction", false);
    close();
  }
  static bool has_position(std::string_view type) { return type == "revolute" || type == "continuous" || type == "prismatic"; }
  void mimic(const XMLElement& e, const std::string& type) {
    if (!has_position(type)) return warn(e, "a " + type + " joint cannot mimic another joint; left out");
    const std::string name = required(e, "joint");
    const auto found = types_.find(name);
    if (found == types_.end()) return warn(e, "there is no joint " + quoted(name) + " in the document; left out");
    if (!has_position(found->second)) return warn(e, "joint " + quoted(name) + " is " + found->second + " and has no position; left out");
    mimics_.emplace_back(&e, document_.joints.size());
    open("mimic");
    put("joint", name.c_str());
    if (!number(e, "multiplier", false)) put("multiplier", "1");
    if (!number(e, "offset", false)) put("offset", "0");
    close();
  }

  // --- the whole document

  void check_tree() const {
    constexpr std::size_t none = static_cast<std::size_t>(-1);
    std::vector<std::size_t> before(links_.size(), none);  // the joint whose child it is
    for (std::size_t j = 0; j < ends_.size(); ++j) {
      std::size_t& joint = before[links_.at(ends_[j].child)];
      if (joint != none)
        refuse(*ends_[j].element, "expected a link that is the child of one joint; " + quoted(ends_[j].child) + " is also the child of " +
                                      with_line(*ends_[joint].element));
      joint = j;
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
        at = links_.at(ends_[before[at]].parent);
        if (seen[at] == on_the_way)
          refuse(*ends_[before[at]].element, "expected a tree; the joints form a cycle through its child " + quoted(document_.links[at].name));
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
  }
  void check_mimics() const {
    std::unordered_map<std::size_t, std::size_t> of;
    for (const auto& [e, joint] : mimics_) of.emplace(joint, joints_.at(required(*e, "joint")));
    for (const auto& [e, joint] : mimics_) {
      std::size_t steps = 0;
      for (auto at = of.find(joint); at != of.end(); at = of.find(at->second))
        if (++steps > max_mimics)
          refuse(*e, "expected a chain of mimic joints that ends at a joint without <mimic>; it does not end within " + std::to_string(max_mimics) +
                         " steps");
    }
  }

  const ParseOptions& options_;
  Document& document_;
  tinyxml2::XMLDocument out_;
  tinyxml2::XMLNode* at_ = &out_;  // the parent of the next element
  bool has_quaternions_ = false;
  std::unordered_map<std::string, std::string> types_;           // of joints, by name
  std::unordered_map<std::string, Defined> materials_;           // by name
  std::unordered_map<std::string, std::size_t> links_, joints_;  // name, index
  std::vector<const XMLElement*> link_elements_;
  std::vector<Ends> ends_;
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

Result<Document> check(std::string_view text, const ParseOptions& options) {
  try {
    Document document;
    std::string utf8 = as_utf8(text, options, document.warnings);
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
    Checker(options, document).check(*robot);
    return document;
  } catch (Refusal& refusal) { return unexpected(std::move(refusal.error)); }
}

}  // namespace v0
}  // namespace lrt::urdf
