// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <deque>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

extern char** environ;  // NOLINT: POSIX

namespace lrt::test {

/// A domain of DDS that no other test on this machine uses at the same time. Domains up to 100 have ports below those that the system gives to clients.
class Domain {
 public:
  Domain() {
    const std::string folder = "/tmp/lrt_test_ros2_domains_" + std::to_string(::geteuid());
    ::mkdir(folder.c_str(), 0700);
    const auto first = static_cast<unsigned>(::getpid()) % 100;
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (std::chrono::steady_clock::now() < until) {
      for (unsigned i = 0; i < 100; ++i) {
        number_ = 1 + (first + i) % 100;
        file_ = ::open((folder + "/" + std::to_string(number_)).c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
        if (file_ >= 0 && ::flock(file_, LOCK_EX | LOCK_NB) == 0) return;
        if (file_ >= 0) ::close(file_);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    throw std::runtime_error("no domain is free");
  }
  ~Domain() { ::close(file_); }
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;
  unsigned number() const noexcept { return number_; }

 private:
  unsigned number_ = 0;
  int file_ = -1;
};

/// Waits for a condition. False: it has not come in time.
template <class F>
bool eventually(F&& is_true, std::chrono::seconds limit = std::chrono::seconds(30)) {
  const auto until = std::chrono::steady_clock::now() + limit;
  while (!is_true()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

/// A process that reads commands and writes lines.
class Peer {
 public:
  /// Waits for the line "ready".
  explicit Peer(std::vector<std::string> arguments) {
    int in[2], out[2];
    if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    const int spawned = ::posix_spawn(&process_, words[0], &actions, nullptr, words.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(in[0]);
    ::close(out[1]);
    in_ = in[1];
    out_ = out[0];
    if (spawned != 0) throw std::runtime_error("posix_spawn " + arguments[0]);
    if (!has("ready")) throw std::runtime_error(arguments[0] + " does not begin");
  }
  ~Peer() {
    kill();
    ::close(in_);
    ::close(out_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  /// Sends a command and waits for its "done".
  void tell(const std::string& command) {
    send(command);
    const std::string word = command.substr(0, command.find(' '));
    if (!has("done " + word)) throw std::runtime_error("the peer does not do: " + command);
  }
  void send(const std::string& command) {
    const std::string line = command + "\n";
    if (::write(in_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) throw std::runtime_error("the peer is gone");
  }
  /// Whether a line comes in time; lines before it stay.
  bool has(const std::string& line, std::chrono::seconds limit = std::chrono::seconds(30)) {
    return eventually(
        [&] {
          read_lines();
          for (auto it = lines_.begin(); it != lines_.end(); ++it)
            if (*it == line) return lines_.erase(it), true;
          return false;
        },
        limit);
  }
  /// How many lines like this have come so far.
  std::size_t count(const std::string& line) {
    read_lines();
    std::size_t number = 0;
    for (const std::string& one : lines_) number += one == line ? 1 : 0;
    return number;
  }
  void kill() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
    process_ = -1;
  }
  void quit() {
    send("quit");
    if (process_ > 0) ::waitpid(process_, nullptr, 0);
    process_ = -1;
  }
  bool is_running() const noexcept { return process_ > 0 && ::waitpid(process_, nullptr, WNOHANG) == 0; }

 private:
  void read_lines() {
    pollfd waiting{out_, POLLIN, 0};
    while (::poll(&waiting, 1, 0) > 0) {
      char bytes[4096];
      const auto count = ::read(out_, bytes, sizeof bytes);
      if (count <= 0) return;
      input_.append(bytes, static_cast<std::size_t>(count));
      for (auto end = input_.find('\n'); end != std::string::npos; end = input_.find('\n')) {
        lines_.push_back(input_.substr(0, end));
        input_.erase(0, end + 1);
      }
    }
  }

  pid_t process_ = -1;
  int in_ = -1, out_ = -1;
  std::string input_;
  std::deque<std::string> lines_;
};

}  // namespace lrt::test
