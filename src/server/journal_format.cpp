// SPDX-License-Identifier: Apache-2.0
#include "src/server/journal_format.hpp"

#include <algorithm>
#include <cstdio>

#include "src/base/crc32c.hpp"

namespace lrt::journal {
namespace {

// "= c 000000000000001f 0000000000000007 0000000000000006 89abcdef\n"
constexpr std::string_view start = "= ";
constexpr std::size_t kind_at = 2, length_at = 4, number_at = 21, saved_at = 38, sum_at = 55;
constexpr std::size_t digits = 16, sum_digits = 8;
constexpr std::size_t window = std::size_t{64} * 1024;
static_assert(sum_at + sum_digits + 1 == head_size);

std::optional<std::uint64_t> hexadecimal(std::string_view text) noexcept {
  std::uint64_t value = 0;
  for (const char c : text) {
    const unsigned digit = c >= '0' && c <= '9' ? static_cast<unsigned>(c - '0') : c >= 'a' && c <= 'f' ? static_cast<unsigned>(c - 'a' + 10) : 16U;
    if (digit > 15) return std::nullopt;
    value = value << 4U | digit;
  }
  return value;
}

}  // namespace

void append(std::string& out, Kind kind, std::uint64_t number, std::uint64_t saved, std::string_view content) {
  char line[head_size + 1];
  (void)std::snprintf(line, sizeof line, "= %c %016llx %016llx %016llx ", static_cast<char>(kind), static_cast<unsigned long long>(content.size()),
                      static_cast<unsigned long long>(number), static_cast<unsigned long long>(saved));
  const std::uint32_t sum = crc32c(content, crc32c({line, sum_at}));
  (void)std::snprintf(line + sum_at, sizeof line - sum_at, "%08lx\n", static_cast<unsigned long>(sum));
  out.append(line, head_size).append(content);
}

std::optional<Reader::Head> Reader::read_head(std::string_view line) const noexcept {
  if (line.size() != head_size || line.substr(0, start.size()) != start || line.back() != '\n') return std::nullopt;
  for (const std::size_t space : {length_at, number_at, saved_at, sum_at})
    if (line[space - 1] != ' ') return std::nullopt;
  const char kind = line[kind_at];
  if (kind != 's' && kind != 'b' && kind != 'c' && kind != 'e') return std::nullopt;
  const auto length = hexadecimal(line.substr(length_at, digits)), number = hexadecimal(line.substr(number_at, digits)),
             saved = hexadecimal(line.substr(saved_at, digits)), sum = hexadecimal(line.substr(sum_at, sum_digits));
  if (!length || !number || !saved || !sum || *saved >= *number) return std::nullopt;
  return Head{static_cast<Kind>(kind), *length, *number, *saved, static_cast<std::uint32_t>(*sum)};
}

/// Reads the content to content_.
Result<bool> Reader::is_whole(const Head& head, std::string_view line, std::uint64_t offset) {
  if (head.length > size_ - offset - head_size) return false;
  content_.resize(static_cast<std::size_t>(head.length));
  Result<std::size_t> got = read_(offset + head_size, content_.data(), content_.size());
  if (!got) return Unexpected{std::move(got).error()};
  return *got == content_.size() && crc32c(content_, crc32c(line.substr(0, sum_at))) == head.sum;
}

Result<std::optional<Reader::Record>> Reader::next() {
  using Found = std::optional<Record>;
  if (size_ < head_size || offset_ > size_ - head_size) return Found();
  char line[head_size];
  Result<std::size_t> got = read_(offset_, line, head_size);
  if (!got) return Unexpected{std::move(got).error()};
  const std::optional<Head> head = read_head({line, *got});
  if (!head || head->number != number_) return Found();
  Result<bool> whole = is_whole(*head, {line, head_size}, offset_);
  if (!whole) return Unexpected{std::move(whole).error()};
  if (!*whole) return Found();
  offset_ += head_size + head->length;
  ++number_;
  return Found(Record{head->kind, head->number, content_});
}

Result<bool> Reader::is_damaged() {
  // A hostile file has a beginning of a long record at every place. Each byte is summed a few times at most; then it is taken as damaged.
  std::uint64_t budget = 8 * (size_ - std::min(size_, offset_)) + window;
  std::string piece;
  for (std::uint64_t from = offset_; from < size_ && size_ - from >= head_size;) {
    piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(window, size_ - from)));
    Result<std::size_t> got = read_(from, piece.data(), piece.size());
    if (!got) return Unexpected{std::move(got).error()};
    piece.resize(*got);
    if (piece.size() < head_size) break;
    const std::size_t last = piece.size() - head_size;
    for (std::size_t at = piece.find(start); at <= last; at = piece.find(start, at + 1)) {
      const std::string_view line = std::string_view(piece).substr(at, head_size);
      const std::optional<Head> head = read_head(line);
      if (!head || head->number < number_ || head->saved < number_ || head->length > size_ - (from + at) - head_size) continue;
      if (head->length > budget) return true;
      budget -= head->length;
      Result<bool> whole = is_whole(*head, line, from + at);
      if (!whole || *whole) return whole;
    }
    from += last + 1;
  }
  return false;
}

}  // namespace lrt::journal
