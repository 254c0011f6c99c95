// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/redland/redland.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "src/base/third_party_call.hpp"
#include "src/base/thread.hpp"
#include "src/base/turns.hpp"
#include "src/rdf/limits.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/redland/raptor.hpp"

namespace lrt::rdf::redland {
namespace {

// Raptor is Redland's library of parsers and serialisers. librdf above it is left out: its world adds 3.3 MiB instead of 0.9
// (Debian 12, librdf 1.0.17).

/// Stands for a missing base, which Raptor requires. No term of a result may begin with it.
constexpr std::string_view no_base = "lrt-no-base://none/";

/// @pre a Lease has been had, so it is loaded
const Raptor& raptor() noexcept { return *load_raptor(); }

const unsigned char* bytes(const char* text) noexcept { return reinterpret_cast<const unsigned char*>(text); }
const unsigned char* bytes(std::string_view text) noexcept { return bytes(text.data()); }
std::string_view view(const unsigned char* text, std::size_t length) noexcept {
  return text == nullptr ? std::string_view() : std::string_view(reinterpret_cast<const char*>(text), length);
}
std::string_view view(raptor_uri* uri) noexcept {
  std::size_t length = 0;
  const unsigned char* text = raptor().uri_as_counted_string(uri, &length);
  return view(text, length);
}

template <auto free_function>
struct Free {
  template <class T>
  void operator()(T* object) const noexcept {
    (raptor().*free_function)(object);
  }
};
using Uri = std::unique_ptr<raptor_uri, Free<&Raptor::free_uri>>;
using Parser = std::unique_ptr<raptor_parser, Free<&Raptor::free_parser>>;
using Serializer = std::unique_ptr<raptor_serializer, Free<&Raptor::free_serializer>>;
using Stream = std::unique_ptr<raptor_iostream, Free<&Raptor::free_iostream>>;
using OwnedTerm = std::unique_ptr<raptor_term, Free<&Raptor::free_term>>;

/// A Raptor world, used by one call at a time: its URIs, its error messages, its names for blank nodes. Never destroyed: when
/// threads freed theirs, a parser of libxml2 on another thread hung in a lock that all share.
class World {
 public:
  World() {
    world_ = raptor().new_world_internal(RAPTOR_VERSION);
    if (world_ == nullptr) throw std::bad_alloc();
    raptor().world_set_log_handler(world_, this, &World::on_log);
    raptor().world_set_generate_bnodeid_handler(world_, this, &World::on_blank);
    raptor().world_set_flag(world_, RAPTOR_WORLD_FLAG_WWW_SKIP_INIT_FINISH, 1);  // curl is the host's, not ours
    if (raptor().world_open(world_) != 0) {
      raptor().free_world(world_);
      throw std::bad_alloc();
    }
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  raptor_world* get() const noexcept { return world_; }

  /// Clears the last document's messages and names.
  void begin(raptor_parser* parser) noexcept {
    parser_ = parser;
    failed_ = false;
    message_.clear();
    line_ = column_ = 0;
    generated_ = 0;
  }
  void end() noexcept { parser_ = nullptr; }
  bool failed() const noexcept { return failed_; }
  Unexpected error() const {
    Error error{Errc::expected_rdf, {}};
    if (line_ > 0) {
      error.line = static_cast<std::uint32_t>(line_);
      error.message = "line " + std::to_string(line_);
      if (column_ > 0) {
        error.column = static_cast<std::uint32_t>(column_);
        error.message += ", column " + std::to_string(column_);
      }
      error.message += ": ";
    }
    error.message += message_.empty() ? "not understood" : message_;
    return unexpected(std::move(error));
  }

 private:
  /// Keeps the first error of a document. Warnings are ignored.
  static void on_log(void* self, raptor_log_message* message) noexcept {
    auto& world = *static_cast<World*>(self);
    if (message->level < RAPTOR_LOG_LEVEL_ERROR || world.failed_) return;
    world.failed_ = true;
    const raptor_locator* place = message->locator;
    if (place == nullptr && world.parser_ != nullptr) place = raptor().parser_get_locator(world.parser_);
    if (place != nullptr) {
      world.line_ = place->line;
      world.column_ = place->column;
    }
    try {
      world.message_ = message->text != nullptr ? message->text : "";
    } catch (...) {}
  }

  /// Keeps the document's names and ours apart: Raptor calls its own "genid1" even if the document has a `_:genid1`.
  static unsigned char* on_blank(void* self, unsigned char* name) noexcept {
    auto& world = *static_cast<World*>(self);
    const std::size_t length = name != nullptr ? std::strlen(reinterpret_cast<const char*>(name)) : 24;
    auto* label = static_cast<unsigned char*>(raptor().alloc_memory(length + 2));
    if (label != nullptr) {
      auto* text = reinterpret_cast<char*>(label);
      if (name != nullptr) {
        text[0] = 'd';
        std::memcpy(text + 1, name, length + 1);
      } else {
        std::snprintf(text, length + 2, "g%u", world.generated_++);
      }
    }
    if (name != nullptr) raptor().free_memory(name);
    return label;
  }

  raptor_world* world_ = nullptr;
  raptor_parser* parser_ = nullptr;  // of the document being read
  std::string message_;
  int line_ = 0, column_ = 0;
  unsigned generated_ = 0;
  bool failed_ = false;
};

/// A world for the duration of one call, from a pool that grows to as many as calls have run at once. Work that takes turns leaves one world to the thread
/// in poll(), which thus does not wait until one is made. While it has a world, it does not rest: exit() waits for the call.
class Lease {
 public:
  Lease() {
    if (!call_) return;
    const std::size_t left = Turns::current() ? 1 : 0;
    Pool& pool = shared();
    {
      const std::lock_guard<std::mutex> lock(pool.mutex);
      if (pool.idle.size() > left) {
        world_ = pool.idle.back();
        pool.idle.pop_back();
      } else {
        pool.idle.reserve(++pool.made);  // so that giving back cannot fail
      }
    }
    if (!world_) {
      const std::lock_guard<std::mutex> lock(pool.making);
      world_ = make();
    }
    held_.emplace();
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;
  ~Lease() {
    if (!world_) return;
    Pool& pool = shared();
    const std::lock_guard<std::mutex> lock(pool.mutex);
    pool.idle.push_back(world_);
  }
  World* operator->() const noexcept { return world_; }
  /// False: refusal() says why.
  explicit operator bool() const noexcept { return world_ != nullptr; }
  Unexpected refusal() const {
    if (call_) return unexpected(Errc::unsupported_syntax, "RDF/XML: libraptor2 cannot be loaded");
    return unexpected(Errc::closed, "the process is exiting");  // libxml2 may have freed what its parsers need
  }

 private:
  struct Pool {
    std::mutex making;  // one world at a time
    std::mutex mutex;   // guards the rest
    std::vector<World*> idle;
    std::size_t made = 0;
  };
  static Pool& shared() {
    static Pool* const pool = new Pool;  // outlives every thread
    return *pool;
  }

  /// nullptr: Raptor cannot be loaded. On a thread of its own: opening a world replaces the calling thread's error handlers of libxml2, which are the host's.
  static World* make() {
    World* world = nullptr;
    std::exception_ptr exception;
    start_thread("lrt-raptor", {},
                 [&] {
                   try {
                     if (load_raptor()) world = new World;
                   } catch (...) { exception = std::current_exception(); }
                 })
        .value()
        .join();
    if (exception) std::rethrow_exception(exception);
    if (!world) return nullptr;
    [[maybe_unused]] static const bool closes = ThirdPartyCall::close_at_exit();
    return world;
  }

  const ThirdPartyCall call_;
  World* world_ = nullptr;
  std::optional<Turns::Held> held_;
};

/// Adds statements to a graph.
struct Sink {
  Sink(const ReadOptions& limits, raptor_parser* p) : options(limits), parser(p) {}

  Graph graph;
  Graph blanks;  // numbers the labels in order of appearance
  const ReadOptions& options;
  raptor_parser* parser;
  std::size_t statements = 0, bytes = 0;
  std::string exceeded;  // the limit, if one was
  bool refused = false;  // a literal of rdf:langString without a language
  int line = 0;          // where
  std::exception_ptr exception;

  TermView blank_of(const raptor_term_blank_value& value, char (&name)[16]) {
    const TermId id = blanks.intern(blank(view(value.string, value.string_len)));
    std::snprintf(name, sizeof name, "b%u", static_cast<unsigned>(id));
    return blank(name);
  }

  TermView term(const raptor_term* from, char (&name)[16]) {
    switch (from->type) {
      case RAPTOR_TERM_TYPE_URI: return iri(view(from->value.uri));
      case RAPTOR_TERM_TYPE_BLANK: return blank_of(from->value.blank, name);
      default: break;
    }
    const raptor_term_literal_value& literal_value = from->value.literal;
    const std::string_view text = view(literal_value.string, literal_value.string_len);
    if (literal_value.language != nullptr && literal_value.language_len != 0) {
      return tagged_literal(text, view(literal_value.language, literal_value.language_len));
    }
    return literal_value.datatype != nullptr ? literal(text, Iri(view(literal_value.datatype))) : literal(text);
  }

  /// Counts the bytes of a statement before any part of it is stored.
  bool within_limits(const raptor_statement& statement) {
    std::size_t longest = 0;
    const auto count = [&](const raptor_term* term) {
      const bool literal = term->type == RAPTOR_TERM_TYPE_LITERAL;
      raptor_uri* uri = literal ? term->value.literal.datatype : nullptr;
      if (term->type == RAPTOR_TERM_TYPE_URI) uri = term->value.uri;
      const std::size_t length = uri != nullptr ? view(uri).size() : 0;
      longest = std::max(longest, length);
      bytes += length + (literal ? term->value.literal.string_len : 0);
    };
    count(statement.subject);
    count(statement.predicate);
    count(statement.object);
    if (++statements > options.max_triples) {
      exceeded = "more than " + std::to_string(options.max_triples) + " triples";
    } else if (longest > max_iri) {
      exceeded = "IRI of more than " + std::to_string(max_iri) + " bytes";
    } else if (bytes > options.max_bytes) {
      exceeded = "IRIs and literals of more than " + std::to_string(options.max_bytes) + " bytes when written out";
    }
    if (exceeded.empty()) return true;
    locate();
    return false;
  }

  void locate() {
    if (raptor_locator* const place = raptor().parser_get_locator(parser)) line = raptor().locator_line(place);
  }

  static bool is_possible(const raptor_term& object) noexcept {
    if (object.type != RAPTOR_TERM_TYPE_LITERAL) return true;
    const raptor_term_literal_value& value = object.value.literal;
    return value.datatype == nullptr || value.language_len != 0 || view(value.datatype) != vocab::rdf_::langString.text;
  }

  static void on_statement(void* self, raptor_statement* statement) noexcept {
    auto& sink = *static_cast<Sink*>(self);
    if (!sink.exceeded.empty() || sink.refused || sink.exception) return;
    try {
      if (!sink.within_limits(*statement)) return raptor().parser_parse_abort(sink.parser);
      if (!is_possible(*statement->object)) {
        sink.refused = true;
        sink.locate();
        return raptor().parser_parse_abort(sink.parser);
      }
      char subject[16], object[16];
      sink.graph.add(sink.term(statement->subject, subject), iri(view(statement->predicate->value.uri)), sink.term(statement->object, object));
    } catch (...) {
      sink.exception = std::current_exception();
      raptor().parser_parse_abort(sink.parser);
    }
  }
};

Uri make_uri(raptor_world* world, std::string_view text) {
  Uri uri(raptor().new_uri_from_counted_string(world, bytes(text), text.size()));
  if (!uri) throw std::bad_alloc();
  return uri;
}

/// Raptor copies one byte more than the length it is given of a language tag: every text here ends in a zero.
OwnedTerm make_term(raptor_world* world, const TermView& term, TermId id) {
  OwnedTerm made;
  const std::string text = term.is_blank() ? "b" + std::to_string(static_cast<std::uint32_t>(id)) : std::string(term.text);
  if (term.is_iri()) {
    made.reset(raptor().new_term_from_counted_uri_string(world, bytes(text), text.size()));
  } else if (term.is_blank()) {
    made.reset(raptor().new_term_from_counted_blank(world, bytes(text), text.size()));
  } else if (!term.language.empty()) {
    const std::string language(term.language);
    made.reset(raptor().new_term_from_counted_literal(world, bytes(text), text.size(), nullptr, bytes(language),
                                                      static_cast<unsigned char>(language.size())));
  } else {
    const Uri datatype = term.datatype == vocab::xsd::string.text ? Uri() : make_uri(world, term.datatype);
    made.reset(raptor().new_term_from_counted_literal(world, bytes(text), text.size(), datatype.get(), nullptr, 0));
  }
  if (!made) throw std::bad_alloc();
  return made;
}

}  // namespace

Result<Graph> parse_rdf_xml(std::string_view text, const ReadOptions& options) {
  const Lease world;
  if (!world) return world.refusal();
  world->begin(nullptr);
  const Uri base = make_uri(world->get(), options.base.empty() ? no_base : options.base);
  const Parser parser(raptor().new_parser(world->get(), "rdfxml"));
  if (!parser) throw std::bad_alloc();
  world->begin(parser.get());
  Sink sink(options, parser.get());
  raptor().parser_set_statement_handler(parser.get(), &sink, &Sink::on_statement);
  raptor().parser_set_option(parser.get(), RAPTOR_OPTION_NO_NET, nullptr, 1);
  raptor().parser_set_option(parser.get(), RAPTOR_OPTION_NO_FILE, nullptr, 1);
  raptor().parser_set_option(parser.get(), RAPTOR_OPTION_LOAD_EXTERNAL_ENTITIES, nullptr, 0);

  int status = raptor().parser_parse_start(parser.get(), base.get());
  if (status == 0) status = raptor().parser_parse_chunk(parser.get(), bytes(text), text.size(), 1);
  world->end();
  if (sink.exception) std::rethrow_exception(sink.exception);
  if (!sink.exceeded.empty() || sink.refused) {
    Error error{Errc::limit_exceeded, std::move(sink.exceeded)};
    if (sink.refused) error = {Errc::expected_rdf, std::string(no_language)};
    if (sink.line > 0) {
      error.line = static_cast<std::uint32_t>(sink.line);
      error.message = "line " + std::to_string(sink.line) + ": " + error.message;
    }
    return unexpected(std::move(error));
  }
  if (status != 0 || world->failed()) return world->error();
  if (options.base.empty()) {
    for (std::size_t i = 0; i < sink.graph.term_count(); ++i) {
      const TermView term = sink.graph.term(TermId{static_cast<std::uint32_t>(i)});
      if (term.is_iri() && term.text.substr(0, no_base.size()) == no_base) {
        return unexpected(Errc::expected_rdf, "relative IRI <" + std::string(term.text.substr(no_base.size())) + "> and no base");
      }
    }
  }
  return std::move(sink.graph);
}

Result<std::string> serialize_rdf_xml(const Graph& graph, const Prefixes& prefixes, bool nested) {
  const Lease world;
  if (!world) return world.refusal();
  world->begin(nullptr);
  raptor_world* const w = world->get();
  const Serializer serializer(raptor().new_serializer(w, nested ? "rdfxml-abbrev" : "rdfxml"));
  if (!serializer) throw std::bad_alloc();
  raptor().serializer_set_option(serializer.get(), RAPTOR_OPTION_RELATIVE_URIS, nullptr, 0);
  raptor().serializer_set_option(serializer.get(), RAPTOR_OPTION_WRITE_BASE_URI, nullptr, 0);
  for (const auto& [name, iri] : prefixes) { raptor().serializer_set_namespace(serializer.get(), make_uri(w, iri).get(), bytes(name.c_str())); }
  struct Text {
    void* bytes = nullptr;
    std::size_t length = 0;
    ~Text() { raptor().free_memory(bytes); }
  } out;  // filled when the stream is freed
  Stream stream(raptor().new_iostream_to_string(w, &out.bytes, &out.length, nullptr));
  if (!stream) throw std::bad_alloc();
  int status = raptor().serializer_start_to_iostream(serializer.get(), nullptr, stream.get());
  std::vector<OwnedTerm> terms(graph.term_count());
  const auto term = [&](TermId id) {
    OwnedTerm& made = terms[static_cast<std::uint32_t>(id)];
    if (!made) made = make_term(w, graph.term(id), id);
    return made.get();
  };
  for (const Triple& t : graph.triples()) {
    if (status != 0) break;
    raptor_statement statement;
    raptor().statement_init(&statement, w);
    statement.subject = term(t.subject);
    statement.predicate = term(t.predicate);
    statement.object = term(t.object);
    status = raptor().serializer_serialize_statement(serializer.get(), &statement);
  }
  if (status == 0) status = raptor().serializer_serialize_end(serializer.get());
  stream.reset();
  if (status != 0 || world->failed() || out.bytes == nullptr) {
    return unexpected(Errc::unsupported_syntax, "RDF/XML: " + world->error().error.message);
  }
  return std::string(static_cast<const char*>(out.bytes), out.length);
}

void prepare() noexcept {
  try {
    const Lease world;
  } catch (...) {  // the first document reports it
  }
}

}  // namespace lrt::rdf::redland
