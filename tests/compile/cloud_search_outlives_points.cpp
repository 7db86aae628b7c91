// error: deleted
// A search over a temporary cloud would be left with nothing to search.
#include <vector>

#include <orbis/cloud/nanoflann.hpp>
#include <orbis/core/types.hpp>

void refused() { const orbis::cloud::nanoflann_search<std::vector<orbis::vec3f>> search{std::vector<orbis::vec3f>{}}; }
