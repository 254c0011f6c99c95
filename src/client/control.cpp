// SPDX-License-Identifier: Apache-2.0
#include "src/client/control.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <utility>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include <lrt/base/immortal.hpp>
#include "src/http/url.hpp"

namespace lrt::client {
inline namespace v0 {

using Instant = std::chrono::steady_clock::time_point;

/// What renews control, and what its handle refers to. Its tasks do not own it: the handle stops them.
class Control::Impl {
 public:
  Impl(std::shared_ptr<Session> session, std::string url, std::string origin, std::string id, const ControlOptions& options, Instant begin,
       OnControlLost on_lost)
      : url_(std::move(url)),
        id_(std::move(id)),
        session_(std::move(session)),
        origin_(std::move(origin)),
        life_(options.life),
        until_((begin + life_).time_since_epoch().count()),
        on_lost_(std::move(on_lost)),
        tasks_(session_->options().threads, 2, system_clock()) {}
  ~Impl() { give_back(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Begins to renew.
  bool start() {
    session_->http().add_control(origin_, id_);
    return renew_at(std::chrono::steady_clock::now() + life_ / 3) && look_at(until());
  }

  Instant until() const noexcept { return Instant(Instant::duration(until_.load(std::memory_order_acquire))); }
  bool is_held() const noexcept { return !ended_.load(std::memory_order_acquire) && std::chrono::steady_clock::now() < until(); }
  Error why_lost() const {
    const std::lock_guard lock(mutex_);
    if (why_) return *why_;
    if (std::chrono::steady_clock::now() >= until()) return not_renewed();
    return {Errc::closed, "control is held"};
  }

  void give_back() noexcept {
    const bool was_held = end(Error{Errc::closed, "control was given back"});
    tasks_.stop();
    if (!was_held) return;
    try {
      (void)session_->http().send({"DELETE", url_, fields(), {}});
    } catch (...) {}  // then it ends by itself
  }

  const std::string url_, id_;

 private:
  std::vector<std::pair<std::string, std::string>> fields() const {
    std::vector<std::pair<std::string, std::string>> all = {{"Accept", "application/problem+json, application/json"}};
    if (!id_.empty()) all.emplace_back("Control-Id", id_);
    return all;
  }
  Error not_renewed() const { return {Errc::timed_out, "control of " + url_ + " was not renewed in time: the robot did not respond"}; }

  bool renew_at(Instant when) {
    return tasks_.run_at(when, [this] { renew(); });
  }
  /// Looks whether control is over then, also while a renewal waits for its response.
  bool look_at(Instant when) {
    return tasks_.run_at(when, [this] {
      if (std::chrono::steady_clock::now() >= until()) lose(not_renewed());
      else look_at(until());
    });
  }

  void renew() {
    if (ended_) return;
    const Instant begin = std::chrono::steady_clock::now();
    const Result<Response> response = session_->http().send({"PUT", url_, fields(), {}});
    if (response && response->status == 200) {
      until_.store((begin + life_).time_since_epoch().count(), std::memory_order_release);
      renew_at(begin + life_ / 3);
    } else if (response && response->status >= 400 && response->status < 500 && response->status != 412 && response->status != 429) {
      lose(error_of(*response, "PUT", url_));
    } else {
      renew_at(std::chrono::steady_clock::now() + std::min(life_ / 6, std::chrono::milliseconds(1'000)));
    }
  }

  /// @return  it had not ended before
  bool end(Error why) noexcept {
    {
      const std::lock_guard lock(mutex_);
      if (why_) return false;
      why_ = std::move(why);
    }
    ended_.store(true, std::memory_order_release);
    session_->http().remove_control(origin_, id_);
    return true;
  }

  void lose(const Error& why) {
    if (!end(why) || !on_lost_) return;
    session_->workers().post([why, on_lost = std::move(on_lost_)]() mutable -> UniqueFunction<void()> {
      return [why, on_lost = std::move(on_lost)]() mutable { on_lost(why); };
    });
  }

  const std::shared_ptr<Session> session_;
  const std::string origin_;
  const std::chrono::milliseconds life_;
  std::atomic<Instant::rep> until_;
  std::atomic<bool> ended_{false};
  mutable std::mutex mutex_;  // guards why_
  std::optional<Error> why_;
  OnControlLost on_lost_;  // used by who has called end()
  Tasks tasks_;            // last: it ends first
};

Control::Control() noexcept = default;
Control::Control(std::shared_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Control::Control(Control&&) noexcept = default;
Control& Control::operator=(Control&& other) noexcept {
  if (this != &other) {
    give_back();
    impl_ = std::move(other.impl_);
  }
  return *this;
}
Control::~Control() { give_back(); }

bool Control::is_held() const noexcept { return impl_ && impl_->is_held(); }
Instant Control::until() const noexcept { return impl_ ? impl_->until() : Instant(); }
Error Control::why_lost() const { return impl_ ? impl_->why_lost() : Error{Errc::closed, "control was never taken"}; }
const std::string& Control::url() const noexcept {
  static const Immortal<std::string> none;
  return impl_ ? impl_->url_ : *none;
}
const std::string& Control::id() const noexcept {
  static const Immortal<std::string> none;
  return impl_ ? impl_->id_ : *none;
}
void Control::give_back() noexcept {
  if (impl_) impl_->give_back();
}

Result<Control> take_control(const std::shared_ptr<Session>& session, const std::string& thing, const ControlOptions& options,
                             OnControlLost on_lost) {
  if (options.life < std::chrono::seconds(1) || options.life > std::chrono::seconds(60))
    return unexpected(Errc::invalid_option, "control: expected a life of 1 s to 60 s, found " + std::to_string(options.life.count()) + " ms");
  const Result<RepresentationPtr> read = session->get(thing);
  if (!read) return unexpected(read.error());
  const rdf::Graph& graph = (*read)->graph;
  std::string url;
  const auto self = graph.find(rdf::iri(std::string(document_of((*read)->url)))), predicate = graph.find(rdf::TermView(vocab::lrt_::control));
  if (self && predicate)
    for (const rdf::Triple& t : graph.match(*self, *predicate, std::nullopt))
      if (graph.term(t.object).is_iri()) url = std::string(graph.term(t.object).text);
  if (url.empty()) return unexpected(Errc::unknown_path, "\"" + thing + "\" has no lrt:control: clients do not take control of it");
  if (!same_origin(url, (*read)->url)) return unexpected(Errc::refused, "\"" + thing + "\": its lrt:control is of another origin");
  const Result<http::Url> parsed = http::parse_url(url);
  if (!parsed) return unexpected(parsed.error().code, "\"" + url + "\": " + parsed.error().message);

  std::string target = url + "?life=" + rdf::lexical::format(std::chrono::duration<double>(options.life).count());
  if (!options.name.empty()) target += "&name=" + iri::encode_segment(options.name);
  Request request{"POST", target, {{"Accept", "application/problem+json, application/json"}}, {}};
  if (options.take_over) request.fields.emplace_back("Take-Over", "?1");
  const Instant begin = std::chrono::steady_clock::now();
  const Result<Response> response = session->http().send(request);
  if (!response) return unexpected(response.error());
  if (!response->ok()) return unexpected(error_of(*response, "POST", url));
  auto impl = std::make_shared<Control::Impl>(session, std::move(url), parsed->origin(),
                                              std::string(response->fields.find("Control-Id").value_or(std::string_view())), options, begin,
                                              std::move(on_lost));
  if (!impl->start()) return unexpected(Errc::io_error, "no thread to renew control");
  return Control(std::move(impl));
}

}  // namespace v0
}  // namespace lrt::client
