// SPDX-License-Identifier: Apache-2.0
#include "src/base/crc32c.hpp"

#include <string>

#include "tests/support/catch.hpp"

using namespace lrt;

TEST_CASE("the sums are those of RFC 3720", "[base]") {
  CHECK(crc32c("") == 0);
  CHECK(crc32c("123456789") == 0xE3069283U);
  CHECK(crc32c(std::string(32, '\0')) == 0x8A9136AAU);  // B.4
  CHECK(crc32c(std::string(32, '\xFF')) == 0x62A8AB43U);
}

TEST_CASE("a sum may be made in pieces", "[base]") {
  const std::string text = "a graph of a World is kept in a journal";
  for (std::size_t at = 0; at <= text.size(); ++at) CHECK(crc32c(text.substr(at), crc32c(text.substr(0, at))) == crc32c(text));
}
