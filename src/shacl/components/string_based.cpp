// SPDX-License-Identifier: Apache-2.0
// SHACL 4.4 String-based Constraint Components

#include <algorithm>

#include <lrt/rdf/vocab.hpp>

#include "src/shacl/components/all.hpp"
#include "src/shacl/derived_patterns.hpp"
#include "src/shacl/regex.hpp"
#include "src/shacl/run.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace sh = vocab::sh;
namespace {

/// SPARQL's STRLEN(str(node)): code points.
std::uint64_t length_of(const rdf::TermView& term) noexcept {
  return static_cast<std::uint64_t>(
      std::count_if(term.text.begin(), term.text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

/// SHACL 4.4.1 sh:minLength: the minimum number of characters in the text of every value node. A blank node has no text: a violation.
class MinLength final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    if (const auto n = compiler.integer(shape, sh::minLength))
      compiler.add<MinLength>(shape, static_cast<std::uint64_t>(std::max<std::int64_t>(*n, 0)));
  }
  explicit MinLength(std::uint64_t min) noexcept : Constraint(sh::MinLengthConstraintComponent), min_(min) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      const rdf::TermView term = run.term(node);
      if (!term.is_blank() && (term.text.size() / 4 >= min_ || length_of(term) >= min_)) continue;
      run.violation(scene, *this, node, [&] { return "expected at least " + counted(min_, "character", "characters") + ", found " + shown(term); });
    }
  }

 private:
  std::uint64_t min_;
};

/// SHACL 4.4.2 sh:maxLength: the maximum number of characters in the text of every value node. A blank node is a violation.
class MaxLength final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    if (const auto n = compiler.integer(shape, sh::maxLength)) compiler.add<MaxLength>(shape, *n);
  }
  explicit MaxLength(std::int64_t max) noexcept : Constraint(sh::MaxLengthConstraintComponent), max_(max) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      const rdf::TermView term = run.term(node);
      if (!term.is_blank() && static_cast<std::int64_t>(length_of(term)) <= max_) continue;
      run.violation(scene, *this, node, [&] {
        return "expected at most " + std::to_string(max_) + (max_ == 1 ? " character" : " characters") + ", found " + shown(term);
      });
    }
  }

 private:
  std::int64_t max_;
};

/// SHACL 4.4.3 sh:pattern, sh:flags: the text of every value node matches the regular expression, as SPARQL's REGEX. A blank node and a
/// match that exceeds the matcher's limits are violations.
class Pattern final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    const auto flags = compiler.text(shape, sh::flags);
    const auto pattern = compiler.text(shape, sh::pattern);
    if (!pattern) return;  // sh:flags alone declares no constraint
    Result<Regex> regex = Regex::compile(*pattern, flags.value_or(std::string_view()), compiler.options().max_pattern_length);
    if (!regex) {
      const bool about_flags = regex.error().message.rfind("unknown flag", 0) == 0;
      return compiler.fail(shape.id, about_flags ? sh::flags : sh::pattern, *compiler.value(shape, about_flags ? sh::flags : sh::pattern),
                           "a regular expression: " + regex.error().message, regex.error().code);
    }
    compiler.add<Pattern>(shape, *std::move(regex), std::string(*pattern));
  }
  Pattern(Regex regex, std::string text) : Constraint(sh::PatternConstraintComponent), regex_(std::move(regex)), text_(std::move(text)) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      const rdf::TermView term = run.term(node);
      Regex::Outcome outcome = Regex::Outcome::no_match;
      if (!term.is_blank()) {
        std::size_t steps = 0;
        outcome = regex_.search(term.text, run.regex_scratch, steps);
        run.step(steps);
      }
      if (outcome == Regex::Outcome::match) continue;
      run.violation(scene, *this, node, [&] {
        if (text_ == finite_pattern && is_number(term)) return "expected a finite number, found " + shown_value(term);
        const bool is_derived = text_ == day_time_pattern || text_ == zone_pattern || text_ == finite_pattern;
        const std::string words = is_derived ? expectation(run.plan(), scene.shape.id) : std::string();
        if (!words.empty()) return "expected " + words + ", found " + shown_value(term);
        return "expected a text that matches " + shown(rdf::literal(text_)) + ", found " + shown(term) +
               (outcome == Regex::Outcome::undecided ? "; the search was stopped at its limit of work, so it is not known whether it matches" : "");
      });
    }
  }

 private:
  Regex regex_;
  std::string text_;
};

/// SPARQL's LANGMATCHES (RFC 4647 basic filtering). Tags of a Graph are in lower case.
bool language_matches(std::string_view tag, std::string_view range) noexcept {
  if (tag.empty()) return false;
  if (range == "*") return true;
  return tag.substr(0, range.size()) == range && (tag.size() == range.size() || (tag.size() > range.size() && tag[range.size()] == '-'));
}

/// SHACL 4.4.4 sh:languageIn: every value node is a text with a language that matches one of the ranges. One list of xsd:string.
class LanguageIn final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    const auto head = compiler.value(shape, sh::languageIn);
    const auto members = compiler.list(shape, sh::languageIn, *head);
    if (!members) return;
    std::vector<std::string> ranges;
    for (const rdf::TermId m : *members) {
      const rdf::TermView term = compiler.term(m);
      if (!term.is_literal() || term.datatype != vocab::xsd::string.text) return compiler.fail(shape.id, sh::languageIn, m, "a list of xsd:string");
      std::string range(term.text);
      for (char& c : range)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
      ranges.push_back(std::move(range));
    }
    compiler.add<LanguageIn>(shape, std::move(ranges));
  }
  explicit LanguageIn(std::vector<std::string> ranges) : Constraint(sh::LanguageInConstraintComponent), ranges_(std::move(ranges)) {}

  void check(Run& run, const Scene& scene) const override {
    for (std::size_t i = scene.begin; i < scene.end && !run.done(); ++i) {
      const Node node = run.node(i);
      const rdf::TermView term = run.term(node);
      if (std::any_of(ranges_.begin(), ranges_.end(), [&](const std::string& r) { return language_matches(term.language, r); })) continue;
      run.violation(scene, *this, node, [&] {
        std::string text = "expected a text in";
        for (const std::string& r : ranges_) text += (&r == &ranges_.front() ? " \"" : ", \"") + r + '"';
        return text + ", found " + shown(term);
      });
    }
  }

 private:
  std::vector<std::string> ranges_;
};

/// SHACL 4.4.5 sh:uniqueLang: no two value nodes have the same language tag. One result for each repeated tag. Only "true" declares a
/// constraint. One xsd:boolean, in property shapes.
class UniqueLang final : public Constraint {
 public:
  static void build(Compiler& compiler, const Draft& shape) {
    if (compiler.flag(shape, sh::uniqueLang)) compiler.add<UniqueLang>(shape);
  }
  UniqueLang() noexcept : Constraint(sh::UniqueLangConstraintComponent) {}

  void check(Run& run, const Scene& scene) const override {
    if (scene.size() < 2) return;
    std::vector<std::string_view>& tags = run.texts;
    tags.clear();
    for (std::size_t i = scene.begin; i < scene.end; ++i)
      if (const rdf::TermView term = run.term(run.node(i)); !term.language.empty()) tags.push_back(term.language);
    if (tags.size() < 2) return;
    std::sort(tags.begin(), tags.end());
    for (std::size_t i = 1; i < tags.size() && !run.done(); ++i) {
      if (tags[i] != tags[i - 1] || (i > 1 && tags[i] == tags[i - 2])) continue;
      run.violation(scene, *this, std::nullopt, [&] { return "expected at most one text in \"" + std::string(tags[i]) + "\", found several"; });
    }
  }
};

}  // namespace

const Component components::min_length{{{sh::minLength, true}}, false, &MinLength::build};
const Component components::max_length{{{sh::maxLength, true}}, false, &MaxLength::build};
const Component components::pattern{{{sh::pattern, true}, {sh::flags, true}}, false, &Pattern::build};
const Component components::language_in{{{sh::languageIn, true}}, false, &LanguageIn::build};
const Component components::unique_lang{{{sh::uniqueLang, true}}, true, &UniqueLang::build};

}  // namespace lrt::shacl
