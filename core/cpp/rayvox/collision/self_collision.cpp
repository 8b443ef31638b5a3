#include "rayvox/collision/self_collision.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "rayvox/error.hpp"
#include "rayvox/geometry/rigid_transform.hpp"
#include "rayvox/parallel/parallel_for.hpp"

namespace rayvox {
namespace {

constexpr std::size_t poses_per_task = 32;
// More than rounding, and a rotation that is one up to 1e-5 only, take from the sum of two radii and of two boxes'
// extents.
constexpr double margin_of_radii = 1e-4;

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// A link's oriented box in the map.
struct PlacedBox {
  Vec3d axis[3];
  double half[3];
};

// The separating axis test of oriented boxes (Gottschalk, Lin, Manocha: OBBTree, SIGGRAPH 1996).
bool boxes_apart(const PlacedBox& a, const PlacedBox& b, const Vec3d& a_to_b, double margin) {
  double r[3][3], magnitude[3][3], t[3];
  for (int i = 0; i < 3; ++i) {
    t[i] = dot(a.axis[i], a_to_b);
    for (int j = 0; j < 3; ++j) {
      r[i][j] = dot(a.axis[i], b.axis[j]);
      // Of parallel edges the cross product is no direction: it must not separate.
      magnitude[i][j] = std::abs(r[i][j]) + 1e-6;
    }
  }
  for (int i = 0; i < 3; ++i) {
    const double* m = magnitude[i];
    if (std::abs(t[i]) > a.half[i] + b.half[0] * m[0] + b.half[1] * m[1] + b.half[2] * m[2] + margin) return true;
  }
  for (int j = 0; j < 3; ++j) {
    const double reach = a.half[0] * magnitude[0][j] + a.half[1] * magnitude[1][j] + a.half[2] * magnitude[2][j];
    if (std::abs(dot(b.axis[j], a_to_b)) > b.half[j] + reach + margin) return true;
  }
  for (int i = 0; i < 3; ++i) {
    const int u = (i + 1) % 3, v = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int p = (j + 1) % 3, q = (j + 2) % 3;
      const double reach = a.half[u] * magnitude[v][j] + a.half[v] * magnitude[u][j] + b.half[p] * magnitude[i][q] +
                           b.half[q] * magnitude[i][p];
      if (std::abs(t[v] * r[u][j] - t[u] * r[v][j]) > reach + margin) return true;
    }
  }
  return false;
}

// T_map_a's inverse times T_map_b.
RigidTransform between(const double* T_map_a, const double* T_map_b) {
  double T[16] = {};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double turned = T_map_a[4 * k + i];
      for (int j = 0; j < 3; ++j) T[4 * i + j] += turned * T_map_b[4 * k + j];
      T[4 * i + 3] += turned * (T_map_b[4 * k + 3] - T_map_a[4 * k + 3]);
    }
  }
  T[15] = 1;
  return RigidTransform::from_matrix(T);
}

}  // namespace

// One thread's.
class SelfCollisionQuery {
 public:
  explicit SelfCollisionQuery(const SelfCollision& robot) : robot_(robot), colliders_(robot.pairs_.size()) {
    placed_.resize(robot.links_.size());
    for (std::uint32_t i = 0; i < robot.pairs_.size(); ++i) order_.push_back(i);
  }

  bool collides(const double* T_map_links) {
    T_map_links_ = T_map_links;
    for (std::size_t i = 0; i < placed_.size(); ++i) {
      if (robot_.links_[i]) place(i);
    }
    for (std::size_t i = 0; i < order_.size(); ++i) {
      if (!near(robot_.pairs_[order_[i]]) || !touches(order_[i])) continue;
      // Poses come in sequences: what collided last is asked first.
      std::rotate(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(i),
                  order_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      return true;
    }
    return false;
  }

 private:
  struct PlacedLink {
    Vec3d centre;
    double radius;
    bool box_placed;
    PlacedBox box;
    Vec3d box_centre;
  };

  void place(std::size_t link) {
    const CollisionMesh& mesh = robot_.links_[link]->mesh();
    PlacedLink& placed = placed_[link];
    placed.centre = apply(link, mesh.centre_m());
    placed.radius = mesh.radius_m();
    placed.box_placed = false;
  }

  Vec3d apply(std::size_t link, const Vec3d& p) const {
    const double* T = T_map_links_ + 16 * link;
    return {T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3], T[4] * p.x + T[5] * p.y + T[6] * p.z + T[7],
            T[8] * p.x + T[9] * p.y + T[10] * p.z + T[11]};
  }

  const PlacedLink& with_box(std::size_t link) {
    PlacedLink& placed = placed_[link];
    if (placed.box_placed) return placed;
    const BvhNode& root = robot_.links_[link]->nodes()[0];
    const double* T = T_map_links_ + 16 * link;
    const auto turned = [&](const Vec3d& p) {
      return Vec3d{T[0] * p.x + T[1] * p.y + T[2] * p.z, T[4] * p.x + T[5] * p.y + T[6] * p.z,
                   T[8] * p.x + T[9] * p.y + T[10] * p.z};
    };
    for (int j = 0; j < 3; ++j) {
      placed.box.axis[j] = turned(box_axis(root, j));
      placed.box.half[j] = static_cast<double>(root.box_half[j]);
    }
    placed.box_centre = placed.centre + turned({root.origin[0], root.origin[1], root.origin[2]});
    placed.box_placed = true;
    return placed;
  }

  bool near(const SelfCollision::Pair& pair) {
    const PlacedLink &a = placed_[pair.a], &b = placed_[pair.b];
    const Vec3d apart = b.centre - a.centre;
    const double magnitude = norm(a.centre) + norm(b.centre), radii = a.radius + b.radius;
    const double margin = margin_of_radii * radii + 1e-14 * magnitude;
    if (dot(apart, apart) > (radii + margin) * (radii + margin)) return false;
    const PlacedLink &first = with_box(pair.a), &second = with_box(pair.b);
    return !boxes_apart(first.box, second.box, second.box_centre - first.box_centre, margin);
  }

  bool touches(std::uint32_t index) {
    const SelfCollision::Pair& pair = robot_.pairs_[index];
    std::unique_ptr<PairCollider>& collider = colliders_[index];
    if (!collider) {
      collider = std::make_unique<PairCollider>(*pair.tables, *robot_.solids_[pair.a], *robot_.solids_[pair.b],
                                                robot_.options_);
    }
    const RigidTransform T_a_b =
        between(T_map_links_ + 16 * std::size_t{pair.a}, T_map_links_ + 16 * std::size_t{pair.b});
    return collider->collide(0, T_a_b) != CollideResult::apart;
  }

  const SelfCollision& robot_;
  const double* T_map_links_ = nullptr;
  std::vector<PlacedLink> placed_;
  std::vector<std::unique_ptr<PairCollider>> colliders_;  // of pairs
  std::vector<std::uint32_t> order_;
};

SelfCollision::SelfCollision(std::vector<std::shared_ptr<const KdopBvh>> links, const std::vector<LinkPair>& pairs)
    : links_(std::move(links)) {
  for (const auto& link : links_) solids_.push_back(link ? std::make_unique<Solid>(*link) : nullptr);
  for (const auto& [a, b] : pairs) {
    if (a >= links_.size() || b >= links_.size() || a == b || !links_[a] || !links_[b]) {
      throw InvalidInput("links " + std::to_string(a) + " and " + std::to_string(b) + " are no two with geometry");
    }
    pairs_.push_back({a, b, std::make_unique<PairTables>(*links_[a], *links_[b], collision_kernels())});
  }
}

std::vector<std::uint8_t> SelfCollision::check(std::span<const double> T_map_links) const {
  const std::size_t links = links_.size();
  if (links == 0 || T_map_links.size() % (16 * links) != 0) {
    throw InvalidInput("a pose needs one 4x4 matrix for each of " + std::to_string(links) + " links");
  }
  const std::size_t count = T_map_links.size() / (16 * links);
  std::vector<std::uint8_t> colliding(count);
  std::vector<std::unique_ptr<SelfCollisionQuery>> queries(static_cast<std::size_t>(thread_count()));
  parallel_for((count + poses_per_task - 1) / poses_per_task, [&](std::size_t task, int worker) {
    std::unique_ptr<SelfCollisionQuery>& query = queries[static_cast<std::size_t>(worker)];
    if (!query) query = std::make_unique<SelfCollisionQuery>(*this);
    for (std::size_t i = task * poses_per_task; i < std::min(count, (task + 1) * poses_per_task); ++i) {
      colliding[i] = query->collides(T_map_links.data() + 16 * links * i);
    }
  });
  return colliding;
}

}  // namespace rayvox
