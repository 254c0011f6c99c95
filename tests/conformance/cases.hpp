// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>

namespace lrt::test {

/// One request with what is expected of its answer, or a change of the robot before it. See cases.txt for the format.
struct Step {
  std::string set;      ///< "angle 12.5": a change, and no request
  std::string request;  ///< as RequestText reads it
  int status = 0;
  std::vector<std::pair<std::string, std::string>> fields;  ///< name, pattern; the name "!Name": absent
  std::vector<std::string> texts;                           ///< that the body contains
  std::string triples, absent;                              ///< Turtle
  long size = -1;                                           ///< of the body
  std::size_t declared = 0;                                 ///< bytes of a body that the request declares and does not send
};

struct Case {
  std::string id, tags;
  int line = 0;
  std::vector<Step> steps;
};

inline std::vector<Case> read_cases(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error("cannot read " + path);
  std::string prefixes;
  for (const auto& [prefix, space] : rdf::default_prefixes()) prefixes += "@prefix " + prefix + ": <" + space + "> . ";
  std::vector<Case> cases;
  std::string line;
  char before = 0;
  bool has_body = false;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto wrong = [&](const std::string& why) { return std::runtime_error(path + ":" + std::to_string(number) + ": " + why); };
    if (line.empty() || line[0] == '#') continue;
    if (line.compare(0, 5, "case ") == 0) {
      const std::size_t space = line.find(' ', 5);
      if (space == std::string::npos) throw wrong("a case needs a requirement");
      cases.push_back({line.substr(5, space - 5), line.substr(space + 1), number, {}});
      before = 0;
      continue;
    }
    if (cases.empty()) throw wrong("expected a case");
    auto& steps = cases.back().steps;
    const char kind = line[0];
    const std::string rest = line.size() > 2 ? line.substr(2) : std::string();
    if (kind != '>' && kind != '@' && (steps.empty() || steps.back().request.empty())) throw wrong("expected a request");
    switch (kind) {
      case '@':
        if (rest.compare(0, 4, "set ") != 0) throw wrong("expected: @ set NAME VALUE");
        steps.emplace_back();
        steps.back().set = rest.substr(4);
        break;
      case '>':
        if (before != '>') steps.emplace_back(), has_body = false;
        steps.back().request += (before == '>' ? "\n" : "") + rest;
        break;
      case '|': {
        const bool first = !has_body;
        steps.back().request += first ? "\n\n" : "\n";
        has_body = true;
        const bool turtle = first && (rest == "turtle" || rest.compare(0, 7, "turtle ") == 0);
        steps.back().request += turtle ? prefixes + (rest.size() > 7 ? rest.substr(7) : "") : rest;
        break;
      }
      case '<':
        if (steps.back().status == 0) {
          steps.back().status = std::stoi(rest);
        } else if (rest[0] == '!') {
          steps.back().fields.emplace_back(rest, "");
        } else {
          const std::size_t colon = rest.find(": ");
          if (colon == std::string::npos) throw wrong("expected a field");
          steps.back().fields.emplace_back(rest.substr(0, colon), rest.substr(colon + 2));
        }
        break;
      case '~': steps.back().texts.push_back(rest); break;
      case '=': steps.back().triples += rest + "\n"; break;
      case '!': steps.back().absent += rest + "\n"; break;
      case '^': steps.back().size = std::stol(rest); break;
      case '?': steps.back().declared = std::stoul(rest); break;
      default: throw wrong("unknown kind of line");
    }
    before = kind;
  }
  for (const Case& c : cases)
    for (const Step& s : c.steps)
      if (s.set.empty() && s.status == 0) throw std::runtime_error(c.id + ": a request without an expected status");
  return cases;
}

/// Whether `text` is what the pattern says, where '*' stands for any number of characters.
inline bool fits(std::string_view pattern, std::string_view text) {
  std::size_t p = 0, t = 0, star = std::string_view::npos, mark = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      mark = t;
    } else if (p < pattern.size() && pattern[p] == text[t]) {
      ++p, ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++mark;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

}  // namespace lrt::test
