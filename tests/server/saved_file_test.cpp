#include "src/server/saved_file.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

using namespace lrt;
using namespace lrt::test;
namespace fs = std::filesystem;

namespace {

std::vector<std::string> names_in(const Folder& folder) {
  std::vector<std::string> result;
  for (const auto& entry : fs::directory_iterator(folder.path())) result.push_back(entry.path().filename());
  std::sort(result.begin(), result.end());
  return result;
}

std::string content(const std::string& path) {
  const auto text = SavedFile::load(path, 10'000'000).value();
  return text ? *text : "(no file)";
}
void put(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

class Log {
 public:
  LogCallback callback() {
    return [this](LogLevel, std::string_view text) {
      const std::lock_guard lock(mutex_);
      lines_.emplace_back(text);
    };
  }
  std::vector<std::string> lines() const {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  /// Until there are `n`, at most twenty seconds.
  bool wait_for(std::size_t n) const {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (lines().size() < n) {
      if (std::chrono::steady_clock::now() > until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

mode_t mode_of(const std::string& path) {
  struct stat about {};
  return ::stat(path.c_str(), &about) == 0 ? about.st_mode & 07777U : 0;
}

}  // namespace

TEST_CASE("what was saved last is what is read, for its owner only", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  Log log;
  {
    SavedFile file(path, log.callback());
    for (int i = 0; i < 100; ++i) file.save("text " + std::to_string(i));
  }
  CHECK(content(path) == "text 99");
  CHECK(mode_of(path) == 0600);
  CHECK(names_in(folder) == std::vector<std::string>{"state"});
  CHECK(log.lines().empty());
  const std::string big(3'000'000, 'x');
  put(path, "old");
  ::chmod(path.c_str(), 0666);
  { SavedFile(path, nullptr).save(big); }
  CHECK(content(path) == big);
  CHECK(mode_of(path) == 0600);
  { SavedFile(path, nullptr).save(""); }
  CHECK(content(path).empty());
}

TEST_CASE("a file that nothing was saved to is not touched", "[server][saved_file]") {
  const Folder folder;
  { const SavedFile file(folder / "state", nullptr); }
  CHECK(names_in(folder).empty());
}

TEST_CASE("a reader finds one of the texts, whole, at any time", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  put(path, std::string(200'000, 'z'));
  std::atomic<bool> done{false};
  std::atomic<int> torn{0};
  std::thread reader([&] {
    while (!done) {
      const auto text = SavedFile::load(path, 1'000'000);
      if (!text || !*text || (*text)->size() != 200'000 || (*text)->find_first_not_of((**text)[0]) != std::string::npos) ++torn;
    }
  });
  {
    SavedFile file(path, nullptr);
    for (int i = 0; i < 200; ++i) {
      file.save(std::string(200'000, static_cast<char>('a' + i % 26)));
      std::this_thread::yield();
    }
  }
  done = true;
  reader.join();
  CHECK(torn == 0);
}

TEST_CASE("a text that cannot be written leaves the old one in its place, and is logged once", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  put(path, "old");
  fs::create_directories(path + ".new/full");  // an obstacle that stops root too
  Log log;
  {
    SavedFile file(path, log.callback());
    file.save("new");
    REQUIRE(log.wait_for(1));
    file.save("newer");
  }
  CHECK(content(path) == "old");
  REQUIRE(log.lines().size() == 1);
  CHECK(log.lines()[0].find(path) != std::string::npos);
  // The obstacle gone, the text that waits is written with the next.
  SavedFile file(path, log.callback());
  fs::remove_all(path + ".new");
  { SavedFile again(path, log.callback()); again.save("new"); }
  CHECK(content(path) == "new");
}

TEST_CASE("a full disk leaves the old text", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  put(path, "old");
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  rlimit small = before;
  small.rlim_cur = 1000;
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &small) == 0);  // exceeding it would raise SIGXFSZ and end this program
  Log log;
  { SavedFile(path, log.callback()).save(std::string(5000, 'x')); }
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
  CHECK(content(path) == "old");
  CHECK(log.lines().size() == 1);
  CHECK(names_in(folder) == std::vector<std::string>{"state"});
}

TEST_CASE("places where no file can be are errors, not exceptions", "[server][saved_file]") {
  const Folder folder;
  put(folder / "file", "text");
  fs::create_directories(folder / "directory/full");
  for (const std::string& path : {folder / "file/state", folder / "missing/state", folder / "directory"}) {
    INFO(path);
    Log log;
    {
      SavedFile file(path, log.callback());
      file.save("x");
      CHECK(log.wait_for(1));
    }
    CHECK(log.lines().size() == 1);
  }
  CHECK(content(folder / "file") == "text");
  SavedFile throwing(folder / "file/state", [](LogLevel, std::string_view) { throw 1; });
  throwing.save("x");
}

TEST_CASE("a leftover of an interrupted write is replaced, a link in its place not followed", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  put(path + ".new", "half of");
  ::chmod((path + ".new").c_str(), 0666);
  { SavedFile(path, nullptr).save("whole"); }
  CHECK(content(path) == "whole");
  CHECK(mode_of(path) == 0600);
  put(folder / "victim", "precious");
  fs::create_symlink(folder / "victim", path + ".new");
  { SavedFile(path, nullptr).save("second"); }
  CHECK(content(path) == "second");
  CHECK(content(folder / "victim") == "precious");
}

TEST_CASE("a symbolic link stays, and what it leads to is replaced", "[server][saved_file]") {
  const Folder folder;
  fs::create_directory(folder / "disk");
  put(folder / "disk/real", "old");
  fs::create_symlink("disk/real", folder / "state");
  fs::create_symlink("disk/later", folder / "other");
  { SavedFile(folder / "state", nullptr).save("new"); }
  { SavedFile(folder / "other", nullptr).save("first"); }
  CHECK(fs::is_symlink(folder / "state"));
  CHECK(content(folder / "disk/real") == "new");
  CHECK(content(folder / "disk/later") == "first");
  fs::create_symlink("circle", folder / "circle");
  Log log;
  { SavedFile(folder / "circle", log.callback()).save("x"); }
  CHECK(log.lines().size() <= 1);  // replaced, or logged
}

TEST_CASE("loading distinguishes a missing file from an unreadable one", "[server][saved_file]") {
  const Folder folder;
  put(folder / "file", "12345");
  CHECK(SavedFile::load(folder / "missing", 10).value() == std::nullopt);
  CHECK(SavedFile::load(folder / "file", 5).value() == "12345");
  CHECK(SavedFile::load(folder / "file", 4).error().code == Errc::limit_exceeded);
  CHECK(SavedFile::load(folder / "file/below", 10).error().code == Errc::io_error);
  fs::create_directory(folder / "directory");
  CHECK(SavedFile::load(folder / "directory", 10).error().code == Errc::io_error);
  REQUIRE(::mkfifo((folder / "fifo").c_str(), 0600) == 0);
  CHECK(SavedFile::load(folder / "fifo", 10).error().code == Errc::io_error);
}

TEST_CASE("a damaged file is set aside, and the one before it stays", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  put(path, "first");
  CHECK(SavedFile::set_aside(path).value() == path + ".damaged-1");
  put(path, "second");
  CHECK(SavedFile::set_aside(path).value() == path + ".damaged-2");
  CHECK(content(path + ".damaged-1") == "first");
  CHECK(content(path + ".damaged-2") == "second");
  CHECK_FALSE(fs::exists(path));
  CHECK(SavedFile::set_aside(path).error().code == Errc::io_error);
}
