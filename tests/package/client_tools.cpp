// SPDX-License-Identifier: Apache-2.0
// A host of the libraries beside lrt::client.
#include <lrt/check.hpp>
#include <lrt/codegen.hpp>
#include <lrt/mirror.hpp>

int main() {
  const bool is_checked = lrt::check::exit_status(lrt::check::run("http://127.0.0.1:1/")) == 2;  // no server
  const bool is_generated = lrt::codegen::generate({}).has_value();
  const bool is_refused = !lrt::mirror::Mirror::create({}).has_value();  // no robot, no store
  return is_checked && is_generated && is_refused ? 0 : 1;
}
