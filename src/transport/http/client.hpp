#pragma once

#include <sys/socket.h>
#include <sys/uio.h>

#include <cstddef>
#include <memory>

#include <lrt/base/clock.hpp>

#include "src/transport/http/loop.hpp"

namespace lrt::transport {

/// A client's place in the loop: an HTTP connection, or the WebSocket that became of one.
class Client : public Watched, public std::enable_shared_from_this<Client> {
 public:
  virtual ~Client() = default;

  /// The server stops: closes where nothing is under way.
  virtual void begin_stop(TimePoint now) = 0;
  /// True while something is owed to the client, or awaited of it, that stop() should wait for.
  virtual bool is_busy() const noexcept = 0;
  /// There is no more time for what is owed.
  virtual void give_up(TimePoint now) = 0;
  /// Drops whatever is under way.
  virtual void close() = 0;

 protected:
  explicit Client(Loop& loop) : loop_(loop) {}

  /// As send(2).
  /// @param tls  nullptr: plain
  static ssize_t send(const Socket& socket, TlsStream* tls, const Output& output) {
    if (output.second.empty() && tls == nullptr) return ::send(socket.descriptor(), output.first.data(), output.first.size(), MSG_NOSIGNAL);
    iovec parts[2] = {{const_cast<char*>(output.first.data()), output.first.size()},
                      {const_cast<char*>(output.second.data()), output.second.size()}};
    if (tls != nullptr) return tls->send(parts, 2);
    msghdr message{};
    message.msg_iov = parts;
    message.msg_iovlen = 2;
    return ::sendmsg(socket.descriptor(), &message, MSG_NOSIGNAL);
  }

  void join() {
    index_ = loop_.clients.size();
    loop_.clients.push_back(shared_from_this());
  }
  void leave() {
    Watched::unlink();
    auto self = std::move(loop_.clients[index_]);
    if (index_ + 1 < loop_.clients.size()) {
      loop_.clients[index_] = std::move(loop_.clients.back());
      loop_.clients[index_]->index_ = index_;
    }
    loop_.clients.pop_back();
    loop_.readiness.bury(std::move(self));
  }
  /// Leaves the loop to `next`.
  void make_way(std::shared_ptr<Client> next) {
    Watched::unlink();
    next->index_ = index_;
    std::swap(loop_.clients[index_], next);
    loop_.readiness.bury(std::move(next));
  }

  Loop& loop_;

 private:
  std::size_t index_ = 0;  ///< in loop_.clients
};

}  // namespace lrt::transport
