// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

/// The parameter system of a flight controller: a table with its own reflection. It knows nothing of lrt.
namespace flight {

enum class Kind : std::uint8_t { integer, real, flag };

struct Parameter {
  std::string name;  ///< "MC_ROLLRATE_P"
  Kind kind;
  double min, max, standard;
  std::string unit;  ///< "deg/s", "V", "s", "norm", "us"; empty: none
  std::string text;
};

/// 333 parameters, as its generator writes them.
const std::vector<Parameter>& table();

/// Their values. Any thread.
class Parameters {
 public:
  double get(const std::string& name) const;
  /// @return  empty, or why not
  std::string set(const std::string& name, double value);
  void arm(bool is) { is_armed_ = is; }
  std::size_t changes() const { return changes_; }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, double> values_;
  bool is_armed_ = false;
  std::size_t changes_ = 0;
};

}  // namespace flight
