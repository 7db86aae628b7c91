// error: point_range
// A range of numbers is not a cloud.
#include <vector>

#include <orbis/cloud/statistical.hpp>

void refused(const std::vector<float>& numbers) { (void)orbis::cloud::statistical_inliers(orbis::seq, numbers); }
