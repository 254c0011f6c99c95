// SPDX-License-Identifier: Apache-2.0
#include "src/server/work_pool.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "src/server/service.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {

/// A thread and what it works for.
class WorkPool::Worker final : public Turns {
 public:
  explicit Worker(WorkPool& pool) noexcept : pool_(pool) {}

  Duration rest() noexcept override {
    if (pool_.waiting_.load(std::memory_order_relaxed) == 0) return {};
    const Instant begin = pool_.now_();
    if (begin - slice_began < slice) return {};
    std::unique_lock lock(pool_.mutex_);
    slice_began = begin;
    if (pool_.stopping_ || !has_place) return {};
    pool_.charge();
    const Client* const other = pool_.next(false);
    if (!other || other == client || other->used > client->used) return {};
    try {
      client->paused.push_back(this);
    } catch (...) { return {}; }
    pool_.waiting_.fetch_add(1, std::memory_order_relaxed);
    has_place = false;
    --pool_.running_;
    pool_.hand_out();
    turn.wait(lock, [this] { return has_place; });
    slice_began = pool_.now_();
    return slice_began - begin;
  }

  void leave() noexcept override {
    const std::lock_guard lock(pool_.mutex_);
    if (pool_.stopping_) return;
    pool_.charge();
    is_outside = true;
    has_place = false;
    ++client->outside;
    --pool_.running_;
    pool_.hand_out();
  }

  void come_back() noexcept override {
    const std::lock_guard lock(pool_.mutex_);
    if (!std::exchange(is_outside, false)) return;
    has_place = true;
    charged = pool_.now_();
    --client->outside;
    ++pool_.running_;
    pool_.hand_out();
  }

  Instant slice_began{};  ///< of its own thread

  // Guarded by the mutex.
  std::condition_variable turn;
  Client* client = nullptr;  ///< nullptr: it has no job
  Instant charged{};         ///< Client::used has its time until then
  bool has_place = false;
  bool is_outside = false;

 private:
  WorkPool& pool_;
};

/// Adds to Client::used, and forgets those that have nothing to do.
void WorkPool::charge() noexcept {
  const Instant now = now_();
  for (Worker* const worker : workers_) {
    if (!worker->has_place) continue;
    worker->client->used += now - worker->charged;
    worker->charged = now;
  }
  const auto is_idle = [](const Client& client) { return client.begun == 0 && client.jobs.empty(); };
  const Client* least = nullptr;
  for (const auto& [name, client] : clients_)
    if (!is_idle(client) && (!least || client.used < least->used)) least = &client;
  if (!least) {
    clients_.clear();
    used_ = Duration(0);
    return;
  }
  used_ = std::max(used_, least->used);
  for (auto at = clients_.begin(); at != clients_.end();) at = is_idle(at->second) && at->second.used <= used_ ? clients_.erase(at) : std::next(at);
}

/// Of the clients that wait, the one that has used the least.
WorkPool::Client* WorkPool::next(bool only_paused) noexcept {
  Client* first = nullptr;
  for (auto& [name, client] : clients_)
    if ((only_paused ? !client.paused.empty() : client.is_waiting()) && (!first || client.used < first->used)) first = &client;
  return first;
}

/// A thread will take one more job.
bool WorkPool::has_thread() noexcept {
  if (idle_ > begins_.size()) return true;
  if (threads_.size() >= max_running_ + max_paused) return false;
  try {
    // Before it starts: its handle must not be lost, and it needs the lock to begin.
    threads_.reserve(threads_.size() + 1);
    workers_.reserve(threads_.size() + 1);
    Result<Thread> started = start_thread(name_, options_, [this] { work(); });
    if (!started) return false;
    threads_.push_back(*std::move(started));
    ++idle_;
    return true;
  } catch (...) { return false; }
}

/// Gives free places to those whose turn it is. If there is no further thread, those with a thread precede; without any, requests get 503 at their time
/// limit.
void WorkPool::hand_out() noexcept {
  while (running_ < max_running_ && !stopping_) {
    Client* client = next(false);
    if (client && client->paused.empty() && !has_thread()) client = next(true);
    if (!client) return;
    waiting_.fetch_sub(1, std::memory_order_relaxed);
    ++running_;
    client->used += Duration(1);  // also if the clock stands still
    if (client->paused.empty()) {
      begins_.insert(client->jobs.extract(client->jobs.begin()));
      ++client->begun;
      changed_.notify_one();
      continue;
    }
    Worker& worker = *client->paused.front();
    client->paused.pop_front();
    worker.has_place = true;
    worker.charged = now_();
    worker.turn.notify_one();
  }
}

void WorkPool::put(std::vector<engine::BodyJob> jobs) noexcept {
  const std::lock_guard lock(mutex_);
  if (stopping_) return;
  charge();
  for (engine::BodyJob& job : jobs) try {
      Client& client = clients_[job.client];
      if (client.begun == 0 && client.jobs.empty()) client.used = std::max(client.used, used_);
      const std::size_t bytes = job.bytes;
      client.jobs.emplace(bytes, Entry{std::move(job), &client});
      waiting_.fetch_add(1, std::memory_order_relaxed);
    } catch (...) {}  // no memory
  hand_out();
}

void WorkPool::work() {
  Worker worker(*this);
  std::unique_lock lock(mutex_);
  if (stopping_) return;
  workers_.push_back(&worker);
  while (true) {
    changed_.wait(lock, [&] { return stopping_ || !begins_.empty(); });
    if (stopping_) return;
    --idle_;
    {
      Jobs::node_type job = begins_.extract(begins_.begin());
      worker.client = job.mapped().client;
      worker.has_place = true;
      worker.charged = worker.slice_began = now_();
      lock.unlock();
      Turns::set_current(&worker);
      job.mapped().job.run();
      Turns::set_current(nullptr);
    }
    lock.lock();
    charge();
    --worker.client->begun;
    worker.client = nullptr;
    worker.has_place = false;
    --running_;
    ++idle_;
    hand_out();
  }
}

void WorkPool::stop() noexcept {
  Jobs dropped;
  std::vector<Thread> threads;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    dropped.merge(begins_);
    for (auto& [name, client] : clients_) {
      dropped.merge(client.jobs);
      client.paused.clear();
    }
    for (Worker* const worker : workers_) {
      if (!worker->client || worker->has_place || worker->is_outside) continue;
      worker->has_place = true;
      ++running_;
      worker->turn.notify_one();
    }
    waiting_.store(0, std::memory_order_relaxed);
    workers_.clear();
    threads = std::move(threads_);
    changed_.notify_all();
  }
  for (Thread& thread : threads) thread.join();
}

namespace {

/// Threads for one list of jobs of the engine.
template <std::vector<engine::BodyJob> engine::Outputs::*jobs>
class Pool final : public Service {
 public:
  Pool(const char* name, unsigned threads, const ThreadOptions& options) : pool_(name, threads, options) {}
  void pass_on(engine::Outputs& outputs) override {
    if (!(outputs.*jobs).empty()) pool_.put(std::move(outputs.*jobs));
  }
  void stop() noexcept override { pool_.stop(); }

 private:
  WorkPool pool_;
};

}  // namespace

std::unique_ptr<Service> make_body_pool(SharedEngine& server) {
  const Threads& threads = server.options().threads;
  if (threads.body_threads == 0) return nullptr;
  return std::make_unique<Pool<&engine::Outputs::body_jobs>>("lrt-body", threads.body_threads, threads.own);
}

std::unique_ptr<Service> make_query_pool(SharedEngine& server) {
  const auto& query = server.options().query;
  if (!query) return nullptr;
  return std::make_unique<Pool<&engine::Outputs::query_jobs>>("lrt-query", std::max(1U, query->limits().threads), server.options().threads.own);
}

}  // namespace lrt
