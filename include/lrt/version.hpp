// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/language.hpp>

// The one place that states the version; CMakeLists.txt reads it from here.
#define LRT_VERSION_MAJOR 0
#define LRT_VERSION_MINOR 1
#define LRT_VERSION_PATCH 0
#define LRT_VERSION "0.1.0"
