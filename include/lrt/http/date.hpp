// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {
inline namespace v0 {

/// A time as IMF-fixdate (RFC 9110 5.6.7), "Sun, 06 Nov 1994 08:49:37 GMT". Fractions of a second are cut off.
/// @par Threads  Any.
/// @par Time     Constant.
LRT_API std::string to_http_date(std::chrono::system_clock::time_point utc);

}  // namespace v0
}  // namespace lrt::http
