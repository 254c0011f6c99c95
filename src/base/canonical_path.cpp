// SPDX-License-Identifier: Apache-2.0
#include "src/base/canonical_path.hpp"

#include <algorithm>
#include <cstddef>

#include <lrt/base/iri.hpp>

#include "src/base/utf8.hpp"

namespace lrt {

namespace {

/// Percent-encoding leaves these characters alone, and no segment is a dot segment.
bool is_plain(std::string_view path) noexcept {
  return std::all_of(path.begin(), path.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '/';
  });
}

}  // namespace

Result<std::string> canonical_path(std::string_view path) {
  if (is_plain(path)) return std::string(path);
  std::string out;
  out.reserve(path.size());
  std::size_t start = 1;
  while (true) {
    const std::size_t end = std::min(path.find('/', start), path.size());
    Result<std::string> segment = iri::decode(path.substr(start, end - start));
    if (!segment) return Unexpected{std::move(segment).error()};
    if (segment->find('\0') != std::string::npos) return unexpected(Errc::expected_iri, "NUL (%00) in the path");
    if (const auto bad = utf8::find_invalid(*segment))
      return unexpected(Errc::expected_iri, "the path is not UTF-8 at byte " + std::to_string(*bad) + " of a segment");
    if (*segment == "." || *segment == "..") return unexpected(Errc::expected_iri, "\"" + *segment + "\" in the path");
    out += '/';
    out += iri::encode_segment(*segment);
    if (end == path.size()) return out;
    start = end + 1;
  }
}

}  // namespace lrt
