// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/ros2/definitions.hpp>
#include <lrt/ros2/graph.hpp>

namespace lrt::ros2 {

/// Writes a topic.
class TopicWriter {
 public:
  virtual ~TopicWriter() = default;
  virtual Result<void> publish(std::string_view payload) const = 0;
  virtual std::size_t readers() const noexcept = 0;
};
/// A goal that was sent.
class SentGoal {
 public:
  virtual ~SentGoal() = default;
  virtual void cancel() const = 0;
};
/// What ends when it is destroyed: a subscription, a call.
using Handle = std::shared_ptr<void>;

/// What the bridge needs of a Graph, whose functions these are. Tests have another one, without DDS.
///
/// After close() calls return Errc::closed, and no callback runs.
/// @par Threads  Any.
class Port {
 public:
  virtual ~Port() = default;
  virtual std::shared_ptr<const GraphSnapshot> snapshot() const = 0;
  virtual void on_change(UniqueFunction<void()> f) = 0;
  virtual Result<Handle> subscribe(std::string_view topic, std::string_view type, Sink sink, const SubscribeOptions& options) = 0;
  virtual Result<std::shared_ptr<TopicWriter>> advertise(std::string_view topic, std::string_view type, const AdvertiseOptions& options) = 0;
  virtual Result<Handle> call(std::string_view service, std::string_view type, std::string_view request, UniqueFunction<void(Result<Bytes>)> done,
                              std::chrono::milliseconds timeout) = 0;
  virtual Result<std::shared_ptr<SentGoal>> send_goal(std::string_view action, std::string_view type, std::string_view request,
                                                      GoalEvents events) = 0;
  virtual Result<Handle> parameters(std::string_view node, UniqueFunction<void(Result<std::vector<Parameter>>)> done, std::size_t max) = 0;
  virtual Result<Handle> set_parameter(std::string_view node, const Parameter& parameter, UniqueFunction<void(Result<void>)> done,
                                       std::chrono::milliseconds timeout) = 0;
  virtual Result<Handle> parameter_events(
      UniqueFunction<void(std::string_view node, std::vector<Parameter> parameters, std::vector<std::string> deleted)> changed) = 0;
  virtual Result<Handle> request_definition(std::string_view type, std::string_view hash, Definitions& definitions,
                                            UniqueFunction<void(Result<void>)> done) = 0;
  virtual GraphCounters counters() const = 0;
  /// Leaves. Not from a callback.
  virtual void close() = 0;
};

/// A port to a Graph.
class GraphPort final : public Port {
 public:
  explicit GraphPort(Graph graph);
  ~GraphPort() override;
  Graph& graph() noexcept;

  std::shared_ptr<const GraphSnapshot> snapshot() const override;
  void on_change(UniqueFunction<void()> f) override;
  Result<Handle> subscribe(std::string_view topic, std::string_view type, Sink sink, const SubscribeOptions& options) override;
  Result<std::shared_ptr<TopicWriter>> advertise(std::string_view topic, std::string_view type, const AdvertiseOptions& options) override;
  Result<Handle> call(std::string_view service, std::string_view type, std::string_view request, UniqueFunction<void(Result<Bytes>)> done,
                      std::chrono::milliseconds timeout) override;
  Result<std::shared_ptr<SentGoal>> send_goal(std::string_view action, std::string_view type, std::string_view request, GoalEvents events) override;
  Result<Handle> parameters(std::string_view node, UniqueFunction<void(Result<std::vector<Parameter>>)> done, std::size_t max) override;
  Result<Handle> set_parameter(std::string_view node, const Parameter& parameter, UniqueFunction<void(Result<void>)> done,
                               std::chrono::milliseconds timeout) override;
  Result<Handle> parameter_events(
      UniqueFunction<void(std::string_view node, std::vector<Parameter> parameters, std::vector<std::string> deleted)> changed) override;
  Result<Handle> request_definition(std::string_view type, std::string_view hash, Definitions& definitions,
                                    UniqueFunction<void(Result<void>)> done) override;
  GraphCounters counters() const override;
  void close() override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lrt::ros2
