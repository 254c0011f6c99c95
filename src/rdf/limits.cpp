// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/limits.hpp"

#include <algorithm>

#include "src/base/utf8.hpp"

namespace lrt::rdf {

Unexpected misread(std::string_view text, std::size_t offset, const std::string& sentence, Errc code) {
  Error error{code, {}};
  error.offset = offset;
  error.line = 1;
  std::size_t line_start = text.size() - utf8::without_mark(text).size();  // an editor does not show the mark
  for (std::size_t i = 0; i < offset && i < text.size(); ++i) {
    if (text[i] == '\n') {
      ++error.line;
      line_start = i + 1;
    }
  }
  offset = std::max(offset, line_start);
  error.column = static_cast<std::uint32_t>(offset - line_start + 1);
  error.message = "line " + std::to_string(error.line) + ", column " + std::to_string(error.column) + ": " + sentence;
  return unexpected(std::move(error));
}

}  // namespace lrt::rdf
