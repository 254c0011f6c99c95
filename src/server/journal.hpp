// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>

#include "src/base/descriptor.hpp"
#include "src/model/graph_state.hpp"
#include "src/server/saved_file.hpp"

namespace lrt {

/// The file of a journal, open for writing.
struct JournalFile {
  Descriptor file{};
  std::uint64_t size = 0;          ///< of its records, all of which are on the disk
  std::uint64_t number = 1;        ///< of the next record
  std::uint64_t content_size = 0;  ///< up to the end of the first content
};

/// What was found in the place of a journal.
struct FoundJournal {
  enum class Kind : std::uint8_t {
    none,     ///< nothing
    earlier,  ///< a file of an earlier release, or one that is empty or cut off in its first line: `file` is empty
    journal,  ///< `file`, without what was torn
  };
  /// Device and number: what a new journal may replace.
  using Key = std::pair<dev_t, ino_t>;
  Kind kind = Kind::none;
  JournalFile file{};
  std::optional<Key> key{};
  std::uint64_t changes = 0;  ///< that were read
  std::uint64_t torn = 0;     ///< bytes that were cut off at the end
};

/// Opens a journal, and reads it. A file that is no journal stays as it is.
/// @param path  prepared by SavedFile::prepare()
/// @param take  gets the text of GraphChanges, record by record
/// @par Errors  invalid_option: a file of another program or of a newer lrt; io_error: it was damaged before its end, or cannot be read; those of `take`
Result<FoundJournal> open_journal(const std::string& path, FunctionRef<Result<void>(std::string_view changes)> take);

/// Appends the changes of a graph to a file. Changes that arrive during a write are written together. From time to time, beside that, the graph is written
/// to a new file, with what has come meanwhile, which replaces the old one. The file belongs to its owner only (0600).
///
/// When the disk refuses, the changes that clients wait for are taken back. Others are kept, and tried again every second, and with each change that a
/// client waits for. If more than GraphOptions::max_unsaved_bytes wait, or if it is not known what the disk has, the whole graph is written to a new file.
///
/// @par Threads  Any. Writing happens on a thread of its own.
class Journal {
 public:
  struct Options {
    LogCallback log;
    ThreadOptions threads;
    std::uint64_t compact_beyond = std::uint64_t{4} * 1024 * 1024;  ///< bytes of changes behind the first content; and as many as that has
    SavedFile::Claim claim{};                                       ///< of the file; renewed before each write
  };
  /// Begins to keep the changes of a graph, which is as it was read from the file.
  Journal(std::shared_ptr<model::GraphState> state, FoundJournal found, Options options);
  /// Writes what waits. If the disk does not do anything for five seconds, the thread is detached.
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

 private:
  class Writer;
  const std::shared_ptr<model::GraphState> state_;
  std::shared_ptr<Writer> writer_;
};

}  // namespace lrt
