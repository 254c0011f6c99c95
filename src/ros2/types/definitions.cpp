// SPDX-License-Identifier: Apache-2.0
#include <lrt/ros2/definitions.hpp>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include <lrt/ros2/message_type.hpp>

#include "src/base/quote.hpp"
#include "src/base/read_file.hpp"
#include "src/ros2/types/names.hpp"
#include "src/ros2/types/parser.hpp"
#include "src/ros2/types/shipped.hpp"
#include "src/ros2/types/type_hash.hpp"

namespace lrt::ros2 {
inline namespace v0 {

namespace {

/// Definitions of one origin: a folder, a text, the description of a node, those that lrt ships.
struct Set {
  std::string origin;
  std::map<std::string, std::string> files;       // type, and the path of its file; not parsed yet
  std::map<std::string, std::string_view> texts;  // type, and its shipped text; not parsed yet
  std::map<std::string, ParsedMessage> parsed;    // message, "demo/srv/Grasp_Request"
  std::map<std::string, Error> failed;            // type, and why it could not be parsed
  std::string type, hash;                         // of a node's description
  std::size_t bytes = 0;                          // of a node's description
};

/// "demo/srv/Grasp" of "demo/srv/Grasp_Request"; the type itself if it is not a part.
std::string_view whole_of(std::string_view type) noexcept {
  const std::size_t slash = type.find('/');
  if (slash == std::string_view::npos || type.substr(slash, 5) == "/msg/") return type;
  return type.substr(0, type.find('_', type.rfind('/')));
}

/// The text between the first <name> and </name> of a package.xml; empty: none.
std::string package_name(const std::filesystem::path& folder) {
  constexpr std::size_t enough = 64 * 1024;
  std::error_code error;
  const std::filesystem::path file = folder / "package.xml";
  if (!std::filesystem::is_regular_file(file, error)) return {};
  const Result<std::string> text = read_file(file.string(), enough);
  if (!text) return {};
  const std::size_t begin = text->find("<name>"), end = text->find("</name>");
  if (begin == std::string::npos || end == std::string::npos || end < begin) return {};
  std::string name = text->substr(begin + 6, end - begin - 6);
  name.erase(0, std::min(name.find_first_not_of(" \t\r\n"), name.size()));
  name.erase(name.find_last_not_of(" \t\r\n") + 1);
  return name;
}

/// Finds files of types below a folder.
class Finder {
 public:
  Finder(Set& set, std::size_t max_files) : set_(set), left_(max_files), entries_left_(20 * max_files) {}

  Result<void> find(const std::filesystem::path& folder, int depth) {
    std::error_code error;
    const std::filesystem::path real = std::filesystem::canonical(folder, error);
    if (error || !visited_.insert(real.string()).second) return {};
    std::string package;
    for (const char* const kind : {"msg", "srv", "action"})
      if (std::filesystem::is_directory(folder / kind, error)) {
        if (package.empty()) package = package_name(folder);
        if (package.empty()) package = real.filename().string();
        if (Result<void> r = files(folder / kind, package, kind); !r) return r;
      }
    if (depth == 0) return {};
    std::set<std::filesystem::path> below;  // in order, so that the same folder gives the same definitions
    for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
      if (entries_left_-- == 0) return limit();
      std::error_code of_entry;
      if (at->path().filename().string().front() != '.' && at->is_directory(of_entry)) below.insert(at->path());
    }
    for (const std::filesystem::path& child : below)
      if (Result<void> r = find(child, depth - 1); !r) return r;
    return {};
  }

 private:
  static Result<void> limit() { return unexpected(Errc::limit_exceeded, "a folder of definitions has more files than DefinitionLimits::max_files"); }

  Result<void> files(const std::filesystem::path& folder, const std::string& package, const std::string& kind) {
    std::error_code error;
    for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
      if (entries_left_-- == 0) return limit();
      const std::filesystem::path& file = at->path();
      std::error_code of_entry;
      if (file.extension() != "." + kind || !at->is_regular_file(of_entry)) continue;
      std::string type = package;
      type.append("/").append(kind).append("/").append(file.stem().string());
      if (!is_type_name(type)) continue;
      if (left_-- == 0) return limit();
      set_.files.emplace(std::move(type), file.string());
    }
    return {};
  }

  Set& set_;
  std::size_t left_, entries_left_;
  std::set<std::string> visited_;
};

Unexpected unknown(std::string_view type) { return unexpected(Errc::unknown_path, "there is no definition of " + std::string(type)); }

FieldType single(Kind kind) {
  FieldType type;
  type.kind = kind;
  return type;
}
FieldType of_message(MessagePtr message) {
  FieldType type = single(Kind::message);
  type.message = std::move(message);
  return type;
}
MessagePtr made(std::string name, std::vector<Field> fields) {
  auto message = std::make_shared<Message>();
  message->name = std::move(name);
  message->fields = std::move(fields);
  message->hash = hash_of(*message);
  message->origin = "lrt";
  return message;
}

}  // namespace

class LRT_LOCAL Definitions::Impl {
 public:
  explicit Impl(DefinitionLimits given) : limits(given) {
    shipped_.origin = shipped_humble_.origin = "shipped with lrt";
    Set* set = &shipped_;
    constexpr std::string_view mark = "=== ";
    const std::string_view all = shipped_definitions();
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t line = std::min(all.find('\n', at), all.size());
      const std::string_view type = all.substr(at + mark.size(), line - at - mark.size());
      const std::size_t next = std::min(all.find("\n=== ", line), all.size() - 1);
      if (is_type_name(type)) set->texts.emplace(type, all.substr(line + 1, next > line ? next - line : 0));
      else set = &shipped_humble_;
      at = next + 1;
    }
  }

  Result<std::size_t> add_folder(const std::string& path) {
    std::error_code error;
    if (!std::filesystem::is_directory(path, error)) return unexpected(Errc::io_error, lrt::quoted(path) + " is not a folder");
    auto set = std::make_unique<Set>();
    set->origin = path;
    Finder finder(*set, limits.max_files);
    constexpr int deepest = 6;  // PREFIX/share/PACKAGE, and workspaces
    if (Result<void> r = finder.find(path, deepest); !r) return Unexpected{std::move(r).error()};
    const std::size_t found = set->files.size();
    if (found == 0) return unexpected(Errc::unknown_path, "there is no .msg, .srv or .action below " + lrt::quoted(path));
    const std::lock_guard lock(mutex_);
    own_.push_back(std::move(set));
    changed();
    return found;
  }

  Result<void> add_text(std::string_view type, std::string_view text, std::string origin) {
    Result<std::vector<ParsedMessage>> parsed = parse_definition(type, text, limits);
    if (!parsed) return Unexpected{std::move(parsed).error()};
    auto set = std::make_unique<Set>();
    set->origin = origin.empty() ? "a text" : std::move(origin);
    for (ParsedMessage& message : *parsed) {
      std::string name = message.name;
      set->parsed.emplace(std::move(name), std::move(message));
    }
    const std::lock_guard lock(mutex_);
    own_.push_back(std::move(set));
    changed();
    return {};
  }

  Result<std::string> add_type_description(std::string_view payload, std::string_view type, std::string_view hash, std::string_view from);

  Result<MessagePtr> message(std::string_view type, std::string_view hash) {
    if (!is_type_name(type)) return unexpected(Errc::unknown_path, lrt::quoted(type) + " is not the name of a type: PACKAGE/msg/NAME");
    const std::lock_guard lock(mutex_);
    const auto key = std::make_pair(std::string(type), std::string(hash));
    if (const auto known = messages_.find(key); known != messages_.end()) return known->second;
    Result<MessagePtr> found = first_of<MessagePtr>(
        type, hash, [&](Set& set) { return has(set, type); }, [&](const std::vector<Set*>& order) { return resolved(type, order); },
        [](const MessagePtr& m) -> const std::string& { return m->hash; });
    if (found) messages_.emplace(key, *found);
    return found;
  }

  Result<std::shared_ptr<const Service>> service(std::string_view type, std::string_view hash) {
    if (!is_type_name(type)) return unexpected(Errc::unknown_path, lrt::quoted(type) + " is not the name of a type: PACKAGE/srv/NAME");
    const std::lock_guard lock(mutex_);
    using Ptr = std::shared_ptr<const Service>;
    const std::string request = std::string(type) + "_Request", response = std::string(type) + "_Response";
    return first_of<Ptr>(
        type, hash, [&](Set& set) { return has(set, request) && has(set, response); },
        [&](const std::vector<Set*>& order) -> Result<Ptr> {
          auto made_service = std::make_shared<Service>();
          made_service->name = type;
          Result<MessagePtr> part = resolved(request, order);
          if (!part) return Unexpected{std::move(part).error()};
          made_service->request = std::move(*part);
          part = resolved(response, order);
          if (!part) return Unexpected{std::move(part).error()};
          made_service->response = std::move(*part);
          made_service->hash = hash_of_service(type, *made_service->request, *made_service->response);
          return Ptr(std::move(made_service));
        },
        [](const Ptr& s) -> const std::string& { return s->hash; });
  }

  Result<std::shared_ptr<const ActionDefinition>> action(std::string_view type, std::string_view hash) {
    if (!is_type_name(type)) return unexpected(Errc::unknown_path, lrt::quoted(type) + " is not the name of a type: PACKAGE/action/NAME");
    const std::lock_guard lock(mutex_);
    using Ptr = std::shared_ptr<const ActionDefinition>;
    const std::string name(type);
    // A node describes the parts of an action one by one: the goal beside the service that sends it, and so on.
    const auto part = [&](const char* suffix, const std::vector<Set*>& order) -> Result<MessagePtr> { return resolved(name + suffix, order); };
    return first_of<Ptr>(
        type, hash, [&](Set& set) { return has(set, name + "_Goal"); },
        [&](const std::vector<Set*>& order) -> Result<Ptr> {
          auto a = std::make_shared<ActionDefinition>();
          a->name = name;
          for (const auto& [suffix, to] : {std::pair("_Goal", &a->goal), std::pair("_Result", &a->result), std::pair("_Feedback", &a->feedback)}) {
            Result<MessagePtr> found = part(suffix, order);
            if (!found) return Unexpected{std::move(found).error()};
            *to = std::move(*found);
          }
          complete(*a);
          return Ptr(std::move(a));
        },
        [](const Ptr& s) -> const std::string& { return s->hash; });
  }

  std::uint64_t version() const noexcept {
    const std::lock_guard lock(mutex_);
    return version_;
  }

  const DefinitionLimits limits;

 private:
  void changed() {
    ++version_;
    messages_.clear();
  }

  /// All sets, in the order of the search.
  std::vector<Set*> all() {
    std::vector<Set*> sets;
    for (const auto& set : own_) sets.push_back(set.get());
    for (const auto& set : of_nodes_) sets.push_back(set.get());
    sets.push_back(&shipped_humble_);
    sets.push_back(&shipped_);
    return sets;
  }

  /// Whether a set has the definition of a message, parsed or not.
  static bool has(const Set& set, std::string_view type) {
    if (set.parsed.find(std::string(type)) != set.parsed.end()) return true;
    const std::string whole(whole_of(type));
    return (set.files.find(whole) != set.files.end() || set.texts.find(whole) != set.texts.end()) || set.failed.find(whole) != set.failed.end();
  }

  /// The message in a set, which is parsed now if it was not yet; nullptr: the set does not have it.
  Result<const ParsedMessage*> find(Set& set, const std::string& type) {
    if (const auto known = set.parsed.find(type); known != set.parsed.end()) return &known->second;
    const std::string whole(whole_of(type));
    if (const auto failed = set.failed.find(whole); failed != set.failed.end()) return Unexpected{failed->second};
    Result<std::string> text = std::string();
    if (const auto file = set.files.find(whole); file != set.files.end()) {
      text = read_file(file->second, limits.max_text_bytes);
      set.files.erase(file);
    } else if (const auto shipped = set.texts.find(whole); shipped != set.texts.end()) {
      text = std::string(shipped->second);
      set.texts.erase(shipped);
    } else {
      return static_cast<const ParsedMessage*>(nullptr);
    }
    Result<std::vector<ParsedMessage>> parsed = text ? parse_definition(whole, *text, limits) : Unexpected{text.error()};
    if (!parsed) {
      Error error = parsed.error();
      error.message.insert(0, set.origin + ": ");
      return Unexpected{set.failed.emplace(whole, std::move(error)).first->second};
    }
    for (ParsedMessage& message : *parsed) {
      std::string name = message.name;
      set.parsed.emplace(std::move(name), std::move(message));
    }
    const auto known = set.parsed.find(type);
    return known != set.parsed.end() ? &known->second : nullptr;
  }

  /// The first set with a definition that can be made and has the hash. What a definition refers to is looked for in its own
  /// set first, unless it is a shipped one.
  template <class T, class Has, class Make, class HashOf>
  Result<T> first_of(std::string_view type, std::string_view hash, Has has_it, Make make, HashOf hash_of_it) {
    const std::vector<Set*> sets = all();
    std::optional<Error> first;
    std::string others;
    for (Set* const set : sets) {
      if (!has_it(*set)) continue;
      std::vector<Set*> order;
      if (set != &shipped_) order.push_back(set);
      for (Set* const other : sets)
        if (std::find(order.begin(), order.end(), other) == order.end()) order.push_back(other);
      // The shipped ones of Jazzy differ from those of Humble: who announces a hash is not of Humble.
      for (const bool humble : {true, false}) {
        if (!humble) {
          if (hash.empty() || set == &shipped_humble_) break;
          order.erase(std::remove(order.begin(), order.end(), &shipped_humble_), order.end());
        }
        Result<T> found = make(order);
        if (found && (hash.empty() || hash_of_it(*found) == hash)) return found;
        if (!found && !first) first = found.error();
        if (found) others += (others.empty() ? "" : ", ") + set->origin;
      }
    }
    if (!others.empty())
      return unexpected(Errc::unknown_path, "there is no definition of " + std::string(type) + " with the hash " + shortened(hash) +
                                                "; another version is known from: " + shortened(others, 300));
    if (first) return Unexpected{std::move(*first)};
    return unknown(type);
  }

  struct Resolving {
    const std::vector<Set*>& order;
    std::map<std::string, std::pair<MessagePtr, std::size_t>> done{};  // with the number of its members
    std::vector<std::string> open{};
  };

  Result<MessagePtr> resolved(std::string_view type, const std::vector<Set*>& order) {
    Resolving state{order};
    Result<std::size_t> members = resolve(std::string(type), state);
    if (!members) return Unexpected{std::move(members).error()};
    return state.done[std::string(type)].first;
  }

  Result<std::size_t> resolve(const std::string& type, Resolving& state) {
    if (const auto done = state.done.find(type); done != state.done.end()) return done->second.second;
    if (std::find(state.open.begin(), state.open.end(), type) != state.open.end())
      return unexpected(Errc::expected_value, type + " contains itself: a message has an end");
    if (state.open.size() >= limits.max_depth)
      return unexpected(Errc::limit_exceeded,
                        state.open.front() + ": its messages are nested more than " + std::to_string(limits.max_depth) + " deep");
    const ParsedMessage* parsed = nullptr;
    std::string origin;
    for (Set* const set : state.order) {
      Result<const ParsedMessage*> found = find(*set, type);
      if (!found) return Unexpected{std::move(found).error()};
      if (!*found) continue;
      parsed = *found;
      origin = set->origin;
      break;
    }
    if (!parsed) {
      if (state.open.empty()) return unknown(type);
      return unexpected(Errc::unknown_path, "there is no definition of " + type + ", which " + state.open.back() + " refers to");
    }
    state.open.push_back(type);
    auto message = std::make_shared<Message>();
    message->name = type;
    message->constants = parsed->constants;
    message->comment = parsed->comment;
    message->origin = std::move(origin);
    std::size_t members = 0;
    for (const ParsedField& field : parsed->fields) {
      message->fields.push_back(field.field);
      ++members;
      if (!field.message.empty()) {
        Result<std::size_t> inner = resolve(field.message, state);
        if (!inner) return inner;
        members += *inner;
        message->fields.back().type.message = state.done[field.message].first;
      }
      if (members > limits.max_members)
        return unexpected(Errc::limit_exceeded, type + " has more than " + std::to_string(limits.max_members) + " fields with those of its messages");
    }
    message->hash = hash_of(*message);
    state.open.pop_back();
    state.done[type] = {std::move(message), members};
    return members;
  }

  /// Adds what an action has on the wire.
  static void complete(ActionDefinition& a) {
    FieldType bytes = single(Kind::uint8);
    bytes.arity = Arity::array;
    bytes.size = 16;
    const MessagePtr id = made("unique_identifier_msgs/msg/UUID", {{"uuid", std::move(bytes)}});
    const MessagePtr time = made("builtin_interfaces/msg/Time", {{"sec", single(Kind::int32)}, {"nanosec", single(Kind::uint32)}});
    a.send_goal_request = made(a.name + "_SendGoal_Request", {{"goal_id", of_message(id)}, {"goal", of_message(a.goal)}});
    a.send_goal_response = made(a.name + "_SendGoal_Response", {{"accepted", single(Kind::boolean)}, {"stamp", of_message(time)}});
    a.get_result_request = made(a.name + "_GetResult_Request", {{"goal_id", of_message(id)}});
    a.get_result_response = made(a.name + "_GetResult_Response", {{"status", single(Kind::int8)}, {"result", of_message(a.result)}});
    a.feedback_message = made(a.name + "_FeedbackMessage", {{"goal_id", of_message(id)}, {"feedback", of_message(a.feedback)}});
    a.hash = hash_of_action(a);
  }

  /// Reads descriptions of types.
  Result<MessageType> decoder() {
    const std::lock_guard lock(mutex_);
    if (decoder_) return *decoder_;
    const Result<MessagePtr> response = resolved("type_description_interfaces/srv/GetTypeDescription_Response", {&shipped_});
    if (!response) return Unexpected{response.error()};
    CodecLimits codec;
    codec.max_bytes = limits.max_kept_bytes;
    codec.max_values = 10 * limits.max_members + 10'000;
    Result<MessageType> made = MessageType::of(*response, {}, codec);
    if (made) decoder_ = *made;
    return made;
  }

  mutable std::mutex mutex_;  // guards the rest
  std::optional<MessageType> decoder_;
  std::vector<std::unique_ptr<Set>> own_, of_nodes_;
  Set shipped_, shipped_humble_;
  std::size_t kept_bytes_ = 0;  // of of_nodes_
  std::uint64_t version_ = 1;
  std::map<std::pair<std::string, std::string>, MessagePtr> messages_;  // type and hash
};

namespace {

// Members of the values of type_description_interfaces.
const rdf::Value& member(const rdf::Value& record, std::size_t index) { return (*record.sequence())[index]; }
std::uint64_t number(const rdf::Value& v) {
  return v.integer() ? static_cast<std::uint64_t>(*v.integer()) : v.large_integer() ? *v.large_integer() : 0;
}

/// The type of services and actions themselves, which no field has: their parts are the messages.
bool is_no_message(const ParsedMessage& m) {
  const auto has = [&](std::string_view name) {
    return std::any_of(m.fields.begin(), m.fields.end(), [&](const ParsedField& f) { return f.field.name == name; });
  };
  return m.name.find("/msg/") == std::string::npos && ((has("request_message") && has("response_message")) || has("send_goal_service"));
}

/// Whether a text has the structure of a description, in which a char is an uint8.
bool same_described(ParsedMessage text, const ParsedMessage& description) {
  for (ParsedField& field : text.fields)
    if (field.field.type.kind == Kind::character) field.field.type.kind = Kind::uint8;
  return same_structure(text, description);
}

/// One IndividualTypeDescription: to the description that is hashed, and as a message.
Result<ParsedMessage> read_individual(const rdf::Value& value, Description& to, const DefinitionLimits& limits) {
  ParsedMessage made;
  made.name = *member(value, 0).text();
  if (!is_type_name(made.name)) return unexpected(Errc::expected_value, "a description of a type has the name " + lrt::quoted(made.name));
  const rdf::Value::Sequence& fields = *member(value, 1).sequence();
  if (fields.size() > limits.max_fields)
    return unexpected(Errc::limit_exceeded, made.name + " has more than " + std::to_string(limits.max_fields) + " fields");
  to.begin(made.name);
  std::set<std::string> names;
  for (const rdf::Value& field : fields) {
    const rdf::Value& type = member(field, 1);
    ParsedField parsed;
    parsed.field.name = *member(field, 0).text();
    const std::string& nested = *member(type, 3).text();
    const auto id = static_cast<unsigned>(number(member(type, 0)));
    const std::uint64_t capacity = number(member(type, 1)), string_capacity = number(member(type, 2));
    to.add(Description::Member{parsed.field.name, id, capacity, string_capacity, nested});
    const std::optional<FieldType> known = type_of_id(id, capacity, string_capacity);
    if (!known)
      return unexpected(Errc::expected_value, made.name + ", " + lrt::quoted(parsed.field.name) + ": .msg has no type " + std::to_string(id));
    parsed.field.type = *known;
    if (known->kind == Kind::message) {
      if (!is_type_name(nested))
        return unexpected(Errc::expected_value,
                          made.name + ", " + lrt::quoted(parsed.field.name) + ": expected a type, found " + lrt::quoted(nested));
      parsed.message = nested;
    }
    if (parsed.field.name.empty() || !names.insert(parsed.field.name).second)
      return unexpected(Errc::expected_value, made.name + ": two fields have the name " + lrt::quoted(parsed.field.name));
    made.fields.push_back(std::move(parsed));
  }
  if (made.fields.size() == 1 && made.fields[0].field.name == "structure_needs_at_least_one_member") made.fields.clear();
  return made;
}

}  // namespace

Result<std::string> Definitions::Impl::add_type_description(std::string_view payload, std::string_view type, std::string_view hash,
                                                            std::string_view from) {
  if (payload.size() > limits.max_kept_bytes) return unexpected(Errc::limit_exceeded, "the description of " + lrt::quoted(type) + " is too large");
  const Result<MessageType> codec = decoder();
  if (!codec) return Unexpected{codec.error()};
  const Result<rdf::Value> response = codec->decode(payload);
  if (!response) return Unexpected{response.error()};
  // successful, failure_reason, type_description, type_sources, extra_information
  if (!*member(*response, 0).boolean())
    return unexpected(Errc::refused, std::string(from) + " does not describe " + lrt::quoted(type) + ": " + shortened(*member(*response, 1).text()));
  const rdf::Value& described = member(*response, 2);
  Description description;
  auto set = std::make_unique<Set>();
  std::size_t members = 0;
  std::string name;
  const auto add = [&](const rdf::Value& individual) -> Result<void> {
    Result<ParsedMessage> message = read_individual(individual, description, limits);
    if (!message) return Unexpected{std::move(message).error()};
    if (name.empty()) name = message->name;
    members += message->fields.size();
    if (members > limits.max_members) return unexpected(Errc::limit_exceeded, name + ": its description has too many fields");
    std::string key = message->name;
    if (!is_no_message(*message)) set->parsed.emplace(std::move(key), std::move(*message));
    return {};
  };
  if (Result<void> r = add(member(described, 0)); !r) return Unexpected{std::move(r).error()};
  for (const rdf::Value& individual : *member(described, 1).sequence())
    if (Result<void> r = add(individual); !r) return Unexpected{std::move(r).error()};
  if (name != type)
    return unexpected(Errc::expected_value, std::string(from) + " describes " + lrt::quoted(name) + ", expected " + lrt::quoted(type));
  std::string found = description.hash();
  if (!hash.empty() && found != hash)
    return unexpected(Errc::expected_value, std::string(from) + ": the description of " + name + " does not have the hash " + shortened(hash));
  // Constants, comments and defaults are in the texts only.
  std::size_t text_bytes = 0;
  for (const rdf::Value& source : *member(*response, 3).sequence()) {
    const std::string &of = *member(source, 0).text(), &text = *member(source, 2).text();
    if (!is_type_name(of) || (text_bytes += text.size()) > 8 * limits.max_text_bytes) continue;
    Result<std::vector<ParsedMessage>> parsed = parse_definition(of, text, limits);
    if (!parsed) continue;  // of IDL, or with what we do not read: the structure is enough
    for (ParsedMessage& message : *parsed) {
      const auto known = set->parsed.find(message.name);
      if (known != set->parsed.end() && same_described(message, known->second)) known->second = std::move(message);
    }
  }
  set->origin = "the node " + std::string(from);
  set->type = name;
  set->hash = std::move(found);
  set->bytes = payload.size();
  const std::lock_guard lock(mutex_);
  for (const auto& known : of_nodes_)
    if (known->type == set->type && known->hash == set->hash) return name;
  if (of_nodes_.size() >= limits.max_definitions || set->bytes > limits.max_kept_bytes - std::min(kept_bytes_, limits.max_kept_bytes))
    return unexpected(Errc::limit_exceeded, "no more definitions of nodes are kept: DefinitionLimits");
  kept_bytes_ += set->bytes;
  of_nodes_.push_back(std::move(set));
  changed();
  return name;
}

Definitions::Definitions(DefinitionLimits limits) : impl_(std::make_unique<Impl>(limits)) {}
Definitions::Definitions(Definitions&&) noexcept = default;
Definitions& Definitions::operator=(Definitions&&) noexcept = default;
Definitions::~Definitions() = default;

Result<std::size_t> Definitions::add_folder(const std::string& path) { return impl_->add_folder(path); }
Result<void> Definitions::add_text(std::string_view type, std::string_view text, std::string origin) {
  return impl_->add_text(type, text, std::move(origin));
}
Result<std::string> Definitions::add_type_description(std::string_view payload, std::string_view type, std::string_view hash, std::string_view from) {
  return impl_->add_type_description(payload, type, hash, from);
}
Result<MessagePtr> Definitions::message(std::string_view type, std::string_view hash) const { return impl_->message(type, hash); }
Result<std::shared_ptr<const Service>> Definitions::service(std::string_view type, std::string_view hash) const { return impl_->service(type, hash); }
Result<std::shared_ptr<const ActionDefinition>> Definitions::action(std::string_view type, std::string_view hash) const {
  return impl_->action(type, hash);
}
std::uint64_t Definitions::version() const noexcept { return impl_->version(); }

}  // namespace v0
}  // namespace lrt::ros2
