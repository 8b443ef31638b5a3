#pragma once
// The Embree scene that scans are shot through (Min, Han, Kim 2021, section IV-B): the octree nodes that a ray could
// still change, of all labels, as axis-aligned boxes. It belongs to a map's writer and follows the map: one geometry
// per tile, rebuilt only where a cell became changeable that the geometry does not cover, or where most of what it
// covers no longer is. What it covers beyond the need costs time, never correctness.
#include <memory>
#include <unordered_map>
#include <vector>

#include "rayvox/octree/box.hpp"
#include "rayvox/octree/map_snapshot.hpp"
#include "rayvox/ray_shooting/changeable_blocks.hpp"
#include "rayvox/ray_shooting/embree_library.hpp"

namespace rayvox {

class EmbreeRegions {
 public:
  /// Throws EngineUnavailable without Embree.
  EmbreeRegions();
  ~EmbreeRegions();
  EmbreeRegions(const EmbreeRegions&) = delete;
  EmbreeRegions& operator=(const EmbreeRegions&) = delete;

  /// Makes the scene cover every cell of the box that a ray could change, in the map as it was before the revision
  /// that is being made. Uses all threads.
  void follow(const MapSnapshot& map, const CellBox& box);

  const EmbreeLibrary& embree() const { return embree_; }
  embree::SceneHandle* scene() const { return scene_; }
  /// The cell that the scene's coordinates count from.
  const Cell& anchor() const { return frame_.anchor; }
  /// Nodes in the scene.
  std::size_t node_count() const { return node_count_; }

  /// Where the boxes lie: float32 voxel units from an anchor near the scans, so that a map far from its origin is as
  /// exact as one at it; widened by more than the rounding of rays and traversal within `reach` voxels of the anchor.
  struct Frame {
    Cell anchor{};
    float reach = 0;
    float widening() const { return reach * 0x1p-19f; }
  };
  /// The nodes of one geometry.
  struct Region {
    const Frame* frame;
    std::vector<ChangeableNode> nodes;
    std::uint64_t covered = 0;   // changeable_blocks
    std::uint64_t revision = 0;  // of the map when `covered` was last found to do
    std::uint64_t last_used = 0;
    std::uint32_t id = 0;
    embree::GeometryHandle* geometry = nullptr;
    bool rebuild = false;
  };

 private:
  struct FoundTile;
  void keep_within_reach(const CellBox& box);
  void find(const MapSnapshot& map, const CellBox& box, std::vector<FoundTile>& tiles,
            std::vector<ChangeableNode>& coarse) const;
  void commit(Region& region);
  bool forget_unused();
  void clear();

  const EmbreeLibrary& embree_;
  embree::SceneHandle* scene_;
  Frame frame_;
  Region coarse_;                                                     // nodes above the tiles
  std::unordered_map<std::uint64_t, std::unique_ptr<Region>> tiles_;  // by Morton code, in tiles
  std::vector<std::uint32_t> free_ids_;
  std::uint32_t next_id_ = 0;
  std::size_t node_count_ = 0;
};

}  // namespace rayvox
