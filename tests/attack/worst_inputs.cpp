// SPDX-License-Identifier: Apache-2.0
// What a byte of a hostile request costs: for each parser of bytes from the network, the inputs that took most CPU time for their size.
//
//   worst_inputs [KIB]            prints a Markdown table; KIB: the size of each input, 64 by default
//   worst_inputs KIB --outcomes   prints only what became of each input: "read", or the error
//
// An input may be refused early; then its cost is small. What is printed was measured in this run.

#include <ctime>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/http/request_parser.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/http/etag.hpp"
#include "src/http/negotiate.hpp"
#include "src/http/prefer.hpp"
#include "src/rdf/plain.hpp"

namespace {

using namespace lrt;

std::string repeated(std::string_view text, std::size_t bytes) {
  std::string out;
  out.reserve(bytes + text.size());
  while (out.size() < bytes) out += text;
  return out;
}

/// The text with each # replaced by the number of the repetition.
std::string numbered(std::string_view text, std::size_t bytes) {
  std::string out;
  for (std::size_t i = 0; out.size() < bytes; ++i)
    for (const char c : text) {
      if (c == '#') out += std::to_string(i);
      else out += c;
    }
  return out;
}

std::string around(std::string_view before, const std::string& middle, std::string_view after) {
  return std::string(before) + middle + std::string(after);
}

/// `middle` without its last character: a separator.
std::string joined(std::string_view before, std::string middle, std::string_view after) {
  middle.pop_back();
  return around(before, middle, after);
}

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec) * 1e-9;
}

struct Cost {
  std::string input;
  double ns_per_byte;
  std::string outcome;
};

class Table {
 public:
  explicit Table(std::size_t bytes) : bytes_(bytes) {}

  /// @param parse  what became of the input: "read", or the error
  void add(const char* parser, const char* name, const std::string& input, const std::function<std::string(const std::string&)>& parse) {
    double best = std::numeric_limits<double>::max();
    std::string outcome;
    for (int i = 0; i < 3; ++i) {
      const double begun = cpu_seconds();
      outcome = parse(input);
      best = std::min(best, cpu_seconds() - begun);
    }
    if (outcome.size() > 60) outcome = outcome.substr(0, 57) + "...";
    std::replace(outcome.begin(), outcome.end(), '|', '/');
    std::replace(outcome.begin(), outcome.end(), '\n', ' ');
    costs_[parser].push_back({name, best * 1e9 / static_cast<double>(input.size()), std::move(outcome)});
  }

  void print_outcomes() const {
    for (const auto& [parser, all] : costs_)
      for (const Cost& cost : all) std::printf("%s | %s | %s\n", parser.c_str(), cost.input.c_str(), cost.outcome.c_str());
  }

  void print() {
    std::printf("CPU time for each byte of an input of %zu KiB, the ten worst for each parser. 100 ns/byte are 0.1 s/MiB.\n\n", bytes_ / 1024);
    std::printf("| parser | input | ns/byte | outcome |\n|---|---|---:|---|\n");
    for (auto& [parser, all] : costs_) {
      std::sort(all.begin(), all.end(), [](const Cost& a, const Cost& b) { return a.ns_per_byte > b.ns_per_byte; });
      if (all.size() > 10) all.resize(10);
      for (const Cost& cost : all)
        std::printf("| %s | %s | %.0f | %s |\n", parser.c_str(), cost.input.c_str(), cost.ns_per_byte, cost.outcome.c_str());
    }
  }

 private:
  const std::size_t bytes_;
  std::map<std::string, std::vector<Cost>> costs_;
};

std::function<std::string(const std::string&)> reader(rdf::Syntax syntax) {
  return [syntax](const std::string& text) {
    const engine::Limits limits;
    rdf::ReadOptions options;
    options.base = "http://robot.example/arm/note";
    options.max_triples = limits.max_body_triples;
    options.max_bytes = limits.max_body_text_bytes;
    options.context = "http://robot.example/ns/context.jsonld";
    const auto graph = rdf::read(text, syntax, options);
    return graph ? "read" : graph.error().message;
  };
}

template <class T>
std::function<std::string(const std::string&)> plain(rdf::Plain format) {
  return [format](const std::string& text) {
    rdf::Graph graph;
    const rdf::TermId focus = graph.intern(rdf::iri("http://robot.example/arm/note"));
    const auto read = rdf::read_plain(text, format, rdf::traits<T>::type(), {}, "http://robot.example/ns/vocabulary#",
                                      engine::Limits().max_body_triples, graph, focus);
    return read ? "read" : read.error().message;
  };
}

void turtle(Table& t, std::size_t n) {
  const auto add = [&](const char* name, const std::string& text) { t.add("Turtle", name, text, reader(rdf::Syntax::turtle)); };
  add("statements with blank nodes", repeated("[] <a:p> [] .\n", n));
  add("one triple again and again", repeated("<a:s><a:p>1.", n));
  add("numbers of one triple", around("<a:s> <a:p> ", joined("", repeated("1,", n), ""), " ."));
  add("nested brackets", around("<a:s> <a:p> ", repeated("[<a:p>", n / 2) + repeated("]", n / 12), " ."));
  add("nested lists", around("<a:s> <a:p> ", repeated("(", n / 2) + repeated(")", n / 2), " ."));
  add("a list", around("<a:s> <a:p> (", repeated("1 ", n), ") ."));
  add("one long digit string", around("<a:s> <a:p> ", repeated("7", n), " ."));
  add("one long text", around("<a:s> <a:p> \"", repeated("x", n), "\" ."));
  add("a text of escapes", around("<a:s> <a:p> \"", repeated("\\u00e9", n), "\" ."));
  add("a prefix defined again and again", repeated("@prefix p: <http://x/> .\n", n));
  add("prefixes", numbered("@prefix p#: <http://x/> .\n", n));
  add("a long namespace used often", around("@prefix p: <http://x/" + repeated("y", n / 2) + "> .\n", repeated("p:a p:a p:a.\n", n / 2), ""));
  add("references with dots", repeated("<../../../a/../b> <a:p> <./../.> .\n", n));
  add("a long base with dots", around("@base <http://x/" + repeated("a/", n / 2) + "> .\n", repeated("<../../b><../p><../c>.\n", n / 2), ""));
  add("comments", repeated("#\n", n));
  add("one comment", "#" + repeated("x", n));
  add("semicolons", around("<a:s> <a:p> 1 ", repeated(";", n), " ."));
  add("language tags", repeated("<a:s><a:p>\"\"@en-x-y.", n));
  add("blank node labels", numbered("_:b#<a:p>_:c#.", n));
  add("percent escapes", repeated("<http://x/%41%42><a:p><%43>.", n));
}

void n_triples(Table& t, std::size_t n) {
  const auto add = [&](const char* name, const std::string& text) { t.add("N-Triples", name, text, reader(rdf::Syntax::n_triples)); };
  add("triples", numbered("<a:s#><a:p><a:o#>.\n", n));
  add("one triple again and again", repeated("<a:s><a:p><a:o>.\n", n));
  add("blank node labels", numbered("_:b#<a:p>_:c# .\n", n));
  add("a text of escapes", around("<a:s> <a:p> \"", repeated("\\U0001F600", n), "\" .\n"));
  add("datatypes", numbered("<a:s><a:p>\"\"^^<a:d#>.\n", n));
  add("empty lines", repeated("\n", n));
  add("a long IRI", around("<a:", repeated("x", n), "> <a:p> <a:o> .\n"));
}

void json_ld(Table& t, std::size_t n) {
  const auto add = [&](const char* name, const std::string& text) { t.add("JSON-LD", name, text, reader(rdf::Syntax::json_ld)); };
  const std::string_view own = "\"http://robot.example/ns/context.jsonld\"";
  add("nodes with contexts",
      joined("{\"@graph\":[", repeated("{\"@context\":{\"a\":\"http://x/a\",\"b\":{\"@id\":\"a\",\"@type\":\"@id\"}},\"a\":1},", n), "]}"));
  add("an array of contexts", joined("{\"@context\":[", repeated("{\"a\":\"http://x/a\"},", n), "],\"a\":1}"));
  add("references to lrt's context", joined("{\"@context\":[", repeated(std::string(own) + ",", n), "],\"ros:a\":1}"));
  add("nodes with lrt's context", joined("{\"@graph\":[", repeated("{\"@context\":" + std::string(own) + ",\"ros:a\":1},", n), "]}"));
  add("terms", joined("{\"@context\":{", numbered("\"a#\":\"http://x/a#\",", n), "},\"a1\":1}"));
  add("a chain of terms", joined("{\"@context\":{\"a\":\"http://x/\",", numbered("\"b#\":\"a:#\",", n), "},\"b1\":1}"));
  add("scoped contexts",
      joined("{\"@context\":{", numbered("\"a#\":{\"@id\":\"http://x/\",\"@context\":{\"b\":\"http://y/\"}},", n / 2), "},").substr(0) +
          joined("\"a0\":[", repeated("{\"b\":1},", n / 2), "]}"));
  add("numbers", joined("{\"http://x/a\":[", repeated("1.5e3,", n), "]}"));
  add("empty objects", joined("{\"http://x/a\":[", repeated("{},", n), "]}"));
  add("nested objects", around(repeated("{\"http://x/a\":", n), "1", repeated("}", n / 14)));
  add("nested arrays", around("{\"http://x/a\":" + repeated("[", n / 2), "1", repeated("]", n / 2) + "}"));
  add("lists of lists", joined("{\"http://x/a\":[", repeated("{\"@list\":[{\"@list\":[]}]},", n), "]}"));
  add("keys", joined("{", numbered("\"http://x/#\":#,", n), "}"));
  add("keys without meaning", joined("{", numbered("\"a#\":1,", n), "}"));
  add("reverse properties", joined("{\"@reverse\":{\"http://x/a\":[", repeated("{\"@id\":\"b\"},", n), "]}}"));
  add("types", joined("{\"@type\":[", numbered("\"http://x/#\",", n), "]}"));
  add("a text of escapes", around("{\"http://x/a\":\"", repeated("\\u00e9", n), "\"}"));
  add("white space", around("{", repeated(" ", n), "}"));
  add("language maps",
      joined("{\"@context\":{\"a\":{\"@id\":\"http://x/a\",\"@container\":\"@language\"}},\"a\":{", numbered("\"x-a#\":\"b\",", n), "}}"));
}

/// Each is twice the one before it, as often as 2^20.
std::string numbered_entities() {
  std::string text;
  for (int i = 1; i <= 20; ++i) {
    const std::string before = "&b" + std::to_string(i - 1) + ";";
    text += "<!ENTITY b" + std::to_string(i) + " \"" + before + before + "\">";
  }
  return text;
}

void rdf_xml(Table& t, std::size_t n) {
  const auto add = [&](const char* name, const std::string& text) { t.add("RDF/XML", name, text, reader(rdf::Syntax::rdf_xml)); };
  const std::string head = "<r:RDF xmlns:r=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns:x=\"http://x/\">", end = "</r:RDF>";
  add("elements", around(head, repeated("<x:A/>", n), end));
  add("nested elements", around(head, repeated("<x:A><x:b>", n / 2) + repeated("</x:b></x:A>", n / 2), end));
  add("attributes", around(head + "<x:A ", numbered("x:a#=\"\" ", n), "/>" + end));
  add("namespaces", around(head, numbered("<x:A xmlns:n#=\"http://y/#\"/>", n), end));
  add("literals", around(head + "<x:A>", repeated("<x:b>c</x:b>", n), "</x:A>" + end));
  add("an XML literal", around(head + "<x:A><x:b r:parseType=\"Literal\">", repeated("<c/>", n), "</x:b></x:A>" + end));
  add("a collection", around(head + "<x:A><x:b r:parseType=\"Collection\">", repeated("<x:C/>", n), "</x:b></x:A>" + end));
  add("comments", around(head, repeated("<!---->", n), end));
  add("character references", around(head + "<x:A><x:b>", repeated("&#233;", n), "</x:b></x:A>" + end));
  add("a long entity",
      "<!DOCTYPE a [<!ENTITY b \"" + repeated("c", n / 2) + "\">]>" + around(head + "<x:A><x:b>", repeated("&b;", n / 2), "</x:b></x:A>" + end));
  add("entities of entities", "<!DOCTYPE a [<!ENTITY b0 \"c\">" + numbered_entities() + "]>" + head + "<x:A><x:b>&b20;</x:b></x:A>" + end);
}

struct Point {
  double x = 0, y = 0;
};

}  // namespace

template <>
struct lrt::rdf::traits<Point> : lrt::rdf::Record<Point> {
  static void describe(Record<Point>& r) {
    r.field("x", &Point::x);
    r.field("y", &Point::y);
  }
};

namespace {

void values(Table& t, std::size_t n) {
  using Numbers = std::vector<double>;
  const auto json = plain<Numbers>(rdf::Plain::json);
  t.add("JSON", "numbers", joined("[", repeated("1,", n), "]"), json);
  t.add("JSON", "long numbers", joined("[", repeated("0.12345678901234567,", n), "]"), json);
  t.add("JSON", "one long number", repeated("7", n), plain<double>(rdf::Plain::json));
  t.add("JSON", "nested arrays", repeated("[", n / 2) + repeated("]", n / 2), json);
  t.add("JSON", "points", joined("[", repeated("{\"x\":1,\"y\":2},", n), "]"), plain<std::vector<Point>>(rdf::Plain::json));
  t.add("JSON", "one member again and again", joined("{", repeated("\"x\":1,", n), "}"), plain<Point>(rdf::Plain::json));
  t.add("JSON", "unknown members", joined("{", numbered("\"a#\":1,", n), "}"), plain<Point>(rdf::Plain::json));
  t.add("JSON", "a text of escapes", around("\"", repeated("\\u00e9", n), "\""), plain<std::string>(rdf::Plain::json));
  t.add("JSON", "texts", joined("[", repeated("\"\",", n), "]"), plain<std::vector<std::string>>(rdf::Plain::json));
  t.add("JSON", "members of a map", joined("{", numbered("\"a#\":1,", n), "}"), (plain<std::map<std::string, int>>(rdf::Plain::json)));
  t.add("JSON", "white space", repeated(" ", n) + "[]", json);
  const auto cbor = plain<Numbers>(rdf::Plain::cbor);
  t.add("CBOR", "numbers", around("\x9f", repeated("\x01", n), "\xff"), cbor);
  t.add("CBOR", "numbers of 9 bytes", around("\x9f", repeated(std::string("\xfb\x3f\xf8\0\0\0\0\0\0", 9), n), "\xff"), cbor);
  t.add("CBOR", "nested arrays", repeated("\x81", n), cbor);
  t.add("CBOR", "a text in pieces", around("\x7f", repeated("\x61x", n), "\xff"), plain<std::string>(rdf::Plain::cbor));
  t.add("CBOR", "tags", repeated("\xc1", n) + "\x01", cbor);
}

void fields(Table& t) {
  constexpr std::size_t n = 8'000;  // of one line
  const auto header = [](const std::string& text) {
    http::Request request;
    http::Framing framing;
    const auto refusal = http::parse_request_header(text, request, framing);
    return refusal ? refusal->reason : std::string("read");
  };
  const std::string start = "GET / HTTP/1.1\r\nHost: robot\r\n", end = "\r\n";
  t.add("header section", "fields", around(start, repeated("a:\r\n", 16'000), end), header);
  t.add("header section", "one long field", around(start + "a: ", repeated("x", n), "\r\n" + end), header);
  t.add("header section", "Connection fields", around(start, repeated("Connection: a,b\r\n", 16'000), end), header);
  t.add("header section", "a list of connection options", around(start + "Connection: ", repeated("a,", n), "\r\n" + end), header);
  t.add("header section", "a target of percent escapes", around("GET /", repeated("%41", n), " HTTP/1.1\r\nHost: robot\r\n\r\n"), header);
  const std::vector<std::string_view> offers = {"text/turtle",           "application/json",    "application/ld+json",
                                                "application/n-triples", "application/rdf+xml", "text/html"};
  const auto accept = [&](const std::string& text) { return http::negotiate(text, offers) ? std::string("chosen") : std::string("none fits"); };
  t.add("Accept", "commas", repeated(",", n), accept);
  t.add("Accept", "ranges", repeated("*/*;q=0.1,", n), accept);
  t.add("Accept", "parameters", around("text/turtle", repeated(";a=b", n), ""), accept);
  t.add("Accept", "quoted parameters", around("text/turtle;a=\"", repeated("\\\"", n), "\""), accept);
  t.add("If-None-Match", "entity tags", repeated("\"a\",", n),
        [](const std::string& text) { return std::to_string(static_cast<int>(http::matches(text, "\"b\"", true))); });
  t.add("Prefer", "preferences", repeated("a=b;c=d,", n),
        [](const std::string& text) { return http::parse_prefer(text).wait ? std::string("wait") : std::string("read"); });
}

}  // namespace

int main(int count, char** arguments) {
  const std::size_t bytes = (count > 1 ? std::strtoul(arguments[1], nullptr, 10) : 64) * 1024;
  const bool only_outcomes = count > 2 && std::string_view(arguments[2]) == "--outcomes";
  if (bytes == 0 || count > 3 || (count == 3 && !only_outcomes)) return std::fprintf(stderr, "usage: %s [KIB [--outcomes]]\n", arguments[0]), 2;
  Table table(bytes);
  turtle(table, bytes);
  n_triples(table, bytes);
  json_ld(table, bytes);
  rdf_xml(table, bytes);
  values(table, bytes);
  fields(table);
  if (only_outcomes) table.print_outcomes();
  else table.print();
  return 0;
}
