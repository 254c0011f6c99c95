// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/client/control.hpp>
#include <lrt/client/http.hpp>
#include <lrt/client/options.hpp>
#include <lrt/client/things.hpp>
#include <lrt/client/watch.hpp>
#include <lrt/client/typed.hpp>

namespace lrt {
inline namespace v0 {

/// A client for robots that are Linked Robotic Things, of lrt or of others. It gets one URL and finds the rest by links
/// and shapes, never by known paths.
///
///     lrt::Client client = lrt::Client::create().value();
///     auto robot = client.open("http://127.0.0.1:8080/").value();
///     auto joint = robot.thing("right_s1").value();
///     double angle = joint.property("position").value().read<double>(lrt::unit::radian).value();
///     auto run = joint.action("rotate").value().invoke(43.6).value();
///     run.wait(std::chrono::seconds(10)).value();
///
/// Functions that send requests block until the response, at most the times of client::Limits. A program with its own
/// loop passes blocking calls to async(), and gets results and changes in poll().
///
/// @par Errors   of an exchange: timed_out, io_error (no connection, TLS), expected_http (an invalid response),
///               limit_exceeded (client::Limits), closed (after stop()); for a status of 400 or more see
///               client::Action::invoke().
/// @par Threads  poll, wait: one thread at a time. The others: any.
/// @par Implements  R1.6
class LRT_API Client {
 public:
  /// Makes a client. It connects to nothing yet.
  /// @par Errors  invalid_option, io_error
  static Result<Client> create(client::Options options = {});
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  /// Calls stop().
  ~Client();

  /// Finds the Things that are linked, directly or through others, from a URL: by Link fields, by hybrit:property and
  /// hybrit:action, by members of containers, and by any other predicate whose object is of the same origin. The
  /// identity of the options is sent to this origin.
  /// @par Errors  of the exchange with this URL; limit_exceeded. Robot::problems() lists other resources that cannot be
  ///              read
  Result<client::Robot> open(const std::string& url);
  /// @{
  /// A Property or an Action with a known URL. Nothing is requested yet. The identity of the options is sent to its
  /// origin.
  /// @par Errors  expected_iri
  Result<client::Property> property(const std::string& url);
  Result<client::Action> action(const std::string& url);
  /// @}
  /// An invocation with a known URL. Nothing is requested yet.
  /// @par Errors  expected_iri
  Result<client::Invocation> invocation(const std::string& url);
  /// GET of one resource.
  /// @par Errors  of the exchange; refused and others with the server's reason; unsupported_syntax: it has no RDF
  Result<client::RepresentationPtr> get(const std::string& url);
  /// Sends any request, within the limits. A response with a status of 400 or more is not an error.
  Result<client::Response> send(const client::Request& request);

  /// Begins to watch a resource. `on_change` gets its values, gaps, and the end (also a refusal by the server), on the
  /// thread of Options::callbacks. The identity of the options is sent to its origin.
  /// @par Errors  expected_iri, invalid_option; closed: after stop(); io_error: no thread for it
  Result<client::Watch> watch(const std::string& url, const client::WatchOptions& options, client::OnChange on_change);

  /// Takes control of a Thing and of all Things below it (lrt:control), and renews it until the result is destroyed.
  /// Commands of this client to the server of the Thing then have control, and those of others get 409.
  /// @param thing    URL of the Thing. The identity of the options is sent to its origin
  /// @param on_lost  see client::OnControlLost; on the thread of Options::callbacks. Empty: none
  /// @par Errors  unknown_path: the Thing has no control; refused: another client has control, or the right is missing, with
  ///              the server's reason; invalid_option; of an exchange
  Result<client::Control> control(const std::string& thing, const client::ControlOptions& options = {}, client::OnControlLost on_lost = {});

  /// Runs `work`, which may block, on a thread of the client, and calls `done` with its result: in poll(), or with
  /// Callbacks::in_background on that thread.
  /// @param work  callable without parameters
  /// @param done  callable of the result of `work`
  /// @return      false: 1,000 calls wait already, or the client was stopped; neither is called
  template <class Work, class Done>
  bool async(Work work, Done done) {
    return post([work = std::move(work), done = std::move(done)]() mutable -> UniqueFunction<void()> {
      using R = std::invoke_result_t<Work&>;
      if constexpr (std::is_void_v<R>) {
        work();
        return [done = std::move(done)]() mutable { done(); };
      } else {
        return [done = std::move(done), result = work()]() mutable { done(std::move(result)); };
      }
    });
  }

  /// Runs due callbacks: of watches and of async(). Not needed with Callbacks::in_background. Never waits for a server.
  /// When nothing is due it makes no system call and takes no lock.
  /// @param budget  time after which no further callback is started
  /// @return        true: more callbacks are due
  bool poll(std::chrono::microseconds budget = std::chrono::microseconds(200)) noexcept;
  /// Waits until poll() has work, at most this time.
  void wait(std::chrono::milliseconds at_most) noexcept;
  /// A descriptor that is readable whenever poll() has work, for the host's own poll() or epoll.
  int descriptor() const noexcept;

  /// Ends all exchanges and watches. Due callbacks are not called any more.
  void stop() noexcept;

 private:
  Result<void> trust(const std::string& url);
  explicit Client(std::shared_ptr<client::Session> session) noexcept;
  bool post(UniqueFunction<UniqueFunction<void()>()> work);

  std::shared_ptr<client::Session> session_;
};

}  // namespace v0
}  // namespace lrt
