// SPDX-License-Identifier: Apache-2.0
#include <lrt/security/audit_file.hpp>

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include <lrt/lrt.hpp>
#include <lrt/served.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/transport/loopback.hpp>

#include "src/server/audit_file.hpp"
#include "src/server/audit_output.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace std::chrono_literals;
using Json = nlohmann::json;
using security::audit_file;
using security::AuditFileOptions;
namespace fs = std::filesystem;

namespace {

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
void put(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
mode_t mode_of(const std::string& path) {
  struct stat about {};
  REQUIRE(::lstat(path.c_str(), &about) == 0);
  return about.st_mode & 07777;
}
/// Each line, which must be JSON and have its end.
std::vector<Json> lines_of(const std::string& path) {
  std::vector<Json> lines;
  const std::string bytes = bytes_of(path);
  for (std::size_t begin = 0; begin < bytes.size();) {
    const std::size_t end = bytes.find('\n', begin);
    REQUIRE(end != std::string::npos);
    CAPTURE(bytes.substr(begin, end - begin));
    lines.push_back(Json::parse(bytes.substr(begin, end - begin)));
    begin = end + 1;
  }
  return lines;
}
void wait_until(const std::function<bool()>& is_true) {
  for (const auto end = std::chrono::steady_clock::now() + 60s; !is_true(); std::this_thread::sleep_for(1ms))
    if (std::chrono::steady_clock::now() > end) throw std::runtime_error("not within a minute");
}

/// A file as a server writes it.
class Written {
 public:
  explicit Written(const std::string& path, AuditFileOptions options = {}, std::size_t max_waiting_bytes = 4 * 1024 * 1024) {
    audit_.file = audit_file(path, options).value();
    audit_.max_waiting_bytes = max_waiting_bytes;
    audit_.max_waiting_lines = 1'000'000;
    writer_.emplace(
        audit_, system_clock(), [this](LogLevel, std::string_view text) { log += std::string(text) + "\n"; },
        [this](std::uint64_t line, bool saved) {
          if (line != 0) (saved ? saved_ : unsaved_) = line;
        });
    writer_->claim().value();
    thread_ = std::thread([this] { writer_->run(); });
  }
  ~Written() { stop(); }
  void stop() {
    writer_->stop();
    if (thread_.joinable()) thread_.join();
  }
  std::uint64_t add(const std::string& text) {
    const std::uint64_t number = writer_->write(R"({"event":"request","text":")" + text + "\"}");
    newest_ = number == 0 ? newest_ : number;
    return number;
  }
  /// Waits until all lines are in the file.
  void finish() {
    wait_until([&] { return saved_ >= newest_ || unsaved_ >= newest_; });
  }
  security::AuditFile& file() { return *audit_.file; }
  AuditFileWriter& writer() { return *writer_; }

  std::string log;  ///< after stop()

 private:
  security::Audit audit_;
  std::atomic<std::uint64_t> saved_{0}, unsaved_{0};
  std::uint64_t newest_ = 0;
  std::optional<AuditFileWriter> writer_;
  std::thread thread_;
};

/// A disk on which no file may become larger.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    REQUIRE(::getrlimit(RLIMIT_FSIZE, &before_) == 0);
    rlimit small = before_;
    small.rlim_cur = bytes;
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &small) == 0);
  }
  ~SmallDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

}  // namespace

TEST_CASE("an audit file has each line, for its owner only, and goes on where it ended", "[server][security]") {
  const Folder folder;
  const std::string path = folder / "log/robot/audit.jsonl";
  for (int run = 0; run < 2; ++run) {
    Written audit(path);
    for (int i = 0; i < 1000; ++i) audit.add(std::to_string(run * 1000 + i));
  }
  const std::vector<Json> lines = lines_of(path);
  REQUIRE(lines.size() == 2000);
  for (std::size_t i = 0; i < lines.size(); ++i) CHECK(lines[i]["text"] == std::to_string(i));
  CHECK(mode_of(path) == 0600);
  CHECK(mode_of(folder / "log") == 0700);
  ::chmod(path.c_str(), 0666);
  REQUIRE(audit_file(path));
  CHECK(mode_of(path) == 0600);
}

TEST_CASE("only a file with lines of an audit, or nothing, may be where the audit is to be", "[server][security]") {
  const Folder folder;
  put(folder / "empty", "");
  put(folder / "ours", R"({"time":"now"})"
                       "\n");
  put(folder / "torn", "{");
  for (const char* name : {"empty", "ours", "torn", "new"}) CHECK(audit_file(folder / name));
  put(folder / "text", "a text\n");
  put(folder / "array", "[]\n");
  put(folder / "object", "{ not ours }\n");
  put(folder / "zeros", std::string(100, '\0'));
  fs::create_directory(folder / "directory");
  fs::create_symlink(folder / "ours", folder / "link");
  fs::create_symlink(folder / "nowhere", folder / "dangling");
  REQUIRE(::mkfifo((folder / "fifo").c_str(), 0600) == 0);
  for (const char* name : {"text", "array", "object", "zeros", "directory", "link", "dangling", "fifo"}) {
    CAPTURE(name);
    const std::string before = std::string(name) == "fifo" || std::string(name) == "directory" ? "" : bytes_of(folder / name);
    const auto file = audit_file(folder / name);
    REQUIRE_FALSE(file);
    CHECK(file.error().code == Errc::invalid_option);
    CHECK(file.error().message.find(folder / name) != std::string::npos);
    if (!before.empty()) CHECK(bytes_of(folder / name) == before);
  }
  CHECK_FALSE(fs::exists(folder / "nowhere"));
  CHECK(audit_file(folder / "text/below").error().code == Errc::io_error);
  for (const char* path : {"", "a/"}) CHECK(audit_file(path).error().code == Errc::invalid_option);
  const auto wrong = [&](AuditFileOptions options) { return audit_file(folder / "new", options).error().code == Errc::invalid_option; };
  AuditFileOptions options;
  options.sync_interval = 9ms;
  CHECK(wrong(options));
  options = {};
  options.max_bytes = 1;
  CHECK(wrong(options));
  options = {};
  options.kept_files = 0;
  CHECK(wrong(options));
}

TEST_CASE("a line that a crash has torn is ended, and its text is kept", "[server][security]") {
  const std::string whole = R"({"event":"request","text":"1 \"}\\"})";
  struct Case {
    std::string begin, torn;
    bool is_whole;
  };
  const std::string nul(3, '\0');
  for (const auto& [begin, torn, is_whole] :
       {Case{whole + "\n", R"({"event":"requ)", false}, Case{"", R"({"event":"x","text":"a}")", false}, Case{"", R"({"event":"x","text":"a})", false},
        Case{whole + "\n", "{", false}, Case{whole + "\n", nul, false}, Case{whole + "\n", "{\"text\":\"\xC3", false}, Case{"", whole, true},
        Case{whole + "\n", whole, true}}) {
    CAPTURE(begin, torn);
    const Folder folder;
    put(folder / "audit", begin + torn);
    {
      Written audit(folder / "audit");
      audit.add("next");
    }
    const std::vector<Json> lines = lines_of(folder / "audit");
    const std::size_t before = begin.empty() ? 0 : 1;
    REQUIRE(lines.size() == before + 2);
    if (is_whole) CHECK(lines[before] == Json::parse(whole));
    else CHECK(lines[before]["event"] == "torn");
    if (!is_whole && torn.find('\xC3') == std::string::npos) CHECK(lines[before]["text"] == torn);
    CHECK(lines[before + 1]["text"] == "next");
  }
}

TEST_CASE("a file of an audit that was renamed, removed, or lost its directory is made again", "[server][security]") {
  const Folder folder;
  const std::string path = folder / "log/audit";
  Written audit(path);
  audit.add("1");
  audit.finish();
  fs::rename(path, path + ".old");
  audit.add("2");
  audit.finish();
  CHECK(lines_of(path + ".old").size() == 1);
  CHECK(lines_of(path)[0]["text"] == "2");
  fs::remove(path);
  audit.add("3");
  audit.finish();
  CHECK(lines_of(path)[0]["text"] == "3");
  fs::remove_all(folder / "log");
  audit.add("4");
  audit.finish();
  CHECK(lines_of(path)[0]["text"] == "4");
  fs::remove_all(folder / "log");
  fs::create_directory(folder / "log");
  audit.add("5");
  audit.finish();
  CHECK(lines_of(path)[0]["text"] == "5");
  // What is no audit is not written to. The open file stays in use while it has a name.
  fs::rename(path, path + ".old");
  fs::create_symlink(folder / "elsewhere", path);
  audit.add("6");
  audit.finish();
  CHECK_FALSE(fs::exists(folder / "elsewhere"));
  CHECK(lines_of(path + ".old").size() == 2);
  CHECK(audit.file().counters().errors > 0);
  CHECK(audit.file().counters().newest_error.find("a symbolic link") != std::string::npos);
  fs::remove(path);
  audit.add("7");
  audit.finish();
  CHECK(lines_of(path)[0]["text"] == "7");
  CHECK(audit.file().counters().written == 7);
}

TEST_CASE("reopen() makes a new file at once, also from the handler of a signal", "[server][security]") {
  const Folder folder;
  const std::string path = folder / "audit";
  Written audit(path);
  audit.add("1");
  audit.finish();
  fs::rename(path, path + ".1");
  static security::AuditFile* in_handler = nullptr;
  in_handler = &audit.file();
  auto* const before = std::signal(SIGHUP, [](int) { in_handler->reopen(); });
  REQUIRE(std::raise(SIGHUP) == 0);
  std::signal(SIGHUP, before);
  wait_until([&] { return fs::exists(path); });  // without a line
  audit.add("2");
  audit.finish();
  CHECK(lines_of(path + ".1").size() == 1);
  CHECK(lines_of(path).size() == 1);
}

TEST_CASE("several writers of one audit file neither mix nor lose lines, while it is renamed at its size", "[server][security]") {
  const Folder folder;
  const std::string path = folder / "audit";
  AuditFileOptions options;
  options.max_bytes = 64 * 1024;
  options.kept_files = 100;
  constexpr int writers = 3, each = 2000;
  std::vector<std::thread> threads;
  for (int w = 0; w < writers; ++w)
    threads.emplace_back([&, w] {
      Written audit(path, options);
      for (int i = 0; i < each; ++i) {
        audit.add(std::to_string(w) + " " + std::to_string(i) + std::string(100, 'x'));
        if (i % 50 == 0) audit.finish();
      }
    });
  for (std::thread& thread : threads) thread.join();
  std::vector<int> next(writers, 0);
  std::size_t files = 0;
  for (std::size_t n = 100;; --n) {  // the oldest first
    const std::string one = n == 0 ? path : path + "." + std::to_string(n);
    if (fs::exists(one)) {
      ++files;
      CHECK(fs::file_size(one) <= options.max_bytes);
      for (const Json& line : lines_of(one)) {
        const std::string text = line["text"];
        int& i = next.at(static_cast<std::size_t>(text[0] - '0'));
        CHECK(text.substr(2) == std::to_string(i) + std::string(100, 'x'));
        ++i;
      }
    }
    if (n == 0) break;
  }
  CHECK(next == std::vector<int>(writers, each));
  CHECK(files > 5);
}

TEST_CASE("only the newest of the renamed files are kept", "[server][security]") {
  const Folder folder;
  AuditFileOptions options;
  options.max_bytes = 64 * 1024;
  options.kept_files = 2;
  {
    Written audit(folder / "audit", options);
    for (int i = 0; i < 6; ++i) {
      audit.add(std::to_string(i) + std::string(40'000, 'x'));
      audit.finish();
    }
  }
  CHECK(lines_of(folder / "audit")[0]["text"].get<std::string>()[0] == '5');
  CHECK(lines_of(folder / "audit.1")[0]["text"].get<std::string>()[0] == '4');
  CHECK(lines_of(folder / "audit.2")[0]["text"].get<std::string>()[0] == '3');
  CHECK_FALSE(fs::exists(folder / "audit.3"));
}

TEST_CASE("an audit on a full disk goes on when there is space again, and says what it lost", "[server][security]") {
  const Folder folder;
  const std::string path = folder / "audit";
  constexpr std::size_t max_waiting = 64 * 1024;
  Written audit(path, {}, max_waiting);
  audit.add("before");
  audit.finish();
  std::size_t accepted = 0, refused = 0;
  {
    const SmallDisk disk(1000);
    for (int i = 0; i < 2000; ++i) ++(audit.add(std::to_string(i) + std::string(50, 'x')) != 0 ? accepted : refused);
    wait_until([&] { return audit.file().counters().errors > 0; });
    CHECK(audit.writer().waiting() > 0);
  }
  CHECK(refused > 0);
  CHECK(audit.writer().dropped() == refused);
  audit.finish();
  audit.add("after");
  audit.finish();
  wait_until([&] { return bytes_of(path).find("\"lost\"") != std::string::npos; });
  const std::vector<Json> lines = lines_of(path);
  std::size_t found = 0, lost = 0;
  for (const Json& line : lines) {
    if (line["event"] != "lost") {
      ++found;
      continue;
    }
    lost += line["count"].get<std::size_t>();
    CHECK(line["from"] <= line["to"]);
    CHECK(line["to"] <= line["time"]);
    CHECK(line["reason"].get<std::string>().find("writing \"" + path + "\"") != std::string::npos);
  }
  CHECK(found == accepted + 2);
  CHECK(lost == refused);
  audit.stop();
  CHECK(audit.log.find("the audit waits in memory") == audit.log.rfind("the audit waits in memory"));
}

TEST_CASE("lines of an audit that the disk refuses until the server stops are counted", "[server][security]") {
  const Folder folder;
  const SmallDisk disk(10);
  Written audit(folder / "audit");
  for (int i = 0; i < 10; ++i) audit.add("x");
  audit.stop();
  CHECK(audit.writer().dropped() == 10);
  CHECK(audit.log.find("10 lines of the audit are lost") != std::string::npos);
  CHECK(bytes_of(folder / "audit").empty());  // and no part of a line
}

// ---------------------------------------------------------------------------------------------------------- With a server

namespace {

const AuditFileOptions waits = [] {
  AuditFileOptions options;
  options.respond_when_saved = true;
  return options;
}();

/// A robot whose responses wait for the audit.
struct Audited {
  explicit Audited(const std::function<void(Options&)>& change = {}) {
    Options options;
    options.listen.port = 0;
    options.listen.transport = transport::no_network;
    options.threads.dispatch = Dispatch::io_thread;
    options.clock = &clock;
    if (change) change(options);
    server.emplace(Server::create(std::move(options)).value());
    server->add(robot.arm()).value();
  }
  ~Audited() { server.reset(); }
  http::Response ask(const std::string& text) {
    const std::size_t body = text.find("\n\n");
    RequestText request(text.substr(0, body) + "\nHost: localhost:4711" + (body == std::string::npos ? "" : text.substr(body)));
    request.get().local_port = 4711;
    return server->serve(request.get()).response;
  }

  FakeClock clock;
  SampleRobot robot;
  std::optional<Server> server;
};

/// Its first write does not return until go_on(), as on a disk that hangs.
class HangingFile final : public OpenAuditFile {
 public:
  explicit HangingFile(const std::shared_ptr<security::AuditFile>& file) : file_(std::static_pointer_cast<OpenAuditFile>(file)) {}
  bool hangs() {
    const std::lock_guard lock(mutex_);
    return hangs_;
  }
  void go_on() {
    const std::lock_guard lock(mutex_);
    may_go_on_ = true;
    changed_.notify_all();
  }

  void reopen() noexcept override { file_->reopen(); }
  security::AuditFileCounters counters() const override { return file_->counters(); }
  bool claim() noexcept override { return file_->claim(); }
  void release() noexcept override { file_->release(); }
  std::chrono::milliseconds tend() override { return file_->tend(); }
  void wake() noexcept override { file_->wake(); }
  void wait(std::chrono::milliseconds time) noexcept override { file_->wait(time); }
  Appended append(const std::vector<std::string_view>& lines) override {
    {
      std::unique_lock lock(mutex_);
      hangs_ = true;
      changed_.wait_for(lock, 2min, [this] { return may_go_on_; });
      hangs_ = false;
    }
    return file_->append(lines);
  }

 private:
  std::unique_ptr<Output> make_output(const Place& place) override { return place.output_to(*file_); }

  const std::shared_ptr<OpenAuditFile> file_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool hangs_ = false, may_go_on_ = false;
};

const std::string put_5 = "PUT /arm/angle\nContent-Type: application/json\n\n5";

}  // namespace

TEST_CASE("with respond_when_saved a response is sent when the line is in the file", "[server][security]") {
  const Folder folder;
  Audited g([&](Options& options) {
    AuditFileOptions file = waits;
    file.sync = AuditFileOptions::Sync::each_line;
    options.security.audit.file = audit_file(folder / "audit", file).value();
  });
  for (std::size_t i = 1; i <= 20; ++i) {
    CHECK(g.ask(put_5).status == 204);
    REQUIRE(lines_of(folder / "audit").size() == i);
  }
  CHECK(g.ask("POST /arm/actions/turn\nContent-Type: application/json\n\n5").status == 204);  // deferred by the engine
  CHECK(lines_of(folder / "audit").size() == 21);
  CHECK(g.ask("GET /arm/angle").status == 200);
  CHECK(prometheus_text(g.server->counters()).find("lrt_audit_file_errors_total 0\n") != std::string::npos);
}

TEST_CASE("with respond_when_saved only what was acknowledged waits for the file", "[server][security]") {
  const Folder folder;
  const auto file = audit_file(folder / "audit", waits).value();
  Audited g([&](Options& options) {
    options.limits.host_timeout = std::chrono::minutes(10);
    options.security.audit.file = file;
  });
  std::future<int> response;
  {
    const SmallDisk disk(10);
    response = std::async(std::launch::async, [&] { return g.ask(put_5).status; });
    wait_until([&] { return file->counters().errors > 0; });
    CHECK(g.ask("GET /arm/angle").status == 200);
    CHECK(g.ask("PUT /nothing\n\n5").status == 404);
    CHECK(response.wait_for(0s) == std::future_status::timeout);
  }
  CHECK(response.get() == 204);
  CHECK(lines_of(folder / "audit").size() == 2);
}

TEST_CASE("with respond_when_saved the response is 503 if the line cannot be saved", "[server][security]") {
  const Folder folder;
  const auto file = audit_file(folder / "audit", waits).value();
  Audited g([&](Options& options) { options.security.audit.file = file; });
  {
    const SmallDisk disk(10);
    std::atomic<bool> over{false};
    auto answer = std::async(std::launch::async, [&] {
      http::Response response = g.ask(put_5);
      over = true;
      return response;
    });
    wait_until([&] { return file->counters().errors > 0; });  // it was carried out, and its line waits
    wait_until([&] {
      g.clock.advance(100ms);  // nobody polls
      return over.load();
    });
    const http::Response response = answer.get();
    CHECK(response.status == 503);
    CHECK(response.content().find("was carried out with the status 204") != std::string_view::npos);
    CHECK(g.robot.angle == 5);
  }
  CHECK(g.ask(put_5).status == 204);
  const std::vector<Json> lines = lines_of(folder / "audit");
  REQUIRE(lines.size() == 2);  // the line has waited
  CHECK(lines[0]["status"] == 204);
}

TEST_CASE("with respond_when_saved the response is 503 in time if the disk does not return, also if nobody polls", "[server][security]") {
  const Folder folder;
  const auto file = std::make_shared<HangingFile>(audit_file(folder / "audit", waits).value());
  Audited g([&](Options& options) {
    options.threads.io = Io::in_poll;
    options.security.audit.file = file;
  });
  auto answer = std::async(std::launch::async, [&] { return g.ask(put_5); });
  wait_until([&] { return g.server->poll(), file->hangs(); });
  wait_until([&] {
    g.clock.advance(100ms);
    return answer.wait_for(0s) == std::future_status::ready;
  });
  CHECK(file->hangs());
  const http::Response response = answer.get();
  CHECK(response.status == 503);
  CHECK(response.content().find("was carried out with the status 204") != std::string_view::npos);
  file->go_on();
}

TEST_CASE("stopping a server does not wait for responses that wait for the audit", "[server][security]") {
  const Folder folder;
  const SmallDisk disk(10);
  Audited g([&](Options& options) {
    options.security.audit.file = audit_file(folder / "audit", waits).value();
    options.limits.host_timeout = std::chrono::minutes(10);
  });
  auto response = std::async(std::launch::async, [&] { return g.ask(put_5).status; });
  wait_until([&] { return g.server->counters().audit_waiting > 0; });
  g.server->stop();
  CHECK(response.get() == 503);
}

TEST_CASE("what an audit may be is checked", "[server][security]") {
  const Folder folder;
  const auto create = [&](const std::function<void(security::Audit&)>& change) {
    Options options;
    options.listen.port = 0;
    options.listen.transport = transport::no_network;
    change(options.security.audit);
    return Server::create(std::move(options));
  };
  const auto file = audit_file(folder / "audit").value();
  const auto wrong = [&](const std::function<void(security::Audit&)>& change) {
    const auto server = create(change);
    REQUIRE_FALSE(server);
    CHECK(server.error().code == Errc::invalid_option);
    return server.error().message;
  };
  CHECK(wrong([&](security::Audit& audit) { audit.file = file, audit.sink = [](std::string_view) {}; }).find("found both") != std::string::npos);
  CHECK(wrong([&](security::Audit& audit) { audit.file = file, audit.max_waiting_bytes = 1; }).find("max_waiting_bytes") != std::string::npos);
  const auto first = create([&](security::Audit& audit) { audit.file = file; });
  REQUIRE(first);
  CHECK(wrong([&](security::Audit& audit) { audit.file = file; }).find("another server") != std::string::npos);
}
