#pragma once
#include <cstdint>
#include <vector>

#include "rayvox/map_collision/check_poses.hpp"
#include "rayvox/map_collision/placed_body.hpp"
#include "rayvox/octree/node_cursor.hpp"

namespace rayvox {

/// The simultaneous traversal of a link's hierarchy and an octree: down the octree, where it holds what counts, with a
/// front of the hierarchy's boxes that meet the node. One thread's.
class OctreeDescent {
 public:
  OctreeDescent(const MapSnapshot& map, const MapCheckOptions& options, const CollisionKernels& kernels)
      : map_(map), options_(options), kernels_(kernels) {}

  void start_pose(std::uint32_t pose);
  /// Adds what the placed body meets; true if nothing more can change the pose's answer.
  bool check_link(PlacedBody& body, std::uint32_t link);
  MapVerdict verdict() const {
    return occupied_ ? MapVerdict::occupied : unknown_ ? MapVerdict::unknown : MapVerdict::free;
  }
  std::vector<VoxelContact>& contacts() { return contacts_; }

 private:
  // Boxes that still count: some lanes of a block.
  struct Entry {
    std::uint32_t block, lanes;
  };
  // A range of `front_`.
  struct Front {
    std::size_t begin, end;
  };
  // The one at hand.
  struct Octant {
    Cell first;
    LocalCube cube;
    LocalCells cells;
  };
  // A node, or some cells of an octant, that no triangle meets.
  struct Untouched {
    NodeCursor node;
    Cell first;
    std::uint64_t cells;
  };

  /// Whether a node holds what counts for the answer; which octants of a brick do.
  bool counts(const NodeCursor& node) const;
  unsigned octants_that_count(const Brick& brick) const;
  bool unknown_counts() const {
    return options_.unknown_is_occupied && (!unknown_ || options_.contacts == Contacts::all);
  }
  /// Whether these contacts leave nothing to ask.
  bool enough(std::uint64_t met) const { return met && options_.contacts != Contacts::all; }
  unsigned children_in_reach(const Cell& first, int level) const;
  void approach(const NodeCursor& node, const Cell& first);
  void descend(const NodeCursor& node, const Cell& first, Front front);
  void descend_children(const NodeCursor& node, const Cell& first, Front front);
  Front narrow(Front front, const PlacedCube& cube);
  bool surface_meets(Front front, const PlacedCube& cube);
  void check_octant(const NodeCursor& octant, const Cell& first, Front front);
  void check_cells(const NodeCursor& octant, Front front, std::uint64_t cells);
  std::uint64_t cells_met_by_block(std::uint32_t block, std::uint32_t lanes, std::uint64_t cells);
  std::uint64_t cells_met_by_leaf(std::uint32_t leaf, std::uint64_t cells);
  PlacedCube cell_cube(const Cell& octant_first, int cell) const;
  void leave_untouched(const NodeCursor& node, const Cell& first, std::uint64_t cells);
  void check_enclosed();
  void check_cells_enclosed(const Untouched& octant);
  static std::uint64_t whole_leaves(const NodeCursor& octant, std::uint64_t cells);
  void report_all(const NodeCursor& node, const Cell& first);
  void report_cells(const NodeCursor& octant, const Cell& first, std::uint64_t cells);
  void report(const NodeCursor& leaf, const Cell& first);
  bool done() const { return occupied_ && options_.contacts != Contacts::all; }

  const MapSnapshot& map_;
  const MapCheckOptions& options_;
  const CollisionKernels& kernels_;
  PlacedBody* body_ = nullptr;
  CellBox reach_{};
  int body_level_ = 0;  // of nodes as large as the body
  Octant octant_{};
  std::uint32_t pose_ = 0, link_ = 0;
  std::size_t first_contact_ = 0;
  bool occupied_ = false, unknown_ = false;
  std::vector<Entry> front_;
  std::vector<Untouched> untouched_;
  std::vector<VoxelContact> contacts_;
};

}  // namespace rayvox
