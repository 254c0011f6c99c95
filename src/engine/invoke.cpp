#include <algorithm>
#include <cmath>

#include <lrt/http/head.hpp>

#include "src/engine/impl.hpp"

namespace lrt::engine {

void InvocationCore::finish(Result<rdf::Value> result) noexcept {
  if (!result && result.error().code == Errc::dropped) {
    std::uint8_t expected = starting;
    if (phase_.compare_exchange_strong(expected, dropped, std::memory_order_acq_rel)) return;  // start_ended() decides
  }
  if (finished_.exchange(true, std::memory_order_acq_rel)) return;
  try {
    {
      const std::lock_guard lock(mutex_);
      hook_ = {};
    }
    door_->put([path = path_, result = std::move(result)](Engine::Impl& engine, TimePoint now) mutable {
      engine.invocation_finished(path, std::move(result), now);
    });
  } catch (...) {  // out of memory: the invocation stays as it is and can still be cancelled
    finished_.store(false, std::memory_order_release);
  }
}

void InvocationCore::start_ended(Result<void> result) noexcept {
  const bool was_dropped = phase_.exchange(idle, std::memory_order_acq_rel) == dropped;
  if (!result) finish(Unexpected{std::move(result).error()});
  else if (was_dropped) finish(unexpected(Errc::dropped, "the responder was destroyed before succeed() or fail()"));
}

void InvocationCore::progress(double fraction) noexcept {
  if (std::isnan(fraction)) return;
  fraction_.store(std::clamp(fraction, 0.0, 1.0), std::memory_order_seq_cst);
  signal();
}

void InvocationCore::on_cancel(UniqueFunction<void()> hook) {
  {
    const std::lock_guard lock(mutex_);
    if (!cancelled()) {
      hook_ = std::move(hook);
      return;
    }
  }
  hook();
}

UniqueFunction<void()> InvocationCore::cancel() noexcept {
  finished_.store(true, std::memory_order_release);
  const std::lock_guard lock(mutex_);
  cancelled_.store(true, std::memory_order_release);
  return std::move(hook_);
}

InvocationResource* Engine::Impl::find_invocation(const std::string& path) {
  Resource* resource = find(path);
  return resource && resource->kind == Kind::invocation ? static_cast<InvocationResource*>(resource) : nullptr;
}

Outcome Engine::Impl::post_action(Context& context) {
  auto& action = static_cast<ActionResource&>(*context.resource);
  rdf::Value input;
  if (action.spec->input) {
    auto read = read_value(context, *action.spec->input, action.spec->input_facets);
    if (auto* answer = std::get_if<http::Response>(&read)) return std::move(*answer);
    input = std::move(std::get<rdf::Value>(read));
  } else {
    // SPEC 3.1: no input takes an empty body; any RDF is covered by no constraint and ignored.
    static const rdf::Type nothing = [] {
      rdf::Type type;
      type.kind = rdf::Type::Kind::record;
      return type;
    }();
    auto read = read_body(context, &nothing);
    if (auto* answer = std::get_if<http::Response>(&read)) return std::move(*answer);
  }
  if (auto answer = precondition(context)) return *std::move(answer);

  if (too_many_jobs()) return robot_is_busy(context);
  const bool busy = action.active > 0 || !action.queue.empty();
  bool wait_in_queue = false;
  const auto too_many = [&](const char* what) {
    http::Response response = problem(context, 429, what);
    response.fields.set("Retry-After", std::to_string(options_.retry_after.count()));
    return response;
  };
  switch (action.spec->policy.kind) {
    case ActionPolicy::Kind::reject:
      if (busy) return problem(context, 409, "an invocation of this action is under way, and its policy is to reject another");
      break;
    case ActionPolicy::Kind::parallel:
      if (action.active >= action.spec->policy.limit) return too_many("as many invocations as this action's policy allows are under way");
      break;
    case ActionPolicy::Kind::queue:
      wait_in_queue = busy;
      if (busy && action.queue.size() >= action.spec->policy.limit) return too_many("the queue of this action is full");
      break;
    case ActionPolicy::Kind::preempt: break;
  }

  const http::Preferences& preferences = context.preferences;
  const bool wait_for_end = preferences.wait ? preferences.wait->count() > 0 : !action.spec->asynchronous && !preferences.respond_async;
  Ticket ticket{};
  Outcome outcome = http::Response{};
  if (wait_for_end) {
    const auto most = preferences.wait ? std::chrono::milliseconds(std::min(*preferences.wait, options_.longest_wait)) : options_.host_time;
    outcome = defer(context, most, ticket);
    if (!find_waiting(ticket)) return outcome;
  }

  if (action.spec->policy.kind == ActionPolicy::Kind::preempt) {
    std::vector<InvocationResource*> older;
    for (const auto& i : action.invocations)
      if (!i->finished()) older.push_back(i.get());
    for (InvocationResource* i : older) cancel(*i, context.now);
  }

  auto made = std::make_unique<InvocationResource>(action.path + "/" + options_.ids->next(), action.thing, &action);
  InvocationResource& invocation = *made;
  invocation.core = std::make_shared<InvocationCore>(door_, invocation.path, where(*action.thing));
  invocation.core->attach(wake_signal_);
  invocation.input = std::move(input);
  invocation.created = context.now.utc;
  action.invocations.push_back(std::move(made));
  take_path(invocation);
  changed(action);
  if (wait_in_queue) {
    action.queue.push_back(&invocation);
  } else {
    launch(invocation, context.now);
  }

  if (wait_for_end) {
    Waiting* waiting = find_waiting(ticket);
    waiting->invocation = invocation.path;
    waiting->may_take_long = preferences.wait.has_value();
    invocation.waiting.push_back(ticket);
    return outcome;
  }
  if (preferences.respond_async || preferences.wait) return accepted(context, invocation);
  if (preferences.return_ == http::Preferences::Return::representation) return invocation_answer(context, invocation);
  http::Response response = no_content(context);
  response.fields.add("Location", iri_of(context, invocation.path));
  return response;
}

/// 202: the invocation goes on, its resource tells how.
http::Response Engine::Impl::accepted(const Context& context, InvocationResource& invocation) {
  http::Response response;
  if (context.preferences.return_ == http::Preferences::Return::representation) {
    response = invocation_answer(context, invocation);
  } else {
    response = no_content(context);
    response.fields.add("Location", iri_of(context, invocation.path));
  }
  response.status = 202;
  if (context.preferences.respond_async) response.fields.add("Preference-Applied", "respond-async");
  else if (context.preferences.wait) response.fields.add("Preference-Applied", "wait=" + std::to_string(context.preferences.wait->count()));
  return response;
}

/// Hands the invocation to where the thing's lambdas run. If nobody takes it up in time it fails: a robot must not carry out commands
/// of long ago once its program goes on.
void Engine::Impl::launch(InvocationResource& invocation, TimePoint now) {
  ActionResource& action = *invocation.action;
  ++action.active;
  invocation.start_timer = start_timers_.emplace(now.steady + options_.host_time, invocation.path);
  invocation.claim = std::make_shared<Claim>();
  add_job(where(*action.thing), [door = door_, spec = action.spec, core = invocation.core, claim = invocation.claim,
                                 path = invocation.path, input = invocation.input]() mutable {
    if (!claim->take()) return;
    door->put([path](Engine::Impl& engine, TimePoint at) { engine.invocation_started(path, at); });
    core->start_begins();
    core->start_ended(guarded<void>([&]() -> Result<void> {
      spec->start(input, core);
      return {};
    }));
  });
}

void Engine::Impl::invocation_started(const std::string& path, TimePoint now) {
  InvocationResource* invocation = find_invocation(path);
  if (!invocation || invocation->status != Status::pending) return;
  forget_start_timer(*invocation);
  invocation->status = Status::running;
  invocation->started = now.utc;
  changed(*invocation);
}

void Engine::Impl::invocation_finished(const std::string& path, Result<rdf::Value> result, TimePoint now) {
  InvocationResource* invocation = find_invocation(path);
  if (!invocation || invocation->finished()) return;
  invocation->status = result ? Status::succeeded : Status::failed;
  if (result) invocation->progress = 1;
  else invocation->progress = invocation->core->fraction();
  if (!result) log(LogLevel::info, path + " failed: " + result.error().message);
  invocation->result = std::move(result);
  ended(*invocation, now);
}

void Engine::Impl::cancel(InvocationResource& invocation, TimePoint now) {
  ActionResource& action = *invocation.action;
  const auto queued = std::find(action.queue.begin(), action.queue.end(), &invocation);
  if (queued != action.queue.end()) action.queue.erase(queued);
  if (invocation.claim) invocation.claim->call_off();
  if (auto hook = invocation.core->cancel()) run_hook(where(*action.thing), std::move(hook));
  invocation.progress = invocation.core->fraction();
  invocation.status = Status::cancelled;
  invocation.result = unexpected(Errc::cancelled, "the invocation was cancelled");
  ended(invocation, now);
}

/// Nobody took it up in time, and now nobody may.
void Engine::Impl::never_begun(InvocationResource& invocation, TimePoint now) {
  ActionResource& action = *invocation.action;
  const auto queued = std::find(action.queue.begin(), action.queue.end(), &invocation);
  if (queued != action.queue.end()) action.queue.erase(queued);
  (void)invocation.core->cancel();
  for (const Ticket ticket : std::exchange(invocation.waiting, {})) {
    const Waiting* waiting = find_waiting(ticket);
    if (!waiting) continue;
    const http::Request request = waiting->request.view();
    reply(ticket, too_late(resumed(request, now, &action)));
  }
  invocation.result = unexpected(Errc::timed_out, "the robot's program did not begin in time");
  invocation.status = Status::failed;
  ended(invocation, now);
}

/// The status is final: tells who waits, and lets the next one begin.
void Engine::Impl::ended(InvocationResource& invocation, TimePoint now) {
  ActionResource& action = *invocation.action;
  invocation.ended = now.utc;
  changed(invocation);
  if (invocation.claim) --action.active;
  for (const Ticket ticket : std::exchange(invocation.waiting, {})) {
    const Waiting* waiting = find_waiting(ticket);
    if (!waiting) continue;
    const http::Request request = waiting->request.view();
    const Context context = resumed(request, now, &action);
    reply(ticket, invocation_answer(context, invocation));
  }
  forget_start_timer(invocation);
  next_in_queue(action, now);
  prune(action);
}

void Engine::Impl::next_in_queue(ActionResource& action, TimePoint now) {
  if (action.queue.empty() || action.active > 0) return;
  InvocationResource* next = action.queue.front();
  action.queue.pop_front();
  launch(*next, now);
}

void Engine::Impl::forget_start_timer(InvocationResource& invocation) {
  if (invocation.start_timer) start_timers_.erase(*invocation.start_timer);
  invocation.start_timer.reset();
}

void Engine::Impl::prune(ActionResource& action) {
  std::size_t finished = 0;
  for (const auto& i : action.invocations) finished += i->finished();
  for (auto at = action.invocations.begin(); at != action.invocations.end() && finished > options_.finished_invocations;) {
    if (!(*at)->finished()) {
      ++at;
      continue;
    }
    drop_path(**at);
    at = action.invocations.erase(at);
    --finished;
    changed(action);
  }
}

/// What a POST is answered once its invocation has ended, or with `return=representation` at once.
http::Response Engine::Impl::invocation_answer(const Context& context, InvocationResource& invocation) {
  const std::string location = iri_of(context, invocation.path);
  http::Response response;
  if (context.preferences.return_ == http::Preferences::Return::representation) {
    rdf::Graph graph;
    describe_invocation(graph, invocation, bases_[context.base]);
    const Said said = said_by(invocation);
    response = with_graph(context, 200, graph, &said);
    response.fields.add("Content-Location", location);
    response.fields.add("Preference-Applied", "return=representation");
  } else if (invocation.status == Status::failed || invocation.status == Status::cancelled) {
    response = invocation.status == Status::cancelled
                   ? problem(context, 409, "the invocation was cancelled before it ended")
                   : refused(context, "action \"" + invocation.action->path + "\" failed", invocation.result.error());
    http::LinkWriter links;
    links.add(location, "related");
    links.finish(response.fields, {});
    return response;
  } else if (invocation.action->spec->output && invocation.result && !invocation.result->is_null() &&
             context.preferences.return_ != http::Preferences::Return::minimal) {
    rdf::Graph graph;
    const rdf::TermId focus = graph.intern(rdf::iri(location + "#result"));
    const Said said{invocation.action->spec->output, &invocation.action->spec->output_facets, &*invocation.result};
    rdf::write_value(graph, focus, *said.type, *said.facets, said.value(), names_base(*invocation.thing, bases_[context.base]));
    response = with_graph(context, 200, graph, &said);
  } else {
    response = no_content(context);
  }
  response.fields.add("Location", location);
  if (context.preferences.wait && invocation.finished())
    response.fields.add("Preference-Applied", "wait=" + std::to_string(context.preferences.wait->count()));
  return response;
}

Outcome Engine::Impl::delete_invocation(Context& context) {
  auto& invocation = static_cast<InvocationResource&>(*context.resource);
  (void)sync(invocation);
  if (auto answer = precondition(context)) return *std::move(answer);
  http::Response response = no_content(context);  // now: what follows may end the invocation's life
  if (!invocation.finished()) {
    cancel(invocation, context.now);
    return response;
  }
  ActionResource& action = *invocation.action;
  drop_path(invocation);
  action.invocations.remove_if([&](const auto& i) { return i.get() == &invocation; });
  changed(action);
  return response;
}

}  // namespace lrt::engine
