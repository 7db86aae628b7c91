// error: satisf[a-z]+( of)? [^a-z ]+local_optimization
// RANSAC says what making the best model better takes.
#include <orbis/optimize/ransac.hpp>

struct idle {};

using refused = orbis::optimize::ransac_policies<orbis::optimize::msac, orbis::optimize::uniform_sampling,
                                                 orbis::optimize::bail_out, idle>;
refused* made();
