#pragma once

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
  struct Element {
    std::string name;
    std::uint32_t line = 0;
  };
  std::string
      text;  ///< written anew: links, joints and materials, with what URDF says of them and nothing else, in the syntax of all XML readers
  struct Joint : Element {
    std::optional<Limits> limits;
  };
  std::vector<Element> links;  ///< in the document's order
  std::vector<Joint> joints;
  /// Of a visual or collision, what liburdfdom does not keep.
  struct Shape {
    bool is_capsule = false;  ///< written as a cylinder
    bool has_colour = true;   ///< or a colour is written that the document does not have
  };
  std::vector<Shape> shapes;  ///< of all links, of each the visuals before the collisions
  std::vector<std::string> warnings;
};

/// Says all that can be wrong with a description, with the element and its line: liburdfdom then has nothing to complain of.
/// @par Errors  as parse()
Result<Document> check(std::string_view text, const Options& options);

}  // namespace lrt::urdf
