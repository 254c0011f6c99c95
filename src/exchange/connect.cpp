// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/connect.hpp"

#include <string>
#include <utility>

namespace lrt::exchange {

Result<std::unique_ptr<Wire>> connect(const http::Url& url, const std::vector<const Address*>& addresses, const Trust& trust, WaitLimit limit) {
  Error why{Errc::io_error, "\"" + url.host + "\" has no address"};
  for (std::size_t i = 0; i < addresses.size(); ++i) {
    const Instant now = std::chrono::steady_clock::now();
    const WaitLimit part{now + (limit.until - now) / static_cast<long>(addresses.size() - i), limit.stop_descriptor};
    const std::string where = "\"" + url.host + "\" at " + addresses[i]->text + ": ";
    Result<std::unique_ptr<Wire>> wire = Wire::open(*addresses[i], url.port, part);
    if (!wire) {
      why = std::move(wire).error();
      why.message = where + (why.code == Errc::timed_out ? "timed out while connecting" : why.message);
      continue;
    }
    if (url.secure) {
      const Result<std::shared_ptr<const ClientTls>> tls = trust();
      if (!tls) return unexpected(tls.error());
      if (Result<void> secured = (*wire)->secure(**tls, url.host, limit); !secured) {
        const Error& error = secured.error();
        return unexpected(error.code, where + "TLS: " + (error.code == Errc::timed_out ? "the handshake timed out" : error.message));
      }
    }
    return wire;
  }
  return unexpected(std::move(why));
}

}  // namespace lrt::exchange
