// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/ros2/graph.hpp>

#include "src/ros2/graph/guard.hpp"

/// What lrt::ros2 uses of a middleware for DDS. fastdds.cpp implements it; no other file knows Fast DDS. Names and types are those of DDS.
namespace lrt::ros2::dds {

/// Another participant.
struct ParticipantData {
  Prefix prefix{};
  std::array<std::uint8_t, 2> vendor{};  ///< 1.15: eProsima; 1.16: Eclipse Cyclone DDS
  std::string user_data{};
};

/// A reader or writer of another participant.
struct EndpointData {
  Gid gid{};
  bool is_writer = false;
  std::string topic{};
  std::string type{};
  std::string user_data{};
  Qos qos{};
};

/// Who is there. Called on threads of DDS, one at a time for each participant.
class Discovery {
 public:
  virtual void found(ParticipantData&& participant) = 0;  ///< or it has changed
  virtual void gone(const Prefix& participant) = 0;       ///< with all its endpoints
  virtual void found(EndpointData&& endpoint) = 0;        ///< or it has changed
  virtual void gone(const Gid& endpoint) = 0;

 protected:
  ~Discovery() = default;
};

/// The identity of a request, as inline QoS has it.
struct Identity {
  Gid gid{};
  std::int64_t sequence = 0;
};

/// A sample, valid during the call.
struct Received {
  std::string_view payload{};
  std::chrono::system_clock::time_point source{};  ///< epoch: not stated
  Gid writer{};
  Identity related{};  ///< all zero: none
};

/// Events of a reader or writer. Called on threads of DDS, or on the thread that makes it.
class EndpointEvents {
 public:
  virtual void received(const Received& sample) = 0;  ///< one at a time for each reader
  virtual void lost(std::uint64_t) {}                 ///< so many samples
  virtual void matched() {}                           ///< others have been matched with it, or are no longer

 protected:
  ~EndpointEvents() = default;
};

struct EndpointOptions {
  std::string topic{};
  std::string type{};
  std::string user_data{};
  bool keyed = false;  ///< the topic has keys
  bool reliable = false;
  bool transient_local = false;
  bool is_watched = false;  ///< see Reader::is_heard()
  std::size_t depth = 1;
};

/// @par Threads  Destroying it is not for its own events.
class Reader {
 public:
  virtual ~Reader() = default;
  virtual const Gid& gid() const noexcept = 0;
  virtual bool is_matched(const Gid& writer) const = 0;
  /// Whether the writer is known to be matched with this reader, see Guard::watch(). Only with EndpointOptions::is_watched; then matched() tells of it.
  virtual bool is_heard(const Gid& writer) const = 0;
};

/// @par Threads  Any.
class Writer {
 public:
  virtual ~Writer() = default;
  virtual const Gid& gid() const noexcept = 0;
  virtual bool is_matched(const Gid& reader) const = 0;
  virtual bool is_heard(const Gid& reader) const = 0;  ///< as Reader::is_heard()
  virtual std::size_t readers() const noexcept = 0;
  /// Writes a sample: `head`, then `body`.
  /// @param related  not nullptr: its identity goes with it
  /// @return  its sequence number
  virtual Result<std::int64_t> write(std::string_view head, std::string_view body, const Identity* related) = 0;
};

class Participant {
 public:
  /// Joins a domain. Its threads inherit what the calling thread has.
  static Result<std::unique_ptr<Participant>> join(const GraphOptions& options, std::string_view user_data, Discovery& discovery);
  virtual ~Participant() = default;
  virtual const Prefix& prefix() const noexcept = 0;
  virtual const Guard& guard() const noexcept = 0;
  virtual Result<std::unique_ptr<Reader>> reader(const EndpointOptions& options, EndpointEvents& events) = 0;
  /// @param events  may be nullptr
  virtual Result<std::unique_ptr<Writer>> writer(const EndpointOptions& options, EndpointEvents* events) = 0;
};

}  // namespace lrt::ros2::dds
