// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/callback.hpp"

#include <cstdint>
#include <functional>
#include <utility>

#include <lrt/base/clock.hpp>
#include <lrt/base/ids.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/engine/subscriptions.hpp"
#include "src/http/link.hpp"
#include "src/http/stamp.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::engine {

namespace {

std::string host_of(const std::string& url) {
  const Result<subscription::CallbackUrl> parsed = subscription::parse_callback_url(url);
  return parsed ? (parsed->secure ? "https://" : "http://") + parsed->authority : std::string();
}

/// The text for a subscriber about a failed delivery: the status of its receiver. All other failures have the same text, whether a port is closed,
/// filtered, open, or not HTTP. Otherwise a subscriber could scan the robot's network.
std::string public_reason(const subscription::DeliveryResult& result) {
  return result.error.empty() ? "the receiver responded with " + std::to_string(result.status) : "no valid response was received";
}

/// 201 with the description of the new subscription (R0.13).
http::Response description_response(const Context& context, SubscriptionResource& made, const ReceiverParts& parts) {
  const std::string location = parts.responses.iri(context, made.path);
  http::Response response;
  if (context.wants_minimal()) {
    response = parts.responses.no_content(context, 201);
    response.fields.add("Preference-Applied", "return=minimal");
  } else {
    response = parts.responses.graph(context, 201, parts.representations.describe(made, context.base, context.audience));
    response.fields.add("Content-Location", location);
  }
  response.fields.set("Vary", "Accept, Prefer");  // also of a GET
  response.fields.add("Location", location);
  return response;
}

}  // namespace

// --------------------------------------------------------------------------------------------------------------- opening

std::optional<http::Response> CallbackOpening::check(const Context& context, SubscriptionRequest& wanted, const ReceiverParts& parts) const {
  const http::Request& request = context.request();
  if (request.count("Callback") != 1)
    return parts.responses.problem(context, 400,
                                   request.find("Callback") ? "Callback: expected one field" : "a Callback field with the receiver's URL is missing");
  wanted.url = std::string(*request.find("Callback"));
  return parts.rules.refused_receiver(context, wanted.url);
}

std::string_view CallbackOpening::reached_maximum(const Subscribers& subscribers, const EngineOptions& options) const {
  const bool may_open =
      subscribers.of_clients() < options.subscriptions.max_subscriptions && subscribers.count(Protocol::callback) < options.callbacks.max_callbacks;
  return may_open ? "" : "the maximum number of web callbacks is reached";
}

/// The notifications, too, begin when the subscription is saved.
Outcome CallbackOpening::open(Context& context, SubscriptionRequest wanted, const ReceiverParts& parts, Subscriptions& subscriptions) const {
  return parts.saves.respond_when_saved(context, [&]() -> PendingSaves::Change {
    wanted.provisional = true;
    SubscriptionResource& made = subscriptions.make(context, std::move(wanted));
    return {description_response(context, made, parts), [&parts, &subscriptions, channel = made.channel](bool saved) {
              SubscriptionResource* s = parts.subscribers.find(channel);
              if (!s) return;  // its resource was removed
              if (!saved) return subscriptions.end(*s, 0, {});
              s->held = false;
              parts.schedule.announce(*s);
            }};
  });
}

// -------------------------------------------------------------------------------------------------------------- receiver

CallbackReceiver::CallbackReceiver(SubscriptionResource& s, SubscriptionRequest& request, const ReceiverParts& parts)
    : Receiver(s),
      parts_(parts),
      url_(std::move(request.url)),
      secret_(std::move(request.secret)),
      host_(host_of(url_)),
      retry_(parts.options.callbacks),
      has_confirmed_(request.has_confirmed) {}

void CallbackReceiver::made() {
  must_confirm_ = parts_.rules.must_confirm(url_);
  parts_.saves.changed();
}

void CallbackReceiver::ended() {
  if (!is_cancelling()) parts_.saves.changed();
}

Outcome CallbackReceiver::cancel(Context& context, http::Response response, Subscriptions& owner) {
  return parts_.saves.respond_when_saved(context, [&]() -> PendingSaves::Change {
    ++cancellations_;
    parts_.saves.changed();
    return {std::move(response), [&parts = parts_, &owner, channel = s_.channel](bool saved) {
              SubscriptionResource* cancelled = parts.subscribers.find(channel);
              if (!cancelled) return;
              if (saved) return owner.end(*cancelled, cancelled_code, cancelled_reason);
              --cancelled->receiver->callback()->cancellations_;
              parts.saves.changed();
            }};
  });
}

void CallbackReceiver::describe(About& about, const std::string&) const {
  about.add(vocab::hybrit::callbackURL, rdf::literal(url_, vocab::xsd::anyURI));
}

void CallbackReceiver::describe_delivery(About& about) const {
  if (!last_error_.empty()) about.add(vocab::lrt_::lastError, rdf::literal(last_error_));
  if (retry_.suspended()) about.add(vocab::lrt_::suspended, rdf::literal("true", vocab::xsd::boolean));
  if (must_confirm_) about.add(vocab::lrt_::confirmed, rdf::literal(has_confirmed_ ? "true" : "false", vocab::xsd::boolean));
}

void CallbackReceiver::overview_delivery(Overview& o) const {
  o.text("lastError", last_error_);
  o.json("suspended", retry_.suspended() ? "true" : "false");
  if (must_confirm_) o.json("confirmed", has_confirmed_ ? "true" : "false");
}

std::optional<subscription::Notification> CallbackReceiver::next(TimePoint now) {
  if (under_way_ || confirming_) return std::nullopt;
  if (must_confirm_ && !has_confirmed_) return confirmation();
  subscription::Item item = parts_.schedule.next_item(s_, now);
  if (!item) return std::nullopt;
  subscription::Notification notification;
  notification.url = url_;
  notification.body = item->body;
  notification.secret = secret_.empty() ? parts_.options.callbacks.secret : secret_;
  notification.failed_before = retry_.tried();
  notification.fields.add("Content-Type", content_type(s_.its_variant, s_.observed.variants().type_of(s_.its_variant), *item->body));
  notification.fields.add(notification_field, parts_.rules.sender(s_.base));
  notification.fields.add("ETag", item->tag);
  add_stamp(notification.fields, item);
  http::LinkWriter links;
  links.add(parts_.bases[s_.base] + s_.observed.path, "about");
  links.add(parts_.bases[s_.base] + s_.path, "via");
  links.finish(notification.fields, {});
  under_way_ = std::move(item);
  is_withdrawn_ = false;
  s_.held = true;
  return notification;
}

/// A retried notification has the same. If another one is sent instead, the one that failed is left out, too.
void CallbackReceiver::add_stamp(http::Fields& fields, const subscription::Item& item) {
  const subscription::Stamp& stamp = item->stamp;
  left_out_ = s_.left_out;
  if (failed_) left_out_ = failed_->left_out + (failed_->number == stamp.number ? 0 : left_out_ + 1);
  if (stamp.at) fields.add(http::time_field, to_xsd_date_time(*stamp.at));
  fields.add(http::sequence_field, std::to_string(stamp.number));
  if (left_out_ != 0) fields.add(http::left_out_field, std::to_string(left_out_));
  fields.add(http::series_field, series(parts_));
}

/// Asks the receiver to confirm the subscription (WebSub 5.3).
subscription::Notification CallbackReceiver::confirmation() {
  constexpr char digits[] = "0123456789ABCDEF";
  subscription::Notification question;
  question.url = url_;
  question.failed_before = retry_.tried();
  question.challenge = RandomIds().next();
  question.query = "hub.mode=subscribe&hub.challenge=" + question.challenge + "&hub.topic=";
  for (const char c : parts_.bases[s_.base] + s_.observed.path) {
    if (lrt::detail::is(c, lrt::detail::unreserved)) {
      question.query += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      ((question.query += '%') += digits[byte >> 4]) += digits[byte & 15];
    }
  }
  confirming_ = true;
  return question;
}

void CallbackReceiver::succeeded() {
  failed_.reset();
  retry_.succeeded();
  s_.suspended = false;
  last_error_.clear();
  logged_error_.clear();
  parts_.schedule.announce(s_);
}

bool CallbackReceiver::delivered(const subscription::DeliveryResult& result, TimePoint now) {
  if (!under_way_ && !confirming_) return true;  // cancelled meanwhile
  const bool confirming = std::exchange(confirming_, false);
  subscription::Item item = std::exchange(under_way_, nullptr);
  if (item) s_.held = false;
  s_.ready_announced = false;
  if (confirming && result.confirmed) {
    has_confirmed_ = true;
    ++s_.revision;
    saved_text.clear();
    parts_.saves.changed();
    succeeded();
    return true;
  }
  if (!confirming && result.status >= 200 && result.status < 300) {
    ++s_.delivered;
    ++parts_.subscribers.sent;
    succeeded();
    return true;
  }
  if (is_withdrawn_) item = nullptr;
  return failed(result, confirming, std::move(item), now);
}

bool CallbackReceiver::failed(const subscription::DeliveryResult& result, bool confirming, subscription::Item item, TimePoint now) {
  last_error_ = public_reason(result);
  const std::string& detail = result.error.empty() ? last_error_ : result.error;
  if (std::exchange(logged_error_, detail) != detail) parts_.responses.log(LogLevel::warning, s_.path + ": " + detail);
  ++s_.revision;
  if (item) failed_ = Failed{item->stamp.number, left_out_};
  const bool may_confirm_later = result.status == 0 || result.status == 408 || result.status == 429 || result.status >= 500;
  if (result.status == 410 || result.refused || (confirming && !may_confirm_later)) {
    parts_.responses.log(LogLevel::info, s_.path + " ends: " + (confirming ? "the receiver did not confirm it: " : "") + detail);
    return false;
  }
  // Jitter from the data of the subscription: the engine has no random source.
  const std::uint64_t spread = std::hash<std::string>()(s_.subscription_id) ^ (s_.backlog.dropped() * 7919 + s_.revision * 104729);
  const auto pause = retry_.failed(static_cast<double>(spread % 1024) / 1024);
  s_.suspended = retry_.suspended();
  if (!pause) {
    parts_.responses.log(LogLevel::warning, s_.path + " ends after too many failures: " + detail);
    return false;
  }
  if (s_.queues() && !s_.suspended) {
    if (item) s_.backlog.put_back(std::move(item));
  } else {
    s_.backlog.drop_items();
    s_.backlog.mark_pending();
  }
  s_.last_tag.clear();
  s_.backlog.set_due(now.steady + *pause);
  if (!s_.backlog.empty()) parts_.schedule.wait_until_due(s_);
  return true;
}

}  // namespace lrt::engine
