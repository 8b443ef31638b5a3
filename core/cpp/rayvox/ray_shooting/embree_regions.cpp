#include "rayvox/ray_shooting/embree_regions.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/parallel/parallel_for.hpp"
#include "rayvox/ray_shooting/embree_shooting.hpp"

namespace rayvox {
namespace {

constexpr float least_reach = 4096;
// Some hundred bytes each in Embree's hierarchy.
constexpr std::size_t most_nodes_kept = std::size_t{1} << 20;

void write_bounds(const embree::BoundsFunctionArguments* arguments) {
  const auto& region = *static_cast<const EmbreeRegions::Region*>(arguments->geometry_data);
  const ChangeableNode& node = region.nodes[arguments->primitive];
  const EmbreeRegions::Frame& frame = *region.frame;
  const float farthest = 2 * frame.reach;
  float lower[3], upper[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Nodes of unknown space may be larger than float32 counts exactly; no ray of the frame leaves its reach.
    const double low = static_cast<double>(node.first[axis]) - frame.anchor[axis];
    const double high = low + static_cast<double>(std::int64_t{1} << node.level);
    lower[axis] = static_cast<float>(std::clamp<double>(low, -farthest, farthest)) - frame.widening();
    upper[axis] = static_cast<float>(std::clamp<double>(high, -farthest, farthest)) + frame.widening();
  }
  *arguments->bounds = {lower[0], lower[1], lower[2], 0, upper[0], upper[1], upper[2], 0};
}

// Nodes that rays no longer need are cheaper than a rebuild while they are few.
bool mostly_needed(std::uint64_t covered, std::uint64_t needed) {
  return 8 * std::popcount(covered) <= 9 * std::popcount(needed);
}

}  // namespace

struct EmbreeRegions::FoundTile {
  const Child* slot;
  std::uint64_t slot_revision, code;
  Cell first;
  Region* region = nullptr;
};

EmbreeRegions::EmbreeRegions() : embree_(EmbreeLibrary::get()), scene_(embree_.call().NewScene(embree_.device())) {
  // Low quality is Embree's two-level build: a geometry that did not change keeps its hierarchy.
  embree_.call().SetSceneBuildQuality(scene_, embree::quality_low);
  embree_.call().SetSceneFlags(scene_, static_cast<embree::SceneFlags>(embree::flag_dynamic | embree::flag_robust));
  coarse_.frame = &frame_;
  coarse_.id = next_id_++;
}

EmbreeRegions::~EmbreeRegions() {
  clear();
  embree_.call().ReleaseScene(scene_);
}

void EmbreeRegions::clear() {
  const auto drop = [&](Region& region) {
    if (!region.geometry) return;
    embree_.call().DetachGeometry(scene_, region.id);
    embree_.call().ReleaseGeometry(region.geometry);
    region.geometry = nullptr;
    node_count_ -= region.nodes.size();
    region.nodes.clear();
  };
  drop(coarse_);
  for (auto& [code, region] : tiles_) {
    drop(*region);
    free_ids_.push_back(region->id);
  }
  tiles_.clear();
}

void EmbreeRegions::keep_within_reach(const CellBox& box) {
  float needed = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    needed = std::max({needed, std::abs(static_cast<float>(box.low[axis]) - static_cast<float>(frame_.anchor[axis])),
                       std::abs(static_cast<float>(box.high[axis]) - static_cast<float>(frame_.anchor[axis]))});
  }
  if (needed + 2 < frame_.reach) return;
  clear();
  float extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame_.anchor[axis] = box.low[axis] + (box.high[axis] - box.low[axis]) / 2;
    extent = std::max(extent, static_cast<float>(box.high[axis]) - static_cast<float>(box.low[axis]));
  }
  frame_.reach = std::max(least_reach, 2 * extent);
}

void EmbreeRegions::find(const MapSnapshot& map, const CellBox& box, std::vector<FoundTile>& tiles,
                         std::vector<ChangeableNode>& coarse) const {
  const int tile_level = map.geometry.tile_level();
  const auto visit = [&](const auto& self, const Child& slot, std::uint64_t slot_revision, int level,
                         const Cell& first) -> void {
    if (!box.overlaps(first, level)) return;
    if (slot.kind() <= Child::Kind::leaf) {
      if (is_changeable(slot, map.model.clamp_min_log_odds)) coarse.push_back({first, level});
    } else if (level == tile_level) {
      tiles.push_back({&slot, slot_revision, map.geometry.morton_of(first) >> (3 * tile_level), first, nullptr});
    } else {
      if (!is_changeable(slot, map.model.clamp_min_log_odds)) return;
      const InnerNode& node = *slot.inner();
      for (int i = 0; i < 8; ++i) {
        self(self, node.child[i], node.revision[i], level - 1, child_cell(first, level, i));
      }
    }
  };
  visit(visit, map.root, map.root_revision, map.geometry.depth(), root_cell(map.geometry));
}

void EmbreeRegions::commit(Region& region) {
  const embree::Functions& call = embree_.call();
  if (!region.geometry) {
    region.geometry = call.NewGeometry(embree_.device(), embree::user_geometry);
    call.SetGeometryBuildQuality(region.geometry, embree::quality_low);
    call.SetGeometryUserData(region.geometry, &region);
    call.SetGeometryBoundsFunction(region.geometry, write_bounds, nullptr);
    call.SetGeometryOccludedFunction(region.geometry, take_candidates);
    call.AttachGeometryByID(scene_, region.geometry, region.id);
  }
  call.SetGeometryUserPrimitiveCount(region.geometry, static_cast<std::uint32_t>(region.nodes.size()));
  call.CommitGeometry(region.geometry);
  region.rebuild = false;
}

void EmbreeRegions::follow(const MapSnapshot& map, const CellBox& box) {
  keep_within_reach(box);
  std::vector<FoundTile> found;
  std::vector<ChangeableNode> coarse;
  find(map, box, found, coarse);

  std::vector<FoundTile*> changed;
  for (FoundTile& tile : found) {
    std::unique_ptr<Region>& region = tiles_[tile.code];
    if (!region) {
      region = std::make_unique<Region>();
      region->frame = &frame_;
      region->rebuild = true;
      if (free_ids_.empty()) {
        region->id = next_id_++;
      } else {
        region->id = free_ids_.back();
        free_ids_.pop_back();
      }
    }
    tile.region = region.get();
    region->last_used = map.revision;
    if (region->rebuild || tile.slot_revision > region->revision) changed.push_back(&tile);
  }

  const int tile_level = map.geometry.tile_level();
  std::vector<std::size_t> nodes_before(changed.size());
  parallel_for(changed.size(), [&](std::size_t i, int) {
    const FoundTile& tile = *changed[i];
    Region& region = *tile.region;
    nodes_before[i] = region.nodes.size();
    const std::uint64_t needed = changeable_blocks(*tile.slot, tile_level, map.model.clamp_min_log_odds);
    region.revision = map.revision - 1;
    if (!region.rebuild && (needed & ~region.covered) == 0 && mostly_needed(region.covered, needed)) return;
    region.rebuild = true;
    // What was covered may soon be needed again: cells at surfaces go to and fro.
    region.covered = mostly_needed(needed | region.covered, needed) ? needed | region.covered : needed;
    region.nodes = nodes_of_blocks(region.covered, tile.first, tile_level);
  });

  bool rebuilt = false;
  if (!coarse_.geometry || coarse != coarse_.nodes) {
    node_count_ += coarse.size() - coarse_.nodes.size();
    coarse_.nodes = std::move(coarse);
    commit(coarse_);
    rebuilt = true;
  }
  for (std::size_t i = 0; i < changed.size(); ++i) {
    Region& region = *changed[i]->region;
    if (!region.rebuild) continue;
    node_count_ += region.nodes.size() - nodes_before[i];
    commit(region);
    rebuilt = true;
  }
  if (node_count_ > most_nodes_kept) rebuilt |= forget_unused();
  if (!rebuilt) return;
  embree_.call().CommitScene(scene_);
  if (const int error = embree_.call().GetDeviceError(embree_.device())) {
    throw Error("Embree failed to build its scene: error " + std::to_string(error));
  }
}

bool EmbreeRegions::forget_unused() {
  const std::size_t before = tiles_.size();
  std::uint64_t newest = 0;
  for (const auto& [code, region] : tiles_) newest = std::max(newest, region->last_used);
  for (auto entry = tiles_.begin(); entry != tiles_.end();) {
    Region& region = *entry->second;
    if (region.last_used == newest) {
      ++entry;
      continue;
    }
    embree_.call().DetachGeometry(scene_, region.id);
    embree_.call().ReleaseGeometry(region.geometry);
    node_count_ -= region.nodes.size();
    free_ids_.push_back(region.id);
    entry = tiles_.erase(entry);
  }
  return tiles_.size() < before;
}

}  // namespace rayvox
