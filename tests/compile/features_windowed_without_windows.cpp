// error: searches<
// A source that looks into windows has to be told them.
#include <orbis/features.hpp>

using namespace orbis::features;

constexpr auto matcher = windowed(hamming{}) | unique{};

auto refused(const orbis::features::features& a, const orbis::features::features& b) { return matcher(a, b); }
