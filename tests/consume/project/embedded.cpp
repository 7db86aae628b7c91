// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/cloud/extract.hpp>
#include <orbis/octree/key.hpp>

int main() {
  return orbis::octree::morton_key(orbis::octree::morton_code({1, 2, 3})) == orbis::octree::voxel_key{1, 2, 3} ? 0 : 1;
}
