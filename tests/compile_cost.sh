#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Counts Eigen's expression classes in a program of three lines: each costs about 80 ms of compile time. The limit
# ensures that small-matrix arithmetic is eager (core/small_matrix.hpp).
# usage: compile_cost.sh INCLUDE_DIR COMPILER_OPTION...   (needs clang++; prints "[skipped]" without)
set -euo pipefail
include=$1
shift
if ! command -v clang++ > /dev/null; then
  echo "[skipped] clang++ was not found; its -ftime-trace lists instantiations"
  exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cat > "$scratch/program.cpp" <<'EOF_PROGRAM'
#include <orbis/camera/any.hpp>
#include <orbis/slam.hpp>
int main() {
  orbis::slam::rgbd_system slam{orbis::camera::any_camera{orbis::camera::pinhole{320, 240, 260, 260, 159.5, 119.5}}};
  slam.track(orbis::camera::rgbd_frame{});
  return static_cast<int>(slam.trajectory().size());
}
EOF_PROGRAM
# -fsyntax-only skips code generation. As an option of cc1 it keeps -o, from which clang derives the name of the trace.
clang++ -std=c++20 -O0 -ftime-trace -ftime-trace-granularity=0 "-I$include" "$@" -Xclang -fsyntax-only \
  -c "$scratch/program.cpp" -o "$scratch/program.o"
found=$(grep -o '"name":"InstantiateClass","args":{"detail":"Eigen::DenseBase<[^"]*' "$scratch/program.json" | grep -vc '>::')
limit=120
echo "$found classes of Eigen, limit $limit"
((found <= limit))
