// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/graph/core.hpp"

#include <algorithm>
#include <cstring>

#include "src/base/random.hpp"
#include "src/ros2/graph/cdr.hpp"
#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {
inline namespace v0 {

namespace {

constexpr const char* entities_topic = "ros_discovery_info";
constexpr const char* entities_type = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
constexpr std::chrono::milliseconds patience_for_heartbeat{1000};  ///< of a server that is matched
constexpr std::size_t max_idle_clients = 64;
constexpr unsigned max_jobs_in_a_row = 64;     ///< strangers can send samples without end: deadlines have their turn
constexpr std::chrono::seconds idle_life{30};  ///< of a client or the readers of an action without work

bool has_encapsulation(std::string_view payload) noexcept { return payload.size() >= 4 && payload[0] == 0 && (payload[1] == 0 || payload[1] == 1); }

}  // namespace

// ---- subscriptions

void Subscription::State::received(const dds::Received& sample) {
  const auto shared = core.lock();
  if (shared == nullptr) return;
  const std::lock_guard<std::recursive_mutex> lock(mutex);
  if (!alive) return;
  if (sample.payload.size() > shared->options.limits.max_sample_bytes) {
    ++shared->counts.large;
    return;
  }
  if (!options.hash.empty()) {
    auto known = fitting.find(sample.writer);
    if (known == fitting.end()) {
      if (fitting.size() >= shared->options.limits.max_endpoints) fitting.clear();
      known =
          fitting.emplace(sample.writer, prefix_of(sample.writer) == shared->participant->prefix() || shared->known.fits(sample.writer, options.hash))
              .first;
    }
    if (!known->second) {
      ++shared->counts.other_version;
      return;
    }
  }
  if (options.minimum_interval.count() > 0) {
    const TimePoint now = std::chrono::steady_clock::now();
    if (last.size() >= shared->options.limits.max_endpoints) last.clear();
    const auto [before, is_first] = last.try_emplace(sample.writer, now);
    if (!is_first && now - before->second < options.minimum_interval) return;
    before->second = now;
  }
  ++shared->counts.samples;
  shared->counts.sample_bytes += sample.payload.size();
  in_sink = true;
  sink(Sample{std::make_shared<const std::string>(sample.payload), sample.source, std::chrono::system_clock::now(), sample.writer});
  in_sink = false;
  if (!alive) sink = {};  // the sink has ended its own subscription
}

void Subscription::State::lost(std::uint64_t count) {
  if (const auto shared = core.lock()) shared->counts.lost += count;
}

void Subscription::State::matched() {
  if (const auto shared = core.lock(); shared != nullptr && is_internal) shared->wake_clients();
}

void Subscription::State::end() {
  {
    const std::lock_guard<std::recursive_mutex> lock(mutex);
    alive = false;
    if (!in_sink) sink = {};
  }
  if (ended) ended();
  if (const auto shared = core.lock()) {
    shared->subscriptions_changed_ = true;
    shared->wake();
  }
}

Subscription::Subscription() noexcept = default;
Subscription::Subscription(std::shared_ptr<State> state) noexcept : state_(std::move(state)) {}
Subscription::Subscription(Subscription&&) noexcept = default;
Subscription& Subscription::operator=(Subscription&& other) noexcept {
  Subscription(std::move(other)).state_.swap(state_);
  return *this;
}
Subscription::~Subscription() {
  if (state_ != nullptr) state_->end();
}

// ---- publishers

Publisher::Publisher() noexcept = default;
Publisher::Publisher(std::shared_ptr<State> state) noexcept : state_(std::move(state)) {}
Publisher::Publisher(Publisher&&) noexcept = default;
Publisher& Publisher::operator=(Publisher&& other) noexcept {
  Publisher(std::move(other)).state_.swap(state_);
  return *this;
}
Publisher::~Publisher() {
  if (state_ == nullptr) return;
  const auto core = state_->core.lock();
  if (core == nullptr) return;
  // On the graph's thread: the caller may hold locks of DDS.
  core->post([state = state_, shared = core.get()] { shared->remove(state); });
}
Result<void> Publisher::publish(std::string_view payload) const {
  if (state_ == nullptr) return unexpected(Errc::closed, "the publisher is empty");
  if (!has_encapsulation(payload)) return unexpected(Errc::expected_value, "a payload begins with an encapsulation of CDR");
  if (payload.size() > state_->max_bytes) return unexpected(Errc::limit_exceeded, "the sample is larger than GraphLimits::max_sample_bytes");
  const std::shared_lock<std::shared_mutex> lock(state_->mutex);
  if (state_->writer == nullptr) return unexpected(Errc::closed, "the graph is closed");
  const auto written = state_->writer->write({}, payload, nullptr);
  if (!written) return unexpected(written.error());
  return {};
}
std::size_t Publisher::readers() const noexcept {
  if (state_ == nullptr) return 0;
  const std::shared_lock<std::shared_mutex> lock(state_->mutex);
  return state_->writer == nullptr ? 0 : state_->writer->readers();
}

// ---- calls

void Call::State::finish(Result<Bytes> response) {
  UniqueFunction<void(Result<Bytes>)> running;
  const std::lock_guard<std::recursive_mutex> lock(mutex);
  if (!alive) return;
  alive = false;
  if (const auto shared = core.lock()) shared->ended(*this);
  running = std::move(done);
  if (running) running(std::move(response));
}

void Call::State::end() {
  Call present;
  {
    const std::lock_guard<std::recursive_mutex> lock(mutex);
    if (alive) {
      alive = false;
      if (const auto shared = core.lock()) shared->ended(*this);
    }
    done = {};
    present = std::move(inner);
  }
}

Call::Call() noexcept = default;
Call::Call(std::shared_ptr<State> state) noexcept : state_(std::move(state)) {}
Call::Call(Call&&) noexcept = default;
Call& Call::operator=(Call&& other) noexcept {
  Call(std::move(other)).state_.swap(state_);
  return *this;
}
Call::~Call() {
  if (state_ != nullptr) state_->end();
}

// ---- a client of a service

ServiceClient::ServiceClient(GraphCore& core, std::string service_of_it, std::string type_of_it, IdentityForm form_of_it)
    : service(std::move(service_of_it)), type(std::move(type_of_it)), form(form_of_it), core_(core) {
  unsigned char bytes[8];
  fill_random(bytes, sizeof bytes);
  std::memcpy(&number_, bytes, sizeof number_);
}

Result<void> ServiceClient::create() {
  dds::EndpointOptions options;
  options.reliable = true;
  options.depth = core_.options.limits.max_calls;
  if (form == IdentityForm::header) {
    // As the RMW of Cyclone: a server finds by it which reader belongs to the writer of a request.
    static constexpr char digits[] = "0123456789abcdef";
    options.user_data = "clientid=";
    unsigned char id[16]{};
    std::memcpy(id, core_.participant->prefix().data(), 12);
    std::memcpy(id + 12, &number_, 4);
    for (std::size_t i = 0; i < sizeof id; ++i) {
      if (i != 0) options.user_data += '.';
      options.user_data += digits[id[i] >> 4];
      options.user_data += digits[id[i] & 15];
    }
    options.user_data += ';';
  }
  options.is_watched = true;
  options.topic = "rr" + service + "Reply";
  options.type = dds_type_of(type + "_Response");
  // The reader comes first: a server that has the request has then heard of the reader of its response.
  auto reader = core_.participant->reader(options, *this);
  if (!reader) return unexpected(reader.error());
  responses_ = std::move(*reader);
  id_ = responses_->gid();
  options.topic = "rq" + service + "Request";
  options.type = dds_type_of(type + "_Request");
  auto writer = core_.participant->writer(options, this);
  if (!writer) return unexpected(writer.error());
  requests_ = std::move(*writer);
  requests_gid_ = requests_->gid();
  core_.own(id_, false, true);
  core_.own(requests_gid_, true, true);
  return {};
}

/// Whether a server is matched in both directions. That this side is says nothing of the other one: Cyclone drops what it gets from a writer before the
/// first heartbeat, and a response could be written before the server knows of its reader. RMWs wait for the reader, other servers do not. Fast DDS
/// sends the heartbeat once, when it matches: if the server did not know this participant by then, new endpoints are made, and it is sent again.
/// Nothing is sent without this: it could be lost, or be carried out without a response.
bool ServiceClient::is_ready(const ServerFound& server, TimePoint now) {
  if (requests_ == nullptr || responses_ == nullptr) return false;
  std::map<Gid, TimePoint> matched;
  bool ready = false, is_late = false;
  for (const auto& [reader, writer] : server.pairs) {
    if (!requests_->is_matched(reader) || !responses_->is_matched(writer)) continue;
    const auto before = matched_.find(writer);
    const TimePoint since = before == matched_.end() ? now : before->second;
    matched.emplace(writer, since);
    ready = ready || (requests_->is_heard(reader) && responses_->is_heard(writer));
    is_late = is_late || now >= since + patience_for_heartbeat;
  }
  matched_ = std::move(matched);
  if (ready || !is_late || !sent_.empty()) return ready;
  release();
  if (const auto created = create(); !created) core_.log(LogLevel::warning, created.error().message);
  return false;
}

void ServiceClient::release() {
  matched_.clear();
  if (responses_ != nullptr) core_.own(id_, false, false);
  if (requests_ != nullptr) core_.own(requests_gid_, true, false);
  requests_.reset();
  responses_.reset();
}

void ServiceClient::add(Pending pending) { waiting_.push_back(std::move(pending)); }

void ServiceClient::react(TimePoint now) {
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    Pending& pending = *it;
    if (!pending.call->is_alive()) {
      it = waiting_.erase(it);
      continue;
    }
    const ServerFound server = core_.known.server(service, type);
    const bool is_gone = server.pairs.empty() || server.form != form;
    const bool is_ready = !is_gone && this->is_ready(server, now);
    if (!is_ready && !is_gone && now < pending.deadline) {
      ++it;
      continue;
    }
    Pending sending = std::move(pending);
    it = waiting_.erase(it);
    if (!is_ready) {
      sending.call->finish(unexpected(
          Errc::unavailable,
          is_gone ? "the server of " + service + " is gone, or another one of another form has come"
                  : "the server of " + service + " does not acknowledge: its QoS or its type is another one, or the network loses packets"));
      continue;
    }
    used = now;
    std::string request = std::move(sending.request);
    sending.servers = server.pairs;
    Result<std::int64_t> written = unexpected(Errc::unavailable, {});
    if (form == IdentityForm::header) {
      const std::int64_t sequence = ++last_;
      newest_.store(sequence, std::memory_order_release);
      const bool little = request[1] == 1;
      std::string head = request.substr(0, 4);
      for (const std::uint64_t word : {number_, static_cast<std::uint64_t>(sequence)})
        for (unsigned i = 0; i < 8; ++i) head += static_cast<char>(static_cast<unsigned char>(word >> (little ? 8 * i : 56 - 8 * i)));
      written = requests_->write(head, std::string_view(request).substr(4), nullptr);
      if (written) written = sequence;
    } else {
      // Responses are processed on this thread: none is before the number is known. Servers take the reader's identity from here.
      const dds::Identity related{id_, -1};
      newest_.store(INT64_MAX, std::memory_order_release);
      written = requests_->write({}, request, &related);
    }
    if (!written) {
      sending.call->finish(unexpected(written.error()));
      continue;
    }
    if (sending.waits_for_ever) sending.deadline = TimePoint::max();
    sent_.emplace(*written, std::move(sending));
  }
  for (auto it = sent_.begin(); it != sent_.end();) {
    Pending& pending = it->second;
    const auto is_there = [&](const std::pair<Gid, Gid>& pair) { return core_.known.is_there(pair.first) && core_.known.is_there(pair.second); };
    const bool is_dead = !pending.call->is_alive();
    const bool is_gone = std::none_of(pending.servers.begin(), pending.servers.end(), is_there);
    if (!is_dead && !is_gone && now < pending.deadline) {
      ++it;
      continue;
    }
    const auto call = std::move(pending.call);
    it = sent_.erase(it);
    if (is_dead) continue;
    if (is_gone) call->finish(unexpected(Errc::unconfirmed, "the server of " + service + " is gone since the request was sent"));
    else call->finish(unexpected(Errc::timed_out, "the server of " + service + " does not respond"));
  }
}

void ServiceClient::close(const Error& error) {
  for (Pending& pending : waiting_) pending.call->finish(unexpected(error));
  for (auto& [sequence, pending] : sent_) pending.call->finish(unexpected(error));
  waiting_.clear();
  sent_.clear();
  release();
}

TimePoint ServiceClient::next() const noexcept {
  TimePoint next = TimePoint::max();
  for (const Pending& pending : waiting_) next = std::min(next, pending.deadline);
  if (!waiting_.empty())
    for (const auto& [writer, since] : matched_) next = std::min(next, since + patience_for_heartbeat);
  for (const auto& [sequence, pending] : sent_) next = std::min(next, pending.deadline);
  return next;
}

void ServiceClient::matched() { core_.wake_clients(); }

/// On a thread of DDS. All clients of a service get all responses: those of others are dropped here.
void ServiceClient::received(const dds::Received& sample) {
  if (!has_encapsulation(sample.payload)) return;
  std::int64_t sequence = 0;
  Bytes payload;
  if (form == IdentityForm::header) {
    CdrReader reader(sample.payload);
    if (reader.u64() != number_) return;
    sequence = reader.i64();
    if (!reader.ok()) return;
    if (sequence <= 0 || sequence > newest_.load(std::memory_order_acquire)) return;
    auto bytes = std::make_shared<std::string>(sample.payload.substr(0, 4));
    bytes->append(sample.payload.substr(20));
    payload = std::move(bytes);
  } else {
    if (sample.related.gid != id_ && sample.related.gid != requests_gid_) return;
    sequence = sample.related.sequence;
    payload = std::make_shared<const std::string>(sample.payload);
  }
  // The client is looked up again: it may be gone when the job runs.
  core_.post_sample(payload->size(), [this, weak = core_.weak_from_this(), sequence, payload] {
    if (const auto core = weak.lock()) respond(sequence, payload);
  });
}

/// @pre  on the graph's thread; GraphCore removes a client only when no job of it can be left
void ServiceClient::respond(std::int64_t sequence, Bytes payload) {
  const auto pending = sent_.find(sequence);
  if (pending == sent_.end()) return;
  const auto call = std::move(pending->second.call);
  sent_.erase(pending);
  call->finish(std::move(payload));
}

// ---- the core

GraphCore::GraphCore(GraphOptions options_of_it) : options(std::move(options_of_it)), known(options.limits, [this] { wake(); }) {}
GraphCore::~GraphCore() = default;

void GraphCore::log(LogLevel level, std::string_view text) const noexcept {
  if (!options.log) return;
  try {
    options.log(level, text);
  } catch (...) {  // as LogCallback says
  }
}

void GraphCore::wake() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    woken_ = true;
  }
  condition_.notify_one();
}

bool GraphCore::post(UniqueFunction<void()> job) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closing_) return false;
    jobs_.push_back(std::move(job));
  }
  condition_.notify_one();
  return true;
}

void GraphCore::post_at(TimePoint at, UniqueFunction<void()> job) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closing_) return;
    timers_.emplace(at, std::move(job));
  }
  condition_.notify_one();
}

void GraphCore::post_sample(std::size_t bytes, UniqueFunction<void()> job) {
  const std::size_t cost = bytes + 256;
  if (waiting_bytes_.fetch_add(cost) + cost > options.limits.max_waiting_bytes) {
    waiting_bytes_ -= cost;
    ++counts.lost;
    return;
  }
  if (!post([this, cost, job = std::move(job)]() mutable {
        waiting_bytes_ -= cost;
        job();
      }))
    waiting_bytes_ -= cost;
}

Result<void> GraphCore::join() {
  auto started = start_thread("lrt-ros2", options.thread, [this] { run(); });
  if (!started) return unexpected(started.error());
  thread_ = std::move(*started);
  std::unique_lock<std::mutex> lock(mutex_);
  condition_.wait(lock, [this] { return joined_; });
  return join_result_;
}

void GraphCore::close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closing_ = true;
  }
  condition_.notify_one();
  thread_.join();
}

/// The graph's thread. It joins the domain, so that the threads of DDS inherit what this thread has.
void GraphCore::run() {
  Result<void> result;
  auto made = dds::Participant::join(options, "enclave=/;", known);
  if (!made) {
    result = unexpected(made.error());
  } else {
    participant = std::move(*made);
    dds::EndpointOptions reading;
    reading.topic = entities_topic;
    reading.type = entities_type;
    reading.reliable = reading.transient_local = true;
    auto reader = participant->reader(reading, *this);
    if (!reader) {
      result = unexpected(reader.error());
      participant.reset();
    } else {
      nodes_reader_ = std::move(*reader);
      own(nodes_reader_->gid(), false, true);
    }
  }
  const bool failed = !result;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    join_result_ = std::move(result);
    joined_ = true;
    condition_.notify_all();
  }
  if (failed) return;
  for (unsigned in_a_row = 0;;) {
    UniqueFunction<void()> job;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      TimePoint next = std::min(snapshot_due_, subscriptions_due_);
      for (const auto& client : clients_) next = std::min(next, client->next());
      if (!timers_.empty()) next = std::min(next, timers_.begin()->first);
      const auto is_due = [this] { return closing_ || woken_ || !jobs_.empty(); };
      if (next == TimePoint::max()) condition_.wait(lock, is_due);
      else condition_.wait_until(lock, next, is_due);
      if (closing_) break;
      if (!timers_.empty() && timers_.begin()->first <= std::chrono::steady_clock::now()) {
        job = std::move(timers_.begin()->second);
        timers_.erase(timers_.begin());
      } else if (!jobs_.empty() && in_a_row < max_jobs_in_a_row) {
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
      if (!job) woken_ = false;
    }
    in_a_row = job ? in_a_row + 1 : 0;
    if (job) job();
    else react();
  }
  // Closed: everything that waits ends.
  is_closed_ = true;
  const Error error{Errc::closed, "the graph is closed"};
  for (;;) {
    UniqueFunction<void()> job;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (jobs_.empty()) break;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    job();
  }
  while (!running_goals_.empty()) {
    const auto goal = running_goals_.begin()->second;
    end_goal(goal, unexpected(error), goal->status);
  }
  for (const auto& client : clients_) client->close(error);
  clients_.clear();
  channels_.clear();
  std::vector<std::shared_ptr<Subscription::State>> subscriptions;
  std::vector<std::shared_ptr<Publisher::State>> publishers;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    subscriptions.swap(subscriptions_);
    publishers.swap(publishers_);
    timers_.clear();
    jobs_.clear();
  }
  for (const auto& subscription : subscriptions) {
    subscription->reader.reset();
    const std::lock_guard<std::recursive_mutex> lock(subscription->mutex);
    subscription->sink = {};
  }
  for (const auto& publisher : publishers) {
    const std::unique_lock<std::shared_mutex> lock(publisher->mutex);
    publisher->writer.reset();
  }
  {
    const std::lock_guard<std::recursive_mutex> lock(change_mutex_);
    on_change_ = {};
  }
  nodes_writer_.reset();
  nodes_reader_.reset();
  participant.reset();
}

void GraphCore::react() {
  const TimePoint now = std::chrono::steady_clock::now();
  const std::uint64_t changes = known.changes();
  const bool graph_changed = changes != seen_changes_;
  if (graph_changed) {
    seen_changes_ = changes;
    if (snapshot_due_ == TimePoint::max()) snapshot_due_ = now + options.settle;
  }
  if (graph_changed || subscriptions_changed_.exchange(false) || now >= subscriptions_due_) check_subscriptions(now);
  const bool clients_changed = clients_changed_.exchange(false) || graph_changed;
  for (auto it = clients_.begin(); it != clients_.end();) {
    ServiceClient& client = **it;
    if (clients_changed || now >= client.next()) client.react(now);
    ++it;
  }
  for (auto& [id, goal] : std::map<std::string, std::shared_ptr<Goal::State>>(running_goals_))
    if (!goal->is_sent) start_goal(goal);
  if (now >= snapshot_due_) {
    snapshot_due_ = TimePoint::max();
    auto made = known.snapshot(++version_);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      snapshot_ = std::move(made);
    }
    const std::lock_guard<std::recursive_mutex> lock(change_mutex_);
    if (on_change_) on_change_();
  }
  if (own_changed_.exchange(false) || graph_changed) announce_node();
}

/// ros_discovery_info, on a thread of DDS.
void GraphCore::received(const dds::Received& sample) {
  if (sample.payload.size() > options.limits.max_sample_bytes) return;
  if (auto entities = read_entities(sample.payload, options.limits)) known.nodes(prefix_of(sample.writer), std::move(*entities));
}

bool GraphCore::own(const Gid& gid, bool is_writer, bool there) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto& list = is_writer ? own_writers_ : own_readers_;
    if (there) list.insert(gid);
    else list.erase(gid);
    woken_ = true;
  }
  own_changed_ = true;
  condition_.notify_one();
  return there;
}

/// Nodes of Humble end their discovery when they get a Gid of 16 bytes, newer ones read nonsense in one of 24: nothing is said before others have
/// shown which they have, nor if they differ.
void GraphCore::announce_node() {
  const std::size_t gid_bytes = known.gid_bytes();
  if (gid_bytes == 0) return;
  NodeEntities node{options.node, {}, {}};
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    node.readers.assign(own_readers_.begin(), own_readers_.end());
    node.writers.assign(own_writers_.begin(), own_writers_.end());
  }
  std::sort(node.readers.begin(), node.readers.end());
  std::sort(node.writers.begin(), node.writers.end());
  Gid gid{};
  std::copy(participant->prefix().begin(), participant->prefix().end(), gid.bytes.begin());
  gid.bytes[14] = 1;
  gid.bytes[15] = 0xc1;
  std::string payload = write_entities(gid, {node}, gid_bytes);
  if (payload == announced_) return;
  if (nodes_writer_ == nullptr) {
    dds::EndpointOptions writing;
    writing.topic = entities_topic;
    writing.type = entities_type;
    writing.reliable = writing.transient_local = true;
    auto writer = participant->writer(writing, nullptr);
    if (!writer) return log(LogLevel::warning, writer.error().message);
    nodes_writer_ = std::move(*writer);
  }
  if (const auto written = nodes_writer_->write({}, payload, nullptr); !written) return log(LogLevel::warning, written.error().message);
  announced_ = std::move(payload);
}

std::shared_ptr<const GraphSnapshot> GraphCore::snapshot() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return snapshot_;
}

void GraphCore::on_change(UniqueFunction<void()> f) {
  UniqueFunction<void()> before;
  {
    const std::lock_guard<std::recursive_mutex> lock(change_mutex_);
    before = std::move(on_change_);
    on_change_ = std::move(f);
  }
  post([this, kept = std::make_shared<UniqueFunction<void()>>(std::move(before))] {
    const std::lock_guard<std::recursive_mutex> lock(change_mutex_);
    if (on_change_) on_change_();
  });
}

GraphCounters GraphCore::counters() const noexcept {
  GraphCounters all;
  all.samples = counts.samples;
  all.sample_bytes = counts.sample_bytes;
  all.lost_samples = counts.lost;
  all.large_samples = counts.large;
  all.other_version = counts.other_version;
  if (participant != nullptr) {
    const Guard::Counters& guard = participant->guard().counters();
    all.large_samples += guard.large_samples;
    all.refused_participants = guard.refused_participants;
    all.refused_endpoints = guard.refused_endpoints;
    all.malformed_packets = guard.malformed;
  }
  all.refused_endpoints += known.refused_endpoints();
  all.participants = known.participants();
  all.endpoints = known.endpoints();
  all.subscriptions = subscribed_;
  all.calls = calls_ + goals_;
  return all;
}

// ---- readers and writers

void GraphCore::make_reader(Subscription::State& state, const Offered& offered) {
  dds::EndpointOptions wanted;
  wanted.topic = "rt" + state.topic;
  wanted.type = is_type_name(state.type) ? dds_type_of(state.type) : state.type;
  wanted.depth = state.options.depth;
  wanted.is_watched = state.is_internal;
  const bool any = !offered.writers.empty();
  wanted.reliable = any && offered.reliable;
  wanted.transient_local = wanted.reliable && offered.transient_local;
  wanted.keyed = any && offered.keyed;
  if (!state.options.hash.empty()) wanted.user_data = "typehash=" + state.options.hash + ";";
  if (state.reader != nullptr) {
    own(state.reader->gid(), false, false);
    state.reader.reset();
  }
  auto reader = participant->reader(wanted, state);
  state.made = std::move(wanted);
  state.made_at = std::chrono::steady_clock::now();
  if (!reader) return log(LogLevel::error, reader.error().message);
  state.reader = std::move(*reader);
  own(state.reader->gid(), false, true);
}

void GraphCore::check_subscriptions(TimePoint now) {
  subscriptions_due_ = TimePoint::max();
  std::vector<std::shared_ptr<Subscription::State>> all;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    all = subscriptions_;
  }
  std::vector<std::shared_ptr<Subscription::State>> ended;
  for (const auto& state : all) {
    bool alive = false;
    {
      const std::lock_guard<std::recursive_mutex> lock(state->mutex);
      alive = state->alive;
    }
    if (!alive) {
      if (state->reader != nullptr) own(state->reader->gid(), false, false);
      state->reader.reset();
      ended.push_back(state);
      continue;
    }
    const Offered offered = known.offered(state->topic, state->type, state->options.hash);
    if (offered.writers.empty() && state->reader != nullptr) continue;  // it stays as it is
    const bool reliable = offered.reliable, transient_local = reliable && offered.transient_local;
    if (state->reader != nullptr && state->made.reliable == reliable && state->made.transient_local == transient_local &&
        state->made.keyed == offered.keyed)
      continue;
    // Strangers may change what is offered as often as they like: not more than once in `settle`.
    if (state->reader != nullptr && now - state->made_at < options.settle && state->made.reliable) {
      subscriptions_due_ = std::min(subscriptions_due_, state->made_at + options.settle);
      continue;
    }
    make_reader(*state, offered);
  }
  if (ended.empty()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto is_ended = [&](const std::shared_ptr<Subscription::State>& state) {
    return std::find(ended.begin(), ended.end(), state) != ended.end();
  };
  subscriptions_.erase(std::remove_if(subscriptions_.begin(), subscriptions_.end(), is_ended), subscriptions_.end());
  for (const auto& state : ended)
    if (!state->is_internal) --subscribed_;
}

Result<Subscription> GraphCore::subscribe(std::string_view topic, std::string_view type, Sink sink, const SubscribeOptions& options_of_it,
                                          bool internal) {
  if (!is_full_name(topic)) return unexpected(Errc::invalid_option, "\"" + std::string(topic) + "\" is no full name of a topic");
  if (type.empty() || type.size() > 255) return unexpected(Errc::invalid_option, "\"" + std::string(type) + "\" is no name of a type");
  auto state = std::make_shared<Subscription::State>();
  state->core = weak_from_this();
  state->topic = topic;
  state->type = type;
  state->options = options_of_it;
  state->sink = std::move(sink);
  state->is_internal = internal;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closing_) return unexpected(Errc::closed, "the graph is closed");
    if (!internal && subscribed_ >= options.limits.max_subscriptions)
      return unexpected(Errc::limit_exceeded, "there are GraphLimits::max_subscriptions subscriptions");
    if (!internal) ++subscribed_;
    subscriptions_.push_back(state);
    woken_ = true;
  }
  subscriptions_changed_ = true;
  condition_.notify_one();
  return Subscription(std::move(state));
}

Result<Publisher> GraphCore::advertise(std::string_view topic, std::string_view type, const AdvertiseOptions& options_of_it) {
  if (!is_full_name(topic)) return unexpected(Errc::invalid_option, "\"" + std::string(topic) + "\" is no full name of a topic");
  if (!is_type_name(type)) return unexpected(Errc::invalid_option, "\"" + std::string(type) + "\" is no name of a type");
  dds::EndpointOptions writing;
  writing.topic = "rt" + std::string(topic);
  writing.type = dds_type_of(type);
  writing.reliable = options_of_it.reliable;
  writing.transient_local = options_of_it.transient_local;
  writing.depth = options_of_it.depth;
  if (!options_of_it.hash.empty()) writing.user_data = "typehash=" + options_of_it.hash + ";";
  auto state = std::make_shared<Publisher::State>();
  state->core = weak_from_this();
  state->max_bytes = options.limits.max_sample_bytes;
  const std::unique_lock<std::shared_mutex> making(state->mutex);  // close() waits for it
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closing_) return unexpected(Errc::closed, "the graph is closed");
    if (publishers_.size() >= options.limits.max_subscriptions)
      return unexpected(Errc::limit_exceeded, "there are GraphLimits::max_subscriptions publishers");
    publishers_.push_back(state);
  }
  auto writer = participant->writer(writing, nullptr);
  if (!writer) {
    const std::lock_guard<std::mutex> lock(mutex_);
    publishers_.erase(std::remove(publishers_.begin(), publishers_.end(), state), publishers_.end());
    return unexpected(writer.error());
  }
  own((*writer)->gid(), true, true);
  state->writer = std::move(*writer);
  return Publisher(state);
}

void GraphCore::remove(const std::shared_ptr<Publisher::State>& publisher) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    publishers_.erase(std::remove(publishers_.begin(), publishers_.end(), publisher), publishers_.end());
  }
  const std::unique_lock<std::shared_mutex> lock(publisher->mutex);
  if (publisher->writer != nullptr) own(publisher->writer->gid(), true, false);
  publisher->writer.reset();
}

// ---- calls

void GraphCore::ended(const Call::State& call) noexcept {
  if (call.is_counted) --calls_;
}

Result<std::shared_ptr<Call::State>> GraphCore::begin_chain(UniqueFunction<void(Result<Bytes>)> done) {
  if (calls_.fetch_add(1) + goals_ >= options.limits.max_calls) {
    --calls_;
    return unexpected(Errc::limit_exceeded, "GraphLimits::max_calls calls wait for responses");
  }
  auto state = std::make_shared<Call::State>();
  state->core = weak_from_this();
  state->is_counted = true;
  state->done = std::move(done);
  return state;
}

Result<Call> GraphCore::call(std::string_view service, std::string_view type, std::string_view request, UniqueFunction<void(Result<Bytes>)> done,
                             std::chrono::milliseconds timeout, bool internal, bool waits_for_ever) {
  if (!has_encapsulation(request)) return unexpected(Errc::expected_value, "a request begins with an encapsulation of CDR");
  if (!is_full_name(service) || !is_type_name(type))
    return unexpected(Errc::expected_value, "\"" + std::string(service) + "\" or \"" + std::string(type) + "\" is no full name");
  if (request.size() > options.limits.max_sample_bytes)
    return unexpected(Errc::limit_exceeded, "the request is larger than GraphLimits::max_sample_bytes");
  std::shared_ptr<Call::State> state;
  if (internal) {
    state = std::make_shared<Call::State>();
    state->core = weak_from_this();
    state->done = std::move(done);
  } else {
    auto begun = begin_chain(std::move(done));
    if (!begun) return unexpected(begun.error());
    state = std::move(*begun);
  }
  ServiceClient::Pending pending;
  pending.call = state;
  pending.request = request;
  pending.deadline = deadline_after(timeout);
  pending.waits_for_ever = waits_for_ever;
  const bool posted = post([this, name = std::string(service), of = std::string(type),
                            kept = std::make_shared<ServiceClient::Pending>(std::move(pending))] { start_call(name, of, std::move(*kept)); });
  if (!posted) {
    state->end();
    return unexpected(Errc::closed, "the graph is closed");
  }
  return Call(std::move(state));
}

void GraphCore::start_call(const std::string& service, const std::string& type, ServiceClient::Pending pending) {
  if (!pending.call->is_alive()) return;
  if (is_closed_) return pending.call->finish(unexpected(Errc::closed, "the graph is closed"));
  const ServerFound server = known.server(service, type);
  if (server.pairs.empty())
    return pending.call->finish(unexpected(Errc::unavailable, server.incomplete ? "a server of " + service + " has no writer of responses"
                                                                                : "there is no server of " + service + " of type " + type));
  if (server.form == IdentityForm::unknown)
    return pending.call->finish(
        unexpected(Errc::unavailable, "it is not known how the server of " + service + " identifies requests, so none is sent"));
  const TimePoint now = std::chrono::steady_clock::now();
  auto found = std::find_if(clients_.begin(), clients_.end(),
                            [&](const auto& client) { return client->service == service && client->type == type && client->form == server.form; });
  if (found == clients_.end()) {
    auto client = std::make_unique<ServiceClient>(*this, service, type, server.form);
    if (const auto created = client->create(); !created) return pending.call->finish(unexpected(created.error()));
    client->used = now;
    clients_.push_back(std::move(client));
    found = std::prev(clients_.end());
    if (clients_.size() > max_idle_clients) remove_oldest_idle();
    if (!std::exchange(is_collecting_, true)) post_at(now + idle_life, [this] { collect_idle(); });
  }
  ServiceClient& client = **found;
  client.used = now;
  client.add(std::move(pending));
  client.react(now);
}

/// A job of a client may still wait in the queue: it is destroyed behind that.
void GraphCore::remove(std::list<std::unique_ptr<ServiceClient>>::iterator it) {
  std::shared_ptr<ServiceClient> idle(std::move(*it));
  clients_.erase(it);
  idle->close(Error{Errc::closed, {}});
  post([idle] {});
}

void GraphCore::remove_oldest_idle() {
  auto oldest = clients_.end();
  for (auto it = clients_.begin(); it != std::prev(clients_.end()); ++it)
    if ((*it)->is_idle() && (oldest == clients_.end() || (*it)->used < (*oldest)->used)) oldest = it;
  if (oldest != clients_.end()) remove(oldest);
}

/// Removes clients and readers of actions that have been idle.
void GraphCore::collect_idle() {
  const TimePoint now = std::chrono::steady_clock::now();
  bool some_left = false;
  for (auto it = clients_.begin(); it != clients_.end();) {
    if (!(*it)->is_idle() || now - (*it)->used < idle_life) {
      some_left = true;
      ++it;
    } else {
      remove(it++);
    }
  }
  for (auto it = channels_.begin(); it != channels_.end();) {
    if (it->second.goals != 0 || now - it->second.used < idle_life) {
      some_left = true;
      ++it;
    } else {
      it = channels_.erase(it);
    }
  }
  is_collecting_ = some_left;
  if (some_left) post_at(now + idle_life, [this] { collect_idle(); });
}

}  // namespace v0
}  // namespace lrt::ros2
