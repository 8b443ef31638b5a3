#pragma once

namespace rayvox {

/// OctoMap's inverse sensor model: log-odds added on a hit and a miss, clamped, all in float32 as OctoMap does.
struct SensorModel {
  /// From probabilities; throws InvalidInput unless 0.5 <= p_hit < 1, 0 < p_miss <= 0.5,
  /// 0 < p_clamp_min < p_clamp_max < 1 and 0 < p_occupied < 1.
  SensorModel(double p_hit, double p_miss, double p_clamp_min, double p_clamp_max, double p_occupied);
  SensorModel() : SensorModel(0.7, 0.4, 0.1192, 0.971, 0.5) {}

  double p_hit, p_miss, p_clamp_min, p_clamp_max, p_occupied;
  float hit_log_odds, miss_log_odds, clamp_min_log_odds, clamp_max_log_odds, occupied_log_odds;

  bool is_occupied(float log_odds) const { return log_odds >= occupied_log_odds; }
};

}  // namespace rayvox
