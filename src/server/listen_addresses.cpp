// SPDX-License-Identifier: Apache-2.0
#include "src/server/listen_addresses.hpp"

#include <algorithm>
#include <utility>

#include "src/base/resolve.hpp"

namespace lrt {

Result<std::vector<std::string>> listen_addresses(const std::string& address) {
  if (numeric_address(address)) return std::vector<std::string>{address};
  Result<std::vector<Address>> found = resolve(address);
  if (!found)
    return unexpected(Errc::invalid_option,
                      "listen.address: expected a numeric address or a host name that resolves, found \"" + address + "\": " + found.error().message);
  std::vector<std::string> result;
  for (Address& one : *found)
    if (std::find(result.begin(), result.end(), one.text) == result.end()) result.push_back(std::move(one.text));
  std::stable_partition(result.begin(), result.end(), [](const std::string& text) { return text.find(':') == std::string::npos; });
  return result;
}

}  // namespace lrt
