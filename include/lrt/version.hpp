// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/language.hpp>

// The one place that states the version; CMakeLists.txt reads it from here.
#define LRT_VERSION_MAJOR 0
#define LRT_VERSION_MINOR 1
#define LRT_VERSION_PATCH 0
#define LRT_VERSION "0.1.0"

/// Of the shared libraries: `liblrt.so.0`. Libraries of one number can replace each other. The classes and functions of lrt are in inline
/// namespaces `v0`, of the same number, so that a program does not link with two of them unnoticed.
#define LRT_ABI 0
