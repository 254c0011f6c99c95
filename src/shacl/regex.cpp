#include "src/shacl/regex.hpp"

#include <algorithm>
#include <new>

#define PCRE2_CODE_UNIT_WIDTH 8
#include <pcre2.h>

#include "src/base/ascii.hpp"

namespace lrt::shacl {
namespace {

// Limits of PCRE2, which counts anew at each start of a match, and only places where it may backtrack: not the characters that a repeated
// class takes. So they bound memory, and `Work` bounds the whole search.
constexpr std::uint32_t match_limit = 100'000, depth_limit = 50'000, heap_limit_kib = 4'096;

// What the searches with one Scratch may cost together, in steps: a reserve, and more for each search and byte of its subject. A match
// without much backtracking takes some steps for each item of the pattern and start.
constexpr std::size_t reserve_steps = 200'000, steps_of_search = 64, steps_of_byte = 8;
// So many characters of a repeated class cost one step.
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

/// The largest m of the quantifiers {m}, {m,} and {m,n}: so many characters an item may read before it fails.
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
struct Regex::Work {
  Work() noexcept : data(pcre2_match_data_create(1, nullptr)), context(pcre2_match_context_create(nullptr)) {
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
    return unexpected(Errc::limit_exceeded, "a pattern of " + std::to_string(pattern.size()) + " bytes, at most " +
                                                std::to_string(max_length) + " are allowed");
  std::uint32_t options = PCRE2_UTF | PCRE2_UCP | PCRE2_DOLLAR_ENDONLY | PCRE2_NEVER_BACKSLASH_C | PCRE2_AUTO_CALLOUT;
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
  pcre2_code* code =
      pcre2_compile(reinterpret_cast<PCRE2_SPTR>(translated.data()), translated.size(), options, &error, &offset, nullptr);
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
  return regex;
}

Regex::Outcome Regex::search(std::string_view subject, Scratch& scratch, std::size_t& steps) const {
  if (!scratch.work_) scratch.work_.reset(new Work);
  Work* const work = scratch.work_.get();
  if (!work->data || !work->context) throw std::bad_alloc();  // else the value would be refused
  work->available += steps_of_search + subject.size() * steps_of_byte;
  work->steps = 1 + subject.size() / (2 * characters_of_step);
  work->limit = work->available;
  work->last = 0;
  work->unmoved = unmoved_;
  work->back_references = back_references_;
  const int result = pcre2_match(static_cast<const pcre2_code*>(code_.get()), reinterpret_cast<PCRE2_SPTR>(subject.data()),
                                 subject.size(), 0, 0, work->data, work->context);
  work->available -= std::min(work->available, work->steps);
  steps += work->steps;
  if (result >= 0) return Outcome::match;
  return result == PCRE2_ERROR_NOMATCH ? Outcome::no_match : Outcome::undecided;
}

}  // namespace lrt::shacl
