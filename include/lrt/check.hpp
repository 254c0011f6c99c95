// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/client/options.hpp>

/// Checks from outside whether a server is a Robotic Thing (R0.1 to R0.17) and a Linked Robotic Thing (R1.1 to R1.12),
/// with evidence.
///
///     auto report = lrt::check::run("http://robot.example/arm");
///     if (report) std::cout << lrt::check::to_text(*report);
///     return lrt::check::exit_status(report);
namespace lrt::check {
inline namespace v0 {

/// The result of a check.
enum class Outcome : unsigned char {
  pass,            ///< the server fulfils the requirement
  fail,            ///< the server violates the requirement
  not_applicable,  ///< the server has nothing to which the requirement applies, or it is a requirement on clients
  not_testable,    ///< it is not visible from outside, or not with these options; the detail states the reason
};
/// The enumerator's name.
/// @par Threads  Any.
LRT_API std::string_view to_string(Outcome outcome) noexcept;

/// The strength of a requirement (RFC 2119). A failed `may` is advice.
enum class Level : unsigned char { must, should, may };
/// The enumerator's name.
/// @par Threads  Any.
LRT_API std::string_view to_string(Level level) noexcept;

/// How certain an outcome is.
enum class Certainty : unsigned char {
  certain,  ///< the evidence alone decides
  likely,   ///< another explanation exists, and the detail names it
};
/// The enumerator's name.
/// @par Threads  Any.
LRT_API std::string_view to_string(Certainty certainty) noexcept;

/// One request and its response, shortened.
struct Evidence {
  std::string url;       ///< of the request
  std::string sent;      ///< request line and relevant fields, one per line
  std::string received;  ///< status line, relevant fields, and the first bytes of the body; or the reason why there is no response
};

/// The result of one check, over all resources to which it was applied.
struct Finding {
  std::string id;                            ///< "etag.head": stable, for programs that compare
  std::vector<std::string> requirements;     ///< "R0.11"; of several the first is the main one
  Level level = Level::must;                 ///< of the requirement
  Outcome outcome = Outcome::not_testable;   ///< the result
  Certainty certainty = Certainty::certain;  ///< of the outcome
  std::string title;                         ///< "HEAD has the entity tag of GET"
  std::string specification;                 ///< the requirement, paraphrased
  std::string references;                    ///< "RFC 9110 8.8.3, 9.3.2"
  std::string detail;                        ///< what was found
  std::size_t tried = 0;                     ///< resources or requests to which it was applied
  std::size_t failed = 0;                    ///< of these, how many violate the requirement
  std::vector<Evidence> evidence;            ///< of a failure: the first ones; otherwise one that passed
  /// Each single result of a failure, of checks of merged documents: the node, the shape or term, and the documents; at
  /// most CheckOptions::max_results.
  std::vector<std::string> results;
};

/// One requirement of the paper: the worst of its findings.
struct Requirement {
  std::string id;                           ///< "R0.11"
  Level level = Level::must;                ///< its strength
  std::string title;                        ///< the requirement, paraphrased
  Outcome outcome = Outcome::not_testable;  ///< the worst outcome of its findings
  bool advice = false;                      ///< `outcome` is fail, but no `must` has failed
  std::string reason;                       ///< of an outcome without a finding
};

/// The result of run().
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct LRT_API Report {
  std::string url;                                  ///< the checked URL
  std::chrono::system_clock::time_point started{};  ///< when the check began
  std::string product;                              ///< value of the Server field; empty: none
  std::vector<Finding> findings;                    ///< one per check
  std::vector<Requirement> requirements;            ///< all, R0.1 to R1.12
  std::vector<std::string> resources;               ///< URLs that were visited
  std::size_t requests = 0;                         ///< number of requests
  std::vector<std::string> notes;                   ///< limits that were reached, subscriptions that could not be ended
  bool is_robotic_thing = false;                    ///< no `must` of R0 has failed
  bool is_linked_robotic_thing = false;             ///< no `must` of R0 and R1 has failed

  const Finding* find(std::string_view id) const noexcept;  ///< the finding of an id; nullptr: none
};

/// An action that the check may invoke.
struct Invocation {
  std::string url;                         ///< of the action
  std::string body;                        ///< a valid input. Empty: only inputs that the server must refuse are sent, unless `send_empty`
  std::string media_type = "text/turtle";  ///< of the body
  bool send_empty = false;                 ///< the action has no input, and may be invoked with an empty body
};

/// What a check does at the moment.
struct Progress {
  std::string url;                      ///< of the request that is sent now
  std::size_t requests = 0;             ///< so far, with this one
  std::chrono::milliseconds elapsed{};  ///< since the check began
  std::chrono::milliseconds usual{};    ///< that a response of the server takes
};

/// Options and limits of a check. By default it changes nothing on the robot.
struct CheckOptions {
  client::Options client;  ///< identity, certificate authorities, limits of one request
  /// URL of the root resource (R0.4). Empty: "/", or if that is 404, the nearest path above the checked URL that ends
  /// with "/".
  std::string root;
  /// Resources that may be written. Their present representation is sent back by PUT, and bodies that the server must
  /// refuse are sent. A number in them is changed by a thousandth, an integer by one, and put back, so that there is a
  /// change of which subscriptions must tell.
  std::vector<std::string> write;
  std::vector<Invocation> invoke;  ///< actions that may be invoked
  /// Address and port where the check receives callbacks, "192.168.1.5:0"; the server must reach it. Empty: 127.0.0.1
  /// if the server is on this machine, otherwise callbacks are not testable.
  std::string callback_address;
  bool subscribe = true;  ///< WebSockets and callbacks are opened and ended again

  std::chrono::milliseconds total_time{120'000};  ///< for the whole check; what remains then is not testable
  std::chrono::milliseconds message_time{3'000};  ///< wait for a message of a subscription
  std::chrono::milliseconds close_time{1'000};    ///< wait for the end of a connection that must end
  std::size_t max_requests = 2'000;               ///< in all
  std::size_t max_resources = 40;                 ///< visited by following links
  std::size_t max_objects = 6;                    ///< links followed from one resource by one predicate or relation
  std::size_t max_body_bytes = 4 * 1024 * 1024;   ///< of a response; the rest is not read
  std::size_t max_header_bytes = 64 * 1024;       ///< of a response

  std::chrono::milliseconds merge_time{60'000};  ///< for reading and judging the merged documents
  std::size_t max_merged_documents = 1'000;      ///< of the server that are merged, beyond `max_resources`
  std::size_t max_merged_triples = 200'000;      ///< of these documents together
  std::size_t max_merged_steps = 20'000'000;     ///< of the validation of the merged documents
  std::size_t max_described_actions = 50;        ///< whose bindings are tried with OPTIONS
  std::size_t max_results = 100;                 ///< named of one check of the merged documents

  std::chrono::milliseconds slow_time{1'000};         ///< a server whose usual response takes longer is reported as slow
  std::function<void(const Progress& now)> progress;  ///< called by run() before each request; empty: not
};

/// Checks a server. Without `write` and `invoke` it sends GET, HEAD and OPTIONS, requests that a correct server
/// refuses, and subscriptions that it ends again.
///
/// @param url      of the server's root, or better of one Thing
/// @param options  what the check may do, and its limits
/// @par Errors   expected_iri, invalid_option; io_error, timed_out, closed, expected_http: no response from the URL;
///               failed: its status is not 2xx
/// @par Threads  Any. Blocks, at most `total_time` and one wait of the client's limits.
/// @par Implements  SPEC 1
LRT_API Result<Report> run(const std::string& url, const CheckOptions& options = {});

/// Options of to_text().
struct TextOptions {
  bool colour = false;  ///< ANSI escape sequences
  bool all = false;     ///< also what passed, with its evidence
};
/// The report for people: the violated requirements with their evidence, then a line for each requirement.
/// @par Threads  Any.
/// @par Time     Allocates. Performs no I/O.
LRT_API std::string to_text(const Report& report, const TextOptions& options = {});
/// The report as a JSON document.
/// @par Threads  Any.
/// @par Time     Allocates. Performs no I/O.
LRT_API std::string to_json(const Report& report);
/// The report in Turtle, with the terms of EARL 1.0 (W3C Working Draft of 2017): an earl:Assertion for each finding. A
/// failed `should` or `may` is earl:failed too; earl:info states the level.
/// @par Threads  Any.
/// @par Time     Allocates. Performs no I/O.
LRT_API std::string to_earl(const Report& report);

/// Exit status of a program. 0: no `must` has failed; 1: one has, or with `strict` a `should`; 2: the check could not
/// be run.
/// @par Threads  Any.
LRT_API int exit_status(const Result<Report>& report, bool strict = false) noexcept;

}  // namespace v0
}  // namespace lrt::check
