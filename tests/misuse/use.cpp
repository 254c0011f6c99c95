// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include <lrt/feed.hpp>
#include <lrt/http/message.hpp>
#include <lrt/served.hpp>

#include "tests/misuse/harness.hpp"

namespace {

/// A value whose copy stays in publish() until it is told to go on.
struct Slow {
  static inline std::atomic<bool> waits{false}, is_inside{false}, goes_on{false};
  Slow() = default;
  Slow(const Slow&) = default;
  Slow& operator=(const Slow& other) {
    x = other.x;
    if (!waits) return *this;
    is_inside = true;
    if (!misuse::wait_for([] { return goes_on.load(); })) std::abort();
    return *this;
  }
  int x = 0;
};
/// The same with memory of its own.
struct SlowText {
  std::string text;
  Slow slow;
};
struct Thrower {
  int x = 0;
};
/// A published value that cannot be copied.
struct NoCopy {
  NoCopy() = default;
  NoCopy(const NoCopy&) { throw std::runtime_error("no copy"); }
  NoCopy& operator=(const NoCopy&) { throw std::runtime_error("no copy"); }
  std::string text;
};

}  // namespace

namespace lrt::rdf {
template <>
struct traits<Slow> : Record<Slow> {
  static void describe(Record<Slow>& r) { r.field("x", &Slow::x); }
};
template <>
struct traits<SlowText> : Record<SlowText> {
  static void describe(Record<SlowText>& r) {
    r.field("text", &SlowText::text);
    r.field("slow", &SlowText::slow);
  }
};
template <>
struct traits<Thrower> : Record<Thrower> {
  static void describe(Record<Thrower>& r) {
    r.field(
        "x", [](const Thrower&) -> int { throw 42; }, [](Thrower&, int) { throw 43; });
  }
};
template <>
struct traits<NoCopy> : Record<NoCopy> {
  static void describe(Record<NoCopy>& r) { r.field("text", &NoCopy::text); }
};
}  // namespace lrt::rdf

namespace misuse {
namespace {

using lrt::Thing;

/// A host with a Thing "arm".
struct Arm : Host {
  template <class F>
  explicit Arm(F describe, lrt::Options options = {}) : Host(std::move(options)) {
    Thing arm("arm");
    describe(arm);
    server.add(std::move(arm)).value();
  }
};

/// What a second call says while another thread publishes.
template <class T, class Second>
std::string while_publishing(Second second) {
  Thing arm("arm");
  auto property = arm.property<T>("value");
  Slow::is_inside = Slow::goes_on = false;
  Slow::waits = true;
  std::thread first([&] { property.publish(T()); });
  const bool is_inside = wait_for([] { return Slow::is_inside.load(); });
  Slow::waits = false;
  second(property);
  Slow::goes_on = true;
  first.join();
  return is_inside ? std::string() : "the first writer never came";
}

struct Gone {
  int value = 1;
};

lrt::http::Request get(std::string_view target) {
  lrt::http::Request request;
  request.method = "GET";
  request.target = target;
  return request;
}

std::string moved(void (*use)(lrt::Server&)) {
  Host host;
  lrt::Server taken = std::move(host.server);
  return thrown([&] { use(host.server); });  // NOLINT(bugprone-use-after-move)
}

}  // namespace

std::vector<Misuse> of_use() {
  const auto number = [] { return 1.0; };
  return {
      // handles
      {"publish() on an empty handle", "check: publish() was called on an empty handle: assign what Thing::property()",
       [] { return lrt::PushedProperty<double>().publish(1), std::string(); }},
      {"publish() with a time on an empty handle", "check: publish() was called on an empty handle",
       [] { return lrt::PushedProperty<std::string>().publish("x", {}), std::string(); }},
      {"publish() on a handle that was moved", "check: publish() was called on an empty handle",
       [] {
         Thing arm("arm");
         auto a = arm.property<double>("x"), b = std::move(a);
         a.publish(1);  // NOLINT(bugprone-use-after-move)
         return std::string();
       }},
      {"changed() on an empty handle", "check: changed() was called on an empty handle",
       [] { return lrt::PulledProperty<int>().changed(), std::string(); }},
      {"available() on an empty handle", "check: available() was called on an empty handle",
       [] { return lrt::Action().available(false), std::string(); }},
      {"a set-up call on an empty handle", "check: unit() was called on an empty handle",
       [] { return lrt::PulledProperty<double>().unit(lrt::unit::metre), std::string(); }},
      {"on_create() on an empty handle", "check: on_create() was called on an empty handle",
       [] { return lrt::Collection<int>().on_create([](int) {}), std::string(); }},
      {"an effect on an empty handle", "check: an action refers to an empty handle",
       [] {
         Thing arm("arm");
         arm.action("go", [] {}).effect(lrt::PushedProperty<double>());
         return std::string();
       }},
      {"a set-up call after add()", "check: property \"arm/x\": at_least() was called after the thing was added to a server",
       [] {
         lrt::PushedProperty<double> x;
         Arm host([&](Thing& arm) { x = arm.property<double>("x"); });
         x.at_least(1);
         return std::string();
       }},
      {"on_write() after add()", "check: property \"arm/x\": on_write() was called after the thing was added",
       [&] {
         lrt::PulledProperty<double> x;
         Arm host([&](Thing& arm) { x = arm.property("x", number); });
         x.on_write([](double) {});
         return host.ask("PUT", "/arm/x", "2").substr(0, 3);
       }},
      {"keep() after add()", "check: property \"arm/x\": keep() was called after the thing was added",
       [] {
         lrt::PushedProperty<double> x;
         Arm host([&](Thing& arm) { x = arm.property<double>("x"); });
         x.keep(4);
         return std::string();
       }},
      {"publish() after its Thing was removed", "nothing; 404",
       [] {
         lrt::PushedProperty<std::string> x;
         Arm host([&](Thing& arm) { x = arm.property<std::string>("x"); });
         host.server.remove("arm").value();
         x.publish("late");
         return "nothing; " + host.ask("GET", "/arm/x");
       }},
      {"publish() after its server ended", "nothing",
       [] {
         lrt::PushedProperty<std::string> x;
         {
           Arm host([&](Thing& arm) { x = arm.property<std::string>("x"); });
         }
         x.publish("late");
         return std::string("nothing");
       }},
      {"publish() of an object on an empty handle", "check: publish() on an empty handle: assign what WorldGraph::published() returns",
       [] { return lrt::PublishedObject<double>().publish(1), std::string(); }},
      // two threads
      {"two threads publish one number", "check: property \"arm/value\": publish() was called while another thread publishes: one thread at a time",
       [] { return while_publishing<Slow>([](auto& p) { p.publish(Slow()); }); }},
      {"two threads publish one text", "check: property \"arm/value\": publish() was called while another thread publishes",
       [] { return while_publishing<SlowText>([](auto& p) { p.publish(SlowText()); }); }},
      {"two threads publish one text with a time", "check: property \"arm/value\": publish() was called while another thread publishes",
       [] { return while_publishing<SlowText>([](auto& p) { p.publish(SlowText(), {}); }); }},
      {"keep() while another thread publishes", "check: property \"arm/value\": keep() was called while another thread publishes",
       [] { return while_publishing<Slow>([](auto& p) { p.keep(8); }); }},
      {"urgent() while another thread publishes", "check: property \"arm/value\": urgent() was called while another thread publishes",
       [] { return while_publishing<Slow>([](auto& p) { p.urgent(); }); }},
      {"two threads publish one text all the time", "nothing",
       [] {
         Arm host([](Thing&) {});
         Thing arm("other");
         auto text = arm.property<std::string>("text");
         host.server.add(std::move(arm)).value();
         const auto publish = [&text](const char* what) {
           for (int i = 0; i < 2000; ++i) text.publish(what + std::to_string(i));
         };
         std::thread other(publish, "a long text that owns memory of its own ");
         publish("another text that owns memory of its own ");
         other.join();
         const std::string got = host.ask("GET", "/other/text");
         (void)checked();  // as many as there were
         return got.substr(0, 3) == "200" ? std::string("nothing") : got;
       }},
      {"a thread takes over publishing", "nothing",
       [] {
         Thing arm("arm");
         auto text = arm.property<std::string>("text");
         for (int i = 0; i < 10; ++i) std::thread([&] { text.publish(std::to_string(i)); }).join();
         return std::string("nothing");
       }},
      {"two threads poll", "check: Server::poll() or run() was called while another thread polls",
       [] {
         std::atomic<bool> is_inside{false}, goes_on{false};
         Arm host([&](Thing& arm) {
           arm.property("x", [&] {
             is_inside = true;
             return wait_for([&] { return goes_on.load(); });
           });
         });
         std::string got;
         std::thread first([&] { got = host.ask("GET", "/arm/x"); });
         if (!wait_for([&] { return is_inside.load(); })) return std::string("the first never came");
         host.server.poll();
         goes_on = true;
         first.join();
         return got;
       }},
      {"two threads poll, in the log", "run() was called while another thread polls, as that of start()",
       [] {
         std::atomic<bool> is_inside{false}, goes_on{false};
         Arm host([&](Thing& arm) {
           arm.property("x", [&] {
             is_inside = true;
             return wait_for([&] { return goes_on.load(); });
           });
         });
         std::thread first([&] { host.ask("GET", "/arm/x"); });
         if (!wait_for([&] { return is_inside.load(); })) return std::string("the first never came");
         host.server.poll();
         (void)checked();
         goes_on = true;
         first.join();
         return host.log();
       }},
      // calls from lambdas
      {"poll() from a lambda", "200",
       [] {
         Host* self = nullptr;
         Arm host([&](Thing& arm) {
           arm.property("x", [&] {
             self->server.poll();
             return 1;
           });
         });
         self = &host;
         return host.ask("GET", "/arm/x");
       }},
      {"add() from a lambda", "204 ; 200",
       [&] {
         Host* self = nullptr;
         Arm host([&](Thing& arm) { arm.action("grow", [&] { self->server.add(Thing("finger")).value(); }); });
         self = &host;
         const std::string grown = host.ask("POST", "/arm/actions/grow");
         return grown + "; " + host.ask("GET", "/finger");
       }},
      {"a lambda that removes its own Thing", "404",
       [] {
         Host* self = nullptr;
         Arm host([&](Thing& arm) { arm.action("die", [&] { self->server.remove("arm").value(); }); });
         self = &host;
         host.ask("POST", "/arm/actions/die");
         return host.ask("GET", "/arm");
       }},
      {"a read function that removes its own Thing", "404",
       [] {
         Host* self = nullptr;
         Arm host([&](Thing& arm) {
           arm.property("x", [&] {
             (void)self->server.remove("arm");
             return 1;
           });
         });
         self = &host;
         return host.ask("GET", "/arm/x");
       }},
      {"stop() from a lambda", "closed",
       [] {
         Host* self = nullptr;
         Arm host([&](Thing& arm) { arm.action("end", [&] { self->server.stop(); }); });
         self = &host;
         host.ask("POST", "/arm/actions/end");
         return text_of(host.server.add(Thing("late")));
       }},
      // exceptions
      {"a read function throws", "500 {\"type\":\"about:blank\"",
       [] { return Arm([](Thing& arm) { arm.property("x", []() -> int { throw std::runtime_error("no encoder"); }); }).ask("GET", "/arm/x"); }},
      {"what it throws is in the response", "it threw: no encoder",
       [] { return Arm([](Thing& arm) { arm.property("x", []() -> int { throw std::runtime_error("no encoder"); }); }).ask("GET", "/arm/x"); }},
      {"a read function throws an int", "an exception that is not a std::exception",
       [] { return Arm([](Thing& arm) { arm.property("x", []() -> int { throw 3; }); }).ask("GET", "/arm/x"); }},
      {"on_write throws", "500",
       [&] { return Arm([&](Thing& arm) { arm.property("x", number).on_write([](double) { throw 3; }); }).ask("PUT", "/arm/x", "2"); }},
      {"an action throws", "it threw: stuck",
       [] { return Arm([](Thing& arm) { arm.action("go", [] { throw std::logic_error("stuck"); }); }).ask("POST", "/arm/actions/go"); }},
      {"an asynchronous action throws", "500",
       [] { return Arm([](Thing& arm) { arm.action("go", [](lrt::Responder) { throw 3; }); }).ask("POST", "/arm/actions/go"); }},
      {"on_create throws", "500",
       [] { return Arm([](Thing& arm) { arm.collection<int>("points").on_create([](int) { throw 3; }); }).ask("POST", "/arm/points", "1"); }},
      {"an encoder throws", "500",
       [&] {
         return Arm([&](Thing& arm) { arm.property("x", number).representation("image/png", [](double) -> std::string { throw 3; }); })
             .ask("GET", "/arm/x", {}, "image/png");
       }},
      {"a getter of a field throws", "500", [] { return Arm([](Thing& arm) { arm.property("x", [] { return Thrower(); }); }).ask("GET", "/arm/x"); }},
      {"a setter of a field throws", "500",
       [] { return Arm([](Thing& arm) { arm.action("go", [](const Thrower&) {}); }).ask("POST", "/arm/actions/go", "{\"x\":1}"); }},
      {"a published value throws in its copy", "200 null",
       [] {
         lrt::PushedProperty<NoCopy> x;
         Arm host([&](Thing& arm) { x = arm.property<NoCopy>("x"); });
         x.publish(NoCopy());
         return host.ask("GET", "/arm/x");
       }},
      // responders
      {"a Responder that is dropped", "500",
       [] { return Arm([](Thing& arm) { arm.action("go", [](lrt::Responder) {}); }).ask("POST", "/arm/actions/go", {}, "application/json"); }},
      {"a Responder that is used twice", "204",
       [] {
         return Arm([](Thing& arm) {
                  arm.action("go", [](lrt::Responder done) {
                    done.succeed();
                    done.fail("too late");
                    done.progress(0.5);
                  });
                })
             .ask("POST", "/arm/actions/go");
       }},
      {"a Responder after the server ended, on another thread", "nothing",
       [] {
         lrt::Responder kept;
         {
           Arm host([&](Thing& arm) { arm.action("go", [&](lrt::Responder done) { kept = done; }); });
           host.ask("POST", "/arm/actions/go");
         }
         std::thread([&] {
           kept.progress(0.5);
           kept.on_cancel([] {});
           kept.succeed();
         }).join();
         return std::string(kept ? "open" : "nothing");
       }},
      {"an empty Responder", "nothing",
       [] {
         const lrt::Responder none;
         none.succeed();
         none.fail("x");
         none.on_cancel(lrt::UniqueFunction<void()>());
         (void)none.split(2);
         return std::string("nothing");
       }},
      {"a null on_cancel hook", "204",
       [] {
         Arm host([&](Thing& arm) {
           arm.action("go", [](lrt::Responder done) {
             done.on_cancel(lrt::UniqueFunction<void()>());
             done.succeed();
           });
         });
         return host.ask("POST", "/arm/actions/go");
       }},
      // servers
      {"add() to a server that was moved", "closed: the Server was moved from",
       [] {
         Host host;
         lrt::Server taken = std::move(host.server);
         return text_of(host.server.add(Thing("arm")));  // NOLINT(bugprone-use-after-move)
       }},
      {"remove() of a server that was moved", "closed: the Server was moved from",
       [] {
         Host host;
         lrt::Server taken = std::move(host.server);
         return text_of(host.server.remove("arm"));  // NOLINT(bugprone-use-after-move)
       }},
      {"add_scoped() to a server that was moved", "closed: the Server was moved from",
       [] {
         Host host;
         lrt::Server taken = std::move(host.server);
         return host.server.add_scoped(Thing("arm")).error().message.insert(0, "closed: ");  // NOLINT(bugprone-use-after-move)
       }},
      {"a feed of a server that was moved", "closed: the Server was moved from",
       [] {
         Host host;
         lrt::Server taken = std::move(host.server);
         return "closed: " + lrt::Feed::create(host.server).error().message;  // NOLINT(bugprone-use-after-move)
       }},
      {"start() of a server that was moved", "throws closed: the Server was moved from", [] { return moved([](lrt::Server& s) { s.start(); }); }},
      {"poll() of a server that was moved", "check: poll() or run() of a Server that was moved from",
       [] { return moved([](lrt::Server& s) { s.poll(); }); }},
      {"run() of a server that was moved", "check: poll() or run() of a Server that was moved from",
       [] { return moved([](lrt::Server& s) { s.run(); }); }},
      {"the rest of a server that was moved", "nothing",
       [] {
         return moved([](lrt::Server& s) {
           s.wake();
           s.stop();
           (void)s.descriptor();
           (void)s.counters();
           (void)s.serve(get("/"));
           (void)s.judge_header(get("/"), {});
           if (s.port() != 0 || !s.url().empty() || s.reload_tls()) throw lrt::BadResult({lrt::Errc::failed, "it is alive"});
         });
       }},
      {"start() after stop()", "throws closed: start(): the server has stopped; a server serves once, so create a new one",
       [] {
         Host host;
         host.server.start();
         host.server.stop();
         return thrown([&] { host.server.start(); });
       }},
      {"start() twice and stop() twice", "nothing",
       [] {
         Host host;
         host.server.start();
         host.server.start();
         host.server.stop();
         host.server.stop();
         return std::string("nothing");
       }},
      {"add() after stop()", "closed: the server has stopped",
       [] {
         Host host;
         host.server.stop();
         return text_of(host.server.add(Thing("arm")));
       }},
      {"run() and poll() after stop()", "nothing",
       [] {
         Host host;
         host.server.stop();
         host.server.run();
         host.server.poll();
         return std::string("nothing");
       }},
      {"remove() of a path that is not there", "unknown_path: no thing at \"leg\"", [] { return text_of(Host().server.remove("leg")); }},
      {"an executor that is not there, of a server", "Dispatch::executor needs Threads::executor",
       [] {
         lrt::Options options;
         options.threads.dispatch = lrt::Dispatch::executor;
         return lrt::Server::create(options).error().message;
       }},
      {"a transport that is not there", "expected a transport, found nullptr",
       [] {
         lrt::Options options;
         options.listen.transport = [](lrt::transport::TransportOptions) { return nullptr; };
         return lrt::Server::create(options).error().message;
       }},
      {"a vocabulary that is no IRI", "vocabulary: expected an absolute IRI",
       [] {
         lrt::Options options;
         options.vocabulary = "terms";
         return lrt::Server::create(options).error().message;
       }},
      {"a negative time limit", "limits.host_timeout: expected at least 0, found a negative time",
       [] {
         lrt::Options options;
         options.limits.host_timeout = std::chrono::milliseconds(-1);
         return lrt::Server::create(options).error().message;
       }},
      {"a negative period of samples", "subscriptions.sample_period: expected at least 0, found a negative time",
       [] {
         lrt::Options options;
         options.subscriptions.sample_period = std::chrono::milliseconds(-1);
         return lrt::Server::create(options).error().message;
       }},
      {"a period of scans of no time", "subscriptions.scan_period: expected more than 0 us",
       [] {
         lrt::Options options;
         options.subscriptions.scan_period = std::chrono::microseconds(0);
         return lrt::Server::create(options).error().message;
       }},
      {"a poll() with a negative budget", "200",
       [] {
         Host host;
         host.server.poll(std::chrono::microseconds(-5));
         return host.ask("GET", "/");
       }},
      {"an address that is none", "listen.address: expected a numeric address or a host name that resolves",
       [] {
         lrt::Options options;
         options.listen.address = "not an address";
         const auto server = lrt::Server::create(options);
         return server ? std::string("served") : server.error().message;
       }},
      // life times
      {"a read function whose object is gone", "503",
       [] {
         auto object = std::make_shared<Gone>();
         Arm host([&](Thing& arm) { arm.guard(object).property("x", [o = object.get()] { return o->value; }); });
         object.reset();
         return host.ask("GET", "/arm/x");
       }},
      {"the reason of that", "the part of the robot's program that serves it is gone",
       [] {
         auto object = std::make_shared<Gone>();
         Arm host([&](Thing& arm) {
           arm.property("x", [o = object.get()] { return o->value; });
           arm.guard(std::weak_ptr<Gone>(object));
         });
         object.reset();
         return host.ask("GET", "/arm/x");
       }},
      {"a read function whose object is there", "200 1",
       [] {
         auto object = std::make_shared<Gone>();
         Arm host([&](Thing& arm) { arm.guard(object).property("x", [o = object.get()] { return o->value; }); });
         return host.ask("GET", "/arm/x");
       }},
      {"on_write whose object is gone", "503",
       [&] {
         auto object = std::make_shared<Gone>();
         Arm host([&](Thing& arm) { arm.guard(object).property<int>("x").on_write([o = object.get()](int v) { o->value = v; }); });
         object.reset();
         return host.ask("PUT", "/arm/x", "2");
       }},
      {"an action whose object is gone", "503",
       [] {
         auto object = std::make_shared<Gone>();
         Arm host([&](Thing& arm) { arm.guard(object).action("go", [o = object.get()] { o->value = 2; }); });
         object.reset();
         return host.ask("POST", "/arm/actions/go");
       }},
      {"on_create whose object is gone", "503",
       [] {
         auto object = std::make_shared<Gone>();
         Arm host([&](Thing& arm) { arm.guard(object).collection<int>("points").on_create([o = object.get()](int v) { o->value = v; }); });
         object.reset();
         return host.ask("POST", "/arm/points", "2");
       }},
      {"an encoder whose object is gone", "503",
       [&] {
         auto object = std::make_shared<Gone>();
         Arm host([&](Thing& arm) {
           auto x = arm.guard(object).property<double>("x");
           x.representation("image/png", [o = object.get()](double) { return std::to_string(o->value); });
           x.publish(1);
         });
         object.reset();
         return host.ask("GET", "/arm/x", {}, "image/png");
       }},
      {"an on_cancel hook whose object is gone", "hook: not called",
       [] {
         auto object = std::make_shared<Gone>();
         bool called = false;
         std::vector<lrt::Responder> kept;
         Arm host([&](Thing& arm) {
           arm.guard(object).action("go", [&](lrt::Responder done) {
             done.on_cancel([&] { called = true; });
             kept.push_back(done);
           });
         });
         host.ask("POST", "/arm/actions/go");
         object.reset();
         host.server.remove("arm").value();
         for (int i = 0; i < 10; ++i) host.server.poll();
         return std::string("hook: ") + (called ? "called" : "not called");
       }},
      {"one of two guarded objects is gone", "503",
       [] {
         auto a = std::make_shared<Gone>(), b = std::make_shared<Gone>();
         Arm host([&](Thing& arm) { arm.guard(a).guard(b).property("x", [o = b.get()] { return o->value; }); });
         b.reset();
         return host.ask("GET", "/arm/x");
       }},
      {"a guarded object is destroyed by its own lambda", "200 1",
       [] {
         auto object = std::make_shared<Gone>();
         Arm host([&](Thing& arm) {
           arm.guard(object).property("x", [o = object.get(), &object] {
             object.reset();
             return o->value;
           });
         });
         return host.ask("GET", "/arm/x");
       }},
      {"a Thing after its scope", "200; 404",
       [&] {
         Host host;
         std::string told;
         {
           Thing arm("left arm");
           arm.property("x", number);
           const lrt::Registration served = host.server.add_scoped(std::move(arm)).value();
           told = host.ask("GET", "/left%20arm/x").substr(0, 3);
         }
         return told + "; " + host.ask("GET", "/left%20arm/x");
       }},
      {"a scope that outlives its server", "closed: the server is gone",
       [] {
         lrt::Registration served, another;
         {
           Host host;
           served = host.server.add_scoped(Thing("arm")).value();
           another = host.server.add_scoped(Thing("leg")).value();
         }
         return text_of(served.remove());
       }},
      {"a scope whose path has another Thing now", "unknown_path; 200",
       [] {
         Host host;
         lrt::Registration served = host.server.add_scoped(Thing("arm")).value();
         host.server.remove("arm").value();
         host.server.add(Thing("arm")).value();
         const lrt::Result<void> removed = served.remove();
         return std::string(to_string(removed.error().code)) + "; " + host.ask("GET", "/arm");
       }},
      {"a scope that ends twice", "closed: the registration is empty",
       [] {
         Host host;
         lrt::Registration served = host.server.add_scoped(Thing("arm")).value(), other = std::move(served);
         other.remove().value();
         return text_of(other.remove());
       }},
      {"a scope that is kept", "200",
       [] {
         Host host;
         { host.server.add_scoped(Thing("arm")).value().keep(); }
         return host.ask("GET", "/arm");
       }},
      {"a scope that ends in a lambda of its Thing", "404",
       [] {
         lrt::Registration served;
         Host host;
         Thing arm("arm");
         arm.action("die", [&] { served = lrt::Registration(); });
         served = host.server.add_scoped(std::move(arm)).value();
         host.ask("POST", "/arm/actions/die");
         return host.ask("GET", "/arm");
       }},
      {"a scope within a Thing of another scope", "404",
       [] {
         Host host;
         auto inner = std::make_shared<lrt::Registration>(host.server.add_scoped(Thing("inner")).value());
         {
           Thing outer("outer");
           outer.property("x", [inner] { return static_cast<bool>(*inner); });
           inner.reset();
           const lrt::Registration served = host.server.add_scoped(std::move(outer)).value();
         }
         host.server.poll();
         (void)host.server.add(Thing("another"));  // what was removed is destroyed by now
         return host.ask("GET", "/inner");
       }},
      {"a Thing of a path that is taken, in a scope", "duplicate_path: path \"arm\" is already in use; 200",
       [] {
         Host host;
         host.server.add(Thing("arm")).value();
         const auto failed = host.server.add_scoped(Thing("arm"));
         const std::string told = std::string(to_string(failed.error().code)) + ": " + failed.error().message.substr(0, 28);
         return told + "; " + host.ask("GET", "/arm");
       }},
  };
}

const Misuse* fatal(std::size_t number) {
  static const std::vector<Misuse> all = {
      {"a Result without a value", "aborted, lrt: a Result without a value was used: test it with `if (result)` before * or ->",
       [] {
         const lrt::Result<int> result = lrt::unexpected(lrt::Errc::failed, "no");
         return std::to_string(*result);
       }},
      {"the error of a success", "aborted, lrt: error() of a Result of success", [] { return lrt::Result<void>().error().message; }},
      {"the error of a value", "aborted, lrt: error() of a Result with a value", [] { return lrt::Result<int>(1).error().message; }},
      {"the default of a check", "aborted, lrt: publish() was called on an empty handle: assign what Thing::property()",
       [] { return lrt::PushedProperty<double>().publish(1), std::string(); }},
  };
  return number < all.size() ? &all[number] : nullptr;
}

}  // namespace misuse
