// SPDX-License-Identifier: Apache-2.0
// CPU times of who may do what: a decision of a policy with many rules, and a token's principal among many.
//
//   rights_bench [rules, default 100]

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include <lrt/security.hpp>

#include "src/security/policy.hpp"

namespace {
double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
}  // namespace

int main(int argc, char** argv) {
  using namespace lrt::security;
  const int count = argc > 1 ? std::atoi(argv[1]) : 100;
  std::vector<Rule> rules = {{"/", Scope::tree, {Who::Kind::authenticated}, Right::read}};
  std::string tokens;
  for (int i = 1; i < count; ++i)
    rules.push_back({"/robot" + std::to_string(i) + "/arm/joint", Scope::tree, {Who::Kind::role, "operator"}, Right::write});
  for (int i = 0; i < count; ++i) tokens += "name" + std::to_string(i) + " operator token-0123456789-" + std::to_string(i) + "\n";
  const auto policy = Policy::create(rules).value();
  const Principal who{"anna", {"reader", "operator"}};
  const auto view = policy->view(&who);
  const Tokens known = Tokens::parse(tokens).value();
  const std::vector<std::string> paths = {"/robot7/arm/joint/angle", "/robot50/arm/joint/actions/turn", "/elsewhere/arm/joint/angle", "/robot3"};
  constexpr int times = 1'000'000;

  unsigned rights = 0;
  double start = cpu_seconds();
  for (int i = 0; i < times; ++i) rights += view->at(paths[static_cast<std::size_t>(i) % paths.size()]).bits();
  std::printf("a decision with %d rules: %.0f ns\n", count, (cpu_seconds() - start) / times * 1e9);
  start = cpu_seconds();
  for (int i = 0; i < times / 10; ++i) rights += known.find("token-0123456789-" + std::to_string(i % count), {}) != nullptr;
  std::printf("a token among %d: %.0f ns\n", count, (cpu_seconds() - start) / (times / 10) * 1e9);
  return rights == 0;
}
