// SPDX-License-Identifier: Apache-2.0
#include "src/client/watches.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <list>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/client/callback_receiver.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/back_off.hpp"
#include "src/base/event_waker.hpp"
#include "src/base/quote.hpp"
#include "src/base/random.hpp"
#include "src/client/event_parser.hpp"
#include "src/client/names.hpp"
#include "src/client/representation.hpp"
#include "src/client/robot_times.hpp"
#include "src/client/stamp.hpp"
#include "src/client/tasks.hpp"
#include "src/client/websockets.hpp"
#include "src/exchange/redirect.hpp"
#include "src/http/robot_time.hpp"
#include "src/http/stamp.hpp"
#include "src/http/websocket.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

using std::chrono::milliseconds;
using Instant = std::chrono::steady_clock::time_point;

/// For names, and for requests of watches that are neither event streams nor polls.
constexpr std::size_t request_threads = 8;
/// Threads for polls, in addition to those for Limits::max_streams.
constexpr std::size_t poll_threads = 8;
constexpr milliseconds max_delete_time{2'000};
/// The bytes that are read of a response that refuses an event stream.
constexpr std::size_t max_reason_bytes = 64 * 1024;

/// The media types of an Accept field, the preferred first; ranges with '*' and what is refused (q=0) are left out.
std::vector<std::string> accepted_types(std::string_view accept) {
  std::vector<std::pair<double, std::string>> types;
  while (!accept.empty()) {
    const std::string_view member = accept.substr(0, accept.find(','));
    accept.remove_prefix(std::min(member.size() + 1, accept.size()));
    std::string type = lrt::detail::lower(lrt::detail::trim(member.substr(0, member.find(';'))));
    if (type.empty() || type.find('*') != std::string::npos) continue;
    double q = 1;
    if (const std::size_t at = member.find("q="); at != std::string_view::npos) {
      const std::string_view value = lrt::detail::trim(member.substr(at + 2, member.substr(at + 2).find(';')));
      q = rdf::lexical::parse_double(value).value_or(1);
    }
    if (q > 0) types.emplace_back(q, std::move(type));
  }
  std::stable_sort(types.begin(), types.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> result;
  for (auto& [q, type] : types) result.push_back(std::move(type));
  if (result.empty()) result.emplace_back("text/turtle");
  return result;
}

/// The syntax that the bytes obviously have, if the protocol does not name it and the server may have ignored the requested one.
std::string apparent_type(std::string_view body, const std::string& assumed) {
  const std::size_t begin = std::min(body.find_first_not_of(" \t\r\n"), body.size());
  body.remove_prefix(begin);
  const bool is_turtle = assumed == "text/turtle" || assumed == "application/n-triples";
  if (is_turtle && body.substr(0, 1) == "{") return "application/ld+json";
  if (is_turtle && (body.substr(0, 5) == "<?xml" || body.substr(0, 9) == "<rdf:RDF ")) return "application/rdf+xml";
  return assumed;
}

/// With Via::any: after so many connections without a value the next protocol is tried.
constexpr unsigned max_empty = 3;

std::string seconds_of(milliseconds time) {
  std::string text = std::to_string(time.count() / 1000);
  const auto rest = time.count() % 1000;
  if (rest == 0) return text;
  std::array<char, 8> digits{};
  std::snprintf(digits.data(), digits.size(), ".%03d", static_cast<int>(rest));
  return text + digits.data();
}

/// "ws" and "wss" as "http" and "https".
std::string as_http(std::string url) {
  const std::string scheme = lrt::detail::lower(url.substr(0, std::min(url.find(':'), url.size())));
  if (scheme == "ws") url.replace(0, 2, "http");
  else if (scheme == "wss") url.replace(0, 3, "https");
  return url;
}

/// A refusal that may be temporary.
bool is_temporary(int status) noexcept {
  return status == 408 || status == 425 || status == 429 || (status >= 500 && status != 501 && status != 505);
}

std::string essence(std::string_view content_type) { return lrt::detail::lower(lrt::detail::trim(content_type.substr(0, content_type.find(';')))); }

/// The IRI by which a JSON-LD document of an lrt server refers to its context, which is not fetched; empty: it has another one.
std::string_view own_context(std::string_view body, const std::string& url) {
  constexpr std::string_view name = "\"@context\"", end = "/ns/context.jsonld";
  std::size_t at = body.find(name);
  if (at == std::string_view::npos) return {};
  at = std::min(body.find_first_not_of(" \t\r\n:", at + name.size()), body.size());
  if (at == body.size() || body[at] != '"') return {};
  std::string_view iri = body.substr(at + 1, body.substr(at + 1).find('"'));
  iri = iri.substr(0, iri.find('?'));  // a version
  const bool is_own = iri.size() > end.size() && iri.substr(iri.size() - end.size()) == end && same_origin(iri, url);
  return is_own ? iri : std::string_view();
}

Result<rdf::Graph> graph_of(std::string_view body, const std::string& type, const std::string& url, std::size_t max_triples) {
  const std::optional<rdf::Syntax> syntax = rdf::syntax_of(type);
  if (!syntax) return unexpected(Errc::unsupported_syntax, "\"" + url + "\": expected RDF, found \"" + type + "\"");
  rdf::ReadOptions options;
  const std::string_view base = std::string_view(url).substr(0, url.find('#'));
  options.base = base;
  options.max_triples = max_triples;
  if (*syntax == rdf::Syntax::json_ld) options.context = own_context(body, url);
  return rdf::read(body, *syntax, options);
}

/// Two numbers of values, either of which may be unknown, in one.
std::optional<std::uint64_t> sum(std::optional<std::uint64_t> a, std::optional<std::uint64_t> b) noexcept {
  return a && b ? std::optional(*a + *b) : std::nullopt;
}

/// Two gaps without a value between them are one.
void merge_gap(Change& gap, const Change& later) {
  gap.left_out = sum(gap.left_out, later.left_out);
  if (!gap.reason) gap.reason = later.reason;
}

/// The first object of a predicate, of any subject.
std::optional<std::string> any_object(const rdf::Graph& graph, Iri predicate) {
  const auto id = graph.find(predicate);
  if (!id) return std::nullopt;
  for (const rdf::Triple& triple : graph.match(std::nullopt, *id, std::nullopt))
    if (!graph.term(triple.object).is_blank()) return std::string(graph.term(triple.object).text);
  return std::nullopt;
}

Error response_error(const Response& response, const std::string& url) {
  return {Errc::refused, "\"" + url + "\": the server responded with " + std::to_string(response.status) + ": " + response.reason()};
}

/// Counts one event stream while it exists.
class StreamPlace {
 public:
  StreamPlace(std::atomic<std::size_t>& count, std::size_t max) : count_(count), is_taken_(count.fetch_add(1) < max) {}
  ~StreamPlace() { --count_; }
  StreamPlace(const StreamPlace&) = delete;
  StreamPlace& operator=(const StreamPlace&) = delete;
  explicit operator bool() const noexcept { return is_taken_; }

 private:
  std::atomic<std::size_t>& count_;
  const bool is_taken_;
};

}  // namespace

/// The state shared by the watches of a client.
struct WatchContext : std::enable_shared_from_this<WatchContext> {
  WatchContext(std::shared_ptr<HttpClient> client, Watches::Hooks given)
      : http(std::move(client)),
        hooks(std::move(given)),
        clock(hooks.clock != nullptr ? *hooks.clock : system_clock()),
        names(http->options().threads, hooks.resolve ? hooks.resolve : Resolve(resolve)),
        websockets(http->options()),
        tasks(http->options().threads, request_threads, clock),
        stream_tasks(http->options().threads, http->options().limits.max_streams + poll_threads, clock) {}

  const Options& options() const noexcept { return http->options(); }
  double random() const { return hooks.random ? hooks.random() : random_fraction(); }
  void announce(const std::shared_ptr<Watch::Impl>& watch);
  void drain_in_background();
  bool drain(std::chrono::microseconds budget) noexcept;
  void log(LogLevel level, const std::string& text) const noexcept {
    try {
      if (options().log) options().log(level, text);
    } catch (...) {}
  }

  const std::shared_ptr<HttpClient> http;
  const Watches::Hooks hooks;
  const Clock& clock;
  NameResolver names;
  std::atomic<std::size_t> streams{0};
  std::atomic<bool> stopped{false};

  std::mutex mutex;
  std::condition_variable changed;
  std::list<std::weak_ptr<Watch::Impl>> watches;
  std::deque<std::weak_ptr<Watch::Impl>> ready;  ///< with changes for the callback
  bool is_draining = false;                      ///< a task of Callbacks::in_background runs
  std::size_t deletions = 0;                     ///< of running deletions of subscriptions

  WebSockets websockets;
  Tasks tasks, stream_tasks;
};

/// One watch. It has one activity at a time (a WebSocket, a stream, a poll, a callback subscription), whose events carry its generation. Events of an
/// earlier activity have no effect.
class LRT_LOCAL Watch::Impl : public std::enable_shared_from_this<Watch::Impl> {
 public:
  using Delivery = Watches::Delivery;

  Impl(std::shared_ptr<WatchContext> context, std::string url, http::Url parsed, WatchOptions options, OnChange on_change, Delivery delivery)
      : context_(std::move(context)),
        url_(std::move(url)),
        parsed_(std::move(parsed)),
        options_(std::move(options)),
        delivery_(delivery),
        types_(accepted_types(options_.accept.empty() ? context_->options().accept : options_.accept)),
        steps_(options_.via == Via::any ? std::vector<Via>{Via::websocket, Via::event_stream, Via::polling} : std::vector<Via>{options_.via}),
        on_change_(std::move(on_change)),
        websocket_url_(as_http(options_.websocket_url)) {}

  bool start() { return attempt_at(std::nullopt, 1); }
  std::optional<milliseconds> age() const noexcept {
    const std::lock_guard lock(mutex_);
    if (!last_word_) return std::nullopt;
    return std::chrono::duration_cast<milliseconds>(context_->clock.now().steady - *last_word_);
  }
  void stop() noexcept;
  bool is_connected() const noexcept { return connected_.load(std::memory_order_acquire); }
  Via via() const noexcept { return via_.load(std::memory_order_relaxed); }
  std::string subscription() const {
    const std::lock_guard lock(mutex_);
    return subscription_;
  }
  Counts counts() const noexcept {
    const std::lock_guard lock(mutex_);
    return counts_;
  }
  std::optional<Error> last_error() const {
    const std::lock_guard lock(mutex_);
    return last_error_;
  }

  /// Calls the callback for the queued changes, until `until`.
  /// @return  more is due
  bool drain(std::optional<Instant> until) noexcept;

 private:
  using Generation = std::uint64_t;
  using Lock = std::unique_lock<std::mutex>;
  struct SocketEvents;

  // Events of the activities.
  void connected(Generation generation, std::string subscription);
  void connect();
  void value(Generation generation, std::string body, std::string type, std::string entity_tag, const Stamp& stamp = {});
  void count_left_out(Change& value, const Stamp& stamp);
  void add_gap(Change gap);
  void heartbeat(Generation generation, const std::string& stamp);
  void word(Lock& lock);
  void listen(Lock& lock);
  void check_silence();
  void lost(Generation generation, Error error, milliseconds min_pause = milliseconds(0));
  void refused(Generation generation, int status, Error error, std::optional<std::chrono::seconds> pause);
  void end(Generation generation, Error error);
  bool is_stray(Generation generation, const std::string& message, const std::string& type);
  void socket_ended(Generation generation, const WebSocketEnd& end);

  // The activities.
  bool attempt_at(std::optional<Instant> due, Generation generation);
  void attempt(Generation generation);
  void open_websocket(Generation generation);
  void stream(Generation generation);
  void poll(Generation generation);
  void subscribe(Generation generation);
  void check_subscription(Generation generation);
  void delete_subscription(std::string url) noexcept;
  bool again(Generation generation, void (Impl::*next)());

  std::string with_policy(std::string url, bool heartbeats = false) const;
  std::string accept() const {
    const std::lock_guard lock(mutex_);
    return types_[type_];
  }
  std::vector<std::pair<std::string, std::string>> request_fields(const http::Url& url, std::string accept) const;
  bool find_websocket_url();
  std::string find_container() const;
  bool is_current(Generation generation) const {
    const std::lock_guard lock(mutex_);
    return !stopped_ && generation == generation_;
  }
  void release_activity(Lock& lock) noexcept;
  void post(Lock& lock, Change change);
  Change change(Change::Kind kind) const {
    Change made;
    made.kind = kind;
    made.url = url_;
    made.received = std::chrono::steady_clock::now();
    made.max_triples = context_->options().limits.max_triples;
    return made;
  }
  void next_type() { ++type_; }
  void next_step() { ++step_, type_ = 0; }
  void same_step() {}

  const std::shared_ptr<WatchContext> context_;
  const std::string url_;
  const http::Url parsed_;
  const WatchOptions options_;
  const Delivery delivery_;
  const std::vector<std::string> types_;
  const std::vector<Via> steps_;

  std::atomic<bool> connected_{false};
  std::atomic<Via> via_{Via::any};

  mutable std::mutex mutex_;  // not held while a callback runs; locks of the context, its Tasks and WebSockets may be taken under it
  std::condition_variable idle_;
  OnChange on_change_;
  std::deque<Change> queue_;
  bool stopped_ = false, ended_ = false;
  bool draining_ = false;  ///< a thread is in drain()
  bool announced_ = false;
  std::thread::id drainer_;
  Counts counts_;
  std::string subscription_;
  std::optional<Error> last_error_;

  // The activity.
  Generation generation_ = 1;
  std::size_t step_ = 0, type_ = 0;
  unsigned failures_ = 0;             ///< since the last value
  bool has_value_ = false;            ///< of this connection
  unsigned empty_ = 0;                ///< connections in a row that opened and ended without a value, before the first one
  std::optional<Change> gap_;         ///< of this connection: reported with its first value, when its number of values is known
  Stamp last_;                        ///< of the last value
  std::optional<Instant> last_word_;  ///< of the server, by the clock of the context
  bool beats_ = false;                ///< it has sent a heartbeat
  bool silent_ = false;               ///< Change::Kind::silent was reported
  bool checks_silence_ = false;       ///< a task will
  bool offers_stamps_ = true;
  bool asked_graph_ = false, asked_token_ = false;
  std::optional<Instant> not_found_since_;
  std::string websocket_url_;
  std::uint64_t websocket_ = 0;
  std::shared_ptr<EventWaker> stream_end_;
  std::string callback_;   ///< URL
  std::string deletable_;  ///< subscription to be deleted at the end
  Instant last_notification_{};
  std::string poll_tag_;
  std::shared_ptr<const std::string> poll_body_;
};

// ------------------------------------------------------------------------------------------------------ handing over

void WatchContext::announce(const std::shared_ptr<Watch::Impl>& watch) {
  bool starts = false;
  {
    const std::lock_guard lock(mutex);
    ready.push_back(watch);
    starts = options().callbacks == Callbacks::in_background && !std::exchange(is_draining, true);
  }
  if (options().callbacks == Callbacks::in_poll) {
    if (hooks.wake) hooks.wake();
  } else if (starts && !tasks.run([self = shared_from_this()] { self->drain_in_background(); })) {
    const std::lock_guard lock(mutex);
    is_draining = false;
  }
}

void WatchContext::drain_in_background() {
  while (true) {
    drain(std::chrono::milliseconds(100));
    const std::lock_guard lock(mutex);
    if (!ready.empty() && !stopped) continue;
    is_draining = false;
    return;
  }
}

bool WatchContext::drain(std::chrono::microseconds budget) noexcept {
  const Instant until = std::chrono::steady_clock::now() + budget;
  while (true) {
    std::shared_ptr<Watch::Impl> watch;
    {
      const std::lock_guard lock(mutex);
      if (ready.empty()) return false;
      watch = ready.front().lock();
      ready.pop_front();
    }
    const bool has_more = watch && watch->drain(until);
    const std::lock_guard lock(mutex);
    if (has_more) ready.push_back(watch);
    if (std::chrono::steady_clock::now() >= until) return !ready.empty();
  }
}

/// Under the lock, which is released.
void Watch::Impl::post(Lock& lock, Change made) {
  if (stopped_ || ended_) return;
  const std::size_t max = std::max<std::size_t>(context_->options().limits.max_waiting_changes, 1);
  if (made.kind == Change::Kind::ended) ended_ = true;
  queue_.push_back(std::move(made));
  if (queue_.size() > max) {
    const auto is_value = [](const Change& c) { return c.kind == Change::Kind::value; };
    const auto oldest = std::find_if(queue_.begin(), queue_.end(), is_value);
    if (oldest != queue_.end()) {
      const std::uint64_t dropped = oldest->dropped + 1;
      const std::optional<std::uint64_t> left_out = oldest->left_out;
      ++counts_.dropped;
      const auto after = queue_.erase(oldest);
      if (const auto next = std::find_if(after, queue_.end(), is_value); next != queue_.end()) {
        next->dropped += dropped;
        if (next->left_out) next->left_out = sum(next->left_out, left_out);
      }
      if (after != queue_.begin() && after != queue_.end() && after->kind == Change::Kind::gap && std::prev(after)->kind == Change::Kind::gap) {
        merge_gap(*std::prev(after), *after);
        queue_.erase(after);
      }
    }
  }
  if (delivery_ == Delivery::at_once) {
    lock.unlock();
    drain(std::nullopt);
    return;
  }
  if (draining_ || std::exchange(announced_, true)) return;  // who drains looks again
  lock.unlock();
  context_->announce(shared_from_this());
}

bool Watch::Impl::drain(std::optional<Instant> until) noexcept {
  OnChange garbage;  // destroyed without the lock
  Lock lock(mutex_);
  announced_ = false;
  if (draining_) return false;  // who drains looks again
  draining_ = true;
  drainer_ = std::this_thread::get_id();
  bool is_first = true;
  while (!stopped_ && !queue_.empty() && (is_first || !until || std::chrono::steady_clock::now() < *until)) {
    is_first = false;
    Change change = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    try {
      if (on_change_) on_change_(change);
    } catch (const std::exception& thrown) {
      context_->log(LogLevel::warning, "the callback of a watch threw an exception: " + std::string(thrown.what()));
    } catch (...) { context_->log(LogLevel::warning, "the callback of a watch threw an exception that is not a std::exception"); }
    lock.lock();
  }
  draining_ = false;
  drainer_ = std::thread::id();
  if (stopped_) garbage = std::exchange(on_change_, nullptr);
  const bool has_more = !stopped_ && !queue_.empty();
  if (has_more) announced_ = true;
  idle_.notify_all();
  lock.unlock();
  return has_more;
}

// ----------------------------------------------------------------------------------------------- what activities report

void Watch::Impl::connected(Generation generation, std::string subscription) {
  Lock lock(mutex_);
  if (stopped_ || generation != generation_) return;
  subscription_ = std::move(subscription);
  connect();
}

/// Under the lock.
void Watch::Impl::connect() {
  if (connected_.exchange(true, std::memory_order_acq_rel)) return;
  via_ = steps_[step_];
  has_value_ = false;
  not_found_since_.reset();
  asked_token_ = false;
  std::optional<Error> why = std::exchange(last_error_, std::nullopt);
  if (counts_.values == 0 || gap_) return;
  gap_ = change(Change::Kind::gap);
  gap_->reason = std::move(why);
}

/// Under the lock.
void Watch::Impl::add_gap(Change gap) {
  ++counts_.gaps;
  if (!queue_.empty() && queue_.back().kind == Change::Kind::gap) merge_gap(queue_.back(), gap);
  else queue_.push_back(std::move(gap));
}

/// Under the lock. Adds a gap before the value if there is one.
void Watch::Impl::count_left_out(Change& value, const Stamp& stamp) {
  value.left_out = stamp.left_out;
  if (gap_) {
    gap_->left_out = between(last_, stamp);
    if (gap_->left_out) value.left_out = 0;  // what the new subscription has left out is among them
    counts_.left_out += gap_->left_out.value_or(0);
    add_gap(*std::exchange(gap_, std::nullopt));
  }
  counts_.left_out += value.left_out.value_or(0);
  if (options_.queue_length > 0 && value.left_out.value_or(0) > 0) {
    Change gap = change(Change::Kind::gap);
    gap.left_out = std::exchange(value.left_out, 0);
    add_gap(std::move(gap));
  }
  last_ = stamp;
}

void Watch::Impl::value(Generation generation, std::string body, std::string type, std::string entity_tag, const Stamp& stamp) {
  Change made = change(Change::Kind::value);
  made.media_type = std::move(type);
  made.entity_tag = std::move(entity_tag);
  made.body = std::make_shared<const std::string>(std::move(body));
  made.at = stamp.at;
  made.sequence = stamp.sequence;
  made.series = stamp.series;
  Lock lock(mutex_);
  if (stopped_ || generation != generation_) return;
  connect();  // the first notification of a callback may precede the response to its subscription
  count_left_out(made, stamp);
  has_value_ = true;
  failures_ = 0;
  ++counts_.values;
  silent_ = false;  // the value says it
  word(lock);
  post(lock, std::move(made));
}

void Watch::Impl::heartbeat(Generation generation, const std::string& stamp) {
  context_->http->robot_times().heard(parsed_.origin(), parsed_.target, stamp, std::chrono::steady_clock::now());
  Lock lock(mutex_);
  if (stopped_ || generation != generation_) return;
  beats_ = true;
  word(lock);
}

/// The server has said something. Under the lock, which may be released.
void Watch::Impl::word(Lock& lock) {
  last_word_ = context_->clock.now().steady;
  if (!beats_ || ended_) return;
  const bool was_silent = std::exchange(silent_, false);
  if (!std::exchange(checks_silence_, true)) listen(lock);
  if (was_silent && lock.owns_lock()) post(lock, change(Change::Kind::heard));
}

/// Checks after the time of silence. Under the lock.
void Watch::Impl::listen(Lock&) {
  checks_silence_ = context_->tasks.run_at(*last_word_ + options_.silence, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->check_silence();
  });
}

void Watch::Impl::check_silence() {
  Lock lock(mutex_);
  if (stopped_ || ended_) return;
  if (context_->clock.now().steady < *last_word_ + options_.silence) return listen(lock);
  checks_silence_ = false;
  silent_ = true;
  Change made = change(Change::Kind::silent);
  made.reason = Error{Errc::timed_out, "\"" + url_ + "\": no word for " + seconds_of(options_.silence) + " s"};
  post(lock, std::move(made));
}

void Watch::Impl::lost(Generation generation, Error error, milliseconds min_pause) {
  const double chance = context_->random();
  Instant due{};
  Generation next = 0;
  {
    Lock lock(mutex_);
    if (stopped_ || generation != generation_) return;
    const bool was_connected = connected_.exchange(false, std::memory_order_acq_rel);
    if (was_connected && counts_.values == 0 && ++empty_ >= max_empty && step_ + 1 < steps_.size()) next_step(), empty_ = 0;
    next = ++generation_;
    subscription_.clear();
    last_error_ = std::move(error);
    const auto pause = back_off(++failures_, std::max(options_.first_pause, milliseconds(1)), options_.max_pause, chance);
    due = context_->clock.now().steady + std::max<std::chrono::microseconds>(pause, std::min(min_pause, options_.max_pause));
    release_activity(lock);
  }
  attempt_at(due, next);
}

/// May block.
void Watch::Impl::refused(Generation generation, int status, Error error, std::optional<std::chrono::seconds> pause) {
  enum class Next { retry, type, step, end } next = Next::end;
  Via via = Via::any;
  bool may_ask_token = false, may_ask_graph = false, has_offered = false;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_) return;
    via = steps_[step_];
    has_offered = via == Via::websocket && status == 400 && std::exchange(offers_stamps_, false);  // some servers refuse each subprotocol
    if (is_temporary(status)) next = Next::retry;
    else if (status == 404 && counts_.values > 0) {
      const Instant now = context_->clock.now().steady;
      if (!not_found_since_) not_found_since_ = now;
      next = now - *not_found_since_ < options_.max_pause ? Next::retry : Next::end;
    } else if (status == 0 && counts_.values > 0) next = Next::retry;
    else if (status == 406 && type_ + 1 < types_.size() && via != Via::polling) next = Next::type;
    else if (step_ + 1 < steps_.size()) next = Next::step;
    const bool is_final = !has_offered && (next == Next::step || next == Next::end);
    may_ask_token = is_final && status == 401 && via != Via::polling && !std::exchange(asked_token_, true);
    may_ask_graph = is_final && via == Via::websocket && websocket_url_.empty() && status != 401 && status != 403 && status != 404 && status != 410 &&
                    !std::exchange(asked_graph_, true);
  }
  if (has_offered) return void(again(generation, &Impl::same_step));
  if (next == Next::retry) return lost(generation, std::move(error), pause ? milliseconds(*pause) : milliseconds(0));
  if (next == Next::type) return void(again(generation, &Impl::next_type));
  if (may_ask_graph && find_websocket_url()) return void(again(generation, &Impl::same_step));
  if (may_ask_token || (next == Next::end && via == Via::websocket && status != 0)) {  // the body of a WebSocket's refusal is not read
    const Result<Response> response = context_->http->send({"GET", url_, {{"Accept", context_->options().accept}}, {}});
    if (response && response->ok() && may_ask_token) return void(again(generation, &Impl::same_step));  // a new token
    if (response && response->status == status) error = response_error(*response, url_);
  }
  if (next == Next::step) return void(again(generation, &Impl::next_step));
  end(generation, std::move(error));
}

void Watch::Impl::end(Generation generation, Error error) {
  Lock lock(mutex_);
  if (stopped_ || generation != generation_) return;
  ++generation_;
  connected_.store(false, std::memory_order_release);
  release_activity(lock);
  if (stopped_ || ended_) return;
  last_error_ = error;
  if (gap_) add_gap(*std::exchange(gap_, std::nullopt));
  Change made = change(Change::Kind::ended);
  made.reason = std::move(error);
  post(lock, std::move(made));
}

/// Releases the socket, stream or callback of the activity. @pre the lock is held; it is released meanwhile.
void Watch::Impl::release_activity(Lock& lock) noexcept {
  const std::uint64_t socket = std::exchange(websocket_, 0);
  const std::shared_ptr<EventWaker> stream_end = std::exchange(stream_end_, nullptr);
  std::string callback = std::exchange(callback_, {}), deletable = std::exchange(deletable_, {});
  poll_tag_.clear();
  poll_body_.reset();
  lock.unlock();
  try {
    if (socket != 0) context_->websockets.close(socket);
    if (stream_end) stream_end->wake();
    if (!callback.empty()) options_.receiver->remove(callback);
    if (!deletable.empty()) delete_subscription(std::move(deletable));
  } catch (...) {}  // out of memory
  lock.lock();
}

// --------------------------------------------------------------------------------------------------------- the activities

bool Watch::Impl::attempt_at(std::optional<Instant> due, Generation generation) {
  auto task = [weak = weak_from_this(), generation] {
    if (const auto self = weak.lock()) self->attempt(generation);
  };
  Via via = Via::any;
  {
    const std::lock_guard lock(mutex_);
    via = steps_[step_];
  }
  Tasks& tasks = via == Via::event_stream || via == Via::polling ? context_->stream_tasks : context_->tasks;
  return due ? tasks.run_at(*due, std::move(task)) : tasks.run(std::move(task));
}

/// The activity continues with its next step, at once.
bool Watch::Impl::again(Generation generation, void (Impl::*next)()) {
  std::uint64_t socket = 0;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_) return false;
    generation = ++generation_;
    connected_.store(false, std::memory_order_release);  // a WebSocket may be open for a moment before its refusal
    (this->*next)();
    socket = std::exchange(websocket_, 0);
  }
  if (socket != 0) context_->websockets.close(socket);  // it is still open if it has sent what is no representation
  return attempt_at(std::nullopt, generation);
}

void Watch::Impl::attempt(Generation generation) {
  Via via = Via::any;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_) return;
    via = steps_[step_];
  }
  try {
    switch (via) {
      case Via::any: break;
      case Via::websocket: open_websocket(generation); break;
      case Via::event_stream: stream(generation); break;
      case Via::polling: poll(generation); break;
      case Via::callback: subscribe(generation); break;
    }
  } catch (const std::exception& thrown) {  // std::bad_alloc
    lost(generation, {Errc::failed, thrown.what()});
  }
}

/// Sends the identity to the origin of the resource only, not to the targets of redirects or hybrit:websocketUrl.
std::vector<std::pair<std::string, std::string>> Watch::Impl::request_fields(const http::Url& url, std::string accept) const {
  std::vector<std::pair<std::string, std::string>> fields{{"Accept", std::move(accept)}};
  if (url.origin() != parsed_.origin()) return fields;
  for (auto& field : context_->http->identity_fields(url)) fields.push_back(std::move(field));
  return fields;
}

/// The URL with what the subscription asks for.
std::string Watch::Impl::with_policy(std::string url, bool heartbeats) const {
  url.resize(std::min(url.find('#'), url.size()));
  const auto add = [&](const std::string& text) { url += (url.find('?') == std::string::npos ? "?" : "&") + text; };
  if (options_.minimum_interval.count() > 0) add("minimumInterval=" + seconds_of(options_.minimum_interval));
  if (options_.queue_length > 0) add("queueLength=" + std::to_string(options_.queue_length));
  if (heartbeats && options_.heartbeat.count() > 0) add("heartbeat=" + seconds_of(options_.heartbeat));
  return url;
}

// .................................................................................................... WebSocket

struct LRT_LOCAL Watch::Impl::SocketEvents final : WebSocketEvents {
  SocketEvents(std::weak_ptr<Impl> owner, Generation number, std::string type, std::string base_url)
      : watch(std::move(owner)), generation(number), media_type(std::move(type)), base(std::move(base_url)) {}
  void opened(std::string location, std::string protocol) override {
    is_stamped = protocol == http::stamped_protocol;
    const auto self = watch.lock();
    if (!self) return;
    const Result<std::string> url = location.empty() ? Result<std::string>(std::string()) : iri::resolve(base, location);
    self->connected(generation, url ? *url : std::string());
  }
  void received(std::string message) override {
    const auto self = watch.lock();
    if (!self) return;
    if (is_stamped && !stamp) {
      stamp = read_stamp(message);
      if (!stamp) {  // a heartbeat, or a message of a later version
        if (const std::string time = read_heartbeat(message); !time.empty()) self->heartbeat(generation, time);
        return;
      }
      if (stamp->series.empty()) stamp->series = series;
      series = stamp->series;
      return;
    }
    std::string type = apparent_type(message, media_type);
    if (self->is_stray(generation, message, type)) return;
    const Stamp of_this = std::exchange(stamp, std::nullopt).value_or(Stamp());
    self->value(generation, std::move(message), std::move(type), {}, of_this);
  }
  void ended(const WebSocketEnd& end) override {
    if (const auto self = watch.lock()) self->socket_ended(generation, end);
  }
  const std::weak_ptr<Impl> watch;
  const Generation generation;
  const std::string media_type, base;
  // Used by the thread of WebSockets.
  bool is_stamped = false;
  std::optional<Stamp> stamp;  ///< of the next message
  std::string series;          ///< the last one
};

void Watch::Impl::open_websocket(Generation generation) {
  std::string target;
  bool offers_stamps = false;
  {
    const std::lock_guard lock(mutex_);
    target = websocket_url_.empty() ? url_ : websocket_url_;
    offers_stamps = offers_stamps_;
  }
  target = with_policy(std::move(target), offers_stamps);
  const Result<http::Url> url = http::parse_url(target);
  if (!url) return refused(generation, 0, {url.error().code, "hybrit:websocketUrl \"" + target + "\": " + url.error().message}, {});
  const Limits& limits = context_->options().limits;
  Result<std::vector<Address>> addresses =
      context_->names.find(url->host, {std::chrono::steady_clock::now() + limits.resolve_time, context_->http->stop_descriptor()});
  if (!addresses) return lost(generation, std::move(addresses).error());
  const std::string type = accept();
  auto events = std::make_shared<SocketEvents>(weak_from_this(), generation, type, target);
  WebSocketRequest request{*url, *std::move(addresses), request_fields(*url, type), options_.idle_time, context_->http->is_trusted(*url)};
  std::unique_lock lock(mutex_);
  if (stopped_ || generation != generation_) return;
  if (offers_stamps) request.protocol = http::stamped_protocol;
  // Under the lock: stop() then closes it.
  websocket_ = context_->websockets.open(std::move(request), std::move(events));
  if (websocket_ != 0) return;
  lock.unlock();
  lost(generation, {Errc::io_error, "no thread for WebSockets"});
}

/// With Via::any: the first message of a connection that is no representation is no sign of life, because the server speaks another protocol on its
/// WebSockets. The watch goes on with the next one of ours. Called on the thread of the WebSockets, which does not read large messages for this.
bool Watch::Impl::is_stray(Generation generation, const std::string& message, const std::string& type) {
  constexpr std::size_t longest = 64 * 1024;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_ || has_value_ || step_ + 1 == steps_.size()) return false;
  }
  if (message.size() > longest || !rdf::syntax_of(type)) return false;
  const Result<rdf::Graph> graph = graph_of(message, type, url_, context_->options().limits.max_triples);
  if (graph) return false;
  Error error{Errc::unsupported_syntax, "\"" + url_ + "\": a message of its WebSocket is not " + type + ": " + graph.error().message};
  context_->tasks.run([weak = weak_from_this(), generation, error = std::move(error)] {  // may block
    if (const auto self = weak.lock()) self->refused(generation, 0, error, {});
  });
  return true;
}

/// Called on the thread of the WebSockets.
void Watch::Impl::socket_ended(Generation generation, const WebSocketEnd& ended) {
  bool has_value = false, was_connected = false;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_) return;
    websocket_ = 0;
    has_value = has_value_;
    was_connected = counts_.values > 0;
  }
  int status = ended.status;
  // A server that can no longer refuse the handshake sends the reason in the close frame, as lrt did on libwebsockets.
  constexpr std::string_view prefix = "HTTP ";
  if (!has_value && ended.code != 0 && ended.reason.substr(0, prefix.size()) == prefix) {
    int found = 0;
    const char* const begin = ended.reason.data() + prefix.size();
    const auto parsed = std::from_chars(begin, ended.reason.data() + ended.reason.size(), found);
    if (parsed.ec == std::errc() && found >= 400 && found < 600) status = found;
  }
  const Errc code = ended.error.code;
  const bool cannot = code == Errc::unsupported_syntax || code == Errc::invalid_option || (code == Errc::expected_http && !was_connected);
  if (status != 0 || cannot) {  // what follows may block
    auto task = [weak = weak_from_this(), generation, status, ended] {
      if (const auto self = weak.lock()) self->refused(generation, status, ended.error, ended.retry_after);
    };
    context_->tasks.run(std::move(task));
    return;
  }
  if (code == Errc::limit_exceeded) return end(generation, ended.error);
  switch (ended.code) {
    case 1000:  // the subscription was deleted
    case 1003:
    case 1008:
    case 1010: return end(generation, ended.error);
    default: return lost(generation, ended.error);
  }
}

/// The URL that the graph of the resource names; false: none, or it is the one of the resource.
bool Watch::Impl::find_websocket_url() {
  const Result<Response> response = context_->http->send({"GET", url_, {{"Accept", context_->options().accept}}, {}});
  if (!response || !response->ok()) return false;
  const Result<rdf::Graph> graph = graph_of(response->body, response->media_type(), response->url, context_->options().limits.max_triples);
  if (!graph) return false;
  const std::optional<std::string> found = any_object(*graph, vocab::hybrit::websocketUrl);
  const Result<std::string> url = found ? iri::resolve(response->url, *found) : Result<std::string>(unexpected(Errc::expected_iri, ""));
  if (!url || as_http(*url) == url_) return false;
  const std::lock_guard lock(mutex_);
  websocket_url_ = as_http(*url);
  return true;
}

// .................................................................................................... event stream

void Watch::Impl::stream(Generation generation) {
  const Limits& limits = context_->options().limits;
  const StreamPlace place(context_->streams, limits.max_streams);
  if (!place)
    return refused(generation, 0, {Errc::limit_exceeded, "more than " + std::to_string(limits.max_streams) + " event streams (Limits::max_streams)"},
                   {});
  const auto stop = std::make_shared<EventWaker>();
  if (stop->descriptor() < 0) return lost(generation, {Errc::io_error, "no event descriptor"});
  const std::string type = accept();
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_) return;
    stream_end_ = stop;
  }
  std::string target = with_policy(url_, true);
  if (type != "text/turtle") target += (target.find('?') == std::string::npos ? "?accept=" : "&accept=") + percent_encoded(type);

  EventParser parser(limits.max_message_bytes);
  bool is_stream = false, is_elsewhere = false;
  Stamp series;
  std::string body;
  exchange::Outcome outcome;
  exchange::Receiver receiver;
  receiver.header = [&](const exchange::Header& header) {
    body.clear();
    is_stream = header.status == 200 && essence(header.fields.find("Content-Type").value_or(std::string_view())) == "text/event-stream";
    context_->http->robot_times().heard(parsed_.origin(), parsed_.target, header.fields.find(http::robot_time_field),
                                        std::chrono::steady_clock::now());
    if (!is_stream) return header.status != 200;  // the body of a refusal has its reason
    const auto location = header.fields.find("Location");
    const Result<std::string> url = location ? iri::resolve(target, *location) : Result<std::string>(std::string());
    series.set_series(header.fields.find(http::series_field).value_or(std::string_view()));
    connected(generation, url ? *url : std::string());
    return true;
  };
  receiver.body = [&](std::string_view bytes) {
    if (!is_stream) return body.append(bytes.substr(0, max_reason_bytes - body.size())).size() < max_reason_bytes;
    return parser.parse(bytes, [&](StreamEvent&& event) {
      if (event.type == http::heartbeat_name) {
        heartbeat(generation, event.data);
      } else if (event.type == "message") {
        std::string found = apparent_type(event.data, type);
        event.stamp.series = series.series;
        value(generation, std::move(event.data), std::move(found), std::move(event.id), event.stamp);
      }
      return is_current(generation);
    });
  };
  Result<http::Url> url = http::parse_url(target);
  const auto until = std::chrono::steady_clock::now() + limits.response_time;  // for all redirects together
  for (unsigned redirects = 0;; ++redirects) {
    if (!url) return refused(generation, 0, {Errc::expected_iri, "\"" + target + "\": " + url.error().message}, {});
    exchange::WaitLimit limit{until, stop->descriptor()};
    Result<std::unique_ptr<exchange::Wire>> wire = context_->http->connect(*url, limit, is_elsewhere);
    if (!wire) return lost(generation, std::move(wire).error());
    auto fields = request_fields(*url, "text/event-stream");
    if (is_elsewhere) fields.resize(1);  // Accept: no identity, also if it was sent back
    exchange::Request request{"GET", url->target, url->authority, {{"Cache-Control", "no-store"}}, {}};
    for (const auto& [name, text] : fields) request.fields.push_back({name, text});
    limit.idle = options_.idle_time;
    outcome = exchange::exchange(**wire, request, {limits.max_header_bytes, std::nullopt}, limit, receiver);
    (*wire)->end();
    if (is_stream) break;
    Result<std::optional<exchange::Redirect>> next = exchange::redirect_of(outcome.header.status, outcome.header.fields, "GET", target);
    if (!next) return refused(generation, 0, std::move(next).error(), {});
    if (!*next) break;
    if (redirects >= limits.max_redirects) return refused(generation, 0, {Errc::limit_exceeded, "\"" + url_ + "\": too many redirects"}, {});
    is_elsewhere = is_elsewhere || (*next)->leaves_origin;
    target = std::move((*next)->url);
    url = std::move((*next)->parts);
  }
  if (is_stream) {
    if (parser.is_too_long())
      return end(generation,
                 {Errc::limit_exceeded, "\"" + url_ + "\": an event is longer than " + std::to_string(limits.max_message_bytes) + " bytes"});
    const bool complete = outcome.header.status != 0;
    return lost(generation,
                {complete ? Errc::closed : outcome.code, "\"" + url_ + "\": " + (complete ? "the server has ended the event stream" : outcome.error)},
                parser.retry().value_or(milliseconds(0)));
  }
  if (outcome.header.status == 204) return end(generation, {Errc::closed, "\"" + url_ + "\": the server has nothing more to send (204)"});
  if (outcome.header.status != 0) {
    const Response response{outcome.header.status, outcome.header.fields, std::move(body), target};
    const Error error =
        response.status == 200 ? Error{Errc::refused, "\"" + url_ + "\": the server does not support event streams"} : response_error(response, url_);
    return refused(generation, response.status, error, retry_after(response.fields));
  }
  if (outcome.code == Errc::cancelled)
    return refused(generation, 200, {Errc::refused, "\"" + url_ + "\": the server does not support event streams"}, {});
  lost(generation, {outcome.code, "\"" + url_ + "\": " + outcome.error});
}

// .................................................................................................... polling

void Watch::Impl::poll(Generation generation) {
  Request request{"GET", url_, {{"Accept", options_.accept.empty() ? context_->options().accept : options_.accept}}, {}};
  {
    const std::lock_guard lock(mutex_);
    if (!poll_tag_.empty()) request.fields.emplace_back("If-None-Match", poll_tag_);
  }
  Result<Response> response = context_->http->send(request);
  if (!response) return lost(generation, std::move(response).error());
  if (response->status != 200 && response->status != 304) {
    return refused(generation, response->status, response_error(*response, url_), retry_after(response->fields));
  }
  bool is_new = false;
  std::string tag(response->fields.find("ETag").value_or(std::string_view()));
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_) return;
    is_new = response->status == 200 && !(poll_body_ && *poll_body_ == response->body);
    if (response->status == 200) poll_tag_ = tag;
    if (is_new) poll_body_ = std::make_shared<const std::string>(response->body);
  }
  if (!is_connected()) connected(generation, {});
  if (is_new) {
    std::string type = response->media_type();
    value(generation, std::move(response->body), std::move(type), std::move(tag));
  } else {
    const std::lock_guard lock(mutex_);
    failures_ = 0;
    last_word_ = context_->clock.now().steady;
  }
  attempt_at(context_->clock.now().steady + std::max({options_.poll_period, options_.minimum_interval, milliseconds(1)}), generation);
}

// .................................................................................................... web callback

void Watch::Impl::subscribe(Generation generation) {
  const std::string type = accept();
  const auto take = [weak = weak_from_this(), generation](const CallbackReceiver::Notification& notification) {
    const auto self = weak.lock();
    if (!self) return;
    {
      const std::lock_guard lock(self->mutex_);
      self->last_notification_ = self->context_->clock.now().steady;
    }
    Stamp stamp;
    stamp.set_at(notification.time);
    stamp.set_sequence(notification.sequence);
    stamp.set_left_out(notification.left_out);
    if (stamp.sequence && notification.left_out.empty()) stamp.left_out = 0;
    stamp.set_series(notification.series);
    self->value(generation, std::string(notification.body), essence(notification.content_type), std::string(notification.entity_tag), stamp);
  };
  /// Makes the subscription; the URL by which the server names it.
  const auto request = [&](const std::string& container) -> Result<Response> {
    const std::string secret = container.empty() ? std::string() : random_hex(16);
    Result<std::string> callback = options_.receiver->add(secret, take);
    if (!callback) return unexpected(std::move(callback).error());
    {
      const std::lock_guard lock(mutex_);
      if (!callback_.empty()) options_.receiver->remove(callback_);
      callback_ = *callback;
    }
    if (container.empty())
      return context_->http->send({"GET", with_policy(url_), {{"Accept", type}, {"Upgrade", "callback"}, {"Callback", *callback}}, {}});
    const auto iri_of = [](Iri iri) { return "<" + std::string(iri.text) + ">"; };
    std::string body = "<> a " + iri_of(vocab::hybrit::Subscription) + ", " + iri_of(vocab::hybrit::WebCallback) + " ;\n " +
                       iri_of(vocab::hybrit::onResource) + " <" + url_.substr(0, url_.find('#')) + "> ;\n " + iri_of(vocab::hybrit::callbackURL) +
                       " " + json_string(*callback) + "^^" + iri_of(vocab::xsd::anyURI) + " ;\n " + iri_of(vocab::lrt_::secret) + " " +
                       json_string(secret) + " ;\n " + iri_of(vocab::hybrit::mediaType) + " " + json_string(type);
    if (options_.minimum_interval.count() > 0)
      body += " ;\n " + iri_of(vocab::lrt_::minimumInterval) + " " + json_string(seconds_of(options_.minimum_interval)) + "^^" +
              iri_of(vocab::xsd::decimal);
    if (options_.queue_length > 0) body += " ;\n " + iri_of(vocab::lrt_::queueLength) + " " + std::to_string(options_.queue_length);
    return context_->http->send({"POST", container, {{"Content-Type", "text/turtle"}, {"Accept", "text/turtle"}}, body + " .\n", milliseconds(0)});
  };
  const auto made_one = [&](const Result<Response>& response) {
    if (!response || !response->ok()) return false;
    if (response->status == 201) return true;
    // A server of the paper's authors responds with 200 and the description. One that ignores Upgrade responds with 200 and the resource.
    const Result<rdf::Graph> graph = graph_of(response->body, response->media_type(), response->url, context_->options().limits.max_triples);
    std::string callback;
    {
      const std::lock_guard lock(mutex_);
      callback = callback_;
    }
    if (!graph) return false;
    const auto triples = graph->triples();
    return std::any_of(triples.begin(), triples.end(), [&](const rdf::Triple& t) { return graph->term(t.object).text == callback; });
  };
  std::string container = options_.subscriptions_url;
  Result<Response> response = request(container);
  bool is_made = made_one(response);
  if (!is_made && container.empty() && response && response->status != 401 && response->status != 404 && response->status != 410 &&
      !is_temporary(response->status)) {
    // A server or proxy between may not pass Upgrade on (SPEC 3.5).
    container = find_container();
    if (!container.empty()) {
      response = request(container);
      is_made = made_one(response);
    }
  }
  if (!response) {
    const Error& error = response.error();
    return error.code == Errc::limit_exceeded || error.code == Errc::closed ? end(generation, error) : lost(generation, error);
  }
  if (!is_made) {
    Error error =
        response->ok() ? Error{Errc::refused, "\"" + url_ + "\": the server does not support web callbacks"} : response_error(*response, url_);
    std::string callback;
    {
      const std::lock_guard lock(mutex_);
      callback = std::exchange(callback_, {});
    }
    if (!callback.empty()) options_.receiver->remove(callback);
    return refused(generation, response->ok() ? 501 : response->status, std::move(error), retry_after(response->fields));
  }
  std::string subscription(response->fields.find("Location").value_or(std::string_view()));
  if (subscription.empty() && response->status == 200) subscription = response->fields.find("Content-Location").value_or(std::string_view());
  const Result<std::string> resolved = subscription.empty() ? Result<std::string>(std::string()) : iri::resolve(response->url, subscription);
  // DELETE is sent to this origin only: another server must not choose what this program deletes.
  subscription = resolved && same_origin(*resolved, url_) ? *resolved : std::string();
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_) {
      if (!subscription.empty()) delete_subscription(subscription);
      return;
    }
    deletable_ = subscription;
    last_notification_ = context_->clock.now().steady;
  }
  connected(generation, subscription);
  check_subscription(generation);
}

/// After idle_time without a notification the subscription is checked: a restarted server may have lost it.
void Watch::Impl::check_subscription(Generation generation) {
  std::string subscription;
  Instant due{};
  const Instant now = context_->clock.now().steady;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || generation != generation_ || deletable_.empty()) return;
    subscription = deletable_;
    due = last_notification_ + options_.idle_time;
  }
  if (now >= due) {
    const Result<Response> response = context_->http->send({"GET", subscription, {{"Accept", context_->options().accept}}, {}});
    if (!response) return lost(generation, response.error());
    if (response->status == 404 || response->status == 410) {
      {
        const std::lock_guard lock(mutex_);
        if (generation == generation_) deletable_.clear();
      }
      return lost(generation, {Errc::closed, "\"" + subscription + "\": the server does not have the subscription any more"});
    }
    due = now + options_.idle_time;
  }
  context_->tasks.run_at(due, [weak = weak_from_this(), generation] {
    if (const auto self = weak.lock()) self->check_subscription(generation);
  });
}

/// `hybrit:subscriptions` of the Thing: of the resource itself, or of what its `up` links lead to. Empty: not found.
std::string Watch::Impl::find_container() const {
  std::string url = url_;
  for (unsigned depth = 0; depth < 4; ++depth) {
    const Result<Response> response = context_->http->send({"GET", url, {{"Accept", context_->options().accept}}, {}});
    if (!response || !response->ok()) return {};
    const Result<rdf::Graph> graph = graph_of(response->body, response->media_type(), response->url, context_->options().limits.max_triples);
    if (const auto found = graph ? any_object(*graph, vocab::hybrit::subscriptions) : std::nullopt) {
      const Result<std::string> resolved = iri::resolve(response->url, *found);
      return resolved && same_origin(*resolved, url_) ? *resolved : std::string();
    }
    const std::vector<Link> all = links(response->fields, response->url);
    const auto up = std::find_if(all.begin(), all.end(), [](const Link& link) { return link.relation == "up"; });
    if (up == all.end() || !same_origin(up->target, url_)) return {};
    url = up->target;
  }
  return {};
}

/// On a thread of the client. Failures have no consequence: the receiver responds with 410 from now on.
void Watch::Impl::delete_subscription(std::string url) noexcept {
  try {
    const auto context = context_;
    {
      const std::lock_guard lock(context->mutex);
      ++context->deletions;
    }
    const auto done = [](WatchContext& shared) {
      const std::lock_guard lock(shared.mutex);
      --shared.deletions;
      shared.changed.notify_all();
    };
    const bool runs = context->tasks.run([weak = std::weak_ptr<WatchContext>(context), url = std::move(url), done] {
      const auto shared = weak.lock();
      if (!shared) return;
      const Result<Response> response = shared->http->send({"DELETE", url, {}, {}, milliseconds(0)});
      if (!response) shared->log(LogLevel::info, "a subscription could not be deleted: " + response.error().message);
      done(*shared);
    });
    if (!runs) done(*context);
  } catch (...) {}
}

void Watch::Impl::stop() noexcept {
  OnChange garbage;
  std::deque<Change> changes;
  Lock lock(mutex_);
  stopped_ = true;
  ++generation_;
  connected_.store(false, std::memory_order_release);
  changes.swap(queue_);
  release_activity(lock);
  if (draining_ && drainer_ == std::this_thread::get_id()) return;  // drain() destroys the callback
  idle_.wait(lock, [this] { return !draining_; });
  garbage = std::exchange(on_change_, nullptr);
  lock.unlock();
}

// ------------------------------------------------------------------------------------------------------------- the handle

Watch::Watch() noexcept = default;
Watch::Watch(std::shared_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Watch::Watch(Watch&&) noexcept = default;
Watch& Watch::operator=(Watch&& other) noexcept {
  if (this != &other) {
    const std::shared_ptr<Impl> old = std::exchange(impl_, std::move(other.impl_));
    if (old) old->stop();
  }
  return *this;
}
Watch::~Watch() { stop(); }

void Watch::stop() noexcept {
  const std::shared_ptr<Impl> impl = impl_;
  if (impl) impl->stop();
}
bool Watch::is_connected() const noexcept { return impl_ && impl_->is_connected(); }
Via Watch::via() const noexcept { return impl_ ? impl_->via() : Via::any; }
std::string Watch::subscription() const { return impl_ ? impl_->subscription() : std::string(); }
std::optional<std::chrono::milliseconds> Watch::age() const noexcept { return impl_ ? impl_->age() : std::nullopt; }
Watch::Counts Watch::counts() const noexcept { return impl_ ? impl_->counts() : Counts{}; }
std::optional<Error> Watch::last_error() const { return impl_ ? impl_->last_error() : std::nullopt; }

Result<rdf::Graph> Change::graph() const {
  if (!body) return unexpected(Errc::expected_rdf, "\"" + url + "\": this change has no body");
  return graph_of(*body, media_type, url, max_triples);
}

// ----------------------------------------------------------------------------------------------------------------- watches

Watches::Watches(std::shared_ptr<HttpClient> http) : Watches(std::move(http), Hooks()) {}
Watches::Watches(std::shared_ptr<HttpClient> http, Hooks hooks) : context_(std::make_shared<WatchContext>(std::move(http), std::move(hooks))) {}
Watches::~Watches() { stop(); }

Result<Watch> Watches::watch(std::string url, const WatchOptions& options, OnChange on_change, Delivery delivery) {
  url = as_http(std::move(url));
  Result<http::Url> parsed = http::parse_url(std::string_view(url).substr(0, url.find('#')));
  if (!parsed) return unexpected(parsed.error().code, "\"" + url + "\": " + parsed.error().message);
  url.resize(std::min(url.find('#'), url.size()));
  for (const auto& [time, name] : {std::pair{options.poll_period, "poll_period"},
                                   {options.first_pause, "first_pause"},
                                   {options.max_pause, "max_pause"},
                                   {options.idle_time, "idle_time"},
                                   {options.silence, "silence"}})
    if (time.count() <= 0) return unexpected(Errc::invalid_option, std::string(name) + " of a watch: expected more than 0");
  if (options.heartbeat.count() < 0) return unexpected(Errc::invalid_option, "heartbeat of a watch: expected 0 or more");
  if (options.minimum_interval.count() < 0) return unexpected(Errc::invalid_option, "minimum_interval of a watch: expected 0 or more");
  if (options.via == Via::callback && !options.receiver) return unexpected(Errc::invalid_option, "Via::callback needs WatchOptions::receiver");
  if (!options.subscriptions_url.empty() && !same_origin(options.subscriptions_url, url))
    return unexpected(Errc::invalid_option,
                      "subscriptions_url of a watch: expected the origin of \"" + url + "\", found \"" + options.subscriptions_url + "\"");
  auto impl = std::make_shared<Watch::Impl>(context_, url, *std::move(parsed), options, std::move(on_change), delivery);
  {
    const std::lock_guard lock(context_->mutex);
    if (context_->stopped) return unexpected(Errc::closed, "the client is stopped");
    context_->watches.remove_if([](const std::weak_ptr<Watch::Impl>& watch) { return watch.expired(); });
    context_->watches.push_back(impl);
  }
  if (!impl->start()) return unexpected(Errc::io_error, "no thread for a watch");
  return Watch(std::move(impl));
}

bool Watches::poll(std::chrono::microseconds budget) noexcept {
  const std::shared_ptr<WatchContext> context = context_;  // a callback may destroy the Watches
  return context->options().callbacks == Callbacks::in_poll && context->drain(budget);
}

void Watches::check_clock() noexcept {
  context_->tasks.check();
  context_->stream_tasks.check();
}

void Watches::stop() noexcept {
  const std::shared_ptr<WatchContext> context = context_;
  context->stopped = true;
  std::list<std::weak_ptr<Watch::Impl>> all;
  {
    const std::lock_guard lock(context->mutex);
    all.swap(context->watches);
  }
  for (const auto& weak : all)
    if (const auto watch = weak.lock()) watch->stop();
  {
    std::unique_lock lock(context->mutex);
    context->changed.wait_for(lock, max_delete_time, [&] { return context->deletions == 0; });
  }
  context->http->stop();
  context->websockets.stop();
  context->stream_tasks.stop();
  context->tasks.stop();
}

}  // namespace v0
}  // namespace lrt::client
