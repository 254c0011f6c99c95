// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <lrt/base/language.hpp>

#include "src/transport/body_buffer.hpp"

namespace lrt::transport {
/// Decodes a chunked body (RFC 9112 7.1) that arrives in pieces of any size. Stricter than the grammar where parsers
/// are known to differ: white space only around ';' and '=' of extensions, at most 15 hexadecimal digits, CRLF only, no
/// framing field in a trailer. Extensions and trailers are checked and dropped.
/// @par Implements  R0.1
class ChunkDecoder {
 public:
  enum class Status : unsigned char {
    more,       ///< all of the input was taken, and the body is not complete
    done,       ///< the body is complete; what is left of the input belongs to the next request
    bad,        ///< 400; see problem()
    too_large,  ///< 413
    no_memory,  ///< 503: BodyBuffer::append() has failed
  };

  /// Begins a new body.
  /// @param body_limit      bytes of the body
  /// @param overhead_limit  bytes of all extensions and trailers
  void reset(std::size_t body_limit, std::size_t overhead_limit) noexcept;

  /// Consumes from the front of `input` and appends the body's bytes to `body`.
  Status feed(std::string_view& input, BodyBuffer& body);

  /// What was wrong; a static text.
  std::string_view problem() const noexcept { return problem_; }

 private:
  enum class Part : unsigned char { size, data, data_end, trailer };

  bool take_line(std::string_view& input, Status& status);
  Status size_line();
  Status trailer_line();
  Status fail(std::string_view problem) noexcept;

  Part part_ = Part::size;
  std::uint64_t left_ = 0;  ///< bytes of the current chunk that are still to come
  std::size_t body_limit_ = 0;
  std::size_t overhead_left_ = 0;
  std::string line_;  ///< of a size or trailer line, without its CRLF when complete
  std::string_view problem_;
};

}  // namespace lrt::transport
