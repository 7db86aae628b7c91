// error: voxel_payload
#include <memory>

#include <orbis/octree/voxel_layer.hpp>

orbis::octree::voxel_layer<std::unique_ptr<int>> layer;
