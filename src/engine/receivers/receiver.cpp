// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/receiver.hpp"

#include <string>
#include <utility>

#include "src/engine/receivers/protocols.hpp"
#include "src/engine/subscriptions.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::engine {

std::string_view Receiver::name() const noexcept { return entry_of(s_.protocol).name; }

Outcome Receiver::cancel(Context&, http::Response response, Subscriptions& owner) {
  owner.end(s_, cancelled_code, cancelled_reason);  // this object is destroyed now
  return response;
}

ClosingChannel Receiver::closing_channel(std::uint16_t code, std::string reason) {
  ClosingChannel closing;
  closing.code = code;
  closing.reason = std::move(reason);
  while (auto part = rest()) closing.items.push_back({std::move(part->message), part->text, {}});
  if (code == cancelled_code || code == withdrawn_code) return closing;  // the subscriber gets no more
  while (const auto item = s_.backlog.take_item()) {
    s_.left_out = s_.changes.sent(item->stamp.number);
    ++s_.messages;
    Push part = push_of(item);
    closing.items.push_back({std::move(part.message), part.text, item->stamp});
    while (auto more = rest()) closing.items.push_back({std::move(more->message), more->text, item->stamp});
  }
  return closing;
}

std::string Receiver::series(const ReceiverParts& parts) const {
  const std::string id = std::to_string(static_cast<std::uint64_t>(s_.observed.id));
  // The id itself would count all resources, also those that the subscriber may not see.
  return parts.series + "." + std::to_string(rdf::hash_bytes(id, rdf::hash_seeds().bytes));
}

}  // namespace lrt::engine
