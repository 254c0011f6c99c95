// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/base/ids.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/base/waker.hpp>
#include <lrt/engine/feed.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/engine/page_source.hpp>
#include <lrt/engine/query_service.hpp>
#include <lrt/http/message.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/security.hpp>
#include <lrt/subscription/notification.hpp>
#include <lrt/subscription/options.hpp>
#include <lrt/thing.hpp>

namespace lrt::security {
inline namespace v0 {
class Sessions;
}  // namespace v0
}  // namespace lrt::security

namespace lrt::engine {
inline namespace v0 {

/// The verdict of an authorizer.
enum class Access : std::uint8_t {
  granted,
  unauthenticated,    ///< 401, with Security::challenge
  forbidden,          ///< 403
  too_many_requests,  ///< 429, with Retry-After
};
/// Judges a request by its header section: its body has not been received, and `body` is empty. A GET with `Upgrade: callback` makes the
/// robot post to a URL, so do not grant it to clients that may only read.
using Authorizer = std::function<Access(const http::Request&)>;

/// Who sends a request, and what is known of that before its resource is found.
struct Caller {
  Caller(Access verdict = Access::granted) noexcept : access(verdict) {}  // NOLINT: an Authorizer returns no more
  Access access;
  std::shared_ptr<const security::Principal> principal{};  ///< nullptr: nobody in particular
  std::shared_ptr<const security::View> view{};            ///< what it may do to each resource; nullptr: everything
  std::string challenge{};                                 ///< WWW-Authenticate of a 401; empty: EngineOptions::challenge
  bool by_cookie = false;               ///< known by the cookie of a session, which browsers send on their own: only pages of this server may use it
  std::string client{};                 ///< for whom invocations and subscriptions are counted (ClientLimits); empty: they are not
  std::chrono::seconds retry_after{1};  ///< of a 429
};
/// Finds out who sends a request by its header section.
using Authentication = std::function<Caller(const http::Request&)>;

/// Bounds of what clients can make grow in the engine: time and memory.
struct Limits {
  std::chrono::milliseconds host_timeout{2'000};   ///< a request waits so long for the host to run a lambda; then 503, or 202 if it runs
  std::chrono::seconds retry_after{1};             ///< of a 503
  std::chrono::seconds max_wait{60};               ///< of `Prefer: wait`; more is taken as this
  std::size_t max_waiting_requests = 1'000;        ///< more at once, or twice as many calls that the host has not run yet: 503. Those for
                                                   ///< lambdas on the I/O thread are counted separately
  std::size_t max_finished_invocations = 32;       ///< kept per action, the newest
  std::size_t max_page_members = 500;              ///< members of a container in one page
  std::size_t max_cache_bytes = 32 * 1024 * 1024;  ///< of representations that are kept; least recently used ones go first
  std::size_t max_link_bytes = 8 * 1024;           ///< of Link fields in one response (R0.9)
  /// Numbers, texts and so on of a resource in RDF. A value with more is available in JSON or CBOR, and its RDF is 406. If it has octets
  /// (octets() of a property), the RDF describes those instead of each number.
  std::size_t max_value_members = 100'000;
  std::size_t max_rdf_xml_triples = 5'000;                ///< of a representation in RDF/XML, 20 us each; more: 406
  std::size_t max_body_triples = 10'000;                  ///< of a request body; more: 413
  std::size_t max_body_text_bytes = 16 * 1024 * 1024;     ///< of a request body's IRIs and literals, written out; more: 413
  std::size_t max_list_members = 10'000;                  ///< of one list in a request body; more: 413
  std::size_t small_body_bytes = 2 * 1024;                ///< a request body up to this is judged by the thread that serves, a larger one by
                                                          ///< Threads::body_threads
  std::size_t max_waiting_body_bytes = 64 * 1024 * 1024;  ///< of larger bodies that wait to be judged, a quarter of it from one address; more: 503
  std::size_t max_all_bytes = 16 * 1024 * 1024;           ///< of a document of a Thing and all Things below it; more: 406
  /// Of a request body for one number, or where no value is expected; more: 413. A resource whose type has a fixed size takes 1 KiB more for
  /// each number, text and field of it, a text with length() its bytes besides. All others, such as a list without a maximum, take
  /// transport::Limits::max_body_bytes. max_body_bytes() of a property, action or collection says otherwise.
  std::size_t max_scalar_body_bytes = 16 * 1024;
};

/// The rules of one server; see the groups of lrt::Options, from which Server makes them.
struct EngineOptions : Limits {
  std::string public_base;                   ///< Listen::public_base
  std::vector<std::string> allowed_hosts;    ///< Security::allowed_hosts
  std::vector<std::string> allowed_origins;  ///< Security::allowed_origins
  Authentication authorize;                  ///< Security, empty: everybody may do everything
  /// What the owner of a subscription may do now; nullopt: there is no such principal any more. nullptr: nobody in particular. Calls no user code.
  std::function<std::optional<Caller>(const security::Principal* owner)> renew;
  std::string challenge = "Bearer";              ///< Security::challenge
  std::shared_ptr<security::Sessions> sessions;  ///< made by Server; nullptr: nobody can log in
  Dispatch dispatch = Dispatch::in_poll;         ///< Threads::dispatch
  subscription::SubscriptionOptions subscriptions;
  subscription::CallbackOptions callbacks;
  rdf::Prefixes prefixes = rdf::default_prefixes();
  std::string vocabulary;         ///< Options::vocabulary
  const Clock* clock = nullptr;   ///< nullptr: system_clock()
  std::shared_ptr<IdSource> ids;  ///< nullptr: RandomIds
  LogCallback log;
  std::shared_ptr<const PageSource> page;         ///< HTML for people; nullptr: none
  std::shared_ptr<const QueryService> query;      ///< Options::query
  std::vector<std::string> read_origins;          ///< Security::read_origins
  std::vector<std::string> notification_senders;  ///< Security::notification_senders
  bool body_jobs = false;                         ///< bodies above small_body_bytes become BodyJobs; else every body is judged at once
  bool reports_subscriptions = false;             ///< take_subscription_events() has something
  security::ClientLimits clients;                 ///< Security::clients, of which the engine has max_invocations and max_subscriptions
  /// A request that makes or cancels a web callback waits so long for saved(); then 503, and nothing has changed. nullopt: it does not wait.
  std::optional<std::chrono::milliseconds> save_timeout;
  /// `authorize` refuses nobody who only reads and whose view is not restricted. False: shared caches must not keep what it has let pass.
  bool everybody_reads = false;
};

/// The kinds of `Upgrade` that a transport can carry (R0.12, R0.13).
struct Upgrades {
  bool websocket = false;
  bool callback = true;
};

/// A subscription was made, or has ended.
struct SubscriptionEvent {
  enum class Kind : std::uint8_t { made, ended };
  Kind kind;
  std::string path;
  std::string resource;       ///< path of what it observes
  std::string_view protocol;  ///< "websocket", "event_stream", "callback" or "feed"
  bool requested = true;      ///< made by a request, whose response has its IRI as Location; false: restored
};

/// What an engine has at present, and what subscribers got since it was created.
struct EngineCounts {
  std::size_t websockets = 0, event_streams = 0, callbacks = 0;  ///< subscriptions
  std::uint64_t messages_sent = 0, messages_dropped = 0;
  std::size_t queued_bytes = 0;      ///< of messages for subscribers
  std::size_t waiting_requests = 0;  ///< deferred
  std::size_t waiting_calls = 0;     ///< of lambdas, which the host has not run
  std::size_t feeds = 0;             ///< subscriptions of feeds
};

/// All web callbacks as text.
struct SavedText {
  std::string text;            ///< Turtle, with the secrets
  std::uint64_t revision = 0;  ///< of the changes that it has
};

/// User code to be run where its Dispatch says; with io_thread: soon, by the thread that drives the engine. It may also be dropped. It never throws.
struct Job {
  Dispatch where = Dispatch::in_poll;
  UniqueFunction<void()> run;
  bool is_stop = false;  ///< of Action::stop(): runs before the others
};

/// A request body to be judged or a query to be evaluated, on any thread and without the engine's lock. It calls no user code and never throws. If it
/// is dropped, its request gets 503 at its time limit.
struct BodyJob {
  std::string client;     ///< numeric address
  std::size_t bytes = 0;  ///< of the body; the work is about proportional to it
  UniqueFunction<void()> run;
};

/// The rules R0 and R1 as a function of request, state and time: no sockets, no threads, no clock of its own. Of user code it calls the
/// authorizer and the log callback itself; everything else becomes a Job.
///
/// @par Threads  One at a time. Jobs may run on any thread, and Responders and publish() work from any. authorize(): any.
/// @par Implements  R0.3-R0.17, R1.1-R1.12
class LRT_API Engine final : public Handler {
 public:
  explicit Engine(EngineOptions options = {});
  ~Engine() override;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Registers a thing with everything it has, or nothing of it.
  /// @par Errors  the thing's first error; duplicate_path; expected_rdf for its Turtle
  Result<void> add(Thing thing);
  /// The same of several: all of them, or none.
  Result<void> add(std::vector<Thing> things);
  /// Removes the thing at a path and all things below it.
  /// @par Errors  unknown_path
  Result<void> remove(std::string_view path);

  /// Where the server listens, for the base of representations and the hosts that are accepted.
  /// @param name  the host name that has given the numeric address; empty: none
  /// @param upgrades  what responses offer (RFC 9110 7.8)
  void listens_on(std::string_view address, std::uint16_t port, bool secure = false, std::string_view name = {}, Upgrades upgrades = {});
  /// Called when a job or Responder has left something for next_reply().
  void set_waker(std::shared_ptr<Waker> waker);

  /// Calls the authorizer, without the body; not for a request that judge_header() has let pass. Its errors and exceptions are a Result.
  Result<Caller> authorize(const http::Request& request) const;
  HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, const Result<Caller>& caller, TimePoint now);
  HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint now) override {
    return judge_header(request, body_bytes, authorize(request), now);
  }
  bool is_stop(const http::Request& request) noexcept override;
  Outcome handle(const http::Request& request, const Result<Caller>& caller, TimePoint now);
  Outcome handle(const http::Request& request, TimePoint now) override { return handle(request, authorize(request), now); }
  std::optional<Reply> next_reply(TimePoint now) override;
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override;
  void abandon(Ticket ticket) noexcept override;
  void input_ended(Ticket ticket) noexcept override;
  std::optional<Channel> next_ready(TimePoint now) override;
  std::optional<Push> next_push(Channel channel, TimePoint now) override;
  void take_ready(std::vector<ReadyChannel>& channels, TimePoint now) override;
  void closed(Channel channel) noexcept override;

  // Web callbacks: as with WebSockets the engine names a channel once, and the deliverer calls next_notification() until it returns nullopt.
  /// Whether the options of subscriptions and callbacks are in order; to be called before anything else.
  /// @par Errors  invalid_option
  Result<void> check() const;
  /// Callbacks that have something to post.
  std::vector<subscription::ReadyCallback> take_callbacks();
  /// What to post now; nullopt: nothing. It is under way until delivered() says what became of it.
  std::optional<subscription::Notification> next_notification(Channel channel, TimePoint now);
  void delivered(Channel channel, const subscription::DeliveryResult& result, TimePoint now);
  /// All callback subscriptions, if there are others than at the last call.
  std::optional<SavedText> take_saved();
  /// A text of take_saved() is on the disk, or writing it failed: what was changed up to that revision is final, or taken back.
  /// @par Threads  any
  void saved(std::uint64_t revision, bool written);
  /// Restores what take_saved() gave before a restart. A subscription continues when its resource is registered. One whose receiver may
  /// not be called now waits; an invalid one is left out, and the log says so. To be called after listens_on().
  /// @return  how many subscriptions the text has
  /// @par Errors  expected_rdf, limit_exceeded; then nothing is restored
  Result<std::size_t> restore(std::string_view saved);
  /// Restores from a damaged text the subscriptions that can be read.
  /// @return  how many; and the parts of the text that cannot be read
  std::pair<std::size_t, std::size_t> recover(std::string_view damaged);

  // Feeds: subscriptions whose messages the host takes. next_ready() names their channels as it names others.
  /// Makes a subscription. Its first message is the present representation, if there is one.
  /// @par Errors  unknown_path; refused: the resource cannot be observed, or not by the owner; unsupported_syntax: it does not have the media type;
  ///              limit_exceeded: SubscriptionOptions::max_feed_subscriptions
  Result<Subscribed> subscribe(FeedSubscription wanted, TimePoint now);
  /// The next message of such a channel; nullopt: there is none now, and next_ready() will name it again.
  std::optional<FeedMessage> next_feed_message(Channel channel, TimePoint now);
  /// The present representation is to be sent again, although it was sent. Nothing for a subscription with a queue.
  /// @return  next_feed_message() is to be called, and next_ready() will not name the channel for it
  bool repeat(Channel channel);
  /// All resources that can be observed, but subscriptions.
  std::vector<ObservableResource> observable_resources() const;
  /// From now on take_new_resources() has resources that were added, or whose path has changed.
  void follow_resources(bool follow);
  std::vector<ObservableResource> take_new_resources();
  /// Moves with each change of the structure: Things and actions, and what they promise.
  std::uint64_t structure() const noexcept;
  /// The base IRI of feeds, without a slash at the end: the public base, or where the server listens.
  std::string base() const;

  /// Judges again what the owners of subscriptions may do (EngineOptions::renew). A subscription without the right ends.
  void renew_rights();

  /// The jobs that have come up since the last call, in order.
  std::vector<Job> take_jobs();
  /// The same of bodies (EngineOptions::body_jobs).
  std::vector<BodyJob> take_body_jobs();
  /// The same of queries (EngineOptions::query).
  std::vector<BodyJob> take_query_jobs();
  /// Things that were removed or refused, with the user's lambdas: to be destroyed without a lock. What is not taken is destroyed by the
  /// next add() or remove().
  std::vector<std::shared_ptr<const void>> take_discarded();
  /// What became of subscriptions since the last call, in order, with EngineOptions::reports_subscriptions.
  std::vector<SubscriptionEvent> take_subscription_events();
  EngineCounts counts() const;
  /// The server stops: every waiting and every new request gets 503.
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::engine
