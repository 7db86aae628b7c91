// error: epipolar_geometry
// A bare matrix does not say which image its lines are of.
#include <orbis/features.hpp>

using namespace orbis::features;

constexpr auto matcher = epipolar(hamming{}) | cross_check{};

auto refused(const orbis::features::features& a, const orbis::features::features& b, const orbis::mat3& F) {
  return matcher(a, b, F);
}
