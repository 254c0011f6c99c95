// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>

namespace lrt::client {
inline namespace v0 {

/// A structure document as it was received.
struct StoredStructure {
  std::string start{};               ///< URL of the list of Things that links to it
  std::string url{};                 ///< of its first page
  std::string entity_tag{};          ///< of its first page, which has the version of all; empty: none
  std::vector<std::string> pages{};  ///< in JSON
};

/// Structure documents in a folder, for the programs of one user: files that only their owner can read, in a folder that only its owner can use. What
/// else is there, or is not whole, is no document. Nothing is an error: without the folder there are no documents.
/// @par Threads  Any, and other processes.
class LRT_INTERNAL_API StructureStore {
 public:
  static constexpr std::size_t max_files = 64, max_bytes = 64 * 1024 * 1024, max_file_bytes = 16 * 1024 * 1024;

  explicit StructureStore(std::string folder) : folder_(std::move(folder)) {}

  struct Found {
    StoredStructure document;
    std::chrono::system_clock::time_point confirmed;  ///< when the server last said that it is the present one
  };
  /// @param key  of the robot and of who sends the requests: never a part of a document that another caller has received
  std::optional<Found> find(const std::string& key) const;
  /// Stores a document, and removes the oldest beyond the limits.
  void put(const std::string& key, const StoredStructure& document) const;
  /// The server has said that it is the present one.
  void confirm(const std::string& key) const;
  void remove(const std::string& key) const;

  /// The name of a file: nothing of the fields can be read from it.
  /// @param fields  that identify who sends the requests
  static std::string key(const std::string& url, const std::vector<std::pair<std::string, std::string>>& fields);

 private:
  bool has_folder() const;
  std::string path_of(const std::string& key) const { return folder_ + "/" + key; }
  void remove_oldest() const;

  const std::string folder_;
};

}  // namespace v0
}  // namespace lrt::client
