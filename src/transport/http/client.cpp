// SPDX-License-Identifier: Apache-2.0
#include "src/transport/http/client.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <string>
#include <utility>

namespace lrt::transport {
namespace {

/// The limit of buffered bytes for a client that does not read; at least one message.
constexpr std::size_t max_bytes_at_once = 16 * 1024;
/// Messages of one client before other clients have their turn.
constexpr int turns_at_once = 8;
/// Bytes that the system accepts for a channel beyond the client's window. Without this limit it accepts megabytes: a client that
/// reads slowly would get values of minutes ago, and one that does not read would occupy that memory.
constexpr int unsent_bytes = 32 * 1024;
/// For Client::send(). TLS has TlsStream::chunk_bytes.
constexpr std::size_t max_bytes_per_call = 64 * 1024;

}  // namespace

ssize_t Client::send(const Socket& socket, TlsStream* tls, const OutputParts& output) {
  if (tls != nullptr) return tls->send(output.data(), output.size());
  std::size_t count = 0;
  for (std::size_t left = max_bytes_per_call; count < output.size() && left > 0; ++count) {
    const std::size_t bytes = output.data()[count].iov_len;
    if (bytes > left) {  // its first bytes, alone or behind the others
      if (count == 0) return ::send(socket.descriptor(), output.data()->iov_base, left, MSG_NOSIGNAL);
      break;
    }
    left -= bytes;
  }
  if (count == 1) return ::send(socket.descriptor(), output.data()->iov_base, output.data()->iov_len, MSG_NOSIGNAL);
  msghdr message{};
  message.msg_iov = const_cast<iovec*>(output.data());
  message.msg_iovlen = count;
  return ::sendmsg(socket.descriptor(), &message, MSG_NOSIGNAL);
}

void Client::failed(const char* why) noexcept {
  close();
  try {
    loop_.log(LogLevel::error, std::string("a connection is closed: ") + why);
  } catch (...) {}
}

void Client::join() {
  index_ = loop_.clients.size();
  loop_.clients.push_back(shared_from_this());
}

void Client::leave() noexcept {
  Watched::unlink();
  auto self = std::move(loop_.clients[index_]);
  if (index_ + 1 < loop_.clients.size()) {
    loop_.clients[index_] = std::move(loop_.clients.back());
    loop_.clients[index_]->index_ = index_;
  }
  loop_.clients.pop_back();
  loop_.readiness.defer_delete(std::move(self));
}

void Client::make_way(std::shared_ptr<Client> next) noexcept {
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
  PushRound& round = loop_.pushes;
  for (int turn = 0; turn < turns_at_once; ++turn) {
    if (max_messages() == 0) return;
    round.clear();
    round.add(*this);
    loop_.context.handler->take_pushes(round.requests, round.pushes, now);
    const engine::PushRequest request = round.requests.front();
    take_turn(round.pushes.data(), request.given, now, false);
    if (!request.more) return;
    if (loop_.readiness.is_over()) break;
  }
  if (max_messages() > 0) loop_.turns.push_back(*this);
}

void PushRound::add(Client& client) {
  clients.push_back(&client);
  try {
    requests.push_back({*client.channel(), client.max_messages(), max_bytes_at_once});
  } catch (...) {
    clients.pop_back();
    throw;
  }
}

}  // namespace lrt::transport
