// SPDX-License-Identifier: Apache-2.0
// The bytes that a client sees, recorded in wire.txt. LRT_RECORD_WIRE=1 writes the responses of that file anew.

#include "tests/conformance/wire.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/server.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

constexpr const char* path = LRT_SOURCE_DIR "/tests/conformance/wire.txt";

std::string escaped(std::string_view bytes, const std::string& mark) {
  static constexpr char digits[] = "0123456789ABCDEF";
  std::string lines;
  bool begins = true;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    const char c = bytes[at];
    if (begins) lines += mark;
    begins = c == '\n';
    const auto byte = static_cast<unsigned char>(c);
    const std::size_t same = std::min(bytes.find_first_not_of(c, at), bytes.size()) - at;
    if (c >= 'a' && c <= 'z' && same >= 64) {
      lines += "\\" + std::to_string(same) + "*" + c;
      at += same - 1;
      continue;
    }
    if (c == '\n') lines += '\n';
    else if (c == '\r') lines += "\\r";
    else if (c == '\\') lines += "\\\\";
    else if (byte < 0x20 || byte >= 0x7F) lines += {'\\', 'x', digits[byte >> 4], digits[byte & 0x0FU]};
    else lines += c;
  }
  if (!begins) lines += "\\\n";
  return lines;
}

void write_recording(const WireRecording& recording) {
  std::ofstream out(path);
  out << recording.preface;
  bool first = true;
  for (const auto& exchange : recording.exchanges) {
    if (!std::exchange(first, false)) out << "\n";
    out << "exchange " << exchange.name << "\n";
    for (const auto& step : exchange.steps) {
      if (!step.set.empty()) out << "@ " << step.set << "\n";
      else out << escaped(step.request, "> ") << (step.response.empty() ? ".\n" : escaped(step.response, "< "));
    }
  }
}

/// The sample robot on a port, and one client.
class Player {
 public:
  Player() : server_(Server::create(options()).value()) {
    server_.add(robot_.arm()).value();
    server_.add(robot_.tool()).value();
    set("angle 11");  // at the clock's time, unlike the value that was published before
    client_ = std::make_unique<RawClient>(server_.port());
  }

  void set(const std::string& what) {
    const std::string name = what.substr(0, what.find(' ')), value = what.substr(what.find(' ') + 1);
    if (name == "angle") robot_.angle_handle->publish(std::stod(value));
    else if (name == "count") robot_.count = std::stoi(value);
    else if (name == "locked") robot_.locked = value != "0";
    else if (name == "clock") clock_.advance(std::chrono::milliseconds(std::stol(value)));
    else if (name == "grip") grip(value);
    else throw std::runtime_error("wire.txt: unknown: @ " + what);
    for (int i = 0; i < 3; ++i) server_.poll();
  }

  /// Sends, and returns what comes until `enough` says so, or the end.
  template <class Enough>
  std::string exchange(const std::string& request, bool last, Enough enough) {
    client_->received.clear();
    client_->send(request);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    bool half_closed = false;
    while (!client_->ended && std::chrono::steady_clock::now() < end) {
      client_->step();
      if (last && client_->all_sent() && !std::exchange(half_closed, true)) client_->half_close();
      server_.poll();
      client_->step();
      if (!last && client_->all_sent() && enough(client_->received)) break;
    }
    return client_->received;
  }

 private:
  void grip(const std::string& value) {
    for (int i = 0; i < 1000 && robot_.grips.empty(); ++i) server_.poll();
    REQUIRE(!robot_.grips.empty());
    if (value == "progress") return robot_.grips.back().progress(0.5);
    Responder responder = std::move(robot_.grips.back());
    robot_.grips.pop_back();
    if (value == "succeed") responder.succeed();
    else if (value == "fail") responder.fail("it slipped");
    else if (value != "drop") throw std::runtime_error("wire.txt: unknown: @ grip " + value);
  }
  Options options() {
    Options o;
    o.listen.port = 0;
    o.threads.io = Io::in_poll;
    o.clock = &clock_;
    o.security.allowed_hosts = {"robot.example:80"};  // entity tags and lengths do not depend on the port
    o.ids = std::make_shared<FixedIds>();
    return o;
  }

  FakeClock clock_;
  SampleRobot robot_;
  Server server_;
  std::unique_ptr<RawClient> client_;
};

/// The number of the run is random: it becomes 0.
std::string without_run(std::string response) {
  constexpr std::string_view field = "\r\nRobot-Time: ";
  for (std::size_t at = response.find(field); at != std::string::npos; at = response.find(field, at + 1)) {
    for (std::size_t i = at + field.size(); i < response.size() && response[i] != '/'; ++i) response[i] = '0';
  }
  return response;
}

/// With a recording, the client waits for as many bytes as that has; without one, until the server has had nothing to say for long.
void play(WireExchange& exchange, bool record) {
  Player player;
  for (auto& step : exchange.steps) {
    if (!step.set.empty()) {
      player.set(step.set);
      continue;
    }
    const bool last = &step == &exchange.steps.back();
    std::size_t size = 0;
    int quiet = 0;
    const std::string response = without_run(player.exchange(step.request, last, [&](const std::string& received) {
      if (!record) return received.size() >= step.response.size();
      quiet = received.size() == size ? quiet + 1 : 0;
      size = received.size();
      return quiet == 1000;
    }));
    if (record) step.response = response;
    else CHECK(escaped(response, "< ") == escaped(step.response, "< "));
  }
}

}  // namespace

TEST_CASE("the bytes on the wire are those of the recording", "[conformance][wire][R0.1]") {
  const bool record = std::getenv("LRT_RECORD_WIRE") != nullptr;
  auto recording = read_recording(path);
  REQUIRE(recording.exchanges.size() > 100);
  for (auto& exchange : recording.exchanges) {
    INFO("exchange " << exchange.name);
    play(exchange, record);
  }
  if (record) write_recording(recording);
}
