// SPDX-License-Identifier: Apache-2.0
#include "src/codegen/cpp_text.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "src/base/utf8.hpp"

namespace lrt::codegen::cpp {
namespace {

bool is_upper(char c) noexcept { return c >= 'A' && c <= 'Z'; }
bool is_lower(char c) noexcept { return c >= 'a' && c <= 'z'; }
bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
bool is_word(char c) noexcept { return is_upper(c) || is_lower(c) || is_digit(c); }
char upper(char c) noexcept { return is_lower(c) ? static_cast<char>(c - 'a' + 'A') : c; }
char lower(char c) noexcept { return is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c; }

/// U+00C0 to U+00FF.
constexpr std::array<const char*, 64> latin = {"A", "A", "A", "A", "Ae", "A", "Ae", "C", "E", "E", "E", "E", "I",  "I", "I",  "I",
                                               "D", "N", "O", "O", "O",  "O", "Oe", "x", "O", "U", "U", "U", "Ue", "Y", "Th", "ss",
                                               "a", "a", "a", "a", "ae", "a", "ae", "c", "e", "e", "e", "e", "i",  "i", "i",  "i",
                                               "d", "n", "o", "o", "o",  "o", "oe", "x", "o", "u", "u", "u", "ue", "y", "th", "y"};

// Keywords of C++ up to C++23, names that C libraries and compilers define as macros, and namespaces that generated code names.
constexpr std::string_view reserved[] = {"alignas",
                                         "alignof",
                                         "and",
                                         "and_eq",
                                         "asm",
                                         "assert",
                                         "auto",
                                         "bitand",
                                         "bitor",
                                         "bool",
                                         "break",
                                         "case",
                                         "catch",
                                         "char",
                                         "char8_t",
                                         "char16_t",
                                         "char32_t",
                                         "class",
                                         "co_await",
                                         "co_return",
                                         "co_yield",
                                         "compl",
                                         "concept",
                                         "const",
                                         "const_cast",
                                         "consteval",
                                         "constexpr",
                                         "constinit",
                                         "continue",
                                         "decltype",
                                         "default",
                                         "delete",
                                         "do",
                                         "double",
                                         "dynamic_cast",
                                         "else",
                                         "enum",
                                         "errno",
                                         "explicit",
                                         "export",
                                         "extern",
                                         "false",
                                         "far",
                                         "float",
                                         "for",
                                         "friend",
                                         "gnu_dev_major",
                                         "gnu_dev_minor",
                                         "goto",
                                         "i386",
                                         "if",
                                         "inline",
                                         "int",
                                         "interface",
                                         "linux",
                                         "long",
                                         "lrt",
                                         "major",
                                         "makedev",
                                         "minor",
                                         "mutable",
                                         "namespace",
                                         "near",
                                         "new",
                                         "noexcept",
                                         "not",
                                         "not_eq",
                                         "nullptr",
                                         "offsetof",
                                         "operator",
                                         "or",
                                         "or_eq",
                                         "private",
                                         "protected",
                                         "public",
                                         "register",
                                         "reinterpret_cast",
                                         "requires",
                                         "return",
                                         "setjmp",
                                         "short",
                                         "signed",
                                         "sizeof",
                                         "small",
                                         "static",
                                         "static_assert",
                                         "static_cast",
                                         "std",
                                         "stderr",
                                         "stdin",
                                         "stdout",
                                         "struct",
                                         "switch",
                                         "template",
                                         "this",
                                         "thread_local",
                                         "throw",
                                         "true",
                                         "try",
                                         "typedef",
                                         "typeid",
                                         "typename",
                                         "union",
                                         "unix",
                                         "unsigned",
                                         "using",
                                         "va_arg",
                                         "va_copy",
                                         "va_end",
                                         "va_start",
                                         "virtual",
                                         "void",
                                         "volatile",
                                         "wchar_t",
                                         "while",
                                         "xor",
                                         "xor_eq"};

bool is_reserved(std::string_view name) noexcept { return std::find(std::begin(reserved), std::end(reserved), name) != std::end(reserved); }

/// The name in ASCII letters, digits and '_', without '_' at its ends.
std::string ascii_of(std::string_view name, std::size_t max) {
  std::string out;
  const auto gap = [&] {
    if (!out.empty() && out.back() != '_') out += '_';
  };
  const std::size_t invalid = utf8::find_invalid(name).value_or(name.size());
  for (std::size_t at = 0; at < invalid && out.size() < max;) {
    const char32_t c = utf8::decode(name, at);
    if (c < 0x80) {
      if (is_word(static_cast<char>(c))) out += static_cast<char>(c);
      else gap();
    } else if (c >= 0xC0 && c <= 0xFF) {
      out += latin[c - 0xC0];
    } else if (c >= 0x100) {
      constexpr char digits[] = "0123456789abcdef";
      std::string hex;
      for (char32_t rest = c; rest != 0; rest >>= 4) hex.insert(hex.begin(), digits[rest & 15]);
      gap();
      out += "u" + hex;
    } else {
      gap();
    }
  }
  if (out.size() > max) out.resize(max);
  while (!out.empty() && out.back() == '_') out.pop_back();
  return out;
}

/// A name of capitals only could be a macro.
bool is_shouted(const std::string& name) noexcept {
  return name.size() > 1 && std::none_of(name.begin(), name.end(), is_lower) && std::any_of(name.begin(), name.end(), is_upper);
}

}  // namespace

std::string string_literal(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7F && c != '"' && c != '\\' && c != '?') {
      out += c;
    } else {
      out += '\\';
      for (const int shift : {6, 3, 0}) out += static_cast<char>('0' + (byte >> shift & 7));
    }
  }
  return out + '"';
}

std::string comment_text(std::string_view text, std::size_t max) {
  std::string out;
  bool cut = false;
  for (std::size_t at = 0; at < text.size();) {
    std::string piece;
    const std::string_view rest = text.substr(at);
    if (const auto invalid = utf8::find_invalid(rest.substr(0, 4)); invalid && *invalid == 0) {
      piece = "?";
      ++at;
    } else {
      std::size_t length = 0;
      const char32_t c = utf8::decode(rest, length);
      const bool is_blank = c <= 0x20 || c == 0x7F || c == 0x85 || c == 0x2028 || c == 0x2029;
      const bool is_invisible = (c >= 0x80 && c < 0xA1) || c == 0xAD || c == 0x61C || (c >= 0x200B && c <= 0x200F) || (c >= 0x202A && c <= 0x202E) ||
                                (c >= 0x2060 && c <= 0x206F) || c == 0xFEFF || (c >= 0xFFF9 && c <= 0xFFFB) || (c >= 0xE0000 && c <= 0xE0FFF);
      if (is_blank) piece = " ";
      else if (is_invisible) piece = "?";
      else if (c == '\\') piece = "|";
      else piece = std::string(rest.substr(0, length));
      at += length;
    }
    const char before = out.empty() ? ' ' : out.back();
    if (piece == " " && before == ' ') continue;
    const bool joins = (before == '*' && piece == "/") || (before == '/' && piece == "*") || (before == '?' && piece == "?");
    if (out.size() + piece.size() + (joins ? 1 : 0) > max) {
      cut = true;
      break;
    }
    if (joins) out += ' ';
    out += piece;
  }
  while (!out.empty() && out.back() == ' ') out.pop_back();
  return cut ? out + "..." : out;
}

std::string type_name(std::string_view name, std::size_t max) {
  const std::string words = ascii_of(name, max);
  const bool shouted = is_shouted(words);
  std::string out;
  bool at_begin = true;
  for (const char c : words) {
    if (c == '_') {
      at_begin = true;
      continue;
    }
    // A digit after a gap keeps it, so that 1-2 and 12 differ.
    if (at_begin && is_digit(c) && !out.empty() && is_digit(out.back())) out += '_';
    out += at_begin ? upper(c) : shouted ? lower(c) : c;
    at_begin = false;
  }
  if (out.empty()) return "Unnamed";
  return is_digit(out.front()) ? "N" + out : out;
}

std::string member_name(std::string_view name, std::size_t max) {
  std::string out = ascii_of(name, max);
  if (out.empty()) return "unnamed";
  if (is_shouted(out)) std::transform(out.begin(), out.end(), out.begin(), lower);
  // The first word: "IOLevel" is ioLevel, "Mode" is mode.
  std::size_t capitals = 0;
  while (capitals < out.size() && is_upper(out[capitals])) ++capitals;
  if (capitals > 1 && capitals < out.size() && is_lower(out[capitals])) --capitals;
  std::transform(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(capitals), out.begin(), lower);
  if (is_digit(out.front())) out.insert(out.begin(), 'n');
  return is_reserved(out) ? out + '_' : out;
}

bool is_namespace(std::string_view text) {
  for (bool more = true; more;) {
    const std::size_t colons = text.find("::");
    const std::string_view part = text.substr(0, colons);
    more = colons != std::string_view::npos;
    if (more) text.remove_prefix(colons + 2);
    const bool plain = !part.empty() && part.size() <= 200 && !is_digit(part.front()) && part.front() != '_' &&
                       part.find("__") == std::string_view::npos &&
                       std::all_of(part.begin(), part.end(), [](char c) { return is_word(c) || c == '_'; });
    if (!plain || is_reserved(part)) return false;
  }
  return true;
}

std::string Scope::add(const std::string& name) {
  if (taken_.insert(name).second) return name;
  const bool ends_in_digit = is_digit(name.back());
  for (std::size_t n = 2;; ++n) {
    std::string numbered = name + (ends_in_digit ? "_" : "") + std::to_string(n);
    if (taken_.insert(numbered).second) return numbered;
  }
}

}  // namespace lrt::codegen::cpp
