#pragma once

#include <cstdint>
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
  std::vector<Element> links, joints;  ///< in the document's order
  std::vector<std::string> warnings;
};

/// Says all that can be wrong with a description, with the element and its line: liburdfdom then has nothing to complain of.
/// @par Errors  as parse()
Result<Document> check(std::string_view text, const Options& options);

}  // namespace lrt::urdf
