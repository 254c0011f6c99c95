// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <lrt/ros2/graph.hpp>

#include "src/ros2/graph/dds.hpp"
#include "src/ros2/graph/guard.hpp"

namespace lrt::ros2 {

/// A node as ros_discovery_info states it.
struct NodeEntities {
  std::string name{};  ///< "/arm/driver"
  std::vector<Gid> readers{}, writers{};
};

/// rmw_dds_common/msg/ParticipantEntitiesInfo.
struct ParticipantEntities {
  std::size_t gid_bytes = 0;  ///< of each Gid: 16, or 24 in Humble and before
  std::vector<NodeEntities> nodes{};
};
/// The bytes of a Gid are told by the length of the payload, which only one of both fits. nullopt: neither fits, or a limit is exceeded.
std::optional<ParticipantEntities> read_entities(std::string_view payload, const GraphLimits& limits);
/// @param gid_bytes  16 or 24
std::string write_entities(const Gid& participant, const std::vector<NodeEntities>& nodes, std::size_t gid_bytes);

/// What a server is, for a call.
struct ServerFound {
  IdentityForm form = IdentityForm::unknown;  ///< of all servers of this name and type; unknown also if they differ
  std::vector<std::pair<Gid, Gid>> pairs{};   ///< reader of requests, writer of responses
  bool incomplete = false;                    ///< a server is there with one of its endpoints
};
/// What the writers of a topic offer.
struct Offered {
  std::vector<Gid> writers{};
  bool reliable = true, transient_local = true, keyed = true;  ///< all of them
};

/// The participants and endpoints of others, by the names of ROS.
/// @par Threads  Any.
class Known final : public dds::Discovery {
 public:
  /// @param changed  called after each change, on the thread that reports it, without a lock
  Known(const GraphLimits& limits, UniqueFunction<void()> changed);

  void found(dds::ParticipantData&& participant) override;
  void gone(const Prefix& participant) override;
  void found(dds::EndpointData&& endpoint) override;
  void gone(const Gid& endpoint) override;
  void nodes(const Prefix& participant, ParticipantEntities&& entities);

  std::shared_ptr<const GraphSnapshot> snapshot(std::uint64_t version) const;
  ServerFound server(std::string_view service, std::string_view type) const;
  Offered offered(std::string_view topic, std::string_view type, std::string_view hash) const;
  bool is_there(const Gid& endpoint) const;
  /// Nodes with an endpoint of this type and hash, in order of their names.
  std::vector<std::string> nodes_with(std::string_view type, std::string_view hash) const;
  /// The hash that endpoints of this type announce; empty: none, or they differ.
  std::string hash_of(std::string_view type) const;
  /// Whether a writer announces this hash, or none.
  bool fits(const Gid& writer, std::string_view hash) const;
  std::size_t gid_bytes() const;  ///< that all others use: 16 or 24; 0: nobody has said so, or they differ
  std::uint64_t changes() const noexcept { return changes_.load(std::memory_order_acquire); }
  std::uint64_t refused_endpoints() const noexcept { return refused_.load(std::memory_order_relaxed); }
  std::size_t participants() const;
  std::size_t endpoints() const;

 private:
  enum class Role : std::uint8_t { other, topic, request, response };
  struct KnownEndpoint {
    Role role = Role::other;
    bool is_writer = false;
    bool is_keyed = false;
    bool is_hidden = false;  ///< a topic of an action, or events of a service
    std::string name{}, type{}, hash{};
    std::string service_id{};  ///< RMW of Cyclone
    Qos qos{};
  };
  struct KnownParticipant {
    std::array<std::uint8_t, 2> vendor{};
    bool is_of_ros = false;  ///< its user data names an enclave, or it has published its nodes
    std::size_t gid_bytes = 0;
    std::vector<NodeEntities> nodes{};
  };
  IdentityForm form_of(const Gid& gid, const KnownEndpoint& reader) const;
  ServerFound find_server(std::string_view service, std::string_view type) const;
  void changed();

  const GraphLimits limits_;
  UniqueFunction<void()> on_change_;
  std::atomic<std::uint64_t> changes_{0}, refused_{0};
  mutable std::mutex mutex_;
  std::unordered_map<Prefix, KnownParticipant, GidHash> participants_;
  std::unordered_map<Gid, KnownEndpoint, GidHash> endpoints_;
  std::unordered_map<std::string, std::vector<Gid>> by_name_;  ///< roles that are not `other`
};

}  // namespace lrt::ros2
