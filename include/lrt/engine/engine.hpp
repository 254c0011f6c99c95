// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
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
#include <lrt/engine/counts.hpp>
#include <lrt/engine/feed.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/engine/options.hpp>
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

namespace lrt::model {
inline namespace v0 {
struct HandleContext;
}  // namespace v0
}  // namespace lrt::model

namespace lrt::engine {
inline namespace v0 {

class Lapses;

/// The authenticated client of a request, as far as it is known before the resource is found.
struct Caller {
  /// A caller without a principal. Implicit, because an Authorizer returns only the verdict.
  Caller(Access verdict = Access::granted) noexcept : access(verdict) {}  // NOLINT: an Authorizer returns no more
  Access access;                                                          ///< the verdict
  std::shared_ptr<const security::Principal> principal{};                 ///< nullptr: none
  std::shared_ptr<const security::View> view{};                           ///< what it may do to each resource; nullptr: everything
  std::string challenge{};                                                ///< WWW-Authenticate of a 401; empty: EngineOptions::challenge
  bool by_cookie = false;               ///< known by the cookie of a session, which browsers send automatically: only pages of this server may use it
  std::string client{};                 ///< name under which invocations and subscriptions are counted (ClientLimits); empty: they are not counted
  std::chrono::seconds retry_after{1};  ///< of a 429
  /// Engine::rights_revision() from before it was found. The default: it was found when the engine gets it.
  std::uint64_t rights_revision = std::numeric_limits<std::uint64_t>::max();
};
/// Finds the caller of a request by its header section.
using Authentication = std::function<Caller(const http::Request&)>;

/// The rules of one server. Server makes them from lrt::Options.
struct EngineOptions : Limits, RequestRules, CommonOptions {
  std::string public_base;   ///< Listen::public_base
  Authentication authorize;  ///< finds the callers of requests that come without one; empty: every client may do everything
  /// The present rights of the owner of a subscription; nullopt: the principal no longer exists. nullptr: a
  /// subscription without a principal. Calls no user code.
  std::function<std::optional<Caller>(const security::Principal* owner)> renew;
  std::shared_ptr<security::Sessions> sessions;  ///< made by Server; nullptr: nobody can log in
  Dispatch dispatch = Dispatch::in_poll;         ///< Threads::dispatch
  subscription::CallbackOptions callbacks;       ///< Options::callbacks
  bool body_jobs = false;                        ///< bodies above small_body_bytes become BodyJobs; else every body is judged at once
  bool reports_subscriptions = false;            ///< Outputs has the events of subscriptions
  bool saves_callbacks = false;                  ///< Outputs has the text of all web callbacks when they have changed
  /// How long a request that makes or cancels a web callback waits for saved(); then 503, and nothing has changed.
  /// nullopt: it does not wait.
  std::optional<std::chrono::milliseconds> save_timeout;
  /// Every client may read if no view is restricted. False: shared caches must not store responses. nullopt: false with
  /// `authorize`.
  std::optional<bool> everybody_reads;
  /// The path of the rules that count at a path and everywhere below it; empty: none count. nullopt: rules name this path, or one below. Things share
  /// a Blueprint only if no caller could see one of them and not the other. Empty: there are no rules.
  std::function<std::optional<std::string>(std::string_view path)> rules_around;
  /// Somebody runs jobs with Dispatch::executor. False: add() refuses things that need it.
  bool has_executor = true;
};

/// The kinds of `Upgrade` that a transport can carry (R0.12, R0.13).
struct Upgrades {
  bool websocket = false;  ///< `Upgrade: websocket`
  bool callback = true;    ///< `Upgrade: callback`
};

/// The beginning or the end of a subscription.
struct SubscriptionEvent {
  /// What happened.
  enum class Kind : std::uint8_t {
    made,   ///< it was made
    ended,  ///< it has ended
  };
  Kind kind;                  ///< what happened
  std::string path;           ///< path of the subscription
  std::string resource;       ///< path of what it observes
  std::string_view protocol;  ///< "websocket", "event_stream", "callback" or "feed"
  bool requested = true;      ///< made by a request, whose response has its IRI as Location; false: restored from a file
};

/// All web callbacks as text.
struct SavedText {
  std::string text;            ///< Turtle, with the secrets
  std::uint64_t revision = 0;  ///< of the last change that the text contains
};

/// User code to run where its Dispatch says; with io_thread: soon, on the thread that drives the engine. It may also be
/// destroyed without being run. It never throws.
struct Job {
  Dispatch where = Dispatch::in_poll;  ///< where it runs
  UniqueFunction<void()> run;          ///< the code
  bool is_stop = false;                ///< of Action::stop(): runs before the others
};

/// A request body to judge or a query to evaluate, on any thread and without the engine's lock. It calls no user code
/// and never throws. If it is destroyed without being run, its request gets 503 at its time limit.
struct BodyJob {
  std::string client;          ///< who has its share of the time used: Caller::client, or the client's address
  std::size_t bytes = 0;       ///< the work, as size of a body; for a change of a graph also the work that depends on the graph's size
  UniqueFunction<void()> run;  ///< the work
};

/// What an engine hands out: work that runs without its lock, and what its owner has to know.
struct Outputs {
  /// Things that were removed or refused, with the user's lambdas, to be destroyed without a lock.
  std::vector<std::shared_ptr<const void>> discarded;
  std::vector<Job> jobs;                               ///< user code to run, in order
  std::vector<BodyJob> body_jobs;                      ///< bodies to judge (EngineOptions::body_jobs)
  std::vector<BodyJob> query_jobs;                     ///< queries to evaluate (EngineOptions::query)
  std::vector<subscription::ReadyCallback> callbacks;  ///< callbacks that have a notification to post
  std::vector<ObservableResource> new_resources;       ///< resources that were added or have another path (Engine::follow_resources())
  std::vector<SubscriptionEvent> subscription_events;  ///< in order (EngineOptions::reports_subscriptions)
  std::optional<SavedText> saved;                      ///< all web callbacks, if they have changed (EngineOptions::saves_callbacks)
  std::optional<std::uint64_t> structure;              ///< Engine::structure(), if it has changed
};

/// The requirements R0 and R1 as a function of request, state and time. It has no sockets, no threads and no clock of
/// its own. Of user code it calls only the authorizer and the log callback; all other user code becomes a Job. Most
/// programs use Server instead.
///
/// @par Threads  One thread at a time. Jobs, Responders, publish(): any.
/// @par Implements  R0.3-R0.17, R1.1-R1.12
class LRT_API Engine final : public Handler {
 public:
  /// @par Errors  check() returns those of the options
  explicit Engine(EngineOptions options = {});
  ~Engine() override;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Registers a thing with all its resources.
  /// @par Errors  the thing's first error; duplicate_path; expected_rdf for its Turtle. After an error nothing is
  ///              registered
  Result<void> add(Thing thing);
  /// The same of several: all of them, or none.
  /// @par Errors  as above
  Result<void> add(std::vector<Thing> things);
  /// Removes the thing at a path and all things below it.
  /// @par Errors  unknown_path
  Result<void> remove(std::string_view path);
  /// The same, if the thing's handles belong to this description; else unknown_path.
  Result<void> remove(std::string_view path, const model::HandleContext& handles);

  /// Sets where the server listens, for the base of representations and the accepted hosts.
  /// @param address   numeric address
  /// @param port      port
  /// @param secure    over TLS
  /// @param name      host name that resolved to the numeric address; empty: none
  /// @param upgrades  what responses offer (RFC 9110 7.8)
  void listens_on(std::string_view address, std::uint16_t port, bool secure = false, std::string_view name = {}, Upgrades upgrades = {});
  /// Sets the waker that is called when a job or Responder has made something available to next_reply().
  void set_waker(std::shared_ptr<Waker> waker);

  /// As Handler::judge_header(), for a caller that is known. EngineOptions::authorize is not called.
  HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, const Result<Caller>& caller, TimePoint now);
  HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint now) override;
  bool is_stop(const http::Request& request) noexcept override;
  /// As Handler::handle(), for a caller that is known. EngineOptions::authorize is not called.
  Outcome handle(const http::Request& request, const Result<Caller>& caller, TimePoint now);
  Outcome handle(const http::Request& request, TimePoint now) override;
  std::optional<Reply> next_reply(TimePoint now) override;
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override;
  void abandon(Ticket ticket) noexcept override;
  void input_ended(Ticket ticket) noexcept override;
  std::optional<Channel> next_ready(TimePoint now) override;
  std::optional<Push> next_push(Channel channel, TimePoint now) override;
  void take_ready(std::vector<ReadyChannel>& channels, TimePoint now) override;
  void closed(Channel channel) noexcept override;

  // Web callbacks: as with WebSockets the engine names a channel once, and the deliverer calls next_notification() until it returns nullopt.
  /// Checks the options of subscriptions and callbacks. To be called before all other functions.
  /// @par Errors  invalid_option
  Result<void> check() const;
  /// The notification to post now; nullopt: none. It is in progress until delivered() reports its result.
  std::optional<subscription::Notification> next_notification(Channel channel, TimePoint now);
  /// Reports the result of a notification.
  void delivered(Channel channel, const subscription::DeliveryResult& result, TimePoint now);
  /// Reports that Outputs::saved is on the disk, or that writing it failed: the changes up to that revision are
  /// then final, or undone.
  /// @par Threads  Any.
  void saved(std::uint64_t revision, bool written);
  /// Restores the text of Outputs::saved after a restart. A subscription continues when its resource is registered. If
  /// its receiver may not be called now, it waits. An invalid subscription is left out, and the log says so. To be
  /// called after listens_on().
  /// @return  number of subscriptions in the text
  /// @par Errors  expected_rdf, limit_exceeded; then nothing is restored
  Result<std::size_t> restore(std::string_view saved);
  /// Restores those subscriptions of a damaged text that can be read.
  /// @return  their number, and the number of parts of the text that cannot be read
  std::pair<std::size_t, std::size_t> recover(std::string_view damaged);

  // Feeds: subscriptions whose messages the host takes. next_ready() names their channels as it names others.
  /// Makes a subscription of a feed. Its first message is the present representation, if there is one.
  /// @par Errors  unknown_path; refused: the resource cannot be observed, or not by the owner; unsupported_syntax: it
  ///              does not have the media type; limit_exceeded: SubscriptionOptions::max_feed_subscriptions
  Result<Subscribed> subscribe(FeedSubscription wanted, TimePoint now);
  /// The next message of such a channel; nullopt: none now. next_ready() will name the channel again.
  std::optional<FeedMessage> next_feed_message(Channel channel, TimePoint now);
  /// Whether the subscription of such a channel has ended and no message is left, so that next_feed_message() says `end`.
  bool feed_has_ended(Channel channel) const noexcept;
  /// Marks the present representation to be sent again, although it was sent. A subscription with a queue gets it if
  /// FeedSubscription::repeats is set and the queue is empty; next_ready() then names the channel.
  /// @return  call next_feed_message(): next_ready() will not name the channel for it
  bool repeat(Channel channel);
  /// All resources that can be observed, except subscriptions.
  std::vector<ObservableResource> observable_resources() const;
  /// Starts or stops recording for Outputs::new_resources.
  void follow_resources(bool follow);
  /// A number that grows with each change of Things, actions and their descriptions.
  std::uint64_t structure() const noexcept;
  /// The base IRI of feeds, without a slash at the end: the public base, or where the server listens.
  std::string base() const;

  /// Checks the rights of the owners of subscriptions again (EngineOptions::renew). A subscription without the right
  /// ends. The same holds for requests that wait, when they would make one.
  void renew_rights();
  /// Ends the subscriptions of a principal, also restored ones that wait for their resource. Requests that have
  /// begun make none: 401.
  void sign_out(std::string_view principal);
  /// A number that grows with each call of renew_rights() and sign_out().
  /// @par Threads  Any.
  std::uint64_t rights_revision() const noexcept;

  /// The written values that have a life (model::PropertyHandle::expires()). Who runs jobs also runs their lapses.
  /// @par Threads  Any.
  Lapses& lapses() const noexcept;
  /// Adds to `outputs` what the engine hands out since the last call. Cheap if that is nothing. Discarded Things that
  /// are not taken are destroyed by the next add() or remove().
  /// @return  false: nothing was added
  bool take_outputs(Outputs& outputs);
  /// Present numbers.
  EngineCounts counts() const;
  /// The stamp of an instant, "0123456789abcdef/73521": this run, and the milliseconds since it began. Commands say in
  /// such stamps until when they are valid (SPEC 3.20).
  /// @par Threads  Any.
  std::string robot_time(TimePoint now) const;
  const http::Fields* common_fields(TimePoint now) override;
  /// Stops: every waiting and every new request gets 503.
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::engine
