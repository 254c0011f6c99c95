// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <lrt/mirror.hpp>

#include "src/client/http_client.hpp"
#include "src/exchange/http_authentication.hpp"

namespace lrt::mirror {

/// Reads, puts and deletes graphs by the SPARQL 1.1 Graph Store HTTP Protocol, and logs in as the store asks.
/// @par Threads  Any. Functions wait for the store, at most StoreOptions::response_time for each of at most three exchanges.
class GraphStore {
 public:
  struct Answer {
    int status = 0;
    std::string entity_tag{};  ///< strong; empty: the store gives none
    std::optional<std::chrono::seconds> retry_after{};
    std::string reason{};              ///< of a status from 300 on: a sentence
    std::string body{}, media_type{};  ///< of a successful GET

    bool ok() const noexcept { return status >= 200 && status < 300; }
  };

  /// @param max_requests  connections that stay open
  /// @par Errors  invalid_option
  static Result<std::unique_ptr<GraphStore>> create(const StoreOptions& options, std::size_t max_requests, const LogCallback& log);

  /// Replaces a graph.
  /// @param turtle    the whole graph
  /// @param if_match  an entity tag; empty: without a condition
  /// @par Errors  of the exchange: there is no response. refused: the requested authentication would expose the credentials
  Result<Answer> put(const std::string& graph, const std::string& turtle, const std::string& if_match);
  Result<Answer> remove(const std::string& graph);
  /// Reads a graph.
  /// @param if_none_match  an entity tag: while the graph has it, the status is 304; empty: without a condition
  /// @par Errors  as put(); limit_exceeded: it is larger than any that a mirror puts
  Result<Answer> get(const std::string& graph, const std::string& if_none_match);
  void stop() noexcept { http_->stop(); }

  /// The URL by which the protocol identifies a graph.
  std::string url_of(const std::string& graph) const;

 private:
  GraphStore(const StoreOptions& options, std::shared_ptr<client::HttpClient> http) : options_(options), http_(std::move(http)) {}
  Result<Answer> send(client::Request request);
  Result<std::optional<std::string>> authorization(const std::string& method, const http::Url& url);
  Result<bool> take_challenge(const client::Response& response, const http::Url& url);

  const StoreOptions options_;
  const std::shared_ptr<client::HttpClient> http_;
  std::mutex mutex_;  ///< guards the rest
  bool uses_basic_ = false;
  std::optional<exchange::DigestChallenge> digest_;
  std::uint32_t digest_count_ = 0;
};

}  // namespace lrt::mirror
