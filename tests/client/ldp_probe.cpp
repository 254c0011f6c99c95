// SPDX-License-Identifier: Apache-2.0
// What a client finds at a server, for tests with servers of others. Prints a line for each thing:
//
//   ldp_probe URL
//     members N           objects of ldp:contains
//     thing URL TYPES...
//     value URL VALUE     of each property that is a number
//     kept yes|no         a second GET transferred nothing
#include <cstdio>

#include <lrt/client.hpp>
#include <lrt/rdf/vocab.hpp>

int main(int argc, char** argv) {
  if (argc != 2) return std::fputs("usage: ldp_probe URL\n", stderr), 2;
  lrt::Client client = lrt::Client::create().value();
  const auto robot = client.open(argv[1]);
  if (!robot) return std::fprintf(stderr, "%s\n", robot.error().message.c_str()), 1;
  const auto container = client.get(argv[1]);
  if (!container) return std::fprintf(stderr, "%s\n", container.error().message.c_str()), 1;
  std::printf("members %zu\n", (*container)->objects(lrt::vocab::ldp::contains).size());
  for (const lrt::client::Thing& thing : robot->things()) {
    std::printf("thing %s", thing.url().c_str());
    for (const std::string& type : thing.types()) std::printf(" %s", type.c_str());
    std::printf("\n");
    for (const lrt::client::Property& property : thing.properties()) {
      const auto value = property.read<double>();
      if (value) std::printf("value %s %g\n", property.url().c_str(), *value);
      else std::printf("error %s\n", value.error().message.c_str());
    }
  }
  for (const std::string& problem : robot->problems()) std::printf("problem %s\n", problem.c_str());
  const auto again = client.get(argv[1]);
  std::printf("kept %s\n", again && *again == *container ? "yes" : "no");
}
