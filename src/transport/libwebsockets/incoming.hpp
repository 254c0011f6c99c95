// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/http/request_parser.hpp>
#include <lrt/http/message.hpp>

struct lws;

namespace lrt::libwebsockets {

/// A request as libwebsockets has parsed it, copied: libwebsockets forgets the header section before the response is written.
class Incoming {
 public:
  /// Reads the header section that is attached to `wsi`, and refuses what http::check_request() refuses, more than one method, and values with
  /// control characters. request.secure must be set.
  std::optional<http::Refusal> read(lws* wsi, http::Framing& framing);
  /// Takes the fields out that frame the body.
  void strip_framing_fields();

  http::Request request;

 private:
  struct Piece {
    std::size_t begin, size;
  };
  std::optional<http::Refusal> read_request_line(lws* wsi, Piece& target);
  void read_known_fields(lws* wsi);
  void read_other_fields(lws* wsi);
  void read_other_field(lws* wsi, std::string_view name_with_colon);
  std::string_view view(Piece piece) const noexcept { return std::string_view(text_).substr(piece.begin, piece.size); }

  std::string text_;
  struct Line {
    Piece name, value;
  };
  std::vector<Line> lines_;
};

}  // namespace lrt::libwebsockets
