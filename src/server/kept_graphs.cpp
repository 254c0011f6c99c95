// SPDX-License-Identifier: Apache-2.0
#include "src/server/kept_graphs.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include <lrt/rdf/codec.hpp>

#include "src/rdf/turtle_parser.hpp"
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

}  // namespace

KeptGraph::~KeptGraph() {
  stop();
  state_->set_saver(nullptr);
  file_.reset();  // writes the pending text
}

void KeptGraph::begin(LogCallback log, ThreadOptions threads) {
  file_ = std::make_unique<SavedFile>(state_->options().file, nullptr, std::move(log), std::move(threads), std::move(claim_));
  state_->set_saver([file = file_.get()](const model::GraphState::Version& version) -> std::function<void()> {
    SavedFile::Make make = [graph = version.graph] { return rdf::write(*graph, rdf::Syntax::n_triples).value(); };
    return [file, make = std::move(make), revision = version.revision]() mutable { file->save(std::move(make), revision); };
  });
  state_->open();
}

Result<std::vector<std::unique_ptr<KeptGraph>>> KeptGraph::open(const model::WorldSpec& world, const LogCallback& log, const ThreadOptions& threads) {
  std::vector<std::unique_ptr<KeptGraph>> opened;
  for (const auto& state : world.graphs) {
    const std::string& path = state->options().file;
    if (path.empty()) {
      opened.push_back(std::make_unique<KeptGraph>(state));
      continue;
    }
    Result<SavedFile::Claim> claim = SavedFile::prepare(path);
    if (!claim) return named(*state, std::move(claim).error());
    auto kept = std::make_unique<KeptGraph>(state, *std::move(claim));
    Result<std::optional<SavedFile::Content>> content = SavedFile::load(path, max_file_bytes(state->options()));
    if (!content) return named(*state, std::move(content).error());
    if (*content && (*content)->state == SavedFile::State::unmarked && !(*content)->text.empty())
      return named(*state, {Errc::invalid_option,
                            "\"" + path + "\": expected a file that lrt wrote, or none; found a file of another program. Choose another path"});
    if (*content) {
      rdf::ReadOptions options;
      options.max_triples = state->options().max_triples;
      options.max_bytes = max_file_bytes(state->options());
      const bool is_whole = (*content)->state == SavedFile::State::whole;
      Result<rdf::Graph> graph = is_whole ? rdf::read_kept_n_triples((*content)->text, options) : unexpected(Errc::expected_rdf, "damaged");
      if (graph) {
        if (Result<void> restored = state->restore(*std::move(graph)); !restored) return named(*state, restored.error());
      } else if (is_whole && graph.error().code == Errc::limit_exceeded) {
        return named(*state, std::move(graph).error());
      } else {
        const Result<std::string> copy = SavedFile::keep_copy(path);
        if (log)
          log(LogLevel::error, "the file \"" + path + "\" of the graph \"" + state->path().substr(1) +
                                   "\" was changed or truncated after lrt wrote it: nothing is restored from it; it " +
                                   (copy ? "is kept as \"" + *copy + "\"" : "could not be kept: " + copy.error().message));
      }
    }
    kept->begin(log, threads);
    opened.push_back(std::move(kept));
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
  std::move(first, all_.end(), std::back_inserter(gone));
  all_.erase(first, all_.end());
}

void KeptGraphs::stop() noexcept {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  for (const auto& kept : all_) kept->stop();
}

std::unique_ptr<Service> make_kept_graphs(SharedEngine& server) { return std::make_unique<KeptGraphs>(server); }

}  // namespace lrt
