// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <lrt/client/options.hpp>
#include <lrt/client/things.hpp>

#include "src/client/structure_store.hpp"
#include "src/rdf/json_parse.hpp"

namespace lrt::client {
inline namespace v0 {

/// Makes Things of a structure document.
class StructureReader {
 public:
  /// @param url  of the document
  explicit StructureReader(std::string url) : url_(std::move(url)) {}
  /// Adds a page. @par Errors  expected_rdf: it is no page of a structure document; expected_value: it is one of another version; limit_exceeded
  Result<void> add(std::string text);
  /// The URL of the page after the last one; empty: there is none.
  const std::string& next() const noexcept { return next_; }
  const std::vector<std::string>& pages() const noexcept { return texts_; }
  /// @par Errors  expected_rdf
  Result<std::vector<Thing>> things(const std::shared_ptr<Session>& session) const;

 private:
  struct Kind;
  Result<Kind> kind_of(const rdf::json::Document& page, rdf::json::Document::Id id, const std::string& vocabulary) const;

  const std::string url_;
  std::string base_, version_, next_;
  std::vector<std::string> texts_;
  std::vector<rdf::json::Document> pages_;
  std::size_t bytes_ = 0;
};

/// The structure documents that a client knows, in memory and on the disk. With one it opens a robot by one conditional request.
/// @par Threads  Any.
class Structures {
 public:
  Structures(Session& session, const Options& options);

  /// The robot that was opened by this URL before. nullopt: it was not, or its document is no longer there.
  /// @par Errors  the server does not respond; cancelled
  Result<std::optional<Robot>> open(const std::string& url);
  /// The robot whose list of Things links to a document. nullopt: that cannot be used, so that links have to be followed.
  /// @param url       that the program has given
  /// @param start     that of the list of Things
  /// @param requests  that were sent before; those of this function are added
  /// @par Errors  cancelled
  Result<std::optional<Robot>> follow(const std::string& url, const std::string& start, const std::string& document, std::size_t& requests);

 private:
  struct Known {
    StoredStructure document;
    std::weak_ptr<const std::vector<Thing>> things;  // the Things hold the session, which has this
    std::chrono::steady_clock::time_point confirmed;
  };
  struct Opened {
    std::shared_ptr<const std::vector<Thing>> things;
    std::string start;
  };
  Result<Robot> read(const std::string& url, const StoredStructure& wanted, const Known* known, std::size_t requests);
  Robot robot_of(std::string start, std::shared_ptr<const std::vector<Thing>> things, std::size_t requests);
  std::string key_of(const std::string& url);
  void keep(const std::string& url, Known known);

  Session& session_;
  const std::optional<StructureStore> store_;
  const std::chrono::seconds age_;
  std::mutex mutex_;
  std::map<std::string, Known> known_;  // by the URL that the program has given
};

}  // namespace v0
}  // namespace lrt::client
