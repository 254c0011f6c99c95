// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/session.hpp>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/http/date.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/http/request_parser.hpp>

#include "src/http/websocket.hpp"
#include "src/transport/body_buffer.hpp"
#include "src/transport/buffers.hpp"
#include "src/transport/chunks.hpp"

namespace lrt::transport {
namespace {

/// RFC 9112 2.2 requires to ignore "at least one" empty line before a request line.
constexpr int max_empty_lines = 4;
/// Bodies up to this size are copied behind their header section: sending one buffer is cheaper than sending two.
constexpr std::size_t copied_body_bytes = 2048;
/// This much of the body of a refused request is received and discarded, so that its connection can be kept.
constexpr std::size_t max_discarded_body_bytes = 16 * 1024;
/// A body larger than this is received after other connections were served.
constexpr std::size_t large_body_bytes = 16 * 1024;
/// The number of header fields for which a request keeps its capacity.
constexpr std::size_t kept_fields = 64;
/// Exchanges that are kept for the next requests of any session. Slow clients may need more.
constexpr std::size_t max_spare = 8;

/// A comment of an event stream (WHATWG HTML 9.2.5), so that proxies and peers see that the connection is alive.
constexpr std::string_view keep_alive_comment = ":\n\n";

/// chunk-size CRLF (RFC 9112 7.1)
void append_chunk_size(std::string& out, std::size_t size) {
  char digits[16];
  const auto end = std::to_chars(digits, digits + sizeof digits, size, 16).ptr;
  out.append(digits, end).append("\r\n");
}

bool may_begin_method(char c) noexcept { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

}  // namespace

/// A request that is being received and the response to it, with their buffers.
struct Exchange {
  /// Clears the client's data and keeps the capacity of buffers. Each request sets the rest before it is read.
  void clear();

  // Input: bytes that were received and not consumed. `rest` is a view of them while run() works, `in` holds them in between.
  std::string_view rest;
  std::string in;
  std::size_t in_used = 0;

  // The request that is being read.
  http::Request request;
  http::Framing framing;
  std::size_t scanned = 0;     ///< bytes of the header section that find_header_end() has seen
  std::size_t line_begin = 0;  ///< of the header section's last, incomplete line
  std::string header;          ///< the header section's bytes when the body did not come with them
  std::optional<BodyBuffer> body;
  ChunkDecoder chunks;
  std::size_t max_body_bytes = 0;         ///< of this request
  std::optional<http::Response> refusal;  ///< when its body, which is discarded, is over
  bool ignores_body = false;              ///< the body is discarded, and the request served
  std::size_t discarded_body_bytes = 0;

  // The response.
  std::unique_ptr<Session::Upgrade> upgrade;  ///< while the request is an opening handshake
  std::string out;
  std::shared_ptr<const std::string> out_body;  ///< behind `out`
  std::string_view out_tail;                    ///< behind that
  std::size_t out_sent = 0;
};

void Exchange::clear() {
  rest = {};
  release(in);
  in_used = 0;
  auto fields = std::move(request.fields);
  request = {};
  fields.clear();
  if (fields.capacity() <= kept_fields) request.fields = std::move(fields);
  release(header);
  body.reset();
  refusal.reset();
  upgrade.reset();
  release(out);
  out_body.reset();
  out_tail = {};
  out_sent = 0;
}

/// Private implementation: users' programs do not depend on its layout.
struct LRT_LOCAL SessionContext::State {
  explicit State(const Limits& given) : limits(given), bodies(given) { spare.reserve(max_spare); }

  std::unique_ptr<Exchange> take_exchange();
  void give_back(std::unique_ptr<Exchange> exchange) noexcept;

  const Limits limits;
  BodyBudget bodies;
  std::vector<std::unique_ptr<Exchange>> spare;  ///< of sessions that are idle now
  std::chrono::seconds date_second{-1};
  std::string date;
};

SessionContext::SessionContext(const Limits& limits) : state_(std::make_unique<State>(limits)) {}
SessionContext::~SessionContext() = default;

const Limits& SessionContext::limits() const noexcept { return state_->limits; }
BodyBudget& SessionContext::bodies() noexcept { return state_->bodies; }

std::unique_ptr<Exchange> SessionContext::State::take_exchange() {
  if (spare.empty()) return std::make_unique<Exchange>();
  auto exchange = std::move(spare.back());
  spare.pop_back();
  return exchange;
}

void SessionContext::State::give_back(std::unique_ptr<Exchange> exchange) noexcept {
  if (spare.size() == max_spare) return;
  exchange->clear();
  spare.push_back(std::move(exchange));
}

std::string_view SessionContext::date(std::chrono::system_clock::time_point utc) {
  const auto second = std::chrono::floor<std::chrono::seconds>(utc.time_since_epoch());
  if (second != state_->date_second) {
    state_->date = http::to_http_date(utc);
    state_->date_second = second;
  }
  return state_->date;
}

/// The private implementation of Session, with the same functions.
class LRT_LOCAL Session::State {
 public:
  State(SessionContext& context, std::string peer) : context_(context), shared_(*context.state_), peer_(std::move(peer)) {}

  void receive(std::string_view bytes, TimePoint now);
  void end_of_input(TimePoint now);
  void reply(engine::Reply reply, TimePoint now);
  Upgrade take_upgrade();
  void push(engine::Push push, TimePoint now);
  void end_stream(TimePoint now);
  void abandon() noexcept;
  void refuse(int status, std::string reason, TimePoint now);
  void refuse(http::Response response, TimePoint now);
  void hang_up() noexcept { enter(input_ended_ ? Phase::closed : Phase::lingering); }
  void set_secure(std::string client_certificate);
  void serve_only_stops() noexcept { only_stops_ = true; }
  void expire(TimePoint now);
  Output output() const noexcept;
  void sent(std::size_t bytes, TimePoint now);
  bool wants_input() const noexcept;
  bool expects_much() const noexcept;
  Phase phase() const noexcept { return phase_; }
  Phase timed_phase() const noexcept { return phase_ == Phase::idle && requests_ == 0 ? Phase::header : phase_; }
  std::optional<std::chrono::milliseconds> time() const noexcept;
  std::uint32_t epoch() const noexcept { return epoch_; }
  std::optional<engine::Ticket> ticket() const noexcept { return ticket_; }
  std::optional<engine::Channel> channel() const noexcept { return channel_; }
  bool wants_message() const noexcept { return phase_ == Phase::streaming; }
  bool input_ended() const noexcept { return input_ended_; }

 private:
  void run(TimePoint now);
  void drop_consumed() noexcept;
  bool take_header(TimePoint now);
  bool take_body(TimePoint now);
  void begin_body(std::string_view header, TimePoint now);
  bool judge_header(TimePoint now);
  void refuse_size(const std::string& found, TimePoint now);
  void refuse_for_memory(TimePoint now);
  bool take_sized_body(TimePoint now);
  bool take_chunked_body(TimePoint now);
  std::optional<std::size_t> parse_at_once();
  std::optional<std::size_t> find_header_end(TimePoint now);
  bool is_line_too_long(std::string_view line, TimePoint now);
  void keep_header(std::string_view header);
  void remove_framing_fields();
  void dispatch(TimePoint now);
  const http::Fields* common_fields(TimePoint now) const;
  void respond(http::Response response, TimePoint now);
  void finish_response(TimePoint now);
  void keep_handshake();
  void accept_upgrade(engine::Channel channel, http::Response response, TimePoint now);
  void accept_stream(engine::Channel channel, http::Response response, TimePoint now);
  void write_chunk(std::string_view text);
  void write_chunk(std::shared_ptr<const std::string> message);
  bool must_end_stream() const noexcept { return ends_stream_ || input_ended_ || context_.stopping; }
  void finish_stream(TimePoint now);
  void check_end(TimePoint now);
  void enter(Phase phase) noexcept;
  void need_exchange();
  void rest() noexcept;

  SessionContext& context_;
  SessionContext::State& shared_;
  const std::string peer_;
  std::string client_certificate_;
  std::unique_ptr<Exchange> exchange_;  ///< nullptr: there is nothing to read or write
  std::uint32_t epoch_ = 0;
  Phase phase_ = Phase::idle;
  bool secure_ = false;
  bool input_ended_ = false;
  bool only_stops_ = false;
  bool keep_alive_ = true;
  bool header_only_ = false;
  bool ends_stream_ = false;      ///< after what is being written
  std::uint8_t version_ = 11;     ///< of the request
  std::uint8_t empty_lines_ = 0;  ///< before the request
  std::size_t discarded_ = 0;     ///< while lingering
  std::size_t requests_ = 0;
  std::optional<engine::Ticket> ticket_;
  std::optional<engine::Channel> channel_;  ///< of the open event stream
};

void Session::State::set_secure(std::string client_certificate) {
  client_certificate_ = std::move(client_certificate);
  secure_ = true;
}

/// Takes buffers before anything is read or written.
void Session::State::need_exchange() {
  if (exchange_) return;
  exchange_ = shared_.take_exchange();
  exchange_->request.peer = peer_;
  exchange_->request.secure = secure_;
  exchange_->request.client_certificate = client_certificate_;
}

/// Returns the buffers after everything was read and written. Other sessions can use them.
void Session::State::rest() noexcept {
  if (!exchange_ || !exchange_->in.empty() || !output().empty()) return;
  if (phase_ == Phase::idle || phase_ == Phase::streaming || phase_ >= Phase::closed) shared_.give_back(std::move(exchange_));
}

void Session::State::enter(Phase phase) noexcept {
  phase_ = phase;
  ++epoch_;
}

std::optional<std::chrono::milliseconds> Session::State::time() const noexcept {
  const auto& limits = shared_.limits;
  switch (timed_phase()) {
    case Phase::idle: return limits.idle_timeout;
    case Phase::header: return limits.header_timeout;
    case Phase::body: return limits.body_timeout;
    case Phase::writing: return limits.write_timeout;
    case Phase::lingering: return limits.linger_timeout;
    case Phase::streaming: return limits.ping_interval;
    case Phase::waiting:
    case Phase::upgraded:
    case Phase::closed: break;
  }
  return std::nullopt;
}

// ---------------------------------------------------------------------------------------------------------------- input

bool Session::State::wants_input() const noexcept {
  if (input_ended_) return false;
  switch (phase_) {
    case Phase::idle:
    case Phase::header:
    case Phase::body: return true;
    case Phase::streaming:
    case Phase::waiting: return !exchange_ || exchange_->in.size() - exchange_->in_used < shared_.limits.max_header_bytes;
    // Above the limit nothing is read, so that TCP flow control stops the client until the time is over.
    case Phase::lingering: return discarded_ < shared_.limits.max_linger_bytes;
    case Phase::writing:
    case Phase::upgraded:
    case Phase::closed: return false;
  }
  return false;
}

bool Session::State::expects_much() const noexcept {
  if (phase_ == Phase::lingering) return true;
  if (phase_ != Phase::body) return false;
  const Exchange& x = *exchange_;
  return (x.framing.chunked ? x.body->size() : x.framing.length) > large_body_bytes;
}

void Session::State::receive(std::string_view bytes, TimePoint now) {
  if (phase_ == Phase::closed) return;
  if (phase_ == Phase::lingering) {
    discarded_ += bytes.size();
    return;
  }
  need_exchange();
  Exchange& x = *exchange_;
  switch (phase_) {
    case Phase::writing:
    case Phase::upgraded:
    case Phase::streaming:
    case Phase::waiting: x.in.append(bytes); return;
    default: break;
  }
  if (x.in.empty()) {
    x.rest = bytes;
    run(now);
    x.in.assign(x.rest);
  } else {
    x.in.erase(0, x.in_used);
    x.in_used = 0;
    x.in.append(bytes);
    x.rest = x.in;
    run(now);
    drop_consumed();
  }
  x.rest = {};
  rest();
}

/// Removes the input that the last run() has consumed.
void Session::State::drop_consumed() noexcept {
  Exchange& x = *exchange_;
  x.in_used = x.in.size() - x.rest.size();
  if (x.in_used != x.in.size()) return;
  x.in.clear();
  x.in_used = 0;
}

void Session::State::end_of_input(TimePoint now) {
  input_ended_ = true;
  if (ticket_) context_.handler->input_ended(*ticket_);
  if (phase_ == Phase::lingering) enter(Phase::closed);
  if (phase_ == Phase::streaming) finish_stream(now);
  else check_end(now);
  rest();
}

/// Handles the end of input before a request is complete.
void Session::State::check_end(TimePoint now) {
  if (!input_ended_) return;
  if (phase_ == Phase::idle) enter(Phase::closed);
  else if (phase_ == Phase::header) refuse(400, "the request ends within its header section", now);
  else if (phase_ == Phase::body) refuse(400, "the request ends within its body", now);
}

/// Handles requests of the input until one is incomplete or a response is open.
void Session::State::run(TimePoint now) {
  for (;;) {
    if (phase_ == Phase::idle || phase_ == Phase::header) {
      if (!take_header(now)) return;
    } else if (phase_ == Phase::body) {
      if (!take_body(now)) return;
    } else {
      return;
    }
  }
}

/// The size of the header section at the front of the input if it is complete and accepted, and none of its lines can be too long.
std::optional<std::size_t> Session::State::parse_at_once() {
  Exchange& x = *exchange_;
  const auto& limits = shared_.limits;
  const auto window = x.rest.substr(0, std::min(limits.max_header_bytes, limits.max_line_bytes));
  return http::parse_leading_header(window, x.request, x.framing);
}

/// The size of the header section at the front of the input if it is complete. Refuses one that cannot become acceptable.
std::optional<std::size_t> Session::State::find_header_end(TimePoint now) {
  Exchange& x = *exchange_;
  const auto limit = shared_.limits.max_header_bytes;
  const auto window = x.rest.substr(0, limit);
  while (x.scanned < window.size()) {
    const void* const found = std::memchr(window.data() + x.scanned, '\n', window.size() - x.scanned);
    if (!found) {
      x.scanned = window.size();
      if (is_line_too_long(window.substr(x.line_begin), now)) return std::nullopt;
      break;
    }
    const auto at = static_cast<std::size_t>(static_cast<const char*>(found) - window.data());
    x.scanned = at + 1;
    if (is_line_too_long(window.substr(x.line_begin, at - x.line_begin), now)) return std::nullopt;
    if (at == 0 || window[at - 1] != '\r') {
      refuse(400, "byte " + std::to_string(at) + " of the header section is a line feed without a preceding carriage return", now);
      return std::nullopt;
    }
    if (at == x.line_begin + 1) return at + 1;
    x.line_begin = at + 1;
  }
  if (x.rest.size() >= limit) {
    const auto bytes = std::to_string(limit);
    if (x.line_begin == 0) refuse(414, "the request line is longer than the " + bytes + " bytes allowed for the header section", now);
    else refuse(431, "the header section is longer than " + bytes + " bytes", now);
  }
  return std::nullopt;
}

/// Refuses a line of the header section that is longer than allowed, complete or not. Its CRLF does not count.
bool Session::State::is_line_too_long(std::string_view line, TimePoint now) {
  const auto limit = shared_.limits.max_line_bytes;
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (line.size() <= limit) return false;
  const auto longer = " is longer than the " + std::to_string(limit) + " bytes allowed for a line";
  if (exchange_->line_begin == 0) refuse(414, "the request line" + longer, now);
  else refuse(431, "the field line at byte " + std::to_string(exchange_->line_begin) + " of the header section" + longer, now);
  return true;
}

/// True when there may be more to do with the input.
bool Session::State::take_header(TimePoint now) {
  if (phase_ == Phase::idle) {
    while (!exchange_->rest.empty() && exchange_->rest.front() == '\r') {
      if (exchange_->rest.size() == 1) return false;
      if (exchange_->rest[1] != '\n' || ++empty_lines_ > max_empty_lines) {
        refuse(400,
               exchange_->rest[1] != '\n' ? "a carriage return without a line feed before the request line"
                                          : "too many empty lines before the request line",
               now);
        return false;
      }
      exchange_->rest.remove_prefix(2);
    }
    if (exchange_->rest.empty()) return false;
    if (requests_ == 0) phase_ = Phase::header;  // the time limit continues: see timed_phase()
    else enter(Phase::header);
    exchange_->scanned = exchange_->line_begin = 0;
    if (!may_begin_method(exchange_->rest.front())) {
      refuse(400, "the first byte cannot begin a method: expected an HTTP/1.1 request", now);
      return false;
    }
  }
  header_only_ = exchange_->rest.substr(0, 5) == "HEAD ";
  // Most header sections arrive at once: if parsing succeeds directly, the search for the end is not needed.
  auto size = exchange_->scanned > 0 ? std::nullopt : parse_at_once();
  if (!size) {
    size = find_header_end(now);
    if (!size) return false;
    if (auto refusal = http::parse_request_header(exchange_->rest.substr(0, *size), exchange_->request, exchange_->framing)) {
      refuse(refusal->status, std::move(refusal->reason), now);
      return false;
    }
  }
  const auto header = exchange_->rest.substr(0, *size);
  version_ = static_cast<std::uint8_t>(exchange_->request.version);
  exchange_->rest.remove_prefix(*size);
  begin_body(header, now);
  return true;
}

void Session::State::begin_body(std::string_view header, TimePoint now) {
  exchange_->request.body = {};
  exchange_->request.judged = nullptr;
  exchange_->request.can_upgrade = context_.websockets && version_ == 11 && !context_.stopping;
  exchange_->request.can_stream = context_.streams && !context_.stopping;
  const bool has_body = exchange_->framing.chunked || exchange_->framing.length > 0;
  exchange_->max_body_bytes = shared_.limits.max_body_bytes;
  if (!exchange_->framing.chunked && exchange_->framing.length > exchange_->max_body_bytes)
    return refuse_size(std::to_string(exchange_->framing.length), now);
  remove_framing_fields();
  if (only_stops_ && !context_.handler->is_stop(exchange_->request)) return refuse(503, "too many connections", now);
  if (!has_body) return dispatch(now);
  if (!exchange_->framing.chunked && exchange_->rest.size() >= exchange_->framing.length) {
    exchange_->request.body = exchange_->rest.substr(0, static_cast<std::size_t>(exchange_->framing.length));
    exchange_->rest.remove_prefix(exchange_->request.body.size());
    return dispatch(now);
  }
  if (!judge_header(now)) return;
  enter(Phase::body);
  if (exchange_->framing.expects_continue && exchange_->rest.empty()) exchange_->out += "HTTP/1.1 100 Continue\r\n\r\n";
  exchange_->discarded_body_bytes = 0;
  exchange_->body.emplace(shared_.bodies, peer_);
  exchange_->chunks.reset(exchange_->max_body_bytes, shared_.limits.max_header_bytes);
  keep_header(header);
}

/// Passes the header section to the handler. False: the response is final, and the connection is closed: after `Expect: 100-continue` nothing else
/// shows whether the client still sends the body. Otherwise a short body is discarded, and the connection is kept.
bool Session::State::judge_header(TimePoint now) {
  const auto length = exchange_->framing.chunked ? std::nullopt : std::optional(exchange_->framing.length);
  auto verdict = context_.handler->judge_header(exchange_->request, length, now);
  exchange_->max_body_bytes = std::min(exchange_->max_body_bytes, verdict.max_body_bytes);
  exchange_->ignores_body = verdict.ignores_body;
  if (!verdict.response) {
    exchange_->request.judged = std::move(verdict.judged);
    if (!length || *length <= exchange_->max_body_bytes) return true;
    refuse_size(std::to_string(*length), now);
    return false;
  }
  exchange_->refusal = std::move(verdict.response);
  if (length && *length <= max_discarded_body_bytes && !exchange_->framing.expects_continue && !exchange_->refusal->close) return true;
  ++requests_;
  refuse(*std::exchange(exchange_->refusal, std::nullopt), now);
  return false;
}

void Session::State::refuse_size(const std::string& found, TimePoint now) {
  refuse(413, "the body has " + found + " bytes; " + std::to_string(exchange_->max_body_bytes) + " are allowed", now);
}

/// Copies the header section, whose bytes are about to be discarded, and makes the request a view of the copy.
void Session::State::keep_header(std::string_view header) {
  Exchange& x = *exchange_;
  x.header.assign(header);
  const auto moved = [&](std::string_view part) { return std::string_view(x.header.data() + (part.data() - header.data()), part.size()); };
  x.request.method = moved(x.request.method);
  x.request.target = moved(x.request.target);
  for (auto& field : x.request.fields) field = {moved(field.name), moved(field.value)};
}

void Session::State::remove_framing_fields() {
  auto& fields = exchange_->request.fields;
  fields.erase(std::remove_if(fields.begin(), fields.end(),
                              [](const http::Field& field) {
                                return (field.name.size() == 14 && http::iequals(field.name, "Content-Length")) ||
                                       (field.name.size() == 17 && http::iequals(field.name, "Transfer-Encoding"));
                              }),
               fields.end());
}

/// True when there may be more to do with the input.
bool Session::State::take_body(TimePoint now) {
  Exchange& x = *exchange_;
  if (!(x.framing.chunked ? take_chunked_body(now) : take_sized_body(now))) return false;
  x.request.body = x.body->view();
  x.request.body_owner = x.body->release();
  dispatch(now);
  return true;
}

/// True when the body is complete.
bool Session::State::take_sized_body(TimePoint now) {
  const auto missing = static_cast<std::size_t>(exchange_->framing.length) - exchange_->body->size() - exchange_->discarded_body_bytes;
  const auto part = exchange_->rest.substr(0, missing);
  if (exchange_->refusal || exchange_->ignores_body) exchange_->discarded_body_bytes += part.size();
  else if (!exchange_->body->append(part)) return refuse_for_memory(now), false;
  exchange_->rest.remove_prefix(part.size());
  return part.size() == missing;
}

/// True when the body is complete.
bool Session::State::take_chunked_body(TimePoint now) {
  Exchange& x = *exchange_;
  switch (x.chunks.feed(x.rest, *x.body)) {
    case ChunkDecoder::Status::more: break;
    case ChunkDecoder::Status::done: return true;
    case ChunkDecoder::Status::bad: refuse(400, std::string(x.chunks.problem()), now); break;
    case ChunkDecoder::Status::too_large: refuse(413, "the body has more than " + std::to_string(x.max_body_bytes) + " bytes", now); break;
    case ChunkDecoder::Status::no_memory: refuse_for_memory(now); break;
  }
  return false;
}

void Session::State::refuse_for_memory(TimePoint now) {
  refuse(503, "the memory for request bodies is in use by other requests; try again later", now);
}

// ------------------------------------------------------------------------------------------------------------- responses

void Session::State::dispatch(TimePoint now) {
  Exchange& x = *exchange_;
  ++requests_;
  keep_alive_ = x.framing.keep_alive && requests_ < shared_.limits.max_requests_per_connection && !only_stops_;
  if (x.refusal) return respond(*std::exchange(x.refusal, std::nullopt), now);
  x.request.can_upgrade = x.request.can_upgrade && !context_.stopping;
  x.request.can_stream = x.request.can_stream && !context_.stopping;
  keep_handshake();  // a channel that is opened must not be lost
  auto outcome = context_.handler->handle(x.request, now);
  x.request.body = {};
  x.request.body_owner.reset();
  x.body.reset();
  if (auto* const deferred = std::get_if<engine::Deferred>(&outcome)) {
    ticket_ = deferred->ticket;
    enter(Phase::waiting);
    if (input_ended_) context_.handler->input_ended(*ticket_);
  } else if (auto* const upgraded = std::get_if<engine::Upgraded>(&outcome)) {
    accept_upgrade(upgraded->channel, std::move(upgraded->response), now);
  } else if (auto* const streamed = std::get_if<engine::Streamed>(&outcome)) {
    x.upgrade.reset();
    accept_stream(streamed->channel, std::move(streamed->response), now);
  } else {
    x.upgrade.reset();
    respond(std::get<http::Response>(std::move(outcome)), now);
  }
}

void Session::State::reply(engine::Reply reply, TimePoint now) {
  if (phase_ != Phase::waiting) {
    if (reply.channel) context_.handler->closed(*reply.channel);
    return;
  }
  ticket_.reset();
  if (reply.channel && reply.response.status == 101) return accept_upgrade(*reply.channel, std::move(reply.response), now);
  exchange_->upgrade.reset();
  if (reply.channel) accept_stream(*reply.channel, std::move(reply.response), now);
  else respond(std::move(reply.response), now);
}

/// Copies the part of the request that a WebSocket needs, before its bytes are discarded.
void Session::State::keep_handshake() {
  if (!exchange_->request.can_upgrade || !http::requests_upgrade(exchange_->request, "websocket") || http::check_websocket(exchange_->request))
    return;
  exchange_->upgrade = std::make_unique<Upgrade>();
  exchange_->upgrade->key = std::string(exchange_->request.find("Sec-WebSocket-Key").value_or(""));
}

void Session::State::accept_upgrade(engine::Channel channel, http::Response response, TimePoint now) {
  if (!exchange_->upgrade || context_.stopping) {
    context_.handler->closed(channel);
    if (exchange_->upgrade) refuse(503, "the server is stopping", now);
    else refuse(500, "the response opens a WebSocket, but the request is not a WebSocket handshake", now);
    return;
  }
  exchange_->upgrade->channel = channel;
  exchange_->upgrade->response = std::move(response);
  enter(Phase::upgraded);
}

Session::Upgrade Session::State::take_upgrade() {
  std::string early = exchange_->in.substr(exchange_->in_used);
  Upgrade upgrade = std::move(*exchange_->upgrade);
  exchange_->upgrade.reset();
  upgrade.early = std::move(early);
  phase_ = Phase::closed;
  shared_.give_back(std::move(exchange_));
  return upgrade;
}

void Session::State::refuse(int status, std::string reason, TimePoint now) {
  http::Response response;
  http::set_problem(response, {status, std::move(reason)});
  if (status == 503) response.fields.add("Retry-After", "1");
  refuse(std::move(response), now);
}

void Session::State::refuse(http::Response response, TimePoint now) {
  keep_alive_ = false;
  ticket_.reset();
  need_exchange();
  exchange_->upgrade.reset();
  exchange_->refusal.reset();
  exchange_->body.reset();
  exchange_->rest = {};
  respond(std::move(response), now);
}

const http::Fields* Session::State::common_fields(TimePoint now) const { return context_.handler ? context_.handler->common_fields(now) : nullptr; }

void Session::State::respond(http::Response response, TimePoint now) {
  Exchange& x = *exchange_;
  if (response.close || context_.stopping) keep_alive_ = false;
  http::write_response_header(x.out, response, context_.date(now.utc), keep_alive_, version_, http::BodyEnd::length, common_fields(now));
  if (response.body && !header_only_ && http::may_have_body(response.status)) {
    if (response.body->size() <= copied_body_bytes) x.out += *response.body;
    else x.out_body = std::move(response.body);
  }
  enter(Phase::writing);
}

Output Session::State::output() const noexcept {
  if (!exchange_) return {};
  const Exchange& x = *exchange_;
  const std::string_view body = x.out_body ? std::string_view(*x.out_body) : std::string_view();
  if (x.out_sent < x.out.size()) return {std::string_view(x.out).substr(x.out_sent), body, x.out_tail};
  const std::size_t behind = x.out_sent - x.out.size();
  if (behind < body.size()) return {body.substr(behind), x.out_tail};
  return {x.out_tail.substr(behind - body.size()), {}};
}

void Session::State::sent(std::size_t bytes, TimePoint now) {
  Exchange& x = *exchange_;
  x.out_sent += bytes;
  if (!output().empty()) {
    if (phase_ == Phase::writing) ++epoch_;  // the client has received data
    return;
  }
  release(x.out);
  x.out_body.reset();
  x.out_tail = {};
  x.out_sent = 0;
  if (phase_ == Phase::writing) {
    if (!channel_) finish_response(now);
    else if (must_end_stream()) finish_stream(now);
    else enter(Phase::streaming);
  }
  rest();
}

void Session::State::finish_response(TimePoint now) {
  Exchange& x = *exchange_;
  if (!keep_alive_) {
    x.in.clear();
    x.in_used = 0;
    enter(input_ended_ ? Phase::closed : Phase::lingering);
    return;
  }
  release(x.header);
  header_only_ = false;
  empty_lines_ = 0;
  enter(Phase::idle);
  if (!x.in.empty()) {
    x.rest = std::string_view(x.in).substr(x.in_used);
    run(now);
    drop_consumed();
    x.rest = {};
  }
  check_end(now);
}

// --------------------------------------------------------------------------------------------------------- event streams

void Session::State::accept_stream(engine::Channel channel, http::Response response, TimePoint now) {
  if (!exchange_->request.can_stream || context_.stopping || header_only_) context_.handler->closed(channel);
  if (!exchange_->request.can_stream) return refuse(500, "this connection cannot carry an event stream", now);
  if (context_.stopping) return refuse(503, "the server is stopping", now);
  if (!header_only_) channel_ = channel;
  keep_alive_ = keep_alive_ && version_ == 11;
  response.body.reset();
  const auto end = version_ == 11 ? http::BodyEnd::chunked : http::BodyEnd::close;
  http::write_response_header(exchange_->out, response, context_.date(now.utc), keep_alive_, version_, end, common_fields(now));
  enter(Phase::writing);
}

void Session::State::push(engine::Push push, TimePoint now) {
  if (push.close != 0) {
    finish_stream(now);
    return rest();
  }
  if (!push.message || push.message->empty()) return;  // an empty chunk would be the last
  need_exchange();
  write_chunk(std::move(push.message));
  enter(Phase::writing);
}

/// Small messages are copied.
void Session::State::write_chunk(std::string_view text) {
  Exchange& x = *exchange_;
  const bool chunked = version_ == 11;
  if (chunked) append_chunk_size(x.out, text.size());
  x.out += text;
  if (chunked) x.out += "\r\n";
}

void Session::State::write_chunk(std::shared_ptr<const std::string> message) {
  Exchange& x = *exchange_;
  if (message->size() <= copied_body_bytes) return write_chunk(std::string_view(*message));
  if (version_ == 11) {
    append_chunk_size(x.out, message->size());
    x.out_tail = "\r\n";
  }
  x.out_body = std::move(message);
}

void Session::State::end_stream(TimePoint now) {
  if (phase_ == Phase::streaming) finish_stream(now);
  else ends_stream_ = channel_.has_value();  // sent() ends it
  rest();
}

/// Nothing is in output().
void Session::State::finish_stream(TimePoint now) {
  context_.handler->closed(*channel_);
  channel_.reset();
  ends_stream_ = false;
  if (context_.stopping) keep_alive_ = false;
  need_exchange();
  if (version_ == 10) return finish_response(now);
  exchange_->out += "0\r\n\r\n";
  enter(Phase::writing);
}

void Session::State::abandon() noexcept {
  if (ticket_) context_.handler->abandon(*ticket_);
  if (channel_) context_.handler->closed(*channel_);
  if (phase_ == Phase::upgraded) context_.handler->closed(exchange_->upgrade->channel);
  ticket_.reset();
  channel_.reset();
  if (exchange_) exchange_->upgrade.reset();
}

// ------------------------------------------------------------------------------------------------------------------ time

void Session::State::expire(TimePoint now) {
  const auto within = [](std::chrono::milliseconds time) { return " was not complete within " + std::to_string(time.count()) + " ms"; };
  switch (phase_) {
    case Phase::header: refuse(408, "the head" + within(shared_.limits.header_timeout), now); break;
    case Phase::body:
      if (exchange_->refusal) refuse(*std::exchange(exchange_->refusal, std::nullopt), now);
      else refuse(408, "the body" + within(shared_.limits.body_timeout), now);
      break;
    case Phase::idle:
    case Phase::writing:
    case Phase::lingering: enter(Phase::closed); break;
    case Phase::streaming:
      need_exchange();
      write_chunk(keep_alive_comment);
      enter(Phase::writing);
      break;
    case Phase::waiting:
    case Phase::upgraded:
    case Phase::closed: break;
  }
}

// ------------------------------------------------------------------------------------------------------------- Session

Session::Session(SessionContext& context, std::string peer) : state_(std::make_unique<State>(context, std::move(peer))) {}
Session::~Session() = default;

void Session::receive(std::string_view bytes, TimePoint now) { state_->receive(bytes, now); }
void Session::end_of_input(TimePoint now) { state_->end_of_input(now); }
void Session::reply(engine::Reply reply, TimePoint now) { state_->reply(std::move(reply), now); }
Session::Upgrade Session::take_upgrade() { return state_->take_upgrade(); }
void Session::push(engine::Push push, TimePoint now) { state_->push(std::move(push), now); }
void Session::end_stream(TimePoint now) { state_->end_stream(now); }
void Session::abandon() noexcept { state_->abandon(); }
void Session::refuse(int status, std::string reason, TimePoint now) { state_->refuse(status, std::move(reason), now); }
void Session::refuse(http::Response response, TimePoint now) { state_->refuse(std::move(response), now); }
void Session::hang_up() noexcept { state_->hang_up(); }
void Session::set_secure(std::string client_certificate) { state_->set_secure(std::move(client_certificate)); }
void Session::serve_only_stops() noexcept { state_->serve_only_stops(); }
void Session::expire(TimePoint now) { state_->expire(now); }
Output Session::output() const noexcept { return state_->output(); }
void Session::sent(std::size_t bytes, TimePoint now) { state_->sent(bytes, now); }
bool Session::wants_input() const noexcept { return state_->wants_input(); }
bool Session::expects_much() const noexcept { return state_->expects_much(); }
Session::Phase Session::phase() const noexcept { return state_->phase(); }
Session::Phase Session::timed_phase() const noexcept { return state_->timed_phase(); }
std::optional<std::chrono::milliseconds> Session::time() const noexcept { return state_->time(); }
std::uint32_t Session::epoch() const noexcept { return state_->epoch(); }
std::optional<engine::Ticket> Session::ticket() const noexcept { return state_->ticket(); }
std::optional<engine::Channel> Session::channel() const noexcept { return state_->channel(); }
bool Session::wants_message() const noexcept { return state_->wants_message(); }
bool Session::input_ended() const noexcept { return state_->input_ended(); }

}  // namespace lrt::transport
