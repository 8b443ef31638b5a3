#include "rayvox/geometry/triangle_mesh.hpp"

#include <limits>
#include <string>

#include "rayvox/error.hpp"

namespace rayvox {

void require_valid(const TriangleMeshView& mesh) {
  if (mesh.triangle_count() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    throw InvalidInput(std::to_string(mesh.triangle_count()) + " triangles are too many");
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!std::isfinite(mesh.vertices[i])) {
      throw InvalidInput("vertices[" + std::to_string(i / 3) + "][" + std::to_string(i % 3) +
                         "] is not finite: " + std::to_string(mesh.vertices[i]));
    }
  }
  const auto count = static_cast<std::int64_t>(mesh.vertex_count());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (mesh.triangles[i] < 0 || mesh.triangles[i] >= count) {
      throw InvalidInput("triangles[" + std::to_string(i / 3) + "] names vertex " + std::to_string(mesh.triangles[i]) +
                         " of " + std::to_string(count));
    }
  }
}

}  // namespace rayvox
