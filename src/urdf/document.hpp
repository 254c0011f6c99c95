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

/// A URDF that has been judged: what liburdfdom gets to see, and what it does not keep.
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
  /// A visual or collision: what liburdfdom does not keep, or as floats.
  struct Shape {
    bool is_capsule = false;  ///< written as a cylinder
    std::optional<std::array<double, 4>> colour;
  };

  /// Written anew: links, joints and materials, with what URDF says of them and nothing else, in the syntax of all XML readers.
  std::string text;
  std::vector<Link> links;  ///< in the document's order
  std::vector<Joint> joints;
  std::vector<Shape> shapes;  ///< of all links, of each the visuals before the collisions
  std::vector<std::string> warnings;
};

/// Says all that can be wrong with a description, with the element and its line: liburdfdom then has nothing to complain of.
/// @par Errors  as parse()
Result<Document> check(std::string_view text, const ParseOptions& options);

}  // namespace lrt::urdf
