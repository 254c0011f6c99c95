// SPDX-License-Identifier: Apache-2.0
#include "src/server/body_pool.hpp"

#include <algorithm>
#include <utility>

#include "src/server/service.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {

void BodyQueue::put(engine::BodyJob job) {
  Client& client = clients_[job.client];
  if (client.jobs.empty()) client.work = std::max(client.work, now_);
  const std::size_t bytes = job.bytes;
  client.jobs.emplace(bytes, std::move(job));
  ++size_;
}

std::optional<engine::BodyJob> BodyQueue::take() {
  auto first = clients_.end();
  const auto end_of = [](const Client& client) { return client.work + client.jobs.begin()->first; };
  for (auto at = clients_.begin(); at != clients_.end();) {
    if (at->second.jobs.empty() && at->second.work <= now_) {
      at = clients_.erase(at);
      continue;
    }
    if (!at->second.jobs.empty() && (first == clients_.end() || end_of(at->second) < end_of(first->second))) first = at;
    ++at;
  }
  if (first == clients_.end()) return std::nullopt;
  Client& client = first->second;
  engine::BodyJob job = std::move(client.jobs.begin()->second);
  client.jobs.erase(client.jobs.begin());
  now_ = std::max(now_, client.work);
  client.work += job.bytes;
  if (--size_ == 0) clients_.clear();
  return job;
}

void BodyPool::put(std::vector<engine::BodyJob> jobs) {
  const std::lock_guard lock(mutex_);
  if (stopping_) return;
  for (engine::BodyJob& job : jobs) queue_.put(std::move(job));
  const std::size_t wanted = std::min(max_threads_, threads_.size() + jobs.size() - std::min(jobs.size(), idle_));
  while (threads_.size() < wanted) {
    Result<Thread> started = start_thread(name_, options_, [this] { work(); });
    if (!started) break;  // the running threads do the work; if there is none, the requests get 503 at their time limit
    threads_.push_back(*std::move(started));
  }
  changed_.notify_all();
}

void BodyPool::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    ++idle_;
    changed_.wait(lock, [&] { return stopping_ || !queue_.empty(); });
    --idle_;
    if (stopping_) return;
    std::optional<engine::BodyJob> job = queue_.take();
    lock.unlock();
    job->run();
    job.reset();
    lock.lock();
  }
}

void BodyPool::stop() noexcept {
  std::vector<Thread> threads;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
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
  BodyPool pool_;
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
