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

class AuditFile;

/// The kinds of access to a resource.
enum class Right : std::uint8_t {
  read = 1,       ///< GET, HEAD, OPTIONS
  write = 2,      ///< changes a Property or a Collection
  invoke = 4,     ///< invokes an Action, and cancels or deletes its invocations
  subscribe = 8,  ///< makes a WebSocket, event stream or web callback, and cancels its own subscriptions
  manage = 16,    ///< sees and cancels the subscriptions of others
  release = 32,   ///< ends a stop, by the Action that Action::stop() names
  control = 64,   ///< takes over control from another client (Thing::control())
};

/// A set of rights: `Right::read | Right::subscribe`.
class Rights {
 public:
  constexpr Rights() noexcept = default;
  /// A set of one right.
  constexpr Rights(Right right) noexcept : bits_(static_cast<std::uint8_t>(right)) {}                         // NOLINT: one right is a set
  static constexpr Rights all() noexcept { return Rights(std::uint8_t{0x7F}); }                               ///< every right
  constexpr bool has(Right right) const noexcept { return (bits_ & static_cast<std::uint8_t>(right)) != 0; }  ///< whether it contains a right
  constexpr bool empty() const noexcept { return bits_ == 0; }                                                ///< whether it contains no right
  constexpr std::uint8_t bits() const noexcept { return bits_; }                                              ///< the values of Right, added
  friend constexpr Rights operator|(Rights a, Rights b) noexcept { return Rights(static_cast<std::uint8_t>(a.bits_ | b.bits_)); }
  friend constexpr bool operator==(Rights a, Rights b) noexcept { return a.bits_ == b.bits_; }
  friend constexpr bool operator!=(Rights a, Rights b) noexcept { return a.bits_ != b.bits_; }

 private:
  constexpr explicit Rights(std::uint8_t bits) noexcept : bits_(bits) {}
  std::uint8_t bits_ = 0;
};
/// The set of two rights.
constexpr Rights operator|(Right a, Right b) noexcept { return Rights(a) | Rights(b); }

/// What a server knows a principal by. The subscriptions of a principal end when it is no longer known by the same.
enum class KnownBy : std::uint8_t {
  host,         ///< nothing: the program has made the object, such as the owner of a feed. Whoever has its name counts
  token,        ///< a token of Security::token_file
  certificate,  ///< Security::certificates
  function,     ///< Security::authenticate
};

/// An authenticated client: a person or a program.
struct Principal {
  std::string name;                ///< its name, for rules, limits and audit
  std::vector<std::string> roles;  ///< it has the rights of all of them
  /// Of a principal that Authenticate returns: when what proves it ends, such as the `exp` of a JWT. From then on the
  /// principal is unknown, and its subscriptions end, unless a later request of a principal of that name came with a
  /// later end. nullopt: its subscriptions last until Server::sign_out().
  std::optional<std::chrono::system_clock::time_point> expires{};
  KnownBy known_by = KnownBy::host;  ///< set by the server
};

/// What each role may do. A role that is missing may do nothing.
using Roles = std::map<std::string, Rights, std::less<>>;

/// `reader`: read and subscribe. `operator`: all rights but manage and control. `administrator`: all rights.
/// @par Threads  Any.
LRT_API Roles default_roles();

/// The part of the tree to which a Rule applies.
enum class Scope : std::uint8_t {
  here,   ///< the resource with its path (acl:accessTo)
  below,  ///< the resources below it (acl:default)
  tree,   ///< the resource and those below it
};

/// The clients to which a Rule applies.
struct Who {
  /// How they are selected.
  enum class Kind : std::uint8_t {
    anyone,         ///< every client, also without credentials (foaf:Agent)
    authenticated,  ///< every principal (acl:AuthenticatedAgent)
    role,           ///< principals with the role `name` (acl:agentGroup)
    principal,      ///< the principal `name` (acl:agent)
  };
  Kind kind = Kind::anyone;  ///< how they are selected
  std::string name{};        ///< of the role or principal
};

/// What clients may do to a resource, or to those below it.
///
/// For each resource the nearest rules apply: those for the resource itself if there are any, else those with
/// Scope::below of the nearest path above that has some (Web Access Control, effective ACL). Rules with the same path
/// and scope add up. A right that no rule gives is refused. So a rule for a lower path replaces those for a higher one.
struct Rule {
  std::string path;           ///< from the root, "/arm/left"; "/": the list of Things
  Scope scope = Scope::tree;  ///< which resources
  Who who{};                  ///< which clients
  Rights rights{};            ///< what they may do
};

class View;

/// Reads rules from Turtle (Web Access Control): each acl:Authorization with acl:accessTo or acl:default (`</arm>`, a
/// path of the server), acl:agent (`<#anna>`, the principal of that name; any other IRI is a name as a whole),
/// acl:agentGroup (`<#operator>`, the role) or acl:agentClass (foaf:Agent, acl:AuthenticatedAgent), and acl:mode:
/// acl:Read, acl:Write, acl:Control (Right::manage), lrt:Invoke, lrt:Release, lrt:Subscribe, lrt:TakeOver (Right::control).
/// @par Errors   expected_rdf; invalid_option: names the authorization and what is wrong with it
/// @par Threads  Any.
LRT_API Result<std::vector<Rule>> parse_rules(std::string_view turtle);
/// The same from a file of at most 1 MiB.
/// @par Errors   io_error, and those above
/// @par Threads  Any.
/// @par Time     Reads the file.
LRT_API Result<std::vector<Rule>> load_rules(const std::string& file);

/// Finds the principal of a request from its header section; nullopt: it knows none. Called on the thread that serves
/// the request, without a lock of lrt, before the body has been received. When a principal logs out, refuse it here,
/// then call Server::sign_out().
using Authenticate = std::function<std::optional<Principal>(const http::Request&)>;

/// Limits of what replaces a token: sessions of browsers whose users have logged in, and tickets.
struct SessionOptions {
  /// Life of a session from the login on; at most a year. It ends earlier when its token expires, at logout, and when
  /// the browser is closed. 0: nobody can log in, and there are no tickets.
  std::chrono::seconds life{12 * 60 * 60};
  std::size_t max_sessions = 1'000;             ///< at a time; more: 503
  std::size_t max_sessions_per_principal = 16;  ///< a further one ends the oldest of that principal
  std::size_t max_failed_logins = 10;           ///< from one address within a minute; then every login from there gets 429 until the minute ends
  std::chrono::seconds ticket_life{30};         ///< 1 s to 1 h
  std::size_t max_tickets = 1'000;              ///< unused ones; more: 503
  std::size_t max_tickets_per_principal = 100;  ///< a further one ends the oldest of that principal
};

/// Bearer tokens (RFC 6750) of principals. They are stored as SHA-256 digests, so neither memory nor a core file
/// contains a token.
///
/// @par Threads  Distinct objects: any thread. find() and the other constant functions of one object: any thread,
///               concurrently.
class LRT_API Tokens {
 public:
  /// Reads lines `NAME ROLE[,ROLE]... TOKEN [EXPIRES]`, separated by spaces or tabs. `#` begins a comment, and empty
  /// lines are skipped. TOKEN is the token, of 16 to 512 characters of RFC 6750 (letters, digits, `-._~+/` and `=` at
  /// the end), or `sha256:` and the 64 hexadecimal digits of its digest. EXPIRES is an xsd:dateTime with a time zone;
  /// from then on the token is unknown. A name may have several tokens.
  /// @par Errors  invalid_option, with the number of the line and without the token
  static Result<Tokens> parse(std::string_view text);
  /// The same from a file of at most 1 MiB.
  /// @par Errors  io_error, invalid_option
  static Result<Tokens> load(const std::string& file);

  /// The principal of a token; nullptr: the token is unknown or has expired. The time of the call reveals nothing about
  /// the known tokens.
  std::shared_ptr<const Principal> find(std::string_view token, std::chrono::system_clock::time_point now) const;
  /// A principal by name, with the roles of its first token that has not expired; nullptr: there is none.
  std::shared_ptr<const Principal> find_name(std::string_view name, std::chrono::system_clock::time_point now) const;
  /// The time at which the next token expires after `now`; nullopt: none does.
  std::optional<std::chrono::system_clock::time_point> next_expiry(std::chrono::system_clock::time_point now) const;
  std::size_t size() const noexcept { return entries_.size(); }  ///< number of tokens

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

/// Limits of one client. A client is a principal, by its name; for requests without one, an IPv4 address or the /64
/// network of an IPv6 address, because one host can use all addresses of its /64. Beyond a limit: 429 with Retry-After
/// (RFC 6585 4). These limits never refuse a stop (Action::stop()). Requests from this machine without a principal are
/// not limited, because a proxy has one address for all its clients, and the integrator controls the other programs of
/// the robot.
struct ClientLimits {
  /// Requests per second, on average; 0 to 1,000,000; 0: not limited. The default lets a client at 1 kHz send ten
  /// requests in each period, and is about a tenth of what one core serves. A request is counted once, when its header
  /// section is complete; a request that gets 429 is not counted.
  std::uint32_t requests_per_second = 10'000;
  /// Bytes of request bodies per second, on average; 0, or 1 KiB to 1 TiB; 0: not limited. The default is eight of the
  /// largest bodies (transport::Limits::max_body_bytes). A body is counted by Content-Length before it is received; a
  /// chunked body as the largest that its resource takes. A client that has not used up its share may send a body of
  /// any size, and then waits until the average is within the limit again.
  std::uint64_t body_bytes_per_second = 8 * 1024 * 1024;
  /// A client that was idle may use what these rates give in this time at once; 1 ms to 1 h.
  std::chrono::milliseconds burst{2'000};
  std::size_t max_invocations = 64;     ///< at a time, including those in the queue of an action; 0: not limited
  std::size_t max_subscriptions = 256;  ///< WebSockets, event streams and web callbacks at a time; 0: not limited
  /// Number of principals, and of addresses, whose rates are stored; 16 to 1,000,000, about 64 bytes each. For a
  /// further one, the server replaces the one of 16 clients that has used least of its share. So no client is refused
  /// because of others. To lose its record, a client would need 16 further addresses that have used more.
  std::size_t max_clients = 4'096;
};

/// A log of who did what to which resource, with the result: each request that changes or commands something, each
/// subscription that is made or ends, and each refusal (401, 403, 404 because of a missing right, 421, 429). One line
/// is one JSON object in ASCII:
///
///     {"time":"2026-11-21T10:38:39.000125Z","event":"request","principal":"anna","address":"192.0.2.7","method":"PUT",
///      "resource":"/arm/angle","status":403,"reason":"right"}
///
/// | member      | content |
/// |-------------|---------|
/// | `event`     | "request", "subscription_made", "subscription_ended" (these two with `subscription`, `observed` and `protocol`), or "end" |
/// | `time`      | when the request came, or the subscription ended |
/// | `principal` | name; null without one |
/// | `resource`  | path of the target |
/// | `status`    | of the response, also of a deferred one; absent if the client did not wait for it (`reason` "abandoned") |
/// | `reason`    | http::Denial |
/// | `dropped`   | number of lines that are missing before this one; with `file` there is a line "lost" instead |
///
/// Texts of more than 1,024 bytes are cut. Queries, header fields and bodies are not logged. Requests that the
/// transport itself refuses (400, 408, 414, 431 and so on) are not logged either.
struct Audit {
  /// Gets each line, without a line feed. Called on a thread of its own (lrt-audit), one line at a time. It may block;
  /// Server::stop() waits until it has got all lines. If it throws, the log says so, and the line counts as dropped.
  /// Empty: no audit and no thread.
  std::function<void(std::string_view line)> sink;
  bool reads = false;  ///< also requests that change nothing
  /// Lines that wait for the sink; 1 to 1,000,000, about 300 bytes each. A further one is dropped, and the next line
  /// counts it.
  std::size_t max_waiting_lines = 4'096;
  /// A file in place of `sink`: audit_file() of security/audit_file.hpp opens it. It serves one server at a time.
  std::shared_ptr<AuditFile> file;
  std::size_t max_waiting_bytes = 4 * 1024 * 1024;  ///< of these lines together; 64 KiB to 1 GiB
};

}  // namespace v0
}  // namespace lrt::security
