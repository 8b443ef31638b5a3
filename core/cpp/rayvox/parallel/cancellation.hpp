#pragma once
#include <atomic>

#include "rayvox/error.hpp"

namespace rayvox {

/// Tells work in other threads that nobody waits for its result any more. Thread-safe; once cancelled it stays so.
class CancellationToken {
 public:
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

  /// Called by the work between two pieces of it. Throws Cancelled.
  void throw_if_cancelled() const {
    if (cancelled()) throw Cancelled("the query was cancelled");
  }

 private:
  std::atomic<bool> cancelled_{false};
};

}  // namespace rayvox
