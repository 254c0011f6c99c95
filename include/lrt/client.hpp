// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/client/http.hpp>
#include <lrt/client/options.hpp>
#include <lrt/client/things.hpp>
#include <lrt/client/watch.hpp>
#include <lrt/client/typed.hpp>

namespace lrt {
inline namespace v0 {

/// Uses robots that are Linked Robotic Things, of lrt or of others. It is given one URL and finds the rest by links and shapes, never by known paths.
///
///     lrt::Client client = lrt::Client::create().value();
///     auto robot = client.open("http://127.0.0.1:8080/").value();
///     auto joint = robot.thing("right_s1").value();
///     double angle = joint.property(lrt::vocab::ros::rotation).value().read<double>(lrt::unit::radian).value();
///     auto run = joint.action("rotate").value().invoke(43.6F).value();
///     run.wait(std::chrono::seconds(10)).value();
///
/// Functions that ask a server wait for it, at most the times of client::Limits. A program with a loop of its own lets async() wait instead, and gets
/// results and changes in poll().
///
/// @par Threads  poll, wait: one thread at a time. All else: any.
/// @par Implements  R1.6
class LRT_API Client {
 public:
  /// @par Errors  invalid_option, io_error
  static Result<Client> create(client::Options options = {});
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  /// Calls stop().
  ~Client();

  /// Finds the Things that are linked, directly or through others, from a URL: by Link fields, by hybrit:property and hybrit:action, by members of
  /// containers, and by any other predicate whose object is of the same origin. The identity of the options is sent to this origin.
  /// @par Errors  of the exchange with this URL; limit_exceeded. What else cannot be read is in Robot::problems()
  Result<client::Robot> open(const std::string& url);
  /// A Property or an Action whose URL the program knows: nothing is read. The identity of the options is sent to its origin.
  /// @par Errors  expected_iri
  Result<client::Property> property(const std::string& url);
  Result<client::Action> action(const std::string& url);
  /// An invocation whose URL the program has kept.
  /// @par Errors  expected_iri
  Result<client::Invocation> invocation(const std::string& url);
  /// One resource. @par Errors  of the exchange; refused ... with the server's reason; unsupported_syntax: it has no RDF
  Result<client::RepresentationPtr> get(const std::string& url);
  /// Any request, within the limits.
  Result<client::Response> send(const client::Request& request);

  /// Begins to watch a resource. `on_change` gets its values, gaps, and the end, where Options::callbacks says: a refusal by the server is an end, too.
  /// The identity of the options is sent to its origin.
  /// @par Errors  expected_iri, invalid_option; closed: after stop()
  Result<client::Watch> watch(const std::string& url, const client::WatchOptions& options, client::OnChange on_change);

  /// Runs `work`, which may wait, on a thread of the client, and hands its result to `done` in poll(). At most 1,000 wait; then `work` gets no thread,
  /// and false is returned.
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

  /// Runs callbacks that are due: of watches and of async(). With Callbacks::in_background there is nothing to do. Never waits for a
  /// server. When nothing is due it makes no system call and takes no lock.
  /// @return  true: there is more
  bool poll(std::chrono::microseconds budget = std::chrono::microseconds(200)) noexcept;
  /// Waits until poll() has something to do, at most that long.
  void wait(std::chrono::milliseconds at_most) noexcept;
  /// Readable whenever poll() has something to do, for the host's own poll() or epoll.
  int descriptor() const noexcept;

  /// Ends all exchanges and watches. Callbacks that are due are not called any more.
  void stop() noexcept;

 private:
  Result<void> trust(const std::string& url);
  explicit Client(std::shared_ptr<client::Session> session) noexcept;
  bool post(UniqueFunction<UniqueFunction<void()>()> work);

  std::shared_ptr<client::Session> session_;
};

}  // namespace v0
}  // namespace lrt
