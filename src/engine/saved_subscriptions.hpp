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
#include "src/engine/callback_rules.hpp"
#include "src/engine/subscriptions.hpp"

namespace lrt::engine {

/// Web callbacks as text for a restart: Turtle, one blank node each, with the terms of the requests that create them and the base of the
/// creating request (SPEC 3.7). A restored callback waits until its resource exists.
class SavedSubscriptions {
 public:
  SavedSubscriptions(const EngineOptions& options, Registry& registry, Bases& bases, const Responses& responses, const CallbackRules& rules,
                     Subscriptions& subscriptions, PendingSaves& saves, const Clock& clock)
      : options_(options),
        registry_(registry),
        bases_(bases),
        responses_(responses),
        rules_(rules),
        subscriptions_(subscriptions),
        saves_(saves),
        clock_(clock) {}

  /// All callbacks, if they have changed since the last call. The text of each is created once.
  std::optional<SavedText> take();
  /// @return  how many subscriptions the text has
  /// @par Errors  expected_rdf, limit_exceeded: then nothing is restored
  Result<std::size_t> restore(std::string_view saved);
  /// Restores the readable subscriptions of a damaged text, each separately.
  /// @return  how many; and the parts of the text that cannot be read
  std::pair<std::size_t, std::size_t> recover(std::string_view damaged);
  /// Activates the callbacks whose resource exists now.
  void resume();
  /// Removes the callbacks of a principal that wait for their resource.
  void sign_out(std::string_view principal);

 private:
  struct PendingRestore {
    std::string path, type, base,
        id;  ///< path: the usual one, which a name of the user may have moved; type: Resource::saved_type
    Utc created;
    SubscriptionRequest request;
    std::string media_type;  ///< the variant is known when the resource is there
    bool missing_type_logged = false;
    bool refused = false;  ///< its receiver is not allowed now: kept for a later start
  };

  Result<std::size_t> read_all(std::string_view saved);
  Result<PendingRestore> read(const rdf::Graph& graph, rdf::TermId node) const;
  void log(const std::string& id, const std::string& what) const;

  const EngineOptions& options_;
  Registry& registry_;
  Bases& bases_;
  const Responses& responses_;
  const CallbackRules& rules_;
  Subscriptions& subscriptions_;
  PendingSaves& saves_;
  const Clock& clock_;
  std::vector<PendingRestore> pending_;
  std::uint64_t taken_revision_ = 0;
};

}  // namespace lrt::engine
