// Checks a server against the requirements of Robotic Things and Linked Robotic Things.
//
//   lrt-check URL [--format text|json|earl] [--all] [--strict] [--colour] [--token TOKEN] [--header NAME VALUE]... [--ca-file FILE] [--root URL] [--write URL]...
//             [--invoke URL FILE]... [--callback-address ADDRESS[:PORT]] [--no-subscribe] [--time SECONDS] [--resources N]
//
// Exit status: 0, no requirement has failed; 1, one has; 2, the check could not be run.

#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <lrt/client/check.hpp>

namespace check = lrt::client::conformance;

namespace {

int usage() {
  std::fprintf(stderr,
               "usage: lrt-check URL [--format text|json|earl] [--all] [--strict] [--colour] [--token TOKEN] [--header NAME VALUE]... [--ca-file "
               "FILE] [--root URL]\n"
               "                 [--write URL]... [--invoke URL FILE]... [--callback-address ADDRESS[:PORT]] [--no-subscribe] [--time SECONDS]\n"
               "                 [--resources N]\n");
  return 2;
}

int failed(const std::string& message) { return std::fprintf(stderr, "lrt-check: %s\n", message.c_str()), 2; }

}  // namespace

int main(int argc, char** argv) {
  check::CheckOptions options;
  check::TextOptions text;
  std::string url, format = "text";
  bool strict = false;
  const std::vector<std::string> words(argv + 1, argv + argc);
  for (std::size_t at = 0; at < words.size(); ++at) {
    const std::string& word = words[at];
    const auto next = [&] { return ++at < words.size() ? words[at] : std::string(); };
    if (word == "--format") format = next();
    else if (word == "--all") text.all = true;
    else if (word == "--strict") strict = true;
    else if (word == "--colour") text.colour = true;
    else if (word == "--token") options.client.identity.token = next();
    else if (word == "--header") {
      const std::string name = next();
      options.client.identity.fields.emplace_back(name, next());
    } else if (word == "--ca-file") options.client.ca_file = next();
    else if (word == "--root") options.root = next();
    else if (word == "--write") options.write.push_back(next());
    else if (word == "--callback-address") options.callback_address = next();
    else if (word == "--no-subscribe") options.subscribe = false;
    else if (word == "--time") options.total_time = std::chrono::seconds(std::strtol(next().c_str(), nullptr, 10));
    else if (word == "--resources") options.max_resources = std::strtoul(next().c_str(), nullptr, 10);
    else if (word == "--invoke") {
      check::Invocation invocation;
      invocation.url = next();
      const std::string file = next();
      std::ifstream in(file);
      std::ostringstream body;
      body << in.rdbuf();
      if (!in) return failed("cannot read \"" + file + "\"");
      invocation.body = body.str();
      invocation.send_empty = invocation.body.empty();
      options.invoke.push_back(std::move(invocation));
    } else if (url.empty() && word.compare(0, 1, "-") != 0) {
      url = word;
    } else {
      return usage();
    }
  }
  if (url.empty() || (format != "text" && format != "json" && format != "earl")) return usage();
  const lrt::Result<check::Report> report = check::run(url, options);
  if (!report) return failed(report.error().message);
  std::cout << (format == "json"   ? check::to_json(*report)
                : format == "earl" ? check::to_earl(*report)
                                   : check::to_text(*report, text))
            << std::flush;
  return check::exit_status(report, strict);
}
