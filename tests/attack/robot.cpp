// A robot to be attacked: its control loop runs at 1 kHz and measures how late each step begins.
//
//   attacked_robot [--in-poll] [--transport NAME] [--body-threads N]
//
// Prints its URL. For each line on its standard input it prints one line of JSON: what was measured since the line before.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <iostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/transport/named.hpp>

namespace {

using Time = std::chrono::steady_clock::time_point;
constexpr std::chrono::microseconds step{1000}, budget{200};

/// Microseconds, of one kind.
class Sample {
 public:
  void add(std::chrono::nanoseconds time) { values_.push_back(std::chrono::duration<double, std::micro>(time).count()); }
  /// @param name  "late"
  std::string json(const std::string& name) {
    std::sort(values_.begin(), values_.end());
    std::string text;
    for (const auto& [label, part] : {std::pair{"p50", 0.5}, {"p99", 0.99}, {"p999", 0.999}, {"max", 1.0}}) {
      const std::size_t at = std::min(values_.size() - 1, static_cast<std::size_t>(static_cast<double>(values_.size()) * part));
      text += ", \"" + name + "_" + label + "\": " + (values_.empty() ? "null" : std::to_string(std::lround(values_[at])));
    }
    return text;
  }
  std::size_t size() const { return values_.size(); }

 private:
  std::vector<double> values_;
};

struct Measured {
  Sample late;  ///< the beginning of a step after its time
  Sample poll;  ///< the duration of Server::poll
};

}  // namespace

int main(int count, char** arguments) {
  lrt::Options options;
  options.listen.port = 0;
  std::string transport;
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i];
    if (argument == "--in-poll") options.threads.io = lrt::Io::in_poll;
    else if (argument == "--transport" && i + 1 < count) transport = arguments[++i];
    else if (argument == "--body-threads" && i + 1 < count) options.threads.body_threads = static_cast<unsigned>(std::atoi(arguments[++i]));
    else return std::fprintf(stderr, "unknown argument %s\n", argument.c_str()), 2;
  }
  if (!transport.empty()) options.listen.transport = [transport](lrt::transport::TransportOptions t) { return lrt::transport::make_named(transport, std::move(t)); };
  lrt::Server server = lrt::Server::create(std::move(options)).value();

  double angle = 0;
  std::string note;
  std::vector<double> path;
  lrt::Thing arm{"arm"};
  auto position = arm.property<double>("position", lrt::unit::radian);
  arm.property("angle", [&] { return angle; }).on_write([&](double v) { angle = v; });
  arm.property("note", [&] { return note; }).on_write([&](std::string v) { note = std::move(v); });
  arm.property("path", [&] { return path; }).on_write([&](std::vector<double> v) { path = std::move(v); });
  arm.action("stop", [] {});
  server.add(std::move(arm)).value();

  std::atomic<std::promise<Measured>*> wanted{nullptr};
  std::atomic<bool> ended{false};
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);
  std::thread control([&] {
    Time next = std::chrono::steady_clock::now();
    Measured own;
    for (std::size_t steps = 0; !ended; ++steps) {
      std::this_thread::sleep_until(next += step);
      const Time begun = std::chrono::steady_clock::now();
      own.late.add(begun - next);
      position.publish(static_cast<double>(steps % 1000));
      const Time before = std::chrono::steady_clock::now();
      (void)server.poll(budget);
      own.poll.add(std::chrono::steady_clock::now() - before);
      if (std::chrono::steady_clock::now() - next > step) next = std::chrono::steady_clock::now();
      if (auto* promise = wanted.exchange(nullptr)) promise->set_value(std::exchange(own, {}));
    }
  });
  for (std::string line; std::getline(std::cin, line);) {
    std::promise<Measured> promise;
    wanted = &promise;
    Measured taken = promise.get_future().get();
    std::printf("{\"steps\": %zu%s%s}\n", taken.late.size(), taken.late.json("late").c_str(), taken.poll.json("poll").c_str());
    std::fflush(stdout);
  }
  ended = true;
  control.join();
  server.stop();
  return 0;
}
