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

/// Robots on an MQTT broker, by libmosquitto. It is a library of its own, lrt::mqtt. The guide is docs/mqtt.md.
namespace lrt::mqtt {
inline namespace v0 {

/// The kind of a resource, for Publication::kinds.
enum class Kind : std::uint8_t {
  property,    ///< the value of a Property
  state,       ///< all values of a Thing
  invocation,  ///< its status, progress and result
  action,      ///< its description, its invocations and its availability
  thing,       ///< its description
  other,       ///< collections and all other observable resources
  control,     ///< who has control of a Thing (Thing::control())
  document,    ///< a Property with a text for other programs, as /server/metrics (PropertyHandle::as_file())
};

/// What the payload of a message is.
enum class Form : std::uint8_t {
  value,  ///< the representation; what it means is in user properties, which MQTT 3.1.1 does not have
  /// For clients of MQTT 3.1.1: {"value":..., "time":..., "seq":..., "unit":..., "datatype":..., "frame":...}, without the members that are not known.
  /// Only with a media type of JSON.
  with_meaning,
};

/// Which resources are published, and how. For each resource the first publication that matches it is used.
struct Publication {
  /// Pattern of paths: `*` matches any characters but '/', `**` any characters. Examples: "/baxter/**", "/*/state".
  std::string paths = "/**";
  std::vector<Kind> kinds{};                    ///< kinds of resources; empty: all
  bool publish = true;                          ///< false: matching resources are not published
  std::string media_type = "application/json";  ///< one that the resource has, such as application/cbor, text/turtle, application/ld+json
  int qos = 0;                                  ///< 0, 1 or 2; reduced to the broker's maximum
  bool retain = false;                          ///< the broker sends the newest message to those who subscribe later
  /// nullopt: only the newest representation is sent; of actions and invocations each change (the server's
  /// default_queue_length).
  std::optional<std::size_t> queue_length{};
  /// Between two messages of one resource. nullopt: 100 ms without a queue; 10 s of Properties that count (those of
  /// server_thing()); 0 with a queue, because each change is wanted.
  std::optional<std::chrono::milliseconds> minimum_interval{};
  /// For how long a value is worth something: the broker deletes a message that it has kept for this time, and tells
  /// receivers of MQTT 5 what is left of it; 0: for ever.
  std::chrono::seconds expiry{0};
  Form form = Form::value;  ///< what the payload is
};

/// The default: Properties and who has control with QoS 0, newest value, retained; invocations with QoS 1, each change, not
/// retained; all in JSON. Each value has one topic: states, which repeat the Properties, are not published, nor are
/// documents. Actions, Things and others are not published, because Description contains them.
/// @par Threads  Any.
LRT_API std::vector<Publication> default_publications();

/// TLS to the broker. Files are PEM.
struct Tls {
  std::string ca_file;           ///< authorities of the broker's certificate; empty: those of the system
  std::string certificate_file;  ///< the robot's own certificate, for brokers that require one; empty: none
  std::string key_file;          ///< its private key, without a passphrase
};

/// The broker, and the robot's identity for it.
struct Broker {
  std::string host = "127.0.0.1";  ///< name or numeric address; the broker's certificate must contain it
  std::uint16_t port = 0;          ///< 0: 1883, with TLS 8883
  std::optional<Tls> tls;          ///< nullopt: plain TCP
  /// @{
  /// Credentials; an empty user: none.
  std::string user, password;
  /// @}
  /// Empty: made of the robot's identity, so that the broker recognises a robot that has started again. Two clients with
  /// the same id end each other's connections: two robots of one identity, which the log says, and two bridges of one
  /// robot, of which one needs an id here. A broker that makes the id of the user (examples/mosquitto) ignores it.
  std::string client_id;
  /// URL that the RDF states for clients (lrt:mqttBroker): "mqtts://broker.example:8883". Empty: made of host and port.
  std::string public_url;
  std::chrono::seconds keep_alive{15};             ///< 5 s to 18 h; if the broker does not respond to a ping for this time, it counts as lost
  std::chrono::milliseconds connect_time{10'000};  ///< from the beginning of a connection to CONNACK
  /// Pause before a further attempt: first_pause, then twice that, and so on up to max_pause; each multiplied by a
  /// random factor of 0.5 to 1.5, so that the robots of a fleet do not reconnect at the same time.
  std::chrono::milliseconds first_pause{500};
  std::chrono::milliseconds max_pause{30'000};  ///< see first_pause
  /// A file whose first line is the password, instead of `password`. It is read for each connection, as the files of `tls`
  /// are: when they have changed, Bridge::reload() connects with the new ones.
  std::string password_file;
};

/// The description of the robot, retained: the document of all Things (/all), which has the topic of each Property, at
/// PREFIX/ns/description; and for programs without RDF a JSON object for each Thing at PREFIX/ns/things/PATH, with topics, units,
/// datatypes, schemas and where to read whether the robot is connected. They are published when the broker is connected, and
/// when Things or actions are added, removed or changed.
struct Description {
  bool publish = true;                                ///< whether the document of all Things is published
  std::string media_type = "text/turtle";             ///< one that the resource has
  std::chrono::milliseconds minimum_interval{1'000};  ///< between two messages, so that many Things that are added one by one cause one message
  bool things = true;                                 ///< whether there is a JSON object for each Thing
};

/// Discovery by Home Assistant (its "device discovery", 2024.11 and later): a retained message for each Thing at
/// PREFIX/device/ID/config. Numbers and texts become sensors, truth values binary sensors; other Properties, and those that are
/// not published in JSON, are left out. It does not offer commands: those of lrt have credentials and expire.
struct HomeAssistant {
  std::string prefix = "homeassistant";  ///< its discovery prefix
};

/// Commands from the broker, off by default. A message to PREFIX/ns/put/PATH writes a Property, one to
/// PREFIX/ns/post/PATH invokes an Action, and one to PREFIX/ns/delete/PATH cancels an invocation. Each is a request to
/// the server with the same validation, rights, limits and audit as over HTTP. Its content type is that of the message;
/// user properties `token` (a bearer token of the server), `accept`, `if-match`, `if-none-match` and `prefer` become
/// header fields. The response goes to the message's response topic with its correlation data: the body, its content
/// type, the user properties `status` and `response-of` (the prefix), and `location`, `etag`, `retry-after` and
/// `www-authenticate` if the response has them.
///
/// A command says until when it is worth carrying out in the user property `valid-until`: a stamp of the robot with
/// milliseconds added. PREFIX/ns/time has the robot's stamp (Commands::time_interval), and each response has one in the
/// user property `robot-time`; a client adds the time that has passed since for itself, and how long the command may take.
/// A message without user properties (MQTT 3.1.1) has it in its payload: {"validUntil": STAMP, "value": VALUE}, or for a
/// record {"validUntil": STAMP, MEMBERS}; `validUntil` is the first member. The message expiry of MQTT 5 counts as well,
/// from when the bridge receives the message. A command that is late is not carried out, and its response is 412. A stop
/// and the cancelling of an invocation never expire.
///
/// Retained messages and responses of other bridges are not carried out. Messages that are sent while the robot is not
/// connected are lost.
struct Commands {
  bool enabled = false;  ///< whether the bridge subscribes to commands
  /// Token for messages without one: it names the principal that represents the broker, if only authorized clients may
  /// publish to the robot's topics there. Empty: such messages have no credentials.
  std::string token;
  /// Allows commands although the server has no Security that could refuse them: whoever may publish to the broker can
  /// move the robot.
  bool allow_unprotected = false;
  int qos = 1;  ///< maximum, of the broker's messages to the robot. With 1 a repeated message may be carried out twice, with 0 and 2 not
  std::string default_content_type = "application/json";  ///< for messages with a payload and without a content type
  std::size_t max_waiting = 64;                           ///< commands without a response so far; more get 503
  std::size_t max_payload_bytes = 1024 * 1024;            ///< larger ones get 413, as do those beyond the server's limit for the resource
  std::size_t max_topic_bytes = 2'048;                    ///< of the topic and of the response topic; longer ones are dropped
  std::size_t max_correlation_bytes = 1'024;              ///< of the correlation data; longer: dropped
  std::size_t max_user_properties = 32;                   ///< more get 400
  std::size_t max_property_bytes = 8'192;                 ///< of one user property or content type; longer: 400
  std::chrono::seconds response_expiry{60};               ///< message expiry of responses
  std::chrono::milliseconds time_interval{1'000};         ///< between two messages to PREFIX/ns/time; 0: there are none
  /// Patterns of the response topics that are allowed, with `*` and `**` as in Publication::paths. A command with another
  /// one is dropped, because who may publish a command could have the robot publish anywhere with its rights at the broker.
  std::vector<std::string> response_topics = {"replies/**"};
};

/// Limits of memory that the broker and the network can use.
struct Limits {
  std::size_t max_unacknowledged = 100;                    ///< sent messages with QoS 1 and 2; beyond it values wait in the server
  std::size_t max_unacknowledged_bytes = 4 * 1024 * 1024;  ///< of their payloads
  std::size_t batch_messages = 64;                         ///< messages that are taken from the server at a time
  std::size_t batch_bytes = 256 * 1024;                    ///< of their payloads
  std::uint16_t max_topic_aliases = 200;  ///< of messages with QoS 0, which then do not contain their topic; at most what the broker allows
};

/// Options of a bridge.
struct Options {
  Broker broker;  ///< address and identity
  /// The first levels of all topics of this robot: "robots/r7". Empty: "robots/" and Identity::name() of the robot's
  /// identity. The topic of a resource is PREFIX and its path: robots/r7/arm/angle. A '+' in a name becomes %2B. lrt uses PREFIX/ns/... itself: PREFIX/ns/status is
  /// {"online":true,"since":TIME,...} or {"online":false,...}, retained. A robot that takes its leave says since when it is not online
  /// (`since`); the Last Will cannot know that, and says since when it was (`onlineSince`).
  std::string prefix;
  std::vector<Publication> publications = default_publications();  ///< what is published
  Description description;                                         ///< the robot's description
  Commands commands;                                               ///< commands from the broker
  Limits limits;                                                   ///< memory
  /// The principal whose view is published: what it may read. It must be one of the server's Security. nullptr:
  /// everything.
  std::shared_ptr<const security::Principal> owner;
  ThreadOptions thread;                           ///< of the thread of start()
  LogCallback log;                                ///< empty: messages are dropped
  std::optional<HomeAssistant> home_assistant{};  ///< nullopt: no discovery messages
};

/// Numbers of a bridge since its creation.
struct Counters {
  bool online = false;                   ///< the broker is connected
  std::uint64_t connections = 0;         ///< accepted by the broker
  std::uint64_t failed_connections = 0;  ///< attempts that failed
  std::uint64_t published = 0;           ///< messages passed to the network, without repetitions
  std::uint64_t published_bytes = 0;     ///< of their payloads
  std::uint64_t acknowledged = 0;        ///< messages with QoS 1 and 2
  std::uint64_t refused = 0;             ///< messages refused by the broker or by libmosquitto: too large, not authorized
  std::uint64_t not_bridged = 0;         ///< resources that match a publication and cannot be published
  std::uint64_t commands = 0;            ///< passed to the server
  std::uint64_t dropped_commands = 0;    ///< without a response: not well-formed, retained, or too large
  std::uint64_t taken_over = 0;          ///< times that another client was found to be connected as this robot
  std::size_t resources = 0;             ///< published now
  std::size_t unacknowledged = 0;        ///< messages with QoS 1 and 2 that wait for an acknowledgement
  /// Changes of values that the broker was not sent: superseded by newer ones while the link was busy or until the minimum
  /// interval had passed, overwritten before the server saw them, or without a place in a queue.
  std::uint64_t left_out = 0;
  /// How long the oldest value that waits has waited: in the server for its turn (of a queue: since its last one), or on its
  /// way until the broker confirms it. 0: none waits. As of the last turn of the bridge, at most a second ago.
  std::chrono::milliseconds lag{0};
};

/// Publishes the resources of a server to an MQTT 5 broker, and carries out commands from there if they are enabled. Its
/// counters are in the server's metrics, `lrt_mqtt_...` (server_thing.hpp).
///
/// It uses the server's own subscriptions: publish() in the control loop is not affected, clients see the bridge's
/// subscriptions, and each resource states in its own document where it is published (lrt:mqttBroker, lrt:mqttTopic).
/// Each message has the user property `seq`, a number that grows by one with each message of a topic. A gap means lost
/// messages, or changes that did not fit into a queue. It begins with 1 when the bridge is created, and when a resource
/// is added again that was removed. It also has `time`, when the value became what it is, and where the Property says so `unit`,
/// `datatype` and `frame` (IRIs).
///
/// What waits for a slow link waits in the server, where a newer value replaces it: the bridge measures how fast the broker
/// confirms what it got, and has no more bytes on their way than arrive in about 0.4 s (docs/mqtt.md, "A slow link"). Values of topics
/// with a queue are sent in order and never replaced.
///
/// While the broker is not connected, values wait in the server: one flag for each resource, or its queue. After
/// reconnecting, unacknowledged messages with QoS 1 and 2 are repeated, then the newest values are sent, then those in
/// queues. A message that is repeated on another connection may arrive twice, with QoS 2, too.
///
/// A bridge must not outlive its server. The robot's program never waits for it.
///
/// @par Threads  After start(): any. Before: one thread at a time. Not from a lambda of the server.
class LRT_API Bridge {
 public:
  /// Makes a bridge. It does not connect yet; start() or the first poll() does.
  /// @par Errors  invalid_option: also of a server that has neither an identity nor a public base; insecure_address: commands that nothing restricts (Commands::allow_unprotected);
  ///              closed; io_error
  static Result<Bridge> create(Server& server, Options options);
  Bridge(Bridge&&) noexcept;
  Bridge& operator=(Bridge&&) noexcept;
  /// Calls stop().
  ~Bridge();

  /// Runs the bridge on a thread of its own. A second call has no effect.
  /// @par Errors  invalid_option, io_error: no thread; closed: after stop()
  Result<void> start();
  /// Does pending work, for a program without start(). Never waits. The server must be polled, too.
  /// @param budget  time after which no further work is started
  /// @return        how long the caller may sleep; zero: work is left
  std::chrono::milliseconds poll(std::chrono::microseconds budget = std::chrono::microseconds(500)) noexcept;
  /// A descriptor that is readable whenever poll() has work, including expired times. The bridge owns it.
  int descriptor() noexcept;
  /// Reads the password and the files of TLS again, and connects with them: for certificates that were replaced, for
  /// example at SIGHUP. The broker publishes the Last Will in between. Without this call they are read for the next
  /// connection, whenever that is.
  /// @par Errors   invalid_option, io_error: a file cannot be used; the connection stays as it is. closed: after stop()
  /// @par Threads  Any.
  Result<void> reload();
  /// Disconnects from the broker, which then publishes the Last Will, and ends the thread. Waiting messages are not
  /// sent. When the server stops, the bridge disconnects by itself.
  /// @par Time  Waits for the thread.
  void stop() noexcept;

  /// Numbers since its creation.
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
