#include "rayvox/ray_shooting/ray_walker.hpp"

#include "brute_force.hpp"
#include "check.hpp"

using namespace rayvox;

FACT(single_steps_visit_exactly_the_cells_the_ray_passes) {
  std::mt19937_64 random(2);
  for (int sample = 0; sample < 3000; ++sample) {
    const Ray ray = brute_force::awkward_ray(random, 5);
    std::set<Cell> visited;
    RayWalker walker(ray);
    visited.insert(walker.cell());
    while (!walker.end_in_block(0)) {
      walker.leave_block(0);
      visited.insert(walker.cell());
    }
    CHECK(visited == brute_force::passed_cells(ray));
  }
}

FACT(strides_over_blocks_stop_at_the_cells_where_the_ray_enters_them) {
  std::mt19937_64 random(3);
  for (int sample = 0; sample < 20000; ++sample) {
    const Ray ray = brute_force::awkward_ray(random, 20);
    const int level = 1 + sample % 4;
    RayWalker stride(ray), step(ray);
    while (!stride.end_in_block(level)) {
      const Cell block{stride.cell()[0] >> level, stride.cell()[1] >> level, stride.cell()[2] >> level};
      stride.leave_block(level);
      const auto inside = [&] {
        return step.cell()[0] >> level == block[0] && step.cell()[1] >> level == block[1] &&
               step.cell()[2] >> level == block[2];
      };
      while (inside()) step.leave_block(0);
      CHECK(stride.cell() == step.cell());
      if (stride.cell() != step.cell()) return;
    }
    CHECK(stride.end_cell() == step.end_cell());
  }
}

FACT(a_ray_of_no_length_stays_in_its_cell) {
  const RayWalker walker({{1.5, -2.0, 3.25}, {1.5, -2.0, 3.25}});
  CHECK(walker.end_in_block(0));
  CHECK((walker.cell() == Cell{1, -2, 3}));
}
