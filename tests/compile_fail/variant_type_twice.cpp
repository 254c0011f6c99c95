// SPDX-License-Identifier: Apache-2.0
// expect: the variant has several alternatives of this type
#include <lrt/thing.hpp>

#include <string>
#include <variant>

using Target = std::variant<double, double, std::string>;
template <>
struct lrt::rdf::traits<Target> : lrt::rdf::Variant<Target> {
  static void describe(Variant<Target>& v) {
    v.alternative<0>("angle");
    v.alternative<1>("height");
#ifdef LRT_MUST_FAIL
    v.alternative<double>("place");
#endif
  }
};
