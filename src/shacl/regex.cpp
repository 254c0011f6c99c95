// SPDX-License-Identifier: Apache-2.0
#include "src/shacl/regex.hpp"

#include <algorithm>
#include <new>
#include <utility>
#include <vector>

#define PCRE2_CODE_UNIT_WIDTH 8
#include <pcre2.h>

#include "src/base/ascii.hpp"

namespace lrt::shacl {
namespace {

// Limits of PCRE2, which counts anew at each start of a match, and only places where it may backtrack: not the characters that a repeated
// class takes. So they bound memory, and `Work` bounds the whole search.
constexpr std::uint32_t match_limit = 100'000, depth_limit = 50'000, heap_limit_kib = 4'096;

// The total cost of the searches with one Scratch, in steps: a reserve, and more for each search and byte of its subject. A match
// without much backtracking takes some steps for each item of the pattern and start.
constexpr std::size_t reserve_steps = 200'000, steps_of_search = 64, steps_of_byte = 8;
// The groups that a replacement can name.
constexpr std::uint32_t max_groups = 100;
// The number of characters of a repeated class per step.
constexpr std::size_t characters_of_step = 16;

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

/// The largest m of the quantifiers {m}, {m,} and {m,n}: the number of characters that an item may read before it fails.
std::size_t max_minimum(std::string_view pattern) noexcept {
  std::size_t max = 0;
  for (std::size_t at = 0; at < pattern.size(); ++at) {
    if (pattern[at] != '{') continue;
    std::size_t m = 0;
    while (at + 1 < pattern.size() && lrt::detail::is_digit(pattern[at + 1]) && m <= 65'535)
      m = m * 10 + static_cast<std::size_t>(pattern[++at] - '0');
    max = std::max(max, m);
  }
  return max;
}

}  // namespace

/// The work of searches. PCRE2 calls `count` before each item of the pattern (PCRE2_AUTO_CALLOUT), at every start.
struct LRT_LOCAL Regex::Work {
  Work() noexcept : data(pcre2_match_data_create(max_groups, nullptr)), context(pcre2_match_context_create(nullptr)) {
    if (!context) return;
    pcre2_set_match_limit(context, match_limit);
    pcre2_set_depth_limit(context, depth_limit);
    pcre2_set_heap_limit(context, heap_limit_kib);
    pcre2_set_callout(context, &Work::count, this);
  }
  ~Work() {
    pcre2_match_context_free(context);
    pcre2_match_data_free(data);
  }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  /// Characters are counted when the match has moved over them. What an item may have read without moving is added: the characters that
  /// it needs at least, and for patterns with back references the text of a group, which is not longer than the match.
  static int count(pcre2_callout_block* block, void* self) noexcept {
    Work& work = *static_cast<Work*>(self);
    const PCRE2_SIZE at = block->current_position;
    std::size_t characters = work.unmoved + (at > work.last ? at - work.last : 0);
    if (work.back_references) characters += at - block->start_match;
    work.last = at;
    work.steps += 1 + characters / characters_of_step;
    return work.steps <= work.limit ? 0 : PCRE2_ERROR_CALLOUT;
  }

  pcre2_match_data* data;
  pcre2_match_context* context;
  std::size_t available = reserve_steps;
  // of the current search
  std::size_t steps = 0, limit = 0, unmoved = 0;
  PCRE2_SIZE last = 0;
  bool back_references = false;
};

Regex::Scratch::Scratch() noexcept = default;
Regex::Scratch::~Scratch() = default;

Result<Regex> Regex::compile(std::string_view pattern, std::string_view flags, std::size_t max_length) {
  if (pattern.size() > max_length)
    return unexpected(Errc::limit_exceeded,
                      "a pattern of " + std::to_string(pattern.size()) + " bytes, at most " + std::to_string(max_length) + " are allowed");
  std::uint32_t options = PCRE2_UTF | PCRE2_UCP | PCRE2_DOLLAR_ENDONLY | PCRE2_NEVER_BACKSLASH_C | PCRE2_AUTO_CALLOUT;
  bool extended = false, literal = false;
  for (const char flag : flags) {
    switch (flag) {
      case 'i': options |= PCRE2_CASELESS; break;
      case 'm': options |= PCRE2_MULTILINE; break;
      case 's': options |= PCRE2_DOTALL; break;
      case 'x': extended = true; break;
      case 'q': literal = true; break;
      default: return unexpected(Errc::expected_value, std::string("unknown flag '") + flag + "', expected some of i, m, s, x, q");
    }
  }
  std::string translated;
  if (literal) {
    options &= ~(PCRE2_MULTILINE | PCRE2_DOTALL);  // XPath: with q the flags m, s and x have no effect
    for (const char c : pattern) {
      if (static_cast<unsigned char>(c) < 0x80 && !lrt::detail::is_alpha(c) && !lrt::detail::is_digit(c)) translated += '\\';
      translated += c;
    }
  } else {
    Result<std::string> run = Translator(pattern, extended).run();
    if (!run) return unexpected(std::move(run).error());
    translated = *std::move(run);
  }
  const std::size_t unmoved = literal ? 0 : max_minimum(translated);
  int error = 0;
  PCRE2_SIZE offset = 0;
  pcre2_code* code = pcre2_compile(reinterpret_cast<PCRE2_SPTR>(translated.data()), translated.size(), options, &error, &offset, nullptr);
  if (!code) {
    PCRE2_UCHAR message[256] = {};
    pcre2_get_error_message(error, message, sizeof message);
    return unexpected(Errc::expected_value, reinterpret_cast<const char*>(message));
  }
  Regex regex;
  regex.code_ = std::shared_ptr<const void>(code, [](pcre2_code* c) { pcre2_code_free(c); });
  std::uint32_t max_back_reference = 0;
  pcre2_pattern_info(code, PCRE2_INFO_BACKREFMAX, &max_back_reference);
  regex.back_references_ = max_back_reference > 0;
  regex.unmoved_ = unmoved;
  regex.literal_ = literal;
  pcre2_pattern_info(code, PCRE2_INFO_CAPTURECOUNT, &regex.groups_);
  return regex;
}

Regex::Work& Regex::Scratch::work() {
  if (!work_) work_ = std::make_unique<Work>();
  if (!work_->data || !work_->context) throw std::bad_alloc();  // else the value would be refused
  return *work_;
}

/// Searches from a byte on. The work that is done is in work.steps.
int Regex::match(std::string_view subject, std::size_t at, Work& work) const {
  work.limit = work.available;
  work.last = at;
  work.unmoved = unmoved_;
  work.back_references = back_references_;
  const int result = pcre2_match(static_cast<const pcre2_code*>(code_.get()), reinterpret_cast<PCRE2_SPTR>(subject.data()), subject.size(), at,
                                 at == 0 ? 0 : PCRE2_NO_UTF_CHECK, work.data, work.context);
  work.available -= std::min(work.available, work.steps);
  return result;
}

Regex::Outcome Regex::search(std::string_view subject, Scratch& scratch, std::size_t& steps) const {
  Work& work = scratch.work();
  work.available += steps_of_search + subject.size() * steps_of_byte;
  work.steps = 1 + subject.size() / (2 * characters_of_step);
  const int result = match(subject, 0, work);
  steps += work.steps;
  if (result >= 0) return Outcome::match;
  return result == PCRE2_ERROR_NOMATCH ? Outcome::no_match : Outcome::undecided;
}

Regex::Replaced Regex::replace(std::string_view subject, std::string_view replacement, std::size_t max_bytes, Scratch& scratch, std::size_t& steps,
                               std::string& result) const {
  // The parts of the replacement: texts, and the numbers of groups.
  struct Part {
    std::string text;
    std::uint32_t group;
  };
  std::vector<Part> parts;
  std::string text;
  for (std::size_t at = 0; at < replacement.size(); ++at) {
    const char c = replacement[at];
    if (literal_ || (c != '\\' && c != '$')) {
      text += c;
      continue;
    }
    if (++at == replacement.size()) return Replaced::invalid;
    const char next = replacement[at];
    if (c == '\\') {
      if (next != '\\' && next != '$') return Replaced::invalid;
      text += next;
      continue;
    }
    if (!lrt::detail::is_digit(next)) return Replaced::invalid;
    // The longest number of an existing group. Further digits are text.
    auto group = static_cast<std::uint32_t>(next - '0');
    while (at + 1 < replacement.size() && lrt::detail::is_digit(replacement[at + 1])) {
      const std::uint32_t longer = group * 10 + static_cast<std::uint32_t>(replacement[at + 1] - '0');
      if (longer > groups_) break;
      group = longer;
      ++at;
    }
    parts.push_back({std::move(text), group});
    text.clear();
  }

  Work& work = scratch.work();
  work.available += steps_of_search + subject.size() * steps_of_byte;
  const auto search = [&](std::string_view in, std::size_t at) {
    work.steps = 1 + (in.size() - at) / (2 * characters_of_step);
    const int found = match(in, at, work);
    steps += work.steps;
    return found;
  };
  if (const int empty = search({}, 0); empty >= 0) return Replaced::invalid;
  else if (empty != PCRE2_ERROR_NOMATCH) return Replaced::undecided;
  result.clear();
  std::size_t at = 0;
  const auto append = [&](std::string_view more) {
    if (more.size() > max_bytes - std::min(max_bytes, result.size())) return false;
    result += more;
    return true;
  };
  while (at < subject.size()) {
    work.available += steps_of_search;
    const int found = search(subject, at);
    if (found == PCRE2_ERROR_NOMATCH) break;
    if (found < 0) return Replaced::undecided;
    const PCRE2_SIZE* const offsets = pcre2_get_ovector_pointer(work.data);
    const std::size_t begin = offsets[0], end = offsets[1];
    if (begin >= end || begin < at) return Replaced::invalid;  // matches the empty text, at a look-around
    if (!append(subject.substr(at, begin - at))) return Replaced::too_long;
    for (const Part& part : parts) {
      if (!append(part.text)) return Replaced::too_long;
      if (part.group > groups_ || part.group >= max_groups || (found != 0 && part.group >= static_cast<std::uint32_t>(found))) continue;
      const std::size_t from = offsets[2 * part.group], to = offsets[2 * part.group + 1];
      if (from == PCRE2_UNSET || to < from) continue;
      if (!append(subject.substr(from, to - from))) return Replaced::too_long;
    }
    if (!append(text)) return Replaced::too_long;
    at = end;
  }
  return append(subject.substr(at)) ? Replaced::done : Replaced::too_long;
}

}  // namespace lrt::shacl
