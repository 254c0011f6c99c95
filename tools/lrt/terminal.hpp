// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Output of the command: on a terminal for people, or into a pipe or a file for programs.
namespace lrt::tool {

/// A text of a robot in one line that is safe on a terminal. Control characters (C0, DEL, C1), characters that change the direction of writing and bytes
/// that are not UTF-8 become visible: "\x1b", "\u202e".
std::string printable(std::string_view text);
/// The same for several lines: line feeds and tabs stay.
std::string printable_lines(std::string_view text);
/// The same for lines that lrt has coloured: its sequences stay, "\033[31m".
std::string printable_styled(std::string_view text);
/// The same for JSON: characters that printable() would change become escapes of JSON, so that the document keeps its value. Line feeds between values stay.
std::string printable_json(std::string_view json);
/// A JSON string with its quotes, printable.
std::string json_string(std::string_view text);

/// Columns that a printable text takes on a terminal: wide characters two, combining ones none.
std::size_t columns_of(std::string_view text) noexcept;
/// At most that many columns; what was cut is "…" at the end.
std::string cut(std::string_view text, std::size_t columns);

enum class Style : unsigned char { plain, strong, faint, good, bad, warning };

/// Standard output and standard error of the command.
class Terminal {
 public:
  enum class Colour : unsigned char { automatic, always, never };

  Terminal();
  void set_colour(Colour colour) noexcept { colour_ = colour; }

  /// Standard output is a terminal: a person reads it.
  bool is_for_people() const noexcept { return out_is_terminal_; }
  /// Progress can be shown: standard error is a terminal, too.
  bool shows_progress() const noexcept { return error_is_terminal_; }
  /// The locale's characters are those of UTF-8.
  bool has_unicode() const noexcept;
  /// The current width, because a window can change its size.
  std::size_t width() const noexcept;
  std::size_t height() const noexcept;

  /// Standard output has colours.
  bool has_colours() const noexcept;
  /// The text between the sequences of a style, where standard output has colours.
  std::string styled(std::string_view text, Style style) const;

  /// Writes to standard output and flushes it. Pass text from printable() only.
  /// @return  false: the reader has closed it, or the disk is full; see failed()
  bool print(std::string_view text) noexcept;
  bool print_line(std::string text) noexcept { return print(text += '\n'); }
  /// Writes to standard error.
  void print_error(std::string_view text) const noexcept;
  /// The error number of the first print() that failed; 0: none has.
  int failed() const noexcept { return failed_; }

 private:
  Colour colour_ = Colour::automatic;
  bool out_is_terminal_, error_is_terminal_;
  int failed_ = 0;
};

/// Rows in columns: aligned for people and cut to the width of the terminal, with a tab between columns for programs.
class Table {
 public:
  struct Cell {
    std::string text;  ///< printable
    Style style = Style::plain;
  };
  void add(std::vector<Cell> row) { rows_.push_back(std::move(row)); }
  bool empty() const noexcept { return rows_.empty(); }
  /// @param heading  names of the columns, for people only; may be empty
  bool print(Terminal& terminal, const std::vector<std::string>& heading = {}) const;

 private:
  std::vector<std::vector<Cell>> rows_;
};

/// Signals that end a command or concern the terminal, as events of a descriptor: Ctrl-C (SIGINT), SIGTERM, SIGHUP, SIGWINCH and SIGCONT. At a second SIGINT
/// or SIGTERM that was not taken the program ends at once.
/// One object at a time.
class Signals {
 public:
  Signals();
  ~Signals();
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

  int descriptor() const noexcept;
  /// The next signal; 0: there is none.
  int take() noexcept;
};

/// Whether a signal asks the command to end.
bool ends_command(int signal) noexcept;

/// A terminal without echo on its alternate screen, as long as the object lives; also restored when the program is stopped (Ctrl-Z) and when Signals ends it.
class Screen {
 public:
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  /// After SIGCONT: another program may have used the terminal.
  void enter() noexcept;
  void leave() noexcept;
};

}  // namespace lrt::tool
