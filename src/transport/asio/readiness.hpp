#pragma once

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/basic_stream_descriptor.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

namespace lrt::transport {

class Client;

/// The connections that wait for input, as one epoll set that asio watches as one descriptor.
///
/// asio arms every wait anew: an epoll_ctl and a handler for each request. Here a keep-alive connection is registered once, asio's part
/// is paid once per batch of ready connections. One thread.
class Readiness {
 public:
  explicit Readiness(boost::asio::io_context& io) : watched_(io) {}

  bool open();
  void close();

  /// Client::on_ready() follows whenever there is input (while `wanted`) or the connection breaks. `added` is the caller's memory.
  void watch(Client& client, int descriptor, bool wanted, bool& added);
  /// Keeps what was closed until no event can point to it and none of its functions is under way.
  void bury(std::shared_ptr<Client> client);
  /// None is under way.
  void forget_buried();

  /// From here on ready connections are served for this long, at least one.
  void set_budget(std::chrono::microseconds budget) noexcept {
    budget_ = budget;
    end_.reset();
  }
  /// Whether the budget that set_budget() gave is used up.
  bool is_over() noexcept;

 private:
  void wait();
  void serve();

  boost::asio::posix::basic_stream_descriptor<boost::asio::io_context::executor_type> watched_;
  std::chrono::microseconds budget_{0};
  std::optional<std::chrono::steady_clock::time_point> end_;
  std::vector<std::shared_ptr<Client>> buried_;
  bool serving_ = false;
};

}  // namespace lrt::transport
