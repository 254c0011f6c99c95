// SPDX-License-Identifier: Apache-2.0
// A robot that tests of the command use: writable properties of many types, Things with odd names, an image, a list, a stop, and actions that end, fail,
// and go on until they are cancelled.
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include <lrt/lrt.hpp>

enum class Mode { idle, busy };
template <>
struct lrt::rdf::traits<Mode> : lrt::rdf::Enumeration<Mode> {
  static void describe(Enumeration<Mode>& e) { e.name(Mode::idle, "idle").name(Mode::busy, "busy"); }
};

struct Pose {
  double x = 0;
  std::optional<std::string> note;
  std::vector<int> list;
};
template <>
struct lrt::rdf::traits<Pose> : lrt::rdf::Record<Pose> {
  static void describe(Record<Pose>& r) { r.field("x", &Pose::x), r.field("note", &Pose::note), r.field("list", &Pose::list); }
};

struct Frame {
  int number = 1;
};
template <>
struct lrt::rdf::traits<Frame> : lrt::rdf::Record<Frame> {
  static void describe(Record<Frame>& r) { r.field("number", &Frame::number); }
};

namespace {

volatile std::sig_atomic_t ended = 0;

template <class T>
void add(lrt::Thing& thing, const char* name, T value = {}, const lrt::Unit& unit = lrt::unit::none) {
  auto kept = std::make_shared<T>(std::move(value));
  auto&& property = thing.property(name, [kept] { return *kept; });
  property.on_write([kept](const T& written) { *kept = written; });
  if constexpr (std::is_same_v<T, double>)
    if (!unit.empty()) property.unit(unit);
}

}  // namespace

int main() {
  lrt::Options options;
  options.listen.port = 0;
  auto server = lrt::Server::create(std::move(options)).value();

  lrt::Thing types{"types"};
  add<double>(types, "number", 0.1 + 0.2);
  add<double>(types, "angle", 0, lrt::unit::radian);
  add<double>(types, "speed", 0, lrt::unit::metre_per_second);
  add<float>(types, "single", 0.3F);
  add<std::int64_t>(types, "integer");
  add<bool>(types, "flag");
  add<std::string>(types, "text");
  add<Mode>(types, "mode");
  add<std::vector<double>>(types, "numbers");
  add<std::vector<std::string>>(types, "texts");
  add<std::map<std::string, double>>(types, "map");
  add<Pose>(types, "pose");
  types.property("nothing", [] { return std::optional<double>(); });
  types.action("echo", [](std::string text) { return text; });
  types.action("fail", [] { throw std::runtime_error("the gripper is stuck"); });
  std::list<lrt::Responder> running;
  bool is_driving = false;
  types.action("drive", [&](lrt::Responder done) {
    is_driving = true;
    running.push_back(std::move(done));
  });
  types.property("driving", [&] { return is_driving; });
  types.action("halt", [&] { running.clear(); }).stop();

  lrt::Thing camera{"camera"};
  camera.property("image", [] { return Frame{}; }).representation("image/png", [](const Frame&) {
    return std::string("\x89PNG\r\n\x1a\n\0\x1b[2J", 14);
  });

  lrt::Thing empty{"empty"};
  server.add(std::move(types)).value();
  server.add(std::move(camera)).value();
  server.add(std::move(empty)).value();
  for (const char* name :
       {"x y", "\xC3\xA9t\xC3\xA9", "\xE4\xB8\xAD\xE6\x96\x87", "a+b", "50%", "#hash", "q?x=1", "comma,s", "[b]", "quote\"s", "tilde~", "-minus"}) {
    lrt::Thing thing{name};
    add<double>(thing, "val ue+");
    server.add(std::move(thing)).value();
  }

  std::signal(SIGTERM, [](int) { ended = 1; });
  std::signal(SIGINT, [](int) { ended = 1; });
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);
  while (!ended) {
    server.poll();
    for (auto i = running.begin(); i != running.end();) i = i->cancelled() ? running.erase(i) : std::next(i);
    if (running.empty()) is_driving = false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  server.stop();
}
