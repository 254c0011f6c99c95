// SPDX-License-Identifier: Apache-2.0
#include "src/client/websockets.hpp"

#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <map>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>

#include <lrt/version.hpp>

#include "src/base/ascii.hpp"
#include "src/base/descriptor.hpp"
#include "src/base/event_waker.hpp"
#include "src/base/mailbox.hpp"
#include "src/base/thread.hpp"
#include "src/client/http_client.hpp"
#include "src/exchange/wire.hpp"
#include "src/http/response_parser.hpp"
#include "src/http/websocket.hpp"
#include "src/http/websocket_frames.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

using exchange::Moved;
using exchange::Needs;
using exchange::Wire;
using http::WebSocketFrames;
using std::chrono::milliseconds;
using SteadyClock = std::chrono::steady_clock;
using Instant = SteadyClock::time_point;

constexpr milliseconds close_time{2'000}, stop_time{500};
constexpr std::size_t max_connections = 4'096;  // with those that are being closed
constexpr int max_reads = 16;                   // of one connection, before the others have their turn
constexpr std::uint16_t normal = 1000, going_away = 1001, no_code = 1005, too_large = 1009;

/// One connection. Used by the own thread only.
struct Connection {
  enum class Phase : unsigned char { connecting, securing, opening, open, closing };

  std::string where() const { return "WebSocket to \"" + request.url.authority + "\""; }
  bool is_connected() const noexcept { return phase > Phase::connecting; }
  /// The first reason is reported.
  void fail(Errc code, const std::string& reason) {
    if (!end) end = WebSocketEnd{0, {}, 0, {}, {code, where() + ": " + reason}};
  }

  std::uint64_t id = 0;
  WebSocketRequest request;
  std::shared_ptr<WebSocketEvents> events;
  std::unique_ptr<Wire> wire;
  Phase phase = Phase::connecting;
  std::size_t address = 0;                       ///< the present one
  std::uint32_t polled = 0;                      ///< what epoll watches
  Instant limit{};                               ///< of the phase; `open`: of the silence
  bool has_pinged = false;                       ///< since the last byte
  std::string key;                               ///< Sec-WebSocket-Key
  std::string output;                            ///< the rest of the opening request
  std::optional<http::ResponseParser> response;  ///< `opening`
  std::optional<WebSocketFrames> frames;         ///< `open` and `closing`
  std::optional<WebSocketEnd> end;
};
using Phase = Connection::Phase;

std::string system_message(int error) { return std::system_category().message(error); }

/// What can be shown of the reason in a close frame.
std::string printable(std::string_view text) {
  std::string result(text);
  for (char& byte : result)
    if (static_cast<unsigned char>(byte) < 0x20) byte = ' ';
  return result;
}

/// The opening handshake (RFC 6455 4.1). An error names the field that cannot be sent.
Result<std::string> opening_request(const WebSocketRequest& request, const std::string& key) {
  std::string text = "GET " + request.url.target + " HTTP/1.1\r\nHost: " + request.url.authority +
                     "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + key + "\r\n";
  bool has_agent = false;
  const auto add = [&](std::string_view name, std::string_view value) { text.append(name).append(": ").append(value).append("\r\n"); };
  for (const auto& [name, value] : request.fields) {
    if (name.find_first_of("\r\n: ") != std::string::npos || value.find_first_of("\r\n") != std::string::npos)
      return unexpected(Errc::expected_http, "the header field \"" + name + "\" is not valid");
    has_agent |= lrt::detail::iequals_ascii(name, "User-Agent");
    add(name, value);
  }
  if (!request.protocol.empty()) add("Sec-WebSocket-Protocol", request.protocol);
  if (!has_agent) add("User-Agent", "lrt/" LRT_VERSION);
  return text + "\r\n";
}

}  // namespace

struct WebSockets::Impl : std::enable_shared_from_this<Impl> {
  struct Open {
    std::uint64_t id;
    WebSocketRequest request;
    std::shared_ptr<WebSocketEvents> events;
  };
  struct Close {
    std::uint64_t id;
  };
  using Command = std::variant<Open, Close>;

  explicit Impl(const Options& given) : options(given) {}

  // Any thread.
  bool start();
  void put(Command command) {
    commands.put(std::move(command));
    waker.wake();
  }

  // The own thread.
  void run();
  void serve();
  void take_commands();
  bool take_due(Instant now);
  void wait(bool at_once);
  void open(Open command);
  void connect(Connection& c);
  void close(Connection& c, std::uint16_t code);
  void set_limit(Connection& c, Instant limit);
  void expire(Connection& c, Instant now);
  void step(Connection& c);
  Result<Needs> go_on(Connection& c);
  Result<Needs> secure(Connection& c);
  Result<Needs> begin_opening(Connection& c);
  Result<Needs> exchange_opening(Connection& c);
  Result<Needs> take_response(Connection& c, std::string_view bytes);
  Result<Needs> exchange_frames(Connection& c);
  Result<Needs> flush(Connection& c);
  void take_messages(Connection& c);
  void note_end(Connection& c);
  void poll_for(Connection& c, std::uint32_t events);
  void finish(Connection& c);
  void finish_ended();
  Result<const exchange::ClientTls*> tls_for(const Connection& c);

  const Options options;
  Mailbox<Command> commands;
  std::atomic<std::uint64_t> next_id{1};
  std::atomic<bool> stopping{false};
  EventWaker waker;

  std::mutex mutex;  // never held during calls of other functions of lrt
  Thread thread;
  bool is_started = false;

  Descriptor set;  ///< of epoll
  std::map<std::uint64_t, std::unique_ptr<Connection>> connections;
  std::set<std::pair<Instant, std::uint64_t>> limits;
  std::vector<std::uint64_t> again;  ///< connections that may have more bytes
  std::vector<std::uint64_t> ended;
  std::shared_ptr<const exchange::ClientTls> own_tls, anonymous_tls;
  std::array<char, 16 * 1024> scratch;
};

// ------------------------------------------------------------------------------------------------------------ any thread

bool WebSockets::Impl::start() {
  const std::lock_guard lock(mutex);
  if (is_started) return true;
  if (stopping) return false;
  Result<Thread> started = start_thread("lrt-client", options.threads, [self = shared_from_this()] { self->run(); });
  if (!started) return false;
  thread = *std::move(started);
  return is_started = true;
}

WebSockets::WebSockets(const Options& options) : impl_(std::make_shared<Impl>(options)) {}

WebSockets::~WebSockets() { stop(); }

std::uint64_t WebSockets::open(WebSocketRequest request, std::shared_ptr<WebSocketEvents> events) {
  if (!impl_->start()) return 0;
  const std::uint64_t id = impl_->next_id++;
  impl_->put(Impl::Open{id, std::move(request), std::move(events)});
  return id;
}

void WebSockets::close(std::uint64_t connection) { impl_->put(Impl::Close{connection}); }

void WebSockets::stop() noexcept {
  impl_->stopping = true;
  impl_->waker.wake();
  Thread thread;
  {
    const std::lock_guard lock(impl_->mutex);
    std::swap(thread, impl_->thread);
  }
  if (thread.is_current()) thread.detach();  // it has the Impl until it ends
}

// -------------------------------------------------------------------------------------------------------- the own thread

void WebSockets::Impl::run() {
  set = Descriptor(::epoll_create1(EPOLL_CLOEXEC));
  epoll_event event{};
  event.events = EPOLLIN;  // data.u64 0: the waker
  const bool can_wait = set.get() >= 0 && ::epoll_ctl(set.get(), EPOLL_CTL_ADD, waker.descriptor(), &event) == 0;
  if (can_wait) serve();
  stopping = true;
  const Errc code = can_wait ? Errc::cancelled : Errc::io_error;
  const std::string reason = can_wait ? "the client stops" : "no descriptor for waiting";
  commands.take_all([&](Command command) noexcept {  // too late
    if (auto* request = std::get_if<Open>(&command)) {
      try {
        request->events->ended({0, {}, 0, {}, {code, "there is no WebSocket: " + reason}});
      } catch (...) {}
    }
  });
  for (auto& [id, connection] : connections) {
    connection->fail(code, reason);
    connection->events->ended(*connection->end);
  }
  connections.clear();
}

void WebSockets::Impl::serve() {
  std::optional<Instant> stop_until;
  while (true) {
    take_commands();
    finish_ended();
    if (stopping) {
      if (!stop_until) {
        stop_until = SteadyClock::now() + stop_time;
        for (auto& [id, connection] : connections) close(*connection, going_away);
        finish_ended();
      }
      if (connections.empty() || SteadyClock::now() >= *stop_until) return;
    }
    bool has_more = take_due(SteadyClock::now());
    for (const std::uint64_t id : std::exchange(again, {})) {
      if (const auto found = connections.find(id); found != connections.end()) step(*found->second);
    }
    finish_ended();
    has_more |= !again.empty() || !commands.empty();
    wait(has_more);
  }
}

void WebSockets::Impl::take_commands() {
  commands.take_all([this](Command command) noexcept {
    try {
      if (auto* request = std::get_if<Open>(&command)) open(std::move(*request));
      else if (const auto found = connections.find(std::get<Close>(command).id); found != connections.end()) close(*found->second, normal);
    } catch (...) {  // out of memory
      if (auto* request = std::get_if<Open>(&command); request && request->events) request->events->ended({});
    }
  });
}

/// Whether one was due.
bool WebSockets::Impl::take_due(Instant now) {
  bool any = false;
  while (!limits.empty() && limits.begin()->first <= now) {
    const std::uint64_t id = limits.begin()->second;
    limits.erase(limits.begin());
    expire(*connections.at(id), now);
    any = true;
  }
  return any;
}

void WebSockets::Impl::wait(bool at_once) {
  int time = -1;
  if (at_once) {
    time = 0;
  } else if (stopping || !limits.empty()) {
    auto left = std::chrono::ceil<milliseconds>(limits.empty() ? stop_time : limits.begin()->first - SteadyClock::now());
    if (stopping) left = std::min(left, milliseconds(100));
    time = static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 3'600'000));
  }
  std::array<epoll_event, 64> events{};
  const int count = ::epoll_wait(set.get(), events.data(), static_cast<int>(events.size()), time);
  for (int i = 0; i < count; ++i) {
    const std::uint64_t id = events[static_cast<std::size_t>(i)].data.u64;
    if (id == 0) waker.clear();
    else if (const auto found = connections.find(id); found != connections.end()) step(*found->second);
  }
}

void WebSockets::Impl::open(Open command) {
  auto made = std::make_unique<Connection>();
  Connection& c = *made;
  c.id = command.id;
  c.request = std::move(command.request);
  c.events = std::move(command.events);
  connections.emplace(c.id, std::move(made));
  if (stopping) c.fail(Errc::cancelled, "the client stops");
  else if (connections.size() > max_connections) c.fail(Errc::limit_exceeded, "more than " + std::to_string(max_connections) + " connections");
  else if (c.request.addresses.empty()) c.fail(Errc::io_error, "no address");
  if (c.end) ended.push_back(c.id);
  else connect(c);
}

/// Each address gets an equal part of the time.
void WebSockets::Impl::connect(Connection& c) {
  c.phase = Phase::connecting;
  c.polled = 0;
  c.wire = nullptr;
  set_limit(c, SteadyClock::now() + options.limits.connect_time / static_cast<int>(c.request.addresses.size()));
  Result<std::unique_ptr<Wire>> wire = Wire::begin(c.request.addresses[c.address], c.request.url.port);
  if (wire) {
    c.wire = *std::move(wire);
    return step(c);
  }
  c.fail(wire.error().code, wire.error().message);
  ended.push_back(c.id);
}

void WebSockets::Impl::close(Connection& c, std::uint16_t code) {
  if (c.phase == Phase::closing) return;
  c.fail(Errc::cancelled, "closed by this program");
  if (c.phase != Phase::open) return ended.push_back(c.id);
  c.phase = Phase::closing;
  set_limit(c, SteadyClock::now() + close_time);
  c.frames->close(code, {});
  step(c);
}

void WebSockets::Impl::set_limit(Connection& c, Instant limit) {
  limits.erase({c.limit, c.id});
  c.limit = limit;
  limits.emplace(limit, c.id);
}

void WebSockets::Impl::expire(Connection& c, Instant now) {
  if (c.phase == Phase::open && !c.has_pinged) {
    c.has_pinged = true;
    set_limit(c, now + c.request.idle_time - c.request.idle_time / 2);
    if (!c.frames->has_output()) c.frames->ping();
    return step(c);
  }
  switch (c.phase) {
    case Phase::connecting:
    case Phase::securing: c.fail(Errc::timed_out, "timed out while connecting"); break;
    case Phase::opening: c.fail(Errc::timed_out, "no complete opening response in time"); break;
    case Phase::open: c.fail(Errc::timed_out, "nothing was received for " + std::to_string(c.request.idle_time.count()) + " ms"); break;
    case Phase::closing: break;
  }
  ended.push_back(c.id);
}

/// Does what can be done without waiting.
void WebSockets::Impl::step(Connection& c) {
  if (!c.wire) return;  // it has ended
  Errc code = Errc::failed;
  std::string reason;
  try {
    Result<Needs> needs = go_on(c);
    while (needs && *needs == Needs::nothing && !c.end && c.phase < Phase::open) needs = go_on(c);
    if (needs && (!c.end || c.phase == Phase::closing)) {
      const bool is_speaking = c.frames.has_value();
      if (is_speaking && c.frames->state() == WebSocketFrames::State::closed) return ended.push_back(c.id);
      if (*needs == Needs::nothing) return again.push_back(c.id);
      const bool writes = *needs == Needs::writable || (is_speaking && c.frames->has_output());
      const bool reads = *needs == Needs::readable && (!is_speaking || c.frames->wants_input());
      return poll_for(c, (reads ? EPOLLIN : 0U) | (writes ? EPOLLOUT : 0U));
    }
    if (!needs) {
      code = needs.error().code;
      reason = needs.error().message;
    }
  } catch (const std::exception& e) { reason = e.what(); }
  c.fail(code, reason);
  ended.push_back(c.id);
}

/// One phase, as far as it goes. `nothing`: the next one can begin at once, or there are more bytes.
Result<Needs> WebSockets::Impl::go_on(Connection& c) {
  switch (c.phase) {
    case Phase::connecting: {
      Result<Needs> needs = c.wire->try_connect();
      if (!needs || *needs != Needs::nothing) return needs;
      return c.request.url.secure ? secure(c) : begin_opening(c);
    }
    case Phase::securing: {
      Result<Needs> needs = c.wire->try_secure();
      return needs && *needs == Needs::nothing ? begin_opening(c) : needs;
    }
    case Phase::opening: return exchange_opening(c);
    case Phase::open:
    case Phase::closing: break;
  }
  return exchange_frames(c);
}

// --------------------------------------------------------------------------------------------------- the opening handshake

Result<const exchange::ClientTls*> WebSockets::Impl::tls_for(const Connection& c) {
  const bool shows = c.request.shows_certificate && !options.identity.certificate_file.empty();
  std::shared_ptr<const exchange::ClientTls>& tls = shows ? own_tls : anonymous_tls;
  if (!tls) {  // with the first connection: the certificate authorities of the system take time and memory
    const Identity& identity = options.identity;
    auto made =
        shows ? exchange::ClientTls::make(options.ca_file, identity.certificate_file, identity.key_file) : exchange::ClientTls::make(options.ca_file);
    if (!made) return unexpected(std::move(made).error());
    tls = *std::move(made);
  }
  return tls.get();
}

Result<Needs> WebSockets::Impl::secure(Connection& c) {
  c.phase = Phase::securing;
  const Result<const exchange::ClientTls*> tls = tls_for(c);
  if (!tls) return unexpected(tls.error());
  if (Result<void> begun = c.wire->begin_secure(**tls, c.request.url.host); !begun) return unexpected(std::move(begun).error());
  return Needs::nothing;
}

Result<Needs> WebSockets::Impl::begin_opening(Connection& c) {
  c.phase = Phase::opening;
  set_limit(c, SteadyClock::now() + options.limits.response_time);
  c.key = http::new_websocket_key();
  Result<std::string> text = opening_request(c.request, c.key);
  if (!text) return unexpected(std::move(text).error());
  c.output = *std::move(text);
  http::ResponseLimits response_limits;
  response_limits.max_header_bytes = options.limits.max_header_bytes;
  c.response.emplace("GET", response_limits, true);
  return Needs::nothing;
}

Result<Needs> WebSockets::Impl::exchange_opening(Connection& c) {
  while (!c.output.empty()) {
    const Result<Moved> sent = c.wire->try_write(c.output);
    if (!sent) return unexpected(sent.error());
    if (sent->needs != Needs::nothing) return sent->needs;
    c.output.erase(0, sent->bytes);
  }
  const Result<Moved> got = c.wire->try_read(scratch.data(), scratch.size());
  if (!got) return unexpected(got.error());
  if (got->needs != Needs::nothing) return got->needs;
  if (got->bytes == 0) return unexpected(Errc::closed, "the connection was closed before the opening response was complete");
  return take_response(c, {scratch.data(), got->bytes});
}

/// RFC 6455 4.1
Result<Needs> WebSockets::Impl::take_response(Connection& c, std::string_view bytes) {
  using Step = http::ResponseParser::Step;
  Step step = Step::interim;
  while (step == Step::interim) step = c.response->parse(bytes);
  if (step == Step::more) return Needs::nothing;
  if (step == Step::failed) return unexpected(c.response->error().code, "the opening response is not valid: " + c.response->error().message);
  const http::Fields fields = c.response->take_fields();
  if (const int status = c.response->status(); status != 101) {
    c.end = WebSocketEnd{status, retry_after(fields), 0, {}, {Errc::refused, c.where() + ": the server responded with " + std::to_string(status)}};
    return Needs::nothing;
  }
  const auto value = [&](std::string_view name) { return std::string(fields.find(name).value_or(std::string_view())); };
  std::string fault = http::opening_fault(fields, c.request.protocol);
  if (value("Sec-WebSocket-Accept") != http::websocket_accept(c.key)) fault = "Sec-WebSocket-Accept is not that of the request";
  if (!fault.empty()) return unexpected(Errc::expected_http, "the opening response is not valid: " + fault);
  c.response.reset();
  c.phase = Phase::open;
  c.frames.emplace(options.limits.max_message_bytes, WebSocketFrames::Side::client);
  set_limit(c, SteadyClock::now() + c.request.idle_time / 2);
  c.events->opened(value("Location"), value("Sec-WebSocket-Protocol"));
  c.frames->receive(bytes);
  take_messages(c);
  return Needs::nothing;
}

// ----------------------------------------------------------------------------------------------------------------- frames

Result<Needs> WebSockets::Impl::exchange_frames(Connection& c) {
  for (int i = 0; i < max_reads; ++i) {
    Result<Needs> flushed = flush(c);
    if (!flushed || *flushed != Needs::nothing) return flushed;
    if (c.frames->state() == WebSocketFrames::State::closed) return Needs::nothing;
    const Result<Moved> got = c.wire->try_read(scratch.data(), scratch.size());
    if (!got) return unexpected(got.error());
    if (got->needs != Needs::nothing) return got->needs;
    if (got->bytes == 0) return unexpected(Errc::closed, "the connection was closed");
    if (c.phase == Phase::open) {
      c.has_pinged = false;
      set_limit(c, SteadyClock::now() + c.request.idle_time / 2);
    }
    c.frames->receive({scratch.data(), got->bytes});
    take_messages(c);
  }
  return Needs::nothing;
}

Result<Needs> WebSockets::Impl::flush(Connection& c) {
  while (c.frames->has_output()) {
    OutputParts parts;
    c.frames->add_output(parts);
    const iovec& first = *parts.data();
    const Result<Moved> sent = c.wire->try_write({static_cast<const char*>(first.iov_base), first.iov_len});
    if (!sent) return unexpected(sent.error());
    if (sent->needs != Needs::nothing) return sent->needs;
    c.frames->sent(sent->bytes);
    take_messages(c);
  }
  return Needs::nothing;
}

void WebSockets::Impl::take_messages(Connection& c) {
  while (std::optional<WebSocketFrames::Message> message = c.frames->next())
    if (c.phase == Phase::open) c.events->received(std::move(message->bytes));
  if (c.phase == Phase::open && c.frames->state() != WebSocketFrames::State::open) note_end(c);
}

/// Why the frames are closing, although this program did not ask for it.
void WebSockets::Impl::note_end(Connection& c) {
  c.phase = Phase::closing;
  set_limit(c, SteadyClock::now() + close_time);
  const WebSocketFrames::Remarks& remarks = c.frames->remarks();
  if (remarks.fault == too_large) {
    c.fail(Errc::limit_exceeded, "a message is longer than " + std::to_string(options.limits.max_message_bytes) + " bytes");
  } else if (remarks.fault != 0) {
    c.fail(Errc::expected_http, remarks.reason);
  } else if (remarks.close) {
    const std::string_view payload = *remarks.close;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(payload[i])); };
    const auto code = payload.size() < 2 ? no_code : static_cast<std::uint16_t>(byte(0) << 8U | byte(1));
    const std::string reason = printable(payload.substr(std::min<std::size_t>(2, payload.size())));
    c.fail(Errc::closed, "the server closed it with " + std::to_string(code) + (reason.empty() ? "" : ": " + reason));
    c.end->code = code;
    c.end->reason = reason;
  }
}

// ---------------------------------------------------------------------------------------------------------------- the end

void WebSockets::Impl::poll_for(Connection& c, std::uint32_t events) {
  if (c.polled == events) return;
  epoll_event event{};
  event.events = events;
  event.data.u64 = c.id;
  const int operation = c.polled == 0 ? EPOLL_CTL_ADD : EPOLL_CTL_MOD;
  if (::epoll_ctl(set.get(), operation, c.wire->descriptor(), &event) == 0) {
    c.polled = events;
    return;
  }
  c.fail(Errc::io_error, system_message(errno));
  ended.push_back(c.id);
}

void WebSockets::Impl::finish_ended() {
  while (!ended.empty()) {
    for (const std::uint64_t id : std::exchange(ended, {}))
      if (const auto found = connections.find(id); found != connections.end()) finish(*found->second);
  }
}

void WebSockets::Impl::finish(Connection& c) {
  const bool may_retry = c.phase == Phase::connecting && c.end && (c.end->error.code == Errc::io_error || c.end->error.code == Errc::timed_out);
  if (may_retry && c.address + 1 < c.request.addresses.size() && !stopping) {
    ++c.address;
    c.end.reset();
    return connect(c);
  }
  limits.erase({c.limit, c.id});
  c.fail(Errc::closed, "the connection was closed");
  if (c.wire) c.wire->end();
  const std::shared_ptr<WebSocketEvents> events = c.events;
  const WebSocketEnd end = *std::move(c.end);
  connections.erase(c.id);
  events->ended(end);
}

}  // namespace v0
}  // namespace lrt::client
