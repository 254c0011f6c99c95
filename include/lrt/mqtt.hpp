// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>
#include <lrt/security.hpp>

namespace lrt {
inline namespace v0 {
class Server;
}  // namespace v0
}  // namespace lrt

/// Robots on an MQTT broker, by libmosquitto. A library of its own: lrt::mqtt. docs/mqtt.md is the guide.
namespace lrt::mqtt {
inline namespace v0 {

/// What a resource is, for Publication::kinds.
enum class Kind : std::uint8_t {
  property,
  state,       ///< all values of a Thing
  invocation,  ///< its status, progress and result
  action,      ///< its description, with its invocations and whether it is available
  thing,       ///< its description
  other,       ///< collections and what else can be observed
};

/// Which resources are published, and how. The first publication that fits a resource decides.
struct Publication {
  /// Pattern of paths: `*` stands for any characters but '/', `**` for any characters. "/baxter/**", "/*/state"
  std::string paths = "/**";
  std::vector<Kind> kinds{};                    ///< empty: all
  bool publish = true;                          ///< false: what fits is not published
  std::string media_type = "application/json";  ///< one that the resource has, such as application/cbor, text/turtle, application/ld+json
  int qos = 0;                                  ///< 0, 1 or 2; less if the broker has less
  bool retain = false;                          ///< the broker gives the newest message to those who subscribe later
  /// nullopt: only the newest representation is sent, but for actions and invocations, of which each change is (the server's default_queue_length).
  std::optional<std::size_t> queue_length{};
  std::chrono::milliseconds minimum_interval{0};  ///< between two messages of one resource
  std::chrono::seconds expiry{0};                 ///< the broker drops a message that it has kept for so long; 0: never
};

/// Properties and states with QoS 0, newest value, retained; invocations with QoS 1, each change, not retained. All in JSON. Actions, Things and others are
/// not published: Description has them.
LRT_API std::vector<Publication> default_publications();

/// TLS to the broker. Files are PEM.
struct Tls {
  std::string ca_file;           ///< authorities of the broker's certificate; empty: those of the system
  std::string certificate_file;  ///< the robot's own certificate, for brokers that require one; empty: none
  std::string key_file;          ///< its private key, without a passphrase
};

/// The broker, and how the robot presents itself to it.
struct Broker {
  std::string host = "127.0.0.1";  ///< name or numeric address; the broker's certificate must have it
  std::uint16_t port = 0;          ///< 0: 1883, with TLS 8883
  std::optional<Tls> tls;
  std::string user, password;  ///< empty user: none
  std::string client_id;       ///< empty: "lrt-" and a random text. Two clients with one id end each other's connections
  /// What clients are told in RDF (lrt:mqttBroker): "mqtts://broker.example:8883". Empty: made of host and port.
  std::string public_url;
  std::chrono::seconds keep_alive{15};             ///< 5 s to 18 h; a broker that does not respond to a ping for as long counts as gone
  std::chrono::milliseconds connect_time{10'000};  ///< from the beginning of a connection to CONNACK
  // Pauses between attempts: first_pause, then twice that, and so on up to max_pause; each multiplied by a random factor of 0.5 to 1.5, so that the
  // robots of a fleet do not return at the same time.
  std::chrono::milliseconds first_pause{500};
  std::chrono::milliseconds max_pause{30'000};
};

/// The birth message's description: the document of all Things (/all), at PREFIX/ns/description. It is published when the broker is connected, and when Things or
/// actions come, go or change.
struct Description {
  bool publish = true;
  std::string media_type = "text/turtle";
  std::chrono::milliseconds minimum_interval{1'000};  ///< between two, so that many Things that are added one by one cause one message
};

/// Commands from the broker, off by default. A message to PREFIX/ns/put/PATH writes a Property, one to PREFIX/ns/post/PATH invokes an Action, one to
/// PREFIX/ns/delete/PATH cancels an invocation: each is a request to the server with the same validation, rights, limits and audit as over HTTP. Its content
/// type is that of the message; user properties `token` (a bearer token of the server), `accept`, `if-match`, `if-none-match` and `prefer` become
/// header fields. The response goes to the message's response topic with its correlation data: the body, its content type, and user properties `status` and, where
/// there is one, `location` and `etag`.
///
/// Retained messages are not carried out, nor are responses of other bridges. Messages that are sent while the robot is not connected are lost.
struct Commands {
  bool enabled = false;
  /// Sent for messages without a token: the principal that this broker stands for, if only those may publish to the robot's topics whom it
  /// lets. Empty: they have no credentials.
  std::string token;
  /// Allows commands although the server has no Security that could refuse them: who may publish to the broker can move the robot.
  bool allow_unprotected = false;
  int qos = 1;  ///< at most, of the broker's messages to the robot. With 1 a sender's repetition may be carried out twice, with 0 and 2 it is not
  std::string default_content_type = "application/json";  ///< of messages with a payload and without a content type
  std::size_t max_waiting = 64;                           ///< commands whose responses are to come; more get 503
  std::size_t max_payload_bytes = 1024 * 1024;            ///< more get 413, as with what the server allows for the resource
  std::size_t max_topic_bytes = 2'048;                    ///< of the topic and of the response topic; longer ones are dropped
  std::size_t max_correlation_bytes = 1'024;              ///< longer: dropped
  std::size_t max_user_properties = 32;                   ///< more get 400
  std::size_t max_property_bytes = 8'192;                 ///< of one user property or content type; longer: 400
  std::chrono::seconds response_expiry{60};
};

/// Bounds of what the broker and the network can make grow.
struct Limits {
  std::size_t max_unacknowledged = 100;  ///< messages with QoS 1 and 2 on their way; with more, values wait in the server
  std::size_t max_unacknowledged_bytes = 4 * 1024 * 1024;
  std::size_t batch_messages = 64;  ///< that are taken from the server at once
  std::size_t batch_bytes = 256 * 1024;
  std::uint16_t max_topic_aliases = 200;  ///< of messages with QoS 0, which then do not carry their topic; at most what the broker allows
};

/// Options of a bridge.
struct Options {
  Broker broker;
  /// The first levels of all topics of this robot: "robots/r7". A resource's topic is PREFIX and its path: robots/r7/arm/angle. Names with '+' have
  /// %2B there. PREFIX/ns/... is lrt's own: PREFIX/ns/status has {"online":true,...} or, also as the Last Will, {"online":false}, retained.
  std::string prefix;
  std::vector<Publication> publications = default_publications();
  Description description;
  Commands commands;
  Limits limits;
  /// Whose view is published: what this principal may see. It must be one of the server's Security. nullptr: everything.
  std::shared_ptr<const security::Principal> owner;
  ThreadOptions thread;  ///< of start()
  LogCallback log;       ///< empty: messages are dropped
};

/// What a bridge has done since it was created.
struct Counters {
  bool online = false;
  std::uint64_t connections = 0;  ///< that the broker has accepted
  std::uint64_t failed_connections = 0;
  std::uint64_t published = 0;         ///< messages handed to the network, repetitions not counted
  std::uint64_t published_bytes = 0;   ///< of their payloads
  std::uint64_t acknowledged = 0;      ///< of QoS 1 and 2
  std::uint64_t refused = 0;           ///< by the broker or by libmosquitto: too large, not authorized
  std::uint64_t not_bridged = 0;       ///< resources that a publication fits and that cannot be published
  std::uint64_t commands = 0;          ///< handed to the server
  std::uint64_t dropped_commands = 0;  ///< without a response: not well-formed, retained, or too large
  std::size_t resources = 0;           ///< that are published now
  std::size_t unacknowledged = 0;
};

/// Publishes what the resources of a server say to an MQTT 5 broker, and carries out commands from there if asked to.
///
/// The server's own subscriptions lie below: publish() in the control loop is as ever, clients see the bridge's subscriptions, and each resource says in its own
/// document where it is published (lrt:mqttBroker, lrt:mqttTopic). Each message has the user property `seq`, a number that rises by one with each
/// message of a topic: a gap tells of messages that were lost, or of changes that had no place in a queue. It begins with 1 when the bridge is created.
///
/// While the broker is gone, values wait in the server: one flag for each resource, or its queue. When it is back, the newest values come first, then what is in
/// queues. Messages with QoS 1 that were on their way are repeated.
///
/// It must not outlive its server. The robot's program never waits for it.
///
/// @par Threads  After start(): any. Before: one at a time. Not a lambda of the server.
class LRT_API Bridge {
 public:
  /// Connects with the first turn, not here.
  /// @par Errors  invalid_option; insecure_address: commands that nothing restricts (Commands::allow_unprotected); closed; io_error
  static Result<Bridge> create(Server& server, Options options);
  Bridge(Bridge&&) noexcept;
  Bridge& operator=(Bridge&&) noexcept;
  /// Calls stop().
  ~Bridge();

  /// Runs it on a thread of its own.
  /// @par Errors  invalid_option, io_error: no thread
  Result<void> start();
  /// One turn without a thread: takes and sends what there is. Never waits. The server must be polled, too.
  /// @return  how long the caller may sleep; zero: work is left
  std::chrono::milliseconds poll(std::chrono::microseconds budget = std::chrono::microseconds(500)) noexcept;
  /// Readable whenever poll() has work, including expired times. The bridge owns it.
  int descriptor() noexcept;
  /// Takes leave of the broker, which then publishes the Last Will; ends the thread. Nothing that still waits is sent.
  void stop() noexcept;

  /// @par Threads  Any.
  Counters counters() const noexcept;
  /// The topic of a resource's path, "/arm/angle".
  std::string topic(std::string_view path) const;

 private:
  class Impl;
  explicit Bridge(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::mqtt
