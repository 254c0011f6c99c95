#pragma once

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/basic_socket_acceptor.hpp>
#include <optional>

#include <lrt/base/result.hpp>

#include "src/transport/asio/loop.hpp"

namespace lrt::transport {

/// Accepts connections, at the expense of idle ones when there are as many as the limit allows. When descriptors run out it neither spins nor leaves clients without a word: a reserve descriptor serves
/// to accept and refuse them, and without that it pauses.
class Listener {
 public:
  explicit Listener(Loop& loop);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  Result<void> open();
  void close();
  std::uint16_t port() const noexcept { return port_; }

  /// When accepting goes on after a pause.
  std::optional<Deadlines::Instant> resumes_at() const noexcept { return resumes_at_; }
  void resume(TimePoint now);

 private:
  using Acceptor = boost::asio::basic_socket_acceptor<boost::asio::ip::tcp, boost::asio::io_context::executor_type>;

  void wait();
  void accept_some();
  void admit(int descriptor, std::string peer);
  bool has_room() const noexcept;
  bool make_room();
  bool refuse_with_reserve();
  void pause(const char* reason);

  Loop& loop_;
  Acceptor acceptor_;
  boost::asio::ip::tcp protocol_ = boost::asio::ip::tcp::v4();
  std::uint16_t port_ = 0;
  int reserve_ = -1;
  std::optional<Deadlines::Instant> resumes_at_;
};

}  // namespace lrt::transport
