// SPDX-License-Identifier: Apache-2.0
// expect: a Result is assigned only if moving its value does not throw
#include <lrt/base/result.hpp>

struct Throwing {
  Throwing() = default;
  Throwing(Throwing&& other) noexcept(false) { static_cast<void>(other); }
};

int main() {
  lrt::Result<Throwing> result = Throwing();
#ifdef LRT_MUST_FAIL
  result = lrt::Result<Throwing>(Throwing());
#endif
  return result ? 0 : 1;
}
