#include "rayvox/ray_shooting/occupied_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rayvox/octree/box.hpp"
#include "rayvox/octree/node_cursor.hpp"
#include "rayvox/ray_shooting/ray_walker.hpp"

namespace rayvox {
namespace {

// Two parameters closer than this, relatively, are not told apart.
constexpr double t_margin = 0x1p-44;
// Beyond this many cells float32 boxes would have to be widened by more than a sixteenth of a cell.
constexpr std::int32_t farthest = 1 << 16;

struct Collector {
  const float threshold;
  std::vector<OccupiedScene::Box>& boxes;

  void visit(const NodeCursor& node, const Cell& first, int level) {
    if (node.kind() == NodeCursor::Kind::inner) {
      if (node.log_odds() < threshold) return;  // the maximum below it
      for (int i = 0; i < 8; ++i) visit(node.child(i), child_cell(first, level, i), level - 1);
    } else if (node.kind() == NodeCursor::Kind::leaf && node.log_odds() >= threshold) {
      boxes.push_back({first, level});
    }
  }
};

void write_bounds(const embree::BoundsFunctionArguments* arguments) {
  const auto& boxes = *static_cast<const OccupiedScene::Boxes*>(arguments->geometry_data);
  const OccupiedScene::Box& box = boxes.box[arguments->primitive];
  float lower[3], upper[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<float>(box.first[axis] - boxes.anchor[axis]);
    lower[axis] = low - boxes.widening;
    upper[axis] = low + static_cast<float>(std::int32_t{1} << box.level) + boxes.widening;
  }
  *arguments->bounds = {lower[0], lower[1], lower[2], 0, upper[0], upper[1], upper[2], 0};
}

// One ray on its way through the scene; Embree carries it to the callback.
struct Query : embree::QueryContext {
  explicit Query(const Ray& asked) : ray(asked), start(asked) {}

  // Takes the box if the ray enters it before the best so far; returns the parameter up to which it is worth going on.
  double consider(const OccupiedScene::Box& box) {
    if (misses_clearly(box)) return reach();
    RayWalker walker = start;
    if (!walker.enter_block(box.first, box.level)) return reach();
    const double t = walker.t();
    if (found && std::abs(t - hit.t) <= t_margin * std::max(t, hit.t)) {
      undecided = true;
    } else if (!found || t < hit.t) {
      hit = {t, walker.cell()};
      undecided = false;
    }
    found = true;
    return reach();
  }

  double reach() const { return found ? hit.t : 1; }

  const Ray ray;
  const RayWalker start;
  OccupiedScene::Hit hit{};
  bool found = false, undecided = false;

 private:
  bool misses_clearly(const OccupiedScene::Box& box) const {
    double enters = 0, leaves = reach();
    for (int axis = 0; axis < 3; ++axis) {
      const double low = box.first[static_cast<std::size_t>(axis)], high = low + (std::int32_t{1} << box.level);
      const double direction = ray.end[axis] - ray.origin[axis];
      if (direction == 0) {
        if (ray.origin[axis] < low || ray.origin[axis] >= high) return true;
        continue;
      }
      const double a = (low - ray.origin[axis]) / direction, b = (high - ray.origin[axis]) / direction;
      enters = std::max(enters, std::min(a, b));
      leaves = std::min(leaves, std::max(a, b));
    }
    return enters * (1 - t_margin) > leaves * (1 + t_margin);
  }
};

void take_candidate(const embree::IntersectFunctionArguments* arguments) {
  if (!arguments->valid[0]) return;
  auto& ray = *static_cast<embree::RayHit*>(arguments->ray_hit);
  const auto& boxes = *static_cast<const OccupiedScene::Boxes*>(arguments->geometry_data);
  const double reach = static_cast<Query*>(arguments->context)->consider(boxes.box[arguments->primitive]);
  ray.t_far = std::min(ray.t_far, static_cast<float>(reach * (1 + 0x1p-20) + 0x1p-60));
}

}  // namespace

std::optional<OccupiedScene> OccupiedScene::of(const MapSnapshot& map, const EmbreeLibrary& library) {
  auto boxes = std::make_unique<Boxes>();
  Collector{map.model.occupied_log_odds, boxes->box}.visit(NodeCursor(map.root, map.geometry.depth()),
                                                           root_cell(map.geometry), map.geometry.depth());
  const std::int32_t half = map.geometry.half_extent();
  Cell low{half, half, half}, high{-half, -half, -half};
  for (const Box& box : boxes->box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], box.first[axis]);
      high[axis] = std::max(high[axis], box.first[axis] + (std::int32_t{1} << box.level));
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (high[axis] - low[axis] > farthest) return std::nullopt;
    boxes->anchor[axis] = boxes->box.empty() ? 0 : low[axis] + (high[axis] - low[axis]) / 2;
  }
  return OccupiedScene(library, std::move(boxes));
}

OccupiedScene::OccupiedScene(const EmbreeLibrary& library, std::unique_ptr<Boxes> boxes)
    : embree_(&library), boxes_(std::move(boxes)), scene_(library.call().NewScene(library.device())) {
  // Positions on a ray err by a few float32 roundings of its reach, which the caller keeps below 4 * farthest.
  boxes_->widening = 4.0f * farthest * 0x1p-21f;
  const embree::Functions& call = library.call();
  embree::GeometryHandle* geometry = call.NewGeometry(library.device(), embree::user_geometry);
  call.SetGeometryUserPrimitiveCount(geometry, static_cast<std::uint32_t>(boxes_->box.size()));
  call.SetGeometryUserData(geometry, boxes_.get());
  call.SetGeometryBoundsFunction(geometry, write_bounds, nullptr);
  call.SetGeometryIntersectFunction(geometry, take_candidate);
  call.CommitGeometry(geometry);
  call.AttachGeometryByID(scene_, geometry, 0);
  call.ReleaseGeometry(geometry);
  call.SetSceneFlags(scene_, embree::flag_robust);
  call.SetSceneBuildQuality(scene_, embree::quality_low);
  call.CommitScene(scene_);
}

OccupiedScene::OccupiedScene(OccupiedScene&& other) noexcept
    : embree_(other.embree_), boxes_(std::move(other.boxes_)), scene_(std::exchange(other.scene_, nullptr)) {}

OccupiedScene::~OccupiedScene() {
  if (scene_) embree_->call().ReleaseScene(scene_);
}

OccupiedScene::Answer OccupiedScene::cast(const Ray& ray, Hit& hit) const {
  embree::RayHit shot{};
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = ray.origin[axis] - boxes_->anchor[static_cast<std::size_t>(axis)];
    const double direction = ray.end[axis] - ray.origin[axis];
    if (std::abs(origin) > 2.0 * farthest || std::abs(direction) > 2.0 * farthest) return Answer::undecided;
    shot.origin[axis] = static_cast<float>(origin);
    shot.direction[axis] = static_cast<float>(direction);
  }
  shot.t_far = 1;
  shot.mask = embree::all_features;
  shot.geometry = embree::invalid_id;
  Query query(ray);
  embree::IntersectArguments arguments;
  arguments.context = &query;
  embree_->call().Intersect1(scene_, &shot, &arguments);
  if (query.undecided) return Answer::undecided;
  hit = query.hit;
  return query.found ? Answer::hit : Answer::nothing;
}

}  // namespace rayvox
