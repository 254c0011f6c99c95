#include "src/transport/http/client.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <utility>

namespace lrt::transport {
namespace {

/// Messages of one turn.
constexpr int pushes_per_turn = 8;
/// Bytes that the system accepts for a channel beyond the client's window. Without this limit it accepts megabytes: a client that
/// reads slowly would get values of minutes ago, and one that does not read would occupy that memory.
constexpr int unsent_bytes = 32 * 1024;

}  // namespace

ssize_t Client::send(const Socket& socket, TlsStream* tls, const Output& output) {
  if (output.second.empty() && tls == nullptr) return ::send(socket.descriptor(), output.first.data(), output.first.size(), MSG_NOSIGNAL);
  iovec parts[3] = {{const_cast<char*>(output.first.data()), output.first.size()},
                    {const_cast<char*>(output.second.data()), output.second.size()},
                    {const_cast<char*>(output.third.data()), output.third.size()}};
  if (tls != nullptr) return tls->send(parts, 3);
  msghdr message{};
  message.msg_iov = parts;
  message.msg_iovlen = 3;
  return ::sendmsg(socket.descriptor(), &message, MSG_NOSIGNAL);
}

void Client::join() {
  index_ = loop_.clients.size();
  loop_.clients.push_back(shared_from_this());
}

void Client::leave() {
  Watched::unlink();
  auto self = std::move(loop_.clients[index_]);
  if (index_ + 1 < loop_.clients.size()) {
    loop_.clients[index_] = std::move(loop_.clients.back());
    loop_.clients[index_]->index_ = index_;
  }
  loop_.clients.pop_back();
  loop_.readiness.defer_delete(std::move(self));
}

void Client::make_way(std::shared_ptr<Client> next) {
  Watched::unlink();
  next->index_ = index_;
  std::swap(loop_.clients[index_], next);
  loop_.readiness.defer_delete(std::move(next));
}

void Client::open_channel(engine::Channel channel, const Socket& socket) {
  if (!channel_) ::setsockopt(socket.descriptor(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes, sizeof unsent_bytes);
  close_channel();
  channel_ = channel;
  loop_.channels.emplace(static_cast<std::uint64_t>(channel), this);
}

void Client::close_channel() noexcept {
  Linked<TurnTag>::unlink();
  if (channel_) loop_.channels.erase(static_cast<std::uint64_t>(*channel_));
  channel_.reset();
}

void Client::push_some(TimePoint now) {
  Linked<TurnTag>::unlink();
  for (int turn = 0; turn < pushes_per_turn; ++turn) {
    if (!channel_ || !wants_message()) return;
    auto push = loop_.context.handler->next_push(*channel_, now);
    if (!push) return;
    send_message(*std::move(push), now);
    if (loop_.readiness.is_over()) break;
  }
  if (channel_ && wants_message()) loop_.turns.push_back(*this);
}

}  // namespace lrt::transport
