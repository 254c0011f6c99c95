// SPDX-License-Identifier: Apache-2.0
// A host of lrt::client: it asks a robot that is not there.
#include <lrt/client.hpp>

int main() {
  lrt::Client client = lrt::Client::create().value();
  return client.open("http://127.0.0.1:1/").has_value() ? 1 : 0;
}
