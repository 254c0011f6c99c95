// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/http/message.hpp>

#include "src/base/function_ref.hpp"

struct z_stream_s;

namespace lrt::exchange {

/// A few bytes can decode to gigabytes. Beyond each limit: Errc::limit_exceeded, with a message of its own.
struct DecodingLimits {
  std::optional<std::size_t> max_bytes{};  ///< decoded
  /// How many times as long as the body its decoded form may be, beyond 64 KiB. Turtle of many equal things reaches 50; the most that deflate has is 1,032.
  std::size_t max_ratio = 200;
  std::size_t max_codings = 2;  ///< on top of each other
};

/// Undoes the content codings of a body as it arrives (RFC 9110 8.4): gzip, x-gzip, and deflate with or without the header of zlib.
class LRT_INTERNAL_API ContentDecoder {
 public:
  /// Gets decoded bytes; false ends decoding.
  using Sink = FunctionRef<bool(std::string_view bytes)>;

  /// @return  nullptr: the body has no coding, or `identity` only
  /// @par Errors  expected_http: an unknown coding; limit_exceeded: too many
  static Result<std::unique_ptr<ContentDecoder>> make(const http::Fields& fields, const DecodingLimits& limits);
  ~ContentDecoder();
  ContentDecoder(const ContentDecoder&) = delete;
  ContentDecoder& operator=(const ContentDecoder&) = delete;

  /// @return  false: `sink` has ended it
  /// @par Errors  expected_http: not in the coding; limit_exceeded
  Result<bool> decode(std::string_view bytes, Sink sink);
  /// At the end of the body.
  /// @par Errors  expected_http: it is incomplete
  Result<void> finish() const;

 private:
  enum class Coding : std::uint8_t { gzip, deflate };
  struct Stage {
    Coding coding;
    std::unique_ptr<z_stream_s> stream{};
    std::unique_ptr<char[]> decoded_bytes{};
    std::string begin{};  ///< bytes that do not yet say which form of deflate it is
    bool is_begun = false, is_at_end = false;
    std::uint64_t decoded_size = 0;
  };
  explicit ContentDecoder(const DecodingLimits& limits);
  Result<bool> decode(std::size_t stage, std::string_view bytes, Sink sink);
  Result<void> begin(Stage& stage, std::string_view bytes);

  const DecodingLimits limits_;
  std::vector<Stage> stages_;   ///< the coding that was applied last is the first
  std::uint64_t received_ = 0;  ///< bytes of the body
};

}  // namespace lrt::exchange
