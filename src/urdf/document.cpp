#include "src/urdf/document.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <unordered_map>
#include <utility>

#include <lrt/base/utf8.hpp>
#include <lrt/rdf/lexical.hpp>

namespace lrt::urdf {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t most_attributes = 256;  // of one element; a reader compares each with each
constexpr std::size_t most_mimics = 100;      // one after the other

/// Ends the reading of a document; check() makes a Result of it.
struct Refusal {
  Error error;
};

/// A text of the document in a message.
std::string shortened(std::string_view text) {
  constexpr std::size_t most = 80;
  std::size_t cut = std::min(text.size(), most);
  while (cut < text.size() && cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xC0U) == 0x80U) --cut;  // between characters
  return std::string(text.substr(0, cut)) + (cut < text.size() ? "..." : "");
}
std::string quoted(std::string_view text) { return '"' + shortened(text) + '"'; }

std::uint32_t line_of(std::string_view text, std::size_t offset) {
  return 1 + static_cast<std::uint32_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(offset), '\n'));
}

/// Bounds what an XML reader will make of the text, before there is one. How many end tags it has.
std::size_t check_size(std::string_view text, const Options& options) {
  const auto refuse = [&](Errc code, std::size_t at, std::string message) {
    const std::uint32_t line = line_of(text, at);
    throw Refusal{{code, "line " + std::to_string(line) + ": " + std::move(message), at, line}};
  };
  if (text.size() > options.max_bytes)
    throw Refusal{
        {Errc::limit_exceeded, "expected at most " + std::to_string(options.max_bytes) + " bytes, found " + std::to_string(text.size())}};
  if (const auto bad = utf8::find_invalid(text)) refuse(Errc::expected_value, *bad, "expected UTF-8");
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos)
    refuse(Errc::expected_value, nul, "expected XML, found U+0000");

  std::size_t elements = 0, ends = 0;
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string_view::npos;) {
    bool skipped = false;
    for (const auto& [begin, end] : {std::pair<std::string_view, std::string_view>{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}}) {
      if (text.compare(at, begin.size(), begin) != 0) continue;
      const std::size_t close = text.find(end, at + begin.size());
      if (close == std::string_view::npos) return ends;  // the reader says what is wrong
      at = close + end.size();
      skipped = true;
      break;
    }
    if (skipped) continue;
    const std::size_t tag = at;
    const bool is_element = text.compare(at, 2, "<!") != 0;  // in others quotes mean nothing
    std::size_t attributes = 0;
    for (++at; at < text.size() && text[at] != '<' && text[at] != '>'; ++at) {
      if (text[at] == '=') ++attributes;
      if (is_element && (text[at] == '"' || text[at] == '\'')) at = std::min(text.find(text[at], at + 1), text.size() - 1);
    }
    if (text.compare(tag, 2, "</") == 0) ++ends;
    else if (++elements > options.max_elements)
      refuse(Errc::limit_exceeded, tag, "expected at most " + std::to_string(options.max_elements) + " elements");
    if (attributes > most_attributes)
      refuse(Errc::limit_exceeded, tag, "expected at most " + std::to_string(most_attributes) + " attributes of one element");
  }
  return ends;
}

/// Counts the elements that have an end tag.
struct EndTags final : tinyxml2::XMLVisitor {
  bool VisitEnter(const XMLElement& e, const tinyxml2::XMLAttribute*) override {
    if (e.ClosingType() == XMLElement::OPEN) ++count;
    return true;
  }
  std::size_t count = 0;
};

class Checker {
 public:
  Checker(const Options& options, Document& document) : options_(options), document_(document), out_(nullptr, true) {}

  void check(const XMLElement& robot) {
    check_xacro(robot);
    if (std::string_view(robot.Name()) != "robot") refuse(robot, "expected <robot> as the outermost element");
    const std::string name = name_of(robot, true);
    if (const auto version = attribute(robot, "version"); version && *version != "1.0" && *version != "1")
      refuse(robot, "expected version 1.0, found " + quoted(*version));
    out_.OpenElement("robot", true);
    out_.PushAttribute("name", name.c_str());
    collect_materials(robot);
    for (const XMLElement* e = robot.FirstChildElement("link"); e; e = e->NextSiblingElement("link")) link(*e);
    for (const XMLElement* e = robot.FirstChildElement("joint"); e; e = e->NextSiblingElement("joint")) joint(*e);
    if (links_.empty()) refuse(robot, "expected at least one link");
    check_tree();
    check_mimics();
    out_.CloseElement(true);
    document_.text.assign(out_.CStr(), static_cast<std::size_t>(out_.CStrSize()) - 1);
  }

 private:
  struct Ends {
    const XMLElement* element;
    std::string type, parent, child;
  };

  // --- words

  /// `joint "a"`, `limit of joint "a"`
  std::string described(const XMLElement& e) const {
    const XMLElement* whole = &e;  // the link, joint or material that it is in
    while (whole->Parent() && whole->Parent()->ToElement() && whole->Parent()->Parent() && whole->Parent()->Parent()->ToElement())
      whole = whole->Parent()->ToElement();
    std::string words = shortened(whole->Name());
    if (const char* name = whole->Attribute("name")) words += ' ' + quoted(name);
    return whole == &e ? words : shortened(e.Name()) + " of " + words;
  }
  std::string with_line(const XMLElement& e) const { return described(e) + " (line " + std::to_string(e.GetLineNum()) + ')'; }
  [[noreturn]] void refuse(const XMLElement& e, const std::string& sentence, Errc code = Errc::expected_value) const {
    throw Refusal{{code, with_line(e) + ": " + sentence, std::nullopt, static_cast<std::uint32_t>(e.GetLineNum())}};
  }
  void warn(const XMLElement& e, const std::string& sentence) { document_.warnings.push_back(with_line(e) + ": " + sentence); }

  // --- xacro

  /// Replaces each `${name}` by the value that the options give.
  std::string expanded(const XMLElement& e, std::string_view text) const {
    std::string out;
    while (true) {
      const std::size_t open = text.find("${");
      out += text.substr(0, open);
      if (open == std::string_view::npos) return out;
      const std::size_t close = std::min(text.find('}', open), text.size());
      const std::string name(text.substr(open + 2, close - open - 2));
      const auto value = options_.arguments.find(name);
      if (value == options_.arguments.end() || close == text.size()) {
        const bool plain =
            !name.empty() && name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") == std::string::npos;
        refuse(e, "expected a document that xacro has expanded, found " + quoted(text.substr(open, close - open + 1)) +
                      ": run xacro first" + (plain ? ", or give Options::arguments a value for " + quoted(name) : std::string()));
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
                    (name == "xacro:arg" || name == "xacro:property" ? ", or give Options::arguments a value for the name" : ""));
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
    return name;
  }
  double parsed(const XMLElement& e, const char* name, std::string_view text) const {
    const auto value = rdf::lexical::is_double(text) ? rdf::lexical::parse_double(text) : std::nullopt;
    if (!value || !std::isfinite(*value)) refuse(e, "expected a number as " + std::string(name) + ", found " + quoted(text));
    return *value;
  }
  template <std::size_t least, std::size_t most>
  std::string vector(const XMLElement& e, const char* name, std::string_view text, std::array<double, most>& values) const {
    std::string out;
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find_first_not_of(' ', at)) != std::string_view::npos;) {
      const std::size_t end = std::min(text.find(' ', at), text.size());
      const double value = parsed(e, name, text.substr(at, end - at));
      if (count < most) values[count] = value;
      ++count;
      out += (out.empty() ? "" : " ") + rdf::lexical::format(value);
      at = end;
    }
    if (count < least || count > most) refuse(e, "expected " + std::to_string(most) + " numbers as " + name + ", found " + quoted(text));
    return out;
  }
  /// The number in an attribute, written as well. Without the attribute: nothing, or an error.
  std::optional<double> number(const XMLElement& e, const char* name, bool needed) {
    const auto text = needed ? required(e, name) : attribute(e, name);
    if (!text) return std::nullopt;
    const std::size_t first = text->find_first_not_of(' ');
    const std::string_view trimmed =
        first == std::string::npos ? std::string_view() : std::string_view(*text).substr(first, text->find_last_not_of(' ') - first + 1);
    const double value = parsed(e, name, trimmed);
    out_.PushAttribute(name, rdf::lexical::format(value).c_str());
    return value;
  }
  std::optional<std::array<double, 3>> vector3(const XMLElement& e, const char* name, bool needed = false) {
    const auto text = needed ? required(e, name) : attribute(e, name);
    if (!text) return std::nullopt;
    std::array<double, 3> values{};
    out_.PushAttribute(name, vector<3>(e, name, *text, values).c_str());
    return values;
  }
  double not_negative(const XMLElement& e, const char* name) {
    const double value = *number(e, name, true);
    if (value < 0) refuse(e, "expected " + std::string(name) + " of at least 0, found " + rdf::lexical::format(value));
    return value;
  }

  // --- elements

  void origin(const XMLElement& of) {
    const XMLElement* e = of.FirstChildElement("origin");
    if (!e) return;
    out_.OpenElement("origin", true);
    vector3(*e, "xyz");
    vector3(*e, "rpy");
    out_.CloseElement(true);
  }
  const XMLElement& child(const XMLElement& of, const char* name) const {
    const XMLElement* e = of.FirstChildElement(name);
    if (!e) refuse(of, "expected an element <" + std::string(name) + '>');
    return *e;
  }

  /// Colour and texture; whether there is one of them.
  bool look(const XMLElement& material, bool write) {
    const XMLElement* colour = material.FirstChildElement("color");
    const XMLElement* texture = material.FirstChildElement("texture");
    std::string rgba, file;
    if (colour) {
      std::array<double, 4> values{0, 0, 0, 1};
      rgba = vector<3>(*colour, "rgba", required(*colour, "rgba"), values);
      for (const double v : values)
        if (v < 0 || v > 1) refuse(*colour, "expected an rgba of numbers from 0 to 1, found " + rdf::lexical::format(v));
      if (std::count(rgba.begin(), rgba.end(), ' ') == 2) rgba += " 1";
    }
    if (texture) file = required(*texture, "filename");
    if (write && colour) {
      out_.OpenElement("color", true);
      out_.PushAttribute("rgba", rgba.c_str());
      out_.CloseElement(true);
    }
    if (write && !file.empty()) {
      out_.OpenElement("texture", true);
      out_.PushAttribute("filename", file.c_str());
      out_.CloseElement(true);
    }
    return colour || !file.empty();
  }
  void define(const XMLElement& material, const std::string& name) {
    out_.OpenElement("material", true);
    out_.PushAttribute("name", name.c_str());
    look(material, true);
    out_.CloseElement(true);
  }
  /// All materials are written before the links, so that a link may refer to what a later one defines.
  void collect_materials(const XMLElement& robot) {
    for (const XMLElement* e = robot.FirstChildElement("material"); e; e = e->NextSiblingElement("material")) {
      const std::string name = name_of(*e);
      const auto [first, added] = materials_.emplace(name, e->GetLineNum());
      if (!added) refuse(*e, "expected another name: there is such a material in line " + std::to_string(first->second));
      if (!look(*e, false)) refuse(*e, "expected an element <color> or <texture>");
      define(*e, name);
    }
    for (const XMLElement* l = robot.FirstChildElement("link"); l; l = l->NextSiblingElement("link"))
      for (const XMLElement* v = l->FirstChildElement("visual"); v; v = v->NextSiblingElement("visual"))
        if (const XMLElement* e = v->FirstChildElement("material")) {
          const std::string name = name_of(*e, true);
          if (!name.empty() && look(*e, false) && materials_.emplace(name, e->GetLineNum()).second) define(*e, name);
        }
  }

  void geometry(const XMLElement& of) {
    const XMLElement& e = child(of, "geometry");
    const XMLElement* shape = e.FirstChildElement();
    if (!shape) refuse(e, "expected an element out of box, cylinder, sphere, mesh");
    const std::string_view kind = shape->Name();
    out_.OpenElement("geometry", true);
    out_.OpenElement(shape->Name(), true);
    if (kind == "box") {
      const auto size = *vector3(*shape, "size", true);
      for (const double side : size)
        if (side < 0) refuse(*shape, "expected a size of at least 0, found " + rdf::lexical::format(side));
    } else if (kind == "cylinder") {
      not_negative(*shape, "radius");
      not_negative(*shape, "length");
    } else if (kind == "sphere") {
      not_negative(*shape, "radius");
    } else if (kind == "mesh") {
      const std::string file = required(*shape, "filename");
      if (file.empty()) refuse(*shape, "expected a filename, found an empty one");
      out_.PushAttribute("filename", file.c_str());
      vector3(*shape, "scale");
    } else {
      refuse(e, "expected an element out of box, cylinder, sphere, mesh; found " + quoted(kind));
    }
    out_.CloseElement(true);
    out_.CloseElement(true);
  }
  void shape(const XMLElement& e) {
    out_.OpenElement(e.Name(), true);
    if (const auto name = attribute(e, "name")) out_.PushAttribute("name", name->c_str());
    origin(e);
    geometry(e);
    if (const XMLElement* material = std::string_view(e.Name()) == "visual" ? e.FirstChildElement("material") : nullptr) {
      const std::string name = name_of(*material, true);
      if (!name.empty() && materials_.count(name) == 0)
        refuse(*material,
               "expected a material of the document, found " + quoted(name) + ", which has neither <color> nor <texture> anywhere");
      if (!name.empty() || look(*material, false)) {
        out_.OpenElement("material", true);
        out_.PushAttribute("name", name.c_str());
        if (name.empty()) look(*material, true);
        out_.CloseElement(true);
      }
    }
    out_.CloseElement(true);
  }

  void inertial(const XMLElement& e) {
    out_.OpenElement("inertial", true);
    origin(e);
    out_.OpenElement("mass", true);
    not_negative(child(e, "mass"), "value");
    out_.CloseElement(true);
    const XMLElement& inertia = child(e, "inertia");
    out_.OpenElement("inertia", true);
    for (const char* moment : {"ixx", "iyy", "izz"}) not_negative(inertia, moment);
    for (const char* product : {"ixy", "ixz", "iyz"}) number(inertia, product, true);
    out_.CloseElement(true);
    out_.CloseElement(true);
  }

  void link(const XMLElement& e) {
    const std::string name = name_of(e);
    const auto [first, added] = links_.emplace(name, document_.links.size());
    if (!added) refuse(e, "expected another name: there is such a link in line " + std::to_string(document_.links[first->second].line));
    document_.links.push_back({name, static_cast<std::uint32_t>(e.GetLineNum())});
    link_elements_.push_back(&e);
    out_.OpenElement("link", true);
    out_.PushAttribute("name", name.c_str());
    if (const XMLElement* i = e.FirstChildElement("inertial")) inertial(*i);
    for (const char* kind : {"visual", "collision"})
      for (const XMLElement* s = e.FirstChildElement(kind); s; s = s->NextSiblingElement(kind)) shape(*s);
    out_.CloseElement(true);
  }

  void joint(const XMLElement& e) {
    const std::string name = name_of(e);
    const auto [first, added] = joints_.emplace(name, document_.joints.size());
    if (!added) refuse(e, "expected another name: there is such a joint in line " + std::to_string(document_.joints[first->second].line));
    const std::string type = required(e, "type");
    const auto types = {"revolute", "continuous", "prismatic", "fixed", "floating", "planar"};
    if (std::find(types.begin(), types.end(), type) == types.end())
      refuse(e, "expected a type out of revolute, continuous, prismatic, fixed, floating, planar; found " + quoted(type));
    out_.OpenElement("joint", true);
    out_.PushAttribute("name", name.c_str());
    out_.PushAttribute("type", type.c_str());
    origin(e);
    Ends ends{&e, type, {}, {}};
    for (const auto& [end, link] : {std::pair<const char*, std::string*>{"parent", &ends.parent}, {"child", &ends.child}}) {
      const XMLElement& at = child(e, end);
      *link = required(at, "link");
      if (links_.count(*link) == 0) refuse(at, "expected a link of the document, found " + quoted(*link));
      out_.OpenElement(end, true);
      out_.PushAttribute("link", link->c_str());
      out_.CloseElement(true);
    }
    axis(e, type);
    const XMLElement* limit = e.FirstChildElement("limit");
    if (!limit && (type == "revolute" || type == "prismatic")) refuse(e, "expected an element <limit>, which " + type + " joints need");
    if (limit) limits(*limit);
    if (const XMLElement* d = e.FirstChildElement("dynamics")) dynamics(*d);
    if (const XMLElement* s = e.FirstChildElement("safety_controller")) {
      out_.OpenElement("safety_controller", true);
      for (const char* part : {"soft_lower_limit", "soft_upper_limit", "k_position"}) number(*s, part, false);
      number(*s, "k_velocity", true);
      out_.CloseElement(true);
    }
    if (const XMLElement* m = e.FirstChildElement("mimic")) mimic(*m, type);
    out_.CloseElement(true);
    document_.joints.push_back({name, static_cast<std::uint32_t>(e.GetLineNum())});
    ends_.push_back(std::move(ends));
  }
  void axis(const XMLElement& joint, const std::string& type) {
    const XMLElement* e = joint.FirstChildElement("axis");
    if (!e || type == "fixed" || type == "floating") return;
    if (!e->Attribute("xyz")) return;
    out_.OpenElement("axis", true);
    const auto xyz = *vector3(*e, "xyz");
    const double length = std::hypot(xyz[0], xyz[1], xyz[2]);
    if (!(length > 0) || !std::isfinite(length)) refuse(*e, "expected an axis with a direction, found " + quoted(e->Attribute("xyz")));
    out_.CloseElement(true);
  }
  void limits(const XMLElement& e) {
    out_.OpenElement("limit", true);
    const double lower = number(e, "lower", false).value_or(0), upper = number(e, "upper", false).value_or(0);
    number(e, "effort", true);
    number(e, "velocity", true);
    out_.CloseElement(true);
    if (lower > upper)
      warn(e, "the lower limit " + rdf::lexical::format(lower) + " is above the upper one " + rdf::lexical::format(upper) +
                  "; both are left out");
  }
  void dynamics(const XMLElement& e) {
    if (!e.Attribute("damping") && !e.Attribute("friction")) return warn(e, "has neither damping nor friction and is left out");
    out_.OpenElement("dynamics", true);
    number(e, "damping", false);
    number(e, "friction", false);
    out_.CloseElement(true);
  }
  void mimic(const XMLElement& e, const std::string& type) {
    if (type != "revolute" && type != "continuous" && type != "prismatic") return warn(e, "a " + type + " joint can mimic none; left out");
    mimics_.emplace_back(&e, document_.joints.size());
    out_.OpenElement("mimic", true);
    out_.PushAttribute("joint", required(e, "joint").c_str());
    if (!number(e, "multiplier", false)) out_.PushAttribute("multiplier", "1");
    if (!number(e, "offset", false)) out_.PushAttribute("offset", "0");
    out_.CloseElement(true);
  }

  // --- the whole

  void check_tree() const {
    constexpr std::size_t none = static_cast<std::size_t>(-1);
    std::vector<std::size_t> before(links_.size(), none);  // the joint
    for (std::size_t j = 0; j < ends_.size(); ++j) {
      std::size_t& joint = before[links_.at(ends_[j].child)];
      if (joint != none)
        refuse(*ends_[j].element, "expected a link that is the child of one joint; " + quoted(ends_[j].child) + " is that of " +
                                      with_line(*ends_[joint].element) + ", too");
      joint = j;
    }
    // Each link has one joint before it at most: going back ends at a root, or goes round.
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
          refuse(*ends_[before[at]].element,
                 "expected a tree; the joints lead round in a circle, back to its child " + quoted(document_.links[at].name));
      }
      for (const std::size_t l : way) seen[l] = good;
    }
    std::size_t root = none;
    for (std::size_t l = 0; l < before.size(); ++l) {
      if (before[l] != none) continue;
      if (root != none)
        refuse(*link_elements_[l], "expected to be the child of a joint: one link is that of none, and there is " +
                                       with_line(*link_elements_[root]) + " already");
      root = l;
    }
  }
  void check_mimics() const {
    std::unordered_map<std::size_t, std::size_t> of;
    for (const auto& [e, joint] : mimics_) {
      const std::string name = required(*e, "joint");
      const auto found = joints_.find(name);
      if (found == joints_.end()) refuse(*e, "expected a joint of the document, found " + quoted(name));
      const std::string& type = ends_[found->second].type;
      if (type != "revolute" && type != "continuous" && type != "prismatic")
        refuse(*e, "expected a revolute, continuous or prismatic joint; " + quoted(name) + " is " + type);
      of.emplace(joint, found->second);
    }
    for (const auto& [e, joint] : mimics_) {
      std::size_t steps = 0;
      for (auto at = of.find(joint); at != of.end(); at = of.find(at->second))
        if (++steps > most_mimics)
          refuse(*e, "expected a joint that somebody moves; from one that is mimicked to the next none is found in " +
                         std::to_string(most_mimics) + " steps");
    }
  }

  const Options& options_;
  Document& document_;
  tinyxml2::XMLPrinter out_;
  std::unordered_map<std::string, int> materials_;               // name, line
  std::unordered_map<std::string, std::size_t> links_, joints_;  // name, index
  std::vector<const XMLElement*> link_elements_;
  std::vector<Ends> ends_;
  std::vector<std::pair<const XMLElement*, std::size_t>> mimics_;  // element, index of its joint
};

/// Why a text is no XML, by what the reader says.
Error no_xml(const tinyxml2::XMLDocument& xml) {
  const auto line = static_cast<std::uint32_t>(std::max(0, xml.ErrorLineNum()));
  const std::string_view said = xml.ErrorStr() ? xml.ErrorStr() : "";
  constexpr std::string_view before_name = "XMLElement name=";
  const std::size_t at = said.find(before_name);
  const std::string element = at == std::string_view::npos ? "an element" : '<' + shortened(said.substr(at + before_name.size())) + '>';
  std::string found;
  switch (xml.ErrorID()) {
    case tinyxml2::XML_ERROR_EMPTY_DOCUMENT: return {Errc::expected_value, "expected XML, found nothing"};
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT: found = element + " and an end tag that is not its own, or none"; break;
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE: found = element + " with an attribute that is not quoted, not ended, or there twice"; break;
    case tinyxml2::XML_ERROR_PARSING_ELEMENT: found = "a tag that is not ended"; break;
    case tinyxml2::XML_ERROR_PARSING_TEXT: found = "text that is in no element, or not ended"; break;
    case tinyxml2::XML_ERROR_PARSING_COMMENT: found = "a comment that is not ended"; break;
    case tinyxml2::XML_ERROR_PARSING_CDATA: found = "a CDATA section that is not ended"; break;
    case tinyxml2::XML_ERROR_PARSING_DECLARATION: found = "a declaration that is not ended, or not at the beginning"; break;
    case tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED:
      return {Errc::limit_exceeded, "line " + std::to_string(line) + ": expected elements nested less deeply", std::nullopt, line};
    default: found = "what is none"; break;
  }
  return {Errc::expected_value, "line " + std::to_string(line) + ": expected XML, found " + found, std::nullopt, line};
}

}  // namespace

Result<Document> check(std::string_view text, const Options& options) {
  try {
    const std::size_t ends = check_size(text, options);
    tinyxml2::XMLDocument xml;
    if (xml.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) return unexpected(no_xml(xml));
    const XMLElement* robot = xml.RootElement();
    if (!robot) return unexpected(Errc::expected_value, "expected <robot>, found no element");
    if (const XMLElement* second = robot->NextSiblingElement()) {
      const auto line = static_cast<std::uint32_t>(second->GetLineNum());
      return unexpected(
          Error{Errc::expected_value,
                "line " + std::to_string(line) + ": expected one outermost element, found <" + shortened(second->Name()) + "> after it",
                std::nullopt, line});
    }
    EndTags has;
    xml.Accept(&has);
    if (has.count != ends)  // the reader stops at one that is too many
      return unexpected(Errc::expected_value, "expected XML, found an end tag without an element after <" + shortened(robot->Name()) + '>');
    Document document;
    Checker(options, document).check(*robot);
    return document;
  } catch (Refusal& refusal) { return unexpected(std::move(refusal.error)); }
}

}  // namespace lrt::urdf
