// SPDX-License-Identifier: Apache-2.0
#include "src/server/kept_graphs.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include <lrt/rdf/codec.hpp>

#include "src/model/graph_changes.hpp"
#include "src/rdf/turtle_parser.hpp"
#include "src/server/journal.hpp"
#include "src/server/journal_format.hpp"
#include "src/server/saved_file.hpp"
#include "src/server/shared_engine.hpp"
#include "src/server/world_extension.hpp"

namespace lrt {

namespace {

/// An upper bound for the N-Triples of a graph within its limits: an escaped byte of a literal has six bytes, and each triple has punctuation and labels
/// of blank nodes.
std::size_t max_file_bytes(const GraphOptions& options) {
  constexpr std::size_t most = std::numeric_limits<std::size_t>::max() / 4;
  const auto times = [](std::size_t n, std::size_t factor) { return n > most / factor ? most : n * factor; };
  return times(options.max_bytes, 6) + times(options.max_triples, 64) + 4096;
}

Unexpected named(const model::GraphState& state, Error error) {
  error.message = "graph \"" + state.path().substr(1) + "\", its file: " + error.message;
  return Unexpected{std::move(error)};
}

/// Reads a file of a release before journals, or one without a beginning.
Result<void> restore_earlier(model::GraphState& state, const LogCallback& log) {
  const std::string& path = state.options().file;
  Result<std::optional<SavedFile::Content>> content = SavedFile::load(path, max_file_bytes(state.options()));
  if (!content) return Unexpected{std::move(content).error()};
  if (!*content) return {};
  const std::string& text = (*content)->text;
  const bool is_cut = text == journal::first_line.substr(0, text.size());
  if ((*content)->state == SavedFile::State::unmarked && !is_cut)
    return unexpected(Errc::invalid_option,
                      "\"" + path + "\", byte 0: expected a file that lrt wrote, or none; found a file of another program. Choose another path");
  if ((*content)->state == SavedFile::State::whole) {
    rdf::ReadOptions options;
    options.max_triples = state.options().max_triples;
    options.max_bytes = max_file_bytes(state.options());
    Result<rdf::Graph> graph = rdf::read_kept_n_triples(text, options);
    if (graph) return state.restore([&](model::GraphEdit& edit) { edit.merge(*graph); });
    if (graph.error().code == Errc::limit_exceeded) return Unexpected{std::move(graph).error()};
  }
  const Result<std::string> copy = SavedFile::keep_copy(path);
  if (log)
    log(LogLevel::error, "the file \"" + path + "\" of the graph \"" + state.path() +
                             "\" was changed or truncated after lrt wrote it: nothing is restored from it; it " +
                             (copy ? "is kept as \"" + *copy + "\"" : "could not be kept: " + copy.error().message));
  return {};
}

/// Reads a file of whatever kind to the graph.
Result<FoundJournal> restore(model::GraphState& state, const LogCallback& log) {
  const std::string& path = state.options().file;
  Result<FoundJournal> found = FoundJournal();
  const Result<void> restored = state.restore([&](model::GraphEdit& edit) {
    found = open_journal(path, [&](std::string_view changes) { return model::replay_changes(changes, edit); });
    // Nothing is restored from what is no journal.
    if (!found) edit.fail(found.error());
    else if (found->kind != FoundJournal::Kind::journal) edit.fail({Errc::closed, ""});
  });
  if (!found) return found;
  if (found->kind == FoundJournal::Kind::earlier) {
    if (Result<void> earlier = restore_earlier(state, log); !earlier) return Unexpected{std::move(earlier).error()};
  } else if (found->kind == FoundJournal::Kind::journal) {
    if (!restored) return Unexpected{restored.error()};
    if (log && found->torn > 0)
      log(LogLevel::warning, "the file \"" + path + "\" of the graph \"" + state.path() + "\": a change that was not saved whole, " +
                                 std::to_string(found->torn) + " bytes, is cut off; " + std::to_string(found->changes) +
                                 " changes before it are restored");
  }
  return found;
}

class GraphWithFile final : public KeptGraph {
 public:
  GraphWithFile(const std::shared_ptr<model::GraphState>& state, FoundJournal found, Journal::Options options)
      : KeptGraph(state), journal_(std::make_unique<Journal>(state, std::move(found), std::move(options))) {}
  ~GraphWithFile() override {
    stop();
    journal_.reset();  // writes what waits
  }

 private:
  std::unique_ptr<Journal> journal_;
};

}  // namespace

Result<std::vector<std::unique_ptr<KeptGraph>>> KeptGraph::open(const model::WorldSpec& world, const LogCallback& log, const ThreadOptions& threads) {
  std::vector<std::unique_ptr<KeptGraph>> opened;
  for (const auto& state : world.graphs) {
    const std::string& path = state->options().file;
    if (path.empty()) {
      opened.push_back(std::make_unique<KeptGraph>(state));
      continue;
    }
    Result<SavedFile::Claim> claim = SavedFile::prepare(path, journal::mark);
    if (!claim) return named(*state, std::move(claim).error());
    Result<FoundJournal> found = restore(*state, log);
    if (!found) return named(*state, std::move(found).error());
    Journal::Options journal_options{log, threads};
    journal_options.claim = *std::move(claim);
    opened.push_back(std::make_unique<GraphWithFile>(state, *std::move(found), std::move(journal_options)));
    state->open();
  }
  return opened;
}

KeptGraphs::~KeptGraphs() = default;

Result<UniqueFunction<void()>> KeptGraphs::adding(const std::vector<Thing>& things) {
  Opened all;
  for (const Thing& thing : things) {
    const model::WorldSpec* const world = thing.world();
    if (!world) continue;
    Result<Opened> opened = WorldExtension::of(*world).open_files(*world, server_.waking_log(), server_.options().threads.own);
    if (!opened) return Unexpected{std::move(opened).error()};
    std::move(opened->begin(), opened->end(), std::back_inserter(all));
  }
  return UniqueFunction<void()>([this, all = std::move(all)]() mutable { add(std::move(all)); });
}

void KeptGraphs::add(Opened opened) {
  const std::lock_guard lock(mutex_);
  for (auto& kept : opened) {
    if (stopped_) kept->stop();
    all_.push_back(std::move(kept));
  }
}

void KeptGraphs::removed(const std::string& path) {
  Opened gone;  // ends without the lock
  const std::string below = "/" + path + "/";
  const std::lock_guard lock(mutex_);
  const auto first =
      std::stable_partition(all_.begin(), all_.end(), [&](const auto& kept) { return kept->state().path().compare(0, below.size(), below) != 0; });
  for (auto kept = first; kept != all_.end(); ++kept) errors_of_removed_ += (*kept)->state().file_errors();
  std::move(first, all_.end(), std::back_inserter(gone));
  all_.erase(first, all_.end());
}

void KeptGraphs::stop() noexcept {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  for (const auto& kept : all_) kept->stop();
}

void KeptGraphs::count(ServerCounters& all) const {
  const std::lock_guard lock(mutex_);
  all.graph_file_errors = errors_of_removed_;
  for (const auto& kept : all_) {
    all.unsaved_graph_changes += kept->state().unsaved();
    all.graph_file_errors += kept->state().file_errors();
  }
}

std::unique_ptr<Service> make_kept_graphs(SharedEngine& server) { return std::make_unique<KeptGraphs>(server); }

}  // namespace lrt
