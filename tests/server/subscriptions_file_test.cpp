// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <lrt/served.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

Options with_file(const std::string& path, Io io = Io::own_thread) {
  Options options;
  options.listen.port = 0;
  options.threads.io = io;
  options.callbacks.allow = {"127.0.0.1"};
  options.callbacks.file = path;
  return options;
}

Thing arm() {
  Thing thing{"arm"};
  thing.property<double>("angle");
  return thing;
}

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
void put(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

std::string description(std::uint16_t port) {
  return "@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . <> a hybrit:WebCallback ; hybrit:onResource "
         "<http://localhost:" +
         std::to_string(port) + "/arm/angle> ; hybrit:callbackURL \"http://127.0.0.1:9/\" .";
}
std::string post(std::uint16_t port) {
  return "POST /arm/subscriptions\nHost: localhost:" + std::to_string(port) + "\nContent-Type: text/turtle\n\n" + description(port);
}

/// Makes a callback and returns its path.
std::string make(Server& server, bool polls) {
  Socket client(server.port());
  const Answer made = client.ask(post(server.port()), [&] {
    if (polls) server.poll();
  });
  CHECK(made.status == 201);
  return made.field("Location").substr(made.field("Location").find("/arm/"));
}

}  // namespace

TEST_CASE("when a callback is acknowledged the file has it, when a cancellation is the file is without it", "[server][saves]") {
  for (const Io io : {Io::own_thread, Io::in_poll}) {
    const Folder folder;
    const std::string path = folder / "state/subscriptions.ttl";
    Server server = Server::create(with_file(path, io)).value();
    server.add(arm()).value();
    for (int i = 0; i < 5; ++i) {
      const std::string made = make(server, io == Io::in_poll);
      const std::string id = made.substr(made.rfind('/') + 1);
      CHECK(text_of(path).find(id) != std::string::npos);
      Socket client(server.port());
      const Answer cancelled = client.ask("DELETE " + made + "\nHost: localhost:" + std::to_string(server.port()), [&] {
        if (io == Io::in_poll) server.poll();
      });
      CHECK(cancelled.status == 204);
      CHECK(text_of(path).find(id) == std::string::npos);
    }
    server.stop();
  }
}

TEST_CASE("a request of a host's own HTTP server waits for the file too, whoever polls", "[server][saves][serve]") {
  for (const Io io : {Io::own_thread, Io::in_poll}) {
    const Folder folder;
    Server server = Server::create(with_file(folder / "state", io)).value();
    server.add(arm()).value();
    RequestText request("GET /arm/angle\nUpgrade: callback\nCallback: http://127.0.0.1:9/\nHost: localhost:4711");
    request.get().local_port = 4711;
    CHECK(server.serve(request.get()).response.status == 201);
    CHECK(text_of(folder / "state").find("http://127.0.0.1:9/") != std::string::npos);
  }
}

TEST_CASE("without respond_when_saved the response does not wait, and the file follows", "[server][saves]") {
  const Folder folder;
  std::filesystem::create_directories(folder / "state.new/full");  // no write succeeds
  Options options = with_file(folder / "state");
  options.callbacks.respond_when_saved = false;
  CHECK(Server::create(options).error().code == Errc::invalid_option);
  std::filesystem::remove_all(folder / "state.new");
  std::string id;
  {
    Server server = Server::create(options).value();
    server.add(arm()).value();
    std::filesystem::create_directories(folder / "state.new/full");
    id = make(server, false);
    CHECK_FALSE(std::filesystem::exists(folder / "state"));
    std::filesystem::remove_all(folder / "state.new");
  }
  CHECK(text_of(folder / "state").find(id.substr(id.rfind('/') + 1)) != std::string::npos);
}

TEST_CASE("what cannot be written is 503, and works again when it can", "[server][saves]") {
  const Folder folder;
  Server server = Server::create(with_file(folder / "state")).value();
  server.add(arm()).value();
  const std::string kept = make(server, false);
  std::filesystem::create_directories(folder / "state.new/full");
  const std::string host = "\nHost: localhost:" + std::to_string(server.port());
  Socket client(server.port());
  CHECK(client.ask(post(server.port())).status == 503);
  CHECK(client.ask("DELETE " + kept + host).status == 503);
  CHECK(client.ask("GET " + kept + host).status == 200);
  std::filesystem::remove_all(folder / "state.new");
  CHECK(client.ask(post(server.port())).status == 201);
  CHECK(client.ask("DELETE " + kept + host).status == 204);
}

TEST_CASE("something else in the place of the file stops the start and stays", "[server][saves]") {
  const Folder folder;
  const std::string path = folder / "state";
  for (const std::string& text :
       {std::string("not Turtle {"), std::string("<> <http://purl.org/dc/terms/title> \"of somebody else\" ."), std::string(3000, '\0')}) {
    put(path, text);
    const auto server = Server::create(with_file(path));
    REQUIRE_FALSE(server);
    CHECK(server.error().code == Errc::invalid_option);
    CHECK(server.error().message.find(path) != std::string::npos);
    CHECK(text_of(path) == text);
  }
  CHECK(Server::create(with_file(folder.path().string())).error().code == Errc::invalid_option);
  CHECK(Server::create(with_file("/dev/full")).error().code == Errc::invalid_option);
  CHECK(Server::create(with_file(path + "/below")).error().code == Errc::io_error);
}

TEST_CASE("after a restart a callback goes on if its owner is known by the same as before", "[server][saves][security]") {
  const Folder folder;
  const std::string chief = "chief-0123456789abcdef", reader = "reader-0123456789abcdef";
  Options options = with_file(folder / "state");
  options.security.token_file = folder / "tokens";
  options.security.authenticate = [](const http::Request& request) -> std::optional<security::Principal> {
    if (request.find("X-Badge") == "7") return security::Principal{"anna", {"reader"}};
    return std::nullopt;
  };
  put(folder / "tokens", "chief administrator " + chief + "\nanna reader " + reader + "\n");
  std::string by_token, by_function;
  {
    Server server = Server::create(options).value();
    server.add(arm()).value();
    const std::uint16_t port = options.listen.port = server.port();
    const auto make = [&](const std::string& who) {
      const Answer made = Socket(port).ask("POST /arm/subscriptions\n" + who + "\nHost: localhost:" + std::to_string(port) +
                                           "\nContent-Type: text/turtle\n\n" + description(port));
      REQUIRE(made.status == 201);
      return made.field("Location").substr(made.field("Location").find("/arm/"));
    };
    by_token = make("Authorization: Bearer " + reader);
    by_function = make("X-Badge: 7");
  }
  put(folder / "tokens", "chief administrator " + chief + "\n");
  Server server = Server::create(options).value();
  server.add(arm()).value();
  const auto status = [&](const std::string& path) {
    return Socket(server.port())
        .ask("GET " + path + "\nAuthorization: Bearer " + chief + "\nHost: localhost:" + std::to_string(server.port()))
        .status;
  };
  CHECK(status(by_token) == 404);
  CHECK(status(by_function) == 200);
}

TEST_CASE("a file of an earlier version, without a first line, is read and written anew", "[server][saves]") {
  const Folder folder;
  const std::string path = folder / "state";
  std::uint16_t port = 0;
  std::string made;
  {
    Server server = Server::create(with_file(path)).value();
    server.add(arm()).value();
    port = server.port();
    made = make(server, false);
  }
  const std::string text = text_of(path);
  put(path, text.substr(text.find('\n') + 1));
  Options options = with_file(path);
  options.listen.port = port;
  {
    Server server = Server::create(options).value();
    server.add(arm()).value();
    CHECK(Socket(port).ask("GET " + made + "\nHost: localhost:" + std::to_string(port)).status == 200);
  }
  CHECK(text_of(path) == text);
}
