// SPDX-License-Identifier: Apache-2.0
#pragma once

// What most tests include, compiled once (lrt_add_tests). A test includes what it uses all the same: some builds have no precompiled headers.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/shacl/validator.hpp>

#include "tests/support/catch.hpp"
