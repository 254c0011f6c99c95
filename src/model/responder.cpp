// SPDX-License-Identifier: Apache-2.0
#include <lrt/responder.hpp>

#include <algorithm>
#include <cmath>
#include <mutex>

namespace lrt::model {

SharedInvocation::~SharedInvocation() { finish(unexpected(Errc::dropped, "the responder was destroyed before succeed() or fail()")); }

void SharedInvocation::finish(Result<rdf::Value> result) noexcept {
  if (!finished_.exchange(true, std::memory_order_acq_rel)) link_->finish(std::move(result));
}

namespace {

/// An invocation in parts. It owns the responder of the whole; the links of the parts own it. The whole's on_cancel refers to it weakly, so that
/// the last copy of the whole is destroyed with the last part.
class SplitInvocation {
 public:
  SplitInvocation(Responder whole, std::size_t parts) : whole_(std::move(whole)), parts_(parts), unfinished_(parts) {}

  void finish(std::size_t index, const Result<rdf::Value>& result) noexcept {
    UniqueFunction<void()> hook;  // destroyed without the lock: its captures are the user's
    bool last = false;
    {
      const std::lock_guard lock(mutex_);
      Part& part = parts_[index];
      if (part.finished) return;
      part.finished = true;
      hook = std::move(part.hook);
      last = --unfinished_ == 0;
    }
    try {
      if (!result) whole_.fail(result.error());
      else if (last) whole_.succeed();
    } catch (...) {  // out of memory: the whole ends when its last copy is destroyed
    }
    if (result) progress(index, 1);
    else cancel();
  }

  void progress(std::size_t index, double fraction) noexcept {
    if (std::isnan(fraction)) return;
    parts_[index].fraction.store(std::clamp(fraction, 0.0, 1.0), std::memory_order_relaxed);
    double sum = 0;
    for (const Part& part : parts_) sum += part.fraction.load(std::memory_order_relaxed);
    whole_.progress(sum / static_cast<double>(parts_.size()));
  }

  bool cancelled() const noexcept { return cancelled_.load(std::memory_order_acquire); }

  void on_cancel(std::size_t index, UniqueFunction<void()> hook) {
    {
      const std::lock_guard lock(mutex_);
      if (!cancelled()) return std::swap(parts_[index].hook, hook);
    }
    hook();
  }

  /// Cancels the parts that have not finished.
  void cancel() noexcept {
    std::vector<UniqueFunction<void()>> hooks;
    try {
      const std::lock_guard lock(mutex_);
      cancelled_.store(true, std::memory_order_release);
      for (Part& part : parts_)
        if (part.hook) hooks.push_back(std::move(part.hook));
    } catch (...) {  // out of memory: these hooks do not run, cancelled() is true
    }
    for (UniqueFunction<void()>& hook : hooks) {
      try {
        hook();
      } catch (...) {  // thrown by the user's hook: the others run nevertheless
      }
    }
  }

 private:
  struct Part {
    std::atomic<double> fraction{0};
    bool finished = false;
    UniqueFunction<void()> hook;
  };

  const Responder whole_;
  std::mutex mutex_;  // guards the state of the parts except their fractions, and unfinished_
  std::vector<Part> parts_;
  std::size_t unfinished_;
  std::atomic<bool> cancelled_{false};
};

class PartLink final : public InvocationLink {
 public:
  PartLink(std::shared_ptr<SplitInvocation> whole, std::size_t index) : whole_(std::move(whole)), index_(index) {}
  void finish(Result<rdf::Value> result) noexcept override { whole_->finish(index_, result); }
  void progress(double fraction) noexcept override { whole_->progress(index_, fraction); }
  bool cancelled() const noexcept override { return whole_->cancelled(); }
  void on_cancel(UniqueFunction<void()> hook) override { whole_->on_cancel(index_, std::move(hook)); }

 private:
  const std::shared_ptr<SplitInvocation> whole_;
  const std::size_t index_;
};

}  // namespace
}  // namespace lrt::model

namespace lrt {

std::vector<Responder> Responder::split(std::size_t parts) const {
  if (parts == 0) {
    succeed();
    return {};
  }
  const auto whole = std::make_shared<model::SplitInvocation>(*this, parts);
  std::vector<Responder> responders;
  for (std::size_t i = 0; i < parts; ++i) responders.emplace_back(std::make_shared<model::PartLink>(whole, i));
  on_cancel([weak = std::weak_ptr(whole)] {
    if (const auto split = weak.lock()) split->cancel();
  });
  return responders;
}

}  // namespace lrt
