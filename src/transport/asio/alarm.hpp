#pragma once

#include <sys/timerfd.h>
#include <unistd.h>

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/basic_stream_descriptor.hpp>
#include <chrono>
#include <cstdint>

namespace lrt::transport {

/// Ends a wait of the io_context at an instant, which its own waits, of whole milliseconds, would miss. One timerfd: setting it anew is
/// one system call, while a timer of asio costs two and runs a handler for the time that was replaced.
class Alarm {
 public:
  explicit Alarm(boost::asio::io_context& io) : watched_(io) {}

  bool open() {
    if (watched_.is_open()) return true;
    const int descriptor = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    boost::system::error_code error;
    if (descriptor < 0 || watched_.assign(descriptor, error)) {
      if (descriptor >= 0) ::close(descriptor);
      return false;
    }
    wait();
    return true;
  }
  void close() {
    boost::system::error_code ignored;
    watched_.close(ignored);
  }

  /// @param due  by a clock of which `now` is the present; it stands for the machine's time until then
  void set(std::chrono::steady_clock::time_point due, std::chrono::steady_clock::time_point now) {
    if (due == due_) return;
    due_ = due;
    const auto left = std::chrono::duration_cast<std::chrono::nanoseconds>(due - now).count();
    itimerspec time{};
    time.it_value.tv_sec = static_cast<time_t>(left / 1'000'000'000);
    time.it_value.tv_nsec = static_cast<long>(left % 1'000'000'000);
    ::timerfd_settime(watched_.native_handle(), 0, &time, nullptr);
  }

 private:
  void wait() {
    watched_.async_wait(decltype(watched_)::wait_read, [this](const boost::system::error_code& error) {
      if (error) return;
      std::uint64_t count = 0;
      [[maybe_unused]] const auto got = ::read(watched_.native_handle(), &count, sizeof count);
      due_ = {};
      wait();
    });
  }

  boost::asio::posix::basic_stream_descriptor<boost::asio::io_context::executor_type> watched_;
  std::chrono::steady_clock::time_point due_{};  ///< that it is set to
};

}  // namespace lrt::transport
