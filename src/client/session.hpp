// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/client/options.hpp>
#include <lrt/client/things.hpp>

#include "src/base/event_waker.hpp"
#include "src/client/http_client.hpp"
#include "src/client/representation.hpp"
#include "src/client/structure.hpp"
#include "src/client/tasks.hpp"
#include "src/client/watches.hpp"

namespace lrt::client {
inline namespace v0 {

/// A cache of received representations. The least recently used is removed first. Not synchronised.
class RepresentationCache {
 public:
  explicit RepresentationCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}
  struct Found {
    RepresentationPtr representation;  ///< null: there is none
    std::chrono::steady_clock::time_point since{};
  };
  Found find(const std::string& url);
  /// It has been confirmed.
  void touch(const std::string& url);
  void put(const std::string& url, RepresentationPtr representation, std::size_t bytes);
  void remove(const std::string& url);

 private:
  struct Entry {
    std::string url;
    RepresentationPtr representation;
    std::size_t bytes;
    std::chrono::steady_clock::time_point since;
  };
  const std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::list<Entry> entries_;  // the most recently used first
  std::unordered_map<std::string, std::list<Entry>::iterator> by_url_;
};

/// Blocking work on threads of Tasks, and the results for poll().
/// @par Threads  Any.
class Workers {
 public:
  Workers(const ThreadOptions& threads, bool in_background) : in_background_(in_background), tasks_(threads, max_threads, system_clock()) {}
  ~Workers() { stop(); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  bool post(UniqueFunction<UniqueFunction<void()>()> work);
  /// Runs the oldest callback; false: there is none.
  bool run_one() noexcept;
  EventWaker& waker() noexcept { return waker_; }
  /// Drops waiting tasks. Waits for running ones.
  void stop() noexcept;

 private:
  /// Queues a callback for poll().
  void call_in_poll(UniqueFunction<void()> callback);

  static constexpr std::size_t max_threads = 4, max_waiting = 1'000;
  const bool in_background_;
  EventWaker waker_;
  std::mutex mutex_;
  std::deque<UniqueFunction<void()>> callbacks_;
  bool stopped_ = false;
  std::atomic<std::size_t> waiting_{0};  ///< work that has not started
  Tasks tasks_;
};

/// The state shared by a Client and its handles.
class LRT_INTERNAL_API Session : public std::enable_shared_from_this<Session> {
 public:
  Session(std::shared_ptr<HttpClient> http, const Options& options);
  ~Session();

  /// Representations are asked for in gzip from now on. A proxy makes the entity tag of what it compresses a weak one, so this is for sessions that do
  /// not write. Before the first get().
  void accept_gzip() noexcept { accepts_gzip_ = true; }
  /// A representation; requested with If-None-Match if one is cached.
  /// @param known_tag  an entity tag of the representation that the caller knows from elsewhere, used if none is cached
  /// @return  null: the representation still has `known_tag`
  Result<RepresentationPtr> get(const std::string& url, const std::string& known_tag = {});
  /// The links of a resource whose representation is no RDF, by HEAD. Its graph is empty.
  Result<RepresentationPtr> outline(const std::string& url);
  /// The same as get(), or a representation of the last minute: for parts that rarely change, such as the binding and the shape.
  /// If they are outdated, the server refuses the request, and they are removed from the cache.
  Result<RepresentationPtr> described(const std::string& url);
  /// Removes the outdated representations of a resource.
  void forget(const std::string& url);
  Result<Robot> open(const std::string& url);
  /// A request that changes a resource. @par Errors  also those of a response that is no success
  Result<Response> change(const Request& request);
  /// A shape with all that it refers to.
  /// @param node  an IRI, or a blank node of `known`
  Result<Shape> shape(const rdf::TermView& node, const Representation& known);

  /// Value of Accept: RDF, and for errors problem details, which say more than a status (RFC 9457).
  std::string accept() const { return options_.accept + ", application/problem+json"; }
  HttpClient& http() noexcept { return *http_; }
  Workers& workers() noexcept { return workers_; }
  Watches& watches() noexcept { return watches_; }
  Structures& structures() noexcept { return structures_; }
  const Options& options() const noexcept { return options_; }
  void stop() noexcept;

 private:
  const Options options_;
  const std::shared_ptr<HttpClient> http_;
  bool accepts_gzip_ = false;
  std::mutex mutex_;
  RepresentationCache cache_;
  Workers workers_;
  Watches watches_;
  Structures structures_;
};

/// The error that a response with a status of 400 or more is.
Error error_of(const Response& response, const std::string& method, const std::string& url);

}  // namespace v0
}  // namespace lrt::client
