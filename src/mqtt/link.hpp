// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/waker.hpp>
#include <lrt/mqtt.hpp>

namespace lrt::mqtt {
inline namespace v0 {

using UserProperties = std::vector<std::pair<std::string, std::string>>;

/// A message to the broker.
struct OutMessage {
  std::string topic;                             ///< empty: that of the alias
  std::shared_ptr<const std::string> payload{};  ///< nullptr: empty
  int qos = 0;
  bool retain = false;
  std::uint16_t alias = 0;  ///< 0: none
  std::string content_type{};
  std::chrono::seconds expiry{0};
  std::string correlation{};
  UserProperties user{};
  bool is_utf8 = false;  ///< the payload is a text (payload format indicator)
};

/// A message from the broker, within its limits.
struct InMessage {
  std::string topic, payload, content_type, response_topic, correlation;
  UserProperties user;
  std::optional<std::chrono::seconds> expiry{};  ///< what is left of the message expiry; nullopt: it has none
  bool retained = false;
  bool has_payload_limit = false;   ///< the payload is longer than allowed, and not here
  bool has_property_limit = false;  ///< there are more properties, or longer ones, than allowed
};

/// The limits that a broker has announced.
struct Agreement {
  std::uint16_t max_aliases = 0;
  std::uint16_t receive_maximum = 65'535;  ///< messages with QoS 1 and 2 that it takes before it has acknowledged earlier ones
};

/// One connection to a broker at a time, without a thread of its own.
///
/// @par Threads  One at a time.
class Link {
 public:
  /// Called within step() only.
  class Events {
   public:
    virtual void connected(const Agreement& agreement) = 0;
    /// Another client has connected with this client id; disconnected() follows. Mosquitto before 2.0.12 does not say so.
    virtual void taken_over() {}
    /// The connection has ended or could not be opened.
    virtual void disconnected(const std::string& reason) = 0;
    /// The broker has accepted a message with QoS 1 or 2, or refused it.
    virtual void acknowledged(int id, bool refused, const std::string& reason) = 0;
    /// The broker has answered a probe(), and so has received all messages before it.
    virtual void confirmed(int id) = 0;
    virtual void received(InMessage message) = 0;
    /// The broker does not let the robot subscribe.
    virtual void subscription_refused(const std::string& filter, const std::string& reason) = 0;

   protected:
    ~Events() = default;
  };

  virtual ~Link() = default;
  /// Whether the password and the files of TLS can be used, as they are now.
  /// @par Threads  Any.
  virtual Result<void> check() { return {}; }
  /// The Last Will of the connections that begin from now on.
  virtual void set_will(OutMessage will) = 0;
  /// Starts to connect: step() reports the result. Nothing of an earlier connection is left: the caller sends messages that were not acknowledged
  /// again.
  virtual void connect() = 0;
  /// Ends the connection; connected() was called or not.
  /// @param with_will  the broker publishes the Last Will
  virtual void disconnect(bool with_will = true) noexcept = 0;
  /// @param retained  whether messages come that the broker has kept
  virtual Result<void> subscribe(const std::string& filter, int qos, bool retained = false) = 0;
  /// Hands a message to the network.
  /// @return  the id of acknowledged(); 0: QoS 0
  /// @par Errors  closed: not connected, nothing is kept; limit_exceeded, refused: the broker cannot accept it
  virtual Result<int> publish(const OutMessage& message) = 0;
  /// Asks the broker something that it answers after all messages before it.
  /// @return  the id of confirmed()
  /// @par Errors  closed: not connected; refused
  virtual Result<int> probe() = 0;
  /// The network does not accept more data now.
  virtual bool is_congested() const noexcept = 0;
  /// Reads and writes what is possible without waiting, and calls events.
  virtual void step(Events& events) = 0;
  /// -1: there is none now.
  virtual int descriptor() const noexcept = 0;
  virtual bool wants_write() const noexcept = 0;
  /// When step() is to be called even if nothing happens.
  virtual std::chrono::milliseconds step_interval() const noexcept = 0;
};

/// The parameters of all connections.
struct LinkOptions {
  Broker broker;
  Commands commands;  ///< bounds of what is received
  OutMessage will;
  std::string probed_filter;     ///< of no subscription, for probe()
  std::shared_ptr<Waker> waker;  ///< called when step() has work that descriptor() does not show
  LogCallback log;
  ThreadOptions thread;
};

/// Creates a link that uses libmosquitto.
/// @par Errors  invalid_option, io_error
Result<std::unique_ptr<Link>> make_mosquitto_link(LinkOptions options);

}  // namespace v0
}  // namespace lrt::mqtt
