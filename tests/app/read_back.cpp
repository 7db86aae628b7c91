// SPDX-License-Identifier: BSD-3-Clause
//
// read_back MAP.bt: reads with OctoMap, and prints nodes, resolution, occupied and free leaves, and what is
// known about the place (1, 2, 0.5).
#include <cstdio>

#include <octomap/octomap.h>

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  octomap::OcTree tree{1.0};
  if (!tree.readBinary(argv[1])) return 2;
  std::size_t occupied = 0, free = 0;
  for (auto it = tree.begin_leafs(), end = tree.end_leafs(); it != end; ++it)
    ++(tree.isNodeOccupied(*it) ? occupied : free);
  const auto* node = tree.search(1.0, 2.0, 0.5);
  std::printf("%zu %g %zu %zu 1 2 0.5 %s\n", tree.size(), tree.getResolution(), occupied, free,
              node == nullptr             ? "unknown"
              : tree.isNodeOccupied(node) ? "occupied"
                                          : "free");
  return 0;
}
