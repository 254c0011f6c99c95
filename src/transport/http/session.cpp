#include <lrt/transport/session.hpp>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <utility>
#include <variant>

#include <lrt/http/date.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/http/websocket.hpp>

namespace lrt::transport {
namespace {

/// RFC 9112 2.2 requires to ignore "at least one" empty line before a request line.
constexpr int max_empty_lines = 4;
/// Bodies up to this size are copied behind their header section: one buffer costs the system less than two.
constexpr std::size_t copied_body_bytes = 2048;
/// Of the body of a refused request, so that its connection can be kept.
constexpr std::size_t max_discarded_body_bytes = 16 * 1024;
/// A body of more than this is received when other connections have been served.
constexpr std::size_t large_body_bytes = 16 * 1024;
/// Capacity that an idle connection may keep.
constexpr std::size_t kept_capacity = 8 * 1024;

/// A comment of an event stream (WHATWG HTML 9.2.5), so that proxies and peers see that the connection is alive.
constexpr std::string_view keep_alive_comment = ":\n\n";

/// chunk-size CRLF (RFC 9112 7.1)
void append_chunk_size(std::string& out, std::size_t size) {
  char digits[16];
  const auto end = std::to_chars(digits, digits + sizeof digits, size, 16).ptr;
  out.append(digits, end).append("\r\n");
}

bool may_begin_method(char c) noexcept { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

void release(std::string& buffer) {
  if (buffer.capacity() > kept_capacity) std::string().swap(buffer);
  else buffer.clear();
}

}  // namespace

std::string_view SessionContext::date(std::chrono::system_clock::time_point utc) {
  const auto second = std::chrono::floor<std::chrono::seconds>(utc.time_since_epoch());
  if (second != date_second_) {
    date_ = http::to_http_date(utc);
    date_second_ = second;
  }
  return date_;
}

Session::Session(SessionContext& context, std::string peer) : context_(context), peer_(std::move(peer)), body_(context.bodies(), peer_) {
  request_.peer = peer_;
}

void Session::set_secure(std::string client_certificate) {
  client_certificate_ = std::move(client_certificate);
  request_.secure = true;
  request_.client_certificate = client_certificate_;
}

void Session::enter(Phase phase) noexcept {
  phase_ = phase;
  ++epoch_;
}

std::optional<std::chrono::milliseconds> Session::time() const noexcept {
  const auto& limits = context_.limits();
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

bool Session::wants_input() const noexcept {
  if (input_ended_) return false;
  switch (phase_) {
    case Phase::idle:
    case Phase::header:
    case Phase::body: return true;
    case Phase::streaming:
    case Phase::waiting: return in_.size() - in_used_ < context_.limits().max_header_bytes;
    // Over the limit nothing is read, so that TCP holds the client back until the time is over, too.
    case Phase::lingering: return discarded_ < context_.limits().max_linger_bytes;
    case Phase::writing:
    case Phase::upgraded:
    case Phase::closed: return false;
  }
  return false;
}

bool Session::expects_much() const noexcept {
  if (phase_ == Phase::lingering) return true;
  const std::uint64_t bytes = framing_.chunked ? body_.size() : framing_.length;
  return phase_ == Phase::body && bytes > large_body_bytes;
}

void Session::receive(std::string_view bytes, TimePoint now) {
  switch (phase_) {
    case Phase::closed: return;
    case Phase::lingering: discarded_ += bytes.size(); return;
    case Phase::writing:
    case Phase::upgraded:
    case Phase::streaming:
    case Phase::waiting: in_.append(bytes); return;
    case Phase::idle:
    case Phase::header:
    case Phase::body: break;
  }
  if (in_.empty()) {
    rest_ = bytes;
    run(now);
    in_.assign(rest_);
  } else {
    in_.erase(0, in_used_);
    in_used_ = 0;
    in_.append(bytes);
    rest_ = in_;
    run(now);
    in_used_ = in_.size() - rest_.size();
    if (in_used_ == in_.size()) in_.clear(), in_used_ = 0;
  }
  rest_ = {};
}

void Session::end_of_input(TimePoint now) {
  input_ended_ = true;
  if (phase_ == Phase::lingering) enter(Phase::closed);
  if (phase_ == Phase::streaming) finish_stream(now);
  else check_end(now);
}

/// What the end of input means for a request that is not complete.
void Session::check_end(TimePoint now) {
  if (!input_ended_) return;
  if (phase_ == Phase::idle) enter(Phase::closed);
  else if (phase_ == Phase::header) refuse(400, "the request ends within its head", now);
  else if (phase_ == Phase::body) refuse(400, "the request ends within its body", now);
}

/// Handles requests of rest_ until one is incomplete or a response is open.
void Session::run(TimePoint now) {
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

/// The size of the header section at the front of rest_ if it is complete. Refuses one that cannot become acceptable.
std::optional<std::size_t> Session::find_header_end(TimePoint now) {
  const auto limit = context_.limits().max_header_bytes;
  const auto window = rest_.substr(0, limit);
  while (scanned_ < window.size()) {
    const void* const found = std::memchr(window.data() + scanned_, '\n', window.size() - scanned_);
    if (!found) {
      scanned_ = window.size();
      if (is_line_too_long(window.substr(line_begin_), now)) return std::nullopt;
      break;
    }
    const auto at = static_cast<std::size_t>(static_cast<const char*>(found) - window.data());
    scanned_ = at + 1;
    if (is_line_too_long(window.substr(line_begin_, at - line_begin_), now)) return std::nullopt;
    if (at == 0 || window[at - 1] != '\r') {
      refuse(400, "byte " + std::to_string(at) + " of the head is a line feed without a carriage return before it", now);
      return std::nullopt;
    }
    if (at == line_begin_ + 1) return at + 1;
    line_begin_ = at + 1;
  }
  if (rest_.size() >= limit) {
    const auto bytes = std::to_string(limit);
    if (line_begin_ == 0) refuse(414, "the request line is longer than the " + bytes + " bytes allowed for the head", now);
    else refuse(431, "the head is longer than " + bytes + " bytes", now);
  }
  return std::nullopt;
}

/// Refuses a line of the header section that is longer than allowed, complete or not. Its CRLF does not count.
bool Session::is_line_too_long(std::string_view line, TimePoint now) {
  const auto limit = context_.limits().max_line_bytes;
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (line.size() <= limit) return false;
  const auto longer = " is longer than the " + std::to_string(limit) + " bytes allowed for a line";
  if (line_begin_ == 0) refuse(414, "the request line" + longer, now);
  else refuse(431, "the field line at byte " + std::to_string(line_begin_) + " of the head" + longer, now);
  return true;
}

/// True when there may be more to do with rest_.
bool Session::take_header(TimePoint now) {
  if (phase_ == Phase::idle) {
    while (!rest_.empty() && rest_.front() == '\r') {
      if (rest_.size() == 1) return false;
      if (rest_[1] != '\n' || ++empty_lines_ > max_empty_lines) {
        refuse(400,
               rest_[1] != '\n' ? "a carriage return without a line feed before the request line"
                                : "too many empty lines before the request line",
               now);
        return false;
      }
      rest_.remove_prefix(2);
    }
    if (rest_.empty()) return false;
    if (requests_ == 0) phase_ = Phase::header;  // the time goes on: see timed_phase()
    else enter(Phase::header);
    scanned_ = line_begin_ = 0;
    if (!may_begin_method(rest_.front())) {
      refuse(400, "the first byte does not begin a method: this is no HTTP/1.1 request", now);
      return false;
    }
  }
  header_only_ = rest_.substr(0, 5) == "HEAD ";
  const auto size = find_header_end(now);
  if (!size) return false;

  const auto header = rest_.substr(0, *size);
  if (auto refusal = http::parse_request_header(header, request_, framing_)) {
    refuse(refusal->status, std::move(refusal->reason), now);
    return false;
  }
  version_ = request_.version;
  rest_.remove_prefix(*size);
  begin_body(header, now);
  return true;
}

void Session::begin_body(std::string_view header, TimePoint now) {
  request_.body = {};
  request_.header_judged = false;
  request_.can_upgrade = context_.websockets && version_ == 11 && !context_.stopping;
  request_.can_stream = context_.streams && !context_.stopping;
  const bool has_body = framing_.chunked || framing_.length > 0;
  max_body_bytes_ = context_.limits().max_body_bytes;
  if (!framing_.chunked && framing_.length > max_body_bytes_) return refuse_size(std::to_string(framing_.length), now);
  remove_framing_fields();
  if (only_stops_ && !context_.handler->is_stop(request_)) return refuse(503, "too many connections", now);
  if (!has_body) return dispatch(now);
  if (!framing_.chunked && rest_.size() >= framing_.length) {
    request_.body = rest_.substr(0, static_cast<std::size_t>(framing_.length));
    rest_.remove_prefix(request_.body.size());
    return dispatch(now);
  }
  if (!judge_header(now)) return;
  enter(Phase::body);
  if (framing_.expects_continue && rest_.empty()) out_ += "HTTP/1.1 100 Continue\r\n\r\n";
  discarded_body_bytes_ = 0;
  chunks_.reset(max_body_bytes_, context_.limits().max_header_bytes);
  keep_header(header);
}

/// The handler judges the header section. False: the response is final, and the connection ends: after `Expect: 100-continue` nothing else
/// shows whether the client still sends the body. A short body that is on its way is discarded instead, and the connection is kept.
bool Session::judge_header(TimePoint now) {
  const auto length = framing_.chunked ? std::nullopt : std::optional(framing_.length);
  auto verdict = context_.handler->judge_header(request_, length, now);
  max_body_bytes_ = std::min(max_body_bytes_, verdict.max_body_bytes);
  ignores_body_ = verdict.ignores_body;
  if (!verdict.response) {
    request_.header_judged = true;
    if (!length || *length <= max_body_bytes_) return true;
    refuse_size(std::to_string(*length), now);
    return false;
  }
  refusal_ = std::move(verdict.response);
  if (length && *length <= max_discarded_body_bytes && !framing_.expects_continue && !refusal_->close) return true;
  ++requests_;
  refuse(*std::exchange(refusal_, std::nullopt), now);
  return false;
}

void Session::refuse_size(const std::string& found, TimePoint now) {
  refuse(413, "the body has " + found + " bytes; " + std::to_string(max_body_bytes_) + " are allowed", now);
}

/// Copies the header section, whose bytes are about to be discarded, and makes the request a view of the copy.
void Session::keep_header(std::string_view header) {
  header_.assign(header);
  const auto moved = [&](std::string_view part) { return std::string_view(header_.data() + (part.data() - header.data()), part.size()); };
  request_.method = moved(request_.method);
  request_.target = moved(request_.target);
  for (auto& field : request_.fields) field = {moved(field.name), moved(field.value)};
}

void Session::remove_framing_fields() {
  auto& fields = request_.fields;
  fields.erase(std::remove_if(fields.begin(), fields.end(),
                              [](const http::Field& field) {
                                return (field.name.size() == 14 && http::iequals(field.name, "Content-Length")) ||
                                       (field.name.size() == 17 && http::iequals(field.name, "Transfer-Encoding"));
                              }),
               fields.end());
}

/// True when there may be more to do with rest_.
bool Session::take_body(TimePoint now) {
  if (!(framing_.chunked ? take_chunked_body(now) : take_sized_body(now))) return false;
  request_.body = body_.view();
  request_.body_owner = body_.release();
  dispatch(now);
  return true;
}

/// True when the body is complete.
bool Session::take_sized_body(TimePoint now) {
  const auto missing = static_cast<std::size_t>(framing_.length) - body_.size() - discarded_body_bytes_;
  const auto part = rest_.substr(0, missing);
  if (refusal_ || ignores_body_) discarded_body_bytes_ += part.size();
  else if (!body_.append(part)) return refuse_for_memory(now), false;
  rest_.remove_prefix(part.size());
  return part.size() == missing;
}

/// True when the body is complete.
bool Session::take_chunked_body(TimePoint now) {
  switch (chunks_.feed(rest_, body_)) {
    case ChunkDecoder::Status::more: break;
    case ChunkDecoder::Status::done: return true;
    case ChunkDecoder::Status::bad: refuse(400, std::string(chunks_.problem()), now); break;
    case ChunkDecoder::Status::too_large: refuse(413, "the body has more than " + std::to_string(max_body_bytes_) + " bytes", now); break;
    case ChunkDecoder::Status::no_memory: refuse_for_memory(now); break;
  }
  return false;
}

void Session::refuse_for_memory(TimePoint now) { refuse(503, "the bodies of other requests need the memory; try again later", now); }

// ------------------------------------------------------------------------------------------------------------- responses

void Session::dispatch(TimePoint now) {
  ++requests_;
  keep_alive_ = framing_.keep_alive && requests_ < context_.limits().max_requests_per_connection && !only_stops_;
  if (refusal_) return respond(*std::exchange(refusal_, std::nullopt), now);
  request_.can_upgrade = request_.can_upgrade && !context_.stopping;
  request_.can_stream = request_.can_stream && !context_.stopping;
  auto outcome = context_.handler->handle(request_, now);
  request_.body = {};
  request_.body_owner.reset();
  body_.clear();
  if (auto* const deferred = std::get_if<engine::Deferred>(&outcome)) {
    keep_handshake();
    ticket_ = deferred->ticket;
    enter(Phase::waiting);
  } else if (auto* const upgraded = std::get_if<engine::Upgraded>(&outcome)) {
    keep_handshake();
    accept_upgrade(upgraded->channel, std::move(upgraded->response), now);
  } else if (auto* const streamed = std::get_if<engine::Streamed>(&outcome)) {
    accept_stream(streamed->channel, std::move(streamed->response), now);
  } else {
    respond(std::get<http::Response>(std::move(outcome)), now);
  }
}

void Session::reply(engine::Reply reply, TimePoint now) {
  if (phase_ != Phase::waiting) {
    if (reply.channel) context_.handler->closed(*reply.channel);
    return;
  }
  ticket_.reset();
  if (reply.channel && reply.response.status == 101) return accept_upgrade(*reply.channel, std::move(reply.response), now);
  upgrade_.reset();
  if (reply.channel) accept_stream(*reply.channel, std::move(reply.response), now);
  else respond(std::move(reply.response), now);
}

/// Copies what a WebSocket needs of the request, whose bytes are about to be discarded.
void Session::keep_handshake() {
  if (!request_.can_upgrade || !http::requests_upgrade(request_, "websocket") || http::check_websocket(request_)) return;
  upgrade_ = std::make_unique<Upgrade>();
  upgrade_->key = std::string(request_.find("Sec-WebSocket-Key").value_or(""));
}

void Session::accept_upgrade(engine::Channel channel, http::Response response, TimePoint now) {
  if (!upgrade_ || context_.stopping) {
    context_.handler->closed(channel);
    if (upgrade_) refuse(503, "the server stops", now);
    else refuse(500, "what is no WebSocket handshake was to become a WebSocket", now);
    return;
  }
  upgrade_->channel = channel;
  upgrade_->response = std::move(response);
  enter(Phase::upgraded);
}

Session::Upgrade Session::take_upgrade() {
  auto upgrade = std::move(*upgrade_);
  upgrade_.reset();
  upgrade.early = in_.substr(in_used_);
  phase_ = Phase::closed;
  return upgrade;
}

void Session::refuse(int status, std::string reason, TimePoint now) {
  http::Response response;
  http::set_problem(response, {status, std::move(reason)});
  if (status == 503) response.fields.add("Retry-After", "1");
  refuse(std::move(response), now);
}

void Session::refuse(http::Response response, TimePoint now) {
  keep_alive_ = false;
  ticket_.reset();
  upgrade_.reset();
  refusal_.reset();
  body_.clear();
  rest_ = {};
  respond(std::move(response), now);
}

void Session::respond(http::Response response, TimePoint now) {
  if (response.close || context_.stopping) keep_alive_ = false;
  http::write_response_header(out_, response, context_.date(now.utc), keep_alive_, version_);
  if (response.body && !header_only_ && http::may_have_body(response.status)) {
    if (response.body->size() <= copied_body_bytes) out_ += *response.body;
    else out_body_ = std::move(response.body);
  }
  enter(Phase::writing);
}

Output Session::output() const noexcept {
  const std::string_view body = out_body_ ? std::string_view(*out_body_) : std::string_view();
  if (out_sent_ < out_.size()) return {std::string_view(out_).substr(out_sent_), body, out_tail_};
  const std::size_t behind = out_sent_ - out_.size();
  if (behind < body.size()) return {body.substr(behind), out_tail_};
  return {out_tail_.substr(behind - body.size()), {}};
}

void Session::sent(std::size_t bytes, TimePoint now) {
  out_sent_ += bytes;
  if (!output().empty()) {
    if (phase_ == Phase::writing) ++epoch_;  // the client took something
    return;
  }
  release(out_);
  out_body_.reset();
  out_tail_ = {};
  out_sent_ = 0;
  if (phase_ != Phase::writing) return;
  if (!channel_) finish_response(now);
  else if (must_end_stream()) finish_stream(now);
  else enter(Phase::streaming);
}

void Session::finish_response(TimePoint now) {
  if (!keep_alive_) {
    in_.clear();
    in_used_ = 0;
    enter(input_ended_ ? Phase::closed : Phase::lingering);
    return;
  }
  release(header_);
  header_only_ = false;
  empty_lines_ = 0;
  enter(Phase::idle);
  if (in_.empty()) {
    if (in_.capacity() > kept_capacity) std::string().swap(in_);
  } else {
    rest_ = std::string_view(in_).substr(in_used_);
    run(now);
    in_used_ = in_.size() - rest_.size();
    if (in_used_ == in_.size()) in_.clear(), in_used_ = 0;
    rest_ = {};
  }
  check_end(now);
}

// --------------------------------------------------------------------------------------------------------- event streams

void Session::accept_stream(engine::Channel channel, http::Response response, TimePoint now) {
  if (!request_.can_stream || context_.stopping || header_only_) context_.handler->closed(channel);
  if (!request_.can_stream) return refuse(500, "this connection cannot carry an event stream", now);
  if (context_.stopping) return refuse(503, "the server stops", now);
  keep_alive_ = keep_alive_ && version_ == 11;
  response.body.reset();
  const auto end = version_ == 11 ? http::BodyEnd::chunked : http::BodyEnd::close;
  http::write_response_header(out_, response, context_.date(now.utc), keep_alive_, version_, end);
  if (!header_only_) channel_ = channel;
  enter(Phase::writing);
}

void Session::push(engine::Push push, TimePoint now) {
  if (push.close != 0) return finish_stream(now);
  if (!push.message || push.message->empty()) return;  // an empty chunk would be the last
  write_chunk(std::move(push.message));
  enter(Phase::writing);
}

/// Small: copied.
void Session::write_chunk(std::string_view text) {
  const bool chunked = version_ == 11;
  if (chunked) append_chunk_size(out_, text.size());
  out_ += text;
  if (chunked) out_ += "\r\n";
}

void Session::write_chunk(std::shared_ptr<const std::string> message) {
  if (message->size() <= copied_body_bytes) return write_chunk(std::string_view(*message));
  if (version_ == 11) {
    append_chunk_size(out_, message->size());
    out_tail_ = "\r\n";
  }
  out_body_ = std::move(message);
}

void Session::end_stream(TimePoint now) {
  if (phase_ == Phase::streaming) finish_stream(now);
  // else sent() does, because of must_end_stream()
}

/// Nothing is in output().
void Session::finish_stream(TimePoint now) {
  context_.handler->closed(*channel_);
  channel_.reset();
  if (context_.stopping) keep_alive_ = false;
  if (version_ == 10) return finish_response(now);
  out_ += "0\r\n\r\n";
  enter(Phase::writing);
}

void Session::abandon() noexcept {
  if (ticket_) context_.handler->abandon(*ticket_);
  if (channel_) context_.handler->closed(*channel_);
  if (phase_ == Phase::upgraded) context_.handler->closed(upgrade_->channel);
  ticket_.reset();
  channel_.reset();
  upgrade_.reset();
}

// ------------------------------------------------------------------------------------------------------------------ time

void Session::expire(TimePoint now) {
  const auto within = [](std::chrono::milliseconds time) {
    return " was not complete within " + std::to_string(time.count()) + " ms";
  };
  switch (phase_) {
    case Phase::header: refuse(408, "the head" + within(context_.limits().header_timeout), now); break;
    case Phase::body:
      if (refusal_) refuse(*std::exchange(refusal_, std::nullopt), now);
      else refuse(408, "the body" + within(context_.limits().body_timeout), now);
      break;
    case Phase::idle:
    case Phase::writing:
    case Phase::lingering: enter(Phase::closed); break;
    case Phase::streaming:
      write_chunk(keep_alive_comment);
      enter(Phase::writing);
      break;
    case Phase::waiting:
    case Phase::upgraded:
    case Phase::closed: break;
  }
}

}  // namespace lrt::transport
