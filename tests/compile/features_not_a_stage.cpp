// error: orbis: the right operand of \| must be a matching stage
#include <orbis/features.hpp>

using namespace orbis::features;

const auto matcher = brute_force(hamming{}) | 50;
