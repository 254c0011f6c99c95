// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "src/base/blocked_signals.hpp"
#include "src/base/read_file.hpp"
#include "src/base/third_party_call.hpp"
#include "src/base/thread.hpp"
#include "src/mqtt/link.hpp"
#include "src/mqtt/topics.hpp"
#include "src/security/certificate.hpp"

namespace lrt::mqtt {
inline namespace v0 {

namespace {

/// Bytes that the socket takes before TCP can send them. What is beyond waits in the server, where newer values replace it. The bridge's window is narrower
/// most of the time (window.hpp); this holds when a fast link has become a slow one.
constexpr int unsent_bytes = 16 * 1024;

std::string text_of(int code) {
  if (code == MOSQ_ERR_ERRNO) return std::string(std::strerror(errno));
  return ::mosquitto_strerror(code);
}

bool is_numeric(const std::string& host) {
  in6_addr six{};
  in_addr four{};
  return ::inet_pton(AF_INET, host.c_str(), &four) == 1 || ::inet_pton(AF_INET6, host.c_str(), &six) == 1;
}

/// libmosquitto is initialised once for the process and never cleaned up, because threads may use it until the process has ended.
bool prepare() {
  static const bool prepared = ::mosquitto_lib_init() == MOSQ_ERR_SUCCESS;
  [[maybe_unused]] static const bool closed = ThirdPartyCall::close_at_exit();
  return prepared;
}

/// A list of properties.
class Properties {
 public:
  Properties() = default;
  ~Properties() { ::mosquitto_property_free_all(&list_); }
  Properties(const Properties&) = delete;
  Properties& operator=(const Properties&) = delete;

  void add(int name, const std::string& text) { check(::mosquitto_property_add_string(&list_, name, text.c_str())); }
  void add(int name, std::uint8_t number) { check(::mosquitto_property_add_byte(&list_, name, number)); }
  void add(int name, std::uint16_t number) { check(::mosquitto_property_add_int16(&list_, name, number)); }
  void add(int name, std::uint32_t number) { check(::mosquitto_property_add_int32(&list_, name, number)); }
  void add_bytes(int name, const std::string& bytes) {
    check(::mosquitto_property_add_binary(&list_, name, bytes.data(), static_cast<std::uint16_t>(bytes.size())));
  }
  void add_pair(const std::string& name, const std::string& value) {
    check(::mosquitto_property_add_string_pair(&list_, MQTT_PROP_USER_PROPERTY, name.c_str(), value.c_str()));
  }
  const mosquitto_property* get() const noexcept { return list_; }
  bool complete() const noexcept { return complete_; }

 private:
  void check(int code) noexcept { complete_ = complete_ && code == MOSQ_ERR_SUCCESS; }
  mosquitto_property* list_ = nullptr;
  bool complete_ = true;
};

bool fill(Properties& properties, const OutMessage& message) {
  if (message.alias != 0) properties.add(MQTT_PROP_TOPIC_ALIAS, message.alias);
  if (message.is_utf8 && message.payload) properties.add(MQTT_PROP_PAYLOAD_FORMAT_INDICATOR, std::uint8_t{1});
  if (!message.content_type.empty()) properties.add(MQTT_PROP_CONTENT_TYPE, message.content_type);
  if (message.expiry.count() > 0)
    properties.add(MQTT_PROP_MESSAGE_EXPIRY_INTERVAL, static_cast<std::uint32_t>(std::min<std::int64_t>(message.expiry.count(), UINT32_MAX)));
  if (!message.correlation.empty()) properties.add_bytes(MQTT_PROP_CORRELATION_DATA, message.correlation);
  for (const auto& pair : message.user) properties.add_pair(pair.first, pair.second);
  return properties.complete();
}

/// A key with a passphrase. OpenSSL would ask for it on the terminal.
bool is_encrypted(const std::string& key_file) {
  constexpr std::size_t max_bytes = 64 * 1024;
  std::ifstream file(key_file);
  std::string text(max_bytes, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text.find("BEGIN ENCRYPTED PRIVATE KEY") != std::string::npos || text.find("Proc-Type: 4,ENCRYPTED") != std::string::npos;
}

/// The password, or the first line of its file.
Result<std::string> password_of(const Broker& broker) {
  constexpr std::size_t max_bytes = 65'535;
  if (broker.password_file.empty()) return broker.password;
  Result<std::string> text = read_file(broker.password_file, max_bytes);
  if (!text) return unexpected(text.error().code, "broker.password_file: " + text.error().message);
  text->resize(std::min(text->size(), text->find_first_of("\r\n")));
  if (text->empty() || !is_text(*text))
    return unexpected(Errc::invalid_option, "broker.password_file: expected a password in the first line of " + broker.password_file);
  return *std::move(text);
}

class MosquittoLink;

/// A libmosquitto client, for one connection: it would keep half-received messages and the limits of the broker for the next one. A thread that
/// resolves a name may outlive the link.
struct Handle {
  Handle() = default;
  ~Handle() {
    const ThirdPartyCall call;
    const BlockedSignals blocked;
    if (call && client) ::mosquitto_destroy(client);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  MosquittoLink* link = nullptr;  ///< valid within step()
  mosquitto* client = nullptr;
  std::string host;
  int port = 0;
  int keep_alive = 0;
  std::atomic<bool> is_connecting{false};  ///< a thread has it
  int connect_code = MOSQ_ERR_SUCCESS;     ///< of that thread
  std::string connect_error;
  std::string tls_error;  ///< the first one that libmosquitto has logged, by OpenSSL

  std::string reason_of(int code) const {
    return code == MOSQ_ERR_TLS && !tls_error.empty() ? text_of(code) + " (" + tls_error + ")" : text_of(code);
  }
  /// Begins to connect. Resolves names, which can take long, and does not wait for the network.
  void begin() {
    const ThirdPartyCall call;
    connect_code = call ? ::mosquitto_connect_async(client, host.c_str(), port, keep_alive) : MOSQ_ERR_UNKNOWN;
    if (connect_code != MOSQ_ERR_SUCCESS) connect_error = reason_of(connect_code);
  }
};

class MosquittoLink final : public Link {
 public:
  explicit MosquittoLink(LinkOptions options) : options_(std::move(options)), will_(options_.will), is_numeric_(is_numeric(options_.broker.host)) {}
  ~MosquittoLink() override {
    if (handle_ && handle_->is_connecting) resolver_.detach();
  }

  Result<std::shared_ptr<Handle>> make_client() {
    const ThirdPartyCall call;
    if (!call || !prepare()) return unexpected(Errc::io_error, "libmosquitto cannot be initialised, or the process is ending");
    const Broker& broker = options_.broker;
    auto handle = std::make_shared<Handle>();
    mosquitto* const client = ::mosquitto_new(broker.client_id.empty() ? nullptr : broker.client_id.c_str(), true, handle.get());
    if (!client) return unexpected(Errc::io_error, "libmosquitto cannot create a client: " + text_of(MOSQ_ERR_ERRNO));
    handle->link = this;
    handle->client = client;
    handle->host = broker.host;
    handle->port = broker.port != 0 ? broker.port : broker.tls ? 8883 : 1883;
    handle->keep_alive = static_cast<int>(broker.keep_alive.count());
    const auto must = [](int code, const char* what) {
      return code == MOSQ_ERR_SUCCESS ? Result<void>() : unexpected(Errc::invalid_option, std::string(what) + ": " + text_of(code));
    };
    if (auto set = must(::mosquitto_int_option(client, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5), "MQTT 5"); !set)
      return Unexpected{std::move(set).error()};
    if (auto set = must(::mosquitto_int_option(client, MOSQ_OPT_SEND_MAXIMUM, 65'535), "send maximum"); !set)
      return Unexpected{std::move(set).error()};  // the bridge has its own
    // Else a message waits until the broker has acknowledged the bytes before it, up to 40 ms.
    if (auto set = must(::mosquitto_int_option(client, MOSQ_OPT_TCP_NODELAY, 1), "TCP_NODELAY"); !set) return Unexpected{std::move(set).error()};
    if (!broker.user.empty()) {
      const Result<std::string> password = password_of(broker);
      if (!password) return Unexpected{password.error()};
      if (auto set = must(::mosquitto_username_pw_set(client, broker.user.c_str(), password->c_str()), "broker.user"); !set)
        return Unexpected{std::move(set).error()};
    }
    if (broker.tls) {
      const Tls& tls = *broker.tls;
      if (!tls.key_file.empty() && is_encrypted(tls.key_file))
        return unexpected(Errc::invalid_option, "broker.tls: expected a key_file without a passphrase");
      const auto name = [](const std::string& file) { return file.empty() ? nullptr : file.c_str(); };
      if (tls.ca_file.empty()) {
        if (auto set = must(::mosquitto_int_option(client, MOSQ_OPT_TLS_USE_OS_CERTS, 1), "broker.tls"); !set)
          return Unexpected{std::move(set).error()};
      }
      if (!tls.ca_file.empty() || !tls.certificate_file.empty()) {
        // Without a file of authorities libmosquitto wants a directory of them.
        const char* const directory = tls.ca_file.empty() ? "/etc/ssl/certs" : nullptr;
        if (auto set = must(::mosquitto_tls_set(client, name(tls.ca_file), directory, name(tls.certificate_file), name(tls.key_file),
                                                [](char*, int, int, void*) { return 0; }),
                            "broker.tls");
            !set)
          return Unexpected{std::move(set).error()};
      }
      if (auto set = must(::mosquitto_tls_opts_set(client, 1, nullptr, nullptr), "broker.tls"); !set) return Unexpected{std::move(set).error()};
    }
    Properties will;
    if (!fill(will, will_)) return unexpected(Errc::invalid_option, "the Last Will cannot be made");
    const std::string& text = *will_.payload;
    if (auto set = must(::mosquitto_will_set_v5(client, will_.topic.c_str(), static_cast<int>(text.size()), text.data(), will_.qos, will_.retain,
                                                const_cast<mosquitto_property*>(will.get())),
                        "Last Will");
        !set)
      return Unexpected{std::move(set).error()};
    release(will);
    ::mosquitto_connect_v5_callback_set(client, [](mosquitto*, void* self, int code, int, const mosquitto_property* list) {
      Agreement agreement;
      (void)::mosquitto_property_read_int16(list, MQTT_PROP_TOPIC_ALIAS_MAXIMUM, &agreement.max_aliases, false);
      (void)::mosquitto_property_read_int16(list, MQTT_PROP_RECEIVE_MAXIMUM, &agreement.receive_maximum, false);
      of(self).on_connect(code, agreement);
    });
    ::mosquitto_disconnect_v5_callback_set(client, [](mosquitto*, void* self, int code, const mosquitto_property*) {
      of(self).ended_ = code;
      of(self).has_ended_ = true;
    });
    ::mosquitto_publish_v5_callback_set(
        client, [](mosquitto*, void* self, int message, int code, const mosquitto_property*) { of(self).on_publish(message, code); });
    ::mosquitto_message_v5_callback_set(client, [](mosquitto*, void* self, const mosquitto_message* message, const mosquitto_property* list) {
      of(self).on_message(*message, list);
    });
    ::mosquitto_subscribe_v5_callback_set(client, [](mosquitto*, void* self, int id, int count, const int* granted, const mosquitto_property*) {
      for (int i = 0; i < count; ++i)
        if (granted[i] >= 128) of(self).on_subscription_refused(id, granted[i]);
    });
    ::mosquitto_unsubscribe_v5_callback_set(client, [](mosquitto*, void* self, int id, const mosquitto_property*) { of(self).on_confirmed(id); });
    ::mosquitto_log_callback_set(client, [](mosquitto*, void* self, int level, const char* line) {
      constexpr std::string_view start = "OpenSSL Error";
      Handle& owner = *static_cast<Handle*>(self);
      if (level != MOSQ_LOG_ERR || !owner.tls_error.empty() || std::string_view(line).substr(0, start.size()) != start) return;
      try {
        owner.tls_error = line;
      } catch (...) {}  // no memory: without it
    });
    return handle;
  }

  void set_will(OutMessage will) override { will_ = std::move(will); }

  void connect() override {
    connecting_since_ = std::chrono::steady_clock::now();
    has_ended_ = false;
    ended_ = 0;
    is_connected_ = is_writable_ = false;
    is_begun_ = true;
    refusal_.clear();
    filters_.clear();
    Result<std::shared_ptr<Handle>> made = make_client();
    if (!made) {
      handle_ = std::make_shared<Handle>();
      handle_->connect_code = MOSQ_ERR_UNKNOWN;
      handle_->connect_error = made.error().message;
      return;
    }
    handle_ = *std::move(made);
    if (is_numeric_) {
      const BlockedSignals blocked;
      handle_->begin();
      return;
    }
    handle_->is_connecting = true;
    Result<Thread> started = start_thread("lrt-mqtt-name", options_.thread, [handle = handle_, waker = options_.waker] {
      handle->begin();
      handle->is_connecting = false;
      waker->wake();
    });
    if (started) {
      resolver_ = *std::move(started);
    } else {
      handle_->is_connecting = false;
      handle_->connect_code = MOSQ_ERR_UNKNOWN;
      handle_->connect_error = started.error().message;
    }
  }

  void disconnect(bool with_will) noexcept override {
    if (!handle_ || handle_->is_connecting) {
      is_begun_ = false;
      return;
    }
    const bool is_open = descriptor() >= 0;
    is_begun_ = is_connected_ = false;
    const ThirdPartyCall call;
    if (!call || !is_open) return handle_.reset();
    const BlockedSignals blocked;
    ::mosquitto_disconnect_v5(handle_->client, with_will ? MQTT_RC_DISCONNECT_WITH_WILL_MSG : MQTT_RC_NORMAL_DISCONNECTION, nullptr);
    for (int i = 0; i < 20 && ::mosquitto_socket(handle_->client) >= 0 && ::mosquitto_want_write(handle_->client); ++i)
      (void)::mosquitto_loop_write(handle_->client, 1);
    handle_.reset();
  }

  // It uses nothing that a turn changes. libmosquitto reads most of the files when it connects, which would be too late.
  Result<void> check() override {
    const Broker& broker = options_.broker;
    if (!broker.user.empty())
      if (const Result<std::string> password = password_of(broker); !password) return Unexpected{password.error()};
    if (!broker.tls) return {};
    if (!broker.tls->ca_file.empty())
      if (const auto authority = security::read_certificate(broker.tls->ca_file); !authority) return Unexpected{authority.error()};
    return broker.tls->certificate_file.empty() ? Result<void>() : security::check_key(broker.tls->certificate_file, broker.tls->key_file);
  }

  Result<void> subscribe(const std::string& filter, int qos, bool retained) override {
    const ThirdPartyCall call;
    if (!call) return unexpected(Errc::closed, "the process is exiting");
    if (!is_connected_ || descriptor() < 0) return unexpected(Errc::closed, "there is no connection");
    const BlockedSignals blocked;
    int id = 0;
    const int kept = retained ? MQTT_SUB_OPT_SEND_RETAIN_ALWAYS : MQTT_SUB_OPT_SEND_RETAIN_NEVER;
    const int code = ::mosquitto_subscribe_v5(handle_->client, &id, filter.c_str(), qos, MQTT_SUB_OPT_NO_LOCAL | kept, nullptr);
    if (code != MOSQ_ERR_SUCCESS) return unexpected(Errc::io_error, text_of(code));
    filters_[id] = filter;
    return {};
  }

  Result<int> publish(const OutMessage& message) override {
    const ThirdPartyCall call;
    if (!call) return unexpected(Errc::closed, "the process is exiting");
    if (!is_connected_ || descriptor() < 0) return unexpected(Errc::closed, "there is no connection");
    Properties properties;
    if (!fill(properties, message)) return unexpected(Errc::refused, "the properties of the message are not valid");
    const std::string_view payload = message.payload ? std::string_view(*message.payload) : std::string_view();
    if (payload.size() > MQTT_MAX_PAYLOAD) return unexpected(Errc::limit_exceeded, "the payload is longer than MQTT allows");
    const BlockedSignals blocked;
    int id = 0, qos = message.qos;
    bool retain = message.retain;
    while (true) {
      const int code = ::mosquitto_publish_v5(handle_->client, &id, message.topic.empty() ? nullptr : message.topic.c_str(),
                                              static_cast<int>(payload.size()), payload.data(), qos, retain, properties.get());
      if (code == MOSQ_ERR_SUCCESS) return qos == 0 ? 0 : id;
      if (code == MOSQ_ERR_QOS_NOT_SUPPORTED && qos > 0) --qos;  // the broker has less
      else if (code == MOSQ_ERR_RETAIN_NOT_SUPPORTED && retain) retain = false;
      else if (code == MOSQ_ERR_NO_CONN || code == MOSQ_ERR_CONN_LOST || code == MOSQ_ERR_ERRNO) return unexpected(Errc::closed, text_of(code));
      else return unexpected(code == MOSQ_ERR_OVERSIZE_PACKET || code == MOSQ_ERR_PAYLOAD_SIZE ? Errc::limit_exceeded : Errc::refused, text_of(code));
    }
  }

  /// An UNSUBSCRIBE of a filter without a subscription has no effect, and each broker answers it (MQTT 5 3.10.4). libmosquitto has no PINGREQ for callers.
  Result<int> probe() override {
    const ThirdPartyCall call;
    if (!call) return unexpected(Errc::closed, "the process is exiting");
    if (!is_connected_ || descriptor() < 0) return unexpected(Errc::closed, "there is no connection");
    const BlockedSignals blocked;
    int id = 0;
    const int code = ::mosquitto_unsubscribe_v5(handle_->client, &id, options_.probed_filter.c_str(), nullptr);
    if (code == MOSQ_ERR_SUCCESS) return id;
    return unexpected(code == MOSQ_ERR_NO_CONN || code == MOSQ_ERR_CONN_LOST || code == MOSQ_ERR_ERRNO ? Errc::closed : Errc::refused, text_of(code));
  }

  bool is_congested() const noexcept override { return !is_connected_ || ::mosquitto_want_write(handle_->client); }

  void step(Events& events) override {
    if (!is_begun_ || handle_->is_connecting) return;
    if (resolver_.joinable()) resolver_.join();
    if (handle_->connect_code != MOSQ_ERR_SUCCESS) return end(events, handle_->connect_error);
    const ThirdPartyCall call;
    if (!call) return;
    events_ = &events;
    const int code = turn();
    events_ = nullptr;
    if (has_ended_ || code != MOSQ_ERR_SUCCESS || descriptor() < 0) {
      const int why = code != MOSQ_ERR_SUCCESS ? code : ended_ > 0 && ended_ < 128 ? ended_ : MOSQ_ERR_CONN_LOST;
      std::string reason = !refusal_.empty() ? std::exchange(refusal_, {}) : handle_->reason_of(why);
      if (ended_ >= 128) reason = std::string("the broker has ended the connection: ") + ::mosquitto_reason_string(ended_);
      if (ended_ == MQTT_RC_SESSION_TAKEN_OVER) events.taken_over();
      return end(events, reason);
    }
    if (!is_connected_ && std::chrono::steady_clock::now() - connecting_since_ > options_.broker.connect_time)
      return end(events, "the broker has not accepted the connection in " + std::to_string(options_.broker.connect_time.count()) + " ms");
  }

  int descriptor() const noexcept override {
    return !is_begun_ || !handle_ || handle_->is_connecting || !handle_->client ? -1 : ::mosquitto_socket(handle_->client);
  }
  /// Before the TCP connection is there, libmosquitto does not say that a TLS handshake has to be begun.
  bool wants_write() const noexcept override { return descriptor() >= 0 && (::mosquitto_want_write(handle_->client) || !is_writable_); }
  std::chrono::milliseconds step_interval() const noexcept override { return std::chrono::milliseconds(is_begun_ ? 1'000 : 3'600'000); }

 private:
  static MosquittoLink& of(void* handle) noexcept { return *static_cast<Handle*>(handle)->link; }
  /// libmosquitto owns the list now.
  static void release(Properties& properties) noexcept { new (&properties) Properties(); }

  /// One turn of reading and writing.
  int turn() {
    const BlockedSignals blocked;  // a closed connection would end the process by SIGPIPE
    mosquitto* const client = handle_->client;
    pollfd item{::mosquitto_socket(client), POLLIN, 0};
    if (item.fd < 0) return MOSQ_ERR_CONN_LOST;
    if (::mosquitto_want_write(client) || !is_writable_) item.events |= POLLOUT;
    if (::poll(&item, 1, 0) > 0) {
      is_writable_ = is_writable_ || (item.revents & POLLOUT) != 0;
      if ((item.revents & POLLOUT) != 0)
        if (const int code = ::mosquitto_loop_write(client, 1); code != MOSQ_ERR_SUCCESS) return code;
      if (::mosquitto_socket(client) >= 0 && (item.revents & (POLLIN | POLLHUP | POLLERR)) != 0)
        if (const int code = ::mosquitto_loop_read(client, 1); code != MOSQ_ERR_SUCCESS) return code;
    }
    return ::mosquitto_socket(client) >= 0 ? ::mosquitto_loop_misc(client) : MOSQ_ERR_CONN_LOST;
  }

  /// Closes the socket, if it is still open.
  void end(Events& events, const std::string& reason) {
    is_begun_ = is_connected_ = has_ended_ = false;
    const std::shared_ptr<Handle> ended = std::exchange(handle_, nullptr);  // `reason` may be its text
    events.disconnected(reason);
  }

  // Called by libmosquitto within turn(). No exception may pass through it.
  template <class F>
  void guarded_call(F f) noexcept {
    try {
      if (events_) f();
    } catch (...) {  // no memory: the message is dropped
    }
  }
  void on_connect(int code, const Agreement& agreement) noexcept {
    guarded_call([&] {
      if (code != 0) {
        refusal_ = std::string("the broker refused the connection: ") + ::mosquitto_reason_string(code);
        has_ended_ = true;
        return;
      }
      is_connected_ = true;
      ::setsockopt(::mosquitto_socket(handle_->client), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes, sizeof unsent_bytes);
      events_->connected(agreement);
    });
  }
  void on_publish(int id, int code) noexcept {
    guarded_call([&] { events_->acknowledged(id, code >= 128, code >= 128 ? ::mosquitto_reason_string(code) : ""); });
  }
  void on_confirmed(int id) noexcept {
    guarded_call([&] { events_->confirmed(id); });
  }
  void on_subscription_refused(int id, int code) noexcept {
    guarded_call([&] {
      const auto found = filters_.find(id);
      if (found != filters_.end()) events_->subscription_refused(found->second, ::mosquitto_reason_string(code));
    });
  }
  void on_message(const mosquitto_message& message, const mosquitto_property* list) noexcept {
    guarded_call([&] {
      const Commands& bounds = options_.commands;
      InMessage made;
      made.topic = message.topic ? message.topic : "";
      made.retained = message.retain;
      const auto size = static_cast<std::size_t>(std::max(message.payloadlen, 0));
      made.has_payload_limit = size > bounds.max_payload_bytes;
      if (!made.has_payload_limit && message.payload) made.payload.assign(static_cast<const char*>(message.payload), size);
      read(list, made, bounds);
      events_->received(std::move(made));
    });
  }
  static void read(const mosquitto_property* list, InMessage& made, const Commands& bounds) {
    for (; list; list = ::mosquitto_property_next(list)) {
      char* name = nullptr;
      char* value = nullptr;
      switch (::mosquitto_property_identifier(list)) {
        case MQTT_PROP_CONTENT_TYPE:
          if (::mosquitto_property_read_string(list, MQTT_PROP_CONTENT_TYPE, &value, false))
            made.content_type = bounded(value, bounds.max_property_bytes, made);
          break;
        case MQTT_PROP_RESPONSE_TOPIC:
          if (::mosquitto_property_read_string(list, MQTT_PROP_RESPONSE_TOPIC, &value, false))
            made.response_topic = bounded(value, bounds.max_topic_bytes + 1, made);
          break;
        case MQTT_PROP_CORRELATION_DATA: {
          void* bytes = nullptr;
          std::uint16_t size = 0;
          if (::mosquitto_property_read_binary(list, MQTT_PROP_CORRELATION_DATA, &bytes, &size, false))
            made.correlation.assign(static_cast<const char*>(bytes), std::min<std::size_t>(size, bounds.max_correlation_bytes + 1));
          std::free(bytes);
          break;
        }
        case MQTT_PROP_MESSAGE_EXPIRY_INTERVAL: {
          std::uint32_t seconds = 0;
          if (::mosquitto_property_read_int32(list, MQTT_PROP_MESSAGE_EXPIRY_INTERVAL, &seconds, false)) made.expiry = std::chrono::seconds(seconds);
          break;
        }
        case MQTT_PROP_USER_PROPERTY:
          if (made.user.size() >= bounds.max_user_properties) made.has_property_limit = true;
          else if (::mosquitto_property_read_string_pair(list, MQTT_PROP_USER_PROPERTY, &name, &value, false))
            made.user.emplace_back(bounded(name, bounds.max_property_bytes, made), bounded(value, bounds.max_property_bytes, made));
          break;
        default: break;
      }
      std::free(name);
      std::free(value);
    }
  }
  static std::string bounded(const char* text, std::size_t max, InMessage& made) {
    const std::string_view all = text ? std::string_view(text) : std::string_view();
    if (all.size() > max) made.has_property_limit = true;
    return std::string(all.substr(0, max));
  }

  const LinkOptions options_;
  OutMessage will_;
  const bool is_numeric_;
  std::shared_ptr<Handle> handle_;  ///< of the present connection, or nullptr
  Thread resolver_;
  Events* events_ = nullptr;  ///< within step()
  bool is_begun_ = false, is_connected_ = false, has_ended_ = false;
  bool is_writable_ = false;  ///< TCP is connected
  int ended_ = 0;
  std::unordered_map<int, std::string> filters_;  ///< of the subscriptions, by the ids of their packets
  std::string refusal_;
  std::chrono::steady_clock::time_point connecting_since_{};
};

}  // namespace

Result<std::unique_ptr<Link>> make_mosquitto_link(LinkOptions options) {
  auto link = std::make_unique<MosquittoLink>(std::move(options));
  if (Result<std::shared_ptr<Handle>> made = link->make_client(); !made) return Unexpected{std::move(made).error()};
  return std::unique_ptr<Link>(std::move(link));
}

}  // namespace v0
}  // namespace lrt::mqtt
