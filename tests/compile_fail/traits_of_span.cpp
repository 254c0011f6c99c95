// SPDX-License-Identifier: Apache-2.0
// expect: a view does not own its members
#include <lrt/rdf/traits.hpp>

/// As std::span of C++20.
struct View {
  using element_type = double;
  using value_type = double;
  const double* data() const { return nullptr; }
  std::size_t size() const { return 0; }
  const double* begin() const { return nullptr; }
  const double* end() const { return nullptr; }
};

#ifdef LRT_MUST_FAIL
using Wanted = View;
#else
using Wanted = std::vector<double>;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }
