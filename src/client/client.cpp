// SPDX-License-Identifier: Apache-2.0
#include <lrt/client.hpp>

#include <poll.h>

#include <algorithm>
#include <utility>

#include "src/client/control.hpp"
#include "src/client/discovery.hpp"
#include "src/client/session.hpp"
#include "src/http/url.hpp"

namespace lrt::client {
inline namespace v0 {

Result<Robot> Session::open(const std::string& given) {
  const std::string url(document_of(given));
  Result<std::optional<Robot>> known = structures_.open(url);
  if (!known) return unexpected(std::move(known).error());
  if (*known) return **std::move(known);
  return Discovery(shared_from_this(), url).run();
}

}  // namespace v0
}  // namespace lrt::client

namespace lrt {
inline namespace v0 {

using client::Session;

// The options are taken by value, as everywhere. NOLINTNEXTLINE(performance-unnecessary-value-param)
Result<Client> Client::create(client::Options options) {
  Result<std::shared_ptr<client::HttpClient>> http = client::HttpClient::create(options);
  if (!http) return unexpected(std::move(http).error());
  auto session = std::make_shared<Session>(*std::move(http), options);
  if (session->workers().waker().descriptor() < 0) return unexpected(Errc::io_error, "cannot create an event descriptor");
  return Client(std::move(session));
}

Client::Client(std::shared_ptr<Session> session) noexcept : session_(std::move(session)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&& other) noexcept {
  if (this != &other) {
    stop();
    session_ = std::move(other.session_);
  }
  return *this;
}
Client::~Client() { stop(); }

Result<client::Robot> Client::open(const std::string& url) {
  if (Result<void> good = trust(url); !good) return unexpected(std::move(good).error());
  return session_->open(url);
}

Result<void> Client::trust(const std::string& url) {
  const Result<http::Url> parsed = http::parse_url(client::document_of(url));
  if (!parsed) return unexpected(parsed.error().code, "\"" + url + "\": " + parsed.error().message);
  session_->http().trust(*parsed);
  return {};
}

Result<client::Property> Client::property(const std::string& url) {
  if (Result<void> good = trust(url); !good) return unexpected(std::move(good).error());
  client::Property property;
  property.session_ = session_;
  property.url_ = url;
  return property;
}

Result<client::Action> Client::action(const std::string& url) {
  if (Result<void> good = trust(url); !good) return unexpected(std::move(good).error());
  client::Action action;
  action.session_ = session_;
  action.url_ = client::document_of(url);
  return action;
}

Result<client::Invocation> Client::invocation(const std::string& url) {
  if (Result<void> good = trust(url); !good) return unexpected(std::move(good).error());
  client::Invocation invocation;
  invocation.session_ = session_;
  invocation.url_ = client::document_of(url);
  return invocation;
}

Result<client::RepresentationPtr> Client::get(const std::string& url) { return session_->get(url); }
Result<client::Response> Client::send(const client::Request& request) { return session_->http().send(request); }

Result<client::Watch> Client::watch(const std::string& url, const client::WatchOptions& options, client::OnChange on_change) {
  if (Result<void> good = trust(url); !good) return unexpected(std::move(good).error());
  return session_->watches().watch(url, options, std::move(on_change));
}

Result<client::Control> Client::control(const std::string& thing, const client::ControlOptions& options, client::OnControlLost on_lost) {
  if (Result<void> good = trust(thing); !good) return unexpected(std::move(good).error());
  return client::take_control(session_, thing, options, std::move(on_lost));
}

bool Client::post(UniqueFunction<UniqueFunction<void()>()> work) { return session_->workers().post(std::move(work)); }

bool Client::poll(std::chrono::microseconds budget) noexcept {
  const auto end = std::chrono::steady_clock::now() + budget;
  client::Workers& workers = session_->workers();
  if (!workers.waker().is_awake()) return false;
  workers.waker().clear();
  while (workers.run_one()) {
    if (std::chrono::steady_clock::now() < end) continue;
    workers.waker().wake();  // the rest is for the next call
    return true;
  }
  const auto rest = std::chrono::duration_cast<std::chrono::microseconds>(end - std::chrono::steady_clock::now());
  if (!session_->watches().poll(std::max(rest, std::chrono::microseconds(0)))) return false;
  workers.waker().wake();
  return true;
}

void Client::wait(std::chrono::milliseconds at_most) noexcept {
  constexpr std::chrono::milliseconds longest = std::chrono::hours(1);
  pollfd item{descriptor(), POLLIN, 0};
  ::poll(&item, 1, static_cast<int>(std::clamp(at_most, std::chrono::milliseconds(0), longest).count()));
}

int Client::descriptor() const noexcept { return session_->workers().waker().descriptor(); }

void Client::stop() noexcept {
  if (session_) session_->stop();
}

}  // namespace v0
}  // namespace lrt
