// SPDX-License-Identifier: Apache-2.0
// expect: ignoring return.*nodiscard
// flags: -Werror=unused-result
#include <lrt/base/result.hpp>

lrt::Result<int> set_up();

int main() {
#ifdef LRT_MUST_FAIL
  set_up();
#else
  return set_up() ? 0 : 1;
#endif
}
