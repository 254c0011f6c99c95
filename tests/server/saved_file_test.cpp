// SPDX-License-Identifier: Apache-2.0
#include "src/server/saved_file.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
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
  const auto found = SavedFile::load(path, 10'000'000).value();
  return found ? found->text : "(no file)";
}
std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
/// What a file of lrt with that text has in it.
std::string as_written(const std::string& text) {
  const Folder folder;
  { SavedFile(folder / "state", nullptr, nullptr).save(text, 1); }
  return bytes_of(folder / "state");
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

/// Whether another process gets the lock.
bool other_process_may_lock(const std::string& lock) {
  const pid_t child = ::fork();
  if (child == 0) {
    struct flock whole {};
    whole.l_type = F_WRLCK;
    ::_exit(::fcntl(::open(lock.c_str(), O_RDWR), F_SETLK, &whole) == 0 ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

TEST_CASE("what was saved last is what is read, for its owner only", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  Log log;
  {
    SavedFile file(path, nullptr, log.callback());
    for (int i = 0; i < 100; ++i) file.save("text " + std::to_string(i), static_cast<std::uint64_t>(i));
  }
  CHECK(content(path) == "text 99");
  CHECK(mode_of(path) == 0600);
  CHECK(names_in(folder) == std::vector<std::string>{"state"});
  CHECK(log.lines().empty());
  const std::string big(3'000'000, 'x');
  put(path, "old");
  ::chmod(path.c_str(), 0666);
  { SavedFile(path, nullptr, nullptr).save(big, 1); }
  CHECK(content(path) == big);
  CHECK(mode_of(path) == 0600);
  { SavedFile(path, nullptr, nullptr).save("", 1); }
  CHECK(content(path).empty());
}

TEST_CASE("a file that nothing was saved to is not touched", "[server][saved_file]") {
  const Folder folder;
  { const SavedFile file(folder / "state", nullptr, nullptr); }
  CHECK(names_in(folder).empty());
}

TEST_CASE("a reader finds one of the texts, whole, at any time", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  { SavedFile(path, nullptr, nullptr).save(std::string(200'000, 'z'), 0); }
  std::atomic<bool> done{false};
  std::atomic<int> torn{0};
  std::thread reader([&] {
    while (!done) {
      const auto text = SavedFile::load(path, 1'000'000);
      if (!text || !*text || (*text)->state != SavedFile::State::whole || (*text)->text.size() != 200'000) ++torn;
    }
  });
  {
    SavedFile file(path, nullptr, nullptr);
    for (int i = 0; i < 200; ++i) {
      file.save(std::string(200'000, static_cast<char>('a' + i % 26)), static_cast<std::uint64_t>(i));
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
    SavedFile file(path, nullptr, log.callback());
    file.save("new", 1);
    REQUIRE(log.wait_for(1));
    file.save("newer", 2);
  }
  CHECK(content(path) == "old");
  REQUIRE(log.lines().size() == 1);
  CHECK(log.lines()[0].find(path) != std::string::npos);
  // The obstacle gone, the text that waits is written with the next.
  SavedFile file(path, nullptr, log.callback());
  fs::remove_all(path + ".new");
  {
    SavedFile again(path, nullptr, log.callback());
    again.save("new", 3);
  }
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
  { SavedFile(path, nullptr, log.callback()).save(std::string(5000, 'x'), 1); }
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
      SavedFile file(path, nullptr, log.callback());
      file.save("x", 1);
      CHECK(log.wait_for(1));
    }
    CHECK(log.lines().size() == 1);
  }
  CHECK(content(folder / "file") == "text");
  SavedFile throwing(
      folder / "file/state", [](std::uint64_t, bool) { throw 1; }, [](LogLevel, std::string_view) { throw 1; });
  throwing.save("x", 1);
}

TEST_CASE("a leftover of an interrupted write is replaced, a link in its place is not followed and stays", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  put(path + ".new", as_written("a text that is half there").substr(0, 30));
  ::chmod((path + ".new").c_str(), 0666);
  { SavedFile(path, nullptr, nullptr).save("whole", 1); }
  CHECK(content(path) == "whole");
  CHECK(mode_of(path) == 0600);
  put(folder / "victim", "precious");
  fs::create_symlink(folder / "victim", path + ".new");
  { SavedFile(path, nullptr, nullptr).save("second", 1); }
  CHECK(content(path) == "whole");
  CHECK(content(folder / "victim") == "precious");
  CHECK(fs::is_symlink(path + ".new"));
}

TEST_CASE("a symbolic link stays, and what it leads to is replaced", "[server][saved_file]") {
  const Folder folder;
  fs::create_directory(folder / "disk");
  put(folder / "disk/real", "old");
  fs::create_symlink("disk/real", folder / "state");
  fs::create_symlink("disk/later", folder / "other");
  { SavedFile(folder / "state", nullptr, nullptr).save("new", 1); }
  { SavedFile(folder / "other", nullptr, nullptr).save("first", 1); }
  CHECK(fs::is_symlink(folder / "state"));
  CHECK(content(folder / "disk/real") == "new");
  CHECK(content(folder / "disk/later") == "first");
  fs::create_symlink("circle", folder / "circle");
  Log log;
  { SavedFile(folder / "circle", nullptr, log.callback()).save("x", 1); }
  CHECK(log.lines().size() <= 1);  // replaced, or logged
}

TEST_CASE("loading distinguishes a missing file, one that is whole, one that is damaged, and one of somebody else", "[server][saved_file]") {
  const Folder folder;
  put(folder / "file", "12345");
  CHECK_FALSE(SavedFile::load(folder / "missing", 10).value());
  CHECK(SavedFile::load(folder / "file", 5).value().value().text == "12345");
  CHECK(SavedFile::load(folder / "file", 5).value().value().state == SavedFile::State::unmarked);
  CHECK(SavedFile::load(folder / "file", 4).error().code == Errc::limit_exceeded);
  CHECK(SavedFile::load(folder / "file/below", 10).error().code == Errc::io_error);
  fs::create_directory(folder / "directory");
  CHECK_FALSE(SavedFile::load(folder / "directory", 10));
  REQUIRE(::mkfifo((folder / "fifo").c_str(), 0600) == 0);
  CHECK_FALSE(SavedFile::load(folder / "fifo", 10));

  const std::string whole = as_written("line 1\nline 2\n");
  const auto loaded = [&](const std::string& bytes) {
    put(folder / "state", bytes);
    return SavedFile::load(folder / "state", 1000).value().value();
  };
  CHECK(loaded(whole).state == SavedFile::State::whole);
  CHECK(loaded(whole).text == "line 1\nline 2\n");
  CHECK(loaded("\xEF\xBB\xBF" + whole).state == SavedFile::State::whole);
  CHECK(loaded("\xEF\xBB\xBF" + whole).text == "line 1\nline 2\n");
  CHECK(loaded("\xEF\xBB\xBF" + whole + "x").state == SavedFile::State::damaged);
  CHECK(loaded("\xEF\xBB\xBF").state == SavedFile::State::unmarked);
  CHECK(loaded("\xEF\xBB\xBFline 1").state == SavedFile::State::unmarked);
  CHECK(whole.compare(0, 6, "# lrt ") == 0);  // a comment in Turtle
  for (std::size_t size = 10; size < whole.size(); ++size) CHECK(loaded(whole.substr(0, size)).state == SavedFile::State::damaged);
  CHECK(loaded(whole + "x").state == SavedFile::State::damaged);
  CHECK(loaded(whole + std::string(1, '\0')).state == SavedFile::State::damaged);
  std::string flipped = whole;
  flipped[whole.size() - 4] ^= 1;
  CHECK(loaded(flipped).state == SavedFile::State::damaged);
  CHECK(loaded("").state == SavedFile::State::unmarked);
}

TEST_CASE("a copy of a damaged file is kept, and the one before it stays", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  put(path, "first");
  CHECK(SavedFile::keep_copy(path).value() == path + ".damaged-1");
  CHECK(content(path) == "first");  // until a new text replaces it
  { SavedFile(path, nullptr, nullptr).save("second", 1); }
  CHECK(SavedFile::keep_copy(path).value() == path + ".damaged-2");
  CHECK(content(path + ".damaged-1") == "first");
  CHECK(content(path + ".damaged-2") == "second");
  fs::create_symlink("state", folder / "link");
  CHECK(SavedFile::keep_copy(folder / "link").value().find("state.damaged-3") != std::string::npos);
  CHECK(fs::is_symlink(folder / "link"));
  fs::remove(path);
  CHECK(SavedFile::keep_copy(path).error().code == Errc::io_error);
}

TEST_CASE("only a file of lrt's, or nothing, may be where the file is to be", "[server][saved_file]") {
  const Folder folder;
  const auto refused = [&](const std::string& path) {
    const Result<SavedFile::Claim> prepared = SavedFile::prepare(path);
    INFO(path << ": " << (prepared ? "" : prepared.error().message));
    CHECK_FALSE(prepared);
    return prepared ? Error{} : prepared.error();
  };
  CHECK(SavedFile::prepare(folder / "state"));
  CHECK(names_in(folder) == std::vector<std::string>{"state.lock"});
  CHECK(mode_of(folder / "state.lock") == 0600);
  put(folder / "file", "text");
  CHECK(SavedFile::prepare(folder / "file"));  // what it is, load() says
  fs::create_directory(folder / "directory");
  CHECK(refused(folder / "directory").code == Errc::invalid_option);
  CHECK(refused(folder / "directory").message.find("a directory") != std::string::npos);
  CHECK(refused(folder / "directory/").code == Errc::invalid_option);
  CHECK(refused(folder / "new/").code == Errc::invalid_option);
  CHECK(refused("/dev/full").message.find("a device") != std::string::npos);
  CHECK(refused("/dev/null").message.find("a device") != std::string::npos);
  REQUIRE(::mkfifo((folder / "fifo").c_str(), 0600) == 0);
  CHECK(refused(folder / "fifo").message.find("a FIFO") != std::string::npos);
  CHECK(refused(folder / "file/state").code == Errc::io_error);
  fs::create_symlink("circle", folder / "circle");
  CHECK(refused(folder / "circle").code == Errc::io_error);
  fs::create_symlink("directory", folder / "to_directory");
  CHECK(refused(folder / "to_directory").code == Errc::invalid_option);
  fs::create_symlink("/dev/null", folder / "to_device");
  CHECK(refused(folder / "to_device").code == Errc::invalid_option);
  fs::create_symlink("later", folder / "dangling");
  CHECK(SavedFile::prepare(folder / "dangling"));
  const auto before = names_in(folder);
  // What stands beside it.
  put(folder / "state.new", "of another program");
  CHECK(refused(folder / "state").code == Errc::invalid_option);
  CHECK(content(folder / "state.new") == "of another program");
  put(folder / "state.new", "# lrt 1");
  CHECK(SavedFile::prepare(folder / "state"));
  put(folder / "state.new", "");
  CHECK(SavedFile::prepare(folder / "state"));
  fs::remove(folder / "state.new");
  CHECK(names_in(folder) == before);
}

TEST_CASE("a second process does not get the file, until the first one ends", "[server][saved_file]") {
  const Folder folder;
  const auto in_child = [&](bool holds) {
    int ready[2] = {}, go[2] = {};
    REQUIRE(::pipe(ready) == 0);
    REQUIRE(::pipe(go) == 0);
    const pid_t child = ::fork();
    if (child == 0) {
      const Result<SavedFile::Claim> claim = SavedFile::prepare(folder / "state");
      const char result = claim ? 'y' : 'n';
      char byte = 0;
      if (::write(ready[1], &result, 1) != 1) ::_exit(1);
      if (holds && ::read(go[0], &byte, 1) < 0) ::_exit(1);
      ::_exit(0);
    }
    char result = 0;
    REQUIRE(::read(ready[0], &result, 1) == 1);
    const Result<SavedFile::Claim> meanwhile = SavedFile::prepare(folder / "state");
    CHECK((result == 'y') == holds);
    if (holds) CHECK(meanwhile.error().code == Errc::io_error);
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    for (const int end : {ready[0], ready[1], go[0], go[1]}) ::close(end);
  };
  in_child(true);
  const Result<SavedFile::Claim> claim = SavedFile::prepare(folder / "state");
  REQUIRE(claim);
  in_child(false);
}

TEST_CASE("one process gets a file once, by whatever name, until it gives it back", "[server][saved_file]") {
  const Folder folder;
  fs::create_directory_symlink(folder.path(), folder / "same");
  {
    const Result<SavedFile::Claim> claim = SavedFile::prepare(folder / "state");
    REQUIRE(claim);
    for (const char* name : {"state", "./state", "same/state", "same/./state"}) {
      CAPTURE(name);
      const Result<SavedFile::Claim> second = SavedFile::prepare(folder / name);
      REQUIRE_FALSE(second);
      CHECK(second.error().code == Errc::invalid_option);
    }
    CHECK(SavedFile::prepare(folder / "other"));
  }
  SavedFile::Claim moved;
  {
    Result<SavedFile::Claim> claim = SavedFile::prepare(folder / "state");
    REQUIRE(claim);
    moved = *std::move(claim);
  }
  CHECK_FALSE(SavedFile::prepare(folder / "state"));
  moved = SavedFile::Claim();
  CHECK(SavedFile::prepare(folder / "state"));
}

TEST_CASE("a file whose directory was deleted and made again has one writer", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state/file";
  const bool another_comes = GENERATE(false, true);
  CAPTURE(another_comes);
  Result<SavedFile::Claim> claim = SavedFile::prepare(path);
  REQUIRE(claim);
  Log log;
  std::atomic<std::uint64_t> written{0}, refused{0};
  {
    SavedFile file(
        path, [&](std::uint64_t revision, bool is_written) { (is_written ? written : refused) = revision; }, log.callback(), {}, *std::move(claim));
    const auto save = [&](const std::string& text, std::uint64_t revision) {
      file.save(text, revision);
      for (int i = 0; i < 60'000 && written < revision && refused < revision; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
    save("1", 1);
    CHECK(content(path) == "1");
    fs::remove_all(folder / "state");
    save("2", 2);  // the directory is made again
    CHECK(content(path) == "2");
    CHECK_FALSE(other_process_may_lock(path + ".lock"));
    fs::remove_all(folder / "state");
    fs::create_directory(folder / "state");
    if (another_comes) {
      const Result<SavedFile::Claim> other = SavedFile::prepare(path);
      REQUIRE(other);
      { SavedFile(path, nullptr, nullptr).save("of another", 1); }
      save("3", 3);
      CHECK(refused == 3);
      CHECK(content(path) == "of another");
      REQUIRE(log.lines().size() == 1);
      CHECK(log.lines()[0].find(path + ".lock") != std::string::npos);
    }
    save("4", 4);  // the other one has ended
    CHECK(written == 4);
    CHECK_FALSE(other_process_may_lock(path + ".lock"));
    CHECK_FALSE(SavedFile::prepare(path));
  }
  CHECK(content(path) == "4");
  CHECK(fs::exists(path + ".damaged-1") == another_comes);
  if (another_comes) CHECK(content(path + ".damaged-1") == "of another");
  CHECK(SavedFile::prepare(path));
}

TEST_CASE("closing another descriptor of the lock does not give the file to another process", "[server][saved_file]") {
  const Folder folder;
  const Result<SavedFile::Claim> claim = SavedFile::prepare(folder / "state");
  REQUIRE(claim);
  CHECK(bytes_of(folder / "state.lock").empty());  // opens and closes it
  CHECK_FALSE(other_process_may_lock(folder / "state.lock"));
}

TEST_CASE("a text that cannot be made is logged with the reason", "[server][saved_file]") {
  const Folder folder;
  Log log;
  {
    SavedFile file(folder / "state", nullptr, log.callback());
    file.save([]() -> std::string { throw BadResult({Errc::expected_rdf, "expected a language tag"}); }, 1);
    REQUIRE(log.wait_for(1));
  }
  CHECK(log.lines().front().find("expected a language tag") != std::string::npos);
  CHECK(log.lines().front().find("memory") == std::string::npos);
}

TEST_CASE("a file that was cut within its first word is a damaged one", "[server][saved_file]") {
  const Folder folder;
  const std::string whole = as_written("text");
  const auto state_of = [&](const std::string& bytes) {
    put(folder / "state", bytes);
    return SavedFile::load(folder / "state", 1000).value()->state;
  };
  for (const std::size_t size : {1, 5, 8, 9, 20}) CHECK(state_of(whole.substr(0, size)) == SavedFile::State::damaged);
  CHECK(state_of("") == SavedFile::State::unmarked);
  CHECK(state_of("# lxt") == SavedFile::State::unmarked);
}

TEST_CASE("directories that are missing are made for their owner only", "[server][saved_file]") {
  const Folder folder;
  REQUIRE(SavedFile::prepare(folder / "a/b/state"));
  CHECK(mode_of(folder / "a") == 0700);
  CHECK(mode_of(folder / "a/b") == 0700);
  { SavedFile(folder / "a/b/state", nullptr, nullptr).save("x", 1); }
  CHECK(mode_of(folder / "a/b/state") == 0600);
  CHECK(SavedFile::prepare(folder / "c/../d/state"));
  CHECK(mode_of(folder / "d") == 0700);
  fs::create_symlink("nowhere", folder / "dangling");
  CHECK(SavedFile::prepare(folder / "dangling/state").error().code == Errc::io_error);
  CHECK(SavedFile::prepare(folder / "dangling/a/state").error().code == Errc::io_error);
  fs::create_symlink("later/state", folder / "link");
  REQUIRE(SavedFile::prepare(folder / "link"));
  CHECK(mode_of(folder / "later") == 0700);
}

TEST_CASE("a directory that may not be written is an error at the start", "[server][saved_file]") {
  const Folder folder;
  fs::create_directory(folder / "closed");
  ::chmod(folder.path().c_str(), 0755);
  ::chmod((folder / "closed").c_str(), 0500);
  const bool is_root = ::geteuid() == 0;
  if (is_root) REQUIRE(::seteuid(65534) == 0);  // root may write everywhere
  const Result<SavedFile::Claim> prepared = SavedFile::prepare(folder / "closed/state");
  const Result<SavedFile::Claim> below = SavedFile::prepare(folder / "closed/new/state");
  if (is_root) REQUIRE(::seteuid(0) == 0);
  CHECK(prepared.error().code == Errc::io_error);
  CHECK(below.error().code == Errc::io_error);
}

TEST_CASE("what came into the place of the file meanwhile is not replaced", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  put(folder / "other.new", "of another program");
  Log log;
  {
    SavedFile fifo(path, nullptr, log.callback()), other(folder / "other", nullptr, log.callback());
    fifo.save("x", 1);
    other.save("x", 1);
    REQUIRE(log.wait_for(2));
  }
  CHECK(fs::is_fifo(path));
  CHECK(content(folder / "other.new") == "of another program");
  CHECK(names_in(folder) == std::vector<std::string>{"other.new", "state"});
}

TEST_CASE("each revision is reported when it is on the disk, several together, and a failure as such", "[server][saved_file]") {
  const Folder folder;
  const std::string path = folder / "state";
  std::mutex mutex;
  std::vector<std::pair<std::uint64_t, bool>> reports;
  bool all_there = true;
  const auto report = [&](std::uint64_t revision, bool written) {
    const std::string there = content(path);
    const std::lock_guard lock(mutex);
    reports.emplace_back(revision, written);
    all_there = all_there && (!written || std::stoull(there) >= revision);
  };
  {
    SavedFile file(path, report, nullptr);
    for (std::uint64_t n = 1; n <= 1000; ++n) file.save(std::to_string(n), n);
  }
  REQUIRE_FALSE(reports.empty());
  CHECK(reports.back() == std::pair<std::uint64_t, bool>(1000, true));
  CHECK(reports.size() < 1000);
  CHECK(all_there);
  CHECK(std::is_sorted(reports.begin(), reports.end()));
  reports.clear();
  fs::create_directories(path + ".new/full");
  { SavedFile(path, report, nullptr).save("1001", 1001); }
  // The end tries once more what had failed before it.
  REQUIRE((reports.size() == 1 || reports.size() == 2));
  for (const auto& report_of_failure : reports) CHECK(report_of_failure == std::pair<std::uint64_t, bool>(1001, false));
}
