// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/http/message.hpp>

namespace lrt::http {

/// A link of a Link field (RFC 8288 3), as it is written.
struct WrittenLink {
  std::string_view target;  ///< IRI reference
  std::string relations;    ///< the value of the first rel: relation types, several apart by spaces
  std::string type;         ///< the value of the first type
  bool has_anchor = false;  ///< it is a link of another resource (RFC 8288 3.2)
};

/// Removes the first link from the value of a Link field.
/// @return  nullopt: it is ill-formed. It is removed, too
LRT_INTERNAL_API std::optional<WrittenLink> take_link(std::string_view& value);
/// Removes the first relation type from a list (RFC 8288 3.3). Empty: there is no other.
LRT_INTERNAL_API std::string_view take_relation(std::string_view& relations);

/// Builds Link field lines (RFC 8288). Several links share a line of at most 4 KiB, and all lines together stay within
/// a budget, because clients limit the size and the number of fields. If a link does not fit, it and all that follow
/// are left out, and finish() adds a link to where the rest is.
///
/// @par Threads  One thread at a time.
/// @par Time     add() is linear in the link. The memory is bounded by the budget; a link after the one that did not
///               fit costs nothing.
/// @par Implements  R0.9
class LinkWriter {
 public:
  /// @param budget  bytes of all lines together, with field names and line ends
  explicit LinkWriter(std::size_t budget = 8 * 1024) : budget_(budget) {}

  /// Adds a link.
  /// @param target  IRI reference; bytes that RFC 3986 does not allow are percent-encoded
  /// @param type    media type of the target (RFC 8288 3.4.1); empty: none. Quotes in it are left out
  void add(std::string_view target, std::string_view rel, std::string_view type = {});
  /// Sets a filter for later calls of add(): links are left out to targets for which `hidden` returns true.
  void leave_out(std::function<bool(std::string_view target)> hidden) { hidden_ = std::move(hidden); }
  bool leaves_out(std::string_view target) const { return hidden_ && hidden_(target); }
  /// Appends the lines to `fields`. If links were left out, the last link has the target `rest` and the relation
  /// `rest_rel`. If that needs space, more links are left out.
  void finish(Fields& fields, std::string_view rest, std::string_view rest_rel = "next");
  /// Leaves out the next `n` links, which an earlier response had. Call it between the links that every response has
  /// and the others.
  void skip(std::size_t n);
  /// Appends the lines. If links after those of skip() were left out, the last link has rel="next".
  /// @param rest  gets the number of links to skip, and returns the IRI of the response that has the rest
  void finish_in_parts(Fields& fields, const std::function<std::string(std::size_t)>& rest);
  /// Whether a link did not fit.
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

}  // namespace lrt::http
