// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/ros2.hpp>
#include <lrt/ros2/definitions.hpp>
#include <lrt/ros2/graph.hpp>
#include <lrt/ros2/message_type.hpp>
#include <lrt/server.hpp>
#include <lrt/thing.hpp>

#include "src/base/thread.hpp"
#include "src/ros2/bridge/mapping.hpp"
#include "src/ros2/bridge/port.hpp"
#include "src/ros2/bridge/ros_value.hpp"
#include "src/ros2/bridge/types.hpp"

namespace lrt::ros2 {

/// What lambdas of the server, sinks and callbacks of the graph share with the bridge. It may outlive the bridge; then what they do has no
/// effect.
struct Shared {
  explicit Shared(std::shared_ptr<Port> p) : port(std::move(p)) {}

  const std::shared_ptr<Port> port;
  std::atomic<std::uint64_t> decoded{0}, malformed{0}, commands{0};
  /// Bytes of the newest samples of all topics. What would be beyond the limit is dropped.
  std::atomic<std::size_t> kept_bytes{0};
  std::size_t max_kept_bytes = 0;
  std::atomic<std::size_t> frames{0};  ///< of all namespaces

  /// Leaves a job for the bridge's thread.
  /// @par Threads  Any. Locks for a moment and allocates.
  void put(UniqueFunction<void()> job);
  /// The same for what a stranger may send without end. What is beyond a limit is dropped, and the nodes are asked again later.
  /// @param bytes  of memory that it needs, about
  void put_event(std::size_t bytes, UniqueFunction<void()> job);

  std::mutex mutex;
  std::condition_variable arrived;
  std::vector<UniqueFunction<void()>> jobs;  ///< guarded by `mutex`
  std::size_t event_bytes = 0;               ///< of the jobs of put_event() among them; guarded by `mutex`
  bool has_lost_events = false;              ///< guarded by `mutex`
  bool changed = true;                       ///< the graph; guarded by `mutex`
  bool stops = false;                        ///< guarded by `mutex`
};

class Core;

/// What the bridge makes of one thing in the graph: a topic, a service, an action, a node, a robot, a frame. Owned and used by the bridge's
/// thread.
class Part {
 public:
  explicit Part(Listed what) : listed(std::move(what)) {}
  virtual ~Part() = default;
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  /// Describes its Things, the first of which has the path.
  virtual std::vector<Thing> make(Core& core, const std::string& path) = 0;
  /// The Things of make() are served, or are not any more.
  virtual void was_served(Core&) {}
  /// It still waits for something that usually comes soon.
  virtual bool is_waiting() const { return false; }

  Listed listed;
  std::vector<Listed> more;         ///< what it has besides: parameters
  bool is_listed = true;            ///< false: it only keeps other parts
  std::string wanted_path, suffix;  ///< of its Thing; `suffix` makes another one if that is taken
  std::string path;                 ///< that it has; empty: it has never been served
  bool is_served = false;
  bool is_available = false;
  std::size_t things = 0, properties = 0, actions = 0;  ///< while it is served
};

/// The bridge without its public face: keeps Things on a server in step with a graph.
/// @par Threads  run() on the bridge's thread, which calls the parts; the others any.
class Core {
 public:
  using Clock = std::chrono::steady_clock;

  /// @pre `definitions` and `server` live longer
  Core(Server& server, Options options, std::shared_ptr<Port> port, Definitions& definitions);
  ~Core();
  Core(const Core&) = delete;
  Core& operator=(const Core&) = delete;

  /// Starts the thread.
  Result<void> start();
  /// Ends the thread and removes the Things. Not from the thread itself.
  void stop();

  std::vector<Listed> list() const;
  bool wait_until_settled(std::chrono::milliseconds limit) const;
  Counters counters() const;

  // --- for parts

  const Options& options() const noexcept { return options_; }
  const Mapping::Rules& rules() const noexcept { return options_.mapping.rules(); }
  const std::shared_ptr<Shared>& shared() const noexcept { return shared_; }
  Port& port() const noexcept { return *shared_->port; }
  TypeMaker& types() noexcept { return types_; }
  Definitions& definitions() noexcept { return definitions_; }
  void log(LogLevel level, std::string_view text) const noexcept;

  /// "robots/r7/arm/scan" of "/arm/scan".
  std::string path_of(std::string_view name) const;
  /// Adds the Things of a part to the server, at its path. On failure the part says why.
  bool serve(Part& part);
  /// Makes them again, with all that is below them.
  void renew(Part& part);
  /// A part that is not of the snapshot: a robot, a frame. Makes it if there is none.
  template <class T, class... Args>
  T& part_of(const std::string& key, Args&&... args) {
    std::unique_ptr<Part>& part = parts_[key];
    if (!part) part = std::make_unique<T>(std::forward<Args>(args)...);
    return static_cast<T&>(*part);
  }
  Part* find(const std::string& key) {
    const auto found = parts_.find(key);
    return found == parts_.end() ? nullptr : found->second.get();
  }

  /// Finds a definition, or requests it from the nodes that use it.
  /// @return  an Error: it is not known (yet); `is_waiting`: it may be soon
  Result<MessagePtr> message(std::string_view type, std::string_view hash, bool& is_waiting);
  Result<std::shared_ptr<const Service>> service(std::string_view type, std::string_view hash, bool& is_waiting);
  Result<std::shared_ptr<const ActionDefinition>> action(std::string_view type, bool& is_waiting);

  /// Wakes the thread at this time.
  void wake_at(Clock::time_point at) { next_ = std::min(next_, at); }
  /// Everything is looked at again soon.
  void mark_changed() { changed_ = true; }
  bool is_allowed(const std::vector<std::string>& patterns, std::string_view name) const;
  /// Whether the server runs lambdas with Dispatch::executor.
  bool has_executor() const noexcept { return has_executor_; }

 private:
  struct Request {
    Handle call;
    bool is_open = false;
    std::string reason;
    Clock::time_point next{};
    std::chrono::seconds pause{5};
  };
  /// Requests a definition from its nodes, now or later.
  /// @return  why there is none, a sentence
  std::string request(std::string_view type, std::string_view hash, bool& is_waiting);
  template <class F>
  auto find_definition(std::string_view type, std::string_view hash, bool& is_waiting, F find) -> decltype(find());

  void run();
  void reconcile();
  bool is_below_namespaces(std::string_view name) const;
  Result<void> add(Part& part, const std::string& path);
  void remove(Part& part);
  void publish_list();

  Server& server_;
  const Options options_;
  const std::shared_ptr<Shared> shared_;
  Definitions& definitions_;
  TypeMaker types_;
  std::map<std::string, std::unique_ptr<Part>> parts_;  ///< by kind and name: "topic /scan"
  std::map<std::string, Request> requests_;             ///< of definitions, by type and hash
  std::uint64_t definitions_version_ = 0;
  Clock::time_point next_ = Clock::time_point::max();
  bool reads_again_ = false;  ///< events of nodes were lost: they are asked again
  Clock::time_point may_read_again_{};
  bool changed_ = false;
  bool has_executor_ = true;
  std::size_t things_ = 0;
  std::size_t left_out_names_ = 0;
  Handle parameter_events_;
  Thread thread_;

  mutable std::mutex list_mutex_;
  mutable std::condition_variable list_changed_;
  std::vector<Listed> list_;                                               ///< guarded by list_mutex_
  Counters counted_;                                                       ///< guarded by list_mutex_
  Clock::time_point last_change_ = Clock::now(), started_ = Clock::now();  ///< guarded by list_mutex_
  bool is_busy_ = false;                                                   ///< the thread is at work; guarded by list_mutex_
  bool is_waiting_ = true;                                                 ///< guarded by list_mutex_
};

// --- the kinds of parts: each updates its parts from a snapshot

/// @param topic  nullptr: it is not in the graph now
void update_topic(Core& core, const std::string& name, const Topic* topic);
void update_service(Core& core, const std::string& name, const ServiceInfo* service);
void update_action(Core& core, const std::string& name, const ActionInfo* action);
void update_node(Core& core, const std::string& name, const NodeInfo* node);
/// What is known of a node is asked again.
void read_again(Part& node);
/// Parameters of a node have changed.
void change_parameters(Core& core, const std::string& node, std::vector<Parameter> changed, const std::vector<std::string>& deleted);
/// A robot description has come for a namespace: "/", "/arm".
void update_robot(Core& core, const std::string& ns, std::string text);

/// Statements and words that Things of all kinds have.
void describe(Thing& thing, const Listed& what, const Texts& titles, const Texts& descriptions, std::string_view class_name);
/// Sets titles and descriptions of a resource, in all languages.
template <class Resource>
void say(Resource& resource, const Texts& titles, const Texts& descriptions, std::string_view otherwise = {}) {
  for (const rdf::Text& t : titles) resource.title(t.text, t.language);
  if (titles.empty() && !otherwise.empty()) resource.title(std::string(otherwise), "en");
  for (const rdf::Text& t : descriptions) resource.description(t.text, t.language);
}
/// Names of nodes in a sentence: "/a, /b and 3 others".
std::string listed_nodes(const std::vector<std::string>& nodes);
/// "/arm" of "/arm/joint_states", "/" of "/scan".
std::string namespace_of(std::string_view name);

/// Decodes payloads of a MessageType, and counts.
class MessageReader final : public PayloadReader {
 public:
  MessageReader(MessageType type, std::shared_ptr<Shared> shared, std::size_t max_bytes, bool unwraps = false)
      : type_(std::move(type)), shared_(std::move(shared)), max_bytes_(max_bytes), unwraps_(unwraps) {}
  Result<rdf::Value> read(const std::string& payload) const override;

 private:
  MessageType type_;
  std::shared_ptr<Shared> shared_;
  std::size_t max_bytes_;
  bool unwraps_;  ///< the value is the only member of the record
};

}  // namespace lrt::ros2
