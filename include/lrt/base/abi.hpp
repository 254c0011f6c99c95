// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Marks a class or function of the public headers that lrt's shared libraries export. All other symbols are hidden.
#define LRT_API __attribute__((visibility("default")))

/// Marks a function that is exported only for lrt's other libraries (lrt::client, lrt::query, ...). It is not part of the
/// ABI.
#define LRT_INTERNAL_API __attribute__((visibility("default")))

/// Hides a class that is nested in an exported one, where it is defined. Without it the members have the visibility of the
/// enclosing class.
#define LRT_LOCAL __attribute__((visibility("hidden")))
