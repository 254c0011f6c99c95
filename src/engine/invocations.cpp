// SPDX-License-Identifier: Apache-2.0
#include "src/engine/invocations.hpp"

#include <algorithm>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/ids.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/engine/resources/thing.hpp"
#include "src/rdf/value_faults.hpp"

namespace lrt::engine {

namespace {

/// The response while the action is not available; nullopt: it is available.
std::optional<Error> unavailable(const model::ActionSpec& action) {
  const char* reason = action.availability.reason();
  if (!reason) return std::nullopt;
  return Error{Errc::refused, std::string("not available now: ") + reason};
}

/// Why an invocation ended without a result. It ends also if there is no memory for the text.
template <class Text>
Result<rdf::Value> no_result(Errc code, Text text) noexcept {
  try {
    return unexpected(code, text());
  } catch (...) { return unexpected(code, "out of memory"); }
}

}  // namespace

Outcome Invocations::invoke(ActionResource& action, Context& context) {
  if (const auto error = unavailable(*action.spec)) return responses_.problem(context, 409, "action \"" + action.path + "\" is " + error->message);
  const bool is_stop = action.spec->stop;
  rdf::Value input;
  if (is_stop) {  // its body is ignored
  } else if (action.spec->input) {
    auto read = bodies_.read_value(context, *action.spec->input, action.spec->facets, action.spec);
    if (auto outcome = outcome_of(read)) return *std::move(outcome);
    input = std::move(std::get<Body>(read).value);
  } else {
    auto read = bodies_.read_nothing(context);
    if (auto outcome = outcome_of(read)) return *std::move(outcome);
  }
  if (auto response = representations_.failed_precondition(context)) return *std::move(response);
  const Dispatch where = action.thing->where(*action.spec);
  if (is_stop) cancel_oldest(action, context.now);
  else if (calls_.overloaded(where)) return responses_.overloaded(context);
  else if (auto response = refused_by_policy(action, context)) return *std::move(response);
  else if (auto refused = refused_client(action, context)) return *std::move(refused);

  const http::Preferences& preferences = context.preferences();
  const bool must_queue = action.spec->policy.kind == ActionPolicy::Kind::queue && (action.active > 0 || !action.queue.empty());
  const bool until_end = preferences.wait || !action.spec->asynchronous;
  const bool waits = preferences.wait ? preferences.wait->count() > 0 : !preferences.respond_async && (until_end || !must_queue);
  const std::string path = action.path + "/" + options_.ids->next();
  auto made = std::make_unique<InvocationResource>(path, action);
  InvocationResource& invocation = *made;
  if (!registry_.add(invocation)) return responses_.problem(context, 500, "the id source returned the same id twice");
  struct Undo {
    Registry& registry;
    std::unique_ptr<InvocationResource>& made;
    ~Undo() {
      if (made) registry.remove(*made);
    }
  } const undo{registry_, made};  // unless the action takes it
  std::optional<Ticket> ticket;
  if (waits) {
    const auto max_time = preferences.wait ? std::chrono::milliseconds(std::min(*preferences.wait, options_.max_wait)) : options_.host_timeout;
    const auto on_timeout = [this, id = invocation.id, may_take_long = preferences.wait.has_value()](Ticket late, Context& c, bool) {
      wait_is_over(late, c, id, may_take_long);
    };
    ticket = is_stop ? pending_.defer_stop(context, max_time, on_timeout) : pending_.defer(context, max_time, on_timeout, where);
    if (!ticket) return responses_.overloaded(context);
    if (context.expiry.valid_until && !preferences.wait) pending_.answer_by(*ticket, *context.expiry.valid_until);
    invocation.waiting.push_back({*ticket, until_end});
  }
  if (action.spec->policy.kind == ActionPolicy::Kind::preempt) {
    std::vector<InvocationResource*> older;
    for (const auto& i : action.invocations)
      if (!i->finished()) older.push_back(i.get());
    for (InvocationResource* i : older) cancel(*i, context.now);
  }
  invocation.control = std::make_shared<InvocationControl>(calls_.inbox(), [this, ref = Ref(invocation)](Result<rdf::Value> result, TimePoint now) {
    if (InvocationResource* i = registry_.find(ref)) finished(*i, std::move(result), now);
  });
  invocation.control->attach(scanner_.wake_signal());
  invocation.input = std::move(input);
  invocation.check = rules_.judge_before_call(context);
  if (invocation.check && (!waits || must_queue)) invocation.check->expiry().accept();
  if (!is_stop) invocation.share = clients_.take(context.client);
  invocation.created = context.now.utc;
  action.invocations.push_back(std::move(made));
  action.mark_invocation_changed(invocation.path);
  if (is_stop && stops_) stops_->sent(action, context);
  if (!must_queue) launch_or_end(invocation, context.now);
  else try {
      wait_in_queue(invocation);
    } catch (const std::exception& e) {
      leave_queue(invocation);
      finished(invocation, Unexpected{thrown(e.what())}, context.now);
    }

  if (ticket) return Deferred{*ticket};
  return accepted(context, invocation);
}

/// Reserves one of the places that the policy of a stop allows.
void Invocations::cancel_oldest(ActionResource& action, TimePoint now) {
  while (action.active >= action.spec->policy.limit) {
    const auto oldest = std::find_if(action.invocations.begin(), action.invocations.end(), [](const auto& i) { return !i->finished(); });
    if (oldest == action.invocations.end()) return;
    cancel(**oldest, now);
  }
}

std::optional<http::Response> Invocations::refused_by_policy(const ActionResource& action, const Context& context) const {
  const bool busy = action.active > 0 || !action.queue.empty();
  const auto too_many = [&](const char* what) {
    http::Response response = responses_.problem(context, 429, what);
    responses_.add_retry_after(response);
    return response;
  };
  const ActionPolicy& policy = action.spec->policy;
  switch (policy.kind) {
    case ActionPolicy::Kind::reject:
      if (busy) return responses_.problem(context, 409, "an invocation of this action is running, and its policy rejects a second one");
      break;
    case ActionPolicy::Kind::parallel:
      if (action.active >= policy.limit) return too_many("the maximum number of invocations of this action is running");
      break;
    case ActionPolicy::Kind::queue:
      if (busy && action.queue.size() >= policy.limit) return too_many("the queue of this action is full");
      break;
    case ActionPolicy::Kind::preempt: break;
  }
  return std::nullopt;
}

/// An invocation that replaces another one is not counted again.
std::optional<http::Response> Invocations::refused_client(const ActionResource& action, const Context& context) const {
  const std::size_t max = options_.clients.max_invocations;
  if (context.client.empty() || max == 0 || clients_.of(context.client) < max) return std::nullopt;
  if (action.spec->policy.kind == ActionPolicy::Kind::preempt && action.active > 0) return std::nullopt;
  http::Response response = responses_.denied(context, http::Denial::invocations, 429,
                                              "this client has " + std::to_string(max) + " active invocations, which is the maximum per client");
  responses_.add_retry_after(response);
  return response;
}

void Invocations::wait_in_queue(InvocationResource& invocation) {
  invocation.action.queue.push_back(&invocation);
  if (const auto deadline = invocation.check ? invocation.check->expiry().deadline() : std::nullopt)
    start_deadlines_.set(invocation.start_deadline, *deadline, invocation.id);
}

/// The earlier of the host's deadline and that of the client.
void Invocations::set_start_deadline(InvocationResource& invocation) {
  auto first = invocation.host_deadline;
  if (const auto deadline = invocation.check ? invocation.check->expiry().deadline() : std::nullopt) first = std::min(first, *deadline);
  start_deadlines_.set(invocation.start_deadline, first, invocation.id);
}

/// An invocation that cannot be launched ends, so that those behind it begin.
void Invocations::launch_or_end(InvocationResource& invocation, TimePoint now) {
  try {
    launch(invocation, now);
  } catch (const std::exception& e) {
    if (invocation.token) invocation.token->cancel();
    finished(invocation, Unexpected{thrown(e.what())}, now);
  }
}

/// Calls the start lambda on the thread that its Dispatch names.
void Invocations::launch(InvocationResource& invocation, TimePoint now) {
  ActionResource& action = invocation.action;
  auto token = std::make_shared<CancelToken>();
  invocation.host_deadline = now.steady + options_.host_timeout;
  set_start_deadline(invocation);
  ++action.active;
  invocation.token = std::move(token);
  Inbox::Reserved begins = Inbox::reserve([this, ref = Ref(invocation)](TimePoint at) {
    if (InvocationResource* i = registry_.find(ref)) started(*i, at);
  });
  Inbox::Reserved returned = Inbox::reserve([this, ref = Ref(invocation)](TimePoint at) {
    if (InvocationResource* i = registry_.find(ref)) start_returned(*i, at);
  });
  Inbox::Reserved refused;
  if (invocation.check)
    refused = Inbox::reserve([this, ref = Ref(invocation), check = invocation.check](TimePoint at) {
      if (InvocationResource* i = registry_.find(ref)) never_begun(*i, check->refusal(), at);
    });
  calls_.run(
      action.thing->where(*action.spec),
      [inbox = calls_.inbox(), check = invocation.check, refused = std::move(refused), begins = std::move(begins), returned = std::move(returned),
       spec = action.spec, control = invocation.control, token = invocation.token,
       input = std::make_shared<const rdf::Value>(invocation.input)]() mutable {
        if (!token->take()) return;
        if (!passes(check)) return inbox->put(std::move(refused));
        Result<bool> offered = guarded<bool>([&]() -> Result<bool> {
          if (auto error = unavailable(*spec)) return Unexpected{*std::move(error)};
          return true;
        });
        if (!offered) return control->finish(Unexpected{std::move(offered).error()});
        inbox->put(std::move(begins));
        control->start_begins();
        control->start_ended(guarded<void>([&]() -> Result<void> {
          spec->start(*input, control);
          return {};
        }));
        inbox->put(std::move(returned));
      },
      action.spec->stop);
}

void Invocations::started(InvocationResource& invocation, TimePoint now) {
  if (invocation.status != Status::pending) return;
  start_deadlines_.clear(invocation.start_deadline);
  invocation.status = Status::running;
  invocation.started = now.utc;
  invocation.mark_changed();
}

/// The lambda has neither thrown nor refused the command, or the invocation would have ended.
void Invocations::start_returned(InvocationResource& invocation, TimePoint now) {
  auto& waiting = invocation.waiting;
  const auto first = std::stable_partition(waiting.begin(), waiting.end(), [](const WaitingRequest& w) { return w.until_end; });
  const std::vector<WaitingRequest> ready(first, waiting.end());
  waiting.erase(first, waiting.end());
  respond_to(ready, now, [&](const Context& context) { return response_for(context, invocation); });
}

template <class MakeResponse>
void Invocations::respond_to(const std::vector<WaitingRequest>& requests, TimePoint now, MakeResponse make) {
  for (const WaitingRequest& request : requests) try {
      if (const Context* context = pending_.resume(request.ticket, now)) pending_.respond(request.ticket, make(*context));
    } catch (const std::exception& e) {  // it gets its response at its time limit, and what follows is done
      responses_.log(LogLevel::error, "internal error while making a response", e);
    }
}

void Invocations::finished(InvocationResource& invocation, Result<rdf::Value> result, TimePoint now) {
  if (invocation.finished() || invocation.is_concluding) return;
  try {
    if (result && invocation.action.spec->output)
      if (const std::string fault = rdf::fault_of_value(*invocation.action.spec->output, *result); !fault.empty())
        result = unexpected(Errc::failed, "output: " + fault);
  } catch (const std::exception& e) { result = Unexpected{thrown(e.what())}; }
  invocation.result = std::move(result);
  if (!invocation.result || !invocation.action.spec->releases || !stops_) return conclude(invocation, now);
  invocation.is_concluding = true;
  try {
    stops_->released(invocation, now);
  } catch (...) {
    conclude_release(invocation, false, now);
    throw;
  }
}

void Invocations::conclude(InvocationResource& invocation, TimePoint now) {
  const Result<rdf::Value>& result = invocation.result;
  invocation.status = result ? Status::succeeded : Status::failed;
  invocation.progress = result ? 1 : invocation.control->fraction();
  try {
    if (!result) responses_.log(LogLevel::info, invocation.path + " failed: " + result.error().message);
  } catch (...) {}  // no memory
  ended(invocation, now);
}

void Invocations::conclude_release(InvocationResource& release, bool ends, TimePoint now) {
  if (release.finished()) return;
  if (ends) return conclude(release, now);
  respond_to(std::exchange(release.waiting, {}), now, [&](const Context& context) { return rules_.refused(context, Refusal::stopped); });
  release.result = no_result(Errc::refused, [] { return std::string("the robot says that it is still stopped"); });
  conclude(release, now);
}

/// Those in the queue first, so that none begins in place of one that has ended.
void Invocations::end_by_stop(ActionResource& action, TimePoint now) {
  std::vector<InvocationResource*> open;
  for (const auto& i : action.invocations)
    if (!i->finished()) open.push_back(i.get());
  std::stable_partition(open.begin(), open.end(), [](const InvocationResource* i) { return !i->token; });
  for (InvocationResource* i : open) end_by_stop(*i, now);
}

void Invocations::end_by_stop(InvocationResource& invocation, TimePoint now) {
  leave_queue(invocation);
  cancel_on_host(invocation);
  invocation.progress = invocation.control->fraction();
  invocation.status = Status::failed;
  invocation.result = no_result(Errc::refused, [] { return CommandRules::reason(Refusal::stopped); });
  respond_to(std::exchange(invocation.waiting, {}), now, [&](const Context& context) { return rules_.refused(context, Refusal::stopped); });
  ended(invocation, now);
}

/// The start lambda does not begin if it has not begun; else its on_cancel function runs.
void Invocations::cancel_on_host(InvocationResource& invocation) {
  if (invocation.token) invocation.token->cancel();
  auto hook = invocation.control->cancel();
  if (!hook) return;
  calls_.run(invocation.thing->where(*invocation.action.spec),
             [hook = std::move(hook)]() mutable { (void)guarded<void>([&]() -> Result<void> { return hook(), Result<void>(); }); });
}

void Invocations::cancel(InvocationResource& invocation, TimePoint now) {
  leave_queue(invocation);
  cancel_on_host(invocation);
  invocation.progress = invocation.control->fraction();
  invocation.status = Status::cancelled;
  invocation.result = no_result(Errc::cancelled, [] { return std::string("the invocation was cancelled"); });
  ended(invocation, now);
}

/// The host did not start it in time or a rule refuses it now, and it must not start later.
void Invocations::never_begun(InvocationResource& invocation, Refusal why, TimePoint now) {
  if (invocation.finished()) return;
  leave_queue(invocation);
  (void)invocation.control->cancel();
  respond_to(std::exchange(invocation.waiting, {}), now,
             [&](const Context& context) { return why == Refusal::none ? responses_.timed_out(context) : rules_.refused(context, why); });
  invocation.result = no_result(Errc::timed_out, [why] {
    return why == Refusal::none ? std::string("the robot's program did not start the action in time") : CommandRules::reason(why);
  });
  invocation.status = Status::failed;
  ended(invocation, now);
}

/// The status is final.
void Invocations::ended(InvocationResource& invocation, TimePoint now) {
  ActionResource& action = invocation.action;
  invocation.ended = now.utc;
  invocation.share.release();
  if (invocation.token) --action.active;
  start_deadlines_.clear(invocation.start_deadline);
  try {
    invocation.mark_changed();
  } catch (const std::bad_alloc&) {}  // those behind it begin all the same
  respond_to(std::exchange(invocation.waiting, {}), now, [&](const Context& context) { return response_for(context, invocation); });
  if (action.spec->stop && stops_) stops_->ended(action, now);
  launch_next(action, now);
  prune(action);
}

/// Called when the time limit of a request that waits for an invocation has passed.
void Invocations::wait_is_over(Ticket ticket, Context& context, ResourceId id, bool may_take_long) {
  auto* invocation = static_cast<InvocationResource*>(registry_.find(id));
  if (!invocation) return pending_.respond(ticket, responses_.timed_out(context));
  auto& waiting = invocation->waiting;
  waiting.erase(std::remove_if(waiting.begin(), waiting.end(), [&](const WaitingRequest& w) { return w.ticket == ticket; }), waiting.end());
  const bool is_late = context.expiry.is_late(context.now.steady);
  const bool is_queued = !invocation->token;
  // A call that the host has started continues, even if the engine has not been notified: 202, because it may still be refused.
  if (may_take_long || invocation->status == Status::running || (is_queued ? is_late : !invocation->token->cancel()))
    return pending_.respond(ticket, accept(*invocation) ? accepted(context, *invocation) : rules_.refused(context, Refusal::late));
  // It must not start later: the client is asked to retry, or it is late.
  const TimePoint now = context.now;
  const Refusal why = is_late ? Refusal::late : Refusal::none;
  try {
    pending_.respond(ticket, is_late ? rules_.refused(context, Refusal::late) : responses_.timed_out(context));  // the context is gone now
  } catch (...) {
    // There is no memory for the response. The invocation ends all the same, so that later ones can begin.
    never_begun(*invocation, why, now);
    throw;
  }
  never_begun(*invocation, why, now);
}

/// Its client is told that it was accepted, so it is not late any more. False: it was refused just before its lambda, of which a message is on its way.
bool Invocations::accept(InvocationResource& invocation) {
  if (!invocation.check) return true;
  if (!invocation.check->expiry().accept()) return false;
  if (invocation.token && invocation.status == Status::pending) set_start_deadline(invocation);
  return true;
}

void Invocations::expire(TimePoint now) {
  while (const auto id = start_deadlines_.take_due(now.steady)) {
    auto* invocation = static_cast<InvocationResource*>(registry_.find(*id));
    if (!invocation) continue;
    invocation->start_deadline.reset();
    const bool is_open = invocation->status == Status::pending && (!invocation->token || invocation->token->cancel());
    if (!is_open) continue;
    const auto late = invocation->check ? invocation->check->expiry().deadline() : std::nullopt;
    never_begun(*invocation, late && *late <= now.steady ? Refusal::late : Refusal::none, now);
  }
}

void Invocations::launch_next(ActionResource& action, TimePoint now) {
  if (action.queue.empty() || action.active > 0) return;
  InvocationResource* next = action.queue.front();
  action.queue.pop_front();
  launch_or_end(*next, now);
}

void Invocations::leave_queue(InvocationResource& invocation) {
  auto& queue = invocation.action.queue;
  queue.erase(std::remove(queue.begin(), queue.end(), &invocation), queue.end());
}

void Invocations::prune(ActionResource& action) {
  auto finished =
      static_cast<std::size_t>(std::count_if(action.invocations.begin(), action.invocations.end(), [](const auto& i) { return i->finished(); }));
  for (auto at = action.invocations.begin(); at != action.invocations.end() && finished > options_.max_finished_invocations;) {
    if (!(*at)->finished()) {
      ++at;
      continue;
    }
    registry_.remove(**at);
    const std::string path = (*at)->path;
    at = action.invocations.erase(at);
    --finished;
    action.mark_invocation_changed(path);
  }
}

http::Response Invocations::accepted(const Context& context, const InvocationResource& invocation) const {
  http::Response response;
  if (context.wants_representation()) {
    response = response_for(context, invocation);
  } else {
    response = responses_.no_content(context);
    response.fields.add("Location", responses_.iri(context, invocation.path));
  }
  response.status = 202;
  const http::Preferences& preferences = context.preferences();
  if (preferences.respond_async) response.fields.add("Preference-Applied", "respond-async");
  else if (preferences.wait) response.fields.add("Preference-Applied", "wait=" + std::to_string(preferences.wait->count()));
  return response;
}

http::Response Invocations::response_for(const Context& context, const InvocationResource& invocation) const {
  const std::string location = responses_.iri(context, invocation.path);
  const model::ActionSpec& spec = *invocation.action.spec;
  http::Response response;
  if (invocation.status == Status::failed || invocation.status == Status::cancelled) {
    response = invocation.status == Status::cancelled
                   ? responses_.problem(context, 409, "the invocation was cancelled before it ended")
                   : responses_.refused(context, "action \"" + invocation.action.path + "\" failed", invocation.result.error());
    http::LinkWriter links;
    links.add(location, "related");
    links.finish(response.fields, {});
    return response;
  }
  if (context.wants_representation()) {
    const rdf::Graph graph = representations_.describe(invocation, context.base, context.audience);
    const PlainValue value = *invocation.plain_value(context.audience);
    response = responses_.graph(context, 200, graph, &value);
    response.fields.add("Content-Location", location);
    response.fields.add("Preference-Applied", "return=representation");
  } else if (spec.output && invocation.result && !invocation.result->is_null() && !context.wants_minimal()) {
    rdf::Graph graph;
    const rdf::TermId focus = graph.intern(rdf::iri(location + "#result"));
    const PlainValue value{spec.output, &spec.output_facets, &*invocation.result};
    const std::string names = representations_.vocabulary(context.base);
    rdf::write_value(graph, focus, *value.type, *value.facets, value.value(), names);
    response = responses_.graph(context, 200, graph, &value);
  } else {
    response = responses_.no_content(context);
  }
  response.fields.add("Location", location);
  const auto& wait = context.preferences().wait;
  if (wait && invocation.finished()) response.fields.add("Preference-Applied", "wait=" + std::to_string(wait->count()));
  return response;
}

Outcome Invocations::remove(InvocationResource& invocation, Context& context) {
  invocation.refresh();
  if (auto response = representations_.failed_precondition(context)) return *std::move(response);
  http::Response response = responses_.no_content(context);  // before the next step, which may destroy the invocation
  if (!invocation.finished()) {
    cancel(invocation, context.now);
    return response;
  }
  ActionResource& action = invocation.action;
  registry_.remove(invocation);
  const std::string path = invocation.path;
  action.invocations.remove_if([&](const auto& i) { return i.get() == &invocation; });
  action.mark_invocation_changed(path);
  return response;
}

void Invocations::stop() {
  for (const auto& [path, thing] : registry_.things())
    for (const auto& action : thing->actions) {
      action->queue.clear();
      for (const auto& i : action->invocations)
        if (i->token) i->token->cancel();
    }
}

void Invocations::removed(ActionResource& action, TimePoint now) {
  for (const auto& i : action.invocations) {
    respond_to(std::exchange(i->waiting, {}), now, [&](const Context& context) { return responses_.gone(context); });
    start_deadlines_.clear(i->start_deadline);
    if (!i->finished()) cancel_on_host(*i);
    i->share.release();  // the invocation is destroyed later, without the engine's lock
    registry_.remove(*i);
  }
}

}  // namespace lrt::engine
