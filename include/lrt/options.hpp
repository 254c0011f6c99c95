// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/engine/options.hpp>
#include <lrt/options/callbacks.hpp>
#include <lrt/options/limits.hpp>
#include <lrt/options/listen.hpp>
#include <lrt/options/security.hpp>
#include <lrt/options/threads.hpp>

namespace lrt {
inline namespace v0 {

/// Options of a Server. The defaults suit development on one machine. Queues of subscriptions, clock, log, ids, prefixes,
/// vocabulary, queries and page are in the base class.
///
///     lrt::Options options;
///     options.listen.address = "robot.local";
///     options.security.tls.emplace();
///     options.security.tls->certificate_file = "robot.pem";
///     options.security.tls->key_file = "robot.key";
///     options.security.token_file = "tokens.txt";
///     options.limits.max_connections = 100;
///     auto server = lrt::Server::create(std::move(options));
///
/// @par Threads  Set-up only: Server::create() takes them. Where the server calls the functions in them, each of these
///               says.
struct Options : engine::CommonOptions {
  Listen listen;        ///< address, port and public base
  Security security;    ///< TLS, authentication and authorization
  Limits limits;        ///< memory, connections and time
  Callbacks callbacks;  ///< web callbacks
  Threads threads;      ///< which threads run what
};

}  // namespace v0
}  // namespace lrt
