// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <string>
#include <string_view>

#include "tests/support/number_forms.hpp"

// A byte for the datatype, and one or two lexical forms with '|' between them -> the values that lrt and a reader of big numbers find.

namespace {

void expect_none(const std::string& fault) {
  if (fault.empty()) return;
  std::fprintf(stderr, "%s\n", fault.c_str());
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace forms = lrt::test::forms;
  if (size < 1 || size > 1'000) return 0;  // the second reader takes the square of the length
  const forms::Named& type = forms::types[data[0] % std::size(forms::types)];
  const std::string_view all(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string_view first = all.substr(0, all.find('|'));
  const std::string_view second = first.size() < all.size() ? all.substr(first.size() + 1) : std::string_view();
  expect_none(forms::fault_of(first, type));
  if (first.size() < all.size()) expect_none(forms::fault_of(first, second, type));
  return 0;
}
