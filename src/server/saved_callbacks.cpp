// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "src/server/saved_file.hpp"
#include "src/server/service.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {
namespace {

Unexpected not_usable(const Error& error) { return unexpected(error.code, "callbacks.file: " + error.message); }

/// The file of web callbacks. Another file in its place is an error and is not changed.
class SavedCallbacks final : public Service {
 public:
  explicit SavedCallbacks(SharedEngine& server) : server_(server), path_(server.options().callbacks.file) {}

  Result<void> prepare() override {
    const std::size_t max_bytes = std::max<std::size_t>(16 * 1024 * 1024, server_.options().callbacks.max_callbacks * 32 * 1024);
    Result<SavedFile::Claim> prepared = SavedFile::prepare(path_);
    if (!prepared) return not_usable(prepared.error());
    claim_ = *std::move(prepared);
    Result<std::optional<SavedFile::Content>> loaded = SavedFile::load(path_, max_bytes);
    if (!loaded) return not_usable(loaded.error());
    content_ = *std::move(loaded);
    return {};
  }
  Result<void> start() override {
    const std::optional<SavedFile::Content> content = std::exchange(content_, std::nullopt);
    if (content)
      if (Result<void> restored = restore(*content); !restored) return restored;
    file_.emplace(
        path_, [this](std::uint64_t revision, bool written) { server_.engine().saved(revision, written); }, server_.waking_log(),
        server_.options().threads.own, std::move(claim_));
    return {};
  }
  void take(engine::Outputs& outputs) override {
    if (file_ && outputs.saved) file_->save(std::move(outputs.saved->text), outputs.saved->revision);
  }

 private:
  /// A damaged file is restored as far as it can be read. A copy is kept.
  Result<void> restore(const SavedFile::Content& content) {
    engine::Engine& engine = server_.engine();
    const bool damaged = content.state == SavedFile::State::damaged;
    const Result<std::size_t> found = damaged ? Result<std::size_t>(0) : engine.restore(content.text);
    if (content.state == SavedFile::State::unmarked) {
      // Files of earlier versions have no first line.
      if (!content.text.empty() && found.value_or(0) == 0)
        return unexpected(
            Errc::invalid_option,
            "callbacks.file: \"" + path_ + "\": expected a file that lrt wrote, or none; found a file of another program. Choose another path");
      if (content.text.empty()) server_.log(LogLevel::warning, "the file \"" + path_ + "\" is empty: no subscription is restored");
    } else if (damaged || !found) {
      const auto [restored, unreadable] = engine.recover(content.text);
      const Result<std::string> copy = SavedFile::keep_copy(path_);
      server_.log(LogLevel::error,
                  "the file of subscriptions \"" + path_ + "\" was changed or truncated after lrt wrote it: " + std::to_string(restored) +
                      " subscriptions are restored, " + std::to_string(unreadable) + " parts cannot be read, others may be missing; the file " +
                      (copy ? "is kept as \"" + *copy + "\"" : "could not be kept: " + copy.error().message));
    }
    return {};
  }

  SharedEngine& server_;
  const std::string& path_;
  SavedFile::Claim claim_;                     ///< the same
  std::optional<SavedFile::Content> content_;  ///< until start()
  std::optional<SavedFile> file_;              ///< set by start(); writes the pending text when it is destroyed
};

}  // namespace

std::unique_ptr<Service> make_saved_callbacks(SharedEngine& server) {
  if (server.options().callbacks.file.empty()) return nullptr;
  return std::make_unique<SavedCallbacks>(server);
}

}  // namespace lrt
