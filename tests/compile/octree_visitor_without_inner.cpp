// error: tree_visitor
// A visitor of the whole tree is shown its inner nodes too.
#include <orbis/octree.hpp>

struct leaves_only {
  void leaf(const orbis::octree::voxel_key&, int, float) {}
};

void refused(const orbis::octree::occupancy_octree<>& map) { map.visit_tree(leaves_only{}); }
