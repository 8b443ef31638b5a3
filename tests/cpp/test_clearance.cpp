#include "rayvox/map_collision/clearance.hpp"

#include <algorithm>
#include <optional>

#include "check.hpp"
#include "collision_meshes.hpp"
#include "random_map.hpp"
#include "rayvox/error.hpp"
#include "rayvox/map_collision/triangle_cube.hpp"
#include "rayvox/map_collision/triangle_cube_distance.hpp"
#include "rayvox/octree/node_cursor.hpp"

using namespace rayvox;
using namespace collision_meshes;
using namespace random_maps;

namespace {

using Real = long double;  // eleven bits more than what is tested

struct Point {
  Real x, y, z;
};
Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Point operator*(const Point& a, Real s) { return {a.x * s, a.y * s, a.z * s}; }
Real dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Real length(const Point& a) { return std::sqrt(dot(a, a)); }

Real to_segment(const Point& p, const Point& a, const Point& b) {
  const Point d = b - a;
  const Real t = dot(d, d) > 0 ? std::clamp<Real>(dot(p - a, d) / dot(d, d), 0, 1) : 0;
  return length(p - (a + d * t));
}

Real between_segments(const Point& p, const Point& q, const Point& a, const Point& b) {
  Real least = std::min({to_segment(p, a, b), to_segment(q, a, b), to_segment(a, p, q), to_segment(b, p, q)});
  const Point u = q - p, v = b - a, w = p - a, n = cross(u, v);
  if (dot(n, n) > 0) {
    const Real s = dot(cross(v, w), n) / dot(n, n), t = dot(cross(u, w), n) / dot(n, n);
    if (s > 0 && s < 1 && t > 0 && t < 1) least = std::min(least, length((p + u * s) - (a + v * t)));
  }
  return least;
}

Real to_triangle(const Point& p, const Point (&t)[3]) {
  Real least = std::min({to_segment(p, t[0], t[1]), to_segment(p, t[1], t[2]), to_segment(p, t[2], t[0])});
  const Point n = cross(t[1] - t[0], t[2] - t[0]);
  const auto side = [&](int i) { return dot(n, cross(t[(i + 1) % 3] - t[i], p - t[i])); };
  if (side(0) > 0 && side(1) > 0 && side(2) > 0) least = std::min(least, std::abs(dot(p - t[0], n)) / length(n));
  return least;
}

// Every corner, edge and face of one against those of the other, which are disjoint.
Real by_features(const Point (&t)[3], const Point& centre, Real half) {
  Point corner[8];
  for (int i = 0; i < 8; ++i) {
    corner[i] = centre + Point{i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half};
  }
  Real least = INFINITY;
  for (int i = 0; i < 8; ++i) {
    least = std::min(least, to_triangle(corner[i], t));
    for (const int bit : {1, 2, 4}) {
      if (i & bit) continue;
      for (int k = 0; k < 3; ++k) {
        least = std::min(least, between_segments(t[k], t[(k + 1) % 3], corner[i], corner[i | bit]));
      }
    }
  }
  for (const Point& p : t) {
    const Point d = p - centre;
    const auto beyond = [&](Real v) { return std::max<Real>(std::abs(v) - half, 0); };
    least = std::min(least, length({beyond(d.x), beyond(d.y), beyond(d.z)}));
  }
  return least;
}

Real between_boxes(const Point (&t)[3], const Point& centre, Real half) {
  const auto gap = [&](Real a, Real b, Real c, Real middle) {
    return std::max<Real>({std::min({a, b, c}) - middle - half, middle - half - std::max({a, b, c}), 0});
  };
  return length({gap(t[0].x, t[1].x, t[2].x, centre.x), gap(t[0].y, t[1].y, t[2].y, centre.y),
                 gap(t[0].z, t[1].z, t[2].z, centre.z)});
}

// A link's triangles relative to its own origin, so that a million metres take no digits.
struct Placed {
  std::vector<std::array<Point, 3>> triangles;
  Point origin;
  double padding_m;
};

Placed placed(const Soup& soup, const Matrix& T, double padding_m) {
  Placed link{{}, {T[3], T[7], T[11]}, padding_m};
  for (std::size_t t = 0; t < soup.triangles.size(); t += 3) {
    std::array<Point, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const double* p = &soup.vertices[3 * static_cast<std::size_t>(soup.triangles[t + k])];
      const auto row = [&](std::size_t i) {
        return Real{T[4 * i]} * p[0] + Real{T[4 * i + 1]} * p[1] + Real{T[4 * i + 2]} * p[2];
      };
      corners[k] = {row(0), row(1), row(2)};
    }
    link.triangles.push_back(corners);
  }
  return link;
}

// The least distance over every triangle and every voxel that counts, but for those whose boxes are farther apart.
struct BruteForce {
  const MapSnapshot& map;
  const std::vector<Placed>& links;
  bool unknown_counts;
  Real least = INFINITY;

  BruteForce(const MapSnapshot& m, const std::vector<Placed>& l, bool unknown)
      : map(m), links(l), unknown_counts(unknown) {
    look(NodeCursor(map.root, map.geometry.depth()), root_cell(map.geometry));
    if (unknown_counts) look_beyond();
  }
  void look(const NodeCursor& node, const Cell& first) {
    if (node.kind() == NodeCursor::Kind::inner) {
      for (int i = 0; i < 8; ++i) look(node.child(i), child_cell(first, node.level(), i));
    } else if (node.kind() == NodeCursor::Kind::unknown ? unknown_counts : node.log_odds() >= 0) {
      const Real half = std::ldexp(static_cast<Real>(map.geometry.resolution_m()), node.level()) / 2;
      const auto at = [&](std::size_t c) { return first[c] * Real{map.geometry.resolution_m()} + half; };
      for (const Placed& link : links) {
        for (const auto& t : link.triangles) {
          const Point corners[3] = {t[0], t[1], t[2]};
          const Point centre = Point{at(0), at(1), at(2)} - link.origin;
          const Real grown = half + link.padding_m;
          if (between_boxes(corners, centre, grown) < least)
            least = std::min(least, by_features(corners, centre, grown));
        }
      }
    }
  }
  void look_beyond() {
    const Real border = map.geometry.half_extent() * Real{map.geometry.resolution_m()};
    for (const Placed& link : links) {
      for (const auto& t : link.triangles) {
        for (const Point& corner : t) {
          const Point p = corner + link.origin;
          least = std::min(least, border - link.padding_m - std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}));
        }
      }
    }
  }
};

bool is_occupied(const MapSnapshot& map, const PoseClearance& found) {
  NodeCursor node(map.root, map.geometry.depth());
  Cell first = root_cell(map.geometry);
  while (node.level() > found.level && node.kind() == NodeCursor::Kind::inner) {
    const std::int32_t half = std::int32_t{1} << (node.level() - 1);
    int child = 0;
    for (std::size_t c = 0; c < 3; ++c) child |= (found.first[c] >= first[c] + half) << c;
    first = child_cell(first, node.level(), child);
    node = node.child(child);
  }
  return node.kind() == NodeCursor::Kind::leaf && node.level() == found.level && first == found.first &&
         node.log_odds() >= 0;
}

// The answer's end of the shortest way lies in the voxel it names, and its start on the link it names.
void check_witness(const MapSnapshot& map, const std::vector<Placed>& links, const PoseClearance& found, double slack) {
  const double half = std::ldexp(0.5, found.level) * map.geometry.resolution_m();
  const Placed& link = links[static_cast<std::size_t>(found.link)];
  CHECK(std::abs(norm(found.direction) - 1) < 1e-12);
  const Vec3d end = found.point_m + found.direction * found.clearance_m;
  for (int c = 0; c < 3; ++c) {
    const double middle = found.first[static_cast<std::size_t>(c)] * map.geometry.resolution_m() + half;
    CHECK(std::abs(end[c] - middle) <= half + link.padding_m + slack);
  }
  Real from_link = INFINITY;
  for (const auto& t : link.triangles) {
    const Point corners[3] = {t[0], t[1], t[2]};
    const Point p = Point{found.point_m.x, found.point_m.y, found.point_m.z} - link.origin;
    from_link = std::min(from_link, to_triangle(p, corners));
  }
  CHECK(from_link < slack);
}

struct Counts {
  int measured = 0, colliding = 0;
};

void compare(const MapSnapshot& map, const std::vector<std::pair<const Soup*, double>>& parts, const Matrix& pose,
             const CollisionKernels* kernels, double size, Counts& counts) {
  std::vector<std::unique_ptr<LinkBody>> bodies;
  std::vector<MapCheckLink> links;
  std::vector<double> poses;
  std::vector<Placed> all;
  for (const auto& [soup, padding_m] : parts) {
    bodies.push_back(std::make_unique<LinkBody>(std::make_shared<KdopBvh>(soup->mesh(), BvhOptions{})));
    links.push_back({bodies.back().get(), padding_m});
    Matrix shifted = pose;
    shifted[3] += 0.7 * static_cast<double>(links.size() - 1);
    poses.insert(poses.end(), shifted.begin(), shifted.end());
    all.push_back(placed(*soup, shifted, padding_m));
  }
  for (const bool unknown : {false, true}) {
    const PoseClearance found =
        measure_clearances(map, links, poses, {.unknown_is_occupied = unknown, .kernels = kernels})[0];
    const auto verdict =
        check_poses(map, links, poses, {.unknown_is_occupied = unknown, .kernels = kernels}).verdict[0];
    CHECK_EQUAL(int(found.verdict), int{verdict});
    if (found.verdict != MapVerdict::free) {
      CHECK(found.clearance_m == 0 && !found.is_lower_bound && found.link == -1);
      ++counts.colliding;
      continue;
    }
    const BruteForce truth(map, all, unknown);
    CHECK_EQUAL(found.is_lower_bound, std::isinf(truth.least));
    CHECK(found.clearance_m <= truth.least);
    if (found.is_lower_bound) continue;
    CHECK(found.clearance_m >= truth.least * (1 - 1e-9L) - 1e-11L * size);
    if (found.level >= 0) check_witness(map, all, found, 1e-7 * size);
    if (!unknown) CHECK(is_occupied(map, found));
    ++counts.measured;
  }
}

}  // namespace

FACT(the_distance_of_a_triangle_from_a_cube_is_that_of_their_features_and_never_more) {
  std::mt19937_64 random(1);
  int far = 0;
  for (int i = 0; i < 60000; ++i) {
    const Soup soup = random_soup(random, 1, std::exp(uniform(random, -3, 3)));
    const Vec3d offset = point(random, 3);
    const double half = std::exp(uniform(random, -4, 0.5));
    Triangle t;
    Point corners[3];
    double size = half;
    for (std::size_t k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) {
        t[k][c] = soup.vertices[3 * k + static_cast<std::size_t>(c)] + offset[c];
        size = std::max(size, std::abs(t[k][c]));
      }
      corners[k] = {t[k].x, t[k].y, t[k].z};
    }
    if (triangle_meets_cube(t, half)) continue;
    const Separation found = distance_to_cube(t, half);
    const Real truth = by_features(corners, {0, 0, 0}, half);
    CHECK(found.distance <= truth);
    CHECK(found.distance >= truth - 1e-13L * size * (1 + size / truth));
    CHECK(norm(found.on_triangle - found.on_cube) >= found.distance);
    ++far;
  }
  CHECK(far > 30000);
}

FACT(clearance_is_that_of_every_triangle_and_every_voxel_and_never_more) {
  std::mt19937_64 random(2);
  for (const char* set : {"portable", "avx2", "avx512"}) {
    const CollisionKernels* kernels = collision_kernels_for(set);
    if (!kernels) continue;
    Counts counts;
    for (int i = 0; i < 60; ++i) {
      // Voxels from far smaller to far larger than the triangles.
      const double resolution_m = std::exp(uniform(random, std::log(0.03), std::log(1.5)));
      const double share = i % 3 ? 0.001 : 0.03;
      const MapSnapshot map = random_map(random, resolution_m, 6, {{-12, -12, -12}, {11, 11, 11}}, share);
      const Soup soup = i % 2 ? random_soup(random, 1 + i, 0.2) : sphere(5, 6, uniform(random, 0.1, 0.6));
      const Soup other = sphere(3, 4, 0.1);
      const double padding_m = i % 4 == 0 ? uniform(random, 0, 0.5 * resolution_m) : 0;
      compare(map, {{&soup, padding_m}, {&other, 0.01}}, random_pose(random, 10 * resolution_m), kernels,
              1 + 60 * resolution_m, counts);
    }
    CHECK(counts.measured > 25 && counts.colliding > 10);
  }
}

FACT(a_million_metres_from_the_origin_clearance_is_as_exact) {
  std::mt19937_64 random(3);
  Counts counts;
  for (int i = 0; i < 30; ++i) {
    const CellBox box{{999990, -1000010, 499990}, {1000010, -999990, 500010}};
    const MapSnapshot map = random_map(random, 1.0, 21, box, 0.003);
    const Soup soup = random_soup(random, 25, 0.4);
    Matrix pose = random_pose(random, 8);
    pose[3] += 1e6, pose[7] -= 1e6, pose[11] += 5e5;
    compare(map, {{&soup, 0}}, pose, nullptr, 1, counts);
  }
  CHECK(counts.measured > 10);
}

FACT(beyond_the_bound_clearance_is_the_bound_and_says_so) {
  std::mt19937_64 random(4);
  const MapSnapshot map = random_map(random, 0.1, 7, {{-20, -20, -20}, {19, 19, 19}}, 0.001);
  const LinkBody body(std::make_shared<KdopBvh>(sphere(8, 8, 0.1).mesh(), BvhOptions{}));
  const MapCheckLink links[] = {{}, {&body, 0}};
  std::vector<double> poses;
  for (int i = 0; i < 100; ++i) {
    const Matrix pose = random_pose(random, 2.5);
    for (int k = 0; k < 2; ++k) poses.insert(poses.end(), pose.begin(), pose.end());
  }
  const std::vector<PoseClearance> all = measure_clearances(map, links, poses, {}),
                                   near = measure_clearances(map, links, poses, {.max_clearance_m = 0.4});
  int cut = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    CHECK_EQUAL(near[i].is_lower_bound, all[i].clearance_m >= 0.4);
    CHECK_EQUAL(near[i].clearance_m, std::min(all[i].clearance_m, 0.4));
    CHECK_EQUAL(near[i].link, all[i].clearance_m > 0 && !near[i].is_lower_bound ? 1 : -1);
    cut += near[i].is_lower_bound;
  }
  CHECK(cut > 10 && cut < 90);
}

FACT(what_encloses_a_voxel_or_is_enclosed_has_no_clearance) {
  const LinkBody body(std::make_shared<KdopBvh>(sphere(8, 8, 0.5).mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0};
  std::mt19937_64 random(5);
  const MapSnapshot inside = random_map(random, 0.02, 8, {{-3, -3, -3}, {2, 2, 2}}, 0.5);
  CHECK_EQUAL(measure_clearances(inside, {&link, 1}, identity(), {})[0].clearance_m, 0.0);
  const MapSnapshot around{MapGeometry(0.05, 10), SensorModel(), Child::leaf(occupied_value), 0, 0, 0};
  const PoseClearance found = measure_clearances(around, {&link, 1}, identity(), {})[0];
  CHECK(found.clearance_m == 0 && found.verdict == MapVerdict::occupied && !found.is_lower_bound);
}

FACT(an_empty_map_or_a_robot_without_geometry_has_a_lower_bound_only) {
  const LinkBody body(std::make_shared<KdopBvh>(sphere(4, 4, 0.5).mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0}, empty{};
  MapSnapshot map{MapGeometry(0.05, 10), SensorModel(), Child(), 0, 0, 0};
  PoseClearance found = measure_clearances(map, {&link, 1}, identity(), {})[0];
  CHECK(found.is_lower_bound && found.clearance_m == farthest_clearance_m && found.link == -1);
  map.root = Child::leaf(occupied_value);
  found = measure_clearances(map, {&empty, 1}, identity(), {.max_clearance_m = 3})[0];
  CHECK(found.is_lower_bound && found.clearance_m == 3.0);
}

FACT(the_border_of_the_octree_is_as_far_as_unknown_space_beyond_it) {
  Soup soup;
  add_box(soup, {-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1});
  const LinkBody body(std::make_shared<KdopBvh>(soup.mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0.05};
  const MapSnapshot map{MapGeometry(0.05, 5), SensorModel(), Child::leaf(free_value), 0, 0, 0};
  const PoseClearance found =
      measure_clearances(map, {&link, 1}, translated({0, -0.3, 0}), {.unknown_is_occupied = true})[0];
  CHECK(std::abs(found.clearance_m - 0.35) < 1e-12 && found.clearance_m <= 0.35);
  CHECK(found.direction.y == -1 && found.level == -1 && found.link == 0);
  CHECK(measure_clearances(map, {&link, 1}, identity(), {})[0].is_lower_bound);
}

FACT(bounds_and_poses_that_cannot_be_are_refused) {
  const LinkBody body(std::make_shared<KdopBvh>(sphere(4, 4).mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0};
  const MapSnapshot map{MapGeometry(0.05, 5), SensorModel(), {}, 0, 0, 0};
  Matrix scaled = identity();
  scaled[0] = 2;
  CHECK_THROWS(InvalidInput, measure_clearances(map, {&link, 1}, scaled, {}));
  CHECK_THROWS(InvalidInput, measure_clearances(map, {&link, 1}, identity(), {.max_clearance_m = 0}));
  CHECK_THROWS(InvalidInput, measure_clearances(map, {&link, 1}, identity(), {.max_clearance_m = NAN}));
}
