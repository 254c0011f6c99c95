// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/bridge/core.hpp"

#include <algorithm>
#include <exception>
#include <set>

#include <lrt/rdf/vocab.hpp>

#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {

namespace {

constexpr std::string_view ros2_ns = "https://w3id.org/lrt/ros2#";

/// How long nothing happens in a graph that has settled, besides GraphOptions::settle.
constexpr std::chrono::milliseconds quiet_time{100};
/// A graph in which nobody is found is empty after this time.
constexpr std::chrono::milliseconds empty_after{1500};
/// Of events of nodes that wait for the bridge's thread, and what each needs besides its content.
constexpr std::size_t max_event_bytes = 16 * 1024 * 1024, job_bytes = 256;
/// Between two times that all nodes are asked again, because events were lost.
constexpr std::chrono::seconds read_again_interval{5};

/// About the memory of a parameter.
std::size_t size_of(const Parameter& p) noexcept {
  std::size_t bytes = sizeof p + p.name.size();
  if (p.value.text()) bytes += p.value.text()->size();
  if (p.value.sequence())
    for (const rdf::Value& member : *p.value.sequence()) bytes += sizeof member + (member.text() ? member.text()->size() : 0);
  return bytes;
}

bool is_below(std::string_view path, std::string_view root) noexcept {
  return path.size() > root.size() && path.substr(0, root.size()) == root && path[root.size()] == '/';
}

}  // namespace

void Shared::put(UniqueFunction<void()> job) {
  {
    const std::lock_guard lock(mutex);
    if (stops) return;
    jobs.push_back(std::move(job));
  }
  arrived.notify_one();
}

void Shared::put_event(std::size_t bytes, UniqueFunction<void()> job) {
  {
    const std::lock_guard lock(mutex);
    if (stops) return;
    if (event_bytes + bytes + job_bytes > max_event_bytes) {
      has_lost_events = true;
    } else {
      event_bytes += bytes + job_bytes;
      jobs.push_back(std::move(job));
    }
  }
  arrived.notify_one();
}

Result<rdf::Value> MessageReader::read(const std::string& payload) const {
  if (payload.size() > max_bytes_)
    return unexpected(Errc::limit_exceeded,
                      "the sample has " + std::to_string(payload.size()) + " bytes; the limit max_value_bytes is " + std::to_string(max_bytes_));
  Result<rdf::Value> value = type_.decode(payload);
  if (!value) {
    shared_->malformed.fetch_add(1, std::memory_order_relaxed);
    return value;
  }
  shared_->decoded.fetch_add(1, std::memory_order_relaxed);
  if (!unwraps_) return value;
  const rdf::Value::Sequence* members = value->sequence();
  if (!members || members->size() != 1) return unexpected(Errc::expected_value, "expected one member");
  return rdf::Value(members->front());
}

std::string listed_nodes(const std::vector<std::string>& nodes) {
  std::string text;
  for (std::size_t i = 0; i < nodes.size() && i < 3; ++i) text += (i == 0 ? "" : i + 1 == nodes.size() ? " and " : ", ") + nodes[i];
  if (nodes.size() > 3) text += " and " + std::to_string(nodes.size() - 3) + " others";
  return text.empty() ? "a node without a name" : text;
}

std::string namespace_of(std::string_view name) {
  const std::size_t end = name.rfind('/');
  return end == 0 || end == std::string_view::npos ? "/" : std::string(name.substr(0, end));
}

void describe(Thing& thing, const Listed& what, const Texts& titles, const Texts& descriptions, std::string_view class_name) {
  const std::string name_term = std::string(ros2_ns) + "name", type_term = std::string(ros2_ns) + "type";
  say(thing, titles, descriptions);
  thing.type(Iri(std::string(ros2_ns) + std::string(class_name)));
  thing.add(Iri(name_term), Object(what.name));
  if (!what.type.empty()) thing.add(Iri(type_term), Object(what.type));
}

Core::Core(Server& server, Options options, std::shared_ptr<Port> port, Definitions& definitions)
    : server_(server),
      options_(std::move(options)),
      shared_(std::make_shared<Shared>(std::move(port))),
      definitions_(definitions),
      types_(options_.mapping.rules(), options_.limits.max_types, options_.limits.max_type_members),
      definitions_version_(definitions.version()) {
  shared_->max_kept_bytes = options_.limits.max_kept_bytes;
}

Core::~Core() { stop(); }

Result<void> Core::start() {
  if (!options_.robot_description.empty()) update_robot(*this, "/", options_.robot_description);
  port().on_change([shared = shared_] {
    {
      const std::lock_guard lock(shared->mutex);
      shared->changed = true;
    }
    shared->arrived.notify_one();
  });
  Result<Thread> started = start_thread("lrt-ros2", options_.graph.thread, [this] { run(); });
  if (!started) return Unexpected{std::move(started).error()};
  thread_ = *std::move(started);
  return {};
}

void Core::stop() {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->stops = true;
  }
  shared_->arrived.notify_all();
  thread_.join();
  port().on_change({});
  parameter_events_.reset();
  std::vector<std::string> paths;
  for (const auto& [key, part] : parts_)
    if (part->is_served) paths.push_back(part->path);
  std::sort(paths.begin(), paths.end());  // what is above goes first, with what is below
  for (const std::string& path : paths) (void)server_.remove(path);
  parts_.clear();
  requests_.clear();
  const std::lock_guard lock(shared_->mutex);
  shared_->jobs.clear();
}

void Core::log(LogLevel level, std::string_view text) const noexcept {
  if (!options_.log) return;
  try {
    options_.log(level, text);
  } catch (...) {}  // as lrt's other callbacks of this kind
}

void Core::run() {
  while (true) {
    std::vector<UniqueFunction<void()>> jobs;
    {
      std::unique_lock lock(shared_->mutex);
      const auto has_work = [this] { return shared_->stops || shared_->changed || !shared_->jobs.empty(); };
      if (!changed_) {
        if (next_ == Clock::time_point::max()) shared_->arrived.wait(lock, has_work);
        else shared_->arrived.wait_until(lock, next_, has_work);
      }
      if (shared_->stops) return;
      jobs = std::exchange(shared_->jobs, {});
      shared_->event_bytes = 0;
      if (std::exchange(shared_->has_lost_events, false)) reads_again_ = changed_ = true;
      const std::lock_guard list(list_mutex_);
      is_busy_ = true;
      if (std::exchange(shared_->changed, false)) {
        changed_ = true;
        last_change_ = Clock::now();
      }
    }
    try {
      for (auto& job : jobs) job();
      if (changed_ || Clock::now() >= next_) reconcile();
    } catch (const std::exception& e) {
      log(LogLevel::error, std::string("the ROS 2 bridge: ") + e.what());
      next_ = Clock::now() + std::chrono::seconds(1);
    }
    {
      const std::lock_guard list(list_mutex_);
      is_busy_ = changed_;
    }
    list_changed_.notify_all();
  }
}

bool Core::is_below_namespaces(std::string_view name) const {
  if (options_.namespaces.empty()) return true;
  return std::any_of(options_.namespaces.begin(), options_.namespaces.end(), [name](std::string_view ns) {
    while (!ns.empty() && ns.back() == '/') ns.remove_suffix(1);
    return is_below(name, ns);
  });
}

bool Core::is_allowed(const std::vector<std::string>& patterns, std::string_view name) const {
  return std::any_of(patterns.begin(), patterns.end(), [name](const std::string& p) { return fits(p, name); });
}

void Core::reconcile() {
  changed_ = false;
  next_ = Clock::time_point::max();
  const std::shared_ptr<const GraphSnapshot> now = port().snapshot();
  // The names that have parts, and those that are there now. What is beyond the limit is counted only.
  std::set<std::string> topics, services, actions, nodes;
  for (const auto& [key, part] : parts_) {
    if (key.compare(0, 6, "topic ") == 0) topics.insert(part->listed.name);
    else if (key.compare(0, 8, "service ") == 0) services.insert(part->listed.name);
    else if (key.compare(0, 7, "action ") == 0) actions.insert(part->listed.name);
    else if (key.compare(0, 5, "node ") == 0) nodes.insert(part->listed.name);
  }
  std::size_t parts = parts_.size();
  left_out_names_ = 0;
  const auto add = [&](std::set<std::string>& to, const std::string& name) {
    if (!is_below_namespaces(name) || to.count(name) != 0) return;
    if (parts >= options_.limits.max_things) {
      ++left_out_names_;
      return;
    }
    ++parts;
    to.insert(name);
  };
  for (const Topic& t : now->topics) add(topics, t.name);
  for (const ServiceInfo& s : now->services) add(services, s.name);
  for (const ActionInfo& a : now->actions) add(actions, a.name);
  for (const NodeInfo& n : now->nodes) add(nodes, n.name);
  if (reads_again_) {
    const Clock::time_point time = Clock::now();
    if (time >= may_read_again_) {
      reads_again_ = false;
      may_read_again_ = time + read_again_interval;
      for (const auto& [key, part] : parts_)
        if (key.compare(0, 5, "node ") == 0) read_again(*part);
    } else {
      wake_at(may_read_again_);
    }
  }
  for (const std::string& name : topics) update_topic(*this, name, now->topic(name));
  for (const std::string& name : services) update_service(*this, name, now->service(name));
  for (const std::string& name : actions) update_action(*this, name, now->action(name));
  for (const std::string& name : nodes) update_node(*this, name, now->node(name));
  if (!nodes.empty() && !parameter_events_) {
    Result<Handle> events =
        port().parameter_events([shared = shared_, this](std::string_view node, std::vector<Parameter> changed, std::vector<std::string> deleted) {
          std::size_t bytes = 0;
          for (const Parameter& p : changed) bytes += size_of(p);
          for (const std::string& name : deleted) bytes += sizeof(std::string) + name.size();
          shared->put_event(bytes, [this, node = std::string(node), changed = std::move(changed), deleted = std::move(deleted)]() mutable {
            change_parameters(*this, node, std::move(changed), deleted);
          });
        });
    if (events) parameter_events_ = *std::move(events);
  }
  if (definitions_.version() != std::exchange(definitions_version_, definitions_.version())) changed_ = true;
  publish_list();
}

void Core::publish_list() {
  std::vector<Listed> all;
  Counters counted;
  bool is_waiting = changed_;
  for (const auto& [key, part] : parts_) {
    is_waiting = is_waiting || part->is_waiting();
    if (!part->is_listed) continue;
    all.push_back(part->listed);
    all.insert(all.end(), part->more.begin(), part->more.end());
    if (part->is_served) {
      counted.things += part->things;
      counted.properties += part->properties;
      counted.actions += part->actions;
      if (!part->is_available) ++counted.unavailable;
    } else {
      ++counted.left_out;
    }
  }
  for (const auto& [key, request] : requests_) is_waiting = is_waiting || request.is_open;
  counted.left_out += left_out_names_;
  std::stable_sort(all.begin(), all.end(), [](const Listed& a, const Listed& b) { return a.name < b.name; });
  {
    const std::lock_guard lock(list_mutex_);
    list_ = std::move(all);
    counted_ = counted;
    is_waiting_ = is_waiting;
  }
  list_changed_.notify_all();
}

std::vector<Listed> Core::list() const {
  const std::lock_guard lock(list_mutex_);
  return list_;
}

bool Core::wait_until_settled(std::chrono::milliseconds limit) const {
  const Clock::time_point end = Clock::now() + limit;
  const auto quiet = options_.graph.settle + quiet_time;
  while (true) {
    bool is_behind = false;  // the bridge's thread has not looked yet
    {
      const std::lock_guard lock(shared_->mutex);
      is_behind = shared_->changed || !shared_->jobs.empty();
    }
    std::unique_lock lock(list_mutex_);
    const Clock::time_point now = Clock::now();
    const Clock::time_point settled = std::max(last_change_ + quiet, list_.empty() ? started_ + empty_after : started_ + quiet);
    if (!is_behind && !is_busy_ && !is_waiting_ && now >= settled) return true;
    if (now >= end) return false;
    list_changed_.wait_until(lock, std::min(end, std::max(settled, now + std::chrono::milliseconds(5))));
  }
}

Counters Core::counters() const {
  Counters counters;
  {
    const std::lock_guard lock(list_mutex_);
    counters = counted_;
  }
  counters.graph = port().counters();
  counters.decoded = shared_->decoded.load(std::memory_order_relaxed);
  counters.malformed = shared_->malformed.load(std::memory_order_relaxed);
  counters.commands = shared_->commands.load(std::memory_order_relaxed);
  return counters;
}

// --- Things

std::string Core::path_of(std::string_view name) const {
  while (!name.empty() && name.front() == '/') name.remove_prefix(1);
  std::string path = options_.path;
  while (!path.empty() && path.back() == '/') path.pop_back();
  if (!path.empty() && path.front() == '/') path.erase(0, 1);
  if (!path.empty() && !name.empty()) path += '/';
  return path + std::string(name);
}

Result<void> Core::add(Part& part, const std::string& path) {
  std::vector<Thing> things = part.make(*this, path);
  if (things.empty()) return unexpected(Errc::failed, part.listed.reason.empty() ? "it has no Thing" : part.listed.reason);
  const std::size_t count = things.size();
  if (things_ + count > options_.limits.max_things)
    return unexpected(Errc::limit_exceeded, "there are more than " + std::to_string(options_.limits.max_things) + " Things (max_things)");
  Result<void> added = server_.add(std::move(things));
  if (!added) return added;
  part.path = path;
  part.is_served = true;
  part.things = count;
  things_ += count;
  part.was_served(*this);
  return added;
}

bool Core::serve(Part& part) {
  if (part.is_served) return true;
  Result<void> added = add(part, part.path.empty() ? part.wanted_path : part.path);
  if (!added && added.error().code == Errc::invalid_option && has_executor_ && added.error().message.find("executor") != std::string::npos) {
    has_executor_ = false;
    added = add(part, part.path.empty() ? part.wanted_path : part.path);
  }
  // The path may be one of the host's, or of lrt's.
  if (!added && (added.error().code == Errc::duplicate_path || added.error().code == Errc::expected_iri))
    added = add(part, part.wanted_path + part.suffix);
  if (!added) {
    part.listed.path.clear();
    part.listed.as.clear();
    if (part.listed.reason != added.error().message) {
      part.listed.reason = added.error().message;
      log(LogLevel::warning, part.listed.name + " is not published: " + part.listed.reason);
    }
    return false;
  }
  return true;
}

void Core::remove(Part& part) {
  if (!part.is_served) return;
  (void)server_.remove(part.path);
  for (const auto& [key, other] : parts_) {
    if (!other->is_served || (other.get() != &part && !is_below(other->path, part.path))) continue;
    other->is_served = false;
    things_ -= other->things;
    other->things = 0;
  }
}

void Core::renew(Part& part) {
  std::vector<Part*> below;
  for (const auto& [key, other] : parts_)
    if (other.get() != &part && other->is_served && is_below(other->path, part.path)) below.push_back(other.get());
  remove(part);
  serve(part);
  for (Part* other : below) serve(*other);
}

// --- definitions

std::string Core::request(std::string_view type, std::string_view hash, bool& is_waiting) {
  const std::string key = std::string(type) + ' ' + std::string(hash);
  const Clock::time_point now = Clock::now();
  if (requests_.size() >= options_.definition_limits.max_definitions && requests_.count(key) == 0) {
    // What is still wanted has been asked for again by then.
    for (auto it = requests_.begin(); it != requests_.end();) {
      if (!it->second.is_open && now > it->second.next + it->second.pause) it = requests_.erase(it);
      else ++it;
    }
    if (requests_.size() >= options_.definition_limits.max_definitions) {
      wake_at(now + std::chrono::seconds(60));
      return "more definitions than max_definitions are requested";
    }
  }
  Request& request = requests_[key];
  if (!request.is_open && now >= request.next) {
    request.is_open = true;
    request.reason.clear();
    Result<Handle> call = port().request_definition(type, hash, definitions_, [this, shared = shared_, key](Result<void> result) {
      shared->put([this, key, result = std::move(result)] {
        const auto ended = requests_.find(key);
        if (ended == requests_.end()) return;
        ended->second.is_open = false;
        if (!result) ended->second.reason = result.error().message;
        changed_ = true;
      });
    });
    if (call) request.call = *std::move(call);
    else request.is_open = false, request.reason = call.error().message;
    request.next = now + request.pause;
    request.pause = std::min(request.pause * 2, std::chrono::seconds(60));
  }
  if (request.is_open) {
    is_waiting = true;
    return "its definition is requested";
  }
  wake_at(request.next);
  return request.reason;
}

namespace {
constexpr const char* humble_hint =
    "; its nodes do not say what it is (ROS 2 Humble does not): name the folder of its definitions with --definitions";
}  // namespace

template <class F>
auto Core::find_definition(std::string_view type, std::string_view hash, bool& is_waiting, F find) -> decltype(find()) {
  auto found = find();
  if (found || found.error().code != Errc::unknown_path) return found;
  if (hash.empty()) return unexpected(Errc::unknown_path, found.error().message + humble_hint);
  std::string reason = request(type, hash, is_waiting);
  return unexpected(Errc::unknown_path, reason.empty() ? found.error().message : std::move(reason));
}

Result<MessagePtr> Core::message(std::string_view type, std::string_view hash, bool& is_waiting) {
  return find_definition(type, hash, is_waiting, [&] { return definitions_.message(type, hash); });
}
Result<std::shared_ptr<const Service>> Core::service(std::string_view type, std::string_view hash, bool& is_waiting) {
  return find_definition(type, hash, is_waiting, [&] { return definitions_.service(type, hash); });
}
Result<std::shared_ptr<const ActionDefinition>> Core::action(std::string_view type, bool& is_waiting) {
  Result<std::shared_ptr<const ActionDefinition>> found = definitions_.action(type);
  if (found || found.error().code != Errc::unknown_path) return found;
  std::string reason;
  for (const char* part : {"_SendGoal", "_GetResult", "_FeedbackMessage"}) {
    std::string why = request(std::string(type) + part, {}, is_waiting);
    if (reason.empty()) reason = std::move(why);
  }
  if (is_waiting) return unexpected(Errc::unknown_path, "its definition is requested");
  return unexpected(Errc::unknown_path, (reason.empty() ? found.error().message : reason) + humble_hint);
}

}  // namespace lrt::ros2
