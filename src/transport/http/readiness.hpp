#pragma once

#include <sys/epoll.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "src/transport/http/list.hpp"
#include "src/transport/http/socket.hpp"

namespace lrt::transport {

class Client;
struct LaterTag;

/// Base of what waits in a Readiness.
class Watched : public Linked<LaterTag> {
 public:
  /// @param events  of epoll_wait(2). They may be outdated: what happened since then is for the system calls to tell.
  virtual void on_ready(std::uint32_t events) = 0;
  /// What it left for Readiness::later().
  virtual void go_on() {}

 protected:
  Watched() = default;
  ~Watched() = default;
};

/// What waits for its descriptor, as one epoll set: level-triggered, so that a keep-alive connection is registered once and what the budget
/// leaves over is not lost. One thread.
///
/// It serves in rounds, over as many calls as the budgets make of it: those that are ready when the round begins, then those that wished
/// before to go on later. So nobody who always has something to do keeps another waiting.
class Readiness {
 public:
  bool open();
  /// Also everybody who is buried.
  void close() noexcept;
  bool is_open() const noexcept { return set_.is_open(); }
  /// Of the set; readable while somebody is ready.
  int descriptor() const noexcept { return set_.descriptor(); }

  /// Watched::on_ready() follows whenever one of `events` is there, or an error. Replaces who watched before, and what for.
  /// False: the system has no room for it.
  bool watch(Socket& socket, Watched& by, std::uint32_t events) noexcept;
  /// For a descriptor that is not ours; once.
  bool add(int descriptor, Watched& by, std::uint32_t events) noexcept;
  /// Closes the socket. An event that has been told already may still come.
  void close(Socket& socket) noexcept;

  /// Watched::go_on() follows after what is ready now.
  void later(Watched& watched) noexcept {
    if (!watched.is_linked()) later_.push_back(watched);
  }
  /// serve() would find something to do without asking the system.
  bool has_left() const noexcept { return next_ < count_ || !turns_.empty() || !later_.empty(); }

  /// Waits until somebody is ready, then serves until nobody is. False when the budget ended that.
  /// @param wait  milliseconds; 0: one system call when nobody is ready
  bool serve(int wait);

  /// Keeps what was closed until no event can point to it and none of its functions is under way.
  void bury(std::shared_ptr<Client> client);
  /// None is under way.
  void forget_buried() noexcept;
  /// The same, and what the budget left over of this round is dropped: it will be told again.
  void drop() noexcept;

  /// The budget begins with the next step, and allows at least that.
  void set_budget(std::chrono::microseconds budget) noexcept {
    budget_ = budget;
    end_.reset();
  }
  /// Whether the budget that set_budget() gave is used up.
  bool is_over() noexcept;

 private:
  bool serve_round();
  void begin_budget() noexcept;

  Socket set_;
  std::array<epoll_event, 128> events_;  ///< of this round
  int next_ = 0;                         ///< of them
  int count_ = 0;
  List<Watched, LaterTag> turns_;  ///< of this round
  List<Watched, LaterTag> later_;
  std::chrono::microseconds budget_{0};
  std::optional<std::chrono::steady_clock::time_point> end_;
  std::vector<std::shared_ptr<Client>> buried_;
};

}  // namespace lrt::transport
