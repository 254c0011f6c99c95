// SPDX-License-Identifier: Apache-2.0
#include "src/redland/world_use.hpp"

#include <map>
#include <set>
#include <utility>

#include <lrt/base/immortal.hpp>

#include "src/base/utf8.hpp"

namespace lrt::redland {

/// A librdf_world has no room for a note of ours, and two models of one do not know each other.
struct WorldUse::Table {
  std::mutex mutex;  // guards both of them
  std::map<librdf_world*, std::weak_ptr<WorldUse>> worlds;
  std::set<librdf_model*> models;
};

WorldUse::Table& WorldUse::table() {
  static Immortal<Table> all;
  return *all;
}

struct WorldUse::Jobs {
  std::mutex mutex;  // guards the rest
  std::condition_variable came;
  std::deque<UniqueFunction<void()>> waiting;
  bool is_over = false;

  void run() {
    std::unique_lock lock(mutex);
    while (true) {
      while (waiting.empty() && !is_over) came.wait(lock);
      if (waiting.empty()) return;
      UniqueFunction<void()> job = std::move(waiting.front());
      waiting.pop_front();
      lock.unlock();
      job();
      job = {};  // without the lock
      lock.lock();
    }
  }
};

Result<std::shared_ptr<WorldUse>> WorldUse::enter(librdf_model* model, const Options& options) {
  librdf_storage* const storage = librdf_model_get_storage(model);
  librdf_world* const world = storage ? librdf_storage_get_world(storage) : nullptr;
  if (!world) return unexpected(Errc::invalid_option, "the librdf_model has no storage");
  Table& all = table();
  const std::lock_guard lock(all.mutex);
  if (all.models.count(model) != 0) return unexpected(Errc::duplicate_path, "the librdf_model is attached already: detach() it first");
  std::shared_ptr<WorldUse> use = all.worlds[world].lock();
  if (use && use->models_ == 0) use = nullptr;  // it is about to end
  if (use && use->owner_ != options.owner)
    return unexpected(Errc::invalid_option,
                      "Options::owner: another model of this librdf_world is attached with the other one, and librdf has no locks");
  if (!use) {
    use.reset(new WorldUse(world, options));
    if (options.owner == Owner::thread) {
      use->jobs_ = std::make_shared<Jobs>();
      Result<Thread> thread = start_thread("lrt-redland", {}, [jobs = use->jobs_] { jobs->run(); });
      if (!thread) return Unexpected{std::move(thread).error()};
      use->thread_ = *std::move(thread);
    }
    librdf_world_set_logger(world, use.get(), &WorldUse::said);
    all.worlds[world] = use;
  }
  all.models.insert(model);
  ++use->models_;
  return use;
}

void WorldUse::leave(librdf_model* model) noexcept {
  Table& all = table();
  const std::lock_guard lock(all.mutex);
  all.models.erase(model);
  if (--models_ > 0) return;
  librdf_world_set_logger(world_, logger_data_, logger_);
  all.worlds.erase(world_);
}

WorldUse::~WorldUse() {
  if (!jobs_) return;
  {
    const std::lock_guard lock(jobs_->mutex);
    jobs_->is_over = true;
    jobs_->came.notify_all();
  }
  if (thread_.is_current()) thread_.detach();
}

void WorldUse::post(UniqueFunction<void()> job) {
  const std::lock_guard lock(jobs_->mutex);
  jobs_->waiting.push_back(std::move(job));
  jobs_->came.notify_one();
}

/// 0: librdf writes it to stderr.
int WorldUse::said(void* user, librdf_log_message* message) noexcept {
  auto& use = *static_cast<WorldUse*>(user);
  const bool is_error = librdf_log_message_level(message) >= LIBRDF_LOG_ERROR;
  if (!use.listening_ || !is_error) return use.logger_ ? use.logger_(use.logger_data_, message) : 0;
  try {
    const char* const text = librdf_log_message_message(message);
    if (use.listening_->said_.empty()) use.listening_->said_ = text && *text != 0 ? text : "an error without a reason";
  } catch (...) {}  // no memory for the reason
  return 1;
}

std::string WorldUse::Listening::take() {
  constexpr std::size_t most = 400;
  std::string text = std::exchange(said_, {});
  if (const auto bad = utf8::find_invalid(text)) text.resize(*bad);
  std::string clean(utf8::prefix(text, most));
  for (char& c : clean)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  return clean;
}

}  // namespace lrt::redland
