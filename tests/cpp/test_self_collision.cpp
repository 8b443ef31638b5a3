#include "rayvox/collision/self_collision.hpp"

#include "check.hpp"
#include "collision_meshes.hpp"
#include "rayvox/error.hpp"

using namespace rayvox;
using namespace collision_meshes;

namespace {

std::shared_ptr<const KdopBvh> hierarchy(const Soup& soup) {
  return std::make_shared<KdopBvh>(soup.mesh(), BvhOptions{});
}

// Inverse of the first times the second.
Matrix between(const double* a, const double* b) {
  Matrix T = identity();
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      T[4 * i + j] = a[i] * b[j] + a[4 + i] * b[4 + j] + a[8 + i] * b[8 + j];
    }
    T[4 * i + 3] = a[i] * (b[3] - a[3]) + a[4 + i] * (b[7] - a[7]) + a[8 + i] * (b[11] - a[11]);
  }
  return T;
}

}  // namespace

FACT(links_collide_where_a_pair_of_their_meshes_does) {
  std::mt19937_64 random(1);
  Soup box, inner;
  add_box(box, {-1, -0.2, -0.3}, {1, 0.2, 0.3});
  add_box(inner, {-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1});
  Soup far = random_soup(random, 40);
  far.transform(1, {3, 0, 0});
  const std::vector<std::shared_ptr<const KdopBvh>> links{hierarchy(box), nullptr, hierarchy(sphere(8, 10, 0.4)),
                                                          hierarchy(far), hierarchy(inner)};
  const std::vector<SelfCollision::LinkPair> pairs{{0, 2}, {0, 3}, {4, 0}, {2, 3}};
  const SelfCollision robot(links, pairs);
  std::vector<double> poses;
  const int count = 400;
  for (int i = 0; i < count; ++i) {
    for (std::size_t link = 0; link < links.size(); ++link) {
      const Matrix pose = random_pose(random, i % 4 ? 2.5 : 0.5);
      poses.insert(poses.end(), pose.begin(), pose.end());
    }
  }
  const std::vector<std::uint8_t> answer = robot.check(poses);
  int colliding = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bool expected = false;
    for (const auto& [a, b] : pairs) {
      const double* T = &poses[16 * links.size() * i];
      expected |= collide(*links[a], *links[b], between(T + 16 * a, T + 16 * b), {}).state[0] != CollideResult::apart;
    }
    CHECK_EQUAL(answer[i] != 0, expected);
    colliding += answer[i];
  }
  CHECK(colliding > 50 && colliding < 350);
}

FACT(pairs_must_name_two_links_with_geometry) {
  const auto ball = hierarchy(sphere(4, 6));
  CHECK_THROWS(InvalidInput, SelfCollision({ball, nullptr}, {{0, 1}}));
  CHECK_THROWS(InvalidInput, SelfCollision({ball, ball}, {{0, 2}}));
  CHECK_THROWS(InvalidInput, SelfCollision({ball, ball}, {{1, 1}}));
  CHECK_THROWS(InvalidInput, SelfCollision({ball, ball}, {{0, 1}}).check(std::vector<double>(16)));
}
