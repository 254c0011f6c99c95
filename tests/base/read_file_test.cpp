// SPDX-License-Identifier: Apache-2.0
#include "src/base/read_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

using namespace lrt;
using namespace lrt::test;
namespace fs = std::filesystem;

TEST_CASE("a file is read whole, or a little more than the limit", "[base]") {
  const Folder folder;
  const std::string path = folder / "file";
  std::ofstream(path) << std::string(100'000, 'a');
  CHECK(read_file(path, 1'000'000).value() == std::string(100'000, 'a'));
  const std::size_t size = read_file(path, 10).value().size();
  CHECK(size > 10);
  CHECK(size < 50'000);
  std::ofstream(folder / "empty").flush();
  CHECK(read_file(folder / "empty", 10).value().empty());
}

TEST_CASE("what cannot be read is an error with its name", "[base]") {
  CHECK(read_file("/nowhere/file", 10).error().message == "/nowhere/file: No such file or directory");
  CHECK(read_file("/proc", 10).error().message == "/proc: Is a directory");
}

TEST_CASE("a file that is being read is close-on-exec", "[base]") {
  const Folder folder;
  const std::string path = folder / "fifo";
  REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  Result<std::string> text = std::string();
  std::thread reader([&] { text = read_file(path, 10); });
  const int writer = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);  // waits until the reader has opened its end
  int seen = 0, inherited = 0;
  while (seen < 2) {  // both ends; the reader's waits for bytes
    seen = inherited = 0;
    for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
      std::error_code gone;
      if (fs::read_symlink(entry.path(), gone) != path) continue;
      ++seen;
      inherited += (::fcntl(std::atoi(entry.path().filename().c_str()), F_GETFD) & FD_CLOEXEC) == 0 ? 1 : 0;
    }
  }
  CHECK(inherited == 0);
  CHECK(::write(writer, "text", 4) == 4);
  ::close(writer);
  reader.join();
  CHECK(text.value() == "text");
}
