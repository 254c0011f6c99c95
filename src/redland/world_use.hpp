// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/redland.hpp>

#include "src/base/thread.hpp"

namespace lrt::redland {

/// A librdf_world with models that are attached: the thread that uses it, and what it says of failures. There is one for each, so that two models of a
/// world have the same thread.
///
/// @par Threads  enter(), post(), is_owner(): any. The rest: the owner's.
class WorldUse {
 public:
  /// @par Errors  duplicate_path: the model is attached; invalid_option: another Owner than the other models of the world have; io_error: no thread
  static Result<std::shared_ptr<WorldUse>> enter(librdf_model* model, const Options& options);
  /// The model is used no longer.
  void leave(librdf_model* model) noexcept;
  ~WorldUse();
  WorldUse(const WorldUse&) = delete;
  WorldUse& operator=(const WorldUse&) = delete;

  Owner owner() const noexcept { return owner_; }
  librdf_world* world() const noexcept { return world_; }
  /// Runs a job, which does not throw, on the thread of lrt.
  /// @pre  Owner::thread
  void post(UniqueFunction<void()> job);
  /// The calling thread is that of lrt.
  bool is_owner() const noexcept { return thread_.is_current(); }

  /// While one exists, what librdf says of errors is kept here. One at a time.
  class Listening {
   public:
    explicit Listening(WorldUse& use) noexcept : use_(use) { use_.listening_ = this; }
    ~Listening() { use_.listening_ = nullptr; }
    Listening(const Listening&) = delete;
    Listening& operator=(const Listening&) = delete;
    /// The first error since the last call, in well-formed UTF-8 without control characters; empty: there was none.
    std::string take();

   private:
    friend class WorldUse;
    WorldUse& use_;
    std::string said_;
  };

 private:
  struct Table;
  static Table& table();
  struct Jobs;

  WorldUse(librdf_world* world, const Options& options) noexcept
      : world_(world), owner_(options.owner), logger_(options.logger), logger_data_(options.logger_data) {}
  static int said(void* user, librdf_log_message* message) noexcept;

  librdf_world* const world_;
  const Owner owner_;
  librdf_log_func logger_;
  void* logger_data_;
  std::size_t models_ = 0;  ///< guarded by the table
  Listening* listening_ = nullptr;
  std::shared_ptr<Jobs> jobs_;
  Thread thread_;
};

}  // namespace lrt::redland
