#include "rayvox/octree/inner_node.hpp"

#include <algorithm>

namespace rayvox {

void Child::release() const {
  if (kind() == Kind::inner) {
    if (inner()->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete inner();
  } else {
    if (brick()->references.fetch_sub(1, std::memory_order_acq_rel) == 1) Brick::destroy(brick());
  }
}

Summary summary_of(const Child& slot) {
  switch (slot.kind()) {
    case Child::Kind::leaf: return {slot.leaf_log_odds(), slot.leaf_log_odds(), false};
    case Child::Kind::inner: return slot.inner()->summary;
    case Child::Kind::brick:
      return {slot.brick()->max_log_odds(), slot.brick()->min_log_odds(), slot.brick()->any_unknown()};
    case Child::Kind::unknown: break;
  }
  return {};
}

void InnerNode::refresh() {
  Summary all{-std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(), false};
  for (const Child& slot : child) {
    const Summary part = summary_of(slot);
    all.max_log_odds = std::max(all.max_log_odds, part.max_log_odds);
    all.min_log_odds = std::min(all.min_log_odds, part.min_log_odds);
    all.any_unknown |= part.any_unknown;
  }
  summary = all;
}

}  // namespace rayvox
