// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/callback_receiver.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <lrt/transport/http.hpp>

#include "src/base/ascii.hpp"
#include "src/base/random.hpp"
#include "src/base/thread.hpp"
#include "src/exchange/tls.hpp"
#include "src/http/form.hpp"
#include "src/http/stamp.hpp"
#include "src/http/url.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

constexpr std::size_t name_bytes = 32;  // of hex
constexpr std::size_t max_challenge_bytes = 1024;

bool has_form_of_name(std::string_view text) noexcept {
  return text.size() == name_bytes &&
         std::all_of(text.begin(), text.end(), [](char c) { return lrt::detail::is_digit(c) || (c >= 'a' && c <= 'f'); });
}

/// Compares in a time that depends on the lengths only.
bool are_equal(std::string_view a, std::string_view b) noexcept {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
  return difference == 0;
}

http::Response text_response(int status, std::string text) {
  http::Response response;
  response.status = status;
  response.fields.add("Content-Type", "text/plain;charset=utf-8");
  response.fields.add("X-Content-Type-Options", "nosniff");
  response.fields.add("Cache-Control", "no-store");
  response.set_body(std::move(text));
  return response;
}

using Counts = CallbackReceiver::Counts;
using Notification = CallbackReceiver::Notification;

/// The state of a receiver. Its thread shares ownership: a notification may end the last watch, and thus the receiver, on that thread.
class State final : public engine::Handler, public std::enable_shared_from_this<State> {
 public:
  explicit State(CallbackReceiverOptions options) : options_(std::move(options)) {}

  Result<void> start() {
    std::string url = options_.public_url;
    if (options_.listens) {
      transport::TransportOptions own;
      own.address = options_.address;
      own.port = options_.port;
      own.tls = options_.tls;
      own.log = options_.log;
      own.limits.max_body_bytes = options_.max_body_bytes;
      transport_ = transport::make_http(std::move(own));
      if (Result<void> listening = transport_->start(*this); !listening) return listening;
      port_ = transport_->port();
      const bool is_v6 = options_.address.find(':') != std::string::npos;
      if (url.empty())
        url = (options_.tls ? "https://" : "http://") + (is_v6 ? "[" + options_.address + "]" : options_.address) + ":" + std::to_string(port_) + "/";
    }
    if (url.empty() || url.back() != '/') url += '/';
    const Result<http::Url> parsed = http::parse_url(url);
    if (!parsed || parsed->target.find('?') != std::string::npos)
      return unexpected(Errc::invalid_option,
                        "public_url of a callback receiver: expected an http or https URL without query, found \"" + options_.public_url + "\"");
    url_ = url;
    path_ = parsed->target;
    if (!transport_) return {};
    Result<Thread> thread = start_thread("lrt-client", options_.threads, [self = shared_from_this()] { self->run(); });
    if (!thread) return unexpected(std::move(thread).error());
    thread_ = *std::move(thread);
    return {};
  }

  const std::string& url() const noexcept { return url_; }
  std::uint16_t port() const noexcept { return port_; }
  Counts counts() const noexcept { return {notifications_.load(), unsigned_.load(), unknown_.load()}; }

  http::Response respond(const http::Request& request) {
    const std::string_view target = request.target.substr(0, std::min(request.target.find('?'), request.target.size()));
    std::string_view query = request.target.substr(target.size());
    if (!query.empty()) query.remove_prefix(1);
    const bool is_below = target.size() >= path_.size() && target.substr(0, path_.size()) == path_;
    const std::string_view name = is_below ? target.substr(path_.size()) : std::string_view();
    if (!has_form_of_name(name)) {
      ++unknown_;
      return text_response(404, "no callback\n");
    }
    std::shared_ptr<const Callback> callback;
    {
      const std::lock_guard lock(mutex_);
      if (const auto found = callbacks_.find(std::string(name)); found != callbacks_.end()) callback = found->second;
    }
    if (!callback) {
      ++unknown_;
      return text_response(410, "this callback has ended\n");
    }
    if (request.method == "GET" || request.method == "HEAD") return confirm(request.target);
    if (request.method != "POST") {
      http::Response response = text_response(405, "expected POST\n");
      response.fields.add("Allow", "GET, HEAD, POST");
      return response;
    }
    if (request.body.size() > options_.max_body_bytes) return text_response(413, "the notification is too long\n");
    if (!callback->secret.empty()) {
      const std::string expected = exchange::sign(callback->secret, request.body);
      const std::string found = request.count("X-Hub-Signature") == 1 ? lrt::detail::lower(*request.find("X-Hub-Signature")) : std::string();
      if (!are_equal(expected, found)) {
        ++unsigned_;
        return text_response(403, found.empty() ? "X-Hub-Signature is missing\n" : "X-Hub-Signature is not that of the body\n");
      }
    }
    ++notifications_;
    const auto field = [&](std::string_view wanted) { return request.find(wanted).value_or(std::string_view()); };
    callback->take({request.body, field("Content-Type"), field("ETag"), field(http::time_field), field(http::sequence_field),
                    field(http::left_out_field), field(http::series_field)});
    http::Response response;
    response.status = 204;
    return response;
  }

  void stop() noexcept {
    stopping_ = true;
    if (transport_) transport_->waker()->wake();
    Thread thread;
    {
      const std::lock_guard lock(mutex_);
      std::swap(thread, thread_);
      callbacks_.clear();
    }
    if (thread.is_current()) thread.detach();
  }

  Result<std::string> add(std::string secret, std::function<void(const Notification&)> take) {
    const std::lock_guard lock(mutex_);
    if (stopping_) return unexpected(Errc::closed, "the callback receiver is stopped");
    if (callbacks_.size() >= options_.max_callbacks)
      return unexpected(Errc::limit_exceeded, "the callback receiver has " + std::to_string(options_.max_callbacks) + " callbacks");
    const std::string name = random_hex(name_bytes / 2);
    callbacks_.emplace(name, std::make_shared<const Callback>(Callback{std::move(secret), std::move(take)}));
    return url_ + name;
  }
  void remove(const std::string& callback_url) noexcept {
    std::shared_ptr<const Callback> removed;  // destroyed without the lock
    const std::lock_guard lock(mutex_);
    if (callback_url.size() < name_bytes) return;
    const auto found = callbacks_.find(callback_url.substr(callback_url.size() - name_bytes));
    if (found == callbacks_.end()) return;
    removed = std::move(found->second);
    callbacks_.erase(found);
  }

 private:
  struct Callback {
    std::string secret;
    std::function<void(const Notification&)> take;
  };

  static http::Response confirm(std::string_view target) {
    const auto mode = http::query_parameter(target, "hub.mode", http::Plus::space);
    const auto challenge = http::query_parameter(target, "hub.challenge", http::Plus::space);
    if (mode != "subscribe" || !challenge || challenge->empty() || challenge->size() > max_challenge_bytes)
      return text_response(404, "expected hub.mode=subscribe and hub.challenge\n");
    return text_response(200, *challenge);
  }

  engine::Outcome handle(const http::Request& request, TimePoint) override {
    try {
      return respond(request);
    } catch (...) { return text_response(500, "out of memory\n"); }
  }
  std::optional<engine::Reply> next_reply(TimePoint) override { return std::nullopt; }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return std::nullopt; }
  void abandon(engine::Ticket) noexcept override {}

  void run() {
    while (!stopping_) {
      try {
        transport_->poll(std::chrono::milliseconds(10), std::chrono::hours(1));
      } catch (...) {}  // out of memory
    }
    transport_->stop();
  }

  const CallbackReceiverOptions options_;
  std::string url_, path_;
  std::uint16_t port_ = 0;
  std::unique_ptr<transport::Transport> transport_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> notifications_{0}, unsigned_{0}, unknown_{0};
  std::mutex mutex_;
  std::unordered_map<std::string, std::shared_ptr<const Callback>> callbacks_;
  Thread thread_;
};

class Receiver final : public CallbackReceiver {
 public:
  explicit Receiver(std::shared_ptr<State> state) : state_(std::move(state)) {}
  ~Receiver() override { state_->stop(); }

  std::string url() const override { return state_->url(); }
  std::uint16_t port() const noexcept override { return state_->port(); }
  Counts counts() const noexcept override { return state_->counts(); }
  http::Response handle(const http::Request& request) override { return state_->respond(request); }
  void stop() noexcept override { state_->stop(); }
  Result<std::string> add(std::string secret, std::function<void(const Notification&)> take) override {
    return state_->add(std::move(secret), std::move(take));
  }
  void remove(const std::string& callback_url) noexcept override { state_->remove(callback_url); }

 private:
  const std::shared_ptr<State> state_;
};

}  // namespace

Result<std::shared_ptr<CallbackReceiver>> CallbackReceiver::create(CallbackReceiverOptions options) {
  auto state = std::make_shared<State>(std::move(options));
  if (Result<void> started = state->start(); !started) return unexpected(std::move(started).error());
  return std::shared_ptr<CallbackReceiver>(std::make_shared<Receiver>(std::move(state)));
}

}  // namespace v0
}  // namespace lrt::client
