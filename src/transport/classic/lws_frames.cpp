#include "src/transport/classic/lws_frames.hpp"

#include <libwebsockets.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/utf8.hpp>

#include "src/transport/classic/sigpipe.hpp"

namespace lrt::transport {
namespace {

/// What libwebsockets gets at once. It reads a little more than that in one call, so what was given has been read.
constexpr std::size_t portion = 2048;
/// Capacity that a large message may leave behind: in one WebSocket, and in what all of them share.
constexpr std::size_t kept_capacity = 8 * 1024;
constexpr std::size_t kept_scratch = 64 * 1024;
constexpr std::size_t most_control_payload = 125;  // RFC 6455 5.5
constexpr std::size_t most_head = 14;

unsigned byte(char c) noexcept { return static_cast<unsigned char>(c); }

template <class Buffer>
void clear(Buffer& buffer, std::size_t kept) {
  if (buffer.capacity() > kept) Buffer().swap(buffer);
  else buffer.clear();
}

/// RFC 6455 7.4, and of what IANA has registered since, 1012 and 1013. 1014 is a gateway's.
bool is_close_code(unsigned code) noexcept {
  return (code >= 1000 && code <= 1013 && (code < 1004 || code > 1006)) || (code >= 3000 && code < 5000);
}

/// Those of them to which libwebsockets 4.1 would answer 1002.
bool is_late_code(unsigned code) noexcept { return code == 1012 || code == 1013; }

int on_event(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size);

}  // namespace

class LwsContext {
 public:
  LwsContext() {
    const KeptSigpipe kept;
    lws_set_log_level(0, nullptr);
    static const lws_protocols protocols[] = {
        {"lrt", on_event, 0, portion, 0, nullptr, std::size_t{1} << 30},  // the last: writes as much at once as the pair has room for
        {nullptr, nullptr, 0, 0, 0, nullptr, 0},
    };
    lws_context_creation_info info{};
    info.port = CONTEXT_PORT_NO_LISTEN_SERVER;
    info.vhost_name = "lrt";
    info.protocols = protocols;
    info.gid = static_cast<gid_t>(-1);
    info.uid = static_cast<uid_t>(-1);
    info.options = LWS_SERVER_OPTION_VALIDATE_UTF8 | LWS_SERVER_OPTION_SKIP_SERVER_CANONICAL_NAME;
    context_ = lws_create_context(&info);
    if (context_ == nullptr) return;
    // What it leaves to the first turn of a loop. There is no second: its timers are never looked at.
    lws_service(context_, -1);
    host_ = lws_get_vhost_by_name(context_, info.vhost_name);
  }
  ~LwsContext() {
    if (context_ != nullptr) lws_context_destroy(context_);
  }
  LwsContext(const LwsContext&) = delete;
  LwsContext& operator=(const LwsContext&) = delete;

  bool good() const noexcept { return host_ != nullptr; }
  lws_context* context() const noexcept { return context_; }
  lws_vhost* host() const noexcept { return host_; }

  // Used within one call of one WebSocket.
  std::vector<unsigned char> outgoing;  ///< a message behind the room that libwebsockets asks for
  std::string incoming;                 ///< bytes of a client on their way to libwebsockets

 private:
  lws_context* context_ = nullptr;
  lws_vhost* host_ = nullptr;
};

namespace {

/// libwebsockets has one end of a pair of sockets, and is told that something has come or that it can write when that is so.
///
/// The heads of the frames are looked at before it gets them. It takes unmasked frames, lengths in more bytes than they need, half a close
/// code, and text that ends within a character in an empty last frame; it drops the connection without a close for a long control frame and
/// for a reason that is no UTF-8; of several pings at once it answers the first; it wants a pong to be UTF-8 if the last message was; and it
/// knows no limit of a message. Reserved bits and opcodes, what is wrong with fragments, and UTF-8 are its own business.
class LwsFrames final : public Frames {
 public:
  LwsFrames(std::shared_ptr<LwsContext> context, std::size_t message_bytes) : context_(std::move(context)), message_bytes_(message_bytes) {}
  ~LwsFrames() override { drop(); }

  /// The opening handshake.
  /// @return  Sec-WebSocket-Accept; empty: it failed
  std::string open(std::string_view key);

  void receive(std::string_view bytes) override;
  std::optional<Message> next() override;
  bool wants_input() const noexcept override { return listens() && !message_ && input_.empty() && !answered_; }

  void send(std::shared_ptr<const std::string> message, bool text) override;
  void ping() override;
  void close(std::uint16_t code, std::string_view reason) override;

  Output output() const noexcept override { return {std::string_view(output_).substr(sent_), {}}; }
  void sent(std::size_t bytes) override;

  State state() const noexcept override;
  std::size_t pings() const noexcept override { return pings_; }

  /// From libwebsockets, within service().
  int on_received(std::string_view part);
  int on_writable();
  void on_established() noexcept { established_ = true; }
  void on_destroyed() noexcept { wsi_ = nullptr; }

 private:
  enum class Phase : unsigned char {
    open,
    awaiting,  ///< we have sent a close; the client's is awaited
    ending,    ///< nothing is to be heard any more
    failed,
  };
  /// What is to be written when libwebsockets can.
  enum class Order : unsigned char { none, text, binary, ping, close };

  bool listens() const noexcept { return phase_ == Phase::open || phase_ == Phase::awaiting; }
  void advance();
  void advance(std::string_view& bytes);
  void on_head();
  void on_control(std::string_view frame);
  void on_close(std::string_view frame);
  void refuse(std::uint16_t code);

  void give();
  void give(std::string_view bytes);
  bool is_closing() const noexcept { return wsi_ != nullptr && lws_get_close_length(wsi_) > 0; }
  void service(short event);
  void collect(std::size_t expected);
  void carry_out(Order order, std::size_t expected);
  void begin_close(std::uint16_t code, std::string_view reason);
  void end(Phase phase);
  void drop();

  std::shared_ptr<LwsContext> context_;
  lws* wsi_ = nullptr;  ///< nullptr: libwebsockets has let go of it
  int lws_socket_ = -1;
  int socket_ = -1;
  Phase phase_ = Phase::open;
  bool established_ = false;
  Order order_ = Order::none;
  std::uint16_t close_code_ = 0;
  std::string_view close_reason_;

  // The frame that is being received.
  std::array<char, most_head + most_control_payload> head_{};  ///< as far as it has come; of a control frame all of it
  std::size_t head_size_ = 0;
  std::size_t head_wanted_ = 2;
  std::uint64_t payload_left_ = 0;
  bool is_last_ = false;  ///< of its message

  const std::size_t message_bytes_;
  std::uint64_t message_size_ = 0;  ///< of the client's message, by the heads of its frames
  std::string part_;                ///< as far as it has come
  std::optional<Message> message_;  ///< complete
  std::string input_;               ///< that waits until the owner has taken the message or the answer
  std::size_t used_ = 0;
  std::string output_;
  std::size_t sent_ = 0;
  bool answered_ = false;  ///< there is a pong in output_
  std::size_t pings_ = 0;
};

// -------------------------------------------------------------------------------------------------------------- beginning

std::string LwsFrames::open(std::string_view key) {
  int pair[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) != 0) return {};
  socket_ = pair[0];
  lws_socket_ = pair[1];
  lws_adopt_desc_t adopted{};
  adopted.vh = context_->host();
  adopted.type = static_cast<lws_adoption_type>(LWS_ADOPT_SOCKET | LWS_ADOPT_HTTP);
  adopted.fd.sockfd = lws_socket_;
  adopted.opaque = this;
  wsi_ = lws_adopt_descriptor_vhost_via_info(&adopted);  // which closes its end if it fails
  give("GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " +
       std::string(key) + "\r\n\r\n");
  if (wsi_ == nullptr || !established_) return {};
  collect(1024);
  constexpr std::string_view name = "\r\nSec-WebSocket-Accept: ";
  const auto at = output_.find(name);
  if (at == std::string::npos) return {};
  const auto begin = at + name.size();
  auto accept = output_.substr(begin, output_.find("\r\n", begin) - begin);
  std::string().swap(output_);
  return accept;
}

// -------------------------------------------------------------------------------------------------------------- receiving

void LwsFrames::receive(std::string_view bytes) {
  advance(bytes);
  if (listens()) input_ = bytes;
}

/// Goes on with what waited for the owner.
void LwsFrames::advance() {
  auto rest = std::string_view(input_).substr(used_);
  if (rest.empty()) return;
  advance(rest);
  used_ = input_.size() - rest.size();
  if (!rest.empty() && listens()) return;
  used_ = 0;
  clear(input_, kept_capacity);
}

/// Up to something that the owner should take: a message, or the answer to a ping.
void LwsFrames::advance(std::string_view& bytes) {
  context_->incoming.clear();  // whatever another one may have left when memory ran out
  while (!bytes.empty() && listens() && !message_ && !answered_) {
    if (payload_left_ > 0) {
      const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(payload_left_, bytes.size()));
      context_->incoming += bytes.substr(0, size);
      bytes.remove_prefix(size);
      payload_left_ -= size;
      if (payload_left_ == 0 && is_last_) give();
    } else {
      head_[head_size_++] = bytes.front();
      bytes.remove_prefix(1);
      if (head_size_ == head_wanted_) on_head();
    }
  }
  give();
}

/// What was wanted of it has come.
void LwsFrames::on_head() {
  const bool is_control = (byte(head_[0]) & 0x08U) != 0;
  const std::size_t small_size = byte(head_[1]) & 0x7FU;
  const std::size_t more = small_size == 126 ? 2 : small_size == 127 ? 8 : 0;
  if (head_wanted_ == 2) {
    const bool is_masked = (byte(head_[1]) & 0x80U) != 0;
    const bool is_odd_control = is_control && ((byte(head_[0]) & 0xF0U) != 0x80 || (byte(head_[0]) & 0x0FU) > 0x0A || more != 0);
    if (!is_masked || is_odd_control) return refuse(LWS_CLOSE_STATUS_PROTOCOL_ERR);
    head_wanted_ = 2 + 4 + (is_control ? small_size : more);
    return;
  }
  const std::string_view head(head_.data(), head_size_);
  head_size_ = 0;
  head_wanted_ = 2;
  if (is_control) return on_control(head);

  std::uint64_t size = more == 0 ? small_size : 0;
  for (std::size_t i = 0; i < more; ++i) size = size << 8 | byte(head[2 + i]);
  const bool is_first = (byte(head[0]) & 0x0FU) != 0;
  if (is_first) message_size_ = 0;
  if (phase_ == Phase::open && size > message_bytes_ - message_size_) return refuse(LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE);
  if (size >> 63 != 0 || (more == 2 && size < 126) || (more == 8 && size < 65536)) return refuse(LWS_CLOSE_STATUS_PROTOCOL_ERR);
  context_->incoming += head;
  message_size_ += phase_ == Phase::open ? size : 0;
  payload_left_ = size;
  is_last_ = (byte(head[0]) & 0x80U) != 0;
  if (size == 0 && is_last_) give();
}

void LwsFrames::on_control(std::string_view frame) {
  give();
  if (!listens()) return;
  switch (byte(frame[0])) {
    case 0x88: return on_close(frame);
    case 0x89:
      ++pings_;
      give(frame);
      if (phase_ != Phase::open) return;
      service(LWS_POLLOUT);
      answered_ = true;
      return collect(frame.size());
    case 0x8A: return;  // a pong, which nobody waits for
    default: return;  // there is no other: on_head() has looked
  }
}

void LwsFrames::on_close(std::string_view frame) {
  constexpr std::size_t head = 6;
  std::string payload(frame.substr(head));
  for (std::size_t i = 0; i < payload.size(); ++i) payload[i] = static_cast<char>(payload[i] ^ frame[2 + i % 4]);
  unsigned code = 0;
  if (!payload.empty()) {
    code = payload.size() == 1 ? 0 : byte(payload[0]) << 8 | byte(payload[1]);
    if (!is_close_code(code) || utf8::find_invalid(std::string_view(payload).substr(2))) return refuse(LWS_CLOSE_STATUS_PROTOCOL_ERR);
  }
  if (phase_ == Phase::open && is_late_code(code)) {
    begin_close(static_cast<std::uint16_t>(code), std::string_view(payload).substr(2));
  } else {
    give(frame);
    service(LWS_POLLOUT);  // its answer, if we have not begun
    if (listens()) collect(frame.size());
  }
  if (listens()) end(Phase::ending);
}

/// Fails the connection (RFC 6455 7.1.7), after what came before.
void LwsFrames::refuse(std::uint16_t code) {
  give();
  if (phase_ == Phase::open) begin_close(code, {});
  if (listens()) end(Phase::ending);
}

std::optional<Frames::Message> LwsFrames::next() {
  if (!message_) advance();
  return std::exchange(message_, std::nullopt);
}

int LwsFrames::on_received(std::string_view part) {
  part_ += part;
  if (lws_is_final_fragment(wsi_) == 0) return 0;
  const bool text = lws_frame_is_binary(wsi_) == 0;
  if (text && utf8::ends_within_character(part_)) {
    lws_close_reason(wsi_, LWS_CLOSE_STATUS_INVALID_PAYLOAD, nullptr, 0);
    return -1;
  }
  message_ = Message{std::move(part_), text};
  part_.clear();
  return 0;
}

// ---------------------------------------------------------------------------------------------------------------- sending

void LwsFrames::send(std::shared_ptr<const std::string> message, bool text) {
  if (phase_ != Phase::open) return;
  auto& copy = context_->outgoing;
  copy.resize(LWS_PRE + (message ? message->size() : 0));
  if (message && !message->empty()) std::memcpy(copy.data() + LWS_PRE, message->data(), message->size());
  carry_out(text ? Order::text : Order::binary, copy.size());
  clear(copy, kept_scratch);
}

void LwsFrames::ping() {
  if (phase_ != Phase::open) return;
  context_->outgoing.resize(LWS_PRE);
  carry_out(Order::ping, 2);
}

void LwsFrames::close(std::uint16_t code, std::string_view reason) {
  if (phase_ != Phase::open) return;
  message_.reset();
  std::string().swap(part_);
  begin_close(code, reason);
  if (phase_ == Phase::open) phase_ = Phase::awaiting;
}

void LwsFrames::begin_close(std::uint16_t code, std::string_view reason) {
  close_code_ = code;
  close_reason_ = reason;
  carry_out(Order::close, 0);
  service(LWS_POLLOUT);  // the first time it was told why, now it writes it
  collect(4 + reason.size());
}

void LwsFrames::carry_out(Order order, std::size_t expected) {
  if (wsi_ == nullptr) return;
  order_ = order;
  lws_callback_on_writable(wsi_);
  service(LWS_POLLOUT);
  collect(expected);
  while (wsi_ != nullptr && lws_partial_buffered(wsi_) != 0) {  // more than the pair has room for
    service(LWS_POLLOUT);
    collect(0);  // room for all of it was made
  }
  if (std::exchange(order_, Order::none) != Order::none) end(Phase::failed);
}

int LwsFrames::on_writable() {
  const auto order = std::exchange(order_, Order::none);
  auto* const bytes = context_->outgoing.data() + LWS_PRE;
  switch (order) {
    case Order::none: return 0;
    case Order::text: return lws_write(wsi_, bytes, context_->outgoing.size() - LWS_PRE, LWS_WRITE_TEXT) < 0 ? -1 : 0;
    case Order::binary: return lws_write(wsi_, bytes, context_->outgoing.size() - LWS_PRE, LWS_WRITE_BINARY) < 0 ? -1 : 0;
    case Order::ping: return lws_write(wsi_, bytes, 0, LWS_WRITE_PING) < 0 ? -1 : 0;
    case Order::close: {
      std::array<unsigned char, most_control_payload - 2> reason{};
      const auto size = std::min(close_reason_.size(), reason.size());
      std::copy_n(close_reason_.begin(), size, reason.begin());
      lws_close_reason(wsi_, static_cast<lws_close_status>(close_code_), reason.data(), size);
      return -1;
    }
  }
  return 0;
}

void LwsFrames::sent(std::size_t bytes) {
  sent_ += bytes;
  if (sent_ < output_.size()) return;
  sent_ = 0;
  answered_ = false;
  clear(output_, kept_capacity);
  advance();
}

Frames::State LwsFrames::state() const noexcept {
  switch (phase_) {
    case Phase::open: return State::open;
    case Phase::awaiting: return State::closing;
    case Phase::ending: return output_.empty() ? State::closed : State::closing;
    case Phase::failed: break;
  }
  return State::failed;
}

// ---------------------------------------------------------------------------------------------------------- libwebsockets

void LwsFrames::give() {
  if (listens()) give(context_->incoming);
  clear(context_->incoming, kept_scratch);
}

void LwsFrames::give(std::string_view bytes) {
  while (!bytes.empty() && wsi_ != nullptr) {
    const auto taken = ::send(socket_, bytes.data(), std::min(bytes.size(), portion), MSG_NOSIGNAL);
    if (taken < 0 && errno == EINTR) continue;
    if (taken <= 0) return end(Phase::failed);
    bytes.remove_prefix(static_cast<std::size_t>(taken));
    service(LWS_POLLIN);
    if (phase_ == Phase::open && is_closing()) {  // it has found something wrong
      service(LWS_POLLOUT);
      collect(most_control_payload);
      return end(Phase::ending);
    }
  }
  if (wsi_ == nullptr) end(phase_ == Phase::open ? Phase::failed : Phase::ending);
}

void LwsFrames::service(short event) {
  if (wsi_ == nullptr) return;
  lws_pollfd ready{lws_socket_, event, event};
  lws_service_fd(context_->context(), &ready);
}

/// Takes what libwebsockets has written.
/// @param expected  bytes, if it is known: one call takes that much
void LwsFrames::collect(std::size_t expected) {
  constexpr std::size_t least = 4 * 1024, most = 256 * 1024;
  output_.reserve(output_.size() + expected + 16);
  for (;;) {
    const std::size_t before = output_.size();
    const std::size_t room = expected > 0 ? std::min(expected, most) + 16 : std::clamp(output_.capacity() - before, least, most);
    output_.resize(before + room);
    const auto got = ::recv(socket_, output_.data() + before, room, 0);
    output_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (got < 0 && errno == EINTR) continue;
    if (got < static_cast<ssize_t>(room)) return;
    expected = 0;
  }
}

void LwsFrames::end(Phase phase) {
  phase_ = phase;
  drop();
}

void LwsFrames::drop() {
  service(LWS_POLLHUP);  // frees what it has, and closes its end
  if (wsi_ != nullptr) lws_set_opaque_user_data(wsi_, nullptr);
  wsi_ = nullptr;
  if (socket_ >= 0) ::close(std::exchange(socket_, -1));
}

int on_event(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
  if (reason != LWS_CALLBACK_RECEIVE && reason != LWS_CALLBACK_SERVER_WRITEABLE && reason != LWS_CALLBACK_ESTABLISHED &&
      reason != LWS_CALLBACK_WSI_DESTROY) {
    return 0;
  }
  auto* const frames = static_cast<LwsFrames*>(lws_get_opaque_user_data(wsi));
  if (frames == nullptr) return 0;
  try {
    if (reason == LWS_CALLBACK_RECEIVE) return frames->on_received({static_cast<const char*>(in), size});
    if (reason == LWS_CALLBACK_SERVER_WRITEABLE) return frames->on_writable();
    if (reason == LWS_CALLBACK_ESTABLISHED) frames->on_established();
    else frames->on_destroyed();
    return 0;
  } catch (...) {  // no memory
    return -1;
  }
}

}  // namespace

std::shared_ptr<LwsContext> make_lws_context() {
  auto context = std::make_shared<LwsContext>();
  return context->good() ? context : nullptr;
}

Protocols::Handshake make_lws_frames(std::shared_ptr<LwsContext> context, std::string_view key, std::size_t message_bytes) {
  auto frames = std::make_unique<LwsFrames>(std::move(context), message_bytes);
  auto accept = frames->open(key);
  if (accept.empty()) return {};
  return {std::move(accept), std::move(frames)};
}

}  // namespace lrt::transport
