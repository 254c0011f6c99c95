// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/graph/parameters.hpp"

#include <algorithm>

#include <lrt/ros2/definitions.hpp>

#include "src/base/base64.hpp"
#include "src/ros2/graph/cdr.hpp"
#include "src/ros2/graph/core.hpp"
#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {

namespace {

constexpr std::size_t max_events = 10'000;  ///< parameters in one event
/// Of what a node responds, and of an event: a list of booleans takes some 40 times its bytes as values.
constexpr std::size_t max_response_bytes = 4 * 1024 * 1024, max_event_bytes = 1024 * 1024;

Unexpected malformed(const char* what) { return unexpected(Errc::expected_value, std::string("the response of ") + what + " is malformed"); }

template <class F>
rdf::Value read_list(CdrReader& reader, std::size_t least, F&& one) {
  const std::size_t count = reader.count(least);
  rdf::Value::Sequence list;
  list.reserve(count);
  for (std::size_t i = 0; i < count && reader.ok(); ++i) list.push_back(rdf::Value(one()));
  return rdf::Value(std::move(list));
}

/// rcl_interfaces/msg/ParameterValue: all members are there, `type` says which one counts.
void read_value(CdrReader& reader, Parameter& parameter) {
  const std::uint8_t type = reader.u8();
  const bool boolean = reader.boolean();
  const std::int64_t integer = reader.i64();
  const double real = reader.f64();
  const std::string_view text = reader.text();
  const std::string_view bytes = reader.bytes(reader.count(1));
  rdf::Value booleans = read_list(reader, 1, [&] { return reader.boolean(); });
  rdf::Value integers = read_list(reader, 8, [&] { return reader.i64(); });
  rdf::Value reals = read_list(reader, 8, [&] { return reader.f64(); });
  rdf::Value texts = read_list(reader, 4, [&] { return std::string(reader.text()); });
  if (!reader.ok()) return;
  parameter.type = type <= 9 ? static_cast<ParameterType>(type) : ParameterType::not_set;
  switch (parameter.type) {
    case ParameterType::not_set: parameter.value = {}; break;
    case ParameterType::boolean: parameter.value = rdf::Value(boolean); break;
    case ParameterType::integer: parameter.value = rdf::Value(integer); break;
    case ParameterType::real: parameter.value = rdf::Value(real); break;
    case ParameterType::text: parameter.value = rdf::Value(std::string(text)); break;
    case ParameterType::bytes: parameter.value = rdf::Value(detail::base64(bytes)); break;
    case ParameterType::booleans: parameter.value = std::move(booleans); break;
    case ParameterType::integers: parameter.value = std::move(integers); break;
    case ParameterType::reals: parameter.value = std::move(reals); break;
    case ParameterType::texts: parameter.value = std::move(texts); break;
  }
}

std::optional<double> to_real(const rdf::Value& value) {
  if (const double* real = value.real()) return *real;
  if (const std::int64_t* integer = value.integer()) return static_cast<double>(*integer);
  if (const std::uint64_t* large = value.large_integer()) return static_cast<double>(*large);
  return std::nullopt;
}

std::optional<std::string> from_base64(std::string_view text) {
  std::string bytes;
  std::uint32_t group = 0;
  if (text.size() % 4 != 0) return std::nullopt;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_padding = text[i] == '=' && i + 2 >= text.size() && (i + 1 == text.size() || text[i + 1] == '=');
    const int digit = is_padding ? 0 : detail::base64_digit(text[i]);
    if (digit < 0) return std::nullopt;
    group = group << 6 | static_cast<std::uint32_t>(digit);
    if (i % 4 != 3) continue;
    for (int shift : {16, 8, 0}) bytes += static_cast<char>(static_cast<unsigned char>(group >> shift));
    group = 0;
  }
  for (std::size_t i = text.size(); i-- != 0 && text[i] == '=';) bytes.pop_back();
  return bytes;
}

/// Members of a list by `one`, which returns nullopt for one of another kind; false: some is.
template <class F>
bool write_list(CdrWriter& writer, const rdf::Value* value, F&& one) {
  if (value == nullptr) {
    writer.u32(0);
    return true;
  }
  const rdf::Value::Sequence* const list = value->sequence();
  if (list == nullptr) return false;
  writer.u32(static_cast<std::uint32_t>(list->size()));
  for (const rdf::Value& member : *list)
    if (!one(member)) return false;
  return true;
}

bool write_value(CdrWriter& writer, const Parameter& parameter) {
  const rdf::Value& value = parameter.value;
  const auto type = parameter.type;
  const auto list_of = [&](ParameterType which) { return type == which ? &value : nullptr; };
  const auto has = [&](const void* content, ParameterType which) { return type != which || content != nullptr; };
  writer.u8(static_cast<std::uint8_t>(type));
  const bool* const boolean = value.boolean();
  const std::int64_t* const integer = value.integer();
  const std::optional<double> real = to_real(value);
  const std::string* const text = value.text();
  if (!has(boolean, ParameterType::boolean) || !has(integer, ParameterType::integer) || !has(text, ParameterType::text) ||
      !has(text, ParameterType::bytes) || (type == ParameterType::real && !real))
    return false;
  std::optional<std::string> bytes = std::string();
  if (type == ParameterType::bytes) bytes = from_base64(*text);
  if (!bytes) return false;
  writer.boolean(type == ParameterType::boolean && *boolean);
  writer.i64(type == ParameterType::integer ? *integer : 0);
  writer.f64(type == ParameterType::real ? *real : 0);
  writer.text(type == ParameterType::text ? std::string_view(*text) : std::string_view());
  writer.u32(static_cast<std::uint32_t>(bytes->size())).bytes(*bytes);
  return write_list(writer, list_of(ParameterType::booleans),
                    [&](const rdf::Value& one) { return one.boolean() != nullptr && (writer.boolean(*one.boolean()), true); }) &&
         write_list(writer, list_of(ParameterType::integers),
                    [&](const rdf::Value& one) { return one.integer() != nullptr && (writer.i64(*one.integer()), true); }) &&
         write_list(writer, list_of(ParameterType::reals),
                    [&](const rdf::Value& one) { return to_real(one).has_value() && (writer.f64(*to_real(one)), true); }) &&
         write_list(writer, list_of(ParameterType::texts),
                    [&](const rdf::Value& one) { return one.text() != nullptr && (writer.text(*one.text()), true); });
}

}  // namespace

std::string list_request() {
  CdrWriter writer;
  writer.u32(0).u64(0);  // all prefixes, any depth
  return writer.payload();
}

Result<std::vector<std::string>> read_list_response(std::string_view payload, std::size_t max) {
  CdrReader reader(payload);
  const std::size_t count = reader.count(4);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count && names.size() < max; ++i) {
    const std::string_view name = reader.text();
    if (!reader.ok()) return malformed("list_parameters");
    if (!name.empty()) names.emplace_back(name);
  }
  if (!reader.ok()) return malformed("list_parameters");
  return names;
}

std::string names_request(const std::vector<std::string>& names) {
  CdrWriter writer;
  writer.u32(static_cast<std::uint32_t>(names.size()));
  for (const std::string& name : names) writer.text(name);
  return writer.payload();
}

Result<void> read_descriptors(std::string_view payload, std::vector<Parameter>& parameters) {
  // Iron and later have `dynamic_typing`; Foxy and before have not. What fits the length of the payload is the layout.
  for (const bool has_dynamic : {true, false}) {
    CdrReader reader(payload);
    const std::size_t count = reader.count(20);
    std::vector<Parameter> described = parameters;
    for (std::size_t i = 0; i < count && reader.ok(); ++i) {
      const std::string_view name = reader.text();
      Parameter found;
      found.name = name;
      reader.u8();  // the type; that of the value counts
      found.description = reader.text();
      found.constraints = reader.text();
      found.read_only = reader.boolean();
      found.dynamic_type = has_dynamic && reader.boolean();
      const std::size_t reals = reader.count(24);
      for (std::size_t n = 0; n < reals && reader.ok(); ++n) {
        const double from = reader.f64(), to = reader.f64(), step = reader.f64();
        found.range = Parameter::Range{from, to, step};
      }
      const std::size_t integers = reader.count(24);
      for (std::size_t n = 0; n < integers && reader.ok(); ++n) {
        const auto from = static_cast<double>(reader.i64()), to = static_cast<double>(reader.i64()), step = static_cast<double>(reader.u64());
        found.range = Parameter::Range{from, to, step};
      }
      if (i >= described.size() || !reader.ok()) continue;
      if (found.range && !(found.range->from <= found.range->to && found.range->step >= 0)) found.range.reset();  // NaN included
      if (name == described[i].name) {
        found.type = described[i].type;
        found.value = std::move(described[i].value);
        described[i] = std::move(found);
      }
    }
    if (!reader.ok() || reader.left() > 3) continue;
    parameters = std::move(described);
    return {};
  }
  return malformed("describe_parameters");
}

Result<void> read_values(std::string_view payload, std::vector<Parameter>& parameters) {
  if (payload.size() > max_response_bytes) return unexpected(Errc::limit_exceeded, "the parameters of the node have more than 4 MiB");
  CdrReader reader(payload);
  const std::size_t count = reader.count(26);
  for (std::size_t i = 0; i < count && i < parameters.size() && reader.ok(); ++i) read_value(reader, parameters[i]);
  if (!reader.ok()) return malformed("get_parameters");
  return {};
}

Result<std::string> set_request(const Parameter& parameter) {
  CdrWriter writer;
  writer.u32(1).text(parameter.name);
  if (!write_value(writer, parameter))
    return unexpected(Errc::expected_value, "the value of the parameter \"" + parameter.name + "\" is not of its type");
  return writer.payload();
}

Result<void> read_set_response(std::string_view payload) {
  CdrReader reader(payload);
  const std::size_t count = reader.count(5);
  const bool successful = reader.boolean();
  const std::string_view reason = reader.text();
  if (!reader.ok() || count == 0) return malformed("set_parameters");
  if (!successful) return unexpected(Errc::refused, reason.empty() ? "the node does not take the value and states no reason" : std::string(reason));
  return {};
}

Result<ParameterChange> read_event(std::string_view payload) {
  if (payload.size() > max_event_bytes) return unexpected(Errc::limit_exceeded, "an event of parameters has more than 1 MiB");
  CdrReader reader(payload);
  reader.u32();
  reader.u32();
  ParameterChange change;
  change.node = reader.text();
  for (const bool deleted : {false, false, true}) {
    const std::size_t count = reader.count(30);
    if (count > max_events) return malformed("parameter_events");
    for (std::size_t i = 0; i < count && reader.ok(); ++i) {
      Parameter parameter;
      parameter.name = reader.text();
      read_value(reader, parameter);
      if (!reader.ok()) break;
      if (deleted) change.deleted.push_back(std::move(parameter.name));
      else change.parameters.push_back(std::move(parameter));
    }
  }
  if (!reader.ok() || !is_full_name(change.node)) return malformed("parameter_events");
  return change;
}

inline namespace v0 {

namespace {

/// The next call of a chain. The chain is ended with the error if it cannot be made.
template <class F>
void next_call(const std::shared_ptr<GraphCore>& core, const std::shared_ptr<Call::State>& chain, const std::string& service, const std::string& type,
               const std::string& request, TimePoint deadline, F&& then) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  auto made = core->call(
      service, type, request,
      [weak = std::weak_ptr<Call::State>(chain), then = std::forward<F>(then)](Result<Bytes> response) mutable {
        if (const auto alive = weak.lock()) then(alive, std::move(response));
      },
      left, true);
  if (!made) return chain->finish(unexpected(made.error()));
  Call before;
  const std::lock_guard<std::recursive_mutex> lock(chain->mutex);
  before = std::exchange(chain->inner, chain->alive ? std::move(*made) : Call());
  // `before` is the call whose response is being processed: it is destroyed without a lock that another thread waits for, since only
  // this thread responds to calls.
}

struct ParametersChain {
  std::string node;
  std::size_t max;
  TimePoint deadline;
  std::vector<Parameter> parameters{};
  UniqueFunction<void(Result<std::vector<Parameter>>)> done;
};

}  // namespace

Result<Call> Graph::parameters(std::string_view node, UniqueFunction<void(Result<std::vector<Parameter>>)> done, std::size_t max,
                               std::chrono::milliseconds timeout) {
  if (!is_full_name(node)) return unexpected(Errc::expected_value, "\"" + std::string(node) + "\" is no full name of a node");
  const auto work = std::make_shared<ParametersChain>(ParametersChain{std::string(node), max, deadline_after(timeout), {}, std::move(done)});
  // The chain's own callback gets an error, or null bytes when `parameters` is complete.
  auto chain = impl_->core->begin_chain([work](const Result<Bytes>& end) {
    if (!end) work->done(unexpected(end.error()));
    else work->done(std::move(work->parameters));
  });
  if (!chain) return unexpected(chain.error());
  const auto ask = [work](const std::shared_ptr<GraphCore>& now, const std::shared_ptr<Call::State>& list) {
    next_call(now, list, work->node + "/list_parameters", "rcl_interfaces/srv/ListParameters", list_request(), work->deadline,
              [core = std::weak_ptr<GraphCore>(now), work](const std::shared_ptr<Call::State>& state, Result<Bytes> response) {
                const auto shared = core.lock();
                if (!response || shared == nullptr) return state->finish(std::move(response));
                auto names = read_list_response(**response, work->max);
                if (!names) return state->finish(unexpected(names.error()));
                for (const std::string& name : *names) {
                  work->parameters.emplace_back();
                  work->parameters.back().name = name;
                }
                if (names->empty()) return state->finish(Bytes());
                const std::string request = names_request(*names);
                next_call(shared, state, work->node + "/get_parameters", "rcl_interfaces/srv/GetParameters", request, work->deadline,
                          [core, work, request](const std::shared_ptr<Call::State>& same, Result<Bytes> values) {
                            const auto alive = core.lock();
                            if (!values || alive == nullptr) return same->finish(std::move(values));
                            if (const auto read = read_values(**values, work->parameters); !read) return same->finish(unexpected(read.error()));
                            next_call(alive, same, work->node + "/describe_parameters", "rcl_interfaces/srv/DescribeParameters", request,
                                      work->deadline, [work](const std::shared_ptr<Call::State>& last, Result<Bytes> descriptors) {
                                        if (!descriptors) return last->finish(std::move(descriptors));
                                        if (const auto read = read_descriptors(**descriptors, work->parameters); !read)
                                          return last->finish(unexpected(read.error()));
                                        last->finish(Bytes());
                                      });
                          });
              });
  };
  const bool posted = impl_->core->post([core = std::weak_ptr<GraphCore>(impl_->core), state = *chain, ask] {
    const auto shared = core.lock();
    if (shared != nullptr && state->is_alive()) ask(shared, state);
  });
  if (!posted) {
    (*chain)->end();
    return unexpected(Errc::closed, "the graph is closed");
  }
  return GraphCore::handle_of(std::move(*chain));
}

Result<Call> Graph::set_parameter(std::string_view node, const Parameter& parameter, UniqueFunction<void(Result<void>)> done,
                                  std::chrono::milliseconds timeout) {
  if (!is_full_name(node)) return unexpected(Errc::expected_value, "\"" + std::string(node) + "\" is no full name of a node");
  const auto request = set_request(parameter);
  if (!request) return unexpected(request.error());
  return call(
      std::string(node) + "/set_parameters", "rcl_interfaces/srv/SetParameters", *request,
      [done = std::move(done)](Result<Bytes> response) mutable {
        if (!response) done(unexpected(response.error()));
        else done(read_set_response(**response));
      },
      timeout);
}

Result<Subscription> Graph::parameter_events(
    UniqueFunction<void(std::string_view node, std::vector<Parameter> parameters, std::vector<std::string> deleted)> changed) {
  struct Gate {
    std::recursive_mutex mutex{};
    bool alive = true;
    UniqueFunction<void(std::string_view, std::vector<Parameter>, std::vector<std::string>)> changed{};
  };
  const auto gate = std::make_shared<Gate>();
  gate->changed = std::move(changed);
  const std::weak_ptr<GraphCore> core = impl_->core;
  auto subscription = impl_->core->subscribe(
      "/parameter_events", "rcl_interfaces/msg/ParameterEvent",
      [core, gate](Sample&& sample) {
        const auto shared = core.lock();
        if (shared == nullptr || sample.payload->size() > max_event_bytes) return;
        shared->post_sample(sample.payload->size(), [gate, payload = sample.payload] {
          auto change = read_event(*payload);
          if (!change) return;
          const std::lock_guard<std::recursive_mutex> lock(gate->mutex);
          if (gate->alive) gate->changed(change->node, std::move(change->parameters), std::move(change->deleted));
        });
      },
      SubscribeOptions{{}, 64, std::chrono::nanoseconds(0)}, false);
  if (subscription)
    GraphCore::when_ended(*subscription, [gate] {
      const std::lock_guard<std::recursive_mutex> lock(gate->mutex);
      gate->alive = false;
    });
  return subscription;
}

namespace {

struct DefinitionChain {
  std::string type, hash;
  std::vector<std::string> nodes;  ///< that are still to be asked
  Definitions* definitions;
  TimePoint deadline;
  Error last{Errc::unavailable, {}};
};

void ask_next(const std::shared_ptr<GraphCore>& core, const std::shared_ptr<Call::State>& chain, const std::shared_ptr<DefinitionChain>& work) {
  if (work->nodes.empty()) return chain->finish(unexpected(work->last));
  const std::string node = std::move(work->nodes.back());
  work->nodes.pop_back();
  CdrWriter request;
  request.text(work->type).text(work->hash).boolean(true);
  next_call(core, chain, node + "/get_type_description", "type_description_interfaces/srv/GetTypeDescription", request.payload(), work->deadline,
            [weak = std::weak_ptr<GraphCore>(core), work, node](const std::shared_ptr<Call::State>& state, Result<Bytes> response) {
              const auto shared = weak.lock();
              if (shared == nullptr) return state->finish(std::move(response));
              if (response) {
                // The definitions must live until the handle is gone, which waits for this.
                const std::lock_guard<std::recursive_mutex> lock(state->mutex);
                if (!state->alive) return;
                const auto added = work->definitions->add_type_description(**response, work->type, work->hash, node);
                if (added) return state->finish(Bytes());
                work->last = added.error();
              } else {
                work->last = response.error();
                if (work->last.code == Errc::closed) return state->finish(std::move(response));
              }
              ask_next(shared, state, work);
            });
}

}  // namespace

Result<Call> Graph::request_definition(std::string_view type, std::string_view hash, Definitions& definitions,
                                       UniqueFunction<void(Result<void>)> done, std::chrono::milliseconds timeout) {
  if (!is_type_name(type)) return unexpected(Errc::expected_value, "\"" + std::string(type) + "\" is no name of a type");
  auto chain = impl_->core->begin_chain([done = std::move(done)](const Result<Bytes>& end) mutable {
    if (!end) done(unexpected(end.error()));
    else done({});
  });
  if (!chain) return unexpected(chain.error());
  const auto work = std::make_shared<DefinitionChain>();
  work->type = type;
  work->hash = hash;
  work->definitions = &definitions;
  work->deadline = deadline_after(timeout);
  work->last.message =
      hash.empty() ? "no node announces a hash of " + work->type + ", so none is asked" : "no node that has " + work->type + " describes its types";
  const bool posted = impl_->core->post([core = std::weak_ptr<GraphCore>(impl_->core), state = *chain, work] {
    const auto shared = core.lock();
    if (shared == nullptr || !state->is_alive()) return;
    if (work->hash.empty()) work->hash = shared->known.hash_of(work->type);  // of a part of an action, which no snapshot has
    if (!work->hash.empty()) {
      work->last.message = "no node that has " + work->type + " describes its types";
      work->nodes = shared->known.nodes_with(work->type, work->hash);
      const auto cannot = [&](const std::string& node) {
        return shared->known.server(node + "/get_type_description", "type_description_interfaces/srv/GetTypeDescription").pairs.empty();
      };
      work->nodes.erase(std::remove_if(work->nodes.begin(), work->nodes.end(), cannot), work->nodes.end());
      if (work->nodes.size() > 8) work->nodes.resize(8);  // all describe the same type
    }
    ask_next(shared, state, work);
  });
  if (!posted) {
    (*chain)->end();
    return unexpected(Errc::closed, "the graph is closed");
  }
  return GraphCore::handle_of(std::move(*chain));
}

}  // namespace v0
}  // namespace lrt::ros2
