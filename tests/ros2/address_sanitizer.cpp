// SPDX-License-Identifier: Apache-2.0
// Fast DDS 2.9 of Debian frees the statistics of a writer (StatisticsWriterImpl) as an object of its base class, which is smaller and has no virtual destructor.
extern "C" const char* __asan_default_options();  // NOLINT: the name is that of the sanitizer
extern "C" const char* __asan_default_options() { return "new_delete_type_mismatch=0"; }
