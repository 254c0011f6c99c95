// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/base_iri.hpp"

#include <lrt/base/iri.hpp>

#include "src/rdf/limits.hpp"

namespace lrt::rdf {
namespace {

constexpr std::size_t npos = std::string_view::npos;

/// Appends the segments of `path` without dot segments (RFC 3986 5.2.4).
/// @pre  `out` ends in '/', and the '/' at `root` begins its path
void append_segments(std::string& out, std::size_t root, std::string_view path) {
  for (;;) {
    const std::size_t slash = path.find('/');
    const std::string_view segment = path.substr(0, slash);
    if (segment == "..") {
      if (out.size() > root + 1) out.resize(out.rfind('/', out.size() - 2) + 1);
    } else if (segment != ".") {
      out += segment;
      if (slash != npos) out += '/';
    }
    if (slash == npos) return;
    path.remove_prefix(slash + 1);
  }
}

}  // namespace

void BaseIri::set(std::string_view base) {
  whole_ = base;
  const iri::Parts parts = iri::split(whole_);
  has_authority_ = parts.has_authority;
  if (!has_authority_) return;
  origin_ = parts.scheme.size() + 3 + parts.authority.size();
  path_ = origin_ + parts.path.size();
  query_ = path_ + (parts.has_query ? 1 + parts.query.size() : 0);
  directory_.assign(whole_, 0, origin_).push_back('/');
  const std::size_t last_slash = parts.path.rfind('/');
  if (last_slash != npos && last_slash != 0) append_segments(directory_, origin_, parts.path.substr(1, last_slash));
}

bool BaseIri::resolve(std::string_view reference, std::string& out) const {
  if (reference.empty() && has_authority_) {
    out.assign(whole_, 0, query_);
    return true;
  }
  if (!iri::is_reference(reference)) return false;
  const iri::Parts r = iri::split(reference);
  if (!has_authority_ || r.has_scheme || r.has_authority) {
    Result<std::string> resolved = iri::resolve(whole_, reference);
    if (!resolved) return false;
    out = *std::move(resolved);
    return true;
  }
  if (r.path.empty()) {
    out.assign(whole_, 0, r.has_query ? path_ : query_);
  } else if (r.path.front() == '/') {
    out.assign(whole_, 0, origin_).push_back('/');
    append_segments(out, origin_, r.path.substr(1));
  } else {
    out = directory_;
    append_segments(out, origin_, r.path);
  }
  if (r.has_query) (out += '?') += r.query;
  if (r.has_fragment) (out += '#') += r.fragment;
  return true;
}

std::size_t BaseIri::cost() const noexcept { return has_authority_ || whole_.size() <= long_base ? 0 : 16 * whole_.size(); }

}  // namespace lrt::rdf
