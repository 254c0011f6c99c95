// SPDX-License-Identifier: Apache-2.0
// A flight controller with a table of parameters. Their names, kinds, bounds and texts are known at run time only: the program has a reflection of
// its own, as many have. What stands between the two lines of '=' is all that lrt needs of it, for 5 parameters or 333.
//
//   ex_parameter_table --port 8080 --parameters 333 &  curl -H 'Accept: application/json' http://127.0.0.1:8080/fc/parameters/MOT_SPIN_MIN

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/rdf/dynamic_type.hpp>

namespace {

volatile std::sig_atomic_t ended = 0;
void on_signal(int) { ended = 1; }

// The program's own table, which knows nothing of lrt.
using Held = std::variant<bool, std::int64_t, double, std::string>;
struct Parameter {
  std::string name, text, unit;
  Held value;
  double low = 0, high = 0;
  std::vector<std::string> names;  // of a text: those that it may be
};

std::deque<Parameter> table(std::size_t count) {
  std::deque<Parameter> t{{"MOT_SPIN_MIN", "Lowest throttle of the motors", "", 0.15, 0, 0.3, {}},
                          {"ANGLE_MAX", "Largest lean angle", "deg", 30.0, 10, 80, {}},
                          {"COMPASS_ENABLE", "Use the compass", "", true, 0, 0, {}},
                          {"FS_ACTION", "On loss of the link", "", std::string("land"), 0, 0, {"none", "land", "return"}},
                          {"SERIAL_BAUD", "Rate of the serial port", "", std::int64_t{57600}, 1200, 921600, {}}};
  while (t.size() < count) t.push_back({"SERVO" + std::to_string(t.size()) + "_TRIM", "Trim in microseconds", "", std::int64_t{1500}, 800, 2200, {}});
  return t;
}

// ==============================================================================================================================================
using lrt::rdf::DynamicType;
using lrt::rdf::Value;

DynamicType type_of(const Parameter& p) {
  if (!p.names.empty()) return DynamicType::enumeration(p.names).value();
  if (std::holds_alternative<bool>(p.value)) return DynamicType::of<bool>();
  if (std::holds_alternative<std::int64_t>(p.value)) return DynamicType::of<std::int64_t>();
  return std::holds_alternative<double>(p.value) ? DynamicType::of<double>() : DynamicType::of<std::string>();
}
Value read(const Parameter& p) {
  return std::visit([](const auto& v) { return Value(v); }, p.value);
}
void write(Parameter& p, const Value& v) {
  if (v.boolean()) p.value = *v.boolean();
  if (v.integer()) p.value = *v.integer();
  if (v.real()) p.value = *v.real();
  if (v.text()) p.value = *v.text();
}
void serve(lrt::Thing& controller, std::deque<Parameter>& parameters) {
  for (Parameter& p : parameters) {
    auto property = controller.property("parameters/" + p.name, type_of(p), [&p] { return read(p); });
    property.title(p.text, "en").on_write([&p](const Value& v) { write(p, v); });
    if (p.unit == "deg") property.unit(lrt::unit::degree);
    if (p.low < p.high) property.between(p.low, p.high);
  }
}
// ==============================================================================================================================================

}  // namespace

int main(int argc, char** argv) {
  int port = 8080, count = 12;
  for (int i = 1; i + 1 < argc; i += 2) (std::string_view(argv[i]) == "--port" ? port : count) = std::atoi(argv[i + 1]);
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  std::deque<Parameter> parameters = table(static_cast<std::size_t>(count));
  lrt::Thing controller{"fc"};
  serve(controller, parameters);

  lrt::Options options;
  options.listen.port = static_cast<std::uint16_t>(port);
  auto server = lrt::Server::create(std::move(options));
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  if (auto added = server->add(std::move(controller)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  std::printf("listening on http://127.0.0.1:%d/\n", static_cast<int>(server->port()));
  std::fflush(stdout);
  while (ended == 0) {
    server->poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}
