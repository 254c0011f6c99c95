#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/http/message.hpp>

namespace lrt::http {

/// Builds Link field lines (RFC 8288) that clients with small limits can read: several links share a line of at most 4 KiB, and
/// all lines together keep to a budget. A link that does not fit is left out whole, with all that follow; finish() then says
/// where the rest is.
/// @par Implements  R0.9
class LinkWriter {
 public:
  explicit LinkWriter(std::size_t budget = 8 * 1024) : budget_(budget) {}

  /// @param target  IRI reference; bytes that RFC 3986 does not allow are percent-encoded
  /// @param type    media type of the target (RFC 8288 3.4.1); empty: none. Quotes in it are left out
  void add(std::string_view target, std::string_view rel, std::string_view type = {});
  /// Appends the lines to `fields`; when links were left out, with one to `rest` as the last, for which space was reserved.
  void finish(Fields& fields, std::string_view rest, std::string_view rest_rel = "next");
  bool cut() const noexcept { return cut_; }

 private:
  bool put(const std::string& link);
  void take_back();

  std::size_t budget_;
  std::size_t used_ = 0;
  std::vector<std::string> lines_;
  bool cut_ = false;
};

}  // namespace lrt::http
