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

/// A header field of a request or response (RFC 9110 5). Views; they live as long as the message they are taken from.
/// @par Threads  Any, as long as nobody changes the message.
struct Field {
  std::string_view name;   ///< as received; compare with iequals
  std::string_view value;  ///< without surrounding white space
};

/// Compares without regard to the case of ASCII letters, for field names and tokens.
/// @par Threads  Any.
/// @par Time     Linear in the texts. Does not allocate.
LRT_API bool iequals(std::string_view a, std::string_view b) noexcept;

/// A complete request: http::parse_request_header() has accepted its header section, and its body has been received.
///
/// All views belong to the transport and are valid during the call that gets the request.
///
/// @par Threads  Distinct objects: any thread. One object: any number of reading threads.
/// @par Time     find(), count(), joined(): linear in the fields. Only joined() allocates.
/// @par Implements  R0.1, RFC 9110, RFC 9112
struct LRT_API Request {
  std::string_view method;                ///< case-sensitive, as received: "GET"
  std::string_view target;                ///< as received: origin-form, absolute-form, or "*"
  int version = 11;                       ///< 10 or 11; 11 also for a later minor version
  std::vector<Field> fields;              ///< in the order received, without those that framed the body (trailers are dropped)
  std::string_view body;                  ///< without the chunked coding; empty: none
  std::string_view peer;                  ///< numeric address of the client, "127.0.0.1"
  bool secure = false;                    ///< came over TLS
  std::string_view client_certificate{};  ///< subject of the client's verified certificate (RFC 2253); empty: the client sent none
  bool can_upgrade = false;               ///< the transport can turn this connection into a WebSocket
  bool must_upgrade_now = false;          ///< with can_upgrade: the transport cannot delay the handshake until a deferred response
  bool can_stream = false;                ///< the transport can send a response of unknown length: an event stream
  std::string_view mount{};               ///< path prefix of lrt in a host's own HTTP server, "/robot"; `target` is without it
  std::uint16_t local_port = 0;           ///< port of that server; 0: the request came over lrt's own transport
  /// The result of authorization that engine::Handler::judge_header() stored when it accepted the header section
  /// (HeaderVerdict::judged). The engine does not authorize the request again. Only the caller of that function sets
  /// it. nullptr: the header section has not been judged.
  std::shared_ptr<const void> judged{};
  /// Owns the bytes of `body`. A copy of this pointer keeps them valid after the call, on any thread. nullptr: they are
  /// valid during the call.
  std::shared_ptr<const void> body_owner{};

  /// The value of the first field of that name, compared without case; nullopt: there is none.
  std::optional<std::string_view> find(std::string_view name) const noexcept;
  /// All values of that name, joined with ", " (RFC 9110 5.3).
  std::string joined(std::string_view name) const;
  /// The number of fields of that name.
  std::size_t count(std::string_view name) const noexcept;
};

/// Header fields in the form in which they are sent: a line `Name: value CRLF` for each.
///
/// @par Threads  Distinct objects: any thread, also after share(). One object: one thread at a time, or any number of
///               reading threads.
/// @par Time     find(), joined() and list(): linear in the bytes of all fields. has(), block(), a copy after share(): constant.
class LRT_API Fields {
 public:
  /// Names whose presence is known without a search.
  enum class Known : std::uint8_t { date = 1, content_length = 2, transfer_encoding = 4, upgrade = 8, content_type_options = 16 };

  /// Appends a field, without the white space around the value. Bytes that a field value must not have (CR, LF, NUL and
  /// other controls) become spaces, so a value cannot begin another field (RFC 9110 5.5).
  /// @pre `name` is a token (RFC 9110 5.6.2). This is asserted; without assertions the field is not added.
  void add(std::string_view name, std::string_view value);
  /// Replaces all fields of that name by one field.
  void set(std::string_view name, std::string_view value);
  /// Removes all fields of that name.
  void remove(std::string_view name);
  /// Appends all fields of another object.
  void append(const Fields& other);
  /// Makes copies cheap: copies of this object share its bytes until one of them is changed.
  void share();

  /// The value of the first field of that name; nullopt: there is none. The view is valid until this object is changed.
  std::optional<std::string_view> find(std::string_view name) const noexcept;
  /// All values of that name, joined with ", " (RFC 9110 5.3).
  std::string joined(std::string_view name) const;
  /// All fields in order. The views are valid until this object is changed.
  std::vector<Field> list() const;
  /// Whether there is a field of that name. Constant time.
  bool has(Known name) const noexcept { return (known_ & static_cast<std::uint8_t>(name)) != 0; }
  /// All lines, as they are sent, without the empty line that ends a header section.
  const std::string& block() const noexcept { return shared_ ? *shared_ : own_; }

 private:
  std::string& changeable();

  std::string own_;
  std::shared_ptr<const std::string> shared_;  ///< instead of own_
  std::uint8_t known_ = 0;                     ///< bits of Known
};

/// Why a server refused a request, for counters and audit. It is not sent to the client.
enum class Denial : std::uint8_t {
  none,           ///< the request was not refused
  credentials,    ///< 401: the request has no valid credentials
  right,          ///< 403, or 404 to hide the resource: the client does not have the right
  origin,         ///< 403: a page of another origin
  notification,   ///< 403: the notification of another server
  receiver,       ///< 403: the server may not post to this receiver
  host,           ///< 421: the server does not serve this host name
  rate,           ///< 429: the client sends too much
  invocations,    ///< 429: the client has too many invocations
  subscriptions,  ///< 429: the client has too many subscriptions
  late,           ///< 412: the time until which the command was valid has passed
  control,        ///< 409, 428: the client does not have control (Thing::control())
};
inline constexpr std::size_t denial_count = 12;  ///< the number of enumerators of Denial, `none` included
/// The enumerator's name; empty for `none`.
/// @par Threads  Any.
/// @par Time     Constant. The view is valid until the process ends.
LRT_API std::string_view to_string(Denial denial) noexcept;

/// A response. The transport adds Date, Content-Length and Connection. The body of a response to HEAD is not sent, but
/// Content-Length states its size.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
///               Responses may share a body.
struct Response {
  int status = 200;                         ///< status code (RFC 9110 15)
  Fields fields;                            ///< without those that the transport adds
  std::shared_ptr<const std::string> body;  ///< nullptr: none. Shared, so that one cached representation is sent to many clients without a copy
  bool close = false;                       ///< the transport closes the connection after this response
  Denial denial = Denial::none;             ///< why the request was refused

  /// The body; empty if there is none.
  std::string_view content() const noexcept { return body ? std::string_view(*body) : std::string_view(); }
  /// Makes a text the body.
  void set_body(std::string text) { body = std::make_shared<const std::string>(std::move(text)); }
};

/// The reason phrase of a status code, "Not Found"; empty for a code that RFC 9110 does not define.
/// @par Threads  Any.
/// @par Time     Constant. The view is valid until the process ends.
LRT_API std::string_view reason_phrase(int status) noexcept;

/// Whether a response with this status has a body: false for 1xx, 204 and 304. Such a response gets no Content-Length.
constexpr bool may_have_body(int status) noexcept { return status >= 200 && status != 204 && status != 304; }

/// The fields that a transport adds to a response.
/// @par Implements  RFC 9110 6.6.1, 8.6, RFC 9112 9.6
struct AddedFields {
  bool date = false;            ///< the response has no Date yet
  bool content_length = false;  ///< with the size of response.content()
  std::string_view connection;  ///< value of Connection; empty: none
};
/// Which fields a transport adds. Connection has `close` if the connection ends, and `Upgrade` if the response has that
/// field (RFC 9110 7.8).
/// @param keep_alive  whether the connection stays open
/// @param version     version of the request, 10 or 11. An HTTP/1.0 client whose connection stays open gets Connection:
///                    keep-alive
/// @par Threads  Any.
/// @par Time     Constant. Does not allocate.
LRT_API AddedFields added_fields(const Response& response, bool keep_alive, int version) noexcept;

/// How a client finds the end of a response's body (RFC 9112 6.3).
enum class BodyEnd : std::uint8_t {
  length,   ///< Content-Length, that of response.content()
  chunked,  ///< the last chunk of Transfer-Encoding: chunked
  close,    ///< the end of the connection; for HTTP/1.0
};

/// Appends the status line, the fields of the response, those of added_fields() and the empty line. Date and
/// Content-Length are not added if `response.fields` has them.
/// @param date        an IMF-fixdate, see to_http_date()
/// @param keep_alive  whether the connection stays open
/// @param version     version of the request, 10 or 11
/// @param more        further fields; nullptr: none
/// @par Threads  Any.
/// @par Time     Linear in the fields.
/// @par Implements  RFC 9112 4, 5, 6
LRT_API void write_response_header(std::string& out, const Response& response, std::string_view date, bool keep_alive, int version,
                                   BodyEnd end = BodyEnd::length, const Fields* more = nullptr);

}  // namespace v0
}  // namespace lrt::http
