// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace lrt::test {

/// The program is built with the sanitizer of addresses or of threads, which has operators new of its own and needs more memory.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define LRT_TEST_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define LRT_TEST_SANITIZED 1
#endif
#endif
#ifndef LRT_TEST_SANITIZED
#define LRT_TEST_SANITIZED 0
#endif
inline constexpr bool is_sanitized = LRT_TEST_SANITIZED != 0;

}  // namespace lrt::test
