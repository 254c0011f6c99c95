#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/http/target.hpp>
#include <lrt/http/link.hpp>
#include <lrt/http/prefer.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/validator.hpp>
#include <lrt/subscription/allowed_hosts.hpp>

#include "src/engine/mailbox.hpp"
#include "src/engine/resource.hpp"

namespace lrt::engine {

class About;
struct Said;

/// What user threads leave for the engine: run in order, by the engine's thread, with the engine.
using Message = UniqueFunction<void(Engine::Impl&, TimePoint)>;

/// The door through which other threads reach the engine, for as long as anybody holds it.
class Door {
 public:
  void put(Message message) {
    messages_.put(std::move(message));
    if (const auto w = std::atomic_load(&waker_)) w->wake();
  }
  void set_waker(std::shared_ptr<Waker> w) { std::atomic_store(&waker_, std::move(w)); }
  bool empty() const noexcept { return messages_.empty(); }
  template <class F>
  void take_all(F f) {
    messages_.take_all(std::move(f));
  }

 private:
  Mailbox<Message> messages_;
  std::shared_ptr<Waker> waker_;
};

class InvocationCore final : public model::InvocationLink, public model::NewsSource, public std::enable_shared_from_this<InvocationCore> {
 public:
  InvocationCore(std::shared_ptr<Door> door, std::string path, Dispatch where)
      : door_(std::move(door)), path_(std::move(path)), where_(where) {}

  void finish(Result<rdf::Value> result) noexcept override;
  void progress(double fraction) noexcept override;
  bool cancelled() const noexcept override { return cancelled_.load(std::memory_order_acquire); }
  void on_cancel(UniqueFunction<void()> hook) override;

  /// Around the user's start function: a responder that is dropped while it runs counts only if nothing was thrown.
  void start_begins() noexcept { phase_.store(starting, std::memory_order_relaxed); }
  void start_ended(Result<void> result) noexcept;

  /// The engine's: no answer counts from now on. Returns the hook, to be run as a job.
  UniqueFunction<void()> cancel() noexcept;
  double fraction() const noexcept { return fraction_.load(std::memory_order_relaxed); }
  const std::string& path() const noexcept { return path_; }
  Dispatch where() const noexcept { return where_; }

 private:
  static constexpr std::uint8_t idle = 0, starting = 1, dropped = 2;

  std::shared_ptr<Door> door_;
  std::string path_;
  Dispatch where_;
  std::atomic<std::uint8_t> phase_{idle};
  std::atomic<bool> finished_{false}, cancelled_{false};
  std::atomic<double> fraction_{0};
  std::mutex mutex_;  // guards hook_ against a cancellation at the same time
  UniqueFunction<void()> hook_;
};

/// A request that outlives its call.
struct OwnedRequest {
  explicit OwnedRequest(const http::Request& request);
  http::Request view() const;

  std::string method, target, peer, client_certificate;
  int version;
  bool secure, can_upgrade;
  std::vector<std::pair<std::string, std::string>> fields;
};

/// What a request is about, found out once at its start.
struct Context {
  const http::Request& request;
  TimePoint now;
  std::size_t base = 0;               ///< index into bases_
  Resource* resource = nullptr;
  std::size_t page = 1;
  http::Preferences preferences;
  std::optional<std::optional<std::size_t>> choice{};       ///< choice_of(), once it was asked
  std::optional<std::optional<std::string_view>> accept{};  ///< accept_of(), once it was asked
  std::unique_ptr<const std::string> accept_text{};         ///< what it is a view of, unless that is the request
  std::optional<Rendering> rendering{};                     ///< of the page, which nobody keeps
};

class Engine::Impl {
 public:
  explicit Impl(Options options);
  ~Impl();

  // registry.cpp
  Result<void> add(std::vector<Thing> things);
  Result<void> insert(Thing thing, std::vector<ThingNode*>& added);
  void withdraw(ThingNode& thing);
  std::vector<ThingNode*>& siblings_of(const ThingNode& thing) { return thing.parent ? thing.parent->children : roots_; }
  Result<void> remove(std::string_view path);
  void listens_on(std::string_view address, std::uint16_t port, bool secure);

  // engine.cpp
  Outcome handle(const http::Request& request, TimePoint now);
  std::optional<Reply> next_reply(TimePoint now);
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const;
  void abandon(Ticket ticket) noexcept;
  std::vector<Job> take_jobs() { return std::exchange(jobs_, {}); }
  void stop();
  void set_waker(std::shared_ptr<Waker> waker) {
    bell_->set_waker(waker);
    door_->set_waker(std::move(waker));
  }

  // notify.cpp
  std::optional<Channel> next_ready(TimePoint now);
  std::optional<Push> next_push(Channel channel, TimePoint now);
  void closed(Channel channel) noexcept;
  std::vector<subscription::Due> take_callbacks() { return std::exchange(callbacks_ready_, {}); }
  std::optional<subscription::Notice> next_notice(Channel channel, TimePoint now);
  void delivered(Channel channel, const subscription::Receipt& receipt, TimePoint now);

  // saved.cpp
  std::optional<std::string> take_saved();
  Result<void> restore(std::string_view saved);

  Result<void> check() const;

  // Called by messages.
  void read_done(const std::string& path, const std::shared_ptr<Claim>& claim, Result<model::Reading> reading, TimePoint now);
  void write_done(const std::string& path, const std::shared_ptr<Claim>& claim, Result<void> result, TimePoint now);
  void invocation_started(const std::string& path, TimePoint now);
  void invocation_finished(const std::string& path, Result<rdf::Value> result, TimePoint now);
  void run_hook(Dispatch where, UniqueFunction<void()> hook);
  void member_created(const std::string& collection, const std::string& id, rdf::Value value, Result<void> result, Ticket ticket,
                      TimePoint now);
  void member_removed(const std::string& path, Result<void> result, Ticket ticket, TimePoint now);

 private:
  struct Waiting {
    explicit Waiting(OwnedRequest r) : request(std::move(r)) {}
    OwnedRequest request;
    std::size_t open_reads = 0;
    std::optional<Error> failure;                               ///< of a read
    std::shared_ptr<Claim> claim;                               ///< of the job it waits for
    std::chrono::steady_clock::time_point deadline{};
    std::multimap<std::chrono::steady_clock::time_point, Ticket>::iterator timer;
    std::string invocation;                                     ///< path of the one it waits for
    bool may_take_long = false;                                 ///< at the deadline a running invocation answers 202, not 503
  };

  // engine.cpp: the way of a request
  Outcome route(Context& context, bool fresh);
  http::Response options(const Context& context);
  std::optional<http::Response> find_base(Context& context, const http::Target& target);
  std::size_t intern_base(std::string base, bool answered);
  /// Whether a page elsewhere has made a browser send this (RFC 6454 7), and may not.
  bool is_from_foreign_page(const Context& context) const;
  std::optional<http::Response> find_resource(Context& context, const http::Target& target);
  Outcome defer(const Context& context, std::chrono::milliseconds most, Ticket& ticket);
  Waiting* find_waiting(Ticket ticket);
  /// The context of a request that was put off.
  Context resumed(const http::Request& request, TimePoint now, Resource* resource);
  void find_again(Context& context);
  void reply(Ticket ticket, http::Response response);
  void resume(Ticket ticket, TimePoint now);
  void expire(TimePoint now);
  void drain(TimePoint now);

  // read.cpp: GET and HEAD
  Outcome get(Context& context, bool fresh);
  http::Response represent(Context& context);
  /// The page for people, as a rendering of the resource.
  Rendering page_of(Resource& resource, std::size_t base, std::size_t page);
  /// Puts a request off until pulled properties have been read; it then goes its way anew, as `fresh`.
  Outcome read_first(Context& context, const std::vector<PropertyResource*>& pulled);
  /// The rendering in the media type that suits accept_of() best; the answer if there is none.
  /// @param page_too  the page for people is one of them
  std::variant<const Rendering*, http::Response> negotiated(Context& context, bool page_too);
  /// Brings pushed values up to date; true if pulled ones must be read first.
  bool sync(Resource& resource);
  void take_value(PropertyResource& property, rdf::Value value, std::shared_ptr<const void> whole, Utc since);
  std::vector<PropertyResource*> pulled_of(Resource& resource);
  void read(PropertyResource& property, Continuation done);
  void start_read(PropertyResource& property);
  auto find_rendering(const Resource& resource, std::size_t base, Form form, std::size_t page) const;
  Result<const Rendering*> render(Resource& resource, std::size_t base, Form form, std::size_t page);
  Result<Bytes> body_of(Resource& resource, std::size_t base, Form form, std::size_t page);
  Result<std::string> write(const rdf::Graph& graph, Form form, std::size_t base) const;
  /// The fields of a 200 that only the structure changes.
  http::Fields fields_of(Resource& resource, std::size_t base, std::size_t page, std::string_view cache_control);
  void forget_renderings(Resource& resource);
  void trim_cache();
  /// Whether If-Match and If-None-Match let a method go on; the answer if not.
  std::optional<http::Response> precondition(Context& context);

  // write.cpp: bodies and PUT
  Outcome put(Context& context);
  void next_write(PropertyResource& property, TimePoint now);
  void decide_write(PropertyResource& property, TimePoint now);
  struct Body {
    rdf::Graph graph;
    bool empty = true;
  };
  /// The body as a graph; the answer if it is none.
  /// @param type, facets  of the value that it may be, written without RDF; nullptr: it may not
  std::variant<Body, http::Response> read_body(Context& context, const rdf::Type* type = nullptr, const rdf::Facets& facets = {});
  /// The value in a body; the answer if it is none (SPEC 3.3).
  std::variant<rdf::Value, http::Response> read_value(Context& context, const rdf::Type& type, const rdf::Facets& facets);
  /// The answer if a node does not conform to the shape of that name in the Blueprint; no node is judged as nothing said about <>.
  std::optional<http::Response> refused_by_shape(Context& context, const rdf::Graph& graph, std::optional<rdf::TermId> node,
                                                 std::string_view name);
  /// 422 with the report (SPEC 3.4).
  http::Response violation(Context& context, const shacl::Report& report);

  // invoke.cpp: actions
  Outcome post_action(Context& context);
  Outcome delete_invocation(Context& context);
  void launch(InvocationResource& invocation, TimePoint now);
  void forget_start_timer(InvocationResource& invocation);
  void cancel(InvocationResource& invocation, TimePoint now);
  void ended(InvocationResource& invocation, TimePoint now);
  void next_in_queue(ActionResource& action, TimePoint now);
  void never_begun(InvocationResource& invocation, TimePoint now);
  void prune(ActionResource& action);
  http::Response invocation_answer(const Context& context, InvocationResource& invocation);
  http::Response accepted(const Context& context, InvocationResource& invocation);
  InvocationResource* find_invocation(const std::string& path);

  // collect.cpp: collections
  Outcome post_collection(Context& context);
  Outcome delete_member(Context& context);

  // subscribe.cpp: how subscriptions come and go
  Outcome subscribe(Context& context, Protocol protocol, bool fresh);
  Outcome post_subscription(Context& context);
  Outcome delete_subscription(Context& context);
  /// The protocol that a GET asks for by Upgrade, if there is one for this resource.
  std::optional<Protocol> asked_protocol(const Context& context) const;
  struct Wish {
    Resource* observed = nullptr;
    std::string url, secret;
    Form form;
    subscription::Policy policy;
  };
  /// 503 when there are too many, 400 or 403 for a URL that may not be called.
  std::optional<http::Response> refused_subscription(const Context& context, Protocol protocol);
  bool is_this_server(const subscription::CallbackUrl& url) const;
  std::optional<http::Response> refused_receiver(const Context& context, const std::string& url);
  SubscriptionResource& make_subscription(Wish wish, Protocol protocol, std::size_t base, std::string id, Utc created);
  http::Response created(const Context& context, SubscriptionResource& made);
  subscription::Policy default_policy(const Resource& observed) const;
  /// The resource of an IRI under one of the bases that are answered for.
  Resource* find_iri(std::string_view iri) const;
  void unsubscribe(SubscriptionResource& s, std::uint16_t code, std::string reason);
  void end_observers(Resource& resource);
  SubscriptionResource* find_channel(Channel channel) const;

  // saved.cpp: callbacks that survive a restart
  void adopt_parked();

  // notify.cpp: how changes reach subscribers
  /// The resource's representations have changed.
  void changed(Resource& resource);
  void tell(Resource& resource);
  void note(SubscriptionResource& s);
  void queue(SubscriptionResource& s);
  const Rendering* render_for(SubscriptionResource& s);
  void schedule(SubscriptionResource& s);
  void set_timer(SubscriptionResource& s);
  void clear_timer(SubscriptionResource& s);
  std::optional<subscription::Item> next_item(SubscriptionResource& s, TimePoint now);
  void watch(Resource& resource);
  void unwatch(Resource& resource);
  void watch_property(PropertyResource& property);
  void unwatch_property(PropertyResource& property);
  void sample_later(PropertyResource& property, TimePoint now);
  void start_looking();
  void look(TimePoint now);
  bool has_news() const;
  void expire_subscriptions(TimePoint now);

  // describe.cpp: graphs
  void describe(rdf::Graph& graph, Resource& resource, const std::string& base, std::size_t page);
  void describe_thing(rdf::Graph& graph, ThingNode& thing, const std::string& base);
  void describe_property(rdf::Graph& graph, PropertyResource& property, const std::string& base);
  void describe_action(rdf::Graph& graph, ActionResource& action, const std::string& base);
  void describe_invocation(rdf::Graph& graph, InvocationResource& invocation, const std::string& base);
  void describe_subscription(rdf::Graph& graph, SubscriptionResource& s, const std::string& base);
  void describe_container(rdf::Graph& graph, Resource& container, const std::string& base, std::size_t page);
  void describe_type(rdf::Graph& graph, Resource& resource, rdf::TermId subject);
  void describe_formats(About& about, PropertyResource& property, const std::string& base);
  static rdf::TermId object_term(rdf::Graph& graph, const Object& object, const std::string& base);
  void add_statements(rdf::Graph& graph, rdf::TermId subject, const std::vector<Statement>& statements, const std::string& base);
  void add_links(http::Fields& fields, Resource& resource, const std::string& base, std::size_t page);
  std::vector<Resource*> members_of(Resource& container) const;
  std::string blueprint_iri(const ThingNode& thing, const std::string& base) const;
  /// By which representations refer to the context: with a version, so that who has kept it for long has what they mean.
  std::string context_iri(const std::string& base) const;
  /// What "#name" predicates and shapes are resolved against: the thing's own blueprint, also when it refers to one elsewhere.
  static std::string names_base(const ThingNode& thing, const std::string& base) { return base + thing.blueprint.path; }

  // blueprint.cpp: shapes
  void describe_blueprint(rdf::Graph& graph, ThingNode& thing, const std::string& base);
  void describe_subscription_shape(rdf::Graph& graph, const std::string& shape);
  void describe_shape(rdf::Graph& graph, const ThingNode& thing, const std::string& base, const std::string& name, const rdf::Type& type,
                      const rdf::Facets& facets);
  Result<const shacl::Shapes*> shapes_of(ThingNode& thing, std::size_t base);

  // answer.cpp: answers that are no representation
  http::Response problem(const Context& context, int status, std::string detail);
  http::Response refused(const Context& context, const std::string& what, const Error& error);
  http::Response too_late(const Context& context);
  http::Response no_content(const Context& context, int status = 204);
  /// A graph, or, where that is given and preferred, the value that it is about without RDF.
  http::Response with_graph(const Context& context, int status, const rdf::Graph& graph, const Said* said = nullptr);
  void add_allow(http::Fields& fields, const Resource& resource) const;
  void add_types(http::Fields& fields, const Resource& resource) const;
  void add_constrained_by(http::Fields& fields, const Context& context);
  std::string allow(const Resource& resource) const;
  std::string iri_of(const Context& context, std::string_view path) const { return bases_[context.base] + std::string(path); }

  // registry.cpp
  bool take_path(Resource& resource);
  void drop_path(Resource& resource);
  Resource* find(std::string_view path) const;
  void structure_changed() {
    ++structure_;
    structure_news_ = true;
  }
  std::uint64_t revision_of(const Resource& resource) const;
  void drop_thing(ThingNode& thing);
  /// 404 for a request whose resource went while it waited.
  void answer_gone(Ticket ticket);
  void adopt(ThingNode& thing);
  Dispatch where(const ThingNode& thing) const noexcept {
    return thing.spec->dispatch == Dispatch::as_server ? options_.dispatch : thing.spec->dispatch;
  }
  /// A job counts until it has run or been destroyed: what a host that does not poll leaves lying is bounded by that.
  void add_job(Dispatch where, UniqueFunction<void()> run) {
    std::shared_ptr<void> counted(nullptr, [open = open_jobs_](void*) { --*open; });
    ++*open_jobs_;
    jobs_.push_back({where, [run = std::move(run), counted = std::move(counted)]() mutable { run(); }});
  }
  bool too_many_jobs() const noexcept { return *open_jobs_ >= 2 * options_.waiting_requests; }
  http::Response robot_is_busy(const Context& context);
  void log(LogLevel level, const std::string& message) const;

  Options options_;
  const Clock& clock_;
  std::shared_ptr<Door> door_ = std::make_shared<Door>();
  std::vector<std::string> bases_;             // [0] is the public one or that of the listening address
  std::vector<bool> answered_;                 // of each: requests may name it; not those of restored subscriptions
  std::vector<std::string> hosts_;             // accepted, lower-case with port
  std::uint16_t port_ = 0;                     // that is listened on
  std::uint64_t structure_ = 1;                // moves with every add and remove
  std::unordered_map<std::string_view, Resource*> by_path_;
  std::map<std::string, std::unique_ptr<ThingNode>, std::less<>> things_;  // by path, "/baxter/right_s1"
  std::vector<ThingNode*> roots_;
  Resource root_{Kind::root, "/", nullptr};
  Resource terms_{Kind::terms, "/ns/lrt", nullptr};
  Resource context_{Kind::context, "/ns/context.jsonld", nullptr};
  const std::string context_text_, context_version_;  // of JSON-LD's context

  std::list<Rendering> renderings_;            // least recently used last
  std::size_t rendered_bytes_ = 0;

  std::vector<Job> jobs_;
  std::shared_ptr<std::atomic<std::size_t>> open_jobs_ = std::make_shared<std::atomic<std::size_t>>(0);
  std::uint64_t next_ticket_ = 1;
  std::unordered_map<std::uint64_t, Waiting> waiting_;
  std::multimap<std::chrono::steady_clock::time_point, Ticket> timers_;
  Timers start_timers_;                        // invocations to be begun by then
  std::deque<Reply> replies_;
  bool stopped_ = false;

  // Subscriptions, by channel. One that has ended while a WebSocket is open is there until that has been told.
  Result<subscription::AllowedHosts> allowed_;
  std::uint64_t next_channel_ = 1;
  std::unordered_map<std::uint64_t, SubscriptionResource*> by_channel_;
  std::size_t callbacks_ = 0;
  struct Leaving {
    std::deque<subscription::Item> items;      // that it still gets
    bool text;
    std::uint16_t code;
    std::string reason;
  };
  std::unordered_map<std::uint64_t, Leaving> leaving_;
  std::deque<Channel> urgent_, ready_;         // named by next_ready(), commands and closes first
  std::vector<subscription::Due> callbacks_ready_;
  std::multimap<std::chrono::steady_clock::time_point, Channel> channel_timers_;
  Timers sample_timers_;
  bool structure_news_ = false;                // since observers of structure were told
  struct Parked {                              // a restored callback whose resource is not there yet
    std::string path, base, id;
    Utc created;
    Wish wish;
    std::string media_type;                    // of the wish, which has no form before the resource is there
    bool told = false;                         // that there is no such format now
    bool refused = false;                      // its receiver may not be called now: kept for a start when it may
  };
  std::vector<Parked> parked_;
  bool callbacks_changed_ = false;             // since take_saved()

  // Looking for news: by itself while there is some, then when the bell rings.
  std::shared_ptr<model::Bell> bell_ = std::make_shared<model::Bell>();
  struct Watched {
    model::SlotBase* slot;                     // nullptr: pulled
    PropertyResource* property;
  };
  std::vector<Watched> watched_;
  std::vector<InvocationResource*> watched_invocations_;
  bool looking_ = false;
  std::chrono::steady_clock::time_point next_look_{};
  unsigned quiet_looks_ = 0;
  bool telling_ = false;                       // the time to render for queues
  std::vector<Channel> marked_;                // with a queue, and something new since it was that time
  std::size_t queued_bytes_ = 0;               // of all subscribers
  const std::string instance_ = RandomIds().next();  // by which notifications of this server are known
};

/// Calls user code; whatever it throws becomes an Error.
template <class T, class F>
Result<T> guarded(F f) noexcept {
  try {
    return f();
  } catch (const BadResult& e) {
    return Unexpected{e.error()};
  } catch (const std::exception& e) {
    return unexpected(Errc::failed, std::string("it threw: ") + e.what());
  } catch (...) {
    return unexpected(Errc::failed, "it threw something that is no std::exception");
  }
}

/// The fragment of the shape that guards a resource's input, "rotation" or "actions/rotate/input".
std::string shape_name(const Resource& resource);

/// Adds a graph that was kept with the placeholder as base.
void add_placed(rdf::Graph& graph, const rdf::Graph& kept, const std::string& base);

bool is_container(const Resource& resource) noexcept;

/// Its name among the shapes of a blueprint.
inline constexpr std::string_view subscriptions_shape = "subscriptions";
inline constexpr std::chrono::seconds longest_interval{86'400};
inline constexpr std::size_t longest_secret = 200;
/// Of a number of seconds; nullopt: it is none, or not from 0 to longest_interval.
std::optional<std::chrono::milliseconds> interval_of(std::string_view seconds);

/// Names the server that a notification is of, so that it does not take it for a command.
inline constexpr std::string_view notification_field = "Lrt-Notification-Of";

/// Of a container without its members (LDP 7.2.2, PreferMinimalContainer).
inline constexpr std::size_t minimal_page = 0;

/// A value of a resource with its type. Lives until the resource changes.
struct Said {
  const rdf::Type* type;
  const rdf::Facets* facets;
  const rdf::Value* kept;  ///< by the resource, where it is not made up: a matrix is large
  rdf::Value made{};

  const rdf::Value& value() const noexcept { return kept ? *kept : made; }
};
/// @pre has_value(resource)
Said said_by(const Resource& resource);
/// Whether it has more numbers, texts and so on than `most`; an empty list is one.
bool has_more_than(std::size_t most, const rdf::Value& value);
/// The same of all values that the resource's RDF says.
bool says_more_than(std::size_t most, const Resource& resource);
rdf::Type state_type(const model::ThingSpec& thing);
rdf::Type invocation_type(const model::ActionSpec& action);
Iri status_iri(Status status);

/// What the user's encoder makes of the present value, made once for each.
/// @par Errors  unsupported_syntax: there is none of this value
const Result<Bytes>& encoded(PropertyResource& property, std::size_t index);

/// The Accept of a GET or HEAD, which the parameter `accept` of its target replaces.
std::optional<std::string_view> accept_of(Context& context);
/// A parameter of a target's query, decoded; the first of that name counts. nullopt: there is none, or it is not well-formed.
std::optional<std::string> query_parameter(std::string_view target, std::string_view name);
/// Where a resource, or a page of a container, is to be had in one media type.
std::string format_iri(const std::string& resource, std::string_view media_type, std::size_t page = 1);
/// Without what means something in a query.
std::string escaped(std::string_view text);

/// Whether a Link field (RFC 8288 3) asks for an LDP interaction model other than ldp:Resource and ldp:RDFSource (LDP 5.2.3.4).
bool asks_for_other_model(std::string_view field);

/// Why a path can name nothing here, if so; else its segments percent-encoded as the registry's are.
Result<std::string> canonical_path(std::string_view path);

}  // namespace lrt::engine
