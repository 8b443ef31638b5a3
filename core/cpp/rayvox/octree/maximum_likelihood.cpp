#include "rayvox/octree/maximum_likelihood.hpp"

#include "rayvox/octree/edit.hpp"

namespace rayvox {
namespace {

float most_likely(float log_odds, const SensorModel& model) {
  return model.is_occupied(log_odds) ? model.clamp_max_log_odds : model.clamp_min_log_odds;
}

Child most_likely(const Child& slot, const SensorModel& model) {
  if (slot.is_unknown()) return Child();
  if (slot.is_leaf()) return Child::leaf(most_likely(slot.leaf_log_odds(), model));
  if (slot.kind() == Child::Kind::brick) {
    OpenBrick open = OpenBrick::of(slot);
    for (float& log_odds : open.log_odds) log_odds = most_likely(log_odds, model);
    return open.close();
  }
  Child copy;
  InnerNode& node = open_inner(copy, 0);
  for (int i = 0; i < 8; ++i) node.child[i] = most_likely(slot.inner()->child[i], model);
  close_inner(copy);
  return copy;
}

}  // namespace

MapSnapshot maximum_likelihood(const MapSnapshot& map) {
  MapSnapshot copy = map;
  copy.root = most_likely(map.root, map.model);
  return copy;
}

}  // namespace rayvox
