// SPDX-License-Identifier: Apache-2.0
#include "src/server/shared_engine.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "src/engine/access.hpp"
#include "src/model/spec.hpp"
#include "src/page/page.hpp"

namespace lrt {
namespace {

/// The time in which a round of messages for many clients is made.
constexpr std::chrono::microseconds round_time{100};
/// The longest scan for changes in one poll(). SubscriptionOptions::max_catch_up_time is for a thread of lrt.
constexpr std::chrono::microseconds scan_in_poll{500};
/// Requests that waited for the engine and are handled when a turn finds it free, before what the turn came for.
constexpr std::size_t postponed_at_once = 4;

/// nullptr: there are no tokens, so that no sessions are possible.
std::shared_ptr<security::Sessions> make_sessions(const Options& options) {
  const Security& security = options.security;
  const bool has_tokens = !security.token_file.empty() || security.authenticate;
  if (!has_tokens || security.sessions.life.count() <= 0) return nullptr;
  return std::make_shared<security::Sessions>(security.sessions, options.listen.public_base);
}

/// Finding the caller of a request, by this thread.
struct Search {
  Search(const SharedEngine& of, std::uint64_t at) noexcept : server(of), revision(at) { current = this; }
  ~Search() { current = outer; }
  Search(const Search&) = delete;
  Search& operator=(const Search&) = delete;

  static thread_local Search* current;
  Search* const outer = current;
  const SharedEngine& server;
  std::uint64_t revision;  ///< Caller::rights_revision
};
thread_local Search* Search::current = nullptr;

template <class Role>
void add_role(Role* role, std::vector<Role*>& all) {
  if (role) all.push_back(role);
}

}  // namespace

SharedEngine::SharedEngine(const Options& options, Loop& loop)
    : options_(options),
      clock_(options.clock ? *options.clock : system_clock()),
      loop_(loop),
      log_(options.log),
      lock_([&loop] { loop.wake_io(); }),
      sessions_(make_sessions(options)),
      engine_(engine_options()),
      scoped_(std::make_shared<Scoped>()) {
  scoped_->engine = this;
  services_ = make_services(*this);
  for (const auto& service : services_) {
    add_role(service->turn_work(), turn_works_);
    add_role(service->receiver(), receivers_);
    add_role(service->observer(), observers_);
    add_role(service->keeper(), keepers_);
  }
}

SharedEngine::~SharedEngine() { clear(); }

void SharedEngine::clear() {
  {
    const std::lock_guard lock(scoped_->mutex);
    scoped_->engine = nullptr;
  }
  while (!services_.empty()) services_.pop_back();  // write what is pending
  log_.flush();
}

engine::EngineOptions SharedEngine::engine_options() {
  engine::EngineOptions options;
  static_cast<engine::Limits&>(options) = options_.limits;
  static_cast<engine::RequestRules&>(options) = options_.security;
  static_cast<engine::CommonOptions&>(options) = options_;
  options.callbacks = options_.callbacks;
  options.public_base = options_.listen.public_base;
  options.dispatch = options_.threads.dispatch;
  if (options_.threads.io == Io::in_poll) options.subscriptions.max_catch_up_time = std::min(options.subscriptions.max_catch_up_time, scan_in_poll);
  options.has_executor = static_cast<bool>(options_.threads.executor);
  options.everybody_reads = !options_.security.authorize;
  if (!options_.security.rules.empty() || !options_.security.policy_file.empty())
    options.rules_around = [this](std::string_view path) { return callers_->rules_around(path); };
  options.renew = [this](const security::Principal* owner) { return callers_ ? callers_->renew(owner) : engine::Caller(); };
  options.sessions = sessions_;
  options.body_jobs = options_.threads.body_threads > 0;
  options.reports_subscriptions = options_.security.audit.sink || options_.security.audit.file;
  options.saves_callbacks = !options_.callbacks.file.empty();
  if (options.saves_callbacks && options_.callbacks.respond_when_saved) options.save_timeout = options_.callbacks.save_timeout;
  options.log = log_.sink();
  if (!options.page) options.page = page::console();
  return options;
}

// ------------------------------------------------------------------------------------------------------ Set-up and end

Result<void> SharedEngine::prepare() {
  if (Result<void> checked = engine_.check(); !checked) return checked;
  if (Result<void> checked = ClientLimiter::check(options_.security.clients); !checked) return checked;
  limiter_.emplace(options_.security.clients);
  auto callers = Callers::create(options_.security, sessions_, waking_log(), clock_);
  if (!callers) return Unexpected{std::move(callers).error()};
  callers_ = *std::move(callers);
  for (const auto& service : services_)
    if (Result<void> prepared = service->prepare(); !prepared) return prepared;
  return {};
}

Result<void> SharedEngine::start() {
  for (const auto& service : services_)
    if (Result<void> started = service->start(); !started) return started;
  return {};
}

void SharedEngine::begin_stop() noexcept {
  stopping_ = true;
  loop_.wake_host();
  loop_.wake_io();
  const std::lock_guard lock(lock_);
  for (const auto& service : services_) service->wake_all();
}

void SharedEngine::finish() {
  for (const auto& service : services_) service->stop();
  const std::lock_guard lock(lock_);
  report_ends(postponed_.take_ends());
  try {
    collect_replies(clock_.now());
  } catch (const std::exception& e) { log(LogLevel::error, "responses are lost at the end", e); }
  for (const auto& service : services_) service->wake_all();
}

void SharedEngine::join() noexcept {
  for (const auto& service : services_) service->join();
  log_.flush();
}

bool SharedEngine::is_service_thread() noexcept {
  return std::any_of(services_.begin(), services_.end(), [](const auto& service) { return service->is_current_thread(); });
}

Result<void> SharedEngine::check_open() const {
  if (!is_own_process()) return unexpected(Errc::closed, "the server was created by the parent process and cannot be used after fork()");
  return stopping_ ? unexpected(Errc::closed, "the server has stopped") : Result<void>();
}

// ------------------------------------------------------------------------------------------------- What is handed out

/// Never throws, because a reply that was taken before must not be lost. What could not be taken for want of memory is taken the next time.
void SharedEngine::take() noexcept {
  try {
    if (!engine_.take_outputs(outputs_)) return;
  } catch (const std::exception& e) { log(LogLevel::error, "work could not be taken", e); } catch (...) {
  }
  has_outputs_ = true;
  for (const auto& service : services_) try {
      service->take(outputs_);
    } catch (const std::exception& e) { log(LogLevel::error, "work could not be passed on", e); } catch (...) {
    }
}

void SharedEngine::pass_on(std::unique_lock<EngineLock>& lock) {
  take();
  if (std::exchange(has_outputs_, false)) {
    engine::Outputs outputs = std::exchange(outputs_, {});
    lock.unlock();
    for (const auto& service : services_) try {
        service->pass_on(outputs);
      } catch (const std::exception& e) {  // what it did not take is not done, and who waits for it gets its response at the time limit
        log(LogLevel::error, "work could not be passed on", e);
      }
  } else {
    lock.unlock();
  }
  log_.flush();
}

void SharedEngine::close(engine::Channel channel) noexcept {
  engine_.closed(channel);
  take();
}

LogCallback SharedEngine::waking_log() {
  if (!options_.log) return {};
  return [this, sink = log_.sink()](LogLevel level, std::string_view message) {
    sink(level, message);
    loop_.wake_io();
  };
}

void SharedEngine::log(LogLevel level, const std::string& message) noexcept {
  try {
    if (const LogCallback sink = log_.sink()) sink(level, message);
  } catch (...) {}
}

void SharedEngine::log(LogLevel level, const char* what, const std::exception& why) noexcept {
  try {
    log(level, std::string(what) + ": " + why.what());
  } catch (...) {}
}

// ------------------------------------------------------------------------------------------------------------ Requests

Result<engine::Caller> SharedEngine::admit(const http::Request& request, bool has_body, TimePoint now) {
  Result<engine::Caller> caller =
      callers_ || request.judged ? engine::caller_of(request, [this](const http::Request& header) { return find_caller(header); }) : engine::Caller();
  if (!caller || request.judged) return caller;
  if (const auto pause = limiter_->count(*caller, request.peer, has_body, now); pause && !is_stop(request)) {
    caller->access = engine::Access::too_many_requests;
    caller->retry_after = *pause;
  } else if (!request.body.empty()) {
    limiter_->count_body(*caller, request.body.size(), now);
  }
  return caller;
}

/// Without the lock: rights may change meanwhile, and the principal be signed out.
engine::Caller SharedEngine::find_caller(const http::Request& header) {
  Search search(*this, engine_.rights_revision());
  engine::Caller caller = callers_->of(header);
  caller.rights_revision = search.revision;
  return caller;
}

engine::Outcome SharedEngine::handle(const http::Request& request, const Result<engine::Caller>& caller, TimePoint now) {
  engine::Outcome outcome = engine_.handle(request, caller, now);
  take();
  observe([&](RequestObserver& observer) { observer.handled(request, caller, outcome, now); });
  return outcome;
}

std::optional<engine::Reply> SharedEngine::take_reply(TimePoint now) {
  while (true) {
    std::optional<engine::Reply> reply = engine_.next_reply(now);
    take();
    bool is_kept = false;
    if (reply) observe([&](RequestObserver& observer) { is_kept = !observer.replied(*reply) || is_kept; });
    if (is_kept) continue;
    if (reply && postponed_.has_renamed()) postponed_.give_back_name(*reply);
    return reply;
  }
}

void SharedEngine::reply(engine::Reply reply) {
  if (postponed_.has_renamed()) postponed_.give_back_name(reply);
  if (!is_claimed(reply)) replies_.push_back(std::move(reply));
}

void SharedEngine::end_waits(TimePoint now) noexcept {
  observe([&](RequestObserver& observer) { observer.end_waits(now); });
}

void SharedEngine::collect_replies(TimePoint now) {
  while (std::optional<engine::Reply> reply = take_reply(now))
    if (!is_claimed(*reply)) replies_.push_back(*std::move(reply));
}

engine::HeaderVerdict SharedEngine::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint now) {
  const Result<engine::Caller> caller = admit(request, true, now);
  engine::HeaderVerdict verdict;
  const auto judge = [&] {
    verdict = engine_.judge_header(request, body_bytes, caller, now);
    if (verdict.response) observe([&](RequestObserver& observer) { observer.refused(request, caller, *verdict.response, now); });
  };
  if (!use_now(judge, now) && caller) {  // handle() judges all of it when the body is complete; of a caller that is refused no body is kept
    verdict.ignores_body = caller->access != engine::Access::granted;
    if (!verdict.ignores_body) verdict.judged = engine::judged_caller(*caller);
  }
  if (!verdict.response && caller)
    limiter_->count_body(*caller, std::min<std::uint64_t>(body_bytes.value_or(verdict.max_body_bytes), options_.limits.max_body_bytes), now);
  return verdict;
}

/// While another thread has the engine, each POST may be one: a stop is never refused for that.
bool SharedEngine::is_stop(const http::Request& request) noexcept {
  const auto lock = try_lock();
  return lock ? engine_.is_stop(request) : request.method == "POST";
}

engine::Outcome SharedEngine::handle(const http::Request& request, TimePoint now) {
  const Result<engine::Caller> caller = admit(request, now);
  std::unique_lock lock = enter(now);
  if (!lock) return postpone(request, caller);
  engine::Outcome outcome = handle(request, caller, now);
  pass_on(lock);
  return outcome;
}

/// Without the lock: only the transport's thread calls it.
const http::Fields* SharedEngine::common_fields(TimePoint now) { return engine_.common_fields(now); }

std::optional<engine::Reply> SharedEngine::next_reply(TimePoint now) {
  for (TurnWork* work : turn_works_) work->turn(now);
  std::optional<engine::Reply> reply;
  const auto find = [&] {
    if (postponed_.has_reply()) return;
    if (!replies_.empty()) {
      reply = std::move(replies_.front());
      replies_.pop_front();
      return;
    }
    do reply = take_reply(now);
    while (reply && is_claimed(*reply));
  };
  use_now(find, now);
  return reply ? std::move(reply) : postponed_.take_reply();
}

std::optional<std::chrono::steady_clock::time_point> SharedEngine::next_deadline() const {
  std::optional<std::chrono::steady_clock::time_point> first;
  for (const TurnWork* work : turn_works_)
    if (const auto due = work->next_deadline(); due && (!first || *due < *first)) first = due;
  if (postponed_.has_reply()) return std::chrono::steady_clock::time_point{};
  const auto lock = try_lock();
  if (!lock) return first;  // who has it wakes the transport
  if (!replies_.empty() || !postponed_.empty() || !not_asked_.empty()) return std::chrono::steady_clock::time_point{};
  const auto deadline = engine_.next_deadline();
  return first && (!deadline || *first < *deadline) ? first : deadline;
}

void SharedEngine::abandon(engine::Ticket ticket) noexcept {
  if (Postponed::is_own(ticket) && postponed_.forget(ticket)) return;
  end({Postponed::End::Kind::abandoned, number_of(ticket)}, [&] { abandon_in_engine(ticket); });
}

void SharedEngine::input_ended(engine::Ticket ticket) noexcept {
  end({Postponed::End::Kind::input_ended, number_of(ticket)}, [&] {
    if (!Postponed::is_own(ticket)) engine_.input_ended(ticket);
    else if (const auto real = postponed_.renamed(ticket)) engine_.input_ended(*real);
  });
}

/// @pre the lock is held
void SharedEngine::abandon_in_engine(engine::Ticket ticket) noexcept {
  if (Postponed::is_own(ticket)) {
    const auto real = postponed_.renamed(ticket);
    if (!real) return;  // its response is ready, and the transport drops it
    postponed_.forget_renamed(ticket);
    ticket = *real;
  }
  engine_.abandon(ticket);
  observe([&](RequestObserver& observer) { observer.abandoned(ticket); });
}

// ------------------------------------------------------------------------------------ While another thread has the engine

/// Inside poll() without waiting: the lock may be empty then.
std::unique_lock<EngineLock> SharedEngine::try_lock() const {
  return never_waits() ? std::unique_lock(lock_, std::try_to_lock) : std::unique_lock(lock_);
}

/// The same. Then comes first what was postponed.
std::unique_lock<EngineLock> SharedEngine::enter(TimePoint now) {
  std::unique_lock<EngineLock> lock = try_lock();
  if (lock && options_.threads.io == Io::in_poll && loop_.is_serving() && !postponed_.empty()) hand_over_postponed(now);
  return lock;
}

void SharedEngine::hand_over_postponed(TimePoint now) {
  report_ends(postponed_.take_ends());
  postponed_.hand_over(postponed_at_once, [&](Postponed::Request& waiting) { return hand_over(waiting, now); });
}

void SharedEngine::report_ends(const std::vector<Postponed::End>& ends) noexcept {
  using Kind = Postponed::End::Kind;
  for (const Postponed::End& end : ends) {
    if (end.kind == Kind::closed) close(engine::Channel{end.number});
    else if (end.kind == Kind::abandoned) abandon_in_engine(engine::Ticket{end.number});
    else if (const engine::Ticket ticket{end.number}; !Postponed::is_own(ticket)) engine_.input_ended(ticket);
    else if (const auto real = postponed_.renamed(ticket)) engine_.input_ended(*real);
  }
}

/// @return  whether its response is there; false: it will come with its ticket
bool SharedEngine::hand_over(Postponed::Request& waiting, TimePoint now) noexcept {
  engine::Reply& reply = waiting.reply;
  try {
    engine::Outcome outcome = handle(waiting.view(), waiting.caller, now);
    if (const auto* deferred = std::get_if<engine::Deferred>(&outcome)) {
      postponed_.rename(deferred->ticket, reply.ticket);
      return false;
    }
    if (auto* upgraded = std::get_if<engine::Upgraded>(&outcome)) {
      reply.response = std::move(upgraded->response);
      reply.response.status = 101;
      reply.channel = upgraded->channel;
    } else if (auto* streamed = std::get_if<engine::Streamed>(&outcome)) {
      reply.response = std::move(streamed->response);
      reply.channel = streamed->channel;
    } else {
      reply.response = std::get<http::Response>(std::move(outcome));
    }
  } catch (...) { reply.response = closed_response(); }  // no memory
  return true;
}

engine::Outcome SharedEngine::postpone(const http::Request& request, const Result<engine::Caller>& caller) {
  const bool cannot_wait = request.must_upgrade_now && request.find("Upgrade");
  if (!cannot_wait)
    if (const auto ticket = postponed_.add(request, caller, options_.limits)) return engine::Deferred{*ticket};
  http::Response response = closed_response();
  response.fields.add("Retry-After", "1");
  return response;
}

/// Does something about a request or a channel that has ended, or postpones it.
template <class F>
void SharedEngine::end(Postponed::End what, F f) noexcept {
  auto lock = try_lock();
  if (!lock) try {
      postponed_.add(what);
      return;
    } catch (const std::bad_alloc&) { lock.lock(); }  // an end must not be lost
  f();
}

// ------------------------------------------------------------------------------------------------------------ Messages

std::optional<engine::Channel> SharedEngine::next_ready(TimePoint now) {
  std::optional<engine::Channel> channel;
  const auto find = [&] {
    if (!not_asked_.empty()) {
      channel = not_asked_.back();
      not_asked_.pop_back();
      return;
    }
    do channel = engine_.next_ready(now);
    while (channel && is_claimed(*channel));
  };
  use_now(find, now);
  return channel;
}

std::optional<engine::Push> SharedEngine::next_push(engine::Channel channel, TimePoint now) {
  std::optional<engine::Push> push;
  if (!use_now([&] { push = engine_.next_push(channel, now); }, now)) not_asked_.push_back(channel);
  return push;
}

void SharedEngine::take_ready(std::vector<engine::ReadyChannel>& channels, TimePoint now) {
  const auto find = [&] {
    const std::size_t before = channels.size();
    engine_.take_ready(channels, now);
    channels.erase(std::remove_if(channels.begin() + static_cast<std::ptrdiff_t>(before), channels.end(),
                                  [&](engine::ReadyChannel& ready) { return is_claimed(ready.channel); }),
                   channels.end());
    for (const engine::Channel channel : std::exchange(not_asked_, {})) channels.push_back({channel});
  };
  use_now(find, now);
}

/// As engine::Handler does it, but messages that must be made for each client end the round when its time is over, after at least one.
void SharedEngine::take_pushes_for(std::chrono::microseconds time, std::vector<engine::PushRequest>& requests, std::vector<engine::Push>& pushes,
                                   TimePoint now) {
  const auto end = std::chrono::steady_clock::now() + time;
  const std::string* last = nullptr;
  bool is_over = false;
  for (engine::PushRequest& request : requests) {
    std::size_t bytes = 0;
    request.given = 0;
    request.more = true;
    while (!is_over && request.more && request.given < request.max && (request.given == 0 || bytes < request.max_bytes)) {
      if (pushes.size() == pushes.capacity()) pushes.reserve(2 * pushes.size() + 8);  // without room a message that was taken would be lost
      auto push = engine_.next_push(request.channel, now);
      request.more = push && push->close == 0;
      if (!push) break;
      bytes += push->message ? push->message->size() : 0;
      ++request.given;
      if (std::exchange(last, push->message.get()) != push->message.get()) is_over = std::chrono::steady_clock::now() >= end;
      pushes.push_back(*std::move(push));
    }
  }
}

/// The engine goes on naming the channels of which it was not asked only when they have been asked for.
void SharedEngine::take_pushes(std::vector<engine::PushRequest>& requests, std::vector<engine::Push>& pushes, TimePoint now) {
  if (use_now([&] { take_pushes_for(round_time, requests, pushes, now); }, now)) return;
  for (engine::PushRequest& request : requests) {
    request.given = 0;
    request.more = false;
    not_asked_.push_back(request.channel);
  }
}

void SharedEngine::closed(engine::Channel channel) noexcept {
  end({Postponed::End::Kind::closed, number_of(channel)}, [&] { close(channel); });
}

// --------------------------------------------------------------------------------------------------- Things and numbers

Result<void> SharedEngine::add(std::vector<Thing> things) {
  if (Result<void> open = check_open(); !open) return open;
  std::vector<UniqueFunction<void()>> when_added;
  for (ThingKeeper* keeper : keepers_) {
    Result<UniqueFunction<void()>> kept = keeper->adding(things);
    if (!kept) return Unexpected{std::move(kept).error()};
    when_added.push_back(*std::move(kept));
  }
  Result<void> added = use([&] { return engine_.add(std::move(things)); });
  if (added)
    for (UniqueFunction<void()>& keep : when_added) keep();
  return added;
}

Result<void> SharedEngine::remove(std::string_view path, const model::HandleContext* handles) {
  if (!is_own_process()) return check_open();
  Result<void> result = use([&] { return handles ? engine_.remove(path, *handles) : engine_.remove(path); });
  if (const Result<std::string> encoded = model::encode_path_from_root(path); result && encoded)
    for (ThingKeeper* keeper : keepers_) keeper->removed(*encoded);
  loop_.wake_io();
  return result;
}

Identity SharedEngine::identity() const {
  Identity identity = options_.identity;
  if (identity.iri.empty()) identity.iri = options_.listen.public_base;
  return identity;
}

void SharedEngine::sign_out(std::string_view principal) {
  if (!is_own_process()) return;
  if (sessions_) sessions_->end_all_of(principal);
  use([&] { engine_.sign_out(principal); });
  // Security::authenticate has called this: what it returns then counts.
  if (Search* const search = Search::current; search && &search->server == this) search->revision = engine_.rights_revision();
  loop_.wake_io();
}

void SharedEngine::count(ServerCounters& all) const {
  for (const auto& service : services_) service->count(all);
  if (!is_own_process()) return;
  engine::EngineCounts& counts = all;
  const auto lock = try_lock();
  counts = lock ? engine_.counts() : last_counts_;
  if (lock && never_waits()) last_counts_ = counts;
}

http::Response closed_response() {
  http::Response response;
  response.status = 503;
  return response;
}

}  // namespace lrt
