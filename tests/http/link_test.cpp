// SPDX-License-Identifier: Apache-2.0
#include "src/http/link.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {
std::size_t links(std::string_view text) {
  std::size_t n = 0;
  for (const char c : text) n += c == '<' ? 1 : 0;
  return n;
}
}  // namespace

TEST_CASE("links share a field line", "[http][R0.9]") {
  http::LinkWriter writer;
  writer.add("/a", "related");
  writer.add("http://www.w3.org/ns/ldp#Resource", "type");
  http::Fields fields;
  writer.finish(fields, "/rest");
  CHECK(fields.block() == "Link: </a>; rel=\"related\", <http://www.w3.org/ns/ldp#Resource>; rel=\"type\"\r\n");
  CHECK_FALSE(writer.cut());
  http::Fields none;
  http::LinkWriter().finish(none, "/rest");
  CHECK(none.block().empty());
}

TEST_CASE("what a URI may not have is percent-encoded in a link", "[http][R0.9]") {
  http::LinkWriter writer;
  writer.add("/gr\xC3\xB6/<\"{}|^`\\> \r\n%41%4%", "http://r/\xC3\xB6#a%20b up\"");
  http::Fields fields;
  writer.finish(fields, "");
  CHECK(fields.find("Link") == std::string_view("</gr%C3%B6/%3C%22%7B%7D%7C%5E%60%5C%3E%20%0D%0A%41%254%25>; rel=\"http://r/%C3%B6#a%20b up%22\""));
}

TEST_CASE("lines keep to 4 KiB, all to the budget, and one link at the end leads to the rest", "[http][R0.9]") {
  for (const std::size_t budget : {64U, 100U, 999U, 4096U, 4097U, 8192U, 20000U}) {
    for (const std::size_t count : {1U, 2U, 3U, 20U, 100U, 101U, 1000U}) {
      CAPTURE(budget, count);
      http::LinkWriter writer(budget);
      for (std::size_t i = 0; i < count; ++i) writer.add("/things/number/" + std::to_string(i), "related");
      http::Fields fields;
      fields.add("X", "1");
      writer.finish(fields, "/?page=2", "next");
      const auto list = fields.list();
      std::size_t total = 0;
      for (std::size_t i = 1; i < list.size(); ++i) {
        const std::size_t line = list[i].name.size() + 2 + list[i].value.size() + 2;
        CHECK(line <= 4096);
        if (i + 1 < list.size()) CHECK(line > 4000);  // lines are shared
        total += line;
        CHECK(list[i].value.back() == '"');
      }
      CHECK(total <= budget);
      const std::string all = fields.joined("Link");
      const std::string rest = "</?page=2>; rel=\"next\"";
      const bool ends_with_rest = all.size() >= rest.size() && all.substr(all.size() - rest.size()) == rest;
      CHECK(ends_with_rest == writer.cut());
      if (writer.cut()) CHECK(total + 64 > budget);  // the room is used
      else CHECK(links(all) == count);
      for (std::size_t i = 0; i + (writer.cut() ? 1 : 0) < links(all); ++i) {
        CHECK(all.find("</things/number/" + std::to_string(i) + ">; rel=\"related\"") != std::string::npos);
      }
    }
  }
}

TEST_CASE("a line is filled up to its last byte and not beyond", "[http][R0.9]") {
  std::size_t longest = 0;
  for (std::size_t length = 1; length <= 400; ++length) {
    http::LinkWriter writer(100000);
    for (int i = 0; i < 500; ++i) writer.add(std::string(length, 'x'), "related");
    http::Fields fields;
    writer.finish(fields, "/");
    for (const http::Field& field : fields.list()) longest = std::max(longest, field.name.size() + 2 + field.value.size() + 2);
  }
  CHECK(longest == 4096);
}

TEST_CASE("a long link to the rest takes the space of others", "[http][R0.9]") {
  http::LinkWriter writer(500);
  for (int i = 0; i < 100; ++i) writer.add("/" + std::to_string(i), "related");
  http::Fields fields;
  writer.finish(fields, "/" + std::string(400, 'x'), "describedby");
  CHECK(fields.block().size() <= 500);
  CHECK(fields.block().find(std::string(400, 'x') + ">; rel=\"describedby\"\r\n") != std::string::npos);
  CHECK(fields.block().find("</0>; rel=\"related\"") != std::string::npos);
}

TEST_CASE("a link longer than a line is cut, and so is what follows", "[http][R0.9]") {
  http::LinkWriter writer;
  writer.add("/a", "related");
  writer.add("/" + std::string(4096, 'x'), "related");
  writer.add("/b", "related");
  http::Fields fields;
  writer.finish(fields, "/rest");
  CHECK(writer.cut());
  CHECK(fields.block() == "Link: </a>; rel=\"related\", </rest>; rel=\"next\"\r\n");
}

TEST_CASE("links that do not fit are in further responses, each once, after those that every response has", "[http][R0.9]") {
  for (const std::size_t budget : {200U, 999U, 4096U, 8192U})
    for (const std::size_t count : {0U, 1U, 20U, 400U}) {
      CAPTURE(budget, count);
      std::string found;
      std::size_t next = 0, responses = 0;
      do {
        http::LinkWriter writer(budget);
        writer.add("/type", "type");
        writer.skip(next);
        for (std::size_t i = 0; i < count; ++i) writer.add("/" + std::to_string(i), "related");
        next = 0;
        std::string last;
        http::Fields fields;
        writer.finish_in_parts(fields, [&](std::size_t n) {
          next = n;
          return last = "/?links=" + std::to_string(n);
        });
        const std::string all = fields.joined("Link");
        CHECK(all.find("</type>; rel=\"type\"") == 0);
        if (next != 0) CHECK(all.find("<" + last + ">; rel=\"next\"") != std::string::npos);
        found += all;
        REQUIRE(++responses <= count + 1);
      } while (next != 0);
      for (std::size_t i = 0; i < count; ++i) {
        const std::string link = "</" + std::to_string(i) + ">";
        CHECK(found.find(link) != std::string::npos);
        CHECK(found.find(link) == found.rfind(link));
      }
    }
}

TEST_CASE("where not even one link fits, there is no next", "[http][R0.9]") {
  http::LinkWriter writer(60);
  writer.add("/type", "type");
  writer.skip(0);
  writer.add("/" + std::string(100, 'a'), "related");
  http::Fields fields;
  writer.finish_in_parts(fields, [](std::size_t n) { return "/?links=" + std::to_string(n); });
  CHECK(fields.joined("Link") == "</type>; rel=\"type\"");
}

TEST_CASE("links to hidden targets are left out, from the call of leave_out() on", "[http][R0.9]") {
  http::LinkWriter writer;
  writer.add("/hidden/before", "related");
  writer.leave_out([](std::string_view target) { return target.substr(0, 7) == "/hidden"; });
  writer.add("/hidden/arm", "related");
  writer.add("/arm", "related");
  writer.add("/hidden", "type", "text/turtle");
  writer.leave_out(nullptr);
  writer.add("/hidden/after", "related");
  http::Fields fields;
  writer.finish(fields, "/rest");
  CHECK(fields.block() == "Link: </hidden/before>; rel=\"related\", </arm>; rel=\"related\", </hidden/after>; rel=\"related\"\r\n");
  CHECK_FALSE(writer.cut());
}

TEST_CASE("the number of links that are left out shows nowhere", "[http][R0.9]") {
  for (const std::size_t hidden : {0U, 1U, 1'000U})
    for (const std::size_t skipped : {0U, 2U}) {
      CAPTURE(hidden, skipped);
      http::LinkWriter writer(200);
      writer.leave_out([](std::string_view target) { return target.find("secret") != std::string_view::npos; });
      writer.skip(skipped);
      for (std::size_t i = 0; i < hidden; ++i) writer.add("/secret/" + std::string(100, 'x') + std::to_string(i), "related");
      CHECK_FALSE(writer.cut());  // it uses nothing of the budget
      for (char c = 'a'; c < 'z'; ++c) writer.add(std::string("/") + c, "related");
      http::Fields fields;
      std::size_t next = 0;
      writer.finish_in_parts(fields, [&](std::size_t n) { return "/?links=" + std::to_string(next = n); });
      CHECK(writer.cut());
      CHECK(next == skipped + 8);  // as many as fit without those that are hidden
      const std::string all = fields.joined("Link");
      CHECK(all.find(skipped == 0 ? "</a>" : "</c>") == 0);
      CHECK(all.find("secret") == std::string::npos);
    }
}

TEST_CASE("a link is read as it is written, and an ill-formed one is left out", "[http][R0.9]") {
  const auto all = [](std::string_view field) {
    std::string result;
    while (!field.empty()) {
      const std::optional<http::WrittenLink> link = http::take_link(field);
      result += link ? '<' + std::string(link->target) + ">(" + link->relations + ")(" + link->type + (link->has_anchor ? ")@" : ")") : "-";
    }
    return result;
  };
  CHECK(all("<a>; rel=up") == "<a>(up)()");
  CHECK(all(" <a,;b> ; REL = \"up  index\";type=\"text/a;b,\\\"c\\\"\",\t<>;rel=\"\"") == "<a,;b>(up  index)(text/a;b,\"c\")<>()()");
  CHECK(all("<a>;rel=first;rel=second;type=x;type=y;flag;anchor=\"#b\"") == "<a>(first)(x)@");
  CHECK(all("<a>;rel=\"\";rel=second") == "<a>()()");  // the first counts
  CHECK(all("a, <b, <c>;rel=\"d, <e>;=f, <g>;rel=h") == "--");
  CHECK(all("<e>;=f, <g>;rel=h,,<i>") == "-<g>(h)()-<i>()()");
  std::string_view relations = "  next http://a.example/b ";
  CHECK(http::take_relation(relations) == "next");
  CHECK(http::take_relation(relations) == "http://a.example/b");
  CHECK(http::take_relation(relations).empty());
}
