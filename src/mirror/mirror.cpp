// SPDX-License-Identifier: Apache-2.0
#include <lrt/mirror.hpp>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include <lrt/base/clock.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/random.hpp"
#include "src/base/back_off.hpp"
#include "src/base/thread.hpp"
#include "src/mirror/comparison.hpp"
#include "src/mirror/graph_store.hpp"
#include "src/mirror/mark.hpp"
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

/// 500 as the response to a single graph, so often in succession, is that graph's fault and not the store's: the others must not wait for it.
constexpr unsigned max_failures_of_graph = 5;
constexpr int internal_error = 500;

/// Whether the same request may succeed later.
bool is_temporary(const Result<GraphStore::Answer>& answer) noexcept {
  if (!answer) return is_away(answer.error());
  const int status = answer->status;
  return status == 408 || status == 425 || status == 429 || (status >= 500 && status != 501 && status != 505);
}

/// Whether a store that responds to this has been away, so that it may have been started again or restored. After 500 or 429 it has not.
bool has_been_away(const Result<GraphStore::Answer>& answer) noexcept {
  return !answer || answer->status == 502 || answer->status == 503 || answer->status == 504;
}

bool is_missing(const Result<GraphStore::Answer>& answer) noexcept { return answer && (answer->status == 404 || answer->status == 410); }

/// A response that is larger than all that a mirror sends.
bool is_too_large(const Result<GraphStore::Answer>& answer) noexcept { return !answer && answer.error().code == Errc::limit_exceeded; }

/// Whether the store does not give a graph, and would not give it later either: 403, 405, 406 and similar statuses.
bool is_not_given(const Result<GraphStore::Answer>& answer) noexcept {
  if (!answer) return !is_away(answer.error()) && answer.error().code != Errc::refused;
  return !answer->ok() && answer->status != 304 && answer->status != 401 && !is_missing(answer) && !is_temporary(answer);
}

/// The entity tag of a robot as it is kept; empty: there is none.
std::string robot_tag_of(const client::Representation& representation) {
  constexpr std::size_t longest = 1'024;
  const std::string& tag = representation.entity_tag;
  return tag.size() <= longest && tag.find_first_of(" \t") == std::string::npos ? tag : std::string();
}

/// An xsd:dateTime without a fraction, of which stores leave zeros out.
std::string now_in_seconds() {
  std::string text = to_xsd_date_time(std::chrono::system_clock::now());
  if (const std::size_t point = text.find('.'); point != std::string::npos) text.replace(point, std::string::npos, "Z");
  return text;
}

/// The URL of a robot as its graphs are named: "http://robot.example" is "http://robot.example/".
std::string robot_of(const std::string& given) {
  std::string url(client::document_of(given));
  const std::size_t host = url.find("://");
  if (host != std::string::npos && url.find_first_of("/?", host + 3) == std::string::npos) url += '/';
  return url;
}

Result<void> positive(bool is_good, const char* name) {
  if (is_good) return {};
  return unexpected(Errc::invalid_option, std::string(name) + " of a mirror: expected more than 0");
}

}  // namespace

std::string mirror_mark_of(const std::string& robot) { return robot_of(robot) + "#mirror"; }

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
    bool has_content = true;    ///< false: there was no room, or it may not be needed; the resource is read if it is
    bool is_read = false;       ///< by a reading of the robot, which compares with the store; false: a single change
    bool must_look = false;     ///< the store is believed to have it, which is to be confirmed
    bool is_watchable = false;  ///< see StoredGraph; of a reading
    MirroredGraph content{};
    std::string robot_tag{};             ///< see StoredGraph
    std::optional<std::string> there{};  ///< the fingerprint of what was found in the store instead; empty: nothing; nullopt: it was not looked at
    Instant since{};                     ///< when the first of the changes came that it replaces
    std::string value() const { return is_delete ? MirrorState::deleted : content.digest; }
  };
  enum class OnDisk : unsigned char { nothing, unknown, known };
  enum class Queued : unsigned char { no, to_look, to_send };
  struct Graph {
    std::string robot;
    std::string stored;      ///< what the store has: a digest, MirrorState::deleted, or empty: unknown
    std::string entity_tag;  ///< by the store
    std::string echo;        ///< see StoredGraph
    std::string robot_tag;   ///< of `stored`
    bool is_watchable = false;
    std::string refused;  ///< the digest of a graph that the store refuses
    std::optional<Wanted> wanted;
    std::optional<Instant> late_since;  ///< the store lacks a change of the graph
    Queued queued = Queued::no;
    bool is_sent_now = false, is_deleted_now = false;
    OnDisk on_disk = OnDisk::nothing;
    bool is_changed = false;    ///< since the state was written
    bool is_not_given = false;  ///< the store does not give it, which was reported
    unsigned failures = 0;      ///< of the store with this graph, in succession
  };
  struct Robot {
    std::string url, mark;
    std::string identity;  ///< the IRI that it states (lrt:identity); empty: it states none
    bool was_read = false, is_away = false;
    bool is_elsewhere = false;              ///< its URL describes something elsewhere
    bool must_look_at_mark = true;          ///< it is not known which graphs the store lists
    std::optional<std::string> mark_there;  ///< Wanted::there of the mark
    std::string stored_since, since;        ///< since when it cannot be read: by the mark in the store, and as it is to be there
    bool is_being_read = false, must_be_read_again = false;
    unsigned failures = 0, mark_failures = 0;
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
  /// Whether a copy has done what it can for a robot.
  static bool is_done(const Robot& robot) noexcept { return robot.is_elsewhere || ((robot.was_read || robot.is_away) && !robot.must_look_at_mark); }
  void end(Error error);
  Result<void> start_threads();

  // Reading.
  void schedule();
  void read(Robot& robot);
  void read_all(Robot& robot);
  RobotReading reading_of(Robot& robot, std::set<std::string>& found, std::set<std::string>& missing);
  void take_identity(Robot& robot, const rdf::Graph& graph);
  void take_unchanged(Robot& robot, const std::string& url);
  void take_found(Robot& robot, const std::set<std::string>& found);
  void take_left(Robot& robot, const Error& error);
  void take_elsewhere(Robot& robot, const Error& error);
  void forget_missing(Robot& robot, const std::set<std::string>& found, bool is_complete);
  void begin_watch(Robot& robot, const std::string& url, const std::vector<std::string>* links);
  void take_change(Robot& robot, const std::string& url, const client::Change& change);
  void look_at_watches(Robot& robot);
  void read_soon(Robot& robot);

  // The mark.
  void look_at_mark(Robot& robot);
  void take_mark(Lock& lock, Robot& robot, const Result<GraphStore::Answer>& answer, const Echo& echo);
  void offer_mark(Robot& robot);

  // Sending.
  /// What the response to a read says of a graph. settled: it says nothing of the graph, and what it says was taken
  enum class Reply : unsigned char { same, other, missing, settled };
  /// What the store has of a graph before it is sent, as far as is known.
  struct Believed {
    std::string entity_tag, stored, echo;  ///< see Graph
  };
  /// What was done for a graph that is sent.
  struct Sent {
    Result<GraphStore::Answer> answer;
    bool was_lost = false, was_overwritten = false;
    bool was_there = false;  ///< the store had it already
    std::string echo{};
    unsigned more_requests = 0;
  };
  void offer(const std::string& robot, const std::string& graph, Wanted wanted);
  void offer_delete(const std::string& robot, const std::string& graph);
  void offer(Lock& lock, const std::string& robot, const std::string& graph, Wanted wanted);
  void queue(const std::string& name, Graph& graph);
  void send_all();
  bool wait_for_turn(Lock& lock, bool for_queues);
  void reserve_turns(unsigned requests);
  std::map<std::string, Graph>::iterator take_next();
  bool is_confirmed(Lock& lock, const std::string& name, Graph& graph, Wanted& wanted);
  Reply take_reply(Lock& lock, const Result<GraphStore::Answer>& answer, bool is_of_mark);
  Sent put_or_remove(const std::string& name, const Wanted& wanted, const Believed& believed, bool reads_back) const;
  void report_repairs(Lock& lock);
  void send(Lock& lock, const std::string& name, Graph& graph);
  bool load(Lock& lock, const std::string& name, Wanted& wanted);
  void take_answer(Lock& lock, const std::string& name, Graph& graph, Wanted wanted, const Sent& sent);
  void take_store_success(Lock& lock);
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
  std::deque<std::string> to_look_, to_send_;  ///< names; one whose Graph::queued is another, or that has no graph, is out of date
  unsigned turns_ = 0;
  std::size_t waiting_bytes_ = 0, being_sent_ = 0, robots_being_read_ = 0;
  MirrorCounts counts_;
  std::map<std::string, Robot> robots_;  ///< not changed after construction; a Robot's watches and links only by its one reading, under the lock
  // The store.
  Instant ready_at_{}, next_turn_{};
  unsigned store_failures_ = 0;
  bool store_was_away_ = false;  ///< one of these failures was no response, or that of a proxy
  bool cannot_be_read_ = false;  ///< it has no GET, or not for this user: it does not give the list of a robot. Each reading tries again
  std::uint64_t lost_reported_ = 0, overwritten_reported_ = 0;
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
    Robot& robot = robots_[robot_of(url)];
    robot.url = robot_of(url);
    robot.mark = mirror_mark_of(url);
  }
  if (!state_) return;
  for (StoredGraph& known : state_->take()) {
    Graph& graph = graphs_[known.graph];
    graph.robot = std::move(known.robot);
    graph.on_disk = known.digest.empty() ? OnDisk::unknown : OnDisk::known;
    if (options_.start == MirrorStart::force) continue;
    graph.stored = std::move(known.digest);
    graph.entity_tag = std::move(known.entity_tag);
    graph.echo = std::move(known.echo);
    graph.robot_tag = std::move(known.robot_tag);
    graph.is_watchable = known.is_watchable;
  }
}

MirrorCounts Mirror::Impl::counts_now() const {
  MirrorCounts counts = counts_;
  counts.waiting = to_send_.size() + being_sent_;
  const Instant now = std::chrono::steady_clock::now();
  for (const auto& [name, graph] : graphs_)
    if (graph.late_since) counts.lag = std::max(counts.lag, std::chrono::duration_cast<milliseconds>(now - *graph.late_since));
  counts.graphs = static_cast<std::size_t>(std::count_if(
      graphs_.begin(), graphs_.end(), [](const auto& g) { return !g.second.stored.empty() && g.second.stored != MirrorState::deleted; }));
  const auto number_of = [this](bool Robot::*is) {
    return static_cast<std::size_t>(std::count_if(robots_.begin(), robots_.end(), [is](const auto& r) { return r.second.*is; }));
  };
  counts.robots_away = number_of(&Robot::is_away);
  counts.robots_elsewhere = number_of(&Robot::is_elsewhere);
  return counts;
}

/// Under the lock: nothing that is tried later could succeed.
void Mirror::Impl::end(Error error) {
  if (!failure_) failure_ = std::move(error);
  stopped_ = true;
  changed_.notify_all();
  due_.notify_all();
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
      if (only_once_ && is_done(robot)) continue;
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
  else if (only_once_) robot.due = std::max(now + options_.first_pause, ready_at_);  // if the store has not said yet what it has
  else robot.due = now + (robot.failures > 0 ? pause_after(robot.failures, options_.first_pause, options_.max_pause) : options_.refresh_interval);
  changed_.notify_all();
}

void Mirror::Impl::read_all(Robot& robot) {
  look_at_mark(robot);
  std::set<std::string> found, missing;
  const Result<bool> read = read_robot(*session_, robot.url, reading_of(robot, found, missing));
  if (!read) {
    if (read.error().code == Errc::cancelled) return;
    if (read.error().code == Errc::invalid_option) return take_elsewhere(robot, read.error());
    return take_left(robot, read.error());
  }
  for (const std::string& url : missing) offer_delete(robot.url, url);
  take_found(robot, found);
  forget_missing(robot, found, *read);
  offer_mark(robot);
}

/// @param found, missing  they live longer than the result
RobotReading Mirror::Impl::reading_of(Robot& robot, std::set<std::string>& found, std::set<std::string>& missing) {
  RobotReading reading;
  reading.on_resource = [this, &robot, &found](const client::RepresentationPtr& resource) {
    if (found.empty()) take_identity(robot, resource->graph);
    found.insert(resource->url);
    Result<MirroredGraph> content = mirrored(resource->graph);
    if (!content) {
      event(Kind::problem, resource->url, content.error().message);
      const std::lock_guard lock(mutex_);
      ++counts_.unread;
      return;
    }
    Wanted wanted;
    wanted.is_read = true;
    wanted.is_watchable = is_worth_watching(*resource);
    wanted.robot_tag = robot_tag_of(*resource);
    wanted.content = *std::move(content);
    const bool is_watchable = wanted.is_watchable;
    offer(robot.url, resource->url, std::move(wanted));
    if (only_once_ || !is_watchable) return;
    const std::vector<std::string> links = mirrored_links(resource->graph, resource->url, {});
    begin_watch(robot, resource->url, &links);
  };
  reading.on_problem = [this, &missing](const std::string& url, const Error& error) {
    if (error.code == Errc::unknown_path) {
      missing.insert(url);
      return;
    }
    if (error.code == Errc::unsupported_syntax) return;  // a mesh has no graph
    event(Kind::problem, url, error.message);
    if (error.code == Errc::refused) return;  // it is not for this client
    const std::lock_guard lock(mutex_);
    ++counts_.unread;
  };
  reading.known_tag = [this, &robot](const std::string& url) {
    if (url == robot.url) return std::string();  // it says who the robot is
    const std::lock_guard lock(mutex_);
    const auto known = graphs_.find(url);
    const bool is_stored = known != graphs_.end() && !known->second.stored.empty() && known->second.stored != MirrorState::deleted;
    return is_stored && known->second.robot == robot.url ? known->second.robot_tag : std::string();
  };
  reading.on_unchanged = [this, &robot, &found](const std::string& url) {
    found.insert(url);
    take_unchanged(robot, url);
  };
  reading.known = [this, &robot] {
    std::vector<std::string> urls;
    const std::lock_guard lock(mutex_);
    for (const auto& [name, graph] : graphs_)
      if (graph.robot == robot.url && name != robot.mark && graph.stored != MirrorState::deleted) urls.push_back(name);
    return urls;
  };
  return reading;
}

/// Robots of one identity are copies of one configuration, or one robot by two URLs. Both are mirrored, by their URLs.
void Mirror::Impl::take_identity(Robot& robot, const rdf::Graph& graph) {
  std::string identity, other;
  if (const auto states = graph.find(vocab::lrt_::identity))
    for (const rdf::Triple& t : graph.match(std::nullopt, *states, std::nullopt))
      if (const rdf::TermView object = graph.term(t.object); object.is_iri()) identity = object.text;
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(robot.identity, identity) == identity || identity.empty()) return;
    for (const auto& [url, known] : robots_)
      if (&known != &robot && known.identity == identity) other = url;
  }
  if (!other.empty())
    event(Kind::problem, robot.url, "\"" + robot.url + "\" and \"" + other + "\" have one identity, <" + identity + ">: give each robot its own");
}

/// The robot still has what an earlier mirror read: its content was not transferred.
void Mirror::Impl::take_unchanged(Robot& robot, const std::string& url) {
  Wanted wanted;
  wanted.is_read = true;
  wanted.has_content = false;
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = graphs_.find(url); known != graphs_.end()) {
      wanted.content.digest = known->second.stored;  // empty: it is being sent; then it is read when that has ended
      wanted.robot_tag = known->second.robot_tag;
      wanted.is_watchable = known->second.is_watchable;
    }
  }
  const bool is_watchable = wanted.is_watchable;
  offer(robot.url, url, std::move(wanted));
  if (!only_once_ && is_watchable) begin_watch(robot, url, nullptr);
}

void Mirror::Impl::take_left(Robot& robot, const Error& error) {
  bool has_left = false;
  {
    const std::lock_guard lock(mutex_);
    ++robot.failures;
    robot.is_elsewhere = false;
    has_left = !std::exchange(robot.is_away, true);
    if (robot.since.empty()) robot.since = robot.stored_since.empty() ? now_in_seconds() : robot.stored_since;
  }
  offer_mark(robot);
  if (has_left) event(Kind::robot_left, robot.url, error.message);
}

void Mirror::Impl::take_found(Robot& robot, const std::set<std::string>& found) {
  bool was_away = false, is_new = false;
  {
    const std::lock_guard lock(mutex_);
    robot.failures = 0;
    robot.is_elsewhere = false;
    robot.since.clear();
    robot.stored_since.clear();
    was_away = std::exchange(robot.is_away, false);
    is_new = !std::exchange(robot.was_read, true);
  }
  if (was_away) event(Kind::robot_returned, robot.url);
  else if (is_new) event(Kind::robot_found, robot.url, std::to_string(found.size()) + (found.size() == 1 ? " resource" : " resources"));
}

/// If that is so of all robots, the mirror ends: somebody has to give it other URLs.
void Mirror::Impl::take_elsewhere(Robot& robot, const Error& error) {
  bool is_new = false;
  {
    const std::lock_guard lock(mutex_);
    ++robot.failures;
    robot.is_away = false;
    is_new = !std::exchange(robot.is_elsewhere, true);
    if (std::all_of(robots_.begin(), robots_.end(), [](const auto& r) { return r.second.is_elsewhere; })) return end({Errc::failed, error.message});
  }
  if (is_new) event(Kind::problem, robot.url, error.message);
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
    if (!read && read.error().code != Errc::refused) {
      const std::lock_guard lock(mutex_);
      ++counts_.unread;
    }
    if (!read && is_away(read.error())) return;
    if (!read || (*read)->url != url) continue;
    Result<MirroredGraph> content = mirrored((*read)->graph);
    if (!content) continue;
    Wanted wanted;
    wanted.is_read = true;
    wanted.is_watchable = is_worth_watching(**read);
    wanted.robot_tag = robot_tag_of(**read);
    wanted.content = *std::move(content);
    offer(robot.url, url, std::move(wanted));
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

/// @param links  see Robot::links; null: they are those that an earlier mirror has read
void Mirror::Impl::begin_watch(Robot& robot, const std::string& url, const std::vector<std::string>* links) {
  {
    const std::lock_guard lock(mutex_);
    if (stopped_ || robot.unwatchable.count(url) != 0) return;
    if (links != nullptr) robot.links[url] = *links;
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
  Wanted wanted;
  wanted.content = *std::move(content);
  offer(robot.url, url, std::move(wanted));
  std::vector<std::string> links = mirrored_links(*graph, url, {});
  bool has_other_links = false;
  {
    const std::lock_guard lock(mutex_);
    const auto [known, is_first] = robot.links.try_emplace(url);
    // Of a resource that has not changed since an earlier mirror read it, that mirror has read all that it leads to.
    if (is_first) has_other_links = std::any_of(links.begin(), links.end(), [this](const std::string& link) { return graphs_.count(link) == 0; });
    else has_other_links = known->second != links;
    known->second = std::move(links);
  }
  if (has_other_links) read_soon(robot);
}

// --- The mark ---

/// Reads what the store says of a robot. That is one request for each reading.
void Mirror::Impl::look_at_mark(Robot& robot) {
  Lock lock(mutex_);
  robot.must_look_at_mark = !cannot_be_read_;
  // While the store fails, one request at a time finds out when it responds again. Then all robots are read.
  const bool is_tried = store_failures_ > 0 && (being_sent_ > 0 || std::chrono::steady_clock::now() < ready_at_);
  if (is_tried || !wait_for_turn(lock, false)) return;
  ++being_sent_;
  lock.unlock();
  Result<GraphStore::Answer> answer = unexpected(Errc::failed, {});
  Result<Echo> echo = Echo();
  try {
    answer = store_->get(robot.mark, {});
    if (answer && answer->ok()) echo = echo_of(answer->body, answer->media_type, store_->url_of(robot.mark));
  } catch (...) {
    lock.lock();
    --being_sent_;
    changed_.notify_all();
    throw;
  }
  lock.lock();
  --being_sent_;
  changed_.notify_all();
  if (!echo) echo = Echo();
  take_mark(lock, robot, answer, *echo);
}

void Mirror::Impl::take_mark(Lock& lock, Robot& robot, const Result<GraphStore::Answer>& answer, const Echo& echo) {
  // If only this graph fails, the copy must not wait for it.
  const bool is_given_up = answer && answer->status == internal_error && ++robot.mark_failures >= max_failures_of_graph;
  const Reply reply = is_given_up ? Reply::other : take_reply(lock, answer, true);
  if (reply == Reply::settled) {
    robot.must_look_at_mark = !cannot_be_read_;
    return;
  }
  robot.must_look_at_mark = false;
  if (!is_given_up) robot.mark_failures = 0;
  const Mark mark = echo.graph ? mark_of(*echo.graph, robot.url, robot.mark, options_.max_graphs) : Mark();
  robot.stored_since = mark.since;
  if (robot.is_away && !mark.since.empty()) robot.since = mark.since;  // in the store's own form
  for (const std::string& name : mark.graphs) {
    if (graphs_.size() >= options_.max_graphs) break;
    if (const auto [graph, is_new] = graphs_.try_emplace(name); is_new) graph->second.robot = robot.url;
  }
  auto known = graphs_.find(robot.mark);
  if (known == graphs_.end()) {
    if (reply == Reply::missing || graphs_.size() >= options_.max_graphs) return;
    known = graphs_.try_emplace(robot.mark).first;
    known->second.robot = robot.url;
  }
  Graph& graph = known->second;
  if (graph.is_sent_now) return;
  const bool is_believed = reply == Reply::other && !is_given_up && (options_.start != MirrorStart::force || robot.was_read);
  const std::string found = is_believed ? echo.fingerprint : std::string(), before = std::exchange(graph.stored, found);
  const bool is_other = before != found && !before.empty() && (is_believed || reply == Reply::missing);
  robot.mark_there = is_other ? std::optional(found) : std::nullopt;
  graph.entity_tag = answer ? answer->entity_tag : std::string();
  graph.is_changed = graph.is_changed || before != found;
}

/// Lists the graphs of a robot in the store.
void Mirror::Impl::offer_mark(Robot& robot) {
  Mark mark;
  Wanted wanted;
  {
    const std::lock_guard lock(mutex_);
    if (robot.must_look_at_mark) return;  // else what the store lists would be lost
    wanted.there = std::exchange(robot.mark_there, std::nullopt);
    mark.since = robot.since;
    for (const auto& [name, graph] : graphs_) {
      const bool is_gone = graph.stored == MirrorState::deleted || (graph.wanted ? graph.wanted->is_delete : graph.is_deleted_now);
      if (graph.robot == robot.url && name != robot.mark && !is_gone) mark.graphs.push_back(name);
    }
  }
  Result<MirroredGraph> content = mirrored(mark.graph(robot.url, robot.mark));
  if (!content) return event(Kind::problem, robot.mark, content.error().message);
  wanted.content = *std::move(content);
  offer(robot.url, robot.mark, std::move(wanted));
}

// --- Sending ---

void Mirror::Impl::set_waiting_bytes(const Wanted& wanted, bool is_added) noexcept {
  if (is_added) waiting_bytes_ += wanted.content.turtle.size();
  else waiting_bytes_ -= wanted.content.turtle.size();
}

void Mirror::Impl::offer(const std::string& robot, const std::string& graph, Wanted wanted) {
  Lock lock(mutex_);
  offer(lock, robot, graph, std::move(wanted));
}

void Mirror::Impl::offer_delete(const std::string& robot, const std::string& graph) {
  Wanted wanted;
  wanted.is_delete = true;
  Lock lock(mutex_);
  offer(lock, robot, graph, std::move(wanted));
}

/// The newest graph replaces a waiting one. If the store is believed to have it already, a reading of the robot looks whether it has; a single change is
/// skipped.
void Mirror::Impl::offer(Lock& lock, const std::string& robot, const std::string& name, Wanted wanted) {
  if (stopped_) return;
  const bool is_mark = name == mirror_mark_of(robot);
  auto found = graphs_.find(name);
  if (found == graphs_.end()) {
    if (wanted.is_delete) return;  // it was never there
    if (graphs_.size() >= options_.max_graphs) {
      ++counts_.refused;
      lock.unlock();
      return event(Kind::graph_refused, name, "there are more than " + std::to_string(options_.max_graphs) + " graphs");
    }
    found = graphs_.emplace(name, Graph{}).first;
    found->second.robot = robot;
  }
  Graph& graph = found->second;
  if (graph.robot != robot && robots_.count(graph.robot) == 0) {  // by the state of another mirror
    graph.robot = robot;
    graph.is_changed = true;
  }
  const bool must_still_look = graph.wanted && graph.wanted->must_look;
  wanted.since = graph.wanted && !must_still_look ? graph.wanted->since : std::chrono::steady_clock::now();
  if (graph.wanted) {
    set_waiting_bytes(*graph.wanted, false);
    if (!wanted.there) wanted.there = std::move(graph.wanted->there);
  }
  graph.wanted.reset();
  const std::string value = wanted.value();
  const bool is_stored = !graph.is_sent_now && !value.empty() && graph.stored == value;
  const bool is_refused = !wanted.is_delete && !value.empty() && graph.refused == value;
  if (is_stored || (is_refused && !graph.is_sent_now)) graph.late_since.reset();
  if (is_stored) {
    if (wanted.is_delete) return;
    if (wanted.is_read && (graph.robot_tag != wanted.robot_tag || graph.is_watchable != wanted.is_watchable)) {
      graph.robot_tag = wanted.robot_tag;
      graph.is_watchable = wanted.is_watchable;
      graph.is_changed = true;
    }
    wanted.must_look = (wanted.is_read || must_still_look) && !cannot_be_read_;
    if (!wanted.must_look) {
      ++counts_.unchanged;
      return;
    }
  } else if (is_refused) {
    return;
  }
  const bool has_no_room = !is_mark && waiting_bytes_ + wanted.content.turtle.size() > options_.max_waiting_bytes;
  if (has_no_room || wanted.must_look) {
    wanted.has_content = wanted.is_delete;
    wanted.content.turtle.clear();
    wanted.content.turtle.shrink_to_fit();
  }
  set_waiting_bytes(wanted, true);
  if (!graph.late_since && !wanted.must_look) graph.late_since = wanted.since;
  graph.wanted = std::move(wanted);
  if (!graph.is_sent_now) queue(name, graph);
}

/// @pre graph.wanted
void Mirror::Impl::queue(const std::string& name, Graph& graph) {
  const Queued queued = graph.wanted->must_look ? Queued::to_look : Queued::to_send;
  if (graph.queued == queued || graph.queued == Queued::to_send) return;
  graph.queued = queued;
  (queued == Queued::to_look ? to_look_ : to_send_).push_back(name);
  changed_.notify_all();
}

/// The graph whose turn it is: one that is to be sent before one that is only looked at, but for each fourth turn. The end: the name was out of date.
/// @pre  not both queues are empty
std::map<std::string, Mirror::Impl::Graph>::iterator Mirror::Impl::take_next() {
  constexpr unsigned period = 4;
  const bool looks = to_send_.empty() || (!to_look_.empty() && ++turns_ % period == 0);
  std::deque<std::string>& queue = looks ? to_look_ : to_send_;
  const std::string name = std::move(queue.front());
  queue.pop_front();
  const auto found = graphs_.find(name);
  if (found == graphs_.end() || found->second.queued != (looks ? Queued::to_look : Queued::to_send)) return graphs_.end();
  found->second.queued = Queued::no;
  return found->second.wanted ? found : graphs_.end();
}

/// The rate of the options holds for these requests, too, which were sent without waiting.
void Mirror::Impl::reserve_turns(unsigned requests) {
  if (options_.max_rate <= 0 || requests == 0) return;
  const auto between = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(1 / options_.max_rate));
  next_turn_ = std::max(next_turn_, std::chrono::steady_clock::now() - std::chrono::milliseconds(100)) + requests * between;
}

/// Waits until the next request to the store is allowed: after a failure, and at the rate of the options. False: stopped.
/// @param for_queues  it also waits until a graph is queued
bool Mirror::Impl::wait_for_turn(Lock& lock, bool for_queues) {
  while (!stopped_) {
    const Instant due = std::max(ready_at_, next_turn_);
    // After a failure, a single request tests whether the store responds again.
    const bool is_tried = store_failures_ > 0 && being_sent_ > 0;
    if (is_tried || being_sent_ >= options_.max_requests || (for_queues && to_send_.empty() && to_look_.empty())) {
      changed_.wait(lock);
    } else if (due > std::chrono::steady_clock::now()) {
      changed_.wait_until(lock, due);
    } else {
      reserve_turns(1);
      return true;
    }
  }
  return false;
}

/// Runs on separate threads.
void Mirror::Impl::send_all() {
  Lock lock(mutex_);
  while (wait_for_turn(lock, true)) {
    const auto next = take_next();
    if (next == graphs_.end()) continue;
    const std::string name = next->first;
    Graph& graph = next->second;  // its address is stable, and it is not removed while it is sent
    graph.is_sent_now = true;
    ++being_sent_;
    try {
      send(lock, name, graph);
    } catch (const std::exception& error) {
      if (!lock.owns_lock()) lock.lock();
      take_store_failure(lock, error.what(), std::nullopt);
    }
    if (!graph.wanted && graph.stored == MirrorState::deleted && state_ && graph.on_disk != OnDisk::nothing) {
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
    graph.is_sent_now = graph.is_deleted_now = false;
    if (!graph.wanted || graph.wanted->must_look) graph.late_since.reset();  // sent, refused or not needed
    if (graph.wanted) queue(name, graph);
    else if (graph.stored == MirrorState::deleted) graphs_.erase(name);
    changed_.notify_all();
    report_repairs(lock);
  }
}

/// When nothing waits any more: how much was put right since the last report.
void Mirror::Impl::report_repairs(Lock& lock) {
  const std::uint64_t lost = counts_.lost - lost_reported_, overwritten = counts_.overwritten - overwritten_reported_;
  if (lost + overwritten == 0 || !to_send_.empty() || !to_look_.empty() || being_sent_ > 0 || stopped_) return;
  lost_reported_ = counts_.lost;
  overwritten_reported_ = counts_.overwritten;
  lock.unlock();
  event(Kind::store_repaired, options_.store.endpoint,
        "graphs that were sent again, because the store had lost them: " + std::to_string(lost) +
            ", because another client had changed them: " + std::to_string(overwritten));
  lock.lock();
}

/// Reads a resource again whose graph did not fit into memory. False: it must not be sent.
bool Mirror::Impl::load(Lock& lock, const std::string& name, Wanted& wanted) {
  lock.unlock();
  const Result<client::RepresentationPtr> read = session_->get(name);
  Result<MirroredGraph> content = read ? mirrored((*read)->graph) : Result<MirroredGraph>(unexpected(read.error()));
  lock.lock();
  if (!content) {
    wanted.is_delete = content.error().code == Errc::unknown_path;
    if (!wanted.is_delete) ++counts_.unread;  // the next reading of the robot offers it again
    return wanted.is_delete;
  }
  wanted.content = *std::move(content);
  wanted.robot_tag = robot_tag_of(**read);
  wanted.is_watchable = is_worth_watching(**read);
  wanted.has_content = true;
  return true;
}

/// What a response to a read says. Errors of the store are taken.
/// @param is_of_mark  of the list of a robot, by which is judged whether the store can be read; of another graph is_not_given() does not hold
Mirror::Impl::Reply Mirror::Impl::take_reply(Lock& lock, const Result<GraphStore::Answer>& answer, bool is_of_mark) {
  if (stopped_) return Reply::settled;
  if (is_too_large(answer)) return Reply::other;
  const bool is_missing_there = is_missing(answer);
  if (is_missing_there || (answer && (answer->ok() || answer->status == 304))) {
    if (is_of_mark) cannot_be_read_ = false;
    take_store_success(lock);
    return is_missing_there ? Reply::missing : answer->ok() ? Reply::other : Reply::same;
  }
  const std::string reason = answer ? answer->reason : answer.error().message;
  if ((answer && answer->status == 401) || (!answer && answer.error().code == Errc::refused)) {
    end({Errc::refused, "the store refuses the user: " + reason});
  } else if (is_temporary(answer)) {
    store_code_ = answer ? Errc::failed : answer.error().code;
    store_was_away_ = store_was_away_ || has_been_away(answer);
    take_store_failure(lock, reason, answer ? answer->retry_after : std::nullopt);
  } else if (!std::exchange(cannot_be_read_, true)) {
    lock.unlock();
    event(Kind::problem, options_.store.endpoint, "the store cannot be read, so it is believed to have what was sent: " + reason);
    lock.lock();
  }
  return Reply::settled;
}

/// Looks whether the store has what it is believed to have. True: nothing is left to do; it has, or that cannot be found out now. False: wanted.there is
/// what it has instead.
bool Mirror::Impl::is_confirmed(Lock& lock, const std::string& name, Graph& graph, Wanted& wanted) {
  const std::string entity_tag = options_.start == MirrorStart::verify ? std::string() : graph.entity_tag;
  lock.unlock();
  const Result<GraphStore::Answer> answer = store_->get(name, entity_tag);
  const bool has_same_tag = answer && answer->ok() && !entity_tag.empty() && answer->entity_tag == entity_tag;  // a store without If-None-Match
  std::string found = "not read";
  if (answer && answer->ok() && !has_same_tag)
    if (Result<Echo> echo = echo_of(answer->body, answer->media_type, store_->url_of(name))) found = std::move(echo->fingerprint);
  lock.lock();
  const bool is_given_up = answer && answer->status == internal_error && ++graph.failures >= max_failures_of_graph;
  if (is_given_up || (!stopped_ && is_not_given(answer))) {
    graph.failures = 0;
    ++counts_.unchanged;
    if (answer && !is_given_up) take_store_success(lock);
    if (std::exchange(graph.is_not_given, true)) return true;
    const std::string reason = answer ? answer->reason : answer.error().message;
    lock.unlock();
    event(Kind::problem, name, "it cannot be read in the store, which is believed to have it: " + reason);
    lock.lock();
    return true;
  }
  const Reply reply = take_reply(lock, answer, false);
  if (reply == Reply::settled) {
    if (cannot_be_read_) ++counts_.unchanged;
    else if (!graph.wanted && !stopped_) graph.wanted = std::move(wanted);  // it has no bytes
    return true;
  }
  graph.failures = 0;
  graph.is_not_given = false;
  const bool is_same = reply == Reply::same || (reply == Reply::other && (has_same_tag || found == graph.stored || found == graph.echo));
  if (is_same) {
    ++counts_.unchanged;
    if (reply == Reply::other && graph.entity_tag != answer->entity_tag) {
      graph.entity_tag = answer->entity_tag;
      graph.is_changed = true;
    }
    return true;
  }
  wanted.there = reply == Reply::missing ? std::string() : found;
  graph.late_since = std::chrono::steady_clock::now();
  graph.stored.clear();
  graph.echo.clear();
  graph.entity_tag = answer && reply == Reply::other ? answer->entity_tag : std::string();
  return false;
}

/// Sends a graph without the lock, and finds out what the store makes of it.
/// @param reads_back  a store that gives no entity tag is read
Mirror::Impl::Sent Mirror::Impl::put_or_remove(const std::string& name, const Wanted& wanted, const Believed& believed, bool reads_back) const {
  const auto read = [&](unsigned& requests) -> std::optional<std::pair<GraphStore::Answer, Echo>> {
    ++requests;
    Result<GraphStore::Answer> answer = store_->get(name, {});
    if (!answer || (!answer->ok() && !is_missing(answer))) return std::nullopt;
    Result<Echo> echo = answer->ok() ? echo_of(answer->body, answer->media_type, store_->url_of(name)) : Result<Echo>(Echo());
    if (!echo) return std::nullopt;
    return std::pair(*std::move(answer), *std::move(echo));
  };
  Sent sent{wanted.is_delete ? store_->remove(name) : store_->put(name, wanted.content.turtle, believed.entity_tag)};
  if (wanted.is_delete) return sent;
  sent.was_lost = wanted.there && wanted.there->empty();
  sent.was_overwritten = wanted.there && !wanted.there->empty();
  if (sent.answer && sent.answer->status == 412 && !believed.entity_tag.empty()) {
    const auto now = read(sent.more_requests);
    if (now && now->second.fingerprint == wanted.content.digest) {  // by an older state, or the response to an earlier PUT was lost
      sent.answer = now->first;
      sent.was_overwritten = false;
      sent.was_there = true;
      return sent;
    }
    // A store may have other entity tags for its media types, of which a PUT accepts one.
    const bool is_as_believed = now && now->first.ok() && (now->second.fingerprint == believed.stored || now->second.fingerprint == believed.echo);
    if (!is_as_believed) {
      sent.was_lost = now && is_missing(now->first);
      sent.was_overwritten = !sent.was_lost;
    }
    ++sent.more_requests;
    sent.answer = store_->put(name, wanted.content.turtle, {});
  }
  const bool is_known = sent.answer && sent.answer->ok() && !sent.answer->entity_tag.empty() && !sent.was_overwritten;
  if (!sent.answer || !sent.answer->ok() || !reads_back || is_known) return sent;
  const auto back = read(sent.more_requests);
  if (!back || !back->first.ok()) return sent;
  const Echo& echo = back->second;
  if (echo.fingerprint != wanted.content.digest) {
    // The store's own form of the graph: it had that before, or it differs in the values of literals only.
    sent.was_there = wanted.there && echo.fingerprint == *wanted.there;
    const auto has_outline_of = [&](const std::string& turtle) {
      rdf::ReadOptions options;
      options.max_triples = options.max_bytes = std::numeric_limits<std::size_t>::max();
      const Result<rdf::Graph> given = rdf::read(turtle, rdf::Syntax::n_triples, options);
      if (!echo.graph || !given || echo.graph->size() != given->size()) return false;
      const Result<std::string> one = outline_of(*echo.graph), other = outline_of(*given);
      return one && other && *one == *other;
    };
    if (!sent.was_there && !has_outline_of(wanted.content.turtle))
      return sent;  // another client was faster; the next reading of the robot finds that
    if (sent.was_there) sent.was_overwritten = false;
    sent.echo = echo.fingerprint;
  }
  if (sent.answer->entity_tag.empty()) sent.answer->entity_tag = back->first.entity_tag;
  return sent;
}

void Mirror::Impl::send(Lock& lock, const std::string& name, Graph& graph) {
  Wanted wanted = *std::move(graph.wanted);
  graph.wanted.reset();
  set_waiting_bytes(wanted, false);
  const auto is_stored = [&] { return !wanted.value().empty() && graph.stored == wanted.value(); };
  const bool looks = std::exchange(wanted.must_look, false) && is_stored();
  if (looks) {
    wanted.must_look = true;
    if (is_confirmed(lock, name, graph, wanted)) return;
    wanted.must_look = false;
  }
  if (!wanted.has_content && !load(lock, name, wanted)) return;
  if (is_stored()) {
    ++counts_.unchanged;
    return;
  }
  graph.is_deleted_now = wanted.is_delete;
  const Believed believed{std::exchange(graph.entity_tag, {}), std::exchange(graph.stored, {}), std::exchange(graph.echo, {})};
  const std::string robot = graph.robot;
  const OnDisk on_disk = graph.on_disk;
  const bool reads_back = wanted.is_read && !cannot_be_read_;
  graph.robot_tag.clear();
  graph.is_changed = false;
  lock.unlock();
  Result<void> written;
  if (state_ && on_disk != OnDisk::unknown) {
    const std::lock_guard state_lock(state_mutex_);
    StoredGraph unknown;
    unknown.graph = name, unknown.robot = robot;
    written = state_->write_unknown(unknown, on_disk == OnDisk::known);
  }
  const Sent sent = put_or_remove(name, wanted, believed, reads_back);
  lock.lock();
  reserve_turns(sent.more_requests + (looks ? 1 : 0));
  if (state_) {
    graph.on_disk = OnDisk::unknown;
    take_state_error(lock, written);
  }
  if (sent.answer && sent.answer->ok() && (sent.was_lost || sent.was_overwritten)) {
    ++(sent.was_lost ? counts_.lost : counts_.overwritten);
    lock.unlock();
    if (sent.was_lost) event(Kind::graph_lost, name, "the store had lost it");
    else event(Kind::graph_overwritten, name, "another client changed the graph in the store; the robot's version was restored");
    lock.lock();
  }
  take_answer(lock, name, graph, std::move(wanted), sent);
}

void Mirror::Impl::take_answer(Lock& lock, const std::string& name, Graph& graph, Wanted wanted, const Sent& sent) {
  if (stopped_) return;
  const Result<GraphStore::Answer>& answer = sent.answer;
  const bool is_gone = wanted.is_delete && is_missing(answer);
  if (answer && (answer->ok() || is_gone)) {
    graph.stored = wanted.value();
    graph.late_since = graph.wanted && !graph.wanted->must_look ? std::optional(graph.wanted->since) : std::nullopt;  // a newer one may have come
    graph.refused.clear();
    graph.failures = 0;
    graph.entity_tag = wanted.is_delete ? std::string() : answer->entity_tag;
    graph.echo = sent.echo;
    graph.robot_tag = wanted.robot_tag;
    if (wanted.is_read) graph.is_watchable = wanted.is_watchable;
    graph.is_changed = true;
    if (sent.was_there) ++counts_.unchanged;
    else if (!wanted.is_delete) ++counts_.sent, counts_.sent_bytes += wanted.content.turtle.size();
    else if (!is_gone) ++counts_.deleted;
    take_store_success(lock);
    lock.unlock();
    if (!is_gone && !sent.was_there) event(wanted.is_delete ? Kind::graph_deleted : Kind::graph_sent, name);
    lock.lock();
    return;
  }
  const int status = answer ? answer->status : 0;
  const std::string reason = answer ? answer->reason : answer.error().message;
  const bool is_refused_user = status == 401 || status == 403 || (!answer && answer.error().code == Errc::refused);
  const bool has_no_protocol = counts_.sent + counts_.deleted == 0 && (status == 404 || status == 405 || status == 501);
  if (is_refused_user) return end({Errc::refused, "the store refuses the user: " + reason});
  if (has_no_protocol) return end({Errc::failed, "the store has no Graph Store Protocol there: " + reason});
  // The next reading of the robot offers it again.
  const bool is_of_graph = ++graph.failures >= max_failures_of_graph && status == internal_error;
  if (is_temporary(answer) && !is_of_graph) {
    if (!graph.wanted) {  // else a newer one waits
      set_waiting_bytes(wanted, true);
      graph.wanted = std::move(wanted);
    }
    store_code_ = status == 0 ? answer.error().code : Errc::failed;
    store_was_away_ = store_was_away_ || has_been_away(answer);
    return take_store_failure(lock, reason, answer ? answer->retry_after : std::nullopt);
  }
  ++counts_.refused;
  graph.failures = 0;
  if (!wanted.is_delete && !is_of_graph) graph.refused = wanted.value();
  lock.unlock();
  event(Kind::graph_refused, name, reason);
  lock.lock();
}

/// The store has responded. If it was away before, it may have lost or restored anything meanwhile: all robots are read, and all graphs compared.
void Mirror::Impl::take_store_success(Lock& lock) {
  const bool was_lost = std::exchange(store_failures_, 0) > 0;
  failing_since_.reset();
  if (!was_lost) return;
  const bool was_away = std::exchange(store_was_away_, false);
  if (!only_once_) {
    for (auto& [url, robot] : robots_) {
      if (!was_away && !robot.must_look_at_mark) continue;
      robot.due = std::chrono::steady_clock::now();
      robot.must_be_read_again = robot.is_being_read;
    }
    due_.notify_all();
  }
  lock.unlock();
  event(Kind::store_returned, options_.store.endpoint);
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
    if (!graph.is_changed || graph.is_sent_now || (graph.wanted && !graph.wanted->must_look) || graph.stored.empty()) continue;
    graph.is_changed = false;
    graph.on_disk = OnDisk::known;
    known.push_back({name, graph.robot, graph.stored, graph.entity_tag, graph.echo, graph.robot_tag, graph.is_watchable});
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
      const bool are_read = robots_being_read_ == 0 && std::all_of(robots_.begin(), robots_.end(), [](const auto& r) { return is_done(r.second); });
      if (are_read && to_send_.empty() && to_look_.empty() && being_sent_ == 0) return counts_now();
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
