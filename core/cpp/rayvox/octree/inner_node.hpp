#pragma once
// An inner node carries what multi-resolution queries and skipping need (extreme log-odds below it, whether anything
// below it is unknown) and, for change sets, the revision at which each child last changed.
#include <atomic>
#include <cstdint>
#include <limits>

#include "rayvox/octree/brick.hpp"
#include "rayvox/octree/child.hpp"

namespace rayvox {

/// What a slot says about everything below it.
struct Summary {
  float max_log_odds = -std::numeric_limits<float>::infinity();
  float min_log_odds = std::numeric_limits<float>::infinity();
  bool any_unknown = true;
};

Summary summary_of(const Child& slot);

struct InnerNode {
  std::atomic<std::uint32_t> references{1};
  Summary summary;
  Child child[8];
  std::uint64_t revision[8] = {};

  InnerNode() = default;
  InnerNode(const InnerNode& other) : summary(other.summary) {
    for (int i = 0; i < 8; ++i) {
      child[i] = other.child[i];
      revision[i] = other.revision[i];
    }
  }
  /// Recomputes the summary from the children.
  void refresh();
};

inline void Child::retain() const {
  if (kind() == Kind::inner) inner()->references.fetch_add(1, std::memory_order_relaxed);
  if (kind() == Kind::brick) brick()->references.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace rayvox
