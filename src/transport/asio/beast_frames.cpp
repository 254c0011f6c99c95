#include "src/transport/asio/beast_frames.hpp"

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/execution.hpp>
#include <boost/asio/io_context.hpp>
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

/// Capacity that a client's messages may leave behind.
constexpr std::size_t kept_capacity = 8 * 1024;

/// At most `limit` bytes, without a character cut in two.
std::string_view clipped(std::string_view text, std::size_t limit) {
  if (text.size() <= limit) return text;
  while (limit > 0 && (static_cast<unsigned char>(text[limit]) & 0xC0U) == 0x80) --limit;
  return text.substr(0, limit);
}

}  // namespace

/// A queue of its own, because to poll an io_context that has a timer (Beast's stream makes one, for timeouts that are off) is a system call,
/// and a message needs nothing of it.
class BeastWork {
 public:
  void post(UniqueFunction<void()> task) { tasks_.push_back(std::move(task)); }
  bool empty() const noexcept { return tasks_.empty(); }
  void run() {
    while (!tasks_.empty()) {
      auto tasks = std::exchange(tasks_, {});
      for (auto& task : tasks) task();
    }
  }

  asio::io_context context;  ///< never run: home of the services that Beast's stream asks for

 private:
  std::vector<UniqueFunction<void()>> tasks_;
};

std::shared_ptr<BeastWork> make_beast_work() { return std::make_shared<BeastWork>(); }

namespace {

/// Posts to a BeastWork.
class Executor {
 public:
  explicit Executor(BeastWork& work) noexcept : work_(&work) {}

  asio::execution_context& query(asio::execution::context_t) const noexcept { return work_->context; }
  static constexpr asio::execution::blocking_t query(asio::execution::blocking_t) noexcept { return asio::execution::blocking.never; }
  Executor require(asio::execution::blocking_t::never_t) const noexcept { return *this; }
  /// Nobody counts the work; Beast 1.74 keeps a reference to a temporary if it cannot ask for it.
  Executor require(asio::execution::outstanding_work_t::tracked_t) const noexcept { return *this; }
  template <class Task>
  void execute(Task&& task) const {
    work_->post(std::forward<Task>(task));
  }
  friend bool operator==(const Executor& a, const Executor& b) noexcept { return a.work_ == b.work_; }
  friend bool operator!=(const Executor& a, const Executor& b) noexcept { return a.work_ != b.work_; }

 private:
  BeastWork* work_;
};

/// A completion that waits for bytes to come or to leave.
class Waiting {
 public:
  virtual ~Waiting() = default;
  /// Frees itself before it completes: that may begin the next wait.
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

/// What Beast's stream stands on instead of a socket. Reads wait for input, writes until they have left; both complete when the owner says so.
class Wire {
 public:
  using executor_type = Executor;

  explicit Wire(BeastWork& work) : work_(work) {}

  executor_type get_executor() noexcept { return Executor(work_); }

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

  template <class Handler>
  friend void async_teardown(beast::role_type, Wire& wire, Handler&& handler) {
    wire.work_.post([completion = std::decay_t<Handler>(std::forward<Handler>(handler))]() mutable { completion(error_code()); });
  }
  friend void beast_close_socket(Wire&) {}  // for Beast's timeouts, which are off

  bool is_reading() const noexcept { return reader_ != nullptr; }
  /// Gives the read that waits what it takes of `bytes`, and removes that.
  void give(std::string_view& bytes) {
    const auto size = asio::buffer_copy(into_, asio::buffer(bytes.data(), bytes.size()));
    bytes.remove_prefix(size);
    auto* const reader = reader_.get();
    reader->complete(std::move(reader_), size);
  }

  bool is_writing() const noexcept { return writer_ != nullptr; }
  Output output() const noexcept { return writer_ ? Output{parts_[0], parts_[1]} : Output{}; }
  void sent(std::size_t bytes) {
    const auto first = std::min(bytes, parts_[0].size());
    parts_[0].remove_prefix(first);
    parts_[1].remove_prefix(std::min(bytes - first, parts_[1].size()));
    if (!parts_[0].empty() || !parts_[1].empty()) return;
    auto* const writer = writer_.get();
    writer->complete(std::move(writer_), bytes_);
  }

  /// Nothing will complete.
  void drop() {
    const auto reader = std::move(reader_);
    const auto writer = std::move(writer_);
  }

 private:
  template <class Handler>
  void complete_later(Handler&& handler) {
    work_.post([completion = std::decay_t<Handler>(std::forward<Handler>(handler))]() mutable { completion(error_code(), 0); });
  }

  BeastWork& work_;
  std::unique_ptr<Waiting> reader_;
  asio::mutable_buffer into_;
  std::unique_ptr<Waiting> writer_;
  std::array<std::string_view, 2> parts_;  ///< what has not left
  std::size_t bytes_ = 0;                  ///< of the write
};

/// Completions run inside the functions of Frames only: whoever destroys this is not one of them, and what waits then is dropped.
class BeastFrames final : public Frames {
 public:
  explicit BeastFrames(BeastWork& work) : work_(work), stream_(work) {}
  ~BeastFrames() override { wire().drop(); }

  /// The value of Sec-WebSocket-Accept; empty when Beast refuses.
  std::string accept(std::string_view key, std::size_t message_bytes);

  void receive(std::string_view bytes) override;
  std::optional<Message> next() override;
  bool wants_input() const noexcept override { return wire().is_reading() && !over_; }
  void send(std::shared_ptr<const std::string> message, bool text) override;
  void ping() override;
  void close(std::uint16_t code, std::string_view reason) override;
  Output output() const noexcept override { return wire().output(); }
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
  void work(std::string_view& bytes);
  void work_on_kept();
  void begin_close(std::uint16_t code, std::string_view reason);
  void finish(const error_code& error);

  BeastWork& work_;
  std::shared_ptr<const std::string> sending_;
  std::string kept_;  ///< of what was received: behind a message that nobody has asked for, or behind output
  std::size_t used_ = 0;
  beast::flat_buffer message_;  ///< of the client, as far as it has come
  bool reading_ = false;        ///< a message
  bool ready_ = false;          ///< message_ is whole
  std::size_t pings_ = 0;
  bool closing_ = false;        ///< by us
  std::optional<State> over_;
  websocket::stream<Wire, false> stream_;  // last: its completions know the rest
};

/// Has Beast answer the handshake, for its state and the Sec-WebSocket-Accept; the bytes that go out are the owner's.
std::string BeastFrames::accept(std::string_view key, std::size_t message_bytes) {
  namespace http_ = beast::http;
  std::string accept;
  stream_.set_option(websocket::stream_base::decorator(
      [&accept](websocket::response_type& response) { accept = std::string(response[http_::field::sec_websocket_accept]); }));
  stream_.set_option(websocket::stream_base::timeout{websocket::stream_base::none(), websocket::stream_base::none(), false});
  stream_.auto_fragment(false);
  stream_.read_message_max(std::max<std::size_t>(message_bytes, 1));  // 0 would be no limit

  http_::request<http_::empty_body> request(http_::verb::get, "/", 11);
  request.set(http_::field::host, "localhost");
  request.set(http_::field::connection, "upgrade");
  request.set(http_::field::upgrade, "websocket");
  request.set(http_::field::sec_websocket_version, "13");
  request.set(http_::field::sec_websocket_key, beast::string_view(key.data(), key.size()));
  error_code error;
  stream_.accept(request, error);
  stream_.set_option(websocket::stream_base::decorator([](websocket::response_type&) {}));
  if (error) return {};
  stream_.control_callback([this](websocket::frame_type type, beast::string_view) {
    if (type == websocket::frame_type::ping) ++pings_;
    // RFC 6455 7.4.2 has no such codes. Beast would say them back.
    if (type == websocket::frame_type::close && stream_.reason().code >= 5000 && state() == State::open) begin_close(1002, {});
  });
  read();
  work_.run();
  return accept;
}

// ---------------------------------------------------------------------------------------------------------------- reading

void BeastFrames::receive(std::string_view bytes) {
  assert(used_ == kept_.size());
  work(bytes);
  if (over_ || bytes.empty()) return;
  kept_ = bytes;
  used_ = 0;
}

std::optional<Frames::Message> BeastFrames::next() {
  if (!ready_ && !reading_ && state() == State::open) {
    read();
    work_on_kept();
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
  if (closing_) return;  // the rest is Beast's
  const auto data = message_.cdata();
  // Beast 1.74 does not ask this when the last frame of a message is empty.
  if (stream_.got_text() && utf8::ends_within_character({static_cast<const char*>(data.data()), data.size()})) return begin_close(1007, {});
  ready_ = true;
}

/// Does what can be done now; `bytes` are those that Beast gets to read, and what it does not take stays.
void BeastFrames::work(std::string_view& bytes) {
  work_.run();
  while (wire().is_reading() && !bytes.empty()) {
    wire().give(bytes);
    work_.run();
  }
}

void BeastFrames::work_on_kept() {
  auto bytes = std::string_view(kept_).substr(used_);
  work(bytes);
  used_ = kept_.size() - bytes.size();
  if (used_ < kept_.size() && !over_) return;
  used_ = 0;
  kept_.clear();
  if (kept_.capacity() > kept_capacity) kept_.shrink_to_fit();
}

// ---------------------------------------------------------------------------------------------------------------- writing

void BeastFrames::send(std::shared_ptr<const std::string> message, bool text) {
  assert(state() == State::open && !wire().is_writing());
  sending_ = std::move(message);
  stream_.binary(!text);
  stream_.async_write(sending_ ? asio::buffer(*sending_) : asio::const_buffer(), [this](const error_code& error, std::size_t) {
    sending_.reset();
    if (error) finish(error);
  });
  work_.run();
}

void BeastFrames::ping() {
  assert(state() == State::open && !wire().is_writing());
  stream_.async_ping({}, [this](const error_code& error) {
    if (error) finish(error);
  });
  work_.run();
}

void BeastFrames::sent(std::size_t bytes) {
  if (bytes == 0 || !wire().is_writing()) return;
  wire().sent(bytes);
  work_on_kept();
}

// ---------------------------------------------------------------------------------------------------------------- closing

void BeastFrames::close(std::uint16_t code, std::string_view reason) {
  if (state() != State::open) return;
  begin_close(code, reason);
  work_on_kept();
}

void BeastFrames::begin_close(std::uint16_t code, std::string_view reason) {
  closing_ = true;
  websocket::close_reason close_reason(code);
  const auto clip = clipped(reason, close_reason.reason.max_size());
  close_reason.reason.assign(clip.data(), clip.size());
  stream_.async_close(close_reason, [this](const error_code& error) { finish(error); });
}

/// The stream is over. The first who is told knows why; the others are told that it is over.
void BeastFrames::finish(const error_code& error) {
  if (over_) return;
  const bool closed_properly = !error || error.category() == error_code(websocket::error::closed).category();
  over_ = closed_properly ? State::closed : State::failed;
}

}  // namespace

Protocols::Handshake make_beast_frames(BeastWork& work, std::string_view key, std::size_t message_bytes) {
  auto frames = std::make_unique<BeastFrames>(work);
  auto accept = frames->accept(key, message_bytes);
  if (accept.empty()) return {};
  return {std::move(accept), std::move(frames)};
}

}  // namespace lrt::transport
