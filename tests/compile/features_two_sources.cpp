// error: orbis: a matcher has one source, and it stands first
#include <orbis/features.hpp>

using namespace orbis::features;

const auto matcher = brute_force(hamming{}) | cross_check{} | windowed(hamming{});
