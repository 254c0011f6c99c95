// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>

namespace lrt::rdf {

/// A base IRI with its parts prepared, so that resolving a reference costs little more than the copy of the result.
class LRT_INTERNAL_API BaseIri {
 public:
  /// @param base  an absolute IRI, or empty: there is no base
  explicit BaseIri(std::string_view base) { set(base); }
  void set(std::string_view base);
  bool empty() const noexcept { return whole_.empty(); }

  /// Does what iri::resolve does (RFC 3986 5.2), into `out`. False if `reference` is no IRI reference.
  /// @pre  the base is not empty, and `reference` is not a view of `out`
  bool resolve(std::string_view reference, std::string& out) const;

  /// The time of one resolve() beyond the copy of its result, in bytes that count to ReadOptions::max_bytes: a base without an
  /// authority is parsed at each call.
  std::size_t cost() const noexcept;

 private:
  std::string whole_;
  std::string directory_;                          // for relative paths: ends in '/', has no dot segments
  std::size_t origin_ = 0, path_ = 0, query_ = 0;  // where these parts end in `whole_`
  bool has_authority_ = false;                     // then every path begins with '/'
};

}  // namespace lrt::rdf
