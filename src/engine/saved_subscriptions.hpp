// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/pending_saves.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/subscriptions.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Web callbacks as text that survives a restart: Turtle, one blank node each, with the terms by which they are made and the base of the
/// request that made them (SPEC 3.7). A restored callback waits until its resource is there.
class SavedSubscriptions {
 public:
  SavedSubscriptions(const EngineOptions& options, Registry& registry, Bases& bases, const Responses& responses, Subscriptions& subscriptions,
                     PendingSaves& saves, const Clock& clock)
      : options_(options), registry_(registry), bases_(bases), responses_(responses), subscriptions_(subscriptions), saves_(saves), clock_(clock) {}

  /// All callbacks, if there are others than at the last call. The text of each is made once.
  std::optional<SavedText> take();
  /// @return  how many subscriptions the text has
  /// @par Errors  expected_rdf, limit_exceeded: then nothing is restored
  Result<std::size_t> restore(std::string_view saved);
  /// Restores from a damaged text what can be read: each subscription by itself.
  /// @return  how many; and the parts of the text that cannot be read
  std::pair<std::size_t, std::size_t> recover(std::string_view damaged);
  /// Goes on with those whose resource is there now.
  void resume();

 private:
  struct PendingRestore {
    std::string path, type, base,
        id;  ///< path: the usual one, which a name of the user may have moved; type: Resource::saved_type
    Utc created;
    SubscriptionRequest request;
    std::string media_type;  ///< the variant is known when the resource is there
    bool missing_type_logged = false;
    bool refused = false;  ///< its receiver may not be called now: kept for a start when it may
  };

  Result<std::size_t> read_all(std::string_view saved);
  Result<PendingRestore> read(const rdf::Graph& graph, rdf::TermId node) const;
  void log(const std::string& id, const std::string& what) const;

  const EngineOptions& options_;
  Registry& registry_;
  Bases& bases_;
  const Responses& responses_;
  Subscriptions& subscriptions_;
  PendingSaves& saves_;
  const Clock& clock_;
  std::vector<PendingRestore> pending_;
  std::uint64_t taken_revision_ = 0;
};

}  // namespace v0
}  // namespace lrt::engine
