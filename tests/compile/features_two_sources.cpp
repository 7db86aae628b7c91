// error: orbis: a matcher has one source, in the first position
#include <orbis/features.hpp>

using namespace orbis::features;

const auto matcher = brute_force(hamming{}) | cross_check{} | windowed(hamming{});
