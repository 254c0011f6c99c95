#include "src/transport/http/websocket_frames.hpp"

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/execution.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/error.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cassert>
#include <type_traits>
#include <vector>

#include <lrt/base/unique_function.hpp>
#include <lrt/base/utf8.hpp>

namespace lrt::transport {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using beast::error_code;

/// Capacity of a buffer that is kept for the next message of the client.
constexpr std::size_t kept_capacity = 8 * 1024;

/// Places for messages that are kept while there are none.
constexpr std::size_t kept_messages = 1;

/// RFC 6455 5.5: a control frame has at most 125 bytes, two of a close are its code.
constexpr std::size_t max_reason_bytes = 123;

/// At most `limit` bytes, without a character cut in two.
std::string_view clipped(std::string_view text, std::size_t limit) {
  if (text.size() <= limit) return text;
  while (limit > 0 && (static_cast<unsigned char>(text[limit]) & 0xC0U) == 0x80) --limit;
  return text.substr(0, limit);
}

}  // namespace

/// Polling an io_context that has a timer (Beast's stream makes one, though its time-outs are off) is a system call, which no message
/// needs: so completions go to a list.
class WebSocketFramer::Queue {
 public:
  void post(UniqueFunction<void()> task) { tasks_.push_back(std::move(task)); }
  void run() {
    while (!tasks_.empty()) {
      auto tasks = std::exchange(tasks_, {});
      for (auto& task : tasks) task();
    }
  }

  asio::io_context context;  ///< never run; owns the services that Beast's stream uses

 private:
  std::vector<UniqueFunction<void()>> tasks_;
};

namespace {

using Queue = WebSocketFramer::Queue;

/// Posts to a Queue.
class Executor {
 public:
  explicit Executor(Queue& queue) noexcept : queue_(&queue) {}

  asio::execution_context& query(asio::execution::context_t) const noexcept { return queue_->context; }
  static constexpr asio::execution::blocking_t query(asio::execution::blocking_t) noexcept { return asio::execution::blocking.never; }
  Executor require(asio::execution::blocking_t::never_t) const noexcept { return *this; }
  /// Outstanding work is not counted. Without this function Beast 1.74 keeps a reference to a temporary.
  Executor require(asio::execution::outstanding_work_t::tracked_t) const noexcept { return *this; }
  template <class Task>
  void execute(Task&& task) const {
    queue_->post(std::forward<Task>(task));
  }
  friend bool operator==(const Executor& a, const Executor& b) noexcept { return a.queue_ == b.queue_; }
  friend bool operator!=(const Executor& a, const Executor& b) noexcept { return a.queue_ != b.queue_; }

 private:
  Queue* queue_;
};

/// A completion that waits until bytes have been received or sent.
class Waiting {
 public:
  virtual ~Waiting() = default;
  /// Frees itself first: the completion may begin the next wait.
  virtual void complete(std::unique_ptr<Waiting> self, std::size_t bytes) = 0;
};

template <class Handler>
class WaitingFor final : public Waiting {
 public:
  explicit WaitingFor(Handler handler) : handler_(std::move(handler)) {}
  void complete(std::unique_ptr<Waiting> self, std::size_t bytes) override {
    auto handler = std::move(handler_);
    self.reset();
    handler(error_code(), bytes);
  }

 private:
  Handler handler_;
};

template <class Handler>
std::unique_ptr<Waiting> waiting_for(Handler&& handler) {
  return std::make_unique<WaitingFor<std::decay_t<Handler>>>(std::forward<Handler>(handler));
}

/// The next layer of Beast's stream: its concepts AsyncStream and SyncStream on memory. A read completes when the owner gives input, a write
/// when the owner has sent its bytes.
class Wire {
 public:
  using executor_type = Executor;

  explicit Wire(Queue& queue) : queue_(queue) {}

  executor_type get_executor() noexcept { return Executor(queue_); }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    into_ = {};
    for (auto at = asio::buffer_sequence_begin(buffers); at != asio::buffer_sequence_end(buffers) && into_.size() == 0; ++at) into_ = *at;
    if (into_.size() == 0) return complete_later(std::forward<Handler>(handler));
    reader_ = waiting_for(std::forward<Handler>(handler));
  }

  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    parts_ = {};
    bytes_ = 0;
    std::size_t count = 0;
    for (auto at = asio::buffer_sequence_begin(buffers); at != asio::buffer_sequence_end(buffers) && count < parts_.size(); ++at) {
      const asio::const_buffer part = *at;
      if (part.size() == 0) continue;
      parts_[count++] = {static_cast<const char*>(part.data()), part.size()};
      bytes_ += part.size();
    }
    if (count == 0) return complete_later(std::forward<Handler>(handler));
    writer_ = waiting_for(std::forward<Handler>(handler));
  }

  // Beast writes synchronously only its response to the handshake. The response that the client gets has the fields of the handler, and none
  // of Beast (which adds Server), and is sent by the owner: so this one is discarded.
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

  template <class Handler>
  friend void async_teardown(beast::role_type, Wire& wire, Handler&& handler) {
    wire.queue_.post([completion = std::decay_t<Handler>(std::forward<Handler>(handler))]() mutable { completion(error_code()); });
  }
  friend void beast_close_socket(Wire&) {}  // called by Beast's time-outs, which are off

  bool is_reading() const noexcept { return reader_ != nullptr; }
  /// Completes the pending read with as many of `bytes` as it takes, and removes them.
  void give(std::string_view& bytes) {
    const auto size = asio::buffer_copy(into_, asio::buffer(bytes.data(), bytes.size()));
    bytes.remove_prefix(size);
    auto* const reader = reader_.get();
    reader->complete(std::move(reader_), size);
  }

  bool is_writing() const noexcept { return writer_ != nullptr; }
  void add_output(OutputParts& parts) const noexcept {
    if (!writer_) return;
    for (const std::string_view part : parts_) parts.add(part);
  }
  void sent(std::size_t bytes) {
    const auto first = std::min(bytes, parts_[0].size());
    parts_[0].remove_prefix(first);
    parts_[1].remove_prefix(std::min(bytes - first, parts_[1].size()));
    if (!parts_[0].empty() || !parts_[1].empty()) return;
    auto* const writer = writer_.get();
    writer->complete(std::move(writer_), bytes_);
  }

  /// Drops the pending read and write.
  void drop() {
    const auto reader = std::move(reader_);
    const auto writer = std::move(writer_);
  }

 private:
  template <class Handler>
  void complete_later(Handler&& handler) {
    queue_.post([completion = std::decay_t<Handler>(std::forward<Handler>(handler))]() mutable { completion(error_code(), 0); });
  }

  Queue& queue_;
  std::unique_ptr<Waiting> reader_;
  asio::mutable_buffer into_;
  std::unique_ptr<Waiting> writer_;
  std::array<std::string_view, 2> parts_;  ///< not yet sent
  std::size_t bytes_ = 0;                  ///< of the write
};

/// Completions run only within the functions of WebSocketFrames, so none of them destroys this.
class BeastFrames final : public WebSocketFrames {
 public:
  explicit BeastFrames(Queue& queue) : queue_(queue), stream_(queue) {}
  ~BeastFrames() override { wire().drop(); }

  /// Returns the value of Sec-WebSocket-Accept.
  std::string accept(std::string_view key, std::size_t max_message_bytes);

  void receive(std::string_view bytes) override;
  std::optional<Message> next() override;
  bool wants_input() const noexcept override { return wire().is_reading() && !over_; }
  void send(std::shared_ptr<const std::string> message, bool text) override;
  void ping() override;
  void close(std::uint16_t code, std::string_view reason) override;
  bool has_output() const noexcept override { return !over_ && (!outgoing_.empty() || wire().is_writing()); }
  void add_output(OutputParts& parts) const noexcept override;
  void sent(std::size_t bytes) override;
  State state() const noexcept override {
    if (over_) return *over_;
    return closing_ || !stream_.is_open() ? State::closing : State::open;
  }
  std::size_t pings() const noexcept override { return pings_; }

 private:
  Wire& wire() noexcept { return stream_.next_layer(); }
  const Wire& wire() const noexcept { return stream_.next_layer(); }
  void read();
  void on_read();
  void feed(std::string_view& bytes);
  void feed_kept();
  void begin_close(std::uint16_t code, std::string_view reason);
  void finish(const error_code& error);

  /// A message and its header: a server's frame has no mask, so the bytes of the message are shared by all clients that get it.
  struct Outgoing {
    std::shared_ptr<const std::string> message;
    std::array<char, 10> header;
    unsigned char header_size;
    std::size_t size() const noexcept { return header_size + message->size(); }
  };

  Queue& queue_;
  std::vector<Outgoing> outgoing_;      ///< sent before what Beast writes, which are control frames
  std::size_t first_ = 0;               ///< of outgoing_, not yet sent
  std::size_t first_sent_ = 0;          ///< bytes of that
  std::string kept_;  ///< received bytes behind a message that next() has not returned, or that wait for output() to be sent
  std::size_t used_ = 0;
  beast::flat_buffer message_;  ///< of the client, as far as it was received
  bool reading_ = false;        ///< Beast reads a message
  bool ready_ = false;          ///< message_ is complete
  std::size_t pings_ = 0;
  bool closing_ = false;        ///< by us
  std::optional<State> over_;
  websocket::stream<Wire, false> stream_;  // last: its completions use the members above
};

/// Opens the stream as Beast documents for a request that was read elsewhere: accept(request). http::check_websocket() has checked that
/// request; what of it matters here is the key, the rest is its canonical form.
std::string BeastFrames::accept(std::string_view key, std::size_t max_message_bytes) {
  namespace http_ = beast::http;
  std::string accept;
  stream_.set_option(websocket::stream_base::decorator(
      [&accept](websocket::response_type& response) { accept = std::string(response[http_::field::sec_websocket_accept]); }));
  stream_.set_option(websocket::stream_base::timeout{websocket::stream_base::none(), websocket::stream_base::none(), false});
  stream_.auto_fragment(false);
  stream_.read_message_max(std::max<std::size_t>(max_message_bytes, 1));  // 0 would be no limit

  http_::request<http_::empty_body> request(http_::verb::get, "/", 11);
  request.set(http_::field::host, "localhost");
  request.set(http_::field::connection, "upgrade");
  request.set(http_::field::upgrade, "websocket");
  request.set(http_::field::sec_websocket_version, "13");
  request.set(http_::field::sec_websocket_key, beast::string_view(key.data(), key.size()));
  error_code error;
  stream_.accept(request, error);
  stream_.set_option(websocket::stream_base::decorator([](websocket::response_type&) {}));
  assert(!error);
  stream_.control_callback([this](websocket::frame_type type, beast::string_view) {
    if (type == websocket::frame_type::ping) ++pings_;
    // RFC 6455 7.4.2 has no such codes. Beast would echo them.
    if (type == websocket::frame_type::close && stream_.reason().code >= 5000 && state() == State::open) begin_close(1002, {});
  });
  read();
  queue_.run();
  return accept;
}

// ---------------------------------------------------------------------------------------------------------------- reading

void BeastFrames::receive(std::string_view bytes) {
  assert(used_ == kept_.size());
  feed(bytes);
  if (over_ || bytes.empty()) return;
  kept_ = bytes;
  used_ = 0;
}

std::optional<WebSocketFrames::Message> BeastFrames::next() {
  if (!ready_ && !reading_ && state() == State::open) {
    read();
    feed_kept();
  }
  if (!ready_ || state() != State::open) return std::nullopt;
  ready_ = false;
  const auto data = message_.cdata();
  Message message{std::string(static_cast<const char*>(data.data()), data.size()), stream_.got_text()};
  message_.clear();
  if (message_.capacity() > kept_capacity) message_.shrink_to_fit();
  return message;
}

void BeastFrames::read() {
  reading_ = true;
  stream_.async_read(message_, [this](const error_code& error, std::size_t) {
    reading_ = false;
    if (error) finish(error);
    else on_read();
  });
}

void BeastFrames::on_read() {
  if (closing_) return;  // Beast reads on until the close of the client
  const auto data = message_.cdata();
  // Beast 1.74 does not check this when the last frame of a message is empty.
  if (stream_.got_text() && utf8::ends_within_character({static_cast<const char*>(data.data()), data.size()})) return begin_close(1007, {});
  ready_ = true;
}

/// Runs completions and gives Beast as many of `bytes` as it reads now; the others stay in it.
void BeastFrames::feed(std::string_view& bytes) {
  queue_.run();
  while (wire().is_reading() && !bytes.empty()) {
    wire().give(bytes);
    queue_.run();
  }
}

void BeastFrames::feed_kept() {
  auto bytes = std::string_view(kept_).substr(used_);
  feed(bytes);
  used_ = kept_.size() - bytes.size();
  if (used_ < kept_.size() && !over_) return;
  used_ = 0;
  kept_.clear();
  if (kept_.capacity() > kept_capacity) kept_.shrink_to_fit();
}

// ---------------------------------------------------------------------------------------------------------------- writing

/// RFC 6455 5.2: a final frame without extensions. Beast would make its write operation for it, which costs more than the frame.
void BeastFrames::send(std::shared_ptr<const std::string> message, bool text) {
  assert(state() == State::open && !wire().is_writing());
  Outgoing& out = outgoing_.emplace_back();
  const std::uint64_t size = message->size();
  const int length_bytes = size < 126 ? 0 : size <= 0xFFFF ? 2 : 8;
  out.header[0] = static_cast<char>(0x80 | (text ? 1 : 2));
  out.header[1] = static_cast<char>(length_bytes == 0 ? size : length_bytes == 2 ? 126U : 127U);
  for (int i = 0; i < length_bytes; ++i) out.header[static_cast<std::size_t>(2 + i)] = static_cast<char>(size >> (8 * (length_bytes - 1 - i)));
  out.header_size = static_cast<unsigned char>(2 + length_bytes);
  out.message = std::move(message);
}

void BeastFrames::add_output(OutputParts& parts) const noexcept {
  std::size_t skip = first_sent_;
  for (std::size_t i = first_; i < outgoing_.size(); ++i) {
    if (parts.room() < 2) return;
    const Outgoing& out = outgoing_[i];
    const std::size_t of_header = std::min<std::size_t>(skip, out.header_size);
    parts.add(std::string_view(out.header.data(), out.header_size).substr(of_header));
    parts.add(std::string_view(*out.message).substr(skip - of_header));
    skip = 0;
  }
  if (parts.room() >= 2) wire().add_output(parts);
}

void BeastFrames::ping() {
  assert(state() == State::open && !wire().is_writing());
  stream_.async_ping({}, [this](const error_code& error) {
    if (error) finish(error);
  });
  queue_.run();
}

void BeastFrames::sent(std::size_t bytes) {
  if (bytes == 0) return;
  for (; first_ < outgoing_.size(); ++first_, first_sent_ = 0) {
    const std::size_t left = outgoing_[first_].size() - first_sent_;
    if (bytes < left) {
      first_sent_ += bytes;
      return;
    }
    bytes -= left;
    outgoing_[first_].message.reset();
  }
  outgoing_.clear();
  if (outgoing_.capacity() > kept_messages) std::vector<Outgoing>().swap(outgoing_);
  first_ = 0;
  if (bytes == 0 || !wire().is_writing()) return;
  wire().sent(bytes);
  feed_kept();
}

// ---------------------------------------------------------------------------------------------------------------- closing

void BeastFrames::close(std::uint16_t code, std::string_view reason) {
  if (state() != State::open) return;
  begin_close(code, reason);
  feed_kept();
}

void BeastFrames::begin_close(std::uint16_t code, std::string_view reason) {
  closing_ = true;
  websocket::close_reason close_reason(code);
  const auto clip = clipped(reason, max_reason_bytes);
  close_reason.reason.assign(clip.data(), clip.size());
  stream_.async_close(close_reason, [this](const error_code& error) { finish(error); });
}

/// The stream has ended. The first completion knows why, those after it only that it has.
void BeastFrames::finish(const error_code& error) {
  if (over_) return;
  const bool closed_properly = !error || error.category() == error_code(websocket::error::closed).category();
  over_ = closed_properly ? State::closed : State::failed;
}

}  // namespace

WebSocketFramer::WebSocketFramer() : queue_(std::make_unique<Queue>()) {}
WebSocketFramer::~WebSocketFramer() = default;

WebSocketFramer::Handshake WebSocketFramer::accept(std::string_view key, std::size_t max_message_bytes) {
  // The service of timers needs descriptors. A stream of Beast (Boost 1.74) that is not made for lack of them stays registered in the context,
  // whose end then uses it: so the service is made first.
  const asio::steady_timer timer(queue_->context);
  auto frames = std::make_unique<BeastFrames>(*queue_);
  auto accept = frames->accept(key, max_message_bytes);
  return {std::move(accept), std::move(frames)};
}

}  // namespace lrt::transport
