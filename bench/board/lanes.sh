#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# What a lane costs with NEON and in the portable code, by what it costs with AVX2: builds the programs of this folder for
# this machine, an x86-64 one, counts their instructions with AVX2 and without anything beyond SSE2, and prints them beside
# what run.sh has counted for ARM, of as many frames. A vector of AVX2 has twice the lanes. See README.md.
#
# usage: bench/board/lanes.sh
# Needs what run.sh needs, its results in build/board, and libopencv-dev, liboctomap-dev, libpng-dev, libjpeg-dev.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
data=${ORBIS_DATA_DIR:-$here/../../../shared/data}/kitchen
fail() {
  printf 'lanes.sh: %s\n' "$1" >&2
  exit 1
}
[[ -d $data ]] || fail "no recording $data (ORBIS_DATA_DIR)"
data=$(cd "$data" && pwd)
for tool in "${CC:-gcc}" "${CXX:-g++}" qemu-x86_64 python3; do
  command -v "$tool" >/dev/null || fail "$tool is not here"
done
cd "$here/../.."
out=build/board
names=(features_1000 octree_5cm slam_kitchen_default)
for name in "${names[@]}"; do [[ -e $out/$name.tsv ]] || fail "no $out/$name.tsv: run bench/board/run.sh first"; done
frames=$(grep -c '^frame' "$out/slam_kitchen_default.tsv")  # those that run.sh was told
native=$out/native
mkdir -p "$native"
flags=(-std=c++20 -O3 -DNDEBUG -ffp-contract=off -w -Iinclude -MMD -isystem /usr/include/eigen3
  -isystem /usr/include/opencv4)

. bench/board/programs.sh
build() {
  outdated "$native/$1" || return 0
  echo "compiling $1" >&2
  "${CXX:-g++}" "${flags[@]}" -MF "$native/$1.d" -o "$native/$1" "bench/board/$1.cpp" "${@:2}" -lpng -ljpeg -lz
}
build_plugin "$out/libcount.so"
build features -lopencv_features2d -lopencv_core
build octree -loctomap -loctomath
build slam
count() {  # name of the counts, processor, program and its arguments
  echo "counting $1 ($2)" >&2
  rm -f "$native/$1_$2.tsv"
  qemu-x86_64 -cpu "$2" -plugin "./$out/libcount.so,out=$native/$1_$2.tsv" "$native/$3" "${@:4}" >&2
}
for cpu in max core2duo; do  # QEMU's "max" has AVX2 and no AVX-512
  count features_1000 "$cpu" features "$data" 8 1000 8
  if ! count octree_5cm "$cpu" octree "$data" 6 0.05; then  # the program fails where the map is not OctoMap's
    [[ $cpu == max && -s $native/octree_5cm_max.tsv ]] || fail "octree failed"
    echo "lanes.sh: another map than OctoMap's; README.md tells of AVX2 in QEMU 7.2" >&2
  fi
  count slam_kitchen_default "$cpu" slam "$data" 0 "$frames" default
done
for name in "${names[@]}"; do
  stages=()
  [[ $name == slam_* ]] && stages=(--stages)
  python3 bench/board/table.py --lanes "${stages[@]}" "$out/$name.tsv" "$native/${name}_core2duo.tsv" "$native/${name}_max.tsv"
done
