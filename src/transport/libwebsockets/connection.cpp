// SPDX-License-Identifier: Apache-2.0
#include "src/transport/libwebsockets/connection.hpp"

#include <libwebsockets.h>

#include <algorithm>
#include <utility>
#include <variant>

#include <lrt/http/problem.hpp>

#include "src/http/websocket.hpp"
#include "src/transport/buffers.hpp"
#include "src/transport/libwebsockets/tls.hpp"
#include "src/transport/libwebsockets/vhost.hpp"

namespace lrt::libwebsockets {
namespace {

/// The largest piece that is written at once.
constexpr std::size_t piece_bytes = 64 * 1024;
/// This much of the body of a refused request is received and discarded, so that its connection can be kept.
constexpr std::size_t max_discarded_body_bytes = 16 * 1024;

std::string peer_of(lws* wsi) {
  char text[64] = "";
  lws_get_peer_simple(wsi, text, sizeof text);
  return text;
}

http::Refusal pipelined() { return {503, "a request with a body or an Upgrade field is not accepted before the response to the previous request"}; }

std::int64_t to_microseconds(std::chrono::milliseconds time) { return std::chrono::microseconds(time).count(); }

}  // namespace

Connection::Connection(Vhost& vhost, lws* wsi)
    : vhost_(vhost), wsi_(wsi), peer_(peer_of(wsi)), idle_since_(vhost.now().steady), body_(vhost.bodies(), peer_) {
  incoming_.request.peer = peer_;
}

// ---------------------------------------------------------------------------------------------------------------- requests

std::optional<http::Refusal> Connection::read_request() {
  auto& request = incoming_.request;
  if (requests_++ == 0 && lws_is_ssl(wsi_) != 0) {
    request.secure = true;
    client_certificate_ = client_subject(lws_get_ssl(wsi_));
    request.client_certificate = client_certificate_;
  }
  framing_ = {};
  reusable_ = false;
  request.method = {};
  request.version = 11;
  return incoming_.read(wsi_, framing_);
}

int Connection::on_request() {
  if (phase_ != Phase::idle) return -1;
  lws_set_timeout(wsi_, NO_PENDING_TIMEOUT, 0);
  const auto& limits = vhost_.options().limits;
  auto& request = incoming_.request;
  if (auto refusal = read_request()) return refuse(*std::move(refusal));
  if (framing_.chunked) return refuse({411, "Transfer-Encoding: found \"chunked\", expected Content-Length"});
  if (framing_.length > limits.max_body_bytes) return refuse_size(limits.max_body_bytes);
  if (framing_.length > 0 && is_pipelined()) return refuse(pipelined());
  // Without Content-Length, libwebsockets treats all bytes after POST, PUT and PATCH as a body without end.
  const bool delimited =
      request.find("Content-Length").has_value() || (request.method != "POST" && request.method != "PUT" && request.method != "PATCH");
  reusable_ = !only_stops_ && !dying_ && delimited && framing_.keep_alive && requests_ < limits.max_requests_per_connection;
  incoming_.strip_framing_fields();
  request.judged = nullptr;
  request.body = {};
  request.can_upgrade = false;
  request.can_stream = !vhost_.is_stopping();
  if ((only_stops_ || dying_) && !vhost_.handler().is_stop(request)) return refuse({503, "too many connections"}, "1");
  return framing_.length == 0 ? dispatch() : receive_body();
}

/// The body of a refused request is discarded if it is short and was announced; otherwise the connection ends with the response.
int Connection::receive_body() {
  auto verdict = vhost_.handler().judge_header(incoming_.request, framing_.length, vhost_.now());
  if (verdict.response && (verdict.response->close || framing_.expects_continue || framing_.length > max_discarded_body_bytes)) {
    reusable_ = false;
    return respond(*std::move(verdict.response));
  }
  if (!verdict.response && framing_.length > verdict.max_body_bytes) return refuse_size(verdict.max_body_bytes);
  incoming_.request.judged = std::move(verdict.judged);
  refusal_ = std::move(verdict.response);
  ignores_body_ = verdict.ignores_body;
  discarded_body_bytes_ = 0;
  phase_ = Phase::reading;
  if (!dying_) lws_set_timer_usecs(wsi_, to_microseconds(vhost_.options().limits.body_timeout));
  if (framing_.expects_continue) {
    constexpr std::string_view interim = "HTTP/1.1 100 Continue\r\n\r\n";
    unsigned char* const bytes = vhost_.scratch(interim.size());
    std::copy(interim.begin(), interim.end(), bytes);
    if (lws_write(wsi_, bytes, interim.size(), LWS_WRITE_HTTP_HEADERS) < 0) return -1;
  }
  return 0;
}

/// Whether the request may have arrived before the previous response was sent. libwebsockets 4.1 then has it in a buffer, and
/// treats its header section as the beginning of its body. It does not show which connections have buffered input.
/// 4.3.5 buffers every request after the first, and ends a connection whose client has pipelined a body.
bool Connection::is_pipelined() const {
  if constexpr (LWS_LIBRARY_VERSION_NUMBER >= 4003005) return false;
  else return requests_ > 1 && lws_service_adjust_timeout(lws_get_context(wsi_), 1, 0) == 0;
}

int Connection::on_body(std::string_view part) {
  if (phase_ != Phase::reading) return 0;  // of a request that has its response already, and whose connection ends
  if (part.size() > framing_.length - body_.size() - discarded_body_bytes_) return -1;
  if (refusal_ || ignores_body_) discarded_body_bytes_ += part.size();
  else if (!body_.append(part)) return refuse({503, "the memory for request bodies is in use by other requests; try again later"}, "1");
  return 0;
}

int Connection::on_body_end() {
  if (phase_ != Phase::reading) return 0;
  if (body_.size() + discarded_body_bytes_ != framing_.length) return -1;
  lws_set_timer_usecs(wsi_, LWS_SET_TIMER_USEC_CANCEL);
  return dispatch();
}

int Connection::dispatch() {
  if (refusal_) return respond(*std::exchange(refusal_, std::nullopt));
  auto& request = incoming_.request;
  request.body = body_.view();
  request.body_owner = body_.release();
  auto outcome = vhost_.handler().handle(request, vhost_.now());
  request.body = {};
  request.body_owner.reset();
  body_.clear();
  if (auto* const deferred = std::get_if<engine::Deferred>(&outcome)) {
    ticket_ = deferred->ticket;
    vhost_.tickets.emplace(static_cast<std::uint64_t>(*ticket_), this);
    phase_ = Phase::waiting;
    stop_reading();
    return 0;
  }
  if (auto* const streamed = std::get_if<engine::Streamed>(&outcome)) {
    prepare_stream(streamed->channel, streamed->response);
    return 0;
  }
  if (auto* const upgraded = std::get_if<engine::Upgraded>(&outcome)) {
    vhost_.handler().closed(upgraded->channel);
    return refuse({500, "the response opens a WebSocket, but the request is not a WebSocket handshake"});
  }
  return respond(std::get<http::Response>(std::move(outcome)));
}

/// The handler's decision cannot be deferred here: libwebsockets continues the handshake when this returns.
int Connection::on_upgrade() {
  if (phase_ != Phase::idle || lws_hdr_total_length(wsi_, WSI_TOKEN_UPGRADE) <= 0) return -1;  // libwebsockets has refused it
  auto& request = incoming_.request;
  auto refusal = read_request();
  if (!refusal && (framing_.chunked || framing_.length > 0)) refusal = http::Refusal{400, "WebSocket: expected no body"};
  if (!refusal) refusal = http::check_websocket(request);
  if (!refusal && is_pipelined()) refusal = pipelined();
  if (!refusal && (only_stops_ || dying_)) refusal = http::Refusal{503, "too many connections"};
  if (!refusal && request.find("Sec-WebSocket-Protocol") && !http::offers_subprotocol(request, http::stamped_protocol))
    refusal = http::Refusal{400, "Sec-WebSocket-Protocol: expected none or " + std::string(http::stamped_protocol)};
  if (refusal) return refuse(*std::move(refusal));
  incoming_.strip_framing_fields();
  request.body = {};
  request.can_upgrade = !vhost_.is_stopping();
  request.must_upgrade_now = true;
  request.can_stream = false;
  auto outcome = vhost_.handler().handle(request, vhost_.now());
  if (auto* const response = std::get_if<http::Response>(&outcome)) return respond(std::move(*response));
  if (auto* const streamed = std::get_if<engine::Streamed>(&outcome)) {
    vhost_.handler().closed(streamed->channel);
    return refuse({500, "the response opens an event stream, but the request is a WebSocket handshake"});
  }
  websocket_ = std::make_unique<WebSocket>(vhost_, *this, wsi_);
  if (auto* const upgraded = std::get_if<engine::Upgraded>(&outcome)) {
    websocket_->accept(upgraded->channel, std::move(upgraded->response.fields));
  } else {
    ticket_ = std::get<engine::Deferred>(outcome).ticket;
    vhost_.tickets.emplace(static_cast<std::uint64_t>(*ticket_), this);
  }
  phase_ = Phase::upgraded;
  return 0;
}

int Connection::on_timer() {
  if (dying_) {
    if (phase_ != Phase::waiting && phase_ != Phase::writing) kill();
  } else if (phase_ == Phase::streaming) {
    owes_comment_ = true;
    wait_for_writable();
  } else if (phase_ == Phase::reading) {
    reusable_ = false;
    http::Response response;
    if (refusal_) {
      response = *std::exchange(refusal_, std::nullopt);
    } else {
      http::set_problem(response, {408, "the body was not complete within " + std::to_string(vhost_.options().limits.body_timeout.count()) + " ms"});
    }
    prepare(std::move(response));
    wait_for_writable();
  }
  return 0;
}

// --------------------------------------------------------------------------------------------------------------- responses

void Connection::reply(engine::Reply reply) {
  ticket_.reset();
  if (websocket_) { return reply.channel ? websocket_->accept(*reply.channel, {}) : websocket_->refuse(reply.response); }
  if (reply.channel) return prepare_stream(*reply.channel, reply.response);
  prepare(std::move(reply.response));
  wait_for_writable();
}

int Connection::refuse(http::Refusal refusal, std::string_view retry_after) {
  reusable_ = false;
  http::Response response;
  http::set_problem(response, {refusal.status, std::move(refusal.reason)});
  if (refusal.status == 503) response.fields.add("Retry-After", retry_after);
  if (refusal.status == 426) {
    response.fields.add("Sec-WebSocket-Version", "13");
    response.fields.add("Upgrade", "websocket");
  }
  return respond(std::move(response));
}

int Connection::refuse_size(std::size_t limit) {
  return refuse({413, "the body has " + std::to_string(framing_.length) + " bytes; " + std::to_string(limit) + " are allowed"});
}

int Connection::respond(http::Response response) {
  prepare(std::move(response));
  return write();
}

void Connection::prepare(http::Response response) {
  const auto& request = incoming_.request;
  body_.clear();
  if (response.close || vhost_.is_stopping()) reusable_ = false;
  const TimePoint now = vhost_.now();
  http::write_response_header(out_, response, vhost_.date(now), reusable_, request.version, http::BodyEnd::length, vhost_.common_fields(now));
  if (request.method != "HEAD" && http::may_have_body(response.status)) out_body_ = std::move(response.body);
  phase_ = Phase::writing;
}

/// The end of the connection is the end of the stream.
void Connection::prepare_stream(engine::Channel channel, const http::Response& response) {
  out_ = "HTTP/1.1 200 OK\r\nDate: ";
  const TimePoint now = vhost_.now();
  out_ += vhost_.date(now);
  out_ += "\r\nConnection: close\r\n" + response.fields.block();
  if (const http::Fields* const more = vhost_.common_fields(now)) out_ += more->block();
  out_ += "\r\n";
  stream_ = channel;
  vhost_.channels.emplace(static_cast<std::uint64_t>(channel), this);
  phase_ = Phase::streaming;
  reusable_ = false;
  lws_http_mark_sse(wsi_);
  wait_for_writable();
}

bool Connection::has_output() const noexcept { return written_ < out_.size() + (out_body_ ? out_body_->size() : 0); }

int Connection::on_writable() {
  if (phase_ != Phase::writing && phase_ != Phase::streaming) return 0;
  lws_set_timeout(wsi_, NO_PENDING_TIMEOUT, 0);
  return phase_ == Phase::writing ? write() : write_stream();
}

/// Writes a piece; the next one when libwebsockets says so.
int Connection::write() {
  const std::string_view body = out_body_ ? std::string_view(*out_body_) : std::string_view();
  const auto size = std::min(piece_bytes, out_.size() + body.size() - written_);
  unsigned char* const bytes = vhost_.scratch(size);
  std::size_t used = 0;
  if (written_ < out_.size()) used = out_.copy(reinterpret_cast<char*>(bytes), size, written_);
  if (used < size) body.copy(reinterpret_cast<char*>(bytes) + used, size - used, written_ + used - out_.size());
  written_ += size;
  const bool last = !has_output();
  if (lws_write(wsi_, bytes, size, last && !stream_ ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0) return -1;
  if (last) return finish();
  wait_for_writable();
  return 0;
}

int Connection::write_stream() {
  if (has_output()) return write();
  const auto push = vhost_.handler().next_push(*stream_, vhost_.now());
  if (push && push->close != 0) return -1;
  if (push && push->message) {
    out_body_ = push->message;
    owes_comment_ = false;
  } else if (std::exchange(owes_comment_, false)) {
    out_ = ":\n\n";
  } else {
    stop_reading();
    return 0;
  }
  return has_output() ? write() : 0;
}

/// A response, or what was to be written of a stream, is complete.
int Connection::finish() {
  transport::release(out_);
  out_body_.reset();
  written_ = 0;
  if (stream_) {
    lws_set_timer_usecs(wsi_, to_microseconds(vhost_.options().limits.ping_interval));
    wait_for_writable();
    return 0;
  }
  phase_ = Phase::idle;
  idle_since_ = vhost_.now().steady;
  if (dying_) give_way();
  if (!reusable_) return -1;
  return lws_http_transaction_completed(wsi_) != 0 ? -1 : 0;
}

/// Later input of the client, also its end, is read afterwards. While a response is open libwebsockets does not read, and returns from every wait
/// if input is pending.
void Connection::stop_reading() { lws_rx_flow_control(wsi_, 0); }

/// A client that does not read is disconnected. Each successful write restarts the time. libwebsockets does not write without reading.
void Connection::wait_for_writable() {
  lws_rx_flow_control(wsi_, 1);
  lws_set_timeout(wsi_, PENDING_TIMEOUT_USER_OK, to_seconds(vhost_.options().limits.write_timeout));
  lws_callback_on_writable(wsi_);
}

void Connection::push() {
  if (websocket_) websocket_->push();
  else if (phase_ == Phase::streaming && !has_output()) wait_for_writable();
}

// ------------------------------------------------------------------------------------------------------------------- end

void Connection::end() noexcept {
  websocket_.reset();
  if (ticket_) {
    vhost_.tickets.erase(static_cast<std::uint64_t>(*ticket_));
    if (vhost_.is_open()) vhost_.handler().abandon(*ticket_);
    ticket_.reset();
  }
  if (stream_) {
    vhost_.channels.erase(static_cast<std::uint64_t>(*stream_));
    if (vhost_.is_open()) vhost_.handler().closed(*stream_);
    stream_.reset();
  }
}

void Connection::begin_stop() {
  if (websocket_) websocket_->begin_stop();
  else if (phase_ == Phase::idle || phase_ == Phase::reading || phase_ == Phase::streaming) kill();
}

bool Connection::is_busy() const noexcept { return phase_ == Phase::waiting || phase_ == Phase::writing || phase_ == Phase::upgraded; }

/// libwebsockets calls on_timer() in the next round, before it reads; what has arrived by then is read before the connection ends.
void Connection::give_way() noexcept {
  dying_ = true;
  lws_set_timer_usecs(wsi_, 1);
}

/// The time is set again until the connection has ended: libwebsockets replaces it by header_timeout when it gives the connection a header table,
/// and when it waits for the client to close.
void Connection::kill() noexcept {
  give_way();
  lws_set_timeout(wsi_, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
}

}  // namespace lrt::libwebsockets
