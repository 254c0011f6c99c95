// SPDX-License-Identifier: Apache-2.0
#include "src/engine/value_patch.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/model/resource_handle.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/base/charset.hpp"
#include "src/base/quote.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/rdf/plain.hpp"
#include "src/rdf/plain_names.hpp"
#include "src/rdf/update_data.hpp"

namespace lrt::engine {
namespace {

constexpr std::size_t max_depth_of_patch = 64;  // as for other bodies

const rdf::Type& present_type(const rdf::Type& type) noexcept { return type.kind == rdf::Type::Kind::optional ? present_type(*type.element) : type; }

/// The type of a member of an object in JSON; nullptr: there is no such member.
const rdf::Type* member_type(const rdf::Type* outer, std::string_view name) {
  if (!outer) return nullptr;
  const rdf::Type& type = present_type(*outer);
  if (type.kind == rdf::Type::Kind::map) return type.element;
  const std::vector<std::string> names = rdf::member_names(type);
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? nullptr : type.fields[static_cast<std::size_t>(found - names.begin())].type;
}

BodyFault without_value() { return {409, "the property has no value yet to which a part could be added; PUT the whole value"}; }

/// RFC 7396, of the JSON of a value.
class MergePatch final : public ValuePatch {
  using Document = rdf::json::Document;
  using Id = Document::Id;
  using Json = Document::Kind;

 public:
  MergePatch(BodyTask task, Document patch) : task_(std::move(task)), patch_(std::move(patch)) {}

  JudgedBody apply(const rdf::Value& current) const override {
    if (current.is_null() && task_.type->kind != rdf::Type::Kind::optional) return without_value();
    const Result<std::string> before = rdf::write_plain(*task_.type, task_.facets, current, rdf::Plain::json);
    if (!before) return BodyFault{500, before.error().message};
    const Result<Document> target = Document::parse(*before, {std::numeric_limits<std::uint32_t>::max(), 2 * max_depth_of_patch, true});
    if (!target) return BodyFault{500, target.error().message};
    std::string merged;
    merge(merged, task_.type, *target, target->root(), patch_.root());
    BodyTask task = task_;
    task.text = merged;
    JudgedBody judged = task.judge();
    if (auto* body = std::get_if<Body>(&judged)) body->value = with_rest(*task_.type, patch_.root(), current, std::move(body->value));
    return judged;
  }

 private:
  static void write_text(std::string& out, std::string_view text) { append_json_string(out, text); }

  static void write(std::string& out, const Document& document, Id id) {
    switch (document.kind(id)) {
      case Json::null: out += "null"; return;
      case Json::false_: out += "false"; return;
      case Json::true_: out += "true"; return;
      case Json::number: out += document.text(id); return;
      case Json::string: return write_text(out, document.text(id));
      case Json::array: {
        char before = '[';
        for (const Id member : rdf::json::Children(document, id)) {
          out += std::exchange(before, ',');
          write(out, document, member);
        }
        out += before == '[' ? "[]" : "]";
        return;
      }
      case Json::object: {
        char before = '{';
        for (const Id member : rdf::json::Children(document, id)) {
          out += std::exchange(before, ',');
          write_text(out, document.key(member));
          out += ':';
          write(out, document, member);
        }
        out += before == '{' ? "{}" : "}";
        return;
      }
    }
  }

  /// @param type    of the value; nullptr: it is no part of the Property's, and is refused when the result is read
  /// @param target  Document::none: there is nothing to merge with
  void merge(std::string& out, const rdf::Type* type, const Document& targets, Id target, Id patch) const {
    if (patch_.kind(patch) != Json::object) return write(out, patch_, patch);
    const bool has_target = target != Document::none && targets.kind(target) == Json::object;
    char before = '{';
    const auto key = [&](std::string_view name) {
      out += std::exchange(before, ',');
      write_text(out, name);
      out += ':';
    };
    if (has_target)
      for (const Id member : rdf::json::Children(targets, target)) {
        const std::string_view name = targets.key(member);
        const Id change = patch_.member(patch, name);
        if (change != Document::none && patch_.kind(change) == Json::null) continue;
        key(name);
        if (change == Document::none) write(out, targets, member);
        else merge(out, member_type(type, name), targets, member, change);
      }
    for (const Id change : rdf::json::Children(patch_, patch)) {
      const std::string_view name = patch_.key(change);
      if (has_target && targets.member(target, name) != Document::none) continue;
      const rdf::Type* const its_type = member_type(type, name);
      if (patch_.kind(change) == Json::null && its_type) continue;  // it is absent already
      key(name);
      merge(out, its_type, targets, Document::none, change);
    }
    out += before == '{' ? "{}" : "}";
  }

  /// Takes what the patch does not name from the value itself: the text of a robot may have bytes that JSON cannot carry.
  rdf::Value with_rest(const rdf::Type& outer, Id patch, const rdf::Value& current, rdf::Value merged) const {
    const rdf::Type& type = present_type(outer);
    if (type.kind != rdf::Type::Kind::record || patch_.kind(patch) != Json::object || !current.sequence() || !merged.sequence()) return merged;
    const std::vector<std::string> names = rdf::member_names(type);
    rdf::Value::Sequence fields;
    fields.reserve(names.size());
    for (std::size_t i = 0; i < names.size() && i < current.sequence()->size() && i < merged.sequence()->size(); ++i) {
      const rdf::Value &before = (*current.sequence())[i], &after = (*merged.sequence())[i];
      const Id change = patch_.member(patch, names[i]);
      fields.push_back(change == Document::none ? before : with_rest(*type.fields[i].type, change, before, after));
    }
    return rdf::Value(std::move(fields));
  }

  const BodyTask task_;  ///< without the text
  const Document patch_;
};

/// INSERT DATA and DELETE DATA, of the triples of a value.
class UpdatePatch final : public ValuePatch {
 public:
  UpdatePatch(BodyTask task, std::vector<rdf::DataUpdate> updates) : task_(std::move(task)), updates_(std::move(updates)) {}

  JudgedBody apply(const rdf::Value& current) const override {
    if (current.is_null() && task_.type->kind != rdf::Type::Kind::optional) return without_value();
    rdf::Graph graph;
    rdf::write_value(graph, graph.intern(rdf::iri(task_.here)), *task_.type, task_.facets, current, task_.vocabulary);
    for (const rdf::DataUpdate& update : updates_) {
      if (update.kind == rdf::DataUpdate::Kind::insert) graph.merge(update.graph);
      else graph = without(graph, update.graph);
    }
    return task_.judge(std::move(graph));
  }

 private:
  static rdf::Graph without(const rdf::Graph& all, const rdf::Graph& removed) {
    rdf::Graph left;
    const bool has_blanks = std::any_of(all.triples().begin(), all.triples().end(),
                                        [&](const rdf::Triple& t) { return all.term(t.subject).is_blank() || all.term(t.object).is_blank(); });
    std::vector<std::optional<rdf::TermId>> blanks(has_blanks ? all.term_count() : 0);
    const auto copied = [&](rdf::TermId id) {
      const rdf::TermView term = all.term(id);
      if (!term.is_blank()) return left.intern(term);
      auto& blank = blanks[static_cast<std::size_t>(id)];
      if (!blank) blank = left.fresh_blank();
      return *blank;
    };
    for (const rdf::Triple& t : all.triples()) {
      if (removed.contains(all.term(t.subject), all.term(t.predicate), all.term(t.object))) continue;
      const rdf::TermId s = copied(t.subject), p = copied(t.predicate), o = copied(t.object);
      left.add(s, p, o);
    }
    return left;
  }

  const BodyTask task_;
  const std::vector<rdf::DataUpdate> updates_;
};

/// Only PropertySetup::allow_patches() names this.
class Extension final : public PatchExtension {
 public:
  std::variant<std::shared_ptr<const ValuePatch>, BodyFault> read(BodyTask task) const override {
    std::string transcoded;
    std::string_view text = std::exchange(task.text, {});
    if (const std::string charset = std::exchange(task.charset, {}); !charset.empty()) {
      const Result<std::string_view> utf8 = charset::to_utf8(text, charset, transcoded);
      if (!utf8) return BodyFault{400, "body: " + utf8.error().message};
      text = *utf8;
    }
    const auto unreadable = [](const Error& error) {
      const int status = error.code == Errc::limit_exceeded ? 413 : error.code == Errc::unsupported_syntax ? 422 : 400;
      return BodyFault{status, "body: " + error.message};
    };
    if (task.format) {
      if (text.empty()) return BodyFault{400, "body: expected a JSON object with the members to change (RFC 7396), found an empty body"};
      Result<rdf::json::Document> patch = rdf::json::Document::parse(text, {task.limits->max_triples, max_depth_of_patch, false});
      if (!patch) return unreadable(patch.error());
      return std::make_shared<const MergePatch>(std::move(task), *std::move(patch));
    }
    rdf::ReadOptions options;
    options.base = task.here;
    options.max_triples = task.limits->max_triples;
    options.max_bytes = task.limits->max_text_bytes;
    Result<std::vector<rdf::DataUpdate>> updates = rdf::read_data_updates(text, options);
    if (!updates) return unreadable(updates.error());
    return std::make_shared<const UpdatePatch>(std::move(task), *std::move(updates));
  }
};
constexpr Extension extension;

}  // namespace
}  // namespace lrt::engine

namespace lrt::model {
inline namespace v0 {

void PropertySetup::allow_patches() const noexcept { static_cast<PropertySpec&>(*spec_).patches = &engine::extension; }

}  // namespace v0
}  // namespace lrt::model
