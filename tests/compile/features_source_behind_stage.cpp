// error: orbis: a matcher has one source, in the first position
#include <orbis/features.hpp>

using namespace orbis::features;

const auto matcher = windowed(hamming{}) | cross_check{} | projected(hamming{});
