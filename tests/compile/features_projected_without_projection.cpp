// error: searches<
// A source that looks where points project to has to be told the points and what projects them.
#include <orbis/features.hpp>

using namespace orbis::features;

constexpr auto matcher = projected(hamming{}) | unique{};

auto refused(const orbis::features::features& a, const orbis::features::features& b,
             const std::vector<orbis::vec3>& points) {
  return matcher(a, b, points);
}
