// error: point_range
// Only ranges of points can be written as a cloud.
#include <string>
#include <vector>

#include <orbis/io/ply.hpp>

void refused(const std::vector<std::string>& names) { (void)orbis::io::write_ply("names.ply", names, {}); }
