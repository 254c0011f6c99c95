// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/receiver.hpp"

#include <utility>

#include "src/engine/receivers/protocols.hpp"
#include "src/engine/subscriptions.hpp"

namespace lrt::engine {

std::string_view Receiver::name() const noexcept { return entry_of(s_.protocol).name; }

Outcome Receiver::cancel(Context&, http::Response response, Subscriptions& owner) {
  owner.end(s_, cancelled_code, cancelled_reason);  // this object is destroyed now
  return response;
}

ClosingChannel Receiver::closing_channel(std::uint16_t code, std::string reason) const {
  ClosingChannel closing;
  closing.text = s_.its_variant.is_text();
  closing.code = code;
  closing.reason = std::move(reason);
  if (code != cancelled_code)  // a cancelled subscription gets no more
    while (auto item = s_.backlog.take_item()) closing.items.push_back(std::move(item));
  return closing;
}

}  // namespace lrt::engine
