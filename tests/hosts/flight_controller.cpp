// SPDX-License-Identifier: Apache-2.0
#include "tests/hosts/flight_controller.hpp"

#include <algorithm>
#include <stdexcept>

namespace flight {

const std::vector<Parameter>& table() {
  static const std::vector<Parameter> all = [] {
    std::vector<Parameter> made;
    const auto add = [&](std::string name, Kind kind, double min, double max, double standard, const char* unit, const char* text) {
      made.push_back({std::move(name), kind, min, max, standard, unit, text});
    };
    for (const std::string axis : {"ROLL", "PITCH", "YAW"}) {
      const std::string rate = "MC_" + axis + "RATE_";
      add(rate + "P", Kind::real, 0, 0.5, 0.15, "", "Proportional gain of the rate");
      add(rate + "I", Kind::real, 0, 1, 0.2, "", "Integral gain of the rate");
      add(rate + "D", Kind::real, 0, 0.01, 0.003, "", "Derivative gain of the rate");
      add(rate + "MAX", Kind::real, 0, 1800, 220, "deg/s", "Largest rate");
      add("MC_" + axis + "_P", Kind::real, 0, 12, 6.5, "", "Proportional gain of the angle");
      add("TRIM_" + axis, Kind::real, -0.5, 0.5, 0, "", "Trim");
    }
    for (int channel = 1; channel <= 18; ++channel) {
      const std::string of = "RC" + std::to_string(channel) + "_";
      add(of + "MIN", Kind::integer, 800, 1500, 1000, "us", "Shortest pulse");
      add(of + "TRIM", Kind::integer, 800, 2200, 1500, "us", "Pulse in the middle");
      add(of + "MAX", Kind::integer, 1500, 2200, 2000, "us", "Longest pulse");
      add(of + "REV", Kind::flag, 0, 1, 0, "", "Reversed");
      add(of + "DZ", Kind::integer, 0, 100, 10, "us", "Dead zone");
    }
    for (int output = 1; output <= 16; ++output) {
      const std::string of = "PWM_" + std::to_string(output) + "_";
      add(of + "FUNC", Kind::integer, 0, 1000, 0, "", "What it drives");
      add(of + "MIN", Kind::integer, 800, 1400, 1000, "us", "Shortest pulse");
      add(of + "MAX", Kind::integer, 1600, 2200, 2000, "us", "Longest pulse");
      add(of + "REV", Kind::flag, 0, 1, 0, "", "Reversed");
      add(of + "FAIL", Kind::integer, -1, 2200, -1, "us", "Pulse after a failure");
      add(of + "DIS", Kind::integer, 800, 2200, 900, "us", "Pulse while disarmed");
    }
    for (int battery = 1; battery <= 3; ++battery) {
      const std::string of = "BAT" + std::to_string(battery) + "_";
      add(of + "N_CELLS", Kind::integer, 0, 16, 4, "", "Cells in series");
      add(of + "V_EMPTY", Kind::real, 2.5, 4, 3.5, "V", "Voltage of an empty cell");
      add(of + "V_FULL", Kind::real, 3.5, 4.5, 4.05, "V", "Voltage of a full cell");
      add(of + "LOW", Kind::real, 0.1, 0.5, 0.15, "norm", "Warning below this charge");
    }
    for (int sensor = 0; sensor < 12; ++sensor)
      for (const char* field : {"XOFF", "YOFF", "ZOFF", "XSCALE", "YSCALE", "ZSCALE"})
        add("CAL_" + std::to_string(sensor) + "_" + field, Kind::real, -10, 10, field[1] == 'S' ? 1 : 0, "", "Calibration");
    for (int number = 1; made.size() < 333; ++number)
      add("LND_T" + std::to_string(number), Kind::real, 0, 60, number * 0.5, "s", "A time of landing");
    return made;
  }();
  return all;
}

double Parameters::get(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  if (name == "CAL_3_XOFF") throw std::runtime_error("sensor 3 does not answer");  // one is broken, as always
  if (const auto found = values_.find(name); found != values_.end()) return found->second;
  const auto known = std::find_if(table().begin(), table().end(), [&](const Parameter& p) { return p.name == name; });
  return known->standard;
}

std::string Parameters::set(const std::string& name, double value) {
  const std::lock_guard lock(mutex_);
  if (is_armed_) return "not while the motors are armed";
  values_[name] = value;
  ++changes_;
  return {};
}

}  // namespace flight
