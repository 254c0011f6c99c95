// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include <lrt/client/recording.hpp>

#include "tools/lrt/observing.hpp"

namespace lrt::tool {

using std::chrono::steady_clock;

namespace {

struct RecordOptions {
  ObserveOptions observe;
  std::string file;
  bool force = false;
};

/// A file to which whole lines are written.
class LineFile {
 public:
  LineFile() = default;
  ~LineFile() {
    if (descriptor_ > STDERR_FILENO) ::close(descriptor_);
  }
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  Result<void> open(const std::string& name, bool force) {
    name_ = name;
    descriptor_ = name == "-" ? STDOUT_FILENO : ::open(name.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (force ? O_TRUNC : O_EXCL), 0666);
    if (descriptor_ >= 0) return {};
    if (errno == EEXIST) return unexpected(Errc::invalid_option, "\"" + name + "\" exists; --force replaces it");
    return unexpected(Errc::invalid_option, "cannot write \"" + name + "\": " + std::strerror(errno));
  }
  Result<void> write(std::string_view line) {
    while (!line.empty()) {
      const ssize_t written = ::write(descriptor_, line.data(), line.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return unexpected(Errc::failed, "cannot write \"" + name_ + "\": " + std::strerror(errno));
      line.remove_prefix(static_cast<std::size_t>(written));
    }
    return {};
  }
  bool is_pipe_closed() const noexcept { return descriptor_ == STDOUT_FILENO && errno == EPIPE; }

 private:
  std::string name_;
  int descriptor_ = -1;
};

Result<int> record(Session& session, RecordOptions& options) {
  Observer observer(session, options.observe);
  if (Result<void> found = observer.find(); !found) return unexpected(std::move(found).error());
  LineFile file;
  if (Result<void> opened = file.open(options.file, options.force); !opened) return unexpected(std::move(opened).error());
  const std::string robot = session.options().robot.empty() ? observer.url(0) : session.options().robot;
  if (Result<void> written = file.write(to_line(client::RecordingHeader{robot, utc(std::chrono::system_clock::now())})); !written)
    return unexpected(std::move(written).error());
  std::optional<Error> error;
  bool pipe_closed = false;
  std::size_t values = 0;
  const auto start = steady_clock::now();
  ObserveHooks hooks;
  hooks.on_change = [&](const Observed& seen) {
    client::RecordedChange change;
    change.at = std::max(std::chrono::duration_cast<std::chrono::microseconds>(seen.received - start), std::chrono::microseconds(0));
    change.name = observer.name(seen.property);
    if (seen.kind == Observed::Kind::value) {
      change.value = seen.value.json;
      change.unit = seen.value.unit;
      change.source_time = seen.source_time;
      ++values;
    } else {
      change.gap = seen.reason;
    }
    Result<void> written = file.write(to_line(change));
    if (written) return true;
    pipe_closed = file.is_pipe_closed();
    error = std::move(written).error();
    return false;
  };
  Result<int> result = observer.run(hooks);
  if (pipe_closed) return Exit::pipe_closed;
  if (error) return unexpected(*std::move(error));
  if (session.terminal().shows_progress() && options.file != "-") session.warn(std::to_string(values) + " values in \"" + options.file + "\"");
  return result;
}

}  // namespace

void add_record(CommandLine& line) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* const command = line.add("record", "Write the changes of properties to a file that lrt replay reads",
                                     "Ctrl-C ends it; the file is complete at any time. Examples:\n"
                                     "  lrt record right_s0/position right_s1/position -o wave.jsonl --for 10",
                                     options, record);
  add_observe_options(*command, options->observe);
  command->add_option("-o,--output", options->file, "The file; - is standard output")->required()->type_name("FILE");
  command->add_flag("-f,--force", options->force, "Replace the file if it exists");
}

}  // namespace lrt::tool
