// SPDX-License-Identifier: Apache-2.0
#include "src/transport/libwebsockets/log.hpp"

#include <libwebsockets.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lrt::libwebsockets {
namespace {

constexpr int quiet = LLL_ERR | LLL_WARN;
constexpr int usual = LLL_ERR | LLL_WARN | LLL_NOTICE;

struct Targets {
  std::mutex mutex;  // not held while a callback runs
  std::vector<std::pair<const Log*, std::shared_ptr<const LogCallback>>> list;
};

Targets& targets() {
  static auto* const all = new Targets;  // a thread may log while the process exits
  return *all;
}

/// A client can cause most of them, so that none is logged as an error.
void emit(int level, const char* line) noexcept {
  try {
    std::shared_ptr<const LogCallback> log;
    {
      const std::lock_guard lock(targets().mutex);
      if (!targets().list.empty()) log = targets().list.back().second;
    }
    std::string_view text(line);
    while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
    if (log && *log) (*log)(level == LLL_ERR ? LogLevel::warning : LogLevel::info, "libwebsockets: " + std::string(text));
  } catch (...) {}
}

}  // namespace

Log::Log(LogCallback log) {
  const std::lock_guard lock(targets().mutex);
  targets().list.emplace_back(this, std::make_shared<const LogCallback>(std::move(log)));
  lws_set_log_level(quiet, &emit);
}

Log::~Log() {
  const std::lock_guard lock(targets().mutex);
  auto& list = targets().list;
  list.erase(std::find_if(list.begin(), list.end(), [this](const auto& target) { return target.first == this; }));
  if (list.empty()) lws_set_log_level(usual, lwsl_emit_stderr);
}

}  // namespace lrt::libwebsockets
