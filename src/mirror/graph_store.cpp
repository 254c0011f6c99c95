// SPDX-License-Identifier: Apache-2.0
#include "src/mirror/graph_store.hpp"

#include <algorithm>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/base/base64.hpp"
#include "src/base/charset.hpp"
#include "src/base/quote.hpp"
#include "src/base/random.hpp"
#include "src/client/representation.hpp"
#include "src/http/host.hpp"

namespace lrt::mirror {
namespace {

constexpr std::string_view place_of_graph = "{graph}";

/// Whether an unencrypted secret may be sent to that host.
bool may_get_secrets(const http::Url& url) { return url.secure || http::is_this_machine(url.host); }

/// A strong entity tag (RFC 9110 8.8.3) that If-Match can have; empty: there is none.
std::string strong_tag(const http::Fields& fields) {
  constexpr std::size_t longest = 1'024;
  const std::string_view tag = fields.find("ETag").value_or(std::string_view());
  const bool is_quoted = tag.size() >= 2 && tag.size() <= longest && tag.front() == '"' && tag.find('"', 1) == tag.size() - 1;
  return is_quoted && tag.find_first_of(" \t") == std::string_view::npos ? std::string(tag) : std::string();
}

/// A URL for messages: without user name and password.
std::string without_userinfo(std::string url) {
  const std::size_t scheme = url.find("//");
  const std::size_t begin = scheme == std::string::npos ? 0 : scheme + 2, at = url.find_last_of('@', url.find_first_of("/?#", begin));
  if (at != std::string::npos && at >= begin) url.erase(begin, at + 1 - begin);
  return url;
}

}  // namespace

Result<std::unique_ptr<GraphStore>> GraphStore::create(const StoreOptions& options, std::size_t max_requests, const LogCallback& log) {
  std::string example = options.endpoint;
  if (const std::size_t at = example.find(place_of_graph); at != std::string::npos) example.replace(at, place_of_graph.size(), "urn%3Ax");
  const Result<http::Url> url = http::parse_url(example);
  const std::string named = "the store \"" + without_userinfo(options.endpoint) + "\": ";
  if (!url) return unexpected(Errc::invalid_option, named + url.error().message);
  if (!options.token.empty() && !options.user.empty()) return unexpected(Errc::invalid_option, "token and user of the store: expected only one");
  if (!options.token.empty() && !may_get_secrets(*url))
    return unexpected(Errc::invalid_option, named + "a token is sent over TLS or to this machine only");
  for (const char c : options.token)
    if (!lrt::detail::is(c, lrt::detail::uri))
      return unexpected(Errc::invalid_option, "token of the store: expected no white space or control character");
  client::Options client;
  client.ca_file = options.ca_file;
  client.limits.response_time = options.response_time;
  client.limits.max_idle_connections = max_requests;
  client.limits.max_body_bytes = std::size_t{128} * 1024 * 1024;  // of a graph in N-Triples, which is several times as long as the robot's Turtle
  client.command_life = std::chrono::milliseconds(0);             // what a store is to have is sent again until it has it
  client.log = log;
  Result<std::shared_ptr<client::HttpClient>> http = client::HttpClient::create(client);
  if (!http) return unexpected(std::move(http).error());
  (*http)->stay_on_origins();  // what is compared with a robot's graph is of this store
  return std::unique_ptr<GraphStore>(new GraphStore(options, *std::move(http)));
}

std::string GraphStore::url_of(const std::string& graph) const {
  std::string url = options_.endpoint;
  if (const std::size_t at = url.find(place_of_graph); at != std::string::npos) return url.replace(at, place_of_graph.size(), percent_encoded(graph));
  return url + (url.find('?') == std::string::npos ? "?graph=" : "&graph=") + percent_encoded(graph);
}

Result<GraphStore::Answer> GraphStore::put(const std::string& graph, const std::string& turtle, const std::string& if_match) {
  client::Request request{"PUT", url_of(graph), {{"Content-Type", charset::content_type("text/turtle", turtle)}}, turtle};
  if (!if_match.empty()) request.fields.emplace_back("If-Match", if_match);
  return send(std::move(request));
}

Result<GraphStore::Answer> GraphStore::remove(const std::string& graph) { return send({"DELETE", url_of(graph), {}, {}}); }

Result<GraphStore::Answer> GraphStore::get(const std::string& graph, const std::string& if_none_match) {
  // Turtle first: in N-Triples, Virtuoso 7 writes doubles with six digits.
  client::Request request{"GET", url_of(graph), {{"Accept", "text/turtle, application/n-triples;q=0.9"}}, {}};
  if (!if_none_match.empty()) request.fields.emplace_back("If-None-Match", if_none_match);
  return send(std::move(request));
}

/// The value of Authorization for a request; nullopt: the store has not asked for one.
Result<std::optional<std::string>> GraphStore::authorization(const std::string& method, const http::Url& url) {
  if (!options_.token.empty()) return std::optional<std::string>("Bearer " + options_.token);
  std::optional<exchange::DigestChallenge> challenge;
  std::uint32_t count = 0;
  {
    const std::lock_guard lock(mutex_);
    if (uses_basic_) return std::optional<std::string>("Basic " + lrt::detail::base64(options_.user + ":" + options_.password));
    if (!digest_) return std::optional<std::string>();
    challenge = digest_;
    count = ++digest_count_;
  }
  constexpr std::size_t bytes_of_cnonce = 16;
  Result<std::string> value =
      exchange::digest_authorization(*challenge, options_.user, options_.password, method, url.target, count, random_hex(bytes_of_cnonce));
  if (!value) return unexpected(std::move(value).error());
  return std::optional<std::string>(*std::move(value));
}

/// Stores the challenge of a 401. False: it cannot be answered, or the same answer was refused before.
/// @par Errors  refused: the password would be sent unencrypted
Result<bool> GraphStore::take_challenge(const client::Response& response, const http::Url& url) {
  if (options_.user.empty()) return false;
  const std::vector<exchange::Challenge> challenges = exchange::challenges_of(response.fields);
  const std::optional<exchange::DigestChallenge> digest = exchange::digest_challenge(challenges);
  const std::lock_guard lock(mutex_);
  if (digest) {
    if (digest_ && digest_->nonce == digest->nonce && digest_count_ > 0 && !digest->is_stale)
      return true;  // another thread has taken it, or it was the first try
    digest_ = digest;
    digest_count_ = 0;
    uses_basic_ = false;
    return true;
  }
  const bool is_basic = std::any_of(challenges.begin(), challenges.end(), [](const auto& c) { return c.scheme == "basic"; });
  if (!is_basic) return false;
  if (!may_get_secrets(url))
    return unexpected(Errc::refused, "the store asks for HTTP Basic, by which the password could be read on the way: use https");
  uses_basic_ = true;
  return true;
}

Result<GraphStore::Answer> GraphStore::send(client::Request request) {
  constexpr int max_attempts = 3;  // without credentials, with the first nonce, with a newer one
  for (int attempt = 1;; ++attempt) {
    const Result<http::Url> url = http::parse_url(request.url);
    if (!url) return unexpected(url.error());
    Result<std::optional<std::string>> authorization = this->authorization(request.method, *url);
    if (!authorization) return unexpected(std::move(authorization).error());
    client::Request sent = request;
    if (*authorization) sent.fields.emplace_back("Authorization", **authorization);
    Result<client::Response> response = http_->send(sent);
    if (!response) return unexpected(std::move(response).error());
    // After a redirect on the same origin the response to a challenge names another target. Another origin does not get the credentials.
    const bool is_here = client::same_origin(response->url, request.url);
    if (response->status == 401 && attempt < max_attempts && is_here && options_.token.empty()) {
      const Result<bool> can_respond = take_challenge(*response, *url);
      if (!can_respond) return unexpected(can_respond.error());
      if (*can_respond) {
        request.url = response->url;
        continue;
      }
    }
    Answer answer;
    answer.status = response->status;
    if (answer.ok()) {
      answer.entity_tag = strong_tag(response->fields);
      if (request.method == "GET") {
        answer.media_type = response->media_type();
        answer.body = std::move(response->body);
      }
      return answer;
    }
    answer.retry_after = client::retry_after(response->fields);
    answer.reason = request.method + " " + request.url + ": " + std::to_string(response->status) + ": " + response->reason();
    if (response->status == 401 && !is_here) answer.reason += " (it was redirected to another origin, which does not get the credentials)";
    return answer;
  }
}

}  // namespace lrt::mirror
