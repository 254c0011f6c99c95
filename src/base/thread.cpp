// SPDX-License-Identifier: Apache-2.0
#include "src/base/thread.hpp"

#include <dlfcn.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "src/base/blocked_signals.hpp"
#include "src/base/turns.hpp"

namespace lrt {
namespace {

/// The scheduling settings of the process: read when lrt is loaded, because the host may change them for its own threads later.
struct Environment {
  cpu_set_t cpus;
  bool knows_cpus;  ///< false on a machine with more CPUs than a cpu_set_t has
  int nice;

  Environment() noexcept : knows_cpus(::sched_getaffinity(0, sizeof cpus, &cpus) == 0), nice(::getpriority(PRIO_PROCESS, 0)) {}
};
const Environment& at_start() noexcept {
  static const Environment environment;
  return environment;
}
[[maybe_unused]] const Environment& loaded = at_start();

/// Threads run code of this object. A host that closes it must not unmap that code.
void keep_loaded() noexcept {
  [[maybe_unused]] static const bool kept = [] {
    Dl_info about{};
    if (::dladdr(reinterpret_cast<const void*>(&at_start), &about) == 0 || about.dli_fname == nullptr) return false;
    return ::dlopen(about.dli_fname, RTLD_NOW | RTLD_NOLOAD | RTLD_NODELETE) != nullptr;
  }();
}

int number_of(Scheduling policy) noexcept {
  switch (policy) {
    case Scheduling::fifo: return SCHED_FIFO;
    case Scheduling::round_robin: return SCHED_RR;
    case Scheduling::normal: break;
  }
  return SCHED_OTHER;
}

/// The caller's policy would not be inherited as a real-time one. SCHED_BATCH and SCHED_IDLE are settings of the operator for the process.
bool is_real_time(int policy) noexcept { return policy != SCHED_OTHER && policy != SCHED_BATCH && policy != SCHED_IDLE; }

Unexpected refused(const std::string& what, int error) {
  return unexpected(Errc::invalid_option, "thread options: " + what + ": " + std::system_category().message(error));
}

/// The attributes of a thread, made of options.
class Attributes {
 public:
  Attributes() noexcept { ::pthread_attr_init(&attributes_); }
  ~Attributes() { ::pthread_attr_destroy(&attributes_); }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;
  const pthread_attr_t* get() const noexcept { return &attributes_; }

  Result<void> set(const ThreadOptions& options) {
    if (Result<void> set = schedule(options); !set) return set;
    if (options.stack_bytes != 0)
      if (const int error = ::pthread_attr_setstacksize(&attributes_, options.stack_bytes); error != 0)
        return refused("a stack of " + std::to_string(options.stack_bytes) + " bytes", error);
    return bind(options.cpus);
  }

 private:
  Result<void> schedule(const ThreadOptions& options) {
    const int policy = number_of(options.policy);
    if (options.priority < ::sched_get_priority_min(policy) || options.priority > ::sched_get_priority_max(policy))
      return refused("priority " + std::to_string(options.priority) + " of this policy", EINVAL);
    if (options.policy == Scheduling::normal && !is_real_time(::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK)) return {};
    sched_param parameter{};
    parameter.sched_priority = options.priority;
    int error = ::pthread_attr_setinheritsched(&attributes_, PTHREAD_EXPLICIT_SCHED);
    if (error == 0) error = ::pthread_attr_setschedpolicy(&attributes_, policy);
    if (error == 0) error = ::pthread_attr_setschedparam(&attributes_, &parameter);
    if (error != 0) return refused("the policy", error);
    return {};
  }

  Result<void> bind(const std::vector<unsigned>& numbers) {
    if (numbers.empty()) return {};
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    for (const unsigned cpu : numbers) {
      if (cpu >= CPU_SETSIZE) return refused("CPU " + std::to_string(cpu), EINVAL);
      CPU_SET(cpu, &cpus);
    }
    if (const int error = ::pthread_attr_setaffinity_np(&attributes_, sizeof cpus, &cpus); error != 0) return refused("the CPUs", error);
    return {};
  }

  pthread_attr_t attributes_;
};

struct Start {
  char name[16] = {};
  bool has_cpus = false;  ///< from the options
  UniqueFunction<void()> run;
};

void* begin(void* given) noexcept {
  const std::unique_ptr<Start> start(static_cast<Start*>(given));
  ::pthread_setname_np(::pthread_self(), start->name);
  const Environment& process = at_start();
  // Both concern this thread only. They may fail: the CPUs of a container can change.
  if (!start->has_cpus && process.knows_cpus) ::sched_setaffinity(0, sizeof process.cpus, &process.cpus);
  if (::getpriority(PRIO_PROCESS, 0) < process.nice) ::setpriority(PRIO_PROCESS, 0, process.nice);
  start->run();
  return nullptr;
}

}  // namespace

void Thread::join() noexcept {
  if (std::exchange(joinable_, false)) ::pthread_join(id_, nullptr);
}
void Thread::detach() noexcept {
  if (std::exchange(joinable_, false)) ::pthread_detach(id_);
}

Result<Thread> start_thread(const char* name, const ThreadOptions& options, UniqueFunction<void()> run) {
  keep_loaded();
  Attributes attributes;
  if (Result<void> set = attributes.set(options); !set) return Unexpected{std::move(set).error()};
  auto start = std::make_unique<Start>();
  std::string(name).copy(start->name, sizeof start->name - 1);
  char named[sizeof start->name];
  std::copy(std::begin(start->name), std::end(start->name), named);
  start->has_cpus = !options.cpus.empty();
  start->run = std::move(run);
  Thread thread;
  int error = 0;
  {
    const BlockedSignals blocked;  // the new thread inherits the mask
    error = ::pthread_create(&thread.id_, attributes.get(), &begin, start.get());
  }
  if (error == EPERM) return refused("policy and priority (they need CAP_SYS_NICE or a limit RLIMIT_RTPRIO)", error);
  if (error == EINVAL) return refused("the process may not run on these CPUs", error);
  if (error != 0) return unexpected(Errc::io_error, std::string("starting the thread ") + name + ": " + std::system_category().message(error));
  static_cast<void>(start.release());
  thread.joinable_ = true;
  ::pthread_setname_np(thread.id_, named);  // the thread may not have done this yet
  return thread;
}

namespace {
thread_local Turns* turns_of_this_thread = nullptr;
}

Turns* Turns::current() noexcept { return turns_of_this_thread; }
Turns* Turns::set_current(Turns* turns) noexcept { return std::exchange(turns_of_this_thread, turns); }

}  // namespace lrt
