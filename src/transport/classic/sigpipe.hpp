#pragma once

#include <csignal>
#include <mutex>

namespace lrt::transport {

/// Puts back at its end what SIGPIPE did at its beginning. Both libraries set it to be ignored in the whole process when their objects are
/// made; lrt leaves signals to the host, and writes to nobody with a signal.
class KeptSigpipe {
 public:
  KeptSigpipe() : lock_(mutex()) { ::sigaction(SIGPIPE, nullptr, &kept_); }
  ~KeptSigpipe() { ::sigaction(SIGPIPE, &kept_, nullptr); }
  KeptSigpipe(const KeptSigpipe&) = delete;
  KeptSigpipe& operator=(const KeptSigpipe&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }

  std::lock_guard<std::mutex> lock_;
  struct sigaction kept_ {};
};

}  // namespace lrt::transport
