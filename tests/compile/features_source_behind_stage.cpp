// error: orbis: a matcher has one source, and it stands first
#include <orbis/features.hpp>

using namespace orbis::features;

const auto matcher = windowed(hamming{}) | cross_check{} | projected(hamming{});
