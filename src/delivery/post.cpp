// SPDX-License-Identifier: Apache-2.0
#include "src/delivery/post.hpp"

#include <string_view>

#include "src/exchange/exchange.hpp"
#include "src/exchange/tls.hpp"

namespace lrt::delivery {

PostResult post(exchange::Wire& wire, const subscription::CallbackUrl& url, const subscription::Notification& notification,
                std::size_t max_response_bytes, exchange::WaitLimit limit) {
  const bool confirms = !notification.challenge.empty();
  std::string target = url.target, signature;
  if (confirms) target += (url.target.find('?') == std::string::npos ? "?" : "&") + notification.query;
  exchange::Request request{confirms ? "GET" : "POST", target, url.authority, notification.fields.list(), {}};
  if (notification.body) request.body = *notification.body;
  if (!notification.secret.empty() && !confirms) {
    signature = exchange::sign(notification.secret, request.body);
    request.fields.push_back({"X-Hub-Signature", signature});
  }
  std::string begin;  // of the body
  const std::size_t max_begin = notification.challenge.size() + 8;
  std::size_t body = 0;
  exchange::Receiver receiver;
  if (confirms) {
    receiver.body = [&](std::string_view bytes) {
      body += bytes.size();
      begin.append(bytes.substr(0, max_begin - begin.size()));
      return true;
    };
  }
  exchange::Limits limits;
  limits.max_body_bytes = max_response_bytes;
  const exchange::Outcome outcome = exchange::exchange(wire, request, limits, limit, receiver);
  begin.resize(begin.find_last_not_of(" \t\r\n") + 1);
  const int status = outcome.header.status;
  return {status, outcome.error, outcome.silent, outcome.keep,
          confirms && status >= 200 && status < 300 && body <= max_begin && begin == notification.challenge};
}

}  // namespace lrt::delivery
