// SPDX-License-Identifier: Apache-2.0
#include "src/server/journal.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <iterator>
#include <mutex>
#include <vector>

#include "src/base/replace_file.hpp"
#include "src/base/thread.hpp"
#include "src/server/journal_format.hpp"
#include "src/server/saved_file.hpp"

namespace lrt {
namespace {

using Failure = std::optional<FileFailure>;
using Instant = std::chrono::steady_clock::time_point;

constexpr std::chrono::seconds journal_retry_pause{1}, log_pause{60}, journal_last_time{5};
/// About what a change that waits takes in memory, besides its text.
constexpr std::size_t record_overhead = 512;
constexpr std::size_t part_size = std::size_t{64} * 1024, buffer_size = std::size_t{256} * 1024;
/// A new file is given its name when this much or less is missing in it.
constexpr std::uint64_t short_rest = std::uint64_t{64} * 1024;

Failure write_at(int file, std::string_view bytes, std::uint64_t offset) noexcept {
  while (!bytes.empty()) {
    const auto put = ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return FileFailure{"writing", put == 0 ? ENOSPC : errno};
    bytes.remove_prefix(static_cast<std::size_t>(put));
    offset += static_cast<std::uint64_t>(put);
  }
  return std::nullopt;
}

Failure sync(int file) noexcept {
  while (::fdatasync(file) != 0)
    if (errno != EINTR) return FileFailure{"writing", errno};
  return std::nullopt;
}

std::optional<FoundJournal::Key> key_of(int file) noexcept {
  struct stat about {};
  return ::fstat(file, &about) == 0 ? std::optional(FoundJournal::Key(about.st_dev, about.st_ino)) : std::nullopt;
}

/// Reads an open file.
struct Source {
  int file;
  const std::string& path;
  Result<std::size_t> operator()(std::uint64_t offset, char* to, std::size_t size) const {
    std::size_t done = 0;
    while (done < size) {
      const auto got = ::pread(file, to + done, size - done, static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return file_error({"reading", errno}, path);
      if (got == 0) break;
      done += static_cast<std::size_t>(got);
    }
    return done;
  }
};

/// A journal beside the one in use, until it is given its name. It is removed if it is not.
class NewJournal {
 public:
  NewJournal(std::string path, std::atomic<std::uint64_t>& progress) : path_(std::move(path)), fresh_(path_ + ".new"), progress_(progress) {}
  ~NewJournal() {
    if (made_.file) ::unlink(fresh_.c_str());
  }
  NewJournal(const NewJournal&) = delete;
  NewJournal& operator=(const NewJournal&) = delete;

  Failure begin(const rdf::Graph& graph, const std::atomic<bool>& stops) {
    if (!check_leftover(path_, journal::mark) && !check_leftover(path_, "# lrt 1: ")) return FileFailure{"another file is beside", EEXIST};
    if (::unlink(fresh_.c_str()) != 0 && errno != ENOENT) return FileFailure{"removing what was left beside", errno};
    made_.file = Descriptor(::open(fresh_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (!made_.file) return FileFailure{"opening a file beside", errno};
    buffer_ = journal::first_line;
    model::GraphChanges lines;
    for (const rdf::Triple& t : graph.match(std::nullopt, std::nullopt, std::nullopt)) {
      lines.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
      if (lines.text().size() < part_size) continue;
      if (stops) return FileFailure{"ending before writing", ECANCELED};
      if (auto failure = put(journal::Kind::part, lines.text())) return failure;
      lines.drop();
    }
    if (!lines.text().empty())
      if (auto failure = put(journal::Kind::part, lines.text())) return failure;
    auto failure = put(journal::Kind::begin, {});
    made_.content_size = made_.size + buffer_.size();
    return failure;
  }
  /// Nobody sees a record before all of them are on the disk, so that each may say that those before it are.
  Failure put(journal::Kind kind, std::string_view content) {
    journal::append(buffer_, kind, made_.number, made_.number - 1, content);
    ++made_.number;
    return buffer_.size() < buffer_size ? std::nullopt : flush();
  }
  /// Copies the changes of another journal.
  Failure copy(int file, std::uint64_t from, std::uint64_t number, std::uint64_t to, const std::atomic<bool>& stops, std::uint64_t& next_number) {
    Source source{file, path_};
    journal::Reader reader(source, to, from, number);
    while (reader.offset() < to) {
      if (stops) return FileFailure{"ending before writing", ECANCELED};
      const auto record = reader.next();
      if (!record || !*record) return FileFailure{"reading", EIO};
      if ((*record)->kind != journal::Kind::change) continue;
      if (auto failure = put(journal::Kind::change, (*record)->content)) return failure;
    }
    next_number = reader.number();
    return std::nullopt;
  }
  Failure to_disk() {
    if (auto failure = flush()) return failure;
    return sync(made_.file.get());
  }
  /// Replaces the file at the path, which must be the one with that key, or none.
  /// @param named  set if the new file has the name, also if the directory could not be written
  Failure give_name(const std::optional<FoundJournal::Key>& replaces, JournalFile& named) {
    if (auto failure = to_disk()) return failure;
    struct stat about {};
    const bool is_there = ::lstat(path_.c_str(), &about) == 0;
    if (!is_there && errno != ENOENT) return FileFailure{"examining", errno};
    if (is_there && (!replaces || *replaces != FoundJournal::Key(about.st_dev, about.st_ino)))
      return FileFailure{"another file is in the place of", EEXIST};
    if (::rename(fresh_.c_str(), path_.c_str()) != 0) return FileFailure{"replacing", errno};
    named = std::move(made_);
    return write_directory(directory_of(path_));
  }

 private:
  Failure flush() {
    if (auto failure = write_at(made_.file.get(), buffer_, made_.size)) return failure;
    made_.size += buffer_.size();
    buffer_.clear();
    progress_.fetch_add(1, std::memory_order_relaxed);
    return std::nullopt;
  }

  const std::string path_, fresh_;
  std::atomic<std::uint64_t>& progress_;
  JournalFile made_{};
  std::string buffer_;
};

Unexpected at_place(Errc code, const std::string& path, std::uint64_t offset, const std::string& what) {
  return unexpected(code, "\"" + path + "\", byte " + std::to_string(offset) + ": " + what);
}

}  // namespace

// ------------------------------------------------------------------------------------------------------------------ read

Result<FoundJournal> open_journal(const std::string& given, FunctionRef<Result<void>(std::string_view changes)> take) {
  const std::string path = followed(given);
  FoundJournal found;
  Descriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!file) {
    if (errno == ENOENT) return found;
    return file_error({"opening", errno}, path);
  }
  struct stat about {};
  if (::fstat(file.get(), &about) != 0) return file_error({"examining", errno}, path);
  if (!S_ISREG(about.st_mode))
    return unexpected(Errc::invalid_option,
                      "\"" + path + "\": expected a file that lrt wrote, or none; found " + kind_of_file(about.st_mode) + ". Choose another path");
  const auto size = static_cast<std::uint64_t>(about.st_size);
  found.kind = FoundJournal::Kind::earlier;
  found.key = FoundJournal::Key(about.st_dev, about.st_ino);

  const Source source{file.get(), path};
  std::string line(journal::first_line.size(), '\0');
  Result<std::size_t> got = source(0, line.data(), line.size());
  if (!got) return Unexpected{std::move(got).error()};
  line.resize(*got);
  if (line.size() < journal::first_line.size() || line.substr(0, journal::mark.size()) != journal::mark) return found;  // the caller reads it
  if (line != journal::first_line)
    return at_place(Errc::invalid_option, path, journal::mark.size(),
                    "expected version 1 of a journal of lrt, found " +
                        line.substr(journal::mark.size(), line.find('\n', journal::mark.size()) - journal::mark.size()) +
                        "; a newer lrt may have written it. Use that, or choose another path");

  journal::Reader reader(source, size, line.size(), 1);
  bool is_begun = false;
  while (true) {
    const std::uint64_t offset = reader.offset();
    Result<std::optional<journal::Reader::Record>> record = reader.next();
    if (!record) return Unexpected{std::move(record).error()};
    if (!*record) break;
    const journal::Reader::Record& r = **record;
    const bool is_content = r.kind == journal::Kind::part || r.kind == journal::Kind::begin;
    if (is_content == is_begun) return at_place(Errc::io_error, path, offset, "a record that does not follow the one before it");
    if (Result<void> taken = take(r.content); !taken) {
      Error error = taken.error();
      error.message = "\"" + path + "\", the record at byte " + std::to_string(offset) + ": " + error.message;
      return Unexpected{std::move(error)};
    }
    if (r.kind == journal::Kind::change) ++found.changes;
    if (r.kind != journal::Kind::begin) continue;
    is_begun = true;
    found.file.content_size = reader.offset();
  }
  found.torn = size - reader.offset();
  bool is_damaged = !is_begun;  // a journal has its name when it has its first content
  if (!is_damaged && found.torn > 0) {
    Result<bool> damaged = reader.is_damaged();
    if (!damaged) return Unexpected{std::move(damaged).error()};
    is_damaged = *damaged;
  }
  if (is_damaged)
    return at_place(Errc::io_error, path, reader.offset(),
                    "record " + std::to_string(reader.number()) +
                        " was changed or is missing, which is no trace of a crash. Put a copy in its place, or move the file away");
  // What follows says that these records are on the disk.
  if (found.torn > 0 && ::ftruncate(file.get(), static_cast<off_t>(reader.offset())) != 0) return file_error({"cutting", errno}, path);
  if (auto failure = sync(file.get())) return file_error(*failure, path);
  ::unlink((path + ".new").c_str());  // of a compaction that was interrupted
  found.kind = FoundJournal::Kind::journal;
  found.file.file = std::move(file);
  found.file.size = reader.offset();
  found.file.number = reader.number();
  return found;
}

// ----------------------------------------------------------------------------------------------------------------- write

/// Shared with its thread, which is detached if the disk does not respond.
class Journal::Writer final : public model::ChangeJournal, public std::enable_shared_from_this<Writer> {
 public:
  Writer(std::shared_ptr<model::GraphState> state, FoundJournal found, Options options)
      : state_(std::move(state)),
        path_(followed(state_->options().file)),
        threads_(std::move(options.threads)),
        compact_beyond_(options.compact_beyond),
        begins_anew_(found.kind != FoundJournal::Kind::journal),
        file_(std::move(found.file)),
        key_(found.key),
        claim_(std::move(options.claim)),
        log_(std::move(options.log)) {}

  /// A file of an earlier release is replaced now.
  void convert() {
    const std::lock_guard lock(mutex_);
    must_write_ = start();
    changed_.notify_all();
  }

  bool has_room(std::size_t bytes) noexcept override {
    const std::lock_guard lock(mutex_);
    return bytes <= max_bytes() && queued_bytes_ <= max_bytes() - bytes && start();
  }

  bool append(const std::string& changes, std::uint64_t number, bool is_waited) override {
    const std::lock_guard lock(mutex_);
    const bool joins = is_waited && std::any_of(queue_.rbegin(), queue_.rend(), [](const Record& r) { return r.is_waited; });
    const bool is_first = !waits_for_retry();
    if (!is_waited && (is_whole_due_ || changes.size() > max_bytes() || queued_bytes_ > max_bytes() - changes.size())) {
      if (!is_whole_due_) write_whole();
      ++left_out_;
    } else {
      queue_.push_back({changes, is_waited});
      queued_bytes_ += changes.size() + record_overhead;
    }
    last_number_ = number;
    if (is_waited || is_first || !has_failed_) must_write_ = true;
    (void)start();
    count();
    changed_.notify_all();
    return joins;
  }

  void drop_waited() noexcept override {
    const std::lock_guard lock(mutex_);
    queue_.erase(std::remove_if(queue_.begin(), queue_.end(), [](const Record& r) { return r.is_waited; }), queue_.end());
    count_bytes();
    count();
  }

  void finish() noexcept {
    std::unique_lock lock(mutex_);
    ending_ = stops_compacting_ = true;
    changed_.notify_all();
    if (!thread_.joinable()) {
      lock.unlock();
      return run();  // none could be started, or nothing was written
    }
    for (std::uint64_t seen = progress_; !over_; seen = progress_)
      if (!changed_.wait_for(lock, journal_last_time, [&] { return over_; }) && progress_ == seen) break;
    if (over_) {
      lock.unlock();
      thread_.join();
      return;
    }
    thread_.detach();
    lock.unlock();
    const std::lock_guard logging(log_mutex_);
    log_ = nullptr;  // of the owner, which may be destroyed now
  }

 private:
  struct Record {
    std::string changes;
    bool is_waited;
  };
  struct Compaction {
    Compaction(const std::string& path, std::atomic<std::uint64_t>& progress, std::uint64_t old_size, std::uint64_t old_number)
        : fresh(path, progress), copied(old_size), number(old_number) {}
    NewJournal fresh;
    std::uint64_t copied, number;  // of the old file
    Failure failure{};
    Thread thread{};
  };

  std::size_t max_bytes() const noexcept { return state_->options().max_unsaved_bytes; }

  /// @pre mutex_ is held, as for what follows
  bool start() noexcept {
    if (thread_.joinable()) return true;
    try {
      Result<Thread> started = start_thread("lrt-journal", threads_, [self = shared_from_this()] { self->run(); });
      if (started) thread_ = *std::move(started);
    } catch (...) {}
    return thread_.joinable();
  }
  void count() noexcept { state_->set_unsaved(queue_.size() + in_flight_ + left_out_); }
  void count_bytes() noexcept {
    queued_bytes_ = 0;
    for (const Record& r : queue_) queued_bytes_ += r.changes.size() + record_overhead;
  }
  /// What code has changed stands in the graph that will be written.
  void write_whole() noexcept {
    is_whole_due_ = true;
    for (Record& r : queue_) {
      if (r.is_waited) continue;
      queued_bytes_ -= r.changes.size();
      r.changes = {};
    }
  }

  void run() noexcept {
    std::unique_lock lock(mutex_);
    while (true) {
      const auto wakes = [&] { return ending_ || must_write_ || is_compacted_; };
      if (has_failed_ && waits_for_retry()) {
        if (!changed_.wait_until(lock, retry_at_, wakes)) must_write_ = true;
      } else {
        changed_.wait(lock, wakes);
      }
      if (is_compacted_) {
        lock.unlock();
        end_compaction();
        lock.lock();
        continue;
      }
      const bool is_last = ending_;
      if (must_write_ || (is_last && waits_for_retry())) {
        must_write_ = false;
        write_queue(lock);
      }
      if (is_last && (queue_.empty() || has_failed_)) break;
    }
    const std::size_t lost = queue_.size() + left_out_;
    lock.unlock();
    if (compaction_) {
      compaction_->thread.join();
      compaction_.reset();
    }
    if (lost > 0) log(std::to_string(lost) + " changes are lost, because the graph ends");
    end_file();
    lock.lock();
    over_ = true;
    changed_.notify_all();
  }
  bool waits_for_retry() const noexcept { return !queue_.empty() || is_whole_due_; }

  void write_queue(std::unique_lock<std::mutex>& lock) noexcept {
    std::vector<Record> batch;
    batch.swap(queue_);
    queued_bytes_ = 0;
    const bool is_whole = std::exchange(is_whole_due_, false);
    in_flight_ = is_whole ? 0 : batch.size();  // else those of code are left out, and the others refused
    if (is_whole) left_out_ += static_cast<std::size_t>(std::count_if(batch.begin(), batch.end(), [](const Record& r) { return !r.is_waited; }));
    const std::size_t left_out = left_out_;
    const std::uint64_t last = last_number_;
    lock.unlock();
    if (is_whole) {
      // Those of clients stand between those of code, and would be in another order.
      state_->take_back(*this, model::SaveOutcome::refused);
      batch.clear();
    }
    Failure failure;
    try {
      if (!claim_.renew()) failure = FileFailure{"claiming", EBUSY};
      else failure = begins_anew_ || is_whole || !file_.file ? begin_anew(batch) : append_to_file(batch);
    } catch (...) { failure = FileFailure{"writing", ENOMEM}; }
    if (!failure) {
      state_->saved(last);
      if (std::exchange(is_logged_, false)) log("the file is written again", LogLevel::info);
    } else {
      state_->add_file_error();
      complain(*failure, batch.size());
    }
    lock.lock();
    in_flight_ = 0;
    has_failed_ = failure.has_value();
    if (!failure) {
      left_out_ -= left_out;
      count();
      lock.unlock();
      compact();
      lock.lock();
      return;
    }
    retry_at_ = std::chrono::steady_clock::now() + journal_retry_pause;
    put_back(std::move(batch), is_whole);
    count();
    lock.unlock();
    const bool is_full = failure->error == ENOSPC || failure->error == EDQUOT;
    state_->take_back(*this, is_full ? model::SaveOutcome::full : model::SaveOutcome::refused);
    lock.lock();
  }

  /// Those of code, before those that have come since.
  void put_back(std::vector<Record> batch, bool is_whole) noexcept {
    is_whole_due_ = is_whole_due_ || is_whole;
    try {
      batch.erase(std::remove_if(batch.begin(), batch.end(), [](const Record& r) { return r.is_waited; }), batch.end());
      std::move(queue_.begin(), queue_.end(), std::back_inserter(batch));
      queue_.swap(batch);
    } catch (...) { is_whole_due_ = true; }
    count_bytes();
    if (is_whole_due_ || queued_bytes_ > max_bytes()) write_whole();
  }

  Failure append_to_file(const std::vector<Record>& batch) {
    struct stat about {};
    if (::lstat(path_.c_str(), &about) != 0) {
      if (errno != ENOENT) return FileFailure{"examining", errno};
      key_.reset();
      return begin_anew(batch);  // somebody has removed it
    }
    if (key_ != FoundJournal::Key(about.st_dev, about.st_ino)) return FileFailure{"another file is in the place of", EEXIST};
    std::string bytes;
    std::uint64_t number = file_.number;
    for (const Record& r : batch) journal::append(bytes, journal::Kind::change, number++, file_.number - 1, r.changes);
    return extend(bytes, number);
  }

  /// Appends records. After a failure the file is as before, or it is not used any more.
  Failure extend(const std::string& bytes, std::uint64_t number) {
    Failure failure = write_at(file_.file.get(), bytes, file_.size);
    const bool is_written = !failure;
    if (!failure) failure = sync(file_.file.get());
    if (!failure) {
      file_.size += bytes.size();
      file_.number = number;
      durable_ = file_.size;
      is_ended_ = false;
      progress_.fetch_add(1, std::memory_order_relaxed);
      return std::nullopt;
    }
    // After a failed fdatasync() the system may have dropped what was to be written.
    if (::ftruncate(file_.file.get(), static_cast<off_t>(file_.size)) != 0 || is_written) begins_anew_ = true;
    return failure;
  }

  /// The graph, and then the changes that it does not show yet.
  Failure begin_anew(const std::vector<Record>& batch) {
    if (compaction_) {
      stops_compacting_ = true;
      compaction_->thread.join();
      compaction_.reset();
      const std::lock_guard lock(mutex_);
      is_compacted_ = false;
      stops_compacting_ = false;
    }
    const std::atomic<bool> never{false};
    NewJournal fresh(path_, progress_);
    if (auto failure = fresh.begin(*state_->version().graph, never)) return failure;
    for (const Record& r : batch)
      if (auto failure = fresh.put(journal::Kind::change, r.changes)) return failure;
    return use(fresh);
  }

  Failure use(NewJournal& fresh) {
    JournalFile named;
    Failure failure = fresh.give_name(key_, named);
    if (!named.file) return failure;
    file_ = std::move(named);
    key_ = key_of(file_.file.get());
    durable_ = file_.size;
    begins_anew_ = failure.has_value();
    is_ended_ = false;
    return failure;
  }

  void compact() noexcept {
    if (compaction_ || begins_anew_ || stops_compacting_) return;
    const std::uint64_t behind = file_.size - file_.content_size;
    if (behind < std::max({compact_beyond_, file_.content_size, next_compaction_})) return;
    try {
      // What is shown has all changes up to here, and maybe later ones of code, which have no effect if they are made once more.
      compaction_ = std::make_unique<Compaction>(path_, progress_, file_.size, file_.number);
      auto started = start_thread("lrt-compact", threads_, [this, graph = state_->version().graph] {
        Failure failure;
        try {
          failure = fill(*graph);
        } catch (...) { failure = FileFailure{"writing", ENOMEM}; }
        const std::lock_guard lock(mutex_);
        compaction_->failure = std::move(failure);
        is_compacted_ = true;
        changed_.notify_all();
      });
      if (started) compaction_->thread = *std::move(started);
      else compaction_.reset();
    } catch (...) { compaction_.reset(); }
    next_compaction_ = compaction_ ? 0 : behind + compact_beyond_;
  }

  /// On the thread of the compaction.
  Failure fill(const rdf::Graph& graph) {
    Compaction& c = *compaction_;
    if (auto failure = c.fresh.begin(graph, stops_compacting_)) return failure;
    const int old = file_.file.get();  // end_compaction() replaces it, after this thread
    for (std::uint64_t end = durable_; end - c.copied > short_rest; end = durable_) {
      if (auto failure = c.fresh.copy(old, c.copied, c.number, end, stops_compacting_, c.number)) return failure;
      c.copied = end;
    }
    return c.fresh.to_disk();
  }

  void end_compaction() noexcept {
    const std::unique_ptr<Compaction> done = std::move(compaction_);
    done->thread.join();
    {
      const std::lock_guard lock(mutex_);
      is_compacted_ = false;
    }
    Failure failure = std::move(done->failure);
    try {
      const std::atomic<bool> never{false};
      if (!failure && file_.size > done->copied)
        failure = done->fresh.copy(file_.file.get(), done->copied, done->number, file_.size, never, done->number);
      if (!failure) failure = use(done->fresh);
    } catch (...) { failure = FileFailure{"writing", ENOMEM}; }
    if (!failure || failure->error == ECANCELED) return;
    next_compaction_ = file_.size - file_.content_size + std::max(compact_beyond_, file_.content_size / 2);
    try {
      log("compacting it, which will be tried again later: " + file_error(*failure, path_).error.message);
    } catch (...) {}
  }

  /// Says that all is on the disk, so that later damage is found.
  void end_file() noexcept {
    if (!file_.file || begins_anew_ || is_ended_ || has_failed_) return;
    try {
      std::string bytes;
      journal::append(bytes, journal::Kind::end, file_.number, file_.number - 1, {});
      (void)extend(bytes, file_.number + 1);
    } catch (...) {}
  }

  void complain(const FileFailure& failure, std::size_t batch) noexcept {
    const Instant now = std::chrono::steady_clock::now();
    if (is_logged_ && now - logged_at_ < log_pause) return;
    try {
      std::size_t waiting = batch;
      {
        const std::lock_guard lock(mutex_);
        waiting += queue_.size() + left_out_;
      }
      log(std::to_string(waiting) + (waiting == 1 ? " change is not saved: " : " changes are not saved: ") +
          file_error(failure, path_).error.message);
      is_logged_ = true;
      logged_at_ = now;
    } catch (...) {}
  }
  void log(const std::string& text, LogLevel level = LogLevel::error) noexcept {
    const std::lock_guard logging(log_mutex_);
    try {
      if (log_) log_(level, "graph \"" + state_->path().substr(1) + "\": " + text);
    } catch (...) {}
  }

  const std::shared_ptr<model::GraphState> state_;
  const std::string path_;
  const ThreadOptions threads_;
  const std::uint64_t compact_beyond_;

  // The thread's.
  bool begins_anew_;  ///< the file is not to be extended
  JournalFile file_;
  std::optional<FoundJournal::Key> key_;  ///< of the file that may be replaced
  SavedFile::Claim claim_;                ///< its folder may have been made again
  bool is_ended_ = true;                  ///< nothing was written since it was opened
  bool is_logged_ = false;
  Instant logged_at_{};
  std::uint64_t next_compaction_ = 0;
  std::unique_ptr<Compaction> compaction_;

  std::atomic<std::uint64_t> durable_{file_.size}, progress_{0};
  std::atomic<bool> stops_compacting_{false};
  std::mutex log_mutex_;  // guards log_, and is held while it runs
  LogCallback log_;
  std::mutex mutex_;  // guards the rest
  std::condition_variable changed_;
  Thread thread_;
  std::vector<Record> queue_;
  std::size_t queued_bytes_ = 0;
  std::size_t in_flight_ = 0, left_out_ = 0;  ///< changes that are being written; that are written with the whole graph only
  std::uint64_t last_number_ = 0;
  bool is_whole_due_ = false;
  bool must_write_ = false;
  bool is_compacted_ = false;
  bool has_failed_ = false;
  Instant retry_at_{};
  bool ending_ = false;
  bool over_ = false;
};

Journal::Journal(std::shared_ptr<model::GraphState> state, FoundJournal found, Options options) : state_(std::move(state)) {
  const bool converts = found.kind == FoundJournal::Kind::earlier;
  writer_ = std::make_shared<Writer>(state_, std::move(found), std::move(options));
  state_->set_journal(writer_.get());
  if (converts) writer_->convert();
}

Journal::~Journal() {
  state_->set_journal(nullptr);
  writer_->finish();
}

}  // namespace lrt
