// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace lrt::tool {

/// Curves over the last seconds, drawn with the characters of a terminal: Braille patterns of two by four dots, or asterisks where it has no Unicode.
class Plot {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// @param window  the time from the left edge to the right one
  explicit Plot(std::chrono::duration<double> window, bool unicode, bool colours) : window_(window), unicode_(unicode), colours_(colours) {}

  /// @param name, unit  printable
  /// @return  number of the curve
  std::size_t add(std::string name, std::string unit);
  void set_unit(std::size_t curve, const std::string& unit) { curves_[curve].unit = unit; }
  void point(std::size_t curve, Time time, double value);
  /// The value cannot be drawn, but is shown in the legend.
  void text(std::size_t curve, const std::string& value) { curves_[curve].last = value; }
  /// The curve is interrupted.
  void gap(std::size_t curve, Time time);

  /// The lines, from the top, separated by line feeds. Each takes at most `width` columns.
  std::string draw(std::size_t width, std::size_t height, Time now);

 private:
  struct Point {
    Time time;
    std::optional<double> value;  ///< nullopt: a gap
  };
  struct Curve {
    std::string name, unit, last;
    std::deque<Point> points;
  };

  const std::chrono::duration<double> window_;
  const bool unicode_, colours_;
  std::vector<Curve> curves_;
};

}  // namespace lrt::tool
