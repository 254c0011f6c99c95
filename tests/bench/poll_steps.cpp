// SPDX-License-Identifier: Apache-2.0
// The longest single steps of Server::poll() with Io::in_poll: what it cannot divide, whatever its budget.
//
//   poll_steps [--transport http|libwebsockets] [--budget 200] [--rounds 100] [--p256 DIR] [--rsa DIR]
//
// The client is in the same thread and takes turns with poll(), so nothing runs beside it. For each round the longest poll() counts: its
// median and maximum over the rounds are printed, by the clock and in CPU time of this thread (a maximum by the clock may be the
// system's doing), and how many calls the round took. DIR has server.pem and server-key.pem; without it the row is left out.
// The last row has 1,400 event streams with queues that nobody reads, and a new value each millisecond, before a poll(): a round is 100 of them.

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>

#include "tests/bench/stream.hpp"
#include "tests/bench/transport_option.hpp"

namespace {

double microseconds(clockid_t clock) {
  timespec now{};
  ::clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) / 1e3;
}

struct Round {
  double wall = 0, cpu = 0;  ///< of the longest poll()
  int polls = 0;
};

class Bench {
 public:
  Bench(lrt::Options options, std::chrono::microseconds budget) : server_(lrt::Server::create(std::move(options)).value()), budget_(budget) {}
  lrt::Server& server() { return server_; }

  /// Polls until the client's step says that it is done.
  Round drive(const std::function<bool()>& client) {
    Round round;
    while (!client()) {
      const double wall = microseconds(CLOCK_MONOTONIC), cpu = microseconds(CLOCK_THREAD_CPUTIME_ID);
      server_.poll(budget_);
      round.cpu = std::max(round.cpu, microseconds(CLOCK_THREAD_CPUTIME_ID) - cpu);
      round.wall = std::max(round.wall, microseconds(CLOCK_MONOTONIC) - wall);
      if (++round.polls > 1'000'000) std::fprintf(stderr, "no answer\n"), std::exit(1);
    }
    return round;
  }

  Round handshake(bench::Stream& stream) {
    stream.connect(server_.port(), true);
    const Round round = drive([&] {
      const auto step = stream.handshake();
      if (step == bench::Stream::Step::failed) std::fprintf(stderr, "the TLS handshake failed\n"), std::exit(1);
      return step == bench::Stream::Step::done;
    });
    return round;
  }

  Round request(bench::Stream& stream, const std::string& text, int& status) {
    std::size_t sent = 0;
    std::string answer;
    const Round round = drive([&] {
      if (sent < text.size()) {
        const ssize_t n = stream.send(std::string_view(text).substr(sent));
        if (n > 0) sent += static_cast<std::size_t>(n);
      }
      char buffer[64 * 1024];
      for (ssize_t n = 0; (n = stream.receive(buffer, sizeof buffer)) > 0;) answer.append(buffer, static_cast<std::size_t>(n));
      const std::size_t end = answer.find("\r\n\r\n"), length = answer.find("\r\nContent-Length: ");
      if (end == std::string::npos) return false;
      const std::size_t body = length < end ? std::strtoul(answer.c_str() + length + 18, nullptr, 10) : 0;
      return answer.size() >= end + 4 + body;
    });
    status = std::atoi(answer.c_str() + 9);
    return round;
  }

  /// Lets the server see that a client is gone, and do what else there is to do.
  void settle() {
    for (int i = 0; i < 20; ++i) server_.poll(budget_);
  }

 private:
  lrt::Server server_;
  std::chrono::microseconds budget_;
};

void print(const char* what, std::vector<Round> rounds, const std::string& outcome) {
  const auto column = [&](auto member) {
    std::sort(rounds.begin(), rounds.end(), [&](const Round& a, const Round& b) { return a.*member < b.*member; });
    return std::pair(rounds[rounds.size() / 2].*member, rounds.back().*member);
  };
  const auto wall = column(&Round::wall), cpu = column(&Round::cpu);
  const auto polls = column(&Round::polls);
  std::printf("| %-62s | %9.1f | %9.1f | %9.1f | %9.1f | %4d | %s |\n", what, wall.first, wall.second, cpu.first, cpu.second, polls.first,
              outcome.c_str());
  std::fflush(stdout);
}

std::string get(int port, const std::string& path) { return "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n"; }

std::string put(int port, const std::string& path, const std::string& body, const std::string& type = "text/turtle") {
  return "PUT " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\nContent-Type: " + type +
         "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

const std::string prefixes = "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .\n@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n";
const std::string value = prefixes + "<> vom:numericalValue 0.5 .\n";

/// Turtle of at most so many bytes: a value, and what nobody asked for.
std::string triples(std::size_t bytes, std::size_t each) {
  std::string body = value;
  for (std::size_t i = 0; body.size() + each < bytes; ++i) {
    std::string line = "<> rdfs:comment \"" + std::to_string(i);
    body += line + std::string(each > line.size() + 4 ? each - line.size() - 4 : 0, 'x') + "\" .\n";
  }
  return body;
}

/// One value, but many of it: each is judged, and each refusal is in the report.
std::string values(const std::string& digits, std::size_t bytes, std::size_t most) {
  std::string body = prefixes + "<> vom:numericalValue " + digits + "0";
  for (std::size_t i = 1; i < most && body.size() + digits.size() + 12 < bytes; ++i) body += ",\n " + digits + std::to_string(i);
  return body + " .\n";
}

/// As much text as the limit allows, made from little: a long prefix and short names.
std::string long_names() {
  std::string body = "@prefix p: <http://example.org/" + std::string(5'000, 'x') + "> .\n" + value;
  for (int i = 0; i < 3'000; ++i) body += "<> rdfs:seeAlso p:" + std::to_string(i) + " .\n";
  return body;
}

std::string blank_nodes(std::size_t count, std::size_t each) {
  std::string body = value;
  for (std::size_t i = 0; i < count; ++i) body += "[] rdfs:comment \"" + std::string(each - 22, 'x') + "\" .\n";
  return body;
}

std::string n_triples(const std::string& subject, std::size_t count, std::size_t each) {
  std::string body =
      "<" + subject + "> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> \"0.5\"^^<http://www.w3.org/2001/XMLSchema#double> .\n";
  for (std::size_t i = 0; i < count; ++i)
    body += "<" + subject + "> <http://www.w3.org/2000/01/rdf-schema#comment> \"" + std::to_string(10'000 + i) + std::string(each, 'x') + "\" .\n";
  return body;
}

std::string rdf_xml(std::size_t count, std::size_t each) {
  std::string body =
      "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns:rdfs=\"http://www.w3.org/2000/01/rdf-schema#\" "
      "xmlns:vom=\"http://vocab.arvida.de/2015/06/vom/vocab#\"><rdf:Description rdf:about=\"\"><vom:numericalValue "
      "rdf:datatype=\"http://www.w3.org/2001/XMLSchema#double\">0.5</vom:numericalValue>\n";
  for (std::size_t i = 0; i < count; ++i) body += "<rdfs:comment>" + std::to_string(10'000 + i) + std::string(each - 35, 'x') + "</rdfs:comment>\n";
  return body + "</rdf:Description></rdf:RDF>\n";
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t rounds = 100;
  std::chrono::microseconds budget(200);
  std::string transport, p256, rsa;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    if (name == "--transport") transport = argv[i + 1];
    else if (name == "--budget") budget = std::chrono::microseconds(std::atol(argv[i + 1]));
    else if (name == "--rounds") rounds = static_cast<std::size_t>(std::atol(argv[i + 1]));
    else if (name == "--p256") p256 = argv[i + 1];
    else if (name == "--rsa") rsa = argv[i + 1];
    else return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  const auto options = [&] {
    lrt::Options made;
    made.listen.port = 0;
    made.threads.io = lrt::Io::in_poll;
    if (!transport.empty()) bench::use_transport(transport, made);
    return made;
  };
  std::printf("| longest poll() in us, budget %ld%*s | median | max | CPU median | CPU max | polls | answer |\n|---|---|---|---|---|---|---|\n",
              static_cast<long>(budget.count()), 33, "");

  {
    Bench bench(options(), budget);
    std::vector<lrt::PushedProperty<double>> published;
    const auto add = [&](const std::string& path) {
      lrt::Thing thing{path};
      for (int i = 1; i <= 40; ++i) {
        published.push_back(thing.property<double>("p" + std::to_string(i), lrt::unit::radian));
        published.back().publish(i);
      }
      bench.server().add(std::move(thing)).value();
    };
    for (std::size_t i = 0; i < rounds; ++i) add("arm" + std::to_string(i));
    double target = 0;
    lrt::Thing hand{"hand"};
    hand.property(
            "target", [&] { return target; }, lrt::unit::none)
        .between(-3, 3)
        .on_write([&](double wanted) { target = wanted; });
    bench.server().add(std::move(hand)).value();
    const int port = bench.server().port();
    bench::Stream stream;
    stream.connect(port, false);
    int status = 0;
    bench.request(stream, get(port, "/hand"), status);

    const auto row = [&](const char* what, std::size_t repeats, const std::function<std::string(std::size_t)>& text) {
      std::vector<Round> all;
      for (std::size_t i = 0; i < repeats; ++i) {
        const std::string request = text(i);
        all.push_back(bench.request(stream, request, status));
        if (status != 413) continue;  // such connections are closed
        bench.settle();
        stream.connect(port, false);
      }
      print(what, std::move(all), std::to_string(status));
    };
    std::vector<Round> idle;
    for (std::size_t i = 0; i < rounds; ++i) {
      int calls = 0;
      idle.push_back(bench.drive([&] { return calls++ == 1; }));
    }
    print("nothing to do", std::move(idle), "");
    row("GET of a property, cached", rounds, [&](std::size_t) { return get(port, "/arm0/p1"); });
    row("GET of a property just published", rounds, [&](std::size_t i) {
      published[0].publish(static_cast<double>(i) + 0.5);
      return get(port, "/arm0/p1");
    });
    const auto arm = [](std::size_t i) { return "/arm" + std::to_string(i); };
    row("GET of a thing with 40 properties, rendered for the first time", rounds, [&](std::size_t i) { return get(port, arm(i)); });
    row("GET of its blueprint, rendered for the first time", rounds, [&](std::size_t i) { return get(port, arm(i) + "/blueprint"); });
    const std::size_t few = std::max<std::size_t>(5, rounds / 5);
    const auto write = [&](const char* what, std::size_t repeats, const std::string& body, const std::string& type = "text/turtle") {
      row(what, repeats, [&](std::size_t) { return put(port, "/hand/target", body, type); });
    };
    constexpr std::size_t kib = 1024;
    write("PUT of one triple; the first compiles the shapes", rounds, value);
    write("PUT 1 KiB, 20 triples", rounds, triples(kib, 40));
    write("PUT 1 KiB, values out of bounds", rounds, values("1", kib, 10'000));
    write("PUT 64 KiB, 1,600 triples", few, triples(64 * kib, 40));
    write("PUT 64 KiB, one literal", few, triples(64 * kib, 65'000));
    write("PUT 64 KiB, 8,000 values out of bounds", few, values("1", 64 * kib, 10'000));
    write("PUT 64 KiB, 15 MiB when written out", few, long_names());
    write("PUT 1 MiB, 9,500 triples", few, triples(1024 * kib, 110));
    write("PUT 1 MiB, one literal", few, triples(1024 * kib, 1'048'000));
    write("PUT 1 MiB, 9,500 values out of bounds", few, values("1" + std::string(90, '0'), 1024 * kib, 9'500));
    write("PUT 1 MiB, 9,500 blank nodes", few, blank_nodes(9'500, 110));
    write("PUT 1 MiB, more triples than the limit", few, triples(1024 * kib, 40));
    write("PUT 1 MiB of N-Triples, 8,000", few, n_triples(bench.server().url() + "hand/target", 8'000, 30), "application/n-triples");
    write("PUT 1 MiB of RDF/XML, 9,500 triples", few, rdf_xml(9'500, 110), "application/rdf+xml");
    bench.server().stop();
  }

  for (const auto& [what, dir] : {std::pair{"TLS handshake, ECDSA P-256", p256}, std::pair{"TLS handshake, RSA 2048", rsa}}) {
    if (dir.empty()) continue;
    lrt::Options secure = options();
    bench::use_tls(dir, secure);
    Bench bench(std::move(secure), budget);
    std::vector<Round> all;
    for (std::size_t i = 0; i < rounds; ++i) {
      bench::Stream stream;
      all.push_back(bench.handshake(stream));
      int calls = 0;  // the end of the handshake is the server's to read yet
      const Round rest = bench.drive([&] { return calls++ == 3; });
      all.back().wall = std::max(all.back().wall, rest.wall);
      all.back().cpu = std::max(all.back().cpu, rest.cpu);
      stream.close(true);
      bench.settle();
    }
    print(what, std::move(all), "");
    bench.server().stop();
  }

  {
    constexpr std::size_t count = 1'400;
    rlimit files{};
    ::getrlimit(RLIMIT_NOFILE, &files);
    files.rlim_cur = files.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &files);
    Bench bench(options(), budget);
    lrt::Thing arm{"arm"};
    lrt::PushedProperty<double> angle = arm.property<double>("angle", lrt::unit::radian);
    angle.publish(0);
    bench.server().add(std::move(arm)).value();
    const std::string request = get(bench.server().port(), "/arm/angle?queueLength=100");
    const std::string open = request.substr(0, request.size() - 2) + "Accept: text/event-stream\r\n\r\n";
    std::vector<bench::Stream> streams(count);
    for (bench::Stream& stream : streams) {
      stream.connect(bench.server().port(), false, 4096);
      if (stream.send(open) != static_cast<ssize_t>(open.size())) std::fprintf(stderr, "a request was not sent\n"), std::exit(1);
      bench.drive([&, calls = 0]() mutable { return calls++ == 1; });
    }
    bench.drive([&] { return bench.server().counters().event_streams == count; });
    std::vector<Round> all;
    for (std::size_t i = 0; i < std::max<std::size_t>(5, rounds / 5); ++i) {
      int calls = 0;
      all.push_back(bench.drive([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        angle.publish(calls);
        return calls++ == 100;
      }));
    }
    print("1,400 event streams that nobody reads", std::move(all), std::to_string(bench.server().counters().event_streams) + " open");
    bench.server().stop();
  }
}
