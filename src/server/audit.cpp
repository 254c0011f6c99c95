// SPDX-License-Identifier: Apache-2.0
#include "src/server/audit.hpp"

#include <algorithm>
#include <utility>

#include <lrt/engine/query_service.hpp>
#include <lrt/security/audit_file.hpp>

#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/http/target.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {
namespace {

constexpr std::size_t max_text_bytes = 1024;
constexpr std::size_t max_lines = 1'000'000;

/// At most max_text_bytes of a text.
void append_json(std::string& out, std::string_view text) {
  append_ascii_json_string(out, text.substr(0, max_text_bytes));
  if (text.size() > max_text_bytes) out.insert(out.size() - 1, "...");
}

void append_member(std::string& out, std::string_view name, std::string_view text) {
  out.append(",\"").append(name).append("\":");
  append_json(out, text);
}

/// RFC 9110 9.2.1
bool is_safe(std::string_view method) noexcept { return method == "GET" || method == "HEAD" || method == "OPTIONS"; }

bool ends_with(std::string_view text, std::string_view end) noexcept {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

/// @param principal  nullptr: an anonymous caller
std::string begin_line(std::chrono::system_clock::time_point time, std::string_view event, const security::Principal* principal,
                       std::string_view address) {
  std::string line = "{\"time\":\"" + to_xsd_date_time(time) + "\",\"event\":\"";
  line.append(event).append("\"");
  if (principal) append_member(line, "principal", principal->name);
  else line += ",\"principal\":null";
  append_member(line, "address", address);
  return line;
}

}  // namespace

// ----------------------------------------------------------------------------------------------------------- AuditWriter

void AuditWriter::stop() noexcept {
  stopping_ = true;
  waker_.wake();
}

std::uint64_t AuditWriter::write(std::string line) noexcept {
  const std::size_t bytes = line.size();
  try {
    const std::size_t bytes_before = waiting_bytes_.fetch_add(bytes, std::memory_order_relaxed);
    if (waiting_.fetch_add(1, std::memory_order_relaxed) < max_lines_ && bytes_before + bytes <= max_bytes_) {
      lines_.put(std::move(line));
      waker_.wake();
      return ++number_;
    }
  } catch (...) {  // no memory for the line
  }
  waiting_.fetch_sub(1, std::memory_order_relaxed);
  waiting_bytes_.fetch_sub(bytes, std::memory_order_relaxed);
  drop();
  return 0;
}

void AuditWriter::count(ServerCounters& all) const {
  all.audit_dropped = all_dropped_.load(std::memory_order_relaxed);
  all.audit_waiting = waiting_.load(std::memory_order_relaxed);
}

void AuditWriter::drop() noexcept {
  dropped_.fetch_add(1, std::memory_order_relaxed);
  all_dropped_.fetch_add(1, std::memory_order_relaxed);
}

void AuditWriter::run() noexcept {
  while (true) {
    const bool last = stopping_;
    lines_.take_all([this](std::string line) {
      waiting_.fetch_sub(1, std::memory_order_relaxed);
      waiting_bytes_.fetch_sub(line.size(), std::memory_order_relaxed);
      give(std::move(line));
    });
    if (last) break;
    waker_.wait(std::chrono::hours(1));
  }
  if (dropped_.load(std::memory_order_relaxed) != 0) give(R"({"event":"end"})");
}

/// Of the failures until the sink succeeds, the first.
void AuditWriter::say_once(const char* why) noexcept {
  if (std::exchange(sink_fails_, true) || !log_) return;
  try {
    log_(LogLevel::error, std::string("the audit sink threw an exception, and lines are lost: ") + why);
  } catch (...) {}
}

void AuditWriter::give(std::string line) noexcept {
  std::uint64_t dropped = 0;
  try {
    dropped = dropped_.exchange(0, std::memory_order_relaxed);
    if (dropped != 0) line.insert(1, "\"dropped\":" + std::to_string(dropped) + ",");
    sink_(line);
    sink_fails_ = false;
    return;
  } catch (const std::exception& e) { say_once(e.what()); } catch (...) {
    say_once("an exception that is not a std::exception");
  }
  dropped_.fetch_add(dropped, std::memory_order_relaxed);
  drop();
}

// ----------------------------------------------------------------------------------------------------------------- Audit

Audit::Audit(SharedEngine& server)
    : server_(server),
      options_(server.options().security.audit),
      query_path_(server.options().query ? server.options().query->limits().path : std::string()),
      output_(options_.file ? std::unique_ptr<AuditOutput>(security::AuditFile::Place{server}.output_to(*options_.file))
                            : std::make_unique<AuditWriter>(options_, server.waking_log())),
      hold_(output_->hold()) {}

Result<void> Audit::check(const security::Audit& options) {
  const auto wrong = [](const std::string& option, const std::string& expected, std::size_t found) {
    return unexpected(Errc::invalid_option, "security.audit." + option + ": expected " + expected + ", found " + std::to_string(found));
  };
  if (options.max_waiting_lines == 0 || options.max_waiting_lines > max_lines)
    return wrong("max_waiting_lines", "1 to 1000000", options.max_waiting_lines);
  if (options.max_waiting_bytes < 64 * 1024 || options.max_waiting_bytes > 1024 * 1024 * 1024)
    return wrong("max_waiting_bytes", "65536 to 1073741824", options.max_waiting_bytes);
  if (options.sink && options.file) return unexpected(Errc::invalid_option, "security.audit: expected sink or file, found both");
  return {};
}

Result<void> Audit::prepare() {
  if (Result<void> checked = check(options_); !checked) return checked;
  if (Result<void> claimed = output_->prepare(); !claimed) return claimed;
  Result<Thread> started = start_thread("lrt-audit", server_.options().threads.own, [this] { output_->run(); });
  if (!started) return Unexpected{std::move(started).error()};
  thread_ = *std::move(started);
  return {};
}

void Audit::join() noexcept {
  output_->stop();
  Thread ended;
  {
    const std::lock_guard lock(mutex_);
    if (!thread_.is_current()) ended = std::move(thread_);
  }
  ended.join();
}

bool Audit::is_current_thread() noexcept {
  const std::lock_guard lock(mutex_);
  return thread_.is_current();
}

void Audit::count(ServerCounters& all) const { output_->count(all); }

void Audit::wake_all() noexcept {
  if (hold_ && server_.is_stopping()) hold_->end();
}

Audit::Record Audit::record_of(const http::Request& request, const Result<engine::Caller>& caller, TimePoint now) const {
  const auto target = http::split_target(request.target);
  const std::string_view path = target ? target->path : request.target.substr(0, request.target.find_first_of("?#"));
  Record record{now.utc, {caller ? caller->principal : nullptr, std::string(request.peer)}, std::string(request.method), std::string(path)};
  record.waits = hold_ && !is_safe(request.method) && !server_.engine().is_stop(request);
  return record;
}

bool Audit::is_wanted(const Record& record, int status, http::Denial denial, bool subscribes) const {
  const bool is_query = record.method == "POST" && !query_path_.empty() && record.path == query_path_;
  if (options_.reads || subscribes || !(is_safe(record.method) || is_query)) return true;
  return denial != http::Denial::none || status == 401 || status == 403 || status == 421 || status == 429;
}

void Audit::handled(const http::Request& request, const Result<engine::Caller>& caller, engine::Outcome& outcome, TimePoint now) {
  Record record = record_of(request, caller, now);
  if (const auto* deferred = std::get_if<engine::Deferred>(&outcome)) {
    deferred_.insert_or_assign(number_of(deferred->ticket), std::move(record));
  } else if (const auto* upgraded = std::get_if<engine::Upgraded>(&outcome)) {
    (void)finished(record, upgraded->response);
  } else if (const auto* streamed = std::get_if<engine::Streamed>(&outcome)) {
    (void)finished(record, streamed->response);
  } else {
    auto& response = std::get<http::Response>(outcome);
    const auto line = finished(record, response);
    if (!line || !must_wait(record, response)) return;
    engine::Reply reply{engine::Ticket{AuditHold::first_ticket | *line}, std::move(response)};
    if (hold_->keep(*line, reply)) outcome = engine::Deferred{reply.ticket};
    else response = std::move(reply.response);
  }
}

void Audit::refused(const http::Request& request, const Result<engine::Caller>& caller, const http::Response& response, TimePoint now) {
  (void)finished(record_of(request, caller, now), response);
}

bool Audit::replied(engine::Reply& reply) {
  const auto found = deferred_.find(number_of(reply.ticket));
  if (found == deferred_.end()) return true;
  const Record record = std::move(found->second);
  deferred_.erase(found);
  const auto line = finished(record, reply.response);
  if (!line || reply.channel || !must_wait(record, reply.response)) return true;
  return !hold_->keep(*line, reply);
}

void Audit::end_waits(TimePoint now) {
  if (hold_) hold_->end_waits(now);
}

void Audit::abandoned(engine::Ticket ticket) {
  if (hold_) hold_->abandon(ticket);
  const auto found = deferred_.find(number_of(ticket));
  if (found == deferred_.end()) return;
  const Record record = std::move(found->second);
  deferred_.erase(found);
  http::Response none;
  none.status = 0;
  (void)finished(record, none);
}

bool Audit::must_wait(const Record& record, const http::Response& response) const noexcept {
  return record.waits && response.status >= 200 && response.status < 300;
}

std::optional<std::uint64_t> Audit::finished(const Record& record, const http::Response& response) {
  const auto location = response.fields.find("Location");
  const auto made =
      !location ? made_.end() : std::find_if(made_.begin(), made_.end(), [&](const std::string& path) { return ends_with(*location, path); });
  const bool subscribes = made != made_.end();
  if (!is_wanted(record, response.status, response.denial, subscribes)) return std::nullopt;
  std::string line = begin_line(record.time, subscribes ? "subscription_made" : "request", record.sender.principal.get(), record.sender.address);
  append_member(line, "method", record.method);
  append_member(line, "resource", record.path);
  if (subscribes) {
    Subscription& subscription = subscriptions_[*made];
    subscription.sender = record.sender;
    append_member(line, "subscription", *made);
    append_member(line, "observed", subscription.resource);
    append_member(line, "protocol", subscription.protocol);
    made_.erase(made);
  }
  if (response.status != 0) line += ",\"status\":" + std::to_string(response.status);
  else append_member(line, "reason", "abandoned");
  if (response.denial != http::Denial::none) append_member(line, "reason", http::to_string(response.denial));
  return output_->write(line += '}');
}

void Audit::take(engine::Outputs& outputs) {
  for (const engine::SubscriptionEvent& event : std::exchange(outputs.subscription_events, {})) try {
      changed(event, server_.clock().now());
    } catch (...) { dropped(); }
}

void Audit::changed(const engine::SubscriptionEvent& event, TimePoint now) {
  if (event.kind == engine::SubscriptionEvent::Kind::made) {
    subscriptions_[event.path] = {event.resource, event.protocol, {}};
    if (event.requested) made_.push_back(event.path);
    return;
  }
  const auto found = subscriptions_.find(event.path);
  if (found == subscriptions_.end()) return;
  const Subscription ended = std::move(found->second);
  subscriptions_.erase(found);
  const auto unanswered = std::find(made_.begin(), made_.end(), event.path);
  if (unanswered != made_.end()) {  // its request gets another response
    made_.erase(unanswered);
    return;
  }
  std::string line = begin_line(now.utc, "subscription_ended", ended.sender.principal.get(), ended.sender.address);
  append_member(line, "subscription", event.path);
  append_member(line, "observed", ended.resource);
  append_member(line, "protocol", ended.protocol);
  output_->write(line += '}');
}

std::unique_ptr<Service> make_audit(SharedEngine& server) {
  const Options& options = server.options();
  const security::Audit& audit = options.security.audit;
  if (!audit.sink && !audit.file && Audit::check(audit)) return nullptr;  // its prepare() reports wrong options
  return std::make_unique<Audit>(server);
}

}  // namespace lrt
