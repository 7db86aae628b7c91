#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Compiles the tests of the vector kernels for 64-bit ARM and runs them under qemu-user: they compare every kernel with
# plain code, bit by bit, and here with a compiler that fuses products into sums where it can.
#
# usage: tests/aarch64.sh [Catch2 options]
# Needs g++-aarch64-linux-gnu, qemu-user, libeigen3-dev, libexpected-dev and catch2, as `./run test-aarch64` installs
# them. Objects are kept in build/aarch64 and made again only where something has changed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

compiler=${AARCH64_CXX:-aarch64-linux-gnu-g++}
out=build/aarch64
mkdir -p "$out/include"

# Header-only libraries of this machine; the rest of /usr/include is for another processor.
for library in eigen3/Eigen eigen3/unsupported tl catch2; do
  [[ -e /usr/include/$library ]] && ln -sfn "/usr/include/$library" "$out/include/${library##*/}"
done
flags=(-std=c++20 -O1 -w -Wno-psabi -Iinclude -Itests -isystem "$out/include" '-DORBIS_DATA_DIR="none"')

# Where the kernels' tests stand; those that compare with a library that is not here are left out.
places=(tests/core/simd.cpp tests/core/simd tests/core/rounded.cpp tests/core/bytes.cpp tests/camera/project_lanes.cpp
  tests/camera/shutter_correction.cpp
  tests/features/detail tests/places/detail tests/cloud/detail/knn tests/cloud/detail/rays
  tests/cloud/detail/select/local_shape.cpp tests/optimize/pnp.cpp
  tests/optimize/detail/bundle tests/optimize/detail/sparse tests/optimize/detail/pose
  tests/optimize/bundle_instances*.cpp  # what those of bundle adjustment share
  tests/octree/detail/storage tests/octree/detail/points tests/octree/detail/depth tests/nav/detail/floor
  tests/nav/squared_distances.cpp)
sources=()
while read -r source; do
  grep -qE 'opencv|octomap|orbis/io|interop' "$source" || sources+=("$source")
done < <(for place in "${places[@]}"; do if [[ -e $place ]]; then find "$place" -name '*.cpp'; fi; done | sort)

if [[ -e $out/include/catch2/catch.hpp ]]; then  # Catch2 2
  printf '#define CATCH_CONFIG_MAIN\n#include <catch2/catch.hpp>\n\n#include "support/count_allocations.hpp"\n' >"$out/main.cpp"
else
  echo "tests/aarch64.sh: wants Catch2 2 (catch2/catch.hpp), of which only headers are needed" >&2
  exit 1
fi

{
  printf 'all: %s/tests\n' "$out"
  objects=()
  for source in "${sources[@]}" "$out/main.cpp"; do
    object=$out/${source//\//_}.o
    objects+=("$object")
    printf '%s: %s\n\t@echo "  %s"\n\t@%s %s -MMD -MP -c -o $@ $<\n' "$object" "$source" "$source" "$compiler" \
      "$(printf '%q ' "${flags[@]}")"
  done
  printf '%s/tests: %s\n\t@%s -o $@ $^\n' "$out" "${objects[*]}" "$compiler"
  printf -- '-include %s\n' "${objects[*]/%.o/.d}"
} >"$out/Makefile"
make -f "$out/Makefile" -j "${JOBS:-$(nproc)}" --no-print-directory
exec qemu-aarch64 -L "${AARCH64_ROOT:-/usr/aarch64-linux-gnu}" "$out/tests" "$@"
