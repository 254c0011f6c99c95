// SPDX-License-Identifier: Apache-2.0
#include "examples/ex_own_transport/epoll_transport.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>

#include <lrt/transport/session.hpp>

namespace {

using namespace lrt;
using std::chrono::milliseconds, std::chrono::nanoseconds, std::chrono::steady_clock, std::string_view;
using transport::Session;
using Time = steady_clock::time_point;
constexpr Time never = Time::max();

struct Descriptor {
  ~Descriptor() { reset(); }
  void reset(int other = -1) { std::swap(number, other), other >= 0 ? ::close(other) : 0; }
  int number = -1;
};

struct EventWaker final : Waker {  // shared: it outlives the transport, and so does its descriptor
  EventWaker() { event.reset(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)); }
  void wake() noexcept override { ::eventfd_write(event.number, 1); }
  Descriptor event;
};

struct Client {
  Client(transport::SessionContext& context, std::string peer) : session(context, std::move(peer)) {}
  Descriptor socket;
  Session session;                  // implements HTTP; this class has the socket and the clock
  std::uint32_t epoch = 0;          // of `due`
  Time due = never;                 // when the session's phase has lasted too long
  std::uint32_t awaited = EPOLLIN;  // of epoll
  std::optional<engine::Ticket> ticket;
  bool ended = false, half_closed = false, closed = false;
};

class EpollTransport final : public transport::Transport {
 public:
  explicit EpollTransport(transport::TransportOptions o) : options_(std::move(o)), clock_(options_.clock ? *options_.clock : system_clock()) {}
  ~EpollTransport() override { stop_within(milliseconds(0)); }
  void stop() override { stop_within(limits_.stop_timeout); }
  std::shared_ptr<Waker> waker() const noexcept override { return waker_; }
  transport::Capabilities capabilities() const noexcept override { return {true, false, false}; }
  std::uint16_t port() const noexcept override { return port_; }
  int descriptor() noexcept override { return epoll_.number; }  // an epoll set is readable when it has an event

  Result<void> start(engine::Handler& handler) override {
    if (context_.handler || options_.tls)
      return unexpected(Errc::invalid_option, context_.handler ? "it was started already" : "there is no TLS here");
    const std::string port = std::to_string(options_.port), where = options_.address + ", port " + port + ": ";
    addrinfo hints{}, *found = nullptr;
    hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV, hints.ai_socktype = SOCK_STREAM;
    if (::getaddrinfo(options_.address.c_str(), port.c_str(), &hints, &found) != 0)
      return unexpected(Errc::invalid_option, where + "expected a numeric address");
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> address(found, ::freeaddrinfo);
    epoll_.reset(::epoll_create1(EPOLL_CLOEXEC));
    timer_.reset(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK));
    listener_.reset(::socket(address->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    sockaddr_in6 bound{};
    socklen_t size = sizeof bound;
    const int on = 1, fd = listener_.number;
    ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (::bind(fd, address->ai_addr, address->ai_addrlen) != 0 || ::listen(fd, SOMAXCONN) != 0 ||
        ::getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &size) != 0 || !watch(EPOLL_CTL_ADD, fd, listener_id, EPOLLIN) ||
        !watch(EPOLL_CTL_ADD, timer_.number, timer_id, EPOLLIN) || !watch(EPOLL_CTL_ADD, waker_->event.number, waker_id, EPOLLIN)) {
      const int why = errno;
      return end_of_listening(), unexpected(why == EADDRINUSE ? Errc::address_in_use : Errc::io_error, where + std::strerror(why));
    }
    port_ = ntohs(bound.sin6_port);  // which is where IPv4 has it
    context_.handler = &handler;
    look_at_times(clock_.now(), Time());  // the handler may already have a deadline
    return {};
  }

  milliseconds poll(std::chrono::microseconds budget, milliseconds wait) override {
    if (!context_.handler) return milliseconds::max();
    if (ready_.empty()) {  // events left over by the last budget come first
      epoll_event events[64];
      const auto most = left_over_ ? milliseconds(0) : std::clamp(wait, milliseconds(0), milliseconds(std::chrono::hours(1)));
      const int n = ::epoll_wait(epoll_.number, events, 64, static_cast<int>(most.count()));
      for (int i = 0; i < n; ++i) ready_.emplace_back(std::uint64_t{events[i].data.u64}, std::uint32_t{events[i].events});
    }
    const auto now = clock_.now();
    const auto end = steady_clock::now() + budget;  // the machine's time, whatever clock the options have
    for (bool over = false; !ready_.empty() && !over; over = steady_clock::now() >= end) {
      const auto [id, events] = ready_.front();
      ready_.pop_front();
      step(id, events, now);
    }
    left_over_ = true;
    do {
      auto next = context_.handler->next_reply(now);
      if (next) reply(std::move(*next), now);
      else left_over_ = false;
    } while (left_over_ && steady_clock::now() < end);
    while (context_.handler->next_ready(now)) {
    }  // no client has a channel here, but the call lets the handler scan for changes and set its next deadline
    return look_at_times(now, end);
  }

 private:
  // Ids of the descriptors in the epoll set, clients from 3 on. Never reused, unlike descriptors: an event of a closed client cannot reach another client.
  enum : std::uint64_t { listener_id, waker_id, timer_id };

  bool watch(int operation, int descriptor, std::uint64_t id, std::uint32_t events) {
    epoll_event event{events, {}};
    event.data.u64 = id;
    return ::epoll_ctl(epoll_.number, operation, descriptor, &event) == 0;
  }

  void step(std::uint64_t id, std::uint32_t events, TimePoint now) {
    std::uint64_t count;
    if (id == listener_id) return accept_some(now);
    if (id == waker_id) return ::eventfd_read(waker_->event.number, &count), void();
    if (id == timer_id) return armed_ = never, ::eventfd_read(timer_.number, &count), void();
    const auto found = clients_.find(id);
    if (found == clients_.end()) return;
    Client& c = found->second;
    if (events & (EPOLLERR | EPOLLHUP)) c.closed = true;  // both directions; a client that has closed only its sending side may still read
    else if (events & EPOLLIN && wants_input(c)) receive(c, now);
    go_on(id, c, now);
  }

  static bool wants_input(const Client& c) { return !c.ended && c.session.wants_input(); }

  static void receive(Client& c, TimePoint now) {
    char buffer[16 * 1024];
    const auto got = ::recv(c.socket.number, buffer, sizeof buffer, 0);
    if (got > 0) c.session.receive({buffer, static_cast<std::size_t>(got)}, now);
    else if (got == 0) c.ended = true, c.session.end_of_input(now);
    else if (errno != EAGAIN && errno != EINTR) c.closed = true;
  }

  /// Sends the pending output, and acts on the new phase of the session.
  void go_on(std::uint64_t id, Client& c, TimePoint now) {
    bool blocked = false;
    if (const auto [first, second, third] = c.session.output(); !first.empty() && !c.closed) {
      iovec parts[] = {{const_cast<char*>(first.data()), first.size()},
                       {const_cast<char*>(second.data()), second.size()},
                       {const_cast<char*>(third.data()), third.size()}};
      msghdr message{};
      message.msg_iov = parts, message.msg_iovlen = 3;
      const auto sent = ::sendmsg(c.socket.number, &message, MSG_NOSIGNAL);
      blocked = sent < 0 && errno == EAGAIN;
      if (sent >= 0) c.session.sent(static_cast<std::size_t>(sent), now);
      else if (!blocked && errno != EINTR) c.closed = true;
    }
    if (c.session.phase() == Session::Phase::closed) c.closed = true;
    if (c.closed) return;  // look_at_times() removes it
    if (c.session.phase() == Session::Phase::lingering && !std::exchange(c.half_closed, true)) ::shutdown(c.socket.number, SHUT_WR);
    if (c.session.ticket() && !c.ticket) c.ticket = c.session.ticket(), tickets_[*c.ticket] = id;
    set_time(c, now);
    const std::uint32_t awaited = (wants_input(c) ? EPOLLIN : 0U) | (blocked ? EPOLLOUT : 0U);
    if (!blocked && !c.session.output().empty()) ready_.emplace_back(id, 0);  // the others first: there may be many pipelined
    if (awaited != std::exchange(c.awaited, awaited)) watch(EPOLL_CTL_MOD, c.socket.number, id, awaited);
  }

  static void set_time(Client& c, TimePoint now) {
    if (std::exchange(c.epoch, c.session.epoch()) == c.session.epoch() && c.due != never) return;
    const auto time = c.session.time();
    c.due = time ? now.steady + *time : never;
  }

  void reply(engine::Reply reply, TimePoint now) {
    const auto ticket = tickets_.find(reply.ticket);
    if (ticket == tickets_.end()) return;
    const auto id = ticket->second;
    Client& c = clients_.find(id)->second;
    tickets_.erase(ticket);
    c.ticket.reset();
    c.session.reply(std::move(reply), now);
    go_on(id, c, now);
  }

  void accept_some(TimePoint now) {
    for (int turn = 0; turn < 16; ++turn) {
      sockaddr_storage from{};
      socklen_t size = sizeof from;
      const int fd = ::accept4(listener_.number, reinterpret_cast<sockaddr*>(&from), &size, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (fd < 0 && (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM)) {
        accept_again_ = now.steady + milliseconds(100);  // until then it would stay readable
        watch(EPOLL_CTL_MOD, listener_.number, listener_id, 0);
      }
      if (fd < 0) return;
      char peer[NI_MAXHOST] = "";
      ::getnameinfo(reinterpret_cast<sockaddr*>(&from), size, peer, sizeof peer, nullptr, 0, NI_NUMERICHOST);
      const auto id = ++last_id_;
      Client& c = clients_.try_emplace(id, context_, peer).first->second;
      c.socket.reset(fd);
      const int on = 1;
      ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      if (!watch(EPOLL_CTL_ADD, fd, id, EPOLLIN) || clients_.size() > limits_.max_connections + 64) c.closed = true;
      else if (clients_.size() > limits_.max_connections) c.session.refuse(503, "there are too many connections", now);
      go_on(id, c, now);
    }
  }

  /// Ends sessions whose time is over, removes closed clients, and sets the timer so that descriptor() is readable at the next deadline.
  milliseconds look_at_times(TimePoint now, Time end) {
    if (accept_again_ <= now.steady) accept_again_ = watch(EPOLL_CTL_MOD, listener_.number, listener_id, EPOLLIN) ? never : now.steady;
    Time due = std::min(accept_again_, context_.handler->next_deadline().value_or(never));
    bool over = false;
    for (auto i = clients_.begin(); i != clients_.end();) {  // all of them each time: a few microseconds for a thousand
      auto& [id, c] = *i;
      if (c.due <= now.steady && !over && !c.closed) {
        c.due = never;
        c.session.expire(now);
        go_on(id, c, now);
        over = steady_clock::now() >= end;
      }
      if (!c.closed) due = std::min(due, c.due), ++i;
      else forget(c), i = clients_.erase(i);
    }
    if (!ready_.empty() || left_over_) due = Time();
    const auto rest = due == never ? nanoseconds(0) : std::max(due - now.steady, nanoseconds(1));  // 0: never
    if (due != std::exchange(armed_, due)) {
      itimerspec at{};
      at.it_value = {static_cast<time_t>(rest.count() / 1'000'000'000), static_cast<long>(rest.count() % 1'000'000'000)};
      ::timerfd_settime(timer_.number, 0, &at, nullptr);
    }
    if (due == never) return milliseconds::max();
    return due <= now.steady ? milliseconds(0) : std::chrono::ceil<milliseconds>(rest);
  }

  void forget(Client& c) {
    if (c.ticket) context_.handler->abandon(*c.ticket), tickets_.erase(*c.ticket), c.ticket.reset();
  }

  void stop_within(milliseconds time) {
    if (!context_.handler) return;
    listener_.reset(), accept_again_ = never;
    context_.stopping = true;  // each response is the last one of its connection
    const auto busy = [](const auto& item) { return item.second.ticket || !item.second.session.output().empty(); };
    const auto end = steady_clock::now() + time;
    for (auto now = end - time; now < end && std::any_of(clients_.begin(), clients_.end(), busy); now = steady_clock::now())
      poll(std::chrono::microseconds(1000), std::chrono::ceil<milliseconds>(end - now));
    for (auto& [id, c] : clients_)
      if (c.ticket) forget(c), c.session.refuse(503, "the server is stopping", clock_.now()), go_on(id, c, clock_.now());
    clients_.clear(), ready_.clear(), end_of_listening();
    context_.stopping = left_over_ = false;
  }

  void end_of_listening() {
    listener_.reset(), timer_.reset(), epoll_.reset();
    context_.handler = nullptr, port_ = 0, armed_ = accept_again_ = never;
  }

  const transport::TransportOptions options_;
  const transport::Limits& limits_ = options_.limits;
  const Clock& clock_;
  transport::SessionContext context_{limits_};  // its handler: from start() to stop()
  const std::shared_ptr<EventWaker> waker_ = std::make_shared<EventWaker>();
  Descriptor epoll_, timer_, listener_;
  std::uint16_t port_ = 0;
  std::uint64_t last_id_ = timer_id;
  std::map<std::uint64_t, Client> clients_;
  std::map<engine::Ticket, std::uint64_t> tickets_;            // the client of each open ticket
  std::deque<std::pair<std::uint64_t, std::uint32_t>> ready_;  // the events of epoll; 0: to continue
  bool left_over_ = false;
  Time accept_again_ = never, armed_ = never;
};

}  // namespace

std::unique_ptr<lrt::transport::Transport> make_epoll_transport(lrt::transport::TransportOptions options) {
  return std::make_unique<EpollTransport>(std::move(options));
}
