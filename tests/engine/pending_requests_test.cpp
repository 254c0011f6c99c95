// SPDX-License-Identifier: Apache-2.0
#include "src/engine/pending_requests.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/engine/representation_cache.hpp"
#include "src/engine/resources/documents.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;
using std::chrono::milliseconds;

namespace {

http::Response status(int number) {
  http::Response response;
  response.status = number;
  return response;
}

struct Pending {
  Pending() { registry.add(resource); }
  ~Pending() { registry.remove(resource); }
  std::optional<Ticket> defer(milliseconds max_time = milliseconds(100), Dispatch where = Dispatch::as_server) {
    RequestText request("GET /ns/lrt\nX-Mark: kept");
    Context context(request.get(), clock.now());
    context.resource = &resource;
    context.resource_id = resource.id;
    return pending.defer(
        context, max_time,
        [this](Ticket late, Context& c, bool runs) {
          mark = std::string(c.request().find("X-Mark").value_or("gone"));
          pending.respond(late, status(runs ? 202 : 503));
        },
        where);
  }
  std::vector<int> replies() {
    std::vector<int> all;
    while (auto reply = pending.take_reply()) all.push_back(reply->response.status);
    return all;
  }
  FakeClock clock;
  RepresentationCache cache{1000};
  Registry registry{cache};
  HostCalls calls{Dispatch::in_poll, 2};
  TermsResource resource;
  EngineOptions options;
  Cors cors{options};
  PendingRequests pending{registry, calls, cors, 3};
  std::string mark;
};

}  // namespace

TEST_CASE("a deferred request keeps its context, and is responded to once", "[engine][R0.6]") {
  Pending p;
  const Ticket ticket = *p.defer();
  REQUIRE(p.pending.is_pending(ticket));
  p.clock.advance(milliseconds(10));
  const Context* context = p.pending.resume(ticket, p.clock.now());
  REQUIRE(context);
  CHECK(context->request().find("X-Mark") == "kept");
  CHECK(context->resource == &p.resource);
  CHECK(context->now.steady == p.clock.now().steady);
  p.pending.respond(ticket, status(200));
  p.pending.respond(ticket, status(500));
  CHECK(p.replies() == std::vector<int>{200});
  CHECK(p.pending.resume(ticket, p.clock.now()) == nullptr);
  CHECK_FALSE(p.pending.is_pending(ticket));
  CHECK_FALSE(p.pending.next_deadline());
}

TEST_CASE("a request whose resource goes meanwhile has none when it is resumed", "[engine][R0.6]") {
  Pending p;
  const Ticket ticket = *p.defer();
  p.registry.remove(p.resource);
  CHECK(p.pending.resume(ticket, p.clock.now())->resource == nullptr);
  p.registry.add(p.resource);  // another one, at the same path
  CHECK(p.pending.resume(ticket, p.clock.now())->resource == nullptr);
}

TEST_CASE("the timeout of a request runs at its deadline, and cancels its call", "[engine][R0.6]") {
  Pending p;
  const Ticket late = *p.defer(milliseconds(10)), later = *p.defer(milliseconds(20));
  const auto token = std::make_shared<CancelToken>();
  p.pending.waits_for(late, token);
  CHECK(p.pending.next_deadline() == p.clock.now().steady + milliseconds(10));
  p.pending.expire(p.clock.now());
  CHECK(p.replies().empty());
  p.clock.advance(milliseconds(10));
  p.pending.expire(p.clock.now());
  CHECK(p.pending.next_deadline() == PendingRequests::Instant{});  // a reply is there
  CHECK(p.replies() == std::vector<int>{503});
  CHECK(p.mark == "kept");
  CHECK_FALSE(token->take());
  CHECK(p.pending.is_pending(later));
}

TEST_CASE("a timeout knows whether the call of the request runs", "[engine][R0.6]") {
  Pending p;
  const auto token = std::make_shared<CancelToken>();
  p.pending.waits_for(*p.defer(), token);
  CHECK(token->take());
  p.clock.advance(milliseconds(100));
  p.pending.expire(p.clock.now());
  CHECK(p.replies() == std::vector<int>{202});
}

TEST_CASE("a client that leaves cancels a call that has not begun, and gets no response", "[engine][R0.6]") {
  Pending p;
  const Ticket ticket = *p.defer();
  const auto token = std::make_shared<CancelToken>();
  p.pending.waits_for(ticket, token);
  p.pending.abandon(ticket);
  p.pending.abandon(ticket);
  CHECK_FALSE(token->take());
  p.pending.respond(ticket, status(200));
  CHECK(p.replies().empty());
  p.pending.waits_for(ticket, token);  // of nobody
}

TEST_CASE("too many requests, or calls that the host has not run, defer no more", "[engine][limits]") {
  Pending p;
  for (int i = 0; i < 3; ++i) CHECK(p.defer());
  CHECK_FALSE(p.defer());
  Pending q;
  for (int i = 0; i < 2; ++i) q.calls.run(Dispatch::in_poll, [] {});
  CHECK_FALSE(q.defer());
  for (Job& job : q.calls.take_jobs()) job.run();
  CHECK(q.defer());
}

TEST_CASE("requests for the I/O thread are deferred though too many wait for the host, and have the same limit", "[engine][limits]") {
  Pending p;
  for (int i = 0; i < 3; ++i) CHECK(p.defer());
  for (int i = 0; i < 2; ++i) p.calls.run(Dispatch::in_poll, [] {});
  CHECK_FALSE(p.defer());
  const Ticket first = *p.defer(milliseconds(100), Dispatch::io_thread);
  for (int i = 0; i < 2; ++i) CHECK(p.defer(milliseconds(100), Dispatch::io_thread));
  CHECK_FALSE(p.defer(milliseconds(100), Dispatch::io_thread));
  p.pending.respond(first, status(200));
  CHECK(p.defer(milliseconds(100), Dispatch::io_thread));
  CHECK_FALSE(p.defer());
}

TEST_CASE("the end responds to all that wait and cancels their calls", "[engine][R0.6]") {
  Pending p;
  const Ticket first = *p.defer();
  (void)p.defer();
  const auto token = std::make_shared<CancelToken>();
  p.pending.waits_for(first, token);
  p.pending.end_all([](Context&) { return status(503); }, p.clock.now());
  CHECK(p.replies() == std::vector<int>{503, 503});
  CHECK_FALSE(token->take());
}
