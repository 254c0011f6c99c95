// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/check.hpp>
#include <lrt/http/message.hpp>

#include "src/client/http_client.hpp"
#include "src/http/response_parser.hpp"
#include "src/http/url.hpp"

namespace lrt::check {

using FieldList = std::vector<std::pair<std::string, std::string>>;

/// A response as it was framed on the wire. What the parser tolerates is an error here, because the checks report it.
struct Reply {
  std::optional<Error> error;  ///< there is no status line and header section: why
  std::string version;         ///< "HTTP/1.1"
  int status = 0;
  http::Fields fields;
  std::string body;               ///< of a response whose length is wrong: all bytes until the end of the connection
  std::vector<int> interim;       ///< statuses 1xx before it
  std::string framing_fault;      ///< empty: header section and length are well-formed and agree with the bytes
  std::string forbidden_body;     ///< bytes after a response that has no body (HEAD, 204, 304)
  bool forbidden_length = false;  ///< a 204 has Content-Length or Transfer-Encoding (RFC 9110 8.6, RFC 9112 6.1)
  bool truncated = false;         ///< a limit of the check has ended the body; the rest is not judged
  bool closed = false;            ///< the server has ended the connection

  bool ok() const noexcept { return status >= 200 && status < 300; }
  std::string field(std::string_view name) const { return std::string(fields.find(name).value_or(std::string_view())); }
  std::string media_type() const;
};

/// A request, or raw bytes, and the response.
struct Exchange {
  std::string url;
  std::string sent;
  Reply reply;

  Evidence evidence() const;
};

/// One connection for bytes of the caller's own.
class Connection {
 public:
  Connection(std::unique_ptr<exchange::Wire> wire, int stop_descriptor, const CheckOptions& options);

  Result<void> write(std::string_view bytes, exchange::Instant until);
  /// Reads a response to a request with that method.
  /// @param close  the request had `Connection: close`: reads until the end of the connection, at most options.close_time after the response
  Reply read(std::string_view method, exchange::Instant until, bool close, std::chrono::milliseconds close_time);
  /// Appends what has been received. False: the end of the connection, or the time is over.
  bool receive(exchange::Instant until);
  /// Waits for the end of the connection. False: it is still open.
  bool ends(exchange::Instant until);
  std::string& received() noexcept { return received_; }
  bool ended() const noexcept { return ended_; }

 private:
  void take_header(Reply& reply, const http::ResponseParser& parser);
  bool read_response(Reply& reply, std::string_view method, exchange::Instant until);

  std::unique_ptr<exchange::Wire> wire_;
  int stop_descriptor_;
  const CheckOptions& options_;
  std::string received_;
  bool ended_ = false;
  std::optional<Error> error_;
};

/// Sends requests, within the limits of the options, and records properties of all responses.
class Probe {
 public:
  Probe(client::HttpClient& http, const CheckOptions& options);

  /// Each request has a connection of its own with `Connection: close`, so that a wrong length shows and cannot disturb the next response.
  Exchange ask(const std::string& method, const std::string& url, const FieldList& fields = {}, const std::string& body = {});
  /// Sends bytes that may be no valid request, and reads one response.
  Exchange raw(const std::string& url, const std::string& bytes, std::string_view method = "GET");
  /// A connection; an exchange whose error says why there is none.
  Result<Connection> connect(const std::string& url);

  /// "Host: ..." and the fields of the identity, each with its line end.
  std::string own_fields(const std::string& url);
  /// Bytes that were sent, without what identifies the sender.
  std::string shown(const std::string& url, std::string bytes);
  exchange::Instant until() const;                                 ///< of one response
  exchange::Instant within(std::chrono::milliseconds time) const;  ///< from now, but within the whole check
  bool exhausted() const;                                          ///< no further request is sent
  std::size_t requests() const noexcept { return requests_; }
  std::string limit_reached() const;

  // Properties of the responses to ask().
  std::vector<Exchange> without_date, framing_faults, not_closed, bodies_of_head, bodies_where_none_may_be;
  std::vector<Exchange> of_another_version;
  std::size_t bodiless = 0;  ///< responses 204 and 304
  std::optional<Exchange> first_bodiless;
  std::vector<int> statuses;  ///< of all responses, raw() included

 private:
  void record(const Exchange& exchange, const std::string& method);

  client::HttpClient& http_;
  const CheckOptions& options_;
  exchange::Instant end_;
  std::size_t requests_ = 0;
  bool closes_ = true;
};

/// The parts of a URL without its fragment.
Result<http::Url> url_of(const std::string& url);
std::string without_fragment(const std::string& url);
/// Printable, at most `max` bytes.
std::string excerpt(std::string_view text, std::size_t max);

}  // namespace lrt::check
