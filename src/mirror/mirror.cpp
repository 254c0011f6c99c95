// SPDX-License-Identifier: Apache-2.0
#include <lrt/mirror.hpp>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include <lrt/base/clock.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/random.hpp"
#include "src/base/back_off.hpp"
#include "src/base/thread.hpp"
#include "src/mirror/graph_store.hpp"
#include "src/mirror/metrics.hpp"
#include "src/mirror/reading.hpp"
#include "src/mirror/state.hpp"
#include "src/client/representation.hpp"
#include "src/client/session.hpp"
#include "src/client/tasks.hpp"
#include "src/http/url.hpp"

namespace lrt::mirror {
inline namespace v0 {
namespace {

using std::chrono::milliseconds;
using Instant = std::chrono::steady_clock::time_point;
using Kind = MirrorEvent::Kind;

/// How often connections are checked and the state is written.
constexpr milliseconds tick{250};
constexpr milliseconds state_pause{2'000};

/// The pause after a number of failures in succession.
milliseconds pause_after(unsigned failures, milliseconds first, milliseconds longest) {
  return std::chrono::duration_cast<milliseconds>(back_off(failures, first, longest, random_fraction()));
}

std::string mark_of(const std::string& robot, std::chrono::system_clock::time_point since) {
  return "<" + robot + "> <" + std::string(vocab::lrt_::unreachableSince.text) + "> \"" + to_xsd_date_time(since) +
         "\"^^<http://www.w3.org/2001/XMLSchema#dateTime> .\n";
}

Result<void> positive(bool is_good, const char* name) {
  if (is_good) return {};
  return unexpected(Errc::invalid_option, std::string(name) + " of a mirror: expected more than 0");
}

}  // namespace

std::string mirror_mark_of(const std::string& robot) { return std::string(client::document_of(robot)) + "#mirror"; }

class LRT_LOCAL Mirror::Impl {
 public:
  Impl(MirrorOptions options, std::shared_ptr<client::Session> session, std::unique_ptr<GraphStore> store, std::unique_ptr<MirrorState> state);
  ~Impl() { stop(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Result<MirrorCounts> copy(const std::function<bool()>& goes_on);
  Result<void> start();
  MirrorCounts counts() const {
    const std::lock_guard lock(mutex_);
    return counts_now();
  }
  std::vector<Metric> metrics() const { return metrics_of(counts(), options_.store.endpoint, robots_.size()); }
  std::optional<Error> failure() const {
    const std::lock_guard lock(mutex_);
    return failure_;
  }
  void stop() noexcept;

 private:
  using Lock = std::unique_lock<std::mutex>;

  /// The pending or completed operation on a graph.
  struct Wanted {
    bool is_delete = false;
    bool has_content = true;  ///< false: there was no room; the resource is read when its turn comes
    MirroredGraph content{};
    Instant since{};  ///< when the first of the changes came that it replaces
    std::string value() const { return is_delete ? MirrorState::deleted : content.digest; }
  };
  enum class OnDisk : unsigned char { nothing, unknown, known };
  struct Graph {
    std::string robot;
    std::string stored;      ///< what the store has: a digest, MirrorState::deleted, or empty: unknown
    std::string entity_tag;  ///< by the store
    std::string refused;     ///< the digest of a graph that the store refuses
    std::optional<Wanted> wanted;
    std::optional<Instant> late_since;  ///< the store lacks a change of the graph
    bool is_queued = false, is_sent_now = false;
    OnDisk on_disk = OnDisk::nothing;
    bool is_changed = false;  ///< since the state was written
    unsigned failures = 0;    ///< of the store with this graph, in succession
  };
  struct Robot {
    std::string url, mark;
    bool was_read = false, is_away = false;
    bool is_being_read = false, must_be_read_again = false;
    unsigned failures = 0;
    Instant due{};
    std::map<std::string, client::Watch> watches;
    std::set<std::string> connected;  ///< of the watches
    std::set<std::string> unwatchable;
    std::map<std::string, std::vector<std::string>> links;  ///< of what is watched: a change of them leads to a reading
  };

  void event(Kind kind, std::string url, std::string reason = {}) const noexcept {
    try {
      if (options_.on_event) options_.on_event({kind, std::move(url), std::move(reason)});
    } catch (...) {}  // user code: its error cannot be reported
  }
  MirrorCounts counts_now() const;
  Result<void> start_threads();

  // Reading.
  void schedule();
  void read(Robot& robot);
  void read_all(Robot& robot);
  void take_found(Robot& robot, const std::set<std::string>& found);
  void take_left(Robot& robot, const Error& error);
  void forget_missing(Robot& robot, const std::set<std::string>& found, bool is_complete);
  void begin_watch(Robot& robot, const client::RepresentationPtr& resource);
  void take_change(Robot& robot, const std::string& url, const client::Change& change);
  void look_at_watches(Robot& robot);
  void read_soon(Robot& robot);

  // Sending.
  void offer(const std::string& robot, const std::string& graph, MirroredGraph content);
  void offer_delete(const std::string& robot, const std::string& graph);
  void offer(Lock& lock, const std::string& robot, const std::string& graph, Wanted wanted);
  void queue(const std::string& name, Graph& graph);
  void send_all();
  bool wait_for_turn(Lock& lock);
  void send(Lock& lock, const std::string& name, Graph& graph);
  bool load(Lock& lock, const std::string& name, Graph& graph, Wanted& wanted);
  void take_answer(Lock& lock, const std::string& name, Graph& graph, Wanted wanted, const Result<GraphStore::Answer>& answer);
  void take_store_failure(Lock& lock, const std::string& reason, std::optional<std::chrono::seconds> retry_after);
  void set_waiting_bytes(const Wanted& wanted, bool is_added) noexcept;

  void write_state(Lock& lock);
  void take_state_error(Lock& lock, const Result<void>& written);

  const MirrorOptions options_;
  const std::shared_ptr<client::Session> session_;
  const std::unique_ptr<GraphStore> store_;

  mutable std::mutex mutex_;         ///< guards the rest unless stated otherwise; not held during exchanges and callbacks
  std::condition_variable changed_;  ///< notifies the threads that send, and copy()
  std::condition_variable due_;      ///< notifies the threads that read: a robot is due
  bool stopped_ = false, is_started_ = false, only_once_ = false;
  std::optional<Error> failure_;
  std::map<std::string, Graph> graphs_;
  std::deque<std::string> queue_;
  std::size_t waiting_bytes_ = 0, being_sent_ = 0, robots_being_read_ = 0;
  MirrorCounts counts_;
  std::map<std::string, Robot> robots_;  ///< not changed after construction; a Robot's watches and links only by its one reading, under the lock
  // The store.
  Instant ready_at_{}, next_turn_{};
  unsigned store_failures_ = 0;
  std::optional<Instant> failing_since_;
  std::string store_reason_;
  Errc store_code_ = Errc::failed;

  mutable std::mutex state_mutex_;  ///< of state_; taken without mutex_, or after it
  const std::unique_ptr<MirrorState> state_;
  bool state_failed_ = false;
  Instant state_due_{};

  client::Tasks readers_;
  std::vector<Thread> threads_;
};

Mirror::Impl::Impl(MirrorOptions options, std::shared_ptr<client::Session> session, std::unique_ptr<GraphStore> store,
                   std::unique_ptr<MirrorState> state)
    : options_(std::move(options)),
      session_(std::move(session)),
      store_(std::move(store)),
      state_(std::move(state)),
      readers_(options_.client.threads, options_.max_readers, system_clock()) {
  for (const std::string& url : options_.robots) {
    Robot& robot = robots_[std::string(client::document_of(url))];
    robot.url = client::document_of(url);
    robot.mark = mirror_mark_of(url);
  }
  if (!state_) return;
  for (StoredGraph& known : state_->take()) {
    Graph& graph = graphs_[known.graph];
    graph.robot = std::move(known.robot);
    graph.on_disk = known.digest.empty() ? OnDisk::unknown : OnDisk::known;
    graph.stored = std::move(known.digest);
    graph.entity_tag = std::move(known.entity_tag);
  }
}

MirrorCounts Mirror::Impl::counts_now() const {
  MirrorCounts counts = counts_;
  counts.waiting = queue_.size() + being_sent_;
  const Instant now = std::chrono::steady_clock::now();
  for (const auto& [name, graph] : graphs_)
    if (graph.late_since) counts.lag = std::max(counts.lag, std::chrono::duration_cast<milliseconds>(now - *graph.late_since));
  counts.graphs = static_cast<std::size_t>(std::count_if(
      graphs_.begin(), graphs_.end(), [](const auto& g) { return !g.second.stored.empty() && g.second.stored != MirrorState::deleted; }));
  counts.robots_away = static_cast<std::size_t>(std::count_if(robots_.begin(), robots_.end(), [](const auto& r) { return r.second.is_away; }));
  return counts;
}

// --- Reading ---

/// On a separate thread: starts the readings that are due.
void Mirror::Impl::schedule() {
  Lock lock(mutex_);
  while (!stopped_) {
    const Instant now = std::chrono::steady_clock::now();
    for (auto& entry : robots_) {
      Robot& robot = entry.second;
      if (!only_once_) look_at_watches(robot);
      if (robot.is_being_read || robot.due > now) continue;
      if (only_once_ && (robot.was_read || robot.is_away)) continue;
      robot.is_being_read = true;
      ++robots_being_read_;
      if (!readers_.run([this, &robot] { read(robot); })) {
        robot.is_being_read = false;
        --robots_being_read_;
      }
    }
    if (state_ && now >= state_due_) {
      state_due_ = now + state_pause;
      write_state(lock);
    }
    if (!stopped_) due_.wait_for(lock, tick);
  }
}

/// A resource has lost its connection: the robot may be gone.
void Mirror::Impl::look_at_watches(Robot& robot) {
  for (const auto& [url, watch] : robot.watches) {
    const bool is_connected = watch.is_connected();
    if (!is_connected && robot.connected.erase(url) != 0) robot.due = std::min(robot.due, std::chrono::steady_clock::now());
    else if (is_connected) robot.connected.insert(url);
  }
}

void Mirror::Impl::read_soon(Robot& robot) {
  const std::lock_guard lock(mutex_);
  robot.must_be_read_again = robot.is_being_read;
  robot.due = std::chrono::steady_clock::now();
  due_.notify_all();
}

void Mirror::Impl::read(Robot& robot) {
  try {
    read_all(robot);
  } catch (const std::exception& error) {
    event(Kind::problem, robot.url, error.what());
    const std::lock_guard lock(mutex_);
    ++robot.failures;
    robot.is_away = !robot.was_read;
  }
  const std::lock_guard lock(mutex_);
  robot.is_being_read = false;
  --robots_being_read_;
  const Instant now = std::chrono::steady_clock::now();
  if (std::exchange(robot.must_be_read_again, false)) robot.due = now + options_.minimum_interval;
  else robot.due = now + (robot.failures > 0 ? pause_after(robot.failures, options_.first_pause, options_.max_pause) : options_.refresh_interval);
  changed_.notify_all();
}

void Mirror::Impl::read_all(Robot& robot) {
  std::set<std::string> found, missing;
  const auto on_resource = [&](const client::RepresentationPtr& resource) {
    found.insert(resource->url);
    Result<MirroredGraph> content = mirrored(resource->graph);
    if (!content) return event(Kind::problem, resource->url, content.error().message);
    offer(robot.url, resource->url, *std::move(content));
    if (!only_once_) begin_watch(robot, resource);
  };
  const auto on_problem = [&](const std::string& url, const Error& error) {
    if (error.code == Errc::unknown_path) missing.insert(url);
    else if (error.code != Errc::unsupported_syntax) event(Kind::problem, url, error.message);  // a mesh has no graph
  };
  const Result<bool> read = read_robot(*session_, robot.url, on_resource, on_problem);
  if (!read) {
    if (read.error().code != Errc::cancelled) take_left(robot, read.error());
    return;
  }
  for (const std::string& url : missing) offer_delete(robot.url, url);
  take_found(robot, found);
  forget_missing(robot, found, *read);
}

void Mirror::Impl::take_left(Robot& robot, const Error& error) {
  bool is_marked = false, has_left = false;
  {
    const std::lock_guard lock(mutex_);
    ++robot.failures;
    has_left = !std::exchange(robot.is_away, true);
    const auto known = graphs_.find(robot.mark);
    is_marked = known != graphs_.end() && !known->second.stored.empty() && known->second.stored != MirrorState::deleted;
  }
  if (!has_left) return;
  if (!is_marked) {  // else the time of the mark is right
    MirroredGraph mark{mark_of(robot.url, std::chrono::system_clock::now()), {}};
    Result<std::string> digest = exchange::hex_digest(exchange::HashAlgorithm::sha256, mark.turtle);
    mark.digest = digest ? *std::move(digest) : mark.turtle;
    offer(robot.url, robot.mark, std::move(mark));
  }
  event(Kind::robot_left, robot.url, error.message);
}

void Mirror::Impl::take_found(Robot& robot, const std::set<std::string>& found) {
  bool was_away = false, is_new = false;
  {
    const std::lock_guard lock(mutex_);
    robot.failures = 0;
    was_away = std::exchange(robot.is_away, false);
    is_new = !std::exchange(robot.was_read, true);
  }
  // Without a state it is not known whether an earlier mirror has marked it.
  offer_delete(robot.url, robot.mark);
  if (was_away) event(Kind::robot_returned, robot.url);
  else if (is_new) event(Kind::robot_found, robot.url, std::to_string(found.size()) + " resources");
}

/// Reads resources of earlier readings that are no longer linked, and deletes the graphs of those that no longer exist.
void Mirror::Impl::forget_missing(Robot& robot, const std::set<std::string>& found, bool is_complete) {
  std::vector<std::string> unseen;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, graph] : graphs_)
      if (graph.robot == robot.url && name != robot.mark && graph.stored != MirrorState::deleted && found.count(name) == 0) unseen.push_back(name);
  }
  if (!is_complete) return;
  for (const std::string& url : unseen) {
    const Result<client::RepresentationPtr> read = session_->get(url);
    if (!read && read.error().code == Errc::unknown_path) {
      offer_delete(robot.url, url);
      continue;
    }
    if (!read && is_away(read.error())) return;
    if (!read || (*read)->url != url) continue;
    if (Result<MirroredGraph> content = mirrored((*read)->graph)) offer(robot.url, url, *std::move(content));
  }
  std::vector<client::Watch> ended;  // destroyed without the lock: a watch waits for its callback
  const std::lock_guard lock(mutex_);
  for (auto watch = robot.watches.begin(); watch != robot.watches.end();) {
    const auto graph = graphs_.find(watch->first);
    const bool is_gone =
        graph == graphs_.end() || graph->second.stored == MirrorState::deleted || (graph->second.wanted && graph->second.wanted->is_delete);
    if (!is_gone) {
      ++watch;
      continue;
    }
    ended.push_back(std::move(watch->second));
    robot.connected.erase(watch->first);
    robot.links.erase(watch->first);
    watch = robot.watches.erase(watch);
  }
}

void Mirror::Impl::begin_watch(Robot& robot, const client::RepresentationPtr& resource) {
  const std::string& url = resource->url;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || !is_worth_watching(*resource) || robot.unwatchable.count(url) != 0) return;
    robot.links[url] = mirrored_links(resource->graph, url, {});
    if (robot.watches.count(url) != 0 || robot.watches.size() >= options_.max_watches_per_robot) return;
  }
  client::WatchOptions watch;
  watch.minimum_interval = options_.minimum_interval;
  watch.poll_period = options_.refresh_interval;
  watch.first_pause = options_.first_pause;
  watch.max_pause = options_.max_pause;
  Result<client::Watch> made =
      session_->watches().watch(url, watch, [this, &robot, url](const client::Change& change) { take_change(robot, url, change); });
  if (!made) return event(Kind::problem, url, made.error().message);
  const std::lock_guard lock(mutex_);
  robot.watches.emplace(url, *std::move(made));
}

void Mirror::Impl::take_change(Robot& robot, const std::string& url, const client::Change& change) {
  if (change.kind == client::Change::Kind::gap) return;  // the next value is the present one
  if (change.kind == client::Change::Kind::ended) {
    {
      const std::lock_guard lock(mutex_);
      if (stopped_) return;
      robot.unwatchable.insert(url);  // it is read with all others
    }
    return read_soon(robot);
  }
  const Result<rdf::Graph> graph = change.graph();
  if (!graph) return event(Kind::problem, url, graph.error().message);
  Result<MirroredGraph> content = mirrored(*graph);
  if (!content) return event(Kind::problem, url, content.error().message);
  offer(robot.url, url, *std::move(content));
  std::vector<std::string> links = mirrored_links(*graph, url, {});
  bool has_other_links = false;
  {
    const std::lock_guard lock(mutex_);
    std::vector<std::string>& known = robot.links[url];
    has_other_links = known != links;
    known = std::move(links);
  }
  if (has_other_links) read_soon(robot);
}

// --- Sending ---

void Mirror::Impl::set_waiting_bytes(const Wanted& wanted, bool is_added) noexcept {
  if (is_added) waiting_bytes_ += wanted.content.turtle.size();
  else waiting_bytes_ -= wanted.content.turtle.size();
}

void Mirror::Impl::offer(const std::string& robot, const std::string& graph, MirroredGraph content) {
  Wanted wanted;
  wanted.content = std::move(content);
  Lock lock(mutex_);
  offer(lock, robot, graph, std::move(wanted));
}

void Mirror::Impl::offer_delete(const std::string& robot, const std::string& graph) {
  Wanted wanted;
  wanted.is_delete = true;
  Lock lock(mutex_);
  offer(lock, robot, graph, std::move(wanted));
}

/// The newest graph replaces a waiting one, and is skipped if the store has it already.
void Mirror::Impl::offer(Lock& lock, const std::string& robot, const std::string& name, Wanted wanted) {
  if (stopped_) return;
  const bool is_mark = name == mirror_mark_of(robot);
  auto found = graphs_.find(name);
  if (found == graphs_.end()) {
    if (wanted.is_delete && (!is_mark || state_)) return;  // it was never there; with a state this is known of marks, too
    if (graphs_.size() >= options_.max_graphs) {
      lock.unlock();
      return event(Kind::graph_refused, name, "there are more than " + std::to_string(options_.max_graphs) + " graphs");
    }
    found = graphs_.emplace(name, Graph{}).first;
    found->second.robot = robot;
  }
  Graph& graph = found->second;
  wanted.since = graph.wanted ? graph.wanted->since : std::chrono::steady_clock::now();
  if (graph.wanted) set_waiting_bytes(*graph.wanted, false);
  graph.wanted.reset();
  const std::string value = wanted.value();
  const bool is_refused = !wanted.is_delete && graph.refused == value;
  if (!graph.is_sent_now && (graph.stored == value || is_refused)) graph.late_since.reset();
  if (!graph.is_sent_now && graph.stored == value) {
    if (!wanted.is_delete) ++counts_.unchanged;
    return;
  }
  if (is_refused) return;
  if (!is_mark && waiting_bytes_ + wanted.content.turtle.size() > options_.max_waiting_bytes) {
    wanted.has_content = wanted.is_delete;
    wanted.content = {};
  }
  set_waiting_bytes(wanted, true);
  if (!graph.late_since) graph.late_since = wanted.since;
  graph.wanted = std::move(wanted);
  if (!graph.is_sent_now) queue(name, graph);
}

void Mirror::Impl::queue(const std::string& name, Graph& graph) {
  if (std::exchange(graph.is_queued, true)) return;
  queue_.push_back(name);
  changed_.notify_all();
}

/// Waits until the next request to the store is allowed: after a failure, and at the rate of the options. False: stopped.
bool Mirror::Impl::wait_for_turn(Lock& lock) {
  while (!stopped_) {
    const Instant now = std::chrono::steady_clock::now();
    const Instant due = std::max(ready_at_, next_turn_);
    // After a failure, a single request tests whether the store responds again.
    const bool is_tried = store_failures_ > 0 && being_sent_ > 0;
    if (queue_.empty() || is_tried) {
      changed_.wait(lock);
    } else if (due > now) {
      changed_.wait_until(lock, due);
    } else {
      if (options_.max_rate > 0) {
        const auto between = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(1 / options_.max_rate));
        next_turn_ = std::max(next_turn_, now - std::chrono::milliseconds(100)) + between;
      }
      return true;
    }
  }
  return false;
}

/// Runs on separate threads.
void Mirror::Impl::send_all() {
  Lock lock(mutex_);
  while (wait_for_turn(lock)) {
    const std::string name = std::move(queue_.front());
    queue_.pop_front();
    Graph& graph = graphs_.at(name);  // its address is stable, and it is not removed while it is sent
    graph.is_queued = false;
    if (!graph.wanted) continue;
    graph.is_sent_now = true;
    ++being_sent_;
    try {
      send(lock, name, graph);
    } catch (const std::exception& error) {
      if (!lock.owns_lock()) lock.lock();
      take_store_failure(lock, error.what(), std::nullopt);
    }
    if (!graph.wanted && graph.stored == MirrorState::deleted && name != mirror_mark_of(graph.robot) && state_ && graph.on_disk != OnDisk::nothing) {
      Result<void> written;
      {
        const std::lock_guard state_lock(state_mutex_);
        written = state_->write_forgotten(name);
      }
      graph.on_disk = OnDisk::nothing;
      graph.is_changed = false;
      take_state_error(lock, written);
    }
    --being_sent_;
    graph.is_sent_now = false;
    if (!graph.wanted) graph.late_since.reset();  // sent, refused or not needed
    if (graph.wanted) queue(name, graph);
    else if (graph.stored == MirrorState::deleted && name != mirror_mark_of(graph.robot)) graphs_.erase(name);
    changed_.notify_all();
  }
}

/// Reads a resource again whose graph did not fit into memory. False: it must not be sent.
bool Mirror::Impl::load(Lock& lock, const std::string& name, Graph& graph, Wanted& wanted) {
  const std::string robot = graph.robot;
  lock.unlock();
  const Result<client::RepresentationPtr> read = session_->get(name);
  Result<MirroredGraph> content = read ? mirrored((*read)->graph) : Result<MirroredGraph>(unexpected(read.error()));
  lock.lock();
  if (!content) {
    wanted.is_delete = content.error().code == Errc::unknown_path;
    return wanted.is_delete;  // else the next reading of the robot offers it again
  }
  wanted.content = *std::move(content);
  wanted.has_content = true;
  return graph.stored != wanted.value();
}

void Mirror::Impl::send(Lock& lock, const std::string& name, Graph& graph) {
  Wanted wanted = *std::move(graph.wanted);
  graph.wanted.reset();
  set_waiting_bytes(wanted, false);
  if (!wanted.has_content && !load(lock, name, graph, wanted)) return;
  if (graph.stored == wanted.value()) {
    ++counts_.unchanged;
    return;
  }
  const std::string entity_tag = std::exchange(graph.entity_tag, {}), robot = graph.robot;
  const OnDisk on_disk = graph.on_disk;
  graph.stored.clear();
  graph.is_changed = false;
  lock.unlock();
  Result<void> written;
  if (state_ && on_disk != OnDisk::unknown) {
    const std::lock_guard state_lock(state_mutex_);
    written = state_->write_unknown({name, robot, {}, {}}, on_disk == OnDisk::known);
  }
  Result<GraphStore::Answer> answer = wanted.is_delete ? store_->remove(name) : store_->put(name, wanted.content.turtle, entity_tag);
  bool is_overwritten = false;
  if (answer && answer->status == 412 && !entity_tag.empty()) {
    is_overwritten = true;
    answer = store_->put(name, wanted.content.turtle, {});
  }
  lock.lock();
  if (state_) {
    graph.on_disk = OnDisk::unknown;
    take_state_error(lock, written);
  }
  if (is_overwritten && answer && answer->ok()) {
    ++counts_.overwritten;
    lock.unlock();
    event(Kind::graph_overwritten, name, "another client changed the graph in the store; the robot's version was restored");
    lock.lock();
  }
  take_answer(lock, name, graph, std::move(wanted), answer);
}

void Mirror::Impl::take_answer(Lock& lock, const std::string& name, Graph& graph, Wanted wanted, const Result<GraphStore::Answer>& answer) {
  if (stopped_) return;
  const bool is_gone = wanted.is_delete && answer && (answer->status == 404 || answer->status == 410);
  if (answer && (answer->ok() || is_gone)) {
    graph.stored = wanted.value();
    graph.late_since = graph.wanted ? std::optional(graph.wanted->since) : std::nullopt;  // a newer one may have come meanwhile
    graph.refused.clear();
    graph.failures = 0;
    graph.entity_tag = wanted.is_delete ? std::string() : answer->entity_tag;
    graph.is_changed = true;
    if (!wanted.is_delete) ++counts_.sent, counts_.sent_bytes += wanted.content.turtle.size();
    else if (!is_gone) ++counts_.deleted;
    const bool was_lost = std::exchange(store_failures_, 0) > 0;
    failing_since_.reset();
    lock.unlock();
    if (was_lost) event(Kind::store_returned, options_.store.endpoint);
    if (!is_gone) event(wanted.is_delete ? Kind::graph_deleted : Kind::graph_sent, name);
    lock.lock();
    return;
  }
  const int status = answer ? answer->status : 0;
  const std::string reason = answer ? answer->reason : answer.error().message;
  const bool is_refused_user = status == 401 || status == 403 || (!answer && answer.error().code == Errc::refused);
  const bool has_no_protocol = counts_.sent + counts_.deleted == 0 && (status == 404 || status == 405 || status == 501);
  if (is_refused_user || has_no_protocol) {
    // Nothing that was sent later could succeed.
    const std::string what = is_refused_user ? "the store refuses the user: " : "the store has no Graph Store Protocol there: ";
    if (!failure_) failure_ = Error{is_refused_user ? Errc::refused : Errc::failed, what + reason};
    stopped_ = true;
    changed_.notify_all();
    due_.notify_all();
    return;
  }
  const bool is_temporary =
      status == 0 ? is_away(answer.error()) : status == 408 || status == 425 || status == 429 || (status >= 500 && status != 501 && status != 505);
  // If a store fails repeatedly with 500, only this graph may be the reason. The others must not wait for it. The next reading of the robot
  // offers it again.
  constexpr unsigned max_failures = 5;
  constexpr int internal_error = 500;
  const bool is_of_graph = ++graph.failures >= max_failures && status == internal_error;
  if (is_temporary && !is_of_graph) {
    if (!graph.wanted) {  // else a newer one waits
      set_waiting_bytes(wanted, true);
      graph.wanted = std::move(wanted);
    }
    store_code_ = status == 0 ? answer.error().code : Errc::failed;
    return take_store_failure(lock, reason, answer ? answer->retry_after : std::nullopt);
  }
  ++counts_.refused;
  graph.failures = 0;
  if (!wanted.is_delete && !is_of_graph) graph.refused = wanted.value();
  lock.unlock();
  event(Kind::graph_refused, name, reason);
  lock.lock();
}

void Mirror::Impl::take_store_failure(Lock& lock, const std::string& reason, std::optional<std::chrono::seconds> retry_after) {
  ++counts_.failures;
  const Instant now = std::chrono::steady_clock::now();
  if (!failing_since_) failing_since_ = now;
  const bool is_new = store_failures_++ == 0;
  milliseconds pause = pause_after(store_failures_, options_.first_pause, options_.max_pause);
  if (retry_after) pause = std::max(pause, std::min(milliseconds(*retry_after), options_.max_pause));
  ready_at_ = now + pause;
  store_reason_ = reason;
  if (!is_new) return;
  lock.unlock();
  event(Kind::store_lost, options_.store.endpoint, reason);
  lock.lock();
}

// --- The state ---

void Mirror::Impl::take_state_error(Lock& lock, const Result<void>& written) {
  if (written || std::exchange(state_failed_, true)) return;
  lock.unlock();
  event(Kind::problem, options_.state_file, written.error().message + "; the mirror continues without a state file");
  lock.lock();
}

/// Writes the known content of the store, except for graphs that are being sent.
void Mirror::Impl::write_state(Lock& lock) {
  std::vector<StoredGraph> known;
  for (auto& [name, graph] : graphs_) {
    if (!graph.is_changed || graph.is_sent_now || graph.wanted || graph.stored.empty()) continue;
    graph.is_changed = false;
    graph.on_disk = OnDisk::known;
    known.push_back({name, graph.robot, graph.stored, graph.entity_tag});
  }
  if (known.empty()) return;
  Result<void> written;
  {
    // Under both locks: a graph that is sent next must write after this.
    const std::lock_guard state_lock(state_mutex_);
    written = state_->write_known(known);
  }
  take_state_error(lock, written);
}

// --- All of it ---

Result<void> Mirror::Impl::start_threads() {
  const auto add = [&](const char* name, void (Impl::*run)()) -> Result<void> {
    Result<Thread> thread = start_thread(name, options_.client.threads, [this, run] { (this->*run)(); });
    if (!thread) return unexpected(std::move(thread).error());
    const std::lock_guard lock(mutex_);
    threads_.push_back(*std::move(thread));
    return {};
  };
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return unexpected(failure_.value_or(Error{Errc::closed, "the mirror has ended"}));
    if (std::exchange(is_started_, true)) return unexpected(Errc::invalid_option, "the mirror was started before");
    state_due_ = std::chrono::steady_clock::now() + state_pause;
  }
  Result<void> started = add("lrt-mirror", &Impl::schedule);
  for (std::size_t i = 0; i < options_.max_requests && started; ++i) started = add("lrt-mirror-send", &Impl::send_all);
  if (!started) stop();
  return started;
}

Result<void> Mirror::Impl::start() { return start_threads(); }

Result<MirrorCounts> Mirror::Impl::copy(const std::function<bool()>& goes_on) {
  {
    const std::lock_guard lock(mutex_);
    only_once_ = true;
  }
  if (Result<void> started = start_threads(); !started) return unexpected(std::move(started).error());
  Result<MirrorCounts> result = [&]() -> Result<MirrorCounts> {
    Lock lock(mutex_);
    while (true) {
      if (failure_) return unexpected(*failure_);
      if (stopped_) return unexpected(Errc::cancelled, "the mirror was stopped");
      const bool are_read =
          robots_being_read_ == 0 && std::all_of(robots_.begin(), robots_.end(), [](const auto& r) { return r.second.was_read || r.second.is_away; });
      if (are_read && queue_.empty() && being_sent_ == 0) return counts_now();
      const Instant now = std::chrono::steady_clock::now();
      if (failing_since_ && now - *failing_since_ > options_.patience) return unexpected(store_code_, store_reason_);
      changed_.wait_for(lock, tick);
      if (!goes_on) continue;
      lock.unlock();
      if (!goes_on()) return unexpected(Errc::cancelled, "the copy was cancelled");
      lock.lock();
    }
  }();
  stop();
  return result;
}

void Mirror::Impl::stop() noexcept {
  std::vector<Thread> threads;
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    threads.swap(threads_);
    changed_.notify_all();
    due_.notify_all();
  }
  store_->stop();
  session_->stop();  // ends the watches, and waits for their callbacks
  readers_.stop();
  threads.clear();
  try {
    Lock lock(mutex_);
    if (state_) write_state(lock);
  } catch (...) {}  // without memory the state is not changed, which is safe
}

Result<Mirror> Mirror::create(MirrorOptions options) {
  if (options.robots.empty()) return unexpected(Errc::invalid_option, "robots of a mirror: expected at least one");
  for (const Result<void>& good :
       {positive(options.max_requests > 0, "max_requests"), positive(options.max_rate >= 0, "max_rate"),
        positive(options.max_readers > 0, "max_readers"), positive(options.refresh_interval.count() > 0, "refresh_interval"),
        positive(options.first_pause.count() > 0, "first_pause"), positive(options.max_pause.count() > 0, "max_pause"),
        positive(options.store.response_time.count() > 0, "response_time")})
    if (!good) return unexpected(good.error());
  options.client.callbacks = client::Callbacks::in_background;
  options.store.ca_file = options.store.ca_file.empty() ? options.client.ca_file : options.store.ca_file;
  Result<std::unique_ptr<GraphStore>> store = GraphStore::create(options.store, options.max_requests, options.client.log);
  if (!store) return unexpected(std::move(store).error());
  Result<std::shared_ptr<client::HttpClient>> http = client::HttpClient::create(options.client);
  if (!http) return unexpected(std::move(http).error());
  for (const std::string& robot : options.robots) {
    const Result<http::Url> url = http::parse_url(client::document_of(robot));
    if (!url) return unexpected(url.error().code, "\"" + robot + "\": " + url.error().message);
    (*http)->trust(*url);
  }
  std::unique_ptr<MirrorState> state;
  if (!options.state_file.empty()) {
    Result<std::unique_ptr<MirrorState>> opened = MirrorState::open(options.state_file, options.store.endpoint, options.max_graphs);
    if (!opened) return unexpected(std::move(opened).error());
    state = *std::move(opened);
  }
  auto session = std::make_shared<client::Session>(*std::move(http), options.client);
  session->accept_gzip();  // it reads whole robots, often over long ways
  return Mirror(std::make_shared<Impl>(std::move(options), std::move(session), *std::move(store), std::move(state)));
}

Mirror::Mirror(std::shared_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Mirror::Mirror(Mirror&&) noexcept = default;
Mirror& Mirror::operator=(Mirror&& other) noexcept {
  if (this != &other) {
    if (impl_) impl_->stop();
    impl_ = std::move(other.impl_);
  }
  return *this;
}
Mirror::~Mirror() {
  if (impl_) impl_->stop();
}
Result<MirrorCounts> Mirror::copy(const std::function<bool()>& goes_on) { return impl_->copy(goes_on); }
Result<void> Mirror::start() { return impl_->start(); }
MirrorCounts Mirror::counts() const { return impl_->counts(); }
std::vector<Metric> Mirror::metrics() const { return impl_->metrics(); }
std::optional<Error> Mirror::failure() const { return impl_->failure(); }
void Mirror::stop() noexcept { impl_->stop(); }

}  // namespace v0
}  // namespace lrt::mirror
