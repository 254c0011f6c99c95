// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/engine/parts.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/http/form.hpp"
#include "src/http/target.hpp"
#include "src/http/websocket.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

constexpr std::array<std::string_view, 7> known_methods = {"GET", "HEAD", "OPTIONS", "PUT", "POST", "DELETE", "PATCH"};

/// Whether a request with this method has a body that the resource reads.
bool has_input(std::string_view method) noexcept { return method == "PUT" || method == "POST" || method == "PATCH"; }

ObservableResource observable(const Resource& resource) {
  return {static_cast<std::uint64_t>(resource.id), resource.path, resource.kind(), resource.wants_queues()};
}

/// RFC 9110 9.2.1
bool is_safe(std::string_view method) noexcept { return method == "GET" || method == "HEAD" || method == "OPTIONS"; }

}  // namespace

/// Handles a request: from its bytes to the resource that it names.
class Engine::Impl {
 public:
  explicit Impl(EngineOptions options) : parts(std::move(options)) {
    parts.bodies.set_continue([this](Ticket ticket, Context& context) { continue_request(ticket, context); });
  }

  HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, const Result<Caller>& caller, TimePoint now);
  bool is_stop(const http::Request& request) const;
  Outcome handle(const http::Request& request, const Result<Caller>& caller, TimePoint now);
  Result<void> add(std::vector<Thing> things);
  Result<void> remove(std::string_view path);
  void remove_with_children(ThingNode& thing);
  void listens_on(std::string_view address, std::uint16_t port, bool secure, std::string_view name, Upgrades upgrades);
  /// Runs the messages of other threads.
  void take_messages(TimePoint now);

  Parts parts;
  bool stopped = false;

 private:
  /// Handles a request for `caller`, unless the engine has stopped.
  template <class Next>
  auto judge(Context& context, Next next) -> decltype(next());
  void add_cors(const Context& context, std::optional<http::Response>& response) const;
  void add_cors(const Context& context, Outcome& outcome) const;
  Outcome route(Context& context, const Result<Caller>& caller);
  Outcome dispatch(Context& context);
  void continue_request(Ticket ticket, Context& kept);
  std::optional<http::Response> find(Context& context, const Result<Caller>& caller);
  std::optional<http::Response> refused_body(Context& context, std::optional<std::uint64_t> body_bytes);
  std::optional<http::Response> too_large(const Context& context, std::uint64_t body_bytes) const;
  std::optional<http::Response> failed_known_precondition(const Context& context);
  bool is_allowed(const Context& context) const;
  std::size_t max_body_bytes(const Context& context) const;
  http::Response method_not_allowed(const Context& context) const;
  std::optional<http::Response> refused_login(const Context& context, const Result<Caller>& caller, const http::Target& target) const;
  std::optional<http::Response> denied(const Context& context, const Result<Caller>& caller) const;
  http::Response too_many_requests(const Context& context, const Caller& caller) const;
  http::Response unauthenticated(const Context& context, const Caller& caller) const;
  http::Response forbidden(const Context& context) const;
  std::optional<http::Response> refused_right(Context& context, const Caller& caller) const;
  http::Response no_resource(const Context& context) const;
  static std::shared_ptr<const Caller> kept(const Result<Caller>& caller);
  bool may(const Context& context) const;
  bool is_from_foreign_page(const Context& context) const;
  bool is_of_own_origin(const Context& context) const;
  bool may_use_cookie(const Context& context) const;
  std::string_view local_path(std::string_view path) const;
  Result<Resource*> resource_at(std::string_view path) const;
  Resource* new_graph(std::string_view path) const;
  std::optional<http::Response> find_resource(Context& context, const http::Target& target) const;
  std::optional<http::Response> read_page(Context& context, std::string_view query) const;
};

HeaderVerdict Engine::Impl::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, const Result<Caller>& caller,
                                         TimePoint now) {
  Context context(request, now);
  HeaderVerdict verdict;
  verdict.response = judge(context, [&]() -> std::optional<http::Response> {
    if (auto response = find(context, caller)) return response;
    if (!context.resource) return std::nullopt;  // the target is *
    verdict.max_body_bytes = max_body_bytes(context);
    verdict.ignores_body = context.resource->is_stop();
    return refused_body(context, body_bytes);
  });
  if (!verdict.response) verdict.judged = kept(caller);
  return verdict;
}

bool Engine::Impl::is_stop(const http::Request& request) const {
  if (request.method != "POST") return false;
  const auto target = http::split_target(request.target);
  if (!target) return false;
  Context context(request, {});
  return !find_resource(context, *target) && context.resource->is_stop();
}

/// Computed once, for handle(). All callers with all rights share one object.
std::shared_ptr<const Caller> Engine::Impl::kept(const Result<Caller>& caller) {
  static const Immortal<Caller> unrestricted;
  if (!caller->view && !caller->principal && caller->client.empty()) return {std::shared_ptr<const Caller>(), &*unrestricted};
  return std::make_shared<const Caller>(*caller);
}

Outcome Engine::Impl::handle(const http::Request& request, const Result<Caller>& caller, TimePoint now) {
  Context context(request, now);
  return judge(context, [&] { return route(context, caller); });
}

template <class Next>
auto Engine::Impl::judge(Context& context, Next next) -> decltype(next()) {
  const Ticket first = parts.pending.next_ticket();
  try {
    take_messages(context.now);
    if (!stopped) {
      auto result = next();
      add_cors(context, result);
      return result;
    }
    if (const auto target = http::split_target(context.request().target)) (void)find_resource(context, *target);
    http::Response response = parts.responses.stopping(context);
    parts.cors.add_fields(context.request(), response);
    return response;
  } catch (const std::exception& e) {
    parts.pending.abandon_from(first);
    parts.responses.log(LogLevel::error, std::string("internal error in a request: ") + e.what());
    http::Response response = parts.responses.problem(context, 500, "internal server error");
    parts.cors.add_fields(context.request(), response);
    return response;
  }
}

void Engine::Impl::add_cors(const Context& context, std::optional<http::Response>& response) const {
  if (response) parts.cors.add_fields(context.request(), *response);
}

void Engine::Impl::add_cors(const Context& context, Outcome& outcome) const {
  if (auto* response = std::get_if<http::Response>(&outcome)) parts.cors.add_fields(context.request(), *response);
  if (auto* streamed = std::get_if<Streamed>(&outcome)) parts.cors.add_fields(context.request(), streamed->response);
}

Outcome Engine::Impl::route(Context& context, const Result<Caller>& caller) {
  if (auto response = find(context, caller)) return *std::move(response);
  if (!context.resource) {
    http::Response response;
    response.status = 204;
    response.fields.add("Allow", "GET, HEAD, OPTIONS, PUT, POST, DELETE, PATCH");
    return response;
  }
  if (const http::Request& request = context.request(); !request.body.empty()) {
    auto refused = request.judged ? too_large(context, request.body.size()) : refused_body(context, request.body.size());
    if (refused) return *std::move(refused);
  }
  if (context.resource->is_about_caller() && context.request().method != "OPTIONS")
    return is_allowed(context) ? context.resource->respond(context, *caller, parts.responses) : method_not_allowed(context);
  return dispatch(context);
}

/// Finds base and resource of a request. The resource stays nullptr for the target "*".
std::optional<http::Response> Engine::Impl::find(Context& context, const Result<Caller>& caller) {
  const http::Request& request = context.request();
  const auto target = http::split_target(request.target);
  if (!target) return parts.responses.problem(context, 400, "target: expected a path, an http(s) URI or *");
  const Result<std::size_t> base = parts.bases.of(request, *target);
  if (!base) return parts.responses.denied(context, http::Denial::host, 421, base.error().message);
  context.base = *base;
  if (auto response = parts.cors.preflight(request)) return response;
  if (auto response = refused_login(context, caller, *target)) return response;
  if (auto response = denied(context, caller)) return response;
  context.client = caller->client;
  context.audience = {caller->view, caller->principal};
  const bool known = std::find(known_methods.begin(), known_methods.end(), request.method) != known_methods.end();
  if (known && target->path == "*") return std::nullopt;
  auto not_found = find_resource(context, *target);
  if (auto response = refused_right(context, *caller)) return response;
  if (!known) return parts.responses.problem(context, 501, "unknown method \"" + std::string(request.method) + "\"");
  return not_found;
}

bool Engine::Impl::is_allowed(const Context& context) const {
  const std::string_view method = context.request().method;
  const Methods allowed = context.resource->methods();
  return is_safe(method) || (method == "PUT" && allowed.put) || (method == "POST" && allowed.post) || (method == "DELETE" && allowed.remove) ||
         (method == "PATCH" && allowed.patch);
}

/// Without a method that is allowed there is no limit, because the response is 405.
std::size_t Engine::Impl::max_body_bytes(const Context& context) const {
  if (!is_allowed(context)) return std::numeric_limits<std::size_t>::max();
  const std::string_view method = context.request().method;
  if (has_input(method)) return context.resource->input(parts.options).max_bytes;
  return parts.options.max_scalar_body_bytes;
}

std::optional<http::Response> Engine::Impl::too_large(const Context& context, std::uint64_t body_bytes) const {
  const std::size_t max = body_bytes == 0 ? 0 : max_body_bytes(context);
  if (body_bytes <= max) return std::nullopt;
  return parts.responses.problem(context, 413,
                                 "the body has " + std::to_string(body_bytes) + " bytes; " + std::to_string(max) + " are allowed for this resource");
}

/// Whether the header section of a request shows that its body is not wanted.
std::optional<http::Response> Engine::Impl::refused_body(Context& context, std::optional<std::uint64_t> body_bytes) {
  const std::string_view method = context.request().method;
  if (!is_allowed(context)) return method_not_allowed(context);
  if (context.resource->is_about_caller()) return too_large(context, body_bytes.value_or(0));
  if (context.resource->has_own_protocol()) {
  } else if (method == "GET" || method == "HEAD") {
    if (!parts.subscriptions.requested_protocol(context))
      if (auto response = parts.representations.unacceptable(context)) return response;
  } else if (has_input(method) && !context.resource->is_stop()) {
    // A chunked body may be empty.
    const Input input = context.resource->input(parts.options);
    if (body_bytes || (!input.may_be_empty && context.request().find("Content-Type"))) {
      auto format = parts.bodies.format_of(context, input.type, false);
      if (auto* response = std::get_if<http::Response>(&format)) return std::move(*response);
    }
  }
  if (auto response = too_large(context, body_bytes.value_or(0))) return response;
  return is_safe(method) ? std::nullopt : failed_known_precondition(context);
}

/// Evaluates If-Match and If-None-Match if that needs no user code. They are evaluated again when the body is complete.
std::optional<http::Response> Engine::Impl::failed_known_precondition(const Context& context) {
  const http::Request& request = context.request();
  if (!request.find("If-Match") && !request.find("If-None-Match")) return std::nullopt;
  context.resource->for_each_property([this](PropertyResource& property) { parts.values.take_published(property); });
  if (!context.resource->is_up_to_date()) return std::nullopt;
  bool lacks_encodings = false;
  auto failed = parts.representations.failed_precondition(context, &lacks_encodings);
  return lacks_encodings ? std::nullopt : std::move(failed);
}

http::Response Engine::Impl::method_not_allowed(const Context& context) const {
  return parts.responses.problem(
      context, 405,
      std::string(context.request().method) + " is not allowed for this resource, only " + context.audience.methods(*context.resource).text());
}

/// Calls the resource.
Outcome Engine::Impl::dispatch(Context& context) {
  const std::string_view method = context.request().method;
  Resource& resource = *context.resource;
  if (method == "GET" || method == "HEAD") {
    if (const auto protocol = parts.subscriptions.requested_protocol(context)) return resource.subscribe(context, parts, *protocol);
    std::optional<Outcome> own = resource.get(context, parts);
    return own ? *std::move(own) : parts.representations.get(context);
  }
  if (method == "OPTIONS") return parts.representations.options(context);
  const Methods allowed = resource.methods();
  if (method == "PUT" && allowed.put) return resource.put(context, parts);
  if (method == "POST" && allowed.post) return resource.post(context, parts);
  if (method == "DELETE" && allowed.remove) return resource.remove(context, parts);
  if (method == "PATCH" && allowed.patch) return resource.patch(context, parts);
  return method_not_allowed(context);
}

/// Continues a deferred request after its body was validated.
void Engine::Impl::continue_request(Ticket ticket, Context& kept) {
  Context context = kept;
  kept.judged = nullptr;
  Outcome outcome;
  try {
    outcome = context.resource ? dispatch(context) : parts.responses.gone(context);
  } catch (const std::exception& e) {
    parts.responses.log(LogLevel::error, std::string("internal error in a request: ") + e.what());
    outcome = parts.responses.problem(context, 500, "internal server error");
  }
  if (auto* response = std::get_if<http::Response>(&outcome)) parts.pending.respond(ticket, std::move(*response));
}

/// Refuses a login for reasons other than credentials: a page of another origin, or too many failed logins.
std::optional<http::Response> Engine::Impl::refused_login(const Context& context, const Result<Caller>& caller, const http::Target& target) const {
  const http::Request& request = context.request();
  if (!parts.session || request.method != "POST" || !caller || resource_at(target.path).value_or(nullptr) != &*parts.session) return std::nullopt;
  if (!is_of_own_origin(context))
    return parts.responses.denied(context, http::Denial::origin, 403,
                                  "only pages of this server may log in: the Origin field is missing or names another origin");
  security::FailedLogins& failed = parts.options.sessions->failed_logins();
  if (const auto pause = failed.pause(request.peer, context.now.steady)) {
    http::Response response = parts.responses.denied(
        context, http::Denial::rate, 429, "too many logins from this address have failed; try again in " + std::to_string(pause->count()) + " s");
    response.fields.set("Retry-After", std::to_string(pause->count()));
    return response;
  }
  if (!caller->principal) failed.add(request.peer, context.now.steady);
  return std::nullopt;
}

std::optional<http::Response> Engine::Impl::denied(const Context& context, const Result<Caller>& caller) const {
  const http::Request& request = context.request();
  if (caller && caller->access == Access::too_many_requests) return too_many_requests(context, *caller);
  if (is_from_foreign_page(context))
    return parts.responses.denied(
        context, http::Denial::origin, 403,
        "web pages of " + std::string(*request.find("Origin")) + " may not send this request: the origin is not in allowed_origins of this server");
  if (!is_safe(request.method) && parts.subscriptions.is_refused_notification(request))
    return parts.responses.denied(
        context, http::Denial::notification, 403,
        "this request is a notification about another resource. It was not executed, because its sender is not in notification_senders");
  if (!caller) {
    parts.responses.log(LogLevel::error, "the authorizer: " + caller.error().message);
    return parts.responses.problem(context, 500, "the authorizer failed");
  }
  if (caller->by_cookie && !may_use_cookie(context))
    return parts.responses.denied(context, http::Denial::origin, 403,
                                  "a session cookie is accepted only from this server's own pages; other clients must send Authorization");
  if (caller->access == Access::unauthenticated) return unauthenticated(context, *caller);
  if (caller->access == Access::forbidden) return forbidden(context);
  return std::nullopt;
}

/// RFC 6585 4
http::Response Engine::Impl::too_many_requests(const Context& context, const Caller& caller) const {
  http::Response response = parts.responses.denied(context, http::Denial::rate, 429,
                                                   "this client exceeds the rate limit per client; the Retry-After field states when to send again");
  response.fields.set("Retry-After", std::to_string(caller.retry_after.count()));
  return response;
}

http::Response Engine::Impl::unauthenticated(const Context& context, const Caller& caller) const {
  http::Response response =
      parts.responses.denied(context, http::Denial::credentials, 401, "credentials are required; the WWW-Authenticate field states which");
  response.fields.set("WWW-Authenticate", caller.challenge.empty() ? parts.options.challenge : caller.challenge);
  return response;
}

http::Response Engine::Impl::forbidden(const Context& context) const {
  return parts.responses.denied(context, http::Denial::right, 403,
                                "these credentials do not allow " + std::string(context.request().method) + " here");
}

/// A resource that the caller may not see is reported as missing. A caller without any rights gets the same response for all paths.
std::optional<http::Response> Engine::Impl::refused_right(Context& context, const Caller& caller) const {
  if (context.resource && context.resource->is_about_caller())
    return caller.principal ? std::nullopt : std::optional(unauthenticated(context, caller));
  const Audience& audience = context.audience;
  if (!audience.is_restricted()) return std::nullopt;
  context.rights = context.resource ? audience.rights(*context.resource) : security::Rights();
  if (context.resource && may(context)) return std::nullopt;
  if (!context.rights.has(security::Right::read)) {
    const bool hides = std::exchange(context.resource, nullptr) != nullptr;
    if (audience.sees_something()) {
      http::Response response = no_resource(context);
      if (hides) response.denial = http::Denial::right;
      return response;
    }
  }
  return caller.principal ? forbidden(context) : unauthenticated(context, caller);
}

/// The rights at its resource are enough for the request.
bool Engine::Impl::may(const Context& context) const {
  const std::string_view method = context.request().method;
  if (!is_safe(method)) return context.rights.has(context.resource->right_to_change());
  const bool reads = context.rights.has(security::Right::read), watches = context.rights.has(security::Right::subscribe);
  if (reads == watches) return reads;
  return method == "GET" && parts.subscriptions.requested_protocol(context) ? watches : reads;
}

/// A page of another origin caused this request (RFC 6454 7), and is not allowed to.
bool Engine::Impl::is_from_foreign_page(const Context& context) const {
  const http::Request& request = context.request();
  const auto origin = request.find("Origin");
  if (!origin) return false;
  if (is_safe(request.method)) {
    const bool subscribes = (request.can_upgrade && http::requests_upgrade(request, "websocket")) || names_event_stream(request);
    if (!subscribes) return false;
  }
  if (is_of_own_origin(context)) return false;
  return !parts.cors.may_command(*origin);
}

/// A page of this server has sent this.
bool Engine::Impl::is_of_own_origin(const Context& context) const {
  const http::Request& request = context.request();
  return request.count("Origin") == 1 && parts.bases.is_own_origin(*request.find("Origin"), context.base, request);
}

/// A browser sends the cookie of a session with each request to this host, also for a page on another port. Therefore requests that change something and
/// subscriptions must come from a page of this server. Other requests may also come from a user who opens a page.
bool Engine::Impl::may_use_cookie(const Context& context) const {
  const http::Request& request = context.request();
  const auto site = request.find("Sec-Fetch-Site");  // Fetch Metadata; of trustworthy URLs only
  const bool is_same = site == "same-origin" && request.count("Sec-Fetch-Site") == 1;
  if (request.find("Origin") && !is_of_own_origin(context)) return false;
  if (!is_safe(request.method) || request.find("Upgrade") || names_event_stream(request)) return request.find("Origin") ? !site || is_same : is_same;
  if (!site || is_same || site == "none") return true;
  return request.find("Sec-Fetch-Mode") == "navigate" && request.find("Sec-Fetch-Dest") == "document";
}

/// The path of a target without that of the public base, which a proxy may remove or keep. If Things have paths below it, only a proxy that
/// removes it is served: else one target could mean two resources.
std::string_view Engine::Impl::local_path(std::string_view path) const {
  const std::string_view prefix = parts.bases.public_path();
  if (prefix.empty() || path.substr(0, prefix.size()) != prefix || parts.registry.has_things_below(prefix)) return path;
  const std::string_view rest = path.substr(prefix.size());
  if (rest.empty()) return "/";
  return rest.front() == '/' ? rest : path;
}

http::Response Engine::Impl::no_resource(const Context& context) const {
  const auto target = http::split_target(context.request().target);
  return parts.responses.problem(
      context, 404, "there is no resource at \"" + std::string(target ? target->path : std::string_view()) + "\"; GET / lists the Things");
}

/// The resource at the path of a target; nullptr: there is none.
/// @par Errors  those of canonical_path
Result<Resource*> Engine::Impl::resource_at(std::string_view path) const {
  const std::string_view found_at = local_path(path);
  if (Resource* const found = parts.registry.find(found_at)) return found;
  const Result<std::string> canonical = canonical_path(found_at);
  if (!canonical) return Unexpected{canonical.error()};
  return parts.registry.find(*canonical);
}

/// The World that can create a graph at an unused path: the path is below the World's path.
Resource* Engine::Impl::new_graph(std::string_view path) const {
  const Result<std::string> canonical = canonical_path(local_path(path));
  if (!canonical || parts.registry.find(*canonical)) return nullptr;
  std::string above = *canonical;
  for (std::size_t slash = above.rfind('/'); slash != 0 && slash != std::string::npos; slash = above.rfind('/')) {
    above.erase(slash);
    if (Resource* const resource = parts.registry.find(above)) return resource->new_graph(*canonical, parts);
  }
  return nullptr;
}

std::optional<http::Response> Engine::Impl::find_resource(Context& context, const http::Target& target) const {
  const Result<Resource*> found = resource_at(target.path);
  if (!found) return parts.responses.problem(context, 400, "target: " + found.error().message);
  context.resource = *found;
  if (context.resource && !target.query.empty()) {
    const Result<Resource*> named = context.resource->find_graph(context.request().target, context, parts);
    if (!named) return parts.responses.problem(context, 400, named.error().message);
    context.resource = *named;
  }
  if (!context.resource && has_input(context.request().method)) context.resource = new_graph(target.path);
  if (!context.resource) return no_resource(context);
  context.resource_id = context.resource->id;
  if (target.query.empty()) return std::nullopt;
  if (const auto links = http::query_parameter(context.request().target, "links")) {
    const auto first = rdf::lexical::parse_uint64(*links);
    if (!first) return parts.responses.problem(context, 400, "links: expected a number from 0");
    context.first_link = static_cast<std::size_t>(std::min<std::uint64_t>(*first, std::numeric_limits<std::size_t>::max()));
  }
  return context.resource->is_container() ? read_page(context, target.query) : std::nullopt;
}

/// The parameter `page` of a container.
std::optional<http::Response> Engine::Impl::read_page(Context& context, std::string_view query) const {
  while (!query.empty()) {
    const std::string_view one = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), one.size() + 1));
    if (one.substr(0, 5) != "page=") continue;
    std::size_t page = 0;
    for (const char c : one.substr(5)) {
      if (c < '0' || c > '9' || page > 1'000'000) return parts.responses.problem(context, 400, "page: expected a number from 1");
      page = page * 10 + static_cast<std::size_t>(c - '0');
    }
    const std::size_t pages = page_count(context.resource->members(context.audience).size(), parts.options.max_page_members);
    if (page == 0 || page > pages) return parts.responses.problem(context, 404, "page: expected a number from 1 to " + std::to_string(pages));
    context.page = page;
  }
  return std::nullopt;
}

void Engine::Impl::take_messages(TimePoint now) {
  if (const auto& inbox = parts.calls.inbox(); !inbox->empty())
    if (const std::string failed = inbox->run_all(now); !failed.empty())
      parts.responses.log(LogLevel::error, "a result could not be processed: " + failed);
  parts.scanner.take_availability();
}

Result<void> Engine::Impl::add(std::vector<Thing> things) {
  parts.discarded.clear();
  std::vector<std::string> added;
  for (Thing& thing : things) {
    std::string path = "/" + thing.path();
    if (Result<void> result = parts.add(std::move(thing)); !result) {
      for (const std::string& before : added) parts.remove(*parts.registry.find_thing(before));
      for (Thing& other : things) parts.discard(std::move(other).release());
      return result;
    }
    added.push_back(std::move(path));
  }
  parts.saved.resume();
  // Observers of the structure are notified in the transport's next turn.
  if (!parts.subscriptions.empty()) parts.calls.inbox()->put([](TimePoint) {});
  return {};
}

Result<void> Engine::Impl::remove(std::string_view path) {
  parts.discarded.clear();
  const Result<std::string> encoded = model::encode_path_from_root(path);
  ThingNode* thing = encoded ? parts.registry.find_thing("/" + *encoded) : nullptr;
  if (!thing) return unexpected(Errc::unknown_path, "no thing at \"" + std::string(path) + "\"");
  remove_with_children(*thing);
  return {};
}

void Engine::Impl::remove_with_children(ThingNode& thing) {
  for (ThingNode* child : std::vector<ThingNode*>(thing.children)) remove_with_children(*child);
  parts.remove(thing);
}

void Engine::Impl::listens_on(std::string_view address, std::uint16_t port, bool secure, std::string_view name, Upgrades upgrades) {
  // The cached representations belong to the previous bases.
  parts.cache.clear();
  for (const auto& [path, thing] : parts.registry.things()) {
    thing->compiled_shapes.clear();
    thing->kind->compiled_shapes.clear();
  }
  parts.bases.listens_on(address, port, secure, name, upgrades);
}

// ---------------------------------------------------------------------------------------------------------------- Engine

Engine::Engine(EngineOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Engine::~Engine() = default;

Result<void> Engine::add(Thing thing) {
  std::vector<Thing> things;
  things.push_back(std::move(thing));
  return impl_->add(std::move(things));
}
Result<void> Engine::add(std::vector<Thing> things) { return impl_->add(std::move(things)); }
Result<void> Engine::remove(std::string_view path) { return impl_->remove(path); }

void Engine::listens_on(std::string_view address, std::uint16_t port, bool secure, std::string_view name, Upgrades upgrades) {
  impl_->listens_on(address, port, secure, name, upgrades);
}

void Engine::set_waker(std::shared_ptr<Waker> waker) {
  impl_->parts.scanner.wake_signal()->set_waker(waker);
  impl_->parts.calls.inbox()->set_waker(std::move(waker));
}

Result<Caller> Engine::authorize(const http::Request& request) const {
  const Authentication& authorizer = impl_->parts.options.authorize;
  if (request.judged) return *static_cast<const Caller*>(request.judged.get());
  if (!authorizer) return Caller();
  if (request.body.empty()) return guarded<Caller>([&]() -> Result<Caller> { return authorizer(request); });
  http::Request header = request;  // whether the body came along with it makes no difference
  header.body = {};
  return guarded<Caller>([&]() -> Result<Caller> { return authorizer(header); });
}

HeaderVerdict Engine::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, const Result<Caller>& caller,
                                   TimePoint now) {
  return impl_->judge_header(request, body_bytes, caller, now);
}

bool Engine::is_stop(const http::Request& request) noexcept {
  return guarded<bool>([&]() -> Result<bool> { return impl_->is_stop(request); }).value_or(false);
}

Outcome Engine::handle(const http::Request& request, const Result<Caller>& caller, TimePoint now) { return impl_->handle(request, caller, now); }

std::optional<Reply> Engine::next_reply(TimePoint now) {
  Parts& parts = impl_->parts;
  try {
    impl_->take_messages(now);
    parts.pending.expire(now);
    parts.invocations.expire(now);
    if (parts.queries && !impl_->stopped) parts.queries->advance(now);
  } catch (const std::exception& e) { parts.responses.log(LogLevel::error, std::string("internal error while making a response: ") + e.what()); }
  return parts.pending.take_reply();
}

std::optional<std::chrono::steady_clock::time_point> Engine::next_deadline() const {
  const Parts& parts = impl_->parts;
  if (!parts.calls.inbox()->empty()) return std::chrono::steady_clock::time_point{};  // guest engines check deadlines themselves
  auto first = parts.pending.next_deadline();
  const auto of_queries = parts.queries ? parts.queries->next_deadline() : std::nullopt;
  for (const auto& other : {parts.invocations.next_deadline(), parts.subscriptions.next_deadline(), parts.scanner.next_deadline(), of_queries})
    if (other && (!first || *other < *first)) first = other;
  return first;
}

void Engine::abandon(Ticket ticket) noexcept { impl_->parts.pending.abandon(ticket); }
void Engine::input_ended(Ticket ticket) noexcept { impl_->parts.pending.input_ended(ticket); }
std::optional<Channel> Engine::next_ready(TimePoint now) {
  if (impl_->stopped) return std::nullopt;
  const std::optional<Channel> first = impl_->parts.subscriptions.next_ready(now);
  if (!first && impl_->parts.queries) impl_->parts.queries->advance(now);  // of what the scan has found
  return first;
}
void Engine::take_ready(std::vector<ReadyChannel>& channels, TimePoint now) {
  if (impl_->stopped) return;
  impl_->parts.subscriptions.take_ready(channels, now);
  if (impl_->parts.queries) impl_->parts.queries->advance(now);
}
std::optional<Push> Engine::next_push(Channel channel, TimePoint now) { return impl_->parts.subscriptions.next_push(channel, now); }
void Engine::closed(Channel channel) noexcept { impl_->parts.subscriptions.closed(channel); }

Result<void> Engine::check() const {
  if (Result<void> checked = impl_->parts.bases.check(); !checked) return checked;
  if (const std::string& vocabulary = impl_->parts.options.vocabulary;
      !vocabulary.empty() && (!iri::is_absolute(vocabulary) || (vocabulary.back() != '#' && vocabulary.back() != '/')))
    return unexpected(Errc::invalid_option, "vocabulary: expected an absolute IRI that ends with '#' or '/', found \"" + vocabulary + "\"");
  if (Result<void> checked = impl_->parts.cors.check(); !checked) return checked;
  if (const auto& queries = impl_->parts.queries)
    if (Result<void> checked = queries->check_options(); !checked) return checked;
  return impl_->parts.subscriptions.check_options();
}
std::vector<subscription::ReadyCallback> Engine::take_callbacks() { return impl_->parts.subscriptions.take_callbacks(); }
std::optional<subscription::Notification> Engine::next_notification(Channel channel, TimePoint now) {
  return impl_->stopped ? std::nullopt : impl_->parts.subscriptions.next_notification(channel, now);
}
void Engine::delivered(Channel channel, const subscription::DeliveryResult& result, TimePoint now) {
  impl_->parts.subscriptions.delivered(channel, result, now);
}
std::optional<SavedText> Engine::take_saved() { return impl_->parts.saved.take(); }
void Engine::saved(std::uint64_t revision, bool written) {
  Parts& parts = impl_->parts;
  parts.calls.inbox()->put([&parts, revision, written](TimePoint now) { parts.saves.saved(revision, written, now); });
}
Result<std::size_t> Engine::restore(std::string_view saved) { return impl_->parts.saved.restore(saved); }
std::pair<std::size_t, std::size_t> Engine::recover(std::string_view damaged) { return impl_->parts.saved.recover(damaged); }

Result<Subscribed> Engine::subscribe(FeedSubscription wanted, TimePoint now) {
  if (impl_->stopped) return unexpected(Errc::closed, "the server has stopped");
  return impl_->parts.subscriptions.make_feed(std::move(wanted), now);
}
std::optional<FeedMessage> Engine::next_feed_message(Channel channel, TimePoint now) {
  return impl_->parts.subscriptions.next_feed_message(channel, now);
}
bool Engine::feed_has_ended(Channel channel) const noexcept { return impl_->parts.subscriptions.has_ended(channel); }
bool Engine::repeat(Channel channel) { return impl_->parts.subscriptions.repeat(channel); }
std::vector<ObservableResource> Engine::observable_resources() const {
  std::vector<ObservableResource> all;
  impl_->parts.registry.for_each([&](const Resource& r) {
    if (r.observable()) all.push_back(observable(r));
  });
  return all;
}
void Engine::follow_resources(bool follow) { impl_->parts.registry.follow(follow); }
std::vector<ObservableResource> Engine::take_new_resources() {
  std::vector<ObservableResource> all;
  for (const ResourceId id : impl_->parts.registry.take_new())
    if (const Resource* r = impl_->parts.registry.find(id); r && r->observable()) all.push_back(observable(*r));
  return all;
}
std::uint64_t Engine::structure() const noexcept { return impl_->parts.registry.structure(); }
std::string Engine::base() const { return impl_->parts.bases[0]; }

void Engine::renew_rights() { impl_->parts.subscriptions.renew_rights(); }

std::vector<Job> Engine::take_jobs() { return impl_->parts.calls.take_jobs(); }
std::vector<BodyJob> Engine::take_body_jobs() { return impl_->parts.bodies.take_jobs(); }
std::vector<BodyJob> Engine::take_query_jobs() { return impl_->parts.queries ? impl_->parts.queries->take_jobs() : std::vector<BodyJob>(); }
EngineCounts Engine::counts() const {
  EngineCounts counts = impl_->parts.subscriptions.counts();
  counts.waiting_requests = impl_->parts.pending.size();
  counts.waiting_calls = impl_->parts.calls.open();
  return counts;
}
std::vector<SubscriptionEvent> Engine::take_subscription_events() { return impl_->parts.subscriptions.take_events(); }
std::vector<std::shared_ptr<const void>> Engine::take_discarded() { return std::exchange(impl_->parts.discarded, {}); }

void Engine::stop() {
  impl_->stopped = true;
  const Parts& parts = impl_->parts;
  impl_->parts.invocations.stop();
  impl_->parts.saves.stop();
  if (impl_->parts.queries) impl_->parts.queries->stop();
  impl_->parts.pending.end_all([&](Context& context) { return parts.responses.stopping(context); }, parts.clock.now());
}

}  // namespace v0
}  // namespace lrt::engine
