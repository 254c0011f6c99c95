#include "src/transport/asio/readiness.hpp"

#include <sys/epoll.h>
#include <unistd.h>

#include "src/transport/asio/client.hpp"

namespace lrt::transport {

bool Readiness::open() {
  if (watched_.is_open()) return true;
  const int descriptor = ::epoll_create1(EPOLL_CLOEXEC);
  boost::system::error_code error;
  if (descriptor < 0 || watched_.assign(descriptor, error)) {
    if (descriptor >= 0) ::close(descriptor);
    return false;
  }
  wait();
  return true;
}

void Readiness::close() {
  boost::system::error_code ignored;
  watched_.close(ignored);
  buried_.clear();
}

void Readiness::watch(Client& client, int descriptor, bool wanted, bool& added) {
  epoll_event event{};
  event.events = wanted ? EPOLLIN : 0u;  // errors are always told
  event.data.ptr = &client;
  ::epoll_ctl(watched_.native_handle(), added ? EPOLL_CTL_MOD : EPOLL_CTL_ADD, descriptor, &event);
  added = true;
}

void Readiness::bury(std::shared_ptr<Client> client) { buried_.push_back(std::move(client)); }

void Readiness::forget_buried() {
  if (!serving_) buried_.clear();
}

bool Readiness::is_over() noexcept {
  const auto now = std::chrono::steady_clock::now();
  if (!end_) end_ = now + budget_;
  return now >= *end_;
}

void Readiness::wait() {
  watched_.async_wait(decltype(watched_)::wait_read, [this](const boost::system::error_code& error) {
    if (error) return;
    serve();
    wait();
  });
}

void Readiness::serve() {
  constexpr int batch = 128;
  epoll_event events[batch];
  serving_ = true;
  for (bool over = false; !over;) {
    const int ready = ::epoll_wait(watched_.native_handle(), events, batch, 0);
    // What the budget leaves over is told again: the set is level-triggered.
    for (int i = 0; i < ready && !over; ++i) {
      static_cast<Client*>(events[i].data.ptr)->on_ready((events[i].events & (EPOLLERR | EPOLLHUP)) != 0);
      over = is_over();
    }
    buried_.clear();
    if (ready <= 1) break;  // with more there was time for others to become ready
  }
  serving_ = false;
}

}  // namespace lrt::transport
