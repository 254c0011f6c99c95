// SPDX-License-Identifier: Apache-2.0
#include "src/mirror/state.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include "src/base/read_file.hpp"
#include "src/base/replace_file.hpp"

namespace lrt::mirror {
namespace {

constexpr std::string_view begin_of_file = "lrt mirror ", begin_of_header = "lrt mirror 2\t", begin_of_first_version = "lrt mirror 1\t";
constexpr mode_t file_mode = 0600;  // names of robots and their parts

Error system_error(const std::string& what, const std::string& path) {
  return {Errc::io_error, what + " \"" + path + "\": " + std::generic_category().message(errno)};
}

/// Removes the characters that a record cannot contain. IRIs and entity tags have no white space.
std::string field(std::string_view text) {
  std::string result;
  for (const char c : text)
    if (static_cast<unsigned char>(c) > 0x20) result += c;
  return result;
}

std::string record_of(const StoredGraph& graph) {
  const std::string begin = field(graph.graph) + "\t" + field(graph.robot);
  if (graph.digest.empty()) return "unknown\t" + begin + "\n";
  return "known\t" + begin + "\t" + graph.digest + "\t" + field(graph.entity_tag) + "\t" + field(graph.echo) + "\t" + field(graph.robot_tag) + "\t" +
         (graph.is_watchable ? "w" : "") + "\n";
}

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> result;
  while (true) {
    const std::size_t tab = line.find('\t');
    result.push_back(line.substr(0, tab));
    if (tab == std::string_view::npos) return result;
    line.remove_prefix(tab + 1);
  }
}

bool write_all(int descriptor, std::string_view bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Reads the records. A last line without a line feed was not written completely, and does not count.
Result<std::vector<StoredGraph>> parse(std::string_view text, const std::string& path, const std::string& store, std::size_t max_graphs) {
  const auto invalid = [&](const std::string& what) { return unexpected(Errc::invalid_option, "\"" + path + "\" " + what); };
  const std::size_t end_of_header = text.find('\n');
  const std::string_view header = text.substr(0, end_of_header);
  const std::string_view begin = header.substr(0, begin_of_header.size());
  const bool is_first_version = begin == begin_of_first_version;
  if (end_of_header == std::string_view::npos || (begin != begin_of_header && !is_first_version)) return invalid("is not a state file of a mirror");
  if (const std::string_view other = header.substr(begin_of_header.size()); other != field(store))
    return invalid("is the state of a mirror to another store, \"" + std::string(other) + "\"");
  std::map<std::string, StoredGraph, std::less<>> graphs;
  text.remove_prefix(end_of_header + 1);
  while (true) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) break;
    const std::vector<std::string_view> parts = fields_of(text.substr(0, end));
    text.remove_prefix(end + 1);
    const std::size_t fields_of_known = is_first_version ? 5 : 8;
    const bool is_known = parts.size() == fields_of_known && parts[0] == "known", is_unknown = parts.size() == 3 && parts[0] == "unknown";
    if (is_known || is_unknown) {
      StoredGraph& graph = graphs[std::string(parts[1])];
      graph = {};
      graph.graph = parts[1], graph.robot = parts[2];
      if (is_known && !is_first_version) {
        graph.digest = parts[3], graph.entity_tag = parts[4], graph.echo = parts[5], graph.robot_tag = parts[6];
        graph.is_watchable = parts[7] == "w";
      }
      if (graphs.size() > max_graphs)
        return unexpected(Errc::limit_exceeded, "\"" + path + "\" has more than " + std::to_string(max_graphs) + " graphs");
    } else if (parts.size() == 2 && parts[0] == "forgotten") {
      graphs.erase(std::string(parts[1]));
    } else {
      return invalid("has a line that is not a record");
    }
  }
  std::vector<StoredGraph> result;
  for (auto& [name, graph] : graphs) result.push_back(std::move(graph));
  return result;
}

/// The most bytes of a file: a graph has two IRIs of up to 8 KiB, and the file may be twice as long as its content before it is shortened.
std::size_t max_file_bytes(std::size_t max_graphs) noexcept {
  return std::min(max_graphs, std::size_t{1} << 17) * 2 * std::size_t{20 * 1024} + 2 * MirrorState::min_excess;
}

/// The path names the open file.
bool names(const std::string& path, int descriptor) noexcept {
  struct stat opened {
  }, named{};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

}  // namespace

Result<std::unique_ptr<MirrorState>> MirrorState::open(const std::string& path, const std::string& store, std::size_t max_graphs) {
  int lock = -1;
  for (int attempts = 0; lock < 0; ++attempts) {
    lock = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, file_mode);
    if (lock < 0) return unexpected(Errc::invalid_option, system_error("cannot write", path).message);
    const bool is_locked = ::flock(lock, LOCK_EX | LOCK_NB) == 0;
    const bool is_same = names(path, lock);
    if (is_locked && is_same) break;
    ::close(lock);
    lock = -1;
    constexpr int max_attempts = 100;
    if ((!is_locked && is_same) || attempts >= max_attempts) return unexpected(Errc::invalid_option, "\"" + path + "\" is used by another mirror");
  }
  std::unique_ptr<MirrorState> state(new MirrorState(path, store, max_graphs, lock));
  Result<std::vector<StoredGraph>> graphs = state->read();
  if (!graphs) return unexpected(std::move(graphs).error());
  if (Result<void> replaced = state->replace(*graphs); !replaced) return unexpected(std::move(replaced).error());
  state->graphs_ = *std::move(graphs);
  return state;
}

MirrorState::~MirrorState() { ::close(descriptor_); }

Result<std::vector<StoredGraph>> MirrorState::read() const {
  const std::size_t max_bytes = max_file_bytes(max_graphs_);
  const Result<std::string> text = read_file(path_, max_bytes);
  if (!text) return unexpected(text.error());
  if (text->size() > max_bytes) return unexpected(Errc::limit_exceeded, "\"" + path_ + "\" is longer than " + std::to_string(max_bytes) + " bytes");
  if (text->empty()) return std::vector<StoredGraph>{};
  return parse(*text, path_, store_, max_graphs_);
}

/// A reader finds the old file or the new one. The new one is locked before it has its name.
Result<void> MirrorState::replace(const std::vector<StoredGraph>& graphs) {
  std::string text = std::string(begin_of_header) + field(store_) + "\n";
  for (const StoredGraph& graph : graphs) text += record_of(graph);
  Replaced replaced = replace_file(path_, {text}, {begin_of_file, file_mode, true});
  if (!replaced.file) return file_error(*replaced.failure, path_);
  ::close(std::exchange(descriptor_, replaced.file.release()));  // and the lock of the file that was replaced
  bytes_ = text.size();
  shorten_at_ = 2 * bytes_ + min_excess;
  return replaced.failure ? file_error(*replaced.failure, path_) : Result<void>();
}

/// If that fails, the longer file has the same content, and a later record tries again.
void MirrorState::shorten() {
  if (bytes_ < shorten_at_) return;
  const Result<std::vector<StoredGraph>> graphs = read();
  if (!graphs || !replace(*graphs)) shorten_at_ = bytes_ + min_excess;
}

/// A state with a missing record would be trusted. Therefore the file is removed after an error.
Result<void> MirrorState::fail() {
  error_ = system_error("cannot write", path_);
  ::unlink(path_.c_str());
  return unexpected(*error_);
}

Result<void> MirrorState::write(const std::string& lines) {
  if (error_) return unexpected(*error_);
  // Somebody has removed it, as with its directory: another mirror may have its name now.
  if (!names(path_, descriptor_)) {
    error_ = Error{Errc::io_error, "\"" + path_ + "\" was removed or replaced while it was in use"};
    return unexpected(*error_);
  }
  if (!write_all(descriptor_, lines)) return fail();
  bytes_ += lines.size();
  shorten();
  return {};
}

Result<void> MirrorState::write_known(const std::vector<StoredGraph>& graphs) {
  std::string lines;
  for (const StoredGraph& graph : graphs) lines += record_of(graph);
  return write(lines);
}

Result<void> MirrorState::write_unknown(const StoredGraph& graph, bool durably) {
  StoredGraph unknown;
  unknown.graph = graph.graph, unknown.robot = graph.robot;
  if (Result<void> written = write(record_of(unknown)); !written) return written;
  if (!durably || ::fdatasync(descriptor_) == 0) return {};
  return fail();
}

Result<void> MirrorState::write_forgotten(const std::string& graph) { return write("forgotten\t" + field(graph) + "\n"); }

}  // namespace lrt::mirror
