// SPDX-License-Identifier: Apache-2.0
#pragma once

/// What lrt's shared libraries export: the classes and functions of the public headers that have this. All else is hidden.
#define LRT_API __attribute__((visibility("default")))

/// Exported for lrt's other libraries (lrt::client, lrt::query, lrt::mqtt, lrt::urdf) alone. It is no part of the ABI.
#define LRT_INTERNAL_API __attribute__((visibility("default")))
