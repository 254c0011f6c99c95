// SPDX-License-Identifier: Apache-2.0
#include "src/client/tasks.hpp"

#include <algorithm>
#include <condition_variable>
#include <list>
#include <map>
#include <mutex>
#include <utility>

#include "src/base/thread.hpp"

namespace lrt::client {
namespace {

using Instant = std::chrono::steady_clock::time_point;

constexpr std::chrono::seconds worker_idle_time{5};
constexpr std::chrono::hours max_wait{1};

/// The Tasks::State whose worker the calling thread is; nullptr: it is none.
thread_local const void* own_state = nullptr;

}  // namespace

/// The worker threads share ownership, because a thread may outlive the Tasks.
struct LRT_LOCAL Tasks::State {
  State(ThreadOptions options, std::size_t max, const Clock& time) : threads(std::move(options)), max_threads(max), clock(time) {}

  bool add(std::unique_lock<std::mutex>& lock, const std::shared_ptr<State>& self);
  void work();

  const ThreadOptions threads;
  const std::size_t max_threads;
  const Clock& clock;
  std::mutex mutex;
  std::condition_variable changed, ended;
  std::list<Task> ready;
  std::multimap<Instant, Task> later;
  std::size_t running = 0, idle = 0;
  bool stopped = false;
};

Tasks::Tasks(const ThreadOptions& threads, std::size_t max_threads, const Clock& clock)
    : state_(std::make_shared<State>(threads, std::max<std::size_t>(max_threads, 1), clock)) {}

Tasks::~Tasks() { stop(); }

/// Wakes or starts a thread for the added task.
bool Tasks::State::add(std::unique_lock<std::mutex>& lock, const std::shared_ptr<State>& self) {
  if (running < max_threads && (ready.size() > idle || running == 0)) {
    ++running;
    lock.unlock();
    Result<Thread> thread = start_thread("lrt-client", threads, [self] {
      own_state = self.get();
      self->work();
    });
    if (thread) return thread->detach(), true;
    lock.lock();
    --running;
    ended.notify_all();
  }
  changed.notify_one();
  return running > 0;
}

bool Tasks::run(Task task) {
  std::unique_lock lock(state_->mutex);
  if (state_->stopped) return false;
  const auto at = state_->ready.insert(state_->ready.end(), std::move(task));
  if (state_->add(lock, state_)) return true;
  const Task dropped = std::move(*at);  // it is destroyed without the lock
  state_->ready.erase(at);
  lock.unlock();
  return false;
}

bool Tasks::run_at(Instant due, Task task) {
  std::unique_lock lock(state_->mutex);
  if (state_->stopped) return false;
  state_->later.emplace(due, std::move(task));
  return state_->add(lock, state_);
}

void Tasks::check() noexcept { state_->changed.notify_all(); }

void Tasks::State::work() {
  std::unique_lock lock(mutex);
  Instant idle_since = std::chrono::steady_clock::now();
  while (!stopped) {
    Task task;
    const Instant now = clock.now().steady;
    if (!later.empty() && later.begin()->first <= now) {
      task = std::move(later.begin()->second);
      later.erase(later.begin());
      if ((!later.empty() && later.begin()->first <= now) || !ready.empty()) changed.notify_one();
    } else if (!ready.empty()) {
      task = std::move(ready.front());
      ready.pop_front();
    }
    if (task) {
      lock.unlock();
      try {
        task();
      } catch (...) {}
      task = Task();
      lock.lock();
      idle_since = std::chrono::steady_clock::now();
      continue;
    }
    const Instant end = idle_since + worker_idle_time;
    const bool is_needed = !later.empty() && idle == 0;
    if (!is_needed && std::chrono::steady_clock::now() >= end) break;
    std::chrono::steady_clock::duration wait = max_wait;
    if (!later.empty()) wait = std::min(wait, later.begin()->first - now);
    if (!is_needed) wait = std::min(wait, end - std::chrono::steady_clock::now());
    ++idle;
    changed.wait_for(lock, wait);
    --idle;
  }
  --running;
  ended.notify_all();
}

void Tasks::stop() noexcept {
  std::list<Task> ready;
  std::multimap<Instant, Task> later;
  std::unique_lock lock(state_->mutex);
  state_->stopped = true;
  ready.swap(state_->ready);
  later.swap(state_->later);
  state_->changed.notify_all();
  const std::size_t own = own_state == state_.get() ? 1 : 0;
  state_->ended.wait(lock, [&] { return state_->running <= own; });
  lock.unlock();  // the tasks are destroyed without it
}

}  // namespace lrt::client
