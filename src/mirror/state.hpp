// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>

namespace lrt::mirror {

/// The known state of a graph in the store.
struct StoredGraph {
  std::string graph{};        ///< its IRI
  std::string robot{};        ///< URL of the robot that has the resource
  std::string digest{};       ///< of what was sent; empty: it is not known what the store has; MirrorState::deleted: the store does not have it
  std::string entity_tag{};   ///< by the store; empty: it gave none
  std::string echo{};         ///< digest of what the store gives back of it; empty: the same, or not known
  std::string robot_tag{};    ///< entity tag by the robot; empty: not known
  bool is_watchable = false;  ///< changes of the resource are worth a subscription
};

/// The file of a mirror: lines of text, each a record with tabs between its fields, of which the last one of a graph counts.
///
///     lrt mirror 2	http://127.0.0.1:8890/sparql-graph-crud-auth
///     known	http://robot.example/arm	http://robot.example/	9f86d0...	"tag"	5e88ae...	"tag of the robot"	w
///     unknown	http://robot.example/arm/angle	http://robot.example/
///     forgotten	http://robot.example/tool
///
/// Of the first version, whose records end behind the first tag, the names count: what the store has is not known.
///
/// Before a graph is sent whose content the file states, `unknown` is on the disk: a mirror that is killed between the exchange and the next record
/// must not trust an older state. When the file is opened, and when it is more than twice as long as its content needs and min_excess, a shorter one with
/// the same content replaces it in one step (rename).
///
/// @par Threads  One at a time.
class MirrorState {
 public:
  static constexpr const char* deleted = "deleted";
  static constexpr std::size_t min_excess = std::size_t{1} << 20;

  /// Opens or creates a file, and locks it.
  /// @par Errors  invalid_option: it is no such file, of another store, or in use; limit_exceeded: more than `max_graphs`; io_error
  static Result<std::unique_ptr<MirrorState>> open(const std::string& path, const std::string& store, std::size_t max_graphs);
  ~MirrorState();
  MirrorState(const MirrorState&) = delete;
  MirrorState& operator=(const MirrorState&) = delete;

  /// The content of the file when it was opened. Moves it out.
  std::vector<StoredGraph> take() noexcept { return std::move(graphs_); }

  // The records. An error stays: the file is removed, and nothing is written after it.
  Result<void> write_known(const std::vector<StoredGraph>& graphs);
  /// @param durably  waits until it is on the disk
  Result<void> write_unknown(const StoredGraph& graph, bool durably);
  Result<void> write_forgotten(const std::string& graph);

 private:
  MirrorState(std::string path, std::string store, std::size_t max_graphs, int descriptor)
      : path_(std::move(path)), store_(std::move(store)), max_graphs_(max_graphs), descriptor_(descriptor) {}
  Result<std::vector<StoredGraph>> read() const;
  Result<void> replace(const std::vector<StoredGraph>& graphs);
  void shorten();
  Result<void> write(const std::string& lines);
  Result<void> fail();

  const std::string path_, store_;
  const std::size_t max_graphs_;
  int descriptor_;  ///< locked
  std::size_t bytes_ = 0, shorten_at_ = 0;
  std::optional<Error> error_;
  std::vector<StoredGraph> graphs_;
};

}  // namespace lrt::mirror
