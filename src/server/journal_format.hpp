// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

#include "src/base/function_ref.hpp"

namespace lrt::journal {

/// The file of a kept graph: a first line, then records (docs/journal.md). All of it is text.

/// What the journals of all versions begin with.
inline constexpr std::string_view mark = "# lrt graph journal ";
inline constexpr std::string_view first_line = "# lrt graph journal 1\n";
/// A record is a line of this length, and its content.
inline constexpr std::size_t head_size = 64;

enum class Kind : char {
  part = 's',    ///< triples of the first content
  begin = 'b',   ///< the first content is complete
  change = 'c',  ///< a change
  end = 'e',     ///< the writer has ended, and all records before this one are on the disk
};

/// Appends a record.
/// @param number  1 for the first record of a file, then one more each
/// @param saved   the number of the last record that is known to be on the disk, as long as this one is in the file
LRT_INTERNAL_API void append(std::string& out, Kind kind, std::uint64_t number, std::uint64_t saved, std::string_view content);

/// Reads bytes of a file at an offset. Fewer than are wanted: the file ends.
using Read = FunctionRef<Result<std::size_t>(std::uint64_t offset, char* to, std::size_t size)>;

/// A reader of records, of one at a time.
class LRT_INTERNAL_API Reader {
 public:
  struct Record {
    Kind kind;
    std::uint64_t number;
    std::string_view content;  ///< until the next call
  };
  /// @param offset  of the next record
  /// @param number  of it
  Reader(Read read, std::uint64_t size, std::uint64_t offset, std::uint64_t number) : read_(read), size_(size), offset_(offset), number_(number) {}

  /// nullopt: no whole record follows.
  /// @par Errors  those of reading
  Result<std::optional<Record>> next();
  /// The offset behind the last whole record.
  std::uint64_t offset() const noexcept { return offset_; }
  /// Of the next record.
  std::uint64_t number() const noexcept { return number_; }
  /// Whether the file is known to have had a whole record at offset(), because a later one says so. Otherwise what follows is what a writer that was
  /// interrupted has left.
  /// @pre  next() found no whole record
  Result<bool> is_damaged();

 private:
  struct Head {
    Kind kind;
    std::uint64_t length, number, saved;
    std::uint32_t sum;
  };
  std::optional<Head> read_head(std::string_view line) const noexcept;
  Result<bool> is_whole(const Head& head, std::string_view line, std::uint64_t offset);

  Read read_;
  const std::uint64_t size_;
  std::uint64_t offset_, number_;
  std::string content_;
};

}  // namespace lrt::journal
