// error: orbis: a matcher has one source, and it stands first
#include <orbis/features.hpp>

using namespace orbis::features;

const auto matcher = node_guided(hamming{}) | cross_check{} | projected(hamming{});
