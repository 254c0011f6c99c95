#include "src/transport/asio/websocket.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/error.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cerrno>
#include <cstring>
#include <type_traits>
#include <utility>

namespace lrt::transport {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using beast::error_code;

/// Reads of one turn: Beast takes at most 1536 bytes at once.
constexpr int reads_per_turn = 16;
/// Messages of one turn.
constexpr int pushes_per_turn = 8;
/// Capacity that a client's messages may leave behind.
constexpr std::size_t kept_capacity = 8 * 1024;
constexpr std::size_t most_parts = 4;
/// Bytes that the system may take from us before the client's window has room for them. Without this it takes megabytes: a client that
/// reads slowly would get values of minutes ago, and one that does not read would hold that memory.
constexpr int unsent_bytes = 32 * 1024;

error_code system_error(int number) { return {number, boost::system::system_category()}; }

/// At most `limit` bytes, without a character cut in two.
std::string_view clipped(std::string_view text, std::size_t limit) {
  if (text.size() <= limit) return text;
  while (limit > 0 && (static_cast<unsigned char>(text[limit]) & 0xC0U) == 0x80) --limit;
  return text.substr(0, limit);
}

/// Of UTF-8 that is right up to its end. Beast 1.74 does not ask this when the last frame of a message is empty.
bool ends_within_character(std::string_view text) {
  std::size_t tail = 0;
  while (tail < text.size() && tail < 3 && (static_cast<unsigned char>(text[text.size() - 1 - tail]) & 0xC0U) == 0x80) ++tail;
  if (tail == text.size()) return false;
  const auto lead = static_cast<unsigned char>(text[text.size() - 1 - tail]);
  return tail < (lead >= 0xF0 ? 3U : lead >= 0xE0 ? 2U : lead >= 0xC0 ? 1U : 0U);
}

/// A completion that waits for the socket.
class Waiting {
 public:
  virtual ~Waiting() = default;
  /// Frees itself before it completes: that may begin the next wait.
  virtual void complete(std::unique_ptr<Waiting> self, error_code error, std::size_t bytes) = 0;
};

template <class Handler>
class WaitingFor final : public Waiting {
 public:
  explicit WaitingFor(Handler handler) : handler_(std::move(handler)) {}
  void complete(std::unique_ptr<Waiting> self, error_code error, std::size_t bytes) override {
    auto handler = std::move(handler_);
    self.reset();
    handler(error, bytes);
  }

 private:
  Handler handler_;
};

template <class Handler>
std::unique_ptr<Waiting> waiting_for(Handler&& handler) {
  return std::make_unique<WaitingFor<std::decay_t<Handler>>>(std::forward<Handler>(handler));
}

}  // namespace

/// What Beast's stream stands on: the bytes that came with the handshake, then the socket, or TLS on it.
///
/// A write completes when all of it is sent. With `direct` set the next one does so in the call itself if the socket takes all at once:
/// Asio promises a later completion; a message's write in Beast, whose state has moved into the handler by then, does not need that. All
/// other completions are posted or come from the owner's on_ready() and on_writable(), so that nothing nests.
class WebSocket::Wire {
 public:
  using executor_type = asio::io_context::executor_type;

  Wire(WebSocket& owner, Loop& loop, Socket socket_, std::string early, std::unique_ptr<TlsStream> tls)
      : socket(std::move(socket_)), owner_(owner), loop_(loop), tls_(std::move(tls)), early_(std::move(early)) {}

  executor_type get_executor() noexcept { return loop_.io.get_executor(); }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    into_ = {};
    for (auto at = asio::buffer_sequence_begin(buffers); at != asio::buffer_sequence_end(buffers) && into_.size() == 0; ++at) into_ = *at;
    if (into_.size() == 0 || early_used_ < early_.size()) {
      const auto size = asio::buffer_copy(into_, asio::buffer(early_) + early_used_);
      early_used_ += size;
      if (early_used_ == early_.size()) std::string().swap(early_), early_used_ = 0;
      return complete_later(std::forward<Handler>(handler), {}, size);
    }
    reader_ = waiting_for(std::forward<Handler>(handler));
    if (!owner_.input_watched_) owner_.watch(true);
    if (has_more()) owner_.read_later();
  }

  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    parts_used_ = parts_count_ = 0;
    bytes_ = 0;
    for (auto at = asio::buffer_sequence_begin(buffers); at != asio::buffer_sequence_end(buffers) && parts_count_ < most_parts; ++at) {
      const asio::const_buffer part = *at;
      if (part.size() != 0) parts_[parts_count_++] = {const_cast<void*>(part.data()), part.size()};
      bytes_ += part.size();
    }
    error_code error;
    const bool done = send_parts(error);
    if (!done) {
      writer_ = waiting_for(std::forward<Handler>(handler));
      owner_.on_blocked();
    } else if (std::exchange(direct, false)) {
      handler(error, error ? 0 : bytes_);
    } else {
      complete_later(std::forward<Handler>(handler), error, error ? 0 : bytes_);
    }
  }

  // The only thing that Beast does synchronously is to answer the handshake, and the answer is ours.
  template <class Buffers>
  std::size_t write_some(const Buffers& buffers, error_code& error) {
    error = {};
    return beast::buffer_bytes(buffers);
  }
  template <class Buffers>
  std::size_t write_some(const Buffers& buffers) {
    return beast::buffer_bytes(buffers);
  }
  template <class Buffers>
  std::size_t read_some(const Buffers&, error_code& error) {
    error = asio::error::operation_not_supported;
    return 0;
  }
  template <class Buffers>
  std::size_t read_some(const Buffers&) {
    throw beast::system_error(asio::error::operation_not_supported);
  }

  /// RFC 6455 7.1.1 has the server close first; the owner does that, and lingers.
  template <class Handler>
  friend void async_teardown(beast::role_type, Wire& wire, Handler&& handler) {
    wire.loop_.later([completion = std::decay_t<Handler>(std::forward<Handler>(handler))]() mutable { completion(error_code()); });
  }
  friend void beast_close_socket(Wire&) {}  // for Beast's timeouts, which are off

  bool wants_input() const noexcept { return reader_ != nullptr; }
  /// What recv() says, for the read that waits.
  ssize_t receive() {
    auto* const to = static_cast<char*>(into_.data());
    return tls_ ? tls_->receive(to, into_.size()) : ::recv(socket.native_handle(), to, into_.size(), 0);
  }
  /// There may be input that the socket will not tell of.
  bool has_more() const noexcept { return tls_ && tls_->has_more(); }
  std::size_t wanted_bytes() const noexcept { return into_.size(); }
  void complete_read(error_code error, std::size_t bytes) {
    auto* const reader = reader_.get();
    reader->complete(std::move(reader_), error, bytes);
  }

  /// Sends on for the write that waits. False when the socket takes no more now.
  bool send_parts(error_code& error);
  void complete_write(error_code error) {
    auto* const writer = writer_.get();
    writer->complete(std::move(writer_), error, error ? 0 : bytes_);
  }
  /// Bytes that the socket has taken.
  std::uint64_t sent_bytes() const noexcept { return sent_bytes_; }

  /// Says what TLS has to say at the end.
  void end() {
    if (tls_) tls_->end();
  }
  void close() {
    end();
    error_code ignored;
    socket.close(ignored);
    const auto reader = std::move(reader_);
    const auto writer = std::move(writer_);
  }

  Socket socket;
  bool direct = false;

 private:
  template <class Handler>
  void complete_later(Handler&& handler, error_code error, std::size_t bytes) {
    loop_.later([completion = std::decay_t<Handler>(std::forward<Handler>(handler)), error, bytes]() mutable { completion(error, bytes); });
  }

  WebSocket& owner_;
  Loop& loop_;
  std::unique_ptr<TlsStream> tls_;
  std::string early_;
  std::size_t early_used_ = 0;
  std::unique_ptr<Waiting> reader_;
  asio::mutable_buffer into_;
  std::unique_ptr<Waiting> writer_;
  std::array<iovec, most_parts> parts_{};
  std::size_t parts_count_ = 0;
  std::size_t parts_used_ = 0;
  std::size_t bytes_ = 0;
  std::uint64_t sent_bytes_ = 0;
};

bool WebSocket::Wire::send_parts(error_code& error) {
  while (parts_used_ < parts_count_) {
    msghdr message{};
    message.msg_iov = &parts_[parts_used_];
    message.msg_iovlen = parts_count_ - parts_used_;
    const auto sent = tls_ ? tls_->send(message.msg_iov, message.msg_iovlen) : ::sendmsg(socket.native_handle(), &message, MSG_NOSIGNAL);
    if (sent < 0) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN || errno == EWOULDBLOCK) return false;
      error = system_error(errno);
      return true;
    }
    sent_bytes_ += static_cast<std::uint64_t>(sent);
    for (auto left = static_cast<std::size_t>(sent); left > 0;) {
      auto& part = parts_[parts_used_];
      const auto size = std::min(left, part.iov_len);
      part = {static_cast<char*>(part.iov_base) + size, part.iov_len - size};
      left -= size;
      if (part.iov_len == 0) ++parts_used_;
    }
  }
  return true;
}

struct WebSocket::Stream {
  Stream(WebSocket& owner, Loop& loop, Socket socket, std::string early, std::unique_ptr<TlsStream> tls)
      : beast(owner, loop, std::move(socket), std::move(early), std::move(tls)) {}
  Wire& wire() noexcept { return beast.next_layer(); }
  int descriptor() noexcept { return wire().socket.native_handle(); }

  websocket::stream<Wire, false> beast;
  boost::beast::flat_buffer message;  ///< of the client, as far as it has come
};

template <class Step>
auto WebSocket::alive(Step step) {
  return [weak = weak_from_this(), step](const error_code& error, auto...) {
    if (const auto self = weak.lock()) step(error);
  };
}

WebSocket::WebSocket(Loop& loop, Socket socket, Session::Upgrade upgrade, bool watched, Addresses::Place place,
                     std::unique_ptr<TlsStream> tls)
    : Client(loop),
      upgrade_(std::move(upgrade)),
      place_(std::move(place)),
      channel_(upgrade_.channel),
      stream_(std::make_unique<Stream>(*this, loop, std::move(socket), std::move(upgrade_.early), std::move(tls))),
      watched_(watched) {}

WebSocket::~WebSocket() = default;

// -------------------------------------------------------------------------------------------------------------- beginning

void WebSocket::open(TimePoint now) {
  loop_.channels.emplace(static_cast<std::uint64_t>(channel_), this);
  watch(true);  // at once: what the loop has registered is the Connection
  ::setsockopt(stream_->descriptor(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes, sizeof unsent_bytes);
  head_ = take_head(now);
  if (head_.empty()) return close();
  auto& wire = stream_->wire();
  wire.direct = true;
  wire.async_write_some(asio::buffer(head_), alive([this](const error_code& error) {
                          if (phase_ != Phase::opening) return;
                          if (error) return close();
                          begin(loop_.clock.now());
                        }));
  wire.direct = false;
}

/// Has Beast answer the handshake, for its state and the Sec-WebSocket-Accept; the bytes that go out are written where all heads are.
std::string WebSocket::take_head(TimePoint now) {
  namespace http_ = beast::http;
  auto& stream = stream_->beast;
  const auto& limits = loop_.options.limits;
  std::string accept;
  stream.set_option(websocket::stream_base::decorator(
      [&accept](websocket::response_type& response) { accept = std::string(response[http_::field::sec_websocket_accept]); }));
  stream.set_option(websocket::stream_base::timeout{websocket::stream_base::none(), websocket::stream_base::none(), false});
  stream.auto_fragment(false);
  stream.read_message_max(std::max<std::size_t>(limits.websocket_message_bytes, 1));  // 0 would be no limit

  http_::request<http_::empty_body> request(http_::verb::get, "/", 11);
  request.set(http_::field::host, "localhost");
  request.set(http_::field::connection, "upgrade");
  request.set(http_::field::upgrade, "websocket");
  request.set(http_::field::sec_websocket_version, "13");
  request.set(http_::field::sec_websocket_key, upgrade_.key);
  error_code error;
  stream.accept(request, error);
  stream.set_option(websocket::stream_base::decorator([](websocket::response_type&) {}));
  if (error) return {};

  auto& response = upgrade_.response;
  response.status = 101;
  response.close = false;
  response.fields.set("Upgrade", "websocket");
  response.fields.set("Connection", "Upgrade");
  response.fields.set("Sec-WebSocket-Accept", accept);
  std::string head;
  http::write_head(head, response, loop_.context.date(now.utc), true, 11);
  return head;
}

void WebSocket::begin(TimePoint now) {
  phase_ = Phase::open;
  std::string().swap(head_);
  upgrade_ = {};
  window_ = now.steady;
  heard(now);
  read();
  push(now);
}

// ---------------------------------------------------------------------------------------------------------------- reading

void WebSocket::on_ready(bool broken) {
  if (phase_ == Phase::closed) return;
  if (phase_ == Phase::lingering) return discard();
  auto& wire = stream_->wire();
  if (!wire.wants_input()) return broken ? close() : watch(false);
  const auto now = loop_.clock.now();
  for (int turn = 0; turn < reads_per_turn; ++turn) {
    const auto wanted = wire.wanted_bytes();
    const auto got = wire.receive();
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (got <= 0) {
      wire.complete_read(got < 0 ? system_error(errno) : error_code(asio::error::eof), 0);
      return close();  // as Beast told us already, if an operation of ours was under way
    }
    heard(now);
    wire.complete_read({}, static_cast<std::size_t>(got));
    if (static_cast<std::size_t>(got) < wanted || phase_ > Phase::closing || !wire.wants_input()) return;
  }
}

/// What TLS has decrypted comes without an event of the socket.
void WebSocket::read_later() {
  if (std::exchange(reads_later_, true)) return;
  loop_.later([weak = weak_from_this(), this] {
    const auto self = weak.lock();
    if (!self) return;
    reads_later_ = false;
    if (phase_ != Phase::closed && stream_->wire().wants_input() && stream_->wire().has_more()) on_ready(false);
  });
}

void WebSocket::read() {
  stream_->beast.async_read(stream_->message, alive([this](const error_code& error) {
                              if (error) finish(error);
                              else on_read();
                            }));
}

void WebSocket::on_read() {
  if (phase_ != Phase::open) return;  // while closing the rest is Beast's
  const auto now = loop_.clock.now();
  auto& message = stream_->message;
  const std::string_view text(static_cast<const char*>(message.cdata().data()), message.size());
  if (stream_->beast.got_text() && ends_within_character(text)) return begin_close(1007, {}, now);
  if (is_too_much(now)) return begin_close(1008, "too many messages", now);
  loop_.context.handler->received(channel_, text, stream_->beast.got_text(), now);
  message.clear();
  if (message.capacity() > kept_capacity) message.shrink_to_fit();
  push(now);  // before anything that the next read may answer
  if (phase_ == Phase::open) read();
}

/// Counted from the first message after the last ping_time was over.
bool WebSocket::is_too_much(TimePoint now) {
  const auto& limits = loop_.options.limits;
  if (now.steady - window_ >= limits.ping_time) {
    window_ = now.steady;
    window_messages_ = 0;
  }
  return ++window_messages_ > limits.websocket_messages;
}

/// Reads what nobody needs, so that closing does not reset the connection while the client's last bytes are on their way.
void WebSocket::discard() {
  auto& scratch = loop_.scratch;
  for (int turn = 0; turn < reads_per_turn; ++turn) {
    const auto got = ::recv(stream_->descriptor(), scratch.data(), scratch.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (got <= 0) return close();
    discarded_ += static_cast<std::size_t>(got);
    if (discarded_ >= loop_.options.limits.linger_bytes) return watch(false);  // TCP holds the client back until the time is over
    if (static_cast<std::size_t>(got) < scratch.size()) return;
  }
}

// ---------------------------------------------------------------------------------------------------------------- writing

void WebSocket::push(TimePoint now) {
  if (phase_ != Phase::open || writing_) return;
  if (TurnEntry::is_linked()) TurnEntry::unlink();
  for (int turn = 0; turn < pushes_per_turn; ++turn) {
    auto push = loop_.context.handler->next_push(channel_, now);
    if (!push) return;
    if (push->close != 0) return begin_close(push->close, push->reason, now);
    send(std::move(*push));
    if (writing_ || phase_ != Phase::open) return;
    if (loop_.readiness.is_over()) break;
  }
  loop_.turns.push_back(*this);
}

void WebSocket::send(engine::Push next) {
  message_ = std::move(next.message);
  writing_ = sending_ = true;
  auto& wire = stream_->wire();
  wire.direct = true;
  stream_->beast.binary(!next.text);
  stream_->beast.async_write(message_ ? asio::buffer(*message_) : asio::const_buffer(), alive([this](const error_code& error) {
                               writing_ = false;
                               message_.reset();
                               if (error) return finish(error);
                               if (!sending_) push(loop_.clock.now());
                             }));
  wire.direct = false;
  sending_ = false;
}

void WebSocket::on_blocked() {
  loop_.deadlines.set(progress_, Deadlines::blocked, loop_.clock.now().steady + loop_.options.limits.write_time);
  wait_writable();
}

void WebSocket::wait_writable() {
  stream_->wire().socket.async_wait(Socket::wait_write, alive([this](const error_code& error) {
                                      if (!error && phase_ != Phase::closed) on_writable();
                                    }));
}

void WebSocket::on_writable() {
  auto& wire = stream_->wire();
  const auto before = wire.sent_bytes();
  error_code error;
  if (wire.send_parts(error)) {
    loop_.deadlines.clear(progress_);
    return wire.complete_write(error);
  }
  if (wire.sent_bytes() == before) wait_writable();
  else on_blocked();
}

// ---------------------------------------------------------------------------------------------------------------- closing

void WebSocket::begin_stop(TimePoint now) {
  if (phase_ == Phase::opening) close();
  else begin_close(1001, {}, now);
}

void WebSocket::begin_close(std::uint16_t code, std::string_view reason, TimePoint now) {
  if (phase_ != Phase::open) return;
  phase_ = Phase::closing;
  if (TurnEntry::is_linked()) TurnEntry::unlink();
  loop_.deadlines.set(life_, Deadlines::closing, now.steady + loop_.options.limits.close_time);
  websocket::close_reason close_reason(code);
  const auto clip = clipped(reason, close_reason.reason.max_size());
  close_reason.reason.assign(clip.data(), clip.size());
  stream_->beast.async_close(close_reason, alive([this](const error_code& error) { finish(error); }));
}

/// The stream is over. The first who is told knows why; the others are told that it is over.
void WebSocket::finish(const error_code& error) {
  if (phase_ > Phase::closing) return;
  const bool closed_properly = !error || error.category() == error_code(websocket::error::closed).category();
  if (!closed_properly) return close();
  const auto now = loop_.clock.now();
  if (phase_ != Phase::closing) loop_.deadlines.set(life_, Deadlines::closing, now.steady + loop_.options.limits.close_time);
  phase_ = Phase::lingering;
  loop_.deadlines.clear(progress_);
  if (TurnEntry::is_linked()) TurnEntry::unlink();
  release_channel();
  stream_->wire().end();
  ::shutdown(stream_->descriptor(), SHUT_WR);
  watch(true);
}

void WebSocket::close() {
  if (phase_ == Phase::closed) return;
  phase_ = Phase::closed;
  loop_.deadlines.clear(life_);
  loop_.deadlines.clear(progress_);
  if (TurnEntry::is_linked()) TurnEntry::unlink();
  release_channel();
  stream_->wire().close();
  place_ = {};
  leave();
}

void WebSocket::release_channel() {
  if (!std::exchange(owes_closed_, false)) return;
  loop_.channels.erase(static_cast<std::uint64_t>(channel_));
  loop_.context.handler->closed(channel_);
}

// ------------------------------------------------------------------------------------------------------------------- time

/// Any byte is a sign of life.
void WebSocket::heard(TimePoint now) {
  if (phase_ != Phase::open) return;
  pinged_ = false;
  loop_.deadlines.set(life_, Deadlines::silent, now.steady + loop_.options.limits.ping_time);
}

void WebSocket::on_silence(TimePoint now) {
  if (phase_ != Phase::open || pinged_) return close();
  pinged_ = true;
  loop_.deadlines.set(life_, Deadlines::unanswered, now.steady + loop_.options.limits.pong_time);
  if (pinging_) return;  // the last one still waits behind a message
  pinging_ = true;
  stream_->beast.async_ping({}, alive([this](const error_code& error) {
                              pinging_ = false;
                              if (error) finish(error);
                            }));
}

void WebSocket::watch(bool wanted) {
  if (phase_ == Phase::closed) return;
  if (watched_ && wanted == input_watched_) return;
  input_watched_ = wanted;
  loop_.readiness.watch(*this, stream_->descriptor(), wanted, watched_);
}

}  // namespace lrt::transport
