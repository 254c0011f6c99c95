// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <utility>

#include <lrt/model/statement.hpp>

#include "src/engine/identity.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/receivers/event_stream.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/targets.hpp"
#include "src/http/target.hpp"
#include "src/rdf/words.hpp"

namespace lrt::engine {

namespace {

constexpr std::array<std::string_view, 7> known_methods = {"GET", "HEAD", "OPTIONS", "PUT", "POST", "DELETE", "PATCH"};

}  // namespace

/// Handles a request: from its bytes to the resource that it names.
class LRT_LOCAL Engine::Impl {
 public:
  explicit Impl(EngineOptions options) : parts(std::move(options)), targets(parts) {
    parts.bodies.set_continue([this](Ticket ticket, Context& context) { continue_request(ticket, context); });
  }

  HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, const Result<Caller>& caller, TimePoint now);
  bool is_stop(const http::Request& request) const;
  Result<Caller> authorize(const http::Request& request) const;
  Outcome handle(const http::Request& request, const Result<Caller>& caller, TimePoint now);
  Result<void> add(std::vector<Thing> things);
  /// @param handles  nullptr: those of any thing
  Result<void> remove(std::string_view path, const model::HandleContext* handles = nullptr);
  void remove_with_children(ThingNode& thing);
  void listens_on(std::string_view address, std::uint16_t port, bool secure, std::string_view name, Upgrades upgrades);
  /// Runs the messages of other threads.
  void take_messages(TimePoint now);

  Parts parts;
  const Targets targets;
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
  bool is_login(const http::Request& request, const http::Target& target) const;
  bool takes_queries(const http::Request& request, const http::Target& target) const;
  void forget_base(std::size_t base);
  bool is_allowed(const Context& context) const;
  std::size_t max_body_bytes(const Context& context) const;
  http::Response method_not_allowed(const Context& context) const;
  http::Response internal_error(const Context& context) const noexcept;
};

HeaderVerdict Engine::Impl::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, const Result<Caller>& caller,
                                         TimePoint now) {
  Context context(request, now);
  HeaderVerdict verdict;
  verdict.response = judge(context, [&]() -> std::optional<http::Response> {
    if (auto response = find(context, caller)) return response;
    if (!context.resource) return std::nullopt;  // the target is *
    verdict.max_body_bytes = max_body_bytes(context);
    verdict.ignores_body = context.resource->kind().is(Trait::stop);
    return refused_body(context, body_bytes);
  });
  if (!verdict.response) verdict.judged = judged_caller(*caller, context.rights_revision);
  return verdict;
}

bool Engine::Impl::is_stop(const http::Request& request) const {
  if (request.method != "POST") return false;
  const auto target = http::split_target(request.target);
  if (!target) return false;
  Context context(request, {});
  return !targets.find(context, *target) && context.resource->kind().is(Trait::stop);
}

Result<Caller> Engine::Impl::authorize(const http::Request& request) const {
  const Authentication& find = parts.options.authorize;
  return find || request.judged ? caller_of(request, find) : Caller();
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
    if (const auto target = http::split_target(context.request().target)) (void)targets.find(context, *target);
    http::Response response = parts.responses.stopping(context);
    parts.cors.add_fields(context.request(), response);
    return response;
  } catch (const std::exception& e) {
    parts.pending.abandon_from(first);
    parts.responses.log(LogLevel::error, "internal error in a request", e);
    return internal_error(context);
  }
}

/// Without its text and fields if there is no memory for them.
http::Response Engine::Impl::internal_error(const Context& context) const noexcept {
  try {
    http::Response response = parts.responses.problem(context, 500, "internal server error");
    parts.cors.add_fields(context.request(), response);
    return response;
  } catch (...) {
    http::Response bare;
    bare.status = 500;
    return bare;
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
  context.base_hold = parts.bases.hold(*base);
  for (const std::size_t replaced : parts.bases.take_replaced()) forget_base(replaced);
  context.posts_query = takes_queries(request, *target);
  if (auto response = parts.cors.preflight(request, context.posts_query)) return response;
  if (caller && is_login(request, *target))
    if (auto response = parts.access.refused_login(context, *caller)) return response;
  if (auto response = parts.access.denied(context, caller)) return response;
  context.client = caller->client;
  context.by_cookie = caller->by_cookie;
  context.audience = {caller->view, caller->principal};
  context.rights_revision = std::min(caller->rights_revision, parts.rights.number());
  const bool known = std::find(known_methods.begin(), known_methods.end(), request.method) != known_methods.end();
  if (known && target->path == "*") return std::nullopt;
  auto not_found = targets.find(context, *target);
  if (auto response = parts.access.refused_right(context, *caller)) return response;
  if (!known) return parts.responses.problem(context, 501, "unknown method \"" + std::string(request.method) + "\"");
  return not_found;
}

bool Engine::Impl::is_login(const http::Request& request, const http::Target& target) const {
  return parts.session && request.method == "POST" && targets.resource_at(target.path).value_or(nullptr) == &*parts.session;
}

/// Only requests of web pages depend on it.
bool Engine::Impl::takes_queries(const http::Request& request, const http::Target& target) const {
  if (!request.find("Origin") || (request.method != "POST" && request.method != "OPTIONS")) return false;
  const Resource* const resource = targets.resource_at(target.path).value_or(nullptr);
  return resource && resource->kind().is(Trait::query);
}

/// A number of Bases stands for another base now.
void Engine::Impl::forget_base(std::size_t base) {
  parts.cache.forget_base(base);
  const auto forget = [&](ThinVector<CompiledShapes>& known) {
    for (const CompiledShapes& one : known)
      if (one.base == base) return known.clear();
  };
  for (const auto& [path, thing] : parts.registry.things()) {
    forget(thing->compiled_shapes);
    forget(thing->kind->compiled_shapes);
    if (thing->bounds) forget(thing->bounds->compiled_shapes);
  }
}

bool Engine::Impl::is_allowed(const Context& context) const {
  const std::string_view method = context.request().method;
  Methods allowed = context.resource->methods();
  if (method == "PUT" && allowed.put && context.audience.is_restricted() && context.resource->graph_store())
    allowed.put = context.audience.methods(*context.resource).put;  // as far as graphs that it sees take it
  return context.is_safe() || (method == "PUT" && allowed.put) || (method == "POST" && allowed.post) || (method == "DELETE" && allowed.remove) ||
         (method == "PATCH" && allowed.patch);
}

/// Without a method that is allowed there is no limit, because the response is 405.
std::size_t Engine::Impl::max_body_bytes(const Context& context) const {
  if (!is_allowed(context)) return std::numeric_limits<std::size_t>::max();
  if (const GraphStore* const store = context.audience.is_restricted() && context.has_input() ? context.resource->graph_store() : nullptr)
    return store->max_put_bytes(context.audience).value_or(parts.options.max_scalar_body_bytes);
  if (context.has_input()) return context.resource->input(parts.options).max_bytes;
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
  if (context.resource->kind().is(Trait::about_caller)) return too_large(context, body_bytes.value_or(0));
  if (context.resource->own_protocol()) {
  } else if (method == "GET" || method == "HEAD") {
    if (!parts.subscription_requests.requested_protocol(context))
      if (auto response = parts.representations.unacceptable(context)) return response;
  } else if (context.has_input() && !context.resource->kind().is(Trait::stop)) {
    // A chunked body may be empty.
    const Input input = context.resource->input(parts.options);
    if (body_bytes || (!input.may_be_empty && context.request().find("Content-Type"))) {
      auto format = parts.bodies.format_of(context, input.type, false);
      if (auto* response = std::get_if<http::Response>(&format)) return std::move(*response);
    }
  }
  if (auto response = too_large(context, body_bytes.value_or(0))) return response;
  if (auto response = parts.rules.judge(context)) return response;
  return context.is_safe() ? std::nullopt : failed_known_precondition(context);
}

/// Evaluates If-Match and If-None-Match if that needs no user code. They are evaluated again when the body is complete.
std::optional<http::Response> Engine::Impl::failed_known_precondition(const Context& context) {
  const http::Request& request = context.request();
  if (!request.find("If-Match") && !request.find("If-None-Match")) return std::nullopt;
  if (const ValueResource* const values = context.resource->values()) {
    values->for_each_property([this](PropertyResource& property) { parts.values.take_published(property); });
    if (!values->is_up_to_date()) return std::nullopt;
  }
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
    OwnProtocol* const own = resource.own_protocol();
    if (const auto protocol = parts.subscription_requests.requested_protocol(context))
      return own ? own->subscribe(context, parts, *protocol) : parts.subscriptions.subscribe(context, *protocol);
    if (own)
      if (std::optional<Outcome> outcome = own->get(context, parts)) return *std::move(outcome);
    return parts.representations.get(context);
  }
  if (method == "OPTIONS") return parts.representations.options(context);
  if (!is_allowed(context)) return method_not_allowed(context);
  // A graph of a World may be written already; its write was judged just before.
  const bool may_be_done = context.judged && resource.thing && resource.thing->spec->world;
  if (!may_be_done)
    if (auto response = parts.rules.judge(context)) return *std::move(response);
  if (method == "PUT") return resource.put(context, parts);
  if (method == "POST") return resource.post(context, parts);
  if (method == "DELETE") return resource.remove(context, parts);
  return resource.patch(context, parts);
}

/// Continues a deferred request after its body was validated.
void Engine::Impl::continue_request(Ticket ticket, Context& kept) {
  Context context = kept;
  kept.judged = nullptr;
  Outcome outcome;
  try {
    outcome = context.resource ? dispatch(context) : parts.responses.gone(context);
  } catch (const std::exception& e) {
    parts.responses.log(LogLevel::error, "internal error in a request", e);
    outcome = internal_error(context);
  }
  if (auto* response = std::get_if<http::Response>(&outcome)) parts.pending.respond(ticket, std::move(*response));
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
  if (parts.stops) parts.stops->report(added);
  parts.saved.resume();
  // Observers of the structure are notified in the transport's next turn.
  if (!parts.subscriptions.empty()) parts.calls.inbox()->put([](TimePoint) {});
  return {};
}

Result<void> Engine::Impl::remove(std::string_view path, const model::HandleContext* handles) {
  parts.discarded.clear();
  const Result<std::string> encoded = model::encode_path_from_root(path);
  ThingNode* thing = encoded ? parts.registry.find_thing("/" + *encoded) : nullptr;
  if (!thing || (handles && thing->spec->handles.get() != handles))
    return unexpected(Errc::unknown_path, "no thing at \"" + std::string(path) + "\"");
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
Result<void> Engine::remove(std::string_view path, const model::HandleContext& handles) { return impl_->remove(path, &handles); }

void Engine::listens_on(std::string_view address, std::uint16_t port, bool secure, std::string_view name, Upgrades upgrades) {
  impl_->listens_on(address, port, secure, name, upgrades);
}

void Engine::set_waker(std::shared_ptr<Waker> waker) {
  impl_->parts.scanner.wake_signal()->set_waker(waker);
  impl_->parts.calls.inbox()->set_waker(std::move(waker));
}

HeaderVerdict Engine::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint now) {
  return impl_->judge_header(request, body_bytes, impl_->authorize(request), now);
}

HeaderVerdict Engine::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, const Result<Caller>& caller,
                                   TimePoint now) {
  return impl_->judge_header(request, body_bytes, caller, now);
}

bool Engine::is_stop(const http::Request& request) noexcept {
  return guarded<bool>([&]() -> Result<bool> { return impl_->is_stop(request); }).value_or(false);
}

Outcome Engine::handle(const http::Request& request, TimePoint now) { return impl_->handle(request, impl_->authorize(request), now); }
Outcome Engine::handle(const http::Request& request, const Result<Caller>& caller, TimePoint now) { return impl_->handle(request, caller, now); }

std::optional<Reply> Engine::next_reply(TimePoint now) {
  Parts& parts = impl_->parts;
  try {
    impl_->take_messages(now);
    parts.pending.expire(now);
    parts.invocations.expire(now);
    while (const auto id = parts.leases.take_due(now.steady)) static_cast<ControlBase*>(parts.registry.find(*id))->expire(now, parts.leases);
    if (parts.stops && !impl_->stopped) parts.stops->advance(now);
    if (parts.queries && !impl_->stopped) parts.queries->advance(now);
  } catch (const std::exception& e) { parts.responses.log(LogLevel::error, "internal error while making a response", e); }
  return parts.pending.take_reply();
}

std::optional<std::chrono::steady_clock::time_point> Engine::next_deadline() const {
  const Parts& parts = impl_->parts;
  if (!parts.calls.inbox()->empty()) return std::chrono::steady_clock::time_point{};  // guest engines check deadlines themselves
  auto first = parts.pending.next_deadline();
  const auto of_queries = parts.queries ? parts.queries->next_deadline() : std::nullopt;
  const auto of_stops = parts.stops ? parts.stops->next_deadline() : std::nullopt;
  for (const auto& other : {parts.invocations.next_deadline(), parts.leases.next(), parts.subscriptions.next_deadline(),
                            parts.scanner.next_deadline(), of_queries, of_stops})
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
  const EngineOptions& options = impl_->parts.options;
  const std::pair<const char*, bool> negative[] = {{"limits.host_timeout", options.host_timeout.count() < 0},
                                                   {"limits.max_wait", options.max_wait.count() < 0},
                                                   {"limits.retry_after", options.retry_after.count() < 0},
                                                   {"subscriptions.sample_period", options.subscriptions.sample_period.count() < 0}};
  for (const auto& [name, is_negative] : negative)
    if (is_negative) return unexpected(Errc::invalid_option, std::string(name) + ": expected at least 0, found a negative time");
  if (Result<void> checked = rdf::check_words({impl_->parts.options.title, impl_->parts.options.description}, "server"); !checked) return checked;
  if (Result<void> checked = engine::check(options.identity); !checked) return checked;
  if (Result<void> checked = impl_->parts.cors.check(); !checked) return checked;
  if (const auto& queries = impl_->parts.queries)
    if (Result<void> checked = queries->check_options(); !checked) return checked;
  return impl_->parts.subscriptions.check_options();
}
std::optional<subscription::Notification> Engine::next_notification(Channel channel, TimePoint now) {
  return impl_->stopped ? std::nullopt : impl_->parts.subscriptions.next_notification(channel, now);
}
void Engine::delivered(Channel channel, const subscription::DeliveryResult& result, TimePoint now) {
  impl_->parts.subscriptions.delivered(channel, result, now);
}
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
std::vector<ObservableResource> Engine::observable_resources() const { return impl_->parts.observable_resources(); }
void Engine::follow_resources(bool follow) { impl_->parts.registry.follow(follow); }
std::uint64_t Engine::structure() const noexcept { return impl_->parts.registry.structure(); }
std::string Engine::base() const { return impl_->parts.bases[0]; }

void Engine::renew_rights() {
  impl_->parts.kinds.renew(impl_->parts.view);
  impl_->parts.subscriptions.renew_rights();
}
void Engine::sign_out(std::string_view principal) {
  impl_->parts.subscriptions.sign_out(principal);
  impl_->parts.saved.sign_out(principal);
}
std::uint64_t Engine::rights_revision() const noexcept { return impl_->parts.rights.number(); }

Lapses& Engine::lapses() const noexcept { return *impl_->parts.lapses; }
bool Engine::take_outputs(Outputs& outputs) { return impl_->parts.take(outputs); }
EngineCounts Engine::counts() const {
  EngineCounts counts = impl_->parts.subscriptions.counts();
  counts.waiting_requests = impl_->parts.pending.size();
  counts.waiting_calls = impl_->parts.calls.open();
  if (impl_->parts.queries) impl_->parts.queries->count(counts);
  return counts;
}

std::string Engine::robot_time(TimePoint now) const { return impl_->parts.run_time.at(now.steady).text(); }
const http::Fields* Engine::common_fields(TimePoint now) { return &impl_->parts.stamped_fields.at(now); }

void Engine::stop() {
  impl_->stopped = true;
  const Parts& parts = impl_->parts;
  impl_->parts.invocations.stop();
  impl_->parts.saves.stop();
  if (impl_->parts.queries) impl_->parts.queries->stop();
  impl_->parts.pending.end_all([&](Context& context) { return parts.responses.stopping(context); }, parts.clock.now());
}

}  // namespace lrt::engine
