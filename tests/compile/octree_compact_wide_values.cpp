// error: compact_model
#include <cstdint>

#include <orbis/octree/compact_file.hpp>

struct wide {
  using value_type = std::int64_t;
  static constexpr double scale = 1e9;
  static constexpr value_type hit = 847297847;
  static constexpr value_type miss = -405465096;
  static constexpr value_type clamp_min = -2000027890;
  static constexpr value_type clamp_max = 3511030670;
  static constexpr value_type occupancy_threshold = 0;
};

std::string refused(const orbis::octree::occupancy_octree<wide>& map) { return orbis::octree::compact_bytes(map); }
