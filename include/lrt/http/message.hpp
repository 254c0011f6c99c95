// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {
inline namespace v0 {

struct Field {
  std::string_view name;   ///< as received; compare with iequals
  std::string_view value;  ///< without surrounding white space
};

/// ASCII case-insensitive comparison, for field names and tokens.
LRT_API bool iequals(std::string_view a, std::string_view b) noexcept;

/// A request whose header section http::parse_request_header() has accepted and whose body is complete. All views belong to the transport and
/// live for the call.
struct LRT_API Request {
  std::string_view method;
  std::string_view target;    ///< as received: origin-form, absolute-form, or "*"
  int version = 11;           ///< 10 or 11; 11 also for a later minor version
  std::vector<Field> fields;  ///< in the order received, without those that framed the body (trailers are dropped)
  std::string_view body;
  std::string_view peer;                  ///< numeric address of the client, "127.0.0.1"
  bool secure = false;                    ///< came over TLS
  std::string_view client_certificate{};  ///< subject of the client's verified certificate (RFC 2253); empty: it showed none
  bool can_upgrade = false;               ///< the transport can turn this connection into a WebSocket
  bool must_upgrade_now = false;          ///< with can_upgrade: the transport cannot wait with the handshake for a deferred response
  bool can_stream = false;                ///< the transport can send a response that goes on: an event stream
  std::string_view mount{};               ///< path prefix under which a host's own HTTP server serves this, "/robot"; taken off the target
  std::uint16_t local_port = 0;           ///< of that server; 0: the request came over lrt's own transport
  /// What engine::Handler::judge_header() found out when it let this request pass (HeaderVerdict::judged): who sends it is not asked again. Only what
  /// calls that function sets it. nullptr: the header section has not been judged.
  std::shared_ptr<const void> judged{};
  /// Keeps the bytes of `body` for whoever has a copy of it, on any thread. nullptr: the bytes last as long as the call.
  std::shared_ptr<const void> body_owner{};

  /// The value of the first field of that name.
  std::optional<std::string_view> find(std::string_view name) const noexcept;
  /// All values of that name, joined with ", " (RFC 9110 5.3).
  std::string joined(std::string_view name) const;
  std::size_t count(std::string_view name) const noexcept;
};

/// Header fields as the bytes that go on the wire, `Name: value CRLF` each; to send them is to copy bytes.
class LRT_API Fields {
 public:
  /// Names whose presence is known without a search.
  enum class Known : std::uint8_t { date = 1, content_length = 2, transfer_encoding = 4, upgrade = 8, content_type_options = 16 };

  /// Appends, without white space around the value. CR, LF, NUL and other controls in it become spaces: nothing that reached a
  /// value can start another field.
  /// @pre `name` is a token (RFC 9110 5.6.2); otherwise nothing is added
  void add(std::string_view name, std::string_view value);
  /// Replaces all fields of that name by one.
  void set(std::string_view name, std::string_view value);
  void remove(std::string_view name);
  /// Appends a block of whole lines made by another Fields.
  void append(const Fields& other);
  /// From now on copies of this share its bytes. The first change of one of them copies the bytes.
  void share();

  /// The value of the first field of that name; a view into this object.
  std::optional<std::string_view> find(std::string_view name) const noexcept;
  std::string joined(std::string_view name) const;
  std::vector<Field> list() const;
  bool has(Known name) const noexcept { return (known_ & static_cast<std::uint8_t>(name)) != 0; }
  const std::string& block() const noexcept { return shared_ ? *shared_ : own_; }

 private:
  std::string& changeable();

  std::string own_;
  std::shared_ptr<const std::string> shared_;  ///< instead of own_
  std::uint8_t known_ = 0;                     ///< bits of Known
};

/// Why a server has refused a request: for its counters and its audit. It is not sent.
enum class Denial : std::uint8_t {
  none,
  credentials,    ///< 401: there are none, or they are not valid
  right,          ///< 403, or 404: they do not permit it
  origin,         ///< 403: a page of another origin
  notification,   ///< 403: the notification of another server
  receiver,       ///< 403: the server may not post to this receiver
  host,           ///< 421
  rate,           ///< 429: the client sends too much
  invocations,    ///< 429: the client has too many invocations
  subscriptions,  ///< 429: the client has too many subscriptions
};
inline constexpr std::size_t denial_count = 10;
/// The enumerator's name; empty for `none`.
LRT_API std::string_view to_string(Denial denial) noexcept;

/// A response. The transport adds Date, Content-Length and Connection; a body given for HEAD is counted, not sent.
struct Response {
  int status = 200;
  Fields fields;
  std::shared_ptr<const std::string> body;  ///< shared: a cached representation is sent to many without a copy
  bool close = false;                       ///< the connection ends with this response
  Denial denial = Denial::none;

  std::string_view content() const noexcept { return body ? std::string_view(*body) : std::string_view(); }
  void set_body(std::string text) { body = std::make_shared<const std::string>(std::move(text)); }
};

/// "Not Found"; an empty view for a code that RFC 9110 does not know.
LRT_API std::string_view reason_phrase(int status) noexcept;

/// False for 1xx, 204 and 304, which have no body and no Content-Length here.
constexpr bool may_have_body(int status) noexcept { return status >= 200 && status != 204 && status != 304; }

/// The fields that a transport adds to a response.
struct AddedFields {
  bool date = false;
  bool content_length = false;  ///< that of response.content()
  std::string_view connection;  ///< value of Connection; empty: none
};
/// Connection names `close`, and `Upgrade` if the response has that field (RFC 9110 7.8).
/// @param version  of the request: an HTTP/1.0 client whose connection is kept gets Connection: keep-alive
LRT_API AddedFields added_fields(const Response& response, bool keep_alive, int version) noexcept;

/// How a client finds the end of a response's body (RFC 9112 6.3).
enum class BodyEnd : std::uint8_t {
  length,   ///< Content-Length, that of response.content()
  chunked,  ///< the last chunk of Transfer-Encoding: chunked
  close,    ///< the end of the connection; for HTTP/1.0
};

/// Writes the header section of a response with its empty line. Date and Content-Length are left out where `response.fields` has them.
/// @param date  an IMF-fixdate
LRT_API void write_response_header(std::string& out, const Response& response, std::string_view date, bool keep_alive, int version,
                                   BodyEnd end = BodyEnd::length);

}  // namespace v0
}  // namespace lrt::http
