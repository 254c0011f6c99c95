// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <netinet/in.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/folder.hpp"

extern char** environ;  // NOLINT: POSIX

namespace lrt::test {

/// False, with a printed reason, where there is no Mosquitto.
inline bool has_mosquitto() {
  if (std::string_view(LRT_MOSQUITTO).empty()) std::cout << "skipped: there is no mosquitto (vendor/install.sh tests)\n";
  return !std::string_view(LRT_MOSQUITTO).empty();
}

/// A loopback port that was free just now.
inline std::uint16_t free_port() {
  const int s = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(s, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::getsockname(s, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw std::runtime_error("no free port");
  ::close(s);
  return ntohs(address.sin_port);
}

/// A Mosquitto with a configuration of its own on a loopback port.
class Mosquitto {
 public:
  /// @param further  lines of the configuration, behind that of the listener
  explicit Mosquitto(std::string further = "allow_anonymous true\n") : further_(std::move(further)) {
    for (int attempt = 0; attempt < 20; ++attempt) {
      port_ = free_port();
      if (start()) return;
    }
    throw std::runtime_error("mosquitto does not start");
  }
  ~Mosquitto() { end(SIGKILL); }
  Mosquitto(const Mosquitto&) = delete;
  Mosquitto& operator=(const Mosquitto&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  const Folder& folder() const noexcept { return folder_; }
  /// False: it has ended at once, as when another process has taken the port.
  bool start() {
    const std::string file = folder_ / "mosquitto.conf";
    std::ofstream(file) << "listener " << port_ << " 127.0.0.1\n"
                        << further_ << (::geteuid() == 0 ? "user root\n" : "")  // else it takes another user, who may not write here
                        << "log_dest file " << (folder_ / "mosquitto.log") << "\npersistence_location " << folder_.path().string() << "/\n";
    std::string program = LRT_MOSQUITTO, option = "-c", name = file;
    char* arguments[] = {program.data(), option.data(), name.data(), nullptr};
    if (::posix_spawn(&process_, program.c_str(), nullptr, nullptr, arguments, environ) != 0) throw std::runtime_error("posix_spawn");
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < until) {
      if (::waitpid(process_, nullptr, WNOHANG) == process_) {
        process_ = -1;
        return false;
      }
      if (accepts()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  }
  void end(int signal) {
    if (process_ < 0) return;
    ::kill(process_, signal);
    ::waitpid(process_, nullptr, 0);
    process_ = -1;
  }
  void restart(int signal) {
    end(signal);
    if (!start()) throw std::runtime_error("mosquitto does not start again");
  }

 private:
  bool accepts() const {
    const int s = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port_);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const bool connected = ::connect(s, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    ::close(s);
    return connected;
  }

  const Folder folder_;
  const std::string further_;
  std::uint16_t port_ = 0;
  pid_t process_ = -1;
};

/// A client of the broker.
class Watcher {
 public:
  struct Message {
    std::string topic, payload, content_type, correlation;
    std::multimap<std::string, std::string> user;
    bool retained = false;
    int qos = 0;
    bool has_expiry = false, is_utf8 = false;

    std::string property(const std::string& name) const {
      const auto found = user.find(name);
      return found == user.end() ? std::string() : found->second;
    }
  };
  /// What a command carries besides its payload.
  struct Properties {
    std::string response_topic{}, correlation{}, content_type{};
    std::vector<std::pair<std::string, std::string>> user{};
    bool retain = false;
  };

  explicit Watcher(std::uint16_t port, const char* user = nullptr, const char* password = nullptr) : port_(port) {
    ::mosquitto_lib_init();
    client_ = ::mosquitto_new(nullptr, true, this);
    ::mosquitto_int_option(client_, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
    if (user) ::mosquitto_username_pw_set(client_, user, password);
    ::mosquitto_connect_v5_callback_set(
        client_, [](mosquitto*, void* self, int code, int, const mosquitto_property*) { static_cast<Watcher*>(self)->is_connected_ = code == 0; });
    ::mosquitto_subscribe_v5_callback_set(
        client_, [](mosquitto*, void* self, int, int, const int*, const mosquitto_property*) { ++static_cast<Watcher*>(self)->subscribed_; });
    ::mosquitto_message_v5_callback_set(client_, [](mosquitto*, void* self, const mosquitto_message* m, const mosquitto_property* list) {
      static_cast<Watcher*>(self)->take(*m, list);
    });
  }
  ~Watcher() { ::mosquitto_destroy(client_); }
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;

  mosquitto* client() noexcept { return client_; }
  void connect() {
    if (::mosquitto_connect(client_, "127.0.0.1", port_, 60) != MOSQ_ERR_SUCCESS) throw std::runtime_error("no broker");
    until([&] { return is_connected_; });
  }
  void subscribe(const char* filter, int qos = 1) {
    const int before = subscribed_;
    ::mosquitto_subscribe(client_, nullptr, filter, qos);
    until([&] { return subscribed_ > before; });
  }
  void publish(const std::string& topic, const std::string& payload, const Properties& p, int qos = 1) {
    mosquitto_property* list = nullptr;
    if (!p.response_topic.empty()) ::mosquitto_property_add_string(&list, MQTT_PROP_RESPONSE_TOPIC, p.response_topic.c_str());
    if (!p.correlation.empty())
      ::mosquitto_property_add_binary(&list, MQTT_PROP_CORRELATION_DATA, p.correlation.data(), static_cast<std::uint16_t>(p.correlation.size()));
    if (!p.content_type.empty()) ::mosquitto_property_add_string(&list, MQTT_PROP_CONTENT_TYPE, p.content_type.c_str());
    for (const auto& pair : p.user) ::mosquitto_property_add_string_pair(&list, MQTT_PROP_USER_PROPERTY, pair.first.c_str(), pair.second.c_str());
    const int code = ::mosquitto_publish_v5(client_, nullptr, topic.c_str(), static_cast<int>(payload.size()), payload.data(), qos, p.retain, list);
    ::mosquitto_property_free_all(&list);
    if (code != MOSQ_ERR_SUCCESS) throw std::runtime_error(::mosquitto_strerror(code));
  }
  int step(int milliseconds = 1) { return ::mosquitto_loop(client_, milliseconds, 1); }

  std::deque<Message> messages;
  /// The newest message of a topic.
  std::optional<Message> newest(const std::string& topic) const {
    for (auto at = messages.rbegin(); at != messages.rend(); ++at)
      if (at->topic == topic) return *at;
    return std::nullopt;
  }
  std::string payload(const std::string& topic) const {
    const auto found = newest(topic);
    return found ? found->payload : std::string("(none)");
  }

 private:
  template <class F>
  void until(F condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) throw std::runtime_error("the broker does not respond");
      step(10);
    }
  }
  void take(const mosquitto_message& m, const mosquitto_property* list) {
    Message made;
    made.topic = m.topic;
    made.payload.assign(static_cast<const char*>(m.payload), static_cast<std::size_t>(m.payloadlen));
    made.retained = m.retain;
    made.qos = m.qos;
    for (; list; list = ::mosquitto_property_next(list)) {
      char *name = nullptr, *value = nullptr;
      void* bytes = nullptr;
      std::uint16_t size = 0;
      switch (::mosquitto_property_identifier(list)) {
        case MQTT_PROP_CONTENT_TYPE:
          ::mosquitto_property_read_string(list, MQTT_PROP_CONTENT_TYPE, &value, false);
          made.content_type = value;
          break;
        case MQTT_PROP_CORRELATION_DATA:
          ::mosquitto_property_read_binary(list, MQTT_PROP_CORRELATION_DATA, &bytes, &size, false);
          made.correlation.assign(static_cast<const char*>(bytes), size);
          break;
        case MQTT_PROP_USER_PROPERTY:
          ::mosquitto_property_read_string_pair(list, MQTT_PROP_USER_PROPERTY, &name, &value, false);
          made.user.emplace(name, value);
          break;
        case MQTT_PROP_MESSAGE_EXPIRY_INTERVAL: made.has_expiry = true; break;
        case MQTT_PROP_PAYLOAD_FORMAT_INDICATOR: made.is_utf8 = true; break;
        default: break;
      }
      std::free(name);
      std::free(value);
      std::free(bytes);
    }
    messages.push_back(std::move(made));
  }

  const std::uint16_t port_;
  mosquitto* client_ = nullptr;
  bool is_connected_ = false;
  int subscribed_ = 0;
};

}  // namespace lrt::test
