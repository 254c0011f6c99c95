// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/error.hpp>
#include <lrt/http/message.hpp>

namespace lrt::http {

/// What a server may send. Beyond each limit: Errc::limit_exceeded, with a message of its own.
struct ResponseLimits {
  std::size_t max_status_line_bytes = 512;
  std::size_t max_header_bytes = 16 * 1024;  ///< of the header section, those of interim responses before it included
  std::size_t max_fields = 1'000;            ///< of one header section or trailer section
  unsigned max_interim = 16;                 ///< responses 1xx before the final one
  std::optional<std::size_t> max_body_bytes{};
  std::size_t max_chunk_line_bytes = 4 * 1024;        ///< a chunk's size and extensions
  std::size_t max_chunk_extension_bytes = 16 * 1024;  ///< of all chunks, beyond as many bytes as the body has
  std::size_t max_trailer_bytes = 8 * 1024;
};

/// Reads one response from bytes as they arrive (RFC 9112): interim responses, header section, body, trailer section.
///
///     status-line  = HTTP-version SP 3DIGIT [ SP reason ]        RFC 9112 4; the space before an empty reason may be missing
///     HTTP-version = "HTTP/1." DIGIT                             RFC 9112 2.3
///     field-line   = field-name ":" OWS field-value OWS          RFC 9112 5; a folded line continues the value after a space (5.2)
///
/// Each line ends with CRLF; LF alone is an error, so that a server that copies an LF into a field cannot be made to send another field. A line that is
/// no field is left out; an error if it looks like one that frames the body. A response whose end two readers could find at different places is an
/// error (RFC 9112 6.3): two different lengths, a length beside a transfer coding, a coding that is not exactly `chunked`, which is the only one that a
/// request without TE permits.
class LRT_INTERNAL_API ResponseParser {
 public:
  enum class Step : std::uint8_t {
    more,      ///< all bytes are consumed
    interim,   ///< status() and fields() are of a response 1xx, which is not the last one
    header,    ///< status() and fields() are of the final response, or of 101
    body,      ///< body() is the next part
    complete,  ///< bytes that are left do not belong to the response
    failed     ///< error()
  };

  /// @param method      of the request
  /// @param may_switch  the request asked for another protocol: 101 is a final response. Else it is an error
  ResponseParser(std::string_view method, const ResponseLimits& limits, bool may_switch = false);

  /// For those who judge servers: chunks win over Content-Length, which is tolerated(). Else both are an error (RFC 9112 6.3 permits either).
  void read_chunks_despite_length() noexcept { reads_despite_length_ = true; }

  /// Consumes bytes from the front of `bytes`, to the next step. It is called again until it returns `more`, `complete` or `failed`.
  Step parse(std::string_view& bytes);
  /// The connection has ended: `complete`, or `failed` with Errc::closed.
  Step end();

  int status() const noexcept { return status_; }
  int version() const noexcept { return version_; }             ///< 10 or 11
  const Fields& fields() const noexcept { return fields_; }     ///< without those that have no value
  Fields take_fields() noexcept { return std::move(fields_); }  ///< once
  const Fields& trailers() const noexcept { return trailers_; }
  std::string_view body() const noexcept { return body_; }  ///< a part of the last bytes
  bool has_body() const noexcept { return has_body_; }      ///< false: it ends with its header section (HEAD, 101, 204, 304)
  /// Whether the connection can be used for another exchange, if no bytes are left.
  bool keeps_connection() const noexcept { return keeps_ && state_ == State::complete; }
  const Error& error() const noexcept { return error_; }
  /// The first thing that a server must not send and that was read all the same, for those who judge servers; empty: there is none.
  const std::string& tolerated() const noexcept { return tolerated_; }

 private:
  enum class State : std::uint8_t { status_line, fields, no_body, length, to_end, chunk_line, chunk, chunk_end, trailers, complete, failed };
  enum class Section : std::uint8_t { header, trailer };
  enum class Line : std::uint8_t { taken, incomplete, too_long, failed };

  Step fail(Errc code, std::string reason);
  void tolerate(std::string what);
  Line take_line(std::string_view& bytes, std::size_t max, std::string_view& line);
  Step status_line(std::string_view& bytes);
  Step field_lines(std::string_view& bytes, Section section);
  bool take_field_line(std::string_view line, Section section);
  bool finish_field(Section section);
  bool take_framing_field(std::string_view value);
  Step finish_header();
  Step frame_body();
  Step take_body(std::string_view& bytes);
  Step chunk_line(std::string_view& bytes);
  bool is_too_long(std::uint64_t more) const noexcept;
  Step fail_too_long();
  Step fail_long_header();

  const ResponseLimits limits_;
  const bool is_head_, may_switch_;
  bool reads_despite_length_ = false;
  State state_ = State::status_line;
  std::string line_;  ///< begin of a line whose end has not arrived
  bool line_is_taken_ = false;
  std::string name_, value_;  ///< a field whose next line may continue it
  bool has_field_ = false;
  std::size_t header_bytes_ = 0, trailer_bytes_ = 0, field_count_ = 0;
  unsigned interim_ = 0;
  int last_interim_ = 0;

  int status_ = 0, version_ = 11;
  Fields fields_, trailers_;
  std::optional<std::uint64_t> length_;
  std::string coding_;
  bool has_coding_ = false, has_body_ = false, keeps_ = true;
  std::uint64_t rest_ = 0;  ///< of the body or of a chunk
  std::uint64_t body_bytes_ = 0, extension_bytes_ = 0;
  std::string_view body_;
  Error error_{Errc::expected_http, {}};
  std::string tolerated_;
};

}  // namespace lrt::http
