#pragma once
#include "rayvox/octree/box.hpp"
#include "rayvox/octree/map_snapshot.hpp"

namespace rayvox {

/// Makes the cells of the box unknown; slots that change get `map.revision`.
void clear_cells(MapSnapshot& map, const CellBox& box);

}  // namespace rayvox
