// error: orbis: a matcher begins with a source, such as brute_force\(hamming\{\}\), followed by stages
#include <orbis/features.hpp>

using namespace orbis::features;

const auto matcher = ratio_test{0.7f} | brute_force(hamming{}) | cross_check{};
