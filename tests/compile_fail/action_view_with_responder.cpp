// SPDX-License-Identifier: Apache-2.0
// expect: the text of a std::string_view or const char. ends with the call
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("talk", [](std::string_view, lrt::Responder) {});
#else
  thing.action("talk", [](std::string, lrt::Responder) {});
  thing.action("sing", [](std::string_view) {});
  thing.action("hum", [](const char*) {});
#endif
}
