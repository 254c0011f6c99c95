// SPDX-License-Identifier: Apache-2.0
#include "src/client/structure.hpp"

#include <algorithm>
#include <set>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/client/binding.hpp"
#include "src/client/representation.hpp"
#include "src/client/session.hpp"
#include "src/client/things.hpp"
#include "src/http/url.hpp"

namespace lrt::client {
inline namespace v0 {

using rdf::json::Children;
using rdf::json::Document;
using Id = Document::Id;

namespace {

constexpr rdf::json::Limits json_limits{10'000'000, 64, true};
constexpr std::size_t max_known = 16;  // in memory

Unexpected no_page(const std::string& url, const char* what) {
  return unexpected(Errc::expected_rdf, "\"" + url + "\" is no structure document: " + what);
}

/// The text of a member; empty: there is none.
std::string_view text_of(const Document& json, Id object, std::string_view name) {
  const Id id = json.member(object, name);
  return id != Document::none && json.kind(id) == Document::Kind::string ? json.text(id) : std::string_view();
}

bool is_true(const Document& json, Id object, std::string_view name) {
  const Id id = json.member(object, name);
  return id != Document::none && json.kind(id) == Document::Kind::true_;
}

std::vector<std::string> texts_of(const Document& json, Id object, std::string_view name) {
  std::vector<std::string> all;
  const Id id = json.member(object, name);
  if (id == Document::none || json.kind(id) != Document::Kind::array) return all;
  for (const Id one : Children(json, id))
    if (json.kind(one) == Document::Kind::string) all.emplace_back(json.text(one));
  return all;
}

/// The texts of `title` and `titles`.
rdf::Texts words_of(const Document& json, Id object, std::string_view one, std::string_view several) {
  rdf::Texts texts;
  const Id all = json.member(object, several);
  if (all != Document::none && json.kind(all) == Document::Kind::object) {
    for (const Id text : Children(json, all))
      if (json.kind(text) == Document::Kind::string)
        texts.add(std::string(json.text(text)), json.key(text) == "@none" ? std::string() : std::string(json.key(text)));
    return texts;
  }
  if (const std::string_view text = text_of(json, object, one); !text.empty()) texts.add(std::string(text));
  return texts;
}

rdf::Words words_of(const Document& json, Id object) {
  return {words_of(json, object, "title", "titles"), words_of(json, object, "description", "descriptions")};
}

/// The titles and the further names; first a name that it has without a title.
Names names_of(const Document& json, Id object, const rdf::Words& words, const std::string& name = {}) {
  Names names;
  const auto add = [&](const std::string& text) {
    if (std::find(names.titles.begin(), names.titles.end(), text) == names.titles.end()) names.titles.push_back(text);
  };
  if (words.titles.empty() && !name.empty()) add(name);
  for (const rdf::Text& t : words.titles) add(t.text);
  for (const std::string& text : texts_of(json, object, "names")) add(text);
  return names;
}

/// The tags of a variant: each alternative is an object that requires one member.
void read_tags(const Document& json, Id schema, Declared& declared) {
  const Id all = json.member(schema, "oneOf");
  if (all == Document::none || json.kind(all) != Document::Kind::array) return;
  std::vector<std::string> tags;
  for (const Id one : Children(json, all)) {
    if (json.kind(one) != Document::Kind::object) return;
    if (text_of(json, one, "type") == "null") continue;  // the value may be absent
    std::vector<std::string> required = texts_of(json, one, "required");
    if (required.size() != 1) return;
    tags.push_back(std::move(required.front()));
  }
  declared.is_variant = !tags.empty();
  declared.choices = std::move(tags);
}

/// What the schema of a value says, beside the unit.
void read_schema(const Document& json, Id schema, Declared& declared) {
  if (schema == Document::none || json.kind(schema) != Document::Kind::object) return;
  declared.has_value = true;
  const std::string_view type = text_of(json, schema, "type");
  const Id names = json.member(schema, "enum");
  if (names != Document::none) declared.choices = texts_of(json, schema, "enum");
  else if (type == "boolean") declared.choices = {"true", "false"};
  else read_tags(json, schema, declared);
  declared.is_simple = names == Document::none && (type == "number" || type == "integer" || type == "boolean" || type == "string");
}

std::shared_ptr<const Declared> declared_of(const Document& json, Id part, std::string_view schema, std::string_view change) {
  auto declared = std::make_shared<Declared>();
  declared->words = words_of(json, part);
  declared->datatype = text_of(json, part, "datatype");
  std::string qudt, vom;
  for (std::string& unit : texts_of(json, part, "units")) (unit.find("arvida.de") == std::string::npos ? qudt : vom) = std::move(unit);
  if (const auto unit = unit_of(qudt, vom)) declared->unit = *unit;
  declared->may_change = is_true(json, part, change);
  declared->is_stop = is_true(json, part, "stop");
  read_schema(json, json.member(part, schema), *declared);
  return declared;
}

}  // namespace

// --- StructureReader ---

struct StructureReader::Kind {
  struct Part {
    std::string path;  // below that of the Thing
    Names names;
    std::shared_ptr<const Declared> declared;
  };
  std::vector<std::string> types;
  std::string subscriptions, state;
  std::vector<Part> properties, actions;
};

Result<void> StructureReader::add(std::string text) {
  constexpr std::string_view location = "/ns/structure";
  constexpr std::size_t max_bytes = 256 * 1024 * 1024;
  Result<Document> read = Document::parse(text, json_limits);
  if (!read) return unexpected(std::move(read).error());
  const Document& json = *read;
  if (json.kind(json.root()) != Document::Kind::object) return no_page(url_, "expected an object");
  const std::string_view href = text_of(json, json.root(), "href"), version = text_of(json, json.root(), "structure");
  const std::size_t at = href.rfind(location);
  if (version.empty() || at == std::string_view::npos || !same_origin(href, url_)) return no_page(url_, "expected its IRI and its version");
  const std::string_view base = href.substr(0, at);
  if (pages_.empty()) {
    base_ = base;
    version_ = version;
  } else if (base_ != base || version_ != version) {
    return unexpected(Errc::expected_value, "\"" + url_ + "\" has changed while it was read");
  }
  bytes_ += text.size();
  if (bytes_ > max_bytes) return unexpected(Errc::limit_exceeded, "\"" + url_ + "\" has more than 256 MiB");
  const Id next = json.member(json.root(), "next");
  next_ = next == Document::none || json.kind(next) != Document::Kind::object ? std::string_view() : text_of(json, next, "href");
  if (!next_.empty() && !same_origin(next_, url_)) return no_page(url_, "its next page is of another server");
  texts_.push_back(std::move(text));
  pages_.push_back(*std::move(read));
  return {};
}

Result<StructureReader::Kind> StructureReader::kind_of(const Document& page, Id id, const std::string& vocabulary) const {
  if (page.kind(id) != Document::Kind::object) return no_page(url_, "a kind is no object");
  Kind kind;
  kind.types = texts_of(page, id, "types");
  kind.types.insert(kind.types.begin(), std::string(vocab::hybrit::RoboticThing.text));
  kind.subscriptions = text_of(page, id, "subscriptions");
  kind.state = text_of(page, id, "state");
  std::map<std::string, std::size_t> uses;  // a predicate to several parts is the name of none
  const auto read = [&](std::vector<Kind::Part>& parts, std::string_view name, auto make) {
    const Id all = page.member(id, name);
    if (all == Document::none || page.kind(all) != Document::Kind::object) return;
    for (const Id one : Children(page, all)) {
      if (page.kind(one) != Document::Kind::object) continue;
      parts.push_back(make(one));
      std::vector<std::string> predicates = texts_of(page, one, "predicates");
      if (predicates.empty() && name == "properties" && !vocabulary.empty()) predicates.push_back(vocabulary + std::string(page.key(one)));
      for (const std::string& predicate : predicates) ++uses[predicate];
      parts.back().names.predicates = std::move(predicates);
    }
  };
  read(kind.properties, "properties", [&](Id one) {
    Kind::Part part{std::string(page.key(one)), {}, declared_of(page, one, "schema", "writable")};
    part.names = names_of(page, one, part.declared->words);
    return part;
  });
  read(kind.actions, "actions", [&](Id one) {
    Kind::Part part{std::string(text_of(page, one, "path")), {}, declared_of(page, one, "input", "invocable")};
    part.names = names_of(page, one, part.declared->words);
    return part;
  });
  for (std::vector<Kind::Part>* parts : {&kind.properties, &kind.actions})
    for (Kind::Part& part : *parts) {
      std::vector<std::string>& predicates = part.names.predicates;
      const auto is_general = [&](const std::string& predicate) {
        const std::string_view local = local_name(predicate);
        return uses[predicate] > 1 || local.empty() || local == "property" || local == "action";
      };
      predicates.erase(std::remove_if(predicates.begin(), predicates.end(), is_general), predicates.end());
    }
  return kind;
}

Result<std::vector<Thing>> StructureReader::things(const std::shared_ptr<Session>& session) const {
  std::vector<Thing> things;
  for (const Document& page : pages_) {
    const std::string vocabulary(text_of(page, page.root(), "vocabulary"));
    std::unordered_map<std::string_view, Kind> kinds;
    const Id all_kinds = page.member(page.root(), "kinds"), all_things = page.member(page.root(), "things");
    if (all_kinds == Document::none || page.kind(all_kinds) != Document::Kind::object || all_things == Document::none ||
        page.kind(all_things) != Document::Kind::array)
      return no_page(url_, "expected kinds and things");
    for (const Id one : Children(page, all_kinds)) {
      Result<Kind> kind = kind_of(page, one, vocabulary);
      if (!kind) return unexpected(std::move(kind).error());
      kinds.emplace(page.key(one), *std::move(kind));
    }
    for (const Id one : Children(page, all_things)) {
      if (page.kind(one) != Document::Kind::object) return no_page(url_, "a Thing is no object");
      const auto found = kinds.find(text_of(page, one, "kind"));
      const std::string_view path = text_of(page, one, "path");
      if (found == kinds.end() || path.substr(0, 1) != "/") return no_page(url_, "a Thing has no path or no kind");
      const Kind& kind = found->second;
      Thing thing;
      thing.session_ = session;
      thing.url_ = base_ + std::string(path);
      thing.types_ = kind.types;
      const auto below = [&](const std::string& name) { return name.empty() ? name : thing.url_ + "/" + name; };
      thing.subscriptions_ = below(kind.subscriptions);
      thing.state_ = below(kind.state);
      thing.words_ = words_of(page, one);
      const std::string_view last = path.substr(path.rfind('/') + 1);
      const Result<std::string> name = iri::decode(last);
      thing.names_ = names_of(page, one, thing.words_, name ? *name : std::string(last));
      thing.document_ = std::make_shared<Thing::LateDocument>();
      const auto take = [&](auto& all, const std::vector<Kind::Part>& parts) {
        all.reserve(parts.size());
        for (const Kind::Part& part : parts) {
          typename std::decay_t<decltype(all)>::value_type entry;
          entry.session_ = session;
          entry.url_ = below(part.path);
          entry.names_ = part.names;
          entry.declared_ = part.declared;
          all.push_back(std::move(entry));
        }
      };
      take(thing.properties_, kind.properties);
      take(thing.actions_, kind.actions);
      things.push_back(std::move(thing));
    }
  }
  return things;
}

// --- Structures ---

Structures::Structures(Session& session, const Options& options)
    : session_(session),
      store_(options.cache_folder.empty() ? std::nullopt : std::optional<StructureStore>(std::in_place, options.cache_folder)),
      age_(options.cache_age) {}

/// The password is left out of what is hashed: it can be short, and the user is known by the name.
std::string Structures::key_of(const std::string& url) {
  std::vector<std::pair<std::string, std::string>> fields;
  const Result<http::Url> parsed = http::parse_url(url);
  if (parsed) fields = session_.http().identity_fields(*parsed);
  const Identity& identity = session_.options().identity;
  if (!identity.user.empty()) {
    for (auto& [name, value] : fields)
      if (name == "Authorization") value = "user " + identity.user;
  }
  fields.emplace_back("certificate", identity.certificate_file);
  fields.emplace_back("Accept", "1");  // which documents this version reads
  return StructureStore::key(url, fields);
}

void Structures::keep(const std::string& url, Known known) {
  const std::lock_guard lock(mutex_);
  if (known_.size() >= max_known && known_.count(url) == 0) known_.erase(known_.begin());
  known_.insert_or_assign(url, std::move(known));
}

Robot Structures::robot_of(std::string start, std::shared_ptr<const std::vector<Thing>> things, std::size_t requests) {
  Robot robot;
  robot.session_ = session_.shared_from_this();
  robot.url_ = std::move(start);
  robot.things_ = std::move(things);
  robot.problems_ = std::make_shared<const std::vector<std::string>>();
  robot.requests_ = requests;
  return robot;
}

/// Reads a document, or finds that it has not changed.
/// @param wanted  its URL and that of the list of Things; with pages: it is known
Result<Robot> Structures::read(const std::string& url, const StoredStructure& wanted, const Known* known, std::size_t requests) {
  constexpr int max_attempts = 3;
  const bool has_pages = !wanted.pages.empty();
  for (int attempt = 1;; ++attempt) {
    Request request{"GET", wanted.url, {{"Accept", "application/json, application/problem+json;q=0.1"}}, {}};
    if (has_pages && !wanted.entity_tag.empty()) request.fields.emplace_back("If-None-Match", wanted.entity_tag);
    ++requests;
    Result<Response> response = session_.http().send(request);
    if (!response) return unexpected(std::move(response).error());
    if (response->status == 304 && has_pages) {
      if (store_) store_->confirm(key_of(url));
      std::shared_ptr<const std::vector<Thing>> things = known ? known->things.lock() : nullptr;
      if (!things) {
        StructureReader reader(wanted.url);
        for (const std::string& page : wanted.pages)
          if (Result<void> added = reader.add(page); !added) return unexpected(std::move(added).error());
        Result<std::vector<Thing>> made = reader.things(session_.shared_from_this());
        if (!made) return unexpected(std::move(made).error());
        things = std::make_shared<const std::vector<Thing>>(*std::move(made));
      }
      keep(url, {wanted, things, std::chrono::steady_clock::now()});
      return robot_of(wanted.start, std::move(things), requests);
    }
    if (!response->ok()) return unexpected(error_of(*response, "GET", wanted.url));
    if (!same_origin(response->url, wanted.url)) return unexpected(Errc::refused, "\"" + wanted.url + "\" is of another server");
    StoredStructure document{wanted.start, wanted.url, response->fields.joined("ETag"), {}};
    StructureReader reader(wanted.url);
    Result<void> added = reader.add(std::move(response->body));
    while (added && !reader.next().empty()) {
      ++requests;
      response = session_.http().send({"GET", reader.next(), {{"Accept", "application/json, application/problem+json;q=0.1"}}, {}});
      if (!response) return unexpected(std::move(response).error());
      if (!response->ok()) return unexpected(error_of(*response, "GET", wanted.url));
      added = reader.add(std::move(response->body));
    }
    if (!added && added.error().code == Errc::expected_value && attempt < max_attempts) continue;  // the structure has changed meanwhile
    if (!added) return unexpected(std::move(added).error());
    Result<std::vector<Thing>> made = reader.things(session_.shared_from_this());
    if (!made) return unexpected(std::move(made).error());
    document.pages = reader.pages();
    if (store_) store_->put(key_of(url), document);
    auto things = std::make_shared<const std::vector<Thing>>(*std::move(made));
    keep(url, {std::move(document), things, std::chrono::steady_clock::now()});
    return robot_of(wanted.start, std::move(things), requests);
  }
}

Result<std::optional<Robot>> Structures::open(const std::string& url) {
  std::optional<Known> known;
  bool is_fresh = false;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = known_.find(url); found != known_.end()) known = found->second;
  }
  if (known) {
    is_fresh = age_.count() != 0 && std::chrono::steady_clock::now() - known->confirmed < age_;
  } else if (store_) {
    if (std::optional<StructureStore::Found> found = store_->find(key_of(url))) {
      const auto age = std::chrono::system_clock::now() - found->confirmed;
      is_fresh = age_.count() != 0 && age >= std::chrono::seconds(0) && age < age_;
      known.emplace(Known{std::move(found->document), {}, {}});
      if (!same_origin(known->document.url, known->document.start)) known.reset();
    }
  }
  if (!known) return std::optional<Robot>();
  if (is_fresh) {
    StructureReader reader(known->document.url);
    Result<void> added;
    for (const std::string& page : known->document.pages)
      if (added) added = reader.add(page);
    if (added) {
      Result<std::vector<Thing>> made = reader.things(session_.shared_from_this());
      if (made) return std::optional(robot_of(known->document.start, std::make_shared<const std::vector<Thing>>(*std::move(made)), 0));
    }
  }
  Result<Robot> robot = read(url, known->document, &*known, 0);
  if (robot) return std::optional(*std::move(robot));
  const Errc code = robot.error().code;
  if (code == Errc::cancelled || code == Errc::timed_out || code == Errc::io_error || code == Errc::closed)
    return unexpected(std::move(robot).error());
  {
    const std::lock_guard lock(mutex_);
    known_.erase(url);
  }
  if (store_) store_->remove(key_of(url));
  return std::optional<Robot>();
}

Result<std::optional<Robot>> Structures::follow(const std::string& url, const std::string& start, const std::string& document,
                                                std::size_t& requests) {
  Result<Robot> robot = read(url, {start, document, {}, {}}, nullptr, requests);
  if (robot) return std::optional(*std::move(robot));
  if (robot.error().code == Errc::cancelled) return unexpected(std::move(robot).error());
  ++requests;
  return std::optional<Robot>();
}

}  // namespace v0
}  // namespace lrt::client
