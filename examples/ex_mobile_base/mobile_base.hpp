// SPDX-License-Identifier: Apache-2.0
#pragma once

// A small mobile base with two driven wheels, as a company may have it for years: classes with getters, a mutex of its own, a 200 Hz loop of
// its own, a logger of its own. It does not depend on lrt. ex_mobile_base puts it on the web without changes.

#include <atomic>
#include <cstdio>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace mobile {

/// Where the base is in the frame in which it was switched on. [m], [rad]
class Pose {
 public:
  Pose() = default;
  Pose(double x, double y, double heading) : x_(x), y_(y), heading_(heading) {}
  double x() const { return x_; }
  double y() const { return y_; }
  double heading() const { return heading_; }

 private:
  double x_ = 0, y_ = 0, heading_ = 0;
};

class Battery {
 public:
  Battery() = default;
  Battery(double volts, bool charging) : volts_(volts), charging_(charging) {}
  double getVoltage() const { return volts_; }
  bool isCharging() const { return charging_; }

 private:
  double volts_ = 24;
  bool charging_ = false;
};

/// Gains of the speed controller of both wheels.
class PidGains {
 public:
  double getP() const { return p_; }
  double getI() const { return i_; }
  double getD() const { return d_; }
  void setP(double p) { p_ = p; }
  void setI(double i) { i_ = i; }
  void setD(double d) { d_ = d; }

 private:
  double p_ = 8, i_ = 0.5, d_ = 0;
};

/// One turn of the laser scanner: a distance every degree, counter-clockwise from straight ahead. [m]
struct LaserScan {
  double first_angle_deg = 0;
  double step_deg = 1;
  std::vector<float> ranges;
};

class Logger {
 public:
  void info(const std::string& text) { line("info", text); }
  void error(const std::string& text) { line("ERROR", text); }

 private:
  void line(const char* level, const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::fprintf(stderr, "[base] %s: %s\n", level, text.c_str());
  }
  std::mutex mutex_;
};

/// All functions may be called from any thread.
class MobileBase {
 public:
  using Progress = std::function<void(double remaining_m)>;
  using Finished = std::function<void(bool arrived, const std::string& why)>;

  explicit MobileBase(Logger& logger);
  ~MobileBase();  // joins the 200 Hz loop
  MobileBase(const MobileBase&) = delete;
  MobileBase& operator=(const MobileBase&) = delete;

  Pose pose() const;
  double speed() const;  // [m/s]
  Battery battery() const;
  LaserScan scan() const;
  bool bumperPressed() const;

  PidGains gains() const;
  /// False: refused, see lastError().
  bool setGains(const PidGains& gains);

  /// Drives to a point. Both callbacks come from the loop; `finished` exactly once, unless driveTo() returns false (see lastError()).
  /// A new target ends the present one.
  bool driveTo(double x, double y, Progress progress, Finished finished);
  void cancelDrive();
  /// Drives straight ahead at this speed until another one comes [m/s]; 0: stops. False: refused, see lastError(). Ends driveTo().
  bool setSpeed(double speed);
  double wantedSpeed() const;  // [m/s]

  /// Blocks the wheels at once, and until release(). Takes no lock.
  void emergencyStop() { stopped_ = true; }
  void release() { stopped_ = false; }
  bool isStopped() const { return stopped_; }

  std::string lastError() const;
  /// Simulates a collision with the bumper, for tests and demonstrations.
  void pressBumper(bool pressed) { bumper_ = pressed; }

 private:
  void loop();
  void step(double seconds, std::function<void()>& call);
  void finish(bool arrived, const std::string& why, std::function<void()>& call);
  bool refuse(const std::string& why);

  Logger& logger_;
  mutable std::mutex mutex_;  // guards what follows
  double x_ = 0, y_ = 0, heading_ = 0, speed_ = 0, wanted_speed_ = 0, volts_ = 25.2, start_distance_ = 0;
  PidGains gains_;
  bool driving_ = false;
  double to_x_ = 0, to_y_ = 0;
  Progress progress_;
  Finished finished_;
  std::string last_error_;

  std::atomic<bool> stopped_{false}, bumper_{false}, running_{true};
  std::thread thread_;
};

}  // namespace mobile
