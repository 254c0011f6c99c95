// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "tools/lrt/terminal.hpp"

namespace lrt::tool {
namespace {

constexpr std::size_t max_points = 100'000;  // of one curve; above it the oldest are removed
constexpr int colours[] = {36, 33, 35, 32, 34, 31};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// The dots of the curves.
class Canvas {
 public:
  Canvas(std::size_t columns, std::size_t rows) : columns_(columns), rows_(rows), dots_(columns * rows, 0), curve_(columns * rows, 0) {}
  double width() const noexcept { return static_cast<double>(columns_ * 2 - 1); }
  double height() const noexcept { return static_cast<double>(rows_ * 4 - 1); }

  void dot(long x, long y, std::size_t curve) noexcept {
    if (x < 0 || y < 0 || x >= static_cast<long>(columns_ * 2) || y >= static_cast<long>(rows_ * 4)) return;
    static constexpr std::uint8_t bits[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
    const std::size_t cell = static_cast<std::size_t>(y / 4) * columns_ + static_cast<std::size_t>(x / 2);
    dots_[cell] |= bits[y % 4][x % 2];
    curve_[cell] = curve;
  }
  void line(double x0, double y0, double x1, double y1, std::size_t curve) noexcept {
    const double longest = 4 * (width() + height());
    const double steps = std::min(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0))), longest);
    for (double i = 0; i <= steps; ++i) {
      const double part = steps > 0 ? i / steps : 0;
      dot(std::lround(x0 + (x1 - x0) * part), std::lround(y0 + (y1 - y0) * part), curve);
    }
  }
  std::string row(std::size_t row, bool unicode, bool with_colours) const {
    std::string text;
    for (std::size_t i = 0; i < columns_; ++i) {
      const std::uint8_t dots = dots_[row * columns_ + i];
      if (dots == 0) {
        text += ' ';
        continue;
      }
      std::string cell = "*";
      if (unicode) {  // U+2800 and the dots
        const unsigned code = 0x2800u + dots;
        cell = {static_cast<char>(0xE0 | code >> 12), static_cast<char>(0x80 | (code >> 6 & 0x3F)), static_cast<char>(0x80 | (code & 0x3F))};
      }
      if (with_colours) text += "\033[" + std::to_string(colours[curve_[row * columns_ + i] % std::size(colours)]) + "m" + cell + "\033[0m";
      else text += cell;
    }
    return text;
  }

 private:
  const std::size_t columns_, rows_;
  std::vector<std::uint8_t> dots_;
  std::vector<std::size_t> curve_;
};

}  // namespace

std::size_t Plot::add(std::string name, std::string unit) {
  curves_.push_back({std::move(name), std::move(unit), {}, {}});
  return curves_.size() - 1;
}

void Plot::point(std::size_t curve, Time time, double value) {
  if (!std::isfinite(value)) return gap(curve, time);
  Curve& c = curves_[curve];
  c.points.push_back({time, value});
  c.last = number(value);
  if (c.points.size() > max_points) c.points.pop_front();
}

void Plot::gap(std::size_t curve, Time time) { curves_[curve].points.push_back({time, std::nullopt}); }

std::string Plot::draw(std::size_t width, std::size_t height, Time now) {
  const auto ago = [&](Time time) { return std::chrono::duration<double>(now - time).count(); };
  double low = INFINITY, high = -INFINITY;
  for (Curve& curve : curves_) {
    // One point before the window stays: from it the first line begins.
    while (curve.points.size() > 1 && ago(curve.points[1].time) > window_.count()) curve.points.pop_front();
    for (const Point& point : curve.points)
      if (point.value) low = std::min(low, *point.value), high = std::max(high, *point.value);
  }
  const bool has_points = low <= high;
  if (!has_points) low = 0, high = 1;
  if (high - low < std::max(std::abs(high), std::abs(low)) * 1e-9 || high == low) {
    const double margin = high == 0 ? 1 : std::abs(high) * 0.1;
    low -= margin;
    high += margin;
  } else {
    const double margin = (high - low) * 0.05;
    low -= margin;
    high += margin;
  }

  std::vector<std::string> lines;
  for (std::size_t i = 0; i < curves_.size(); ++i) {
    const Curve& curve = curves_[i];
    const std::string colour = colours_ ? "\033[" + std::to_string(colours[i % std::size(colours)]) + "m" : "";
    const std::string text =
        cut(curve.name + "  " + (curve.last.empty() ? "-" : curve.last) + (curve.unit.empty() ? "" : " " + curve.unit), width > 2 ? width - 2 : 0);
    lines.push_back(colour + (unicode_ ? "━" : "-") + (colours_ ? "\033[0m " : " ") + text);
  }
  constexpr std::size_t least = 2;  // rows of the canvas
  while (lines.size() > 1 && lines.size() + least + 1 > height) lines.pop_back();
  const std::size_t label_width = std::max({columns_of(number(low)), columns_of(number(high)), columns_of(number((low + high) / 2))});
  if (height < lines.size() + least + 1 || width < label_width + 8) {  // too small for a graph
    if (lines.size() > height) lines.resize(height);
  } else {
    const std::size_t rows = height - lines.size() - 1, columns = width - label_width - 2;
    Canvas canvas(columns, rows);
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      std::optional<std::pair<double, double>> before;
      const auto x_of = [&](Time time) { return (1 - ago(time) / window_.count()) * canvas.width(); };
      for (const Point& point : curves_[i].points) {
        if (!point.value) {
          before.reset();
          continue;
        }
        const double x = x_of(point.time), y = (high - *point.value) / (high - low) * canvas.height();
        if (before) {  // a value holds until the next one: a line of what has not changed is level, then it rises
          const double hold = std::max(before->first, std::min(x, before->first + canvas.width()));
          const double step = std::max(before->first, hold - canvas.width() / window_.count() * 0.25);
          canvas.line(std::max(before->first, 0.0), before->second, std::max(step, 0.0), before->second, i);
          canvas.line(std::max(step, 0.0), before->second, std::max(x, 0.0), y, i);
        }
        before = {x, y};
      }
      if (before) canvas.line(std::max(before->first, 0.0), before->second, canvas.width(), before->second, i);
    }
    for (std::size_t row = 0; row < rows; ++row) {
      const std::string label = row == 0 ? number(high) : row == rows - 1 ? number(low) : row == rows / 2 ? number((low + high) / 2) : "";
      std::string line(label_width - columns_of(label), ' ');
      line += label + (unicode_ ? (label.empty() ? " │" : " ┤") : " |") + canvas.row(row, unicode_, colours_);
      while (!line.empty() && line.back() == ' ') line.pop_back();
      lines.push_back(std::move(line));
    }
    const std::string left = "-" + number(window_.count()) + " s", right = "now";
    std::string axis(label_width + 2, ' ');
    axis += left;
    if (columns > left.size() + right.size()) axis.append(columns - left.size() - right.size(), ' ');
    lines.push_back(cut(axis + right, width));
  }
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "\n") + line;
  return text;
}

}  // namespace lrt::tool
