#pragma once
// The moves every edit of the octree is made of: open a slot for writing on the way down, close it on the way up.
#include "rayvox/octree/inner_node.hpp"

namespace rayvox {

/// The slot's inner node, owned by this slot alone: split from a leaf or unknown space, cloned if a snapshot shares it.
/// `slot_revision` is when the slot last changed; new children inherit it.
InnerNode& open_inner(Child& slot, std::uint64_t slot_revision);

/// Refreshes the summary of the slot's inner node; eight equal leaves become one leaf, eight unknown slots unknown
/// (OctoMap's pruning rule).
void close_inner(Child& slot);

}  // namespace rayvox
