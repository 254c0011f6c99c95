// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tinyxml2.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace lrt::test {

/// Forward kinematics for comparison: from the document itself, by homogeneous matrices, from each link back to the root. It shares only the
/// XML parser with the library.
class ReferenceKinematics {
 public:
  using Matrix = std::array<std::array<double, 4>, 4>;
  using Positions = std::map<std::string, double>;  ///< of joints, by name

  /// @param nothing  a text that is removed everywhere
  ReferenceKinematics(const std::string& file, const std::string& nothing) : nothing_(nothing) {
    if (xml_.LoadFile(file.c_str()) != tinyxml2::XML_SUCCESS) throw std::runtime_error(file);
    for (auto* e = xml_.RootElement()->FirstChildElement("link"); e; e = e->NextSiblingElement("link")) links.push_back(text(e, "name"));
    for (auto* e = xml_.RootElement()->FirstChildElement("joint"); e; e = e->NextSiblingElement("joint")) {
      joints.push_back(text(e, "name"));
      by_name_[joints.back()] = e;
      by_child_[text(e->FirstChildElement("child"), "link")] = e;
    }
  }

  static Matrix product(const Matrix& a, const Matrix& b) {
    Matrix c{};
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t k = 0; k < 4; ++k) c[i][j] += a[i][k] * b[k][j];
    return c;
  }
  Matrix pose(const std::string& link, const Positions& positions) const {
    const auto found = by_child_.find(link);
    if (found == by_child_.end()) return identity();
    const tinyxml2::XMLElement* joint = found->second;
    const Matrix before = pose(text(joint->FirstChildElement("parent"), "link"), positions);
    return product(product(before, origin(joint)), motion(joint, positions));
  }

  std::vector<std::string> links, joints;

 private:
  static Matrix identity() { return {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}; }
  std::string text(const tinyxml2::XMLElement* e, const char* name) const {
    const char* value = e ? e->Attribute(name) : nullptr;
    std::string all = value ? value : "";
    for (std::size_t at; !nothing_.empty() && (at = all.find(nothing_)) != std::string::npos;) all.erase(at, nothing_.size());
    return all;
  }
  std::array<double, 3> three(const tinyxml2::XMLElement* e, const char* name, std::array<double, 3> otherwise) const {
    std::istringstream in(text(e, name));
    std::array<double, 3> v{};
    return in >> v[0] >> v[1] >> v[2] ? v : otherwise;
  }
  Matrix origin(const tinyxml2::XMLElement* joint) const {
    const auto* e = joint->FirstChildElement("origin");
    const auto t = three(e, "xyz", {0, 0, 0}), a = three(e, "rpy", {0, 0, 0});
    const double cr = std::cos(a[0]), sr = std::sin(a[0]), cp = std::cos(a[1]), sp = std::sin(a[1]), cy = std::cos(a[2]), sy = std::sin(a[2]);
    return {{{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, t[0]},
             {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, t[1]},
             {-sp, cp * sr, cp * cr, t[2]},
             {0, 0, 0, 1}}};
  }
  double position(const tinyxml2::XMLElement* joint, const Positions& positions) const {
    const auto* mimic = joint->FirstChildElement("mimic");
    if (!mimic) return positions.at(text(joint, "name"));
    return mimic->DoubleAttribute("multiplier", 1) * position(by_name_.at(text(mimic, "joint")), positions) + mimic->DoubleAttribute("offset", 0);
  }
  Matrix motion(const tinyxml2::XMLElement* joint, const Positions& positions) const {
    const std::string type = text(joint, "type");
    if (type == "fixed") return identity();
    auto [x, y, z] = three(joint->FirstChildElement("axis"), "xyz", {1, 0, 0});
    const double length = std::sqrt(x * x + y * y + z * z);
    x /= length, y /= length, z /= length;
    const double q = position(joint, positions);
    if (type == "prismatic") return {{{1, 0, 0, q * x}, {0, 1, 0, q * y}, {0, 0, 1, q * z}, {0, 0, 0, 1}}};
    const double c = std::cos(q), s = std::sin(q), v = 1 - c;  // Rodrigues
    return {{{c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0},
             {y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0},
             {z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0},
             {0, 0, 0, 1}}};
  }

  std::string nothing_;
  tinyxml2::XMLDocument xml_;
  std::map<std::string, const tinyxml2::XMLElement*> by_name_, by_child_;
};

}  // namespace lrt::test
