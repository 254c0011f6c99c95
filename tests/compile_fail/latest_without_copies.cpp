// SPDX-License-Identifier: Apache-2.0
// expect: Latest<T> needs a default constructor and copies of T
#include <lrt/client/latest.hpp>

struct Pose {
  double x = 0;
#ifdef LRT_MUST_FAIL
  Pose& operator=(const Pose&) = delete;
#endif
};

lrt::client::Latest<Pose> pose;
