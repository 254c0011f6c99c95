// SPDX-License-Identifier: Apache-2.0
// The formats of a report: text, JSON, EARL.

#include <algorithm>
#include <ctime>

#include <lrt/check.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/quote.hpp"

namespace lrt::check {
inline namespace v0 {
namespace {

constexpr std::string_view check_namespace = "https://w3id.org/lrt/check#";
constexpr std::string_view earl_namespace = "http://www.w3.org/ns/earl#";

struct Counts {
  std::size_t passed = 0, failed = 0, advice = 0, not_applicable = 0, not_testable = 0;
};

Counts count(const Report& report) {
  Counts c;
  for (const Finding& f : report.findings) {
    switch (f.outcome) {
      case Outcome::pass: ++c.passed; break;
      case Outcome::fail: ++(f.level == Level::must ? c.failed : c.advice); break;
      case Outcome::not_applicable: ++c.not_applicable; break;
      case Outcome::not_testable: ++c.not_testable; break;
    }
  }
  return c;
}

std::string date_time(std::chrono::system_clock::time_point time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// ------------------------------------------------------------------------------------------------------------------------------ text

class Text {
 public:
  Text(const Report& report, const TextOptions& options) : report_(report), options_(options) {}

  std::string make() {
    const Counts c = count(report_);
    out_ = report_.url + (report_.product.empty() ? "" : " (" + report_.product + ")") + "\n";
    out_ += std::to_string(report_.resources.size()) + " resources, " + std::to_string(report_.requests) + " requests: " + std::to_string(c.passed) +
            " checks passed, " + std::to_string(c.failed) + " failed, " + std::to_string(c.advice) + " are advice, " +
            std::to_string(c.not_applicable) + " not applicable, " + std::to_string(c.not_testable) + " not testable\n";
    for (const Level level : {Level::must, Level::should, Level::may})
      for (const Finding& f : report_.findings)
        if (f.outcome == Outcome::fail && f.level == level) finding(f);
    if (options_.all)
      for (const Finding& f : report_.findings)
        if (f.outcome != Outcome::fail) finding(f);
    out_ += "\n";
    for (const Requirement& r : report_.requirements) requirement(r);
    out_ += "\n";
    out_ += std::string("Robotic Thing: ") + (report_.is_robotic_thing ? "yes" : "no") +
            ". Linked Robotic Thing: " + (report_.is_linked_robotic_thing ? "yes" : "no") + ", as far as it can be seen from outside.\n";
    for (const std::string& note : report_.notes) out_ += "Note: " + note + ".\n";
    return std::move(out_);
  }

 private:
  std::string painted(const char* colour, const std::string& text) const {
    return options_.colour ? "\x1B[" + std::string(colour) + "m" + text + "\x1B[0m" : text;
  }

  static std::string word(const Finding& f) {
    if (f.outcome != Outcome::fail) return std::string(to_string(f.outcome));
    return f.level == Level::must ? "FAIL" : f.level == Level::should ? "fail (should)" : "advice";
  }
  static const char* colour_of(Outcome outcome, bool advice) {
    return outcome == Outcome::fail ? (advice ? "33" : "31") : outcome == Outcome::pass ? "32" : "2";
  }

  void lines(const std::string& text, const char* indent) {
    std::size_t at = 0, count = 0;
    while (at <= text.size()) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      if (++count > 14) {
        out_ += std::string(indent) + "...\n";
        return;
      }
      out_ += std::string(indent) + text.substr(at, end - at) + "\n";
      at = end + 1;
    }
  }

  void finding(const Finding& f) {
    out_ +=
        "\n" + painted(colour_of(f.outcome, f.level != Level::must), word(f)) + " " + f.id + " (" + joined(f.requirements) + "): " + f.title + "\n";
    if (f.outcome == Outcome::fail || options_.all)
      out_ += "  " + std::string(to_string(f.level)) + ": " + f.specification + " [" + f.references + "]\n";
    if (!f.detail.empty()) out_ += "  found" + std::string(f.certainty == Certainty::likely ? " (likely)" : "") + ": " + f.detail + "\n";
    for (std::size_t i = 1; i < f.results.size(); ++i) out_ += "  and: " + f.results[i] + "\n";
    if (f.failed > 1) out_ += "  " + std::to_string(f.failed) + " of " + std::to_string(f.tried) + " failed\n";
    if (f.evidence.empty()) return;
    out_ += "  " + f.evidence.front().url + "\n";
    lines(f.evidence.front().sent, "    > ");
    lines(f.evidence.front().received, "    < ");
  }

  void requirement(const Requirement& r) {
    const std::string outcome =
        r.outcome == Outcome::fail ? (r.advice ? "fail (" + std::string(to_string(r.level)) + ")" : "FAIL") : std::string(to_string(r.outcome));
    std::string line = r.id + std::string(r.id.size() < 6 ? 6 - r.id.size() : 1, ' ') + painted(colour_of(r.outcome, r.advice), outcome) +
                       std::string(outcome.size() < 15 ? 15 - outcome.size() : 1, ' ') + r.title;
    if (!r.reason.empty() && r.outcome != Outcome::pass)
      line += ": " + r.reason.substr(0, r.outcome == Outcome::fail ? r.reason.find(':') : r.reason.size());
    out_ += line + "\n";
  }

  const Report& report_;
  const TextOptions& options_;
  std::string out_;
};

// ------------------------------------------------------------------------------------------------------------------------------ JSON

std::string array(const std::vector<std::string>& texts) {
  std::string out = "[";
  for (const std::string& text : texts) out += (out.size() > 1 ? ", " : "") + json_string(text);
  return out + "]";
}

std::string underscored(std::string_view text) {
  std::string out(text);
  std::replace(out.begin(), out.end(), ' ', '_');
  return out;
}

}  // namespace

std::string to_text(const Report& report, const TextOptions& options) { return Text(report, options).make(); }

std::string to_json(const Report& report) {
  std::string out = "{\n\"url\": " + json_string(report.url) + ",\n\"started\": " + json_string(date_time(report.started)) +
                    ",\n\"product\": " + json_string(report.product) + ",\n\"is_robotic_thing\": " + (report.is_robotic_thing ? "true" : "false") +
                    ",\n\"is_linked_robotic_thing\": " + (report.is_linked_robotic_thing ? "true" : "false") +
                    ",\n\"requests\": " + std::to_string(report.requests) + ",\n\"resources\": " + array(report.resources) +
                    ",\n\"notes\": " + array(report.notes) + ",\n\"requirements\": [";
  bool first = true;
  for (const Requirement& r : report.requirements) {
    out += std::string(first ? "\n" : ",\n") + "{\"id\": " + json_string(r.id) + ", \"level\": " + json_string(to_string(r.level)) +
           ", \"outcome\": " + json_string(underscored(to_string(r.outcome))) + ", \"title\": " + json_string(r.title) +
           ", \"reason\": " + json_string(r.reason) + "}";
    first = false;
  }
  out += "],\n\"findings\": [";
  first = true;
  for (const Finding& f : report.findings) {
    out += std::string(first ? "\n" : ",\n") + "{\"id\": " + json_string(f.id) + ", \"requirements\": " + array(f.requirements) +
           ", \"level\": " + json_string(to_string(f.level)) + ", \"outcome\": " + json_string(underscored(to_string(f.outcome))) +
           ", \"certainty\": " + json_string(to_string(f.certainty)) + ", \"title\": " + json_string(f.title) +
           ", \"specification\": " + json_string(f.specification) + ", \"references\": " + json_string(f.references) +
           ", \"detail\": " + json_string(f.detail) + ", \"tried\": " + std::to_string(f.tried) + ", \"failed\": " + std::to_string(f.failed) +
           ", \"results\": " + array(f.results) + ", \"evidence\": [";
    for (std::size_t i = 0; i < f.evidence.size(); ++i)
      out += std::string(i == 0 ? "" : ", ") + "{\"url\": " + json_string(f.evidence[i].url) + ", \"sent\": " + json_string(f.evidence[i].sent) +
             ", \"received\": " + json_string(f.evidence[i].received) + "}";
    out += "]}";
    first = false;
  }
  return out + "]\n}\n";
}

std::string to_earl(const Report& report) {
  rdf::Graph graph;
  const auto earl = [](std::string_view name) { return rdf::Term(rdf::iri(std::string(earl_namespace) + std::string(name))); };
  const auto mine = [](std::string_view name) { return rdf::Term(rdf::iri(std::string(check_namespace) + std::string(name))); };
  const auto type = rdf::TermView(vocab::rdf_::type);
  const rdf::Term title = rdf::iri("http://purl.org/dc/terms/title"), description = rdf::iri("http://purl.org/dc/terms/description"),
                  date = rdf::iri("http://purl.org/dc/terms/date"), part_of = rdf::iri("http://purl.org/dc/terms/isPartOf"),
                  source = rdf::iri("http://purl.org/dc/terms/source");
  const rdf::Term assertor = mine("lrt"), subject = rdf::iri(report.url);
  graph.add(assertor, type, earl("Assertor"));
  graph.add(assertor, type, earl("Software"));
  graph.add(assertor, title, rdf::literal("lrt check"));
  graph.add(subject, type, earl("TestSubject"));
  for (const Requirement& r : report.requirements) {
    graph.add(mine(r.id), type, earl("TestRequirement"));
    graph.add(mine(r.id), title, rdf::literal(r.title));
  }
  const std::string time = date_time(report.started);
  for (const Finding& f : report.findings) {
    const rdf::Term test = mine(f.id);
    graph.add(test, type, earl("TestCase"));
    graph.add(test, title, rdf::literal(f.title));
    graph.add(test, description, rdf::literal(f.specification));
    graph.add(test, source, rdf::literal(f.references));
    for (const std::string& r : f.requirements) graph.add(test, part_of, mine(r));
    const rdf::Term assertion(graph.term(graph.fresh_blank())), result(graph.term(graph.fresh_blank()));
    graph.add(assertion, type, earl("Assertion"));
    graph.add(assertion, earl("assertedBy"), assertor);
    graph.add(assertion, earl("subject"), subject);
    graph.add(assertion, earl("test"), test);
    graph.add(assertion, earl("mode"), earl("automatic"));
    graph.add(assertion, earl("result"), result);
    graph.add(result, type, earl("TestResult"));
    const char* outcome = f.outcome == Outcome::pass             ? "passed"
                          : f.outcome == Outcome::fail           ? "failed"
                          : f.outcome == Outcome::not_applicable ? "inapplicable"
                                                                 : "cantTell";
    graph.add(result, earl("outcome"), earl(outcome));
    graph.add(result, date, rdf::literal(time, Iri("http://www.w3.org/2001/XMLSchema#dateTime")));
    std::string found = f.detail;
    for (std::size_t i = 1; i < f.results.size(); ++i) found += "\n" + f.results[i];
    if (!found.empty()) graph.add(result, description, rdf::literal(found));
    std::string info = std::string(to_string(f.level)) + ", " + std::string(to_string(f.certainty));
    for (const Evidence& e : f.evidence) info += "\n\n" + e.url + "\n" + e.sent + "\n\n" + e.received;
    graph.add(result, earl("info"), rdf::literal(info));
  }
  rdf::Prefixes prefixes = rdf::default_prefixes();
  prefixes.emplace_back("earl", std::string(earl_namespace));
  prefixes.emplace_back("check", std::string(check_namespace));
  return rdf::write(graph, rdf::Syntax::turtle, prefixes).value_or(std::string());
}

}  // namespace v0
}  // namespace lrt::check
