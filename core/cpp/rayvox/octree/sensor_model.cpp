#include "rayvox/octree/sensor_model.hpp"

#include <cmath>
#include <string>

#include "rayvox/error.hpp"

namespace rayvox {
namespace {

float log_odds_of(double probability) { return static_cast<float>(std::log(probability / (1.0 - probability))); }

// Written so that a NaN fails too.
void require(bool holds, const char* name, double value, const char* range) {
  if (!holds) throw InvalidInput(std::string(name) + " must be " + range + ", got " + std::to_string(value));
}

}  // namespace

SensorModel::SensorModel(double hit, double miss, double clamp_min, double clamp_max, double occupied)
    : p_hit(hit), p_miss(miss), p_clamp_min(clamp_min), p_clamp_max(clamp_max), p_occupied(occupied) {
  require(hit >= 0.5 && hit < 1, "p_hit", hit, "in [0.5, 1)");
  require(miss > 0 && miss <= 0.5, "p_miss", miss, "in (0, 0.5]");
  require(clamp_min > 0 && clamp_min < 1, "p_clamp_min", clamp_min, "in (0, 1)");
  require(clamp_max > clamp_min && clamp_max < 1, "p_clamp_max", clamp_max, "in (p_clamp_min, 1)");
  require(occupied > 0 && occupied < 1, "p_occupied", occupied, "in (0, 1)");
  hit_log_odds = log_odds_of(hit);
  miss_log_odds = log_odds_of(miss);
  clamp_min_log_odds = log_odds_of(clamp_min);
  clamp_max_log_odds = log_odds_of(clamp_max);
  occupied_log_odds = log_odds_of(occupied);
}

}  // namespace rayvox
