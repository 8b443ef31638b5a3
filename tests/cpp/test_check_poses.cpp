#include "rayvox/map_collision/check_poses.hpp"

#include <algorithm>
#include <set>
#include <tuple>

#include "check.hpp"
#include "collision_meshes.hpp"
#include "random_map.hpp"
#include "rayvox/error.hpp"
#include "rayvox/map_collision/triangle_cube.hpp"
#include "rayvox/octree/edit.hpp"
#include "rayvox/octree/node_cursor.hpp"

using namespace rayvox;
using namespace collision_meshes;
using namespace random_maps;

namespace {

using Real = long double;  // eleven bits more than what is tested
struct Point {
  Real at[3];
};

// Akenine-Moller's test with every box grown by `grow`.
bool meets(const Point (&t)[3], const Real (&centre)[3], Real half, Real grow) {
  Real v[3][3], e[3][3];
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) v[k][c] = t[k].at[c] - centre[c];
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) e[k][c] = v[(k + 1) % 3][c] - v[k][c];
  const auto apart = [&](Real x, Real y, Real z) {
    Real low = INFINITY, high = -INFINITY;
    for (const auto& p : v) {
      const Real along = x * p[0] + y * p[1] + z * p[2];
      low = std::min(low, along), high = std::max(high, along);
    }
    const Real reach = (half + grow) * (std::abs(x) + std::abs(y) + std::abs(z));
    return low > reach || high < -reach;
  };
  if (apart(1, 0, 0) || apart(0, 1, 0) || apart(0, 0, 1)) return false;
  if (apart(e[0][1] * e[1][2] - e[0][2] * e[1][1], e[0][2] * e[1][0] - e[0][0] * e[1][2],
            e[0][0] * e[1][1] - e[0][1] * e[1][0]))
    return false;
  for (const auto& d : e) {
    if (apart(0, d[2], -d[1]) || apart(-d[2], 0, d[0]) || apart(d[1], -d[0], 0)) return false;
  }
  return true;
}

using Voxel = std::tuple<Cell, int, bool>;  // first cell, level, whether it is unknown

// Every leaf and unknown node against every triangle; `solids` for a closed mesh.
struct BruteForce {
  const MapSnapshot& map;
  const Soup& soup;
  const Matrix& pose;
  double padding_m, grow;
  bool solids;
  std::set<Voxel> found;

  BruteForce(const MapSnapshot& m, const Soup& s, const Matrix& p, double padding, double g, bool with_solids)
      : map(m), soup(s), pose(p), padding_m(padding), grow(g), solids(with_solids) {
    look(NodeCursor(map.root, map.geometry.depth()), root_cell(map.geometry));
  }
  void look(const NodeCursor& node, const Cell& first) {
    if (node.kind() != NodeCursor::Kind::inner) {
      const bool unknown = node.kind() == NodeCursor::Kind::unknown;
      if ((unknown || node.log_odds() >= 0) && collides(first, node.level()))
        found.insert({first, node.level(), unknown});
      return;
    }
    for (int i = 0; i < 8; ++i) look(node.child(i), child_cell(first, node.level(), i));
  }
  bool collides(const Cell& first, int level) const {
    const Real half = std::ldexp(static_cast<Real>(map.geometry.resolution_m()), level) / 2;
    Real centre[3];
    for (std::size_t c = 0; c < 3; ++c) centre[c] = static_cast<Real>(first[c]) * map.geometry.resolution_m() + half;
    Real angle = 0;
    for (std::size_t t = 0; t < soup.triangles.size(); t += 3) {
      Point corners[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const double* p = &soup.vertices[3 * static_cast<std::size_t>(soup.triangles[t + k])];
        for (std::size_t c = 0; c < 3; ++c) {
          corners[k].at[c] = static_cast<Real>(pose[4 * c]) * p[0] + static_cast<Real>(pose[4 * c + 1]) * p[1] +
                             static_cast<Real>(pose[4 * c + 2]) * p[2] + pose[4 * c + 3];
        }
      }
      if (meets(corners, centre, half + padding_m, grow)) return true;
      if (solids) angle += solid_angle(corners, centre);
    }
    return solids && std::abs(angle) > 6;
  }
  // Solid angle of a triangle (Van Oosterom, Strackee 1983): those of a closed mesh add up to 4 pi around a point
  // inside, to 0 around one outside.
  static Real solid_angle(const Point (&t)[3], const Real (&centre)[3]) {
    Real v[3][3], length[3];
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) v[k][c] = t[k].at[c] - centre[c];
      length[k] = std::hypot(v[k][0], v[k][1], v[k][2]);
    }
    const auto dot = [&](int a, int b) { return v[a][0] * v[b][0] + v[a][1] * v[b][1] + v[a][2] * v[b][2]; };
    const Real volume = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
                        v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
                        v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
    return 2 * std::atan2(volume, length[0] * length[1] * length[2] + dot(0, 1) * length[2] + dot(1, 2) * length[0] +
                                      dot(2, 0) * length[1]);
  }
};

std::set<Voxel> voxels_of(const MapCheckResult& result) {
  std::set<Voxel> voxels;
  for (const VoxelContact& contact : result.contacts) {
    CHECK(voxels.insert({contact.first, contact.level, std::isnan(contact.log_odds)}).second);
  }
  return voxels;
}

int verdict_of(const std::set<Voxel>& voxels, bool unknown_counts) {
  bool unknown = false;
  for (const auto& [first, level, is_unknown] : voxels) {
    if (!is_unknown) return 1;
    unknown = true;
  }
  return unknown && unknown_counts ? 2 : 0;
}

std::set<Voxel> without_unknown(std::set<Voxel> voxels) {
  std::erase_if(voxels, [](const Voxel& voxel) { return std::get<2>(voxel); });
  return voxels;
}

struct Counts {
  int verdicts[3] = {}, contacts = 0, undecided = 0;
};

// What must be found is found; what is found more lies within 1e-12 m.
void compare(const MapSnapshot& map, const Soup& soup, const Matrix& pose, double padding_m, bool closed,
             const CollisionKernels* kernels, Counts& counts) {
  const LinkBody body(std::make_shared<KdopBvh>(soup.mesh(), BvhOptions{}));
  const MapCheckLink link{&body, padding_m};
  const BruteForce least(map, soup, pose, padding_m, 0, closed), most(map, soup, pose, padding_m, 1e-12, closed);
  for (const bool unknown : {false, true}) {
    MapCheckOptions options{unknown, 0, {}, Contacts::all, kernels};
    const MapCheckResult all = check_poses(map, {&link, 1}, pose, options);
    const std::set<Voxel> found = voxels_of(all);
    const auto must = unknown ? least.found : without_unknown(least.found);
    const auto may = unknown ? most.found : without_unknown(most.found);
    CHECK(std::includes(found.begin(), found.end(), must.begin(), must.end()));
    CHECK(std::includes(may.begin(), may.end(), found.begin(), found.end()));
    counts.contacts += static_cast<int>(found.size());
    counts.undecided += must != may;
    const int verdict = all.verdict[0];
    if (must == may) CHECK_EQUAL(verdict, verdict_of(must, unknown));
    ++counts.verdicts[verdict];
    for (const Contacts mode : {Contacts::none, Contacts::first}) {
      options.contacts = mode;
      const MapCheckResult one = check_poses(map, {&link, 1}, pose, options);
      CHECK_EQUAL(int{one.verdict[0]}, verdict);
      CHECK_EQUAL(one.contacts.size(), std::size_t{mode == Contacts::first && verdict != 0});
      for (const VoxelContact& contact : one.contacts) {
        CHECK(found.contains({contact.first, contact.level, std::isnan(contact.log_odds)}));
        CHECK_EQUAL(std::isnan(contact.log_odds), verdict == 2);
      }
    }
  }
}

}  // namespace

FACT(contacts_are_those_of_every_voxel_against_every_triangle) {
  std::mt19937_64 random(1);
  for (const char* set : {"portable", "avx2", "avx512"}) {
    const CollisionKernels* kernels = collision_kernels_for(set);
    if (!kernels) continue;
    Counts counts;
    for (int i = 0; i < 24; ++i) {
      // Voxels from far smaller to far larger than the triangles.
      const double resolution_m = std::exp(uniform(random, std::log(0.06), std::log(1.5)));
      const MapSnapshot map =
          random_map(random, resolution_m, 6, {{-12, -12, -12}, {11, 11, 11}}, i % 2 ? uniform(random, 0, 0.3) : 0);
      const Soup soup = i % 3 == 0 ? sphere(5, 6, uniform(random, 0.2, 1)) : random_soup(random, 5 + i, 0.3);
      const double padding_m = i % 4 == 0 ? uniform(random, 0, resolution_m) : 0;
      compare(map, soup, random_pose(random, 6 * resolution_m), padding_m, i % 3 == 0, kernels, counts);
    }
    CHECK(counts.verdicts[0] > 0 && counts.verdicts[1] > 5 && counts.verdicts[2] > 2 && counts.contacts > 500);
    CHECK(counts.undecided < 5);
  }
}

FACT(a_million_metres_from_the_origin_nothing_changes) {
  std::mt19937_64 random(2);
  Counts counts;
  for (int i = 0; i < 25; ++i) {
    const CellBox box{{999990, -1000010, 499990}, {1000010, -999990, 500010}};
    const MapSnapshot map = random_map(random, 1.0, 21, box, 0.1);
    Soup soup = random_soup(random, 25, 0.4);
    Matrix pose = random_pose(random, 6);
    pose[3] += 1e6, pose[7] -= 1e6, pose[11] += 5e5;
    compare(map, soup, pose, 0, false, nullptr, counts);
  }
  CHECK(counts.verdicts[1] > 3 && counts.undecided == 0);
}

FACT(touching_counts_and_a_gap_of_1e_12_does_not) {
  std::mt19937_64 random(3);
  MapSnapshot map{MapGeometry(1.0, 5), SensorModel(), {}, 0, 0, 0};
  OpenBrick brick;
  brick.known[0] = 1;
  brick.log_odds[0] = occupied_value;
  Child slot = Child::adopt(new InnerNode);
  slot.inner()->child[0] = brick.close();
  slot.inner()->refresh();
  map.root = Child::adopt(new InnerNode);
  map.root.inner()->child[7] = slot;
  map.root.inner()->refresh();
  Soup soup;
  add_box(soup, {-0.25, -0.25, -0.25}, {0.25, 0.25, 0.25});
  const LinkBody body(std::make_shared<KdopBvh>(soup.mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0};
  const auto verdict = [&](const Vec3d& at) {
    return int{check_poses(map, {&link, 1}, translated(at), {}).verdict[0]};
  };
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d low{0.5, 0.5, 0.5}, high = low;
    low[axis] = -0.25, high[axis] = 1.25;
    CHECK_EQUAL(verdict(low), 1);
    CHECK_EQUAL(verdict(high), 1);
    low[axis] -= 1e-12, high[axis] += 1e-12;
    CHECK_EQUAL(verdict(low), 0);
    CHECK_EQUAL(verdict(high), 0);
  }
  CHECK_EQUAL(verdict({-0.25, -0.25, -0.25}), 1);  // corner to corner
  CHECK_EQUAL(verdict({1.25, 1.25, 0.5}), 1);      // edge to edge
}

FACT(a_voxel_inside_a_closed_link_collides_and_one_inside_an_open_link_does_not) {
  std::mt19937_64 random(4);
  const MapSnapshot map = random_map(random, 0.02, 8, {{-3, -3, -3}, {2, 2, 2}}, 0.5);
  Soup closed = sphere(20, 20), open = closed;
  open.triangles.resize(open.triangles.size() - 3);
  for (const bool is_closed : {true, false}) {
    const LinkBody body(std::make_shared<KdopBvh>((is_closed ? closed : open).mesh(), BvhOptions{}));
    const MapCheckLink link{&body, 0};
    for (int i = 0; i < 20; ++i) {
      CHECK_EQUAL(int{check_poses(map, {&link, 1}, random_pose(random, 0.3), {}).verdict[0]}, int{is_closed});
    }
  }
}

FACT(a_robot_inside_occupied_or_unknown_space_collides) {
  Soup soup = sphere(6, 6, 0.1);
  const LinkBody body(std::make_shared<KdopBvh>(soup.mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0};
  MapSnapshot map{MapGeometry(0.05, 10), SensorModel(), Child::leaf(occupied_value), 0, 0, 0};
  CHECK_EQUAL(int{check_poses(map, {&link, 1}, translated({3, 3, 3}), {}).verdict[0]}, 1);
  CHECK_EQUAL(int{check_poses(map, {&link, 1}, translated({3, 3, 3}), {.occupied_log_odds = 1.6f}).verdict[0]}, 0);
  map.root = Child();
  CHECK_EQUAL(int{check_poses(map, {&link, 1}, translated({3, 3, 3}), {}).verdict[0]}, 0);
  CHECK_EQUAL(int{check_poses(map, {&link, 1}, translated({3, 3, 3}), {.unknown_is_occupied = true}).verdict[0]}, 2);
}

FACT(what_lies_beyond_the_octree_is_unknown) {
  Soup soup = sphere(6, 6, 0.1);
  const LinkBody body(std::make_shared<KdopBvh>(soup.mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0};
  const MapSnapshot map{MapGeometry(0.05, 5), SensorModel(), Child::leaf(free_value), 0, 0, 0};
  const auto verdict = [&](double x, bool unknown) {
    return int{check_poses(map, {&link, 1}, translated({x, 0, 0}), {.unknown_is_occupied = unknown}).verdict[0]};
  };
  CHECK_EQUAL(verdict(0.69, true), 0);
  CHECK_EQUAL(verdict(0.75, true), 2);
  CHECK_EQUAL(verdict(0.75, false), 0);
  CHECK_EQUAL(verdict(100, true), 2);
  CHECK_EQUAL(verdict(1e12, true), 2);
  CHECK_EQUAL(verdict(1e12, false), 0);
}

FACT(a_batch_over_several_links_answers_pose_by_pose) {
  std::mt19937_64 random(5);
  const MapSnapshot map = random_map(random, 0.1, 7, {{-20, -20, -20}, {19, 19, 19}}, 0.004);
  const LinkBody first(std::make_shared<KdopBvh>(sphere(8, 8, 0.2).mesh(), BvhOptions{}));
  const LinkBody second(std::make_shared<KdopBvh>(random_soup(random, 30, 0.1).mesh(), BvhOptions{}));
  const MapCheckLink links[] = {{&first, 0}, {}, {&second, 0.01}};
  std::vector<double> poses;
  for (int i = 0; i < 300; ++i) {
    const Matrix pose = random_pose(random, 2);
    poses.insert(poses.end(), pose.begin(), pose.end());
  }
  const MapCheckResult batch = check_poses(map, links, poses, {.contacts = Contacts::all});
  CHECK_EQUAL(batch.verdict.size(), std::size_t{100});
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    const MapCheckResult alone = check_poses(map, links, {poses.data() + 48 * i, 48}, {.contacts = Contacts::all});
    CHECK_EQUAL(batch.verdict[i], alone.verdict[0]);
    for (const VoxelContact& contact : alone.contacts) {
      CHECK(batch.contacts[contacts].pose == i && batch.contacts[contacts].first == contact.first);
      CHECK_EQUAL(batch.contacts[contacts].link, contact.link);
      ++contacts;
    }
  }
  CHECK_EQUAL(batch.contacts.size(), contacts);
  CHECK(contacts > 20 && std::count(batch.verdict.begin(), batch.verdict.end(), 0) > 5);
}

FACT(padding_may_differ_from_pose_to_pose) {
  std::mt19937_64 random(6);
  const MapSnapshot map = random_map(random, 0.1, 7, {{-20, -20, -20}, {19, 19, 19}}, 0.004);
  const LinkBody body(std::make_shared<KdopBvh>(sphere(8, 8, 0.2).mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0.01};
  std::vector<double> poses, more;
  for (int i = 0; i < 60; ++i) {
    const Matrix pose = random_pose(random, 2);
    poses.insert(poses.end(), pose.begin(), pose.end());
    more.push_back(i % 3 * 0.1);
  }
  const MapCheckResult batch = check_poses(map, {&link, 1}, poses, {.more_padding_m = more});
  for (std::size_t i = 0; i < 60; ++i) {
    const MapCheckLink padded{&body, 0.01 + more[i]};
    CHECK_EQUAL(batch.verdict[i], check_poses(map, {&padded, 1}, {poses.data() + 16 * i, 16}, {}).verdict[0]);
  }
  CHECK(std::count(batch.verdict.begin(), batch.verdict.end(), 0) > 3);
  more.pop_back();
  CHECK_THROWS(InvalidInput, check_poses(map, {&link, 1}, poses, {.more_padding_m = more}));
}

FACT(poses_that_are_not_rigid_and_other_hierarchies_are_refused) {
  const MapSnapshot map{MapGeometry(0.05, 5), SensorModel(), {}, 0, 0, 0};
  const LinkBody body(std::make_shared<KdopBvh>(sphere(4, 4).mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0}, shrunk{&body, -0.1};
  Matrix scaled = identity();
  scaled[0] = 2;
  CHECK_THROWS(InvalidInput, check_poses(map, {&link, 1}, scaled, {}));
  CHECK_THROWS(InvalidInput, check_poses(map, {&shrunk, 1}, identity(), {}));
  CHECK_THROWS(InvalidInput, check_poses(map, {&link, 1}, std::vector<double>(17), {}));
  CHECK_THROWS(InvalidInput, LinkBody(std::make_shared<KdopBvh>(sphere(4, 4).mesh(),
                                                                BvhOptions{.traversal = Traversal::one_vs_sixteen})));
}

FACT(a_cancelled_check_ends_with_its_error) {
  const MapSnapshot map{MapGeometry(0.05, 5), SensorModel(), {}, 0, 0, 0};
  const LinkBody body(std::make_shared<KdopBvh>(sphere(4, 4).mesh(), BvhOptions{}));
  const MapCheckLink link{&body, 0};
  CancellationToken cancellation;
  CHECK_EQUAL(check_poses(map, {&link, 1}, identity(), {.cancellation = &cancellation}).verdict.size(), 1u);
  cancellation.cancel();
  CHECK_THROWS(Cancelled, check_poses(map, {&link, 1}, identity(), {.cancellation = &cancellation}));
}
