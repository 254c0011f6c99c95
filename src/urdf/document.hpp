// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/urdf.hpp>

namespace lrt::urdf {
inline namespace v0 {

/// A checked URDF: the text for liburdfdom, and values that liburdfdom does not keep.
struct Document {
  struct Link {
    std::string name;
    std::uint32_t line = 0;
  };
  struct Joint {
    std::string name;
    std::uint32_t line = 0;
    std::optional<Limits> limits;
  };
  /// A visual or collision: values that liburdfdom does not keep, or keeps as float.
  struct Shape {
    bool is_capsule = false;  ///< written as a cylinder
    std::optional<std::array<double, 4>> colour;
  };

  /// The document rewritten: links, joints and materials with URDF's own elements only, in plain XML.
  std::string text;
  std::vector<Link> links;  ///< in the document's order
  std::vector<Joint> joints;
  std::vector<Shape> shapes;  ///< of all links, of each the visuals before the collisions
  std::vector<std::string> warnings;
};

/// Checks a description completely, so that liburdfdom finds no error. An error names the element and its line.
/// @par Errors  as parse()
Result<Document> check(std::string_view text, const ParseOptions& options);

}  // namespace v0
}  // namespace lrt::urdf
