// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

/// Motor controllers on a bus. Each has a thread of its own at 1 kHz, and may be unplugged at any moment. It knows nothing of lrt.
namespace motors {

struct Sample {
  double position = 0;  // [rad]
  double velocity = 0;  // [rad/s]
  double current = 0;   // [A]
};

class Motor {
 public:
  using Listener = std::function<void(const Sample&)>;  ///< on the thread of the motor

  explicit Motor(std::string its_name) : name_(std::move(its_name)) {}
  ~Motor() { halt(); }
  Motor(const Motor&) = delete;
  Motor& operator=(const Motor&) = delete;

  const std::string& name() const { return name_; }
  double temperature() const { return 40 + 0.001 * double(ticks_); }
  void aim(double velocity) { velocity_ = velocity; }
  /// Before run().
  void listen(Listener listener) { listener_ = std::move(listener); }
  void run() {
    thread_ = std::thread([this] {
      Sample now;
      for (auto next = std::chrono::steady_clock::now(); !ends_; std::this_thread::sleep_until(next += std::chrono::milliseconds(1))) {
        now.velocity = velocity_;
        now.position += now.velocity * 0.001;
        now.current = 0.5 + 0.1 * now.velocity;
        ++ticks_;
        if (listener_) listener_(now);
      }
    });
  }
  void halt() {
    ends_ = true;
    if (thread_.joinable()) thread_.join();
  }
  unsigned long ticks() const { return ticks_; }

 private:
  const std::string name_;
  std::atomic<bool> ends_{false};
  std::atomic<double> velocity_{0};
  std::atomic<unsigned long> ticks_{0};
  Listener listener_;
  std::thread thread_;
};

/// Owns the motors. plug() and unplug() may be called from any thread.
class Bus {
 public:
  std::shared_ptr<Motor> plug(const std::string& name) {
    const std::lock_guard lock(mutex_);
    return motors_.emplace_back(std::make_shared<Motor>(name));
  }
  void unplug(const std::string& name) {
    std::shared_ptr<Motor> gone;
    const std::lock_guard lock(mutex_);
    for (auto at = motors_.begin(); at != motors_.end(); ++at)
      if ((*at)->name() == name) {
        gone = std::move(*at);
        motors_.erase(at);
        break;
      }
    if (gone) gone->halt();
  }

 private:
  std::mutex mutex_;
  std::vector<std::shared_ptr<Motor>> motors_;
};

}  // namespace motors
