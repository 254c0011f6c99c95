// SPDX-License-Identifier: Apache-2.0
// misuse [number]: commits each mistake of the tables and compares what the host is told. With a number: one that ends the process.
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "tests/misuse/harness.hpp"

namespace {

using misuse::Misuse;

/// Commits a fatal mistake in a process of its own, with the handler that is the default.
std::string in_child(const char* program, std::size_t number) {
  int ends[2];
  if (::pipe(ends) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(ends[1], STDERR_FILENO);
    ::close(ends[0]);
    const std::string text = std::to_string(number);
    ::execl(program, program, text.c_str(), nullptr);
    ::_exit(1);
  }
  ::close(ends[1]);
  std::string said;
  char bytes[512];
  for (ssize_t n = 0; (n = ::read(ends[0], bytes, sizeof bytes)) > 0;) said.append(bytes, static_cast<std::size_t>(n));
  ::close(ends[0]);
  int status = 0;
  if (::waitpid(child, &status, 0) != child) return "lost";
  const bool aborted = WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
  return (aborted ? "aborted, " : "status " + std::to_string(status) + ", ") + said;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1) {
    std::signal(SIGABRT, SIG_DFL);
    const Misuse* const one = misuse::fatal(static_cast<std::size_t>(std::atoi(argv[1])));
    return one ? (one->commit(), 0) : 1;
  }
  lrt::set_misuse_handler(misuse::collect);
  std::size_t all = 0, wrong = 0;
  const auto judge = [&](const Misuse& one, const std::string& told) {
    ++all;
    if (told.find(one.expected) != std::string::npos) return;
    ++wrong;
    std::printf("%s\n  expected: %s\n  told:     %s\n", one.what, one.expected, told.c_str());
  };
  for (const auto& table : {misuse::of_descriptions(), misuse::of_use()})
    for (const Misuse& one : table) {
      std::string told = one.commit();
      if (const std::string by_check = misuse::checked(); !by_check.empty()) told += " | check: " + by_check;
      judge(one, told);
    }
  for (std::size_t i = 0; const Misuse* one = misuse::fatal(i); ++i) judge(*one, in_child(argv[0], i));
  std::printf("%zu mistakes, %zu are not told as the tables say\n", all, wrong);
  return wrong == 0 && all >= 80 ? 0 : 1;
}
