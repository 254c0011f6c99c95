// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/property.hpp"

#include <algorithm>

#include <lrt/rdf/value_codec.hpp>

#include "src/engine/change_scanner.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/stop_state.hpp"
#include "src/engine/value_patch.hpp"
#include "src/rdf/named_cells.hpp"
#include "src/rdf/value_faults.hpp"

namespace lrt::engine {

PropertyResource::PropertyResource(const std::string& its_path, ThingNode* its_thing, std::shared_ptr<model::PropertySpec> s)
    : ValueResource(its_path, its_thing, s->is_generated ? its_path.size() : 0),
      spec(std::move(s)),
      promises_value((spec->is_generated || spec->read || (spec->slot && spec->slot->has_change())) && !spec->octets && !spec->file) {
  if (spec->octets || !spec->representations.empty()) own_variants_ = std::make_unique<const Variants>(variants_of(*spec));
}

namespace {

bool has_named_parts(const rdf::Type& type) noexcept {
  if (type.kind == rdf::Type::Kind::optional) return has_named_parts(*type.element);
  return type.kind == rdf::Type::Kind::map || !type.fields.empty();
}

}  // namespace

Methods PropertyResource::methods() const noexcept {
  Methods methods;
  methods.put = static_cast<bool>(spec->write);
  methods.patch = methods.put && spec->patches && has_named_parts(*spec->type);
  return methods;
}

void PropertyResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const { visit(const_cast<PropertyResource&>(*this)); }

// ------------------------------------------------------------------------------------------------------- description

void PropertyResource::describe(const Description& d) const { describe(d, {}); }

void PropertyResource::describe_in_state(const Description& d, std::size_t& left) const {
  if (is_failing()) return describe(d, failure());
  const std::size_t before = left;
  if (only_octets || fits(value, left)) return describe(d, {});
  left = before;
  describe(d, "its value is not in the RDF of this document, which has at most " + std::to_string(d.engine.options.max_value_members) +
                  " values; application/json has it");
}

/// @param failure  why it has no value; empty: it has one
void PropertyResource::describe(const Description& d, std::string_view failure) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.link(vocab::rdfs::seeAlso, d.base + thing->self.path);
  if (!failure.empty()) about.add(vocab::lrt_::error, rdf::literal(failure));
  else if (!value.is_null() && !only_octets)
    d.quote(*this, [&] { rdf::write_value(d.graph, about.subject(), *spec->type, spec->facets, value, d.engine.vocabulary(d.base)); });
  describe_quantity(about, *spec->type, spec->facets);
  if (failure.empty()) about.when(vocab::dcterms::modified, modified);
  if (spec->frame) about.add(frame_predicate(*spec->type), object_term(d.graph, *spec->frame, d.base));
  if (spec->life) about.add(vocab::lrt_::expiresAfter, rdf::literal(seconds(spec->life->life()), vocab::xsd::double_));
  about.statements(spec->statements, d.base);
  if (failure.empty()) describe_formats(about, d);
  if (const StopState* const state = spec->is_generated ? thing->stop_state : nullptr; state && state->release)
    about.link(vocab::lrt_::release, d.base + state->release->path);
}

void PropertyResource::describe_controls(About& about, const Description& d) const {
  Resource::describe_controls(about, d);
  if (!methods().put) return;
  if (const std::string reason = reason_of_stop(*thing, *spec); !reason.empty()) about.add(vocab::lrt_::unavailable, rdf::literal(reason));
  if (d.audience.methods(*this).put)
    describe_binding(about, d, *this, vocab::http_methods::PUT, {rdf::target_class(*spec->type, d.engine.vocabulary(d.base))});
}

void PropertyResource::describe_types(About& about, const Description& d) const {
  about.a(vocab::hybrit::Property);
  describe_value_types(about, *spec->type, d.engine.vocabulary(d.base));
  about.a(spec->classes);
}

void PropertyResource::summarize(Overview& o) const {
  o.described(spec->statements, spec->classes, spec->type);
  o.schema("schema", spec->type, spec->facets);
  if (spec->frame)
    if (const std::string frame = o.iri(*spec->frame); o.sees_iri(frame)) o.text("frame", frame);
  if (methods().put) o.text("unavailable", reason_of_stop(*thing, *spec));
  if (spec->life) o.json("expiresAfter", seconds(spec->life->life()));
  std::vector<std::string> formats;
  for (const model::RepresentationSpec& r : spec->representations) formats.push_back(r.media_type);
  if (spec->octets) formats.emplace_back(rdf::media_type(rdf::Plain::octets));
  o.texts("formats", formats);
}

/// Describes the formats of the present value: media type, size, and the layout of numbers. This links binary and semantic data (the paper's
/// D5).
void PropertyResource::describe_formats(About& about, const Description& d) const {
  rdf::Graph& graph = d.graph;
  const auto add = [&](const std::string& type, std::size_t bytes, const Layout& layout, Iri element_type) {
    const std::string iri = variant_iri(d.base + path, type);
    about.link(vocab::dcterms::hasFormat, iri);
    About format(graph, iri);
    const auto count = [&](std::size_t n) { return graph.intern(rdf::literal(std::to_string(n), vocab::xsd::nonNegativeInteger)); };
    format.a(vocab::dcat::Distribution).add(vocab::dcterms::format, rdf::literal(type));
    format.link(vocab::dcat::mediaType, "https://www.iana.org/assignments/media-types/" + escaped(type.substr(0, type.find(';'))));
    format.add(vocab::dcat::byteSize, count(bytes));
    if (element_type.empty()) return;
    std::vector<rdf::TermId> shape;
    for (const std::size_t n : layout.shape) shape.push_back(count(n));
    format.add(vocab::lrt_::elementType, rdf::TermView(element_type))
        .add(vocab::lrt_::shape, graph.add_list(shape, rdf::named_cells(graph, iri + "#shape", shape.size())));
    format.add(vocab::lrt_::byteOrder,
               rdf::TermView(layout.byte_order == Layout::ByteOrder::little_endian ? vocab::lrt_::littleEndian : vocab::lrt_::bigEndian));
    describe_unit(format, layout.unit.empty() ? spec->facets.unit() : layout.unit);
    if (spec->frame) format.add(frame_predicate(*spec->type), object_term(graph, *spec->frame, d.base));
  };
  for (std::size_t i = 0; i < spec->representations.size() && i < encodings.size(); ++i) {
    const model::RepresentationSpec& representation = spec->representations[i];
    const Result<Bytes>& bytes = encodings[i].bytes;
    if (encodings[i].made && bytes)
      add(representation.media_type, (*bytes)->size(), representation.layout, Iri(std::string_view(representation.element_type)));
  }
  if (!spec->octets) return;
  if (const auto octets = rdf::octets_of(*spec->type, value)) {
    const Layout layout{octets->datatype, octets->shape, Layout::ByteOrder::little_endian, {}};
    add(std::string(rdf::media_type(rdf::Plain::octets)), octets->size(), layout, layout.element_type);
  }
}

// ------------------------------------------------------------------------------------------------- observers

void PropertyResource::set_watched(bool watched, ChangeScanner& scanner) {
  if (watched ? ++watchers == 1 : --watchers == 0) watched ? scanner.watch(*this) : scanner.unwatch(*this);
}

void PropertyResource::mark_value_changed() {
  mark_changed();
  const auto seen = [this](const Audience& audience) { return audience.sees(*this); };
  if (in_graph) in_graph->graph.mark_changed(seen);
  else if (!spec->file) thing->state.notify_observers(seen);
}

ValueResource& PropertyResource::whole_resource() const { return in_graph ? in_graph->graph : thing->state; }

void PropertyResource::mark_changing() {
  const auto seen = [this](const Audience& audience) { return audience.sees(*this); };
  for (std::size_t i = 0; i < observers.size(); ++i) observers[i]->resource_changes(seen_by_all);
  const ThinVector<Observer*>& of_whole = whole_resource().observers;
  for (std::size_t i = 0; i < of_whole.size(); ++i) of_whole[i]->resource_changes(seen);
}

void PropertyResource::mark_readability_changed() {
  record_change();
  for (std::size_t i = 0; i < observers.size(); ++i) observers[i]->readability_changed();
  if (in_graph || spec->file) return;
  ++thing->state.number;
  thing->state.notify_observers([this](const Audience& audience) { return audience.sees(*this); });
}

void PropertyResource::expire(Utc now) {
  if (!in_graph || in_graph->expires_after.count() == 0 || value.is_null() || now - modified < in_graph->expires_after) return;
  count(0);
  value = rdf::Value();
  mark_value_changed();
}

void PropertyResource::add_changes(std::uint64_t changes) noexcept {
  number_ += changes;
  if (!in_graph && !spec->file) thing->state.number += changes;
}

void PropertyResource::count(std::uint64_t taken) noexcept {
  if (taken == 0) return add_changes(1);
  add_changes(taken - taken_);
  taken_ = taken;
}

void PropertyResource::count_unchanged(std::uint64_t taken) noexcept {
  add_changes(taken - taken_ - 1);
  taken_ = taken;
}

void PropertyResource::report_lost() {
  const std::uint64_t lost = spec->slot->lost();
  if (lost == seen_lost) return;
  const auto seen = [this](const Audience& audience) { return audience.sees(*this); };
  for (Observer* observer : observers) observer->values_missed(lost - seen_lost, seen_by_all);
  for (Observer* observer : whole_resource().observers) observer->values_missed(lost - seen_lost, seen);
  seen_lost = lost;
}

// ---------------------------------------------------------------------------------------------------------- writing

Outcome PropertyResource::put(Context& context, Parts& parts) {
  auto read = parts.bodies.read_value(context, *spec->type, spec->facets, spec);
  if (auto outcome = outcome_of(read)) return *std::move(outcome);
  return enqueue(context, parts, {{}, std::make_shared<const rdf::Value>(std::move(std::get<Body>(read).value)), nullptr});
}

Outcome PropertyResource::patch(Context& context, Parts& parts) {
  if (!context.audience.sees(*this))
    return parts.responses.problem(
        context, 405, "PATCH is not allowed for clients that may not read this resource, because a refusal would show its value; PUT it");
  auto read = parts.bodies.read_patch(context, *spec, spec);
  if (auto outcome = outcome_of(read)) return *std::move(outcome);
  return enqueue(context, parts, {{}, nullptr, std::move(std::get<Body>(read).patch)});
}

Outcome PropertyResource::enqueue(Context& context, Parts& parts, Write write) {
  const auto ticket = parts.defer_command(context, thing->where(*spec));
  if (!ticket) return parts.responses.overloaded(context);
  if (!writes_) writes_ = std::make_unique<Writes>();
  std::vector<Write>& queue = writes_->queue;
  if (queue.size() > 64) {  // most of their clients already got 503; the first may be running
    const auto is_over = [&](const Write& w) { return !parts.pending.is_pending(w.ticket); };
    queue.erase(std::remove_if(queue.begin() + 1, queue.end(), is_over), queue.end());
  }
  write.ticket = *ticket;
  queue.push_back(std::move(write));
  if (!writes_->writing) begin_next_write(parts, context.now);
  return Deferred{*ticket};
}

/// Starts the first write that has a client. Its preconditions are evaluated now, so that the second of two writers with the same If-Match
/// sees the value of the first.
void PropertyResource::begin_next_write(Parts& parts, TimePoint now) {
  writes_->writing = false;
  std::vector<Write>& queue = writes_->queue;
  while (!queue.empty()) {
    const Ticket ticket = queue.front().ticket;
    const Context* context = parts.pending.resume(ticket, now);
    if (!context) {
      queue.erase(queue.begin());
      continue;
    }
    writes_->writing = true;
    return drops_if_thrown(ticket, [&] {
      const bool conditional = context->request().find("If-Match") || context->request().find("If-None-Match");
      parts.values.take_published(*this);
      const bool is_behind = spec->slot && spec->slot->has_change();
      if (!conditional && !is_behind) return judge_write(ticket, parts, now, true);
      judge_after_refresh({}, parts);
    });
  }
  writes_ = nullptr;
}

/// A write ends after an internal error, so that the next one can start.
template <class Step>
void PropertyResource::drops_if_thrown(Ticket ticket, Step step) {
  try {
    step();
  } catch (...) {
    if (is_first_write(ticket)) drop_write();
    throw;
  }
}

/// Evaluates the preconditions of the first write with the current value, which user code may have to provide.
void PropertyResource::judge_after_refresh(Encodings wanted, Parts& parts) {
  const Ticket ticket = writes_->queue.front().ticket;
  parts.values.refresh(*this, wanted, [this, &parts, ref = Ref(*this), ticket, all = wanted.all](const Result<void>& result, TimePoint now) {
    if (!parts.registry.find(ref) || !is_first_write(ticket)) return;
    const Context* const context = parts.pending.resume(ticket, now);
    // A write without a condition needs no value before it.
    if (result || (context && !context->request().find("If-Match") && !context->request().find("If-None-Match"))) return judge_write(parts, now, all);
    drops_if_thrown(ticket, [&] {
      const int status = result.error().code == Errc::unavailable ? 503 : 500;
      if (context) parts.pending.respond(ticket, parts.responses.problem(*context, status, result.error().message));
    });
    drop_write();
    begin_next_write(parts, now);
  });
}

/// @param encoded  variants that lack an encoding have no entity tag
void PropertyResource::judge_write(Parts& parts, TimePoint now, bool encoded) {
  const Ticket ticket = writes_->queue.front().ticket;
  drops_if_thrown(ticket, [&] { judge_write(ticket, parts, now, encoded); });
}

namespace {

/// The T of a value that was written. The write has succeeded: without one the value just has no encodings.
std::shared_ptr<const void> whole_of(model::PropertySpec& property, const rdf::Value& value) {
  if (!property.whole) return nullptr;
  auto decoded = guarded<std::shared_ptr<const void>>([&]() -> Result<std::shared_ptr<const void>> { return property.whole(value); });
  return decoded ? *std::move(decoded) : nullptr;
}

/// A write that gives the value a life.
Result<void> write_with_life(const std::shared_ptr<model::PropertySpec>& property, const rdf::Value& value, Lapses& lapses, Dispatch where,
                             const Clock& clock) {
  const auto begin = clock.now().steady;
  try {
    Result<void> result = property->write(value);
    if (result) lapses.written(property, where, begin, true);
    return result;
  } catch (...) {
    lapses.written(property, where, begin, false);
    throw;
  }
}

}  // namespace

void PropertyResource::judge_write(Ticket ticket, Parts& parts, TimePoint now, bool encoded) {
  Context* context = parts.pending.resume(ticket, now);
  std::optional<http::Response> failed;
  if (context) {
    bool lacks_encodings = false;
    failed = parts.representations.failed_precondition(*context, &lacks_encodings);
    if (lacks_encodings && !encoded) {
      Encodings all;
      all.all = true;
      return judge_after_refresh(all, parts);
    }
  }
  if (!context || failed) {
    if (failed) parts.pending.respond(ticket, *std::move(failed));
    drop_write();
    return begin_next_write(parts, now);
  }
  context->ignores_conditions = true;
  const Write& write = writes_->queue.front();
  if (!write.patch) return call_write(ticket, *context, parts);
  if (!spec->read) return call_patch(ticket, *context, parts);
  parts.values.take_turn(
      *this, [this, &parts, ticket](TimePoint at) { patch_in_turn(ticket, parts, at); }, now);
}

void PropertyResource::call_write(Ticket ticket, const Context& context, Parts& parts) {
  const SharedCheck check = parts.rules.judge_before_call(context);
  writes_->token = parts.calls.call<Written>(
      thing->where(*spec),
      [s = spec, value = writes_->queue.front().value, check, lapses = spec->life ? parts.lapses : nullptr,
       where = parts.calls.resolved(thing->where(*spec)), &clock = parts.clock] {
        return call_if_passes<Written>(check, [&]() -> Result<Written> {
          if (s->slot) s->slot->forget();
          if (Result<void> result = lapses ? write_with_life(s, *value, *lapses, where, clock) : s->write(*value); !result)
            return Unexpected{std::move(result).error()};
          return Written{whole_of(*s, *value)};
        });
      },
      [this, &parts, ref = Ref(*this), check](Result<Written> written, TimePoint at) {
        if (parts.registry.find(ref)) end_write(std::move(written), refusal_of(check), parts, at);
      });
  parts.pending.waits_for(ticket, writes_->token);
}

/// No refresh runs, because the call reads the value, too.
void PropertyResource::patch_in_turn(Ticket ticket, Parts& parts, TimePoint now) {
  if (!is_first_write(ticket)) return parts.values.end_turn(*this, now);
  try {
    writes_->has_turn = true;
    if (const Context* const context = parts.pending.resume(ticket, now)) return call_patch(ticket, *context, parts);
    drop_write();
    end_turn(parts, now);
  } catch (...) {
    if (is_first_write(ticket)) drop_write();
    end_turn(parts, now);
    throw;
  }
  begin_next_write(parts, now);
}

void PropertyResource::end_turn(Parts& parts, TimePoint now) {
  if (writes_ && std::exchange(writes_->has_turn, false)) parts.values.end_turn(*this, now);
}

/// Reads the value, applies the patch and writes the result in one call of the host, so that nothing the host has changed is lost.
void PropertyResource::call_patch(Ticket ticket, const Context& context, Parts& parts) {
  Write& write = writes_->queue.front();
  const SharedCheck check = parts.rules.judge_before_call(context);
  // A robot that publishes all the time does not stop a patch.
  constexpr unsigned max_attempts = 4;
  const bool is_last = ++write.attempts >= max_attempts;
  writes_->token = parts.calls.call<Written>(
      thing->where(*spec),
      [s = spec, patch = write.patch, known = spec->read ? rdf::Value() : value, is_last, check, lapses = spec->life ? parts.lapses : nullptr,
       where = parts.calls.resolved(thing->where(*spec)), &clock = parts.clock] {
        return call_if_passes<Written>(check, [&]() -> Result<Written> {
          Written written;
          if (!s->read && !is_last && s->slot->has_change()) {
            written.is_behind = true;
            return written;
          }
          const rdf::Value current = s->read ? s->read(false).value : known;
          if (std::string fault = rdf::fault_of_value(*s->type, current); !fault.empty()) return unexpected(Errc::failed, std::move(fault));
          JudgedBody judged = patch->apply(current);
          if (auto* const fault = std::get_if<BodyFault>(&judged)) {
            written.fault = std::make_unique<BodyFault>(std::move(*fault));
            return written;
          }
          written.value = std::make_shared<const rdf::Value>(std::move(std::get<Body>(judged).value));
          if (s->slot) s->slot->forget();
          if (Result<void> result = lapses ? write_with_life(s, *written.value, *lapses, where, clock) : s->write(*written.value); !result)
            return Unexpected{std::move(result).error()};
          written.whole = whole_of(*s, *written.value);
          return written;
        });
      },
      [this, &parts, ref = Ref(*this), check](Result<Written> written, TimePoint at) {
        if (parts.registry.find(ref)) end_write(std::move(written), refusal_of(check), parts, at);
      });
  parts.pending.waits_for(ticket, writes_->token);
}

void PropertyResource::end_write(Result<Written> written, Refusal refusal, Parts& parts, TimePoint now) {
  writes_->token = nullptr;
  if (written && written->is_behind) return begin_next_write(parts, now);
  const Write write = std::move(writes_->queue.front());
  writes_->queue.erase(writes_->queue.begin());
  try {
    respond_to(write, std::move(written), refusal, parts, now);
  } catch (const std::exception& e) {
    // The client gets 202 or 503 at its time limit.
    parts.responses.log(LogLevel::error, "internal error while making a response", e);
  }
  try {
    end_turn(parts, now);
  } catch (const std::exception& e) { parts.responses.log(LogLevel::error, "internal error while making a response", e); }
  begin_next_write(parts, now);
}

void PropertyResource::respond_to(const Write& write, Result<Written> written, Refusal refusal, Parts& parts, TimePoint now) {
  const std::shared_ptr<const rdf::Value> now_value = !written ? nullptr : write.value ? write.value : written->value;
  if (now_value && spec->slot) {
    // A value published since the lambda began has priority, even if it is the old value. Otherwise the written value is shown until the next
    // publish.
    const bool published = spec->slot->has_change();
    parts.values.take_published(*this);
    if (!published && !rdf::same(value, *now_value)) parts.values.set(*this, {*now_value, std::move(written->whole), now.utc, {}});
  }
  const Context* context = parts.pending.resume(write.ticket, now);
  if (context && refusal != Refusal::none) {
    parts.pending.respond(write.ticket, parts.rules.refused(*context, refusal));
  } else if (context && !written) {
    parts.pending.respond(write.ticket, parts.responses.refused(*context, "property \"" + path + "\" was not written", written.error()));
  } else if (context && written->fault) {
    parts.pending.respond(write.ticket, parts.bodies.refused(*context, std::move(*written->fault)));
  } else if (context && context->wants_representation()) {
    parts.representations.respond_when_read(write.ticket, *this, [&parts](Context& c) {
      http::Response response = parts.representations.respond(c);
      response.fields.set("Vary", c.vary());
      response.fields.add("Preference-Applied", "return=representation");
      response.fields.add("Content-Location", parts.responses.iri(c, c.resource->path));
      return response;
    });
  } else if (context) {
    parts.pending.respond(write.ticket, parts.responses.no_content(*context));
  }
}

void PropertyResource::drop_write() {
  writes_->queue.erase(writes_->queue.begin());
  writes_->writing = false;
}

void PropertyResource::removed(Parts& parts) {
  if (spec->life) spec->life->end();
  if (writes_) {
    for (const Write& w : writes_->queue) parts.respond_gone(w.ticket);
    writes_->queue.clear();
    if (writes_->token) writes_->token->cancel();
  }
  parts.values.cancel(*this, parts.clock.now());
}

}  // namespace lrt::engine
