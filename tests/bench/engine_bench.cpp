// SPDX-License-Identifier: Apache-2.0
// What lrt itself costs, without a network: publish(), and GET, PUT and POST on the engine.
//
//   engine_bench
//
// Prints medians over batches, and what is allocated. Nothing is asserted.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/thing.hpp>

namespace {
std::atomic<std::size_t> allocations{0};
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }

namespace {

using Steady = std::chrono::steady_clock;

template <class F>
void measure(const char* what, std::size_t batches, std::size_t per_batch, F f) {
  std::vector<double> ns;
  ns.reserve(batches);
  const std::size_t before = allocations;
  for (std::size_t b = 0; b < batches; ++b) {
    const auto start = Steady::now();
    for (std::size_t i = 0; i < per_batch; ++i) f();
    ns.push_back(std::chrono::duration<double, std::nano>(Steady::now() - start).count() / static_cast<double>(per_batch));
  }
  const double each = static_cast<double>(allocations - before) / static_cast<double>(batches * per_batch);
  std::sort(ns.begin(), ns.end());
  std::printf("%-58s median %8.1f ns   99.9 %% %8.1f ns   %.2f allocations\n", what, ns[batches / 2], ns[batches - 1 - batches / 1000], each);
}

std::size_t resident_kib() {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word)
    if (word == "VmRSS:") {
      std::size_t kib = 0;
      status >> kib;
      return kib;
    }
  return 0;
}

struct Sample {
  double t, position, velocity, effort;
};

}  // namespace

template <>
struct lrt::rdf::traits<Sample> : lrt::rdf::Record<Sample> {
  static void describe(Record<Sample>& r) {
    r.field("t", &Sample::t).unit(lrt::unit::second);
    r.field("position", &Sample::position).unit(lrt::unit::radian);
    r.field("velocity", &Sample::velocity);
    r.field("effort", &Sample::effort);
  }
};

int main() {
  lrt::Thing joint{"arm/joint"};
  auto angle = joint.property<double>("angle", lrt::unit::radian);
  auto sample = joint.property<Sample>("sample");
  lrt::engine::Engine engine;
  if (!engine.add(std::move(joint))) return 1;

  double t = 0;
  measure("publish a double that changes", 20'001, 50, [&] { angle.publish(t += 0.001); });
  measure("publish a double that repeats", 20'001, 50, [&] { angle.publish(t); });
  measure("publish a struct of 4 doubles that changes", 20'001, 50, [&] { sample.publish({t += 0.001, t, 1, 2}); });

  const auto get = [&](lrt::engine::Engine& e, const char* target) {
    lrt::http::Request request;
    request.method = "GET";
    request.target = target;
    request.fields = {{"Host", "127.0.0.1"}, {"User-Agent", "bench"}, {"Accept", "*/*"}};
    const lrt::engine::Outcome outcome = e.handle(request, lrt::TimePoint{});
    if (std::get<lrt::http::Response>(outcome).status != 200) std::abort();
  };
  measure("GET a pushed property that has not changed", 2'001, 50, [&] { get(engine, "/arm/joint/angle"); });
  measure("GET a pushed property after each publish", 2'001, 50, [&] {
    angle.publish(t += 0.001);
    get(engine, "/arm/joint/angle");
  });
  measure("GET a pushed struct after each publish", 2'001, 50, [&] {
    sample.publish({t += 0.001, t, 1, 2});
    get(engine, "/arm/joint/sample");
  });

  lrt::Thing commanded{"baxter/right_s1"};
  commanded.action("rotate", [](float) {}).consumes(lrt::rdf::Facets{lrt::unit::degree}.at_least(0).below(360));
  commanded.property<float>("rotation", lrt::unit::degree).on_write([](float) {});
  if (!engine.add(std::move(commanded))) return 1;
  const auto send = [&](const char* method, const char* target) {  // Figure 5b
    lrt::http::Request request;
    request.method = method;
    request.target = target;
    request.fields = {{"Host", "127.0.0.1"}, {"User-Agent", "bench"}, {"Content-Type", "text/turtle"}};
    request.body =
        "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n"
        "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .\n"
        "@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> .\n"
        "<>\n  rdf:type maths:Scalar ;\n  vom:numericalValue \"43.6\"^^xsd:float ;\n  vom:unit maths:Degree .\n";
    lrt::engine::Outcome outcome = engine.handle(request, lrt::TimePoint{});
    lrt::engine::Outputs outputs;
    engine.take_outputs(outputs);
    for (lrt::engine::Job& job : outputs.jobs) job.run();
    std::optional<lrt::engine::Reply> reply = engine.next_reply(lrt::TimePoint{});
    const auto* at_once = std::get_if<lrt::http::Response>(&outcome);
    if ((at_once != nullptr ? at_once->status : reply ? reply->response.status : 0) != 204) std::abort();
  };
  measure("POST Figure 5b: parsed, judged, decoded, called", 2'001, 50, [&] { send("POST", "/baxter/right_s1/actions/rotate"); });
  measure("PUT Figure 5b: parsed, judged, decoded, called", 2'001, 50, [&] { send("PUT", "/baxter/right_s1/rotation"); });

  for (const std::size_t count : {std::size_t{10}, std::size_t{10'000}}) {
    const std::size_t before = resident_kib();
    lrt::engine::Engine many;
    std::vector<std::string> targets;
    for (std::size_t i = 0; i < count; ++i) {
      lrt::Thing thing{"thing" + std::to_string(i)};
      thing.property<double>("value").publish(static_cast<double>(i));
      targets.push_back("/thing" + std::to_string(i) + "/value");
      if (!many.add(std::move(thing))) return 1;
    }
    const std::size_t registered = resident_kib() - before;
    for (const std::string& target : targets) get(many, target.c_str());  // renders each once
    std::size_t next = 0;
    const std::string what = "GET one of " + std::to_string(count) + " things in turn";
    measure(what.c_str(), 2'001, 50, [&] { get(many, targets[next++ * 7919 % count].c_str()); });
    std::printf("%-58s %zu KiB registered, %zu KiB after every value was asked for\n", "  resident memory", registered, resident_kib() - before);
  }
}
