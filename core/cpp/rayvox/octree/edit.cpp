#include "rayvox/octree/edit.hpp"

#include <algorithm>

namespace rayvox {

InnerNode& open_inner(Child& slot, std::uint64_t slot_revision) {
  if (slot.kind() != Child::Kind::inner) {
    auto* node = new InnerNode;
    std::fill(std::begin(node->child), std::end(node->child), slot);
    std::fill(std::begin(node->revision), std::end(node->revision), slot_revision);
    slot = Child::adopt(node);
  } else if (slot.inner()->references.load(std::memory_order_acquire) != 1) {
    slot = Child::adopt(new InnerNode(*slot.inner()));
  }
  return *slot.inner();
}

void close_inner(Child& slot) {
  InnerNode& node = *slot.inner();
  const Child& first = node.child[0];
  const auto same = [&](const Child& other) {
    return other.kind() == first.kind() && (first.is_unknown() || other.leaf_log_odds() == first.leaf_log_odds());
  };
  if (first.kind() <= Child::Kind::leaf && std::all_of(node.child + 1, node.child + 8, same)) {
    slot = Child(first);
  } else {
    node.refresh();
  }
}

}  // namespace rayvox
