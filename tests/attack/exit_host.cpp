// SPDX-License-Identifier: Apache-2.0
// A robot that ends in a given way while clients are served. exit_test.py starts it, and sends it a line when it is to end.
//
//   exit_host TRANSPORT own_thread|in_poll END [CERTIFICATE KEY]     END: see `ends`
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <lrt/lrt.hpp>
#include <lrt/served.hpp>
#include <lrt/transport/named.hpp>

#include "tests/support/sample_robot.hpp"

namespace {

lrt::Server make_server(int count, char** given, lrt::test::SampleRobot& robot) {
  lrt::Options options;
  options.listen.port = 0;
  options.listen.transport = [name = std::string(given[1])](lrt::transport::TransportOptions t) {
    return lrt::transport::make_named(name, std::move(t));
  };
  options.threads.io = std::string_view(given[2]) == "in_poll" ? lrt::Io::in_poll : lrt::Io::own_thread;
  options.threads.dispatch = lrt::Dispatch::io_thread;
  options.callbacks.allow = {"127.0.0.1"};
  if (count > 5) options.security.tls = lrt::transport::TlsOptions{given[4], given[5], {}};
  lrt::Server server = lrt::Server::create(std::move(options)).value();
  lrt::Thing arm = robot.arm();
  arm.action("exit", [] { std::exit(0); });
  server.add(std::move(arm)).value();
  server.start();
  std::printf("%u\n", unsigned{server.port()});
  std::fflush(stdout);
  return server;
}

/// A child process with a copy of the server. It must end by itself, and the parent must continue to serve.
template <class F>
int child(F in_child) {
  const pid_t id = ::fork();
  if (id == 0) in_child();
  int status = 0;
  return ::waitpid(id, &status, 0) == id && WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

int main(int count, char** given) {
  if (count < 4) return 2;
  const std::string_view end = given[3];
  auto& robot = *new lrt::test::SampleRobot;  // outlives every thread of lrt: the lambdas use it
  if (end == "static") {                      // returns from main
    static lrt::Server server = make_server(count, given, robot);
    return std::getchar() == EOF;
  }
  if (end == "lambda") {  // a client calls exit(), in a lambda on the thread that does I/O
    static lrt::Server server = make_server(count, given, robot);
    while (true) ::pause();
  }
  if (end == "fork_static") {
    static lrt::Server server = make_server(count, given, robot);
    if (std::getchar() == EOF) return 1;
    const int status = child([] { std::exit(0); });  // destroys the static server in the child
    return status != 0 || std::getchar() == EOF;
  }
  lrt::Server server = make_server(count, given, robot);
  if (std::getchar() == EOF) return 1;
  if (end == "exit") std::exit(0);
  if (end == "quick_exit") std::quick_exit(0);
  if (end == "fork_use") {  // whatever a child calls, it does not hang, and the parent's clients do not notice
    const int status = child([&] {
      const bool refuses = !server.add(lrt::Thing("other")) && !server.remove("arm") && !server.reload_tls();
      const lrt::http::Request request;
      const bool responds = server.serve(request).response.status == 503 && server.judge_header(request, 1).response->status == 503;
      server.poll();
      server.run();
      server.start();
      server.wake();
      server.stop();
      { const lrt::Server moved = std::move(server); }
      std::_Exit(refuses && responds ? 0 : 1);
    });
    if (status != 0 || std::getchar() == EOF) return 1;
    std::exit(0);
  }
  if (end == "fork_exec") {
    const int status = child([] {
      ::execl("/bin/true", "true", nullptr);
      std::_Exit(1);
    });
    if (status != 0 || std::getchar() == EOF) return 1;
    std::exit(0);
  }
  return 2;
}
