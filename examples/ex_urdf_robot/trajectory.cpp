// SPDX-License-Identifier: Apache-2.0
#include "examples/ex_urdf_robot/trajectory.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>

namespace ex_urdf_robot {
namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  return first == std::string_view::npos ? std::string_view() : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string_view> cells(std::string_view line) {
  std::vector<std::string_view> all;
  for (std::size_t at = 0;;) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    all.push_back(trimmed(line.substr(at, end - at)));
    if (end == line.size()) return all;
    at = end + 1;
  }
}

template <class T>
std::optional<T> number(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

lrt::Unexpected wrong(std::size_t line, const std::string& sentence) {
  lrt::Error error{lrt::Errc::expected_value, "line " + std::to_string(line) + ": " + sentence};
  error.line = static_cast<std::uint32_t>(line);
  return lrt::unexpected(std::move(error));
}
std::string quoted(std::string_view text) { return '"' + std::string(text.substr(0, 80)) + '"'; }

}  // namespace

lrt::Result<Trajectory::Column> Trajectory::column(std::string_view name, const lrt::urdf::Model& model) {
  const auto of_joint = [&](std::string_view joint, Kind kind) -> std::optional<Column> {
    for (std::size_t v = 0; v < model.variables.size(); ++v)
      if (model.joints[model.variables[v]].name == joint) return Column{kind, v};
    for (const lrt::urdf::Joint& j : model.joints)
      if (j.mimic && j.name == joint) return Column{};
    return std::nullopt;
  };
  if (const auto found = of_joint(name, Kind::position)) return *found;
  for (const auto& [prefix, kind] : {std::pair<std::string_view, Kind>{"q", Kind::position}, {"dq", Kind::velocity}, {"tau", Kind::effort}}) {
    if (name.substr(0, prefix.size()) != prefix) continue;
    const std::string_view rest = name.substr(prefix.size());
    if (const auto index = number<std::size_t>(rest); index && *index >= 1 && *index <= model.variables.size()) return Column{kind, *index - 1};
    if (rest.substr(0, 1) == "_")
      if (const auto found = of_joint(rest.substr(1), kind)) return *found;
  }
  return lrt::unexpected(lrt::Errc::expected_value, "expected a joint that moves, or q, dq or tau with a number from 1 to " +
                                                        std::to_string(model.variables.size()) + ", found column " + quoted(name));
}

lrt::Result<Trajectory> Trajectory::parse(std::string_view text, const lrt::urdf::Model& model) {
  Trajectory trajectory;
  std::vector<std::string_view> names;
  std::size_t line_number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line_number;
    if (line.empty()) continue;
    const std::vector<std::string_view> here = cells(line);
    if (names.empty()) {
      if (here[0] != "t" && here[0] != "time") return wrong(line_number, "expected the names of columns, t or time first, found " + quoted(here[0]));
      for (std::size_t i = 1; i < here.size(); ++i) {
        const auto found = column(here[i], model);
        if (!found) return wrong(line_number, found.error().message);
        for (const Column& other : trajectory.columns_)
          if (found->kind != Kind::none && other.kind == found->kind && other.variable == found->variable)
            return wrong(line_number, "expected one column for each joint, found another in " + quoted(here[i]));
        trajectory.columns_.push_back(*found);
      }
      names = here;
      continue;
    }
    if (here.size() != names.size())
      return wrong(line_number, "expected " + std::to_string(names.size()) + " numbers, found " + std::to_string(here.size()));
    for (std::size_t i = 0; i < here.size(); ++i) {
      const auto value = number<double>(here[i]);
      if (!value || !std::isfinite(*value))
        return wrong(line_number, "expected a number in column " + quoted(names[i]) + ", found " + quoted(here[i]));
      (i == 0 ? trajectory.times_ : trajectory.numbers_).push_back(*value);
    }
    const std::size_t count = trajectory.times_.size();
    if (count > 1 && trajectory.times_[count - 1] < trajectory.times_[count - 2]) return wrong(line_number, "expected times that go on");
  }
  if (names.empty()) return wrong(1, "expected the names of columns, found nothing");
  if (trajectory.times_.empty()) return wrong(line_number, "expected at least one line of numbers");
  return trajectory;
}

lrt::Result<Trajectory> Trajectory::load(const std::string& file, const lrt::urdf::Model& model) {
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in.is_open() || in.bad()) return lrt::unexpected(lrt::Errc::io_error, file + ": " + std::strerror(errno));
  auto trajectory = parse(text, model);
  if (!trajectory) {
    lrt::Error error = std::move(trajectory).error();
    error.message = file + ": " + error.message;
    return lrt::unexpected(std::move(error));
  }
  return trajectory;
}

void Trajectory::at(double seconds, std::vector<double>& positions, std::vector<double>& velocities, std::vector<double>& efforts) const noexcept {
  const double time = times_.front() + (duration() > 0 ? std::fmod(seconds, duration()) : 0);
  const std::size_t after = static_cast<std::size_t>(std::upper_bound(times_.begin(), times_.end(), time) - times_.begin());
  const std::size_t to = std::min(after, times_.size() - 1), from = after == 0 ? 0 : after - 1;
  const double span = times_[to] - times_[from], part = span > 0 ? (time - times_[from]) / span : 0;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const double a = numbers_[from * columns_.size() + c], b = numbers_[to * columns_.size() + c], value = a + part * (b - a);
    switch (columns_[c].kind) {
      case Kind::position: positions[columns_[c].variable] = value; break;
      case Kind::velocity: velocities[columns_[c].variable] = value; break;
      case Kind::effort: efforts[columns_[c].variable] = value; break;
      case Kind::none: break;
    }
  }
}

}  // namespace ex_urdf_robot
