// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/thing.hpp>

namespace lrt {

class SharedEngine;
class TurnWork;
class Receiver;
class RequestObserver;
class ThingKeeper;

/// A capability of a server beside requests and responses. It has its own state and threads, and gets what the engine hands out. A function in the list
/// of services.cpp makes it, and nothing else names it, unless a public class is its face: see SharedEngine::service().
///
/// A service with a further role also derives from one of the classes below, and returns itself as that. Programs may be compiled without RTTI.
class Service {
 public:
  virtual ~Service() = default;
  /// Checks its options, and claims files. The server does not listen yet.
  virtual Result<void> prepare() { return {}; }
  /// The server listens and has not served a request.
  virtual Result<void> start() { return {}; }
  /// Something was handed out. Called with the engine's lock; moves what must be kept in order.
  virtual void take(engine::Outputs& outputs) { (void)outputs; }
  /// The same without the lock, so that it may call user code.
  /// @par Threads  any
  virtual void pass_on(engine::Outputs& outputs) { (void)outputs; }
  /// The server stops or has stopped: threads of the host that wait here have to check. Called with the engine's lock.
  virtual void wake_all() noexcept {}
  /// The engine has stopped, and all connections are closed: ends threads that run no user code.
  virtual void stop() noexcept {}
  /// The server has stopped: ends the other threads, unless the caller is one of them.
  virtual void join() noexcept {}
  /// The calling thread is its own and runs user code, so that the service cannot be destroyed now.
  virtual bool is_current_thread() noexcept { return false; }
  /// Adds its counters.
  /// @par Threads  any
  virtual void count(ServerCounters& all) const { (void)all; }

  /// @{
  /// Its further roles; nullptr: it does not have this one.
  virtual TurnWork* turn_work() noexcept { return nullptr; }
  virtual Receiver* receiver() noexcept { return nullptr; }
  virtual RequestObserver* observer() noexcept { return nullptr; }
  virtual ThingKeeper* keeper() noexcept { return nullptr; }
  /// @}
  /// The address of `key` of a class that SharedEngine::service() finds; nullptr: it is not found.
  virtual const char* identity() const noexcept { return nullptr; }
};

/// Works on the thread that serves the network, without the engine's lock.
class TurnWork {
 public:
  /// Called in each turn of the transport, before replies are sent.
  virtual void turn(TimePoint now) = 0;
  virtual std::optional<std::chrono::steady_clock::time_point> next_deadline() const = 0;

 protected:
  ~TurnWork() = default;
};

/// @{
/// As a key.
inline std::uint64_t number_of(engine::Ticket ticket) noexcept { return static_cast<std::uint64_t>(ticket); }
inline std::uint64_t number_of(engine::Channel channel) noexcept { return static_cast<std::uint64_t>(channel); }
/// @}

/// Receives responses and messages that do not belong to the server's transport. Called with the engine's lock.
class Receiver {
 public:
  /// False: the reply is not for this receiver.
  virtual bool claim(engine::Reply& reply) = 0;
  /// The channel has a message. False: the channel is not of this receiver.
  virtual bool claim(engine::Channel channel) = 0;

 protected:
  ~Receiver() = default;
};

/// Sees all requests with their outcomes. Called with the engine's lock, after Service::take() got what the request has caused.
class RequestObserver {
 public:
  /// A request and its response, or that the response is deferred. The observer may keep the response and defer it with a ticket of its own: see
  /// SharedEngine::reply().
  virtual void handled(const http::Request& request, const Result<engine::Caller>& caller, engine::Outcome& outcome, TimePoint now) = 0;
  /// A request that was refused by its header section.
  virtual void refused(const http::Request& request, const Result<engine::Caller>& caller, const http::Response& response, TimePoint now) = 0;
  /// A deferred response. False: the observer keeps it.
  virtual bool replied(engine::Reply& reply) = 0;
  /// Responses that it keeps and that are due become others.
  virtual void end_waits(TimePoint now) { (void)now; }
  /// The client did not wait for the response.
  virtual void abandoned(engine::Ticket ticket) { (void)ticket; }
  /// One of the functions above threw an exception: there is no memory.
  virtual void dropped() noexcept {}

 protected:
  ~RequestObserver() = default;
};

/// Keeps something for Things while they are registered. Called without the engine's lock.
class ThingKeeper {
 public:
  /// Things will be registered.
  /// @return called when they are registered
  virtual Result<UniqueFunction<void()>> adding(const std::vector<Thing>& things) = 0;
  /// The Thing at an encoded path, and those below, were removed.
  virtual void removed(const std::string& path) = 0;

 protected:
  ~ThingKeeper() = default;
};

/// Makes the services that the options of a server request, in the order in which they start.
std::vector<std::unique_ptr<Service>> make_services(SharedEngine& server);

}  // namespace lrt
