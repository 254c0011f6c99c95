// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/urdf.hpp>

namespace ex_urdf_robot {

/// A recording of joints as comma-separated values, played repeatedly.
///
/// The first line names the columns: `t` or `time` [s] first, then joints by name, or q1 ... qN for the first N of the model's variables;
/// `dq` and `tau` before a number, or with '_' before a name, are velocities and efforts. Columns of joints that mimic others are ignored.
class Trajectory {
 public:
  /// @par Errors  expected_value, with the line; io_error
  static lrt::Result<Trajectory> parse(std::string_view text, const lrt::urdf::Model& model);
  static lrt::Result<Trajectory> load(const std::string& file, const lrt::urdf::Model& model);

  /// Writes the values of the model's variables at a time after the start [s], interpolated linearly between two lines. Variables without a
  /// column are unchanged. The vectors have the length of the model's variables. No allocation.
  void at(double seconds, std::vector<double>& positions, std::vector<double>& velocities, std::vector<double>& efforts) const noexcept;
  double duration() const noexcept { return times_.back() - times_.front(); }
  std::size_t lines() const noexcept { return times_.size(); }

 private:
  enum class Kind { none, position, velocity, effort };
  struct Column {
    Kind kind = Kind::none;
    std::size_t variable = 0;
  };
  static lrt::Result<Column> column(std::string_view name, const lrt::urdf::Model& model);

  std::vector<Column> columns_;  // without the time
  std::vector<double> times_, numbers_;
};

}  // namespace ex_urdf_robot
