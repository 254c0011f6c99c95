// SPDX-License-Identifier: Apache-2.0
// A topic: a Thing with the Property "value", and with Properties for the bytes of images, grids, clouds and scans.
#include <algorithm>
#include <cstring>
#include <utility>

#include <lrt/rdf/dynamic_type.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/ros2/bridge/core.hpp"
#include "src/ros2/bridge/images.hpp"
#include "src/ros2/bridge/robot.hpp"
#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {
namespace {

using std::chrono::milliseconds;
using Utc = std::chrono::system_clock::time_point;

/// How long the first sample may take that says in which frame the numbers are.
constexpr milliseconds frame_patience{700};
/// Types that a topic may have one after the other: a DynamicType is kept for the life of the process.
constexpr unsigned max_topic_types = 8;
/// Frames that a topic may have one after the other; further changes are in each value only.
constexpr unsigned max_topic_frames = 8;

/// What representations a type has besides its value.
enum class Bulk : std::uint8_t { none, image, compressed_image, grid, cloud, scan };

struct BulkType {
  std::string_view type;
  Bulk bulk;
  const char* left_out;
};
constexpr BulkType bulk_types[] = {
    {"sensor_msgs/msg/Image", Bulk::image, "data"},     {"sensor_msgs/msg/CompressedImage", Bulk::compressed_image, "data"},
    {"nav_msgs/msg/OccupancyGrid", Bulk::grid, "data"}, {"sensor_msgs/msg/PointCloud2", Bulk::cloud, "data"},
    {"sensor_msgs/msg/LaserScan", Bulk::scan, nullptr},
};

/// Places in a payload that a representation needs. Those that a definition does not have are empty.
struct Places {
  MessageType type;
  std::optional<MessageType::Place> data, width, height, step, row_step, point_step, encoding, big_endian, format;

  static Places of(const MessageType& type, Bulk bulk) {
    Places made{type, {}, {}, {}, {}, {}, {}, {}, {}, {}};
    const auto place = [&](std::string_view path) -> std::optional<MessageType::Place> {
      Result<MessageType::Place> found = type.place(path);
      return found ? std::optional(*std::move(found)) : std::nullopt;
    };
    const bool is_grid = bulk == Bulk::grid;
    made.data = place("data");
    made.width = place(is_grid ? "info.width" : "width");
    made.height = place(is_grid ? "info.height" : "height");
    made.step = place("step");
    made.row_step = place("row_step");
    made.point_step = place("point_step");
    made.encoding = place("encoding");
    made.big_endian = place("is_bigendian");
    made.format = place("format");
    return made;
  }
  std::uint32_t number(std::string_view payload, const std::optional<MessageType::Place>& at) const noexcept {
    const std::optional<std::int64_t> n = at ? type.integer(payload, *at) : std::nullopt;
    return n && *n >= 0 && *n <= UINT32_MAX ? static_cast<std::uint32_t>(*n) : 0;
  }
  std::string_view text(std::string_view payload, const std::optional<MessageType::Place>& at) const noexcept {
    return at ? type.text(payload, *at).value_or(std::string_view()) : std::string_view();
  }
  Result<std::string_view> bytes(std::string_view payload) const {
    const std::optional<Found> found = data ? type.find(payload, *data) : std::nullopt;
    if (!found) return unexpected(Errc::unsupported_syntax, "the sample has no data");
    return found->bytes;
  }
  bool is_big_endian(std::string_view payload) const noexcept {
    if (!big_endian) return false;
    const std::optional<double> n = type.number(payload, *big_endian);
    if (n) return *n != 0;
    const std::optional<Found> found = type.find(payload, *big_endian);
    return found && !found->bytes.empty() && found->bytes[0] != 0;
  }
};

Unexpected no_payload() { return unexpected(Errc::unsupported_syntax, "the value was not sampled"); }

Result<std::string> png_of_sample(const Places& at, const RosValue& v, Bulk bulk, std::size_t most) {
  if (!v.payload) return no_payload();
  const std::string_view payload = *v.payload;
  Result<std::string_view> data = at.bytes(payload);
  if (!data) return Unexpected{data.error()};
  if (bulk == Bulk::grid) return png_of_grid(at.number(payload, at.width), at.number(payload, at.height), *data, most);
  Pixels p;
  p.width = at.number(payload, at.width);
  p.height = at.number(payload, at.height);
  p.step = at.number(payload, at.step);
  p.encoding = at.text(payload, at.encoding);
  p.big_endian = at.is_big_endian(payload);
  p.bytes = *data;
  if (p.step == 0) return unexpected(Errc::unsupported_syntax, "the image has no rows");
  return png_of(p, most);
}

Result<std::string> data_of_sample(const Places& at, const RosValue& v, std::size_t most) {
  if (!v.payload) return no_payload();
  Result<std::string_view> data = at.bytes(*v.payload);
  if (!data) return Unexpected{data.error()};
  if (data->size() > most)
    return unexpected(Errc::limit_exceeded,
                      "it has " + std::to_string(data->size()) + " bytes; the limit max_representation_bytes is " + std::to_string(most));
  return std::string(*data);
}

/// The bytes of a compressed image, if they are in this format by their own first bytes.
Result<std::string> compressed_of_sample(const Places& at, const RosValue& v, std::string_view begin, std::size_t most) {
  Result<std::string> data = data_of_sample(at, v, most);
  if (data && data->compare(0, begin.size(), begin) != 0) return unexpected(Errc::unsupported_syntax, "the image is in another format");
  return data;
}

Result<std::string> points_of_sample(const Places& at, const MessageReader& reader, const RosValue& v, std::size_t most) {
  if (!v.payload) return no_payload();
  const std::string_view payload = *v.payload;
  CloudLayout layout;
  layout.width = at.number(payload, at.width);
  layout.height = at.number(payload, at.height);
  layout.point_step = at.number(payload, at.point_step);
  layout.row_step = at.number(payload, at.row_step);
  layout.big_endian = at.is_big_endian(payload);
  Result<std::string_view> data = at.bytes(payload);
  if (!data) return Unexpected{data.error()};
  // The fields are a list of messages: {name, offset, datatype, count}.
  Result<rdf::Value> value = reader.read(*v.payload);
  if (!value) return Unexpected{std::move(value).error()};
  const rdf::Type& type = *at.type.type();
  bool found[3] = {false, false, false};
  for (std::size_t i = 0; i < type.fields.size(); ++i) {
    if (type.fields[i].name != "fields" || !(*value->sequence())[i].sequence()) continue;
    for (const rdf::Value& field : *(*value->sequence())[i].sequence()) {
      const rdf::Value::Sequence* f = field.sequence();
      if (!f || f->size() < 3 || !(*f)[0].text() || (*f)[0].text()->size() != 1 || !(*f)[1].integer()) continue;
      const int axis = (*(*f)[0].text())[0] - 'x';
      if (axis < 0 || axis > 2) continue;
      const bool is_float = ((*f)[2].integer() && *(*f)[2].integer() == 7) || ((*f)[2].text() && *(*f)[2].text() == "FLOAT32");
      const bool is_double = ((*f)[2].integer() && *(*f)[2].integer() == 8) || ((*f)[2].text() && *(*f)[2].text() == "FLOAT64");
      if (!is_float && !is_double) continue;
      layout.offsets[axis] = static_cast<std::uint32_t>(*(*f)[1].integer());
      layout.is_double[axis] = is_double;
      found[axis] = true;
    }
  }
  if (!found[0] || !found[1] || !found[2]) return unexpected(Errc::unsupported_syntax, "the cloud has no x, y and z of float32 or float64");
  return coordinates_of(layout, *data, most);
}

/// A list of float32 in a payload.
class NumbersReader final : public PayloadReader {
 public:
  NumbersReader(MessageType type, MessageType::Place place, std::shared_ptr<Shared> shared, std::size_t max_bytes)
      : type_(std::move(type)), place_(std::move(place)), shared_(std::move(shared)), max_bytes_(max_bytes) {}
  Result<rdf::Value> read(const std::string& payload) const override {
    const std::optional<Found> found = payload.size() <= max_bytes_ ? type_.find(payload, place_) : std::nullopt;
    if (!found || found->bytes.size() != found->count * 4) {
      shared_->malformed.fetch_add(1, std::memory_order_relaxed);
      return unexpected(Errc::expected_value, "the sample has no such numbers, or more than the limit max_value_bytes");
    }
    rdf::Value::Sequence numbers;
    numbers.reserve(found->count);
    for (std::size_t i = 0; i < found->count; ++i) {
      std::uint32_t bits = 0;
      for (unsigned b = 0; b < 4; ++b)
        bits |= std::uint32_t{static_cast<unsigned char>(found->bytes[i * 4 + b])} << 8U * (found->little_endian ? b : 3 - b);
      float number = 0;
      std::memcpy(&number, &bits, sizeof number);
      numbers.emplace_back(static_cast<double>(number));
    }
    shared_->decoded.fetch_add(1, std::memory_order_relaxed);
    return rdf::Value(std::move(numbers));
  }

 private:
  MessageType type_;
  MessageType::Place place_;
  std::shared_ptr<Shared> shared_;
  std::size_t max_bytes_;
};

/// What the sink of a topic shares with the bridge's thread and with the lambdas of the server.
struct TopicState {
  struct Output {
    PushedProperty<RosValue> property;
    std::shared_ptr<const PayloadReader> reader;
  };

  /// Held for a moment: a sample is passed, or the Things are made again, or a client's command lapses. In normal use nobody waits.
  std::mutex mutex;
  std::vector<Output> outputs;
  Sample last{};              ///< null payload: none since the topic has writers
  std::string why_missing{};  ///< while there is no sample
  std::string frame{};        ///< of the last sample
  bool has_frame = false;     ///< a sample has come that says it
  unsigned frame_changes = 0;
  std::shared_ptr<JointSink> joints;
  std::shared_ptr<FrameSink> frames;
  // Set before the first sample.
  std::string name;
  std::optional<MessageType> type;
  std::optional<MessageType::Place> stamp, frame_id;
  std::shared_ptr<Shared> shared;
  UniqueFunction<void()> frame_changed;  ///< called with the mutex held
  std::mutex description_mutex;
  std::optional<std::string> description;  ///< the newest text that the bridge's thread has not seen; guarded by description_mutex

  Utc time_of(const Sample& sample) const noexcept {
    if (stamp)
      if (const std::optional<Utc> at = type->time(*sample.payload, *stamp); at && at->time_since_epoch().count() > 0) return *at;
    if (sample.source.time_since_epoch().count() > 0) return sample.source;
    return sample.received.time_since_epoch().count() > 0 ? sample.received : std::chrono::system_clock::now();
  }
  ~TopicState() {
    if (shared) shared->kept_bytes.fetch_sub(size_of(last), std::memory_order_relaxed);
  }

  static std::size_t size_of(const Sample& sample) noexcept { return sample.payload ? sample.payload->size() : 0; }
  /// @pre mutex is held
  /// @return  false: all topics together have too many bytes
  bool keep(Sample&& sample) noexcept {
    const std::size_t before = size_of(last), now = size_of(sample);
    const std::size_t all = shared->kept_bytes.fetch_add(now - before, std::memory_order_relaxed) + now - before;
    if (now > before && all > shared->max_kept_bytes) {
      shared->kept_bytes.fetch_sub(now - before, std::memory_order_relaxed);
      return false;
    }
    last = std::move(sample);
    return true;
  }
  /// Runs on a thread of DDS.
  void take(Sample&& sample) {
    const std::lock_guard lock(mutex);
    if (!keep(std::move(sample))) {
      why_missing = "all topics together have more bytes than max_kept_bytes";
      (void)keep({});
      return pass_missing();
    }
    const Utc at = time_of(last);
    pass(at);
    if (joints) joints->take(*last.payload, at);
    if (frames) frames->take(last.payload, name);
    if (frame_id) {
      const std::optional<std::string_view> now = type->text(*last.payload, *frame_id);
      if (now && (!has_frame || *now != frame) && (now->empty() || is_clean_name(*now))) {
        has_frame = true;
        frame = std::string(*now);
        if (frame_changed && ++frame_changes <= max_topic_frames) frame_changed();
      }
    }
  }
  /// @pre mutex is held
  void pass(Utc at) {
    for (Output& o : outputs) {
      RosValue value;
      value.payload = last.payload;
      value.reader = o.reader;
      o.property.publish(value, at);
    }
  }
  /// @pre mutex is held
  void pass_missing() {
    const RosValue none = RosValue::none(why_missing);
    for (Output& o : outputs) o.property.publish(none);
  }
};

bool has_stamp(const Message& message) noexcept {
  if (message.fields.empty() || message.fields[0].name != "header" || !message.fields[0].type.message) return false;
  const FieldType& type = message.fields[0].type;
  return type.arity == Arity::single && type.message->name == "std_msgs/msg/Header";
}

void set_stamp(std::string& payload) {
  if (payload.size() < 12) return;
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(since);
  const std::uint32_t numbers[2] = {static_cast<std::uint32_t>(seconds.count()),
                                    static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since - seconds).count())};
  for (std::size_t i = 0; i < 8; ++i) payload[4 + i] = static_cast<char>(static_cast<unsigned char>(numbers[i / 4] >> 8U * (i % 4)));
}

class TopicPart final : public Part {
 public:
  explicit TopicPart(Core& core, const std::string& name) : Part(Listed{Listed::What::topic, name, {}, {}, {}, {}, {}}) {
    wanted_path = core.path_of(name);
    suffix = "_topic";
  }
  ~TopicPart() override { subscription_.reset(); }

  bool is_waiting() const override { return waits_; }

  void update(Core& core, const Topic* topic) {
    waits_ = false;
    const std::vector<Endpoint> none;
    const std::vector<Endpoint>& writers = topic ? topic->writers : none;
    const std::vector<Endpoint>& readers = topic ? topic->readers : none;
    listed.nodes.clear();
    for (const std::vector<Endpoint>* all : {&writers, &readers})
      for (const Endpoint& e : *all)
        if (!e.node.empty() && std::find(listed.nodes.begin(), listed.nodes.end(), e.node) == listed.nodes.end()) listed.nodes.push_back(e.node);
    said_ = said_of(core.rules(), Rule::Of::topic, listed.name, type_);
    if (said_.hidden) {
      listed.reason = "the mapping hides it";
      return;
    }
    const std::vector<Endpoint>& of_type = writers.empty() ? readers : writers;
    if (of_type.empty())
      return become_unavailable(core, "no node writes it now" + (last_writers_.empty() ? std::string() : "; the last was " + last_writers_));
    choose_type(core, of_type);
    if (!state_ || !state_->type) return;  // the reason is stated
    if (writers.empty()) {
      if (life_in(core).count() > 0) become_idle();
      else become_unavailable(core, "no node writes it");
    } else {
      std::vector<std::string> names;
      for (const Endpoint& w : writers)
        if (!w.node.empty() && std::find(names.begin(), names.end(), w.node) == names.end()) names.push_back(w.node);
      last_writers_ = listed_nodes(names);
      const bool fits = std::any_of(writers.begin(), writers.end(), [&](const Endpoint& w) { return w.type == type_ && fits_hash(w); });
      if (fits) become_available(core);
      else become_unavailable(core, last_writers_ + " writes another version of " + type_);
      if (fits && !subscription_) return;
    }
    if (!is_served) {
      if (waits_for_frame(core)) return;
      if (!core.serve(*this)) return;
    } else if (frame_stated_ != frame_now() && renewals_ < 3) {
      ++renewals_;  // the frame came late, or has changed
      core.renew(*this);
    }
    if (is_available && std::any_of(writers.begin(), writers.end(), [&](const Endpoint& w) { return w.type != type_ || !fits_hash(w); }))
      listed.reason = "what some nodes write is of another type, or another version of it, and is left out";
  }

  std::vector<Thing> make(Core& core, const std::string& its_path) override {
    std::vector<Thing> made;
    Thing& thing = made.emplace_back(its_path);
    describe(thing, listed, {}, {}, "Topic");
    frame_stated_ = frame_now();
    const bool is_writable = core.is_allowed(core.options().allowed.topics, listed.name) && make_publisher(core);
    const std::lock_guard lock(state_->mutex);
    state_->outputs.clear();
    const MessageType& type = *state_->type;
    const bool is_large = bulk_ != Bulk::none && bulk_ != Bulk::scan;
    const BridgeLimits& limits = core.options().limits;
    // The data of large types is no part of the value.
    const std::size_t most = is_large ? core.options().graph.limits.max_sample_bytes : limits.max_value_bytes;
    const auto reader = std::make_shared<MessageReader>(type, state_->shared, most);
    PushedProperty<RosValue> value = thing.pushed<RosValue>("value", type.type());
    say(value, said_.titles, said_.descriptions, namespace_of(type_) == "/" ? type_ : type_.substr(type_.rfind('/') + 1));
    if (said_.descriptions.empty() && !comment_.empty()) value.description(comment_);
    value.dispatch(Dispatch::io_thread);
    if (state_->stamp) value.every_sample();
    if (!frame_stated_.empty()) {
      const std::string frame_thing = thing_of_frame(core, namespace_of(listed.name), frame_stated_);
      value.frame(frame_thing.empty() ? Object(frame_stated_) : Object::resource(frame_thing));
    }
    state_->outputs.push_back({value, reader});
    make_bulk(core, thing, reader);
    listed.as = is_writable ? "writable Property" : "Property";
    if (is_writable) make_writable(core, thing, value);
    listed.path = '/' + its_path + "/value";
    properties = state_->outputs.size();
    return made;
  }

  void was_served(Core&) override {
    const std::lock_guard lock(state_->mutex);
    if (state_->last.payload) state_->pass(state_->time_of(state_->last));
    else if (!state_->why_missing.empty()) state_->pass_missing();
  }

 private:
  bool fits_hash(const Endpoint& e) const { return hash_.empty() || e.hash.empty() || e.hash == hash_; }
  std::string frame_now() const {
    if (!said_.frame.empty()) return said_.frame;
    if (!state_ || renewals_ > 1) return {};  // it changes all the time: each value says it
    const std::lock_guard lock(state_->mutex);
    return state_->frame;
  }

  /// Chooses a type that somebody uses, and keeps it while that is so.
  void choose_type(Core& core, const std::vector<Endpoint>& endpoints) {
    const auto is_used = [&](const Endpoint& e) { return e.type == type_ && e.hash == hash_; };
    if (state_ && state_->type && std::any_of(endpoints.begin(), endpoints.end(), is_used)) return;
    // An endpoint that states no hash is of any version.
    if (state_ && state_->type && std::any_of(endpoints.begin(), endpoints.end(), [&](const Endpoint& e) { return e.type == type_ && fits_hash(e); }))
      return;
    const auto first = std::find_if(endpoints.begin(), endpoints.end(), [](const Endpoint& e) { return is_type_name(e.type); });
    if (first == endpoints.end()) {
      listed.type = endpoints.front().type;
      listed.reason = "its type is not one of ROS 2";
      return;
    }
    const Endpoint& chosen = *first;
    listed.type = chosen.type;
    Result<MessagePtr> definition = core.message(chosen.type, chosen.hash, waits_);
    if (!definition) {
      listed.reason = definition.error().message;
      return;
    }
    said_ = said_of(core.rules(), Rule::Of::topic, listed.name, chosen.type);
    const auto known = std::find_if(std::begin(bulk_types), std::end(bulk_types), [&](const BulkType& b) { return b.type == chosen.type; });
    TypeUse use{Rule::Of::topic, listed.name, {}};
    if (has_stamp(**definition)) use.left_out.emplace_back("header.stamp");
    if (known != std::end(bulk_types) && known->left_out) use.left_out.emplace_back(known->left_out);
    if (types_made_ >= max_topic_types) {
      listed.reason = "its type has changed too often";
      return;
    }
    const std::size_t before = core.types().count();
    Result<MessageType> made = core.types().make(*definition, use);
    types_made_ += core.types().count() != before ? 1 : 0;  // two versions that come and go are two
    if (!made) {
      listed.reason = made.error().message;
      return;
    }
    subscription_.reset();  // its sink has the old state
    publisher_.reset();
    const bool was_served_before = is_served;
    auto state = std::make_shared<TopicState>();
    state->name = listed.name;
    state->type = *made;
    state->shared = core.shared();
    if (has_stamp(**definition)) {
      if (Result<MessageType::Place> at = made->place("header.stamp")) state->stamp = *at;
      if (Result<MessageType::Place> at = made->place("header.frame_id")) state->frame_id = *at;
    }
    state->frame_changed = [shared = core.shared()] {
      {
        const std::lock_guard lock(shared->mutex);
        shared->changed = true;
      }
      shared->arrived.notify_one();
    };
    if (is_joint_state(**definition)) state->joints = joints_of(core, namespace_of(listed.name));
    if (is_tf_message(**definition)) state->frames = frames_of(core, namespace_of(listed.name));
    is_joints_ = is_joint_state(**definition);
    is_description_ = chosen.type == "std_msgs/msg/String" && listed.name.size() >= 18 &&
                      listed.name.compare(listed.name.size() - 18, 18, "/robot_description") == 0;
    state_ = std::move(state);
    type_ = chosen.type;
    hash_ = chosen.hash.empty() ? std::string() : (*definition)->hash;
    comment_ = words_for_people((*definition)->comment.substr(0, (*definition)->comment.find("\n\n")));
    bulk_ = known == std::end(bulk_types) ? Bulk::none : known->bulk;
    is_available = is_idle_ = false;
    listed.reason.clear();
    if (was_served_before) core.renew(*this);
  }

  /// Of a value that clients write; 0: it lasts, or they cannot write it.
  milliseconds life_in(Core& core) const {
    if (!core.is_allowed(core.options().allowed.topics, listed.name)) return milliseconds(0);
    return said_.life.value_or(said_.is_command ? core.options().limits.command_life : milliseconds(0));
  }

  /// A command that nobody gives is zero, as after its life.
  void become_idle() {
    if (std::exchange(is_idle_, true)) return;
    is_available = true;
    subscription_.reset();
    listed.reason.clear();
    const std::lock_guard lock(state_->mutex);
    state_->why_missing.clear();
    Sample zero;
    zero.payload = std::make_shared<const std::string>(state_->type->initial());
    zero.received = std::chrono::system_clock::now();
    if (!state_->keep(std::move(zero))) return;
    state_->pass(state_->time_of(state_->last));
  }

  void become_available(Core& core) {
    is_idle_ = false;
    if (is_joints_) {  // a robot has come, or was made again
      const std::shared_ptr<JointSink> joints = joints_of(core, namespace_of(listed.name));
      const std::lock_guard lock(state_->mutex);
      state_->joints = joints;
    }
    if (is_available && subscription_) return;
    {
      const std::lock_guard lock(state_->mutex);
      state_->why_missing = last_writers_ + " writes " + listed.name + ", and no sample has come yet";
      (void)state_->keep({});
      state_->pass_missing();
    }
    SubscribeOptions options;
    options.hash = hash_;
    const BridgeLimits& limits = core.options().limits;
    const bool is_large = bulk_ != Bulk::none && bulk_ != Bulk::scan;
    options.minimum_interval = said_.interval.value_or(is_large ? limits.large_interval : limits.minimum_interval);
    if (type_ == "tf2_msgs/msg/TFMessage") options.depth = 100, options.minimum_interval = {};
    Result<Handle> subscribed = core.port().subscribe(
        listed.name, type_,
        [state = state_, description = is_description_, shared = core.shared(), &core, ns = namespace_of(listed.name)](Sample&& sample) {
          if (!sample.payload) return;
          try {
            if (description) take_description(state, *sample.payload, shared, core, ns);
            state->take(std::move(sample));
          } catch (...) {}  // no memory: the sample is left out
        },
        options);
    if (!subscribed) {
      listed.reason = subscribed.error().message;
      return;
    }
    subscription_ = *std::move(subscribed);
    is_available = true;
    listed.reason.clear();
    since_ = Core::Clock::now();
  }

  /// A URDF, for the bridge's thread: the newest.
  static void take_description(const std::shared_ptr<TopicState>& state, const std::string& payload, const std::shared_ptr<Shared>& shared,
                               Core& core, const std::string& ns) {
    const Result<MessageType::Place> data = state->type->place("data");
    const std::optional<std::string_view> text = data ? state->type->text(payload, *data) : std::nullopt;
    if (!text) return;
    {
      const std::lock_guard lock(state->description_mutex);
      const bool is_known = state->description.has_value();
      state->description = std::string(*text);
      if (is_known) return;  // its job will find this one
    }
    shared->put([state, &core, ns] {
      std::optional<std::string> newest;
      {
        const std::lock_guard lock(state->description_mutex);
        newest.swap(state->description);
      }
      if (newest) update_robot(core, ns, *std::move(newest));
    });
  }

  void become_unavailable(Core& core, const std::string& why) {
    is_idle_ = false;
    const bool was = std::exchange(is_available, false);
    subscription_.reset();  // its sink has returned
    listed.reason = why;
    if (!state_) return;
    std::shared_ptr<FrameSink> frames;
    {
      const std::lock_guard lock(state_->mutex);
      frames = state_->frames;
      if (state_->why_missing == why && !state_->last.payload) return;
      state_->why_missing = why;
      (void)state_->keep({});
      state_->pass_missing();
    }
    if (was && frames) frames->lose(listed.name, listed.name + ": " + why);
    if (was && is_joints_) lose_joints(core, namespace_of(listed.name));
  }

  bool waits_for_frame(Core& core) {
    if (!state_->frame_id || !said_.frame.empty() || !is_available) return false;
    {
      const std::lock_guard lock(state_->mutex);
      if (state_->has_frame) return false;
    }
    const Core::Clock::time_point end = since_ + frame_patience;
    if (Core::Clock::now() >= end) return false;
    core.wake_at(end);
    return waits_ = true;
  }

  void make_bulk(Core& core, Thing& thing, const std::shared_ptr<MessageReader>& reader) {
    const std::size_t most = core.options().limits.max_representation_bytes;
    const MessageType& type = *state_->type;
    if (bulk_ == Bulk::none) return;
    const auto at = std::make_shared<const Places>(Places::of(type, bulk_));
    const auto file = [&](std::string_view name, const char* title, const char* description) {
      PushedProperty<RosValue> p = thing.pushed<RosValue>(name, type.type());
      p.title(title, "en").description(description, "en").dispatch(Dispatch::io_thread).as_file().every_sample();
      state_->outputs.push_back({p, reader});
      return p;
    };
    switch (bulk_) {
      case Bulk::image:
      case Bulk::grid: {
        PushedProperty<RosValue> p = file("image", "Image",
                                          bulk_ == Bulk::image ? "The pixels as PNG, made when it is requested; or the bytes of the message."
                                                               : "The grid as PNG: free is white, occupied black, unknown grey; or its cells, "
                                                                 "a signed byte each, row by row from the smallest y.");
        p.representation("image/png", [at, most, bulk = bulk_](const RosValue& v) { return png_of_sample(*at, v, bulk, most); });
        p.representation("application/octet-stream", [at, most](const RosValue& v) { return data_of_sample(*at, v, most); });
        break;
      }
      case Bulk::compressed_image: {
        PushedProperty<RosValue> p = file("image", "Image", "The image as it was sent.");
        p.representation("image/jpeg", [at, most](const RosValue& v) { return compressed_of_sample(*at, v, "\xFF\xD8", most); });
        p.representation("image/png", [at, most](const RosValue& v) { return compressed_of_sample(*at, v, "\x89PNG", most); });
        p.representation("application/octet-stream", [at, most](const RosValue& v) { return data_of_sample(*at, v, most); });
        break;
      }
      case Bulk::cloud: {
        PushedProperty<RosValue> points = file("points", "Points", "x, y and z of each point in metres: float32 in little endian.");
        points.representation("application/octet-stream", [at, reader, most](const RosValue& v) { return points_of_sample(*at, *reader, v, most); });
        PushedProperty<RosValue> data = file("data", "Data", "The bytes of all points, as the fields of the value describe them.");
        data.representation("application/octet-stream", [at, most](const RosValue& v) { return data_of_sample(*at, v, most); });
        break;
      }
      case Bulk::scan: {
        const Result<rdf::DynamicType> list = rdf::DynamicType::list(rdf::DynamicType::of<float>());
        for (const char* name : {"ranges", "intensities"}) {
          Result<MessageType::Place> place = type.place(name);
          if (!place || !list) continue;
          const bool is_range = std::string_view(name) == "ranges";
          PushedProperty<RosValue> p = thing.pushed<RosValue>(name, *list, is_range ? unit::metre : unit::none);
          p.title(is_range ? "Ranges" : "Intensities", "en").octets().every_sample().dispatch(Dispatch::io_thread);
          state_->outputs.push_back(
              {p, std::make_shared<NumbersReader>(type, *std::move(place), state_->shared, core.options().limits.max_value_bytes)});
        }
        break;
      }
      default: break;
    }
  }

  /// Not while the mutex of the state is held: a thread of DDS may wait for it, and have what this waits for.
  bool make_publisher(Core& core) {
    if (publisher_) return true;
    AdvertiseOptions options;
    options.hash = hash_;
    Result<std::shared_ptr<TopicWriter>> made = core.port().advertise(listed.name, type_, options);
    if (!made) {
      listed.reason = "it cannot be written: " + made.error().message;
      return false;
    }
    publisher_ = *std::move(made);
    return true;
  }

  void make_writable(Core& core, Thing& thing, PushedProperty<RosValue>& value) {
    const bool stamps = state_->stamp.has_value();
    const auto write = [publisher = publisher_, type = *state_->type, shared = core.shared(), stamps](std::string payload) -> Result<void> {
      if (stamps) set_stamp(payload);
      return publisher->publish(payload);
    };
    value.on_write(
        [write, type = *state_->type, publisher = publisher_, name = listed.name, shared = core.shared()](const RosValue& v) -> Result<void> {
          if (publisher->readers() == 0) return refused("no node reads " + name + " now");
          Result<std::string> payload = type.encode(v.value ? *v.value : rdf::Value());
          if (!payload) return Unexpected{std::move(payload).error()};
          Result<void> written = write(*std::move(payload));
          if (written) shared->commands.fetch_add(1, std::memory_order_relaxed);
          return written;
        });
    const milliseconds life = life_in(core);
    if (life.count() > 0) {
      value.expires(life, [write, type = *state_->type, state = std::weak_ptr<TopicState>(state_)] {
        const std::string zero = type.initial();
        (void)write(zero);
        const std::shared_ptr<TopicState> s = state.lock();
        if (!s) return;
        const std::lock_guard lock(s->mutex);  // the sink publishes, too
        RosValue stopped;
        stopped.payload = std::make_shared<const std::string>(zero);
        stopped.reader = s->outputs.front().reader;
        s->outputs.front().property.publish(stopped);
      });
      thing.control();
    }
    if (said_.requires_expiry) thing.requires_expiry();
  }

  Said said_;
  std::string type_, hash_, comment_, last_writers_, frame_stated_;
  Bulk bulk_ = Bulk::none;
  std::shared_ptr<TopicState> state_;  ///< null: there is no type
  Handle subscription_;
  std::shared_ptr<TopicWriter> publisher_;
  Core::Clock::time_point since_{};
  unsigned types_made_ = 0, renewals_ = 0;
  bool waits_ = false, is_joints_ = false, is_description_ = false, is_idle_ = false;
};

}  // namespace

void update_topic(Core& core, const std::string& name, const Topic* topic) {
  core.part_of<TopicPart>("topic " + name, core, name).update(core, topic);
}

}  // namespace lrt::ros2
