// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/terminal.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace lrt::tool {
namespace {

struct Character {
  char32_t code = 0;
  std::size_t bytes = 1;
  bool valid = false;
};

/// The character at the beginning of a text. An invalid byte is a character of its own.
Character first_character(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {lead, 1, false};
  char32_t code = lead & (0x7Fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0u) != 0x80) return {lead, 1, false};
    code = code << 6 | (byte(i) & 0x3Fu);
  }
  constexpr char32_t lowest[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < lowest[bytes] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {lead, 1, false};
  return {code, bytes, true};
}

/// Control characters, and characters that change the direction or lines of the text.
bool is_unsafe(char32_t c) noexcept {
  return c < 0x20 || (c >= 0x7F && c <= 0x9F) || c == 0x061C || c == 0x200E || c == 0x200F || (c >= 0x2028 && c <= 0x202E) ||
         (c >= 0x2066 && c <= 0x2069) || c == 0xFEFF || (c >= 0xFFF9 && c <= 0xFFFB) || (c >= 0xE0000 && c <= 0xE0FFF);
}

std::string hex(unsigned value, int digits) {
  char text[16];
  std::snprintf(text, sizeof text, "%0*x", digits, value);
  return text;
}

template <class Escape>
std::string escaped(std::string_view text, Escape escape) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const Character c = first_character(text);
    if (c.valid && !is_unsafe(c.code)) result += text.substr(0, c.bytes);
    else result += escape(c);
    text.remove_prefix(c.bytes);
  }
  return result;
}

std::string visible(const Character& c) {
  if (!c.valid || c.code < 0x80) return "\\x" + hex(static_cast<unsigned>(c.code), 2);
  return c.code > 0xFFFF ? "\\U" + hex(static_cast<unsigned>(c.code), 8) : "\\u" + hex(static_cast<unsigned>(c.code), 4);
}

/// As a JSON escape: two of UTF-16 above U+FFFF.
std::string json_escape(const Character& c) {
  if (!c.valid) return "\\ufffd";
  if (c.code == '\n') return "\\n";
  if (c.code == '\t') return "\\t";
  if (c.code <= 0xFFFF) return "\\u" + hex(static_cast<unsigned>(c.code), 4);
  const unsigned rest = static_cast<unsigned>(c.code) - 0x10000;
  return "\\u" + hex(0xD800 + (rest >> 10), 4) + "\\u" + hex(0xDC00 + (rest & 0x3FF), 4);
}

std::size_t columns_of_character(char32_t c) noexcept {
  const auto within = [c](char32_t low, char32_t high) { return c >= low && c <= high; };
  if (within(0x300, 0x36F) || within(0x483, 0x489) || within(0x591, 0x5BD) || within(0x610, 0x61A) || within(0x64B, 0x65F) ||
      within(0x1AB0, 0x1AFF) || within(0x1DC0, 0x1DFF) || within(0x200B, 0x200D) || within(0x20D0, 0x20FF) || within(0xFE00, 0xFE0F) ||
      within(0xFE20, 0xFE2F))
    return 0;
  if (within(0x1100, 0x115F) || within(0x2E80, 0x303E) || within(0x3041, 0xA4CF) || within(0xAC00, 0xD7A3) || within(0xF900, 0xFAFF) ||
      within(0xFE30, 0xFE6F) || within(0xFF00, 0xFF60) || within(0xFFE0, 0xFFE6) || within(0x1F300, 0x1F64F) || within(0x1F680, 0x1F6FF) ||
      within(0x1F900, 0x1F9FF) || within(0x20000, 0x3FFFD))
    return 2;
  return 1;
}

winsize size_of_terminal() noexcept {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 && ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0) return {};
  return size;
}

void write_all(int descriptor, std::string_view text) noexcept {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

std::string printable(std::string_view text) { return escaped(text, visible); }

std::string printable_lines(std::string_view text) {
  return escaped(text, [](const Character& c) {
    return c.valid && (c.code == '\n' || c.code == '\t') ? std::string(1, static_cast<char>(c.code)) : visible(c);
  });
}

std::string printable_styled(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t at = std::min(text.find("\033["), text.size());
    result += printable_lines(text.substr(0, at));
    text.remove_prefix(at);
    if (text.empty()) break;
    const std::size_t end = text.find_first_not_of("0123456789;", 2);
    const std::size_t taken = end != std::string_view::npos && text[end] == 'm' ? end + 1 : 1;  // a colour at most
    result += taken > 1 ? std::string(text.substr(0, taken)) : printable_lines(text.substr(0, 1));
    text.remove_prefix(taken);
  }
  return result;
}

std::string printable_json(std::string_view json) {
  return escaped(json, [](const Character& c) {  // between values JSON has no other controls, and in strings none of these
    return c.valid && (c.code == '\n' || c.code == '\t') ? std::string(1, static_cast<char>(c.code)) : json_escape(c);
  });
}

std::string json_string(std::string_view text) {
  std::string result = "\"";
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\"\\"), text.size());
    result += escaped(text.substr(0, end), json_escape);
    text.remove_prefix(end);
    if (text.empty()) break;
    result += '\\';
    result += text.front();
    text.remove_prefix(1);
  }
  return result += '"';
}

std::size_t columns_of(std::string_view text) noexcept {
  std::size_t columns = 0;
  while (!text.empty()) {
    const Character c = first_character(text);
    columns += columns_of_character(c.code);
    text.remove_prefix(c.bytes);
  }
  return columns;
}

std::string cut(std::string_view text, std::size_t columns) {
  if (columns_of(text) <= columns) return std::string(text);
  if (columns == 0) return {};
  std::string result;
  std::size_t used = 0;
  while (!text.empty()) {
    const Character c = first_character(text);
    if (used + columns_of_character(c.code) > columns - 1) break;
    used += columns_of_character(c.code);
    result += text.substr(0, c.bytes);
    text.remove_prefix(c.bytes);
  }
  return result += "…";
}

// --- Terminal ---

Terminal::Terminal() : out_is_terminal_(::isatty(STDOUT_FILENO) == 1), error_is_terminal_(::isatty(STDERR_FILENO) == 1) {}

bool Terminal::has_unicode() const noexcept {
  for (const char* const name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* const value = std::getenv(name);
    if (!value || !*value) continue;
    const std::string_view locale(value);
    for (const char* const utf8 : {"UTF-8", "UTF8", "utf-8", "utf8"})
      if (locale.find(utf8) != std::string_view::npos) return true;
    return false;
  }
  return false;
}

std::size_t Terminal::width() const noexcept {
  const std::size_t columns = size_of_terminal().ws_col;
  return columns == 0 ? 80 : columns;
}
std::size_t Terminal::height() const noexcept {
  const std::size_t rows = size_of_terminal().ws_row;
  return rows == 0 ? 24 : rows;
}

bool Terminal::has_colours() const noexcept {
  const char* const term = std::getenv("TERM");
  const char* const no_colour = std::getenv("NO_COLOR");  // https://no-color.org
  return colour_ == Colour::always ||
         (colour_ == Colour::automatic && out_is_terminal_ && !(no_colour && *no_colour) && term && std::string_view(term) != "dumb");
}

std::string Terminal::styled(std::string_view text, Style style) const {
  if (!has_colours() || style == Style::plain || text.empty()) return std::string(text);
  const char* sequence = "";
  switch (style) {
    case Style::strong: sequence = "\033[1m"; break;
    case Style::faint: sequence = "\033[2m"; break;
    case Style::good: sequence = "\033[32m"; break;
    case Style::bad: sequence = "\033[31m"; break;
    case Style::warning: sequence = "\033[33m"; break;
    case Style::plain: break;
  }
  return sequence + std::string(text) + "\033[0m";
}

bool Terminal::print(std::string_view text) noexcept {
  while (!text.empty() && failed_ == 0) {
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) failed_ = written < 0 ? errno : EIO;
    else text.remove_prefix(static_cast<std::size_t>(written));
  }
  return failed_ == 0;
}

void Terminal::print_error(std::string_view text) const noexcept { write_all(STDERR_FILENO, text); }

// --- Table ---

bool Table::print(Terminal& terminal, const std::vector<std::string>& heading) const {
  std::string text;
  if (!terminal.is_for_people()) {
    for (const auto& row : rows_) {
      for (std::size_t i = 0; i < row.size(); ++i) text += (i == 0 ? "" : "\t") + terminal.styled(row[i].text, row[i].style);
      text += '\n';
    }
    return terminal.print(text);
  }
  std::vector<std::size_t> widths;
  const auto measure = [&](std::size_t i, std::string_view cell) {
    if (widths.size() <= i) widths.resize(i + 1, 0);
    widths[i] = std::max(widths[i], columns_of(cell));
  };
  for (std::size_t i = 0; i < heading.size(); ++i) measure(i, heading[i]);
  for (const auto& row : rows_)
    for (std::size_t i = 0; i < row.size(); ++i) measure(i, row[i].text);
  // If the row does not fit, the widest columns are shortened, the first one, which has the names, last: down to 20, and then down to 8.
  constexpr std::size_t gap = 2;
  std::size_t total = widths.empty() ? 0 : gap * (widths.size() - 1);
  for (const std::size_t width : widths) total += width;
  if (widths.empty()) return terminal.print(text);
  const auto shorten = [&](std::size_t first, std::size_t last, std::size_t narrowest) {
    while (total > terminal.width()) {
      const auto begin = widths.begin() + static_cast<std::ptrdiff_t>(first), end = widths.begin() + static_cast<std::ptrdiff_t>(last);
      const auto widest = std::max_element(begin, end);
      if (widest == end || *widest <= narrowest) return;
      --*widest;
      --total;
    }
  };
  for (const std::size_t narrowest : {std::size_t{20}, std::size_t{8}}) {
    shorten(1, widths.size(), narrowest);
    shorten(0, 1, narrowest);
  }
  const auto add = [&](const std::vector<Cell>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string cell = cut(row[i].text, widths[i]);
      text += terminal.styled(cell, row[i].style);
      if (i + 1 < row.size()) text.append(widths[i] - columns_of(cell) + gap, ' ');
    }
    while (!text.empty() && text.back() == ' ') text.pop_back();
    text += '\n';
  };
  if (!heading.empty() && !rows_.empty()) {
    std::vector<Cell> cells;
    for (const std::string& name : heading) cells.push_back({name, Style::faint});
    add(cells);
  }
  for (const auto& row : rows_) add(row);
  return terminal.print(text);
}

// --- Screen, Signals: what signal handlers touch is of this file, atomic, and used by system calls only ---

namespace {

constexpr std::string_view enter_sequence = "\033[?1049h\033[?25l\033[2J", leave_sequence = "\033[?25h\033[?1049l";
std::atomic<bool> on_screen{false};
bool has_saved_mode = false;
termios saved_mode{};

std::atomic<int> pipe_in{-1}, pipe_out{-1};
std::atomic<int> endings{0};
constexpr int watched_signals[] = {SIGINT, SIGTERM, SIGHUP, SIGWINCH, SIGCONT, SIGTSTP};
struct sigaction old_actions[std::size(watched_signals)];

void restore_terminal() noexcept {
  if (!on_screen.exchange(false)) return;
  write_all(STDOUT_FILENO, leave_sequence);
  if (has_saved_mode) ::tcsetattr(STDIN_FILENO, TCSANOW, &saved_mode);
}

extern "C" void on_signal(int signal) {
  const int error = errno;
  if (signal == SIGTSTP) {
    restore_terminal();
    ::raise(SIGSTOP);  // continues here after SIGCONT
    errno = error;
    return;
  }
  if (ends_command(signal) && endings.fetch_add(1) > 0) {
    restore_terminal();
    ::_exit(128 + signal);
  }
  const char byte = static_cast<char>(signal);
  [[maybe_unused]] const auto written = ::write(pipe_in.load(), &byte, 1);
  errno = error;
}

}  // namespace

bool ends_command(int signal) noexcept { return signal == SIGINT || signal == SIGTERM || signal == SIGHUP; }

Signals::Signals() {
  int ends[2] = {-1, -1};
  if (::pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) return;
  pipe_out = ends[0];
  pipe_in = ends[1];
  endings = 0;
  for (std::size_t i = 0; i < std::size(watched_signals); ++i) {
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    ::sigaction(watched_signals[i], nullptr, &old_actions[i]);
    if (old_actions[i].sa_handler == SIG_IGN) continue;  // nohup; a background job of a shell
    ::sigaction(watched_signals[i], &action, nullptr);
  }
}

Signals::~Signals() {
  for (std::size_t i = 0; i < std::size(watched_signals); ++i) ::sigaction(watched_signals[i], &old_actions[i], nullptr);
  ::close(pipe_in.exchange(-1));
  ::close(pipe_out.exchange(-1));
}

int Signals::descriptor() const noexcept { return pipe_out; }

int Signals::take() noexcept {
  char byte = 0;
  return ::read(pipe_out, &byte, 1) == 1 ? byte : 0;
}

Screen::Screen() {
  has_saved_mode = ::tcgetattr(STDIN_FILENO, &saved_mode) == 0;
  enter();
}
Screen::~Screen() { leave(); }

void Screen::enter() noexcept {
  if (on_screen) return;
  if (has_saved_mode) {
    termios quiet = saved_mode;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO | ICANON);
    ::tcsetattr(STDIN_FILENO, TCSANOW, &quiet);
  }
  on_screen = true;
  write_all(STDOUT_FILENO, enter_sequence);
}
void Screen::leave() noexcept { restore_terminal(); }

}  // namespace lrt::tool
