#include "rayvox/robot/kinematics.hpp"

#include <random>

#include "check.hpp"
#include "rayvox/error.hpp"
#include "rayvox/robot/motion_bound.hpp"
#include "rayvox/robot/self_filter.hpp"

using namespace rayvox;

namespace {

constexpr Matrix4d identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

LinkJoint joint(int parent, JointMotion motion, int column, Vec3d axis, Vec3d offset) {
  LinkJoint made{.parent = parent, .motion = motion, .axis = axis, .column = column};
  made.T_parent_joint[3] = offset.x;
  made.T_parent_joint[7] = offset.y;
  made.T_parent_joint[11] = offset.z;
  return made;
}

// A base, an arm of two hinges about z with unit links, and a slide along x that follows the first hinge.
KinematicTree arm() {
  LinkJoint slide = joint(2, JointMotion::prismatic, 0, {1, 0, 0}, {1, 0, 0});
  slide.multiplier = 0.5;
  slide.offset = 0.25;
  return KinematicTree({LinkJoint{}, joint(0, JointMotion::revolute, 0, {0, 0, 1}, {0, 0, 1}),
                        joint(1, JointMotion::revolute, 1, {0, 0, 1}, {1, 0, 0}), slide},
                       2);
}

Vec3d position(const std::vector<double>& poses, std::size_t link) {
  return {poses[16 * link + 3], poses[16 * link + 7], poses[16 * link + 11]};
}

}  // namespace

FACT(a_planar_arm_reaches_where_trigonometry_says) {
  const KinematicTree tree = arm();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-7, 7);
  std::vector<double> q(2 * 1000), poses(16 * 4 * 1000);
  for (double& value : q) value = angle(random);
  tree.link_poses(q.data(), 1000, identity.data(), 1, poses.data());
  for (std::size_t i = 0; i < 1000; ++i) {
    const double a = q[2 * i], b = q[2 * i + 1], reach = 1.25 + 0.5 * a;
    const std::vector<double> own(poses.begin() + static_cast<std::ptrdiff_t>(64 * i),
                                  poses.begin() + static_cast<std::ptrdiff_t>(64 * i + 64));
    const Vec3d tip = position(own, 3);
    CHECK(std::abs(tip.x - (std::cos(a) + reach * std::cos(a + b))) < 1e-12);
    CHECK(std::abs(tip.y - (std::sin(a) + reach * std::sin(a + b))) < 1e-12);
    CHECK_EQUAL(tip.z, 1.0);
  }
}

FACT(trees_that_are_none_are_refused) {
  LinkJoint late = joint(1, JointMotion::fixed, 0, {1, 0, 0}, {});
  CHECK_THROWS(InvalidInput, KinematicTree({LinkJoint{}, late}, 0));
  CHECK_THROWS(InvalidInput, KinematicTree({joint(-1, JointMotion::revolute, 1, {1, 0, 0}, {})}, 1));
  CHECK_THROWS(InvalidInput, KinematicTree({joint(-1, JointMotion::revolute, 0, {1, 1, 0}, {})}, 1));
  CHECK_THROWS(InvalidInput, KinematicTree({joint(-1, JointMotion::fixed, 0, {1, 0, 0}, {NAN, 0, 0})}, 0));
  double poses[64], q[] = {0, INFINITY};
  CHECK_THROWS(InvalidInput, arm().link_poses(q, 1, identity.data(), 1, poses));
}

FACT(a_single_hinge_is_bounded_by_its_arc) {
  const KinematicTree tree({joint(-1, JointMotion::revolute, 0, {0, 0, 1}, {})}, 1);
  const std::vector<LinkExtent> extents{{{1, 0, 0}, {2, 0, 5}, 0.5}};
  const double from = 0.2, to = 1.7;
  double bound = 0;
  motion_bounds(tree, extents, {&from, &to, identity.data(), identity.data(), 1, 1}, &bound);
  CHECK(bound >= 1.5 * 2.5 && bound < 1.5 * 2.5 + 1e-9);
}

FACT(points_of_a_link_keep_within_its_motion_bound) {
  const KinematicTree tree = arm();
  const std::vector<LinkExtent> extents(4, LinkExtent{{-0.1, 0, 0}, {0.4, 0.1, 0}, 0});
  std::mt19937 random(2);
  std::uniform_real_distribution<double> angle(-2, 2);
  for (int round = 0; round < 200; ++round) {
    const double from[] = {angle(random), angle(random)}, to[] = {angle(random), angle(random)};
    double bounds[4];
    motion_bounds(tree, extents, {from, to, identity.data(), identity.data(), 1, 1}, bounds);
    std::vector<double> before(64), after(64);
    tree.place_links(from, identity.data(), before.data());
    for (int step = 1; step <= 50; ++step) {
      const double q[] = {from[0] + (to[0] - from[0]) * step / 50, from[1] + (to[1] - from[1]) * step / 50};
      tree.place_links(q, identity.data(), after.data());
      for (std::size_t link = 0; link < 4; ++link) {
        for (const Vec3d& p : {extents[link].from, extents[link].to}) {
          const auto at = [&](const std::vector<double>& poses) {
            const double* T = &poses[16 * link];
            return Vec3d{T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3], T[4] * p.x + T[5] * p.y + T[6] * p.z + T[7],
                         T[8] * p.x + T[9] * p.y + T[10] * p.z + T[11]};
          };
          CHECK(norm(at(after) - at(before)) <= bounds[link] / 50 + 1e-12);
        }
      }
      before = after;
    }
  }
}

FACT(a_body_filter_refuses_what_is_not_finite) {
  const double bad[] = {0, 0, NAN};
  std::uint8_t out = 0;
  CHECK_THROWS(InvalidInput, filter_body({FilterLink{}}, identity.data(), PointsView{nullptr, bad, 1}, {}, &out));
  CHECK_THROWS(InvalidInput, filter_body({FilterLink{}}, identity.data(), PointsView{}, {NAN, 0, 0}, &out));
}
