#include "src/shacl/regex.hpp"

#include <new>

#define PCRE2_CODE_UNIT_WIDTH 8
#include <pcre2.h>

#include <lrt/base/immortal.hpp>

namespace lrt::shacl {
namespace {

// Limits of one search: steps of PCRE2's matcher (some milliseconds) and memory. The first attempt has few steps, so that its cost is
// known; the caller has a budget for many searches.
constexpr std::uint32_t few_steps = 1'000, many_steps = 100'000, depth_limit = 50'000, heap_limit_kib = 4'096;

class Limits {
 public:
  explicit Limits(std::uint32_t steps) noexcept : context_(pcre2_match_context_create(nullptr)) {
    if (!context_) return;
    pcre2_set_match_limit(context_, steps);
    pcre2_set_depth_limit(context_, depth_limit);
    pcre2_set_heap_limit(context_, heap_limit_kib);
  }
  ~Limits() { pcre2_match_context_free(context_); }
  Limits(const Limits&) = delete;
  Limits& operator=(const Limits&) = delete;
  pcre2_match_context* context() const noexcept { return context_; }

 private:
  pcre2_match_context* context_;
};

// The members of XPath's \i and \c: XML 1.0 NameStartChar and NameChar.
constexpr std::string_view initial_characters =
    R"(:A-Z_a-z\x{C0}-\x{D6}\x{D8}-\x{F6}\x{F8}-\x{2FF}\x{370}-\x{37D}\x{37F}-\x{1FFF}\x{200C}\x{200D}\x{2070}-\x{218F})"
    R"(\x{2C00}-\x{2FEF}\x{3001}-\x{D7FF}\x{F900}-\x{FDCF}\x{FDF0}-\x{FFFD}\x{10000}-\x{EFFFF})";
constexpr std::string_view further_characters = R"(\-.0-9\x{B7}\x{300}-\x{36F}\x{203F}\x{2040})";

constexpr bool is_space(char c) noexcept { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// Translates XPath's dialect into PCRE2's: \i \c \I \C, class subtraction, and the flag x, which keeps white space in classes.
class Translator {
 public:
  Translator(std::string_view pattern, bool extended) : in_(pattern), extended_(extended) {}

  Result<std::string> run() {
    std::string out;
    while (at_ < in_.size() && fault_.empty()) {
      const char c = in_[at_];
      if (c == '\\') {
        escape(out, false);
      } else if (c == '[') {
        out += char_class(0);
      } else if (c == '(' && at_ + 1 < in_.size() && in_[at_ + 1] == '*') {
        fault_ = "a quantifier without an atom";
      } else if (extended_ && is_space(c)) {
        ++at_;
      } else {
        out += c;
        ++at_;
      }
    }
    if (!fault_.empty()) return unexpected(Errc::expected_value, fault_ + " at byte " + std::to_string(at_));
    return out;
  }

 private:
  void escape(std::string& out, bool in_class) {
    if (at_ + 1 >= in_.size()) {
      fault_ = "\\ at the end";
      return;
    }
    const char c = in_[at_ + 1];
    switch (c) {
      case 'i':
      case 'c': {
        std::string members(initial_characters);
        if (c == 'c') members += further_characters;
        out += in_class ? members : "[" + members + "]";
        break;
      }
      case 'I':
      case 'C': {
        if (in_class) {
          fault_ = std::string("\\") + c + " within a class is not supported";
          return;
        }
        out += "[^" + std::string(initial_characters) + (c == 'C' ? std::string(further_characters) : "") + "]";
        break;
      }
      case 'Q':
      case 'E':
      case 'K': fault_ = std::string("unknown escape \\") + c; return;
      default: out.append(in_.substr(at_, 2));
    }
    at_ += 2;
  }

  /// Translates the class `[`...`]` at at_. A subtraction becomes a negative look-ahead before the class.
  std::string char_class(std::size_t depth) {
    if (depth > 20) {
      fault_ = "classes nested too deeply";
      return {};
    }
    std::string members = "[", without;
    ++at_;
    if (at_ < in_.size() && in_[at_] == '^') members += in_[at_++];
    for (bool first = true;; first = false) {
      if (at_ >= in_.size()) {
        fault_ = "a class without ]";
        return {};
      }
      const char c = in_[at_];
      if (c == ']' && !first) break;
      if (c == '\\') {
        escape(members, true);
        if (!fault_.empty()) return {};
      } else if (c == '-' && !first && at_ + 1 < in_.size() && in_[at_ + 1] == '[') {
        ++at_;
        without = char_class(depth + 1);
        if (fault_.empty() && (at_ >= in_.size() || in_[at_] != ']')) fault_ = "expected ] after a class subtraction";
        if (!fault_.empty()) return {};
        break;
      } else if (c == '[' || c == ']') {
        (members += '\\') += c;
        ++at_;
      } else {
        members += c;
        ++at_;
      }
    }
    ++at_;
    members += ']';
    return without.empty() ? members : "(?:(?!" + without + ")" + members + ")";
  }

  std::string_view in_;
  bool extended_;
  std::size_t at_ = 0;
  std::string fault_;
};

}  // namespace

void Regex::Scratch::Free::operator()(void* data) const noexcept {
  pcre2_match_data_free(static_cast<pcre2_match_data*>(data));
}

Result<Regex> Regex::compile(std::string_view pattern, std::string_view flags, std::size_t max_length) {
  if (pattern.size() > max_length)
    return unexpected(Errc::limit_exceeded, "a pattern of " + std::to_string(pattern.size()) + " bytes, at most " +
                                                std::to_string(max_length) + " are allowed");
  std::uint32_t options = PCRE2_UTF | PCRE2_UCP | PCRE2_DOLLAR_ENDONLY | PCRE2_NEVER_BACKSLASH_C;
  bool extended = false, literal = false;
  for (const char flag : flags) {
    switch (flag) {
      case 'i': options |= PCRE2_CASELESS; break;
      case 'm': options |= PCRE2_MULTILINE; break;
      case 's': options |= PCRE2_DOTALL; break;
      case 'x': extended = true; break;
      case 'q': literal = true; break;
      default:
        return unexpected(Errc::expected_value, std::string("unknown flag '") + flag + "', expected some of i, m, s, x, q");
    }
  }
  std::string translated(pattern);
  if (literal) {
    options = PCRE2_UTF | PCRE2_LITERAL | (options & PCRE2_CASELESS);  // XPath: with q the flags m, s and x have no effect
  } else {
    Result<std::string> run = Translator(pattern, extended).run();
    if (!run) return unexpected(std::move(run).error());
    translated = *std::move(run);
  }
  int error = 0;
  PCRE2_SIZE offset = 0;
  pcre2_code* code =
      pcre2_compile(reinterpret_cast<PCRE2_SPTR>(translated.data()), translated.size(), options, &error, &offset, nullptr);
  if (!code) {
    PCRE2_UCHAR message[256] = {};
    pcre2_get_error_message(error, message, sizeof message);
    return unexpected(Errc::expected_value, reinterpret_cast<const char*>(message));
  }
  Regex regex;
  regex.code_ = std::shared_ptr<const void>(code, [](pcre2_code* c) { pcre2_code_free(c); });
  return regex;
}

Regex::Outcome Regex::search(std::string_view subject, Scratch& scratch, std::size_t& steps) const noexcept {
  static const Immortal<Limits> few(few_steps), many(many_steps);
  if (!scratch.data_) scratch.data_.reset(pcre2_match_data_create(1, nullptr));
  auto* data = static_cast<pcre2_match_data*>(scratch.data_.get());
  if (!data || !few->context() || !many->context()) return Outcome::undecided;
  const auto run = [&](const Limits& limits) {
    return pcre2_match(static_cast<const pcre2_code*>(code_.get()), reinterpret_cast<PCRE2_SPTR>(subject.data()),
                       subject.size(), 0, 0, data, limits.context());
  };
  steps += 1 + subject.size() / 32;
  int result = run(*few);
  if (result == PCRE2_ERROR_MATCHLIMIT) {
    steps += many_steps;
    result = run(*many);
  }
  if (result >= 0) return Outcome::match;
  return result == PCRE2_ERROR_NOMATCH ? Outcome::no_match : Outcome::undecided;
}

}  // namespace lrt::shacl
