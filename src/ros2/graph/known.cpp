// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/graph/known.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <unordered_set>

#include "src/ros2/graph/cdr.hpp"
#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {

namespace {

constexpr std::array<std::uint8_t, 2> eprosima{1, 0x0f}, cyclone{1, 0x10};

bool ends_with(std::string_view text, std::string_view end) noexcept {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}
bool cut_end(std::string& text, std::string_view end) {
  if (!ends_with(text, end)) return false;
  text.resize(text.size() - end.size());
  return true;
}

/// The value of a key in "key=value;key=value;"; empty: it has none.
std::string_view value_of(std::string_view user_data, std::string_view key) noexcept {
  while (!user_data.empty()) {
    const auto end = std::min(user_data.find(';'), user_data.size());
    const std::string_view pair = user_data.substr(0, end);
    if (pair.size() > key.size() && pair.substr(0, key.size()) == key && pair[key.size()] == '=') return pair.substr(key.size() + 1);
    user_data.remove_prefix(std::min(end + 1, user_data.size()));
  }
  return {};
}
bool has_key(std::string_view user_data, std::string_view key) noexcept {
  for (auto at = user_data.find(key); at != std::string_view::npos; at = user_data.find(key, at + 1))
    if ((at == 0 || user_data[at - 1] == ';') && user_data.size() > at + key.size() && user_data[at + key.size()] == '=') return true;
  return false;
}
bool is_hash(std::string_view hash) noexcept {
  return hash.size() == 71 && hash.substr(0, 7) == "RIHS01_" &&
         std::all_of(hash.begin() + 7, hash.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

std::optional<ParticipantEntities> read_entities_of(std::string_view payload, std::size_t gid_bytes, const GraphLimits& limits) {
  CdrReader reader(payload);
  reader.bytes(gid_bytes);
  ParticipantEntities entities;
  entities.gid_bytes = gid_bytes;
  std::size_t gids = 0;
  const auto read_gids = [&](std::vector<Gid>& list) {
    const std::size_t count = reader.count(gid_bytes);
    gids += count;
    if (gids > 2 * limits.max_endpoints_of_participant) return false;
    list.reserve(count);
    for (std::size_t i = 0; i < count && reader.ok(); ++i) {
      const std::string_view bytes = reader.bytes(gid_bytes);
      Gid gid{};
      std::copy_n(bytes.begin(), std::min<std::size_t>(bytes.size(), 16), gid.bytes.begin());
      list.push_back(gid);
    }
    return reader.ok();
  };
  const std::size_t nodes = reader.count(18);  // two empty texts, two empty lists
  if (nodes > limits.max_endpoints_of_participant) return std::nullopt;
  for (std::size_t i = 0; i < nodes && reader.ok(); ++i) {
    NodeEntities node;
    const std::string_view space = reader.text(), name = reader.text();
    node.name = std::string(space == "/" ? "" : space) + "/" + std::string(name);
    if (!read_gids(node.readers) || !read_gids(node.writers)) return std::nullopt;
    if (is_full_name(node.name) && node.name.size() <= limits.max_name_bytes) entities.nodes.push_back(std::move(node));
  }
  // Middlewares pad a payload to four bytes at most.
  if (!reader.ok() || reader.left() > 3) return std::nullopt;
  return entities;
}

}  // namespace

std::optional<ParticipantEntities> read_entities(std::string_view payload, const GraphLimits& limits) {
  if (auto entities = read_entities_of(payload, 16, limits)) return entities;
  return read_entities_of(payload, 24, limits);
}

std::string write_entities(const Gid& participant, const std::vector<NodeEntities>& nodes, std::size_t gid_bytes) {
  CdrWriter writer;
  const auto put = [&](const Gid& gid) {
    writer.bytes(std::string_view(reinterpret_cast<const char*>(gid.bytes.data()), gid.bytes.size()));
    for (std::size_t i = gid.bytes.size(); i < gid_bytes; ++i) writer.u8(0);
  };
  put(participant);
  writer.u32(static_cast<std::uint32_t>(nodes.size()));
  for (const NodeEntities& node : nodes) {
    const auto slash = node.name.rfind('/');
    writer.text(slash == 0 || slash == std::string::npos ? std::string_view("/") : std::string_view(node.name).substr(0, slash));
    writer.text(std::string_view(node.name).substr(slash == std::string::npos ? 0 : slash + 1));
    for (const auto* list : {&node.readers, &node.writers}) {
      writer.u32(static_cast<std::uint32_t>(list->size()));
      for (const Gid& gid : *list) put(gid);
    }
  }
  return writer.payload();
}

Known::Known(const GraphLimits& limits, UniqueFunction<void()> changed) : limits_(limits), on_change_(std::move(changed)) {}

void Known::changed() {
  changes_.fetch_add(1, std::memory_order_release);
  on_change_();
}

void Known::found(dds::ParticipantData&& participant) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    KnownParticipant& known = participants_[participant.prefix];
    known.vendor = participant.vendor;
    known.is_of_ros = known.is_of_ros || has_key(participant.user_data, "enclave");
  }
  changed();
}

void Known::gone(const Prefix& participant) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    participants_.erase(participant);
    // Fast DDS reports the endpoints before; none may be left behind.
    for (auto it = endpoints_.begin(); it != endpoints_.end();) {
      if (prefix_of(it->first) != participant) {
        ++it;
        continue;
      }
      const auto list = by_name_.find(it->second.name);
      if (list != by_name_.end()) {
        list->second.erase(std::remove(list->second.begin(), list->second.end(), it->first), list->second.end());
        if (list->second.empty()) by_name_.erase(list);
      }
      it = endpoints_.erase(it);
    }
  }
  changed();
}

void Known::found(dds::EndpointData&& endpoint) {
  KnownEndpoint known;
  known.is_writer = endpoint.is_writer;
  const std::uint8_t kind = endpoint.gid.bytes[15] & 0x3fU;
  known.is_keyed = kind == 0x02 || kind == 0x07;
  known.qos = endpoint.qos;
  known.type = ros_type_of(endpoint.type);
  const std::string_view prefix = std::string_view(endpoint.topic).substr(0, 3);
  if (endpoint.topic.size() > limits_.max_name_bytes || endpoint.type.size() > limits_.max_name_bytes ||
      endpoint.user_data.size() > limits_.max_user_data_bytes) {
    ++refused_;
    return;
  }
  if (prefix == "rt/" || prefix == "rq/" || prefix == "rr/") {
    known.name = endpoint.topic.substr(2);
    known.role = prefix == "rt/" ? Role::topic : prefix == "rq/" ? Role::request : Role::response;
    if (known.role == Role::topic) {
      if (known.type.empty()) known.type = endpoint.type;
      known.is_hidden =
          ends_with(known.name, "/_action/feedback") || ends_with(known.name, "/_action/status") || ends_with(known.name, "/_service_event");
    } else {
      const bool fits = cut_end(known.name, known.role == Role::request ? "Request" : "Reply") &&
                        cut_end(known.type, known.role == Role::request ? "_Request" : "_Response");
      if (!fits) known.name.clear();
    }
    if (!is_full_name(known.name)) {
      ++refused_;
      return;
    }
    const std::string_view hash = value_of(endpoint.user_data, "typehash");
    if (is_hash(hash)) known.hash = hash;
    known.service_id = value_of(endpoint.user_data, "serviceid");
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto before = endpoints_.find(endpoint.gid);
    if (before == endpoints_.end() && endpoints_.size() >= limits_.max_endpoints) {
      ++refused_;
      return;
    }
    if (before != endpoints_.end() && before->second.name == known.name && before->second.role == known.role) {
      before->second = std::move(known);
    } else if (before == endpoints_.end()) {
      if (known.role != Role::other) by_name_[known.name].push_back(endpoint.gid);
      endpoints_.emplace(endpoint.gid, std::move(known));
    }
  }
  changed();
}

void Known::gone(const Gid& endpoint) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto known = endpoints_.find(endpoint);
    if (known == endpoints_.end()) return;
    const auto list = by_name_.find(known->second.name);
    if (list != by_name_.end()) {
      list->second.erase(std::remove(list->second.begin(), list->second.end(), endpoint), list->second.end());
      if (list->second.empty()) by_name_.erase(list);
    }
    endpoints_.erase(known);
  }
  changed();
}

void Known::nodes(const Prefix& participant, ParticipantEntities&& entities) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto known = participants_.find(participant);
    if (known == participants_.end()) return;
    known->second.is_of_ros = true;
    known->second.gid_bytes = entities.gid_bytes;
    known->second.nodes = std::move(entities.nodes);
  }
  changed();
}

/// @pre  locked
IdentityForm Known::form_of(const Gid& gid, const KnownEndpoint& reader) const {
  const auto participant = participants_.find(prefix_of(gid));
  if (participant == participants_.end()) return IdentityForm::unknown;
  const auto& vendor = participant->second.vendor;
  if (!reader.service_id.empty()) return IdentityForm::header;  // only the RMW of Cyclone writes it, and those that imitate it
  if (vendor == cyclone) return IdentityForm::header;           // its interface cannot set an identity
  if (vendor == eprosima && (participant->second.is_of_ros || !reader.hash.empty())) return IdentityForm::inline_qos;
  return IdentityForm::unknown;
}

/// @pre  locked
ServerFound Known::find_server(std::string_view service, std::string_view type) const {
  ServerFound server;
  const auto list = by_name_.find(std::string(service));
  if (list == by_name_.end()) return server;
  bool first = true;
  for (const Gid& gid : list->second) {
    const KnownEndpoint& reader = endpoints_.at(gid);
    if (reader.role != Role::request || reader.is_writer || reader.type != type) continue;
    const IdentityForm form = form_of(gid, reader);
    server.form = first || server.form == form ? form : IdentityForm::unknown;
    first = false;
    const auto writer = std::find_if(list->second.begin(), list->second.end(), [&](const Gid& other) {
      const KnownEndpoint& endpoint = endpoints_.at(other);
      return endpoint.role == Role::response && endpoint.is_writer && endpoint.type == type && prefix_of(other) == prefix_of(gid) &&
             endpoint.service_id == reader.service_id;
    });
    if (writer != list->second.end()) server.pairs.emplace_back(gid, *writer);
    else server.incomplete = true;
  }
  return server;
}

ServerFound Known::server(std::string_view service, std::string_view type) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return find_server(service, type);
}

Offered Known::offered(std::string_view topic, std::string_view type, std::string_view hash) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Offered offered;
  const auto list = by_name_.find(std::string(topic));
  if (list == by_name_.end()) return offered;
  for (const Gid& gid : list->second) {
    const KnownEndpoint& writer = endpoints_.at(gid);
    if (writer.role != Role::topic || !writer.is_writer || writer.type != type) continue;
    if (!hash.empty() && !writer.hash.empty() && writer.hash != hash) continue;
    offered.writers.push_back(gid);
    offered.reliable = offered.reliable && writer.qos.reliable;
    offered.transient_local = offered.transient_local && writer.qos.transient_local;
    offered.keyed = offered.keyed && writer.is_keyed;
  }
  return offered;
}

bool Known::is_there(const Gid& endpoint) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return endpoints_.count(endpoint) != 0;
}

std::vector<std::string> Known::nodes_with(std::string_view type, std::string_view hash) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::set<std::string> names;
  std::unordered_set<Prefix, GidHash> having;  // participants: others need no look at what their nodes claim
  for (const auto& [gid, endpoint] : endpoints_)
    if (endpoint.type == type && endpoint.hash == hash) having.insert(prefix_of(gid));
  for (const auto& [prefix, participant] : participants_) {
    if (having.count(prefix) == 0) continue;
    for (const NodeEntities& node : participant.nodes) {
      const auto has = [&, of = prefix](const std::vector<Gid>& list) {
        return std::any_of(list.begin(), list.end(), [&](const Gid& gid) {
          const auto known = endpoints_.find(gid);
          return known != endpoints_.end() && prefix_of(gid) == of && known->second.type == type && known->second.hash == hash;
        });
      };
      if (has(node.writers) || has(node.readers)) names.insert(node.name);
    }
  }
  return std::vector<std::string>(names.begin(), names.end());
}

std::string Known::hash_of(std::string_view type) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string hash;
  for (const auto& [gid, endpoint] : endpoints_) {
    if (endpoint.type != type || endpoint.hash.empty()) continue;
    if (!hash.empty() && hash != endpoint.hash) return {};
    hash = endpoint.hash;
  }
  return hash;
}

bool Known::fits(const Gid& writer, std::string_view hash) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = endpoints_.find(writer);
  return known != endpoints_.end() && (known->second.hash.empty() || known->second.hash == hash);
}

std::size_t Known::gid_bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::size_t bytes = 0;
  for (const auto& [prefix, participant] : participants_) {
    if (participant.gid_bytes == 0) continue;
    if (bytes != 0 && bytes != participant.gid_bytes) return 0;
    bytes = participant.gid_bytes;
  }
  return bytes;
}

std::size_t Known::participants() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return participants_.size();
}

std::size_t Known::endpoints() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return endpoints_.size();
}

std::shared_ptr<const GraphSnapshot> Known::snapshot(std::uint64_t version) const {
  auto made = std::make_shared<GraphSnapshot>();
  made->version = version;
  const std::lock_guard<std::mutex> lock(mutex_);
  std::unordered_map<Gid, const std::string*, GidHash> node_of;
  std::map<std::string, NodeInfo> nodes;
  for (const auto& [prefix, participant] : participants_) {
    Gid gid{};
    std::copy(prefix.begin(), prefix.end(), gid.bytes.begin());
    gid.bytes[14] = 1;
    gid.bytes[15] = 0xc1;
    for (const NodeEntities& node : participant.nodes) {
      NodeInfo& info = nodes[node.name];
      info.name = node.name;
      info.participant = gid;
      for (const auto* list : {&node.readers, &node.writers})
        for (const Gid& endpoint : *list)
          if (prefix_of(endpoint) == prefix) node_of[endpoint] = &node.name;
    }
  }
  std::map<std::string, Topic> topics;
  std::map<std::string, ServiceInfo> services;
  std::map<std::string, std::set<std::string>> nodes_of_service;
  for (const auto& [gid, known] : endpoints_) {
    const auto node = node_of.find(gid);
    const std::string node_name = node == node_of.end() ? std::string() : *node->second;
    if (known.role == Role::topic && !known.is_hidden) {
      Topic& topic = topics[known.name];
      topic.name = known.name;
      (known.is_writer ? topic.writers : topic.readers).push_back({gid, node_name, known.type, known.hash, known.qos});
    } else if ((known.role == Role::request && !known.is_writer) || (known.role == Role::response && known.is_writer)) {
      ServiceInfo& service = services[known.name];
      service.name = known.name;
      if (service.type.empty() || known.type < service.type) {
        service.type = known.type;
        service.hash = known.hash;
      } else if (service.type == known.type && service.hash.empty()) {
        service.hash = known.hash;
      }
      if (!node_name.empty()) nodes_of_service[known.name].insert(node_name);
    }
  }
  for (auto& [name, topic] : topics) {
    const auto by_gid = [](const Endpoint& a, const Endpoint& b) { return a.gid < b.gid; };
    std::sort(topic.writers.begin(), topic.writers.end(), by_gid);
    std::sort(topic.readers.begin(), topic.readers.end(), by_gid);
    made->topics.push_back(std::move(topic));
  }
  std::map<std::string, ActionInfo> actions;
  std::map<std::string, int> ready_services;
  for (auto& [name, service] : services) {
    const auto& serving = nodes_of_service[name];
    service.nodes.assign(serving.begin(), serving.end());
    const ServerFound server = find_server(name, service.type);
    service.form = server.form;
    service.is_ready = !server.pairs.empty() && server.form != IdentityForm::unknown;
    std::string action = name;
    const bool is_goal = cut_end(action, "/_action/send_goal");
    if (is_goal || cut_end(action, "/_action/cancel_goal") || cut_end(action, "/_action/get_result")) {
      ActionInfo& info = actions[action];
      info.name = action;
      if (is_goal) {
        info.type = service.type;
        cut_end(info.type, "_SendGoal");
        info.nodes = service.nodes;
      }
      ready_services[action] += service.is_ready ? 1 : 0;
      info.is_ready = ready_services[action] == 3;
      continue;
    }
    made->services.push_back(std::move(service));
  }
  for (auto& [name, action] : actions)
    if (!action.type.empty() && is_full_name(name)) made->actions.push_back(std::move(action));
  for (auto& [name, node] : nodes) {
    const auto serves = [&, of = name](const char* what) { return made->service(of + what) != nullptr; };
    node.has_parameters = serves("/list_parameters") && serves("/describe_parameters") && serves("/get_parameters") && serves("/set_parameters");
    node.has_lifecycle = serves("/get_state") && serves("/change_state") && serves("/get_available_transitions");
    node.describes_types = serves("/get_type_description");
    made->nodes.push_back(std::move(node));
  }
  return made;
}

}  // namespace lrt::ros2

namespace lrt::ros2 {
inline namespace v0 {

namespace {
template <class List>
const typename List::value_type* find_in(const List& list, std::string_view name) noexcept {
  const auto found = std::lower_bound(list.begin(), list.end(), name, [](const auto& one, std::string_view other) { return one.name < other; });
  return found != list.end() && found->name == name ? &*found : nullptr;
}
}  // namespace

const Topic* GraphSnapshot::topic(std::string_view name) const noexcept { return find_in(topics, name); }
const ServiceInfo* GraphSnapshot::service(std::string_view name) const noexcept { return find_in(services, name); }
const ActionInfo* GraphSnapshot::action(std::string_view name) const noexcept { return find_in(actions, name); }
const NodeInfo* GraphSnapshot::node(std::string_view name) const noexcept { return find_in(nodes, name); }

}  // namespace v0
}  // namespace lrt::ros2
