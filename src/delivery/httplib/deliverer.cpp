#include "src/delivery/httplib/deliverer.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>
#include <thread>
#include <unordered_map>
#include <unordered_set>

#include <lrt/subscription/allowed_hosts.hpp>

#include "src/base/blocked_signals.hpp"
#include "src/delivery/httplib/post.hpp"

namespace lrt::delivery {
namespace {

using std::chrono::steady_clock;
using subscription::CallbackUrl;
using subscription::Channel;
using subscription::Notification;
using subscription::DeliveryResult;

/// Connections that wait for their receiver's next notification. Not synchronised.
class KeptWires {
 public:
  std::unique_ptr<Wire> take(const std::string& receiver) {
    const auto found = std::find_if(wires_.rbegin(), wires_.rend(), [&](const Kept& k) { return k.receiver == receiver; });
    if (found == wires_.rend()) return nullptr;
    std::unique_ptr<Wire> wire = std::move(found->wire);
    wires_.erase(std::next(found).base());
    return wire;
  }
  void put(std::string receiver, std::unique_ptr<Wire> wire) {
    wires_.push_back({std::move(receiver), std::move(wire), steady_clock::now()});
  }
  /// Those that are too old or too many, for the caller to close without a lock.
  std::vector<std::unique_ptr<Wire>> take_surplus(std::size_t most, Instant oldest) {
    std::vector<std::unique_ptr<Wire>> result;
    while (!wires_.empty() && (wires_.size() > most || wires_.front().since < oldest)) {
      result.push_back(std::move(wires_.front().wire));
      wires_.pop_front();
    }
    return result;
  }
  bool empty() const noexcept { return wires_.empty(); }

 private:
  struct Kept {
    std::string receiver;
    std::unique_ptr<Wire> wire;
    Instant since;
  };
  std::deque<Kept> wires_;  // in the order of `since`
};

/// All that the threads share. A thread that the resolver does not give back owns it too, and comes back to it after stop().
class Work : public std::enable_shared_from_this<Work> {
 public:
  Work(Source& source, subscription::CallbackOptions options, subscription::AllowedHosts allowed, LogCallback log, Details details,
       int ended)
      : source_(&source),
        options_(std::move(options)),
        allowed_(std::move(allowed)),
        log_(std::move(log)),
        details_(std::move(details)),
        slow_most_(share(2)),
        ended_(ended) {}
  ~Work() { ::close(ended_); }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  void trust(std::shared_ptr<const Tls> tls) { tls_ = std::move(tls); }
  void notify(Channel channel, std::string_view receiver);
  void stop() noexcept;

 private:
  struct Job {
    Channel channel{};
    std::string receiver{};
    std::optional<Notification> notification{};  ///< asked for already, while there was no room among the slow
  };
  struct Load {
    std::size_t at_work = 0, slow_at_work = 0;  ///< slow ones are both
  };
  struct Progress {
    bool asked = false;  ///< for its notification
    bool again = false;  ///< notified after that
  };
  struct Worker {
    std::thread thread;
    bool resolving = false;  ///< in the system's resolver, which nothing interrupts
    bool over = false;       ///< has only its end before it
  };
  using Lock = std::unique_lock<std::mutex>;

  // With the lock held
  std::size_t share(std::size_t part) const noexcept { return std::max<std::size_t>(1, options_.max_threads / part); }
  void enqueue(Channel channel, std::string receiver);
  /// The first of a line that may be served now.
  std::deque<Job>::const_iterator next_of(const std::deque<Job>& line, bool slow) const;
  bool is_servable() const { return next_of(fresh_, false) != fresh_.end() || next_of(slow_, true) != slow_.end(); }
  std::optional<Job> next_job(bool& slow);
  void begin(const Job& job, bool slow);
  void end(const std::string& receiver, bool slow) noexcept;
  void hire();
  void remember(Channel channel, bool succeeded);

  void work(Worker& worker) noexcept;
  /// With the lock, which it gives up meanwhile. `slow`: counted among those that failed before.
  void serve(Lock& lock, Worker& worker, Job job, bool& slow);
  std::optional<Notification> ask(Channel channel) noexcept;
  DeliveryResult deliver(Worker& worker, Channel channel, const Notification& notification);
  Result<std::unique_ptr<Wire>> connect(Worker& worker, const CallbackUrl& url, Instant connect_until, bool& refused);
  Result<std::vector<Address>> look_up(Worker& worker, const CallbackUrl& url);
  Result<std::shared_ptr<const Tls>> tls();
  void say(LogLevel level, const std::string& text) noexcept;

  Source* const source_;  // not touched once stopping_ was seen
  const subscription::CallbackOptions options_;
  const subscription::AllowedHosts allowed_;
  LogCallback log_;
  const Details details_;
  const std::size_t slow_most_;  ///< threads that receivers who failed before may have
  const int ended_;              ///< readable once it stops: ends every wait at once

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> fresh_, slow_;
  std::unordered_map<std::string, Load> loads_;     ///< of receivers with an exchange under way
  std::unordered_map<Channel, Progress> channels_;  ///< that wait or are at work
  std::unordered_set<Channel> failed_;              ///< the last notification failed; a memory only, so that it may forget
  std::list<Worker> workers_;
  std::size_t idle_ = 0;
  std::size_t hired_ = 0;         ///< workers that are not over
  std::size_t slow_at_work_ = 0;
  bool slow_turn_ = false;
  bool stopping_ = false;
  KeptWires kept_;
  std::mutex tls_mutex_;
  std::shared_ptr<const Tls> tls_;
};

void Work::notify(Channel channel, std::string_view receiver) {
  std::vector<std::thread> gone;
  bool is_stuck = false;
  {
    const Lock lock(mutex_);
    if (stopping_) return;
    const auto [at, is_new] = channels_.try_emplace(channel);
    if (!is_new) {
      if (at->second.asked) at->second.again = true;
      return;
    }
    enqueue(channel, std::string(receiver));
    is_stuck = hired_ == 0;
    for (auto worker = workers_.begin(); worker != workers_.end();) {
      if (worker->over) {
        gone.push_back(std::move(worker->thread));
        worker = workers_.erase(worker);
      } else {
        ++worker;
      }
    }
  }
  for (std::thread& thread : gone) thread.join();  // they have let go of the lock for the last time
  if (is_stuck) say(LogLevel::error, "web callbacks: the system gives no thread for them; the next notification tries again");
}

void Work::enqueue(Channel channel, std::string receiver) {
  // Receivers that failed wait in a line of their own, and the source is asked only when there is room for one.
  const bool slow = failed_.count(channel) != 0;
  (slow ? slow_ : fresh_).push_back({channel, std::move(receiver)});
  if (idle_ == 0 && is_servable()) hire();
  changed_.notify_one();
}

std::deque<Work::Job>::const_iterator Work::next_of(const std::deque<Job>& line, bool slow) const {
  if (slow && slow_at_work_ >= slow_most_) return line.end();
  return std::find_if(line.begin(), line.end(), [&](const Job& job) {
    const auto load = loads_.find(job.receiver);
    if (load == loads_.end()) return true;
    return load->second.at_work < share(4) && (!slow || load->second.slow_at_work < share(8));
  });
}

void Work::begin(const Job& job, bool slow) {
  Load& load = loads_[job.receiver];
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

void Work::hire() {
  if (hired_ >= options_.max_threads) return;
  workers_.emplace_back();
  Worker& worker = workers_.back();
  try {
    const BlockedSignals blocked;
    worker.thread = std::thread([this, self = shared_from_this(), &worker] { work(worker); });
    ++hired_;
  } catch (...) {  // the system has no thread for us: those there are must do
    workers_.pop_back();
  }
}

std::optional<Work::Job> Work::next_job(bool& slow) {
  const auto fresh_one = next_of(fresh_, false), slow_one = next_of(slow_, true);
  const bool slow_can = slow_one != slow_.end(), fresh_can = fresh_one != fresh_.end();
  if (!slow_can && !fresh_can) return std::nullopt;
  slow = slow_can && (!fresh_can || slow_turn_);  // in turns: neither line can starve the other
  slow_turn_ = !slow_turn_;
  Job job = slow ? *slow_one : *fresh_one;
  begin(job, slow);
  if (slow) slow_.erase(slow_one);
  else fresh_.erase(fresh_one);
  channels_[job.channel].asked = true;
  if (idle_ > 0 && is_servable()) changed_.notify_one();
  else if (is_servable()) hire();
  return job;
}

void Work::work(Worker& worker) noexcept {
  Lock lock(mutex_);
  while (!stopping_) {
    bool slow = false;
    if (std::optional<Job> job = next_job(slow)) {
      const Channel channel = job->channel;
      const std::string receiver = job->receiver;
      try {
        serve(lock, worker, *std::move(job), slow);
      } catch (...) {  // no memory for the lines: the channel starts anew with its next notification
        if (!lock.owns_lock()) lock.lock();
        channels_.erase(channel);
      }
      end(receiver, slow);
      if (is_servable()) changed_.notify_one();  // there is room for the next
      continue;
    }
    ++idle_;
    const bool called = changed_.wait_for(lock, details_.idle_time, [&] { return stopping_ || is_servable(); });
    --idle_;
    if (stopping_) break;
    auto surplus = kept_.take_surplus(details_.kept, steady_clock::now() - details_.kept_time);
    if (!surplus.empty()) {
      lock.unlock();
      for (const auto& wire : surplus) wire->end();
      surplus.clear();
      lock.lock();
    }
    if (!called && !is_servable() && (hired_ > 1 || kept_.empty())) break;  // the last one stays for the connections
  }
  --hired_;
  worker.over = true;
  changed_.notify_all();
}

void Work::serve(Lock& lock, Worker& worker, Job job, bool& slow) {
  const Channel channel = job.channel;
  lock.unlock();
  std::optional<Notification> notification = job.notification ? std::move(job.notification) : ask(channel);
  lock.lock();
  if (stopping_) return;
  if (notification) {
    if (notification->failed_before && !slow) {  // found out late, after a restart for example
      Load& load = loads_[job.receiver];
      if (slow_at_work_ >= slow_most_ || load.slow_at_work >= share(8)) {
        slow_.push_back({channel, std::move(job.receiver), std::move(notification)});
        return;
      }
      ++load.slow_at_work;
      ++slow_at_work_;
      slow = true;
    }
    lock.unlock();
    DeliveryResult receipt;
    try {
      receipt = deliver(worker, channel, *notification);
    } catch (const std::exception& e) {
      receipt.error = e.what();
    } catch (...) {
      receipt.error = "an exception";
    }
    lock.lock();
    if (stopping_) return;
    remember(channel, receipt.status >= 200 && receipt.status < 300);
    lock.unlock();
    source_->delivered(channel, std::move(receipt));
    lock.lock();
    if (stopping_) return;
  } else {
    failed_.erase(channel);
  }
  if (channels_[channel].again) {
    channels_[channel] = {};
    enqueue(channel, std::move(job.receiver));
  } else {
    channels_.erase(channel);
  }
}

void Work::remember(Channel channel, bool succeeded) {
  constexpr std::size_t most = 4'096;  // channels that were removed leave theirs behind
  if (failed_.size() >= most) failed_.clear();
  if (succeeded) failed_.erase(channel);
  else failed_.insert(channel);
}

std::optional<Notification> Work::ask(Channel channel) noexcept {
  try {
    return source_->next_notification(channel);
  } catch (const std::exception& e) {
    say(LogLevel::error, std::string("web callbacks: no notification: ") + e.what());
  } catch (...) {
    say(LogLevel::error, "web callbacks: no notification: an exception");
  }
  return std::nullopt;
}

DeliveryResult Work::deliver(Worker& worker, Channel channel, const Notification& notification) {
  const Result<CallbackUrl> url = subscription::parse_callback_url(notification.url);
  if (!url) return {0, url.error().message, true};
  if (!allowed_.names(url->host, url->port)) return {0, "\"" + url->host + "\" is not allowed", true};

  const Instant start = steady_clock::now();
  const Patience patience{start + options_.response_time, ended_};
  const Instant connect_until = start + std::min(options_.connect_time, options_.response_time);
  // A connection serves one subscription: what one path of a receiver sends too much must not become the answer to another's notification.
  const std::string receiver = (url->secure ? "s " : "p ") + url->host + " " + std::to_string(url->port) + " " +
                               std::to_string(static_cast<std::uint64_t>(channel));
  std::unique_ptr<Wire> wire;
  {
    const Lock lock(mutex_);
    wire = kept_.take(receiver);
  }
  if (wire && !wire->is_idle()) wire = nullptr;
  while (true) {
    const bool is_fresh = wire == nullptr;
    if (is_fresh) {
      bool refused = false;
      Result<std::unique_ptr<Wire>> connected = connect(worker, *url, connect_until, refused);
      if (!connected) return {0, connected.error().message, refused};
      wire = *std::move(connected);
    }
    const Answer answer = post(*wire, *url, notification, options_.max_response_bytes, patience);
    // RFC 9112 9.3.1: a receiver may close a connection that it was keeping just when it is used again, and a POST must not be repeated if
    // it may have been carried out. A notification says how things are and is repeated anyway when its answer is lost; so once more,
    // on a connection of its own, if nothing at all came back.
    if (answer.silent && !is_fresh) {
      wire = nullptr;
      continue;
    }
    if (answer.keep) {
      std::vector<std::unique_ptr<Wire>> surplus;
      {
        const Lock lock(mutex_);
        kept_.put(receiver, std::move(wire));
        surplus = kept_.take_surplus(details_.kept, steady_clock::now() - details_.kept_time);
      }
      for (const auto& old : surplus) old->end();
    } else if (answer.status != 0) {
      wire->end();
    }
    if (answer.status != 0) return {answer.status};
    return {0, "\"" + url->host + "\": " + answer.error};
  }
}

Result<std::vector<Address>> Work::look_up(Worker& worker, const CallbackUrl& url) {
  {
    const Lock lock(mutex_);
    if (stopping_) return unexpected(Errc::cancelled, "the server stops");
    worker.resolving = true;
  }
  // stop() does not wait for this: then this thread is on its own, with what it shares, and finds stopping_ set.
  Result<std::vector<Address>> found = unexpected(Errc::io_error, "no address of \"" + url.host + "\"");
  try {
    found = details_.look_up(url.host, url.port);
  } catch (...) {
  }
  const Lock lock(mutex_);
  worker.resolving = false;
  if (stopping_) return unexpected(Errc::cancelled, "the server stops");
  return found;
}

Result<std::unique_ptr<Wire>> Work::connect(Worker& worker, const CallbackUrl& url, Instant connect_until, bool& refused) {
  const Result<std::vector<Address>> found = look_up(worker, url);
  if (!found) return unexpected(found.error());
  std::vector<const Address*> addresses;
  for (const Address& address : *found) {
    if (allowed_.allows(url.host, url.port, address.text)) addresses.push_back(&address);
  }
  if (addresses.empty()) {
    refused = true;
    std::string list;
    for (const Address& address : *found) list += (list.empty() ? "" : ", ") + address.text;
    return unexpected(Errc::refused, "\"" + url.host + "\" is at " + list + ", where no callbacks are allowed to go");
  }
  std::string why;
  for (std::size_t i = 0; i < addresses.size(); ++i) {
    const Instant now = steady_clock::now();
    // An address that does not answer leaves time for those after it.
    const Patience patience{now + (connect_until - now) / static_cast<long>(addresses.size() - i), ended_};
    const std::string where = "\"" + url.host + "\" at " + addresses[i]->text + ": ";
    Result<std::unique_ptr<Wire>> wire = Wire::open(*addresses[i], patience);
    if (!wire) {
      why = where + (wire.error().code == Errc::timed_out ? "no connection in time" : wire.error().message);
      continue;
    }
    if (url.secure) {
      const Result<std::shared_ptr<const Tls>> trust = tls();
      if (!trust) return unexpected(trust.error());
      if (Result<void> secured = (*wire)->secure(**trust, url.host, {connect_until, ended_}); !secured) {
        const Error& error = secured.error();
        return unexpected(error.code, where + "TLS: " + (error.code == Errc::timed_out ? "not agreed upon in time" : error.message));
      }
    }
    return wire;
  }
  return unexpected(Errc::io_error, why);
}

/// The system's authorities are read when the first https receiver is to be called.
Result<std::shared_ptr<const Tls>> Work::tls() {
  const Lock lock(tls_mutex_);
  if (!tls_) {
    Result<std::shared_ptr<const Tls>> made = Tls::make(options_.ca_file);
    if (!made) return made;
    tls_ = *std::move(made);
  }
  return tls_;
}

void Work::say(LogLevel level, const std::string& text) noexcept {
  try {
    if (log_) log_(level, text);
  } catch (...) {
  }
}

void Work::stop() noexcept {
  std::list<Worker> rest;
  {
    Lock lock(mutex_);
    if (stopping_) return;
    stopping_ = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(ended_, &one, sizeof one);
    changed_.notify_all();
    changed_.wait(lock, [&] {
      return std::all_of(workers_.begin(), workers_.end(), [](const Worker& w) { return w.over || w.resolving; });
    });
    for (Worker& worker : workers_) {
      if (worker.resolving) worker.thread.detach();
    }
    // Those that resolve keep their places in workers_: they will say there that they are over.
    for (auto worker = workers_.begin(); worker != workers_.end();) {
      const auto next = std::next(worker);
      if (worker->over) rest.splice(rest.end(), workers_, worker);
      worker = next;
    }
    log_ = nullptr;
    fresh_.clear();
    slow_.clear();
    (void)kept_.take_surplus(0, steady_clock::now());
  }
  for (Worker& worker : rest) worker.thread.join();
}

class HttplibDeliverer final : public Deliverer {
 public:
  explicit HttplibDeliverer(std::shared_ptr<Work> work) : work_(std::move(work)) {}
  ~HttplibDeliverer() override { stop(); }
  HttplibDeliverer(const HttplibDeliverer&) = delete;
  HttplibDeliverer& operator=(const HttplibDeliverer&) = delete;

  void notify(Channel channel, std::string_view receiver) override { work_->notify(channel, receiver); }
  void stop() noexcept override { work_->stop(); }

 private:
  std::shared_ptr<Work> work_;
};

}  // namespace

Result<std::unique_ptr<Deliverer>> make_httplib_deliverer(Source& source, const subscription::CallbackOptions& options, LogCallback log,
                                                          Details details) {
  Result<subscription::AllowedHosts> allowed = subscription::AllowedHosts::parse(options.allow);
  if (!allowed) return unexpected(std::move(allowed).error());
  if (options.max_threads == 0) return unexpected(Errc::invalid_option, "max_threads of callbacks: expected at least 1");
  if (options.connect_time.count() <= 0 || options.response_time.count() <= 0) {
    return unexpected(Errc::invalid_option, "connect_time and response_time of callbacks: expected more than 0");
  }
  std::shared_ptr<const Tls> tls;
  if (!options.ca_file.empty()) {  // told now, not when the first receiver is to be called
    Result<std::shared_ptr<const Tls>> made = Tls::make(options.ca_file);
    if (!made) return unexpected(std::move(made).error());
    tls = *std::move(made);
  }
  const int ended = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (ended < 0) return unexpected(Errc::io_error, std::string("no event descriptor for callbacks: ") + std::strerror(errno));
  auto work = std::make_shared<Work>(source, options, *std::move(allowed), std::move(log), std::move(details), ended);
  work->trust(std::move(tls));
  return std::unique_ptr<Deliverer>(std::make_unique<HttplibDeliverer>(std::move(work)));
}

Result<std::unique_ptr<Deliverer>> make_deliverer(Source& source, const subscription::CallbackOptions& options, LogCallback log) {
  return make_httplib_deliverer(source, options, std::move(log), Details{});
}

}  // namespace lrt::delivery
