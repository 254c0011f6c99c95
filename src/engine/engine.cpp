#include <lrt/engine/engine.hpp>

#include <algorithm>

#include <lrt/base/iri.hpp>
#include <lrt/base/utf8.hpp>
#include <lrt/http/target.hpp>
#include <lrt/http/websocket.hpp>

#include "src/base/ascii.hpp"
#include "src/engine/impl.hpp"

namespace lrt::engine {

Engine::Engine(Options options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Engine::~Engine() = default;
Result<void> Engine::add(Thing thing) {
  std::vector<Thing> things;
  things.push_back(std::move(thing));
  return impl_->add(std::move(things));
}
Result<void> Engine::add(std::vector<Thing> things) { return impl_->add(std::move(things)); }
Result<void> Engine::remove(std::string_view path) { return impl_->remove(path); }
void Engine::listens_on(std::string_view address, std::uint16_t port, bool secure) { impl_->listens_on(address, port, secure); }
void Engine::set_waker(std::shared_ptr<Waker> waker) { impl_->set_waker(std::move(waker)); }
Outcome Engine::handle(const http::Request& request, TimePoint now) { return impl_->handle(request, now); }
std::optional<Reply> Engine::next_reply(TimePoint now) { return impl_->next_reply(now); }
std::optional<std::chrono::steady_clock::time_point> Engine::next_deadline() const { return impl_->next_deadline(); }
void Engine::abandon(Ticket ticket) noexcept { impl_->abandon(ticket); }
std::optional<Channel> Engine::next_ready(TimePoint now) { return impl_->next_ready(now); }
std::optional<Push> Engine::next_push(Channel channel, TimePoint now) { return impl_->next_push(channel, now); }
void Engine::closed(Channel channel) noexcept { impl_->closed(channel); }
Result<void> Engine::check() const { return impl_->check(); }
std::vector<subscription::Due> Engine::take_callbacks() { return impl_->take_callbacks(); }
std::optional<subscription::Notice> Engine::next_notice(Channel channel, TimePoint now) { return impl_->next_notice(channel, now); }
void Engine::delivered(Channel channel, const subscription::Receipt& receipt, TimePoint now) { impl_->delivered(channel, receipt, now); }
std::optional<std::string> Engine::take_saved() { return impl_->take_saved(); }
Result<void> Engine::restore(std::string_view saved) { return impl_->restore(saved); }
std::vector<Job> Engine::take_jobs() { return impl_->take_jobs(); }
void Engine::stop() { impl_->stop(); }

OwnedRequest::OwnedRequest(const http::Request& request)
    : method(request.method),
      target(request.target),
      peer(request.peer),
      client_certificate(request.client_certificate),
      version(request.version),
      secure(request.secure),
      can_upgrade(request.can_upgrade) {
  fields.reserve(request.fields.size());
  for (const http::Field& f : request.fields) fields.emplace_back(f.name, f.value);
}

http::Request OwnedRequest::view() const {
  http::Request request;
  request.method = method;
  request.target = target;
  request.peer = peer;
  request.client_certificate = client_certificate;
  request.version = version;
  request.secure = secure;
  request.can_upgrade = can_upgrade;
  request.fields.reserve(fields.size());
  for (const auto& [name, value] : fields) request.fields.push_back({name, value});
  return request;
}

Result<std::string> canonical_path(std::string_view path) {
  std::string out;
  out.reserve(path.size());
  std::size_t start = 1;
  while (true) {
    const std::size_t end = std::min(path.find('/', start), path.size());
    Result<std::string> segment = iri::decode(path.substr(start, end - start));
    if (!segment) return Unexpected{std::move(segment).error()};
    if (segment->find('\0') != std::string::npos) return unexpected(Errc::expected_iri, "NUL (%00) in the path");
    if (const auto bad = utf8::find_invalid(*segment))
      return unexpected(Errc::expected_iri, "the path is not UTF-8 at byte " + std::to_string(*bad) + " of a segment");
    if (*segment == "." || *segment == "..") return unexpected(Errc::expected_iri, "\"" + *segment + "\" in the path");
    out += '/';
    out += iri::encode_segment(*segment);
    if (end == path.size()) return out;
    start = end + 1;
  }
}

namespace {

bool plain(std::string_view path) noexcept {
  // What encode_segment leaves alone, and no dot segment.
  for (std::size_t i = 0; i < path.size(); ++i) {
    const char c = path[i];
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '/';
    if (!letter) return false;
  }
  return true;
}

/// RFC 9110 9.2.1
bool is_safe(std::string_view method) noexcept { return method == "GET" || method == "HEAD" || method == "OPTIONS"; }

constexpr std::string_view methods[] = {"GET", "HEAD", "OPTIONS", "PUT", "POST", "DELETE", "PATCH"};

}  // namespace

std::optional<http::Response> Engine::Impl::find_base(Context& context, const http::Target& target) {
  if (!options_.public_base.empty()) return std::nullopt;
  std::string_view authority = target.absolute ? target.authority : context.request.find("Host").value_or(std::string_view());
  if (authority.empty()) return std::nullopt;  // HTTP/1.0 without Host: the listening address
  const bool secure = context.request.secure;
  std::string_view scheme = secure ? "https://" : "http://";
  // The common case first: a base that was made before.
  for (std::size_t i = 0; i < bases_.size(); ++i) {
    const std::string& base = bases_[i];
    if (answered_[i] && base.size() == scheme.size() + authority.size() && base.compare(0, scheme.size(), scheme) == 0 &&
        base.compare(scheme.size(), std::string::npos, authority) == 0) {
      context.base = i;
      return std::nullopt;
    }
  }
  std::string host(authority);
  for (char& c : host)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  const std::string_view default_port = secure ? ":443" : ":80";
  if (host.size() > default_port.size() && host.compare(host.size() - default_port.size(), std::string::npos, default_port) == 0)
    host.resize(host.size() - default_port.size());
  if (!host.empty() && host.back() == ':') host.pop_back();
  if (std::find(hosts_.begin(), hosts_.end(), host) == hosts_.end())
    return problem(context, 421, "this server does not answer for the host \"" + host + "\"");
  context.base = intern_base(std::string(scheme) + host, true);
  return std::nullopt;
}

std::size_t Engine::Impl::intern_base(std::string base, bool answered) {
  const auto known = std::find(bases_.begin(), bases_.end(), base);
  const auto at = static_cast<std::size_t>(known - bases_.begin());
  if (known == bases_.end()) {
    bases_.push_back(std::move(base));
    answered_.push_back(answered);
  }
  answered_[at] = answered_[at] || answered;
  return at;
}

bool Engine::Impl::is_from_foreign_page(const Context& context) const {
  const http::Request& request = context.request;
  if (is_safe(request.method) &&
      (options_.allowed_origins.empty() || !request.can_upgrade || !http::asks_for_upgrade(request, "websocket")))
    return false;
  const auto origin = request.find("Origin");
  if (!origin) return false;
  const std::string& base = bases_[context.base];
  const std::string_view own = std::string_view(base).substr(0, base.find('/', base.find("://") + 3));
  if (request.count("Origin") == 1 && http::iequals(*origin, own)) return false;
  return std::none_of(options_.allowed_origins.begin(), options_.allowed_origins.end(),
                      [&](const std::string& allowed) { return allowed == "*" || http::iequals(*origin, allowed); });
}

std::optional<http::Response> Engine::Impl::find_resource(Context& context, const http::Target& target) {
  if (plain(target.path)) {
    context.resource = find(target.path);
  } else {
    const Result<std::string> path = canonical_path(target.path);
    if (!path) return problem(context, 400, "target: " + path.error().message);
    context.resource = find(*path);
  }
  if (!context.resource) return problem(context, 404, "nothing lives at this path");
  if (is_container(*context.resource) && !target.query.empty()) {
    for (std::string_view rest = target.query; !rest.empty();) {
      const std::string_view one = rest.substr(0, rest.find('&'));
      rest.remove_prefix(std::min(rest.size(), one.size() + 1));
      if (one.substr(0, 5) != "page=") continue;
      std::size_t page = 0;
      for (const char c : one.substr(5)) {
        if (c < '0' || c > '9' || page > 1'000'000) return problem(context, 400, "page: expected a number from 1");
        page = page * 10 + static_cast<std::size_t>(c - '0');
      }
      const std::size_t pages =
          std::max<std::size_t>(1, (members_of(*context.resource).size() + options_.page_members - 1) / options_.page_members);
      if (page == 0 || page > pages) return problem(context, 404, "there are " + std::to_string(pages) + " pages");
      context.page = page;
    }
  }
  return std::nullopt;
}

std::optional<std::string> query_parameter(std::string_view target, std::string_view name) {
  const std::size_t mark = target.find('?');
  if (mark == std::string_view::npos) return std::nullopt;
  for (std::string_view query = target.substr(mark + 1); !query.empty();) {
    const std::string_view one = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), one.size() + 1));
    if (one.size() <= name.size() || one[name.size()] != '=' || one.substr(0, name.size()) != name) continue;
    Result<std::string> value = iri::decode(one.substr(name.size() + 1));
    if (value) return *std::move(value);
  }
  return std::nullopt;
}

std::optional<std::string_view> accept_of(Context& context) {
  if (context.accept) return *context.accept;
  const http::Request& request = context.request;
  context.accept = request.find("Accept");
  std::optional<std::string> text = query_parameter(request.target, "accept");
  if (!text && request.count("Accept") > 1) text = request.joined("Accept");
  if (text) {
    context.accept_text = std::make_unique<const std::string>(*std::move(text));
    context.accept = std::optional<std::string_view>(*context.accept_text);
  }
  return *context.accept;
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (detail::is(c, detail::unreserved) || c == '/' || c == '+') out += c;
    else detail::append_percent(out, c);
  }
  return out;
}

std::string format_iri(const std::string& resource, std::string_view media_type, std::size_t page) {
  return resource + (page > 1 ? "?page=" + std::to_string(page) + "&" : "?") + "accept=" + escaped(media_type);
}

Outcome Engine::Impl::handle(const http::Request& request, TimePoint now) {
  Context context{request, now, 0, nullptr, 1, {}};
  try {
    if (!door_->empty()) drain(now);
    if (stopped_) {
      find_again(context);
      http::Response response = problem(context, 503, "the server is stopping");
      response.close = true;
      return response;
    }
    return route(context, false);
  } catch (const std::exception& e) {
    log(LogLevel::error, std::string("a request failed inside: ") + e.what());
    return problem(context, 500, "the server failed");
  }
}

Outcome Engine::Impl::route(Context& context, bool fresh) {
  const http::Request& request = context.request;
  const auto target = http::split_target(request.target);
  if (!target) return problem(context, 400, "target: expected a path, an http(s) URI or *");
  if (auto answer = find_base(context, *target)) return *std::move(answer);
  if (is_from_foreign_page(context)) return problem(context, 403, "pages of " + std::string(*request.find("Origin")) + " may not send this");
  if (!is_safe(request.method) && request.find(notification_field) == instance_)
    return problem(context, 403, "this is a notification of this server: it does not obey itself");
  if (options_.authorize) {
    const Result<Access> access = guarded<Access>([&]() -> Result<Access> { return options_.authorize(request); });
    if (!access) {
      log(LogLevel::error, "the authorizer: " + access.error().message);
      return problem(context, 500, "the authorizer failed");
    }
    if (*access == Access::unauthenticated) {
      http::Response response = problem(context, 401, "credentials are needed");
      response.fields.set("WWW-Authenticate", options_.challenge);
      return response;
    }
    if (*access == Access::forbidden) return problem(context, 403, "not allowed for these credentials");
  }
  if (std::find(std::begin(methods), std::end(methods), request.method) == std::end(methods)) {
    find_again(context);
    return problem(context, 501, "unknown method \"" + std::string(request.method) + "\"");
  }
  if (target->path == "*") {
    http::Response response;
    response.status = 204;
    response.fields.add("Allow", "GET, HEAD, OPTIONS, PUT, POST, DELETE");
    return response;
  }
  if (auto answer = find_resource(context, *target)) return *std::move(answer);
  if (const auto prefer = request.find("Prefer")) context.preferences = http::parse_prefer(request.joined("Prefer"));

  const std::string_view method = request.method;
  Resource& resource = *context.resource;
  if (method == "GET" || method == "HEAD") {
    if (const auto protocol = asked_protocol(context)) return subscribe(context, *protocol, fresh);
    return get(context, fresh);
  }
  if (method == "OPTIONS") return options(context);
  const auto not_allowed = [&]() -> Outcome {
    return problem(context, 405, std::string(method) + " is not allowed here, " + allow(resource) + " are");
  };
  if (allow(resource).find(method) == std::string::npos) return not_allowed();
  if (method == "PUT") return put(context);
  if (method == "POST") {
    if (resource.kind == Kind::action) return post_action(context);
    return resource.kind == Kind::subscriptions ? post_subscription(context) : post_collection(context);
  }
  if (resource.kind == Kind::invocation) return delete_invocation(context);
  return resource.kind == Kind::subscription ? delete_subscription(context) : delete_member(context);
}

http::Response Engine::Impl::options(const Context& context) {
  http::Response response;
  response.status = 204;
  add_allow(response.fields, *context.resource);
  add_links(response.fields, *context.resource, bases_[context.base], context.page);
  return response;
}

Context Engine::Impl::resumed(const http::Request& request, TimePoint now, Resource* resource) {
  Context context{request, now, 0, resource, 1, {}};
  if (const auto target = http::split_target(request.target)) (void)find_base(context, *target);
  if (request.find("Prefer")) context.preferences = http::parse_prefer(request.joined("Prefer"));
  return context;
}

/// For an answer that is given without routing: LDP 4.2.1.4 wants on it too what the resource is.
void Engine::Impl::find_again(Context& context) {
  const auto target = http::split_target(context.request.target);
  if (target && target->path != "*") (void)find_resource(context, *target);
}

http::Response Engine::Impl::robot_is_busy(const Context& context) {
  http::Response response = problem(context, 503, "too many requests wait for the robot");
  response.fields.set("Retry-After", std::to_string(options_.retry_after.count()));
  return response;
}

Outcome Engine::Impl::defer(const Context& context, std::chrono::milliseconds most, Ticket& ticket) {
  if (waiting_.size() >= options_.waiting_requests || too_many_jobs()) return robot_is_busy(context);
  ticket = Ticket{next_ticket_++};
  const auto [entry, inserted] = waiting_.emplace(static_cast<std::uint64_t>(ticket), OwnedRequest(context.request));
  entry->second.deadline = context.now.steady + most;
  entry->second.timer = timers_.emplace(entry->second.deadline, ticket);
  return Deferred{ticket};
}

Engine::Impl::Waiting* Engine::Impl::find_waiting(Ticket ticket) {
  const auto found = waiting_.find(static_cast<std::uint64_t>(ticket));
  return found == waiting_.end() ? nullptr : &found->second;
}

void Engine::Impl::reply(Ticket ticket, http::Response response) {
  const auto found = waiting_.find(static_cast<std::uint64_t>(ticket));
  if (found == waiting_.end()) return;
  timers_.erase(found->second.timer);
  waiting_.erase(found);
  replies_.push_back({ticket, std::move(response)});
}

/// The reads that a GET waited for are done: answers it from what they brought.
void Engine::Impl::resume(Ticket ticket, TimePoint now) {
  Waiting* waiting = find_waiting(ticket);
  if (!waiting) return;
  const http::Request request = waiting->request.view();
  Context context = resumed(request, now, nullptr);
  if (waiting->failure) {
    if (waiting->failure->code != Errc::closed) find_again(context);
    return reply(ticket, problem(context, waiting->failure->code == Errc::closed ? 404 : waiting->failure->code == Errc::timed_out ? 503 : 500, waiting->failure->message));
  }
  Outcome outcome = route(context, true);
  if (auto* response = std::get_if<http::Response>(&outcome)) {
    reply(ticket, std::move(*response));
  } else if (auto* upgraded = std::get_if<Upgraded>(&outcome)) {
    reply(ticket, std::move(upgraded->response));
    replies_.back().channel = upgraded->channel;
  }
}

void Engine::Impl::abandon(Ticket ticket) noexcept {
  const auto found = waiting_.find(static_cast<std::uint64_t>(ticket));
  if (found == waiting_.end()) return;
  // A write or command that has not begun is called off with its client; one that runs goes on.
  if (found->second.claim) found->second.claim->call_off();
  timers_.erase(found->second.timer);
  waiting_.erase(found);
}

void Engine::Impl::expire(TimePoint now) {
  while (!timers_.empty() && timers_.begin()->first <= now.steady) {
    const Ticket ticket = timers_.begin()->second;
    Waiting& waiting = *find_waiting(ticket);
    const http::Request request = waiting.request.view();
    Context context = resumed(request, now, nullptr);
    InvocationResource* invocation = waiting.invocation.empty() ? nullptr : find_invocation(waiting.invocation);
    if (invocation) {
      auto& list = invocation->waiting;
      list.erase(std::remove(list.begin(), list.end(), ticket), list.end());
      context.resource = invocation->action;
      // What has been taken up, even if nobody has said so yet, goes on.
      if (waiting.may_take_long || invocation->status == Status::running || (invocation->claim && !invocation->claim->call_off())) {
        reply(ticket, accepted(context, *invocation));
        continue;
      }
      // Not begun: the client is told to come again, so it must not happen later.
      never_begun(*invocation, now);
    } else {
      find_again(context);
      if (waiting.claim) waiting.claim->call_off();
    }
    reply(ticket, too_late(context));
  }
  while (!start_timers_.empty() && start_timers_.begin()->first <= now.steady) {
    InvocationResource* invocation = find_invocation(start_timers_.begin()->second);
    start_timers_.erase(start_timers_.begin());
    if (invocation) invocation->start_timer.reset();
    if (!invocation || invocation->status != Status::pending || !invocation->claim || !invocation->claim->call_off()) continue;
    never_begun(*invocation, now);
  }
}

void Engine::Impl::drain(TimePoint now) {
  door_->take_all([&](Message message) { message(*this, now); });
}

std::optional<Reply> Engine::Impl::next_reply(TimePoint now) {
  try {
    if (!door_->empty()) drain(now);
    expire(now);
  } catch (const std::exception& e) {
    log(LogLevel::error, std::string("an answer failed inside: ") + e.what());
  }
  if (replies_.empty()) return std::nullopt;
  Reply first = std::move(replies_.front());
  replies_.pop_front();
  return first;
}

std::optional<std::chrono::steady_clock::time_point> Engine::Impl::next_deadline() const {
  std::optional<std::chrono::steady_clock::time_point> first;
  if (!timers_.empty()) first = timers_.begin()->first;
  const auto consider = [&](const auto& by_time) {
    if (!by_time.empty() && (!first || by_time.begin()->first < *first)) first = by_time.begin()->first;
  };
  consider(start_timers_);
  consider(channel_timers_);
  consider(sample_timers_);
  if (looking_ && (!first || next_look_ < *first)) first = next_look_;
  if (!urgent_.empty() || !ready_.empty()) first = std::chrono::steady_clock::time_point{};  // at once
  return first;
}

void Engine::Impl::stop() {
  stopped_ = true;
  while (!waiting_.empty()) {
    const auto& [number, waiting] = *waiting_.begin();
    if (waiting.claim) waiting.claim->call_off();
    const http::Request request = waiting.request.view();
    Context context{request, clock_.now(), 0, nullptr, 1, {}};
    find_again(context);
    http::Response response = problem(context, 503, "the server is stopping");
    response.close = true;
    reply(Ticket{number}, std::move(response));
  }
}

void Engine::Impl::run_hook(Dispatch where, UniqueFunction<void()> hook) {
  add_job(where, [hook = std::move(hook)]() mutable { (void)guarded<void>([&]() -> Result<void> { return hook(), Result<void>(); }); });
}

}  // namespace lrt::engine
