#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# What a lane costs with NEON and in the portable code, by what it costs with AVX2: builds the programs of this folder for
# this machine, counts their instructions with AVX2 and without anything beyond SSE2, and prints them beside what run.sh
# has counted for ARM. A vector of AVX2 has twice the lanes. See README.md.
#
# usage: bench/board/lanes.sh [FRAMES]
# Needs what run.sh needs, its results in build/board, and libopencv-dev, liboctomap-dev, libpng-dev, libjpeg-dev.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=build/board
for counts in features_1000 octree_5cm slam_kitchen_default; do
  [[ -e $out/$counts.tsv ]] || { echo "lanes.sh: no $out/$counts.tsv: run bench/board/run.sh first" >&2; exit 1; }
done
data=${ORBIS_DATA_DIR:-../shared/data}/kitchen
frames=${1:-120}  # as given to run.sh
native=$out/native
mkdir -p "$native"
flags=(-std=c++20 -O3 -DNDEBUG -ffp-contract=off -w -Iinclude -isystem /usr/include/eigen3 -isystem /usr/include/opencv4)
build() {
  [[ -x $native/$1 && ! bench/board/$1.cpp -nt $native/$1 ]] && return
  echo "compiling $1" >&2
  "${CXX:-g++}" "${flags[@]}" -o "$native/$1" "bench/board/$1.cpp" "${@:2}" -lpng -ljpeg -lz
}
${CC:-gcc} -O2 -Wall -Wextra -fPIC -shared -fvisibility=hidden -o "$out/libcount.so" bench/board/count.c
build features -lopencv_features2d -lopencv_core
build octree -loctomap -loctomath
build slam
count() {  # name of the counts, program and its arguments
  local cpu
  for cpu in max core2duo; do  # QEMU's "max" has AVX2 and no AVX-512
    echo "counting $1 ($cpu)" >&2
    qemu-x86_64 -cpu "$cpu" -plugin "./$out/libcount.so,out=$native/$1_$cpu.tsv" "$native/$2" "${@:3}" >&2 ||
      echo "lanes.sh: $2 failed on $cpu; README.md tells of AVX2 in QEMU 7.2" >&2
  done
}
count features_1000 features "$data" 8 1000 8
count octree_5cm octree "$data" 6 0.05
count slam_kitchen_default slam "$data" 0 "$frames" default
for name in features_1000 octree_5cm slam_kitchen_default; do
  stages=()
  [[ $name == slam_* ]] && stages=(--stages)
  python3 bench/board/table.py --lanes "${stages[@]}" "$out/$name.tsv" "$native/${name}_core2duo.tsv" "$native/${name}_max.tsv"
done
