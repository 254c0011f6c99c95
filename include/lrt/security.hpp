// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>
#include <lrt/base/result.hpp>
#include <lrt/http/message.hpp>

/// Who sends a request, and what they may do: the values of lrt::Security.
namespace lrt::security {
inline namespace v0 {

/// What a request does to a resource.
enum class Right : std::uint8_t {
  read = 1,       ///< GET, HEAD, OPTIONS
  write = 2,      ///< changes a Property or a Collection
  invoke = 4,     ///< invokes an Action, and cancels or deletes its invocations
  subscribe = 8,  ///< watches: WebSocket, event stream, web callback; and cancels what it has subscribed to
  manage = 16,    ///< sees and cancels the subscriptions of others
};

/// A set of rights: `Right::read | Right::subscribe`.
class Rights {
 public:
  constexpr Rights() noexcept = default;
  constexpr Rights(Right right) noexcept : bits_(static_cast<std::uint8_t>(right)) {}  // NOLINT: one right is a set
  static constexpr Rights all() noexcept { return Rights(std::uint8_t{0x1F}); }
  constexpr bool has(Right right) const noexcept { return (bits_ & static_cast<std::uint8_t>(right)) != 0; }
  constexpr bool empty() const noexcept { return bits_ == 0; }
  constexpr std::uint8_t bits() const noexcept { return bits_; }
  friend constexpr Rights operator|(Rights a, Rights b) noexcept { return Rights(static_cast<std::uint8_t>(a.bits_ | b.bits_)); }
  friend constexpr bool operator==(Rights a, Rights b) noexcept { return a.bits_ == b.bits_; }
  friend constexpr bool operator!=(Rights a, Rights b) noexcept { return a.bits_ != b.bits_; }

 private:
  constexpr explicit Rights(std::uint8_t bits) noexcept : bits_(bits) {}
  std::uint8_t bits_ = 0;
};
constexpr Rights operator|(Right a, Right b) noexcept { return Rights(a) | Rights(b); }

/// Who sends a request: a person or a program that has shown who it is.
struct Principal {
  std::string name;
  std::vector<std::string> roles;  ///< its rights are those of all of them
};

/// What each role may do. A role that is not in it may do nothing.
using Roles = std::map<std::string, Rights, std::less<>>;

/// `reader`: read and subscribe. `operator`: all rights but manage. `administrator`: all rights.
LRT_API Roles default_roles();

/// Which part of the tree a Rule is for.
enum class Scope : std::uint8_t {
  here,   ///< the resource with its path (acl:accessTo)
  below,  ///< the resources below it (acl:default)
  tree,   ///< both
};

/// Whom a Rule is for.
struct Who {
  enum class Kind : std::uint8_t {
    anyone,         ///< also without credentials (foaf:Agent)
    authenticated,  ///< every principal (acl:AuthenticatedAgent)
    role,           ///< principals with the role `name` (acl:agentGroup)
    principal,      ///< the principal `name` (acl:agent)
  };
  Kind kind = Kind::anyone;
  std::string name{};
};

/// What somebody may do to a resource, or to those below it.
///
/// For each resource the nearest rules count: those for the resource itself if there are any, else those with Scope::below of the nearest path
/// above that has some (Web Access Control, effective ACL). Rules with the same path and scope add up. What no rule gives is forbidden. So a
/// rule below takes away what one above has given, unless it gives the same again.
struct Rule {
  std::string path;  ///< from the root, "/arm/left"; "/": the list of Things
  Scope scope = Scope::tree;
  Who who{};
  Rights rights{};
};

class View;

/// Reads rules from Turtle (Web Access Control): each acl:Authorization with acl:accessTo or acl:default (`</arm>`, a path of the server),
/// acl:agent (`<#anna>`, the principal of that name; any other IRI is a name as a whole), acl:agentGroup (`<#operator>`, the role) or
/// acl:agentClass (foaf:Agent, acl:AuthenticatedAgent), and acl:mode: acl:Read, acl:Write, acl:Control (Right::manage), lrt:Invoke, lrt:Subscribe.
/// @par Errors  expected_rdf; invalid_option: names the authorization and what is wrong with it
LRT_API Result<std::vector<Rule>> parse_rules(std::string_view turtle);
/// The same from a file of at most 1 MiB.
/// @par Errors  io_error, and those above
LRT_API Result<std::vector<Rule>> load_rules(const std::string& file);

/// Finds out who sends a request from its header section; nullopt: nobody that this function knows. Called on the thread that serves the request,
/// without a lock of lrt. The body has not been received.
using Authenticate = std::function<std::optional<Principal>(const http::Request&)>;

/// Bounds of what stands for a token: sessions of browsers, whose users have logged in, and tickets.
struct SessionOptions {
  /// Of a session, from the login on; at most a year. It ends before when its token does, at logout, and in the browser when that is closed. 0: nobody
  /// can log in, and there are no tickets.
  std::chrono::seconds life{12 * 60 * 60};
  std::size_t max_sessions = 1'000;             ///< at once; more: 503
  std::size_t max_sessions_per_principal = 16;  ///< one more ends the oldest of that principal
  std::size_t max_failed_logins = 10;           ///< from one address within a minute; then every login from there is 429 for the rest of it
  std::chrono::seconds ticket_life{30};         ///< of a ticket; 1 s to 1 h
  std::size_t max_tickets = 1'000;              ///< that are not used yet; more: 503
  std::size_t max_tickets_per_principal = 100;  ///< one more ends the oldest of that principal
};

/// Bearer tokens (RFC 6750) of principals. Kept as SHA-256 digests: neither memory nor a core file shows a token.
///
/// @par Threads  find(): any, concurrently.
class LRT_API Tokens {
 public:
  /// Reads lines `NAME ROLE[,ROLE]... TOKEN [EXPIRES]`, separated by spaces or tabs. `#` begins a comment, and empty lines are skipped. TOKEN is the
  /// token, of 16 to 512 characters of RFC 6750 (letters, digits, `-._~+/` and `=` at the end), or `sha256:` and the 64 hexadecimal digits of its
  /// digest. EXPIRES is an xsd:dateTime with a time zone; from then on the token is unknown. A name may have several tokens.
  /// @par Errors  invalid_option, with the number of the line and without the token
  static Result<Tokens> parse(std::string_view text);
  /// The same from a file of at most 1 MiB.
  /// @par Errors  io_error, invalid_option
  static Result<Tokens> load(const std::string& file);

  /// The principal of a token; nullptr: the token is unknown or has expired. The time that it takes says nothing of the tokens that there are.
  std::shared_ptr<const Principal> find(std::string_view token, std::chrono::system_clock::time_point now) const;
  /// A principal by name, with the roles of its first token that has not expired; nullptr: there is none.
  std::shared_ptr<const Principal> find_name(std::string_view name, std::chrono::system_clock::time_point now) const;
  /// When the next token expires after `now`.
  std::optional<std::chrono::system_clock::time_point> next_expiry(std::chrono::system_clock::time_point now) const;
  std::size_t size() const noexcept { return entries_.size(); }

 private:
  using Digest = std::array<unsigned char, 32>;
  struct Entry {
    Digest digest;
    std::shared_ptr<const Principal> principal;
    std::optional<std::chrono::system_clock::time_point> expires;
  };
  std::size_t place_of(const Digest& digest) const noexcept;
  const Entry* find_entry(const Digest& digest) const noexcept;
  void enter(std::size_t index);

  std::vector<Entry> entries_;
  std::vector<std::uint32_t> places_;  ///< where an entry stands: its index and 1; 0: none. Where a digest belongs is a secret of this process
};

/// What one client may use. A client is a principal, by its name; of requests without one, an IPv4 address or the /64 network of an IPv6 address, because
/// one host has as many addresses in its /64 as it likes. Beyond: 429 with Retry-After (RFC 6585 4). A stop (Action::stop()) is never refused by
/// these limits. Requests from this machine without a principal are not limited: a proxy has one address for all its clients, and the programs of a
/// robot are its integrator's.
struct ClientLimits {
  /// Requests per second, on average; 0 to 1,000,000; 0: not limited. The default lets a client at 1 kHz send ten requests in each step, and is
  /// about a tenth of what one core serves. A request is counted once, when its header section is complete; one that gets 429 is not counted.
  std::uint32_t requests_per_second = 10'000;
  /// Bytes of request bodies per second, on average; 0, or 1 KiB to 1 TiB; 0: not limited. The default is eight of the largest bodies
  /// (transport::Limits::max_body_bytes). A body is counted by Content-Length before it is received; a chunked one as the largest that its resource
  /// takes. A client that has some of its share left may send a body of any size, and waits then until the average holds again.
  std::uint64_t body_bytes_per_second = 8 * 1024 * 1024;
  /// A client that has been quiet may use what these rates give in this time at once; 1 ms to 1 h.
  std::chrono::milliseconds burst{2'000};
  std::size_t max_invocations = 64;     ///< at a time, those that wait in the queue of an action included; 0: not limited
  std::size_t max_subscriptions = 256;  ///< WebSockets, event streams and web callbacks at a time; 0: not limited
  /// Principals, and as many addresses, whose rates are remembered; 16 to 1,000,000, about 64 bytes each. For a further one, the server forgets of 16
  /// clients the one that is nearest to having used nothing. So no client is refused because of others, and a client could shed what it has used
  /// only with 16 further addresses that have used more.
  std::size_t max_clients = 4'096;
};

/// A log of who did what to which resource, with which outcome: each request that changes or commands something, each subscription that is made or
/// ends, and each refusal (401, 403, 404 for want of a right, 421, 429). One line is one JSON object in ASCII:
///
///     {"time":"2026-11-21T10:38:39.000125Z","event":"request","principal":"anna","address":"192.0.2.7","method":"PUT",
///      "resource":"/arm/angle","status":403,"reason":"right"}
///
/// `event`: "request", "subscription_made", "subscription_ended" (these with `subscription`, `observed` and `protocol`), or "end". `time`: when the
/// request came, or the subscription ended. `principal`: null without one. `resource`: path of the target. `status`: that of the response, also of a deferred
/// one; none if the client did not wait for it (`reason` "abandoned"). `reason`: http::Denial. `dropped`: how many lines are missing before this one.
/// Texts of more than 1,024 bytes are cut. Neither queries, header fields nor bodies are in it. What the transport refuses without asking the server (400,
/// 408, 414, 431 and so on) is not in it either.
struct Audit {
  /// Gets each line, without a line feed. Called on a thread of its own (lrt-audit), one line at a time, never where poll() runs; it may take long, and
  /// Server::stop() waits until it has all lines. What it throws goes to the log, and the line counts as dropped. Empty: no audit and no thread.
  std::function<void(std::string_view line)> sink;
  bool reads = false;  ///< also requests that change nothing
  /// Lines that wait for the sink; 1 to 1,000,000, about 300 bytes each. A further one is dropped and counted in the next line.
  std::size_t max_waiting_lines = 4'096;
};

}  // namespace v0
}  // namespace lrt::security
