// SPDX-License-Identifier: Apache-2.0
#include "src/delivery/deliverer.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>
#include <unordered_map>
#include <unordered_set>

#include <lrt/subscription/allowed_hosts.hpp>

#include "src/base/thread.hpp"
#include "src/delivery/post.hpp"
#include "src/exchange/connect.hpp"
#include "src/exchange/idle_wires.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::delivery {
inline namespace v0 {
namespace {

using exchange::ClientTls;
using exchange::IdleWires;
using exchange::Instant;
using exchange::WaitLimit;
using exchange::Wire;
using std::chrono::steady_clock;
using subscription::CallbackUrl;
using subscription::Channel;
using subscription::DeliveryResult;
using subscription::Notification;

/// The names that the system's resolver is asked for at present, and those that had no address a short time ago. Not synchronised.
class Names {
 public:
  Names(std::size_t max_threads, std::chrono::milliseconds failed_time) : max_threads_(max_threads), failed_time_(failed_time) {}

  bool is_full() const noexcept { return running_.size() >= max_threads_; }
  /// Whether a thread may resolve it now: each name takes one thread, all names of a domain half of them. So neither a name with many
  /// subscriptions nor a domain with many names keeps others from being resolved.
  bool may_begin(const std::string& name) const {
    if (is_full() || std::find(running_.begin(), running_.end(), name) != running_.end()) return false;
    const std::string_view domain = domain_of(name);
    const auto same = std::count_if(running_.begin(), running_.end(), [&](const std::string& n) { return domain_of(n) == domain; });
    return static_cast<std::size_t>(same) < std::max<std::size_t>(1, max_threads_ / 2);
  }
  void begin(const std::string& name) { running_.push_back(name); }
  void end(const std::string& name) noexcept { running_.erase(std::find(running_.begin(), running_.end(), name)); }

  void remember_failure(const std::string& name, const Error& error) {
    constexpr std::size_t max_failures = 256;
    if (failures_.size() >= max_failures) failures_.clear();
    failures_.insert_or_assign(name, Failure{error, steady_clock::now() + failed_time_});
  }
  /// The error of a resolution that failed a short time ago.
  std::optional<Error> failure_of(const std::string& name) {
    const auto found = failures_.find(name);
    if (found == failures_.end()) return std::nullopt;
    if (found->second.until > steady_clock::now()) return found->second.error;
    failures_.erase(found);
    return std::nullopt;
  }

 private:
  struct Failure {
    Error error;
    Instant until;
  };
  /// The last two labels.
  static std::string_view domain_of(std::string_view name) noexcept {
    if (!name.empty() && name.back() == '.') name.remove_suffix(1);
    const std::size_t last = name.rfind('.');
    if (last == std::string_view::npos || last == 0) return name;
    const std::size_t before = name.rfind('.', last - 1);
    return before == std::string_view::npos ? name : name.substr(before + 1);
  }

  const std::size_t max_threads_;
  const std::chrono::milliseconds failed_time_;
  std::vector<std::string> running_;
  std::unordered_map<std::string, Failure> failures_;
};

/// The state that the threads share. A thread that is still in the system's resolver at stop() owns it too, and uses it afterwards.
class Work : public std::enable_shared_from_this<Work> {
 public:
  Work(Source& source, subscription::CallbackOptions options, subscription::AllowedHosts allowed, LogCallback log, Details details, int ended)
      : source_(&source),
        options_(std::move(options)),
        allowed_(std::move(allowed)),
        log_(std::move(log)),
        details_(std::move(details)),
        max_slow_(share(2)),
        stop_descriptor_(ended),
        names_(options_.max_resolver_threads, details_.failed_time) {}
  ~Work() { ::close(stop_descriptor_); }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  void trust(std::shared_ptr<const ClientTls> tls) { tls_ = std::move(tls); }
  void notify(Channel channel, std::string_view receiver);
  void stop() noexcept;

 private:
  struct Task {
    Channel channel{};
    std::string receiver{};
    std::optional<Notification> notification{};               ///< fetched already, then deferred by the limits for slow receivers or for a name
    std::optional<Result<std::vector<Address>>> addresses{};  ///< of the name, once it is resolved or failed
  };
  /// A task that waits until the name of its receiver is resolved.
  struct Waiting {
    Task task;
    std::string name;
    Instant until;
    bool slow;
  };
  struct Outcome {
    DeliveryResult result{};
    std::string unresolved{};  ///< nothing was sent: this name must be resolved first
  };
  struct Load {
    std::size_t at_work = 0, slow_at_work = 0;  ///< at_work includes slow_at_work
  };
  struct Progress {
    bool fetched = false;         ///< its notification has been fetched
    bool notified_again = false;  ///< notify() was called after that
  };
  struct Worker {
    Thread thread;
    bool finished = false;  ///< the thread does not take the lock again
  };
  using Lock = std::unique_lock<std::mutex>;

  // These functions require the lock.
  std::size_t share(std::size_t part) const noexcept { return std::max<std::size_t>(1, options_.max_threads / part); }
  void enqueue(Channel channel, std::string receiver);
  void enqueue(Task task, bool slow);
  /// The contrary of enqueue(), when no thread runs and none could be started. The calling thread becomes a worker until it is finished.
  Worker& take_back(Channel channel);
  void wait_for_name(Task task, std::string name, bool slow);
  void start_resolvers();
  /// The task no longer waits for its name.
  void continue_with(std::list<Waiting>::iterator item, Result<std::vector<Address>> addresses);
  void end_late_waits();
  /// Waits for a task. false: none came within idle_time.
  bool wait_for_task(Lock& lock);
  /// The first task of a queue that the limits allow to start now.
  std::deque<Task>::const_iterator next_of(const std::deque<Task>& queue, bool slow) const;
  bool is_servable() const { return next_of(fresh_, false) != fresh_.end() || next_of(slow_, true) != slow_.end(); }
  std::optional<Task> next_task(bool& slow);
  void begin(const Task& task, bool slow);
  void end(const std::string& receiver, bool slow) noexcept;
  void start_worker();
  void record_outcome(Channel channel, bool succeeded);

  void fail_without_thread(Worker& caller, Channel channel);
  void work(Worker& worker) noexcept;
  bool take_turn(Lock& lock);
  /// Fetches and delivers one notification. Releases the lock meanwhile. `slow`: the task counts as slow (its last delivery failed).
  void serve(Lock& lock, Task task, bool& slow);
  std::optional<Notification> fetch(Channel channel) noexcept;
  Outcome deliver(const Task& task);
  Result<std::unique_ptr<Wire>> connect(const CallbackUrl& url, const std::vector<Address>& found, Instant connect_until, bool& refused);
  void resolve_name(const std::string& name) noexcept;
  Result<std::shared_ptr<const ClientTls>> tls();
  void log(LogLevel level, const std::string& text) noexcept;

  Source* const source_;  // not used once stopping_ is set
  const subscription::CallbackOptions options_;
  const subscription::AllowedHosts allowed_;
  LogCallback log_;
  const Details details_;
  const std::size_t max_slow_;  ///< limit of threads for slow receivers
  const int stop_descriptor_;   ///< readable after stop(): ends every wait at once

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Task> fresh_, slow_;                   ///< slow: the last delivery of the channel failed
  std::unordered_map<std::string, Load> loads_;     ///< of receivers with a running exchange
  std::unordered_map<Channel, Progress> channels_;  ///< that are queued or running
  std::unordered_set<Channel> failed_;              ///< channels whose last delivery failed; may be incomplete
  std::list<Waiting> waiting_;                      ///< in the order of `until`
  Names names_;
  std::list<Worker> workers_;
  std::size_t idle_ = 0;
  std::size_t running_ = 0;  ///< workers that are not finished
  std::size_t slow_at_work_ = 0;
  bool slow_turn_ = false;
  bool stopping_ = false;
  IdleWires idle_wires_;
  std::mutex tls_mutex_;
  std::shared_ptr<const ClientTls> tls_;
};

void Work::notify(Channel channel, std::string_view receiver) {
  std::vector<Thread> gone;
  Worker* caller = nullptr;
  {
    const Lock lock(mutex_);
    if (stopping_) return;
    const auto [at, is_new] = channels_.try_emplace(channel);
    if (!is_new) {
      if (at->second.fetched) at->second.notified_again = true;
      return;
    }
    try {
      enqueue(channel, std::string(receiver));
    } catch (...) {
      channels_.erase(at);
      throw;
    }
    if (running_ == 0) caller = &take_back(channel);
    for (auto worker = workers_.begin(); worker != workers_.end();) {
      if (worker->finished) {
        gone.push_back(std::move(worker->thread));
        worker = workers_.erase(worker);
      } else {
        ++worker;
      }
    }
  }
  for (Thread& thread : gone) thread.join();  // they do not take the lock again
  if (caller != nullptr) fail_without_thread(*caller, channel);
}

Work::Worker& Work::take_back(Channel channel) {
  for (std::deque<Task>* const queue : {&fresh_, &slow_})
    queue->erase(std::remove_if(queue->begin(), queue->end(), [&](const Task& task) { return task.channel == channel; }), queue->end());
  channels_.erase(channel);
  return workers_.emplace_back();
}

/// The notification has failed, so the source calls notify() again later. Runs on the calling thread, for which stop() waits as for others.
void Work::fail_without_thread(Worker& caller, Channel channel) {
  log(LogLevel::error, "web callbacks: cannot start a thread; the notification is tried again");
  if (fetch(channel)) source_->delivered(channel, {0, "no thread to deliver it could be started"});
  const Lock lock(mutex_);
  caller.finished = true;
  changed_.notify_all();
}

void Work::enqueue(Channel channel, std::string receiver) {
  // Receivers that failed have a queue of their own. Their notification is fetched when it can be delivered.
  enqueue({channel, std::move(receiver)}, failed_.count(channel) != 0);
}

void Work::enqueue(Task task, bool slow) {
  (slow ? slow_ : fresh_).push_back(std::move(task));
  if (idle_ == 0 && is_servable()) start_worker();
  changed_.notify_one();
}

void Work::wait_for_name(Task task, std::string name, bool slow) {
  if (std::optional<Error> failure = names_.failure_of(name)) {
    task.addresses.emplace(unexpected(*std::move(failure)));
    return enqueue(std::move(task), slow);
  }
  waiting_.push_back({std::move(task), std::move(name), steady_clock::now() + options_.resolve_time, slow});
  changed_.notify_one();  // the time limit is a new one for a thread that waits
  start_resolvers();
}

void Work::start_resolvers() {
  for (auto item = waiting_.begin(); item != waiting_.end() && !names_.is_full(); ++item) {
    if (!names_.may_begin(item->name)) continue;
    names_.begin(item->name);
    try {
      start_thread("lrt-resolve", options_.threads, [self = shared_from_this(), name = item->name] { self->resolve_name(name); }).value().detach();
    } catch (...) {  // no thread is available: tasks wait until another name is resolved, or until their time limit
      names_.end(item->name);
      return;
    }
  }
}

/// Runs on a thread of its own. stop() does not wait for it.
void Work::resolve_name(const std::string& name) noexcept {
  std::optional<Result<std::vector<Address>>> found;
  try {
    found = details_.look_up(name);
  } catch (...) {}
  const Lock lock(mutex_);
  names_.end(name);
  if (stopping_) return;
  try {
    if (!found) found.emplace(unexpected(Errc::io_error, "no address of \"" + name + "\""));
    if (!*found) names_.remember_failure(name, found->error());
    for (auto item = waiting_.begin(); item != waiting_.end();) {
      const auto next = std::next(item);
      if (item->name == name) continue_with(item, *found);
      item = next;
    }
    start_resolvers();
  } catch (...) {}  // out of memory: the tasks wait until their time limit
}

void Work::continue_with(std::list<Waiting>::iterator item, Result<std::vector<Address>> addresses) {
  item->task.addresses.emplace(std::move(addresses));
  enqueue(std::move(item->task), item->slow);
  waiting_.erase(item);
}

void Work::end_late_waits() {
  const Instant now = steady_clock::now();
  while (!waiting_.empty() && waiting_.front().until <= now)
    continue_with(waiting_.begin(), unexpected(Errc::timed_out, "resolving \"" + waiting_.front().name + "\" timed out"));
}

bool Work::wait_for_task(Lock& lock) {
  const Instant end = steady_clock::now() + details_.idle_time;
  ++idle_;
  while (!stopping_ && !is_servable() && steady_clock::now() < end) {
    // A copy: wait_until() reads it again afterwards, and the one who waits may be gone by then.
    const Instant until = waiting_.empty() ? end : std::min(end, waiting_.front().until);
    changed_.wait_until(lock, until);
    end_late_waits();
  }
  --idle_;
  return is_servable();
}

std::deque<Work::Task>::const_iterator Work::next_of(const std::deque<Task>& queue, bool slow) const {
  if (slow && slow_at_work_ >= max_slow_) return queue.end();
  return std::find_if(queue.begin(), queue.end(), [&](const Task& task) {
    const auto load = loads_.find(task.receiver);
    if (load == loads_.end()) return true;
    return load->second.at_work < share(4) && (!slow || load->second.slow_at_work < share(8));
  });
}

void Work::begin(const Task& task, bool slow) {
  Load& load = loads_[task.receiver];
  ++load.at_work;
  if (!slow) return;
  ++load.slow_at_work;
  ++slow_at_work_;
}

void Work::end(const std::string& receiver, bool slow) noexcept {
  const auto load = loads_.find(receiver);
  if (slow) --load->second.slow_at_work, --slow_at_work_;
  if (--load->second.at_work == 0) loads_.erase(load);
}

void Work::start_worker() {
  if (running_ >= options_.max_threads) return;
  const std::size_t before = workers_.size();
  try {
    workers_.emplace_back();
    Worker& worker = workers_.back();
    worker.thread = start_thread("lrt-callback", options_.threads, [this, self = shared_from_this(), &worker] { work(worker); }).value();
    ++running_;
  } catch (...) {  // no thread is available: the running ones continue
    if (workers_.size() > before) workers_.pop_back();
  }
}

std::optional<Work::Task> Work::next_task(bool& slow) {
  const auto fresh_one = next_of(fresh_, false), slow_one = next_of(slow_, true);
  const bool slow_can = slow_one != slow_.end(), fresh_can = fresh_one != fresh_.end();
  if (!slow_can && !fresh_can) return std::nullopt;
  slow = slow_can && (!fresh_can || slow_turn_);  // by turns: neither queue can starve the other
  slow_turn_ = !slow_turn_;
  Task task = slow ? *slow_one : *fresh_one;
  Progress& progress = channels_[task.channel];
  begin(task, slow);
  progress.fetched = true;
  if (slow) slow_.erase(slow_one);
  else fresh_.erase(fresh_one);
  if (idle_ > 0 && (is_servable() || !waiting_.empty())) changed_.notify_one();
  else if (is_servable()) start_worker();
  return task;
}

void Work::work(Worker& worker) noexcept {
  Lock lock(mutex_);
  while (!stopping_) try {
      if (!take_turn(lock)) break;
    } catch (...) {  // out of memory, at a place where nothing has begun. It is tried again after a moment
      if (!lock.owns_lock()) lock.lock();
      changed_.wait_for(lock, std::chrono::milliseconds(10), [this] { return stopping_; });
    }
  --running_;
  worker.finished = true;
  changed_.notify_all();
}

/// One task, or one wait for a task. False: the worker has nothing to do and ends.
bool Work::take_turn(Lock& lock) {
  end_late_waits();
  bool slow = false;
  if (std::optional<Task> task = next_task(slow)) {
    const Channel channel = task->channel;
    const auto load = loads_.find(task->receiver);
    const std::string* const receiver = &load->first;  // it stays there until end()
    try {
      serve(lock, *std::move(task), slow);
    } catch (...) {  // out of memory: the channel starts again with its next notification
      if (!lock.owns_lock()) lock.lock();
      channels_.erase(channel);
    }
    end(*receiver, slow);
    if (is_servable()) changed_.notify_one();  // the limits allow another task
    return true;
  }
  const bool called = wait_for_task(lock);
  if (stopping_) return false;
  auto surplus = idle_wires_.take_surplus(details_.kept, steady_clock::now() - details_.kept_time);
  if (!surplus.empty()) {
    lock.unlock();
    for (const auto& wire : surplus) wire->end();
    surplus.clear();
    lock.lock();
  }
  // The last worker stays, to close idle connections and for the time limits of names.
  return called || is_servable() || (running_ <= 1 && !(idle_wires_.empty() && waiting_.empty()));
}

void Work::serve(Lock& lock, Task task, bool& slow) {
  const Channel channel = task.channel;
  if (!task.notification) {
    lock.unlock();
    task.notification = fetch(channel);
    lock.lock();
    if (stopping_) return;
  }
  if (task.notification) {
    if (task.notification->failed_before && !slow) {  // not in failed_, for example after a restart
      Load& load = loads_[task.receiver];
      if (slow_at_work_ >= max_slow_ || load.slow_at_work >= share(8)) {
        slow_.push_back(std::move(task));
        return;
      }
      ++load.slow_at_work;
      ++slow_at_work_;
      slow = true;
    }
    lock.unlock();
    Outcome outcome;
    const auto fail = [&](const char* why) noexcept {
      try {
        outcome.result.error = why;
      } catch (...) { outcome.result.error = "out of memory"; }
    };
    try {
      outcome = deliver(task);
    } catch (const std::exception& e) { fail(e.what()); } catch (...) {
      fail("an exception was thrown");
    }
    lock.lock();
    if (stopping_) return;
    if (!outcome.unresolved.empty()) return wait_for_name(std::move(task), std::move(outcome.unresolved), slow);
    record_outcome(channel, outcome.result.status >= 200 && outcome.result.status < 300);
    lock.unlock();
    source_->delivered(channel, std::move(outcome.result));
    lock.lock();
    if (stopping_) return;
  } else {
    failed_.erase(channel);
  }
  if (channels_[channel].notified_again) {
    channels_[channel] = {};
    enqueue(channel, std::move(task.receiver));
  } else {
    channels_.erase(channel);
  }
}

void Work::record_outcome(Channel channel, bool succeeded) {
  constexpr std::size_t max_failed = 4'096;  // entries of removed channels are never erased
  if (failed_.size() >= max_failed) failed_.clear();
  if (succeeded) failed_.erase(channel);
  else failed_.insert(channel);
}

std::optional<Notification> Work::fetch(Channel channel) noexcept {
  try {
    return source_->next_notification(channel);
  } catch (const std::exception& e) { log(LogLevel::error, std::string("web callbacks: fetching a notification failed: ") + e.what()); } catch (...) {
    log(LogLevel::error, "web callbacks: fetching a notification failed: an exception was thrown");
  }
  return std::nullopt;
}

Work::Outcome Work::deliver(const Task& task) {
  const Notification& notification = *task.notification;
  const Result<CallbackUrl> url = subscription::parse_callback_url(notification.url);
  if (!url) return {{0, url.error().message, true}};
  if (!allowed_.names(url->host, url->port)) return {{0, "\"" + url->host + "\" is not allowed", true}};

  const Instant start = steady_clock::now();
  const WaitLimit limit{start + options_.response_time, stop_descriptor_};
  const Instant connect_until = start + std::min(options_.connect_time, options_.response_time);
  // A connection serves one subscription. Otherwise surplus bytes from one path of a receiver could be read as the response of another path.
  const std::string receiver =
      (url->secure ? "s " : "p ") + url->host + " " + std::to_string(url->port) + " " + std::to_string(static_cast<std::uint64_t>(task.channel));
  std::unique_ptr<Wire> wire;
  {
    const Lock lock(mutex_);
    wire = idle_wires_.take(receiver);
  }
  if (wire && !wire->is_idle()) wire = nullptr;
  while (true) {
    const bool is_fresh = wire == nullptr;
    if (is_fresh) {
      const std::optional<Address> literal = literal_address(url->host);
      if (!literal && !task.addresses) return {{}, url->host};
      if (!literal && !*task.addresses) return {{0, task.addresses->error().message}};
      bool refused = false;
      Result<std::unique_ptr<Wire>> connected = connect(*url, literal ? std::vector<Address>{*literal} : **task.addresses, connect_until, refused);
      if (!connected) return {{0, connected.error().message, refused}};
      wire = *std::move(connected);
    }
    const PostResult result = post(*wire, *url, notification, options_.max_response_bytes, limit);
    // RFC 9112 9.3.1: a receiver may close an idle connection at the moment when it is used again, and a POST must not be repeated
    // automatically if the receiver may have acted on it. A notification is idempotent: it states the current representation. It is sent
    // once more, on a new connection, if the receiver sent no byte.
    if (result.silent && !is_fresh) {
      wire = nullptr;
      continue;
    }
    if (result.keep) {
      std::vector<std::unique_ptr<Wire>> surplus;
      {
        const Lock lock(mutex_);
        idle_wires_.put(receiver, std::move(wire));
        surplus = idle_wires_.take_surplus(details_.kept, steady_clock::now() - details_.kept_time);
      }
      for (const auto& old : surplus) old->end();
    } else if (result.status != 0) {
      wire->end();
    }
    if (result.status != 0) return {{result.status, {}, false, result.confirmed}};
    return {{0, "\"" + url->host + "\": " + result.error}};
  }
}

Result<std::unique_ptr<Wire>> Work::connect(const CallbackUrl& url, const std::vector<Address>& found, Instant connect_until, bool& refused) {
  std::vector<const Address*> addresses;
  for (const Address& address : found) {
    if (allowed_.allows(url.host, url.port, address.text)) addresses.push_back(&address);
  }
  if (addresses.empty()) {
    refused = true;
    std::string list;
    for (const Address& address : found) list += (list.empty() ? "" : ", ") + address.text;
    return unexpected(Errc::refused, "\"" + url.host + "\" resolves to " + list + ", and callbacks to these addresses are not allowed");
  }
  return exchange::connect(url, addresses, [this] { return tls(); }, {connect_until, stop_descriptor_});
}

/// The system's certificate authorities are read at the first https delivery.
Result<std::shared_ptr<const ClientTls>> Work::tls() {
  const Lock lock(tls_mutex_);
  if (!tls_) {
    Result<std::shared_ptr<const ClientTls>> made = ClientTls::make(options_.ca_file);
    if (!made) return made;
    tls_ = *std::move(made);
  }
  return tls_;
}

void Work::log(LogLevel level, const std::string& text) noexcept {
  try {
    if (log_) log_(level, text);
  } catch (...) {}
}

void Work::stop() noexcept {
  std::list<Worker> rest;
  {
    Lock lock(mutex_);
    if (stopping_) return;
    stopping_ = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(stop_descriptor_, &one, sizeof one);
    changed_.notify_all();
    changed_.wait(lock, [&] { return std::all_of(workers_.begin(), workers_.end(), [](const Worker& w) { return w.finished; }); });
    rest.splice(rest.end(), workers_);
    log_ = nullptr;
    fresh_.clear();
    slow_.clear();
    waiting_.clear();
    (void)idle_wires_.take_surplus(0, steady_clock::now());
  }
  for (Worker& worker : rest) worker.thread.join();
}

class ThreadDeliverer final : public Deliverer {
 public:
  explicit ThreadDeliverer(std::shared_ptr<Work> work) : work_(std::move(work)) {}
  ~ThreadDeliverer() override { stop(); }
  ThreadDeliverer(const ThreadDeliverer&) = delete;
  ThreadDeliverer& operator=(const ThreadDeliverer&) = delete;

  void notify(Channel channel, std::string_view receiver) override { work_->notify(channel, receiver); }
  void stop() noexcept override { work_->stop(); }

 private:
  std::shared_ptr<Work> work_;
};

}  // namespace

Result<std::unique_ptr<Deliverer>> make_thread_deliverer(Source& source, const subscription::CallbackOptions& options, LogCallback log,
                                                         Details details) {
  Result<subscription::AllowedHosts> allowed = subscription::AllowedHosts::parse(options.allow);
  if (!allowed) return unexpected(std::move(allowed).error());
  if (options.max_threads == 0) return unexpected(Errc::invalid_option, "max_threads of callbacks: expected at least 1");
  if (options.max_resolver_threads == 0) return unexpected(Errc::invalid_option, "max_resolver_threads of callbacks: expected at least 1");
  if (options.resolve_time.count() <= 0 || options.connect_time.count() <= 0 || options.response_time.count() <= 0) {
    return unexpected(Errc::invalid_option, "resolve_time, connect_time and response_time of callbacks: expected more than 0");
  }
  std::shared_ptr<const ClientTls> tls;
  if (!options.ca_file.empty()) {  // an error is reported now instead of at the first delivery
    Result<std::shared_ptr<const ClientTls>> made = ClientTls::make(options.ca_file);
    if (!made) return unexpected(std::move(made).error());
    tls = *std::move(made);
  }
  const int ended = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (ended < 0) return unexpected(Errc::io_error, std::string("cannot create an event descriptor for callbacks: ") + std::strerror(errno));
  auto work = std::make_shared<Work>(source, options, *std::move(allowed), std::move(log), std::move(details), ended);
  work->trust(std::move(tls));
  return std::unique_ptr<Deliverer>(std::make_unique<ThreadDeliverer>(std::move(work)));
}

Result<std::unique_ptr<Deliverer>> make_deliverer(Source& source, const subscription::CallbackOptions& options, LogCallback log) {
  return make_thread_deliverer(source, options, std::move(log), Details{});
}

}  // namespace v0
}  // namespace lrt::delivery
