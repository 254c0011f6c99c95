// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/subscription/options.hpp>

namespace lrt::delivery {
inline namespace v0 {
class Deliverer;
class Source;
}  // namespace v0
}  // namespace lrt::delivery

namespace lrt {
inline namespace v0 {

/// Web callbacks: receivers, retries, and how they are posted and kept.
/// @par Threads  Set-up only, as Options.
struct Callbacks : subscription::CallbackOptions {
  /// The file that stores web callbacks across restarts. Empty: they are not stored. A thread of lrt replaces it
  /// atomically after each change (also with Io::in_poll). It contains the callbacks' secrets and has mode 0600.
  /// Missing directories are created with mode 0700. Server::create() returns an error and changes nothing if that path
  /// (or `file` + ".new") has something other than a file of lrt, or if another process uses the file (a lock on `file`
  /// + ".lock"). If the file is damaged, what can be read is restored, the file is kept as `file` + ".damaged-1", and
  /// the log says so. Two servers of one process need different files.
  std::string file;
  /// Makes the deliverer. Empty: delivery::make_deliverer. Not called if `allow` is empty.
  std::function<Result<std::unique_ptr<delivery::Deliverer>>(delivery::Source&, const subscription::CallbackOptions&, LogCallback)> deliverer;
  /// The response to a request that creates a web callback (201) or cancels one (204) waits until `file` is on the
  /// disk; requests that arrive together are written together. If the file cannot be written, the response is 503 and
  /// nothing has changed: the new callback does not exist, the cancelled one continues. false: responses do not wait,
  /// and a crash loses what was not written yet.
  bool respond_when_saved = true;
  std::chrono::milliseconds save_timeout{10'000};  ///< how long a request waits for the file; then 503 as above
};

}  // namespace v0
}  // namespace lrt
