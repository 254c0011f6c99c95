// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
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
  std::string body;                   ///< of a response whose length is wrong: all bytes until the end of the connection
  std::vector<int> interim;           ///< statuses 1xx before it
  std::string framing_fault;          ///< empty: header section and length are well-formed and agree with the bytes
  std::string forbidden_body;         ///< bytes after a response that has no body (HEAD, 204, 304)
  bool forbidden_length = false;      ///< a 204 has Content-Length or Transfer-Encoding (RFC 9110 8.6, RFC 9112 6.1)
  bool truncated = false;             ///< a limit of the check has ended the body; the rest is not judged
  bool closed = false;                ///< the server has ended the connection
  std::chrono::milliseconds took{0};  ///< from the request to the end of the response, or until it was given up

  bool ok() const noexcept { return status >= 200 && status < 300; }
  bool timed_out() const noexcept { return error && error->code == Errc::timed_out; }
  /// A limit of the check was reached before: nothing was sent.
  bool not_asked() const noexcept { return error && error->code == Errc::cancelled; }
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
  /// Since the connection was requested.
  void begun(exchange::Instant at) noexcept { begun_ = at; }

 private:
  void take_header(Reply& reply, const http::ResponseParser& parser);
  bool read_response(Reply& reply, std::string_view method, exchange::Instant until);

  std::unique_ptr<exchange::Wire> wire_;
  int stop_descriptor_;
  const CheckOptions& options_;
  std::string received_;
  bool ended_ = false;
  std::optional<Error> error_;
  exchange::Instant begun_ = std::chrono::steady_clock::now();
};

/// Two responses that must not both be right.
struct Pair {
  Exchange before, after;
};

/// The monotonic clock of a server in its field Robot-Time: "<run>/<ms>".
struct RobotTime {
  std::string instance;
  unsigned long long ms = 0;

  static std::optional<RobotTime> parse(std::string_view text);
  std::string text() const { return instance + "/" + std::to_string(ms); }
};

/// Sends requests, within the limits of the options, and records properties of all responses.
class Probe {
 public:
  Probe(client::HttpClient& http, const CheckOptions& options);

  /// Each request has a connection of its own with `Connection: close`, so that a wrong length shows and cannot disturb the next response.
  Exchange ask(const std::string& method, const std::string& url, const FieldList& fields = {}, const std::string& body = {});
  /// Sends bytes that may be no valid request, and reads one response.
  Exchange raw(const std::string& url, const std::string& bytes, std::string_view method = "GET");
  /// Sends the header section of a request whose body never comes, so that it cannot have an effect. Status 100: the server wants the body.
  Exchange ask_without_body(const std::string& method, const std::string& url, const FieldList& fields);
  /// A connection; an exchange whose error says why there is none.
  Result<Connection> connect(const std::string& url);

  /// "Host: ..." and the fields of the identity, each with its line end.
  std::string own_fields(const std::string& url);
  /// Bytes that were sent, without what identifies the sender.
  std::string shown(const std::string& url, std::string bytes);
  exchange::Instant until() const;                                 ///< of one response
  exchange::Instant within(std::chrono::milliseconds time) const;  ///< from now, but within the whole check
  /// The time that a response of this server usually takes: half of them take less.
  std::chrono::milliseconds usual_time() const;
  /// A wait for something that a fast server does in `time`, with what this server usually needs in addition.
  exchange::Instant patiently(std::chrono::milliseconds time) const { return within(time + 4 * usual_time()); }
  /// The server is so fast that a response that did not come in time will not come.
  bool is_fast() const;
  /// The fields of a command: Valid-Until, for servers that announce Robot-Time.
  FieldList command_fields() const;
  bool exhausted() const;  ///< no further request is sent
  std::size_t requests() const noexcept { return requests_; }
  std::string limit_reached() const;

  // Properties of the responses to ask().
  std::vector<Exchange> without_date, framing_faults, not_closed, bodies_of_head, bodies_where_none_may_be;
  std::vector<Exchange> of_another_version;
  std::size_t bodiless = 0;  ///< responses 204 and 304
  std::optional<Exchange> first_bodiless;
  std::vector<int> statuses;  ///< of all responses, raw() included

  // What the responses say together.
  std::vector<Pair> tag_stays, tag_moves;  ///< one tag, other bytes; the same bytes, another tag
  std::optional<Pair> date_back, last_modified_back;
  std::optional<Exchange> has_last_modified, last_modified_moves, changed_tag;
  std::vector<Exchange> invalid_dates, modified_later;
  std::optional<Exchange> first_dated, last_dated;
  long long date_offset_first = 0, date_offset_last = 0;  ///< seconds that Date is after this machine's clock
  std::chrono::seconds dated_for{0};                      ///< between these two
  std::optional<Exchange> slowest, first_timed_out;
  std::size_t timed_out = 0;
  std::optional<RobotTime> robot_time;  ///< the last one
  std::optional<Exchange> with_robot_time;
  std::size_t robot_times = 0;
  std::string robot_time_fault;
  std::optional<Exchange> robot_time_evidence;

 private:
  void record(const Exchange& exchange, const std::string& method, const FieldList& fields);
  void record_dates(const Exchange& exchange);
  void record_robot_time(const Exchange& exchange);
  void record_time(const Exchange& exchange);
  void record_representation(const Exchange& exchange, const std::string& method, const FieldList& fields);

  client::HttpClient& http_;
  const CheckOptions& options_;
  exchange::Instant end_;
  const exchange::Instant begin_;
  std::size_t requests_ = 0;
  bool closes_ = true, ignores_expect_ = false;
  std::vector<std::chrono::milliseconds> times_;
  exchange::Instant date_begin_{};
  /// The last representation of a URL and what was negotiated, without most of its body.
  struct Seen {
    Exchange exchange;
    std::string tag, media_type;
    std::size_t hash = 0, writes = 0;
    std::optional<long long> date, last_modified;
  };
  std::map<std::string, Seen> seen_;
  std::size_t writes_ = 0;  ///< successful requests that may have changed something
};

/// Seconds since 1970 of an HTTP date in the format that servers must generate (RFC 9110 5.6.7, IMF-fixdate).
std::optional<long long> http_seconds(std::string_view text);

/// The parts of a URL without its fragment.
Result<http::Url> url_of(const std::string& url);
std::string without_fragment(const std::string& url);
/// The members of a field that is a list, without quoted strings.
std::vector<std::string> list_of(const std::string& value);
/// Printable, at most `max` bytes.
std::string excerpt(std::string_view text, std::size_t max);

}  // namespace lrt::check
