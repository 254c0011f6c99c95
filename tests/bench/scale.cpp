// SPDX-License-Identifier: Apache-2.0
// What many Things cost: the time until a server has them, and the memory of each.
//
//   scale [--things 1000] [--properties 3] [--at-once] [--pulled] [--serve] [--json]
//
// Each Thing has so many properties: pushed doubles with a value, or doubles that a lambda reads (--pulled). --at-once: one call of
// Server::add for all. Printed: time and CPU of making and adding them, bytes for each Thing from the allocator (without those of the host's
// handles) and from the resident memory, with that of an empty server before. --serve: goes on until SIGINT or SIGTERM. --json: one object.

#include <malloc.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>

#include "tests/bench/cpu.hpp"

namespace {

volatile std::sig_atomic_t ended = 0;

double resident_bytes() {
  std::ifstream file("/proc/self/smaps_rollup");
  std::string word;
  double kib = 0;
  while (file >> word)
    if (word == "Rss:") file >> kib;
  return kib * 1024;
}

double allocated_bytes() {
  const auto info = ::mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t things = 1000, properties = 3;
  bool at_once = false, pulled = false, serve = false, json = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--at-once") at_once = true;
    else if (name == "--pulled") pulled = true;
    else if (name == "--serve") serve = true;
    else if (name == "--json") json = true;
    else if (name == "--things" && i + 1 < argc) things = static_cast<std::size_t>(std::atol(argv[++i]));
    else if (name == "--properties" && i + 1 < argc) properties = static_cast<std::size_t>(std::atol(argv[++i]));
    else return std::fprintf(stderr, "usage: scale [--things N] [--properties N] [--at-once] [--pulled] [--serve] [--json]\n"), 2;
  }
  std::signal(SIGINT, [](int) { ended = 1; });
  std::signal(SIGTERM, [](int) { ended = 1; });

  lrt::Options options;
  options.listen.port = 0;
  lrt::Server server = lrt::Server::create(std::move(options)).value();
  std::vector<lrt::PushedProperty<double>> handles;
  handles.reserve(things * properties);
  lrt::Thing first{"first"};  // what a server makes with its first Thing is not of the others
  first.property<double>("angle", lrt::unit::radian).publish(0);
  server.add(std::move(first)).value();

  const auto make = [&](std::size_t number) {
    lrt::Thing thing{"arm" + std::to_string(number)};
    for (std::size_t p = 0; p < properties; ++p) {
      const std::string name = "joint" + std::to_string(p);
      const double value = static_cast<double>(number + p);
      if (pulled) {
        thing.property(
            name, [value] { return value; }, lrt::unit::radian);
      } else {
        handles.push_back(thing.property<double>(name, lrt::unit::radian));
        handles.back().publish(value);
      }
    }
    return thing;
  };

  const double resident = resident_bytes(), allocated = allocated_bytes(), cpu = bench::cpu_microseconds(::getpid());
  const auto start = std::chrono::steady_clock::now();
  if (at_once) {
    std::vector<lrt::Thing> all;
    for (std::size_t i = 0; i < things; ++i) all.push_back(make(i));
    server.add(std::move(all)).value();
  } else {
    for (std::size_t i = 0; i < things; ++i) server.add(make(i)).value();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double cpu_seconds = (bench::cpu_microseconds(::getpid()) - cpu) / 1e6;
  const double count = static_cast<double>(things);
  const double each = (allocated_bytes() - allocated) / count, resident_each = (resident_bytes() - resident) / count;
  const char* const how = at_once ? "at once" : "one by one";
  if (json)
    std::printf(
        "{\"bench\": \"scale\", \"things\": %zu, \"properties\": %zu, \"kind\": \"%s\", \"added\": \"%s\", \"seconds\": %.4f, "
        "\"cpu_seconds\": %.4f, \"allocated_bytes_per_thing\": %.0f, \"resident_bytes_per_thing\": %.0f, "
        "\"resident_bytes_before\": %.0f}\n",
        things, properties, pulled ? "pulled" : "pushed", how, seconds, cpu_seconds, each, resident_each, resident);
  else
    std::printf(
        "%zu Things with %zu %s properties, added %s: %.3f s, CPU %.3f s; allocated %.0f bytes each, resident %.0f bytes each; "
        "resident %.1f MB before\n",
        things, properties, pulled ? "pulled" : "pushed", how, seconds, cpu_seconds, each, resident_each, resident / 1e6);
  if (!serve) std::_Exit(std::fflush(stdout));
  std::printf("listening on %s\n", server.url().c_str());
  std::fflush(stdout);
  while (!ended) {
    server.poll(std::chrono::microseconds(200));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}
