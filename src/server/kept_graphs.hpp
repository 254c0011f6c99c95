// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>

#include "src/model/graph_state.hpp"
#include "src/server/saved_file.hpp"

namespace lrt {
inline namespace v0 {

/// The graphs of Worlds that have a file (GraphOptions::file): restores them, and saves each change.
/// @par Threads  Any.
class KeptGraphs {
 public:
  /// A graph with its file, from opening it until the World is removed.
  class Kept {
   public:
    Kept(std::shared_ptr<model::GraphState> state, SavedFile::Claim claim) : state_(std::move(state)), claim_(std::move(claim)) {}
    ~Kept();
    Kept(const Kept&) = delete;
    Kept& operator=(const Kept&) = delete;
    const model::GraphState& state() const noexcept { return *state_; }
    void begin(LogCallback log, ThreadOptions threads);

   private:
    const std::shared_ptr<model::GraphState> state_;
    SavedFile::Claim claim_;
    std::unique_ptr<SavedFile> file_;
  };
  using Opened = std::vector<std::unique_ptr<Kept>>;

  /// Restores the graphs of a World that have a file. Their changes are saved from here on, for as long as the result lives.
  /// @par Errors  as SavedFile::prepare() and load(); invalid_option: a file of another program; expected_value, limit_exceeded: the kept graph does not
  ///              conform to the shapes, or exceeds the limits
  static Result<Opened> open(const model::WorldSpec& world, const LogCallback& log, const ThreadOptions& threads);

  /// Stores the open files of an added World.
  void add(Opened opened);
  /// The World at a path, and those below, were removed: the last changes are written.
  void remove(const std::string& path);
  void clear();

 private:
  std::mutex mutex_;  // guards all_
  Opened all_;
};

}  // namespace v0
}  // namespace lrt
