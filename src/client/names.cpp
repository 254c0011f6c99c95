// SPDX-License-Identifier: Apache-2.0
#include "src/client/names.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "src/base/thread.hpp"

namespace lrt::client {

using exchange::Instant;

namespace {
constexpr std::size_t max_running = 8;
constexpr std::size_t max_known = 256;
constexpr std::chrono::seconds known_time{30};
}  // namespace

struct NameResolver::State {
  struct Known {
    Result<std::vector<Address>> addresses;
    Instant until;
  };

  State(ThreadOptions options, Resolve look_up) : threads(std::move(options)), resolve(std::move(look_up)) {}

  const ThreadOptions threads;
  const Resolve resolve;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> running;
  std::map<std::string, Known> known;
};

NameResolver::NameResolver(ThreadOptions threads, Resolve resolve) : state_(std::make_shared<State>(std::move(threads), std::move(resolve))) {}

Result<std::vector<Address>> NameResolver::find(const std::string& host, exchange::WaitLimit limit) {
  if (std::optional<Address> literal = literal_address(host)) return std::vector<Address>{*std::move(literal)};
  std::unique_lock lock(state_->mutex);
  while (true) {
    const Instant now = std::chrono::steady_clock::now();
    if (const auto found = state_->known.find(host); found != state_->known.end()) {
      if (found->second.until > now) return found->second.addresses;
      state_->known.erase(found);
    }
    if (now >= limit.until) return unexpected(Errc::timed_out, "resolving \"" + host + "\" timed out");
    if (std::find(state_->running.begin(), state_->running.end(), host) == state_->running.end()) {
      if (state_->running.size() >= max_running) return unexpected(Errc::limit_exceeded, "too many names are being resolved");
      Result<Thread> thread = start_thread("lrt-names", state_->threads, [state = state_, host] {
        try {
          Result<std::vector<Address>> found = state->resolve(host);
          const std::lock_guard guard(state->mutex);
          if (state->known.size() >= max_known) state->known.clear();
          // A failure is kept for a moment only, for the threads that wait for it.
          const Instant until = std::chrono::steady_clock::now() + (found ? std::chrono::milliseconds(known_time) : std::chrono::milliseconds(200));
          state->known.insert_or_assign(host, State::Known{std::move(found), until});
        } catch (...) {}  // out of memory: waiting threads try again
        const std::lock_guard guard(state->mutex);
        state->running.erase(std::find(state->running.begin(), state->running.end(), host));
        state->changed.notify_all();
      });
      if (!thread) return unexpected(std::move(thread).error());
      thread->detach();
      state_->running.push_back(host);
    }
    state_->changed.wait_until(lock, limit.until);
  }
}

}  // namespace lrt::client
