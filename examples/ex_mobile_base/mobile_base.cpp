// SPDX-License-Identifier: Apache-2.0
#include "examples/ex_mobile_base/mobile_base.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace mobile {
namespace {

constexpr double top_speed = 0.8;     // [m/s]
constexpr double acceleration = 1.6;  // [m/s^2]
constexpr double turn_rate = 2.0;     // [rad/s]
constexpr double hall = 50;           // half the side of the hall it may drive in [m]
constexpr double pi = 3.14159265358979323846;

}  // namespace

MobileBase::MobileBase(Logger& logger) : logger_(logger) {
  logger_.info("the base is ready");
  thread_ = std::thread([this] { loop(); });
}

MobileBase::~MobileBase() {
  running_ = false;
  thread_.join();
}

Pose MobileBase::pose() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {x_, y_, heading_};
}

double MobileBase::speed() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return speed_;
}

Battery MobileBase::battery() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {std::round(volts_ * 100) / 100, false};  // what its converter resolves
}

LaserScan MobileBase::scan() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  LaserScan scan;
  scan.ranges.reserve(360);
  for (int degree = 0; degree < 360; ++degree) {  // the walls of the hall
    const double angle = heading_ + degree * pi / 180, c = std::cos(angle), s = std::sin(angle);
    const double to_x = std::abs(c) < 1e-9 ? 1e9 : (std::copysign(hall, c) - x_) / c;
    const double to_y = std::abs(s) < 1e-9 ? 1e9 : (std::copysign(hall, s) - y_) / s;
    scan.ranges.push_back(static_cast<float>(std::min(to_x, to_y)));
  }
  return scan;
}

bool MobileBase::bumperPressed() const { return bumper_; }

PidGains MobileBase::gains() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return gains_;
}

bool MobileBase::setGains(const PidGains& gains) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (driving_) return refuse("the gains cannot change while the base drives");
  gains_ = gains;
  return true;
}

bool MobileBase::driveTo(double x, double y, Progress progress, Finished finished) {
  std::function<void()> call;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopped_) return refuse("the emergency stop is pressed");
    if (bumper_) return refuse("the bumper is pressed");
    if (std::abs(x) > hall || std::abs(y) > hall) return refuse("the target is outside the hall");
    if (driving_) finish(false, "another target came", call);
    wanted_speed_ = 0;
    to_x_ = x, to_y_ = y;
    start_distance_ = std::hypot(x - x_, y - y_);
    progress_ = std::move(progress);
    finished_ = std::move(finished);
    driving_ = true;
  }
  if (call) call();
  return true;
}

void MobileBase::cancelDrive() {
  std::function<void()> call;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (driving_) finish(false, "cancelled", call);
  }
  if (call) call();
}

bool MobileBase::setSpeed(double speed) {
  std::function<void()> call;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (speed != 0 && stopped_) return refuse("the emergency stop is pressed");
    if (speed != 0 && bumper_) return refuse("the bumper is pressed");
    if (speed < 0 || speed > top_speed) return refuse("the speed is out of range");
    if (driving_) finish(false, "a speed came", call);
    wanted_speed_ = speed;
  }
  if (call) call();
  return true;
}

double MobileBase::wantedSpeed() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return wanted_speed_;
}

std::string MobileBase::lastError() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_error_;
}

void MobileBase::loop() {
  auto next = std::chrono::steady_clock::now();
  while (running_) {
    std::function<void()> call;
    step(0.005, call);
    if (call) call();
    next += std::chrono::milliseconds(5);
    std::this_thread::sleep_until(next);
  }
}

void MobileBase::step(double seconds, std::function<void()>& call) {
  const std::lock_guard<std::mutex> lock(mutex_);
  volts_ = std::max(20.0, volts_ - seconds * (0.0001 + 0.001 * speed_));
  if (stopped_ || bumper_) {
    speed_ = wanted_speed_ = 0;
    if (driving_) finish(false, stopped_ ? "emergency stop" : "the bumper was pressed", call);
    return;
  }
  if (!driving_) {
    speed_ += std::clamp(wanted_speed_ - speed_, -acceleration * seconds, acceleration * seconds);
    const double x = x_ + std::cos(heading_) * speed_ * seconds, y = y_ + std::sin(heading_) * speed_ * seconds;
    if (std::abs(x) > hall || std::abs(y) > hall) speed_ = wanted_speed_ = 0;
    else x_ = x, y_ = y;
    return;
  }
  const double dx = to_x_ - x_, dy = to_y_ - y_, distance = std::hypot(dx, dy);
  const double turn = std::remainder(std::atan2(dy, dx) - heading_, 2 * pi);
  if (distance > 0.01 && std::abs(turn) > 0.05) {
    heading_ = std::remainder(heading_ + std::clamp(turn, -turn_rate * seconds, turn_rate * seconds), 2 * pi);
    speed_ = 0;
  } else {
    speed_ = std::min({top_speed, speed_ + acceleration * seconds, std::sqrt(2 * acceleration * distance) + 0.01});
    const double moved = std::min(distance, speed_ * seconds);
    if (distance > 0) x_ += dx / distance * moved, y_ += dy / distance * moved;
  }
  const double left = std::hypot(to_x_ - x_, to_y_ - y_);
  if (left < 0.001) finish(true, {}, call);
  else if (progress_) call = [progress = progress_, left] { progress(left); };
}

void MobileBase::finish(bool arrived, const std::string& why, std::function<void()>& call) {
  driving_ = false;
  progress_ = nullptr;
  call = [finished = std::exchange(finished_, nullptr), arrived, why] {
    if (finished) finished(arrived, why);
  };
}

bool MobileBase::refuse(const std::string& why) {
  last_error_ = why;
  logger_.error(why);
  return false;
}

}  // namespace mobile
