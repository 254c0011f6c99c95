// SPDX-License-Identifier: Apache-2.0
#include "src/model/plain_name.hpp"

#include <utility>

#include <lrt/base/iri.hpp>

#include "src/base/utf8.hpp"

namespace lrt::model {
inline namespace v0 {

std::string plain_name(std::string_view path) {
  if (path.find('%') == std::string_view::npos) return std::string(path);
  Result<std::string> name = iri::decode(path);
  return name && !utf8::find_invalid(*name) ? *std::move(name) : std::string(path);
}

}  // namespace v0
}  // namespace lrt::model
