// SPDX-License-Identifier: Apache-2.0
#include "src/engine/registration.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/http/message.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/dynamic_type.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"
#include "src/engine/named_blank.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/stop_states.hpp"
#include "src/engine/variants.hpp"
#include "src/rdf/plain.hpp"
#include "src/rdf/type_faults.hpp"
#include "src/rdf/words.hpp"

namespace lrt::engine {

namespace {

/// The blank nodes that belong to a SHACL property path, and those around them. A path with a name would be a predicate (SHACL 2.3.1).
std::vector<bool> blanks_of_paths(const rdf::Graph& graph) {
  std::vector<bool> found(graph.term_count());
  const auto is_blank = [&](rdf::TermId id) { return graph.term(id).is_blank(); };
  const auto path = graph.find(vocab::sh::path);
  for (bool grows = path.has_value(); grows;) {
    grows = false;
    for (const rdf::Triple& t : graph.triples()) {
      if (!is_blank(t.object)) continue;
      const auto subject = static_cast<std::size_t>(t.subject), object = static_cast<std::size_t>(t.object);
      if (t.predicate != *path && !(is_blank(t.subject) && (found[subject] || found[object]))) continue;
      grows = grows || !found[subject] || !found[object];
      found[subject] = found[object] = true;
    }
  }
  return found;
}

/// Reads documents about a resource into one graph, with the placeholder as base. Blank nodes of two documents are two nodes even if both are
/// called b0.
/// @param names_blanks  blank nodes get names, because what is said of the resource stands in several documents
Result<rdf::Graph> read_documents(const std::vector<std::string>& documents, const std::string& path, const std::string& name,
                                  bool names_blanks = false) {
  const std::string base = std::string(placeholder_base) + path;
  rdf::ReadOptions options;
  options.base = base;
  rdf::Graph all;
  std::size_t number = 0;
  for (const std::string& text : documents) {
    Result<rdf::Graph> graph = rdf::read(text, rdf::Syntax::turtle, options);
    if (!graph) {
      Error error = std::move(graph).error();
      error.message = name + ": " + error.message;
      return Unexpected{std::move(error)};
    }
    std::map<rdf::TermId, rdf::TermId> renamed;
    const std::vector<bool> of_paths = names_blanks ? blanks_of_paths(*graph) : std::vector<bool>();
    const auto import = [&](rdf::TermId id) {
      const rdf::TermView term = graph->term(id);
      if (!term.is_blank()) return all.intern(term);
      const auto [known, is_new] = renamed.emplace(id, rdf::TermId());
      if (!is_new) return known->second;
      if (!names_blanks || of_paths[static_cast<std::size_t>(id)]) return known->second = all.fresh_blank();
      std::string iri = named_blank(base, number++);
      while (graph->find(rdf::iri(iri)) || all.find(rdf::iri(iri))) iri = named_blank(base, number++);
      return known->second = all.intern(rdf::iri(iri));
    };
    for (const rdf::Triple& triple : graph->triples()) {
      const rdf::TermId s = import(triple.subject), p = import(triple.predicate), o = import(triple.object);
      all.add(s, p, o);
    }
  }
  return all;
}

/// Each media type may occur once, in the form that clients request; octets need a numeric type.
Result<void> check_formats(model::PropertySpec& property, const std::string& name) {
  if (property.octets && !rdf::octets_of(*property.type))
    return unexpected(Errc::invalid_option, name + ": octets() needs a number or lists of numbers");
  if (property.representations.empty()) return {};
  if (property.representations.size() > 100) return unexpected(Errc::limit_exceeded, name + ": more than 100 representations");
  std::vector<std::string> taken;
  for (const std::string_view type : value_variants().with_page) taken.emplace_back(type.substr(0, type.find(';')));
  if (property.octets) taken.emplace_back(rdf::media_type(rdf::Plain::octets));
  const auto is_taken = [&](const std::string& type) { return std::find(taken.begin(), taken.end(), type) != taken.end(); };
  for (model::RepresentationSpec& r : property.representations) {
    const Result<MediaType> type = MediaType::parse(r.media_type);
    if (!type || type->type == "*" || type->subtype == "*")
      return unexpected(Errc::expected_media_type, name + ": expected a media type, found \"" + r.media_type + "\"");
    r.media_type = type->to_string();
    // text/plain with a parameter is a format of its own, such as that of Prometheus.
    const bool is_own_text = type->essence() == rdf::media_type(rdf::Plain::text) && r.media_type != type->essence();
    if ((is_taken(type->essence()) && !is_own_text) || is_taken(r.media_type))
      return unexpected(Errc::duplicate_path, name + ": the representation " + r.media_type + " is already declared");
    taken.push_back(r.media_type);
    if (!r.element_type.empty() && !iri::is_absolute(r.element_type))
      return unexpected(Errc::expected_iri, name + ": expected an absolute IRI as element type");
  }
  return {};
}

/// A life needs writes that begin it.
Result<void> check_life(const model::PropertySpec& property, const std::string& name) {
  if (!property.life) return {};
  if (!property.write) return unexpected(Errc::invalid_option, name + ": expires() needs on_write(): only a written value has a life");
  const auto life = property.life->life();
  if (life >= std::chrono::milliseconds(1) && life <= std::chrono::hours(1)) return {};
  return unexpected(Errc::invalid_option, name + ": expires(): expected 1 ms to 1 h, found " + std::to_string(life.count()) + " ms");
}

/// The names of a read-only field in values of the type and of the records around it, "pose/x"; empty: there is none.
std::string read_only_field(const rdf::Type& type) {
  if (type.element) return read_only_field(*type.element);
  for (const rdf::FieldType& field : type.fields) {
    if (field.read_only) return field.name;
    if (const std::string inner = read_only_field(*field.type); !inner.empty()) return field.name + "/" + inner;
  }
  return {};
}

/// A value, or the named field of a record; nullptr: there is no such field.
const rdf::Type* part_of(const rdf::Type& whole, const std::string& field) {
  const rdf::Type* type = &whole;
  if (!field.empty()) {
    const auto found = std::find_if(whole.fields.begin(), whole.fields.end(), [&](const rdf::FieldType& f) { return f.name == field; });
    if (found == whole.fields.end()) return nullptr;
    type = found->type;
  }
  while (type->kind == rdf::Type::Kind::optional) type = type->element;
  return type;
}

/// Whether a property can have the value of an input.
bool can_have(const rdf::Type& property, const rdf::Type& input) {
  using Kind = rdf::Type::Kind;
  if (property.kind == Kind::optional) return can_have(*property.element, input);
  if (input.kind == Kind::optional) return can_have(property, *input.element);
  const auto is_text = [](const rdf::Type& type) { return type.kind == Kind::text || type.kind == Kind::enumeration; };
  if (property.element && input.element) return property.kind == input.kind && can_have(*property.element, *input.element);
  if (property.is_number() || is_text(property)) return property.is_number() == input.is_number() && is_text(property) == is_text(input);
  return property.kind == input.kind;
}

/// What an effect says can be true: the property can have what it takes from the input.
Result<void> check_effect(const model::ActionSpec& action, const model::EffectSpec& effect, const std::string& name) {
  if (!effect.from_input) return {};
  const model::InputValue& from = *effect.from_input;
  const auto wrong = [&](const std::string& what) -> Result<void> {
    return unexpected(Errc::invalid_option, name + ": effect(\"" + effect.property + "\", lrt::from_input): " + what);
  };
  if (!action.input) return wrong("expected an action with an input, found none; use effect(property, value) or effect(property)");
  if (!(from.tolerance >= 0) || !(from.period >= 0) || !std::isfinite(from.tolerance) || !std::isfinite(from.period))
    return wrong("expected a tolerance and a period of at least 0");
  const rdf::Type* const input = part_of(*action.input, from.input_field);
  if (!input) return wrong("the input has no field \"" + from.input_field + '"');
  const bool has_numbers = input->is_number() || (input->kind == rdf::Type::Kind::list && input->element->is_number());
  if (!has_numbers && (from.tolerance > 0 || from.period > 0)) return wrong("a tolerance or a period needs numbers");
  if (!effect.spec) return {};
  const rdf::Type* const property = part_of(*effect.spec->type, from.property_field);
  if (!property) return wrong("the property has no field \"" + from.property_field + '"');
  if (can_have(*property, *input)) return {};
  return wrong("the property and the input have different types; name the fields by from_input.field(), or use effect(property)");
}

/// The words of the fields and enumerators of a type, and of the types in it.
Result<void> check_words_of(const rdf::Type& type, const std::string& name) {
  for (std::size_t i = 0; i < type.name_words.size(); ++i)
    if (Result<void> r = rdf::check_words(type.name_words[i], name + ", the name \"" + (i < type.names.size() ? type.names[i] : "") + "\""); !r)
      return r;
  for (const rdf::FieldType& field : type.fields) {
    const std::string its_name = name + ", the field \"" + field.name + "\"";
    if (field.facets.has_words())
      if (Result<void> r = rdf::check_words(field.facets.words(), its_name); !r) return r;
    if (Result<void> r = check_words_of(*field.type, its_name); !r) return r;
  }
  return type.element ? check_words_of(*type.element, name) : Result<void>();
}

/// Each language once.
Result<void> check_languages(const std::vector<Statement>& statements, const std::string& name) {
  for (const auto& [predicate, what] : {std::pair(vocab::dcterms::title, "title"), std::pair(vocab::dcterms::description, "description")})
    if (Result<void> r = rdf::check_texts(model::texts_of(statements, predicate), name, what); !r) return r;
  return {};
}

/// A property, or a field of it, has one value afterwards.
Result<void> check_together(const std::vector<model::EffectSpec>& effects, const std::string& name) {
  for (std::size_t i = 0; i < effects.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const model::EffectSpec &a = effects[i], &b = effects[j];
      if (a.property != b.property || !(a.value || a.from_input) || !(b.value || b.from_input)) continue;
      const std::string of_a = a.from_input ? a.from_input->property_field : "", of_b = b.from_input ? b.from_input->property_field : "";
      if (of_a.empty() || of_b.empty() || of_a == of_b)
        return unexpected(Errc::invalid_option,
                          name + ": two effects give \"" + a.property + "\" a value; name different fields by from_input.field()");
    }
  return {};
}

/// Checks what only an action has.
Result<void> check_action(const model::ActionSpec& action, const std::string& name) {
  if (action.first_error) return unexpected(action.first_error->code, name + ": " + action.first_error->message);
  if (action.stop) {
    if (action.input) return unexpected(Errc::invalid_option, name + ": a stop takes no input, so that one tap invokes it");
    if (action.dispatch != Dispatch::io_thread && action.dispatch != Dispatch::executor)
      return unexpected(Errc::invalid_option, name + ": a stop must not wait for Server::poll: expected Dispatch::io_thread or Dispatch::executor");
    if (action.policy.kind != ActionPolicy::Kind::parallel || action.policy.limit == 0)
      return unexpected(Errc::invalid_option, name + ": a stop is neither queued nor refused: expected ActionPolicy::parallel(n), n at least 1");
  }
  if (action.policy.kind == ActionPolicy::Kind::parallel && action.policy.limit == 0)
    return unexpected(Errc::invalid_option, name + ": ActionPolicy::parallel(0) lets no invocation run: expected at least 1");
  for (const model::EffectSpec& effect : action.effects)
    if (Result<void> checked = check_effect(action, effect, name); !checked) return checked;
  for (const model::EffectSpec& effect : action.effects)
    if (effect.value && effect.spec && effect.spec->type->is_checked)
      if (const std::string fault = rdf::detail::fault_of(*effect.spec->type, *effect.value); !fault.empty())
        return unexpected(Errc::invalid_option, name + ": effect(\"" + effect.property + "\"): " + fault);
  if (Result<void> checked = check_together(action.effects, name); !checked) return checked;
  for (const auto& [field, value] : action.headers) {
    http::Fields fields;
    const bool is_name = !field.empty() && detail::token_end(field, 0) == field.size();
    if (is_name) fields.add(field, value);
    if (!is_name || fields.find(field) != value || utf8::find_invalid(value))
      return unexpected(Errc::expected_http, name + ": expected a header field, found \"" + field + ": " + value + "\"");
  }
  return {};
}

/// Checks everything that the user registers with a Thing, except its Turtle.
Result<void> check(model::ThingSpec& described) {
  model::ThingSpec* const spec = &described;
  const auto check_iris = [&](const std::vector<std::string>& iris, const char* what) -> Result<void> {
    for (const std::string& text : iris)
      if (!iri::is_absolute(text))
        return unexpected(Errc::expected_iri, "thing \"" + spec->path + "\": expected an absolute IRI as " + what + ", found \"" + text + "\"");
    return {};
  };
  const auto check_text = [&](const std::string& text) -> Result<void> {
    if (utf8::find_invalid(text) || text.find('\0') != std::string::npos)
      return unexpected(Errc::expected_rdf, "thing \"" + spec->path + "\": expected UTF-8 without NUL as text");
    return {};
  };
  const auto check_statements = [&](const std::vector<Statement>& statements) -> Result<void> {
    for (const Statement& s : statements) {
      if (Result<void> r = check_iris({s.predicate}, "predicate"); !r) return r;
      const Object& o = s.object;
      if (o.kind() == Object::Kind::iri) {
        if (Result<void> r = check_iris({o.text()}, "object"); !r) return r;
      } else if (o.kind() == Object::Kind::resource) {
        if (Result<std::string> r = model::encode_path_from_root(o.text()); !r) return Unexpected{std::move(r).error()};
      } else {
        if (!o.datatype().empty())
          if (Result<void> r = check_iris({o.datatype()}, "datatype"); !r) return r;
        if (!o.language().empty() && !rdf::lexical::is_well_formed(o.language(), rdf::lexical::Datatype::language))
          return unexpected(Errc::expected_rdf, "thing \"" + spec->path + "\": expected a language tag, found \"" + o.language() + "\"");
        if (Result<void> r = check_text(o.text()); !r) return r;
      }
    }
    return {};
  };
  const auto check_facets = [&](const std::string& path, const rdf::Facets& f, const rdf::Type& type) -> Result<void> {
    const std::string fault = rdf::fault_of(f, type);
    return fault.empty() ? Result<void>() : unexpected(Errc::invalid_option, "\"" + spec->path + "/" + path + "\": " + fault);
  };
  const auto check_input = [&](const std::string& what, const rdf::Type& type) -> Result<void> {
    if (const std::string field = read_only_field(type); !field.empty())
      return unexpected(Errc::invalid_option,
                        what + ": clients cannot send it, because its field \"" + field + "\" is read-only; give the field a setter");
    return {};
  };
  const auto check_type = [&](const std::string& what, const rdf::Type* type) -> Result<void> {
    if (const std::string fault = type ? rdf::fault_of(*type) : std::string(); !fault.empty())
      return unexpected(Errc::invalid_option, what + ": " + fault);
    return {};
  };
  const auto check_resource = [&](const model::ResourceSpec& r) -> Result<void> {
    if (Result<void> e = check_iris(r.classes, "type"); !e) return e;
    if (Result<void> e = check_iris(r.predicates, "predicate"); !e) return e;
    if (Result<void> e = check_statements(r.statements); !e) return e;
    return r.statements.empty() ? Result<void>() : check_languages(r.statements, r.location().substr(1));
  };
  if (Result<void> e = check_text(spec->title); !e) return e;
  if (spec->words)
    if (Result<void> e = rdf::check_words(*spec->words, "thing \"" + spec->path + "\""); !e) return e;
  if (Result<void> e = check_iris(spec->classes, "type"); !e) return e;
  if (Result<void> e = check_statements(spec->statements); !e) return e;
  if (spec->blueprint)
    if (Result<void> e = check_iris({*spec->blueprint}, "blueprint"); !e) return e;
  for (const auto& p : spec->properties) {
    if (Result<void> e = check_resource(*p); !e) return e;
    if (Result<void> e = check_type("property \"" + spec->path + "/" + p->path + "\"", p->type); !e) return e;
    if (Result<void> e = check_facets(p->path, p->facets, *p->type); !e) return e;
    if (Result<void> e = check_words_of(*p->type, "property \"" + spec->path + "/" + p->path + "\""); !e) return e;
    if (p->write)
      if (Result<void> e = check_input("property \"" + spec->path + "/" + p->path + "\"", *p->type); !e) return e;
    if (p->frame)
      if (Result<void> e = check_statements({{std::string(vocab::lrt_::frame.text), *p->frame}}); !e) return e;
    if (p->sample_period && p->sample_period->count() < 0)
      return unexpected(Errc::invalid_option,
                        p->description() + ": sample(): expected a period of at least 0, found " + std::to_string(p->sample_period->count()) + " ms");
    if (Result<void> e = check_life(*p, "property \"" + spec->path + "/" + p->path + "\""); !e) return e;
    if (Result<void> e = check_formats(*p, "property \"" + spec->path + "/" + p->path + "\""); !e) return e;
  }
  for (const auto& a : spec->actions) {
    if (Result<void> e = check_resource(*a); !e) return e;
    for (const rdf::Type* type : {a->input, a->output})
      if (Result<void> e = check_type("action \"" + spec->path + "/actions/" + a->path + "\"", type); !e) return e;
    if (Result<void> e = check_action(*a, "action \"" + spec->path + "/actions/" + a->path + "\""); !e) return e;
    if (a->input)
      if (Result<void> e = check_input("the input of action \"" + spec->path + "/actions/" + a->path + "\"", *a->input); !e) return e;
    for (const auto& [facets, type, what] : {std::tuple(&a->facets, a->input, "input"), std::tuple(&a->output_facets, a->output, "output")}) {
      if (!type && !facets->empty())
        return unexpected(Errc::invalid_option, "action \"" + spec->path + "/actions/" + a->path + "\": there is no " + what +
                                                    " to which the unit, bounds or length could apply");
      if (type)
        if (Result<void> e = check_facets("actions/" + a->path, *facets, *type); !e) return e;
      if (type)
        if (Result<void> e = check_words_of(*type, std::string("the ") + what + " of action \"" + spec->path + "/actions/" + a->path + "\""); !e)
          return e;
    }
  }
  for (const auto& c : spec->collections) {
    if (Result<void> e = check_resource(*c); !e) return e;
    if (Result<void> e = check_type("collection \"" + spec->path + "/" + c->path + "\"", c->type); !e) return e;
    if (Result<void> e = check_facets(c->path, c->facets, *c->type); !e) return e;
    if (Result<void> e = check_words_of(*c->type, "collection \"" + spec->path + "/" + c->path + "\""); !e) return e;
    if (c->create)
      if (Result<void> e = check_input("collection \"" + spec->path + "/" + c->path + "\"", *c->type); !e) return e;
  }

  return {};
}

}  // namespace

Result<void> check_without_executor(const model::ThingSpec& spec) {
  std::string needs = spec.dispatch == Dispatch::executor ? "thing \"" + spec.path + '"' : std::string();
  const auto look = [&](const auto& resources) {
    for (const auto& r : resources)
      if (needs.empty() && r->dispatch == Dispatch::executor) needs = r->description();
  };
  look(spec.properties);
  look(spec.actions);
  look(spec.collections);
  return needs.empty() ? Result<void>() : unexpected(Errc::invalid_option, needs + ": Dispatch::executor needs Threads::executor");
}

Result<rdf::Graph> read_shapes(const model::ThingSpec& spec, const std::string& blueprint_path) {
  return read_shapes(spec, spec.shapes, blueprint_path);
}

Result<rdf::Graph> read_shapes(const model::ThingSpec& spec, const std::vector<std::string>& texts, const std::string& blueprint_path) {
  return read_documents(texts, blueprint_path, "thing \"" + spec.path + "\", its shapes");
}

Result<rdf::Graph> read_effects(const model::ActionSpec& action, const std::string& path) {
  const std::string name = "action \"" + path.substr(1) + "\", its effect";
  Result<rdf::Graph> read = read_documents(action.effect_turtle, path, name);
  if (!read || action.effect_turtle.empty()) return read;
  const auto effect = read->find(rdf::iri(std::string(placeholder_base) + path + "#effect"));
  if (!effect || read->match(*effect, std::nullopt, std::nullopt).empty())
    return unexpected(Errc::expected_rdf, name + ": it does not describe <#effect>");
  return read;
}

Result<std::unique_ptr<ThingNode>> build_thing(std::unique_ptr<model::ThingSpec>& spec) {
  if (!spec) return Unexpected{model::moved_from()};
  if (spec->handles && spec->handles->first_error) return Unexpected{*spec->handles->first_error};
  if (Result<void> checked = check(*spec); !checked) return Unexpected{std::move(checked).error()};
  for (const auto& a : spec->actions)
    if (a->stop_state)
      if (Result<void> made = StopExtension::of(*a->stop_state).complete(*spec); !made) return Unexpected{std::move(made).error()};
  if (spec->guards) spec->guards->apply(*spec);
  const std::string path = "/" + spec->path;
  Result<rdf::Graph> statements = read_documents(spec->turtle, path, "thing \"" + spec->path + "\", its Turtle", true);
  if (!statements) return Unexpected{std::move(statements).error()};
  Result<rdf::Graph> shapes = read_shapes(*spec, path + "/blueprint");
  if (!shapes) return Unexpected{std::move(shapes).error()};
  std::vector<rdf::Graph> effects;
  for (const auto& a : spec->actions) {
    Result<rdf::Graph> read = read_effects(*a, path + "/actions/" + a->path);
    if (!read) return Unexpected{std::move(read).error()};
    effects.push_back(*std::move(read));
  }
  auto node = std::make_unique<ThingNode>(std::move(spec));
  for (std::size_t i = 0; i < effects.size(); ++i) node->actions[i]->effects = std::move(effects[i]);
  if (!statements->empty() || !shapes->empty()) node->texts = std::make_unique<ThingTexts>(ThingTexts{*std::move(statements), *std::move(shapes)});
  return node;
}

}  // namespace lrt::engine
