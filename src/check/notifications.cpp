// SPDX-License-Identifier: Apache-2.0
#include "src/check/notifications.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"

namespace lrt::check {
namespace {

using rdf::Graph;
using rdf::TermView;
using std::chrono::milliseconds;

constexpr std::size_t max_messages = 50;   // that are read for one change
constexpr milliseconds poll_interval{50};  // of GETs that look for a change
constexpr double fraction = 1.0 / 1024;    // by which a number is changed

Graph graph_of_bytes(const std::string& bytes, const std::string& type, const std::string& base, bool& is_rdf) {
  std::vector<rdf::Syntax> syntaxes;
  if (const auto syntax = rdf::syntax_of(type)) syntaxes.push_back(*syntax);
  syntaxes.push_back(rdf::Syntax::turtle);
  for (const rdf::Syntax syntax : syntaxes)
    if (Result<Graph> graph = rdf::read(bytes, syntax, {base}); graph && !graph->empty()) {
      is_rdf = true;
      return *std::move(graph);
    }
  is_rdf = false;
  return {};
}

/// The triples as texts, sorted, without the labels of blank nodes, and without literals if only the structure matters.
std::vector<std::string> lines_of(const Graph& graph, bool literals) {
  std::vector<std::string> lines;
  const auto text = [&](rdf::TermId id) {
    const TermView term = graph.term(id);
    if (term.is_literal() && !literals) return std::string("\"\"");
    return term.is_blank() ? std::string("_:") : rdf::to_string(term);
  };
  for (const rdf::Triple& t : graph.triples()) lines.push_back(text(t.subject) + " " + text(t.predicate) + " " + text(t.object));
  std::sort(lines.begin(), lines.end());
  return lines;
}

/// What stays while a value changes.
std::vector<std::string> structure_of(const std::string& bytes, const std::string& type, const std::string& base) {
  bool is_rdf = false;
  const Graph graph = graph_of_bytes(bytes, type, base, is_rdf);
  if (is_rdf) return lines_of(graph, false);
  std::string rest;
  for (const char c : bytes)
    if (std::string_view("0123456789+-.eE \t\r\n").find(c) == std::string_view::npos) rest += c;
  return {rest};
}

std::string text_of(double number, bool whole) {
  char text[64];
  std::snprintf(text, sizeof text, whole ? "%.0f" : "%.17g", number);
  return text;
}

/// Values beside a number, those nearer to zero first.
std::vector<std::string> beside(const std::string& text, bool whole) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  constexpr double largest = 1e15;  // whose neighbours are numbers, too
  if (end == text.c_str() || *end != '\0' || !std::isfinite(number) || std::fabs(number) > largest) return {};
  const double step = whole ? 1 : std::fabs(number) < 1e-6 ? fraction : std::fabs(number) * fraction;
  const double sign = number > 0 ? -1 : 1;
  return {text_of(number + sign * step, whole), text_of(number - sign * step, whole)};
}

bool is_numeric(rdf::lexical::Datatype d) {
  return d == rdf::lexical::Datatype::double_ || d == rdf::lexical::Datatype::float_ || d == rdf::lexical::Datatype::decimal ||
         rdf::lexical::is_integer_type(d);
}

}  // namespace

bool same_content(const std::string& a, const std::string& b, const std::string& type, const std::string& base) {
  if (a == b) return true;
  bool is_a = false, is_b = false;
  const Graph x = graph_of_bytes(a, type, base, is_a), y = graph_of_bytes(b, type, base, is_b);
  // Graph isomorphism takes unbounded time for a hostile graph. The labels of blank nodes are left out instead.
  return is_a && is_b && lines_of(x, true) == lines_of(y, true);
}

// ---------------------------------------------------------------------------------------------------------------------------- Change

std::vector<std::string> Change::other_values(const std::string& body, const std::string& media_type, const std::string& url) {
  const auto syntax = rdf::syntax_of(media_type);
  if (!syntax) {
    std::string text(lrt::detail::trim(body));
    if (media_type != "application/json" && media_type != "text/plain") return {};
    return beside(text, text.find_first_of(".eE") == std::string::npos);
  }
  const Result<Graph> graph = rdf::read(body, *syntax, {url});
  if (!graph) return {};
  const rdf::Triple* best = nullptr;
  int most = 0;
  for (const rdf::Triple& t : graph->triples()) {
    const TermView object = graph->term(t.object), predicate = graph->term(t.predicate);
    if (!object.is_literal() || !is_numeric(rdf::lexical::datatype_of(object.datatype))) continue;
    const int rank = predicate == vocab::vom::numericalValue ? 4 : predicate == vocab::rdf_::value ? 3 : graph->term(t.subject).text == url ? 2 : 1;
    if (rank > most) best = &t, most = rank;
  }
  std::vector<std::string> bodies;
  if (best == nullptr) return bodies;
  const TermView old = graph->term(best->object);
  for (const std::string& value : beside(std::string(old.text), rdf::lexical::is_integer_type(rdf::lexical::datatype_of(old.datatype)))) {
    Graph changed;
    for (const rdf::Triple& t : graph->triples())
      changed.add(graph->term(t.subject), graph->term(t.predicate),
                  t == *best ? TermView(rdf::literal(value, Iri(old.datatype))) : graph->term(t.object));
    if (Result<std::string> text = rdf::write(changed, *syntax)) bodies.push_back(*std::move(text));
  }
  return bodies;
}

Change::Change(Context& context, const std::string& url) : context_(context), url_(url) {
  if (!context.may_write(url)) {
    reason_ = context.options.write.empty() ? "no resource may be written (--write)" : "the resource may not be written (--write)";
    return;
  }
  first_ = context.probe.ask("GET", url, {{"Accept", "text/turtle, */*;q=0.5"}});
  if (!first_.reply.ok()) reason_ = "GET " + url + ": " + outcome_of(first_);
}

Exchange Change::write(Context& context, const std::string& url, const std::string& body, const std::string& media_type, FieldList fields) {
  fields.emplace_back("Content-Type", media_type);
  return context.probe.ask("PUT", url, fields, body);
}

bool Change::write(const std::string& body) {
  const Exchange before = context_.probe.ask("GET", url_);
  FieldList fields = context_.probe.command_fields();
  if (const std::string tag = before.reply.field("ETag"); !tag.empty()) fields.emplace_back("If-Match", tag);
  put_ = write(context_, url_, body, first_.reply.field("Content-Type"), fields);
  if (put_.reply.status == 412) {  // it changes by itself
    fields.pop_back();
    put_ = write(context_, url_, body, first_.reply.field("Content-Type"), fields);
  }
  if (!put_.reply.ok()) {
    reason_ = "PUT " + url_ + " of another number: " + outcome_of(put_);
    return false;
  }
  now_ = context_.probe.ask("GET", url_);
  // A control loop may take the value a moment later.
  for (int i = 0; i < 4 && now_.reply.ok() && now_.reply.body == before.reply.body && !context_.probe.exhausted(); ++i)
    now_ = context_.probe.ask("GET", url_);
  if (now_.reply.ok() && now_.reply.body != before.reply.body) return true;
  reason_ = "PUT " + url_ + " of another number gets " + std::to_string(put_.reply.status) + ", and GET responds what it did before";
  return false;
}

bool Change::make() {
  if (!reason_.empty()) return false;
  const std::vector<std::string> bodies = other_values(first_.reply.body, first_.reply.media_type(), url_);
  if (bodies.empty()) reason_ = url_ + " has no number that could be changed a little";
  for (const std::string& body : bodies) {
    reason_.clear();
    is_changed_ = true;
    if (write(body)) {
      const std::string tag = first_.reply.field("ETag");
      if (tag.compare(0, 2, "W/") != 0 && !tag.empty()) check_former_tag(context_, url_, tag, first_);
      return true;
    }
    is_changed_ = put_.reply.ok() || put_.reply.error;
    if (is_changed_) return false;
  }
  return false;
}

bool Change::put_back() {
  if (!is_changed_) return false;
  is_changed_ = false;
  const std::string why = reason_;
  const bool changed = write(first_.reply.body);
  if (!put_.reply.ok()) context_.notes.push_back("the value of " + url_ + " was changed and could not be put back: " + outcome_of(put_));
  if (!why.empty()) reason_ = why;
  return changed;
}

// --------------------------------------------------------------------------------------------------------------------------- observe

namespace {

class Observer {
 public:
  Observer(Context& context, const std::string& url, const std::string& type,
           const std::function<std::optional<Message>(exchange::Instant until)>& next)
      : context_(context), url_(url), type_(type), next_(next) {}

  Observation by_writing(Change& change) {
    for (const char* what : {"a PUT of another value", "a PUT of the former value"}) {
      const bool first = changes_ == 0;
      if (!(first ? change.make() : change.put_back())) {
        if (first) return untestable(change.reason());
        break;
      }
      ++changes_;
      if (!follow(what)) return found_;
    }
    found_.seen = "the content of GET came after each of " + std::to_string(changes_) + " changes by PUT";
    return found_;
  }

  /// @param why  there is no change by writing
  Observation by_waiting(const std::string& why) {
    const exchange::Instant end = context_.probe.patiently(context_.options.message_time);
    Exchange before = look();
    std::vector<std::string> gets{before.reply.body};
    while (std::chrono::steady_clock::now() < end && !context_.probe.exhausted() && changes_ < 2) {
      if (std::optional<Message> message = next_(std::min(end, std::chrono::steady_clock::now() + poll_interval))) take(*std::move(message));
      const Exchange now = look();
      if (!now.reply.ok() || now.reply.body == before.reply.body) continue;
      ++changes_;
      const bool moves = !same(now.reply.body, look().reply.body);
      if (!(moves ? follow_moving(now) : follow("a change"))) return found_;
      before = look();
    }
    if (changes_ == 0) return untestable("nothing has changed while the check was subscribed; " + why);
    found_.seen = "messages came after " + std::to_string(changes_) + " changes that happened by themselves";
    return found_;
  }

 private:
  Exchange look() { return context_.probe.ask("GET", url_, type_.empty() ? FieldList() : FieldList{{"Accept", type_}}); }
  bool same(const std::string& a, const std::string& b) const { return same_content(a, b, type_, url_); }
  Observation untestable(std::string why) {
    found_.not_testable = std::move(why);
    return found_;
  }
  void take(Message message) {
    if (kept_.size() < max_messages) kept_.push_back(std::move(message));
  }
  std::optional<Message> next(exchange::Instant until) {
    if (kept_.empty()) return next_(until);
    std::optional<Message> first = std::move(kept_.front());
    kept_.erase(kept_.begin());
    return first;
  }
  bool lost(const std::string& what, const Exchange& get) {
    found_.missing =
        (changes_ > 1 ? "there was a message after the first change, and none after the second: " : "") + what + " of " + url_ +
        " has changed what GET responds, and no message came within " +
        std::to_string(std::chrono::duration_cast<milliseconds>(context_.options.message_time + 4 * context_.probe.usual_time()).count()) + " ms";
    found_.proof = get;
    return false;
  }
  bool is_wrong(const Message& message, const std::string& what, const Exchange& get) {
    found_.wrong = "after " + what + " of " + url_ + " the message " +
                   (message.body.empty() ? "is empty"
                    : !former_.empty() && same(message.body, former_)
                        ? "has the former content"
                        : "is not what GET responds: \"" + excerpt(message.body, 120) + "\", GET: \"" + excerpt(get.reply.body, 120) + "\"");
    found_.proof = message.shown;
    return false;
  }

  /// After a change of a value that stays: a message with it.
  bool follow(const std::string& what) {
    const Exchange get = look();
    const exchange::Instant end = context_.probe.patiently(context_.options.message_time);
    std::optional<Message> last;
    for (std::size_t i = 0; i < max_messages; ++i) {
      std::optional<Message> message = next(end);
      if (!message) break;
      if (same(message->body, get.reply.body)) {
        former_ = get.reply.body;
        return true;
      }
      last = std::move(message);
    }
    const Exchange now = look();
    if (!same(now.reply.body, get.reply.body)) {  // it changes by itself, too
      if (!last) return lost(what, get);
      former_ = now.reply.body;
      return structure_of(last->body, type_, url_) == structure_of(now.reply.body, type_, url_) || is_wrong(*last, what, now);
    }
    return last ? is_wrong(*last, what, get) : lost(what, get);
  }

  /// After a change of a value that moves on: two messages of the same structure with different values, or one with the present value.
  bool follow_moving(const Exchange& get) {
    const exchange::Instant end = context_.probe.patiently(context_.options.message_time);
    const std::vector<std::string> structure = structure_of(get.reply.body, type_, url_);
    std::optional<Message> good, bad;
    for (std::size_t i = 0; i < max_messages; ++i) {
      std::optional<Message> message = next(end);
      if (!message) break;
      const bool fits = structure_of(message->body, type_, url_) == structure;
      if (fits && good && !same(message->body, good->body)) {
        changes_ = 2;
        return true;
      }
      (fits && !good ? good : bad) = std::move(message);
    }
    if (good) former_ = good->body;
    if (bad) return is_wrong(*bad, "changes that happened by themselves", get);
    if (good) {
      const Exchange now = look();
      changes_ = 2;
      if (same(now.reply.body, good->body)) return true;  // it has stopped
    }
    return lost("what happens by itself", get);
  }

  Context& context_;
  const std::string url_, type_;
  const std::function<std::optional<Message>(exchange::Instant until)>& next_;
  std::vector<Message> kept_;
  std::string former_;
  std::size_t changes_ = 0;
  Observation found_;
};

}  // namespace

Observation observe(Context& context, const std::string& url, const std::string& type,
                    const std::function<std::optional<Message>(exchange::Instant until)>& next) {
  Change change(context, url);
  Observation found = Observer(context, url, type, next).by_writing(change);
  if (found.not_testable.empty()) return found;
  const std::string why = found.not_testable;
  return Observer(context, url, type, next).by_waiting(why);
}

}  // namespace lrt::check
