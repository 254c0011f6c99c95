// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/http/message.hpp>

namespace lrt::http {
inline namespace v0 {

/// Builds Link field lines (RFC 8288) that clients with small limits can read: several links share a line of at most 4 KiB, and
/// all lines together keep to a budget. A link that does not fit is left out whole, with all that follow; finish() then says
/// where the rest is.
/// @par Implements  R0.9
class LRT_API LinkWriter {
 public:
  explicit LinkWriter(std::size_t budget = 8 * 1024) : budget_(budget) {}

  /// @param target  IRI reference; bytes that RFC 3986 does not allow are percent-encoded
  /// @param type    media type of the target (RFC 8288 3.4.1); empty: none. Quotes in it are left out
  void add(std::string_view target, std::string_view rel, std::string_view type = {});
  /// From here on, links to such targets are not added.
  void leave_out(std::function<bool(std::string_view target)> hidden) { hidden_ = std::move(hidden); }
  /// Appends the lines to `fields`; when links were left out, with one to `rest` as the last, for which space was reserved.
  void finish(Fields& fields, std::string_view rest, std::string_view rest_rel = "next");
  /// From here on links may be left out: the first `n`, which a response before had, and those that do not fit.
  void skip(std::size_t n);
  /// Appends the lines; when links were left out at the end, the last one links with rel="next" to where they are.
  /// @param rest  the IRI of a response whose writer skips that many links
  void finish_in_parts(Fields& fields, const std::function<std::string(std::size_t)>& rest);
  bool cut() const noexcept { return cut_; }

 private:
  bool put(const std::string& link);
  void take_back();
  void flush(Fields& fields);

  std::size_t budget_;
  std::function<bool(std::string_view)> hidden_;
  std::size_t used_ = 0;
  std::vector<std::string> lines_;
  bool cut_ = false;
  std::size_t skipped_ = 0, left_to_skip_ = 0;
  std::size_t count_ = 0;     // links that were put
  std::size_t required_ = 0;  // of these, before skip()
};

}  // namespace v0
}  // namespace lrt::http
