// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/language.hpp>

// The one place that states the version; CMakeLists.txt reads it from here.
#define LRT_VERSION_MAJOR 0
#define LRT_VERSION_MINOR 1
#define LRT_VERSION_PATCH 0
#define LRT_VERSION "0.1.0"

/// ABI version of the shared libraries: `liblrt.so.0`. Libraries with the same number can replace each other. The
/// classes and functions of lrt are in inline namespaces `v0` with the same number, so a program that mixes two
/// versions does not link.
#define LRT_ABI 0
