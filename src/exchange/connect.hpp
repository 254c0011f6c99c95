// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

#include "src/exchange/wire.hpp"
#include "src/http/url.hpp"

namespace lrt::exchange {

using Trust = std::function<Result<std::shared_ptr<const ClientTls>>()>;

/// Connects to the first address that accepts. Each gets an equal part of the remaining time.
/// @param trust  called for an https URL
/// @par Errors   the last one, with host and address: timed_out, io_error, cancelled; errors of `trust`
LRT_INTERNAL_API Result<std::unique_ptr<Wire>> connect(const http::Url& url, const std::vector<const Address*>& addresses, const Trust& trust,
                                                       WaitLimit limit);

}  // namespace lrt::exchange
